//! What a posterior adds to `summary.json`.

use crate::case::Case;
use crate::report::files::json::Named;
use crate::study::answers::Answers;
use crate::study::estimate::Estimated;
use crate::study::posterior::{Band, Discrepancy, Foreseen, Posterior, Predicted};
use serde::Serialize;

/// Keys in the order written.
#[derive(Serialize)]
pub(in crate::report::estimate) struct PosteriorRecord<'a> {
    walkers: usize,
    moves: usize,
    burn_in: usize,
    acceptance: f64,
    marches: usize,
    settled: bool,
    factors: Named<'a, MarginalRecord>,
    correlation: Vec<Vec<f64>>,
    /// A time of `null` keeps for ever.
    discrepancy: Discrepancy,
    /// Case → sensor → what is foreseen of it.
    predicted: Named<'a, Named<'a, ForeseenRecord>>,
}

#[derive(Serialize)]
struct MarginalRecord {
    median: f64,
    low: f64,
    high: f64,
    r_hat: f64,
    autocorrelation_moves: f64,
    effective_draws: f64,
}

/// By the factors alone, and with what the model lacks.
#[derive(Serialize)]
struct ForeseenRecord {
    parameters: PeakRecord,
    discrepancy: PeakRecord,
}

/// Of a sensor's peak, K; and the share of its observed samples that the band holds, where there are any.
#[derive(Serialize)]
struct PeakRecord {
    peak_low_k: f64,
    peak_median_k: f64,
    peak_high_k: f64,
    held: Option<f64>,
}

impl<'a> PosteriorRecord<'a> {
    pub(in crate::report::estimate) fn of(answers: &'a Answers, found: &'a Estimated, outcome: &'a Posterior) -> Self {
        let names = found.factors.iter().map(|factor| factor.factor.name.as_str());
        let marginals = outcome.marginals.iter().map(|found| MarginalRecord {
            median: found.median,
            low: found.interval.0,
            high: found.interval.1,
            r_hat: found.mixing.r_hat,
            autocorrelation_moves: found.mixing.autocorrelation_moves,
            effective_draws: found.mixing.effective_draws,
        });
        let factors = outcome.marginals.len();
        let mut correlation = vec![vec![1.0; factors]; factors];
        for pair in &outcome.pairs {
            let (x, y) = pair.places;
            (correlation[x][y], correlation[y][x]) = (pair.correlation, pair.correlation);
        }
        Self {
            walkers: outcome.walkers.number,
            moves: outcome.walkers.moves,
            burn_in: outcome.burn_in,
            acceptance: outcome.acceptance,
            marches: outcome.marches,
            settled: outcome.is_settled(),
            factors: Named(names.zip(marginals).collect()),
            correlation,
            discrepancy: outcome.discrepancy,
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
    let peak = |band: &Band, held: Option<f64>| {
        let [peak_low_k, peak_median_k, peak_high_k] = band.peak_k;
        PeakRecord { peak_low_k, peak_median_k, peak_high_k, held }
    };
    let record = |found: &Foreseen| ForeseenRecord {
        parameters: peak(&found.parameters, found.held.map(|held| held.0)),
        discrepancy: peak(&found.discrepancy, found.held.map(|held| held.1)),
    };
    let sensors = case.sensors.iter().zip(&outcome.sensors);
    Named(sensors.map(|(sensor, found)| (sensor.name.as_str(), record(found))).collect())
}
