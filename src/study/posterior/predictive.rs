//! Posterior predictive distribution of every thermocouple, observed or not.

use super::super::estimate::ParameterEstimates;
use super::super::nominal::samples_in_window;
use super::super::thermocouple_residuals::CaseResiduals;
use super::discrepancy::Discrepancy;
use crate::case::{Case, Observation};
use crate::march::{March, MarchError, march_all};
use crate::plan::Plan;
use crate::random::RandomStream;
use crate::statistics::Accumulator;
use crate::traces::MemberStatus;

/// Posterior predictive distribution of a case.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PosteriorPredictive {
    /// Instants of the bands, s.
    pub instants_s: Vec<f64>,
    /// One per sensor.
    pub sensors: Vec<SensorPredictive>,
    /// Draws whose march failed; they are excluded.
    pub failed: usize,
}

/// Predictive bands of a sensor: from the factors alone, and with the model discrepancy.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct SensorPredictive {
    /// From the posterior of the factors alone.
    pub parameters: PredictiveBand,
    /// From the posterior of the factors and the model discrepancy.
    pub discrepancy: PredictiveBand,
    /// Fraction of the sensor's samples within its window that lie in each of the two bands, widened by two standard
    /// deviations of the reading; `None` without samples.
    pub coverage: Option<(f64, f64)>,
}

/// Coverage of a trace that is warned of. Samples are autocorrelated, so that the coverage of a single trace by a valid
/// 95 % band varies widely.
const LOW_COVERAGE: f64 = 0.5;

impl SensorPredictive {
    /// Whether many observations lie outside both bands.
    pub(crate) fn misses_observations(&self) -> bool {
        self.coverage.is_some_and(|(_, coverage)| coverage < LOW_COVERAGE)
    }
}

/// Median and 95 % band of the draws.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PredictiveBand {
    /// The percentile 2.5 at each instant, K.
    pub low_k: Vec<f64>,
    /// The median at each instant, K.
    pub median_k: Vec<f64>,
    /// The percentile 97.5 at each instant, K.
    pub high_k: Vec<f64>,
    /// Percentiles 2.5, 50 and 97.5 of the sensor's peak, K.
    pub peak_k: [f64; 3],
}

const PERCENTS: [f64; 3] = [2.5, 50.0, 97.5];
/// First random stream of the discrepancies, distinct from those of starts and moves.
const DISCREPANCY_STREAM: u64 = 3 << 62;

/// Inputs of a predictive distribution.
pub(super) struct PredictiveInputs<'a> {
    pub case_index: usize,
    pub estimates: &'a ParameterEstimates,
    pub draws: &'a [Vec<f64>],
    pub discrepancy: Discrepancy,
    /// Sensor × instant.
    pub gains_k: &'a [Vec<f64>],
}

/// March the draws and accumulate their statistics; no trace is stored.
///
/// # Errors
/// When the device fails.
pub(super) fn predict(
    (case, plan): (&Case, &Plan),
    march: &mut dyn March,
    asked: &PredictiveInputs,
    seed: u64,
) -> Result<PosteriorPredictive, MarchError> {
    let part = CaseResiduals::new(case, plan, super::factor_indices(asked.estimates, asked.case_index), Vec::new());
    let ensemble = part.ensemble(asked.draws.iter().map(Vec::as_slice));
    let after = &asked.estimates.fitted[asked.case_index].after;
    let reference: Vec<f64> = after
        .temperatures_k
        .iter()
        .flatten()
        .copied()
        .chain(after.peaks.iter().map(|peak| peak.temperature_k))
        .collect();
    let (mut parameters, mut discrepancy) = (Accumulator::new(&reference, &[]), Accumulator::new(&reference, &[]));
    let (sensors, instants) = (case.sensors.len(), plan.instants_s.len());
    let highest_k = |trace: &[f64]| trace.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let coldest_k = case.exposure.lower_temperature_bound_k();
    let mut failed = 0;
    march_all(march, &plan.clone().without_gauges(), &ensemble, &mut |traces| {
        let is_complete: Vec<bool> = traces.statuses.iter().map(|status| *status == MemberStatus::Completed).collect();
        failed += is_complete.iter().filter(|is_complete| !**is_complete).count();
        let (mut plain, mut with_discrepancy) = (Vec::new(), Vec::new());
        for member in 0..traces.members() {
            let row = traces.member(member);
            plain.extend_from_slice(row);
            plain.extend(traces.member_peaks(member).iter().map(|peak| peak.temperature_k));
            let mut peaks_k = Vec::with_capacity(sensors);
            for sensor in 0..sensors {
                let draw = (traces.first + member) as u64;
                let stream = DISCREPANCY_STREAM | (asked.case_index as u64) << 48 | (sensor as u64) << 32 | draw;
                let mut numbers = RandomStream::new(seed, stream);
                let off_k = asked.discrepancy.sample_k(&asked.gains_k[sensor], &plan.instants_s, &mut numbers);
                // Heat does not flow from cold to hot: the discrepancy must not push a temperature below the lowest in
                // the exposure.
                let perturbed_k = |(t, off): (&f64, &f64)| (t + off).max(coldest_k.min(*t));
                let trace: Vec<f64> = traces.trace(member, sensor).iter().zip(&off_k).map(perturbed_k).collect();
                let peak = traces.peak(member, sensor);
                let off_at_peak_k = interpolate(&plan.instants_s, &off_k, peak.time_s);
                peaks_k.push(highest_k(&trace).max(perturbed_k((&peak.temperature_k, &off_at_peak_k))));
                with_discrepancy.extend(trace);
            }
            with_discrepancy.extend(peaks_k);
        }
        parameters.add_block(&plain, &[], &is_complete);
        discrepancy.add_block(&with_discrepancy, &[], &is_complete);
    })?;
    let foreseen = |sensor: usize| {
        let (parameters, discrepancy): (PredictiveBand, PredictiveBand) =
            [&parameters, &discrepancy].map(|accumulator| band(accumulator, sensor, (sensors, instants))).into();
        let seen = case.observations.iter().find(|seen| seen.sensor == sensor);
        let held = |seen: &Observation| {
            let pairs = samples_in_window(case, seen, &plan.instants_s);
            (!pairs.is_empty()).then(|| (parameters.coverage(seen, &pairs), discrepancy.coverage(seen, &pairs)))
        };
        SensorPredictive { coverage: seen.and_then(held), parameters, discrepancy }
    };
    Ok(PosteriorPredictive {
        instants_s: plan.instants_s.clone(),
        sensors: (0..sensors).map(foreseen).collect(),
        failed,
    })
}

/// Linear interpolation between instants.
fn interpolate(instants_s: &[f64], values: &[f64], time_s: f64) -> f64 {
    let after = instants_s.partition_point(|&instant_s| instant_s < time_s).clamp(1, instants_s.len() - 1);
    let share = (time_s - instants_s[after - 1]) / (instants_s[after] - instants_s[after - 1]);
    values[after - 1] + share * (values[after] - values[after - 1])
}

/// The band of a sensor, from an accumulator of sensors × instants followed by the peaks.
fn band(accumulator: &Accumulator, sensor: usize, (sensors, instants): (usize, usize)) -> PredictiveBand {
    let curve = |percent: f64| (0..instants).map(|i| accumulator.percentile(sensor * instants + i, percent)).collect();
    let [low_k, median_k, high_k] = PERCENTS.map(curve);
    PredictiveBand {
        low_k,
        median_k,
        high_k,
        peak_k: PERCENTS.map(|percent| accumulator.percentile(sensors * instants + sensor, percent)),
    }
}

impl PredictiveBand {
    /// Fraction of the samples within the band widened by two standard deviations of the reading.
    fn coverage(&self, seen: &Observation, pairs: &[(usize, usize)]) -> f64 {
        let is_held = |&&(sample, instant): &&(usize, usize)| {
            let (measured_k, reach_k) = (seen.temperatures_k[sample], 2.0 * seen.sigma_k[sample]);
            (self.low_k[instant] - reach_k..=self.high_k[instant] + reach_k).contains(&measured_k)
        };
        pairs.iter().filter(is_held).count() as f64 / pairs.len() as f64
    }
}
