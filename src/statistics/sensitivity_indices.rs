//! Global sensitivity of an output to each factor: correlations, rank correlations, and Sobol indices.

use super::correlation_scatter::{PartialScatter, SampledRanks, scatter};
use super::interval::{ConfidenceInterval, PairIndex};
use super::polynomial_chaos::{PolynomialChaos, SobolIndices};
use super::{Accumulator, GRADE_QUANTA, chunk_len};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Sensitivity indices of one output; each vector has one entry per factor.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct SensitivityIndices {
    /// Pearson correlation (the paper's Eq. 13): linear dependence.
    pub correlations: Vec<ConfidenceInterval>,
    /// Spearman rank correlation: monotonic dependence.
    pub rank_correlations: Vec<ConfidenceInterval>,
    /// Partial rank correlation (PRCC): the linear effect of the other factors' ranks is removed from both.
    pub partial_rank_correlations: Vec<ConfidenceInterval>,
    /// Squared correlations normalised to a sum of one; zero where nothing varies.
    pub shares: Vec<f64>,
    /// First-order Sobol indices: fraction of the variance removed by knowing the factor.
    pub first: Vec<ConfidenceInterval>,
    /// Total Sobol indices: fraction of the variance that remains when all other factors are known.
    pub total: Vec<ConfidenceInterval>,
    /// Second-order Sobol indices, for peaks and their times: empty for other outputs, for correlated factors, and
    /// where there are too few members for products of factors.
    pub second: Vec<PairIndex>,
    /// Fraction of the variance that polynomials of one and two factors do not explain, from members left out of the
    /// fit. It may belong to any index.
    pub unexplained: f64,
}

impl SensitivityIndices {
    /// The indices of an output that no factor changes; the number of second-order indices stays.
    #[must_use]
    pub(crate) fn of_constant(mut self) -> Self {
        let zero = ConfidenceInterval::ZERO;
        let indices = [&mut self.correlations, &mut self.rank_correlations, &mut self.partial_rank_correlations];
        indices.into_iter().chain([&mut self.first, &mut self.total]).for_each(|each| each.fill(zero));
        self.second.iter_mut().for_each(|pair| pair.index = zero);
        self.shares.fill(0.0);
        self.unexplained = 0.0;
        self
    }
}

impl Accumulator {
    /// Sensitivity indices of every output; second-order indices of those in `second_order`. For correlated factors the
    /// indices are as defined in `polynomial_chaos.rs`.
    ///
    /// Confidence intervals of correlations assume independent members; stratified or quasi-random members scatter
    /// less. Their widths come from a sample of the members: see `correlation_scatter.rs`.
    pub fn sensitivity_indices(&self, are_independent: bool, second_order: Range<usize>) -> Vec<SensitivityIndices> {
        let expansion = PolynomialChaos::new(self, are_independent);
        let ranks = RankCorrelations::new(self);
        let each = chunk_len(self.outputs.len());
        let stretches = self.outputs.par_chunks(each).zip((0..self.outputs.len()).step_by(each).collect::<Vec<_>>());
        let all_indices = stretches.flat_map_iter(|(outputs, first)| {
            let indices = match &expansion {
                Some(expansion) => expansion.indices(outputs, first, &second_order),
                None => vec![SobolIndices::unknown(self.factors()); outputs.len()],
            };
            indices.into_iter().zip(first..).map(|(indices, output)| self.output_indices(output, indices, &ranks))
        });
        all_indices.collect()
    }

    fn output_indices(&self, output: usize, indices: SobolIndices, ranks: &RankCorrelations) -> SensitivityIndices {
        let (members, others) = (self.members as f64, self.factors().saturating_sub(1) as f64);
        let factors = 0..self.factors();
        let sampled = self.sample.members();
        let values = centred_values(sampled.iter().map(|member| f64::from(member.outputs[output])));
        let sampled_ranks = SampledRanks::new(sampled.iter().map(|member| member.outputs[output]));
        let correlation = |factor: usize| {
            let scatter = scatter(&ranks.sampled_values[factor], &values, None);
            ConfidenceInterval::correlation(self.correlation(output, factor), members, scatter)
        };
        let ranked = ranks.correlations(self, output);
        let rank_correlation = |factor: usize| {
            let scatter = scatter(&ranks.sampled_grades[factor], &sampled_ranks.ranks, Some(&sampled_ranks));
            ConfidenceInterval::correlation(ranked[factor], members, scatter)
        };
        let partial_scatter = PartialScatter::new(&sampled_ranks, &ranks.sampled_grades, &ranks.sampled_residuals);
        let partial = ranks.partial_regression(&ranked).enumerate().map(|(factor, regression)| {
            let free = members - others;
            match (regression, &partial_scatter) {
                (Some(regression), Some(scatter)) if free > 3.0 => scatter.interval(factor, regression, members, free),
                (Some((slope, diagonal, left)), _) => {
                    let value = ratio_or_zero(slope, (diagonal * left + slope.powi(2)).sqrt());
                    ConfidenceInterval::correlation(value, free, 1.0)
                }
                (None, _) => ConfidenceInterval::UNKNOWN,
            }
        });
        let SobolIndices { first, total, second, unexplained: rest } = indices;
        SensitivityIndices {
            correlations: factors.clone().map(correlation).collect(),
            rank_correlations: factors.clone().map(rank_correlation).collect(),
            partial_rank_correlations: partial.collect(),
            shares: factors.map(|factor| self.squared_correlation_share(output, factor)).collect(),
            first,
            total,
            second,
            unexplained: rest,
        }
    }
}

/// Values less their mean.
fn centred_values(values: impl ExactSizeIterator<Item = f64>) -> Vec<f64> {
    let count = values.len() as f64;
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / count;
    values.into_iter().map(|value| value - mean).collect()
}

/// Rank correlations. The rank of a factor is its grade, the value of its distribution function; it needs no sorting
/// and differs from the sample rank by chance alone. The rank of an output is the centre of its bin.
struct RankCorrelations {
    means: Vec<f64>,
    deviations: Vec<f64>,
    /// Inverse of the rank correlations among the factors; `None` where the matrix is singular.
    inverse: Option<DMatrix<f64>>,
    /// Values of the sampled members less their means, factor × member: factors, grades, and residuals of the grades in
    /// a regression on the grades of the other factors. The residuals are empty where factors determine one another.
    sampled_values: Vec<Vec<f64>>,
    sampled_grades: Vec<Vec<f64>>,
    sampled_residuals: Vec<Vec<f64>>,
}

impl RankCorrelations {
    fn new(accumulator: &Accumulator) -> Self {
        let members = accumulator.members as f64;
        let means: Vec<f64> = accumulator.grades.iter().map(|sums| sums[0] as f64 / members / GRADE_QUANTA).collect();
        let product = |a: usize, b: usize| {
            let sum = accumulator.grades[a.max(b)][1 + a.min(b)] as f64;
            sum / members / GRADE_QUANTA / GRADE_QUANTA - means[a] * means[b]
        };
        let deviations: Vec<f64> = (0..means.len()).map(|factor| product(factor, factor).max(0.0).sqrt()).collect();
        let correlations = DMatrix::from_fn(means.len(), means.len(), |a, b| {
            let both = deviations[a] * deviations[b];
            if a == b { 1.0 } else { ratio_or_zero(product(a, b), both) }
        });
        let inverse = correlations.cholesky().map(|factored| factored.inverse());
        let (factors, sampled) = (0..means.len(), accumulator.sample.members());
        let of_members = |each: &dyn Fn(usize, f64) -> f64| -> Vec<Vec<f64>> {
            let of = |factor: usize| centred_values(sampled.iter().map(|member| each(factor, member.factors[factor])));
            factors.clone().map(of).collect()
        };
        let marginals = accumulator.basis.marginals();
        let sampled_grades = of_members(&|factor, value| marginals[factor].cumulative(value));
        let grades = DMatrix::from_fn(sampled.len(), means.len(), |member, factor| sampled_grades[factor][member]);
        let residuals = covariance_inverse(&grades).map(|inverse| {
            let residuals = &grades * &inverse;
            // A row of the inverse covariance holds the slopes of a regression on the others, over its diagonal.
            let of = |factor: usize| (residuals.column(factor) / inverse[(factor, factor)]).as_slice().to_vec();
            factors.clone().map(of).collect()
        });
        Self {
            means,
            deviations,
            inverse,
            sampled_values: of_members(&|_, value| value),
            sampled_residuals: residuals.unwrap_or_default(),
            sampled_grades,
        }
    }

    /// Spearman correlation of an output with each factor; zero where either is constant.
    fn correlations(&self, accumulator: &Accumulator, output: usize) -> Vec<f64> {
        let members = accumulator.members as f64;
        let mut products = vec![0.0; self.means.len()];
        let (mut below, mut squares) = (0.0, 0.0);
        for bin in accumulator.outputs[output].rank_histogram.bins() {
            let count = bin[0] as f64;
            let rank = (below + count / 2.0) / members - 0.5;
            squares += count * rank * rank;
            for ((product, &sum), mean) in products.iter_mut().zip(&bin[1..]).zip(&self.means) {
                *product += rank * (sum as f64 / GRADE_QUANTA - count * mean);
            }
            below += count;
        }
        let deviation = (squares * members).sqrt();
        let each = products.iter().zip(&self.deviations);
        each.map(|(product, factor)| ratio_or_zero(*product, deviation * factor).clamp(-1.0, 1.0)).collect()
    }

    /// The regression of the ranks of an output on the grades of all factors: of each factor the slope, in standard
    /// deviations, the diagonal of the inverse of the correlations of the grades, and the share of the variance that is
    /// left. `None` where factors determine one another.
    fn partial_regression(&self, correlations: &[f64]) -> impl Iterator<Item = Option<(f64, f64, f64)>> {
        let ranked = DVector::from_column_slice(correlations);
        let slopes = self.inverse.as_ref().map(|inverse| (inverse.diagonal(), inverse * &ranked));
        let left = slopes.as_ref().map_or(0.0, |(_, slopes)| (1.0 - ranked.dot(slopes)).max(0.0));
        (0..correlations.len())
            .map(move |factor| slopes.as_ref().map(|(diagonal, slopes)| (slopes[factor], diagonal[factor], left)))
    }
}

/// Inverse of the covariance of columns with mean zero, times the number of rows; `None` where it is singular.
fn covariance_inverse(columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    columns.tr_mul(columns).cholesky().map(|factored| factored.inverse())
}

/// A ratio; zero for a zero denominator.
fn ratio_or_zero(of: f64, to: f64) -> f64 {
    if to > 0.0 { of / to } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::{Marginal, SamplingKind};

    /// Members of a Weyl sequence, and an output that depends strongly on the first factor and weakly on the second.
    fn rows(members: u32) -> Vec<([f64; 3], f64)> {
        let row = |member: u32| {
            let [a, b, c] =
                [0.618_033_988_75, 0.414_213_562_37, 0.732_050_807_57].map(|s| (f64::from(member + 1) * s).fract());
            // The third factor is correlated with the first and has no effect.
            let factors = [a, b, (0.6 * a + 0.4 * c).clamp(0.0, 1.0)];
            (factors, 300.0 + 40.0 * (4.0 * a).exp() - 900.0 * b * b)
        };
        (0..members).map(row).collect()
    }

    fn ranked(values: &[f64]) -> Vec<f64> {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let mut ranks = vec![0.0; values.len()];
        order.iter().enumerate().for_each(|(rank, &place)| ranks[place] = rank as f64);
        ranks
    }

    fn pearson(a: &[f64], b: &[f64]) -> f64 {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let product = |a: &[f64], b: &[f64]| {
            let (centre, other) = (mean(a), mean(b));
            a.iter().zip(b).map(|(one, two)| (one - centre) * (two - other)).sum::<f64>()
        };
        product(a, b) / (product(a, a) * product(b, b)).sqrt()
    }

    /// Residuals of a linear regression on other variables.
    fn left(values: &[f64], others: &[&[f64]]) -> Vec<f64> {
        let design =
            DMatrix::from_fn(
                values.len(),
                others.len() + 1,
                |row, column| {
                    if column == 0 { 1.0 } else { others[column - 1][row] }
                },
            );
        let values = DVector::from_column_slice(values);
        let slopes = (design.transpose() * &design).cholesky().expect("regular").solve(&(design.transpose() * &values));
        (values - design * slopes).as_slice().to_vec()
    }

    #[test]
    fn rank_correlations_equal_those_of_the_sorted_members() {
        let rows = rows(3000);
        let marginals: Vec<Marginal> = (0..3).map(|_| Marginal::new(0.5, (0.0, 1.0), SamplingKind::Uniform)).collect();
        let mut accumulator = Accumulator::new(&[500.0], &marginals);
        rows.iter().for_each(|(factors, output)| accumulator.add(&[*output], factors));
        let indices = accumulator.sensitivity_indices(false, 0..0).remove(0);
        let output = ranked(&rows.iter().map(|row| row.1).collect::<Vec<f64>>());
        let factors: Vec<Vec<f64>> =
            (0..3).map(|factor| ranked(&rows.iter().map(|row| row.0[factor]).collect::<Vec<f64>>())).collect();
        for factor in 0..3 {
            let others: Vec<&[f64]> =
                (0..3).filter(|&other| other != factor).map(|other| &factors[other][..]).collect();
            let plain = pearson(&factors[factor], &output);
            let partial = pearson(&left(&factors[factor], &others), &left(&output, &others));
            let (found, apart) = (indices.rank_correlations[factor], indices.partial_rank_correlations[factor]);
            // Tolerance for binned ranks, and for grades of a factor whose sample differs from its stated distribution.
            assert!((found.value - plain).abs() < 0.005, "{found:?}, not {plain}");
            assert!((apart.value - partial).abs() < 0.02, "{apart:?}, not {partial}");
        }
        assert!(indices.rank_correlations[2].value > 0.5, "the third is correlated with the first");
        assert!(indices.partial_rank_correlations[2].value.abs() < 0.1, "and has no effect itself");
    }

    #[test]
    fn the_interval_of_a_correlation_is_from_fishers_transform() {
        let half = ConfidenceInterval::correlation(0.5, 103.0, 1.0);
        // atanh 0.5 = 0.549306; 1.96 times a tenth on either side.
        assert!((half.low - 0.339).abs() < 1e-3 && (half.high - 0.632).abs() < 1e-3, "{half:?}");
        assert_eq!(
            ConfidenceInterval::correlation(1.0, 50.0, 1.0),
            ConfidenceInterval { value: 1.0, low: 1.0, high: 1.0 }
        );
        let few = ConfidenceInterval::correlation(0.9, 3.0, 1.0);
        assert_eq!((few.low, few.high), (-1.0, 1.0));
    }
}
