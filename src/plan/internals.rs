//! Access to the fields of a plan, for the benches of the project.

use super::interpolation::RecordInterpolation;
use super::layout::{ConductivityColumns, FaceColumns, PlanData, Ply, SensorLocation};
use super::{GasFlowModel, Plan};

/// Declares accessors.
macro_rules! fields {
    ($($name:ident: $type:ty = $value:expr;)+) => {
        impl Plan {
            $(
                #[doc = concat!("The field `", stringify!($name), "`.")]
                pub fn $name(&self) -> $type {
                    let of: fn(&Plan) -> $type = $value;
                    of(self)
                }
            )+
        }
    };
}

fields! {
    rows: &PlanData<f64> = |plan| &plan.data;
    plies: &[Ply<u32>] = |plan| &plan.plies;
    conductions: &[ConductivityColumns<u32>] = |plan| &plan.conductivity_columns;
    scalings: &[FaceColumns<u32>; 2] = |plan| &plan.face_columns;
    places: &[SensorLocation<u32>] = |plan| &plan.sensor_locations;
    instants: &[u32] = |plan| &plan.record_at_step;
    readout: Option<&RecordInterpolation> = |plan| plan.interpolation.as_ref();
    has_depths: bool = |plan| plan.has_depth_factors;
    has_holder: bool = |plan| plan.has_holder;
    gas: Option<GasFlowModel> = |plan| plan.gas;
    parts: usize = |plan| plan.conductivity_parts;
    levels: usize = |plan| plan.pressure_levels;
    states: usize = |plan| plan.max_states;
    records: usize = |plan| plan.records;
    factors: usize = |plan| plan.factors;
}
