//! Locks of output folders: one writer at a time. The operating system releases a lock when its process ends, however
//! it ends; the file that stays is taken over and removed by the next writer.

use super::super::ReportError;
use super::{io_error, temporary};
use crate::study::run_record::utc_text;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime};

/// Time in which a holder writes its name.
const NAMING_TIME: Duration = Duration::from_millis(50);

/// How often the folder of a lock is made again. In some folders, such as `/proc`, creating a file always fails with
/// "not found".
const REMADE_MAX: usize = 100;

/// A lock, held until it is dropped.
#[derive(Debug)]
pub(super) struct PathLock {
    path: PathBuf,
    file: File,
}

/// Whether other processes may hold a lock at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sharing {
    /// No other process.
    Exclusive,
    /// Other processes with a shared lock.
    Shared,
}

impl PathLock {
    /// Lock the file at `path` for the output `output`. A missing folder of the file is made: another process may have
    /// removed it as empty.
    ///
    /// # Errors
    /// When another process holds it, with its host, process and time; when the file cannot be created.
    pub(super) fn acquire(path: PathBuf, output: &Path, sharing: Sharing) -> Result<Self, ReportError> {
        let mut remade = 0;
        loop {
            let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = match (opened, path.parent()) {
                (Err(error), Some(folder)) if error.kind() == ErrorKind::NotFound && remade < REMADE_MAX => {
                    fs::create_dir_all(folder).map_err(io_error("making", folder))?;
                    remade += 1;
                    continue;
                }
                (opened, _) => opened.map_err(io_error("making", &path))?,
            };
            let locked = match sharing {
                Sharing::Exclusive => file.try_lock(),
                Sharing::Shared => file.try_lock_shared(),
            };
            match locked {
                Err(TryLockError::WouldBlock) => {
                    // The holder may be about to write its name, in place of that of a process that was killed.
                    thread::sleep(NAMING_TIME);
                    // The last of several sharers holds the lock alone while it removes the file.
                    if !is_current(&file, &path) {
                        continue;
                    }
                    let mut holder = String::new();
                    // A holder that cannot write its name is not named.
                    let _ = file.read_to_string(&mut holder);
                    return Err(ReportError::Locked { path: output.to_owned(), holder: holder.trim().to_owned() });
                }
                // A file system without locks cannot refuse the second writer.
                Ok(()) | Err(TryLockError::Error(_)) => {}
            }
            if !is_current(&file, &path) {
                continue;
            }
            let since = utc_text(SystemTime::now());
            let holder = format!("process {} on {} since {since}\n", std::process::id(), temporary::host());
            let written = file.set_len(0).and_then(|()| file.write_all(holder.as_bytes()));
            let lock = Self { path, file };
            return written.map_err(io_error("writing", &lock.path)).map(|()| lock);
        }
    }
}

impl Drop for PathLock {
    fn drop(&mut self) {
        // The last of several sharers removes the file. An error is ignored: the next writer takes the file over.
        if self.file.try_lock().is_ok() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Whether a path still names the open file: its former holder removes it while others wait to open it.
#[cfg(unix)]
fn is_current(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(open), Ok(named)) = (file.metadata(), fs::metadata(path)) else { return false };
    (open.dev(), open.ino()) == (named.dev(), named.ino())
}

#[cfg(not(unix))]
fn is_current(_file: &File, _path: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::super::scratch::Scratch;
    use super::*;

    #[test]
    fn a_second_writer_is_refused_and_told_who_holds_the_lock() {
        let scratch = Scratch::new("lock");
        fs::create_dir_all(&scratch.0).expect("a folder");
        let lock = |sharing| PathLock::acquire(scratch.0.join(".out.lock"), &scratch.0.join("out"), sharing);
        let first = lock(Sharing::Exclusive).expect("a free lock");
        for sharing in [Sharing::Exclusive, Sharing::Shared] {
            let refusal = lock(sharing).expect_err("it is held").to_string();
            assert!(refusal.contains(&format!("process {} on ", std::process::id())), "{refusal}");
            assert!(refusal.contains("out") && refusal.contains("since 20"), "{refusal}");
        }
        drop(first);
        let shared = [lock(Sharing::Shared).expect("a free lock"), lock(Sharing::Shared).expect("it is shared")];
        assert!(lock(Sharing::Exclusive).is_err(), "a lock that others share is not exclusive");
        drop(shared);
        assert!(fs::read_dir(&scratch.0).expect("a folder").next().is_none(), "a lock file is left over");
        lock(Sharing::Exclusive).expect("a free lock");
    }

    #[test]
    fn a_folder_that_another_process_removed_as_empty_is_made_again_for_the_lock() {
        let scratch = Scratch::new("removed");
        let path = scratch.0.join("deep/out/.x.lock");
        let _lock = PathLock::acquire(path.clone(), &path, Sharing::Exclusive).expect("a free lock");
        assert!(path.is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_that_can_never_be_made_is_refused() {
        let scratch = Scratch::new("never");
        fs::create_dir_all(&scratch.0).expect("a folder");
        let link = scratch.0.join(".x.lock");
        std::os::unix::fs::symlink(scratch.0.join("gone/file"), &link).expect("a symbolic link");
        let proc = cfg!(target_os = "linux").then(|| PathBuf::from("/proc/.x.lock"));
        for path in [link].into_iter().chain(proc) {
            let refusal = PathLock::acquire(path.clone(), &path, Sharing::Exclusive).expect_err("no file can be made");
            assert!(refusal.to_string().contains(".x.lock"), "{refusal}");
        }
    }
}
