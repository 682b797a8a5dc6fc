//! `--help`, completions, manual pages and old option names.

use super::{command, run, wait_for};
use crate::support::{Scratch, root};

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
