//! Merging of the pieces of a sweep, to the bit what one sweep over all members gives.

use super::error::{InputError, SessionError};
use crate::case::{Bounds, Case};
use crate::ensemble::{Sampling, SamplingKind};
use crate::march::{Backend, Precision};
use crate::pilot::pilot;
use crate::study::answers::Answers;
use crate::study::nominal::Nominal;
use crate::study::seconds::Seconds;
use crate::study::sweep_piece::{Piece, PieceError, fingerprint};
use crate::study::uncertainty::Gathered;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What is kept of a piece after it is merged. Pieces are read one after the other, so that a thousand of them take no
/// more memory than two.
struct Merged<'a> {
    path: &'a Path,
    members: Range<usize>,
    device: String,
}

/// Merge the files that [`piece`](crate::study::sweep_piece) describes, in any order. `lies` is the path of the case;
/// `None` takes the path at which it was marched.
///
/// # Errors
/// When the files are not the whole of one sweep, the case has changed since, or a file cannot be read.
pub fn merge(pieces: &[PathBuf], lies: Option<&Path>) -> Result<Answers, SessionError> {
    let began = Instant::now();
    let path = pieces.first().ok_or_else(|| InputError::plain("no piece to merge"))?;
    let first = Piece::read(path)?;
    is_of_one_sweep((path, &first), (path, &first))?;
    let lies = lies.unwrap_or(&first.case.path);
    let case = Case::load_with(lies, &first.case.sets)?;
    if fingerprint(&case) != first.case.fingerprint {
        return Err(wrong(format!(
            "{}: the case {:?} at {} is not what was marched (fingerprint {}, expected {}): it has changed since, or \
             --case names another",
            path.display(),
            case.id,
            lies.display(),
            fingerprint(&case),
            first.case.fingerprint
        )));
    }
    let plan = pilot(&case)?;
    let plan_s = began.elapsed().as_secs_f64();
    let traces = first.nominal(case.sensors.len());
    let temperatures = case.sensors.len() * plan.instants_s.len();
    let envelope = first.envelope();
    if (traces.temperatures_k.len(), traces.gauges.len(), traces.extremes_k.len())
        != (temperatures, plan.gauges() * plan.instants_s.len(), case.layup.plies.len())
        || (envelope.below_k.len(), envelope.above_k.len()) != (temperatures, temperatures)
    {
        return Err(damaged(path));
    }
    let nominal = Nominal::of(&case, &plan, &traces, 0);
    let bounds = Bounds::named(&first.draw.bounds).ok_or_else(|| damaged(path))?;
    let kind = SamplingKind::named(&first.draw.sampling).ok_or_else(|| damaged(path))?;
    let mut whole = Gathered::new(&case, &nominal, &envelope, bounds, kind);
    let mut merged = Vec::with_capacity(pieces.len());
    for at in pieces {
        let piece = Piece::read(at)?;
        is_of_one_sweep((at, &piece), (path, &first))?;
        let part = whole.restored(piece.numbers(), piece.kept().clone(), &piece.failures());
        let part = part.filter(|part| part.members() == piece.members.len()).ok_or_else(|| damaged(at))?;
        whole.merge(&part);
        merged.push(Merged { path: at, members: piece.members, device: piece.backend.name });
    }
    merged.sort_by_key(|piece| (piece.members.start, piece.members.end));
    is_whole(&merged, first.draw.members)?;
    let outcome = whole.answer(&nominal, &Sampling { kind, seed: first.draw.seed }, first.draw.members);
    // Nothing is marched here; what the pieces took is theirs to tell.
    let seconds = Seconds { plan_s, march_s: 0.0, reduce_s: began.elapsed().as_secs_f64() - plan_s, began };
    let mut answers = Answers::new("merge", case, backend(&first, &merged), seconds);
    answers.seed = Some(first.draw.seed);
    answers.nominal = Some(nominal);
    answers.uncertainty = Some(outcome);
    Ok(answers)
}

impl From<PieceError> for SessionError {
    fn from(error: PieceError) -> Self {
        InputError::plain(error).into()
    }
}

fn wrong(message: String) -> SessionError {
    InputError::plain(message).into()
}

fn damaged(path: &Path) -> SessionError {
    wrong(format!("{}: damaged: what it holds does not add up to what it says it is", path.display()))
}

/// A piece is of this version, and of the case, the draw and the nominal march of the first.
fn is_of_one_sweep((path, piece): (&Path, &Piece), (at, first): (&Path, &Piece)) -> Result<(), SessionError> {
    let version = env!("CARGO_PKG_VERSION");
    if piece.bondline != version {
        let (path, made) = (path.display(), &piece.bondline);
        return Err(wrong(format!("{path}: made by bondline {made}, expected {version} as this one")));
    }
    let differs = |what: &str, found: &str, wanted: &str| {
        Err(wrong(format!(
            "{} and {} are not of one sweep: their {what} differ, {found} and {wanted}",
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
        return differs("draws", &word(piece), &word(first));
    }
    let carrier = |piece: &Piece| format!("{} {}", piece.backend.kind, piece.backend.precision);
    if carrier(piece) != carrier(first) {
        return differs("backends", &carrier(piece), &carrier(first));
    }
    if !piece.has_nominal_of(first) {
        let word = |piece: &Piece| format!("on {}", piece.backend.name);
        return differs("nominal marches", &word(piece), &word(first));
    }
    Ok(())
}

/// The pieces, in order, hold every member once.
fn is_whole(pieces: &[Merged], all: usize) -> Result<(), SessionError> {
    let mut next = 0;
    for Merged { path, members, .. } in pieces {
        let Range { start, end } = *members;
        if start >= end || end > all {
            return Err(damaged(path));
        }
        if start < next {
            let path = path.display();
            return Err(wrong(format!("{path}: members {start}..{end} overlap another piece, which ends at {next}")));
        }
        if start > next {
            return Err(missing(next, start, all));
        }
        next = end;
    }
    if next < all { Err(missing(next, all, all)) } else { Ok(()) }
}

fn missing(start: usize, end: usize, all: usize) -> SessionError {
    wrong(format!("no piece holds members {start}..{end} of the {all} drawn"))
}

/// What marched: the names of all the devices, once each.
fn backend(first: &Piece, pieces: &[Merged]) -> Backend {
    let mut names: Vec<&str> = pieces.iter().map(|piece| piece.device.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    Backend {
        name: names.join("; "),
        kind: if first.backend.kind == "gpu" { "gpu" } else { "cpu" },
        precision: if first.backend.precision == "f32" { Precision::F32 } else { Precision::F64 },
    }
}
