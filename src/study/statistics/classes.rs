//! First-order Sobol indices from the members there are, without the marches that Saltelli's pairs of members take.
//!
//! A factor's range is cut into classes. The variance between their means over the variance of all is the correlation
//! ratio, which tends to the index `S = Var(E[T|f]) / Var(T)`: what would be gone from the variance were the factor
//! known (Plischke, Borgonovo & Smith, European Journal of Operational Research 226, 2013). Chance makes class means
//! differ even where a factor does nothing; that is taken off as Kelley's ε² does (PNAS 21, 1935). Indices of total
//! effect need members that differ by one factor alone, and are not to be had this way.

use super::sums::{Sums, centred};

/// Classes of a factor. What varies within one is lost to its index: a class is an eighth of a standard deviation of
/// the truncated normal wide, which loses a 600th of the index of a straight line.
pub(super) const CLASSES: usize = 32;

/// What members are drawn about and between: a factor's nominal value and the ends of its range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    pub nominal: f64,
    pub low: f64,
    pub high: f64,
}

impl Span {
    /// The class of a value, the outermost where it lies outside.
    pub(super) fn class(&self, value: f64) -> u8 {
        let share = (value - self.low) / (self.high - self.low);
        // A factor that is fixed has a share that is no number, which the cast makes the first class.
        (share * CLASSES as f64).clamp(0.0, CLASSES as f64 - 1.0) as u8
    }
}

/// The first-order index of an output by a factor, from the members and the sum of the output in each class of it.
pub(super) fn index(members: usize, sums: &Sums, counts: &[u64; CLASSES], in_class: &[i128; CLASSES]) -> f64 {
    let filled = counts.iter().filter(|&&count| count > 0).count();
    let squares = centred(members, sums.squares, sums.first, sums.first);
    if members <= filled || squares <= 0.0 {
        return 0.0;
    }
    let mean = sums.first as f64 / members as f64;
    let classes = counts.iter().zip(in_class).filter(|(count, _)| **count > 0);
    let between: f64 = classes.map(|(&count, &sum)| count as f64 * (sum as f64 / count as f64 - mean).powi(2)).sum();
    let within = (squares - between).max(0.0) / (members - filled) as f64;
    (1.0 - within * (members - 1) as f64 / squares).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::Tally;
    use super::*;
    use crate::case::{Bounds, Factor, Property};
    use crate::ensemble::{Ensemble, Sampling, SamplingKind};

    const MEMBERS: usize = 100_000;

    /// Indices of `f` by its three factors, from members between −1 and 1.
    fn indices(kind: SamplingKind, f: impl Fn(&[f64]) -> f64) -> [f64; 3] {
        let (name, group, property) = ("f".to_owned(), "INS".to_owned(), Property::Conductivity);
        let factor = Factor { name, group, property, nominal: 0.0, small: (-1.0, 1.0), large: (-1.0, 1.0) };
        let factors = [factor.clone(), factor.clone(), factor];
        let ensemble = Ensemble::sample(&factors, Bounds::Small, &Sampling { kind, seed: 3 }, MEMBERS);
        let mut tally = Tally::new(&[0.0], &[Span { nominal: 0.0, low: -1.0, high: 1.0 }; 3]);
        (0..MEMBERS).map(|member| ensemble.member(member)).for_each(|row| tally.add(&[f(&row)], &row));
        [0, 1, 2].map(|factor| tally.index(0, factor))
    }

    /// Within four times what is left to chance, as [`Tally::index`] says, and a 600th, which is the width of a class.
    #[track_caller]
    fn assert_close(found: [f64; 3], exact: [f64; 3]) {
        for (found, exact) in found.into_iter().zip(exact) {
            let n = MEMBERS as f64;
            let chance = 2.0 * (exact * (1.0 - exact) / n).sqrt() + 16.0 / n;
            assert!((found - exact).abs() < 4.0 * chance + exact / 600.0, "{found}, not {exact}");
        }
    }

    #[test]
    fn of_a_sum_each_factor_has_its_share_of_the_variance_however_members_are_drawn() {
        for kind in [SamplingKind::Normal, SamplingKind::Uniform, SamplingKind::LatinHypercube, SamplingKind::Sobol] {
            assert_close(indices(kind, |f| 300.0 * f[0] + 100.0 * f[1]), [0.9, 0.1, 0.0]);
            assert_close(indices(kind, |f| 100.0 * f[0] * f[1]), [0.0; 3]);
        }
    }

    /// Of evenly drawn factors the variances of x, y and xy are 1/3, 1/3 and 1/9; that of x² is 4/45.
    #[test]
    fn a_factor_that_correlates_with_nothing_has_its_index_and_factors_that_act_together_leave_a_rest() {
        let even = SamplingKind::Uniform;
        assert_close(indices(even, |f| 100.0 * (f[0] + f[1] + f[0] * f[1])), [3.0 / 7.0, 3.0 / 7.0, 0.0]);
        assert_close(indices(even, |f| 100.0 * (f[0] * f[0] + f[2])), [4.0 / 19.0, 0.0, 15.0 / 19.0]);
    }

    #[test]
    fn a_factor_that_is_fixed_and_an_output_that_stays_have_no_index() {
        let mut tally = Tally::new(&[0.0, 0.0], &[Span { nominal: 1.0, low: 1.0, high: 1.0 }]);
        (0..100).for_each(|i| tally.add(&[f64::from(i), 5.0], &[1.0]));
        assert_eq!((tally.index(0, 0), tally.index(1, 0)), (0.0, 0.0));
    }
}
