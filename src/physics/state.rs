//! The state of a member, or of several in lanes: one struct for each part of the physics.

use super::Real;
use super::compensated::Pair;
use super::faces::FaceScale;
use super::gas::Porous;
use super::material::{PlyScale, StateScale};
use crate::plan::layout::{Drive, HEATS};
use crate::plan::{GasPath, Plan, layout::Rows};

/// What the member's factors make of plies, contacts, faces and sensors; constant through a march.
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

/// What a face adds to the matrix row of its cell.
#[derive(Clone, Copy)]
pub(super) struct Edge<R: Real> {
    /// One where the face follows its schedule, and the rise of that over the step, K.
    pub(super) held: R::Still,
    pub(super) rise_k: R::Still,
    /// Heat flux from outside at this stage; γr, W/m²; γ times the slope of the heat flux, W/m²/K.
    pub(super) flux: R,
    pub(super) driven: R,
    pub(super) slope: R,
}

/// A cell's matrix row after elimination: the ratio below the diagonal, the reciprocal of the pivot, the ratio above
/// the diagonal; the heat capacity of the cell at the first stage, J/m²/K, which the second stage reads; and the
/// right-hand side of the stage, W/m², replaced after the second stage by the sum of both increments, K.
///
/// The fields of a cell lie side by side: separate columns need more base addresses than a processor has registers.
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
    /// Heat that the cells of both faces conduct onwards at this stage, W/m², and −γ times its slopes: by the cell's
    /// temperature and, with the opposite sign, by that of its neighbour, W/m²/K.
    pub(super) passed: [R; 2],
    pub(super) passed_slopes: [[R; 2]; 2],
    /// Where the table rows of the cells of the current ply begin, and the fractions of the way to the next rows.
    pub(super) row_places: Vec<R::Place>,
    pub(super) row_shares: Vec<R>,
    /// Of each cell at the stage last evaluated.
    pub(super) matter: Vec<Matter<R>>,
    pub(super) system: Vec<Eliminated<R>>,
    /// Increment of each cell at the first stage, K.
    pub(super) first: Vec<R>,
}

/// Sensor readings at the end of the last step, and the thermocouple beads that lag behind them, K.
pub(super) struct Sensing<R> {
    pub(super) readings: Vec<Pair<R>>,
    pub(super) beads: Vec<Pair<R>>,
}

/// Advancement of the reactions and what they release.
pub(super) struct Reactions<R> {
    /// Cell × reaction.
    pub(super) advancements: Vec<Pair<R>>,
    /// Stage; cell × state: its share of the volume.
    pub(super) phases: [Vec<R>; 2],
    /// Cell × state that has table rows: the rise of its enthalpy at the first stage (J/kg) and its heat capacity
    /// (J/kg/K).
    pub(super) risen: Vec<[R; 2]>,
    /// Gas that a cell makes (kg/m²/s) and heat that its reactions absorb (W/m²): at the second stage, and the mean of
    /// the last step.
    pub(super) made: Vec<R>,
    pub(super) absorbed: Vec<R>,
    pub(super) made_mean: Vec<R>,
    pub(super) absorbed_mean: Vec<R>,
    /// Slope of the heat that the reactions of a cell absorb, by its temperature, W/m²/K.
    pub(super) restraints: Vec<R>,
    /// Heat that reactions release beyond the enthalpies they consume, at a stage: in all, and in the end cells, W/m².
    pub(super) given: R,
    pub(super) given_ends: [R; 2],
}

/// Pyrolysis gas, whatever drives it.
pub(super) struct GasState<R> {
    /// Enthalpy of the gas in a cell (J/kg) and its slope (J/kg/K).
    pub(super) gas_j_kg: Vec<R>,
    pub(super) gas_rises: Vec<R>,
    /// Flux up through the face under each cell at a stage, and out of the hot face at either stage, kg/m²/s.
    pub(super) flows: Vec<R>,
    pub(super) leaving: [R; 2],
    pub(super) back_leaving: R,
    /// Out of the hot face at this stage; means of the last two steps.
    pub(super) outflow: R,
    pub(super) recent: [R; 2],
}

/// Gas driven by Darcy's law: pressures and the linear system of their step.
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
    /// By how much the supply of the first stage exceeds the mean, and that of the second falls short of it.
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

/// Sums over the march: heat, gas, extremes.
pub(super) struct Accounts<R> {
    /// Hot in, hot out, back in, back out, from the holder, to the holder, J/m².
    pub(super) heat: [Pair<R>; HEATS],
    pub(super) stored_j_m2: R,
    /// Coldest and hottest of each ply, K.
    pub(super) extremes_k: Vec<(R, R)>,
    /// The step on which each lane diverged.
    pub(super) strayed: Vec<Option<usize>>,
    /// Gas through the faces, kg/m²; heat that it took along and that reactions released beyond enthalpies, J/m².
    pub(super) gas_in: Pair<R>,
    pub(super) gas_out: Pair<R>,
    pub(super) gas_heat: Pair<R>,
    pub(super) reaction_gain: Pair<R>,
    /// Heat that gas takes out at the first stage, W/m².
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
    /// Of so many cells that hold gas.
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
    /// Of so many cells that hold gas.
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
    /// At the pressure outside; of no cells where no gas flows by Darcy's law.
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
