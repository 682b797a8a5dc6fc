//! Reading of case files: valid content and error messages.

mod chosen_columns;
mod correlation;
mod imported;
#[cfg(feature = "command")]
mod keys;
mod loggers;
mod marks;
mod named;
mod observed;
mod pyrometers;
mod reacting;
mod schedules;
mod sheets;
mod states;
mod trajectory;
mod unused;
mod workbooks;

use crate::case::{Bounds, Case, Emissivity, Face, Property};
use std::path::{Path, PathBuf};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cases").join(name)
}

fn load(name: &str) -> Case {
    Case::load(&shipped(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// A temporary folder, removed on drop; each test has its own name.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bondline-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    fn write(&self, file: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(file);
        std::fs::write(&path, text).expect("a file in a temporary folder");
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A valid case with one key per line, in which the tests introduce errors.
const VALID_CASE: &str = r#"name = "Two plies"
initial_temperature = "300 K"
contact_conductance = "500 W/m^2/K"
duration = "100 s"

[[ply]]
name = "TOP"
group = "OF"
material = "nextel440_bf20"
thickness = "0.5 mm"

[[ply]]
name = "BASE"
group = "INS"
material = "pyrogel3350"
thickness = "3 mm"

[[sensor]]
name = "TC1"
below = "TOP"

[[sensor]]
name = "TC2"
depth = "2 mm"

[hot_face]
kind = "heated"
flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }

[[factor]]
name = "f_k"
group = "INS"
property = "conductivity"
small = [0.9, 1.1]

[observations]
sigma = "2 K"
TC2 = [["0 s", "300 K"], ["10 s", "320 K"]]

[estimate]
factors = ["f_k"]
sensors = ["TC2"]
window = ["0 s", "50 s"]
"#;

/// The errors of the valid case after a replacement.
fn errors(name: &str, from: &str, to: &str) -> Vec<String> {
    assert_eq!(VALID_CASE.matches(from).count(), 1, "{from:?} is not exactly once in the case");
    let scratch = Scratch::new(name);
    let path = scratch.write("case.toml", VALID_CASE.replacen(from, to, 1));
    match Case::load(&path) {
        Ok(_) => Vec::new(),
        Err(error) => error.diagnostics.iter().map(ToString::to_string).collect(),
    }
}

#[test]
fn a_layup_of_many_plies_needs_no_stated_resolution() {
    let ply = |n| format!("[[ply]]\nname = \"P{n}\"\nmaterial = \"pyrogel3350\"\nthickness = \"0.1 mm\"\n\n");
    for (more, cells) in [(0, 160), (38, 160), (39, 164), (198, 800)] {
        let plies: String = (0..more).map(ply).collect();
        let text = VALID_CASE.replacen("[[sensor]]", &(plies + "[[sensor]]"), 1);
        let scratch = Scratch::new("many-plies");
        let case =
            Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{more} plies: {error}"));
        assert_eq!((case.resolution.cells, case.resolution.tolerance_k), (cells, Some(0.05)), "{more} more plies");
    }
}

#[test]
fn every_shipped_case_loads() {
    let folders = std::fs::read_dir(shipped(""))
        .expect("the cases")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let names: Vec<String> = folders.filter(|name| shipped(name).is_dir()).collect();
    assert!(names.len() >= 12, "{names:?}");
    for name in names {
        assert_eq!(load(&name).id, name);
    }
}

#[test]
fn the_case_of_run_2259_has_the_values_of_the_paper() {
    let case = load("lcat-2259");
    assert_eq!(case.layup.plies.len(), 5);
    assert_eq!(case.layup.contacts_w_m2_k, [Some(500.0); 4]);
    assert_eq!(case.exposure.pressure_pa.after(0.0), 8010.0);
    let bondline = case.sensors.iter().find(|sensor| sensor.name == "TC4").expect("the bondline");
    assert_eq!(bondline.depth_m, case.layup.faces_m()[3]);
    let Face::Open(face) = &case.exposure.hot_face else { panic!("the hot face is open") };
    assert_eq!(face.emissivity, Emissivity::Material);
    assert_eq!((face.flux_w_m2.before(41.0), face.flux_w_m2.after(41.2)), (26.7e4, 0.0));
    let factor = |name| case.factors.iter().find(|factor| factor.name == name).expect("a factor of the paper");
    assert_eq!(factor("f_eps_OF").bounds(Bounds::Small), (0.95, 1.05));
    assert_eq!(factor("f_k_INS").bounds(Bounds::Large), (0.50, 1.50));
    assert_eq!(factor("f_cp_GB").property, Property::HeatCapacity);
    assert_eq!(case.factors.len(), 7);
    assert_eq!(case.estimate.window_s, Some((0.0, 80.0)));
}

#[test]
fn a_held_face_removes_the_plies_above_it_and_keeps_the_depths_of_the_others() {
    let (whole, held) = (load("lcat-2259"), load("lcat-2259-tc3"));
    assert_eq!(held.layup.plies.len(), 2);
    assert_eq!(held.layup.contacts_w_m2_k, [Some(500.0)]);
    assert_eq!(held.sensors[0].depth_m, held.layup.origin_m);
    assert_eq!(held.sensors[1].depth_m, held.layup.faces_m()[0]);
    assert!((held.sensors[1].depth_m - whole.sensors[3].depth_m).abs() < 1e-12);

    let case = Case::load_with(&shipped("lcat-2259-tc3"), &[("hot_face.at".into(), "2.02 mm".into())]);
    let cut = case.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(cut.layup.plies.len(), 3);
    assert!((cut.layup.plies[0].thickness_m - 2.0e-3).abs() < 1e-12);
    assert_eq!(cut.sensors[0].depth_m, cut.layup.faces_m()[0], "a sensor on an interface stays on it to the bit");
}

#[test]
fn measured_traces_keep_their_standard_deviations() {
    let case = load("kaowool");
    assert_eq!(case.observations.len(), 2);
    assert_eq!(case.sensors[2].name, "TC3");
    let first = &case.observations[0];
    assert_eq!((first.times_s.len(), first.temperatures_k[120], first.sigma_k[0]), (121, 821.0, 0.5));
    let short = Case::load_with(&shipped("kaowool"), &[("duration".into(), "600 s".into())]);
    let short = short.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(short.observations[0].times_s.len(), 61, "samples after the end of the exposure must be dropped");
}

#[test]
fn a_valid_case_has_no_error() {
    assert_eq!(errors("whole", "Two plies", "Two plies of cloth"), Vec::<String>::new());
}

/// A replacement in the valid case; line and column of the error; a part of its message.
const BROKEN: &[(&str, &str, &str, &str)] = &[
    ("thickness = \"3 mm\"", "thicknes = \"3 mm\"", ":16:1:", "unknown key \"thicknes\": did you mean \"thickness\"?"),
    ("\"5 W/cm^2\"", "\"5\"", ":28:49:", "missing unit: expected a heat flux such as \"26.7 W/cm^2\", found \"5\""),
    ("\"100 s\"", "100", ":4:12:", "missing unit: expected a time"),
    ("\"5 W/cm^2\"", "\"5 mm\"", ":28:49:", "wrong dimension: expected a heat flux"),
    ("\"3 mm\"", "\"-3 mm\"", ":16:13:", "expected a value above 0, found \"-3 mm\""),
    ("\"3 mm\"", "\"nan mm\"", ":16:13:", "not a finite number"),
    ("\"1 s\"", "\"-1 s\"", ":28:42:", "times must not decrease: -1 s follows 0 s"),
    ("\"320 K\"", "\"NaN K\"", ":38:35:", "not a finite number"),
    ("[\"10 s\"", "[\"0 s\"", ":38:27:", "times must increase: 0 s follows 0 s"),
    ("\"pyrogel3350\"", "\"pyrogel335\"", ":15:12:", "unknown material \"pyrogel335\": did you mean \"pyrogel3350\"?"),
    ("\"2 mm\"", "\"4 mm\"", ":24:9:", "depth 4 mm lies outside the layup, from 0 mm to 3.5 mm"),
    ("below = \"TOP\"", "below = \"TIP\"", ":20:9:", "unknown ply \"TIP\": did you mean \"TOP\"?"),
    ("depth = \"2 mm\"", "time_constant = \"1 s\"", ":22:1:", "a sensor needs `below"),
    ("TC2 = [", "TC3 = [", ":38:7:", "unknown sensor \"TC3\": did you mean \"TC1\"?"),
    ("[0.9, 1.1]", "[1.1, 0.9]", ":34:9:", "bounds reversed: 1.1 is not below 0.9"),
    ("[0.9, 1.1]", "[0.0, 1.1]", ":34:9:", "expected bounds above 0, found 0 to 1.1"),
    ("[0.9, 1.1]", "[0.9, 1.1]\nnominal = 1.2", ":35:11:", "nominal 1.2 lies outside the small bounds 0.9 to 1.1"),
    (
        "[0.9, 1.1]",
        "[0.9, 1.1]\nlarge = [0.95, 1.5]",
        ":30:1:",
        "expected large bounds that contain the small bounds 0.9 to 1.1, found 0.95 to 1.5",
    ),
    ("group = \"INS\"\nproperty", "group = \"GB\"\nproperty", ":32:9:", "unknown group \"GB\" of the marched layup"),
    ("\"conductivity\"", "\"conductance\"", ":33:12:", "did you mean \"conductivity\"?"),
    (
        "\"conductivity\"",
        "\"emissivity\"",
        ":32:9:",
        "no ply of group \"INS\" has a face that radiates with the emissivity of its material",
    ),
    ("\"conductivity\"", "\"heating\"", ":32:9:", "expected no `group`"),
    (
        "group = \"INS\"\nproperty = \"conductivity\"",
        "property = \"back_face_loss\"",
        ":30:1:",
        "the back face has neither a film nor radiation",
    ),
    (
        "group = \"INS\"\nproperty = \"conductivity\"",
        "group = \"OF\"\nproperty = \"conductivity.radiative\"",
        ":32:9:",
        "has no radiative part",
    ),
    ("name = \"BASE\"", "name = \"TOP\"", ":13:8:", "duplicate ply name \"TOP\""),
    ("name = \"TC2\"", "name = \"TC1\"", ":23:8:", "duplicate sensor name \"TC1\""),
    ("[\"0 s\", \"50 s\"]", "[\"50 s\", \"0 s\"]", ":43:10:", "window reversed: 50 s is not before 0 s"),
    (
        "[\"0 s\", \"50 s\"]",
        "[\"200 s\", \"250 s\"]",
        ":43:10:",
        "expected a window that begins before 100 s, the end of the exposure, found 200 s",
    ),
    (
        "[[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]",
        "{ samples = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]], window = [\"0 s\", \"9 s\"] }",
        ":43:10:",
        "`window` applies to no sensor",
    ),
    ("factors = [\"f_k\"]", "factors = [\"f_cp\"]", ":41:12:", "unknown factor \"f_cp\""),
    (
        "sensors = [\"TC2\"]",
        "sensors = [\"TC2\"]\nstart = { f_k = 2.0 }",
        ":43:17:",
        "start 2 lies outside the bounds 0.9 to 1.1",
    ),
    ("\"heated\"", "\"heatd\"", ":27:8:", "unknown kind \"heatd\": did you mean \"heated\"?"),
    (
        "flux = {",
        "fux = {",
        ":26:1:",
        "a heated face needs a `flux`, an `enthalpy_film_coefficient` or a `radiant_flux`",
    ),
    ("sigma = \"2 K\"", "sigma = \"2 s\"", ":37:9:", "wrong dimension: expected a temperature difference"),
    ("\"500 W/m^2/K\"", "\"500 W/m^2\"", ":3:23:", "wrong dimension: expected a heat transfer coefficient"),
    ("duration = \"100 s\"\n", "", ": ", "missing key \"duration\": expected a time such as \"41 s\""),
    ("name = \"Two plies\"", "name = \"Two plies", ":1:", "basic string"),
    ("[hot_face]", "[hot_face", ":26:", "table"),
];

#[test]
fn every_error_is_reported_with_line_column_and_expected_value() {
    let mut missing = Vec::new();
    for (index, &(from, to, position, fragment)) in BROKEN.iter().enumerate() {
        let found = errors(&format!("broken-{index}"), from, to);
        if !found.iter().any(|fault| fault.contains(position) && fault.contains(fragment)) {
            missing.push(format!("{to:?} at {position} {fragment:?}: {found:#?}"));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn all_errors_of_a_file_are_reported_together_in_the_order_of_its_lines() {
    let scratch = Scratch::new("all");
    let text = VALID_CASE
        .replace("\"0.5 mm\"", "\"0.5\"")
        .replace("\"2 mm\"", "\"2 K\"")
        .replace("\"1 s\"", "\"-1 s\"")
        .replace("[0.9, 1.1]", "[1.1, 0.9]")
        .replace("\"320 K\"", "\"320 degX\"")
        .replace("[\"0 s\", \"50 s\"]", "[\"50 s\", \"0 s\"]");
    let error = Case::load(&scratch.write("case.toml", text)).expect_err("six errors");
    let lines: Vec<usize> = error.diagnostics.iter().filter_map(|fault| Some(fault.location.line_column?.0)).collect();
    assert_eq!(lines, [10, 24, 28, 34, 38, 43], "{error}");
    assert!(error.to_string().ends_with("\n6 errors"), "{error}");
}

#[test]
fn no_missing_or_replaced_character_makes_the_reader_panic() {
    let scratch = Scratch::new("spoiled");
    let mut refused = 0;
    for (at, _) in VALID_CASE.char_indices() {
        let other = ["", "é", "[", "\"", "9"][at % 5];
        let spoiled = format!("{}{other}{}", &VALID_CASE[..at], &VALID_CASE[at + 1..]);
        refused += usize::from(Case::load(&scratch.write("case.toml", spoiled)).is_err());
    }
    assert!(2 * refused > VALID_CASE.len(), "only {refused} are refused");
}

#[test]
fn two_factors_on_one_property_of_a_ply_are_refused() {
    let more = "[[factor]]\nname = \"f_k_BASE\"\ngroup = \"BASE\"\nproperty = \"conductivity\"\nsmall = [0.9, 1.1]\n\n\
                [observations]";
    let found = errors("overlap", "[observations]", more);
    assert!(found[0].contains("factors \"f_k\" and \"f_k_BASE\" scale the same property"), "{found:?}");
    let other = more.replace("conductivity", "heat_capacity");
    assert_eq!(errors("no-overlap", "[observations]", &other), Vec::<String>::new());
}

#[test]
fn a_file_that_is_not_a_case_is_reported() {
    let scratch = Scratch::new("files");
    let message = |path: &Path| Case::load(path).expect_err("no case").to_string();
    assert!(message(&scratch.write("empty.toml", "")).contains("empty.toml: the file is empty\n1 error"));
    assert!(message(&scratch.write("blank.toml", "\n \n")).contains("the file is empty"));
    assert!(message(&scratch.write("binary.toml", [0x7f, 0x45, 0xff, 0xfe])).contains("not a text file"));
    assert!(message(&scratch.write("zero.toml", "name = \"\0\"")).contains("not a text file"));
    assert!(message(&scratch.0.join("nowhere.toml")).contains("nowhere.toml: no such file"));
    assert!(message(&scratch.0).contains("the folder contains no case.toml"));
}

#[test]
fn an_override_sets_any_key_and_its_error_names_it() {
    let path = shipped("lcat-2259");
    let set = |name: &str, value: &str| Case::load_with(&path, &[(name.to_owned(), value.to_owned())]);
    let valid = |name: &str, value: &str| set(name, value).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(valid("pressure", "3.1 kPa").exposure.pressure_pa.after(0.0), 3100.0);
    assert_eq!(valid("f_k_INS", "1.1").factors[3].nominal, 1.1);
    assert_eq!(valid("f_k_INS.small", "[0.5, 1.5]").factors[3].small, (0.5, 1.5));
    assert_eq!(valid("resolution.cells", "48").resolution.cells, 48);
    assert_eq!(valid("ply.INS1.thickness", "2 mm").layup.plies[2].thickness_m, 0.002);
    assert_eq!(valid("contact_conductance", "perfect").layup.contacts_w_m2_k, [None; 4]);
    let message = |name: &str, value: &str| set(name, value).expect_err("an error").to_string();
    assert!(
        message("presure", "3 kPa").starts_with("presure=3 kPa: unknown key \"presure\": did you mean \"pressure\"?")
    );
    assert!(message("pressure", "3").starts_with("pressure=3: missing unit: expected a pressure"));
    assert!(
        message("f_k_INS", "1.6").starts_with("f_k_INS=1.6: nominal 1.6 lies outside the small bounds 0.75 to 1.25")
    );
    assert!(message("ply.INS9.thickness", "2 mm").contains("no entry is named \"INS9\""));
    assert!(message("pressure.high", "2 Pa").contains("is under a key that is not a table"));
}

#[test]
fn a_material_next_to_the_case_replaces_the_built_in_one() {
    let scratch = Scratch::new("own");
    std::fs::create_dir_all(scratch.0.join("materials")).expect("a folder in a temporary folder");
    let own = include_str!("../../../data/materials/pyrogel3350.toml").replace("170 kg/m^3", "110 kg/m^3");
    scratch.write("materials/pyrogel3350.toml", &own);
    let path = scratch.write("case.toml", VALID_CASE);
    let case = Case::load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.layup.plies[1].material.density_kg_m3, 110.0);
    scratch.write("materials/pyrogel3350.toml", own.replace("0.93", "-0.93"));
    let message = Case::load(&path).expect_err("a wrong material").to_string();
    assert!(message.contains("materials/pyrogel3350.toml:27:20: expected a value above 0, found -0.93"), "{message}");
}

#[test]
fn a_sensor_above_a_held_face_is_refused() {
    let held = "kind = \"held\"\nat = \"TC2\"\ntemperature = \"400 K\"";
    let found = errors(
        "above",
        "kind = \"heated\"\nflux = { points = [[\"0 s\", \"0 W/cm^2\"], [\"1 s\", \"5 W/cm^2\"]], outside = \"hold\" }",
        held,
    );
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains(":28:6: sensor \"TC1\" at 0.5 mm lies above the held face at 2 mm"), "{found:?}");
}
