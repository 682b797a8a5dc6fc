//! Adaptation of grid and time steps to a tolerance, from a posteriori error estimates of the nominal member.
//!
//! Each region, a ply or a segment of time, has a density of its own. Marching with that region alone refined by two
//! measures its contribution to the error at the sensors; then the densities are chosen that minimise the work for the
//! tolerance. Cells and steps are thereby fine only where a sensor sees the difference, which local error estimates do
//! not know. All members share the result, so that differences between them carry no noise from step-size control.

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

/// Segments of time with a step density of their own.
const SLICES: usize = 8;
/// Most rounds of error measurement and optimisation.
const ROUNDS: usize = 10;
/// Most consecutive rounds without a cheaper plan once one meets the tolerance: with noisy schedules the errors scatter
/// from plan to plan.
const VAIN_MOST: usize = 2;
/// Another round is tried if it may reduce the work to this share.
const WORTH: f64 = 0.9;
/// Most cell-steps of a plan: an error that remains is not one of cells and steps.
const WORK_MOST: f64 = 1e7;
/// Cells and steps of the first round, before they are halved: few, as the adaptation adds the missing ones.
const CELLS_FIRST: f64 = 32.0;
const STEPS_FIRST: usize = 128;
/// Smallest step density of a segment: about half a step of the initial plan. With fewer, steps that span the segment
/// hide how its error converges.
const DENSITY_LEAST: f64 = SLICES as f64 / (2.0 * STEPS_FIRST as f64);
/// The initial search starts with a step rule this many times finer than one step for the whole march.
const FINEST: f64 = 16.0;
/// Largest change of a density in one round, as large errors do not yet converge at their order.
const CHANGE_MOST: f64 = 2.5;
/// Convergence orders of an extrapolated march in cells and in steps.
const ORDERS: [f64; 2] = [4.0, 3.0];
/// Target error, as a share of the tolerance.
const AIM: f64 = 0.8;
/// Largest reduction of the error in one round: otherwise regions at their limit of change would push the others too
/// far.
const FALL_MOST: f64 = 4.0;
/// Final coarsening: number of trials, target error as a share of the tolerance, and the work ratio below which a trial
/// is made.
const TRIMS: usize = 4;
const TRIMMED: f64 = 0.98;
const TRIM_WORTH: f64 = 0.97;
/// Verification against a march with four times the cells and steps: number of rounds, and most cell-steps of that
/// march.
const CONFIRMATIONS: usize = 3;
const CONFIRMED_MOST: f64 = 4e7;
/// Corners of the factor bounds that are marched: one SIMD group.
const CORNERS: usize = 8;

impl Discretisation {
    /// The initial discretisation of a case: few cells and few steps.
    fn first(case: &Case, plan: &Plan) -> Self {
        let times_s = |control: &Pace| plan.clock(case, control, 1).times_s;
        let steps = |control: &Pace| times_s(control).len() - 1;
        let graded = |coefficient| Pace { growth: Growth::Graded { coefficient }, slices: Vec::new() };
        let mut coefficient = case.exposure.duration_s.powf(1.0 / GRADING) / FINEST;
        let mut number = steps(&graded(coefficient));
        while number > STEPS_FIRST {
            let fewer = steps(&graded(2.0 * coefficient));
            if fewer * 10 > number * 9 {
                break;
            }
            (coefficient, number) = (2.0 * coefficient, fewer);
        }
        let mut control = graded(coefficient);
        let times_s = times_s(&control);
        let segment =
            |number: usize| Slice { from_s: times_s[number * (times_s.len() - 1) / SLICES], density: 1.0, cuts: 1 };
        control.slices = (0..SLICES).map(segment).collect();
        control.slices.dedup_by(|later, earlier| later.from_s <= earlier.from_s);
        Self { density: Density::shared(case, CELLS_FIRST), pace: control }
    }

    /// Number of regions: the plies, then the segments of time.
    fn shares(&self) -> usize {
        self.density.plies.len() + self.pace.slices.len()
    }

    fn scale(&mut self, region: usize, times: f64) {
        let plies = self.density.plies.len();
        if region < plies {
            self.density.plies[region] *= times;
        } else {
            let density = &mut self.pace.slices[region - plies].density;
            *density = (*density * times).max(DENSITY_LEAST);
        }
    }

    /// With each cell or step of one region halved. Scaling the density would change nothing in a ply with the fewest
    /// cells, or with a single step between two corners.
    fn halved(&self, region: usize) -> Self {
        let mut finer = self.clone();
        let plies = self.density.plies.len();
        if region < plies {
            finer.density.cuts[region] *= 2;
        } else {
            finer.pace.slices[region - plies].cuts *= 2;
        }
        finer
    }

    /// With all densities scaled.
    fn scaled(mut self, times: f64) -> Self {
        (0..self.shares()).for_each(|region| self.scale(region, times));
        self
    }

    /// With twice the steps everywhere: long steps make temperatures diverge, wide cells do not.
    fn slower(mut self) -> Self {
        self.pace.slices.iter_mut().for_each(|segment| segment.density *= 2.0);
        self
    }

    /// With the densities of the cells that each ply has in a plan, after rounding and the minimum of cells.
    fn with_cells_of(mut self, plan: &Plan) -> Self {
        for (density, ply) in self.density.plies.iter_mut().zip(&plan.plies) {
            *density = f64::from(ply.end_cell - ply.first_cell) / 2.0;
        }
        self
    }
}

/// The plan of a case: at the resolution that the case specifies, or adapted to its tolerance.
///
/// # Errors
/// See [`March::march`](crate::march::March::march); the CPU backend does not fail.
pub fn pilot(case: &Case) -> Result<Plan, MarchError> {
    pilot_monitored(case, &Monitor::default())
}

/// [`adapt`] with progress reports and cancellation.
///
/// # Errors
/// [`MarchError::Cancelled`] before the next march, once the monitor is cancelled.
pub fn pilot_monitored(case: &Case, monitor: &Monitor) -> Result<Plan, MarchError> {
    let trials = Trials { monitor, marched: Mutex::new(0) };
    let stated = Plan::new(case);
    let Some(tolerance_k) = case.resolution.tolerance_k.filter(|_| !case.sensors.is_empty()) else {
        return Ok(stated);
    };
    let nominal = Ensemble::nominal(&case.factors);
    let mut discretisation = Discretisation::first(case, &stated);
    let mut best: Option<(Discretisation, Estimate, f64)> = None;
    let mut rounds_without_gain = 0;
    for _ in 0..ROUNDS {
        let plan = stated.recut(case, discretisation.clone());
        if work(&plan) > WORK_MOST {
            break;
        }
        let base = trials.marched(&plan, &nominal)?;
        if base.arrivals != [Arrival::Done] {
            discretisation = discretisation.slower();
            continue;
        }
        // The longest march first, so that it does not run alone at the end.
        let refinements: Vec<Discretisation> = std::iter::once(discretisation.refined(2))
            .chain((0..discretisation.shares()).map(|region| discretisation.halved(region)))
            .collect();
        let refinements = refinements
            .into_par_iter()
            .map(|finer| {
                let finer = stated.recut(case, finer);
                let cost = work(&finer) / work(&plan) - 1.0;
                Ok((Estimate::twofold(&base, &trials.marched(&finer, &nominal)?, tolerance_k), cost))
            })
            .collect::<Result<Vec<(Estimate, f64)>, MarchError>>()?;
        if refinements.iter().any(|(estimate, _)| !estimate.relative().is_finite()) {
            discretisation = discretisation.slower();
            continue;
        }
        let parts: Vec<Tried> =
            refinements[1..].iter().map(|(estimate, cost)| Tried { error: estimate.relative(), cost: *cost }).collect();
        let estimate = refinements.into_iter().next().map(|(estimate, _)| estimate).unwrap_or_default();
        let error = estimate.relative();
        let is_better = best.as_ref().is_none_or(|(_, incumbent, kept_work)| {
            let incumbent = incumbent.relative();
            match (error <= 1.0, incumbent <= 1.0) {
                (true, true) => work(&plan) < *kept_work,
                (false, false) => error < incumbent,
                (is_within, _) => is_within,
            }
        });
        let next = shared_out(discretisation.clone().with_cells_of(&plan), &parts, error, AIM.max(error / FALL_MOST));
        let best_is_within = best.as_ref().is_some_and(|(_, incumbent, _)| incumbent.relative() <= 1.0);
        if is_better {
            best = Some((discretisation, estimate, work(&plan)));
            rounds_without_gain = 0;
        } else if best_is_within {
            rounds_without_gain += 1;
            if rounds_without_gain == VAIN_MOST {
                break;
            }
        }
        if error <= 1.0 && work(&stated.recut(case, next.clone())) > WORTH * work(&plan) {
            break;
        }
        discretisation = next;
    }
    let Some((mut discretisation, mut estimate, _)) = best else { return Ok(stated) };
    let mut plan = stated.recut(case, discretisation.clone());
    // The rounds end when the next is unlikely to reduce the work; the remaining margin of the tolerance is used by
    // scaling all densities down.
    let coarsening = |error: f64| (error / TRIMMED).powf(1.0 / ORDERS[1]);
    let mut times = coarsening(estimate.relative());
    for _ in 0..TRIMS {
        let fewer = discretisation.clone().with_cells_of(&plan).scaled(times);
        let coarser = stated.recut(case, fewer.clone());
        if estimate.relative() > 1.0 || work(&coarser) > TRIM_WORTH * work(&plan) {
            break;
        }
        let finer = stated.recut(case, fewer.refined(2));
        let (base, finer) = rayon::join(|| trials.marched(&coarser, &nominal), || trials.marched(&finer, &nominal));
        let found = Estimate::twofold(&base?, &finer?, tolerance_k);
        if found.relative() <= 1.0 {
            (discretisation, plan, estimate) = (fewer, coarser, found);
            times = coarsening(estimate.relative());
        } else {
            times = 0.5 * (1.0 + times);
        }
    }
    // On coarse plans the error does not converge at its order yet: verify with four times the cells and steps.
    for _ in 0..CONFIRMATIONS {
        let quartered = stated.recut(case, discretisation.refined(4));
        if work(&quartered) > CONFIRMED_MOST {
            break;
        }
        let (base, quartered) =
            rayon::join(|| trials.marched(&plan, &nominal), || trials.marched(&quartered, &nominal));
        let (base, quartered) = (base?, quartered?);
        let found = Estimate::fourfold(&base, &quartered, tolerance_k);
        if !found.relative().is_finite() {
            break;
        }
        estimate = estimate.larger(&found);
        let more = (estimate.relative() / AIM).powf(1.0 / ORDERS[1]);
        let denser = discretisation.clone().with_cells_of(&plan).scaled(more);
        let finer = stated.recut(case, denser.clone());
        if found.relative() <= 1.0 || work(&finer) > WORK_MOST {
            break;
        }
        let quartered = trials.marched(&stated.recut(case, denser.refined(2)), &nominal)?;
        estimate = Estimate::twofold(&trials.marched(&finer, &nominal)?, &quartered, tolerance_k);
        (discretisation, plan) = (denser, finer);
    }
    let corners_k = corners_k(&trials, case, &plan, &stated.recut(case, discretisation.refined(2)))?;
    plan.reached = Some(estimate.reported(corners_k));
    Ok(plan)
}

/// The largest error of the members at corners of the factors' small bounds that complete, K: all factors low, all
/// high, and alternating patterns.
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

/// Effect of halving the cells or steps of one region.
#[derive(Clone, Copy, Debug)]
struct Tried {
    /// Largest change of an output, relative to its tolerance.
    error: f64,
    /// Added work, relative to the whole.
    cost: f64,
}

/// The densities that minimise the work for a target error.
///
/// If a density is multiplied by r, its error contribution e falls as `r^−q` and its work c rises as r. By Lagrange's
/// method the optimum is `r^(q+1) = q e/(μ c)`; the multiplier μ is found by bisection so that the contributions add up
/// to the target.
fn shared_out(mut discretisation: Discretisation, refinements: &[Tried], error: f64, target: f64) -> Discretisation {
    // The sum of the single contributions exceeds the total error where their signs differ or different sensors see
    // them.
    let cancellation = error / refinements.iter().map(|refinement| refinement.error).sum::<f64>().max(1e-12);
    let plies = discretisation.density.plies.len();
    let order = |region: usize| ORDERS[usize::from(region >= plies)];
    let times = |region: usize, multiplier: f64| {
        let Tried { error, cost } = refinements[region];
        let best = (order(region) * (error * cancellation).max(1e-8) / (multiplier * cost.max(1e-4)))
            .powf(1.0 / (order(region) + 1.0));
        best.clamp(1.0 / CHANGE_MOST, CHANGE_MOST)
    };
    let remaining = |multiplier: f64| -> f64 {
        (0..refinements.len())
            .map(|region| refinements[region].error * cancellation * times(region, multiplier).powf(-order(region)))
            .sum()
    };
    let (mut low, mut high) = (-40.0_f64, 40.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if remaining(middle.exp()) > target { high = middle } else { low = middle }
    }
    for region in 0..refinements.len() {
        discretisation.scale(region, times(region, low.exp()));
    }
    discretisation
}

/// The trial marches of an adaptation, in several threads.
struct Trials<'a> {
    monitor: &'a Monitor,
    /// Members marched so far.
    marched: Mutex<usize>,
}

impl Trials<'_> {
    fn marched(&self, plan: &Plan, ensemble: &Ensemble) -> Result<Traces, MarchError> {
        self.monitor.check()?;
        let traces = march_both(&mut Cpu::new(Precision::F64), plan, ensemble, 0..ensemble.len())?;
        // The lock is held during the report, so that progress never decreases.
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
    fn a_member_that_does_not_complete_has_an_infinite_error() {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        let done =
            marched(&Plan::new(&case), &Ensemble::nominal(&case.factors)).expect("the CPU backend does not fail");
        assert_eq!(worst_k(&done, &done, 0), 0.0);
        let mut diverged = done.clone();
        diverged.temperatures_k.fill(f64::NAN);
        diverged.arrivals[0] = Arrival::Strayed { time_s: 1.0 };
        assert_eq!(worst_k(&done, &diverged, 0), f64::INFINITY);
        assert_eq!(worst_k(&diverged, &done, 0), f64::INFINITY);
    }

    #[test]
    fn an_unattainable_tolerance_ends_the_search_and_the_error_is_reported() {
        let mut case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        case.resolution.tolerance_k = Some(1e-9);
        let plan = pilot(&case).expect("the CPU backend does not fail");
        let reached = plan.reached.as_ref().expect("an adapted plan has an error estimate");
        assert!(reached.nominal_k > 1e-9 && reached.nominal_k < 1e-2, "{reached:?}");
        assert!(work(&plan) <= WORK_MOST, "{} cells, {} steps", plan.cells(), plan.steps());
    }
}
