//! The posterior of the estimated factors: sentences, warnings and tables.

mod figures;
mod page;
mod record;

pub(super) use figures::figures;
pub(super) use page::posterior as page;
pub(super) use record::PosteriorRecord;

use crate::case::Case;
use crate::fit::Mixing;
use crate::report::figures::file_name;
use crate::report::files::table::File;
use crate::report::files::table::Table;
use crate::report::{ReportError, words};
use crate::study::answers::Answers;
use crate::study::estimate::{Estimand, Estimated};
use crate::study::posterior::{Foreseen, Marginal, Posterior, Predicted};

/// Settings and convergence of the Markov chains.
pub(super) fn walked(outcome: &Posterior) -> String {
    let converged = if outcome.is_settled() { "converged" } else { "NOT converged" };
    format!(
        "Ensemble MCMC with {} and {}, {} of them burn-in; acceptance rate {}. Largest R-hat {} (limit {}): \
         {converged}. Effective sample size {}.",
        words::counted(outcome.walkers.number, "walker"),
        words::counted(outcome.walkers.moves, "iteration"),
        words::count(outcome.burn_in),
        words::percent(outcome.acceptance),
        words::significant(r_hat(outcome), 3),
        words::significant(Mixing::R_HAT, 2),
        words::count(effective(outcome)),
    )
}

/// Convergence of the Markov chains on one line.
pub(super) fn walked_shortly(outcome: &Posterior) -> String {
    format!(
        "posterior: R-hat {} ({}), ESS {}, burn-in {} of {}",
        words::significant(r_hat(outcome), 3),
        if outcome.is_settled() { "converged" } else { "NOT converged" },
        words::count(effective(outcome)),
        words::count(outcome.burn_in),
        words::count(outcome.walkers.moves)
    )
}

/// Largest R-hat of all factors.
fn r_hat(outcome: &Posterior) -> f64 {
    outcome.marginals.iter().map(|marginal| marginal.mixing.r_hat).fold(0.0, f64::max)
}

/// Smallest effective sample size of all factors.
fn effective(outcome: &Posterior) -> usize {
    outcome.marginals.iter().map(|marginal| marginal.mixing.effective_draws).fold(f64::INFINITY, f64::min) as usize
}

/// Size and correlation of the model discrepancy.
pub(super) fn lacking(outcome: &Posterior) -> String {
    let found = outcome.discrepancy;
    if found.share == 0.0 {
        return "No model discrepancy: the residuals do not exceed the standard deviations of the measurement. Both \
                predictive intervals are equal."
            .to_owned();
    }
    let correlation = if found.time_s.is_finite() {
        format!("correlation time {}", words::seconds(found.time_s))
    } else {
        "infinite correlation time".to_owned()
    };
    format!(
        "Model discrepancy (residuals beyond the standard deviations of the measurement): {} root mean square, \
         {correlation}; {} times the effect of the prior standard deviations of the factors.",
        words::misfit(found.amplitude_k),
        words::significant(found.share, 2)
    )
}

/// Both predictive intervals of the peak of the deepest sensor.
pub(super) fn foreseen(answers: &Answers, outcome: &Posterior) -> Option<String> {
    let (sensor, of) = (answers.bondline()?, outcome.predicted.first()?);
    let found = of.sensors.get(sensor)?;
    let within = |[low_k, _, high_k]: [f64; 3]| format!("{} to {}", words::kelvin(low_k), words::kelvin(high_k));
    Some(format!(
        "Peak of {}, 95 % predictive intervals: {} by the factors, {} with model discrepancy.",
        answers.sensor(&answers.case, sensor),
        within(found.parameters.peak_k),
        within(found.discrepancy.peak_k)
    ))
}

/// Warnings.
pub(super) fn doubts(answers: &Answers, estimated: &Estimated, outcome: &Posterior) -> Vec<String> {
    let mut warnings = Vec::new();
    if !outcome.is_settled() {
        let enough = outcome.enough_moves();
        let advice = if enough.is_finite() && enough > outcome.walkers.moves as f64 {
            format!("About {} iterations should suffice (--mcmc-iterations)", words::significant(enough, 2))
        } else {
            "Increase --mcmc-iterations".to_owned()
        };
        warnings.push(format!(
            "The posterior has not converged: R-hat {} (limit {}). {advice}; if R-hat stays high, the posterior has \
             several modes (check with --starts).",
            words::significant(r_hat(outcome), 3),
            words::significant(Mixing::R_HAT, 2)
        ));
    }
    warnings.extend(apart(estimated, outcome));
    if outcome.gain > GAIN {
        warnings.push(format!(
            "The chains found an objective below that of the estimate by {}: the estimate is a local minimum. Search \
             with --starts.",
            words::significant(outcome.gain, 2)
        ));
    }
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        if of.failed > 0 {
            warnings.push(format!(
                "{} failed in {} and are excluded from its intervals.",
                words::counted(of.failed, "posterior sample"),
                case.id
            ));
        }
        for (sensor, found) in case.sensors.iter().zip(&of.sensors) {
            if found.held.is_some_and(|(_, coverage)| coverage < HELD) {
                warnings.push(format!(
                    "{}: only {} of the observations lie in the predictive interval with model discrepancy; an effect \
                     that no factor resembles acts there.",
                    sensor.name,
                    words::percent(found.held.map_or(f64::NAN, |(_, coverage)| coverage))
                ));
            }
        }
    }
    warnings
}

/// Estimates that are far from the posterior median, and which of the two to use.
fn apart(estimated: &Estimated, outcome: &Posterior) -> Option<String> {
    let each = outcome.marginals.iter().zip(&estimated.factors).zip(&estimated.values);
    let is_apart = |((marginal, _), value): &((&Marginal, &Estimand), &f64)| {
        let (low, high) = marginal.interval;
        (marginal.median - **value).abs() > APART * (high - low)
    };
    let text = |((marginal, estimand), value): ((&Marginal, &Estimand), &f64)| {
        format!("{} (estimate {value:.3}, median {:.3})", estimand.factor.name, marginal.median)
    };
    let text: Vec<String> = each.filter(is_apart).map(text).collect();
    (!text.is_empty()).then(|| {
        format!(
            "Use the posterior median and interval instead of the estimate of {}: the posterior is skewed or truncated \
             by a bound, so that its mode differs from its median.",
            words::listed(&text)
        )
    })
}

/// Sentence for estimates that agree with the medians.
pub(super) fn agreeing() -> String {
    "Estimates and posterior medians agree within an eighth of the 95 % intervals.".to_owned()
}

/// Difference of median and estimate, in widths of the 95 % interval, that is warned of: half a standard deviation of
/// a normal posterior.
const APART: f64 = 0.125;
/// Fall of the scaled objective that is warned of: the rise at one standard error. Less may be rounding.
const GAIN: f64 = 1.0;
/// Coverage of a trace that is warned of. Samples are autocorrelated, so that the coverage of a single trace by a valid
/// 95 % band varies widely.
const HELD: f64 = 0.5;

/// Whether the observations of a sensor were fitted.
pub(super) fn is_fitted(case: &Case, sensor: usize) -> bool {
    case.judges().any(|seen| seen.sensor == sensor)
}

/// Coverage of the observations by both predictive intervals.
pub(super) fn held(case: &Case, sensor: usize, found: &Foreseen) -> String {
    let Some((parameters, discrepancy)) = found.held else {
        return "No observations.".to_owned();
    };
    let fitted = if is_fitted(case, sensor) { "fitted" } else { "not fitted" };
    format!(
        "Coverage of the observations in the data window ({fitted}), within two standard deviations of the \
         measurement: {} by the factors, {} with model discrepancy.",
        words::percent(parameters),
        words::percent(discrepancy)
    )
}

/// Posterior samples, and predictive intervals of every sensor of every case.
pub(super) fn tables(answers: &Answers, found: &Estimated, outcome: &Posterior) -> Result<Vec<File>, ReportError> {
    let mut tables = vec![draws(found, outcome)?];
    for (which, (case, of)) in answers.cases().zip(&outcome.predicted).enumerate() {
        let name = if which == 0 { "predictive".to_owned() } else { file_name("predictive", &case.id) };
        tables.push(predictive(&format!("{name}.csv"), case, of)?);
    }
    Ok(tables)
}

fn draws(found: &Estimated, outcome: &Posterior) -> Result<File, ReportError> {
    let names = found.factors.iter().map(|factor| factor.factor.name.clone());
    let mut table = Table::new("posterior.csv", names)?;
    for draw in &outcome.draws {
        table.row(None, draw.iter().copied())?;
    }
    table.close()
}

fn predictive(name: &str, case: &Case, outcome: &Predicted) -> Result<File, ReportError> {
    let columns =
        ["p2.5_K", "p50_K", "p97.5_K", "with_discrepancy_p2.5_K", "with_discrepancy_p50_K", "with_discrepancy_p97.5_K"];
    let mut table = Table::new(name, ["sensor", "time_s"].into_iter().chain(columns))?;
    for (sensor, found) in case.sensors.iter().zip(&outcome.sensors) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let of = [&found.parameters, &found.discrepancy];
            let curves = of.iter().flat_map(|band| [band.low_k[at], band.median_k[at], band.high_k[at]]);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(curves))?;
        }
    }
    table.close()
}

/// Paragraph on the method.
pub(super) const METHOD: &str = "Posterior: samples of the density exp(-S/2) within the bounds, by ensemble MCMC with \
    differential-evolution moves (ter Braak 2006). S is the scaled objective of estimate and profiles. The model \
    discrepancy is an exponentially correlated process as large as the residuals beyond the standard deviations of the \
    measurement; at each sensor and instant it is proportional to the effect of the prior standard deviations of all \
    factors.";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{fixture, warnings};

    fn is_warned_of(outcomes: &fixture::Outcomes, text: &str) -> bool {
        warnings::all(&outcomes.answers("estimate")).iter().any(|warning| warning.contains(text))
    }

    #[test]
    fn chains_that_have_not_converged_are_warned_of_with_the_iterations_needed() {
        let mut outcomes = fixture::outcomes();
        assert!(walked(&outcomes.posterior).contains("Largest R-hat 1.05 (limit 1.1): converged."));
        assert!(!is_warned_of(&outcomes, "not converged: R-hat"));
        outcomes.posterior.marginals[1].mixing.r_hat = 1.31;
        outcomes.posterior.marginals[1].mixing.autocorrelation_moves = 80.0;
        assert!(walked(&outcomes.posterior).contains("NOT converged"));
        assert!(is_warned_of(&outcomes, "R-hat 1.31 (limit 1.1). About 1,500 iterations should suffice"));
    }

    #[test]
    fn a_lower_objective_and_a_poor_coverage_are_warned_of() {
        let mut outcomes = fixture::outcomes();
        assert!(!is_warned_of(&outcomes, "local minimum") && !is_warned_of(&outcomes, "TC4: only"));
        outcomes.posterior.gain = 7.3;
        outcomes.posterior.predicted[0].sensors[3].held = Some((0.1, 0.31));
        assert!(
            is_warned_of(&outcomes, "by 7.3: the estimate is a local minimum")
                && is_warned_of(&outcomes, "TC4: only 31 % of the observations")
        );
    }

    #[test]
    fn where_median_and_estimate_differ_the_median_is_recommended() {
        let mut outcomes = fixture::outcomes();
        assert!(!is_warned_of(&outcomes, "Use the posterior median"));
        outcomes.posterior.marginals[0].median += 0.02;
        assert!(is_warned_of(&outcomes, "instead of the estimate of f_k_INS (estimate 0.970, median 0.988)"));
    }

    #[test]
    fn the_model_discrepancy_is_reported_in_kelvin_and_seconds_or_as_absent() {
        let mut outcomes = fixture::outcomes();
        let text = lacking(&outcomes.posterior);
        assert!(
            text.contains("4.2 K") && text.contains("correlation time 8.5 s") && text.contains("0.31 times"),
            "{text}"
        );
        outcomes.posterior.discrepancy.share = 0.0;
        assert!(lacking(&outcomes.posterior).contains("No model discrepancy"));
    }
}
