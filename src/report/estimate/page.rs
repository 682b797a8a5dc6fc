//! The section of an estimate.

use super::{interval_text, multistart_summary, noise_model, objective_definition, standard_error};
use crate::report::format;
use crate::report::format::clause;
use crate::report::html::table::{list, paragraph, table};
use crate::report::nominal::{MISFIT_HEAD, misfit_cells};
use crate::study::answers::Answers;
use crate::study::estimate::{Estimand, ParameterEstimates};

pub(super) fn page(answers: &Answers, outcome: &ParameterEstimates) -> String {
    let rows: Vec<Vec<String>> = (outcome.factors.iter().enumerate())
        .map(|(place, Estimand { factor, bounds, .. })| {
            let (least, most) = *bounds;
            let bounded = if outcome.at_bound[place] { "(on bound)" } else { "" };
            vec![
                factor.name.clone(),
                format::factor_meaning(factor),
                format!("{:.3}", outcome.iterations[0].values[place]),
                format!("{:.4}", outcome.values[place]),
                standard_error(outcome, place),
                interval_text(outcome, place),
                format!("{least:.2} to {most:.2} {bounded}").trim_end().to_owned(),
            ]
        })
        .collect();
    let misfits: Vec<Vec<String>> = (answers.misfits(outcome).into_iter())
        .flat_map(|(name, (before, after))| {
            [("nominal", before), ("estimated", after)].map(|(when, misfit)| {
                let mut row = vec![format!("{name} {when}")];
                row.extend(misfit_cells(misfit));
                row
            })
        })
        .collect();
    let mut text = vec![
        format!("Termination: {}. {}", clause(&outcome.termination), outcome.advice),
        format!(
            "{} Initial value {}, final value {}.",
            objective_definition(outcome),
            format::significant(outcome.objectives().0, 4),
            format::significant(outcome.objectives().1, 4)
        ),
        format!(
            "Condition number {}; least determined direction: {}.",
            format::condition_number(outcome.identifiability.condition_number),
            clause(&outcome.identifiability.weakest_direction)
        ),
        noise_model(outcome),
    ];
    text.extend(multistart_summary(outcome));
    let head = ["Factor", "Scales", "Start", "Estimate", "Standard error", "95 % interval", "Bounds"];
    table("Estimates", &head, &rows)
        + &errors(outcome)
        + &profiles(outcome)
        + &goodness_of_fit(outcome)
        + &table("Prediction less measurement in the data window", &MISFIT_HEAD, &misfits)
        + &list(&text)
}

fn profiles(outcome: &ParameterEstimates) -> String {
    let rows: Vec<Vec<String>> = (outcome.profiles.iter())
        .map(|profile| {
            let Estimand { factor, bounds, .. } = &outcome.factors[profile.factor];
            vec![
                factor.name.clone(),
                format::interval(outcome.intervals[profile.factor], *bounds),
                format::profile_interval(profile.interval, *bounds),
            ]
        })
        .collect();
    table("95 % intervals", &["Factor", "Linear", "Profile likelihood"], &rows)
}

/// Statistics of the fit.
fn goodness_of_fit(outcome: &ParameterEstimates) -> String {
    let of = outcome.goodness_of_fit;
    let row = vec![
        format::significant(of.chi_squared, 4),
        format::count(of.degrees_of_freedom),
        format::significant(of.reduced_chi_squared, 3),
        format!("{:.1}", of.akaike_criterion),
        format!("{:.1}", of.bayesian_criterion),
        format::count(outcome.samples),
        format::significant(outcome.effective_samples, 2),
    ];
    let head = ["χ²", "Degrees of freedom", "Reduced χ²", "AIC", "BIC", "Samples", "Effective samples"];
    table("Goodness of fit", &head, &[row])
        + &paragraph(
            "χ² is the sum of squares of the residuals over their stated standard deviations, without loss function \
             and prior. Reduced χ² is one where the residuals are as large as stated. AIC = N ln(χ²/N) + 2p and BIC = \
             N ln(χ²/N) + p ln N with N samples and p factors, as in lmfit: the lower of two fits of the same data is \
             better. They assume independent residuals; the effective samples say how far that holds.",
        )
}

/// The standard error of each estimate and its parts.
fn errors(outcome: &ParameterEstimates) -> String {
    let row = |place: usize| {
        vec![
            outcome.factors[place].factor.name.clone(),
            standard_error(outcome, place),
            format::significant(outcome.independent_errors[place], 2),
            format::significant(outcome.numerical_errors[place], 2),
        ]
    };
    let head = [
        "Factor",
        "Standard error",
        "Standard error of linear least squares (independent residuals, exact march)",
        "Discretisation error (part of the standard error)",
    ];
    table("Errors of the estimates", &head, &(0..outcome.factors.len()).map(row).collect::<Vec<_>>())
}
