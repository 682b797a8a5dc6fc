//! A member's reactions: what its cells give off, the heat it takes.

use super::Real;
use super::compensated::{advanced, keep};
use super::decomposition::{consumed, rate};
use super::member::Member;
use super::step::GAMMA;
use super::table::{integral, spot, value};
use crate::plan::layout::STATES_MAX;

/// Share of a cell's capacity at which the restraint of its reactions is half of itself.
pub(super) const EASE: f64 = 0.3;

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
        self.given = zero;
        self.given_ends = [zero; 2];
        if step == self.plan.steps() {
            self.lead_s = R::fixed(0.0);
            return;
        }
        let length_s = R::still(self.rows.lengths_s[step]);
        let lead_s = length_s * R::fixed(GAMMA);
        self.lead_s = if stage == 0 { lead_s } else { -lead_s };
        if stage == 0 {
            return;
        }
        for p in 0..self.plies.len() {
            let ply = self.plan.plies[p];
            let (first, end) = (ply.first_reaction as usize, ply.end_reaction as usize);
            if end == first {
                continue;
            }
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.react_cell(p, i, first, end, length_s);
            }
        }
    }

    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    fn react_cell(&mut self, p: usize, i: usize, first: usize, end: usize, length_s: R::Still) {
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let scale = self.plies[p];
        let temperature_k = self.temperatures[i].high + self.first[i] * R::fixed(0.5);
        let here = self.row_of(p, spot(temperature_k));
        let gas_j_kg = value(self.gas_of(p, here), 0);
        let absolute = R::still(self.rows.bulks[p].absolute);
        let virgin_j_kg = integral(here, 1);
        let mut held_j_kg = [zero; STATES_MAX];
        for state in 0..STATES_MAX {
            if state < self.plan.plies[p].states as usize {
                held_j_kg[state] = self.remains_of(p, state) * self.enthalpy_of(p, state, here, virgin_j_kg);
            }
        }
        let per_kelvin = one / temperature_k;
        let per_length = R::fixed(1.0) / length_s;
        let steepness_k = scale.activation * per_kelvin;
        let (mut before, mut fed) = (one, zero);
        let (mut made, mut absorbed, mut given, mut rises) = (zero, zero, zero, zero);
        for j in first..end {
            let place = i * self.plan.reactions + j - first;
            let reaction = self.rows.reactions[j];
            let steepness = steepness_k * R::still(reaction.activation_k);
            let exposure = rate(reaction, temperature_k, scale.kinetics, steepness) * length_s;
            let done = self.advancements[place];
            // In a chain what comes in over the step is there for half of it. (Weighted by nothing where there is none, one
            // reaction would wait for the other all the same.)
            let (mut ahead, mut entering) = (one, zero);
            if reaction.chained == R::scalar(1.0) {
                ahead = before;
                entering = fed * R::fixed(0.5);
            }
            let left = keep(keep(ahead - done.high) - done.low);
            let reactant = (left + entering).max(zero);
            let share = consumed(reactant, exposure, reaction.order);
            let spent = reactant * share;
            before = done.high;
            fed = spent;
            self.advancements[place] = advanced(done, spent);
            self.paces[place] = spent * per_length;
            // Over the virgin mass of the cell: the gas, and the enthalpy that it has beyond what the solid gave up.
            let path = self.plan.paths[j];
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
            let risen = gas * gas_j_kg - spent * (lost * R::still(reaction.share));
            let of_reaction = gas * R::still(reaction.heat_j_kg);
            let heat = scale.pyrolysis_heat * (of_reaction + (risen - of_reaction) * absolute);
            made = made + gas;
            absorbed = absorbed + heat;
            given = given + keep(risen - heat);
            rises = rises + heat * ((one - share) * steepness);
        }
        let flux_kg_m2_s = scale.mass_kg_m3 * R::still(self.rows.cells[i].width_m) * per_length;
        self.take_stage(i, flux_kg_m2_s * made, flux_kg_m2_s * absorbed, (flux_kg_m2_s * given) * R::fixed(2.0));
        self.restraints[i] = (flux_kg_m2_s * (rises * per_kelvin)).max(zero);
    }

    /// Gas that a cell makes at a stage: the mean of the step before, then what makes the mean of both stages that of the step.
    #[inline(always)]
    pub(super) fn made_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.made_mean[i] } else { self.made[i] }
    }

    /// Heat that its reactions take up at a stage, likewise.
    #[inline(always)]
    pub(super) fn absorbed_at(&self, i: usize, stage: usize) -> R {
        if stage == 0 { self.absorbed_mean[i] } else { self.absorbed[i] }
    }

    /// Of the means over a step, what the second stage takes for the mean of both to be that.
    #[inline(always)]
    fn take_stage(&mut self, i: usize, made: R, absorbed: R, given: R) {
        let two = R::fixed(2.0);
        self.made[i] = made * two - self.made_mean[i];
        self.absorbed[i] = absorbed * two - self.absorbed_mean[i];
        self.made_mean[i] = made;
        self.absorbed_mean[i] = absorbed;
        self.given = self.given + given;
        if i == 0 {
            self.given_ends[0] = given;
        }
        if i == self.made.len() - 1 {
            self.given_ends[1] = given;
        }
    }
}
