//! `bondline uncertainty`: a Monte Carlo sweep over the factors, or a part of one.

use crate::command::args::convert;
use crate::command::args::{CaseArgs, KeepArg, SweepArgs};
use crate::command::exit::{Failure, Output};
use crate::command::member_output::MemberOutput;
use crate::command::run::{Run, load, too_many_failed};
use bondline::study::sweep_piece::{CaseIdentity, Piece, SamplingRecord, fingerprint};
use std::ops::Range;

pub(crate) fn run(args: &CaseArgs, sweep: &SweepArgs, keep: Option<KeepArg>) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open("uncertainty", args, case)?;
    let mut output = MemberOutput::create(&mut run.folder, run.session.case(), run.session.plan(), keep, None)?;
    let found = run.session.uncertainty_with(&options, &mut |ensemble, traces| output.append(ensemble, traces))?;
    output.close()?;
    run.finish(too_many_failed(&found.failures, found.members, sweep.max_failed))
}

/// Compute some members of a sweep and write their statistics to a file. There is no report and no check of
/// `--max-failed`: both are of the whole sweep.
pub(crate) fn write_part(
    args: &CaseArgs,
    sweep: &SweepArgs,
    keep: Option<KeepArg>,
    members: Range<usize>,
) -> Result<Output, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&args.case, &args.march)?;
    options.check(&case)?;
    let mut run = Run::open("uncertainty", args, case)?;
    let part = (members.len() < sweep.members).then_some(&members);
    let mut output = MemberOutput::create(&mut run.folder, run.session.case(), run.session.plan(), keep, part)?;
    let append = &mut |ensemble: &_, traces: &_| output.append(ensemble, traces);
    let found = run.session.uncertainty_part(&options, members.clone(), append)?;
    output.close()?;
    run.clear_progress();
    let case = run.session.case();
    let mark = CaseIdentity {
        id: case.id().to_owned(),
        path: std::path::absolute(&args.case).unwrap_or_else(|_| args.case.clone()),
        sets: convert::sets(&args.march.sets)?,
        fingerprint: fingerprint(case),
    };
    let draw = SamplingRecord {
        members: options.members,
        sampling: options.sampling.name().to_owned(),
        seed: options.seed,
        bounds: options.bounds.name().to_owned(),
    };
    let piece = Piece::new(mark, draw, &found.backend, members.clone(), &found.nominal, &found.statistics);
    let path = run.folder.write_file(&piece.file_name(), piece.to_json().as_bytes())?;
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
