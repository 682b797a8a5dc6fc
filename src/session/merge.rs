//! Merging of the files of a sweep's parts. The result is bit-identical to one sweep over all members.

use super::sweep_merger::{SweepMerger, check_same_sweep, no_parts};
use super::{InputError, SessionError};
use crate::adapt::adapt;
use crate::case::Case;
use crate::kept_work::sweep_piece::{Piece, PieceError};
use crate::study::answers::Answers;
use crate::study::timing::Timing;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The members of a sweep that are in none of its files.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct MissingMembers {
    /// First member, and one past the last, of each gap in ascending order.
    pub ranges: Vec<Range<usize>>,
    /// Members of the whole sweep.
    pub members: usize,
    /// Number of equal pieces of the sweep, if all files are such pieces.
    pub equal_pieces: Option<usize>,
}

/// Merge the files of the parts of a sweep, in any order. `case_path` is the path of the case; `None`: the path that
/// the first file states.
///
/// # Errors
/// When the files are not all parts of one sweep, the case has changed since, or a file cannot be read.
pub fn merge(pieces: &[PathBuf], case_path: Option<&Path>) -> Result<Answers, SessionError> {
    let began = Instant::now();
    let (path, first) = first_part(pieces)?;
    let case = Case::load_with(case_path.unwrap_or(&first.case.path), &first.case.sets)?;
    let plan = adapt(&case)?;
    let plan_s = began.elapsed().as_secs_f64();
    let mut merger = SweepMerger::new(&case, &plan, &name(path), &first)?;
    let mut files = Vec::with_capacity(pieces.len());
    for at in pieces {
        let (piece, file) = Piece::read(at)?;
        merger.add(&name(at), piece)?;
        files.push(file);
    }
    merger.check_complete()?;
    let mut answers = merger.answers()?;
    answers.run.input_files.extend(files);
    // The times of the marches are in the outputs of the parts.
    answers.timing = Timing { plan_s, march_s: 0.0, other_s: began.elapsed().as_secs_f64() - plan_s, start: began };
    Ok(answers)
}

/// The members that are in none of the files.
///
/// # Errors
/// When the files are not all parts of one sweep, or a file cannot be read.
pub fn missing_members(pieces: &[PathBuf]) -> Result<MissingMembers, SessionError> {
    let (path, first) = first_part(pieces)?;
    let mut equal_pieces = first.equal_pieces;
    let mut found = Vec::with_capacity(pieces.len());
    for at in pieces {
        let (piece, _) = Piece::read(at)?;
        check_same_sweep((&name(at), &piece), (&name(path), &first))?;
        equal_pieces = equal_pieces.filter(|_| piece.equal_pieces == equal_pieces);
        found.push(piece.members);
    }
    found.sort_by_key(|members| members.start);
    Ok(MissingMembers { ranges: gaps(&found, first.draw.members), members: first.draw.members, equal_pieces })
}

/// The first file, without its statistics, which are large.
fn first_part(pieces: &[PathBuf]) -> Result<(&Path, Piece), SessionError> {
    let path = pieces.first().ok_or_else(no_parts)?;
    let (first, _) = Piece::read(path)?;
    check_same_sweep((&name(path), &first), (&name(path), &first))?;
    Ok((path, first.without_statistics()))
}

/// The name of a file in messages.
fn name(path: &Path) -> String {
    path.display().to_string()
}

/// The members below `all` that are in none of the ranges, which are in ascending order of their starts.
fn gaps(ranges: &[Range<usize>], all: usize) -> Vec<Range<usize>> {
    let (mut gaps, mut next) = (Vec::new(), 0);
    for range in ranges.iter().chain([&(all..all)]) {
        if range.start > next {
            gaps.push(next..range.start);
        }
        next = next.max(range.end);
    }
    gaps
}

impl From<PieceError> for SessionError {
    fn from(error: PieceError) -> Self {
        InputError::general(error).into()
    }
}
