//! Finished work, kept in a folder while a study runs: after a kill, it goes on from there. Members of a sweep are kept
//! as the statistics of one [piece](crate::study::sweep_piece), whose size does not grow with their number; a coverage
//! study keeps its fits.

use super::error::{InputError, SessionError};
use super::merge::difference;
use crate::study::coverage_study::{DataSetFit, kept_fits::KeptFits};
use crate::study::sweep_piece::Piece;
use crate::study::uncertainty::SweepStatistics;
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The statistics of a sweep so far, and the fits of a coverage study.
const SWEEP: &str = "sweep.json";
const FITS: &str = "fits.json";

/// Longest time between two writes by default.
const INTERVAL: Duration = Duration::from_secs(5);

/// A write may take this share of the time.
const MAX_TIME_SHARE: u32 = 20;

/// A folder for the complete members of a sweep, or the fits of a coverage study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    folder: PathBuf,
    interval: Duration,
}

/// What a folder keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct KeptWork {
    /// `members` or `data sets`.
    pub unit: &'static str,
    /// First, and one past the last.
    pub range: Range<usize>,
    /// Number of them that completed.
    pub completed: usize,
    /// Number of the whole sweep or study.
    pub requested: usize,
    /// When the run began that kept them, UTC.
    pub date: String,
}

impl Checkpoint {
    /// A folder, which is made when work is kept: every five seconds, or after every batch of members or block of fits
    /// if that takes longer.
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
    pub fn found(&self) -> Result<Option<KeptWork>, SessionError> {
        if let Some(piece) = self.piece()? {
            let (range, completed) = (piece.members.clone(), piece.completed());
            let (requested, date) = (piece.draw.members, piece.run.date);
            return Ok(Some(KeptWork { unit: "members", range, completed, requested, date }));
        }
        let kept = |fits: KeptFits| KeptWork {
            unit: "data sets",
            range: 0..fits.len(),
            completed: fits.len(),
            requested: fits.requested,
            date: fits.run.date,
        };
        Ok(self.fits()?.map(kept))
    }

    /// Remove the folder, once the answer is in safety.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn remove(&self) -> io::Result<()> {
        // These go first: what is left cannot be taken for finished work.
        let files = [SWEEP, FITS].map(|name| fs::remove_file(self.folder.join(name)));
        for removed in files.into_iter().chain([fs::remove_dir_all(&self.folder)]) {
            removed.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })?;
        }
        Ok(())
    }

    fn piece(&self) -> Result<Option<Piece>, SessionError> {
        let path = self.folder.join(SWEEP);
        if path.exists() { Ok(Some(Piece::read(&path)?.0)) } else { Ok(None) }
    }

    fn fits(&self) -> Result<Option<KeptFits>, SessionError> {
        let path = self.folder.join(FITS);
        if !path.exists() {
            return Ok(None);
        }
        let fault = |message: String| InputError::general(format!("{}: {message}", path.display()));
        let text = fs::read_to_string(&path).map_err(|error| fault(error.to_string()))?;
        Ok(Some(KeptFits::from_json(&text).map_err(fault)?))
    }

    fn write(&self, name: &str, text: &str) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let partial = self.folder.join(format!("{name}.partial"));
        let mut file = File::create(&partial)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(partial, self.folder.join(name))
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

    fn keep(&mut self, name: &str, text: impl FnOnce() -> String) {
        if self.error.is_some() {
            return;
        }
        let start = Instant::now();
        if let Err(error) = self.checkpoint.write(name, &text()) {
            self.error = Some(format!("{}: {error}", self.checkpoint.folder.display()));
        }
        (self.last, self.last_took) = (Instant::now(), start.elapsed());
    }

    fn remark(self) -> Option<String> {
        self.error.map(|error| format!("Finished work could not be kept while the study ran: {error}."))
    }
}

/// Keeps the members of one sweep.
pub(super) struct SweepKeeper {
    keeper: Keeper,
    /// A piece of this sweep without members.
    empty: Piece,
}

impl SweepKeeper {
    /// `empty` is a piece of the sweep without members, from the first member to come.
    pub(super) fn new(checkpoint: Checkpoint, empty: Piece) -> Self {
        Self { keeper: Keeper::new(checkpoint), empty }
    }

    /// The kept statistics of this sweep, and one past the last of their members; `None` if none are kept.
    ///
    /// # Errors
    /// When they are of another sweep or damaged.
    pub(super) fn kept(
        &self,
        statistics: &SweepStatistics,
        part: &Range<usize>,
    ) -> Result<Option<(SweepStatistics, usize)>, SessionError> {
        let Some(piece) = self.keeper.checkpoint.piece()? else { return Ok(None) };
        let folder = self.keeper.checkpoint.folder.display();
        let other = |what: &str, found: String, expected: String| {
            InputError::general(format!(
                "{folder} keeps members of another sweep: its {what} {found}, expected {expected}"
            ))
        };
        if let Some((what, found, expected)) = difference(&piece, &self.empty) {
            return Err(other(what, found, expected).into());
        }
        let Range { start, end } = piece.members;
        if start != part.start || end > part.end {
            let text = |range: &Range<usize>| format!("{}..{}", range.start, range.end);
            return Err(other("members", text(&(start..end)), text(part)).into());
        }
        let restored = statistics.restored(piece.numbers(), piece.kept().clone(), &piece.failures());
        let restored = restored.filter(|restored| restored.members() == end - start);
        let damaged = || InputError::general(format!("{folder}: damaged: its numbers do not agree with each other"));
        Ok(Some((restored.ok_or_else(damaged)?, end)))
    }

    /// Keep the members if the last time is long enough ago.
    pub(super) fn update(&mut self, statistics: &SweepStatistics) {
        if self.keeper.is_due() {
            self.keep(statistics);
        }
    }

    /// Keep the members now.
    pub(super) fn keep(&mut self, statistics: &SweepStatistics) {
        self.keeper.keep(SWEEP, || self.empty.with_statistics(statistics).to_json());
    }

    /// The first error.
    pub(super) fn remark(self) -> Option<String> {
        self.keeper.remark()
    }
}

/// Keeps the fits of one coverage study.
pub(super) struct FitKeeper {
    keeper: Keeper,
    fits: KeptFits,
}

impl FitKeeper {
    /// `empty` is of the study, without fits.
    pub(super) fn new(checkpoint: Checkpoint, empty: KeptFits) -> Self {
        Self { keeper: Keeper::new(checkpoint), fits: empty }
    }

    /// The kept fits of this study.
    ///
    /// # Errors
    /// When they are of another study or damaged.
    pub(super) fn kept(&self) -> Result<Vec<DataSetFit>, SessionError> {
        let Some(kept) = self.keeper.checkpoint.fits()? else { return Ok(Vec::new()) };
        if kept.study == self.fits.study {
            return Ok(kept.fits());
        }
        let folder = self.keeper.checkpoint.folder.display();
        let (found, expected) = (kept.study, &self.fits.study);
        Err(InputError::general(format!("{folder} keeps fits of another study: {found}, expected {expected}")).into())
    }

    /// Keep the fits if the last time is long enough ago.
    pub(super) fn update(&mut self, fits: &[DataSetFit]) {
        if self.keeper.is_due() {
            self.keep(fits);
        }
    }

    /// Keep the fits now.
    pub(super) fn keep(&mut self, fits: &[DataSetFit]) {
        self.fits.set(fits);
        self.keeper.keep(FITS, || self.fits.to_json());
    }

    /// The first error.
    pub(super) fn remark(self) -> Option<String> {
        self.keeper.remark()
    }
}
