//! Two models fitted to the same observations, one figure per sensor.

use crate::case::{Case, Observation};
use crate::report::figure::{Figure, Ink, Layer, Stroke};
use crate::report::figures::{file_name, line, measured, temperature_axis, time_axis};
use crate::report::format;
use crate::study::estimate::CaseFit;
use crate::study::model_comparison::{ModelComparison, SensorResiduals};

pub(in crate::report::estimate) fn figures(case: &Case, first: &CaseFit, outcome: &ModelComparison) -> Vec<Figure> {
    let shown = case.observations.iter().zip(&outcome.residuals);
    shown.map(|(seen, left)| figure(case, first, outcome, seen, left)).collect()
}

fn figure(
    case: &Case,
    first: &CaseFit,
    outcome: &ModelComparison,
    seen: &Observation,
    left: &SensorResiduals,
) -> Figure {
    let sensor = seen.sensor;
    let name = &case.sensors[sensor].name;
    let (without, with) = (&first.after, &outcome.estimated.fitted[0].after);
    let cooling =
        Layer::Interval { name: "cool-down".to_owned(), from: outcome.cooling_start_s, to: case.exposure.duration_s };
    let layers = vec![
        cooling,
        line(case.id.clone(), Ink::Series(0), Stroke::Solid, &without.instants_s, &without.temperatures_k[sensor]),
        line(outcome.id.clone(), Ink::Series(1), Stroke::Solid, &with.instants_s, &with.temperatures_k[sensor]),
        measured("measured".to_owned(), Ink::Measured, seen),
    ];
    Figure {
        id: file_name("comparison", name),
        title: format!("{name}: two models at their estimates"),
        caption: format!(
            "RMSE in cool-down: {} {}, {} {}.",
            case.id,
            format::temperature_difference(left.cooling_k[0]),
            outcome.id,
            format::temperature_difference(left.cooling_k[1])
        ),
        x: time_axis(case),
        y: temperature_axis(),
        layers,
    }
}
