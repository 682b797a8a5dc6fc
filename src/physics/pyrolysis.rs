//! Pyrolysis reactions: gas sources and heat of reaction of every cell.

use super::GAMMA;
use super::Real;
use super::compensated::{add_compensated, difference, opaque};
use super::decomposition::{arrhenius_rate, consumed_share};
use super::double_word::DoubleWord;
use super::member::Member;
use super::mixture::transfer_volume;
use super::state::CellSources;
use crate::layout::{MAX_STATES, ReactionPath};
use std::ops::Range;

/// Share of a cell's heat capacity at which the stiffness damping of its reaction heat is halved.
pub(super) const DAMPING_SHARE: f64 = 0.3;

/// Remaining reactant below which a reaction has ended.
pub(super) const REACTANT_MIN: f64 = 1e-9;

/// Stiffness damping of the reaction heat: an implicit term of endothermic reactions, W/m²/K. Without it, steps longer
/// than the time in which reaction heat changes the temperature diverge. The heat added this way is not exactly the
/// heat of reaction, so the term fades at short steps as `x/(x + 0.3)`, x being its ratio to the heat capacity (with 1
/// a few of the most extreme members diverged; with 0 temperature errors were half as large again). Exothermic
/// reactions have none, as it would weaken the diagonal.
#[inline(always)]
pub(super) fn stiffness_damping<R: Real>(rises_w_m2_k: R, capacity: R, damping_rate_1_s: R::Constant) -> R {
    let stiff = rises_w_m2_k * R::constant_from_f64(GAMMA);
    stiff * (stiff / (capacity * damping_rate_1_s + stiff))
}

/// Difference of the advancements of a reaction and of the one before: the remaining reactant.
#[inline(always)]
fn remaining<R: Real>(before: R, done: DoubleWord<R>) -> R {
    difference(DoubleWord::single(before), done)
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Evaluates gas sources and reaction heat of every cell. The first stage uses the mean of the previous step. The
    /// second evaluates rates and enthalpies at the midpoint, advances the reactions, and uses twice the mean of the
    /// step less the first stage. The mean of both stages is then exactly what reacted, however stiff the reaction.
    ///
    /// Alternatives tried: the mean of the rates at both ends is second order with twice the error, and diverges where
    /// a step would take a cell to full conversion at once. Predicting the first stage from rates at the start doubles
    /// the exponentials without gain. Extrapolating the last two means halves the error of nominal members, but of
    /// 4,096 members of `lcat-2259-pyrolysis` in the large bounds on 81 cells 82 diverge instead of one (11 if limited
    /// to a quarter of the mean).
    ///
    /// Properties use the composition at γ and 1 − γ of the step, as γr does for a schedule; with those at the start
    /// and the end the order falls to 1.6.
    #[inline(always)]
    pub(super) fn advance_reactions(&mut self, step: usize, stage: usize) {
        let zero = R::from_f64(0.0);
        self.reactions.released_heat = zero;
        self.reactions.released_heat_ends = [zero; 2];
        if stage == 0 {
            return;
        }
        let step_length_s = self.step_length_s(step);
        // No look-ahead at the end of the march.
        let is_last = step + 1 == self.plan.steps();
        let next_s = if is_last { R::constant_from_f64(0.0) } else { self.step_length_s(step + 1) };
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            self.reaction_exposures(p, step_length_s);
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.advance_cell_reactions(p, i, first..end, step_length_s, next_s);
            }
        }
    }

    /// Evaluates the integrals of the rate constants over a step, zero where a reaction is negligible, for all cells of
    /// a ply. In a pass of their own the exponentials of several cells overlap; within
    /// [`advance_cell_reactions`](Self::advance_cell_reactions) they would wait for each other.
    #[inline(always)]
    fn reaction_exposures(&mut self, p: usize, step_length_s: R::Constant) {
        let (zero, one, half) = (R::from_f64(0.0), R::from_f64(1.0), R::constant_from_f64(0.5));
        let (scale, ply, stride) = (self.scales.plies[p], self.plan.plies[p], self.plan.max_reactions);
        let cells = ply.first_cell as usize..ply.end_cell as usize;
        let temperatures = &self.thermal.temperatures[cells.clone()];
        let first = &self.thermal.first_increments[cells.clone()][..temperatures.len()];
        let per_kelvin = &mut self.reactions.per_kelvin[cells.clone()][..temperatures.len()];
        for i in 0..temperatures.len() {
            per_kelvin[i] = one / (temperatures[i].high + first[i] * half);
        }
        let scaled_step_s = scale.pre_exponential * step_length_s;
        let advancements = &self.reactions.advancements[cells.start * stride..cells.end * stride];
        let exposures = &mut self.reactions.exposures[cells.start * stride..cells.end * stride];
        for j in 0..(ply.end_reaction - ply.first_reaction) as usize {
            let reaction = self.rows.reactions[ply.first_reaction as usize + j];
            for i in 0..temperatures.len() {
                let steepness = scale.activation * per_kelvin[i] * R::constant(reaction.activation_k);
                // Two reactions in five have not begun or have ended (benches/LOG.md): their rate is not needed.
                let mut live = (R::splat(reaction.idle) - steepness).ge_mask(zero);
                // The reactant of a chained reaction depends on the step of the reaction before.
                if reaction.chained == R::scalar(0.0) {
                    live = live * remaining(one, advancements[i * stride + j]).ge_mask(R::from_f64(REACTANT_MIN));
                }
                let mut exposure = zero;
                if live.any_nonzero() {
                    let temperature_k = temperatures[i].high + first[i] * half;
                    exposure = arrhenius_rate(reaction, temperature_k, scaled_step_s, steepness) * live;
                }
                exposures[i * stride + j] = exposure;
            }
        }
    }

    /// Enthalpies of the states of a cell's ply at the midpoint of a step, J/kg, extrapolated from the start, which
    /// keeps the order and needs no table read.
    #[inline(always)]
    fn midpoint_enthalpies(&self, p: usize, i: usize, rise_k: R) -> [R; MAX_STATES] {
        let (ply, states) = (&self.plan.plies[p], self.plan.max_states);
        let rises = &self.reactions.enthalpy_rises[i * states..(i + 1) * states];
        let mut enthalpies_j_kg = [R::from_f64(0.0); MAX_STATES];
        let mut risen_j_kg = rises[0][0] + rises[0][1] * rise_k;
        for state in 0..MAX_STATES {
            if state < ply.states as usize {
                if state > 0 && ply.rows > 1 {
                    risen_j_kg = rises[state][0] + rises[state][1] * rise_k;
                }
                enthalpies_j_kg[state] = self.state_enthalpy(p, state, risen_j_kg);
            }
        }
        enthalpies_j_kg
    }

    /// Stores the composition of a cell for the second stage of a step and for the first of the next.
    #[inline(always)]
    fn store_phases(&mut self, p: usize, i: usize, second_stage: [R; MAX_STATES], first_stage: [R; MAX_STATES]) {
        let (ply, states) = (&self.plan.plies[p], self.plan.max_states);
        let [current_phases, second_phases] = &mut self.reactions.phases;
        let next_phases = if self.plan.has_enthalpy_steps { &mut self.reactions.next_phases } else { current_phases };
        let first_phases = &mut next_phases[i * states..(i + 1) * states];
        let second_phases = &mut second_phases[i * states..(i + 1) * states];
        for state in 0..MAX_STATES {
            if state < ply.states as usize {
                first_phases[state] = first_stage[state];
                second_phases[state] = second_stage[state];
            }
        }
    }

    /// Replaces the composition of the first stage by that of the next step, at the end of a step that advances
    /// enthalpies.
    #[inline(always)]
    pub(super) fn adopt_next_phases(&mut self) {
        std::mem::swap(&mut self.reactions.phases[0], &mut self.reactions.next_phases);
    }

    /// Reactions of a cell over a step, and its composition for the second stage of this step and the first of the
    /// next. What all reactions have in common multiplies their sums.
    #[inline(always)]
    fn advance_cell_reactions(
        &mut self,
        p: usize,
        i: usize,
        reactions: Range<usize>,
        step_length_s: R::Constant,
        next_s: R::Constant,
    ) {
        let (zero, one) = (R::from_f64(0.0), R::from_f64(1.0));
        let (scale, ply) = (self.scales.plies[p], &self.plan.plies[p]);
        let rise_k = self.thermal.first_increments[i] * R::constant_from_f64(0.5);
        let gas_j_kg = self.gas.enthalpies_j_kg[i] + self.gas.heat_capacities[i] * rise_k;
        let is_absolute = self.rows.bulk_properties[p].absolute == R::scalar(1.0);
        let state_enthalpies = self.midpoint_enthalpies(p, i, rise_k);
        let per_kelvin = self.reactions.per_kelvin[i];
        let inverse_step_1_s = R::constant_from_f64(1.0) / step_length_s;
        let step_ratio = next_s * inverse_step_1_s;
        let steepness_k = scale.activation * per_kelvin;
        let released_j_kg = scale.loss * gas_j_kg;
        let (mut before, mut inflow) = (one, zero);
        let (mut gas_sum, mut heat_sum, mut solid_released, mut slope_sum) = (zero, zero, zero, zero);
        let (mut second_stage, mut first_stage) = (Self::virgin(), Self::virgin());
        let paths = &self.plan.reaction_paths[reactions.clone()];
        let rows = &self.rows.reactions[reactions][..paths.len()];
        let exposures = &self.reactions.exposures[i * self.plan.max_reactions..][..paths.len()];
        let advancements = &mut self.reactions.advancements[i * self.plan.max_reactions..][..paths.len()];
        // In a ply of two states every reaction turns virgin material into char: one sum a stage is enough.
        let has_one_path = ply.states == 2;
        let (mut second_stage_transfer, mut first_stage_transfer) = (zero, zero);
        for j in 0..paths.len() {
            let (reaction, path, done, exposure) = (rows[j], paths[j], advancements[j], exposures[j]);
            let (mut lag, mut lead) = (done.high, done.high);
            let (ahead, supply) = (before, inflow);
            (before, inflow) = (done.high, zero);
            if exposure.any_nonzero() {
                let mut reactant = remaining(one, done);
                if reaction.chained == R::scalar(1.0) {
                    // On average, half of the inflow of the step is available.
                    reactant = remaining(ahead, done) + supply * R::constant_from_f64(0.5);
                }
                reactant = reactant.max(zero);
                let mut share = consumed_share(reactant, exposure, reaction.order);
                if reaction.chained == R::scalar(1.0) {
                    share = share * reactant.ge_mask(R::from_f64(REACTANT_MIN));
                }
                let spent = reactant * share;
                inflow = spent;
                let done = add_compensated(done, spent);
                advancements[j] = done;
                // Extrapolates this step's advancement, by no more than a stage's share of what is left.
                let behind = spent * R::constant_from_f64(GAMMA);
                lag = done.high - behind;
                lead = done.high + (behind * step_ratio).min((one - done.high) * R::constant_from_f64(GAMMA));
                // Per virgin mass of the cell: gas released, and enthalpy lost by the solid.
                let gas = spent * R::constant(reaction.loss);
                let fall_j_kg = state_enthalpies[path.source as usize] - state_enthalpies[path.product as usize];
                let lost = spent * R::constant(reaction.share) * fall_j_kg;
                let heat = if is_absolute { gas * released_j_kg - lost } else { gas * R::constant(reaction.heat_j_kg) };
                gas_sum = gas_sum + gas;
                heat_sum = heat_sum + heat;
                solid_released = solid_released + lost;
                slope_sum = slope_sum + heat * ((one - share) * R::constant(reaction.activation_k));
            }
            let (lag, lead) = (lag * R::constant(reaction.share), lead * R::constant(reaction.share));
            if has_one_path {
                second_stage_transfer = second_stage_transfer + lag;
                first_stage_transfer = first_stage_transfer + lead;
            } else {
                second_stage = transfer_volume(second_stage, path, lag);
                first_stage = transfer_volume(first_stage, path, lead);
            }
        }
        if has_one_path {
            let path = ReactionPath { source: 0, product: 1 };
            second_stage = transfer_volume(second_stage, path, second_stage_transfer);
            first_stage = transfer_volume(first_stage, path, first_stage_transfer);
        }
        self.store_phases(p, i, second_stage, first_stage);
        let gas_made = scale.loss * gas_sum;
        let heat_scale = if is_absolute { scale.pyrolysis_heat } else { scale.pyrolysis_heat * scale.loss };
        let heat_absorbed = heat_scale * heat_sum;
        let flux_kg_m2_s = scale.mass_kg_m3 * self.cell_width_m(i) * inverse_step_1_s;
        let heat_released = opaque(opaque(gas_made * gas_j_kg - solid_released) - heat_absorbed);
        let heat_slope = flux_kg_m2_s * (heat_scale * slope_sum * (steepness_k * per_kelvin));
        self.store_stage_sources(
            i,
            flux_kg_m2_s * gas_made,
            flux_kg_m2_s * heat_absorbed,
            (flux_kg_m2_s * heat_released) * R::constant_from_f64(2.0),
            heat_slope.max(zero),
        );
    }

    /// Gas source of a cell at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn gas_source_at(&self, i: usize, stage: usize) -> R {
        let sources = &self.reactions.sources[i];
        if stage == 0 { sources.mean_gas } else { sources.gas }
    }

    /// Heat absorbed by a cell's reactions at a stage, W/m².
    #[inline(always)]
    pub(super) fn absorbed_heat_at(&self, i: usize, stage: usize) -> R {
        if !GAS {
            return R::from_f64(0.0);
        }
        let sources = &self.reactions.sources[i];
        if stage == 0 { sources.mean_absorbed_heat } else { sources.absorbed_heat }
    }

    /// Second-stage values from the means of the step, such that both stages have that mean.
    #[inline(always)]
    fn store_stage_sources(&mut self, i: usize, gas_made: R, heat_absorbed: R, heat_released: R, heat_slope: R) {
        let two = R::constant_from_f64(2.0);
        let last = self.reactions.sources.len() - 1;
        let sources = &mut self.reactions.sources[i];
        *sources = CellSources {
            gas: gas_made * two - sources.mean_gas,
            absorbed_heat: heat_absorbed * two - sources.mean_absorbed_heat,
            mean_gas: gas_made,
            mean_absorbed_heat: heat_absorbed,
            heat_slope,
        };
        self.reactions.released_heat = self.reactions.released_heat + heat_released;
        if i == 0 {
            self.reactions.released_heat_ends[0] = heat_released;
        }
        if i == last {
            self.reactions.released_heat_ends[1] = heat_released;
        }
    }
}
