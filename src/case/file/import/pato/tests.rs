//! The made-up material of `data/import/pato`, and faults in its files.

use crate::case::{
    Conductivity, ImportRecord, ImportedMaterial, Material, PatoHeat, PatoOptions, PyrolysisHeat, Table,
};
use std::path::{Path, PathBuf};

const CONSTANTS: &str = include_str!("../../../../../data/import/pato/constantProperties");
const VIRGIN: &str = include_str!("../../../../../data/import/pato/virgin");
const CHAR: &str = include_str!("../../../../../data/import/pato/char");

const RECORD: ImportRecord<'_> = ImportRecord { name: "Resin", date: "2026-11-24", mark: None, source: None };

/// A temporary folder, removed on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: [&str; 3]) -> Self {
        let path = std::env::temp_dir().join(format!("bondline-pato-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for temporary files");
        for (file, text) in ["constantProperties", "virgin", "char"].into_iter().zip(files) {
            std::fs::write(path.join(file), text).expect("a file in a temporary folder");
        }
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn import(folder: &Path, heat: PatoHeat, direction: Option<usize>) -> Result<ImportedMaterial, String> {
    ImportedMaterial::from_pato(folder, &PatoOptions { heat, direction }, &RECORD).map_err(|error| error.to_string())
}

fn imported(name: &str, heat: PatoHeat) -> (String, Material) {
    let folder = Folder::new(name, [CONSTANTS, VIRGIN, CHAR]);
    let ImportedMaterial { text, material } =
        import(&folder.0, heat, None).unwrap_or_else(|message| panic!("{message}"));
    (text, material)
}

fn table(conductivity: &Conductivity, level: usize) -> (f64, &Table) {
    let Conductivity::Tables(tables) = conductivity else { panic!("tables") };
    (tables[level].0, &tables[level].1)
}

#[test]
fn phases_and_reactions_become_fractions_of_the_mass() {
    let (_, material) = imported("phases", PatoHeat::Absolute);
    assert_eq!(material.density_kg_m3, 250.0);
    let decomposition = material.decomposition.expect("reactions");
    let of = |index: usize| &decomposition.reactions[index];
    // Resin is 100 of 250 kg/m³.
    assert!((of(0).mass_loss - 0.2 * 100.0 / 250.0).abs() < 1e-15 && (of(1).mass_loss - 0.12).abs() < 1e-15);
    assert_eq!((of(0).pre_exponential_1_s, of(0).activation_energy_j_mol, of(0).order), (2.5e4, 75000.0, 2.0));
    assert_eq!((of(0).onset_temperature_k, of(1).onset_temperature_k), (340.0, 0.0));
    assert_eq!(decomposition.residues[0].pores.porosity, 0.86);
    assert_eq!(material.pores.permeability_m2, 2e-11);
}

#[test]
fn tables_keep_their_pressures_and_the_factor_of_the_direction() {
    let (_, material) = imported("tables", PatoHeat::Absolute);
    let [(low_pa, low), (high_pa, high)] = [0, 1].map(|level| table(&material.conductivity, level));
    assert_eq!((low_pa, high_pa), (100.0, 1e5));
    assert_eq!((low.values.as_slice(), high.values[3]), ([0.2, 0.2, 0.28, 0.6].as_slice(), 0.7));
    assert_eq!(material.heat_capacity.values, [800.0, 800.0, 1200.0, 1200.0]);
    assert_eq!(material.emissivity, Table::constant(0.8));
    let folder = Folder::new("direction", [&CONSTANTS.replace("kjCoef ", "other "), VIRGIN, CHAR]);
    let along_j = import(&folder.0, PatoHeat::Absolute, Some(1)).unwrap_or_else(|message| panic!("{message}"));
    assert_eq!(table(&along_j.material.conductivity, 0).1.values, [0.1, 0.1, 0.14, 0.3]);
}

#[test]
fn a_reaction_that_takes_up_heat_has_a_negative_number_in_pato_and_a_positive_one_here() {
    let (text, material) = imported("heat", PatoHeat::OfReaction);
    let decomposition = material.decomposition.expect("reactions");
    assert_eq!(decomposition.heat, PyrolysisHeat::HeatsOfReaction);
    let heats: Vec<f64> = decomposition.reactions.iter().map(|reaction| reaction.heat_j_kg).collect();
    assert_eq!(heats, [1.5e6, -2e5], "the numbers, not the remark of half of it");
    assert!(text.contains("# The remark of the file is not used: \"an older sheet has -0.75e6\""), "{text}");
}

#[test]
fn absolute_enthalpies_leave_the_heats_of_the_reactions_out() {
    let (text, material) = imported("absolute", PatoHeat::Absolute);
    let decomposition = material.decomposition.expect("reactions");
    let expected =
        PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg: -9e5, residues_j_kg: vec![0.0], reference_k: 298.0 };
    assert_eq!(decomposition.heat, expected);
    assert!(decomposition.reactions.iter().all(|reaction| reaction.heat_j_kg == 0.0));
    assert!(text.contains("Virgin material: h of the table and the integral of c_p differ by up to 0 J/kg"), "{text}");
    // A table whose enthalpy is not the integral of its heat capacity is imported, and the file says by how much.
    let folder = Folder::new("drift", [CONSTANTS, VIRGIN.replace("1062400", "1072400").as_str(), CHAR]);
    let text = import(&folder.0, PatoHeat::Absolute, None).unwrap_or_else(|message| panic!("{message}")).text;
    assert!(text.contains("differ by up to 10000 J/kg, at 2000 K"), "{text}");
}

#[test]
fn provenance_names_the_files_their_checksums_and_the_day() {
    let (text, material) = imported("provenance", PatoHeat::Absolute);
    let source = &material.density_provenance.source;
    for expected in ["imported on 2026-11-24 from ", "constantProperties, SHA-256 ", " and ", "char, SHA-256 "] {
        assert!(source.contains(expected), "{expected}: {source}");
    }
    assert!(text.starts_with("# Written by `bondline materials import pato`.\nname = \"Resin\"\n"), "{text}");
}

#[test]
fn faults_of_the_files_are_refused_with_their_line() {
    let wrong: &[(usize, &str, &str, &str)] = &[
        (
            0,
            "nSolidPhases    2;",
            "nSolidPhases    2.5;",
            "constantProperties:7:1: nSolidPhases: expected a whole number",
        ),
        (0, "epsI[2]         epsI[2]", "epsJ[2]         epsJ[2]", "missing entry \"epsI[2]\""),
        (0, "1250;", "12o;", ":10:1: rhoI[2]: expected a number, found \"12o\""),
        (0, "1250;", "-1250;", ":10:1: rhoI[2]: expected a number above 0, found -1250"),
        (0, "0;\nT[2][1]", "1;\nT[2][1]", ":25:1: n[2][1]: expected 0, found 1"),
        (
            0,
            "(2e-11 0 0 0 2e-11 0 0 0 2e-11)",
            "(2e-11 0 0 0 3e-11 0 0 0 2e-11)",
            ":12:1: K_v: 0.00000000002, 0.00000000003",
        ),
        (0, "(2e-11 0 0 0 2e-11 0 0 0 2e-11)", "(2e-11 0 0)", ":12:1: K_v: expected nine numbers in parentheses"),
        (0, "2e5;", "2e5", ":32:1: the entry or block has no end"),
        (0, "dictionary;\n}", "dictionary;\n}\n}", ":6:1: a brace closes no block"),
        (1, "-900000", "", "virgin:3:1: expected nine numbers"),
        (1, "698", "290", "virgin:4:1: expected a temperature above 298 K, found 290 K"),
        (1, "1e5\t698\t1200", "1e5\t698\t1201", "the heat capacity at 100 Pa and at 100000 Pa differ"),
        (1, "0.17\t0.17\t0.17", "0.17\t0.18\t0.17", "the conductivities 0.17, 0.18 and 0.17 W/m/K at 698 K differ"),
        (1, "-900000\t0.10", "0\t0.10", "have the same enthalpy at 298 K, 0 J/kg"),
        (2, "1872200", "x", "char:4:1: expected nine numbers"),
    ];
    for (index, &(file, from, to, expected)) in wrong.iter().enumerate() {
        let mut texts = [CONSTANTS, VIRGIN, CHAR].map(str::to_owned);
        assert!(texts[file].contains(from), "{from:?}");
        texts[file] = texts[file].replacen(from, to, 1);
        let folder = Folder::new(&format!("fault-{index}"), texts.each_ref().map(String::as_str));
        let message = import(&folder.0, PatoHeat::Absolute, None).expect_err(expected);
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let other = CONSTANTS.replace("kjCoef ", "other ");
    let folder = Folder::new("coefficients", [&other, VIRGIN, CHAR]);
    let message = import(&folder.0, PatoHeat::Absolute, None).expect_err("which direction?");
    assert!(message.contains("kiCoef: the factors 2, 1 and 2 of the conductivities differ"), "{message}");
    import(&folder.0, PatoHeat::Absolute, Some(1)).unwrap_or_else(|message| panic!("{message}"));
    let rotated = CONSTANTS.replace("kiCoef ", "tP tP [0 0 0 0 0 0 0] (0 1 0 1 0 0 0 0 1);\nkiCoef ");
    let folder = Folder::new("rotated", [&rotated, VIRGIN, CHAR]);
    let message = import(&folder.0, PatoHeat::Absolute, Some(0)).expect_err("rotated");
    assert!(message.contains("tP: expected the unit matrix"), "{message}");
}

#[test]
fn a_material_without_reactions_needs_no_char() {
    let inert = CONSTANTS.replace("nPyroReac[2]    2;", "nPyroReac[2]    0;");
    let folder = Folder::new("inert", [&inert, VIRGIN, CHAR]);
    std::fs::remove_file(folder.0.join("char")).expect("the file written above");
    let material = import(&folder.0, PatoHeat::Absolute, None).unwrap_or_else(|message| panic!("{message}")).material;
    assert_eq!(material.decomposition, None);
    let message = import(&folder.0, PatoHeat::OfReaction, None).expect_err("no heat of a reaction");
    assert!(message.contains("the material has no reaction whose heat could be taken"), "{message}");
}
