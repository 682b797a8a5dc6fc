//! Sizing and coverage studies: output, files, and independence of the number of threads.

use super::{CASE, CommandResult, OBSERVATIONS, command, run, wait_for};
use crate::support::{Scratch, without_run};
use serde_json::Value;

fn run_on_threads(scratch: &Scratch, threads: usize, line: &str) -> CommandResult {
    let mut command = command(scratch);
    command.env("RAYON_NUM_THREADS", threads.to_string());
    wait_for(command.args(line.split_whitespace())).succeeded()
}

fn case_with_observations(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    scratch
}

/// The summary of a report without times and backend, and its tables.
fn results(scratch: &Scratch, folder: &str, tables: &[&str]) -> (Value, Vec<String>) {
    let summary = serde_json::from_str(&scratch.read(&format!("{folder}/summary.json"))).expect("JSON");
    let mut summary = without_run(summary);
    assert!(summary.as_object_mut().expect("an object").remove("backend").is_some());
    (summary, tables.iter().map(|table| scratch.read(&format!("{folder}/{table}"))).collect())
}

#[test]
fn sizing_is_the_same_on_any_number_of_threads_on_screen_in_tables_and_in_the_summary() {
    let scratch = case_with_observations("sized");
    let line = "size c --ply BASE --limit TC2<480K --probability 0.9 -n 80 --quiet --out";
    let ran = run_on_threads(&scratch, 1, &format!("{line} one"));
    run_on_threads(&scratch, 3, &format!("{line} three"));
    let tables = ["sizing.csv", "required-thickness.csv"];
    let (one, three) = (results(&scratch, "one", &tables), results(&scratch, "three", &tables));
    assert_eq!(one, three);
    let sizing = &one.0["sizing"];
    let number =
        |key: &str, of: &str| sizing[key][of].as_f64().unwrap_or_else(|| panic!("no {key}.{of} in {sizing:#}"));
    let (nominal, needed) = (number("nominal", "thickness_m"), number("required", "thickness_m"));
    assert!(nominal < needed && (sizing["margin_m"].as_f64() == Some(needed - nominal)), "{sizing:#}");
    assert_eq!(sizing["check"]["confirmed"], true, "{sizing:#}");
    for said in ["BASE for TC2 below 480 K", "stated", "nominal", "90 % of members", "margin", "Check at"] {
        assert!(ran.stdout.contains(said), "no {said:?} in:\n{}", ran.stdout);
    }
    assert!(ran.stdout.lines().count() <= 25 && ran.stdout.lines().all(|line| line.chars().count() <= 80));
    let page = scratch.read("one/report.html");
    assert!(page.contains("<section id=\"size\">") && page.contains("Peak of TC2 against the thickness of BASE"));
    assert_eq!(one.1[0].lines().count(), 14);
    // It is at its hottest at the end, as the heater never goes out.
    assert!(ran.stdout.contains("TC2 peaks at the end of the run (40 s)"), "{}", ran.stdout);
}

/// The members of the check are drawn independently, whatever those of the thickness.
#[test]
fn a_thickness_of_members_that_are_not_independent_has_no_interval_but_that_of_the_check() {
    let scratch = case_with_observations("dependent");
    for (sampling, is_independent) in [("normal", true), ("lhs", false), ("sobol", false)] {
        let line = format!(
            "size c --ply BASE --limit TC2<480K --probability 0.9 -n 80 --sampling {sampling} --quiet --out {sampling}"
        );
        let ran = run(&scratch, &line).succeeded();
        let sizing = &results(&scratch, sampling, &[]).0["sizing"];
        let has_interval = |of: &Value| of.as_array().is_some_and(|ends| ends.iter().all(Value::is_number));
        assert_eq!(has_interval(&sizing["interval_m"]), is_independent, "{sampling}: {sizing:#}");
        assert_eq!(has_interval(&sizing["stated"]["within_limit"]["interval"]), is_independent, "{sizing:#}");
        assert_eq!(has_interval(&sizing["check"]["expected"]), is_independent, "{sizing:#}");
        assert!(has_interval(&sizing["check"]["within_limit"]["interval"]), "{sizing:#}");
        let words = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
        let reason = format!("members of {sampling} sampling are not independent");
        assert_eq!(words.contains(&reason), !is_independent, "{}", ran.stdout);
        assert_eq!(words.contains("95 % confidence interval of the thickness"), is_independent, "{}", ran.stdout);
    }
}

#[test]
fn a_limit_that_no_thickness_satisfies_is_reported_and_thin_plies_keep_three_digits() {
    let scratch = case_with_observations("thin");
    let asked = "size c --ply BASE --limit TC2<310K --probability 0.9 -n 80 --quiet --out none";
    let ran = run(&scratch, &format!("{asked} --thickness-range 2mm:4mm")).succeeded();
    let words = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    for said in ["more than 4.00 mm for 90 % of 80 members", "no thickness up to 4.00 mm suffices even so"] {
        assert!(words.contains(said), "no {said:?} in:\n{}", ran.stdout);
    }
    assert!(!ran.stdout.contains("too small") && !ran.stdout.contains("too thin"), "{}", ran.stdout);

    let thin = CASE.replace("thickness = \"0.5 mm\"", "thickness = \"25 um\"");
    scratch.write("thin/case.toml", thin);
    let ran = run(&scratch, "size thin --ply TOP --limit TC2<480K --probability 0.9 -n 80 --quiet --out thin/out")
        .succeeded();
    let words = ran.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    for said in ["stated 0.0250 mm", "more than 0.100 mm for 90 % of 80 members"] {
        assert!(words.contains(said), "no {said:?} in:\n{}", ran.stdout);
    }
    let page = scratch.read("thin/out/report.html");
    assert!(page.contains(">0.025<"), "the drawing of the layup lacks the thin ply");
}

#[test]
fn a_coverage_study_is_the_same_on_any_number_of_threads_and_lists_every_data_set() {
    let scratch = case_with_observations("twins");
    let line = "twin c --study 7 --factors f_k,f_q --correlation-time 5s --seed 4 --bounds large --quiet --out";
    let ran = run_on_threads(&scratch, 1, &format!("{line} one"));
    run_on_threads(&scratch, 3, &format!("{line} three"));
    let (one, three) = (results(&scratch, "one", &["coverage.csv"]), results(&scratch, "three", &["coverage.csv"]));
    assert_eq!(one, three);
    assert_eq!(one.1[0].lines().count(), 1 + 7 * 2);
    assert_eq!(
        (&one.0["coverage_study"]["requested"], &one.0["coverage_study"]["correlation_time_s"]),
        (&7.into(), &5.0.into())
    );
    assert!(
        ran.stdout.contains("Coverage of the 95 % intervals") && ran.stdout.contains("7 synthetic data sets"),
        "{}",
        ran.stdout
    );
    assert!(scratch.read("one/report.html").contains("<section id=\"coverage\">"));
}

/// A thicker ply keeps the heat in the one before it, whose tables end: the peak at the largest thickness is unknown.
#[test]
fn a_march_that_fails_at_the_largest_thickness_gives_its_own_reason() {
    let scratch = Scratch::new("fails-thick");
    let table = "temperatures_k = [250, 1070]\nvalues = [1000, 1100]\nunit = \"J/kg/K\"\noutside = \"error\"\n";
    let short = format!(
        "name = \"Short\"\n[density]\nvalue = \"170 kg/m^3\"\n[heat_capacity]\n{table}[conductivity]\n\
         value = \"0.3 W/m/K\"\n[emissivity]\nvalue = 0.9\n"
    );
    scratch.write("c/materials/short.toml", &short);
    let long = short.replace("\"Short\"", "\"Long\"").replace("\"error\"", "\"clamp\"").replace("0.3 W", "0.03 W");
    scratch.write("c/materials/long.toml", &long);
    let ply = |name: &str, material: &str, thickness: &str| {
        format!("[[ply]]\nname = \"{name}\"\nmaterial = \"{material}\"\nthickness = \"{thickness}\"\n")
    };
    scratch.write(
        "c/case.toml",
        format!(
            "initial_temperature = \"300 K\"\nduration = \"300 s\"\n{}{}[[sensor]]\nname = \"TC1\"\nbelow = \"TOP\"\n\
             [hot_face]\nkind = \"heated\"\nflux = \"8 kW/m^2\"\nemissivity = 0\n[back_face]\nkind = \"held\"\n\
             temperature = \"300 K\"\n[[factor]]\nname = \"f_q\"\nproperty = \"heating\"\nsmall = [0.95, 1.05]\n",
            ply("TOP", "short", "1 mm"),
            ply("BASE", "long", "1.6 mm")
        ),
    );
    let reason = "ply \"TOP\" left the temperature range of the tables of short, which forbid extrapolation";
    let thickest = "the march at nominal factors failed with BASE of 6.4 mm, the largest thickness allowed: ";
    run(&scratch, "size c --ply BASE --limit TC1<600K --probability 0.9 -n 40")
        .exited_with(2)
        .with_stderr(&[thickest, reason]);
    let traded =
        run(&scratch, "trade c --ply BASE=long --size BASE --limit TC1<600K --probability 0.9 -n 40 --out traded");
    traded.succeeded();
    let failed = format!("the nominal march failed with the largest thickness of BASE under c ({reason})");
    let page = scratch.read("traded/report.html").replace("&quot;", "\"");
    assert!(page.contains(&failed) && !page.contains("is not cooled"), "no {failed:?}");
    // A march that completes at the largest thickness is still told from one that fails.
    run(&scratch, "size c --ply BASE --limit TC1<600K --thickness-range 0.4mm:1.8mm --probability 0.9 -n 40")
        .exited_with(2)
        .with_stderr(&["TC1 is not cooled by a thicker BASE: its peak is "]);
}
