//! Polynomial basis functions of one and two factors.
//!
//! Per factor, polynomials orthonormal over its distribution; per pair of factors, products of these. For independent
//! factors the basis is orthonormal, and squared coefficients are parts of the variance: a polynomial chaos expansion
//! (Sudret, Reliability Engineering & System Safety 93, 2008) or HDMR (Li, Rosenthal & Rabitz, J. Phys. Chem. A 105,
//! 2001), truncated after pairs.
//!
//! Binning the factors would be worse: two-way bins fine enough to resolve the output are so many that sampling noise
//! exceeds the effect of a weak factor, and they take two hundred times the memory.

use super::round_half_away;
use crate::ensemble::Marginal;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Largest number of functions; it bounds the memory of their products with each other and with the outputs.
pub(super) const FUNCTIONS_MAX: usize = 512;
/// Highest degree of one factor: ten resolve two periods of a sine, or a kink to a 600th of its variance.
const DEGREE_MAX: usize = 10;
/// Quanta per unit of a function. A rounded function is as valid a basis function as the exact one.
pub(super) const QUANTA: f64 = 512.0;
/// Limit of a function, quanta: its product with the largest output, summed over a block, is exact in f64.
pub(super) const MAX_VALUE: f64 = 65_536.0;
/// Quadrature nodes in probability for the orthonormalisation.
const NODES: usize = 1 << 14;

/// A product of two polynomials: factor and degree of each. For a function of one factor the second degree is zero.
type Function = [(usize, usize); 2];

/// The basis functions by rising degree, the constant first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Basis {
    marginals: Vec<Marginal>,
    /// Per factor `(a, b)`, the coefficients of `b_k+1 p_k+1 = (t − a_k) p_k − b_k p_k−1` with `t` the scaled value of
    /// the factor.
    recurrences: Vec<Vec<(f64, f64)>>,
    functions: Vec<Function>,
}

impl Basis {
    pub(super) fn new(marginals: &[Marginal]) -> Self {
        let free: Vec<usize> = (0..marginals.len()).filter(|&factor| !marginals[factor].is_fixed()).collect();
        let (alone, paired) = max_degrees(free.len());
        let mut functions: Vec<Function> = vec![[(0, 0), (0, 0)]];
        for degree in 1..=alone.max(paired) {
            if degree <= alone {
                functions.extend(free.iter().map(|&factor| [(factor, degree), (factor, 0)]));
            }
            for (place, &one) in free.iter().enumerate().filter(|_| degree <= paired) {
                for &other in &free[place + 1..] {
                    functions.extend((1..degree).map(|part| [(one, part), (other, degree - part)]));
                }
            }
        }
        let recurrences = marginals.par_iter().map(|marginal| recurrence_coefficients(marginal, alone)).collect();
        Self { marginals: marginals.to_vec(), recurrences, functions }
    }

    pub(super) fn len(&self) -> usize {
        self.functions.len()
    }

    pub(super) fn marginals(&self) -> &[Marginal] {
        &self.marginals
    }

    /// Number of functions up to the highest complete degree that has at most `most` functions.
    pub(super) fn complete_degrees(&self, most: usize) -> usize {
        let degree = |&[(_, one), (_, other)]: &Function| one + other;
        let past = self.functions.get(most).map_or(usize::MAX, degree);
        self.functions.iter().take_while(|function| degree(function) < past).count()
    }

    /// Indices of the functions that contain a factor, among the first `functions`; with or without products with other
    /// factors.
    pub(super) fn containing(&self, factor: usize, functions: usize, shared: bool) -> Vec<usize> {
        let has = |&[(one, degree), (other, also)]: &Function| {
            let alone = one == factor && degree > 0 && also == 0;
            alone || shared && also > 0 && (one == factor || other == factor)
        };
        (0..functions).filter(|&place| has(&self.functions[place])).collect()
    }

    /// Pairs of factors with the indices of the functions that contain both, among the first `functions`.
    pub(super) fn pairs(&self, functions: usize) -> BTreeMap<(usize, usize), Vec<usize>> {
        let mut pairs: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (place, &[(one, _), (other, degree)]) in self.functions[..functions].iter().enumerate() {
            if degree > 0 {
                pairs.entry((one, other)).or_default().push(place);
            }
        }
        pairs
    }

    /// Evaluate all functions for one member, in integer quanta.
    pub(super) fn evaluate(&self, factors: &[f64], into: &mut [f64]) {
        let polynomials: Vec<Vec<f64>> = (self.marginals.iter().zip(&self.recurrences).zip(factors))
            .map(|((marginal, recurrence), value)| polynomials(recurrence, marginal.scaled(*value)))
            .collect();
        let at = |(factor, degree): (usize, usize)| polynomials.get(factor).map_or(1.0, |values| values[degree]);
        for (into, &[one, other]) in into.iter_mut().zip(&self.functions) {
            *into = round_half_away((at(one) * at(other) * QUANTA).clamp(-MAX_VALUE, MAX_VALUE)) as f64;
        }
    }
}

/// The highest degree of one factor, and the highest total degree of a pair, that fit the limit.
fn max_degrees(factors: usize) -> (usize, usize) {
    let pairs = factors * factors.saturating_sub(1) / 2;
    let room = |alone: usize| (FUNCTIONS_MAX - 1).checked_sub(alone * factors);
    let alone = (0..=DEGREE_MAX).rev().find(|&alone| room(alone).is_some()).unwrap_or(0);
    let fits = |paired: &usize| room(alone).is_some_and(|room| pairs * (paired * (paired - 1) / 2) <= room);
    (alone, (2..=alone + 1).rev().find(fits).unwrap_or(0))
}

/// Stieltjes procedure over the distribution, with nodes evenly spaced in probability.
fn recurrence_coefficients(marginal: &Marginal, degree: usize) -> Vec<(f64, f64)> {
    let share = |node: usize| (node as f64 + 0.5) / NODES as f64;
    let places: Vec<f64> = (0..NODES).map(|node| marginal.scaled(marginal.quantile(share(node)))).collect();
    let mean = |values: &dyn Fn(usize) -> f64| (0..NODES).map(values).sum::<f64>() / NODES as f64;
    let (mut before, mut now) = (vec![0.0; NODES], vec![1.0; NODES]);
    let mut scale = 0.0;
    let mut coefficients = Vec::with_capacity(degree);
    for _ in 0..degree {
        let centre = mean(&|node| places[node] * now[node] * now[node]);
        let next: Vec<f64> =
            (0..NODES).map(|node| (places[node] - centre) * now[node] - scale * before[node]).collect();
        scale = mean(&|node| next[node] * next[node]).sqrt();
        coefficients.push((centre, scale));
        // A fixed factor has only the constant polynomial.
        let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
        before = std::mem::replace(&mut now, next.iter().map(|value| value * inverse).collect());
    }
    coefficients
}

/// Values of the polynomials, from the constant on.
fn polynomials(recurrence: &[(f64, f64)], place: f64) -> Vec<f64> {
    let mut values = vec![1.0];
    let (mut before, mut scale) = (0.0, 0.0);
    for &(centre, next) in recurrence {
        let now = values[values.len() - 1];
        let value = if next > 0.0 { ((place - centre) * now - scale * before) / next } else { 0.0 };
        (before, scale) = (now, next);
        values.push(value);
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::SamplingKind;

    fn marginals(count: usize) -> Vec<Marginal> {
        let kind = |factor: usize| if factor.is_multiple_of(2) { SamplingKind::Normal } else { SamplingKind::Uniform };
        (0..count).map(|factor| Marginal::new(1.0, (0.75, 1.25 + 0.1 * factor as f64), kind(factor))).collect()
    }

    #[test]
    fn functions_are_orthonormal_over_the_distribution_of_their_factor() {
        for marginal in marginals(3) {
            let basis = Basis::new(std::slice::from_ref(&marginal));
            let members = 20_000;
            let mut rows = vec![0.0; members as usize * basis.len()];
            rows.chunks_mut(basis.len()).zip(0..members).for_each(|(row, member)| {
                basis.evaluate(&[marginal.quantile((f64::from(member) + 0.5) / f64::from(members))], row);
            });
            let product = |a: usize, b: usize| {
                let sum: f64 = rows.chunks(basis.len()).map(|row| row[a] * row[b]).sum();
                sum / f64::from(members) / QUANTA / QUANTA
            };
            for a in 0..basis.len() {
                for b in 0..=a {
                    // Rounding to a 512th changes a mean square by up to a thousandth.
                    assert!(
                        (product(a, b) - f64::from(u8::from(a == b))).abs() < 1e-3,
                        "{a} and {b}: {}",
                        product(a, b)
                    );
                }
            }
        }
    }

    #[test]
    fn the_number_of_functions_never_exceeds_its_limit() {
        for factors in 0..600_usize {
            let pairs = factors * factors.saturating_sub(1) / 2;
            let (alone, paired) = max_degrees(factors);
            let functions = 1 + alone * factors + pairs * (paired * paired.saturating_sub(1) / 2);
            assert!(functions <= FUNCTIONS_MAX);
            assert!(factors > 23 || functions > 10 * factors + usize::from(factors > 1) * (pairs.min(1)), "{factors}");
            // Constructing a basis is slow for many factors.
            if factors < 30 || [102, 511, 512].contains(&factors) {
                assert_eq!(Basis::new(&marginals(factors)).len(), functions, "{factors}");
            }
        }
        assert_eq!(Basis::new(&marginals(7)).len(), FUNCTIONS_MAX);
    }

    #[test]
    fn few_members_get_complete_degrees() {
        let basis = Basis::new(&marginals(7));
        // The constant; 7 linear; 7 quadratic and 21 products.
        assert_eq!([0, 1, 7, 8, 35, 36, 37].map(|most| basis.complete_degrees(most)), [0, 1, 1, 8, 8, 36, 36]);
        assert_eq!(basis.complete_degrees(100_000), basis.len());
    }

    #[test]
    fn a_factor_that_is_fixed_has_no_function() {
        let fixed = Marginal::new(1.0, (1.0, 1.0), SamplingKind::Normal);
        let basis = Basis::new(&[fixed, Marginal::new(1.0, (0.9, 1.1), SamplingKind::Normal)]);
        assert_eq!((basis.len(), basis.containing(0, basis.len(), true)), (11, vec![]));
    }
}
