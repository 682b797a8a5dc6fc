//! The tables of an estimate.

use crate::case::Case;
use crate::report::ReportError;
use crate::report::figures::file_name;
use crate::report::files::table::CsvTable;
use crate::report::files::table::NamedFile;
use crate::report::files::tables::{header, traces_table};
use crate::study::answers::Answers;
use crate::study::estimate::{CaseFit, Landscape, ParameterEstimates};

/// Residuals of every case, traces of further cases, iterations, profiles and landscape.
pub(super) fn all(answers: &Answers, outcome: &ParameterEstimates) -> Result<Vec<NamedFile>, ReportError> {
    let mut tables = Vec::new();
    for (which, (case, fitted)) in answers.fits(outcome).enumerate() {
        if which == 0 {
            tables.push(residuals("residuals.csv", case, fitted)?);
            continue;
        }
        let name = |table: &str| format!("{}.csv", file_name(table, &case.id));
        tables.push(traces_table(&name("traces"), case, &fitted.before, Some(&fitted.after))?);
        tables.push(residuals(&name("residuals"), case, fitted)?);
    }
    tables.push(iterations_table(outcome)?);
    if !outcome.profiles.is_empty() {
        tables.push(profiles(outcome)?);
    }
    if let Some(landscape) = &outcome.landscape {
        tables.push(landscape_table(outcome, landscape)?);
    }
    Ok(tables)
}

fn residuals(name: &str, case: &Case, fitted: &CaseFit) -> Result<NamedFile, ReportError> {
    let mut table = CsvTable::new(name, ["sensor", "time_s", "residual_K"])?;
    for (&sensor, (times_s, residuals_k)) in fitted.sensors.iter().zip(&fitted.residuals) {
        for (&time_s, &residual_k) in times_s.iter().zip(residuals_k) {
            table.row(Some(&case.sensors[sensor].name), [time_s, residual_k])?;
        }
    }
    table.finish()
}

fn iterations_table(outcome: &ParameterEstimates) -> Result<NamedFile, ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let columns = names.chain(["objective".to_owned(), "damping".to_owned()]);
    let mut table = CsvTable::new("iterations.csv", header(&["iteration"], columns))?;
    for (iteration, turn) in outcome.iterations.iter().enumerate() {
        let values = turn.values.iter().copied().chain([turn.objective, turn.damping]);
        table.row(Some(&iteration.to_string()), values)?;
    }
    table.finish()
}

fn profiles(outcome: &ParameterEstimates) -> Result<NamedFile, ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let mut table =
        CsvTable::new("profiles.csv", header(&["profiled_factor"], names.chain(["objective_rise".to_owned()])))?;
    for profile in &outcome.profiles {
        for (point, &rise) in profile.points.iter().zip(&profile.rises) {
            let profiled = &outcome.factors[profile.factor].factor.name;
            table.row(Some(profiled), point.iter().copied().chain([rise]))?;
        }
    }
    table.finish()
}

fn landscape_table(outcome: &ParameterEstimates, landscape: &Landscape) -> Result<NamedFile, ReportError> {
    let names = outcome.factors.iter().map(|factor| factor.factor.name.clone());
    let columns = names.take(2).chain(["objective", "is_line_minimum"].map(str::to_owned));
    let mut table = CsvTable::new("landscape.csv", columns)?;
    for (line, objective) in landscape.objective.iter().enumerate() {
        for (node, &s) in objective.iter().enumerate() {
            let is_least = f64::from(u8::from(node == landscape.valley));
            table.row(None, [landscape.x[line][node], landscape.y[line][node], s, is_least])?;
        }
    }
    table.finish()
}
