//! Tangents at the nominal factors, where minima, maxima and comparisons of the physics may be exactly at their kinks,
//! against finite differences: for every property that a factor can scale, on generated cases of every kind.

mod kinds;

use crate::support::{
    DERIVATIVE_AT_TABLE_NODE, MIN_DERIVATIVE_K, NOISE_FREE_ESTIMATE, adapter, all_numbers, coarse, modified, runs_all,
    with_factor,
};
use bondline::Case;
use bondline::case::{Observation, Property};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::estimate::{SearchOptions, estimate};
use bondline::study::sensitivity::{difference_step, sensitivity};
use bondline::traces::{MemberStatus, Traces};
use bondline::work_log::NoLog;

/// Cases of two seeds.
fn cases() -> Vec<Case> {
    [26, 27].into_iter().flat_map(kinds::cases).collect()
}

fn nominal(case: &Case) -> Vec<f64> {
    case.factors().iter().map(|factor| factor.nominal).collect()
}

/// Tangents with respect to all factors, at `times` the nominal ones.
fn tangents(march: &mut dyn March, case: &Case, times: f64) -> Traces {
    let point: Vec<f64> = nominal(case).into_iter().map(|factor| factor * times).collect();
    let factors: Vec<usize> = (0..point.len()).collect();
    let computed = march.tangents(&Plan::new(case), &Ensemble::from_values(point.len(), point), &factors);
    let computed = computed.expect("it marches").expect("it gives derivatives");
    assert!(
        computed.statuses.iter().all(|status| *status == MemberStatus::Completed),
        "{}: {:?}",
        case.name(),
        computed.statuses
    );
    computed
}

/// Finite differences with respect to each factor over sensors and instants, K per unit: central, or one-sided where
/// the nominal value is on a bound.
fn differences(case: &Case) -> Vec<Vec<f64>> {
    let (plan, nominal, step) = (Plan::new(case), nominal(case), difference_step(Precision::F64));
    let ends: Vec<[f64; 2]> = case
        .factors()
        .iter()
        .map(|factor| {
            let (low, high) = factor.widest_bounds();
            [(factor.nominal - step).max(low), (factor.nominal + step).min(high)]
        })
        .collect();
    let rows = ends.iter().enumerate().flat_map(|(factor, ends)| {
        ends.map(|end| {
            let mut row = nominal.clone();
            row[factor] = end;
            row
        })
    });
    let ensemble = Ensemble::from_values(nominal.len(), rows.flatten().collect());
    let marched = Cpu::new(Precision::F64).march(&plan, &ensemble, 0..ensemble.len()).expect("it marches");
    assert!(
        marched.statuses.iter().all(|status| *status == MemberStatus::Completed),
        "{}: {:?}",
        case.name(),
        marched.statuses
    );
    let of = |(factor, [low, high]): (usize, &[f64; 2])| {
        let pairs = marched.member(2 * factor).iter().zip(marched.member(2 * factor + 1));
        pairs.map(|(low_k, high_k)| (high_k - low_k) / (high - low)).collect()
    };
    ends.iter().enumerate().map(of).collect()
}

/// The factors whose tangents differ from the differences by more than the tolerance, relative to the largest, with
/// that ratio.
fn wrong(computed: &Traces, case: &Case) -> Vec<(String, f64)> {
    let off = differences(case).into_iter().enumerate().map(|(factor, slopes)| {
        let largest = slopes.iter().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        let name = format!("{}: {}", case.name(), case.factors()[factor].name);
        assert!(largest > MIN_DERIVATIVE_K, "{name} has no effect: {largest} K per unit");
        let apart = computed.member(1 + factor).iter().zip(&slopes).map(|(computed, slope)| (computed - slope).abs());
        (name, apart.fold(0.0, f64::max) / largest)
    });
    off.filter(|(_, off)| off.is_nan() || *off > DERIVATIVE_AT_TABLE_NODE).collect()
}

#[test]
fn the_generated_cases_cover_every_property_that_a_factor_can_scale() {
    let cases = kinds::cases(26);
    assert!(cases.len() >= 25, "{} kinds", cases.len());
    for (property, word) in kinds::PROPERTIES {
        assert_eq!(kinds::PROPERTIES[kinds::place(property)].1, word);
        let scaled = cases.iter().any(|case| case.factors().iter().any(|factor| factor.property == property));
        assert!(scaled, "no kind of case has a factor on {word}");
    }
}

#[test]
fn tangents_at_nominal_factors_equal_differences_for_every_property_and_kind_of_case() {
    for precision in [Precision::F64, Precision::F32] {
        let of = |case: &Case| wrong(&tangents(&mut Cpu::new(precision), case, 1.0), case);
        let wrong: Vec<_> = cases().iter().flat_map(of).collect();
        assert!(wrong.is_empty(), "in {precision:?}: {wrong:#?}");
    }
}

/// A billionth deeper, the reading has the slope below the sensor alone, which at an interface differs from the slope
/// above.
#[test]
fn a_one_sided_derivative_is_caught() {
    let cases = kinds::cases(26);
    let case = cases.iter().find(|case| case.name().contains("interfaces")).expect("one of the kinds");
    let computed = |times| tangents(&mut Cpu::new(Precision::F64), case, times);
    assert_eq!(wrong(&computed(1.0), case), []);
    assert_eq!(wrong(&computed(1.0 + 1e-9), case).len(), case.factors().len());
}

#[test]
fn tangents_at_nominal_factors_are_bit_identical_on_device_and_cpu() {
    let device = Device::open(adapter(), false).expect("the device opens");
    let mut gpu = Gpu::new(device, Precision::F32).expect("the device passes its self-tests");
    for word in ["interfaces", "blowing without gas"].into_iter().chain(runs_all().then_some("depth of the back")) {
        let case = kinds::cases(26).into_iter().find(|case| case.name().contains(word)).expect("one of the kinds");
        let (here, there) = (tangents(&mut Cpu::new(Precision::F32), &case, 1.0), tangents(&mut gpu, &case, 1.0));
        let pairs = all_numbers(&here).into_iter().zip(all_numbers(&there));
        assert_eq!(pairs.filter(|(here, there)| here != there).count(), 0, "{}", case.name());
        assert_eq!(wrong(&there, &case), [], "{}", case.name());
    }
}

#[test]
fn sensitivities_and_estimates_find_the_depth_of_a_sensor_from_its_nominal_value() {
    let case = with_factor(&coarse(), "TC3", Property::SensorDepth);
    let (depth, sensor, truth) = (case.factors().len() - 1, 2, 1.05);
    assert_eq!(case.sensors()[sensor].name, "TC3");
    let case = modified(&case, |case| {
        (case.observations, case.estimate.sensors, case.estimate.factors) = (Vec::new(), vec![sensor], vec![depth]);
        case.estimate.start.clear();
    });
    let plan = Plan::new(&case);
    let mut point = nominal(&case);
    point[depth] = truth;
    let traces =
        Cpu::new(Precision::F64).march(&plan, &Ensemble::from_values(point.len(), point), 0..1).expect("it marches");
    let (times_s, temperatures_k) = (plan.instants_s().to_vec(), traces.trace(0, sensor).to_vec());
    let sigma_k = vec![2.0; times_s.len()];
    let observation = Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None };
    let case = modified(&case, |case| case.observations = vec![observation]);
    let plan = Plan::new(&case);

    let found = |step| sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), step).expect("it marches");
    let (computed, differed) = (found(None), found(Some(difference_step(Precision::F64))));
    assert_eq!((computed.method(), differed.method()), ("tangent", "difference"));
    assert!(
        computed.influential_factors().contains(&depth),
        "the depth has a share of {} of the variance",
        computed.shares[depth]
    );
    assert!(
        (computed.shares[depth] - differed.shares[depth]).abs() < DERIVATIVE_AT_TABLE_NODE,
        "{:?}",
        differed.shares
    );

    let estimated = estimate(
        &[(&case, &plan)],
        &mut Cpu::new(Precision::F64),
        &SearchOptions::for_precision(Precision::F64),
        &mut NoLog,
    );
    let estimated = estimated.expect("an estimate");
    assert!(estimated.converged, "{}", estimated.termination);
    assert!((estimated.values[0] - truth).abs() < NOISE_FREE_ESTIMATE, "{:?}", estimated.values);
}
