//! The outcome on one screen: at most 24 lines of 80 columns.

use super::findings::ranked;
use super::{Story, backend_words, warnings, words};
use crate::study::estimate::Estimated;
use crate::study::nominal::Nominal;
use crate::study::sensitivity::Sensitivity;
use crate::study::uncertainty::Uncertainty;

const LINES: usize = 24;
const COLUMNS: usize = 80;

/// What the command found, for a terminal, each line ended.
pub fn screen(story: &Story) -> String {
    let members = story.uncertainty.map_or(String::new(), |outcome| {
        format!("{} of {}, ", words::count(outcome.ok), words::counted(outcome.asked, "member"))
    });
    let elapsed_s = story.seconds.began.elapsed().as_secs_f64();
    let mut lines = vec![
        format!("{}: {}", story.command, story.case.name),
        format!("{}{}, {} s", members, backend_words(story.backend), words::significant(elapsed_s, 2)),
    ];
    // A study tells four answers on the screen that one has elsewhere: the deepest sensors, the largest factors.
    let answers = [story.nominal.is_some(), story.uncertainty.is_some(), story.estimated.is_some()];
    let rows = if answers.iter().filter(|answer| **answer).count() > 1 { 2 } else { 8 };
    if let Some(outcome) = story.nominal {
        lines.extend(nominal(story, outcome, rows));
    }
    if let Some(outcome) = story.uncertainty {
        lines.extend(uncertainty(story, outcome, rows));
    }
    if let Some(outcome) = story.sensitivity {
        lines.extend(sensitivity(story, outcome, if rows == 2 { 0 } else { 8 }));
    }
    if let Some(outcome) = story.estimated {
        lines.extend(estimate(story, outcome, if rows == 2 { 3 } else { 7 }));
    }
    let doubts = warnings::all(story);
    let room = LINES.saturating_sub(lines.len());
    let mut told = Vec::new();
    for (index, doubt) in doubts.iter().enumerate() {
        let wrapped = wrapped("! ", doubt);
        let kept = if index + 1 == doubts.len() { 0 } else { 1 };
        if told.len() + wrapped.len() + kept > room {
            told.truncate(room.saturating_sub(1));
            told.push(format!("! {} in report.html", words::counted(doubts.len() - index, "more warning")));
            break;
        }
        told.extend(wrapped);
    }
    lines.extend(told);
    lines.truncate(LINES);
    lines.iter().map(|line| clipped(line) + "\n").collect()
}

/// The sensors shown where there is room for `rows`: the deepest.
fn shown(story: &Story, rows: usize) -> std::ops::Range<usize> {
    let sensors = story.case.sensors.len();
    sensors.saturating_sub(rows)..sensors
}

fn nominal(story: &Story, outcome: &Nominal, rows: usize) -> Vec<String> {
    let mut lines =
        vec![format!("{:<12}{:>22}{:>10}{:>14}{:>14}", "sensor", "peak", "at", "off by (rms)", "on average")];
    for index in shown(story, rows) {
        let peak = outcome.peaks[index];
        let seen = story.case.observations.iter().zip(&outcome.misfits).find(|(seen, _)| seen.sensor == index);
        let (rms, bias) = seen.map_or(("-".to_owned(), "-".to_owned()), |(_, misfit)| {
            (format!("{:.1} K", misfit.rms_k), format!("{} K", words::signed(misfit.bias_k, 1)))
        });
        lines.push(format!(
            "{:<12}{:>22}{:>10}{:>14}{:>14}",
            words::short(&story.case.sensors[index].name, 11),
            words::kelvin(peak.temperature_k),
            words::seconds(peak.time_s),
            rms,
            bias
        ));
    }
    lines
}

fn uncertainty(story: &Story, outcome: &Uncertainty, rows: usize) -> Vec<String> {
    let mut lines =
        vec![format!("{:<12}{:>22}{:>10}{:>16}  {}", "sensor", "mean peak", "± (1 σ)", "95 % within", "mostly due to")];
    for index in shown(story, rows) {
        let peak = &outcome.peaks[index];
        let blame: Vec<String> = ranked(story.case, outcome, index)
            .into_iter()
            .flatten()
            .take(1)
            .map(|(factor, share)| {
                format!("{} {}", words::short(&story.case.factors[factor].name, 12), words::percent(share))
            })
            .collect();
        lines.push(format!(
            "{:<12}{:>22}{:>10}{:>16}  {}",
            words::short(&story.case.sensors[index].name, 11),
            words::kelvin(peak.mean_k),
            format!("{} K", words::significant(peak.deviation_k, 2)),
            format!("{:.0}–{:.0} K", peak.percentiles_k[0], peak.percentiles_k[4]),
            blame.join(", ")
        ));
    }
    lines
}

fn sensitivity(story: &Story, outcome: &Sensitivity, rows: usize) -> Vec<String> {
    let name = |factor: usize| story.case.factors[factor].name.as_str();
    let mut lines = Vec::new();
    let mut order: Vec<usize> = (0..outcome.all.factors.len()).collect();
    order.sort_by(|&a, &b| outcome.all.magnitude_k[b].total_cmp(&outcome.all.magnitude_k[a]));
    if rows > 0 {
        lines.push(format!("{:<20}{:>12}  {}", "factor", "effect of 1 %", "scales"));
    }
    for index in order.into_iter().take(rows) {
        let factor = outcome.all.factors[index];
        lines.push(format!(
            "{:<20}{:>12}   {}",
            words::short(name(factor), 19),
            format!("{} K", words::significant(0.01 * outcome.all.magnitude_k[index], 2)),
            words::meaning(&story.case.factors[factor])
        ));
    }
    let proposed: Vec<&str> = outcome.proposed.factors.iter().map(|&factor| name(factor)).collect();
    lines.extend(wrapped(
        "",
        &format!(
            "Can be estimated together: {} (condition {}, all {}).",
            words::listed(&proposed),
            words::significant(outcome.proposed.condition_number, 3),
            words::significant(outcome.all.condition_number, 3)
        ),
    ));
    lines
}

fn estimate(story: &Story, outcome: &Estimated, rows: usize) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<20}{:>8}{:>10}{:>10}{:>20}  {}",
        "factor", "start", "estimate", "± (1 σ)", "95 % within", "bound"
    )];
    for index in 0..outcome.factors.len().min(rows) {
        let (low, high) = outcome.intervals[index];
        let determined = outcome.standard_errors[index].is_finite();
        lines.push(format!(
            "{:<20}{:>8.3}{:>10.4}{:>10}{:>20}  {}",
            words::short(&story.case.factors[outcome.factors[index]].name, 19),
            outcome.start[index],
            outcome.values[index],
            if determined { words::significant(outcome.standard_errors[index], 2) } else { "unknown".to_owned() },
            if determined { format!("{low:.3} to {high:.3}") } else { "not determined".to_owned() },
            if outcome.at_bound[index] { "at bound" } else { "" }
        ));
    }
    for (seen, (before, after)) in story.fitted(outcome).zip(&outcome.misfits).take(3) {
        lines.push(format!(
            "{} off by {} K before, {} K after (root mean square)",
            story.case.sensors[seen.sensor].name,
            words::significant(before.rms_k, 3),
            words::significant(after.rms_k, 3)
        ));
    }
    let ended = if outcome.converged { "converged" } else { "not converged" };
    lines.push(format!(
        "{ended} after {}: {}",
        words::counted(outcome.path.len().saturating_sub(1), "iteration"),
        outcome.termination
    ));
    lines
}

/// A text in lines of at most 80 columns, the first after `lead`, the others as far in.
fn wrapped(lead: &str, text: &str) -> Vec<String> {
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
