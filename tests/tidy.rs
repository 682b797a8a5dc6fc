//! The tree's own rules, read from its sources. Each is a function from sources to complaints, which must find
//! nothing in the tree and something in an example that breaks it. A new arrow between modules, or a new home for a
//! crate, is a deliberate edit of the tables here.

use crate::support::{files, text};

/// Which modules of the library each may use. The binary may use all of it, through its public face.
const IMPORTS: &[(&str, &[&str])] = &[
    ("case", &[]),
    ("traces", &[]),
    ("chance", &[]),
    ("fit", &["chance"]),
    ("ensemble", &["case", "chance"]),
    // Of the traces only the names of gauges, whose errors a plan states.
    ("plan", &["case", "traces"]),
    ("physics", &["plan"]),
    ("march", &["plan", "ensemble", "traces", "physics"]),
    ("study", &["case", "chance", "plan", "pilot", "ensemble", "traces", "march", "fit"]),
    // Of the march only what records name: backend and precision; of the fit the loss that is told.
    ("report", &["case", "traces", "study", "march", "fit"]),
    ("session", &["case", "plan", "pilot", "ensemble", "traces", "march", "fit", "study", "report"]),
    ("pilot", &["case", "plan", "ensemble", "traces", "march"]),
    ("verify", &["case", "chance", "plan", "pilot", "ensemble", "traces", "march", "fit"]),
    // The command's folder. It is not part of the library, which it uses by its public face.
    ("command", &[]),
];

/// Where each crate is at home: a file, or a folder that ends in a stroke.
const HOMES: &[(&str, &[&str])] = &[
    ("wgpu", &["src/march/gpu/"]),
    ("pollster", &["src/march/gpu/"]),
    ("bytemuck", &["src/march/gpu/"]),
    ("simdeez", &["src/physics/lanes", "src/march/cpu.rs"]),
    ("rayon", &["src/pilot.rs", "src/march/cpu.rs", "src/study/statistics", "src/session/", "src/command/devices.rs"]),
    (
        "serde",
        &["src/report/", "src/case/", "src/fit/", "src/march/mod.rs", "src/plan/mod.rs", "src/study/", "src/traces.rs"],
    ),
    ("serde_json", &["src/report/", "src/study/sweep_piece.rs", "src/command/devices.rs", "src/command/verify.rs"]),
    ("twox_hash", &["src/study/sweep_piece.rs"]),
    ("clap", &["src/command/args/", "src/main.rs"]),
    ("anyhow", &["src/command/exit.rs", "src/main.rs"]),
    ("indicatif", &["src/command/progress.rs"]),
    ("nalgebra", &["src/fit/", "src/study/", "src/verify/least_squares/"]),
    ("rand_chacha", &["src/chance.rs"]),
    ("sobol_burley", &["src/ensemble/"]),
    ("toml", &["src/case/file/"]),
    ("csv", &["src/case/file/sheet", "src/report/files/"]),
    ("parquet", &["src/report/files/"]),
    ("plotters", &["src/report/svg/"]),
    ("textplots", &["src/report/materials/"]),
];

/// Names that say nothing of what a type is.
const EMPTY_NAMES: &[&str] = &["solver", "model", "simulation", "manager", "context", "util", "helper", "data"];

/// A file's path and its text without comments and unit tests.
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

    /// The library module it belongs to; none for the binary and the root.
    fn module(&self) -> Option<&str> {
        let (name, inner) = self.path.strip_prefix("src/")?.split_once(['/', '.'])?;
        let is_module = inner != "rs" || IMPORTS.iter().any(|(known, _)| *known == name);
        is_module.then_some(name)
    }

    /// How many modules deep its own module lies under the root.
    fn depth(&self) -> usize {
        let inner = self.path.trim_start_matches("src/").trim_end_matches(".rs").trim_end_matches("/mod");
        inner.split('/').count()
    }

    /// Whether it names a crate's items.
    fn names(&self, library: &str) -> bool {
        let path = format!("{library}::");
        let is_start = |place: usize| !self.text[..place].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        self.text.match_indices(&path).any(|(place, _)| is_start(place))
    }
}

/// All sources of the crate but those that exist for tests alone.
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

/// The folder of the modules that a file declares.
fn folder(path: &str) -> String {
    format!("{}/", path.trim_end_matches("mod.rs").trim_end_matches(".rs").trim_end_matches('/'))
}

/// The files of modules that a file declares for tests alone.
fn for_tests(path: &str, text: &str) -> Vec<String> {
    let folder = folder(path);
    let declared = text.split("#[cfg(test)]\nmod ").skip(1).filter_map(|rest| rest.split_once([';', '{']));
    declared.map(|(name, _)| format!("{folder}{}.rs", name.trim())).collect()
}

/// What follows each `crate::` up to the end of the name.
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
        for name in used(&source.text).filter(|name| *name != module && !allowed.contains(name)) {
            wrong.push(format!("{}: {module} may not use crate::{name}", source.path));
        }
        // From as many modules down, so many steps up reach the root, and with it any module.
        if source.text.contains(&"super::".repeat(source.depth())) {
            wrong.push(format!("{}: write crate:: for what lies at the root", source.path));
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
        ("src/fit/mod.rs", "use crate::case::Case;"),
        ("src/physics/step.rs", "let n = crate::march::lanes();"),
        ("src/march/gpu/mod.rs", "use crate::case::Case;"),
        ("src/case/unit.rs", "use crate::{plan, traces};"),
        ("src/traces.rs", "use super::case::Case;"),
        ("src/march/gpu/device.rs", "use super::super::super::study;"),
        ("src/chemistry/mod.rs", "pub fn react() {}"),
    ] {
        assert_eq!(wrong_imports(&[Source::new(path, text)]).len(), 1, "{text}");
    }
    let sound = [
        ("src/march/gpu/mod.rs", "use crate::plan::Plan;\nuse super::March;"),
        ("src/fit/mod.rs", "//! [`Case`](crate::case::Case)\n#[cfg(test)]\nmod tests {\nuse crate::case::Case;\n}"),
        ("src/main.rs", "use crate::command::args::Cli;"),
    ];
    let sound = sound.map(|(path, text)| Source::new(path, text));
    assert_eq!(wrong_imports(&sound), Vec::<String>::new());
}

fn strays(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (library, homes) in HOMES {
        for source in sources.iter().filter(|source| source.names(library)) {
            if !homes.iter().any(|home| source.path.starts_with(home)) {
                wrong.push(format!("{}: {library} is at home in {}", source.path, homes.join(", ")));
            }
        }
    }
    wrong
}

#[test]
fn every_crate_stays_at_home() {
    assert_eq!(strays(&sources()), Vec::<String>::new());
    for (library, homes) in HOMES {
        let is_used = sources().iter().any(|source| source.names(library));
        assert!(is_used, "{library} has a home, {}, and nobody uses it", homes.join(", "));
    }
}

#[test]
fn a_crate_abroad_is_caught() {
    for text in
        ["use wgpu::Device;", "fn f(x: serde_json::Value) {}", "    clap::Parser::parse()", "use rayon::prelude::*;"]
    {
        assert_eq!(strays(&[Source::new("src/plan/mod.rs", text)]).len(), 1, "{text}");
    }
    assert!(strays(&[Source::new("src/plan/mod.rs", "my_toml::parse()")]).is_empty());
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
fn nothing_is_unsafe_but_the_words_of_a_kernel_what_was_compiled_of_them_and_the_loads_of_vectors() {
    assert_eq!(
        unsafe_blocks(&sources()),
        ["src/march/gpu/cache.rs", "src/march/gpu/device.rs", "src/physics/lanes/abreast.rs"]
    );
    for spoiled in ["unsafe fn f() {}", "fn g() { unsafe { f() } }"] {
        assert_eq!(unsafe_blocks(&[Source::new("src/a.rs", spoiled)]), ["src/a.rs"]);
    }
}

fn empty_names(sources: &[Source]) -> Vec<String> {
    let mut wrong = Vec::new();
    for source in sources {
        for line in source.text.lines() {
            let words: Vec<&str> = line.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
            let declared = words.windows(2).find(|pair| ["struct", "enum", "trait"].contains(&pair[0]));
            let name = declared.map_or("", |pair| pair[1]);
            if EMPTY_NAMES.iter().any(|empty| name.to_lowercase().contains(empty)) {
                wrong.push(format!("{}: {name}", source.path));
            }
        }
    }
    wrong
}

#[test]
fn every_type_is_named_for_what_it_is() {
    assert_eq!(empty_names(&sources()), Vec::<String>::new());
    assert_eq!(empty_names(&[Source::new("src/a.rs", "pub struct HeatSolver<R> {}")]), ["src/a.rs: HeatSolver"]);
}

/// Files with their texts, whole.
fn whole(folders: &[(&str, &str)]) -> Vec<(String, String)> {
    let paths = folders.iter().flat_map(|(folder, ending)| files(folder, ending));
    paths.map(|path| (path.clone(), text(&path))).collect()
}

fn put_off(files: &[(String, String)]) -> Vec<String> {
    // Written in two halves, so that this file does not find itself.
    let words =
        [concat!("TO", "DO"), concat!("FIX", "ME"), concat!("XX", "X"), concat!("to", "do!("), concat!("dbg", "!(")];
    let found = files.iter().filter(|(_, text)| words.iter().any(|word| text.contains(word)));
    found.map(|(path, _)| path.clone()).collect()
}

#[test]
fn nothing_is_put_off() {
    assert_eq!(put_off(&whole(&[("src", ".rs"), ("shaders", ".wgsl"), ("tests", ".rs")])), Vec::<String>::new());
    assert_eq!(put_off(&[("src/a.rs".to_owned(), format!("// {}: later", concat!("TO", "DO")))]), ["src/a.rs"]);
}
