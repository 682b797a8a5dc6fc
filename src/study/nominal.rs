//! Predicted temperatures of a case.

use super::margins::{Margin, margins_of};
use crate::case::{Case, Observation};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
pub use crate::plan::ErrorEstimate;
use crate::plan::Plan;
pub use crate::traces::Peak;
use crate::traces::{Balance, Gauge, GaugePeak, MemberStatus, Traces};

/// The prediction of one member: at the nominal factors, or at an estimate.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Prediction {
    /// Instants of the traces, s.
    pub instants_s: Vec<f64>,
    /// Sensor × instant, K.
    pub temperatures_k: Vec<Vec<f64>>,
    /// One per sensor.
    pub peaks: Vec<Peak>,
    /// Limit × instant, K: the hottest temperature of each part that has a temperature limit.
    pub limited_k: Vec<Vec<f64>>,
    /// One per temperature limit of the case, in their order.
    pub margins: Vec<Margin>,
    /// One per gauge, in the order of [`Gauge::ALL`]; empty where nothing decomposes and no gas flows.
    pub gauge_traces: Vec<GaugeTrace>,
    /// Status at the end of the march.
    pub status: MemberStatus,
    /// Heat and mass in, out and stored.
    pub balance: Balance,
    /// Coldest and hottest temperature of each ply, K.
    pub extremes_k: Vec<(f64, f64)>,
    /// One per observation, in their order.
    pub misfits: Vec<Misfit>,
    /// Time steps of the plan.
    pub steps: usize,
    /// Cells of the plan.
    pub cells: usize,
    /// Estimated discretisation error, where grid and time steps were adapted.
    pub error_estimate: Option<ErrorEstimate>,
}

/// One gauge over time, in its own unit.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct GaugeTrace {
    /// The gauge.
    pub gauge: Gauge,
    /// One value per instant.
    pub values: Vec<f64>,
    /// The value of largest magnitude, with its sign: a gas flux that is always inward has no positive peak.
    pub peak: f64,
    /// Time of the peak, s.
    pub peak_time_s: f64,
    /// The value at the end of the march.
    pub end: f64,
}

/// Predicted minus measured temperature, over the sensor's time window.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Misfit {
    /// Root mean square, K.
    pub rms_k: f64,
    /// Mean, K.
    pub bias_k: f64,
    /// The difference of largest magnitude, K.
    pub worst_k: f64,
    /// Time of that difference, s.
    pub worst_time_s: f64,
    /// Samples compared.
    pub samples: usize,
}

/// March the case at its nominal factors.
///
/// # Errors
/// When the device fails.
pub fn nominal(case: &Case, plan: &Plan, march: &mut dyn March) -> Result<Prediction, MarchError> {
    let traces = march.march(plan, &Ensemble::nominal(&case.factors), 0..1)?;
    Ok(Prediction::of(case, plan, &traces, 0))
}

impl Prediction {
    /// The prediction of one member of `traces`.
    pub fn of(case: &Case, plan: &Plan, traces: &Traces, member: usize) -> Self {
        let temperatures_k: Vec<Vec<f64>> =
            (0..traces.sensors).map(|sensor| traces.trace(member, sensor).to_vec()).collect();
        let plies = case.layup.plies.len();
        let prediction = Self {
            instants_s: plan.instants_s.clone(),
            peaks: traces.member_peaks(member).to_vec(),
            limited_k: (0..case.limits.len()).map(|limit| traces.limited(member, limit).to_vec()).collect(),
            margins: margins_of(plan, traces, member),
            gauge_traces: Gauge::ALL
                .into_iter()
                .filter_map(|gauge| {
                    let peak = traces.gauge_peak(member, gauge)?;
                    Some(GaugeTrace::new(gauge, traces.gauge(member, gauge)?, peak))
                })
                .collect(),
            status: traces.statuses[member].clone(),
            balance: traces.balances[member],
            extremes_k: traces.extremes_k[member * plies..(member + 1) * plies].to_vec(),
            misfits: case
                .observations
                .iter()
                .map(|seen| misfit(case, seen, &plan.instants_s, &temperatures_k[seen.sensor]))
                .collect(),
            steps: plan.steps(),
            cells: plan.cells(),
            error_estimate: plan.error_estimate.clone(),
            temperatures_k,
        };
        if prediction.status == MemberStatus::Completed { prediction } else { prediction.without_values() }
    }

    /// The prediction of a member that failed: NaN in place of every value, as none of them can be used. Where it
    /// diverged, the last ones may have hundreds of digits.
    fn without_values(mut self) -> Self {
        let unknown = Peak { temperature_k: f64::NAN, time_s: f64::NAN };
        self.temperatures_k.iter_mut().chain(&mut self.limited_k).for_each(|trace_k| trace_k.fill(f64::NAN));
        self.peaks.fill(unknown);
        self.margins.fill(Margin::without_values());
        for reading in &mut self.gauge_traces {
            reading.values.fill(f64::NAN);
            (reading.peak, reading.peak_time_s, reading.end) = (f64::NAN, f64::NAN, f64::NAN);
        }
        self.balance = Balance::zip_map(self.balance, self.balance, |_, _| f64::NAN);
        self.extremes_k.fill((f64::NAN, f64::NAN));
        for Misfit { rms_k, bias_k, worst_k, worst_time_s, .. } in &mut self.misfits {
            (*rms_k, *bias_k, *worst_k, *worst_time_s) = (f64::NAN, f64::NAN, f64::NAN, f64::NAN);
        }
        self
    }

    /// Traces that statistics of members are relative to: where the nominal march failed, its start. The members need
    /// not have failed.
    pub(super) fn reference_traces_k(&self, case: &Case) -> Vec<Vec<f64>> {
        let mut traces_k = self.temperatures_k.clone();
        if self.status != MemberStatus::Completed {
            traces_k.iter_mut().for_each(|trace_k| trace_k.fill(case.exposure.initial_k[0].1));
        }
        traces_k
    }

    /// The largest difference of a sensor's temperature from another trace, K, and its time, s.
    pub(crate) fn largest_difference(&self, sensor: usize, other_k: &[f64]) -> (f64, f64) {
        let pairs = self.temperatures_k[sensor].iter().zip(other_k).zip(&self.instants_s);
        let differences = pairs.map(|((own_k, other_k), time_s)| (own_k - other_k, *time_s));
        differences.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).unwrap_or((0.0, 0.0))
    }

    /// A gauge over time; `None` where gauges were not recorded.
    pub fn gauge_trace(&self, gauge: Gauge) -> Option<&GaugeTrace> {
        self.gauge_traces.iter().find(|reading| reading.gauge == gauge)
    }
}

impl GaugeTrace {
    /// The extreme over the march.
    pub fn extreme(&self) -> GaugePeak {
        GaugePeak { value: self.peak, time_s: self.peak_time_s }
    }

    /// From the values at the instants, and the extreme of the march.
    pub fn new(gauge: Gauge, values: &[f64], extreme: GaugePeak) -> Self {
        let GaugePeak { value: peak, time_s: peak_time_s } = extreme;
        // Adding zero turns a negative zero, which a front at the surface may return, into a positive one.
        let values: Vec<f64> = values.iter().map(|value| value + 0.0).collect();
        Self { gauge, peak, peak_time_s, end: values.last().copied().unwrap_or(f64::NAN), values }
    }
}

impl Prediction {
    /// Temperature of a sensor at the instant nearest to a time, K.
    pub fn temperature_at(&self, sensor: usize, time_s: f64) -> f64 {
        self.temperatures_k[sensor][nearest_instant(&self.instants_s, time_s)]
    }
}

/// The samples of an observation within its time window: index of each sample, and index of its instant.
pub fn samples_in_window(case: &Case, seen: &Observation, instants_s: &[f64]) -> Vec<(usize, usize)> {
    let (start_s, end_s) = case.window_s(seen.sensor);
    let samples = seen.times_s.iter().enumerate().filter(|(_, time_s)| (start_s..=end_s).contains(*time_s));
    samples.map(|(sample, &time_s)| (sample, nearest_instant(instants_s, time_s))).collect()
}

/// The instant nearest to a time. The time steps include every sample of every observation.
fn nearest_instant(instants_s: &[f64], time_s: f64) -> usize {
    let after = instants_s.partition_point(|&instant_s| instant_s < time_s).min(instants_s.len() - 1);
    if after > 0 && time_s - instants_s[after - 1] < instants_s[after] - time_s { after - 1 } else { after }
}

fn misfit(case: &Case, seen: &Observation, instants_s: &[f64], trace_k: &[f64]) -> Misfit {
    let none = Misfit { rms_k: 0.0, bias_k: 0.0, worst_k: 0.0, worst_time_s: 0.0, samples: 0 };
    let mut sum = samples_in_window(case, seen, instants_s).into_iter().fold(none, |mut sum, (sample, instant)| {
        let off_k = trace_k[instant] - seen.temperatures_k[sample];
        sum.rms_k += off_k * off_k;
        sum.bias_k += off_k;
        if off_k.abs() > sum.worst_k.abs() {
            (sum.worst_k, sum.worst_time_s) = (off_k, seen.times_s[sample]);
        }
        sum.samples += 1;
        sum
    });
    let samples = sum.samples.max(1) as f64;
    sum.rms_k = (sum.rms_k / samples).sqrt();
    sum.bias_k /= samples;
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_reading_is_a_negative_zero() {
        let nowhere = GaugeTrace::new(Gauge::CharFront, &[-0.0, -0.0], GaugePeak { value: 0.0, time_s: 0.0 });
        assert!(nowhere.values.iter().chain([&nowhere.peak, &nowhere.end]).all(|value| value.is_sign_positive()));
    }
}
