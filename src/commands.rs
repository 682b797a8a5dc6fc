//! What each command does: a study, a report, an ending.

use crate::asked;
use crate::cli::{Ask, Cli, Command, Keep, Materials, On, Sweep};
use crate::ending::{Ending, Failure, input};
use crate::kept::Kept;
use crate::watch::Watched;
use bondline::case::{Bounds, Case};
use bondline::ensemble::Ensemble;
use bondline::fit::Options;
use bondline::march::{Precision, choose};
use bondline::plan::Plan;
use bondline::report::files::OutputFolder;
use bondline::report::files::piece::{CaseMark, Draw, Piece, fingerprint};
use bondline::report::{self, Seconds, Story, materials, summary};
use bondline::study::beside::{Beside, BesideError, beside};
use bondline::study::estimate::{EstimateError, Estimated, estimate, options};
use bondline::study::nominal::{Nominal, nominal};
use bondline::study::sensitivity::{Sensitivity, difference_step, sensitivity};
use bondline::study::twin::{TwinError, twin};
use bondline::study::uncertainty::{Gathered, Uncertainty, reason};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Carry out what was typed.
pub(crate) fn run(cli: Cli) -> Result<Ending, Failure> {
    match cli.command {
        Command::Devices { json } => crate::devices::print(json),
        Command::Materials { look } => look_up(look),
        Command::Verify { json, group, on } => crate::verification::print(json, group.as_deref(), &on),
        Command::Twin { case, truth, noise, seed, out, force, on } => {
            make_twin(&case, &truth, &noise, seed, &out, force, &on)
        }
        Command::Predict(ask) => Desk::open("predict", ask, 1, |_| Ok(()))?.answer(|desk| {
            desk.predict()?;
            Ok(())
        }),
        Command::Uncertainty { ask, sweep, keep, piece: None } => {
            Desk::open("uncertainty", ask, sweep.members, |_| Ok(()))?.answer(|desk| {
                desk.predict()?;
                desk.doubt(&sweep, keep)
            })
        }
        Command::Uncertainty { ask, sweep, keep, piece: Some(piece) } => {
            let members = asked::piece(&piece, sweep.members)?;
            // What `auto` takes is told by the whole sweep, or pieces of several sizes would be marched on several backends.
            Desk::open("uncertainty", ask, sweep.members, |_| Ok(()))?.leave_piece(&sweep, keep, members)
        }
        Command::Merge(merge) => crate::merge::merge(&merge),
        Command::Sensitivity { ask, data, step, method: _ } => {
            Desk::open("sensitivity", ask, 16, |case| asked::trust(case, &data))?.answer(|desk| {
                desk.predict()?;
                desk.differentiate(step)
            })
        }
        Command::Estimate { ask, data, fit, beside } => {
            let prepare = |case: &mut Case| asked::trust(case, &data).and_then(|()| asked::fit(case, &fit));
            let mut other = beside.map(|path| load(&path, &ask.on)).transpose()?;
            other.as_mut().map_or(Ok(()), prepare)?;
            Desk::open("estimate", ask, 16, prepare)?.answer(|desk| {
                desk.fit(fit.patience)?;
                other.map_or(Ok(()), |other| desk.hold_beside(&other, fit.patience))
            })
        }
        Command::Study { ask, sweep, data, fit } => {
            let prepare = |case: &mut Case| asked::trust(case, &data).and_then(|()| asked::fit(case, &fit));
            Desk::open("study", ask, sweep.members, prepare)?.answer(|desk| {
                desk.predict()?;
                desk.doubt(&sweep, None)?;
                desk.differentiate(None)?;
                if desk.case.observations.is_empty() {
                    desk.remark("no estimation: the case has no observations");
                    return Ok(());
                }
                if desk.case.estimate.factors.is_empty() {
                    desk.remark("no estimation: the case names no factors to estimate; give --factors");
                    return Ok(());
                }
                desk.fit(fit.patience)
            })
        }
    }
}

/// A question on the desk: the case, what marches it, and the answers so far.
struct Desk {
    command: &'static str,
    ask: Ask,
    case: Case,
    plan: Plan,
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
    beside: Option<Beside>,
    /// Failed members beyond what is put up with.
    failed: Option<String>,
}

impl Desk {
    fn open(
        command: &'static str,
        ask: Ask,
        members: usize,
        prepare: impl FnOnce(&mut Case) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        let began = Instant::now();
        let mut case = load(&ask.case, &ask.on)?;
        prepare(&mut case)?;
        let plan = Plan::new(&case);
        let plan_s = began.elapsed().as_secs_f64();
        let march = Watched::new(choose::open(&asked::choice(&ask.on), &plan, members)?, ask.on.quiet);
        let path = ask.out.clone().unwrap_or_else(|| PathBuf::from("out").join(&case.id).join(command));
        let folder = OutputFolder::open(&path, &case.id, ask.force)?;
        Ok(Self {
            command,
            ask,
            case,
            plan,
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
            beside: None,
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
            beside: self.beside.as_ref(),
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
        let outcome = gathered.answer(&nominal, &asked::sampling(sweep), sweep.members);
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
            sets: asked::sets(&self.ask.on.sets)?,
            fingerprint: fingerprint(&self.case),
        };
        let draw = Draw {
            members: sweep.members,
            sampling: asked::sampling(sweep).kind.name().to_owned(),
            seed: sweep.seed,
            bounds: sweep.spread.map_or(Bounds::Small, asked::bounds).name().to_owned(),
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
        let bounds = sweep.spread.map_or(Bounds::Small, asked::bounds);
        let ensemble = Ensemble::sample(&self.case.factors, bounds, &asked::sampling(sweep), sweep.members);
        let mut gathered = Gathered::new(&self.case, nominal, bounds);
        gathered.march(&self.case, &self.plan, &mut self.march, &ensemble, members, &mut |ensemble, traces| {
            kept.take(ensemble, traces);
        })?;
        kept.close()?;
        Ok(gathered)
    }

    fn differentiate(&mut self, step: Option<f64>) -> Result<(), Failure> {
        if self.case.factors.is_empty() {
            return Err(input("the case has no factors to differentiate by"));
        }
        let step = step.unwrap_or_else(|| difference_step(self.march.precision()));
        if !(1e-9..=0.2).contains(&step) {
            return Err(input(format!("--step {step}: expected a relative step from 1e-9 to 0.2")));
        }
        self.sensitivity = Some(sensitivity(&self.case, &self.plan, &mut self.march, step)?);
        Ok(())
    }

    fn fit(&mut self, patience: usize) -> Result<(), Failure> {
        let options = Options { patience, ..options(self.march.precision()) };
        let outcome = estimate(&self.case, &self.plan, &mut self.march, &options);
        self.estimated = Some(outcome.map_err(|error| match error {
            EstimateError::March(error) => error.into(),
            other => input(other),
        })?);
        Ok(())
    }

    fn hold_beside(&mut self, other: &Case, patience: usize) -> Result<(), Failure> {
        let options = Options { patience, ..options(self.march.precision()) };
        let Some(first) = &self.estimated else { return Ok(()) };
        let outcome = beside((&self.case, first), other, &mut self.march, &options);
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

/// The case, with what `--set` changes.
fn load(path: &Path, on: &On) -> Result<Case, Failure> {
    Ok(Case::load_with(path, &asked::sets(&on.sets)?)?)
}

fn look_up(look: Materials) -> Result<Ending, Failure> {
    use bondline::case::Material;
    let text = match look {
        Materials::List => materials::list()?,
        Materials::Show { name } => materials::show(&Material::named(&name)?),
        Materials::Check { file } => materials::check(&file)?,
    };
    Ok(Ending { text, why: None })
}

fn make_twin(
    path: &Path,
    truth: &[String],
    noise: &str,
    seed: u64,
    out: &Path,
    force: bool,
    on: &On,
) -> Result<Ending, Failure> {
    let case = load(path, on)?;
    let mut row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
    for (factor, value) in asked::values(&case, truth, "--truth")? {
        row[factor] = value;
    }
    let noise_k = asked::noise_k(noise)?;
    if out.exists() && !force {
        return Err(input(format!("{} exists already; give --force to overwrite it", out.display())));
    }
    let plan = Plan::new(&case);
    let mut choice = asked::choice(on);
    choice.precision = choice.precision.or(Some(Precision::F64));
    let mut march = Watched::new(choose::open(&choice, &plan, 1)?, on.quiet);
    let made = twin(&case, &plan, &mut march, row, noise_k, seed).map_err(|error| match error {
        TwinError::March(error) => error.into(),
        other => input(other),
    })?;
    march.done();
    report::files::measured(out, &case, &made)?;
    let text = format!(
        "{} samples of {} sensors, noise {noise_k} K, seed {seed}: {}\n",
        made.instants_s.len(),
        case.sensors.len(),
        out.display()
    );
    Ok(Ending { text, why: None })
}
