//! The fit, the iterations and the residuals.

mod profile;

use super::objective_definition;
use crate::case::{Case, Observation};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{correlation_matrix, file_name, line, measured, temperature_axis, thinned, time_axis};
use crate::report::format;
use crate::report::format::clause;
use crate::study::answers::Answers;
use crate::study::estimate::{CaseFit, Landscape, NODES, ParameterEstimates};
use crate::study::nominal::{Misfit, Prediction};

pub(super) fn figures(answers: &Answers, outcome: &ParameterEstimates) -> Vec<Figure> {
    let (mut figures, mut validation) = (Vec::new(), Vec::new());
    for (case, fitted) in answers.fits(outcome) {
        for seen in &case.observations {
            let place = fitted.sensors.iter().position(|&sensor| sensor == seen.sensor);
            let list = if place.is_some() { &mut figures } else { &mut validation };
            list.push(fit(answers, case, fitted, seen, place.map(|place| &fitted.misfits[place])));
            let window_s = case.window_s(seen.sensor);
            let is_part = window_s != (0.0, case.exposure.duration_s);
            list.extend((place.is_some() && is_part).then(|| fit_in_window(answers, case, fitted, seen, window_s)));
        }
    }
    figures.extend(outcome.landscape.iter().flat_map(|landscape| design_space(outcome, landscape)));
    figures.extend(profile::figures(outcome));
    figures.push(objective_by_iteration(outcome));
    figures.extend(answers.fits(outcome).map(|(case, fitted)| residuals(answers, case, outcome, fitted)));
    if outcome.factors.len() > 1 {
        figures.push(correlation_matrix(
            "estimates",
            "Correlation of the estimates",
            format!(
                "Correlation of the errors of the estimates. Least determined direction: {}.",
                outcome.identifiability.weakest_direction
            ),
            names(outcome),
            &outcome.identifiability.correlation,
        ));
    }
    figures.extend(validation);
    figures
}

fn names(outcome: &ParameterEstimates) -> Vec<String> {
    outcome.factors.iter().map(|factor| factor.factor.name.clone()).collect()
}

/// One sensor; `misfit` at the nominal and the estimated factors if it was fitted.
fn fit(
    answers: &Answers,
    case: &Case,
    fitted: &CaseFit,
    seen: &Observation,
    misfit: Option<&(Misfit, Misfit)>,
) -> Figure {
    let sensor = seen.sensor;
    let name = &answers.sensor_name(case, sensor);
    let (from, to) = case.window_s(sensor);
    let (before, after) = (&fitted.before, &fitted.after);
    let mut layers: Vec<Layer> =
        misfit.map(|_| Layer::Interval { name: "data window".to_owned(), from, to }).into_iter().collect();
    layers.extend([
        line("nominal".to_owned(), Ink::Guide, Stroke::Dashed, &before.instants_s, &before.temperatures_k[sensor]),
        line("estimated".to_owned(), Ink::Series(0), Stroke::Solid, &after.instants_s, &after.temperatures_k[sensor]),
        measured("measured".to_owned(), Ink::Measured, seen),
    ]);
    let text = match misfit {
        Some((before, after)) => format!(
            "RMSE from {} to {}: {} with the nominal factors, {} with the estimated ones.",
            format::seconds(from),
            format::seconds(to),
            format::temperature_difference(before.rms_k),
            format::temperature_difference(after.rms_k)
        ),
        None => format!("{name} was not fitted: its misfit is a validation of the estimate."),
    };
    Figure {
        id: file_name("fit", name),
        title: format!("{name} with the nominal and the estimated factors"),
        caption: format!("{text} Error bars: two standard deviations of the measurement; samples are thinned."),
        x: time_axis(case),
        y: temperature_axis(),
        layers,
    }
}

/// One fitted sensor in its data window alone.
fn fit_in_window(
    answers: &Answers,
    case: &Case,
    fitted: &CaseFit,
    seen: &Observation,
    (from_s, to_s): (f64, f64),
) -> Figure {
    let name = &answers.sensor_name(case, seen.sensor);
    let inside = |times_s: &[f64], values: &[f64]| -> (Vec<f64>, Vec<f64>) {
        let pairs = times_s.iter().zip(values).filter(|(time_s, _)| (from_s..=to_s).contains(*time_s));
        pairs.map(|(&time_s, &value)| (time_s, value)).unzip()
    };
    let trace = |label: &str, ink: Ink, stroke: Stroke, march: &Prediction| {
        let (x, y) = inside(&march.instants_s, &march.temperatures_k[seen.sensor]);
        line(label.to_owned(), ink, stroke, &x, &y)
    };
    let (times_s, temperatures_k) = inside(&seen.times_s, &seen.temperatures_k);
    let (_, sigma_k) = inside(&seen.times_s, &seen.sigma_k);
    let samples = Observation { times_s, temperatures_k, sigma_k, ..seen.clone() };
    Figure {
        id: file_name("fit-window", name),
        title: format!("{name} in the data window"),
        caption: format!(
            "The part of the traces that the estimate uses, from {} to {}.",
            format::seconds(from_s),
            format::seconds(to_s)
        ),
        x: Axis::linear("Time, s").with_range(from_s, to_s),
        y: temperature_axis(),
        layers: vec![
            trace("nominal", Ink::Guide, Stroke::Dashed, &fitted.before),
            trace("estimated", Ink::Series(0), Stroke::Solid, &fitted.after),
            measured("measured".to_owned(), Ink::Measured, &samples),
        ],
    }
}

/// The objective over the two factors, alone and with the iterations.
fn design_space(outcome: &ParameterEstimates, landscape: &Landscape) -> [Figure; 2] {
    let names = names(outcome);
    let axis = |index: usize| {
        let (low, high) = outcome.factors.get(index).map_or((0.0, 1.0), |factor| factor.bounds);
        Axis::linear(names.get(index).map_or("", String::as_str)).with_range(low, high)
    };
    let visited = |index: usize| -> Vec<f64> {
        outcome.iterations.iter().filter_map(|turn| turn.values.get(index).copied()).collect()
    };
    let (x, y) = (visited(0), visited(1));
    let last = |values: &[f64]| -> Vec<f64> { values.last().copied().into_iter().collect() };
    let contours = Layer::Contours {
        name: "objective S".to_owned(),
        x: landscape.x.clone(),
        y: landscape.y.clone(),
        values: landscape.objective.clone(),
        levels: contour_levels(&landscape.objective),
    };
    let path = vec![
        contours.clone(),
        Layer::Line {
            name: "iterations".to_owned(),
            ink: Ink::Measured,
            stroke: Stroke::Solid,
            x: x.clone(),
            y: y.clone(),
        },
        Layer::Points { name: String::new(), ink: Ink::Measured, x: x.clone(), y: y.clone(), error: Vec::new() },
        Layer::Points { name: "estimate".to_owned(), ink: Ink::Series(1), x: last(&x), y: last(&y), error: Vec::new() },
    ];
    let minima = landscape.minima().len();
    let figure = |id: &str, title: &str, caption: String, layers: Vec<Layer>| Figure {
        id: id.to_owned(),
        title: title.to_owned(),
        caption,
        x: axis(0),
        y: axis(1),
        layers,
    };
    let surface = figure(
        "design-space",
        "Objective over the two factors",
        format!(
            "Contours of the objective S, which has {} within the bounds. A long narrow valley means that the data \
             determine a combination of the two factors better than either factor. {} Residuals are interpolated with \
             their derivatives between {NODES} × {NODES} marched pairs of factors.",
            format::counted_irregular(minima, "minimum", "minima"),
            objective_definition(outcome)
        ),
        vec![contours],
    );
    let walk = format!(
        "The same with the start and {}.",
        format::counted(outcome.iterations.len().saturating_sub(1), "iteration")
    );
    [surface, figure("design-space-path", "Iterations over the objective", walk, path)]
}

/// Twelve levels in equal ratios over at most four decades: without noise the minimum is a rounding error, and levels
/// down to it would crowd around one point.
fn contour_levels(values: &[Vec<f64>]) -> Vec<f64> {
    let shown = || values.iter().flatten().copied().filter(|value| value.is_finite() && *value > 0.0);
    let high = shown().fold(0.0, f64::max);
    let low = shown().fold(f64::INFINITY, f64::min).max(1e-4 * high);
    if low >= high {
        return Vec::new();
    }
    // Without the extremes, where a contour is a point or a corner.
    (1..=12).map(|step| low * (high / low).powf(f64::from(step) / 13.0)).collect()
}

fn objective_by_iteration(outcome: &ParameterEstimates) -> Figure {
    let x: Vec<f64> = (0..outcome.iterations.len()).map(|turn| turn as f64).collect();
    let y: Vec<f64> = outcome.iterations.iter().map(|turn| turn.objective).collect();
    Figure {
        id: "objective".to_owned(),
        title: "Objective by iteration".to_owned(),
        caption: format!(
            "S falls from {} to {} in {}. Termination: {}. {}",
            format::significant(outcome.objectives().0, 3),
            format::significant(outcome.objectives().1, 3),
            format::counted(outcome.iterations.len().saturating_sub(1), "iteration"),
            clause(&outcome.termination),
            objective_definition(outcome)
        ),
        x: Axis::integer("Iteration"),
        y: Axis::log("Objective S (minimised)"),
        layers: vec![
            line(String::new(), Ink::Series(0), Stroke::Solid, &x, &y),
            Layer::Points { name: String::new(), ink: Ink::Series(0), x, y, error: Vec::new() },
        ],
    }
}

fn residuals(answers: &Answers, case: &Case, outcome: &ParameterEstimates, fitted: &CaseFit) -> Figure {
    let is_fitted = |seen: &&Observation| fitted.sensors.contains(&seen.sensor);
    let shown: Vec<&Observation> = case.observations.iter().filter(is_fitted).collect();
    let band = |name: String, ink: Ink, seen: &Observation| {
        let both: Vec<f64> = seen.sigma_k.iter().map(|sigma| 2.0 * sigma).collect();
        Layer::Band {
            name,
            ink,
            opacity: 0.2,
            x: thinned(&seen.times_s),
            low: thinned(&both).iter().map(|bound| -bound).collect(),
            high: thinned(&both),
        }
    };
    // One band if all sensors have the same standard deviations, else one for each.
    let mut layers: Vec<Layer> = match shown.first() {
        Some(first) if shown.iter().all(|seen| seen.sigma_k == first.sigma_k) => {
            vec![band("± 2 σ".to_owned(), Ink::Guide, first)]
        }
        _ => {
            let own = |seen: &&Observation| {
                band(format!("± 2 σ, {}", case.sensors[seen.sensor].name), Ink::Series(seen.sensor), seen)
            };
            shown.iter().map(own).collect()
        }
    };
    for (seen, (times_s, residuals_k)) in shown.iter().zip(&fitted.residuals) {
        let name = case.sensors[seen.sensor].name.clone();
        layers.push(line(name, Ink::Series(seen.sensor), Stroke::Solid, times_s, residuals_k));
    }
    Figure {
        id: if answers.other_cases.is_empty() { "residuals".to_owned() } else { file_name("residuals", &case.id) },
        title: if answers.other_cases.is_empty() {
            "Residuals".to_owned()
        } else {
            format!("Residuals of {}", case.id)
        },
        caption: format!(
            "Measurement less prediction in the data window. Lag-one autocorrelation {}; effective sample size {} of \
             {}.",
            format::significant(outcome.autocorrelation, 2),
            format::significant(outcome.effective_samples, 2),
            format::count(outcome.samples),
        ),
        x: time_axis(case).with_range(case.fit_window_s().0, case.fit_window_s().1),
        y: Axis::linear("Measurement less prediction, K"),
        layers,
    }
}
