//! Conversion of the words read back from a device into traces.

use super::scalar::DeviceScalar;
use super::state::Block;
use crate::plan::Plan;
use crate::traces::{Balance, Traces};
use rayon::prelude::*;
use std::array::from_fn;

/// Words of the traces of one member.
pub(super) fn trace_words(plan: &Plan) -> usize {
    2 * (plan.rows.sensor_locations.len() + plan.gauges()) * plan.rows.records
}

/// Members that are gathered together: their words of one instant fill a line or two of a cache.
const MEMBERS_PER_BLOCK: usize = 16;

/// Member × row × instant, from a function of instant, row and member, in parallel.
fn by_member(
    count: usize,
    rows: usize,
    instants: usize,
    value: impl Fn(usize, usize, usize) -> f64 + Sync,
) -> Vec<f64> {
    let mut values = vec![0.0; count * rows * instants];
    let each = (rows * instants).max(1);
    values.par_chunks_mut(MEMBERS_PER_BLOCK * each).enumerate().for_each(|(block, values)| {
        let first = block * MEMBERS_PER_BLOCK;
        for instant in 0..instants {
            for row in 0..rows {
                for (member, values) in values.chunks_exact_mut(each).enumerate() {
                    values[row * instants + instant] = value(instant, row, first + member);
                }
            }
        }
    });
    values
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
    let high =
        |instant: usize, row: usize, member: usize| recorded[2 * (instant * traced + row) * count + member].to_f64();
    let low = |instant: usize, row: usize, member: usize| {
        recorded[(2 * (instant * traced + row) + 1) * count + member].to_f64()
    };
    let temperatures_k = by_member(count, sensors, instants, |instant, sensor, member| {
        high(instant, sensor, member) + low(instant, sensor, member)
    });
    let gauges =
        by_member(count, plan.gauges(), instants, |instant, gauge, member| high(instant, sensors + gauge, member));
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
