//! Shared validation rules, and field paths under which their errors are recorded.
//!
//! A rule takes a value and returns the value or an error message. The file reader reports the message at the line of
//! the value, [`CaseBuilder::build`](super::CaseBuilder::build) under the path of the field.

use super::error::{Diagnostics, SourceLocation};
use super::unit::Dimension;
use crate::limits::NAME_BYTES;
use std::fmt::Display;

/// Errors recorded per list of numbers: more would not help the reader.
const MAX_ERRORS_PER_LIST: usize = 10;

/// A number that is neither infinite nor NaN. `shown` is its text in the message.
pub(super) fn finite(value: f64, shown: impl Display) -> Result<f64, String> {
    if value.is_finite() { Ok(value) } else { Err(format!("expected a finite number, found {shown}")) }
}

/// A number as text, with an exponent where it would have many digits.
pub(super) fn readable(value: f64) -> String {
    let is_short = value == 0.0 || (1e-4..1e10).contains(&value.abs());
    if is_short { value.to_string() } else { format!("{value:e}") }
}

/// A finite number above zero.
pub(super) fn positive(value: f64, shown: impl Display) -> Result<f64, String> {
    if finite(value, &shown)? > 0.0 { Ok(value) } else { Err(format!("expected a value above 0, found {shown}")) }
}

/// A finite number of at least zero.
pub(super) fn not_negative(value: f64, shown: impl Display) -> Result<f64, String> {
    if finite(value, &shown)? >= 0.0 { Ok(value) } else { Err(format!("expected 0 or more, found {shown}")) }
}

/// A temperature that a point of the layup may have, K.
pub(super) fn checked_layup_temperature_k(temperature_k: f64) -> Result<f64, String> {
    positive(temperature_k, format_args!("a temperature of {temperature_k} K"))?;
    if Dimension::LayupTemperature.is_allowed(temperature_k) {
        return Ok(temperature_k);
    }
    let (found, violation) = (readable(temperature_k), Dimension::LayupTemperature.violation(temperature_k));
    Err(format!("{found} K is {violation}"))
}

/// Text that is neither empty nor white space.
pub(super) fn not_blank(text: &str) -> Result<&str, String> {
    if text.trim().is_empty() { Err("expected text, found none".to_owned()) } else { Ok(text) }
}

/// Text of one line, such as a title: a line feed would print a line that looks like one of the program.
pub(super) fn one_line(text: &str) -> Result<&str, String> {
    if not_blank(text)?.contains(char::is_control) {
        return Err(format!("expected one line without control characters, found {text:?}"));
    }
    Ok(text)
}

/// A name that the user chooses, which tables have in cells and headings.
pub(super) fn checked_name(text: &str) -> Result<&str, String> {
    if one_line(text)?.trim_start().starts_with(['=', '+', '-', '@']) {
        return Err(format!(
            "expected a name that no spreadsheet takes for a formula, without {:?} at its start, \
             found {text:?}",
            &text.trim_start()[..1]
        ));
    }
    NAME_BYTES.check(text.len() as f64).map(|()| text)
}

/// An index into a list of `count` items.
pub(super) fn checked_index(index: usize, count: usize, noun: &str) -> Result<usize, String> {
    if index < count { Ok(index) } else { Err(format!("expected a {noun} index below {count}, found {index}")) }
}

/// A set of names without duplicates.
pub(super) struct UniqueNames<'a> {
    noun: &'static str,
    seen: Vec<&'a str>,
}

impl<'a> UniqueNames<'a> {
    pub(super) fn new(noun: &'static str) -> Self {
        Self { noun, seen: Vec::new() }
    }

    /// Add a name.
    ///
    /// # Errors
    /// A message, if the name is in the set already.
    pub(super) fn insert(&mut self, name: &'a str) -> Result<(), String> {
        if self.seen.contains(&name) {
            return Err(format!("duplicate {} name {name:?}: every {0} needs its own name", self.noun));
        }
        self.seen.push(name);
        Ok(())
    }
}

/// The path of a field of a case: `layup.plies[2].thickness_m`. Errors are recorded under it.
pub(super) struct FieldPath<'a> {
    path: String,
    diagnostics: &'a Diagnostics,
}

impl<'a> FieldPath<'a> {
    /// The case itself, with an empty path.
    pub(super) fn root(diagnostics: &'a Diagnostics) -> Self {
        Self { path: String::new(), diagnostics }
    }

    /// A field of this value.
    pub(super) fn child(&self, name: &str) -> Self {
        let path = if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) };
        Self { path, diagnostics: self.diagnostics }
    }

    /// An element of this list.
    pub(super) fn element(&self, index: usize) -> Self {
        Self { path: format!("{}[{index}]", self.path), diagnostics: self.diagnostics }
    }

    /// The elements of this list, each with its path.
    pub(super) fn elements<'i, T>(&self, items: &'i [T]) -> impl Iterator<Item = (Self, &'i T)> {
        items.iter().enumerate().map(|(index, item)| (self.element(index), item))
    }

    /// Record the first elements of this list that break a rule, at most [`MAX_ERRORS_PER_LIST`].
    pub(super) fn require_each<T, U>(&self, items: &[T], mut rule: impl FnMut(&T) -> Result<U, String>) {
        let broken = items.iter().enumerate().filter_map(|(index, item)| Some((index, rule(item).err()?)));
        broken.take(MAX_ERRORS_PER_LIST).for_each(|(index, message)| self.element(index).error(message));
    }

    /// Record an error of this field.
    pub(super) fn error(&self, message: impl Into<String>) {
        self.diagnostics.record(&SourceLocation::without_line(self.path.as_str()), message);
    }

    /// The value, or `None` after recording the message of the rule.
    pub(super) fn require<T>(&self, rule: Result<T, String>) -> Option<T> {
        rule.map_err(|message| self.error(message)).ok()
    }

    pub(super) fn finite(&self, name: &str, value: f64) {
        self.child(name).require(finite(value, value));
    }

    pub(super) fn positive(&self, name: &str, value: f64) {
        self.child(name).require(positive(value, value));
    }

    pub(super) fn not_negative(&self, name: &str, value: f64) {
        self.child(name).require(not_negative(value, value));
    }

    pub(super) fn not_blank(&self, name: &str, text: &str) {
        self.child(name).require(not_blank(text));
    }

    pub(super) fn one_line(&self, name: &str, text: &str) {
        self.child(name).require(one_line(text));
    }

    pub(super) fn name(&self, name: &str, text: &str) {
        self.child(name).require(checked_name(text));
    }
}
