//! Single against double precision where conduction is stiff: metal foils and films beside insulation.

use crate::support::{SINGLE_K, case, max_difference_k};
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::march_extrapolated;
use bondline::plan::{ErrorEstimate, Plan};
use bondline::question::{Estimate, Size};
use bondline::session::{BackendKind, Options, Session};
use bondline::study::size::RequiredThickness;
use bondline::traces::MemberStatus;
use std::collections::BTreeMap;

fn material(density: f64, heat_capacity: f64, conductivity: f64) -> String {
    format!(
        "name = \"M\"\n[density]\nvalue = \"{density} kg/m^3\"\n[heat_capacity]\nvalue = \"{heat_capacity} J/kg/K\"\n\
         [conductivity]\nvalue = \"{conductivity} W/m/K\"\n[emissivity]\nvalue = 0.8\n"
    )
}

/// Plies from the hot face to the back face: material and thickness, mm.
fn layup(plies: &[(&str, f64)], contact_w_m2_k: f64) -> Case {
    let rows: Vec<_> = plies
        .iter()
        .enumerate()
        .map(|(ply, (name, mm))| format!("{{ name = \"P{ply}\", material = \"{name}\", thickness = \"{mm} mm\" }}"))
        .collect();
    let sensors: Vec<_> = (0..plies.len()).map(|ply| format!("{{ name = \"S{ply}\", below = \"P{ply}\" }}")).collect();
    let text = format!(
        "initial_temperature = \"300 K\"\nduration = \"300 s\"\ncontact_conductance = \"{contact_w_m2_k} W/m^2/K\"\n\
         ply = [{}]\nsensor = [{}]\n[hot_face]\nkind = \"heated\"\nradiant_flux = \"50 kW/m^2\"\n\
         [[factor]]\nname = \"f_cp\"\nproperty = \"heat_capacity\"\ngroup = \"P1\"\nsmall = [0.95, 1.05]\n\
         large = [0.9, 1.1]\n",
        rows.join(", "),
        sensors.join(", ")
    );
    let files = [
        ("cloth", material(1000.0, 800.0, 0.2)),
        ("felt", material(170.0, 1000.0, 0.03)),
        ("aluminium", material(2700.0, 900.0, 200.0)),
        ("gold", material(19300.0, 129.0, 310.0)),
        ("aerogel", material(60.0, 800.0, 0.012)),
    ];
    let files = BTreeMap::from(files.map(|(name, text)| (format!("materials/{name}.toml"), text)));
    Case::from_toml(&text, "foils", &files).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn metal_foils_and_films_march_in_single_precision_as_in_double() {
    for (plies, contact_w_m2_k) in [
        (&[("cloth", 0.5), ("felt", 6.0), ("aluminium", 0.025)][..], 1e6),
        (&[("aluminium", 0.025), ("felt", 6.0)], 1e9),
        (&[("felt", 3.0), ("gold", 0.0001), ("felt", 3.0)], 1e4),
        (&[("gold", 0.0002), ("cloth", 0.5), ("felt", 20.0), ("aluminium", 0.05)], 1e9),
        (&[("felt", 40.0), ("aluminium", 0.001)], 10.0),
        (&[("aluminium", 0.03), ("aerogel", 5.0), ("aluminium", 0.03), ("aerogel", 5.0), ("aluminium", 2.0)], 0.5),
    ] {
        let case = layup(plies, contact_w_m2_k);
        let plan = Plan::new(&case);
        let marched = |precision| {
            let nominal = Ensemble::nominal(case.factors());
            let traces = march_extrapolated(&mut Cpu::new(precision), &plan, &nominal, 0..1);
            let traces = traces.unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(traces.statuses, [MemberStatus::Completed], "{plies:?} in {precision:?}");
            traces
        };
        let difference_k = max_difference_k(&marched(Precision::F32), &marched(Precision::F64));
        assert!(difference_k < SINGLE_K, "{plies:?}: {difference_k} K");
    }
}

/// Cloth, felt and a foil.
fn foil() -> Case {
    layup(&[("cloth", 0.5), ("felt", 6.0), ("aluminium", 0.025)], 1e6)
}

#[test]
fn a_march_in_f32_states_its_rounding_which_is_the_difference_to_f64() {
    let case = foil();
    let predicted = |precision| {
        let options = Options::default().backend(BackendKind::Cpu).precision(precision);
        Session::open(case.clone(), &options).and_then(|mut session| session.predict()).expect("the processor marches")
    };
    let (single, double) = (predicted(Precision::F32), predicted(Precision::F64));
    let [of_single, of_double] = [&single, &double].map(|found| found.error_estimate.as_ref().expect("adapted cells"));
    let rounding = of_single.rounding.as_ref().expect("rounding is measured in f32");
    let pairs = single.temperatures_k.iter().flatten().zip(double.temperatures_k.iter().flatten());
    let difference_k = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    assert!(difference_k > 0.0 && rounding.nominal_k >= difference_k, "{rounding:?}, {difference_k} K");
    assert!(rounding.nominal_k < SINGLE_K);
    assert_eq!(of_single.nominal_k, of_double.nominal_k + rounding.nominal_k);
    assert_eq!(of_double.rounding, None);
}

#[test]
fn a_device_marches_in_f64_where_f32_does_not_meet_the_tolerance() {
    for (tolerance_k, expected) in [(0.05, "f32"), (2e-4, "f64")] {
        let options = Options::default().backend(BackendKind::Gpu).tolerance_k(tolerance_k);
        let mut session = Session::open(foil(), &options).expect("lavapipe is installed");
        session.predict().expect("the device marches");
        let answers = session.answers().expect("a prediction");
        assert_eq!(answers.backend.precision.name(), expected, "{tolerance_k} K");
        let is_said = answers.run.remarks.iter().any(|remark| remark.starts_with("Marched in f64: rounding in f32"));
        assert_eq!(is_said, expected == "f64", "{:?}", answers.run.remarks);
    }
}

fn session(case: Case, precision: Precision) -> Session {
    let options = Options::default().backend(BackendKind::Cpu).precision(precision);
    Session::open(case, &options).unwrap_or_else(|error| panic!("{error}"))
}

/// The stated error of an answer, K. In f32 it includes the rounding.
fn stated_k(estimate: Option<&ErrorEstimate>, precision: Precision) -> f64 {
    let estimate = estimate.expect("adapted cells");
    assert_eq!(estimate.rounding.is_some(), precision == Precision::F32, "{precision:?}");
    estimate.nominal_k
}

#[test]
fn an_estimate_in_f32_is_within_its_error_of_f64_at_the_same_factors() {
    let case = case("twin-tc3");
    let found = session(case.clone(), Precision::F32).estimate(&Estimate::default()).expect("an estimate");
    let after = &found.fitted[0].after;
    let single_k = stated_k(after.error_estimate.as_ref(), Precision::F32);
    let mut other = session(case.clone(), Precision::F64);
    let nominal = other.predict().expect("the processor marches");
    let double_k = stated_k(nominal.error_estimate.as_ref(), Precision::F64);
    let mut values: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    for (estimand, &value) in found.factors.iter().zip(&found.values) {
        values[estimand.factor_indices[0].expect("a factor of the case")] = value;
    }
    let there = Ensemble::from_values(values.len(), values);
    let double = other.march(&there).expect("the processor marches");
    let pairs = after.temperatures_k.iter().flatten().zip(&double.temperatures_k);
    let difference_k = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
    assert!(difference_k > 0.0 && difference_k < single_k + double_k, "{difference_k} K, {single_k}, {double_k}");
}

/// A layup of a foil that is far thicker when sized than in the case.
#[test]
fn a_thickness_sized_in_f32_holds_the_limit_in_f64_within_both_errors() {
    const LIMIT_K: f64 = 400.0;
    let foil = |felt_mm: f64| layup(&[("cloth", 0.5), ("felt", felt_mm), ("aluminium", 0.025)], 1e6);
    let question = Size { members: 400, ..Size::new("P1", "S2", LIMIT_K) };
    let sized = session(foil(6.0), Precision::F32).size(&question).expect("a thickness");
    let single_k = stated_k(sized.error_estimate.as_ref(), Precision::F32);
    let RequiredThickness::At(thickness_m) = sized.nominal else { panic!("{:?}", sized.nominal) };
    let there = session(foil(thickness_m * 1e3), Precision::F64).predict().expect("the processor marches");
    let double_k = stated_k(there.error_estimate.as_ref(), Precision::F64);
    let above_k = there.peaks[2].temperature_k - LIMIT_K;
    assert!(above_k.abs() < single_k + double_k, "{above_k} K, {single_k}, {double_k} at {thickness_m} m");
}
