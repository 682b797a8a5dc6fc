//! What was found, in sentences: the same for the page and, shortened, for the screen.

use super::figures::nearest;
use super::{Story, causes, gas, history, observed, posterior, recovery, reduction, sizing, words};
use crate::case::Case;
use crate::fit::Loss;
use crate::study::beside::Beside;
use crate::study::estimate::{Estimand, Estimated};
use crate::study::uncertainty::Uncertainty;

/// One finding: what it is about and the sentence.
pub(super) struct Finding {
    pub about: &'static str,
    pub said: String,
}

/// All findings of a story, in the order of its sections.
pub(super) fn all(story: &Story) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut say = |about: &'static str, said: String| found.push(Finding { about, said });
    let bondline = story.bondline();
    if let (Some(nominal), Some(sensor)) = (story.nominal_march(), bondline) {
        let name = story.sensor(story.case, sensor);
        let peak = nominal.peaks[sensor];
        say(
            "Peak",
            format!(
                "{name}, the deepest sensor, peaks at {} at {}.",
                words::kelvin(peak.temperature_k),
                words::seconds(peak.time_s)
            ),
        );
        let seen = story.case.observations.iter().zip(&nominal.misfits).find(|(seen, _)| seen.sensor == sensor);
        if let Some((_, misfit)) = seen {
            let way = if misfit.bias_k > 0.0 { "hot" } else { "cold" };
            say(
                "Misfit",
                format!(
                    "Nominally {name} is predicted {} too {way} on average over the trusted window ({} root mean \
                     square, {} at worst, at {}).",
                    words::misfit(misfit.bias_k.abs()),
                    words::misfit(misfit.rms_k),
                    words::misfit(misfit.worst_k.abs()),
                    words::seconds(misfit.worst_time_s)
                ),
            );
        }
    }
    if let (Some(said), None) = (observed::apart(story), story.sizing) {
        say("Trusted", said);
    }
    if let Some(outcome) = story.sizing {
        say("Thickness", sizing::found(story, outcome));
        sizing::cause(story, outcome).into_iter().for_each(|said| say("Cause", said));
        sizing::checked(outcome).into_iter().for_each(|said| say("Check", said));
    }
    if let Some(outcome) = story.history {
        say("Heating", history::found(story, outcome));
        say("Smoothing", history::chosen(outcome));
    }
    if let Some(outcome) = story.recovery {
        say("Twins", recovery::made(outcome));
        say("Coverage", recovery::coverage(outcome));
    }
    if let Some(said) = story.nominal.and_then(|nominal| gas::found(story.case, nominal)) {
        say("Gas", said);
    }
    if let (Some(outcome), Some(sensor)) = (story.uncertainty, bondline) {
        say("Spread", spread(story.case, outcome, sensor));
        if let Some(said) = blame(story.case, outcome, sensor) {
            say("Cause", said);
        }
        if let Some(said) = causes::alone(story, outcome, sensor) {
            say("Alone", said);
        }
    }
    if let Some(outcome) = story.sensitivity {
        reduction::steps(story.case, outcome).into_iter().for_each(|said| say("Estimable", said));
        if let Some(said) = reduction::stated(story.case, outcome) {
            say("Stated", said);
        }
    }
    if let Some(outcome) = story.beside {
        say("Beside", explained(story, outcome));
    }
    if let Some(outcome) = story.estimated {
        say("Estimate", estimate(outcome));
        if let Some(said) = shared(story, outcome) {
            say("Shared", said);
        }
        for (name, (before, after)) in story.misfits(outcome) {
            say(
                "Fit",
                format!(
                    "{name} is off by {} (root mean square) with the nominal factors and by {} with the estimates.",
                    words::misfit(before.rms_k),
                    words::misfit(after.rms_k)
                ),
            );
        }
        if let Some(outcome) = story.posterior {
            say("Posterior", posterior::walked(outcome));
            say("Lacking", posterior::lacking(outcome));
            if let Some(said) = posterior::foreseen(story, outcome) {
                say("Foreseen", said);
            }
        }
        if let Some(said) = ends(outcome) {
            say("Starts", said);
        }
        let ended = if outcome.converged { "It converged" } else { "It did not converge" };
        let turns = words::counted(outcome.path.len().saturating_sub(1), "iteration");
        say(
            "Ending",
            format!(
                "{ended}, after {turns} and {}: {}.",
                words::counted(outcome.marches, "marched member"),
                sentence(&outcome.termination)
            ),
        );
    }
    found
}

fn spread(case: &Case, outcome: &Uncertainty, sensor: usize) -> String {
    if outcome.ok < 2 {
        return format!("{} of {} arrived: there is no spread.", outcome.ok, words::counted(outcome.asked, "member"));
    }
    let peak = &outcome.peaks[sensor];
    format!(
        "Over {} the peak of {} is {} on average, with a standard deviation of {} K; 95 % lie between {} and {}.",
        words::counted(outcome.ok, "member"),
        case.sensors[sensor].name,
        words::kelvin(peak.mean_k),
        words::significant(peak.deviation_k, 2),
        words::kelvin(peak.percentiles_k[0]),
        words::kelvin(peak.percentiles_k[4])
    )
}

/// The factors that make the spread of a sensor at its nominal peak.
fn blame(case: &Case, outcome: &Uncertainty, sensor: usize) -> Option<String> {
    let said: Vec<String> = ranked(case, outcome, sensor)?
        .into_iter()
        .take(3)
        .filter(|(_, share)| *share >= 0.05)
        .map(|(factor, share)| {
            let factor = &case.factors[factor];
            format!("{} ({}, {})", factor.name, words::meaning(factor), words::percent(share))
        })
        .collect();
    let name = &case.sensors[sensor].name;
    (!said.is_empty()).then(|| {
        format!("At the peak of {name} the largest shares of its spread are those of {}.", words::listed(&said))
    })
}

/// Factors by their share of a sensor's spread at its nominal peak, largest first.
pub(super) fn ranked(case: &Case, outcome: &Uncertainty, sensor: usize) -> Option<Vec<(usize, f64)>> {
    let instant = nearest(&outcome.instants_s, outcome.peaks[sensor].nominal.time_s)?;
    let mut shares: Vec<(usize, f64)> = (0..case.factors.len())
        .map(|factor| (factor, outcome.spreads[sensor].causes[instant].shares[factor]))
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    Some(shares)
}

/// One standard deviation of an estimate; none where it is not determined.
pub(super) fn standard_error(outcome: &Estimated, place: usize) -> String {
    if outcome.is_determined(place) { words::significant(outcome.standard_errors[place], 2) } else { "-".to_owned() }
}

/// The 95 % interval of an estimate, or why there is none.
pub(super) fn within(outcome: &Estimated, place: usize) -> String {
    if outcome.has_effect[place] {
        words::interval(outcome.intervals[place], outcome.factors[place].bounds)
    } else {
        "no effect on data".to_owned()
    }
}

/// The noise model of the residuals.
pub(super) fn noise(outcome: &Estimated) -> String {
    let memory = if outcome.correlation_time_s > 0.0 {
        let share = outcome.white_share;
        let white =
            if share > 0.0 { format!(" with a white share of {}", words::percent(share)) } else { String::new() };
        format!("correlated over {}{white}", words::seconds(outcome.correlation_time_s))
    } else {
        "white noise".to_owned()
    };
    format!(
        "Noise model of the residuals (restricted likelihood): most probably {memory}. Effective sample size {} of {}; the lag-one          autocorrelation of the residuals is {}.",
        words::significant(outcome.effective_samples, 2),
        words::count(outcome.samples),
        words::significant(outcome.autocorrelation, 2)
    )
}

fn estimate(outcome: &Estimated) -> String {
    let values: Vec<String> = (0..outcome.factors.len())
        .map(|index| {
            let factor = &outcome.factors[index].factor;
            let interval = within(outcome, index);
            format!("{} = {:.3} (95 % interval: {interval})", factor.name, outcome.values[index])
        })
        .collect();
    format!("{}.", words::listed(&values))
}

/// Which factors are one in several cases, and which are another in each.
fn shared(story: &Story, outcome: &Estimated) -> Option<String> {
    let cases: Vec<&str> = story.cases().map(|case| case.id.as_str()).collect();
    let is_shared = |factor: &&Estimand| factor.places.iter().flatten().count() > 1;
    let name = |factor: &Estimand| factor.factor.name.clone();
    let (shared, own): (Vec<&Estimand>, Vec<&Estimand>) = outcome.factors.iter().partition(is_shared);
    let [shared, own] = [shared, own].map(|factors| factors.into_iter().map(name).collect::<Vec<String>>());
    let said = match (shared.len(), own.len()) {
        (0, _) => format!("{} share no factor: they are fitted side by side.", words::listed(&cases)),
        (_, 0) => format!("{} share all factors.", words::listed(&cases)),
        _ => format!("{} share {}; {} of one case alone.", words::listed(&cases), words::listed(&shared), {
            let verb = if own.len() == 1 { "is" } else { "are" };
            format!("{} {verb}", words::listed(&own))
        }),
    };
    (cases.len() > 1).then_some(said)
}

/// What was minimised.
pub(super) fn objective(outcome: &Estimated) -> String {
    let of_residuals = "the residuals over their standard deviations";
    let of_data = match outcome.loss {
        Loss::Squares => format!("the sum of squares of {of_residuals}"),
        Loss::SoftL1 { width } => soft("soft L1", width, of_residuals),
        Loss::Huber { width } => soft("Huber's", width, of_residuals),
    };
    let Some(bounds) = outcome.prior else { return format!("S, the objective that is minimised, is {of_data}.") };
    format!(
        "S, the objective that is minimised, is {of_data}, divided by the square of {} (by so much the residuals exceed \
         the stated deviations), plus the square of each factor's distance from its nominal value over its prior standard \
         deviation (half the way to its {} bounds).",
        words::significant(outcome.shortfall, 3),
        bounds.name()
    )
}

fn soft(name: &str, width: f64, of_residuals: &str) -> String {
    format!(
        "the sum of the {name} loss of {of_residuals}, which beyond {} of them grows with the distance and not with its \
         square",
        words::significant(width, 3)
    )
}

/// Where several descents ended.
pub(super) fn ends(outcome: &Estimated) -> Option<String> {
    let least = outcome.ends.iter().filter(|end| end.is_least).count();
    let others = outcome.ends.len() - least;
    let rest = match others {
        0 => "no other minimum was met".to_owned(),
        _ => format!("{} ended higher, in other minima or short of one", words::counted(others, "other")),
    };
    (outcome.ends.len() > 1)
        .then(|| format!("Of {} {least} ended at the estimate; {rest}.", words::counted(outcome.ends.len(), "start")))
}

/// A clause without its closing point, to be put into a sentence.
pub(super) fn sentence(text: &str) -> &str {
    text.trim().trim_end_matches('.')
}

/// What the physics of the case beside explains of the misfit in cool-down, at the deepest thermocouple observed.
pub(super) fn explained(story: &Story, outcome: &Beside) -> String {
    let Some(left) = outcome.left.last() else { return "Nothing is observed.".to_owned() };
    let [first_k, other_k] = left.cooling_k.map(words::misfit);
    let head = format!(
        "From {} on, when the hot face is heated no more, {} is off by {first_k} (root mean square) as {} fits and by \
         {other_k} as {} does",
        words::seconds(outcome.cooling_s),
        story.case.sensors[left.sensor].name,
        story.case.id,
        outcome.id
    );
    let share = left.explained();
    if !share.is_finite() {
        return format!("{head}.");
    }
    if share > 0.0 {
        format!(
            "{head}: what the latter has and the former has not explains {:.0} % of the mean square misfit.",
            100.0 * share
        )
    } else {
        format!("{head}: what the latter has explains none of the misfit.")
    }
}

#[cfg(test)]
mod tests {
    use super::super::{figures, fixture};
    use super::*;

    /// Counted from the shares themselves: whoever is named has a share no smaller than anybody who is not.
    #[test]
    fn the_factors_that_are_named_have_the_largest_shares_in_the_finding_and_in_the_caption() {
        let outcomes = fixture::outcomes();
        let (case, outcome) = (&outcomes.case, &outcomes.uncertainty);
        let figures = figures::all(&outcomes.story("study"));
        for (sensor, of) in case.sensors.iter().enumerate() {
            let instant = nearest(&outcome.instants_s, outcome.peaks[sensor].nominal.time_s).expect("an instant");
            let shares = &outcome.spreads[sensor].causes[instant].shares;
            let said = blame(case, outcome, sensor).expect("shares");
            let (named, others): (Vec<usize>, Vec<usize>) =
                (0..shares.len()).partition(|&factor| said.contains(&format!("{} (", case.factors[factor].name)));
            let least = named.iter().map(|&factor| shares[factor]).fold(1.0, f64::min);
            let most = others.iter().map(|&factor| shares[factor]).fold(0.0, f64::max);
            assert!(!named.is_empty() && named.len() <= 3 && least >= most, "{said} beside {shares:?}");
            for &factor in &named {
                assert!(said.contains(&words::percent(shares[factor])), "{said} beside {shares:?}");
            }
            let largest = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).expect("a factor");
            let figure = figures.iter().find(|figure| figure.id == format!("shares-{}", of.name)).expect("a chart");
            let expected = format!(") {} (", case.factors[largest].name);
            let told = format!("has the largest share, {}", words::percent(shares[largest]));
            assert!(figure.caption.contains(&expected) && figure.caption.contains(&told), "{}", figure.caption);
        }
    }
}
