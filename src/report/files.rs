//! The output folder of a case. A report appears as a whole: it is built under a temporary name, and takes the place of
//! the earlier one by one rename.

pub(super) mod contents;
pub(super) mod json;
mod lock;
pub mod members;
mod publish;
#[cfg(test)]
mod scratch;
pub(super) mod summary_json;
pub(super) mod table;
pub(super) mod tables;
mod temporary;

pub use members::{MemberRow, MembersFile, TracesFile};

use super::ReportError;
use crate::case::Case;
use crate::study::twin::SyntheticData;
use lock::{PathLock, Sharing};
use publish::publish;
use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use temporary::TemporaryPath;

/// Names the case of the folder and the files of its report.
pub(super) const SUMMARY: &str = "summary.json";

/// The folder of the report of one case. While it exists, no other process writes the same folder.
#[derive(Debug)]
pub struct OutputFolder {
    /// The files until the report is complete.
    staged: TemporaryPath,
    /// Names of the files written apart from the report.
    reserved: Vec<String>,
    /// Whether files of the user may be overwritten.
    force: bool,
    /// Files of the user that got another name, with it.
    renamed: RefCell<Vec<(PathBuf, PathBuf)>>,
    _lock: PathLock,
    place: Place,
}

/// The folder of single files, such as the parts of a sweep, each of which one process writes. Nobody writes a report
/// into it meanwhile.
#[derive(Debug)]
pub struct PartFolder {
    _own: PathLock,
    _shared: PathLock,
    place: Place,
}

/// A folder, and the folder of its lock and of temporary files. Folders that were made for it and stay empty are
/// removed on drop.
#[derive(Debug)]
struct Place {
    /// As the caller gave it.
    path: PathBuf,
    /// Absolute, with symbolic links resolved.
    real_path: PathBuf,
    workspace: PathBuf,
    made: Vec<PathBuf>,
}

impl Place {
    /// Check that a folder may hold files of a case, and make the folders above it.
    ///
    /// # Errors
    /// When the path is a file, cannot be read, or holds the report of another case and `force` is not given.
    fn open(path: &Path, case: &str, force: bool) -> Result<Self, ReportError> {
        if path.exists() && !path.is_dir() {
            return Err(ReportError::NotAFolder { path: path.to_owned() });
        }
        let found = publish::case_of(path)?;
        if let Some(found) = found.filter(|found| found != case && !force) {
            return Err(ReportError::OtherCase { path: path.to_owned(), found, expected: case.to_owned() });
        }
        let mut made = Vec::new();
        let real_path = if path.is_dir() {
            path.canonicalize().map_err(io_error("reading", path))?
        } else {
            let absolute = std::path::absolute(path).map_err(io_error("making", path))?;
            let parent = absolute.parent().unwrap_or(&absolute);
            made.extend(parent.ancestors().take_while(|above| !above.exists()).map(Path::to_owned));
            fs::create_dir_all(parent).map_err(io_error("making", parent))?;
            absolute
        };
        let workspace = publish::workspace(&real_path).to_owned();
        temporary::sweep(&workspace);
        Ok(Self { path: path.to_owned(), real_path, workspace, made })
    }

    /// Lock the folder.
    fn lock(&self, sharing: Sharing) -> Result<PathLock, ReportError> {
        let name = self.real_path.file_name().unwrap_or_default().to_string_lossy();
        PathLock::acquire(self.workspace.join(format!(".{name}.lock")), &self.path, sharing)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        for folder in &self.made {
            // Not removed while it has files.
            let _ = fs::remove_dir(folder);
        }
    }
}

impl OutputFolder {
    /// Open and lock the output folder of a case. A missing folder is created with the report.
    ///
    /// # Errors
    /// When the path is a file, cannot be read, is locked by another process, or holds the report of another case and
    /// `force` is not given.
    pub fn open(path: &Path, case: &str, force: bool) -> Result<Self, ReportError> {
        let place = Place::open(path, case, force)?;
        let lock = place.lock(Sharing::Exclusive)?;
        let staged = TemporaryPath::new_in(&place.workspace);
        Ok(Self { staged, reserved: Vec::new(), force, renamed: RefCell::default(), _lock: lock, place })
    }

    /// Path of a file that is written during the study, such as `members.parquet`. It gets its place in the folder with
    /// the report, which lists it.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn reserve(&mut self, name: &str) -> Result<PathBuf, ReportError> {
        let folder = self.staged.path();
        fs::create_dir_all(folder).map_err(io_error("making", folder))?;
        self.reserved.push(name.to_owned());
        Ok(folder.join(name))
    }

    /// The folder beside this one for a [`Checkpoint`](crate::session::Checkpoint) of its study.
    pub fn checkpoint(&self) -> PathBuf {
        let name = self.place.real_path.file_name().unwrap_or_default().to_string_lossy();
        self.place.workspace.join(format!("{name}.checkpoint"))
    }

    /// Files of the user that had the name of a file of the report, with the name under which they stay.
    pub fn renamed(&self) -> Vec<(PathBuf, PathBuf)> {
        self.renamed.borrow().clone()
    }

    /// Names of the files claimed so far.
    pub fn reserved(&self) -> &[String] {
        &self.reserved
    }

    /// Write all files, names relative to the folder, and put them and the reserved files in the place of the earlier
    /// report. Its files are removed; the user's own stay.
    ///
    /// # Errors
    /// When a file cannot be written; the earlier report is then unchanged.
    pub(super) fn write(&self, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>, ReportError> {
        let staged = self.staged.path();
        for (name, bytes) in files {
            let path = staged.join(name);
            let parent = path.parent().unwrap_or(staged);
            fs::create_dir_all(parent).map_err(io_error("making", parent))?;
            write_durably(&path, bytes)?;
        }
        if !self.force {
            self.renamed.borrow_mut().extend(publish::keep_own_files(staged, &self.place.real_path)?);
        }
        publish(staged, &self.place.real_path, &self.place.workspace, &self.reserved)?;
        Ok(files.iter().map(|(name, _)| self.place.path.join(name)).collect())
    }
}

impl PartFolder {
    /// Open the folder to write the file `name` and its checkpoint. Other processes may write other files of the
    /// folder.
    ///
    /// # Errors
    /// As [`OutputFolder::open`], and when another process writes a file of this name.
    pub fn open(path: &Path, case: &str, force: bool, name: &str) -> Result<Self, ReportError> {
        let mut place = Place::open(path, case, force)?;
        let shared = place.lock(Sharing::Shared)?;
        match fs::create_dir(path) {
            Ok(()) => place.made.insert(0, place.real_path.clone()),
            // It was there, or a process that writes another file has just made it.
            Err(error) if error.kind() == ErrorKind::AlreadyExists || path.is_dir() => {}
            Err(source) => return Err(io_error("making", path)(source)),
        }
        temporary::sweep(path);
        let own = PathLock::acquire(path.join(format!(".{name}.lock")), &path.join(name), Sharing::Exclusive)?;
        Ok(Self { _own: own, _shared: shared, place })
    }

    /// The folder in this one for a [`Checkpoint`](crate::session::Checkpoint) of the file `name`.
    pub fn checkpoint(&self, name: &str) -> PathBuf {
        self.file(&format!("{name}.checkpoint"))
    }

    /// The path of a file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.place.path.join(name)
    }

    /// Write a file atomically.
    ///
    /// # Errors
    /// When the file cannot be written or renamed.
    pub fn write_file(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, ReportError> {
        let path = self.file(name);
        write_atomically(&path, bytes).map(|()| path)
    }
}

/// Check that files can be made in a folder, or in the one in which it would be made.
///
/// # Errors
/// When no file can be made there.
pub fn check_writable(folder: &Path) -> Result<(), ReportError> {
    let existing = folder.ancestors().find(|ancestor| ancestor.exists()).unwrap_or(Path::new("."));
    temporary::check_writable(existing).map_err(io_error("making a file in", existing))
}

/// Write synthetic observations as a table that a case can read: `time_s`, then `TC1_k` … to a microkelvin.
///
/// # Errors
/// When the file cannot be written.
pub fn write_observations(path: &Path, case: &Case, twin: &SyntheticData) -> Result<(), ReportError> {
    let mut text = String::from("time_s");
    for sensor in &case.sensors {
        text += &format!(",{}_k", sensor.name);
    }
    text.push('\n');
    for (instant, time_s) in twin.instants_s.iter().enumerate() {
        text += &time_s.to_string();
        for trace in &twin.measured_k {
            text += &format!(",{:.6}", trace[instant]);
        }
        text.push('\n');
    }
    write_atomically(path, text.as_bytes())
}

/// Write a text file atomically.
///
/// # Errors
/// When the file cannot be written or renamed.
pub fn write_text(path: &Path, text: &str) -> Result<(), ReportError> {
    write_atomically(path, text.as_bytes())
}

/// Write a file atomically.
fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let partial = TemporaryPath::new_in(path.parent().unwrap_or(Path::new("")));
    write_durably(partial.path(), bytes)?;
    fs::rename(partial.path(), path).map_err(io_error("renaming to", path))
}

/// Write a file to the disk.
fn write_durably(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let write = || File::create(path).and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()));
    write().map_err(io_error("writing", path))
}

fn io_error(doing: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Io { operation: doing, path, source }
}

#[cfg(test)]
mod tests {
    use super::super::{marched, write};
    use super::scratch::Scratch;
    use super::*;
    use std::sync::Barrier;
    use std::thread;

    #[test]
    fn a_study_writes_a_page_figures_tables_and_a_summary() {
        let scratch = Scratch::new("study");
        let outcomes = marched::study();
        let folder = OutputFolder::open(&scratch.0, "lcat-2259", false).expect("a new folder");
        let paths = write(&outcomes.answers("study"), &folder).expect("it can be written");
        for name in ["report.html", "summary.json", "traces.csv", "percentiles.csv", "shares.csv", "iterations.csv"] {
            assert!(paths.contains(&scratch.0.join(name)), "no {name} in {paths:?}");
        }
        assert!(paths.iter().all(|path| path.is_file()));
        let figures = fs::read_dir(scratch.0.join("figures")).expect("a folder of figures");
        let names: Vec<_> = figures.map(|entry| entry.expect("an entry").file_name()).collect();
        assert!(names.len() > 12 && names.iter().all(|name| name.to_string_lossy().ends_with(".svg")), "{names:?}");
    }

    #[test]
    fn the_folder_of_another_case_is_refused_unless_forced() {
        let scratch = Scratch::new("other");
        let outcomes = marched::study();
        let folder = OutputFolder::open(&scratch.0, "lcat-2259", false).expect("a new folder");
        write(&outcomes.answers("predict"), &folder).expect("it can be written");
        drop(folder);
        assert!(OutputFolder::open(&scratch.0, "lcat-2259", false).is_ok());
        let refusal = OutputFolder::open(&scratch.0, "lcat-2330", false).expect_err("another case");
        assert!(refusal.to_string().contains("lcat-2259") && refusal.to_string().contains("lcat-2330"), "{refusal}");
        assert!(OutputFolder::open(&scratch.0, "lcat-2330", true).is_ok());
    }

    #[test]
    fn a_second_report_removes_files_of_the_first_that_it_does_not_have() {
        let scratch = Scratch::new("second");
        let outcomes = marched::study();
        let open = || OutputFolder::open(&scratch.0, "lcat-2259", false).expect("a folder of this case");
        write(&outcomes.answers("study"), &open()).expect("it can be written");
        fs::write(scratch.0.join("notes.txt"), "mine").expect("a file of the analyst");
        let folder = open();
        write(&outcomes.answers("predict"), &folder).expect("it can be written");
        assert!(folder.renamed().is_empty());
        drop(folder);
        assert!(!scratch.0.join("iterations.csv").exists(), "a table of the first report is still there");
        assert!(scratch.0.join("traces.csv").exists() && scratch.0.join("notes.txt").exists());
    }

    #[test]
    fn a_file_of_the_user_with_the_name_of_a_file_of_the_report_stays_under_another_name() {
        let scratch = Scratch::new("own-names");
        let outcomes = marched::study();
        let names = ["report.html", "traces.csv", "figures/nominal.svg"];
        for (force, left) in [(false, true), (true, false)] {
            let out = scratch.0.join(format!("{force}"));
            fs::create_dir_all(out.join("figures")).expect("a folder");
            names.iter().for_each(|name| fs::write(out.join(name), "mine").expect("a file"));
            for round in 0..2 {
                let folder = OutputFolder::open(&out, "lcat-2259", force).expect("a folder without a report");
                write(&outcomes.answers("predict"), &folder).expect("it can be written");
                assert_eq!(folder.renamed().len(), if left && round == 0 { names.len() } else { 0 });
            }
            for name in names {
                assert_ne!(fs::read(out.join(name)).expect("a file of the report"), b"mine", "{name}");
                let own = fs::read(out.join(format!("{name}.~1~"))).ok();
                assert_eq!(own.as_deref(), left.then_some(&b"mine"[..]), "{name}");
            }
        }
    }

    #[test]
    fn when_one_file_cannot_be_written_the_earlier_report_stays_and_nothing_is_left_over() {
        let scratch = Scratch::new("fault");
        let out = scratch.0.join("deep/out");
        let folder = OutputFolder::open(&out, "x", false).expect("a new folder");
        let file = |name: &str, byte| (name.to_owned(), vec![byte]);
        assert!(folder.write(&[file("a.csv", 1), file("a.csv/b.csv", 2)]).is_err());
        drop(folder);
        assert!(!scratch.0.exists(), "folders were made for nothing");
        let folder = OutputFolder::open(&out, "x", false).expect("a new folder");
        folder.write(&[file("a.csv", 1)]).expect("it can be written");
        assert!(folder.write(&[file("a.csv", 3), file("a.csv/b.csv", 2)]).is_err());
        drop(folder);
        assert_eq!(fs::read(out.join("a.csv")).expect("the first file"), [1]);
        let left: Vec<_> = fs::read_dir(scratch.0.join("deep")).expect("a folder").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }

    #[test]
    fn parts_share_a_folder_in_which_nobody_else_writes_a_report_or_the_same_part() {
        let scratch = Scratch::new("shared");
        let part = |name: &str| PartFolder::open(&scratch.0, "x", false, name);
        let (first, second) = (part("x-0-5.json").expect("a folder"), part("x-5-9.json").expect("another part"));
        let refused = |refusal: Option<ReportError>| matches!(refusal, Some(ReportError::Locked { .. }));
        assert!(refused(OutputFolder::open(&scratch.0, "x", false).err()) && refused(part("x-0-5.json").err()));
        first.write_file("x-0-5.json", b"1").expect("it can be written");
        drop((first, second));
        let report = OutputFolder::open(&scratch.0, "x", false).expect("a folder that nobody writes");
        assert!(refused(part("x-0-5.json").err()));
        drop(report);
        let left: Vec<_> = fs::read_dir(&scratch.0).expect("a folder").map(|e| e.expect("an entry").path()).collect();
        assert_eq!(left, [scratch.0.join("x-0-5.json")]);
    }

    #[test]
    fn no_part_is_refused_while_others_make_share_and_leave_its_folder() {
        const PARTS: usize = 8;
        let scratch = Scratch::new("together");
        let out = scratch.0.join("deep/out");
        let together = Barrier::new(PARTS);
        let written = |number: usize, round: usize| {
            let name = format!("x-{number}.json");
            let folder = PartFolder::open(&out, "x", false, &name)?;
            if round % PARTS == number {
                let path = folder.write_file(&name, b"1")?;
                fs::remove_file(&path).map_err(io_error("removing", &path))?;
            }
            Ok(())
        };
        let refusals = |number: usize| {
            together.wait();
            (0..300).filter_map(|round| written(number, round).err()).collect()
        };
        let refusals: Vec<Vec<ReportError>> = thread::scope(|threads| {
            let refusals = &refusals;
            let parts: Vec<_> = (0..PARTS).map(|number| threads.spawn(move || refusals(number))).collect();
            parts.into_iter().map(|part| part.join().expect("no thread panics")).collect()
        });
        assert!(refusals.iter().all(Vec::is_empty), "{refusals:?}");
    }
}
