//! `bondline estimate`: factors fitted to observations.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, FitArgs, ObservationArgs, PosteriorArgs, ResumeArgs};
use crate::command::exit::{Failure, Output, input};
use crate::command::run::{Run, load, load_all};
use crate::session::EstimateOptions;
use std::path::{Path, PathBuf};

/// Arguments of an estimate.
pub(crate) struct Arguments<'a> {
    pub others: &'a [PathBuf],
    pub compare: Option<&'a Path>,
    pub data: &'a ObservationArgs,
    pub fit: &'a FitArgs,
    pub posterior: &'a PosteriorArgs,
    pub seed: u64,
    pub resume: &'a ResumeArgs,
}

pub(crate) fn run(args: &CaseArgs, arguments: &Arguments<'_>) -> Result<Output, Failure> {
    let mut cases = load_all(std::iter::once(&args.case).chain(arguments.others), &args.march)?;
    let ids: Vec<&str> = cases.iter().map(|case| case.id()).collect();
    let id = ids.join("+");
    let others = cases.split_off(1);
    let case = cases.remove(0);
    let options = EstimateOptions {
        other_cases: others,
        comparison_case: arguments.compare.map(|path| load(path, &args.march)).transpose()?,
        observations: convert::observations(arguments.data)?,
        fit: convert::fit(arguments.fit)?,
        posterior: convert::walkers(arguments.posterior, arguments.seed),
    };
    options.check(&case)?;
    let has_posterior = options.posterior.is_some();
    if let (false, Some(option)) = (has_posterior, arguments.resume.given_option()) {
        return Err(input(format!("{option}: without --posterior nothing is kept")));
    }
    let mut run = Run::open_with("estimate", args, case, &id, has_posterior.then_some(arguments.resume))?;
    run.session.estimate(&options)?;
    run.finish(None)
}
