//! A sweep cut into pieces, merged again; and that neither takes more memory for more members.

use super::faults::refused;
use super::{CASE, bondline, charring, command, finish, say};
use crate::support::{MEMORY_KIB, Scratch};
use serde_json::Value;

/// The pieces `cuts` of a sweep of `c`, each marched on its own number of threads; their files.
fn pieces(scratch: &Scratch, sweep: &str, cuts: &[(usize, usize)]) -> Vec<String> {
    let piece = |(index, &(first, end)): (usize, &(usize, usize))| {
        let line = format!("uncertainty c {sweep} --members {first}..{end} --out p --quiet");
        let mut command = command(scratch);
        command.env("RAYON_NUM_THREADS", (1 + index % 3).to_string());
        let ran = finish(command.args(line.split_whitespace())).done();
        let file = format!("p/c-{first}-{end}.json");
        assert!(
            ran.stdout.contains(&file) && ran.stdout.contains(&format!("members {first}..{end}")),
            "{}",
            ran.stdout
        );
        file
    };
    cuts.iter().enumerate().map(piece).collect()
}

/// What a report leaves, less what tells who wrote it and how long it took.
fn told(scratch: &Scratch, folder: &str) -> (Value, Vec<String>) {
    let mut summary: Value = serde_json::from_str(&scratch.read(&format!("{folder}/summary.json"))).expect("JSON");
    for key in ["command", "seconds", "backend"] {
        assert!(summary.as_object_mut().expect("an object").remove(key).is_some(), "no {key}");
    }
    let tables = ["percentiles.csv", "shares.csv", "traces.csv"];
    (summary, tables.iter().map(|table| scratch.read(&format!("{folder}/{table}"))).collect())
}

#[test]
fn pieces_merged_in_any_order_tell_what_one_march_of_all_tells_to_the_last_digit() {
    let scratch = Scratch::new("pieces");
    // Of the last some members melt everything and fail.
    let melting = CASE.replacen("small = [0.9, 1.1]", "small = [0.5, 400]", 1);
    for (case, sweep) in [
        (CASE.to_owned(), "-n 300 --sampling lhs --seed 7"),
        (charring(), "-n 60 --sampling sobol --backend gpu"),
        (CASE.to_owned() + "\n[[correlation]]\nfactors = [\"f_q\", \"f_k\"]\nvalue = -0.7\n", "-n 100 --seed 3"),
        (melting, "-n 80 --sampling uniform --set pressure=1kPa"),
    ] {
        scratch.write("c/case.toml", case);
        let members: usize = sweep.split(' ').nth(1).and_then(|n| n.parse().ok()).expect("members");
        say(&scratch, &format!("uncertainty c {sweep} --max-failed {members} --out whole --quiet")).done();
        let files = pieces(&scratch, sweep, &[(members / 2, members), (0, 1), (1, members / 2)]);
        say(&scratch, &format!("merge {} --out merged --max-failed {members}", files.join(" "))).done();
        let (whole, merged) = (told(&scratch, "whole"), told(&scratch, "merged"));
        assert_eq!(whole, merged, "{sweep}");
        assert_eq!(merged.0["members"]["requested"], members);
        let page = scratch.read("merged/report.html");
        assert!(page.contains("Distribution of the peak temperatures"), "the page has its figures");
    }
    assert!(told(&scratch, "merged").0["members"]["failed"].as_u64().is_some_and(|failed| failed > 10));
    let files = "p/c-0-1.json p/c-1-40.json p/c-40-80.json";
    say(&scratch, &format!("merge {files} --max-failed 5")).ended(1).saying(&["more than the 5 put up with"]);
}

#[test]
fn pieces_that_do_not_make_one_sweep_are_refused_in_words_and_nothing_is_written() {
    let scratch = Scratch::new("pieces-refused");
    scratch.write("c/case.toml", CASE);
    let cuts = [(0, 20), (20, 40), (30, 60), (50, 60)];
    pieces(&scratch, "-n 60", &cuts);
    let p = |first: usize, end: usize| format!("p/c-{first}-{end}.json");
    let other = |sweep: &str, name: &str| {
        say(&scratch, &format!("uncertainty c {sweep} --members 20..60 --out q --quiet")).done();
        std::fs::rename(scratch.path().join("q/c-20-60.json"), scratch.path().join(name)).expect("a piece");
        name.to_owned()
    };
    let version = format!("\"bondline\":{:?}", env!("CARGO_PKG_VERSION"));
    assert!(scratch.read(&p(20, 40)).contains(&version), "the version stands in the piece");
    scratch.write("old.json", scratch.read(&p(20, 40)).replacen(&version, "\"bondline\":\"0.0.9\"", 1));
    let refusals = [
        (vec![p(0, 20), p(20, 40), p(30, 60)], "members 30..60 overlap another piece, which ends at 40"),
        (vec![p(0, 20), p(0, 20), p(20, 40)], "members 0..20 overlap another piece, which ends at 20"),
        (vec![p(20, 40), p(0, 20), p(50, 60)], "no piece holds members 40..50 of the 60 drawn"),
        (vec![p(0, 20), p(20, 40)], "no piece holds members 40..60 of the 60 drawn"),
        (vec![p(20, 40), p(30, 60)], "no piece holds members 0..20 of the 60 drawn"),
        (vec![p(0, 20), other("-n 60 --seed 2", "seed.json")], "their draws differ, 60 members by normal, seed 2"),
        (vec![p(0, 20), other("-n 61", "drawn.json")], "their draws differ, 61 members by normal, seed 1"),
        (vec![p(0, 20), other("-n 60 --precision f32", "f32.json")], "their backends differ, cpu f32 and cpu f64"),
        (vec![p(0, 20), other("-n 60 --set pressure=1kPa", "set.json")], "their cases differ, c ("),
        (vec![p(0, 20), "old.json".to_owned()], "made by bondline 0.0.9, expected"),
        (vec!["c/case.toml".to_owned()], "c/case.toml\": not a piece file of `uncertainty --members`"),
        (vec!["p/none.json".to_owned()], "p/none.json\": no such file"),
        (vec!["p".to_owned()], "p\": is a folder: expected a file"),
    ];
    let given = scratch.files().len();
    for (files, said) in refusals {
        let words: Vec<&str> = ["merge"].into_iter().chain(files.iter().map(String::as_str)).collect();
        refused(&scratch, bondline(&scratch, &words), given, &[said]);
    }
}

#[test]
fn a_piece_is_held_against_its_case_and_against_itself() {
    let scratch = Scratch::new("pieces-case");
    scratch.write("c/case.toml", CASE);
    let line = format!("merge {}", pieces(&scratch, "-n 20", &[(0, 20)])[0]);
    let piece = scratch.read("p/c-0-20.json");
    let damages = [
        ("\"numbers\":[20,", "\"numbers\":[19,"),
        ("\"sampling\":\"normal\"", "\"sampling\":\"dice\""),
        ("\"kept\":{\"0\":[", "\"kept\":{\"9999\":["),
        ("\"below_k\":[", "\"below_k\":[0.1,"),
    ];
    for (from, to) in damages {
        assert!(piece.contains(from), "no {from} in the piece");
        scratch.write("p/c-0-20.json", piece.replacen(from, to, 1));
        refused(&scratch, say(&scratch, &line), 2, &["p/c-0-20.json: damaged"]);
    }
    scratch.write("p/c-0-20.json", piece);
    scratch.write("c/case.toml", CASE.replacen("3 mm", "4 mm", 1));
    refused(&scratch, say(&scratch, &line), 2, &["is not what was marched", "it has changed since"]);
    scratch.write("there/c/case.toml", CASE);
    say(&scratch, &format!("{line} --case there/c --json")).done();
}

#[test]
fn a_piece_that_cannot_be_is_told_with_what_was_expected() {
    let scratch = Scratch::new("pieces-typed");
    scratch.write("c/case.toml", CASE);
    for (members, said) in [
        ("5", "--members \"5\": expected FIRST..END such as 0..2500"),
        ("a..b", "--members \"a..b\": expected FIRST..END"),
        ("20..10", "expected a first member before the end"),
        ("90..101", "an end no higher than the 100 drawn (-n), found 90 and 101"),
    ] {
        refused(&scratch, say(&scratch, &format!("uncertainty c -n 100 --members {members}")), 1, &[said]);
    }
    refused(&scratch, say(&scratch, "uncertainty c --members 0..9 --json"), 1, &["cannot be used with"]);
}

/// A hundred thousand members under a limit on memory that one row of temperatures kept of each would pass by itself:
/// ten sensors at 41 instants are 3.3 kB.
#[test]
fn a_hundred_thousand_members_take_less_memory_than_a_row_of_each_would() {
    let scratch = Scratch::new("memory");
    let more: Vec<String> = (1..9).map(|n| format!("[[sensor]]\nname = \"D{n}\"\ndepth = \"0.{n} mm\"\n")).collect();
    let coarse = CASE.replacen("cells = 16", "cells = 8\nlargest_step = \"4 s\"\ngrowth = 1.0", 1);
    scratch.write("c/case.toml", coarse.replacen("[hot_face]", &(more.concat() + "\n[hot_face]"), 1));
    let members = 100_000;
    assert!(members * 10 * 41 * 8 > MEMORY_KIB * 1024, "the limit lets every row be kept");
    // Arenas of the allocator and stacks of threads are reserved for each thread, so their number is fixed.
    let line = format!(
        "ulimit -v {MEMORY_KIB} && RAYON_NUM_THREADS=2 MALLOC_ARENA_MAX=1 exec {} uncertainty c -n {members} --backend cpu --json",
        env!("CARGO_BIN_EXE_bondline")
    );
    let mut shell = std::process::Command::new("bash");
    let ran = finish(shell.current_dir(scratch.path()).args(["-c", &line])).done();
    assert_eq!(ran.json()["members"]["ok"], members);
}
