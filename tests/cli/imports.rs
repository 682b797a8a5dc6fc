//! `materials import`: files that `materials check` accepts, whole or not at all.

use super::run;
use crate::support::{Scratch, root};
use std::fs;

/// The import of the table of the repository.
fn table(scratch: &Scratch, more: &str) -> super::CommandResult {
    let file = root().join("data/import/felt.csv");
    let options = "--name Felt --temperature T --density 120 --conductivity k --heat-capacity cp --emissivity 0.85";
    run(scratch, &format!("materials import table {} {options} --out felt.toml {more}", file.display()))
}

#[test]
fn an_imported_table_passes_the_check_and_is_a_material_of_a_case() {
    let scratch = Scratch::new("import-table");
    let text = table(&scratch, "--unit cp=J/kg/K").succeeded().stdout;
    assert!(text.starts_with("felt.toml: written\n  Felt, 120 kg/m³\n  at 300 K and 1 atm: k 0.0350 W/m/K"), "{text}");
    assert!(run(&scratch, "materials check felt.toml").succeeded().stdout.contains("felt.toml: ok"));
    let again = table(&scratch, "--unit cp=J/kg/K").exited_with(2);
    again.with_stderr(&["felt.toml exists already; give --force"]);
    table(&scratch, "--unit cp=J/kg/K --force").succeeded();
}

#[test]
fn a_failed_import_writes_nothing_and_leaves_an_earlier_file_as_it_is() {
    let scratch = Scratch::new("import-failed");
    table(&scratch, "").exited_with(2).with_stderr(&["felt.csv:1:17: missing unit in heading \"cp\""]);
    assert_eq!(fs::read_dir(scratch.path()).expect("a folder").count(), 0);
    scratch.write("felt.toml", "mine");
    table(&scratch, "--force").exited_with(2);
    assert_eq!(fs::read_to_string(scratch.path().join("felt.toml")).expect("the earlier file"), "mine");
    let wrong = [
        ("--unit cp=J/kg/K --force --mark weighed --source x --uncertainty 1%", "--mark: expected read, remembered"),
        ("--unit cp=J/kg/K --force --mark read", "--source"),
        ("--unit cp --force", "--unit \"cp\": expected NAME=VALUE"),
        (
            "--unit cp=J/kg/K --force --mark measured --source report --uncertainty 1%",
            "expected the number of the report",
        ),
    ];
    for (more, expected) in wrong {
        table(&scratch, more).exited_with(2).with_stderr(&[expected]);
    }
}

#[test]
fn an_imported_material_of_pato_passes_the_check() {
    let scratch = Scratch::new("import-pato");
    let folder = root().join("data/import/pato");
    let import = |more: &str| format!("materials import pato {} --name Resin --out r.toml {more}", folder.display());
    run(&scratch, &import("")).succeeded();
    assert!(run(&scratch, "materials check r.toml").succeeded().stdout.contains("Resin, 250 kg/m³"));
    run(&scratch, &import("--heat of-reaction --force")).succeeded();
    run(&scratch, "materials check r.toml").succeeded();
    let missing = run(&scratch, "materials import pato nowhere --name Resin --out s.toml").exited_with(2);
    missing.with_stderr(&["nowhere/constantProperties: no such file", "nowhere/virgin: no such file"]);
    assert!(!scratch.path().join("s.toml").exists());
}
