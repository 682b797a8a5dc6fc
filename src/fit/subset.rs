//! Which variables can be estimated together.
//!
//! First go the variables that do not matter: what is not known of them moves the residuals hardly at all beside the
//! others. Of the rest, by backward elimination, one goes as long as a limit is broken: the one that the residuals notice
//! less of a pair that stands in each other's way. The paper reduces its factors by eye in the same two steps.

use super::identify::{Certainty, certainty};
use nalgebra::DMatrix;

/// How badly determined a set may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Of the Jacobian with columns of unit length.
    pub condition_number: f64,
    /// Of two estimates, disregarding its sign.
    pub correlation: f64,
    /// Of the residuals' variance, which a variable has to make to matter.
    pub share: f64,
}

impl Default for Limits {
    fn default() -> Self {
        // A hundredth of the variance is a tenth of the deviation: without it the spread is half a per cent less.
        Self { condition_number: 50.0, correlation: 0.95, share: 0.01 }
    }
}

/// Variables that can be estimated together, and how the others went.
#[derive(Clone, Debug, PartialEq)]
pub struct Subset {
    /// Indices of the Jacobian's columns, rising.
    pub kept: Vec<usize>,
    /// The variables left out, in the order in which they went.
    pub dropped: Vec<Dropped>,
    /// Of the variables kept.
    pub certainty: Certainty,
    /// Of every column, the share that its variable makes of the residuals' variance, were all drawn as they are known
    /// beforehand, each for itself: to first order. NaN where that variance is none, or not finite.
    pub shares: Vec<f64>,
}

/// A variable left out.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Dropped {
    /// The place of the variable.
    pub variable: usize,
    /// Which limit it exceeded.
    pub reason: Reason,
}

/// Which limit was broken when a variable went; `with` is the variable that stayed in its stead.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Reason {
    /// No residual changes with it.
    NoEffect,
    /// It makes no more than this share of the residuals' variance.
    Slight {
        /// Share of the variance of the residuals, 0 to 1.
        share: f64,
    },
    /// The two estimates are correlated too closely.
    Correlation {
        /// The place of the variable that stayed.
        with: usize,
        /// Of the two estimates, −1 to 1.
        correlation: f64,
    },
    /// The whole set is too badly conditioned, and these two have the largest part in the weakest direction.
    Condition {
        /// The place of the variable that stayed.
        with: usize,
        /// Of the Jacobian whose columns have unit length.
        condition_number: f64,
    },
    /// The data say less than is known beforehand.
    StandardError {
        /// The standard error of the estimate.
        error: f64,
        /// The width of its bounds.
        width: f64,
    },
}

impl Reason {
    /// Whether the variable went for itself, and not for what it does beside others.
    pub fn is_of_effect(&self) -> bool {
        matches!(self, Self::NoEffect | Self::Slight { .. })
    }
}

/// Drops the variables that do not matter, then others until the rest keep within the limits and are known better from
/// the residuals than beforehand.
///
/// `jacobian` and `variance` are those of [`certainty`]; `widths` is how well each variable is known beforehand, one
/// standard deviation, infinite where it is not known at all: then none is slight, as the variance knows no end.
pub fn subset(jacobian: &DMatrix<f64>, variance: f64, widths: &[f64], limits: &Limits) -> Subset {
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let squares: Vec<f64> = lengths.iter().zip(widths).map(|(length, width)| (length * width).powi(2)).collect();
    let whole: f64 = squares.iter().sum();
    let shares: Vec<f64> = squares.iter().map(|square| square / whole).collect();
    let of_effect = |variable: usize| match shares[variable] {
        _ if lengths[variable] == 0.0 => Some(Reason::NoEffect),
        share if share < limits.share && whole.is_finite() => Some(Reason::Slight { share }),
        _ => None,
    };
    let mut kept: Vec<usize> = (0..lengths.len()).filter(|&variable| of_effect(variable).is_none()).collect();
    let gone = (0..lengths.len()).filter_map(|variable| Some(Dropped { variable, reason: of_effect(variable)? }));
    let mut dropped: Vec<Dropped> = gone.collect();
    dropped.sort_by(|a, b| squares[a.variable].total_cmp(&squares[b.variable]));
    loop {
        let certainty = certainty(&jacobian.select_columns(&kept), variance);
        match worst(&certainty, &kept, widths, limits) {
            Some((place, reason)) => dropped.push(Dropped { variable: kept.remove(place), reason }),
            None => return Subset { kept, dropped, certainty, shares },
        }
    }
}

/// The place of the variable to drop next, and why.
fn worst(certainty: &Certainty, kept: &[usize], widths: &[f64], limits: &Limits) -> Option<(usize, Reason)> {
    let n = kept.len();
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (j, i)));
    let closeness = |&(i, j): &(usize, usize)| certainty.correlation[(i, j)].abs();
    if let Some(pair) = pairs.max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
        && closeness(&pair) > limits.correlation
    {
        let (less, more) = by_effect(pair, &certainty.lengths);
        return Some((less, Reason::Correlation { with: kept[more], correlation: certainty.correlation[pair] }));
    }
    if n > 1 && certainty.condition_number > limits.condition_number {
        let mut places: Vec<usize> = (0..n).collect();
        places.sort_by(|&a, &b| certainty.weakest[b].abs().total_cmp(&certainty.weakest[a].abs()));
        let (less, more) = by_effect((places[0], places[1]), &certainty.lengths);
        let condition_number = certainty.condition_number;
        return Some((less, Reason::Condition { with: kept[more], condition_number }));
    }
    let excess = |&place: &usize| certainty.standard_errors[place] / widths[kept[place]];
    let place = (0..n).max_by(|a, b| excess(a).total_cmp(&excess(b))).filter(|place| excess(place) > 1.0)?;
    let (error, width) = (certainty.standard_errors[place], widths[kept[place]]);
    Some((place, Reason::StandardError { error, width }))
}

/// Of two variables the one that the residuals notice less, then the other. Lengths within a hundredth count as equal,
/// since two columns that are the same differ by the error of the derivatives; then the later goes.
fn by_effect((i, j): (usize, usize), lengths: &[f64]) -> (usize, usize) {
    let (earlier, later) = (i.min(j), i.max(j));
    if lengths[earlier] < 0.99 * lengths[later] { (earlier, later) } else { (later, earlier) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns over 60 instants: two of one shape, one without effect, one that is faint, two that stand alone.
    fn jacobian() -> DMatrix<f64> {
        DMatrix::from_fn(60, 6, |i, j| {
            let t = i as f64 / 59.0;
            match j {
                0 => 200.0 * t,
                1 => -100.0 * (-4.0 * t).exp(),
                2 => -100.0 * (-4.0 * t).exp() * (1.0 + 1e-9 * (i % 3) as f64),
                3 => 0.0,
                4 => 0.01 * (20.0 * t).sin(),
                _ => 50.0 * (6.0 * t).cos(),
            }
        })
    }

    #[test]
    fn the_set_is_reduced_to_what_the_data_tell_and_every_loss_has_its_reason() {
        let found = subset(&jacobian(), 4.0, &[0.05; 6], &Limits::default());
        assert_eq!(found.kept, [0, 1, 5]);
        let went: Vec<usize> = found.dropped.iter().map(|dropped| dropped.variable).collect();
        assert_eq!(went, [3, 4, 2]);
        assert_eq!(found.dropped[0].reason, Reason::NoEffect);
        assert!(matches!(found.dropped[1].reason, Reason::Slight { share } if share < 1e-6));
        assert!(
            matches!(found.dropped[2].reason, Reason::Correlation { with: 1, correlation } if correlation < -0.999)
        );
        assert!(found.certainty.condition_number < 50.0);
        assert!((found.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{:?}", found.shares);
    }

    #[test]
    fn how_much_a_variable_matters_goes_by_how_little_is_known_of_it() {
        let of = |widths: &[f64]| subset(&jacobian().select_columns(&[0, 5]), 4.0, widths, &Limits::default());
        assert_eq!(of(&[0.05, 0.05]).kept, [0, 1]);
        let known = of(&[0.05, 0.005]);
        assert_eq!(known.kept, [0]);
        assert!(matches!(known.dropped[0].reason, Reason::Slight { share } if share == known.shares[1]), "{known:?}");
    }

    /// The faint one alone makes all of the variance there is, and the data would still know it worse than is known.
    #[test]
    fn a_variable_that_the_data_know_worse_than_is_known_beforehand_is_left_out() {
        let found = subset(&jacobian().select_columns(&[4]), 4.0, &[0.05], &Limits::default());
        assert!(matches!(found.dropped[0].reason, Reason::StandardError { error, width: 0.05 } if error > 10.0));
    }

    /// Nothing is known of the second beforehand: beside it no variance is small, and it stays itself.
    #[test]
    fn a_variable_of_which_nothing_is_known_matters_and_makes_no_other_slight() {
        let found = subset(&jacobian().select_columns(&[0, 5]), 4.0, &[1e-6, f64::INFINITY], &Limits::default());
        assert!(found.dropped.iter().all(|dropped| !dropped.reason.is_of_effect()), "{found:?}");
    }

    #[test]
    fn a_set_that_keeps_the_limits_keeps_its_variables() {
        let found = subset(&jacobian().select_columns(&[0, 1, 5]), 4.0, &[0.05; 3], &Limits::default());
        assert_eq!((found.kept, found.dropped), (vec![0, 1, 2], vec![]));
    }

    #[test]
    fn of_a_correlated_pair_the_one_with_less_effect_goes() {
        let mut weaker_first = jacobian().select_columns(&[1, 2]);
        weaker_first.column_mut(0).scale_mut(0.5);
        let found = subset(&weaker_first, 4.0, &[1.0; 2], &Limits::default());
        assert_eq!((found.kept[0], found.dropped[0].variable), (1, 0));
    }

    /// Three columns of which the third is nearly the mean of the others: no pair is close, the set is.
    #[test]
    fn a_set_is_reduced_for_its_condition_where_no_pair_is_to_blame() {
        let three = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.5, 0.0, 1.0, 0.5, 0.0, 0.0, 0.01]);
        let limits = Limits { correlation: 2.0, share: 0.0, ..Limits::default() };
        let found = subset(&three, 1e-6, &[1.0; 3], &limits);
        assert_eq!(found.kept.len(), 2);
        assert!(
            matches!(found.dropped[0].reason, Reason::Condition { condition_number, .. } if condition_number > 50.0)
        );
    }
}
