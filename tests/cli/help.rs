//! `--help`, completions, manual pages and old option names.

use super::{CASE, OBSERVATIONS, command, run, wait_for};
use crate::support::{Scratch, root, without_run};

/// A command and all subcommands under it, with their help.
fn helps(scratch: &Scratch, words: &str) -> Vec<(String, String)> {
    let text = run(scratch, &format!("{words} --help")).succeeded().stdout;
    let listed = text.split_once("\nCommands:\n").map_or("", |(_, rest)| rest);
    let listed = listed.split_once("\n\n").map_or("", |(list, _)| list);
    let names = listed.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let nested: Vec<(String, String)> = names.flat_map(|name| helps(scratch, &format!("{words} {name}"))).collect();
    std::iter::once((words.trim().to_owned(), text)).chain(nested).collect()
}

/// The commands of the examples. A line that ends in a backslash goes on in the next one.
fn examples(help: &str) -> Vec<String> {
    let (_, examples) = help.split_once("\nExamples:\n").unwrap_or_else(|| panic!("no examples in:\n{help}"));
    let joined = examples.replace("\\\n", " ");
    joined.lines().map(str::trim).filter(|line| line.starts_with("bondline ")).map(str::to_owned).collect()
}

/// Words of a command; quotes enclose blanks.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in line.split('"').enumerate() {
        if index % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    // A quote inside a word, as in NAME="1 kPa", joins it.
    let mut joined: Vec<String> = Vec::new();
    for word in words {
        match joined.last_mut().filter(|last| last.ends_with('=')) {
            Some(last) => last.push_str(&word),
            None => joined.push(word),
        }
    }
    joined
}

#[test]
fn every_example_of_every_help_runs() {
    let (cases, data) = (format!("{}/cases/", root().display()), format!("{}/data/", root().display()));
    let mut count = 0;
    for (name, help) in helps(&Scratch::new("examples"), "") {
        let scratch = Scratch::new(&format!("examples-{}", name.replace(' ', "-")));
        let found = examples(&help);
        assert!(!found.is_empty(), "{name}: no examples");
        for line in found {
            // The output goes to standard output here, as there is no shell.
            let line = line.split(" > ").next().expect("a command");
            let words = words(&line.replace("cases/", &cases).replace(" data/", &format!(" {data}")));
            let ran = wait_for(command(&scratch).args(&words[1..]));
            assert_eq!(ran.code, 0, "{line}:\n{}", ran.stderr);
            count += 1;
        }
    }
    assert!(count > 30, "only {count} examples");
}

#[test]
fn help_states_what_a_command_gives_and_fits_100_columns() {
    let scratch = Scratch::new("help");
    let all = helps(&scratch, "");
    assert!(all.len() > 18, "only {} commands", all.len());
    for (name, help) in all {
        let first = help.lines().next().expect("a line");
        assert!(first.chars().count() > 20 && !first.starts_with("Usage"), "{name}: {first}");
        assert!(help.lines().all(|line| line.chars().count() <= 100), "{name} is wider than 100 columns:\n{help}");
    }
}

#[test]
fn completions_and_manual_pages_cover_every_subcommand() {
    let scratch = Scratch::new("completions");
    let names: Vec<String> = helps(&scratch, "").into_iter().map(|(name, _)| name).collect();
    assert!(names.contains(&"materials show".to_owned()), "{names:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = run(&scratch, &format!("completions {shell}")).succeeded().stdout;
        for word in names.iter().flat_map(|name| name.split(' ')) {
            assert!(script.contains(word), "{shell}: no {word}");
        }
        assert!(script.contains("max-iterations"), "{shell}: no options");
    }
    run(&scratch, "completions tcsh").exited_with(2);
    run(&scratch, "man pages").succeeded();
    for name in &names {
        let file = format!("pages/bondline {name}").trim_end().replace(' ', "-");
        let page = scratch.read(&format!("{file}.1"));
        assert!(page.contains(".SH NAME") && page.contains("Examples:"), "{file}: {page}");
    }
    assert_eq!(scratch.files().len(), names.len());
}

#[test]
fn old_keys_of_files_and_overrides_are_noted_once_and_leave_the_fingerprint_unchanged() {
    let note = |renaming: &str| format!("note: {renaming}; the old name will go with version 0.2\n");
    let scratch = Scratch::new("renamed-keys");
    scratch.write("c/case.toml", CASE);
    let predicted = |line: &str| {
        let ran = run(&scratch, &format!("predict c --json {line}")).succeeded();
        (ran.json()["sensors"].clone(), ran.stderr)
    };
    let (current, none) = predicted("");
    let (set, set_note) = predicted("--set resolution.every=1s");
    assert_eq!((set, none.as_str()), (current.clone(), ""));
    assert_eq!(set_note, note("--set resolution.every=1s: \"every\" is now \"output_interval\""));
    for (first, end) in [(0, 10), (10, 20)] {
        run(&scratch, &format!("uncertainty c -n 20 --members {first}..{end} --quiet --out p")).succeeded();
    }

    scratch.write("c/case.toml", CASE.replace("output_interval", "every"));
    let file_note = note("c/case.toml:48: \"every\" is now \"output_interval\"");
    assert_eq!(predicted(""), (current, file_note.clone()));
    let merged = run(&scratch, "merge p/c-0-10.json p/c-10-20.json").succeeded();
    // The parts hold the absolute path of the case.
    let (_, path_and_rest) = file_note.split_once("note: ").expect("a note");
    assert!(merged.stderr.ends_with(path_and_rest) && merged.stderr.lines().count() == 1, "{}", merged.stderr);

    let material = include_str!("../../data/materials/akk.toml");
    scratch.write("akk.toml", material.replacen("mass_loss", "loss", 1));
    let checked = run(&scratch, "materials check akk.toml").succeeded();
    assert_eq!(checked.stderr, note("akk.toml:54: \"loss\" is now \"mass_loss\""));
    assert!(checked.stdout.starts_with("akk.toml: ok\n"), "{}", checked.stdout);
}

#[test]
fn old_option_names_do_what_the_new_ones_do_and_say_so() {
    let scratch = Scratch::new("renamed");
    scratch.write("c/case.toml", CASE.to_owned() + OBSERVATIONS);
    scratch.write("d/case.toml", CASE.to_owned() + OBSERVATIONS);
    for (old, new, line) in [
        ("--beside", "--compare", "estimate c --beside d"),
        (
            "--between",
            "--thickness-range",
            "size c --ply BASE --limit TC2<600K --probability 0.8 -n 20 --between=2mm:9mm",
        ),
        ("--correlation", "--correlation-time", "twin c --study 2 --correlation 2s"),
        ("--moves", "--mcmc-iterations", "estimate c --posterior --walkers 16 --moves 20"),
        ("--patience", "--max-iterations", "estimate c --patience=30"),
        ("--seek", "--quantity", "history c --knots 0 --smoothing 1 --seek flux"),
        ("--spread", "--sampling-bounds", "uncertainty c -n 20 --spread large"),
    ] {
        let named_old = run(&scratch, &format!("{line} --json"));
        let named_new = run(&scratch, &format!("{} --json", line.replace(old, new))).succeeded();
        let note = format!("note: {old} is now {new}; the old name will go with version 0.2\n");
        assert_eq!((named_old.code, named_old.stderr), (0, note + &named_new.stderr), "{line}");
        let without_time = |text: &str| without_run(serde_json::from_str(text).expect("JSON"));
        assert_eq!(without_time(&named_old.stdout), without_time(&named_new.stdout), "{line}");
    }
}
