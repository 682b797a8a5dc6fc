//! Coverage of the intervals, and errors of the estimates against the true factors.

use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{file_name, line};
use crate::report::{coverage_study, format};
use crate::study::coverage_study::{CoverageStudy, FactorCoverage};

pub(super) fn figures(outcome: &CoverageStudy) -> Vec<Figure> {
    let mut figures = vec![coverage(outcome)];
    figures.extend((0..outcome.factors.len()).map(|place| estimate_errors(outcome, place)));
    figures
}

fn coverage(outcome: &CoverageStudy) -> Figure {
    let factors = &outcome.factors;
    let limits: Vec<(f64, f64)> = factors.iter().map(|factor| factor.covered.interval_95()).collect();
    let lowest = limits.iter().map(|limits| limits.0).fold(0.9, f64::min);
    let bar = |name: &str, ink: Ink, place: usize, (low, high): (f64, f64)| {
        let at = place as f64;
        line(name.to_owned(), ink, Stroke::Solid, &[at, at], &[100.0 * low, 100.0 * high])
    };
    let ends = [-0.5, factors.len() as f64 - 0.5];
    let mut layers = vec![line("95 %".to_owned(), Ink::Guide, Stroke::Dashed, &ends, &[95.0; 2])];
    layers.extend(limits.iter().enumerate().map(|(place, &limits)| bar("", Ink::Series(0), place, limits)));
    layers.push(Layer::Points {
        name: "coverage".to_owned(),
        ink: Ink::Series(0),
        x: (0..factors.len()).map(|place| place as f64).collect(),
        y: factors.iter().map(|factor| 100.0 * factor.covered.fraction()).collect(),
        error: Vec::new(),
    });
    Figure {
        id: "coverage".to_owned(),
        title: "Coverage of the 95 % intervals".to_owned(),
        caption: format!("{} Bars: binomial 95 % intervals.", coverage_study::coverage(outcome)),
        x: Axis::categories("", factors.iter().map(|factor| factor.name.clone()).collect()),
        y: Axis::linear("Coverage, %").with_range(100.0 * lowest - 2.0, 100.0),
        layers,
    }
}

fn estimate_errors(outcome: &CoverageStudy, place: usize) -> Figure {
    let FactorCoverage { name, bias, bias_error, rms, .. } = &outcome.factors[place];
    let mut points = [(Vec::new(), Vec::new(), Vec::new()), (Vec::new(), Vec::new(), Vec::new())];
    for twin in &outcome.fits {
        let Some(found) = twin.outcome.result() else { continue };
        let ((low, high), truth) = (found.intervals[place], twin.truth[place]);
        let (x, y, error) = &mut points[usize::from(!(low..=high).contains(&truth))];
        x.push(truth);
        y.push(found.values[place] - truth);
        error.push((high - low) / 2.0);
    }
    let truths = || outcome.fits.iter().map(|twin| twin.truth[place]);
    let ends = [truths().fold(f64::INFINITY, f64::min), truths().fold(f64::NEG_INFINITY, f64::max)];
    let mut layers = vec![line(String::new(), Ink::Guide, Stroke::Dashed, &ends, &[0.0; 2])];
    let names = ["truth in interval", "truth not in interval"];
    for (((x, y, error), name), ink) in points.into_iter().zip(names).zip([Ink::Series(0), Ink::Series(1)]) {
        if !x.is_empty() {
            layers.push(Layer::Points { name: name.to_owned(), ink, x, y, error });
        }
    }
    Figure {
        id: file_name("estimates", name),
        title: format!("Errors of the estimates of {name}"),
        caption: format!(
            "Each point is a synthetic data set, with its 95 % interval. Bias {} (standard error {}), RMSE {}.",
            format::significant(*bias, 2),
            format::significant(*bias_error, 2),
            format::significant(*rms, 2)
        ),
        x: Axis::linear(&format!("True {name}")),
        y: Axis::linear("Estimate less true value"),
        layers,
    }
}
