//! Coverage of intervals of percentiles and probabilities of members of a sweep, of stopped sweeps, and of importance
//! sampling.

use super::{Counted, covered_row};
use crate::ensemble::SamplingKind;
use crate::fit::proportion::Proportion;
use crate::fit::reliability::{ImportanceSampling, LimitState, find_design_points};
use crate::random::RandomStream;
use crate::study::margins::{MarginSpread, TOLERANCE_CONTENT};
use crate::study::sequential_sampling::{HalfWidth, Look, TargetQuantity, look, looks, sample_until};
use crate::verify::VerificationRow;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};
use std::convert::Infallible;

const SEEDS: u64 = 400;
/// Three standard errors of a share of 95 % of the seeds.
const ALLOWED: (f64, &str) = (3.3, "three standard errors of 400 sweeps");

pub(super) fn rows() -> Vec<VerificationRow> {
    let mut rows = margin_rows(3000);
    rows.extend(stopped_rows());
    rows.push(importance_row());
    rows
}

/// Peaks of independent members, K, in ascending order: log-normal, as limits are exceeded by the long tail.
fn peaks_k(members: usize, seed: u64) -> Vec<f64> {
    let mut numbers = RandomStream::new(seed, 0);
    let mut peaks_k: Vec<f64> = (0..members).map(|_| 600.0 + 20.0 * numbers.normal().exp()).collect();
    peaks_k.sort_by(f64::total_cmp);
    peaks_k
}

fn quantile_k(probability: f64) -> f64 {
    600.0 + 20.0 * Normal::standard().inverse_cdf(probability).exp()
}

/// Coverage of the intervals of temperature margins.
fn margin_rows(members: usize) -> Vec<VerificationRow> {
    const EXCEEDING: f64 = 0.03;
    let limit_k = quantile_k(1.0 - EXCEEDING);
    let held = |seed: u64| {
        let peaks_k = peaks_k(members, seed);
        let spread = MarginSpread::of(&peaks_k, &vec![0.0; members], limit_k, 0, SamplingKind::Normal);
        let [p95, p99, p99_87] = spread.percentiles.map(|percentile| {
            let (low_k, high_k) = (percentile.low_k.unwrap_or(f64::MIN), percentile.high_k.unwrap_or(f64::MAX));
            (low_k..=high_k).contains(&quantile_k(percentile.probability))
        });
        let is_bounded = spread.tolerance_bound_k.is_some_and(|bound_k| bound_k >= quantile_k(TOLERANCE_CONTENT));
        let holds = spread.exceeding_interval.is_some_and(|(low, high)| (low..=high).contains(&EXCEEDING));
        [p95, p99, p99_87, is_bounded, holds]
    };
    let held: Vec<[bool; 5]> = (0..SEEDS).into_par_iter().map(held).collect();
    let names = [
        ("percentile P95 of a peak", "by order statistics"),
        ("percentile P99 of a peak", "by order statistics"),
        ("percentile P99.87 of a peak", "by order statistics"),
        ("99 % tolerance bound of a peak", "by Wilks"),
        ("probability above a limit", "0.03, by Clopper and Pearson"),
    ];
    let row = |(kind, (name, quantity)): (usize, (&str, &str))| {
        let count = held.iter().filter(|held| held[kind]).count();
        let counted = Counted::intervals(Proportion { count, total: held.len() });
        covered_row(name, members, quantity, &counted, ALLOWED)
    };
    names.into_iter().enumerate().map(row).collect()
}

/// Most members of a stopped sweep.
const MOST: usize = 100_000;

/// Coverage of the interval at the look that ends `--until`.
fn stopped_rows() -> Vec<VerificationRow> {
    let probability = 0.95;
    let limit_k = quantile_k(1.0 - 0.1);
    let percentile =
        stopped(TargetQuantity::Percentile(probability), HalfWidth::Absolute(4.0), quantile_k(probability));
    let exceedance = stopped(TargetQuantity::Exceedance { temperature_k: limit_k }, HalfWidth::Relative(0.2), 0.1);
    vec![
        covered_row("until a percentile", percentile.1, "P95 ± 4 K", &percentile.0, ALLOWED),
        covered_row("until a probability", exceedance.1, "0.1 ± 20 %", &exceedance.0, ALLOWED),
    ]
}

/// Coverage over seeds, and the mean number of members.
fn stopped(quantity: TargetQuantity, half_width: HalfWidth, truth: f64) -> (Counted, usize) {
    let end = |seed: u64| -> Look {
        let mut numbers = RandomStream::new(seed, 1);
        let mut peaks_k: Vec<f64> = Vec::new();
        let mut last = None;
        for members in looks(MOST) {
            peaks_k.extend((peaks_k.len()..members).map(|_| 600.0 + 20.0 * numbers.normal().exp()));
            peaks_k.sort_by(f64::total_cmp);
            let found = look(&peaks_k, quantity);
            last = Some(found);
            if found.is_within(half_width) {
                break;
            }
        }
        last.expect("there is a first look")
    };
    mean_coverage(&(0..SEEDS).into_par_iter().map(end).collect::<Vec<Look>>(), truth)
}

fn mean_coverage(ends: &[Look], truth: f64) -> (Counted, usize) {
    let count = ends.iter().filter(|end| end.low <= Some(truth) && end.high >= Some(truth)).count();
    let members = ends.iter().map(|end| end.members).sum::<usize>() / ends.len();
    (Counted::intervals(Proportion { count, total: ends.len() }), members)
}

/// Two combinations of two of four standard normal variables that exceed: `u₁` or `−u₁` above the distance.
#[derive(Clone, Copy)]
struct TwoWays {
    distance: f64,
}

impl LimitState for TwoWays {
    type Error = Infallible;

    fn variables(&self) -> usize {
        4
    }

    fn values(&mut self, points: &[Vec<f64>]) -> Result<Vec<f64>, Infallible> {
        Ok(points.iter().map(|point| self.distance - point[0].abs()).collect())
    }

    fn gradients(&mut self, points: &[Vec<f64>]) -> Result<Vec<(f64, Vec<f64>)>, Infallible> {
        let gradient = |point: &Vec<f64>| vec![-point[0].signum(), 0.0, 0.0, 0.0];
        Ok(points.iter().map(|point| (self.distance - point[0].abs(), gradient(point))).collect())
    }
}

/// A rare probability, by importance sampling about two design points.
fn importance_row() -> VerificationRow {
    let ways = TwoWays { distance: 3.0 };
    let truth = 2.0 * Normal::standard().cdf(-ways.distance);
    let Ok(design) = find_design_points(&mut ways.clone());
    let centres: Vec<Vec<f64>> = design.points.into_iter().map(|point| point.scores).collect();
    let end = |seed: u64| -> Look {
        let sampling = ImportanceSampling::new(centres.clone(), seed);
        let Ok(found) = sample_until(&mut ways.clone(), &sampling, HalfWidth::Relative(0.1), MOST);
        found.looks[found.looks.len() - 1]
    };
    let ends: Vec<Look> = (0..SEEDS).into_par_iter().map(end).collect();
    let (counted, members) = mean_coverage(&ends, truth);
    let quantity = format!("{truth:.4} ± 10 %, two design points");
    covered_row("until a rare probability", members, &quantity, &counted, ALLOWED)
}
