//! `bondline estimate`: factors fitted to observations.

use crate::command::args::convert;
use crate::command::args::{Ask, Fit, Trusted, Walk};
use crate::command::exit::{Ending, Failure};
use crate::command::run::{Run, load, load_all};
use bondline::session::EstimateOptions;
use std::path::{Path, PathBuf};

/// Arguments of an estimate.
pub(crate) struct Arguments<'a> {
    pub others: &'a [PathBuf],
    pub beside: Option<&'a Path>,
    pub data: &'a Trusted,
    pub fit: &'a Fit,
    pub walk: &'a Walk,
    pub seed: u64,
}

pub(crate) fn run(ask: &Ask, arguments: &Arguments<'_>) -> Result<Ending, Failure> {
    let mut cases = load_all(std::iter::once(&ask.case).chain(arguments.others), &ask.on)?;
    let ids: Vec<&str> = cases.iter().map(|case| case.id()).collect();
    let id = ids.join("+");
    let others = cases.split_off(1);
    let case = cases.remove(0);
    let options = EstimateOptions {
        others,
        beside: arguments.beside.map(|path| load(path, &ask.on)).transpose()?,
        observations: convert::observations(arguments.data)?,
        fit: convert::fit(arguments.fit)?,
        posterior: convert::walkers(arguments.walk, arguments.seed),
    };
    options.check(&case)?;
    let mut run = Run::open("estimate", ask, case, &id)?;
    run.session.estimate(&options)?;
    run.end(None)
}
