//! The command: what each subcommand does, from its arguments to its text and exit code.

pub(crate) mod args;
mod devices;
pub(crate) mod exit;
mod history;
mod materials;
mod member_output;
mod merge;
mod progress;
mod size;
mod twin;
mod verify;

use crate::command::args::convert;
use crate::command::args::{Ask, Cli, Command, Fit, Keep, Method, On, Sweep, Trusted};
use crate::command::exit::{Ending, Failure, input};
use crate::command::member_output::Kept;
use crate::command::progress::Watched;
use bondline::case::{Bounds, Case};
use bondline::ensemble::Ensemble;
use bondline::march::choose;
use bondline::pilot::pilot;
use bondline::plan::Plan;
use bondline::report::files::OutputFolder;
use bondline::report::files::piece::{CaseMark, Draw, Piece, fingerprint};
use bondline::report::{self, Seconds, Story, summary};
use bondline::study::beside::{Beside, BesideError, beside};
use bondline::study::estimate::{EstimateError, Estimated, estimate};
use bondline::study::history::History;
use bondline::study::nominal::{Nominal, nominal};
use bondline::study::posterior::{Posterior, PosteriorError, Walkers, posterior};
use bondline::study::recovery::Recovery;
use bondline::study::sensitivity::{Sensitivity, sensitivity};
use bondline::study::size::Sizing;
use bondline::study::uncertainty::{Gathered, Uncertainty, reason};
use bondline::study::whole_traces::Envelope;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Carry out what was typed.
pub(crate) fn run(cli: Cli) -> Result<Ending, Failure> {
    match cli.command {
        Command::Devices { json } => devices::print(json),
        Command::Materials { look } => materials::print(look),
        Command::Verify { json, group, on } => verify::print(json, group.as_deref(), &on),
        Command::Size { ask, limit, sweep } => {
            Desk::open("size", ask, &[], sweep.members, |_| Ok(()))?.answer(|desk| {
                desk.predict()?;
                let (sizing, failed) = size::sized(&desk.case, &mut desk.march, &limit, &sweep)?;
                (desk.sizing, desk.failed, desk.seed) = (Some(sizing), failed, Some(sweep.seed));
                Ok(())
            })
        }
        Command::Twin { twin, data, fit } if twin.study.is_none() => twin::make(&twin, &data, &fit),
        Command::Twin { twin, data, fit } => {
            let (ask, twins) = (twin::ask(&twin), twin.study.unwrap_or_default());
            Desk::open("twin", ask, &[], twins, |cases| prepare(cases, &data, &fit))?.answer(|desk| {
                desk.predict()?;
                let outcome = twin::study(&desk.case, &desk.plan, &mut desk.march, &twin, &fit, twins)?;
                (desk.recovery, desk.seed) = (Some(outcome), Some(twin::seed(&twin)));
                Ok(())
            })
        }
        Command::History { ask, data, trace } => {
            Desk::open("history", ask, &[], 1, |cases| convert::trust(cases, &data))?.answer(|desk| {
                desk.predict()?;
                let (found, failed) = history::found(&desk.case, &mut desk.march, &data, &trace)?;
                (desk.history, desk.failed) = (Some(found), failed);
                Ok(())
            })
        }
        Command::Predict(ask) => Desk::open("predict", ask, &[], 1, |_| Ok(()))?.answer(Desk::predict),
        Command::Uncertainty { ask, sweep, keep, piece: None } => {
            Desk::open("uncertainty", ask, &[], sweep.members, |_| Ok(()))?.answer(|desk| {
                desk.predict()?;
                desk.doubt(&sweep, keep)
            })
        }
        Command::Uncertainty { ask, sweep, keep, piece: Some(piece) } => {
            let members = convert::piece(&piece, sweep.members)?;
            // What `auto` takes is told by the whole sweep, or pieces of several sizes would be marched on several backends.
            Desk::open("uncertainty", ask, &[], sweep.members, |_| Ok(()))?.leave_piece(&sweep, keep, members)
        }
        Command::Merge(merge) => merge::merge(&merge),
        Command::Sensitivity { ask, data, step, method } => {
            Desk::open("sensitivity", ask, &[], 16, |cases| convert::trust(cases, &data))?.answer(|desk| {
                desk.predict()?;
                desk.differentiate(method, step)
            })
        }
        Command::Estimate { ask, others, data, fit, walk, seed, beside } => {
            let walkers = convert::walkers(&walk, seed)?;
            let mut other: Vec<Case> = beside.map(|path| load(&path, &ask.on)).transpose()?.into_iter().collect();
            prepare(&mut other, &data, &fit)?;
            Desk::open("estimate", ask, &others, 16, |cases| prepare(cases, &data, &fit))?.answer(|desk| {
                desk.fit(&fit, walkers)?;
                other.first().map_or(Ok(()), |other| desk.hold_beside(other, &fit))
            })
        }
        Command::Study { ask, sweep, data, fit, walk } => {
            let walkers = convert::walkers(&walk, sweep.seed)?;
            let prepared = |cases: &mut [Case]| {
                prepare(cases, &data, &fit)?;
                convert::fitted(&cases[0], &fit, walkers.is_some())
            };
            Desk::open("study", ask, &[], sweep.members, prepared)?.answer(|desk| {
                desk.predict()?;
                desk.doubt(&sweep, None)?;
                desk.differentiate(None, None)?;
                if let Some(why) = convert::unfitted(&desk.case) {
                    desk.remark(&format!("no estimation: {why}"));
                    return Ok(());
                }
                desk.fit(&fit, walkers)
            })
        }
    }
}

/// What is typed of data and fit takes the place of what the cases say.
fn prepare(cases: &mut [Case], data: &Trusted, fit: &Fit) -> Result<(), Failure> {
    if cases.is_empty() {
        return Ok(());
    }
    convert::trust(cases, data)?;
    convert::fit(cases, fit)?;
    convert::begun(cases)
}

/// A question on the desk: the case, what marches it, and the answers so far.
struct Desk {
    command: &'static str,
    ask: Ask,
    case: Case,
    plan: Plan,
    /// The cases that are estimated with it, and their plans.
    others: Vec<Case>,
    other_plans: Vec<Plan>,
    march: Watched,
    folder: OutputFolder,
    began: Instant,
    plan_s: f64,
    study_s: f64,
    seed: Option<u64>,
    nominal: Option<Nominal>,
    uncertainty: Option<Uncertainty>,
    sensitivity: Option<Sensitivity>,
    estimated: Option<Estimated>,
    posterior: Option<Posterior>,
    beside: Option<Beside>,
    sizing: Option<Sizing>,
    history: Option<History>,
    recovery: Option<Recovery>,
    /// Failed members beyond what is put up with.
    failed: Option<String>,
}

impl Desk {
    fn open(
        command: &'static str,
        ask: Ask,
        others: &[PathBuf],
        members: usize,
        prepare: impl FnOnce(&mut [Case]) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        let began = Instant::now();
        let mut cases = all(std::iter::once(&ask.case).chain(others), &ask.on)?;
        prepare(&mut cases)?;
        let ids: Vec<&str> = cases.iter().map(|case| case.id.as_str()).collect();
        let id = ids.join("+");
        let others = cases.split_off(1);
        let case = cases.remove(0);
        let plan = pilot(&case)?;
        let other_plans = others.iter().map(pilot).collect::<Result<_, _>>()?;
        let plan_s = began.elapsed().as_secs_f64();
        let march = Watched::new(choose::open_extrapolated(&convert::choice(&ask.on)?, &plan, members)?, ask.on.quiet);
        let path = ask.out.clone().unwrap_or_else(|| PathBuf::from("out").join(&id).join(command));
        let folder = OutputFolder::open(&path, &id, ask.force)?;
        Ok(Self {
            command,
            ask,
            case,
            plan,
            others,
            other_plans,
            march,
            folder,
            began,
            plan_s,
            study_s: 0.0,
            seed: None,
            nominal: None,
            uncertainty: None,
            sensitivity: None,
            estimated: None,
            posterior: None,
            beside: None,
            sizing: None,
            history: None,
            recovery: None,
            failed: None,
        })
    }

    /// Ask, write the report and say what came of it.
    fn answer(mut self, ask: impl FnOnce(&mut Self) -> Result<(), Failure>) -> Result<Ending, Failure> {
        let began = Instant::now();
        ask(&mut self)?;
        self.study_s = began.elapsed().as_secs_f64();
        self.march.done();
        let backend = self.march.backend_now();
        let story = Story {
            case: &self.case,
            others: &self.others,
            command: self.command,
            version: env!("CARGO_PKG_VERSION"),
            backend: &backend,
            seed: self.seed,
            seconds: Seconds {
                plan_s: self.plan_s,
                march_s: self.march.seconds,
                reduce_s: (self.study_s - self.march.seconds).max(0.0),
                began: self.began,
            },
            nominal: self.nominal.as_ref(),
            uncertainty: self.uncertainty.as_ref(),
            sensitivity: self.sensitivity.as_ref(),
            estimated: self.estimated.as_ref(),
            posterior: self.posterior.as_ref(),
            beside: self.beside.as_ref(),
            sizing: self.sizing.as_ref(),
            history: self.history.as_ref(),
            recovery: self.recovery.as_ref(),
        };
        let text = tell(&story, &self.folder, self.ask.json)?;
        let strayed = self.nominal.as_ref().and_then(|nominal| reason(&self.case, &nominal.arrival));
        let unconverged = self.estimated.as_ref().filter(|estimated| !estimated.converged);
        let why = match (strayed, unconverged) {
            (Some(reason), _) => Some(format!("the nominal march did not arrive: {reason}")),
            (None, Some(estimated)) => Some(format!("no convergence: {}", estimated.termination)),
            (None, None) => self.failed,
        };
        Ok(Ending { text, why })
    }

    fn remark(&self, words: &str) {
        if !self.ask.on.quiet {
            eprintln!("{words}");
        }
    }

    fn predict(&mut self) -> Result<(), Failure> {
        self.nominal = Some(nominal(&self.case, &self.plan, &mut self.march)?);
        Ok(())
    }

    fn doubt(&mut self, sweep: &Sweep, keep: Option<Keep>) -> Result<(), Failure> {
        let Some(nominal) = self.nominal.clone() else { return self.predict().and_then(|()| self.doubt(sweep, keep)) };
        let gathered = self.gather(sweep, keep, 0..sweep.members, &nominal)?;
        let outcome = gathered.answer(&nominal, &convert::sampling(sweep), sweep.members);
        self.failed = too_many_failed(&outcome, sweep.max_failed);
        self.seed = Some(sweep.seed);
        self.uncertainty = Some(outcome);
        Ok(())
    }

    /// March some members of a sweep and leave their statistics. There is no report: figures of a part would pass for
    /// those of the whole, and whether too many failed is told of the whole as well.
    fn leave_piece(mut self, sweep: &Sweep, keep: Option<Keep>, members: Range<usize>) -> Result<Ending, Failure> {
        let nominal = nominal(&self.case, &self.plan, &mut self.march)?;
        if let Some(reason) = reason(&self.case, &nominal.arrival) {
            return Err(input(format!("nothing to count members from: the nominal march did not arrive: {reason}")));
        }
        let gathered = self.gather(sweep, keep, members.clone(), &nominal)?;
        self.march.done();
        let path = std::path::absolute(&self.ask.case).unwrap_or(self.ask.case);
        let mark = CaseMark {
            id: self.case.id.clone(),
            path,
            sets: convert::sets(&self.ask.on.sets)?,
            fingerprint: fingerprint(&self.case),
        };
        let draw = Draw {
            members: sweep.members,
            sampling: convert::sampling(sweep).kind.name().to_owned(),
            seed: sweep.seed,
            bounds: sweep.spread.map_or(Bounds::Small, convert::bounds).name().to_owned(),
        };
        let backend = self.march.backend_now();
        let piece = Piece::new(mark, draw, &backend, members.clone(), &nominal, &gathered).write(&self.folder)?;
        let text = format!(
            "members {}..{} of {} drawn, {} of them arrived: {}\n",
            members.start,
            members.end,
            sweep.members,
            gathered.ok(),
            piece.display()
        );
        Ok(Ending { text, why: None })
    }

    /// March some members of a sweep and count them, keeping what is asked for.
    fn gather(
        &mut self,
        sweep: &Sweep,
        keep: Option<Keep>,
        members: Range<usize>,
        nominal: &Nominal,
    ) -> Result<Gathered, Failure> {
        if self.case.factors.is_empty() {
            return Err(input("the case has no factors to vary"));
        }
        if sweep.members < 2 {
            return Err(input(format!("a spread needs at least 2 members, not {}", sweep.members)));
        }
        self.march.expect(members.len());
        let part = if members.len() < sweep.members { Some(&members) } else { None };
        let mut kept = Kept::open(&mut self.folder, &self.case, &self.plan, keep, part)?;
        let bounds = sweep.spread.map_or(Bounds::Small, convert::bounds);
        let ensemble = Ensemble::sample(&self.case.factors, bounds, &convert::sampling(sweep), sweep.members)
            .correlated(&self.case.correlation);
        let kind = convert::sampling(sweep).kind;
        let envelope = Envelope::of(&self.case, &self.plan, nominal, bounds, kind)?;
        let mut gathered = Gathered::new(&self.case, nominal, &envelope, bounds, kind);
        gathered.march(&self.case, &self.plan, &mut self.march, &ensemble, members, &mut |ensemble, traces| {
            kept.take(ensemble, traces);
        })?;
        kept.close()?;
        Ok(gathered)
    }

    fn differentiate(&mut self, method: Option<Method>, step: Option<f64>) -> Result<(), Failure> {
        if self.case.factors.is_empty() {
            return Err(input("the case has no factors to differentiate by"));
        }
        let step = convert::difference(method, step, self.march.precision())?;
        self.sensitivity = Some(sensitivity(&self.case, &self.plan, &mut self.march, step)?);
        Ok(())
    }

    fn fit(&mut self, fit: &Fit, walkers: Option<Walkers>) -> Result<(), Failure> {
        let search = convert::search(fit, self.march.precision())?;
        let others = self.others.iter().zip(&self.other_plans);
        let runs: Vec<(&Case, &Plan)> = std::iter::once((&self.case, &self.plan)).chain(others).collect();
        let found = estimate(&runs, &mut self.march, &search).map_err(|error| match error {
            EstimateError::March(error) => error.into(),
            other => input(other),
        })?;
        if let Some(walkers) = walkers {
            self.march.expect(runs.len() * walkers.number * walkers.moves);
            let outcome = posterior(&runs, &mut self.march, &found, &walkers).map_err(|error| match error {
                PosteriorError::March(error) => error.into(),
                other => input(other),
            })?;
            self.seed = Some(walkers.seed);
            self.posterior = Some(outcome);
        }
        self.estimated = Some(found);
        Ok(())
    }

    fn hold_beside(&mut self, other: &Case, fit: &Fit) -> Result<(), Failure> {
        let search = convert::search(fit, self.march.precision())?;
        let Some(first) = self.estimated.as_ref().and_then(|estimated| estimated.fitted.first()) else {
            return Ok(());
        };
        let outcome = beside((&self.case, first), (other, &pilot(other)?), &mut self.march, &search);
        self.beside = Some(outcome.map_err(|error| match error {
            BesideError::Estimate(EstimateError::March(error)) => error.into(),
            other => input(other),
        })?);
        Ok(())
    }
}

/// Write the report and say it: the screen, or the summary as JSON.
pub(crate) fn tell(story: &Story, folder: &OutputFolder, json: bool) -> Result<String, Failure> {
    let files = report::write(story, folder)?;
    let last = files.last().ok_or_else(|| input("the report wrote no file"))?;
    if json {
        return std::fs::read_to_string(last).map_err(|error| input(format!("reading {last:?} back: {error}")));
    }
    let page = files.iter().find(|path| path.ends_with("report.html")).unwrap_or(last);
    Ok(format!("{}\nreport: {}\n", summary::screen(story).trim_end(), page.display()))
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

/// Cases by their paths, all of whose faults are told; no two of one name, as reports tell them apart by it.
fn all<'a>(paths: impl Iterator<Item = &'a PathBuf>, on: &On) -> Result<Vec<Case>, Failure> {
    let mut cases: Vec<Case> = Vec::new();
    for path in paths {
        let case = load(path, on)?;
        if let Some(twin) = cases.iter().find(|other| other.id == case.id) {
            return Err(input(format!("{}: there is a case {:?} already", path.display(), twin.id)));
        }
        cases.push(case);
    }
    Ok(cases)
}

/// The case, with what `--set` changes.
pub(crate) fn load(path: &Path, on: &On) -> Result<Case, Failure> {
    Ok(Case::load_with(path, &convert::sets(&on.sets)?)?)
}
