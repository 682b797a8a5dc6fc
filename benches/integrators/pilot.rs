//! Steps for one candidate: its own errors shared out evenly, as src/pilot.rs does for the march.

use crate::candidate::{Candidate, Space, worst_k};
use bondline::case::Case;
use bondline::plan::Density;
use bondline::plan::{Growth, Pace, Slice};
use rayon::prelude::*;

/// Slices of time with a pace of their own, and rounds of sharing out.
const SLICES: usize = 10;
const ROUNDS: usize = 8;
const STEPS_FIRST: usize = 200;
/// What is farther off than this tells nothing of how errors fall.
pub(crate) const FAR_K: f64 = 20.0;
const CHANGE_MOST: f64 = 2.0;

/// The pace by which a candidate reaches an error in time with the fewest steps, on cells that are held.
pub(crate) fn paced(case: &Case, density: &Density, candidate: &Candidate, reference: &[f64], aim_k: f64) -> Pace {
    let told = |pace: &Pace| {
        let plan = super::plan(case, density, pace);
        (candidate.readings(&plan, Space::Held, &super::nominal(case)), plan.steps() as f64)
    };
    let mut pace = first(case, density);
    let mut best: Option<(Pace, f64, f64)> = None;
    for _ in 0..ROUNDS {
        let (base, steps) = told(&pace);
        let error_k = worst_k(&base, reference);
        if error_k > FAR_K {
            // Temperatures run away over long steps.
            pace.slices.iter_mut().for_each(|slice| slice.density *= 1.5);
            continue;
        }
        let is_better =
            best.as_ref().is_none_or(|(_, kept_k, kept_steps)| match (error_k <= aim_k, *kept_k <= aim_k) {
                (true, true) => steps < *kept_steps,
                (false, false) => error_k < *kept_k,
                (is_within, _) => is_within,
            });
        let tried = (0..pace.slices.len()).into_par_iter().map(|slice| {
            let mut finer = pace.clone();
            finer.slices[slice].density *= 2.0;
            let (readings, more) = told(&finer);
            (worst_k(&readings, &base), more / steps - 1.0)
        });
        let tried: Vec<(f64, f64)> = tried.collect();
        let kept = pace.clone();
        share_out(&mut pace, &tried, candidate.order, error_k, aim_k.clamp(error_k / 4.0, error_k * 4.0));
        if is_better {
            best = Some((kept, error_k, steps));
        }
    }
    best.map_or(pace, |(pace, ..)| pace)
}

/// Few steps, in slices of as many each.
fn first(case: &Case, density: &Density) -> Pace {
    let paced = |coefficient| Pace { growth: Growth::Graded { coefficient }, slices: Vec::new() };
    let mut coefficient = 0.05;
    let mut plan = super::plan(case, density, &paced(coefficient));
    while plan.steps() > STEPS_FIRST {
        coefficient *= 1.2;
        plan = super::plan(case, density, &paced(coefficient));
    }
    let mut pace = paced(coefficient);
    let slice = |slice: usize| Slice { from_s: plan.times_s()[slice * plan.steps() / SLICES], density: 1.0, cuts: 1 };
    pace.slices = (0..SLICES).map(slice).collect();
    pace
}

/// Slices anew, so that steps are fewest for an error: where an error falls as `x^−q` and the steps rise as x, r times as many are best where
/// `r^(q+1) = e/(μ c)`, and μ is such that the parts make up the error.
fn share_out(pace: &mut Pace, tried: &[(f64, f64)], order: f64, error_k: f64, aim_k: f64) {
    let together = error_k / tried.iter().map(|(part_k, _)| part_k).sum::<f64>().max(1e-12);
    let times = |(part_k, cost): (f64, f64), worth: f64| {
        let best = ((part_k * together).max(1e-9) / (worth * cost.max(1e-4))).powf(1.0 / (order + 1.0));
        best.clamp(1.0 / CHANGE_MOST, CHANGE_MOST)
    };
    let left_k =
        |worth: f64| -> f64 { tried.iter().map(|&part| part.0 * together * times(part, worth).powf(-order)).sum() };
    let (mut low, mut high) = (-40.0_f64, 40.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left_k(middle.exp()) > aim_k { high = middle } else { low = middle }
    }
    for (slice, &part) in pace.slices.iter_mut().zip(tried) {
        slice.density *= times(part, low.exp());
    }
}
