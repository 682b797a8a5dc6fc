//! Standard output and standard error: all text of the command goes through here.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Write};

/// Write to standard output.
///
/// # Errors
/// As [`end`].
pub(crate) fn print(text: &str) -> io::Result<()> {
    end(io::stdout().write_all(printable(text).as_bytes()))
}

/// Write what is left for standard output, after the result of writing to it so far. A closed pipe, as of a pager that
/// was left, is no error.
///
/// # Errors
/// When the text cannot be written, for example to a full disk.
pub(crate) fn end(written: io::Result<()>) -> io::Result<()> {
    match written.and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Write a line to standard error. Without standard error there is nowhere to report the failure.
pub(crate) fn print_error(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", printable(text.trim_end()));
}

/// Text whose control characters, except line feeds and tabs, are escaped as in JSON (`\u001b`): names and paths come
/// from files, and a terminal would obey them. So are marks that reverse the direction of text.
fn printable(text: &str) -> Cow<'_, str> {
    let is_raw = |c: char| {
        c.is_control() && !matches!(c, '\n' | '\t') || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(is_raw) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_raw(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Cow::Owned(text.chars().map(escaped).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_and_reversed_text_are_escaped_and_other_text_is_unchanged() {
        assert_eq!(printable("a\x1b[31mb\r\u{9b}2J\u{7f}"), "a\\u001b[31mb\\u000d\\u009b2J\\u007f");
        assert_eq!(printable("\u{202e}lmot.esac"), "\\u202elmot.esac");
        assert!(matches!(printable("peak 412 K\tat TC1\nε = 0.85 → ±2 K\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn escaped_json_is_json() {
        let text = serde_json::Value::from("name\u{9b}\u{202e}").to_string();
        assert_ne!(printable(&text), text);
        let read: serde_json::Value = serde_json::from_str(&printable(&text)).expect("valid JSON");
        assert_eq!(read, "name\u{9b}\u{202e}");
    }
}
