//! The CPU backend: groups of members in SIMD lanes, over all threads.

use super::{Backend, March, MarchError, Precision, member_status, readings, trace_rows};
use crate::ensemble::Ensemble;
use crate::physics::cell_state::CELL_QUANTITIES;
use crate::physics::instruction_set;
use crate::physics::kernel::{Kernel, MemberResult};
use crate::physics::lanes::MAX_LANES;
use crate::physics::layout::{NO_INSTANT, PlanData, PlanRows};
use crate::plan::Plan;
use crate::traces::{Balance, MemberStatus, Traces};
use rayon::prelude::*;
use std::ops::Range;
use std::str::FromStr;

/// A SIMD group takes as long as this many members in scalar arithmetic (see benches/LOG.md); up to this many members a
/// thread are marched one by one.
const SCALAR_MEMBERS_PER_THREAD: usize = 2;

/// A SIMD instruction set that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionSet(instruction_set::InstructionSet);

impl InstructionSet {
    /// One member at a time, without SIMD.
    const SCALAR: Self = Self(instruction_set::InstructionSet::SCALAR);

    /// The instruction sets of this processor, the widest first, no SIMD last.
    pub fn available() -> Vec<Self> {
        instruction_set::InstructionSet::available().into_iter().map(Self).collect()
    }

    /// `avx-512`, `avx2`, `neon` or `scalar`.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    fn march(self, precision: Precision, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Traces {
        let data = &plan.rows.data;
        match precision {
            Precision::F64 => march_groups(self.0.f64(), plan, data, ensemble, members),
            Precision::F32 => march_groups(self.0.f32(), plan, &data.map(|x| x as f32), ensemble, members),
        }
    }

    fn tangents(self, precision: Precision, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Traces {
        let data = &plan.rows.data;
        match precision {
            Precision::F64 => march_tangents(self.0.derivatives_f64(), plan, data, points, factors),
            Precision::F32 => march_tangents(self.0.derivatives_f32(), plan, &data.map(|x| x as f32), points, factors),
        }
    }
}

impl FromStr for InstructionSet {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let available = Self::available();
        available.iter().copied().find(|one| one.name() == name).ok_or_else(|| {
            let names: Vec<&str> = available.iter().map(|one| one.name()).collect();
            format!("this processor has {}", names.join(", "))
        })
    }
}

/// The CPU, with members in SIMD lanes.
pub struct Cpu {
    precision: Precision,
    threads: usize,
    instruction_set: InstructionSet,
}

impl Cpu {
    /// Uses the threads of the current pool and the widest vectors of the processor.
    pub fn new(precision: Precision) -> Self {
        Self { precision, threads: rayon::current_num_threads(), instruction_set: InstructionSet::available()[0] }
    }

    /// The march with an instruction set other than the widest.
    #[must_use]
    pub fn with_instruction_set(self, instruction_set: InstructionSet) -> Self {
        Self { instruction_set, ..self }
    }
}

impl March for Cpu {
    fn backend(&self) -> Backend {
        let noun = if self.threads == 1 { "thread" } else { "threads" };
        let name = format!("{} {noun}, {}", self.threads, self.instruction_set.0.title());
        Backend { name, kind: "cpu", driver: None, precision: self.precision }
    }

    /// Traces of about 6 MiB, so that progress is reported often and memory stays small; but at least four SIMD groups
    /// a thread, so that threads seldom wait for the last group.
    fn capacity(&self, plan: &Plan) -> usize {
        let reals = (plan.rows.sensor_locations.len() + plan.gauges()) * plan.rows.records;
        (768 * 1024 / reals.max(1)).min(4096).max(4 * MAX_LANES * self.threads)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let rows = trace_rows(plan, ensemble, members.clone(), &[]);
        let records = if members.len() <= SCALAR_MEMBERS_PER_THREAD * self.threads {
            InstructionSet::SCALAR.march(self.precision, plan, ensemble, members)
        } else {
            self.instruction_set.march(self.precision, plan, ensemble, members)
        };
        Ok(readings(records, plan, &rows))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let records = self.instruction_set.tangents(self.precision, plan, points, factors);
        Ok(Some(readings(records, plan, &trace_rows(plan, points, 0..points.len(), factors))))
    }

    /// One plan a thread.
    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        let march = |plan: &&Plan| Self { ..*self }.march(plan, ensemble, members.clone());
        plans.par_iter().map(march).collect()
    }
}

/// Reference backend: one member at a time in one thread.
pub struct ScalarReference(pub Precision);

impl March for ScalarReference {
    fn backend(&self) -> Backend {
        Backend { name: "one member at a time".to_owned(), kind: "cpu", driver: None, precision: self.0 }
    }

    fn capacity(&self, _plan: &Plan) -> usize {
        1
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let rows = trace_rows(plan, ensemble, members.clone(), &[]);
        Ok(readings(InstructionSet::SCALAR.march(self.0, plan, ensemble, members), plan, &rows))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let records = InstructionSet::SCALAR.tangents(self.0, plan, points, factors);
        Ok(Some(readings(records, plan, &trace_rows(plan, points, 0..points.len(), factors))))
    }
}

/// March members in SIMD groups, the groups over threads.
fn march_groups<S: Send + Sync>(
    kernel: &Kernel<S>,
    plan: &Plan,
    data: &PlanData<S>,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Traces {
    let (sensors, instants) = (plan.rows.sensor_locations.len(), plan.rows.records);
    let count = members.len();
    let mut traces = Traces {
        temperatures_k: vec![0.0; count * sensors * instants],
        ..Traces::empty(members.start, sensors, instants)
    };
    let group_size = (kernel.lanes() * sensors * instants).max(1);
    let ends: Vec<Vec<MemberResult>> = traces
        .temperatures_k
        .par_chunks_mut(group_size)
        .enumerate()
        .map(|(group, temperatures_k)| {
            let first = members.start + group * kernel.lanes();
            let lanes = (members.end - first).min(kernel.lanes());
            let values: Vec<Vec<f64>> = (first..first + lanes).map(|member| ensemble.member(member)).collect();
            let value = |lane: usize, column: usize| match column {
                0 => 1.0,
                _ => values[lane.min(lanes - 1)][column - 1],
            };
            kernel.march(&plan.rows, data, lanes, &value, temperatures_k, false)
        })
        .collect();
    for end in ends.into_iter().flatten() {
        let status = member_status(plan, end.diverged_at_step, &end.extremes_k);
        add(end, status, &mut traces);
    }
    traces
}

/// March points with their tangents: each job carries one point and as many factors as the dual number has directions;
/// jobs over threads.
fn march_tangents<S: Send + Sync>(
    kernel: &Kernel<S>,
    plan: &Plan,
    data: &PlanData<S>,
    points: &Ensemble,
    factors: &[usize],
) -> Traces {
    let (sensors, instants, size) =
        (plan.rows.sensor_locations.len(), plan.rows.records, plan.rows.sensor_locations.len() * plan.rows.records);
    let some: Vec<&[usize]> = if factors.is_empty() { vec![&[]] } else { factors.chunks(kernel.lanes() - 1).collect() };
    let jobs: Vec<(usize, &[usize])> =
        (0..points.len()).flat_map(|point| some.iter().map(move |&some| (point, some))).collect();
    let marched = jobs.into_par_iter().map(|(point, some)| {
        let values = points.member(point);
        let mut temperatures_k = vec![0.0; (1 + some.len()) * size];
        let value = |lane: usize, column: usize| match (lane, column) {
            (0, 0) => 1.0,
            (0, _) => values[column - 1],
            _ => f64::from(some.get(lane - 1).is_some_and(|factor| factor + 1 == column)),
        };
        let ends = kernel.march(&plan.rows, data, 1 + some.len(), &value, &mut temperatures_k, false);
        (temperatures_k, ends)
    });
    let marched: Vec<(Vec<f64>, Vec<MemberResult>)> = marched.collect();
    let mut traces = Traces::empty(0, sensors, instants);
    for (job, (temperatures_k, ends)) in marched.into_iter().enumerate() {
        let status = member_status(plan, ends[0].diverged_at_step, &ends[0].extremes_k);
        // Every job of a point marches the same member; only the first adds it.
        let skipped = usize::from(job % some.len() > 0);
        traces.temperatures_k.extend(&temperatures_k[skipped * size..]);
        ends.into_iter().skip(skipped).for_each(|end| add(end, status.clone(), &mut traces));
    }
    traces
}

/// Add the results of a member, other than temperatures, to traces.
fn add(end: MemberResult, status: MemberStatus, traces: &mut Traces) {
    traces.statuses.push(status);
    traces.balances.push(Balance::new(end.heat_j_m2, end.stored_j_m2).with_gas(end.gas_balance));
    traces.extremes_k.extend(end.extremes_k);
    traces.gauges.extend(end.gauges);
}

/// Density of the solid (kg/m³ of the virgin layup), degree of conversion and gas pressure (Pa; zero without Darcy
/// flow) of every cell of one member at the instants of a plan with gas, in double precision: quantity, cell × instant.
/// They are those of the plan's own resolution.
pub fn cell_states(plan: &Plan, ensemble: &Ensemble, member: usize) -> [Vec<Vec<f64>>; CELL_QUANTITIES] {
    let values = ensemble.member(member);
    let value = |_: usize, column: usize| if column == 0 { 1.0 } else { values[column - 1] };
    // Only the records that the instants need: cells and steps are many.
    let (curve, used) = plan.interpolation.at_instants_only();
    let place = |record: &u32| used.binary_search(&(*record as usize)).map_or(NO_INSTANT, |place| place as u32);
    let rows = PlanRows {
        record_at_step: plan.rows.record_at_step.iter().map(place).collect(),
        records: used.len(),
        ..plan.rows.clone()
    };
    let mut temperatures_k = vec![0.0; rows.sensor_locations.len() * rows.records];
    let marched = InstructionSet::SCALAR.0.f64().march(&rows, &rows.data, 1, &value, &mut temperatures_k, true);
    let mut cells = marched[0].cell_states.chunks(rows.records.max(1)).map(|records| {
        let mut readings = vec![0.0; curve.instant_count()];
        curve.interpolate(records, &mut readings);
        readings
    });
    std::array::from_fn(|_| cells.by_ref().take(plan.cells()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, Resolution};

    /// The integration tests use the widest vectors only.
    #[test]
    fn every_available_instruction_set_gives_the_scalar_traces_and_derivatives() {
        let cases = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/lcat-2259-pyrolysis");
        let mut case = Case::load(cases.as_ref()).expect("a shipped case loads");
        case.resolution = Resolution { cells: 40, ..Resolution::default() };
        let plan = Plan::new(&case);
        let factors = case.factors.len();
        let ensemble = Ensemble::from_values(factors, (0..5 * factors).map(|i| 0.9 + 0.01 * (i % 21) as f64).collect());
        for precision in [Precision::F64, Precision::F32] {
            let scalar = InstructionSet::SCALAR.march(precision, &plan, &ensemble, 0..5);
            assert!(scalar.trace(0, 0) != scalar.trace(1, 0), "the members are equal");
            let all: Vec<usize> = (0..factors).collect();
            let derivatives = InstructionSet::SCALAR.tangents(precision, &plan, &ensemble, &all);
            assert!(derivatives.trace(factors, 0) != derivatives.trace(factors - 1, 0), "the derivatives are equal");
            for set in InstructionSet::available() {
                let vectorised = set.march(precision, &plan, &ensemble, 0..5);
                assert_eq!(vectorised.temperatures_k, scalar.temperatures_k, "{set:?} in {precision:?}");
                assert_eq!(vectorised.gauges, scalar.gauges, "{set:?} in {precision:?}");
                let vectorised = set.tangents(precision, &plan, &ensemble, &all);
                assert_eq!(
                    vectorised.temperatures_k, derivatives.temperatures_k,
                    "derivatives of {set:?} in {precision:?}"
                );
            }
        }
    }
}
