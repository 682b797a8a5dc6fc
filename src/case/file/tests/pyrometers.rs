//! Pyrometers in a case file.

use super::{VALID_CASE, errors};
use crate::case::{Case, Pyrometer, Spectrum};
use std::collections::BTreeMap;

const SENSOR: &str = "name = \"TC2\"\ndepth = \"2 mm\"";

fn pyrometer(keys: &str) -> Result<Option<Pyrometer>, String> {
    let text = VALID_CASE.replacen(SENSOR, &format!("name = \"TC2\"\nkind = \"pyrometer\"\n{keys}"), 1);
    let case = Case::from_toml(&text, "case", &BTreeMap::<String, String>::new()).map_err(|error| error.to_string())?;
    Ok(case.sensors[1].pyrometer)
}

#[test]
fn a_pyrometer_has_a_wavelength_or_a_band_and_the_emissivity_that_it_is_set_to() {
    let one = pyrometer("wavelength = \"0.9 um\"\nemissivity = 0.85");
    let close = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-12;
    let Ok(Some(Pyrometer { spectrum: Spectrum::Wavelength(wavelength_m), emissivity })) = one else {
        panic!("{one:?}")
    };
    assert!(close(wavelength_m, 0.9e-6) && emissivity == 0.85);
    let band = pyrometer("band = [\"8 um\", \"14 um\"]\nemissivity = 1");
    let Ok(Some(Pyrometer { spectrum: Spectrum::Band(shorter_m, longer_m), .. })) = band else { panic!("{band:?}") };
    assert!(close(shorter_m, 8e-6) && close(longer_m, 14e-6));
}

#[test]
fn faults_of_a_pyrometer_are_refused_with_their_line() {
    let wrong: &[(&str, &str)] = &[
        ("emissivity = 0.85", ":22:1: a pyrometer needs `wavelength = \"0.9 um\"` or `band ="),
        ("wavelength = \"0.9 um\"", ":22:1: missing key \"emissivity\": expected the emissivity that it is set to"),
        ("wavelength = \"0.9 um\"\nemissivity = 0", ":26:14: expected an emissivity above 0, at most 1, found 0"),
        ("wavelength = \"0.9 um\"\nemissivity = 1.1", "expected an emissivity above 0, at most 1, found 1.1"),
        ("wavelength = \"9 mm\"\nemissivity = 1", ":25:14: expected a wavelength from 0.2 µm to 100 µm, found 9000 µm"),
        (
            "wavelength = \"1 um\"\nband = [\"8 um\", \"14 um\"]\nemissivity = 1",
            ":26:8: expected `wavelength` or `band`, not both",
        ),
        (
            "band = [\"14 um\", \"8 um\"]\nemissivity = 1",
            ":25:8: expected a band from a shorter to a longer wavelength",
        ),
        ("wavelength = \"1 um\"\nemissivity = 1\ndepth = \"0 mm\"", "unknown key \"depth\""),
        ("wavelength = \"1 um\"\nemissivity = 1\ntime_constant = \"1 s\"", "unknown key \"time_constant\""),
    ];
    for (keys, expected) in wrong {
        let message = pyrometer(keys).expect_err(expected);
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let kind = errors("pyrometer-kind", SENSOR, "name = \"TC2\"\nkind = \"camera\"");
    assert!(kind[0].contains("unknown kind \"camera\""), "{kind:?}");
    let unasked = errors("pyrometer-keys", SENSOR, "name = \"TC2\"\ndepth = \"2 mm\"\nwavelength = \"1 um\"");
    assert!(unasked[0].contains("unknown key \"wavelength\""), "{unasked:?}");
}

#[test]
fn a_pyrometer_needs_a_face_whose_radiation_follows_from_its_temperature() {
    let sensor = "name = \"TC2\"\nkind = \"pyrometer\"\nwavelength = \"1 um\"\nemissivity = 0.9";
    let of = |from: &str, to: &str| {
        let text = VALID_CASE.replacen(SENSOR, sensor, 1);
        assert_eq!(text.matches(from).count(), 1, "{from:?}");
        Case::from_toml(&text.replacen(from, to, 1), "case", &BTreeMap::<String, String>::new())
            .map_err(|error| error.to_string())
    };
    let message = |from, to| of(from, to).expect_err(to);
    let flux = r#"kind = "heated"
flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;
    let held = message(flux, "kind = \"held\"\ntemperature = \"900 K\"");
    assert!(held.contains(":22:1: a pyrometer needs a hot face that is not held"), "{held}");
    let black = message("kind = \"heated\"", "kind = \"heated\"\nemissivity = 0");
    assert!(black.contains("a pyrometer needs a hot face that radiates"), "{black}");
    // A char with another emissivity.
    let charring = "contact_conductance = \"500 W/m^2/K\"\ndecomposition = true";
    let mixed = |emissivity: &str| {
        let text = VALID_CASE.replacen(SENSOR, sensor, 1).replacen("nextel440_bf20", "tacot", 1);
        let text = text.replacen("contact_conductance = \"500 W/m^2/K\"", charring, 1);
        let text = text.replacen("thickness = \"3 mm\"", "thickness = \"3 mm\"\ndecomposition = false", 1);
        let text = text.replacen("kind = \"heated\"", &format!("kind = \"heated\"\n{emissivity}"), 1);
        Case::from_toml(
            &format!("{text}[gas]\nflow = \"quasi-steady\"\ngas = \"tacot\"\n"),
            "case",
            &BTreeMap::<String, String>::new(),
        )
    };
    let message = mixed("").expect_err("two emissivities").to_string();
    assert!(message.contains("the emissivity of ply \"TOP\" changes as it decomposes"), "{message}");
    mixed("emissivity = 0.85").unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn faults_of_a_pyrometer_that_holds_the_hot_face_are_refused() {
    let flux = r#"kind = "heated"
flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;
    let message = |keys: &str, points: &str| {
        let face = format!(
            "kind = \"held\"\ntemperature = {{ points = {points}, outside = \"hold\", pyrometer = {{ wavelength = \
             \"1 um\", emissivity = 0.9, {keys} }} }}"
        );
        errors("held-pyrometer", flux, &face).join("\n")
    };
    let (steady, known) = ("[[\"0 s\", \"900 K\"]]", "face_emissivity = 0.8, face_emissivity_deviation = 0.05");
    for (keys, points, expected) in [
        (
            "face_emissivity = 0.8",
            steady,
            "missing key \"face_emissivity_deviation\": expected the standard deviation of it",
        ),
        (
            "face_emissivity_deviation = 0.1",
            steady,
            "missing key \"face_emissivity\": expected the emissivity of the face",
        ),
        (
            "face_emissivity = 1.2, face_emissivity_deviation = 0.1",
            steady,
            "expected an emissivity above 0, at most 1, found 1.2",
        ),
        ("face_emissivity = 0.1, face_emissivity_deviation = 0.2", steady, "below the emissivity of 0.1, found 0.2"),
        (&format!("{known}, surroundings = \"1200 K\""), steady, "a reading of 900 K is less than the radiation of"),
        (&format!("{known}, depth = 1"), steady, "unknown key \"depth\""),
    ] {
        let found = message(keys, points);
        assert!(found.contains(expected), "{expected}: {found}");
    }
    let deep = "kind = \"held\"\nat = \"1 mm\"\ntemperature = { points = [[\"0 s\", \"900 K\"]], outside = \"hold\", \
                pyrometer = { wavelength = \"1 um\", emissivity = 0.9, face_emissivity = 0.8, \
                face_emissivity_deviation = 0.05 } }";
    let found = errors("deep-pyrometer", flux, deep).join("\n");
    assert!(found.contains("a pyrometer reads the top of the layup: expected no `at`"), "{found}");
}
