//! What the questions about a case share: the session, the folder of the report, the text and the exit code.

use crate::command::args::convert;
use crate::command::args::{Ask, On};
use crate::command::exit::{Ending, Failure, input};
use crate::command::progress::Bar;
use bondline::Session;
use bondline::case::Case;
use bondline::report::files::OutputFolder;
use bondline::session::Answers;
use bondline::study::uncertainty::{Uncertainty, reason};
use std::path::{Path, PathBuf};

/// A question that is being asked.
pub(crate) struct Run {
    pub session: Session,
    pub folder: OutputFolder,
    bar: Bar,
    json: bool,
}

impl Run {
    /// Open the session and the folder of the report, whose name is that of all cases in it.
    pub(crate) fn open(command: &str, ask: &Ask, case: Case, id: &str) -> Result<Self, Failure> {
        let path = ask.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join(command));
        let folder = OutputFolder::open(&path, id, ask.force)?;
        let bar = Bar::new(ask.on.quiet);
        let session = Session::open(case, &convert::options(&ask.on, &bar)?)?;
        Ok(Self { session, folder, bar, json: ask.json })
    }

    /// [`open`](Self::open) for a question about one case.
    pub(crate) fn of(command: &str, ask: &Ask, case: Case) -> Result<Self, Failure> {
        let id = case.id().to_owned();
        Self::open(command, ask, case, &id)
    }

    /// No more members will be marched.
    pub(crate) fn done(&self) {
        self.bar.done();
    }

    /// Write the report and say what came of the question. `failed` says why the exit code is 1 although there are
    /// answers.
    pub(crate) fn end(self, failed: Option<String>) -> Result<Ending, Failure> {
        self.done();
        let files = self.session.report(&self.folder)?;
        let text = output_text(&files, self.json, || self.session.summary().map_err(Failure::from))?;
        Ok(Ending { text, why: self.session.answers().and_then(failure_reason).or(failed) })
    }
}

/// Why answers are none: the nominal march failed, or the minimisation did not converge.
fn failure_reason(answers: &Answers) -> Option<String> {
    let strayed = answers.nominal.as_ref().and_then(|nominal| reason(&answers.case, &nominal.arrival));
    let unconverged = answers.estimated.as_ref().filter(|estimated| !estimated.converged);
    match (strayed, unconverged) {
        (Some(reason), _) => Some(format!("the nominal march did not arrive: {reason}")),
        (None, unconverged) => unconverged.map(|estimated| format!("no convergence: {}", estimated.termination)),
    }
}

/// What is printed of a report: its summary on the screen and where the page lies, or the summary as JSON.
pub(crate) fn output_text(
    files: &[PathBuf],
    json: bool,
    screen: impl FnOnce() -> Result<String, Failure>,
) -> Result<String, Failure> {
    let last = files.last().ok_or_else(|| input("the report wrote no file"))?;
    if json {
        return std::fs::read_to_string(last).map_err(|error| input(format!("reading {last:?} back: {error}")));
    }
    let page = files.iter().find(|path| path.ends_with("report.html")).unwrap_or(last);
    Ok(format!("{}\nreport: {}\n", screen()?.trim_end(), page.display()))
}

/// That more members failed than are put up with, and why.
pub(crate) fn too_many_failed(outcome: &Uncertainty, most: Option<usize>) -> Option<String> {
    let (failed, most) = (outcome.asked - outcome.ok, most.unwrap_or(outcome.asked / 100));
    (failed > most).then(|| {
        let reasons: Vec<String> =
            outcome.failures.iter().map(|failure| format!("{}: {}", failure.members, failure.reason)).collect();
        format!("{failed} members failed, more than the {most} put up with ({})", reasons.join("; "))
    })
}

/// Cases by their paths; no two of one name, as reports tell them apart by it.
pub(crate) fn load_all<'a>(paths: impl Iterator<Item = &'a PathBuf>, on: &On) -> Result<Vec<Case>, Failure> {
    let mut cases: Vec<Case> = Vec::new();
    for path in paths {
        let case = load(path, on)?;
        if let Some(known) = cases.iter().find(|other| other.id() == case.id()) {
            return Err(input(format!("{}: there is a case {:?} already", path.display(), known.id())));
        }
        cases.push(case);
    }
    Ok(cases)
}

/// The case, with what `--set` changes.
pub(crate) fn load(path: &Path, on: &On) -> Result<Case, Failure> {
    Ok(Case::load_with(path, &convert::sets(&on.sets)?)?)
}
