//! Output temperatures belong to their output instants despite the rounding of times.

use crate::support::{ROUNDING_K, case, modified, schedule};
use bondline::adapt::adapt;
use bondline::case::{Bounds, Case, EstimationSettings, Face, Resolution, Sensor, Side};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::richardson::march_extrapolated;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::Plan;

/// Output intervals whose multiples differ from the decimal number by rounding, s.
const EVERY_S: [f64; 6] = [0.1, 0.3, 0.7, 0.06, 0.13, 1.0 / 3.0];

/// A slab with stated cells and steps and a sensor on its hot face.
fn slab(every_s: f64, max_step_s: f64, hot_face: Face) -> Case {
    modified(&case("slab"), |case| {
        case.observations.clear();
        case.estimate = EstimationSettings::default();
        case.sensors = vec![Sensor {
            name: "TC1".to_owned(),
            depth_m: 0.0,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: None,
        }];
        case.exposure.duration_s = 12.0;
        case.exposure.initial_k = vec![(0.0, 300.0)];
        case.exposure.hot_face = hot_face;
        let stated = Resolution { tolerance_k: None, cells: 16, ..Resolution::default() };
        case.resolution = Resolution { output_interval_s: every_s, max_step_s, ..stated };
    })
}

fn trace_k(case: &Case) -> (Vec<f64>, Vec<f64>) {
    let plan = Plan::new(case);
    let traces = Cpu::new(Precision::F64).march(&plan, &Ensemble::nominal(case.factors()), 0..1);
    let traces = traces.expect("the CPU does not fail");
    (plan.instants_s().to_vec(), traces.trace(0, 0).to_vec())
}

/// A number between two times, rounded to two decimals as in a file.
fn decimal_s(number: f64, from_s: f64, to_s: f64) -> f64 {
    (100.0 * (from_s + (to_s - from_s) * number)).round() / 100.0
}

#[test]
fn a_sensor_on_a_held_face_reads_its_schedule_at_every_instant() {
    let factors = case("lcat-2259").factors().to_vec();
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 7 };
    let drawn = Ensemble::sample(&factors, Bounds::Small, &sampling, 60);
    let mut readings = 0;
    for member in 0..drawn.len() {
        // Uniform pseudo-random numbers in [0, 1).
        let mut numbers = drawn.member(member).into_iter().zip(&factors).map(|(value, factor)| {
            let (low, high) = factor.bounds(Bounds::Small);
            ((value - low) / (high - low)).clamp(0.0, 0.999_999)
        });
        let mut number = || numbers.next().expect("fewer numbers than factors are used");
        let every_s = EVERY_S[(number() * EVERY_S.len() as f64) as usize];
        // One corner at a decimal multiple of the interval, another anywhere.
        let multiple_s = decimal_s(((1.0 + 20.0 * number()).floor() * every_s - 0.1) / 10.0, 0.1, 10.1);
        let later_s = multiple_s + decimal_s(number(), 0.05, 1.5);
        let schedule = schedule(&[0.0, multiple_s, later_s], &[300.0, 300.0, 400.0 + 300.0 * number()]);
        let case = slab(every_s, 0.02 + number(), Face::Held(schedule.clone()));
        let (instants_s, trace_k) = trace_k(&case);
        for (&instant_s, &reading_k) in instants_s.iter().zip(&trace_k) {
            let off_k = (reading_k - schedule.after(instant_s)).abs();
            assert!(
                off_k < 1e-5,
                "{reading_k} K at {instant_s} s, every {every_s} s, corners {:?}",
                schedule.times_s()
            );
            readings += 1;
        }
    }
    assert!(readings > 1000, "only {readings} readings");
}

#[test]
fn a_flux_that_starts_with_a_jump_acts_fully_in_its_first_step_despite_rounding_of_its_time() {
    let of = |start_s: f64| {
        let flux_w_m2 = schedule(&[0.0, start_s, start_s], &[0.0, 0.0, 2e5]);
        let Face::Open(open) = case("slab").exposure().hot_face.clone() else { panic!("the face of the slab is open") };
        let case = slab(0.1, 0.1, Face::Open(bondline::case::OpenFace { flux_w_m2, ..open }));
        trace_k(&case).1
    };
    let exact_k = of(0.3);
    assert_eq!(exact_k[3], 300.0, "the face must be cold before the heating starts");
    assert!(exact_k[4] > 310.0, "the face must be hot after the heating starts");
    for rounded_s in [0.1 * 3.0, 0.3 - 1e-16 * 3.0, 0.3 + 1e-11, 0.3 - 1e-11] {
        let difference_k = exact_k.iter().zip(of(rounded_s)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference_k < 1e3 * ROUNDING_K, "{difference_k} K difference for a start at {rounded_s:?} s");
    }
    let late_k = of(0.301);
    assert!(exact_k[4] - late_k[4] > 0.1, "a start one millisecond later must show");
}

/// Adapted steps do not end on output instants: the last instant before a jump lies inside the step that ends at it.
#[test]
fn with_adapted_steps_a_held_face_reads_its_schedule_before_and_after_a_jump() {
    for jump_s in [3.01, 3.05, 3.2, 3.5] {
        let schedule = schedule(&[0.0, jump_s, jump_s], &[300.0, 430.0, 350.0]);
        let slab = slab(1.0, 1.0, Face::Held(schedule.clone()));
        let case = modified(&slab, |case| case.resolution.tolerance_k = Some(0.05));
        let plan = adapt(&case).expect("the CPU does not fail");
        let nominal = Ensemble::nominal(case.factors());
        let traces = march_extrapolated(&mut Cpu::new(Precision::F64), &plan, &nominal, 0..1);
        let traces = traces.expect("the CPU does not fail");
        for (&instant_s, reading_k) in plan.instants_s().iter().zip(traces.trace(0, 0)) {
            let off_k = (reading_k - schedule.after(instant_s)).abs();
            assert!(off_k < 1e-5, "{reading_k} K at {instant_s} s, an error of {off_k} K, for a jump at {jump_s} s");
        }
        assert!(plan.error_estimate().expect("an adapted plan has an estimate").nominal_k < 0.05, "jump at {jump_s} s");
    }
}
