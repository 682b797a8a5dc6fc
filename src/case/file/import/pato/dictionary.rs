//! A dictionary of OpenFOAM: `name [dimensions] value;`, where the name may be repeated before the dimensions, with
//! comments and blocks in braces.

use crate::case::error::{Diagnostics, ErrorReported, ReadResult, SourceLocation};
use crate::case::suggestion::suggestion;
use std::sync::Arc;

/// Entries outside blocks.
pub(super) struct Dictionary<'a> {
    file: Arc<str>,
    entries: Vec<Entry>,
    diagnostics: &'a Diagnostics,
}

struct Entry {
    name: String,
    value: String,
    line: usize,
    /// The comment at the end of its last line.
    remark: Option<String>,
}

/// The text without comments, and the comment that begins in each line and ends with it.
fn split_comments(text: &str) -> (String, Vec<Option<String>>) {
    let (mut code, mut remarks) = (String::new(), Vec::new());
    let mut in_block = false;
    for line in text.lines() {
        let mut rest = line;
        let mut remark = None;
        while !rest.is_empty() {
            if in_block {
                let end = rest.find("*/");
                in_block = end.is_none();
                rest = end.map_or("", |end| &rest[end + 2..]);
                continue;
            }
            let start = [rest.find("//"), rest.find("/*")].into_iter().flatten().min();
            let Some(start) = start else {
                code.push_str(rest);
                break;
            };
            code.push_str(&rest[..start]);
            if rest[start..].starts_with("//") {
                remark = Some(rest[start + 2..].trim().to_owned()).filter(|remark| !remark.is_empty());
                break;
            }
            in_block = true;
            rest = &rest[start + 2..];
        }
        code.push('\n');
        remarks.push(remark);
    }
    (code, remarks)
}

impl<'a> Dictionary<'a> {
    pub(super) fn parse(text: &str, label: &str, diagnostics: &'a Diagnostics) -> ReadResult<Self> {
        let (code, remarks) = split_comments(text);
        let mut dictionary = Self { file: label.into(), entries: Vec::new(), diagnostics };
        let (mut depth, mut line, mut first) = (0usize, 1, 1);
        let mut statement = String::new();
        for c in code.chars() {
            match c {
                '{' => {
                    depth += 1;
                    statement.clear();
                }
                '}' => {
                    depth = depth.checked_sub(1).ok_or_else(|| dictionary.error_at(line, "a brace closes no block"))?;
                    statement.clear();
                }
                ';' if depth == 0 => {
                    let remark = remarks.get(line - 1).cloned().flatten();
                    dictionary.add(&statement, first, remark)?;
                    statement.clear();
                }
                c if depth == 0 => {
                    if statement.trim().is_empty() && !c.is_whitespace() {
                        first = line;
                    }
                    statement.push(c);
                }
                _ => {}
            }
            line += usize::from(c == '\n');
        }
        if depth > 0 || !statement.trim().is_empty() {
            return Err(dictionary.error_at(first, "the entry or block has no end: expected `;` or `}`"));
        }
        Ok(dictionary)
    }

    /// Add the entry of a statement.
    fn add(&mut self, statement: &str, line: usize, remark: Option<String>) -> ReadResult<()> {
        let statement = statement.trim();
        let (name, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
        let rest = rest.trim_start();
        let rest =
            rest.strip_prefix(name).filter(|rest| rest.starts_with([' ', '\t', '['])).unwrap_or(rest).trim_start();
        let value = match rest.strip_prefix('[') {
            Some(inner) => inner.split_once(']').map(|(_, value)| value),
            None => Some(rest),
        };
        let value = value.map(str::trim).filter(|value| !value.is_empty());
        let value = value.ok_or_else(|| self.error_at(line, format!("expected a value of {name:?}, found none")))?;
        self.entries.push(Entry { name: name.to_owned(), value: value.to_owned(), line, remark });
        Ok(())
    }

    fn error_at(&self, line: usize, message: impl Into<String>) -> ErrorReported {
        self.diagnostics
            .record(&SourceLocation { file: self.file.clone(), sheet: None, line_column: Some((line, 1)) }, message)
    }

    /// The last entry of a name, as in OpenFOAM.
    fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().rfind(|entry| entry.name == name)
    }

    fn required(&self, name: &str) -> ReadResult<&Entry> {
        self.entry(name).ok_or_else(|| {
            let hint = suggestion(name, self.entries.iter().map(|entry| entry.name.as_str()));
            let place = SourceLocation::without_line(self.file.clone());
            self.diagnostics.record(&place, format!("missing entry {name:?}{hint}"))
        })
    }

    /// Record an error of an entry.
    pub(super) fn error(&self, name: &str, message: impl Into<String>) -> ErrorReported {
        let message = format!("{name}: {}", message.into());
        match self.entry(name) {
            Some(entry) => self.error_at(entry.line, message),
            None => self.diagnostics.record(&SourceLocation::without_line(self.file.clone()), message),
        }
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.entry(name).is_some()
    }

    pub(super) fn remark(&self, name: &str) -> Option<String> {
        self.entry(name).and_then(|entry| entry.remark.clone())
    }

    pub(super) fn number(&self, name: &str) -> ReadResult<f64> {
        let entry = self.required(name)?;
        match entry.value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(name, format!("expected a number, found {:?}", entry.value))),
        }
    }

    pub(super) fn number_or(&self, name: &str, default: f64) -> ReadResult<f64> {
        if self.has(name) { self.number(name) } else { Ok(default) }
    }

    pub(super) fn positive(&self, name: &str) -> ReadResult<f64> {
        let number = self.number(name)?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(self.error(name, format!("expected a number above 0, found {number}")))
        }
    }

    /// A whole number from 0 to `max`.
    pub(super) fn count(&self, name: &str, max: usize) -> ReadResult<usize> {
        let value = &self.required(name)?.value;
        match value.parse::<usize>() {
            Ok(count) if count <= max => Ok(count),
            _ => Err(self.error(name, format!("expected a whole number from 0 to {max}, found {value:?}"))),
        }
    }

    /// The nine numbers of a tensor, `(1 0 0 0 1 0 0 0 1)`.
    pub(super) fn tensor(&self, name: &str) -> ReadResult<[f64; 9]> {
        let value = &self.required(name)?.value;
        let inner = value.strip_prefix('(').and_then(|value| value.strip_suffix(')')).unwrap_or_default();
        let numbers: Option<Vec<f64>> =
            inner.split_whitespace().map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect();
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.ok_or_else(|| self.error(name, format!("expected nine numbers in parentheses, found {value:?}")))
    }

    /// The entry of a tensor in a direction, which must be stated if the tensor depends on it.
    pub(super) fn diagonal(&self, name: &str, direction: Option<usize>) -> ReadResult<f64> {
        let [i, _, _, _, j, _, _, _, k] = self.tensor(name)?;
        match direction {
            Some(direction) => Ok([i, j, k][direction]),
            None if i == j && j == k => Ok(i),
            None => {
                Err(self.error(name, format!("{i}, {j} and {k} differ: state the direction through the thickness")))
            }
        }
    }
}
