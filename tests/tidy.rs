//! Rules for the source tree. Each rule is a function from sources to violations: the test requires none in the tree,
//! and at least one in an example that breaks the rule. To let a module import another one, or to use a crate in a
//! new folder, edit the tables here.

use crate::support::{files, root, text};
use std::fs;

/// The modules that each module of the library may import.
const IMPORTS: &[(&str, &[&str])] = &[
    ("limits", &[]),
    ("numerics", &[]),
    ("case", &["limits", "numerics"]),
    ("traces", &[]),
    ("random", &[]),
    ("user_cache", &[]),
    ("fit", &["random", "numerics"]),
    ("ensemble", &["case", "random"]),
    // A package of its own: of the library it can see nothing.
    ("physics", &[]),
    // A plan states errors of gauges, whose names are in `traces`.
    ("plan", &["limits", "case", "numerics", "traces", "physics"]),
    ("march", &["limits", "plan", "ensemble", "traces", "physics", "user_cache"]),
    // A question names parts of studies, such as the quantity of an inversion, and studies take questions: the files
    // have no cycle.
    ("question", &["limits", "case", "ensemble", "fit", "kept_work", "march", "plan", "statistics", "study"]),
    (
        "study",
        &[
            "limits",
            "case",
            "numerics",
            "random",
            "plan",
            "adapt",
            "ensemble",
            "traces",
            "march",
            "fit",
            "question",
            "statistics",
            "kept_work",
        ],
    ),
    ("statistics", &["ensemble", "random"]),
    // A study takes a log of finished work, and kept work is of studies: the files have no cycle.
    ("kept_work", &["limits", "case", "march", "traces", "question", "study"]),
    // Records name the backend, the precision and the loss function.
    ("report", &["case", "traces", "kept_work", "statistics", "study", "march", "fit"]),
    (
        "session",
        &[
            "limits",
            "case",
            "plan",
            "adapt",
            "ensemble",
            "traces",
            "march",
            "question",
            "kept_work",
            "study",
            "report",
            "user_cache",
        ],
    ),
    ("adapt", &["case", "plan", "ensemble", "traces", "march"]),
    // Of kept work, studies without a log; of questions, their defaults, which are what coverage is counted for.
    (
        "verify",
        &[
            "case",
            "random",
            "plan",
            "adapt",
            "ensemble",
            "traces",
            "march",
            "fit",
            "statistics",
            "kept_work",
            "question",
            "study",
        ],
    ),
    // Words in, calls of a session, text out: what it takes from other modules are options and answers.
    (
        "command",
        &[
            "limits",
            "case",
            "ensemble",
            "kept_work",
            "march",
            "plan",
            "question",
            "report",
            "session",
            "study",
            "traces",
            "verify",
        ],
    ),
];

/// The files, or folders with a trailing slash, in which each crate is used. A folder includes the file of its module.
const HOMES: &[(&str, &[&str])] = &[
    ("wgpu", &["src/march/gpu/"]),
    ("pollster", &["src/march/gpu/"]),
    ("bytemuck", &["src/march/gpu/"]),
    ("simdeez", &["src/physics/lanes", "src/physics/kernel.rs"]),
    (
        "rayon",
        &[
            "src/adapt.rs",
            "src/march/cpu.rs",
            "src/march/gauge_bounds.rs",
            "src/march/gpu/gather.rs",
            "src/march.rs",
            "src/march/record_peaks.rs",
            "src/march/richardson.rs",
            "src/statistics",
            "src/study/uncertainty",
            "src/verify/coverage/",
            "src/session/",
            "src/command/devices.rs",
        ],
    ),
    (
        "serde",
        &[
            "src/report/",
            "src/case/",
            "src/fit/",
            "src/ensemble",
            "src/march.rs",
            "src/march/backend_selection.rs",
            "src/plan/",
            "src/kept_work/",
            "src/question/",
            "src/session/plan_cache.rs",
            "src/statistics/",
            "src/study/",
            "src/traces.rs",
        ],
    ),
    (
        "serde_json",
        &[
            "src/question.rs",
            "src/report/",
            "src/session/plan_cache.rs",
            "src/kept_work/",
            "src/command/devices.rs",
            "src/command/verify.rs",
        ],
    ),
    ("sha2", &["src/case/input_files.rs", "src/report/html/content_policy.rs"]),
    ("twox_hash", &["src/kept_work/checksum.rs"]),
    (
        "clap",
        &[
            "src/command/args/",
            "src/command.rs",
            "src/question/",
            // Enums that are values of options.
            "src/case/factor.rs",
            "src/ensemble.rs",
            "src/fit/optimal_design.rs",
            "src/march/backend_selection.rs",
            "src/march.rs",
            "src/study/flux_inversion/heating_quantity.rs",
        ],
    ),
    ("clap_complete", &["src/command/args.rs", "src/command/completions.rs"]),
    ("clap_mangen", &["src/command/man.rs"]),
    ("anyhow", &["src/command/exit.rs"]),
    ("indicatif", &["src/command/progress.rs"]),
    ("signal_hook", &["src/command/stop.rs"]),
    ("nalgebra", &["src/fit/", "src/statistics", "src/study/", "src/verify/least_squares/"]),
    ("rand_chacha", &["src/random.rs"]),
    ("sobol_burley", &["src/ensemble/"]),
    ("toml", &["src/case/file/", "src/question/record.rs"]),
    ("csv", &["src/case/file/table_file", "src/report/files/"]),
    ("calamine", &["src/case/file/table_file/workbook.rs"]),
    ("zip", &["src/case/file/table_file/workbook.rs"]),
    ("parquet", &["src/report/files/"]),
    ("rustix", &["src/report/files/"]),
    ("strsim", &["src/case/suggestion.rs"]),
    ("textplots", &["src/report/braille.rs"]),
];

/// The longest line, in characters.
const COLUMNS: usize = 120;

/// Files that may have longer lines: a part of the path, and the reason.
const LONG_LINES: &[(&str, &str)] = &[
    (".csv", "tables: one row per line"),
    (".svg", "generated figures"),
    ("src/report/html/vendor/", "a vendored script"),
    ("LICENSE-MIT", "the text of the licence"),
];

/// A source file without comments and unit tests.
struct Source {
    path: String,
    text: String,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let lines: Vec<&str> = code.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        Self { path: path.to_owned(), text: lines.join("\n") }
    }

    /// The module of the library; `None` for the binary and the root.
    fn module(&self) -> Option<&str> {
        let (name, _) = self.path.strip_prefix("src/")?.split_once(['/', '.'])?;
        (!["lib", "main"].contains(&name)).then_some(name)
    }

    /// The depth of its module under the root.
    fn depth(&self) -> usize {
        let inner = self.path.trim_start_matches("src/").trim_end_matches(".rs");
        inner.split('/').count()
    }

    /// Whether it uses an item of a crate.
    fn names(&self, library: &str) -> bool {
        let path = format!("{library}::");
        let is_start = |place: usize| !self.text[..place].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        self.text.match_indices(&path).any(|(place, _)| is_start(place))
    }
}

/// All sources of the crate except modules under `#[cfg(test)]`.
fn sources() -> Vec<Source> {
    let paths = files("src", ".rs");
    let texts: Vec<String> = paths.iter().map(|path| text(path)).collect();
    let tests: Vec<String> = paths.iter().zip(&texts).flat_map(|(path, text)| for_tests(path, text)).collect();
    let for_tests = |path: &str| tests.iter().any(|module| *module == path || path.starts_with(&folder(module)));
    let kept = paths.iter().zip(&texts).filter(|(path, _)| !for_tests(path));
    let sources: Vec<Source> = kept.map(|(path, text)| Source::new(path, text)).collect();
    assert!(sources.len() > 50, "only {} sources found", sources.len());
    sources
}

/// The folder of the submodules of a file.
fn folder(path: &str) -> String {
    format!("{}/", path.trim_end_matches(".rs"))
}

/// The files of the modules that a file declares under `#[cfg(test)]`.
fn for_tests(path: &str, text: &str) -> Vec<String> {
    let folder = folder(path);
    let declared = text.split("#[cfg(test)]\nmod ").skip(1).filter_map(|rest| rest.split_once([';', '{']));
    declared.map(|(name, _)| format!("{folder}{}.rs", name.trim())).collect()
}

/// The names that follow `crate::`.
fn used(text: &str) -> impl Iterator<Item = &str> {
    text.split("crate::").skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

fn wrong_imports(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    for source in sources {
        let Some(module) = source.module() else { continue };
        let Some((_, allowed)) = IMPORTS.iter().find(|(known, _)| *known == module) else {
            wrong.push(format!("{}: module {module} has no row in the table of imports", source.path));
            continue;
        };
        // In the package of the physics `crate::` is its own root.
        if module == "physics" {
            continue;
        }
        for name in used(&source.text).filter(|name| *name != module && !allowed.contains(name)) {
            wrong.push(format!("{}: {module} may not use crate::{name}", source.path));
        }
        // So many `super::` reach the root, and with it any module.
        if source.text.contains(&"super::".repeat(source.depth())) {
            wrong.push(format!("{}: write crate:: for modules at the root", source.path));
        }
    }
    wrong
}

#[test]
fn modules_use_only_what_the_table_allows() {
    assert_eq!(wrong_imports(&sources()), Vec::<String>::new());
}

#[test]
fn a_forbidden_import_is_caught() {
    for (path, text) in [
        ("src/fit.rs", "use crate::case::Case;"),
        ("src/fit.rs", "let n = crate::march::lanes();"),
        ("src/march/gpu.rs", "use crate::case::Case;"),
        ("src/case/unit.rs", "use crate::{plan, traces};"),
        ("src/traces.rs", "use super::case::Case;"),
        ("src/march/gpu/device.rs", "use super::super::super::study;"),
        ("src/chemistry.rs", "pub fn react() {}"),
    ] {
        assert_eq!(wrong_imports(&[Source::new(path, text)]).len(), 1, "{text}");
    }
    let sound = [
        ("src/march/gpu.rs", "use crate::plan::Plan;\nuse super::March;"),
        ("src/fit.rs", "//! [`Case`](crate::case::Case)\n#[cfg(test)]\nmod tests {\nuse crate::case::Case;\n}"),
        ("src/command/man.rs", "use crate::command::args::Cli;"),
    ];
    let sound = sound.map(|(path, text)| Source::new(path, text));
    assert_eq!(wrong_imports(&sound), Vec::<String>::new());
}

fn crates_outside_their_folders(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (library, homes) in HOMES {
        for source in sources.iter().filter(|source| source.names(library)) {
            let path = source.path.replace(".rs", "/");
            if !homes.iter().any(|home| source.path.starts_with(home) || path.starts_with(home)) {
                wrong.push(format!("{}: {library} is used only in {}", source.path, homes.join(", ")));
            }
        }
    }
    wrong
}

#[test]
fn every_crate_is_used_only_in_its_folders() {
    assert_eq!(crates_outside_their_folders(&sources()), Vec::<String>::new());
    for (library, homes) in HOMES {
        let is_used = sources().iter().any(|source| source.names(library));
        assert!(is_used, "{library} is not used in {}", homes.join(", "));
    }
}

#[test]
fn a_crate_used_in_another_folder_is_caught() {
    for text in
        ["use wgpu::Device;", "fn f(x: serde_json::Value) {}", "    clap::Parser::parse()", "use rayon::prelude::*;"]
    {
        assert_eq!(crates_outside_their_folders(&[Source::new("src/plan.rs", text)]).len(), 1, "{text}");
    }
    assert!(crates_outside_their_folders(&[Source::new("src/plan.rs", "my_toml::parse()")]).is_empty());
}

/// Modules of files `mod.rs`.
fn of_the_other_style(paths: &[String]) -> Vec<&String> {
    paths.iter().filter(|path| path.ends_with("/mod.rs")).collect()
}

#[test]
fn the_file_of_a_module_lies_beside_its_folder() {
    assert_eq!(of_the_other_style(&files("src", ".rs")), Vec::<&String>::new());
    assert_eq!(of_the_other_style(&["src/plan/mod.rs".to_owned(), "src/plan.rs".to_owned()]), ["src/plan/mod.rs"]);
}

fn unwraps(sources: &[Source]) -> Vec<String> {
    let unwrap = |source: &&Source| source.text.contains(".unwrap()");
    sources.iter().filter(unwrap).map(|source| source.path.clone()).collect()
}

#[test]
fn nothing_outside_tests_unwraps() {
    assert_eq!(unwraps(&sources()), Vec::<String>::new());
    assert_eq!(unwraps(&[Source::new("src/a.rs", "let x = y.unwrap();")]), ["src/a.rs"]);
}

fn unsafe_blocks(sources: &[Source]) -> Vec<String> {
    let words = |source: &Source| ["unsafe {", "unsafe fn", "unsafe impl"].map(|w| source.text.matches(w).count());
    let has = |source: &&Source| words(source).iter().sum::<usize>() > 0;
    sources.iter().filter(has).map(|source| source.path.clone()).collect()
}

#[test]
fn unsafe_code_is_only_in_device_code_and_vector_loads() {
    assert_eq!(
        unsafe_blocks(&sources()),
        ["src/march/gpu/cache.rs", "src/march/gpu/device.rs", "src/physics/lanes/simd_tables.rs"]
    );
    for spoiled in ["unsafe fn f() {}", "fn g() { unsafe { f() } }"] {
        assert_eq!(unsafe_blocks(&[Source::new("src/a.rs", spoiled)]), ["src/a.rs"]);
    }
}

/// Files with their texts.
fn with_texts(folders: &[(&str, &str)]) -> Vec<(String, String)> {
    let paths = folders.iter().flat_map(|(folder, ending)| files(folder, ending));
    paths.map(|path| (path.clone(), text(&path))).collect()
}

fn unfinished(files: &[(String, String)]) -> Vec<String> {
    // In two halves, so that this file passes.
    let words =
        [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("XX", "X"), concat!("to", "do!("), concat!("dbg", "!(")];
    let found = files.iter().filter(|(_, text)| words.iter().any(|word| text.contains(word)));
    found.map(|(path, _)| path.clone()).collect()
}

#[test]
fn no_source_is_marked_as_unfinished() {
    let sources = with_texts(&[("src", ".rs"), ("shaders", ".wgsl"), ("tests", ".rs")]);
    assert_eq!(unfinished(&sources), Vec::<String>::new());
    assert_eq!(unfinished(&[("src/a.rs".to_owned(), format!("// {}: later", concat!("TO", "DO")))]), ["src/a.rs"]);
}

/// All text files of the repository that people write.
fn texts() -> Vec<(String, String)> {
    let folders = ["src", "shaders", "tests", "benches", "scripts", "docs", "cases", "data", "python"];
    let mut paths: Vec<String> = folders.iter().flat_map(|folder| files(folder, "")).collect();
    // Python and its checkers keep what they computed beside the sources.
    paths.retain(|path| !["__pycache__/", "_cache/"].iter().any(|folder| path.contains(folder)));
    let entries = fs::read_dir(root()).expect("the root is readable").map(|entry| entry.expect("an entry").path());
    let names = entries.filter(|path| path.is_file()).filter_map(|path| path.file_name().map(ToOwned::to_owned));
    paths.extend(names.map(|name| name.to_string_lossy().into_owned()));
    // Images are not UTF-8.
    let read = |path: String| Some((path.clone(), String::from_utf8(fs::read(root().join(&path)).ok()?).ok()?));
    paths.into_iter().filter_map(read).collect()
}

fn long_lines(files: &[(String, String)]) -> Vec<String> {
    let checked = files.iter().filter(|(path, _)| !LONG_LINES.iter().any(|(part, _)| path.contains(part)));
    let lines = checked.flat_map(|(path, text)| {
        text.lines().enumerate().map(move |(index, line)| (path, index + 1, line.chars().count()))
    });
    lines
        .filter(|(_, _, columns)| *columns > COLUMNS)
        .map(|(path, line, columns)| format!("{path}:{line}: {columns} columns"))
        .collect()
}

#[test]
fn no_line_is_longer_than_120_columns() {
    let texts = texts();
    assert!(texts.len() > 400, "only {} files found", texts.len());
    let long = long_lines(&texts);
    assert!(long.is_empty(), "{} lines are longer than {COLUMNS} columns:\n{}", long.len(), long.join("\n"));
    for (part, reason) in LONG_LINES {
        let needed = texts.iter().filter(|(path, _)| path.contains(part));
        let has_long = needed.flat_map(|(_, text)| text.lines()).any(|line| line.chars().count() > COLUMNS);
        assert!(has_long, "{part} ({reason}) needs no exception");
    }
}

#[test]
fn a_line_of_121_columns_is_caught() {
    let file = |path: &str, columns: usize| (path.to_owned(), format!("short\n{}\n", "é".repeat(columns)));
    assert_eq!(long_lines(&[file("docs/a.md", 121)]), ["docs/a.md:2: 121 columns"]);
    assert_eq!(long_lines(&[file("docs/a.md", 120), file("data/a.csv", 121)]), Vec::<String>::new());
}
