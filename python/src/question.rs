//! Questions to a session, and their answers.

use crate::case::{Case, parse};
use crate::errors;
use bondline::Session;
use bondline::command::args::{Command, FitArgs, ObservationArgs, PosteriorArgs, convert};
use bondline::command::run::load_all;
use bondline::report::files::OutputFolder;
use bondline::session::{EstimateOptions, SessionError, StudyOptions};
use bondline::traces::{MemberStatus, Peak, Traces};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pythonize::pythonize;
use rayon::prelude::*;
use std::path::PathBuf;

/// The answers of a question.
#[pyclass(frozen, module = "bondline._bondline")]
pub(crate) struct Answers(pub(crate) bondline::session::Answers);

#[pymethods]
impl Answers {
    /// All numbers.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.0)?)
    }

    /// The text that the command prints.
    fn summary(&self) -> String {
        self.0.summary()
    }

    /// Writes the report into a folder, and returns the paths of its files.
    fn report(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<Vec<PathBuf>> {
        let id = self.0.case.id();
        let written = py.detach(|| {
            let folder = OutputFolder::open(&folder, id, force)?;
            self.0.report(&folder)
        });
        written.map_err(|error: SessionError| errors::session_error(&error))
    }
}

/// The members of a sweep: factors (member × factor), temperatures in K (member × sensor × instant), peaks (member ×
/// sensor × temperature in K and time in s), and whether each has completed.
pub(crate) struct Members {
    factors: Vec<f64>,
    temperatures_k: Vec<f64>,
    peaks: Vec<f64>,
    completed: Vec<bool>,
    shape: [usize; 3],
}

impl<'py> IntoPyObject<'py> for Members {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        let [members, sensors, instants] = self.shape;
        let width = self.factors.len() / members.max(1);
        let factors: Bound<'py, PyArray2<f64>> = self.factors.into_pyarray(py).reshape([members, width])?;
        let temperatures: Bound<'py, PyArray3<f64>> =
            self.temperatures_k.into_pyarray(py).reshape([members, sensors, instants])?;
        let peaks: Bound<'py, PyArray3<f64>> = self.peaks.into_pyarray(py).reshape([members, sensors, 2])?;
        let completed = self.completed.into_pyarray(py);
        Ok((factors, temperatures, peaks, completed).into_pyobject(py)?.into_any())
    }
}

/// The temperatures of marches, with NaN for members that failed.
pub(crate) fn temperatures(mut traces: Traces) -> Vec<f64> {
    let width = traces.sensors * traces.instants;
    for (member, status) in traces.statuses.iter().enumerate() {
        if *status != MemberStatus::Completed {
            traces.temperatures_k[member * width..(member + 1) * width].fill(f64::NAN);
        }
    }
    traces.temperatures_k
}

/// The peaks of marches: member × sensor × temperature, K, and time, s; NaN for members that failed.
pub(crate) fn peaks(traces: &Traces) -> impl Iterator<Item = f64> + '_ {
    let of_member = |member: usize| {
        let is_completed = traces.statuses[member] == MemberStatus::Completed;
        let both = move |peak: &Peak| if is_completed { [peak.temperature_k, peak.time_s] } else { [f64::NAN; 2] };
        traces.member_peaks(member).iter().flat_map(both)
    };
    (0..traces.members()).flat_map(of_member)
}

/// Copies the temperatures of marches, with NaN for members that failed.
pub(crate) fn copy_temperatures(traces: &Traces, temperatures_k: &mut [f64]) {
    let width = (traces.sensors * traces.instants).max(1);
    let members = temperatures_k.par_chunks_mut(width).zip(traces.temperatures_k.par_chunks(width));
    members.zip(&traces.statuses).for_each(|((copy, temperatures_k), status)| match status {
        MemberStatus::Completed => copy.copy_from_slice(temperatures_k),
        _ => copy.fill(f64::NAN),
    });
}

/// Answers a question with the options of its command.
pub(crate) fn ask(
    case: &Case,
    py: Python<'_>,
    command: &str,
    words: &[String],
    options: &[String],
    keeps_members: bool,
    report: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Answers, Option<Members>)> {
    let question = parse(command, words)?;
    case.with_session(py, options, report, move |session| {
        let mut members = keeps_members.then(|| Members {
            factors: Vec::new(),
            temperatures_k: Vec::new(),
            peaks: Vec::new(),
            completed: Vec::new(),
            shape: [0, session.case().sensors().len(), session.plan().instants_s().len()],
        });
        answer(session, &question, members.as_mut())?;
        let answers = session.answers().cloned();
        let answers = answers.ok_or_else(|| PyValueError::new_err("the question has no answers"))?;
        Ok((Answers(answers), members))
    })
}

/// The options of an estimate of one case.
pub(crate) fn estimate_options(
    data: &ObservationArgs,
    fit: &FitArgs,
    posterior: &PosteriorArgs,
    seed: u64,
) -> PyResult<EstimateOptions> {
    let refused = |failure| errors::failure(&failure);
    Ok(EstimateOptions {
        observations: convert::observations(data).map_err(refused)?,
        fit: convert::fit(fit).map_err(refused)?,
        posterior: convert::walkers(posterior, seed),
        ..EstimateOptions::default()
    })
}

fn answer(session: &mut Session, question: &Command, members: Option<&mut Members>) -> PyResult<()> {
    let refused = |failure| errors::failure(&failure);
    let failed = |error| errors::session_error(&error);
    match question {
        Command::Predict { .. } => session.predict().map(drop).map_err(failed),
        Command::Uncertainty { sweep, until: Some(target), .. } => {
            let options = convert::sweep(sweep);
            let target = convert::precision_target(target, session.case()).map_err(refused)?;
            session.uncertainty_until(&options, &target, &mut |_, _| {}).map(drop).map_err(failed)
        }
        Command::Uncertainty { sweep, .. } => {
            let options = convert::sweep(sweep);
            let Some(members) = members else { return session.uncertainty(&options).map(drop).map_err(failed) };
            let swept = session.uncertainty_with(&options, &mut |ensemble, traces| {
                for member in 0..traces.members() {
                    members.factors.extend(ensemble.member(traces.first + member));
                    members.completed.push(traces.statuses[member] == MemberStatus::Completed);
                    members.shape[0] += 1;
                }
                members.peaks.extend(peaks(traces));
                let mut batch = Traces::empty(traces.first, traces.sensors, traces.instants);
                batch.extend(traces, 0..traces.members());
                members.temperatures_k.extend(temperatures(batch));
            });
            swept.map(drop).map_err(failed)
        }
        Command::Sensitivity { data, step, method, .. } => {
            let options = convert::sensitivity(data, *method, *step).map_err(refused)?;
            session.sensitivity(&options).map(drop).map_err(failed)
        }
        Command::Estimate { data, fit, posterior, seed, .. } => {
            let options = estimate_options(data, fit, posterior, *seed)?;
            session.estimate(&options).map(drop).map_err(failed)
        }
        Command::Study { sweep, data, fit, posterior, .. } => {
            let options = StudyOptions {
                sweep: convert::sweep(sweep),
                observations: convert::observations(data).map_err(refused)?,
                fit: convert::fit(fit).map_err(refused)?,
                posterior: convert::walkers(posterior, sweep.seed),
            };
            session.study(&options).map(drop).map_err(failed)
        }
        Command::Size { size, sweep, .. } => {
            let options = convert::size(size, sweep, session.case()).map_err(refused)?;
            session.size(&options).map(drop).map_err(failed)
        }
        Command::Trade { case, exposures, trade, sweep, .. } => {
            let exposures = load_all(exposures.iter(), &case.march).map_err(refused)?;
            let options = convert::trade(trade, sweep, session.case(), exposures).map_err(refused)?;
            session.trade(&options).map(drop).map_err(failed)
        }
        Command::Design { design, .. } => {
            let options = convert::design(design, Vec::new()).map_err(refused)?;
            session.design(&options).map(drop).map_err(failed)
        }
        Command::History { data, history, .. } => {
            let options = convert::history(data, history).map_err(refused)?;
            session.history(&options).map(drop).map_err(failed)
        }
        Command::Observations(_) => session.observations().map(drop).map_err(failed),
        Command::Twin { twin, data, fit, .. } => {
            let data_sets = twin.study.ok_or_else(|| PyValueError::new_err("expected a number of data sets"))?;
            let options = convert::twin_study(twin, data, fit, data_sets).map_err(refused)?;
            session.twin_study(&options).map(drop).map_err(failed)
        }
        _ => Err(PyValueError::new_err("this command is no question to a case")),
    }
}
