//! `bondline study`: prediction, uncertainty, sensitivity and estimate in one report.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, FitArgs, ObservationArgs, PosteriorArgs, ProfileArgs, ResumeArgs, SweepArgs};
use crate::command::exit::{Failure, Output, input};
use crate::command::run::{Run, load, too_many_failed};
use crate::command::terminal::print_error;
use crate::session::StudyOptions;

/// What a study keeps and adds.
pub(crate) struct Kept<'a> {
    pub resume: &'a ResumeArgs,
    pub profiles: &'a ProfileArgs,
}

pub(crate) fn run(
    args: &CaseArgs,
    sweep: &SweepArgs,
    kept: &Kept<'_>,
    data: &ObservationArgs,
    fit: &FitArgs,
    posterior: &PosteriorArgs,
) -> Result<Output, Failure> {
    let options = StudyOptions {
        sweep: convert::sweep(sweep),
        observations: convert::observations(data)?,
        fit: convert::fit(fit)?,
        posterior: convert::walkers(posterior, sweep.seed),
    };
    let case = load(&args.case, &args.march)?;
    let given_option = fit.given_option().or(posterior.posterior.then_some("--posterior"));
    if let (Some(reason), Some(option)) = (options.check(&case)?, given_option) {
        return Err(input(format!("{option}: nothing is estimated: {reason}")));
    }
    let profiles = convert::depth_profiles(kept.profiles, &case)?;
    let mut run = Run::open_resumable("study", args, case, kept.resume)?;
    run.session.set_depth_profiles(profiles)?;
    let answers = run.session.study(&options)?;
    let failure = answers
        .uncertainty
        .as_ref()
        .and_then(|outcome| too_many_failed(&outcome.failures, outcome.members, sweep.max_failed));
    let not_estimated = answers.not_estimated.clone();
    run.clear_progress();
    if let Some(reason) = not_estimated.filter(|_| !args.march.quiet) {
        print_error(&format!("no estimation: {reason}"));
    }
    run.finish(failure)
}
