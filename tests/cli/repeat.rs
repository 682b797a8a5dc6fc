//! Reports whose question is asked again.

use super::{CASE, OBSERVATIONS, run};
use crate::support::Scratch;

#[test]
fn a_repeated_question_gives_the_same_bits_whatever_the_folder_it_is_repeated_from() {
    let scratch = Scratch::new("repeat");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    for (place, line) in [
        "predict c --depth-profiles 10s,20s --set f_k=1.1 --precision f32",
        "uncertainty c -n 60 --sampling sobol --seed 18446744073709551615",
        "uncertainty c -n 400 --until TC2\u{a0}P95\u{a0}±\u{a0}50\u{a0}K",
        "sensitivity c --step 1e-3",
        "estimate c --factors f_k --start f_k=0.9 --window 0:30",
        "study c -n 40",
        "size c --ply BASE --limit TC2<600K --probability 0.8 -n 30 --thickness-range 1mm:9mm",
        "trade c --ply BASE=akk,kkl --size INS --limit TC2<600K --probability 0.8 -n 20",
        "design c --estimate f_k --sensors 1 -n 4 --grid 1mm --run-lengths 20s,40s",
        "twin c --study 2 --noise 1K --seed 3",
        "observations c",
    ]
    .into_iter()
    .enumerate()
    {
        let asked = run(&scratch, &format!("{line} --out r{place} --quiet"));
        assert!(asked.code < 2, "{line}: {}", asked.stderr);
        scratch.write("elsewhere/mark", "");
        let again = run(&scratch, &format!("repeat r{place} --quiet"));
        assert_eq!(again.code, asked.code, "{line}: {}", again.stderr);
        assert!(again.stdout.contains("the same as in"), "{line}: {}", again.stdout);
        let texts = ["", "-repeated"].map(|end| scratch.read(&format!("r{place}{end}/question.toml")));
        assert_eq!(texts[0], texts[1], "{line}");
    }
}

#[test]
fn a_changed_case_a_changed_table_and_a_wrong_record_are_told() {
    let scratch = Scratch::new("repeat-changed");
    scratch.write("c/case.toml", CASE);
    run(&scratch, "predict c --out r --quiet").succeeded();
    let table = scratch.read("r/traces.csv");
    scratch.write("r/traces.csv", table.replacen('3', "4", 1));
    let differs = run(&scratch, "repeat r --out again --quiet").exited_with(1);
    assert!(differs.stderr.contains("traces.csv") && differs.stderr.contains("1 of "), "{}", differs.stderr);

    let record = scratch.read("r/question.toml");
    scratch.write("wrong/question.toml", record.replace("[question.predict]", "[question.predict]\nmembers = 3"));
    run(&scratch, "repeat wrong").exited_with(2).with_stderr(&["wrong/question.toml", "unknown field `members`"]);
    run(&scratch, "repeat c").exited_with(2).with_stderr(&["c/question.toml"]);

    scratch.write("c/case.toml", CASE.replacen("3 mm", "4 mm", 1));
    run(&scratch, "repeat r --out third")
        .exited_with(2)
        .with_stderr(&["the case is not as it was", "has changed since"]);
    assert!(!scratch.path().join("third").exists());
}
