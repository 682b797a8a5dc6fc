//! Module `bondline._bondline`: the sessions of the library, and their questions.
//!
//! Keywords are the fields of a question of the library, so that both have the same options, defaults, checks and
//! messages. The package in `python/bondline` gives answers Python types.

mod case;
mod errors;
mod log_parts;
mod question;
mod sweep;
mod work;

use bondline::command;
use bondline::question::Question;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use pythonize::depythonize;

/// Runs the command with these words, the first of which is its name, and returns the exit code.
#[pyfunction]
fn run_command(py: Python<'_>, words: Vec<String>) -> u8 {
    py.detach(|| command::run_words(words.into_iter().map(Into::into)))
}

/// The text of a TOML document with this content.
#[pyfunction]
fn to_toml(content: &Bound<'_, PyAny>) -> PyResult<String> {
    let content: toml::Table = depythonize(content)?;
    toml::to_string(&content).map_err(|error| PyValueError::new_err(error.to_string()))
}

#[pymodule]
fn _bondline(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("QUESTIONS", PyList::new(module.py(), Question::NAMES)?)?;
    module.add_class::<case::Case>()?;
    module.add_class::<question::Answers>()?;
    module.add_class::<sweep::Merger>()?;
    module.add_function(wrap_pyfunction!(question::options_of, module)?)?;
    module.add_function(wrap_pyfunction!(run_command, module)?)?;
    module.add_function(wrap_pyfunction!(to_toml, module)?)?;
    module.add_function(wrap_pyfunction!(log_parts::log_answers, module)?)?;
    module.add_function(wrap_pyfunction!(log_parts::log_part, module)?)?;
    module.add_function(wrap_pyfunction!(log_parts::log_rounds, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep_part, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::check, module)?)?;
    let py = module.py();
    module.add("BondlineError", py.get_type::<errors::BondlineError>())?;
    module.add("CaseError", py.get_type::<errors::CaseError>())?;
    module.add("OptionError", py.get_type::<errors::OptionError>())?;
    module.add("DeviceError", py.get_type::<errors::DeviceError>())?;
    let names = [
        "Answers",
        "Case",
        "Merger",
        "QUESTIONS",
        "check",
        "log_answers",
        "log_part",
        "log_rounds",
        "options_of",
        "run_command",
        "sweep_part",
        "to_toml",
    ];
    module.add("__all__", PyList::new(py, names)?)
}
