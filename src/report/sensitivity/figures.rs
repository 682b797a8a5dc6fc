//! Sensitivity curves and correlations of factors.

use crate::case::Case;
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{CONSTANT_K, correlation_matrix, data_window, file_name, line, time_axis};
use crate::report::format;
use crate::study::sensitivity::{Identifiability, Sensitivity};

pub(super) fn figures(case: &Case, outcome: &Sensitivity) -> Vec<Figure> {
    // A sensor of constant temperature has no sensitivity.
    let moves = |sensor: &usize| {
        let slopes_k = outcome.derivatives_k.iter().flat_map(|of_factor| &of_factor[*sensor]);
        slopes_k.into_iter().any(|slope_k| slope_k.abs() > CONSTANT_K)
    };
    let mut figures: Vec<Figure> =
        (0..case.sensors.len()).filter(moves).map(|sensor| sensitivity_curves(case, outcome, sensor)).collect();
    let names = |set: &Identifiability| set.factors.iter().map(|&f| case.factors[f].name.clone()).collect();
    if outcome.all.factors.len() > 1 {
        figures.push(correlation_matrix(
            "alignment",
            "Similarity of sensitivities",
            "Cosine similarity of the sensitivities of two factors over the data used: 1 or -1 means that the data \
             cannot distinguish them, 0 that their effects are orthogonal."
                .to_owned(),
            names(&outcome.all),
            &outcome.all.alignment,
        ));
    }
    if outcome.recommended.factors.len() > 1 {
        figures.push(correlation_matrix(
            "proposed",
            "Correlation of the estimates, proposed set",
            format!(
                "Correlation of the errors of the estimates if {} are estimated together. Beyond ±0.95 only a \
                 combination of the two is determined.",
                format::list::<String>(&names(&outcome.recommended)),
            ),
            names(&outcome.recommended),
            &outcome.recommended.correlation,
        ));
    }
    figures
}

fn sensitivity_curves(case: &Case, outcome: &Sensitivity, sensor: usize) -> Figure {
    let name = &case.sensors[sensor].name;
    let mut layers: Vec<Layer> = data_window(case, sensor, "data window").into_iter().collect();
    let (mut strongest, mut largest_k) = (None, 0.0);
    for (index, factor) in case.factors.iter().enumerate() {
        let per_percent = outcome.change_per_percent_k(case, index).swap_remove(sensor);
        for (&time_s, &change_k) in outcome.instants_s.iter().zip(&per_percent) {
            if change_k.abs() > f64::abs(largest_k) {
                (strongest, largest_k) = (Some((factor, time_s)), change_k);
            }
        }
        // Curves of similar factors overlap: dashes show the one below.
        let stroke = if index % 2 == 0 { Stroke::Solid } else { Stroke::Dashed };
        layers.push(line(factor.name.clone(), Ink::Series(index), stroke, &outcome.instants_s, &per_percent));
    }
    let most = strongest.map(|(factor, time_s)| {
        format!(
            " The largest is {} K per 1 % of {} ({}), at {}.",
            format::signed(largest_k, 2),
            factor.name,
            format::factor_meaning(factor),
            format::seconds(time_s)
        )
    });
    Figure {
        id: file_name("sensitivity", name),
        title: format!("Sensitivity of {name} to each factor, K per 1 %"),
        caption: format!(
            "First-order change of {name} if one factor rises by 1 % of its nominal value.{}",
            most.unwrap_or_default()
        ),
        x: time_axis(case),
        y: Axis::linear("Sensitivity, K per 1 % of the factor"),
        layers,
    }
}
