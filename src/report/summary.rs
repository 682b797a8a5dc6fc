//! The outcome on one screen: at most 24 lines of 80 columns.

use super::answer::{self, Room};
use super::{backend_words, observed, warnings, words};
use crate::study::answers::Answers;

const LINES: usize = 24;
const COLUMNS: usize = 80;
/// So many answers share the screen: a study tells what four commands tell on four.
const SHARED: usize = 4;

/// What the command found, for a terminal, each line ended.
pub fn screen(answers: &Answers) -> String {
    let each = answer::in_reading_order(answers);
    let members = each.iter().find_map(|answer| answer.members()).map_or(String::new(), |drawn| {
        format!("{} of {} arrived, ", words::count(drawn.ok), words::counted(drawn.asked, "member"))
    });
    let elapsed_s = answers.seconds.began.elapsed().as_secs_f64();
    let mut lines = vec![
        format!("{}: {}", answers.question, answers.name()),
        format!("{}{}, {} s", members, backend_words(&answers.backend), words::significant(elapsed_s, 2)),
    ];
    let reached = answers.nominal_march().and_then(|march| march.reached.as_ref()).map(words::reached);
    lines.extend(reached.into_iter().flat_map(|reached| wrapped("", &reached)));
    if each.iter().all(|answer| answer.uses_observations()) {
        lines.extend(observed::apart(answers).map_or(Vec::new(), |said| wrapped("", &said)));
    }
    let is_led = each.iter().any(|answer| answer.leads());
    let room = if each.len() >= SHARED {
        Room { sensors: 6, factors: 4, fitted: 3, is_shared: true, is_led }
    } else {
        Room { sensors: 8, factors: 8, fitted: 4, is_shared: false, is_led }
    };
    lines.extend(each.iter().flat_map(|answer| answer.screen(answers, &room)));
    // The page has these in any case; how an estimate ended has no less a place here.
    let last: Vec<String> = each.iter().flat_map(|answer| answer.screen_at_the_end(answers)).collect();
    if lines.len() + last.len() < LINES {
        lines.extend(last);
    }
    let doubts = warnings::all(answers);
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

/// The sensors shown, the deepest and so many at most; and what is said of the others.
pub(super) fn shown(answers: &Answers, most: usize) -> (std::ops::Range<usize>, Option<String>) {
    let sensors = answers.case.sensors.len();
    let hidden = sensors.saturating_sub(most);
    let said = (hidden > 0).then(|| format!("{} above in report.html", words::counted(hidden, "more sensor")));
    (hidden..sensors, said)
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
            let screen = screen(&outcomes.answers(command));
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert!(screen.lines().all(|line| line.chars().count() <= COLUMNS), "{command}:\n{screen}");
        }
    }

    #[test]
    fn a_march_that_chars_says_what_was_lost_and_how_deep_and_still_how_the_estimate_ended() {
        let charring = fixture::outcomes().charring();
        for command in ["predict", "study"] {
            let screen = screen(&charring.answers(command));
            let told = screen.replace('\n', " ");
            assert!(
                told.contains("Mass lost 0.360 kg/m²") && told.contains("char front ended at 2.50 mm."),
                "{screen}"
            );
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert_eq!(told.contains("converged after"), command == "study", "{screen}");
        }
        let still = screen(&fixture::outcomes().answers("study"));
        assert!(!still.contains("Mass lost") && !still.contains("gas flux"), "{still}");
    }

    #[test]
    fn the_screen_of_a_prediction_says_when_and_how_hot_the_bondline_peaks() {
        let outcomes = fixture::outcomes();
        let screen = screen(&outcomes.answers("predict"));
        let peak = outcomes.nominal.peaks[3];
        let line = screen.lines().find(|line| line.starts_with("TC4")).expect("a line for TC4");
        assert!(line.contains(&words::kelvin(peak.temperature_k)), "{line}");
        assert!(line.contains(&words::seconds(peak.time_s)), "{line}");
    }

    #[test]
    fn a_study_that_ran_into_trouble_says_so_on_the_screen() {
        let mut outcomes = fixture::outcomes();
        let calm = screen(&outcomes.answers("predict"));
        outcomes.nominal.balance.stored_j_m2 *= 1.1;
        let troubled = screen(&outcomes.answers("predict"));
        assert!(!calm.contains("does not balance") && troubled.contains("does not balance"), "{troubled}");
    }
}
