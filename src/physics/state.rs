//! The state of one or several members: one struct for each part of the physics.

use super::Real;
use super::compensated::Pair;
use super::faces::FaceScale;
use super::gas::Porous;
use super::material::{PlyScale, StateScale};
use crate::plan::layout::{Drive, HEATS};
use crate::plan::{GasPath, Plan, layout::Rows};

/// Factors of the member on plies, contacts, faces and sensors; constant over a march.
pub(super) struct Scales<R: Real> {
    pub(super) plies: Vec<PlyScale<R>>,
    /// Ply × state.
    pub(super) states: Vec<StateScale<R>>,
    /// Contact resistance of each interface, m²K/W.
    pub(super) contacts_m2_k_w: Vec<R>,
    /// Hot, back.
    pub(super) faces: [FaceScale<R>; 2],
    /// Depth of each sensor less its nominal depth, m; empty where no factor scales a depth.
    pub(super) shifts_m: Vec<R>,
}

/// Properties of a cell at a stage.
#[derive(Clone, Copy)]
pub(super) struct Matter<R> {
    /// W/m/K, and at the first stage its slope, W/m/K².
    pub(super) conductivity: R,
    pub(super) slope: R,
    /// Heat capacity, J/m²/K.
    pub(super) capacity: R,
}

/// Contribution of a face to the matrix row of its cell.
#[derive(Clone, Copy)]
pub(super) struct Edge<R: Real> {
    /// One if the face is held at its schedule, else zero; and the rise of the schedule over the step, K.
    pub(super) held: R::Still,
    pub(super) rise_k: R::Still,
    /// Heat flux from outside at this stage and γr, W/m²; γ times the slope of the heat flux, W/m²/K.
    pub(super) flux: R,
    pub(super) driven: R,
    pub(super) slope: R,
}

/// A cell's matrix row after elimination: lower ratio, reciprocal pivot and upper ratio; heat capacity of the cell at
/// the first stage, J/m²/K, for the second stage; and the right-hand side of the stage, W/m², replaced after the second
/// stage by the sum of both increments, K.
///
/// One struct a cell: separate columns need more base addresses than a processor has registers.
#[derive(Clone, Copy)]
pub(super) struct Eliminated<R> {
    pub(super) under: R,
    pub(super) reciprocal: R,
    pub(super) over: R,
    pub(super) capacity: R,
    pub(super) second: R,
}

/// Temperatures and the linear system of a step.
pub(super) struct Thermal<R: Real> {
    /// Of each cell at the start of the step, K.
    pub(super) temperatures: Vec<Pair<R>>,
    pub(super) edges: [Edge<R>; 2],
    /// Heat conducted onwards by the cells of both faces at this stage, W/m², and −γ times its slopes by the cell's
    /// temperature and, negated, by that of its neighbour, W/m²/K.
    pub(super) passed: [R; 2],
    pub(super) passed_slopes: [[R; 2]; 2],
    /// Table row offsets of the cells of the current ply, and the fractions towards the next rows.
    pub(super) row_places: Vec<R::Place>,
    pub(super) row_shares: Vec<R>,
    /// Of each cell at the stage last evaluated.
    pub(super) matter: Vec<Matter<R>>,
    pub(super) system: Vec<Eliminated<R>>,
    /// Increment of each cell at the first stage, K.
    pub(super) first: Vec<R>,
}

/// Sensor readings at the end of the last step, and temperatures of the lagging thermocouple beads, K.
pub(super) struct Sensing<R> {
    pub(super) readings: Vec<Pair<R>>,
    pub(super) beads: Vec<Pair<R>>,
}

/// Advancements of the reactions and their sources of gas and heat.
pub(super) struct Reactions<R> {
    /// Cell × reaction.
    pub(super) advancements: Vec<Pair<R>>,
    /// Stage; cell × state: volume fraction.
    pub(super) phases: [Vec<R>; 2],
    /// Cell × state with table rows: enthalpy rise at the first stage (J/kg) and heat capacity (J/kg/K).
    pub(super) risen: Vec<[R; 2]>,
    /// Gas source of a cell (kg/m²/s) and heat absorbed by its reactions (W/m²): at the second stage, and mean of the
    /// last step.
    pub(super) made: Vec<R>,
    pub(super) absorbed: Vec<R>,
    pub(super) made_mean: Vec<R>,
    pub(super) absorbed_mean: Vec<R>,
    /// Slope of the heat absorbed by a cell's reactions, by its temperature, W/m²/K.
    pub(super) restraints: Vec<R>,
    /// Heat released by reactions beyond the enthalpies they consume, at a stage: in total, and in the end cells, W/m².
    pub(super) given: R,
    pub(super) given_ends: [R; 2],
}

/// Pyrolysis gas, for every flow model.
pub(super) struct GasState<R> {
    /// Enthalpy of the gas in a cell (J/kg) and its slope (J/kg/K).
    pub(super) gas_j_kg: Vec<R>,
    pub(super) gas_rises: Vec<R>,
    /// Upward mass flux under each cell at a stage, and out of the hot face at each stage, kg/m²/s.
    pub(super) flows: Vec<R>,
    pub(super) leaving: [R; 2],
    pub(super) back_leaving: R,
    /// Outflow through the hot face at this stage; means of the last two steps, kg/m²/s.
    pub(super) outflow: R,
    pub(super) recent: [R; 2],
}

/// Darcy flow: pressures and the linear system of their step.
pub(super) struct DarcyState<R> {
    /// Pa, and their rates, Pa/s.
    pub(super) pressures: Vec<Pair<R>>,
    pub(super) pressure_rates: Vec<R>,
    /// Pores at the start of the step and at its end.
    pub(super) pores: Vec<Porous<R>>,
    pub(super) later: Vec<Porous<R>>,
    /// Mean fluxes of the last step, kg/m²/s.
    pub(super) mean_flows: Vec<R>,
    pub(super) mean_leaving: R,
    pub(super) supply: Vec<R>,
    /// Excess of the gas supply at the first stage over the mean; subtracted at the second.
    pub(super) surges: Vec<R>,
    pub(super) first_flows: Vec<R>,
    pub(super) slopes_above: Vec<R>,
    pub(super) slopes_below: Vec<R>,
    pub(super) pressed_first: Vec<R>,
    pub(super) pressed_second: Vec<R>,
    pub(super) pressure_lower: Vec<R>,
    pub(super) pressure_diagonal: Vec<R>,
    pub(super) pressure_upper: Vec<R>,
}

/// Sums over the march: heat, gas, temperature extremes.
pub(super) struct Accounts<R> {
    /// Hot in, hot out, back in, back out, from the holder, to the holder, J/m².
    pub(super) heat: [Pair<R>; HEATS],
    pub(super) stored_j_m2: R,
    /// Coldest and hottest of each ply, K.
    pub(super) extremes_k: Vec<(R, R)>,
    /// The step on which each lane diverged.
    pub(super) strayed: Vec<Option<usize>>,
    /// Gas through the faces, kg/m²; heat that left with it and heat released by reactions beyond enthalpies, J/m².
    pub(super) gas_in: Pair<R>,
    pub(super) gas_out: Pair<R>,
    pub(super) gas_heat: Pair<R>,
    pub(super) reaction_gain: Pair<R>,
    /// Heat that leaves with the gas at the first stage, W/m².
    pub(super) stage_heat: R,
    /// Solid lost and gas stored since the start, kg/m².
    pub(super) lost_and_stored: [R; 2],
}

#[inline(always)]
fn none<R: Real>() -> Pair<R> {
    Pair { high: R::constant(0.0), low: R::constant(0.0) }
}

impl<R: Real> Thermal<R> {
    #[inline(always)]
    pub(super) fn start(rows: &Rows<R::Scalar>) -> Self {
        let zero = R::constant(0.0);
        let cells = rows.cells.len();
        Self {
            temperatures: rows.cells.iter().map(|cell| Pair { high: R::of(cell.start_k), low: zero }).collect(),
            edges: [Edge { held: R::fixed(0.0), rise_k: R::fixed(0.0), flux: zero, driven: zero, slope: zero }; 2],
            passed: [zero; 2],
            passed_slopes: [[zero; 2]; 2],
            row_places: vec![R::Place::default(); cells],
            row_shares: vec![zero; cells],
            matter: vec![Matter { conductivity: zero, slope: zero, capacity: zero }; cells],
            system: vec![Eliminated { under: zero, reciprocal: zero, over: zero, capacity: zero, second: zero }; cells],
            first: vec![zero; cells],
        }
    }
}

impl<R: Real> Sensing<R> {
    #[inline(always)]
    pub(super) fn start(sensors: usize) -> Self {
        Self { readings: vec![none(); sensors], beads: vec![none(); sensors] }
    }
}

impl<R: Real> Reactions<R> {
    /// For this many cells with gas.
    #[inline(always)]
    pub(super) fn start(plan: &Plan, cells: usize) -> Self {
        let zero = R::constant(0.0);
        let is_virgin = |place: usize| R::constant(f64::from(u8::from(place.is_multiple_of(plan.states))));
        Self {
            advancements: vec![none(); plan.cells() * plan.reactions],
            phases: [0, 1].map(|_| (0..cells * plan.states).map(is_virgin).collect()),
            risen: vec![[zero; 2]; cells * plan.states],
            made: vec![zero; cells],
            absorbed: vec![zero; cells],
            made_mean: vec![zero; cells],
            absorbed_mean: vec![zero; cells],
            restraints: vec![zero; cells],
            given: zero,
            given_ends: [zero; 2],
        }
    }
}

impl<R: Real> GasState<R> {
    /// For this many cells with gas.
    #[inline(always)]
    pub(super) fn start(cells: usize) -> Self {
        let zero = R::constant(0.0);
        Self {
            gas_j_kg: vec![zero; cells],
            gas_rises: vec![zero; cells],
            flows: vec![zero; cells],
            leaving: [zero; 2],
            back_leaving: zero,
            outflow: zero,
            recent: [zero; 2],
        }
    }
}

impl<R: Real> DarcyState<R> {
    /// At the pressure outside; empty without Darcy flow.
    #[inline(always)]
    pub(super) fn start(plan: &Plan, outside: &Drive<R::Scalar>) -> Self {
        let zero = R::constant(0.0);
        let cells = if plan.gas == Some(GasPath::Darcy) { plan.cells() } else { 0 };
        let sealed = Porous { storage: zero, mobility_s: zero, slip_pa: zero, inertia_m_pa2: zero };
        Self {
            pressures: vec![Pair { high: R::of(outside.pressure_pa), low: zero }; cells],
            pressure_rates: vec![zero; cells],
            pores: vec![sealed; cells],
            later: vec![sealed; cells],
            mean_flows: vec![zero; cells],
            mean_leaving: zero,
            supply: vec![zero; cells],
            surges: vec![zero; cells],
            first_flows: vec![zero; cells],
            slopes_above: vec![zero; cells],
            slopes_below: vec![zero; cells],
            pressed_first: vec![zero; cells],
            pressed_second: vec![zero; cells],
            pressure_lower: vec![zero; cells],
            pressure_diagonal: vec![zero; cells],
            pressure_upper: vec![zero; cells],
        }
    }
}

impl<R: Real> Accounts<R> {
    #[inline(always)]
    pub(super) fn start(plies: usize) -> Self {
        let zero = R::constant(0.0);
        Self {
            heat: [none(); HEATS],
            stored_j_m2: zero,
            extremes_k: vec![(R::constant(1e9), zero); plies],
            strayed: vec![None; R::LANES],
            gas_in: none(),
            gas_out: none(),
            gas_heat: none(),
            reaction_gain: none(),
            stage_heat: zero,
            lost_and_stored: [zero; 2],
        }
    }
}
