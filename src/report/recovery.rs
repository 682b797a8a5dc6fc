//! Fits of synthetic data sets whose truth is known.

mod figures;
mod record;

use super::answer::{Answer, Finding, Room, Section};
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use super::files::table::{Table, cell};
use super::html::table::{list, paragraph, table};
use super::summary::wrapped;
use super::{ReportError, words};
use crate::study::answers::Answers;
use crate::study::recovery::{Recovered, Recovery};

impl Answer for Recovery {
    fn leads(&self) -> bool {
        true
    }

    fn findings(&self, _: &Answers) -> Vec<Finding> {
        vec![Finding { about: "Twins", said: made(self) }, Finding { about: "Coverage", said: coverage(self) }]
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        doubts(self)
    }

    fn figures(&self, _: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(self).into_iter().map(|figure| ("twins", figure)).collect()
    }

    fn sections(&self, _: &Answers) -> Vec<Section> {
        vec![Section::new("twins", "Twins", page(self))]
    }

    /// `twins.csv`: `twin`, `factor`, truth, estimate, its 95 % interval, and whether that holds the truth; the last
    /// four empty where no fit converged.
    fn tables(&self, _: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![twins(self)?])
    }

    fn record(&self, _: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("twins", &record::RecoveryRecord::of(self))
    }

    fn screen(&self, _: &Answers, _: &Room) -> Vec<String> {
        on_screen(self)
    }
}

/// How often intervals held the truth.
fn coverage(outcome: &Recovery) -> String {
    let each: Vec<String> = outcome
        .recovered
        .iter()
        .map(|factor| {
            let Recovered { name, covered, .. } = factor;
            format!("{name} in {} of {}", words::count(covered.count), words::count(covered.of))
        })
        .collect();
    format!("95 % intervals hold the truth in {} of all: {}.", words::proportion(outcome.covered), words::listed(&each))
}

/// How the data were made.
fn made(outcome: &Recovery) -> String {
    let noise = outcome.noise_k.map_or("the standard deviations of the observations".to_owned(), |noise_k| {
        format!("a standard deviation of {}", words::misfit(noise_k))
    });
    let follows = if outcome.noise.correlation_s > 0.0 {
        format!("noise that forgets itself over {}", words::seconds(outcome.noise.correlation_s))
    } else {
        "independent noise".to_owned()
    };
    format!(
        "{} of truths drawn between the {} side constraints, with {follows} of {noise}: {} each, which carry the information \
         of {} as the residuals tell.",
        words::counted(outcome.twins.len(), "data set"),
        outcome.drawn.name(),
        words::counted(outcome.samples, "sample"),
        words::significant(outcome.effective_samples, 2)
    )
}

/// Whether estimates are off on the whole by more than chance makes them.
fn is_biased(factor: &Recovered) -> bool {
    factor.bias.abs() > 3.0 * factor.bias_error
}

/// Reasons for doubt.
fn doubts(outcome: &Recovery) -> Vec<String> {
    let mut doubts = Vec::new();
    for (reason, count) in outcome.failures() {
        let of = words::counted(outcome.twins.len(), "twin");
        doubts.push(format!("{} of {of} did not converge ({reason}); those that were fitted count with the intervals that they ended with.", words::count(count)));
    }
    for factor in &outcome.recovered {
        let (low, high) = factor.covered.interval_95();
        if !(low..=high).contains(&0.95) {
            let way = if high < 0.95 { "seldom" } else { "often" };
            let held = words::proportion(factor.covered);
            doubts
                .push(format!("Intervals of {} hold the truth too {way}: in {held} where 95 % is said.", factor.name));
        }
        if factor.at_bound > 0 {
            doubts.push(format!(
                "{} of {} estimates of {} stand on a bound; they count as the others do.",
                words::count(factor.at_bound),
                words::count(factor.covered.of),
                factor.name
            ));
        }
        if is_biased(factor) {
            doubts.push(format!(
                "Estimates of {} are off by {} on average, more than the {} that chance explains.",
                factor.name,
                words::significant(factor.bias, 2),
                words::significant(2.0 * factor.bias_error, 2)
            ));
        }
    }
    doubts
}

fn page(outcome: &Recovery) -> String {
    let rows: Vec<Vec<String>> = outcome
        .recovered
        .iter()
        .map(|factor| {
            vec![
                factor.name.clone(),
                words::significant(factor.bias, 2),
                words::significant(factor.bias_error, 2),
                words::significant(factor.rms, 2),
                words::significant(factor.half_width, 2),
                format!("{} of {}", words::count(factor.covered.count), words::count(factor.covered.of)),
                words::proportion(factor.covered).replace(" %", ""),
                words::count(factor.at_bound),
            ]
        })
        .collect();
    let ended =
        format!("{} of {} converged.", words::count(outcome.converged()), words::counted(outcome.twins.len(), "fit"));
    let head = ["Factor", "Bias", "± (1 σ)", "Off, rms", "± 95 %, mean", "Truth held", "Truth held, %", "At a bound"];
    list(&[coverage(outcome), ended]) + &table("Estimates less truths", &head, &rows) + &paragraph(&made(outcome))
}

fn on_screen(outcome: &Recovery) -> Vec<String> {
    let mut lines = wrapped("", &made(outcome));
    lines.push(format!(
        "{:<15}{:>10}{:>9}{:>9}{:>9}  {}",
        "factor", "bias", "off, rms", "± 95 %", "at bound", "intervals that hold it"
    ));
    for factor in &outcome.recovered {
        lines.push(format!(
            "{:<15}{:>10}{:>9}{:>9}{:>9}  {}",
            words::short(&factor.name, 14),
            words::significant(factor.bias, 2),
            words::significant(factor.rms, 2),
            words::significant(factor.half_width, 2),
            words::count(factor.at_bound),
            words::proportion(factor.covered)
        ));
    }
    lines.extend(wrapped("", &coverage(outcome)));
    lines
}

fn twins(outcome: &Recovery) -> Result<File, ReportError> {
    let columns = ["twin", "factor", "truth", "estimate", "low", "high", "held"];
    let mut table = Table::new("twins.csv", columns)?;
    for (number, twin) in outcome.twins.iter().enumerate() {
        for (place, (&truth, factor)) in twin.truth.iter().zip(&outcome.recovered).enumerate() {
            let mut row = vec![number.to_string(), factor.name.clone(), cell(truth)];
            match twin.end.found() {
                Some(found) => {
                    let (low, high) = found.intervals[place];
                    row.extend([found.values[place], low, high].map(cell));
                    row.push(u8::from((low..=high).contains(&truth)).to_string());
                }
                None => row.extend(std::iter::repeat_n(String::new(), 4)),
            }
            table.text(row)?;
        }
    }
    table.close()
}
