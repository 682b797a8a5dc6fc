//! Reports of study results: the HTML page, figures, tables, `summary.json` and the terminal output. Nothing is
//! computed here; the studies compute every number.
//!
//! [`write()`] writes the report of [`Answers`] into a folder, [`terminal::screen`] formats it for a terminal. The part
//! of each study is in the module of its name.

mod braille;
mod chart;
mod contour;
mod coverage_study;
mod depth_profiles;
mod driver_emissivity;
mod driver_smoothing;
mod estimate;
mod experiment_design;
mod figure;
mod figures;
pub mod files;
mod findings;
mod format;
mod history;
mod html;
#[cfg(test)]
mod marched;
mod margins;
pub mod materials;
mod nominal;
mod observation_check;
mod observations;
mod reportable;
mod sensitivity;
mod sequential_sampling;
mod size;
mod svg;
pub mod terminal;
mod ticks;
mod trade;
mod uncertainty;
mod warnings;

use crate::case::Case;
use crate::march::Backend;
use crate::study::answers::Answers;
use crate::study::estimate::{CaseFit, ParameterEstimates};
use crate::study::nominal::{Misfit, Prediction};
use files::table::TableDescription;
use files::{OutputFolder, summary_json, tables};
use reportable::Reportable;
use std::path::PathBuf;
use std::time::Instant;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The folder holds the report of another case.
    #[error("{path:?} holds the case {found:?}, not {expected:?}; choose another folder, or force its replacement")]
    OtherCase {
        /// The folder.
        path: PathBuf,
        /// Id of the case whose report it holds.
        found: String,
        /// Id of the case to be written.
        expected: String,
    },
    /// The path of the folder is a file.
    #[error("{path:?} is not a folder")]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// Another process writes the folder, or the same file of it.
    #[error("{path:?} is being written by {}; wait until it ends, or choose another folder", holder_text(holder))]
    Locked {
        /// The folder or file.
        path: PathBuf,
        /// `process 4711 on host since 2026-11-24T14:20:12Z`; empty if it is not known.
        holder: String,
    },
    /// A file or folder cannot be read, made, written, renamed or removed.
    #[error("{operation} {path:?}: {source}")]
    Io {
        /// The operation, such as `writing`.
        operation: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A row of a table cannot be written.
    #[error("table {name}: {message}")]
    Table {
        /// Name of its file.
        name: String,
        /// The error of the CSV writer.
        message: String,
    },
    /// A Parquet file cannot be written.
    #[error("{path:?}: {message}")]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The error of the Parquet writer.
        message: String,
    },
    /// JSON cannot be written.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
}

fn holder_text(holder: &str) -> &str {
    if holder.is_empty() { "another process" } else { holder }
}

/// Functions over all kinds of results.
macro_rules! results {
    ($($result:ident),* $(,)?) => {
        impl Answers {
            /// The results of the run, in the order of their figures and tables.
            fn results(&self) -> Vec<&dyn Reportable> {
                let each = [$(self.$result.as_ref().map(|found| found as &dyn Reportable)),*];
                each.into_iter().flatten().collect()
            }
        }

        /// Descriptions of the tables of all results.
        fn table_descriptions() -> Vec<TableDescription> {
            fn of<T: Reportable>(_: fn(&Answers) -> &Option<T>) -> Vec<TableDescription> {
                T::table_descriptions()
            }
            [$(of(|answers| &answers.$result)),*].concat()
        }
    };
}

// A new kind of result is registered here. An estimate includes its posterior and the model comparison.
results!(
    observation_check,
    nominal,
    driver_smoothing,
    driver_emissivity,
    precision_reached,
    uncertainty,
    depth_profiles,
    sensitivity,
    estimated,
    sizing,
    trade,
    flux_inversion,
    experiment_design,
    coverage_study,
);

impl Answers {
    /// Id of the report: the ids of its cases, joined as `lcat-2259+lcat-2330`.
    pub fn id(&self) -> String {
        let ids: Vec<&str> = self.cases().map(|case| case.id.as_str()).collect();
        ids.join("+")
    }

    /// Names of the cases, as a list.
    fn name(&self) -> String {
        let names: Vec<&str> = self.cases().map(|case| case.name.as_str()).collect();
        format::list(&names)
    }

    /// The march at the nominal factors, of the first study that has one.
    fn nominal_march(&self) -> Option<&Prediction> {
        self.results().into_iter().find_map(|answer| answer.nominal())
    }

    /// Index of the deepest sensor, which is at the bondline if any sensor is.
    fn deepest_sensor(&self) -> Option<usize> {
        let sensors = &self.case.sensors;
        (0..sensors.len()).max_by(|&a, &b| sensors[a].depth_m.total_cmp(&sensors[b].depth_m))
    }

    /// The case, and those estimated jointly with it.
    fn cases(&self) -> impl Iterator<Item = &Case> {
        std::iter::once(&self.case).chain(&self.other_cases)
    }

    /// Every case of an estimate with its fit.
    fn fits<'a>(&'a self, outcome: &'a ParameterEstimates) -> impl Iterator<Item = (&'a Case, &'a CaseFit)> {
        self.cases().zip(&outcome.fitted)
    }

    /// Every fitted sensor, named with its case where there are several, with its misfits at the nominal and at the
    /// estimated factors.
    fn misfits<'a>(&'a self, outcome: &'a ParameterEstimates) -> Vec<(String, &'a (Misfit, Misfit))> {
        let of = |(case, fitted): (&'a Case, &'a CaseFit)| {
            let names = fitted.sensors.iter().map(move |&sensor| self.sensor_name(case, sensor));
            names.zip(&fitted.misfits)
        };
        self.fits(outcome).flat_map(of).collect()
    }

    /// `TC4`, or `TC4 of lcat-2330` where there are several cases.
    fn sensor_name(&self, case: &Case, sensor: usize) -> String {
        let name = &case.sensors[sensor].name;
        if self.other_cases.is_empty() { name.clone() } else { format!("{name} of {}", case.id) }
    }
}

/// `cpu f64, AMD EPYC, 2 threads`.
fn backend_text(backend: &Backend) -> String {
    format!("{} {}, {}", backend.kind, backend.precision.name(), backend.name)
}

/// Write the report into a folder: `report.html`, `figures/*.svg`, the tables, and last
/// `summary.json`.
///
/// An error leaves the folder unchanged: a complete report takes the place of the earlier one.
///
/// # Errors
/// When the folder cannot be written.
pub fn write(answers: &Answers, folder: &OutputFolder) -> Result<Vec<PathBuf>, ReportError> {
    let began = Instant::now();
    let figures = figures::in_sections(answers);
    let stills: Vec<String> = figures.iter().map(|(_, figure)| svg::draw(figure)).collect();
    let mut files: Vec<(String, Vec<u8>)> = tables::all(answers)?;
    for ((_, figure), still) in figures.iter().zip(&stills) {
        files.push((format!("figures/{}.svg", figure.id), still.as_bytes().to_vec()));
    }
    if let Some(asked) = &answers.asked {
        files.push(("question.toml".to_owned(), asked.to_toml().into_bytes()));
    }
    files.push(("report.html".to_owned(), Vec::new()));
    let names: Vec<String> = files.iter().map(|(name, _)| name).chain(folder.reserved()).cloned().collect();
    if let Some((_, page)) = files.last_mut() {
        *page = html::page(answers, &figures, &stills, &names).into_bytes();
    }
    let summary = summary_json::summary(answers, began.elapsed().as_secs_f64(), &names)?;
    files.push((files::SUMMARY.to_owned(), summary.into_bytes()));
    folder.write(&files)
}
