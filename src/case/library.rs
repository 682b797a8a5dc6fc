//! The database of materials and gases, built into the program.

/// Id and TOML text of each material.
const MATERIALS: &[(&str, &str)] = &[
    ("akk", include_str!("../../data/materials/akk.toml")),
    ("apa", include_str!("../../data/materials/apa.toml")),
    ("apa2", include_str!("../../data/materials/apa2.toml")),
    ("kaowool_pm", include_str!("../../data/materials/kaowool_pm.toml")),
    ("kkl", include_str!("../../data/materials/kkl.toml")),
    ("nextel440_bf20", include_str!("../../data/materials/nextel440_bf20.toml")),
    ("pi_aerogel", include_str!("../../data/materials/pi_aerogel.toml")),
    ("pyrogel2250", include_str!("../../data/materials/pyrogel2250.toml")),
    ("pyrogel3350", include_str!("../../data/materials/pyrogel3350.toml")),
    ("pyrogel_xte", include_str!("../../data/materials/pyrogel_xte.toml")),
    ("saffil_96", include_str!("../../data/materials/saffil_96.toml")),
    ("sic_5hs", include_str!("../../data/materials/sic_5hs.toml")),
    ("tacot", include_str!("../../data/materials/tacot.toml")),
];

/// Id and TOML text of each gas.
const GASES: &[(&str, &str)] = &[
    ("air", include_str!("../../data/gases/air.toml")),
    ("nitrogen", include_str!("../../data/gases/nitrogen.toml")),
    ("pyrolysis", include_str!("../../data/gases/pyrolysis.toml")),
    ("tacot", include_str!("../../data/gases/tacot.toml")),
];

/// The ids of the built-in materials.
pub fn material_ids() -> Vec<&'static str> {
    MATERIALS.iter().map(|(id, _)| *id).collect()
}

/// Whether two names are of one material or gas: `-` equals `_`, and capital letters equal small ones. File systems
/// differ in the latter, and a case must not.
pub(super) fn is_same_name(one: &str, other: &str) -> bool {
    one.replace('-', "_").eq_ignore_ascii_case(&other.replace('-', "_"))
}

/// Id and TOML text of a built-in material.
pub(super) fn material_toml(id: &str) -> Option<(&'static str, &'static str)> {
    MATERIALS.iter().find(|(known, _)| is_same_name(known, id)).copied()
}

/// The ids of the built-in gases.
pub fn gas_ids() -> Vec<&'static str> {
    GASES.iter().map(|(id, _)| *id).collect()
}

/// Id and TOML text of a built-in gas.
pub(super) fn gas_toml(id: &str) -> Option<(&'static str, &'static str)> {
    GASES.iter().find(|(known, _)| is_same_name(known, id)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Gas, Material};

    #[test]
    fn every_built_in_material_is_valid() {
        for id in material_ids() {
            let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(material.id, id);
        }
    }

    #[test]
    fn every_built_in_gas_is_valid() {
        for id in gas_ids() {
            let gas = Gas::named(id).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(gas.id, id);
        }
        let error = Gas::named("tacott").expect_err("an unknown name").to_string();
        assert!(error.contains("did you mean \"tacot\"?"), "{error}");
    }

    #[test]
    fn an_unknown_material_is_reported_with_the_nearest_name() {
        let error = Material::named("pyrogel335").expect_err("an unknown name").to_string();
        assert!(error.contains("did you mean \"pyrogel3350\"?"), "{error}");
    }
}
