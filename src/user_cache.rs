//! The folder of the user for files that can be made again.

use std::path::{Path, PathBuf};
use std::{env, fs, io, process};

/// `bondline` in the cache folder of the XDG base directory specification, which ignores relative paths.
pub(crate) fn folder() -> Option<PathBuf> {
    let of = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    of("XDG_CACHE_HOME").or_else(|| Some(of("HOME")?.join(".cache"))).map(|caches| caches.join("bondline"))
}

/// Write a file, and its folder, in one step: to a temporary file first, as other processes may be reading.
///
/// # Errors
/// When the folder or the file cannot be written. The temporary file is then removed.
pub(crate) fn replace(file: &Path, content: &[u8]) -> io::Result<()> {
    let temporary = file.with_extension(process::id().to_string());
    let folder = file.parent().unwrap_or(Path::new("."));
    let done = fs::create_dir_all(folder)
        .and_then(|()| fs::write(&temporary, content))
        .and_then(|()| fs::rename(&temporary, file));
    if done.is_err() {
        // The file may not exist.
        let _ = fs::remove_file(&temporary);
    }
    done
}
