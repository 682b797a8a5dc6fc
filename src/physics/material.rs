//! Properties of a ply scaled by one member's factors, and conductance between nodes.

use super::Real;
use super::compensated::opaque;
use super::table::{TableIndex, TableSegment, interpolate};
use crate::layout::{BulkProperties, ConductivityColumns, Ply, StateProperties};

/// Factors of one member on a ply. A thickness factor f stretches the ply; on the unstretched grid that is conductivity
/// over f and heat capacity times f.
#[derive(Clone, Copy)]
pub struct PlyScale<R> {
    /// Bulk density times the factors on density, heat capacity and thickness, kg/m³.
    pub density_kg_m3: R,
    /// Factor on heat capacity.
    pub heat_capacity: R,
    /// Mass of virgin material per unstretched volume, kg/m³.
    pub mass_kg_m3: R,
    pub thickness: R,
    /// Factors on rate constants, activation energies and heats of reaction.
    pub pre_exponential: R,
    pub activation: R,
    pub pyrolysis_heat: R,
    /// Factor on the mass lost, such that the char yield is scaled by its own factor.
    pub loss: R,
    /// Reciprocal of the mass fraction lost at full conversion.
    pub per_loss: R,
    pub permeability: R,
    /// Conductance to the holder per unstretched volume, W/m³/K.
    pub holder_w_m3_k: R,
}

/// Factors on the parts of a conductivity.
#[derive(Clone, Copy)]
pub struct ConductivityParts<R> {
    pub solid: R,
    pub gas: R,
    pub radiative: R,
}

impl<R: Real> ConductivityParts<R> {
    /// Multiplies the first `parts` parts; the others stay.
    #[inline(always)]
    pub fn times(self, factor: R, parts: usize) -> Self {
        let mut product = Self { solid: factor * self.solid, ..self };
        if parts > 1 {
            product.radiative = factor * self.radiative;
            if parts == 3 {
                product.gas = factor * self.gas;
            }
        }
        product
    }

    /// Adds the first `parts` parts; the others stay.
    #[inline(always)]
    pub fn plus(self, other: Self, parts: usize) -> Self {
        let mut sum = Self { solid: self.solid + other.solid, ..self };
        if parts > 1 {
            sum.radiative = self.radiative + other.radiative;
            if parts == 3 {
                sum.gas = self.gas + other.gas;
            }
        }
        sum
    }
}

impl<R: Real> StateScale<R> {
    /// A residue less the virgin material.
    #[inline(always)]
    pub fn less(self, virgin: Self) -> Self {
        let (own, other) = (self.conductivity, virgin.conductivity);
        Self {
            conductivity: ConductivityParts {
                solid: own.solid - other.solid,
                gas: own.gas - other.gas,
                radiative: own.radiative - other.radiative,
            },
            remains: self.remains - virgin.remains,
            enthalpy_scale: self.enthalpy_scale - virgin.enthalpy_scale,
            formation_j_kg: self.formation_j_kg - virgin.formation_j_kg,
        }
    }
}

/// Factors of one member on a state of a ply, per volume of that state in a mixture.
#[derive(Clone, Copy)]
pub struct StateScale<R> {
    /// Contribution to the conductivity of a mixture; times the mass ratio where properties mix by mass. If extinction
    /// follows density, the factor on density divides the radiative part.
    pub conductivity: ConductivityParts<R>,
    /// Mass ratio to the virgin material, at full replacement.
    pub remains: R,
    /// Enthalpy per virgin mass over that of the table rows read, and formation enthalpy, J/kg.
    pub enthalpy_scale: R,
    pub formation_j_kg: R,
}

/// Position of a pressure among the table levels of a ply: the level below and the fraction towards the next.
#[derive(Clone, Copy)]
pub struct PressureIndex<R: Real> {
    pub level_below: R::Constant,
    pub fraction: R,
}

/// The factors on a ply from a member's columns.
#[inline(always)]
pub fn ply_scale<R: Real>(
    ply: &Ply<u32>,
    bulk: BulkProperties<R::Scalar>,
    char: StateProperties<R::Scalar>,
    column: impl Fn(u32) -> R,
) -> PlyScale<R> {
    let thickness = column(ply.thickness);
    let density = R::splat(bulk.density_kg_m3) * column(ply.density);
    let one = R::from_f64(1.0);
    let remains = R::splat(char.remains);
    // Inert plies lose no mass: avoids 0/0.
    let least = R::from_f64(1e-6);
    let loss = (one - column(ply.char_yield) * remains) / (one - remains).max(least);
    PlyScale {
        density_kg_m3: density * column(ply.heat_capacity) * thickness,
        heat_capacity: column(ply.heat_capacity),
        mass_kg_m3: density * thickness,
        thickness,
        pre_exponential: column(ply.pre_exponential),
        activation: column(ply.activation),
        pyrolysis_heat: column(ply.pyrolysis_heat),
        loss,
        per_loss: one / (loss * (one - remains)).max(least),
        permeability: column(ply.permeability) / thickness,
        holder_w_m3_k: R::splat(bulk.holder_w_m3_k) * column(ply.holder) * thickness,
    }
}

/// The factors on a state of a ply from a member's columns.
#[inline(always)]
pub fn state_scale<R: Real>(
    row: &ConductivityColumns<u32>,
    substance: StateProperties<R::Scalar>,
    bulk: BulkProperties<R::Scalar>,
    ply: PlyScale<R>,
    column: impl Fn(u32) -> R,
) -> StateScale<R> {
    let one = R::from_f64(1.0);
    let remains = opaque(one - ply.loss * (one - R::splat(substance.remains)));
    let weight = if bulk.by_volume == R::scalar(1.0) { one } else { remains };
    let whole = weight * (R::splat(substance.conductivity) * column(row.whole) / ply.thickness);
    StateScale {
        conductivity: ConductivityParts {
            solid: whole * column(row.solid),
            gas: whole * column(row.gas),
            radiative: whole * column(row.radiative) / column(row.extinction),
        },
        remains,
        enthalpy_scale: remains * (ply.heat_capacity * R::splat(substance.heat_capacity)),
        formation_j_kg: remains * R::splat(substance.formation_j_kg),
    }
}

/// The table index in the rows of the pressure level below, and of the next level, of tables with `rows` rows a level.
#[inline(always)]
pub fn at_pressure_levels<R: Real>(at: TableIndex<R>, rows: u32, pressure: PressureIndex<R>) -> [TableIndex<R>; 2] {
    let rows = R::constant_from_f64(f64::from(rows));
    let under = pressure.level_below * rows + at.row;
    [TableIndex { row: under, fraction: at.fraction }, TableIndex { row: under + rows, fraction: at.fraction }]
}

/// Scaled properties of a state of a ply at a temperature: conductivity (W/m/K), its slope (W/m/K²), and heat capacity
/// (J/kg/K).
#[derive(Clone, Copy)]
pub struct SolidProperties<R> {
    pub conductivity: R,
    pub slope: R,
    pub heat_capacity: R,
}

/// Properties of a state from its table row and its conductivity factors; the slope is zero unless asked for.
#[inline(always)]
pub fn solid_properties<R: Real>(
    here: TableSegment<'_, R>,
    parts: usize,
    scale: ConductivityParts<R>,
    with_slope: bool,
) -> SolidProperties<R> {
    let mut conductivity = scale.solid * interpolate(here, 0);
    let mut slope = R::from_f64(0.0);
    if with_slope {
        slope = scale.solid * interpolate(here, 2);
    }
    if parts > 1 {
        if parts == 3 {
            conductivity = conductivity + scale.gas * interpolate(here, 6);
        }
        conductivity = conductivity + scale.radiative * interpolate(here, 4);
        if with_slope {
            if parts == 3 {
                slope = slope + scale.gas * interpolate(here, 7);
            }
            slope = slope + scale.radiative * interpolate(here, 5);
        }
    }
    SolidProperties { conductivity, slope, heat_capacity: interpolate(here, 1) }
}

/// Conductance between neighbouring nodes of one ply, W/m²/K.
///
/// The arithmetic mean is exact for a conductivity linear in temperature, and lets a front enter cold material of
/// vanishing conductivity, where the harmonic mean would stall it.
#[inline(always)]
pub fn conductance_within<R: Real>(conductivity: R, next: R, half_over_next_1_m: R::Constant) -> R {
    (conductivity + next) * half_over_next_1_m
}

/// Conductance between nodes on both sides of an interface, W/m²/K: two half cells and the contact in series.
#[inline(always)]
pub fn conductance_across<R: Real>(conductivity: R, below_m: R, next: R, above_m: R, contact_m2_k_w: R) -> R {
    let both = conductivity * next;
    both / (next * below_m + conductivity * above_m + contact_m2_k_w * both)
}

/// Slope of the conductance across an interface by a node's conductivity, 1/m: `G² l/k²`. Within a ply it is half over
/// the distance.
#[inline(always)]
pub fn conductance_slope_across<R: Real>(conductance: R, conductivity: R, length_m: R) -> R {
    let share = conductance / conductivity;
    share * share * length_m
}

/// Slopes of the flux from a node to its neighbour by the node's temperature and, negated, by the neighbour's, W/m²/K.
/// `conductivity_slopes`: slopes from changing conductivities less those of advection; without them a step is second
/// order on coarse cells only (1.5 on fine ones), and temperature jumps on fine cells diverge. Never negative, so that
/// no pivot vanishes.
#[inline(always)]
pub fn flux_slopes<R: Real>(conductance: R, conductivity_slopes: [R; 2]) -> [R; 2] {
    let zero = R::from_f64(0.0);
    [(conductance + conductivity_slopes[0]).max(zero), (conductance - conductivity_slopes[1]).max(zero)]
}
