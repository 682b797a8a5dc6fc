//! The dialect of a table file: separator, decimal mark, quotes and positions of cells.

/// Marks a cell that is not a finite number.
pub(super) const NOT_FINITE: f64 = f64::INFINITY;

/// Words for a missing value, in upper or lower case; an empty cell is one too.
const MISSING_VALUES: [&str; 4] = ["nan", "na", "n/a", "#n/a"];

#[derive(Debug)]
pub(super) struct Dialect {
    separator: char,
    /// The decimal mark of the numbers so far; `None` before the first one.
    decimal_mark: Option<char>,
    /// Codes of missing values that the case states, each with its number if it is one.
    missing: Vec<(String, Option<f64>)>,
}

impl Dialect {
    /// The separator: a semicolon or a tab if the heading has one outside quotes, else a comma.
    pub(super) fn detect(text: &str) -> Self {
        let heading = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
        let has = |separator: &char| outside_quotes(heading).any(|(_, c)| c == *separator);
        let separator = [';', '\t'].into_iter().find(has).unwrap_or(',');
        Self { separator, decimal_mark: None, missing: Vec::new() }
    }

    /// The dialect of the cells of a sheet, which may be text with a decimal comma.
    pub(super) fn of_sheets() -> Self {
        Self { separator: '\t', decimal_mark: None, missing: Vec::new() }
    }

    /// The dialect with these codes of cells without a value.
    pub(super) fn with_missing(self, codes: Vec<String>) -> Self {
        let missing = codes.into_iter().map(|code| {
            let number = code.parse().ok();
            (code, number)
        });
        Self { missing: missing.collect(), ..self }
    }

    /// Whether a cell is a word for a missing value.
    fn is_missing(&self, cell: &str) -> bool {
        let mut words = MISSING_VALUES.into_iter().chain(self.missing.iter().map(|(code, _)| code.as_str()));
        words.any(|missing| cell.eq_ignore_ascii_case(missing))
    }

    pub(super) fn reader<'t>(&self, text: &'t str) -> csv::Reader<&'t [u8]> {
        csv::ReaderBuilder::new()
            // One of three ASCII characters.
            .delimiter(self.separator as u8)
            .comment(Some(b'#'))
            .has_headers(false)
            .flexible(true)
            .from_reader(text.as_bytes())
    }

    /// Line, column and message of the first quote that is not closed on its line or is inside a value. The CSV reader
    /// would join lines at the former and drop the latter.
    pub(super) fn first_quote_error(&self, text: &str) -> Option<(usize, usize, &'static str)> {
        if !text.contains('"') {
            return None;
        }
        let quoted = text.lines().enumerate().filter(|(_, line)| line.contains('"') && !line.starts_with('#'));
        quoted.into_iter().find_map(|(index, line)| {
            self.cells(line).into_iter().find_map(|(at, cell)| {
                // Doubled quotes inside a quoted value are one quote.
                let is_quoted = cell.len() > 1 && cell.starts_with('"') && cell.ends_with('"');
                let inner = if is_quoted { &cell[1..cell.len() - 1] } else { cell };
                let message = match (cell.contains('"'), has_unclosed_quote(cell)) {
                    (false, _) => return None,
                    (true, true) => "a quoted value is not closed on its line",
                    _ if is_quoted && !inner.replace("\"\"", "").contains('"') => return None,
                    _ => "a quote inside a value: expected quotes around the whole value",
                };
                Some((index + 1, column(line, at), message))
            })
        })
    }

    /// The cells of a line with their quotes, each with its byte offset.
    fn cells<'l>(&self, line: &'l str) -> Vec<(usize, &'l str)> {
        let mut ends: Vec<usize> =
            outside_quotes(line).filter(|(_, c)| *c == self.separator).map(|(at, _)| at).collect();
        ends.push(line.len());
        let mut start = 0;
        ends.into_iter()
            .map(|end| {
                let cell = (start, &line[start..end]);
                start = end + 1;
                cell
            })
            .collect()
    }

    /// Line and column, counted in characters from one, of a cell of the row at byte `start`, or after the blank lines
    /// and comments there.
    pub(super) fn line_column(&self, text: &str, start: usize, cell: usize) -> (usize, usize) {
        let mut start = start;
        let line = loop {
            let line = text[start..].lines().next().unwrap_or_default();
            if !(line.is_empty() || line.starts_with('#')) || start + line.len() >= text.len() {
                break line;
            }
            start += line.len() + 1;
        };
        let number = 1 + text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count();
        let at = self.cells(line).get(cell).map_or(0, |(at, text)| at + (text.len() - text.trim_start().len()));
        (number, column(line, at))
    }

    /// The number in a cell: NaN if it is missing, [`NOT_FINITE`] if it is not a finite number or has another decimal
    /// mark than the numbers before.
    pub(super) fn number(&mut self, cell: &str) -> f64 {
        let cell = cell.trim();
        if cell.is_empty() {
            return f64::NAN;
        }
        let mark = if self.separator != ',' && cell.contains(',') { ',' } else { '.' };
        let parsed = if mark == ',' { parse_decimal_comma(cell) } else { cell.parse().ok() };
        let Some(number) = parsed.filter(|number: &f64| number.is_finite()) else {
            return if self.is_missing(cell) { f64::NAN } else { NOT_FINITE };
        };
        if self.missing.iter().any(|(_, code)| *code == Some(number)) {
            return f64::NAN;
        }
        if self.separator != ',' && cell.contains(mark) && *self.decimal_mark.get_or_insert(mark) != mark {
            return NOT_FINITE;
        }
        number
    }

    /// Whether no cell is a number and at least one is text, as in a line of units.
    pub(super) fn is_row_of_text<'c>(&self, cells: impl Iterator<Item = &'c str>) -> bool {
        let mut has_text = false;
        for cell in cells.map(str::trim).filter(|cell| !cell.is_empty()) {
            let starts_as_number = cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
            if starts_as_number || self.is_missing(cell) {
                return false;
            }
            has_text = true;
        }
        has_text
    }

    /// The likely reason why a cell with digits is not a number.
    pub(super) fn number_hint(&self, cell: &str) -> &'static str {
        const MARKS: [char; 7] = [',', '.', '\'', '’', ' ', '\u{a0}', '\u{202f}'];
        let is_number = |text: &str| text.parse().is_ok_and(f64::is_finite);
        if self.separator == ',' && cell.contains(',') {
            ": with commas between values, a number needs a decimal point and no thousands separator"
        } else if is_number(cell) || parse_decimal_comma(cell).is_some_and(f64::is_finite) {
            ": the numbers before have another decimal mark"
        } else if cell.contains(MARKS) && is_number(&cell.replace(MARKS, "")) {
            ": numbers must have no thousands separators"
        } else {
            "; if it marks a missing value, state it in `missing`"
        }
    }

    /// A hint on decimal commas if commas separate values.
    pub(super) fn decimal_comma_hint(&self) -> &'static str {
        if self.separator == ',' { "; decimal commas need semicolons or tabs between values" } else { "" }
    }
}

/// Parse a number with one decimal comma and no point.
fn parse_decimal_comma(cell: &str) -> Option<f64> {
    let (whole, rest) = cell.split_once(',')?;
    let is_plain = !whole.contains('.') && !rest.contains([',', '.']);
    if is_plain { format!("{whole}.{rest}").parse().ok() } else { None }
}

/// The characters of a line outside quotes, each with its byte offset; the quotes themselves are left out.
fn outside_quotes(line: &str) -> impl Iterator<Item = (usize, char)> {
    let mut is_quoted = false;
    line.char_indices().filter(move |(_, c)| {
        if *c == '"' {
            is_quoted = !is_quoted;
        }
        *c != '"' && !is_quoted
    })
}

/// Whether a text has an unclosed quote.
fn has_unclosed_quote(text: &str) -> bool {
    text.matches('"').count() % 2 == 1
}

/// The column of a byte offset in a line, counted in characters from one.
fn column(line: &str, at: usize) -> usize {
    line[..at].chars().count() + 1
}
