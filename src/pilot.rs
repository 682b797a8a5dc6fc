//! Cells and steps for an error that was asked for, from marches of the nominal member before all others.
//!
//! Every ply has cells of its own, every slice of time a pace of its own. What each adds to the error at the sensors is measured, by marching with twice as many
//! there and nowhere else; then each gets as many as make the whole cheapest. Steps and cells are thereby fine where that shows at a
//! thermocouple, and nowhere else: no estimate of local errors knows what becomes of them on the way there. All members share what comes of it,
//! which keeps differences between them free of the noise of choosing.

use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::march::cpu::Cpu;
use crate::march::extrapolated::march_both;
use crate::march::{MarchError, Precision};
use crate::plan::clock::{Clock, Pace};
use crate::plan::grid::Density;
use crate::plan::{Plan, Reached};
use crate::traces::{Arrival, Traces};
use rayon::prelude::*;

/// Slices of time with a pace of their own.
const SLICES: usize = 8;
/// Rounds of measuring and sharing out anew, at most.
const ROUNDS: usize = 8;
/// A round is worth its time if it may bring the work down to this share.
const WORTH: f64 = 0.9;
/// No plan has more cell-steps: an error that this does not bring down is not one of cells and steps.
const WORK_MOST: f64 = 1e7;
/// Cells and steps of the first round, before they are cut in two: few, as they are added where they are missed.
const CELLS_FIRST: f64 = 32.0;
const STEPS_FIRST: usize = 128;
/// Within one round no share changes more, as errors far from small do not fall by their order.
const CHANGE_MOST: f64 = 2.5;
/// Orders by which errors of an extrapolated march fall with cells and with steps.
const ORDERS: [f64; 2] = [4.0, 3.0];
/// The share of the tolerance that is aimed at.
const AIM: f64 = 0.8;
/// An error is not brought down by more in one round: what one share cannot give within a round the others would be made to.
const FALL_MOST: f64 = 4.0;
/// Corners of the bounds that are marched: a whole group of lanes.
const CORNERS: usize = 8;

/// A share of cells or steps that the pilot hands out.
#[derive(Clone, Debug)]
struct Cut {
    density: Density,
    pace: Pace,
}

impl Cut {
    /// Few cells, and few steps.
    fn first(case: &Case) -> Self {
        let times_s = |pace: &Pace| Clock::new(case, pace, 1).times_s;
        let steps = |pace: &Pace| times_s(pace).len() - 1;
        let mut pace = Pace { lands: false, ..Pace::slowed(&case.resolution, 2.0) };
        let mut number = steps(&pace);
        while number > STEPS_FIRST {
            let slower = Pace {
                first_step_s: 2.0 * pace.first_step_s,
                growth: 2.0 * pace.growth,
                largest_step_s: 2.0 * pace.largest_step_s,
                ..pace.clone()
            };
            let fewer = steps(&slower);
            if fewer * 10 > number * 9 {
                break;
            }
            (pace, number) = (slower, fewer);
        }
        let times_s = times_s(&pace);
        pace.haste = (0..SLICES).map(|slice| (times_s[slice * (times_s.len() - 1) / SLICES], 1.0)).collect();
        pace.haste.dedup_by(|later, earlier| later.0 <= earlier.0);
        Self { density: Density::shared(case, CELLS_FIRST), pace }
    }

    /// Shares: of the plies, then of the slices.
    fn shares(&self) -> usize {
        self.density.plies.len() + self.pace.haste.len()
    }

    fn share(&mut self, share: usize) -> &mut f64 {
        let plies = self.density.plies.len();
        if share < plies { &mut self.density.plies[share] } else { &mut self.pace.haste[share - plies].1 }
    }

    /// A plan like another one of the case, cut so.
    fn plan(&self, case: &Case, like: &Plan) -> Plan {
        like.recut(case, &self.density, &self.pace)
    }

    /// With twice as much of these shares.
    fn doubled(&self, shares: impl IntoIterator<Item = usize>) -> Self {
        let mut cut = self.clone();
        for share in shares {
            *cut.share(share) *= 2.0;
        }
        cut
    }
}

/// A plan for a case: as it states, or for the tolerance that it asks for.
///
/// # Errors
/// None that the processor makes; see [`March::march`](crate::march::March::march).
pub fn pilot(case: &Case) -> Result<Plan, MarchError> {
    let stated = Plan::new(case);
    let Some(tolerance_k) = case.resolution.tolerance_k.filter(|_| !case.sensors.is_empty()) else {
        return Ok(stated);
    };
    let (nominal, plain) = (Ensemble::nominal(&case.factors), stated.clone().without_gauges());
    let mut cut = Cut::first(case);
    let mut best: Option<(Cut, f64, f64)> = None;
    for _ in 0..ROUNDS {
        let plan = cut.plan(case, &plain);
        if work(&plan) > WORK_MOST {
            break;
        }
        let base = marched(&plan, &nominal)?;
        if base.arrivals != [Arrival::Done] {
            // Temperatures run away over long steps, not over wide cells.
            cut = cut.doubled(cut.density.plies.len()..cut.shares());
            continue;
        }
        let all = (0..cut.shares()).collect::<Vec<_>>();
        // The longest march first, so that no thread is left alone with it.
        let tried = [all.as_slice()].into_iter().chain(all.chunks(1)).collect::<Vec<_>>();
        let tried = tried
            .par_iter()
            .map(|shares| {
                let finer = cut.doubled(shares.iter().copied()).plan(case, &plain);
                let cost = work(&finer) / work(&plan) - 1.0;
                Ok(Tried { error_k: worst_k(&marched(&finer, &nominal)?, &base, 0), cost })
            })
            .collect::<Result<Vec<Tried>, MarchError>>()?;
        if tried.iter().any(|tried| !tried.error_k.is_finite()) {
            cut = cut.doubled(cut.density.plies.len()..cut.shares());
            continue;
        }
        let (error_k, parts) = (tried[0].error_k, &tried[1..]);
        let is_better =
            best.as_ref().is_none_or(|(_, kept_k, kept_work)| match (error_k <= tolerance_k, *kept_k <= tolerance_k) {
                (true, true) => work(&plan) < *kept_work,
                (false, false) => error_k < *kept_k,
                (is_within, _) => is_within,
            });
        let next = shared_out(cut.clone(), parts, error_k, (AIM * tolerance_k).max(error_k / FALL_MOST));
        if is_better {
            best = Some((cut, error_k, work(&plan)));
        }
        if error_k <= tolerance_k && work(&next.plan(case, &plain)) > WORTH * work(&plan) {
            break;
        }
        cut = next;
    }
    let Some((cut, nominal_k, _)) = best else { return Ok(stated) };
    let plan = cut.plan(case, &stated);
    let [base, finer] = [&cut, &cut.doubled(0..cut.shares())].map(|cut| cut.plan(case, &plain));
    let corners_k = corners_k(case, &base, &finer)?;
    Ok(Plan { reached: Some(Reached { tolerance_k, nominal_k, corners_k }), ..plan })
}

/// The largest error of members at corners of the factors' small bounds that arrive: all factors low, all high, and in turns.
fn corners_k(case: &Case, plan: &Plan, finer: &Plan) -> Result<Option<f64>, MarchError> {
    if case.factors.is_empty() {
        return Ok(None);
    }
    let row = |corner: usize| {
        let is_high = move |factor: usize| (factor & (corner / 2)).count_ones() as usize % 2 != corner % 2;
        let ends = case.factors.iter().map(|factor| factor.bounds(Bounds::Small)).enumerate();
        ends.map(move |(factor, (low, high))| if is_high(factor) { high } else { low })
    };
    let ensemble = Ensemble::at(case.factors.len(), (0..CORNERS).flat_map(row).collect());
    let (base, finer) = rayon::join(|| marched(plan, &ensemble), || marched(finer, &ensemble));
    let (base, finer) = (base?, finer?);
    let errors_k = (0..CORNERS).map(|corner| worst_k(&base, &finer, corner));
    Ok(errors_k.filter(|error_k| error_k.is_finite()).reduce(f64::max))
}

fn work(plan: &Plan) -> f64 {
    (plan.cells() * plan.steps()) as f64
}

/// What doubling one share does.
#[derive(Clone, Copy, Debug)]
struct Tried {
    /// The most by which it moves a temperature, K.
    error_k: f64,
    /// What it costs, relative to all work.
    cost: f64,
}

/// Cells and steps anew, so that the work is least for an error.
///
/// With each share x its part of the error falls as `x^−q` and its part of the work rises as x. The work is least where q times the one
/// is in the same proportion to the other for all shares: r times a share is best where `r^(q+1) = q e / (μ c)`, and μ is such that the parts make up the error.
fn shared_out(mut cut: Cut, tried: &[Tried], error_k: f64, aim_k: f64) -> Cut {
    // What the shares add one by one is more than what they add together, where signs differ or other sensors feel it.
    let together = error_k / tried.iter().map(|tried| tried.error_k).sum::<f64>().max(1e-12);
    let plies = cut.density.plies.len();
    let order = |share: usize| ORDERS[usize::from(share >= plies)];
    let times = |share: usize, worth: f64| {
        let Tried { error_k, cost } = tried[share];
        let best =
            (order(share) * (error_k * together).max(1e-9) / (worth * cost.max(1e-4))).powf(1.0 / (order(share) + 1.0));
        best.clamp(1.0 / CHANGE_MOST, CHANGE_MOST)
    };
    let left_k = |worth: f64| -> f64 {
        (0..tried.len()).map(|share| tried[share].error_k * together * times(share, worth).powf(-order(share))).sum()
    };
    let (mut low, mut high) = (-40.0_f64, 40.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left_k(middle.exp()) > aim_k { high = middle } else { low = middle }
    }
    for share in 0..tried.len() {
        *cut.share(share) *= times(share, low.exp());
    }
    cut
}

fn marched(plan: &Plan, ensemble: &Ensemble) -> Result<Traces, MarchError> {
    march_both(&mut Cpu::new(Precision::F64), plan, ensemble, 0..ensemble.len())
}

/// The largest difference between two marches of a member at any sensor and instant, K; without end where either did not arrive, as a
/// maximum would pass over what is no number.
fn worst_k(one: &Traces, other: &Traces, member: usize) -> f64 {
    if [one, other].iter().any(|traces| traces.arrivals[member] != Arrival::Done) {
        return f64::INFINITY;
    }
    let pairs = one.member(member).iter().zip(other.member(member));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_that_does_not_arrive_is_off_without_end_however_its_numbers_compare() {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        let done = marched(&Plan::new(&case), &Ensemble::nominal(&case.factors)).expect("the processor marches");
        assert_eq!(worst_k(&done, &done, 0), 0.0);
        let mut strayed = done.clone();
        strayed.temperatures_k.fill(f64::NAN);
        strayed.arrivals[0] = Arrival::Strayed { time_s: 1.0 };
        assert_eq!(worst_k(&done, &strayed, 0), f64::INFINITY);
        assert_eq!(worst_k(&strayed, &done, 0), f64::INFINITY);
    }

    #[test]
    fn an_error_that_cells_and_steps_cannot_bring_down_ends_the_search_and_is_told() {
        let mut case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        case.resolution.tolerance_k = Some(1e-9);
        let plan = pilot(&case).expect("the processor marches");
        let reached = plan.reached.expect("a pilot says how far it came");
        assert!(reached.nominal_k > 1e-9 && reached.nominal_k < 1e-2, "{reached:?}");
        assert!(work(&plan) <= WORK_MOST, "{} cells, {} steps", plan.cells(), plan.steps());
    }
}
