//! From what was typed to what the library takes.

use crate::command::args::{
    BackendKind, BoundsKind, Fit, Limit, Method, Minimiser, On, PrecisionKind, PriorKind, SamplingKind, Sweep, Trusted,
    Walk,
};
use crate::command::exit::{Failure, input};
use bondline::case::unit::{Dimension, quantity};
use bondline::case::{Bounds, Case};
use bondline::ensemble::{self, Sampling};
use bondline::fit::Loss;
use bondline::march::Precision;
use bondline::march::choose::{Choice, Kind};
use bondline::study::estimate::{PAPER, Search, no_factors};
use bondline::study::posterior::Walkers;
use bondline::study::sensitivity::difference_step;
use bondline::study::size::Demand;
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

/// The relative step of the differences that derivatives are to be; `None` where they are to be told.
pub(crate) fn difference(
    method: Option<Method>,
    step: Option<f64>,
    precision: Precision,
) -> Result<Option<f64>, Failure> {
    match (method, step) {
        (Some(Method::Tangent), Some(step)) => Err(input(format!(
            "--step {step}: --method tangent takes no step; leave one of them out, or take --method difference"
        ))),
        (_, Some(step)) if !(1e-9..=0.2).contains(&step) => {
            Err(input(format!("--step {step}: expected a relative step from 1e-9 to 0.2")))
        }
        (Some(Method::Difference), None) => Ok(Some(difference_step(precision))),
        _ => Ok(step),
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

/// Factors by name, with their values.
pub(crate) fn values(case: &Case, texts: &[String], option: &str) -> Result<Vec<(usize, f64)>, Failure> {
    texts
        .iter()
        .map(|text| {
            let (name, value) = halves(text, option)?;
            let factor = factor(case, name, option)?;
            Ok((factor, number(text, value, option)?))
        })
        .collect()
}

fn number(text: &str, value: &str, option: &str) -> Result<f64, Failure> {
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(input(format!("{option} {text:?}: expected a number above zero, found {value:?}"))),
    }
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

/// The sensors, window and side constraints typed take the place of the cases' own.
pub(crate) fn trust(cases: &mut [Case], data: &Trusted) -> Result<(), Failure> {
    if !data.sensors.is_empty() {
        let names = |case: &Case| case.sensors.iter().map(|sensor| sensor.name.clone()).collect();
        let chosen = chosen(cases, &data.sensors, "--sensors", "sensor", names)?;
        for (case, chosen) in cases.iter_mut().zip(chosen) {
            if chosen.is_empty() {
                return Err(input(format!("--sensors: {:?} has none of {}", case.id, data.sensors.join(", "))));
            }
            case.estimate.sensors = chosen;
        }
    }
    for case in cases {
        if let Some(window) = &data.window {
            case.estimate.window_s = Some(self::window(window)?);
            // One that is typed is of every sensor: whoever types it would not look for those of a file behind it.
            case.observations.iter_mut().for_each(|seen| seen.window_s = None);
        }
        if let Some(kind) = data.bounds {
            case.estimate.bounds = bounds(kind);
        }
        all_seen(case)?;
    }
    Ok(())
}

/// That either every sensor chosen has samples in its window, or none has, where all instants take their place.
fn all_seen(case: &Case) -> Result<(), Failure> {
    let is_seen = |sensor: usize| {
        let (from_s, to_s) = case.window_s(sensor);
        let mut times_s = case.observations.iter().filter(|seen| seen.sensor == sensor).flat_map(|seen| &seen.times_s);
        times_s.any(|time_s| (from_s..=to_s).contains(time_s))
    };
    let (seen, unseen): (Vec<usize>, Vec<usize>) = case.estimate.sensors.iter().partition(|&&sensor| is_seen(sensor));
    match (seen.is_empty(), unseen.first()) {
        (false, Some(&sensor)) => {
            let ((from_s, to_s), name) = (case.window_s(sensor), &case.sensors[sensor].name);
            let id = &case.id;
            Err(input(format!(
                "{id}: {name:?} is chosen and has no samples between {from_s} s and {to_s} s; leave it out"
            )))
        }
        _ => Ok(()),
    }
}

/// That every start of a case lies within the bounds that hold.
pub(crate) fn begun(cases: &[Case]) -> Result<(), Failure> {
    for case in cases {
        for (&factor, &start) in case.estimate.factors.iter().zip(&case.estimate.start) {
            let (factor, bounds) = (&case.factors[factor], case.estimate.bounds);
            let (low, high) = factor.bounds(bounds);
            if !(low..=high).contains(&start) {
                let (id, name, bounds) = (&case.id, &factor.name, bounds.name());
                return Err(input(format!(
                    "{id}: the start {start} of {name:?} lies outside its {bounds} bounds {low} to {high}; give --start"
                )));
            }
        }
    }
    Ok(())
}

/// The places of what is named among what each case has by that name; one at least must have it.
fn chosen(
    cases: &[Case],
    chosen: &[String],
    option: &str,
    noun: &str,
    names: impl Fn(&Case) -> Vec<String>,
) -> Result<Vec<Vec<usize>>, Failure> {
    let known: Vec<Vec<String>> = cases.iter().map(names).collect();
    let mut all: Vec<&str> = Vec::new();
    for name in known.iter().flatten() {
        if !all.contains(&name.as_str()) {
            all.push(name);
        }
    }
    for (place, name) in chosen.iter().enumerate() {
        find(&all, name.trim(), option, noun)?;
        if chosen[..place].iter().any(|earlier| earlier.trim() == name.trim()) {
            return Err(input(format!("{option} names {:?} twice", name.trim())));
        }
    }
    let places = |known: &Vec<String>| {
        chosen.iter().filter_map(|name| known.iter().position(|other| other == name.trim())).collect()
    };
    Ok(known.iter().map(places).collect())
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

/// The factors, start, loss and prior typed take the place of the cases' own.
pub(crate) fn fit(cases: &mut [Case], fit: &Fit) -> Result<(), Failure> {
    if !fit.factors.is_empty() {
        let names = |case: &Case| case.factors.iter().map(|factor| factor.name.clone()).collect();
        let chosen = chosen(cases, &fit.factors, "--factors", "factor", names)?;
        for (case, chosen) in cases.iter_mut().zip(chosen) {
            case.estimate.factors = chosen;
            case.estimate.start.clear();
        }
    }
    starts(cases, &fit.start)?;
    let loss = fit.loss.as_deref().map(Loss::named).transpose();
    let loss = loss.map_err(|message| input(format!("--loss {:?}: {message}", fit.loss.as_deref().unwrap_or(""))))?;
    for case in cases {
        case.estimate.loss = loss.unwrap_or(case.estimate.loss);
        case.estimate.prior = match fit.prior {
            None => case.estimate.prior,
            Some(PriorKind::None) => None,
            Some(PriorKind::Small) => Some(Bounds::Small),
            Some(PriorKind::Large) => Some(Bounds::Large),
        };
    }
    Ok(())
}

/// Starts by name, of every case that estimates a factor of that name, or of the one that is named behind an `@`.
fn starts(cases: &mut [Case], texts: &[String]) -> Result<(), Failure> {
    if texts.is_empty() {
        return Ok(());
    }
    for case in cases.iter_mut() {
        case.estimate.start = case.estimate.factors.iter().map(|&factor| case.factors[factor].nominal).collect();
    }
    for text in texts {
        let (name, value) = halves(text, "--start")?;
        let (name, home) = name.trim().split_once('@').map_or((name.trim(), None), |(name, id)| (name, Some(id)));
        let value = number(text, value, "--start")?;
        let mut is_estimated = false;
        for case in cases.iter_mut().filter(|case| home.is_none_or(|id| id == case.id)) {
            let place = case.estimate.factors.iter().position(|&chosen| case.factors[chosen].name == name);
            let Some(place) = place else { continue };
            let (low, high) = case.factors[case.estimate.factors[place]].bounds(case.estimate.bounds);
            if !(low..=high).contains(&value) {
                return Err(input(format!("--start {name}={value}: outside its bounds {low} to {high}")));
            }
            case.estimate.start[place] = value;
            is_estimated = true;
        }
        if !is_estimated {
            return Err(input(format!("--start {name}: that factor is not estimated")));
        }
    }
    Ok(())
}

/// Why a study estimates nothing of a case, where it does not.
pub(crate) fn unfitted(case: &Case) -> Option<String> {
    if case.observations.is_empty() {
        return Some("the case has no observations".to_owned());
    }
    case.estimate.factors.is_empty().then(|| no_factors(&[case]))
}

/// That a case is fitted where what is typed says how.
pub(crate) fn fitted(case: &Case, fit: &Fit, has_posterior: bool) -> Result<(), Failure> {
    match (fit.typed().or(has_posterior.then_some("--posterior")), unfitted(case)) {
        (Some(option), Some(why)) => Err(input(format!("{option}: nothing is estimated: {why}"))),
        _ => Ok(()),
    }
}

/// How to look for the least.
pub(crate) fn search(fit: &Fit, precision: Precision) -> Result<Search, Failure> {
    const MOST: usize = 10_000;
    if !(1..=MOST).contains(&fit.starts) {
        return Err(input(format!("--starts {}: expected from 1 to {MOST}", fit.starts)));
    }
    let mut search = Search { starts: fit.starts, profiles: fit.profile.clone(), ..Search::of(precision) };
    search.options.patience = fit.patience;
    if fit.minimiser == Minimiser::Paper {
        search.options.rules = PAPER;
    }
    Ok(search)
}

/// The walkers of a posterior, where one is wanted.
pub(crate) fn walkers(walk: &Walk, seed: u64) -> Result<Option<Walkers>, Failure> {
    // Of every factor each walker's place after every move is held: 0.8 GB a factor.
    const MOST: usize = 100_000_000;
    const FEWEST_MOVES: usize = 10;
    let Walk { posterior, walkers, moves } = *walk;
    if moves < FEWEST_MOVES {
        return Err(input(format!("--moves {moves}: expected {FEWEST_MOVES} at least")));
    }
    if walkers.checked_mul(moves).is_none_or(|places| places > MOST) {
        return Err(input(format!("--walkers {walkers} --moves {moves}: expected no more than {MOST} moves in all")));
    }
    Ok(posterior.then_some(Walkers { number: walkers, moves, seed }))
}

/// What is to be held by which ply.
pub(crate) fn demand(case: &Case, limit: &Limit) -> Result<Demand, Failure> {
    let Limit { ply, limit, probability, between } = limit;
    let (sensor, most) = limit
        .split_once('<')
        .ok_or_else(|| input(format!("--limit {limit:?}: expected SENSOR < TEMPERATURE, such as \"TC4 < 623 K\"")))?;
    let names: Vec<&str> = case.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    let sensor = find(&names, sensor.trim(), "--limit", "sensor")?;
    let limit_k = measured(most.trim_start_matches('='), Dimension::Temperature, "--limit")?;
    if !(*probability > 0.0 && *probability < 1.0) {
        return Err(input(format!("--probability {probability}: expected a share between 0 and 1, such as 0.99")));
    }
    let within_m = between.as_deref().map(|text| {
        let ends = text.split_once(':').ok_or_else(|| {
            input(format!("--between {text:?}: expected THINNEST:THICKEST with units, such as \"3 mm:20 mm\""))
        })?;
        let (low_m, high_m) =
            (measured(ends.0, Dimension::Length, "--between")?, measured(ends.1, Dimension::Length, "--between")?);
        if low_m > 0.0 && low_m < high_m {
            Ok((low_m, high_m))
        } else {
            Err(input(format!("--between {text:?}: expected a thinnest above zero and below the thickest")))
        }
    });
    Ok(Demand { ply: ply.clone(), sensor, limit_k, probability: *probability, within_m: within_m.transpose()? })
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
