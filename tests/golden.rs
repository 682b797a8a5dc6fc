//! Golden files: the nominal march of every shipped case.
//!
//! A change of these numbers changes the results of users: check the difference, explain it in the commit, and renew
//! the files of `tests/golden` with `BONDLINE_BLESS=1 cargo test --release golden`.

use crate::support::{DOUBLE_K, case, cases, modified, root};
use bondline::adapt::adapt;
use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::cpu::{Cpu, InstructionSet};
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::nominal::{Prediction, nominal};
use bondline::traces::Traces;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Recorded instants, as shares of the exposure.
const SHARES: [f64; 6] = [0.02, 0.1, 0.25, 0.5, 0.75, 1.0];

fn marched(case: &Case) -> Prediction {
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let plan = adapt(case).expect("the CPU backend does not fail");
    nominal(case, &plan, &mut march).expect("the CPU backend does not fail")
}

/// The record of a march in a golden file.
fn record(case: &Case, outcome: &Prediction) -> Value {
    let sensors =
        case.sensors().iter().zip(&outcome.peaks).zip(&outcome.temperatures_k).map(|((sensor, peak), trace_k)| {
            let at = SHARES.map(|share| {
                let wanted_s = share * case.exposure().duration_s;
                let instant = outcome.instants_s.partition_point(|&time_s| time_s < wanted_s - 1e-9);
                json!([outcome.instants_s[instant], trace_k[instant]])
            });
            json!({ "name": sensor.name, "peak_k": peak.temperature_k, "peak_time_s": peak.time_s, "trace_s_k": at })
        });
    json!({ "cells": outcome.cells, "steps": outcome.steps, "sensors": sensors.collect::<Vec<_>>() })
}

/// Descriptions of the differences between two records that exceed rounding.
fn differences(place: &str, was: &Value, is: &Value) -> Vec<String> {
    match (was, is) {
        (Value::Object(before), Value::Object(after)) if before.keys().eq(after.keys()) => {
            before.iter().flat_map(|(key, was)| differences(&format!("{place}.{key}"), was, &after[key])).collect()
        }
        (Value::Array(before), Value::Array(after)) if before.len() == after.len() => {
            let pairs = before.iter().zip(after).enumerate();
            pairs.flat_map(|(index, (was, is))| differences(&format!("{place}[{index}]"), was, is)).collect()
        }
        (Value::Number(before), Value::Number(after)) => {
            let off = after.as_f64().expect("a number") - before.as_f64().expect("a number");
            if off.abs() <= DOUBLE_K { Vec::new() } else { vec![format!("{place}: {after}, was {before}")] }
        }
        _ if was == is => Vec::new(),
        _ => vec![format!("{place}: {is}, was {was}")],
    }
}

fn kept(name: &str) -> PathBuf {
    root().join("tests/golden").join(format!("{name}.json"))
}

#[test]
fn every_shipped_case_matches_its_golden_file() {
    let mut found = Vec::new();
    for case in cases() {
        let (name, is) = (case.id(), record(&case, &marched(&case)));
        if std::env::var_os("BONDLINE_BLESS").is_some() {
            std::fs::create_dir_all(root().join("tests/golden")).expect("a folder for golden files");
            std::fs::write(kept(name), format!("{is:#}\n")).expect("a golden file");
        }
        let text = std::fs::read_to_string(kept(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        found.extend(differences(name, &serde_json::from_str(&text).expect("JSON"), &is));
    }
    assert!(found.is_empty(), "{}\nif the change is intended, BONDLINE_BLESS=1 renews tests/golden", found.join("\n"));
}

#[test]
fn a_difference_of_three_microkelvin_or_one_step_is_detected() {
    let case = case("slab");
    let mut outcome = marched(&case);
    let was = record(&case, &outcome);
    assert_eq!(differences("slab", &was, &record(&case, &outcome)), Vec::<String>::new());
    outcome.temperatures_k[1].last_mut().map(|last_k| *last_k += 3e-6).expect("a trace has instants");
    outcome.steps += 1;
    let found = differences("slab", &was, &record(&case, &outcome));
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].contains("slab.sensors[1].trace_s_k[5][1]") && found[1].contains("slab.steps"), "{found:?}");
}

/// Peaks of the layup of run 2259 with an insulated back, from an independent computation.
#[test]
fn the_peaks_of_the_arc_jet_layup_match_an_independent_computation() {
    let case = case("lcat-2259");
    let outcome = marched(&case);
    for (index, (name, peak_k)) in
        [("TC1", 1603.0), ("TC2", 1489.0), ("TC3", 1146.0), ("TC4", 916.0)].iter().enumerate()
    {
        let found_k = outcome.peaks[index].temperature_k;
        assert_eq!(case.sensors()[index].name, *name);
        assert!((found_k - peak_k).abs() <= 2.0, "{name} peaks at {found_k} K, reference {peak_k} K");
    }
    let late_s = outcome.peaks[3].time_s;
    assert!((late_s - 84.0).abs() <= 2.0, "TC4 peaks at {late_s} s, reference 84 s");
}

#[test]
fn the_slab_matches_its_exact_solution_within_ten_millikelvin() {
    let case = modified(&case("slab"), |case| case.resolution.tolerance_k = Some(0.01));
    let outcome = marched(&case);
    assert_eq!(case.observations().len(), 3);
    for (seen, misfit) in case.observations().iter().zip(&outcome.misfits) {
        let name = &case.sensors()[seen.sensor].name;
        assert!(misfit.samples > 70 && misfit.worst_k.abs() < 0.01, "{name}: {misfit:?}");
    }
}

/// Sweeps march in vectors, a nominal march does not; nine members fill neither eight nor four lanes.
#[test]
fn every_instruction_set_of_the_processor_gives_the_same_traces_of_every_case() {
    let is_same = |one: &Traces, other: &Traces| {
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
        bits(&one.temperatures_k) == bits(&other.temperatures_k) && bits(&one.gauges) == bits(&other.gauges)
    };
    for case in cases() {
        let plan = Plan::new(&case);
        let sampling = Sampling { kind: SamplingKind::Normal, seed: 1 };
        let ensemble = Ensemble::sample(case.factors(), Bounds::Small, &sampling, 9);
        let marched = InstructionSet::available().into_iter().map(|instruction_set| {
            let mut march = Cpu::new(Precision::F64).with_instruction_set(instruction_set);
            (instruction_set.name(), march.march(&plan, &ensemble, 0..9).expect("the CPU backend does not fail"))
        });
        let marched: Vec<(&str, Traces)> = marched.collect();
        let (widest, first) = &marched[0];
        for (name, traces) in &marched[1..] {
            assert!(is_same(first, traces), "{}: {widest} and {name} differ", case.id());
        }
        let mut other = first.clone();
        other.temperatures_k[0] += 1e-10;
        assert!(!is_same(first, &other), "a difference of a bit is not noticed");
    }
}
