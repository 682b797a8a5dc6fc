//! The hint `did you mean …?` for an unknown name.

use strsim::levenshtein;

/// Longest list of known names in a message.
const MAX_NAMES: usize = 8;

/// `: did you mean "thickness"?` if at most half of the characters differ, else `: known: …`, the names sorted by edit
/// distance.
pub(super) fn suggestion<'n>(name: &str, known: impl IntoIterator<Item = &'n str>) -> String {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_by_key(|candidate| (levenshtein(name, candidate), *candidate));
    known.dedup();
    match known.as_slice() {
        [] => String::new(),
        [nearest, ..] if 2 * levenshtein(name, nearest) <= name.chars().count() => {
            format!(": did you mean {nearest:?}?")
        }
        _ if known.len() <= MAX_NAMES => format!(": known: {}", known.join(", ")),
        _ => format!(": known: {} and {} more", known[..MAX_NAMES].join(", "), known.len() - MAX_NAMES),
    }
}
