//! A posterior in sentences, for the page and the screen.

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

/// How the walkers went and whether they have been everywhere.
pub(super) fn walked(outcome: &Posterior) -> String {
    let settled = if outcome.is_settled() { "they have been everywhere" } else { "they have NOT been everywhere" };
    format!(
        "{} made {}, the first {} of which do not count; {} of what they proposed was taken. R-hat is {} at most, where {} is \
         the limit: {settled}. What they drew is worth {}.",
        words::counted(outcome.walkers.number, "walker"),
        words::counted(outcome.walkers.moves, "move"),
        words::count(outcome.burn_in),
        words::percent(outcome.acceptance),
        words::significant(r_hat(outcome), 3),
        words::significant(Mixing::R_HAT, 2),
        words::counted(effective(outcome), "independent draw"),
    )
}

/// The same on a line.
pub(super) fn walked_shortly(outcome: &Posterior) -> String {
    format!(
        "posterior: R-hat {} ({}), {}, burn-in {} of {}",
        words::significant(r_hat(outcome), 3),
        if outcome.is_settled() { "settled" } else { "NOT settled" },
        words::counted(effective(outcome), "effective draw"),
        words::count(outcome.burn_in),
        words::count(outcome.walkers.moves)
    )
}

/// The largest R-hat of a factor.
fn r_hat(outcome: &Posterior) -> f64 {
    outcome.marginals.iter().map(|marginal| marginal.mixing.r_hat).fold(0.0, f64::max)
}

/// Draws that those of the factor with the fewest are worth.
fn effective(outcome: &Posterior) -> usize {
    outcome.marginals.iter().map(|marginal| marginal.mixing.effective_draws).fold(f64::INFINITY, f64::min) as usize
}

/// What the model lacks.
pub(super) fn lacking(outcome: &Posterior) -> String {
    let found = outcome.discrepancy;
    if found.share == 0.0 {
        return "What the fit leaves is no more than the readings' own deviations: nothing is seen that the model lacks, and \
                the band with its discrepancy is the one without."
            .to_owned();
    }
    let keeps = if found.time_s.is_finite() {
        format!("forgets itself over {}", words::seconds(found.time_s))
    } else {
        "does not forget itself".to_owned()
    };
    format!(
        "What the fit leaves beyond the readings' own deviations, {} (root mean square), is an error of the model that {keeps}: \
         worth as much as if the factors were off by {} of the standard deviations that they are doubted by.",
        words::misfit(found.amplitude_k),
        words::significant(found.share, 2)
    )
}

/// The peak of the deepest sensor by both bands.
pub(super) fn foreseen(answers: &Answers, outcome: &Posterior) -> Option<String> {
    let (sensor, of) = (answers.bondline()?, outcome.predicted.first()?);
    let found = of.sensors.get(sensor)?;
    let within = |[low_k, _, high_k]: [f64; 3]| format!("{} and {}", words::kelvin(low_k), words::kelvin(high_k));
    Some(format!(
        "The peak of {} lies between {} by what is known of the factors, and between {} with what the model lacks (95 % each).",
        answers.sensor(&answers.case, sensor),
        within(found.parameters.peak_k),
        within(found.discrepancy.peak_k)
    ))
}

/// What an analyst should doubt.
pub(super) fn doubts(answers: &Answers, estimated: &Estimated, outcome: &Posterior) -> Vec<String> {
    let mut doubts = Vec::new();
    if !outcome.is_settled() {
        let enough = outcome.enough_moves();
        let advice = if enough.is_finite() && enough > outcome.walkers.moves as f64 {
            format!("Some {} moves should do (--moves)", words::significant(enough, 2))
        } else {
            "Give more moves (--moves)".to_owned()
        };
        doubts.push(format!(
            "The posterior is not settled: R-hat is {}, where {} is the limit. {advice}; walkers that still differ then are in \
             minima of their own (--starts tells).",
            words::significant(r_hat(outcome), 3),
            words::significant(Mixing::R_HAT, 2)
        ));
    }
    doubts.extend(apart(estimated, outcome));
    if outcome.gain > GAIN {
        doubts.push(format!(
            "Walkers met a point that meets data and priors better than the estimate, by {} squares of a standard error: there \
             is a lower minimum. Look for it with --starts.",
            words::significant(outcome.gain, 2)
        ));
    }
    for (case, of) in answers.cases().zip(&outcome.predicted) {
        if of.failed > 0 {
            doubts.push(format!(
                "{} of what was drawn did not arrive in {}, and is left out of its bands.",
                words::counted(of.failed, "member"),
                case.id
            ));
        }
        for (sensor, found) in case.sensors.iter().zip(&of.sensors) {
            if found.held.is_some_and(|(_, held)| held < HELD) {
                doubts.push(format!(
                    "The band of {} holds {} of what was observed there, even with what the model lacks: something acts there \
                     that none of the factors resembles.",
                    sensor.name,
                    words::percent(found.held.map_or(f64::NAN, |(_, held)| held))
                ));
            }
        }
    }
    doubts
}

/// Which estimates lie far from the median of the posterior, and which of the two to use.
fn apart(estimated: &Estimated, outcome: &Posterior) -> Option<String> {
    let each = outcome.marginals.iter().zip(&estimated.factors).zip(&estimated.values);
    let is_apart = |((marginal, _), value): &((&Marginal, &Estimand), &f64)| {
        let (low, high) = marginal.interval;
        (marginal.median - **value).abs() > APART * (high - low)
    };
    let said = |((marginal, estimand), value): ((&Marginal, &Estimand), &f64)| {
        format!("{} (estimate {value:.3}, median {:.3})", estimand.factor.name, marginal.median)
    };
    let said: Vec<String> = each.filter(is_apart).map(said).collect();
    (!said.is_empty()).then(|| {
        format!(
            "Use the posterior's median and interval, not the estimate, of {}: the posterior is skewed or cut off by a bound, \
             so its highest point is not its middle.",
            words::listed(&said)
        )
    })
}

/// Where estimates and medians agree.
pub(super) fn agreeing() -> String {
    "Estimates and posterior medians agree within an eighth of the intervals: either may be used.".to_owned()
}

/// Of the width of a 95 % interval: half a standard deviation of a normal posterior.
const APART: f64 = 0.125;
/// A rise that one standard error makes; what walkers meet by chance below a minimum that was found is rounding.
const GAIN: f64 = 1.0;
/// Samples follow one another, so that a sound band of 95 % may well hold fewer of one trace; of half of it, no more.
const HELD: f64 = 0.5;

/// Whether the observations of a sensor were fitted.
pub(super) fn is_fitted(case: &Case, sensor: usize) -> bool {
    case.judges().any(|seen| seen.sensor == sensor)
}

/// What a band says of the sensor's observations.
pub(super) fn held(case: &Case, sensor: usize, found: &Foreseen) -> String {
    let Some((parameters, discrepancy)) = found.held else {
        return "Nothing was observed here.".to_owned();
    };
    let fitted = if is_fitted(case, sensor) { "which were fitted" } else { "none of which were fitted" };
    format!(
        "Of the samples observed in the trusted window, {fitted}, the factors' band holds {} and the wider one {}, give or take two deviations of the \
         reading.",
        words::percent(parameters),
        words::percent(discrepancy)
    )
}

/// What was drawn of the factors, and what that predicts of every sensor of every case.
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
    let columns = ["p2.5_K", "p50_K", "p97.5_K", "lacking_p2.5_K", "lacking_p50_K", "lacking_p97.5_K"];
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

/// How a posterior is found, for the page.
pub(super) const METHOD: &str = "Posterior: values drawn as often as they are likely, by walkers that move by each other's differences (ter Braak \
    2006) between the bounds. The density is exp(-S/2) of the objective that estimate and profiles have: data count by their noise model, priors at their word. What \
    the model lacks is a process of exponential memory, as strong as the residuals are beyond the readings' own deviations; \
    at each sensor and instant it is in proportion to what a standard deviation of every factor of the case moves there.";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{fixture, warnings};

    fn saying(outcomes: &fixture::Outcomes, text: &str) -> bool {
        warnings::all(&outcomes.answers("estimate")).iter().any(|doubt| doubt.contains(text))
    }

    #[test]
    fn walkers_that_have_not_been_everywhere_are_told_with_moves_that_would_do() {
        let mut outcomes = fixture::outcomes();
        assert!(
            walked(&outcomes.posterior).contains("R-hat is 1.05 at most, where 1.1 is the limit: they have been every")
        );
        assert!(!saying(&outcomes, "not settled"));
        outcomes.posterior.marginals[1].mixing.r_hat = 1.31;
        outcomes.posterior.marginals[1].mixing.autocorrelation_moves = 80.0;
        assert!(walked(&outcomes.posterior).contains("they have NOT been everywhere"));
        assert!(saying(&outcomes, "R-hat is 1.31, where 1.1 is the limit. Some 1,500 moves should do"));
    }

    #[test]
    fn a_point_below_the_estimate_and_a_band_that_misses_its_sensor_are_doubted() {
        let mut outcomes = fixture::outcomes();
        assert!(!saying(&outcomes, "lower minimum") && !saying(&outcomes, "The band of TC4"));
        outcomes.posterior.gain = 7.3;
        outcomes.posterior.predicted[0].sensors[3].held = Some((0.1, 0.31));
        assert!(
            saying(&outcomes, "by 7.3 squares of a standard error") && saying(&outcomes, "The band of TC4 holds 31 %")
        );
    }

    #[test]
    fn where_median_and_estimate_differ_the_one_to_use_is_named() {
        let mut outcomes = fixture::outcomes();
        assert!(!saying(&outcomes, "Use the posterior's median"));
        outcomes.posterior.marginals[0].median += 0.02;
        assert!(saying(&outcomes, "not the estimate, of f_k_INS (estimate 0.970, median 0.988)"));
    }

    #[test]
    fn what_the_model_lacks_is_told_in_kelvin_and_seconds_or_that_nothing_is_seen() {
        let mut outcomes = fixture::outcomes();
        let said = lacking(&outcomes.posterior);
        assert!(said.contains("4.2 K") && said.contains("over 8.5 s") && said.contains("by 0.31 of"), "{said}");
        outcomes.posterior.discrepancy.share = 0.0;
        assert!(lacking(&outcomes.posterior).contains("nothing is seen that the model lacks"));
    }
}
