//! What the spread of a peak is due to, in an analyst's words.

use crate::report::words;
use crate::study::answers::Answers;
use crate::study::statistics::{Causes, Likely};
use crate::study::uncertainty::Uncertainty;

/// How much of the variance of a sensor's peak the factors explain one by one, and how much only together.
pub(super) fn alone(answers: &Answers, outcome: &Uncertainty, sensor: usize) -> Option<String> {
    let causes = &outcome.peaks[sensor].causes;
    let name = answers.sensor(&answers.case, sensor);
    let first = known(&causes.first)?;
    if !outcome.is_independent {
        let most = (0..first.len()).max_by(|&a, &b| first[a].value.total_cmp(&first[b].value))?;
        return Some(format!(
            "Factors go together here, so that what each explains of the variance of the peak of {name} overlaps with \
             what others do: the most is {} ({}), with whatever moves along; {} of that nobody else explains.",
            answers.case.factors[most].name,
            bracketed(first[most]),
            words::percent(causes.total[most].value),
        ));
    }
    let explained: f64 = first.iter().map(|index| index.value).sum();
    let together = (1.0 - explained - causes.rest).max(0.0);
    let mut said = format!(
        "One by one the factors explain {} of the variance of the peak of {name} (the sum of their first-order Sobol \
         indices); pairs that act together add {}",
        words::percent_of(explained.min(1.0)),
        words::percent_of(together),
    );
    if causes.rest >= 0.0005 {
        said += &format!(", and {} is left that pairs do not explain", words::percent_of(causes.rest));
    }
    Some(said + ".")
}

/// The table's head and, one a factor, its rows: the largest total first.
pub(super) const HEAD: [&str; 6] =
    ["Factor", "Alone (first order)", "With others (total)", "Correlation", "Of ranks", "Of ranks, others taken out"];

pub(super) fn rows(answers: &Answers, causes: &Causes) -> Vec<Vec<String>> {
    let mut order: Vec<usize> = (0..answers.case.factors.len()).collect();
    // Unknown indices leave the order of the case.
    order.sort_by(|&a, &b| {
        causes.total[b].value.partial_cmp(&causes.total[a].value).unwrap_or(std::cmp::Ordering::Equal)
    });
    let signed = |likely: Likely| {
        let [value, low, high] = [likely.value, likely.low, likely.high].map(|value| format!("{value:.2}"));
        if likely.value.is_nan() { "unknown".to_owned() } else { format!("{value} ({low} to {high})") }
    };
    let row = |factor: usize| {
        vec![
            answers.case.factors[factor].name.clone(),
            bracketed(causes.first[factor]),
            bracketed(causes.total[factor]),
            signed(causes.correlations[factor]),
            signed(causes.rank_correlations[factor]),
            signed(causes.partial_rank_correlations[factor]),
        ]
    };
    order.into_iter().map(row).collect()
}

/// How to read the table.
pub(super) fn explanation(outcome: &Uncertainty) -> &'static str {
    if outcome.is_independent {
        "Alone: the share of the variance that would go were the factor known. With others: the share that would stay were \
         all others known, which counts what it does together with each. The two differ by what factors do in pairs. In \
         brackets 95 % intervals: chance, and above also the share that pairs do not explain, as it may be any factor's."
    } else {
        "Factors go together here. Alone: the share of the variance that would go were the factor known, and with it what it \
         tells of those that move along. With others: the share that would stay were all others known, so only what the \
         factor does apart from them. These shares overlap or leave gaps, and do not sum to all. In brackets 95 % intervals."
    }
}

fn bracketed(index: Likely) -> String {
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    if index.value.is_nan() {
        return "unknown".to_owned();
    }
    format!("{} % ({} to {} %)", percent(index.value), percent(index.low), percent(index.high))
}

/// Indices, where there were members enough and something varies.
fn known(indices: &[Likely]) -> Option<&[Likely]> {
    indices.iter().any(|index| index.value > 0.0).then_some(indices)
}
