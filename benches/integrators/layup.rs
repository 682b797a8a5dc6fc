//! A member as a system of ordinary differential equations, `C(T) dT/dt = F(T, t)`, one for each cell.
//!
//! Tables, conductances, faces and readings are those of `bondline_physics`, on the cells of one plan and the schedule
//! of another. Omitted, as `lcat-2259` does not need them: heat balances, compensated temperatures, gas, held faces;
//! the back face is insulated.

use bondline::plan::Plan;
use bondline_physics::Real;
use bondline_physics::layout::{BoundaryForcing, TABLE_STEP_K};
use bondline_physics::material::{
    ConductivityParts, PlyScale, conductance_across, conductance_slope_across, conductance_within, flux_slopes,
    ply_scale, solid_properties, state_scale,
};
use bondline_physics::surface_flux::{FaceScale, STEFAN_BOLTZMANN, SurfaceFlux, face_scale, surface_flux};
use bondline_physics::table::{table_index, table_segment};

pub(crate) struct Layup<'a, R> {
    plan: &'a Plan,
    plies: Vec<(PlyScale<R>, ConductivityParts<R>)>,
    contacts_m2_k_w: Vec<R>,
    hot: FaceScale<R>,
    /// The ply of each cell.
    ply_of: Vec<usize>,
}

/// Evaluation of a member at given temperatures.
pub(crate) struct Evaluation<R> {
    conductivities: Vec<R>,
    slopes: Vec<R>,
    conductances: Vec<R>,
    /// Heat capacity of each cell (J/m²/K) and its slope by temperature.
    pub capacities: Vec<R>,
    pub capacity_slopes: Vec<R>,
    /// Net heat flux into each cell, W/m².
    pub net: Vec<R>,
    /// Derivative of the flux below a cell by its own temperature, and minus that by the temperature of the next.
    pub by_upper: Vec<R>,
    pub by_lower: Vec<R>,
    pub hot: SurfaceFlux<R>,
}

/// Derivatives that an evaluation computes.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Derivatives {
    None,
    /// Derivatives of the fluxes as in the march: smooth, without that of the emissivity, never negative.
    Fluxes,
    /// All exact derivatives, including heat capacities.
    All,
}

impl<R: Real> Evaluation<R> {
    pub(crate) fn new(cells: usize) -> Self {
        let zero = R::from_f64(0.0);
        let none = || vec![zero; cells];
        Self {
            conductivities: none(),
            slopes: none(),
            conductances: none(),
            capacities: none(),
            capacity_slopes: none(),
            net: none(),
            by_upper: none(),
            by_lower: none(),
            hot: SurfaceFlux { flux: zero, slope: zero },
        }
    }
}

impl<'a, R: Real<Scalar = f64, Constant = R>> Layup<'a, R> {
    /// On the cells of a plan, scaled by a member's factor columns; column 0 is one.
    #[inline(always)]
    pub(crate) fn new(plan: &'a Plan, column: impl Fn(u32) -> R + Copy) -> Self {
        let (marched, rows) = (plan.rows(), &plan.rows().data);
        let ply = |(ply, &bulk)| {
            let ply: &bondline_physics::layout::Ply<u32> = ply;
            let state = ply.first_state as usize;
            let scale = ply_scale(ply, bulk, rows.state_properties[state], column);
            (
                scale,
                state_scale(&marched.conductivity_columns[state], rows.state_properties[state], bulk, scale, column)
                    .conductivity,
            )
        };
        let contacts = rows.contacts_m2_k_w.iter().zip(&marched.plies);
        Self {
            plan,
            plies: marched.plies.iter().zip(&rows.bulk_properties).map(ply).collect(),
            contacts_m2_k_w: contacts.map(|(&contact, ply)| R::splat(contact) / column(ply.contact)).collect(),
            hot: face_scale(&marched.face_columns[0], column),
            ply_of: (0..marched.plies.len())
                .flat_map(|p| vec![p; (marched.plies[p].end_cell - marched.plies[p].first_cell) as usize])
                .collect(),
        }
    }

    pub(crate) fn cells(&self) -> usize {
        self.plan.cells()
    }

    pub(crate) fn start(&self) -> Vec<R> {
        self.plan.rows().data.cells.iter().map(|cell| R::splat(cell.start_k)).collect()
    }

    #[inline(always)]
    pub(crate) fn evaluate(
        &self,
        temperatures: &[R],
        drive: BoundaryForcing<f64>,
        slopes: Derivatives,
        at: &mut Evaluation<R>,
    ) {
        let cells = &self.plan.rows().data.cells;
        let (mut above, is_sloped) = (R::from_f64(0.0), slopes != Derivatives::None);
        for p in 0..self.plies.len() {
            let (first, end) =
                (self.plan.rows().plies[p].first_cell as usize, self.plan.rows().plies[p].end_cell as usize);
            self.properties(p, temperatures, slopes, at);
            // Slices of equal length avoid bounds checks, as in the march; the checks would take as long as the work.
            let count = end - first - 1;
            let (rows, temperatures_here) = (&cells[first..][..count], &temperatures[first..][..count + 1]);
            let (k, rises) = (&at.conductivities[first..][..count + 1], &at.slopes[first..][..count + 1]);
            let conductances = &mut at.conductances[first..][..count];
            let (by_upper, by_lower) = (&mut at.by_upper[first..][..count], &mut at.by_lower[first..][..count]);
            for i in 0..count {
                let half_1_m = R::constant(rows[i].half_over_next_1_m);
                conductances[i] = conductance_within(k[i], k[i + 1], half_1_m);
                if is_sloped {
                    let drop = temperatures_here[i] - temperatures_here[i + 1];
                    let gains = [rises[i] * half_1_m, rises[i + 1] * half_1_m];
                    [by_upper[i], by_lower[i]] = flux_derivatives(conductances[i], drop, gains, slopes);
                }
            }
            if p > 0 {
                let i = first - 1;
                let (below_m, above_m) = (R::constant(cells[i].below_m), R::constant(cells[i + 1].above_m));
                let (k, next) = (at.conductivities[i], at.conductivities[i + 1]);
                at.conductances[i] = conductance_across(k, below_m, next, above_m, self.contacts_m2_k_w[p - 1]);
                if is_sloped {
                    let (conductance, drop) = (at.conductances[i], temperatures[i] - temperatures[i + 1]);
                    let above = conductance_slope_across(conductance, k, below_m) * at.slopes[i];
                    let below = conductance_slope_across(conductance, next, above_m) * at.slopes[i + 1];
                    [at.by_upper[i], at.by_lower[i]] = flux_derivatives(conductance, drop, [above, below], slopes);
                }
            }
        }
        at.hot = self.hot_face_flux(temperatures[0], drive, slopes);
        above = above + at.hot.flux;
        let last = temperatures.len() - 1;
        let (net, conductances, temperatures) =
            (&mut at.net[..=last], &at.conductances[..last], &temperatures[..=last]);
        for i in 0..last {
            let below = conductances[i] * (temperatures[i] - temperatures[i + 1]);
            net[i] = above - below;
            above = below;
        }
        net[last] = above;
    }

    /// Conductivities and heat capacities of the cells of a ply. Exact derivatives are the slopes of the table
    /// segments.
    #[inline(always)]
    fn properties(&self, p: usize, temperatures: &[R], slopes: Derivatives, at: &mut Evaluation<R>) {
        let (plan, ply, (bulk, state)) = (self.plan, &self.plan.rows().plies[p], self.plies[p]);
        let (tables, location) = (&plan.rows().data.tables, &plan.rows().tables[p]);
        let range = ply.first_cell as usize..ply.end_cell as usize;
        let (rows, temperatures) = (&plan.rows().data.cells[range.clone()], &temperatures[range.clone()]);
        let conductivities = &mut at.conductivities[range.clone()][..rows.len()];
        let inclines = &mut at.slopes[range.clone()][..rows.len()];
        let capacities = &mut at.capacities[range.clone()][..rows.len()];
        let capacity_slopes = &mut at.capacity_slopes[range][..rows.len()];
        let per_node = R::from_f64(1.0 / TABLE_STEP_K);
        for i in 0..rows.len() {
            let here = table_index(temperatures[i], tables, location);
            let row = table_segment(tables, here, location).row;
            let at_spot = |value: R, rise: R| value + here.fraction * rise;
            let [solid, solid_rise, capacity, capacity_rise] = R::column_group(row, 0);
            let mut conductivity = state.solid * at_spot(solid, solid_rise);
            let mut rise = state.solid * solid_rise;
            let mut slope = R::from_f64(0.0);
            if slopes == Derivatives::Fluxes {
                let [value, rise, ..] = R::column_group(row, 1);
                slope = state.solid * at_spot(value, rise);
            }
            if ply.parts > 1 {
                let [value, radiative_rise, radiative_slope, slope_rise] = R::column_group(row, 2);
                conductivity = conductivity + state.radiative * at_spot(value, radiative_rise);
                rise = rise + state.radiative * radiative_rise;
                slope = slope + state.radiative * at_spot(radiative_slope, slope_rise);
            }
            let mass_kg_m2 = R::splat(rows[i].width_m) * bulk.density_kg_m3;
            conductivities[i] = conductivity;
            capacities[i] = mass_kg_m2 * at_spot(capacity, capacity_rise);
            if slopes == Derivatives::All {
                inclines[i] = rise * per_node;
                capacity_slopes[i] = mass_kg_m2 * capacity_rise * per_node;
            } else {
                inclines[i] = slope;
            }
        }
    }

    /// Heat flux through the hot face at its temperature, with the derivative of the march or the exact one.
    #[inline(always)]
    pub(crate) fn hot_face_flux(
        &self,
        temperature_k: R,
        drive: BoundaryForcing<f64>,
        slopes: Derivatives,
    ) -> SurfaceFlux<R> {
        let (tables, none) = (&self.plan.rows().data.tables, R::from_f64(0.0));
        let location = self.plan.rows().face_table();
        let here = table_index(temperature_k, tables, location);
        let row = table_segment(tables, here, location).row;
        let [[enthalpy, enthalpy_rise, slope, slope_rise], [emissivity, emissivity_rise, ..]] =
            [0, 1].map(|four| R::column_group(row, four));
        let per_node = R::from_f64(1.0 / TABLE_STEP_K);
        let smooth = slope + here.fraction * slope_rise;
        let slope = if slopes == Derivatives::All { enthalpy_rise * per_node } else { smooth };
        let (enthalpy, emissivity) =
            (enthalpy + here.fraction * enthalpy_rise, emissivity + here.fraction * emissivity_rise);
        let mut found = surface_flux(drive, self.hot, temperature_k, emissivity, enthalpy, slope, none);
        if slopes == Derivatives::All {
            let (square, surroundings) = (temperature_k * temperature_k, R::splat(drive.surroundings_k));
            let surroundings_square = surroundings * surroundings;
            let radiance =
                R::from_f64(STEFAN_BOLTZMANN) * (surroundings_square * surroundings_square - square * square);
            let scale = self.hot.exchange * self.hot.emissivity;
            found.slope = found.slope + scale * emissivity_rise * per_node * radiance;
        }
        found
    }

    #[inline(always)]
    fn conductivity(&self, temperatures: &[R], i: usize) -> R {
        let (plan, p) = (self.plan, self.ply_of[i]);
        let ply = &plan.rows().plies[p];
        let (tables, location) = (&plan.rows().data.tables, &plan.rows().tables[p]);
        let row = table_segment(tables, table_index(temperatures[i], tables, location), location);
        solid_properties(row, ply.parts as usize, self.plies[p].1, false).conductivity
    }

    /// Reading of a sensor, K: see `physics::reading`.
    #[inline(always)]
    pub(crate) fn read(&self, temperatures: &[R], sensor: usize) -> R {
        let (plan, i) = (self.plan, self.plan.rows().sensor_locations[sensor].cell as usize);
        let row = plan.rows().data.sensors[sensor];
        let (k, next) = (self.conductivity(temperatures, i), self.conductivity(temperatures, i + 1));
        let drop = temperatures[i] - temperatures[i + 1];
        let (below_m, above_m) = (plan.rows().data.cells[i].below_m, plan.rows().data.cells[i + 1].above_m);
        let [ply, next_ply] = [i, i + 1].map(|cell| self.ply_of[cell]);
        let contact = if ply == next_ply { R::from_f64(0.0) } else { self.contacts_m2_k_w[ply] };
        let flux = conductance_across(k, R::constant(below_m), next, R::constant(above_m), contact) * drop;
        let to_face = flux * R::splat(row.above_m) / k;
        let from_face = drop - flux * R::splat(row.below_m) / next;
        temperatures[i] - (R::splat(row.above) * to_face + R::splat(row.below) * from_face)
    }
}

/// Derivatives of the flux below a cell, by its temperature and minus that by the next one's, from the conductance, the
/// temperature drop and the derivatives of the conductance by both temperatures: exact, or never negative as in the
/// march.
#[inline(always)]
fn flux_derivatives<R: Real>(conductance: R, drop: R, gains: [R; 2], slopes: Derivatives) -> [R; 2] {
    if slopes == Derivatives::All {
        [conductance + gains[0] * drop, conductance - gains[1] * drop]
    } else {
        flux_slopes(conductance, gains.map(|gain| gain * drop))
    }
}
