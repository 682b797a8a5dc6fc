//! Errors of a question: an option is wrong, or the case lacks what it needs.

use crate::case::CaseError;
use crate::limits::Limit;
use std::borrow::Cow;
use std::fmt;

/// An error of an option or of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputError {
    /// The option at fault; `None` if it is not a single one.
    pub option: Option<Cow<'static, str>>,
    /// The rest of the sentence: `: no sensor is called "TC9"; there are TC1, TC2`.
    pub message: String,
}

impl InputError {
    /// An error of no single option.
    pub(crate) fn general(message: impl ToString) -> Self {
        Self { option: None, message: message.to_string() }
    }

    /// An error of an option. The message follows the name of the option directly.
    pub(crate) fn for_option(option: impl Into<Cow<'static, str>>, message: impl ToString) -> Self {
        Self { option: Some(option.into()), message: message.to_string() }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}{}", self.option.as_deref().unwrap_or_default(), self.message)
    }
}

impl std::error::Error for InputError {}

impl From<CaseError> for InputError {
    fn from(error: CaseError) -> Self {
        Self::general(error)
    }
}

/// Refuse a number of an option above its limit.
pub(crate) fn check_limit(limit: &Limit, found: f64, option: &'static str) -> Result<(), InputError> {
    limit.check(found).map_err(|message| InputError::for_option(option, format!(": {message}")))
}

/// The index of `name` in `names`; an error lists them.
pub(crate) fn index_of<'a>(
    names: impl Iterator<Item = &'a str>,
    name: &str,
    option: &'static str,
    noun: &str,
) -> Result<usize, InputError> {
    let names: Vec<&str> = names.collect();
    let index = names.iter().position(|other| *other == name);
    index.ok_or_else(|| {
        let all = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        InputError::for_option(option, format!(": no {noun} is called {name:?}; there are {all}"))
    })
}

pub(crate) fn is_positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// A number that is zero or positive, in its unit.
pub(crate) fn check_nonnegative(option: &'static str, value: f64, unit: &str) -> Result<(), InputError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(InputError::for_option(option, format!(" {value} {unit}: expected no less than 0 {unit}")))
}
