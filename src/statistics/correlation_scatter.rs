//! Sampling variance of correlations, from the influence of each sampled member.
//!
//! Fisher's variance `1/(n − 3)` of `artanh r` is that of normal variables. Outputs are functions of the factors, and
//! neither normal nor with errors that are independent of the factors: of a product of three factors, intervals by it
//! held 76 % of the correlations. The influence of a member with deviations `x` and `y` on the correlation
//! `r = A/√(BC)` of the moments `A = E[xy]`, `B = E[x²]`, `C = E[y²]` is
//! `(xy − A)/√(BC) − (r/2)((x² − B)/B + (y² − C)/C)`, and the variance of `r` is that of the influence over the number
//! of members: the nonparametric delta method (Davison & Hinkley 1997, §2.7; for Pearson's correlation Steiger &
//! Hakstian, Br. J. Math. Stat. Psychol. 35, 1982).
//!
//! A member also changes the ranks of all others: by one for each that lies above it. The mean over these of `x` adds
//! to `A`, and twice the mean of `y` adds to `C` (Croux & Dehon, Stat. Methods Appl. 19, 2010). Residuals of a
//! regression on other factors may be taken as given, since they are not correlated with these.
//!
//! Partial rank correlations near one have an error that is not linear in the members. Factors enter with their grades,
//! an output with its rank, which is the mean over n members of the step functions "above member k". The variance of
//! ranks that a regression on the grades leaves is thus a V-statistic: with N the variance that the regression leaves
//! of one step, averaged over k, it is too large by N/n on average, and scatters as a sum of squares of normal
//! variables about it. N is near 0.8 of the variance of ranks: of 300 members, 0.3 % of it, which is much where the
//! factors explain 99 %. Intervals without it held 70 to 90 % of such correlations.

use super::interval::{ConfidenceInterval, NORMAL_95, influence_variance};

/// Ranks of an output among the sampled members.
pub(super) struct SampledRanks {
    /// Members by rising output, and the end of each group of equal ones in it.
    order: Vec<usize>,
    ends: Vec<usize>,
    /// Centred rank of each member: the share of the members below it, plus half the share of those that equal it, less
    /// one half.
    pub(super) ranks: Vec<f64>,
}

impl SampledRanks {
    pub(super) fn new(outputs: impl Iterator<Item = i32>) -> Self {
        let outputs: Vec<i32> = outputs.collect();
        let mut order: Vec<usize> = (0..outputs.len()).collect();
        order.sort_unstable_by_key(|&member| (outputs[member], member));
        let (mut ends, mut ranks) = (Vec::new(), vec![0.0; outputs.len()]);
        for group in order.chunk_by(|&one, &other| outputs[one] == outputs[other]) {
            let below = ends.last().copied().unwrap_or(0);
            let rank = (below as f64 + 0.5 * group.len() as f64) / outputs.len() as f64 - 0.5;
            group.iter().for_each(|&member| ranks[member] = rank);
            ends.push(below + group.len());
        }
        Self { order, ends, ranks }
    }

    /// Probability that two sampled members, which may be the same, have equal outputs.
    fn equal_share(&self) -> f64 {
        let starts = std::iter::once(&0).chain(&self.ends);
        let groups = self.ends.iter().zip(starts).map(|(end, start)| (end - start) as f64 / self.order.len() as f64);
        groups.map(|share| share * share).sum()
    }

    /// For each member the mean of a weight over all members, where members below it count as zero and members equal to
    /// it as half.
    fn mean_above(&self, weights: &[f64]) -> Vec<f64> {
        let (mut means, mut above) = (vec![0.0; weights.len()], 0.0);
        let mut end = self.order.len();
        for &next_end in self.ends.iter().rev().skip(1).chain([&0]) {
            let group = &self.order[next_end..end];
            let own: f64 = group.iter().map(|&member| weights[member]).sum();
            group.iter().for_each(|&member| means[member] = (above + 0.5 * own) / weights.len() as f64);
            above += own;
            end = next_end;
        }
        means
    }
}

/// Below this `1 − r²` a correlation is perfect up to rounding.
const PERFECT: f64 = 1e-9;

/// Variance of `artanh r` of two variables with mean zero, times the number of members; one, as for normal variables,
/// where either is constant. With ranks, `y` is or contains the rank of an output.
pub(super) fn scatter(x: &[f64], y: &[f64], ranks: Option<&SampledRanks>) -> f64 {
    let members = x.len() as f64;
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / members;
    let (product, x_square, y_square) = (mean(x, y), mean(x, x), mean(y, y));
    if !(x_square > 0.0 && y_square > 0.0) {
        return 1.0;
    }
    let scale = (x_square * y_square).sqrt();
    let r = product / scale;
    if 1.0 - r * r < PERFECT {
        return 0.0;
    }
    let [of_products, of_squares] = match ranks {
        Some(ranks) => [ranks.mean_above(x), ranks.mean_above(y)],
        None => [vec![0.0; x.len()], vec![0.0; x.len()]],
    };
    let influence = |member: usize| {
        let (x, y) = (x[member], y[member]);
        (x * y + of_products[member]) / scale
            - 0.5 * r * (x * x / x_square + (y * y + 2.0 * of_squares[member]) / y_square)
    };
    influence_variance(&(0..x.len()).map(influence).collect::<Vec<f64>>()) / (1.0 - r * r).powi(2)
}

/// Quantiles 2.5 % and 97.5 % of the part of the variance left of ranks that is quadratic in the members, over its
/// mean: of squares of normal variables with the eigenvalues of the steps left by a regression on one uniform variable,
/// the four largest of which are 37, 19, 9 and 6 % of their sum.
const QUADRATIC_ENDS: [f64; 2] = [0.30, 2.66];
/// Smallest share of a variance left that is taken as true.
const MIN_TRUE_SHARE: f64 = 0.6;

/// Partial rank correlations of an output with the factors, from the sampled members.
pub(super) struct PartialScatter {
    /// Variance of `artanh r` of each factor that is linear in the members, times their number.
    scatters: Vec<f64>,
    /// N of the module documentation, relative to the variance of the ranks.
    step_noise: f64,
}

impl PartialScatter {
    /// From the grades of the factors less their means, and their residuals in a regression on those of the others;
    /// `None` for a constant output or where factors determine one another.
    pub(super) fn new(ranks: &SampledRanks, grades: &[Vec<f64>], residuals: &[Vec<f64>]) -> Option<Self> {
        let members = ranks.ranks.len() as f64;
        let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / members;
        let variance = mean(&ranks.ranks, &ranks.ranks);
        let squares: Vec<f64> = residuals.iter().map(|of| mean(of, of)).collect();
        if !(variance > 0.0 && !squares.is_empty() && squares.iter().all(|square| *square > 0.0)) {
            return None;
        }
        let slopes: Vec<f64> =
            residuals.iter().zip(&squares).map(|(of, square)| mean(of, &ranks.ranks) / square).collect();
        let mut left = ranks.ranks.clone();
        for (slope, grades) in slopes.iter().zip(grades) {
            left.iter_mut().zip(grades).for_each(|(left, grade)| *left -= slope * grade);
        }
        let (left_square, left_above) = (mean(&left, &left), ranks.mean_above(&left));
        let above: Vec<Vec<f64>> = residuals.iter().map(|of| ranks.mean_above(of)).collect();
        let explained =
            |(grades, (above, square)): (&Vec<f64>, (&Vec<f64>, &f64))| mean(&ranks.mean_above(grades), above) / square;
        let explained: f64 = grades.iter().zip(above.iter().zip(&squares)).map(explained).sum();
        let step_noise = (0.25 * (1.0 - ranks.equal_share()) - variance - explained).max(0.0);
        let true_square = true_variance(left_square, step_noise, members);
        let scatter = |factor: usize| {
            let (slope, square, own, above) = (slopes[factor], squares[factor], &residuals[factor], &above[factor]);
            if true_square < PERFECT * variance {
                return 0.0;
            }
            let scale = (square * true_square).sqrt();
            let ratio = slope * square / scale;
            let influence = |member: usize| {
                let (own, left) = (own[member], left[member]);
                let of_variances = own * own / square + (left * left + 2.0 * left_above[member]) / true_square;
                (own * (left + slope * own) + above[member]) / scale - 0.5 * ratio * of_variances
            };
            influence_variance(&(0..left.len()).map(influence).collect::<Vec<f64>>()) / (1.0 + ratio * ratio)
        };
        Some(Self { scatters: (0..slopes.len()).map(scatter).collect(), step_noise: step_noise / variance })
    }

    /// The partial rank correlation of a factor and its interval from all members, with `free` degrees of freedom: from
    /// the slope of the ranks on the grade, both in standard deviations, the diagonal of the inverse of the
    /// correlations of the grades, and the share of the variance of the ranks that the regression leaves. The intervals
    /// by the parts that are linear and quadratic in the members are combined by the squares of the distances of their
    /// ends (Zou & Donner, Stat. Med. 27, 2008).
    pub(super) fn interval(
        &self,
        factor: usize,
        (slope, diagonal, left): (f64, f64, f64),
        members: f64,
        free: f64,
    ) -> ConfidenceInterval {
        let transformed = |left: f64| match slope {
            0.0 => 0.0,
            _ => (slope / (diagonal * left.max(0.0)).sqrt()).asinh(),
        };
        let value = transformed(true_variance(left, self.step_noise, members));
        if !value.is_finite() {
            return ConfidenceInterval::correlation(value.tanh(), free, 0.0);
        }
        let ends = QUADRATIC_ENDS.map(|ratio| transformed(left - ratio * self.step_noise / members));
        let reach = NORMAL_95 * (self.scatters[factor] / (free - 3.0)).sqrt();
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let distance = |by: f64| reach.hypot(by.max(0.0));
        ConfidenceInterval {
            value: value.tanh(),
            low: (value - distance(value - low)).tanh(),
            high: (value + distance(high - value)).tanh(),
        }
    }
}

/// A variance left of ranks without what the steps of the members add on average.
fn true_variance(left: f64, step_noise: f64, members: f64) -> f64 {
    (left - (step_noise - left) / members).max(MIN_TRUE_SHARE * left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    fn centred(values: Vec<f64>) -> Vec<f64> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.into_iter().map(|value| value - mean).collect()
    }

    /// Two normal variables with a correlation of 0.6, or powers of them.
    fn pairs(members: usize, power: i32) -> [Vec<f64>; 2] {
        let mut numbers = RandomStream::new(5, 0);
        let pairs = (0..members).map(|_| {
            let (one, other) = (numbers.normal(), numbers.normal());
            (one.powi(power), (0.6 * one + 0.8 * other).powi(power))
        });
        let (one, other): (Vec<f64>, Vec<f64>) = pairs.unzip();
        [centred(one), centred(other)]
    }

    #[test]
    fn the_scatter_of_normal_variables_is_fishers() {
        let [x, y] = pairs(100_000, 1);
        // Two standard errors of the variance of 100,000 influences.
        assert!((scatter(&x, &y, None) - 1.0).abs() < 0.02, "{}", scatter(&x, &y, None));
        let [x, y] = pairs(100_000, 3);
        assert!(scatter(&x, &y, None) > 3.0, "cubes have long tails: {}", scatter(&x, &y, None));
    }

    /// The variance of Spearman's correlation of independent variables is 1/(n − 1).
    #[test]
    fn the_scatter_of_ranks_of_independent_variables_is_one() {
        let mut numbers = RandomStream::new(6, 0);
        let outputs: Vec<i32> = (0..50_000).map(|_| (1e6 * numbers.normal()) as i32).collect();
        let ranks = SampledRanks::new(outputs.iter().copied());
        let x = centred((0..50_000).map(|_| numbers.uniform()).collect());
        let found = scatter(&x, &ranks.ranks.clone(), Some(&ranks));
        assert!((found - 1.0).abs() < 0.02, "{found}");
    }

    #[test]
    fn equal_outputs_share_their_rank_and_count_half_above_each_other() {
        let ranks = SampledRanks::new([3, 1, 3, 2].into_iter());
        assert_eq!(ranks.ranks, [0.25, -0.375, 0.25, -0.125]);
        assert_eq!(ranks.mean_above(&[1.0; 4]), [0.25, 0.875, 0.25, 0.625]);
    }

    #[test]
    fn a_perfect_correlation_does_not_scatter_and_a_constant_counts_as_normal() {
        let x = centred((0..100).map(f64::from).collect());
        assert_eq!(scatter(&x, &x, None), 0.0);
        assert_eq!(scatter(&x, &vec![0.0; 100], None), 1.0);
    }
}
