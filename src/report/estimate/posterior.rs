//! The posterior of the estimated factors: sentences, warnings and tables.

mod figures;
mod page;
mod record;

pub(super) use figures::figures;
pub(super) use page::posterior as page;
pub(super) use record::PosteriorRecord;

use crate::case::Case;
use crate::fit::ChainDiagnostics;
use crate::report::figures::file_name;
use crate::report::files::table::{NamedFile, Names, Table};
use crate::report::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::estimate::{Estimand, ParameterEstimates};
use crate::study::posterior::{Posterior, PosteriorMarginal, PosteriorPredictive, PredictiveBand, SensorPredictive};

/// Settings and convergence of the Markov chains.
pub(super) fn mcmc_summary(outcome: &Posterior) -> String {
    let converged = if outcome.has_converged() { "converged" } else { "NOT converged" };
    format!(
        "Ensemble MCMC with {} from between the bounds and {}, {} of them burn-in ({} of annealing); acceptance rate \
         {}. Largest R-hat {} (limit {}): {converged}. Effective sample size {}.",
        format::counted(outcome.walkers.number, "walker"),
        format::counted(outcome.walkers.iterations, "iteration"),
        format::count(outcome.burn_in),
        format::count(outcome.annealing),
        format::percent(outcome.acceptance),
        format::significant(largest_r_hat(outcome), 4),
        ChainDiagnostics::R_HAT_LIMIT,
        format::count(effective_sample_size(outcome)),
    )
}

/// Convergence of the Markov chains on one line.
pub(super) fn mcmc_summary_line(outcome: &Posterior) -> String {
    format!(
        "posterior: R-hat {} ({}), ESS {}, burn-in {} of {}",
        format::significant(largest_r_hat(outcome), 4),
        if outcome.has_converged() { "converged" } else { "NOT converged" },
        format::count(effective_sample_size(outcome)),
        format::count(outcome.burn_in),
        format::count(outcome.walkers.iterations)
    )
}

/// Largest R-hat of all factors.
fn largest_r_hat(outcome: &Posterior) -> f64 {
    outcome.marginals.iter().map(|marginal| marginal.diagnostics.r_hat).fold(0.0, f64::max)
}

/// Smallest effective sample size of all factors.
fn effective_sample_size(outcome: &Posterior) -> usize {
    outcome.marginals.iter().map(|marginal| marginal.diagnostics.effective_draws).fold(f64::INFINITY, f64::min) as usize
}

/// Size and correlation of the model discrepancy.
pub(super) fn model_discrepancy(outcome: &Posterior) -> String {
    let found = outcome.discrepancy;
    if found.share == 0.0 {
        return "No model discrepancy: the residuals do not exceed the standard deviations of the measurement. Both \
                predictive intervals are equal."
            .to_owned();
    }
    let correlation = if found.time_s.is_finite() {
        format!("correlation time {}", format::seconds(found.time_s))
    } else {
        "infinite correlation time".to_owned()
    };
    format!(
        "Model discrepancy (residuals beyond the standard deviations of the measurement): {} root mean square, \
         {correlation}; {} times the effect of the prior standard deviations of the factors.",
        format::temperature_difference(found.amplitude_k),
        format::significant(found.share, 2)
    )
}

/// Both predictive intervals of the peak of the deepest sensor.
pub(super) fn predicted_peak(answers: &Answers, outcome: &Posterior) -> Option<String> {
    let (sensor, of) = (answers.deepest_sensor()?, outcome.predicted.first()?);
    let found = of.sensors.get(sensor)?;
    let within = |[low_k, _, high_k]: [f64; 3]| format!("{} to {}", format::kelvin(low_k), format::kelvin(high_k));
    Some(format!(
        "Peak of {}, 95 % predictive intervals: {} by the factors, {} with model discrepancy.",
        answers.sensor_name(&answers.case, sensor),
        within(found.parameters.peak_k),
        within(found.discrepancy.peak_k)
    ))
}

/// Warnings of chains that have not converged and of a posterior that differs from the estimate.
pub(super) fn posterior_warnings(
    answers: &Answers,
    estimated: &ParameterEstimates,
    outcome: &Posterior,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if !outcome.has_converged() {
        let enough = outcome.recommended_iterations();
        let advice = if enough.is_finite() && enough > outcome.walkers.iterations as f64 {
            format!("About {} MCMC iterations should suffice", format::significant(enough, 2))
        } else {
            "Increase the number of MCMC iterations".to_owned()
        };
        let stuck = if outcome.has_mixed() {
            String::new()
        } else {
            format!(
                ", and walkers move over the posterior in no less than {} iterations",
                format::significant(outcome.autocorrelation_time(), 2)
            )
        };
        warnings.push(format!(
            "The posterior has not converged: R-hat {} (limit {}){stuck}. {advice}; if that does not help, the \
             posterior has several modes between which walkers do not move (see the charts of the chains, and check \
             with several starts).",
            format::significant(largest_r_hat(outcome), 4),
            ChainDiagnostics::R_HAT_LIMIT
        ));
    }
    warnings.extend(estimates_far_from_median(estimated, outcome));
    if outcome.has_lower_objective() {
        warnings.push(format!(
            "The chains found an objective below that of the estimate by {}: the estimate is a local minimum. Search \
             from several starts.",
            format::significant(outcome.objective_decrease, 2)
        ));
    }
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        if of.failed > 0 {
            warnings.push(format!(
                "{} failed in {} and are excluded from its intervals.",
                format::counted(of.failed, "posterior sample"),
                case.id
            ));
        }
        for (sensor, found) in case.sensors.iter().zip(&of.sensors) {
            if found.misses_observations() {
                warnings.push(format!(
                    "{}: only {} of the observations lie in the predictive interval with model discrepancy; an effect \
                     that no factor resembles acts there.",
                    sensor.name,
                    format::percent(found.coverage.map_or(f64::NAN, |(_, coverage)| coverage))
                ));
            }
        }
    }
    warnings
}

/// Estimates that are far from the posterior median, and which of the two to use.
fn estimates_far_from_median(estimated: &ParameterEstimates, outcome: &Posterior) -> Option<String> {
    let each = outcome.marginals.iter().zip(&estimated.factors).zip(&estimated.values);
    let is_apart = |((marginal, _), value): &((&PosteriorMarginal, &Estimand), &f64)| marginal.is_far_from(**value);
    let text = |((marginal, estimand), value): ((&PosteriorMarginal, &Estimand), &f64)| {
        format!("{} (estimate {value:.3}, median {:.3})", estimand.factor.name, marginal.median)
    };
    let text: Vec<String> = each.filter(is_apart).map(text).collect();
    (!text.is_empty()).then(|| {
        format!(
            "Use the posterior median and interval instead of the estimate of {}: the posterior is skewed or truncated \
             by a bound, so that its mode differs from its median.",
            format::list(&text)
        )
    })
}

/// Sentence for estimates that agree with the medians.
pub(super) fn agreement() -> String {
    "Estimates and posterior medians agree within an eighth of the 95 % intervals.".to_owned()
}

/// Whether the observations of a sensor were fitted.
pub(super) fn is_fitted(case: &Case, sensor: usize) -> bool {
    case.fitted_observations().any(|seen| seen.sensor == sensor)
}

/// Coverage of the observations by both predictive intervals.
pub(super) fn coverage(case: &Case, sensor: usize, found: &SensorPredictive) -> String {
    let Some((parameters, discrepancy)) = found.coverage else {
        return "No observations.".to_owned();
    };
    let fitted = if is_fitted(case, sensor) { "fitted" } else { "not fitted" };
    format!(
        "Coverage of the observations in the data window ({fitted}), within two standard deviations of the \
         measurement: {} by the factors, {} with model discrepancy.",
        format::percent(parameters),
        format::percent(discrepancy)
    )
}

/// Posterior samples, and predictive intervals of every sensor of every case.
pub(super) fn tables(
    answers: &Answers,
    found: &ParameterEstimates,
    outcome: &Posterior,
) -> Result<Vec<NamedFile>, ReportError> {
    let names = Names::of_factors(found.factors.iter().map(|factor| &factor.factor.name));
    let samples = samples_table().csv(&names, outcome.draws.iter().map(Vec::as_slice))?;
    let mut tables = vec![samples, chains_table().csv(&names, chain_rows(outcome))?];
    for (which, (case, of)) in answers.cases().zip(&outcome.predicted).enumerate() {
        let name = if which == 0 { "predictive".to_owned() } else { file_name("predictive", &case.id) };
        tables.push(predictive_table().csv_as(&format!("{name}.csv"), &names, predictive_rows(case, of))?);
    }
    Ok(tables)
}

pub(super) fn samples_table<'a>() -> Table<&'a [f64]> {
    Table::<&'a [f64]>::new(&["posterior.csv"], "One row per posterior sample.").numbers(
        "<factor>",
        "–",
        "Value of the factor.",
        |row| row.to_vec(),
    )
}

/// Index of a walker, iteration, and the values.
type ChainRow = (usize, usize, Vec<f64>);

pub(super) fn chains_table() -> Table<ChainRow> {
    Table::<ChainRow>::new(
        &["chains.csv"],
        "Markov chains of a posterior, one row per walker and iteration: at most 8 walkers and 500 iterations \
         of each, with the burn-in.",
    )
    .number("walker", "–", "Index of the walker.", |row| row.0 as f64)
    .number("iteration", "–", "Iteration, counted from 1.", |row| row.1 as f64)
    .numbers("<factor>", "–", "Value of the factor.", |row| row.2.clone())
}

fn chain_rows(outcome: &Posterior) -> impl Iterator<Item = ChainRow> {
    outcome.chains.walkers.iter().enumerate().flat_map(move |(place, &walker)| {
        outcome.chains.iterations.iter().enumerate().map(move |(at, &iteration)| {
            (walker, iteration, outcome.chains.values.iter().map(|traces| traces[place][at]).collect())
        })
    })
}

/// Sensor, its bands, time and index of the instant.
type PredictiveRow<'a> = (&'a str, &'a SensorPredictive, f64, usize);

pub(super) fn predictive_table<'a>() -> Table<PredictiveRow<'a>> {
    fn at(band: &PredictiveBand, instant: usize) -> Vec<f64> {
        vec![band.low_k[instant], band.median_k[instant], band.high_k[instant]]
    }
    Table::<PredictiveRow<'a>>::new(
        &["predictive.csv", "predictive-<case>.csv"],
        "One row per sensor and instant: posterior predictive percentiles.",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("time_s", "s", "Time.", |row| row.2)
    .numbers("p{2.5,50,97.5}_k", "K", "Percentiles from the uncertainty of the factors alone.", |row| {
        at(&row.1.parameters, row.3)
    })
    .numbers("with_discrepancy_p{2.5,50,97.5}_k", "K", "Percentiles with model discrepancy.", |row| {
        at(&row.1.discrepancy, row.3)
    })
}

fn predictive_rows<'a>(case: &'a Case, outcome: &'a PosteriorPredictive) -> impl Iterator<Item = PredictiveRow<'a>> {
    case.sensors.iter().zip(&outcome.sensors).flat_map(|(sensor, found)| {
        let instants = outcome.instants_s.iter().enumerate();
        instants.map(move |(at, &time_s)| (sensor.name.as_str(), found, time_s, at))
    })
}

/// Paragraph on the method.
pub(super) const METHOD: &str = "Posterior: samples of the density exp(-S/2) within the bounds, by ensemble MCMC with \
    differential-evolution moves (ter Braak 2006) from starts between the bounds, with annealing (Ching & Chen 2007). \
    R-hat compares four independent ensembles (Vehtari et al. 2021). S is the scaled objective of estimate and \
    profiles. The model discrepancy is an exponentially correlated process as large as the residuals beyond the \
    standard deviations of the measurement; at each sensor and instant it is proportional to the effect of the prior \
    standard deviations of all factors.";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{marched, warnings};

    fn is_warned_of(outcomes: &marched::Study, text: &str) -> bool {
        warnings::all(&outcomes.answers("estimate")).iter().any(|warning| warning.contains(text))
    }

    #[test]
    fn chains_that_have_not_converged_are_warned_of_with_the_iterations_needed() {
        let mut outcomes = marched::study().with_long_chains();
        assert!(mcmc_summary(&outcomes.posterior).contains("Largest R-hat 1.004 (limit 1.01): converged."));
        assert!(!is_warned_of(&outcomes, "not converged: R-hat"));
        outcomes.posterior.marginals[1].diagnostics.r_hat = 1.04;
        for text in [mcmc_summary(&outcomes.posterior), mcmc_summary_line(&outcomes.posterior)] {
            assert!(text.contains("1.040") && text.contains("NOT converged"), "{text}");
        }
        assert!(is_warned_of(&outcomes, "R-hat 1.040 (limit 1.01). Increase the number of MCMC iterations"));
        outcomes.posterior.marginals[1].diagnostics.autocorrelation_time = 80.0;
        let stuck = "and walkers move over the posterior in no less than 80 iterations. About 1,500 MCMC";
        assert!(is_warned_of(&outcomes, stuck));
    }

    /// Walkers that do not leave their modes: the ensembles agree, but no chain is long enough.
    #[test]
    fn chains_shorter_than_ten_autocorrelation_times_have_not_converged_whatever_r_hat() {
        let mut outcomes = marched::study().with_long_chains();
        assert!(outcomes.posterior.has_converged());
        outcomes.posterior.marginals[0].diagnostics.autocorrelation_time = 38.0;
        assert!(!outcomes.posterior.has_converged() && is_warned_of(&outcomes, "has not converged"));
    }

    #[test]
    fn a_lower_objective_and_a_poor_coverage_are_warned_of() {
        let mut outcomes = marched::study();
        assert!(!is_warned_of(&outcomes, "local minimum") && !is_warned_of(&outcomes, "TC4: only"));
        outcomes.posterior.objective_decrease = 7.3;
        outcomes.posterior.predicted[0].sensors[3].coverage = Some((0.1, 0.31));
        assert!(
            is_warned_of(&outcomes, "by 7.3: the estimate is a local minimum")
                && is_warned_of(&outcomes, "TC4: only 31 % of the observations")
        );
    }

    #[test]
    fn where_median_and_estimate_differ_the_median_is_recommended() {
        let mut outcomes = marched::study();
        assert!(!is_warned_of(&outcomes, "Use the posterior median"));
        let PosteriorMarginal { median, interval: (low, high), .. } = &mut outcomes.posterior.marginals[0];
        *median += 0.5 * (*high - *low);
        let (value, median) = (outcomes.estimated.values[0], *median);
        let expected = format!("instead of the estimate of f_k_INS (estimate {value:.3}, median {median:.3})");
        assert!(is_warned_of(&outcomes, &expected));
    }

    #[test]
    fn the_model_discrepancy_is_reported_in_kelvin_and_seconds_or_as_absent() {
        let mut outcomes = marched::study();
        (outcomes.posterior.discrepancy.share, outcomes.posterior.discrepancy.amplitude_k) = (0.31, 4.2);
        outcomes.posterior.discrepancy.time_s = 8.5;
        let text = model_discrepancy(&outcomes.posterior);
        assert!(
            text.contains("4.2 K") && text.contains("correlation time 8.5 s") && text.contains("0.31 times"),
            "{text}"
        );
        outcomes.posterior.discrepancy.share = 0.0;
        assert!(model_discrepancy(&outcomes.posterior).contains("No model discrepancy"));
    }
}
