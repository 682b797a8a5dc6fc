//! Pyrolysis reactions: gas sources and heat of reaction of every cell.

use super::GAMMA;
use super::Real;
use super::compensated::{add_compensated, opaque};
use super::decomposition::{arrhenius_rate, consumed_share};
use super::member::Member;
use super::mixture::transfer_volume;
use crate::plan::layout::MAX_STATES;
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
        let step_length_s = R::constant(self.rows.step_lengths_s[step]);
        // No look-ahead at the end of the march.
        let is_last = step + 1 == self.plan.steps();
        let next_s = if is_last { R::constant_from_f64(0.0) } else { R::constant(self.rows.step_lengths_s[step + 1]) };
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.advance_cell_reactions(p, i, first..end, step_length_s, next_s);
            }
        }
    }

    /// Reactions of a cell over a step, and its composition for the second stage of this step and the first of the
    /// next. Midpoint enthalpies are extrapolated from the start, which keeps the order and needs no table read.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
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
        let (scale, ply, states) = (self.scales.plies[p], self.plan.plies[p], self.plan.max_states);
        let rise_k = self.thermal.first_increments[i] * R::constant_from_f64(0.5);
        let temperature_k = self.thermal.temperatures[i].high + rise_k;
        let gas_j_kg = self.gas.enthalpies_j_kg[i] + self.gas.heat_capacities[i] * rise_k;
        let is_absolute = self.rows.bulk_properties[p].absolute == R::scalar(1.0);
        let mut state_enthalpies = [zero; MAX_STATES];
        let mut risen_j_kg =
            self.reactions.enthalpy_rises[i * states][0] + self.reactions.enthalpy_rises[i * states][1] * rise_k;
        for state in 0..MAX_STATES {
            if state < ply.states as usize {
                if state > 0 && ply.rows > 1 {
                    risen_j_kg = self.reactions.enthalpy_rises[i * states + state][0]
                        + self.reactions.enthalpy_rises[i * states + state][1] * rise_k;
                }
                state_enthalpies[state] = self.state_enthalpy(p, state, risen_j_kg);
            }
        }
        let per_kelvin = one / temperature_k;
        let inverse_step_1_s = R::constant_from_f64(1.0) / step_length_s;
        let step_ratio = next_s * inverse_step_1_s;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut inflow) = (one, zero);
        let (mut gas_made, mut heat_absorbed, mut solid_released, mut heat_slope) = (zero, zero, zero, zero);
        let (mut second_stage, mut first_stage) = (Self::virgin(), Self::virgin());
        for j in reactions.clone() {
            let index = i * self.plan.max_reactions + j - reactions.start;
            let reaction = self.rows.reactions[j];
            let steepness = steepness_k * R::constant(reaction.activation_k);
            let done = self.reactions.advancements[index];
            let path = self.plan.reaction_paths[j];
            let is_chained = reaction.chained == R::scalar(1.0);
            let ahead = if is_chained { before } else { one };
            let mut reactant = opaque(opaque(ahead - done.high) - done.low);
            if is_chained {
                // On average, half of the inflow of the step is available.
                reactant = reactant + inflow * R::constant_from_f64(0.5);
            }
            reactant = reactant.max(zero);
            before = done.high;
            // Two reactions in five have not begun or have ended (benches/LOG.md): their rate is not needed.
            let live =
                (R::splat(reaction.idle) - steepness).ge_mask(zero) * reactant.ge_mask(R::from_f64(REACTANT_MIN));
            if !live.any_nonzero() {
                inflow = zero;
                let moved_fraction = done.high * R::constant(reaction.share);
                second_stage = transfer_volume(second_stage, path, moved_fraction);
                first_stage = transfer_volume(first_stage, path, moved_fraction);
                continue;
            }
            let exposure = arrhenius_rate(reaction, temperature_k, scale.kinetics, steepness) * step_length_s;
            let share = consumed_share(reactant, exposure, reaction.order) * live;
            let spent = reactant * share;
            inflow = spent;
            let done = add_compensated(done, spent);
            self.reactions.advancements[index] = done;
            // Extrapolates this step's advancement, by no more than a stage's share of what is left.
            let lag = spent * R::constant_from_f64(GAMMA);
            let lead = (lag * step_ratio).min((one - done.high) * R::constant_from_f64(GAMMA));
            second_stage = transfer_volume(second_stage, path, (done.high - lag) * R::constant(reaction.share));
            first_stage = transfer_volume(first_stage, path, (done.high + lead) * R::constant(reaction.share));
            // Per virgin mass of the cell: gas released, and enthalpy lost by the solid.
            let mut lost = zero;
            for state in 0..MAX_STATES {
                if path.source as usize == state {
                    lost = lost + state_enthalpies[state];
                }
                if path.product as usize == state {
                    lost = lost - state_enthalpies[state];
                }
            }
            let gas = spent * (scale.loss * R::constant(reaction.loss));
            lost = spent * (lost * R::constant(reaction.share));
            let of_reaction = if is_absolute { gas * gas_j_kg - lost } else { gas * R::constant(reaction.heat_j_kg) };
            let heat = scale.pyrolysis_heat * of_reaction;
            gas_made = gas_made + gas;
            heat_absorbed = heat_absorbed + heat;
            solid_released = solid_released + lost;
            heat_slope = heat_slope + heat * ((one - share) * steepness);
        }
        for state in 0..MAX_STATES {
            if state < ply.states as usize {
                self.reactions.phases[0][i * states + state] = first_stage[state];
                self.reactions.phases[1][i * states + state] = second_stage[state];
            }
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::constant(self.rows.cells[i].width_m) * inverse_step_1_s;
        let heat_released = opaque(opaque(gas_made * gas_j_kg - solid_released) - heat_absorbed);
        self.store_stage_sources(
            i,
            flux_kg_m2_s * gas_made,
            flux_kg_m2_s * heat_absorbed,
            (flux_kg_m2_s * heat_released) * R::constant_from_f64(2.0),
        );
        self.reactions.heat_slopes[i] = (flux_kg_m2_s * (heat_slope * per_kelvin)).max(zero);
    }

    /// Gas source of a cell at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn gas_source_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.reactions.mean_gas_source[i] } else { self.reactions.gas_source[i] }
    }

    /// Heat absorbed by a cell's reactions at a stage, W/m².
    #[inline(always)]
    pub(super) fn absorbed_heat_at(&self, i: usize, stage: usize) -> R {
        if !GAS {
            return R::from_f64(0.0);
        }
        if stage == 0 { self.reactions.mean_absorbed_heat[i] } else { self.reactions.absorbed_heat[i] }
    }

    /// Second-stage values from the means of the step, such that both stages have that mean.
    #[inline(always)]
    fn store_stage_sources(&mut self, i: usize, gas_made: R, heat_absorbed: R, heat_released: R) {
        let two = R::constant_from_f64(2.0);
        self.reactions.gas_source[i] = gas_made * two - self.reactions.mean_gas_source[i];
        self.reactions.absorbed_heat[i] = heat_absorbed * two - self.reactions.mean_absorbed_heat[i];
        self.reactions.mean_gas_source[i] = gas_made;
        self.reactions.mean_absorbed_heat[i] = heat_absorbed;
        self.reactions.released_heat = self.reactions.released_heat + heat_released;
        if i == 0 {
            self.reactions.released_heat_ends[0] = heat_released;
        }
        if i == self.reactions.gas_source.len() - 1 {
            self.reactions.released_heat_ends[1] = heat_released;
        }
    }
}
