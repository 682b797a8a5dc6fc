//! Keys without effect are refused.

use super::{Scratch, VALID_CASE, errors};
use crate::case::Case;
use std::collections::BTreeMap;

/// A replacement in the valid case; line and column of the error; a part of its message.
const IDLE: &[(&str, &str, &str, &str)] = &[
    (
        "thickness = \"3 mm\"",
        "thickness = \"3 mm\"\ndecomposition = true",
        ":17:17: ",
        "`decomposition` of a ply needs `decomposition = true` of the case",
    ),
    (
        "thickness = \"0.5 mm\"",
        "thickness = \"0.5 mm\"\ndecomposition = true",
        ":11:17: ",
        "material \"nextel440_bf20\" has no [decomposition]",
    ),
    (
        "thickness = \"0.5 mm\"",
        "thickness = \"0.5 mm\"\ncontact_below = \"300 W/m^2/K\"",
        ":3:23: ",
        "`contact_conductance` applies to no interface: every ply has its own `contact_below`",
    ),
    (
        "TC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]",
        "TC2 = { samples = [[\"0 s\", \"300 K\"]], sigma = \"5 K\" }",
        ":37:9: ",
        "`sigma` applies to no sensor: every observed sensor has its own",
    ),
    (
        "kind = \"heated\"",
        "kind = \"heated\"\nrecovery_enthalpy = \"9 MJ/kg\"\nblowing = 0.5",
        ":29:11: ",
        "blowing needs gas that leaves the layup",
    ),
    ("kind = \"heated\"", "kind = \"heated\"\nat = \"TC1\"", ":28:1: ", "unknown key \"at\""),
];

#[test]
fn a_key_without_effect_is_refused_with_line_and_column() {
    for (index, &(from, to, position, fragment)) in IDLE.iter().enumerate() {
        let found = errors(&format!("idle-{index}"), from, to);
        assert!(
            found.len() == 1 && found[0].contains(position) && found[0].contains(fragment),
            "{fragment}: {found:#?}"
        );
    }
    let found = errors("no-blowing", "kind = \"heated\"", "kind = \"heated\"\nblowing = 0");
    assert_eq!(found, Vec::<String>::new(), "blowing of 0 is no correction");
}

#[test]
fn a_contact_conductance_of_a_single_ply_is_refused_and_a_perfect_contact_accepted() {
    let of = |contact: &str| {
        let text = format!(
            "duration = \"9 s\"\ninitial_temperature = \"300 K\"\ncontact_conductance = {contact:?}\n\
             [[ply]]\nname = \"A\"\nmaterial = \"akk\"\nthickness = \"1 mm\"\n\
             [[sensor]]\nname = \"T\"\ndepth = \"0 mm\"\n\
             [hot_face]\nkind = \"held\"\ntemperature = \"400 K\"\n"
        );
        Case::from_toml(&text, "one", &BTreeMap::<String, String>::new()).map(|case| case.layup.plies.len())
    };
    let message = of("500 W/m^2/K").expect_err("no interface").to_string();
    assert!(
        message.contains("one:3:23: `contact_conductance` applies to no interface: the layup has one ply"),
        "{message}"
    );
    assert_eq!(of("perfect").ok(), Some(1));
}

#[test]
fn an_override_of_a_name_that_is_both_factor_and_key_is_refused() {
    let scratch = Scratch::new("two-meanings");
    let text = VALID_CASE.replace("f_k", "note").replacen("duration", "note = \"none\"\nduration", 1);
    let path = scratch.write("case.toml", text);
    let set = |name: &str| Case::load_with(&path, &[(name.to_owned(), "1.05".to_owned())]);
    let message = set("note").expect_err("two meanings").to_string();
    assert!(message.contains("\"note\" is both a factor and a key: set factor.note.nominal"), "{message}");
    let case = set("factor.note.nominal").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((case.factors[0].nominal, case.note.as_str()), (1.05, "none"));
}
