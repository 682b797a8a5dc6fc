//! Minimisations of an estimate from many starts and fits of a coverage study, for other processes.

use crate::case::{Case, parse};
use crate::errors;
use crate::question::{Answers, estimate_options};
use bondline::command::args::{Command, convert};
use bondline::session::{EstimateOptions, LogPart, TwinStudyOptions};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

/// A study whose minimisations can be divided between processes.
enum Question {
    Estimate(Box<EstimateOptions>),
    Coverage(Box<TwinStudyOptions>),
}

fn question(command: &str, words: &[String]) -> PyResult<Question> {
    let refused = |failure| errors::failure(&failure);
    match parse(command, words)? {
        Command::Estimate { data, fit, posterior, seed, .. } => {
            estimate_options(&data, &fit, &posterior, seed).map(Box::new).map(Question::Estimate)
        }
        Command::Twin { twin, data, fit, .. } => {
            let data_sets = twin.study.ok_or_else(|| PyValueError::new_err("expected a number of data sets"))?;
            let options = convert::twin_study(&twin, &data, &fit, data_sets).map_err(refused)?;
            Ok(Question::Coverage(Box::new(options)))
        }
        _ => Err(PyValueError::new_err("the minimisations of this command cannot be divided")),
    }
}

/// Checks the options of a study for a case, and returns the first and the end of its minimisations. There are two
/// ranges for an estimate with priors, the second of which depends on all of the first.
#[pyfunction]
pub(crate) fn log_rounds(case: &Case, command: &str, words: Vec<String>) -> PyResult<Vec<(usize, usize)>> {
    let failed = |error| errors::session_error(&error);
    match question(command, &words)? {
        Question::Estimate(options) => {
            let rounds = options.rounds(case.library_case()).map_err(failed)?;
            Ok(rounds.into_iter().map(|round| (round.start, round.end)).collect())
        }
        Question::Coverage(options) => {
            options.check(case.library_case()).map_err(failed)?;
            Ok(vec![(0, options.data_sets)])
        }
    }
}

/// Minimisations `first` to `end` − 1 of a study. `earlier` has those of the rounds before.
#[pyfunction]
#[pyo3(signature = (case, command, words, first, end, earlier, options, report=None))]
#[expect(clippy::too_many_arguments, reason = "the arguments of a function of Python")]
pub(crate) fn log_part<'py>(
    case: &Bound<'py, Case>,
    command: &str,
    words: Vec<String>,
    first: usize,
    end: usize,
    earlier: Vec<PyBackedBytes>,
    options: Vec<String>,
    report: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let (py, question) = (case.py(), question(command, &words)?);
    let text = case.get().with_session(py, &options, report.as_ref(), move |session| {
        let part = match question {
            Question::Estimate(options) => session.estimate_part(&options, first..end, &parts(&earlier)?),
            Question::Coverage(options) => session.twin_study_part(&options, first..end),
        };
        part.map(|part| part.to_json()).map_err(|error| errors::session_error(&error))
    })?;
    Ok(PyBytes::new(py, text.as_bytes()))
}

/// The answers of a study whose minimisations are in these parts.
#[pyfunction]
#[pyo3(signature = (case, command, words, parts, options, report=None))]
pub(crate) fn log_answers(
    case: &Bound<'_, Case>,
    command: &str,
    words: Vec<String>,
    parts: Vec<PyBackedBytes>,
    options: Vec<String>,
    report: Option<Bound<'_, PyAny>>,
) -> PyResult<Answers> {
    let question = question(command, &words)?;
    case.get().with_session(case.py(), &options, report.as_ref(), move |session| {
        let parts = self::parts(&parts)?;
        let found = match question {
            Question::Estimate(options) => session.estimate_from(&options, &parts).map(drop),
            Question::Coverage(options) => session.twin_study_from(&options, &parts).map(drop),
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
