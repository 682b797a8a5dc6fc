//! The key `posterior` of `summary.json`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::answers::Answers;
use crate::study::estimate::Estimated;
use crate::study::posterior::{Band, Foreseen, Posterior, Predicted};
use serde::Serialize;

/// Keys in the order written.
#[derive(Serialize)]
pub(in crate::report::estimate) struct PosteriorRecord<'a> {
    walkers: usize,
    iterations: usize,
    burn_in: usize,
    acceptance: f64,
    marches: usize,
    converged: bool,
    factors: Named<'a, MarginalRecord>,
    correlation: Vec<Vec<f64>>,
    discrepancy: DiscrepancyRecord,
    /// Case → sensor → predictive intervals.
    predicted: Named<'a, Named<'a, ForeseenRecord>>,
}

#[derive(Serialize)]
struct MarginalRecord {
    median: f64,
    low: f64,
    high: f64,
    r_hat: f64,
    /// Iterations.
    autocorrelation_time: f64,
    effective_samples: f64,
}

#[derive(Serialize)]
struct DiscrepancyRecord {
    /// In units of the effect of the prior standard deviations of all factors.
    relative_amplitude: f64,
    amplitude_k: f64,
    /// Infinite, and so `null`, where the discrepancy is constant in time.
    correlation_time_s: f64,
}

/// By the factors only, and with model discrepancy.
#[derive(Serialize)]
struct ForeseenRecord {
    parameters: PeakRecord,
    with_discrepancy: PeakRecord,
}

/// Predictive interval of a sensor's peak, K, and coverage of its observations, if any.
#[derive(Serialize)]
struct PeakRecord {
    peak_low_k: f64,
    peak_median_k: f64,
    peak_high_k: f64,
    coverage: Option<f64>,
}

impl<'a> PosteriorRecord<'a> {
    pub(in crate::report::estimate) fn of(answers: &'a Answers, found: &'a Estimated, outcome: &'a Posterior) -> Self {
        let names = found.factors.iter().map(|factor| factor.factor.name.as_str());
        let marginals = outcome.marginals.iter().map(|found| MarginalRecord {
            median: found.median,
            low: found.interval.0,
            high: found.interval.1,
            r_hat: found.mixing.r_hat,
            autocorrelation_time: found.mixing.autocorrelation_moves,
            effective_samples: found.mixing.effective_draws,
        });
        let factors = outcome.marginals.len();
        let mut correlation = vec![vec![1.0; factors]; factors];
        for pair in &outcome.pairs {
            let (x, y) = pair.places;
            (correlation[x][y], correlation[y][x]) = (pair.correlation, pair.correlation);
        }
        Self {
            walkers: outcome.walkers.number,
            iterations: outcome.walkers.moves,
            burn_in: outcome.burn_in,
            acceptance: outcome.acceptance,
            marches: outcome.marches,
            converged: outcome.is_settled(),
            factors: Named(names.zip(marginals).collect()),
            correlation,
            discrepancy: DiscrepancyRecord {
                relative_amplitude: outcome.discrepancy.share,
                amplitude_k: outcome.discrepancy.amplitude_k,
                correlation_time_s: outcome.discrepancy.time_s,
            },
            predicted: Named(
                answers
                    .cases()
                    .zip(&outcome.predicted)
                    .map(|(case, of)| (case.id.as_str(), predicted(case, of)))
                    .collect(),
            ),
        }
    }
}

fn predicted<'a>(case: &'a Case, outcome: &Predicted) -> Named<'a, ForeseenRecord> {
    let peak = |band: &Band, coverage: Option<f64>| {
        let [peak_low_k, peak_median_k, peak_high_k] = band.peak_k;
        PeakRecord { peak_low_k, peak_median_k, peak_high_k, coverage }
    };
    let record = |found: &Foreseen| ForeseenRecord {
        parameters: peak(&found.parameters, found.held.map(|coverage| coverage.0)),
        with_discrepancy: peak(&found.discrepancy, found.held.map(|coverage| coverage.1)),
    };
    let sensors = case.sensors.iter().zip(&outcome.sensors);
    Named(sensors.map(|(sensor, found)| (sensor.name.as_str(), record(found))).collect())
}
