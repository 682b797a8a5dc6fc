//! The record of a question in the folder of its report, from which it can be asked again.

use super::Question;
use crate::case::{Case, InputFile};
use crate::march::Backend;
use crate::march::backend_selection::{BackendKind, BackendOptions};
use crate::study::run_record::RunRecord;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A question, its case and all else that its answer depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct QuestionRecord {
    /// The version of bondline.
    pub version: String,
    /// Absolute path of the case file; empty for a case that was made from values.
    pub case: PathBuf,
    /// Changes to the case, as name and value.
    #[serde(default)]
    pub set: Vec<(String, String)>,
    /// The options of the session.
    pub session: SessionRecord,
    /// The question.
    pub question: Question,
    /// The files that the cases were read from.
    #[serde(default)]
    pub input_files: Vec<InputFile>,
}

/// The options of a session on which an answer depends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct SessionRecord {
    /// The backend that was chosen, with its precision.
    #[serde(flatten)]
    pub march: BackendOptions,
    /// Discretisation error for which cells and time steps were chosen, K; `None`: that of the case.
    #[serde(default)]
    pub tolerance_k: Option<f64>,
}

impl QuestionRecord {
    pub(crate) fn new(question: &Question, case: &Case, session: SessionRecord, run: &RunRecord) -> Self {
        let found = |file: &InputFile| InputFile { path: absolute(&file.path), ..file.clone() };
        Self {
            version: run.version.clone(),
            case: case.input_files().first().map_or_else(PathBuf::new, |file| absolute(&file.path).into()),
            set: case.overrides().to_vec(),
            session,
            question: question.clone(),
            input_files: run.input_files.iter().map(found).collect(),
        }
    }

    /// The text of `question.toml`.
    pub fn to_toml(&self) -> String {
        let text = toml::to_string(self).unwrap_or_else(|error| unreachable!("a record is plain data: {error}"));
        format!("# The question of this report: `bondline repeat FOLDER` asks it again.\n{text}")
    }

    /// Read a record from its text.
    ///
    /// # Errors
    /// When the text is not that of a record.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|error| error.to_string())
    }

    /// The files that have changed since, or cannot be read, one sentence each.
    pub fn changed_files(&self) -> Vec<String> {
        let change = |file: &InputFile| match std::fs::read(&file.path) {
            Ok(bytes) if InputFile::new(file.path.clone(), &bytes) == *file => None,
            Ok(_) => Some(format!("{} has changed since", file.path)),
            Err(error) => Some(format!("{}: {error}", file.path)),
        };
        self.input_files.iter().filter_map(change).collect()
    }
}

impl SessionRecord {
    pub(crate) fn new(options: &BackendOptions, backend: &Backend, tolerance_k: Option<f64>) -> Self {
        let kind = if backend.kind == "cpu" { BackendKind::Cpu } else { BackendKind::Gpu };
        let march = BackendOptions { backend: kind, precision: Some(backend.precision), ..options.clone() };
        Self { march, tolerance_k }
    }
}

/// The absolute path of a file; a case from a text in memory has its id.
fn absolute(path: &str) -> String {
    let absolute = std::path::absolute(path).ok().filter(|_| Path::new(path).exists());
    absolute.map_or_else(|| path.to_owned(), |path| path.display().to_string())
}
