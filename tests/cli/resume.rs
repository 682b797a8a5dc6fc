//! Interrupted sweeps: killed, stopped by a signal or a time limit, and resumed.

use super::{CASE, CommandResult, OBSERVATIONS, command, run, run_limited};
use crate::support::{Scratch, without_run};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Start a command.
pub(super) fn started(scratch: &Scratch, line: &str) -> Child {
    let mut command = command(scratch);
    let command = command.args(line.split_whitespace()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the binary starts")
}

/// Wait for the end of a command.
#[track_caller]
pub(super) fn ended(child: Child) -> CommandResult {
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let code = output.status.code().expect("it ends by itself");
    CommandResult { code, stdout: text(&output.stdout), stderr: text(&output.stderr) }
}

/// The files in a folder and hidden ones.
fn files(scratch: &Scratch, folder: &str) -> Vec<PathBuf> {
    let inside = scratch.files().into_iter().filter_map(|path| path.strip_prefix(folder).map(PathBuf::from).ok());
    inside.collect()
}

#[test]
fn a_part_of_a_sweep_that_is_killed_is_resumed_to_the_same_statistics() {
    let scratch = Scratch::new("killed-part");
    scratch.write("c/case.toml", CASE);
    let line = "uncertainty c -n 1000000 --members 10..1000000 --checkpoint-interval 0.02s --quiet --out p";
    let mut child = started(&scratch, line);
    wait_for_file(&scratch, "p/c-10-1000000.json.checkpoint/sweep.json");
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    let short = line.replace("10..1000000", "10..999999") + " --resume";
    assert_eq!(run(&scratch, &(short + " --limit-time 1s")).code, 1, "another part has no members to go on from");
    let refused = run(&scratch, line).exited_with(2);
    assert!(refused.stderr.contains("keeps members 10..") && refused.stderr.contains("--resume"), "{}", refused.stderr);
    let stopped = run(&scratch, &format!("{line} --resume --limit-time 0s")).exited_with(1);
    assert!(stopped.stderr.contains("stopped before there was an answer"), "{}", stopped.stderr);
}

#[track_caller]
fn wait_for_file(scratch: &Scratch, name: &str) {
    let start = Instant::now();
    while !scratch.path().join(name).exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "no {name} after a minute in {:?}", scratch.files());
        sleep(Duration::from_millis(5));
    }
}

/// Expect the report of some of the 100,000,000 members, and return their number.
#[track_caller]
fn partial(scratch: &Scratch, ended: &CommandResult) -> u64 {
    assert_eq!(ended.code, 1, "{}", ended.stderr);
    for said in ["stopped after ", " of 60000000 members: --resume goes on with the others"] {
        assert!(ended.stderr.contains(said), "{}", ended.stderr);
    }
    assert!(ended.stdout.contains("! The sweep was stopped after "), "{}", ended.stdout);
    let summary: Value = serde_json::from_str(&scratch.read("one/summary.json")).expect("JSON");
    let members = &summary["members"];
    let ok = members["ok"].as_u64().expect("a number");
    assert!((2..60_000_000).contains(&ok), "{members}");
    assert_eq!((&members["requested"], &members["failed"]), (&60_000_000.into(), &0.into()));
    assert!(scratch.read("one/report.html").contains("The sweep was stopped after "));
    ok
}

#[test]
fn a_time_limit_ends_a_sweep_with_an_answer_that_can_be_resumed_but_not_lost_by_accident() {
    let scratch = Scratch::new("limited");
    scratch.write("c/case.toml", CASE);
    let line = "uncertainty c -n 60000000 --keep members --out one";
    let first = partial(&scratch, &run_limited(&scratch, line));
    run(&scratch, line).exited_with(2).with_stderr(&[
        &format!("one.checkpoint keeps members 0..{first} of 60000000 of a run of 20"),
        "give --resume to go on, or --force to start anew",
    ]);
    let resumed = run_limited(&scratch, &format!("{line} --resume"));
    assert!(resumed.stderr.contains(&format!("keeps members 0..{first} of 60000000")), "{}", resumed.stderr);
    let second = partial(&scratch, &resumed);
    assert!(second > first, "{second} members after {first}");
    let other = run(&scratch, "uncertainty c -n 20 --resume --out one").exited_with(2);
    let differs = "another sweep: its samples 60000000 members by normal, seed 1, small bounds, expected 20 members";
    assert!(other.stderr.contains(differs), "{}", other.stderr);
    let without_rows = run(&scratch, &line.replace("--keep members", "--keep traces --resume")).exited_with(2);
    assert!(without_rows.stderr.contains("does not have the rows of its"), "{}", without_rows.stderr);
    run(&scratch, "uncertainty c -n 20 --force --out one").succeeded();
    assert!(
        scratch.files().iter().all(|path| path.starts_with("c") || path.starts_with("one")),
        "{:?}",
        scratch.files()
    );
    let nothing = run(&scratch, "uncertainty c -n 20 --resume --out one").succeeded();
    assert!(nothing.stderr.contains("keeps nothing: starting with the first"), "{}", nothing.stderr);
    let short = run(&scratch, "predict c --limit-time 0s --out two").exited_with(1);
    assert!(short.stderr.contains("stopped before there was an answer"), "{}", short.stderr);
    run(&scratch, "predict c --limit-time 5K --out two")
        .exited_with(2)
        .with_stderr(&["'5K' for '--limit-time <TIME>': wrong dimension"]);
}

#[test]
#[cfg(unix)]
fn an_interrupt_a_request_to_terminate_and_a_lost_terminal_end_a_sweep_with_an_answer() {
    for signal in ["INT", "TERM", "HUP"] {
        let scratch = Scratch::new(&format!("signal-{signal}"));
        scratch.write("c/case.toml", CASE);
        let child =
            started(&scratch, "uncertainty c -n 60000000 --checkpoint-interval 0.02s --limit-time 60s --out one");
        wait_for_file(&scratch, "one.checkpoint/sweep.json");
        let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
        assert!(sent.expect("kill is there").success());
        partial(&scratch, &ended(child));
        let hidden = |path: &&PathBuf| path.to_string_lossy().starts_with('.');
        assert_eq!(scratch.files().iter().filter(hidden).count(), 0, "{:?}", scratch.files());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_sweep_that_was_started_to_outlive_its_terminal_does() {
    let scratch = Scratch::new("nohup");
    scratch.write("c/case.toml", CASE);
    let binary = env!("CARGO_BIN_EXE_bondline");
    let sweep = format!("{binary} uncertainty c -n 60000000 --limit-time 6s --out one");
    let line = format!("trap '' HUP; {sweep} & for n in 1 2 3; do sleep 1; kill -HUP $! || exit 9; done; wait $!");
    let status = Command::new("bash").args(["-c", &line]).current_dir(scratch.path()).stdout(Stdio::null()).status();
    assert_eq!(status.expect("bash is there").code(), Some(1), "it ends by its limit of time");
}

#[test]
fn a_sweep_goes_on_when_only_texts_for_readers_have_changed() {
    let scratch = Scratch::new("noted");
    let noted = |text: &str| format!("note = \"{text}\"\n{}", CASE.replacen("Two plies", text, 1));
    scratch.write("c/case.toml", noted("as planned"));
    let line = "uncertainty c -n 60000000 --out one";
    run_limited(&scratch, line).exited_with(1);
    scratch.write("c/case.toml", noted("as run"));
    let resumed = run_limited(&scratch, &format!("{line} --resume"));
    assert!(resumed.stderr.contains("going on from there"), "{}", resumed.stderr);
    // Negative control: another name of a sensor changes the tables.
    scratch.write("c/case.toml", noted("as run").replace("TC1", "TC9"));
    run(&scratch, &format!("{line} --resume")).exited_with(2).with_stderr(&["another sweep: its cases"]);
}

/// Kill a study once it has kept finished work, and resume it. `other` is an option of another study.
#[track_caller]
fn resumed_to_the_same_bits(scratch: &Scratch, line: &str, file: &str, kept: &str, other: &str) {
    let line = format!("{line} --checkpoint-interval 0s --out");
    run(scratch, &format!("{line} whole/one")).succeeded();
    let mut child = started(scratch, &format!("{line} killed/one"));
    wait_for_file(scratch, &format!("killed/one.checkpoint/{file}"));
    child.kill().expect("it runs");
    child.wait().expect("it ends");
    run(scratch, &format!("{line} killed/one")).exited_with(2).with_stderr(&[kept, "give --resume to go on"]);
    let refused = run(scratch, &format!("{line} killed/one {other} --resume")).exited_with(2);
    assert!(refused.stderr.contains("of another study: case "), "{}", refused.stderr);
    let sweep = run(scratch, "uncertainty c -n 20 --out killed/one --resume").exited_with(2);
    assert!(sweep.stderr.contains("uncertainty has no "), "{}", sweep.stderr);
    let path = scratch.path().join("killed/one.checkpoint").join(file);
    let sound = fs::read(&path).expect("finished work");
    let mut changed = sound.clone();
    changed[sound.len() / 2] ^= 1;
    fs::write(&path, changed).expect("a file of this test");
    run(scratch, &format!("{line} killed/one --resume")).exited_with(2).with_stderr(&[file]);
    fs::write(&path, sound).expect("a file of this test");
    let ended = run(scratch, &format!("{line} killed/one --resume")).succeeded();
    assert!(ended.stderr.contains("going on from there"), "{}", ended.stderr);
    let summary = |folder: &str| without_run(serde_json::from_str(&scratch.read(folder)).expect("JSON"));
    assert_eq!(summary("killed/one/summary.json"), summary("whole/one/summary.json"));
    let names = files(scratch, "killed");
    assert_eq!(names, files(scratch, "whole"));
    for name in names.iter().filter(|name| name.extension().is_some_and(|kind| kind == "csv" || kind == "svg")) {
        let content = |folder: &str| fs::read(scratch.path().join(folder).join(name)).expect("a file of the report");
        assert!(content("killed") == content("whole"), "{}", name.display());
    }
}

/// 128 data sets are fitted at a time, so that the first block is kept before the second is complete.
#[test]
fn a_coverage_study_that_is_killed_goes_on_from_its_fits_to_the_same_bits() {
    let scratch = Scratch::new("killed-study");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    resumed_to_the_same_bits(&scratch, "twin c --study 300", "fits.json", "keeps data sets 0..", "--seed 2");
    run(&scratch, "twin c --resume")
        .exited_with(2)
        .with_stderr(&["--resume: it is for the report of a study, with --study N"]);
    run(&scratch, "twin c --limit-time 1s").exited_with(2);
}

#[test]
fn a_posterior_that_is_killed_goes_on_from_its_iterations_to_the_same_bits() {
    let scratch = Scratch::new("killed-posterior");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    let line = "estimate c --posterior --walkers 60 --mcmc-iterations 800";
    resumed_to_the_same_bits(&scratch, line, "iterations.json", "keeps iterations 0..", "--seed 2");
    run(&scratch, "estimate c --resume").exited_with(2).with_stderr(&["--resume: without --posterior nothing is kept"]);
}

#[test]
fn a_sizing_that_is_killed_goes_on_from_its_marches_to_the_same_bits() {
    let scratch = Scratch::new("killed-sizing");
    scratch.write("c/case.toml", CASE);
    let line = "size c --ply BASE --limit TC2<480K --probability 0.9 -n 10000";
    resumed_to_the_same_bits(&scratch, line, "marches.json", "keeps marches 0..", "--seed 2");
}

#[test]
fn a_trade_study_that_is_killed_goes_on_from_its_marches_to_the_same_bits() {
    let scratch = Scratch::new("killed-trade");
    scratch.write("c/case.toml", CASE);
    let line = "trade c --ply BASE=saffil-96,apa --size BASE --limit TC2<480K --probability 0.9 -n 5000";
    resumed_to_the_same_bits(&scratch, line, "marches.json", "keeps marches 0..", "--seed 2");
}
