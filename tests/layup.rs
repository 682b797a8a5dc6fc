//! What a layup has beside its plies: a holder around it, density that shades, contacts that differ.

use crate::parity::differing;
use crate::support::{BALANCE, ROUNDING_K, SINGLE_K, Scratch, adapter, coarse, drawn, with_factor};
use bondline::case::{Case, Conductivity, Face, Holder, Property, Schedule};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::sensitivity::sensitivity;
use bondline::traces::{Balance, Traces};
use std::sync::Arc;

/// The layup of every day in a holder that warms, which takes a good part of the heat.
fn held_sideways() -> Case {
    let mut case = coarse();
    let temperature_k = Schedule { times_s: vec![0.0, 30.0, 200.0], values: vec![300.0, 340.0, 310.0] };
    case.exposure.holder = Some(Holder { conductance_w_m3_k: 20e3, temperature_k });
    with_factor(with_factor(case, "OF2", Property::Contact), "", Property::Holder)
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

/// The layup of every day, of whose insulation heat capacity and density alone may vary; its extinction by mass or fixed.
fn shaded(by_mass: bool) -> Case {
    let mut case = coarse();
    let kept = [Property::HeatCapacity, Property::Density];
    case.factors.retain(|factor| factor.group == "INS" && kept.contains(&factor.property));
    assert_eq!(case.factors.len(), 2);
    for ply in case.layup.plies.iter_mut().filter(|ply| ply.group == "INS") {
        let material = Arc::make_mut(&mut ply.material);
        let Conductivity::Parts(parts) = &mut material.conductivity else { panic!("{} has no parts", material.id) };
        assert!(parts.extinction_follows_density, "{} states its extinction by mass", material.id);
        parts.extinction_follows_density = by_mass;
    }
    case
}

#[test]
fn density_tells_itself_from_heat_capacity_where_it_shades_and_only_there() {
    let [by_mass, fixed] = [true, false].map(|by_mass| {
        let case = shaded(by_mass);
        let plan = Plan::new(&case);
        assert_eq!(plan.parts, 1 + usize::from(by_mass), "nothing is spent where nothing follows");
        let found = sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), 1e-5);
        found.expect("the processor does not fail").all
    });
    assert_eq!((by_mass.rank, fixed.rank), (2, 1), "{by_mass:?} {fixed:?}");
    assert!(by_mass.alignment[0][1] < 1.0 - 1e-5, "{:?}", by_mass.alignment);
    assert!(fixed.alignment[0][1] > 1.0 - 1e-9, "{:?}", fixed.alignment);
}

#[test]
fn a_denser_felt_is_one_of_more_extinction() {
    let denser = shaded(true);
    let mut opaquer = denser.clone();
    for ply in opaquer.layup.plies.iter_mut().filter(|ply| ply.group == "INS") {
        let material = Arc::make_mut(&mut ply.material);
        material.density_kg_m3 *= 1.1;
        let Conductivity::Parts(parts) = &mut material.conductivity else { panic!("it has parts") };
        parts.extinction_1_m = parts.extinction_1_m.map(|extinction| 1.1 * extinction);
    }
    let of = |case: &Case, density: f64, shades: bool| {
        let place = case.factors.iter().position(|factor| factor.property == Property::Density).expect("it may vary");
        let row = (0..2).map(|factor| if factor == place { density } else { 1.0 }).collect();
        // The grid is that of the factors at one, which those of the plan do not move.
        let mut plan = Plan::new(&denser);
        plan.rows.bulks = Plan::new(case).rows.bulks;
        plan.rows.tables = Plan::new(case).rows.tables;
        plan.plies.iter_mut().filter(|_| !shades).for_each(|ply| ply.extinction = 0);
        Cpu::new(Precision::F64).march(&plan, &Ensemble::at(2, row), 0..1).expect("the processor does not fail")
    };
    let (scaled, stated) = (of(&denser, 1.1, true), of(&opaquer, 1.0, true));
    assert!(apart_k(&scaled, &stated) < 1e-6, "{} K", apart_k(&scaled, &stated));
    assert!(apart_k(&scaled, &of(&denser, 1.0, true)) > 1.0, "a tenth more density changed nothing");
    assert!(apart_k(&scaled, &of(&denser, 1.1, false)) > 0.1, "a tenth more extinction changed nothing");
}

#[test]
fn a_contact_factor_with_a_group_scales_the_interfaces_under_its_plies_alone() {
    let without = |case: &Case| Case { factors: Vec::new(), ..case.clone() };
    let alone = |case: &Case, values: &[f64]| {
        let ensemble = Ensemble::at(values.len(), values.to_vec());
        Cpu::new(Precision::F64).march(&Plan::new(case), &ensemble, 0..1).expect("the processor does not fail")
    };
    for (group, interfaces) in [("OF2", vec![1]), ("INS", vec![2, 3]), ("", vec![0, 1, 2, 3])] {
        let scaled = with_factor(without(&coarse()), group, Property::Contact);
        let mut stated = without(&coarse());
        for interface in interfaces {
            let contact = stated.layup.contacts_w_m2_k[interface].as_mut().expect("a contact");
            *contact *= 0.5;
        }
        let (scaled, nominal) = (alone(&scaled, &[0.5]), alone(&scaled, &[1.0]));
        let off_k = apart_k(&scaled, &alone(&stated, &[]));
        assert!(off_k <= ROUNDING_K, "{group:?}: {off_k} K");
        assert!(apart_k(&scaled, &nominal) > 1.0, "{group:?}: half the conductance changed nothing");
    }
}

#[test]
fn a_contact_factor_that_scales_nothing_or_what_another_scales_is_refused() {
    let factor = |name: &str, group: &str| {
        format!("[[factor]]\nname = \"{name}\"\nproperty = \"contact\"\n{group}small = [0.5, 2.0]\n")
    };
    let (top, base) = ("group = \"TOP\"\n", "group = \"BASE\"\n");
    assert_eq!(written(&factor("f_h", top)).expect("nothing is wrong").factors[0].group, "TOP");
    assert_eq!(written(&factor("f_h", "")).expect("nothing is wrong").factors[0].group, "");
    refused(&factor("f_h", base), "no contact under \"BASE\" has a conductance to scale");
    refused(&(factor("f_h", top) + &factor("f_all", "")), "\"f_all\" scales what factor \"f_h\" scales already");
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
