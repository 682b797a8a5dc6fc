//! Parts of a sweep, for other processes: each is computed, sent and merged as bytes.

use crate::case::{Case, parse};
use crate::errors;
use crate::question::Answers;
use bondline::command::args::{Command, convert};
use bondline::session::{SweepMerger, UncertaintyOptions};
use bondline::study::sweep_piece::{CaseIdentity, Piece, SamplingRecord, fingerprint};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The statistics of members `first` to `end` − 1 of a sweep, whose options are words of its command.
#[pyfunction]
#[pyo3(signature = (case, words, first, end, options, report=None))]
pub(crate) fn sweep_part<'py>(
    case: &Bound<'py, Case>,
    words: Vec<String>,
    first: usize,
    end: usize,
    options: Vec<String>,
    report: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let py = case.py();
    let draw = sweep_options(&words)?;
    let text = case.get().with_session(py, &options, report.as_ref(), move |session| {
        let part = session.uncertainty_part(&draw, first..end, &mut |_, _| {});
        let part = part.map_err(|error| errors::session_error(&error))?;
        let case = session.case();
        let identity = CaseIdentity {
            id: case.id().to_owned(),
            path: case.input_files().first().map_or_else(PathBuf::new, |file| PathBuf::from(&file.path)),
            sets: Vec::new(),
            fingerprint: fingerprint(case),
        };
        let (sampling, statistics) = (SamplingRecord::from(&draw), &part.statistics);
        let piece = Piece::new(identity, sampling, &part.backend, part.run, first..end, &part.nominal, statistics);
        Ok(piece.to_json())
    })?;
    Ok(PyBytes::new(py, text.as_bytes()))
}

/// Checks the options of a sweep for a case, before any part of it is computed.
#[pyfunction]
pub(crate) fn check_sweep(case: &Case, words: Vec<String>) -> PyResult<()> {
    sweep_options(&words)?.check(case.library_case()).map_err(|error| errors::session_error(&error))
}

fn sweep_options(words: &[String]) -> PyResult<UncertaintyOptions> {
    match parse("uncertainty", words)? {
        Command::Uncertainty { sweep, .. } => Ok(convert::sweep(&sweep)),
        _ => Err(PyValueError::new_err("the words are of another command")),
    }
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
    fn new(py: Python<'_>, case: &Case, part: PyBackedBytes, options: Vec<String>) -> PyResult<Self> {
        case.with_session(py, &options, None, move |session| {
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
