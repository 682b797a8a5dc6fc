//! The outcome on one screen: at most 24 lines of 80 columns.

use super::{
    Story, backend_words, causes, findings, gas, history, observed, posterior, recovery, reduction, sizing, warnings,
    words,
};
use crate::fit::Loss;
use crate::study::estimate::Estimated;
use crate::study::history::History;
use crate::study::nominal::Nominal;
use crate::study::proportion::Proportion;
use crate::study::recovery::Recovery;
use crate::study::sensitivity::Sensitivity;
use crate::study::size::Sizing;
use crate::study::uncertainty::Uncertainty;

const LINES: usize = 24;
const COLUMNS: usize = 80;

/// Sensors, factors and fitted sensors shown at most.
struct Room {
    sensors: usize,
    factors: usize,
    fitted: usize,
}

/// What the command found, for a terminal, each line ended.
pub fn screen(story: &Story) -> String {
    let members = story.uncertainty.map_or(String::new(), |outcome| {
        format!("{} of {} arrived, ", words::count(outcome.ok), words::counted(outcome.asked, "member"))
    });
    let elapsed_s = story.seconds.began.elapsed().as_secs_f64();
    let mut lines = vec![
        format!("{}: {}", story.command, story.name()),
        format!("{}{}, {} s", members, backend_words(story.backend), words::significant(elapsed_s, 2)),
    ];
    let reached = story.nominal_march().and_then(|march| march.reached.as_ref()).map(words::reached);
    lines.extend(reached.into_iter().flat_map(|reached| wrapped("", &reached)));
    if story.sizing.is_none() {
        lines.extend(observed::apart(story).map_or(Vec::new(), |said| wrapped("", &said)));
    }
    // A study tells on the screen what four commands tell on four.
    let all = story.nominal.is_some() && story.estimated.is_some();
    let gas = story.nominal.and_then(|outcome| gas::found(story.case, outcome));
    let gas = gas.map_or(Vec::new(), |said| wrapped("", &said));
    let room = if all {
        Room { sensors: 6 - gas.len().min(2), factors: 4, fitted: 3 }
    } else {
        Room { sensors: 8, factors: 8, fitted: 4 }
    };
    lines.extend(story.sizing.map(|outcome| sized(story, outcome)).unwrap_or_default());
    lines.extend(story.history.map(|outcome| heated(story, outcome)).unwrap_or_default());
    lines.extend(story.recovery.map(recovered).unwrap_or_default());
    let is_asked = story.sizing.is_some() || story.history.is_some() || story.recovery.is_some();
    match (story.uncertainty, story.nominal) {
        _ if is_asked => {}
        (Some(outcome), nominal) => lines.extend(uncertainty(story, outcome, nominal, &room)),
        (None, Some(outcome)) => lines.extend(nominal(story, outcome, &room)),
        (None, None) => {}
    }
    if let (Some(outcome), Some(sensor), false) = (story.uncertainty, story.bondline(), all || is_asked) {
        let said = causes::alone(story, outcome, sensor);
        lines.extend(said.map_or(Vec::new(), |said| wrapped("", &said)));
    }
    lines.extend(gas);
    if let Some(outcome) = story.sensitivity {
        if story.uncertainty.is_none() {
            lines.extend(sensitivity(story, outcome, &room));
        }
        let steps = if all { reduction::shortly } else { reduction::steps };
        lines.extend(wrapped("", &steps(story.case, outcome).join(" ")));
    }
    if let Some(outcome) = story.estimated {
        lines.extend(estimate(story, outcome, &room));
    }
    if let Some(outcome) = story.beside {
        lines.extend(wrapped("", &findings::explained(story, outcome)));
    }
    // The page has it in any case; how an estimate ended has no less a place here.
    let stated = story.sensitivity.and_then(|outcome| reduction::stated(story.case, outcome));
    let stated = stated.map_or(Vec::new(), |said| wrapped("", &said));
    if lines.len() + stated.len() < LINES {
        lines.extend(stated);
    }
    let doubts = warnings::all(story);
    let left = LINES.saturating_sub(lines.len());
    let mut told = Vec::new();
    for (index, doubt) in doubts.iter().enumerate() {
        let wrapped = wrapped("! ", doubt);
        let kept = if index + 1 == doubts.len() { 0 } else { 1 };
        if told.len() + wrapped.len() + kept > left {
            told.truncate(left.saturating_sub(1));
            told.push(format!("! {} in report.html", words::counted(doubts.len() - index, "more warning")));
            break;
        }
        told.extend(wrapped);
    }
    lines.extend(told);
    lines.truncate(LINES);
    lines.iter().map(|line| clipped(line) + "\n").collect()
}

/// The sensors shown, the deepest; and what is said of the others.
fn shown(story: &Story, room: &Room) -> (std::ops::Range<usize>, Option<String>) {
    let sensors = story.case.sensors.len();
    let hidden = sensors.saturating_sub(room.sensors);
    let said = (hidden > 0).then(|| format!("{} above in report.html", words::counted(hidden, "more sensor")));
    (hidden..sensors, said)
}

/// Root mean square and mean of predicted less measured at a sensor, where it was measured.
fn misfit(story: &Story, outcome: &Nominal, sensor: usize) -> (String, String) {
    let seen = story.case.observations.iter().zip(&outcome.misfits).find(|(seen, _)| seen.sensor == sensor);
    seen.map_or(("-".to_owned(), "-".to_owned()), |(_, misfit)| {
        (words::misfit(misfit.rms_k), format!("{} K", words::signed(misfit.bias_k, 1)))
    })
}

fn nominal(story: &Story, outcome: &Nominal, room: &Room) -> Vec<String> {
    let mut lines =
        vec![format!("{:<12}{:>22}{:>10}{:>14}{:>14}", "sensor", "peak", "at", "off by (rms)", "on average")];
    let (sensors, others) = shown(story, room);
    for index in sensors {
        let peak = outcome.peaks[index];
        let (rms, bias) = misfit(story, outcome, index);
        lines.push(format!(
            "{:<12}{:>22}{:>10}{:>14}{:>14}",
            words::short(&story.case.sensors[index].name, 11),
            words::kelvin(peak.temperature_k),
            words::seconds(peak.time_s),
            rms,
            bias
        ));
    }
    lines.extend(others);
    lines
}

fn uncertainty(story: &Story, outcome: &Uncertainty, nominal: Option<&Nominal>, room: &Room) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<7}{:>18}{:>8}{:>9}{:>8}{:>14}  {}",
        "sensor", "nominal peak", "at", "off, rms", "± 1 σ", "95 % peak at", "largest share"
    )];
    let (sensors, others) = shown(story, room);
    for index in sensors {
        let peak = &outcome.peaks[index];
        let [low_k, .., high_k] = peak.percentiles_k;
        let (deviation, within) = if outcome.ok > 1 {
            let within = format!("{}–{} K", words::grouped(low_k, 0), words::grouped(high_k, 0));
            (words::change(peak.deviation_k), within)
        } else {
            ("-".to_owned(), "-".to_owned())
        };
        let blame = findings::ranked(story.case, outcome, index).into_iter().flatten().next();
        let blame = blame.filter(|(_, share)| *share > 0.0).map_or("-".to_owned(), |(factor, share)| {
            format!("{} {}", words::short(&story.case.factors[factor].name, 10), words::percent(share))
        });
        lines.push(format!(
            "{:<7}{:>18}{:>8}{:>9}{:>8}{:>14}  {}",
            words::short(&story.case.sensors[index].name, 6),
            words::kelvin(peak.nominal.temperature_k),
            words::seconds(peak.nominal.time_s),
            nominal.map_or("-".to_owned(), |nominal| misfit(story, nominal, index).0),
            deviation,
            within,
            blame
        ));
    }
    lines.extend(others);
    lines
}

fn sensitivity(story: &Story, outcome: &Sensitivity, room: &Room) -> Vec<String> {
    let mut lines = vec![format!("{:<20}{:>14}  {}", "factor", "K per 1 %, rms", "scales")];
    let mut order: Vec<usize> = (0..outcome.all.factors.len()).collect();
    order.sort_by(|&a, &b| outcome.all.magnitude_k[b].total_cmp(&outcome.all.magnitude_k[a]));
    for index in order.into_iter().take(room.factors) {
        let factor = &story.case.factors[outcome.all.factors[index]];
        lines.push(format!(
            "{:<20}{:>14}  {}",
            words::short(&factor.name, 19),
            words::significant(0.01 * outcome.all.magnitude_k[index], 2),
            words::meaning(factor)
        ));
    }
    lines
}

fn estimate(story: &Story, outcome: &Estimated, room: &Room) -> Vec<String> {
    let mut lines =
        vec![format!("{:<20}{:>8}{:>10}{:>10}{:>20}  {}", "factor", "start", "estimate", "± (1 σ)", "95 % within", "")];
    for index in 0..outcome.factors.len().min(room.factors) {
        lines.push(format!(
            "{:<20}{:>8.3}{:>10.4}{:>10}{:>20}  {}",
            words::short(&outcome.factors[index].factor.name, 19),
            outcome.path[0].values[index],
            outcome.values[index],
            findings::standard_error(outcome, index),
            findings::within(outcome, index),
            if outcome.at_bound[index] { "at bound" } else { "" }
        ));
    }
    for profile in outcome.profiles.iter().take(room.factors) {
        let estimand = &outcome.factors[profile.factor];
        let within = words::profiled(profile.interval, estimand.bounds);
        lines.push(format!("{}: 95 % by its profile: {within}", estimand.factor.name));
    }
    if let Some(drawn) = story.posterior {
        for (marginal, estimand) in drawn.marginals.iter().zip(&outcome.factors).take(room.factors) {
            let ((low, high), name) = (marginal.interval, &estimand.factor.name);
            lines.push(format!("{name}: 95 % by its posterior: {low:.3} to {high:.3}, median {:.3}", marginal.median));
        }
        lines.push(posterior::walked_shortly(drawn));
        lines.extend(posterior::foreseen(story, drawn).map_or(Vec::new(), |said| wrapped("", &said)));
    }
    for (name, (before, after)) in story.misfits(outcome).into_iter().take(room.fitted) {
        lines.push(format!(
            "{name} is off by {} (rms) nominally, {} with these factors",
            words::misfit(before.rms_k),
            words::misfit(after.rms_k)
        ));
    }
    // Least squares are what is expected; another objective is named.
    let is_plain = outcome.loss == Loss::Squares && outcome.prior.is_none();
    let named = (!is_plain).then(|| findings::objective(outcome));
    lines.extend(named.into_iter().chain(findings::ends(outcome)).flat_map(|said| wrapped("", &said)));
    let ended = if outcome.converged { "converged" } else { "NOT converged" };
    lines.push(format!(
        "{ended} after {}: {}",
        words::counted(outcome.path.len().saturating_sub(1), "iteration"),
        outcome.termination
    ));
    lines
}

fn sized(story: &Story, outcome: &Sizing) -> Vec<String> {
    let probability = words::percent_of(outcome.demand.probability);
    let held = |held: Option<Proportion>| held.map_or("-".to_owned(), sizing::proportion);
    let mass = |at_m: Option<f64>| at_m.map_or("-".to_owned(), |at_m| sizing::areal(outcome.mass_kg_m2(at_m)));
    let row =
        |of: &str, thickness: String, mass: String, held: String| format!("{of:<20}{thickness:>17}{mass:>13}  {held}");
    let title = format!("{} for {}", outcome.demand.ply, sizing::limit(story, outcome));
    let mut lines = vec![
        title,
        row("", "thickness".into(), "mass".into(), "members that hold it".into()),
        row(
            "as drawn",
            words::millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            held(Some(outcome.held(outcome.drawn_m))),
        ),
        row(
            "nominally",
            sizing::thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            held(outcome.nominal.found_m().map(|at_m| outcome.held(at_m))),
        ),
        row(
            &format!("in {probability} of members"),
            sizing::thickness(outcome.needed),
            mass(outcome.needed.found_m()),
            held(outcome.check.as_ref().map(|check| check.held)),
        ),
    ];
    if let Some(margin_m) = outcome.margin_m() {
        lines.push(row("margin", words::millimetres(margin_m), mass(Some(margin_m)), String::new()));
    }
    let said = [Some(sizing::found(story, outcome)), Some(sizing::enough(outcome)), sizing::cause(story, outcome)];
    let said = said.into_iter().chain([sizing::checked(outcome)]).flatten();
    lines.extend(said.flat_map(|said| wrapped("", &said)));
    lines
}

fn heated(story: &Story, outcome: &History) -> Vec<String> {
    let mut lines = vec![history::row(&history::head(outcome))];
    lines.extend(history::rows(outcome, 8).iter().map(history::row));
    let said = [history::found(story, outcome), history::chosen(outcome), history::left_out().to_owned()];
    lines.extend(said.iter().flat_map(|said| wrapped("", said)));
    lines
}

fn recovered(outcome: &Recovery) -> Vec<String> {
    let mut lines = wrapped("", &recovery::made(outcome));
    lines.push(format!(
        "{:<15}{:>10}{:>9}{:>9}{:>9}  {}",
        "factor", "bias", "off, rms", "± 95 %", "at bound", "intervals that hold it"
    ));
    for factor in &outcome.recovered {
        lines.push(format!(
            "{:<15}{:>10}{:>9}{:>9}{:>9}  {}",
            words::short(&factor.name, 14),
            words::significant(factor.bias, 2),
            words::significant(factor.rms, 2),
            words::significant(factor.half_width, 2),
            words::count(factor.at_bound),
            sizing::proportion(factor.covered)
        ));
    }
    lines.extend(wrapped("", &recovery::coverage(outcome)));
    lines
}

/// A text in lines of at most 80 columns, the first after `lead`, the others as far in.
pub fn wrapped(lead: &str, text: &str) -> Vec<String> {
    let margin = " ".repeat(lead.len());
    let mut lines = vec![lead.to_owned()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is a first line");
        let begun = line.chars().count() > margin.len();
        if begun && line.chars().count() + 1 + word.chars().count() > COLUMNS {
            lines.push(format!("{margin}{word}"));
        } else {
            line.push_str(if begun { " " } else { "" });
            line.push_str(word);
        }
    }
    lines
}

fn clipped(line: &str) -> String {
    words::short(line.trim_end(), COLUMNS)
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;

    #[test]
    fn every_command_fits_a_screen_of_24_lines_and_80_columns() {
        let mut outcomes = fixture::outcomes();
        outcomes.case.name = "a name that goes on and on ".repeat(8);
        for command in ["predict", "uncertainty", "sensitivity", "estimate", "study"] {
            let screen = screen(&outcomes.story(command));
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert!(screen.lines().all(|line| line.chars().count() <= COLUMNS), "{command}:\n{screen}");
        }
    }

    #[test]
    fn a_march_that_chars_says_what_was_lost_and_how_deep_and_still_how_the_estimate_ended() {
        let charring = fixture::outcomes().charring();
        for command in ["predict", "study"] {
            let screen = screen(&charring.story(command));
            let told = screen.replace('\n', " ");
            assert!(
                told.contains("Mass lost 0.360 kg/m²") && told.contains("char front ended at 2.50 mm."),
                "{screen}"
            );
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert_eq!(told.contains("converged after"), command == "study", "{screen}");
        }
        let still = screen(&fixture::outcomes().story("study"));
        assert!(!still.contains("Mass lost") && !still.contains("gas flux"), "{still}");
    }

    #[test]
    fn the_screen_of_a_prediction_says_when_and_how_hot_the_bondline_peaks() {
        let outcomes = fixture::outcomes();
        let screen = screen(&outcomes.story("predict"));
        let peak = outcomes.nominal.peaks[3];
        let line = screen.lines().find(|line| line.starts_with("TC4")).expect("a line for TC4");
        assert!(line.contains(&words::kelvin(peak.temperature_k)), "{line}");
        assert!(line.contains(&words::seconds(peak.time_s)), "{line}");
    }

    #[test]
    fn a_study_that_ran_into_trouble_says_so_on_the_screen() {
        let mut outcomes = fixture::outcomes();
        let calm = screen(&outcomes.story("predict"));
        outcomes.nominal.balance.stored_j_m2 *= 1.1;
        let troubled = screen(&outcomes.story("predict"));
        assert!(!calm.contains("does not balance") && troubled.contains("does not balance"), "{troubled}");
    }
}
