//! Every key that the reader asks for changes an answer or the page, or is refused where it has no effect. The keys are
//! those of the reader itself, so that a new one without a row here fails; and those of the book are the same.

use super::super::spanned_toml::{SpannedValue, requests};
use super::Scratch;
use crate::case::error::Diagnostics;
use crate::case::{Case, CaseError};
use crate::question::Study;
use crate::report::files::OutputFolder;
use crate::session::{BackendKind, Options, Session};
use crate::support::text;
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};

/// Members of a sweep.
const MEMBERS: usize = 4;

/// A kind of file, and the tables of it that have a key; `*` is any name or index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Case,
    Material,
    Gas,
}
use Kind::{Case as C, Gas as G, Material as M};

/// What a key is given: the first of some values that is not its own, and a text that the page then has, for a key that
/// no number depends on.
struct Row {
    kind: Kind,
    tables: &'static [&'static str],
    keys: &'static [&'static str],
    values: &'static [&'static str],
    shown: Option<&'static str>,
}

const fn row(
    kind: Kind,
    tables: &'static [&'static str],
    keys: &'static [&'static str],
    values: &'static [&'static str],
) -> Row {
    Row { kind, tables, keys, values, shown: None }
}

const fn shown(
    kind: Kind,
    tables: &'static [&'static str],
    keys: &'static [&'static str],
    value: &'static [&'static str; 1],
    text: &'static str,
) -> Row {
    Row { kind, tables, keys, values: value, shown: Some(text) }
}

/// Tables of schedules, and of the properties of a material and its residues.
const SCHEDULES: &[&str] = &["pressure", "hot_face.*", "back_face.*", "holder.*"];
const PROPERTIES: &[&str] =
    &["heat_capacity", "conductivity", "emissivity", "decomposition.char.*", "decomposition.intermediate.*.*"];
const CONDUCTIVITIES: &[&str] =
    &["conductivity", "decomposition.char.conductivity", "decomposition.intermediate.*.conductivity"];
const PORES: &[&str] = &["pores", "decomposition.char.pores", "decomposition.intermediate.*.pores"];
const MARKED: &[&str] = &["density", "heat_capacity", "conductivity", "emissivity", "pores", "decomposition"];
const TIMES: &[&str] = &["observations.time", "trajectory.time", "hot_face.*.time", "back_face.*.time"];
const PYROMETERS: &[&str] = &["sensor.*", "hot_face.temperature.pyrometer"];

const PYROMETER: &str =
    "{ wavelength = \"1 um\", emissivity = 0.8, face_emissivity = 0.8, face_emissivity_deviation = 0.01 }";

const ROWS: &[Row] = &[
    shown(C, &[""], &["name"], &["\"Another title\""], "Another title"),
    shown(C, &[""], &["note"], &["\"Another note\""], "Another note"),
    row(C, &[""], &["duration"], &["\"25 s\""]),
    row(C, &[""], &["initial_temperature"], &["\"320 K\""]),
    row(C, &[""], &["pressure"], &["\"30 kPa\""]),
    row(C, &["", "ply.*"], &["decomposition"], &["true", "false"]),
    row(C, &[""], &["contact_conductance"], &["\"90 W/m^2/K\""]),
    row(C, &[""], &["contact_resistance"], &["\"9e-3 m^2 K/W\""]),
    row(C, &[""], &["trajectory"], &["{ file = \"other.csv\", outside = \"hold\" }"]),
    row(C, &[""], &["back_face"], &["{ kind = \"held\", temperature = \"310 K\" }"]),
    row(C, &[""], &["holder"], &["{ conductance = \"20 kW/m^3/K\", temperature = \"300 K\" }"]),
    row(C, &[""], &["gas"], &["{ flow = \"unhindered\" }", "{ flow = \"darcy\" }"]),
    row(C, &[""], &["factor"], &["[{ name = \"f\", property = \"heating\", small = [0.9, 1.2] }]"]),
    row(C, &[""], &["correlation"], &["[{ factors = [\"f_k\", \"f_e\"], value = 0.9 }]"]),
    row(C, &[""], &["observations"], &["{ TC1 = [[\"0 s\", \"300 K\"]], sigma = \"2 K\" }"]),
    row(C, &[""], &["estimate"], &["{ factors = [\"f_k\"] }"]),
    row(C, &[""], &["resolution"], &["{ cells = 20 }"]),
    shown(C, &["ply.*"], &["name"], &["\"ANOTHER\""], "ANOTHER"),
    row(C, &["ply.*"], &["thickness"], &["\"2.5 mm\""]),
    row(C, &["ply.*"], &["group"], &["\"INS\"", "\"OF\""]),
    row(C, &["ply.*"], &["material"], &["\"saffil_96\""]),
    row(C, &["ply.*"], &["contact_below"], &["\"70 W/m^2/K\""]),
    row(C, &["ply.*"], &["limit", "limit_below"], &["\"444 K\""]),
    shown(C, &["sensor.*"], &["name"], &["\"ANOTHER\""], "ANOTHER"),
    row(C, &["sensor.*"], &["kind"], &["\"pyrometer\"", "\"thermocouple\""]),
    row(C, &["sensor.*"], &["below"], &["\"BASE\"", "\"TOP\""]),
    row(C, &["sensor.*"], &["depth"], &["\"1.2 mm\""]),
    row(C, &["sensor.*"], &["side"], &["\"above\"", "\"below\""]),
    row(C, &["sensor.*"], &["time_constant"], &["\"2 s\""]),
    row(C, &["sensor.*"], &["limit"], &["\"444 K\""]),
    row(C, PYROMETERS, &["wavelength"], &["\"1.1 um\""]),
    row(C, PYROMETERS, &["band"], &["[\"3 um\", \"5 um\"]"]),
    row(C, PYROMETERS, &["emissivity"], &["0.7"]),
    row(C, &["hot_face.temperature.pyrometer"], &["face_emissivity"], &["0.75"]),
    row(C, &["hot_face.temperature.pyrometer"], &["face_emissivity_deviation"], &["0.09"]),
    row(C, &["hot_face.temperature.pyrometer"], &["surroundings"], &["\"600 K\""]),
    row(C, &["hot_face"], &["kind"], &["\"convective\""]),
    row(C, &["back_face"], &["kind"], &["\"insulated\""]),
    row(C, &["hot_face"], &["flux", "radiant_flux"], &["\"3 W/cm^2\""]),
    row(C, &["hot_face"], &["recovery_enthalpy"], &["\"7 MJ/kg\""]),
    row(C, &["hot_face"], &["enthalpy_film_coefficient"], &["\"0.02 kg/m^2/s\""]),
    row(C, &["hot_face"], &["blowing"], &["0.2"]),
    row(C, &["hot_face", "back_face"], &["heat_transfer_coefficient"], &["\"33 W/m^2/K\""]),
    row(C, &["hot_face"], &["gas"], &["\"700 K\""]),
    row(C, &["hot_face", "back_face"], &["emissivity"], &["0.33"]),
    row(C, &["hot_face", "back_face"], &["surroundings"], &["\"200 K\""]),
    row(C, &["hot_face", "back_face", "holder"], &["temperature"], &["\"350 K\""]),
    row(C, &["hot_face"], &["at"], &["\"0.8 mm\""]),
    row(C, &["back_face"], &["ambient"], &["\"280 K\""]),
    row(C, &["back_face"], &["conductance"], &["\"44 W/m^2/K\""]),
    row(C, &["back_face"], &["pressure"], &["\"90 kPa\""]),
    row(C, &["holder"], &["conductance"], &["\"55 kW/m^3/K\""]),
    row(C, &["gas"], &["flow"], &["\"unhindered\"", "\"quasi-steady\""]),
    row(C, &["gas"], &["gas"], &["\"nitrogen\""]),
    row(C, SCHEDULES, &["file"], &["\"other.csv\""]),
    row(C, SCHEDULES, &["column"], &["\"second\""]),
    row(C, SCHEDULES, &["points"], &["[[\"0 s\", \"1 W/cm^2\"], [\"9 s\", \"2 W/cm^2\"]]", "[[\"0 s\", \"50 kPa\"]]"]),
    row(C, SCHEDULES, &["time"], &["\"late_s\""]),
    row(C, SCHEDULES, &["unit"], &["\"kW/m^2\"", "\"degF\"", "\"psf\""]),
    row(C, SCHEDULES, &["outside"], &["\"zero\"", "\"hold\""]),
    row(C, &["hot_face.temperature", "back_face.temperature"], &["noise"], &["\"9 K\""]),
    row(C, &["hot_face.temperature", "back_face.temperature"], &["pyrometer"], &[PYROMETER]),
    row(
        C,
        &["pressure", "hot_face.*", "back_face.*", "holder.*", "observations", "trajectory"],
        &["sheet"],
        &["\"B\""],
    ),
    row(
        C,
        &["pressure", "hot_face.*", "back_face.*", "holder.*", "observations", "trajectory"],
        &["range"],
        &["\"A1:B3\""],
    ),
    row(
        C,
        &["pressure", "hot_face.*", "back_face.*", "holder.*", "observations", "trajectory"],
        &["missing"],
        &["[\"OPEN\", 7]", "[430]"],
    ),
    row(C, TIMES, &["column"], &["\"late_s\""]),
    row(C, TIMES, &["unit"], &["\"min\""]),
    row(C, TIMES, &["offset"], &["\"2 s\""]),
    row(C, &["trajectory"], &["file"], &["\"other.csv\""]),
    row(C, &["trajectory", "observations"], &["time"], &["\"late_s\""]),
    row(C, &["trajectory"], &["outside"], &["\"zero\""]),
    row(C, &["initial_temperature"], &["points"], &["[[\"0 mm\", \"333 K\"]]"]),
    row(C, &["initial_temperature"], &["outside"], &["\"zero\""]),
    row(C, &["factor.*"], &["name"], &["\"f_other\""]),
    row(C, &["factor.*"], &["group"], &["\"OF\"", "\"INS\""]),
    row(C, &["factor.*"], &["property"], &["\"heat_capacity\"", "\"density\""]),
    row(C, &["factor.*"], &["state"], &["\"char\"", "\"virgin\""]),
    row(C, &["factor.*"], &["nominal"], &["1.05"]),
    row(C, &["factor.*"], &["small"], &["[0.93, 1.16]"]),
    row(C, &["factor.*"], &["large"], &["[0.4, 1.9]"]),
    row(C, &["correlation.*"], &["factors"], &["[\"f_e\", \"f_q\"]"]),
    row(C, &["correlation.*"], &["value"], &["0.2"]),
    row(C, &["observations"], &["file"], &["\"seen-too.csv\""]),
    row(C, &["observations", "observations.*"], &["sigma"], &["\"6 K\""]),
    row(C, &["observations.*"], &["window"], &["[\"4 s\", \"9 s\"]"]),
    row(C, &["observations.*"], &["column"], &["\"third\""]),
    row(C, &["observations.*"], &["unit"], &["\"degR\""]),
    row(C, &["observations.*"], &["samples"], &["[[\"0 s\", \"300 K\"], [\"8 s\", \"390 K\"], [\"15 s\", \"420 K\"]]"]),
    row(C, &["estimate"], &["factors"], &["[\"f_k\"]"]),
    row(C, &["estimate"], &["sensors"], &["[\"TC2\"]"]),
    row(C, &["estimate"], &["window"], &["[\"3 s\", \"17 s\"]"]),
    row(C, &["estimate"], &["bounds"], &["\"small\"", "\"large\""]),
    row(C, &["estimate"], &["loss_function"], &["\"soft-l1=0.1\""]),
    row(C, &["estimate"], &["prior"], &["\"large\"", "\"small\""]),
    row(C, &["estimate"], &["start"], &["{ f_k = 1.07 }"]),
    row(C, &["resolution"], &["tolerance"], &["\"2 K\""]),
    row(C, &["resolution"], &["cells"], &["25"]),
    row(C, &["resolution"], &["first_step"], &["\"50 ms\""]),
    row(C, &["resolution"], &["max_step"], &["\"0.8 s\""]),
    row(C, &["resolution"], &["step_growth"], &["0.3"]),
    row(C, &["resolution"], &["output_interval"], &["\"2.5 s\""]),
    shown(M, &[""], &["name"], &["\"Another title\""], "Another title"),
    shown(M, &[""], &["note"], &["\"Another note\""], "Another note"),
    row(M, &["density"], &["value"], &["\"333 kg/m^3\""]),
    shown(M, MARKED, &["mark"], &["\"remembered\""], "remembered, not verified"),
    shown(M, MARKED, &["source"], &["\"another source\""], "another source"),
    shown(M, MARKED, &["uncertainty"], &["\"77.8 %\""], ">39"),
    row(M, PROPERTIES, &["value"], &["0.6", "\"0.3 W/m/K\"", "\"1234 J/kg/K\""]),
    row(M, PROPERTIES, &["temperatures_k"], &["[250, 700, 2500]"]),
    row(M, PROPERTIES, &["temperatures"], &["[450, 900, 4500]"]),
    row(M, PROPERTIES, &["temperature_unit"], &["\"degF\""]),
    row(M, PROPERTIES, &["unit"], &["\"kJ/kg/degR\"", "\"BTU/ft/h/degF\""]),
    row(M, PROPERTIES, &["values"], &["[0.6, 0.9, 0.7]"]),
    row(M, PROPERTIES, &["outside"], &["\"error\"", "\"clamp\""]),
    row(M, PROPERTIES, &["times_virgin"], &["0.7"]),
    row(M, CONDUCTIVITIES, &["at"], &["[{ pressure = \"1 kPa\", value = \"0.1 W/m/K\" }]"]),
    row(M, &["*.at.*"], &["temperatures_k"], &["[250, 700, 2500]"]),
    row(M, &["*.at.*"], &["temperatures"], &["[450, 900, 4500]"]),
    row(M, &["*.at.*"], &["temperature_unit"], &["\"degF\""]),
    row(M, &["*.at.*"], &["unit"], &["\"BTU/ft/h/degF\""]),
    row(M, &["*.at.*"], &["values"], &["[0.06, 0.09, 0.08]"]),
    row(M, &["*.at.*"], &["outside"], &["\"error\"", "\"extrapolate\""]),
    row(M, &["*.at.*", "decomposition.*.*.at.*"], &["pressure"], &["\"30 kPa\""]),
    row(M, &["*.at.*", "decomposition.*.*.at.*"], &["value"], &["\"0.4 W/m/K\""]),
    row(M, CONDUCTIVITIES, &["solid"], &["\"0.2 W/m/K\""]),
    row(M, CONDUCTIVITIES, &["solid_exponent"], &["0.7"]),
    row(M, CONDUCTIVITIES, &["extinction"], &["\"900 1/m\""]),
    row(M, CONDUCTIVITIES, &["specific_extinction"], &["\"9 m^2/kg\""]),
    shown(M, &["conductivity"], &["range"], &["[\"234 K\", \"2345 K\"]"], "234 to 2,345"),
    shown(
        M,
        &["decomposition.char.conductivity"],
        &["range"],
        &["[\"200 K\", \"310 K\"]"],
        "conductivity of char ends",
    ),
    row(M, &["conductivity.pores.*", "decomposition.*.*.pores.*"], &["share"], &["0.5"]),
    row(M, &["conductivity.pores.*", "decomposition.*.*.pores.*"], &["length"], &["\"10 um\""]),
    row(M, CONDUCTIVITIES, &["pores"], &["[{ share = 0.9, length = \"20 um\" }]"]),
    row(M, PORES, &["porosity"], &["0.3"]),
    row(M, PORES, &["permeability"], &["\"4e-12 m^2\""]),
    row(M, PORES, &["pore_radius"], &["\"0.2 um\""]),
    row(M, PORES, &["forchheimer_coefficient"], &["\"1e9 1/m\""]),
    row(M, &["decomposition"], &["reaction_scheme"], &["\"parallel\"", "\"consecutive\""]),
    row(M, &["decomposition"], &["mixture_rule"], &["\"volume\"", "\"mass\""]),
    row(M, &["decomposition"], &["heat"], &["\"absolute\"", "\"of-reaction\""]),
    row(M, &["decomposition"], &["shrinkage"], &["0.2"]),
    row(M, &["decomposition"], &["virgin_enthalpy"], &["\"-100 kJ/kg\""]),
    row(M, &["decomposition"], &["reference"], &["\"350 K\""]),
    row(M, &["decomposition.reaction.*"], &["order"], &["2"]),
    row(M, &["decomposition.reaction.*"], &["mass_loss"], &["0.15"]),
    row(M, &["decomposition.reaction.*"], &["volume_share"], &["0.4"]),
    row(M, &["decomposition.reaction.*"], &["virgin_density"], &["\"390 kg/m^3\""]),
    row(M, &["decomposition.reaction.*"], &["char_density"], &["\"150 kg/m^3\""]),
    row(M, &["decomposition.reaction.*"], &["pre_exponential"], &["\"5e6 1/s\""]),
    row(M, &["decomposition.reaction.*"], &["activation_energy"], &["\"60 kJ/mol\""]),
    row(M, &["decomposition.reaction.*"], &["onset_temperature"], &["\"480 K\""]),
    row(M, &["decomposition.reaction.*"], &["heat"], &["\"3 MJ/kg\""]),
    row(M, &["decomposition.char"], &["enthalpy"], &["\"50 kJ/kg\""]),
    row(M, &["decomposition.intermediate.*"], &["enthalpy"], &["\"50 kJ/kg\""]),
    row(M, &["decomposition.char", "decomposition.intermediate.*"], &["density"], &["\"77 kg/m^3\""]),
    row(
        M,
        &["decomposition.char", "decomposition.intermediate.*"],
        &["heat_capacity"],
        &["{ value = \"700 J/kg/K\" }"],
    ),
    row(M, &["decomposition.char", "decomposition.intermediate.*"], &["conductivity"], &["{ value = \"0.9 W/m/K\" }"]),
    row(M, &["decomposition.char", "decomposition.intermediate.*"], &["emissivity"], &["{ value = 0.2 }"]),
    row(M, &["decomposition.char", "decomposition.intermediate.*"], &["pores"], &["{ permeability = \"9e-12 m^2\" }"]),
    shown(M, &["decomposition.intermediate.*"], &["name"], &["\"soot\""], "soot"),
    row(M, &["decomposition"], &["char"], &["{ emissivity = { value = 0.3 } }"]),
    row(M, &["decomposition"], &["intermediate"], &["[{ name = \"tar\" }]"]),
    row(M, &[""], &["pores"], &["{ porosity = 0.5, permeability = \"1e-12 m^2\" }"]),
    row(M, &[""], &["decomposition"], &["{ shrinkage = 0.1 }"]),
    shown(G, &[""], &["name"], &["\"Another title\""], "Another title"),
    shown(G, &[""], &["note"], &["\"Another note\""], "Another note"),
    shown(G, &[""], &["mark"], &["\"remembered\""], "remembered, not verified"),
    shown(G, &[""], &["source"], &["\"another source\""], "another source"),
    shown(G, &[""], &["uncertainty"], &["\"77.8 %\""], ">39"),
    row(G, &["molar_mass", "viscosity"], &["value"], &["\"60 g/mol\"", "\"9e-5 Pa*s\""]),
    row(G, &["viscosity", "enthalpy"], &["temperatures_k"], &["[200, 500, 3000]"]),
    row(G, &["viscosity", "enthalpy"], &["temperatures"], &["[450, 900, 4500]"]),
    row(G, &["viscosity", "enthalpy"], &["temperature_unit"], &["\"degF\""]),
    row(G, &["molar_mass", "viscosity", "enthalpy"], &["unit"], &["\"kg/kmol\"", "\"hPa*s\"", "\"BTU/lb\""]),
    row(G, &["viscosity", "enthalpy"], &["values"], &["[2, 30, 900]"]),
    row(G, &["viscosity", "enthalpy"], &["outside"], &["\"error\"", "\"clamp\""]),
    row(G, &["enthalpy"], &["kind"], &["\"absolute\"", "\"sensible\""]),
    row(G, &["enthalpy"], &["value"], &["\"1 MJ/kg\""]),
    row(C, &["ply.*.material"], &["file"], &["\"other.toml\""]),
    row(C, &["gas.gas"], &["file"], &["\"other-gas.toml\""]),
];

/// Keys that no change of alone is accepted in a sample: they choose which other keys their table has.
const CHOOSERS: [&str; 8] =
    ["outside", "kind", "reaction_scheme", "heat", "intermediate", "decomposition", "value", "at"];

/// A heated layup of two plies with all that a case may state beside decomposition.
const HEATED: &str = r#"
name = "Heated"
note = "All keys of an inert case."
initial_temperature = { points = [["1 mm", "300 K"], ["2 mm", "310 K"]], outside = "hold" }
pressure = { points = [["0 s", "80 kPa"], ["9 s", "40 kPa"]], outside = "hold" }
contact_conductance = "500 W/m^2/K"
duration = "20 s"
[[ply]]
name = "TOP"
group = "OF"
material = "nextel440_bf20"
thickness = "0.5 mm"
limit_below = "700 K"
[[ply]]
name = "BASE"
group = "INS"
material = "own"
thickness = "2 mm"
contact_below = "300 W/m^2/K"
limit = "600 K"
[[ply]]
name = "BACK"
material = "table"
thickness = "1 mm"
[[sensor]]
name = "TC1"
below = "TOP"
side = "below"
time_constant = "0.5 s"
limit = "650 K"
[[sensor]]
name = "TC2"
depth = "2 mm"
[hot_face]
kind = "heated"
recovery_enthalpy = "9 MJ/kg"
radiant_flux = { points = [["0 s", "0.1 W/cm^2"], ["9 s", "0.5 W/cm^2"]], outside = "hold" }
heat_transfer_coefficient = "20 W/m^2/K"
gas = "500 K"
emissivity = 0.8
surroundings = "290 K"
[hot_face.flux]
file = "flux.csv"
column = "first"
time = { column = "t_s", offset = "-1 s" }
unit = "W/cm^2"
missing = ["OPEN"]
outside = "hold"
[back_face]
kind = "cooled"
heat_transfer_coefficient = "5 W/m^2/K"
ambient = { points = [["0 s", "300 K"], ["10 s", "320 K"]], outside = "hold" }
emissivity = 0.7
surroundings = "299 K"
[holder]
conductance = "20 kW/m^3/K"
temperature = { points = [["0 s", "300 K"], ["10 s", "320 K"]], outside = "hold" }
[[factor]]
name = "f_k"
group = "INS"
property = "conductivity"
nominal = 1.02
small = [0.9, 1.2]
large = [0.5, 1.5]
[[factor]]
name = "f_e"
group = "OF"
property = "heat_capacity"
small = [0.9, 1.1]
large = [0.6, 1.4]
[[factor]]
name = "f_q"
property = "heating"
small = [0.9, 1.1]
[[correlation]]
factors = ["f_k", "f_e"]
value = 0.6
[observations]
file = "seen.csv"
time = { column = "t_s", unit = "s", offset = "-1 s" }
missing = ["OPEN"]
sigma = "2 K"
TC1 = { column = "first", unit = "K", window = ["1 s", "15 s"], sigma = "3 K" }
TC2 = { column = "second", unit = "K" }
[estimate]
factors = ["f_k", "f_e"]
sensors = ["TC1", "TC2"]
window = ["0 s", "18 s"]
start = { f_k = 1.1 }
bounds = "large"
loss_function = "huber=2"
prior = "large"
[resolution]
cells = 18
first_step = "20 ms"
max_step = "0.5 s"
step_growth = 0.2
output_interval = "1 s"
"#;

/// A conductivity in three parts.
const OWN: &str = r#"
name = "Own"
note = "Three parts."
[density]
value = "100 kg/m^3"
mark = "read"
source = "a paper"
uncertainty = "10 %"
[heat_capacity]
temperatures_k = [250, 900, 2000]
values = [0.8, 1.0, 1.1]
unit = "kJ/kg/K"
outside = "extrapolate"
mark = "read"
source = "a paper"
uncertainty = "10 %"
[conductivity]
solid = "0.01 W/m/K"
solid_exponent = 0.2
pores = [{ share = 0.9, length = "1 um" }]
specific_extinction = "30 m^2/kg"
range = ["250 K", "1400 K"]
mark = "read"
source = "a paper"
uncertainty = "10 %"
[emissivity]
value = 0.9
mark = "read"
source = "a paper"
uncertainty = "10 %"
"#;

/// Tables in other units, and a conductivity per pressure.
const TABLE: &str = r#"
name = "Table"
[density]
value = "100 kg/m^3"
[heat_capacity]
temperatures = [400, 900, 3000]
temperature_unit = "degR"
values = [0.2, 0.3, 0.4]
unit = "BTU/lb/degR"
outside = "clamp"
[[conductivity.at]]
pressure = "10 kPa"
temperatures = [450, 620, 660]
temperature_unit = "degR"
values = [0.03, 0.04, 0.05]
unit = "W/m/K"
outside = "clamp"
[[conductivity.at]]
pressure = "100 kPa"
temperatures_k = [250, 400, 500]
values = [0.1, 0.12, 0.13]
unit = "W/m/K"
outside = "clamp"
[emissivity]
temperatures_k = [250, 320, 350]
values = [0.8, 0.7, 0.6]
outside = "clamp"
"#;

/// Two reactions in parallel, one of them of a component of CMA, with Darcy flow.
const CHARRING: &str = r#"
name = "Charring"
initial_temperature = "300 K"
pressure = "60 kPa"
duration = "20 s"
decomposition = true
contact_resistance = "1e-3 m^2 K/W"
[[ply]]
name = "TOP"
group = "INS"
material = "char"
thickness = "2 mm"
[[ply]]
name = "BASE"
material = "char"
decomposition = false
thickness = "1 mm"
[[sensor]]
name = "TC1"
below = "TOP"
[hot_face]
kind = "heated"
enthalpy_film_coefficient = "0.03 kg/m^2/s"
recovery_enthalpy = "12 MJ/kg"
blowing = 0.5
[back_face]
kind = "held"
temperature = { points = [["0 s", "300 K"], ["9 s", "305 K"]], outside = "hold" }
pressure = { points = [["0 s", "70 kPa"], ["9 s", "80 kPa"]], outside = "hold" }
[gas]
flow = "darcy"
gas = "own"
[[factor]]
name = "f_k"
group = "INS"
property = "conductivity"
state = "virgin"
small = [0.9, 1.2]
[resolution]
cells = 14
max_step = "0.4 s"
output_interval = "1 s"
"#;

const CHAR: &str = r#"
name = "Char"
[density]
value = "300 kg/m^3"
[heat_capacity]
value = "1100 J/kg/K"
[conductivity]
value = "0.3 W/m/K"
[emissivity]
value = 0.8
[pores]
porosity = 0.6
permeability = "1e-15 m^2"
pore_radius = "1 um"
forchheimer_coefficient = "1e6 1/m"
mark = "read"
source = "a paper"
uncertainty = "10 %"
[decomposition]
reaction_scheme = "parallel"
mixture_rule = "mass"
shrinkage = 0.1
heat = "of-reaction"
mark = "read"
source = "a paper"
uncertainty = "10 %"
[[decomposition.reaction]]
order = 1
mass_loss = 0.1
pre_exponential = "1e6 1/s"
activation_energy = "70 kJ/mol"
onset_temperature = "350 K"
heat = "1 MJ/kg"
[[decomposition.reaction]]
order = 3
volume_share = 0.5
virgin_density = "300 kg/m^3"
char_density = "200 kg/m^3"
pre_exponential = "1e7 1/s"
activation_energy = "80 kJ/mol"
onset_temperature = "320 K"
heat = "1 MJ/kg"
[decomposition.char]
heat_capacity = { times_virgin = 1.1 }
conductivity = { solid = "0.2 W/m/K", extinction = "3000 1/m", range = ["250 K", "3000 K"] }
emissivity = { temperatures_k = [250, 300, 350], values = [0.9, 0.85, 0.8], outside = "clamp" }
pores = { permeability = "2e-15 m^2", porosity = 0.7, pore_radius = "2 um", forchheimer_coefficient = "1e5 1/m" }
"#;

const GAS: &str = r#"
name = "Own gas"
note = "Made up."
mark = "read"
source = "a paper"
uncertainty = "3 %"
[molar_mass]
value = "25 g/mol"
[enthalpy]
kind = "sensible"
unit = "kJ/kg"
temperatures_k = [200, 400, 500]
values = [-100, 100, 250]
outside = "clamp"
[viscosity]
unit = "Pa*s"
temperatures = [360, 900, 1100]
temperature_unit = "degR"
values = [1e-5, 2e-5, 4e-5]
outside = "clamp"
"#;

/// Consecutive reactions with absolute heats, and gas that leaves at once.
const CONSECUTIVE: &str = r#"
name = "Consecutive"
initial_temperature = "300 K"
duration = "20 s"
decomposition = true
[[ply]]
name = "TOP"
material = { file = "tar.toml" }
thickness = "3 mm"
[[sensor]]
name = "TC1"
depth = "1 mm"
[hot_face]
kind = "convective"
heat_transfer_coefficient = "100 W/m^2/K"
gas = "1500 K"
[back_face]
kind = "holder"
conductance = "100 W/m^2/K"
temperature = "300 K"
[gas]
flow = "quasi-steady"
gas = { file = "gas.toml" }
[resolution]
cells = 14
max_step = "0.4 s"
output_interval = "1 s"
"#;

const TAR: &str = r#"
name = "Tar"
[density]
value = "300 kg/m^3"
[heat_capacity]
value = "1100 J/kg/K"
[conductivity]
value = "0.3 W/m/K"
[emissivity]
value = 0.8
[decomposition]
reaction_scheme = "consecutive"
mixture_rule = "volume"
heat = "absolute"
virgin_enthalpy = "-900 kJ/kg"
reference = "298 K"
reaction = [
  { order = 1, mass_loss = 0.3, pre_exponential = "1e6 1/s", activation_energy = "70 kJ/mol" },
  { order = 1, mass_loss = 0.2, pre_exponential = "1e5 1/s", activation_energy = "70 kJ/mol" },
]
[[decomposition.intermediate]]
name = "tar"
enthalpy = "-300 kJ/kg"
density = "210 kg/m^3"
heat_capacity = { value = "1200 J/kg/K" }
conductivity = { times_virgin = 0.8 }
emissivity = { value = 0.85 }
[decomposition.char]
enthalpy = "0 kJ/kg"
"#;

/// A held face in depth, whose driver is smoothed, and cells and steps by a tolerance.
const HELD: &str = r#"
name = "Held"
initial_temperature = "300 K"
duration = "20 s"
[[ply]]
name = "TOP"
material = "own"
thickness = "1 mm"
[[ply]]
name = "BASE"
group = "INS"
material = "own"
thickness = "3 mm"
[[sensor]]
name = "TC1"
below = "TOP"
[[sensor]]
name = "TC2"
depth = "2 mm"
[hot_face]
kind = "held"
at = "TC1"
temperature = { file = "driver.csv", column = "first", time = "t_s", unit = "K", noise = "1 K", outside = "hold" }
[[factor]]
name = "f_k"
group = "INS"
property = "conductivity"
small = [0.9, 1.2]
[observations]
sigma = "2 K"
TC2 = { samples = [["0 s", "300 K"], ["9 s", "320 K"], ["15 s", "350 K"]], window = ["0 s", "15 s"] }
[estimate]
factors = ["f_k"]
prior = "small"
[resolution]
tolerance = "0.5 K"
"#;

/// A held face that a pyrometer observes, in a workbook.
const OBSERVED: &str = r#"
name = "Observed"
initial_temperature = "800 K"
duration = "20 s"
[[ply]]
name = "TOP"
material = "own"
thickness = "3 mm"
[[sensor]]
name = "TC1"
depth = "2 mm"
[hot_face]
kind = "held"
[hot_face.temperature]
file = "run.xlsx"
sheet = "A"
range = "A1:C4"
column = "first"
unit = "K"
outside = "hold"
[hot_face.temperature.pyrometer]
wavelength = "1.6 um"
emissivity = 0.9
face_emissivity = 0.8
face_emissivity_deviation = 0.05
surroundings = "400 K"
[resolution]
cells = 14
max_step = "0.4 s"
output_interval = "1 s"
"#;

/// Schedules that read the columns of one table.
const FLIGHT: &str = r#"
name = "Flight"
initial_temperature = "300 K"
duration = "20 s"
pressure = { column = "p", unit = "kPa" }
trajectory = { file = "entry.csv", time = { column = "t_s", offset = "-1 s" }, missing = ["OPEN"], outside = "hold" }
[[ply]]
name = "TOP"
material = "table"
thickness = "3 mm"
[[sensor]]
name = "TC1"
depth = "2 mm"
[[sensor]]
name = "PY"
kind = "pyrometer"
wavelength = "0.9 um"
emissivity = 0.85
[[sensor]]
name = "PB"
kind = "pyrometer"
band = ["8 um", "14 um"]
emissivity = 0.9
[hot_face]
kind = "heated"
flux = { column = "first", unit = "W/cm^2", outside = "zero" }
[resolution]
cells = 14
max_step = "0.4 s"
output_interval = "1 s"
"#;

const FLUX: &str = "t_s,late_s,first,second\n1,2,1,2\n3,5,OPEN,7\n8,9,4,5\n12,15,7,3\n";
const SEEN: &str = "t_s,late_s,first,second,third\n1,2,300,300,301\n4,5,350,320,340\n8,9,OPEN,350,380\n\
                    12,13,500,7,430\n17,18,510,400,460\n";
const DRIVER: &str = "t_s,late_s,first,second\n0,0,300,300\n3,4,350,400\n6,8,420,450\n9,12,430,500\n12,16,460,510\n\
                      15,20,470,530\n18,24,500,560\n";
const ENTRY: &str = "t_s,late_s,p,first,second\n1,2,10,1,2\n5,9,40,OPEN,3\n9,12,80,6,7\n15,18,90,7,1\n";

/// A case with its files.
struct Sample {
    name: &'static str,
    /// Documents in TOML by path; the case has none.
    documents: BTreeMap<&'static str, Table>,
    tables: BTreeMap<String, Vec<u8>>,
}

fn workbook() -> Vec<u8> {
    let mut book = rust_xlsxwriter::Workbook::new();
    for (sheet, shift_k) in [("A", 0.0), ("B", 40.0)] {
        let sheet = book.add_worksheet().set_name(sheet).expect("a name");
        for (column, heading) in (0..).zip(["t_s", "first", "second"]) {
            sheet.write(0, column, heading).expect("a cell");
        }
        for (row, (time_s, first_k, second_k)) in (1..).zip([(0, 800, 810), (7, 900, 880), (16, 950, 990)]) {
            let cells = [f64::from(time_s), f64::from(first_k) + shift_k, f64::from(second_k)];
            (0..).zip(cells).for_each(|(column, cell)| {
                sheet.write(row, column, cell).expect("a cell");
            });
        }
    }
    book.save_to_buffer().expect("a workbook")
}

impl Sample {
    fn all() -> Vec<Self> {
        let of = |name, documents: &[(&'static str, &str)], tables: &[(&str, &str)]| {
            let parse = |&(path, text): &(&'static str, &str)| {
                (path, toml::from_str(text).unwrap_or_else(|error| panic!("{name} {path}: {error}")))
            };
            let tables = tables.iter().map(|&(path, text)| (path.to_owned(), text.as_bytes().to_vec()));
            Self { name, documents: documents.iter().map(parse).collect(), tables: tables.collect() }
        };
        let own = ("materials/own.toml", OWN);
        let other = ("other.csv", "t_s,late_s,first,second,p\n0,0,2,3,7\n9,9,8,7,8\n");
        let heated = of(
            "heated",
            &[("", HEATED), own, ("materials/table.toml", TABLE)],
            &[("flux.csv", FLUX), ("seen.csv", SEEN), other, ("seen-too.csv", &SEEN.replace("350", "370"))],
        );
        let charring = of("charring", &[("", CHARRING), ("materials/char.toml", CHAR), ("gases/own.toml", GAS)], &[]);
        let absolute = GAS.replace("\"sensible\"", "\"absolute\"");
        let consecutive = of(
            "consecutive",
            &[("", CONSECUTIVE), ("tar.toml", TAR), ("gas.toml", &absolute)],
            &[("other.toml", &TAR.replace("0.8", "0.7")), ("other-gas.toml", &absolute.replace("-100", "-200"))],
        );
        let driver = ("other.csv", &*DRIVER.replace("350", "380"));
        let held = of("held", &[("", HELD), own], &[("driver.csv", DRIVER), driver]);
        let mut observed = of("observed", &[("", OBSERVED), own], &[("other.csv", DRIVER)]);
        observed.tables.insert("run.xlsx".to_owned(), workbook());
        let flight = of("flight", &[("", FLIGHT), ("materials/table.toml", TABLE)], &[("entry.csv", ENTRY), other]);
        vec![heated, charring, consecutive, held, observed, flight]
    }

    fn load(&self) -> Result<Case, CaseError> {
        let texts = self.documents.iter().filter(|(path, _)| !path.is_empty());
        let texts = texts.map(|(path, table)| ((*path).to_owned(), document(table).into_bytes()));
        let files: BTreeMap<String, Vec<u8>> = self.tables.clone().into_iter().chain(texts).collect();
        Case::from_toml(&document(&self.documents[""]), self.name, &files)
    }
}

/// A document whose tables all have a line and column of their own.
fn document(table: &Table) -> String {
    table.iter().map(|(key, value)| format!("{key:?} = {}\n", inline(value))).collect()
}

fn inline(value: &Value) -> String {
    let list = |values: Vec<String>| values.join(", ");
    match value {
        Value::Array(values) => format!("[{}]", list(values.iter().map(inline).collect())),
        Value::Table(table) => {
            let entries = table.iter().map(|(key, value)| format!("{key:?} = {}", inline(value)));
            format!("{{ {} }}", list(entries.collect()))
        }
        Value::String(text) => format!("{text:?}"),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => format!("{number:?}"),
        Value::Boolean(truth) => truth.to_string(),
        Value::Datetime(_) => unreachable!("no key is a date"),
    }
}

fn value(text: &str) -> Value {
    let table: Table = toml::from_str(&format!("value = {text}")).unwrap_or_else(|error| panic!("{text}: {error}"));
    table["value"].clone()
}

/// The table at a path; an entry of a list has its index as a name.
fn at<'t>(root: &'t mut Table, path: &[String]) -> &'t mut Table {
    let (mut table, mut parts) = (root, path.iter());
    while let Some(part) = parts.next() {
        table = match table.get_mut(part).expect("a part of a path that was read") {
            Value::Table(inner) => inner,
            Value::Array(entries) => {
                let index: usize = parts.next().expect("an index").parse().expect("an index");
                entries[index].as_table_mut().expect("a list of tables")
            }
            other => panic!("{other:?} is no table"),
        };
    }
    table
}

fn matches(pattern: &str, path: &[String]) -> bool {
    let parts: Vec<&str> = pattern.split('.').filter(|part| !part.is_empty()).collect();
    parts.len() == path.len() && parts.iter().zip(path).all(|(part, name)| *part == "*" || part == name)
}

/// The row of a key; several rows of one key are tried in their order.
fn rows<'r>(kind: Kind, path: &'r [String], key: &'r str) -> impl Iterator<Item = (usize, &'static Row)> + 'r {
    ROWS.iter().enumerate().filter(move |(_, row)| {
        row.kind == kind && row.keys.contains(&key) && row.tables.iter().any(|pattern| matches(pattern, path))
    })
}

/// The answers of a case: its prediction, and those of a study where that is not enough.
struct Answered {
    case: Case,
    study: Option<Result<Json, String>>,
    page: Option<String>,
}

impl Answered {
    fn session(case: &Case) -> Session {
        let options = Options::default().backend(BackendKind::Cpu);
        Session::open(case.clone(), &options).unwrap_or_else(|error| panic!("{}: {error}", case.id))
    }

    fn new(case: Case) -> Self {
        Self { case, study: None, page: None }
    }

    /// What a study answers, or why it refuses the case. Without factors a case has a prediction only.
    fn study(&mut self) -> &Result<Json, String> {
        self.study.get_or_insert_with(|| {
            let mut session = Self::session(&self.case);
            let answered = if self.case.factors.is_empty() {
                session.predict().map(drop)
            } else {
                session.study(&Study { members: MEMBERS, ..Study::default() }).map(drop)
            };
            answered.map_err(|error| error.to_string())?;
            let mut answers = serde_json::to_value(session.answers().expect("answers")).expect("JSON");
            let keys = answers.as_object_mut().expect("an object");
            for key in ["case", "other_cases", "timing", "run"] {
                assert!(keys.remove(key).is_some(), "no {key}");
            }
            Ok(answers)
        })
    }

    fn page(&mut self) -> &str {
        self.page.get_or_insert_with(|| {
            let scratch = Scratch::new("keys-page");
            let mut session = Self::session(&self.case);
            session.predict().unwrap_or_else(|error| panic!("{}: {error}", self.case.id));
            let folder = OutputFolder::open(&scratch.0.join("out"), &self.case.id, true).expect("a folder");
            session.report(&folder).expect("a report");
            std::fs::read_to_string(scratch.0.join("out/report.html")).expect("a page")
        })
    }
}

/// What keys without a value are: to state it changes nothing.
const DEFAULTS: [&str; 7] =
    ["false", "\"thermocouple\"", "\"parallel\"", "\"mass\"", "\"of-reaction\"", "\"quasi-steady\"", "\"small\""];

/// Whether a value differs from the one that a key has.
fn is_other(present: Option<&Value>, text: &str) -> bool {
    present.map_or(!DEFAULTS.contains(&text), |present| *present != value(text))
}

/// What a change of a key does.
#[derive(Debug, PartialEq)]
enum Effect {
    Answer,
    Shown,
    Refused(String),
    None,
}

fn effect(base: &mut Answered, changed: Result<Case, CaseError>, row: &Row) -> Effect {
    let mut changed = match changed {
        Err(error) => return Effect::Refused(error.to_string()),
        Ok(case) => Answered::new(case),
    };
    if let Some(text) = row.shown {
        let is_shown = changed.page().contains(text) && !base.page().contains(text);
        return if is_shown { Effect::Shown } else { Effect::None };
    }
    match (changed.study(), base.study()) {
        (Err(reason), _) => Effect::Refused(reason.clone()),
        (found, own) if found == own => Effect::None,
        _ => Effect::Answer,
    }
}

/// A request of the reader: the file, the table, the key.
type Request = (&'static str, Vec<String>, &'static str);

/// The kind of a document, by its path.
fn kind(path: &str, document: &Table) -> Kind {
    match path {
        "" => Kind::Case,
        _ if document.contains_key("molar_mass") => Kind::Gas,
        _ => Kind::Material,
    }
}

fn requests_of(sample: &Sample) -> (Case, Vec<Request>) {
    requests::take();
    let case = sample.load().unwrap_or_else(|error| panic!("{}: {error}", sample.name));
    let all = requests::take();
    let mut found = Vec::new();
    for (path, table) in &sample.documents {
        let label = if path.is_empty() { sample.name } else { path };
        let root = SpannedValue::parse_document(&document(table), label, &Diagnostics::default());
        for (location, table) in requests::tables(&root.expect("it was read")) {
            let keys = all.iter().filter(|(place, _)| *place == location);
            found.extend(keys.map(|&(_, key)| (*path, table.clone(), key)));
        }
    }
    (case, found)
}

/// A table by its path, with `*` for an index.
fn generalised(table: &[String]) -> String {
    let parts: Vec<&str> =
        table.iter().map(|part| if part.parse::<usize>().is_ok() { "*" } else { part.as_str() }).collect();
    parts.join(".")
}

#[test]
fn every_key_that_is_read_changes_an_answer_or_the_page_or_is_refused_with_the_reason() {
    let (mut wrong, mut tables) = (Vec::new(), BTreeSet::new());
    let (mut without_row, mut idle, mut effective) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    let (mut effective_rows, mut refused, mut refused_rows) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for mut sample in Sample::all() {
        let (case, requests) = requests_of(&sample);
        let mut base = Answered::new(case);
        assert!(base.study().is_ok(), "{}: {:?}", sample.name, base.study());
        for (file, table, key) in requests {
            let kind = kind(file, &sample.documents[file]);
            let place = (kind as usize, generalised(&table), key);
            let present = at(sample.documents.get_mut(file).expect("a document"), &table).get(key).cloned();
            let is_table =
                |value: &Value| value.is_table() || value.as_array().is_some_and(|all| all.iter().all(Value::is_table));
            if present.as_ref().is_some_and(is_table) {
                tables.insert((kind as usize, key));
            }
            let found: Vec<(usize, &Row)> = rows(kind, &table, key).collect();
            if found.is_empty() {
                without_row.insert((kind as usize, key, format!("{} {file:?}: {}.{key}", sample.name, place.1)));
                continue;
            }
            for (index, row) in found {
                // Once is enough.
                if effective.contains(&place) && effective_rows.contains(&(index, key)) {
                    continue;
                }
                for text in row.values.iter().filter(|text| is_other(present.as_ref(), text)) {
                    let document = sample.documents.get_mut(file).expect("a document");
                    at(document, &table).insert(key.to_owned(), value(text));
                    let changed = effect(&mut base, sample.load(), row);
                    let table = at(sample.documents.get_mut(file).expect("a document"), &table);
                    match &present {
                        Some(value) => table.insert(key.to_owned(), value.clone()),
                        None => table.remove(key),
                    };
                    match changed {
                        Effect::Answer | Effect::Shown => {
                            effective.insert(place.clone());
                            effective_rows.insert((index, key));
                            break;
                        }
                        Effect::Refused(reason) => {
                            assert!(reason.len() > 20, "{place:?} = {text}: {reason}");
                            refused.insert(place.clone());
                            refused_rows.insert((index, key));
                        }
                        Effect::None => _ = idle.insert((place.clone(), *text)),
                    }
                }
            }
        }
    }
    for (kind, key, place) in without_row {
        if !tables.contains(&(kind, key)) {
            wrong.push(format!("{place} has no row"));
        }
    }
    let has_effect = |place| effective.contains(place) || (CHOOSERS.contains(&place.2) && refused.contains(place));
    for (place, text) in idle.iter().filter(|(place, _)| !has_effect(place)) {
        wrong.push(format!("{place:?} = {text} changes nothing in any sample"));
    }
    // A stated density of a residue is compared with the losses of the reactions.
    let is_check = |row: &Row| row.kind == Kind::Material && row.keys == ["density"];
    for (index, row) in ROWS.iter().enumerate().filter(|(_, row)| !is_check(row)) {
        for &key in row.keys.iter().filter(|key| !effective_rows.contains(&(index, **key))) {
            if !(CHOOSERS.contains(&key) && refused_rows.contains(&(index, key))) {
                let Row { kind, tables, values, .. } = row;
                wrong.push(format!("{kind:?} {tables:?} {key} = {values:?} has an effect in no sample"));
            }
        }
    }
    assert!(wrong.is_empty(), "{} keys:\n{}", wrong.len(), wrong.join("\n"));
}

/// The words in the code of a text.
fn words(text: &str) -> BTreeSet<&str> {
    let code = text.split('`').skip(1).step_by(2);
    code.flat_map(|code| code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')).collect()
}

/// The keys that the bullets of a text define: "- `key`, `key` (where): …".
fn defined(text: &str) -> BTreeSet<&str> {
    let heads = text.lines().filter_map(|line| line.trim_start().strip_prefix("- `"));
    let heads = heads.map(|line| line.split([':', '(']).next().unwrap_or_default());
    let names = heads.flat_map(|head| head.split('`').step_by(2));
    let names = names.map(|name| name.trim_matches(['[', ']']).rsplit('.').next().unwrap_or_default());
    names.filter(|name| !name.is_empty()).collect()
}

/// The sections of a page by the names in their headings: `[[ply]]` is `ply`.
fn sections(page: &str) -> BTreeMap<&str, &str> {
    let parts = page.split("\n## ").skip(1).filter_map(|part| part.split_once('\n'));
    parts.map(|(title, text)| (title.trim_matches(['`', '[', ']']), text)).collect()
}

/// The differences between the keys of the reader and of the page on a kind of file. A table of the reader has a
/// section of its own, the first of its sections, and others that this one refers to, or `shared`.
fn differences(
    page: &str,
    asked: &BTreeSet<(String, &str)>,
    shared: &[&str],
    sections_of: &dyn Fn(&str) -> Vec<String>,
) -> Vec<String> {
    let sections = sections(page);
    let mut found = Vec::new();
    for (table, key) in asked {
        let own = sections_of(table);
        let names = shared.iter().copied().chain(own.iter().map(String::as_str));
        let texts = names.filter_map(|name| sections.get(name));
        let is_heading = table.is_empty() && sections.contains_key(key);
        if !is_heading && !texts.into_iter().any(|text| words(text).contains(key)) {
            found.push(format!("{table:?}: {key} is read and not in the section {:?}", own[0]));
        }
    }
    for (title, text) in &sections {
        let of_section = |table: &str| sections_of(table).iter().any(|name| name == title) || shared.contains(title);
        for key in defined(text) {
            if !asked.iter().any(|(table, other)| *other == key && of_section(table)) {
                found.push(format!("{title}: {key} is described and not read"));
            }
        }
    }
    found
}

#[test]
fn the_book_describes_the_keys_that_are_read_and_no_others() {
    let mut asked: [BTreeSet<(String, &str)>; 3] = Default::default();
    for sample in Sample::all() {
        for (file, table, key) in requests_of(&sample).1 {
            let kind = kind(file, &sample.documents[file]);
            asked[kind as usize].insert((table.first().cloned().unwrap_or_default(), key));
        }
    }
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
    let case = |table: &str| match table {
        "" => names(&["Keys at the top"]),
        "hot_face" => names(&["hot_face", "sensor"]),
        "back_face" => names(&["back_face", "hot_face", "sensor"]),
        _ => names(&[table]),
    };
    let material = |table: &str| match table {
        "pores" => names(&["pores"]),
        "decomposition" => names(&["decomposition", "pores"]),
        _ => names(&["Properties of a material"]),
    };
    let pages = [text("docs/reference/case-file.md"), text("docs/reference/material-file.md")];
    let shared = ["Schedules", "Trajectory", "Tables"];
    let of_case = differences(&pages[0], &asked[0], &shared, &case);
    let of_material = differences(&pages[1], &asked[1], &["Properties of a material"], &material);
    let of_gas = differences(&pages[1], &asked[2], &["Properties of a material"], &|_| names(&["Gas files"]));
    // The page on materials has a section on gases, and the other way round.
    let other = |found: &String, titles: &[&str]| titles.iter().any(|title| found.starts_with(&format!("{title}: ")));
    let of_material = of_material.into_iter().filter(|found| !other(found, &["Gas files"]));
    let gas_is_other = ["Properties of a material", "pores", "decomposition"];
    let of_gas = of_gas.into_iter().filter(|found| !other(found, &gas_is_other));
    let found: Vec<String> = of_case.into_iter().chain(of_material).chain(of_gas).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
    // A key that is missing on one side is noticed.
    let spoiled = pages[0].replacen("- `thickness`:", "- `thickness_of_ply`:", 1);
    let noticed = differences(&spoiled, &asked[0], &shared, &case);
    assert_eq!(noticed.len(), 2, "{noticed:#?}");
    let spoiled = pages[0].replace("`duration`", "`run`");
    assert!(differences(&spoiled, &asked[0], &shared, &case).len() >= 2);
}
