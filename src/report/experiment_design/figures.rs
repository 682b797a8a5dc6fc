//! Information over depth and time, over depth, and standard errors over the number of thermocouples.

use super::{case_of, depths_text, errors_text, scenario_text};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::line;
use crate::report::format;
use crate::study::answers::Answers;
use crate::study::experiment_design::ExperimentDesign;

pub(super) fn figures(answers: &Answers, outcome: &ExperimentDesign) -> Vec<Figure> {
    vec![over_depth_and_time(answers, outcome), over_depth(answers, outcome), over_sensors(outcome)]
}

/// Depths of the candidates of the map, mm.
fn depths_mm(outcome: &ExperimentDesign) -> Vec<f64> {
    let candidates = &outcome.scenarios[0].candidates;
    outcome.map.candidates.iter().map(|&index| 1e3 * candidates[index].depth_m).collect()
}

/// Depths of the best design, mm.
fn chosen_mm(outcome: &ExperimentDesign) -> Vec<f64> {
    let best = &outcome.scenarios[0];
    best.designs[0].candidates.iter().map(|&index| 1e3 * best.candidates[index].depth_m).collect()
}

fn over_depth_and_time(answers: &Answers, outcome: &ExperimentDesign) -> Figure {
    let (map, noise_k, depths_mm) = (&outcome.map, outcome.request.noise.deviation_k, depths_mm(outcome));
    let information = |place: usize, instant: usize| {
        let squares = map.changes_k.iter().map(|by_depth| (by_depth[place][instant] / noise_k).powi(2));
        squares.sum::<f64>()
    };
    // Contours of more instants than pixels take time and show nothing.
    let stride = map.instants_s.len().div_ceil(200).max(1);
    let instants: Vec<usize> = (0..map.instants_s.len()).step_by(stride).collect();
    let rows = |each: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..depths_mm.len()).map(|place| instants.iter().map(|&instant| each(place, instant)).collect()).collect()
    };
    let values = rows(&information);
    let highest = values.iter().flatten().copied().fold(0.0, f64::max);
    let levels = (1..=10).rev().map(|step| highest * 2.0_f64.powi(-step)).collect();
    let end_s = outcome.scenarios[0].run_length_s;
    let mut layers = vec![Layer::Contours {
        name: "information of a sample".to_owned(),
        x: rows(&|_, instant| map.instants_s[instant]),
        y: rows(&|place, _| depths_mm[place]),
        values,
        levels,
    }];
    for (place, depth_mm) in chosen_mm(outcome).into_iter().enumerate() {
        let name = if place == 0 { "chosen depths" } else { "" };
        layers.push(line(name.to_owned(), Ink::Measured, Stroke::Dashed, &[0.0, end_s], &[depth_mm; 2]));
    }
    let case = case_of(answers, &outcome.scenarios[0]);
    let back_mm = 1e3 * case.layup.faces_m().last().copied().unwrap_or_default();
    Figure {
        id: "design-information".to_owned(),
        title: format!("Information over depth and time, {}", scenario_text(&outcome.scenarios[0])),
        caption: "Information of a sample at nominal factors: sum over the factors of the squared change of the \
                  temperature by one prior standard deviation, over the variance of a sample. Each contour is twice \
                  the next. Factors that change a reading alike are not told apart where it is high: the chosen depths \
                  balance both."
            .to_owned(),
        x: Axis::linear("Time, s").with_range(0.0, end_s),
        y: Axis::linear("Depth below the hot face, mm").with_range(0.0, back_mm),
        layers,
    }
}

fn over_depth(answers: &Answers, outcome: &ExperimentDesign) -> Figure {
    let (map, depths_mm) = (&outcome.map, depths_mm(outcome));
    let strength = |by_depth: &Vec<Vec<f64>>| -> Vec<f64> {
        let of = |trace_k: &Vec<f64>| trace_k.iter().map(|change_k| change_k * change_k).sum::<f64>().sqrt();
        by_depth.iter().map(|trace_k| of(trace_k) / outcome.request.noise.deviation_k).collect()
    };
    let curves: Vec<Vec<f64>> = map.changes_k.iter().map(strength).collect();
    let highest = curves.iter().flatten().copied().fold(0.0, f64::max);
    let mut layers: Vec<Layer> = (outcome.request.question.factors.iter().zip(&curves).enumerate())
        .map(|(place, (name, curve))| line(name.clone(), Ink::Series(place), Stroke::Solid, &depths_mm, curve))
        .collect();
    for (place, depth_mm) in chosen_mm(outcome).into_iter().enumerate() {
        let name = if place == 0 { "chosen depths" } else { "" };
        layers.push(line(name.to_owned(), Ink::Measured, Stroke::Dashed, &[depth_mm; 2], &[0.0, highest]));
    }
    let chosen = depths_text(answers, &outcome.scenarios[0], &outcome.scenarios[0].designs[0]);
    Figure {
        id: "design-depths".to_owned(),
        title: "Sensitivity of a thermocouple over its depth".to_owned(),
        caption: format!(
            "Root of the sum over the samples of the squared change by one prior standard deviation, over the standard \
             deviation of a sample, at nominal factors. Chosen: {}.",
            format::list(&chosen)
        ),
        x: Axis::linear("Depth below the hot face, mm"),
        y: Axis::linear("Change over noise").with_range(0.0, highest),
        layers,
    }
}

fn over_sensors(outcome: &ExperimentDesign) -> Figure {
    let growth = &outcome.scenarios[0].growth;
    let x: Vec<f64> = (1..=growth.len()).map(|count| count as f64).collect();
    let mut layers = Vec::new();
    for (place, (name, prior)) in outcome.request.question.factors.iter().zip(&outcome.prior_deviations).enumerate() {
        let y: Vec<f64> = growth.iter().map(|design| 100.0 * design.standard_errors[place] / prior).collect();
        layers.push(line(name.clone(), Ink::Series(place), Stroke::Solid, &x, &y));
        layers.push(Layer::Points { name: String::new(), ink: Ink::Series(place), x: x.clone(), y, error: Vec::new() });
    }
    Figure {
        id: "design-sensors".to_owned(),
        title: "Expected standard errors over the number of thermocouples".to_owned(),
        caption: format!(
            "In per cent of the prior standard deviation, for the best design of each number. With {}: {}.",
            format::counted(growth.len(), "thermocouple"),
            growth.last().map_or(String::new(), |design| errors_text(outcome, &design.standard_errors))
        ),
        x: Axis::integer("Thermocouples"),
        y: Axis::log("Standard error, % of the prior"),
        layers,
    }
}
