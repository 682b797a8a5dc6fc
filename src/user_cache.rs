//! The folder of the user for files that can be made again.

use std::env;
use std::fs::{self, OpenOptions};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Extension of the temporary files.
pub(crate) const TEMPORARY: &str = "partial";

/// `bondline` in the cache folder of the XDG base directory specification, which ignores relative paths.
pub(crate) fn folder() -> Option<PathBuf> {
    let of = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    of("XDG_CACHE_HOME").or_else(|| Some(of("HOME")?.join(".cache"))).map(|caches| caches.join("bondline"))
}

/// Write a file, and its folder, in one step: to a temporary file first, as other processes may be reading. Its name is
/// random and it must be new, so that nothing that lies in the folder, such as a link, leads the text elsewhere.
///
/// # Errors
/// When the folder or the file cannot be written. The temporary file is then removed.
pub(crate) fn replace(file: &Path, content: &[u8]) -> io::Result<()> {
    let random = RandomState::new().build_hasher().finish();
    let mut temporary = file.as_os_str().to_owned();
    temporary.push(format!(".{random:016x}.{TEMPORARY}"));
    fs::create_dir_all(file.parent().unwrap_or(Path::new(".")))?;
    let mut new = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    let done = new.write_all(content).and_then(|()| fs::rename(&temporary, file));
    if done.is_err() {
        // It may have been removed by another process.
        let _ = fs::remove_file(&temporary);
    }
    done
}
