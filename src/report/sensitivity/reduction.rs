//! How the set to estimate was found, in words: from all factors to those that matter, to those that the data tell apart;
//! and where the case states another.

use crate::case::Case;
use crate::fit::{Dropped, Limits, Reason};
use crate::report::{observed, words};
use crate::study::sensitivity::{Identifiability, Sensitivity};

/// What is meant by a share, and what breaks a set up.
pub(super) fn explanation() -> String {
    let limits = Limits::default();
    format!(
        "A factor's share is what it would make of the variance of the data, were all drawn as they are known beforehand: \
         a standard deviation is a quarter of the distance between its side constraints. Below {} it does not matter. Of \
         those that do, one goes at a time as long as two estimates are correlated beyond {}, the condition number is \
         beyond {}, or the data would know a factor worse than it is known beforehand.",
        words::percent_of(limits.share),
        limits.correlation,
        limits.condition_number
    )
}

/// The reduction, a sentence a step.
pub(super) fn steps(case: &Case, outcome: &Sensitivity) -> [String; 2] {
    let [first, second] = shortly(case, outcome);
    let mut matter = outcome.matter();
    if matter.is_empty() || outcome.all.factors.len() == 1 {
        return [first, second];
    }
    matter.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let shares: Vec<String> = matter.iter().map(|&factor| with_share(case, outcome, factor)).collect();
    let first = first.trim_end_matches('.');
    [format!("{first}, by their shares of the variance: {}.", words::listed(&shares)), second]
}

/// The same where there is no room for shares.
pub(super) fn shortly(case: &Case, outcome: &Sensitivity) -> [String; 2] {
    let judges = judges(case);
    let first = match (outcome.matter().len(), outcome.all.factors.len()) {
        (0, _) => format!("No factor moves {judges}."),
        (1, 1) => format!("{} moves {judges}.", names(case, &outcome.all)),
        (1, all) => format!("Of {all} factors one matters to {judges}."),
        (some, all) if some == all => format!("All {all} factors matter to {judges}."),
        (some, all) => format!("Of {all} factors {some} matter to {judges}."),
    };
    [first, apart(case, outcome)]
}

/// The second step: which of those that matter the data tell apart.
fn apart(case: &Case, outcome: &Sensitivity) -> String {
    let (all, proposed) = (&outcome.all, &outcome.proposed);
    let names = names(case, proposed);
    let set = match (proposed.factors.len(), outcome.matter().len()) {
        (0, _) => return "None can be estimated from the data.".to_owned(),
        (1, 1) => format!("{names} can be estimated"),
        (1, _) => format!("Of these only {names} can be estimated"),
        (some, of) if some == of => format!("{names} can be estimated together"),
        _ => format!("Of these {names} can be estimated together"),
    };
    let condition = words::condition(proposed.condition_number);
    if proposed.factors.len() == all.factors.len() {
        return format!("{set} (condition number {condition}).");
    }
    format!("{set} (condition number {condition}; {} for all together).", words::condition(all.condition_number))
}

/// How far the set that the case states is the one found, with the number behind each difference.
pub(super) fn stated(case: &Case, outcome: &Sensitivity) -> Option<String> {
    let (stated, proposed) = (outcome.stated.as_ref()?, &outcome.proposed);
    let head = format!("The case states {}", names(case, stated));
    let surplus = stated.factors.iter().filter_map(|&factor| outcome.left_out(factor));
    let surplus = surplus.map(|dropped| left_out(case, dropped));
    let wanting = proposed.factors.iter().zip(&proposed.standard_errors);
    let wanting = wanting.filter(|(factor, _)| !stated.factors.contains(factor)).map(|(&factor, &error)| {
        let known = case.factors[factor].deviation(case.estimate.bounds);
        format!(
            "{} is proposed beside, to ± {} where ± {} is known beforehand",
            with_share(case, outcome, factor),
            words::significant(error, 2),
            words::significant(known, 2)
        )
    });
    let differences: Vec<String> = surplus.chain(wanting).collect();
    Some(match differences.as_slice() {
        [] => format!("{head}, as found here."),
        _ => format!("{head}{}. Here {}.", together(case, stated), differences.join("; ")),
    })
}

/// What the data say of a stated set by itself: how badly it is conditioned, and which estimates are closest.
fn together(case: &Case, set: &Identifiability) -> String {
    let n = set.factors.len();
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (j, i)));
    let closest = pairs.max_by(|&(a, b), &(c, d)| set.correlation[a][b].abs().total_cmp(&set.correlation[c][d].abs()));
    let Some((a, b)) = closest else { return String::new() };
    let name = |place: usize| case.factors[set.factors[place]].name.as_str();
    let correlation = words::signed(set.correlation[a][b], 3);
    let condition = words::condition(set.condition_number);
    match n {
        2 => format!(" (condition number {condition}, estimates correlated {correlation})"),
        _ => format!(
            " (condition number {condition}, estimates of {} and {} correlated {correlation})",
            name(a),
            name(b)
        ),
    }
}

/// Why a factor was left out.
pub(super) fn left_out(case: &Case, dropped: &Dropped) -> String {
    let name = |factor: usize| case.factors[factor].name.as_str();
    let why = match dropped.reason {
        Reason::NoEffect => "the data do not change with it".to_owned(),
        Reason::Slight { share } => format!("it makes {} of the variance", words::percent_of(share)),
        Reason::Correlation { with, correlation } => {
            format!("its estimate would be correlated {} with that of {}", words::signed(correlation, 3), name(with))
        }
        Reason::Condition { with, condition_number } => format!(
            "with {} it makes the set ill-conditioned (condition number {})",
            name(with),
            words::condition(condition_number)
        ),
        // Errors come in units of what is known beforehand.
        Reason::StandardError { error, width } => {
            let known = case.factors[dropped.variable].deviation(case.estimate.bounds);
            format!(
                "the data would give it a standard error of {}, no better than the {} known beforehand",
                words::significant(error * known, 2),
                words::significant(width * known, 2)
            )
        }
    };
    format!("{} is left out: {why}", name(dropped.variable))
}

/// The data that the set is judged by.
fn judges(case: &Case) -> String {
    let judges = case.judges().map(|seen| {
        let window = seen.window_s.or(case.estimate.window_s).map(observed::window);
        (case.sensors[seen.sensor].name.as_str(), window.map_or(String::new(), |window| format!(" {window}")))
    });
    let (sensors, windows): (Vec<&str>, Vec<String>) = judges.unzip();
    let Some(first) = windows.first() else { return "the sensors (nothing is observed)".to_owned() };
    if windows.iter().all(|window| window == first) {
        return format!("{}{first}", words::listed(&sensors));
    }
    let each: Vec<String> = sensors.iter().zip(&windows).map(|(name, window)| format!("{name}{window}")).collect();
    words::listed(&each)
}

fn with_share(case: &Case, outcome: &Sensitivity, factor: usize) -> String {
    format!("{} ({})", case.factors[factor].name, words::percent_of(outcome.shares[factor]))
}

fn names(case: &Case, set: &Identifiability) -> String {
    let names: Vec<&str> = set.factors.iter().map(|&factor| case.factors[factor].name.as_str()).collect();
    words::listed(&names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    #[test]
    fn the_reduction_is_told_in_steps_with_the_share_of_each_factor_that_matters() {
        let outcomes = fixture::outcomes();
        let steps = steps(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(
            steps,
            [
                "Of 7 factors 5 matter to TC4 from 0 s to 80 s, by their shares of the variance: f_k_INS (37 %), f_eps_OF \
                 (21 %), f_cp_INS (16 %), f_k_OF (13 %) and f_rho_INS (12 %).",
                "Of these f_eps_OF and f_k_INS can be estimated together (condition number 3.20; 2,160 for all together)."
            ]
        );
    }

    #[test]
    fn where_the_case_states_another_set_each_difference_has_its_number() {
        let mut outcomes = fixture::outcomes();
        let told = stated(&outcomes.case, &outcomes.sensitivity).expect("the case states a set");
        for part in [
            "The case states f_k_INS and f_cp_INS (condition number 20.1, estimates correlated +0.993).",
            "f_cp_INS is left out: with f_k_INS it makes the set ill-conditioned (condition number 71.0)",
            "f_eps_OF (21 %) is proposed beside, to ± ",
            " where ± 0.025 is known beforehand.",
        ] {
            assert!(told.contains(part), "{part:?} is not in {told:?}");
        }
        assert!(!told.contains("f_rho_INS"), "stated by none, proposed by none: {told:?}");
        outcomes.sensitivity.stated = Some(outcomes.sensitivity.proposed.clone());
        let same = stated(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(same.as_deref(), Some("The case states f_eps_OF and f_k_INS, as found here."));
        outcomes.sensitivity.stated = None;
        assert_eq!(stated(&outcomes.case, &outcomes.sensitivity), None);
    }

    #[test]
    fn factors_that_move_nothing_are_said_to_matter_to_nobody() {
        let mut outcomes = fixture::outcomes();
        let none = |variable| Dropped { variable, reason: Reason::NoEffect };
        outcomes.sensitivity.reduction = (0..7).map(none).collect();
        outcomes.sensitivity.proposed.factors.clear();
        let steps = steps(&outcomes.case, &outcomes.sensitivity);
        assert_eq!(steps, ["No factor moves TC4 from 0 s to 80 s.", "None can be estimated from the data."]);
    }
}
