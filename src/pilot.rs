//! Cells and steps for an error that was asked for, from marches of the nominal member before all others.
//!
//! Every ply has cells of its own, every slice of time a pace of its own. What each adds to the error at the sensors is measured, by marching with twice as many
//! there and nowhere else; then each gets as many as make the whole cheapest. Steps and cells are thereby fine where that shows at a
//! thermocouple, and nowhere else: no estimate of local errors knows what becomes of them on the way there. All members share what comes of it,
//! which keeps differences between them free of the noise of choosing.

pub mod error_estimate;

use crate::case::{Bounds, Case};
use crate::ensemble::Ensemble;
use crate::march::cpu::Cpu;
use crate::march::extrapolated::march_both;
use crate::march::monitored::{Monitor, Progress};
use crate::march::{MarchError, Precision};
use crate::plan::Density;
use crate::plan::{Discretisation, Plan};
use crate::plan::{GRADING, Growth, Pace, Slice};
use crate::traces::{Arrival, Traces};
use error_estimate::{Estimate, TWOFOLD, worst_k};
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Slices of time with a density of steps of their own.
const SLICES: usize = 8;
/// Rounds of measuring and sharing out anew, at most.
const ROUNDS: usize = 10;
/// Rounds in a row that find no cheaper plan, once one has met the tolerance, at most: errors of noisy schedules scatter from plan to plan.
const VAIN_MOST: usize = 2;
/// A round is worth its time if it may bring the work down to this share.
const WORTH: f64 = 0.9;
/// No plan has more cell-steps: an error that this does not bring down is not one of cells and steps.
const WORK_MOST: f64 = 1e7;
/// Cells and steps of the first round, before they are cut in two: few, as they are added where they are missed.
const CELLS_FIRST: f64 = 32.0;
const STEPS_FIRST: usize = 128;
/// A slice of the first pace has about half a step left at this density; with fewer, steps that lead over it hide how its error falls.
const DENSITY_LEAST: f64 = SLICES as f64 / (2.0 * STEPS_FIRST as f64);
/// How many times finer than one step for the whole march the first pace is that is tried.
const FINEST: f64 = 16.0;
/// Within one round no share changes more, as errors far from small do not fall by their order.
const CHANGE_MOST: f64 = 2.5;
/// Orders by which errors of an extrapolated march fall with cells and with steps.
const ORDERS: [f64; 2] = [4.0, 3.0];
/// The share of the tolerance that is aimed at.
const AIM: f64 = 0.8;
/// An error is not brought down by more in one round: what one share cannot give within a round the others would be made to.
const FALL_MOST: f64 = 4.0;
/// Trials of fewer cells and steps in the end, the share of the tolerance that they aim at, and the work that makes one worth it.
const TRIMS: usize = 4;
const TRIMMED: f64 = 0.98;
const TRIM_WORTH: f64 = 0.97;
/// Rounds in which a plan is held against four times its cells and steps, and the most cell-steps of such a march.
const CONFIRMATIONS: usize = 3;
const CONFIRMED_MOST: f64 = 4e7;
/// Corners of the bounds that are marched: a whole group of lanes.
const CORNERS: usize = 8;

impl Discretisation {
    /// Few cells, and few steps, for the case of a plan.
    fn first(case: &Case, plan: &Plan) -> Self {
        let times_s = |pace: &Pace| plan.clock(case, pace, 1).times_s;
        let steps = |pace: &Pace| times_s(pace).len() - 1;
        let paced = |coefficient| Pace { growth: Growth::Graded { coefficient }, slices: Vec::new() };
        let mut coefficient = case.exposure.duration_s.powf(1.0 / GRADING) / FINEST;
        let mut number = steps(&paced(coefficient));
        while number > STEPS_FIRST {
            let fewer = steps(&paced(2.0 * coefficient));
            if fewer * 10 > number * 9 {
                break;
            }
            (coefficient, number) = (2.0 * coefficient, fewer);
        }
        let mut pace = paced(coefficient);
        let times_s = times_s(&pace);
        let slice =
            |slice: usize| Slice { from_s: times_s[slice * (times_s.len() - 1) / SLICES], density: 1.0, cuts: 1 };
        pace.slices = (0..SLICES).map(slice).collect();
        pace.slices.dedup_by(|later, earlier| later.from_s <= earlier.from_s);
        Self { density: Density::shared(case, CELLS_FIRST), pace }
    }

    /// Shares: of the plies, then of the slices.
    fn shares(&self) -> usize {
        self.density.plies.len() + self.pace.slices.len()
    }

    fn scale(&mut self, share: usize, times: f64) {
        let plies = self.density.plies.len();
        if share < plies {
            self.density.plies[share] *= times;
        } else {
            let density = &mut self.pace.slices[share - plies].density;
            *density = (*density * times).max(DENSITY_LEAST);
        }
    }

    /// With each cell or step of one share cut into two: a density alone changes nothing where a ply has the fewest cells that
    /// it can have, or where there is a step from one corner of a schedule to the next.
    fn halved(&self, share: usize) -> Self {
        let mut finer = self.clone();
        let plies = self.density.plies.len();
        if share < plies {
            finer.density.cuts[share] *= 2;
        } else {
            finer.pace.slices[share - plies].cuts *= 2;
        }
        finer
    }

    /// With so many times as many of all.
    fn scaled(mut self, times: f64) -> Self {
        (0..self.shares()).for_each(|share| self.scale(share, times));
        self
    }

    /// With twice the steps everywhere: temperatures run away over long steps, not over wide cells.
    fn slower(mut self) -> Self {
        self.pace.slices.iter_mut().for_each(|slice| slice.density *= 2.0);
        self
    }

    /// With the densities that plies really have, of which rounding and the least number of cells made something else.
    fn with_cells_of(mut self, plan: &Plan) -> Self {
        for (density, ply) in self.density.plies.iter_mut().zip(&plan.plies) {
            *density = f64::from(ply.end_cell - ply.first_cell) / 2.0;
        }
        self
    }
}

/// A plan for a case: as it states, or for the tolerance that it asks for.
///
/// # Errors
/// None that the processor makes; see [`March::march`](crate::march::March::march).
pub fn pilot(case: &Case) -> Result<Plan, MarchError> {
    pilot_monitored(case, &Monitor::default())
}

/// [`pilot`], seen by a monitor.
///
/// # Errors
/// When the monitor is cancelled, before the next march.
pub fn pilot_monitored(case: &Case, monitor: &Monitor) -> Result<Plan, MarchError> {
    let trials = Trials { monitor, marched: Mutex::new(0) };
    let stated = Plan::new(case);
    let Some(tolerance_k) = case.resolution.tolerance_k.filter(|_| !case.sensors.is_empty()) else {
        return Ok(stated);
    };
    let nominal = Ensemble::nominal(&case.factors);
    let mut cut = Discretisation::first(case, &stated);
    let mut best: Option<(Discretisation, Estimate, f64)> = None;
    let mut vain = 0;
    for _ in 0..ROUNDS {
        let plan = stated.recut(case, cut.clone());
        if work(&plan) > WORK_MOST {
            break;
        }
        let base = trials.marched(&plan, &nominal)?;
        if base.arrivals != [Arrival::Done] {
            cut = cut.slower();
            continue;
        }
        // The longest march first, so that no thread is left alone with it.
        let tried: Vec<Discretisation> =
            std::iter::once(cut.refined(2)).chain((0..cut.shares()).map(|share| cut.halved(share))).collect();
        let tried = tried
            .into_par_iter()
            .map(|finer| {
                let finer = stated.recut(case, finer);
                let cost = work(&finer) / work(&plan) - 1.0;
                Ok((Estimate::twofold(&base, &trials.marched(&finer, &nominal)?, tolerance_k), cost))
            })
            .collect::<Result<Vec<(Estimate, f64)>, MarchError>>()?;
        if tried.iter().any(|(estimate, _)| !estimate.relative().is_finite()) {
            cut = cut.slower();
            continue;
        }
        let parts: Vec<Tried> =
            tried[1..].iter().map(|(estimate, cost)| Tried { error: estimate.relative(), cost: *cost }).collect();
        let estimate = tried.into_iter().next().map(|(estimate, _)| estimate).unwrap_or_default();
        let error = estimate.relative();
        let is_better = best.as_ref().is_none_or(|(_, kept, kept_work)| {
            let kept = kept.relative();
            match (error <= 1.0, kept <= 1.0) {
                (true, true) => work(&plan) < *kept_work,
                (false, false) => error < kept,
                (is_within, _) => is_within,
            }
        });
        let next = shared_out(cut.clone().with_cells_of(&plan), &parts, error, AIM.max(error / FALL_MOST));
        let has_met = best.as_ref().is_some_and(|(_, kept, _)| kept.relative() <= 1.0);
        if is_better {
            best = Some((cut, estimate, work(&plan)));
            vain = 0;
        } else if has_met {
            vain += 1;
            if vain == VAIN_MOST {
                break;
            }
        }
        if error <= 1.0 && work(&stated.recut(case, next.clone())) > WORTH * work(&plan) {
            break;
        }
        cut = next;
    }
    let Some((mut cut, mut estimate, _)) = best else { return Ok(stated) };
    let mut plan = stated.recut(case, cut.clone());
    // Rounds end where the next is not sure to gain: what is left of the tolerance is trimmed off all shares alike.
    let trimmed = |error: f64| (error / TRIMMED).powf(1.0 / ORDERS[1]);
    let mut times = trimmed(estimate.relative());
    for _ in 0..TRIMS {
        let fewer = cut.clone().with_cells_of(&plan).scaled(times);
        let thinner = stated.recut(case, fewer.clone());
        if estimate.relative() > 1.0 || work(&thinner) > TRIM_WORTH * work(&plan) {
            break;
        }
        let finer = stated.recut(case, fewer.refined(2));
        let (base, finer) = rayon::join(|| trials.marched(&thinner, &nominal), || trials.marched(&finer, &nominal));
        let found = Estimate::twofold(&base?, &finer?, tolerance_k);
        if found.relative() <= 1.0 {
            (cut, plan, estimate) = (fewer, thinner, found);
            times = trimmed(estimate.relative());
        } else {
            times = 0.5 * (1.0 + times);
        }
    }
    // Of few cells and steps the error does not fall by its order yet: four times as many confirm it.
    for _ in 0..CONFIRMATIONS {
        let finest = stated.recut(case, cut.refined(4));
        if work(&finest) > CONFIRMED_MOST {
            break;
        }
        let (base, finest) = rayon::join(|| trials.marched(&plan, &nominal), || trials.marched(&finest, &nominal));
        let (base, finest) = (base?, finest?);
        let found = Estimate::fourfold(&base, &finest, tolerance_k);
        if !found.relative().is_finite() {
            break;
        }
        estimate = estimate.larger(&found);
        let more = (estimate.relative() / AIM).powf(1.0 / ORDERS[1]);
        let denser = cut.clone().with_cells_of(&plan).scaled(more);
        let finer = stated.recut(case, denser.clone());
        if found.relative() <= 1.0 || work(&finer) > WORK_MOST {
            break;
        }
        let finest = trials.marched(&stated.recut(case, denser.refined(2)), &nominal)?;
        estimate = Estimate::twofold(&trials.marched(&finer, &nominal)?, &finest, tolerance_k);
        (cut, plan) = (denser, finer);
    }
    let corners_k = corners_k(&trials, case, &plan, &stated.recut(case, cut.refined(2)))?;
    plan.reached = Some(estimate.reported(corners_k));
    Ok(plan)
}

/// The largest error of members at corners of the factors' small bounds that arrive: all factors low, all high, and in turns.
fn corners_k(trials: &Trials<'_>, case: &Case, plan: &Plan, finer: &Plan) -> Result<Option<f64>, MarchError> {
    if case.factors.is_empty() {
        return Ok(None);
    }
    let row = |corner: usize| {
        let is_high = move |factor: usize| (factor & (corner / 2)).count_ones() as usize % 2 != corner % 2;
        let ends = case.factors.iter().map(|factor| factor.bounds(Bounds::Small)).enumerate();
        ends.map(move |(factor, (low, high))| if is_high(factor) { high } else { low })
    };
    let ensemble = Ensemble::at(case.factors.len(), (0..CORNERS).flat_map(row).collect());
    let (base, finer) = rayon::join(|| trials.marched(plan, &ensemble), || trials.marched(finer, &ensemble));
    let (base, finer) = (base?, finer?);
    let errors_k = (0..CORNERS).map(|corner| TWOFOLD * worst_k(&base, &finer, corner));
    Ok(errors_k.filter(|error_k| error_k.is_finite()).reduce(f64::max))
}

fn work(plan: &Plan) -> f64 {
    (plan.cells() * plan.steps()) as f64
}

/// What cutting one share in two does.
#[derive(Clone, Copy, Debug)]
struct Tried {
    /// The most by which it moves an output, as a share of its tolerance.
    error: f64,
    /// What it costs, relative to all work.
    cost: f64,
}

/// Cells and steps anew, so that the work is least for an error.
///
/// With each share x its part of the error falls as `x^−q` and its part of the work rises as x. The work is least where q times the one
/// is in the same proportion to the other for all shares: r times a share is best where `r^(q+1) = q e / (μ c)`, and μ is such that the parts make up the error.
fn shared_out(mut cut: Discretisation, tried: &[Tried], error: f64, aim: f64) -> Discretisation {
    // What the shares add one by one is more than what they add together, where signs differ or other sensors feel it.
    let together = error / tried.iter().map(|tried| tried.error).sum::<f64>().max(1e-12);
    let plies = cut.density.plies.len();
    let order = |share: usize| ORDERS[usize::from(share >= plies)];
    let times = |share: usize, worth: f64| {
        let Tried { error, cost } = tried[share];
        let best =
            (order(share) * (error * together).max(1e-8) / (worth * cost.max(1e-4))).powf(1.0 / (order(share) + 1.0));
        best.clamp(1.0 / CHANGE_MOST, CHANGE_MOST)
    };
    let left = |worth: f64| -> f64 {
        (0..tried.len()).map(|share| tried[share].error * together * times(share, worth).powf(-order(share))).sum()
    };
    let (mut low, mut high) = (-40.0_f64, 40.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left(middle.exp()) > aim { high = middle } else { low = middle }
    }
    for share in 0..tried.len() {
        cut.scale(share, times(share, low.exp()));
    }
    cut
}

/// The marches of an adaptation, on several threads.
struct Trials<'a> {
    monitor: &'a Monitor,
    /// Members marched so far.
    marched: Mutex<usize>,
}

impl Trials<'_> {
    fn marched(&self, plan: &Plan, ensemble: &Ensemble) -> Result<Traces, MarchError> {
        self.monitor.check()?;
        let traces = march_both(&mut Cpu::new(Precision::F64), plan, ensemble, 0..ensemble.len())?;
        // Held during the report, so that progress never runs back.
        let mut marched = self.marched.lock().unwrap_or_else(PoisonError::into_inner);
        *marched += ensemble.len();
        self.monitor.report(Progress { marched: *marched, expected: None });
        Ok(traces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marched(plan: &Plan, ensemble: &Ensemble) -> Result<Traces, MarchError> {
        Trials { monitor: &Monitor::default(), marched: Mutex::new(0) }.marched(plan, ensemble)
    }

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
        let reached = plan.reached.as_ref().expect("a pilot says how far it came");
        assert!(reached.nominal_k > 1e-9 && reached.nominal_k < 1e-2, "{reached:?}");
        assert!(work(&plan) <= WORK_MOST, "{} cells, {} steps", plan.cells(), plan.steps());
    }
}
