//! What a mistaken name was meant to be.

/// `: did you mean "thickness"?` and the other names known, the nearest first.
pub(super) fn suggestion<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_by_key(|candidate| (distance(name, candidate), *candidate));
    known.dedup();
    match known.as_slice() {
        [] => String::new(),
        [nearest, rest @ ..] if 2 * distance(name, nearest) <= name.chars().count() => {
            let rest: String = rest.iter().map(|other| format!(", {other}")).collect();
            format!(": did you mean {nearest:?}? known: {nearest}{rest}")
        }
        _ => format!(": known: {}", known.join(", ")),
    }
}

/// Edits between two words (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (diagonal + usize::from(x != y)).min(above + 1).min(row[j] + 1);
            diagonal = above;
        }
    }
    row[b.len()]
}
