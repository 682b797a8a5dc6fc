//! Derivatives at the nominal factors, where minima, maxima and comparisons of the physics may sit exactly on their
//! corners, against differences of temperatures: for every property that a factor can scale, on generated cases of
//! every kind.

mod kinds;

use crate::support::{CORNER_DERIVATIVE, FELT_K, FOUND, adapter, changed, coarse, numbers, with_factor};
use bondline::Case;
use bondline::case::{Observation, Property};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::estimate::{Search, estimate};
use bondline::study::sensitivity::{difference_step, sensitivity};
use bondline::traces::{Arrival, Traces};

/// Cases of two seeds.
fn cases() -> Vec<Case> {
    [26, 27].into_iter().flat_map(kinds::cases).collect()
}

fn nominal(case: &Case) -> Vec<f64> {
    case.factors().iter().map(|factor| factor.nominal).collect()
}

/// Derivatives by all factors, near the nominal ones: these times so much.
fn tangents(march: &mut dyn March, case: &Case, times: f64) -> Traces {
    let point: Vec<f64> = nominal(case).into_iter().map(|factor| factor * times).collect();
    let factors: Vec<usize> = (0..point.len()).collect();
    let told = march.tangents(&Plan::new(case), &Ensemble::at(point.len(), point), &factors);
    let told = told.expect("it marches").expect("it gives derivatives");
    assert!(told.arrivals.iter().all(|arrival| *arrival == Arrival::Done), "{}: {:?}", case.name(), told.arrivals);
    told
}

/// Differences by one factor over sensors and instants, K by a unit of it: central ones, but one-sided where the
/// nominal value lies on a bound.
fn differences(case: &Case) -> Vec<Vec<f64>> {
    let (plan, nominal, step) = (Plan::new(case), nominal(case), difference_step(Precision::F64));
    let ends: Vec<[f64; 2]> = case
        .factors()
        .iter()
        .map(|factor| {
            let (low, high) = factor.widest();
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
    let ensemble = Ensemble::at(nominal.len(), rows.flatten().collect());
    let marched = Cpu::new(Precision::F64).march(&plan, &ensemble, 0..ensemble.len()).expect("it marches");
    assert!(
        marched.arrivals.iter().all(|arrival| *arrival == Arrival::Done),
        "{}: {:?}",
        case.name(),
        marched.arrivals
    );
    let of = |(factor, [low, high]): (usize, &[f64; 2])| {
        let pairs = marched.member(2 * factor).iter().zip(marched.member(2 * factor + 1));
        pairs.map(|(low_k, high_k)| (high_k - low_k) / (high - low)).collect()
    };
    ends.iter().enumerate().map(of).collect()
}

/// The factors whose derivatives are off the differences by more than a share of the largest, with that share.
fn wrong(told: &Traces, case: &Case) -> Vec<(String, f64)> {
    let off = differences(case).into_iter().enumerate().map(|(factor, slopes)| {
        let largest = slopes.iter().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
        let name = format!("{}: {}", case.name(), case.factors()[factor].name);
        assert!(largest > FELT_K, "{name} changes nothing: {largest} K by a unit of it");
        let apart = told.member(1 + factor).iter().zip(&slopes).map(|(told, slope)| (told - slope).abs());
        (name, apart.fold(0.0, f64::max) / largest)
    });
    off.filter(|(_, off)| off.is_nan() || *off > CORNER_DERIVATIVE).collect()
}

#[test]
fn the_kinds_of_case_have_every_property_that_a_factor_can_scale() {
    let cases = kinds::cases(26);
    assert!(cases.len() >= 25, "{} kinds", cases.len());
    for (property, word) in kinds::PROPERTIES {
        assert_eq!(kinds::PROPERTIES[kinds::place(property)].1, word);
        let scaled = cases.iter().any(|case| case.factors().iter().any(|factor| factor.property == property));
        assert!(scaled, "no kind of case has a factor on {word}");
    }
}

#[test]
fn derivatives_at_nominal_factors_are_those_of_differences_for_every_property_on_every_kind_of_case() {
    for precision in [Precision::F64, Precision::F32] {
        let of = |case: &Case| wrong(&tangents(&mut Cpu::new(precision), case, 1.0), case);
        let wrong: Vec<_> = cases().iter().flat_map(of).collect();
        assert!(wrong.is_empty(), "in {precision:?}: {wrong:#?}");
    }
}

/// A billionth deeper the reading has the slope below the sensor alone, and beside a sensor at an interface that is not
/// the one above.
#[test]
fn a_derivative_of_one_side_alone_is_caught() {
    let cases = kinds::cases(26);
    let case = cases.iter().find(|case| case.name().contains("interfaces")).expect("one of the kinds");
    let told = |times| tangents(&mut Cpu::new(Precision::F64), case, times);
    assert_eq!(wrong(&told(1.0), case), []);
    assert_eq!(wrong(&told(1.0 + 1e-9), case).len(), case.factors().len());
}

#[test]
fn derivatives_at_nominal_factors_on_the_device_are_those_of_the_processor_to_the_last_bit() {
    let device = Device::open(adapter(), false).expect("the device opens");
    let mut gpu = Gpu::new(device, Precision::F32).expect("the device passes its self-tests");
    for word in ["interfaces", "depth of the back", "blowing without gas"] {
        let case = kinds::cases(26).into_iter().find(|case| case.name().contains(word)).expect("one of the kinds");
        let (here, there) = (tangents(&mut Cpu::new(Precision::F32), &case, 1.0), tangents(&mut gpu, &case, 1.0));
        let pairs = numbers(&here).into_iter().zip(numbers(&there));
        assert_eq!(pairs.filter(|(here, there)| here != there).count(), 0, "{}", case.name());
        assert_eq!(wrong(&there, &case), [], "{}", case.name());
    }
}

#[test]
fn sensitivities_and_estimates_find_the_depth_of_a_sensor_from_its_nominal_value() {
    let case = with_factor(&coarse(), "TC3", Property::Depth);
    let (depth, sensor, truth) = (case.factors().len() - 1, 2, 1.05);
    assert_eq!(case.sensors()[sensor].name, "TC3");
    let case = changed(&case, |case| {
        (case.observations, case.estimate.sensors, case.estimate.factors) = (Vec::new(), vec![sensor], vec![depth]);
        case.estimate.start.clear();
    });
    let plan = Plan::new(&case);
    let mut point = nominal(&case);
    point[depth] = truth;
    let traces = Cpu::new(Precision::F64).march(&plan, &Ensemble::at(point.len(), point), 0..1).expect("it marches");
    let (times_s, temperatures_k) = (plan.instants_s().to_vec(), traces.trace(0, sensor).to_vec());
    let sigma_k = vec![2.0; times_s.len()];
    let observation = Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None };
    let case = changed(&case, |case| case.observations = vec![observation]);
    let plan = Plan::new(&case);

    let found = |step| sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), step).expect("it marches");
    let (told, differed) = (found(None), found(Some(difference_step(Precision::F64))));
    assert_eq!((told.method(), differed.method()), ("tangent", "difference"));
    assert!(told.matter().contains(&depth), "the depth makes {} of the variance", told.shares[depth]);
    assert!((told.shares[depth] - differed.shares[depth]).abs() < CORNER_DERIVATIVE, "{:?}", differed.shares);

    let estimated = estimate(&[(&case, &plan)], &mut Cpu::new(Precision::F64), &Search::of(Precision::F64));
    let estimated = estimated.expect("there is something to estimate");
    assert!(estimated.converged, "{}", estimated.termination);
    assert!((estimated.values[0] - truth).abs() < FOUND, "{:?}", estimated.values);
}
