//! Short marches of random members on few cells: every function of a member's state against the processor.

use super::super::batch::{Batch, Invocation, Pipeline};
use super::super::device::Device;
use super::super::scalar::DeviceScalar;
use super::super::shader;
use super::super::spirv::Kernel;
use super::{Target, mutants};
use crate::case::{Bounds, Case, Property};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::ScalarReference;
use crate::march::{March, Precision, readings, trace_rows};
use crate::plan::Plan;
use crate::support::runs_all;
use crate::traces::{MemberStatus, Traces};
use std::collections::BTreeMap;

/// A material that decomposes in a chain, with orders that need a logarithm.
const CHAIN: &str = include_str!("../../../../tests/derivatives/chain.toml");
/// A material with latent heat, close nodes, jumps, and tables of several pressures.
const MELTING: &str = include_str!("../../../../tests/derivatives/melting.toml");

const RESOLUTION: &str = r#"[resolution]
first_step = "0.1 s"
step_growth = 0.3
max_step = "2 s"
output_interval = "1 s""#;

/// Cases that together take every branch of the physics: name and text. Those that detect the most mutants come first,
/// as a case is not compiled for mutants that are already detected.
pub(super) const CASES: &[(&str, &str)] = &[
    ("quasi-steady gas with blowing", QUASI_STEADY),
    ("held faces, holder, changing pressure", HELD),
    ("Darcy flow, absolute enthalpies", ABSOLUTE),
    ("Darcy flow, chained reactions, sealed back", SEALED),
    ("inert", INERT),
    ("unhindered gas, chained reactions", UNHINDERED),
    ("decomposing surface over plies of one material and an inert back", FRONTS),
    ("film coefficients, recovery enthalpy and blowing that vary", VARYING),
    ("Darcy flow of air", AIR),
    ("hot-wall correction that varies", CORRECTED),
    ("latent heat, jumps, changing pressure", LATENT),
    ("latent heat of a decomposing ply, Darcy flow", LATENT_DARCY),
    ("steep conductivity", STEEP),
    ("steep conductivity under a decomposing ply", STEEP_GAS),
    ("latent heats and steep conductivities of two states", STEEP_STATES),
];

/// A conductivity that rises tenfold over 5 K, and jumps.
const STEEP_MATERIAL: &str = r#"
name = "Steep"
density.value = "800 kg/m^3"
heat_capacity.value = "900 J/kg/K"
emissivity.value = 0.7
[conductivity]
temperatures_k = [250, 340, 345, 420, 420, 1500]
values = [0.1, 0.1, 1.0, 1.2, 0.4, 0.6]
unit = "W/m/K"
outside = "clamp"
"#;

const STEEP: &str = r#"
contact_conductance = "900 W/m^2/K"
ply = [
    { name = "C", material = "steep", thickness = "2 mm", limit = "500 K" },
    { name = "F", material = "saffil-96", thickness = "3 mm" },
]
sensor = [{ name = "A", below = "C", time_constant = "0.5 s" }, { name = "B", depth = "1.1 mm" }]
[hot_face]
kind = "heated"
flux.points = [["0 s", "0 W/cm^2"], ["1 s", "9 W/cm^2"], ["20 s", "9 W/cm^2"], ["21 s", "0 W/cm^2"]]
flux.outside = "zero"
"#;

const STEEP_GAS: &str = r#"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "C", material = "chain", thickness = "1 mm" },
    { name = "F", material = "steep", thickness = "2 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "2.2 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["10 s", "1100 K"], ["30 s", "500 K"]]
temperature.outside = "hold"
[gas]
flow = "quasi-steady"
gas = "pyrolysis"
"#;

/// A decomposing ply, whose states have latent heats and steep conductivities of their own.
const STEEP_STATES_MATERIAL: &str = r#"
name = "Steep states"
density.value = "800 kg/m^3"
emissivity.value = 0.7
[heat_capacity]
temperatures_k = [250, 351.3, 351.3, 357.4, 357.4, 1500]
values = [900, 950, 11000, 11000, 950, 1300]
unit = "J/kg/K"
outside = "clamp"
[conductivity]
temperatures_k = [250, 340, 345, 420, 420, 1500]
values = [0.1, 0.1, 1.0, 1.2, 0.4, 0.6]
unit = "W/m/K"
outside = "clamp"
[[decomposition.reaction]]
mass_loss = 0.3
pre_exponential = "1e7 1/s"
activation_energy = "60 kJ/mol"
order = 1
heat = "0.2 MJ/kg"
[decomposition.char.heat_capacity]
temperatures_k = [250, 440, 442, 444, 1500]
values = [1100, 1100, 15000, 1100, 1400]
unit = "J/kg/K"
outside = "clamp"
[decomposition.char.conductivity]
temperatures_k = [250, 400, 403, 1500]
values = [0.2, 0.2, 0.9, 1.1]
unit = "W/m/K"
outside = "clamp"
"#;

const STEEP_STATES: &str = r#"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "C", material = "states", thickness = "2 mm" },
    { name = "F", material = "saffil-96", thickness = "2 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "1.1 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["10 s", "1100 K"], ["30 s", "500 K"]]
temperature.outside = "hold"
[gas]
flow = "quasi-steady"
gas = "pyrolysis"
"#;

const LATENT: &str = r#"
pressure.points = [["0 s", "10 Pa"], ["10 s", "500 Pa"], ["20 s", "200 kPa"], ["30 s", "8 kPa"]]
pressure.outside = "hold"
ply = [
    { name = "C", material = "melting", thickness = "0.8 mm" },
    { name = "F", material = "melting", thickness = "3 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.4 mm" }]
[hot_face]
kind = "heated"
radiant_flux.points = [["0 s", "0 W/cm^2"], ["1 s", "3 W/cm^2"], ["20 s", "3 W/cm^2"], ["21 s", "0 W/cm^2"]]
radiant_flux.outside = "zero"
[back_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["15 s", "380 K"], ["15 s", "340 K"], ["30 s", "360 K"]]
temperature.outside = "hold"
"#;

const LATENT_DARCY: &str = r#"
decomposition = true
pressure.points = [["0 s", "5 kPa"], ["20 s", "8 kPa"]]
pressure.outside = "hold"
ply = [
    { name = "C", material = "nextel440-bf20", thickness = "0.5 mm" },
    { name = "F", material = "melting", thickness = "2 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.9 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["5 s", "900 K"], ["30 s", "320 K"]]
temperature.outside = "hold"
[back_face]
kind = "insulated"
[gas]
flow = "darcy"
gas = "pyrolysis"
"#;

const INERT: &str = r#"
contact_conductance = "500 W/m^2/K"
ply = [
    { name = "C", material = "nextel440-bf20", thickness = "0.8 mm" },
    { name = "F", material = "saffil-96", thickness = "3 mm", limit = "500 K" },
]
sensor = [
    { name = "A", below = "C", time_constant = "0.5 s" },
    { name = "B", depth = "2.6 mm" },
    { name = "D", depth = "3.8 mm" },
]
[hot_face]
kind = "heated"
flux.points = [["0 s", "0 W/cm^2"], ["1 s", "9 W/cm^2"], ["20 s", "9 W/cm^2"], ["21 s", "0 W/cm^2"]]
flux.outside = "zero"
recovery_enthalpy = "12 MJ/kg"
surroundings = "310 K"
[back_face]
kind = "holder"
conductance = "200 W/m^2/K"
temperature.points = [["0 s", "300 K"], ["30 s", "360 K"]]
temperature.outside = "hold"
"#;

const HELD: &str = r#"
contact_conductance = "800 W/m^2/K"
pressure.points = [["0 s", "100 Pa"], ["20 s", "20 kPa"]]
pressure.outside = "hold"
ply = [
    { name = "C", material = "nextel440-bf20", thickness = "0.8 mm", limit = "900 K", limit_below = "700 K" },
    { name = "F", material = "pyrogel3350", thickness = "3 mm" },
]
sensor = [
    { name = "A", below = "C", side = "above" },
    { name = "B", depth = "1.4 mm", time_constant = "0.5 s" },
]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["10 s", "1100 K"], ["10 s", "900 K"], ["30 s", "500 K"]]
temperature.outside = "hold"
[back_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["15 s", "340 K"], ["15 s", "330 K"], ["30 s", "360 K"]]
temperature.outside = "hold"
[holder]
conductance = "20 kW/m^3/K"
temperature.points = [["0 s", "300 K"], ["15 s", "340 K"], ["30 s", "310 K"]]
temperature.outside = "hold"
"#;

const QUASI_STEADY: &str = r#"
contact_conductance = "500 W/m^2/K"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "K", material = "nextel440-bf20", thickness = "0.5 mm" },
    { name = "F", material = "pyrogel3350", thickness = "0.6 mm" },
    { name = "G", material = "pyrogel3350", thickness = "1 mm" },
]
sensor = [{ name = "A", below = "F" }, { name = "B", depth = "0.9 mm" }]
[hot_face]
kind = "heated"
flux.points = [["0 s", "0 W/cm^2"], ["1 s", "15 W/cm^2"], ["20 s", "15 W/cm^2"], ["21 s", "0 W/cm^2"]]
flux.outside = "zero"
recovery_enthalpy = "8 MJ/kg"
blowing = 0.5
[back_face]
kind = "cooled"
heat_transfer_coefficient = "5 W/m^2/K"
ambient = "290 K"
[gas]
flow = "quasi-steady"
gas = "pyrolysis"
"#;

const VARYING: &str = r#"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "K", material = "nextel440-bf20", thickness = "0.5 mm" },
    { name = "F", material = "pyrogel3350", thickness = "1.6 mm" },
]
sensor = [{ name = "A", below = "K" }, { name = "B", depth = "0.9 mm" }]
[hot_face]
kind = "heated"
enthalpy_film_coefficient = [["0 s", "0 kg/m^2/s"], ["5 s", "0.03 kg/m^2/s"], ["30 s", "0.01 kg/m^2/s"]]
recovery_enthalpy = [["0 s", "4 MJ/kg"], ["20 s", "3 MJ/kg"], ["30 s", "-0.1 MJ/kg"]]
blowing = [["0 s", 0.5], ["12 s", 0.5], ["12 s", 0.4], ["20 s", 0], ["30 s", 0]]
heat_transfer_coefficient = [["0 s", "5 W/m^2/K"], ["30 s", "60 W/m^2/K"]]
gas = [["0 s", "900 K"], ["30 s", "400 K"]]
surroundings = [["0 s", "300 K"], ["30 s", "500 K"]]
[back_face]
kind = "cooled"
heat_transfer_coefficient.points = [["0 s", "0 W/m^2/K"], ["10 s", "40 W/m^2/K"], ["20 s", "15 W/m^2/K"]]
heat_transfer_coefficient.outside = "hold"
ambient = "290 K"
[gas]
flow = "quasi-steady"
gas = "pyrolysis"
"#;

const CORRECTED: &str = r#"
ply = [{ name = "C", material = "nextel440-bf20", thickness = "0.8 mm" }]
sensor = [{ name = "A", depth = "0.3 mm" }]
[hot_face]
kind = "heated"
flux = [["0 s", "9 W/cm^2"], ["30 s", "4 W/cm^2"]]
recovery_enthalpy = [["0 s", "12 MJ/kg"], ["30 s", "2 MJ/kg"]]
"#;

const UNHINDERED: &str = r#"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "C", material = "chain", thickness = "3 mm" },
    { name = "F", material = "chain", thickness = "1 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.4 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["10 s", "1100 K"], ["30 s", "500 K"]]
temperature.outside = "hold"
[back_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["30 s", "900 K"]]
temperature.outside = "hold"
[gas]
flow = "unhindered"
gas = "pyrolysis"
"#;

const ABSOLUTE: &str = r#"
decomposition = true
pressure.points = [["0 s", "5 kPa"], ["20 s", "8 kPa"]]
pressure.outside = "hold"
ply = [
    { name = "C", material = "tacot", thickness = "2 mm" },
    { name = "F", material = "tacot", thickness = "4 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.4 mm" }]
[hot_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["5 s", "1600 K"], ["25 s", "1600 K"], ["30 s", "600 K"]]
temperature.outside = "hold"
[back_face]
kind = "held"
temperature.points = [["0 s", "300 K"], ["30 s", "700 K"]]
temperature.outside = "hold"
pressure.points = [["0 s", "6 kPa"], ["20 s", "7 kPa"]]
pressure.outside = "hold"
[gas]
flow = "darcy"
gas = "tacot"
"#;

const SEALED: &str = r#"
contact_conductance = "500 W/m^2/K"
decomposition = true
pressure.points = [["0 s", "5 kPa"], ["20 s", "8 kPa"]]
pressure.outside = "hold"
ply = [
    { name = "C", material = "chain", thickness = "3 mm" },
    { name = "F", material = "chain", thickness = "2 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.4 mm" }]
[hot_face]
kind = "heated"
radiant_flux.points = [["0 s", "0 W/cm^2"], ["1 s", "8 W/cm^2"], ["20 s", "8 W/cm^2"], ["21 s", "0 W/cm^2"]]
radiant_flux.outside = "zero"
[back_face]
kind = "insulated"
[gas]
flow = "darcy"
gas = "pyrolysis"
"#;

const AIR: &str = r#"
pressure.points = [["0 s", "3 kPa"], ["5 s", "3 kPa"], ["6 s", "3.5 kPa"]]
pressure.outside = "hold"
contact_conductance = "500 W/m^2/K"
ply = [
    { name = "C", material = "nextel440-bf20", thickness = "0.5 mm" },
    { name = "F", material = "saffil-96", thickness = "4 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "1.4 mm" }]
[hot_face]
kind = "convective"
heat_transfer_coefficient = "100 W/m^2/K"
gas.points = [["0 s", "300 K"], ["5 s", "1200 K"]]
gas.outside = "hold"
[back_face]
kind = "cooled"
heat_transfer_coefficient = "10 W/m^2/K"
ambient = "300 K"
pressure.points = [["0 s", "3 kPa"], ["10 s", "3.2 kPa"]]
pressure.outside = "hold"
[gas]
flow = "darcy"
gas = "air"
"#;

/// Fronts pass from the second ply into the third, of the same material; first and last ply have different states.
const FRONTS: &str = r#"
decomposition = true
pressure = "8 kPa"
ply = [
    { name = "C", material = "chain", thickness = "0.5 mm" },
    { name = "F", material = "pyrogel3350", thickness = "0.3 mm" },
    { name = "G", material = "pyrogel3350", thickness = "0.9 mm" },
    { name = "I", material = "saffil-96", thickness = "1 mm" },
]
sensor = [{ name = "A", below = "C" }, { name = "B", depth = "0.9 mm" }]
[hot_face]
kind = "heated"
radiant_flux.points = [["0 s", "0 W/cm^2"], ["1 s", "14 W/cm^2"], ["28 s", "14 W/cm^2"], ["29 s", "0 W/cm^2"]]
radiant_flux.outside = "zero"
[back_face]
kind = "cooled"
heat_transfer_coefficient = "5 W/m^2/K"
ambient = "290 K"
[gas]
flow = "unhindered"
gas = "pyrolysis"
"#;

/// Factors of a case, by group and property; those without a target are left out.
const FACTORS: &[(&str, &str)] = &[
    ("C", "conductivity"),
    ("C", "heat_capacity"),
    ("C", "density"),
    ("C", "emissivity"),
    ("C", "thickness"),
    ("C", "pre_exponential"),
    ("C", "activation_energy"),
    ("C", "pyrolysis_heat"),
    ("C", "char_yield"),
    ("C", "permeability"),
    ("C", "contact_conductance"),
    ("F", "conductivity.solid"),
    ("F", "conductivity.gas"),
    ("F", "conductivity.radiative"),
    ("F", "density"),
    ("F", "pre_exponential"),
    ("F", "activation_energy"),
    ("F", "pyrolysis_heat"),
    ("F", "char_yield"),
    ("F", "contact_conductance"),
    ("F", "permeability"),
    ("", "heating"),
    ("", "back_face_loss"),
    ("", "holder_loss"),
    ("B", "sensor_depth"),
    ("D", "sensor_depth"),
];

fn factor((group, property): &(&str, &str)) -> String {
    let group_line = if group.is_empty() { String::new() } else { format!("group = \"{group}\"\n") };
    let name = format!("f_{group}_{}", property.replace('.', "_"));
    // Sensor D lies on the back face, and cannot lie deeper; the range of B has several nodes.
    let (lowest, highest) = if *group == "D" {
        (0.6, 1.0)
    } else if *group == "B" {
        (0.6, 1.3)
    } else {
        (0.8, 1.2)
    };
    let bounds = format!("small = [0.9, {:?}]\nlarge = [{lowest:?}, {highest:?}]\n", 1.1_f64.min(highest));
    format!("[[factor]]\nname = \"{name}\"\nproperty = \"{property}\"\n{group_line}{bounds}")
}

/// The case of a text with every factor that applies.
fn case(text: &str) -> Case {
    let files = [("chain", CHAIN), ("melting", MELTING), ("steep", STEEP_MATERIAL), ("states", STEEP_STATES_MATERIAL)];
    let files = BTreeMap::from(files.map(|(name, text)| (format!("materials/{name}.toml"), text.to_owned())));
    let top = "initial_temperature = \"300 K\"\nduration = \"30 s\"\n";
    // Four cells a ply are the least.
    let cells = (4 * text.matches("thickness").count()).max(12);
    let resolution = format!("{RESOLUTION}\ncells = {cells}");
    let load = |factors: &str| Case::from_toml(&format!("{top}{text}{resolution}\n{factors}"), "short", &files);
    load("").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut factors = String::new();
    for one in FACTORS.iter().map(factor) {
        if load(&format!("{factors}{one}")).is_ok() {
            factors += &one;
        }
    }
    load(&factors).unwrap_or_else(|error| panic!("{error}"))
}

/// All numbers of the members that do not diverge, and the status of all members.
fn numbers(all: &Traces) -> (Vec<f64>, &[MemberStatus]) {
    let mut traces = Traces::empty(all.first, all.sensors, all.instants);
    for member in (0..all.members()).filter(|&member| !matches!(all.statuses[member], MemberStatus::Diverged { .. })) {
        traces.extend(all, member..member + 1);
    }
    let heats = traces.balances.iter().flat_map(|b| {
        let faces =
            [b.hot_in_j_m2, b.hot_out_j_m2, b.back_in_j_m2, b.back_out_j_m2, b.holder_in_j_m2, b.holder_out_j_m2];
        let gas = [
            b.solid_lost_kg_m2,
            b.gas_in_kg_m2,
            b.gas_out_kg_m2,
            b.gas_stored_kg_m2,
            b.gas_heat_j_m2,
            b.reaction_gain_j_m2,
        ];
        faces.into_iter().chain([b.stored_j_m2]).chain(gas)
    });
    let extremes = traces.extremes_k.iter().flat_map(|&(low, high)| [low, high]);
    let readings = traces.temperatures_k.iter().chain(&traces.limited_k);
    let numbers = readings.chain(&traces.gauges).copied().chain(heats).chain(extremes);
    (numbers.collect(), &all.statuses)
}

/// Members of each march.
pub(super) const MEMBERS: usize = 4;
/// Steps a dispatch: few, so that the state is saved and loaded in between.
pub(super) const STRIDE: u32 = 7;
/// Threads a member in cooperative kernels: twelve cells are four blocks of three, and one thread is idle.
pub(super) const THREADS: u32 = 5;
/// Allowed difference of a cooperative kernel in double precision, relative to one plus the number: rounding by another
/// order of elimination.
const ROUNDING: f64 = 1e-9;

/// The cases as targets of mutants, one thread a member.
pub(super) fn all_targets(device: &Device, precision: Precision) -> Vec<Target> {
    CASES.iter().map(|case| target(device, case, precision, 1)).collect()
}

/// A case without gas, quasi-steady gas and Darcy flow.
pub(super) fn some_targets(device: &Device, precision: Precision) -> Vec<Target> {
    let chosen = CASES.iter().filter(|(_, text)| [INERT, QUASI_STEADY, ABSOLUTE].contains(text));
    chosen.map(|case| target(device, case, precision, 1)).collect()
}

/// Cooperative targets: a holder and quasi-steady gas, and Darcy flow of air and of pyrolysis gas, whose kernels
/// compile for up to half a minute.
pub(super) fn cooperative_targets(device: &Device) -> Vec<Target> {
    of_cooperative(device, &[HELD, QUASI_STEADY, AIR, ABSOLUTE])
}

fn of_cooperative(device: &Device, texts: &[&str]) -> Vec<Target> {
    let chosen = CASES.iter().filter(|(_, text)| texts.contains(text));
    chosen.map(|case| target(device, case, Precision::F64, THREADS)).collect()
}

/// Members of a case that a device marches in dispatches of a few steps.
pub(super) struct ShortMarch {
    device: Device,
    pub(super) plan: Plan,
    drawn: Ensemble,
    /// The factor of the heating, which makes the last member diverge.
    heating: Option<usize>,
    precision: Precision,
    threads: u32,
    cells: usize,
    reads_texels: bool,
}

impl ShortMarch {
    pub(super) fn new(device: &Device, text: &str, precision: Precision, threads: u32) -> Self {
        let case = case(text);
        let sampling = Sampling { kind: SamplingKind::Uniform, seed: 2026 };
        let drawn = Ensemble::sample(&case.factors, Bounds::Large, &sampling, MEMBERS);
        let heating = case.factors.iter().position(|factor| factor.property == Property::Heating);
        let mut plan = Plan::new(&case);
        // An added factor, which scales nothing, holds the number of the mutant.
        plan.rows.factors += 1;
        let cells = if device.checks { plan.cells() } else { shader::column_cells(&plan, usize::MAX, threads) };
        let mut device = device.clone();
        // A software device would take dispatches as long as possible.
        device.is_software = false;
        Self { device, plan, drawn, heating, precision, threads, cells, reads_texels: precision == Precision::F32 }
    }

    /// The kernel, with a variable that holds the number of the mutant.
    pub(super) fn source(&self) -> String {
        let plan = &self.plan;
        let kernel = shader::column_lengths(plan, self.cells, self.threads)
            + &shader::source_without_lengths(plan, self.precision, self.reads_texels, self.threads, shader::MARCH);
        let (entry, mutant) = ("    let own_member = member_of(", mutants::VARIABLE);
        assert!(kernel.contains(entry), "the kernel has the entry point of the march");
        let row = plan.rows.factors - 1;
        let kernel = kernel.replacen(entry, &format!("    {mutant} = u32(factors[{row}u * run.members]);\n{entry}"), 1);
        format!("{kernel}var<private> {mutant}: u32;\n")
    }

    fn ensemble(&self, mutant: u32) -> Ensemble {
        let members = (0..MEMBERS).flat_map(|member| {
            let mut factors = [self.drawn.member(member), vec![mutant.into()]].concat();
            // The last member diverges, if anything heats it.
            self.heating.filter(|_| member + 1 == MEMBERS).into_iter().for_each(|heating| factors[heating] = 1e6);
            factors
        });
        Ensemble::from_values(self.plan.rows.factors, members.collect())
    }

    /// The results of a pipeline; `None` if a dispatch is cut short.
    pub(super) fn march(&self, pipeline: &wgpu::ComputePipeline, mutant: u32) -> Option<Traces> {
        match self.precision {
            Precision::F32 => self.march_in::<f32>(pipeline, mutant),
            Precision::F64 => self.march_in::<f64>(pipeline, mutant),
        }
    }

    fn march_in<W: DeviceScalar>(&self, pipeline: &wgpu::ComputePipeline, mutant: u32) -> Option<Traces> {
        let mut pipeline = Pipeline {
            compute: pipeline.clone(),
            source: String::new(),
            cells: self.cells,
            threads_per_member: self.threads,
            is_differentiated: false,
            reads_texels: self.reads_texels,
            measured: Some((MEMBERS as u32, STRIDE)),
        };
        let (device, plan, ensemble) = (&self.device, &self.plan, self.ensemble(mutant));
        let carried = (0..MEMBERS).map(|member| Invocation { member, direction: None }).collect();
        let batch = Batch::begin::<W>(device, &mut pipeline, plan, &ensemble, carried).expect("the batch begins");
        let (traces, _) = batch.finish::<W>(device, plan).ok()?;
        Some(readings(traces, plan, &trace_rows(plan, &ensemble, 0..MEMBERS, &[])))
    }
}

fn target(device: &Device, (name, text): &(&str, &str), precision: Precision, threads: u32) -> Target {
    let short = ShortMarch::new(device, text, precision, threads);
    let kernel = Kernel::parse(short.source()).expect("the kernel is sound");
    let expected =
        ScalarReference(precision).march(&short.plan, &short.ensemble(0), 0..MEMBERS).expect("the processor marches");
    let agrees = move |pipeline: &wgpu::ComputePipeline, mutant: u32| {
        let Some(traces) = short.march(pipeline, mutant) else { return false };
        let ((found, found_status), (expected, expected_status)) = (numbers(&traces), numbers(&expected));
        let alike = |(a, b): (&f64, &f64)| {
            if threads == 1 { a.to_bits() == b.to_bits() } else { (a - b).abs() <= ROUNDING * (1.0 + b.abs()) }
        };
        found_status == expected_status && found.len() == expected.len() && found.iter().zip(&expected).all(alike)
    };
    let name = format!("{name} in {precision:?} on {threads} threads");
    Target { name, entry: "march", kernel, agrees: Box::new(agrees) }
}

fn agree(device: &Device, targets: Vec<Target>) {
    for target in targets {
        let kernel = mutants::mutated(&target.kernel, &[]);
        let pipeline = device.pipeline(&kernel, target.entry).expect("the driver compiles it");
        assert!((target.agrees)(&pipeline, 0), "{}", target.name);
    }
}

#[test]
fn short_marches_on_the_gpu_are_bit_identical_to_the_processor_in_single_precision() {
    let device = super::device(false);
    agree(&device, all_targets(&device, Precision::F32));
}

/// Some cases, or with `BONDLINE_ALL` all: these kernels compile longer.
#[test]
fn short_marches_on_the_gpu_are_bit_identical_to_the_processor_in_double_precision() {
    let device = super::device(false);
    let targets = if runs_all() { all_targets } else { some_targets };
    agree(&device, targets(&device, Precision::F64));
}

/// Without Darcy flow, or with `BONDLINE_ALL` all.
#[test]
fn short_cooperative_marches_agree_with_the_processor_within_rounding() {
    let device = super::device(false);
    let targets =
        if runs_all() { cooperative_targets(&device) } else { of_cooperative(&device, &[HELD, QUASI_STEADY]) };
    agree(&device, targets);
}
