//! The state of a cell, for profiles through the thickness. It has no twin: profiles are marched on the CPU.

use super::Real;
use super::member::Member;
use super::mixture::degree_of_conversion;
use crate::layout::GasTransport;

/// Quantities of a cell.
pub const CELL_QUANTITIES: usize = 3;

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Density of the solid (kg/m³ of the virgin layup), degree of conversion, and gas pressure (Pa; zero without Darcy
    /// flow) of a cell with gas.
    #[inline(always)]
    pub fn cell_state(&self, ply: usize, cell: usize) -> [R; CELL_QUANTITIES] {
        let ratio = R::from_f64(1.0) - self.lost_mass_ratio(ply, cell);
        let scale = self.scales.plies[ply];
        let pressure =
            if self.plan.gas == Some(GasTransport::Darcy) { self.darcy.pressures[cell].high } else { R::from_f64(0.0) };
        [scale.mass_kg_m3 / scale.thickness * ratio, degree_of_conversion(ratio, scale), pressure]
    }
}
