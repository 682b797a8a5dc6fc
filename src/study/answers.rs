//! The results of one question about a case, which a session returns and a report shows.

use super::coverage_study::CoverageStudy;
use super::depth_profiles::DepthProfiles;
use super::driver_emissivity::DriverEmissivity;
use super::driver_smoothing::DriverSmoothing;
use super::estimate::ParameterEstimates;
use super::experiment_design::ExperimentDesign;
use super::flux_inversion::FluxInversion;
use super::model_comparison::ModelComparison;
use super::nominal::Prediction;
use super::observation_check::ObservationCheck;
use super::posterior::Posterior;
use super::run_record::RunRecord;
use super::sensitivity::Sensitivity;
use super::sequential_sampling::PrecisionReached;
use super::size::Sizing;
use super::timing::Timing;
use super::trade::Trade;
use super::uncertainty::Uncertainty;
use crate::case::Case;
use crate::march::Backend;
use crate::question::QuestionRecord;

/// The results of one question; a part that the question does not compute is `None`.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub struct Answers {
    /// The name of the question, or `merge`.
    pub question: &'static str,
    /// The case, with the options of the question in place of its own settings.
    pub case: Case,
    /// The other cases of a joint estimate, and those of other exposures.
    pub other_cases: Vec<Case>,
    /// The backend that computed the marches.
    pub backend: Backend,
    /// Seed of the random draws; `None` without random draws.
    pub seed: Option<u64>,
    /// Run time by phase.
    pub timing: Timing,
    /// When, by which command and from which files.
    pub run: RunRecord,
    /// The question as it was asked, that of the whole sweep for merged parts; `None` before it is answered.
    #[serde(skip)]
    pub asked: Option<QuestionRecord>,
    /// The check of the observations.
    pub observation_check: Option<ObservationCheck>,
    /// The prediction with nominal factors.
    pub nominal: Option<Prediction>,
    /// The effect of smoothing the temperature of a held face; `None` if none was smoothed.
    pub driver_smoothing: Option<DriverSmoothing>,
    /// The effect of the emissivity by which readings of a pyrometer were converted; `None` if none holds the hot face.
    pub driver_emissivity: Option<DriverEmissivity>,
    /// The Monte Carlo sweep.
    pub uncertainty: Option<Uncertainty>,
    /// The percentile or the probability that was sampled until its interval was narrow enough.
    pub precision_reached: Option<PrecisionReached>,
    /// Profiles through the thickness.
    pub depth_profiles: Option<DepthProfiles>,
    /// The derivatives.
    pub sensitivity: Option<Sensitivity>,
    /// The estimate.
    pub estimated: Option<ParameterEstimates>,
    /// Reason why a study estimated no factor.
    pub not_estimated: Option<String>,
    /// The posterior distribution of the estimated factors.
    pub posterior: Option<Posterior>,
    /// The comparison with a second case.
    pub model_comparison: Option<ModelComparison>,
    /// The required thickness of a ply.
    pub sizing: Option<Sizing>,
    /// Layups of a trade study, by mass.
    pub trade: Option<Trade>,
    /// The heating of the hot face, from the inverse problem.
    pub flux_inversion: Option<FluxInversion>,
    /// The design of an experiment.
    pub experiment_design: Option<ExperimentDesign>,
    /// Coverage of the intervals over fits to synthetic data sets.
    pub coverage_study: Option<CoverageStudy>,
}

impl Answers {
    pub(crate) fn new(question: &'static str, case: Case, backend: Backend, seconds: Timing, run: RunRecord) -> Self {
        Self {
            question,
            case,
            other_cases: Vec::new(),
            backend,
            seed: None,
            timing: seconds,
            run,
            asked: None,
            observation_check: None,
            nominal: None,
            driver_smoothing: None,
            driver_emissivity: None,
            uncertainty: None,
            precision_reached: None,
            depth_profiles: None,
            sensitivity: None,
            estimated: None,
            not_estimated: None,
            posterior: None,
            model_comparison: None,
            sizing: None,
            trade: None,
            flux_inversion: None,
            experiment_design: None,
            coverage_study: None,
        }
    }
}
