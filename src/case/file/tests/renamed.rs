//! Old names of keys and values: read as the new names, with a note; both names together are refused.

use super::super::renamed_keys::{FileKind, KEYS, VALUES};
use super::{Scratch, VALID_CASE, shipped};
use crate::case::{Case, CaseError, Material};
use std::collections::BTreeMap;

/// A case with every renamed key and value of a case, under its new name.
const CASE: &str = r#"initial_temperature = "300 K"
duration = "100 s"
decomposition = true
contact_conductance = "500 W/m^2/K"

[[ply]]
name = "TOP"
material = { file = "consecutive.toml" }
thickness = "3 mm"

[[ply]]
name = "BASE"
material = { file = "parallel.toml" }
thickness = "3 mm"

[[sensor]]
name = "TC1"
depth = "1 mm"
time_constant = "0.5 s"

[hot_face]
kind = "heated"
flux = "5 W/cm^2"
heat_transfer_coefficient = "20 W/m^2/K"
gas = "900 K"

[back_face]
kind = "cooled"
heat_transfer_coefficient = "10 W/m^2/K"
ambient = "300 K"

[holder]
conductance = "20 kW/m^3/K"
temperature = "300 K"

[gas]
gas = { file = "gas.toml" }

[[factor]]
name = "f_loss"
property = "back_face_loss"
small = [0.9, 1.1]

[[factor]]
name = "f_holder"
property = "holder_loss"
small = [0.9, 1.1]

[[factor]]
name = "f_rate"
group = "TOP"
property = "pre_exponential"
small = [0.9, 1.1]

[[factor]]
name = "f_contact"
property = "contact_conductance"
small = [0.9, 1.1]

[[factor]]
name = "f_depth"
group = "TC1"
property = "sensor_depth"
small = [0.9, 1.1]

[estimate]
loss_function = "huber"

[resolution]
output_interval = "2 s"
step_growth = 0.1
max_step = "1 s"
"#;

/// Properties of both materials.
const SOLID: &str = r#"name = "Charring"
density = { value = "500 kg/m^3", mark = "estimated", source = "made up", uncertainty = "1 %" }
heat_capacity = { value = "1500 J/kg/K", mark = "estimated", source = "made up", uncertainty = "1 %" }
conductivity = { value = "0.2 W/m/K", mark = "estimated", source = "made up", uncertainty = "1 %" }
emissivity = { value = 0.65, mark = "estimated", source = "made up", uncertainty = "1 %" }
"#;

const CONSECUTIVE: &str = r#"
[pores]
porosity = 0.5
permeability = "1e-12 m^2"
forchheimer_coefficient = "1e5 1/m"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[decomposition]
reaction_scheme = "consecutive"
mixture_rule = "volume"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[[decomposition.reaction]]
mass_loss = 0.4
pre_exponential = "5e8 1/s"
activation_energy = "130 kJ/mol"
onset_temperature = "400 K"
order = 1
heat = "0.6 MJ/kg"

[[decomposition.reaction]]
mass_loss = 0.2
pre_exponential = "5e10 1/s"
activation_energy = "175 kJ/mol"
order = 1
heat = "0.1 MJ/kg"

[[decomposition.intermediate]]
name = "tar"

[decomposition.intermediate.pores]
forchheimer_coefficient = "2e5 1/m"

[decomposition.char.pores]
forchheimer_coefficient = "3e5 1/m"
"#;

const PARALLEL: &str = r#"
[decomposition]
reaction_scheme = "parallel"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[[decomposition.reaction]]
mass_loss = 0.4
pre_exponential = "5e8 1/s"
activation_energy = "130 kJ/mol"
order = 1
heat = "0.6 MJ/kg"
"#;

type Files = BTreeMap<String, String>;

fn files() -> Files {
    let texts = [
        ("case.toml", CASE.to_owned()),
        ("consecutive.toml", format!("{SOLID}{CONSECUTIVE}")),
        ("parallel.toml", format!("{SOLID}{PARALLEL}")),
        ("gas.toml", include_str!("../../../../data/gases/pyrolysis.toml").to_owned()),
    ];
    texts.map(|(name, text)| (name.to_owned(), text)).into()
}

fn read(files: &Files) -> Result<Case, CaseError> {
    Case::from_toml(&files["case.toml"], "case.toml", files)
}

fn notes(case: &Case) -> Vec<String> {
    case.renamed_keys().iter().map(ToString::to_string).collect()
}

fn kind_of(file: &str) -> FileKind {
    match file {
        "case.toml" => FileKind::Case,
        "gas.toml" => FileKind::Gas,
        _ => FileKind::Material,
    }
}

/// File, index of the line and line that assigns a key, in the first table of a path where `matches` accepts the line.
fn find_line(kind: FileKind, table: &[&str], matches: impl Fn(&str) -> bool) -> (String, usize, String) {
    let path = table.iter().filter(|key| **key != "*").copied().collect::<Vec<_>>().join(".");
    for (file, text) in files().into_iter().filter(|(file, _)| kind_of(file) == kind) {
        let mut section = "";
        for (index, line) in text.lines().enumerate() {
            if line.starts_with('[') {
                section = line.trim_matches(['[', ']']);
            } else if section == path && matches(line) {
                return (file, index, line.to_owned());
            }
        }
    }
    panic!("the test has no line for [{path}]");
}

/// The files with one line replaced.
fn with_line(file: &str, index: usize, line: &str) -> Files {
    let mut files = files();
    let mut lines: Vec<&str> = files[file].lines().collect();
    lines[index] = line;
    let text = lines.join("\n");
    files.insert(file.to_owned(), text);
    files
}

#[test]
fn every_old_key_is_read_as_the_new_one_with_a_note_and_refused_beside_it() {
    let current = read(&files()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(notes(&current), Vec::<String>::new());
    for &(kind, table, old, new) in KEYS {
        let (file, index, line) = find_line(kind, table, |line| line.starts_with(&format!("{new} = ")));
        let old_line = line.replacen(new, old, 1);
        let case = read(&with_line(&file, index, &old_line)).unwrap_or_else(|error| panic!("{old}: {error}"));
        assert_eq!(case, current, "{old}");
        assert_eq!(notes(&case), [format!("{file}:{}: {old:?} is now {new:?}", index + 1)]);

        let error = read(&with_line(&file, index, &format!("{line}\n{old_line}"))).expect_err(old).to_string();
        let message = format!("{old:?} is the old name of {new:?}: expected {new:?} alone, found both");
        assert_eq!(error, format!("{file}:{}:1: {message}\n1 error", index + 2));
    }
}

#[test]
fn every_old_value_is_read_as_the_new_one_with_a_note() {
    let current = read(&files()).unwrap_or_else(|error| panic!("{error}"));
    for &(kind, path, old, new) in VALUES {
        let (key, table) = path.split_last().expect("a path has a key");
        let line = format!("{key} = {new:?}");
        let (file, index, line) = find_line(kind, table, |found| found == line);
        let case = read(&with_line(&file, index, &line.replacen(new, old, 1))).unwrap_or_else(|e| panic!("{old}: {e}"));
        assert_eq!(case, current, "{old}");
        assert_eq!(notes(&case), [format!("{file}:{}: {old:?} is now {new:?}", index + 1)]);
    }
}

#[test]
fn all_old_names_of_a_case_are_noted_once_each_in_the_order_of_files_and_lines() {
    let mut files = files();
    for (new, old) in [("output_interval", "every"), ("time_constant", "lag"), ("\"sensor_depth\"", "\"depth\"")] {
        files.insert("case.toml".to_owned(), files["case.toml"].replacen(new, old, 1));
    }
    let both = files["case.toml"].replace("parallel.toml", "consecutive.toml");
    files.insert("case.toml".to_owned(), both);
    files.insert("consecutive.toml".to_owned(), files["consecutive.toml"].replacen("mixture_rule", "mixing", 1));
    let case = read(&files).unwrap_or_else(|error| panic!("{error}"));
    let found: Vec<&str> = case.renamed_keys().iter().map(|key| key.old).collect();
    assert_eq!(found, ["lag", "depth", "every", "mixing"], "a material of two plies is noted once");
    let rebuilt = case.to_builder().build().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((notes(&rebuilt), &rebuilt), (Vec::new(), &case));
}

#[test]
fn an_old_name_is_accepted_in_an_override() {
    let path = shipped("lcat-2259");
    let set = |sets: &[(&str, &str)]| {
        let sets: Vec<(String, String)> = sets.iter().map(|&(name, value)| (name.into(), value.into())).collect();
        Case::load_with(&path, &sets)
    };
    for (old, new, value, note) in [
        (
            "sensor.TC1.lag",
            "sensor.TC1.time_constant",
            "0.5 s",
            "--set sensor.TC1.lag=0.5 s: \"lag\" is now \"time_constant\"",
        ),
        (
            "resolution.every",
            "resolution.output_interval",
            "2 s",
            "--set resolution.every=2 s: \"every\" is now \"output_interval\"",
        ),
        (
            "estimate.loss",
            "estimate.loss_function",
            "huber",
            "--set estimate.loss=huber: \"loss\" is now \"loss_function\"",
        ),
    ] {
        let case = set(&[(old, value)]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(notes(&case), [note]);
        assert_eq!(Ok(case), set(&[(new, value)]));
        assert_ne!(set(&[(new, value)]), set(&[]), "{new} changes nothing");
        let error = set(&[(old, value), (new, value)]).expect_err("both names").to_string();
        assert!(error.contains(&format!("--set {new}={value}: {new:?} is set twice")), "{error}");
    }
    let case = set(&[("resolution", "{ every = \"2 s\" }")]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.renamed_keys().len(), 1);
    assert_eq!(Ok(case), set(&[("resolution.output_interval", "2 s")]));

    let scratch = Scratch::new("renamed-override");
    let path = scratch.write("case.toml", format!("{VALID_CASE}\n[resolution]\nevery = \"1 s\"\n"));
    let case = Case::load_with(&path, &[("resolution.output_interval".into(), "2 s".into())]);
    let case = case.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.resolution.output_interval_s, 2.0, "an override replaces the value under the old name");
    assert_eq!(notes(&case), [format!("{}:46: \"every\" is now \"output_interval\"", path.display())]);
}

#[test]
fn a_material_file_reports_its_old_names() {
    let scratch = Scratch::new("renamed-material");
    let load = |text: String| {
        let read = Material::load_with_renamed_keys(&scratch.write("felt.toml", text));
        read.unwrap_or_else(|error| panic!("{error}"))
    };
    let text = format!("{SOLID}{CONSECUTIVE}");
    let (current, none) = load(text.clone());
    assert_eq!(none, []);
    let (material, renamed) = load(text.replace("onset_temperature", "onset"));
    assert_eq!(material, current);
    assert!(
        renamed.len() == 1 && renamed[0].to_string().ends_with("felt.toml:26: \"onset\" is now \"onset_temperature\"")
    );
}
