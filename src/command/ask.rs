//! Commands that ask a question of a case: the answer becomes a report, text and an exit code.

use crate::case::Case;
use crate::command::args::{CaseArgs, KeepArg, ResumeArgs};
use crate::command::design::write_design;
use crate::command::exit::{Failure, Output, input};
use crate::command::member_output::MemberOutput;
use crate::command::run::{Run, load, load_with, print_notes, too_many_failed};
use crate::command::terminal::print_error;
use crate::kept_work::sweep_piece::fingerprint;
use crate::march::Backend;
use crate::question::{Goal, Question, Uncertainty};
use crate::session::Answers;
use crate::study::uncertainty::Sweep;

/// Options of a command that are no part of its question.
#[derive(Clone, Debug, Default)]
pub(crate) struct Extras {
    /// Finished work is kept.
    pub resume: Option<ResumeArgs>,
    pub max_failed: Option<usize>,
    pub keep: Option<KeepArg>,
}

impl Extras {
    /// Options of a question that keeps its finished work.
    pub(crate) fn kept(resume: ResumeArgs, max_failed: Option<usize>) -> Self {
        Self { resume: Some(resume), max_failed, keep: None }
    }
}

pub(crate) fn run(args: &CaseArgs, question: impl Into<Question>, extras: &Extras) -> Result<Output, Failure> {
    let question = question.into();
    if let (Question::Observations(_), Some(_)) = (&question, args.limit_time_s) {
        return Err(input("--limit-time has no effect: observations are read, and nothing is marched"));
    }
    let (case, question) = checked(args, question)?;
    let resume = resume_args(&question, extras)?;
    let id = match &question {
        Question::Estimate(estimate) => estimate.ids(&case).join("+"),
        _ => case.id().to_owned(),
    };
    let mut run = Run::open(question.name(), args, case, &id, resume)?;
    let Run { folder, session, resumable, cancel, .. } = &mut run;
    let path_of = &mut |name: &str| folder.reserve(name);
    let mut output = MemberOutput::create(path_of, session, extras.keep, None, resumable.as_ref(), cancel)?;
    let asked = session.ask_with(&question, &mut |ensemble, traces| output.append(ensemble, traces));
    let asked = asked.map(|answers| answers.backend.clone());
    let backend = output.check(asked)?;
    if let Question::Uncertainty(uncertainty) = &question {
        output.close(&origin(session.case(), &uncertainty.sweep(), &backend))?;
    }
    let answers = session.answers().ok_or_else(|| input("the question has no answers"))?;
    if answers.experiment_design.is_some() {
        write_design(answers, &args.case, folder)?;
    }
    let failure = reason_of_failure(answers, &question, extras.max_failed);
    let not_estimated = answers.not_estimated.clone();
    run.clear_progress();
    if let Some(reason) = not_estimated.filter(|_| !args.march.quiet) {
        print_error(&format!("no estimation: {reason}"));
    }
    run.finish(failure)
}

/// The case and the question, which reads its other cases, once they fit together.
pub(crate) fn checked(args: &CaseArgs, mut question: Question) -> Result<(Case, Question), Failure> {
    let (case, overrides) = (load(&args.case, &args.march)?, args.march.overrides()?);
    question.read_cases(|path| {
        let other = load_with(path, &overrides)?;
        if !args.march.quiet {
            print_notes(&other);
        }
        Ok(other)
    })?;
    question.check(&case)?;
    Ok((case, question))
}

/// The options for finished work, where the question keeps any.
fn resume_args<'a>(question: &Question, extras: &'a Extras) -> Result<Option<&'a ResumeArgs>, Failure> {
    let resume = extras.resume.as_ref();
    match question {
        Question::Uncertainty(Uncertainty { goal: Goal::Until(_), .. }) => Ok(None),
        Question::Estimate(estimate) if !estimate.posterior.posterior => {
            match resume.and_then(ResumeArgs::given_option) {
                Some(option) => Err(input(format!("{option}: without --posterior nothing is kept"))),
                None => Ok(None),
            }
        }
        _ => Ok(resume),
    }
}

/// The reason for exit code 1 although there are answers, apart from those of all questions.
fn reason_of_failure(answers: &Answers, question: &Question, max_failed: Option<usize>) -> Option<String> {
    if let Some(reached) = &answers.precision_reached {
        let most = max_failed.unwrap_or(reached.members() / 100);
        let members = match question {
            Question::Uncertainty(uncertainty) => uncertainty.members,
            _ => reached.members(),
        };
        return match (reached.failed > most, reached.is_reached) {
            (true, _) => Some(format!("{} members failed, more than the allowed {most}", reached.failed)),
            (_, false) => Some(format!(
                "the interval is not as narrow as --until states after {} members: raise -n ({members})",
                reached.members(),
            )),
            _ => None,
        };
    }
    let swept = answers.uncertainty.as_ref();
    let swept = swept.and_then(|found| too_many_failed(&found.failures, found.members, max_failed));
    let sized =
        || answers.sizing.as_ref().and_then(|found| too_many_failed(&found.failures, found.members, max_failed));
    let traded = || {
        let trade = answers.trade.as_ref()?;
        trade.layups.iter().find_map(|layup| {
            let reason = too_many_failed(&layup.failures, trade.members, max_failed)?;
            Some(format!("{}: {reason}", trade.materials_of(layup).join(", ")))
        })
    };
    let inverted = answers.flux_inversion.as_ref().filter(|found| !found.converged);
    let inverted = || inverted.map(|found| format!("no convergence: {}", found.termination));
    swept.or_else(sized).or_else(traded).or_else(inverted)
}

/// Origin of the rows of the files of members: case, sampling and backend.
pub(crate) fn origin(case: &Case, draw: &Sweep, backend: &Backend) -> Vec<(&'static str, String)> {
    vec![
        ("case", case.id().to_owned()),
        ("fingerprint", fingerprint(case)),
        ("sampling", draw.to_string()),
        ("backend", format!("{} {}", backend.kind, backend.precision.name())),
    ]
}
