//! The section of the posterior: convergence, factors and peaks.

use crate::report::estimate::posterior;
use crate::report::format;
use crate::report::html::table::{list, table};
use crate::study::answers::Answers;
use crate::study::estimate::{ParameterEstimates, Profile};
use crate::study::posterior::Posterior;

pub(in crate::report::estimate) fn posterior(
    answers: &Answers,
    found: &ParameterEstimates,
    outcome: &Posterior,
) -> String {
    let profile = |place: usize| -> Option<&Profile> { found.profiles.iter().find(|profile| profile.factor == place) };
    let rows: Vec<Vec<String>> = (outcome.marginals.iter().zip(&found.factors).enumerate())
        .map(|(place, (marginal, estimand))| {
            let (low, high) = marginal.interval;
            let by_profile = profile(place).map(|found| format::profile_interval(found.interval, estimand.bounds));
            vec![
                estimand.factor.name.clone(),
                format!("{:.4}", marginal.median),
                format!("{low:.3} to {high:.3}"),
                format::interval(found.intervals[place], estimand.bounds),
                by_profile.unwrap_or("-".to_owned()),
                format::significant(marginal.diagnostics.r_hat, 4),
                format::significant(marginal.diagnostics.autocorrelation_time, 2),
                format::significant(marginal.diagnostics.effective_draws, 2),
            ]
        })
        .collect();
    let mut peaks = Vec::new();
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        for (sensor, foreseen) in of.sensors.iter().enumerate() {
            let [parameters, discrepancy] = [&foreseen.parameters, &foreseen.discrepancy].map(|band| {
                let [low_k, _, high_k] = band.peak_k;
                format!("{} to {}", format::grouped(low_k, 1), format::grouped(high_k, 1))
            });
            let coverage = foreseen.coverage.map_or("-".to_owned(), |(_, share)| format::percent(share));
            peaks.push(vec![
                answers.sensor_name(case, sensor),
                if posterior::is_fitted(case, sensor) { "yes" } else { "no" }.to_owned(),
                format::grouped(foreseen.parameters.peak_k[1], 1),
                parameters,
                discrepancy,
                coverage,
            ]);
        }
    }
    let used = posterior::estimates_far_from_median(found, outcome).unwrap_or_else(posterior::agreement);
    let text = [posterior::mcmc_summary(outcome), used, posterior::model_discrepancy(outcome)];
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
