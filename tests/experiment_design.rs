//! Designs of tests: what they expect against what twin experiments find, and what makes them better or worse.

use crate::cli::{CASE, run};
use crate::support::{Scratch, case, root, runs_all};
use bondline::fit::interval::NORMAL_95;
use bondline::question::{Design, Estimate};
use bondline::session::{BackendKind, Options, Session};
use bondline::study::experiment_design::{self, ExperimentDesign, NoiseSource};
use std::fs;

const FACTORS: [&str; 3] = ["f_k_INS", "f_cp_INS", "f_k_OF"];

fn lcat() -> Session {
    Session::open(case("lcat-2259"), &Options::default().backend(BackendKind::Cpu)).expect("the CPU does not fail")
}

fn options(members: usize) -> Design {
    let noise = (Some(2.0), Some(0.0));
    Design { members, noise_k: noise.0, correlation_time_s: noise.1, ..Design::new(FACTORS, 4) }
}

fn best(found: &ExperimentDesign) -> &experiment_design::Design {
    &found.scenarios[0].designs[0]
}

#[test]
fn a_design_is_better_than_the_paper_s_depths_and_each_thermocouple_tells_more() {
    let mut session = lcat();
    let found = session.design(&options(60)).expect("a design");
    let scenario = &found.scenarios[0];
    let existing = scenario.existing.as_ref().expect("the case has thermocouples");
    assert_eq!(existing.candidates.len(), 4);
    assert!(best(&found).loss < existing.loss, "{} and {}", best(&found).loss, existing.loss);
    assert_eq!(scenario.growth.len(), 4);
    assert!(scenario.growth.windows(2).all(|pair| pair[1].loss < pair[0].loss));
    assert_eq!(scenario.growth[3].candidates, best(&found).candidates);
    let depths_m: Vec<f64> = best(&found).candidates.iter().map(|&at| scenario.candidates[at].depth_m).collect();
    assert!(depths_m.windows(2).all(|pair| pair[1] - pair[0] > 0.499e-3), "{depths_m:?}");
    // Half the noise halves every standard error, and leaves the depths.
    let quiet = session.design(&Design { noise_k: Some(1.0), ..options(60) }).expect("a design");
    assert_eq!(best(&quiet).candidates, best(&found).candidates);
    for (one, two) in best(&quiet).standard_errors.iter().zip(&best(&found).standard_errors) {
        assert!((two / one - 2.0).abs() < 1e-6, "{one} and {two}");
    }
}

#[test]
fn a_tolerance_of_the_depth_a_shorter_run_and_slower_sampling_tell_less() {
    let mut session = lcat();
    let loss = |session: &mut Session, options: &Design| best(&session.design(options).expect("one")).loss;
    let plain = loss(&mut session, &options(20));
    let tolerant = loss(&mut session, &Design { position_tolerance_m: 0.25e-3, ..options(20) });
    assert!(tolerant > plain + 0.1, "{tolerant} and {plain}");
    let both = session.design(&Design { run_lengths_s: vec![200.0, 60.0], ..options(20) }).expect("a design");
    assert_eq!(both.scenarios.iter().map(|scenario| scenario.run_length_s).collect::<Vec<_>>(), [200.0, 60.0]);
    assert!((best(&both).loss - plain).abs() < 1e-9 * plain.abs(), "{} and {plain}", best(&both).loss);
    assert!(both.scenarios[1].designs[0].loss > plain);
    let slow = loss(&mut session, &Design { sampling_s: Some(5.0), ..options(20) });
    assert!(slow > plain + 1.0, "{slow} and {plain}");
}

/// Standard errors of the thermocouples of the case, over those at half the sampling rate.
fn gain_of_faster_sampling(session: &mut Session, correlation_s: f64) -> Vec<f64> {
    let mut errors = |sampling_s| {
        let noise = Design { correlation_time_s: Some(correlation_s), ..options(4) };
        let found = session.design(&Design { sampling_s: Some(sampling_s), ..noise }).expect("a design");
        found.scenarios[0].existing.as_ref().expect("thermocouples").standard_errors.clone()
    };
    let (fast, slow) = (errors(0.5), errors(1.0));
    fast.iter().zip(&slow).map(|(fast, slow)| fast / slow).collect()
}

/// Noise that decorrelates over ten samples is known from a few of them; white noise is averaged away, by √2.
#[test]
fn faster_sampling_adds_no_information_where_noise_is_correlated() {
    let mut session = lcat();
    for ratio in gain_of_faster_sampling(&mut session, 10.0) {
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }
    for ratio in gain_of_faster_sampling(&mut session, 0.0) {
        assert!((ratio * f64::sqrt(2.0) - 1.0).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn noise_that_is_not_stated_is_that_of_the_residuals_of_the_case() {
    let mut session = lcat();
    let plain = Design::new(FACTORS, 1);
    let mut noise = |options: Design| session.design(&options).expect("a design").request.noise;
    let of_data = noise(Design { members: 2, ..plain.clone() });
    let estimated = lcat().estimate(&Estimate::default()).expect("an estimate");
    assert_eq!(of_data.correlation_time_s, estimated.correlation_time_s);
    assert_eq!(of_data.white_fraction, estimated.white_share);
    assert!(of_data.correlation_time_s > 1.0 && of_data.deviation_k > 2.0, "{of_data:?}");
    assert_eq!(
        (of_data.deviation_source, of_data.correlation_source),
        (NoiseSource::Estimated, NoiseSource::Estimated)
    );
    let stated = noise(Design { members: 2, noise_k: Some(3.0), ..plain });
    assert_eq!((stated.deviation_k, stated.deviation_source), (3.0, NoiseSource::Stated));
    assert_eq!(stated.correlation_time_s, of_data.correlation_time_s);
}

#[test]
fn without_observations_and_without_a_stated_correlation_white_noise_is_assumed_and_warned_of() {
    let scratch = Scratch::new("design-noise");
    scratch.write("case.toml", CASE);
    let line = "design case.toml --estimate f_k --sensors 1 -n 4 --out d";
    let assumed = run(&scratch, line).succeeded().stdout;
    assert!(assumed.contains("Noise of a sample: 2.0 K, white, assumed."), "{assumed}");
    assert!(assumed.contains("White noise is assumed"), "{assumed}");
    let stated = run(&scratch, &format!("{line} --force --noise 3K --correlation-time 5s")).succeeded().stdout;
    assert!(stated.contains("Noise of a sample: 3.0 K, correlation time 5 s, stated."), "{stated}");
    assert!(!stated.contains("White noise is assumed"), "{stated}");
}

#[test]
fn what_cannot_be_designed_is_refused_with_the_reason() {
    let mut session = lcat();
    let refused = |session: &mut Session, options: Design| session.design(&options).expect_err("refused").to_string();
    for (options, reason) in [
        (Design::new(["f_x"], 4), "no factor is called \"f_x\""),
        (Design::new(FACTORS, 0), "expected at least 1"),
        (Design { least_distance_m: 3e-3, ..options(10) }, "mm apart"),
        (Design { run_lengths_s: vec![300.0], ..options(10) }, "longer than the exposure"),
        (Design { grid_m: Some(0.01e-3), ..options(10) }, "widen the grid"),
        (Design { target: Some("TC9".to_owned()), ..options(10) }, "no sensor is called \"TC9\""),
        (Design { members: 1, ..options(10) }, "at least 2 members"),
        (Design { correlation_time_s: Some(-1.0), ..options(10) }, "expected no less than 0 s"),
        (Design { others: vec![case("slab").into()], ..options(10) }, "slab: no factor is called"),
    ] {
        let message = refused(&mut session, options);
        assert!(message.contains(reason), "{message}");
    }
}

#[test]
fn twin_experiments_on_the_written_design_have_the_expected_errors() {
    expected_errors_are_found("0s", 1.1);
}

/// The estimate does not know the correlation time: its intervals average over those that the residuals allow.
#[test]
fn twin_experiments_with_correlated_noise_have_the_expected_errors() {
    expected_errors_are_found("5s", 1.2);
}

/// The design of the command, fitted to 400 synthetic data sets with `BONDLINE_ALL`, and to 60 without: the root mean
/// square error of the fits is within 10 % (25 %) of the expected standard error, and the mean standard error that the
/// fits state within the factor `stated`, either way.
fn expected_errors_are_found(correlation_time: &str, stated: f64) {
    let (members, data_sets, tolerance) = if runs_all() { (1000, 400, 0.10) } else { (60, 60, 0.25) };
    let scratch = Scratch::new(&format!("design-{correlation_time}"));
    let names = FACTORS.join(",");
    let noise = format!("--noise 2K --correlation-time {correlation_time}");
    run(
        &scratch,
        &format!("design {}/cases/lcat-2259 --estimate {names} -n {members} {noise} --quiet --out d", root().display()),
    )
    .succeeded();
    let text = scratch.read("d/design.toml");
    let flux = fs::read(root().join("cases/lcat-2259/flux.csv")).expect("a shipped file");
    scratch.write("c/flux.csv", flux);
    scratch.write("c/case.toml", &text);
    run(&scratch, "twin c --noise 2K --out c/measured.csv --quiet").succeeded();
    scratch.write("c/case.toml", text + "\n[observations]\nfile = \"measured.csv\"\nsigma = \"2 K\"\n");
    run(&scratch, &format!("twin c --study {data_sets} {noise} --quiet --out t")).succeeded();
    let read = |file: &str| -> serde_json::Value { serde_json::from_str(&scratch.read(file)).expect("JSON") };
    let (design, study) = (read("d/summary.json"), read("t/summary.json"));
    let expected = &design["experiment_design"]["scenarios"][0]["designs"][0]["standard_errors"];
    for name in FACTORS {
        let expected = expected[name].as_f64().expect("a number");
        let number = |key: &str| study["coverage_study"]["factors"][name][key].as_f64().expect("a number");
        let (found, of_fits) = (number("rms_error"), number("mean_half_width") / NORMAL_95);
        println!("{name}: expected {expected:.5}, found {found:.5}, stated by the fits {of_fits:.5}");
        assert!((found / expected - 1.0).abs() < tolerance, "{name}: expected {expected}, found {found}");
        assert!((1.0 / stated..stated).contains(&(of_fits / expected)), "{name}: {expected} and {of_fits} of the fits");
    }
}
