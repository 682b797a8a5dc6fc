//! Exceptions.

use bondline::question::InputError;
use bondline::session::SessionError;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;

create_exception!(bondline, BondlineError, PyException, "Base class of the exceptions of bondline.");
create_exception!(bondline, CaseError, BondlineError, "A case has errors; the message has one line for each of them.");
create_exception!(bondline, OptionError, BondlineError, "An option is wrong, or the case lacks what it needs.");
create_exception!(bondline, DeviceError, BondlineError, "A device failed.");

/// The exception of a case that cannot be read.
pub(crate) fn case_error(error: &bondline::case::CaseError) -> PyErr {
    CaseError::new_err(error.to_string())
}

/// The exception of a question.
pub(crate) fn session_error(error: &SessionError) -> PyErr {
    match error {
        SessionError::Input(error) => input_error(error),
        SessionError::March(error) => DeviceError::new_err(error.to_string()),
        SessionError::Cancelled => PyKeyboardInterrupt::new_err("cancelled"),
        other => BondlineError::new_err(other.to_string()),
    }
}

/// The exception of an option, with the keyword of the method in place of the name of the option.
pub(crate) fn input_error(error: &InputError) -> PyErr {
    let keyword = match error.option.as_deref() {
        Some("members" | "study") => "n",
        option => option.unwrap_or_default(),
    };
    OptionError::new_err(format!("{keyword}{}", error.message))
}
