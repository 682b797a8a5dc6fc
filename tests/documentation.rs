//! README and book: every command is run and its output compared, every case file is loaded. Rust blocks are
//! documentation tests of the library (`src/lib.rs`).
//!
//! A page is one session in its own folder, in which `cases` and `data` are the shipped ones. The options of a block
//! follow its language, where neither GitHub nor Sphinx shows them:
//!
//! - `console`: lines that begin with `$ ` are commands; a command continues after a line that ends in `\`. The output
//!   follows, with `...` for any number of lines. `exit=2` states another exit code than 0; a `long` block runs only if
//!   `BONDLINE_ALL` is set.
//! - `toml`, `csv`: `file=PATH` writes the block to a file, `append=PATH` appends it to one; `case` is a whole case,
//!   loaded at the end of the page; `into=PATH` replaces keys and tables of that case, which must then load.
//! - `python`: run by `python/tests/test_book.py`.
//! - `sh`: commands that are not run: cargo, or scripts that exist.
//!
//! The crate `trycmd` also runs such pages, but shows placeholders in place of times and writes no files from blocks.

use crate::support::{Scratch, files, root, runs_all, text};
use bondline::case::Case;
use std::fs;
use std::process::Command;

/// Languages of blocks that are not run here; the tests of the Python package run those in Python.
const READ_ONLY: &[&str] = &["text", "rust", "python"];

struct Block {
    language: String,
    options: Vec<String>,
    /// Index of the first line of its body.
    line: usize,
    body: String,
}

impl Block {
    fn option(&self, name: &str) -> Option<&str> {
        self.options.iter().find_map(|option| option.strip_prefix(name)?.strip_prefix('='))
    }

    fn has(&self, name: &str) -> bool {
        self.options.iter().any(|option| option == name)
    }
}

/// README and the pages of the book.
fn pages() -> Vec<String> {
    let mut pages = vec!["README.md".to_owned()];
    pages.extend(files("docs", ".md"));
    pages
}

/// The fenced blocks of a page, without directives of Sphinx (in braces).
fn blocks(page: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut open: Option<Block> = None;
    for (line, content) in page.lines().enumerate() {
        match (&mut open, content.strip_prefix("```")) {
            (None, Some(info)) => {
                let mut words = info.split_whitespace().map(str::to_owned);
                let language = words.next().unwrap_or_default();
                open = Some(Block { language, options: words.collect(), line: line + 1, body: String::new() });
            }
            (Some(_), Some("")) => found.extend(open.take()),
            (Some(block), _) => {
                block.body += content;
                block.body.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block is not closed");
    found.retain(|block| !block.language.starts_with('{'));
    found
}

/// A command, as shown and as run, with its expected output.
struct Step {
    shown: String,
    command: String,
    output: String,
}

fn steps(block: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut goes_on = false;
    for line in block.lines() {
        if let Some(command) = line.strip_prefix("$ ") {
            steps.push(Step { shown: format!("{line}\n"), command: command.to_owned(), output: String::new() });
            goes_on = command.ends_with('\\');
            continue;
        }
        let step = steps.last_mut().unwrap_or_else(|| panic!("a console block begins with a command: {line}"));
        if goes_on {
            step.shown += &format!("{line}\n");
            step.command += &format!("\n{}", line.trim_start_matches("> "));
            goes_on = line.ends_with('\\');
        } else {
            step.output += &format!("{line}\n");
        }
    }
    steps
}

/// A line without threads, vector width and seconds, which depend on the machine.
fn masked(line: &str) -> &str {
    let end = ["cpu f64, ", "cpu f32, "].iter().find_map(|mark| line.find(mark));
    line[..end.unwrap_or(line.len())].trim_end()
}

/// Whether the output is as shown; `...` stands for any number of lines.
fn is_as_shown(shown: &[&str], found: &[&str]) -> bool {
    match (shown, found) {
        ([], _) => found.is_empty(),
        (["...", rest @ ..], _) => (0..=found.len()).any(|skipped| is_as_shown(rest, &found[skipped..])),
        ([first, rest @ ..], [line, others @ ..]) => masked(first) == masked(line) && is_as_shown(rest, others),
        (_, []) => false,
    }
}

fn lines(text: &str) -> Vec<&str> {
    text.lines().collect()
}

/// Runs a command in the folder of a page; returns its output and exit code.
fn run(scratch: &Scratch, command: &str) -> (String, i32) {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_bondline"));
    let folder = program.parent().expect("a program lies in a folder");
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", &format!("exec 2>&1; {command}")])
        .current_dir(scratch.path())
        .env("PATH", path)
        .env("XDG_CACHE_HOME", scratch.path().join(".cache"))
        .output()
        .expect("a shell");
    (String::from_utf8_lossy(&output.stdout).into_owned(), output.status.code().unwrap_or(-1))
}

/// Runs the commands of a block; returns complaints and the renewed text.
fn checked(scratch: &Scratch, page: &str, block: &Block) -> (Vec<String>, String) {
    let requested: i32 = block.option("exit").map_or(0, |code| code.parse().expect("exit=CODE"));
    let (mut complaints, mut renewed) = (Vec::new(), String::new());
    for step in steps(&block.body) {
        let (found, code) = run(scratch, &step.command);
        let is_right = is_as_shown(&lines(&step.output), &lines(&found));
        renewed += &format!("{}{}", step.shown, if is_right { &step.output } else { &found });
        let place = format!("{page}:{}: $ {}", block.line, step.command);
        if !is_right {
            complaints.push(format!("{place}\nshown:\n{}found:\n{found}", step.output));
        }
        if code != requested {
            complaints.push(format!("{place}\nended with code {code}, not {requested}"));
        }
    }
    (complaints, renewed)
}

/// A case whose keys and tables are replaced by those of the same name in a fragment.
fn merged(case: &str, fragment: &str) -> String {
    let table = |line: &str| line.strip_prefix('[').map(|rest| rest.trim_matches(['[', ']']).to_owned());
    let key = |line: &str| line.split_once(" =").map(|(key, _)| key.to_owned());
    let (mut keys, mut tables) = (Vec::new(), Vec::new());
    for line in fragment.lines() {
        match (table(line), key(line)) {
            (Some(name), _) => tables.push(name),
            (None, Some(name)) if tables.is_empty() => keys.push(name),
            _ => {}
        }
    }
    let mut remaining = String::new();
    let mut current = None;
    for line in case.lines() {
        current = table(line).or(current);
        let is_replaced = match &current {
            Some(name) => tables.contains(name),
            None => key(line).is_some_and(|name| keys.contains(&name)),
        };
        if !is_replaced {
            remaining += line;
            remaining.push('\n');
        }
    }
    let (before, after): (Vec<&str>, Vec<&str>) = {
        let first = fragment.lines().position(|line| line.starts_with('[')).unwrap_or(fragment.lines().count());
        (fragment.lines().take(first).collect(), fragment.lines().skip(first).collect())
    };
    format!("{}\n{remaining}\n{}\n", before.join("\n"), after.join("\n"))
}

/// Commands of a block that are neither cargo nor a script of the repository.
fn missing_scripts(block: &str) -> impl Iterator<Item = &str> {
    let commands = block.lines().filter(|line| !line.starts_with('#'));
    let commands = commands.filter_map(|line| line.split_whitespace().find(|word| !word.contains('=')));
    commands.filter(|command| *command != "cargo" && !root().join(command).is_file())
}

/// Complaints about a page; `BONDLINE_BLESS` renews its outputs.
fn complaints(page: &str) -> Vec<String> {
    let source = text(page);
    let found = blocks(&source);
    let scratch = Scratch::new(&page.replace(['/', '.'], "-"));
    for folder in ["cases", "data"] {
        std::os::unix::fs::symlink(root().join(folder), scratch.path().join(folder)).expect("a link to shipped files");
    }
    let mut complaints = Vec::new();
    let mut cases = Vec::new();
    let mut renewed: Vec<String> = source.lines().map(str::to_owned).collect();
    let mut edits = Vec::new();
    for block in &found {
        let place = format!("{page}:{}", block.line);
        match block.language.as_str() {
            "console" if block.has("long") && !runs_all() => {}
            "console" => {
                let (wrong, should) = checked(&scratch, page, block);
                if !wrong.is_empty() {
                    edits.push((block.line, block.body.lines().count(), should));
                }
                complaints.extend(wrong);
            }
            "toml" | "csv" if block.option("file").is_some() => {
                let path = scratch.write(block.option("file").unwrap_or_default(), &block.body);
                if path.ends_with("case.toml") {
                    cases.push((place, path));
                }
            }
            "toml" if block.option("append").is_some() => {
                let path = block.option("append").unwrap_or_default();
                scratch.write(path, scratch.read(path) + "\n" + &block.body);
            }
            "toml" if block.has("case") => {
                cases.push((place, scratch.write(&format!("block-{}/case.toml", block.line), &block.body)));
            }
            "toml" if block.option("into").is_some() => {
                let (from, folder) = (block.option("into").unwrap_or_default(), format!("block-{}", block.line));
                for file in files(from, "") {
                    let inside = file.strip_prefix(from).expect("found in the folder");
                    scratch.write(&format!("{folder}{inside}"), text(&file));
                }
                let case = merged(&text(&format!("{from}/case.toml")), &block.body);
                cases.push((place, scratch.write(&format!("{folder}/case.toml"), case)));
            }
            "sh" => complaints.extend(missing_scripts(&block.body).map(|word| format!("{place}: no script {word}"))),
            other if READ_ONLY.contains(&other) => {}
            other => complaints.push(format!("{place}: a block of \"{other}\" that is not checked")),
        }
    }
    complaints.extend(
        cases.iter().filter_map(|(place, path)| Case::load(path).err().map(|error| format!("{place}: {error}"))),
    );
    if std::env::var_os("BONDLINE_BLESS").is_some() {
        for (line, count, should) in edits.into_iter().rev() {
            renewed.splice(line..line + count, should.lines().map(str::to_owned));
        }
        fs::write(root().join(page), renewed.join("\n") + "\n").expect("the page");
    }
    complaints
}

#[test]
fn every_block_of_readme_and_book_gives_the_output_shown() {
    let found: Vec<String> = pages().iter().flat_map(|page| complaints(page)).collect();
    assert!(found.is_empty(), "{}\nif intended, BONDLINE_BLESS=1 renews the pages", found.join("\n"));
}

/// Negative control: the comparison detects a change of any digit of an output.
#[test]
fn a_digit_changed_in_an_output_is_caught() {
    let mut changed = 0;
    for page in pages() {
        for block in blocks(&text(&page)).iter().filter(|block| block.language == "console") {
            for step in steps(&block.body) {
                let shown = lines(&step.output);
                for (at, line) in shown.iter().enumerate() {
                    for (place, digit) in masked(line).char_indices().filter(|(_, c)| c.is_ascii_digit()) {
                        let other = if digit == '9' { '0' } else { '9' };
                        let spoiled = format!("{}{other}{}", &line[..place], &line[place + 1..]);
                        let mut found = shown.clone();
                        found[at] = &spoiled;
                        assert!(!is_as_shown(&shown, &found), "{page}: {spoiled}");
                        changed += 1;
                    }
                }
            }
        }
    }
    assert!(changed > 500, "only {changed} digits are compared");
}

#[test]
fn an_unchecked_block_and_a_missing_script_are_caught() {
    let of = |page: &str| blocks(page).into_iter().map(|block| block.language).collect::<Vec<_>>();
    assert_eq!(
        of("```console long\n$ true\n```\n```{note}\nread\n```\n```toml case\na = 1\n```\n"),
        ["console", "toml"]
    );
    let block = "# a comment\nA=1 cargo test\nscripts/test.sh --all\nscripts/none.sh\n";
    assert_eq!(missing_scripts(block).collect::<Vec<_>>(), ["scripts/none.sh"]);
    let case = text("cases/slab/case.toml");
    let fragment = "duration = \"7 s\"\n[back_face]\nkind = \"insulated\"\n";
    let together = merged(&case, fragment);
    assert_eq!(together.matches("duration =").count(), 1);
    assert_eq!(together.matches("[back_face]").count(), 1);
    assert!(together.contains("insulated") && together.contains("[hot_face]"));
}
