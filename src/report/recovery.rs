//! What is said of many twins and what was found of them.

use super::{sizing, words};
use crate::study::recovery::{Recovered, Recovery};

/// How often intervals held the truth.
pub(super) fn coverage(outcome: &Recovery) -> String {
    let each: Vec<String> = outcome
        .recovered
        .iter()
        .map(|factor| {
            let Recovered { name, covered, .. } = factor;
            format!("{name} in {} of {}", words::count(covered.count), words::count(covered.of))
        })
        .collect();
    format!(
        "95 % intervals hold the truth in {} of all: {}.",
        sizing::proportion(outcome.covered),
        words::listed(&each)
    )
}

/// How the data were made.
pub(super) fn made(outcome: &Recovery) -> String {
    let noise = outcome.noise_k.map_or("the standard deviations of the observations".to_owned(), |noise_k| {
        format!("a standard deviation of {}", words::misfit(noise_k))
    });
    let follows = if outcome.noise.correlation_s > 0.0 {
        format!("noise that forgets itself over {}", words::seconds(outcome.noise.correlation_s))
    } else {
        "independent noise".to_owned()
    };
    format!(
        "{} of truths drawn between the {} side constraints, with {follows} of {noise}: {} each, which carry the information \
         of {} as the residuals tell.",
        words::counted(outcome.twins.len(), "data set"),
        outcome.drawn.name(),
        words::counted(outcome.samples, "sample"),
        words::significant(outcome.effective_samples, 2)
    )
}

/// Whether estimates are off on the whole by more than chance makes them.
pub(super) fn is_biased(factor: &Recovered) -> bool {
    factor.bias.abs() > 3.0 * factor.bias_error
}

/// Reasons for doubt.
pub(super) fn doubts(outcome: &Recovery, doubts: &mut Vec<String>) {
    for (reason, count) in outcome.failures() {
        let of = words::counted(outcome.twins.len(), "twin");
        doubts.push(format!("{} of {of} did not converge ({reason}); those that were fitted count with the intervals that they ended with.", words::count(count)));
    }
    for factor in &outcome.recovered {
        let (low, high) = factor.covered.interval_95();
        if !(low..=high).contains(&0.95) {
            let way = if high < 0.95 { "seldom" } else { "often" };
            let held = sizing::proportion(factor.covered);
            doubts
                .push(format!("Intervals of {} hold the truth too {way}: in {held} where 95 % is said.", factor.name));
        }
        if factor.at_bound > 0 {
            doubts.push(format!(
                "{} of {} estimates of {} stand on a bound; they count as the others do.",
                words::count(factor.at_bound),
                words::count(factor.covered.of),
                factor.name
            ));
        }
        if is_biased(factor) {
            doubts.push(format!(
                "Estimates of {} are off by {} on average, more than the {} that chance explains.",
                factor.name,
                words::significant(factor.bias, 2),
                words::significant(2.0 * factor.bias_error, 2)
            ));
        }
    }
}
