//! TOML values with line and column, and typed access that records errors at that position.

use crate::case::error::{Diagnostics, ErrorReported, ReadResult, SourceLocation};
use crate::case::suggestion::suggestion;
use crate::case::unit::{Dimension, parse_quantity};
use crate::case::validation;
use crate::limits::{KEYS, LIST_ITEMS};
use std::cell::RefCell;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and its position in the file.
#[derive(Clone, Debug)]
pub(super) struct SpannedValue {
    location: SourceLocation,
    value: Value,
}

#[derive(Clone, Debug)]
enum Value {
    Text(String),
    /// The text of a number without quotes.
    Number(String),
    List(Vec<SpannedValue>),
    Table(Vec<Entry>),
    Boolean(bool),
    /// A value of a type that no key takes, such as a date.
    Other(&'static str),
}

#[derive(Clone, Debug)]
struct Entry {
    key: String,
    location: SourceLocation,
    node: SpannedValue,
}

impl SpannedValue {
    /// Parse a document. A syntax error hides the keys after it, so there is no tree if there is any.
    pub(super) fn parse_document(text: &str, file: &str, diagnostics: &Diagnostics) -> ReadResult<Self> {
        let source = LineIndex::new(text, file);
        let (table, errors) = DeTable::parse_recoverable(text);
        let mut faulty = None;
        for error in errors {
            let start = error.span().map_or(text.len(), |span| span.start);
            faulty = Some(diagnostics.record(&source.location(start), error.message()));
        }
        match faulty {
            Some(faulty) => Err(faulty),
            None => {
                let root = Self { location: SourceLocation::without_line(file), value: source.table(table.get_ref()) };
                root.check_sizes(diagnostics).map(|()| root)
            }
        }
    }

    /// Refuse a table or a list that is too long, whose parts are not read then.
    fn check_sizes(&self, diagnostics: &Diagnostics) -> ReadResult<()> {
        let (limit, count) = match &self.value {
            Value::Table(entries) => (&KEYS, entries.len()),
            Value::List(nodes) => (&LIST_ITEMS, nodes.len()),
            _ => return Ok(()),
        };
        self.reader(diagnostics).require(limit.check(count as f64))?;
        match &self.value {
            Value::Table(entries) => entries.iter().try_for_each(|entry| entry.node.check_sizes(diagnostics)),
            _ => self.items().iter().try_for_each(|node| node.check_sizes(diagnostics)),
        }
    }

    /// The value of an override: TOML if it parses, else text, so that `3 kPa` needs no quotes.
    pub(super) fn parse_override(text: &str, file: &str) -> Self {
        let place = SourceLocation::without_line(file);
        match DeValue::parse(text) {
            Ok(value) => {
                let source = LineIndex::new(text, file);
                Self { value: source.value(value.get_ref()), location: place }
            }
            Err(_) => Self { location: place, value: Value::Text(text.to_owned()) },
        }
    }

    /// Set the value at a dotted path; an entry of an array is selected by its `name`. Missing tables are added.
    ///
    /// # Errors
    /// A message, if a part of the path does not exist or is not a table.
    pub(super) fn set(&mut self, path: &[&str], new: Self) -> Result<(), String> {
        let Some((first, rest)) = path.split_first() else {
            *self = new;
            return Ok(());
        };
        match &mut self.value {
            Value::Table(entries) => {
                let at = entries.iter().position(|entry| entry.key == *first).unwrap_or_else(|| {
                    let node = Self { location: new.location.clone(), value: Value::Table(Vec::new()) };
                    entries.push(Entry { key: (*first).to_owned(), location: new.location.clone(), node });
                    entries.len() - 1
                });
                entries[at].node.set(rest, new)
            }
            Value::List(nodes) => nodes
                .iter_mut()
                .find(|node| node.name() == Some(first))
                .ok_or_else(|| format!("no entry is named {first:?}"))?
                .set(rest, new),
            _ => Err(format!("{first:?} is under a key that is not a table")),
        }
    }

    /// The `name` of a table.
    pub(super) fn name(&self) -> Option<&str> {
        match &self.get("name")?.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node),
            _ => None,
        }
    }

    /// The values of a list; empty for other values.
    pub(super) fn items(&self) -> &[Self] {
        match &self.value {
            Value::List(nodes) => nodes,
            _ => &[],
        }
    }

    pub(super) fn reader<'a>(&'a self, diagnostics: &'a Diagnostics) -> ValueReader<'a> {
        ValueReader { node: self, diagnostics }
    }
}

/// Converts byte offsets of a text to lines and columns.
struct LineIndex<'a> {
    file: Arc<str>,
    text: &'a str,
    /// Byte offset of each line.
    lines: Vec<usize>,
}

impl<'a> LineIndex<'a> {
    fn new(text: &'a str, file: &str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { file: file.into(), text, lines }
    }

    fn location(&self, offset: usize) -> SourceLocation {
        let line = self.lines.partition_point(|&start| start <= offset);
        let before = self.text.get(self.lines[line - 1]..offset).unwrap_or("");
        SourceLocation {
            line_column: Some((line, before.chars().count() + 1)),
            ..SourceLocation::without_line(self.file.clone())
        }
    }

    fn node(&self, value: &Spanned<DeValue<'_>>) -> SpannedValue {
        SpannedValue { location: self.location(value.span().start), value: self.value(value.get_ref()) }
    }

    fn value(&self, value: &DeValue<'_>) -> Value {
        match value {
            DeValue::String(text) => Value::Text(text.to_string()),
            DeValue::Integer(number) if number.radix() == 10 => Value::Number(number.as_str().to_owned()),
            DeValue::Integer(_) => Value::Other("a number that is not decimal"),
            DeValue::Float(number) => Value::Number(number.as_str().to_owned()),
            DeValue::Boolean(truth) => Value::Boolean(*truth),
            DeValue::Datetime(_) => Value::Other("a date"),
            DeValue::Array(values) => Value::List(values.iter().map(|value| self.node(value)).collect()),
            DeValue::Table(table) => self.table(table),
        }
    }

    fn table(&self, table: &DeTable<'_>) -> Value {
        let entry = |(key, value): (&Spanned<std::borrow::Cow<'_, str>>, &Spanned<DeValue<'_>>)| Entry {
            key: key.get_ref().to_string(),
            location: self.location(key.span().start),
            node: self.node(value),
        };
        let mut entries: Vec<Entry> = table.iter().map(entry).collect();
        entries.sort_by(|a, b| a.location.cmp(&b.location));
        Value::Table(entries)
    }
}

/// A value with access to the error record.
#[derive(Clone, Copy, Debug)]
pub(super) struct ValueReader<'a> {
    node: &'a SpannedValue,
    diagnostics: &'a Diagnostics,
}

impl<'a> ValueReader<'a> {
    pub(super) fn error(self, message: impl Into<String>) -> ErrorReported {
        self.diagnostics.record(&self.node.location, message)
    }

    /// The value, or the message of the rule recorded at this position.
    pub(super) fn require<T>(self, rule: Result<T, String>) -> ReadResult<T> {
        rule.map_err(|message| self.error(message))
    }

    pub(super) fn diagnostics(self) -> &'a Diagnostics {
        self.diagnostics
    }

    pub(super) fn text(self) -> ReadResult<&'a str> {
        match &self.node.value {
            Value::Text(text) => self.require(validation::not_blank(text)),
            _ => Err(self.error(format!("expected text in quotes, found {}", self.type_name()))),
        }
    }

    /// Text of one line.
    pub(super) fn title(self) -> ReadResult<&'a str> {
        self.require(validation::one_line(self.text()?))
    }

    /// A name that the user chooses.
    pub(super) fn name(self) -> ReadResult<&'a str> {
        self.require(validation::checked_name(self.text()?))
    }

    /// `true` or `false`.
    pub(super) fn boolean(self) -> ReadResult<bool> {
        match self.node.value {
            Value::Boolean(truth) => Ok(truth),
            _ => Err(self.error(format!("expected true or false, found {}", self.type_name()))),
        }
    }

    /// A number without quotes.
    pub(super) fn number(self) -> ReadResult<f64> {
        let Value::Number(text) = &self.node.value else {
            return Err(self.error(format!("expected a number without quotes, found {}", self.type_name())));
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(format!("expected a finite number, found {text}"))),
        }
    }

    /// A quantity with a unit, in SI. Only a fraction needs no unit.
    pub(super) fn quantity(self, dimension: Dimension) -> ReadResult<f64> {
        match &self.node.value {
            Value::Text(text) | Value::Number(text) => self.require(parse_quantity(text, dimension)),
            _ => Err(self.error(format!("expected {}, found {}", dimension.name_and_example(), self.type_name()))),
        }
    }

    pub(super) fn positive(self, dimension: Dimension) -> ReadResult<f64> {
        self.require(validation::positive(self.quantity(dimension)?, self.display_value()))
    }

    pub(super) fn not_negative(self, dimension: Dimension) -> ReadResult<f64> {
        self.require(validation::not_negative(self.quantity(dimension)?, self.display_value()))
    }

    /// The values of a list, at least one.
    pub(super) fn list(self) -> ReadResult<Vec<Self>> {
        match &self.node.value {
            Value::List(nodes) if nodes.is_empty() => {
                Err(self.error("expected at least one value, found an empty list"))
            }
            Value::List(nodes) => Ok(nodes.iter().map(|node| node.reader(self.diagnostics)).collect()),
            _ => Err(self.error(format!("expected a list, found {}", self.type_name()))),
        }
    }

    /// A list of two.
    pub(super) fn pair(self) -> ReadResult<[Self; 2]> {
        let values = self.list()?;
        let count = values.len();
        <[ValueReader<'a>; 2]>::try_from(values)
            .map_err(|_| self.error(format!("expected a list of 2, found a list of {count}")))
    }

    pub(super) fn section(self) -> ReadResult<TableReader<'a>> {
        match &self.node.value {
            Value::Table(entries) => Ok(TableReader {
                location: &self.node.location,
                entries,
                diagnostics: self.diagnostics,
                requested_keys: RefCell::default(),
            }),
            _ => Err(self.error(format!("expected a table of keys, found {}", self.type_name()))),
        }
    }

    pub(super) fn is_text(self) -> bool {
        matches!(self.node.value, Value::Text(_))
    }

    pub(super) fn is_list(self) -> bool {
        matches!(self.node.value, Value::List(_))
    }

    pub(super) fn is_table(self) -> bool {
        matches!(self.node.value, Value::Table(_))
    }

    fn display_value(self) -> String {
        match &self.node.value {
            Value::Text(text) => format!("{text:?}"),
            Value::Number(text) => text.clone(),
            _ => self.type_name().to_owned(),
        }
    }

    fn type_name(self) -> &'static str {
        match self.node.value {
            Value::Text(_) => "text",
            Value::Number(_) => "a number without quotes",
            Value::List(_) => "a list",
            Value::Table(_) => "a table of keys",
            Value::Boolean(_) => "true or false",
            Value::Other(kind) => kind,
        }
    }
}

/// A table of keys. Every key is requested by name; [`deny_unknown_keys`](Self::deny_unknown_keys) reports those that
/// were not requested.
#[derive(Debug)]
pub(super) struct TableReader<'a> {
    location: &'a SourceLocation,
    entries: &'a [Entry],
    diagnostics: &'a Diagnostics,
    requested_keys: RefCell<Vec<&'static str>>,
}

impl<'a> TableReader<'a> {
    pub(super) fn error(&self, message: impl Into<String>) -> ErrorReported {
        self.diagnostics.record(self.location, message)
    }

    /// The value, or the message of the rule recorded at the table.
    pub(super) fn require<T>(&self, rule: Result<T, String>) -> ReadResult<T> {
        rule.map_err(|message| self.error(message))
    }

    pub(super) fn optional(&self, key: &'static str) -> Option<ValueReader<'a>> {
        self.allow_keys(&[key]);
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.node.reader(self.diagnostics))
    }

    /// `expected` describes the value in the message: `a time such as "200 s"`.
    pub(super) fn required(&self, key: &'static str, expected: &str) -> ReadResult<ValueReader<'a>> {
        self.optional(key).ok_or_else(|| self.error(format!("missing key {key:?}: expected {expected}")))
    }

    pub(super) fn positive(&self, key: &'static str, dimension: Dimension) -> ReadResult<f64> {
        self.required(key, dimension.name_and_example())?.positive(dimension)
    }

    pub(super) fn positive_or(&self, key: &'static str, dimension: Dimension, default: f64) -> ReadResult<f64> {
        self.optional(key).map_or(Ok(default), |written| written.positive(dimension))
    }

    pub(super) fn text_or(&self, key: &'static str, default: &str) -> ReadResult<String> {
        self.optional(key).map_or(Ok(default), ValueReader::text).map(|text| text.trim().to_owned())
    }

    /// The tables of `[[key]]`; empty if the key is missing.
    pub(super) fn array_of_tables(&self, key: &'static str) -> ReadResult<Vec<Self>> {
        match self.optional(key) {
            None => Ok(Vec::new()),
            Some(written) => collect_all(written.list()?.into_iter().map(ValueReader::section)),
        }
    }

    /// The keys not requested so far, with their values: names chosen by the analyst, such as sensors.
    pub(super) fn unread_keys(&self) -> Vec<(&'a str, ValueReader<'a>)> {
        let asked = self.requested_keys.borrow();
        let free = self.entries.iter().filter(|entry| !asked.contains(&entry.key.as_str()));
        free.map(|entry| (entry.key.as_str(), entry.node.reader(self.diagnostics))).collect()
    }

    /// Keys that are read elsewhere: they are known.
    pub(super) fn allow_keys(&self, keys: &[&'static str]) {
        #[cfg(test)]
        requests::record(self.location, keys);
        self.requested_keys.borrow_mut().extend(keys);
    }

    /// Record every key that was not requested as unknown.
    pub(super) fn deny_unknown_keys(&self) {
        let asked = self.requested_keys.borrow();
        for entry in self.entries.iter().filter(|entry| !asked.contains(&entry.key.as_str())) {
            let hint = suggestion(&entry.key, asked.iter().copied());
            self.diagnostics.record(&entry.location, format!("unknown key {:?}{hint}", entry.key));
        }
    }
}

/// All values, or the last error; the iterator is always exhausted.
pub(super) fn collect_all<T>(reads: impl IntoIterator<Item = ReadResult<T>>) -> ReadResult<Vec<T>> {
    let mut values = Vec::new();
    let mut faulty = None;
    for read in reads {
        match read {
            Ok(value) => values.push(value),
            Err(fault) => faulty = Some(fault),
        }
    }
    faulty.map_or(Ok(values), Err)
}

/// The keys that the reader asks tables for.
#[cfg(test)]
pub(super) mod requests {
    use super::{SourceLocation, SpannedValue, Value};
    use std::cell::RefCell;
    use std::collections::BTreeSet;

    /// Position of a table and a key that was requested from it.
    type Request = (SourceLocation, &'static str);

    thread_local! {
        static REQUESTS: RefCell<BTreeSet<Request>> = const { RefCell::new(BTreeSet::new()) };
    }

    pub(super) fn record(table: &SourceLocation, keys: &[&'static str]) {
        REQUESTS.with_borrow_mut(|all| all.extend(keys.iter().map(|&key| (table.clone(), key))));
    }

    /// The requests of this thread since the last call.
    pub(in crate::case::file) fn take() -> BTreeSet<Request> {
        REQUESTS.take()
    }

    /// Position and path of every table of a document; entries of lists have their index as a name.
    pub(in crate::case::file) fn tables(root: &SpannedValue) -> Vec<(SourceLocation, Vec<String>)> {
        let mut found = Vec::new();
        let mut open = vec![(Vec::new(), root)];
        while let Some((path, node)) = open.pop() {
            let child = |name: String| path.iter().cloned().chain([name]).collect::<Vec<_>>();
            match &node.value {
                Value::Table(entries) => {
                    open.extend(entries.iter().map(|entry| (child(entry.key.clone()), &entry.node)));
                    found.push((node.location.clone(), path));
                }
                Value::List(nodes) => {
                    open.extend(nodes.iter().enumerate().map(|(index, node)| (child(index.to_string()), node)));
                }
                _ => {}
            }
        }
        found
    }
}
