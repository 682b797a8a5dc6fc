//! Whole traces: in which band a member stays at every instant.
//!
//! A band between percentiles is pointwise: at each instant 95 % of members lie in it, but fewer stay in it throughout. A
//! simultaneous band holds whole traces (Davison & Hinkley, *Bootstrap Methods and their Application*, 1997, section 4.2.4).
//! Here it reaches, at every instant, so many times as far from the nominal trace as the furthest of some members that are
//! marched beforehand: one number a sensor, the 95th percentile over members of the largest deviation in units of this
//! envelope. As the envelope is known before any member of the sweep is marched, that deviation is one number of each
//! member, and is counted as every other output. Any envelope makes a true band; one that has the shape of the spread,
//! with its two sides apart, makes a narrow one. First-order standard deviations would not do: where effects cancel to first
//! order, or all members lie on one side, bands of them are several times as wide as all members.
//!
//! The pointwise band is known only when all members have been counted. How many whole traces stay in it is counted of the
//! first members, whose traces are kept. They are the same in any batch and any piece of a sweep.

use super::nominal::Nominal;
use super::proportion::Proportion;
use crate::case::{Bounds, Case};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::Cpu;
use crate::march::extrapolated::Extrapolated;
use crate::march::monitored::{Monitor, Monitored};
use crate::march::{MarchError, Precision, march_all};
use crate::plan::Plan;
use crate::traces::Arrival;
use std::collections::BTreeMap;

/// The share of whole traces that a simultaneous band holds, in per cent.
pub const PERCENT: f64 = 95.0;
/// Members whose traces are kept, where memory allows: a share of 80 % is then uncertain by 3.5 %.
const KEPT: usize = 500;
/// Temperatures kept at most.
const TEMPERATURES: usize = 1 << 21;
/// Quanta in which deviations from the nominal trace are kept, of one kelvin.
const QUANTA: f64 = 4096.0;
/// Members that make the envelope: about as many as reach what 95 % of whole traces do, and few beside those of a sweep.
const ENVELOPE: usize = 200;
/// Their seed: which they are matters little, and that they are the same does.
const ENVELOPE_SEED: u64 = 0x656e_7665_6c6f_7065;
/// Least reach on either side, as a share of both and in K: others may go where none of these did.
const LEAST_SHARE: f64 = 0.05;
const LEAST_K: f64 = 1e-3;
/// Largest deviation told apart, in reaches of the envelope.
const FARTHEST: f64 = 1e4;

/// How whole traces of a sensor lie.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct WholeTraces {
    /// The lower side of the simultaneous band, in which 95 % of members stay at every instant, K, over the instants.
    pub low_k: Vec<f64>,
    /// The upper side of the simultaneous band, K, over the instants.
    pub high_k: Vec<f64>,
    /// How many times as far from the nominal trace it reaches as the envelope of members marched beforehand.
    pub stretch: f64,
    /// Of the members whose traces were kept, those that stay between the percentiles 2.5 and 97.5 at every instant.
    pub in_pointwise: Proportion,
    /// Of the members whose traces were kept, those that stay in the simultaneous band.
    pub in_simultaneous: Proportion,
}

/// What is known of whole traces while members are counted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TraceCounts {
    sensors: usize,
    /// Sensor × instant, K.
    nominal_k: Vec<f64>,
    envelope: Envelope,
    /// Of the first members, deviations from the nominal traces in quanta.
    kept: BTreeMap<usize, Vec<i32>>,
}

/// How far members that are marched beforehand reach from the nominal traces, sensor × instant, K.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Envelope {
    /// The reach below.
    pub below_k: Vec<f64>,
    /// The reach above.
    pub above_k: Vec<f64>,
}

impl Envelope {
    /// Of members drawn as those of a sweep are. Marched in double precision on the processor, so that it is the same
    /// whatever marches the sweep; `monitor` sees the march.
    ///
    /// # Errors
    /// When the march fails or is cancelled.
    pub fn of(
        case: &Case,
        plan: &Plan,
        nominal: &Nominal,
        bounds: Bounds,
        kind: SamplingKind,
        monitor: &Monitor,
    ) -> Result<Self, MarchError> {
        let sampling = Sampling { kind, seed: ENVELOPE_SEED };
        let members = Ensemble::sample(&case.factors, bounds, &sampling, ENVELOPE).correlated(&case.correlation);
        let nominal_k = nominal.temperatures_k.concat();
        let (mut below_k, mut above_k) = (vec![0.0_f64; nominal_k.len()], vec![0.0_f64; nominal_k.len()]);
        let march = Extrapolated::new(Box::new(Cpu::new(Precision::F64)));
        let mut march = Monitored::new(Box::new(march), monitor.clone());
        march_all(&mut march, &plan.clone().without_gauges(), &members, &mut |traces| {
            for member in (0..traces.members()).filter(|&member| traces.arrivals[member] == Arrival::Done) {
                let sides = below_k.iter_mut().zip(&mut above_k);
                for ((at_k, nominal_k), (below_k, above_k)) in traces.member(member).iter().zip(&nominal_k).zip(sides) {
                    *below_k = below_k.max(nominal_k - at_k);
                    *above_k = above_k.max(at_k - nominal_k);
                }
            }
        })?;
        for (below_k, above_k) in below_k.iter_mut().zip(&mut above_k) {
            let least_k = (LEAST_SHARE * (*below_k + *above_k)).max(LEAST_K);
            (*below_k, *above_k) = (below_k.max(least_k), above_k.max(least_k));
        }
        Ok(Self { below_k, above_k })
    }
}

impl TraceCounts {
    /// Nothing yet, about nominal traces and an envelope of them.
    pub(super) fn new(nominal_k: &[Vec<f64>], envelope: &Envelope) -> Self {
        Self {
            sensors: nominal_k.len(),
            nominal_k: nominal_k.concat(),
            envelope: envelope.clone(),
            kept: BTreeMap::new(),
        }
    }

    /// The largest deviation of each sensor from its nominal trace, in reaches of the envelope, from the temperatures of a
    /// member.
    pub(super) fn farthest(&self, temperatures_k: &[f64]) -> impl Iterator<Item = f64> {
        let instants = (self.nominal_k.len() / self.sensors.max(1)).max(1);
        let sides = self.envelope.below_k.chunks(instants).zip(self.envelope.above_k.chunks(instants));
        let about = self.nominal_k.chunks(instants).zip(sides);
        about.zip(temperatures_k.chunks(instants)).map(|((nominal_k, (below_k, above_k)), trace_k)| {
            let each = trace_k.iter().zip(nominal_k).zip(below_k.iter().zip(above_k));
            let reach = each.map(|((at_k, nominal_k), (below_k, above_k))| {
                ((at_k - nominal_k) / above_k).max((nominal_k - at_k) / below_k)
            });
            reach.fold(0.0, f64::max).min(FARTHEST)
        })
    }

    /// Keeps the temperatures of a member, where it is one of the first.
    pub(super) fn keep(&mut self, member: usize, temperatures_k: &[f64]) {
        if member < self.kept_at_most() {
            let quanta = |(at_k, nominal_k): (&f64, &f64)| ((at_k - nominal_k) * QUANTA).round() as i32;
            self.kept.insert(member, temperatures_k.iter().zip(&self.nominal_k).map(quanta).collect());
        }
    }

    fn kept_at_most(&self) -> usize {
        (TEMPERATURES / self.nominal_k.len().max(1)).clamp(1, KEPT)
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.kept.extend(other.kept.iter().map(|(member, quanta)| (*member, quanta.clone())));
    }

    pub(super) fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    pub(super) fn kept(&self) -> &BTreeMap<usize, Vec<i32>> {
        &self.kept
    }

    /// With the traces that others kept; `None` where they are not such of these sensors and instants.
    pub(super) fn with_kept(mut self, kept: BTreeMap<usize, Vec<i32>>) -> Option<Self> {
        let (most, width) = (self.kept_at_most(), self.nominal_k.len());
        self.kept = kept;
        self.kept.iter().all(|(&member, quanta)| member < most && quanta.len() == width).then_some(self)
    }

    /// How whole traces of a sensor lie, whose band reaches so many times as far as the envelope, beside its pointwise band.
    pub(super) fn of(&self, sensor: usize, stretch: f64, pointwise_k: [&[f64]; 2]) -> WholeTraces {
        let instants = pointwise_k[0].len();
        let range = sensor * instants..(sensor + 1) * instants;
        let nominal_k = &self.nominal_k[range.clone()];
        let end = |reach_k: &[f64], sign: f64| -> Vec<f64> {
            let each = nominal_k.iter().zip(&reach_k[range.clone()]);
            each.map(|(nominal_k, reach_k)| nominal_k + sign * stretch * reach_k).collect()
        };
        let (low_k, high_k) = (end(&self.envelope.below_k, -1.0), end(&self.envelope.above_k, 1.0));
        // Traces are kept to half a quantum, an eighth of a millikelvin.
        let slack_k = 0.5 / QUANTA;
        let staying = |low_k: &[f64], high_k: &[f64]| Proportion {
            count: (self.kept.values())
                .filter(|quanta| {
                    let each = quanta[range.clone()].iter().zip(nominal_k).zip(low_k.iter().zip(high_k));
                    each.into_iter().all(|((&quanta, nominal_k), (low_k, high_k))| {
                        let at_k = nominal_k + f64::from(quanta) / QUANTA;
                        (low_k - slack_k..=high_k + slack_k).contains(&at_k)
                    })
                })
                .count(),
            of: self.kept.len(),
        };
        WholeTraces {
            in_pointwise: staying(pointwise_k[0], pointwise_k[1]),
            in_simultaneous: staying(&low_k, &high_k),
            low_k,
            high_k,
            stretch,
        }
    }
}
