//! Access to the fields of a plan, for the benches of the project.

use super::layout::{Conduction, Place, Ply, Rows, Scaling};
use super::readout::Readout;
use super::{GasPath, Plan};

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
    rows: &Rows<f64> = |plan| &plan.rows;
    plies: &[Ply<u32>] = |plan| &plan.plies;
    conductions: &[Conduction<u32>] = |plan| &plan.conductions;
    scalings: &[Scaling<u32>; 2] = |plan| &plan.scalings;
    places: &[Place<u32>] = |plan| &plan.places;
    instants: &[u32] = |plan| &plan.instants;
    readout: Option<&Readout> = |plan| plan.readout.as_ref();
    has_depths: bool = |plan| plan.has_depths;
    has_holder: bool = |plan| plan.has_holder;
    gas: Option<GasPath> = |plan| plan.gas;
    parts: usize = |plan| plan.parts;
    levels: usize = |plan| plan.levels;
    states: usize = |plan| plan.states;
    records: usize = |plan| plan.records;
    factors: usize = |plan| plan.factors;
}
