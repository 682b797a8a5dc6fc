//! The commit that a release is built from, for the provenance of its results: `BONDLINE_COMMIT` if it is set, else
//! that of the git repository. A build without both has no commit. Other profiles have none either, because they would
//! be built anew after every commit.
//!
//! And `BONDLINE_SOLVER`, a hash of the sources on which cells and time steps depend: plans that another solver adapted
//! are not taken from the user's cache.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

/// The modules that adaptation uses: a file, a folder or both. A published package has no physics: they are a package
/// whose version it fixes.
const SOLVER: [&str; 11] =
    ["adapt", "case", "ensemble", "fit", "limits", "march", "numerics", "physics", "plan", "random", "traces"];

fn main() -> io::Result<()> {
    let mut hasher = DefaultHasher::new();
    for path in SOLVER.iter().flat_map(|name| [format!("src/{name}.rs"), format!("src/{name}")]) {
        if Path::new(&path).exists() {
            println!("cargo::rerun-if-changed={path}");
            add_sources(Path::new(&path), &mut hasher)?;
        }
    }
    println!("cargo::rustc-env=BONDLINE_SOLVER={:016x}", hasher.finish());
    println!("cargo::rerun-if-env-changed=BONDLINE_COMMIT");
    let given = std::env::var("BONDLINE_COMMIT").ok();
    if let Some(commit) = given.or_else(|| is_release().then(commit_of_repository).flatten()) {
        println!("cargo::rustc-env=BONDLINE_COMMIT={commit}");
    }
    Ok(())
}

/// Hash a file, or the files of a folder in the order of their names.
fn add_sources(path: &Path, hasher: &mut DefaultHasher) -> io::Result<()> {
    if path.is_file() {
        fs::read(path)?.hash(hasher);
        return Ok(());
    }
    let mut inner = fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<PathBuf>>>()?;
    inner.sort();
    inner.iter().try_for_each(|path| add_sources(path, hasher))
}

/// Whether the profile is `release`: its folder has the name, above `build/<package>/out`.
fn is_release() -> bool {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    out.ancestors().nth(3).and_then(Path::file_name).is_some_and(|profile| profile == "release")
}

/// The commit, with `-dirty` if tracked files differ from it.
fn commit_of_repository() -> Option<String> {
    // A source archive inside another repository has no commit of its own.
    if !Path::new(".git").exists() {
        return None;
    }
    for path in [".git/HEAD", ".git/logs/HEAD", "src", "shaders", "data", "Cargo.toml", "Cargo.lock", "build.rs"] {
        println!("cargo::rerun-if-changed={path}");
    }
    let output = Command::new("git").args(["describe", "--always", "--abbrev=40", "--exclude=*", "--dirty"]).output();
    let output = output.ok().filter(|output| output.status.success())?;
    let commit = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (!commit.is_empty()).then_some(commit)
}
