//! The errors of an estimate, each under its statistical name.

use super::super::{findings, words};
use super::table::table;
use crate::study::estimate::Estimated;

pub(super) fn errors(outcome: &Estimated) -> String {
    let row = |place: usize| {
        vec![
            outcome.factors[place].factor.name.clone(),
            findings::standard_error(outcome, place),
            words::significant(outcome.independent_errors[place], 2),
            words::significant(outcome.numerical_errors[place], 2),
        ]
    };
    let head = [
        "Factor",
        "Standard error",
        "Of linear least squares (independent residuals, exact march)",
        "Numerical error (part of the first)",
    ];
    table("Errors of the estimates", &head, &(0..outcome.factors.len()).map(row).collect::<Vec<_>>())
}
