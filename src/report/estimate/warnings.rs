//! Warnings about an estimate.

use crate::fit::ILL_CONDITIONED;
use crate::report::format;
use crate::report::warnings::{march_warnings, table_excursions};
use crate::study::answers::Answers;
use crate::study::estimate::ParameterEstimates;

pub(super) fn all(answers: &Answers, outcome: &ParameterEstimates) -> Vec<String> {
    let mut warnings = Vec::new();
    if let (None, Some(fitted)) = (&answers.nominal, outcome.fitted.first()) {
        warnings.extend(march_warnings(&answers.case, &fitted.before, "nominal"));
    }
    estimate_warnings(outcome, &mut warnings);
    for (case, fitted) in answers.fits(outcome) {
        warnings.extend(march_warnings(case, &fitted.after, "fitted"));
    }
    for (case, fitted) in answers.fits(outcome).skip(1) {
        warnings.extend(march_warnings(case, &fitted.before, "nominal"));
        warnings.extend(table_excursions(case, &[&fitted.before, &fitted.after]));
    }
    warnings
}

fn estimate_warnings(outcome: &ParameterEstimates, warnings: &mut Vec<String>) {
    if !outcome.converged {
        warnings.push(format!("The estimate did not converge ({}). {}", outcome.termination, outcome.advice));
    }
    for (index, factor) in outcome.factors.iter().enumerate() {
        let (low, high) = factor.bounds;
        if outcome.at_bound[index] {
            warnings.push(format!(
                "The estimate of {} is on its bound, {:.3} (bounds {low:.2} to {high:.2}): the optimum is beyond it, \
                 or the model is incomplete.",
                factor.factor.name, outcome.values[index]
            ));
        }
    }
    combination_warnings(outcome, warnings);
    let set = &outcome.identifiability;
    if set.condition_number > ILL_CONDITIONED {
        warnings.push(format!(
            "The estimate is ill-conditioned (condition number {}). Least determined direction: {}.",
            format::condition_number(set.condition_number),
            set.weakest_direction
        ));
    }
    let ratio = outcome.noise_variance.sqrt();
    if outcome.scatters_unlike_stated() {
        let used = if outcome.prior.is_some() {
            format!(
                " Against the priors the data are weighted with {} times their stated standard deviations.",
                format::significant(outcome.noise_inflation, 2)
            )
        } else {
            String::new()
        };
        warnings.push(format!(
            "The residuals are {} times the stated standard deviations.{used}",
            format::significant(ratio, 2)
        ));
    }
    if outcome.has_correlated_residuals() {
        warnings.push(format!(
            "The residuals are autocorrelated ({} at lag one): effective sample size {} of {}. Standard errors and \
             intervals account for correlated noise, not for an error of the model that resembles the effect of a \
             factor: of synthetic data with one, 95 % intervals hold the truth in 69 %.",
            format::significant(outcome.autocorrelation, 2),
            format::significant(outcome.effective_samples, 2),
            format::count(outcome.samples)
        ));
    }
    if outcome.correlates_over_traces() {
        warnings.push(format!(
            "The residuals correlate over {}, and the longest trace is {}: errors that slow cannot be told from the \
             signal, and the intervals are too short. Of synthetic data with such noise, 95 % intervals hold the \
             truth in 79 to 92 %. Fit a longer window, or add what the model lacks.",
            format::seconds(outcome.correlation_time_s),
            format::seconds(outcome.longest_trace_s())
        ));
    }
}

/// Pairs of estimates that the data cannot separate, and the combination that they determine.
fn combination_warnings(outcome: &ParameterEstimates, warnings: &mut Vec<String>) {
    let name = |place: usize| outcome.factors[place].factor.name.as_str();
    for found in &outcome.combinations {
        let (first, second) = (name(found.pair.0), name(found.pair.1));
        let correlate = format!(
            "The estimates of {first} and {second} have correlation {} and cannot be separated.",
            format::significant(found.correlation, 3)
        );
        let (noun, sign) = if found.is_ratio { ("ratio", "/") } else { ("product", "·") };
        warnings.push(if found.relative_error.is_finite() {
            format!(
                "{correlate} The data determine their {noun} {first}{sign}{second}: {} ± {} %.",
                format::significant(found.value, 3),
                format::significant(100.0 * found.relative_error, 1)
            )
        } else {
            format!("{correlate} The data determine only their {noun}.")
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::report::{marched, warnings};
    use crate::traces::MemberStatus;

    /// Number of warnings of a study that contain a text.
    fn count_of(outcomes: &marched::Study, text: &str) -> usize {
        warnings::all(&outcomes.answers("study")).iter().filter(|warning| warning.contains(text)).count()
    }

    /// Estimates that correlate by 0.993, and residuals of 2.1 times their stated deviation that correlate by 0.62.
    fn correlated() -> marched::Study {
        let mut outcomes = marched::study().with_long_chains();
        let combination = &mut outcomes.estimated.combinations[0];
        (combination.pair, combination.is_ratio, combination.correlation) = ((0, 1), true, 0.993);
        (combination.value, combination.relative_error) = (0.97 / 1.02, 0.003);
        (outcomes.estimated.autocorrelation, outcomes.estimated.correlation_probability) = (0.62, 1.0);
        (outcomes.estimated.noise_variance, outcomes.estimated.noise_inflation) = (4.4, 3.3);
        outcomes.estimated.identifiability.condition_number = 17.0;
        outcomes
    }

    #[test]
    fn each_fault_of_an_estimate_is_warned_of_once() {
        let mut outcomes = correlated();
        assert_eq!(count_of(&outcomes, "have correlation 0.993"), 1);
        assert_eq!(count_of(&outcomes, "The data determine their ratio f_k_INS/f_cp_INS: 0.951 ± 0.3 %."), 1);
        assert_eq!(count_of(&outcomes, "autocorrelated"), 1);
        for fault in ["bound", "converge", "ill-conditioned", "balance", "diverged"] {
            assert_eq!(count_of(&outcomes, fault), 0, "{fault}");
        }
        outcomes.estimated.at_bound[0] = true;
        outcomes.estimated.converged = false;
        outcomes.estimated.identifiability.condition_number = 400.0;
        outcomes.estimated.fitted[0].after.status = MemberStatus::Diverged { time_s: 12.0 };
        outcomes.nominal.balance.hot_out_j_m2 *= 1.2;
        for fault in ["bound", "converge", "ill-conditioned", "balance", "diverged"] {
            assert_eq!(count_of(&outcomes, fault), 1, "{fault}");
        }
    }

    #[test]
    fn residuals_unlike_their_stated_deviations_are_warned_of_with_the_weight_of_the_data_against_priors() {
        let mut outcomes = correlated();
        assert_eq!(count_of(&outcomes, "The residuals are 2.1 times the stated standard deviations."), 1);
        assert_eq!(count_of(&outcomes, "Against the priors"), 0, "there are none");
        outcomes.estimated.prior = Some(crate::case::Bounds::Small);
        assert_eq!(count_of(&outcomes, "the data are weighted with 3.3 times their stated standard deviations"), 1);
        for (variance, warnings) in [(1.2, 0), (0.1, 1)] {
            outcomes.estimated.noise_variance = variance;
            assert_eq!(count_of(&outcomes, "times the stated standard deviations."), warnings, "{variance}");
        }
    }

    #[test]
    fn of_two_estimates_with_negative_correlation_the_product_is_determined() {
        let mut outcomes = correlated();
        let combination = &mut outcomes.estimated.combinations[0];
        (combination.is_ratio, combination.correlation, combination.value) = (false, -0.993, 0.9894);
        assert_eq!(count_of(&outcomes, "The data determine their product f_k_INS·f_cp_INS: 0.989 ± 0.3 %"), 1);
        outcomes.estimated.combinations[0].relative_error = f64::NAN;
        assert_eq!(count_of(&outcomes, "The data determine only their product."), 1);
        outcomes.estimated.combinations.clear();
        assert_eq!(count_of(&outcomes, "have correlation -0.993"), 0);
    }

    /// The limit is half of the longest trace.
    #[test]
    fn a_correlation_time_comparable_to_the_run_is_warned_of_as_the_intervals_are_too_short() {
        let mut outcomes = correlated();
        assert_eq!(outcomes.estimated.longest_trace_s(), 200.0);
        assert_eq!(count_of(&outcomes, "the intervals are too short"), 0);
        outcomes.estimated.correlation_time_s = 95.0;
        assert_eq!(count_of(&outcomes, "the intervals are too short"), 0);
        outcomes.estimated.correlation_time_s = 110.0;
        assert_eq!(count_of(&outcomes, "correlate over 110 s, and the longest trace is 200 s"), 1);
    }

    #[test]
    fn autocorrelated_rounding_errors_are_not_warned_of() {
        let mut outcomes = correlated();
        assert_eq!(count_of(&outcomes, "autocorrelated"), 1);
        for (_, after) in &mut outcomes.estimated.fitted[0].misfits {
            after.rms_k = 1e-6;
        }
        assert_eq!(count_of(&outcomes, "autocorrelated"), 0);
    }

    #[test]
    fn residuals_that_seem_correlated_are_warned_of_whatever_their_correlation_at_lag_one() {
        let mut outcomes = correlated();
        (outcomes.estimated.autocorrelation, outcomes.estimated.correlation_probability) = (0.3, 0.4);
        assert_eq!(count_of(&outcomes, "autocorrelated (0.30 at lag one)"), 1);
        outcomes.estimated.correlation_probability = 0.2;
        assert_eq!(count_of(&outcomes, "autocorrelated"), 0);
    }
}
