//! `bondline study`: prediction, uncertainty, sensitivity and estimate in one report.

use crate::command::args::convert;
use crate::command::args::{Ask, Fit, Sweep, Trusted, Walk};
use crate::command::exit::{Ending, Failure, input};
use crate::command::run::{Run, load, too_many_failed};
use bondline::session::StudyOptions;

pub(crate) fn run(ask: &Ask, sweep: &Sweep, data: &Trusted, fit: &Fit, walk: &Walk) -> Result<Ending, Failure> {
    let options = StudyOptions {
        sweep: convert::sweep(sweep),
        observations: convert::observations(data)?,
        fit: convert::fit(fit)?,
        posterior: convert::walkers(walk, sweep.seed),
    };
    let case = load(&ask.case, &ask.on)?;
    let typed = fit.typed().or(walk.posterior.then_some("--posterior"));
    if let (Some(why), Some(option)) = (options.check(&case)?, typed) {
        return Err(input(format!("{option}: nothing is estimated: {why}")));
    }
    let mut run = Run::of("study", ask, case)?;
    let answers = run.session.study(&options)?;
    let failed = answers.uncertainty.as_ref().and_then(|outcome| too_many_failed(outcome, sweep.max_failed));
    let not_estimated = answers.not_estimated.clone();
    run.done();
    if let Some(why) = not_estimated.filter(|_| !ask.on.quiet) {
        eprintln!("no estimation: {why}");
    }
    run.end(failed)
}
