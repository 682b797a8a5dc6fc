//! Simultaneous bands: bands that contain whole traces.
//!
//! A band between percentiles is pointwise: at each instant it contains 95 % of the members, but fewer stay in it
//! throughout. A simultaneous band contains whole traces (Davison & Hinkley, *Bootstrap Methods and their Application*,
//! 1997, section 4.2.4). Here its distance from the nominal trace is an envelope times one number per sensor: the 95th
//! percentile over members of the largest deviation in units of the envelope. The envelope is the extreme deviation of
//! some members marched before the sweep, so the largest deviation of a member is one number, accumulated like any
//! other output. Any envelope gives a valid band; one with the shape of the spread, separate on both sides, gives a
//! narrow one. First-order standard deviations are unsuitable: where effects cancel to first order, or all members lie
//! on one side, their bands are several times too wide.
//!
//! The pointwise band is known only after all members are counted. Its coverage of whole traces is counted over the
//! first members, whose traces are stored and do not depend on batches or pieces.

use super::nominal::Prediction;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::proportion::Proportion;
use crate::march::cpu::Cpu;
use crate::march::monitor::{Monitor, MonitoredMarch};
use crate::march::richardson::RichardsonMarch;
use crate::march::{MarchError, Precision, march_all};
use crate::plan::Plan;
use crate::traces::MemberStatus;
use std::collections::BTreeMap;

/// Coverage of a simultaneous band, per cent.
pub const COVERAGE_PERCENT: f64 = 95.0;
/// Members whose traces are stored, where memory allows: a coverage of 80 % is then known to ± 3.5 %.
const MAX_STORED_MEMBERS: usize = 500;
/// Largest number of stored temperatures.
const MAX_STORED_TEMPERATURES: usize = 1 << 21;
/// Resolution of stored deviations from the nominal trace, quanta per kelvin.
const QUANTA_PER_K: f64 = 4096.0;
/// Members that define the envelope: enough to reach about the 95 % band, and few compared with a sweep.
const ENVELOPE_MEMBERS: usize = 200;
/// Seed of the envelope members, fixed for reproducibility.
const ENVELOPE_SEED: u64 = 0x656e_7665_6c6f_7065;
/// Smallest reach on either side, as a fraction of both and in K, because other members may deviate where none of these
/// did.
const MIN_ENVELOPE_FRACTION: f64 = 0.05;
const MIN_ENVELOPE_K: f64 = 1e-3;
/// Largest deviation counted, in units of the envelope.
const MAX_DEVIATION: f64 = 1e4;

/// The simultaneous band of a sensor, and the coverage of both bands.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct SimultaneousBand {
    /// Lower limit of the simultaneous band, which contains 95 % of members at every instant, K, over the instants.
    pub low_k: Vec<f64>,
    /// Upper limit of the simultaneous band, K, over the instants.
    pub high_k: Vec<f64>,
    /// Ratio of the band to the envelope.
    pub envelope_ratio: f64,
    /// Stored members that stay between the percentiles 2.5 and 97.5 at every instant.
    pub in_pointwise: Proportion,
    /// Stored members that stay in the simultaneous band.
    pub in_simultaneous: Proportion,
}

/// Accumulated data for the coverage of whole traces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TraceCoverage {
    sensors: usize,
    /// Sensor × instant, K.
    nominal_k: Vec<f64>,
    envelope: Envelope,
    /// Deviations of the first members from the nominal traces, in quanta.
    stored: BTreeMap<usize, Vec<i32>>,
}

/// Largest deviations of some members from the nominal traces, sensor × instant, K.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Envelope {
    /// Largest deviation below.
    pub below_k: Vec<f64>,
    /// Largest deviation above.
    pub above_k: Vec<f64>,
}

impl Envelope {
    /// The envelope of members sampled like those of the sweep, marched on the CPU in double precision, so that it does
    /// not depend on the backend; `monitor` observes the march.
    ///
    /// # Errors
    /// When the march fails or is cancelled.
    pub fn of(
        case: &Case,
        plan: &Plan,
        nominal: &Prediction,
        bounds: Bounds,
        kind: SamplingKind,
        monitor: &Monitor,
    ) -> Result<Self, MarchError> {
        let sampling = Sampling { kind, seed: ENVELOPE_SEED };
        let members =
            Ensemble::sample(&case.factors, bounds, &sampling, ENVELOPE_MEMBERS).correlated(&case.correlation);
        let nominal_k = nominal.reference_traces_k(case).concat();
        let (mut below_k, mut above_k) = (vec![0.0_f64; nominal_k.len()], vec![0.0_f64; nominal_k.len()]);
        let march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let mut march = MonitoredMarch::new(Box::new(march), monitor.clone());
        march_all(&mut march, &plan.clone().without_gauges(), &members, &mut |traces| {
            for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed) {
                let sides = below_k.iter_mut().zip(&mut above_k);
                for ((at_k, nominal_k), (below_k, above_k)) in traces.member(member).iter().zip(&nominal_k).zip(sides) {
                    *below_k = below_k.max(nominal_k - at_k);
                    *above_k = above_k.max(at_k - nominal_k);
                }
            }
        })?;
        for (below_k, above_k) in below_k.iter_mut().zip(&mut above_k) {
            let least_k = (MIN_ENVELOPE_FRACTION * (*below_k + *above_k)).max(MIN_ENVELOPE_K);
            (*below_k, *above_k) = (below_k.max(least_k), above_k.max(least_k));
        }
        Ok(Self { below_k, above_k })
    }
}

impl TraceCoverage {
    /// Empty, about nominal traces and their envelope.
    pub(super) fn new(nominal_k: &[Vec<f64>], envelope: &Envelope) -> Self {
        Self {
            sensors: nominal_k.len(),
            nominal_k: nominal_k.concat(),
            envelope: envelope.clone(),
            stored: BTreeMap::new(),
        }
    }

    /// Largest deviation of each sensor of a member from its nominal trace, in units of the envelope.
    pub(super) fn max_deviations(&self, temperatures_k: &[f64]) -> impl Iterator<Item = f64> {
        let instants = (self.nominal_k.len() / self.sensors.max(1)).max(1);
        let sides = self.envelope.below_k.chunks(instants).zip(self.envelope.above_k.chunks(instants));
        let about = self.nominal_k.chunks(instants).zip(sides);
        about.zip(temperatures_k.chunks(instants)).map(|((nominal_k, (below_k, above_k)), trace_k)| {
            let each = trace_k.iter().zip(nominal_k).zip(below_k.iter().zip(above_k));
            let reach = each.map(|((at_k, nominal_k), (below_k, above_k))| {
                ((at_k - nominal_k) / above_k).max((nominal_k - at_k) / below_k)
            });
            reach.fold(0.0, f64::max).min(MAX_DEVIATION)
        })
    }

    /// Store the trace of a member, if it is one of the first.
    pub(super) fn store(&mut self, member: usize, temperatures_k: &[f64]) {
        if member < self.max_stored() {
            let quanta = |(at_k, nominal_k): (&f64, &f64)| ((at_k - nominal_k) * QUANTA_PER_K).round() as i32;
            self.stored.insert(member, temperatures_k.iter().zip(&self.nominal_k).map(quanta).collect());
        }
    }

    fn max_stored(&self) -> usize {
        (MAX_STORED_TEMPERATURES / self.nominal_k.len().max(1)).clamp(1, MAX_STORED_MEMBERS)
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.stored.extend(other.stored.iter().map(|(member, quanta)| (*member, quanta.clone())));
    }

    pub(super) fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    pub(super) fn stored(&self) -> &BTreeMap<usize, Vec<i32>> {
        &self.stored
    }

    /// With stored traces; `None` where they do not fit the sensors and instants.
    pub(super) fn with_stored(mut self, stored: BTreeMap<usize, Vec<i32>>) -> Option<Self> {
        let (most, width) = (self.max_stored(), self.nominal_k.len());
        self.stored = stored;
        self.stored.iter().all(|(&member, quanta)| member < most && quanta.len() == width).then_some(self)
    }

    /// Traces of a sensor of the first stored members, at most `count`, K.
    pub(super) fn first_traces_k(&self, sensor: usize, count: usize) -> Vec<Vec<f64>> {
        let instants = self.nominal_k.len() / self.sensors.max(1);
        let range = sensor * instants..(sensor + 1) * instants;
        let trace = |quanta: &Vec<i32>| {
            let each = quanta[range.clone()].iter().zip(&self.nominal_k[range.clone()]);
            each.map(|(&quanta, nominal_k)| nominal_k + f64::from(quanta) / QUANTA_PER_K).collect()
        };
        self.stored.values().take(count).map(trace).collect()
    }

    /// The simultaneous band of a sensor at a ratio to the envelope, and the coverage of it and of the pointwise band.
    pub(super) fn band(&self, sensor: usize, stretch: f64, pointwise_k: [&[f64]; 2]) -> SimultaneousBand {
        let instants = pointwise_k[0].len();
        let range = sensor * instants..(sensor + 1) * instants;
        let nominal_k = &self.nominal_k[range.clone()];
        let end = |reach_k: &[f64], sign: f64| -> Vec<f64> {
            let each = nominal_k.iter().zip(&reach_k[range.clone()]);
            each.map(|(nominal_k, reach_k)| nominal_k + sign * stretch * reach_k).collect()
        };
        let (low_k, high_k) = (end(&self.envelope.below_k, -1.0), end(&self.envelope.above_k, 1.0));
        // Stored traces are rounded to half a quantum, an eighth of a millikelvin.
        let slack_k = 0.5 / QUANTA_PER_K;
        let staying = |low_k: &[f64], high_k: &[f64]| Proportion {
            count: (self.stored.values())
                .filter(|quanta| {
                    let each = quanta[range.clone()].iter().zip(nominal_k).zip(low_k.iter().zip(high_k));
                    each.into_iter().all(|((&quanta, nominal_k), (low_k, high_k))| {
                        let at_k = nominal_k + f64::from(quanta) / QUANTA_PER_K;
                        (low_k - slack_k..=high_k + slack_k).contains(&at_k)
                    })
                })
                .count(),
            total: self.stored.len(),
        };
        SimultaneousBand {
            in_pointwise: staying(pointwise_k[0], pointwise_k[1]),
            in_simultaneous: staying(&low_k, &high_k),
            low_k,
            high_k,
            envelope_ratio: stretch,
        }
    }
}
