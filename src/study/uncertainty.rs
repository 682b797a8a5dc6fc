//! Monte Carlo uncertainty of the prediction, and its attribution to factors.

mod sweep_error;

pub use sweep_error::{MembersError, SweepError, sweep_error};

use super::driver_emissivity::{DriverEmissivity, TraceShift, driver_emissivity};
use super::margins::{Margin, MarginSamples, MarginStatistics, margins_of};
use super::nominal::{Peak, Prediction};
use super::simultaneous_band::{COVERAGE_PERCENT, Envelope, SimultaneousBand, TraceCoverage};
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Marginal, Sampling, SamplingKind};
use crate::march::{March, MarchError, march_members};
use crate::plan::Plan;
use crate::statistics::{Accumulator, BLOCK, SensitivityIndices};
use crate::traces::{MemberStatus, Traces};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

/// Results of a Monte Carlo sweep over the factors.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Uncertainty {
    /// The seed of the draw.
    pub seed: u64,
    /// The side constraints between which the factors were drawn.
    pub bounds: Bounds,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: &'static str,
    /// Whether the members are drawn independently of each other, as intervals by order statistics assume.
    pub has_independent_members: bool,
    /// Whether the factors are independent; if not, the indices of [`SensitivityIndices`] are those for correlated
    /// factors.
    pub is_independent: bool,
    /// Members of the sweep.
    pub requested: usize,
    /// Members marched: all of the sweep unless it was stopped.
    pub members: usize,
    /// Members that completed the march and were counted.
    pub completed: usize,
    /// Failures by reason, with their number and first member.
    pub failures: Vec<Failure>,
    /// Instants of the spreads, s.
    pub instants_s: Vec<f64>,
    /// One per sensor.
    pub spreads: Vec<Spread>,
    /// Distribution of each sensor's peak over the members.
    pub peaks: Vec<PeakSpread>,
    /// Margins to the temperature limits of the case; `None` without limits or completed members.
    pub margins: Option<MarginStatistics>,
    /// Discretisation error of some members; `None` where the case states cells and steps or has no factors, and of a
    /// part of a sweep or one that was stopped.
    pub discretisation_error: Option<SweepError>,
}

/// Members that failed for one reason.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct Failure {
    /// Reason, in words that do not depend on the member.
    pub reason: String,
    /// Number of members.
    pub members: usize,
    /// Index of the first such member.
    pub first: usize,
}

/// One sensor through time: each vector over the instants, K.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Spread {
    /// Mean.
    pub mean_k: Vec<f64>,
    /// Standard deviation.
    pub deviation_k: Vec<f64>,
    /// The lowest of all members.
    pub low_k: Vec<f64>,
    /// The highest of all members.
    pub high_k: Vec<f64>,
    /// Percentiles 2.5, 25, 50, 75, 97.5, in this order.
    pub percentiles_k: [Vec<f64>; 5],
    /// Sensitivity indices of the temperature, one per instant.
    pub indices: Vec<SensitivityIndices>,
    /// Traces of the first members that completed, at most [`SHOWN_MEMBERS`], K.
    pub members_k: Vec<Vec<f64>>,
    /// The simultaneous band of whole traces, and the coverage of the pointwise percentiles.
    pub simultaneous: SimultaneousBand,
}

/// The distribution of a sensor's peak.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PeakSpread {
    /// The peak of the nominal march.
    pub nominal: Peak,
    /// Mean peak temperature, K.
    pub mean_k: f64,
    /// Standard deviation of the peak temperature, K.
    pub deviation_k: f64,
    /// Percentiles 2.5, 25, 50, 75, 97.5 of the peak temperature, K.
    pub percentiles_k: [f64; 5],
    /// Percentiles 2.5, 25, 50, 75, 97.5 of the time of the peak, s.
    pub percentiles_s: [f64; 5],
    /// Sensitivity indices of the peak temperature.
    pub temperature_indices: SensitivityIndices,
    /// Sensitivity indices of the time of the peak.
    pub time_indices: SensitivityIndices,
}

/// Settings of a Monte Carlo sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Number of members.
    pub members: usize,
    /// Distribution, sampling method and seed.
    #[serde(flatten)]
    pub sampling: Sampling,
    /// Side constraints between which factors are drawn.
    pub bounds: Bounds,
}

impl Uncertainty {
    /// Whether the sweep was stopped before its last member.
    pub fn is_partial(&self) -> bool {
        self.members < self.requested
    }
}

/// `5000 members by normal, seed 1, small bounds`
impl fmt::Display for Sweep {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { members, sampling: Sampling { kind, seed }, bounds } = self;
        write!(formatter, "{members} members by {}, seed {seed}, {} bounds", kind.name(), bounds.name())
    }
}

impl Sweep {
    /// The ensemble of the sweep, with the correlations of the case.
    pub fn ensemble(&self, case: &Case) -> Ensemble {
        Ensemble::sample(&case.factors, self.bounds, &self.sampling, self.members).correlated(&case.correlation)
    }
}

/// Members of which an answer has the traces: more lines hide each other.
pub const SHOWN_MEMBERS: usize = 30;

/// Percentiles of every distribution.
const PERCENTS: [f64; 5] = [2.5, 25.0, 50.0, 75.0, 97.5];

/// Standard deviation of an output below which members differ by cells, steps and rounding alone, as a share of the
/// tolerance of the discretisation error; and the tolerance where cells and steps are stated, K.
const NOISE_RATIO: f64 = 0.02;
const DEFAULT_TOLERANCE_K: f64 = 0.05;

/// Accumulated statistics of some members of an ensemble. Parts merge to the statistics of the whole, to the bit and in
/// any order.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepStatistics {
    accumulator: Accumulator,
    traces: TraceCoverage,
    margins: MarginSamples,
    limits_k: Vec<f64>,
    bounds: Bounds,
    is_independent: bool,
    /// The change by the emissivity of a face that a pyrometer holds, and the seed of the sweep.
    emissivity: Option<(TraceShift, u64)>,
    /// Number of failures and first member, by reason.
    failures: BTreeMap<String, (usize, usize)>,
}

/// Outputs of a trace beside its temperatures: the peak, its time, and the largest deviation from the nominal trace.
const OUTPUTS_PER_TRACE: usize = 3;

/// The outputs of a member: temperatures, sensor × instant; then peaks, times of the peaks, and largest deviations, one
/// per sensor each.
fn member_outputs(traces: &Traces, member: usize, coverage: &TraceCoverage, outputs: &mut [f64]) {
    let (temperatures_k, of_sensors) = outputs.split_at_mut(traces.sensors * traces.instants);
    temperatures_k.copy_from_slice(traces.member(member));
    let (peaks_k, rest) = of_sensors.split_at_mut(traces.sensors);
    let (times_s, deviations) = rest.split_at_mut(traces.sensors);
    for ((peak_k, time_s), peak) in peaks_k.iter_mut().zip(times_s).zip(traces.member_peaks(member)) {
        (*peak_k, *time_s) = (peak.temperature_k, peak.time_s);
    }
    deviations.iter_mut().zip(coverage.max_deviations(traces.member(member))).for_each(|(at, largest)| *at = largest);
}

/// March the members of a sweep. `on_batch` receives each batch of traces with its ensemble; only the statistics are
/// stored.
///
/// # Errors
/// When the device fails. A failed member is counted with its reason.
pub fn uncertainty(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    nominal: &Prediction,
    sweep: &Sweep,
    on_batch: &mut dyn FnMut(&Ensemble, &Traces),
) -> Result<Uncertainty, MarchError> {
    let Sweep { members, sampling, bounds } = *sweep;
    let envelope = Envelope::of(case, plan, nominal, bounds, sampling.kind, &march.monitor())?;
    let driver = driver_emissivity(case, plan, march, nominal)?;
    let mut sweep_statistics = SweepStatistics::new(case, nominal, &envelope, bounds, sampling.kind)
        .with_driver_emissivity(driver.as_ref(), sampling.seed);
    let on_batch = &mut |_: &SweepStatistics, ensemble: &Ensemble, traces: &Traces| on_batch(ensemble, traces);
    let ensemble = sweep.ensemble(case);
    sweep_statistics.march(case, plan, march, &ensemble, 0..members, on_batch)?;
    let mut found = sweep_statistics.results(nominal, &sampling, members);
    found.discretisation_error = sweep_error(case, plan, march.backend().precision, &ensemble, &march.monitor())?;
    Ok(found)
}

impl SweepStatistics {
    /// Empty statistics about a nominal march and an envelope of its traces.
    pub fn new(case: &Case, nominal: &Prediction, envelope: &Envelope, bounds: Bounds, kind: SamplingKind) -> Self {
        let (reference, marginals) = reference_values(case, nominal, bounds, kind);
        let (accumulator, is_independent) = (Accumulator::new(&reference, &marginals), case.correlation.is_empty());
        let traces = TraceCoverage::new(&nominal.reference_traces_k(case), envelope);
        let limits_k: Vec<f64> = case.limits.iter().map(|limit| limit.limit_k).collect();
        let margins = MarginSamples::new(limits_k.len());
        let (emissivity, failures) = (None, BTreeMap::new());
        Self { accumulator, traces, margins, limits_k, bounds, is_independent, emissivity, failures }
    }

    /// With the uncertainty of the emissivity of a face that a pyrometer holds, if there is one, in every member that
    /// is marched.
    #[must_use]
    pub fn with_driver_emissivity(mut self, driver: Option<&DriverEmissivity>, seed: u64) -> Self {
        self.emissivity = driver.map(|driver| (driver.shift.clone(), seed));
        self
    }

    /// March some members of an ensemble and accumulate them. `on_batch` receives the statistics up to and with each
    /// batch, the ensemble and the batch.
    ///
    /// # Errors
    /// When the device fails.
    pub fn march(
        &mut self,
        case: &Case,
        plan: &Plan,
        march: &mut dyn March,
        ensemble: &Ensemble,
        members: Range<usize>,
        on_batch: &mut dyn FnMut(&Self, &Ensemble, &Traces),
    ) -> Result<(), MarchError> {
        let (mut outputs, has_limits) = (Vec::new(), !self.margins.is_empty());
        let marched = march_members(march, &plan.clone().without_gauges(), ensemble, members, &mut |mut traces| {
            if let Some((shift, seed)) = &self.emissivity {
                shift.apply(&mut traces, *seed, plan.end_s());
            }
            let width = traces.sensors * (traces.instants + OUTPUTS_PER_TRACE);
            for first in (0..traces.members()).step_by(BLOCK) {
                let block = first..(first + BLOCK).min(traces.members());
                outputs.resize(block.len() * width, 0.0);
                // Without sensors there are no outputs.
                outputs.par_chunks_mut(width.max(1)).enumerate().for_each(|(member, outputs)| {
                    member_outputs(&traces, block.start + member, &self.traces, outputs);
                });
                let is_complete = |member: usize| traces.statuses[member] == MemberStatus::Completed;
                let margins = |member| {
                    if has_limits && is_complete(member) { margins_of(plan, &traces, member) } else { Vec::new() }
                };
                let margins: Vec<Vec<Margin>> = block.clone().into_par_iter().map(margins).collect();
                for (member, margins) in block.clone().zip(&margins) {
                    if is_complete(member) {
                        self.traces.store(traces.first + member, traces.member(member));
                        if has_limits {
                            self.margins.add(margins, traces.balances[member].hot_in_j_m2);
                        }
                    }
                    if let Some(reason) = failure_reason(case, &traces.statuses[member]) {
                        self.add_failure(reason, 1, traces.first + member);
                    }
                }
                let is_complete: Vec<bool> = block.clone().map(is_complete).collect();
                let factors: Vec<f64> = block.flat_map(|member| ensemble.member(traces.first + member)).collect();
                self.accumulator.add_block(&outputs, &factors, &is_complete);
            }
            on_batch(self, ensemble, &traces);
        });
        self.margins.sort();
        marched
    }

    /// Add the statistics of other members about the same nominal march.
    ///
    /// # Panics
    /// When the nominal marches or the side constraints differ.
    pub fn merge(&mut self, other: &Self) {
        self.accumulator.merge(&other.accumulator);
        self.traces.merge(&other.traces);
        self.margins.merge(&other.margins);
        for (reason, &(members, first)) in &other.failures {
            self.add_failure(reason.clone(), members, first);
        }
    }

    fn add_failure(&mut self, reason: String, members: usize, first: usize) {
        let failure = self.failures.entry(reason).or_insert((0, first));
        *failure = (failure.0 + members, failure.1.min(first));
    }

    /// Members that completed and were counted.
    pub fn completed(&self) -> usize {
        self.accumulator.members()
    }

    /// All members: counted, excluded, or failed.
    pub fn members(&self) -> usize {
        self.accumulator.members() + self.accumulator.excluded() + self.failed()
    }

    fn failed(&self) -> usize {
        self.failures.values().map(|(members, _)| members).sum()
    }

    /// Failures by reason.
    pub fn failures(&self) -> Vec<Failure> {
        let failure = |(reason, &(members, first)): (&String, _)| Failure { reason: reason.clone(), members, first };
        self.failures.iter().map(failure).collect()
    }

    /// The accumulators as integers, for storage together with [`failures`](Self::failures).
    pub fn to_integers(&self) -> Vec<i128> {
        self.accumulator.to_integers()
    }

    /// [`to_integers`](Self::to_integers), one after the other.
    pub(crate) fn integers(&self) -> impl Iterator<Item = i128> {
        self.accumulator.integers()
    }

    /// The envelope that scales deviations from the nominal traces.
    pub fn envelope(&self) -> &Envelope {
        self.traces.envelope()
    }

    /// Stored traces of the first members, in quanta.
    pub fn stored_traces(&self) -> &BTreeMap<usize, Vec<i32>> {
        self.traces.stored()
    }

    /// Margins of the members.
    pub fn margin_samples(&self) -> &MarginSamples {
        &self.margins
    }

    /// Restored statistics about the same nominal march; `None` where the integers or the margins do not fit.
    pub fn restored(
        &self,
        numbers: &[i128],
        traces: BTreeMap<usize, Vec<i32>>,
        margins: &MarginSamples,
        failures: &[Failure],
    ) -> Option<Self> {
        let mut restored = Self {
            margins: margins.clone(),
            limits_k: self.limits_k.clone(),
            accumulator: self.accumulator.restored_from(numbers)?,
            traces: self.traces.clone().with_stored(traces)?,
            emissivity: self.emissivity.clone(),
            failures: BTreeMap::new(),
            ..*self
        };
        failures
            .iter()
            .for_each(|failure| restored.add_failure(failure.reason.clone(), failure.members, failure.first));
        restored.margins.sort();
        let completed = restored.accumulator.members() + restored.accumulator.excluded();
        restored.margins.fits(restored.limits_k.len(), completed).then_some(restored)
    }

    /// The results from the members so far of a sweep of `requested` members.
    pub fn results(&self, nominal: &Prediction, sampling: &Sampling, requested: usize) -> Uncertainty {
        let Self { accumulator, .. } = self;
        let (sensors, instants) = (nominal.temperatures_k.len(), nominal.instants_s.len());
        let peaks_and_times = sensors * instants..sensors * (instants + 2);
        let mut indices = accumulator.sensitivity_indices(self.is_independent, peaks_and_times.clone());
        let tolerance_k = nominal.error_estimate.as_ref().map_or(DEFAULT_TOLERANCE_K, |reached| reached.tolerance_k);
        let is_noise = |output: usize| accumulator.deviation(output) < NOISE_RATIO * tolerance_k;
        for output in (0..peaks_and_times.start + sensors).filter(|&output| is_noise(output)) {
            indices[output] = indices[output].clone().of_constant();
            // A plateau has no time of its peak.
            if let Some(peak) = output.checked_sub(peaks_and_times.start) {
                let time = peaks_and_times.start + sensors + peak;
                indices[time] = indices[time].clone().of_constant();
            }
        }
        let over = |sensor: usize, each: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (sensor * instants..(sensor + 1) * instants).map(each).collect()
        };
        let spreads = (0..sensors).map(|sensor| {
            let percentiles_k = PERCENTS.map(|percent| over(sensor, &|output| accumulator.percentile(output, percent)));
            let stretch = accumulator.percentile(sensors * (instants + 2) + sensor, COVERAGE_PERCENT);
            let whole = self.traces.band(sensor, stretch, [&percentiles_k[0], &percentiles_k[4]]);
            Spread {
                mean_k: over(sensor, &|output| accumulator.mean(output)),
                deviation_k: over(sensor, &|output| accumulator.deviation(output)),
                low_k: over(sensor, &|output| accumulator.min(output)),
                high_k: over(sensor, &|output| accumulator.max(output)),
                percentiles_k,
                members_k: self.traces.first_traces_k(sensor, SHOWN_MEMBERS),
                indices: indices[sensor * instants..(sensor + 1) * instants].to_vec(),
                simultaneous: whole,
            }
        });
        let peaks = (0..sensors).map(|sensor| {
            let (hot, late) = (sensors * instants + sensor, sensors * instants + sensors + sensor);
            PeakSpread {
                nominal: nominal.peaks[sensor],
                mean_k: accumulator.mean(hot),
                deviation_k: accumulator.deviation(hot),
                percentiles_k: PERCENTS.map(|percent| accumulator.percentile(hot, percent)),
                percentiles_s: PERCENTS.map(|percent| accumulator.percentile(late, percent)),
                temperature_indices: indices[hot].clone(),
                time_indices: indices[late].clone(),
            }
        });
        Uncertainty {
            seed: sampling.seed,
            bounds: self.bounds,
            sampling: sampling.kind.name(),
            has_independent_members: sampling.kind.has_independent_members(),
            is_independent: self.is_independent,
            requested,
            members: self.members(),
            completed: accumulator.members(),
            failures: self.failures(),
            instants_s: nominal.instants_s.clone(),
            spreads: spreads.collect(),
            peaks: peaks.collect(),
            margins: self.margins.statistics(&self.limits_k, self.failed(), sampling.kind),
            discretisation_error: None,
        }
    }
}

/// Reference values of the accumulator: every temperature, every peak and its time of the nominal march, and zero
/// deviation from its traces; and the distributions of the factors.
fn reference_values(
    case: &Case,
    nominal: &Prediction,
    bounds: Bounds,
    kind: SamplingKind,
) -> (Vec<f64>, Vec<Marginal>) {
    let mut reference: Vec<f64> = nominal.reference_traces_k(case).concat();
    let peaks = nominal.peaks.iter();
    if nominal.status == MemberStatus::Completed {
        reference.extend(peaks.clone().map(|peak| peak.temperature_k));
        reference.extend(peaks.map(|peak| peak.time_s));
    } else {
        reference.extend(peaks.clone().map(|_| case.exposure.initial_k[0].1));
        reference.extend(peaks.map(|_| 0.0));
    }
    reference.extend(nominal.peaks.iter().map(|_| 0.0));
    let marginals = case.factors.iter().map(|factor| Marginal::new(factor.nominal, factor.bounds(bounds), kind));
    (reference, marginals.collect())
}

/// Reason of a failure, in words that do not depend on the member; `None` for a completed member.
pub fn failure_reason(case: &Case, status: &MemberStatus) -> Option<String> {
    match status {
        MemberStatus::Completed => None,
        MemberStatus::Diverged { .. } => {
            Some("a temperature left 0 to 4,000 K, the valid range of all properties".to_owned())
        }
        MemberStatus::OutOfTable { ply, .. } => {
            let ply = &case.layup.plies[*ply];
            Some(format!(
                "ply {:?} left the temperature range of the tables of {}, which forbid extrapolation",
                ply.name, ply.material.id
            ))
        }
    }
}
