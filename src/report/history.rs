//! The heating of the hot face, from what sensors read.

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
            Finding { about: "Smoothing", said: chosen(self) },
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

    /// | file | columns |
    /// |---|---|
    /// | `history.csv` | `time_s`, `flux_w_m2`, `radiant_flux_w_m2` or `gas_K`: the history found, as a case reads one |
    /// | `history-band.csv` | of every knot the value, between what 95 % of histories have that other noise makes, what smoothing takes off to first order, what the case has |
    /// | `history-residuals.csv` | `sensor`, `time_s`, measured less predicted with the history found |
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

/// What a value of a history is called and printed in.
struct Unit {
    /// `Cold-wall heat flux at the hot face`.
    pub title: &'static str,
    pub noun: &'static str,
    pub unit: &'static str,
    /// What SI is multiplied by.
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

/// Cells of the heading of the table of knots.
fn head(outcome: &History) -> [&'static str; 4] {
    let value = match outcome.sought {
        Sought::Flux | Sought::RadiantFlux => "Flux, W/cm²",
        Sought::Gas => "Gas, K",
    };
    ["Time, s", value, "± 95 %", "As the case has it"]
}

/// The knots in order; at most so many, evenly picked.
fn rows(outcome: &History, most: usize) -> Vec<[String; 4]> {
    let last = outcome.times_s.len() - 1;
    let rows = most.min(last + 1);
    let picked = (0..rows).map(|row| row * last / (rows - 1));
    let unit = unit(outcome.sought);
    let cells = |knot: usize| {
        let half = if outcome.undetermined[knot] { "open".to_owned() } else { unit.width(outcome.half_width(knot)) };
        let time_s = words::trimmed(words::grouped(outcome.times_s[knot], 2));
        [time_s, unit.value(outcome.values[knot]), half, unit.value(outcome.own[knot])]
    };
    picked.map(cells).collect()
}

/// One line of them on the screen.
fn row(cells: &[impl AsRef<str>; 4]) -> String {
    let [time, value, half, own] = cells.each_ref().map(AsRef::as_ref);
    format!("{time:>9}{value:>14}{half:>10}{own:>21}")
}

/// The instants of the knots that are not determined.
fn open(outcome: &History) -> Vec<String> {
    let knots = (0..outcome.times_s.len()).filter(|&knot| outcome.undetermined[knot]);
    knots.map(|knot| words::seconds(outcome.times_s[knot])).collect()
}

/// The answer: how much heat or how hot a gas, how strong at most, and how far from what the case says.
fn found(answers: &Answers, outcome: &History) -> String {
    let unit = unit(outcome.sought);
    let sensors: Vec<&str> = outcome.seen.iter().map(|seen| answers.case.sensors[seen.sensor].name.as_str()).collect();
    let (peak, at_s) = outcome
        .values
        .iter()
        .zip(&outcome.times_s)
        .fold((0.0, 0.0), |peak, (&value, &time_s)| if value > peak.0 { (value, time_s) } else { peak });
    let have = if sensors.len() == 1 { "has" } else { "have" };
    let (sensors, during) = (words::listed(&sensors), words::seconds(outcome.end_s));
    let (found, deviation, own) = (outcome.integral, outcome.integral_deviation, outcome.integral_own);
    let left_out = match &open(outcome)[..] {
        [] => String::new(),
        knots => format!(", which leaves out the {} at {}, undetermined", unit.noun, words::listed(knots)),
    };
    let highest = format!("at most by {} at {}", unit.with_unit(peak), words::seconds(at_s));
    if outcome.sought == Sought::Gas {
        let mean = |integral: f64| integral / outcome.end_s;
        let less = mean(found) - mean(own);
        return format!(
            "As {sensors} {have} it, the gas was at {} ± {} K on average (95 %{left_out}) over {during}, {} K {} than the case \
             says, and {} K at the hottest, at {}.",
            unit.value(mean(found)),
            words::significant(1.96 * mean(deviation), 2),
            words::significant(less.abs(), 2),
            if less < 0.0 { "less" } else { "more" },
            unit.value(peak),
            words::seconds(at_s)
        );
    }
    let beside = if own > 0.0 {
        let more = found / own - 1.0;
        let way = if more < 0.0 { "less" } else { "more" };
        format!(", {} % {way} than the case says", words::significant(100.0 * more.abs(), 2))
    } else {
        String::new()
    };
    let of =
        if outcome.sought == Sought::RadiantFlux { "the face was irradiated by" } else { "the face was heated by" };
    format!(
        "As {sensors} {have} it, {of} {} ± {} MJ/m² (95 %{left_out}) in {during}{beside}, {highest}.",
        words::significant(1e-6 * found, 3),
        words::significant(1.96e-6 * deviation, 2),
    )
}

/// How smooth the history is, and by what that was chosen.
fn chosen(outcome: &History) -> String {
    let rms = words::significant(outcome.rung.rms, 3);
    let why = match outcome.chosen {
        Chosen::Discrepancy => format!(
            "It is as smooth as the noise lets it be: residuals are {rms} of their standard deviations, root mean square, and \
             would be more of anything smoother."
        ),
        Chosen::Straight => format!(
            "Straight lines between the sharp corners meet the data within their noise ({rms} of their standard deviations, root \
             mean square): nothing in them asks for a bend, and weaker smoothing would only follow noise."
        ),
        Chosen::Unmet => format!(
            "No history meets the data within their noise: even with next to no smoothing residuals are {} of their standard deviations, \
             root mean square. So what no history explains is taken for the noise, and this one is as \
             smooth as that lets it be, at {rms}.",
            words::significant(outcome.rungs.iter().map(|rung| rung.rms).fold(f64::INFINITY, f64::min), 3)
        ),
        Chosen::LCurve => format!(
            "The smoothing is that of the corner of the L-curve, with residuals of {rms} standard deviations, root mean square."
        ),
        Chosen::Stated => {
            format!("The smoothing was stated; residuals are {rms} of their standard deviations, root mean square.")
        }
    };
    format!(
        "{why} Of {} values the data determine {}, smoothness the others.",
        words::count(outcome.times_s.len()),
        words::significant(outcome.determined, 2)
    )
}

/// What the band is and is not.
fn left_out() -> &'static str {
    "At each knot the band holds 95 % of what other noise would have made of the same heating. What smoothing takes off peaks, and what is wrong \
     with properties, depths or physics, is not in it."
}

/// Reasons for doubt.
fn doubts(answers: &Answers, outcome: &History) -> Vec<String> {
    let mut doubts = Vec::new();
    if outcome.chosen == Chosen::Unmet {
        doubts.push(
            "No heating explains the data within their noise: either the noise is larger than stated (--set \
             observations.sigma=...), or the case lacks something, and the flux found makes up for it."
                .to_owned(),
        );
    }
    if !outcome.converged {
        doubts.push(format!("The history is not the least there is: {}.", outcome.termination));
    }
    let unit = unit(outcome.sought);
    let open = open(outcome);
    if !open.is_empty() {
        doubts.push(format!(
            "The data do not determine the {} at {}: noise alone makes more of it than the largest value found, or nothing moves \
             with it, as where a blown flux is small. The integral and its ± take the values found there as they are.",
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
        let moved = if is_off { format!("takes {by} off") } else { format!("puts {by} onto") };
        doubts.push(format!(
            "At {} smoothing {moved} the {}, more than the band is wide: bends as short as that are not to be trusted.",
            words::seconds(outcome.times_s[knot]),
            unit.noun
        ));
    }
    if outcome.end_s < answers.case.exposure.duration_s {
        doubts.push(format!(
            "After {}, the end of the window, nothing was sought: history.csv goes on as the case has it.",
            words::seconds(outcome.end_s)
        ));
    }
    doubts
}

fn page(answers: &Answers, outcome: &History) -> String {
    let rows: Vec<Vec<String>> = rows(outcome, usize::MAX).into_iter().map(Vec::from).collect();
    let fits: Vec<Vec<String>> = outcome
        .seen
        .iter()
        .map(|seen| {
            let [own, found] = [seen.rms_k.0, seen.rms_k.1].map(|rms_k| words::significant(rms_k, 3));
            vec![answers.case.sensors[seen.sensor].name.clone(), words::count(seen.times_s.len()), own, found]
        })
        .collect();
    let columns = ["Sensor", "Samples", "Off as the case has it, K", "Off as found, K"];
    list(&[found(answers, outcome), chosen(outcome), left_out().to_owned()])
        + &table(&format!("{} at the knots", unit(outcome.sought).title), &head(outcome), &rows)
        + &table("Measured less predicted, root mean square", &columns, &fits)
}

fn on_screen(answers: &Answers, outcome: &History) -> Vec<String> {
    let mut lines = vec![row(&head(outcome))];
    lines.extend(rows(outcome, 8).iter().map(row));
    let said = [found(answers, outcome), chosen(outcome), left_out().to_owned()];
    lines.extend(said.iter().flat_map(|said| wrapped("", said)));
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
    let [low, high, smoothed, own] = ["low", "high", "smoothed", "own"].map(|of| format!("{of}_{unit}"));
    let columns = ["time_s", &value, &low, &high, &smoothed, &own].map(str::to_owned);
    let mut band = Table::new("history-band.csv", columns.each_ref().map(String::as_str))?;
    for (knot, &value) in outcome.values.iter().enumerate() {
        let half = outcome.half_width(knot);
        let (smoothed, own) = (outcome.smoothed[knot], outcome.own[knot]);
        band.row(None, [outcome.times_s[knot], value, (value - half).max(0.0), value + half, smoothed, own])?;
    }
    let mut left = Table::new("history-residuals.csv", ["sensor", "time_s", "residual_K"])?;
    for seen in &outcome.seen {
        for (&time_s, &off_k) in seen.times_s.iter().zip(&seen.residuals_k) {
            left.row(Some(&case.sensors[seen.sensor].name), [time_s, off_k])?;
        }
    }
    Ok(vec![found.close()?, band.close()?, left.close()?])
}
