//! Finished work, kept in a folder while a study runs: after a kill, it goes on from there. Members of a sweep are kept
//! as the statistics of one [piece](super::sweep_piece), whose size does not grow with their number; a coverage study,
//! a posterior and a sizing keep the rows of their [log](super::work_log).

use super::kept_rows::KeptRows;
use super::row_journal::{self, RowJournal};
use super::sweep_piece::{Piece, difference};
use super::work_log::WorkLog;
use crate::limits::{PIECE_FILE_MIB, read_file};
use crate::question::InputError;
use crate::study::uncertainty::SweepStatistics;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The statistics of a sweep so far.
const SWEEP: &str = "sweep.json";

/// The files of a study that keeps the rows of its log.
#[derive(Clone, Copy)]
pub(crate) struct RowFiles {
    /// File with the origin of the rows and their number.
    head: &'static str,
    rows: &'static str,
    unit: &'static str,
}

/// Fits of a coverage study.
pub(crate) const FITS: RowFiles = RowFiles { head: "fits.json", rows: "fits.rows", unit: "data sets" };

/// Iterations of a posterior.
pub(crate) const ITERATIONS: RowFiles =
    RowFiles { head: "iterations.json", rows: "iterations.rows", unit: "iterations" };

/// Members that a sizing has marched.
pub(crate) const MARCHES: RowFiles = RowFiles { head: "marches.json", rows: "marches.rows", unit: "marches" };

/// Longest time between two writes by default.
const INTERVAL: Duration = Duration::from_secs(5);

/// A write may take this share of the time.
const MAX_TIME_SHARE: u32 = 20;

/// A folder for the finished work of a study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    folder: PathBuf,
    interval: Duration,
}

/// Finished work that a folder keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct KeptWork {
    /// `members`, `data sets`, `iterations` or `marches`.
    pub unit: &'static str,
    /// Numbers of the first unit, and one past the last.
    pub range: Range<usize>,
    /// Number of units that completed.
    pub completed: usize,
    /// Number of units of the whole sweep or study; `None` for a sizing, whose marches are not known before its end.
    pub requested: Option<usize>,
    /// Start of the run that kept the work, UTC.
    pub date: String,
}

impl Checkpoint {
    /// A folder, which is made when work is kept: every five seconds, or after every batch of members, block of fits or
    /// iteration if that takes longer.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), interval: INTERVAL }
    }

    /// Another interval.
    #[must_use]
    pub fn every(mut self, interval: Duration) -> Self {
        self.interval = interval;
        self
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The work in the folder; `None` if it has none.
    ///
    /// # Errors
    /// When a file cannot be read or is damaged.
    pub fn found(&self) -> Result<Option<KeptWork>, InputError> {
        // The posterior of a study begins after its sweep.
        for files in [FITS, ITERATIONS, MARCHES] {
            if let Some(KeptRows { run, finished, requested, .. }) = self.read(files.head, KeptRows::from_json)? {
                let (unit, range, date) = (files.unit, 0..finished, run.date);
                return Ok(Some(KeptWork { unit, range, completed: finished, requested, date }));
            }
        }
        let kept = |piece: Piece| KeptWork {
            unit: "members",
            range: piece.members.clone(),
            completed: piece.completed(),
            requested: Some(piece.draw.members),
            date: piece.run.date,
        };
        Ok(self.piece()?.map(kept))
    }

    /// Remove the folder, once the answer is in safety.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn remove(&self) -> io::Result<()> {
        // These go first: what is left cannot be taken for finished work.
        let files =
            [SWEEP, FITS.head, ITERATIONS.head, MARCHES.head].map(|name| fs::remove_file(self.folder.join(name)));
        for removed in files.into_iter().chain([fs::remove_dir_all(&self.folder)]) {
            removed.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })?;
        }
        Ok(())
    }

    fn piece(&self) -> Result<Option<Piece>, InputError> {
        let path = self.folder.join(SWEEP);
        if path.exists() { Ok(Some(Piece::read(&path).map_err(InputError::general)?.0)) } else { Ok(None) }
    }

    fn read<T>(&self, name: &str, content: fn(&str) -> Result<T, String>) -> Result<Option<T>, InputError> {
        let path = self.folder.join(name);
        if !path.exists() {
            return Ok(None);
        }
        let fault = |message: String| InputError::general(format!("{}: {message}", path.display()));
        let bytes = read_file(&path, &PIECE_FILE_MIB).map_err(|error| fault(error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|error| fault(error.to_string()))?;
        Ok(Some(content(&text).map_err(fault)?))
    }

    /// Write a file that counts the rows of the journals, after these are on the disk.
    fn write(&self, name: &str, content: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let partial = self.folder.join(format!("{name}.partial"));
        let mut file = File::create(&partial)?;
        content(&mut file)?;
        file.sync_all()?;
        self.sync_journals()?;
        fs::rename(partial, self.folder.join(name))
    }

    /// Wait until the journals in the folder, and their names, are on the disk.
    fn sync_journals(&self) -> io::Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == row_journal::EXTENSION) {
                // Some systems synchronise only what can be written.
                OpenOptions::new().write(true).open(path)?.sync_data()?;
            }
        }
        // Not every system can synchronise a folder.
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// Writes to a checkpoint when it is due.
struct Keeper {
    checkpoint: Checkpoint,
    last: Instant,
    last_took: Duration,
    /// The first error; nothing is kept after it.
    error: Option<String>,
}

impl Keeper {
    fn new(checkpoint: Checkpoint) -> Self {
        Self { checkpoint, last: Instant::now(), last_took: Duration::ZERO, error: None }
    }

    /// Whether the last time is long enough ago.
    fn is_due(&self) -> bool {
        self.last.elapsed() >= self.checkpoint.interval.max(MAX_TIME_SHARE * self.last_took)
    }

    fn keep(&mut self, name: &str, content: impl FnOnce(&mut File) -> io::Result<()>) {
        if self.error.is_some() {
            return;
        }
        let start = Instant::now();
        if let Err(error) = self.checkpoint.write(name, content) {
            self.fail(error);
        }
        (self.last, self.last_took) = (Instant::now(), start.elapsed());
    }

    fn fail(&mut self, error: io::Error) {
        self.error = Some(format!("{}: {error}", self.checkpoint.folder.display()));
    }

    fn remark(self) -> Option<String> {
        self.error.map(|error| format!("Finished work could not be kept while the study ran: {error}."))
    }
}

/// Keeps the members of one sweep.
pub(crate) struct SweepKeeper {
    keeper: Keeper,
    /// A piece of this sweep without members.
    empty: Piece,
}

impl SweepKeeper {
    /// `empty` is a piece of the sweep without members, from the first member to come.
    pub(crate) fn new(checkpoint: Checkpoint, empty: Piece) -> Self {
        Self { keeper: Keeper::new(checkpoint), empty }
    }

    /// The kept statistics of this sweep, and one past the last of their members; `None` if none are kept.
    ///
    /// # Errors
    /// When they are of another sweep or damaged.
    pub(crate) fn kept(
        &self,
        statistics: &SweepStatistics,
        part: &Range<usize>,
    ) -> Result<Option<(SweepStatistics, usize)>, InputError> {
        let Some(piece) = self.keeper.checkpoint.piece()? else { return Ok(None) };
        let folder = self.keeper.checkpoint.folder.display();
        let other = |what: &str, found: String, expected: String| {
            InputError::general(format!(
                "{folder} keeps members of another sweep: its {what} {found}, expected {expected}"
            ))
        };
        if let Some((what, found, expected)) = difference(&piece, &self.empty) {
            return Err(other(what, found, expected));
        }
        let Range { start, end } = piece.members;
        if start != part.start || end > part.end {
            let text = |range: &Range<usize>| format!("{}..{}", range.start, range.end);
            return Err(other("members", text(&(start..end)), text(part)));
        }
        let restored = statistics.restored(piece.numbers(), piece.kept().clone(), piece.margins(), &piece.failures());
        let restored = restored.filter(|restored| restored.members() == end - start);
        let damaged = || InputError::general(format!("{folder}: damaged: its numbers do not agree with each other"));
        Ok(Some((restored.ok_or_else(damaged)?, end)))
    }

    /// Keep the members if the last time is long enough ago.
    pub(crate) fn update(&mut self, statistics: &SweepStatistics) {
        if self.keeper.is_due() {
            self.keep(statistics);
        }
    }

    /// Keep the members now.
    pub(crate) fn keep(&mut self, statistics: &SweepStatistics) {
        self.keeper.keep(SWEEP, |file| self.empty.write_with_statistics(statistics, file));
    }

    /// The first error.
    pub(crate) fn remark(self) -> Option<String> {
        self.keeper.remark()
    }
}

/// Keeps the rows of the log of one study, and has those of an earlier run.
pub(crate) struct RowKeeper {
    keeper: Keeper,
    files: RowFiles,
    head: KeptRows,
    journal: RowJournal,
    /// Rows of the earlier run, and the number of them that were taken.
    earlier: Vec<f64>,
    taken: usize,
}

impl RowKeeper {
    /// `head` is of the study, without rows.
    ///
    /// # Errors
    /// When the kept rows are of another study or damaged, or the folder cannot be written.
    pub(crate) fn open(checkpoint: Checkpoint, files: RowFiles, mut head: KeptRows) -> Result<Self, InputError> {
        let folder = checkpoint.folder.clone();
        if let Some(kept) = checkpoint.read(files.head, KeptRows::from_json)? {
            check_study(&checkpoint, files.unit, &kept.study, &head.study)?;
            head.finished = kept.finished;
        }
        let fault = |message: String| InputError::general(format!("{}: {message}", folder.display()));
        let mut earlier = Vec::new();
        // A row follows its number.
        let journal = fs::create_dir_all(&folder).and_then(|()| {
            RowJournal::open(&folder.join(files.rows), 1 + head.columns, head.finished, |row| {
                earlier.extend(&row[1..]);
                Ok::<(), io::Error>(())
            })
        });
        let journal = journal.map_err(|error| fault(error.to_string()))?;
        let (found, expected, unit) = (earlier.len() / head.columns, head.finished, files.unit);
        if found != expected {
            return Err(fault(format!("damaged: {found} {unit}, expected {expected}")));
        }
        Ok(Self { keeper: Keeper::new(checkpoint), files, head, journal, earlier, taken: 0 })
    }

    /// Number of rows that are kept.
    pub(crate) fn finished(&self) -> usize {
        self.head.finished
    }

    /// Keep the rows now.
    pub(crate) fn keep(&mut self) {
        if self.keeper.error.is_some() {
            return;
        }
        match self.journal.commit() {
            Ok(()) => self.keeper.keep(self.files.head, |file| file.write_all(self.head.to_json().as_bytes())),
            Err(error) => self.keeper.fail(error),
        }
    }

    /// The first error.
    pub(crate) fn remark(self) -> Option<String> {
        self.keeper.remark()
    }
}

impl WorkLog for RowKeeper {
    fn next(&mut self) -> Option<&[f64]> {
        let start = self.taken * self.head.columns;
        let row = self.earlier.get(start..start + self.head.columns)?;
        self.taken += 1;
        Some(row)
    }

    fn add(&mut self, row: &[f64]) {
        if self.keeper.error.is_some() {
            return;
        }
        self.journal.add(self.head.finished as f64);
        row.iter().for_each(|&number| self.journal.add(number));
        self.head.finished += 1;
        if self.keeper.is_due() {
            self.keep();
        }
    }
}

/// # Errors
/// When the kept work is of another study.
fn check_study(checkpoint: &Checkpoint, unit: &str, found: &str, expected: &str) -> Result<(), InputError> {
    if found == expected {
        return Ok(());
    }
    let folder = checkpoint.folder.display();
    Err(InputError::general(format!("{folder} keeps {unit} of another study: {found}, expected {expected}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_counts_rows_is_not_named_before_they_are_on_the_disk() {
        let folder = std::env::temp_dir().join(format!("bondline-sync-{}", std::process::id()));
        let checkpoint = Checkpoint::new(&folder);
        checkpoint.write(SWEEP, |file| file.write_all(b"0")).expect("a folder without journals");
        // A folder cannot be synchronised as a file is.
        fs::create_dir(folder.join("members.rows")).expect("a folder of this test");
        let refused = checkpoint.write(SWEEP, |file| file.write_all(b"1"));
        let kept = fs::read_to_string(folder.join(SWEEP)).expect("the first file");
        fs::remove_dir_all(&folder).expect("a folder of this test");
        assert!(refused.is_err());
        assert_eq!(kept, "0");
    }
}
