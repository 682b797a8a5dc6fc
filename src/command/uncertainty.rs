//! `bondline uncertainty`: a Monte Carlo sweep over the factors, or a part of one.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, KeepArg, ResumeArgs, SweepArgs};
use crate::command::exit::{Failure, Output, unusable_folder};
use crate::command::member_output::MemberOutput;
use crate::command::progress::MarchProgress;
use crate::command::resume::Resumable;
use crate::command::run::{Run, load, open_session, output_path, too_many_failed};
use crate::command::stop::token_of_signals;
use bondline::case::Case;
use bondline::march::Backend;
use bondline::report::files::PartFolder;
use bondline::study::sweep_piece::{CaseIdentity, Piece, SamplingRecord, file_name, fingerprint};
use std::ops::Range;

pub(crate) fn run(
    args: &CaseArgs,
    sweep: &SweepArgs,
    resume: &ResumeArgs,
    keep: Option<KeepArg>,
) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open_resumable("uncertainty", args, case, resume)?;
    let Run { folder, session, resumable, cancel, .. } = &mut run;
    let path_of = &mut |name: &str| folder.reserve(name);
    let mut output = MemberOutput::create(path_of, session, keep, None, resumable.as_ref(), cancel)?;
    let found = session.uncertainty_with(&options, &mut |ensemble, traces| output.append(ensemble, traces));
    let found = output.check(found)?;
    let backend = session.answers().map(|answers| &answers.backend);
    output.close(&origin(session.case(), &SamplingRecord::from(&options), backend))?;
    run.finish(too_many_failed(&found.failures, found.members, sweep.max_failed))
}

/// Compute some members of a sweep and write their statistics to a file. There is no report and no check of
/// `--max-failed`: both are of the whole sweep.
pub(crate) fn write_part(
    args: &CaseArgs,
    sweep: &SweepArgs,
    resume: &ResumeArgs,
    keep: Option<KeepArg>,
    members: Range<usize>,
) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let (id, name) = (case.id().to_owned(), file_name(case.id(), &members));
    let folder =
        PartFolder::open(&output_path("uncertainty", args, &id), &id, args.force, &name).map_err(unusable_folder)?;
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
    let piece = Piece::new(mark, draw, &found.backend, found.run, members.clone(), &found.nominal, &found.statistics);
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

/// What made the rows of the files of members.
fn origin(case: &Case, draw: &SamplingRecord, backend: Option<&Backend>) -> Vec<(&'static str, String)> {
    let device = backend.map(|backend| ("backend", format!("{} {}", backend.kind, backend.precision.name())));
    let SamplingRecord { members, sampling, seed, bounds } = draw;
    let sampling = format!("{members} members by {sampling}, seed {seed}, {bounds} bounds");
    let of_case = [("case", case.id().to_owned()), ("fingerprint", fingerprint(case)), ("sampling", sampling)];
    of_case.into_iter().chain(device).collect()
}
