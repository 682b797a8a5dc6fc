//! Time of a cell-step of each method: members in SIMD lanes on one thread, as in the march.

use crate::layup::Layup;
use crate::methods::{Method, Steps, march};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline_physics::Real;
use bondline_physics::layout::NO_INSTANT;
use rayon::ThreadPoolBuilder;
use std::hint::black_box;
use std::time::Instant;

const ROUNDS: usize = 100;
const GROUPS: usize = 4;

/// Nanoseconds per cell, step and member of bondline's own march, with its heat balances and compensated temperatures.
pub(crate) fn own_ns(plan: &Plan, ensemble: &Ensemble) -> f64 {
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap_or_else(|error| panic!("{error}"));
    let marches = (0..ROUNDS).map(|_| {
        let began = Instant::now();
        let traces = pool.install(|| Cpu::new(Precision::F64).march(plan, ensemble, 0..ensemble.len()));
        black_box(traces.unwrap_or_else(|error| panic!("{error}")));
        began.elapsed().as_secs_f64()
    });
    1e9 * marches.fold(f64::INFINITY, f64::min) / (ensemble.len() * plan.cells() * plan.steps()) as f64
}

/// Nanoseconds per cell, step and member, the minimum over alternating rounds.
pub(crate) fn ns(plan: &Plan, methods: &[Method]) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; methods.len()];
    for _ in 0..ROUNDS {
        for (method, least) in methods.iter().zip(&mut least) {
            let began = Instant::now();
            let members = widest(*method, plan);
            let seconds = began.elapsed().as_secs_f64();
            *least = least.min(1e9 * seconds / (members * plan.cells() * plan.steps()) as f64);
        }
    }
    least
}

/// March some groups in the widest vectors that the march supports, or one by one; returns the number of members.
fn widest(method: Method, plan: &Plan) -> usize {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
    {
        use bondline_physics::lanes::F64Lanes;
        use simdeez::engines::avx512::Avx512;
        use simdeez::prelude::Simd;
        return Avx512::invoke(
            #[inline(always)]
            || carry::<F64Lanes<Avx512>>(method, plan),
        );
    }
    carry::<f64>(method, plan)
}

#[inline(always)]
fn carry<R: Real<Scalar = f64, Constant = R>>(method: Method, plan: &Plan) -> usize {
    let (sensors, steps) = (plan.rows().sensor_locations.len(), Steps::of(plan));
    let mut records = vec![R::from_f64(0.0); sensors * plan.rows().records];
    for group in 0..GROUPS {
        let columns: Vec<R> = (0..=plan.rows().factors)
            .map(|column| {
                R::from_lanes(|lane| if column == 0 { 1.0 } else { 0.9 + 0.02 * ((lane + column + group) % 11) as f64 })
            })
            .collect();
        let layup = Layup::new(plan, |column| columns[column as usize]);
        march(
            method,
            &layup,
            &steps,
            #[inline(always)]
            |step, temperatures| {
                let record = plan.rows().record_at_step[step];
                if record != NO_INSTANT {
                    for sensor in 0..sensors {
                        records[record as usize * sensors + sensor] = layup.read(temperatures, sensor);
                    }
                }
            },
        );
    }
    black_box(records);
    GROUPS * R::LANES
}
