//! The built binary: its output, files and exit codes.

mod data_selection; // windows and standard deviations of single thermocouples
mod devices; // devices, missing backends, materials, verification
mod estimates; // several cases, losses, priors, multi-start, profiles, posterior
mod help; // examples, completions, manual pages, old names of options and keys
mod history; // inverse heat conduction: output, numbers, a file that a case reads
mod imports; // material files from tables and from other programs
mod init; // templates
mod input_errors; // exit code 2: errors with their location, nothing written
mod limits; // sizes, endless files, control characters, output that cannot be written
pub(crate) mod merge; // parts of a sweep and their merging; bounded memory
mod names; // names that users choose: tables and the screen
mod observations; // what was read of a messy workbook, up to an estimate; a noisy driver
mod options_without_effect; // exit code 2: options and keys that change nothing
mod outputs; // one writer at a time, whole reports, nothing left over
mod repeat; // a report whose question is asked again: the same bits, or what has changed
mod resume; // sweeps that were killed, stopped and resumed
mod sizing_and_coverage; // sizing and coverage studies; independence of the number of threads
mod studies; // predict, uncertainty, sensitivity, estimate, study, twin
mod synthetic_observations; // committed synthetic observations, made again
mod trials; // kills, races and full disks at random moments
mod walk; // every option of every command has an effect; every file that is written

use crate::support::Scratch;
use std::ffi::OsStr;
use std::process::{Command, Output};

/// Two plies under a heater, with a coarse grid and a short duration: the case of these tests.
pub(crate) const CASE: &str = r#"name = "Two plies"
initial_temperature = "300 K"
contact_conductance = "500 W/m^2/K"
duration = "40 s"

[[ply]]
name = "TOP"
group = "OF"
material = "nextel440_bf20"
thickness = "0.5 mm"

[[ply]]
name = "BASE"
group = "INS"
material = "pyrogel3350"
thickness = "3 mm"

[[sensor]]
name = "TC1"
below = "TOP"

[[sensor]]
name = "TC2"
depth = "2 mm"

[hot_face]
kind = "heated"
flux = { points = [["0 s", "0 W/cm^2"], ["1 s", "5 W/cm^2"]], outside = "hold" }

[[factor]]
name = "f_k"
group = "INS"
property = "conductivity"
small = [0.8, 1.2]

[[factor]]
name = "f_q"
property = "heating"
small = [0.9, 1.1]

[estimate]
factors = ["f_k"]
sensors = ["TC2"]
window = ["0 s", "30 s"]

[resolution]
cells = 16
output_interval = "1 s"
"#;

/// Observations to append to the case: few, and far from its prediction.
pub(crate) const OBSERVATIONS: &str = r#"
[observations]
sigma = "2 K"
TC2 = [["0 s", "300 K"], ["10 s", "320 K"], ["20 s", "420 K"], ["30 s", "500 K"]]
"#;

/// The case with an insulator that decomposes.
pub(crate) fn decomposing_case() -> String {
    "decomposition = true\n".to_owned() + CASE
}

/// Exit code and output of a run of the binary.
pub(crate) struct CommandResult {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Run the binary in a folder.
fn run_args<S: AsRef<OsStr>>(scratch: &Scratch, arguments: &[S]) -> CommandResult {
    wait_for(command(scratch).args(arguments))
}

/// Run the binary in a folder with arguments separated by blanks. A no-break space is part of an argument.
pub(crate) fn run(scratch: &Scratch, words: &str) -> CommandResult {
    run_args(scratch, &words.split_ascii_whitespace().collect::<Vec<_>>())
}

/// Run a line with a time limit in which some members complete: one second, more on a busy machine.
fn run_limited(scratch: &Scratch, words: &str) -> CommandResult {
    let limited = [1, 4, 16].map(|limit_s| format!("{words} --limit-time {limit_s}s"));
    let mut results = limited.iter().map(|line| run(scratch, line));
    results.find(|result| !result.stderr.contains("stopped before there was an answer")).expect("an answer in 16 s")
}

/// Run the binary with environment variables.
pub(crate) fn run_with(scratch: &Scratch, words: &str, variables: &[(&str, &str)]) -> CommandResult {
    let mut command = command(scratch);
    wait_for(command.envs(variables.iter().copied()).args(words.split_ascii_whitespace()))
}

/// Run the binary where no Vulkan driver can be found.
fn run_without_vulkan(scratch: &Scratch, words: &str) -> CommandResult {
    let mut command = command(scratch);
    command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
    wait_for(command.args(words.split_whitespace()))
}

/// The binary in a folder. Without a runtime folder, Mesa would print a warning to standard error.
fn command(scratch: &Scratch) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bondline"));
    command.current_dir(scratch.path()).env("XDG_RUNTIME_DIR", scratch.path());
    command
}

fn wait_for(command: &mut Command) -> CommandResult {
    let Output { status, stdout, stderr } = command.output().expect("the binary starts");
    let text = |bytes| String::from_utf8(bytes).expect("text in UTF-8");
    CommandResult { code: status.code().expect("it ends by itself"), stdout: text(stdout), stderr: text(stderr) }
}

impl CommandResult {
    /// Expect exit code 0.
    #[track_caller]
    pub(crate) fn succeeded(self) -> Self {
        self.exited_with(0)
    }

    #[track_caller]
    pub(crate) fn exited_with(self, code: i32) -> Self {
        assert_eq!(self.code, code, "standard output:\n{}\nstandard error:\n{}", self.stdout, self.stderr);
        self
    }

    /// Expect each of these texts on standard error.
    #[track_caller]
    pub(crate) fn with_stderr(self, fragments: &[&str]) -> Self {
        for fragment in fragments {
            assert!(self.stderr.contains(fragment), "no {fragment:?} in:\n{}", self.stderr);
        }
        self
    }

    /// Standard output, parsed as JSON.
    #[track_caller]
    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error} in:\n{}", self.stdout))
    }
}
