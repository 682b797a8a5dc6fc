//! The prediction with nominal factors.

mod figures;
mod gas;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, TableDescription};
use super::html::table::{paragraph, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, shown_sensors, wrap};
use super::{ReportError, format, margins, observations, uncertainty, warnings};
use crate::study::answers::Answers;
use crate::study::nominal::{Misfit, Prediction};

impl Reportable for Prediction {
    fn nominal(&self) -> Option<&Prediction> {
        Some(self)
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let gas = gas::finding(&answers.case, self).map(|text| Finding { label: "Gas", text });
        margins::finding(answers, self).into_iter().chain(gas).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        let mut warnings = warnings::march_warnings(&answers.case, self, "nominal");
        warnings.extend(margins::warnings(answers, self));
        warnings
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let case = &answers.case;
        let gas = gas::figures::figures(case, self).into_iter().map(|figure| ("gas", figure));
        let driver = figures::hot_face(case).map(|figure| ("case", figure));
        [("nominal", figures::against_measurement(case, self))].into_iter().chain(driver).chain(gas).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        let gas = if gas::decomposes(&answers.case) { "Decomposition and gas" } else { "Gas" };
        vec![
            Section::new("margins", "Margins", margins::page(answers, self)),
            Section::new("nominal", "Nominal", page(answers, self)),
            // These charts have no table: the caption, which has the numbers, comes first.
            Section { captions_above: true, ..Section::new("gas", gas, String::new()) },
        ]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![margins::parts_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        Ok(margins::csv(answers, self)?.into_iter().collect())
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        margins::write_summary(answers, self, record)
    }

    fn screen(&self, answers: &Answers, room: &ScreenLimits) -> Vec<String> {
        let gas = gas::finding(&answers.case, self).map_or(Vec::new(), |text| wrap("", &text));
        if room.has_leading_result {
            return gas;
        }
        let used = if room.is_shared { gas.len().min(2) } else { 0 };
        let sensors = room.sensors.saturating_sub(used).max(1);
        let mut lines = match &answers.uncertainty {
            Some(outcome) => uncertainty::lines(answers, outcome, sensors, room),
            None => table_on_screen(answers, self, sensors),
        };
        lines.extend(margins::lines(answers, self));
        lines.extend(gas);
        lines
    }
}

fn page(answers: &Answers, outcome: &Prediction) -> String {
    let rows: Vec<Vec<String>> = (answers.case.sensors.iter().zip(&outcome.peaks))
        .map(|(sensor, peak)| {
            vec![
                sensor.name.clone(),
                format!("{:.2}", 1e3 * sensor.depth_m),
                format::grouped(peak.temperature_k, 1),
                format::grouped(peak.temperature_k - 273.15, 1),
                format::grouped(peak.time_s, 1),
            ]
        })
        .collect();
    let misfits: Vec<Vec<String>> = answers
        .case
        .observations
        .iter()
        .zip(&outcome.misfits)
        .map(|(seen, misfit)| {
            let mut row = vec![answers.case.sensors[seen.sensor].name.clone()];
            row.extend(misfit_cells(misfit));
            row
        })
        .collect();
    let balance = outcome.balance;
    let heat = |joules: f64| format!("{:.3}", 1e-6 * joules);
    let balances = vec![vec![
        "energy".to_owned(),
        heat(balance.hot_in_j_m2),
        heat(balance.hot_out_j_m2),
        heat(balance.back_in_j_m2),
        heat(balance.back_out_j_m2),
        heat(balance.holder_in_j_m2),
        heat(balance.holder_out_j_m2),
        heat(balance.stored_j_m2),
        format::significant(balance.residual(), 2),
    ]];
    table("Peaks", &["Sensor", "Depth, mm", "Peak, K", "Peak, °C", "Time of peak, s"], &rows)
        + &table("Prediction less measurement in the data window", &MISFIT_HEAD, &misfits)
        + &table(
            "Energy balance, MJ/m²",
            &[
                "Balance",
                "In, hot face",
                "Out, hot face",
                "In, back face",
                "Out, back face",
                "In, holder",
                "Out, holder",
                "Stored",
                "Relative residual",
            ],
            &balances,
        )
        + &if outcome.gauge_traces.is_empty() { String::new() } else { paragraph(&gas::mass_balance(&balance)) }
}

/// Columns of a table of misfits: the name of the row, then those of [`misfit_cells`].
pub(super) const MISFIT_HEAD: [&str; 6] =
    ["Sensor", "RMSE, K", "Mean error, K", "Largest error, K", "Time of it, s", "Samples"];

/// Root mean square, mean and largest error of a prediction, time of the latter, and number of samples.
pub(super) fn misfit_cells(misfit: &Misfit) -> [String; 5] {
    [
        format::temperature_difference(misfit.rms_k).replace(" K", ""),
        format::signed(misfit.bias_k, 1),
        format::signed(misfit.worst_k, 1),
        format::grouped(misfit.worst_time_s, 1),
        format::count(misfit.samples),
    ]
}

fn table_on_screen(answers: &Answers, outcome: &Prediction, most: usize) -> Vec<String> {
    let mut rows = vec![head(["sensor", "peak", "time", "RMSE", "mean error"])];
    let (sensors, others) = shown_sensors(answers, most);
    for index in sensors {
        let peak = outcome.peaks[index];
        let (rms, bias) = observations::misfit_text(answers, outcome, index);
        let name = format::truncate(&answers.case.sensors[index].name, 11);
        rows.push([name, format::kelvin(peak.temperature_k), format::seconds(peak.time_s), rms, bias]);
    }
    let name = Column::Left { gap: 0, width: 12 };
    let mut lines = aligned([name, Column::Right(22), Column::Right(10), Column::Right(14), Column::Right(14)], &rows);
    lines.extend(others);
    lines
}
