//! Discretisation error of every output, from the difference to finer marches.

use crate::case::Bounds;
use crate::plan::{ErrorEstimate, GaugeError, RoundingError};
use crate::traces::{Gauge, MemberStatus, Peak, Traces};

/// The error of each output of a march, with its tolerance.
#[derive(Clone, Debug, Default)]
pub(super) struct OutputErrors {
    tolerance_k: f64,
    pub(super) temperature_k: f64,
    /// Error of the residual of the energy balance, relative to the heat moved.
    balance: f64,
    pub(super) gauges: Vec<GaugeError>,
}

impl OutputErrors {
    /// Errors from the difference to a march with all cells and steps halved.
    pub(super) fn twofold(base: &Traces, finer: &Traces, tolerance_k: f64) -> Self {
        Self::difference(base, finer, tolerance_k).scaled(TWOFOLD_ERROR_RATIO)
    }

    fn scaled(mut self, factor: f64) -> Self {
        self.temperature_k *= factor;
        self.balance *= factor;
        self.gauges.iter_mut().for_each(|gauge| gauge.error *= factor);
        self
    }

    /// The estimate for the report, with the errors of the members at corners of the factors' small bounds: infinite of
    /// those that did not complete. Two marches may agree better than either is accurate, so the error of a gauge is at
    /// least `MIN_REPORTED_RATIO` of its tolerance.
    pub(super) fn into_error_estimate(self, corners_k: &[f64]) -> ErrorEstimate {
        let least =
            |gauge: GaugeError| GaugeError { error: gauge.error.max(MIN_REPORTED_RATIO * gauge.tolerance), ..gauge };
        let gauges = self.gauges.into_iter().map(least).collect();
        ErrorEstimate {
            tolerance_k: self.tolerance_k,
            nominal_k: self.temperature_k,
            bounds: Bounds::Small,
            corners_k: None,
            corners: 0,
            failed_corners: 0,
            gauges,
            rounding: None,
        }
        .with_corners(Bounds::Small, corners_k)
    }

    /// The larger of two estimates, output by output.
    pub(super) fn max(mut self, other: &Self) -> Self {
        self.temperature_k = self.temperature_k.max(other.temperature_k);
        self.balance = self.balance.max(other.balance);
        for (gauge, other) in self.gauges.iter_mut().zip(&other.gauges) {
            gauge.error = gauge.error.max(other.error);
        }
        self
    }

    /// The largest difference of two marches over their members; infinite where a member did not complete, as a
    /// maximum ignores NaN.
    fn difference(base: &Traces, finer: &Traces, tolerance_k: f64) -> Self {
        let members = (0..base.members()).map(|member| Self::member_difference(base, finer, member, tolerance_k));
        members.reduce(|largest, other| largest.max(&other)).unwrap_or_default()
    }

    pub(super) fn member_difference(base: &Traces, finer: &Traces, member: usize, tolerance_k: f64) -> Self {
        let gauge = |gauge: Gauge| {
            let peaks = [base.gauge_peak(member, gauge)?.value, finer.gauge_peak(member, gauge)?.value];
            let peak_difference = (peaks[0].abs() - peaks[1].abs()).abs();
            let (base, finer) = (base.gauge(member, gauge)?, finer.gauge(member, gauge)?);
            let peak = peaks[1].abs();
            let difference = match gauge.is_front() {
                true => gauge_difference(gauge, base, finer),
                false => gauge_difference(gauge, base, finer).max(peak_difference),
            };
            Some(match gauge.is_front() {
                true => GaugeError { gauge, error: difference, tolerance: FRONT_TOLERANCE_M },
                false => {
                    GaugeError { gauge, error: difference / peak.max(f64::MIN_POSITIVE), tolerance: GAUGE_TOLERANCE }
                }
            })
        };
        Self {
            tolerance_k,
            temperature_k: largest_difference_k(base, finer, member),
            balance: (base.balances[member].residual() - finer.balances[member].residual()).abs(),
            gauges: Gauge::ALL.into_iter().filter_map(gauge).collect(),
        }
    }

    /// The largest error relative to its tolerance.
    pub(super) fn max_relative(&self) -> f64 {
        let gauges = self.gauges.iter().map(|gauge| gauge.error / gauge.tolerance);
        gauges.fold((self.temperature_k / self.tolerance_k).max(self.balance / BALANCE_TOLERANCE), f64::max)
    }
}

/// Traces of members on a plan, and with twice and four times its cells and steps; where the emissivity is steep also
/// with [`STEP_DIVISION`](super::STEP_DIVISION) times its steps.
#[derive(Clone, Debug)]
pub(crate) struct RefinedTraces {
    pub(super) tolerance_k: f64,
    pub(super) base: Traces,
    pub(super) halved: Traces,
    pub(super) quartered: Traces,
    pub(super) step_divided: Option<Traces>,
    /// Whether a ply has a steep conductivity.
    pub(super) is_steep: bool,
}

impl RefinedTraces {
    /// The largest errors over the members.
    pub(super) fn errors(&self) -> OutputErrors {
        let twofold = OutputErrors::twofold(&self.base, &self.halved, self.tolerance_k);
        let ratio = if self.is_steep { FIRST_ORDER_FOURFOLD_RATIO } else { FOURFOLD_ERROR_RATIO };
        let fourfold = OutputErrors::difference(&self.base, &self.quartered, self.tolerance_k).scaled(ratio);
        let step_errors =
            self.step_divided.iter().map(|divided| OutputErrors::difference(&self.base, divided, self.tolerance_k));
        step_errors.fold(fourfold.max(&twofold), |largest, of_steps| largest.max(&of_steps))
    }

    /// The largest error of a temperature over the members, K; infinite where a march did not complete.
    pub(crate) fn temperature_error_k(&self) -> f64 {
        self.errors().temperature_k
    }

    /// The estimated error of some readings of a member, given as sensors and instants, K: the plan's reading less the
    /// true one. `None` where a march of the member did not complete.
    pub(crate) fn reading_errors_k(&self, member: usize, readings: &[(usize, usize)]) -> Option<Vec<f64>> {
        let marches = [&self.base, &self.halved, &self.quartered];
        if marches.iter().any(|traces| traces.statuses[member] != MemberStatus::Completed) {
            return None;
        }
        let error_k = |&(sensor, instant): &(usize, usize)| {
            let [base_k, finest_k] = [&self.base, &self.quartered].map(|of| of.trace(member, sensor)[instant]);
            FOURFOLD_ERROR_RATIO * (base_k - finest_k)
        };
        Some(readings.iter().map(error_k).collect())
    }
}

/// Smallest reported error of a gauge, relative to its tolerance: 0.01 mm of a front, 0.05 % of a peak. Among 300
/// random cases one front had an error of 14 µm where two finer marches agreed to 2 µm.
const MIN_REPORTED_RATIO: f64 = 0.1;
/// Errors below this share of the tolerance are rounding.
const ROUNDING_RATIO: f64 = 1e-3;

impl ErrorEstimate {
    /// With the errors of the members at corners of these bounds, K: infinite of those that did not complete.
    pub(super) fn with_corners(mut self, bounds: Bounds, corners_k: &[f64]) -> Self {
        let completed_k = corners_k.iter().copied().filter(|error_k| error_k.is_finite());
        self.bounds = bounds;
        (self.corners, self.failed_corners) = (corners_k.len(), corners_k.len() - completed_k.clone().count());
        self.corners_k = completed_k.reduce(f64::max);
        self
    }

    /// With the larger errors of other members, and their rounding in f32.
    pub(super) fn with_members(mut self, found: OutputErrors, rounding: Option<RoundingError>) -> Self {
        let found = found.into_error_estimate(&[]);
        let found = match rounding {
            Some(rounding) => found.with_rounding(rounding),
            None => found,
        };
        self.nominal_k = self.nominal_k.max(found.nominal_k);
        for (gauge, found) in self.gauges.iter_mut().zip(&found.gauges) {
            gauge.error = gauge.error.max(found.error);
        }
        self.rounding = match (self.rounding.take(), found.rounding) {
            (Some(own), Some(found)) => Some(own.max(&found)),
            (own, found) => own.or(found),
        };
        self
    }

    /// Ratios of true to reported error: temperatures first, then each gauge. The true error is the difference to a
    /// much finer march of the same member.
    pub fn error_ratios(&self, given: &Traces, truth: &Traces) -> Vec<f64> {
        let found = OutputErrors::difference(given, truth, self.tolerance_k);
        let ratio = |error: f64, reported: f64, tolerance: f64| error / reported.max(ROUNDING_RATIO * tolerance);
        let gauges = found.gauges.iter().zip(&self.gauges);
        std::iter::once(ratio(found.temperature_k, self.nominal_k, self.tolerance_k))
            .chain(gauges.map(|(found, reported)| ratio(found.error, reported.error, reported.tolerance)))
            .collect()
    }
}

/// Error per difference to twice the cells and steps: 4/3 at second order. Extrapolated marches usually converge at
/// third order (8/7), more slowly on coarse plans.
pub(super) const TWOFOLD_ERROR_RATIO: f64 = 4.0 / 3.0;
/// Error per difference to four times the cells and steps, at second order.
const FOURFOLD_ERROR_RATIO: f64 = 16.0 / 15.0;
/// Error per difference to four times the cells and steps, at first order: a jump of the conductivity that passes from
/// cell to cell leaves errors whose phase differs from march to march.
const FIRST_ORDER_FOURFOLD_RATIO: f64 = 4.0 / 3.0;
/// Tolerance of the energy balance, relative to the heat moved.
const BALANCE_TOLERANCE: f64 = 2e-4;
/// Tolerance of gas flux, mass lost and pressure, relative to the peak.
pub const GAUGE_TOLERANCE: f64 = 5e-3;
/// Tolerance of fronts, m.
pub const FRONT_TOLERANCE_M: f64 = 0.1e-3;
/// Quantile of the front error over the instants: a front jumps between plies, possibly a little early or late.
const FRONT_QUANTILE: f64 = 0.95;

/// The difference between two records of a gauge: for fronts the 95 % quantile over the instants, else the maximum.
fn gauge_difference(gauge: Gauge, one: &[f64], other: &[f64]) -> f64 {
    let mut difference: Vec<f64> = one.iter().zip(other).map(|(one, other)| (one - other).abs()).collect();
    difference.sort_by(f64::total_cmp);
    let share = if gauge.is_front() { FRONT_QUANTILE } else { 1.0 };
    let place = (share * difference.len() as f64).ceil() as usize;
    place.checked_sub(1).map_or(0.0, |place| difference[place])
}

/// The largest difference between two marches of a member after the prescribed start, at any sensor and in any part
/// with a temperature limit, at any instant and of the peaks, K; infinite where either did not complete, as a maximum
/// ignores NaN.
pub(super) fn largest_difference_k(one: &Traces, other: &Traces, member: usize) -> f64 {
    if [one, other].iter().any(|traces| traces.statuses[member] != MemberStatus::Completed) {
        return f64::INFINITY;
    }
    let limits = one.limits();
    let after_start = |peak: Peak| peak.time_s > 0.0;
    let peaks = (0..one.sensors).map(|sensor| [one, other].map(|traces| traces.peak(member, sensor)));
    let limited = (0..limits).map(|limit| [one, other].map(|traces| traces.limited_peak(member, limit)));
    let peaks = peaks.chain(limited).filter(|pair| pair.iter().any(|peak| after_start(*peak)));
    let of_peaks_k = peaks.map(|[one, other]| (one.temperature_k - other.temperature_k).abs());
    let [one, other] = [one, other].map(|traces| readings_after_start(traces, member));
    let at_instants_k = one.flatten().zip(other.flatten()).map(|(a, b)| (a - b).abs());
    at_instants_k.chain(of_peaks_k).fold(0.0, f64::max)
}

/// The readings of a member after the prescribed start: of each sensor, then of each part with a temperature limit.
fn readings_after_start(traces: &Traces, member: usize) -> impl Iterator<Item = &[f64]> {
    let sensors = (0..traces.sensors).map(move |sensor| &traces.trace(member, sensor)[1..]);
    sensors.chain((0..traces.limits()).map(move |limit| &traces.limited(member, limit)[1..]))
}
