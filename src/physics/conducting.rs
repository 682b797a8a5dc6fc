//! Heat conduction: cell properties, fluxes between cells and through the surfaces.

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

/// A cell at a stage, as its two interior faces see it.
#[derive(Clone, Copy)]
pub(super) struct Node<R> {
    pub(super) temperature: Pair<R>,
    /// Temperature increment of the first stage, K; zero at the first stage.
    pub(super) moved: R,
    pub(super) matter: Matter<R>,
    /// Enthalpy of its gas (J/kg) and the slope of the enthalpy (J/kg/K).
    pub(super) gas_j_kg: R,
    pub(super) gas_rise: R,
}

/// Fluxes from a node to the next: conducted heat and the advected heat gained by each of both cells, W/m². At the
/// first stage also the slopes of the heat by the node's temperature and, negated, by the next node's, W/m²/K.
#[derive(Clone, Copy)]
pub(super) struct Link<R> {
    pub(super) conducted: R,
    pub(super) gained: R,
    pub(super) slopes: [R; 2],
}

/// State of a surface at a stage.
#[derive(Clone, Copy)]
pub(super) struct Surface<R> {
    temperature_k: R,
    emissivity: R,
    /// Enthalpy of air at the surface above that at the cold wall (J/kg), and its slope (J/kg/K).
    enthalpy_j_kg: R,
    rise_j_kg_k: R,
}

/// Columns sliced to a range of cells. One bounds check a slice replaces one a cell, which costs as much as the work.
pub(super) struct Nodes<'a, R: Real> {
    pub(super) cells: &'a [Cell<R::Scalar>],
    temperatures: &'a [Pair<R>],
    first: &'a [R],
    matter: &'a [Matter<R>],
    gas_j_kg: &'a [R],
    gas_rises: &'a [R],
}

/// Slopes from changing conductivities, less those of advection.
#[inline(always)]
fn less<R: Real>(conductivity_slopes: [R; 2], advection: [R; 2]) -> [R; 2] {
    [conductivity_slopes[0] - advection[0], conductivity_slopes[1] - advection[1]]
}

/// Zero flux: below the last cell.
#[inline(always)]
pub(super) fn no_link<R: Real>() -> Link<R> {
    let zero = R::constant(0.0);
    Link { conducted: zero, gained: zero, slopes: [zero; 2] }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Evaluates conductivity and heat capacity of every cell at the temperature of the stage; at the first stage also
    /// the slope of the conductivity.
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

    /// Properties of a cell that is a mixture, or whose pressure changes.
    #[inline(always)]
    pub(super) fn blend(&mut self, p: usize, i: usize, step: usize, stage: usize) {
        let at = spot(self.thermal.temperatures[i].high + self.moved(i, stage));
        let pressure = self.level_of(i, step, stage);
        let row = self.row_of(p, levelled(at, pressure)[0]);
        let phases = self.phases_at(p, i, stage);
        let here = self.mixture(p, at, row, pressure, phases, stage == 0);
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

    /// Properties of the cells of a ply at one pressure whose states are one substance or multiples of one. Half of a
    /// march is spent here. Slices of its cells spare the bounds checks.
    #[inline(always)]
    fn plain(&mut self, p: usize, stage: usize) {
        let (plan, ply, bulk, whole) = (self.plan, self.plan.plies[p], self.rows.bulks[p], self.scales.plies[p]);
        let (states, stride, parts) = (ply.states as usize, plan.states, ply.parts as usize);
        let own = &self.scales.states[ply.first_state as usize..][..states];
        // Constant bounds of the row: the reads below need no bounds check.
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
        // Row offsets of all cells first, then the reads: otherwise each read waits for its own offset (time ratio 0.93
        // in f64 and 0.83 in f32).
        let offsets = &mut self.thermal.row_places[..rows.len()];
        let shares = &mut self.thermal.row_shares[..rows.len()];
        let found = R::rows(
            offsets,
            table,
            columns,
            #[inline(always)]
            |i| {
                let increment = if with_slope { R::constant(0.0) } else { first[i] };
                let at = spot(temperatures[i].high + increment);
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
    /// Node at a stage. The device looks properties up here, as storing columns dominates its time; the processor has
    /// them in its cache (benches/LOG.md).
    #[inline(always)]
    pub(super) fn node<const GAS: bool>(&self, i: usize, stage: usize) -> Node<R> {
        let zero = R::constant(0.0);
        let (increment, start) = (self.first[i], self.temperatures[i]);
        Node {
            temperature: if stage == 0 { start } else { raised(start, increment) },
            moved: if stage == 0 { zero } else { increment },
            matter: self.matter[i],
            gas_j_kg: if GAS { self.gas_j_kg[i] } else { zero },
            gas_rise: if GAS { self.gas_rises[i] } else { zero },
        }
    }
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Nodes of a range of cells.
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

    /// Fluxes from a cell to the next of its ply.
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
        let mut conductivity_slopes = [R::constant(0.0); 2];
        if stage == 0 {
            let gain = drop * half_over_next_1_m;
            conductivity_slopes = [here.matter.slope * gain, next.matter.slope * gain];
        }
        self.link(cell, here, next, conductance, drop, conductivity_slopes, stage)
    }

    /// Fluxes across the interface above a ply, from the last cell of the ply before.
    #[inline(always)]
    pub(super) fn link_across(&self, p: usize, here: Node<R>, next: Node<R>, stage: usize) -> Link<R> {
        let (cell, rows) = (self.plan.plies[p].first_cell as usize - 1, &self.rows.cells);
        let (below_m, above_m) = (R::still(rows[cell].below_m), R::still(rows[cell + 1].above_m));
        let contact_m2_k_w = self.scales.contacts_m2_k_w[p - 1];
        let conductance =
            conductance_across(here.matter.conductivity, below_m, next.matter.conductivity, above_m, contact_m2_k_w);
        let drop = difference(here.temperature, next.temperature);
        let mut conductivity_slopes = [R::constant(0.0); 2];
        if stage == 0 {
            let own = gain_across(conductance, here.matter.conductivity, below_m) * here.matter.slope;
            let below = gain_across(conductance, next.matter.conductivity, above_m) * next.matter.slope;
            conductivity_slopes = [own * drop, below * drop];
        }
        self.link(cell, here, next, conductance, drop, conductivity_slopes, stage)
    }

    /// Fluxes between two nodes. `conductivity_slopes`: slopes from changing conductivities, at the first stage.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "as its WGSL twin")]
    fn link(
        &self,
        cell: usize,
        here: Node<R>,
        next: Node<R>,
        conductance: R,
        drop: R,
        mut conductivity_slopes: [R; 2],
        stage: usize,
    ) -> Link<R> {
        let mut flux = Link { conducted: conductance * drop, ..no_link() };
        if GAS {
            flux.gained = carried_gain(self.gas.flows[cell], here.gas_j_kg, next.gas_j_kg);
        }
        if stage == 0 {
            if GAS {
                conductivity_slopes =
                    less(conductivity_slopes, carried_slopes(self.gas.flows[cell], here.gas_rise, next.gas_rise));
            }
            flux.slopes = flux_slopes(conductance, conductivity_slopes);
        }
        flux
    }

    /// State of the surface of a face at a stage.
    #[inline(always)]
    pub(super) fn surface(&self, face: usize, cell: usize, stage: usize) -> Surface<R> {
        let temperature_k = self.thermal.temperatures[cell].high + self.moved(cell, stage);
        let at = spot(temperature_k);
        let ply = face * (self.scales.plies.len() - 1);
        let emissivity = self.face_emissivity(face, ply, cell, at, stage);
        let air = segment(&self.rows.tables, at, FACE_COLUMNS, self.plan.face_table());
        Surface { temperature_k, emissivity, enthalpy_j_kg: value(air, 0), rise_j_kg_k: value(air, 1) }
    }

    /// Heat flux from outside into the cell of a face; zero for a held face, whose heat is that conducted onwards.
    #[inline(always)]
    pub(super) fn through(&self, face: usize, forcing: Drive<R::Scalar>, surface: Surface<R>) -> FaceFlux<R> {
        let row = self.rows.faces[face];
        let open = face_flux(
            forcing,
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

    /// Heat flux in through a face at a stage: from outside if open; if held, the heat that its cell passes to the next
    /// cell and to the holder.
    #[inline(always)]
    pub(super) fn passed_through(&self, face: usize, cell: usize, step: usize, stage: usize) -> R {
        let mut conducted_on = self.thermal.passed[face];
        if self.plan.has_holder {
            let forcing = self.rows.drives[4 * step + 2 * face + stage];
            let conductance = self.conductance_sideways(face * (self.scales.plies.len() - 1), cell);
            conducted_on = conducted_on - flux_sideways(conductance, R::of(forcing.holder_k), self.staged(cell, stage));
        }
        self.thermal.edges[face].flux + R::of(self.rows.faces[face].held) * conducted_on
    }
}
