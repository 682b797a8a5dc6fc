//! The output folder: one writer at a time, whole reports, nothing left over.

use super::{CASE, command, run};
use crate::support::Scratch;
use std::fs;
use std::path::PathBuf;
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Wait until something is there, at most a minute.
#[track_caller]
fn wait_until(what: &str, is_there: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_there() {
        assert!(start.elapsed() < Duration::from_secs(60), "no {what} after a minute");
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_second_writer_of_one_folder_is_refused_and_a_killed_one_leaves_nothing_after_the_next_run() {
    let scratch = Scratch::new("writers");
    scratch.write("c/case.toml", CASE);
    let short = "uncertainty c -n 20 --keep members --quiet --out one";
    run(&scratch, short).succeeded();
    scratch.write("one/notes.txt", "mine");
    let summary = scratch.read("one/summary.json");
    let files = scratch.files();
    let long = "uncertainty c -n 60000000 --keep members --quiet --out one";
    let mut first = command(&scratch);
    let mut first = first.args(long.split_whitespace()).stderr(Stdio::null()).spawn().expect("the binary starts");
    let lock = scratch.path().join(".one.lock");
    let is_locked = || fs::read_to_string(&lock).is_ok_and(|holder| holder.ends_with('\n'));
    wait_until("lock", is_locked);
    let holder = format!("\"one\" is being written by process {} on ", first.id());
    run(&scratch, short).exited_with(2).with_stderr(&[&holder, " since 20", "choose another folder (--out)"]);
    run(&scratch, "uncertainty c -n 20 --members 0..5 --out one").exited_with(2).with_stderr(&[&holder]);
    let is_staged = |path: &PathBuf| path.to_string_lossy().ends_with(".partial");
    wait_until("temporary file", || scratch.files().iter().any(is_staged));
    first.kill().expect("it runs");
    first.wait().expect("it ends");
    assert_eq!(scratch.read("one/summary.json"), summary, "a killed run changed the report");
    assert!(scratch.files().len() > files.len(), "the killed run left nothing to sweep");
    run(&scratch, short).succeeded();
    assert_eq!(scratch.files(), files);
    assert_eq!(scratch.read("one/notes.txt"), "mine");
}

#[test]
fn a_folder_of_files_of_the_user_keeps_them_when_it_is_the_working_directory() {
    let scratch = Scratch::new("here");
    scratch.write("case.toml", CASE);
    for _ in 0..2 {
        run(&scratch, "predict . --out . --quiet --set pressure=1kPa").succeeded();
        assert!(scratch.path().join("report.html").exists() && scratch.path().join("figures/nominal.svg").exists());
        assert!(scratch.read("case.toml").starts_with("name"));
        assert!(!scratch.files().iter().any(|path| path.to_string_lossy().starts_with('.')), "{:?}", scratch.files());
    }
}

/// The device of a full disk accepts no byte.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error_and_the_earlier_report_stays() {
    let scratch = Scratch::new("full");
    scratch.write("c/case.toml", CASE);
    run(&scratch, "predict c --quiet --out one").succeeded();
    let files = scratch.files();
    let summary = scratch.read("one/summary.json");
    // The limit of a file's size stands for the end of the disk.
    let line =
        format!("trap '' XFSZ; ulimit -f 100 && exec {} predict c --quiet --out one", env!("CARGO_BIN_EXE_bondline"));
    let mut shell = std::process::Command::new("bash");
    super::wait_for(shell.current_dir(scratch.path()).args(["-c", &line])).exited_with(1).with_stderr(&["writing"]);
    assert_eq!(scratch.read("one/summary.json"), summary);
    assert_eq!(scratch.files(), files);
}
