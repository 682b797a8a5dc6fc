//! The materials that are built into the program, so that it needs no file beside it.

/// Id and text of each, by name.
const SHIPPED: &[(&str, &str)] = &[
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
];

/// The ids of the materials that are built in.
pub fn known() -> Vec<&'static str> {
    SHIPPED.iter().map(|(id, _)| *id).collect()
}

/// Id and text of a material; `-` in a name is as good as `_`.
pub(super) fn text(id: &str) -> Option<(&'static str, &'static str)> {
    let id = id.replace('-', "_");
    SHIPPED.iter().find(|(known, _)| *known == id).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Material;

    #[test]
    fn every_material_that_is_built_in_holds() {
        for id in known() {
            let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(material.id, id);
        }
    }

    #[test]
    fn a_material_that_is_not_built_in_is_met_by_its_nearest_name() {
        let error = Material::named("pyrogel335").expect_err("there is none of that name").to_string();
        assert!(error.contains("did you mean \"pyrogel3350\"?"), "{error}");
    }
}
