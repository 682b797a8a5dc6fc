//! A case's plan as JSON: the cells, steps and tables that peers march too, so that nothing is copied by hand.
//!
//! `cargo bench --bench plan -- CASE [NAME=VALUE ...]`; what is set is what `--set` of the command takes. Rows are flat, in
//! the order of their fields, whose names stand beside them.

#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "only where the cases lie is shared with the benches that keep time")]
mod common;

use bondline::plan::Plan;
use bondline::plan::layout::{Bulk, Cell, Drive, Face, NO_INSTANT, Place, Ply, Scaling, Sensor, TABLE_NODES, TABLE_STEP_K};
use serde_json::{Value, json};

fn main() {
    // Cargo adds a flag of its own.
    let asked: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let (id, sets) = asked.split_first().expect("a case such as lcat-2259");
    let halves = |set: &String| set.split_once('=').map(|(name, value)| (name.to_owned(), value.to_owned()));
    let sets: Vec<_> = sets.iter().map(|set| halves(set).unwrap_or_else(|| panic!("{set:?} is no NAME=VALUE"))).collect();
    let case = common::case_with(id, &sets);
    let plan = Plan::new(&case);
    let rows = &plan.rows;
    let steps: Vec<usize> = (0..plan.instants.len()).filter(|&step| plan.instants[step] != NO_INSTANT).collect();
    let names = |names: Vec<&String>| json!(names);
    println!(
        "{}",
        json!({
            "case": case.id,
            "factors": names(case.factors.iter().map(|factor| &factor.name).collect()),
            "sensor_names": names(case.sensors.iter().map(|sensor| &sensor.name).collect()),
            "times_s": plan.times_s,
            "instants_s": plan.instants_s,
            "instant_steps": steps,
            "cells": table(Cell::<f64>::FIELDS, rows.cells.iter().map(|row| flat(|into| row.flatten(into)))),
            "plies": table(Ply::<u32>::FIELDS, plan.plies.iter().map(|row| flat(|into| row.flatten(into)))),
            "bulks": table(Bulk::<f64>::FIELDS, rows.bulks.iter().map(|row| flat(|into| row.flatten(into)))),
            "contacts_m2_k_w": rows.contacts_m2_k_w,
            "faces": table(Face::<f64>::FIELDS, rows.faces.iter().map(|row| flat(|into| row.flatten(into)))),
            "scalings": table(Scaling::<u32>::FIELDS, plan.scalings.iter().map(|row| flat(|into| row.flatten(into)))),
            "drives": table(Drive::<f64>::FIELDS, rows.drives.iter().map(|row| flat(|into| row.flatten(into)))),
            "sensors": table(Sensor::<f64>::FIELDS, rows.sensors.iter().map(|row| flat(|into| row.flatten(into)))),
            "places": table(Place::<u32>::FIELDS, plan.places.iter().map(|row| flat(|into| row.flatten(into)))),
            "parts": plan.parts,
            "levels": plan.levels,
            "states": plan.states,
            "has_gas": plan.gas.is_some(),
            "has_holder": plan.has_holder,
            "has_depths": plan.has_depths,
            "table_nodes": TABLE_NODES,
            "table_step_k": TABLE_STEP_K,
            "table_columns": plan.table_columns(),
            "face_table": plan.face_table(),
            "face_columns": plan.face_columns(),
            "tables": rows.tables,
        })
    );
}

/// A row's fields in order.
fn flat<S>(fill: impl Fn(&mut Vec<S>)) -> Vec<S> {
    let mut row = Vec::new();
    fill(&mut row);
    row
}

/// Rows with the names of their columns.
fn table<S: serde::Serialize>(fields: &[&str], rows: impl Iterator<Item = Vec<S>>) -> Value {
    json!({ "fields": fields, "rows": rows.collect::<Vec<_>>() })
}
