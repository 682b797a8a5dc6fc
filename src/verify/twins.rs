//! Do two marches agree? The device against the processor, and single precision against double.

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

/// Members of each comparison: enough for several vectors of lanes and a ragged end.
const MEMBERS: usize = 37;

/// One row a march and a case: the largest difference from the processor in double precision.
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
                Precision::F32 => ("f32", SINGLE_K, "a twentieth of what a thermocouple resolves"),
                Precision::F64 => ("f64", DOUBLE_K, "rounding over the march"),
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
    }
    Ok(rows)
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
