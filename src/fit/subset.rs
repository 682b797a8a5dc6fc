//! Selection of a subset of variables that can be estimated together.
//!
//! First, variables with a small effect are dropped: their prior uncertainty contributes little to the variance of the
//! residuals. Of the rest, backward elimination drops one variable at a time while a limit is exceeded: of the worst
//! pair, the one with the smaller effect. The paper reduces its factors by eye in the same two steps.
//!
//! The effect of a variable is the norm of its column times its prior standard deviation, so that no choice depends on
//! the unit in which a variable is expressed.

use super::identifiability::{CovarianceSummary, ILL_CONDITIONED, covariance_summary};
use nalgebra::DMatrix;

/// Limits of an identifiable subset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsetLimits {
    /// Largest condition number of the Jacobian with unit columns.
    pub condition_number: f64,
    /// Largest absolute correlation of two estimates.
    pub correlation: f64,
    /// Smallest contribution of a variable to the variance of the residuals, as a fraction.
    pub min_variance_fraction: f64,
}

impl Default for SubsetLimits {
    fn default() -> Self {
        // 1 % of the variance is 10 % of the standard deviation: without that variable the total standard deviation
        // falls by 0.5 %.
        Self { condition_number: ILL_CONDITIONED, correlation: 0.95, min_variance_fraction: 0.01 }
    }
}

/// A subset of variables that can be estimated together, and the variables dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Subset {
    /// Column indices of the Jacobian, increasing.
    pub selected: Vec<usize>,
    /// The variables dropped, in that order.
    pub dropped: Vec<Dropped>,
    /// Covariance summary of the selected variables.
    pub covariance_summary: CovarianceSummary,
    /// Contribution of every variable to the variance of the residuals, as a fraction, to first order and for
    /// independent priors. NaN where that variance is zero or not finite.
    pub variance_fractions: Vec<f64>,
}

/// A dropped variable.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Dropped {
    /// Index of the variable.
    pub variable: usize,
    /// The limit that was exceeded.
    pub reason: DropReason,
}

/// Why a variable was dropped; `with` is the index of the variable kept instead.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum DropReason {
    /// No residual depends on it.
    NoEffect,
    /// It contributes too little to the variance of the residuals.
    SmallEffect {
        /// Contribution to the variance of the residuals, 0 to 1.
        share: f64,
    },
    /// The two estimates are too strongly correlated.
    Correlation {
        /// Index of the variable kept.
        with: usize,
        /// Correlation of the two estimates, −1 to 1.
        correlation: f64,
    },
    /// The set is ill-conditioned, and these two variables have the largest components in the weakest direction.
    Condition {
        /// Index of the variable kept.
        with: usize,
        /// Condition number of the Jacobian with unit columns.
        condition_number: f64,
    },
    /// The standard error exceeds the prior standard deviation.
    StandardError {
        /// The standard error of the estimate.
        error: f64,
        /// The prior standard deviation.
        width: f64,
    },
}

impl DropReason {
    /// Whether the variable was dropped for its small effect, irrespective of the others.
    pub fn is_small_effect(&self) -> bool {
        matches!(self, Self::NoEffect | Self::SmallEffect { .. })
    }
}

/// Selects a subset: drops variables with a small effect, then others until the rest keep the limits and have standard
/// errors below their prior standard deviations.
///
/// `jacobian` and `variance` are those of [`covariance_summary`]; `prior_deviations` are the prior standard deviations,
/// infinite without a prior. With an infinite one no variable has a small effect, as the variance is unbounded; of a
/// pair without priors the later one is dropped, as nothing but their units tells their effects apart.
pub fn identifiable_subset(
    jacobian: &DMatrix<f64>,
    variance: f64,
    prior_deviations: &[f64],
    limits: &SubsetLimits,
) -> Subset {
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let effects: Vec<f64> = lengths.iter().zip(prior_deviations).map(|(length, width)| length * width).collect();
    let squares: Vec<f64> = effects.iter().map(|effect| effect.powi(2)).collect();
    let total: f64 = squares.iter().sum();
    let shares: Vec<f64> = squares.iter().map(|square| square / total).collect();
    let small_effect = |variable: usize| match shares[variable] {
        _ if lengths[variable] == 0.0 => Some(DropReason::NoEffect),
        share if share < limits.min_variance_fraction && total.is_finite() => Some(DropReason::SmallEffect { share }),
        _ => None,
    };
    let mut selected: Vec<usize> = (0..lengths.len()).filter(|&variable| small_effect(variable).is_none()).collect();
    let of_small_effect =
        (0..lengths.len()).filter_map(|variable| Some(Dropped { variable, reason: small_effect(variable)? }));
    let mut dropped: Vec<Dropped> = of_small_effect.collect();
    dropped.sort_by(|a, b| squares[a.variable].total_cmp(&squares[b.variable]));
    loop {
        let summary = covariance_summary(&jacobian.select_columns(&selected), variance);
        match next_to_drop(&summary, &selected, &effects, prior_deviations, limits) {
            Some((index, reason)) => dropped.push(Dropped { variable: selected.remove(index), reason }),
            None => return Subset { selected, dropped, covariance_summary: summary, variance_fractions: shares },
        }
    }
}

/// Position of the next variable to drop, and the reason.
fn next_to_drop(
    summary: &CovarianceSummary,
    selected: &[usize],
    effects: &[f64],
    prior_deviations: &[f64],
    limits: &SubsetLimits,
) -> Option<(usize, DropReason)> {
    let n = selected.len();
    let by_effect = |pair| by_effect(pair, |index| effects[selected[index]]);
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (j, i)));
    let closeness = |&(i, j): &(usize, usize)| summary.correlation[(i, j)].abs();
    if let Some(pair) = pairs.max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
        && closeness(&pair) > limits.correlation
    {
        let (less, more) = by_effect(pair);
        return Some((less, DropReason::Correlation { with: selected[more], correlation: summary.correlation[pair] }));
    }
    if n > 1 && summary.condition_number > limits.condition_number {
        let mut indices: Vec<usize> = (0..n).collect();
        indices.sort_by(|&a, &b| summary.weakest_direction[b].abs().total_cmp(&summary.weakest_direction[a].abs()));
        let (less, more) = by_effect((indices[0], indices[1]));
        let condition_number = summary.condition_number;
        return Some((less, DropReason::Condition { with: selected[more], condition_number }));
    }
    let excess = |&index: &usize| summary.standard_errors[index] / prior_deviations[selected[index]];
    let index = (0..n).max_by(|a, b| excess(a).total_cmp(&excess(b))).filter(|index| excess(index) > 1.0)?;
    let (error, width) = (summary.standard_errors[index], prior_deviations[selected[index]]);
    Some((index, DropReason::StandardError { error, width }))
}

/// The one of two variables with the smaller effect, which is dropped, and the other one. Effects within 1 % count as
/// equal, since identical columns differ by the error of the derivatives; then the later variable is dropped.
fn by_effect((i, j): (usize, usize), effect: impl Fn(usize) -> f64) -> (usize, usize) {
    let (earlier, later) = (i.min(j), i.max(j));
    if effect(earlier) < 0.99 * effect(later) { (earlier, later) } else { (later, earlier) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns over 60 instants: two of the same shape, one of zeros, a weak one, and two distinct ones.
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
    fn the_set_is_reduced_to_identifiable_variables_with_a_reason_for_each_one_dropped() {
        let found = identifiable_subset(&jacobian(), 4.0, &[0.05; 6], &SubsetLimits::default());
        assert_eq!(found.selected, [0, 1, 5]);
        let dropped: Vec<usize> = found.dropped.iter().map(|dropped| dropped.variable).collect();
        assert_eq!(dropped, [3, 4, 2]);
        assert_eq!(found.dropped[0].reason, DropReason::NoEffect);
        assert!(matches!(found.dropped[1].reason, DropReason::SmallEffect { share } if share < 1e-6));
        assert!(
            matches!(found.dropped[2].reason, DropReason::Correlation { with: 1, correlation } if correlation < -0.999)
        );
        assert!(found.covariance_summary.condition_number < 50.0);
        assert!((found.variance_fractions.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{:?}", found.variance_fractions);
    }

    #[test]
    fn the_effect_of_a_variable_is_proportional_to_its_prior_standard_deviation() {
        let of = |prior_deviations: &[f64]| {
            identifiable_subset(&jacobian().select_columns(&[0, 5]), 4.0, prior_deviations, &SubsetLimits::default())
        };
        assert_eq!(of(&[0.05, 0.05]).selected, [0, 1]);
        let known = of(&[0.05, 0.005]);
        assert_eq!(known.selected, [0]);
        let fraction = known.variance_fractions[1];
        assert!(matches!(known.dropped[0].reason, DropReason::SmallEffect { share } if share == fraction), "{known:?}");
    }

    /// The weak column alone contributes all of the variance, yet its standard error exceeds the prior standard
    /// deviation.
    #[test]
    fn a_variable_with_a_standard_error_above_its_prior_standard_deviation_is_dropped() {
        let found = identifiable_subset(&jacobian().select_columns(&[4]), 4.0, &[0.05], &SubsetLimits::default());
        assert!(matches!(found.dropped[0].reason, DropReason::StandardError { error, width: 0.05 } if error > 10.0));
    }

    /// The second has no prior: relative to it no variance is small, and it is kept.
    #[test]
    fn a_variable_without_a_prior_is_kept_and_no_other_is_dropped_for_a_small_effect() {
        let found = identifiable_subset(
            &jacobian().select_columns(&[0, 5]),
            4.0,
            &[1e-6, f64::INFINITY],
            &SubsetLimits::default(),
        );
        assert!(found.dropped.iter().all(|dropped| !dropped.reason.is_small_effect()), "{found:?}");
    }

    #[test]
    fn a_set_within_the_limits_is_not_reduced() {
        let found =
            identifiable_subset(&jacobian().select_columns(&[0, 1, 5]), 4.0, &[0.05; 3], &SubsetLimits::default());
        assert_eq!((found.selected, found.dropped), (vec![0, 1, 2], vec![]));
    }

    #[test]
    fn of_a_correlated_pair_the_one_with_the_smaller_effect_is_dropped() {
        let mut weaker_first = jacobian().select_columns(&[1, 2]);
        weaker_first.column_mut(0).scale_mut(0.5);
        let found = identifiable_subset(&weaker_first, 4.0, &[1.0; 2], &SubsetLimits::default());
        assert_eq!((found.selected[0], found.dropped[0].variable), (1, 0));
    }

    /// The third column is the mean of the first two, with less effect; every variable in
    /// turn is expressed in another unit.
    #[test]
    fn the_subset_is_the_same_whatever_the_unit_of_a_variable() {
        let in_units = |units: [f64; 4]| {
            let columns = jacobian().select_columns(&[0, 1, 2, 5]);
            let mean = (columns.column(0) + columns.column(1)) / 2.0;
            let jacobian = DMatrix::from_fn(60, 4, |i, j| {
                let own = if j == 2 { mean[i] + 0.02 * columns[(i, 3)] } else { columns[(i, j)] };
                own / units[j]
            });
            let deviations: Vec<f64> =
                [0.05, 0.05, 0.02, 0.05].iter().zip(units).map(|(own, unit)| own * unit).collect();
            let found = identifiable_subset(&jacobian, 1e-3, &deviations, &SubsetLimits::default());
            let dropped: Vec<usize> = found.dropped.iter().map(|dropped| dropped.variable).collect();
            (found.selected, dropped)
        };
        let expected = in_units([1.0; 4]);
        assert_eq!(expected, (vec![0, 1, 3], vec![2]));
        for variable in 0..4 {
            for unit in [1e-3, 1e3] {
                let units = std::array::from_fn(|other| if other == variable { unit } else { 1.0 });
                assert_eq!(in_units(units), expected, "variable {variable} in units of {unit}");
            }
        }
    }

    /// Three columns, the third nearly the mean of the others: no pair is strongly correlated, but the set is
    /// ill-conditioned.
    #[test]
    fn an_ill_conditioned_set_without_a_correlated_pair_is_reduced() {
        let three = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.5, 0.0, 1.0, 0.5, 0.0, 0.0, 0.01]);
        let limits = SubsetLimits { correlation: 2.0, min_variance_fraction: 0.0, ..SubsetLimits::default() };
        let found = identifiable_subset(&three, 1e-6, &[1.0; 3], &limits);
        assert_eq!(found.selected.len(), 2);
        assert!(
            matches!(found.dropped[0].reason, DropReason::Condition { condition_number, .. } if condition_number > 50.0)
        );
    }
}
