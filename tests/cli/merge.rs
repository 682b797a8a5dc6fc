//! Parts of a sweep and their merging; memory does not grow with the number of members.

use super::input_errors::refused;
use super::{CASE, command, decomposing_case, run, run_args, wait_for};
use crate::support::{MEMORY_KIB, Scratch, Uniform};
use serde_json::Value;
use twox_hash::XxHash3_128;

/// Compute parts of a sweep of `c`, each on another number of threads. Returns their files.
fn pieces(scratch: &Scratch, sweep: &str, cuts: &[(usize, usize)]) -> Vec<String> {
    let piece = |(index, &(first, end)): (usize, &(usize, usize))| {
        let line = format!("uncertainty c {sweep} --members {first}..{end} --out p --quiet");
        let mut command = command(scratch);
        command.env("RAYON_NUM_THREADS", (1 + index % 3).to_string());
        let ran = wait_for(command.args(line.split_whitespace())).succeeded();
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

/// The summary of a report without command, run and backend, and its tables.
fn results(scratch: &Scratch, folder: &str) -> (Value, Vec<String>) {
    let mut summary: Value = serde_json::from_str(&scratch.read(&format!("{folder}/summary.json"))).expect("JSON");
    for key in ["command", "seconds", "backend", "provenance", "checksum"] {
        assert!(summary.as_object_mut().expect("an object").remove(key).is_some(), "no {key}");
    }
    let tables = ["percentiles.csv", "shares.csv", "traces.csv"];
    (summary, tables.iter().map(|table| scratch.read(&format!("{folder}/{table}"))).collect())
}

/// A piece with a replacement, and the checksum of its new content.
#[track_caller]
fn sealed(piece: &str, from: &str, to: &str) -> String {
    assert!(piece.contains(from), "no {from} in the piece");
    with_checksum(&content(piece).replacen(from, to, 1))
}

/// The content of a piece, without its checksum.
pub(crate) fn content(piece: &str) -> &str {
    let (_, rest) = piece.split_once("\",\"content\":").expect("the checksum is before the content");
    rest.strip_suffix("}\n").expect("the end of a piece")
}

/// A piece with this content.
pub(crate) fn with_checksum(content: &str) -> String {
    format!("{{\"checksum\":\"{:032x}\",\"content\":{content}}}\n", XxHash3_128::oneshot(content.as_bytes()))
}

#[test]
fn identical_parts_count_once_and_missing_members_are_listed() {
    let scratch = Scratch::new("pieces-missing");
    scratch.write("c/case.toml", CASE);
    pieces(&scratch, "-n 60", &[(0, 20), (20, 40), (50, 60)]);
    let (first, second, last) = ("p/c-0-20.json", "p/c-20-40.json", "p/c-50-60.json");
    // The same members, computed once more.
    run(&scratch, "uncertainty c -n 60 --members 20..40 --out q --quiet").succeeded();
    assert_ne!(scratch.read(second), scratch.read("q/c-20-40.json"), "the parts have the same date and command");
    let missing = run(&scratch, &format!("merge --missing {last} {first}")).exited_with(1);
    assert_eq!(missing.stdout, "missing: --members 20..50\n");
    assert!(missing.stderr.contains("30 of 60 members are in no file"), "{}", missing.stderr);
    run(&scratch, "uncertainty c -n 60 --members 40..50 --out p --quiet").succeeded();
    let all = format!("{first} {second} {second} q/c-20-40.json p/c-40-50.json {last}");
    assert_eq!(run(&scratch, &format!("merge --missing {all}")).succeeded().stdout, "the files have all 60 members\n");
    run(&scratch, &format!("merge {all} --out merged")).succeeded();
    run(&scratch, "uncertainty c -n 60 --out whole --quiet").succeeded();
    assert_eq!(results(&scratch, "merged"), results(&scratch, "whole"));
}

#[test]
fn equal_pieces_of_a_job_array_are_computed_once_and_merge_to_the_whole_sweep() {
    let scratch = Scratch::new("pieces-array");
    scratch.write("c/case.toml", CASE);
    let sweep = "uncertainty c -n 6.1e1 --out p --quiet";
    let task = |number: usize| {
        let mut command = command(&scratch);
        command.env("SLURM_ARRAY_TASK_ID", number.to_string());
        wait_for(command.args(format!("{sweep} --piece 4").split(' '))).succeeded().stdout
    };
    assert!(task(2).starts_with("members 15..30 of 61, 15 of them completed"));
    run(&scratch, &format!("{sweep} --piece 4/4")).succeeded();
    let file = scratch.read("p/c-15-30.json");
    assert_eq!(task(2), "members 15..30 are already in p/c-15-30.json\n");
    assert_eq!(scratch.read("p/c-15-30.json"), file);
    let missing = run(&scratch, "merge --missing p").exited_with(1);
    assert_eq!(missing.stdout, "missing: --array=1,3 of 4 pieces\n");
    // A damaged file, and one of another sweep, are no pieces of this one.
    scratch.write("p/c-15-30.json", file.replacen("15", "16", 1));
    assert!(task(2).starts_with("members 15..30 of 61"));
    run(&scratch, "uncertainty c -n 61 --seed 2 --out p --quiet --piece 1/4").succeeded();
    assert!(task(1).starts_with("members 0..15 of 61"));
    assert!(task(3).starts_with("members 30..45 of 61"));
    assert_eq!(run(&scratch, "merge --missing p").succeeded().stdout, "the files have all 61 members\n");
    run(&scratch, "merge p --out merged").succeeded();
    run(&scratch, "uncertainty c -n 61 --out whole --quiet").succeeded();
    assert_eq!(results(&scratch, "merged"), results(&scratch, "whole"));
}

#[test]
fn parts_are_merged_with_the_same_case_in_another_folder() {
    let scratch = Scratch::new("pieces-moved");
    scratch.write("c/case.toml", CASE);
    let files = pieces(&scratch, "-n 40", &[(0, 20), (20, 40)]).join(" ");
    std::fs::rename(scratch.path().join("c"), scratch.path().join("moved")).expect("a folder of this test");
    run(&scratch, &format!("merge {files} --case moved --out merged")).succeeded();
    scratch.write("moved/case.toml", CASE.replacen("3 mm", "4 mm", 1));
    run(&scratch, &format!("merge {files} --case moved --out merged"))
        .exited_with(2)
        .with_stderr(&["is not the case of this file", "or the merge was given another one"]);
}

#[test]
fn a_piece_that_is_none_of_the_equal_ones_is_refused() {
    let scratch = Scratch::new("pieces-none");
    scratch.write("c/case.toml", CASE);
    for (piece, expected) in [
        ("0/4", "expected K/N with K from 1 to N"),
        ("5/4", "expected K/N with K from 1 to N"),
        ("1/61", "N at most the 60 members"),
        ("1/0", "expected K/N with K from 1 to N"),
        ("one/4", "expected K/N with K from 1 to N"),
        ("4", "SLURM_ARRAY_TASK_ID is not set"),
    ] {
        refused(&scratch, run(&scratch, &format!("uncertainty c -n 60 --piece {piece}")), 1, &[expected]);
    }
    let fraction = run(&scratch, "uncertainty c -n 1.5 --piece 1/4");
    refused(&scratch, fraction, 1, &["expected a whole number such as 5000 or 1e6"]);
    refused(&scratch, run(&scratch, "merge c"), 1, &["c: no files of pieces (.json) in this folder"]);
}

#[test]
fn parts_merged_in_any_order_give_the_numbers_of_one_sweep_to_the_last_digit() {
    let scratch = Scratch::new("pieces");
    // Some members of the last sweep are so hot that they fail.
    let melting = CASE.replacen("small = [0.9, 1.1]", "small = [0.5, 400]", 1);
    for (case, sweep) in [
        (CASE.to_owned(), "-n 300 --sampling lhs --seed 7"),
        (decomposing_case(), "-n 60 --sampling sobol --backend gpu"),
        (CASE.to_owned() + "\n[[correlation]]\nfactors = [\"f_q\", \"f_k\"]\nvalue = -0.7\n", "-n 100 --seed 3"),
        (melting, "-n 80 --sampling uniform --set pressure=1kPa"),
    ] {
        scratch.write("c/case.toml", case);
        let members: usize = sweep.split(' ').nth(1).and_then(|n| n.parse().ok()).expect("members");
        run(&scratch, &format!("uncertainty c {sweep} --max-failed {members} --out whole --quiet")).succeeded();
        let files = pieces(&scratch, sweep, &[(members / 2, members), (0, 1), (1, members / 2)]);
        run(&scratch, &format!("merge {} --out merged --max-failed {members}", files.join(" "))).succeeded();
        let (whole, merged) = (results(&scratch, "whole"), results(&scratch, "merged"));
        assert_eq!(whole, merged, "{sweep}");
        assert_eq!(merged.0["members"]["requested"], members);
        let page = scratch.read("merged/report.html");
        assert!(page.contains("Distribution of the peak temperatures"), "the page has its figures");
    }
    assert!(results(&scratch, "merged").0["members"]["failed"].as_u64().is_some_and(|failed| failed > 10));
    let files = "p/c-0-1.json p/c-1-40.json p/c-40-80.json";
    run(&scratch, &format!("merge {files} --max-failed 5")).exited_with(1).with_stderr(&["more than the allowed 5"]);
}

/// Members of the merged sweep are marched again; what else is stated of it is that of the whole sweep too.
#[test]
fn the_discretisation_error_of_a_merged_sweep_is_that_of_the_whole_at_corners_of_its_bounds() {
    let scratch = Scratch::new("pieces-error");
    let adapted = CASE.replacen("small = [0.8, 1.2]", "small = [0.8, 1.2]\nlarge = [0.3, 3.0]", 1);
    scratch.write("c/case.toml", adapted.replacen("cells = 16", "tolerance = \"0.05 K\"", 1));
    let sweep = "-n 60 --sampling-bounds large";
    run(&scratch, &format!("uncertainty c {sweep} --out whole --quiet")).succeeded();
    let files = pieces(&scratch, sweep, &[(0, 25), (25, 60)]);
    let merged = run(&scratch, &format!("merge {} --out merged", files.join(" "))).succeeded();
    let [whole, found] = ["whole", "merged"].map(|folder| results(&scratch, folder).0);
    for key in ["discretisation_error", "sweep_discretisation_error"] {
        assert!(found[key].is_object(), "{key}: {found:#}");
        assert_eq!(found[key], whole[key], "{key}");
    }
    assert_eq!(found["discretisation_error"]["bounds"], "large");
    assert_eq!(found["sweep_discretisation_error"]["others"]["members"], 16);
    let words = merged.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    for said in ["16 corners of the large bounds", "discretisation error of members is"] {
        assert!(words.contains(said), "no {said:?} in {}", merged.stdout);
    }
    // Negative control: corners of the small bounds have another error.
    run(&scratch, "uncertainty c -n 60 --out small --quiet").succeeded();
    let small = results(&scratch, "small").0;
    assert_ne!(small["discretisation_error"]["corners_k"], found["discretisation_error"]["corners_k"]);
}

#[test]
fn files_that_are_not_all_parts_of_one_sweep_are_refused_and_nothing_is_written() {
    let scratch = Scratch::new("pieces-refused");
    scratch.write("c/case.toml", CASE);
    let cuts = [(0, 20), (20, 40), (30, 60), (50, 60)];
    pieces(&scratch, "-n 60", &cuts);
    let p = |first: usize, end: usize| format!("p/c-{first}-{end}.json");
    let other = |sweep: &str, name: &str| {
        run(&scratch, &format!("uncertainty c {sweep} --members 20..60 --out q --quiet")).succeeded();
        std::fs::rename(scratch.path().join("q/c-20-60.json"), scratch.path().join(name)).expect("a piece");
        name.to_owned()
    };
    let version = format!("\"version\":{:?}", env!("CARGO_PKG_VERSION"));
    scratch.write("old.json", sealed(&scratch.read(&p(20, 40)), &version, "\"version\":\"0.0.9\""));
    let numbers = scratch.read(&p(20, 40)).split_once("\"numbers\":").expect("numbers").1[..40].to_owned();
    let other_numbers = numbers.replacen("[20,0,", "[19,1,", 1);
    scratch.write("numbers.json", sealed(&scratch.read(&p(20, 40)), &numbers, &other_numbers));
    let refusals = [
        (vec![p(0, 20), p(20, 40), p(30, 60)], "members 30..60 overlap another part, which ends at 40"),
        (vec![p(20, 40), p(0, 20), "numbers.json".to_owned()], "numbers.json: its members 20..40 have other numbers"),
        (vec![p(20, 40), p(0, 20), p(50, 60)], "no file has members 40..50 of all 60"),
        (vec![p(0, 20), p(20, 40)], "no file has members 40..60 of all 60"),
        (vec![p(20, 40), p(30, 60)], "no file has members 0..20 of all 60"),
        (vec![p(0, 20), other("-n 60 --seed 2", "seed.json")], "their samples differ, 60 members by normal, seed 2"),
        (vec![p(0, 20), other("-n 61", "drawn.json")], "their samples differ, 61 members by normal, seed 1"),
        (vec![p(0, 20), other("-n 60 --precision f32", "f32.json")], "their backends differ, cpu f32 and cpu f64"),
        (vec![p(0, 20), other("-n 60 --set pressure=1kPa", "set.json")], "their cases differ, c ("),
        (vec![p(0, 20), "old.json".to_owned()], "written by bondline 0.0.9, expected"),
        (vec!["c/case.toml".to_owned()], "c/case.toml\": not a file of a part of a sweep"),
        (vec!["p/none.json".to_owned()], "p/none.json\": no such file"),
    ];
    let given = scratch.files().len();
    for (files, said) in refusals {
        let words: Vec<&str> = ["merge"].into_iter().chain(files.iter().map(String::as_str)).collect();
        refused(&scratch, run_args(&scratch, &words), given, &[said]);
    }
}

#[test]
fn a_damaged_part_or_a_changed_case_is_refused() {
    let scratch = Scratch::new("pieces-case");
    scratch.write("c/case.toml", CASE);
    let line = format!("merge {}", pieces(&scratch, "-n 20", &[(0, 20)])[0]);
    let piece = scratch.read("p/c-0-20.json");
    let numbers = "p/c-0-20.json: damaged: its numbers do not agree";
    let damages = [
        ("\"numbers\":[20,", "\"numbers\":[19,", numbers),
        ("\"sampling\":\"normal\"", "\"sampling\":\"dice\"", "unknown variant `dice`, expected one of `normal`"),
        ("\"kept\":{\"0\":[", "\"kept\":{\"9999\":[", numbers),
        ("\"below_k\":[", "\"below_k\":[0.1,", numbers),
    ];
    for (from, to, message) in damages {
        scratch.write("p/c-0-20.json", sealed(&piece, from, to));
        refused(&scratch, run(&scratch, &line), 2, &[message]);
    }
    // Any other byte is noticed by the checksum.
    let mut random = Uniform(1);
    for _ in 0..40 {
        let mut bytes = piece.clone().into_bytes();
        let place = random.between(0.0, bytes.len() as f64) as usize;
        bytes[place] = if bytes[place] == b'7' { b'8' } else { b'7' };
        scratch.write("p/c-0-20.json", bytes);
        refused(&scratch, run(&scratch, &line), 2, &["p/c-0-20.json\": "]);
    }
    let digit = piece.rfind(|letter: char| letter.is_ascii_digit()).expect("a number");
    scratch.write("p/c-0-20.json", format!("{}{}", &piece[..digit], &piece[digit + 1..]));
    refused(&scratch, run(&scratch, &line), 2, &["damaged: the checksum of its content is ", ", expected "]);
    scratch.write("p/c-0-20.json", piece);
    scratch.write("c/case.toml", CASE.replacen("3 mm", "4 mm", 1));
    refused(&scratch, run(&scratch, &line), 2, &["is not the case of this file", "it has changed since"]);
    scratch.write("there/c/case.toml", CASE);
    run(&scratch, &format!("{line} --case there/c --json")).succeeded();
}

#[test]
fn an_invalid_range_of_members_is_refused_with_the_expected_form() {
    let scratch = Scratch::new("pieces-typed");
    scratch.write("c/case.toml", CASE);
    for (members, said) in [
        ("5", "'5' for '--members <A..B>': expected FIRST..END such as 0..2500"),
        ("a..b", "'a..b' for '--members <A..B>': expected FIRST..END"),
        ("20..10", "expected a first member before the end"),
        (
            "90..101",
            "--members 90..101: expected a first member before the end, and an end no higher than the 100 drawn",
        ),
    ] {
        refused(&scratch, run(&scratch, &format!("uncertainty c -n 100 --members {members}")), 1, &[said]);
    }
    refused(&scratch, run(&scratch, "uncertainty c --members 0..9 --json"), 1, &["cannot be used with"]);
}

/// 100,000 members under a memory limit that is smaller than their temperatures: ten sensors at 41 instants take 3.3 kB
/// per member.
#[test]
fn a_sweep_does_not_store_the_temperatures_of_its_members() {
    let scratch = Scratch::new("memory");
    let more: Vec<String> = (1..9).map(|n| format!("[[sensor]]\nname = \"D{n}\"\ndepth = \"0.{n} mm\"\n")).collect();
    let coarse = CASE.replacen("cells = 16", "cells = 8\nmax_step = \"4 s\"\nstep_growth = 1.0", 1);
    scratch.write("c/case.toml", coarse.replacen("[hot_face]", &(more.concat() + "\n[hot_face]"), 1));
    let members = 100_000;
    assert!(members * 10 * 41 * 8 > MEMORY_KIB * 1024, "the limit is larger than all temperatures");
    // The number of threads is fixed, as each reserves an arena of the allocator and a stack.
    let line = format!(
        "ulimit -v {MEMORY_KIB} && RAYON_NUM_THREADS=2 MALLOC_ARENA_MAX=1 \
         exec {} uncertainty c -n {members} --backend cpu --json",
        env!("CARGO_BIN_EXE_bondline")
    );
    let mut shell = std::process::Command::new("bash");
    let ran = wait_for(shell.current_dir(scratch.path()).args(["-c", &line])).succeeded();
    assert_eq!(ran.json()["members"]["ok"], members);
}
