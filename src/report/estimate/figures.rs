//! The fit, the iterations and the residuals.

mod profile;

use super::objective;
use crate::case::{Case, Observation};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{correlations, file_name, line, measured, temperature, thinned, time};
use crate::report::words;
use crate::report::words::sentence;
use crate::study::answers::Answers;
use crate::study::estimate::{Estimated, Fitted, Landscape, NODES};
use crate::study::nominal::Misfit;

pub(super) fn figures(answers: &Answers, outcome: &Estimated) -> Vec<Figure> {
    let (mut figures, mut validation) = (Vec::new(), Vec::new());
    for (case, fitted) in answers.fits(outcome) {
        for seen in &case.observations {
            let place = fitted.sensors.iter().position(|&sensor| sensor == seen.sensor);
            let list = if place.is_some() { &mut figures } else { &mut validation };
            list.push(fit(answers, case, fitted, seen, place.map(|place| &fitted.misfits[place])));
        }
    }
    figures.extend(outcome.landscape.as_ref().map(|landscape| design_space(outcome, landscape)));
    figures.extend(profile::figures(outcome));
    figures.push(descent(outcome));
    figures.extend(answers.fits(outcome).map(|(case, fitted)| residuals(answers, case, outcome, fitted)));
    if outcome.factors.len() > 1 {
        figures.push(correlations(
            "estimates",
            "Correlation of the estimates",
            format!(
                "Correlation of the errors of the estimates. Least determined direction: {}.",
                outcome.identifiability.weakest
            ),
            names(outcome),
            &outcome.identifiability.correlation,
        ));
    }
    figures.extend(validation);
    figures
}

fn names(outcome: &Estimated) -> Vec<String> {
    outcome.factors.iter().map(|factor| factor.factor.name.clone()).collect()
}

/// One sensor; `misfit` at the nominal and the estimated factors if it was fitted.
fn fit(
    answers: &Answers,
    case: &Case,
    fitted: &Fitted,
    seen: &Observation,
    misfit: Option<&(Misfit, Misfit)>,
) -> Figure {
    let sensor = seen.sensor;
    let name = &answers.sensor(case, sensor);
    let (from, to) = case.window_s(sensor);
    let (before, after) = (&fitted.before, &fitted.after);
    let mut layers: Vec<Layer> =
        misfit.map(|_| Layer::Window { name: "data window".to_owned(), from, to }).into_iter().collect();
    layers.extend([
        line("nominal".to_owned(), Ink::Guide, Stroke::Dashed, &before.instants_s, &before.temperatures_k[sensor]),
        line("estimated".to_owned(), Ink::Series(0), Stroke::Solid, &after.instants_s, &after.temperatures_k[sensor]),
        measured("measured".to_owned(), Ink::Measured, seen),
    ]);
    let text = match misfit {
        Some((before, after)) => format!(
            "RMSE from {} to {}: {} with the nominal factors, {} with the estimated ones.",
            words::seconds(from),
            words::seconds(to),
            words::misfit(before.rms_k),
            words::misfit(after.rms_k)
        ),
        None => format!("{name} was not fitted: its misfit is a validation of the estimate."),
    };
    Figure {
        id: file_name("fit", name),
        number: String::new(),
        title: format!("{name} with the nominal and the estimated factors"),
        caption: format!("{text} Error bars: two standard deviations of the measurement; samples are thinned."),
        x: time(case),
        y: temperature(),
        layers,
    }
}

fn design_space(outcome: &Estimated, landscape: &Landscape) -> Figure {
    let names = names(outcome);
    let axis = |index: usize| {
        let (low, high) = outcome.factors.get(index).map_or((0.0, 1.0), |factor| factor.bounds);
        Axis::linear(names.get(index).map_or("", String::as_str)).within(low, high)
    };
    let visited =
        |index: usize| -> Vec<f64> { outcome.path.iter().filter_map(|turn| turn.values.get(index).copied()).collect() };
    let (x, y) = (visited(0), visited(1));
    let last = |values: &[f64]| -> Vec<f64> { values.last().copied().into_iter().collect() };
    let layers = vec![
        Layer::Contours {
            name: "objective S".to_owned(),
            x: landscape.x.clone(),
            y: landscape.y.clone(),
            values: landscape.objective.clone(),
            levels: levels(&landscape.objective),
        },
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
    Figure {
        id: "design-space".to_owned(),
        number: String::new(),
        title: "Objective over the two factors, with the iterations".to_owned(),
        caption: format!(
            "Contours of the objective S, which has {} within the bounds. A long narrow valley means that the data \
             determine a combination of the two factors better than either factor. {} Residuals are interpolated with \
             their derivatives between {NODES} × {NODES} marched pairs of factors.",
            words::counted_as(minima, "minimum", "minima"),
            objective(outcome)
        ),
        x: axis(0),
        y: axis(1),
        layers,
    }
}

/// Twelve levels in equal ratios over at most four decades: without noise the minimum is a rounding error, and levels
/// down to it would crowd around one point.
fn levels(values: &[Vec<f64>]) -> Vec<f64> {
    let shown = || values.iter().flatten().copied().filter(|value| value.is_finite() && *value > 0.0);
    let high = shown().fold(0.0, f64::max);
    let low = shown().fold(f64::INFINITY, f64::min).max(1e-4 * high);
    if low >= high {
        return Vec::new();
    }
    // Without the extremes, where a contour is a point or a corner.
    (1..=12).map(|step| low * (high / low).powf(f64::from(step) / 13.0)).collect()
}

fn descent(outcome: &Estimated) -> Figure {
    let x: Vec<f64> = (0..outcome.path.len()).map(|turn| turn as f64).collect();
    let y: Vec<f64> = outcome.path.iter().map(|turn| turn.objective).collect();
    Figure {
        id: "objective".to_owned(),
        number: String::new(),
        title: "Objective by iteration".to_owned(),
        caption: format!(
            "S falls from {} to {} in {}. Termination: {}. {}",
            words::significant(outcome.objectives().0, 3),
            words::significant(outcome.objectives().1, 3),
            words::counted(outcome.path.len().saturating_sub(1), "iteration"),
            sentence(&outcome.termination),
            objective(outcome)
        ),
        x: Axis::whole("Iteration"),
        y: Axis::log("Objective S (minimised)"),
        layers: vec![
            line(String::new(), Ink::Series(0), Stroke::Solid, &x, &y),
            Layer::Points { name: String::new(), ink: Ink::Series(0), x, y, error: Vec::new() },
        ],
    }
}

fn residuals(answers: &Answers, case: &Case, outcome: &Estimated, fitted: &Fitted) -> Figure {
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
        id: if answers.others.is_empty() { "residuals".to_owned() } else { file_name("residuals", &case.id) },
        number: String::new(),
        title: if answers.others.is_empty() { "Residuals".to_owned() } else { format!("Residuals of {}", case.id) },
        caption: format!(
            "Measurement less prediction in the data window. Lag-one autocorrelation {}; effective sample size {} of \
             {}.",
            words::significant(outcome.autocorrelation, 2),
            words::significant(outcome.effective_samples, 2),
            words::count(outcome.samples),
        ),
        x: time(case).within(case.trusted_s().0, case.trusted_s().1),
        y: Axis::linear("Measurement less prediction, K"),
        layers,
    }
}
