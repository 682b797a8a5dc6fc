//! A member: its factors, its state, and its results.

use super::Real;
use super::compensated::{Pair, raised};
use super::faces::face_scale;
use super::material::{ply_scale, state_scale};
use super::state::{Accounts, DarcyState, GasState, Reactions, Scales, Sensing, Thermal};
use crate::plan::layout::{HEATS, Ply};
use crate::plan::{Plan, layout::Rows};

/// One member, or several in SIMD lanes. `GAS` is a constant: marches without gas are compiled apart, with enough
/// registers.
pub struct Member<'a, R: Real, const GAS: bool> {
    pub(super) plan: &'a Plan,
    pub(super) rows: &'a Rows<R::Scalar>,
    pub(super) scales: Scales<R>,
    pub(super) thermal: Thermal<R>,
    pub(super) sensors: Sensing<R>,
    pub(super) reactions: Reactions<R>,
    pub(super) gas: GasState<R>,
    pub(super) darcy: DarcyState<R>,
    pub(super) accounts: Accounts<R>,
}

impl<'a, R: Real, const GAS: bool> Member<'a, R, GAS> {
    /// Evaluates all scales from a member's factors.
    #[inline(always)]
    fn scale(plan: &Plan, rows: &Rows<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Scales<R> {
        let char = |ply: &Ply<u32>| rows.substances[(ply.first_state + ply.states) as usize - 1];
        let plies: Vec<_> =
            plan.plies.iter().zip(&rows.bulks).map(|(ply, &bulk)| ply_scale(ply, bulk, char(ply), column)).collect();
        let of_states = |ply: &Ply<u32>| ply.first_state as usize..(ply.first_state + ply.states) as usize;
        let scaled = plan.plies.iter().zip(&rows.bulks).zip(&plies);
        let scaled = scaled.flat_map(|((ply, &bulk), &scale)| of_states(ply).map(move |row| (row, bulk, scale)));
        let states = scaled
            .map(|(row, bulk, scale)| state_scale(&plan.conductions[row], rows.substances[row], bulk, scale, column))
            .collect();
        let contacts = rows.contacts_m2_k_w.iter().zip(&plan.plies);
        let sensors = plan.places.iter().zip(&rows.sensors).take(if plan.has_depths { plan.places.len() } else { 0 });
        Scales {
            plies,
            states,
            contacts_m2_k_w: contacts.map(|(&resistance, ply)| R::of(resistance) / column(ply.contact)).collect(),
            faces: [face_scale(&plan.scalings[0], column), face_scale(&plan.scalings[1], column)],
            shifts_m: sensors
                .map(|(place, row)| R::of(row.depth_m) * (column(place.depth) - R::constant(1.0)))
                .collect(),
        }
    }

    /// Members at the start, from their columns: column 0 is one, the others their factors.
    #[inline(always)]
    pub fn start(plan: &'a Plan, rows: &'a Rows<R::Scalar>, column: impl Fn(u32) -> R + Copy) -> Self {
        let cells = if GAS { plan.cells() } else { 0 };
        Self {
            plan,
            rows,
            scales: Self::scale(plan, rows, column),
            thermal: Thermal::start(rows),
            sensors: Sensing::start(plan.places.len()),
            reactions: Reactions::start(plan, cells),
            gas: GasState::start(cells),
            darcy: DarcyState::start(plan, &rows.drives[0]),
            accounts: Accounts::start(plan.plies.len()),
        }
    }

    /// Sets the cells of held faces to their schedules, which may jump between steps.
    #[inline(always)]
    pub(super) fn hold(&mut self, step: usize) {
        let last = self.thermal.temperatures.len() - 1;
        for (cell, face, drive) in [(0, 0, 4 * step), (last, 1, 4 * step + 2)] {
            let held = R::of(self.rows.faces[face].held);
            let free = R::constant(1.0) - held;
            let held_k = R::of(self.rows.drives[drive].held_k);
            let Pair { high, low } = self.thermal.temperatures[cell];
            self.thermal.temperatures[cell] = Pair { high: held * held_k + free * high, low: free * low };
        }
    }

    /// Increment of a cell's temperature at a stage, K.
    #[inline(always)]
    pub(super) fn moved(&self, cell: usize, stage: usize) -> R {
        if stage == 0 { R::constant(0.0) } else { self.thermal.first[cell] }
    }

    /// Temperature of a cell at a stage.
    #[inline(always)]
    pub(super) fn staged(&self, cell: usize, stage: usize) -> Pair<R> {
        raised(self.thermal.temperatures[cell], self.moved(cell, stage))
    }

    /// Length of a step, s. The step assembled after the last one, for its readings, is as long as the last.
    #[inline(always)]
    pub(super) fn length_s(&self, step: usize) -> R::Still {
        R::still(self.rows.lengths_s[step.min(self.plan.steps() - 1)])
    }

    /// Temperature of a sensor's bead in one lane, K.
    #[inline(always)]
    pub fn shown_k(&self, sensor: usize, lane: usize) -> f64 {
        self.sensors.beads[sensor].lane(lane)
    }

    /// Heat through the faces and from and to the holder in one lane, in the order of `HEATS`, J/m².
    pub fn heat_j_m2(&self, lane: usize) -> [f64; HEATS] {
        self.accounts.heat.map(|pair| pair.lane(lane))
    }

    /// Heat stored since the start in one lane, J/m².
    pub fn stored_j_m2(&self, lane: usize) -> f64 {
        self.accounts.stored_j_m2.lane(lane)
    }

    /// Gas balance of one lane: see [`Balance::and_gas`](crate::traces::Balance::and_gas).
    pub fn gone(&self, lane: usize) -> [f64; 6] {
        let [lost_kg_m2, stored_kg_m2] = self.accounts.lost_and_stored.map(|sum| sum.lane(lane));
        let [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2] =
            [self.accounts.gas_in, self.accounts.gas_out, self.accounts.gas_heat, self.accounts.reaction_gain]
                .map(|pair| pair.lane(lane));
        [in_kg_m2, out_kg_m2, heat_j_m2, gain_j_m2, lost_kg_m2, stored_kg_m2]
    }

    /// Coldest and hottest temperature of a ply in one lane, K.
    pub fn extremes_k(&self, ply: usize, lane: usize) -> (f64, f64) {
        (self.accounts.extremes_k[ply].0.lane(lane), self.accounts.extremes_k[ply].1.lane(lane))
    }

    /// Step on which a lane diverged, if it did.
    pub fn strayed(&self, lane: usize) -> Option<usize> {
        self.accounts.strayed[lane]
    }
}
