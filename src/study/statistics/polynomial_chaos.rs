//! First-order, second-order and total Sobol indices from the members of an ordinary Monte Carlo sweep.
//!
//! Each output is expanded by least squares over all members in basis functions of one and two factors. The explained
//! variance is attributed to the factors; the residual is the unexplained part. Saltelli's sampling, which is unbiased
//! for any model, needs `factors + 2` times as many marches, useful for nothing else.
//!
//! **Independent factors.** The functions are orthonormal over the sampling distribution, so squared coefficients are
//! parts of the variance `V`: of one factor alone, and of all functions that contain it. The residual mean square is
//! the unexplained part. The sampling variance of each coefficient is subtracted from its square.
//!
//! **Correlated factors.** `S = Var(E[T|f]) / V` is the part of the expansion's variance that functions of the factor
//! alone explain, including the effect of correlated factors. `S_T = E[Var(T|others)] / V` is the part that only
//! functions with the factor explain, the variance that would remain with all others known. These parts may overlap or
//! leave gaps, so they do not sum to one. A pair has no part of its own then, and there are no second-order indices.

use super::basis::QUANTA;
use super::interval::{NORMAL_95, PairIndex};
use super::output::OutputSums;
use super::{Accumulator, COARSE_LOG2, ConfidenceInterval, chunk_len};
use nalgebra::{Cholesky, DMatrix, DVectorView, Dyn};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Smallest number of members per function; with fewer, the expansion overfits.
const MEMBERS_PER_FUNCTION: usize = 8;
/// Inflation of the coefficient variance. The residual is not independent noise: it is largest at the ends of the
/// ranges, where the functions are large, so the coefficient variance exceeds that from the mean square. For a product
/// of three factors and functions of two of them, the inflation is twice the fourth moment of a factor over its squared
/// variance: 3.2 for a uniform distribution, 5.6 for a normal one truncated at two standard deviations.
const ERROR_INFLATION: f64 = 5.6;
/// Rounding to coarse quanta adds a variance of a twelfth of a squared quantum; an output with less than ten times that
/// is taken as constant.
const MIN_VARIANCE: f64 = 10.0 / 12.0;

/// Sobol indices of one output.
#[derive(Clone)]
pub(super) struct SobolIndices {
    /// First-order and total indices, one per factor.
    pub(super) first: Vec<ConfidenceInterval>,
    pub(super) total: Vec<ConfidenceInterval>,
    /// Second-order indices; only where they were requested.
    pub(super) second: Vec<PairIndex>,
    pub(super) unexplained: f64,
}

impl SobolIndices {
    /// NaN indices, for too few members.
    pub(super) fn unknown(factors: usize) -> Self {
        Self {
            first: vec![ConfidenceInterval::UNKNOWN; factors],
            total: vec![ConfidenceInterval::UNKNOWN; factors],
            second: Vec::new(),
            unexplained: f64::NAN,
        }
    }
}

/// The part of the expansion that all outputs share.
pub(super) struct PolynomialChaos<'a> {
    accumulator: &'a Accumulator,
    functions: usize,
    /// Inverse of the Gram matrix of the functions.
    gram_inverse: DMatrix<f64>,
    /// Covariance of the functions, for correlated factors; `None` where the variance is the sum of squared
    /// coefficients.
    covariance: Option<DMatrix<f64>>,
    /// First-order and total part, per factor.
    parts: Vec<[VariancePart; 2]>,
    /// The part of each pair of factors, for independent factors.
    pairs: Vec<((usize, usize), VariancePart)>,
}

/// A part of the variance: the sum of squares of some coefficients, or of linear combinations of them.
struct VariancePart {
    functions: Vec<usize>,
    mixture: Option<DMatrix<f64>>,
}

impl<'a> PolynomialChaos<'a> {
    /// `None` for fewer members than a linear function of every factor needs.
    pub(super) fn new(accumulator: &'a Accumulator, are_independent: bool) -> Option<Self> {
        let scale = QUANTA * QUANTA * accumulator.members as f64;
        let mut functions = accumulator.basis.complete_degrees(accumulator.members / MEMBERS_PER_FUNCTION);
        // Where the Gram matrix is singular for these members, functions of lower degree are used.
        let (products, factored) = loop {
            if functions < 2 {
                return None;
            }
            let products =
                DMatrix::from_fn(functions, functions, |a, b| accumulator.gram[a.max(b)][a.min(b)] as f64 / scale);
            match products.clone().cholesky() {
                Some(factored) => break (products, factored),
                None => functions = accumulator.basis.complete_degrees(functions - 1),
            }
        };
        let inverse = inverse(&factored);
        let joint = (!are_independent).then(|| {
            let means = products.column(0);
            &products - means * means.transpose()
        });
        let part = |factor: usize, shared: bool| {
            let chosen = accumulator.basis.containing(factor, functions, shared);
            let mixture = joint.as_ref().and_then(|joint| {
                let within = |of: &DMatrix<f64>| of.select_rows(&chosen).select_columns(&chosen);
                if shared {
                    // Part of the covariance that the other functions cannot explain: the Schur complement, the inverse
                    // of a block of the inverse.
                    let own = within(&inverse).cholesky()?.inverse().cholesky()?.l();
                    let mut mixture = DMatrix::zeros(chosen.len(), functions);
                    for (&function, row) in chosen.iter().zip(own.row_iter()) {
                        mixture.set_column(function, &row.transpose());
                    }
                    Some(mixture)
                } else {
                    within(joint).cholesky()?.l().solve_lower_triangular(&joint.select_rows(&chosen))
                }
            });
            VariancePart { functions: chosen, mixture }
        };
        let parts = (0..accumulator.factors()).map(|factor| [part(factor, false), part(factor, true)]).collect();
        let pairs = if are_independent { accumulator.basis.pairs(functions) } else { BTreeMap::new() };
        let pairs =
            pairs.into_iter().map(|(pair, functions)| (pair, VariancePart { functions, mixture: None })).collect();
        Some(Self { accumulator, functions, gram_inverse: inverse, covariance: joint, parts, pairs })
    }

    /// Indices of some outputs, the first of them number `first`; those in `second_order` with indices of pairs.
    pub(super) fn indices(
        &self,
        outputs: &[OutputSums],
        first: usize,
        second_order: &Range<usize>,
    ) -> Vec<SobolIndices> {
        let members = self.accumulator.members as f64;
        let moment = |function: usize, output: usize| outputs[output].moments[function] as f64 / members / QUANTA;
        let moments = DMatrix::from_fn(self.functions, outputs.len(), moment);
        let coefficients = &self.gram_inverse * &moments;
        let each = outputs.iter().zip(moments.column_iter().zip(coefficients.column_iter()));
        let numbered = (first..).zip(each);
        let indices = numbered.map(|(number, (output, (moments, coefficients)))| {
            self.output_indices(output, moments, coefficients, second_order.contains(&number))
        });
        indices.collect()
    }

    /// Indices of an output, from its mean products with the functions and its least-squares coefficients.
    fn output_indices(
        &self,
        output: &OutputSums,
        moments: DVectorView<'_, f64>,
        coefficients: DVectorView<'_, f64>,
        second_order: bool,
    ) -> SobolIndices {
        let (members, functions) = (self.accumulator.members as f64, self.functions as f64);
        let coarse = f64::from(1 << COARSE_LOG2);
        let square = output.sums.squares as f64 / members / coarse / coarse;
        let left = (square - moments.dot(&coefficients)).max(0.0) * members / (members - functions);
        // Sampling variance of a coefficient.
        let noise = |function: usize| left * self.gram_inverse[(function, function)] / members;
        let explained = match &self.covariance {
            None => (1..self.functions).map(|function| coefficients[function].powi(2) - noise(function)).sum(),
            Some(joint) => coefficients.dot(&(joint * coefficients)) - left * (functions - 1.0) / members,
        };
        let variance = f64::max(explained, 0.0) + left;
        let is_constant = variance < MIN_VARIANCE;
        let rest = if is_constant { 0.0 } else { left / variance };
        let index = |part: &VariancePart| {
            if is_constant {
                return ConfidenceInterval { value: 0.0, low: 0.0, high: 0.0 };
            }
            let count = part.functions.len() as f64;
            let sum: f64 = match &part.mixture {
                None => part.functions.iter().map(|&at| coefficients[at].powi(2) - noise(at)).sum(),
                Some(mixture) => (mixture * coefficients).norm_squared() - left * count / members,
            };
            self.index_interval(f64::clamp(sum / variance, 0.0, 1.0), rest, count)
        };
        let [first, total] = [0, 1].map(|order| self.parts.iter().map(|part| index(&part[order])).collect());
        let pairs = self.pairs.iter().filter(|_| second_order);
        let second = pairs.map(|(factors, part)| PairIndex { factors: *factors, index: index(part) }).collect();
        SobolIndices { first, total, second, unexplained: rest }
    }

    /// An index with its 95 % interval, from its value, the unexplained fraction, and the number of functions `count`
    /// in its part.
    ///
    /// For independent noise each coefficient has a variance of `rest/members`; [`ERROR_INFLATION`] explains the larger
    /// factor. The error of the index follows from its derivatives; the term with `count` is the chance contribution.
    /// For correlated factors the covariance of the functions is estimated from the members, which adds a relative
    /// error of one over the members. The unexplained part may belong to any factor, so it is added to the upper end
    /// together with its own error.
    fn index_interval(&self, value: f64, rest: f64, count: f64) -> ConfidenceInterval {
        let (members, free) = (self.accumulator.members as f64, (self.accumulator.members - self.functions) as f64);
        let noise = ERROR_INFLATION * rest;
        let covariance_noise = if self.covariance.is_some() { noise.max(1.0) } else { noise };
        let own = (4.0 * covariance_noise * value * (1.0 - value) + 2.0 * noise * noise * count / members) / free;
        let hidden = 2.0 * ERROR_INFLATION * (rest * (1.0 - rest)).powi(2) / free;
        let low = (value - NORMAL_95 * own.sqrt()).max(0.0);
        ConfidenceInterval { value, low, high: (value + rest + NORMAL_95 * (own + hidden).sqrt()).min(1.0) }
    }
}

/// Inverse from a Cholesky factor, in blocks of columns over threads.
fn inverse(factored: &Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let all = factored.l_dirty().nrows();
    let each = chunk_len(all);
    let firsts: Vec<usize> = (0..all).step_by(each).collect();
    let columns = firsts.into_par_iter().flat_map_iter(|first| {
        let mut columns = DMatrix::from_fn(all, each.min(all - first), |row, column| f64::from(row == first + column));
        factored.solve_mut(&mut columns);
        Vec::from(columns.data)
    });
    DMatrix::from_vec(all, all, columns.collect())
}

#[cfg(test)]
mod tests {
    use super::super::SensitivityIndices;
    use super::*;
    use crate::case::{Bounds, Correlation, Factor, Property};
    use crate::ensemble::{Ensemble, Marginal, Sampling, SamplingKind};
    use std::f64::consts::PI;

    /// Tolerance of both indices at 2¹⁶ members.
    const CLOSE: f64 = 0.01;
    const MANY: usize = 1 << 16;

    /// Sensitivity indices of `f` for factors between −1 and 1.
    fn causes(
        kind: SamplingKind,
        correlation: &Correlation,
        factors: usize,
        members: usize,
        seed: u64,
        f: impl Fn(&[f64]) -> f64,
    ) -> SensitivityIndices {
        let (name, group, property) = ("f".to_owned(), "INS".to_owned(), Property::Conductivity);
        let factor =
            Factor { name, group, property, state: None, nominal: 0.0, small: (-1.0, 1.0), large: (-1.0, 1.0) };
        let sampling = Sampling { kind, seed };
        let drawn = vec![factor; factors];
        let ensemble = Ensemble::sample(&drawn, Bounds::Small, &sampling, members).correlated(correlation);
        let mut accumulator = Accumulator::new(&[0.0], &vec![Marginal::new(0.0, (-1.0, 1.0), kind); factors]);
        let rows: Vec<Vec<f64>> = (0..members).map(|member| ensemble.member(member)).collect();
        // At least a thousand quanta of 2⁻¹¹ per standard deviation, as for one kelvin.
        let outputs: Vec<f64> = rows.iter().map(|row| 10.0 * f(row)).collect();
        accumulator.add_block(&outputs, &rows.concat(), &vec![true; members]);
        accumulator.sensitivity_indices(correlation.is_empty(), 0..1).remove(0)
    }

    fn even(factors: usize, members: usize, seed: u64, f: impl Fn(&[f64]) -> f64) -> SensitivityIndices {
        causes(SamplingKind::Uniform, &Correlation::default(), factors, members, seed, f)
    }

    /// Ishigami & Homma (1990), with a = 7 and b = 0.1, for factors scaled to −π … π.
    fn ishigami(t: &[f64]) -> f64 {
        let x = [t[0], t[1], t[2]].map(|t| PI * t);
        x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
    }

    fn ishigami_indices() -> [[f64; 3]; 2] {
        let (one, two, both) =
            (0.5 * (1.0 + 0.1 * PI.powi(4) / 5.0).powi(2), 49.0 / 8.0, 8.0 * 0.01 * PI.powi(8) / 225.0);
        let all = one + two + both;
        [[one / all, two / all, 0.0], [(one + both) / all, two / all, both / all]]
    }

    /// Sobol's G-function (Saltelli & Sobol 1995): Π (|4u − 2| + a)/(1 + a).
    const G: [f64; 8] = [0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0];

    fn g(t: &[f64]) -> f64 {
        t.iter().zip(G).map(|(t, a)| ((2.0 * t).abs() + a) / (1.0 + a)).product()
    }

    fn g_indices() -> [[f64; 8]; 2] {
        let alone = G.map(|a| 1.0 / (3.0 * (1.0 + a).powi(2)));
        let all: f64 = alone.iter().map(|part| 1.0 + part).product::<f64>() - 1.0;
        [alone.map(|part| part / all), alone.map(|part| part / (1.0 + part) * (1.0 + all) / all)]
    }

    #[track_caller]
    fn assert_close(found: &SensitivityIndices, exact: [&[f64]; 2], tolerance: f64) {
        for (found, exact) in [&found.first, &found.total].into_iter().zip(exact) {
            for (found, exact) in found.iter().zip(exact) {
                assert!((found.value - exact).abs() < tolerance, "{found:?}, not {exact}");
                assert!(found.low <= found.value && found.value <= found.high);
            }
        }
    }

    #[test]
    fn indices_of_the_ishigami_function_are_within_a_hundredth() {
        let [first, total] = ishigami_indices();
        for seed in 1..3 {
            assert_close(&even(3, MANY, seed, ishigami), [&first, &total], CLOSE);
        }
    }

    #[test]
    fn indices_of_the_g_function_are_within_a_hundredth() {
        let [first, total] = g_indices();
        assert_close(&even(8, MANY, 1, g), [&first, &total], CLOSE);
    }

    /// Second-order indices within a tolerance of the exact ones, and intervals that hold them up to the rounding of
    /// the functions to a 512th.
    #[track_caller]
    fn assert_pairs(found: &SensitivityIndices, exact: impl Fn(usize, usize) -> f64, tolerance: f64) {
        let factors = found.first.len();
        assert_eq!(found.second.len(), factors * (factors - 1) / 2);
        for PairIndex { factors: (one, other), index } in &found.second {
            let exact = exact(*one, *other);
            assert!((index.value - exact).abs() < tolerance, "{one} and {other}: {index:?}, not {exact}");
            assert!(
                index.low <= exact + 1e-4 && exact <= index.high + 1e-4,
                "{one} and {other}: {index:?}, not {exact}"
            );
        }
    }

    /// First-order and second-order indices and the unexplained part are the whole variance.
    #[track_caller]
    fn assert_sum(found: &SensitivityIndices, tolerance: f64) {
        let pairs: f64 = found.second.iter().map(|pair| pair.index.value).sum();
        let all = found.first.iter().map(|index| index.value).sum::<f64>() + pairs + found.unexplained;
        assert!((all - 1.0).abs() < tolerance, "{all}");
    }

    #[test]
    fn second_order_indices_of_the_ishigami_function_are_exact_within_a_hundredth() {
        let [first, total] = ishigami_indices();
        let exact = |one, other| if (one, other) == (0, 2) { total[0] - first[0] } else { 0.0 };
        for seed in 1..3 {
            let found = even(3, MANY, seed, ishigami);
            assert_pairs(&found, exact, CLOSE);
            assert_sum(&found, CLOSE);
        }
    }

    /// Of the G-function, the variance of a pair is the product of their own.
    #[test]
    fn second_order_indices_of_the_g_function_are_exact_within_a_hundredth() {
        let alone = G.map(|a| 1.0 / (3.0 * (1.0 + a).powi(2)));
        let all: f64 = alone.iter().map(|part| 1.0 + part).product::<f64>() - 1.0;
        assert_pairs(&even(8, MANY, 1, g), |one, other| alone[one] * alone[other] / all, CLOSE);
    }

    /// For uniform factors the variances of x, y and xy are 1/3, 1/3 and 1/9.
    #[test]
    fn the_second_order_index_of_a_product_is_its_part_of_the_variance() {
        let found = even(3, 500, 2, |f| f[0] + f[1] + f[0] * f[1]);
        assert_pairs(&found, |one, other| if (one, other) == (0, 1) { 1.0 / 7.0 } else { 0.0 }, 1e-4);
        assert_sum(&found, 1e-4);
    }

    #[test]
    #[should_panic(expected = "0 and 2")]
    fn a_second_order_index_fails_as_zero() {
        assert_pairs(&even(3, MANY, 1, ishigami), |_, _| 0.0, CLOSE);
    }

    #[test]
    fn correlated_factors_have_no_second_order_indices() {
        let pair = Correlation::new(2, &[(0, 1, 0.5)]).expect("a correlation");
        assert!(causes(SamplingKind::Normal, &pair, 2, 500, 1, |f| f[0] * f[1]).second.is_empty());
    }

    #[test]
    #[should_panic(expected = "not 0.313")]
    fn a_first_order_index_fails_as_a_total_index() {
        let [first, _] = ishigami_indices();
        assert_close(&even(3, MANY, 1, ishigami), [&first, &first], CLOSE);
    }

    /// For uniform factors the variances of x, y and xy are 1/3, 1/3 and 1/9.
    #[test]
    fn indices_of_a_sum_and_a_product_need_few_members_of_any_sampling() {
        let kinds = [SamplingKind::Normal, SamplingKind::LatinHypercube, SamplingKind::Sobol];
        for kind in kinds {
            let found = causes(kind, &Correlation::default(), 3, 500, 2, |f| 3.0 * f[0] + f[1]);
            assert_close(&found, [&[0.9, 0.1, 0.0]; 2], 1e-4);
            assert!(found.unexplained < 1e-5, "{}", found.unexplained);
        }
        let found = even(3, 500, 2, |f| f[0] + f[1] + f[0] * f[1]);
        assert_close(&found, [&[3.0 / 7.0, 3.0 / 7.0, 0.0], &[4.0 / 7.0, 4.0 / 7.0, 0.0]], 1e-4);
    }

    #[test]
    fn a_three_factor_interaction_is_unexplained_and_within_every_interval() {
        let found = even(3, 20_000, 5, |f| f[0] + 3.0 * f[0] * f[1] * f[2]);
        // Variances 1/3 and 9/27.
        assert!((found.unexplained - 0.5).abs() < 0.02, "{}", found.unexplained);
        assert_close(&found, [&[0.5, 0.0, 0.0]; 2], 0.02);
        assert!(
            found.total.iter().zip([1.0, 0.5, 0.5]).all(|(index, exact)| index.low <= exact && exact <= index.high)
        );
    }

    /// Coverage of the intervals of both indices over a hundred seeds.
    fn covered(members: usize, factors: usize, exact: [&[f64]; 2], f: impl Fn(&[f64]) -> f64 + Copy) -> f64 {
        let mut held = 0.0;
        for seed in 0..100 {
            let found = even(factors, members, seed, f);
            for (found, exact) in [&found.first, &found.total].into_iter().zip(exact) {
                let within = |(index, exact): (&ConfidenceInterval, &f64)| {
                    index.low - 1e-9 <= *exact && *exact <= index.high + 1e-9
                };
                held += found.iter().zip(exact).filter(|pair| within(*pair)).count() as f64;
            }
        }
        held / (100 * 2 * factors) as f64
    }

    #[test]
    fn intervals_contain_the_exact_index_with_their_nominal_coverage() {
        let [first, total] = ishigami_indices();
        let few = covered(400, 3, [&first, &total], ishigami);
        let more = covered(1600, 3, [&first, &total], ishigami);
        let three = covered(400, 3, [&[0.5, 0.0, 0.0], &[1.0, 0.5, 0.5]], |f| f[0] + 3.0 * f[0] * f[1] * f[2]);
        assert!(few > 0.93 && more > 0.93 && three > 0.93, "{few}, {more}, {three}");
        // Negative control: the intervals of another function do not.
        let wrong = covered(1600, 3, [&first, &total], |f| ishigami(&[f[0], f[2], f[1]]));
        assert!(wrong < 0.5, "{wrong}");
    }

    /// Distribution function values u of two normal variables with correlation r: cov(u₁, u₂) = asin(r/2)/2π,
    /// Var(E[u₂|u₁]) = asin(r²/2)/2π.
    #[test]
    fn for_correlated_factors_first_order_includes_the_shared_effect_and_total_excludes_it() {
        for r in [-0.7, 0.3, 0.8f64] {
            let correlation = Correlation::new(3, &[(0, 1, r)]).expect("positive definite");
            let found = causes(SamplingKind::Uniform, &correlation, 3, MANY, 4, |f| f[0] + f[1]);
            let (shared, followed) = ((r / 2.0).asin() / (2.0 * PI), (r * r / 2.0).asin() / (2.0 * PI));
            let all = 1.0 / 6.0 + 2.0 * shared;
            let (first, total) = ((1.0 / 12.0 + 2.0 * shared + followed) / all, (1.0 / 12.0 - followed) / all);
            assert_close(&found, [&[first, first, 0.0], &[total, total, 0.0]], CLOSE);
            assert!(found.first[0].low <= first && first <= found.first[0].high, "{:?} {first}", found.first[0]);
        }
    }

    #[test]
    fn a_correlation_of_zero_gives_the_indices_of_independent_factors() {
        let nothing = Correlation::new(3, &[(0, 1, 0.0)]).expect("positive definite");
        assert!(!nothing.is_empty());
        let [first, total] = ishigami_indices();
        assert_close(&causes(SamplingKind::Uniform, &nothing, 3, MANY, 1, ishigami), [&first, &total], CLOSE);
    }

    #[test]
    fn fixed_factors_and_constant_outputs_have_zero_indices_and_too_few_members_have_none() {
        let marginals = [(1.0, 1.0), (0.0, 2.0)].map(|bounds| Marginal::new(1.0, bounds, SamplingKind::Uniform));
        let mut accumulator = Accumulator::new(&[0.0, 0.0], &marginals);
        assert!(
            accumulator.sensitivity_indices(true, 0..0)[0].total[1].value.is_nan()
                && accumulator.sensitivity_indices(true, 0..0)[0].unexplained.is_nan()
        );
        (0..100).for_each(|i| accumulator.add(&[f64::from(i), 5.0], &[1.0, 0.02 * f64::from(i)]));
        let [moving, still] = [0, 1].map(|output| accumulator.sensitivity_indices(true, 0..0)[output].clone());
        assert!(
            moving.first[0].value == 0.0 && moving.total[0].value == 0.0 && (moving.total[1].value - 1.0).abs() < 1e-3
        );
        let zero = ConfidenceInterval { value: 0.0, low: 0.0, high: 0.0 };
        assert_eq!((still.first, still.total, still.unexplained), (vec![zero; 2], vec![zero; 2], 0.0));
    }
}
