//! The report of a study.

use super::error::SessionError;
use crate::report::{self, files::OutputFolder, terminal};
use crate::study::answers::Answers;
use std::path::PathBuf;

impl Answers {
    /// Write the report into a folder: the page, figures, tables and `summary.json`. Returns the paths of the files,
    /// `summary.json` last.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn report(&self, folder: &OutputFolder) -> Result<Vec<PathBuf>, SessionError> {
        Ok(report::write(self, folder)?)
    }

    /// The report as text for a terminal.
    pub fn summary(&self) -> String {
        terminal::screen(self)
    }
}
