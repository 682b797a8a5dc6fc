//! A question has one declaration: its fields are the options of the command, with one default, and keys of a file.

use crate::support::case;
use bondline::command::args::Cli;
use bondline::question::{NamedCase, Question, Uncertainty};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Options of the command that are no part of a question.
const OF_THE_COMMAND: &[&str] = &[
    "backend",
    "case",
    "checkpoint_interval",
    "device",
    "force",
    "format",
    "help",
    "instruction_set",
    "json",
    "keep",
    "limit_time",
    "max_failed",
    "out",
    "precision",
    "quiet",
    "resume",
    "sets",
];

fn fields(name: &str) -> Map<String, Value> {
    Question::named(name).expect("a question").fields()
}

#[test]
fn every_field_of_a_question_is_an_option_of_its_command_with_the_same_default_and_no_other_is() {
    let description = Cli::description();
    for name in Question::NAMES {
        let command = description.find_subcommand(name).expect("a command of each question");
        let own = |id: &str| !OF_THE_COMMAND.contains(&id);
        let options: BTreeSet<&str> =
            command.get_arguments().map(|option| option.get_id().as_str()).filter(|id| own(id)).collect();
        let fields = fields(name);
        let names: BTreeSet<&str> = fields.keys().map(String::as_str).collect();
        assert_eq!(options, names, "{name}");
        for option in command.get_arguments().filter(|option| own(option.get_id().as_str())) {
            let defaults: Vec<String> =
                option.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect();
            let expected = match &fields[option.get_id().as_str()] {
                Value::Null | Value::Array(_) => Vec::new(),
                Value::String(text) if text.is_empty() => Vec::new(),
                Value::String(text) => vec![text.clone()],
                // A flag, whose default clap adds later.
                Value::Bool(false) => continue,
                value => vec![value.to_string()],
            };
            assert_eq!(defaults, expected, "{name}: {}", option.get_id());
        }
    }
}

#[test]
fn a_question_is_read_back_from_its_fields_and_from_its_file() {
    for name in Question::NAMES {
        let question = Question::named(name).expect("a question");
        assert_eq!(question.name(), *name);
        assert_eq!(Question::from_fields(name, &question.fields()), Ok(question));
    }
    let fields = json!({
        "members": 300, "sampling": "lhs", "seed": u64::MAX.to_string(), "sampling_bounds": "large",
        "until": "TC4 P99 ± 2 K",
    });
    let question = Question::from_fields("uncertainty", fields.as_object().expect("fields")).expect("a question");
    assert!(matches!(&question, Question::Uncertainty(Uncertainty { draw, .. }) if draw.seed == u64::MAX));
    assert_eq!(Question::from_fields("uncertainty", &question.fields()), Ok(question));
    let fields = json!({
        "ply": "INS", "limit": "TC4 < 623 K", "thickness_range": ["3 mm", "0.02 m"], "probability": 0.95,
    });
    let question = Question::from_fields("size", fields.as_object().expect("fields")).expect("a question");
    assert_eq!(question.fields()["thickness_range"], "3 mm:20 mm");
    assert_eq!(Question::from_fields("size", &question.fields()), Ok(question));
}

#[test]
fn an_unknown_or_wrong_field_is_refused_by_its_name() {
    let refused = |name: &str, fields: Value| {
        let error = Question::from_fields(name, fields.as_object().expect("fields")).expect_err("refused");
        error.to_string()
    };
    for (name, fields, message) in [
        ("guess", json!({}), "no question is called \"guess\"; there are predict,"),
        ("size", json!({ "plies": "INS" }), "plies: size has no such option; it has limit, members, ply,"),
        ("observations", json!({ "sensors": [] }), "sensors: observations has no options"),
        ("design", json!({ "noise": "2 K", "grid": "5 s" }), "grid \"5 s\": wrong dimension: expected a length"),
        ("design", json!({ "noise": 2.0 }), "noise 2.0: missing unit: expected a temperature difference"),
        ("estimate", json!({ "start": ["f_k"] }), "start [\"f_k\"]: expected NAME=VALUE"),
        ("uncertainty", json!({ "part": "5" }), "part \"5\": expected FIRST..END"),
        ("uncertainty", json!({ "part": "0..5", "until": "TC4 P99 ± 2 K" }), "expected one of them at most"),
        ("uncertainty", json!({ "seed": -1 }), "seed -1: expected a whole number from 0"),
        ("uncertainty", json!({ "members": "many" }), "members \"many\": expected a whole number such as 5000 or 1e6"),
    ] {
        let found = refused(name, fields);
        assert!(found.contains(message), "{name}: {message:?} is not in {found:?}");
    }
}

#[test]
fn an_option_without_effect_is_refused_by_the_check_of_its_question() {
    let slab = case("slab");
    let check = |name: &str, fields: Value| {
        let question = Question::from_fields(name, fields.as_object().expect("fields")).expect("a question");
        question.check(&slab).map_err(|error| error.to_string())
    };
    let sized = |more: Value| {
        let mut fields = json!({ "ply": "SLAB", "limit": "BACK < 600 K" });
        fields.as_object_mut().expect("fields").extend(more.as_object().expect("fields").clone());
        fields
    };
    for (name, fields) in [
        ("uncertainty", json!({ "members": 50, "part": "0..5" })),
        ("size", sized(json!({}))),
        ("twin", json!({ "noise": "1 K", "seed": 3 })),
        ("estimate", json!({ "posterior": true, "walkers": 100 })),
    ] {
        assert_eq!(check(name, fields), Ok(()), "{name}");
    }
    for (name, fields, option) in [
        ("predict", json!({ "depth_profiles": "0" }), "depth_profiles"),
        ("uncertainty", json!({ "depth_profiles": "3", "part": "0..5" }), "depth_profiles"),
        ("uncertainty", json!({ "sampling": "sobol", "until": "BACK P99 ± 2 K" }), "sampling"),
        ("estimate", json!({ "walkers": 100 }), "walkers"),
        ("estimate", json!({ "mcmc_iterations": 100 }), "mcmc_iterations"),
        ("estimate", json!({ "seed": 7 }), "seed"),
        ("study", json!({ "walkers": 100 }), "walkers"),
        ("history", json!({ "bounds": "small" }), "bounds"),
        ("sensitivity", json!({ "method": "tangent", "step": 1e-4 }), "step"),
        ("twin", json!({ "starts": 3 }), "starts"),
        ("twin", json!({ "window": "0:40" }), "window"),
        ("twin", json!({ "seed": 3 }), "seed"),
        ("twin", json!({ "study": 5, "truth": ["f_k=1.1"] }), "truth"),
        ("twin", json!({ "study": 5, "profile": ["f_k"] }), "profile"),
        ("size", sized(json!({ "probability": 1.0 })), "probability"),
    ] {
        let found = check(name, fields).expect_err("refused");
        assert!(found.starts_with(option), "{name}: {option} is not at fault in {found:?}");
    }
}

#[test]
fn a_question_that_names_another_case_is_asked_once_the_case_is_read() {
    let mut question = Question::from_fields(
        "design",
        json!({ "others": ["cases/slab"], "sensors": 1, "members": 4 }).as_object().expect("fields"),
    )
    .expect("a question");
    let lcat = case("lcat-2259");
    let unread = question.check(&lcat).expect_err("the other case is not read");
    assert!(unread.to_string().contains("was not read"), "{unread}");
    question.read_cases(|_| Ok(case("slab"))).expect("a case");
    assert_eq!(question.check(&lcat), Ok(()));
    let Question::Design(design) = &question else { panic!("another question") };
    assert_ne!(design.others[0], NamedCase::from(case("lamp-test")));
}
