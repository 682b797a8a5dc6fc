//! The plan of a case as JSON: cells, steps and tables for the peer implementations.
//!
//! `cargo bench --bench plan -- CASE [NAME=VALUE ...]` takes settings as `--set` of the command
//! does. `marches` holds both resolutions, the finer one first. Rows are flat, in the order of `fields`.

#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "this bench measures no time")]
mod common;

use bondline::adapt::adapt;
use bondline::plan::Plan;
use bondline_physics::layout::{
    Bead, BoundaryForcing, BulkProperties, Cell, ConductivityColumns, Face, FaceColumns, NO_INSTANT, Ply, Sensor,
    SensorLocation, TABLE_STEP_K, TABLE_STEPS, TableLocation,
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
    let (rows, data) = (plan.rows(), &plan.rows().data);
    let recorded = (0..rows.record_at_step.len()).filter(|&step| rows.record_at_step[step] != NO_INSTANT);
    json!({
        "times_s": plan.times_s(),
        "record_steps": recorded.collect::<Vec<_>>(),
        "taps": taps(plan),
        "cells": table(Cell::<f64>::FIELDS, &data.cells, Cell::flatten),
        "plies": table(Ply::<u32>::FIELDS, &rows.plies, Ply::flatten),
        "conductions":
            table(ConductivityColumns::<u32>::FIELDS, &rows.conductivity_columns, ConductivityColumns::flatten),
        "bulks": table(BulkProperties::<f64>::FIELDS, &data.bulk_properties, BulkProperties::flatten),
        "contacts_m2_k_w": data.contacts_m2_k_w,
        "faces": table(Face::<f64>::FIELDS, &data.faces, Face::flatten),
        "scalings": table(FaceColumns::<u32>::FIELDS, &rows.face_columns, FaceColumns::flatten),
        "drives": table(BoundaryForcing::<f64>::FIELDS, &data.boundary_forcing, BoundaryForcing::flatten),
        "sensors": table(Sensor::<f64>::FIELDS, &data.sensors, Sensor::flatten),
        "places": table(SensorLocation::<u32>::FIELDS, &rows.sensor_locations, SensorLocation::flatten),
        "beads": table(Bead::<f64>::FIELDS, &data.beads, Bead::flatten),
        "parts": rows.conductivity_parts,
        "depends_on_pressure": rows.plies.iter().any(|ply| ply.depends_on_pressure == 1),
        "advances_enthalpy": rows.has_enthalpy_steps,
        "has_directories": rows.tables.iter().any(|table| table.directory > 0),
        "states": rows.max_states,
        "has_gas": rows.gas.is_some(),
        "has_holder": rows.has_holder,
        "has_depths": rows.has_depth_factors,
        "table_nodes": TABLE_STEPS + 1,
        "table_step_k": TABLE_STEP_K,
        "tables": rows.tables.iter().map(|location| nodes(location, &data.tables)).collect::<Vec<_>>(),
    })
}

/// A table of one pressure level and the columns of one state, or of the faces: node × column.
fn nodes(location: &TableLocation<u32>, tables: &[f64]) -> Vec<Vec<f64>> {
    let columns = location.columns as usize;
    let rows = tables[location.offset as usize..].chunks_exact(columns).take(location.rows as usize);
    let mut nodes: Vec<Vec<f64>> = rows.map(<[f64]>::to_vec).collect();
    // The end of the last row.
    let end = nodes[nodes.len() - 1].chunks_exact(2).flat_map(|pair| [pair[0] + pair[1], 0.0]).collect();
    nodes.push(end);
    nodes
}

/// Interpolation stencil of each instant: records and weights.
fn taps(plan: &Plan) -> Vec<Vec<(usize, f64)>> {
    plan.interpolation().stencils().iter().map(|taps| taps.to_vec()).collect()
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
