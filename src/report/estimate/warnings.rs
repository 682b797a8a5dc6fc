//! Reasons to doubt an estimate.

use crate::report::warnings::{CONDITION, excursions, march};
use crate::report::words;
use crate::study::answers::Answers;
use crate::study::estimate::Estimated;

/// Beyond this ratio stated deviations and residuals disagree.
const DISAGREE: f64 = 2.0;
/// Residuals whose neighbours correlate so are a pattern, not noise.
const AUTOCORRELATION: f64 = 0.5;

pub(super) fn all(answers: &Answers, outcome: &Estimated) -> Vec<String> {
    let mut doubts = Vec::new();
    if let (None, Some(fitted)) = (&answers.nominal, outcome.fitted.first()) {
        doubts.extend(march(&answers.case, &fitted.before, "nominal"));
    }
    estimates(answers, outcome, &mut doubts);
    for (case, fitted) in answers.fits(outcome) {
        doubts.extend(march(case, &fitted.after, "fitted"));
    }
    for (case, fitted) in answers.fits(outcome).skip(1) {
        doubts.extend(march(case, &fitted.before, "nominal"));
        doubts.extend(excursions(case, &[&fitted.before, &fitted.after]));
    }
    doubts
}

fn estimates(answers: &Answers, outcome: &Estimated, doubts: &mut Vec<String>) {
    if !outcome.converged {
        doubts.push(format!("The estimate did not converge ({}). {}", outcome.termination, outcome.advice));
    }
    for (index, factor) in outcome.factors.iter().enumerate() {
        let (low, high) = factor.bounds;
        if outcome.at_bound[index] {
            doubts.push(format!(
                "{} stands on its bound at {:.3} (allowed {low:.2} to {high:.2}): the data want it beyond, or the \
                 model lacks something.",
                factor.factor.name, outcome.values[index]
            ));
        }
    }
    combinations(outcome, doubts);
    let set = &outcome.identifiability;
    if set.condition_number > CONDITION {
        doubts.push(format!(
            "The estimate is ill-conditioned (condition number {}). The weakest direction: {}.",
            words::condition(set.condition_number),
            set.weakest
        ));
    }
    let ratio = outcome.noise_variance.sqrt();
    if ratio > DISAGREE || (ratio < 1.0 / DISAGREE && is_seen(answers, outcome)) {
        let used = if outcome.prior.is_some() {
            format!(
                " Beside the priors the data count with {} times their deviations.",
                words::significant(outcome.shortfall, 2)
            )
        } else {
            String::new()
        };
        doubts.push(format!(
            "Stated deviations and residuals disagree: the residuals are {} times as large.{used}",
            words::significant(ratio, 2)
        ));
    }
    if outcome.autocorrelation > AUTOCORRELATION && is_seen(answers, outcome) {
        doubts.push(format!(
            "The residuals are not noise: neighbours correlate by {}, so {} carry the information of {}. The model \
             lacks something; standard errors and intervals allow for it.",
            words::significant(outcome.autocorrelation, 2),
            words::counted(outcome.samples, "sample"),
            words::significant(outcome.effective_samples, 2)
        ));
    }
}

/// Whether residuals are large enough to matter: a tenth of the standard deviation of the measurement, at one sensor
/// at least. Data made without noise leave rounding, and rounding has patterns.
fn is_seen(answers: &Answers, outcome: &Estimated) -> bool {
    answers.fits(outcome).any(|(case, fitted)| {
        let seen = case.observations.iter().filter(|seen| fitted.sensors.contains(&seen.sensor));
        seen.zip(&fitted.misfits).any(|(seen, (_, after))| {
            let finest_k = seen.sigma_k.iter().copied().fold(f64::INFINITY, f64::min);
            after.rms_k > 0.1 * finest_k
        })
    })
}

/// Estimates that stand in each other's way, and what the data determine in their place.
fn combinations(outcome: &Estimated, doubts: &mut Vec<String>) {
    let name = |place: usize| outcome.factors[place].factor.name.as_str();
    for found in &outcome.combinations {
        let (first, second) = (name(found.pair.0), name(found.pair.1));
        let correlate = format!(
            "The estimates of {first} and {second} correlate by {}: neither stands alone.",
            words::significant(found.correlation, 3)
        );
        let (noun, sign) = if found.is_ratio { ("ratio", "/") } else { ("product", "·") };
        doubts.push(if found.relative_error.is_finite() {
            format!(
                "{correlate} Their {noun} {first}{sign}{second}, {} ± {} %, is what the data determine.",
                words::significant(found.value, 3),
                words::significant(100.0 * found.relative_error, 1)
            )
        } else {
            format!("{correlate} The data determine their {noun} alone.")
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::report::{fixture, warnings};
    use crate::traces::Arrival;

    /// How many doubts of a study say this.
    fn saying(outcomes: &fixture::Outcomes, text: &str) -> usize {
        warnings::all(&outcomes.answers("study")).iter().filter(|doubt| doubt.contains(text)).count()
    }

    #[test]
    fn each_fault_of_an_estimate_is_doubted_once_and_a_sound_one_not_at_all() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "correlate by 0.993"), 1);
        assert_eq!(saying(&outcomes, "Their ratio f_k_INS/f_cp_INS, 0.951 ± 0.3 %, is what the data determine."), 1);
        assert_eq!(saying(&outcomes, "not noise"), 1);
        for fault in ["bound", "converge", "ill-conditioned", "balance", "ran away"] {
            assert_eq!(saying(&outcomes, fault), 0, "{fault}");
        }
        outcomes.estimated.at_bound[0] = true;
        outcomes.estimated.converged = false;
        outcomes.estimated.identifiability.condition_number = 400.0;
        outcomes.estimated.fitted[0].after.arrival = Arrival::Strayed { time_s: 12.0 };
        outcomes.nominal.balance.back_out_j_m2 *= 1.2;
        for fault in ["bound", "converge", "ill-conditioned", "balance", "ran away"] {
            assert_eq!(saying(&outcomes, fault), 1, "{fault}");
        }
    }

    #[test]
    fn stated_deviations_that_the_residuals_belie_are_doubted_and_beside_priors_their_weight_is_stated() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "the residuals are 2.1 times as large."), 1);
        assert_eq!(saying(&outcomes, "Beside the priors"), 0, "there are none");
        outcomes.estimated.prior = Some(crate::case::Bounds::Small);
        assert_eq!(saying(&outcomes, "the data count with 3.3 times their deviations"), 1);
        for (variance, doubts) in [(1.2, 0), (0.1, 1)] {
            outcomes.estimated.noise_variance = variance;
            assert_eq!(saying(&outcomes, "deviations and residuals disagree"), doubts, "{variance}");
        }
    }

    #[test]
    fn of_two_estimates_that_oppose_each_other_the_product_is_determined() {
        let mut outcomes = fixture::outcomes();
        let combination = &mut outcomes.estimated.combinations[0];
        (combination.is_ratio, combination.correlation, combination.value) = (false, -0.993, 0.9894);
        assert_eq!(saying(&outcomes, "Their product f_k_INS·f_cp_INS, 0.989 ± 0.3 %, is what"), 1);
        outcomes.estimated.combinations[0].relative_error = f64::NAN;
        assert_eq!(saying(&outcomes, "The data determine their product alone."), 1);
        outcomes.estimated.combinations.clear();
        assert_eq!(saying(&outcomes, "correlate by -0.993"), 0);
    }

    #[test]
    fn the_pattern_of_what_rounding_leaves_is_no_doubt() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "not noise"), 1);
        for (_, after) in &mut outcomes.estimated.fitted[0].misfits {
            after.rms_k = 1e-6;
        }
        assert_eq!(saying(&outcomes, "not noise"), 0);
    }
}
