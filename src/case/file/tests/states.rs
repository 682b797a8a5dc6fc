//! Factors on the conductivity of one state of a ply.

use super::reacting::told;

/// What is said where the factor of a charring ply is this one, with another behind it if there is more.
fn said(name: &str, factor: &str, more: &str) -> Vec<String> {
    let small = format!("small = [0.9, 1.1]\n{more}");
    told(&format!("states-{name}"), &[("property = \"char_yield\"", factor), ("small = [0.9, 1.1]\n", &small)], &[])
}

#[test]
fn a_factor_may_scale_the_conductivity_of_one_state_which_its_plies_must_know() {
    let none = Vec::<String>::new();
    for (name, factor) in [
        ("virgin", "property = \"conductivity\"\nstate = \"virgin\""),
        ("tar", "property = \"conductivity.radiative\"\nstate = \"tar\""),
        ("char", "property = \"conductivity\"\nstate = \"char\""),
    ] {
        assert_eq!(said(name, factor, ""), none, "{factor}");
    }
    for (name, factor, fragment) in [
        (
            "unknown",
            "property = \"conductivity\"\nstate = \"chars\"",
            ":39:9: \"charring\" (ply \"BASE\") knows no state \"chars\": did you mean \"char\"? known: char, tar, virgin",
        ),
        (
            "whole",
            "property = \"char_yield\"\nstate = \"char\"",
            ":39:9: only conductivities are told apart by state: expected no `state`",
        ),
        (
            "part",
            "property = \"conductivity.radiative\"\nstate = \"char\"",
            ":37:9: the conductivity of char \"charring\" (ply \"BASE\") has no radiative part",
        ),
        (
            "virgin-part",
            "property = \"conductivity.radiative\"",
            ":37:9: the conductivity of \"charring\" (ply \"BASE\") has no radiative part",
        ),
    ] {
        let found = said(name, factor, "");
        assert!(found.len() == 1 && found[0].contains(fragment), "{fragment}: {found:?}");
    }
}

#[test]
fn two_factors_may_scale_one_conductivity_in_two_states_but_not_in_one() {
    let more = |state: &str| {
        format!("[[factor]]\nname = \"g\"\ngroup = \"BASE\"\nproperty = \"conductivity\"\n{state}small = [0.9, 1.1]\n")
    };
    let first = "property = \"conductivity\"\nstate = \"char\"";
    assert_eq!(said("apart", first, &more("state = \"virgin\"\n")), Vec::<String>::new());
    for (name, state) in [("same", "state = \"char\"\n"), ("all", "")] {
        let found = said(name, first, &more(state));
        assert!(found[0].contains("factor \"g\" scales what factor \"f\" scales already"), "{state}: {found:?}");
    }
}
