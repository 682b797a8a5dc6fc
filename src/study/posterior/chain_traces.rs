//! A part of the Markov chains, for trace plots.

use crate::fit::EnsembleChains;

/// Some walkers at some iterations, evenly spread over all, with the burn-in.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ChainTraces {
    /// The iterations, counted from one; the last one is among them.
    pub iterations: Vec<usize>,
    /// Indices of the walkers.
    pub walkers: Vec<usize>,
    /// Values: factor × walker × iteration.
    pub values: Vec<Vec<Vec<f64>>>,
}

/// Walkers stored at most: more lines hide each other.
const MAX_WALKERS: usize = 8;
/// Iterations stored at most.
const MAX_ITERATIONS: usize = 500;

impl ChainTraces {
    pub(super) fn of(sampled: &EnsembleChains) -> Self {
        let walkers: Vec<usize> = (0..sampled.walkers.min(MAX_WALKERS))
            .map(|n| n * sampled.walkers / MAX_WALKERS.min(sampled.walkers))
            .collect();
        let count = sampled.iterations.min(MAX_ITERATIONS);
        let iterations: Vec<usize> = (1..=count).map(|n| n * sampled.iterations / count).collect();
        let trace = |chain: &[f64], walker: usize| -> Vec<f64> {
            iterations.iter().map(|iteration| chain[(iteration - 1) * sampled.walkers + walker]).collect()
        };
        let of_factor = |chain: &Vec<f64>| walkers.iter().map(|&walker| trace(chain, walker)).collect();
        let values = sampled.chains.iter().map(of_factor).collect();
        Self { iterations, walkers, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn traces_are_those_of_their_walkers_from_the_first_iterations_to_the_last() {
        let (walkers, iterations) = (30, 1200);
        let chain = (0..iterations * walkers).map(|place| place as f64).collect();
        let (acceptance, evaluations, lowest) = (0.5, 0, (Vec::new(), 0.0));
        let sampled =
            EnsembleChains { walkers, iterations, chains: vec![chain], acceptance, evaluations, lowest, annealing: 0 };
        let found = ChainTraces::of(&sampled);
        assert_eq!((found.walkers.len(), found.iterations.len()), (MAX_WALKERS, MAX_ITERATIONS));
        assert_eq!((found.iterations[0], found.iterations.last()), (2, Some(&iterations)));
        for (walker, trace) in found.walkers.iter().zip(&found.values[0]) {
            for (iteration, value) in found.iterations.iter().zip(trace) {
                assert_eq!(*value, ((iteration - 1) * walkers + walker) as f64);
            }
        }
    }
}
