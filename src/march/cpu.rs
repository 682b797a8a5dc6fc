//! The CPU backend: groups of members in SIMD lanes, over all threads.

mod kernel;

use super::{Backend, March, MarchError, Precision, member_status, readings, trace_rows};
use crate::ensemble::Ensemble;
use crate::physics::Real;
use crate::physics::cell_state::CELL_QUANTITIES;
use crate::plan::{Plan, layout::PlanData};
use crate::traces::Traces;
use kernel::{Kernel, MemberResult};
use rayon::prelude::*;
use std::ops::Range;

/// A SIMD group takes as long as this many members in scalar arithmetic (see benches/LOG.md); up to this many members a
/// thread are marched one by one.
const SCALAR_MEMBERS_PER_THREAD: usize = 2;
/// Most lanes of a vector.
const MAX_LANES: usize = 16;

/// A SIMD instruction set that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstructionSet(Vectors);

/// Without vectors, members are marched one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Vectors {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "aarch64")]
    Neon,
}

impl InstructionSet {
    /// The instruction sets of this processor, the widest first, no SIMD last.
    pub fn available() -> Vec<Self> {
        Vectors::available().into_iter().map(Self).collect()
    }

    /// `avx-512`, `avx2`, `neon` or `scalar`.
    pub fn name(self) -> &'static str {
        match self.0 {
            Vectors::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx512 => "avx-512",
            #[cfg(target_arch = "aarch64")]
            Vectors::Neon => "neon",
        }
    }
}

impl Vectors {
    #[cfg(target_arch = "x86_64")]
    fn available() -> Vec<Self> {
        let has_avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq");
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        let supported = [(has_avx512, Self::Avx512), (has_avx2, Self::Avx2), (true, Self::Scalar)];
        supported.into_iter().filter_map(|(is_supported, vectors)| is_supported.then_some(vectors)).collect()
    }

    #[cfg(target_arch = "aarch64")]
    fn available() -> Vec<Self> {
        vec![Self::Neon, Self::Scalar]
    }

    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    fn available() -> Vec<Self> {
        vec![Self::Scalar]
    }

    /// Name in the description of a backend.
    fn title(self) -> &'static str {
        match self {
            Self::Scalar => "no SIMD",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "AVX-512",
            #[cfg(target_arch = "aarch64")]
            Self::Neon => "NEON",
        }
    }

    fn march(self, precision: Precision, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Traces {
        match precision {
            Precision::F64 => {
                let rows = &plan.data;
                match self {
                    Self::Scalar => march_groups(&kernel::scalar_f64::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "x86_64")]
                    Self::Avx2 => march_groups(&kernel::avx2_f64::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "x86_64")]
                    Self::Avx512 => march_groups(&kernel::avx512_f64::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "aarch64")]
                    Self::Neon => march_groups(&kernel::neon_f64::KERNEL, plan, rows, ensemble, members),
                }
            }
            Precision::F32 => {
                let rows = &plan.data.map(|x| x as f32);
                match self {
                    Self::Scalar => march_groups(&kernel::scalar_f32::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "x86_64")]
                    Self::Avx2 => march_groups(&kernel::avx2_f32::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "x86_64")]
                    Self::Avx512 => march_groups(&kernel::avx512_f32::KERNEL, plan, rows, ensemble, members),
                    #[cfg(target_arch = "aarch64")]
                    Self::Neon => march_groups(&kernel::neon_f32::KERNEL, plan, rows, ensemble, members),
                }
            }
        }
    }

    fn tangents(self, precision: Precision, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Traces {
        if precision == Precision::F32 {
            let rows = &plan.data.map(|x| x as f32);
            return march_tangents(&kernel::scalar_derivatives_f32::KERNEL, plan, rows, points, factors);
        }
        let rows = &plan.data;
        match self {
            Self::Scalar => march_tangents(&kernel::scalar_derivatives_f64::KERNEL, plan, rows, points, factors),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => march_tangents(&kernel::avx2_derivatives_f64::KERNEL, plan, rows, points, factors),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => march_tangents(&kernel::avx512_derivatives_f64::KERNEL, plan, rows, points, factors),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => march_tangents(&kernel::neon_derivatives_f64::KERNEL, plan, rows, points, factors),
        }
    }
}

/// The CPU, with members in SIMD lanes.
pub struct Cpu {
    precision: Precision,
    threads: usize,
    vectors: Vectors,
}

impl Cpu {
    /// Uses the threads of the current pool and the widest vectors of the processor.
    pub fn new(precision: Precision) -> Self {
        Self { precision, threads: rayon::current_num_threads(), vectors: Vectors::available()[0] }
    }

    /// With an instruction set other than the widest.
    #[must_use]
    pub fn with_instruction_set(self, instruction_set: InstructionSet) -> Self {
        Self { vectors: instruction_set.0, ..self }
    }
}

impl March for Cpu {
    fn backend(&self) -> Backend {
        let noun = if self.threads == 1 { "thread" } else { "threads" };
        let name = format!("{} {noun}, {}", self.threads, self.vectors.title());
        Backend { name, kind: "cpu", driver: None, precision: self.precision }
    }

    /// Traces of about 6 MiB, so that progress is reported often and memory stays small; but at least four SIMD groups
    /// a thread, so that threads seldom wait for the last group.
    fn capacity(&self, plan: &Plan) -> usize {
        let reals = (plan.sensor_locations.len() + plan.gauges()) * plan.records;
        (768 * 1024 / reals.max(1)).min(4096).max(4 * MAX_LANES * self.threads)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let rows = trace_rows(plan, ensemble, members.clone(), &[]);
        let records = if members.len() <= SCALAR_MEMBERS_PER_THREAD * self.threads {
            Vectors::Scalar.march(self.precision, plan, ensemble, members)
        } else {
            self.vectors.march(self.precision, plan, ensemble, members)
        };
        Ok(readings(records, plan, &rows))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        plan.check_consistency().map_err(MarchError::InconsistentPlan)?;
        let records = self.vectors.tangents(self.precision, plan, points, factors);
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
        Ok(readings(Vectors::Scalar.march(self.0, plan, ensemble, members), plan, &rows))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        let records = Vectors::Scalar.tangents(self.0, plan, points, factors);
        Ok(Some(readings(records, plan, &trace_rows(plan, points, 0..points.len(), factors))))
    }
}

/// March members in SIMD groups, the groups over threads.
fn march_groups<R: Real>(
    kernel: &Kernel<R>,
    plan: &Plan,
    rows: &PlanData<R::Scalar>,
    ensemble: &Ensemble,
    members: Range<usize>,
) -> Traces {
    let (sensors, instants) = (plan.sensor_locations.len(), plan.records);
    let count = members.len();
    let mut traces = Traces {
        temperatures_k: vec![0.0; count * sensors * instants],
        ..Traces::empty(members.start, sensors, instants)
    };
    let group_size = (R::LANES * sensors * instants).max(1);
    let ends: Vec<Vec<MemberResult>> = traces
        .temperatures_k
        .par_chunks_mut(group_size)
        .enumerate()
        .map(|(group, temperatures_k)| {
            let first = members.start + group * R::LANES;
            let lanes = (members.end - first).min(R::LANES);
            let values: Vec<Vec<f64>> = (first..first + lanes).map(|member| ensemble.member(member)).collect();
            let value = |lane: usize, column: usize| match column {
                0 => 1.0,
                _ => values[lane.min(lanes - 1)][column - 1],
            };
            kernel.march(plan, rows, lanes, value, temperatures_k, false)
        })
        .collect();
    for end in ends.into_iter().flatten() {
        let status = member_status(plan, end.diverged_at_step, &end.extremes_k);
        end.into_traces(status, &mut traces);
    }
    traces
}

/// March points with their tangents: each job carries one point and as many factors as the dual number has directions;
/// jobs over threads.
fn march_tangents<R: Real>(
    kernel: &Kernel<R>,
    plan: &Plan,
    rows: &PlanData<R::Scalar>,
    points: &Ensemble,
    factors: &[usize],
) -> Traces {
    let (sensors, instants, size) =
        (plan.sensor_locations.len(), plan.records, plan.sensor_locations.len() * plan.records);
    let some: Vec<&[usize]> = if factors.is_empty() { vec![&[]] } else { factors.chunks(R::LANES - 1).collect() };
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
        let ends = kernel.march(plan, rows, 1 + some.len(), value, &mut temperatures_k, false);
        (temperatures_k, ends)
    });
    let marched: Vec<(Vec<f64>, Vec<MemberResult>)> = marched.collect();
    let mut traces = Traces::empty(0, sensors, instants);
    for (job, (temperatures_k, ends)) in marched.into_iter().enumerate() {
        let status = member_status(plan, ends[0].diverged_at_step, &ends[0].extremes_k);
        // Every job of a point marches the same member; only the first adds it.
        let skipped = usize::from(job % some.len() > 0);
        traces.temperatures_k.extend(&temperatures_k[skipped * size..]);
        ends.into_iter().skip(skipped).for_each(|end| end.into_traces(status.clone(), &mut traces));
    }
    traces
}

/// Density of the solid (kg/m³ of the virgin layup), degree of conversion and gas pressure (Pa; zero without Darcy
/// flow) of every cell of one member at the instants of a plan with gas, in double precision: quantity, cell × instant.
/// They are those of the plan's own resolution.
pub fn cell_states(plan: &Plan, ensemble: &Ensemble, member: usize) -> [Vec<Vec<f64>>; CELL_QUANTITIES] {
    let values = ensemble.member(member);
    let value = |_: usize, column: usize| if column == 0 { 1.0 } else { values[column - 1] };
    let mut temperatures_k = vec![0.0; plan.sensor_locations.len() * plan.records];
    let marched = kernel::scalar_f64::KERNEL.march(plan, &plan.data, 1, value, &mut temperatures_k, true);
    let mut cells = marched[0].cell_states.chunks(plan.records.max(1)).map(|records| match &plan.interpolation {
        None => records.to_vec(),
        Some(readout) => {
            let mut readings = vec![0.0; readout.instant_count()];
            readout.interpolate(records, &mut readings);
            readings
        }
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
            let scalar = Vectors::Scalar.march(precision, &plan, &ensemble, 0..5);
            assert!(scalar.trace(0, 0) != scalar.trace(1, 0), "the members are equal");
            let all: Vec<usize> = (0..factors).collect();
            let derivatives = Vectors::Scalar.tangents(precision, &plan, &ensemble, &all);
            assert!(derivatives.trace(factors, 0) != derivatives.trace(factors - 1, 0), "the derivatives are equal");
            for vectors in Vectors::available() {
                let vectorised = vectors.march(precision, &plan, &ensemble, 0..5);
                assert_eq!(vectorised.temperatures_k, scalar.temperatures_k, "{vectors:?} in {precision:?}");
                assert_eq!(vectorised.gauges, scalar.gauges, "{vectors:?} in {precision:?}");
                let vectorised = vectors.tangents(precision, &plan, &ensemble, &all);
                assert_eq!(
                    vectorised.temperatures_k, derivatives.temperatures_k,
                    "derivatives of {vectors:?} in {precision:?}"
                );
            }
        }
    }
}
