//! The answers to one question about a case, which a session leaves and a report shows.

use super::beside::Beside;
use super::estimate::Estimated;
use super::history::History;
use super::nominal::Nominal;
use super::posterior::Posterior;
use super::recovery::Recovery;
use super::seconds::Seconds;
use super::sensitivity::Sensitivity;
use super::size::Sizing;
use super::uncertainty::Uncertainty;
use crate::case::Case;
use crate::march::Backend;

/// The answers to a question.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
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
    pub(crate) fn new(question: &'static str, case: Case, backend: Backend, seconds: Seconds) -> Self {
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
