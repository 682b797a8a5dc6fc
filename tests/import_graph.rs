//! The graph of imports between files has no cycle. A module may use the files of its own folder and be used by them:
//! it declares the items that they share.

use crate::support::{files, text};
use std::collections::{BTreeMap, BTreeSet};

/// A path as segments, from the crate's root.
type Path = Vec<String>;

struct File {
    module: Path,
    /// Imports, and names that it re-exports.
    imports: Vec<Path>,
    exports: BTreeMap<String, Path>,
}

/// `src/plan.rs` is `plan`; `src/lib.rs` is the root. The physics are another package, which the library imports as
/// a module.
fn module(file: &str) -> Path {
    let inner = file.trim_start_matches("src/").trim_end_matches(".rs");
    let inner = inner.trim_end_matches("/lib");
    if inner == "lib" { Vec::new() } else { inner.split('/').map(str::to_owned).collect() }
}

/// The root of the package of a module.
fn root(module: &[String]) -> Path {
    module.iter().take_while(|name| *name == "physics").cloned().collect()
}

/// The paths of an import tree: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expanded(tree: &str) -> Vec<String> {
    let Some((prefix, rest)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap_or_default().trim().to_owned()];
    };
    let (mut depth, mut branches) = (0, vec![String::new()]);
    for letter in rest.trim_end().trim_end_matches('}').chars() {
        depth += i32::from(letter == '{') - i32::from(letter == '}');
        match letter {
            ',' if depth == 0 => branches.push(String::new()),
            _ => branches.last_mut().expect("there is one at the start").push(letter),
        }
    }
    let branches = branches.iter().map(|branch| branch.trim()).filter(|branch| !branch.is_empty());
    branches.flat_map(expanded).map(|branch| format!("{}{branch}", prefix.trim())).collect()
}

/// A path from the crate's root; `None` for another crate.
fn absolute(path: &str, module: &[String], submodules: &BTreeSet<Path>) -> Option<Path> {
    let mut segments: Vec<&str> = path.split("::").map(str::trim).collect();
    let mut base = module.to_vec();
    match segments[0] {
        "crate" => {
            base = root(module);
            segments.remove(0);
        }
        "self" => {
            segments.remove(0);
        }
        "super" => {
            while segments.first() == Some(&"super") {
                base.pop();
                segments.remove(0);
            }
        }
        name => {
            let mut inner = base.clone();
            inner.push(name.to_owned());
            if !submodules.contains(&inner) {
                return None;
            }
        }
    }
    base.extend(segments.into_iter().filter(|segment| *segment != "self").map(str::to_owned));
    Some(base)
}

fn parsed(path: &str, text: &str, modules: &BTreeSet<Path>) -> File {
    let own = module(path);
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines: Vec<&str> = code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    let (mut imports, mut exports) = (Vec::new(), BTreeMap::new());
    for statement in lines.join("\n").split(';') {
        let declared = statement.rsplit_once("use ").filter(|(before, _)| {
            let before = before.trim_end().rsplit(['\n', '}', '{']).next().unwrap_or_default().trim();
            before.is_empty() || before.starts_with("pub") || before.starts_with("#[")
        });
        if let Some((before, tree)) = declared {
            let is_export = before.trim_end().ends_with("pub") || before.trim_end().ends_with(')');
            for path in expanded(tree).iter().filter_map(|path| absolute(path, &own, modules)) {
                if is_export && let Some(name) = path.last() {
                    exports.insert(name.clone(), path.clone());
                }
                imports.push(path);
            }
        } else {
            for rest in statement.split("crate::").skip(1) {
                let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(rest.len());
                let segments = rest[..end].split("::").filter(|segment| !segment.is_empty()).map(str::to_owned);
                imports.push(root(&own).into_iter().chain(segments).collect());
            }
        }
    }
    File { module: own, imports, exports }
}

/// The module that defines the item of a path, with re-exports followed.
fn home<'a>(path: &[String], files: &'a [File]) -> Option<&'a File> {
    let (mut path, mut turns) = (path.to_vec(), 0);
    loop {
        let depth = (0..=path.len()).rev().find(|&depth| files.iter().any(|file| file.module == path[..depth]))?;
        let file = files.iter().find(|file| file.module == path[..depth])?;
        turns += 1;
        match path.get(depth).and_then(|name| file.exports.get(name)) {
            Some(export) if turns < 9 && export[..] != path[..=depth] => {
                path = export.iter().chain(&path[depth + 1..]).cloned().collect();
            }
            _ => return Some(file),
        }
    }
}

/// Modules that are part of an import cycle.
fn cyclic(sources: &[(String, String)]) -> Vec<String> {
    let modules: BTreeSet<Path> = sources.iter().map(|(path, _)| module(path)).collect();
    let files: Vec<File> = sources.iter().map(|(path, text)| parsed(path, text, &modules)).collect();
    let is_part = |part: &Path, whole: &Path| part.len() > whole.len() && part[..whole.len()] == whole[..];
    let mut reached: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
    for file in &files {
        let homes = file.imports.iter().filter_map(|path| home(path, &files)).map(|home| &home.module);
        let others =
            homes.filter(|home| **home != file.module && !is_part(home, &file.module) && !is_part(&file.module, home));
        reached.insert(&file.module, others.collect());
    }
    // The transitive closure: there are some 250 files.
    loop {
        let count: usize = reached.values().map(BTreeSet::len).sum();
        for module in modules.iter() {
            let onward: BTreeSet<&Path> = reached[module].iter().flat_map(|next| &reached[next]).copied().collect();
            reached.entry(module).or_default().extend(onward);
        }
        if reached.values().map(BTreeSet::len).sum::<usize>() == count {
            break;
        }
    }
    reached.iter().filter(|(module, all)| all.contains(*module)).map(|(module, _)| module.join("::")).collect()
}

#[test]
fn imports_have_no_cycle() {
    let sources: Vec<(String, String)> =
        files("src", ".rs").into_iter().map(|path| (path.clone(), text(&path))).collect();
    assert!(sources.len() > 100, "only {} sources found", sources.len());
    assert_eq!(cyclic(&sources), Vec::<String>::new());
}

#[test]
fn a_cycle_through_a_list_a_re_export_or_a_third_file_is_caught() {
    let of = |texts: &[(&str, &str)]| {
        let sources: Vec<(String, String)> =
            texts.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
        cyclic(&sources)
    };
    let root = ("src/lib.rs", "mod plan;");
    let sound = ("src/plan/time_grid.rs", "use super::grid::Grid;");
    assert_eq!(of(&[root, ("src/plan.rs", "pub use grid::Grid;"), sound, ("src/plan/grid.rs", "")]).len(), 0);
    for grid in [
        "use super::time_grid::TimeGrid;",
        "use crate::plan::{Plan, time_grid::TimeGrid};",
        "use super::{TimeGrid, Plan};",
        "fn f() -> crate::plan::time_grid::TimeGrid {}",
        "use super::step_data::Steps;",
    ] {
        let plan = ("src/plan.rs", "mod time_grid;\npub use time_grid::TimeGrid;\npub struct Plan;");
        let steps = ("src/plan/step_data.rs", "use super::time_grid::TimeGrid;");
        let found = of(&[root, plan, sound, steps, ("src/plan/grid.rs", grid)]);
        assert!(found.contains(&"plan::grid".to_owned()), "{grid}: {found:?}");
    }
    let physics = ("src/physics/lib.rs", "mod step;\nmod state;");
    let state = ("src/physics/state.rs", "use crate::step::Step;");
    for step in ["use super::state::State;", "fn f() -> crate::state::State {}"] {
        assert_eq!(of(&[root, physics, state, ("src/physics/step.rs", step)]).len(), 2, "{step}");
    }
}
