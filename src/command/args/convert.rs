//! Conversion of command-line arguments to options of the library.

use crate::case::unit::{Dimension, parse_quantity};
use crate::case::{Bounds, Case, LossFunction};
use crate::command::args::{
    BackendArg, BoundsArg, CriterionArg, DerivativeArg, DesignArgs, FitArgs, HistoryArgs, MarchArgs, MinimiserArg,
    ObservationArgs, PosteriorArgs, PrecisionArg, PriorArg, ProfileArgs, RequirementArgs, SamplingArg, SizeArgs,
    SweepArgs, TradeArgs, TwinArgs,
};
use crate::command::exit::{Failure, input};
use crate::command::progress::MarchProgress;
use crate::ensemble::{self, Sampling};
use crate::fit::DampingStrategy;
use crate::fit::optimal_design::{Criterion, Robustness};
use crate::march::Precision;
use crate::march::backend_selection::{BackendKind, BackendOptions};
use crate::session::{
    Derivatives, DesignOptions, FitOptions, HistoryOptions, InstructionSet, ObservationSelection, Options, PlanCache,
    PlyChoice, SensitivityOptions, SizeOptions, Start, TradeOptions, TwinStudyOptions, UncertaintyOptions,
};
use crate::study::depth_profiles::ProfileInstants;
use crate::study::estimate::PAPER_RULES;
use crate::study::flux_inversion::HeatingQuantity;
use crate::study::posterior::Walkers;
use crate::study::sequential_sampling::PrecisionTarget;
use crate::study::sweep_piece;
use std::ops::Range;

/// The backend.
///
/// # Errors
/// When a Vulkan device is named for the CPU.
pub fn choice(march: &MarchArgs) -> Result<BackendOptions, Failure> {
    if let (BackendArg::Cpu, Some(device)) = (march.backend, &march.device) {
        return Err(input(format!(
            "--device {device:?} names a Vulkan device, which --backend cpu does not use: leave out one of them"
        )));
    }
    Ok(BackendOptions {
        kind: match march.backend {
            BackendArg::Auto => BackendKind::Auto,
            BackendArg::Cpu => BackendKind::Cpu,
            BackendArg::Gpu => BackendKind::Gpu,
        },
        precision: march.precision.map(|precision| match precision {
            PrecisionArg::F32 => Precision::F32,
            PrecisionArg::F64 => Precision::F64,
        }),
        device: march.device.clone(),
        instruction_set: march.instruction_set.as_deref().map(instruction_set).transpose()?,
    })
}

fn instruction_set(name: &str) -> Result<InstructionSet, Failure> {
    let available = InstructionSet::available();
    available.iter().copied().find(|one| one.name() == name).ok_or_else(|| {
        let names: Vec<&str> = available.iter().map(|one| one.name()).collect();
        input(format!("--instruction-set {name:?}: this processor has {}", names.join(", ")))
    })
}

pub fn bounds(bounds: BoundsArg) -> Bounds {
    match bounds {
        BoundsArg::Small => Bounds::Small,
        BoundsArg::Large => Bounds::Large,
    }
}

pub fn sampling(sweep: &SweepArgs) -> Sampling {
    let kind = match sweep.sampling {
        SamplingArg::Normal => ensemble::SamplingKind::Normal,
        SamplingArg::Uniform => ensemble::SamplingKind::Uniform,
        SamplingArg::Lhs => ensemble::SamplingKind::LatinHypercube,
        SamplingArg::Sobol => ensemble::SamplingKind::Sobol,
    };
    Sampling { kind, seed: sweep.seed }
}

/// The range `A..B` of members.
pub fn member_range(text: &str, drawn: usize) -> Result<Range<usize>, Failure> {
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

/// The members of piece `K/N`, and N. Without K it is the number of the task in a Slurm job array.
pub fn equal_piece(text: &str, members: usize) -> Result<(Range<usize>, usize), Failure> {
    let task = || {
        std::env::var("SLURM_ARRAY_TASK_ID").map_err(|_| {
            input(format!(
                "--piece {text}: expected K/N such as 3/16, as SLURM_ARRAY_TASK_ID is not set (this is no task of a \
                 Slurm job array)"
            ))
        })
    };
    let (number, pieces) = match text.split_once('/') {
        Some((number, pieces)) => (number.to_owned(), pieces),
        None => (task()?, text),
    };
    let numbers = number.trim().parse().ok().zip(pieces.trim().parse().ok());
    let piece = numbers.and_then(|(number, pieces)| Some((sweep_piece::equal_piece(number, pieces, members)?, pieces)));
    piece.ok_or_else(|| {
        input(format!(
            "--piece {text:?}: expected K/N with K from 1 to N, and N at most the {members} members (-n); found piece \
             {number:?} of {pieces:?}"
        ))
    })
}

/// Name and value of `NAME=VALUE`.
fn name_and_value<'a>(text: &'a str, option: &str) -> Result<(&'a str, &'a str), Failure> {
    text.split_once('=').ok_or_else(|| input(format!("{option} {text:?}: expected NAME=VALUE")))
}

pub fn sets(sets: &[String]) -> Result<Vec<(String, String)>, Failure> {
    pairs(sets, "--set")
}

/// Names and values of an option that may be repeated, each name once.
pub fn pairs(texts: &[String], option: &str) -> Result<Vec<(String, String)>, Failure> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for text in texts {
        let (name, value) = name_and_value(text, option)?;
        if pairs.iter().any(|(earlier, _)| earlier == name) {
            return Err(input(format!("{option} names {name:?} twice")));
        }
        pairs.push((name.to_owned(), value.to_owned()));
    }
    Ok(pairs)
}

/// Pairs `NAME=VALUE,...`; every value is positive.
pub fn positive_values(texts: &[String], option: &str) -> Result<Vec<(String, f64)>, Failure> {
    let value = |text: &String| {
        let (name, value) = name_and_value(text, option)?;
        Ok((name.trim().to_owned(), positive_number(text, value, option)?))
    };
    texts.iter().map(value).collect()
}

fn positive_number(text: &str, value: &str, option: &str) -> Result<f64, Failure> {
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(input(format!("{option} {text:?}: expected a number above zero, found {value:?}"))),
    }
}

fn trimmed(names: &[String]) -> Vec<String> {
    names.iter().map(|name| name.trim().to_owned()).collect()
}

/// The words of the command.
pub fn command_line() -> Vec<String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect()
}

/// Options of a session that reports its progress.
pub(crate) fn options(march: &MarchArgs, progress: &MarchProgress) -> Result<Options, Failure> {
    let choice = choice(march)?;
    let display = progress.clone();
    let mut options = Options::default().backend(choice.kind).progress(move |progress| display.show(progress));
    options.command_line = Some(command_line());
    (options.precision, options.device) = (choice.precision, choice.device);
    options.instruction_set = choice.instruction_set;
    options.plan_cache = PlanCache::of_user();
    Ok(options)
}

pub fn sweep(sweep: &SweepArgs) -> UncertaintyOptions {
    let Sampling { kind, seed } = sampling(sweep);
    let bounds = sweep.sampling_bounds.map_or(Bounds::Small, bounds);
    UncertaintyOptions { members: sweep.members, sampling: kind, seed, bounds }
}

/// The target of `--until`.
pub fn precision_target(text: &str, case: &Case) -> Result<PrecisionTarget, Failure> {
    PrecisionTarget::parse(text, case).map_err(|message| input(format!("--until {text:?}: {message}")))
}

/// The times of profiles through the thickness, checked for a case.
pub fn depth_profiles(profiles: &ProfileArgs, case: &Case) -> Result<Option<ProfileInstants>, Failure> {
    let Some(text) = profiles.depth_profiles.as_deref() else { return Ok(None) };
    let instants = match text.trim().parse::<usize>() {
        Ok(count) => ProfileInstants::Even(count),
        Err(_) => {
            let time = |text| dimensional(text, Dimension::Time, "--depth-profiles");
            ProfileInstants::Times(text.split(',').map(time).collect::<Result<_, _>>()?)
        }
    };
    instants.check(case).map_err(|message| input(format!("--depth-profiles {text:?}: {message}")))?;
    Ok(Some(instants))
}

pub fn observations(data: &ObservationArgs) -> Result<ObservationSelection, Failure> {
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

pub fn fit(fit: &FitArgs) -> Result<FitOptions, Failure> {
    let loss = fit.loss.as_deref().map(LossFunction::parse).transpose();
    let loss = loss.map_err(|message| input(format!("--loss {:?}: {message}", fit.loss.as_deref().unwrap_or(""))))?;
    let start = |(name, value): (String, f64)| {
        let (factor, case) = name.split_once('@').map_or((name.as_str(), None), |(name, id)| (name, Some(id)));
        Start { factor: factor.to_owned(), case: case.map(str::to_owned), value }
    };
    Ok(FitOptions {
        factors: trimmed(&fit.factors),
        start: positive_values(&fit.start, "--start")?.into_iter().map(start).collect(),
        loss,
        prior: fit.prior.map(|prior| match prior {
            PriorArg::None => None,
            PriorArg::Small => Some(Bounds::Small),
            PriorArg::Large => Some(Bounds::Large),
        }),
        damping_strategy: match fit.minimiser {
            MinimiserArg::TrustRegion => DampingStrategy::TrustRegion,
            MinimiserArg::Paper => PAPER_RULES,
        },
        starts: fit.starts,
        profiles: fit.profile.clone(),
        max_iterations: fit.max_iterations,
    })
}

/// Standard deviation of the noise of synthetic observations, K.
pub fn noise_k(twin: &TwinArgs) -> Result<Option<f64>, Failure> {
    let deviation = |text| nonnegative(text, Dimension::TemperatureDifference, "--noise");
    twin.noise.as_deref().map(deviation).transpose()
}

/// Correlation time of that noise, s.
pub fn correlation_s(twin: &TwinArgs) -> Result<f64, Failure> {
    let time = |text| nonnegative(text, Dimension::Time, "--correlation-time");
    twin.correlation_time.as_deref().map_or(Ok(0.0), time)
}

/// A coverage study of a number of synthetic data sets.
pub fn twin_study(
    twin: &TwinArgs,
    data: &ObservationArgs,
    fit: &FitArgs,
    data_sets: usize,
) -> Result<TwinStudyOptions, Failure> {
    Ok(TwinStudyOptions {
        observations: observations(data)?,
        fit: self::fit(fit)?,
        noise_k: noise_k(twin)?,
        correlation_s: correlation_s(twin)?,
        seed: twin.seed.unwrap_or(1),
        ..TwinStudyOptions::new(data_sets)
    })
}

/// Options of the MCMC sampling; `None` without `--posterior`.
pub fn walkers(args: &PosteriorArgs, seed: u64) -> Option<Walkers> {
    args.posterior.then_some(Walkers { number: args.walkers, iterations: args.mcmc_iterations, seed })
}

pub fn sensitivity(
    data: &ObservationArgs,
    method: Option<DerivativeArg>,
    step: Option<f64>,
) -> Result<SensitivityOptions, Failure> {
    let derivatives = match (method, step) {
        (Some(DerivativeArg::Tangent), Some(step)) => {
            return Err(input(format!(
                "--step {step}: --method tangent has no step; leave out one of them, or give --method difference"
            )));
        }
        (Some(DerivativeArg::Difference), step) => Derivatives::Difference(step),
        (None, Some(step)) => Derivatives::Difference(Some(step)),
        (Some(DerivativeArg::Tangent) | None, None) => Derivatives::Exact,
    };
    Ok(SensitivityOptions { observations: observations(data)?, derivatives })
}

/// The quantity to estimate over time, its knots, and the regularisation weight.
pub fn history(data: &ObservationArgs, history: &HistoryArgs) -> Result<HistoryOptions, Failure> {
    Ok(HistoryOptions {
        observations: observations(data)?,
        quantity: history.quantity.as_deref().map(quantity).transpose()?,
        knots: history.knots,
        smoothing: history.smoothing.as_deref().map(smoothing).transpose()?,
    })
}

fn smoothing(text: &str) -> Result<f64, Failure> {
    let weight = text.parse().ok().filter(|weight: &f64| weight.is_finite() && *weight >= 0.0);
    weight.ok_or_else(|| input(format!("--smoothing {text:?}: expected a weight of 0 or more")))
}

fn quantity(text: &str) -> Result<HeatingQuantity, Failure> {
    let named = HeatingQuantity::ALL.into_iter().find(|sought| sought.name() == text);
    named.ok_or_else(|| input(format!("--quantity {text:?}: expected flux, radiant-flux or gas")))
}

/// The ply to size, and the temperature limit of a part.
pub fn size(size: &SizeArgs, sweep: &SweepArgs, case: &Case) -> Result<SizeOptions, Failure> {
    sized_ply(&size.ply, &size.requirement, sweep, case)
}

/// The choices of materials, the ply to size and the temperature limit of a part, and other cases as exposures.
pub fn trade(trade: &TradeArgs, sweep: &SweepArgs, case: &Case, exposures: Vec<Case>) -> Result<TradeOptions, Failure> {
    let choice = |text: &String| {
        let expected = "expected PLY=MATERIALS, such as INS=pyrogel3350,saffil-96";
        let (ply, materials) = text.split_once('=').ok_or_else(|| input(format!("--ply {text:?}: {expected}")))?;
        let materials: Vec<String> = materials.split(',').map(|id| id.trim().to_owned()).collect();
        if materials.iter().any(String::is_empty) {
            return Err(input(format!("--ply {text:?}: {expected}, found an empty name of a material")));
        }
        Ok(PlyChoice { ply: ply.trim().to_owned(), materials })
    };
    Ok(TradeOptions {
        choices: trade.ply.iter().map(choice).collect::<Result<_, _>>()?,
        size: sized_ply(&trade.size, &trade.requirement, sweep, case)?,
        exposures,
    })
}

fn sized_ply(ply: &str, requirement: &RequirementArgs, sweep: &SweepArgs, case: &Case) -> Result<SizeOptions, Failure> {
    let RequirementArgs { limit, probability, thickness_range } = requirement;
    let stated = |part: Option<&str>| SizeOptions::with_stated_limit(ply, case, part);
    let of_part = match limit.as_deref().map(|text| (text, text.split_once('<'))) {
        None => stated(None)?,
        Some((text, None)) => stated(Some(text.trim())).map_err(|_| {
            let expected = "expected PART < TEMPERATURE, such as \"TC4 < 623 K\", or a part with one limit in the case";
            input(format!("--limit {text:?}: {expected}"))
        })?,
        Some((_, Some((part, limit)))) => {
            let limit_k = dimensional(limit.trim_start_matches('='), Dimension::LayupTemperature, "--limit")?;
            SizeOptions::new(ply, part.trim(), limit_k)
        }
    };
    let within_m = match thickness_range.as_deref().map(|text| (text, text.split_once(':'))) {
        None => None,
        Some((_, Some((thinnest, thickest)))) => Some((
            dimensional(thinnest, Dimension::Length, "--thickness-range")?,
            dimensional(thickest, Dimension::Length, "--thickness-range")?,
        )),
        Some((text, None)) => {
            let expected = "expected THINNEST:THICKEST with units, such as \"3 mm:20 mm\"";
            return Err(input(format!("--thickness-range {text:?}: {expected}")));
        }
    };
    Ok(SizeOptions { probability: *probability, thickness_range_m: within_m, sweep: self::sweep(sweep), ..of_part })
}

/// The design of an experiment, with other cases as alternative exposures.
pub fn design(design: &DesignArgs, others: Vec<Case>) -> Result<DesignOptions, Failure> {
    let length = |text: &str, option| nonnegative(text, Dimension::Length, option);
    let run_length = |text: &str| dimensional(text, Dimension::Time, "--run-lengths");
    let run_lengths = design.run_lengths.iter().flat_map(|text| text.split(','));
    Ok(DesignOptions {
        others,
        grid_m: design.grid.as_deref().map(|text| dimensional(text, Dimension::Length, "--grid")).transpose()?,
        least_distance_m: length(&design.least_distance, "--least-distance")?,
        position_tolerance_m: length(&design.position_tolerance, "--position-tolerance")?,
        sampling_s: design
            .sampling
            .as_deref()
            .map(|text| dimensional(text, Dimension::Time, "--sampling"))
            .transpose()?,
        noise_k: design
            .noise
            .as_deref()
            .map(|text| dimensional(text, Dimension::TemperatureDifference, "--noise"))
            .transpose()?,
        correlation_s: design
            .correlation_time
            .as_deref()
            .map(|text| nonnegative(text, Dimension::Time, "--correlation-time"))
            .transpose()?,
        run_lengths_s: run_lengths.map(run_length).collect::<Result<_, _>>()?,
        criterion: match design.criterion {
            CriterionArg::D => Criterion::D,
            CriterionArg::A => Criterion::A,
            CriterionArg::C => Criterion::C,
        },
        robustness: if design.worst { Robustness::Worst } else { Robustness::Mean },
        target: design.target.clone(),
        members: design.members,
        seed: design.seed,
        bounds: design.sampling_bounds.map_or(Bounds::Small, bounds),
        ..DesignOptions::new(trimmed(&design.estimate), design.sensors)
    })
}

fn dimensional(text: &str, dimension: Dimension, option: &str) -> Result<f64, Failure> {
    parse_quantity(text.trim(), dimension).map_err(|message| input(format!("{option} {text:?}: {message}")))
}

/// A quantity that is zero or positive.
pub fn nonnegative(text: &str, dimension: Dimension, option: &str) -> Result<f64, Failure> {
    let value = dimensional(text, dimension, option)?;
    if value < 0.0 {
        let unit = if dimension == Dimension::Time { "s" } else { "K" };
        return Err(input(format!("{option} {text:?}: expected no less than 0 {unit}")));
    }
    Ok(value)
}
