//! A member: its factors, its state, and its results.

use super::Real;
use super::compensated::add_unnormalized;
use super::double_word::DoubleWord;
use super::material::{ply_scale, state_scale};
use super::state::{DarcyState, GasState, ReactionState, RunningSums, Scales, SensorState, Thermal};
use super::surface_flux::face_scale;
use crate::layout::{BoundaryForcing, Cell, PlanData, PlanRows};
use crate::layout::{HEAT_TOTALS, Ply};

/// One member, or several in SIMD lanes. `GAS` is a constant: marches without gas are compiled apart, with enough
/// registers.
pub struct Member<'a, R: Real, const GAS: bool> {
    pub(super) plan: &'a PlanRows,
    pub(super) rows: &'a PlanData<R::Scalar>,
    pub(super) scales: Scales<R>,
    pub(super) thermal: Thermal<R>,
    pub(super) sensors: SensorState<R>,
    pub(super) reactions: ReactionState<R>,
    pub(super) gas: GasState<R>,
    pub(super) darcy: DarcyState<R>,
    pub(super) sums: RunningSums<R>,
}

/// Width of the cell of a row, m.
#[inline(always)]
pub(super) fn width_m<R: Real>(cell: &Cell<R::Scalar>) -> R::Constant {
    R::constant(cell.width_m)
}

/// Half the reciprocal distance from the node of the cell of a row to the next node of its ply, 1/m.
#[inline(always)]
pub(super) fn half_over_distance_1_m<R: Real>(cell: &Cell<R::Scalar>) -> R::Constant {
    R::constant(cell.half_over_next_1_m)
}

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
    /// Size of the columns of a cell without those of gas and reactions, for the bench of the march.
    pub const BYTES_PER_CELL: usize = Thermal::<R>::BYTES_PER_CELL;

    /// Evaluates all scales from a member's factors.
    #[inline(always)]
    fn scale(plan: &PlanRows, rows: &PlanData<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Scales<R> {
        let char = |ply: &Ply<u32>| rows.state_properties[(ply.first_state + ply.states) as usize - 1];
        let plies: Vec<_> = plan
            .plies
            .iter()
            .zip(&rows.bulk_properties)
            .map(|(ply, &bulk)| ply_scale(ply, bulk, char(ply), column))
            .collect();
        let of_states = |ply: &Ply<u32>| ply.first_state as usize..(ply.first_state + ply.states) as usize;
        let scaled = plan.plies.iter().zip(&rows.bulk_properties).zip(&plies);
        let scaled = scaled.flat_map(|((ply, &bulk), &scale)| of_states(ply).map(move |row| (row, bulk, scale)));
        let states = scaled
            .map(|(row, bulk, scale)| {
                state_scale(&plan.conductivity_columns[row], rows.state_properties[row], bulk, scale, column)
            })
            .collect();
        let contacts = rows.contacts_m2_k_w.iter().zip(&plan.plies);
        let sensors = plan.sensor_locations.iter().zip(&rows.sensors).take(if plan.has_depth_factors {
            plan.sensor_locations.len()
        } else {
            0
        });
        Scales {
            plies,
            states,
            contacts_m2_k_w: contacts.map(|(&resistance, ply)| R::splat(resistance) / column(ply.contact)).collect(),
            faces: [face_scale(&plan.face_columns[0], column), face_scale(&plan.face_columns[1], column)],
            shifts_m: sensors
                .map(|(place, row)| R::splat(row.depth_m) * (column(place.depth) - R::from_f64(1.0)))
                .collect(),
        }
    }

    /// Members at the start, from their columns: column 0 is one, the others their factors.
    #[inline(always)]
    pub fn start(plan: &'a PlanRows, rows: &'a PlanData<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Self {
        let cells = if GAS { plan.cells() } else { 0 };
        Self {
            plan,
            rows,
            scales: Self::scale(plan, rows, column),
            thermal: Thermal::start(plan, rows),
            sensors: SensorState::start(plan.sensor_locations.len()),
            reactions: ReactionState::start(plan, cells),
            gas: GasState::start(cells),
            darcy: DarcyState::start(plan, &rows.boundary_forcing[0]),
            sums: RunningSums::start(plan.plies.len()),
        }
    }

    /// Sets the cells of held faces to their schedules, which may jump between steps.
    #[inline(always)]
    pub(super) fn apply_held_faces(&mut self, step: usize) {
        let last = self.thermal.temperatures.len() - 1;
        for (cell, face) in [(0, 0), (last, 1)] {
            let held = R::splat(self.rows.faces[face].held);
            let free = R::from_f64(1.0) - held;
            let held_k = R::splat(self.forcing(face, step, 0).held_k);
            let before = self.thermal.temperatures[cell];
            self.thermal.temperatures[cell] = DoubleWord::new(held * held_k + free * before.high, free * before.low());
        }
    }

    /// Increment of a cell's temperature at a stage, K.
    #[inline(always)]
    pub(super) fn stage_increment(&self, cell: usize, stage: usize) -> R {
        if stage == 0 { R::from_f64(0.0) } else { self.thermal.first_increments[cell] }
    }

    /// Temperature of a cell at a stage.
    #[inline(always)]
    pub(super) fn stage_temperature(&self, cell: usize, stage: usize) -> DoubleWord<R> {
        add_unnormalized(self.thermal.temperatures[cell], self.stage_increment(cell, stage))
    }

    /// Forcing of a face at the start of a step (`at` 0) or at its end (1).
    #[inline(always)]
    pub(super) fn forcing(&self, face: usize, step: usize, at: usize) -> BoundaryForcing<R::Scalar> {
        self.rows.boundary_forcing[4 * step + 2 * face + at]
    }

    /// Width of a cell, m.
    #[inline(always)]
    pub(super) fn cell_width_m(&self, cell: usize) -> R::Constant {
        width_m::<R>(&self.rows.cells[cell])
    }

    /// Distance from the node of a cell to the face below it, and from there to the next node, m.
    #[inline(always)]
    pub(super) fn lengths_to_next_m(&self, cell: usize) -> [R; 2] {
        let cells = &self.rows.cells;
        [R::splat(cells[cell].below_m), R::splat(cells[cell + 1].above_m)]
    }

    /// Distance from the node of a cell to the next node, m.
    #[inline(always)]
    pub(super) fn distance_to_next_m(&self, cell: usize) -> R {
        let [below_m, above_m] = self.lengths_to_next_m(cell);
        below_m + above_m
    }

    /// Length of a step, s. The step assembled after the last one, for its readings, is as long as the last.
    #[inline(always)]
    pub(super) fn step_length_s(&self, step: usize) -> R::Constant {
        R::constant(self.rows.step_lengths_s[step.min(self.plan.steps() - 1)])
    }

    /// Temperature of a sensor's bead in one lane, K.
    #[inline(always)]
    pub fn bead_temperature_k(&self, sensor: usize, lane: usize) -> f64 {
        self.sensors.beads[sensor].lane(lane)
    }

    /// Heat through the faces and from and to the holder in one lane, in the order of `HEAT_TOTALS`, J/m².
    pub fn heat_j_m2(&self, lane: usize) -> [f64; HEAT_TOTALS] {
        self.sums.heat.map(|pair| pair.lane(lane))
    }

    /// Heat stored since the start in one lane, J/m².
    pub fn stored_j_m2(&self, lane: usize) -> f64 {
        self.sums.stored_j_m2.lane(lane)
    }

    /// Gas balance of one lane: gas in and out through both faces (kg/m²), its net enthalpy and the heat of reaction
    /// beyond enthalpies (J/m²), solid lost and gas stored (kg/m²).
    pub fn gas_balance(&self, lane: usize) -> [f64; 6] {
        let [lost_kg_m2, stored_kg_m2] = self.sums.lost_and_stored.map(|sum| sum.lane(lane));
        let [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2] =
            [self.sums.gas_in, self.sums.gas_out, self.sums.gas_heat, self.sums.reaction_gain]
                .map(|pair| pair.lane(lane));
        [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2, lost_kg_m2, stored_kg_m2]
    }

    /// Coldest and hottest temperature of a ply in one lane, K.
    pub fn extremes_k(&self, ply: usize, lane: usize) -> (f64, f64) {
        (self.sums.extremes_k[ply].0.lane(lane), self.sums.extremes_k[ply].1.lane(lane))
    }

    /// The plan that they march.
    #[inline(always)]
    pub fn plan(&self) -> &'a PlanRows {
        self.plan
    }

    /// Number of plies.
    pub fn plies(&self) -> usize {
        self.sums.extremes_k.len()
    }

    /// Step on which a lane diverged, if it did.
    pub fn diverged_at(&self, lane: usize) -> Option<usize> {
        self.sums.diverged[lane]
    }
}
