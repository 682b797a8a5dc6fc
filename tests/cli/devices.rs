//! Devices, the material database and the verification suite.

use super::{CASE, command, run, run_without_vulkan, wait_for};
use crate::support::Scratch;
use std::path::PathBuf;

#[test]
fn a_missing_gpu_is_exit_3_and_names_the_package() {
    let scratch = Scratch::new("no-gpu");
    scratch.write("c/case.toml", CASE);
    for line in ["predict c --backend gpu", "uncertainty c --backend gpu", "predict c --device H200"] {
        let ran =
            run_without_vulkan(&scratch, line).exited_with(3).with_stderr(&["no Vulkan device", "mesa-vulkan-drivers"]);
        assert_eq!((ran.stdout.as_str(), scratch.files().len()), ("", 1), "{line}");
    }
    run_without_vulkan(&scratch, "predict c").succeeded();
}

#[test]
fn an_unknown_device_is_exit_3_and_lists_the_devices() {
    let scratch = Scratch::new("no-such-gpu");
    scratch.write("c/case.toml", CASE);
    run(&scratch, "predict c --backend gpu --device Voodoo2")
        .exited_with(3)
        .with_stderr(&["no device is called \"Voodoo2\"; available:"]);
}

#[test]
fn the_kind_of_a_backend_is_that_of_its_device() {
    let scratch = Scratch::new("kind");
    scratch.write("c/case.toml", CASE);
    let devices = run(&scratch, "devices --json").succeeded().json();
    let found = run(&scratch, "predict c --backend gpu --json --quiet").succeeded().json();
    let backend = &found["backend"];
    let adapters = devices["adapters"].as_array().expect("a list");
    let adapter = adapters.iter().find(|adapter| adapter["name"] == backend["name"]).expect("the device is listed");
    let kind = if adapter["kind"] == "software" { "software" } else { "gpu" };
    assert_eq!(backend["kind"], kind, "{devices:#}");
}

#[test]
fn gpu_and_cpu_peaks_agree() {
    let scratch = Scratch::new("gpu");
    scratch.write("c/case.toml", CASE);
    let peak =
        |line: &str| run(&scratch, line).succeeded().json()["sensors"]["TC2"]["peak_k"].as_f64().expect("a peak");
    let (cpu, gpu) = (peak("predict c --json --backend cpu"), peak("predict c --json --backend gpu"));
    assert!((cpu - gpu).abs() < 1e-3 && cpu > 900.0, "{cpu} K and {gpu} K");
}

#[test]
fn the_source_of_each_kernel_is_written_into_the_folder_of_the_environment() {
    let scratch = Scratch::new("kernels");
    scratch.write("c/case.toml", CASE);
    let with_folder = |folder: &str| {
        let mut command = command(&scratch);
        wait_for(command.env("BONDLINE_KERNELS", folder).args(["predict", "c", "--backend", "gpu", "--quiet"]))
    };
    let kernels = || {
        let files = scratch.files().into_iter().filter(|file| file.extension().is_some_and(|kind| kind == "wgsl"));
        files.collect::<Vec<_>>()
    };
    with_folder("kernels").succeeded();
    let written = kernels();
    let has_march =
        |file: &PathBuf| std::fs::read_to_string(scratch.path().join(file)).expect("a text").contains("fn march(");
    assert!(written.iter().any(has_march), "no march in {written:?}");
    run(&scratch, "predict c --backend gpu --quiet").succeeded();
    assert_eq!(kernels(), written);
    with_folder("c/case.toml").exited_with(3).with_stderr(&["BONDLINE_KERNELS: c/case.toml/", "cannot be written"]);
}

#[test]
fn devices_are_listed_and_their_absence_is_reported_with_the_remedy() {
    let scratch = Scratch::new("devices");
    let found = run(&scratch, "devices --json").succeeded().json();
    assert!(found["adapters"].as_array().is_some_and(|adapters| !adapters.is_empty()), "{found:#}");
    let none = run_without_vulkan(&scratch, "devices").succeeded();
    assert!(none.stdout.contains("no Vulkan driver was found"), "{}", none.stdout);
    assert!(none.stdout.contains("mesa-vulkan-drivers"), "{}", none.stdout);
    let none = run_without_vulkan(&scratch, "devices --json").succeeded().json();
    assert_eq!(none["adapters"], serde_json::json!([]));
    for text in
        [run(&scratch, "devices").succeeded().stdout, run_without_vulkan(&scratch, "devices").succeeded().stdout]
    {
        assert!(text.lines().all(|line| line.chars().count() <= 80), "wider than 80 columns:\n{text}");
    }
}

#[test]
fn materials_are_listed_shown_and_checked() {
    let scratch = Scratch::new("materials");
    let list = run(&scratch, "materials list").succeeded().stdout;
    for material in ["nextel440_bf20", "pyrogel3350", "akk", "kaowool_pm"] {
        assert!(list.contains(material), "no {material} in\n{list}");
        let shown = run(&scratch, &format!("materials show {material}")).succeeded().stdout;
        assert!(shown.contains("heat capacity, J/kg/K") && shown.contains("conductivity, W/m/K"), "{shown}");
    }
    let sound = include_str!("../../data/materials/akk.toml");
    scratch.write("mine.toml", sound);
    assert!(run(&scratch, "materials check mine.toml").succeeded().stdout.contains("mine.toml: ok"));
    scratch.write("mine.toml", sound.replacen("[density]", "[densty]", 1));
    run(&scratch, "materials check mine.toml").exited_with(2).with_stderr(&["mine.toml:", "unknown key \"densty\""]);
}

#[test]
fn verify_gives_every_row_as_json() {
    let scratch = Scratch::new("verify");
    let table = run(&scratch, "verify --group balance --quiet --json").succeeded().json();
    assert!(table["passed"].as_u64().is_some_and(|passed| passed > 10), "{table:#}");
    assert_eq!(table["failed"], 0);
    for row in table["rows"].as_array().expect("rows") {
        for key in ["case", "reference", "quantity", "unit", "source_of_tolerance"] {
            assert!(row[key].as_str().is_some_and(|text| !text.is_empty()), "no {key} in {row:#}");
        }
        assert!(row["difference"].is_number() && row["tolerance"].is_number(), "{row:#}");
    }
}
