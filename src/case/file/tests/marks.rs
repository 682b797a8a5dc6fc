//! Marks, sources and temperatures of the properties of a material, and contacts of a layup.

use super::{Scratch, VALID_CASE, errors};
use crate::case::{Case, Material, SourceKind};

const MATERIAL: &str = r#"name = "Felt"
density = { value = "24 lb/ft^3", mark = "measured", source = "TR-2031", uncertainty = "1 %" }
emissivity = { value = 0.8 }
conductivity = { value = "0.05 W/m/K", source = "a table without a name" }

[heat_capacity]
temperatures = [540, 1080]
temperature_unit = "degR"
values = [0.2, 0.25]
unit = "BTU/lb/degR"
outside = "clamp"
"#;

fn material(name: &str, from: &str, to: &str) -> Result<Material, String> {
    assert_eq!(MATERIAL.matches(from).count(), 1, "{from:?} is not exactly once in the material");
    let scratch = Scratch::new(name);
    Material::load(&scratch.write("felt.toml", MATERIAL.replacen(from, to, 1))).map_err(|error| error.to_string())
}

#[test]
fn a_mark_may_be_measured_or_left_out_and_a_table_may_have_its_own_units() {
    let felt = material("marks", "Felt", "Felt").unwrap_or_else(|error| panic!("{error}"));
    assert!((felt.density_kg_m3 / 384.443120975 - 1.0).abs() < 1e-11, "{}", felt.density_kg_m3);
    assert_eq!(felt.density_provenance.source_kind, SourceKind::Measured);
    assert_eq!(felt.density_provenance.relative_uncertainty, Some(0.005));
    assert_eq!(felt.emissivity_provenance.source_kind, SourceKind::NotStated);
    assert_eq!(
        (felt.emissivity_provenance.source.as_str(), felt.emissivity_provenance.relative_uncertainty),
        ("", None)
    );
    assert_eq!(felt.conductivity_provenance.source, "a table without a name");
    let close = |found: &[f64], expected: [f64; 2]| {
        found.iter().zip(expected).all(|(found, expected)| (found / expected - 1.0).abs() < 1e-12)
    };
    assert!(close(&felt.heat_capacity.temperatures_k, [300.0, 600.0]), "{:?}", felt.heat_capacity);
    assert!(close(&felt.heat_capacity.values, [837.36, 1046.7]), "{:?}", felt.heat_capacity);
}

#[test]
fn an_incomplete_provenance_and_a_wrong_unit_of_temperature_are_refused() {
    let wrong: &[(&str, &str, &str)] = &[
        ("\"TR-2031\"", "\"our report\"", ":2:63: expected the number of the report, such as \"TR-2031\""),
        ("\"measured\"", "\"weighed\"", "expected read, remembered, estimated, paper or measured, found \"weighed\""),
        (", source = \"TR-2031\"", "", ":2:11: missing key \"source\""),
        (", uncertainty = \"1 %\"", "", ":2:11: missing key \"uncertainty\""),
        ("temperature_unit = \"degR\"\n", "", ":7:16: `temperatures` need a key `temperature_unit`"),
        ("\"degR\"\n", "\"m\"\n", ":8:20: wrong dimension: expected a temperature"),
        ("temperatures = [540, 1080]\n", "", ":7:20: `temperature_unit` needs a key `temperatures`"),
        (
            "temperatures = [540, 1080]",
            "temperatures_k = [300, 600]\ntemperatures = [540, 1080]",
            ":8:16: expected `temperatures_k` or `temperatures`, not both",
        ),
        ("[540, 1080]", "[540, 530]", ":7:22: expected a temperature above 300 K, found 294"),
    ];
    for (index, &(from, to, expected)) in wrong.iter().enumerate() {
        let message = material(&format!("marks-{index}"), from, to).expect_err(expected);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

/// The contacts of the valid case, with other keys in the place of its conductance.
fn contacts(name: &str, everywhere: &str, below: &str) -> Vec<Option<f64>> {
    let text = VALID_CASE.replacen("contact_conductance = \"500 W/m^2/K\"", everywhere, 1).replacen(
        "thickness = \"0.5 mm\"",
        &format!("thickness = \"0.5 mm\"\n{below}"),
        1,
    );
    let scratch = Scratch::new(name);
    let case = Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}"));
    case.layup.contacts_w_m2_k
}

#[test]
fn a_contact_resistance_is_the_inverse_of_a_conductance() {
    let resistance = "contact_resistance = \"2e-3 m^2 K/W\"";
    assert_eq!(contacts("resistance", resistance, ""), [Some(500.0)]);
    assert_eq!(contacts("resistance-below", "", "contact_below = \"2e-3 m^2*K/W\""), [Some(500.0)]);
    assert_eq!(contacts("conductance-below", "", "contact_below = \"500 W/m^2/K\""), [Some(500.0)]);
    assert_eq!(contacts("perfect-below", "", "contact_below = \"perfect\""), [None]);
}

#[test]
fn a_wrong_contact_resistance_is_refused() {
    let conductance = "contact_conductance = \"500 W/m^2/K\"";
    let wrong: &[(&str, &str)] = &[
        (
            "contact_conductance = \"500 W/m^2/K\"\ncontact_resistance = \"2e-3 m^2 K/W\"",
            ":4:22: expected `contact_conductance` or `contact_resistance`, not both",
        ),
        ("contact_resistance = \"500 W/m^2/K\"", ":3:22: wrong dimension: expected a contact resistance"),
        ("contact_conductance = \"2e-3 m^2 K/W\"", ":3:23: wrong dimension: expected a heat transfer coefficient"),
        ("contact_resistance = \"0 m^2 K/W\"", ":3:22: expected a value above 0, found \"0 m^2 K/W\""),
    ];
    for (index, &(to, expected)) in wrong.iter().enumerate() {
        let found = errors(&format!("contact-{index}"), conductance, to);
        assert!(found.len() == 1 && found[0].contains(expected), "{expected}: {found:?}");
    }
    let unused =
        errors("contact-unused", "thickness = \"0.5 mm\"", "thickness = \"0.5 mm\"\ncontact_below = \"perfect\"");
    assert!(unused.len() == 1 && unused[0].contains("`contact_conductance` applies to no interface"), "{unused:?}");
}
