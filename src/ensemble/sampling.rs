//! Sampling of ensemble members.
//!
//! Sampling is counter-based: a member's factors depend on the seed, its index and the factor index only, so they are
//! the same on every backend, in every batch and for every ensemble size. The Latin hypercube is the exception: it has
//! as many strata as members, so a member also depends on the ensemble size.

use super::{Marginal, SamplingKind};
use crate::case::{Bounds, Correlation, Factor};
use crate::random::{RandomStream, splitmix64};
use statrs::distribution::{ContinuousCDF, Normal};

/// Sampling method and seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Sampling {
    /// Sampling method.
    #[serde(rename = "sampling")]
    pub kind: SamplingKind,
    /// Random seed. The same seed gives the same members on every machine.
    pub seed: u64,
}

/// Generates any member of a sampled ensemble.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    sampling: Sampling,
    members: u64,
    marginals: Vec<Marginal>,
    /// Keys of the Latin hypercube's stratum permutations, one per factor.
    stratum_keys: Vec<u64>,
    correlation: Correlation,
}

impl Sampler {
    pub(super) fn new(factors: &[Factor], bounds: Bounds, sampling: &Sampling, members: usize) -> Self {
        let marginal = |factor: &Factor| Marginal::new(factor.nominal, factor.bounds(bounds), sampling.kind);
        // No member has this index, so its stream is free for the keys.
        let mut keys = RandomStream::new(sampling.seed, u64::MAX);
        let keys = factors.iter().map(|_| keys.next_u64()).collect();
        let marginals = factors.iter().map(marginal).collect();
        Self {
            sampling: *sampling,
            members: members as u64,
            marginals,
            stratum_keys: keys,
            correlation: Correlation::default(),
        }
    }

    pub(super) fn correlated(self, correlation: &Correlation) -> Self {
        Self { correlation: correlation.clone(), ..self }
    }

    /// The factor values of one member.
    pub(super) fn member(&self, member: usize) -> Vec<f64> {
        let member = member as u64;
        let mut numbers = RandomStream::new(self.sampling.seed, member);
        let share = |(factor, &key): (usize, &u64)| match self.sampling.kind {
            SamplingKind::Normal | SamplingKind::Uniform => numbers.uniform(),
            SamplingKind::LatinHypercube => {
                let stratum = permute(member, self.members, key);
                (stratum as f64 + numbers.uniform()) / self.members as f64
            }
            SamplingKind::Sobol => sobol(self.sampling.seed, member, factor as u64),
        };
        let mut shares: Vec<f64> = self.stratum_keys.iter().enumerate().map(share).collect();
        correlate(&mut shares, &self.correlation);
        self.marginals.iter().zip(shares).map(|(marginal, share)| marginal.quantile(share)).collect()
    }
}

/// Gaussian copula: correlates independent uniform numbers. Uncorrelated factors keep their values to the last bit.
fn correlate(shares: &mut [f64], correlation: &Correlation) {
    if correlation.is_empty() {
        return;
    }
    let scores: Vec<f64> = shares.iter().map(|&share| Normal::standard().inverse_cdf(share)).collect();
    for (share, row) in shares.iter_mut().zip(correlation.cholesky_rows()) {
        // A row with zeros left of the diagonal belongs to an uncorrelated factor.
        if row[..row.len() - 1].iter().any(|&weight| weight != 0.0) {
            let score: f64 = row.iter().zip(&scores).map(|(weight, score)| weight * score).sum();
            *share = Normal::standard().cdf(score);
        }
    }
}

/// One coordinate of a scrambled Sobol point, in the open interval (0, 1).
fn sobol(seed: u64, member: u64, factor: u64) -> f64 {
    const MEMBERS: u64 = 1 << 16;
    const FACTORS: u64 = sobol_burley::NUM_DIMENSIONS as u64;
    let scramble = splitmix64(seed ^ splitmix64((member / MEMBERS) << 32 | (factor / FACTORS))) as u32;
    let coordinate = sobol_burley::sample((member % MEMBERS) as u32, (factor % FACTORS) as u32, scramble);
    // `sobol_burley` returns f32 on a lattice of 2⁻²⁴ that includes zero; half a step shifts the value into the open
    // interval.
    f64::from(coordinate) + 0.5f64.powi(25)
}

/// Keyed permutation of `0..count`: a balanced Feistel network over the next even number of bits, iterated until the
/// result lies in range (cycle walking: Black & Rogaway, "Ciphers with Arbitrary Finite Domains", 2002). Unlike a
/// shuffle it needs no table of all members.
fn permute(index: u64, count: u64, key: u64) -> u64 {
    const ROUNDS: u64 = 8;
    let half = (u64::BITS - (count - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1 << half) - 1;
    let mut image = index;
    loop {
        let (mut left, mut right) = (image >> half, image & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (splitmix64(key.wrapping_add(round) ^ splitmix64(right)) & mask));
        }
        image = left << half | right;
        if image < count {
            return image;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Property;
    use crate::ensemble::Ensemble;

    const KINDS: [SamplingKind; 4] =
        [SamplingKind::Normal, SamplingKind::Uniform, SamplingKind::LatinHypercube, SamplingKind::Sobol];

    fn factors() -> Vec<Factor> {
        [(1.0, (0.75, 1.25)), (1.0, (0.9, 1.1)), (0.92, (0.9, 1.1)), (1.0, (1.0, 1.0))]
            .into_iter()
            .map(|(nominal, small)| Factor {
                name: "f".into(),
                group: "INS".into(),
                property: Property::Conductivity,
                state: None,
                nominal,
                small,
                large: small,
            })
            .collect()
    }

    fn drawn(kind: SamplingKind, seed: u64, members: usize) -> Vec<Vec<f64>> {
        let ensemble = Ensemble::sample(&factors(), Bounds::Small, &Sampling { kind, seed }, members);
        (0..ensemble.len()).map(|member| ensemble.member(member)).collect()
    }

    #[test]
    fn a_member_does_not_depend_on_ensemble_size_except_in_a_latin_hypercube() {
        for kind in KINDS {
            let same = drawn(kind, 7, 20)[..] == drawn(kind, 7, 300)[..20];
            assert_eq!(same, kind != SamplingKind::LatinHypercube, "{kind:?}");
        }
    }

    #[test]
    fn another_seed_draws_other_members() {
        for kind in KINDS {
            let (one, two) = (drawn(kind, 1, 50), drawn(kind, 2, 50));
            assert!(one.iter().zip(&two).all(|(a, b)| a[0] != b[0]), "{kind:?}");
            assert_eq!(one, drawn(kind, 1, 50), "{kind:?}");
        }
    }

    #[test]
    fn every_draw_lies_within_the_bounds_and_a_fixed_factor_stays() {
        for kind in KINDS {
            for row in drawn(kind, 3, 70_000) {
                for (value, factor) in row.iter().zip(factors()) {
                    assert!((factor.small.0..=factor.small.1).contains(value), "{kind:?}: {value}");
                }
                assert_eq!(row[3], 1.0);
            }
        }
    }

    /// A standard normal truncated at two standard deviations has variance 1 − 2·2φ(2)/(2Φ(2) − 1) = 0.7737 and
    /// standard deviation 0.8796; a uniform distribution on (−2, 2) has standard deviation 2/√3.
    #[test]
    fn sample_mean_and_standard_deviation_match_the_distribution() {
        for (kind, deviation) in KINDS.into_iter().zip([0.8796, 1.1547, 0.8796, 0.8796]) {
            let n = 40_000.0;
            let values: Vec<f64> = drawn(kind, 11, n as usize).iter().map(|row| (row[0] - 1.0) / 0.125).collect();
            let mean = values.iter().sum::<f64>() / n;
            let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
            // Four standard errors of the mean and of the standard deviation of independent draws.
            assert!(mean.abs() < 4.0 * deviation / n.sqrt(), "{kind:?}: mean {mean}");
            assert!((spread - deviation).abs() < 4.0 * deviation / (2.0 * n).sqrt(), "{kind:?}: deviation {spread}");
        }
    }

    #[test]
    fn the_mean_of_an_off_centre_factor_is_that_of_a_split_normal_distribution() {
        let mean = drawn(SamplingKind::Sobol, 5, 4096).iter().map(|row| row[2]).sum::<f64>() / 4096.0;
        // σ is 0.01 below 0.92, with a tenth of the probability, and 0.09 above; the mean of a standard normal variable
        // between 0 and 2 is (φ(0) − φ(2))/(Φ(2) − 1/2).
        let half_mean = (0.398_942 - 0.053_991) / 0.477_250;
        assert!((mean - (0.92 + (0.9 * 0.09 - 0.1 * 0.01) * half_mean)).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn every_stratum_of_the_hypercube_holds_one_member() {
        for members in [1, 2, 3, 100, 1000, 4097] {
            let marginal = Marginal::new(1.0, (0.75, 1.25), SamplingKind::LatinHypercube);
            let edges: Vec<f64> = (0..=members).map(|i| marginal.quantile(i as f64 / members as f64)).collect();
            let mut held = vec![0; members];
            for row in drawn(SamplingKind::LatinHypercube, 9, members) {
                held[edges[..members].partition_point(|&edge| edge <= row[0]) - 1] += 1;
            }
            assert!(held.iter().all(|&members| members == 1), "{members}: {held:?}");
        }
    }

    #[test]
    fn factors_are_independent_without_a_correlation() {
        for kind in KINDS {
            let rows = drawn(kind, 4, 20_000);
            let product: f64 = rows.iter().map(|row| (row[0] - 1.0) / 0.125 * (row[1] - 1.0) / 0.05).sum();
            // Four standard errors for independent draws; the uniform distribution has a fourth moment of (4/3)².
            assert!(product.abs() / 20_000.0 < 4.0 * 4.0 / 3.0 / 20_000f64.sqrt(), "{kind:?}: {product}");
        }
    }

    /// The mean of a product of two varying factors over 4,096 members, against its exact value.
    #[test]
    fn sobol_and_hypercube_integrate_better_than_independent_draws() {
        let error = |kind| {
            let squares = (0..16).map(|seed| {
                let f = |row: &Vec<f64>| (row[0] - 0.5) * (row[1] - 0.5);
                let mean = drawn(kind, seed, 4096).iter().map(f).sum::<f64>() / 4096.0;
                (mean - 0.25f64).powi(2)
            });
            (squares.sum::<f64>() / 16.0).sqrt()
        };
        let (normal, hypercube, sobol) =
            (error(SamplingKind::Normal), error(SamplingKind::LatinHypercube), error(SamplingKind::Sobol));
        assert!(hypercube < normal / 3.0, "{hypercube} against {normal}");
        assert!(sobol < normal / 20.0, "{sobol} against {normal}");
    }

    #[test]
    fn sobol_uses_a_new_scrambling_past_its_longest_sequence_and_last_dimension() {
        let past = |member, factor| sobol(1, member, factor);
        assert_ne!(past(3, 0), past(3 + (1 << 16), 0));
        assert_ne!(past(3, 0), past(3, 256));
    }

    /// Normal scores with correlation r give uniform numbers with correlation (6/π) asin(r/2) (Pearson).
    #[test]
    fn correlated_factors_have_the_requested_correlation_and_keep_their_marginals() {
        let correlation = Correlation::new(4, &[(0, 1, 0.6), (1, 2, -0.5)]).expect("positive definite");
        for kind in KINDS {
            let sampling = Sampling { kind, seed: 6 };
            let independent = Ensemble::sample(&factors(), Bounds::Small, &sampling, 20_000);
            let correlated = independent.clone().correlated(&correlation);
            let marginals: Vec<Marginal> =
                factors().iter().map(|factor| Marginal::new(factor.nominal, factor.small, kind)).collect();
            let shares = |row: Vec<f64>| -> Vec<f64> {
                row.iter().zip(&marginals).map(|(value, marginal)| marginal.cumulative(*value) - 0.5).collect()
            };
            let rows: Vec<Vec<f64>> = (0..correlated.len()).map(|member| shares(correlated.member(member))).collect();
            let product = |a: usize, b: usize| rows.iter().map(|row| 12.0 * row[a] * row[b]).sum::<f64>() / 20_000.0;
            let expected = |r: f64| 6.0 / std::f64::consts::PI * (r / 2.0).asin();
            for (a, b, r) in [(0, 1, 0.6), (1, 2, -0.5), (0, 2, 0.0)] {
                // Four standard errors of the product of two independent uniform numbers, 1/√n.
                assert!((product(a, b) - expected(r)).abs() < 4.0 / 20_000f64.sqrt(), "{kind:?}: {a} {b}");
            }
            for factor in 0..3 {
                let mean: f64 = rows.iter().map(|row| row[factor]).sum::<f64>() / 20_000.0;
                assert!(mean.abs() < 4.0 / (12.0 * 20_000f64).sqrt() && (product(factor, factor) - 1.0).abs() < 0.03);
            }
            assert_eq!(correlated.member(7)[0], independent.member(7)[0], "the first factor keeps its draws");
        }
    }
}
