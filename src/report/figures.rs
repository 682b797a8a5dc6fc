//! All figures of a report, and functions that several results share.

use super::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::case::{Case, Observation};
use crate::study::answers::Answers;

/// A temperature that changes less than this over the exposure is constant, K.
pub(super) const CONSTANT_K: f64 = 1e-6;

/// Every figure, with a unique file name, and the anchor of its section.
pub(super) fn in_sections(answers: &Answers) -> Vec<(&'static str, Figure)> {
    let each = answers.results().into_iter();
    let mut figures: Vec<(&'static str, Figure)> = each.flat_map(|answer| answer.figures(answers)).collect();
    make_ids_unique(&mut figures);
    figures
}

/// Make file names unique: sensors `T/1` and `T-1` would share one. Later figures get a number.
fn make_ids_unique(figures: &mut [(&'static str, Figure)]) {
    for later in 1..figures.len() {
        let (before, rest) = figures.split_at_mut(later);
        let requested = rest[0].1.id.clone();
        let mut number = 2;
        while before.iter().any(|(_, figure)| figure.id == rest[0].1.id) {
            rest[0].1.id = format!("{requested}-{number}");
            number += 1;
        }
    }
}

/// A portable file name: the kind of figure, then its subject.
pub(super) fn file_name(what: &str, of: &str) -> String {
    let safe = |c: char| if c.is_alphanumeric() || c == '_' || c == '.' { c } else { '-' };
    format!("{what}-{}", of.chars().map(safe).collect::<String>())
}

/// Time axis over the whole exposure.
pub(super) fn time_axis(case: &Case) -> Axis {
    Axis::linear("Time, s").with_range(0.0, case.exposure.duration_s)
}

pub(super) fn temperature_axis() -> Axis {
    Axis::linear("Temperature, K")
}

/// A curve, thinned.
pub(super) fn line(name: String, ink: Ink, stroke: Stroke, x: &[f64], y: &[f64]) -> Layer {
    Layer::Line { name, ink, stroke, x: thinned(x), y: thinned(y) }
}

/// A measured trace with error bars of two standard deviations, thinned to at most sixty points.
pub(super) fn measured(name: String, ink: Ink, observation: &Observation) -> Layer {
    let stride = observation.times_s.len().div_ceil(60).max(1);
    let pick = |values: &[f64], factor: f64| values.iter().step_by(stride).map(|value| factor * value).collect();
    Layer::Points {
        name,
        ink,
        x: pick(&observation.times_s, 1.0),
        y: pick(&observation.temperatures_k, 1.0),
        error: pick(&observation.sigma_k, 2.0),
    }
}

/// The data window of a sensor, unless it is the whole exposure.
pub(super) fn data_window(case: &Case, sensor: usize, name: &str) -> Option<Layer> {
    let (from, to) = case.window_s(sensor);
    let is_part = from > 0.0 || to < case.exposure.duration_s;
    is_part.then(|| Layer::Interval { name: name.to_owned(), from, to })
}

/// At most a thousand evenly spaced points of a curve, and the last one: a screen resolves no more.
pub(super) fn thinned(values: &[f64]) -> Vec<f64> {
    let stride = values.len().div_ceil(1000).max(1);
    let last = values.len().saturating_sub(1);
    let is_picked = |index: &usize| index.is_multiple_of(stride) || *index == last;
    (0..values.len()).filter(is_picked).map(|index| values[index]).collect()
}

/// A correlation matrix of factors.
pub(super) fn correlation_matrix(
    id: &str,
    title: &str,
    caption: String,
    names: Vec<String>,
    values: &[Vec<f64>],
) -> Figure {
    Figure {
        id: id.to_owned(),
        title: title.to_owned(),
        caption,
        x: Axis::categories("", names.clone()),
        y: Axis::categories("", names),
        layers: vec![Layer::Heatmap { values: values.to_vec() }],
    }
}

/// Every figure, for tests.
#[cfg(test)]
pub(super) fn all(answers: &Answers) -> Vec<Figure> {
    in_sections(answers).into_iter().map(|(_, figure)| figure).collect()
}

#[cfg(test)]
mod tests {
    use super::super::marched;
    use super::*;

    #[test]
    fn sensors_whose_names_differ_only_in_a_slash_have_two_files() {
        let mut outcomes = marched::study();
        outcomes.case.sensors[0].name = "T/1".to_owned();
        outcomes.case.sensors[1].name = "T-1".to_owned();
        let mut ids: Vec<String> = all(&outcomes.answers("study")).into_iter().map(|figure| figure.id).collect();
        assert!(ids.iter().all(|id| !id.contains('/')));
        let before = ids.len();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), before);
    }

    #[test]
    fn a_sensor_of_constant_temperature_has_no_figures() {
        let mut outcomes = marched::study();
        let ids = |outcomes: &marched::Study| -> Vec<String> {
            all(&outcomes.answers("study")).into_iter().map(|figure| figure.id).collect()
        };
        let of_it = ["spread-TC1", "shares-TC1", "sensitivity-TC1"];
        assert!(of_it.iter().all(|id| ids(&outcomes).iter().any(|found| found == id)));
        outcomes.uncertainty.spreads[0].deviation_k.fill(0.0);
        outcomes.sensitivity.derivatives_k.iter_mut().for_each(|of_factor| of_factor[0].fill(0.0));
        assert!(of_it.iter().all(|id| ids(&outcomes).iter().all(|found| found != id)));
    }

    #[test]
    fn thinning_keeps_both_end_points_of_a_curve() {
        let curve: Vec<f64> = (0..2500).map(f64::from).collect();
        let thin = thinned(&curve);
        assert!(thin.len() <= 1001);
        assert_eq!((thin[0], thin[thin.len() - 1]), (0.0, 2499.0));
    }
}
