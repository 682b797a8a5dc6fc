//! The next experiment: the depths of thermocouples, the exposure and the run length from which factors are estimated
//! best.
//!
//! Candidate depths are the interfaces and a grid inside the plies. Their readings are marched with exact derivatives
//! at members drawn from the prior of the estimated factors; the others are nominal, as in an estimate. The information
//! of a depth is the sum over its samples (Beck & Arnold, *Parameter Estimation in Engineering and Science*, 1977,
//! chapter 8); [`optimal_sets`] finds the best depths. Noise has the model of an estimate, so that the covariance is
//! the one that an estimate would state and faster sampling adds no information that correlated noise does not hold. A
//! tolerance of a depth is a nuisance parameter of its sensor with that standard deviation, which shifts its readings
//! by the temperature gradient.

mod candidates;
mod information;

pub use candidates::Candidate;

use crate::case::Case;
use crate::fit::optimal_design::{Criterion, InformationTable, Objective, OptimalSet, Robustness, optimal_sets};
use crate::march::{March, MarchError};
use crate::plan::{ErrorEstimate, Plan};
use crate::question::Design as DesignQuestion;
use crate::study::estimate::ParameterEstimates;
use crate::traces::Balance;
use information::{Information, gather};

/// A question with all that it leaves open to the case.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DesignRequest {
    /// The question, with its factors and its target, and run lengths in ascending order.
    pub question: DesignQuestion,
    /// The noise of the samples.
    pub noise: SampleNoise,
    /// Index of the sensor whose peak is predicted afterwards, in the first case; in the others that of its name.
    pub target: usize,
}

/// Noise of the samples of a thermocouple: the [noise model](crate::fit::noise_model) of an estimate, independent
/// between thermocouples.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SampleNoise {
    /// Standard deviation of a sample, K.
    pub deviation_k: f64,
    /// Correlation time, s; zero for white noise.
    pub correlation_time_s: f64,
    /// Fraction of white noise in the variance.
    pub white_fraction: f64,
    /// Where the standard deviation comes from.
    pub deviation_source: NoiseSource,
    /// Where the correlation comes from.
    pub correlation_source: NoiseSource,
}

/// Where a part of the noise model of a design comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseSource {
    /// It is stated.
    Stated,
    /// It is that of the residuals of an estimate from the observations of the first case.
    Estimated,
    /// It is neither stated nor are there observations.
    Assumed,
}

/// Standard deviation of a sample that is assumed without data, K.
const ASSUMED_DEVIATION_K: f64 = 2.0;

impl SampleNoise {
    /// The stated standard deviation and correlation time; what is not stated is assumed: 2 K, white.
    pub fn stated(deviation_k: Option<f64>, correlation_time_s: Option<f64>) -> Self {
        let source = |stated: Option<f64>| stated.map_or(NoiseSource::Assumed, |_| NoiseSource::Stated);
        Self {
            deviation_k: deviation_k.unwrap_or(ASSUMED_DEVIATION_K),
            correlation_time_s: correlation_time_s.unwrap_or(0.0),
            white_fraction: 0.0,
            deviation_source: source(deviation_k),
            correlation_source: source(correlation_time_s),
        }
    }

    /// Whether a part is not stated.
    pub fn is_assumed(&self) -> bool {
        [self.deviation_source, self.correlation_source].contains(&NoiseSource::Assumed)
    }

    /// This noise, with the parts that are not stated taken from the residuals of an estimate.
    pub fn or_estimated(self, found: &ParameterEstimates) -> Self {
        let estimated = Self {
            deviation_k: found.noise_deviation_k(),
            correlation_time_s: found.correlation_time_s,
            white_fraction: found.white_share,
            deviation_source: NoiseSource::Estimated,
            correlation_source: NoiseSource::Estimated,
        };
        let (by_deviation, by_correlation) = (
            if self.deviation_source == NoiseSource::Stated { self } else { estimated },
            if self.correlation_source == NoiseSource::Stated { self } else { estimated },
        );
        Self {
            deviation_k: by_deviation.deviation_k,
            deviation_source: by_deviation.deviation_source,
            ..by_correlation
        }
    }
}

/// Designs for several exposures and run lengths, the best first.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ExperimentDesign {
    /// The request.
    pub request: DesignRequest,
    /// Prior standard deviation of each factor, in the first case.
    pub prior_deviations: Vec<f64>,
    /// Exposures with their run lengths, by the criterion of their best design.
    pub scenarios: Vec<Scenario>,
    /// Information over depth and time in the best of them.
    pub map: InformationMap,
}

/// One exposure and run length.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Scenario {
    /// Index of the case.
    pub case: usize,
    /// Id of the case.
    pub case_id: String,
    /// Length of the run, s.
    pub run_length_s: f64,
    /// The candidate depths, and after them the thermocouples of the case.
    pub candidates: Vec<Candidate>,
    /// Number of candidates that may be chosen.
    pub selectable: usize,
    /// The best designs, the best first.
    pub designs: Vec<Design>,
    /// Whether all sets of depths were tried.
    pub is_exhaustive: bool,
    /// The best designs of 1, 2, … thermocouples; the last one is the best design.
    pub growth: Vec<Design>,
    /// Smallest expected standard error of each factor that any set of as many depths has, if it alone counts.
    pub smallest_errors: Vec<f64>,
    /// The thermocouples of the case as a design; `None` if it has none.
    pub existing: Option<Design>,
    /// Members that completed.
    pub members: usize,
    /// Members that failed and are left out.
    pub failed: usize,
    /// Estimated error of the readings at the candidates; `None` where cells and steps are stated.
    pub error_estimate: Option<ErrorEstimate>,
    /// Heat and mass in, out and stored of the nominal march.
    pub balance: Balance,
}

/// Depths and what they tell.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Design {
    /// Indices of the candidates, rising.
    pub candidates: Vec<usize>,
    /// The criterion; smaller is better.
    pub loss: f64,
    /// The criterion over the worst 5 % of the members.
    pub worst_loss: f64,
    /// Expected standard error of each factor: root mean square over the members.
    pub standard_errors: Vec<f64>,
    /// 5th and 95th percentile over the members of the standard error of each factor.
    pub error_ranges: Vec<(f64, f64)>,
    /// Correlation of the estimates, mean over the members.
    pub correlation: Vec<Vec<f64>>,
    /// Standard deviation of the predicted peak of the target, root mean square over the members, K.
    pub prediction_k: f64,
}

/// Information of a sample over depth and time at nominal factors.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct InformationMap {
    /// Instants, s.
    pub instants_s: Vec<f64>,
    /// Indices of the candidates, from the hot face to the back face.
    pub candidates: Vec<usize>,
    /// Factor × depth × instant: change of the temperature by one prior standard deviation of the factor, K.
    pub changes_k: Vec<Vec<Vec<f64>>>,
}

/// Errors of a design.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// A case lacks a factor.
    #[error("{case}: no factor is called {name:?}; there are {known}")]
    NoFactor {
        /// Id of the case.
        case: String,
        /// The name.
        name: String,
        /// The available names.
        known: String,
    },
    /// A case lacks the sensor whose peak is predicted.
    #[error("{case}: no sensor is called {name:?}, whose peak is to be predicted")]
    NoTarget {
        /// Id of the case.
        case: String,
        /// The name.
        name: String,
    },
    /// There are more candidate depths than sensors of a march.
    #[error("{case}: {found} candidate depths and thermocouples, expected at most {most}: widen the grid")]
    TooManyDepths {
        /// Id of the case.
        case: String,
        /// Number of candidate depths and thermocouples.
        found: usize,
        /// The largest number.
        most: u64,
    },
    /// No set of depths keeps the smallest distance.
    #[error(
        "{case}: no {sensors} of the {depths} depths are {distance_mm} mm apart: take fewer sensors, or allow less"
    )]
    NoRoom {
        /// Id of the case.
        case: String,
        /// Number of thermocouples.
        sensors: usize,
        /// Number of candidates.
        depths: usize,
        /// Smallest distance, mm.
        distance_mm: f64,
    },
    /// A run is longer than its exposure.
    #[error("{case}: a run of {run_s} s is longer than the exposure, {duration_s} s")]
    TooLong {
        /// Id of the case.
        case: String,
        /// Length of the run, s.
        run_s: f64,
        /// Duration of the exposure, s.
        duration_s: f64,
    },
    /// The backend has no derivatives.
    #[error("the backend has no derivatives: use the CPU")]
    NoDerivatives,
    /// A march of the prior failed.
    #[error("{case}: {failed} of {members} members failed, so that their prior is not represented")]
    TooManyFailed {
        /// Id of the case.
        case: String,
        /// Members that failed.
        failed: usize,
        /// Members drawn.
        members: usize,
    },
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Design an experiment for one or more exposures.
///
/// # Errors
/// When a case lacks a factor or the target, there is no room for the sensors, a run is too long, too many members
/// fail, or the device fails.
pub fn design_experiment(
    cases: &[Case],
    march: &mut dyn March,
    request: &DesignRequest,
    adapt: &mut dyn FnMut(&Case) -> Result<Plan, MarchError>,
) -> Result<ExperimentDesign, DesignError> {
    let target = cases.first().and_then(|case| case.sensors.get(request.target)).map(|sensor| sensor.name.as_str());
    let mut found: Vec<(Scenario, usize)> = Vec::new();
    let mut information_of_cases: Vec<Information> = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        let information = gather(case, target.unwrap_or_default(), march, request, adapt)?;
        for (table, &run_length_s) in information.tables.iter().zip(&information.run_lengths_s) {
            let scenario = scenario(case, index, &information, table, run_length_s, request)?;
            found.push((scenario, information_of_cases.len()));
        }
        information_of_cases.push(information);
    }
    found.sort_by(|a, b| a.0.designs[0].loss.total_cmp(&b.0.designs[0].loss));
    let map = information_of_cases[found[0].1].map(found[0].0.run_length_s);
    let prior_deviations = information_of_cases[0].deviations.clone();
    let scenarios = found.into_iter().map(|(scenario, _)| scenario).collect();
    Ok(ExperimentDesign { request: request.clone(), prior_deviations, scenarios, map })
}

fn scenario(
    case: &Case,
    index: usize,
    information: &Information,
    table: &InformationTable,
    run_length_s: f64,
    request: &DesignRequest,
) -> Result<Scenario, DesignError> {
    let objective = Objective {
        table,
        criterion: request.question.criterion,
        robustness: request.question.robustness(),
        prediction: &information.prediction,
    };
    let (candidates, selectable) = (&information.candidates, information.selectable);
    let apart_m = request.question.least_distance_m * (1.0 - 1e-9);
    let compatible = |one: usize, other: usize| (candidates[one].depth_m - candidates[other].depth_m).abs() >= apart_m;
    let design = |set: &OptimalSet| information.design(&objective, set);
    let mut growth = Vec::new();
    let (mut best, mut is_exhaustive) = (Vec::new(), false);
    for size in 1..=request.question.sensors {
        (best, is_exhaustive) = optimal_sets(&objective, selectable, size, &compatible, request.question.seed);
        let first = best.first().ok_or_else(|| DesignError::NoRoom {
            case: case.id.clone(),
            sensors: size,
            depths: selectable,
            distance_mm: 1e3 * request.question.least_distance_m,
        })?;
        growth.push(design(first));
    }
    let alone = |factor: usize| {
        let n = table.parameters();
        let unit: Vec<f64> = (0..n * table.members()).map(|i| if i % n == factor { 1.0 } else { 0.0 }).collect();
        let variance =
            Objective { criterion: Criterion::C, robustness: Robustness::Mean, prediction: &unit, ..objective };
        let (best, _) =
            optimal_sets(&variance, selectable, request.question.sensors, &compatible, request.question.seed);
        best.first().map_or(f64::NAN, |set| information.deviations[factor] * set.loss.sqrt())
    };
    let own: Vec<usize> = (selectable..candidates.len()).collect();
    let existing =
        (!own.is_empty()).then(|| design(&OptimalSet { loss: objective.loss(&own), candidates: own.clone() }));
    Ok(Scenario {
        case: index,
        case_id: case.id.clone(),
        run_length_s,
        candidates: candidates.clone(),
        selectable,
        designs: best.iter().map(design).collect(),
        is_exhaustive,
        growth,
        smallest_errors: (0..table.parameters()).map(alone).collect(),
        existing,
        members: table.members(),
        failed: information.failed,
        error_estimate: information.error_estimate.clone(),
        balance: information.balance,
    })
}
