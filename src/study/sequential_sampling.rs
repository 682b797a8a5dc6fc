//! Sampling until the confidence interval of a percentile or of a probability has a stated half-width.
//!
//! The interval is computed at *looks*: after [`FIRST_LOOK`] members and each time their number has grown by a quarter.
//! Sampling ends at the first look with a narrow enough interval. Ending on the width of an interval lowers its
//! coverage, as the width depends on the same members: with intervals of 95 % at each look, exact summation over all
//! paths of the count gives 94.4 % in the worst case of a probability. So each look has an interval of 96 %, whose
//! coverage at the end is at least 95 % (Frey, Am. Stat. 64, 2010, chooses the level in this way).
//!
//! A probability below [`RARE`] by the first-order method is computed by importance sampling about the design points.
//! Which method is used depends on the case alone, so that it does not bias the estimate.

mod peak_limit_state;
mod target;

pub use target::{HalfWidth, PrecisionTarget, TargetQuantity};

use super::margins::quantile_rank;
use super::uncertainty::{MembersError, Sweep, SweepStatistics};
use crate::adapt::member_errors_k;
use crate::case::Case;
use crate::ensemble::{Ensemble, StandardNormalSpace};
use crate::fit::proportion::{Proportion, quantile_ranks};
use crate::fit::reliability::{
    DesignPoint, DesignPoints, ImportanceEstimate, ImportanceSampling, LimitState, find_design_points,
};
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{MemberStatus, Traces};
use peak_limit_state::PeakLimitState;
use std::ops::Range;

/// Members at the first look.
pub const FIRST_LOOK: usize = 500;
/// Members of a look relative to those of the look before.
const GROWTH: f64 = 1.25;
/// Probability of each tail of the interval of a look.
pub const TAIL: f64 = 0.02;
/// Probability of exceedance, by the first-order method, below which importance sampling is used.
pub const RARE: f64 = 0.05;
/// Effective number of members above the limit that importance sampling needs for an interval: the mean of fewer is
/// not normally distributed.
pub const MIN_EFFECTIVE: f64 = 100.0;

/// A percentile or a probability, with its interval.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct PrecisionReached {
    /// The quantity and its half-width.
    pub target: PrecisionTarget,
    /// The looks; the last one is the result.
    pub looks: Vec<Look>,
    /// Whether the interval has the half-width; if not, sampling ended at the largest number of members, or was
    /// stopped.
    pub is_reached: bool,
    /// Largest number of members.
    pub max_members: usize,
    /// Members that failed; they count as above every temperature.
    pub failed: usize,
    /// Importance sampling; `None` where members were drawn plainly.
    pub importance: Option<Importance>,
    /// Why the members of a probability were drawn plainly; `None` of a percentile.
    pub plain_reason: Option<PlainReason>,
}

/// Why a probability was not computed by importance sampling.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum PlainReason {
    /// It is not rare: this is its value by the first-order method.
    Frequent {
        /// Sum over the design points.
        first_order: f64,
    },
    /// No search for a combination of factors that reaches the temperature converged.
    NoDesignPoint,
    /// The emissivity of a face, which a pyrometer holds, is drawn with the factors, and has no derivatives.
    HeldEmissivity,
}

/// How the members of a probability are drawn.
pub enum Drawing {
    /// About design points.
    Importance(DesignPoints),
    /// Plainly.
    Plain(PlainReason),
}

/// The estimate from the members so far.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Look {
    /// Members drawn.
    pub members: usize,
    /// Percentile, K, or probability.
    pub estimate: f64,
    /// Lower end of the interval; `None` with too few members.
    pub low: Option<f64>,
    /// Upper end of the interval; `None` with too few members.
    pub high: Option<f64>,
}

/// Importance sampling about design points.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Importance {
    /// The most probable points that reach the temperature, in standard normal variables.
    pub design: DesignPoints,
    /// The factors at each of them.
    pub factors: Vec<Vec<f64>>,
    /// Sums over the members.
    pub estimate: ImportanceEstimate,
    /// Discretisation error of the members that decide; `None` where the case states cells and steps.
    pub discretisation_error: Option<ImportanceError>,
}

/// Estimated discretisation error of members of importance sampling, as [`SweepError`](super::uncertainty::SweepError).
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ImportanceError {
    /// The design points.
    pub design_points: MembersError,
    /// The members whose peaks are nearest to the temperature, at most 64: an error may move them across it.
    pub nearest: MembersError,
}

impl Look {
    /// The larger distance of the ends of the interval from the estimate; infinite where an end is unknown.
    pub fn half_width(&self) -> f64 {
        match (self.low, self.high) {
            (Some(low), Some(high)) => (self.estimate - low).max(high - self.estimate),
            _ => f64::INFINITY,
        }
    }

    pub(crate) fn is_within(&self, half_width: HalfWidth) -> bool {
        let most = match half_width {
            HalfWidth::Absolute(most) => most,
            HalfWidth::Relative(share) => share * self.estimate,
        };
        self.half_width() <= most
    }
}

impl PrecisionReached {
    /// The last look; `None` if sampling was stopped before the first one.
    pub fn last(&self) -> Option<&Look> {
        self.looks.last()
    }

    /// Members drawn, without those of the search for the design point.
    pub fn members(&self) -> usize {
        self.last().map_or(0, |look| look.members)
    }
}

/// The numbers of members at the looks, up to a largest one.
pub(crate) fn looks(most: usize) -> impl Iterator<Item = usize> {
    let next = move |&members: &usize| (members < most).then(|| ((GROWTH * members as f64).ceil() as usize).min(most));
    std::iter::successors(Some(FIRST_LOOK.min(most)), next)
}

/// The percentile or the probability from the peaks of independent members, K, in ascending order.
pub(crate) fn look(peaks_k: &[f64], quantity: TargetQuantity) -> Look {
    let members = peaks_k.len();
    match quantity {
        TargetQuantity::Percentile(probability) => {
            let at_rank = |rank: usize| peaks_k[rank - 1];
            let (low, high) = quantile_ranks(members, probability, TAIL);
            let estimate = at_rank(quantile_rank(members, probability));
            Look { members, estimate, low: low.map(at_rank), high: high.map(at_rank) }
        }
        TargetQuantity::Exceedance { temperature_k } => {
            let count = members - peaks_k.partition_point(|&peak_k| peak_k <= temperature_k);
            let counted = Proportion { count, total: members };
            let (low, high) = counted.interval(TAIL);
            Look { members, estimate: counted.fraction(), low: Some(low), high: Some(high) }
        }
    }
}

/// How the members of the probability that a sensor exceeds a temperature are drawn.
///
/// # Errors
/// When the device fails.
pub fn drawing(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    sweep: &Sweep,
    sensor: usize,
    temperature_k: f64,
) -> Result<Drawing, MarchError> {
    let plan = plan.clone().without_gauges();
    let space = StandardNormalSpace::new(&case.factors, sweep.bounds, sweep.sampling.kind, &case.correlation);
    let found = find_design_points(&mut PeakLimitState::new(&plan, march, &space, sensor, temperature_k))?;
    let first_order = found.points.iter().map(DesignPoint::first_order_probability).sum::<f64>();
    Ok(if found.points.is_empty() {
        Drawing::Plain(PlainReason::NoDesignPoint)
    } else if first_order < RARE {
        Drawing::Importance(found)
    } else {
        Drawing::Plain(PlainReason::Frequent { first_order })
    })
}

/// March members of a sweep into its statistics until the target is met, or the sweep is complete. `on_batch` receives
/// each batch.
///
/// # Errors
/// When the device fails or the march is cancelled. A march that is stopped ends with the members so far.
pub fn sweep_until(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    sweep_statistics: &mut SweepStatistics,
    sweep: &Sweep,
    target: &PrecisionTarget,
    on_batch: &mut dyn FnMut(&Ensemble, &Traces),
) -> Result<PrecisionReached, MarchError> {
    let ensemble = sweep.ensemble(case);
    let (mut peaks_k, mut failed): (Vec<f64>, usize) = (Vec::new(), 0);
    let (mut found, mut is_reached): (Vec<Look>, bool) = (Vec::new(), false);
    for members in looks(sweep.members) {
        let range = peaks_k.len()..members;
        let marched = sweep_statistics.march(case, plan, march, &ensemble, range, &mut |_, ensemble, traces| {
            for member in 0..traces.members() {
                let is_completed = traces.statuses[member] == MemberStatus::Completed;
                let peak = traces.peak(member, target.sensor);
                peaks_k.push(if is_completed { peak.temperature_k } else { f64::INFINITY });
                failed += usize::from(!is_completed);
            }
            on_batch(ensemble, traces);
        });
        match marched {
            Err(MarchError::Stopped) if sweep_statistics.completed() >= 2 => break,
            other => other?,
        }
        peaks_k.sort_by(f64::total_cmp);
        let look = look(&peaks_k, target.quantity);
        found.push(look);
        is_reached = look.is_within(target.half_width);
        if is_reached {
            break;
        }
    }
    Ok(PrecisionReached {
        target: *target,
        looks: found,
        is_reached,
        max_members: sweep.members,
        failed,
        importance: None,
        plain_reason: None,
    })
}

/// The probability that a sensor exceeds a temperature, by importance sampling about its design points, until the
/// target is met or the largest number of members is drawn.
///
/// # Errors
/// When the device fails, or the march is stopped or cancelled.
pub fn importance_sampling_until(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    sweep: &Sweep,
    target: &PrecisionTarget,
    temperature_k: f64,
    design: DesignPoints,
) -> Result<PrecisionReached, MarchError> {
    let plan = plan.clone().without_gauges();
    let space = StandardNormalSpace::new(&case.factors, sweep.bounds, sweep.sampling.kind, &case.correlation);
    let mut state = PeakLimitState::new(&plan, march, &space, target.sensor, temperature_k);
    let centres = design.points.iter().map(|point| point.scores.clone()).collect();
    let sampling = ImportanceSampling::new(centres, sweep.sampling.seed);
    let Sampled { estimate, looks, is_reached, nearest } =
        sample_until(&mut state, &sampling, target.half_width, sweep.members)?;
    let failed = state.failed;
    let factors: Vec<Vec<f64>> = design.points.iter().map(|point| space.factors(&point.scores)).collect();
    let discretisation_error = match plan.error_estimate {
        None => None,
        Some(_) => {
            let nearest = nearest.iter().map(|&(_, index)| space.factors(&sampling.member(index).scores));
            let values: Vec<f64> = factors.iter().cloned().chain(nearest).flatten().collect();
            let members = Ensemble::from_values(space.variables(), values);
            let (precision, monitor) = (march.backend().precision, march.monitor().without_progress());
            let errors_k = member_errors_k(case, &plan, precision, &members, &monitor)?;
            let (design_points_k, nearest_k) = errors_k.split_at(factors.len());
            let [design_points, nearest] = [design_points_k, nearest_k].map(MembersError::of);
            Some(ImportanceError { design_points, nearest })
        }
    };
    Ok(PrecisionReached {
        target: *target,
        looks,
        is_reached,
        max_members: sweep.members,
        failed,
        importance: Some(Importance { design, factors, estimate, discretisation_error }),
        plain_reason: None,
    })
}

/// Importance sampling up to a half-width.
pub(crate) struct Sampled {
    estimate: ImportanceEstimate,
    pub(crate) looks: Vec<Look>,
    is_reached: bool,
    /// The members nearest to the limit state, with their distance from it.
    nearest: Vec<(f64, usize)>,
}

/// Most members near the limit state whose error is measured: SIMD groups in f64, few beside a look.
const MAX_NEAREST: usize = 64;

/// Draw members until the interval of the probability has a half-width, or the largest number is drawn.
pub(crate) fn sample_until<L: LimitState>(
    state: &mut L,
    sampling: &ImportanceSampling,
    half_width: HalfWidth,
    most: usize,
) -> Result<Sampled, L::Error> {
    let mut sampled =
        Sampled { estimate: ImportanceEstimate::default(), looks: Vec::new(), is_reached: false, nearest: Vec::new() };
    for members in looks(most) {
        add_members(state, sampling, sampled.estimate.members..members, &mut sampled)?;
        let Sampled { estimate, looks: found, is_reached, .. } = &mut sampled;
        let (low, high) = estimate.interval(TAIL);
        let look = Look { members, estimate: estimate.probability(), low: Some(low), high: Some(high) };
        found.push(look);
        *is_reached = estimate.effective_exceeding() >= MIN_EFFECTIVE && look.is_within(half_width);
        if *is_reached {
            break;
        }
    }
    Ok(sampled)
}

/// Points in memory at once.
const CHUNK: usize = 4096;

fn add_members<L: LimitState>(
    state: &mut L,
    sampling: &ImportanceSampling,
    members: Range<usize>,
    sampled: &mut Sampled,
) -> Result<(), L::Error> {
    for first in members.clone().step_by(CHUNK) {
        let drawn: Vec<_> = (first..(first + CHUNK).min(members.end)).map(|index| sampling.member(index)).collect();
        let points: Vec<Vec<f64>> = drawn.iter().map(|member| member.scores.clone()).collect();
        let values = state.values(&points)?;
        drawn.iter().zip(&values).for_each(|(member, value)| sampled.estimate.add(member, *value < 0.0));
        sampled.nearest.extend(values.iter().map(|value| value.abs()).zip(first..));
        // By member where equal, so that the choice does not depend on the sort.
        sampled.nearest.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        sampled.nearest.truncate(MAX_NEAREST);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
