//! Posterior distribution of the estimated factors, and of the temperature at every thermocouple.
//!
//! The log density is minus half of the objective of the estimate: robust losses of the standardised residuals,
//! weighted for scatter and autocorrelation as in intervals and profiles, plus the priors, within the bounds. [Ensemble
//! MCMC](crate::fit::ensemble_mcmc()) samples it without a linear approximation, from starts between the bounds and
//! thus over the whole prior, so that modes far from the estimate are found. For a nearly linear problem the intervals
//! equal the linear ones; otherwise, or near a bound, they follow the shape of the density.
//!
//! The posterior predictive distribution of a thermocouple also needs the model error: see [`Discrepancy`].

mod chain_traces;
mod discrepancy;
mod marginals;
mod predictive;

pub use chain_traces::ChainTraces;
pub use discrepancy::Discrepancy;
pub use marginals::{PairMarginal, PosteriorMarginal};
pub use predictive::{PosteriorPredictive, PredictiveBand, SensorPredictive};

use super::estimate::{ParameterEstimates, priors};
use super::thermocouple_residuals::{CaseResiduals, Sample, ThermocoupleResiduals, samples};
use crate::case::Case;
use crate::fit::ensemble_mcmc::{ENSEMBLES, uniform_starts};
use crate::fit::{
    ChainDiagnostics, ChainState, EnsembleChains, LeastSquares, RobustProblem, WeightedProblem, WithPriors,
    ensemble_mcmc_from,
};
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use nalgebra::DMatrix;

/// Settings of the ensemble MCMC sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Walkers {
    /// Number of walkers.
    pub number: usize,
    /// Iterations of each walker.
    pub iterations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// The posterior of the factors of an estimate, and the posterior predictive distribution of every thermocouple.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Posterior {
    /// Settings of the sampler.
    pub walkers: Walkers,
    /// Iterations of annealing from the prior to the posterior.
    pub annealing: usize,
    /// Iterations discarded as burn-in: annealing and five autocorrelation times, at most half of all iterations.
    pub burn_in: usize,
    /// Acceptance rate.
    pub acceptance: f64,
    /// Members marched, including those of the predictive bands; a member with its derivatives counts once.
    pub marches: usize,
    /// One per factor, in the order of the estimate.
    pub marginals: Vec<PosteriorMarginal>,
    /// Each factor with each before it: (1, 0), (2, 0), (2, 1) …
    pub pairs: Vec<PairMarginal>,
    /// At most two thousand posterior draws, spread over walkers and iterations: draw × factor.
    pub draws: Vec<Vec<f64>>,
    /// Some of the chains, from their first iteration.
    pub chains: ChainTraces,
    /// Decrease of the objective from the estimate to the lowest point sampled, in squares of a standard error; zero
    /// where no point is lower.
    pub objective_decrease: f64,
    /// The model discrepancy.
    pub discrepancy: Discrepancy,
    /// One per case, in their order.
    pub predicted: Vec<PosteriorPredictive>,
    /// The largest discretisation error of each case at the ends of the intervals of the factors, where the others are
    /// at their medians, K; `None` where the case states cells and steps, and empty where it was not measured.
    pub discretisation_errors_k: Vec<Option<f64>>,
}

/// Fall of the scaled objective that is warned of: the rise at one standard error. Less may be rounding.
const OBJECTIVE_FALL: f64 = 1.0;

impl Posterior {
    /// Whether the chains found a point well below the estimate.
    pub(crate) fn has_lower_objective(&self) -> bool {
        self.objective_decrease > OBJECTIVE_FALL
    }
}

/// Errors of a posterior.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PosteriorError {
    /// Too few walkers to span the parameter space.
    #[error("{walkers} walkers are too few for {factors} factors: expected at least {least}")]
    TooFewWalkers {
        /// Requested walkers.
        walkers: usize,
        /// Number of factors.
        factors: usize,
        /// Smallest number of walkers.
        least: usize,
    },
    /// The residuals have no scatter to weight the data by.
    #[error("no posterior: the noise level is undefined, because the fit has zero residuals or no spare samples")]
    NoScatter,
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Largest number of draws stored and marched for the predictive bands.
const MAX_DRAWS: usize = 2000;
/// Autocorrelation times of burn-in: the influence of the start falls below 1 %.
const BURN_IN_TIMES: f64 = 5.0;
/// Autocorrelation times of each half of the chains after the burn-in, at least: walkers that are stuck in several
/// modes have one as long as their chains, whether or not the ensembles agree.
const HALF_CHAIN_TIMES: f64 = 5.0;
/// Effective sample size of the recommended iterations. [R-hat](ChainDiagnostics) of 1.01 is expected at 400; the
/// largest of several factors is below it with a few hundred more.
const RECOMMENDED_DRAWS: f64 = 1000.0;

/// Sample the posterior of an estimate of these cases. `log` keeps the iterations.
///
/// # Errors
/// When there are too few walkers, the noise level is undefined, or the device fails.
pub fn posterior(
    runs: &[(&Case, &Plan)],
    march: &mut dyn March,
    found: &ParameterEstimates,
    walkers: &Walkers,
    log: &mut dyn WorkLog,
) -> Result<Posterior, PosteriorError> {
    let factors = found.factors.len();
    // Each half of an ensemble spans the parameter space only with more walkers than factors.
    let least = 2 * ENSEMBLES * (factors + 1);
    if walkers.number < least {
        return Err(PosteriorError::TooFewWalkers { walkers: walkers.number, factors, least });
    }
    let weight = 1.0 / found.noise_inflation;
    if !weight.is_normal() {
        return Err(PosteriorError::NoScatter);
    }
    let observed: Vec<Vec<Sample>> = runs.iter().map(|(case, plan)| samples(case, plan).concat()).collect();
    let short: Vec<Plan> =
        runs.iter().zip(&observed).map(|((_, plan), observed)| truncated_plan(plan, observed)).collect();
    let parts = runs.iter().zip(&short).zip(&observed).enumerate().map(|(which, (((case, _), plan), observed))| {
        CaseResiduals::new(case, plan, factor_indices(found, which), observed.clone())
    });
    let bounds: Vec<(f64, f64)> = found.factors.iter().map(|factor| factor.bounds).collect();
    let starts = uniform_starts(&bounds, walkers.number, walkers.seed);
    let problem = ThermocoupleResiduals::new(&mut *march, parts.collect(), bounds);
    let problem = WeightedProblem { problem: RobustProblem { problem, loss: found.loss }, weight };
    let mut problem = WithPriors { problem, priors: priors(&found.factors, found.prior) };
    let estimate = problem.residuals(&DMatrix::from_column_slice(factors, 1, &found.values))?.norm_squared();
    let Walkers { number, iterations, seed } = *walkers;
    let earlier = std::iter::from_fn(|| Some(ChainState::from_numbers(log.next()?, factors, number))).collect();
    let on_iteration = &mut |state: &ChainState| log.add(&state.to_numbers());
    let sampled = ensemble_mcmc_from(&mut problem, &starts, iterations, seed, earlier, on_iteration)?;

    let burn_in = burn_in(&sampled);
    let chains: Vec<&[f64]> = sampled.chains.iter().map(|chain| &chain[burn_in * sampled.walkers..]).collect();
    let draws = draws(&chains, sampled.walkers);
    let bounded = chains.iter().zip(&found.factors);
    let marginals: Vec<PosteriorMarginal> =
        bounded.map(|(chains, factor)| PosteriorMarginal::of(chains, sampled.walkers, factor.bounds)).collect();
    let pairs = (0..factors).flat_map(|second| (0..second).map(move |first| (second, first)));
    let pairs =
        pairs.map(|(y, x)| PairMarginal::of((x, chains[x], &marginals[x]), (y, chains[y], &marginals[y]))).collect();

    // One more of each case for the estimate.
    let mut marches = runs.len() * (1 + sampled.evaluations + draws.len());
    let mut gains_k = Vec::with_capacity(runs.len());
    for (which, run) in runs.iter().enumerate() {
        let (of_case_k, taken) = discrepancy::gains_k(*run, which, found, march)?;
        gains_k.push(of_case_k);
        marches += taken;
    }
    let discrepancy = Discrepancy::of(found, &observed, &gains_k);
    let mut predicted = Vec::with_capacity(runs.len());
    for (which, run) in runs.iter().enumerate() {
        let asked = predictive::PredictiveInputs {
            case_index: which,
            estimates: found,
            draws: &draws,
            discrepancy,
            gains_k: &gains_k[which],
        };
        predicted.push(predictive::predict(*run, march, &asked, walkers.seed)?);
    }
    Ok(Posterior {
        walkers: *walkers,
        annealing: sampled.annealing,
        burn_in,
        acceptance: sampled.acceptance,
        marches,
        marginals,
        pairs,
        objective_decrease: (estimate - sampled.lowest.1).max(0.0),
        draws,
        chains: ChainTraces::of(&sampled),
        discrepancy,
        predicted,
        discretisation_errors_k: Vec::new(),
    })
}

/// Numbers of a row in the log of a posterior.
pub(crate) fn log_columns(found: &ParameterEstimates, walkers: &Walkers) -> usize {
    ChainState::length(found.factors.len(), walkers.number)
}

impl Posterior {
    /// Whether the chains have converged: R-hat of every factor is below its limit, and burn-in and chains are long
    /// enough.
    pub fn has_converged(&self) -> bool {
        self.marginals.iter().all(|marginal| marginal.diagnostics.r_hat <= ChainDiagnostics::R_HAT_LIMIT)
            && !self.is_burn_in_short()
            && self.has_mixed()
    }

    /// Whether each half of the chains after the burn-in is several autocorrelation times long.
    pub fn has_mixed(&self) -> bool {
        let kept = (self.walkers.iterations - self.burn_in) as f64;
        kept >= 2.0 * HALF_CHAIN_TIMES * self.autocorrelation_time()
    }

    /// Whether half of the iterations is too short for the burn-in.
    fn is_burn_in_short(&self) -> bool {
        let needed = self.annealing as f64 + BURN_IN_TIMES * self.autocorrelation_time();
        needed > self.burn_in as f64 && 2 * self.burn_in + 1 >= self.walkers.iterations
    }

    /// Longest autocorrelation time of a factor, iterations.
    pub fn autocorrelation_time(&self) -> f64 {
        self.marginals.iter().map(|marginal| marginal.diagnostics.autocorrelation_time).fold(0.0, f64::max)
    }

    /// Recommended iterations, from the present autocorrelation time τ: annealing, a burn-in of 5 τ, and two half
    /// chains of 5 τ each or a thousand effective draws, whichever is longer, plus a margin of 25 %.
    pub fn recommended_iterations(&self) -> f64 {
        let times = BURN_IN_TIMES + (2.0 * HALF_CHAIN_TIMES).max(RECOMMENDED_DRAWS / self.walkers.number as f64);
        1.25 * (self.annealing as f64 + times * self.autocorrelation_time())
    }
}

/// Indices of the estimated factors in a case.
fn factor_indices(found: &ParameterEstimates, which: usize) -> Vec<Option<usize>> {
    found.factors.iter().map(|factor| factor.factor_indices[which]).collect()
}

/// The plan up to one instant after the last fitted sample: later steps change no residual. The extra instant is needed
/// because the last step of a reacting march cannot extrapolate to a next one, which costs some microkelvins.
fn truncated_plan(plan: &Plan, observed: &[Sample]) -> Plan {
    let last = observed.iter().map(|sample| sample.instant).max().unwrap_or(0);
    plan.truncated_at((last + 1).min(plan.instants_s.len() - 1))
}

fn burn_in(sampled: &EnsembleChains) -> usize {
    let half = sampled.iterations / 2 * sampled.walkers;
    let times = sampled
        .chains
        .iter()
        .map(|chain| ChainDiagnostics::from_chains(&chain[half..], sampled.walkers).autocorrelation_time);
    let after_annealing = (BURN_IN_TIMES * times.fold(0.0, f64::max)).ceil() as usize;
    sampled.annealing.saturating_add(after_annealing).min(sampled.iterations / 2)
}

/// Draws spread over the iterations, alternating between walkers.
fn draws(chains: &[&[f64]], walkers: usize) -> Vec<Vec<f64>> {
    let all = chains.first().map_or(0, |chain| chain.len());
    let count = all.min(MAX_DRAWS);
    let place = |draw: usize| draw * (all / walkers) / count * walkers + draw % walkers;
    (0..count).map(|draw| chains.iter().map(|chain| chain[place(draw)]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adapt::adapt;
    use crate::march::{Precision, cpu::Cpu, richardson::march_extrapolated};

    #[test]
    fn a_march_truncated_after_the_last_sample_equals_the_full_march_up_to_there() {
        for id in ["lcat-2259-tc3", "lcat-2259", "kaowool", "lcat-2259-pyrolysis"] {
            let folder = format!("{}/cases/{id}", env!("CARGO_MANIFEST_DIR"));
            let mut case = Case::load(folder.as_ref()).expect("a shipped case loads");
            case.estimate.window_s = Some((0.0, 60.0));
            let plan = adapt(&case).expect("the processor does not fail");
            let short = truncated_plan(&plan, &samples(&case, &plan).concat());
            assert!(short.steps() < plan.steps() && plan.instants_s.starts_with(&short.instants_s), "{id}");
            let nominal = crate::ensemble::Ensemble::nominal(&case.factors);
            let mut march = Cpu::new(Precision::F64);
            let mut marched = |plan| march_extrapolated(&mut march, plan, &nominal, 0..1).expect("it marches");
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
    fn draws_cover_all_walkers_and_all_iterations() {
        let chain: Vec<f64> = (0..50 * 100).map(f64::from).collect();
        let found = draws(&[&chain], 100);
        assert_eq!(found.len(), MAX_DRAWS);
        let (walkers, moves): (Vec<usize>, Vec<usize>) =
            found.iter().map(|draw| (draw[0] as usize % 100, draw[0] as usize / 100)).unzip();
        assert!((0..100).all(|walker| walkers.contains(&walker)) && (0..50).all(|turn| moves.contains(&turn)));
        assert_eq!(draws(&[&chain[..30]], 10).len(), 30);
    }
}
