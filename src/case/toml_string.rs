//! Texts in files that are written in TOML.

use std::fmt::Write;

/// A text in quotes, on one line.
pub(crate) fn toml_string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                // Writing to a string cannot fail.
                let _ = write!(quoted, "\\u{:04X}", c as u32);
            }
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_in_quotes_is_one_line_that_is_read_back_whatever_it_has() {
        let texts = ["", "a \"b\" \\ c", "line\nfeed\t\u{7f}\u{9b}\0", "\u{202e}größe\u{200b}日本", "'''", "\"\"\""];
        for text in texts {
            let written = format!("key = {}\n", toml_string(text));
            let read: toml::Table = toml::from_str(&written).unwrap_or_else(|error| panic!("{written}: {error}"));
            assert_eq!((written.lines().count(), read["key"].as_str()), (1, Some(text)));
        }
    }
}
