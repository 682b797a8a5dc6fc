//! Generated cases, one per kind that the program can march, with factors on every property of the kind.

mod inert;
mod porous;

use crate::support::{Scratch, Uniform};
use bondline::Case;
use bondline::case::Property;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A material that decomposes in a chain of reactions with non-integer orders.
const CHAIN: &str = include_str!("chain.toml");

/// Every property that a factor can scale, with its word in a case file.
pub(super) const PROPERTIES: [(Property, &str); 18] = [
    (Property::Conductivity, "conductivity"),
    (Property::ConductivitySolid, "conductivity.solid"),
    (Property::ConductivityGas, "conductivity.gas"),
    (Property::ConductivityRadiative, "conductivity.radiative"),
    (Property::HeatCapacity, "heat_capacity"),
    (Property::Density, "density"),
    (Property::Emissivity, "emissivity"),
    (Property::Thickness, "thickness"),
    (Property::PreExponential, "pre_exponential"),
    (Property::ActivationEnergy, "activation_energy"),
    (Property::PyrolysisHeat, "pyrolysis_heat"),
    (Property::CharYield, "char_yield"),
    (Property::Permeability, "permeability"),
    (Property::Heating, "heating"),
    (Property::ContactConductance, "contact_conductance"),
    (Property::BackFaceLoss, "back_face_loss"),
    (Property::HolderLoss, "holder_loss"),
    (Property::SensorDepth, "sensor_depth"),
];

/// Index of a property in [`PROPERTIES`]; the match is exhaustive, so a new property fails to compile until it is
/// added.
pub(super) fn place(property: Property) -> usize {
    match property {
        Property::Conductivity => 0,
        Property::ConductivitySolid => 1,
        Property::ConductivityGas => 2,
        Property::ConductivityRadiative => 3,
        Property::HeatCapacity => 4,
        Property::Density => 5,
        Property::Emissivity => 6,
        Property::Thickness => 7,
        Property::PreExponential => 8,
        Property::ActivationEnergy => 9,
        Property::PyrolysisHeat => 10,
        Property::CharYield => 11,
        Property::Permeability => 12,
        Property::Heating => 13,
        Property::ContactConductance => 14,
        Property::BackFaceLoss => 15,
        Property::HolderLoss => 16,
        Property::SensorDepth => 17,
    }
}

/// Plies: name (also their group), material, and thickness, mm.
type Plies<'a> = &'a [(&'a str, &'a str, f64)];

/// The text of a case file under construction.
#[derive(Clone)]
struct Text(String);

impl Text {
    /// A layup with a sensor below each ply except the last.
    fn new(name: &str, plies: Plies<'_>) -> Self {
        let mut text = Self(format!("name = \"{name}\"\n"));
        text.top("duration = \"60 s\"\ninitial_temperature = \"300 K\"");
        for (ply, material, thickness_mm) in plies {
            text.add(&format!(
                "[[ply]]\nname = \"{ply}\"\nmaterial = \"{material}\"\nthickness = \"{thickness_mm:.4} mm\""
            ));
        }
        for (ply, _, _) in &plies[..plies.len() - 1] {
            text.add(&format!("[[sensor]]\nname = \"under-{ply}\"\nbelow = \"{ply}\""));
        }
        text
    }

    fn top(&mut self, lines: &str) {
        self.0.insert_str(0, &format!("{lines}\n"));
    }

    fn add(&mut self, lines: &str) {
        self.0.push_str(lines);
        self.0.push('\n');
    }

    fn sensor(&mut self, name: &str, depth_mm: f64, more: &str) {
        self.add(&format!("[[sensor]]\nname = \"{name}\"\ndepth = \"{depth_mm:.4} mm\"\n{more}"));
    }

    /// Factors of one group (of none if empty), by the words of their properties.
    fn factors(&mut self, group: &str, properties: &[&str]) {
        let group_line = if group.is_empty() { String::new() } else { format!("group = \"{group}\"\n") };
        for property in properties {
            // Bounds that are valid for every char yield and sensor of these cases.
            self.add(&format!(
                "[[factor]]\nname = \"f_{group}_{}\"\nproperty = \"{property}\"\n{group_line}small = [0.9, 1.1]",
                property.replace('.', "_")
            ));
        }
    }
}

const RESOLUTION: &str = "[resolution]\ncells = 28\nfirst_step = \"20 ms\"\nstep_growth = 0.1\nmax_step = \"0.5 s\"\n\
                          output_interval = \"2 s\"";

/// A flux that rises within a second, holds, and falls, W/cm².
fn flux(key: &str, w_cm2: f64) -> String {
    format!(
        "{key}.points = [[\"0 s\", \"0 W/cm^2\"], [\"1 s\", \"{w_cm2:.3} W/cm^2\"], [\"30 s\", \"{w_cm2:.3} W/cm^2\"], \
         [\"31 s\", \"0 W/cm^2\"]]\n{key}.outside = \"zero\""
    )
}

const SOLID: [&str; 3] = ["conductivity", "heat_capacity", "thickness"];
const KINETICS: [&str; 4] = ["pre_exponential", "activation_energy", "pyrolysis_heat", "char_yield"];
const PARTS: [&str; 3] = ["conductivity.solid", "conductivity.gas", "conductivity.radiative"];

/// The cases of a seed, named by kind.
pub(super) fn cases(seed: u64) -> Vec<Case> {
    // Tests run in parallel, each with its own files.
    static FOLDERS: AtomicUsize = AtomicUsize::new(0);
    let folder = Scratch::new(&format!("derivatives-{}", FOLDERS.fetch_add(1, Ordering::Relaxed)));
    folder.write("materials/chain.toml", CHAIN);
    let mut uniform = Uniform(seed);
    let load = |(i, Text(text)): (usize, Text)| {
        let path = folder.write(&format!("kind-{i}.toml"), format!("{text}{RESOLUTION}\n"));
        Case::load(&path).unwrap_or_else(|error| panic!("{error}\n{text}"))
    };
    texts(&mut uniform).into_iter().enumerate().map(load).collect()
}

fn texts(uniform: &mut Uniform) -> Vec<Text> {
    [inert::kinds(uniform), porous::kinds(uniform)].concat()
}
