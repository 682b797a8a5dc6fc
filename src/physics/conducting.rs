//! A member's conduction: properties of every cell, what flows between them and through the faces.

use super::Real;
use super::carrying::{carried_gain, carried_slopes, gas_enthalpy};
use super::compensated::{Pair, difference, raised};
use super::faces::{FaceFlux, face_flux};
use super::holder::flux_sideways;
use super::material::{conductance_across, conductance_within, flux_slopes, gain_across, levelled, solid};
use super::member::Member;
use super::mixing::{left_of, together};
use super::state::Matter;
use super::table::{beyond, integral, read, segment, spot, value};
use crate::plan::GasPath;
use crate::plan::layout::{Cell, Drive, FACE_COLUMNS, GAS_COLUMNS};
use std::ops::Range;

/// A cell where it stands at a stage, as the links on both sides of it see it.
#[derive(Clone, Copy)]
pub(super) struct Node<R> {
    pub(super) temperature: Pair<R>,
    /// How far it has moved since the start of the step, K.
    pub(super) moved: R,
    pub(super) matter: Matter<R>,
    /// Enthalpy of its gas (J/kg) and the slope of that (J/kg/K).
    pub(super) gas_j_kg: R,
    pub(super) gas_rise: R,
}

/// What flows from a node to the next: heat by conduction and what gas brings either of them, W/m², and at the first stage the slopes of the
/// heat by the node's temperature and, less, by the next one's, W/m²/K.
#[derive(Clone, Copy)]
pub(super) struct Link<R> {
    pub(super) conducted: R,
    pub(super) gained: R,
    pub(super) slopes: [R; 2],
}

/// The cell of a face at a stage, as what comes in through it sees it.
#[derive(Clone, Copy)]
pub(super) struct Surface<R> {
    temperature_k: R,
    emissivity: R,
    /// Enthalpy of air at it over that at the cold wall (J/kg) and its slope (J/kg/K).
    enthalpy_j_kg: R,
    rise_j_kg_k: R,
}

/// Columns cut to some cells beforehand: looking whether a cell is within each takes as long as what is done with it.
pub(super) struct Nodes<'a, R: Real> {
    pub(super) cells: &'a [Cell<R::Scalar>],
    temperatures: &'a [Pair<R>],
    first: &'a [R],
    matter: &'a [Matter<R>],
    gas_j_kg: &'a [R],
    gas_rises: &'a [R],
}

/// What the slopes of a flux gain as temperatures move conductivities, less what gas carries against it.
#[inline(always)]
fn less<R: Real>(gained: [R; 2], carried: [R; 2]) -> [R; 2] {
    [gained[0] - carried[0], gained[1] - carried[1]]
}

/// What flows out of the last cell: nothing.
#[inline(always)]
pub(super) fn no_link<R: Real>() -> Link<R> {
    let zero = R::constant(0.0);
    Link { conducted: zero, gained: zero, slopes: [zero; 2] }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Conductivity and heat capacity of every cell at `T + Δ₁`, and at the first stage the slope of the conductivity.
    #[inline(always)]
    pub(super) fn properties(&mut self, step: usize, stage: usize) {
        if GAS && !self.reads_gas(stage) {
            self.gas_onward();
        }
        for p in 0..self.scales.plies.len() {
            let ply = &self.plan.plies[p];
            if ply.rows > 1 || self.plan.levels > 1 {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.blend(p, i, step, stage);
                }
            } else {
                self.plain(p, stage);
            }
            if GAS && self.plan.gas == Some(GasPath::Darcy) {
                for i in ply.first_cell as usize..ply.end_cell as usize {
                    self.thermal.matter[i].capacity = self.thermal.matter[i].capacity + self.gas_capacity(i);
                }
            }
        }
    }

    /// Conductivity, its slope and heat capacity of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn blend(&mut self, p: usize, i: usize, step: usize, stage: usize) {
        let at = spot(self.thermal.temperatures[i].high + self.moved(i, stage));
        let level = self.level_of(i, step, stage);
        let row = self.row_of(p, levelled(at, level)[0]);
        let phases = self.phases_at(p, i, stage);
        let here = self.mixture(p, at, row, level, phases, stage == 0);
        let capacity = here.heat_capacity * R::still(self.rows.cells[i].width_m);
        self.thermal.matter[i] = Matter { conductivity: here.conductivity, slope: here.slope, capacity };
        if self.reads_gas(stage) {
            [self.gas.gas_j_kg[i], self.gas.gas_rises[i]] = gas_enthalpy(self.gas_of(p, row));
        }
        let ply = self.plan.plies[p];
        if GAS && stage == 0 && ply.end_reaction > ply.first_reaction {
            self.rise_at(p, i, row);
        }
    }

    /// Properties of the cells of a ply at one pressure whose states are one substance, or so many times one. Columns are cut to its cells
    /// beforehand, as half of the march is here and looking whether a cell is within them takes as long as to look its properties up.
    #[inline(always)]
    fn plain(&mut self, p: usize, stage: usize) {
        let (plan, ply, bulk, whole) = (self.plan, self.plan.plies[p], self.rows.bulks[p], self.scales.plies[p]);
        let (states, stride, parts) = (ply.states as usize, plan.states, ply.parts as usize);
        let own = &self.scales.states[ply.first_state as usize..][..states];
        // The row's columns, told in numbers that are known beforehand: each read would be checked against the ply's.
        let columns = 2 * plan.properties() + if GAS { GAS_COLUMNS } else { 0 };
        let table = &self.rows.tables[ply.table as usize..];
        let (with_slope, reads_gas) = (stage == 0, self.reads_gas(stage));
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let rows = &self.rows.cells[cells.clone()];
        let temperatures = &self.thermal.temperatures[cells.clone()][..rows.len()];
        let first = &self.thermal.first[cells.clone()][..rows.len()];
        let matter = &mut self.thermal.matter[cells.clone()][..rows.len()];
        let of_gas = if GAS { cells.clone() } else { 0..0 };
        let gas_j_kg = &mut self.gas.gas_j_kg[of_gas.clone()];
        let gas_rises = &mut self.gas.gas_rises[of_gas];
        let mixes = GAS && states > 1;
        let of_states = if mixes { cells.start * stride..cells.end * stride } else { 0..0 };
        let phases = &self.reactions.phases[stage][of_states.clone()];
        let risen = &mut self.reactions.risen[of_states];
        // All cells are placed before any row is read: a processor looks no further ahead than to so many operations that wait,
        // and all of a row's would wait for its place (0.93 of the time in f64 and 0.83 in f32).
        let places = &mut self.thermal.row_places[..rows.len()];
        let shares = &mut self.thermal.row_shares[..rows.len()];
        let found = R::rows(
            places,
            table,
            columns,
            #[inline(always)]
            |i| {
                let moved = if with_slope { R::constant(0.0) } else { first[i] };
                let at = spot(temperatures[i].high + moved);
                shares[i] = at.share;
                at.row
            },
        );
        for i in 0..rows.len() {
            let row = read(found, i, shares[i]);
            let (mut scale, mut density_kg_m3) = (own[0].conductivity, whole.density_kg_m3);
            if mixes {
                let all = together(&phases[i * stride..][..own.len()], own, parts);
                let per_left = R::constant(1.0) / left_of(all.remains, whole, bulk);
                scale = all.conductivity.times(per_left, parts);
                density_kg_m3 = whole.mass_kg_m3 * all.stores;
                if with_slope {
                    risen[i * stride] = [integral(row, 1), value(row, 1)];
                }
            }
            let here = solid(row, parts, scale, with_slope);
            let capacity = density_kg_m3 * here.heat_capacity * R::still(rows[i].width_m);
            matter[i] = Matter { conductivity: here.conductivity, slope: here.slope, capacity };
            if reads_gas {
                [gas_j_kg[i], gas_rises[i]] = gas_enthalpy(beyond(row, plan.properties()));
            }
        }
    }
}

impl<R: Real> Nodes<'_, R> {
    /// One of them at a stage. A device looks properties up here, as columns of its own are what a march costs it; a processor has them in its
    /// cache, and not the registers for all of it at once (benches/LOG.md).
    #[inline(always)]
    pub(super) fn node<const GAS: bool>(&self, i: usize, stage: usize) -> Node<R> {
        let zero = R::constant(0.0);
        let (moved, start) = (self.first[i], self.temperatures[i]);
        Node {
            temperature: if stage == 0 { start } else { raised(start, moved) },
            moved: if stage == 0 { zero } else { moved },
            matter: self.matter[i],
            gas_j_kg: if GAS { self.gas_j_kg[i] } else { zero },
            gas_rise: if GAS { self.gas_rises[i] } else { zero },
        }
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Some cells.
    #[inline(always)]
    pub(super) fn nodes(&self, cells: Range<usize>) -> Nodes<'_, R> {
        let of_gas = if GAS { cells.clone() } else { 0..0 };
        Nodes {
            cells: &self.rows.cells[cells.clone()],
            temperatures: &self.thermal.temperatures[cells.clone()],
            first: &self.thermal.first[cells.clone()][..cells.len()],
            matter: &self.thermal.matter[cells.clone()][..cells.len()],
            gas_j_kg: &self.gas.gas_j_kg[of_gas.clone()],
            gas_rises: &self.gas.gas_rises[of_gas],
        }
    }

    /// What flows from a cell to the next of its ply.
    #[inline(always)]
    pub(super) fn link_within(
        &self,
        cell: usize,
        here: Node<R>,
        next: Node<R>,
        half_over_next_1_m: R::Still,
        stage: usize,
    ) -> Link<R> {
        let conductance = conductance_within(here.matter.conductivity, next.matter.conductivity, half_over_next_1_m);
        let drop = difference(here.temperature, next.temperature);
        let mut gained = [R::constant(0.0); 2];
        if stage == 0 {
            let gain = drop * half_over_next_1_m;
            gained = [here.matter.slope * gain, next.matter.slope * gain];
        }
        self.link(cell, here, next, conductance, drop, gained, stage)
    }

    /// The same across the interface over a ply, from the last cell of the one before.
    #[inline(always)]
    pub(super) fn link_across(&self, p: usize, here: Node<R>, next: Node<R>, stage: usize) -> Link<R> {
        let (cell, rows) = (self.plan.plies[p].first_cell as usize - 1, &self.rows.cells);
        let (below_m, above_m) = (R::still(rows[cell].below_m), R::still(rows[cell + 1].above_m));
        let contact_m2_k_w = self.scales.contacts_m2_k_w[p - 1];
        let conductance =
            conductance_across(here.matter.conductivity, below_m, next.matter.conductivity, above_m, contact_m2_k_w);
        let drop = difference(here.temperature, next.temperature);
        let mut gained = [R::constant(0.0); 2];
        if stage == 0 {
            let own = gain_across(conductance, here.matter.conductivity, below_m) * here.matter.slope;
            let below = gain_across(conductance, next.matter.conductivity, above_m) * next.matter.slope;
            gained = [own * drop, below * drop];
        }
        self.link(cell, here, next, conductance, drop, gained, stage)
    }

    /// Either, given what the slopes of its heat gain at the first stage as temperatures move conductivities.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the twin in WGSL takes the same")]
    fn link(
        &self,
        cell: usize,
        here: Node<R>,
        next: Node<R>,
        conductance: R,
        drop: R,
        mut gained: [R; 2],
        stage: usize,
    ) -> Link<R> {
        let mut link = Link { conducted: conductance * drop, ..no_link() };
        if GAS {
            link.gained = carried_gain(self.gas.flows[cell], here.gas_j_kg, next.gas_j_kg);
        }
        if stage == 0 {
            if GAS {
                gained = less(gained, carried_slopes(self.gas.flows[cell], here.gas_rise, next.gas_rise));
            }
            link.slopes = flux_slopes(conductance, gained);
        }
        link
    }

    /// The cell of a face at a stage.
    #[inline(always)]
    pub(super) fn surface(&self, face: usize, cell: usize, stage: usize) -> Surface<R> {
        let temperature_k = self.thermal.temperatures[cell].high + self.moved(cell, stage);
        let at = spot(temperature_k);
        let ply = face * (self.scales.plies.len() - 1);
        let emissivity = self.face_emissivity(face, ply, cell, at, stage);
        let air = segment(&self.rows.tables, at, FACE_COLUMNS, self.plan.face_table());
        Surface { temperature_k, emissivity, enthalpy_j_kg: value(air, 0), rise_j_kg_k: value(air, 1) }
    }

    /// Heat that comes into the cell of a face through it; of a held one nothing, as what comes in is what passes on.
    #[inline(always)]
    pub(super) fn through(&self, face: usize, drive: Drive<R::Scalar>, surface: Surface<R>) -> FaceFlux<R> {
        let row = self.rows.faces[face];
        let open = face_flux(
            drive,
            row,
            self.scales.faces[face],
            surface.temperature_k,
            surface.emissivity,
            surface.enthalpy_j_kg,
            surface.rise_j_kg_k,
            self.gas.outflow,
        );
        let free = R::constant(1.0) - R::of(row.held);
        FaceFlux { flux: free * open.flux, slope: free * open.slope }
    }

    /// Heat that came in through a face at a stage: through an open one from outside, of a held one what passed on from its cell to the next and to
    /// the holder.
    #[inline(always)]
    pub(super) fn passed_through(&self, face: usize, cell: usize, step: usize, stage: usize) -> R {
        let mut passed_on = self.thermal.passed[face];
        if self.plan.has_holder {
            let drive = self.rows.drives[4 * step + 2 * face + stage];
            let sideways = self.conductance_sideways(face * (self.scales.plies.len() - 1), cell);
            passed_on = passed_on - flux_sideways(sideways, R::of(drive.holder_k), self.staged(cell, stage));
        }
        self.thermal.edges[face].flux + R::of(self.rows.faces[face].held) * passed_on
    }
}
