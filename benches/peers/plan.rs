//! The plan of a case as JSON: cells, steps and tables for the peer implementations.
//!
//! `cargo bench --features internals --bench plan -- CASE [NAME=VALUE ...]` takes settings as `--set` of the command
//! does. `marches` holds both resolutions, the finer one first. Rows are flat, in the order of `fields`.

#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "this bench measures no time")]
mod common;

use bondline::adapt::adapt;
use bondline::plan::Plan;
use bondline::plan::layout::{
    Bead, BoundaryForcing, BulkProperties, Cell, ConductivityColumns, FACE_COLUMNS, Face, FaceColumns, NO_INSTANT, Ply,
    Sensor, SensorLocation, TABLE_NODES, TABLE_STEP_K,
};
use serde_json::{Value, json};

fn main() {
    // Cargo adds the flag `--bench`.
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    let (id, sets) = args.split_first().expect("a case such as lcat-2259");
    let pair = |set: &String| set.split_once('=').map(|(name, value)| (name.to_owned(), value.to_owned()));
    let sets: Vec<_> =
        sets.iter().map(|set| pair(set).unwrap_or_else(|| panic!("{set:?}: expected NAME=VALUE"))).collect();
    let case = common::case_with(id, &sets);
    let plan = adapt(&case).unwrap_or_else(|error| panic!("{error}"));
    println!(
        "{}",
        json!({
            "case": case.id(),
            "factors": case.factors().iter().map(|factor| &factor.name).collect::<Vec<_>>(),
            "sensor_names": case.sensors().iter().map(|sensor| &sensor.name).collect::<Vec<_>>(),
            "instants_s": plan.instants_s(),
            "marches": std::iter::once(&plan).chain(plan.coarse()).map(march).collect::<Vec<_>>(),
        })
    );
}

/// One resolution of a plan.
fn march(plan: &Plan) -> Value {
    let rows = &plan.rows();
    let recorded = (0..plan.instants().len()).filter(|&step| plan.instants()[step] != NO_INSTANT);
    json!({
        "times_s": plan.times_s(),
        "record_steps": recorded.collect::<Vec<_>>(),
        "taps": taps(plan),
        "cells": table(Cell::<f64>::FIELDS, &rows.cells, Cell::flatten),
        "plies": table(Ply::<u32>::FIELDS, plan.plies(), Ply::flatten),
        "conductions": table(ConductivityColumns::<u32>::FIELDS, plan.conductions(), ConductivityColumns::flatten),
        "bulks": table(BulkProperties::<f64>::FIELDS, &rows.bulk_properties, BulkProperties::flatten),
        "contacts_m2_k_w": rows.contacts_m2_k_w,
        "faces": table(Face::<f64>::FIELDS, &rows.faces, Face::flatten),
        "scalings": table(FaceColumns::<u32>::FIELDS, plan.scalings(), FaceColumns::flatten),
        "drives": table(BoundaryForcing::<f64>::FIELDS, &rows.boundary_forcing, BoundaryForcing::flatten),
        "sensors": table(Sensor::<f64>::FIELDS, &rows.sensors, Sensor::flatten),
        "places": table(SensorLocation::<u32>::FIELDS, plan.places(), SensorLocation::flatten),
        "beads": table(Bead::<f64>::FIELDS, &rows.beads, Bead::flatten),
        "parts": plan.parts(),
        "levels": plan.levels(),
        "states": plan.states(),
        "has_gas": plan.gas().is_some(),
        "has_holder": plan.has_holder(),
        "has_depths": plan.has_depths(),
        "table_nodes": TABLE_NODES,
        "table_step_k": TABLE_STEP_K,
        "table_columns": 2 * plan.properties(),
        "face_table": plan.face_table(),
        "face_columns": FACE_COLUMNS,
        "tables": *rows.tables,
    })
}

/// Interpolation stencil of each instant: records and weights.
fn taps(plan: &Plan) -> Vec<Vec<(usize, f64)>> {
    match &plan.readout() {
        Some(readout) => readout.stencils().iter().map(|taps| taps.to_vec()).collect(),
        None => (0..plan.records()).map(|record| vec![(record, 1.0)]).collect(),
    }
}

/// Rows with the names of their fields.
fn table<R, S: serde::Serialize>(fields: &[&str], rows: &[R], flatten: impl Fn(&R, &mut Vec<S>)) -> Value {
    let flat = rows.iter().map(|row| {
        let mut flat = Vec::new();
        flatten(row, &mut flat);
        flat
    });
    json!({ "fields": fields, "rows": flat.collect::<Vec<_>>() })
}
