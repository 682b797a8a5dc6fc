//! The key `posterior` of `summary.json`.

use crate::case::Case;
use crate::report::files::json::OrderedMap;
use crate::study::answers::Answers;
use crate::study::estimate::ParameterEstimates;
use crate::study::posterior::{Posterior, PosteriorPredictive, PredictiveBand, SensorPredictive};
use serde::Serialize;

/// Keys in the order written.
#[derive(Serialize)]
pub(in crate::report::estimate) struct PosteriorRecord<'a> {
    walkers: usize,
    iterations: usize,
    annealing: usize,
    burn_in: usize,
    acceptance: f64,
    marches: usize,
    converged: bool,
    factors: OrderedMap<'a, MarginalRecord>,
    correlation: Vec<Vec<f64>>,
    discrepancy: DiscrepancyRecord,
    /// Case → sensor → predictive intervals.
    predicted: OrderedMap<'a, OrderedMap<'a, PredictiveIntervals>>,
}

#[derive(Serialize)]
struct MarginalRecord {
    median: f64,
    low: f64,
    high: f64,
    r_hat: f64,
    /// Integrated autocorrelation time, in iterations.
    autocorrelation_time: f64,
    effective_samples: f64,
}

#[derive(Serialize)]
struct DiscrepancyRecord {
    /// Amplitude in units of the effect of the prior standard deviations of all factors.
    relative_amplitude: f64,
    amplitude_k: f64,
    /// Infinite, and so `null`, where the discrepancy is constant in time.
    correlation_time_s: f64,
}

/// Predictive intervals by the factors only, and with model discrepancy.
#[derive(Serialize)]
struct PredictiveIntervals {
    parameters: PeakInterval,
    with_discrepancy: PeakInterval,
}

/// Predictive interval of a sensor's peak, K, and coverage of its observations, if any.
#[derive(Serialize)]
struct PeakInterval {
    peak_low_k: f64,
    peak_median_k: f64,
    peak_high_k: f64,
    coverage: Option<f64>,
}

impl<'a> PosteriorRecord<'a> {
    pub(in crate::report::estimate) fn of(
        answers: &'a Answers,
        found: &'a ParameterEstimates,
        outcome: &'a Posterior,
    ) -> Self {
        let names = found.factors.iter().map(|factor| factor.factor.name.as_str());
        let marginals = outcome.marginals.iter().map(|found| MarginalRecord {
            median: found.median,
            low: found.interval.0,
            high: found.interval.1,
            r_hat: found.diagnostics.r_hat,
            autocorrelation_time: found.diagnostics.autocorrelation_time,
            effective_samples: found.diagnostics.effective_draws,
        });
        let factors = outcome.marginals.len();
        let mut correlation = vec![vec![1.0; factors]; factors];
        for pair in &outcome.pairs {
            let (x, y) = pair.factors;
            (correlation[x][y], correlation[y][x]) = (pair.correlation, pair.correlation);
        }
        Self {
            walkers: outcome.walkers.number,
            iterations: outcome.walkers.iterations,
            annealing: outcome.annealing,
            burn_in: outcome.burn_in,
            acceptance: outcome.acceptance,
            marches: outcome.marches,
            converged: outcome.has_converged(),
            factors: OrderedMap(names.zip(marginals).collect()),
            correlation,
            discrepancy: DiscrepancyRecord {
                relative_amplitude: outcome.discrepancy.share,
                amplitude_k: outcome.discrepancy.amplitude_k,
                correlation_time_s: outcome.discrepancy.time_s,
            },
            predicted: OrderedMap(
                answers
                    .cases()
                    .zip(&outcome.predicted)
                    .map(|(case, of)| (case.id.as_str(), predicted(case, of)))
                    .collect(),
            ),
        }
    }
}

fn predicted<'a>(case: &'a Case, outcome: &PosteriorPredictive) -> OrderedMap<'a, PredictiveIntervals> {
    let peak = |band: &PredictiveBand, coverage: Option<f64>| {
        let [peak_low_k, peak_median_k, peak_high_k] = band.peak_k;
        PeakInterval { peak_low_k, peak_median_k, peak_high_k, coverage }
    };
    let record = |found: &SensorPredictive| PredictiveIntervals {
        parameters: peak(&found.parameters, found.coverage.map(|coverage| coverage.0)),
        with_discrepancy: peak(&found.discrepancy, found.coverage.map(|coverage| coverage.1)),
    };
    let sensors = case.sensors.iter().zip(&outcome.sensors);
    OrderedMap(sensors.map(|(sensor, found)| (sensor.name.as_str(), record(found))).collect())
}
