//! What each command does: a study, a report, an ending.

use crate::asked;
use crate::cli::{Ask, Cli, Command, Keep, Materials, On};
use crate::ending::{Ending, Failure, input};
use crate::watch::Watched;
use bondline::case::{Bounds, Case};
use bondline::fit::Options;
use bondline::march::{Precision, choose};
use bondline::plan::Plan;
use bondline::report::files::{MembersFile, OutputFolder, Row, TracesFile};
use bondline::report::{self, Seconds, Story, materials, summary};
use bondline::study::beside::{Beside, BesideError, beside};
use bondline::study::estimate::{EstimateError, Estimated, estimate, options};
use bondline::study::nominal::{Nominal, Peak, nominal};
use bondline::study::sensitivity::{Sensitivity, difference_step, sensitivity};
use bondline::study::twin::{TwinError, twin};
use bondline::study::uncertainty::{Uncertainty, reason, uncertainty};
use bondline::traces::Arrival;
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
        Command::Uncertainty { ask, sweep, keep } => {
            Desk::open("uncertainty", ask, sweep.members, |_| Ok(()))?.answer(|desk| {
                desk.predict()?;
                desk.doubt(&sweep, keep)
            })
        }
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
        let files = report::write(&story, &self.folder)?;
        let last = files.last().ok_or_else(|| input("the report wrote no file"))?;
        let text = if self.ask.json {
            std::fs::read_to_string(last).map_err(|error| input(format!("reading {last:?} back: {error}")))?
        } else {
            let page = files.iter().find(|path| path.ends_with("report.html")).unwrap_or(last);
            format!("{}\nreport: {}\n", summary::screen(&story).trim_end(), page.display())
        };
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

    fn doubt(&mut self, sweep: &crate::cli::Sweep, keep: Option<Keep>) -> Result<(), Failure> {
        let Some(nominal) = &self.nominal else { return self.predict().and_then(|()| self.doubt(sweep, keep)) };
        if self.case.factors.is_empty() {
            return Err(input("the case has no factors to vary"));
        }
        if sweep.members < 2 {
            return Err(input(format!("a spread needs at least 2 members, not {}", sweep.members)));
        }
        self.march.expect(sweep.members);
        let names: Vec<&str> = self.case.factors.iter().map(|factor| factor.name.as_str()).collect();
        let sensors: Vec<&str> = self.case.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
        let mut kept_members = match keep {
            Some(_) => Some(MembersFile::create(&self.folder.claim("members.parquet")?, &names, &sensors)?),
            None => None,
        };
        let mut kept_traces = match keep {
            Some(Keep::Traces) => {
                let path = self.folder.claim("traces.parquet")?;
                Some(TracesFile::create(&path, &sensors, &self.plan.instants_s)?)
            }
            _ => None,
        };
        let mut trouble = Ok(());
        let instants_s = self.plan.instants_s.clone();
        let bounds = sweep.spread.map_or(Bounds::Small, asked::bounds);
        let outcome = uncertainty(
            &self.case,
            &self.plan,
            &mut self.march,
            nominal,
            bounds,
            &asked::sampling(sweep),
            sweep.members,
            &mut |ensemble, traces| {
                if let (Some(file), Ok(())) = (&mut kept_members, &trouble) {
                    trouble = (0..traces.members()).try_for_each(|member| {
                        let peak = |sensor| Peak::of(traces.trace(member, sensor), &instants_s);
                        file.append(&Row {
                            member: traces.first + member,
                            arrived: traces.arrivals[member] == Arrival::Done,
                            factors: &ensemble.member(traces.first + member),
                            peaks: &(0..traces.sensors).map(peak).collect::<Vec<Peak>>(),
                        })
                    });
                }
                if let (Some(file), Ok(())) = (&mut kept_traces, &trouble) {
                    trouble = file.append(traces);
                }
            },
        )?;
        trouble?;
        if let Some(file) = kept_members {
            file.close()?;
        }
        if let Some(file) = kept_traces {
            file.close()?;
        }
        let failed = outcome.asked - outcome.ok;
        let most = sweep.max_failed.unwrap_or(sweep.members / 100);
        if failed > most {
            let reasons: Vec<String> =
                outcome.failures.iter().map(|failure| format!("{}: {}", failure.members, failure.reason)).collect();
            self.failed =
                Some(format!("{failed} members failed, more than the {most} put up with ({})", reasons.join("; ")));
        }
        self.seed = Some(sweep.seed);
        self.uncertainty = Some(outcome);
        Ok(())
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
