//! The march of one SIMD group: one generic function into which everything is inlined, compiled for each instruction
//! set and number type, with and without gas.

use crate::Real;
use crate::cell_state::CELL_QUANTITIES;
use crate::dual::Dual;
use crate::lanes::{F32Lanes, F64Lanes, SimdTables};
use crate::layout::{GAUGES, HEAT_TOTALS, NO_INSTANT, PlanData, PlanRows};
use crate::member::Member;
#[cfg(target_arch = "aarch64")]
use simdeez::engines::neon::Neon;
use simdeez::engines::scalar::Scalar;
#[cfg(target_arch = "x86_64")]
use simdeez::engines::{avx2::Avx2, avx512::Avx512};
use simdeez::prelude::Simd;

/// The value of each lane in each factor column.
type LaneValues<'a> = &'a dyn Fn(usize, usize) -> f64;
type MarchGroup<S> = fn(&PlanRows, &PlanData<S>, usize, LaneValues<'_>, &mut [f64], bool) -> Vec<MemberResult>;

/// The march of a group, compiled for one instruction set and number type, whose scalar is `S`. An
/// [`InstructionSet`](crate::instruction_set::InstructionSet) has those that the processor can run.
pub struct Kernel<S: 'static> {
    lanes: usize,
    with_gas: MarchGroup<S>,
    without_gas: MarchGroup<S>,
}

impl<S> Kernel<S> {
    /// Members marched at once; of a kernel with derivatives, a member and its derivatives.
    pub fn lanes(&self) -> usize {
        self.lanes
    }

    /// March one SIMD group, given the value of each lane in each factor column, and return the results of the first
    /// `lanes` lanes; with the states of all cells of the first lane if `reads_cells`. Temperatures are lane × sensor ×
    /// record.
    pub fn march(
        &self,
        plan: &PlanRows,
        rows: &PlanData<S>,
        lanes: usize,
        value: LaneValues<'_>,
        temperatures_k: &mut [f64],
        reads_cells: bool,
    ) -> Vec<MemberResult> {
        let march = if plan.gas.is_some() { self.with_gas } else { self.without_gas };
        march(plan, rows, lanes, value, temperatures_k, reads_cells)
    }
}

/// A kernel in modules of its own: the compiler optimises modules in parallel, but all instances of one generic
/// function on one thread.
macro_rules! kernel {
    ($name:ident, $instructions:ty, $real:ty) => {
        pub(crate) mod $name {
            use super::*;

            pub(crate) const KERNEL: Kernel<<$real as Real>::Scalar> =
                Kernel { lanes: <$real as Real>::LANES, with_gas: with_gas::march, without_gas: without_gas::march };

            kernel!(with_gas, $instructions, $real, true);
            kernel!(without_gas, $instructions, $real, false);
        }
    };
    ($name:ident, $instructions:ty, $real:ty, $gas:literal) => {
        mod $name {
            use super::*;

            pub(super) fn march(
                plan: &PlanRows,
                rows: &PlanData<<$real as Real>::Scalar>,
                lanes: usize,
                value: LaneValues<'_>,
                temperatures_k: &mut [f64],
                reads_cells: bool,
            ) -> Vec<MemberResult> {
                let columns: Vec<$real> =
                    (0..=plan.factors).map(|column| Real::from_lanes(|lane| value(lane, column))).collect();
                // Apart from the start and the results: a march that owns nothing, and so has nothing to drop where it
                // panics, takes 0.93 of the time (benches/LOG.md).
                let mut member = <$instructions>::invoke(
                    #[inline(always)]
                    || Member::<$real, $gas>::start(plan, rows, |column| columns[column as usize]),
                );
                let mut records = Records::new(plan, lanes, temperatures_k, $gas && reads_cells);
                <$instructions>::invoke(
                    #[inline(always)]
                    || march_group(&mut member, &mut records),
                );
                records.into_results(&member)
            }
        }
    };
}

/// A number with derivatives in as many directions as vectors allow.
type DerivativesF64<S> = Dual<f64, <S as SimdTables>::Directions>;

kernel!(scalar_f64, Scalar, f64);
kernel!(scalar_f32, Scalar, f32);
kernel!(scalar_derivatives_f64, Scalar, DerivativesF64<Scalar>);
// On the CPU f32 serves to compare with devices, so one direction at a time is enough: eight at once took a fifth of
// the compile time of the crate (benches/LOG.md).
kernel!(scalar_derivatives_f32, Scalar, Dual<f32, F32Lanes<Scalar>>);

#[cfg(target_arch = "x86_64")]
kernel!(avx2_f64, Avx2, F64Lanes<Avx2>);
#[cfg(target_arch = "x86_64")]
kernel!(avx2_f32, Avx2, F32Lanes<Avx2>);
#[cfg(target_arch = "x86_64")]
kernel!(avx2_derivatives_f64, Avx2, DerivativesF64<Avx2>);
#[cfg(target_arch = "x86_64")]
kernel!(avx512_f64, Avx512, F64Lanes<Avx512>);
#[cfg(target_arch = "x86_64")]
kernel!(avx512_f32, Avx512, F32Lanes<Avx512>);
#[cfg(target_arch = "x86_64")]
kernel!(avx512_derivatives_f64, Avx512, DerivativesF64<Avx512>);
#[cfg(target_arch = "aarch64")]
kernel!(neon_f64, Neon, F64Lanes<Neon>);
#[cfg(target_arch = "aarch64")]
kernel!(neon_f32, Neon, F32Lanes<Neon>);
#[cfg(target_arch = "aarch64")]
kernel!(neon_derivatives_f64, Neon, DerivativesF64<Neon>);

/// Results of a member other than temperatures.
pub struct MemberResult {
    /// The step on which it diverged, if it did.
    pub diverged_at_step: Option<usize>,
    /// Heat through the faces and from and to the holder, in the order of [`HEAT_TOTALS`], J/m².
    pub heat_j_m2: [f64; HEAT_TOTALS],
    /// Heat stored since the start, J/m².
    pub stored_j_m2: f64,
    /// See [`Member::gas_balance`].
    pub gas_balance: [f64; 6],
    /// Coldest and hottest temperature of each ply, K.
    pub extremes_k: Vec<(f64, f64)>,
    /// Gauge × record.
    pub gauges: Vec<f64>,
    /// Quantity × cell × record, where they are read.
    pub cell_states: Vec<f64>,
}

/// Records of the members of a group, each from the start of the march to its end.
struct Records<'a> {
    lanes: usize,
    /// Member × sensor × instant.
    temperatures_k: &'a mut [f64],
    /// Member × gauge × instant.
    gauges: Vec<f64>,
    /// States of the cells of the first member, quantity × cell × instant, where they are read.
    cell_states: Vec<f64>,
}

impl<'a> Records<'a> {
    /// Empty records of `lanes` members.
    fn new(plan: &PlanRows, lanes: usize, temperatures_k: &'a mut [f64], reads_cells: bool) -> Self {
        let cells = if reads_cells { plan.cells() } else { 0 };
        Self {
            lanes,
            temperatures_k,
            gauges: vec![0.0; lanes * plan.gauges() * plan.records],
            cell_states: vec![0.0; CELL_QUANTITIES * cells * plan.records],
        }
    }

    /// The results of each member.
    fn into_results<R: Real, const GAS: bool>(mut self, member: &Member<'_, R, GAS>) -> Vec<MemberResult> {
        let size = self.gauges.len() / self.lanes;
        (0..self.lanes)
            .map(|lane| MemberResult {
                diverged_at_step: member.diverged_at(lane),
                heat_j_m2: member.heat_j_m2(lane),
                stored_j_m2: member.stored_j_m2(lane),
                gas_balance: member.gas_balance(lane),
                extremes_k: (0..member.plies()).map(|ply| member.extremes_k(ply, lane)).collect(),
                gauges: self.gauges[lane * size..(lane + 1) * size].to_vec(),
                cell_states: if lane == 0 { std::mem::take(&mut self.cell_states) } else { Vec::new() },
            })
            .collect()
    }
}

/// March one SIMD group of members.
#[inline(always)]
fn march_group<R: Real, const GAS: bool>(member: &mut Member<'_, R, GAS>, records: &mut Records<'_>) {
    let plan = member.plan();
    let (sensors, instants, lanes) = (plan.sensor_locations.len(), plan.records, records.lanes);
    for step in 0..=plan.steps() {
        member.advance(
            step,
            #[inline(always)]
            |member| {
                let instant = plan.record_at_step[step];
                if instant != NO_INSTANT {
                    for (sensor, lane) in (0..sensors).flat_map(|sensor| (0..lanes).map(move |lane| (sensor, lane))) {
                        let at = (lane * sensors + sensor) * instants + instant as usize;
                        records.temperatures_k[at] = member.bead_temperature_k(sensor, lane);
                    }
                    if plan.gauges() > 0 {
                        let read = member.gauges(step);
                        for (lane, gauge) in (0..lanes).flat_map(|lane| (0..GAUGES).map(move |gauge| (lane, gauge))) {
                            let at = (lane * GAUGES + gauge) * instants + instant as usize;
                            records.gauges[at] = read[gauge].lane(lane);
                        }
                    }
                    if GAS && !records.cell_states.is_empty() {
                        for (ply, row) in plan.plies.iter().enumerate() {
                            for cell in row.first_cell as usize..row.end_cell as usize {
                                for (quantity, value) in member.cell_state(ply, cell).into_iter().enumerate() {
                                    let at = (quantity * plan.cells() + cell) * instants + instant as usize;
                                    records.cell_states[at] = value.lane(0);
                                }
                            }
                        }
                    }
                }
            },
        );
    }
}
