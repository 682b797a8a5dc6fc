//! Profile likelihood of a factor.

use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{file_name, line};
use crate::report::format;
use crate::study::estimate::{ParameterEstimates, Profile};

pub(super) fn figures(outcome: &ParameterEstimates) -> Vec<Figure> {
    outcome.profiles.iter().map(|profile| figure(outcome, profile)).collect()
}

fn figure(outcome: &ParameterEstimates, profile: &Profile) -> Figure {
    let place = profile.factor;
    let estimand = &outcome.factors[place];
    let name = &estimand.factor.name;
    // Higher values would compress the interval in the chart.
    let is_near = |rise: f64| rise <= 4.0 * profile.level;
    let met = profile.points.iter().map(|point| point[place]).zip(profile.rises.iter().copied());
    let (x, y): (Vec<f64>, Vec<f64>) = met.filter(|(_, rise)| is_near(*rise)).unzip();
    let (first, last) = (x.first().copied().unwrap_or(0.0), x.last().copied().unwrap_or(1.0));
    // The half-width of the linear interval is the square root of the level times the standard error.
    let (low, high) = outcome.intervals[place];
    let error = (high - low) / (2.0 * profile.level.sqrt());
    let even: Vec<f64> = (0..=60).map(|step| first + (last - first) * f64::from(step) / 60.0).collect();
    let parabola = even.iter().map(|at| ((at - outcome.values[place]) / error).powi(2));
    let parabola: Vec<f64> = parabola.map(|rise| if is_near(rise) { rise } else { f64::NAN }).collect();
    let highest = y.iter().copied().fold(1.5 * profile.level, f64::max);
    let (below, above) = profile.interval;
    let (least, most) = estimand.bounds;
    let layers = vec![
        Layer::Interval { name: "95 % interval".to_owned(), from: below.unwrap_or(least), to: above.unwrap_or(most) },
        line("linear approximation".to_owned(), Ink::Guide, Stroke::Dashed, &even, &parabola),
        line("95 % level".to_owned(), Ink::Guide, Stroke::Dotted, &[first, last], &[profile.level; 2]),
        line("profile".to_owned(), Ink::Series(0), Stroke::Solid, &x, &y),
        Layer::Points { name: String::new(), ink: Ink::Series(0), x, y, error: Vec::new() },
    ];
    Figure {
        id: file_name("profile", name),
        title: format!("Profile likelihood of {name}"),
        caption: format!(
            "Rise of the objective above its minimum with {name} fixed at each value and all other factors estimated \
             again. The 95 % interval is where the rise is below {}: {}; the linear one (dashed parabola) is {}. The \
             objective is scaled by the variance and the autocorrelation of the residuals.",
            format::significant(profile.level, 3),
            format::profile_interval(profile.interval, estimand.bounds),
            format::interval(outcome.intervals[place], estimand.bounds)
        ),
        x: Axis::linear(name),
        y: Axis::linear("Rise of the scaled objective").with_range(0.0, highest),
        layers,
    }
}
