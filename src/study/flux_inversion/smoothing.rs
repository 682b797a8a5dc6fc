//! Choice of the Tikhonov regularisation weight.
//!
//! Inversion amplifies noise, the more the shorter its time scale, so the minimised function is the misfit plus a
//! weight times the roughness (Tikhonov).
//!
//! - **Discrepancy principle**: the largest weight at which the weighted root mean square residual is one (Morozov,
//!   *Methods for Solving Incorrectly Posed Problems*, 1984; Beck, Blackwell & St Clair, *Inverse Heat Conduction*,
//!   1985). It relies on the stated noise. Where no weight reaches one, the target rises by the chance variation of the
//!   sample variance; where no weight reaches that either, the smallest misfit over all weights replaces the stated
//!   noise.
//! - **L-curve**: the corner of roughness over misfit needs no noise level (Hansen, SIAM Review 34, 1992). It is not
//!   used as a fallback, because deep sensors give curves without a corner.

use crate::fit::Fit;
use nalgebra::DVector;

/// Weights tried, as powers of ten of the weight at which the Jacobians of data and roughness have equal norms.
const MAX_LOG10_WEIGHT: i32 = 3;
const MIN_LOG10_WEIGHT: i32 = -6;
/// Relative tolerance of the target misfit; eighty samples do not resolve a hundredth.
const RMS_TOLERANCE: f64 = 0.005;
/// Tolerance of the weight, in powers of ten.
const LOG10_WEIGHT_TOLERANCE: f64 = 0.02;

/// Upper limit of the root mean square of n standardised residuals, exceeded by 2.5 % of data sets: its standard
/// deviation is `1/√(2n)`.
fn chance_limit(samples: usize) -> f64 {
    1.0 + 2.0 / (2.0 * samples as f64).sqrt()
}

/// How the weight is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Smoothing {
    /// Residuals equal the stated noise (Morozov's discrepancy principle).
    Discrepancy,
    /// The corner of the L-curve.
    LCurve,
    /// A given weight, relative to the weight at which the Jacobians of data and roughness have equal norms; zero or
    /// more.
    Stated(f64),
}

/// The criterion that selected the weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum SmoothingCriterion {
    /// The largest weight whose misfit agrees with the stated noise.
    Discrepancy,
    /// The strongest weight already meets the data: straight lines between jumps suffice.
    Straight,
    /// No weight meets the stated noise; the smallest misfit over all weights replaces it.
    Unmet,
    /// The corner of the L-curve, as requested.
    LCurve,
    /// The weight was given.
    Stated,
}

/// One point of the L-curve.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct LCurvePoint {
    /// Weight, relative to the weight at which the Jacobians of data and roughness have equal norms.
    pub weight: f64,
    /// Weighted root mean square of the residuals of the data.
    pub rms: f64,
    /// Square root of `H³ ∫ q″² dt`, with q relative to its scale.
    pub roughness: f64,
}

/// The solution at one weight.
#[derive(Clone, Debug)]
pub(super) struct SmoothedFit {
    pub point: LCurvePoint,
    pub fit: Fit,
}

/// Select a weight. `solve` minimises at a weight from a starting point; each starts from the solution at the previous,
/// stronger weight, which is near.
pub(super) fn select_weight<E>(
    smoothing: Smoothing,
    samples: usize,
    start: &DVector<f64>,
    is_smoothed: bool,
    mut solve: impl FnMut(f64, &DVector<f64>) -> Result<SmoothedFit, E>,
) -> Result<(SmoothedFit, SmoothingCriterion, Vec<LCurvePoint>), E> {
    if let Smoothing::Stated(weight) = smoothing {
        let solved = solve(weight, start)?;
        let rung = solved.point;
        return Ok((solved, SmoothingCriterion::Stated, vec![rung]));
    }
    let mut ladder: Vec<SmoothedFit> = Vec::new();
    let weakest = if is_smoothed { MIN_LOG10_WEIGHT } else { MAX_LOG10_WEIGHT };
    for power in (weakest..=MAX_LOG10_WEIGHT).rev() {
        let from = ladder.last().map_or(start, |solved| &solved.fit.point);
        let solved = solve(10f64.powi(power), from)?;
        let is_met = solved.point.rms <= 1.0;
        ladder.push(solved);
        if is_met && smoothing == Smoothing::Discrepancy {
            break;
        }
    }
    if smoothing == Smoothing::Discrepancy {
        let met_at = |level: f64| Some((ladder.iter().position(|solved| solved.point.rms <= level)?, level));
        let least = ladder.iter().map(|solved| solved.point.rms).fold(f64::INFINITY, f64::min);
        let noise = met_at(1.0).or_else(|| met_at(chance_limit(samples)));
        let rest = met_at(least * chance_limit(samples)).filter(|_| noise.is_none());
        if let Some((place, level)) = noise.or(rest) {
            let (solved, why, rungs) = largest_weight_within(ladder, place, level, solve)?;
            return Ok((solved, if noise.is_none() { SmoothingCriterion::Unmet } else { why }, rungs));
        }
    }
    let corner = l_curve_corner(&ladder.iter().map(|solved| solved.point).collect::<Vec<_>>());
    Ok(selected(ladder, corner, SmoothingCriterion::LCurve))
}

/// The largest weight that meets a misfit level, by bisection between the last weight above the level and the first
/// below.
fn largest_weight_within<E>(
    mut ladder: Vec<SmoothedFit>,
    first: usize,
    level: f64,
    mut solve: impl FnMut(f64, &DVector<f64>) -> Result<SmoothedFit, E>,
) -> Result<(SmoothedFit, SmoothingCriterion, Vec<LCurvePoint>), E> {
    if first == 0 {
        return Ok(selected(ladder, 0, SmoothingCriterion::Straight));
    }
    let (mut best, mut over) = (first, first - 1);
    while ladder[best].point.rms < level * (1.0 - RMS_TOLERANCE)
        && (ladder[over].point.weight / ladder[best].point.weight).log10() > LOG10_WEIGHT_TOLERANCE
    {
        let weight = (ladder[over].point.weight * ladder[best].point.weight).sqrt();
        let solved = solve(weight, &ladder[best].fit.point)?;
        ladder.push(solved);
        let last = ladder.len() - 1;
        if ladder[last].point.rms <= level { best = last } else { over = last }
    }
    Ok(selected(ladder, best, SmoothingCriterion::Discrepancy))
}

fn selected(
    mut ladder: Vec<SmoothedFit>,
    place: usize,
    why: SmoothingCriterion,
) -> (SmoothedFit, SmoothingCriterion, Vec<LCurvePoint>) {
    let mut rungs: Vec<LCurvePoint> = ladder.iter().map(|solved| solved.point).collect();
    rungs.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    (ladder.swap_remove(place), why, rungs)
}

/// Point of maximum curvature of log roughness over log misfit, for falling weights; the last of fewer than three.
fn l_curve_corner(rungs: &[LCurvePoint]) -> usize {
    let point = |rung: &LCurvePoint| (rung.rms.max(1e-12).ln(), rung.roughness.max(1e-12).ln());
    let bend = |place: usize| {
        let [a, b, c] = [place - 1, place, place + 1].map(|place| point(&rungs[place]));
        let (one, two) = ((b.0 - a.0, b.1 - a.1), (c.0 - b.0, c.1 - b.1));
        let sides = one.0.hypot(one.1) * two.0.hypot(two.1) * (c.0 - a.0).hypot(c.1 - a.1);
        // With falling weights the curve turns clockwise.
        if sides > 0.0 { -2.0 * (one.0 * two.1 - one.1 * two.0) / sides } else { 0.0 }
    };
    let places = 1..rungs.len().saturating_sub(1);
    places.max_by(|&a, &b| bend(a).total_cmp(&bend(b))).unwrap_or(rungs.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_is_where_misfit_stops_falling_and_roughness_starts_rising() {
        let rung = |weight, rms, roughness| LCurvePoint { weight, rms, roughness };
        let rungs = [
            rung(1e2, 40.0, 1.0),
            rung(1e1, 12.0, 1.2),
            rung(1e0, 3.1, 1.6),
            rung(1e-1, 3.0, 20.0),
            rung(1e-2, 2.95, 400.0),
        ];
        assert_eq!(l_curve_corner(&rungs), 2);
        assert_eq!(l_curve_corner(&rungs[..1]), 0);
    }
}
