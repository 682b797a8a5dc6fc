//! Minimisations of an estimate from many starts and fits of a coverage study, for other processes.

use crate::case::{Case, SessionOptions};
use crate::errors;
use crate::question::{Answers, question};
use bondline::question::Question;
use bondline::session::LogPart;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

fn undivided() -> PyErr {
    PyValueError::new_err("the minimisations of this question cannot be divided")
}

/// Checks the options of a study for a case, and returns the first and the end of its minimisations. There are two
/// ranges for an estimate with priors, the second of which depends on all of the first.
#[pyfunction]
pub(crate) fn log_rounds(case: &Case, name: &str, asked: &Bound<'_, PyAny>) -> PyResult<Vec<(usize, usize)>> {
    match question(case, name, asked)? {
        Question::Estimate(estimate) => {
            let rounds = estimate.rounds(case.library_case()).map_err(|error| errors::input_error(&error))?;
            Ok(rounds.into_iter().map(|round| (round.start, round.end)).collect())
        }
        Question::Twin(twin) => Ok(vec![(0, twin.data_sets.unwrap_or(0))]),
        _ => Err(undivided()),
    }
}

/// Minimisations `first` to `end` − 1 of a study. `earlier` has those of the rounds before.
#[pyfunction]
#[pyo3(signature = (case, name, asked, first, end, earlier, options, report=None))]
#[expect(clippy::too_many_arguments, reason = "the arguments of a function of Python")]
pub(crate) fn log_part<'py>(
    case: &Bound<'py, Case>,
    name: &str,
    asked: &Bound<'py, PyAny>,
    first: usize,
    end: usize,
    earlier: Vec<PyBackedBytes>,
    options: SessionOptions,
    report: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (py, question) = (case.py(), question(case.get(), name, asked)?);
    let text = case.get().with_session(py, options.0, report.as_ref(), move |session| {
        let part = match question {
            Question::Estimate(estimate) => session.estimate_part(&estimate, first..end, &parts(&earlier)?),
            Question::Twin(twin) => session.twin_study_part(&twin, first..end),
            _ => return Err(undivided()),
        };
        part.map(|part| part.to_json()).map_err(|error| errors::session_error(&error))
    })?;
    Ok(PyBytes::new(py, text.as_bytes()))
}

/// The answers of a study whose minimisations are in these parts.
#[pyfunction]
#[pyo3(signature = (case, name, asked, parts, options, report=None))]
pub(crate) fn log_answers(
    case: &Bound<'_, Case>,
    name: &str,
    asked: &Bound<'_, PyAny>,
    parts: Vec<PyBackedBytes>,
    options: SessionOptions,
    report: Option<Bound<'_, PyAny>>,
) -> PyResult<Answers> {
    let question = question(case.get(), name, asked)?;
    case.get().with_session(case.py(), options.0, report.as_ref(), move |session| {
        let parts = self::parts(&parts)?;
        let found = match question {
            Question::Estimate(estimate) => session.estimate_from(&estimate, &parts).map(drop),
            Question::Twin(twin) => session.twin_study_from(&twin, &parts).map(drop),
            _ => return Err(undivided()),
        };
        found.map_err(|error| errors::session_error(&error))?;
        let answers = session.answers().cloned();
        answers.map(Answers).ok_or_else(|| PyValueError::new_err("the study has no answers"))
    })
}

fn parts(texts: &[PyBackedBytes]) -> PyResult<Vec<LogPart>> {
    let part = |text: &PyBackedBytes| {
        let text = str::from_utf8(text).map_err(|error| PyValueError::new_err(error.to_string()))?;
        LogPart::from_json(text).map_err(|error| errors::BondlineError::new_err(format!("a part of a study: {error}")))
    };
    texts.iter().map(part).collect()
}
