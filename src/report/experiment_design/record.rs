//! The key `experiment_design` of `summary.json`.

use super::case_of;
use crate::fit::optimal_design::{Criterion, Robustness};
use crate::report::files::json::OrderedMap;
use crate::study::answers::Answers;
use crate::study::experiment_design::{Design, ExperimentDesign, NoiseSource, Scenario};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct DesignRecord<'a> {
    criterion: Criterion,
    robustness: Robustness,
    noise_k: f64,
    noise_source: NoiseSource,
    correlation_time_s: f64,
    white_noise_share: f64,
    correlation_source: NoiseSource,
    least_distance_m: f64,
    position_tolerance_m: f64,
    target: &'a str,
    prior_deviations: OrderedMap<'a, f64>,
    scenarios: Vec<ScenarioRecord<'a>>,
}

#[derive(Serialize)]
struct ScenarioRecord<'a> {
    case: &'a str,
    run_length_s: f64,
    members: usize,
    failed: usize,
    candidates: usize,
    exhaustive: bool,
    designs: Vec<OneDesign<'a>>,
    growth: Vec<OneDesign<'a>>,
    smallest_errors: OrderedMap<'a, f64>,
    existing: Option<OneDesign<'a>>,
}

#[derive(Serialize)]
struct OneDesign<'a> {
    depths: Vec<Depth<'a>>,
    criterion: f64,
    criterion_worst: f64,
    standard_errors: OrderedMap<'a, f64>,
    correlation: &'a [Vec<f64>],
    prediction_k: f64,
}

#[derive(Serialize)]
struct Depth<'a> {
    depth_m: f64,
    ply: &'a str,
    interface: bool,
}

impl<'a> DesignRecord<'a> {
    pub(super) fn of(answers: &'a Answers, outcome: &'a ExperimentDesign) -> Self {
        let request = &outcome.request;
        Self {
            criterion: request.question.criterion,
            robustness: request.question.robustness(),
            noise_k: request.noise.deviation_k,
            noise_source: request.noise.deviation_source,
            correlation_time_s: request.noise.correlation_time_s,
            white_noise_share: request.noise.white_fraction,
            correlation_source: request.noise.correlation_source,
            least_distance_m: request.question.least_distance_m,
            position_tolerance_m: request.question.position_tolerance_m,
            target: &answers.case.sensors[request.target].name,
            prior_deviations: by_factor(outcome, &outcome.prior_deviations),
            scenarios: outcome.scenarios.iter().map(|scenario| scenario_record(answers, outcome, scenario)).collect(),
        }
    }
}

fn by_factor<'a>(outcome: &'a ExperimentDesign, values: &[f64]) -> OrderedMap<'a, f64> {
    OrderedMap(outcome.request.question.factors.iter().map(String::as_str).zip(values.iter().copied()).collect())
}

fn scenario_record<'a>(
    answers: &'a Answers,
    outcome: &'a ExperimentDesign,
    scenario: &'a Scenario,
) -> ScenarioRecord<'a> {
    let plies = &case_of(answers, scenario).layup.plies;
    let design = |design: &'a Design| OneDesign {
        depths: design
            .candidates
            .iter()
            .map(|&index| &scenario.candidates[index])
            .map(|found| Depth { depth_m: found.depth_m, ply: &plies[found.ply].name, interface: found.is_interface })
            .collect(),
        criterion: design.loss,
        criterion_worst: design.worst_loss,
        standard_errors: by_factor(outcome, &design.standard_errors),
        correlation: &design.correlation,
        prediction_k: design.prediction_k,
    };
    ScenarioRecord {
        case: &scenario.case_id,
        run_length_s: scenario.run_length_s,
        members: scenario.members,
        failed: scenario.failed,
        candidates: scenario.selectable,
        exhaustive: scenario.is_exhaustive,
        designs: scenario.designs.iter().map(design).collect(),
        growth: scenario.growth.iter().map(design).collect(),
        smallest_errors: by_factor(outcome, &scenario.smallest_errors),
        existing: scenario.existing.as_ref().map(design),
    }
}
