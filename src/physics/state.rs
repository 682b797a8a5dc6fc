//! The state of one or several members: one struct for each part of the physics.

use super::Real;
use super::double_word::DoubleWord;
use super::gas::PoreState;
use super::material::{ConductivityParts, PlyScale, StateScale};
use super::surface_flux::FaceScale;
use crate::layout::{BoundaryForcing, HEAT_TOTALS};
use crate::layout::{GasTransport, PlanData, PlanRows};

/// Factors of the member on plies, contacts, faces and sensors; constant over a march.
pub(super) struct Scales<R: Real> {
    pub(super) plies: Vec<PlyScale<R>>,
    /// Ply × state.
    pub(super) states: Vec<StateScale<R>>,
    /// Contact resistance of each interface, m²K/W.
    pub(super) contacts_m2_k_w: Vec<R>,
    /// Factors of the hot and of the back face.
    pub(super) faces: [FaceScale<R>; 2],
    /// Depth of each sensor less its nominal depth, m; empty where no factor scales a depth.
    pub(super) shifts_m: Vec<R>,
}

/// Properties of a cell.
#[derive(Clone, Copy)]
pub(super) struct CellProperties<R> {
    /// Conductivity at the stage last evaluated, W/m/K.
    pub(super) conductivity: R,
    /// At the first stage the slope of the conductivity, W/m/K²; at the second the heat capacity, J/m²/K. One word for
    /// both, because the columns of all cells exceed a first-level cache.
    pub(super) slope_or_capacity: R,
    /// Heat capacity at the first stage, J/m²/K.
    pub(super) first_capacity: R,
}

impl<R: Real> CellProperties<R> {
    /// Sets the properties at a stage; the slope only at the first.
    #[inline(always)]
    pub(super) fn set(&mut self, conductivity: R, slope: R, capacity: R, stage: usize) {
        self.conductivity = conductivity;
        if stage == 0 {
            (self.slope_or_capacity, self.first_capacity) = (slope, capacity);
        } else {
            self.slope_or_capacity = capacity;
        }
    }
}

/// Contribution of a face to the matrix row of its cell.
#[derive(Clone, Copy)]
pub(super) struct BoundaryRow<R: Real> {
    /// One if the face is held at its schedule, else zero; and the rise of the schedule over the step, K.
    pub(super) held: R::Constant,
    pub(super) rise_k: R::Constant,
    /// Heat flux from outside at this stage and γr, W/m²; γ times the slope of the heat flux, W/m²/K.
    pub(super) flux: R,
    pub(super) rhs_correction: R,
    pub(super) slope: R,
}

/// A cell's matrix row after elimination: lower ratio, reciprocal pivot and upper ratio; and the right-hand side of the
/// stage, W/m², replaced after the second stage by the sum of both increments, K.
///
/// One struct a cell: separate columns need more base addresses than a processor has registers.
#[derive(Clone, Copy)]
pub(super) struct EliminatedRow<R> {
    pub(super) lower_ratio: R,
    pub(super) reciprocal: R,
    pub(super) upper_ratio: R,
    pub(super) rhs_or_increment: R,
}

/// Temperatures and the linear system of a step.
pub(super) struct Thermal<R: Real> {
    /// Temperature of each cell at the start of the step, K.
    pub(super) temperatures: Vec<DoubleWord<R>>,
    pub(super) boundary_rows: [BoundaryRow<R>; 2],
    /// Heat conducted onwards by the cells of both faces at this stage, W/m², and −γ times its slopes by the cell's
    /// temperature and, negated, by that of its neighbour, W/m²/K.
    pub(super) face_conduction: [R; 2],
    pub(super) face_conduction_slopes: [[R; 2]; 2],
    /// Table row offsets of the cells of the current ply, and the fractions towards the next rows.
    pub(super) row_offsets: Vec<R::RowOffset>,
    pub(super) row_fractions: Vec<R>,
    /// Properties of each cell at the stage last evaluated.
    pub(super) properties: Vec<CellProperties<R>>,
    pub(super) system: Vec<EliminatedRow<R>>,
    /// Temperature rise of each cell at the first stage, K.
    pub(super) first_increments: Vec<R>,
    /// Where steps of some ply advance enthalpies: solution of the first stage, which is not the temperature rise; one
    /// where the heat capacity of a cell is reduced to its lower bound, else zero.
    pub(super) first_solution: Vec<R>,
    pub(super) reduced: Vec<R>,
}

impl<R: Real> Thermal<R> {
    /// Size of the columns of a cell.
    pub(super) const BYTES_PER_CELL: usize = size_of::<DoubleWord<R>>()
        + size_of::<R::RowOffset>()
        + size_of::<R>()
        + size_of::<CellProperties<R>>()
        + size_of::<EliminatedRow<R>>()
        + size_of::<R>();
}

/// Sensor readings at the end of the last step, and temperatures of the lagging thermocouple beads, K.
pub(super) struct SensorState<R: Real> {
    pub(super) readings: Vec<DoubleWord<R>>,
    pub(super) beads: Vec<DoubleWord<R>>,
}

/// Factors of a cell's composition on the properties in its table row.
#[derive(Clone, Copy)]
pub(super) struct Mixture<R> {
    pub(super) conductivity: ConductivityParts<R>,
    /// Heat capacity per unstretched volume over that of the row, kg/m³.
    pub(super) density_kg_m3: R,
}

/// Sources of a cell by its reactions.
#[derive(Clone, Copy)]
pub(super) struct CellSources<R> {
    /// Gas source (kg/m²/s) and heat absorbed (W/m²): at the second stage, and mean of the last step.
    pub(super) gas: R,
    pub(super) absorbed_heat: R,
    pub(super) mean_gas: R,
    pub(super) mean_absorbed_heat: R,
    /// Slope of the heat absorbed, by the temperature of the cell, W/m²/K.
    pub(super) heat_slope: R,
}

/// Advancements of the reactions and their sources of gas and heat.
pub(super) struct ReactionState<R: Real> {
    /// Cell × reaction.
    pub(super) advancements: Vec<DoubleWord<R>>,
    /// Stage; cell × state: volume fraction.
    pub(super) phases: [Vec<R>; 2],
    /// Volume fractions at the first stage of the next step, where steps advance enthalpies: such a step needs the
    /// composition at its first stage until its end.
    pub(super) next_phases: Vec<R>,
    /// Cell × state with table rows: enthalpy rise at the first stage (J/kg) and heat capacity (J/kg/K).
    pub(super) enthalpy_rises: Vec<[R; 2]>,
    pub(super) sources: Vec<CellSources<R>>,
    /// Of the current step. Per cell: reciprocal temperature at mid-step, 1/K; cell × reaction: integral of the rate
    /// constant; per cell: mixture at this stage.
    pub(super) per_kelvin: Vec<R>,
    pub(super) exposures: Vec<R>,
    pub(super) mixtures: Vec<Mixture<R>>,
    /// Heat released by reactions beyond the enthalpies they consume, at a stage: in total, and in the end cells, W/m².
    pub(super) released_heat: R,
    pub(super) released_heat_ends: [R; 2],
}

/// Pyrolysis gas, for every flow model.
pub(super) struct GasState<R> {
    /// Enthalpy of the gas in a cell (J/kg) and its slope (J/kg/K).
    pub(super) enthalpies_j_kg: Vec<R>,
    pub(super) heat_capacities: Vec<R>,
    /// Upward mass flux under each cell at a stage, and out of the hot face at each stage, kg/m²/s.
    pub(super) mass_fluxes: Vec<R>,
    pub(super) hot_outflow: [R; 2],
    pub(super) back_outflow: R,
    /// Outflow through the hot face at this stage; means of the last two steps, kg/m²/s.
    pub(super) stage_outflow: R,
    pub(super) recent_outflows: [R; 2],
}

/// Darcy flow: pressures and the linear system of their step.
pub(super) struct DarcyState<R: Real> {
    /// Pa, and their rates, Pa/s.
    pub(super) pressures: Vec<DoubleWord<R>>,
    pub(super) pressure_rates: Vec<R>,
    /// Pores at the start of the step and at its end.
    pub(super) pores: Vec<PoreState<R>>,
    pub(super) pores_at_end: Vec<PoreState<R>>,
    /// Mean fluxes of the last step, kg/m²/s.
    pub(super) mean_mass_fluxes: Vec<R>,
    pub(super) mean_hot_outflow: R,
    pub(super) supply: Vec<R>,
    /// Excess of the gas supply at the first stage over the mean; subtracted at the second.
    pub(super) source_corrections: Vec<R>,
    pub(super) first_stage_fluxes: Vec<R>,
    pub(super) slopes_above: Vec<R>,
    pub(super) slopes_below: Vec<R>,
    pub(super) first_pressure_increments: Vec<R>,
    pub(super) pressure_unknowns: Vec<R>,
    pub(super) pressure_lower: Vec<R>,
    pub(super) pressure_diagonal: Vec<R>,
    pub(super) pressure_upper: Vec<R>,
}

/// Sums over the march: heat, gas, temperature extremes.
pub(super) struct RunningSums<R: Real> {
    /// Hot in, hot out, back in, back out, from the holder, to the holder, J/m².
    pub(super) heat: [DoubleWord<R>; HEAT_TOTALS],
    pub(super) stored_j_m2: R,
    /// Coldest and hottest of each ply, K.
    pub(super) extremes_k: Vec<(R, R)>,
    /// The step on which each lane diverged.
    pub(super) diverged: Vec<Option<usize>>,
    /// Gas through the faces, kg/m²; heat that left with it and heat released by reactions beyond enthalpies, J/m².
    pub(super) gas_in: DoubleWord<R>,
    pub(super) gas_out: DoubleWord<R>,
    pub(super) gas_heat: DoubleWord<R>,
    pub(super) reaction_gain: DoubleWord<R>,
    /// Heat that leaves with the gas at the first stage, W/m².
    pub(super) first_stage_gas_heat: R,
    /// Solid lost and gas stored since the start, kg/m².
    pub(super) lost_and_stored: [R; 2],
}

#[inline(always)]
fn zero_pair<R: Real>() -> DoubleWord<R> {
    DoubleWord::single(R::from_f64(0.0))
}

impl<R: Real> Thermal<R> {
    #[inline(always)]
    pub(super) fn start(plan: &PlanRows, rows: &PlanData<R::Scalar>) -> Self {
        let zero = R::from_f64(0.0);
        let cells = rows.cells.len();
        Self {
            temperatures: rows.cells.iter().map(|cell| DoubleWord::single(R::splat(cell.start_k))).collect(),
            boundary_rows: [BoundaryRow {
                held: R::constant_from_f64(0.0),
                rise_k: R::constant_from_f64(0.0),
                flux: zero,
                rhs_correction: zero,
                slope: zero,
            }; 2],
            face_conduction: [zero; 2],
            face_conduction_slopes: [[zero; 2]; 2],
            row_offsets: vec![R::FIRST_ROW; cells],
            row_fractions: vec![zero; cells],
            properties: vec![
                CellProperties { conductivity: zero, slope_or_capacity: zero, first_capacity: zero };
                cells
            ],
            system: vec![
                EliminatedRow {
                    lower_ratio: zero,
                    reciprocal: zero,
                    upper_ratio: zero,
                    rhs_or_increment: zero
                };
                cells
            ],
            first_increments: vec![zero; cells],
            first_solution: vec![zero; if plan.has_enthalpy_steps { cells } else { 0 }],
            reduced: vec![zero; if plan.has_enthalpy_steps { cells } else { 0 }],
        }
    }
}

impl<R: Real> SensorState<R> {
    #[inline(always)]
    pub(super) fn start(sensors: usize) -> Self {
        Self { readings: vec![zero_pair(); sensors], beads: vec![zero_pair(); sensors] }
    }
}

impl<R: Real> ReactionState<R> {
    /// The initial state of `cells` cells with gas.
    #[inline(always)]
    pub(super) fn start(plan: &PlanRows, cells: usize) -> Self {
        let zero = R::from_f64(0.0);
        let is_virgin = |place: usize| R::from_f64(f64::from(u8::from(place.is_multiple_of(plan.max_states))));
        Self {
            advancements: vec![zero_pair(); plan.cells() * plan.max_reactions],
            phases: [0, 1].map(|_| (0..cells * plan.max_states).map(is_virgin).collect()),
            next_phases: (0..if plan.has_enthalpy_steps { cells * plan.max_states } else { 0 })
                .map(is_virgin)
                .collect(),
            enthalpy_rises: vec![[zero; 2]; cells * plan.max_states],
            sources: vec![
                CellSources {
                    gas: zero,
                    absorbed_heat: zero,
                    mean_gas: zero,
                    mean_absorbed_heat: zero,
                    heat_slope: zero
                };
                cells
            ],
            per_kelvin: vec![zero; cells],
            exposures: vec![zero; cells * plan.max_reactions],
            mixtures: vec![
                Mixture {
                    conductivity: ConductivityParts { solid: zero, gas: zero, radiative: zero },
                    density_kg_m3: zero
                };
                cells
            ],
            released_heat: zero,
            released_heat_ends: [zero; 2],
        }
    }
}

impl<R: Real> GasState<R> {
    /// The initial state of `cells` cells with gas.
    #[inline(always)]
    pub(super) fn start(cells: usize) -> Self {
        let zero = R::from_f64(0.0);
        Self {
            enthalpies_j_kg: vec![zero; cells],
            heat_capacities: vec![zero; cells],
            mass_fluxes: vec![zero; cells],
            hot_outflow: [zero; 2],
            back_outflow: zero,
            stage_outflow: zero,
            recent_outflows: [zero; 2],
        }
    }
}

impl<R: Real> DarcyState<R> {
    /// The initial state, at the pressure outside; empty without Darcy flow.
    #[inline(always)]
    pub(super) fn start(plan: &PlanRows, outside: &BoundaryForcing<R::Scalar>) -> Self {
        let zero = R::from_f64(0.0);
        let cells = if plan.gas == Some(GasTransport::Darcy) { plan.cells() } else { 0 };
        let sealed = PoreState { storage: zero, mobility_s: zero, slip_pa: zero, inertia_m_pa2: zero };
        Self {
            pressures: vec![DoubleWord::single(R::splat(outside.pressure_pa)); cells],
            pressure_rates: vec![zero; cells],
            pores: vec![sealed; cells],
            pores_at_end: vec![sealed; cells],
            mean_mass_fluxes: vec![zero; cells],
            mean_hot_outflow: zero,
            supply: vec![zero; cells],
            source_corrections: vec![zero; cells],
            first_stage_fluxes: vec![zero; cells],
            slopes_above: vec![zero; cells],
            slopes_below: vec![zero; cells],
            first_pressure_increments: vec![zero; cells],
            pressure_unknowns: vec![zero; cells],
            pressure_lower: vec![zero; cells],
            pressure_diagonal: vec![zero; cells],
            pressure_upper: vec![zero; cells],
        }
    }
}

impl<R: Real> RunningSums<R> {
    #[inline(always)]
    pub(super) fn start(plies: usize) -> Self {
        let zero = R::from_f64(0.0);
        Self {
            heat: [zero_pair(); HEAT_TOTALS],
            stored_j_m2: zero,
            extremes_k: vec![(R::from_f64(1e9), zero); plies],
            diverged: vec![None; R::LANES],
            gas_in: zero_pair(),
            gas_out: zero_pair(),
            gas_heat: zero_pair(),
            reaction_gain: zero_pair(),
            first_stage_gas_heat: zero,
            lost_and_stored: [zero; 2],
        }
    }
}
