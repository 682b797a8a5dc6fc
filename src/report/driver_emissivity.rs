//! The effect of the emissivity of a hot face that is held by the readings of a pyrometer.

use super::files::json::{JsonObject, OrderedMap};
use super::reportable::{Finding, Reportable, ScreenLimits};
use super::terminal::wrap;
use super::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::driver_emissivity::DriverEmissivity;
use serde::Serialize;

impl Reportable for DriverEmissivity {
    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        vec![Finding { label: "Pyrometer", text: text(answers, self) }]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        vec![
            "The hot face has the temperature at which it emits and reflects what the pyrometer read (Planck's law, a \
             grey, diffuse face). The prediction is repeated with its emissivity lower and higher by one standard \
             deviation. In a sweep, half the difference times a standard normal number is added to each member: \
             percentiles and margins include the effect to first order, shares of the variance, estimates, sizes and \
             profiles through the thickness do not."
                .to_owned(),
        ]
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        let change = |(change_k, time_s): (f64, f64)| ChangeRecord { change_k, time_s };
        let named = answers.case.sensors.iter().zip(&self.changes);
        let changes = named.map(|(sensor, &[low, high])| {
            (sensor.name.as_str(), SensorRecord { lower_emissivity: change(low), higher_emissivity: change(high) })
        });
        let record_of = EmissivityRecord {
            emissivity: self.driver.emissivity,
            emissivity_deviation: self.driver.emissivity_deviation,
            largest_changes: OrderedMap(changes.collect()),
        };
        record.put("driver_emissivity", &record_of)
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        wrap("", &text(answers, self))
    }
}

#[derive(Serialize)]
struct EmissivityRecord<'a> {
    emissivity: f64,
    emissivity_deviation: f64,
    largest_changes: OrderedMap<'a, SensorRecord>,
}

#[derive(Serialize)]
struct SensorRecord {
    lower_emissivity: ChangeRecord,
    higher_emissivity: ChangeRecord,
}

#[derive(Serialize)]
struct ChangeRecord {
    change_k: f64,
    time_s: f64,
}

fn text(answers: &Answers, outcome: &DriverEmissivity) -> String {
    let changes = answers.case.sensors.iter().zip(&outcome.changes).map(|(sensor, changes)| {
        let [low, high] = changes.map(|(change_k, _)| format::significant(change_k, 2));
        let (_, time_s) = if changes[0].0.abs() > changes[1].0.abs() { changes[0] } else { changes[1] };
        format!("{} {low} K and {high} K ({})", sensor.name, format::seconds(time_s))
    });
    let included = match answers.uncertainty {
        Some(_) => " The percentiles of the sweep include the effect.",
        None => "",
    };
    format!(
        "Hot face held by a pyrometer, emissivity of the face {} ± {}. Largest changes of the prediction with the \
         lower and the higher emissivity: {}.{included}",
        format::significant(outcome.driver.emissivity, 3),
        format::significant(outcome.driver.emissivity_deviation, 2),
        format::list(&changes.collect::<Vec<_>>())
    )
}
