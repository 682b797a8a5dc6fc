//! Outcomes made visible: the page, the figures, the files and the screen. It computes nothing: every number
//! shown was found by a study.
//!
//! [`write()`] puts [`Answers`] into a folder; [`summary::screen`] says them in a terminal. What is shown of an answer
//! is in the file of its name.

mod answer;
mod chart;
mod contour;
mod estimate;
mod figure;
mod figures;
pub mod files;
mod findings;
#[cfg(test)]
mod fixture;
mod history;
mod html;
pub mod materials;
mod nominal;
mod observed;
mod recovery;
mod sensitivity;
mod size;
pub mod summary;
mod svg;
mod uncertainty;
mod warnings;
mod words;

use crate::case::Case;
use crate::march::Backend;
use crate::study::answers::Answers;
use crate::study::estimate::{Estimated, Fitted};
use crate::study::nominal::{Misfit, Nominal};
use files::{OutputFolder, record, tables};
use std::path::PathBuf;
use std::time::Instant;

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The folder holds the report of another case.
    #[error("{path:?} holds the case {found:?}, not {wanted:?}; choose another --out or give --force")]
    OtherCase {
        /// The file.
        path: PathBuf,
        /// The case that it holds.
        found: String,
        /// The case at hand.
        wanted: String,
    },
    /// The path of the folder is a file.
    #[error("{path:?} is not a folder")]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// A file or folder cannot be read, made, written, renamed or removed.
    #[error("{doing} {path:?}: {source}")]
    Io {
        /// What failed.
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A figure cannot be drawn.
    #[error("figure {id}: {message}")]
    Figure {
        /// The figure.
        id: String,
        /// Why.
        message: String,
    },
    /// A row of a table cannot be written.
    #[error("table {name}: {message}")]
    Table {
        /// The table.
        name: String,
        /// Why.
        message: String,
    },
    /// A Parquet file cannot be written.
    #[error("{path:?}: {message}")]
    Parquet {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// JSON cannot be written.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
}

impl Answers {
    /// What names the report: of several cases `lcat-2259+lcat-2330`.
    pub fn id(&self) -> String {
        let ids: Vec<&str> = self.cases().map(|case| case.id.as_str()).collect();
        ids.join("+")
    }

    /// What its analysts called the cases.
    fn name(&self) -> String {
        let names: Vec<&str> = self.cases().map(|case| case.name.as_str()).collect();
        words::listed(&names)
    }

    /// The march at the nominal factors, whichever answer has it.
    fn nominal_march(&self) -> Option<&Nominal> {
        answer::all(self).into_iter().find_map(|answer| answer.nominal())
    }

    /// The deepest sensor: the bondline, where there is one.
    fn bondline(&self) -> Option<usize> {
        let sensors = &self.case.sensors;
        (0..sensors.len()).max_by(|&a, &b| sensors[a].depth_m.total_cmp(&sensors[b].depth_m))
    }

    /// The case, and those that were estimated together with it.
    fn cases(&self) -> impl Iterator<Item = &Case> {
        std::iter::once(&self.case).chain(&self.others)
    }

    /// Every case of an estimate, with what came of it.
    fn fits<'a>(&'a self, outcome: &'a Estimated) -> impl Iterator<Item = (&'a Case, &'a Fitted)> {
        self.cases().zip(&outcome.fitted)
    }

    /// Every observation that an estimate was fitted to: of which sensor, and of which case where there are several; and
    /// its misfit before and after.
    fn misfits<'a>(&'a self, outcome: &'a Estimated) -> Vec<(String, &'a (Misfit, Misfit))> {
        let of = |(case, fitted): (&'a Case, &'a Fitted)| {
            let names = fitted.sensors.iter().map(move |&sensor| self.sensor(case, sensor));
            names.zip(&fitted.misfits)
        };
        self.fits(outcome).flat_map(of).collect()
    }

    /// `TC4`, or `TC4 of lcat-2330` where there are several cases.
    fn sensor(&self, case: &Case, sensor: usize) -> String {
        let name = &case.sensors[sensor].name;
        if self.others.is_empty() { name.clone() } else { format!("{name} of {}", case.id) }
    }
}

/// `cpu f64, AMD EPYC, 2 threads`.
fn backend_words(backend: &Backend) -> String {
    format!("{} {}, {}", backend.kind, backend.precision.name(), backend.name)
}

/// Put the whole report into a folder: `report.html`, `figures/*.svg`, the tables, and last `summary.json`.
///
/// Everything is made in memory first, so that a fault leaves the folder as it was.
///
/// # Errors
/// When a figure cannot be drawn or the folder cannot be written.
pub fn write(answers: &Answers, folder: &OutputFolder) -> Result<Vec<PathBuf>, ReportError> {
    let began = Instant::now();
    let figures = figures::in_sections(answers);
    let mut stills = Vec::with_capacity(figures.len());
    for (_, figure) in &figures {
        let still = svg::draw(figure).map_err(|message| ReportError::Figure { id: figure.id.clone(), message })?;
        stills.push(still);
    }
    let page = html::page(answers, &figures, &stills);
    let mut files: Vec<(String, Vec<u8>)> = tables::all(answers)?;
    for ((_, figure), still) in figures.iter().zip(stills) {
        files.push((format!("figures/{}.svg", figure.id), still.into_bytes()));
    }
    files.push(("report.html".to_owned(), page.into_bytes()));
    let names: Vec<String> = files.iter().map(|(name, _)| name).chain(folder.claimed()).cloned().collect();
    let summary = record::summary(answers, began.elapsed().as_secs_f64(), &names)?;
    files.push((files::SUMMARY.to_owned(), summary.into_bytes()));
    folder.write(&files)
}
