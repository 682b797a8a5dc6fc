//! Cases of one ply with known answers at the ends of what inputs may say: wild rates, bounds beside the nominal value,
//! black surfaces, broken thermocouples, results that cannot be used.

use crate::cli::{CommandResult, run};
use crate::support::Scratch;
use bondline::Case;
use bondline::session::{BackendKind, Options, Session};
use serde_json::Value;
use std::fmt::Write as _;

/// A ply of a material M of constant properties.
const PLY: &str = r#"initial_temperature = "300 K"
ply = [{ name = "S", material = "m", thickness = "10 mm" }]
"#;

const MATERIAL: &str = r#"name = "M"
[density]
value = "1000 kg/m^3"
[heat_capacity]
value = "1000 J/kg/K"
[conductivity]
value = "0.1 W/m/K"
[emissivity]
value = 0.9
"#;

/// A folder with a case of these lines after those of [`PLY`], and its material.
fn folder(name: &str, case: &str, material: &str) -> Scratch {
    let scratch = Scratch::new(name);
    scratch.write("case.toml", if case.contains("ply =") { case.to_owned() } else { PLY.to_owned() + case });
    scratch.write("materials/m.toml", material);
    scratch
}

/// A case and material of one reaction with a mass loss of a tenth in a film of 0.1 mm, whose temperature rises from
/// 300 K to `end_k` in `duration_s`.
fn heated_film(duration_s: f64, end_k: f64, pre_exponential: &str, activation: &str, order: f64) -> [String; 2] {
    let case = format!(
        r#"initial_temperature = "300 K"
duration = "{duration_s} s"
decomposition = true
ply = [{{ name = "S", material = "m", thickness = "0.1 mm" }}]
sensor = [{{ name = "B", below = "S" }}]
gas.flow = "unhindered"
[hot_face]
kind = "held"
temperature = [["0 s", "300 K"], ["{duration_s} s", "{end_k} K"]]
"#
    );
    let reaction = format!(
        r#"[decomposition]
[[decomposition.reaction]]
mass_loss = 0.1
pre_exponential = "{pre_exponential} 1/s"
activation_energy = "{activation} kJ/mol"
order = {order}
heat = "2 MJ/kg"
[decomposition.char]
heat_capacity = {{ times_virgin = 1.0 }}
conductivity = {{ times_virgin = 1.0 }}
"#
    );
    [case, MATERIAL.replace("0.1 W", "1 W").replace("1000 kg", "500 kg") + &reaction]
}

/// The time at which half of the mass loss of 0.005 kg/m² is gone, s.
fn half_loss_s(scratch: &Scratch) -> f64 {
    let table = scratch.read("out/traces.csv");
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let lost = lines.next().and_then(|head| head.iter().position(|name| *name == "mass_lost_kg_m2"));
    let lost = lost.expect("a column of the mass lost");
    let number = |text: &str| text.parse::<f64>().expect("a number");
    let half = lines.find(|row| number(row[lost]) >= 0.0025).expect("half of the mass is lost");
    number(half[0])
}

/// A column of the traces of a prediction.
fn column(scratch: &Scratch, name: &str) -> Vec<f64> {
    let table = scratch.read("out/traces.csv");
    let mut lines = table.lines();
    let place = lines.next().and_then(|head| head.split(',').position(|heading| heading == name));
    let place = place.unwrap_or_else(|| panic!("no column {name}"));
    lines.map(|row| row.split(',').nth(place).and_then(|cell| cell.parse().ok()).expect("a number")).collect()
}

/// An isothermal film that reacts at first order loses m (1 − exp(−k t)). At 635.2 K half is gone within a minute; at
/// 400 K a share of 1e-7, which one less the remaining share in f32 would not show.
#[test]
fn the_gas_flux_at_the_start_is_that_of_the_reaction_and_small_losses_are_accurate_in_both_precisions() {
    const GAS_CONSTANT_J_MOL_K: f64 = 8.314_462_618;
    for at_k in [635.2, 400.0] {
        let [case, material] = heated_film(100.0, at_k, "1e10", "144", 1.0);
        let case = case.replace("300 K", &format!("{at_k} K"));
        let scratch = folder("isothermal-film", &case, &material.replace("2 MJ/kg", "0 MJ/kg"));
        let rate_1_s = 1e10 * (-144e3 / (GAS_CONSTANT_J_MOL_K * at_k)).exp();
        for precision in ["f64", "f32"] {
            let ran = run(&scratch, &format!("predict case.toml --precision {precision} --out out --force"));
            // No heat moves at 400 K, so that rounding in f32 is large against it; the advice is not to refine.
            match (precision, at_k < 500.0) {
                ("f32", true) => ran.exited_with(1).with_stderr(&["energy balance is off by", "march in f64"]),
                _ => ran.succeeded(),
            };
            let [times_s, lost, flux] =
                ["time_s", "mass_lost_kg_m2", "gas_flux_kg_m2_s"].map(|of| column(&scratch, of));
            for (time_s, (lost, flux)) in times_s.into_iter().zip(lost.into_iter().zip(flux)) {
                let left = 0.005 * (-rate_1_s * time_s).exp();
                let (right_lost, right_flux) = (0.005 * -(-rate_1_s * time_s).exp_m1(), rate_1_s * left);
                // Half a per cent of the peak is the tolerance of the adaptation.
                let is_close = (flux - right_flux).abs() < 5e-3 * rate_1_s * 0.005;
                assert!(is_close, "{at_k} K {precision}: {flux} kg/m²/s for {right_flux} at {time_s} s");
                let close = time_s == 0.0 || (lost / right_lost - 1.0).abs() < 1e-3;
                assert!(close, "{at_k} K {precision}: {lost} kg/m² for {right_lost} at {time_s} s");
            }
        }
    }
}

/// The rate constant, integrated over the rise of 5 K/min by Simpson's rule, is ln 2 at 371.7 K, after 860.1 s. With
/// rates that never fall below A exp(−80) the mass was lost at 13 s.
#[test]
fn drying_happens_at_its_temperature_however_large_the_pre_exponential_factor() {
    let [case, material] = heated_film(1596.0, 433.0, "3.16e33", "251.8", 1.0);
    let scratch = folder("drying", &case, &material);
    for precision in ["f64", "f32"] {
        run(&scratch, &format!("predict case.toml --precision {precision} --out out --force")).succeeded();
        let found_s = half_loss_s(&scratch);
        assert!((found_s - 860.1).abs() <= 2.0, "{precision}: {found_s} s");
    }
}

/// The temperature of half conversion is where the integral of the rate constant is ln 2 (order 1): 635.2 K at 20 K/min
/// by Simpson's rule, after 1,005.6 s.
#[test]
fn rates_beyond_single_precision_neither_panic_nor_happen_early() {
    for (pre_exponential, activation, expected_s) in [("1e38", "480", Some(1005.6)), ("1e-300", "20", None)] {
        let [case, material] = heated_film(1800.0, 900.0, pre_exponential, activation, 1.0);
        let scratch = folder("extreme-rates", &case, &material);
        for precision in ["f64", "f32"] {
            run(&scratch, &format!("predict case.toml --precision {precision} --out out --force")).succeeded();
            let Some(expected_s) = expected_s else {
                assert!(scratch.read("out/traces.csv").lines().last().is_some_and(|line| line.contains(",0,0,")));
                continue;
            };
            let found_s = half_loss_s(&scratch);
            assert!((found_s - expected_s).abs() < 3.0, "{precision}: {found_s} s");
        }
    }
}

#[test]
fn a_material_shows_the_temperatures_at_which_its_reactions_are_half_complete() {
    let [_, material] = heated_film(1.0, 400.0, "3.16e33", "251.8", 1.0);
    let scratch = folder("half-conversion", "", &material);
    let checked = run(&scratch, "materials check materials/m.toml").succeeded();
    let rates = "    loss       1 K/min      10 K/min     100 K/min";
    let temperatures = "  0.1000           365           375           386";
    assert!(checked.stdout.contains(rates) && checked.stdout.contains(temperatures), "{}", checked.stdout);
}

/// A heated ply whose heating may be up to 30 % stronger than nominal, but not weaker.
const OFF_CENTRE: &str = r#"duration = "100 s"
sensor = [{ name = "F", depth = "0 mm", limit = "680 K" }]
[hot_face]
kind = "heated"
flux = "20 kW/m^2"
emissivity = 0
[[factor]]
name = "f_q"
property = "heating"
small = [1.0, 1.3]
"#;

/// Measured at the face.
const FACE_READINGS: &str = r#"
[observations]
sigma = "2 K"
F = [["0 s", "300 K"], ["20 s", "400 K"], ["40 s", "460 K"], ["60 s", "510 K"], ["80 s", "550 K"], ["100 s", "580 K"]]
[estimate]
factors = ["f_q"]
"#;

/// The face rises in proportion to the factor, so that the limit is a value of it, and the probability above it that of
/// half a normal distribution of σ = 0.15, cut off at two of them.
#[test]
fn bounds_beside_the_nominal_value_are_two_standard_deviations_of_their_side_away() {
    let scratch = folder("off-centre", OFF_CENTRE, &MATERIAL.replace("0.1 W", "0.5 W"));
    let share = |options: &str| {
        let outcome = run(&scratch, &format!("uncertainty case.toml -n 5000 --json --force {options}")).succeeded();
        outcome.json()["margins"][0]["members"]["above"]["share"].as_f64().expect("a share above the limit")
    };
    for sampling in ["normal", "lhs", "sobol"] {
        let found = share(&format!("--sampling {sampling}"));
        assert!((found - 0.31).abs() < 0.02, "{sampling}: {found}, and 0.06 with a quarter of the width about 1");
    }
    // Negative control: a nominal value in the middle of the same bounds.
    assert!((share("--set f_q=1.15") - 0.31).abs() > 0.1);
}

/// A ply that radiates to space what heats it.
const RADIATING: &str = r#"initial_temperature = "300 K"
duration = "1500 s"
ply = [{ name = "S", material = "m", thickness = "1 mm" }]
sensor = [{ name = "A", depth = "0 mm" }]
[hot_face]
kind = "heated"
flux = "20 kW/m^2"
surroundings = "0 K"
[[factor]]
name = "f_eps"
group = "S"
property = "emissivity"
small = [0.7, 1.3]
"#;

/// A black surface that emits 20 kW/m² has (q/σ)^¼ = 770.6 K.
#[test]
fn no_surface_is_colder_than_a_black_one_and_a_warning_says_that_the_emissivity_is_capped() {
    let scratch = folder("black", RADIATING, &MATERIAL.replace("0.1 W", "1 W"));
    let peak_k = |eps: f64| {
        let outcome = run(&scratch, &format!("predict case.toml --set f_eps={eps} --json --force")).succeeded();
        outcome.json()["sensors"]["A"]["peak_k"].as_f64().expect("a peak")
    };
    let black_k = (20e3_f64 / 5.670374419e-8).powf(0.25);
    assert!((peak_k(1.3) - black_k).abs() < 0.1, "{} K", peak_k(1.3));
    let grey_k = black_k / 0.81_f64.powf(0.25);
    assert!((peak_k(0.9) - grey_k).abs() < 0.1, "{} K", peak_k(0.9));
    let warned = |eps: f64| {
        let screen = run(&scratch, &format!("predict case.toml --set f_eps={eps} --force")).succeeded().stdout;
        screen.replace("\n  ", " ").contains("f_eps takes the emissivity of S up to 1.17")
    };
    assert!(warned(1.3) && !warned(0.9));
    let swept = run(&scratch, "uncertainty case.toml -n 200 --force").succeeded().stdout.replace("\n  ", " ");
    assert!(swept.contains("f_eps takes the emissivity of S up to 1.17"), "{swept}");
}

/// A plate at equilibrium with the lamps, at any heat capacity and any grey emissivity.
#[test]
fn a_peak_that_no_factor_changes_has_no_shares_of_its_variance() {
    let case = r#"initial_temperature = "300 K"
duration = "600 s"
ply = [{ name = "S", material = "m", thickness = "1 mm" }]
sensor = [{ name = "B", below = "S" }]
[hot_face]
kind = "heated"
radiant_flux = { points = [["500 s", "20 kW/m^2"], ["500 s", "0 W/m^2"]], outside = "hold" }
[[factor]]
name = "f_cp"
group = "S"
property = "heat_capacity"
small = [0.9, 1.1]
[[factor]]
name = "f_eps"
group = "S"
property = "emissivity"
small = [0.9, 1.1]
"#;
    let scratch = folder("plateau", case, &MATERIAL.replace("0.1 W", "1 W").replace("0.9", "0.8"));
    let swept = run(&scratch, "uncertainty case.toml -n 500 --force").succeeded().stdout;
    let line = swept.lines().find(|line| line.starts_with("B ")).expect("a line of the sensor");
    assert!(line.ends_with(" -"), "{line}");
    // Negative control: before the plateau both factors matter.
    let early = run(&scratch, "uncertainty case.toml -n 500 --force --set duration=\"20\u{a0}s\"").succeeded().stdout;
    assert!(early.lines().any(|line| line.starts_with("B ") && line.ends_with(" %")), "{early}");
}

/// A ply with two thermocouples.
const OBSERVED: &str = r#"duration = "400 s"
sensor = [{ name = "MID", depth = "5 mm" }, { name = "B", below = "S" }]
[hot_face]
kind = "heated"
flux = "2 kW/m^2"
emissivity = 0
[[factor]]
name = "f_k"
group = "S"
property = "conductivity"
small = [0.4, 1.6]
[estimate]
factors = ["f_k"]
[observations]
file = "m.csv"
"#;

fn estimate_with_cell(cell: &str, sigma: &str) -> CommandResult {
    let scratch = folder("broken-reading", &format!("{OBSERVED}sigma = \"{sigma}\"\n"), MATERIAL);
    scratch.write("m.csv", format!("time_s,MID_K,B_K\n0,300,300\n200,{cell},304\n400,365.4,331.5\n"));
    run(&scratch, "estimate case.toml")
}

#[test]
fn a_reading_that_no_march_can_have_is_refused_by_its_cell() {
    for cell in ["1.7976931348623157E+308", "9.9E+37", "4000.5"] {
        let refused = estimate_with_cell(cell, "1 K").exited_with(2);
        refused.with_stderr(&["m.csv:3:5", "K is above 4000 K, the highest temperature of a march"]);
    }
    estimate_with_cell("0", "1 K").exited_with(2).with_stderr(&["m.csv:3:5", "not above absolute zero"]);
    for sigma in ["1e-160 K", "1e160 K", "1e-7 K"] {
        let refused = estimate_with_cell("320", sigma).exited_with(2);
        refused.with_stderr(&["case.toml:18:9", "expected a standard deviation from 1e-6 K to 4000 K"]);
    }
    estimate_with_cell("320", "1 K").succeeded();
}

#[test]
fn a_run_of_more_than_three_centuries_and_a_noise_that_no_instrument_has_are_refused() {
    let scratch = folder("beyond-limits", &OBSERVED.replace("[observations]\nfile = \"m.csv\"\n", ""), MATERIAL);
    let refused = |words: &str| run(&scratch, words).exited_with(2);
    refused("predict case.toml --set duration=\"1e300\u{a0}s\"").with_stderr(&["10,000,000,000 s of a run"]);
    for command in ["twin case.toml --out m.csv", "design case.toml --target B --sensors 1"] {
        let refused = refused(&format!("{command} --noise 1e-170\u{a0}K"));
        refused.with_stderr(&["--noise: expected a standard deviation from 1e-6 K to 4000 K"]);
    }
}

#[test]
fn a_last_sample_whose_time_is_rounded_is_read_and_samples_after_the_end_are_noted() {
    let scratch = folder("rounded-time", &format!("{OBSERVED}sigma = \"1 K\"\n"), MATERIAL);
    let samples = |times: [&str; 3]| {
        let [first, second, third] = times;
        scratch.write("m.csv", format!("time_min,MID_K,B_K\n{first},300,300\n{second},340,335\n{third},380,375\n"));
        let outcome = run(&scratch, "observations case.toml --json --force").succeeded();
        let count = outcome.json()["channels"]["MID"]["samples"].as_u64().expect("a number of samples");
        (count, outcome.stderr)
    };
    let (count, notes) = samples(["0", "3.333333333", "6.666666667"]);
    assert_eq!((count, notes.contains("not read")), (3, false), "{notes}");
    let (count, notes) = samples(["0", "3.333333333", "6.7"]);
    assert_eq!(count, 2);
    assert!(notes.contains("1 sample of a sensor after 400 s, the end of the exposure, not read"), "{notes}");
}

/// A drift of 1.5 K that no conductivity explains.
#[test]
fn autocorrelated_residuals_are_reported_whatever_standard_deviation_is_stated() {
    let scratch = folder("stated-sigma", &format!("{OBSERVED}sigma = \"1 K\"\n"), MATERIAL);
    scratch.write("m.csv", "time_s,MID_K,B_K\n0,300,300\n");
    let case = Case::load(&scratch.path().join("case.toml")).unwrap_or_else(|error| panic!("{error}"));
    let mut session = Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("a session");
    let truth = session.predict().expect("a prediction");
    let mut table = "time_s,MID_K,B_K\n".to_owned();
    for (instant, time_s) in truth.instants_s.iter().enumerate().step_by(2) {
        let drift_k = 1.5 * (time_s / 20.0).sin();
        let [middle_k, back_k] = [0, 1].map(|sensor| truth.temperatures_k[sensor][instant] + drift_k);
        writeln!(table, "{time_s},{middle_k:.3},{back_k:.3}").expect("text");
    }
    scratch.write("m.csv", table);
    for sigma in ["1", "20"] {
        let set = format!("--set observations.sigma=\"{sigma}\u{a0}K\"");
        let screen = run(&scratch, &format!("estimate case.toml {set} --force")).succeeded().stdout;
        assert!(screen.contains("The residuals are autocorrelated"), "{sigma} K:\n{screen}");
    }
}

#[test]
fn a_run_of_two_weeks_needs_no_stated_steps() {
    let case = r#"duration = "336 h"
sensor = [{ name = "A", depth = "0 mm" }]
[hot_face]
kind = "heated"
flux = "1 W/m^2"
"#;
    let scratch = folder("two-weeks", case, &MATERIAL.replace("0.1 W", "1 W"));
    let outcome = run(&scratch, "predict case.toml --json").succeeded().json();
    // q = ε σ (T⁴ − T_s⁴) at the end.
    let expected_k = (1.0 / (0.9 * 5.670374419e-8) + 300.0_f64.powi(4)).powf(0.25);
    let peak_k = outcome["sensors"]["A"]["peak_k"].as_f64().expect("a peak");
    assert!((peak_k - expected_k).abs() < 0.05, "{peak_k} K for {expected_k} K");
}

#[test]
fn a_part_that_starts_above_its_limit_is_not_sized() {
    let case = r#"initial_temperature = "400 K"
duration = "600 s"
ply = [{ name = "S", material = "m", thickness = "10 mm" }]
sensor = [{ name = "B", below = "S", limit = "350 K" }]
[hot_face]
kind = "heated"
flux = "2 kW/m^2"
[[factor]]
name = "f_q"
property = "heating"
small = [0.9, 1.1]
"#;
    let scratch = folder("above-limit", case, MATERIAL);
    let refused = run(&scratch, "size case.toml --ply S -n 400").exited_with(2);
    refused.with_stderr(&["B starts above its limit", "400.0 K", "350.0 K", "no thickness of S"]);
    run(&scratch, "size case.toml --ply S -n 400 --set initial_temperature=\"300\u{a0}K\"").succeeded();
}

/// A face whose film is closed.
#[test]
fn a_film_coefficient_of_zero_is_accepted_as_a_constant_and_as_a_schedule() {
    let case = |film: &str| {
        format!(
            r#"duration = "10 s"
sensor = [{{ name = "A", depth = "0 mm" }}]
[hot_face]
kind = "convective"
heat_transfer_coefficient = {film}
gas = "900 K"
emissivity = 0
[back_face]
kind = "holder"
conductance = "0 W/m^2/K"
temperature = "500 K"
"#
        )
    };
    for film in ["\"0 W/m^2/K\"", "[[\"0 s\", \"0 W/m^2/K\"], [\"10 s\", \"0 W/m^2/K\"]]"] {
        let scratch = folder("closed-film", &case(film), MATERIAL);
        let outcome = run(&scratch, "predict case.toml --json").succeeded().json();
        let peak_k = outcome["sensors"]["A"]["peak_k"].as_f64().expect("a peak");
        assert!((peak_k - 300.0).abs() < 1e-9, "{film}: {peak_k} K");
    }
    let scratch = folder("negative-film", &case("\"-1 W/m^2/K\""), MATERIAL);
    run(&scratch, "predict case.toml").exited_with(2).with_stderr(&["expected 0 or more"]);
}

/// A tolerance below rounding, and a ply so thick that rounding takes up all heat.
#[test]
fn a_result_that_cannot_be_used_ends_with_exit_code_1_and_the_reason() {
    let scratch = folder("unusable", OFF_CENTRE, MATERIAL);
    let set = "resolution.tolerance=\"1e-10\u{a0}K\" --set duration=\"1\u{a0}s\"";
    let outcome = run(&scratch, &format!("predict case.toml --set {set}")).exited_with(1);
    outcome.with_stderr(&["cannot be used: its discretisation error is", "more than 10 times the tolerance"]);
    scratch.write("case.toml", PLY.to_owned() + OFF_CENTRE + FACE_READINGS);
    for command in [
        "predict case.toml",
        "uncertainty case.toml -n 50",
        "sensitivity case.toml",
        "estimate case.toml",
        "study case.toml -n 50",
        "history case.toml --knots 3",
        "design case.toml --estimate f_q --sensors 1 -n 8",
        "twin case.toml --out twin.csv",
        "twin case.toml --study 4",
        "size case.toml --ply S -n 50 --probability 0.8",
        "trade case.toml --size S --ply S=m -n 50 --probability 0.8",
    ] {
        let thick = format!("{command} --set ply.S.thickness=\"1e15\u{a0}m\" --force");
        let outcome = run(&scratch, &thick).exited_with(1);
        outcome.with_stderr(&["cannot be used: its energy balance is off by 100 %, more than 1 %"]);
        let sound = run(&scratch, &format!("{command} --force"));
        assert!(!sound.stderr.contains("cannot be used"), "{command}: {}", sound.stderr);
    }
}

#[test]
fn a_march_that_failed_has_no_values() {
    let refusing = MATERIAL.replace(
        "value = \"1000 J/kg/K\"",
        "temperatures_k = [250, 400]\nvalues = [1000, 1000]\nunit = \"J/kg/K\"\noutside = \"error\"",
    );
    let scratch = folder("failed-march", OFF_CENTRE, &refusing);
    let outcome = run(&scratch, "predict case.toml --out out --json").exited_with(1);
    assert_eq!(outcome.json()["sensors"]["F"]["peak_k"], Value::Null);
    let traces = scratch.read("out/traces.csv");
    assert!(traces.lines().skip(1).all(|line| line.ends_with(',')), "{traces}");
    let screen = run(&scratch, "predict case.toml --force").exited_with(1).stdout;
    let line = screen.lines().find(|line| line.starts_with("F ")).expect("a line of the sensor");
    assert!(line.contains("unknown") && !line.contains(" K"), "{screen}");
}

/// A sensor at the hot face and one below a film of metal are not at the same depth. Heat crosses a contact of
/// 1,000 W/m²/K between two films before it reaches the insulation: the outer film is hotter by the flux over that.
#[test]
fn a_sensor_on_the_face_of_a_film_thinner_than_a_micrometre_reads_the_face() {
    let case = r#"initial_temperature = "300 K"
duration = "20 s"
ply = [
    { name = "A", material = "metal", thickness = "0.2 um", contact_below = "1000 W/m^2/K" },
    { name = "B", material = "metal", thickness = "0.3 um" },
    { name = "S", material = "m", thickness = "10 mm" },
]
sensor = [{ name = "F", depth = "0 mm" }, { name = "B", below = "A", side = "below" }]
[hot_face]
kind = "heated"
emissivity = 0
flux = "20 kW/m^2"
"#;
    let scratch = folder("films", case, MATERIAL);
    let metal = "name = \"Metal\"\ndensity.value = \"2700 kg/m^3\"\nheat_capacity.value = \"900 J/kg/K\"\n\
                 conductivity.value = \"200 W/m/K\"\nemissivity.value = 0.1\n";
    scratch.write("materials/metal.toml", metal);
    for precision in ["f64", "f32"] {
        run(&scratch, &format!("predict case.toml --precision {precision} --out out --force")).succeeded();
        let [face_k, below_k] = ["F_k", "B_k"].map(|of| column(&scratch, of));
        let last = face_k.len() - 1;
        let fall_k = face_k[last] - below_k[last];
        assert!((fall_k - 20.0).abs() < 0.1, "{precision}: {fall_k} K between the films");
    }
}

/// A porous slab between held faces: at the start the hot face jumps from 300 K to 700 K and drives the gas of the
/// half cell beside it out; later the pressure outside falls.
#[test]
fn gas_is_conserved_where_a_held_face_jumps_and_pressure_changes() {
    let case = r#"duration = "100 s"
decomposition = true
pressure = [["0 s", "100 kPa"], ["40 s", "100 kPa"], ["40 s", "20 kPa"], ["60 s", "50 kPa"], ["100 s", "50 kPa"]]
sensor = [{ name = "M", depth = "5 mm" }]
gas = { flow = "darcy", gas = "air" }
hot_face = { kind = "held", temperature = [["0 s", "700 K"], ["50 s", "500 K"], ["50 s", "900 K"], ["100 s", "900 K"]] }
"#;
    let pores = "pores = { porosity = 0.6, permeability = \"1e-12 m^2\" }\n";
    let backs = [
        "back_face = { kind = \"insulated\" }",
        "back_face = { kind = \"held\", temperature = \"500 K\" }",
        "back_face = { kind = \"held\", temperature = \"350 K\", pressure = \"100 kPa\" }",
    ];
    for (number, back) in backs.into_iter().enumerate() {
        let [_, material] = heated_film(1.0, 301.0, "1e8", "144", 1.0);
        let material = material.replace("name = \"M\"\n", &format!("name = \"M\"\n{pores}"));
        let material = material.replace("[decomposition.char]\n", &format!("[decomposition.char]\n{pores}"));
        let scratch = folder(&format!("darcy-{number}"), &format!("{case}{back}\n"), &material);
        run(&scratch, "predict case.toml --precision f64 --out out --force").succeeded();
        let summary: Value = serde_json::from_str(&scratch.read("out/summary.json")).expect("JSON");
        let residual = summary["balance"]["mass"].as_f64().expect("a number");
        assert!(residual.abs() < 1e-9, "{back}: {residual:e}");
    }
}
