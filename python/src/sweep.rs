//! Parts of a sweep, for other processes: each is computed, sent and merged as bytes.

use crate::case::{Case, SessionOptions};
use crate::errors;
use crate::question::{Answers, question};
use bondline::question::Question;
use bondline::session::SweepMerger;
use bondline::session::{CaseIdentity, Piece, fingerprint};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The statistics of some members of a sweep, whose options have the `part`.
#[pyfunction]
#[pyo3(signature = (case, sweep, options, report=None))]
pub(crate) fn sweep_part<'py>(
    case: &Bound<'py, Case>,
    sweep: &Bound<'py, PyAny>,
    options: SessionOptions,
    report: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let py = case.py();
    let Question::Uncertainty(sweep) = question(case.get(), "uncertainty", sweep)? else {
        return Err(PyValueError::new_err("expected a sweep"));
    };
    let text = case.get().with_session(py, options.0, report.as_ref(), move |session| {
        let part = session.uncertainty_part(&sweep, &mut |_, _| {});
        let part = part.map_err(|error| errors::session_error(&error))?;
        let (members, _) = sweep.part().map_err(|error| errors::input_error(&error))?;
        let case = session.case();
        let identity = CaseIdentity {
            id: case.id().to_owned(),
            path: case.input_files().first().map_or_else(PathBuf::new, |file| PathBuf::from(&file.path)),
            sets: Vec::new(),
            fingerprint: fingerprint(case),
        };
        let (sweep, statistics) = (sweep.sweep(), &part.statistics);
        Ok(Piece::new(identity, sweep, &part.backend, part.run, members, &part.nominal, statistics).to_json())
    })?;
    Ok(PyBytes::new(py, text.as_bytes()))
}

/// Checks the options of a question for a case, before any part of it is computed.
#[pyfunction]
pub(crate) fn check(case: &Case, name: &str, options: &Bound<'_, PyAny>) -> PyResult<()> {
    question(case, name, options).map(drop)
}

/// Parts of a sweep that are merged as they come.
#[pyclass(frozen, module = "bondline._bondline")]
pub(crate) struct Merger(Mutex<SweepMerger>);

impl Merger {
    fn open(&self) -> MutexGuard<'_, SweepMerger> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Merger {
    /// Merges parts of a sweep of this case, the first of which is given.
    #[new]
    fn new(py: Python<'_>, case: &Case, part: PyBackedBytes, options: SessionOptions) -> PyResult<Self> {
        case.with_session(py, options.0, None, move |session| {
            let part = piece(&part)?;
            let name = name(&part);
            let merger = SweepMerger::new(session.case(), session.plan(), &name, &part);
            let mut merger = merger.map_err(|error| errors::session_error(&error))?;
            merger.add(&name, part).map_err(|error| errors::session_error(&error))?;
            Ok(Self(Mutex::new(merger)))
        })
    }

    /// Adds a part.
    fn add(&self, py: Python<'_>, part: PyBackedBytes) -> PyResult<()> {
        py.detach(|| {
            let part = piece(&part)?;
            self.open().add(&name(&part), part).map_err(|error| errors::session_error(&error))
        })
    }

    /// Members of the parts so far.
    fn members(&self, py: Python<'_>) -> usize {
        py.detach(|| self.open().members())
    }

    /// The parts as one part.
    fn part<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let text = py.detach(|| self.open().part().map(|part| part.to_json()));
        let text = text.map_err(|error| errors::session_error(&error))?;
        Ok(PyBytes::new(py, text.as_bytes()))
    }

    /// The answers from the parts so far.
    fn answers(&self, py: Python<'_>) -> PyResult<Answers> {
        py.detach(|| {
            let answers = self.open().answers();
            let mut answers = answers.map_err(|error| errors::session_error(&error))?;
            answers.question = "uncertainty";
            Ok(Answers(answers))
        })
    }
}

fn piece(text: &[u8]) -> PyResult<Piece> {
    let text = str::from_utf8(text).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Piece::from_json(text).map_err(|error| errors::BondlineError::new_err(format!("a part of a sweep: {error}")))
}

fn name(part: &Piece) -> String {
    format!("part {}..{}", part.members.start, part.members.end)
}
