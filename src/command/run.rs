//! What the studies of a case share: the session, the folder of the report, the output and the exit code.

use crate::command::args::convert;
use crate::command::args::renamed;
use crate::command::args::{CaseArgs, MarchArgs};
use crate::command::exit::{Failure, Output, input};
use crate::command::progress::MarchProgress;
use bondline::Session;
use bondline::case::{Case, RenamedKey};
use bondline::report::files::OutputFolder;
use bondline::session::Answers;
use bondline::study::uncertainty::{self, failure_reason};
use std::path::{Path, PathBuf};

/// A study of a case, with the folder of its report.
pub(crate) struct Run {
    pub session: Session,
    pub folder: OutputFolder,
    progress: MarchProgress,
    json: bool,
}

impl Run {
    /// Open the session, and the folder of the report.
    pub(crate) fn open(command: &str, args: &CaseArgs, case: Case) -> Result<Self, Failure> {
        let id = case.id().to_owned();
        Self::open_with_id(command, args, case, &id)
    }

    /// [`open`](Self::open) with an `id` that names all cases of the report.
    pub(crate) fn open_with_id(command: &str, args: &CaseArgs, case: Case, id: &str) -> Result<Self, Failure> {
        let path = args.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join(command));
        let folder = OutputFolder::open(&path, id, args.force)?;
        let progress = MarchProgress::new(args.march.quiet);
        let session = Session::open(case, &convert::options(&args.march, &progress)?)?;
        Ok(Self { session, folder, progress, json: args.json })
    }

    /// Remove the progress bar.
    pub(crate) fn clear_progress(&self) {
        self.progress.clear();
    }

    /// Write the report. `failure` is the reason for exit code 1 although there are answers.
    pub(crate) fn finish(self, failure: Option<String>) -> Result<Output, Failure> {
        self.clear_progress();
        let files = self.session.report(&self.folder)?;
        let text = output_text(&files, self.json, || self.session.summary().map_err(Failure::from))?;
        Ok(Output { text, failure: self.session.answers().and_then(exit_reason).or(failure) })
    }
}

/// The reason for exit code 1: the nominal march failed, or the minimisation did not converge.
fn exit_reason(answers: &Answers) -> Option<String> {
    let nominal_failure = answers.nominal.as_ref().and_then(|nominal| failure_reason(&answers.case, &nominal.status));
    let unconverged = answers.estimated.as_ref().filter(|estimated| !estimated.converged);
    match (nominal_failure, unconverged) {
        (Some(reason), _) => Some(format!("the nominal march failed: {reason}")),
        (None, unconverged) => unconverged.map(|estimated| format!("no convergence: {}", estimated.termination)),
    }
}

/// Text for standard output: the summary and the path of the report, or the summary as JSON.
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

/// The reason for exit code 1 if more members failed than are allowed: `max_failed`, or 1 % of `members`.
pub(crate) fn too_many_failed(
    failures: &[uncertainty::Failure],
    members: usize,
    max_failed: Option<usize>,
) -> Option<String> {
    let failed: usize = failures.iter().map(|failure| failure.members).sum();
    let most = max_failed.unwrap_or(members / 100);
    (failed > most).then(|| {
        let reasons: Vec<String> =
            failures.iter().map(|failure| format!("{}: {}", failure.members, failure.reason)).collect();
        format!("{failed} members failed, more than the allowed {most} ({})", reasons.join("; "))
    })
}

/// The cases at these paths. Two cases of one id are refused, as the report distinguishes cases by their ids.
pub(crate) fn load_all<'a>(paths: impl Iterator<Item = &'a PathBuf>, march: &MarchArgs) -> Result<Vec<Case>, Failure> {
    let mut cases: Vec<Case> = Vec::new();
    for path in paths {
        let case = load(path, march)?;
        if let Some(other) = cases.iter().find(|other| other.id() == case.id()) {
            return Err(input(format!("{}: there is already a case {:?}", path.display(), other.id())));
        }
        cases.push(case);
    }
    Ok(cases)
}

/// The case, with the changes by `--set`.
pub(crate) fn load(path: &Path, march: &MarchArgs) -> Result<Case, Failure> {
    let case = Case::load_with(path, &convert::sets(&march.sets)?)?;
    print_renamed_keys(case.renamed_keys());
    Ok(case)
}

/// Print a note on every old name in a file.
pub(crate) fn print_renamed_keys(renamed_keys: &[RenamedKey]) {
    for key in renamed_keys {
        eprintln!("{}", renamed::note(key));
    }
}
