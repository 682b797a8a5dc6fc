//! The words of messages: below the command room they are those of no single interface.
//!
//! An option of a question is `--option-name` on the command line, a keyword in Python and a field in Rust. A message
//! of the library reaches the users of all three. It names an option by its `InputError` or in words; the command and
//! the Python package add their own spelling.

use crate::support::{files, text};

/// Literals that name an option of the command line, with the reason: the file, a part of the literal, and the reason.
const ALLOWED: &[(&str, &str, &str)] = &[
    (
        "src/report/files/contents.rs",
        "(on the command line: `uncertainty --keep",
        "only the command writes these files",
    ),
    ("src/report/files/contents.rs", "(on the command line: `twin` without `--study`)", "only the command writes it"),
    ("src/report/marched.rs", "--set", "the command line of a study in tests of the report"),
];

/// The string literals of a source with the lines on which they begin. Comments and literals of single characters are
/// skipped, and so are unit tests at the end of the file.
fn literals(source: &str) -> Vec<(usize, String)> {
    let source = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let chars: Vec<char> = source.chars().collect();
    let starts_with = |at: usize, word: &str| word.chars().enumerate().all(|(i, c)| chars.get(at + i) == Some(&c));
    let (mut found, mut at, mut line) = (Vec::new(), 0, 1);
    while at < chars.len() {
        let end = if starts_with(at, "//") {
            (at..chars.len()).find(|&end| chars[end] == '\n').unwrap_or(chars.len())
        } else if chars[at] == '"' {
            let mut end = at + 1;
            while end < chars.len() && chars[end] != '"' {
                end += if chars[end] == '\\' { 2 } else { 1 };
            }
            found.push((line, chars[at + 1..end.min(chars.len())].iter().collect()));
            end + 1
        } else if starts_with(at, "r\"") || starts_with(at, "r#") {
            let hashes = chars[at + 1..].iter().take_while(|c| **c == '#').count();
            let first = at + 1 + hashes;
            if chars.get(first) == Some(&'"') {
                let close = format!("\"{}", "#".repeat(hashes));
                let end = (first + 1..chars.len()).find(|&end| starts_with(end, &close)).unwrap_or(chars.len());
                found.push((line, chars[first + 1..end].iter().collect()));
                end + close.len()
            } else {
                at + 1
            }
        } else if starts_with(at, "'\\") {
            // An escaped character: the quote after it, which may itself be escaped.
            (at + 3..chars.len()).find(|&end| chars[end] == '\'').unwrap_or(chars.len()) + 1
        } else if chars[at] == '\'' && chars.get(at + 2) == Some(&'\'') {
            at + 3
        } else {
            at + 1
        };
        let end = end.min(chars.len());
        line += chars[at..end].iter().filter(|c| **c == '\n').count();
        at = end;
    }
    found
}

/// Whether a text names an option of a command line: two hyphens and a letter at the beginning of a word.
fn names_an_option(text: &str) -> bool {
    text.match_indices("--").any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + 2..].chars().next();
        !before.is_some_and(|c| c.is_alphanumeric() || c == '-') && after.is_some_and(|c| c.is_ascii_lowercase())
    })
}

/// The literals that name an option and are not allowed to.
fn options_in_messages(sources: &[(String, String)]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (path, source) in sources {
        for (line, literal) in literals(source) {
            let is_allowed = ALLOWED.iter().any(|(file, part, _)| file == path && literal.contains(part));
            if names_an_option(&literal) && !is_allowed {
                wrong.push(format!("{path}:{line}: {literal}"));
            }
        }
    }
    wrong
}

/// The sources whose messages reach users of all interfaces, without modules of unit tests.
fn sources() -> Vec<(String, String)> {
    let is_shared = |path: &String| {
        let is_of_command = path.starts_with("src/command") || path == "src/main.rs";
        let is_test = path.contains("/tests/") || path.ends_with("/tests.rs") || path.ends_with("/fixture.rs");
        !is_of_command && !is_test
    };
    let paths = files("src", ".rs").into_iter().chain(files("python/src", ".rs")).filter(is_shared);
    paths.map(|path| (path.clone(), text(&path))).collect()
}

#[test]
fn no_message_below_the_command_names_an_option_of_the_command_line() {
    let sources = sources();
    assert!(sources.len() > 100, "only {} sources found", sources.len());
    let literals: usize = sources.iter().map(|(_, source)| literals(source).len()).sum();
    assert!(literals > 3000, "only {literals} literals found");
    assert_eq!(options_in_messages(&sources), Vec::<String>::new());
    for (file, part, reason) in ALLOWED {
        let is_there = |(path, source): &(String, String)| path == file && source.contains(part);
        assert!(sources.iter().any(is_there), "{file} has no {part:?}: remove the row ({reason})");
    }
}

#[test]
fn an_option_in_a_message_is_caught_and_one_in_a_comment_is_not() {
    let found = |text: &str| options_in_messages(&[("src/a.rs".to_owned(), text.to_owned())]).len();
    for wrong in [
        "#[error(\"{0}: choose another --out\")]",
        "let quote = '\"'; let escaped = '\\''; f(\"use (--starts)\");",
        "f(r#\"a \"quoted\" --set\"#)",
        "format!(\"no convergence: \\\n   --starts\")",
        "f(\"\\\"--quantity\\\"\")",
    ] {
        assert_eq!(found(wrong), 1, "{wrong}");
    }
    for sound in [
        "// give --out\nf(\"a report\");",
        "/// `--out \"x\"`\nlet a = 1;",
        "f(\"a -- b\", \"---\", \"x--y\")",
        "fn f<'a>(x: &'a str) {}\n#[cfg(test)]\nmod tests {\nf(\"--out\") }",
    ] {
        assert_eq!(found(sound), 0, "{sound}");
    }
}
