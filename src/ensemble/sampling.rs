//! How the members of an ensemble are drawn.
//!
//! Counter-based: nothing is remembered between members. A member's numbers come from the seed, its own number and the
//! factor alone, so it is the same on every backend, in every batch, and in an ensemble of any size. The Latin
//! hypercube is the exception that its definition forces: its strata are as many as its members, so a member depends
//! on the size of the ensemble too.

use super::{Marginal, SamplingKind};
use crate::case::{Bounds, Correlation, Factor};
use crate::chance::Numbers;
use statrs::distribution::{ContinuousCDF, Normal};

/// How to draw, and from which seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// What the members are drawn from.
    pub kind: SamplingKind,
    /// Members of one seed are the same on every machine.
    pub seed: u64,
}

/// All that is needed to make any member.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    sampling: Sampling,
    members: u64,
    marginals: Vec<Marginal>,
    /// Of the permutations of strata, one a factor.
    keys: Vec<u64>,
    correlation: Correlation,
}

impl Draw {
    pub(super) fn new(factors: &[Factor], bounds: Bounds, sampling: &Sampling, members: usize) -> Self {
        let marginal = |factor: &Factor| Marginal::new(factor.nominal, factor.bounds(bounds), sampling.kind);
        // No member has this number, so its stream is free for the keys.
        let mut keys = Numbers::of(sampling.seed, u64::MAX);
        let keys = factors.iter().map(|_| keys.word()).collect();
        let marginals = factors.iter().map(marginal).collect();
        Self { sampling: *sampling, members: members as u64, marginals, keys, correlation: Correlation::default() }
    }

    pub(super) fn correlated(self, correlation: &Correlation) -> Self {
        Self { correlation: correlation.clone(), ..self }
    }

    /// The factor values of one member.
    pub(super) fn row(&self, member: usize) -> Vec<f64> {
        let member = member as u64;
        let mut numbers = Numbers::of(self.sampling.seed, member);
        let share = |(factor, &key): (usize, &u64)| match self.sampling.kind {
            SamplingKind::Normal | SamplingKind::Uniform => numbers.unit(),
            SamplingKind::LatinHypercube => {
                let stratum = permuted(member, self.members, key);
                (stratum as f64 + numbers.unit()) / self.members as f64
            }
            SamplingKind::Sobol => sobol(self.sampling.seed, member, factor as u64),
        };
        let mut shares: Vec<f64> = self.keys.iter().enumerate().map(share).collect();
        mix(&mut shares, &self.correlation);
        self.marginals.iter().zip(shares).map(|(marginal, share)| marginal.value(share)).collect()
    }
}

/// Independent shares, made to go together; those that correlate with nothing are left to the bit.
fn mix(shares: &mut [f64], correlation: &Correlation) {
    if correlation.is_none() {
        return;
    }
    let scores: Vec<f64> = shares.iter().map(|&share| Normal::standard().inverse_cdf(share)).collect();
    for (share, row) in shares.iter_mut().zip(correlation.rows()) {
        // A row with nothing before its diagonal is that of a factor that is drawn by itself.
        if row[..row.len() - 1].iter().any(|&weight| weight != 0.0) {
            let score: f64 = row.iter().zip(&scores).map(|(weight, score)| weight * score).sum();
            *share = Normal::standard().cdf(score);
        }
    }
}

/// A number strictly between zero and one: one coordinate of a scrambled Sobol point.
fn sobol(seed: u64, member: u64, factor: u64) -> f64 {
    const MEMBERS: u64 = 1 << 16;
    const FACTORS: u64 = sobol_burley::NUM_DIMENSIONS as u64;
    let scramble = mixed(seed ^ mixed((member / MEMBERS) << 32 | (factor / FACTORS))) as u32;
    let coordinate = sobol_burley::sample((member % MEMBERS) as u32, (factor % FACTORS) as u32, scramble);
    // The sequence comes as f32 on a lattice of 2^-24 that holds zero; half a step moves it off.
    f64::from(coordinate) + 0.5f64.powi(25)
}

/// Where a keyed permutation of `0..count` sends an index: a balanced Feistel network over the next even number of
/// bits, walked until it lands inside (Black & Rogaway, "Ciphers with Arbitrary Finite Domains", 2002). It needs no
/// table of all members, as shuffling would.
fn permuted(index: u64, count: u64, key: u64) -> u64 {
    const ROUNDS: u64 = 8;
    let half = (u64::BITS - (count - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1 << half) - 1;
    let mut place = index;
    loop {
        let (mut left, mut right) = (place >> half, place & mask);
        for round in 0..ROUNDS {
            (left, right) = (right, left ^ (mixed(key.wrapping_add(round) ^ mixed(right)) & mask));
        }
        place = left << half | right;
        if place < count {
            return place;
        }
    }
}

/// Every bit of the word spread over every other: the finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014).
fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
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
    fn a_member_is_the_same_in_an_ensemble_of_any_size_but_for_the_hypercube() {
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
    fn every_draw_lies_within_the_side_constraints_and_a_fixed_factor_stays() {
        for kind in KINDS {
            for row in drawn(kind, 3, 70_000) {
                for (value, factor) in row.iter().zip(factors()) {
                    assert!((factor.small.0..=factor.small.1).contains(value), "{kind:?}: {value}");
                }
                assert_eq!(row[3], 1.0);
            }
        }
    }

    /// A standard normal cut off at two deviations has variance 1 − 2·2φ(2)/(2Φ(2) − 1) = 0.7737, that is a
    /// deviation of 0.8796; a uniform between −2 and 2 has a deviation of 2/√3.
    #[test]
    fn mean_and_deviation_are_those_of_the_distribution() {
        for (kind, deviation) in KINDS.into_iter().zip([0.8796, 1.1547, 0.8796, 0.8796]) {
            let n = 40_000.0;
            let values: Vec<f64> = drawn(kind, 11, n as usize).iter().map(|row| (row[0] - 1.0) / 0.125).collect();
            let mean = values.iter().sum::<f64>() / n;
            let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
            // Four standard errors of the mean and of the deviation of independent draws.
            assert!(mean.abs() < 4.0 * deviation / n.sqrt(), "{kind:?}: mean {mean}");
            assert!((spread - deviation).abs() < 4.0 * deviation / (2.0 * n).sqrt(), "{kind:?}: deviation {spread}");
        }
    }

    #[test]
    fn a_nominal_value_off_centre_draws_its_mean_towards_it() {
        let mean = drawn(SamplingKind::Sobol, 5, 4096).iter().map(|row| row[2]).sum::<f64>() / 4096.0;
        // σ = 0.05, nominal 0.92, cut off at −0.4 σ and 3.6 σ: mean 0.92 + σ (φ(0.4) − φ(3.6))/(Φ(3.6) − Φ(−0.4)).
        assert!((mean - (0.92 + 0.05 * (0.368_270 - 0.000_612) / (0.999_841 - 0.344_578))).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn every_stratum_of_the_hypercube_holds_one_member() {
        for members in [1, 2, 3, 100, 1000, 4097] {
            let marginal = Marginal::new(1.0, (0.75, 1.25), SamplingKind::LatinHypercube);
            let edges: Vec<f64> = (0..=members).map(|i| marginal.value(i as f64 / members as f64)).collect();
            let mut held = vec![0; members];
            for row in drawn(SamplingKind::LatinHypercube, 9, members) {
                held[edges[..members].partition_point(|&edge| edge <= row[0]) - 1] += 1;
            }
            assert!(held.iter().all(|&members| members == 1), "{members}: {held:?}");
        }
    }

    #[test]
    fn factors_are_drawn_independently_of_each_other() {
        for kind in KINDS {
            let rows = drawn(kind, 4, 20_000);
            let product: f64 = rows.iter().map(|row| (row[0] - 1.0) / 0.125 * (row[1] - 1.0) / 0.05).sum();
            // Four standard errors of independent draws; the uniform has a fourth moment of (4/3)².
            assert!(product.abs() / 20_000.0 < 4.0 * 4.0 / 3.0 / 20_000f64.sqrt(), "{kind:?}: {product}");
        }
    }

    /// The mean of a product of all three varying factors over 4,096 members, against its exact value.
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
    fn sobol_goes_on_past_its_longest_sequence_and_its_last_dimension() {
        let past = |member, factor| sobol(1, member, factor);
        assert_ne!(past(3, 0), past(3 + (1 << 16), 0));
        assert_ne!(past(3, 0), past(3, 256));
    }

    /// Of two normal scores that correlate by r, the shares do by (6/π) asin(r/2), Pearson's relation of both.
    #[test]
    fn factors_go_together_as_asked_and_each_keeps_its_own_distribution() {
        let correlation = Correlation::new(4, &[(0, 1, 0.6), (1, 2, -0.5)]).expect("positive definite");
        for kind in KINDS {
            let sampling = Sampling { kind, seed: 6 };
            let free = Ensemble::sample(&factors(), Bounds::Small, &sampling, 20_000);
            let tied = free.clone().correlated(&correlation);
            let marginals: Vec<Marginal> =
                factors().iter().map(|factor| Marginal::new(factor.nominal, factor.small, kind)).collect();
            let shares = |row: Vec<f64>| -> Vec<f64> {
                row.iter().zip(&marginals).map(|(value, marginal)| marginal.share(*value) - 0.5).collect()
            };
            let rows: Vec<Vec<f64>> = (0..tied.len()).map(|member| shares(tied.member(member))).collect();
            let product = |a: usize, b: usize| rows.iter().map(|row| 12.0 * row[a] * row[b]).sum::<f64>() / 20_000.0;
            let expected = |r: f64| 6.0 / std::f64::consts::PI * (r / 2.0).asin();
            for (a, b, r) in [(0, 1, 0.6), (1, 2, -0.5), (0, 2, 0.0)] {
                // Four standard errors of the product of two independent shares, 1/√n.
                assert!((product(a, b) - expected(r)).abs() < 4.0 / 20_000f64.sqrt(), "{kind:?}: {a} {b}");
            }
            for factor in 0..3 {
                let mean: f64 = rows.iter().map(|row| row[factor]).sum::<f64>() / 20_000.0;
                assert!(mean.abs() < 4.0 / (12.0 * 20_000f64).sqrt() && (product(factor, factor) - 1.0).abs() < 0.03);
            }
            assert_eq!(tied.member(7)[0], free.member(7)[0], "nothing is before the first");
        }
    }
}
