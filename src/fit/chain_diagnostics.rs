//! Convergence of MCMC chains: autocorrelation time, effective sample size and R-hat.

/// Convergence diagnostics of one variable's chains.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ChainDiagnostics {
    /// Integrated autocorrelation time τ, iterations: τ iterations of a chain are worth one independent draw.
    pub autocorrelation_time: f64,
    /// Effective sample size of all chains together.
    pub effective_draws: f64,
    /// Split R-hat: the ratio of the standard deviation of all values to that within half chains.
    pub r_hat: f64,
}

/// Window of the autocorrelation sum, in autocorrelation times: noise dominates at longer lags (Sokal, *Monte Carlo
/// Methods in Statistical Mechanics*, 1996).
const AUTOCORRELATION_WINDOW: f64 = 5.0;

impl ChainDiagnostics {
    /// R-hat above which chains count as not converged. A stationary chain of n iterations has a mean with an error of
    /// √(τ/n) standard deviations, and so an R-hat of √(1 + τ/n): 1.1 for half chains means that each is five
    /// autocorrelation times long. The usual limit of 1.01 is for a few long chains (Vehtari et al., Bayesian Anal. 16,
    /// 2021); here thousands of chains draw the sample together, and each would have to be as long as one that draws it
    /// alone.
    pub const R_HAT_LIMIT: f64 = 1.1;

    /// Diagnostics of one variable's chains, iteration × walker.
    ///
    /// # Panics
    /// When the length is not a multiple of the number of walkers.
    pub fn from_chains(chains: &[f64], walkers: usize) -> Self {
        assert!(
            walkers > 0 && chains.len().is_multiple_of(walkers),
            "{} values are not whole iterations of {walkers} walkers",
            chains.len()
        );
        let autocorrelation_moves = autocorrelation_time(chains, walkers);
        Self {
            autocorrelation_time: autocorrelation_moves,
            effective_draws: chains.len() as f64 / autocorrelation_moves,
            r_hat: split_r_hat(chains, walkers),
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

/// Gelman and Rubin's ratio (Stat. Sci. 7, 1992) of the two halves of each chain: it rises for chains that stay apart
/// and for chains that still drift. Infinite where no value changed, or with fewer than four iterations.
fn split_r_hat(chains: &[f64], walkers: usize) -> f64 {
    let length = chains.len() / walkers / 2;
    if length < 2 {
        return f64::INFINITY;
    }
    let n = length as f64;
    // The last iterations: with an odd number the oldest is left out.
    let halves = &chains[chains.len() - 2 * length * walkers..];
    let (mut means, mut within) = (Vec::with_capacity(2 * walkers), 0.0);
    for half in halves.chunks(length * walkers) {
        for walker in 0..walkers {
            let values = half[walker..].iter().step_by(walkers);
            let mean = values.clone().sum::<f64>() / n;
            within += values.map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
            means.push(mean);
        }
    }
    let half_chains = means.len() as f64;
    let mean = means.iter().sum::<f64>() / half_chains;
    let between = means.iter().map(|other| (other - mean).powi(2)).sum::<f64>() / (half_chains - 1.0);
    let within = within / half_chains;
    if within > 0.0 { ((n - 1.0) / n + between / within).sqrt() } else { f64::INFINITY }
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
            // The squared error of each half's mean is τ/250 of the variance.
            assert!((found.r_hat - (1.0 + exact / 250.0).sqrt()).abs() < 0.01, "{exact}: {found:?}");
        }
    }

    #[test]
    fn chains_that_stay_apart_or_drift_or_stand_still_are_detected() {
        let apart =
            ChainDiagnostics::from_chains(&chains(500, 0.5, |_, walker| if walker < 20 { 6.0 } else { 0.0 }), WALKERS);
        assert!(apart.r_hat > 1.5 && apart.autocorrelation_time > 100.0, "{apart:?}");
        let drifting =
            ChainDiagnostics::from_chains(&chains(500, 0.5, |iteration, _| 0.01 * iteration as f64), WALKERS);
        assert!(drifting.r_hat > 1.2, "{drifting:?}");
        let constant = ChainDiagnostics::from_chains(&vec![1.0; 40 * WALKERS], WALKERS);
        assert_eq!((constant.r_hat, constant.effective_draws), (f64::INFINITY, 0.0));
    }
}
