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

/// Ranks of an output among the sampled members.
pub(super) struct SampledRanks {
    /// Members by rising output, and the end of each group of equal ones in it.
    order: Vec<usize>,
    ends: Vec<usize>,
    /// Of each member: share of the members below it, and half of those that equal it, less one half.
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

    /// Of each member the mean of a weight over all members, where those below it count as zero and those that equal
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
    let influences: Vec<f64> = (0..x.len()).map(influence).collect();
    let centre = influences.iter().sum::<f64>() / members;
    let squares: f64 = influences.iter().map(|influence| (influence - centre).powi(2)).sum();
    squares / (members - 1.0) / (1.0 - r * r).powi(2)
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
