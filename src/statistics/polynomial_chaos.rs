//! First-order, second-order and total Sobol indices from the members of an ordinary Monte Carlo sweep.
//!
//! Each output is expanded by least squares over all members in basis functions of one and two factors, up to the
//! degree with the smallest leave-one-out error (Blatman & Sudret, J. Comput. Phys. 230, 2011). The explained variance
//! is attributed to the factors; the leave-one-out error is the unexplained part. Saltelli's sampling, which is
//! unbiased for any model, needs `factors + 2` times as many marches, useful for nothing else.
//!
//! **Independent factors.** The functions are orthonormal over the sampling distribution, so squared coefficients are
//! parts of the variance `V`: of one factor alone, and of all functions that contain it. The sampling variance of each
//! coefficient is subtracted from its square. `V` is the sum of all parts and the unexplained part: the variance of the
//! members would add its own sampling error to indices that are otherwise exact.
//!
//! **Correlated factors.** `S = Var(E[T|f]) / V` is the part of the variance that functions of the factor alone
//! explain, including the effect of correlated factors. `S_T = E[Var(T|others)] / V` is the part that only functions
//! with the factor explain, the variance that would remain with all others known. These parts may overlap or leave
//! gaps, so they do not sum to one. A pair has no part of its own then, and there are no second-order indices.
//!
//! **Errors.** Residuals are not noise that is independent of the factors: those of interactions, kinks and jumps are
//! largest where the functions are. So variances come from the residuals of a random sample of the members.

use super::basis::QUANTA;
use super::interval::{NORMAL_95, PairIndex, influence_variance};
use super::output::OutputSums;
use super::{Accumulator, COARSE_LOG2, ConfidenceInterval, chunk_len};
use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector, DVectorView, Dyn};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Smallest number of members per function, which bounds the mean leverage of a member by a sixth. With four, 700
/// members of an oscillation under off-centre normal distributions were covered in 93 %; with six in 99.6 %.
const MEMBERS_PER_FUNCTION: usize = 6;
/// Share of the variance by which the leave-one-out error may rise with the degree if factors are correlated: the mean
/// of an output for a known factor may bend where the output itself does not, as correlated factors follow in a curve.
const CONDITIONAL_TOLERANCE: f64 = 1e-3;
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

/// The expansions of all degrees, and the sample of members that judges them.
pub(super) struct PolynomialChaos<'a> {
    accumulator: &'a Accumulator,
    /// The functions at the sampled members: function × member.
    functions: DMatrix<f64>,
    /// The expansions in the order of their degree.
    expansions: Vec<Expansion>,
    /// Share of the variance by which the leave-one-out error may rise with the degree.
    tolerance: f64,
}

/// The part of the expansion up to one degree that all outputs share.
struct Expansion {
    /// Inverse of the Gram matrix of the functions, `G⁻¹`.
    gram_inverse: DMatrix<f64>,
    /// Dual functions `ψ = G⁻¹φ` at the sampled members, function × member: the coefficients are mean products of the
    /// output with them.
    duals: DMatrix<f64>,
    /// `1/(1 − h)` with the leverage `h = φᵀG⁻¹φ/n`, per sampled member: the residual of a member about the expansion
    /// fitted without it, relative to that about the expansion (Allen, Technometrics 16, 1974).
    left_out: DVector<f64>,
    /// All functions but the constant.
    explained: VariancePart,
    /// First-order and total part, per factor.
    parts: Vec<[VariancePart; 2]>,
    /// The part of each pair of factors, for independent factors.
    pairs: Vec<((usize, usize), VariancePart)>,
}

/// A part of the variance: the sum of squares of some coefficients, or of linear combinations of them.
struct VariancePart {
    functions: Vec<usize>,
    mixture: Option<Mixture>,
}

/// Linear combinations of coefficients, for correlated factors.
struct Mixture {
    /// Combination × function.
    weights: DMatrix<f64>,
    /// Dual functions of the combinations at the sampled members.
    duals: DMatrix<f64>,
    /// Whether the part is what only these functions explain, so that its regression is that on all others.
    excludes_others: bool,
    /// `1/(1 − h)` of the regression of the part, per sampled member.
    left_out: DVector<f64>,
}

/// The expansion of one output, of the degree with the smallest leave-one-out error.
struct Fit<'a> {
    expansion: &'a Expansion,
    members: f64,
    /// Mean square of all members about their mean.
    variance: f64,
    coefficients: DVector<f64>,
    /// The sampled members about the mean.
    values: DVector<f64>,
    residuals: Residuals,
}

/// Residuals of the sampled members about a regression.
struct Residuals {
    plain: DVector<f64>,
    /// Leave-one-out residuals, about the regression without the member: `r/(1 − h)`.
    left_out: DVector<f64>,
    /// Mean square of all members.
    mean_square: f64,
}

/// The estimate of a part of the variance, or of a sum of parts.
struct Estimate {
    variance: f64,
    /// Variance of the estimate from the squares of the errors of coefficients.
    error_squares: f64,
    /// Change of the estimate with the weight of each sampled member, up to a constant.
    influence: DVector<f64>,
}

impl Residuals {
    /// From the residuals of the sampled members, their `1/(1 − h)`, and the mean square of all members.
    fn new(plain: DVector<f64>, left_out: &DVector<f64>, mean_square: f64) -> Self {
        Self { left_out: plain.component_mul(left_out), plain, mean_square: mean_square.max(0.0) }
    }

    /// Mean square with each member left out. The sample tells by how much leaving out raises it.
    fn left_out_mean_square(&self) -> f64 {
        self.scaled(self.left_out.norm_squared())
    }

    /// Variance about the regression: the mean square of `r²/(1 − h)`, unbiased for equal variances (HC2: MacKinnon &
    /// White, J. Econometrics 29, 1985).
    fn variance(&self) -> f64 {
        self.scaled(self.plain.dot(&self.left_out))
    }

    /// The mean square of all members for a sum of squares of the sampled ones.
    fn scaled(&self, squares: f64) -> f64 {
        let plain = self.plain.norm_squared();
        if plain > 0.0 { self.mean_square * squares / plain } else { self.mean_square }
    }

    fn left_out_squares(&self) -> DVector<f64> {
        self.left_out.component_mul(&self.left_out)
    }

    fn squares(&self) -> DVector<f64> {
        self.plain.component_mul(&self.left_out)
    }
}

impl<'a> PolynomialChaos<'a> {
    /// `None` for fewer members than a linear function of every factor needs.
    pub(super) fn new(accumulator: &'a Accumulator, are_independent: bool) -> Option<Self> {
        let (basis, members) = (&accumulator.basis, accumulator.sample.members());
        let mut sizes = vec![basis.complete_degrees(accumulator.members / MEMBERS_PER_FUNCTION)];
        while let Some(&size) = sizes.last().filter(|&&size| size > 0) {
            sizes.push(basis.complete_degrees(size - 1));
        }
        let sizes: Vec<usize> = sizes.into_iter().rev().filter(|&size| size > 1).collect();
        let largest = *sizes.last()?;
        let mut functions = DMatrix::zeros(basis.len(), members.len());
        let columns = functions.as_mut_slice().par_chunks_mut(basis.len()).zip(members);
        columns.for_each(|(column, member)| basis.evaluate(&member.factors, column));
        let functions = functions.rows(0, largest) / QUANTA;
        let each = sizes.into_par_iter();
        let expansions = each.filter_map(|size| Expansion::new(accumulator, &functions.rows(0, size), are_independent));
        let expansions: Vec<Expansion> = expansions.collect();
        let tolerance = if are_independent { 0.0 } else { CONDITIONAL_TOLERANCE };
        (!expansions.is_empty()).then_some(Self { accumulator, functions, expansions, tolerance })
    }

    /// Indices of some outputs, the first of them number `first`; those in `second_order` with indices of pairs.
    pub(super) fn indices(
        &self,
        outputs: &[OutputSums],
        first: usize,
        second_order: &Range<usize>,
    ) -> Vec<SobolIndices> {
        let fits = self.fits(outputs, first);
        let numbered = (first..).zip(&fits);
        numbered.map(|(number, fit)| fit.indices(second_order.contains(&number))).collect()
    }

    /// The expansion of each output with the smallest leave-one-out error.
    fn fits(&self, outputs: &[OutputSums], first: usize) -> Vec<Fit<'_>> {
        let members = self.accumulator.members as f64;
        let sampled = self.accumulator.sample.members();
        let coarse = f64::from(1 << COARSE_LOG2);
        let moment = |function: usize, output: usize| outputs[output].moments[function] as f64 / members / QUANTA;
        let moments = DMatrix::from_fn(self.functions.nrows(), outputs.len(), moment);
        let values = DMatrix::from_fn(sampled.len(), outputs.len(), |member, output| {
            f64::from(sampled[member].outputs[first + output])
        });
        let mut best: Vec<Option<Fit<'_>>> = outputs.iter().map(|_| None).collect();
        for expansion in &self.expansions {
            let size = expansion.duals.nrows();
            let coefficients = &expansion.gram_inverse * moments.rows(0, size);
            let residuals = &values - self.functions.rows(0, size).tr_mul(&coefficients);
            for (output, best) in best.iter_mut().enumerate() {
                let (moments, coefficients) = (moments.column(output), coefficients.column(output).into_owned());
                let square = outputs[output].sums.squares as f64 / members / coarse / coarse;
                let left = square - moments.rows(0, size).dot(&coefficients);
                let residuals = Residuals::new(residuals.column(output).into_owned(), &expansion.left_out, left);
                let variance = square - moments[0] * moments[0];
                let accepted = residuals.left_out_mean_square() - self.tolerance * variance;
                if best.as_ref().is_none_or(|best| accepted <= best.residuals.left_out_mean_square()) {
                    let values = values.column(output).add_scalar(-moments[0]);
                    *best = Some(Fit { expansion, members, variance, coefficients, values, residuals });
                }
            }
        }
        best.into_iter().flatten().collect()
    }
}

impl Expansion {
    /// The expansion in the first functions, whose values at the sampled members are given; `None` where the Gram
    /// matrix of these members is singular.
    fn new(accumulator: &Accumulator, sampled: &DMatrixView<'_, f64>, are_independent: bool) -> Option<Self> {
        let (size, basis, members) = (sampled.nrows(), &accumulator.basis, accumulator.members as f64);
        let scale = QUANTA * QUANTA * members;
        let gram = DMatrix::from_fn(size, size, |a, b| accumulator.gram[a.max(b)][a.min(b)] as f64 / scale);
        let gram_inverse = inverse(&gram.clone().cholesky()?);
        let duals = &gram_inverse * sampled;
        let leverages =
            duals.column_iter().zip(sampled.column_iter()).map(|(dual, values)| dual.dot(&values) / members);
        let leverages = DVector::from_iterator(sampled.ncols(), leverages);
        let left_out = |leverages: &DVector<f64>| leverages.map(|h| 1.0 / (1.0 - h).max(f64::EPSILON.sqrt()));
        let covariance = (!are_independent).then(|| {
            let means = gram.column(0);
            &gram - means * means.transpose()
        });
        let part = |chosen: Vec<usize>, excludes_others: bool| -> Option<VariancePart> {
            let Some(covariance) = &covariance else {
                return Some(VariancePart { functions: chosen, mixture: None });
            };
            let within = |of: &DMatrix<f64>| of.select_rows(&chosen).select_columns(&chosen);
            let weights = if excludes_others {
                // Part of the covariance that the other functions cannot explain: the Schur complement, the inverse of
                // a block of the inverse.
                let own = within(&gram_inverse).cholesky()?.inverse().cholesky()?.l();
                let mut weights = DMatrix::zeros(chosen.len(), size);
                for (&function, row) in chosen.iter().zip(own.row_iter()) {
                    weights.set_column(function, &row.transpose());
                }
                weights
            } else {
                within(covariance).cholesky()?.l().solve_lower_triangular(&covariance.select_rows(&chosen))?
            };
            let duals = &weights * &duals;
            let own = duals.column_iter().map(|duals| duals.norm_squared() / members);
            let own = DVector::from_iterator(sampled.ncols(), own);
            // The regression of a first-order part includes the constant.
            let left_out = left_out(&if excludes_others { &leverages - own } else { own.add_scalar(1.0 / members) });
            let mixture = Some(Mixture { weights, duals, excludes_others, left_out });
            Some(VariancePart { functions: chosen, mixture })
        };
        let of_factor = |factor: usize| {
            let [first, total] = [false, true].map(|shared| part(basis.containing(factor, size, shared), shared));
            Some([first?, total?])
        };
        let pairs = if are_independent { basis.pairs(size) } else { BTreeMap::new() };
        let pairs = pairs.into_iter().map(|(pair, functions)| Some((pair, part(functions, false)?)));
        Some(Self {
            explained: part((1..size).collect(), false)?,
            parts: (0..accumulator.factors()).map(of_factor).collect::<Option<_>>()?,
            pairs: pairs.collect::<Option<_>>()?,
            left_out: left_out(&leverages),
            gram_inverse,
            duals,
        })
    }
}

impl Fit<'_> {
    fn indices(&self, second_order: bool) -> SobolIndices {
        let variances = self.coefficient_variances();
        let explained = self.estimate(&self.expansion.explained, &variances);
        let all = Estimate {
            variance: explained.variance.max(0.0) + self.residuals.left_out_mean_square(),
            influence: explained.influence + self.residuals.left_out_squares(),
            error_squares: explained.error_squares,
        };
        let is_constant = all.variance < MIN_VARIANCE;
        let index = |part: &VariancePart| {
            if is_constant { ConfidenceInterval::ZERO } else { self.interval(&self.estimate(part, &variances), &all) }
        };
        let ordered = |[first, total]: &[VariancePart; 2]| {
            let (first, total) = (index(first), index(total));
            // The first-order index of a correlated factor may exceed its total index.
            (first, if self.expansion.explained.mixture.is_none() { total.or_above(first) } else { total })
        };
        let (first, total) = self.expansion.parts.iter().map(ordered).unzip();
        let pairs = self.expansion.pairs.iter().filter(|_| second_order);
        let second = pairs.map(|(factors, part)| PairIndex { factors: *factors, index: index(part) }).collect();
        let unexplained = if is_constant { 0.0 } else { self.residuals.left_out_mean_square() / all.variance };
        SobolIndices { first, total, second, unexplained }
    }

    /// The index of a part with its 95 % interval.
    ///
    /// The variance of an estimate is that of its influence over the members, by their number: the nonparametric delta
    /// method (Davison & Hinkley 1997, §2.7). The unexplained part may belong to any index, so the upper end is that of
    /// the sum of both.
    fn interval(&self, part: &Estimate, all: &Estimate) -> ConfidenceInterval {
        let value = (part.variance / all.variance).clamp(0.0, 1.0);
        let reach = |share: f64, influence: &DVector<f64>| {
            let influence = influence - share * &all.influence;
            let variance = influence_variance(influence.as_slice()) / self.members + part.error_squares;
            NORMAL_95 * variance.sqrt() / all.variance
        };
        let most = value + self.residuals.left_out_mean_square() / all.variance;
        ConfidenceInterval {
            value,
            low: (value - reach(value, &part.influence)).max(0.0),
            high: (most + reach(most, &(&part.influence + self.residuals.left_out_squares()))).min(1.0),
        }
    }

    /// The estimate of a part of the variance, with the sampling variances of the coefficients.
    ///
    /// Independent factors: the influence of a member with the residual `r` on a coefficient is `ψr`, so that on the
    /// sum of squares of some coefficients it is `2pr` with the component `p = Σcψ`.
    ///
    /// Correlated factors: the covariance of the functions is that of the members. What functions explain is then the
    /// difference of two variances: about the mean and about the regression on these functions, or about the
    /// regressions on all others and on all.
    fn estimate(&self, part: &VariancePart, variances: &DVector<f64>) -> Estimate {
        let Some(Mixture { weights, duals, excludes_others, left_out }) = &part.mixture else {
            let own: Vec<(usize, f64)> = part.functions.iter().map(|&at| (at, self.coefficients[at])).collect();
            let squares = own.iter().map(|&(at, coefficient)| coefficient * coefficient - variances[at]);
            let component = |duals: DVectorView<'_, f64>| own.iter().map(|&(at, c)| c * duals[at]).sum::<f64>();
            let each = self.expansion.duals.column_iter().zip(&self.residuals.left_out);
            let influence = each.map(|(duals, residual)| 2.0 * component(duals) * residual);
            return Estimate {
                variance: squares.sum(),
                error_squares: own.iter().map(|&(at, _)| 2.0 * variances[at].powi(2)).sum(),
                influence: DVector::from_iterator(self.values.len(), influence),
            };
        };
        let coefficients = weights * &self.coefficients;
        let (component, explained) = (duals.tr_mul(&coefficients), coefficients.norm_squared());
        let (with, without) = if *excludes_others {
            let (plain, mean_square) = (&self.residuals.plain + component, self.residuals.mean_square + explained);
            (&self.residuals, &Residuals::new(plain, left_out, mean_square))
        } else {
            let nothing = DVector::from_element(self.values.len(), self.members / (self.members - 1.0));
            let (plain, mean_square) = (&self.values - component, self.variance - explained);
            (
                &Residuals::new(plain, left_out, mean_square),
                &Residuals::new(self.values.clone(), &nothing, self.variance),
            )
        };
        let (variance, influence) = (without.variance() - with.variance(), without.squares() - with.squares());
        Estimate { variance, error_squares: 0.0, influence }
    }

    /// Sampling variances of the coefficients: the mean squares of `ψr` over the number of members, with residuals that
    /// may depend on the functions (HC3: MacKinnon & White, J. Econometrics 29, 1985).
    fn coefficient_variances(&self) -> DVector<f64> {
        let duals = &self.expansion.duals;
        let mut sums = DVector::zeros(duals.nrows());
        for (duals, residual) in duals.column_iter().zip(&self.residuals.left_out) {
            sums.zip_apply(&duals, |sum, dual| *sum += (dual * residual).powi(2));
        }
        sums / (self.values.len() as f64 * self.members)
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
    fn sensitivity_indices_of(
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
        sensitivity_indices_of(SamplingKind::Uniform, &Correlation::default(), factors, members, seed, f)
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

    /// The variance of a pair of factors of the G-function is the product of the variances of both.
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
        assert!(sensitivity_indices_of(SamplingKind::Normal, &pair, 2, 500, 1, |f| f[0] * f[1]).second.is_empty());
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
            let found = sensitivity_indices_of(kind, &Correlation::default(), 3, 500, 2, |f| 3.0 * f[0] + f[1]);
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
            let found = sensitivity_indices_of(SamplingKind::Uniform, &correlation, 3, MANY, 4, |f| f[0] + f[1]);
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
        assert_close(
            &sensitivity_indices_of(SamplingKind::Uniform, &nothing, 3, MANY, 1, ishigami),
            [&first, &total],
            CLOSE,
        );
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
