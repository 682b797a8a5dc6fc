//! Adaptation of the steps for one candidate, as src/adapt.rs does for the march.

use crate::candidate::{Candidate, CoarseCells, worst_k};
use bondline::case::Case;
use bondline::plan::GridDensity;
use bondline::plan::{StepGrowth, TimeSegment, TimeStepControl};
use rayon::prelude::*;

/// Number of time segments, and rounds of the adaptation.
const TIME_SEGMENTS: usize = 10;
const ROUNDS: usize = 8;
const INITIAL_STEPS: usize = 200;
/// Above this error, errors do not yet converge at their order, K.
pub(crate) const MAX_CONVERGENT_ERROR_K: f64 = 20.0;
const MAX_DENSITY_CHANGE: f64 = 2.0;

/// The step rule with the fewest steps for a target error in time, on fixed cells.
pub(crate) fn adapted(
    case: &Case,
    density: &GridDensity,
    candidate: &Candidate,
    reference: &[f64],
    aim_k: f64,
) -> TimeStepControl {
    let readings_and_steps = |control: &TimeStepControl| {
        let plan = super::plan(case, density, control);
        (candidate.readings(&plan, CoarseCells::Same, &super::nominal(case)), plan.steps() as f64)
    };
    let mut control = initial(case, density);
    let mut best: Option<(TimeStepControl, f64, f64)> = None;
    for _ in 0..ROUNDS {
        let (base, steps) = readings_and_steps(&control);
        let error_k = worst_k(&base, reference);
        if error_k > MAX_CONVERGENT_ERROR_K {
            // Temperatures diverge over long steps.
            control.segments.iter_mut().for_each(|segment| segment.step_density *= 1.5);
            continue;
        }
        let is_better =
            best.as_ref().is_none_or(|(_, best_k, best_steps)| match (error_k <= aim_k, *best_k <= aim_k) {
                (true, true) => steps < *best_steps,
                (false, false) => error_k < *best_k,
                (is_within, _) => is_within,
            });
        let tried = (0..control.segments.len()).into_par_iter().map(|segment| {
            let mut finer = control.clone();
            finer.segments[segment].step_density *= 2.0;
            let (readings, more) = readings_and_steps(&finer);
            (worst_k(&readings, &base), more / steps - 1.0)
        });
        let tried: Vec<(f64, f64)> = tried.collect();
        let previous = control.clone();
        minimise_steps(&mut control, &tried, candidate.order, error_k, aim_k.clamp(error_k / 4.0, error_k * 4.0));
        if is_better {
            best = Some((previous, error_k, steps));
        }
    }
    best.map_or(control, |(control, ..)| control)
}

/// Few steps, in time segments of equal numbers of steps.
fn initial(case: &Case, density: &GridDensity) -> TimeStepControl {
    let paced = |coefficient| TimeStepControl { growth: StepGrowth::Graded { coefficient }, segments: Vec::new() };
    let mut coefficient = 0.05;
    let mut plan = super::plan(case, density, &paced(coefficient));
    while plan.steps() > INITIAL_STEPS {
        coefficient *= 1.2;
        plan = super::plan(case, density, &paced(coefficient));
    }
    let mut control = paced(coefficient);
    let segment = |number: usize| TimeSegment {
        start_s: plan.times_s()[number * plan.steps() / TIME_SEGMENTS],
        step_density: 1.0,
        subdivisions: 1,
    };
    control.segments = (0..TIME_SEGMENTS).map(segment).collect();
    control
}

/// Step densities that minimise the number of steps for a target error: if a density is multiplied by r, its error e
/// falls as `r^−q` and its steps c rise as r, so the optimum is `r^(q+1) = e/(μ c)`, with μ such that the errors add up
/// to the target.
fn minimise_steps(control: &mut TimeStepControl, tried: &[(f64, f64)], order: f64, error_k: f64, aim_k: f64) {
    let cancellation = error_k / tried.iter().map(|(part_k, _)| part_k).sum::<f64>().max(1e-12);
    let times = |(part_k, cost): (f64, f64), multiplier: f64| {
        let best = ((part_k * cancellation).max(1e-9) / (multiplier * cost.max(1e-4))).powf(1.0 / (order + 1.0));
        best.clamp(1.0 / MAX_DENSITY_CHANGE, MAX_DENSITY_CHANGE)
    };
    let left_k = |multiplier: f64| -> f64 {
        tried.iter().map(|&part| part.0 * cancellation * times(part, multiplier).powf(-order)).sum()
    };
    let (mut low, mut high) = (-40.0_f64, 40.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left_k(middle.exp()) > aim_k { high = middle } else { low = middle }
    }
    for (segment, &part) in control.segments.iter_mut().zip(tried) {
        segment.step_density *= times(part, low.exp());
    }
}
