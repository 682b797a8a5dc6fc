//! Random cases: the text of a case file from a seed.
//!
//! They test claims on layups and exposures that nobody chose: 1 to 12 plies of built-in materials from 25 µm to 8 mm,
//! every kind of face, schedules with jumps, ramps and many corners, contacts, holders, decomposition and gas.

use crate::case::{Case, CaseError};
use crate::random::RandomStream;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Built-in materials of random layups, with the thinnest and thickest ply of each, m.
const MATERIALS: [(&str, f64, f64); 11] = [
    ("nextel440-bf20", 0.1e-3, 1.0e-3),
    ("sic-5hs", 0.1e-3, 1.0e-3),
    ("pyrogel3350", 0.5e-3, 6.0e-3),
    ("pyrogel2250", 0.5e-3, 6.0e-3),
    ("pyrogel-xte", 1.0e-3, 8.0e-3),
    ("saffil-96", 1.0e-3, 8.0e-3),
    ("pi-aerogel", 0.5e-3, 4.0e-3),
    ("kaowool-pm", 1.0e-3, 8.0e-3),
    ("tacot", 0.1e-3, 8.0e-3),
    ("akk", 25e-6, 0.2e-3),
    ("kkl", 25e-6, 0.2e-3),
];

/// Stream of the random numbers.
const RANDOM_STREAM: u64 = 26;

/// The case of a seed.
///
/// # Errors
/// As [`Case::from_toml`]; no seed is known that fails.
pub fn random_case(seed: u64) -> Result<Case, CaseError> {
    Case::from_toml(&random_case_toml(seed), &format!("random-{seed}"), &BTreeMap::<String, String>::new())
}

/// The text of the case of a seed.
pub fn random_case_toml(seed: u64) -> String {
    CaseWriter { numbers: RandomStream::new(seed, RANDOM_STREAM), toml: String::new() }.write_case()
}

/// Writer of a case file.
struct CaseWriter {
    numbers: RandomStream,
    toml: String,
}

impl CaseWriter {
    fn write_case(mut self) -> String {
        let duration_s = self.log_uniform(5.0, 400.0).round();
        let is_decomposing = self.bernoulli(0.4);
        let is_darcy = is_decomposing && self.bernoulli(0.3);
        let pressure_pa = self.log_uniform(1e3, 1e5);
        let initial_k = 280.0 + 40.0 * self.numbers.uniform();
        self.push_line(&format!("initial_temperature = \"{initial_k:.0} K\""));
        self.push_line(&format!("duration = \"{duration_s} s\""));
        self.push_line(&format!("pressure = \"{pressure_pa:.0} Pa\""));
        self.push_line(&format!("decomposition = {is_decomposing}"));
        let contact = self.bernoulli(0.6).then(|| self.log_uniform(100.0, 2000.0));
        let top = self.toml.len();
        let depth_m = self.plies(is_decomposing, is_darcy);
        if let Some(conductance) = contact.filter(|_| depth_m.len() > 1) {
            self.toml.insert_str(top, &format!("contact_conductance = \"{conductance:.0} W/m^2/K\"\n"));
        }
        self.sensors(depth_m.len(), depth_m.iter().sum());
        self.hot_face(duration_s, is_decomposing);
        self.back_face(duration_s);
        if is_darcy {
            // Gas barriers are impermeable: gas made behind one leaves by the back.
            self.push_line(&format!("pressure = \"{pressure_pa:.0} Pa\""));
        }
        if self.bernoulli(0.15) {
            let conductance = self.log_uniform(1.0, 50.0);
            self.push_line(&format!("[holder]\nconductance = \"{conductance:.1} kW/m^3/K\"\ntemperature = \"300 K\""));
        }
        if is_darcy {
            self.push_line("[gas]\nflow = \"darcy\"\ngas = \"pyrolysis\"");
        } else if is_decomposing && self.bernoulli(0.2) {
            self.push_line("[gas]\nflow = \"unhindered\"\ngas = \"pyrolysis\"");
        }
        self.push_line(&format!("[resolution]\noutput_interval = \"{} s\"", duration_s / 100.0));
        self.toml
    }

    /// Writes plies from the hot face to the back; returns their thicknesses, m.
    fn plies(&mut self, is_decomposing: bool, is_darcy: bool) -> Vec<f64> {
        let count = 1 + self.numbers.uniform_index(12);
        (0..count)
            .map(|ply| {
                let drawn = self.numbers.uniform_index(MATERIALS.len());
                let drawn = match MATERIALS[drawn].0 {
                    // A case with decomposition needs a ply that decomposes.
                    _ if is_decomposing && ply == 0 => 2 + drawn % 2,
                    // TACOT has absolute enthalpies, the others sensible ones: they cannot share a gas.
                    "tacot" if is_decomposing => 0,
                    // With Darcy's law, gas made inside a barrier cannot leave.
                    "akk" | "kkl" if is_darcy => 1,
                    _ => drawn,
                };
                let (material, thinnest_m, thickest_m) = MATERIALS[drawn];
                let thickness_m = self.log_uniform(thinnest_m, thickest_m);
                let thickness_mm = 1e3 * thickness_m;
                self.push_line(&format!("[[ply]]\nname = \"P{ply}\"\nmaterial = \"{material}\""));
                self.push_line(&format!("thickness = \"{thickness_mm:.4} mm\""));
                thickness_m
            })
            .collect()
    }

    fn sensors(&mut self, plies: usize, depth_m: f64) {
        let sensors = 1 + self.numbers.uniform_index(4);
        for sensor in 0..sensors {
            let place = if self.bernoulli(0.7) {
                format!("below = \"P{}\"", self.numbers.uniform_index(plies))
            } else {
                format!("depth = \"{:.4} mm\"", 1e3 * depth_m * (0.02 + 0.96 * self.numbers.uniform()))
            };
            self.push_line(&format!("[[sensor]]\nname = \"TC{sensor}\"\n{place}"));
        }
    }

    fn hot_face(&mut self, duration_s: f64, is_decomposing: bool) {
        self.push_line("[hot_face]");
        match self.numbers.uniform_index(5) {
            0 | 1 => {
                let flux = self.schedule(duration_s, 0.0, 4e5, "W/m^2");
                self.push_line(&format!("kind = \"heated\"\nflux = {flux}"));
                if self.bernoulli(0.6) {
                    let enthalpy = self.log_uniform(5.0, 25.0);
                    self.push_line(&format!("recovery_enthalpy = \"{enthalpy:.1} MJ/kg\""));
                    if is_decomposing && self.bernoulli(0.5) {
                        self.push_line("blowing = 0.5");
                    }
                }
            }
            2 => {
                let flux = self.schedule(duration_s, 0.0, 3e5, "W/m^2");
                self.push_line(&format!("kind = \"heated\"\nradiant_flux = {flux}"));
            }
            3 => {
                let coefficient = self.log_uniform(20.0, 500.0);
                let gas = self.schedule(duration_s, 300.0, 1500.0, "K");
                self.push_line(&format!(
                    "kind = \"convective\"\nheat_transfer_coefficient = \"{coefficient:.0} W/m^2/K\"\ngas = {gas}"
                ));
            }
            _ => {
                let temperature = self.schedule(duration_s, 300.0, 1300.0, "K");
                self.push_line(&format!("kind = \"held\"\ntemperature = {temperature}"));
            }
        }
    }

    fn back_face(&mut self, duration_s: f64) {
        self.push_line("[back_face]");
        match self.numbers.uniform_index(4) {
            0 => self.push_line("kind = \"insulated\""),
            1 => {
                let coefficient = self.log_uniform(5.0, 100.0);
                self.push_line(&format!(
                    "kind = \"cooled\"\nheat_transfer_coefficient = \"{coefficient:.0} W/m^2/K\"\nambient = \"300 K\""
                ));
            }
            2 => {
                let conductance = self.log_uniform(50.0, 1000.0);
                let holder = format!("conductance = \"{conductance:.0} W/m^2/K\"\ntemperature = \"300 K\"");
                self.push_line(&format!("kind = \"holder\"\n{holder}"));
            }
            _ => {
                let temperature = self.schedule(duration_s, 290.0, 400.0, "K");
                self.push_line(&format!("kind = \"held\"\ntemperature = {temperature}"));
            }
        }
    }

    /// A schedule between two values: constant, ramped pulse, jump, random corners, or noise at up to 50 Hz.
    fn schedule(&mut self, duration_s: f64, low: f64, high: f64, unit: &str) -> String {
        let top = low + (high - low) * (0.1 + 0.9 * self.numbers.uniform());
        let mut points: Vec<(f64, f64)> = Vec::new();
        match self.numbers.uniform_index(5) {
            0 => points.push((0.0, top)),
            1 => {
                let (rise_s, end_s) =
                    (self.log_uniform(0.05, 0.2 * duration_s), duration_s * (0.25 + 0.5 * self.numbers.uniform()));
                points.extend([(0.0, low), (rise_s, top), (end_s, top), (end_s + rise_s, low)]);
            }
            2 => {
                let at_s = duration_s * (0.05 + 0.6 * self.numbers.uniform());
                let after = low + (high - low) * self.numbers.uniform();
                points.extend([(0.0, top), (at_s, top), (at_s, after)]);
            }
            3 => {
                let corners = 3 + self.numbers.uniform_index(10);
                let value = |text: &mut Self| low + (high - low) * text.numbers.uniform();
                points.extend((0..=corners).map(|i| (duration_s * i as f64 / corners as f64, value(self))));
            }
            _ => {
                // Corners closer than the steps that a smooth schedule needs.
                let every_s = (duration_s / 500.0).max(0.02);
                let samples = (0.8 * duration_s / every_s) as usize;
                let noise = 0.05 * (top - low);
                points.extend((0..samples).map(|i| {
                    let noisy = top + noise * self.numbers.normal().clamp(-3.0, 3.0);
                    (every_s * i as f64, noisy.max(low))
                }));
                points.push((every_s * samples as f64, low));
            }
        }
        let mut text = String::from("{ outside = \"hold\", points = [");
        for (time_s, value) in points {
            let _ = write!(text, "[\"{time_s:.4} s\", \"{value:.2} {unit}\"], ");
        }
        text + "] }"
    }

    fn push_line(&mut self, line: &str) {
        self.toml.push_str(line);
        self.toml.push('\n');
    }

    fn bernoulli(&mut self, probability: f64) -> bool {
        self.numbers.uniform() < probability
    }

    fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.numbers.uniform())
    }
}
