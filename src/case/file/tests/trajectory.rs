//! Coefficients and enthalpies that vary with time, and the table of a trajectory.

use super::{Scratch, VALID_CASE};
use crate::case::{Case, Face, OpenFace, Schedule};

const FLUX: &str = r#"flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }"#;

const TRAJECTORY: &str = "Mission 7\nt [s],p [psf],q [BTU/ft^2/s],hr [BTU/lb],ch [lb/ft^2/s],h (W/m^2/K),Ts [degF]\n\
    -10,20,0,1000,0,0,80\n0,20,1,2000,0.01,5,80\n50,30,3,4000,0.02,,100\n120,10,0,1500,0,25,60\n";

/// The valid case with other keys at the hot face, below the flux, and at the top.
fn case(scratch: &Scratch, top: &str, hot_face: &str) -> Result<Case, String> {
    scratch.write("entry.csv", TRAJECTORY);
    let text = format!("{top}\n{}", VALID_CASE.replacen(FLUX, hot_face, 1));
    Case::load(&scratch.write("case.toml", text)).map_err(|error| error.to_string())
}

fn open(case: &Case) -> &OpenFace {
    let Face::Open(open) = &case.exposure.hot_face else { panic!("an open face") };
    open
}

const FILE: &str = r#"trajectory = { file = "entry.csv", time = "t" }"#;

#[test]
fn schedules_read_their_columns_from_the_one_table_of_a_trajectory() {
    let scratch = Scratch::new("trajectory");
    let top = format!("{FILE}\npressure = {{ column = \"p\" }}");
    let face = "enthalpy_film_coefficient = { column = \"ch\" }\nrecovery_enthalpy = { column = \"hr\" }\n\
                surroundings = { column = \"Ts\" }\nheat_transfer_coefficient = { column = \"h\" }\ngas = \"900 K\"";
    let case = case(&scratch, &top, face).unwrap_or_else(|error| panic!("{error}"));
    let close = |schedule: &Schedule, time_s: f64, expected: f64| {
        let found = schedule.after(time_s);
        assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found}, not {expected}, at {time_s} s");
    };
    close(&case.exposure.pressure_pa, 25.0, 25.0 * 47.88025898033584);
    let open = open(&case);
    close(open.recovery_enthalpy_j_kg.as_ref().expect("a recovery enthalpy"), 50.0, 4000.0 * 2326.0);
    close(open.enthalpy_film_kg_m2_s.as_ref().expect("a film coefficient"), 25.0, 0.015 * 4.882427636383051);
    close(&open.surroundings_k, 50.0, (100.0 + 459.67) / 1.8);
    // The row without the coefficient is skipped.
    close(&open.film_w_m2_k, 60.0, 15.0);
    assert!(!open.flux_w_m2.acts());
}

#[test]
fn coefficients_enthalpies_and_blowing_may_be_points() {
    let scratch = Scratch::new("varying");
    let face = format!(
        "{FLUX}\nrecovery_enthalpy = [[\"0 s\", \"9 MJ/kg\"], [\"100 s\", \"3 MJ/kg\"]]\nblowing = 0\n\
         heat_transfer_coefficient.points = [[\"0 s\", \"5 W/m^2/K\"], [\"9 s\", \"7 W/m^2/K\"]]\n\
         heat_transfer_coefficient.outside = \"zero\"\n\
         gas = \"900 K\""
    );
    let case = case(&scratch, "", &face).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(open(&case).recovery_enthalpy_j_kg.as_ref().map(|enthalpy| enthalpy.after(50.0)), Some(6e6));
    assert_eq!([4.5, 10.0].map(|time_s| open(&case).film_w_m2_k.after(time_s)), [6.0, 0.0]);
}

#[test]
fn faults_of_a_trajectory_and_of_varying_coefficients_are_refused() {
    let corrected = |more: &str| format!("{FLUX}\nrecovery_enthalpy = \"9 MJ/kg\"\n{more}");
    let wrong: &[(&str, String, &str)] = &[
        ("", "flux = { column = \"q\" }".to_owned(), "`column` needs a `file`: found none"),
        (FILE, FLUX.to_owned(), ":1:14: no schedule reads a column: expected one such as pressure = { column"),
        (FILE, "flux = { column = \"Q\" }".to_owned(), "entry.csv has no column \"Q\""),
        (FILE, "flux = { column = \"p\" }".to_owned(), "entry.csv:2:7: wrong dimension: expected a heat flux"),
        (
            FILE,
            "flux = { column = \"q\", time = \"t\" }".to_owned(),
            "the times of this column are those of [trajectory]",
        ),
        ("trajectory = { time = \"t\" }", "flux = { column = \"q\" }".to_owned(), "missing key \"file\""),
        (
            "trajectory = { file = \"entry.csv\", time = \"t\", column = \"q\" }",
            "flux = { column = \"q\" }".to_owned(),
            "unknown key \"column\"",
        ),
        (
            "trajectory = { file = \"entry.csv\", time = { column = \"t\", offset = \"-60 s\" } }",
            "flux = { column = \"q\" }".to_owned(),
            "no value from 60 s to 100 s",
        ),
        (
            "",
            format!("{FLUX}\nenthalpy_film_coefficient = \"0.1 kg/m^2/s\"\nrecovery_enthalpy = \"9 MJ/kg\""),
            "expected `flux` or `enthalpy_film_coefficient`, not both",
        ),
        (
            "",
            "enthalpy_film_coefficient = \"0.1 kg/m^2/s\"".to_owned(),
            "`enthalpy_film_coefficient` needs a key `recovery_enthalpy`",
        ),
        (
            "",
            "enthalpy_film_coefficient = [[\"0 s\", \"0.1 kg/m^2/s\"], [\"100 s\", \"-0.1 kg/m^2/s\"]]\n\
             recovery_enthalpy = \"9 MJ/kg\""
                .to_owned(),
            "expected 0 or more, found -0.1",
        ),
        (
            "",
            format!("{FLUX}\nrecovery_enthalpy = [[\"0 s\", \"9 MJ/kg\"], [\"100 s\", \"1 kJ/kg\"]]"),
            "expected a recovery enthalpy above that of air at the cold wall, 2000 J/kg, found 1000 J/kg",
        ),
        ("", corrected("blowing = [[\"0 s\", 0.5], [\"100 s\", 1.5]]"), "expected blowing from 0 to 1"),
        (
            "",
            corrected(
                "heat_transfer_coefficient = [[\"0 s\", \"5 W/m^2/K\"], [\"100 s\", \"-5 W/m^2/K\"]]\ngas = \"9 K\"",
            ),
            "expected 0 or more, found -5",
        ),
    ];
    for (index, (top, face, expected)) in wrong.iter().enumerate() {
        let message = case(&Scratch::new(&format!("trajectory-{index}")), top, face).expect_err(expected);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}
