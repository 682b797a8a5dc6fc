//! `init`: every template is a case that can be studied at once.

use super::run;
use crate::support::Scratch;

fn templates(scratch: &Scratch) -> Vec<String> {
    let list = run(scratch, "init --list").succeeded().stdout;
    let names: Vec<String> = list.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect();
    assert!(names.len() >= 4, "{list}");
    names
}

#[test]
fn every_template_is_a_case_that_a_study_computes_without_warnings() {
    let scratch = Scratch::new("init");
    for template in templates(&scratch) {
        let ran = run(&scratch, &format!("init new/{template} --template {template}")).succeeded();
        assert!(ran.stdout.contains(&format!("wrote new/{template}/case.toml")), "{}", ran.stdout);
        let text = scratch.read(&format!("new/{template}/case.toml"));
        assert!(text.lines().filter(|line| line.contains('#')).count() >= 5, "{template} has no comments");
        assert!(text.lines().all(|line| line.chars().count() <= 120), "{template}");
        let ran = run(&scratch, &format!("study new/{template} -n 40 --quiet")).succeeded();
        assert!(!ran.stdout.lines().any(|line| line.starts_with('!')), "{template}:\n{}", ran.stdout);
    }
}

#[test]
fn the_template_with_readings_gives_back_the_factors_that_made_them() {
    let scratch = Scratch::new("init-estimate");
    run(&scratch, "init e --template estimate").succeeded();
    let readings = scratch.read("e/measured.csv");
    let found = run(&scratch, "estimate e --json --quiet").succeeded().json();
    for factor in ["f_eps", "f_k_INS", "f_cp_INS"] {
        let (_, truth) = readings.split_once(&format!("{factor} = ")).expect("the file states the true factors");
        let truth: f64 = truth.split([',', ' ']).next().and_then(|text| text.parse().ok()).expect("a number");
        let number = |key: &str| found["factors"][factor][key].as_f64().expect("a number");
        assert!((number("value") - truth).abs() < 4.0 * number("standard_error"), "{factor}: {truth}, {found:#}");
    }
}

#[test]
fn a_folder_that_is_not_empty_is_refused_unless_forced() {
    let scratch = Scratch::new("init-force");
    scratch.write("mine/case.toml", "my own work");
    scratch.write("mine/notes.txt", "notes");
    run(&scratch, "init mine").exited_with(2).with_stderr(&["mine is not empty", "--force"]);
    assert_eq!(scratch.read("mine/case.toml"), "my own work");
    run(&scratch, "init mine --force").succeeded();
    assert!(scratch.read("mine/case.toml").contains("[[ply]]"));
    assert_eq!(scratch.read("mine/notes.txt"), "notes");
    run(&scratch, "init mine/notes.txt").exited_with(2).with_stderr(&["mine/notes.txt"]);
    run(&scratch, "init").exited_with(2);
    run(&scratch, "init other --template none").exited_with(2).with_stderr(&["possible values: layup"]);
}
