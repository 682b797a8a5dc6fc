//! The output folder of a case; files are written atomically.

pub(super) mod json;
pub mod members;
pub(super) mod summary_json;
pub(super) mod table;
pub(super) mod tables;

pub use members::{MemberRow, MembersFile, TracesFile};

use super::ReportError;
use crate::case::Case;
use crate::study::twin::SyntheticData;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Names the case of the folder; written last, so that its presence means a complete report.
pub(super) const SUMMARY: &str = "summary.json";

/// The output folder of one case.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// Names of the files of an earlier report of this case.
    previous_files: Vec<String>,
    /// Names of the files written apart from the report.
    reserved: Vec<String>,
}

impl OutputFolder {
    /// Open the output folder of a case. A missing folder is created with the first file.
    ///
    /// # Errors
    /// When the path is a file, cannot be read, or holds the report of another case and `force` is not given.
    pub fn open(path: &Path, case: &str, force: bool) -> Result<Self, ReportError> {
        if path.exists() && !path.is_dir() {
            return Err(ReportError::NotAFolder { path: path.to_owned() });
        }
        let summary = path.join(SUMMARY);
        let mut earlier = Vec::new();
        if summary.exists() {
            let text = fs::read_to_string(&summary).map_err(io_error("reading", &summary))?;
            let read: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
            let found = read["case"].as_str().unwrap_or("an unreadable summary");
            if found != case && !force {
                return Err(ReportError::OtherCase {
                    path: path.to_owned(),
                    found: found.to_owned(),
                    expected: case.to_owned(),
                });
            }
            let names = read["files"].as_array().into_iter().flatten();
            earlier.extend(names.filter_map(|name| name.as_str()).filter(|name| is_inside(name)).map(str::to_owned));
        }
        Ok(Self { path: path.to_owned(), previous_files: earlier, reserved: Vec::new() })
    }

    /// Path of a file that is written during the study, such as `members.parquet`. It is listed in the report.
    ///
    /// # Errors
    /// When the folder cannot be created.
    pub fn reserve(&mut self, name: &str) -> Result<PathBuf, ReportError> {
        fs::create_dir_all(&self.path).map_err(io_error("making", &self.path))?;
        self.reserved.push(name.to_owned());
        Ok(self.path.join(name))
    }

    /// Names of the files claimed so far.
    pub fn reserved(&self) -> &[String] {
        &self.reserved
    }

    /// Write one file atomically, and leave the other files of the folder.
    ///
    /// # Errors
    /// When the file cannot be written or renamed.
    pub fn write_file(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, ReportError> {
        fs::create_dir_all(&self.path).map_err(io_error("making", &self.path))?;
        let path = self.path.join(name);
        write_atomically(&path, bytes).map(|()| path)
    }

    /// Write all files, names relative to the folder: first under temporary names, and renamed when all are complete.
    /// Files of an earlier report that are not among them are removed.
    ///
    /// # Errors
    /// When a file cannot be written or renamed.
    pub(super) fn write(&self, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>, ReportError> {
        let paths: Vec<PathBuf> = files.iter().map(|(name, _)| self.path.join(name)).collect();
        let written = paths.iter().zip(files).try_for_each(|(path, (_, bytes))| {
            let parent = path.parent().unwrap_or(&self.path);
            fs::create_dir_all(parent).map_err(io_error("making", parent))?;
            let partial = temporary_path(path);
            fs::write(&partial, bytes).map_err(io_error("writing", &partial))
        });
        if let Err(error) = written {
            for path in &paths {
                // Ignored, as the first error is reported; a file that stays is named `.partial`.
                let _ = fs::remove_file(temporary_path(path));
            }
            return Err(error);
        }
        for path in &paths {
            fs::rename(temporary_path(path), path).map_err(io_error("renaming to", path))?;
        }
        let is_current = |name: &String| files.iter().any(|(new, _)| new == name) || self.reserved.contains(name);
        for name in self.previous_files.iter().filter(|name| !is_current(name)) {
            let path = self.path.join(name);
            if path.is_file() {
                fs::remove_file(&path).map_err(io_error("removing", &path))?;
            }
        }
        Ok(paths)
    }
}

/// Write synthetic observations as a table that a case can read: `time_s`, then `TC1_K` … to a microkelvin.
///
/// # Errors
/// When the file cannot be written.
pub fn write_observations(path: &Path, case: &Case, twin: &SyntheticData) -> Result<(), ReportError> {
    let mut text = String::from("time_s");
    for sensor in &case.sensors {
        text += &format!(",{}_K", sensor.name);
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

/// Write a file atomically.
fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    let partial = temporary_path(path);
    fs::write(&partial, bytes).map_err(io_error("writing", &partial))?;
    fs::rename(&partial, path).map_err(io_error("renaming to", path))
}

/// Temporary name of a file, in the same folder so that renaming is atomic.
fn temporary_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.partial"))
}

/// Whether a file name read from a summary is inside the folder.
fn is_inside(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

fn io_error(doing: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Io { operation: doing, path, source }
}

#[cfg(test)]
mod tests {
    use super::super::{fixture, write};
    use super::*;

    /// A temporary folder, removed when dropped.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("bondline-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&path);
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_study_writes_a_page_figures_tables_and_a_summary() {
        let scratch = Scratch::new("study");
        let outcomes = fixture::outcomes();
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
        let outcomes = fixture::outcomes();
        let folder = OutputFolder::open(&scratch.0, "lcat-2259", false).expect("a new folder");
        write(&outcomes.answers("predict"), &folder).expect("it can be written");
        assert!(OutputFolder::open(&scratch.0, "lcat-2259", false).is_ok());
        let refusal = OutputFolder::open(&scratch.0, "lcat-2330", false).expect_err("another case");
        assert!(refusal.to_string().contains("lcat-2259") && refusal.to_string().contains("lcat-2330"), "{refusal}");
        assert!(OutputFolder::open(&scratch.0, "lcat-2330", true).is_ok());
    }

    #[test]
    fn a_second_report_removes_files_of_the_first_that_it_does_not_have() {
        let scratch = Scratch::new("second");
        let outcomes = fixture::outcomes();
        let open = || OutputFolder::open(&scratch.0, "lcat-2259", false).expect("a folder of this case");
        write(&outcomes.answers("study"), &open()).expect("it can be written");
        fs::write(scratch.0.join("notes.txt"), "mine").expect("a file of the analyst");
        write(&outcomes.answers("predict"), &open()).expect("it can be written");
        assert!(!scratch.0.join("iterations.csv").exists(), "a table of the first report is still there");
        assert!(scratch.0.join("traces.csv").exists() && scratch.0.join("notes.txt").exists());
    }

    #[test]
    fn when_one_file_cannot_be_written_none_is() {
        let scratch = Scratch::new("fault");
        let folder = OutputFolder::open(&scratch.0, "x", false).expect("a new folder");
        fs::create_dir_all(scratch.0.join(".b.csv.partial")).expect("a folder in the way");
        let files = [("a.csv".to_owned(), vec![1]), ("b.csv".to_owned(), vec![2])];
        assert!(folder.write(&files).is_err());
        assert!(!scratch.0.join("a.csv").exists() && !scratch.0.join(".a.csv.partial").exists());
    }

    #[test]
    fn a_name_that_points_out_of_the_folder_is_never_removed() {
        assert!(is_inside("figures/nominal.svg"));
        assert!(!is_inside("../other/report.html") && !is_inside("/etc/hosts"));
    }
}
