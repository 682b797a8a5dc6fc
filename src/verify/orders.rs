//! Does the error vanish as it should when grid and clock are refined?
//!
//! An accurate answer may be luck; an order is not. With errors e at a resolution and e' at twice that,
//! the observed order is log₂(e/e'). Where no exact solution is at hand, e is the difference between
//! successive resolutions, and the order is the mean of several: a property's table has a corner every few
//! kelvin, which makes single ones scatter by a tenth.

use super::problem::{Check, Measure, Problem, Setting, insulated, points};
use super::problems::flexible;
use super::problems::nonlinear::{
    KIRCHHOFF_DIFFUSIVITY_M2_S, KIRCHHOFF_SLOPE_1_K, KIRCHHOFF_START_K, kirchhoff_material,
};
use super::{Group, Row, exact, problems};
use crate::case::{Case, Resolution};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{Balance, Traces};
use std::f64::consts::PI;

/// Orders of accuracy in space and time, of a solution known for all times and of the case of every day.
///
/// # Errors
/// As [`March::march`].
pub fn orders(march: &mut dyn March) -> Result<Vec<Row>, MarchError> {
    let wave_s = THICKNESS_M * THICKNESS_M / (PI * PI * KIRCHHOFF_DIFFUSIVITY_M2_S);
    let exact = |march: &mut dyn March, cells: [usize; 2], steps_s: [f64; 2]| {
        let coarse = cosine(cells[0], steps_s[0], wave_s).rows(march)?[0].difference;
        let fine = cosine(cells[1], steps_s[1], wave_s).rows(march)?[0].difference;
        Ok((coarse / fine).log2())
    };
    let layup = |march: &mut dyn March, resolutions: &[Resolution]| {
        let mut errors = Vec::new();
        let mut last: Option<Traces> = None;
        for &resolution in resolutions {
            let traces = carried(march, Case { resolution, ..flexible::layup() })?;
            errors.extend(last.map(|last| root_mean_square(&last.temperatures_k, &traces.temperatures_k)));
            last = Some(traces);
        }
        let halvings = errors.len() - 1;
        Ok((errors[0] / errors[halvings]).log2() / halvings as f64)
    };
    let smooth = "k(T), c(T), cosine profile";
    let manufactured = "Kirchhoff transform of a decaying cosine";
    let every_day = flexible::layup().name;
    let halved = "itself, finer and finer";
    Ok(vec![
        shortfall(smooth, manufactured, "Δx", exact(march, [80, 160], [wave_s / 4000.0; 2])?, 0.1),
        shortfall(smooth, manufactured, "Δt", exact(march, [4000; 2], [wave_s / 20.0, wave_s / 40.0])?, 0.1),
        shortfall(&every_day, halved, "Δx", layup(march, &[1, 2, 4, 8].map(gridded))?, 0.1),
        shortfall(&every_day, halved, "Δt", layup(march, &[2.0, 4.0, 8.0, 16.0, 32.0].map(clocked))?, 0.1),
    ])
}

/// Energy balances at the default resolution, and how they close as the clock is refined.
///
/// # Errors
/// As [`March::march`].
pub fn balances(march: &mut dyn March) -> Result<Vec<Row>, MarchError> {
    let open_and_held = ["power laws, radiating", "TACOT, surface held by a schedule"];
    let others = problems::all().into_iter().map(|problem| problem.case);
    let others = others.filter(|case| open_and_held.contains(&case.name.as_str()));
    let mut rows = Vec::new();
    for case in std::iter::once(flexible::layup()).chain(others) {
        let name = case.name.clone();
        let mut residuals = [0.0; 2];
        for (residual, times) in residuals.iter_mut().zip([1.0, 2.0]) {
            let traces = carried(march, Case { resolution: clocked(times), ..case.clone() })?;
            *residual = traces.balances.first().map_or(f64::NAN, Balance::residual).abs();
        }
        rows.push(Row {
            group: Group::Balance,
            case: name.clone(),
            reference: "heat in less heat out less heat stored".to_owned(),
            quantity: "residual at the default resolution".to_owned(),
            difference: residuals[0],
            tolerance: 2e-4,
            unit: "of the heat moved".to_owned(),
            source_of_tolerance: "under a tenth of a per cent of the heat, so that no kelvin hides in it".to_owned(),
        });
        let order = (residuals[0] / residuals[1]).log2();
        rows.push(Row { group: Group::Balance, ..shortfall(&name, "itself at half", "Δt", order, 0.2) });
    }
    Ok(rows)
}

const THICKNESS_M: f64 = 0.02;

/// A slab of [`kirchhoff_material`] between insulated faces, whose transformed temperature is a decaying
/// cosine: a solution without a source, smooth from the start.
fn cosine(cells: usize, step_s: f64, wave_s: f64) -> Problem {
    let rise_k = |depth_m: f64, time_s: f64| {
        let theta_k = 600.0 + 450.0 * (-time_s / wave_s).exp() * (PI * depth_m / THICKNESS_M).cos();
        KIRCHHOFF_START_K + exact::untransformed_k(theta_k, KIRCHHOFF_SLOPE_1_K)
    };
    let depths_m = [0.0, 0.25 * THICKNESS_M, 0.5 * THICKNESS_M, THICKNESS_M];
    let check = Check {
        reference: "",
        quantity: "",
        points: points(&depths_m, &[0.5 * wave_s, wave_s], rise_k),
        tolerance: f64::INFINITY,
        measure: Measure::Plain,
        source_of_tolerance: "",
    };
    let setting = Setting {
        plies: vec![(kirchhoff_material(), THICKNESS_M)],
        start_k: KIRCHHOFF_START_K,
        hot_face: insulated(),
        back_face: insulated(),
        cells,
        first_step_s: step_s,
        growth: 1.0,
    };
    let mut problem = Problem::new(Group::Orders, "cosine", setting, vec![check]).stepped(step_s);
    // Straight lines between so many points are off by a millionth of the least error measured.
    let profile = (0..=20_000).map(|i| THICKNESS_M * f64::from(i) / 20_000.0).map(|x| (x, rise_k(x, 0.0)));
    problem.case.exposure.initial_k = profile.collect();
    problem
}

/// The default resolution with so many times the cells.
fn gridded(times: usize) -> Resolution {
    let default = Resolution::default();
    Resolution { cells: times * default.cells, ..default }
}

/// The default resolution with so many times the steps.
fn clocked(times: f64) -> Resolution {
    let default = Resolution::default();
    Resolution {
        first_step_s: default.first_step_s / times,
        growth: default.growth / times,
        largest_step_s: default.largest_step_s / times,
        ..default
    }
}

fn carried(march: &mut dyn March, case: Case) -> Result<Traces, MarchError> {
    march.march(&Plan::new(&case), &Ensemble::at(0, Vec::new()), 0..1)
}

fn root_mean_square(one: &[f64], other: &[f64]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / one.len() as f64).sqrt()
}

/// How far an observed order stays under second order.
fn shortfall(case: &str, reference: &str, step: &str, order: f64, tolerance: f64) -> Row {
    Row {
        group: Group::Orders,
        case: case.to_owned(),
        reference: reference.to_owned(),
        quantity: format!("order {order:.2} in {step}"),
        difference: 2.0 - order,
        tolerance,
        unit: "under 2".to_owned(),
        source_of_tolerance: format!("an order of {:.1} or more is second order", 2.0 - tolerance),
    }
}
