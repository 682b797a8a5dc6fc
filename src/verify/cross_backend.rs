//! Backends against each other: device against CPU, f32 against f64, and tangents against finite differences.

use super::problems::flexible;
use super::{Group, VerificationRow, largest_difference_k};
use crate::case::{Bounds, Case, Face, Factor, Property, Resolution, Schedule};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::Cpu;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;

/// Largest difference of f32 from f64, K: a twentieth of the resolution of a thermocouple.
pub const SINGLE_K: f64 = 1e-3;
/// Largest difference of f64 on a device from f64 on the CPU, K: rounding, where the device reorders operations.
pub const DOUBLE_K: f64 = 1e-6;

/// Largest difference of f64 tangents from central differences, relative to the largest derivative by the same factor:
/// the error of a difference of step 1e-7 where a temperature of 1,600 K is rounded to 2e-13.
pub const TANGENT_TOLERANCE: f64 = 1e-6;
/// Largest relative difference of f32 tangents from central differences: rounding over the march.
pub const SINGLE_TANGENT_TOLERANCE: f64 = 1e-5;
/// Lower limit of the largest derivative, K per unit of the factor. Below it, differences and f32 give rounding only.
const MIN_DERIVATIVE_K: f64 = 100.0;
/// Relative steps of the differences; the closer result counts. Longer steps cross nodes of the property tables in some
/// cell; some cell crosses a node at either of these steps.
const DIFFERENCE_STEPS: [f64; 2] = [1e-7, 1e-8];

/// Members per comparison: several SIMD vectors and an incomplete one.
const MEMBERS: usize = 37;

/// Rows for every march and case: the largest difference from the CPU in f64, and that of the tangents from finite
/// differences; the latter for the CPU in f64 too, and not for a device without derivatives.
///
/// # Errors
/// As [`March::march`].
pub fn cross_backend_rows(marches: &mut [Box<dyn March>]) -> Result<Vec<VerificationRow>, MarchError> {
    let mut rows = Vec::new();
    for case in cases() {
        let plan = Plan::new(&case);
        let sampling = Sampling { kind: SamplingKind::Uniform, seed: 1 };
        let ensemble = Ensemble::sample(&case.factors, Bounds::Small, &sampling, MEMBERS);
        for march in marches.iter_mut() {
            let backend = march.backend();
            let (precision, tolerance, source) = match backend.precision {
                Precision::F32 => (
                    "f32",
                    SINGLE_K,
                    "a twentieth of a thermocouple's resolution; wide: devices may reorder operations",
                ),
                Precision::F64 => ("f64", DOUBLE_K, "rounding over the march; wide: devices may reorder operations"),
            };
            rows.push(VerificationRow {
                group: Group::CrossBackend,
                case: case.name.clone(),
                reference: "the CPU in f64".to_owned(),
                quantity: format!("{} {precision}, {}, {MEMBERS} members", backend.kind, backend.name),
                difference: largest_difference_k(march.as_mut(), &mut Cpu::new(Precision::F64), &plan, &ensemble)?,
                tolerance,
                unit: "K".to_owned(),
                source_of_tolerance: source.to_owned(),
            });
        }
        let mut cpu: [Box<dyn March>; 1] = [Box::new(Cpu::new(Precision::F64))];
        let factors: Vec<usize> = (0..case.factors.len()).collect();
        let point = Ensemble::from_values(factors.len(), nominal(&case));
        for march in cpu.iter_mut().chain(marches.iter_mut()) {
            let backend = march.backend();
            // A device whose threads have too little memory leaves derivatives to the processor.
            if backend.kind != "cpu" && march.tangents(&plan, &point, &factors)?.is_none() {
                continue;
            }
            let (precision, tolerance, source) = match backend.precision {
                Precision::F64 => (
                    "f64",
                    TANGENT_TOLERANCE,
                    "rounding over the step of the differences; wide: machines round differently",
                ),
                Precision::F32 => {
                    ("f32", SINGLE_TANGENT_TOLERANCE, "rounding over the march; wide: devices may reorder operations")
                }
            };
            rows.push(VerificationRow {
                group: Group::CrossBackend,
                case: case.name.clone(),
                reference: "finite differences in f64".to_owned(),
                quantity: format!("{} {precision}, derivatives by {} factors", backend.kind, case.factors.len()),
                difference: tangent_error(march.as_mut(), &mut Cpu::new(Precision::F64), &plan, &nominal(&case))?,
                tolerance,
                unit: "of the largest derivative".to_owned(),
                source_of_tolerance: source.to_owned(),
            });
        }
    }
    Ok(rows)
}

fn nominal(case: &Case) -> Vec<f64> {
    case.factors.iter().map(|factor| factor.nominal).collect()
}

/// Largest difference of the tangents by all factors at a point from central differences of a reference march, relative
/// to the largest derivative by the same factor (at least 100 K). Infinite if the march has no tangents or fails.
///
/// # Errors
/// As [`March::march`].
pub fn tangent_error(
    march: &mut dyn March,
    reference: &mut dyn March,
    plan: &Plan,
    point: &[f64],
) -> Result<f64, MarchError> {
    let factors: Vec<usize> = (0..point.len()).collect();
    let Some(tangents) = march.tangents(plan, &Ensemble::from_values(point.len(), point.to_vec()), &factors)? else {
        return Ok(f64::INFINITY);
    };
    let moved = factors.iter().flat_map(|&factor| {
        DIFFERENCE_STEPS.iter().flat_map(|step| [-step, *step]).map(move |step| {
            let mut moved = point.to_vec();
            moved[factor] += step * moved[factor];
            moved
        })
    });
    let ensemble = Ensemble::from_values(point.len(), moved.flatten().collect());
    let marched = reference.march(plan, &ensemble, 0..ensemble.len())?;
    let mut worst = 0.0_f64;
    for factor in factors {
        let slopes = [0, 1].map(|which| {
            let (low, high) = (4 * factor + 2 * which, 4 * factor + 2 * which + 1);
            let width = ensemble.member(high)[factor] - ensemble.member(low)[factor];
            let pairs = marched.member(low).iter().zip(marched.member(high));
            pairs.map(|(low_k, high_k)| (high_k - low_k) / width).collect::<Vec<f64>>()
        });
        let largest = slopes[0].iter().fold(MIN_DERIVATIVE_K, |largest, slope| largest.max(slope.abs()));
        for (i, tangent) in tangents.member(1 + factor).iter().enumerate() {
            let [one, other] = [0, 1].map(|which| (tangent - slopes[which][i]).abs() / largest);
            worst = if one.is_nan() || other.is_nan() { f64::INFINITY } else { worst.max(one.min(other)) };
        }
    }
    Ok(worst)
}

/// The flexible layup with factors, heated and with a held face, on a coarse grid: agreement does not need accuracy.
fn cases() -> Vec<Case> {
    let factor = |name: &str, group: &str, property| Factor {
        name: name.to_owned(),
        group: group.to_owned(),
        property,
        state: None,
        nominal: 1.0,
        small: (0.75, 1.25),
        large: (0.5, 1.5),
    };
    let mut flexible = flexible::flexible_layup();
    flexible.factors = vec![
        factor("f_k_OF", "OF", Property::Conductivity),
        factor("f_k_INS", "INS", Property::Conductivity),
        factor("f_cp_INS", "INS", Property::HeatCapacity),
        factor("f_t_INS", "INS", Property::Thickness),
        factor("f_q", "", Property::Heating),
        factor("f_h", "", Property::ContactConductance),
        factor("f_loss", "", Property::BackFaceLoss),
    ];
    let mut held = flexible.clone();
    held.name = "flexible layup, held face".to_owned();
    held.exposure.hot_face =
        Face::Held(Schedule { times_s: vec![0.0, 40.0, 200.0], values: vec![300.0, 1500.0, 500.0] });
    held.factors.retain(|factor| factor.property != Property::Heating);
    for case in [&mut flexible, &mut held] {
        case.resolution = Resolution { cells: 64, step_growth: 0.1, max_step_s: 1.0, ..case.resolution };
    }
    vec![flexible, held]
}
