//! A complete report takes the place of an earlier one. Where the file system can exchange two folders in one step,
//! every moment has one whole report; elsewhere the summary goes first and comes last, so that a folder with a summary
//! is whole.

use super::super::ReportError;
use super::{SUMMARY, io_error, temporary};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// Names the files of a report while they are replaced one by one, so that those of a process that was killed meanwhile
/// are not taken for the user's.
const UNFINISHED: &str = ".summary.json";

/// Most files of the user that are linked into the new folder; with more of them, files are replaced one by one.
const MAX_LINKED_FILES: usize = 10_000;

/// The case of the report in a folder, if there is one.
pub(super) fn case_of(folder: &Path) -> Result<Option<String>, ReportError> {
    let unreadable = || "an unreadable summary".to_owned();
    Ok(listing(folder, SUMMARY)?.map(|summary| summary["case"].as_str().map_or_else(unreadable, str::to_owned)))
}

fn listing(folder: &Path, name: &str) -> Result<Option<serde_json::Value>, ReportError> {
    let path = folder.join(name);
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read(&path).map_err(io_error("reading", &path))?;
    Ok(Some(serde_json::from_slice(&text).unwrap_or_default()))
}

/// Names of the files of the report in a folder.
fn report_files(folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let mut found = Vec::new();
    for name in [SUMMARY, UNFINISHED] {
        let Some(listed) = listing(folder, name)? else { continue };
        let names = listed["files"].as_array().into_iter().flatten().filter_map(|name| name.as_str());
        found.extend(names.chain([name]).filter(|name| is_inside(name)).map(PathBuf::from));
    }
    Ok(found)
}

/// The folder for the lock and the temporary files of an output folder: the one above, so that the whole can be
/// renamed; the folder itself if it is a mount point or nothing can be created above it.
pub(super) fn workspace(path: &Path) -> &Path {
    let Some(parent) = path.parent() else { return path };
    let is_writable = temporary::check_writable(parent).is_ok();
    if path.is_dir() && !(is_writable && is_same_file_system(path, parent)) { path } else { parent }
}

#[cfg(unix)]
fn is_same_file_system(one: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    matches!((fs::metadata(one), fs::metadata(other)), (Ok(one), Ok(other)) if one.dev() == other.dev())
}

#[cfg(not(unix))]
fn is_same_file_system(_one: &Path, _other: &Path) -> bool {
    true
}

/// Put the files of `staged` in the place of the report in `folder`. Its files are removed but for those in `kept`; the
/// user's own stay. Afterwards `staged` has nothing of use.
pub(super) fn publish(staged: &Path, folder: &Path, workspace: &Path, kept: &[String]) -> Result<(), ReportError> {
    sync_folders(staged);
    let mut earlier = report_files(folder)?;
    earlier.retain(|file| !kept.iter().any(|name| Path::new(name) == file));
    if !folder.exists() && fs::rename(staged, folder).is_ok() {
        sync(workspace);
        return Ok(());
    }
    // A working directory that is exchanged would be the removed folder for its processes.
    let is_working_directory = std::env::current_dir().is_ok_and(|current| current.starts_with(folder));
    let can_exchange = workspace != folder && !is_working_directory;
    if can_exchange && carry_over(folder, staged, &earlier).is_ok() && exchange(staged, folder).is_ok() {
        sync(workspace);
        return Ok(());
    }
    replace_files(staged, folder, &earlier)
}

/// Give the files of `folder` that have the name of a file in `staged`, and are not of a report, another name: that of
/// a numbered backup. A study is not worth less because of them, so they are no error.
pub(super) fn keep_own_files(staged: &Path, folder: &Path) -> Result<Vec<(PathBuf, PathBuf)>, ReportError> {
    let earlier = report_files(folder)?;
    let new = entries(staged).map_err(io_error("reading", staged))?;
    let mut renamed = Vec::new();
    for entry in new.iter().filter(|entry| !earlier.contains(entry)) {
        let own = folder.join(entry);
        if own.symlink_metadata().is_err() || (own.is_dir() && staged.join(entry).is_dir()) {
            continue;
        }
        let backup = |number: usize| {
            let mut name = own.clone().into_os_string();
            name.push(format!(".~{number}~"));
            PathBuf::from(name)
        };
        let free = (1..).map(backup).find(|path| path.symlink_metadata().is_err());
        let free = free.expect("a folder has fewer files than numbers");
        fs::rename(&own, &free).map_err(io_error("renaming", &own))?;
        renamed.push((own, free));
    }
    Ok(renamed)
}

/// Link the files of `folder` that are not of the earlier report into `staged`, unless it has its own.
fn carry_over(folder: &Path, staged: &Path, earlier: &[PathBuf]) -> io::Result<()> {
    fs::set_permissions(staged, fs::metadata(folder)?.permissions())?;
    let mut entries = entries(folder)?;
    entries.retain(|entry| !earlier.contains(entry));
    if entries.len() > MAX_LINKED_FILES {
        return Err(ErrorKind::QuotaExceeded.into());
    }
    for entry in entries {
        let (from, to) = (folder.join(&entry), staged.join(&entry));
        if from.symlink_metadata()?.is_dir() {
            fs::create_dir_all(&to)?;
            fs::set_permissions(&to, fs::metadata(&from)?.permissions())?;
        } else if !to.exists() {
            fs::hard_link(&from, &to)?;
        }
    }
    Ok(())
}

/// Every file and folder below a folder, by paths relative to it; folders come before their entries.
fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found: Vec<PathBuf> = Vec::new();
    let mut open = vec![PathBuf::new()];
    while let Some(inner) = open.pop() {
        for entry in fs::read_dir(folder.join(&inner))? {
            let entry = entry?;
            if temporary::is_temporary(&entry.file_name().to_string_lossy()) {
                continue;
            }
            let path = inner.join(entry.file_name());
            if entry.file_type()?.is_dir() {
                open.push(path.clone());
            }
            found.push(path);
        }
    }
    Ok(found)
}

/// Exchange two folders in one step.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<()> {
    Err(ErrorKind::Unsupported.into())
}

/// Replace the files one by one, without a summary meanwhile.
fn replace_files(staged: &Path, folder: &Path, earlier: &[PathBuf]) -> Result<(), ReportError> {
    let mut new = entries(staged).map_err(io_error("reading", staged))?;
    new.sort_by_key(|entry| entry == Path::new(SUMMARY));
    let unfinished = folder.join(UNFINISHED);
    let files = new.iter().filter(|entry| !staged.join(entry).is_dir());
    let names: Vec<_> = earlier.iter().chain(files).map(|name| name.to_string_lossy()).collect();
    fs::create_dir_all(folder).map_err(io_error("making", folder))?;
    fs::write(&unfinished, serde_json::json!({ "files": names }).to_string())
        .map_err(io_error("writing", &unfinished))?;
    remove_file(&folder.join(SUMMARY))?;
    for file in earlier.iter().filter(|file| !new.contains(file) && *file != Path::new(UNFINISHED)) {
        remove_file(&folder.join(file))?;
    }
    for entry in &new {
        let (from, to) = (staged.join(entry), folder.join(entry));
        if from.is_dir() {
            fs::create_dir_all(&to).map_err(io_error("making", &to))?;
        } else {
            fs::rename(&from, &to).map_err(io_error("renaming to", &to))?;
        }
    }
    remove_file(&unfinished)?;
    sync_folders(folder);
    Ok(())
}

fn remove_file(path: &Path) -> Result<(), ReportError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(io_error("removing", path)(error)),
        _ => Ok(()),
    }
}

/// Write the names of the files of a report to the disk.
fn sync_folders(folder: &Path) {
    sync(&folder.join("figures"));
    sync(folder);
}

/// Write the names in a folder to the disk. An error is ignored: not every system can synchronise a folder, and the
/// files in it have been.
fn sync(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// Whether a file name read from a summary is inside the folder.
fn is_inside(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::super::scratch::Scratch;
    use super::*;

    fn write(path: &Path, text: &str) {
        fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }

    /// A folder with an earlier report and files of the user, and a new report beside it.
    fn reports(scratch: &Scratch) -> (PathBuf, PathBuf) {
        let (folder, staged) = (scratch.0.join("out"), scratch.0.join("new"));
        write(&folder.join(SUMMARY), r#"{"case": "x", "files": ["a.csv", "figures/a.svg", "../notes.txt"]}"#);
        for name in ["a.csv", "figures/a.svg", "notes.txt", "figures/mine.svg", "deep/er/mine.txt"] {
            write(&folder.join(name), "earlier");
        }
        write(&scratch.0.join("notes.txt"), "above");
        for name in [SUMMARY, "b.csv", "figures/b.svg"] {
            write(&staged.join(name), "new");
        }
        (folder, staged)
    }

    fn assert_published(scratch: &Scratch, folder: &Path) {
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_else(|_| "none".to_owned());
        for name in [SUMMARY, "b.csv", "figures/b.svg"] {
            assert_eq!(read(name), "new", "{name}");
        }
        for name in ["notes.txt", "figures/mine.svg", "deep/er/mine.txt"] {
            assert_eq!(read(name), "earlier", "{name}");
        }
        for name in ["a.csv", "figures/a.svg"] {
            assert_eq!(read(name), "none", "{name}");
        }
        assert_eq!(fs::read_to_string(scratch.0.join("notes.txt")).expect("a file"), "above");
    }

    #[test]
    fn a_report_is_exchanged_for_the_earlier_one_and_files_of_the_user_stay() {
        let scratch = Scratch::new("exchange");
        let (folder, staged) = reports(&scratch);
        publish(&staged, &folder, &scratch.0, &[]).expect("it can be published");
        assert_published(&scratch, &folder);
        assert!(staged.join("a.csv").exists(), "the folders were not exchanged");
    }

    #[test]
    fn files_are_replaced_one_by_one_where_folders_cannot_be_exchanged() {
        let scratch = Scratch::new("replace");
        let (folder, staged) = reports(&scratch);
        publish(&staged, &folder, &folder, &[]).expect("it can be published");
        assert_published(&scratch, &folder);
        assert!(!staged.join("b.csv").exists(), "the folders were exchanged");
    }

    #[test]
    fn a_name_that_points_out_of_the_folder_is_never_removed() {
        assert!(is_inside("figures/nominal.svg"));
        assert!(!is_inside("../other/report.html") && !is_inside("/etc/hosts"));
    }
}
