//! Every environment variable that is read is in the book, has its effect, and is refused by its name if it is bad.

use crate::cli::{CASE, CommandResult, run_with};
use crate::support::{Scratch, files, text};
use std::collections::BTreeSet;

const PAGE: &str = "docs/reference/environment.md";

/// Variables of the page that the program reads through another one.
const OF_OTHERS: [&str; 10] = [
    "VK_DRIVER_FILES",
    "VK_ICD_FILENAMES",
    "XDG_RUNTIME_DIR",
    "NODEVICE_SELECT",
    "COLUMNS",
    "TERM",
    "LANG",
    "NO_COLOR",
    "CLICOLOR",
    "CLICOLOR_FORCE",
];

/// A variable that the build script gives to the compiler.
const OF_BUILD: &str = "BONDLINE_SOLVER";

fn is_variable(word: &str) -> bool {
    word.len() >= 4 && word.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
}

/// The texts in quotes that are names of variables, of the files that read any, without their tests.
fn read_by_the_program() -> BTreeSet<String> {
    let sources = files("src", ".rs").into_iter().chain(files("python/src", ".rs"));
    let is_test = |path: &String| path.contains("/tests/") || path.ends_with("/tests.rs");
    let mut found = BTreeSet::new();
    for path in sources.filter(|path| !is_test(path)) {
        let text = text(&path);
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        if ["env::var", "env!(\"BONDLINE"].iter().any(|reads| code.contains(reads)) {
            // Names of values in the help of options are no variables.
            let lines = code.lines().filter(|line| !line.contains("value_name"));
            found.extend(lines.flat_map(|line| line.split('"')).filter(|word| is_variable(word)).map(str::to_owned));
        }
    }
    // Those of the compiler.
    found.retain(|name| name != OF_BUILD && !name.starts_with("CARGO_"));
    found
}

/// The variables of the tests and of the scripts.
fn read_by_tests() -> BTreeSet<String> {
    let folders = ["src", "tests", "scripts", "python/tests", "benches"];
    let texts = folders.iter().flat_map(|folder| files(folder, "")).chain(["build.rs".to_owned()]);
    let texts = texts.filter(|path| [".rs", ".sh", ".py"].iter().any(|ending| path.ends_with(ending)));
    let mut found = BTreeSet::new();
    for text in texts.map(|path| text(&path)) {
        for rest in text.split("BONDLINE_").skip(1) {
            let end = rest.find(|c: char| !c.is_ascii_uppercase() && c != '_').unwrap_or(rest.len());
            found.insert(format!("BONDLINE_{}", &rest[..end]));
        }
    }
    found.remove(OF_BUILD);
    found.remove("BONDLINE_");
    found
}

fn on_the_page() -> BTreeSet<String> {
    let page = text(PAGE);
    page.split('`').skip(1).step_by(2).filter(|word| is_variable(word)).map(str::to_owned).collect()
}

#[test]
fn the_page_has_every_variable_that_is_read_and_no_others() {
    let read: BTreeSet<String> = read_by_the_program().into_iter().chain(read_by_tests()).collect();
    assert!(read.contains("SLURM_ARRAY_TASK_ID") && read.contains("BONDLINE_ALL"), "{read:?}");
    let described: BTreeSet<String> =
        on_the_page().into_iter().filter(|name| !OF_OTHERS.contains(&name.as_str())).collect();
    assert_eq!(described, read);
}

/// The case without cells and steps, whose plan is adapted and kept.
fn adapted(scratch: &Scratch) {
    let (case, _) = CASE.split_once("[resolution]").expect("the resolution");
    scratch.write("c/case.toml", format!("{case}[resolution]\ntolerance = \"5 K\"\n"));
}

fn kept_plans(scratch: &Scratch, folder: &str) -> usize {
    let folder = format!("{folder}/bondline/plans/");
    scratch.files().iter().filter(|path| path.to_string_lossy().starts_with(&folder)).count()
}

#[test]
fn every_variable_has_its_effect_and_a_bad_value_is_refused_by_its_name() {
    let scratch = Scratch::new("environment");
    adapted(&scratch);
    let path = |name: &str| scratch.path().join(name).display().to_string();
    let run = |line: &str, variables: &[(&str, &str)]| -> CommandResult { run_with(&scratch, line, variables) };
    for threads in ["1", "2"] {
        let found = run("predict c --json", &[("RAYON_NUM_THREADS", threads)]).succeeded().json();
        assert_eq!(found["provenance"]["threads"].to_string(), threads);
    }
    let (cache, home) = (path("cache"), path("home"));
    run("predict c", &[("XDG_CACHE_HOME", cache.as_str()), ("HOME", home.as_str())]).succeeded();
    assert_eq!((kept_plans(&scratch, "cache"), kept_plans(&scratch, "home/.cache")), (1, 0));
    run("predict c", &[("XDG_CACHE_HOME", "relative"), ("HOME", home.as_str())]).succeeded();
    assert_eq!((kept_plans(&scratch, "relative"), kept_plans(&scratch, "home/.cache")), (0, 1));
    let piece = "uncertainty c -n 20 --piece 4";
    run(piece, &[("SLURM_ARRAY_TASK_ID", "2")]).succeeded();
    assert!(scratch.path().join("out/c/uncertainty/c-5-10.json").is_file(), "{:?}", scratch.files());
    for (line, variable, value, message) in [
        ("predict c", "RAYON_NUM_THREADS", "many", "RAYON_NUM_THREADS=many: expected a number of threads"),
        ("predict c", "RAYON_NUM_THREADS", "-1", "RAYON_NUM_THREADS=-1: expected a number of threads"),
        ("predict c", "RAYON_NUM_THREADS", "", "RAYON_NUM_THREADS=: expected a number of threads"),
        ("predict c", "RAYON_NUM_THREADS", "1025", "RAYON_NUM_THREADS=1025: expected at most 1,024 threads"),
        ("predict c", "RAYON_RS_NUM_CPUS", "2", "RAYON_RS_NUM_CPUS is the old name of RAYON_NUM_THREADS"),
        (piece, "SLURM_ARRAY_TASK_ID", "5", "found piece \"5\" from SLURM_ARRAY_TASK_ID of \"4\""),
        (piece, "SLURM_ARRAY_TASK_ID", "two", "found piece \"two\" from SLURM_ARRAY_TASK_ID of \"4\""),
    ] {
        let files = scratch.files();
        run(line, &[(variable, value)]).exited_with(2).with_stderr(&[message]);
        assert_eq!(scratch.files(), files, "{variable}={value}");
    }
    run(piece, &[]).exited_with(2).with_stderr(&["SLURM_ARRAY_TASK_ID is not set"]);
    let is_coloured = |variables: &[(&str, &str)]| run("--help", variables).succeeded().stdout.contains('\u{1b}');
    assert!(is_coloured(&[("CLICOLOR_FORCE", "1")]) && !is_coloured(&[]));
    let widest = |columns: &str| {
        let help = run("predict --help", &[("COLUMNS", columns)]).succeeded().stdout;
        help.lines().map(|line| line.chars().count()).max()
    };
    assert!(widest("60") < widest("100"), "{:?} and {:?}", widest("60"), widest("100"));
}
