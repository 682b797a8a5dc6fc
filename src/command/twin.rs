//! `bondline twin`: synthetic observations from known factors, and coverage studies of many sets of them.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, FitArgs, ObservationArgs, ResumeArgs, TwinArgs};
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::command::progress::MarchProgress;
use crate::command::run::{Run, load};
use crate::march::Precision;
use crate::report;
use crate::session::Session;
use crate::session::TwinOptions;
use std::path::{Path, PathBuf};

/// Write the observations of one set of true factors.
pub(crate) fn write_observations(
    args: &TwinArgs,
    resume: &ResumeArgs,
    data: &ObservationArgs,
    fit: &FitArgs,
) -> Result<Output, Failure> {
    let given_options = [
        (!data.sensors.is_empty()).then_some("--sensors"),
        data.window.as_ref().map(|_| "--window"),
        data.bounds.map(|_| "--bounds"),
        (!fit.factors.is_empty()).then_some("--factors"),
        fit.given_option(),
        resume.given_option(),
    ];
    if let Some(option) = given_options.into_iter().flatten().next() {
        return Err(input(format!(
            "{option}: without --study N nothing is fitted, and observations are written for every sensor"
        )));
    }
    let case = load(&args.case, &args.march)?;
    let options = TwinOptions {
        truth: convert::positive_values(&args.truth, "--truth")?,
        noise_k: convert::noise_k(args)?.unwrap_or(0.0),
        correlation_s: convert::correlation_s(args)?,
        seed: args.seed.unwrap_or(1),
    };
    options.check(&case)?;
    let of_noise = [args.seed.map(|_| "--seed"), args.correlation_time.as_ref().map(|_| "--correlation-time")];
    if let (Some(option), true) = (of_noise.into_iter().flatten().next(), options.noise_k == 0.0) {
        return Err(input(format!("{option} without noise has no effect: give --noise, such as --noise \"2 K\"")));
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("measured.csv"));
    if out.exists() && !args.force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    report::files::check_writable(out.parent().unwrap_or(Path::new("."))).map_err(unusable_folder)?;
    let progress = MarchProgress::new(args.march.quiet);
    let mut march = convert::options(&args.march, &progress)?;
    march.precision = march.precision.or(Some(Precision::F64));
    let mut session = Session::open(case, &march)?;
    let made = session.twin(&options)?;
    progress.clear();
    report::files::write_observations(&out, session.case(), &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {} K, seed {}: {}\n",
        made.instants_s.len(),
        session.case().sensors().len(),
        options.noise_k,
        options.seed,
        out.display()
    );
    Ok(Output { text, failure: None })
}

/// Fit many synthetic data sets and count how often the intervals contain the true factors.
pub(crate) fn coverage_study(
    args: &TwinArgs,
    resume: &ResumeArgs,
    data: &ObservationArgs,
    fit: &FitArgs,
    data_sets: usize,
) -> Result<Output, Failure> {
    let options = convert::twin_study(args, data, fit, data_sets)?;
    let case_args = CaseArgs {
        case: args.case.clone(),
        out: args.out.clone(),
        force: args.force,
        json: args.json,
        limit_time: args.limit_time.clone(),
        march: args.march.clone(),
    };
    let case = load(&case_args.case, &case_args.march)?;
    options.check(&case)?;
    let mut run = Run::open_resumable("twin", &case_args, case, resume)?;
    run.session.twin_study(&options)?;
    run.finish(None)
}
