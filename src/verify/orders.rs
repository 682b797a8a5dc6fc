//! Observed orders of accuracy in space and time.
//!
//! With errors e at one resolution and e' at twice that, the observed order is log₂(e/e'). Without an exact solution e
//! is the difference between successive resolutions (self-convergence), and the order is the mean over several
//! refinements: property tables have a corner every few kelvin, which makes single orders scatter by 0.1.

use super::problem::{Check, Measure, Problem, Setting, insulated, points};
use super::problems::charring::smooth;
use super::problems::flexible;
use super::problems::nonlinear::{
    KIRCHHOFF_DIFFUSIVITY_M2_S, KIRCHHOFF_SLOPE_1_K, KIRCHHOFF_START_K, kirchhoff_material,
};
use super::{Group, Row, exact};
use crate::case::{Case, GasPath, Resolution};
use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::traces::{Gauge, Traces};
use std::f64::consts::PI;
use std::sync::Arc;

/// Orders of accuracy in space and time, for an exact solution, a typical flexible layup and charring felts.
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
    let order_of = |march: &mut dyn March, case: &Case, cuts: &[(usize, usize)]| {
        Ok(observed(&refined(march, case, cuts)?, temperatures))
    };
    let cosines = "k(T), c(T), cosine profile";
    let manufactured = "Kirchhoff transform of a decaying cosine";
    let (layup, still) = (flexible::layup(), inert());
    let mut rows = vec![
        shortfall(cosines, manufactured, "Δx", exact(march, [80, 160], [wave_s / 4000.0; 2])?, 0.1),
        shortfall(cosines, manufactured, "Δt", exact(march, [4000; 2], [wave_s / 20.0, wave_s / 40.0])?, 0.1),
        shortfall(&layup.name, HALVED, "Δx", order_of(march, &layup, &[1, 2, 4, 8].map(in_space))?, 0.1),
        shortfall(&layup.name, HALVED, "Δt", order_of(march, &layup, &[2, 4, 8, 16, 32].map(in_time))?, 0.1),
        shortfall(&still.name, HALVED, "Δt", order_of(march, &still, &[1, 2, 4, 8].map(in_time))?, 0.1),
    ];
    for path in [GasPath::QuasiSteady, GasPath::Darcy] {
        rows.extend(charring(march, path)?);
    }
    Ok(rows)
}

const HALVED: &str = "self-convergence";

/// Orders of a charring felt with gas flow.
fn charring(march: &mut dyn March, path: GasPath) -> Result<Vec<Row>, MarchError> {
    let case = smooth(path, 1e-13);
    let coarse = Case { resolution: Resolution { cells: 80, ..case.resolution }, ..case.clone() };
    let finer_cells = refined(march, &coarse, &[1, 2, 4, 8].map(in_space))?;
    let finer_steps = refined(march, &case, &[1, 2, 4, 8].map(in_time))?;
    let of = |quantity: &str, step: &str, order: f64, tolerance: f64| {
        let row = shortfall(&case.name, HALVED, step, order, tolerance);
        Row { quantity: format!("{quantity}: {}", row.quantity), ..row }
    };
    let mut rows = vec![
        of("temperatures", "Δx", observed(&finer_cells, temperatures), 0.1),
        of("temperatures", "Δt", observed(&finer_steps, temperatures), 0.1),
        Row {
            group: Group::Orders,
            case: case.name.clone(),
            reference: "self-convergence, steps cut in eight".to_owned(),
            quantity: "temperatures at the default steps, largest difference".to_owned(),
            difference: largest(&finer_steps[0].temperatures_k, &finer_steps[3].temperatures_k),
            tolerance: 0.5,
            unit: "K".to_owned(),
            source_of_tolerance: "the tolerance of the problem \"TACOT held at 1644 K\"".to_owned(),
        },
        of("mass lost", "Δx", observed(&finer_cells, gauged(Gauge::MassLost)), 0.1),
        of("mass lost", "Δt", observed(&finer_steps, gauged(Gauge::MassLost)), 0.1),
        of("gas flux", "Δx", observed(&finer_cells, gauged(Gauge::GasFlux)), 0.1),
        of("gas flux", "Δt", observed(&finer_steps, gauged(Gauge::GasFlux)), 0.1),
    ];
    if path == GasPath::Darcy {
        rows.push(of("pressure", "Δx", observed(&finer_cells, gauged(Gauge::PeakPressure)), 0.1));
        rows.push(of("pressure", "Δt", observed(&finer_steps, gauged(Gauge::PeakPressure)), 0.1));
    }
    Ok(rows)
}

const THICKNESS_M: f64 = 0.02;

/// A slab of [`kirchhoff_material`] between insulated faces whose transformed temperature is a decaying cosine: a
/// smooth solution without a source.
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
    // Linear interpolation between so many points is accurate to 1e-6 of the smallest error measured.
    let profile = (0..=20_000).map(|i| THICKNESS_M * f64::from(i) / 20_000.0).map(|x| (x, rise_k(x, 0.0)));
    problem.case.exposure.initial_k = profile.collect();
    problem
}

/// The charring felt without reactions: it isolates the order in the step of conduction and faces.
fn inert() -> Case {
    let mut case = smooth(GasPath::Unhindered, 0.0);
    "charring felt, reactions off".clone_into(&mut case.name);
    for ply in &mut case.layup.plies {
        Arc::make_mut(&mut ply.material).decomposition = None;
    }
    case.gas = None;
    case
}

fn in_space(cuts: usize) -> (usize, usize) {
    (cuts, 1)
}

fn in_time(cuts: usize) -> (usize, usize) {
    (1, cuts)
}

/// Marches of the case at each refinement (cells, steps).
fn refined(march: &mut dyn March, case: &Case, cuts: &[(usize, usize)]) -> Result<Vec<Traces>, MarchError> {
    cuts.iter().map(|&(cells, steps)| carried(march, case, cells, steps)).collect()
}

/// Mean observed order of a reading over successive halvings; NaN without such a reading.
fn observed(marches: &[Traces], read: impl Fn(&Traces) -> &[f64]) -> f64 {
    let errors: Vec<f64> = marches.windows(2).map(|pair| root_mean_square(read(&pair[0]), read(&pair[1]))).collect();
    let halvings = errors.len() - 1;
    (errors[0] / errors[halvings]).log2() / halvings as f64
}

fn temperatures(traces: &Traces) -> &[f64] {
    &traces.temperatures_k
}

fn gauged(gauge: Gauge) -> impl Fn(&Traces) -> &[f64] {
    move |traces| traces.gauge(0, gauge).unwrap_or_default()
}

/// A march with each cell and each step cut into `cells` and `steps` parts.
pub(super) fn carried(march: &mut dyn March, case: &Case, cells: usize, steps: usize) -> Result<Traces, MarchError> {
    march.march(&Plan::finer(case, cells, steps), &Ensemble::at(0, Vec::new()), 0..1)
}

fn root_mean_square(one: &[f64], other: &[f64]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / one.len() as f64).sqrt()
}

/// The largest difference; NaN if one is NaN or there is nothing to compare.
fn largest(one: &[f64], other: &[f64]) -> f64 {
    let differences = one.iter().zip(other).map(|(a, b)| (a - b).abs());
    differences.reduce(|most, next| if next <= most { most } else { next }).unwrap_or(f64::NAN)
}

/// A row that fails if an observed order is below second order by more than the tolerance.
pub(super) fn shortfall(case: &str, reference: &str, step: &str, order: f64, tolerance: f64) -> Row {
    Row {
        group: Group::Orders,
        case: case.to_owned(),
        reference: reference.to_owned(),
        quantity: format!("order {order:.2} in {step}"),
        difference: 2.0 - order,
        tolerance,
        unit: "below order 2".to_owned(),
        source_of_tolerance: format!(
            "an order of {:.1} or more counts as second order; wide: higher-order terms change it by hundredths",
            2.0 - tolerance
        ),
    }
}
