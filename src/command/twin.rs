//! `bondline twin` without `--study`: synthetic observations from known factors.

use crate::command::args::{CaseArgs, ResumeArgs};
use crate::command::ask::checked;
use crate::command::exit::{Failure, Output, input, unusable_folder};
use crate::command::progress::MarchProgress;
use crate::command::run::session_options;
use crate::question::{Question, Twin};
use crate::report;
use crate::session::Session;
use std::path::{Path, PathBuf};

/// Write the observations of one set of true factors.
pub(crate) fn write_observations(args: &CaseArgs, question: Twin, resume: &ResumeArgs) -> Result<Output, Failure> {
    let of_study = [resume.given_option(), args.limit_time_s.map(|_| "--limit-time"), args.json.then_some("--json")];
    if let Some(option) = of_study.into_iter().flatten().next() {
        return Err(input(format!("{option}: it is for the report of a study, with --study N")));
    }
    let (case, question) = checked(args, question.into())?;
    let Question::Twin(question) = question else { return Err(input("expected true factors")) };
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("measured.csv"));
    if out.exists() && !args.force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    report::files::check_writable(out.parent().unwrap_or(Path::new("."))).map_err(unusable_folder)?;
    let progress = MarchProgress::new(args.march.quiet);
    let mut session = Session::open(case, &session_options(&args.march, &progress))?;
    let made = session.twin(&question)?;
    progress.clear();
    report::files::write_observations(&out, session.case(), &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {} K, seed {}: {}\n",
        made.instants_s.len(),
        session.case().sensors().len(),
        question.noise_k.unwrap_or(0.0),
        question.seed,
        out.display()
    );
    Ok(Output { text, failure: None })
}
