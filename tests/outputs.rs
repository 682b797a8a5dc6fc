//! Output files against `docs/reference/outputs.md`: every column and key that a command writes is documented, and
//! every documented name is written. Lines on the screen have at most 120 columns.

use crate::cli::{CASE, CommandResult, decomposing_case, run};
use crate::support::{Scratch, root, text};
use bondline::case::Case;
use bondline::fit::Termination;
use bondline::question::Question;
use bondline::traces::Gauge;
use parquet::file::reader::{FileReader, SerializedFileReader};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::Path;
use std::sync::OnceLock;

/// Columns or keys by file.
type Names = BTreeMap<String, BTreeSet<String>>;

/// Documented names that these commands do not write, with the reason.
const NOT_WRITTEN: &[(&str, &str, &str)] =
    &[("devices --json", "adapters[].self_tests.error", "the software device opens")];

/// The longest line on the screen.
const COLUMNS: usize = 120;

/// The page.
fn page() -> String {
    text("docs/reference/outputs.md")
}

/// Names with braces: `a_{b,c}` is `a_b` and `a_c`.
fn expanded(name: &str) -> Vec<String> {
    let Some((before, rest)) = name.split_once('{') else { return vec![name.to_owned()] };
    let (inside, after) = rest.split_once('}').unwrap_or_else(|| panic!("an open brace in {name}"));
    inside.split(',').flat_map(|part| expanded(&format!("{before}{part}{after}"))).collect()
}

/// The texts between backticks.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

/// The names in tables of a page by file. The files are those in the last heading that names any. A table of names has
/// the columns name, unit and meaning. The line "Keys under `PATH`" before a table is a prefix of its keys.
fn documented(page: &str) -> Names {
    let mut names = Names::new();
    let mut files: Vec<&str> = Vec::new();
    let (mut is_table, mut prefix) = (false, String::new());
    for line in page.lines() {
        if let Some(rest) = line.strip_prefix("Keys under `") {
            prefix = rest.split('`').next().unwrap_or_default().to_owned() + ".";
        }
        if line.starts_with('#') {
            prefix.clear();
            let is_file = |name: &&str| (name.contains('.') && !name.contains("<case>")) || name.contains("--json");
            let found: Vec<&str> = quoted(line).filter(is_file).collect();
            files = if line.starts_with("## ") || !found.is_empty() { found } else { files };
        }
        is_table = line.starts_with('|') && (is_table || line.contains("| unit | meaning |"));
        if !is_table || !line.starts_with("| `") {
            continue;
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert!(cells.len() == 3 && cells.iter().all(|cell| !cell.is_empty()), "name, unit and meaning in {line}");
        for name in quoted(cells[0]).flat_map(|name| expanded(&format!("{prefix}{name}"))) {
            for file in &files {
                let is_new = names.entry((*file).to_owned()).or_default().insert(name.clone());
                assert!(is_new, "{file}: {name} is documented twice");
            }
        }
    }
    names
}

/// The names of a case, which stand for placeholders of the page.
struct Placeholders(Vec<(String, &'static str)>);

impl Placeholders {
    fn of(cases: &[Case]) -> Self {
        let sensors =
            cases.iter().flat_map(|case| case.sensors().iter().map(|sensor| (sensor.name.clone(), "<sensor>")));
        let factors =
            cases.iter().flat_map(|case| case.factors().iter().map(|factor| (factor.name.clone(), "<factor>")));
        let ids = cases.iter().map(|case| (case.id().to_owned(), "<case>"));
        let mut names: Vec<(String, &'static str)> = sensors.chain(factors).chain(ids).collect();
        // A name may begin with another.
        names.sort_by_key(|(name, _)| std::cmp::Reverse(name.len()));
        Self(names)
    }

    /// A key as on the page. Where several cases have a factor, the key is `factor@case`.
    fn key(&self, key: &str, parent: &str) -> String {
        let name = key.split('@').next().unwrap_or_default();
        if parent.ends_with("gauges") && Gauge::ALL.iter().any(|gauge| gauge.name() == key) {
            return "<gauge>".to_owned();
        }
        self.0.iter().find(|(own, _)| own == name).map_or(key, |(_, placeholder)| placeholder).to_owned()
    }

    /// A column as on the page: it may begin with a sensor or factor.
    fn column(&self, column: &str) -> String {
        for (name, placeholder) in self.0.iter().filter(|(_, placeholder)| *placeholder != "<case>") {
            if let Some(rest) =
                column.strip_prefix(name.as_str()).filter(|rest| rest.is_empty() || rest.starts_with('_'))
            {
                return format!("{placeholder}{rest}");
            }
        }
        column.to_owned()
    }

    /// A file as on the page, where `traces.csv` stands for the `traces-<case>.csv` of further cases too.
    fn file(&self, file: &str) -> String {
        let ids = self.0.iter().filter(|(_, placeholder)| *placeholder == "<case>");
        ids.fold(file.to_owned(), |file, (id, _)| file.replace(&format!("-{id}."), "."))
    }

    /// The key paths of a value.
    fn paths(&self, value: &Value, path: &str, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(entries) if !entries.is_empty() => {
                for (key, inner) in entries {
                    let key = self.key(key, path);
                    self.paths(inner, &if path.is_empty() { key } else { format!("{path}.{key}") }, found);
                }
            }
            Value::Array(entries) if entries.iter().any(Value::is_object) => {
                entries.iter().for_each(|inner| self.paths(inner, &format!("{path}[]"), found));
            }
            // An object without entries has none to document.
            Value::Object(_) => {}
            _ => _ = found.insert(path.to_owned()),
        }
    }
}

/// The columns of a table.
fn columns(path: &Path) -> Vec<String> {
    if path.extension().is_some_and(|ending| ending == "parquet") {
        let reader = SerializedFileReader::new(File::open(path).expect("the file exists")).expect("a Parquet file");
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        return schema.columns().iter().map(|column| column.name().to_owned()).collect();
    }
    let table = fs::read_to_string(path).expect("a table");
    table.lines().next().unwrap_or_default().split(',').map(str::to_owned).collect()
}

/// What all commands wrote: names by file, and lines of the screen with their commands.
struct Written {
    names: Names,
    screens: Vec<(String, String)>,
}

impl Written {
    /// Run a command on cases of a folder and collect its output.
    fn run(&mut self, scratch: &Scratch, words: &str, cases: &[&str]) {
        let ran = run(scratch, &format!("{words} --out out")).succeeded();
        self.screens.push((words.to_owned(), ran.stdout.clone() + &ran.stderr));
        let load = |case: &&str| Case::load(&scratch.path().join(case)).unwrap_or_else(|error| panic!("{error}"));
        let placeholders = Placeholders::of(&cases.iter().map(load).collect::<Vec<Case>>());
        let out = scratch.path().join("out");
        let mut found = Vec::new();
        if out.is_file() {
            found.push(("measured.csv".to_owned(), columns(&out)));
            fs::remove_file(&out).expect("a file of this test");
        } else {
            for entry in fs::read_dir(&out).expect("a report") {
                let path = entry.expect("a file").path();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if name.ends_with(".csv") || name.ends_with(".parquet") {
                    found.push((placeholders.file(&name), columns(&path)));
                } else if name == "summary.json" {
                    let summary = fs::read_to_string(&path).expect("a summary");
                    let summary = serde_json::from_str(&summary).expect("JSON");
                    placeholders.paths(&summary, "", self.names.entry(name).or_default());
                }
            }
            fs::remove_dir_all(&out).expect("a folder of this test");
        }
        for (file, columns) in found {
            let names = columns.iter().map(|column| placeholders.column(column));
            self.names.entry(file).or_default().extend(names);
        }
    }

    /// Run a command that prints JSON.
    fn print(&mut self, scratch: &Scratch, words: &str, file: &str) {
        let json = run(scratch, words).succeeded().json();
        Placeholders(Vec::new()).paths(&json, "", self.names.entry(file.to_owned()).or_default());
    }

    /// Run a command for its screen.
    fn show(&mut self, scratch: &Scratch, words: &str) -> CommandResult {
        let ran = run(scratch, words).succeeded();
        self.screens.push((words.to_owned(), ran.stdout.clone() + &ran.stderr));
        ran
    }
}

/// A small case with synthetic observations of its own, and one that decomposes with the same observations.
fn written() -> &'static Written {
    static WRITTEN: OnceLock<Written> = OnceLock::new();
    WRITTEN.get_or_init(|| {
        let scratch = Scratch::new("outputs");
        std::os::unix::fs::symlink(root().join("cases"), scratch.path().join("cases")).expect("the shipped cases");
        let mut written = Written { names: Names::new(), screens: Vec::new() };
        let measured = "\n[observations]\nfile = \"../measured.csv\"\nsigma = \"1 K\"\n";
        let gas = CASE.replace(
            "kind = \"heated\"\nflux = {",
            "kind = \"convective\"\nheat_transfer_coefficient = \"100 W/m^2/K\"\ngas = {",
        );
        let gas = gas.replace("0 W/cm^2", "300 K").replace("5 W/cm^2", "1300 K");
        scratch.write("bare/case.toml", CASE);
        scratch.write("own/case.toml", CASE.to_owned() + measured);
        let adapted = CASE.replacen("cells = 16", "tolerance = \"0.5 K\"", 1);
        scratch.write("adapted/case.toml", adapted + measured);
        scratch.write("limited/case.toml", CASE.replacen("3 mm\"", "3 mm\"\nlimit = \"450 K\"", 1));
        scratch.write("other/case.toml", CASE.replacen("3 mm", "3.1 mm", 1) + measured);
        scratch.write("char/case.toml", decomposing_case() + measured);
        scratch.write("gas/case.toml", gas + measured);
        let (before, rest) = CASE.split_once("kind = \"heated\"").expect("a hot face");
        let (_, rest) = rest.split_once("[[factor]]").expect("its end");
        let held = "kind = \"held\"\ntemperature = { points = [[\"0 s\", \"300 K\"], [\"20 s\", \"400 K\"]], \
                    outside = \"hold\", noise = \"1 K\", pyrometer = { wavelength = \"1.6 um\", emissivity = 0.9, \
                    face_emissivity = 0.8, face_emissivity_deviation = 0.05 } }\n\n[[factor]]";
        let heating = "[[factor]]\nname = \"f_q\"\nproperty = \"heating\"\nsmall = [0.9, 1.1]\n";
        scratch.write("held/case.toml", format!("{before}{held}{rest}").replacen(heating, "", 1));
        written.run(&scratch, "twin bare --noise 1K", &["bare"]);
        run(&scratch, "twin bare --noise 1K --out measured.csv").succeeded();
        // Questions of members are below, with few of them.
        for name in Question::NAMES {
            let question = Question::named(name).expect("a question");
            if !question.fields().contains_key("members") {
                written.run(&scratch, &format!("{name} own"), &["own"]);
            }
        }
        written.run(&scratch, "predict held", &["held"]);
        let decomposes = "predict cases/lcat-2259-pyrolysis --depth-profiles 5 --precision f32";
        written.run(&scratch, decomposes, &["cases/lcat-2259-pyrolysis"]);
        written.run(&scratch, "predict cases/permeation --depth-profiles 60s", &["cases/permeation"]);
        written.run(&scratch, "uncertainty own -n 60 --keep traces", &["own"]);
        written.run(&scratch, "uncertainty limited -n 60", &["limited"]);
        written.run(&scratch, "uncertainty own -n 3000 --until TC2\u{a0}P90±20K", &["own"]);
        written.run(&scratch, "uncertainty adapted -n 50000 --until P(TC2>1010K)±20%", &["adapted"]);
        written.run(&scratch, "uncertainty own -n 3000 --until P(TC2>900K)±20%", &["own"]);
        written.run(&scratch, "design own --sensors 2 -n 20", &["own"]);
        let estimate =
            "estimate own other --factors f_k,f_q --profile f_q --posterior --walkers 40 --mcmc-iterations 20";
        written.run(&scratch, estimate, &["own", "other"]);
        written.run(&scratch, "estimate own --compare char", &["own", "char"]);
        written.run(&scratch, "study cases/lcat-2259 -n 60 --depth-profiles 10s,40s", &["cases/lcat-2259"]);
        let limit = "size cases/lcat-2259 --ply INS --limit TC4<950K --probability 0.9 -n 40";
        written.run(&scratch, limit, &["cases/lcat-2259"]);
        let trade =
            "trade cases/lcat-2259 --ply INS=pyrogel3350,apa --size INS --limit TC4<850K --probability 0.9 -n 40";
        written.run(&scratch, trade, &["cases/lcat-2259"]);
        written.run(&scratch, "history cases/lamp-test", &["cases/lamp-test"]);
        written.run(&scratch, "history gas --knots 4", &["gas"]);
        written.run(&scratch, "twin cases/twin-tc3 --study 4", &["cases/twin-tc3"]);
        for piece in ["0..20", "20..40"] {
            written.show(&scratch, &format!("uncertainty own -n 40 --members {piece} --out pieces"));
        }
        written.run(&scratch, "merge pieces/own-0-20.json pieces/own-20-40.json", &["own"]);
        written.print(&scratch, "devices --json", "devices --json");
        written.print(&scratch, "verify --json --group fit", "verify --json");
        written.show(&scratch, "devices");
        written.show(&scratch, "materials list");
        written.show(&scratch, "materials show pyrogel3350");
        written.show(&scratch, "materials show tacot");
        help(&mut written, &scratch, "");
        written
    })
}

/// The help of a command and of its subcommands.
fn help(written: &mut Written, scratch: &Scratch, command: &str) {
    let help = written.show(scratch, &format!("{command} --help")).stdout;
    let listed = help.split("\nCommands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).unwrap_or_default();
    let names = listed.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        self::help(written, scratch, format!("{command} {name}").trim());
    }
}

/// Names that are written and not documented, and the other way round.
fn differences(documented: &Names, written: &Names) -> Vec<String> {
    let mut found = Vec::new();
    let has = |names: &Names, file: &str, name: &str| names.get(file).is_some_and(|names| names.contains(name));
    for (file, names) in written {
        let missing = names.iter().filter(|name| !has(documented, file, name));
        found.extend(missing.map(|name| format!("{file}: {name} is written and not documented")));
    }
    for (file, names) in documented {
        let unknown = names.iter().filter(|name| !has(written, file, name));
        let unknown = unknown
            .filter(|name| !NOT_WRITTEN.iter().any(|(of, key, _)| (of, key) == (&file.as_str(), &name.as_str())));
        found.extend(unknown.map(|name| format!("{file}: {name} is documented and not written")));
    }
    found
}

#[test]
fn every_output_is_documented_and_every_documented_output_is_written() {
    let (documented, written) = (documented(&page()), &written().names);
    assert!(documented.len() > 20, "only {} files are documented", documented.len());
    let found = differences(&documented, written);
    assert!(found.is_empty(), "docs/reference/outputs.md:\n{}", found.join("\n"));
    for (file, name, reason) in NOT_WRITTEN {
        assert!(documented[*file].contains(*name), "{file}: {name} ({reason}) needs no exception");
        assert!(!written[*file].contains(*name), "{file}: {name} is written, in spite of the exception: {reason}");
    }
}

#[test]
fn a_missing_row_and_an_unknown_row_of_the_page_are_caught() {
    let page = page();
    for (row, file, name) in [
        ("| `seed` |", "summary.json", "seed"),
        ("| `objective_rise` |", "profiles.csv", "objective_rise"),
        ("| `criterion_worst` |", "designs.csv", "criterion_worst"),
    ] {
        assert_eq!(page.matches(row).count(), 1, "{row}");
        let without = page.replace(row, &row.replace(name, "renamed"));
        let found = differences(&documented(&without), &written().names);
        let expected = [
            format!("{file}: {name} is written and not documented"),
            format!("{file}: renamed is documented and not written"),
        ];
        assert_eq!(found, expected, "{row}");
    }
}

/// Every reason why a minimisation ends.
const TERMINATIONS: [Termination; 7] = [
    Termination::ResidualsZero,
    Termination::Gradient,
    Termination::Reduction,
    Termination::Step,
    Termination::MaxIterations,
    Termination::Stalled,
    Termination::NotFinite,
];

#[test]
fn every_termination_is_documented() {
    let page = page();
    for termination in TERMINATIONS {
        let row = format!("| `{termination}` | {} | ", if termination.converged() { "yes" } else { "no" });
        assert_eq!(page.matches(&row).count(), 1, "docs/reference/outputs.md: {row}");
    }
}

#[test]
fn placeholders_stand_for_the_longest_name() {
    let names = Placeholders(vec![("f_k_INS".into(), "<factor>"), ("f_k".into(), "<factor>"), ("c".into(), "<case>")]);
    assert_eq!(names.column("f_k_INS_share"), "<factor>_share");
    assert_eq!(names.column("f_kx"), "f_kx");
    assert_eq!(names.key("f_k@c", ""), "<factor>");
    assert_eq!(names.key("gas_flux_kg_m2_s", "resolution.gauges"), "<gauge>");
    assert_eq!(names.file("traces-c.csv"), "traces.csv");
    assert_eq!(expanded("a.{b,c}_{1,2}"), ["a.b_1", "a.b_2", "a.c_1", "a.c_2"]);
}

/// Lines of the screen that are longer than they may be.
fn long_lines(screens: &[(String, String)]) -> Vec<String> {
    let lines = screens.iter().flat_map(|(words, screen)| screen.lines().map(move |line| (words, line)));
    let long = lines.filter(|(_, line)| line.chars().count() > COLUMNS);
    long.map(|(words, line)| format!("bondline {words}: {line}")).collect()
}

#[test]
fn no_line_on_the_screen_is_longer_than_120_columns() {
    let screens = &written().screens;
    assert!(screens.len() > 30, "only {} screens", screens.len());
    let found = long_lines(screens);
    assert!(found.is_empty(), "{}", found.join("\n"));
    let wide = [("predict".to_owned(), format!("short\n{}", "–".repeat(COLUMNS + 1)))];
    assert_eq!(long_lines(&wide).len(), 1);
}
