//! Schedules: coverage by their points, and values outside them.

use super::{Scratch, VALID_CASE, errors};
use crate::case::{Case, Face, Schedule};

const FLUX: &str = r#"flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;

/// The valid case with another flux.
fn with_flux(flux: &str) -> String {
    assert!(VALID_CASE.contains(FLUX));
    VALID_CASE.replacen(FLUX, flux, 1)
}

/// The flux schedule of the case after the replacement of its flux.
fn flux(scratch: &Scratch, flux: &str) -> Schedule {
    let case = Case::load(&scratch.write("case.toml", with_flux(flux))).unwrap_or_else(|error| panic!("{error}"));
    let Face::Open(face) = case.exposure.hot_face else { panic!("an open face") };
    face.flux_w_m2
}

#[test]
fn a_flux_with_zero_outside_is_zero_before_and_after_its_points() {
    let scratch = Scratch::new("zero");
    scratch.write("q.csv", "time_s,q_w_m2\n10,7\n20,9\n");
    let listed = r#"[["10 s", "7 W/m^2"], ["20 s", "9 W/m^2"]]"#;
    for (index, points) in [format!("points = {listed}"), "file = \"q.csv\"".to_owned()].iter().enumerate() {
        let zero = flux(&scratch, &format!("flux = {{ {points}, outside = \"zero\" }}"));
        let at = [0.0, 9.9, 10.0, 15.0, 20.0, 20.1, 100.0].map(|time_s| zero.after(time_s));
        assert_eq!(at, [0.0, 0.0, 7.0, 8.0, 0.0, 0.0, 0.0], "form {index}");
        assert_eq!((zero.before(10.0), zero.before(20.0)), (0.0, 9.0));
        let hold = flux(&scratch, &format!("flux = {{ {points}, outside = \"hold\" }}"));
        assert_eq!([0.0, 15.0, 100.0].map(|time_s| hold.after(time_s)), [7.0, 8.0, 9.0], "form {index}");
    }
}

#[test]
fn points_that_cover_the_duration_within_rounding_need_no_key_outside() {
    let scratch = Scratch::new("covered");
    for points in [
        r#"[["0 s", "7 W/m^2"], ["100 s", "9 W/m^2"]]"#,
        r#"[["-5 s", "7 W/m^2"], ["200 s", "9 W/m^2"]]"#,
        r#"[["0.00000009 s", "7 W/m^2"], ["99.99999991 s", "9 W/m^2"]]"#,
        r#"{ points = [["0 s", "7 W/m^2"], ["100 s", "9 W/m^2"]] }"#,
        r#""7 W/m^2""#,
    ] {
        flux(&scratch, &format!("flux = {points}"));
    }
    let found = errors("all-but", FLUX, r#"flux = [["0 s", "7 W/m^2"], ["99.9999 s", "9 W/m^2"]]"#);
    assert!(found.len() == 1 && found[0].contains("no value from 99.9999 s to 100 s"), "{found:?}");
}

/// The flux, and a part of the error message.
const FLUXES: &[(&str, &str)] = &[
    (
        r#"flux = [["10 s", "7 W/m^2"], ["20 s", "9 W/m^2"]]"#,
        ":28:8: no value from 0 s to 10 s and from 20 s to 100 s: the points cover 10 s to 20 s; expected \
         { points = […], outside = … } with \"hold\" or \"zero\"",
    ),
    (
        r#"flux = { points = [["0 s", "7 W/m^2"], ["20 s", "9 W/m^2"]] }"#,
        ":28:8: no value from 20 s to 100 s: the points cover 0 s to 20 s; expected a key `outside`",
    ),
    (r#"flux = { file = "q.csv" }"#, ":28:8: no value from 0 s to 10 s and from 20 s to 100 s"),
    (r#"flux = [["200 s", "7 W/m^2"], ["300 s", "9 W/m^2"]]"#, ":28:8: no value from 0 s to 100 s: the points cover"),
    (r#"flux = [["-9 s", "7 W/m^2"], ["-1 s", "9 W/m^2"]]"#, ":28:8: no value from 0 s to 100 s: the points cover"),
    (r#"flux = { file = "q.csv", outside = "none" }"#, ":28:36: expected \"hold\" or \"zero\", found \"none\""),
    (r#"flux = { file = "q.csv", points = [["0 s", "7 W/m^2"]] }"#, ":28:35: expected a `file` or `points`, not both"),
    (r#"flux = { points = [["0 s", "7 W/m^2"]], column = "q" }"#, ":28:50: `column` needs a `file`"),
    (r#"flux = { outside = "hold" }"#, ":28:8: missing key \"file\": expected { file = \"flux.csv\" } or { points"),
    (r#"flux = { file = "q.csv", outsid = "hold" }"#, ":28:26: unknown key \"outsid\": did you mean \"outside\"?"),
];

#[test]
fn a_schedule_that_does_not_cover_the_duration_is_refused_with_the_uncovered_spans() {
    let scratch = Scratch::new("uncovered");
    scratch.write("q.csv", "time_s,q_w_m2\n10,7\n20,9\n30,NaN\n");
    for &(written, expected) in FLUXES {
        let message = Case::load(&scratch.write("case.toml", with_flux(written))).expect_err(written).to_string();
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

#[test]
fn every_schedule_must_cover_the_duration_and_only_fluxes_and_films_may_be_zero_outside() {
    let through = |unit: &str| format!("[[\"0 s\", \"300 {unit}\"], [\"50 s\", \"310 {unit}\"]]");
    let heated = |more: &str| format!("{FLUX}\n{more}");
    let held = "\"held\"\ntemperature = VALUE";
    let back = |keys: &str| format!("[back_face]\n{keys}\n\n[[factor]]");
    let cases = [
        ("name = \"Two", "pressure = VALUE\nname = \"Two".to_owned(), "Pa"),
        (FLUX, heated("radiant_flux = VALUE"), "W/m^2"),
        (FLUX, heated("heat_transfer_coefficient = \"9 W/m^2/K\"\ngas = VALUE"), "K"),
        (FLUX, heated("heat_transfer_coefficient = VALUE\ngas = \"900 K\""), "W/m^2/K"),
        (FLUX, heated("surroundings = VALUE"), "K"),
        (
            "\"heated\"\nflux",
            "\"convective\"\nheat_transfer_coefficient = \"9 W/m^2/K\"\ngas = VALUE\n#".to_owned(),
            "K",
        ),
        ("\"heated\"\nflux", format!("{held}\n#"), "K"),
        ("[[factor]]", back("kind = \"cooled\"\nheat_transfer_coefficient = \"9 W/m^2/K\"\nambient = VALUE"), "K"),
        (
            "[[factor]]",
            back(
                "kind = \"cooled\"\nheat_transfer_coefficient = \"9 W/m^2/K\"\nambient = \"300 K\"\n\
                 surroundings = VALUE",
            ),
            "K",
        ),
        ("[[factor]]", back("kind = \"holder\"\nconductance = \"9 W/m^2/K\"\ntemperature = VALUE"), "K"),
        ("[[factor]]", back("kind = \"held\"\ntemperature = VALUE"), "K"),
        ("[[factor]]", back("kind = \"insulated\"\npressure = VALUE"), "Pa"),
        ("[[factor]]", "[holder]\nconductance = \"9 kW/m^3/K\"\ntemperature = VALUE\n\n[[factor]]".to_owned(), "K"),
    ];
    for (index, (from, to, unit)) in cases.iter().enumerate() {
        let of = |form: &str, value: &str| errors(&format!("every-{index}-{form}"), from, &to.replace("VALUE", value));
        let found = of("bare", &through(unit));
        assert!(found.iter().any(|fault| fault.contains("no value from 50 s to 100 s")), "{to}: {found:?}");
        let found = of("hold", &format!("{{ points = {}, outside = \"hold\" }}", through(unit)));
        // Without gas a back-face pressure is refused for another reason.
        assert!(found.iter().all(|fault| fault.contains("Darcy")), "{to}: {found:?}");
        let found = of("zero", &format!("{{ points = {}, outside = \"zero\" }}", through(unit)));
        let refusal = "only a heat flux or a film coefficient can be zero outside its points";
        let refused = found.iter().any(|fault| fault.contains(refusal));
        assert_eq!(refused, !["W/m^2", "W/m^2/K"].contains(unit), "{to}: {found:?}");
    }
}

#[test]
fn a_longer_duration_by_an_override_must_be_covered_too() {
    let scratch = Scratch::new("longer");
    let whole = with_flux(r#"flux = [["0 s", "7 W/m^2"], ["100 s", "9 W/m^2"]]"#);
    let path = scratch.write("case.toml", whole);
    let loaded = |duration: &str| Case::load_with(&path, &[("duration".into(), duration.into())]);
    assert!(loaded("60 s").is_ok());
    let message = loaded("400 s").expect_err("300 s without values").to_string();
    assert!(message.contains("case.toml:28:8: no value from 100 s to 400 s"), "{message}");
}

#[test]
fn initial_temperatures_cover_the_layup_or_are_held_outside() {
    let of = |name: &str, written: &str| {
        errors(name, "initial_temperature = \"300 K\"", &format!("initial_temperature = {written}"))
    };
    let short = r#"[["1 mm", "300 K"], ["3 mm", "310 K"]]"#;
    let found = of("short", short);
    assert!(
        found.len() == 1
            && found[0]
                .contains(":2:23: no value from 0 mm to 1 mm and from 3 mm to 3.5 mm: the points cover 1 mm to 3 mm"),
        "{found:?}"
    );
    assert_eq!(of("held", &format!("{{ points = {short}, outside = \"hold\" }}")), Vec::<String>::new());
    assert_eq!(of("whole", r#"[["0 mm", "300 K"], ["3.5 mm", "310 K"]]"#), Vec::<String>::new());
    let found = of("zero", &format!("{{ points = {short}, outside = \"zero\" }}"));
    assert!(
        found.iter().any(|fault| fault.contains("only a heat flux or a film coefficient can be zero")),
        "{found:?}"
    );
}

#[test]
fn a_face_may_radiate_to_space_at_zero_kelvin() {
    let scratch = Scratch::new("space");
    scratch.write("sky.csv", "time_s,sky_K\n0,0\n100,4\n");
    for surroundings in ["\"0 K\"", "\"-273.15 degC\"", "{ file = \"sky.csv\" }"] {
        let text = with_flux(&format!("{FLUX}\nsurroundings = {surroundings}"));
        let case = Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}"));
        let Face::Open(face) = case.exposure.hot_face else { panic!("an open face") };
        assert_eq!(face.surroundings_k.after(0.0), 0.0);
    }
    scratch.write("sky.csv", "time_s,sky_K\n0,0\n100,-4\n");
    let message = Case::load(&scratch.0.join("case.toml")).expect_err("below zero").to_string();
    assert!(message.contains("sky.csv:3:5: -4 K is below absolute zero"), "{message}");
    let found =
        errors("gas-at-zero", FLUX, &format!("{FLUX}\nheat_transfer_coefficient = \"9 W/m^2/K\"\ngas = \"0 K\""));
    assert!(found[0].contains("not above absolute zero"), "{found:?}");
}
