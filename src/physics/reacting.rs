//! Pyrolysis reactions: gas sources and heat of reaction of every cell.

use super::GAMMA;
use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::member::Member;
use super::mixing::transferred;
use crate::plan::layout::STATES_MAX;
use std::ops::Range;

/// Share of a cell's heat capacity at which the stiffness damping of its reaction heat is halved.
pub(super) const EASE: f64 = 0.3;

/// Remaining reactant below which a reaction has ended.
pub(super) const LEAST_LEFT: f64 = 1e-9;

/// Stiffness damping of the reaction heat: an implicit term of endothermic reactions, W/m²/K. Without it, steps longer
/// than the time in which reaction heat changes the temperature diverge. The heat added this way is not exactly the
/// heat of reaction, so the term fades at short steps as `x/(x + 0.3)`, x being its ratio to the heat capacity (with 1
/// a few of the most extreme members diverged; with 0 temperature errors were half as large again). Exothermic
/// reactions have none, as it would weaken the diagonal.
#[inline(always)]
pub(super) fn restraint<R: Real>(rises_w_m2_k: R, capacity: R, damping_rate_1_s: R::Still) -> R {
    let stiff = rises_w_m2_k * R::fixed(GAMMA);
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
    pub(super) fn react(&mut self, step: usize, stage: usize) {
        let zero = R::constant(0.0);
        self.reactions.given = zero;
        self.reactions.given_ends = [zero; 2];
        if stage == 0 {
            return;
        }
        let step_length_s = R::still(self.rows.lengths_s[step]);
        // No look-ahead at the end of the march.
        let is_last = step + 1 == self.plan.steps();
        let next_s = if is_last { R::fixed(0.0) } else { R::still(self.rows.lengths_s[step + 1]) };
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.react_cell(p, i, first..end, step_length_s, next_s);
            }
        }
    }

    /// Reactions of a cell over a step, and its composition for the second stage of this step and the first of the
    /// next. Midpoint enthalpies are extrapolated from the start, which keeps the order and needs no table read.
    #[expect(clippy::needless_range_loop, reason = "the WGSL twin has the same loop")]
    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, reactions: Range<usize>, step_length_s: R::Still, next_s: R::Still) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let (scale, ply, states) = (self.scales.plies[p], self.plan.plies[p], self.plan.states);
        let rise_k = self.thermal.first[i] * R::fixed(0.5);
        let temperature_k = self.thermal.temperatures[i].high + rise_k;
        let gas_j_kg = self.gas.gas_j_kg[i] + self.gas.gas_rises[i] * rise_k;
        let is_absolute = self.rows.bulks[p].absolute == R::scalar(1.0);
        let mut state_enthalpies = [zero; STATES_MAX];
        let mut risen_j_kg = self.reactions.risen[i * states][0] + self.reactions.risen[i * states][1] * rise_k;
        for state in 0..STATES_MAX {
            if state < ply.states as usize {
                if state > 0 && ply.rows > 1 {
                    risen_j_kg = self.reactions.risen[i * states + state][0]
                        + self.reactions.risen[i * states + state][1] * rise_k;
                }
                state_enthalpies[state] = self.enthalpy_of(p, state, risen_j_kg);
            }
        }
        let per_kelvin = one / temperature_k;
        let inverse_step_1_s = R::fixed(1.0) / step_length_s;
        let step_ratio = next_s * inverse_step_1_s;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut inflow) = (one, zero);
        let (mut gas_made, mut heat_absorbed, mut solid_released, mut heat_slope) = (zero, zero, zero, zero);
        let (mut second_stage, mut first_stage) = (Self::virgin(), Self::virgin());
        for j in reactions.clone() {
            let index = i * self.plan.reactions + j - reactions.start;
            let reaction = self.rows.reactions[j];
            let steepness = steepness_k * R::still(reaction.activation_k);
            let done = self.reactions.advancements[index];
            let path = self.plan.paths[j];
            let is_chained = reaction.chained == R::scalar(1.0);
            let ahead = if is_chained { before } else { one };
            let mut reactant = keep(keep(ahead - done.high) - done.low);
            if is_chained {
                // On average, half of the inflow of the step is available.
                reactant = reactant + inflow * R::fixed(0.5);
            }
            reactant = reactant.max(zero);
            before = done.high;
            // Two reactions in five have not begun or have ended (benches/LOG.md): their rate is not needed.
            let live = (R::of(reaction.idle) - steepness).reached(zero) * reactant.reached(R::constant(LEAST_LEFT));
            if !live.any() {
                inflow = zero;
                let moved_fraction = done.high * R::still(reaction.share);
                second_stage = transferred(second_stage, path, moved_fraction);
                first_stage = transferred(first_stage, path, moved_fraction);
                continue;
            }
            let exposure = rate(reaction, temperature_k, scale.kinetics, steepness) * step_length_s;
            let share = consumed(reactant, exposure, reaction.order) * live;
            let spent = reactant * share;
            inflow = spent;
            let done = advanced(done, spent);
            self.reactions.advancements[index] = done;
            // Extrapolates this step's advancement, by no more than a stage's share of what is left.
            let lag = spent * R::fixed(GAMMA);
            let lead = (lag * step_ratio).min((one - done.high) * R::fixed(GAMMA));
            second_stage = transferred(second_stage, path, (done.high - lag) * R::still(reaction.share));
            first_stage = transferred(first_stage, path, (done.high + lead) * R::still(reaction.share));
            // Per virgin mass of the cell: gas released, and enthalpy lost by the solid.
            let mut lost = zero;
            for state in 0..STATES_MAX {
                if path.source as usize == state {
                    lost = lost + state_enthalpies[state];
                }
                if path.product as usize == state {
                    lost = lost - state_enthalpies[state];
                }
            }
            let gas = spent * (scale.loss * R::still(reaction.loss));
            lost = spent * (lost * R::still(reaction.share));
            let of_reaction = if is_absolute { gas * gas_j_kg - lost } else { gas * R::still(reaction.heat_j_kg) };
            let heat = scale.pyrolysis_heat * of_reaction;
            gas_made = gas_made + gas;
            heat_absorbed = heat_absorbed + heat;
            solid_released = solid_released + lost;
            heat_slope = heat_slope + heat * ((one - share) * steepness);
        }
        for state in 0..STATES_MAX {
            if state < ply.states as usize {
                self.reactions.phases[0][i * states + state] = first_stage[state];
                self.reactions.phases[1][i * states + state] = second_stage[state];
            }
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::still(self.rows.cells[i].width_m) * inverse_step_1_s;
        let heat_released = keep(keep(gas_made * gas_j_kg - solid_released) - heat_absorbed);
        self.take_stage(
            i,
            flux_kg_m2_s * gas_made,
            flux_kg_m2_s * heat_absorbed,
            (flux_kg_m2_s * heat_released) * R::fixed(2.0),
        );
        self.reactions.restraints[i] = (flux_kg_m2_s * (heat_slope * per_kelvin)).max(zero);
    }

    /// Gas source of a cell at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn made_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.reactions.made_mean[i] } else { self.reactions.made[i] }
    }

    /// Heat absorbed by a cell's reactions at a stage, W/m².
    #[inline(always)]
    pub(super) fn absorbed_at(&self, i: usize, stage: usize) -> R {
        if !GAS {
            return R::constant(0.0);
        }
        if stage == 0 { self.reactions.absorbed_mean[i] } else { self.reactions.absorbed[i] }
    }

    /// Second-stage values from the means of the step, such that both stages have that mean.
    #[inline(always)]
    fn take_stage(&mut self, i: usize, gas_made: R, heat_absorbed: R, heat_released: R) {
        let two = R::fixed(2.0);
        self.reactions.made[i] = gas_made * two - self.reactions.made_mean[i];
        self.reactions.absorbed[i] = heat_absorbed * two - self.reactions.absorbed_mean[i];
        self.reactions.made_mean[i] = gas_made;
        self.reactions.absorbed_mean[i] = heat_absorbed;
        self.reactions.given = self.reactions.given + heat_released;
        if i == 0 {
            self.reactions.given_ends[0] = heat_released;
        }
        if i == self.reactions.made.len() - 1 {
            self.reactions.given_ends[1] = heat_released;
        }
    }
}
