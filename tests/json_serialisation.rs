//! JSON serialisation: the fingerprint of a case depends on its content only, and answers are written to the bit.

use crate::cli::CASE;
use crate::support::{Scratch, case};
use bondline::case::Case;
use bondline::question::Study;
use bondline::session::fingerprint;
use bondline::session::{BackendKind, Options, Session};
use serde_json::Value;

/// The fingerprint of the case with this text.
fn of(scratch: &Scratch, text: &str) -> String {
    let path = scratch.write("c/case.toml", text);
    fingerprint(&Case::load(&path).unwrap_or_else(|error| panic!("{error}")))
}

/// The text after a replacement.
#[track_caller]
fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from:?} is not in the case");
    text.replacen(from, to, 1)
}

const OBSERVATIONS: &str = "[observations]\nsigma = \"2 K\"\nTC2 = [[\"0 s\", \"300 K\"], [\"10 s\", \"320 K\"]]\n";

#[test]
fn the_fingerprint_does_not_depend_on_units_order_or_comments() {
    let scratch = Scratch::new("fingerprint");
    let text = format!("{CASE}{OBSERVATIONS}");
    let same = of(&scratch, &text);
    assert_eq!(same.len(), 32, "{same}");
    let swapped = with(&text, "name = \"TOP\"\ngroup = \"OF\"", "group = \"OF\"\nname = \"TOP\"");
    for written in [
        with(&text, "\"3 mm\"", "\"0.003 m\""),
        with(&text, "\"0.5 mm\"", "\"500 um\""),
        with(&text, "\"300 K\"", "\"26.85 degC\""),
        with(&text, "duration = \"40 s\"", "duration = \"40.0 s\" # of the heater and after it"),
        with(&swapped, "[[ply]]", "\n# Plies from the hot face.\n[[ply]]"),
    ] {
        assert_eq!(of(&scratch, &written), same, "{written}");
    }
}

#[test]
fn any_change_of_a_number_or_a_name_changes_the_fingerprint() {
    let scratch = Scratch::new("fingerprints");
    let text = format!("{CASE}{OBSERVATIONS}");
    let mut found = vec![of(&scratch, &text)];
    for (from, to) in [
        ("\"3 mm\"", "\"3.0000000001 mm\""),
        ("\"f_q\"", "\"f_flux\""),
        ("[0.9, 1.1]", "[0.9, 1.2]"),
        ("\"320 K\"", "\"320.5 K\""),
        ("sigma = \"2 K\"", "sigma = \"3 K\""),
        ("[\"10 s\", \"320 K\"]", "[\"11 s\", \"320 K\"]"),
        ("500 W/m^2/K", "501 W/m^2/K"),
        ("pyrogel3350", "pyrogel2250"),
        ("\"5 W/cm^2\"", "\"5.1 W/cm^2\""),
        ("cells = 16", "cells = 17"),
    ] {
        found.push(of(&scratch, &with(&text, from, to)));
    }
    let retitled = of(&scratch, &with(&text, "\"Two plies\"", "\"Two layers\""));
    assert_eq!(retitled, found[0], "a title changes no result");
    let all = found.len();
    found.sort_unstable();
    found.dedup();
    assert_eq!(found.len(), all, "two cases have the same fingerprint");
}

#[test]
fn the_answers_of_a_study_are_serialised_to_the_bit() {
    let case = case("slab");
    let mut session =
        Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU does not fail");
    let answers = session.study(&Study { members: 30, ..Study::default() }).expect("a study");
    let text = serde_json::to_string(answers).expect("answers can be written");
    let read: Value = serde_json::from_str(&text).expect("JSON");
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|value| value.as_f64().expect("a number")).collect()
    };
    let (nominal, uncertainty) = (answers.nominal.as_ref().expect("one"), answers.uncertainty.as_ref().expect("one"));
    let estimated = answers.estimated.as_ref().expect("an estimate");
    assert_eq!(read["question"], "study");
    assert_eq!(read["backend"]["precision"], "f64");
    assert_eq!(read["case"]["id"], "slab");
    assert_eq!(numbers(&read["nominal"]["temperatures_k"][0]), nominal.temperatures_k[0]);
    assert_eq!(numbers(&read["uncertainty"]["spreads"][0]["deviation_k"]), uncertainty.spreads[0].deviation_k);
    assert_eq!(numbers(&read["estimated"]["values"]), estimated.values);
    assert_eq!(read["estimated"]["factors"][0]["factor"]["name"], estimated.factors[0].factor.name.as_str());
    assert!(read["sensitivity"]["derivatives_k"].is_array() && read["sizing"].is_null());
}
