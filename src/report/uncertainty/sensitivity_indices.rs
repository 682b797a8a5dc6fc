//! Sensitivity indices of a peak in sentences and tables.

use crate::case::Case;
use crate::report::format;
use crate::statistics::{ConfidenceInterval, PairIndex, SensitivityIndices};
use crate::study::answers::Answers;
use crate::study::uncertainty::Uncertainty;

/// Shares of the variance of a sensor's peak due to single factors and to pairwise interactions.
pub(super) fn variance_decomposition(answers: &Answers, outcome: &Uncertainty, sensor: usize) -> Option<String> {
    let indices = &outcome.peaks[sensor].temperature_indices;
    let name = answers.sensor_name(&answers.case, sensor);
    let first = defined_indices(&indices.first)?;
    if !outcome.is_independent {
        let most = (0..first.len()).max_by(|&a, &b| first[a].value.total_cmp(&first[b].value))?;
        return Some(format!(
            "The factors are correlated, so that the first-order Sobol indices of the peak of {name} overlap. The \
             largest is that of {}, {}, including the effect of factors correlated with it; its total index, without \
             that effect, is {}.",
            answers.case.factors[most].name,
            index_with_interval(first[most]),
            format::percent(indices.total[most].value),
        ));
    }
    let explained: f64 = first.iter().map(|index| index.value).sum();
    let by_pairs = (1.0 - explained - indices.unexplained).max(0.0);
    let mut text = format!(
        "Variance of the peak of {name}: first-order Sobol indices sum to {}, pairwise interactions explain {}",
        format::percent_near_limits(explained.min(1.0)),
        format::percent_near_limits(by_pairs),
    );
    if indices.unexplained >= 0.0005 {
        text += &format!(", {} is unexplained", format::percent_near_limits(indices.unexplained));
    }
    Some(text + ".")
}

/// Head of the table of sensitivity indices.
pub(super) const HEAD: [&str; 6] = [
    "Factor",
    "First-order Sobol index",
    "Total Sobol index",
    "Pearson correlation",
    "Spearman rank correlation",
    "Partial rank correlation (PRCC)",
];

/// Rows of the table, one per factor, the largest total index first.
pub(super) fn rows(answers: &Answers, indices: &SensitivityIndices) -> Vec<Vec<String>> {
    let mut order: Vec<usize> = (0..answers.case.factors.len()).collect();
    order.sort_by(|&a, &b| largest_first(indices.total[a], indices.total[b]));
    let signed = |likely: ConfidenceInterval| {
        let [value, low, high] = [likely.value, likely.low, likely.high].map(|value| format!("{value:.2}"));
        if likely.value.is_nan() { "unknown".to_owned() } else { format!("{value} ({low} to {high})") }
    };
    let row = |factor: usize| {
        vec![
            answers.case.factors[factor].name.clone(),
            index_with_interval(indices.first[factor]),
            index_with_interval(indices.total[factor]),
            signed(indices.correlations[factor]),
            signed(indices.rank_correlations[factor]),
            signed(indices.partial_rank_correlations[factor]),
        ]
    };
    order.into_iter().map(row).collect()
}

/// Rows of the table of second-order indices on the page at most, and the smallest index shown, apart from the largest.
const PAIRS_SHOWN: usize = 10;
const MIN_INDEX_SHOWN: f64 = 0.0005;

/// Head of the table of second-order indices.
pub(super) const PAIR_HEAD: [&str; 2] = ["Factors", "Second-order Sobol index"];

/// Rows of the table of second-order indices, the largest first.
pub(super) fn pair_rows(case: &Case, indices: &SensitivityIndices) -> Vec<Vec<String>> {
    let row = |pair: &PairIndex| vec![pair_names(case, *pair).join(" and "), index_with_interval(pair.index)];
    ranked_pairs(indices).iter().take(pairs_shown(indices)).map(row).collect()
}

fn pairs_shown(indices: &SensitivityIndices) -> usize {
    indices.second.iter().filter(|pair| pair.index.value >= MIN_INDEX_SHOWN).count().clamp(1, PAIRS_SHOWN)
}

/// Explanation of the table of second-order indices.
pub(super) fn pair_explanation(indices: &SensitivityIndices) -> String {
    let others = match indices.second.len().saturating_sub(pairs_shown(indices)) {
        0 => String::new(),
        others => format!(" second-order.csv also has {} with smaller indices.", format::counted(others, "pair")),
    };
    format!(
        "Second-order index: share of the variance due to the interaction of two factors, which neither has alone. The \
         upper ends of the 95 % intervals include the unexplained variance.{others}"
    )
}

/// The order of two indices in a table; unknown ones (NaN) come last.
fn largest_first(one: ConfidenceInterval, other: ConfidenceInterval) -> std::cmp::Ordering {
    let [one, other] = [one, other].map(|index| if index.value.is_nan() { f64::NEG_INFINITY } else { index.value });
    other.total_cmp(&one)
}

/// Pairs of factors, the largest index first.
pub(super) fn ranked_pairs(indices: &SensitivityIndices) -> Vec<PairIndex> {
    let mut pairs = indices.second.clone();
    pairs.sort_by(|a, b| largest_first(a.index, b.index));
    pairs
}

/// Names of the factors of a pair.
pub(super) fn pair_names(case: &Case, pair: PairIndex) -> [&str; 2] {
    [pair.factors.0, pair.factors.1].map(|factor| case.factors[factor].name.as_str())
}

/// Explanation of the table.
pub(super) fn explanation(outcome: &Uncertainty) -> &'static str {
    if outcome.is_independent {
        "First-order index: expected share by which the variance falls if the factor becomes known. Total index: \
         expected share of the variance that remains if all other factors become known; it includes the interactions \
         of the factor. Brackets: 95 % intervals by sampling error; the upper ends of the indices include the \
         variance that polynomials of one and of two factors leave unexplained, which may be due to any factor."
    } else {
        "The factors are correlated. First-order index: expected share by which the variance falls if the factor \
         becomes known; it includes the effect of factors correlated with it. Total index: expected share of the \
         variance that remains if all other factors become known; it excludes that effect. The indices overlap or \
         leave gaps, and do not sum to one. Brackets: 95 % intervals by sampling error; the upper ends of the indices \
         include the variance that polynomials of one and of two factors leave unexplained."
    }
}

fn index_with_interval(index: ConfidenceInterval) -> String {
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    if index.value.is_nan() {
        return "unknown".to_owned();
    }
    format!("{} % ({} to {} %)", percent(index.value), percent(index.low), percent(index.high))
}

/// The indices, if there were enough members and the output varies.
fn defined_indices(indices: &[ConfidenceInterval]) -> Option<&[ConfidenceInterval]> {
    indices.iter().any(|index| index.value > 0.0).then_some(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sort may panic if its comparison is not a total order, which shows from some twenty elements on.
    #[test]
    fn indices_are_listed_from_the_largest_to_the_smallest_and_unknown_ones_last() {
        let value = |place: usize| if place.is_multiple_of(3) { f64::NAN } else { ((place * 37) % 101) as f64 };
        let index = |value| ConfidenceInterval { value, low: value, high: value };
        let mut indices: Vec<_> = (0..300).map(value).map(index).collect();
        indices.sort_by(|&one, &other| largest_first(one, other));
        let (known, unknown) = indices.split_at(200);
        assert!(known.is_sorted_by(|one, other| one.value >= other.value));
        assert!(unknown.iter().all(|index| index.value.is_nan()));
    }
}
