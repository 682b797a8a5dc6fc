//! The tables of an estimate.

use crate::case::Case;
use crate::report::ReportError;
use crate::report::figures::file_name;
use crate::report::files::table::{NamedFile, Names, Table};
use crate::report::files::tables::traces_file;
use crate::study::answers::Answers;
use crate::study::estimate::{CaseFit, Iteration, Landscape, ParameterEstimates};

/// Residuals of every case, traces of further cases, iterations, profiles and landscape.
pub(super) fn all(answers: &Answers, outcome: &ParameterEstimates) -> Result<Vec<NamedFile>, ReportError> {
    let names = Names::of_factors(outcome.factors.iter().map(|factor| &factor.factor.name));
    let mut tables = Vec::new();
    for (which, (case, fitted)) in answers.fits(outcome).enumerate() {
        if which == 0 {
            tables.push(residuals_table().csv(&names, residuals(case, fitted))?);
            continue;
        }
        let name = |table: &str| format!("{}.csv", file_name(table, &case.id));
        tables.push(traces_file(&name("traces"), case, &fitted.before, Some(&fitted.after))?);
        tables.push(residuals_table().csv_as(&name("residuals"), &names, residuals(case, fitted))?);
    }
    tables.push(iterations_table().csv(&names, outcome.iterations.iter().enumerate())?);
    if !outcome.profiles.is_empty() {
        tables.push(profiles_table().csv(&names, profiles(outcome))?);
    }
    if let Some(landscape) = &outcome.landscape {
        let names = Names::of_factors(names.factors.iter().take(2));
        tables.push(landscape_table().csv(&names, nodes(landscape))?);
    }
    Ok(tables)
}

/// Sensor, time and residual.
type ResidualRow<'a> = (&'a str, f64, f64);

pub(in crate::report) fn residuals_table<'a>() -> Table<ResidualRow<'a>> {
    Table::<ResidualRow<'a>>::new(
        &["residuals.csv", "residuals-<case>.csv", "history-residuals.csv"],
        "Misfit of an estimate, one row per sample (`estimate`, `study`, `history`).",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("time_s", "s", "Time.", |row| row.1)
    .number("residual_k", "K", "Measured less predicted temperature.", |row| row.2)
}

fn residuals<'a>(case: &'a Case, fitted: &'a CaseFit) -> impl Iterator<Item = ResidualRow<'a>> {
    fitted.sensors.iter().zip(&fitted.residuals).flat_map(move |(&sensor, (times_s, residuals_k))| {
        let samples = times_s.iter().zip(residuals_k);
        samples.map(move |(&time_s, &residual_k)| (case.sensors[sensor].name.as_str(), time_s, residual_k))
    })
}

pub(super) fn iterations_table<'a>() -> Table<(usize, &'a Iteration)> {
    Table::<(usize, &'a Iteration)>::new(
        &["iterations.csv"],
        "Path of an estimate, one row per iteration (`estimate`, `study`).",
    )
    .number("iteration", "–", "Number of the iteration; 0 is the start.", |row| row.0 as f64)
    .numbers("<factor>", "–", "Value of the factor.", |row| row.1.values.clone())
    .number("objective", "–", "Objective: weighted sum of squares, with loss and prior.", |row| row.1.objective)
    .number("damping", "–", "Levenberg–Marquardt damping.", |row| row.1.damping)
}

/// The profiled factor, a point of its profile, and the rise of the objective.
type ProfileRow<'a> = (&'a str, &'a [f64], f64);

pub(super) fn profiles_table<'a>() -> Table<ProfileRow<'a>> {
    Table::<ProfileRow<'a>>::new(&["profiles.csv"], "One row per point of a profile likelihood.")
        .text("profiled_factor", "The factor that is held at its value in this row.", |row| row.0.to_owned())
        .numbers("<factor>", "–", "Value of the factor; all but the profiled one are optimised.", |row| {
            row.1.to_vec()
        })
        .number("objective_rise", "–", "Rise of the objective above its minimum.", |row| row.2)
}

fn profiles(outcome: &ParameterEstimates) -> impl Iterator<Item = ProfileRow<'_>> {
    outcome.profiles.iter().flat_map(|profile| {
        let profiled = outcome.factors[profile.factor].factor.name.as_str();
        let points = profile.points.iter().zip(&profile.rises);
        points.map(move |(point, &rise)| (profiled, point.as_slice(), rise))
    })
}

/// Line and node of the map.
type NodeRow<'a> = (&'a Landscape, usize, usize);

pub(super) fn landscape_table<'a>() -> Table<NodeRow<'a>> {
    Table::<NodeRow<'a>>::new(
        &["landscape.csv"],
        "The objective over two factors, where two are estimated (`estimate`, `study`).",
    )
    .numbers("<factor>", "–", "Value of the factor.", |(map, line, node)| {
        vec![map.x[*line][*node], map.y[*line][*node]]
    })
    .number("objective", "–", "Objective.", |(map, line, node)| map.objective[*line][*node])
    .number("is_line_minimum", "–", "1 at the minimum of each line of the map, else 0.", |(map, _, node)| {
        f64::from(u8::from(*node == map.valley))
    })
}

fn nodes(map: &Landscape) -> impl Iterator<Item = NodeRow<'_>> {
    let lines = map.objective.iter().enumerate();
    lines.flat_map(move |(line, objective)| (0..objective.len()).map(move |node| (map, line, node)))
}
