//! Holder, density with extinction, contact factors, sensor sides and depth factors.

use crate::support::count_differences;
use crate::support::{
    BALANCE, ROUNDING_K, SINGLE_K, Scratch, adapter, coarse, modified, nominal_and_random, schedule, with_factor,
};
use bondline::case::{
    Case, Conductivity, EstimationSettings, Face, Holder, Material, Property, Resolution, Side, Table,
};
use bondline::ensemble::Ensemble;
use bondline::march::cpu::Cpu;
use bondline::march::gpu::Gpu;
use bondline::march::gpu::device::Device;
use bondline::march::{March, Precision};
use bondline::plan::Plan;
use bondline::study::sensitivity::sensitivity;
use bondline::traces::Traces;
use std::sync::Arc;

/// The layup of `coarse` with a warming holder that takes a good part of the heat.
fn with_holder() -> Case {
    let case = modified(&coarse(), |case| {
        let temperature_k = schedule(&[0.0, 30.0, 200.0], &[300.0, 340.0, 310.0]);
        case.exposure.holder = Some(Holder { conductance_w_m3_k: 20e3, temperature_k });
        case.sensors[1].side = Side::Above;
    });
    let more = [
        ("OF2", Property::ContactConductance),
        ("", Property::HolderLoss),
        ("TC2", Property::SensorDepth),
        ("TC3", Property::SensorDepth),
    ];
    more.into_iter().fold(case, |case, (group, property)| with_factor(&case, group, property))
}

/// The same with a held hot face.
pub(crate) fn with_holder_and_held_face() -> Case {
    modified(&with_holder(), |case| {
        case.factors.retain(|factor| ![Property::Heating, Property::Emissivity].contains(&factor.property));
        case.estimate.factors.clear();
        case.exposure.hot_face = Face::Held(schedule(&[0.0, 40.0, 200.0], &[300.0, 1500.0, 500.0]));
    })
}

fn traces_of(march: &mut dyn March, case: &Case) -> Traces {
    let ensemble = nominal_and_random(case, 5);
    march.march(&Plan::new(case), &ensemble, 0..ensemble.len()).expect("the march does not fail")
}

/// Largest difference of temperatures, K.
fn largest_difference_k(one: &Traces, other: &Traces) -> f64 {
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn holder_side_and_depth_factors_are_bit_identical_on_gpu_and_processor() {
    let device = Device::open(adapter(), false).expect("the device opens");
    let mut gpu = Gpu::new(device, Precision::F32).expect("the device passes its self-tests");
    for case in [with_holder(), with_holder_and_held_face()] {
        let on_device = traces_of(&mut gpu, &case);
        let single = traces_of(&mut Cpu::new(Precision::F32), &case);
        assert_eq!(count_differences(&on_device, &single), 0);
        let warmer = modified(&case, |case| {
            let holder = case.exposure.holder.as_mut().expect("there is one");
            holder.temperature_k = schedule(&[0.0, 30.0, 200.0], &[300.0, 340.001, 310.0]);
        });
        assert_ne!(
            count_differences(&on_device, &traces_of(&mut Cpu::new(Precision::F32), &warmer)),
            0,
            "negative control"
        );
        let off_k = largest_difference_k(&single, &traces_of(&mut Cpu::new(Precision::F64), &case));
        assert!(off_k <= SINGLE_K, "{off_k:.1e} K");
    }
}

#[test]
fn the_energy_balance_includes_the_holder_and_closes_at_second_order() {
    for case in [with_holder(), with_holder_and_held_face()] {
        let residuals = [1, 2].map(|cuts| {
            let ensemble = nominal_and_random(&case, 1);
            let traces = Cpu::new(Precision::F64).march(&Plan::with_refinement(&case, 1, cuts), &ensemble, 0..1);
            let balance = traces.expect("the processor does not fail").balances[0];
            assert!(balance.holder_out_j_m2 > 0.1 * balance.hot_in_j_m2, "{balance:?}");
            assert!(balance.holder_in_j_m2 > 0.0, "the holder warms the back at first: {balance:?}");
            let mut incomplete = balance;
            incomplete.holder_out_j_m2 = 0.0;
            assert!(incomplete.residual().abs() > BALANCE, "a missing heat loss passed");
            balance.residual().abs()
        });
        let order = (residuals[0] / residuals[1]).log2();
        assert!(residuals[0] < BALANCE, "{residuals:?}");
        assert!(order > 1.8, "order {order:.2} of {residuals:?}");
    }
}

#[test]
fn a_higher_holder_conductance_lowers_every_peak() {
    let peaks = [0.5, 1.0, 2.0].map(|scale| {
        let case = modified(&with_holder(), |case| {
            case.exposure.holder.as_mut().expect("there is one").conductance_w_m3_k *= scale;
        });
        let traces = traces_of(&mut Cpu::new(Precision::F64), &case);
        (0..traces.sensors).map(|s| traces.trace(0, s).iter().copied().fold(0.0, f64::max)).collect::<Vec<_>>()
    });
    for pair in peaks.windows(2) {
        for (sensor, (more, less)) in pair[0].iter().zip(&pair[1]).enumerate() {
            assert!(less + 1.0 < *more, "sensor {sensor}: {more} K, then {less} K");
        }
    }
}

/// The layup of `coarse` with factors on heat capacity and density of its insulation only; extinction by mass or
/// constant.
fn with_extinction(by_mass: bool) -> Case {
    let kept = [Property::HeatCapacity, Property::Density];
    let case = modified(&coarse(), |case| {
        case.factors.retain(|factor| factor.group == "INS" && kept.contains(&factor.property));
        case.estimate.factors.clear();
        for ply in case.layup.plies.iter_mut().filter(|ply| ply.group == "INS") {
            let material = Arc::make_mut(&mut ply.material);
            let Conductivity::ThreePart(parts) = &mut material.conductivity else {
                panic!("{} has no parts", material.id)
            };
            assert!(parts.extinction_follows_density, "{} states its extinction by mass", material.id);
            parts.extinction_follows_density = by_mass;
        }
    });
    assert_eq!(case.factors().len(), 2);
    case
}

#[test]
fn density_is_identifiable_apart_from_heat_capacity_only_if_extinction_follows_it() {
    let [by_mass, fixed] = [true, false].map(|by_mass| {
        let case = with_extinction(by_mass);
        let plan = Plan::new(&case);
        assert_eq!(
            plan.rows.conductivity_parts,
            1 + usize::from(by_mass),
            "no extra column where extinction is constant"
        );
        for (ply, row) in case.layup().plies.iter().zip(&plan.rows.plies) {
            let parts = 1 + u32::from(by_mass && ply.group == "INS");
            assert_eq!(row.parts, parts, "{}: no extra column where extinction is constant", ply.name);
        }
        let found = sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), Some(1e-5));
        found.expect("the processor does not fail").all
    });
    assert_eq!((by_mass.rank, fixed.rank), (2, 1), "{by_mass:?} {fixed:?}");
    assert!(by_mass.alignment[0][1] < 1.0 - 1e-5, "{:?}", by_mass.alignment);
    assert!(fixed.alignment[0][1] > 1.0 - 1e-9, "{:?}", fixed.alignment);
}

#[test]
fn a_density_factor_equals_a_denser_and_more_opaque_material() {
    let denser = with_extinction(true);
    let opaquer = modified(&denser, |case| {
        for ply in case.layup.plies.iter_mut().filter(|ply| ply.group == "INS") {
            let material = Arc::make_mut(&mut ply.material);
            material.density_kg_m3 *= 1.1;
            let Conductivity::ThreePart(parts) = &mut material.conductivity else { panic!("it has parts") };
            parts.extinction_1_m = parts.extinction_1_m.map(|extinction| 1.1 * extinction);
        }
    });
    let of = |case: &Case, density: f64, extinction_follows: bool| {
        let place = case.factors().iter().position(|factor| factor.property == Property::Density).expect("it may vary");
        let row = (0..2).map(|factor| if factor == place { density } else { 1.0 }).collect();
        // The grid of nominal factors, which the changed rows do not move.
        let mut plan = Plan::new(&denser);
        plan.rows.data.bulk_properties = Plan::new(case).rows.data.bulk_properties;
        plan.rows.data.tables = Plan::new(case).rows.data.tables;
        plan.rows
            .conductivity_columns
            .iter_mut()
            .filter(|_| !extinction_follows)
            .for_each(|conduction| conduction.extinction = 0);
        Cpu::new(Precision::F64)
            .march(&plan, &Ensemble::from_values(2, row), 0..1)
            .expect("the processor does not fail")
    };
    let (scaled, stated) = (of(&denser, 1.1, true), of(&opaquer, 1.0, true));
    assert!(largest_difference_k(&scaled, &stated) < 1e-6, "{} K", largest_difference_k(&scaled, &stated));
    assert!(largest_difference_k(&scaled, &of(&denser, 1.0, true)) > 1.0, "a tenth more density changed nothing");
    assert!(largest_difference_k(&scaled, &of(&denser, 1.1, false)) > 0.1, "a tenth more extinction changed nothing");
}

#[test]
fn a_contact_factor_of_a_group_scales_only_the_interfaces_below_its_plies() {
    let bare = modified(&coarse(), |case| (case.factors, case.estimate) = (Vec::new(), EstimationSettings::default()));
    let alone = |case: &Case, values: &[f64]| {
        let ensemble = Ensemble::from_values(values.len(), values.to_vec());
        Cpu::new(Precision::F64).march(&Plan::new(case), &ensemble, 0..1).expect("the processor does not fail")
    };
    for (group, interfaces) in [("OF2", vec![1]), ("INS", vec![2, 3]), ("", vec![0, 1, 2, 3])] {
        let scaled = with_factor(&bare, group, Property::ContactConductance);
        let stated = modified(&bare, |case| {
            for interface in interfaces {
                let contact = case.layup.contacts_w_m2_k[interface].as_mut().expect("a contact");
                *contact *= 0.5;
            }
        });
        let (scaled, nominal) = (alone(&scaled, &[0.5]), alone(&scaled, &[1.0]));
        let off_k = largest_difference_k(&scaled, &alone(&stated, &[]));
        assert!(off_k <= ROUNDING_K, "{group:?}: {off_k} K");
        assert!(largest_difference_k(&scaled, &nominal) > 1.0, "{group:?}: half the conductance changed nothing");
    }
}

#[test]
fn a_contact_factor_that_scales_nothing_or_what_another_scales_is_refused() {
    let factor = |name: &str, group: &str| {
        format!("[[factor]]\nname = \"{name}\"\nproperty = \"contact_conductance\"\n{group}small = [0.5, 2.0]\n")
    };
    let (top, base) = ("group = \"TOP\"\n", "group = \"BASE\"\n");
    assert_eq!(written(&factor("f_h", top)).expect("nothing is wrong").factors()[0].group, "TOP");
    assert_eq!(written(&factor("f_h", "")).expect("nothing is wrong").factors()[0].group, "");
    refused(&factor("f_h", base), "no interface below group \"BASE\" has a contact conductance to scale");
    refused(&(factor("f_h", top) + &factor("f_all", "")), "factors \"f_h\" and \"f_all\" scale the same property");
}

/// The two plies of [`written`] in steady state between two held faces; the sensor reads a side of their contact.
fn at_rest(side: Side) -> Case {
    let constant = |conductivity_w_m_k: f64| {
        let mut material = Material::named("nextel440_bf20").expect("it is built in");
        material.id = format!("conductivity_{conductivity_w_m_k}");
        material.conductivity = Conductivity::Tables(vec![(1e5, Table::constant(conductivity_w_m_k))]);
        Arc::new(material)
    };
    let case = written("[back_face]\nkind = \"held\"\ntemperature = \"300 K\"\n").expect("nothing is wrong");
    let case = modified(&case, |case| {
        case.layup.plies[0].material = constant(0.1);
        case.layup.plies[1].material = constant(0.04);
        case.exposure.duration_s = 4e4;
        case.resolution =
            Resolution { cells: 40, step_growth: 0.2, max_step_s: 1e3, output_interval_s: 4e4, ..case.resolution };
        case.sensors[0].side = side;
    });
    with_factor(&case, "TC1", Property::SensorDepth)
}

/// Steady-state reading of the sensor with a factor on its depth, K.
fn read_k(case: &Case, factor: f64) -> f64 {
    let traces = Cpu::new(Precision::F64).march(&Plan::new(case), &Ensemble::from_values(1, vec![factor]), 0..1);
    *traces.expect("the processor does not fail").trace(0, 0).last().expect("there are instants")
}

/// Steady heat flux through both plies and the contact between them, W/m².
const FLUX_W_M2: f64 = 600.0 / (0.5e-3 / 0.1 + 1.0 / 500.0 + 3e-3 / 0.04);

#[test]
fn a_sensor_reads_its_side_of_a_contact_or_the_mean_of_both() {
    let jump_k = FLUX_W_M2 / 500.0;
    let above_k = 900.0 - FLUX_W_M2 * 0.5e-3 / 0.1;
    assert!(jump_k > 10.0, "the contact sets the sides {jump_k} K apart");
    for (side, expected_k) in
        [(Side::Above, above_k), (Side::Both, above_k - 0.5 * jump_k), (Side::Below, above_k - jump_k)]
    {
        let off_k = (read_k(&at_rest(side), 1.0) - expected_k).abs();
        assert!(off_k < 1e-6, "{side:?}: {off_k} K");
    }
}

#[test]
fn a_depth_factor_moves_the_reading_along_the_temperature_profile() {
    for side in [Side::Above, Side::Both, Side::Below] {
        let case = at_rest(side);
        let depth_m = case.sensors()[0].depth_m;
        let nominal_k = read_k(&case, 1.0);
        for factor in [0.5, 0.75, 0.9, 0.999, 1.001, 1.1, 1.25, 1.5] {
            let gradient_k_m = -FLUX_W_M2 / if factor < 1.0 { 0.1 } else { 0.04 };
            let expected_k = nominal_k + gradient_k_m * depth_m * (factor - 1.0);
            let off_k = (read_k(&case, factor) - expected_k).abs();
            assert!(off_k < 1e-6, "{side:?} at {factor}: {off_k} K");
        }
        assert!((read_k(&case, 1.001) - nominal_k).abs() > 1e-2, "{side:?}: a thousandth deeper changed nothing");
    }
}

#[test]
fn a_depth_scaled_within_a_ply_reads_what_a_sensor_there_reads() {
    let at = |depth_m: f64, factor: f64| {
        let case = modified(&coarse(), |case| {
            case.factors.clear();
            case.resolution.cells = 400;
            case.sensors.truncate(1);
            case.observations.clear();
            case.estimate = EstimationSettings::default();
            case.sensors[0].depth_m = depth_m;
        });
        let traces = Cpu::new(Precision::F64).march(
            &Plan::new(&with_factor(&case, "TC1", Property::SensorDepth)),
            &Ensemble::from_values(1, vec![factor]),
            0..1,
        );
        traces.expect("the processor does not fail")
    };
    let (nominal, shifted) = (at(2e-3, 1.0), at(2e-3, 1.2));
    let there = at(2.4e-3, 1.0);
    assert!(largest_difference_k(&shifted, &there) < 0.5, "{} K", largest_difference_k(&shifted, &there));
    assert!(largest_difference_k(&nominal, &there) > 20.0, "{} K", largest_difference_k(&nominal, &there));
}

#[test]
fn a_side_where_there_is_none_and_a_depth_off_the_layup_are_refused() {
    let sensor = "[[sensor]]\nname = \"TC2\"\n";
    let side = |place: &str, side: &str| format!("{sensor}{place}\nside = \"{side}\"\n");
    let read = written(&side("below = \"TOP\"", "above")).expect("nothing is wrong");
    assert_eq!((read.sensors()[0].side, read.sensors()[1].side), (Side::Both, Side::Above));
    refused(&side("depth = \"2 mm\"", "above"), "a side needs a sensor on an interface of two plies");
    refused(&side("below = \"BASE\"", "below"), "a side needs a sensor on an interface of two plies");
    refused(&side("below = \"TOP\"", "beneath"), "expected above, below or both, found \"beneath\"");
    let factor = |group: &str, bounds: &str| {
        format!("[[factor]]\nname = \"f_d\"\nproperty = \"sensor_depth\"\ngroup = \"{group}\"\nsmall = {bounds}\n")
    };
    assert_eq!(written(&factor("TC1", "[0.8, 1.2]")).expect("nothing is wrong").factors()[0].group, "TC1");
    refused(&factor("TC9", "[0.8, 1.2]"), "unknown sensor \"TC9\": did you mean \"TC1\"?");
    refused(
        &factor("TC1", "[0.8, 7.2]"),
        "the bounds move \"TC1\" to 0.4 mm and 3.6 mm, outside the layup from 0 mm to 3.5 mm",
    );
    refused(
        &(sensor.to_owned() + "depth = \"0 mm\"\n" + &factor("TC2", "[0.8, 1.2]")),
        "sensor \"TC2\" lies at 0 mm: there is no depth to scale",
    );
}

#[test]
fn without_a_depth_factor_a_plan_has_no_depth_steps() {
    let plan = Plan::new(&coarse());
    let scaled = Plan::new(&with_factor(&coarse(), "TC2", Property::SensorDepth));
    assert!(!plan.rows.has_depth_factors && scaled.rows.has_depth_factors);
    let steps =
        |plan: &Plan| plan.rows.sensor_locations.iter().map(|place| place.steps_above + place.steps_below).sum::<u32>();
    assert_eq!(steps(&plan), 0);
    assert!(steps(&scaled) > 4, "its bounds reach beyond nodes of both plies");
    assert_eq!(
        scaled.rows.sensor_locations.iter().filter(|place| place.steps_above + place.steps_below > 0).count(),
        1
    );
}

/// A case file of two plies, with more text at its end.
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
fn a_holder_is_read_with_its_units_and_invalid_ones_are_refused() {
    const HOLDER: &str = "[holder]\nconductance = \"20 kW/m^3/K\"\ntemperature.outside = \"hold\"\n\
         temperature.points = [[\"0 s\", \"300 K\"], [\"9 s\", \"310 K\"]]\n";
    const FACTOR: &str = "[[factor]]\nname = \"f_g\"\nproperty = \"holder_loss\"\nsmall = [0.5, 2.0]\n";
    let case = written(&format!("{HOLDER}{FACTOR}")).expect("nothing is wrong");
    let holder = case.exposure().holder.as_ref().expect("it is written");
    assert_eq!((holder.conductance_w_m3_k, holder.temperature_k.after(9.0)), (20e3, 310.0));
    assert!(Plan::new(&case).times_s.contains(&9.0), "a step ends on the corner of its schedule");
    assert!(written("").expect("nothing is wrong").exposure().holder.is_none());
    refused(FACTOR, "the case has no [holder]: there is no heat loss to scale");
    refused(&HOLDER.replace("m^3", "m^2"), "wrong dimension: expected a conductance in a volume such as");
    refused(&HOLDER.replace("20 kW", "-20 kW"), "expected a value above 0, found \"-20 kW/m^3/K\"");
    refused("[holder]\nconductance = \"20 kW/m^3/K\"\n", "missing key \"temperature\"");
}
