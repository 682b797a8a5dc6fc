//! Tables and text of the page. All text becomes HTML here, and is escaped here.

/// Escape a text for HTML, with no-break spaces between numbers and units.
pub(in crate::report) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for (at, c) in text.char_indices() {
        match c {
            ' ' if text[..at].ends_with(|c: char| c.is_ascii_digit()) && is_unit(&text[at + 1..]) => out.push('\u{a0}'),
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            other => out.push(other),
        }
    }
    out
}

/// Whether a text starts with a unit.
fn is_unit(text: &str) -> bool {
    let word = text.split(|c: char| !c.is_alphanumeric() && !"°%²³/".contains(c)).next().unwrap_or_default();
    ["K", "s", "°C", "%", "mm", "K²", "kPa", "MJ/kg", "W/cm²", "W/m²/K", "kg/m³", "kg/m²", "kg/m²/s", "MJ/m²"]
        .contains(&word)
}

/// A paragraph.
pub(in crate::report) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escaped(text))
}

/// A list of sentences; empty without any.
pub(in crate::report) fn list<S: AsRef<str>>(sentences: &[S]) -> String {
    if sentences.is_empty() {
        return String::new();
    }
    let items: String = sentences.iter().map(|sentence| format!("<li>{}</li>\n", escaped(sentence.as_ref()))).collect();
    format!("<ul>\n{items}</ul>\n")
}

/// A table with a title, in a container that scrolls. The first cell of a row is its name; numbers are right-aligned.
pub(in crate::report) fn table(title: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let numeric: Vec<bool> = (0..head.len())
        .map(|column| rows.iter().all(|row| row.get(column).is_none_or(|cell| is_number(cell))))
        .collect();
    let class = |column: usize| if numeric[column] { " class=\"number\"" } else { "" };
    let mut out = format!("<h3>{}</h3>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<thead><tr>", escaped(title));
    for (column, name) in head.iter().enumerate() {
        out.push_str(&format!("<th scope=\"col\"{}>{}</th>", class(column), escaped(name)));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (column, cell) in row.iter().take(head.len()).enumerate() {
            let text = escaped(cell);
            out.push_str(&match column {
                0 => format!("<th scope=\"row\">{text}</th>"),
                _ => format!("<td{}>{text}</td>", class(column)),
            });
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

fn is_number(cell: &str) -> bool {
    let words = ["", "-", "–", "unknown", "unbounded", "not determined", "infinite"];
    words.contains(&cell)
        || cell.trim_start_matches(['-', '+', '±', '<', ' ']).starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_is_escaped() {
        let out = table("<b>", &["a\"b"], &[vec!["<script>alert('x')</script>".to_owned()]]);
        assert!(!out.contains("<script>") && !out.contains("<b>") && out.contains("&lt;script&gt;"));
    }

    #[test]
    fn a_number_and_its_unit_stay_on_one_line() {
        assert_eq!(escaped("873 K (600 °C) at 5 members"), "873\u{a0}K (600\u{a0}°C) at 5 members");
    }

    #[test]
    fn numbers_are_right_aligned() {
        let row = |a: &str, b: &str| vec!["x".to_owned(), a.to_owned(), b.to_owned()];
        let out = table("t", &["", "n", "w"], &[row("1.5", "held"), row("-2", "1 s")]);
        assert_eq!(out.matches("class=\"number\"").count(), 3, "{out}");
    }
}
