//! The commit that a release is built from, for the provenance of its results: `BONDLINE_COMMIT` if it is set, else
//! that of the git repository. A build without both has no commit. Other profiles have none either, because they would
//! be built anew after every commit.

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=BONDLINE_COMMIT");
    let given = std::env::var("BONDLINE_COMMIT").ok();
    if let Some(commit) = given.or_else(|| is_release().then(commit_of_repository).flatten()) {
        println!("cargo::rustc-env=BONDLINE_COMMIT={commit}");
    }
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
