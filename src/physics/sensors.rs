//! Sensors of a member: temperatures between nodes, and the lag of thermocouple beads.

use super::Real;
use super::compensated::{add_unnormalized, difference};
use super::double_word::DoubleWord;
use super::material::{conductance_across, conductance_within};
use super::member::{Member, half_over_distance_1_m};
use super::thermocouple::{
    bead_response, covered_length, interface_temperature, peak_excess, temperature_within_steep_ply,
};

impl<R: Real, const GAS: bool> Member<'_, R, GAS> {
    /// Temperature at a sensor, or the highest of a part with a temperature limit.
    #[inline(always)]
    pub(super) fn read_sensor(&self, sensor: usize, step: usize) -> DoubleWord<R> {
        let zero = R::from_f64(0.0);
        let (mut faces, mut hottest, mut reading) = (sensor..sensor + 1, zero, DoubleWord::single(zero));
        let is_limit = self.plan.has_limit_rows() && self.is_limit_row(sensor);
        if is_limit {
            faces = sensor + 1..sensor + 1 + self.plan.sensor_locations[sensor].faces as usize;
            hottest = self.hottest_node(sensor);
        }
        for face in faces {
            reading = self.read_face(face, step);
            hottest = hottest.max(reading.high + reading.low());
        }
        if is_limit { DoubleWord::single(hottest) } else { reading }
    }

    /// Whether a row reads the highest temperature of a part.
    #[inline(always)]
    fn is_limit_row(&self, sensor: usize) -> bool {
        let location = self.plan.sensor_locations[sensor];
        location.end_node + location.faces > 0
    }

    /// Highest temperature of the nodes of a part with a temperature limit, and of the parabolas between them.
    #[inline(always)]
    fn hottest_node(&self, sensor: usize) -> R {
        let location = self.plan.sensor_locations[sensor];
        let (first, end) = (location.first_node as usize, location.end_node as usize);
        let zero = R::from_f64(0.0);
        let mut hottest = zero;
        for i in first..end {
            let mut excess = zero;
            if i > first && i + 2 < end {
                let [above, between, below] = [self.stretch(i - 1), self.stretch(i), self.stretch(i + 1)];
                excess = peak_excess([above[0], between[0], below[0]], [above[1], between[1], below[1]]);
            }
            hottest = hottest.max(self.thermal.temperatures[i].high + excess);
        }
        hottest
    }

    /// Slope of the temperature from a node to the next, K/m, and the distance between them, m.
    #[inline(always)]
    fn stretch(&self, i: usize) -> [R; 2] {
        let temperatures = &self.thermal.temperatures;
        let length_m = self.distance_to_next_m(i);
        [difference(temperatures[i + 1], temperatures[i]) / length_m, length_m]
    }

    /// Temperature at a sensor's nominal or shifted depth.
    #[inline(always)]
    fn read_face(&self, sensor: usize, step: usize) -> DoubleWord<R> {
        let location = self.plan.sensor_locations[sensor];
        let (i, ply) = (location.cell as usize, location.ply_above as usize);
        // A loop, for one copy of the code of mixtures: four were 28 % of a kernel with gas and derivatives.
        let mut conductivities = [R::from_f64(0.0); 2];
        for (below, ply) in [location.ply_above, location.ply_below].into_iter().enumerate() {
            conductivities[below] = self.conductivity_now(ply as usize, i + below, step);
        }
        let [conductivity, next] = conductivities;
        let (here, below) = (self.thermal.temperatures[i], self.thermal.temperatures[i + 1]);
        let is_within = location.ply_above == location.ply_below;
        let row = self.rows.sensors[sensor];
        let is_between_nodes = location.node_above < location.node_below;
        let is_steep = is_within && is_between_nodes && self.integrates_conductivity(ply);
        let conductance = if is_within {
            let half_over_next_1_m = half_over_distance_1_m::<R>(&self.rows.cells[i]);
            let mean_conductance = conductance_within(conductivity, next, half_over_next_1_m);
            if is_steep {
                let [integral_correction, ..] = self.conductivity_by_integral(ply, i, difference(here, below), step, 0);
                mean_conductance + integral_correction * (half_over_next_1_m + half_over_next_1_m)
            } else {
                mean_conductance
            }
        } else {
            let [below_m, above_m] = self.lengths_to_next_m(i);
            conductance_across(conductivity, below_m, next, above_m, self.scales.contacts_m2_k_w[ply])
        };
        let nominal = if is_steep {
            temperature_within_steep_ply(here, below, conductivity, next, conductance, row)
        } else {
            interface_temperature(here, below, conductivity, next, conductance, row)
        };
        if self.plan.has_depth_factors {
            let flux = conductance * difference(here, below);
            let correction_k = self.depth_correction(sensor, flux / conductivity, flux / next);
            return add_unnormalized(nominal, correction_k);
        }
        nominal
    }

    /// Change of a sensor's reading by its depth shift, K: along straight lines from its face to the nearest node, with
    /// the temperature falls above and below the face (K/m), then from node to node in the direction of the shift.
    #[inline(always)]
    fn depth_correction(&self, sensor: usize, fall_above_k_m: R, fall_below_k_m: R) -> R {
        let (location, sensor_row) = (self.plan.sensor_locations[sensor], self.rows.sensors[sensor]);
        let zero = R::from_f64(0.0);
        let shift_m = self.scales.shifts_m[sensor];
        // On an outer face the node lies on the face, and all other nodes on one side.
        let is_inside = location.node_above < location.node_below;
        let mut start_m = R::splat(sensor_row.below_m);
        let mut rise = zero;
        if is_inside {
            rise = -(fall_below_k_m * covered_length(shift_m, zero, start_m, false));
        }
        for step in 0..location.steps_below as usize {
            let j = location.node_below as usize + step;
            let length_m = self.distance_to_next_m(j);
            let gain = difference(self.thermal.temperatures[j + 1], self.thermal.temperatures[j]) / length_m;
            rise = rise + gain * covered_length(shift_m, start_m, length_m, !is_inside && step == 0);
            start_m = start_m + length_m;
        }
        start_m = R::splat(sensor_row.above_m);
        if is_inside {
            rise = rise + fall_above_k_m * covered_length(-shift_m, zero, start_m, false);
        }
        for step in 0..location.steps_above as usize {
            let j = location.node_above as usize - step;
            let length_m = self.distance_to_next_m(j - 1);
            let gain = difference(self.thermal.temperatures[j - 1], self.thermal.temperatures[j]) / length_m;
            rise = rise + gain * covered_length(-shift_m, start_m, length_m, !is_inside && step == 0);
            start_m = start_m + length_m;
        }
        rise
    }

    /// Stated initial temperature at a sensor's nominal or shifted depth, K.
    #[inline(always)]
    fn initial_temperature_k(&self, sensor: usize) -> R {
        let row = self.rows.sensors[sensor];
        let mut start_k = R::splat(row.start_k);
        if self.plan.has_depth_factors {
            // In the layup as stated, in which all lengths are: a thicker ply stretches the profile too.
            let shift_m = self.scales.shifts_m[sensor];
            for bend in &self.rows.initial_bends {
                let below_bend_m = R::splat(row.depth_m) - R::splat(bend.depth_m);
                let added_m = (below_bend_m + shift_m).max(R::from_f64(0.0)) - below_bend_m.max(R::from_f64(0.0));
                start_k = start_k + R::splat(bend.slope_change_k_m) * added_m;
            }
        }
        start_k
    }

    /// Reads the sensors at the start of a step, and lets the beads follow over the step before.
    #[inline(always)]
    pub(super) fn update_sensors(&mut self, step: usize) {
        let sensors = self.sensors.beads.len();
        for sensor in 0..sensors {
            let now = self.read_sensor(sensor, step);
            if step == 0 {
                // Nodes and their fluxes would miss bends of the initial profile, by a kelvin.
                self.sensors.beads[sensor] = now;
                if self.rows.sensors[sensor].start_k != R::scalar(0.0) {
                    self.sensors.beads[sensor] = DoubleWord::single(self.initial_temperature_k(sensor));
                }
            } else {
                let weights = self.rows.beads[(step - 1) * sensors + sensor];
                self.sensors.beads[sensor] =
                    bead_response(self.sensors.beads[sensor], self.sensors.readings[sensor], now, weights);
            }
            self.sensors.readings[sensor] = now;
        }
    }
}
