//! Names in the comments of sources and shaders: each exists.

use crate::support::{files, text};
use std::collections::HashSet;

/// Names that the project does not define or use, and whose they are.
const NAMES_ELSEWHERE: &[(&str, &str)] = &[
    ("ErrorGuaranteed", "the compiler of Rust"),
    ("SimdBaseIo::copy_to_slice", "the crate simdeez"),
    ("NoContraction", "SPIR-V"),
    ("trf", "SciPy"),
    ("f_scale", "SciPy"),
    ("AB", "an example of a text"),
    ("question.toml", "a file of every report"),
    ("materials/felt.toml", "an example of a path in a case"),
    ("TC1_peak_k", "an example of a column, named after a sensor"),
    ("TC1_peak_time_s", "an example of a column, named after a sensor"),
];

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !is_word(c)).filter(|word| !word.is_empty())
}

/// The comments of a source with their line numbers, and the words of the rest.
fn split(source: &str) -> (Vec<(usize, &str)>, HashSet<String>) {
    let (mut comments, mut code) = (Vec::new(), HashSet::new());
    for (index, line) in source.lines().enumerate() {
        if line.trim_start().starts_with("//") {
            comments.push((index + 1, line));
        } else {
            code.extend(words(line).map(str::to_owned));
        }
    }
    (comments, code)
}

/// The parts of a comment in back ticks that are a name, or a file.
fn quoted(comment: &str) -> impl Iterator<Item = &str> {
    let parts = comment.split('`').skip(1).step_by(2);
    parts.filter(|part| {
        let name = part.trim_end_matches("()");
        let is_name = name.split("::").all(|word| !word.is_empty() && word.chars().all(is_word));
        let begins = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
        begins && (is_name || is_file(name))
    })
}

fn is_file(name: &str) -> bool {
    let ends = |ending: &&str| name.ends_with(*ending);
    [".rs", ".wgsl", ".md", ".toml", ".py", ".sh", ".js", ".css"].iter().any(ends)
        && name.chars().all(|c| is_word(c) || "./-".contains(c))
}

/// Names in comments that are not among `known` words and files, nor in the table.
fn unknown_names(sources: &[(String, String)], known: &HashSet<String>, paths: &[String]) -> Vec<String> {
    let mut unknown = Vec::new();
    for (path, source) in sources {
        for (line, comment) in split(source).0 {
            for name in quoted(comment).filter(|name| !NAMES_ELSEWHERE.iter().any(|(elsewhere, _)| elsewhere == name)) {
                let exists = match is_file(name) {
                    true => paths.iter().any(|known| known == name || known.ends_with(&format!("/{name}"))),
                    false => words(name).all(|word| known.contains(word)),
                };
                if !exists {
                    unknown.push(format!("{path}:{line}: `{name}`"));
                }
            }
        }
    }
    unknown
}

#[test]
fn names_in_comments_exist() {
    let read = |folder: &str, ending: &str| files(folder, ending).into_iter().map(|path| (path.clone(), text(&path)));
    let sources: Vec<_> = read("src", ".rs").chain(read("shaders", ".wgsl")).chain(read("python/src", ".rs")).collect();
    let mut known: HashSet<String> = sources.iter().flat_map(|(_, source)| split(source).1).collect();
    let others = [("tests", ".rs"), ("tests", ".toml"), ("docs", ".md"), ("cases", ".toml"), ("data", ".toml")];
    let others = others.iter().flat_map(|(folder, ending)| read(folder, ending));
    for (_, text) in others.filter(|(path, _)| path != "tests/comments.rs") {
        known.extend(words(&text).map(str::to_owned));
    }
    known.extend(words(&text("Cargo.toml")).map(str::to_owned));
    let folders = ["src", "shaders", "tests", "docs", "cases", "data", "benches", "scripts", "python"];
    let mut paths: Vec<String> = folders.iter().flat_map(|folder| files(folder, "")).collect();
    paths.extend(["README.md", "CONTRIBUTING.md", "Cargo.toml", "deny.toml"].map(str::to_owned));
    assert_eq!(unknown_names(&sources, &known, &paths), Vec::<String>::new());
    for (name, owner) in NAMES_ELSEWHERE {
        let is_needed = sources.iter().any(|(_, source)| source.contains(&format!("`{name}`")));
        assert!(is_needed, "no comment names `{name}` ({owner})");
    }
}

#[test]
fn a_name_that_no_longer_exists_is_caught() {
    let source =
        "// See `old_name` and `plan::rows`, of `src/old.rs`, and `kept()` at `x > 1`.\nfn kept() { plan.rows }";
    let sources = [("src/a.rs".to_owned(), source.to_owned())];
    let known = split(source).1;
    let found = unknown_names(&sources, &known, &["src/a.rs".to_owned()]);
    assert_eq!(found, ["src/a.rs:1: `old_name`", "src/a.rs:1: `src/old.rs`"]);
}
