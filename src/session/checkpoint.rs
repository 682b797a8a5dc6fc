//! Complete members of a sweep, kept in a folder while it runs: after a kill, a sweep goes on from there. The members
//! are kept as the statistics of one [piece](crate::study::sweep_piece), whose size does not grow with their number.

use super::error::{InputError, SessionError};
use super::merge::difference;
use crate::study::sweep_piece::Piece;
use crate::study::uncertainty::SweepStatistics;
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The statistics so far.
const SWEEP: &str = "sweep.json";

/// Longest time between two writes by default.
const INTERVAL: Duration = Duration::from_secs(5);

/// A write may take this share of the time.
const MAX_TIME_SHARE: u32 = 20;

/// A folder for the complete members of a sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    folder: PathBuf,
    interval: Duration,
}

/// What a folder keeps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct KeptMembers {
    /// The members: first, and one past the last.
    pub members: Range<usize>,
    /// Number of them that completed.
    pub completed: usize,
    /// Members of the whole sweep.
    pub requested: usize,
    /// When the run began that kept them, UTC.
    pub date: String,
}

impl Checkpoint {
    /// A folder, which is made when members are kept, at least every five seconds or after every batch if that takes
    /// longer.
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

    /// The members in the folder; `None` if it has none.
    ///
    /// # Errors
    /// When the file cannot be read or is damaged.
    pub fn found(&self) -> Result<Option<KeptMembers>, SessionError> {
        let kept = |piece: Piece| KeptMembers {
            completed: piece.completed(),
            members: piece.members,
            requested: piece.draw.members,
            date: piece.run.date,
        };
        Ok(self.piece()?.map(kept))
    }

    /// Remove the folder, once the answer is in safety.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn remove(&self) -> io::Result<()> {
        // The statistics go first: what is left cannot be taken for members.
        for removed in [fs::remove_file(self.folder.join(SWEEP)), fs::remove_dir_all(&self.folder)] {
            removed.or_else(|error| if error.kind() == io::ErrorKind::NotFound { Ok(()) } else { Err(error) })?;
        }
        Ok(())
    }

    fn piece(&self) -> Result<Option<Piece>, SessionError> {
        let path = self.folder.join(SWEEP);
        if path.exists() { Ok(Some(Piece::read(&path)?.0)) } else { Ok(None) }
    }

    fn write(&self, piece: &Piece) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let partial = self.folder.join(format!("{SWEEP}.partial"));
        let mut file = File::create(&partial)?;
        file.write_all(piece.to_json().as_bytes())?;
        file.sync_all()?;
        fs::rename(partial, self.folder.join(SWEEP))
    }
}

/// Keeps the members of one sweep.
pub(super) struct SweepKeeper {
    checkpoint: Checkpoint,
    /// A piece of this sweep without members.
    empty: Piece,
    last: Instant,
    last_took: Duration,
    /// The first error; members are not kept after it.
    pub(super) error: Option<String>,
}

impl SweepKeeper {
    /// `empty` is a piece of the sweep without members, from the first member to come.
    pub(super) fn new(checkpoint: Checkpoint, empty: Piece) -> Self {
        Self { checkpoint, empty, last: Instant::now(), last_took: Duration::ZERO, error: None }
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
        let Some(piece) = self.checkpoint.piece()? else { return Ok(None) };
        let folder = self.checkpoint.folder.display();
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
        if self.last.elapsed() >= self.checkpoint.interval.max(MAX_TIME_SHARE * self.last_took) {
            self.keep(statistics);
        }
    }

    /// Keep the members now.
    pub(super) fn keep(&mut self, statistics: &SweepStatistics) {
        if self.error.is_some() {
            return;
        }
        let start = Instant::now();
        if let Err(error) = self.checkpoint.write(&self.empty.with_statistics(statistics)) {
            self.error = Some(format!("{}: {error}", self.checkpoint.folder.display()));
        }
        (self.last, self.last_took) = (Instant::now(), start.elapsed());
    }
}
