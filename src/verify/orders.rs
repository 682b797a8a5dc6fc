//! Observed orders of accuracy in space and time.
//!
//! With errors e at one resolution and e' at twice that, the observed order is log₂(e/e'). Without an exact solution e
//! is the difference between successive resolutions (self-convergence), and the order is the mean over several
//! refinements: property tables have a corner every few kelvin, which makes single orders scatter by 0.1.

use super::problem::{Check, ErrorScale, Problem, ProblemSetup, insulated_face, points};
use super::problems::charring::charring_felt;
use super::problems::flexible;
use super::problems::nonlinear::{
    KIRCHHOFF_DIFFUSIVITY_M2_S, KIRCHHOFF_SLOPE_1_K, KIRCHHOFF_START_K, kirchhoff_material,
};
use super::{Group, VerificationRow, exact};
use crate::case::{Case, GasFlowModel, Resolution};
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
pub fn order_rows(march: &mut dyn March) -> Result<Vec<VerificationRow>, MarchError> {
    let wave_s = THICKNESS_M * THICKNESS_M / (PI * PI * KIRCHHOFF_DIFFUSIVITY_M2_S);
    let exact = |march: &mut dyn March, cells: [usize; 2], steps_s: [f64; 2]| {
        let coarse = kirchhoff_cosine(cells[0], steps_s[0], wave_s).rows(march)?[0].difference;
        let fine = kirchhoff_cosine(cells[1], steps_s[1], wave_s).rows(march)?[0].difference;
        Ok((coarse / fine).log2())
    };
    let order_of = |march: &mut dyn March, case: &Case, cuts: &[(usize, usize)]| {
        Ok(observed_order(&march_refinements(march, case, cuts)?, temperatures))
    };
    let cosines = "k(T), c(T), cosine profile";
    let manufactured = "Kirchhoff transform of a decaying cosine";
    let (layup, still) = (flexible::flexible_layup(), inert());
    let mut rows = vec![
        order_row(cosines, manufactured, "Δx", exact(march, [80, 160], [wave_s / 4000.0; 2])?, 0.1),
        order_row(cosines, manufactured, "Δt", exact(march, [4000; 2], [wave_s / 20.0, wave_s / 40.0])?, 0.1),
        order_row(&layup.name, SELF_CONVERGENCE, "Δx", order_of(march, &layup, &[1, 2, 4, 8].map(refine_cells))?, 0.1),
        order_row(
            &layup.name,
            SELF_CONVERGENCE,
            "Δt",
            order_of(march, &layup, &[2, 4, 8, 16, 32].map(refine_steps))?,
            0.1,
        ),
        order_row(&still.name, SELF_CONVERGENCE, "Δt", order_of(march, &still, &[1, 2, 4, 8].map(refine_steps))?, 0.1),
    ];
    for path in [GasFlowModel::QuasiSteady, GasFlowModel::Darcy] {
        rows.extend(charring_orders(march, path)?);
    }
    Ok(rows)
}

const SELF_CONVERGENCE: &str = "self-convergence";

/// Orders of a charring felt with gas flow.
fn charring_orders(march: &mut dyn March, path: GasFlowModel) -> Result<Vec<VerificationRow>, MarchError> {
    let case = charring_felt(path, 1e-13);
    let coarse = Case { resolution: Resolution { cells: 80, ..case.resolution }, ..case.clone() };
    let finer_cells = march_refinements(march, &coarse, &[1, 2, 4, 8].map(refine_cells))?;
    let finer_steps = march_refinements(march, &case, &[1, 2, 4, 8].map(refine_steps))?;
    let of = |quantity: &str, step: &str, order: f64, tolerance: f64| {
        let row = order_row(&case.name, SELF_CONVERGENCE, step, order, tolerance);
        VerificationRow { quantity: format!("{quantity}: {}", row.quantity), ..row }
    };
    let mut rows = vec![
        of("temperatures", "Δx", observed_order(&finer_cells, temperatures), 0.1),
        of("temperatures", "Δt", observed_order(&finer_steps, temperatures), 0.1),
        VerificationRow {
            group: Group::Orders,
            case: case.name.clone(),
            reference: "self-convergence, steps cut in eight".to_owned(),
            quantity: "temperatures at the default steps, largest difference".to_owned(),
            difference: largest_difference(&finer_steps[0].temperatures_k, &finer_steps[3].temperatures_k),
            tolerance: 0.5,
            unit: "K".to_owned(),
            source_of_tolerance: "the tolerance of the problem \"TACOT held at 1644 K\"".to_owned(),
        },
        of("mass lost", "Δx", observed_order(&finer_cells, gauge_readings(Gauge::MassLost)), 0.1),
        of("mass lost", "Δt", observed_order(&finer_steps, gauge_readings(Gauge::MassLost)), 0.1),
        of("gas flux", "Δx", observed_order(&finer_cells, gauge_readings(Gauge::GasFlux)), 0.1),
        of("gas flux", "Δt", observed_order(&finer_steps, gauge_readings(Gauge::GasFlux)), 0.1),
    ];
    if path == GasFlowModel::Darcy {
        rows.push(of("pressure", "Δx", observed_order(&finer_cells, gauge_readings(Gauge::PeakPressure)), 0.1));
        rows.push(of("pressure", "Δt", observed_order(&finer_steps, gauge_readings(Gauge::PeakPressure)), 0.1));
    }
    Ok(rows)
}

const THICKNESS_M: f64 = 0.02;

/// A slab of [`kirchhoff_material`] between insulated faces whose transformed temperature is a decaying cosine: a
/// smooth solution without a source.
fn kirchhoff_cosine(cells: usize, step_s: f64, wave_s: f64) -> Problem {
    let rise_k = |depth_m: f64, time_s: f64| {
        let theta_k = 600.0 + 450.0 * (-time_s / wave_s).exp() * (PI * depth_m / THICKNESS_M).cos();
        KIRCHHOFF_START_K + exact::inverse_kirchhoff_k(theta_k, KIRCHHOFF_SLOPE_1_K)
    };
    let depths_m = [0.0, 0.25 * THICKNESS_M, 0.5 * THICKNESS_M, THICKNESS_M];
    let check = Check {
        reference: "",
        quantity: "",
        points: points(&depths_m, &[0.5 * wave_s, wave_s], rise_k),
        tolerance: f64::INFINITY,
        measure: ErrorScale::Absolute,
        source_of_tolerance: "",
    };
    let setting = ProblemSetup {
        plies: vec![(kirchhoff_material(), THICKNESS_M)],
        start_k: KIRCHHOFF_START_K,
        hot_face: insulated_face(),
        back_face: insulated_face(),
        cells,
        first_step_s: step_s,
        step_growth: 1.0,
    };
    let mut problem = Problem::new(Group::Orders, "cosine", setting, vec![check]).with_equal_steps(step_s);
    // Linear interpolation between so many points is accurate to 1e-6 of the smallest error measured.
    let profile = (0..=20_000).map(|i| THICKNESS_M * f64::from(i) / 20_000.0).map(|x| (x, rise_k(x, 0.0)));
    problem.case.exposure.initial_k = profile.collect();
    problem
}

/// The charring felt without reactions: it isolates the order in the step of conduction and faces.
fn inert() -> Case {
    let mut case = charring_felt(GasFlowModel::Instantaneous, 0.0);
    "charring felt, reactions off".clone_into(&mut case.name);
    for ply in &mut case.layup.plies {
        Arc::make_mut(&mut ply.material).decomposition = None;
    }
    case.gas = None;
    case
}

fn refine_cells(cuts: usize) -> (usize, usize) {
    (cuts, 1)
}

fn refine_steps(cuts: usize) -> (usize, usize) {
    (1, cuts)
}

/// Marches of the case at each refinement (cells, steps).
fn march_refinements(march: &mut dyn March, case: &Case, cuts: &[(usize, usize)]) -> Result<Vec<Traces>, MarchError> {
    cuts.iter().map(|&(cells, steps)| march_refined(march, case, cells, steps)).collect()
}

/// Mean observed order of a reading over successive halvings; NaN without such a reading.
fn observed_order(marches: &[Traces], read: impl Fn(&Traces) -> &[f64]) -> f64 {
    let errors: Vec<f64> = marches.windows(2).map(|pair| root_mean_square(read(&pair[0]), read(&pair[1]))).collect();
    let halvings = errors.len() - 1;
    (errors[0] / errors[halvings]).log2() / halvings as f64
}

fn temperatures(traces: &Traces) -> &[f64] {
    &traces.temperatures_k
}

fn gauge_readings(gauge: Gauge) -> impl Fn(&Traces) -> &[f64] {
    move |traces| traces.gauge(0, gauge).unwrap_or_default()
}

/// A march with each cell and each step cut into `cells` and `steps` parts.
pub(super) fn march_refined(
    march: &mut dyn March,
    case: &Case,
    cells: usize,
    steps: usize,
) -> Result<Traces, MarchError> {
    march.march(&Plan::with_refinement(case, cells, steps), &Ensemble::from_values(0, Vec::new()), 0..1)
}

fn root_mean_square(one: &[f64], other: &[f64]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / one.len() as f64).sqrt()
}

/// The largest difference; NaN if one is NaN or there is nothing to compare.
fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
    let differences = one.iter().zip(other).map(|(a, b)| (a - b).abs());
    differences.reduce(|most, next| if next <= most { most } else { next }).unwrap_or(f64::NAN)
}

/// A row that fails if an observed order is below second order by more than the tolerance.
pub(super) fn order_row(case: &str, reference: &str, step: &str, order: f64, tolerance: f64) -> VerificationRow {
    VerificationRow {
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
