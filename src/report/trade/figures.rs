//! Mass of the lightest layups against the probability that the limit holds.

use super::tables::{masses_kg_m2, probabilities};
use super::{areal_mass, lightest, name};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::line;
use crate::report::format;
use crate::study::answers::Answers;
use crate::study::trade::{SizedLayup, Trade};

/// Most lines that a reader can tell apart.
const LINES: usize = 8;

/// `None` where no layup holds the limit at any of the probabilities: its axes would have no range.
pub(super) fn mass_over_probability(answers: &Answers, outcome: &Trade) -> Option<Figure> {
    let probabilities = probabilities(outcome.members);
    let exceeding: Vec<f64> = probabilities.iter().map(|probability| 100.0 * (1.0 - probability)).collect();
    // Layups of one rank have one line.
    let mut shown: Vec<&SizedLayup> = outcome.ranked().iter().collect();
    shown.dedup_by_key(|layup| layup.rank.map(|rank| rank.rank));
    shown.truncate(LINES);
    let curves: Vec<Vec<f64>> = shown
        .iter()
        .map(|layup| {
            masses_kg_m2(layup, &probabilities)
                .iter()
                .map(|mass| if mass.is_finite() { *mass } else { f64::NAN })
                .collect()
        })
        .collect();
    let finite = || curves.iter().flatten().copied().filter(|mass| mass.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    if !low.is_finite() {
        return None;
    }
    // Names of layups are too long for a legend.
    let rank = |layup: &SizedLayup| layup.rank.map_or(0, |rank| rank.rank);
    let label = |layup: &SizedLayup| format!("{}: {}", rank(layup), areal_mass(layup.required_mass_kg_m2()));
    let mut layers: Vec<Layer> = (shown.iter().zip(&curves).enumerate())
        .map(|(place, (layup, masses))| line(label(layup), Ink::Series(place), Stroke::Solid, &exceeding, masses))
        .collect();
    let names: Vec<String> = shown.iter().map(|layup| format!("{}: {}", rank(layup), name(outcome, layup))).collect();
    let required = 100.0 * (1.0 - outcome.request.requirement.probability);
    layers.push(line("required".to_owned(), Ink::Measured, Stroke::Dotted, &[required; 2], &[low, high]));
    let probability = format::percent_near_limits(outcome.request.requirement.probability);
    Some(Figure {
        id: "trade-mass".to_owned(),
        title: "Mass per area against the probability of exceeding the limit".to_owned(),
        caption: format!(
            "{} Lines: the {} of least mass for {probability}, one for each rank; where lines cross, another \
             probability has another order. {}.",
            lightest(answers, outcome),
            format::counted(shown.len(), "layup"),
            names.join("; ")
        ),
        x: Axis::log("Members above the limit, %"),
        y: Axis::linear("Mass, kg/m²"),
        layers,
    })
}
