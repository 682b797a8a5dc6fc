//! Properties of a ply as one member scales them, and conductance from node to node.

use super::Real;
use super::compensated::keep;
use super::table::{Segment, Spot, value};
use crate::plan::layout::{Bulk, Conduction, Ply, Substance, TABLE_NODES};

/// What one member's factors make of a ply. A thickness factor f stretches the ply; on the unstretched
/// grid that is conductivity over f and heat capacity times f.
#[derive(Clone, Copy)]
pub struct PlyScale<R> {
    /// Bulk density times the factors of all that stores, kg/m³.
    pub density_kg_m3: R,
    /// Heat capacity, and mass of the virgin material in a volume as drawn, kg/m³.
    pub heat_capacity: R,
    pub mass_kg_m3: R,
    pub thickness: R,
    /// Rate constants, activation energies and heats of the reactions.
    pub kinetics: R,
    pub activation: R,
    pub pyrolysis_heat: R,
    /// Of what is lost, so that the char is as much more as its yield.
    pub loss: R,
    /// One over the share of the mass that is lost when all has reacted.
    pub per_loss: R,
    pub permeability: R,
    /// Conductance to the holder in a volume of the unstretched grid, W/m³/K.
    pub holder_w_m3_k: R,
}

/// Scales of the parts of a conductivity.
#[derive(Clone, Copy)]
pub struct Parts<R> {
    pub solid: R,
    pub gas: R,
    pub radiative: R,
}

impl<R: Real> Parts<R> {
    /// So many times as much, of a number of parts; of others what it was.
    #[inline(always)]
    pub fn times(self, many: R, parts: usize) -> Self {
        let mut product = Self { solid: many * self.solid, ..self };
        if parts > 1 {
            product.radiative = many * self.radiative;
            if parts == 3 {
                product.gas = many * self.gas;
            }
        }
        product
    }

    /// The sum, of a number of parts; of others what it was.
    #[inline(always)]
    pub fn plus(self, more: Self, parts: usize) -> Self {
        let mut sum = Self { solid: self.solid + more.solid, ..self };
        if parts > 1 {
            sum.radiative = self.radiative + more.radiative;
            if parts == 3 {
                sum.gas = self.gas + more.gas;
            }
        }
        sum
    }
}

/// What they make of a state of the ply, of which a mixture has so much by volume.
#[derive(Clone, Copy)]
pub struct StateScale<R> {
    /// As it adds to the conductivity of a mixture: where its properties weigh by mass, times what remains. Where extinction is stated by
    /// mass, a factor on density divides the radiative part.
    pub conductivity: Parts<R>,
    /// Mass where it has replaced all the virgin material, over the mass of that.
    pub remains: R,
    /// Its enthalpy over that mass of the virgin material, by that of the rows it is read from, and where those begin, J/kg.
    pub stores: R,
    pub formation_j_kg: R,
}

/// Where a pressure falls among the levels of the tables: the level under it, and the share of the way to the next.
#[derive(Clone, Copy)]
pub struct Level<R: Real> {
    pub under: R::Still,
    pub share: R,
}

/// The scales of a ply from a member's columns.
#[inline(always)]
pub fn ply_scale<R: Real>(
    ply: &Ply<u32>,
    bulk: Bulk<R::Scalar>,
    char: Substance<R::Scalar>,
    column: impl Fn(u32) -> R,
) -> PlyScale<R> {
    let thickness = column(ply.thickness);
    let density = R::of(bulk.density_kg_m3) * column(ply.density);
    let one = R::constant(1.0);
    let remains = R::of(char.remains);
    // Of an inert ply nothing is lost, and its factor divides nothing by nothing.
    let least = R::constant(1e-6);
    let loss = (one - column(ply.char_yield) * remains) / (one - remains).max(least);
    PlyScale {
        density_kg_m3: density * column(ply.heat_capacity) * thickness,
        heat_capacity: column(ply.heat_capacity),
        mass_kg_m3: density * thickness,
        thickness,
        kinetics: column(ply.kinetics),
        activation: column(ply.activation),
        pyrolysis_heat: column(ply.pyrolysis_heat),
        loss,
        per_loss: one / (loss * (one - remains)).max(least),
        permeability: column(ply.permeability) / thickness,
        holder_w_m3_k: R::of(bulk.holder_w_m3_k) * column(ply.holder) * thickness,
    }
}

/// The scales of a state of a ply from a member's columns.
#[inline(always)]
pub fn state_scale<R: Real>(
    row: &Conduction<u32>,
    substance: Substance<R::Scalar>,
    bulk: Bulk<R::Scalar>,
    ply: PlyScale<R>,
    column: impl Fn(u32) -> R,
) -> StateScale<R> {
    let one = R::constant(1.0);
    let remains = keep(one - ply.loss * (one - R::of(substance.remains)));
    let weight = if bulk.by_volume == R::scalar(1.0) { one } else { remains };
    let whole = weight * (R::of(substance.conductivity) * column(row.whole) / ply.thickness);
    StateScale {
        conductivity: Parts {
            solid: whole * column(row.solid),
            gas: whole * column(row.gas),
            radiative: whole * column(row.radiative) / column(row.extinction),
        },
        remains,
        stores: remains * (ply.heat_capacity * R::of(substance.heat_capacity)),
        formation_j_kg: remains * R::of(substance.formation_j_kg),
    }
}

/// The spot in the rows of the level under a pressure, and in those of the next.
#[inline(always)]
pub fn levelled<R: Real>(spot: Spot<R>, level: Level<R>) -> [Spot<R>; 2] {
    let nodes = R::fixed(TABLE_NODES as f64);
    let under = level.under * nodes + spot.row;
    [Spot { row: under, share: spot.share }, Spot { row: under + nodes, share: spot.share }]
}

/// What a state of a ply is like at a temperature: conductivity (W/m/K) and its slope (W/m/K²), as
/// scaled, and heat capacity (J/kg/K).
#[derive(Clone, Copy)]
pub struct Solid<R> {
    pub conductivity: R,
    pub slope: R,
    pub heat_capacity: R,
}

/// A state of a ply by its properties in tables and the scales of its conductivity; the slope on demand, and else nothing.
#[inline(always)]
pub fn solid<R: Real>(here: Segment<'_, R>, parts: usize, scale: Parts<R>, with_slope: bool) -> Solid<R> {
    let mut conductivity = scale.solid * value(here, 0);
    let mut slope = R::constant(0.0);
    if with_slope {
        slope = scale.solid * value(here, 2);
    }
    if parts > 1 {
        if parts == 3 {
            conductivity = conductivity + scale.gas * value(here, 6);
        }
        conductivity = conductivity + scale.radiative * value(here, 4);
        if with_slope {
            if parts == 3 {
                slope = slope + scale.gas * value(here, 7);
            }
            slope = slope + scale.radiative * value(here, 5);
        }
    }
    Solid { conductivity, slope, heat_capacity: value(here, 1) }
}

/// Conductance between neighbouring nodes of one ply, W/m²/K.
///
/// The arithmetic mean makes a conductivity that is linear in temperature exact, and lets a front run into
/// cold material whose conductivity vanishes; the harmonic mean would stall it.
#[inline(always)]
pub fn conductance_within<R: Real>(conductivity: R, next: R, half_over_next_1_m: R::Still) -> R {
    (conductivity + next) * half_over_next_1_m
}

/// Conductance between nodes on the two sides of an interface, W/m²/K: two half cells and the contact in
/// series.
#[inline(always)]
pub fn conductance_across<R: Real>(
    conductivity: R,
    below_m: R::Still,
    next: R,
    above_m: R::Still,
    contact_m2_k_w: R,
) -> R {
    let both = conductivity * next;
    both / (next * below_m + conductivity * above_m + contact_m2_k_w * both)
}

/// What the conductance across an interface gains by a node's conductivity, 1/m: its half cell's share of the
/// resistance, `G² l/k²`. Within a ply the gain is half over the distance.
#[inline(always)]
pub fn gain_across<R: Real>(conductance: R, conductivity: R, length_m: R::Still) -> R {
    let share = conductance / conductivity;
    share * share * length_m
}

/// Slopes of the flux from a node to its neighbour by the node's temperature and, less, by the neighbour's, W/m²/K, with what the flux gains by
/// either as conductivities have slopes of their own, less what gas carries up: without that a step is second order only while cells are coarse
/// (1.5 beyond), and jumps of temperature on fine cells run away. Never negative, so that no pivot vanishes.
#[inline(always)]
pub fn flux_slopes<R: Real>(conductance: R, gained: [R; 2]) -> [R; 2] {
    let zero = R::constant(0.0);
    [(conductance + gained[0]).max(zero), (conductance - gained[1]).max(zero)]
}
