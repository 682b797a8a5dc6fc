//! The results of one question about a case, which a session returns and a report shows.

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

/// The results of one question; a part that the question does not compute is `None`.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Answers {
    /// `predict`, `uncertainty`, `sensitivity`, `estimate`, `study`, `size`, `history`, `twin`,
    /// `merge`.
    pub question: &'static str,
    /// The case, with the options of the question in place of its own settings.
    pub case: Case,
    /// The other cases of a joint estimate.
    pub others: Vec<Case>,
    /// The backend that computed the marches.
    pub backend: Backend,
    /// Seed of the random draws; `None` without random draws.
    pub seed: Option<u64>,
    /// Run time by phase.
    pub seconds: Seconds,
    /// The prediction with nominal factors.
    pub nominal: Option<Nominal>,
    /// The Monte Carlo sweep.
    pub uncertainty: Option<Uncertainty>,
    /// The derivatives.
    pub sensitivity: Option<Sensitivity>,
    /// The estimate.
    pub estimated: Option<Estimated>,
    /// Reason why a study estimated no factor.
    pub not_estimated: Option<String>,
    /// The posterior distribution of the estimated factors.
    pub posterior: Option<Posterior>,
    /// The comparison with a second case.
    pub beside: Option<Beside>,
    /// The required thickness of a ply.
    pub sizing: Option<Sizing>,
    /// The heating of the hot face, from the inverse problem.
    pub history: Option<History>,
    /// Coverage of the intervals over fits to synthetic data sets.
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
