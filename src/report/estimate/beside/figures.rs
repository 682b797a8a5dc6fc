//! Two models fitted to the same observations, one figure per sensor.

use crate::case::{Case, Observation};
use crate::report::figure::{Figure, Ink, Layer, Stroke};
use crate::report::figures::{file_name, line, measured, temperature, time};
use crate::report::words;
use crate::study::beside::{Beside, Left};
use crate::study::estimate::Fitted;

pub(in crate::report::estimate) fn figures(case: &Case, first: &Fitted, outcome: &Beside) -> Vec<Figure> {
    let shown = case.observations.iter().zip(&outcome.left);
    shown.map(|(seen, left)| figure(case, first, outcome, seen, left)).collect()
}

fn figure(case: &Case, first: &Fitted, outcome: &Beside, seen: &Observation, left: &Left) -> Figure {
    let sensor = seen.sensor;
    let name = &case.sensors[sensor].name;
    let (without, with) = (&first.after, &outcome.estimated.fitted[0].after);
    let cooling = Layer::Window { name: "cool-down".to_owned(), from: outcome.cooling_s, to: case.exposure.duration_s };
    let layers = vec![
        cooling,
        line(case.id.clone(), Ink::Series(0), Stroke::Solid, &without.instants_s, &without.temperatures_k[sensor]),
        line(outcome.id.clone(), Ink::Series(1), Stroke::Solid, &with.instants_s, &with.temperatures_k[sensor]),
        measured("measured".to_owned(), Ink::Measured, seen),
    ];
    Figure {
        id: file_name("comparison", name),
        number: String::new(),
        title: format!("{name}: two models at their estimates"),
        caption: format!(
            "RMSE in cool-down: {} {}, {} {}.",
            case.id,
            words::misfit(left.cooling_k[0]),
            outcome.id,
            words::misfit(left.cooling_k[1])
        ),
        x: time(case),
        y: temperature(),
        layers,
    }
}
