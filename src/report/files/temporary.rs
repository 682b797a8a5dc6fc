//! Temporary files and folders beside the outputs that they become: `.bondline-HOST-PROCESS-RANDOM.partial`. A name
//! says which process made it, so that the leftovers of a killed process can be told from files in use.

use std::collections::hash_map::RandomState;
use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher};
use std::io;
use std::path::{Path, PathBuf};

const PREFIX: &str = ".bondline-";
const SUFFIX: &str = ".partial";

/// The longest part of the host in a name.
const MAX_HOST_CHARS: usize = 40;

/// A path for a file or folder that is complete once it is renamed. What is left under the path is removed on drop.
#[derive(Debug)]
pub(super) struct TemporaryPath(PathBuf);

impl TemporaryPath {
    /// A new name in a folder. Nothing is created.
    pub(super) fn new_in(folder: &Path) -> Self {
        let random = RandomState::new().build_hasher().finish();
        let name = format!("{PREFIX}{}-{}-{random:016x}{SUFFIX}", host_in_names(), std::process::id());
        Self(folder.join(name))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TemporaryPath {
    fn drop(&mut self) {
        remove(&self.0);
    }
}

/// Make a file in a folder, and remove it.
///
/// # Errors
/// When none can be made.
pub(super) fn check_writable(folder: &Path) -> io::Result<()> {
    File::create_new(TemporaryPath::new_in(folder).path()).map(|_| ())
}

/// Remove a temporary file or folder. An error is ignored: the next run of this host tries again.
fn remove(path: &Path) {
    let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
}

/// Remove what processes of this host that have ended left in a folder.
pub(super) fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if owner(&entry.file_name().to_string_lossy()).is_some_and(|process| !is_alive(process)) {
            remove(&entry.path());
        }
    }
}

/// Whether a name is that of a temporary file or folder, of any process.
pub(super) fn is_temporary(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(SUFFIX)
}

/// The process of this host that made a temporary name.
fn owner(name: &str) -> Option<i32> {
    let middle = name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
    let (maker, _) = middle.rsplit_once('-')?;
    let (host, process) = maker.rsplit_once('-')?;
    (host == host_in_names()).then(|| process.parse().ok()).flatten()
}

fn host_in_names() -> String {
    let plain = |letter: char| if letter.is_ascii_alphanumeric() || letter == '-' { letter } else { '_' };
    host().chars().map(plain).take(MAX_HOST_CHARS).collect()
}

/// The name of this host.
#[cfg(unix)]
pub(super) fn host() -> String {
    rustix::system::uname().nodename().to_string_lossy().into_owned()
}

#[cfg(not(unix))]
pub(super) fn host() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_else(|_| "host".to_owned())
}

/// Whether a process of this host runs. One that may not be asked does.
#[cfg(unix)]
fn is_alive(process: i32) -> bool {
    let process = rustix::process::Pid::from_raw(process);
    process.is_some_and(|process| rustix::process::test_kill_process(process) != Err(rustix::io::Errno::SRCH))
}

#[cfg(not(unix))]
fn is_alive(_process: i32) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::super::scratch::Scratch;
    use super::*;

    /// A process that has ended and was waited for.
    fn ended_process() -> u32 {
        let mut child = std::process::Command::new("true").spawn().expect("a process starts");
        child.wait().expect("it ends");
        child.id()
    }

    #[test]
    fn only_leftovers_of_ended_processes_of_this_host_are_swept() {
        let scratch = Scratch::new("sweep");
        fs::create_dir_all(&scratch.0).expect("a folder");
        let name = |host: &str, process: u32| format!("{PREFIX}{host}-{process}-0{SUFFIX}");
        let (host, ended) = (host_in_names(), ended_process());
        let kept = [name(&host, std::process::id()), name("elsewhere", ended), "notes.partial".to_owned()];
        for name in kept.iter().chain([&name(&host, ended)]) {
            fs::write(scratch.0.join(name), "x").expect("a file");
        }
        sweep(&scratch.0);
        let mut left: Vec<String> = fs::read_dir(&scratch.0)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        left.sort();
        let mut kept = kept.to_vec();
        kept.sort();
        assert_eq!(left, kept);
    }

    #[test]
    fn a_temporary_path_is_unique_and_removed_on_drop() {
        let scratch = Scratch::new("temporary");
        let (one, other) = (TemporaryPath::new_in(&scratch.0), TemporaryPath::new_in(&scratch.0));
        assert_ne!(one.path(), other.path());
        fs::create_dir_all(one.path().join("figures")).expect("a folder");
        let path = one.path().to_owned();
        drop(one);
        assert!(!path.exists());
        check_writable(&scratch.0).expect("files can be made");
        assert_eq!(fs::read_dir(&scratch.0).expect("a folder").count(), 0, "a file is left over");
        assert!(check_writable(&scratch.0.join("missing")).is_err());
    }
}
