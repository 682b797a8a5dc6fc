//! A member's reactions: what its cells give off, the heat it takes.

use super::GAMMA;
use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::member::Member;
use super::mixing::transferred;
use crate::plan::layout::STATES_MAX;
use std::ops::Range;

/// Share of a cell's capacity at which the restraint of its reactions is half of itself.
pub(super) const EASE: f64 = 0.3;

/// What is left of a reactant when it counts as used up.
pub(super) const LEAST_LEFT: f64 = 1e-9;

/// The reactions' part of the system, where they take up heat. Without it steps longer than a reaction needs to
/// swing the heat it takes blow up. What it adds is not what was lost times the heat of reaction, though, so that it
/// fades where steps are short: by `x/(x + 0.3)` for the share `x` of the capacity it is (with 1 a few of the
/// furthest members blew up, with 0 temperatures were off by half as much again). Of a reaction that gives heat it
/// is left out, as it would take from the diagonal.
#[inline(always)]
pub(super) fn restraint<R: Real>(rises_w_m2_k: R, capacity: R, eased_1_s: R::Still) -> R {
    let stiff = rises_w_m2_k * R::fixed(GAMMA);
    stiff * (stiff / (capacity * eased_1_s + stiff))
}

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// What every cell gives off over a step, and the heat that takes. The first stage takes the mean of the step before;
    /// the second takes rates and enthalpies midway, moves the advancements on and keeps twice the mean of the step less
    /// the first: so that the mean of the stages is just what is lost, however stiff the reaction. (The mean of both ends'
    /// rates is second order too, but twice as far off, and runs away where a step would take a cell to where all is lost
    /// at once. To foretell the first stage from rates at the start costs twice the exponentials and gains nothing. To let it
    /// go on as the last two means went halves the error of nominal members, but of 4,096 of `lcat-2259-pyrolysis` drawn from
    /// the large bounds on 81 cells 82 then run away instead of one, and held within a quarter of the mean still 11.)
    /// Properties see the composition at γ and 1 − γ of the step, which is what γr is for a schedule: with that of the start
    /// and the end the order falls to 1.6.
    #[inline(always)]
    pub(super) fn react(&mut self, step: usize, stage: usize) {
        let zero = R::constant(0.0);
        self.reactions.given = zero;
        self.reactions.given_ends = [zero; 2];
        if stage == 0 {
            return;
        }
        let length_s = R::still(self.rows.lengths_s[step]);
        // The end of the march is seen as it is.
        let is_last = step + 1 == self.plan.steps();
        let next_s = if is_last { R::fixed(0.0) } else { R::still(self.rows.lengths_s[step + 1]) };
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.react_cell(p, i, first..end, length_s, next_s);
            }
        }
    }

    /// The reactions of a cell over a step, and its composition as the second stage of this step sees it and the first of the next.
    /// Enthalpies midway go on straight from those at the start, which keeps the order and reads no table.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, reactions: Range<usize>, length_s: R::Still, next_s: R::Still) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let (scale, ply, states) = (self.scales.plies[p], self.plan.plies[p], self.plan.states);
        let rise_k = self.thermal.first[i] * R::fixed(0.5);
        let temperature_k = self.thermal.temperatures[i].high + rise_k;
        let gas_j_kg = self.gas.gas_j_kg[i] + self.gas.gas_rises[i] * rise_k;
        let is_absolute = self.rows.bulks[p].absolute == R::scalar(1.0);
        let mut held_j_kg = [zero; STATES_MAX];
        let mut risen_j_kg = self.reactions.risen[i * states][0] + self.reactions.risen[i * states][1] * rise_k;
        for state in 0..STATES_MAX {
            if state < ply.states as usize {
                if state > 0 && ply.rows > 1 {
                    risen_j_kg = self.reactions.risen[i * states + state][0]
                        + self.reactions.risen[i * states + state][1] * rise_k;
                }
                held_j_kg[state] = self.enthalpy_of(p, state, risen_j_kg);
            }
        }
        let per_kelvin = one / temperature_k;
        let per_length = R::fixed(1.0) / length_s;
        let growth = next_s * per_length;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut fed) = (one, zero);
        let (mut made, mut absorbed, mut freed, mut rises) = (zero, zero, zero, zero);
        let (mut behind, mut onward) = (Self::virgin(), Self::virgin());
        for j in reactions.clone() {
            let place = i * self.plan.reactions + j - reactions.start;
            let reaction = self.rows.reactions[j];
            let steepness = steepness_k * R::still(reaction.activation_k);
            let done = self.reactions.advancements[place];
            let path = self.plan.paths[j];
            let is_chained = reaction.chained == R::scalar(1.0);
            let ahead = if is_chained { before } else { one };
            let mut reactant = keep(keep(ahead - done.high) - done.low);
            if is_chained {
                // What comes in over the step is there for half of it.
                reactant = reactant + fed * R::fixed(0.5);
            }
            reactant = reactant.max(zero);
            before = done.high;
            // Two reactions in five wait for heat or have nothing left (benches/LOG.md), which is known without their rate.
            let live = (R::of(reaction.idle) - steepness).reached(zero) * reactant.reached(R::constant(LEAST_LEFT));
            if !live.any() {
                fed = zero;
                let moved = done.high * R::still(reaction.share);
                behind = transferred(behind, path, moved);
                onward = transferred(onward, path, moved);
                continue;
            }
            let exposure = rate(reaction, temperature_k, scale.kinetics, steepness) * length_s;
            let share = consumed(reactant, exposure, reaction.order) * live;
            let spent = reactant * share;
            fed = spent;
            let done = advanced(done, spent);
            self.reactions.advancements[place] = done;
            // So far on as they went in this step, but by no more than a stage's share of what is left.
            let lag = spent * R::fixed(GAMMA);
            let lead = (lag * growth).min((one - done.high) * R::fixed(GAMMA));
            behind = transferred(behind, path, (done.high - lag) * R::still(reaction.share));
            onward = transferred(onward, path, (done.high + lead) * R::still(reaction.share));
            // Over the virgin mass of the cell: the gas, and the enthalpy that the solid gave up.
            let mut lost = zero;
            for state in 0..STATES_MAX {
                if path.source as usize == state {
                    lost = lost + held_j_kg[state];
                }
                if path.product as usize == state {
                    lost = lost - held_j_kg[state];
                }
            }
            let gas = spent * (scale.loss * R::still(reaction.loss));
            lost = spent * (lost * R::still(reaction.share));
            let of_reaction = if is_absolute { gas * gas_j_kg - lost } else { gas * R::still(reaction.heat_j_kg) };
            let heat = scale.pyrolysis_heat * of_reaction;
            made = made + gas;
            absorbed = absorbed + heat;
            freed = freed + lost;
            rises = rises + heat * ((one - share) * steepness);
        }
        for state in 0..STATES_MAX {
            if state < ply.states as usize {
                self.reactions.phases[0][i * states + state] = onward[state];
                self.reactions.phases[1][i * states + state] = behind[state];
            }
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::still(self.rows.cells[i].width_m) * per_length;
        let given = keep(keep(made * gas_j_kg - freed) - absorbed);
        self.take_stage(i, flux_kg_m2_s * made, flux_kg_m2_s * absorbed, (flux_kg_m2_s * given) * R::fixed(2.0));
        self.reactions.restraints[i] = (flux_kg_m2_s * (rises * per_kelvin)).max(zero);
    }

    /// Gas that a cell makes at a stage: the mean of the step before, then what makes the mean of both stages that of the step.
    #[inline(always)]
    pub(super) fn made_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.reactions.made_mean[i] } else { self.reactions.made[i] }
    }

    /// Heat that its reactions take up at a stage, likewise.
    #[inline(always)]
    pub(super) fn absorbed_at(&self, i: usize, stage: usize) -> R {
        if !GAS {
            return R::constant(0.0);
        }
        if stage == 0 { self.reactions.absorbed_mean[i] } else { self.reactions.absorbed[i] }
    }

    /// Of the means over a step, what the second stage takes for the mean of both to be that.
    #[inline(always)]
    fn take_stage(&mut self, i: usize, made: R, absorbed: R, given: R) {
        let two = R::fixed(2.0);
        self.reactions.made[i] = made * two - self.reactions.made_mean[i];
        self.reactions.absorbed[i] = absorbed * two - self.reactions.absorbed_mean[i];
        self.reactions.made_mean[i] = made;
        self.reactions.absorbed_mean[i] = absorbed;
        self.reactions.given = self.reactions.given + given;
        if i == 0 {
            self.reactions.given_ends[0] = given;
        }
        if i == self.reactions.made.len() - 1 {
            self.reactions.given_ends[1] = given;
        }
    }
}
