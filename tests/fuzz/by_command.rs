//! Mutants through the command, each in a process with limits of time and memory.

use super::mutation::{Choice, mutated};
use super::seeds::Seeds;
use super::{MUTANTS_PER_COMMAND, corpus, in_process, mutants};
use crate::cli::{CASE, merge};
use crate::support::Scratch;
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;

/// Longest time of one mutant, s, and its memory, KiB.
const SECONDS: usize = 20;
const MEMORY_KIB: usize = 2 * 1024 * 1024;

/// Commands that read a case `c`.
const COMMANDS: &[&str] = &[
    "predict c --json --out out",
    "uncertainty c -n 8 --json --out out",
    "sensitivity c --json --out out",
    "estimate c --json --out out",
    "history c --knots 4 --json --out out",
    "twin c --noise=1K --out out/measured.csv",
    "predict c --precision f32 --json --out out",
];

/// Run the command in a folder, and return what is wrong with its end.
fn fault(scratch: &Scratch, arguments: &str) -> Option<String> {
    let given = scratch.files();
    let binary = env!("CARGO_BIN_EXE_bondline");
    let line = format!("ulimit -v {MEMORY_KIB} && exec timeout {SECONDS} {binary} {arguments}");
    let mut shell = Command::new("bash");
    shell.current_dir(scratch.path()).env("RAYON_NUM_THREADS", "2").env("MALLOC_ARENA_MAX", "1");
    let ended = shell.args(["-c", &line]).output().expect("bash starts");
    let stdout = String::from_utf8_lossy(&ended.stdout);
    let made: Vec<PathBuf> = scratch.files().into_iter().filter(|path| !given.contains(path)).collect();
    let wrong = match ended.status.code() {
        Some(0) => faults_of_answer(scratch, &made, &stdout, arguments.contains("--json")),
        Some(1) if !ended.stderr.is_empty() => None,
        Some(2 | 3) if stdout.is_empty() && made.is_empty() && !ended.stderr.is_empty() => None,
        Some(2 | 3) => Some(format!("output after an error: {stdout:?}, {made:?}")),
        other => Some(format!("exit code {other:?}, status {}", ended.status)),
    };
    wrong.map(|wrong| format!("{arguments}: {wrong}\n{}", String::from_utf8_lossy(&ended.stderr)))
}

/// Numbers that are not finite in the output: nulls of results in JSON, and NaN or infinity in a table.
fn faults_of_answer(scratch: &Scratch, made: &[PathBuf], stdout: &str, is_json: bool) -> Option<String> {
    if is_json {
        let Ok(summary) = serde_json::from_str::<serde_json::Value>(stdout) else {
            return Some("standard output is not JSON".to_owned());
        };
        // A factor without effect says so, and has no interval.
        let undetermined = |factor: &serde_json::Value| factor["has_effect"] == false;
        let factors = summary["factors"].as_object().into_iter().flatten();
        if let Some((name, found)) =
            factors.into_iter().find(|(_, found)| !undetermined(found) && found.to_string().contains("null"))
        {
            return Some(format!("a number of {name} is not finite: {found}"));
        }
        // Without gas there is no balance of mass.
        for path in ["/sensors", "/balance/energy"] {
            if let Some(found) = summary.pointer(path).filter(|found| found.to_string().contains("null")) {
                return Some(format!("a number of {path} is not finite: {found}"));
            }
        }
    }
    let mut tables = made.iter().filter(|path| path.extension().is_some_and(|ending| ending == "csv"));
    tables.find_map(|path| {
        let table = fs::read_to_string(scratch.path().join(path)).expect("a table that was written");
        let is_infinite = |cell: &str| cell.parse::<f64>().is_ok_and(|number| !number.is_finite());
        let row = table.lines().skip(1).find(|row| row.split(',').any(is_infinite));
        row.map(|row| format!("{}: a number is not finite in {row:?}", path.display()))
    })
}

#[test]
fn no_mutant_breaks_a_command() {
    let (seeds, faults) = (Seeds::new(), Mutex::new(Vec::new()));
    let pieces = Scratch::new("fuzz-pieces");
    pieces.write("c/case.toml", CASE);
    for members in ["0..4", "4..8"] {
        let made = fault(&pieces, &format!("uncertainty c -n 8 --members {members} --out pieces"));
        assert_eq!(made, None);
    }
    let piece = pieces.read("pieces/c-0-4.json");
    let next = Mutex::new(mutants(MUTANTS_PER_COMMAND));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(number) = next.lock().expect("no thread panics with it").next() {
                    let scratch = Scratch::new(&format!("fuzz-{number}"));
                    let mut choice = Choice::new(!number);
                    let arguments = if number % 8 == 0 {
                        scratch.write("a.json", mutated_piece(&piece, &mut choice));
                        let folder = pieces.path().display();
                        format!("merge a.json {folder}/pieces/c-4-8.json --json --case {folder}/c --out out")
                    } else {
                        let input = seeds.mutant(number);
                        for (name, text) in &input {
                            scratch.write(&format!("c/{name}"), with_flipped_byte(text, &mut choice));
                        }
                        let materials: Vec<&String> =
                            input.keys().filter(|name| name.starts_with("materials/")).collect();
                        match number % 8 {
                            1 if !materials.is_empty() => format!("materials check c/{}", choice.of(&materials)),
                            _ => (*choice.of(COMMANDS)).to_owned(),
                        }
                    };
                    if let Some(fault) = fault(&scratch, &arguments) {
                        let text = format!("{number}: {fault}: {}\n", seeds.description(number));
                        faults.lock().expect("no thread panics with it").push(text);
                    }
                }
            });
        }
    });
    let faults = faults.into_inner().expect("no thread panics with it");
    assert!(faults.is_empty(), "{} mutants:\n{}", faults.len(), faults.concat());
}

/// A mutant of a piece. One of two has the checksum of its content, without which nothing of it is used.
fn mutated_piece(piece: &str, choice: &mut Choice) -> String {
    if choice.below(2) == 0 {
        return mutated(piece, piece, choice);
    }
    let content = merge::content(piece);
    merge::with_checksum(&mutated(content, content, choice))
}

/// The bytes of a text, in one of eight files with one flipped bit: not UTF-8 any more, perhaps.
fn with_flipped_byte(text: &str, choice: &mut Choice) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    if !bytes.is_empty() && choice.below(8) == 0 {
        let place = choice.below(bytes.len());
        bytes[place] ^= 1 << choice.below(8);
    }
    bytes
}

/// Every input that once broke bondline, read in this process and through the command.
#[test]
fn inputs_that_once_broke_it_are_refused_or_answered() {
    for entry in corpus::ENTRIES {
        let input = entry.input();
        assert!(in_process::answer(&input).is_ok(), "{}", entry.name);
        let scratch = Scratch::new(&format!("fuzz-{}", entry.name));
        for (name, text) in &input {
            scratch.write(&format!("c/{name}"), text);
        }
        assert_eq!(fault(&scratch, entry.command), None, "{}", entry.name);
    }
}
