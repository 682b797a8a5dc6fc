//! `twin`: synthetic observations from known factors, and studies of many.

use crate::command::args::convert;
use crate::command::args::{Ask, Fit, Trusted, Twin};
use crate::command::exit::{Ending, Failure, input};
use crate::command::load;
use crate::command::progress::Watched;
use bondline::case::unit::Dimension;
use bondline::case::{Bounds, Case};
use bondline::march::{March, Precision, choose};
use bondline::pilot::pilot;
use bondline::plan::Plan;
use bondline::report;
use bondline::study::estimate::{EstimateError, Search};
use bondline::study::recovery::{Recovery, recovery};
use bondline::study::twin::{Noise, TwinError, twin};
use std::path::PathBuf;

/// Make the observations of one truth.
pub(crate) fn make(asked: &Twin, data: &Trusted, fit: &Fit) -> Result<Ending, Failure> {
    let typed = [
        (!data.sensors.is_empty()).then_some("--sensors"),
        data.window.as_ref().map(|_| "--window"),
        data.bounds.map(|_| "--bounds"),
        (!fit.factors.is_empty()).then_some("--factors"),
        fit.typed(),
    ];
    if let Some(option) = typed.into_iter().flatten().next() {
        return Err(input(format!(
            "{option}: observations are made at every sensor and fitted to nothing; give --study N to fit twins"
        )));
    }
    let case = load(&asked.case, &asked.on)?;
    let mut row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
    for (factor, value) in convert::values(&case, &asked.truth, "--truth")? {
        row[factor] = value;
    }
    let noise_k = noise_k(asked)?.unwrap_or(0.0);
    let noise = noise(asked)?;
    let idle = [asked.seed.map(|_| "--seed"), asked.correlation.as_ref().map(|_| "--correlation")];
    if let (Some(option), true) = (idle.into_iter().flatten().next(), noise_k == 0.0) {
        return Err(input(format!("{option} without noise changes nothing: give --noise, such as --noise \"2 K\"")));
    }
    let out = asked.out.clone().unwrap_or_else(|| PathBuf::from("measured.csv"));
    if out.exists() && !asked.force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    let plan = pilot(&case)?;
    let mut choice = convert::choice(&asked.on)?;
    choice.precision = choice.precision.or(Some(Precision::F64));
    let mut march = Watched::new(choose::open_extrapolated(&choice, &plan, 1)?, asked.on.quiet);
    let made = twin(&case, &plan, &mut march, row, noise_k, &noise).map_err(|error| match error {
        TwinError::March(error) => error.into(),
        other => input(other),
    })?;
    march.done();
    report::files::measured(&out, &case, &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {noise_k} K, seed {}: {}\n",
        made.instants_s.len(),
        case.sensors.len(),
        noise.seed,
        out.display()
    );
    Ok(Ending { text, why: None })
}

/// A study of twins as a question about a case.
pub(crate) fn ask(asked: &Twin) -> Ask {
    Ask { case: asked.case.clone(), out: asked.out.clone(), force: asked.force, json: asked.json, on: asked.on.clone() }
}

/// Make many data sets and fit them.
pub(crate) fn study(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    asked: &Twin,
    fit: &Fit,
    twins: usize,
) -> Result<Recovery, Failure> {
    if twins < 2 {
        return Err(input(format!("--study {twins}: a study needs at least 2 data sets")));
    }
    if !fit.profile.is_empty() {
        return Err(input("--profile: a study judges the intervals that every estimate has; no profile is part of it"));
    }
    let search = Search { landscape: false, ..convert::search(fit, march.backend().precision)? };
    let outcome = recovery(case, plan, march, &search, Bounds::Small, noise_k(asked)?, noise(asked)?, twins);
    outcome.map_err(|error| match error {
        EstimateError::March(error) => error.into(),
        other => input(other),
    })
}

fn noise_k(asked: &Twin) -> Result<Option<f64>, Failure> {
    let deviation = |text| convert::none_or_more(text, Dimension::TemperatureDifference, "--noise");
    asked.noise.as_deref().map(deviation).transpose()
}

/// The seed of truths and noise.
pub(crate) fn seed(asked: &Twin) -> u64 {
    asked.seed.unwrap_or(1)
}

fn noise(asked: &Twin) -> Result<Noise, Failure> {
    let time = |text| convert::none_or_more(text, Dimension::Time, "--correlation");
    let correlation_s = asked.correlation.as_deref().map_or(Ok(0.0), time)?;
    Ok(Noise { correlation_s, seed: seed(asked) })
}
