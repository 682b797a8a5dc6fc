//! Merging of the parts of a sweep. The result is bit-identical to one sweep over all members.

use super::error::{InputError, SessionError};
use crate::adapt::adapt;
use crate::case::{Bounds, Case};
use crate::ensemble::{Sampling, SamplingKind};
use crate::march::{Backend, Precision};
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;
use crate::study::run_record::RunRecord;
use crate::study::sweep_piece::{Piece, PieceError, fingerprint};
use crate::study::timing::Timing;
use crate::study::uncertainty::SweepStatistics;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A part that has been merged. Parts are read one after the other, so that memory does not grow with their number.
struct MergedPart<'a> {
    path: &'a Path,
    members: Range<usize>,
    device: String,
    statistics_checksum: String,
}

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

/// Merge files of the form of [`sweep_piece`](crate::study::sweep_piece), in any order. `case_path` is the path of the
/// case; `None`: the path that the first file states.
///
/// # Errors
/// When the files are not all parts of one sweep, the case has changed since, or a file cannot be read.
pub fn merge(pieces: &[PathBuf], case_path: Option<&Path>) -> Result<Answers, SessionError> {
    let began = Instant::now();
    let (path, first) = first_part(pieces)?;
    let case_path = case_path.unwrap_or(&first.case.path);
    let case = Case::load_with(case_path, &first.case.sets)?;
    if fingerprint(&case) != first.case.fingerprint {
        return Err(input_error(format!(
            "{}: the case {:?} at {} is not the case of this file (fingerprint {}, expected {}): it has changed since, \
             or --case names another",
            path.display(),
            case.id,
            case_path.display(),
            fingerprint(&case),
            first.case.fingerprint
        )));
    }
    let plan = adapt(&case)?;
    let plan_s = began.elapsed().as_secs_f64();
    let traces = first.nominal(case.sensors.len());
    let temperatures = case.sensors.len() * plan.instants_s.len();
    let envelope = first.envelope();
    let (limited, gauges) = (case.limits.len() * plan.instants_s.len(), plan.gauges() * plan.instants_s.len());
    if (traces.temperatures_k.len(), traces.limited_k.len(), traces.gauges.len(), traces.extremes_k.len())
        != (temperatures, limited, gauges, case.layup.plies.len())
        || (envelope.below_k.len(), envelope.above_k.len()) != (temperatures, temperatures)
    {
        return Err(damaged_file(path));
    }
    let nominal = Prediction::of(&case, &plan, &traces, 0);
    let bounds = Bounds::named(&first.draw.bounds).ok_or_else(|| damaged_file(path))?;
    let kind = SamplingKind::named(&first.draw.sampling).ok_or_else(|| damaged_file(path))?;
    let mut whole = SweepStatistics::new(&case, &nominal, &envelope, bounds, kind);
    let mut merged: Vec<MergedPart<'_>> = Vec::with_capacity(pieces.len());
    let mut run = RunRecord::new(None, &march_backend(&first, String::new()), rayon::current_num_threads());
    run.add_files(&case);
    for at in pieces {
        let (piece, file) = Piece::read(at)?;
        check_same_sweep((at, &piece), (path, &first))?;
        run.input_files.push(file);
        let statistics_checksum = piece.statistics_checksum();
        if let Some(same) = merged.iter().find(|part| part.members == piece.members) {
            if same.statistics_checksum == statistics_checksum {
                continue;
            }
            let Range { start, end } = piece.members;
            return Err(input_error(format!(
                "{}: its members {start}..{end} have other numbers than those in {}",
                at.display(),
                same.path.display()
            )));
        }
        let part = whole.restored(piece.numbers(), piece.kept().clone(), piece.margins(), &piece.failures());
        let part = part.filter(|part| part.members() == piece.members.len()).ok_or_else(|| damaged_file(at))?;
        whole.merge(&part);
        let Piece { members, backend, .. } = piece;
        merged.push(MergedPart { path: at, members, device: backend.name, statistics_checksum });
    }
    merged.sort_by_key(|part| (part.members.start, part.members.end));
    check_complete(&merged, first.draw.members)?;
    let outcome = whole.results(&nominal, &Sampling { kind, seed: first.draw.seed }, first.draw.members);
    // The times of the marches are in the outputs of the parts.
    let seconds = Timing { plan_s, march_s: 0.0, other_s: began.elapsed().as_secs_f64() - plan_s, start: began };
    let mut answers = Answers::new("merge", case, merged_backend(&first, &merged), seconds, run);
    answers.seed = Some(first.draw.seed);
    answers.nominal = Some(nominal);
    answers.uncertainty = Some(outcome);
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
        check_same_sweep((at, &piece), (path, &first))?;
        equal_pieces = equal_pieces.filter(|_| piece.equal_pieces == equal_pieces);
        found.push(piece.members);
    }
    found.sort_by_key(|members| members.start);
    Ok(MissingMembers { ranges: gaps(&found, first.draw.members), members: first.draw.members, equal_pieces })
}

fn first_part(pieces: &[PathBuf]) -> Result<(&Path, Piece), SessionError> {
    let path = pieces.first().ok_or_else(|| InputError::general("no files to merge"))?;
    let (first, _) = Piece::read(path)?;
    check_same_sweep((path, &first), (path, &first))?;
    Ok((path, first.without_statistics()))
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

fn input_error(message: String) -> SessionError {
    InputError::general(message).into()
}

fn damaged_file(path: &Path) -> SessionError {
    input_error(format!("{}: damaged: its numbers do not agree with each other", path.display()))
}

/// Check that a part is of this version, and of the same case, samples, backend and nominal march as the first.
fn check_same_sweep((path, piece): (&Path, &Piece), (at, first): (&Path, &Piece)) -> Result<(), SessionError> {
    let version = env!("CARGO_PKG_VERSION");
    if piece.run.version != version {
        let (path, made) = (path.display(), &piece.run.version);
        return Err(input_error(format!(
            "{path}: written by bondline {made}, expected {version}, the version that merges"
        )));
    }
    match difference(piece, first) {
        None => Ok(()),
        Some((what, found, expected)) => Err(input_error(format!(
            "{} and {} are not parts of one sweep: their {what} differ, {found} and {expected}",
            path.display(),
            at.display()
        ))),
    }
}

/// What makes two pieces parts of different sweeps, with its value in each: case, samples, backend or nominal march.
pub(super) fn difference(piece: &Piece, first: &Piece) -> Option<(&'static str, String, String)> {
    let pair = |what, word: &dyn Fn(&Piece) -> String| Some((what, word(piece), word(first)));
    if (&piece.case.id, &piece.case.fingerprint) != (&first.case.id, &first.case.fingerprint) {
        return pair("cases", &|piece| format!("{} ({})", piece.case.id, piece.case.fingerprint));
    }
    if piece.draw != first.draw {
        return pair("samples", &|piece| {
            let draw = &piece.draw;
            format!("{} members by {}, seed {}, {} bounds", draw.members, draw.sampling, draw.seed, draw.bounds)
        });
    }
    if (&piece.backend.kind, &piece.backend.precision) != (&first.backend.kind, &first.backend.precision) {
        return pair("backends", &|piece| format!("{} {}", piece.backend.kind, piece.backend.precision));
    }
    if !piece.has_same_nominal(first) {
        return pair("nominal marches", &|piece| format!("on {}", piece.backend.name));
    }
    None
}

/// Check that the parts, in order of their members, contain every member once.
fn check_complete(parts: &[MergedPart<'_>], all: usize) -> Result<(), SessionError> {
    let missing =
        |start: usize, end: usize| Err(input_error(format!("no file has members {start}..{end} of all {all}")));
    let mut next = 0;
    for MergedPart { path, members, .. } in parts {
        let Range { start, end } = *members;
        if start >= end || end > all {
            return Err(damaged_file(path));
        }
        if start < next {
            let path = path.display();
            return Err(input_error(format!(
                "{path}: members {start}..{end} overlap another part, which ends at {next}"
            )));
        }
        if start > next {
            return missing(next, start);
        }
        next = end;
    }
    if next < all { missing(next, all) } else { Ok(()) }
}

/// The backend of all parts, with the name of every device.
fn merged_backend(first: &Piece, parts: &[MergedPart<'_>]) -> Backend {
    let mut names: Vec<&str> = parts.iter().map(|part| part.device.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    march_backend(first, names.join("; "))
}

/// The backend of a part, with this name.
fn march_backend(part: &Piece, name: String) -> Backend {
    Backend {
        name,
        kind: if part.backend.kind == "gpu" { "gpu" } else { "cpu" },
        driver: part.run.driver.clone(),
        precision: if part.backend.precision == "f32" { Precision::F32 } else { Precision::F64 },
    }
}
