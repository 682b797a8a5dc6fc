//! Coverage study: fits of synthetic data sets with known true factors.

mod figures;
mod record;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{list, paragraph, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, wrap};
use super::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::coverage_study::{CoverageStudy, FactorCoverage};

impl Reportable for CoverageStudy {
    fn comes_first(&self) -> bool {
        true
    }

    fn findings(&self, _: &Answers) -> Vec<Finding> {
        vec![
            Finding { label: "Synthetic data", text: data_description(self) },
            Finding { label: "Coverage", text: coverage(self) },
        ]
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        coverage_warnings(self)
    }

    fn figures(&self, _: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(self).into_iter().map(|figure| ("coverage", figure)).collect()
    }

    fn sections(&self, _: &Answers) -> Vec<Section> {
        vec![Section::new("coverage", "Coverage", page(self))]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![estimates_table().description()]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        Ok(vec![estimates(self)?])
    }

    fn write_summary(&self, _: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("coverage_study", &record::CoverageStudyRecord::of(self))
    }

    fn screen(&self, _: &Answers, _: &ScreenLimits) -> Vec<String> {
        on_screen(self)
    }
}

/// Coverage of the 95 % intervals.
fn coverage(outcome: &CoverageStudy) -> String {
    let each: Vec<String> = outcome
        .factors
        .iter()
        .map(|factor| {
            let FactorCoverage { name, covered, .. } = factor;
            format!("{name} {} of {}", format::count(covered.count), format::count(covered.total))
        })
        .collect();
    format!("Coverage of the 95 % intervals: {}; {}.", format::proportion(outcome.covered), format::list(&each))
}

/// Description of the synthetic data.
fn data_description(outcome: &CoverageStudy) -> String {
    let noise = outcome.noise_k.map_or("the standard deviations of the observations".to_owned(), |noise_k| {
        format!("standard deviation {}", format::temperature_difference(noise_k))
    });
    let kind = if outcome.noise.correlation_s > 0.0 {
        format!("noise of correlation time {}", format::seconds(outcome.noise.correlation_s))
    } else {
        "white noise".to_owned()
    };
    format!(
        "{} from true factors sampled within the {} bounds, with {kind} ({noise}); {} each, effective sample size {}.",
        format::counted(outcome.fits.len(), "synthetic data set"),
        outcome.truth_bounds.name(),
        format::counted(outcome.samples, "sample"),
        format::significant(outcome.effective_samples, 2)
    )
}

/// Whether the bias exceeds three of its standard errors.
fn is_biased(factor: &FactorCoverage) -> bool {
    factor.bias.abs() > 3.0 * factor.bias_error
}

/// Warnings of an early stop, of failed fits, and of factors with poor coverage, estimates on a bound or a bias.
fn coverage_warnings(outcome: &CoverageStudy) -> Vec<String> {
    let mut warnings = Vec::new();
    if outcome.is_partial() {
        warnings.push(format!(
            "The study was stopped after {} of {}; its numbers are those of the data sets so far.",
            format::count(outcome.fits.len()),
            format::counted(outcome.requested, "data set")
        ));
    }
    for (reason, count) in outcome.failures() {
        let of = format::counted(outcome.fits.len(), "fit");
        warnings.push(format!(
            "{} of {of} did not converge ({reason}); those with an estimate count with their last interval.",
            format::count(count)
        ));
    }
    for factor in &outcome.factors {
        let (low, high) = factor.covered.interval_95();
        if !(low..=high).contains(&0.95) {
            let way = if high < 0.95 { "low" } else { "high" };
            let share = format::proportion(factor.covered);
            warnings.push(format!("The coverage of {} is too {way}: {share} instead of 95 %.", factor.name));
        }
        if factor.at_bound > 0 {
            warnings.push(format!(
                "{} of {} estimates of {} are on a bound; they are included.",
                format::count(factor.at_bound),
                format::count(factor.covered.total),
                factor.name
            ));
        }
        if is_biased(factor) {
            warnings.push(format!(
                "The estimates of {} have a bias of {}, beyond its 95 % sampling error of {}.",
                factor.name,
                format::significant(factor.bias, 2),
                format::significant(2.0 * factor.bias_error, 2)
            ));
        }
    }
    warnings
}

fn page(outcome: &CoverageStudy) -> String {
    let rows: Vec<Vec<String>> = outcome
        .factors
        .iter()
        .map(|factor| {
            vec![
                factor.name.clone(),
                format::significant(factor.bias, 2),
                format::significant(factor.bias_error, 2),
                format::significant(factor.rms, 2),
                format::significant(factor.half_width, 2),
                format!("{} of {}", format::count(factor.covered.count), format::count(factor.covered.total)),
                format::proportion(factor.covered).replace(" %", ""),
                format::count(factor.at_bound),
            ]
        })
        .collect();
    let ended =
        format!("{} of {} converged.", format::count(outcome.converged()), format::counted(outcome.fits.len(), "fit"));
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
        + &paragraph(&data_description(outcome))
}

fn on_screen(outcome: &CoverageStudy) -> Vec<String> {
    let mut lines = wrap("", &data_description(outcome));
    let mut rows = vec![head(["factor", "bias", "RMSE", "± 95 %", "on bound", "coverage"])];
    for factor in &outcome.factors {
        rows.push([
            format::truncate(&factor.name, 14),
            format::significant(factor.bias, 2),
            format::significant(factor.rms, 2),
            format::significant(factor.half_width, 2),
            format::count(factor.at_bound),
            format::proportion(factor.covered),
        ]);
    }
    let [name, coverage_column] = [(0, 15), (2, 0)].map(|(gap, width)| Column::Left { gap, width });
    let [bias, rms, half, at_bound] = [10, 9, 9, 9].map(Column::Right);
    lines.extend(aligned([name, bias, rms, half, at_bound, coverage_column], &rows));
    lines.extend(wrap("", &coverage(outcome)));
    lines
}

/// Data set, factor, true value, and estimate with its interval; none if the fit failed.
type EstimateRow<'a> = (usize, &'a str, f64, Option<(f64, (f64, f64))>);

fn estimates_table<'a>() -> Table<EstimateRow<'a>> {
    fn of(row: &EstimateRow<'_>, part: fn(f64, (f64, f64)) -> f64) -> f64 {
        row.3.map_or(f64::NAN, |(value, interval)| part(value, interval))
    }
    Table::<EstimateRow<'a>>::new(
        &["coverage.csv"],
        "One row per synthetic data set and factor of a coverage study. The last four columns are empty where the \
         fit failed.",
    )
    .number("data_set", "–", "Index of the data set.", |row| row.0 as f64)
    .text("factor", "Factor.", |row| row.1.to_owned())
    .number("truth", "–", "True value.", |row| row.2)
    .number("estimate", "–", "Estimate.", |row| of(row, |value, _| value))
    .number("low", "–", "Lower end of the interval of the estimate.", |row| of(row, |_, interval| interval.0))
    .number("high", "–", "Upper end.", |row| of(row, |_, interval| interval.1))
    .number("interval_holds_truth", "–", "1 if the interval contains the truth, else 0.", |row| {
        row.3.map_or(f64::NAN, |(_, (low, high))| f64::from(u8::from((low..=high).contains(&row.2))))
    })
}

fn estimates(outcome: &CoverageStudy) -> Result<NamedFile, ReportError> {
    let rows = outcome.fits.iter().enumerate().flat_map(|(number, twin)| {
        let fits = twin.truth.iter().zip(&outcome.factors).enumerate();
        fits.map(move |(place, (&truth, factor))| {
            let fit = twin.outcome.result().map(|found| (found.values[place], found.intervals[place]));
            (number, factor.name.as_str(), truth, fit)
        })
    });
    estimates_table().csv(&Names::default(), rows)
}
