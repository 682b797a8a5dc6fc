//! Limits of input: absurd sizes, endless files, control characters and output that cannot be written.

use super::input_errors::refused;
use super::{CASE, CommandResult, OBSERVATIONS, command, run, run_args, wait_for};
use crate::support::{Scratch, root, runs_all, text};
use bondline::limits::{LIMITS, Limit, STARTS, STATISTICS_MIB, STEPS, TEMPERATURES};
use std::process::Command;

/// Memory, KiB, and time, s, in which every input is answered or refused.
const MEMORY_KIB: usize = 2 * 1024 * 1024;
const SECONDS: usize = 20;

/// Run the binary under the limits of memory and time: exit code 124 means that it ran out of time.
fn run_bounded(scratch: &Scratch, line: &str) -> CommandResult {
    run_within(scratch, SECONDS, line)
}

fn run_within(scratch: &Scratch, seconds: usize, line: &str) -> CommandResult {
    // The number of threads is fixed, as each reserves an arena of the allocator and a stack.
    let binary = env!("CARGO_BIN_EXE_bondline");
    let line = format!(
        "ulimit -v {MEMORY_KIB} && RAYON_NUM_THREADS=2 MALLOC_ARENA_MAX=1 exec timeout {seconds} {binary} {line}"
    );
    wait_for(shell(scratch).args(["-c", &line]))
}

fn shell(scratch: &Scratch) -> Command {
    let mut shell = Command::new("bash");
    shell.current_dir(scratch.path()).env("XDG_RUNTIME_DIR", scratch.path());
    shell
}

#[test]
fn threads_of_the_environment_that_no_machine_has_or_that_are_no_number_are_refused() {
    let scratch = Scratch::new("limits-threads");
    scratch.write("c/case.toml", CASE);
    for (threads, message) in [
        ("1000000000", "RAYON_NUM_THREADS=1000000000: expected at most 1,024 threads, found 1,000,000,000"),
        ("1025", "RAYON_NUM_THREADS=1025: expected at most 1,024 threads, found 1,025"),
        ("two", "RAYON_NUM_THREADS=two: expected a number of threads"),
        ("-1", "RAYON_NUM_THREADS=-1: expected a number of threads"),
    ] {
        for line in ["predict c", "verify --group exact", "merge c", "devices"] {
            let mut command = command(&scratch);
            let ran = wait_for(command.args(line.split(' ')).env("RAYON_NUM_THREADS", threads));
            refused(&scratch, ran, 1, &[message]);
        }
    }
}

#[test]
fn absurd_values_of_a_case_are_refused_with_the_limit() {
    let scratch = Scratch::new("limits-values");
    scratch.write("c/case.toml", CASE);
    for (sets, message) in [
        ("resolution.first_step='10 s'", "expected a first step of at most 0.5 s, the largest step, found 10 s"),
        (
            "ply.TOP.thickness='5e-19 m'",
            "layup.plies[0].thickness_m: expected at most 1,000,000 times the thickness of a ply for the layup, found \
             6.0e15",
        ),
        ("duration='1e7 s'", "expected at most 100,000 output intervals of a case, found 10,000,000"),
        (
            "duration='1e7 s' --set resolution.output_interval='1000 s'",
            "expected at most 1,000,000 time steps of a march, found 20,0",
        ),
        (
            "resolution.first_step='1e-9 s' --set resolution.max_step='1e-9 s'",
            "expected at most 1,000,000 time steps of a march, found 4.0e10 with a first step of 0.000000001 s",
        ),
        (
            "resolution.max_step='5e-5 s' --set resolution.first_step='5e-5 s' --set resolution.cells=1000",
            "expected at most 200,000,000 cells times time steps of a march, found 8",
        ),
        ("resolution.cells=1025", "expected a whole number of cells from 8 to 1024, found 1025"),
    ] {
        refused(&scratch, run_bounded(&scratch, &format!("predict c --set {sets}")), 1, &[message]);
    }
}

#[test]
fn too_many_plies_sensors_keys_columns_and_errors_are_refused_or_counted() {
    let scratch = Scratch::new("limits-counts");
    let plies = |count: usize| -> String {
        let ply = |n| format!("[[ply]]\nname = \"P{n}\"\nmaterial = \"pyrogel3350\"\nthickness = \"1 mm\"\n");
        (0..count).map(ply).collect()
    };
    let sensors = |count: usize| -> String {
        (0..count).map(|n| format!("[[sensor]]\nname = \"S{n}\"\ndepth = \"{} um\"\n", 2 * n + 1)).collect()
    };
    let keys = |count: usize| -> String { (0..count).map(|n| format!("key{n} = 1\n")).collect() };
    for (text, message) in [
        (CASE.to_owned() + &plies(500), "expected at most 256 plies, found 502"),
        (CASE.to_owned() + &sensors(1000), "expected at most 128 sensors, found 1,002"),
        (keys(100_000) + CASE, "expected at most 1,000 keys of one table of a case, material or gas file, found 100,0"),
        (keys(1_000_000) + CASE, "c/case.toml: expected at most 4 MiB of a case, material or gas file"),
        (keys(900) + CASE, "unknown key \"key0\""),
        (
            CASE.to_owned() + &format!("[observations]\nTC1 = [{}]\n", "1,".repeat(100_001)),
            "expected at most 100,000 items of one list of a case, material or gas file, found 100,001",
        ),
        (
            CASE.to_owned() + &format!("[observations]\nsigma = \"1 K\"\nTC1 = [{}]\n", "1,".repeat(2000)),
            "1000 errors, and 1000 more that are not listed",
        ),
    ] {
        scratch.write("c/case.toml", text);
        refused(&scratch, run_bounded(&scratch, "predict c"), 1, &[message]);
    }
    let header: Vec<String> = (0..200_000).map(|n| format!("TC{n}_K")).collect();
    let row = ",300".repeat(200_000);
    scratch.write("c/measured.csv", format!("time_s,{}\n0{row}\n", header.join(",")));
    scratch.write("c/case.toml", CASE.to_owned() + "[observations]\nsigma = \"1 K\"\nfile = \"measured.csv\"\n");
    let message = "c/measured.csv:1:1: expected at most 1,000 columns of a table file, found 200,001";
    refused(&scratch, run_bounded(&scratch, "predict c"), 2, &[message]);
}

#[test]
fn as_many_plies_and_sensors_as_the_limits_allow_are_computed() {
    let scratch = Scratch::new("limits-most");
    let head = CASE.split_once("[[ply]]").expect("a ply").0;
    let plies: String = (0..256)
        .map(|n| {
            format!("[[ply]]\nname = \"P{n}\"\ngroup = \"INS\"\nmaterial = \"pyrogel3350\"\nthickness = \"0.1 mm\"\n")
        })
        .collect();
    let sensors: String =
        (0..128).map(|n| format!("[[sensor]]\nname = \"TC{n}\"\ndepth = \"{} um\"\n", 200 * n + 50)).collect();
    let rest = &CASE[CASE.find("[hot_face]").expect("a face")..];
    let resolution = "cells = 1024\nmax_step = \"4 s\"\nstep_growth = 1.0";
    scratch.write("c/case.toml", format!("{head}{plies}{sensors}{}", rest.replacen("cells = 16", resolution, 1)));
    run_bounded(&scratch, "predict c --backend cpu --quiet").succeeded();
    run_bounded(&scratch, "uncertainty c -n 64 --backend cpu --quiet").succeeded();
}

/// Time, s, of a large request on a busy machine.
const LONG_SECONDS: usize = 300;

/// Each command at the limit that governs its memory, and just beyond it.
#[test]
fn the_largest_requests_fit_into_2_gib() {
    let scratch = Scratch::new("limits-memory");
    let more: String =
        (0..126).map(|n| format!("[[sensor]]\nname = \"S{n}\"\ndepth = \"{} um\"\n", 20 * n + 10)).collect();
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    scratch.write("many/case.toml", CASE.replacen("[hot_face]", &(more + "[hot_face]"), 1));
    let lcat = root().join("cases/lcat-2259").display().to_string();
    let long = |line: &str| run_within(&scratch, LONG_SECONDS, &format!("{line} --backend cpu --quiet"));
    let beyond = |line: &str, limit: &Limit| {
        long(line).exited_with(2).with_stderr(&[&format!("expected at most {limit}, found ")]);
    };

    let every = |interval: &str| format!("sensitivity many --set resolution.output_interval='{interval}'");
    long(&every("5.13 ms")).succeeded();
    beyond(&every("5.1 ms"), &TEMPERATURES);

    let cells = if runs_all() { 190 } else { 16 };
    let step = |step: &str| {
        let steps = format!("--set resolution.first_step='{step}' --set resolution.max_step='{step}'");
        format!("predict c --set resolution.cells={cells} {steps}")
    };
    long(&step("0.0405 ms")).succeeded();
    beyond(&step("0.039 ms"), &STEPS);

    let (half, all) = if runs_all() { (1000, 2000) } else { (40, 80) };
    let sweep = |interval: &str, part: &str| {
        let interval = format!("--set resolution.output_interval='{interval}'");
        format!("uncertainty {lcat} -n {all} --members {part} {interval} --checkpoint-interval 0s --out p")
    };
    long(&sweep("0.088 s", &format!("0..{half}"))).succeeded();
    long(&sweep("0.088 s", &format!("{half}..{all}"))).succeeded();
    beyond(&sweep("0.086 s", &format!("0..{half}")), &STATISTICS_MIB);
    let parts = format!("merge p/lcat-2259-0-{half}.json p/lcat-2259-{half}-{all}.json");
    run_within(&scratch, LONG_SECONDS, &parts).succeeded();

    if runs_all() {
        long("estimate c --starts 10000").succeeded();
    }
    beyond("estimate c --starts 10001", &STARTS);
}

#[test]
fn a_request_beyond_memory_is_refused_with_the_limit() {
    let scratch = Scratch::new("limits-requests");
    let more: String =
        (0..100).map(|n| format!("[[sensor]]\nname = \"S{n}\"\ndepth = \"{} um\"\n", 30 * n + 10)).collect();
    scratch.write("c/case.toml", CASE);
    scratch.write("many/case.toml", CASE.replacen("[hot_face]", &(more + "[hot_face]"), 1));
    for (line, message) in [
        ("uncertainty c -n 1000000000", "-n: expected at most 67,108,864 members of a sweep, found 1,000,000,000"),
        (
            "uncertainty many --set resolution.output_interval='10 ms'",
            "expected at most 256 MiB of statistics of a sweep, found",
        ),
        ("predict many --set resolution.output_interval='1 ms'", "expected at most 1,000,000 temperatures of a member"),
    ] {
        refused(&scratch, run_bounded(&scratch, line), 2, &[message]);
    }
}

#[test]
fn pipes_and_endless_files_are_refused_wherever_a_file_is_read() {
    let scratch = Scratch::new("limits-pipes");
    scratch.write("c/case.toml", CASE.replacen("\"pyrogel3350\"", "{ file = \"pipe\" }", 1));
    let flux = CASE.lines().find(|line| line.starts_with("flux = ")).expect("a flux");
    scratch.write("d/case.toml", CASE.replacen(flux, "flux = { file = \"pipe\" }", 1));
    scratch.write("e/case.toml", CASE.replacen("\"pyrogel3350\"", "{ file = \"/dev/zero\" }", 1));
    let made = shell(&scratch).args(["-c", "mkfifo pipe c/pipe d/pipe"]).status().expect("mkfifo starts");
    assert!(made.success());
    for line in [
        "predict pipe",
        "predict /dev/zero",
        "predict c",
        "predict d",
        "predict e",
        "materials check pipe",
        "materials check /dev/zero",
        "merge pipe",
        "merge /dev/zero",
    ] {
        refused(&scratch, run_bounded(&scratch, line), 6, &["expected a regular file, found a pipe, socket or device"]);
    }
}

#[test]
fn control_characters_of_names_paths_and_arguments_do_not_reach_the_terminal() {
    let scratch = Scratch::new("limits-escapes");
    scratch.write("c/case.toml", CASE.replacen("Two plies", "red \\u001b[31m \\u009b2J \\u202e", 1));
    scratch.write("d\u{1b}[31m/case.toml", CASE.replacen("pyrogel3350", "py\\u001brogel", 1));
    let is_clean = |text: &str| !text.contains(|c: char| c.is_control() && c != '\n' && c != '\t');
    for arguments in
        [["predict", "c"], ["predict", "d\u{1b}[31m"], ["predict", "no\u{1b}]0;such"], ["predict", "--\u{9b}2J"]]
    {
        let ran = run_args(&scratch, &arguments).exited_with(2);
        assert!(is_clean(&ran.stderr) && ran.stderr.contains("\\u"), "{:?}", ran.stderr);
    }
}

#[test]
fn output_into_a_full_device_is_an_error_and_into_a_closed_pipe_is_not() {
    let scratch = Scratch::new("limits-full");
    scratch.write("c/case.toml", CASE);
    let lines =
        ["predict c --backend cpu --json", "--help", "twin --help", "--version", "completions bash", "man pages"];
    for line in lines {
        let line = format!("{} {line}", env!("CARGO_BIN_EXE_bondline"));
        let full = wait_for(shell(&scratch).args(["-c", &format!("{line} > /dev/full")]));
        full.exited_with(1).with_stderr(&["standard output cannot be written: No space left on device"]);
        let closed = wait_for(shell(&scratch).args(["-c", &format!("{line} | true; exit ${{PIPESTATUS[0]}}")]));
        assert_eq!(closed.succeeded().stderr, "", "{line}");
    }
}

#[test]
fn an_output_folder_that_cannot_be_made_is_refused_before_the_work() {
    let scratch = Scratch::new("limits-out");
    scratch.write("c/case.toml", CASE);
    // No such device: the work would fail in another way.
    for line in [
        "predict c --backend gpu --device none --out c/case.toml/out",
        "twin c --backend gpu --device none --out c/case.toml/measured.csv",
        "merge nothing.json --out c/case.toml/out",
    ] {
        refused(&scratch, run(&scratch, line), 1, &["c/case.toml"]);
    }
}

/// A million steps need 192 MB of schedules in double precision, more than one binding of the software rasteriser.
#[test]
fn a_plan_that_exceeds_a_binding_of_the_device_is_marched_on_the_processor() {
    let scratch = Scratch::new("limits-binding");
    scratch.write("c/case.toml", CASE);
    let steps = "--set resolution.first_step=0.045ms --set resolution.max_step=0.045ms";
    let ran = run(&scratch, &format!("predict c --backend gpu --device llvmpipe --precision f64 --json {steps}"));
    let summary = ran.succeeded().stdout;
    assert!(summary.contains("boundary_forcing exceed the limit of 134217728 bytes of one binding"), "{summary}");
}

#[test]
fn the_tables_of_limits_in_the_documentation_are_those_of_the_source() {
    let expected: Vec<String> =
        LIMITS.iter().map(|limit| format!("| {} |", limit.to_string().replacen(' ', " | ", 1))).collect();
    for page in ["cases/README.md", "docs/reference/limits.md"] {
        let text = text(page);
        let (_, table) = text.split_once("| at most | of |\n|---:|---|\n").expect("the table of limits");
        let rows: Vec<&str> = table.lines().take_while(|line| line.starts_with('|')).collect();
        assert_eq!(rows, expected, "{page}");
    }
}
