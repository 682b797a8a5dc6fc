//! A member's gas: how it flows through the layup and the heat it carries.
//!
//! Gas flows from cell to cell in lengths of a step with the temperatures of its two ends known, so that
//! pressure has its own pair of stages between those of temperature:
//!
//! ```text
//! (S*/Δt + γB) δ₁ = G(p) + m + r
//! (S*/Δt + γB) δ₂ = G(p + δ₁) + m − r − 2 S*/Δt δ₁
//! p' = p + 3/2 δ₁ + 1/2 δ₂
//! ```
//!
//! with S mass over pressure, B what a pressure drives out of its cell and m what is made, less `p (S* − S)/Δt`. Then
//! `S*p' − Sp` is exactly what flowed in and was made. r is by how much m and the mobilities' part in G are ahead of
//! their mean at γ of the step, told by the step before: without it a pressure that settles within a step settles to
//! what was made midway, half a step late. Both stages take the mobilities midway: in a stiff flow whose mobility changes
//! from stage to stage the scheme would answer a disturbance by −4 times that change. Heat takes the mean flux of
//! the step, its first stage that of the step before: a flux at an instant would magnify what little a pressure is
//! off its balance by all the ease of the flow.

use super::Real;
use super::compensated::{Pair, advanced, difference, keep, raised};
use super::gas::{GasFlux, Porous, gas_flux, midway};
use super::member::Member;
use super::mixing::stretch_of;
use super::table::{spot, value};
use super::tridiagonal::{factorise, substitute};
use crate::plan::GasPath;
use crate::plan::layout::STATES_MAX;

/// γ of the pressures' pair: the other root of 2γ² − 4γ + 1 = 0, as stable as the lesser one of the temperatures and
/// with some times its error. Its first stage keeps the sign of what it damps, (γ − 1)/γ, where the lesser one
/// overshoots by −2.4: gas that runs into all but empty pores, whose ease is the pressure's own, would be driven below
/// nothing and the member stray (J. Verwer, E. Spee, J. Blom, W. Hundsdorfer, 1999).
pub(super) const PRESSURE_GAMMA: f64 = 1.0 + std::f64::consts::FRAC_1_SQRT_2;

/// Gas flux per pascal under which nothing passes, kg/m²/s/Pa: sealed plies have none, and the tightest that let gas through 1e-18 and more.
pub(super) const LEAST_PASSING: f64 = 1e-30;

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Gas up through the face under every cell and through the hot face at a stage, kg/m²/s.
    #[inline(always)]
    pub(super) fn flow(&mut self, step: usize, stage: usize) {
        if self.plan.gas == Some(GasPath::Darcy) {
            if stage == 0 {
                self.settle(step);
            } else {
                self.percolate(step);
            }
            return;
        }
        let carries = R::fixed(if self.plan.gas == Some(GasPath::QuasiSteady) { 1.0 } else { 0.0 });
        let mut risen = R::constant(0.0);
        for from_back in 0..self.scales.plies.len() {
            let p = self.scales.plies.len() - 1 - from_back;
            let ply = self.plan.plies[p];
            for up in 0..(ply.end_cell - ply.first_cell) as usize {
                let i = ply.end_cell as usize - 1 - up;
                let here = self.made_at(i, stage);
                self.gas.flows[i] = risen * carries;
                risen = risen + here;
            }
        }
        self.gas.leaving[stage] = risen;
        if stage == 1 {
            let mean = R::constant(0.5) * (self.gas.leaving[0] + self.gas.leaving[1]);
            self.let_out(step, mean, R::constant(0.0));
        }
    }

    /// Take gas that left through the faces into the accounts.
    #[inline(always)]
    fn let_out(&mut self, step: usize, hot_kg_m2_s: R, back_kg_m2_s: R) {
        let length_s = R::of(self.rows.lengths_s[step]);
        self.pass_out(hot_kg_m2_s * length_s, back_kg_m2_s * length_s);
        self.gas.recent = [self.gas.recent[1], hot_kg_m2_s];
    }

    /// Add gas that passed the faces outward to what went out, or to what came in.
    #[inline(always)]
    fn pass_out(&mut self, hot_kg_m2: R, back_kg_m2: R) {
        let zero = R::constant(0.0);
        self.accounts.gas_in = advanced(self.accounts.gas_in, (-hot_kg_m2).max(zero) + (-back_kg_m2).max(zero));
        self.accounts.gas_out = advanced(self.accounts.gas_out, hot_kg_m2.max(zero) + back_kg_m2.max(zero));
    }

    /// Gas in the pores of a cell at `T + Δ₁`.
    #[expect(clippy::needless_range_loop, reason = "the twin in WGSL runs over the same indices")]
    #[inline(always)]
    pub(super) fn porous(&self, p: usize, i: usize, stage: usize) -> Porous<R> {
        let ply = &self.plan.plies[p];
        let temperature_k = self.thermal.temperatures[i].high + self.moved(i, stage);
        let at = spot(temperature_k);
        let gas = self.gas_of(p, self.row_of(p, at));
        let (molar_kg_k_j, viscosity_pa_s) = (value(gas, 2), value(gas, 3));
        let phases = self.phases_of(p, i);
        let stretch = stretch_of(self.mass_left(p, phases), self.scales.plies[p], self.rows.bulks[p]);
        let zero = R::constant(0.0);
        let (mut porosity, mut permeability, mut slip, mut inertia) = (zero, zero, zero, zero);
        for state in 0..STATES_MAX {
            if state >= ply.states as usize {
                break;
            }
            let row = self.rows.substances[ply.first_state as usize + state];
            porosity = porosity + phases[state] * R::of(row.porosity);
            permeability = permeability + phases[state] * R::of(row.permeability_m2);
            slip = slip + phases[state] * R::of(row.slip_pa_k);
            inertia = inertia + phases[state] * R::of(row.inertia_1_m);
        }
        let ease = self.scales.plies[p].permeability * permeability / (viscosity_pa_s * stretch);
        let density_s2_m2 = molar_kg_k_j / temperature_k;
        let volume_m = R::of(self.rows.cells[i].width_m) * self.scales.plies[p].thickness * stretch;
        Porous {
            // A sealed cell holds next to nothing, which keeps its pivot from vanishing.
            storage: (volume_m * porosity * density_s2_m2).max(R::constant(1e-18)),
            mobility_s: ease * density_s2_m2,
            slip_pa: slip * temperature_k,
            inertia_m_pa2: R::constant(4.0) * inertia * ease * ease * density_s2_m2,
        }
    }

    /// Pores at the start of a step. What a cell holds and its pressure stay as the step before left them, and with them
    /// their ratio: that the end was foretold a little too hot or too cold goes into how the next step expands, where it
    /// cancels against what that is off by. (Pressures put right at once were off by the first order of a step.)
    #[inline(always)]
    fn settle(&mut self, step: usize) {
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                let held = self.darcy.pores[i].storage;
                self.gas.flows[i] = self.darcy.mean_flows[i];
                self.darcy.pores[i] = self.porous(p, i, 0);
                if step > 0 {
                    self.darcy.pores[i].storage = held;
                }
            }
        }
        self.gas.leaving[0] = self.darcy.mean_leaving;
        self.face_pressures(step);
    }

    /// Put the cells of open faces on the pressure outside, which may jump between steps; what that takes comes in.
    #[inline(always)]
    fn face_pressures(&mut self, step: usize) {
        let last = self.darcy.pressures.len() - 1;
        let none = R::constant(0.0);
        for (cell, drive, is_open) in [(0, 4 * step, true), (last, 4 * step + 2, self.plan.back_is_open)] {
            if is_open {
                let outside = Pair { high: R::of(self.rows.drives[drive].pressure_pa), low: none };
                let taken = self.darcy.pores[cell].storage * difference(self.darcy.pressures[cell], outside);
                self.pass_out(taken, none);
                self.darcy.pressures[cell] = outside;
            }
        }
    }

    /// Flux up through the face under a cell, at pressures `p + δ₁`, and pores midway through the step or, for what their
    /// change does to it, at the end.
    #[inline(always)]
    fn gas_under(&self, i: usize, at_end: bool) -> GasFlux<R> {
        let (above_m, below_m) = (R::of(self.rows.cells[i].below_m), R::of(self.rows.cells[i + 1].above_m));
        let (mut upper, mut under) = (self.darcy.later[i], self.darcy.later[i + 1]);
        if !at_end {
            upper = midway(self.darcy.pores[i], upper);
            under = midway(self.darcy.pores[i + 1], under);
        }
        gas_flux(upper, above_m, self.pressed(i), under, below_m, self.pressed(i + 1))
    }

    /// A cell's pressure at `p + δ₁`.
    #[inline(always)]
    pub(super) fn pressed(&self, cell: usize) -> Pair<R> {
        raised(self.darcy.pressures[cell], self.darcy.pressed_first[cell])
    }

    /// March the pressures over a step whose end the temperatures have foretold, and find the mean fluxes.
    #[inline(always)]
    fn percolate(&mut self, step: usize) {
        let last = self.gas.flows.len() - 1;
        let gamma = R::constant(PRESSURE_GAMMA);
        let (zero, one) = (R::constant(0.0), R::constant(1.0));
        let per_length = one / R::of(self.rows.lengths_s[step]);
        let open = [one, R::constant(if self.plan.back_is_open { 1.0 } else { 0.0 })];
        for i in 0..=last {
            self.darcy.pressed_first[i] = zero;
        }
        let length_s = R::of(self.rows.lengths_s[step]);
        let before_s = R::of(self.rows.lengths_s[step.max(1) - 1]);
        let share = (gamma - R::constant(0.5)) * R::constant(2.0) * length_s / (length_s + before_s);
        // The second stage's pores wait in `later`; what a cell makes and what its expansion drives out, in `supply`.
        for p in 0..self.scales.plies.len() {
            let ply = self.plan.plies[p];
            for i in ply.first_cell as usize..ply.end_cell as usize {
                self.darcy.later[i] = self.porous(p, i, 1);
                let expansion = (self.darcy.later[i].storage - self.darcy.pores[i].storage) * per_length;
                let supply = self.reactions.made_mean[i] - self.darcy.pressures[i].high * expansion;
                self.darcy.surges[i] = share * (supply - self.darcy.supply[i]);
                self.darcy.supply[i] = supply;
            }
        }
        let mut arriving = zero;
        let mut returned = zero;
        let mut above = zero;
        let mut surged = zero;
        let surging = R::constant(2.0 * PRESSURE_GAMMA - 1.0);
        for i in 0..=last {
            let none = GasFlux { flux: zero, above: zero, below: zero };
            let under = if i < last { self.gas_under(i, false) } else { none };
            let ending = if i < last { self.gas_under(i, true).flux } else { zero };
            let surge = surging * (ending - under.flux);
            self.darcy.surges[i] = self.darcy.surges[i] + keep(surge - surged);
            surged = surge;
            self.darcy.slopes_above[i] = under.above;
            self.darcy.slopes_below[i] = under.below;
            self.darcy.first_flows[i] = under.flux;
            self.darcy.pressed_second[i] = under.flux - above + keep(self.darcy.supply[i] + self.darcy.surges[i]);
            self.darcy.pressure_diagonal[i] =
                self.darcy.later[i].storage * per_length + gamma * (under.above + returned);
            self.darcy.pressure_lower[i] = -(gamma * arriving);
            self.darcy.pressure_upper[i] = -(gamma * under.below);
            arriving = under.above;
            returned = under.below;
            above = under.flux;
        }
        let rises = self.pressure_rises(step);
        for (cell, face) in [(0, 0), (last, 1)] {
            let free = one - open[face];
            self.darcy.pressure_diagonal[cell] = open[face] + free * self.darcy.pressure_diagonal[cell];
            self.darcy.pressure_lower[cell] = free * self.darcy.pressure_lower[cell];
            self.darcy.pressure_upper[cell] = free * self.darcy.pressure_upper[cell];
            self.darcy.pressed_second[cell] = open[face] * rises[face] + free * self.darcy.pressed_second[cell];
        }
        factorise(&mut self.darcy.pressure_lower, &mut self.darcy.pressure_diagonal, &mut self.darcy.pressure_upper);
        substitute(
            &self.darcy.pressure_lower,
            &self.darcy.pressure_diagonal,
            &self.darcy.pressure_upper,
            &mut self.darcy.pressed_second,
        );
        for i in 0..=last {
            self.darcy.pressed_first[i] = self.darcy.pressed_second[i];
        }
        let mut above = zero;
        for i in 0..=last {
            let under = if i < last { self.gas_under(i, false).flux } else { zero };
            let carried = self.darcy.later[i].storage * per_length * self.darcy.pressed_first[i];
            self.darcy.pressed_second[i] =
                under - above + keep(self.darcy.supply[i] - self.darcy.surges[i]) - (carried + carried);
            self.darcy.first_flows[i] = self.darcy.first_flows[i] + under;
            above = under;
        }
        for (cell, face) in [(0, 0), (last, 1)] {
            let free = one - open[face];
            self.darcy.pressed_second[cell] = free * self.darcy.pressed_second[cell] - open[face] * rises[face];
        }
        substitute(
            &self.darcy.pressure_lower,
            &self.darcy.pressure_diagonal,
            &self.darcy.pressure_upper,
            &mut self.darcy.pressed_second,
        );
        self.take_in(step);
    }

    /// By how much the pressures outside rise over a step.
    #[inline(always)]
    fn pressure_rises(&self, step: usize) -> [R; 2] {
        let drives = &self.rows.drives;
        let rise = |start: usize| R::of(drives[start + 1].pressure_pa) - R::of(drives[start].pressure_pa);
        [rise(4 * step), rise(4 * step + 2)]
    }

    /// By how much the pressure of a cell rises over a step, Pa.
    #[inline(always)]
    fn pressure_rise(&self, cell: usize) -> R {
        self.darcy.pressed_first[cell] * R::fixed(1.5) + self.darcy.pressed_second[cell] * R::fixed(0.5)
    }

    /// Gas that a cell makes over a step and does not hold at its end, kg/m²/s.
    #[inline(always)]
    fn given_off(&self, cell: usize, per_length: R::Still) -> R {
        let storage = self.darcy.later[cell].storage;
        let held = storage * self.pressure_rise(cell)
            + (storage - self.darcy.pores[cell].storage) * self.darcy.pressures[cell].high;
        self.reactions.made_mean[cell] - held * per_length
    }

    /// Mean flux of the step by Darcy's law through the face under a cell, as the stages have it.
    #[inline(always)]
    fn driven_through(&self, cell: usize) -> R {
        let here = self.darcy.pressed_first[cell] + self.darcy.pressed_second[cell];
        let next = self.darcy.pressed_first[cell + 1] + self.darcy.pressed_second[cell + 1];
        let implicit =
            (self.darcy.slopes_below[cell] * next - self.darcy.slopes_above[cell] * here) * R::fixed(PRESSURE_GAMMA);
        (self.darcy.first_flows[cell] + implicit) * R::fixed(0.5)
    }

    /// One where the face under a cell passes all that comes from behind, zero where it passes nothing, or what the pressures beside it say.
    #[inline(always)]
    fn passing(&self, cell: usize) -> R {
        let last = self.gas.flows.len() - 1;
        if cell == last {
            return R::constant(1.0);
        }
        if cell + 1 == last && self.plan.back_is_open {
            return R::constant(0.0);
        }
        (self.darcy.slopes_above[cell] + self.darcy.slopes_below[cell]).reached(R::constant(LEAST_PASSING))
    }

    /// What passes the face under a cell, the mean of a step, by what passes that behind it, kg/m²/s.
    #[inline(always)]
    fn driven_into(&self, cell: usize, behind: R, per_length: R::Still) -> R {
        let last = self.gas.flows.len() - 1;
        if cell == last {
            return behind;
        }
        if cell + 1 == last && self.plan.back_is_open {
            return self.driven_through(cell);
        }
        self.passing(cell) * (behind + self.given_off(cell + 1, per_length))
    }

    /// Mean flux of the step, the pressures at its end, and the gas that left. What passes a face is what passes the one below and what
    /// the cell between gives off: a sum from the back, where by the pressures found it would be off by the rounding of a system whose
    /// pivots hardly know in f32 what a cell holds (2.5e-5 of the mass that moves). Where the law lets nothing pass nothing does.
    #[inline(always)]
    fn take_in(&mut self, step: usize) {
        let last = self.gas.flows.len() - 1;
        let zero = R::constant(0.0);
        let per_length = R::fixed(1.0) / R::still(self.rows.lengths_s[step]);
        let mut mean = zero;
        for up in 0..=last {
            let i = last - up;
            mean = self.driven_into(i, mean, per_length);
            // The stages of heat: that of the step before, and what makes their mean the mean.
            self.gas.flows[i] = mean * R::fixed(2.0) - self.darcy.mean_flows[i];
            self.darcy.mean_flows[i] = mean;
        }
        let mut left = [self.darcy.mean_flows[0] + self.given_off(0, per_length), zero];
        if self.plan.back_is_open {
            left[1] = self.given_off(last, per_length) - self.darcy.mean_flows[last - 1];
        }
        self.gas.leaving = [self.darcy.mean_leaving, R::constant(2.0) * left[0] - self.darcy.mean_leaving];
        self.darcy.mean_leaving = left[0];
        self.gas.back_leaving = left[1];
        self.let_out(step, left[0], left[1]);
        for i in 0..=last {
            let rise = self.pressure_rise(i);
            self.darcy.pressures[i] = advanced(self.darcy.pressures[i], rise);
            // From here on the pores are those of the end, as foretold.
            self.darcy.pores[i] = self.darcy.later[i];
            self.darcy.pressure_rates[i] = rise * per_length;
        }
    }
}
