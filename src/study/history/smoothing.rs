//! How smooth a history should be.
//!
//! Noise is blown up on its way back to the face, the more the shorter a history's bends, so data alone give one that is all noise. What is
//! made least is the misfit and, times a weight, the roughness (Tikhonov). By the discrepancy principle the weight is the largest at
//! which data are met as well as their noise says and no better: a weighted root mean square of one (Morozov, *Methods for Solving
//! Incorrectly Posed Problems*, 1984; Beck, Blackwell & St Clair, *Inverse Heat Conduction*, 1985). It takes the noise at its word, but for chance: so
//! many samples scatter by a little more or less than they are said to, and where no weight leads to one, that much more is aimed at. Where no
//! weight meets that either, what no history explains is taken for the noise. The corner of the L-curve needs no word of noise: beyond it
//! the misfit rises fast, short of it the roughness (Hansen, SIAM Review 34, 1992). It is not what is fallen back on, as deep sensors have no corner.

use crate::fit::Fit;
use nalgebra::DVector;

/// Weights tried, as powers of ten of that at which misfit and roughness change alike: from straight lines to noise.
const STRONGEST: i32 = 3;
const WEAKEST: i32 = -6;
/// A weighted root mean square this share below a level meets it: eighty samples do not tell it to a hundredth.
const NEAR: f64 = 0.005;
/// The weight is not sought closer than this, in powers of ten.
const NARROW: f64 = 0.02;

/// What so many samples may scatter by over what they are said to, in all but a fortieth of data sets: the deviation of a root mean
/// square of n is `1/√(2n)`.
fn by_chance(samples: usize) -> f64 {
    1.0 + 2.0 / (2.0 * samples as f64).sqrt()
}

/// How the weight is told.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Smoothing {
    /// Residuals as large as the noise (Morozov's discrepancy principle).
    Discrepancy,
    /// The corner of the L-curve.
    LCurve,
    /// The weight itself, over that at which misfit and roughness change alike; zero or more.
    Stated(f64),
}

/// By what the weight was chosen in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Chosen {
    /// The noise: the largest weight at which data are met.
    Discrepancy,
    /// Nothing but straight lines between sharp corners is needed to meet the data.
    Straight,
    /// What no history explains, taken for the noise: no weight meets the data.
    Unmet,
    /// The corner of the L-curve, as was asked.
    LCurve,
    /// The weight was stated.
    Stated,
}

/// What one weight leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Rung {
    /// Over that at which misfit and roughness change alike.
    pub weight: f64,
    /// Weighted root mean square of the residuals of the data.
    pub rms: f64,
    /// Root of `H³ ∫ q″² dt`, of the flux over its scale.
    pub roughness: f64,
}

/// One weight solved.
#[derive(Clone, Debug)]
pub(super) struct Solved {
    pub rung: Rung,
    pub fit: Fit,
}

/// Choose a weight. `solve` finds the history of a weight from another; each begins where the one before ended, from the strongest on, as
/// little changes from one to the next.
pub(super) fn chosen<E>(
    smoothing: Smoothing,
    samples: usize,
    start: &DVector<f64>,
    is_smoothed: bool,
    mut solve: impl FnMut(f64, &DVector<f64>) -> Result<Solved, E>,
) -> Result<(Solved, Chosen, Vec<Rung>), E> {
    if let Smoothing::Stated(weight) = smoothing {
        let solved = solve(weight, start)?;
        let rung = solved.rung;
        return Ok((solved, Chosen::Stated, vec![rung]));
    }
    let mut ladder: Vec<Solved> = Vec::new();
    let weakest = if is_smoothed { WEAKEST } else { STRONGEST };
    for power in (weakest..=STRONGEST).rev() {
        let from = ladder.last().map_or(start, |solved| &solved.fit.point);
        let solved = solve(10f64.powi(power), from)?;
        let is_met = solved.rung.rms <= 1.0;
        ladder.push(solved);
        if is_met && smoothing == Smoothing::Discrepancy {
            break;
        }
    }
    if smoothing == Smoothing::Discrepancy {
        let met_at = |level: f64| Some((ladder.iter().position(|solved| solved.rung.rms <= level)?, level));
        let least = ladder.iter().map(|solved| solved.rung.rms).fold(f64::INFINITY, f64::min);
        let noise = met_at(1.0).or_else(|| met_at(by_chance(samples)));
        let rest = met_at(least * by_chance(samples)).filter(|_| noise.is_none());
        if let Some((place, level)) = noise.or(rest) {
            let (solved, why, rungs) = met(ladder, place, level, solve)?;
            return Ok((solved, if noise.is_none() { Chosen::Unmet } else { why }, rungs));
        }
    }
    let corner = corner(&ladder.iter().map(|solved| solved.rung).collect::<Vec<_>>());
    Ok(taken(ladder, corner, Chosen::LCurve))
}

/// The largest weight that meets a level, between the last that does not and the first that does.
fn met<E>(
    mut ladder: Vec<Solved>,
    first: usize,
    level: f64,
    mut solve: impl FnMut(f64, &DVector<f64>) -> Result<Solved, E>,
) -> Result<(Solved, Chosen, Vec<Rung>), E> {
    if first == 0 {
        return Ok(taken(ladder, 0, Chosen::Straight));
    }
    let (mut best, mut over) = (first, first - 1);
    while ladder[best].rung.rms < level * (1.0 - NEAR)
        && (ladder[over].rung.weight / ladder[best].rung.weight).log10() > NARROW
    {
        let weight = (ladder[over].rung.weight * ladder[best].rung.weight).sqrt();
        let solved = solve(weight, &ladder[best].fit.point)?;
        ladder.push(solved);
        let last = ladder.len() - 1;
        if ladder[last].rung.rms <= level { best = last } else { over = last }
    }
    Ok(taken(ladder, best, Chosen::Discrepancy))
}

fn taken(mut ladder: Vec<Solved>, place: usize, why: Chosen) -> (Solved, Chosen, Vec<Rung>) {
    let mut rungs: Vec<Rung> = ladder.iter().map(|solved| solved.rung).collect();
    rungs.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    (ladder.swap_remove(place), why, rungs)
}

/// Where the curve of the logarithms of roughness over misfit bends most towards the origin, weights falling; the weakest of fewer
/// than three.
fn corner(rungs: &[Rung]) -> usize {
    let point = |rung: &Rung| (rung.rms.max(1e-12).ln(), rung.roughness.max(1e-12).ln());
    let bend = |place: usize| {
        let [a, b, c] = [place - 1, place, place + 1].map(|place| point(&rungs[place]));
        let (one, two) = ((b.0 - a.0, b.1 - a.1), (c.0 - b.0, c.1 - b.1));
        let sides = one.0.hypot(one.1) * two.0.hypot(two.1) * (c.0 - a.0).hypot(c.1 - a.1);
        // Weights fall leftwards and then up: a turn clockwise.
        if sides > 0.0 { -2.0 * (one.0 * two.1 - one.1 * two.0) / sides } else { 0.0 }
    };
    let places = 1..rungs.len().saturating_sub(1);
    places.max_by(|&a, &b| bend(a).total_cmp(&bend(b))).unwrap_or(rungs.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_is_where_misfit_stops_to_fall_and_roughness_begins_to_rise() {
        let rung = |weight, rms, roughness| Rung { weight, rms, roughness };
        let rungs = [
            rung(1e2, 40.0, 1.0),
            rung(1e1, 12.0, 1.2),
            rung(1e0, 3.1, 1.6),
            rung(1e-1, 3.0, 20.0),
            rung(1e-2, 2.95, 400.0),
        ];
        assert_eq!(corner(&rungs), 2);
        assert_eq!(corner(&rungs[..1]), 0);
    }
}
