//! The nominal prediction against measurements, and the boundary condition of the hot face.

use crate::case::{Case, Face, Schedule};
use crate::report::figure::{Axis, Figure, Ink, Layer, Stroke};
use crate::report::figures::{data_window, line, measured, temperature_axis, time_axis};
use crate::report::{format, observations};
use crate::study::nominal::Prediction;
use crate::traces::MemberStatus;

pub(super) fn against_measurement(case: &Case, nominal: &Prediction) -> Figure {
    let mut layers = data_windows(case);
    for (index, sensor) in case.sensors.iter().enumerate() {
        let name = format!("{} predicted", sensor.name);
        layers.push(line(name, Ink::Series(index), Stroke::Solid, &nominal.instants_s, &nominal.temperatures_k[index]));
    }
    for observation in &case.observations {
        let name = format!("{} measured", case.sensors[observation.sensor].name);
        layers.push(measured(name, Ink::Series(observation.sensor), observation));
    }
    let peaks: Vec<String> = case
        .sensors
        .iter()
        .zip(&nominal.peaks)
        .map(|(sensor, peak)| {
            format!(
                "{} peaks at {} at {}",
                sensor.name,
                format::kelvin(peak.temperature_k),
                format::seconds(peak.time_s)
            )
        })
        .collect();
    let has_values = nominal.status == MemberStatus::Completed;
    let peaks = if has_values { format::list(&peaks) } else { "The march failed: it has no values".to_owned() };
    let compared = if case.observations.is_empty() {
        "The case has no observations."
    } else {
        "Dots: measurements with error bars of two standard deviations, thinned."
    };
    let windows_of_sensors = case.observations.iter().filter_map(|seen| {
        let window = observations::window_text(seen.window_s?);
        Some(format!(" {} is used {window}.", case.sensors[seen.sensor].name))
    });
    let windows_of_sensors: String = windows_of_sensors.collect();
    Figure {
        id: "nominal".to_owned(),
        title: "Nominal prediction".to_owned(),
        caption: format!("{peaks}. {compared}{windows_of_sensors}"),
        x: time_axis(case),
        y: temperature_axis(),
        layers,
    }
}

/// The common data window and those of single sensors, unless they are the whole exposure.
fn data_windows(case: &Case) -> Vec<Layer> {
    let (single, common): (Vec<_>, Vec<_>) = case.observations.iter().partition(|seen| seen.window_s.is_some());
    let of_all = common.first().and_then(|seen| data_window(case, seen.sensor, "data window"));
    let single = single.into_iter().filter_map(|seen| {
        let name = &case.sensors[seen.sensor].name;
        data_window(case, seen.sensor, &format!("{name} data window"))
    });
    of_all.into_iter().chain(single).collect()
}

/// The prescribed heat flux or temperature at the hot face, where it changes with time.
pub(super) fn hot_face(case: &Case) -> Option<Figure> {
    let (schedule, name, axis, scale) = match &case.exposure.hot_face {
        Face::Open(face) if varies(&face.flux_w_m2) => {
            (&face.flux_w_m2, "cold-wall heat flux", "Heat flux, W/cm²", 1e-4)
        }
        Face::Open(face) if varies(&face.radiant_w_m2) => {
            (&face.radiant_w_m2, "radiant heat flux", "Heat flux, W/cm²", 1e-4)
        }
        Face::Open(face) if varies(&face.gas_k) => (&face.gas_k, "gas temperature", "Temperature, K", 1.0),
        Face::Held(schedule) => (schedule, "held temperature", "Temperature, K", 1.0),
        Face::Open(_) => return None,
    };
    let duration_s = case.exposure.duration_s;
    let corners = schedule.times_s.iter().zip(&schedule.values).filter(|(time, _)| (0.0..duration_s).contains(*time));
    let mut x = vec![0.0];
    let mut y = vec![scale * schedule.before(0.0)];
    for (&time_s, &value) in corners {
        x.push(time_s);
        y.push(scale * value);
    }
    x.push(duration_s);
    y.push(scale * schedule.before(duration_s));
    Some(Figure {
        id: "hot-face".to_owned(),
        title: "Boundary condition at the hot face".to_owned(),
        caption: format!("The {name} that the case prescribes at the hot face."),
        x: time_axis(case),
        y: Axis::linear(axis),
        layers: vec![line(String::new(), Ink::Series(1), Stroke::Solid, &x, &y)],
    })
}

fn varies(schedule: &Schedule) -> bool {
    schedule.values.windows(2).any(|pair| pair[0] != pair[1])
}
