//! Factors on the conductivity of a single state of a ply.

use super::reacting::charring_errors;

/// The errors of the charring case with another factor, and with `more` after it.
fn message(name: &str, factor: &str, more: &str) -> Vec<String> {
    let small = format!("small = [0.9, 1.1]\n{more}");
    charring_errors(
        &format!("states-{name}"),
        &[("property = \"char_yield\"", factor), ("small = [0.9, 1.1]\n", &small)],
        &[],
    )
}

#[test]
fn a_factor_may_scale_the_conductivity_of_one_state_that_its_plies_have() {
    let none = Vec::<String>::new();
    for (name, factor) in [
        ("virgin", "property = \"conductivity\"\nstate = \"virgin\""),
        ("tar", "property = \"conductivity.radiative\"\nstate = \"tar\""),
        ("char", "property = \"conductivity\"\nstate = \"char\""),
    ] {
        assert_eq!(message(name, factor, ""), none, "{factor}");
    }
    for (name, factor, fragment) in [
        (
            "unknown",
            "property = \"conductivity\"\nstate = \"chars\"",
            ":39:9: material \"charring\" (ply \"BASE\") has no state \"chars\": did you mean \"char\"?",
        ),
        (
            "whole",
            "property = \"char_yield\"\nstate = \"char\"",
            ":39:9: only a conductivity can be scaled in one state: expected no `state`",
        ),
        (
            "part",
            "property = \"conductivity.radiative\"\nstate = \"char\"",
            ":37:9: the conductivity of material \"charring\" (ply \"BASE\") in state \"char\" has no radiative part",
        ),
        (
            "virgin-part",
            "property = \"conductivity.radiative\"",
            ":37:9: the conductivity of material \"charring\" (ply \"BASE\") in state \"virgin\" has no radiative part",
        ),
    ] {
        let found = message(name, factor, "");
        assert!(found.len() == 1 && found[0].contains(fragment), "{fragment}: {found:?}");
    }
}

#[test]
fn two_factors_may_scale_a_conductivity_in_different_states_only() {
    let more = |state: &str| {
        format!("[[factor]]\nname = \"g\"\ngroup = \"BASE\"\nproperty = \"conductivity\"\n{state}small = [0.9, 1.1]\n")
    };
    let first = "property = \"conductivity\"\nstate = \"char\"";
    assert_eq!(message("apart", first, &more("state = \"virgin\"\n")), Vec::<String>::new());
    for (name, state) in [("same", "state = \"char\"\n"), ("all", "")] {
        let found = message(name, first, &more(state));
        assert!(found[0].contains("factors \"f\" and \"g\" scale the same property"), "{state}: {found:?}");
    }
}
