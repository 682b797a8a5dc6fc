//! Measured schedules: thousands of noisy rows need hardly more steps than a smooth schedule, and are integrated as
//! accurately as with a step per row.

use crate::support::{Uniform, case, device, modified, schedule};
use bondline::adapt::adapt;
use bondline::case::{Case, Face, Schedule};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::richardson::march_extrapolated;
use bondline::march::{March, Precision};
use bondline::plan::{Discretisation, Plan};
use bondline::plan::{StepGrowth, TimeStepControl};
use bondline::traces::Traces;
use std::f64::consts::TAU;

/// Upper limit of the work relative to the smooth schedule.
const WORK: f64 = 2.0;

/// A schedule sampled at a rate (Hz), with normal noise of 1 % of each value.
fn measured(smooth: &Schedule, duration_s: f64, rate_hz: f64, seed: u64) -> Schedule {
    let mut draw = Uniform(seed);
    // Box–Muller transform.
    let mut noise = || 0.01 * (-2.0 * (1.0 - draw.next()).ln()).sqrt() * (TAU * draw.next()).cos();
    let times_s: Vec<f64> = (0..=(duration_s * rate_hz).round() as usize).map(|row| row as f64 / rate_hz).collect();
    let values = times_s.iter().map(|&time_s| smooth.after(time_s) * (1.0 + noise())).collect::<Vec<_>>();
    schedule(&times_s, &values)
}

/// The schedule of the hot face: flux or temperature.
fn driver(case: &Case) -> &Schedule {
    match &case.exposure().hot_face {
        Face::Held(temperature_k) => temperature_k,
        Face::Open(open) => &open.flux_w_m2,
    }
}

fn driven(case: &Case, schedule: Schedule) -> Case {
    modified(case, |case| {
        case.observations.clear();
        match &mut case.exposure.hot_face {
            Face::Held(temperature_k) => *temperature_k = schedule,
            Face::Open(open) => open.flux_w_m2 = schedule,
        }
    })
}

fn marched(plan: &Plan, case: &Case) -> Traces {
    march_extrapolated(&mut Cpu::new(Precision::F64), plan, &Ensemble::nominal(case.factors()), 0..1)
        .expect("the CPU does not fail")
}

fn max_difference_k(one: &Traces, other: &Traces) -> f64 {
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn work(plan: &Plan) -> f64 {
    (plan.cells() * plan.steps()) as f64
}

#[test]
fn noisy_schedules_take_the_work_of_smooth_ones_and_match_a_march_with_a_step_per_row() {
    const RATE_HZ: f64 = 100.0;
    for (id, seed) in [("lcat-2259", 1), ("lcat-2259", 2), ("lcat-2259-tc3", 1), ("lcat-2259-tc3", 2)] {
        let smooth = case(id);
        let duration_s = smooth.exposure().duration_s;
        let noisy = driven(&smooth, measured(driver(&smooth), duration_s, RATE_HZ, seed));
        let [smooth_plan, plan] = [&smooth, &noisy].map(|case| adapt(case).expect("the CPU does not fail"));
        let times = work(&plan) / work(&smooth_plan);
        assert!(times < WORK, "{id}: {times:.2} times the work of the smooth schedule");

        let step_s = 1.0 / RATE_HZ;
        let growth = StepGrowth::Geometric { first_step_s: step_s, share: 0.0, max_step_s: step_s };
        let every_row = Discretisation {
            time_steps: TimeStepControl { growth, segments: Vec::new() },
            ..plan.discretisation().refined(2)
        };
        let every_row = plan.rediscretised(&noisy, every_row);
        assert_eq!(every_row.coarse().expect("a plan has both").steps(), 20_000, "expected one step per row");
        let truth = marched(&every_row, &noisy);
        let tolerance_k = noisy.resolution().tolerance_k.expect("the case does not state cells or steps");
        let off_k = max_difference_k(&marched(&plan, &noisy), &truth);
        assert!(off_k < tolerance_k, "{id}: an error of {off_k} K with a tolerance of {tolerance_k} K");

        // Negative control: sampling the schedule only at the ends of the steps must give a large error.
        let values = plan.times_s().iter().map(|&time_s| driver(&noisy).after(time_s)).collect::<Vec<_>>();
        let read = driven(&noisy, schedule(plan.times_s(), &values));
        let max_difference_k = max_difference_k(&marched(&plan.with_exposure(read.exposure()), &noisy), &truth);
        assert!(max_difference_k > 2.0 * tolerance_k, "{id}: only {max_difference_k} K without the rows between steps");
    }
}

#[test]
fn a_million_noisy_rows_take_the_work_of_the_smooth_schedule() {
    let smooth = case("lcat-2259");
    let noisy = driven(&smooth, measured(driver(&smooth), smooth.exposure().duration_s, 5_000.0, 3));
    assert!(driver(&noisy).times_s().len() > 1_000_000);
    let [smooth_plan, plan] = [&smooth, &noisy].map(|case| adapt(case).expect("the CPU does not fail"));
    let times = work(&plan) / work(&smooth_plan);
    assert!(times < WORK, "{times:.2} times the work of the smooth schedule");
}

#[test]
fn gpu_and_cpu_march_noisy_schedules_bit_identically() {
    let mut gpu = Gpu::new(device(), Precision::F32).expect("the device passes its self-tests");
    for id in ["lcat-2259", "lcat-2259-tc3"] {
        let smooth = case(id);
        let noisy = driven(&smooth, measured(driver(&smooth), smooth.exposure().duration_s, 100.0, 4));
        let plan = adapt(&noisy).expect("the CPU does not fail");
        let ensemble = Ensemble::nominal(noisy.factors());
        let [on_gpu, on_cpu]: [Traces; 2] = [&mut gpu as &mut dyn March, &mut Cpu::new(Precision::F32)]
            .map(|march| march_extrapolated(march, &plan, &ensemble, 0..1).expect("neither fails"));
        assert_eq!(on_gpu.temperatures_k, on_cpu.temperatures_k, "{id}");
        assert!(
            max_difference_k(&on_gpu, &marched(&adapt(&smooth).expect("a plan"), &smooth)) > 0.01,
            "{id}: the noise must show"
        );
    }
}

#[test]
fn a_sensor_on_a_held_face_reads_every_row_of_its_schedule_and_its_derivatives_stay_zero() {
    let smooth = case("lcat-2259-tc3");
    let noisy = driven(&smooth, measured(driver(&smooth), smooth.exposure().duration_s, 100.0, 5));
    let plan = adapt(&noisy).expect("the CPU does not fail");
    let face = noisy.sensors().iter().position(|sensor| sensor.name == "TC3").expect("TC3 is the driver");
    let nominal = Ensemble::nominal(noisy.factors());
    let factors: Vec<usize> = (0..noisy.factors().len()).collect();
    let tangents = Cpu::new(Precision::F64).tangents(&plan, &nominal, &factors).expect("marches").expect("derivatives");
    let last = plan.instants_s().len() - 1;
    for (&instant_s, &reading_k) in plan.instants_s()[..last].iter().zip(tangents.trace(0, face)) {
        assert_eq!(reading_k, driver(&noisy).after(instant_s), "at {instant_s} s");
    }
    for factor in 0..factors.len() {
        assert!(tangents.trace(1 + factor, face).iter().all(|&derivative| derivative == 0.0), "factor {factor}");
    }
}
