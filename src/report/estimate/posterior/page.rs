//! The section of the posterior: convergence, factors and peaks.

use crate::report::estimate::posterior;
use crate::report::html::table::{list, table};
use crate::report::words;
use crate::study::answers::Answers;
use crate::study::estimate::{Estimated, Profile};
use crate::study::posterior::Posterior;

pub(in crate::report::estimate) fn posterior(answers: &Answers, found: &Estimated, outcome: &Posterior) -> String {
    let profile = |place: usize| -> Option<&Profile> { found.profiles.iter().find(|profile| profile.factor == place) };
    let rows: Vec<Vec<String>> = (outcome.marginals.iter().zip(&found.factors).enumerate())
        .map(|(place, (marginal, estimand))| {
            let (low, high) = marginal.interval;
            let by_profile = profile(place).map(|found| words::profiled(found.interval, estimand.bounds));
            vec![
                estimand.factor.name.clone(),
                format!("{:.4}", marginal.median),
                format!("{low:.3} to {high:.3}"),
                words::interval(found.intervals[place], estimand.bounds),
                by_profile.unwrap_or("-".to_owned()),
                words::significant(marginal.mixing.r_hat, 3),
                words::significant(marginal.mixing.autocorrelation_moves, 2),
                words::significant(marginal.mixing.effective_draws, 2),
            ]
        })
        .collect();
    let mut peaks = Vec::new();
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        for (sensor, foreseen) in of.sensors.iter().enumerate() {
            let [parameters, discrepancy] = [&foreseen.parameters, &foreseen.discrepancy].map(|band| {
                let [low_k, _, high_k] = band.peak_k;
                format!("{} to {}", words::grouped(low_k, 1), words::grouped(high_k, 1))
            });
            let coverage = foreseen.held.map_or("-".to_owned(), |(_, share)| words::percent(share));
            peaks.push(vec![
                answers.sensor(case, sensor),
                if posterior::is_fitted(case, sensor) { "yes" } else { "no" }.to_owned(),
                words::grouped(foreseen.parameters.peak_k[1], 1),
                parameters,
                discrepancy,
                coverage,
            ]);
        }
    }
    let used = posterior::apart(found, outcome).unwrap_or_else(posterior::agreeing);
    let text = [posterior::walked(outcome), used, posterior::lacking(outcome)];
    let head = [
        "Factor",
        "Median",
        "95 % interval",
        "Linear interval",
        "Profile interval",
        "R-hat",
        "Autocorrelation time, iterations",
        "Effective sample size",
    ];
    let peak = ["Sensor", "Fitted", "Median, K", "Factors only, K", "With model discrepancy, K", "Coverage"];
    list(&text)
        + &table("Posterior of the factors", &head, &rows)
        + &table("Peaks, 95 % predictive intervals", &peak, &peaks)
}
