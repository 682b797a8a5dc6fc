//! The estimated heating history, its residuals, and the choice of the regularisation weight.

use super::{band_explanation, finding, quantity_format, regularisation};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::line;
use crate::report::format;
use crate::study::answers::Answers;
use crate::study::flux_inversion::FluxInversion;

pub(super) fn figures(answers: &Answers, outcome: &FluxInversion) -> Vec<Figure> {
    let mut figures = vec![flux(answers, outcome), residuals(answers, outcome)];
    if !outcome.weight_is_stated {
        figures.push(weight_selection(outcome));
    }
    figures
}

fn flux(answers: &Answers, outcome: &FluxInversion) -> Figure {
    let knots = 0..outcome.times_s.len();
    let unit = quantity_format(outcome.quantity);
    let largest = outcome.values.iter().chain(&outcome.case_values).copied().fold(0.0, f64::max) * unit.scale;
    // Limits the axis, as the band is unbounded at undetermined knots.
    let top = 1.4 * largest.max(1e-6);
    let lowest = outcome.values.iter().chain(&outcome.case_values).copied().fold(0.0, f64::min) * unit.scale;
    let bottom = 1.4 * lowest;
    let values = |values: &[f64]| -> Vec<f64> { values.iter().map(|value| value * unit.scale).collect() };
    let edge = |sign: f64| {
        let at = |knot: usize| (outcome.values[knot] + sign * outcome.half_widths[knot]) * unit.scale;
        knots.clone().map(|knot| at(knot).clamp(bottom, top)).collect()
    };
    let x = &outcome.times_s;
    let found_values = values(&outcome.values);
    Figure {
        id: "history-flux".to_owned(),
        title: format!("{}, estimated", unit.title),
        caption: format!("{} {}", finding(answers, outcome), band_explanation()),
        x: Axis::linear("Time, s").with_range(0.0, outcome.end_s),
        y: Axis::linear(&format!("{}, {}", capitalised(unit.noun), unit.unit)).with_range(bottom, top),
        layers: vec![
            Layer::Band {
                name: "95 % band".to_owned(),
                ink: Ink::Series(0),
                opacity: 0.2,
                x: x.clone(),
                low: edge(-1.0),
                high: edge(1.0),
            },
            line("stated in the case".to_owned(), Ink::Guide, Stroke::Dashed, x, &values(&outcome.case_values)),
            line("estimated".to_owned(), Ink::Series(0), Stroke::Solid, x, &found_values),
            Layer::Points {
                name: "knots".to_owned(),
                ink: Ink::Series(0),
                x: x.clone(),
                y: found_values,
                error: Vec::new(),
            },
        ],
    }
}

/// Capitalise the first letter.
fn capitalised(noun: &str) -> String {
    let mut letters = noun.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn residuals(answers: &Answers, outcome: &FluxInversion) -> Figure {
    let mut layers = vec![line(String::new(), Ink::Guide, Stroke::Dashed, &[0.0, outcome.end_s], &[0.0; 2])];
    for (place, seen) in outcome.sensor_fits.iter().enumerate() {
        layers.push(Layer::Points {
            name: answers.case.sensors[seen.sensor].name.clone(),
            ink: Ink::Series(place),
            x: seen.times_s.clone(),
            y: seen.residuals_k.clone(),
            error: seen.sigma_k.clone(),
        });
    }
    let each: Vec<String> = outcome
        .sensor_fits
        .iter()
        .map(|seen| {
            format!(
                "{} RMSE {} with the stated heating, {} with the estimated one",
                answers.case.sensors[seen.sensor].name,
                format::temperature_difference(seen.rms_k.0),
                format::temperature_difference(seen.rms_k.1)
            )
        })
        .collect();
    Figure {
        id: "history-residuals".to_owned(),
        title: "Residuals of the estimated heating".to_owned(),
        caption: format!("{}. Error bars: one standard deviation of the measurement.", format::list(&each)),
        x: Axis::linear("Time, s").with_range(0.0, outcome.end_s),
        y: Axis::linear("Measured less predicted, K"),
        layers,
    }
}

fn weight_selection(outcome: &FluxInversion) -> Figure {
    let (x, y): (Vec<f64>, Vec<f64>) = outcome.weights.iter().map(|at| (at.weight, at.probability)).unzip();
    let chosen = outcome.weights.iter().filter(|at| at.weight == outcome.weight);
    Figure {
        id: "history-smoothing".to_owned(),
        title: "Probability of the regularisation weight".to_owned(),
        caption: format!(
            "{} The probabilities are those of the restricted likelihood, summed over models of the noise; at a weight \
             of one the readings and the roughness are equally sensitive to the heating.",
            regularisation(outcome)
        ),
        x: Axis::log("Regularisation weight"),
        y: Axis::linear("Probability"),
        layers: vec![
            line("all weights".to_owned(), Ink::Series(0), Stroke::Solid, &x, &y),
            Layer::Points {
                name: "chosen".to_owned(),
                ink: Ink::Series(1),
                x: vec![outcome.weight],
                y: chosen.map(|at| at.probability).collect(),
                error: Vec::new(),
            },
        ],
    }
}
