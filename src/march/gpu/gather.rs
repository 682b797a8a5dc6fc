//! What comes down from a device: how the words of a member lie, and traces from them.

use super::batch::Word;
use crate::plan::layout::HEATS;
use crate::plan::{GasPath, Plan};
use crate::traces::{Balance, Traces};
use std::array::from_fn;

/// Words of the sums of heat, in two words each, and of the heat stored: where the extremes begin.
const HEATS_END: usize = 2 * HEATS + 1;

/// Words of one member in the state before what it leaves behind: two a cell, four a sensor.
pub(super) fn outcome(plan: &Plan) -> usize {
    2 * plan.cells() + 4 * plan.places.len()
}

/// Words of one member in the state.
pub(super) fn state_words(plan: &Plan) -> usize {
    outcome(plan) + HEATS_END + 2 * plan.plies.len() + gas_words(plan)
}

/// Words of what gas took along before those of the advancements.
const GONE_WORDS: usize = 14;

/// Words of one member's gas: what it took along, two a reaction in a cell, one a state of it, three a cell and, by Darcy's law, six more.
fn gas_words(plan: &Plan) -> usize {
    let made = plan.cells() * (2 * plan.reactions.max(1) + plan.states + 3);
    match plan.gas {
        None => 0,
        Some(GasPath::Darcy) => GONE_WORDS + made + 6 * plan.cells(),
        Some(_) => GONE_WORDS + made,
    }
}

/// Words of one member in the traces.
pub(super) fn trace_words(plan: &Plan) -> usize {
    2 * (plan.places.len() + plan.gauges()) * plan.records
}

/// Traces from what came down, which lies member by member within each word; how they arrived is told apart.
pub(super) fn gather<W: Word>(plan: &Plan, first: usize, count: usize, shown: &[W], left: &[W]) -> Traces {
    let (sensors, instants) = (plan.places.len(), plan.records);
    let traced = sensors + plan.gauges();
    let mut temperatures_k = vec![0.0; count * sensors * instants];
    for instant in 0..instants {
        for sensor in 0..sensors {
            let base = 2 * (instant * traced + sensor) * count;
            for member in 0..count {
                temperatures_k[(member * sensors + sensor) * instants + instant] =
                    shown[base + member].real() + shown[base + count + member].real();
            }
        }
    }
    let mut gauges = vec![0.0; count * plan.gauges() * instants];
    for instant in 0..instants {
        for gauge in 0..plan.gauges() {
            let base = 2 * (instant * traced + sensors + gauge) * count;
            for member in 0..count {
                gauges[(member * plan.gauges() + gauge) * instants + instant] = shown[base + member].real();
            }
        }
    }
    let mut traces = Traces { temperatures_k, gauges, ..Traces::none(first, sensors, instants) };
    for member in 0..count {
        let word = |index: usize| left[index * count + member].real();
        let heat = |index: usize| word(2 * index) + word(2 * index + 1);
        let extremes_k: Vec<(f64, f64)> =
            (0..plan.plies.len()).map(|ply| (word(HEATS_END + 2 * ply), word(HEATS_END + 1 + 2 * ply))).collect();
        let mut balance = Balance::new(from_fn(heat), word(2 * HEATS));
        if plan.gas.is_some() {
            let gone = HEATS_END + 2 * plan.plies.len();
            let sum = |place: usize| word(gone + 2 * place) + word(gone + 2 * place + 1);
            balance = balance.and_gas([sum(0), sum(1), sum(2), sum(3), word(gone + 8), word(gone + 9)]);
        }
        traces.balances.push(balance);
        traces.extremes_k.extend(extremes_k);
    }
    traces
}
