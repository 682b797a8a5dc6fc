//! Adaptation of grid and time steps to a tolerance, from a posteriori error estimates of the nominal member.
//!
//! Each region, a ply (of many plies, some adjacent ones) or a segment of time, has a density of its own. Marching
//! with that region alone refined by two measures its contribution to the error at the sensors; then the densities are
//! chosen that minimise the work for the tolerance. Cells and steps are thereby fine only where a sensor sees the
//! difference, which local error estimates do not know. All members share the result, so that differences between them
//! carry no noise from step-size control.

mod corners;
pub mod error_estimate;
mod rounding;

use crate::case::{Bounds, Case, Emissivity, Face, Table};
use crate::ensemble::Ensemble;
use crate::march::cpu::Cpu;
use crate::march::monitor::{Monitor, Progress};
use crate::march::richardson::march_extrapolated;
use crate::march::{MarchError, Precision};
use crate::plan::GridDensity;
use crate::plan::{Discretisation, Plan, RoundingError};
use crate::plan::{GRADING_EXPONENT, StepGrowth, TimeSegment, TimeStepControl};
use crate::traces::{MemberStatus, Traces};
use corners::corners;
pub(crate) use error_estimate::RefinedTraces;
use error_estimate::{OutputErrors, TWOFOLD_ERROR_RATIO, largest_difference_k};
use rayon::prelude::*;
use rounding::with_rounding_of;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Most regions in space. Plies beyond that share regions with their neighbours: every region costs a march in every
/// round, and 200 plies took 16 s.
const MAX_PLY_REGIONS: usize = 24;
/// Segments of time with a step density of their own.
const TIME_SEGMENTS: usize = 8;
/// Most rounds of error measurement and optimisation.
const MAX_ROUNDS: usize = 10;
/// Most consecutive rounds without a cheaper plan once one meets the tolerance: with noisy schedules the errors scatter
/// from plan to plan.
const MAX_ROUNDS_WITHOUT_GAIN: usize = 2;
/// Another round is tried if it may reduce the work to this share.
const CONTINUE_WORK_RATIO: f64 = 0.9;
/// Most cell-steps of a plan: an error that remains is not one of cells and steps.
const MAX_CELL_STEPS: f64 = 1e7;
/// Cells and steps of the first round, before they are halved: few, as the adaptation adds the missing ones.
const INITIAL_CELLS: f64 = 32.0;
const INITIAL_STEPS: usize = 128;
/// Smallest step density of a segment: about half a step of the initial plan. With fewer, steps that span the segment
/// hide how its error converges.
const MIN_STEP_DENSITY: f64 = TIME_SEGMENTS as f64 / (2.0 * INITIAL_STEPS as f64);
/// The initial search starts with a step rule this many times finer than one step for the whole march.
const INITIAL_REFINEMENT: f64 = 16.0;
/// Largest change of a density in one round, as large errors do not yet converge at their order.
const MAX_DENSITY_CHANGE: f64 = 2.5;
/// Convergence orders of an extrapolated march in cells and in steps.
const CONVERGENCE_ORDERS: [f64; 2] = [4.0, 3.0];
/// Target error, as a share of the tolerance.
const TARGET_ERROR_RATIO: f64 = 0.8;
/// Largest reduction of the error in one round: otherwise regions at their limit of change would push the others too
/// far.
const MAX_ERROR_REDUCTION: f64 = 4.0;
/// Final coarsening: number of trials, target error as a share of the tolerance, and the work ratio below which a trial
/// is made.
const COARSENING_TRIALS: usize = 4;
const COARSENING_TARGET: f64 = 0.98;
const COARSENING_WORK_RATIO: f64 = 0.97;
/// Verification against marches with twice and four times the cells and steps: number of rounds, and most cell-steps of
/// the largest.
const VERIFICATION_ROUNDS: usize = 5;
/// Number of parts into which steps are divided, without refinement of cells, in the verification of cases with a steep
/// emissivity.
const STEP_DIVISION: usize = 8;
/// An emissivity is steep where it changes the emitted flux more than this multiple of what T⁴ does.
const STEEP_EMISSIVITY: f64 = 1.0;
/// Smallest growth of the densities in a round of verification: a ply of few cells would not get another.
const MIN_DENSITY_GROWTH: f64 = 1.05;
const MAX_VERIFICATION_CELL_STEPS: f64 = 4e7;
/// Members for which a plan was not adapted may exceed its tolerance, or its error if that is larger, by this factor
/// before it is adapted anew; their error is reported. Estimates may not, as a warning would follow.
pub(crate) const ACCEPTED_ERROR: f64 = 1.5;
/// Tolerance beside which errors are stated where a case states cells and steps, K.
const DEFAULT_TOLERANCE_K: f64 = 0.05;
/// Most times that the steps are doubled for members that diverge.
const COMPLETING_ROUNDS: usize = 2;

impl Discretisation {
    /// The initial discretisation of a case: few cells and few steps.
    fn initial(case: &Case, plan: &Plan) -> Self {
        let times_s = |control: &TimeStepControl| plan.time_grid(case, control, 1).times_s;
        let steps = |control: &TimeStepControl| times_s(control).len() - 1;
        let graded = |coefficient| TimeStepControl { growth: StepGrowth::Graded { coefficient }, segments: Vec::new() };
        let mut coefficient = case.exposure.duration_s.powf(1.0 / GRADING_EXPONENT) / INITIAL_REFINEMENT;
        let mut number = steps(&graded(coefficient));
        while number > INITIAL_STEPS {
            let fewer = steps(&graded(2.0 * coefficient));
            if fewer * 10 > number * 9 {
                break;
            }
            (coefficient, number) = (2.0 * coefficient, fewer);
        }
        let mut control = graded(coefficient);
        let times_s = times_s(&control);
        let segment = |number: usize| TimeSegment {
            start_s: times_s[number * (times_s.len() - 1) / TIME_SEGMENTS],
            step_density: 1.0,
            subdivisions: 1,
        };
        control.segments = (0..TIME_SEGMENTS).map(segment).collect();
        control.segments.dedup_by(|later, earlier| later.start_s <= earlier.start_s);
        Self { grid: GridDensity::by_diffusion_time(case, INITIAL_CELLS), time_steps: control }
    }

    /// Number of regions in space: plies, or groups of adjacent plies of equal number.
    fn ply_regions(&self) -> usize {
        let plies = self.grid.cells_per_ply.len();
        plies.div_ceil(plies.div_ceil(MAX_PLY_REGIONS).max(1))
    }

    /// The plies of a region in space.
    fn plies_of(&self, region: usize) -> Range<usize> {
        let plies = self.grid.cells_per_ply.len();
        let each = plies.div_ceil(MAX_PLY_REGIONS).max(1);
        region * each..((region + 1) * each).min(plies)
    }

    /// Number of regions: those in space, then the segments of time.
    fn regions(&self) -> usize {
        self.ply_regions() + self.time_steps.segments.len()
    }

    fn scale_region(&mut self, region: usize, times: f64) {
        match region.checked_sub(self.ply_regions()) {
            None => {
                let plies = self.plies_of(region);
                self.grid.cells_per_ply[plies].iter_mut().for_each(|cells| *cells *= times);
            }
            Some(segment) => {
                let density = &mut self.time_steps.segments[segment].step_density;
                *density = (*density * times).max(MIN_STEP_DENSITY);
            }
        }
    }

    /// With each cell or step of one region halved. Scaling the density would change nothing in a ply with the fewest
    /// cells, or with a single step between two corners.
    fn with_region_halved(&self, region: usize) -> Self {
        let mut finer = self.clone();
        match region.checked_sub(self.ply_regions()) {
            None => finer.grid.subdivisions[self.plies_of(region)].iter_mut().for_each(|parts| *parts *= 2),
            Some(segment) => finer.time_steps.segments[segment].subdivisions *= 2,
        }
        finer
    }

    /// The discretisation with all densities scaled.
    fn with_densities_scaled(mut self, times: f64) -> Self {
        (0..self.regions()).for_each(|region| self.scale_region(region, times));
        self
    }

    /// The discretisation with twice the steps everywhere: long steps make temperatures diverge, wide cells do not.
    fn with_twice_the_steps(mut self) -> Self {
        self.time_steps.segments.iter_mut().for_each(|segment| segment.step_density *= 2.0);
        self
    }

    /// The discretisation with every step divided into equal parts, and the same cells.
    fn with_divided_steps(&self, parts: usize) -> Self {
        let mut finer = self.clone();
        finer.time_steps.segments.iter_mut().for_each(|segment| segment.subdivisions *= parts);
        finer
    }

    /// The discretisation with the densities of the cells that each ply has in a plan, after rounding and the minimum
    /// of cells.
    fn with_cell_counts_of(mut self, plan: &Plan) -> Self {
        for (density, ply) in self.grid.cells_per_ply.iter_mut().zip(&plan.rows.plies) {
            *density = f64::from(ply.end_cell - ply.first_cell) / 2.0;
        }
        self
    }
}

/// The plan of a case: at the resolution that the case specifies, or adapted to its tolerance.
///
/// # Errors
/// See [`March::march`](crate::march::March::march); the CPU backend does not fail.
pub fn adapt(case: &Case) -> Result<Plan, MarchError> {
    adapt_monitored(case, &Monitor::default())
}

/// [`adapt`] with progress reports and cancellation.
///
/// # Errors
/// [`MarchError::Cancelled`] before the next march, once the monitor is cancelled.
pub fn adapt_monitored(case: &Case, monitor: &Monitor) -> Result<Plan, MarchError> {
    adapt_members(case, &Ensemble::nominal(&case.factors), monitor)
}

/// [`adapt_monitored`] for marches in a precision, whose rounding the error includes.
///
/// # Errors
/// As [`adapt_monitored`].
pub(crate) fn adapt_for(case: &Case, precision: Precision, monitor: &Monitor) -> Result<Plan, MarchError> {
    with_nominal_rounding(case, adapt_monitored(case, monitor)?, precision)
}

/// A plan that was adapted to the nominal member, with the rounding of a precision in its error.
///
/// # Errors
/// As [`adapt_monitored`].
pub(crate) fn with_nominal_rounding(case: &Case, plan: Plan, precision: Precision) -> Result<Plan, MarchError> {
    with_rounding_of(case, plan, precision, &Ensemble::nominal(&case.factors))
}

/// The plan of a case, adapted so that each of some members meets the tolerance.
///
/// # Errors
/// As [`adapt_monitored`].
fn adapt_members(case: &Case, members: &Ensemble, monitor: &Monitor) -> Result<Plan, MarchError> {
    let trials = Trials { monitor, marched: Mutex::new(0) };
    let stated_plan = Plan::new(case);
    let Some(tolerance_k) = adapted_tolerance_k(case) else { return Ok(stated_plan) };
    let mut discretisation = Discretisation::initial(case, &stated_plan);
    let mut best: Option<(Discretisation, OutputErrors, f64)> = None;
    let mut rounds_without_gain = 0;
    for _ in 0..MAX_ROUNDS {
        let plan = stated_plan.rediscretised(case, discretisation.clone());
        if cell_steps(&plan) > MAX_CELL_STEPS {
            break;
        }
        let base = trials.march(&plan, members)?;
        if base.statuses.iter().any(|status| *status != MemberStatus::Completed) {
            discretisation = discretisation.with_twice_the_steps();
            continue;
        }
        // The longest march first, so that it does not run alone at the end.
        let refinements: Vec<Discretisation> = std::iter::once(discretisation.refined(2))
            .chain((0..discretisation.regions()).map(|region| discretisation.with_region_halved(region)))
            .collect();
        let refinements = refinements
            .into_par_iter()
            .map(|finer| {
                let finer = stated_plan.rediscretised(case, finer);
                let cost = cell_steps(&finer) / cell_steps(&plan) - 1.0;
                Ok((OutputErrors::twofold(&base, &trials.march(&finer, members)?, tolerance_k), cost))
            })
            .collect::<Result<Vec<(OutputErrors, f64)>, MarchError>>()?;
        if refinements.iter().any(|(estimate, _)| !estimate.max_relative().is_finite()) {
            discretisation = discretisation.with_twice_the_steps();
            continue;
        }
        let parts: Vec<RegionRefinement> = refinements[1..]
            .iter()
            .map(|(estimate, cost)| RegionRefinement { error: estimate.max_relative(), cost: *cost })
            .collect();
        let estimate = refinements.into_iter().next().map(|(estimate, _)| estimate).unwrap_or_default();
        let error = estimate.max_relative();
        let is_better = best.as_ref().is_none_or(|(_, incumbent, best_cell_steps)| {
            let incumbent = incumbent.max_relative();
            match (error <= 1.0, incumbent <= 1.0) {
                (true, true) => cell_steps(&plan) < *best_cell_steps,
                (false, false) => error < incumbent,
                (is_within, _) => is_within,
            }
        });
        let next = minimise_work(
            discretisation.clone().with_cell_counts_of(&plan),
            &parts,
            error,
            TARGET_ERROR_RATIO.max(error / MAX_ERROR_REDUCTION),
        );
        let best_is_within = best.as_ref().is_some_and(|(_, incumbent, _)| incumbent.max_relative() <= 1.0);
        if is_better {
            best = Some((discretisation, estimate, cell_steps(&plan)));
            rounds_without_gain = 0;
        } else if best_is_within {
            rounds_without_gain += 1;
            if rounds_without_gain == MAX_ROUNDS_WITHOUT_GAIN {
                break;
            }
        }
        if error <= 1.0
            && cell_steps(&stated_plan.rediscretised(case, next.clone())) > CONTINUE_WORK_RATIO * cell_steps(&plan)
        {
            break;
        }
        discretisation = next;
    }
    let Some((mut discretisation, mut estimate, _)) = best else { return Ok(stated_plan) };
    let mut plan = stated_plan.rediscretised(case, discretisation.clone());
    // The rounds end when the next is unlikely to reduce the work; the remaining margin of the tolerance is used by
    // scaling all densities down.
    let coarsening = |error: f64| (error / COARSENING_TARGET).powf(1.0 / CONVERGENCE_ORDERS[1]);
    let mut times = coarsening(estimate.max_relative());
    for _ in 0..COARSENING_TRIALS {
        let fewer = discretisation.clone().with_cell_counts_of(&plan).with_densities_scaled(times);
        let coarser = stated_plan.rediscretised(case, fewer.clone());
        if estimate.max_relative() > 1.0 || cell_steps(&coarser) > COARSENING_WORK_RATIO * cell_steps(&plan) {
            break;
        }
        let finer = stated_plan.rediscretised(case, fewer.refined(2));
        let (base, finer) = rayon::join(|| trials.march(&coarser, members), || trials.march(&finer, members));
        let found = OutputErrors::twofold(&base?, &finer?, tolerance_k);
        if found.max_relative() <= 1.0 {
            (discretisation, plan, estimate) = (fewer, coarser, found);
            times = coarsening(estimate.max_relative());
        } else {
            times = 0.5 * (1.0 + times);
        }
    }
    if let Some((completed, finer)) = completing(&trials, case, &stated_plan, &discretisation, &plan)? {
        let halved = trials.march(&stated_plan.rediscretised(case, completed.refined(2)), members)?;
        estimate = OutputErrors::twofold(&trials.march(&finer, members)?, &halved, tolerance_k);
        (discretisation, plan) = (completed, finer);
    }
    // On coarse plans the error does not converge at its order yet: verify with four times the cells and steps.
    let mut denser = Some((discretisation.clone(), plan.clone()));
    for _ in 0..=VERIFICATION_ROUNDS {
        let Some((finer_discretisation, finer)) = denser.take() else { break };
        if 16.0 * cell_steps(&finer) > MAX_VERIFICATION_CELL_STEPS {
            break;
        }
        let found = refined_marches(&trials, case, &stated_plan, &finer, members, tolerance_k)?.errors();
        // With many more cells and steps a march may diverge where this one does not.
        if !found.max_relative().is_finite() {
            break;
        }
        (discretisation, plan, estimate) = (finer_discretisation, finer, found);
        let more = (estimate.max_relative() / TARGET_ERROR_RATIO).powf(1.0 / CONVERGENCE_ORDERS[1]);
        let next = discretisation
            .clone()
            .with_cell_counts_of(&plan)
            .with_densities_scaled(more.clamp(MIN_DENSITY_GROWTH, MAX_DENSITY_CHANGE));
        let finer = stated_plan.rediscretised(case, next.clone());
        if estimate.max_relative() > 1.0 && cell_steps(&finer) <= MAX_CELL_STEPS {
            denser = Some((next, finer));
        }
    }
    let corners_k = match case.factors.is_empty() {
        true => Vec::new(),
        false => member_errors_k(case, &plan, Precision::F64, &corners(case, Bounds::Small), monitor)?,
    };
    plan.error_estimate = Some(estimate.into_error_estimate(&corners_k));
    Ok(plan)
}

/// The tolerance of a case, if its cells and steps are adapted to it.
fn adapted_tolerance_k(case: &Case) -> Option<f64> {
    case.resolution.tolerance_k.filter(|_| !case.sensors.is_empty())
}

/// A plan of a case, checked at members for which it was not adapted: the same, with their error if that is larger, or
/// one adapted to the nominal member and to these where they exceed both the tolerance and the error of the plan by the
/// factor `accepted`. A member that does not complete has no error. Errors include the rounding of the precision, which
/// no adaptation reduces.
///
/// # Errors
/// As [`adapt_monitored`].
pub(crate) fn checked_at_members(
    case: &Case,
    plan: &Plan,
    members: &Ensemble,
    precision: Precision,
    accepted: f64,
    monitor: &Monitor,
) -> Result<CheckedPlan, MarchError> {
    let (Some(tolerance_k), Some(claimed)) = (adapted_tolerance_k(case), plan.error_estimate.as_ref()) else {
        return Ok(CheckedPlan { plan: plan.clone(), is_adapted_anew: false });
    };
    let refined = refined_traces(case, plan, Precision::F64, members, monitor)?;
    if refined.base.statuses.iter().any(|status| *status != MemberStatus::Completed) {
        return Ok(CheckedPlan { plan: plan.clone(), is_adapted_anew: false });
    }
    let found = refined.errors();
    let claimed_k = claimed.nominal_k - claimed.rounding.as_ref().map_or(0.0, |rounding| rounding.nominal_k);
    if found.temperature_k <= accepted * tolerance_k.max(claimed_k) {
        let rounding = match precision {
            Precision::F32 => RoundingError::measure_at(case, plan, members)?,
            Precision::F64 => None,
        };
        let mut plan = plan.clone();
        plan.error_estimate = Some(claimed.clone().with_members(found, rounding));
        return Ok(CheckedPlan { plan, is_adapted_anew: false });
    }
    let nominal = case.factors.iter().map(|factor| factor.nominal);
    let others = (0..members.len()).flat_map(|member| members.member(member));
    let all = Ensemble::from_values(case.factors.len(), nominal.chain(others).collect());
    let plan = with_rounding_of(case, adapt_members(case, &all, monitor)?, precision, &all)?;
    Ok(CheckedPlan { plan, is_adapted_anew: true })
}

/// Marches of members on a plan of a case in a precision, and in f64 with twice and four times its cells and steps, for
/// the errors of single readings. The plan may have been adapted to another exposure.
///
/// # Errors
/// As [`adapt_monitored`].
pub(crate) fn refined_traces(
    case: &Case,
    plan: &Plan,
    precision: Precision,
    members: &Ensemble,
    monitor: &Monitor,
) -> Result<RefinedTraces, MarchError> {
    let trials = Trials { monitor, marched: Mutex::new(0) };
    let tolerance_k = case.resolution.tolerance_k.unwrap_or(DEFAULT_TOLERANCE_K);
    let mut refined = refined_marches(&trials, case, &Plan::new(case), plan, members, tolerance_k)?;
    if precision == Precision::F32 {
        refined.base = march_extrapolated(&mut Cpu::new(precision), plan, members, 0..members.len())?;
    }
    Ok(refined)
}

/// The error of each of some members on a plan of a case in a precision: the difference to a march in f64 with twice
/// the cells and steps, K; infinite where either did not complete.
///
/// # Errors
/// As [`adapt_monitored`].
pub(crate) fn member_errors_k(
    case: &Case,
    plan: &Plan,
    precision: Precision,
    members: &Ensemble,
    monitor: &Monitor,
) -> Result<Vec<f64>, MarchError> {
    let trials = Trials { monitor, marched: Mutex::new(0) };
    let finer = Plan::new(case).rediscretised(case, plan.discretisation.refined(2));
    let base = || march_extrapolated(&mut Cpu::new(precision), plan, members, 0..members.len());
    let (base, finer) = rayon::join(base, || trials.march(&finer, members));
    let (base, finer) = (base?, finer?);
    Ok((0..members.len()).map(|member| TWOFOLD_ERROR_RATIO * largest_difference_k(&base, &finer, member)).collect())
}

fn refined_marches(
    trials: &Trials<'_>,
    case: &Case,
    stated_plan: &Plan,
    plan: &Plan,
    members: &Ensemble,
    tolerance_k: f64,
) -> Result<RefinedTraces, MarchError> {
    let refined = |finer: Discretisation| trials.march(&stated_plan.rediscretised(case, finer), members);
    let by = |times: usize| refined(plan.discretisation.refined(times));
    let march_step_divided = || {
        has_steep_emissivity(case).then(|| refined(plan.discretisation.with_divided_steps(STEP_DIVISION))).transpose()
    };
    let (quartered, (base, (halved, step_divided))) = rayon::join(
        || by(4),
        || rayon::join(|| trials.march(plan, members), || rayon::join(|| by(2), march_step_divided)),
    );
    let is_steep = plan.rows.has_steep_conductivities;
    Ok(RefinedTraces {
        tolerance_k,
        base: base?,
        halved: halved?,
        quartered: quartered?,
        step_divided: step_divided?,
        is_steep,
    })
}

/// Whether the emissivity of a face rises or falls so steeply with temperature that it changes the emitted flux more
/// than T⁴ does.
///
/// A surface that meets such a rise follows it within the time in which its cell follows the heat flux, and steps that
/// are longer pass over it. That time falls with the square of the cells, steps with their number: where both are
/// halved, the steps become longer beside it, so that marches agree although all are wrong.
fn has_steep_emissivity(case: &Case) -> bool {
    let plies = [case.layup.plies.first(), case.layup.plies.last()];
    let mut faces = [&case.exposure.hot_face, &case.exposure.back_face].into_iter().zip(plies.into_iter().flatten());
    faces.any(|(face, ply)| {
        let Face::Open(open) = face else { return false };
        let residues = ply.material.decomposition.iter().flat_map(|decomposition| &decomposition.residues);
        let mut own = std::iter::once(&ply.material.emissivity).chain(residues.map(|residue| &residue.emissivity));
        open.emissivity == Emissivity::Material && own.any(is_steep)
    })
}

/// Whether |T dε/dT| exceeds a multiple of 4 ε anywhere in a table.
fn is_steep(emissivity: &Table) -> bool {
    let mut points = emissivity.temperatures_k.windows(2).zip(emissivity.values.windows(2));
    points.any(|(temperatures_k, values)| {
        let rise = (values[1] - values[0]).abs() * temperatures_k[1];
        rise > STEEP_EMISSIVITY * 4.0 * values[0].min(values[1]) * (temperatures_k[1] - temperatures_k[0])
    })
}

/// A plan after a check of its error.
#[derive(Clone, Debug)]
pub(crate) struct CheckedPlan {
    /// The plan, with the error of the members that were checked.
    pub plan: Plan,
    /// Whether it differs from the plan that was checked.
    pub is_adapted_anew: bool,
}

/// A plan with twice the steps, or four times, if on this one members at corners of the factors' large bounds diverge
/// that do not diverge there: a fit may visit them.
fn completing(
    trials: &Trials<'_>,
    case: &Case,
    stated_plan: &Plan,
    discretisation: &Discretisation,
    plan: &Plan,
) -> Result<Option<(Discretisation, Plan)>, MarchError> {
    if case.factors.is_empty() {
        return Ok(None);
    }
    let corners = corners(case, Bounds::Large);
    let diverging = |plan: &Plan| -> Result<usize, MarchError> {
        let statuses = trials.march(plan, &corners)?.statuses;
        Ok(statuses.iter().filter(|status| matches!(status, MemberStatus::Diverged { .. })).count())
    };
    let mut number = diverging(plan)?;
    let mut denser = discretisation.clone();
    let mut completed = None;
    for _ in 0..COMPLETING_ROUNDS {
        if number == 0 {
            break;
        }
        denser = denser.with_twice_the_steps();
        let finer = stated_plan.rediscretised(case, denser.clone());
        let remaining = diverging(&finer)?;
        if remaining < number {
            (completed, number) = (Some((denser.clone(), finer)), remaining);
        }
    }
    Ok(completed)
}

fn cell_steps(plan: &Plan) -> f64 {
    (plan.cells() * plan.steps()) as f64
}

/// Effect of halving the cells or steps of one region.
#[derive(Clone, Copy, Debug)]
struct RegionRefinement {
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
fn minimise_work(
    mut discretisation: Discretisation,
    refinements: &[RegionRefinement],
    error: f64,
    target: f64,
) -> Discretisation {
    // The sum of the single contributions exceeds the total error where their signs differ or different sensors see
    // them.
    let cancellation = error / refinements.iter().map(|refinement| refinement.error).sum::<f64>().max(1e-12);
    let in_space = discretisation.ply_regions();
    let order = |region: usize| CONVERGENCE_ORDERS[usize::from(region >= in_space)];
    let times = |region: usize, multiplier: f64| {
        let RegionRefinement { error, cost } = refinements[region];
        let best = (order(region) * (error * cancellation).max(1e-8) / (multiplier * cost.max(1e-4)))
            .powf(1.0 / (order(region) + 1.0));
        best.clamp(1.0 / MAX_DENSITY_CHANGE, MAX_DENSITY_CHANGE)
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
        discretisation.scale_region(region, times(region, low.exp()));
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
    fn march(&self, plan: &Plan, ensemble: &Ensemble) -> Result<Traces, MarchError> {
        self.monitor.check()?;
        let traces = march_extrapolated(&mut Cpu::new(Precision::F64), plan, ensemble, 0..ensemble.len())?;
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
        Trials { monitor: &Monitor::default(), marched: Mutex::new(0) }.march(plan, ensemble)
    }

    #[test]
    fn a_member_that_does_not_complete_has_an_infinite_error() {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        let done =
            marched(&Plan::new(&case), &Ensemble::nominal(&case.factors)).expect("the CPU backend does not fail");
        assert_eq!(largest_difference_k(&done, &done, 0), 0.0);
        let mut diverged = done.clone();
        diverged.temperatures_k.fill(f64::NAN);
        diverged.statuses[0] = MemberStatus::Diverged { time_s: 1.0 };
        assert_eq!(largest_difference_k(&done, &diverged, 0), f64::INFINITY);
        assert_eq!(largest_difference_k(&diverged, &done, 0), f64::INFINITY);
    }

    #[test]
    fn every_ply_belongs_to_one_region_and_regions_are_few() {
        for plies in [1, 5, 24, 25, 48, 49, 200, 256] {
            let grid = GridDensity { cells_per_ply: vec![1.0; plies], subdivisions: vec![1; plies] };
            let growth = StepGrowth::Graded { coefficient: 1.0 };
            let mut found = Discretisation { grid, time_steps: TimeStepControl { growth, segments: Vec::new() } };
            let regions = found.regions();
            assert!(regions <= MAX_PLY_REGIONS && (plies > MAX_PLY_REGIONS || regions == plies), "{plies} plies");
            (0..regions).for_each(|region| found.scale_region(region, 3.0));
            assert_eq!(found.grid.cells_per_ply, vec![3.0; plies]);
            assert_eq!(found.with_region_halved(regions - 1).grid.subdivisions[plies - 1], 2);
        }
    }

    #[test]
    fn an_unattainable_tolerance_ends_the_search_and_the_error_is_reported() {
        let mut case = Case::load("cases/lcat-2259".as_ref()).expect("a shipped case");
        case.resolution.tolerance_k = Some(1e-9);
        let plan = adapt(&case).expect("the CPU backend does not fail");
        let reached = plan.error_estimate.as_ref().expect("an adapted plan has an error estimate");
        assert!(reached.nominal_k > 1e-9 && reached.nominal_k < 1e-2, "{reached:?}");
        assert!(cell_steps(&plan) <= MAX_CELL_STEPS, "{} cells, {} steps", plan.cells(), plan.steps());
    }
}
