//! Questions to a session, and their answers.

use crate::case::Case;
use crate::errors;
use bondline::Ensemble;
use bondline::question::Question;
use bondline::report::files::OutputFolder;
use bondline::session::{BackendOptions, SessionError};
use bondline::traces::{MemberStatus, Peak, Traces};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};
use rayon::prelude::*;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

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

/// The question of a name with these options, for a case.
pub(crate) fn question(case: &Case, name: &str, options: &Bound<'_, PyAny>) -> PyResult<Question> {
    let options: Map<String, Value> = depythonize(options)?;
    let refused = |error| errors::input_error(&error);
    let mut question = Question::from_fields(name, &options).map_err(refused)?;
    let read = |path: &Path| bondline::Case::load(path);
    question.read_cases(read).map_err(|error| errors::case_error(&error))?;
    question.check(case.library_case()).map_err(refused)?;
    Ok(question)
}

/// All options of a question with their values, from those that are given.
#[pyfunction]
pub(crate) fn options_of<'py>(py: Python<'py>, name: &str, options: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let question = Question::from_fields(name, &depythonize(options)?).map_err(|error| errors::input_error(&error))?;
    Ok(pythonize(py, &question.fields())?)
}

/// Answers a question.
pub(crate) fn ask(
    case: &Case,
    py: Python<'_>,
    question: &Question,
    options: BackendOptions,
    keeps_members: bool,
    report: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Answers, Option<Members>)> {
    case.with_session(py, options, report, move |session| {
        let mut members = keeps_members.then(|| Members {
            factors: Vec::new(),
            temperatures_k: Vec::new(),
            peaks: Vec::new(),
            completed: Vec::new(),
            shape: [0, session.case().sensors().len(), session.plan().instants_s().len()],
        });
        let answers = session.ask_with(question, &mut |ensemble, traces| {
            if let Some(members) = &mut members {
                members.append(ensemble, traces);
            }
        });
        let answers = answers.map_err(|error| errors::session_error(&error))?.clone();
        Ok((Answers(answers), members))
    })
}

impl Members {
    fn append(&mut self, ensemble: &Ensemble, traces: &Traces) {
        for member in 0..traces.members() {
            self.factors.extend(ensemble.member(traces.first + member));
            self.completed.push(traces.statuses[member] == MemberStatus::Completed);
            self.shape[0] += 1;
        }
        self.peaks.extend(peaks(traces));
        let mut batch = Traces::empty(traces.first, traces.sensors, traces.instants);
        batch.extend(traces, 0..traces.members());
        self.temperatures_k.extend(temperatures(batch));
    }
}
