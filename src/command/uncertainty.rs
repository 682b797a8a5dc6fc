//! `bondline uncertainty --members` and `--piece`: some members of a Monte Carlo sweep.

use crate::case::Case;
use crate::command::args::{CaseArgs, KeepArg, ResumeArgs};
use crate::command::ask::{checked, origin};
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::command::member_output::MemberOutput;
use crate::command::progress::MarchProgress;
use crate::command::resume::Resumable;
use crate::command::run::{open_session, output_path};
use crate::command::stop::token_of_signals;
use crate::kept_work::sweep_piece::{CaseIdentity, Piece, fingerprint};
use crate::march::Precision;
use crate::question::{Question, Uncertainty};
use crate::report::files::PartFolder;
use crate::study::uncertainty::Sweep;
use std::path::Path;

/// Compute some members of a sweep and write their statistics to a file. There is no report and no check of
/// `--max-failed`: both are of the whole sweep.
pub(crate) fn write_part(
    args: &CaseArgs,
    question: Uncertainty,
    resume: &ResumeArgs,
    keep: Option<KeepArg>,
) -> Result<Output, Failure> {
    let (case, question) = checked(args, question.into())?;
    let Question::Uncertainty(question) = question else { return Err(input("expected members of a sweep")) };
    let (draw, (members, equal_pieces)) = (question.sweep(), question.part()?);
    let (id, name) = (case.id().to_owned(), format!("{}-{}-{}.json", case.id(), members.start, members.end));
    let folder =
        PartFolder::open(&output_path("uncertainty", args, &id), &id, args.force, &name).map_err(unusable_folder)?;
    // A task that a scheduler starts again does no work twice.
    let path = folder.file(&name);
    if equal_pieces.is_some() && !args.force && is_same_piece(&path, &case, &draw, args.march.backend.precision) {
        let text = format!("members {}..{} are already in {}\n", members.start, members.end, path.display());
        return Ok(Output { text, failure: None });
    }
    let resumable = Resumable::open("uncertainty", folder.checkpoint(&name), args, resume)?;
    let (cancel, progress) = (token_of_signals(), MarchProgress::new(args.march.quiet));
    let mut session = open_session(args, case, Some(&resumable), &cancel, &progress)?;
    let part = (members.len() < draw.members).then_some(&members);
    let path_of = &mut |name: &str| Ok(folder.file(name));
    let mut output = MemberOutput::create(path_of, &session, keep, part, Some(&resumable), &cancel)?;
    let append = &mut |ensemble: &_, traces: &_| output.append(ensemble, traces);
    let found = session.uncertainty_part(&question, append);
    let found = output.check(found)?;
    output.close(&origin(session.case(), &draw, &found.backend))?;
    progress.clear();
    let mark = CaseIdentity {
        id,
        path: std::path::absolute(&args.case).unwrap_or_else(|_| args.case.clone()),
        sets: args.march.overrides()?,
        fingerprint: fingerprint(session.case()),
    };
    let mut piece =
        Piece::new(mark, draw, &found.backend, found.run, members.clone(), &found.nominal, &found.statistics);
    piece.equal_pieces = equal_pieces;
    let path = folder.write_file(&name, piece.to_json().as_bytes())?;
    resumable.remove()?;
    let text = format!(
        "members {}..{} of {}, {} of them completed: {}\n",
        members.start,
        members.end,
        draw.members,
        found.statistics.completed(),
        path.display()
    );
    Ok(Output { text, failure: None })
}

/// Whether a file is a piece of this sweep, by this version and with the precision that is asked for.
fn is_same_piece(path: &Path, case: &Case, draw: &Sweep, precision: Option<Precision>) -> bool {
    let Ok((piece, _)) = Piece::read(path) else { return false };
    piece.run.version == env!("CARGO_PKG_VERSION")
        && piece.case.fingerprint == fingerprint(case)
        && piece.draw == *draw
        && precision.is_none_or(|precision| piece.backend.precision == precision.name())
}
