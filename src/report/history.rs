//! Inverse heat conduction: the heating of the hot face from thermocouples.

mod figures;
mod record;

use super::estimate::tables::residuals_table;
use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{list, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::wrap;
use super::warnings::accuracy_warnings;
use super::{ReportError, format};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::flux_inversion::{FluxInversion, HeatingQuantity};

impl Reportable for FluxInversion {
    fn comes_first(&self) -> bool {
        true
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        vec![
            Finding { label: "Heating", text: finding(answers, self) },
            Finding { label: "Regularisation", text: regularisation(self) },
        ]
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        history_warnings(answers, self)
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(answers, self).into_iter().map(|figure| ("history", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("history", "Heating", page(answers, self))]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![schedule_table().description(), band_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        history_tables(&answers.case, self)
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("history", &record::HistoryRecord::of(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        on_screen(answers, self)
    }
}

/// Name and unit of the estimated quantity.
struct QuantityFormat {
    /// `Cold-wall heat flux at the hot face`.
    pub title: &'static str,
    pub noun: &'static str,
    pub unit: &'static str,
    /// Factor from SI to `unit`.
    pub scale: f64,
    digits: usize,
}

fn quantity_format(quantity: HeatingQuantity) -> QuantityFormat {
    let flux = |title, noun| QuantityFormat { title, noun, unit: "W/cm²", scale: 1e-4, digits: 3 };
    match quantity {
        HeatingQuantity::Flux => flux("Cold-wall heat flux at the hot face", "flux"),
        HeatingQuantity::RadiantFlux => flux("Incident radiant flux at the hot face", "radiant flux"),
        HeatingQuantity::Gas => {
            let title = "Temperature of the gas at the hot face";
            QuantityFormat { title, noun: "gas temperature", unit: "K", scale: 1.0, digits: 4 }
        }
    }
}

impl QuantityFormat {
    fn value(&self, value: f64) -> String {
        format::significant(value * self.scale, self.digits)
    }

    fn with_unit(&self, value: f64) -> String {
        format!("{} {}", self.value(value), self.unit)
    }

    fn width(&self, value: f64) -> String {
        format::significant(value * self.scale, 3)
    }
}

/// Head of the table of knots.
fn table_head(outcome: &FluxInversion) -> [&'static str; 4] {
    let value = match outcome.quantity {
        HeatingQuantity::Flux | HeatingQuantity::RadiantFlux => "Flux, W/cm²",
        HeatingQuantity::Gas => "Gas, K",
    };
    ["Time, s", value, "± 95 %", "Stated in the case"]
}

/// Rows of the table of knots, at most `most`, evenly spaced.
fn table_rows(outcome: &FluxInversion, most: usize) -> Vec<[String; 4]> {
    let last = outcome.times_s.len() - 1;
    let rows = most.min(last + 1);
    let picked = (0..rows).map(|row| row * last / (rows - 1));
    let unit = quantity_format(outcome.quantity);
    let cells = |knot: usize| {
        let half =
            if outcome.undetermined[knot] { "unknown".to_owned() } else { unit.width(outcome.half_widths[knot]) };
        let time_s = format::trim_zeros(format::grouped(outcome.times_s[knot], 2));
        [time_s, unit.value(outcome.values[knot]), half, unit.value(outcome.case_values[knot])]
    };
    picked.map(cells).collect()
}

/// A row on the screen.
fn screen_row(cells: &[impl AsRef<str>; 4]) -> String {
    let [time, value, half, stated] = cells.each_ref().map(AsRef::as_ref);
    format!("{time:>9}{value:>14}{half:>10}{stated:>21}")
}

/// Times of the knots that the data do not determine.
fn undetermined_times(outcome: &FluxInversion) -> Vec<String> {
    let knots = (0..outcome.times_s.len()).filter(|&knot| outcome.undetermined[knot]);
    knots.map(|knot| format::seconds(outcome.times_s[knot])).collect()
}

/// The finding: fluence or mean gas temperature with its 95 % interval, the peak, and the difference from the case.
fn finding(answers: &Answers, outcome: &FluxInversion) -> String {
    let unit = quantity_format(outcome.quantity);
    let sensors: Vec<&str> =
        outcome.sensor_fits.iter().map(|seen| answers.case.sensors[seen.sensor].name.as_str()).collect();
    let (peak, at_s) = outcome
        .values
        .iter()
        .zip(&outcome.times_s)
        .fold((0.0, 0.0), |peak, (&value, &time_s)| if value > peak.0 { (value, time_s) } else { peak });
    let (sensors, during) = (format::list(&sensors), format::seconds(outcome.end_s));
    let (found, half, stated) = (outcome.integral, outcome.integral_half_width, outcome.case_integral);
    let left_out = match &undetermined_times(outcome)[..] {
        [] => String::new(),
        knots => format!("; the uncertainty of the undetermined {} at {} is excluded", unit.noun, format::list(knots)),
    };
    let highest = format!("peak {} at {}", unit.with_unit(peak), format::seconds(at_s));
    if outcome.quantity == HeatingQuantity::Gas {
        let mean = |integral: f64| integral / outcome.end_s;
        let less = mean(found) - mean(stated);
        return format!(
            "From {sensors}: mean gas temperature {} ± {} K (95 %{left_out}) over {during}, {} K {} than the case \
             states; peak {} K at {}.",
            unit.value(mean(found)),
            format::significant(mean(half), 2),
            format::significant(less.abs(), 2),
            if less < 0.0 { "less" } else { "more" },
            unit.value(peak),
            format::seconds(at_s)
        );
    }
    let difference = if stated > 0.0 {
        let more = found / stated - 1.0;
        let way = if more < 0.0 { "less" } else { "more" };
        format!(", {} % {way} than the case states", format::significant(100.0 * more.abs(), 2))
    } else {
        String::new()
    };
    let fluence = if outcome.quantity == HeatingQuantity::RadiantFlux { "radiant fluence" } else { "fluence" };
    format!(
        "From {sensors}: {fluence} {} ± {} MJ/m² (95 %{left_out}) in {during}{difference}; {highest}.",
        format::significant(1e-6 * found, 3),
        format::significant(1e-6 * half, 2),
    )
}

/// The regularisation, how its weight was chosen, and the noise.
fn regularisation(outcome: &FluxInversion) -> String {
    let why = if outcome.weight_is_stated { "as stated" } else { "of least expected error, by restricted likelihood" };
    format!(
        "Regularisation weight {why}. The data determine {} of {} knots (effective degrees of freedom). Noise: {} of \
         the stated standard deviation, {}.",
        format::significant(outcome.degrees_of_freedom, 2),
        format::count(outcome.times_s.len()),
        format::significant(outcome.noise_variance.sqrt(), 2),
        format::noise_correlation(outcome.correlation_time_s, outcome.white_share)
    )
}

/// Explanation of the 95 % band and of the errors that it includes.
fn band_explanation() -> &'static str {
    "The 95 % band holds the true history at 95 % of the knots on average, at fewer beside sudden changes. It includes \
     noise, regularisation bias and discretisation error, not errors of properties, depths and physics."
}

/// The discretisation error with the heating found.
fn discretisation(outcome: &FluxInversion) -> Option<String> {
    let error_k = outcome.discretisation_error_k?;
    let of_integral = match outcome.quantity {
        HeatingQuantity::Flux | HeatingQuantity::RadiantFlux => {
            format!(
                "{} MJ/m² of the fluence",
                format::significant(1e-6 * outcome.integral_discretisation_error.abs(), 2)
            )
        }
        HeatingQuantity::Gas => format!(
            "{} K of the mean gas temperature",
            format::significant((outcome.integral_discretisation_error / outcome.end_s).abs(), 2)
        ),
    };
    Some(format!("Discretisation error with this heating: {} K, {of_integral}.", format::significant(error_k, 2)))
}

/// Warnings of data that no heating explains, of knots held at zero, and of the accuracy of the result.
fn history_warnings(answers: &Answers, outcome: &FluxInversion) -> Vec<String> {
    let mut warnings = Vec::new();
    if outcome.exceeds_stated_noise() {
        warnings.push(format!(
            "No heating history fits the data within their noise (residuals of {} stated standard deviations): the \
             noise is larger than stated (`observations.sigma` of the case), or the model is incomplete and the \
             estimated heating compensates for it.",
            format::significant(outcome.weighted_rms, 3)
        ));
    }
    if outcome.knots_below_zero > 0 {
        let knots = format!("{} of {} knots", outcome.knots_below_zero, outcome.times_s.len());
        warnings.push(match outcome.quantity {
            HeatingQuantity::Flux => format!(
                "The flux is held at zero at {knots}, where a negative one would fit the data better: the face may be \
                 cooled. A negative value in the flux of the case allows it."
            ),
            HeatingQuantity::RadiantFlux | HeatingQuantity::Gas => format!(
                "The {} is held at zero at {knots}, where a negative one would fit the data better: the model lacks a \
                 heat loss of the face.",
                quantity_format(outcome.quantity).noun
            ),
        });
    }
    let tolerance_k = answers.case.resolution.tolerance_k;
    if let (Some(error_k), Some(tolerance_k)) = (outcome.discretisation_error_k, tolerance_k)
        && outcome.exceeds_tolerance(tolerance_k)
    {
        warnings.push(format!(
            "The discretisation error with the heating found is {} K, above the tolerance of {} K.",
            format::significant(error_k, 2),
            format::significant(tolerance_k, 2)
        ));
    }
    warnings.extend(accuracy_warnings(None, &outcome.balance, "march with the heating found"));
    if !outcome.converged {
        warnings.push(format!("The estimation of the history did not converge: {}.", outcome.termination));
    }
    let unit = quantity_format(outcome.quantity);
    let open = undetermined_times(outcome);
    if !open.is_empty() {
        warnings.push(format!(
            "The data do not determine the {} at {}: its interval is wider than twice the largest estimate, or the \
             temperatures do not depend on it (as with a small flux under blowing). Integral and mean take these \
             values as exact.",
            unit.noun,
            format::list(&open)
        ));
    }
    if outcome.end_s < answers.case.exposure.duration_s {
        warnings.push(format!(
            "After the end of the window, {}, nothing is estimated: history.csv continues with the values of the case.",
            format::seconds(outcome.end_s)
        ));
    }
    warnings
}

fn page(answers: &Answers, outcome: &FluxInversion) -> String {
    let rows: Vec<Vec<String>> = table_rows(outcome, usize::MAX).into_iter().map(Vec::from).collect();
    let fits: Vec<Vec<String>> = outcome
        .sensor_fits
        .iter()
        .map(|seen| {
            let [stated, found] = [seen.rms_k.0, seen.rms_k.1].map(|rms_k| format::significant(rms_k, 3));
            vec![answers.case.sensors[seen.sensor].name.clone(), format::count(seen.times_s.len()), stated, found]
        })
        .collect();
    let columns = ["Sensor", "Samples", "RMSE, stated heating, K", "RMSE, estimated heating, K"];
    list(&sentences(answers, outcome))
        + &table(&format!("{} at the knots", quantity_format(outcome.quantity).title), &table_head(outcome), &rows)
        + &table("Measurement less prediction", &columns, &fits)
}

/// The finding and how it was obtained.
fn sentences(answers: &Answers, outcome: &FluxInversion) -> Vec<String> {
    let first = [finding(answers, outcome), regularisation(outcome)].into_iter();
    first.chain(discretisation(outcome)).chain([band_explanation().to_owned()]).collect()
}

fn on_screen(answers: &Answers, outcome: &FluxInversion) -> Vec<String> {
    let mut lines = vec![screen_row(&table_head(outcome))];
    lines.extend(table_rows(outcome, 8).iter().map(screen_row));
    lines.extend(sentences(answers, outcome).iter().flat_map(|text| wrap("", text)));
    lines
}

/// Time and value of the recovered schedule.
fn schedule_table() -> Table<(f64, f64)> {
    Table::<(f64, f64)>::new(
        &["history.csv"],
        "The recovered heating (`history`), a schedule that a case file can read. One of the last three columns \
         exists.",
    )
    .number("time_s", "s", "Time.", |row| row.0)
    .number("flux_w_m2", "W/m²", "Cold-wall heat flux.", |row| row.1)
    .number("radiant_flux_w_m2", "W/m²", "Incident radiant flux.", |row| row.1)
    .number("gas_k", "K", "Gas temperature.", |row| row.1)
}

/// A knot.
type KnotRow<'a> = (&'a FluxInversion, usize);

fn band_table<'a>() -> Table<KnotRow<'a>> {
    fn interval((outcome, knot): &KnotRow<'_>) -> Vec<f64> {
        let (value, half) = (outcome.values[*knot], outcome.half_widths[*knot]);
        vec![(value - half).max(outcome.least_value), value + half]
    }
    Table::<KnotRow<'a>>::new(
        &["history-band.csv"],
        "One row per knot (`history`), with the columns of the recovered quantity. The interval is one for the true \
         value: \
         it has noise, regularisation bias and discretisation error. Of all knots of a history 95 % are held \
         on average, \
         of those beside sudden changes fewer ([theory](../theory/inference.md)).",
    )
    .number("time_s", "s", "Time.", |row| row.0.times_s[row.1])
    .number("flux_w_m2", "W/m²", "Cold-wall heat flux.", |row| row.0.values[row.1])
    .number("radiant_flux_w_m2", "W/m²", "Incident radiant flux.", |row| row.0.values[row.1])
    .number("gas_k", "K", "Gas temperature.", |row| row.0.values[row.1])
    .numbers("{low,high}_w_m2", "W/m²", "Its 95 % interval.", interval)
    .numbers("{low,high}_k", "K", "Its 95 % interval.", interval)
    .number("stated_w_m2", "W/m²", "The value in the case file.", |row| row.0.case_values[row.1])
    .number("stated_k", "K", "The value in the case file.", |row| row.0.case_values[row.1])
}

fn history_tables(case: &Case, outcome: &FluxInversion) -> Result<Vec<NamedFile>, ReportError> {
    let of_temperature = ["gas_k", "{low,high}_k", "stated_k"];
    let of_flux = ["{low,high}_w_m2", "stated_w_m2"];
    let absent = match outcome.quantity {
        HeatingQuantity::Flux => [&of_temperature[..], &["radiant_flux_w_m2"]],
        HeatingQuantity::RadiantFlux => [&of_temperature[..], &["flux_w_m2"]],
        HeatingQuantity::Gas => [&of_flux[..], &["flux_w_m2", "radiant_flux_w_m2"]],
    };
    let (absent, names) = (absent.concat(), Names::default());
    let schedule = outcome.schedule.times_s.iter().copied().zip(outcome.schedule.values.iter().copied());
    let knots = (0..outcome.values.len()).map(|knot| (outcome, knot));
    let residuals = outcome.sensor_fits.iter().flat_map(|seen| {
        let samples = seen.times_s.iter().zip(&seen.residuals_k);
        samples.map(|(&time_s, &residual_k)| (case.sensors[seen.sensor].name.as_str(), time_s, residual_k))
    });
    Ok(vec![
        schedule_table().without(&absent).csv(&names, schedule)?,
        band_table().without(&absent).csv(&names, knots)?,
        residuals_table().csv_as("history-residuals.csv", &names, residuals)?,
    ])
}
