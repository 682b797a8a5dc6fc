//! What a session found, as its report needs it.

#[cfg(feature = "report")]
use super::error::SessionError;
use crate::case::Case;
use crate::march::Backend;
#[cfg(feature = "report")]
use crate::report::{self, Story, files::OutputFolder, summary};
use crate::study::beside::Beside;
use crate::study::estimate::Estimated;
use crate::study::history::History;
use crate::study::nominal::Nominal;
use crate::study::posterior::Posterior;
use crate::study::recovery::Recovery;
use crate::study::seconds::Seconds;
use crate::study::sensitivity::Sensitivity;
use crate::study::size::Sizing;
use crate::study::uncertainty::Uncertainty;
#[cfg(feature = "report")]
use std::path::PathBuf;

/// The answers to a question.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Answers {
    /// `predict`, `uncertainty`, `sensitivity`, `estimate`, `study`, `size`, `history`, `twin`,
    /// `merge`.
    pub question: &'static str,
    /// The case, with the options of the question in place of its own.
    pub case: Case,
    /// The cases that were estimated together with it.
    pub others: Vec<Case>,
    /// What marched.
    pub backend: Backend,
    /// The seed of the random draws; `None` where there were none.
    pub seed: Option<u64>,
    /// Where the time went.
    pub seconds: Seconds,
    /// The prediction with nominal factors.
    pub nominal: Option<Nominal>,
    /// The Monte Carlo sweep.
    pub uncertainty: Option<Uncertainty>,
    /// The derivatives.
    pub sensitivity: Option<Sensitivity>,
    /// The estimate.
    pub estimated: Option<Estimated>,
    /// Why a study estimated nothing.
    pub not_estimated: Option<String>,
    /// The posterior of the estimate.
    pub posterior: Option<Posterior>,
    /// The comparison with another case.
    pub beside: Option<Beside>,
    /// The thickness of a ply.
    pub sizing: Option<Sizing>,
    /// The heating of the hot face.
    pub history: Option<History>,
    /// Fits of synthetic data sets.
    pub recovery: Option<Recovery>,
}

impl Answers {
    pub(super) fn new(question: &'static str, case: Case, backend: Backend, seconds: Seconds) -> Self {
        Self {
            question,
            case,
            others: Vec::new(),
            backend,
            seed: None,
            seconds,
            nominal: None,
            uncertainty: None,
            sensitivity: None,
            estimated: None,
            not_estimated: None,
            posterior: None,
            beside: None,
            sizing: None,
            history: None,
            recovery: None,
        }
    }
}

#[cfg(feature = "report")]
impl Answers {
    /// Write the report into a folder: the page, figures, tables and `summary.json`, whose path is the last of those
    /// returned.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn report(&self, folder: &OutputFolder) -> Result<Vec<PathBuf>, SessionError> {
        Ok(report::write(&self.story(), folder)?)
    }

    /// The report as text for a terminal.
    pub fn summary(&self) -> String {
        summary::screen(&self.story())
    }

    /// The input of a report.
    pub fn story(&self) -> Story<'_> {
        Story {
            case: &self.case,
            others: &self.others,
            command: self.question,
            version: env!("CARGO_PKG_VERSION"),
            backend: &self.backend,
            seed: self.seed,
            seconds: self.seconds,
            nominal: self.nominal.as_ref(),
            uncertainty: self.uncertainty.as_ref(),
            sensitivity: self.sensitivity.as_ref(),
            estimated: self.estimated.as_ref(),
            posterior: self.posterior.as_ref(),
            beside: self.beside.as_ref(),
            sizing: self.sizing.as_ref(),
            history: self.history.as_ref(),
            recovery: self.recovery.as_ref(),
        }
    }
}
