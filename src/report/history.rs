//! Inverse heat conduction: the heating of the hot face from thermocouples.

mod figures;
mod record;

use super::answer::{Answer, Finding, Room, Section};
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use super::files::table::Table;
use super::html::table::{list, table};
use super::summary::wrapped;
use super::{ReportError, words};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::history::{Chosen, History, Sought};

impl Answer for History {
    fn leads(&self) -> bool {
        true
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        vec![
            Finding { about: "Heating", said: found(answers, self) },
            Finding { about: "Regularisation", said: chosen(self) },
        ]
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        doubts(answers, self)
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(answers, self).into_iter().map(|figure| ("history", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("history", "Heating", page(answers, self))]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<File>, ReportError> {
        heating(&answers.case, self)
    }

    fn record(&self, answers: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("history", &record::HistoryRecord::of(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, _: &Room) -> Vec<String> {
        on_screen(answers, self)
    }
}

/// Name and unit of the estimated quantity.
struct Unit {
    /// `Cold-wall heat flux at the hot face`.
    pub title: &'static str,
    pub noun: &'static str,
    pub unit: &'static str,
    /// Factor from SI to `unit`.
    pub scale: f64,
    digits: usize,
}

fn unit(sought: Sought) -> Unit {
    let flux = |title, noun| Unit { title, noun, unit: "W/cm²", scale: 1e-4, digits: 3 };
    match sought {
        Sought::Flux => flux("Cold-wall heat flux at the hot face", "flux"),
        Sought::RadiantFlux => flux("Incident radiant flux at the hot face", "radiant flux"),
        Sought::Gas => {
            let title = "Temperature of the gas at the hot face";
            Unit { title, noun: "gas temperature", unit: "K", scale: 1.0, digits: 4 }
        }
    }
}

impl Unit {
    fn value(&self, value: f64) -> String {
        words::significant(value * self.scale, self.digits)
    }

    fn with_unit(&self, value: f64) -> String {
        format!("{} {}", self.value(value), self.unit)
    }

    fn width(&self, value: f64) -> String {
        words::significant(value * self.scale, 3)
    }
}

/// Head of the table of knots.
fn head(outcome: &History) -> [&'static str; 4] {
    let value = match outcome.sought {
        Sought::Flux | Sought::RadiantFlux => "Flux, W/cm²",
        Sought::Gas => "Gas, K",
    };
    ["Time, s", value, "± 95 %", "Stated in the case"]
}

/// Rows of the table of knots, at most `most`, evenly spaced.
fn rows(outcome: &History, most: usize) -> Vec<[String; 4]> {
    let last = outcome.times_s.len() - 1;
    let rows = most.min(last + 1);
    let picked = (0..rows).map(|row| row * last / (rows - 1));
    let unit = unit(outcome.sought);
    let cells = |knot: usize| {
        let half = if outcome.undetermined[knot] { "unknown".to_owned() } else { unit.width(outcome.half_width(knot)) };
        let time_s = words::trimmed(words::grouped(outcome.times_s[knot], 2));
        [time_s, unit.value(outcome.values[knot]), half, unit.value(outcome.own[knot])]
    };
    picked.map(cells).collect()
}

/// A row on the screen.
fn row(cells: &[impl AsRef<str>; 4]) -> String {
    let [time, value, half, stated] = cells.each_ref().map(AsRef::as_ref);
    format!("{time:>9}{value:>14}{half:>10}{stated:>21}")
}

/// Times of the knots that the data do not determine.
fn open(outcome: &History) -> Vec<String> {
    let knots = (0..outcome.times_s.len()).filter(|&knot| outcome.undetermined[knot]);
    knots.map(|knot| words::seconds(outcome.times_s[knot])).collect()
}

/// The finding: fluence or mean gas temperature with its 95 % interval, the peak, and the difference from the case.
fn found(answers: &Answers, outcome: &History) -> String {
    let unit = unit(outcome.sought);
    let sensors: Vec<&str> = outcome.seen.iter().map(|seen| answers.case.sensors[seen.sensor].name.as_str()).collect();
    let (peak, at_s) = outcome
        .values
        .iter()
        .zip(&outcome.times_s)
        .fold((0.0, 0.0), |peak, (&value, &time_s)| if value > peak.0 { (value, time_s) } else { peak });
    let (sensors, during) = (words::listed(&sensors), words::seconds(outcome.end_s));
    let (found, deviation, stated) = (outcome.integral, outcome.integral_deviation, outcome.integral_own);
    let left_out = match &open(outcome)[..] {
        [] => String::new(),
        knots => format!("; the uncertainty of the undetermined {} at {} is excluded", unit.noun, words::listed(knots)),
    };
    let highest = format!("peak {} at {}", unit.with_unit(peak), words::seconds(at_s));
    if outcome.sought == Sought::Gas {
        let mean = |integral: f64| integral / outcome.end_s;
        let less = mean(found) - mean(stated);
        return format!(
            "From {sensors}: mean gas temperature {} ± {} K (95 %{left_out}) over {during}, {} K {} than the case \
             states; peak {} K at {}.",
            unit.value(mean(found)),
            words::significant(1.96 * mean(deviation), 2),
            words::significant(less.abs(), 2),
            if less < 0.0 { "less" } else { "more" },
            unit.value(peak),
            words::seconds(at_s)
        );
    }
    let difference = if stated > 0.0 {
        let more = found / stated - 1.0;
        let way = if more < 0.0 { "less" } else { "more" };
        format!(", {} % {way} than the case states", words::significant(100.0 * more.abs(), 2))
    } else {
        String::new()
    };
    let fluence = if outcome.sought == Sought::RadiantFlux { "radiant fluence" } else { "fluence" };
    format!(
        "From {sensors}: {fluence} {} ± {} MJ/m² (95 %{left_out}) in {during}{difference}; {highest}.",
        words::significant(1e-6 * found, 3),
        words::significant(1.96e-6 * deviation, 2),
    )
}

/// The regularisation, and how its weight was chosen.
fn chosen(outcome: &History) -> String {
    let rms = words::significant(outcome.rung.rms, 3);
    let why = match outcome.chosen {
        Chosen::Discrepancy => format!(
            "Regularisation weight by the discrepancy principle: the largest for which the residuals match the noise \
             (weighted RMSE {rms})."
        ),
        Chosen::Straight => format!(
            "A schedule that is linear between the corners of the stated one fits the data within their noise \
             (weighted RMSE {rms}); weaker regularisation would fit noise."
        ),
        Chosen::Unmet => format!(
            "No history fits the data within their noise: the weighted RMSE is {} even with negligible regularisation. \
             The noise level is raised to it, and the discrepancy principle gives a weighted RMSE of {rms}.",
            words::significant(outcome.rungs.iter().map(|rung| rung.rms).fold(f64::INFINITY, f64::min), 3)
        ),
        Chosen::LCurve => format!("Regularisation weight at the corner of the L-curve (weighted RMSE {rms})."),
        Chosen::Stated => format!("Regularisation weight as stated (weighted RMSE {rms})."),
    };
    format!(
        "{why} The data determine {} of {} knots (effective degrees of freedom).",
        words::significant(outcome.determined, 2),
        words::count(outcome.times_s.len())
    )
}

/// What the band includes.
fn left_out() -> &'static str {
    "The 95 % band is the effect of measurement noise at each knot. It excludes the regularisation bias and errors of \
     properties, depths and physics."
}

/// Warnings.
fn doubts(answers: &Answers, outcome: &History) -> Vec<String> {
    let mut warnings = Vec::new();
    if outcome.chosen == Chosen::Unmet {
        warnings.push(
            "No heating history fits the data within their noise: the noise is larger than stated (--set \
             observations.sigma=...), or the model is incomplete and the estimated heating compensates for it."
                .to_owned(),
        );
    }
    if !outcome.converged {
        warnings.push(format!("The estimation of the history did not converge: {}.", outcome.termination));
    }
    let unit = unit(outcome.sought);
    let open = open(outcome);
    if !open.is_empty() {
        warnings.push(format!(
            "The data do not determine the {} at {}: its standard deviation exceeds the largest estimate, or the \
             temperatures do not depend on it (as with a small flux under blowing). Integral and mean take these \
             values as exact.",
            unit.noun,
            words::listed(&open)
        ));
    }
    let beyond = |&knot: &usize| outcome.smoothed[knot].abs() > outcome.half_width(knot) && !outcome.undetermined[knot];
    let worst = (0..outcome.times_s.len())
        .filter(beyond)
        .max_by(|&a, &b| outcome.smoothed[a].abs().total_cmp(&outcome.smoothed[b].abs()));
    if let Some(knot) = worst {
        let by = format!("{} {}", unit.width(outcome.smoothed[knot].abs()), unit.unit);
        let is_off = outcome.smoothed[knot] > 0.0;
        let moved = if is_off {
            format!("lowers the {} by {by}", unit.noun)
        } else {
            format!("raises the {} by {by}", unit.noun)
        };
        warnings.push(format!(
            "At {} the regularisation {moved}, more than the half-width of the band: features as short as this are not \
             resolved.",
            words::seconds(outcome.times_s[knot])
        ));
    }
    if outcome.end_s < answers.case.exposure.duration_s {
        warnings.push(format!(
            "After the end of the window, {}, nothing is estimated: history.csv continues with the values of the case.",
            words::seconds(outcome.end_s)
        ));
    }
    warnings
}

fn page(answers: &Answers, outcome: &History) -> String {
    let rows: Vec<Vec<String>> = rows(outcome, usize::MAX).into_iter().map(Vec::from).collect();
    let fits: Vec<Vec<String>> = outcome
        .seen
        .iter()
        .map(|seen| {
            let [stated, found] = [seen.rms_k.0, seen.rms_k.1].map(|rms_k| words::significant(rms_k, 3));
            vec![answers.case.sensors[seen.sensor].name.clone(), words::count(seen.times_s.len()), stated, found]
        })
        .collect();
    let columns = ["Sensor", "Samples", "RMSE, stated heating, K", "RMSE, estimated heating, K"];
    list(&[found(answers, outcome), chosen(outcome), left_out().to_owned()])
        + &table(&format!("{} at the knots", unit(outcome.sought).title), &head(outcome), &rows)
        + &table("Measurement less prediction", &columns, &fits)
}

fn on_screen(answers: &Answers, outcome: &History) -> Vec<String> {
    let mut lines = vec![row(&head(outcome))];
    lines.extend(rows(outcome, 8).iter().map(row));
    let text = [found(answers, outcome), chosen(outcome), left_out().to_owned()];
    lines.extend(text.iter().flat_map(|text| wrapped("", text)));
    lines
}

fn heating(case: &Case, outcome: &History) -> Result<Vec<File>, ReportError> {
    let (name, unit) = match outcome.sought {
        Sought::Flux => ("flux", "w_m2"),
        Sought::RadiantFlux => ("radiant_flux", "w_m2"),
        Sought::Gas => ("gas", "K"),
    };
    let value = format!("{name}_{unit}");
    let mut found = Table::new("history.csv", ["time_s", &value])?;
    for (&time_s, &value) in outcome.schedule.times_s.iter().zip(&outcome.schedule.values) {
        found.row(None, [time_s, value])?;
    }
    let [low, high, removed, stated] =
        ["low", "high", "removed_by_smoothing", "stated"].map(|of| format!("{of}_{unit}"));
    let columns = ["time_s", &value, &low, &high, &removed, &stated].map(str::to_owned);
    let mut band = Table::new("history-band.csv", columns.each_ref().map(String::as_str))?;
    for (knot, &value) in outcome.values.iter().enumerate() {
        let half = outcome.half_width(knot);
        let (removed, stated) = (outcome.smoothed[knot], outcome.own[knot]);
        band.row(None, [outcome.times_s[knot], value, (value - half).max(0.0), value + half, removed, stated])?;
    }
    let mut left = Table::new("history-residuals.csv", ["sensor", "time_s", "residual_K"])?;
    for seen in &outcome.seen {
        for (&time_s, &residual_k) in seen.times_s.iter().zip(&seen.residuals_k) {
            left.row(Some(&case.sensors[seen.sensor].name), [time_s, residual_k])?;
        }
    }
    Ok(vec![found.close()?, band.close()?, left.close()?])
}
