//! Coverage study: fits of synthetic data sets with known true factors.

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
        vec![Finding { about: "Synthetic data", said: made(self) }, Finding { about: "Coverage", said: coverage(self) }]
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        doubts(self)
    }

    fn figures(&self, _: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(self).into_iter().map(|figure| ("coverage", figure)).collect()
    }

    fn sections(&self, _: &Answers) -> Vec<Section> {
        vec![Section::new("coverage", "Coverage", page(self))]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![estimates(self)?])
    }

    fn record(&self, _: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("coverage_study", &record::RecoveryRecord::of(self))
    }

    fn screen(&self, _: &Answers, _: &Room) -> Vec<String> {
        on_screen(self)
    }
}

/// Coverage of the 95 % intervals.
fn coverage(outcome: &Recovery) -> String {
    let each: Vec<String> = outcome
        .recovered
        .iter()
        .map(|factor| {
            let Recovered { name, covered, .. } = factor;
            format!("{name} {} of {}", words::count(covered.count), words::count(covered.of))
        })
        .collect();
    format!("Coverage of the 95 % intervals: {}; {}.", words::proportion(outcome.covered), words::listed(&each))
}

/// Description of the synthetic data.
fn made(outcome: &Recovery) -> String {
    let noise = outcome.noise_k.map_or("the standard deviations of the observations".to_owned(), |noise_k| {
        format!("standard deviation {}", words::misfit(noise_k))
    });
    let kind = if outcome.noise.correlation_s > 0.0 {
        format!("noise of correlation time {}", words::seconds(outcome.noise.correlation_s))
    } else {
        "white noise".to_owned()
    };
    format!(
        "{} from true factors sampled within the {} bounds, with {kind} ({noise}); {} each, effective sample size {}.",
        words::counted(outcome.twins.len(), "synthetic data set"),
        outcome.drawn.name(),
        words::counted(outcome.samples, "sample"),
        words::significant(outcome.effective_samples, 2)
    )
}

/// Whether the bias exceeds three of its standard errors.
fn is_biased(factor: &Recovered) -> bool {
    factor.bias.abs() > 3.0 * factor.bias_error
}

/// Warnings.
fn doubts(outcome: &Recovery) -> Vec<String> {
    let mut warnings = Vec::new();
    for (reason, count) in outcome.failures() {
        let of = words::counted(outcome.twins.len(), "fit");
        warnings.push(format!(
            "{} of {of} did not converge ({reason}); those with an estimate count with their last interval.",
            words::count(count)
        ));
    }
    for factor in &outcome.recovered {
        let (low, high) = factor.covered.interval_95();
        if !(low..=high).contains(&0.95) {
            let way = if high < 0.95 { "low" } else { "high" };
            let share = words::proportion(factor.covered);
            warnings.push(format!("The coverage of {} is too {way}: {share} instead of 95 %.", factor.name));
        }
        if factor.at_bound > 0 {
            warnings.push(format!(
                "{} of {} estimates of {} are on a bound; they are included.",
                words::count(factor.at_bound),
                words::count(factor.covered.of),
                factor.name
            ));
        }
        if is_biased(factor) {
            warnings.push(format!(
                "The estimates of {} have a bias of {}, beyond its 95 % sampling error of {}.",
                factor.name,
                words::significant(factor.bias, 2),
                words::significant(2.0 * factor.bias_error, 2)
            ));
        }
    }
    warnings
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
    let head = [
        "Factor",
        "Bias",
        "Standard error of the bias",
        "RMSE",
        "Mean half-width of the 95 % intervals",
        "Covered",
        "Coverage, %",
        "On a bound",
    ];
    list(&[coverage(outcome), ended])
        + &table("Errors of the estimates and coverage of their intervals", &head, &rows)
        + &paragraph(&made(outcome))
}

fn on_screen(outcome: &Recovery) -> Vec<String> {
    let mut lines = wrapped("", &made(outcome));
    lines.push(format!("{:<15}{:>10}{:>9}{:>9}{:>9}  {}", "factor", "bias", "RMSE", "± 95 %", "on bound", "coverage"));
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

fn estimates(outcome: &Recovery) -> Result<File, ReportError> {
    let columns = ["data_set", "factor", "truth", "estimate", "low", "high", "interval_holds_truth"];
    let mut table = Table::new("coverage.csv", columns)?;
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
