//! TOML values with line and column, and typed access that records errors at that position.

use crate::case::check;
use crate::case::error::{Faults, Faulty, Place, Read};
use crate::case::nearest::suggestion;
use crate::case::unit::{Dimension, quantity};
use std::cell::RefCell;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and its position in the file.
#[derive(Clone, Debug)]
pub(super) struct Node {
    place: Place,
    value: Value,
}

#[derive(Clone, Debug)]
enum Value {
    Text(String),
    /// The text of a number without quotes.
    Number(String),
    List(Vec<Node>),
    Table(Vec<Entry>),
    Truth(bool),
    /// A value of a type that no key takes, such as a date.
    Other(&'static str),
}

#[derive(Clone, Debug)]
struct Entry {
    key: String,
    place: Place,
    node: Node,
}

impl Node {
    /// Parse a document. A syntax error hides the keys after it, so there is no tree if there is any.
    pub(super) fn document(text: &str, file: &str, diagnostics: &Faults) -> Read<Self> {
        let source = Source::new(text, file);
        let (table, errors) = DeTable::parse_recoverable(text);
        let mut faulty = None;
        for error in errors {
            let start = error.span().map_or(text.len(), |span| span.start);
            faulty = Some(diagnostics.record(&source.place(start), error.message()));
        }
        match faulty {
            Some(faulty) => Err(faulty),
            None => Ok(Self { place: Place::whole(file), value: source.table(table.get_ref()) }),
        }
    }

    /// The value of an override: TOML if it parses, else text, so that `3 kPa` needs no quotes.
    pub(super) fn inline(text: &str, file: &str) -> Self {
        let place = Place::whole(file);
        match DeValue::parse(text) {
            Ok(value) => {
                let source = Source::new(text, file);
                Self { value: source.value(value.get_ref()), place }
            }
            Err(_) => Self { place, value: Value::Text(text.to_owned()) },
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
                    let node = Self { place: new.place.clone(), value: Value::Table(Vec::new()) };
                    entries.push(Entry { key: (*first).to_owned(), place: new.place.clone(), node });
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

    pub(super) fn read<'a>(&'a self, diagnostics: &'a Faults) -> Written<'a> {
        Written { node: self, diagnostics }
    }
}

/// Converts byte offsets of a text to lines and columns.
struct Source<'a> {
    file: Arc<str>,
    text: &'a str,
    /// Byte offset of each line.
    lines: Vec<usize>,
}

impl<'a> Source<'a> {
    fn new(text: &'a str, file: &str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { file: file.into(), text, lines }
    }

    fn place(&self, offset: usize) -> Place {
        let line = self.lines.partition_point(|&start| start <= offset);
        let before = self.text.get(self.lines[line - 1]..offset).unwrap_or("");
        Place { file: self.file.clone(), at: Some((line, before.chars().count() + 1)) }
    }

    fn node(&self, value: &Spanned<DeValue<'_>>) -> Node {
        Node { place: self.place(value.span().start), value: self.value(value.get_ref()) }
    }

    fn value(&self, value: &DeValue<'_>) -> Value {
        match value {
            DeValue::String(text) => Value::Text(text.to_string()),
            DeValue::Integer(number) if number.radix() == 10 => Value::Number(number.as_str().to_owned()),
            DeValue::Integer(_) => Value::Other("a number that is not decimal"),
            DeValue::Float(number) => Value::Number(number.as_str().to_owned()),
            DeValue::Boolean(truth) => Value::Truth(*truth),
            DeValue::Datetime(_) => Value::Other("a date"),
            DeValue::Array(values) => Value::List(values.iter().map(|value| self.node(value)).collect()),
            DeValue::Table(table) => self.table(table),
        }
    }

    fn table(&self, table: &DeTable<'_>) -> Value {
        let entry = |(key, value): (&Spanned<std::borrow::Cow<'_, str>>, &Spanned<DeValue<'_>>)| Entry {
            key: key.get_ref().to_string(),
            place: self.place(key.span().start),
            node: self.node(value),
        };
        let mut entries: Vec<Entry> = table.iter().map(entry).collect();
        entries.sort_by(|a, b| a.place.cmp(&b.place));
        Value::Table(entries)
    }
}

/// A value with access to the error record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Written<'a> {
    node: &'a Node,
    diagnostics: &'a Faults,
}

impl<'a> Written<'a> {
    pub(super) fn fault(self, message: impl Into<String>) -> Faulty {
        self.diagnostics.record(&self.node.place, message)
    }

    /// The value, or the message of the rule recorded at this position.
    pub(super) fn require<T>(self, rule: Result<T, String>) -> Read<T> {
        rule.map_err(|message| self.fault(message))
    }

    pub(super) fn diagnostics(self) -> &'a Faults {
        self.diagnostics
    }

    pub(super) fn text(self) -> Read<&'a str> {
        match &self.node.value {
            Value::Text(text) => self.require(check::not_blank(text)),
            _ => Err(self.fault(format!("expected text in quotes, found {}", self.kind()))),
        }
    }

    /// `true` or `false`.
    pub(super) fn truth(self) -> Read<bool> {
        match self.node.value {
            Value::Truth(truth) => Ok(truth),
            _ => Err(self.fault(format!("expected true or false, found {}", self.kind()))),
        }
    }

    /// A number without quotes.
    pub(super) fn number(self) -> Read<f64> {
        let Value::Number(text) = &self.node.value else {
            return Err(self.fault(format!("expected a number without quotes, found {}", self.kind())));
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.fault(format!("expected a finite number, found {text}"))),
        }
    }

    /// A quantity with a unit, in SI. Only a fraction needs no unit.
    pub(super) fn quantity(self, dimension: Dimension) -> Read<f64> {
        match &self.node.value {
            Value::Text(text) | Value::Number(text) => self.require(quantity(text, dimension)),
            _ => Err(self.fault(format!("expected {}, found {}", dimension.expectation(), self.kind()))),
        }
    }

    pub(super) fn positive(self, dimension: Dimension) -> Read<f64> {
        self.require(check::positive(self.quantity(dimension)?, self.shown()))
    }

    pub(super) fn not_negative(self, dimension: Dimension) -> Read<f64> {
        self.require(check::not_negative(self.quantity(dimension)?, self.shown()))
    }

    /// The values of a list, at least one.
    pub(super) fn list(self) -> Read<Vec<Self>> {
        match &self.node.value {
            Value::List(nodes) if nodes.is_empty() => {
                Err(self.fault("expected at least one value, found an empty list"))
            }
            Value::List(nodes) => Ok(nodes.iter().map(|node| node.read(self.diagnostics)).collect()),
            _ => Err(self.fault(format!("expected a list, found {}", self.kind()))),
        }
    }

    /// A list of two.
    pub(super) fn pair(self) -> Read<[Self; 2]> {
        let values = self.list()?;
        let count = values.len();
        <[Written<'a>; 2]>::try_from(values)
            .map_err(|_| self.fault(format!("expected a list of 2, found a list of {count}")))
    }

    pub(super) fn section(self) -> Read<Section<'a>> {
        match &self.node.value {
            Value::Table(entries) => Ok(Section {
                place: &self.node.place,
                entries,
                diagnostics: self.diagnostics,
                asked: RefCell::default(),
            }),
            _ => Err(self.fault(format!("expected a table of keys, found {}", self.kind()))),
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

    fn shown(self) -> String {
        match &self.node.value {
            Value::Text(text) => format!("{text:?}"),
            Value::Number(text) => text.clone(),
            _ => self.kind().to_owned(),
        }
    }

    fn kind(self) -> &'static str {
        match self.node.value {
            Value::Text(_) => "text",
            Value::Number(_) => "a number without quotes",
            Value::List(_) => "a list",
            Value::Table(_) => "a table of keys",
            Value::Truth(_) => "true or false",
            Value::Other(kind) => kind,
        }
    }
}

/// A table of keys. Every key is requested by name; [`deny_unknown_keys`](Self::deny_unknown_keys) reports those that
/// were not requested.
#[derive(Debug)]
pub(super) struct Section<'a> {
    place: &'a Place,
    entries: &'a [Entry],
    diagnostics: &'a Faults,
    asked: RefCell<Vec<&'static str>>,
}

impl<'a> Section<'a> {
    pub(super) fn fault(&self, message: impl Into<String>) -> Faulty {
        self.diagnostics.record(self.place, message)
    }

    /// The value, or the message of the rule recorded at the table.
    pub(super) fn require<T>(&self, rule: Result<T, String>) -> Read<T> {
        rule.map_err(|message| self.fault(message))
    }

    pub(super) fn optional(&self, key: &'static str) -> Option<Written<'a>> {
        self.asked.borrow_mut().push(key);
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.node.read(self.diagnostics))
    }

    /// `expected` describes the value in the message: `a time such as "200 s"`.
    pub(super) fn required(&self, key: &'static str, expected: &str) -> Read<Written<'a>> {
        self.optional(key).ok_or_else(|| self.fault(format!("missing key {key:?}: expected {expected}")))
    }

    pub(super) fn positive(&self, key: &'static str, dimension: Dimension) -> Read<f64> {
        self.required(key, dimension.expectation())?.positive(dimension)
    }

    pub(super) fn positive_or(&self, key: &'static str, dimension: Dimension, default: f64) -> Read<f64> {
        self.optional(key).map_or(Ok(default), |written| written.positive(dimension))
    }

    pub(super) fn text_or(&self, key: &'static str, default: &str) -> Read<String> {
        self.optional(key).map_or(Ok(default), Written::text).map(|text| text.trim().to_owned())
    }

    /// The tables of `[[key]]`; empty if the key is missing.
    pub(super) fn tables(&self, key: &'static str) -> Read<Vec<Self>> {
        match self.optional(key) {
            None => Ok(Vec::new()),
            Some(written) => all(written.list()?.into_iter().map(Written::section)),
        }
    }

    /// The keys not requested so far, with their values: names chosen by the analyst, such as sensors.
    pub(super) fn others(&self) -> Vec<(&'a str, Written<'a>)> {
        let asked = self.asked.borrow();
        let free = self.entries.iter().filter(|entry| !asked.contains(&entry.key.as_str()));
        free.map(|entry| (entry.key.as_str(), entry.node.read(self.diagnostics))).collect()
    }

    /// Record every key that was not requested as unknown.
    pub(super) fn close(&self) {
        let asked = self.asked.borrow();
        for entry in self.entries.iter().filter(|entry| !asked.contains(&entry.key.as_str())) {
            let hint = suggestion(&entry.key, asked.iter().copied());
            self.diagnostics.record(&entry.place, format!("unknown key {:?}{hint}", entry.key));
        }
    }
}

/// All values, or the last error; the iterator is always exhausted.
pub(super) fn all<T>(reads: impl IntoIterator<Item = Read<T>>) -> Read<Vec<T>> {
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
