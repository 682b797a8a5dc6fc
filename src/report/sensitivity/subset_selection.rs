//! Selection of the factors to estimate, in sentences: the influential factors, those of them that the data can
//! distinguish, and the difference from the set that the case states.

use crate::case::Case;
use crate::fit::{DropReason, Dropped, SubsetLimits};
use crate::report::{format, observations};
use crate::study::sensitivity::{Identifiability, Sensitivity};

/// Definition of the variance share, and the criteria of exclusion.
pub(super) fn explanation() -> String {
    let limits = SubsetLimits::default();
    format!(
        "Share of a factor: its part of the variance of the predicted data to first order, if each factor varies with \
         its prior standard deviation (a quarter of the distance between its bounds). Factors below {} are not \
         influential. Of the influential ones, one at a time is excluded while the correlation of two estimates \
         exceeds {}, the condition number exceeds {}, or a standard error exceeds the prior standard deviation.",
        format::percent_near_limits(limits.min_variance_fraction),
        limits.correlation,
        limits.condition_number
    )
}

/// The two steps of the selection, one sentence each.
pub(super) fn steps(case: &Case, outcome: &Sensitivity) -> [String; 2] {
    let [first, second] = steps_without_shares(case, outcome);
    let mut influential = outcome.influential_factors();
    if influential.is_empty() || outcome.all.factors.len() == 1 {
        return [first, second];
    }
    influential.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let shares: Vec<String> = influential.iter().map(|&factor| with_share(case, outcome, factor)).collect();
    let first = first.trim_end_matches('.');
    [format!("{first}; shares of the variance: {}.", format::list(&shares)), second]
}

/// The two steps without shares.
pub(super) fn steps_without_shares(case: &Case, outcome: &Sensitivity) -> [String; 2] {
    let judges = data_used(case);
    let first = match (outcome.influential_factors().len(), outcome.all.factors.len()) {
        (0, _) => format!("No factor influences {judges}."),
        (1, 1) => format!("{} influences {judges}.", names(case, &outcome.all)),
        (1, all) => format!("1 of {all} factors influences {judges}."),
        (some, all) if some == all => format!("All {all} factors influence {judges}."),
        (some, all) => format!("{some} of {all} factors influence {judges}."),
    };
    [first, identifiable_factors(case, outcome)]
}

/// The second step: the influential factors that the data can distinguish.
fn identifiable_factors(case: &Case, outcome: &Sensitivity) -> String {
    let (all, proposed) = (&outcome.all, &outcome.recommended);
    let names = names(case, proposed);
    let set = match (proposed.factors.len(), outcome.influential_factors().len()) {
        (0, _) => return "None can be estimated from the data.".to_owned(),
        (1, 1) => format!("{names} can be estimated"),
        (1, _) => format!("Of these, only {names} can be estimated"),
        (some, of) if some == of => format!("{names} can be estimated together"),
        _ => format!("Of these, {names} can be estimated together"),
    };
    let condition = format::condition_number(proposed.condition_number);
    if proposed.factors.len() == all.factors.len() {
        return format!("{set} (condition number {condition}).");
    }
    format!("{set} (condition number {condition}; {} for all factors).", format::condition_number(all.condition_number))
}

/// The set that the case states against the proposed one, with the reason for each difference.
pub(super) fn stated_set(case: &Case, outcome: &Sensitivity) -> Option<String> {
    let (stated, proposed) = (outcome.stated.as_ref()?, &outcome.recommended);
    let head = format!("The case estimates {}", names(case, stated));
    let surplus = stated.factors.iter().filter_map(|&factor| outcome.dropped(factor));
    let surplus = surplus.map(|dropped| exclusion_reason(case, dropped));
    let added = proposed.factors.iter().zip(&proposed.standard_errors);
    let added = added.filter(|(factor, _)| !stated.factors.contains(factor)).map(|(&factor, &error)| {
        let prior = case.factors[factor].prior_standard_deviation(case.estimate.bounds);
        format!(
            "{} is added, with a standard error of {} against a prior standard deviation of {}",
            with_share(case, outcome, factor),
            format::significant(error, 2),
            format::significant(prior, 2)
        )
    });
    let only = if proposed.factors.iter().all(|factor| stated.factors.contains(factor)) { " only" } else { "" };
    let differences: Vec<String> = surplus.chain(added).collect();
    Some(match differences.as_slice() {
        [] => format!("{head}, as bondline recommends."),
        _ => format!(
            "{head}{}. bondline recommends {}{only}: {}.",
            conditioning(case, stated),
            names(case, proposed),
            differences.join("; ")
        ),
    })
}

/// Condition number of a set, and the largest correlation of two of its estimates.
fn conditioning(case: &Case, set: &Identifiability) -> String {
    let n = set.factors.len();
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (j, i)));
    let closest = pairs.max_by(|&(a, b), &(c, d)| set.correlation[a][b].abs().total_cmp(&set.correlation[c][d].abs()));
    let Some((a, b)) = closest else { return String::new() };
    let name = |place: usize| case.factors[set.factors[place]].name.as_str();
    let correlation = format::signed(set.correlation[a][b], 3);
    let condition = format::condition_number(set.condition_number);
    match n {
        2 => format!(" (condition number {condition}, correlation of the estimates {correlation})"),
        _ => format!(
            " (condition number {condition}, correlation of the estimates of {} and {} {correlation})",
            name(a),
            name(b)
        ),
    }
}

/// Why a factor was excluded, as a clause.
pub(super) fn exclusion_reason(case: &Case, dropped: &Dropped) -> String {
    let name = |factor: usize| case.factors[factor].name.as_str();
    let factor = name(dropped.variable);
    match dropped.reason {
        DropReason::NoEffect => format!("{factor} has no effect on the data"),
        DropReason::SmallEffect { share } => {
            format!("{factor} explains {} of the variance", format::percent_near_limits(share))
        }
        DropReason::Correlation { with, correlation } => format!(
            "the estimate of {factor} would have correlation {} with that of {}",
            format::signed(correlation, 3),
            name(with)
        ),
        DropReason::Condition { with, condition_number } => format!(
            "{factor} and {} make the set ill-conditioned (condition number {})",
            name(with),
            format::condition_number(condition_number)
        ),
        DropReason::StandardError { error, width } => format!(
            "the standard error of {factor} would be {}, not below its prior standard deviation of {}",
            format::significant(error, 2),
            format::significant(width, 2)
        ),
    }
}

/// The data that the selection uses.
fn data_used(case: &Case) -> String {
    let judges = case.fitted_observations().map(|seen| {
        let window = seen.window_s.or(case.estimate.window_s).map(observations::window_text);
        (case.sensors[seen.sensor].name.as_str(), window.map_or(String::new(), |window| format!(" {window}")))
    });
    let (sensors, windows): (Vec<&str>, Vec<String>) = judges.unzip();
    let Some(first) = windows.first() else { return "the sensors (no observations)".to_owned() };
    if windows.iter().all(|window| window == first) {
        return format!("{}{first}", format::list(&sensors));
    }
    let each: Vec<String> = sensors.iter().zip(&windows).map(|(name, window)| format!("{name}{window}")).collect();
    format::list(&each)
}

fn with_share(case: &Case, outcome: &Sensitivity, factor: usize) -> String {
    format!("{} ({})", case.factors[factor].name, format::percent_near_limits(outcome.shares[factor]))
}

fn names(case: &Case, set: &Identifiability) -> String {
    let names: Vec<&str> = set.factors.iter().map(|&factor| case.factors[factor].name.as_str()).collect();
    format::list(&names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marched;

    /// A selection of two of seven factors, of which the case states one.
    fn selected() -> marched::Study {
        let mut outcomes = marched::study();
        let found = &mut outcomes.sensitivity;
        found.all.condition_number = 2160.0;
        found.shares = vec![0.21, 0.13, 0.002, 0.37, 0.16, 0.12, 0.008];
        let dropped = |variable, reason| Dropped { variable, reason };
        found.reduction = vec![
            dropped(2, DropReason::SmallEffect { share: 0.002 }),
            dropped(6, DropReason::SmallEffect { share: 0.008 }),
            dropped(5, DropReason::Correlation { with: 4, correlation: -1.0 }),
            dropped(4, DropReason::Condition { with: 3, condition_number: 71.0 }),
            dropped(1, DropReason::Correlation { with: 3, correlation: -0.97 }),
        ];
        let stated = found.stated.as_mut().expect("the case states a set");
        (stated.factors, stated.condition_number) = (vec![3, 4], 20.1);
        stated.correlation = vec![vec![1.0, 0.993], vec![0.993, 1.0]];
        let proposed = &mut found.recommended;
        (proposed.factors, proposed.condition_number) = (vec![0, 3], 3.2);
        proposed.standard_errors = vec![0.004, 0.008];
        proposed.correlation = vec![vec![1.0, -0.41], vec![-0.41, 1.0]];
        outcomes
    }

    #[test]
    fn the_selection_is_described_in_two_steps_with_the_share_of_each_influential_factor() {
        let outcomes = selected();
        let steps = steps(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(
            steps,
            [
                "5 of 7 factors influence TC4 from 0 s to 200 s; shares of the variance: f_k_INS (37 %), f_eps_OF (21 \
                 %), f_cp_INS (16 %), f_k_OF (13 %) and f_rho_INS (12 %).",
                "Of these, f_eps_OF and f_k_INS can be estimated together (condition number 3.20; 2,160 for all \
                 factors)."
            ]
        );
    }

    #[test]
    fn each_difference_between_the_stated_and_the_proposed_set_has_a_number() {
        let mut outcomes = selected();
        let text = stated_set(&outcomes.case, &outcomes.sensitivity).expect("the case states a set");
        for part in [
            "The case estimates f_k_INS and f_cp_INS (condition number 20.1, correlation of the estimates +0.993).",
            "bondline recommends f_eps_OF and f_k_INS: f_cp_INS and f_k_INS make the set ill-conditioned (condition \
             number 71.0)",
            "f_eps_OF (21 %) is added, with a standard error of ",
            " against a prior standard deviation of 0.025.",
        ] {
            assert!(text.contains(part), "{part:?} is not in {text:?}");
        }
        assert!(!text.contains("f_rho_INS"), "it is in neither set: {text:?}");
        outcomes.sensitivity.stated = Some(outcomes.sensitivity.recommended.clone());
        let same = stated_set(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(same.as_deref(), Some("The case estimates f_eps_OF and f_k_INS, as bondline recommends."));
        outcomes.sensitivity.stated = None;
        assert_eq!(stated_set(&outcomes.case, &outcomes.sensitivity), None);
    }

    #[test]
    fn factors_without_effect_are_not_influential() {
        let mut outcomes = marched::study();
        let none = |variable| Dropped { variable, reason: DropReason::NoEffect };
        outcomes.sensitivity.reduction = (0..7).map(none).collect();
        outcomes.sensitivity.recommended.factors.clear();
        let steps = steps(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(steps, ["No factor influences TC4 from 0 s to 200 s.", "None can be estimated from the data."]);
    }
}
