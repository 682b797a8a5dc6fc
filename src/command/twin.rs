//! `bondline twin`: synthetic observations from known factors, and studies of many.

use crate::command::args::convert;
use crate::command::args::{Ask, Fit, Trusted, Twin};
use crate::command::exit::{Ending, Failure, input};
use crate::command::progress::Bar;
use crate::command::run::{Run, load};
use bondline::Session;
use bondline::case::unit::Dimension;
use bondline::march::Precision;
use bondline::report;
use bondline::session::{TwinOptions, TwinStudyOptions};
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
    let options = TwinOptions {
        truth: convert::values(&asked.truth, "--truth")?,
        noise_k: noise_k(asked)?.unwrap_or(0.0),
        correlation_s: correlation_s(asked)?,
        seed: seed(asked),
    };
    options.check(&case)?;
    let idle = [asked.seed.map(|_| "--seed"), asked.correlation.as_ref().map(|_| "--correlation")];
    if let (Some(option), true) = (idle.into_iter().flatten().next(), options.noise_k == 0.0) {
        return Err(input(format!("{option} without noise changes nothing: give --noise, such as --noise \"2 K\"")));
    }
    let out = asked.out.clone().unwrap_or_else(|| PathBuf::from("measured.csv"));
    if out.exists() && !asked.force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    let bar = Bar::new(asked.on.quiet);
    let mut march = convert::options(&asked.on, &bar)?;
    march.precision = march.precision.or(Some(Precision::F64));
    let mut session = Session::open(case, &march)?;
    let made = session.twin(&options)?;
    bar.done();
    report::files::measured(&out, session.case(), &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {} K, seed {}: {}\n",
        made.instants_s.len(),
        session.case().sensors().len(),
        options.noise_k,
        options.seed,
        out.display()
    );
    Ok(Ending { text, why: None })
}

/// Make many data sets and fit them.
pub(crate) fn study(asked: &Twin, data: &Trusted, fit: &Fit, twins: usize) -> Result<Ending, Failure> {
    let options = TwinStudyOptions {
        observations: convert::observations(data)?,
        fit: convert::fit(fit)?,
        noise_k: noise_k(asked)?,
        correlation_s: correlation_s(asked)?,
        seed: seed(asked),
        ..TwinStudyOptions::new(twins)
    };
    let ask = Ask {
        case: asked.case.clone(),
        out: asked.out.clone(),
        force: asked.force,
        json: asked.json,
        on: asked.on.clone(),
    };
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("twin", &ask, case)?;
    run.session.twin_study(&options)?;
    run.end(None)
}

fn noise_k(asked: &Twin) -> Result<Option<f64>, Failure> {
    let deviation = |text| convert::none_or_more(text, Dimension::TemperatureDifference, "--noise");
    asked.noise.as_deref().map(deviation).transpose()
}

fn correlation_s(asked: &Twin) -> Result<f64, Failure> {
    let time = |text| convert::none_or_more(text, Dimension::Time, "--correlation");
    asked.correlation.as_deref().map_or(Ok(0.0), time)
}

/// The seed of truths and noise.
fn seed(asked: &Twin) -> u64 {
    asked.seed.unwrap_or(1)
}
