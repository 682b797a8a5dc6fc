//! Every option of every command changes what the command prints or writes, or is refused with the reason; and what a
//! command writes lies in its own place. Commands, options and values are those that the program describes itself, so
//! that a new one without evidence in `rows.rs` fails.

mod rows;

use super::{CASE, command, wait_for};
use crate::support::{Scratch, files, runs_all, text};
use bondline::command::args::Cli;
use rayon::prelude::*;
use rows::{COMMANDS, Evidence, ROWS, Row, WalkedCommand};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Readings near those of the case with other factors.
const OBSERVED: &str = r#"
[observations]
sigma = "2 K"
TC1 = [["0 s", "299 K"], ["5 s", "613 K"], ["10 s", "808 K"], ["15 s", "904 K"], ["20 s", "956 K"], ["45 s", "1050 K"]]
TC2 = [["0 s", "302 K"], ["5 s", "317 K"], ["10 s", "431 K"], ["15 s", "582 K"], ["20 s", "697 K"], ["35 s", "936 K"]]
"#;

/// A material whose table ends below the temperatures of some members.
const SHORT: &str = "name = \"Short\"\n[density]\nvalue = \"170 kg/m^3\"\n[heat_capacity]\n\
                     temperatures_k = [250, 1070]\nvalues = [1000, 1100]\nunit = \"J/kg/K\"\noutside = \"error\"\n\
                     [conductivity]\nvalue = \"0.03 W/m/K\"\n[emissivity]\nvalue = 0.9\n";

/// A line of a material of PATO.
const K_COEFFICIENT: &str = "kkCoef          [0 0 0 0 0 0 0]         2;";

/// Options after which a run ends before it has an answer.
const EARLY: [&str; 4] = ["limit-time", "backend", "device", "force"];

/// Two values of an option whose outputs are the same, with the reason.
const SAME_VALUES: &[(&str, [&str; 2], &str)] = &[("backend", ["auto", "cpu"], "a short run is on the CPU")];

/// Pairs of options of which one has no effect beside the other and is not refused, with the reason.
const IDLE_PAIRS: &[(&str, &str, &str)] = &[];

/// Largest file of a full disk, KiB: locks are smaller, all files of a report are larger. Material files are small.
const FULL_KIB: usize = 1;
const FULL_KIB_OF_MATERIALS: usize = 0;

/// What is there before a run: cases, a table and a folder to import.
fn inputs() -> BTreeMap<String, Vec<u8>> {
    let bounds = CASE.replacen("small = [0.8, 1.2]", "small = [0.8, 1.2]\nlarge = [0.6, 1.5]", 1);
    let bounds = bounds.replacen("small = [0.9, 1.1]", "small = [0.9, 1.1]\nlarge = [0.7, 1.4]", 1);
    let mut found = BTreeMap::from([
        ("c/case.toml".to_owned(), format!("{bounds}{OBSERVED}").into_bytes()),
        ("d/case.toml".to_owned(), format!("{bounds}{OBSERVED}").replace("3 mm", "3.2 mm").into_bytes()),
        ("fails/case.toml".to_owned(), bounds.replace("pyrogel3350", "short").into_bytes()),
        ("fails/materials/short.toml".to_owned(), SHORT.into()),
        ("felt.toml".to_owned(), SHORT.into()),
        ("felt.csv".to_owned(), text("data/import/felt.csv").into_bytes()),
    ]);
    // A material of PATO, and one whose conductivity depends on the direction.
    for path in files("data/import/pato", "") {
        let (name, text) = (path.trim_start_matches("data/import/pato/"), text(&path));
        let other = text.replace("kjCoef ", "other ").replace(K_COEFFICIENT, &K_COEFFICIENT.replace("2;", "3;"));
        found.insert(format!("resin/{name}"), text.into_bytes());
        found.insert(format!("anisotropic/{name}"), other.into_bytes());
    }
    found
}

/// What a run printed and wrote, without what differs between two runs of one line.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    code: i32,
    stdout: String,
    stderr: String,
    files: BTreeMap<String, Vec<u8>>,
}

/// A folder with the inputs, in which a command runs without a Vulkan driver.
struct Place {
    scratch: Scratch,
    inputs: BTreeMap<String, Vec<u8>>,
}

impl Place {
    fn new(name: &str) -> Self {
        let place = Self { scratch: Scratch::new(name), inputs: inputs() };
        place.inputs.iter().for_each(|(path, bytes)| drop(place.scratch.write(path, bytes)));
        place
    }

    fn command(&self, line: &str) -> Command {
        let mut command = command(&self.scratch);
        command.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        command.args(line.split_ascii_whitespace());
        command
    }

    fn run(&self, line: &str) -> Seen {
        self.prepare(line);
        let ran = wait_for(&mut self.command(line));
        let own = self.scratch.path().display().to_string();
        let plain = |text: &str| text.lines().map(|line| without_seconds(line) + "\n").collect::<String>();
        let stdout = match serde_json::from_str(&ran.stdout) {
            Ok(value) => without_run(value).to_string(),
            Err(_) => plain(&ran.stdout),
        };
        let (stdout, stderr) = (stdout.replace(&own, "."), plain(&ran.stderr).replace(&own, "."));
        Seen { code: ran.code, stdout, stderr, files: self.new_files() }
    }

    /// Make the pieces of a sweep that a line merges, and the reports that it repeats.
    fn prepare(&self, line: &str) {
        for report in ["p/r", "p/s"].iter().filter(|_| line.starts_with("repeat ")) {
            let made = wait_for(&mut self.command(&format!("predict c --quiet --out {report}")));
            assert_eq!(made.code, 0, "{}", made.stderr);
        }
        for (folder, case, pieces) in [("p", "c -n 20", ["0..10", "10..20"]), ("q", "fails -n 40", ["0..20", "20..40"])]
        {
            for piece in pieces.iter().filter(|_| line.starts_with(&format!("merge {folder}/"))) {
                let made = wait_for(&mut self.command(&format!("uncertainty {case} --members {piece} --out {folder}")));
                assert_eq!(made.code, 0, "{}", made.stderr);
            }
        }
    }

    /// Files that are no inputs, or have changed. Pages and pieces have the time of the run: only their names count.
    fn new_files(&self) -> BTreeMap<String, Vec<u8>> {
        let mut found = BTreeMap::new();
        for path in self.scratch.files() {
            let name = path.to_string_lossy().into_owned();
            let bytes = fs::read(self.scratch.path().join(&path)).expect("a file of this test");
            if self.inputs.get(&name) == Some(&bytes) {
                continue;
            }
            let bytes = match name.rsplit('.').next() {
                Some("html") => Vec::new(),
                // The question of a report has the path of its case, and the checksums of pieces.
                Some("toml") => {
                    let own = self.scratch.path().display().to_string();
                    let text = String::from_utf8_lossy(&bytes).replace(&own, ".");
                    let lines = text.lines().filter(|line| !line.starts_with("sha256"));
                    lines.collect::<Vec<_>>().join("\n").into_bytes()
                }
                Some("json") => serde_json::from_slice(&bytes).map_or(bytes, |value| {
                    let value = without_run(value);
                    if name.ends_with("summary.json") { value.to_string().into_bytes() } else { Vec::new() }
                }),
                _ => bytes,
            };
            found.insert(name, bytes);
        }
        found
    }
}

/// A summary without times, command line, checksum and input files, of which pieces have the time of their run.
fn without_run(mut summary: Value) -> Value {
    if let Some(keys) = summary.as_object_mut() {
        ["seconds", "checksum"].iter().for_each(|key| drop(keys.remove(*key)));
        if let Some(run) = keys.get_mut("provenance").and_then(Value::as_object_mut) {
            ["date", "command_line", "threads", "input_files"].iter().for_each(|key| drop(run.remove(*key)));
        }
    }
    summary
}

/// A line without its run time: `…, AVX2, 0.27 s`.
fn without_seconds(line: &str) -> String {
    let is_time = |part: &&str| {
        let number = part.strip_suffix(" s").or(part.strip_suffix(" ms"));
        number.is_some_and(|number| number.parse::<f64>().is_ok())
    };
    line.split(", ").filter(|part| !is_time(part)).collect::<Vec<_>>().join(", ")
}

/// The arguments of every command that runs, by its words.
fn described() -> BTreeMap<String, Vec<clap::Arg>> {
    let mut found = BTreeMap::new();
    let mut open = vec![(String::new(), Cli::description())];
    while let Some((words, command)) = open.pop() {
        let nested: Vec<clap::Command> = command.get_subcommands().cloned().collect();
        if nested.is_empty() {
            found.insert(words, command.get_arguments().cloned().collect());
        } else {
            let words = |inner: &clap::Command| format!("{words} {}", inner.get_name()).trim().to_owned();
            open.extend(nested.into_iter().map(|inner| (words(&inner), inner)));
        }
    }
    found
}

/// The name of an argument in the rows.
fn name(argument: &clap::Arg) -> String {
    match (argument.get_long(), argument.get_short()) {
        (Some(long), _) => long.to_owned(),
        (None, Some(short)) => format!("-{short}"),
        (None, None) => argument.get_id().to_string(),
    }
}

/// The evidence for an option: rows of the command, else those for all commands.
fn evidence(command: &str, option: &str) -> Vec<&'static Row> {
    let of = |command: &str| ROWS.iter().filter(|row| row.command == command && row.option == option).collect();
    let own: Vec<&Row> = of(command);
    if own.is_empty() { of("*") } else { own }
}

fn line_of(command: &str) -> &'static str {
    let found = COMMANDS.iter().find(|known| known.name == command);
    found.unwrap_or_else(|| panic!("{command} has no line in rows.rs")).line
}

/// A path of a file of the user, or none, and a line.
type Line = (String, String);

/// What lines printed and wrote, each in a folder of its own. A line is run once for all tests.
fn run_all(lines: BTreeSet<Line>) -> BTreeMap<Line, Seen> {
    static MET: Mutex<BTreeMap<Line, Seen>> = Mutex::new(BTreeMap::new());
    let met = || MET.lock().expect("no test panics while it holds the lock");
    let is_new = |line: &&Line| !met().contains_key(*line);
    let new = run_anew(lines.iter().filter(is_new).cloned().collect());
    met().extend(new);
    let met = met();
    lines.into_iter().map(|line| (line.clone(), met[&line].clone())).collect()
}

fn run_anew(lines: BTreeSet<Line>) -> BTreeMap<Line, Seen> {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let run = |(own, line): Line| {
        let place = Place::new(&format!("walk-{}", COUNT.fetch_add(1, Ordering::Relaxed)));
        if !own.is_empty() {
            place.scratch.write(&own, "mine");
        }
        let seen = place.run(&line);
        ((own, line), seen)
    };
    lines.into_par_iter().map(run).collect()
}

/// Both lines of a row, with the path of a file of the user.
fn lines(row: &Row, command: &str) -> [Line; 2] {
    let line = if row.line.is_empty() { line_of(command) } else { row.line };
    let own = match row.evidence {
        Evidence::BesideOwnFile(path) => path.replace("{}", command),
        _ => String::new(),
    };
    let changed = match row.change.split_once(" => ") {
        Some((word, other)) => replaced(line, word, other),
        None => format!("{line} {}", row.change).trim().to_owned(),
    };
    [(own.clone(), line.to_owned()), (own, changed)]
}

/// A line with another word in the place of the first of its kind.
fn replaced(line: &str, word: &str, other: &str) -> String {
    let mut words: Vec<&str> = line.split_ascii_whitespace().collect();
    let at = words.iter().position(|found| *found == word).unwrap_or_else(|| panic!("no word {word:?} in {line}"));
    words[at] = other;
    words.join(" ")
}

#[test]
fn every_option_of_every_command_has_an_effect_or_is_refused_with_the_reason() {
    let described = described();
    assert!(described.len() > 18, "only {} commands", described.len());
    let (mut wrong, mut walked) = (Vec::new(), Vec::new());
    for (command, arguments) in &described {
        for argument in arguments {
            let rows = evidence(command, &name(argument));
            if rows.is_empty() {
                wrong.push(format!("{command} {}: no row in rows.rs", name(argument)));
            }
            walked.extend(rows.into_iter().map(|row| (command.clone(), name(argument), row)));
        }
    }
    for row in ROWS.iter().filter(|row| !walked.iter().any(|(_, _, walked)| std::ptr::eq(*walked, *row))) {
        wrong.push(format!("{} {}: there is no such option", row.command, row.option));
    }
    let needed = walked.iter().flat_map(|(command, _, row)| lines(row, command)).collect();
    let seen = run_all(needed);
    for (command, option, row) in &walked {
        let [before, after] = lines(row, command).map(|line| (line.1.clone(), &seen[&line]));
        let state = || format!("{command} {option}: {:?} against {:?}", before.0, after.0);
        match row.evidence {
            Evidence::Differs | Evidence::BesideOwnFile(_) if before.1 == after.1 => {
                wrong.push(format!("{}: no difference, exit code {}\n{}", state(), after.1.code, after.1.stderr));
            }
            Evidence::Refused(reason) if after.1.code != 2 || !after.1.stderr.contains(reason) => {
                wrong.push(format!(
                    "{}: exit code {}, not refused by {reason:?}\n{}",
                    state(),
                    after.1.code,
                    after.1.stderr
                ));
            }
            Evidence::Test(file, test) if !text(&format!("tests/{file}")).contains(&format!("fn {test}")) => {
                wrong.push(format!("{}: there is no test {test} in {file}", state()));
            }
            _ => {}
        }
        // A difference is the effect of the option and no complaint about it.
        let is_error = !matches!(row.evidence, Evidence::Refused(_)) && after.1.stderr.contains("Usage:");
        if is_error {
            wrong.push(format!("{}: {}", state(), after.1.stderr));
        }
    }
    assert!(wrong.is_empty(), "{} options:\n{}", wrong.len(), wrong.join("\n"));
    // Two runs of one line do not differ, so that a difference is that of the option.
    let again = run_anew(COMMANDS.iter().map(|command| (String::new(), command.line.to_owned())).collect());
    for (line, again) in again {
        if let Some(seen) = seen.get(&line) {
            assert_eq!(seen, &again, "{} {}", line.0, line.1);
        }
    }
}

/// The values of an option that has a list of them.
fn values(argument: &clap::Arg) -> Vec<String> {
    let takes_values = argument.get_action().takes_values();
    let all = argument.get_possible_values().into_iter().filter(|_| takes_values);
    all.map(|value| value.get_name().to_owned()).collect()
}

#[test]
fn every_value_of_an_option_gives_outputs_of_its_own() {
    let (mut cases, mut met) = (Vec::new(), BTreeSet::new());
    for (command, arguments) in described() {
        for argument in arguments.iter().filter(|argument| values(argument).len() > 1) {
            let Some(row) = evidence(&command, &name(argument)).into_iter().next() else { continue };
            let is_effective = matches!(row.evidence, Evidence::Differs);
            // Values of an option that several commands have are walked over in the first of them.
            if !is_effective || !(met.insert((name(argument), row.line)) || runs_all()) {
                continue;
            }
            let line = &lines(row, &command)[0].1;
            let option = argument.get_long().map_or(String::new(), |long| format!("--{long} "));
            let with = |value: &String| match row.change.split_once(" => ") {
                Some((word, _)) => replaced(line, word, value),
                None => format!("{line} {option}{value}"),
            };
            let all = values(argument);
            cases.push((format!("{command} {}", name(argument)), all.iter().map(with).collect::<Vec<_>>(), all));
        }
    }
    assert!(cases.len() > 12, "only {} options with lists of values", cases.len());
    let needed = cases.iter().flat_map(|(_, lines, _)| lines).map(|line| (String::new(), line.clone()));
    let seen = run_all(needed.collect());
    let mut wrong = Vec::new();
    for (option, lines, values) in &cases {
        for (index, line) in lines.iter().enumerate() {
            for (other, other_line) in lines[..index].iter().enumerate() {
                let pair = [values[other].as_str(), values[index].as_str()];
                let is_known = |row: &&(&str, [&str; 2], &str)| option.ends_with(row.0) && row.1 == pair;
                let (one, two) = (&seen[&(String::new(), line.clone())], &seen[&(String::new(), other_line.clone())]);
                if one == two && !SAME_VALUES.iter().any(|row| is_known(&row)) {
                    wrong.push(format!("{option}: {pair:?} are the same, exit code {}: {line}", one.code));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every two options of a command: both have their effect beside each other, or are refused.
#[test]
fn no_option_is_ignored_beside_another_one() {
    if !runs_all() {
        return;
    }
    let mut wrong = Vec::new();
    for (command, arguments) in described() {
        let rows = arguments.iter().flat_map(|argument| evidence(&command, &name(argument)));
        let is_plain = |row: &&Row| {
            let is_added = row.line.is_empty() && !row.change.contains(" => ");
            matches!(row.evidence, Evidence::Differs) && is_added && !EARLY.contains(&row.option)
        };
        let rows: Vec<&Row> = rows.filter(is_plain).collect();
        let line = |changes: &[&Row]| {
            let changes = changes.iter().map(|row| row.change).collect::<Vec<_>>().join(" ");
            (String::new(), format!("{} {changes}", line_of(&command)).trim().to_owned())
        };
        let pairs: Vec<[&Row; 2]> = (0..rows.len())
            .flat_map(|one| (0..one).map(move |other| (one, other)))
            .map(|(a, b)| [rows[a], rows[b]])
            .collect();
        let single = rows.iter().map(|row| line(&[row]));
        let seen = run_all(pairs.iter().map(|pair| line(pair)).chain(single).collect());
        for pair in &pairs {
            let both = &seen[&line(pair)];
            for (row, other) in [(pair[0], pair[1]), (pair[1], pair[0])] {
                let is_known = IDLE_PAIRS.iter().any(|known| known.0 == row.option && known.1 == other.option);
                if both.code != 2 && *both == seen[&line(&[other])] && !is_known {
                    wrong.push(format!("{command}: {} is ignored beside {}", row.change, other.change));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} pairs:\n{}", wrong.len(), wrong.join("\n"));
}

fn matches(pattern: &str, path: &str) -> bool {
    let parts = |text: &str| text.split('/').map(str::to_owned).collect::<Vec<String>>();
    let is_part = |(pattern, part): (&String, &String)| match pattern.split_once('*') {
        Some((before, after)) => {
            part.starts_with(before) && part.ends_with(after) && part.len() >= before.len() + after.len()
        }
        None => pattern == part,
    };
    let (pattern, path) = (parts(pattern), parts(path));
    pattern.len() == path.len() && pattern.iter().zip(&path).all(is_part)
}

#[test]
fn a_command_writes_the_files_of_the_table_and_no_others() {
    let described = described();
    let walked = || COMMANDS.iter().filter(|command| command.name != "verify");
    let seen = run_all(walked().map(|command| (String::new(), command.line.to_owned())).collect());
    let mut wrong: Vec<String> =
        described.keys().filter(|command| COMMANDS.iter().all(|known| known.name != *command)).cloned().collect();
    for WalkedCommand { name: command, line, writes: known } in walked() {
        let files = &seen[&(String::new(), (*line).to_owned())].files;
        let is_report = known.contains(&"traces.csv") || known.contains(&"flags.csv");
        let known: Vec<String> = match is_report {
            true => known
                .iter()
                .chain(&["question.toml", "report.html", "summary.json"])
                .map(|name| format!("out/c/{command}/{name}"))
                .collect(),
            false => known.iter().map(|name| (*name).to_owned()).collect(),
        };
        // A merge has its pieces beside it, and what is repeated its report.
        let new = files.keys().filter(|path| !path.starts_with("p/"));
        let unknown = new.clone().filter(|path| !known.iter().any(|pattern| matches(pattern, path)));
        wrong.extend(unknown.map(|path| format!("{command} writes {path}")));
        let missing = known.iter().filter(|pattern| !new.clone().any(|path| matches(pattern, path)));
        wrong.extend(missing.map(|pattern| format!("{command} does not write {pattern}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(matches("out/*/a*.csv", "out/c/ab.csv") && !matches("out/*", "out/c/ab.csv") && !matches("a*b", "ab/b"));
}

#[test]
fn no_command_overwrites_a_file_of_the_user_without_force() {
    let lines: Vec<&str> =
        COMMANDS.iter().map(|command| command.line).filter(|line| !line.starts_with("verify")).collect();
    let seen = run_all(lines.iter().map(|line| (String::new(), (*line).to_owned())).collect());
    let check = |(index, line): (usize, &str)| {
        let place = Place::new(&format!("walk-own-{index}"));
        let files: Vec<&String> =
            seen[&(String::new(), line.to_owned())].files.keys().filter(|path| !path.starts_with("p/")).collect();
        for path in &files {
            place.scratch.write(path, format!("mine: {path}"));
        }
        let after = place.run(line);
        let is_there = |path: &&String| {
            let mine = format!("mine: {path}").into_bytes();
            after.files.values().any(|bytes| *bytes == mine)
                || fs::read(place.scratch.path().join(path)).ok() == Some(mine)
        };
        let is_lost = |path: &&&String| {
            !is_there(path)
                && !fs::read(place.scratch.path().join(format!("{path}.~1~")))
                    .is_ok_and(|bytes| bytes == format!("mine: {path}").into_bytes())
        };
        let lost: Vec<&&String> = files.iter().filter(is_lost).collect();
        (!lost.is_empty()).then(|| format!("{line}: lost {lost:?}, exit code {}: {}", after.code, after.stderr))
    };
    let wrong: Vec<String> = lines.into_par_iter().enumerate().filter_map(check).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[cfg(target_os = "linux")]
fn a_command_whose_files_do_not_fit_fails_and_leaves_the_earlier_ones_as_they_are() {
    let commands = described();
    let has_force = |command: &str| commands[command].iter().any(|argument| name(argument) == "force");
    let check = |(index, WalkedCommand { name: command, line, .. }): (usize, &WalkedCommand)| {
        let place = Place::new(&format!("walk-full-{index}"));
        place.run(line);
        let bytes = |place: &Place| -> BTreeMap<_, _> {
            place
                .scratch
                .files()
                .into_iter()
                .map(|path| (path.clone(), fs::read(place.scratch.path().join(path)).expect("a file")))
                .collect()
        };
        let before = bytes(&place);
        let force = if has_force(command) { " --force" } else { "" };
        let program = env!("CARGO_BIN_EXE_bondline");
        let limit_kib = if command.starts_with("materials") { FULL_KIB_OF_MATERIALS } else { FULL_KIB };
        let line = format!("trap '' XFSZ; ulimit -f {limit_kib}; exec {program} {}{force}", line.replace('<', "\\<"));
        let mut shell = Command::new("bash");
        shell.current_dir(place.scratch.path()).env("XDG_RUNTIME_DIR", place.scratch.path());
        shell.env("VK_DRIVER_FILES", "/nonexistent").env("VK_ICD_FILENAMES", "/nonexistent");
        let ran = wait_for(shell.args(["-c", &line]));
        let writes = before.len() > place.inputs.len();
        let is_failed = ran.code == 1 && ran.stderr.contains("File too large");
        let is_same = bytes(&place) == before;
        (writes && !(is_failed && is_same))
            .then(|| format!("{line}: unchanged {is_same}, exit code {}: {}", ran.code, ran.stderr))
    };
    let walked: Vec<(usize, &WalkedCommand)> =
        COMMANDS.iter().enumerate().filter(|(_, command)| command.name != "verify").collect();
    let wrong: Vec<String> = walked.into_par_iter().filter_map(check).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
