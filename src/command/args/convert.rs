//! From what was typed to what the library takes.

use crate::command::args::{
    BackendKind, BoundsKind, Fit, Limit, Method, Minimiser, On, PrecisionKind, PriorKind, SamplingKind, Sweep, Trusted,
    Walk,
};
use crate::command::exit::{Failure, input};
use crate::command::progress::Bar;
use bondline::case::unit::{Dimension, quantity};
use bondline::case::{Bounds, LossFunction};
use bondline::ensemble::{self, Sampling};
use bondline::fit::Rules;
use bondline::march::Precision;
use bondline::march::choose::{Choice, Kind};
use bondline::session::{
    Derivatives, FitOptions, ObservationSelection, Options, SensitivityOptions, SizeOptions, Start, UncertaintyOptions,
};
use bondline::study::estimate::PAPER;
use bondline::study::posterior::Walkers;
use std::ops::Range;

/// # Errors
/// A device is named for a march on the processor.
pub(crate) fn choice(on: &On) -> Result<Choice, Failure> {
    if let (BackendKind::Cpu, Some(device)) = (on.backend, &on.device) {
        return Err(input(format!(
            "--device {device:?} names a Vulkan device and --backend cpu takes none: leave one of them out"
        )));
    }
    Ok(Choice {
        kind: match on.backend {
            BackendKind::Auto => Kind::Auto,
            BackendKind::Cpu => Kind::Cpu,
            BackendKind::Gpu => Kind::Gpu,
        },
        precision: on.precision.map(|precision| match precision {
            PrecisionKind::F32 => Precision::F32,
            PrecisionKind::F64 => Precision::F64,
        }),
        device: on.device.clone(),
    })
}

pub(crate) fn bounds(bounds: BoundsKind) -> Bounds {
    match bounds {
        BoundsKind::Small => Bounds::Small,
        BoundsKind::Large => Bounds::Large,
    }
}

pub(crate) fn sampling(sweep: &Sweep) -> Sampling {
    let kind = match sweep.sampling {
        SamplingKind::Normal => ensemble::SamplingKind::Normal,
        SamplingKind::Uniform => ensemble::SamplingKind::Uniform,
        SamplingKind::Lhs => ensemble::SamplingKind::LatinHypercube,
        SamplingKind::Sobol => ensemble::SamplingKind::Sobol,
    };
    Sampling { kind, seed: sweep.seed }
}

/// `A..B`, members of so many drawn.
pub(crate) fn piece(text: &str, drawn: usize) -> Result<Range<usize>, Failure> {
    let ends = text.split_once("..").map(|(first, end)| (first.trim().parse(), end.trim().parse()));
    match ends {
        Some((Ok(first), Ok(end))) if first < end && end <= drawn => Ok(first..end),
        Some((Ok::<usize, _>(first), Ok::<usize, _>(end))) => Err(input(format!(
            "--members {text}: expected a first member before the end, and an end no higher than the {drawn} drawn \
             (-n), found {first} and {end}"
        ))),
        _ => {
            Err(input(format!("--members {text:?}: expected FIRST..END such as 0..2500, which ends with member 2499")))
        }
    }
}

/// `NAME=VALUE` in two.
fn halves<'a>(text: &'a str, option: &str) -> Result<(&'a str, &'a str), Failure> {
    text.split_once('=').ok_or_else(|| input(format!("{option} {text:?}: expected NAME=VALUE")))
}

pub(crate) fn sets(sets: &[String]) -> Result<Vec<(String, String)>, Failure> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for set in sets {
        let (name, value) = halves(set, "--set")?;
        if pairs.iter().any(|(earlier, _)| earlier == name) {
            return Err(input(format!("--set names {name:?} twice")));
        }
        pairs.push((name.to_owned(), value.to_owned()));
    }
    Ok(pairs)
}

/// `NAME=VALUE,...` with values above zero.
pub(crate) fn values(texts: &[String], option: &str) -> Result<Vec<(String, f64)>, Failure> {
    let value = |text: &String| {
        let (name, value) = halves(text, option)?;
        Ok((name.trim().to_owned(), number(text, value, option)?))
    };
    texts.iter().map(value).collect()
}

fn number(text: &str, value: &str, option: &str) -> Result<f64, Failure> {
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(input(format!("{option} {text:?}: expected a number above zero, found {value:?}"))),
    }
}

fn trimmed(names: &[String]) -> Vec<String> {
    names.iter().map(|name| name.trim().to_owned()).collect()
}

/// What is typed of the march, with a progress bar.
pub(crate) fn options(on: &On, bar: &Bar) -> Result<Options, Failure> {
    let choice = choice(on)?;
    let bar = bar.clone();
    let mut options = Options::default().backend(choice.kind).progress(move |progress| bar.show(progress));
    (options.precision, options.device) = (choice.precision, choice.device);
    Ok(options)
}

pub(crate) fn sweep(sweep: &Sweep) -> UncertaintyOptions {
    let Sampling { kind, seed } = sampling(sweep);
    let bounds = sweep.spread.map_or(Bounds::Small, bounds);
    UncertaintyOptions { members: sweep.members, sampling: kind, seed, bounds }
}

pub(crate) fn observations(data: &Trusted) -> Result<ObservationSelection, Failure> {
    Ok(ObservationSelection {
        sensors: trimmed(&data.sensors),
        window_s: data.window.as_deref().map(window).transpose()?,
        bounds: data.bounds.map(bounds),
    })
}

fn window(text: &str) -> Result<(f64, f64), Failure> {
    let ends: Vec<Option<f64>> = text.split(':').map(|end| end.trim().parse().ok()).collect();
    match ends[..] {
        [Some(start), Some(end)] => Ok((start, end)),
        _ => Err(input(format!("--window {text:?}: expected START:END in seconds, such as 0:80"))),
    }
}

pub(crate) fn fit(fit: &Fit) -> Result<FitOptions, Failure> {
    let loss = fit.loss.as_deref().map(LossFunction::named).transpose();
    let loss = loss.map_err(|message| input(format!("--loss {:?}: {message}", fit.loss.as_deref().unwrap_or(""))))?;
    let start = |(name, value): (String, f64)| {
        let (factor, case) = name.split_once('@').map_or((name.as_str(), None), |(name, id)| (name, Some(id)));
        Start { factor: factor.to_owned(), case: case.map(str::to_owned), value }
    };
    Ok(FitOptions {
        factors: trimmed(&fit.factors),
        start: values(&fit.start, "--start")?.into_iter().map(start).collect(),
        loss,
        prior: fit.prior.map(|prior| match prior {
            PriorKind::None => None,
            PriorKind::Small => Some(Bounds::Small),
            PriorKind::Large => Some(Bounds::Large),
        }),
        rules: match fit.minimiser {
            Minimiser::TrustRegion => Rules::Radius,
            Minimiser::Paper => PAPER,
        },
        starts: fit.starts,
        profiles: fit.profile.clone(),
        max_iterations: fit.patience,
    })
}

/// The walkers of a posterior, where one is wanted.
pub(crate) fn walkers(walk: &Walk, seed: u64) -> Option<Walkers> {
    walk.posterior.then_some(Walkers { number: walk.walkers, moves: walk.moves, seed })
}

pub(crate) fn sensitivity(
    data: &Trusted,
    method: Option<Method>,
    step: Option<f64>,
) -> Result<SensitivityOptions, Failure> {
    let derivatives = match (method, step) {
        (Some(Method::Tangent), Some(step)) => {
            return Err(input(format!(
                "--step {step}: --method tangent takes no step; leave one of them out, or take --method difference"
            )));
        }
        (Some(Method::Difference), step) => Derivatives::Difference(step),
        (None, Some(step)) => Derivatives::Difference(Some(step)),
        (Some(Method::Tangent) | None, None) => Derivatives::Exact,
    };
    Ok(SensitivityOptions { observations: observations(data)?, derivatives })
}

/// The limit of a sensor, and the ply that is to hold it.
pub(crate) fn size(limit: &Limit, sweep: &Sweep) -> Result<SizeOptions, Failure> {
    let Limit { ply, limit, probability, between } = limit;
    let (sensor, most) = limit
        .split_once('<')
        .ok_or_else(|| input(format!("--limit {limit:?}: expected SENSOR < TEMPERATURE, such as \"TC4 < 623 K\"")))?;
    let limit_k = measured(most.trim_start_matches('='), Dimension::Temperature, "--limit")?;
    let within_m = match between.as_deref().map(|text| (text, text.split_once(':'))) {
        None => None,
        Some((_, Some((thinnest, thickest)))) => Some((
            measured(thinnest, Dimension::Length, "--between")?,
            measured(thickest, Dimension::Length, "--between")?,
        )),
        Some((text, None)) => {
            let expected = "expected THINNEST:THICKEST with units, such as \"3 mm:20 mm\"";
            return Err(input(format!("--between {text:?}: {expected}")));
        }
    };
    Ok(SizeOptions {
        probability: *probability,
        within_m,
        sweep: self::sweep(sweep),
        ..SizeOptions::new(ply.as_str(), sensor.trim(), limit_k)
    })
}

fn measured(text: &str, dimension: Dimension, option: &str) -> Result<f64, Failure> {
    quantity(text.trim(), dimension).map_err(|message| input(format!("{option} {text:?}: {message}")))
}

/// A standard deviation or a time that may be none.
pub(crate) fn none_or_more(text: &str, dimension: Dimension, option: &str) -> Result<f64, Failure> {
    let value = measured(text, dimension, option)?;
    if value < 0.0 {
        let unit = if dimension == Dimension::Time { "s" } else { "K" };
        return Err(input(format!("{option} {text:?}: expected no less than 0 {unit}")));
    }
    Ok(value)
}
