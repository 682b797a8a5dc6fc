//! From what was typed to what the library takes.

use crate::cli::{BackendKind, BoundsKind, Fit, On, PrecisionKind, SamplingKind, Sweep, Trusted};
use crate::ending::{Failure, input};
use bondline::case::unit::{Dimension, quantity};
use bondline::case::{Bounds, Case};
use bondline::ensemble::{self, Sampling};
use bondline::march::Precision;
use bondline::march::choose::{Choice, Kind};
use std::ops::Range;

pub(crate) fn choice(on: &On) -> Choice {
    Choice {
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
    }
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
    sets.iter().map(|set| halves(set, "--set").map(|(name, value)| (name.to_owned(), value.to_owned()))).collect()
}

/// Factors by name, with their values.
pub(crate) fn values(case: &Case, texts: &[String], option: &str) -> Result<Vec<(usize, f64)>, Failure> {
    texts
        .iter()
        .map(|text| {
            let (name, value) = halves(text, option)?;
            let factor = factor(case, name, option)?;
            match value.trim().parse::<f64>() {
                Ok(value) if value.is_finite() && value > 0.0 => Ok((factor, value)),
                _ => Err(input(format!("{option} {text:?}: expected a number above zero, found {value:?}"))),
            }
        })
        .collect()
}

fn factor(case: &Case, name: &str, option: &str) -> Result<usize, Failure> {
    let names: Vec<&str> = case.factors.iter().map(|factor| factor.name.as_str()).collect();
    find(&names, name.trim(), option, "factor")
}

fn find(names: &[&str], name: &str, option: &str, noun: &str) -> Result<usize, Failure> {
    names.iter().position(|known| *known == name).ok_or_else(|| {
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        input(format!("{option}: no {noun} is called {name:?}; there are {known}"))
    })
}

/// The sensors, window and side constraints typed take the place of the case's own.
pub(crate) fn trust(case: &mut Case, data: &Trusted) -> Result<(), Failure> {
    if !data.sensors.is_empty() {
        let names: Vec<&str> = case.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        case.estimate.sensors = data
            .sensors
            .iter()
            .map(|name| find(&names, name.trim(), "--sensors", "sensor"))
            .collect::<Result<_, _>>()?;
    }
    if let Some(window) = &data.window {
        case.estimate.window_s = Some(self::window(window)?);
    }
    if let Some(kind) = data.bounds {
        case.estimate.bounds = bounds(kind);
    }
    Ok(())
}

fn window(text: &str) -> Result<(f64, f64), Failure> {
    let ends: Vec<Option<f64>> = text.split(':').map(|end| end.trim().parse().ok()).collect();
    match ends[..] {
        [Some(start), Some(end)] if start < end => Ok((start, end)),
        [Some(start), Some(end)] => {
            Err(input(format!("--window {text:?}: expected a start before the end, found {start} s and {end} s")))
        }
        _ => Err(input(format!("--window {text:?}: expected START:END in seconds, such as 0:80"))),
    }
}

/// The factors and start typed take the place of the case's own.
pub(crate) fn fit(case: &mut Case, fit: &Fit) -> Result<(), Failure> {
    if !fit.factors.is_empty() {
        let chosen: Vec<usize> =
            fit.factors.iter().map(|name| factor(case, name, "--factors")).collect::<Result<_, _>>()?;
        for (place, factor) in chosen.iter().enumerate() {
            if chosen[..place].contains(factor) {
                return Err(input(format!("--factors names {:?} twice", case.factors[*factor].name)));
            }
        }
        case.estimate.factors = chosen;
        case.estimate.start.clear();
    }
    if !fit.start.is_empty() {
        let mut start: Vec<f64> = case.estimate.factors.iter().map(|&factor| case.factors[factor].nominal).collect();
        for (factor, value) in values(case, &fit.start, "--start")? {
            let name = &case.factors[factor].name;
            let place = case.estimate.factors.iter().position(|&chosen| chosen == factor);
            let place = place.ok_or_else(|| input(format!("--start {name}: that factor is not estimated")))?;
            let (low, high) = case.factors[factor].bounds(case.estimate.bounds);
            if !(low..=high).contains(&value) {
                return Err(input(format!("--start {name}={value}: outside its bounds {low} to {high}")));
            }
            start[place] = value;
        }
        case.estimate.start = start;
    }
    Ok(())
}

pub(crate) fn noise_k(text: &str) -> Result<f64, Failure> {
    let noise_k = quantity(text, Dimension::TemperatureDifference)
        .map_err(|message| input(format!("--noise {text:?}: {message}")))?;
    if noise_k < 0.0 {
        return Err(input(format!("--noise {text:?}: expected no less than 0 K")));
    }
    Ok(noise_k)
}
