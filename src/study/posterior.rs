//! How likely is each value of the factors, and what does that say of every thermocouple?
//!
//! The density is that of the fit itself: residuals over standard deviations and by their loss, weighed by how they scatter
//! and follow each other as intervals and profiles weigh them, times that of priors, between the bounds and even there
//! where there are none. [Walkers](crate::fit::walk()) draw from it, which needs no straightness: where the problem is near
//! linear it agrees with the linear interval, and where it is not, or a bound is near, it has the shape that data give it.
//!
//! What the factors predict of a thermocouple is a band of its own, and not all there is to doubt: see [`Discrepancy`].

mod discrepancy;
mod predicted;
mod region;

pub use discrepancy::Discrepancy;
pub use predicted::{Band, Foreseen, Predicted};
pub use region::{Marginal, Pair};

use super::estimate::{Estimated, priors};
use super::thermocouples::{Part, Sample, Thermocouples, samples};
use crate::case::Case;
use crate::chance::Numbers;
use crate::fit::{LeastSquares, Mixing, Robust, Walk, Weighed, WithPriors, walk};
use crate::march::{March, MarchError};
use crate::plan::Plan;
use nalgebra::{DMatrix, SymmetricEigen};

/// How many walkers, how far they go, and which of all walks it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Walkers {
    /// Walkers.
    pub number: usize,
    /// Moves of each.
    pub moves: usize,
    /// The same seed makes the same walk.
    pub seed: u64,
}

/// What data and priors say of the factors of an estimate, and through them of every thermocouple.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Posterior {
    /// How many walkers there were, and how far they went.
    pub walkers: Walkers,
    /// Moves at the beginning that do not count: five autocorrelation times, or half of all where those are longer.
    pub burn_in: usize,
    /// The share of proposals that was taken.
    pub acceptance: f64,
    /// Members marched, those of the bands among them, one with its derivatives counted once.
    pub marches: usize,
    /// One a factor, in the order of the estimate.
    pub marginals: Vec<Marginal>,
    /// Each factor with each before it: (1, 0), (2, 0), (2, 1) …
    pub pairs: Vec<Pair>,
    /// Some of what was drawn, two thousand at most, each of another walker or at another move: draw × factor.
    pub draws: Vec<Vec<f64>>,
    /// By how much the lowest point met lies below the estimate, in squares of a standard error; nought where none does.
    pub gain: f64,
    /// The error of the model beyond that of the factors.
    pub discrepancy: Discrepancy,
    /// One a case, in their order.
    pub predicted: Vec<Predicted>,
}

/// Why there is no posterior.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PosteriorError {
    /// There are fewer walkers than directions to span.
    #[error("{walkers} walkers are too few for {factors} factors: expected {least} at least")]
    FewWalkers {
        /// Chains asked for.
        walkers: usize,
        /// Factors.
        factors: usize,
        /// The fewest chains.
        least: usize,
    },
    /// The residuals have no scatter to weigh the data by.
    #[error("no posterior: the fit leaves no residual, or no sample to spare, to weigh the data by")]
    NoScatter,
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Draws that are kept, and marched for the bands.
const DRAWS: usize = 2000;
/// Autocorrelation times after which a start is forgotten: to less than a hundredth.
const BURN_IN: f64 = 5.0;
/// Streams of chance of the starts; those of moves lie below.
const STARTS: u64 = 1 << 63;

/// The posterior of an estimate of these cases, by walkers that begin about it.
///
/// # Errors
/// When there are too few walkers, nothing to weigh the data by, or the device fails.
pub fn posterior(
    runs: &[(&Case, &Plan)],
    march: &mut dyn March,
    found: &Estimated,
    walkers: &Walkers,
) -> Result<Posterior, PosteriorError> {
    let factors = found.factors.len();
    // Walkers of one half span all directions only where they are more than those.
    let least = 2 * (factors + 1);
    if walkers.number < least {
        return Err(PosteriorError::FewWalkers { walkers: walkers.number, factors, least });
    }
    let weight = 1.0 / found.shortfall;
    if !weight.is_normal() {
        return Err(PosteriorError::NoScatter);
    }
    let observed: Vec<Vec<Sample>> = runs.iter().map(|(case, plan)| samples(case, plan).concat()).collect();
    let short: Vec<Plan> =
        runs.iter().zip(&observed).map(|((_, plan), observed)| up_to_the_last(plan, observed)).collect();
    let parts =
        runs.iter().zip(&short).zip(&observed).enumerate().map(|(which, (((case, _), plan), observed))| {
            Part::new(case, plan, places(found, which), observed.clone())
        });
    let bounds = found.factors.iter().map(|factor| factor.bounds).collect();
    let problem = Thermocouples::new(&mut *march, parts.collect(), bounds);
    let problem = Weighed { problem: Robust { problem, loss: found.loss }, weight };
    let mut problem = WithPriors { problem, priors: priors(&found.factors, found.prior) };
    let estimate = problem.residuals(&DMatrix::from_column_slice(factors, 1, &found.values))?.norm_squared();
    let walk = walk(&mut problem, &starts(found, walkers), walkers.moves, walkers.seed)?;

    let burn_in = burn_in(&walk);
    let kept: Vec<&[f64]> = walk.trails.iter().map(|trail| &trail[burn_in * walk.walkers..]).collect();
    let draws = draws(&kept, walk.walkers);
    let bounded = kept.iter().zip(&found.factors);
    let marginals: Vec<Marginal> =
        bounded.map(|(kept, factor)| Marginal::of(kept, walk.walkers, factor.bounds)).collect();
    let pairs = (0..factors).flat_map(|second| (0..second).map(move |first| (second, first)));
    let pairs = pairs.map(|(y, x)| Pair::of((x, kept[x], &marginals[x]), (y, kept[y], &marginals[y]))).collect();

    let WithPriors { problem: Weighed { problem: Robust { problem: walked, .. }, .. }, .. } = problem;
    let mut marches = walked.marches + runs.len() * draws.len();
    let mut gains_k = Vec::with_capacity(runs.len());
    for (which, run) in runs.iter().enumerate() {
        let (of_case_k, taken) = discrepancy::gains_k(*run, which, found, march)?;
        gains_k.push(of_case_k);
        marches += taken;
    }
    let discrepancy = Discrepancy::of(found, &observed, &gains_k);
    let mut predicted = Vec::with_capacity(runs.len());
    for (which, run) in runs.iter().enumerate() {
        let asked = predicted::Asked { which, found, draws: &draws, discrepancy, gains_k: &gains_k[which] };
        predicted.push(predicted::predict(*run, march, &asked, walkers.seed)?);
    }
    Ok(Posterior {
        walkers: *walkers,
        burn_in,
        acceptance: walk.acceptance,
        marches,
        marginals,
        pairs,
        gain: (estimate - walk.lowest.1).max(0.0),
        draws,
        discrepancy,
        predicted,
    })
}

impl Posterior {
    /// Whether walkers have been everywhere, in every factor, and a start is forgotten.
    pub fn is_settled(&self) -> bool {
        self.marginals.iter().all(|marginal| marginal.mixing.r_hat <= Mixing::R_HAT) && !self.is_short()
    }

    /// Whether the burn-in is cut short by half of the moves.
    fn is_short(&self) -> bool {
        BURN_IN * self.autocorrelation_moves() > self.burn_in as f64 && 2 * self.burn_in >= self.walkers.moves
    }

    /// The longest autocorrelation time of a factor, moves.
    pub fn autocorrelation_moves(&self) -> f64 {
        self.marginals.iter().map(|marginal| marginal.mixing.autocorrelation_moves).fold(0.0, f64::max)
    }

    /// Moves that would do, by the autocorrelation time at hand: five times it to forget a start, and trails whose halves
    /// are five times it long, with a quarter to spare.
    pub fn enough_moves(&self) -> f64 {
        1.25 * 3.0 * BURN_IN * self.autocorrelation_moves()
    }
}

/// The places of the estimated factors among those of a case.
fn places(found: &Estimated, which: usize) -> Vec<Option<usize>> {
    found.factors.iter().map(|factor| factor.places[which]).collect()
}

/// A plan up to the instant after the last sample that judges it: what comes later moves no residual. One more, as the last
/// step of a march that reacts knows no next one, which is worth microkelvins.
fn up_to_the_last(plan: &Plan, observed: &[Sample]) -> Plan {
    let last = observed.iter().map(|sample| sample.instant).max().unwrap_or(0);
    plan.until((last + 1).min(plan.instants_s.len() - 1))
}

/// Starts about the estimate, one a column: normal with the correlations of the linear intervals and twice the deviations,
/// cut off at the bounds, so that walkers come from outside in. Where nothing is determined, half of the bounds' distance
/// is the deviation.
fn starts(found: &Estimated, walkers: &Walkers) -> DMatrix<f64> {
    let factors = found.factors.len();
    let spreads: Vec<f64> = found
        .intervals
        .iter()
        .zip(&found.factors)
        .map(|(&(low, high), factor)| ((high - low) / 2.0).min((factor.bounds.1 - factor.bounds.0) / 2.0))
        .collect();
    let correlation = DMatrix::from_fn(factors, factors, |i, j| found.identifiability.correlation[i][j]);
    let SymmetricEigen { eigenvectors, eigenvalues } = correlation.symmetric_eigen();
    let start = |walker: usize| {
        let mut numbers = Numbers::of(walkers.seed, STARTS | walker as u64);
        let mut drawn = || {
            let along: Vec<f64> = eigenvalues.iter().map(|value| value.max(FLAT).sqrt() * numbers.normal()).collect();
            let off = |j: usize| (0..factors).map(|k| eigenvectors[(j, k)] * along[k]).sum::<f64>();
            (0..factors).map(|j| found.values[j] + spreads[j] * off(j)).collect::<Vec<f64>>()
        };
        let is_inside = |point: &Vec<f64>| {
            let bounded = point.iter().zip(&found.factors);
            bounded.into_iter().all(|(value, factor)| (factor.bounds.0..=factor.bounds.1).contains(value))
        };
        if let Some(point) = (0..TRIES).map(|_| drawn()).find(is_inside) {
            return point;
        }
        found
            .factors
            .iter()
            .map(|factor| factor.bounds.0 + (factor.bounds.1 - factor.bounds.0) * numbers.unit())
            .collect()
    };
    let columns: Vec<f64> = (0..walkers.number).flat_map(start).collect();
    DMatrix::from_vec(factors, walkers.number, columns)
}

/// The least variance of starts along a direction, of a correlation: walkers never leave a plane that all begin in.
const FLAT: f64 = 1e-8;
/// Draws of a start before it is taken from anywhere between the bounds.
const TRIES: usize = 100;

fn burn_in(walk: &Walk) -> usize {
    let half = walk.moves / 2 * walk.walkers;
    let times = walk.trails.iter().map(|trail| Mixing::of(&trail[half..], walk.walkers).autocorrelation_moves);
    ((BURN_IN * times.fold(0.0, f64::max)).ceil() as usize).min(walk.moves / 2)
}

/// Draws spread over the moves, one walker after the other.
fn draws(kept: &[&[f64]], walkers: usize) -> Vec<Vec<f64>> {
    let all = kept.first().map_or(0, |trail| trail.len());
    let count = all.min(DRAWS);
    let place = |draw: usize| draw * (all / walkers) / count * walkers + draw % walkers;
    (0..count).map(|draw| kept.iter().map(|trail| trail[place(draw)]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::march::{Precision, cpu::Cpu, extrapolated::march_both};
    use crate::pilot::pilot;

    #[test]
    fn a_march_that_ends_with_the_last_sample_shows_what_the_whole_one_does_up_to_there() {
        for id in ["lcat-2259-tc3", "lcat-2259", "kaowool", "lcat-2259-pyrolysis"] {
            let folder = format!("{}/cases/{id}", env!("CARGO_MANIFEST_DIR"));
            let mut case = Case::load(folder.as_ref()).expect("a shipped case loads");
            case.estimate.window_s = Some((0.0, 60.0));
            let plan = pilot(&case).expect("the processor does not fail");
            let short = up_to_the_last(&plan, &samples(&case, &plan).concat());
            assert!(short.steps() < plan.steps() && plan.instants_s.starts_with(&short.instants_s), "{id}");
            let nominal = crate::ensemble::Ensemble::nominal(&case.factors);
            let mut march = Cpu::new(Precision::F64);
            let mut marched = |plan| march_both(&mut march, plan, &nominal, 0..1).expect("it marches");
            let (whole, part) = (marched(&plan), marched(&short));
            for sensor in 0..whole.sensors {
                for (of_whole_k, of_part_k) in
                    whole.trace(0, sensor).iter().zip(&part.trace(0, sensor)[..part.instants - 1])
                {
                    assert!((of_whole_k - of_part_k).abs() < 1e-9, "{id}: {of_whole_k} K for {of_part_k} K");
                }
            }
        }
    }

    #[test]
    fn draws_are_of_all_walkers_and_of_all_moves() {
        let trail: Vec<f64> = (0..50 * 100).map(f64::from).collect();
        let found = draws(&[&trail], 100);
        assert_eq!(found.len(), DRAWS);
        let (walkers, moves): (Vec<usize>, Vec<usize>) =
            found.iter().map(|draw| (draw[0] as usize % 100, draw[0] as usize / 100)).unzip();
        assert!((0..100).all(|walker| walkers.contains(&walker)) && (0..50).all(|turn| moves.contains(&turn)));
        assert_eq!(draws(&[&trail[..30]], 10).len(), 30);
    }
}
