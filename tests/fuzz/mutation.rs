//! Mutations of text that keep most of its structure, so that mutants get past the parser.

use crate::support::Uniform;

/// Numbers at the ends of ranges, and texts that are almost numbers.
const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1",
    "0.5",
    "1e-9",
    "1e-15",
    "1e-30",
    "1e-300",
    "5e-324",
    "1e9",
    "1e15",
    "1e30",
    "1e300",
    "1e308",
    "-1e308",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "65536",
    "4294967296",
    "9223372036854775808",
    "0x10",
    "1_000",
    "1,5",
    "1e",
    ".5",
    "+3",
];
const UNITS: &[&str] = &[
    "s", "min", "h", "ms", "us", "m", "mm", "um", "cm", "K", "degC", "degF", "W/cm^2", "W/m^2", "kW/m^2", "W/m/K",
    "W/m^2/K", "kg/m^3", "J/kg/K", "kJ/kg", "MJ/kg", "Pa", "kPa", "atm", "1/s", "kJ/mol", "m^2", "%", "1",
];
/// Characters that end, nest, hide or reverse text.
const CHARACTERS: &[char] = &[
    '"',
    '\'',
    '[',
    ']',
    '{',
    '}',
    '=',
    ',',
    '.',
    '#',
    '\n',
    '\r',
    '\t',
    ' ',
    '\\',
    '-',
    '/',
    '\0',
    '\u{1b}',
    '\u{7f}',
    '\u{9b}',
    '\u{a0}',
    '\u{202e}',
    '\u{feff}',
    '\u{fffd}',
    'é',
    '中',
    '\u{1f525}',
];
/// Copies of a duplicated line.
const COPIES: &[usize] = &[1, 2, 10, 300];

/// A random number generator with choices.
pub(super) struct Choice(Uniform);

impl Choice {
    pub(super) fn new(seed: u64) -> Self {
        // Neighbouring seeds of a congruential generator give similar numbers at first.
        let mut numbers = Uniform(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d);
        (0..8).for_each(|_| {
            numbers.next();
        });
        Self(numbers)
    }

    /// A number below `count`, which is not zero.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.0.next() * count as f64) as usize).min(count - 1)
    }

    pub(super) fn of<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.below(items.len())]
    }
}

/// The text with one to four mutations. Some take lines of `donor`, a text of the same kind.
pub(super) fn mutated(text: &str, donor: &str, choice: &mut Choice) -> String {
    let mut text = text.to_owned();
    for _ in 0..1 + choice.below(4) {
        text = match choice.below(12) {
            0..=3 => with_number(&text, choice),
            4 => with_unit(&text, choice),
            5 => with_value_of(&text, donor, choice),
            6 => with_character(&text, choice),
            7 => without_span(&text, choice),
            _ => with_lines(&text, donor, choice),
        };
    }
    text
}

/// The start and the end of every run of characters of a kind.
fn runs(text: &str, is_part: impl Fn(char) -> bool) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (start, character) in text.char_indices().filter(|&(_, character)| is_part(character)) {
        let end = start + character.len_utf8();
        match found.last_mut() {
            Some(last) if last.1 == start => last.1 = end,
            _ => found.push((start, end)),
        }
    }
    found
}

fn replaced(text: &str, (start, end): (usize, usize), new: &str) -> String {
    [&text[..start], new, &text[end..]].concat()
}

/// Another number in place of one: an extreme, or the same times a power of ten.
fn with_number(text: &str, choice: &mut Choice) -> String {
    let numbers = runs(text, |c| c.is_ascii_digit() || c == '.');
    if numbers.is_empty() {
        return text.to_owned();
    }
    let (start, end) = *choice.of(&numbers);
    let new = match text[start..end].parse::<f64>() {
        Ok(number) if choice.below(2) == 0 => format!("{:e}", number * 10_f64.powi(choice.below(13) as i32 - 6)),
        _ => (*choice.of(NUMBERS)).to_owned(),
    };
    replaced(text, (start, end), &new)
}

/// Another unit at the end of a quantity in quotes.
fn with_unit(text: &str, choice: &mut Choice) -> String {
    let quoted: Vec<(usize, usize)> = runs(text, |c| c != '"' && c != '\n');
    let quantities: Vec<(usize, usize)> = quoted
        .into_iter()
        .filter_map(|(start, end)| text[start..end].find(' ').map(|blank| (start + blank + 1, end)))
        .filter(|&(start, end)| start < end && text[start..end].len() < 8)
        .collect();
    if quantities.is_empty() {
        return text.to_owned();
    }
    let unit = *choice.of(UNITS);
    replaced(text, *choice.of(&quantities), unit)
}

/// The value of another line behind the key of a line, or the key before its value.
fn with_value_of(text: &str, donor: &str, choice: &mut Choice) -> String {
    let pairs = |text: &str| -> Vec<(String, String)> {
        let pair = |line: &str| line.split_once('=').map(|(key, value)| (key.to_owned(), value.to_owned()));
        text.lines().filter_map(pair).collect()
    };
    let (own, others) = (pairs(text), pairs(donor));
    if own.is_empty() || others.is_empty() {
        return text.to_owned();
    }
    let ((key, value), (other_key, other_value)) = (choice.of(&own), choice.of(&others));
    let new = if choice.below(2) == 0 { format!("{key}={other_value}") } else { format!("{other_key}={value}") };
    text.replacen(&format!("{key}={value}"), &new, 1)
}

/// Characters in any place.
fn with_character(text: &str, choice: &mut Choice) -> String {
    let place = boundary(text, choice);
    let character = choice.of(CHARACTERS).to_string();
    replaced(text, (place, place), &character.repeat(1 + choice.below(3)))
}

fn boundary(text: &str, choice: &mut Choice) -> usize {
    floor_boundary(text, choice.below(text.len() + 1))
}

/// The last boundary between characters up to a byte.
fn floor_boundary(text: &str, byte: usize) -> usize {
    (0..=byte).rfind(|&place| text.is_char_boundary(place)).unwrap_or(0)
}

/// Without a part, or without the end.
fn without_span(text: &str, choice: &mut Choice) -> String {
    let start = boundary(text, choice);
    let length = if choice.below(8) == 0 { text.len() } else { choice.below(40) };
    replaced(text, (start, floor_boundary(text, text.len().min(start + length))), "")
}

/// A line removed, repeated, exchanged with another, or taken from the other text.
fn with_lines(text: &str, donor: &str, choice: &mut Choice) -> String {
    let mut lines: Vec<&str> = text.split('\n').collect();
    let (one, other) = (choice.below(lines.len()), choice.below(lines.len()));
    match choice.below(4) {
        0 => drop(lines.remove(one)),
        1 => {
            let copies = *choice.of(COPIES);
            let line = lines[one];
            lines.splice(one..one, std::iter::repeat_n(line, copies));
        }
        2 => lines.swap(one, other),
        _ => {
            let theirs: Vec<&str> = donor.split('\n').collect();
            let first = choice.below(theirs.len());
            let end = (first + 1 + choice.below(8)).min(theirs.len());
            lines.splice(one..one, theirs[first..end].iter().copied());
        }
    }
    lines.join("\n")
}
