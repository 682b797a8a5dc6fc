//! Do two marches agree? The device against the processor, single precision against double, and derivatives that a
//! march tells against differences.

use super::problems::flexible;
use super::{Group, Row, compare};
use crate::case::{Bounds, Case, Face, Factor, Property, Resolution, Schedule};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::march::cpu::Cpu;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;

/// Largest difference of single from double precision, K: a twentieth of what thermocouples resolve.
pub const SINGLE_K: f64 = 1e-3;
/// Largest difference of double precision on a device from that on the processor, K: rounding, where the
/// device orders its operations otherwise.
pub const DOUBLE_K: f64 = 1e-6;

/// Largest difference of derivatives that a march tells from central differences in double precision, of the largest of
/// the factor: what those of step 1e-7 are off by, as a temperature of 1,600 K is rounded at 2e-13 of itself. In f32,
/// rounding.
pub const DERIVATIVE: f64 = 1e-6;
/// Tolerance of derivatives in f32, as a share of the largest: see its uses.
pub const SINGLE_DERIVATIVE: f64 = 1e-5;
/// Derivatives below this count as if they were it, K by a unit of a factor: a hundredth of the factor moves a kelvin.
/// Of a factor that hardly moves anything differences and f32 tell rounding.
const FAINT_K: f64 = 100.0;
/// Relative steps of those differences, the nearer of which counts: with longer ones a cell passes the node of a table
/// between their points, and there is always some cell that passes one on either of these.
const STEPS: [f64; 2] = [1e-7, 1e-8];

/// Members of each comparison: enough for several vectors of lanes and a ragged end.
const MEMBERS: usize = 37;

/// Two rows a march and a case: the largest difference from the processor in double precision, and that of its
/// derivatives from differences; the latter of the processor in double precision too.
///
/// # Errors
/// As [`March::march`].
pub fn twins(marches: &mut [Box<dyn March>]) -> Result<Vec<Row>, MarchError> {
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
                    "a twentieth of what a thermocouple resolves; wide: devices may round in another order",
                ),
                Precision::F64 => {
                    ("f64", DOUBLE_K, "rounding over the march; wide: devices may round in another order")
                }
            };
            rows.push(Row {
                group: Group::Twins,
                case: case.name.clone(),
                reference: "the processor in f64".to_owned(),
                quantity: format!("{} {precision}, {}, {MEMBERS} members", backend.kind, backend.name),
                difference: compare(march.as_mut(), &mut Cpu::new(Precision::F64), &plan, &ensemble)?,
                tolerance,
                unit: "K".to_owned(),
                source_of_tolerance: source.to_owned(),
            });
        }
        let mut cpu: [Box<dyn March>; 1] = [Box::new(Cpu::new(Precision::F64))];
        for march in cpu.iter_mut().chain(marches.iter_mut()) {
            let backend = march.backend();
            let (precision, tolerance, source) = match backend.precision {
                Precision::F64 => (
                    "f64",
                    DERIVATIVE,
                    "rounding over the step of the differences; wide: another machine may round otherwise",
                ),
                Precision::F32 => {
                    ("f32", SINGLE_DERIVATIVE, "rounding over the march; wide: devices may round in another order")
                }
            };
            rows.push(Row {
                group: Group::Twins,
                case: case.name.clone(),
                reference: "differences in f64".to_owned(),
                quantity: format!("{} {precision}, derivatives by {} factors", backend.kind, case.factors.len()),
                difference: derivatives(march.as_mut(), &mut Cpu::new(Precision::F64), &plan, &nominal(&case))?,
                tolerance,
                unit: "of the largest".to_owned(),
                source_of_tolerance: source.to_owned(),
            });
        }
    }
    Ok(rows)
}

fn nominal(case: &Case) -> Vec<f64> {
    case.factors.iter().map(|factor| factor.nominal).collect()
}

/// How far derivatives by all factors, as a march tells them at a point, are from central differences of another's
/// temperatures, of the largest derivative by the same factor, or of 100 K if it is less; infinite where it tells none
/// or does not arrive.
///
/// # Errors
/// As [`March::march`].
pub fn derivatives(
    march: &mut dyn March,
    reference: &mut dyn March,
    plan: &Plan,
    point: &[f64],
) -> Result<f64, MarchError> {
    let factors: Vec<usize> = (0..point.len()).collect();
    let Some(told) = march.tangents(plan, &Ensemble::at(point.len(), point.to_vec()), &factors)? else {
        return Ok(f64::INFINITY);
    };
    let moved = factors.iter().flat_map(|&factor| {
        STEPS.iter().flat_map(|step| [-step, *step]).map(move |step| {
            let mut moved = point.to_vec();
            moved[factor] += step * moved[factor];
            moved
        })
    });
    let ensemble = Ensemble::at(point.len(), moved.flatten().collect());
    let marched = reference.march(plan, &ensemble, 0..ensemble.len())?;
    let mut worst = 0.0_f64;
    for factor in factors {
        let slopes = [0, 1].map(|which| {
            let (low, high) = (4 * factor + 2 * which, 4 * factor + 2 * which + 1);
            let width = ensemble.member(high)[factor] - ensemble.member(low)[factor];
            let pairs = marched.member(low).iter().zip(marched.member(high));
            pairs.map(|(low_k, high_k)| (high_k - low_k) / width).collect::<Vec<f64>>()
        });
        let largest = slopes[0].iter().fold(FAINT_K, |largest, slope| largest.max(slope.abs()));
        for (i, told) in told.member(1 + factor).iter().enumerate() {
            let [one, other] = [0, 1].map(|which| (told - slopes[which][i]).abs() / largest);
            worst = if one.is_nan() || other.is_nan() { f64::INFINITY } else { worst.max(one.min(other)) };
        }
    }
    Ok(worst)
}

/// A case of every day with factors to vary, and the same driven by a held face; coarse, as agreement does not
/// wait for accuracy.
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
    let mut flexible = flexible::layup();
    flexible.factors = vec![
        factor("f_k_OF", "OF", Property::Conductivity),
        factor("f_k_INS", "INS", Property::Conductivity),
        factor("f_cp_INS", "INS", Property::HeatCapacity),
        factor("f_t_INS", "INS", Property::Thickness),
        factor("f_q", "", Property::Heating),
        factor("f_h", "", Property::Contact),
        factor("f_loss", "", Property::Loss),
    ];
    let mut held = flexible.clone();
    held.name = "flexible layup, held face".to_owned();
    held.exposure.hot_face =
        Face::Held(Schedule { times_s: vec![0.0, 40.0, 200.0], values: vec![300.0, 1500.0, 500.0] });
    held.factors.retain(|factor| factor.property != Property::Heating);
    for case in [&mut flexible, &mut held] {
        case.resolution = Resolution { cells: 64, growth: 0.1, largest_step_s: 1.0, ..case.resolution };
    }
    vec![flexible, held]
}
