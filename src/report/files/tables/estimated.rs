//! The tables of an estimate.

use super::super::super::ReportError;
use super::super::table::Table;
use super::head;
use crate::case::Case;
use crate::study::estimate::{Estimated, Fitted, Landscape};
use crate::study::posterior::{Posterior, Predicted};

pub(super) fn residuals(name: &str, case: &Case, fitted: &Fitted) -> Result<(String, Vec<u8>), ReportError> {
    let mut table = Table::new(name, ["sensor", "time_s", "residual_K"])?;
    for (&sensor, (times_s, residuals_k)) in fitted.sensors.iter().zip(&fitted.residuals) {
        for (&time_s, &residual_k) in times_s.iter().zip(residuals_k) {
            table.row(Some(&case.sensors[sensor].name), [time_s, residual_k])?;
        }
    }
    table.close()
}

pub(super) fn path(outcome: &Estimated) -> Result<(String, Vec<u8>), ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let columns = names.chain(["objective".to_owned(), "damping".to_owned()]);
    let mut table = Table::new("path.csv", head(&["iteration"], columns))?;
    for (iteration, turn) in outcome.path.iter().enumerate() {
        let values = turn.values.iter().copied().chain([turn.objective, turn.damping]);
        table.row(Some(&iteration.to_string()), values)?;
    }
    table.close()
}

pub(super) fn profiles(outcome: &Estimated) -> Result<(String, Vec<u8>), ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let mut table = Table::new("profiles.csv", head(&["held"], names.chain(["rise".to_owned()])))?;
    for profile in &outcome.profiles {
        for (point, &rise) in profile.points.iter().zip(&profile.rises) {
            let held = &outcome.factors[profile.factor].factor.name;
            table.row(Some(held), point.iter().copied().chain([rise]))?;
        }
    }
    table.close()
}

pub(super) fn plane(outcome: &Estimated, landscape: &Landscape) -> Result<(String, Vec<u8>), ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let columns = names.take(2).chain(["objective", "valley"].map(str::to_owned));
    let mut table = Table::new("landscape.csv", columns)?;
    for (line, objective) in landscape.objective.iter().enumerate() {
        for (node, &s) in objective.iter().enumerate() {
            let is_least = f64::from(u8::from(node == landscape.valley));
            table.row(None, [landscape.x[line][node], landscape.y[line][node], s, is_least])?;
        }
    }
    table.close()
}

pub(super) fn posterior(found: &Estimated, outcome: &Posterior) -> Result<(String, Vec<u8>), ReportError> {
    let names = found.factors.iter().map(|factor| factor.factor.name.clone());
    let mut table = Table::new("posterior.csv", names)?;
    for draw in &outcome.draws {
        table.row(None, draw.iter().copied())?;
    }
    table.close()
}

pub(super) fn predictive(name: &str, case: &Case, outcome: &Predicted) -> Result<(String, Vec<u8>), ReportError> {
    let columns = ["p2.5_K", "p50_K", "p97.5_K", "lacking_p2.5_K", "lacking_p50_K", "lacking_p97.5_K"];
    let mut table = Table::new(name, ["sensor", "time_s"].into_iter().chain(columns))?;
    for (sensor, found) in case.sensors.iter().zip(&outcome.sensors) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let of = [&found.parameters, &found.discrepancy];
            let curves = of.iter().flat_map(|band| [band.low_k[at], band.median_k[at], band.high_k[at]]);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(curves))?;
        }
    }
    table.close()
}
