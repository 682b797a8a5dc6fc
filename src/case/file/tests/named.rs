//! Names of materials and gases: a file of the case always wins over the database.

use super::VALID_CASE;
use crate::case::library::{gas_ids, material_ids};
use crate::case::{Case, FileSource};
use std::collections::BTreeMap;

const MATERIAL: &str = include_str!("../../../../data/materials/saffil_96.toml");
const OWN_KG_M3: f64 = 123.0;

/// A material file of a density that no material of the database has.
fn own_material() -> String {
    let density = MATERIAL.lines().find(|line| line.starts_with("value = ")).expect("a density");
    MATERIAL.replacen(density, &format!("value = \"{OWN_KG_M3} kg/m^3\""), 1)
}

/// A name as it is, with dashes, with underscores, and in capitals.
fn spellings(name: &str) -> [String; 4] {
    [name.to_owned(), name.replace('_', "-"), name.replace('-', "_"), name.to_uppercase()]
}

fn files(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
    entries.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect()
}

/// The case whose insulation is of a material.
fn case_of(material: &str, files: &dyn FileSource) -> Result<Case, String> {
    let text = VALID_CASE.replacen("\"pyrogel3350\"", &format!("{material:?}"), 1);
    Case::from_toml(&text, "named", files).map_err(|error| error.to_string())
}

#[test]
fn a_file_of_the_case_wins_over_the_database_however_its_name_is_written() {
    let own = own_material();
    for (id, others) in material_ids().into_iter().map(|id| (id, spellings(id))) {
        for file in &others {
            let files = files(&[(&format!("materials/{file}.toml"), &own)]);
            for written in &others {
                let case = case_of(written, &files).unwrap_or_else(|error| panic!("{written} of {file}: {error}"));
                let material = &case.layup.plies[1].material;
                assert_eq!(material.density_kg_m3, OWN_KG_M3, "{written} is not {file}, but {id}");
                assert_eq!(case.material_origin(material), Some(format!("materials/{file}.toml").as_str()));
            }
        }
    }
    let nitrogen = include_str!("../../../../data/gases/nitrogen.toml");
    for (file, written) in gas_ids().into_iter().flat_map(|id| spellings(id).map(|file| (file, spellings(id)))) {
        let files = files(&[(&format!("gases/{file}.toml"), &nitrogen.replacen("name = \"", "name = \"Own ", 1))]);
        for written in written {
            let text = VALID_CASE.replacen("[hot_face]", &format!("[gas]\ngas = {written:?}\n\n[hot_face]"), 1);
            let case = Case::from_toml(&format!("decomposition = true\n{text}"), "named", &files);
            let case = case.unwrap_or_else(|error| panic!("{written} of {file}: {error}"));
            let name = &case.gas.expect("a gas").gas.name;
            assert!(name.starts_with("Own "), "{written} is not {file}, but {name}");
        }
    }
}

#[test]
fn a_material_of_the_case_may_have_any_name_that_a_file_can_have() {
    let own = own_material();
    for name in ["felt.v2", "my felt", "Flanell-größe_2", "日本"] {
        let path = format!("materials/{name}.toml");
        let case = case_of(name, &files(&[(&path, &own)])).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(case.layup.plies[1].material.id, name);
    }
    let error = case_of("my-fel", &files(&[("materials/my_felt.toml", &own)])).expect_err("no such material");
    assert!(error.contains("unknown material \"my-fel\": did you mean \"my_felt\"?"), "{error}");
}

#[test]
fn two_materials_of_one_name_are_refused() {
    let own = own_material();
    let both = files(&[("materials/felt-1.toml", &own), ("materials/felt_1.toml", MATERIAL)]);
    let error = case_of("felt-1", &both).expect_err("which?");
    assert!(error.contains("materials/felt-1.toml and materials/felt_1.toml have one name"), "{error}");
    // Properties and factors of plies are found by the id of their material.
    let text = VALID_CASE.replacen("\"nextel440_bf20\"", "\"saffil_96\"", 1).replacen(
        "\"pyrogel3350\"",
        "{ file = \"saffil_96.toml\" }",
        1,
    );
    let error = Case::from_toml(&text, "named", &files(&[("saffil_96.toml", &own)])).expect_err("two of one id");
    let expected = "saffil_96.toml and saffil_96 are different materials of one name, \"saffil_96\"";
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn a_material_file_of_the_case_that_no_ply_is_of_is_found_by_its_name_and_is_no_input_of_the_case() {
    let own = own_material();
    let files = files(&[
        ("materials/akk.toml", &own),
        ("materials/my felt.toml", &own.replacen("value = ", "values = ", 1)),
        ("materials/felt-1.toml", &own),
        ("materials/felt_1.toml", &own),
    ]);
    let case = case_of("pyrogel3350", &files).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.material_origin(&case.layup.plies[1].material), Some("built in"));
    assert_eq!(case.input_files().len(), 1, "{:?}", case.input_files());
    for name in spellings("akk") {
        let found = case.material_named(&name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(found.density_kg_m3, OWN_KG_M3, "{name} is of the database");
    }
    let other = case.with_materials(&[(vec![1], case.material_named("akk").expect("it was found"))]);
    let other = other.unwrap_or_else(|error| panic!("{error}"));
    let paths: Vec<&str> = other.input_files().iter().map(|file| file.path.as_str()).collect();
    assert_eq!(paths, ["named", "materials/akk.toml"]);
    // The errors of a file matter to those who name it.
    let faulty = case.material_named("my felt").expect_err("a wrong key");
    assert!(faulty.contains("materials/my felt.toml:") && faulty.contains("missing key \"value\""), "{faulty}");
    let twice = case.material_named("felt-1").expect_err("which?");
    assert!(twice.contains("materials/felt-1.toml and materials/felt_1.toml have one name"), "{twice}");
    assert!(case.material_named("PYROGEL3350").is_ok() && case.material_named("sic-5hs").is_ok());
}
