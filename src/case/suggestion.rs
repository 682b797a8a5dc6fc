//! The hint `did you mean …?` for an unknown name.

/// Longest list of known names in a message.
const MAX_NAMES: usize = 8;

/// `: did you mean "thickness"?` if at most half of the characters differ, else `: known: …`, the names sorted by edit
/// distance.
pub(super) fn suggestion<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_by_key(|candidate| (levenshtein_distance(name, candidate), *candidate));
    known.dedup();
    match known.as_slice() {
        [] => String::new(),
        [nearest, ..] if 2 * levenshtein_distance(name, nearest) <= name.chars().count() => {
            format!(": did you mean {nearest:?}?")
        }
        _ if known.len() <= MAX_NAMES => format!(": known: {}", known.join(", ")),
        _ => format!(": known: {} and {} more", known[..MAX_NAMES].join(", "), known.len() - MAX_NAMES),
    }
}

/// Levenshtein distance.
fn levenshtein_distance(a: &str, b: &str) -> usize {
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
