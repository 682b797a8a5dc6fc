//! Convergence of MCMC chains: autocorrelation time, effective sample size and R-hat.
//!
//! R-hat is that of Vehtari et al. (Bayesian Anal. 16, 2021): of ranks transformed to normal scores, which exists for
//! every distribution, over split chains, and the larger of that of the values and of their distances from the median.
//! As the walkers of an ensemble depend on each other, what is compared are the [independent
//! ensembles](super::ensemble_mcmc::ENSEMBLES), each as one long chain (nested R-hat: Margossian et al., Bayesian Anal.
//! 20, 2025). An R-hat of √(1 + 1/e) is expected from halves of ensembles with e effective draws: 1.01 means 50 each,
//! 400 in all, the smallest effective sample size that Vehtari et al. accept.

use super::ensemble_mcmc::{ENSEMBLES, ensembles};
use crate::numerics::robust_noise::median;
use statrs::distribution::{ContinuousCDF, Normal};

/// Convergence diagnostics of one variable's chains.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ChainDiagnostics {
    /// Integrated autocorrelation time τ, iterations: τ iterations of a chain are worth one independent draw.
    pub autocorrelation_time: f64,
    /// Effective sample size of all chains together.
    pub effective_draws: f64,
    /// Rank-normalised split R-hat between independent ensembles.
    pub r_hat: f64,
}

/// Window of the autocorrelation sum, in autocorrelation times: noise dominates at longer lags (Sokal, *Monte Carlo
/// Methods in Statistical Mechanics*, 1996).
const AUTOCORRELATION_WINDOW: f64 = 5.0;

impl ChainDiagnostics {
    /// R-hat above which chains count as not converged (Vehtari et al. 2021).
    pub const R_HAT_LIMIT: f64 = 1.01;

    /// Diagnostics of one variable's chains, iteration × walker.
    ///
    /// # Panics
    /// When the length is not a multiple of the number of walkers, or there are fewer walkers than ensembles.
    pub fn from_chains(chains: &[f64], walkers: usize) -> Self {
        assert!(
            walkers >= ENSEMBLES && chains.len().is_multiple_of(walkers),
            "{} values are not whole iterations of {walkers} walkers",
            chains.len()
        );
        let autocorrelation_moves = autocorrelation_time(chains, walkers);
        Self {
            autocorrelation_time: autocorrelation_moves,
            effective_draws: chains.len() as f64 / autocorrelation_moves,
            r_hat: rank_normalised_r_hat(chains, walkers),
        }
    }
}

/// `τ = 1 + 2 Σ ρₘ`, where ρₘ is the correlation at lag m over all walkers, about the common mean: chains that stay
/// apart keep a high correlation. The sum ends at the first lag of five times its value, or with the chain. Infinite
/// where no value changed.
fn autocorrelation_time(chains: &[f64], walkers: usize) -> f64 {
    let iterations = chains.len() / walkers;
    let mean = chains.iter().sum::<f64>() / chains.len() as f64;
    let centred: Vec<f64> = chains.iter().map(|value| value - mean).collect();
    let covariance = |lag: usize| {
        let pairs = centred.len() - lag * walkers;
        let later = &centred[lag * walkers..];
        centred[..pairs].iter().zip(later).map(|(a, b)| a * b).sum::<f64>() / pairs as f64
    };
    let variance = covariance(0);
    if iterations == 0 || variance <= 0.0 {
        return f64::INFINITY;
    }
    let mut time = 1.0;
    for lag in 1..iterations {
        time += 2.0 * covariance(lag) / variance;
        if lag as f64 >= AUTOCORRELATION_WINDOW * time {
            break;
        }
    }
    time.max(1.0)
}

/// The larger R-hat of the values and of their distances from the median, both as normal scores. Infinite where no
/// value changed, or with fewer than four iterations.
fn rank_normalised_r_hat(chains: &[f64], walkers: usize) -> f64 {
    let length = chains.len() / walkers / 2;
    if length < 2 {
        return f64::INFINITY;
    }
    // The last iterations: with an odd number the oldest is left out.
    let halves = &chains[chains.len() - 2 * length * walkers..];
    let median = median(halves.to_vec());
    let distances: Vec<f64> = halves.iter().map(|value| (value - median).abs()).collect();
    let of = |values: &[f64]| split_r_hat(&normal_scores(values), walkers);
    of(halves).max(of(&distances))
}

/// Gelman and Rubin's ratio (Stat. Sci. 7, 1992) of both halves of every ensemble: it rises for ensembles that stay
/// apart and for ensembles that still drift.
fn split_r_hat(halves: &[f64], walkers: usize) -> f64 {
    let (mut means, mut within, mut draws) = (Vec::new(), 0.0, 0.0);
    for half in halves.chunks(halves.len() / 2) {
        for ensemble in ensembles(walkers) {
            let values = || half.chunks(walkers).flat_map(|iteration| &iteration[ensemble.clone()]);
            let n = values().count() as f64;
            let mean = values().sum::<f64>() / n;
            within += values().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
            draws += n;
            means.push(mean);
        }
    }
    let parts = means.len() as f64;
    let (n, within) = (draws / parts, within / parts);
    let mean = means.iter().sum::<f64>() / parts;
    let between = means.iter().map(|other| (other - mean).powi(2)).sum::<f64>() / (parts - 1.0);
    if within > 0.0 { ((n - 1.0) / n + between / within).sqrt() } else { f64::INFINITY }
}

/// Normal scores of the ranks (Blom 1958); equal values have the mean of their ranks.
fn normal_scores(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut scores = vec![0.0; values.len()];
    let mut first = 0;
    for equal in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let rank = first as f64 + (equal.len() + 1) as f64 / 2.0;
        let score = Normal::standard().inverse_cdf((rank - 0.375) / (values.len() as f64 + 0.25));
        equal.iter().for_each(|&place| scores[place] = score);
        first += equal.len();
    }
    scores
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    const WALKERS: usize = 200;

    /// Independent first-order autoregressions of unit variance, each about its own centre.
    fn chains(iterations: usize, autocorrelation: f64, centre: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let mut numbers = RandomStream::new(1, 0);
        let mut values: Vec<f64> = (0..WALKERS).map(|_| numbers.normal()).collect();
        let mut chains = Vec::new();
        for iteration in 0..iterations {
            for (walker, value) in values.iter_mut().enumerate() {
                *value = autocorrelation * *value + (1.0 - autocorrelation.powi(2)).sqrt() * numbers.normal();
                chains.push(*value + centre(iteration, walker));
            }
        }
        chains
    }

    /// τ = (1 + φ)/(1 − φ) of a first-order autoregression: 1, 3, 19.
    #[test]
    fn the_autocorrelation_time_of_a_first_order_autoregression_is_exact() {
        for (autocorrelation, exact) in [(0.0, 1.0), (0.5, 3.0), (0.9, 19.0)] {
            let found = ChainDiagnostics::from_chains(&chains(500, autocorrelation, |_, _| 0.0), WALKERS);
            assert!((found.autocorrelation_time / exact - 1.0).abs() < 0.05, "{exact}: {found:?}");
            assert!((found.effective_draws * found.autocorrelation_time / 1e5 - 1.0).abs() < 1e-12);
            // The squared error of the mean of 50 walkers over 250 iterations is τ/12,500 of the variance; the largest
            // of two estimates from eight such means is three times as large in a few of a hundred cases.
            assert!(found.r_hat < (1.0 + 3.0 * exact / 12_500.0).sqrt(), "{exact}: {found:?}");
        }
    }

    #[test]
    fn chains_that_stay_apart_or_drift_or_stand_still_are_detected() {
        let apart =
            ChainDiagnostics::from_chains(&chains(500, 0.5, |_, walker| if walker < 20 { 6.0 } else { 0.0 }), WALKERS);
        assert!(apart.r_hat > 1.05 && apart.autocorrelation_time > 100.0, "{apart:?}");
        // One walker in ten of every ensemble.
        let alike = ChainDiagnostics::from_chains(
            &chains(500, 0.5, |_, walker| if walker % 10 == 0 { 6.0 } else { 0.0 }),
            WALKERS,
        );
        assert!(alike.autocorrelation_time > 100.0, "{alike:?}");
        // The second ensemble is wider, about the same mean.
        let mut wider = chains(500, 0.5, |_, _| 0.0);
        for iteration in wider.chunks_mut(WALKERS) {
            iteration[ensembles(WALKERS)[1].clone()].iter_mut().for_each(|value| *value *= 2.0);
        }
        assert!(ChainDiagnostics::from_chains(&wider, WALKERS).r_hat > 1.02);
        let drifting =
            ChainDiagnostics::from_chains(&chains(500, 0.5, |iteration, _| 0.01 * iteration as f64), WALKERS);
        assert!(drifting.r_hat > 1.2, "{drifting:?}");
        let constant = ChainDiagnostics::from_chains(&vec![1.0; 40 * WALKERS], WALKERS);
        assert_eq!((constant.r_hat, constant.effective_draws), (f64::INFINITY, 0.0));
    }
}
