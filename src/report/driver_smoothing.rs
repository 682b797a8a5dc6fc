//! The effect of smoothing the measured temperature of a held face.

use super::figure::{Figure, Ink, Layer, Stroke};
use super::figures::{line, temperature_axis, thinned, time_axis};
use super::files::json::{JsonObject, OrderedMap};
use super::reportable::{Finding, Reportable, ScreenLimits};
use super::terminal::wrap;
use super::{ReportError, format};
use crate::case::{Face, SmoothedDriver};
use crate::study::answers::Answers;
use crate::study::driver_smoothing::DriverSmoothing;
use serde::Serialize;

impl Reportable for DriverSmoothing {
    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        vec![Finding { label: "Driver", text: text(answers, self) }]
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        self.drivers.iter().filter_map(warning).collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        self.drivers.iter().map(|driver| ("case", figure(answers, self, driver))).collect()
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        vec![
            "The measured temperature of a held face is replaced by the cubic smoothing spline of least curvature \
             whose root mean square distance from the samples is the stated noise (Reinsch 1967), as a polygon \
             within 5 % of the noise. Its slope may jump where seven residuals in a row are off by six standard \
             deviations of their mean: steps of the data stay steps."
                .to_owned(),
        ]
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        let drivers: Vec<DriverRecord<'_>> = self.drivers.iter().map(DriverRecord::of).collect();
        let named = answers.case.sensors.iter().zip(&self.changes);
        let changes =
            named.map(|(sensor, &(change_k, time_s))| (sensor.name.as_str(), ChangeRecord { change_k, time_s }));
        let largest_changes = OrderedMap(changes.collect());
        record.put("driver_smoothing", &SmoothingRecord { drivers, largest_changes })
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        wrap("", &text(answers, self))
    }
}

#[derive(Serialize)]
struct SmoothingRecord<'a> {
    drivers: Vec<DriverRecord<'a>>,
    largest_changes: OrderedMap<'a, ChangeRecord>,
}

#[derive(Serialize)]
struct DriverRecord<'a> {
    face: &'static str,
    noise_k: f64,
    estimated_noise_k: Option<f64>,
    residual_k: f64,
    samples: usize,
    corners: usize,
    steps_s: &'a [f64],
}

#[derive(Serialize)]
struct ChangeRecord {
    change_k: f64,
    time_s: f64,
}

impl<'a> DriverRecord<'a> {
    fn of(driver: &'a SmoothedDriver) -> Self {
        let SmoothedDriver { noise_k, estimated_noise_k, residual_k, samples, corners, ref steps_s, .. } = *driver;
        Self { face: face(driver), noise_k, estimated_noise_k, residual_k, samples, corners, steps_s }
    }
}

fn face(driver: &SmoothedDriver) -> &'static str {
    if driver.is_hot_face { "hot face" } else { "back face" }
}

fn text(answers: &Answers, outcome: &DriverSmoothing) -> String {
    let drivers = outcome.drivers.iter().map(|driver| {
        let steps: Vec<String> = driver.steps_s.iter().map(|&time_s| format::seconds(time_s)).collect();
        let steps = if steps.is_empty() { String::new() } else { format!(", steps at {}", format::list(&steps)) };
        format!(
            "Driver of the {} smoothed within its noise of {}: {} in place of {}{steps}.",
            face(driver),
            format::temperature_difference(driver.noise_k),
            format::counted(driver.corners, "corner"),
            format::counted(driver.samples, "sample"),
        )
    });
    let changes = answers.case.sensors.iter().zip(&outcome.changes).map(|(sensor, &(change_k, time_s))| {
        format!("{} {} K at {}", sensor.name, format::significant(change_k, 2), format::seconds(time_s))
    });
    let (drivers, changes): (Vec<String>, Vec<String>) = (drivers.collect(), changes.collect());
    format!("{} Largest change of the prediction: {}.", drivers.join(" "), format::list(&changes))
}

/// A stated noise that the samples do not have.
fn warning(driver: &SmoothedDriver) -> Option<String> {
    /// The estimate of the noise is better than this factor, unless the noise is correlated from sample to sample.
    const FACTOR: f64 = 2.0;
    let found_k = driver.estimated_noise_k?;
    let effect = if driver.noise_k > FACTOR * found_k {
        "smoothing removes signal, too"
    } else if driver.noise_k < found_k / FACTOR {
        "most of the noise stays"
    } else {
        return None;
    };
    Some(format!(
        "The driver of the {} has a stated noise of {}, its samples have {}: {effect}.",
        face(driver),
        format::temperature_difference(driver.noise_k),
        format::temperature_difference(found_k)
    ))
}

fn figure(answers: &Answers, outcome: &DriverSmoothing, driver: &SmoothedDriver) -> Figure {
    let exposure = &answers.case.exposure;
    let held = if driver.is_hot_face { &exposure.hot_face } else { &exposure.back_face };
    let measured = &driver.measured;
    let mut layers = vec![Layer::Points {
        name: "measured".to_owned(),
        ink: Ink::Measured,
        x: thinned(measured.times_s()),
        y: thinned(measured.values()),
        error: Vec::new(),
    }];
    if let Face::Held(smooth) = held {
        layers.push(line("smoothed".to_owned(), Ink::Series(1), Stroke::Solid, smooth.times_s(), smooth.values()));
    }
    Figure {
        id: format!("driver-{}", face(driver).replace(' ', "-")),
        title: format!("Measured temperature of the {}, smoothed", face(driver)),
        caption: format!("{} At most about 1,000 samples are shown.", text(answers, outcome)),
        x: time_axis(&answers.case),
        y: temperature_axis(),
        layers,
    }
}
