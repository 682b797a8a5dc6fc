//! Merging of the parts of a sweep. The result is bit-identical to one sweep over all members.

use super::error::{InputError, SessionError};
use crate::adapt::adapt;
use crate::case::{Bounds, Case};
use crate::ensemble::{Sampling, SamplingKind};
use crate::march::{Backend, Precision};
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;
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
}

/// Merge files of the form of [`sweep_piece`](crate::study::sweep_piece), in any order. `case_path` is the path of the
/// case; `Scalar`: the path that the first file states.
///
/// # Errors
/// When the files are not all parts of one sweep, the case has changed since, or a file cannot be read.
pub fn merge(pieces: &[PathBuf], case_path: Option<&Path>) -> Result<Answers, SessionError> {
    let began = Instant::now();
    let path = pieces.first().ok_or_else(|| InputError::general("no files to merge"))?;
    let first = Piece::read(path)?;
    check_same_sweep((path, &first), (path, &first))?;
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
    if (traces.temperatures_k.len(), traces.gauges.len(), traces.extremes_k.len())
        != (temperatures, plan.gauges() * plan.instants_s.len(), case.layup.plies.len())
        || (envelope.below_k.len(), envelope.above_k.len()) != (temperatures, temperatures)
    {
        return Err(damaged_file(path));
    }
    let nominal = Prediction::of(&case, &plan, &traces, 0);
    let bounds = Bounds::named(&first.draw.bounds).ok_or_else(|| damaged_file(path))?;
    let kind = SamplingKind::named(&first.draw.sampling).ok_or_else(|| damaged_file(path))?;
    let mut whole = SweepStatistics::new(&case, &nominal, &envelope, bounds, kind);
    let mut merged: Vec<MergedPart<'_>> = Vec::with_capacity(pieces.len());
    for at in pieces {
        let piece = Piece::read(at)?;
        check_same_sweep((at, &piece), (path, &first))?;
        let part = whole.restored(piece.numbers(), piece.kept().clone(), &piece.failures());
        let part = part.filter(|part| part.members() == piece.members.len()).ok_or_else(|| damaged_file(at))?;
        whole.merge(&part);
        merged.push(MergedPart { path: at, members: piece.members, device: piece.backend.name });
    }
    merged.sort_by_key(|part| (part.members.start, part.members.end));
    check_complete(&merged, first.draw.members)?;
    let outcome = whole.results(&nominal, &Sampling { kind, seed: first.draw.seed }, first.draw.members);
    // The times of the marches are in the outputs of the parts.
    let seconds = Timing { plan_s, march_s: 0.0, other_s: began.elapsed().as_secs_f64() - plan_s, start: began };
    let mut answers = Answers::new("merge", case, merged_backend(&first, &merged), seconds);
    answers.seed = Some(first.draw.seed);
    answers.nominal = Some(nominal);
    answers.uncertainty = Some(outcome);
    Ok(answers)
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
    if piece.bondline != version {
        let (path, made) = (path.display(), &piece.bondline);
        return Err(input_error(format!(
            "{path}: written by bondline {made}, expected {version}, the version that merges"
        )));
    }
    let differs = |what: &str, found: &str, expected: &str| {
        Err(input_error(format!(
            "{} and {} are not parts of one sweep: their {what} differ, {found} and {expected}",
            path.display(),
            at.display()
        )))
    };
    if (&piece.case.id, &piece.case.fingerprint) != (&first.case.id, &first.case.fingerprint) {
        let word = |piece: &Piece| format!("{} ({})", piece.case.id, piece.case.fingerprint);
        return differs("cases", &word(piece), &word(first));
    }
    if piece.draw != first.draw {
        let word = |piece: &Piece| {
            let draw = &piece.draw;
            format!("{} members by {}, seed {}, {} bounds", draw.members, draw.sampling, draw.seed, draw.bounds)
        };
        return differs("samples", &word(piece), &word(first));
    }
    let backend = |piece: &Piece| format!("{} {}", piece.backend.kind, piece.backend.precision);
    if backend(piece) != backend(first) {
        return differs("backends", &backend(piece), &backend(first));
    }
    if !piece.has_same_nominal(first) {
        let word = |piece: &Piece| format!("on {}", piece.backend.name);
        return differs("nominal marches", &word(piece), &word(first));
    }
    Ok(())
}

/// Check that the parts, in order of their members, contain every member once.
fn check_complete(parts: &[MergedPart<'_>], all: usize) -> Result<(), SessionError> {
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
            return Err(missing_members(next, start, all));
        }
        next = end;
    }
    if next < all { Err(missing_members(next, all, all)) } else { Ok(()) }
}

fn missing_members(start: usize, end: usize, all: usize) -> SessionError {
    input_error(format!("no file has members {start}..{end} of all {all}"))
}

/// The backend of all parts, with the name of every device.
fn merged_backend(first: &Piece, parts: &[MergedPart<'_>]) -> Backend {
    let mut names: Vec<&str> = parts.iter().map(|part| part.device.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    Backend {
        name: names.join("; "),
        kind: if first.backend.kind == "gpu" { "gpu" } else { "cpu" },
        precision: if first.backend.precision == "f32" { Precision::F32 } else { Precision::F64 },
    }
}
