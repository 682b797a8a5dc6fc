//! Rules that quantities of several types share, and the record of the fields of a case that break one.
//!
//! A rule is a function from a value to the value or a message. The reader of a case file calls it where the value was
//! written, [`CaseBuilder::build`](super::CaseBuilder::build) where the value is a field.

use super::error::{Faults, Place};
use std::fmt::Display;

/// Faults recorded of one list of numbers: a list of a million tells no more by the others.
const MOST_FAULTS: usize = 10;

/// A number that is neither infinite nor NaN. `shown` is the number as a message shows it.
pub(super) fn finite(value: f64, shown: impl Display) -> Result<f64, String> {
    if value.is_finite() { Ok(value) } else { Err(format!("{shown} is not a finite number")) }
}

/// A finite number above zero.
pub(super) fn positive(value: f64, shown: impl Display) -> Result<f64, String> {
    if finite(value, &shown)? > 0.0 { Ok(value) } else { Err(format!("{shown} is not positive")) }
}

/// A finite number, zero or more.
pub(super) fn not_negative(value: f64, shown: impl Display) -> Result<f64, String> {
    if finite(value, &shown)? >= 0.0 { Ok(value) } else { Err(format!("{shown} is negative")) }
}

/// A text with more than spaces in it.
pub(super) fn not_blank(text: &str) -> Result<&str, String> {
    if text.trim().is_empty() { Err("empty: expected some text".to_owned()) } else { Ok(text) }
}

/// An index into a list of so many.
pub(super) fn index(index: usize, count: usize, noun: &str) -> Result<usize, String> {
    if index < count { Ok(index) } else { Err(format!("no {noun} {index}: expected an index below {count}")) }
}

/// Names that must differ.
pub(super) struct Names<'a> {
    noun: &'static str,
    met: Vec<&'a str>,
}

impl<'a> Names<'a> {
    pub(super) fn of(noun: &'static str) -> Self {
        Self { noun, met: Vec::new() }
    }

    /// One name more, unless there was one like it.
    pub(super) fn add(&mut self, name: &'a str) -> Result<(), String> {
        if self.met.contains(&name) {
            return Err(format!("a {} before this one is named {name:?} too", self.noun));
        }
        self.met.push(name);
        Ok(())
    }
}

/// A field of a case under check, known by its path: `layup.plies[2].thickness_m`.
pub(super) struct Field<'a> {
    path: String,
    faults: &'a Faults,
}

impl<'a> Field<'a> {
    /// The case as a whole, whose path is empty.
    pub(super) fn root(faults: &'a Faults) -> Self {
        Self { path: String::new(), faults }
    }

    /// A field of this one.
    pub(super) fn field(&self, name: &str) -> Self {
        let path = if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) };
        Self { path, faults: self.faults }
    }

    /// An element of this list.
    pub(super) fn item(&self, index: usize) -> Self {
        Self { path: format!("{}[{index}]", self.path), faults: self.faults }
    }

    /// Each element of this list with the field that it is.
    pub(super) fn items<'i, T>(&self, items: &'i [T]) -> impl Iterator<Item = (Self, &'i T)> {
        items.iter().enumerate().map(|(index, item)| (self.item(index), item))
    }

    /// Record the first elements of this list that break a rule.
    pub(super) fn require_each<T, U>(&self, items: &[T], mut rule: impl FnMut(&T) -> Result<U, String>) {
        let broken = items.iter().enumerate().filter_map(|(index, item)| Some((index, rule(item).err()?)));
        broken.take(MOST_FAULTS).for_each(|(index, message)| self.item(index).fault(message));
    }

    /// Record that the field breaks a rule.
    pub(super) fn fault(&self, message: impl Into<String>) {
        self.faults.record(&Place::whole(self.path.as_str()), message);
    }

    /// Record the message of a rule that the field breaks.
    pub(super) fn require<T>(&self, rule: Result<T, String>) -> Option<T> {
        rule.map_err(|message| self.fault(message)).ok()
    }

    pub(super) fn finite(&self, name: &str, value: f64) {
        self.field(name).require(finite(value, value));
    }

    pub(super) fn positive(&self, name: &str, value: f64) {
        self.field(name).require(positive(value, value));
    }

    pub(super) fn not_negative(&self, name: &str, value: f64) {
        self.field(name).require(not_negative(value, value));
    }

    pub(super) fn not_blank(&self, name: &str, text: &str) {
        self.field(name).require(not_blank(text));
    }
}
