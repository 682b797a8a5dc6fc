//! The origin of the rows of the [log](super::work_log) of a study: in a file beside their
//! [journal](super::row_journal), and in a [part](super::log_part) for another process.

use super::checksum::{sealed, unsealed};
use super::sweep_piece::fingerprint;
use crate::case::Case;
use crate::march::Backend;
use crate::study::run_record::RunRecord;
use serde::{Deserialize, Serialize};

/// The study, and the number of its rows.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeptRows {
    /// When, by which version and command, and from which files the rows were made.
    pub(crate) run: RunRecord,
    /// Cases, backend, version and options, in words that differ if one of them does.
    pub(crate) study: String,
    /// Numbers of a row.
    pub(crate) columns: usize,
    /// Rows that are kept.
    pub(crate) finished: usize,
    /// Rows of the whole study, if that is known before its end.
    pub(crate) requested: Option<usize>,
}

impl KeptRows {
    /// No rows yet. `options` are those of the study.
    pub(crate) fn new<'a>(
        cases: impl Iterator<Item = &'a Case>,
        backend: &Backend,
        run: RunRecord,
        options: &str,
        (columns, requested): (usize, Option<usize>),
    ) -> Self {
        let cases: Vec<String> = cases.map(|case| format!("case {}", fingerprint(case))).collect();
        let backend = format!("{} {}", backend.kind, backend.precision.name());
        let version = format!("version {} {}", run.version, run.commit.as_deref().unwrap_or_default());
        let study = format!("{}, {backend}, {}, {options}", cases.join(", "), version.trim_end());
        Self { run, study, columns, finished: 0, requested }
    }

    pub(crate) fn to_json(&self) -> String {
        sealed(self)
    }

    /// # Errors
    /// When the text is not of rows, or does not have its checksum.
    pub(crate) fn from_json(text: &str) -> Result<Self, String> {
        serde_json::from_str(unsealed(text)?).map_err(|error| error.to_string())
    }
}
