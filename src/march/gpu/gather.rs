//! Conversion of the words read back from a device into traces.

use super::scalar::DeviceScalar;
use super::state::Block;
use crate::plan::Plan;
use crate::traces::{Balance, Traces};
use std::array::from_fn;

/// Words of the traces of one member.
pub(super) fn trace_words(plan: &Plan) -> usize {
    2 * (plan.rows.sensor_locations.len() + plan.gauges()) * plan.rows.records
}

/// Traces from `recorded` and the results part of the state, `final_state`: word × member. The status of the members is
/// set by the caller.
pub(super) fn gather_traces<W: DeviceScalar>(
    plan: &Plan,
    first: usize,
    count: usize,
    recorded: &[W],
    final_state: &[W],
) -> Traces {
    let (sensors, instants) = (plan.rows.sensor_locations.len(), plan.rows.records);
    let traced = sensors + plan.gauges();
    let mut temperatures_k = vec![0.0; count * sensors * instants];
    for instant in 0..instants {
        for sensor in 0..sensors {
            let base = 2 * (instant * traced + sensor) * count;
            for member in 0..count {
                temperatures_k[(member * sensors + sensor) * instants + instant] =
                    recorded[base + member].to_f64() + recorded[base + count + member].to_f64();
            }
        }
    }
    let mut gauges = vec![0.0; count * plan.gauges() * instants];
    for instant in 0..instants {
        for gauge in 0..plan.gauges() {
            let base = 2 * (instant * traced + sensors + gauge) * count;
            for member in 0..count {
                gauges[(member * plan.gauges() + gauge) * instants + instant] = recorded[base + member].to_f64();
            }
        }
    }
    let mut traces = Traces { temperatures_k, gauges, ..Traces::empty(first, sensors, instants) };
    for member in 0..count {
        let word = |block: Block, index: usize| {
            final_state[(block.slot(plan) - Block::Heat.slot(plan) + index) * count + member].to_f64()
        };
        let sum = |block: Block, place: usize| word(block, 2 * place) + word(block, 2 * place + 1);
        let extremes_k: Vec<(f64, f64)> = (0..plan.rows.plies.len())
            .map(|ply| (word(Block::Extremes, 2 * ply), word(Block::Extremes, 2 * ply + 1)))
            .collect();
        let mut balance = Balance::new(from_fn(|heat| sum(Block::Heat, heat)), word(Block::Stored, 0));
        if plan.rows.gas.is_some() {
            let [gas_in, gas_out, heat, gain] = from_fn(|place| sum(Block::GasSums, place));
            let [lost, stored] = from_fn(|place| word(Block::GasSums, 8 + place));
            balance = balance.with_gas([gas_in, gas_out, heat, gain, lost, stored]);
        }
        traces.balances.push(balance);
        traces.extremes_k.extend(extremes_k);
    }
    traces
}
