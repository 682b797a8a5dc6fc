//! Code common to the studies of a case: the session, the folder of the report, the output and the exit code.

use crate::case::{Case, CaseError, SourceLocation};
use crate::command::args::{CaseArgs, MarchArgs, ResumeArgs};
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::command::progress::MarchProgress;
use crate::command::resume::{Resumable, time_limit};
use crate::command::stop::token_of_signals;
use crate::command::terminal::print_error;
use crate::report::files::OutputFolder;
use crate::session::{Answers, CancelToken, Options, PlanCache, Session};
use crate::study::uncertainty;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A study of a case, with the folder of its report.
pub(crate) struct Run {
    pub session: Session,
    pub folder: OutputFolder,
    pub resumable: Option<Resumable>,
    /// Ends the studies of the session.
    pub cancel: CancelToken,
    progress: MarchProgress,
    json: bool,
    is_quiet: bool,
}

impl Run {
    /// Open the session, and the folder of the report. `id` names all cases of the report; finished work is kept if
    /// there is `resume`.
    pub(crate) fn open(
        command: &str,
        args: &CaseArgs,
        case: Case,
        id: &str,
        resume: Option<&ResumeArgs>,
    ) -> Result<Self, Failure> {
        let folder = OutputFolder::open(&output_path(command, args, id), id, args.force).map_err(unusable_folder)?;
        let resumable = resume.map(|resume| Resumable::open(command, folder.checkpoint(), args, resume)).transpose()?;
        let progress = MarchProgress::new(args.march.quiet);
        let cancel = token_of_signals();
        let session = open_session(args, case, resumable.as_ref(), &cancel, &progress)?;
        Ok(Self { session, folder, resumable, cancel, progress, json: args.json, is_quiet: args.march.quiet })
    }

    /// Remove the progress bar.
    pub(crate) fn clear_progress(&self) {
        self.progress.clear();
    }

    /// Write the report. `failure` is the reason for exit code 1 although there are answers.
    pub(crate) fn finish(self, failure: Option<String>) -> Result<Output, Failure> {
        self.clear_progress();
        let files = self.session.report(&self.folder)?;
        if !self.is_quiet {
            print_renamed_files(&self.folder);
        }
        let stopped = self.session.answers().and_then(stop_reason);
        if let (Some(resumable), None) = (&self.resumable, &stopped) {
            resumable.remove()?;
        }
        let text = output_text(&files, self.json, || self.session.summary().map_err(Failure::from))?;
        let failure = stopped.or_else(|| self.session.answers().and_then(exit_reason)).or(failure);
        Ok(Output { text, failure })
    }
}

/// Options of a session that reports its progress.
pub(crate) fn session_options(march: &MarchArgs, progress: &MarchProgress) -> Options {
    let display = progress.clone();
    let mut options = Options::default().progress(move |progress| display.show(progress)).command_line(command_line());
    (options.march, options.tolerance_k) = (march.backend.clone(), march.tolerance_k);
    options.plan_cache = PlanCache::of_user();
    options
}

/// The words of the command.
pub fn command_line() -> Vec<String> {
    std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect()
}

/// A session that a token and a time limit stop, and that keeps its finished work.
pub(crate) fn open_session(
    args: &CaseArgs,
    case: Case,
    resumable: Option<&Resumable>,
    cancel: &CancelToken,
    progress: &MarchProgress,
) -> Result<Session, Failure> {
    let mut options = session_options(&args.march, progress).cancel(cancel);
    options.deadline = time_limit(args)?.map(|limit| Instant::now() + limit);
    options.checkpoint = resumable.map(|resumable| resumable.checkpoint.clone());
    Ok(Session::open(case, &options)?)
}

/// How a study that was stopped goes on.
fn stop_reason(answers: &Answers) -> Option<String> {
    let sweep = answers.uncertainty.as_ref().filter(|sweep| sweep.is_partial());
    let sweep = sweep.map(|sweep| (sweep.members, sweep.requested, "members"));
    let study = answers.coverage_study.as_ref().filter(|study| study.is_partial());
    let study = study.map(|study| (study.fits.len(), study.requested, "data sets"));
    let (finished, requested, unit) = sweep.or(study)?;
    Some(format!("stopped after {finished} of {requested} {unit}: --resume goes on with the others"))
}

/// The folder of the outputs of a command.
pub(crate) fn output_path(command: &str, args: &CaseArgs, id: &str) -> PathBuf {
    args.out.clone().unwrap_or_else(|| PathBuf::from("out").join(id).join(command))
}

/// The reason for exit code 1: an answer cannot be used, or a minimisation did not converge.
pub(crate) fn exit_reason(answers: &Answers) -> Option<String> {
    let compared = answers.model_comparison.iter().map(|comparison| &comparison.estimated);
    let unconverged = answers.estimated.iter().chain(compared).find(|estimated| !estimated.converged);
    let unconverged = || unconverged.map(|estimated| format!("no convergence: {}", estimated.termination));
    answers.unusable_reason().or_else(unconverged)
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

/// The case, with the changes by `--set`.
pub(crate) fn load(path: &Path, march: &MarchArgs) -> Result<Case, Failure> {
    let case = load_with(path, &march.overrides()?)?;
    if !march.quiet {
        print_notes(&case);
    }
    Ok(case)
}

/// The case with these changes, whose errors name the option `--set`.
pub(crate) fn load_with(path: &Path, overrides: &[(String, String)]) -> Result<Case, CaseError> {
    Case::load_with(path, overrides).map_err(|mut error| {
        for diagnostic in &mut error.diagnostics {
            name_option(&mut diagnostic.location, overrides);
        }
        error
    })
}

/// Name the option in the location of a change.
fn name_option(location: &mut SourceLocation, overrides: &[(String, String)]) {
    if overrides.iter().any(|(name, value)| *location.file == *format!("{name}={value}")) {
        location.file = format!("--set {}", location.file).into();
    }
}

/// Print what was not read of a case, and old names in its files.
pub(crate) fn print_notes(case: &Case) {
    for note in case.unread_data() {
        let mut note = note.clone();
        name_option(&mut note.location, case.overrides());
        print_error(&format!("note: {note}"));
    }
}

/// Print a note on every file of the user that got another name.
pub(crate) fn print_renamed_files(folder: &OutputFolder) {
    for (own, path) in folder.renamed() {
        let name = path.file_name().unwrap_or_default().display();
        print_error(&format!("note: {} is no file of a report and was kept as {name}", own.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::ErrorEstimate;
    use crate::question::{Requirement, Size, Uncertainty};
    use crate::session::BackendKind;

    fn session() -> Session {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU is always available")
    }

    /// The reason for exit code 1 of spoiled answers.
    fn reason(sound: &Answers, spoil: impl Fn(&mut Answers)) -> String {
        assert_eq!(exit_reason(sound), None, "the answers are sound");
        let mut spoiled = sound.clone();
        spoil(&mut spoiled);
        exit_reason(&spoiled).expect("a reason")
    }

    #[test]
    fn a_thickness_whose_march_is_inaccurate_or_unbalanced_ends_with_exit_code_1() {
        let mut session = session();
        let size = Size::new("SLAB", "BACK", 600.0);
        let requirement = Requirement { probability: 0.5, ..size.requirement.clone() };
        let size = Size { members: 10, requirement, ..size };
        session.size(&size).expect("a thickness");
        let answers = session.answers().expect("answers");
        let sizing = |answers: &Answers| answers.sizing.clone().expect("a thickness");
        assert!(sizing(answers).error_estimate.is_some_and(|reached| reached.nominal_k < 0.1));
        let found = reason(answers, |answers| {
            let inaccurate = Some(ErrorEstimate::of_temperature(0.6, 0.05));
            answers.sizing.iter_mut().for_each(|sizing| sizing.error_estimate.clone_from(&inaccurate));
        });
        assert!(found.starts_with("the march at the required thickness cannot be used: its discretisation"), "{found}");
        let found = reason(answers, |answers| {
            let balances = answers.sizing.iter_mut().filter_map(|sizing| sizing.balance.as_mut());
            balances.for_each(|balance| balance.stored_j_m2 *= 2.0);
        });
        assert!(found.starts_with("the march at the required thickness cannot be used: its energy balance"), "{found}");
    }

    #[test]
    fn a_sweep_of_inaccurate_members_ends_with_exit_code_1_and_one_of_inaccurate_extremes_does_not() {
        let mut session = session();
        session.uncertainty(&Uncertainty { members: 50, ..Uncertainty::default() }).expect("a sweep");
        let answers = session.answers().expect("answers");
        let found = reason(answers, |answers| {
            let errors = answers.uncertainty.iter_mut().filter_map(|sweep| sweep.discretisation_error.as_mut());
            errors.for_each(|error| error.others.temperature_k = Some(0.6));
        });
        assert!(
            found.starts_with("the march of a member cannot be used: its discretisation error is 0.6 K"),
            "{found}"
        );
        let mut extreme = answers.clone();
        let errors = extreme.uncertainty.iter_mut().filter_map(|sweep| sweep.discretisation_error.as_mut());
        errors.for_each(|error| error.extreme.temperature_k = Some(0.6));
        assert_eq!(exit_reason(&extreme), None);
    }
}
