//! `bondline uncertainty`: a Monte Carlo sweep over the factors, or a part of one.

use crate::command::args::convert;
use crate::command::args::{Ask, Keep, Sweep};
use crate::command::exit::{Ending, Failure};
use crate::command::member_output::Kept;
use crate::command::run::{Run, load, too_many_failed};
use bondline::study::sweep_piece::{CaseMark, Draw, Piece, fingerprint};
use std::ops::Range;

pub(crate) fn run(ask: &Ask, sweep: &Sweep, keep: Option<Keep>) -> Result<Ending, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("uncertainty", ask, case)?;
    let mut kept = Kept::open(&mut run.folder, run.session.case(), run.session.plan(), keep, None)?;
    let outcome = run.session.uncertainty_with(&options, &mut |ensemble, traces| kept.take(ensemble, traces))?;
    kept.close()?;
    run.end(too_many_failed(&outcome, sweep.max_failed))
}

/// March some members of a sweep and leave their statistics. There is no report: figures of a part would pass for those
/// of the whole, and whether too many failed is told of the whole as well.
pub(crate) fn leave_piece(
    ask: &Ask,
    sweep: &Sweep,
    keep: Option<Keep>,
    members: Range<usize>,
) -> Result<Ending, Failure> {
    let options = convert::sweep(sweep);
    let case = load(&ask.case, &ask.on)?;
    options.check(&case)?;
    let mut run = Run::of("uncertainty", ask, case)?;
    let part = (members.len() < sweep.members).then_some(&members);
    let mut kept = Kept::open(&mut run.folder, run.session.case(), run.session.plan(), keep, part)?;
    let take = &mut |ensemble: &_, traces: &_| kept.take(ensemble, traces);
    let found = run.session.uncertainty_part(&options, members.clone(), take)?;
    kept.close()?;
    run.done();
    let case = run.session.case();
    let mark = CaseMark {
        id: case.id().to_owned(),
        path: std::path::absolute(&ask.case).unwrap_or_else(|_| ask.case.clone()),
        sets: convert::sets(&ask.on.sets)?,
        fingerprint: fingerprint(case),
    };
    let draw = Draw {
        members: options.members,
        sampling: options.sampling.name().to_owned(),
        seed: options.seed,
        bounds: options.bounds.name().to_owned(),
    };
    let piece = Piece::new(mark, draw, &found.backend, members.clone(), &found.nominal, &found.gathered);
    let path = run.folder.put(&piece.file_name(), piece.to_json().as_bytes())?;
    let text = format!(
        "members {}..{} of {} drawn, {} of them arrived: {}\n",
        members.start,
        members.end,
        options.members,
        found.gathered.ok(),
        path.display()
    );
    Ok(Ending { text, why: None })
}
