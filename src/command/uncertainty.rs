//! `bondline uncertainty`: a Monte Carlo sweep over the factors, or a part of one.

use crate::case::Case;
use crate::command::args::convert;
use crate::command::args::{CaseArgs, KeepArg, ProfileArgs, ResumeArgs, SweepArgs};
use crate::command::exit::{Failure, Output, unusable_folder};
use crate::command::member_output::MemberOutput;
use crate::command::progress::MarchProgress;
use crate::command::resume::Resumable;
use crate::command::run::{Run, load, open_session, output_path, too_many_failed};
use crate::command::stop::token_of_signals;
use crate::march::{Backend, Precision};
use crate::report::files::PartFolder;
use crate::session::UncertaintyOptions;
use crate::study::sweep_piece::{CaseIdentity, Piece, SamplingRecord, file_name, fingerprint};
use std::ops::Range;
use std::path::Path;

pub(crate) fn run(
    args: &CaseArgs,
    sweep: &SweepArgs,
    resume: &ResumeArgs,
    profiles: &ProfileArgs,
    keep: Option<KeepArg>,
) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let profiles = convert::depth_profiles(profiles, &case)?;
    let mut run = Run::open_resumable("uncertainty", args, case, resume)?;
    run.session.set_depth_profiles(profiles)?;
    let Run { folder, session, resumable, cancel, .. } = &mut run;
    let path_of = &mut |name: &str| folder.reserve(name);
    let mut output = MemberOutput::create(path_of, session, keep, None, resumable.as_ref(), cancel)?;
    let found = session.uncertainty_with(&options, &mut |ensemble, traces| output.append(ensemble, traces));
    let found = output.check(found)?;
    let backend = session.answers().map(|answers| &answers.backend);
    output.close(&origin(session.case(), &SamplingRecord::from(&options), backend))?;
    run.finish(too_many_failed(&found.failures, found.members, sweep.max_failed))
}

/// Draw members until an interval is narrow enough. Exit code 1 if it is not after the largest number of members.
pub(crate) fn run_until(args: &CaseArgs, sweep: &SweepArgs, target: &str) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    let target = convert::precision_target(target, &case)?;
    options.check_until(&case, &target)?;
    let mut run = Run::open("uncertainty", args, case)?;
    let found = run.session.uncertainty_until(&options, &target, &mut |_, _| {})?;
    let most = sweep.max_failed.unwrap_or(found.members() / 100);
    let failure = match (found.failed > most, found.is_reached) {
        (true, _) => Some(format!("{} members failed, more than the allowed {most}", found.failed)),
        (_, false) => Some(format!(
            "the interval is not as narrow as --until states after {} members: raise -n ({})",
            found.members(),
            sweep.members
        )),
        _ => None,
    };
    run.finish(failure)
}

/// Some members of a sweep.
pub(crate) struct Part {
    pub members: Range<usize>,
    /// Number of equal pieces, if this is one of them.
    pub equal_pieces: Option<usize>,
}

/// Compute some members of a sweep and write their statistics to a file. There is no report and no check of
/// `--max-failed`: both are of the whole sweep.
pub(crate) fn write_part(
    args: &CaseArgs,
    sweep: &SweepArgs,
    resume: &ResumeArgs,
    keep: Option<KeepArg>,
    Part { members, equal_pieces }: Part,
) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let (id, name) = (case.id().to_owned(), file_name(case.id(), &members));
    let folder =
        PartFolder::open(&output_path("uncertainty", args, &id), &id, args.force, &name).map_err(unusable_folder)?;
    // A task that a scheduler starts again does no work twice.
    let path = folder.file(&name);
    let precision = convert::choice(&args.march)?.precision;
    if equal_pieces.is_some() && !args.force && is_same_piece(&path, &case, &options, precision) {
        let text = format!("members {}..{} are already in {}\n", members.start, members.end, path.display());
        return Ok(Output { text, failure: None });
    }
    let resumable = Resumable::open("uncertainty", folder.checkpoint(&name), args, resume)?;
    let (cancel, progress) = (token_of_signals(), MarchProgress::new(args.march.quiet));
    let mut session = open_session(args, case, Some(&resumable), &cancel, &progress)?;
    let part = (members.len() < sweep.members).then_some(&members);
    let path_of = &mut |name: &str| Ok(folder.file(name));
    let mut output = MemberOutput::create(path_of, &session, keep, part, Some(&resumable), &cancel)?;
    let append = &mut |ensemble: &_, traces: &_| output.append(ensemble, traces);
    let found = session.uncertainty_part(&options, members.clone(), append);
    let found = output.check(found)?;
    let draw = SamplingRecord::from(&options);
    output.close(&origin(session.case(), &draw, Some(&found.backend)))?;
    progress.clear();
    let mark = CaseIdentity {
        id,
        path: std::path::absolute(&args.case).unwrap_or_else(|_| args.case.clone()),
        sets: convert::sets(&args.march.sets)?,
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
        options.members,
        found.statistics.completed(),
        path.display()
    );
    Ok(Output { text, failure: None })
}

/// Whether a file is a piece of this sweep, by this version and with the precision that is asked for.
fn is_same_piece(path: &Path, case: &Case, options: &UncertaintyOptions, precision: Option<Precision>) -> bool {
    let Ok((piece, _)) = Piece::read(path) else { return false };
    piece.run.version == env!("CARGO_PKG_VERSION")
        && piece.case.fingerprint == fingerprint(case)
        && piece.draw == SamplingRecord::from(options)
        && precision.is_none_or(|precision| piece.backend.precision == precision.name())
}

/// What made the rows of the files of members.
fn origin(case: &Case, draw: &SamplingRecord, backend: Option<&Backend>) -> Vec<(&'static str, String)> {
    let device = backend.map(|backend| ("backend", format!("{} {}", backend.kind, backend.precision.name())));
    let SamplingRecord { members, sampling, seed, bounds } = draw;
    let sampling = format!("{members} members by {sampling}, seed {seed}, {bounds} bounds");
    let of_case = [("case", case.id().to_owned()), ("fingerprint", fingerprint(case)), ("sampling", sampling)];
    of_case.into_iter().chain(device).collect()
}
