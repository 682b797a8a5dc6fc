//! What a layup has beside its plies: a holder around it.

use crate::parity::differing;
use crate::support::{BALANCE, SINGLE_K, Scratch, adapter, coarse, drawn, with_factor};
use bondline::case::{Case, Face, Holder, Property, Schedule};
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::traces::{Balance, Traces};

/// The layup of every day in a holder that warms, which takes a good part of the heat.
fn held_sideways() -> Case {
    let mut case = coarse();
    let temperature_k = Schedule { times_s: vec![0.0, 30.0, 200.0], values: vec![300.0, 340.0, 310.0] };
    case.exposure.holder = Some(Holder { conductance_w_m3_k: 20e3, temperature_k });
    with_factor(case, "", Property::Holder)
}

/// The same under a held face.
fn held_above_too() -> Case {
    let mut case = held_sideways();
    case.factors.retain(|factor| ![Property::Heating, Property::Emissivity].contains(&factor.property));
    let temperature_k = Schedule { times_s: vec![0.0, 40.0, 200.0], values: vec![300.0, 1500.0, 500.0] };
    case.exposure.hot_face = Face::Held(temperature_k);
    case
}

fn carried(march: &mut dyn March, case: &Case) -> Traces {
    let ensemble = drawn(case, 5);
    march.march(&Plan::new(case), &ensemble, 0..ensemble.len()).expect("the march does not fail")
}

/// The largest difference of temperature, K.
fn apart_k(one: &Traces, other: &Traces) -> f64 {
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_layup_with_all_of_it_marches_on_the_device_as_on_the_processor() {
    let device = Device::open(adapter(), false).expect("the device opens");
    let mut gpu = Gpu::new(device, Precision::F32).expect("the device passes its self-tests");
    for case in [held_sideways(), held_above_too()] {
        let on_device = carried(&mut gpu, &case);
        let single = carried(&mut Cpu::new(Precision::F32), &case);
        assert_eq!(differing(&on_device, &single), 0);
        let mut warmer = case.clone();
        warmer.exposure.holder.as_mut().expect("there is one").temperature_k.values[1] += 1e-3;
        assert_ne!(differing(&on_device, &carried(&mut Cpu::new(Precision::F32), &warmer)), 0, "spoiled");
        let off_k = apart_k(&single, &carried(&mut Cpu::new(Precision::F64), &case));
        assert!(off_k <= SINGLE_K, "{off_k:.1e} K");
    }
}

#[test]
fn heat_lost_to_a_holder_is_in_the_balance_which_closes_at_second_order() {
    for case in [held_sideways(), held_above_too()] {
        let residuals = [1.0, 0.5].map(|scale| {
            let mut case = case.clone();
            let resolution = &mut case.resolution;
            resolution.first_step_s *= scale;
            resolution.growth *= 0.25 * scale;
            resolution.largest_step_s *= 0.25 * scale;
            let balance = carried(&mut Cpu::new(Precision::F64), &case).balances[0];
            assert!(balance.holder_out_j_m2 > 0.1 * balance.hot_in_j_m2, "{balance:?}");
            assert!(balance.holder_in_j_m2 > 0.0, "the holder warms the back at first: {balance:?}");
            let forgotten = Balance { holder_out_j_m2: 0.0, ..balance };
            assert!(forgotten.residual().abs() > BALANCE, "heat to nowhere passed");
            balance.residual().abs()
        });
        let order = (residuals[0] / residuals[1]).log2();
        assert!(residuals[0] < BALANCE, "{residuals:?}");
        assert!(order > 1.8, "order {order:.2} of {residuals:?}");
    }
}

#[test]
fn a_holder_that_takes_twice_as_much_leaves_every_peak_lower() {
    let peaks = [0.5, 1.0, 2.0].map(|scale| {
        let mut case = held_sideways();
        case.exposure.holder.as_mut().expect("there is one").conductance_w_m3_k *= scale;
        let traces = carried(&mut Cpu::new(Precision::F64), &case);
        (0..traces.sensors).map(|s| traces.trace(0, s).iter().copied().fold(0.0, f64::max)).collect::<Vec<_>>()
    });
    for pair in peaks.windows(2) {
        for (sensor, (more, less)) in pair[0].iter().zip(&pair[1]).enumerate() {
            assert!(less + 1.0 < *more, "sensor {sensor}: {more} K, then {less} K");
        }
    }
}

/// A case of two plies, as written, with more at its end.
fn written(more: &str) -> Result<Case, String> {
    let scratch = Scratch::new(&format!("layup-{:x}", more.len() * 31 + more.bytes().map(usize::from).sum::<usize>()));
    let text = r#"
duration = "50 s"
initial_temperature = "300 K"
contact_conductance = "500 W/m^2/K"

[[ply]]
name = "TOP"
material = "nextel440_bf20"
thickness = "0.5 mm"

[[ply]]
name = "BASE"
material = "pyrogel3350"
thickness = "3 mm"

[[sensor]]
name = "TC1"
below = "TOP"

[hot_face]
kind = "held"
temperature = "900 K"
"#;
    Case::load(&scratch.write("case.toml", format!("{text}{more}"))).map_err(|error| error.to_string())
}

#[track_caller]
fn refused(more: &str, reason: &str) {
    let said = written(more).expect_err("it has a fault");
    assert!(said.contains(reason), "{reason:?} is not said: {said}");
}

#[test]
fn a_holder_is_read_with_its_units_and_one_that_cannot_be_is_refused() {
    const HOLDER: &str =
        "[holder]\nconductance = \"20 kW/m^3/K\"\ntemperature = [[\"0 s\", \"300 K\"], [\"9 s\", \"310 K\"]]\n";
    const FACTOR: &str = "[[factor]]\nname = \"f_g\"\nproperty = \"holder\"\nsmall = [0.5, 2.0]\n";
    let case = written(&format!("{HOLDER}{FACTOR}")).expect("nothing is wrong");
    let holder = case.exposure.holder.as_ref().expect("it is written");
    assert_eq!((holder.conductance_w_m3_k, holder.temperature_k.after(9.0)), (20e3, 310.0));
    assert!(Plan::new(&case).times_s.contains(&9.0), "a step ends on the corner of its schedule");
    assert!(written("").expect("nothing is wrong").exposure.holder.is_none());
    refused(FACTOR, "there is no [holder] to lose heat to");
    refused(&HOLDER.replace("m^3", "m^2"), "wrong dimension: expected a conductance in a volume such as");
    refused(&HOLDER.replace("20 kW", "-20 kW"), "is not positive");
    refused("[holder]\nconductance = \"20 kW/m^3/K\"\n", "missing key \"temperature\"");
}
