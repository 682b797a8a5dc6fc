//! Factor selection: which factors the data determine. The paper reduced seven factors to three and two by inspection.

use crate::support::{case, modified};
use bondline::adapt::adapt;
use bondline::case::{Case, CaseBuilder};
use bondline::fit::DropReason;
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::study::sensitivity::{Sensitivity, sensitivity};
use std::collections::BTreeMap;

/// Run 2259 with changed settings of the estimate; the march is unchanged.
fn found(change: impl FnOnce(&mut CaseBuilder)) -> (Case, Sensitivity) {
    let shipped = case("lcat-2259");
    let plan = adapt(&shipped).expect("the processor does not fail");
    let case = modified(&shipped, change);
    let found = sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), None);
    (case, found.expect("the processor does not fail"))
}

fn names<'a>(case: &'a Case, factors: &[usize]) -> Vec<&'a str> {
    factors.iter().map(|&factor| case.factors()[factor].name.as_str()).collect()
}

fn factor(case: &Case, name: &str) -> usize {
    case.factors().iter().position(|factor| factor.name == name).expect("the case has it")
}

#[test]
fn four_thermocouples_determine_the_papers_three_of_seven_factors() {
    let (case, found) = found(|case| {
        case.estimate.sensors.clear();
        case.estimate.window_s = None;
    });
    assert_eq!(found.all.factors.len(), 7);
    assert_eq!(names(&case, &found.recommended.factors), ["f_eps_OF", "f_k_OF", "f_k_INS"]);
    let dropped = found.dropped(factor(&case, "f_cp_GB")).expect("the gas barrier is dropped");
    assert!(matches!(dropped.reason, DropReason::SmallEffect { .. }), "{dropped:?}");
}

#[test]
fn the_bondline_alone_determines_one_of_the_papers_two_factors() {
    let (case, found) = found(|_| ());
    assert_eq!(names(&case, &found.influential_factors()), ["f_k_OF", "f_k_INS", "f_cp_INS", "f_rho_INS"]);
    assert_eq!(names(&case, &found.recommended.factors), ["f_k_INS"]);
    let emissivity = factor(&case, "f_eps_OF");
    assert!(found.shares[emissivity] < 0.01, "{:?}", found.shares);
    assert!(matches!(found.dropped(emissivity).map(|dropped| dropped.reason), Some(DropReason::SmallEffect { .. })));
    // As in the paper.
    let cloth = found.dropped(factor(&case, "f_k_OF")).expect("the cloth is dropped");
    let with_insulator =
        matches!(cloth.reason, DropReason::Correlation { with, .. } if with == factor(&case, "f_k_INS"));
    assert!(with_insulator, "{cloth:?}");
    let stated = found.stated.expect("the case states two");
    assert_eq!(names(&case, &stated.factors), ["f_eps_OF", "f_k_INS"]);
    assert!(stated.correlation[0][1].abs() > 0.95, "{:?}", stated.correlation);
}

#[test]
fn a_factor_with_a_wider_prior_has_a_larger_share() {
    let emissivity = |case: &Case| factor(case, "f_eps_OF");
    let (case, known) = found(|_| ());
    let place = emissivity(&case);
    let (wide_case, wide) = found(|case| {
        (case.factors[place].small, case.factors[place].large) = ((0.8, 1.2), (0.8, 1.2));
    });
    let share = known.shares[place];
    // Its squared effect is sixteen times larger; the others are unchanged.
    let expected = 16.0 * share / (1.0 + 15.0 * share);
    let found = wide.shares[emissivity(&wide_case)];
    assert!((found - expected).abs() < 1e-9, "{found}, expected {expected}");
    assert!(wide.influential_factors().contains(&emissivity(&wide_case)));
}

#[test]
fn a_case_that_states_nothing_to_estimate_is_not_compared() {
    let (_, found) = found(|case| case.estimate.factors.clear());
    assert!(found.stated.is_none() && !found.recommended.factors.is_empty());
}

/// A cloth over an insulation with seven factors. `units` are those of the factors: the value of the property in the
/// file is over the unit, and the nominal value and the bounds of the factor are times the unit. Lengths are in the
/// unit `length` of so many metres.
fn two_plies(units: [f64; 7], (length, length_m): (&str, f64), small: [f64; 7]) -> (Case, Sensitivity) {
    let properties =
        ["thickness", "conductivity", "emissivity", "thickness", "conductivity", "heat_capacity", "density"];
    let factor = |(index, property): (usize, &str)| {
        let (unit, group) = (units[index], if index < 3 { "A" } else { "B" });
        let (low, high) = (unit * (1.0 - small[index]), unit * (1.0 + small[index]));
        format!(
            "[[factor]]\nname = \"{property}_{group}\"\ngroup = \"{group}\"\nproperty = \"{property}\"\n\
             nominal = {unit}\nsmall = [{low}, {high}]\n"
        )
    };
    let factors: Vec<String> = properties.into_iter().enumerate().map(factor).collect();
    let long = |of_m: f64| format!("{} {length}", of_m / length_m);
    let ply = |name: &str, group: &str, thickness_m: f64, unit: f64| {
        let (material, thickness) = (group.to_lowercase(), long(thickness_m / unit));
        format!("{{ name = \"{name}\", group = \"{group}\", material = \"{material}\", thickness = \"{thickness}\" }}")
    };
    let toml = format!(
        "initial_temperature = \"300 K\"\nduration = \"200 s\"\nply = [{}, {}, {}]\n\
         sensor = [{{ name = \"N\", below = \"A\" }}, {{ name = \"D\", below = \"B1\" }}]\n\
         [hot_face]\nkind = \"heated\"\nradiant_flux = \"8 W/cm^2\"\n{}",
        ply("A", "A", 2e-3, units[0]),
        ply("B1", "B", 6e-3, units[3]),
        ply("B2", "B", 3e-3, units[3]),
        factors.concat()
    );
    let material = |density: f64, heat_capacity: f64, conductivity: f64, emissivity: f64| {
        format!(
            "name = \"M\"\n[density]\nvalue = \"{density} kg/m^3\"\n[heat_capacity]\n\
             value = \"{heat_capacity} J/kg/K\"\n[conductivity]\nvalue = \"{conductivity} W/m/K\"\n[emissivity]\n\
             value = {emissivity}\n"
        )
    };
    let files = BTreeMap::from([
        ("materials/a.toml".to_owned(), material(900.0, 1000.0, 0.2 / units[1], 0.8 / units[2])),
        ("materials/b.toml".to_owned(), material(120.0 / units[6], 1100.0 / units[5], 0.05 / units[4], 0.8)),
    ]);
    let case = Case::from_toml(&toml, "two-plies", &files).unwrap_or_else(|error| panic!("{error}\n{toml}"));
    let plan = adapt(&case).expect("the processor does not fail");
    let found = sensitivity(&case, &plan, &mut Cpu::new(Precision::F64), None).expect("the processor does not fail");
    (case, found)
}

/// Factors in millimetres, in parts of a thousand or as multiples of ten are the same factors.
#[test]
fn the_recommended_factors_do_not_depend_on_the_units_of_a_case_and_of_its_factors() {
    let small = [0.02, 0.1, 0.05, 0.02, 0.1, 0.1, 0.05];
    let metre = ("m", 1.0);
    let (case, multiples) = two_plies([1.0; 7], metre, small);
    let expected = names(&case, &multiples.recommended.factors);
    assert!((2..6).contains(&expected.len()), "some factors are left out: {expected:?}");
    for (units, length) in [
        ([1.0; 7], ("mm", 1e-3)),
        ([1.0; 7], ("in", 0.0254)),
        ([2.0, 1.0, 1.0, 9.0, 1.0, 1.0, 1.0], metre),
        ([0.1, 10.0, 2.0, 0.1, 10.0, 0.1, 10.0], metre),
        ([1.0, 0.05, 0.9, 1.0, 50.0, 20.0, 0.02], ("cm", 1e-2)),
    ] {
        let (case, found) = two_plies(units, length, small);
        assert_eq!(names(&case, &found.recommended.factors), expected, "{units:?}, {length:?}");
        let order = |of: &Sensitivity| of.reduction.iter().map(|dropped| dropped.variable).collect::<Vec<_>>();
        assert_eq!(order(&found), order(&multiples), "{units:?}, {length:?}");
        for (share, other) in found.shares.iter().zip(&multiples.shares) {
            // Cells and steps are adapted anew, to 0.05 K.
            assert!((share - other).abs() < 2e-3, "{units:?}: {:?}, {:?}", found.shares, multiples.shares);
        }
    }
    // Negative control: a factor that is known better in its own unit is another factor.
    let mut known = small;
    known[factor(&case, expected[0])] *= 0.01;
    let (case, found) = two_plies([1.0; 7], metre, known);
    assert_ne!(names(&case, &found.recommended.factors), expected);
}
