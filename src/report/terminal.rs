//! The terminal output of a report: at most 24 lines of 80 columns.

use super::reportable::{self, ScreenLimits};
use super::{backend_text, format, observations, warnings};
use crate::study::answers::Answers;

const LINES: usize = 24;
const COLUMNS: usize = 80;
/// From this number of results on, each gets fewer lines: `study` shows the results of four commands.
const MANY_RESULTS: usize = 4;

/// The results as text for a terminal; each line ends with a line feed.
pub fn screen(answers: &Answers) -> String {
    let each = reportable::in_reading_order(answers);
    let members = each.iter().find_map(|answer| answer.members()).map_or(String::new(), |drawn| {
        format!("{} of {} completed, ", format::count(drawn.completed), format::counted(drawn.requested, "member"))
    });
    let elapsed_s = answers.timing.start.elapsed().as_secs_f64();
    let run = format!("{}{}, {} s", members, backend_text(&answers.backend), format::significant(elapsed_s, 2));
    let mut lines = vec![format!("{}: {}", answers.question, answers.name())];
    lines.extend(wrap("", &run));
    let reached =
        answers.nominal_march().and_then(|march| march.error_estimate.as_ref()).map(format::discretisation_error);
    lines.extend(reached.into_iter().flat_map(|reached| wrap("", &reached)));
    if each.iter().all(|answer| answer.uses_observations()) {
        lines.extend(observations::data_used(answers).map_or(Vec::new(), |text| wrap("", &text)));
    }
    let is_led = each.iter().any(|answer| answer.comes_first());
    let room = if each.len() >= MANY_RESULTS {
        ScreenLimits { sensors: 6, factors: 4, misfits: 3, is_shared: true, has_leading_result: is_led }
    } else {
        ScreenLimits { sensors: 8, factors: 8, misfits: 4, is_shared: false, has_leading_result: is_led }
    };
    let warnings = warnings::all(answers);
    // Warnings that do not fit need a line that counts them.
    let available = LINES - usize::from(!warnings.is_empty());
    let results = |room: &ScreenLimits| each.iter().flat_map(|answer| answer.screen(answers, room)).collect::<Vec<_>>();
    let mut found = results(&room);
    for fewer in 1..=room.misfits {
        if lines.len() + found.len() <= available {
            break;
        }
        found = results(&room.with_fewer(fewer));
    }
    lines.extend(found);
    if let Some(hidden @ 1..) = lines.len().checked_sub(available) {
        lines.truncate(available - 1);
        lines.push(format!("{} in report.html", format::counted(hidden + 1, "more line")));
    }
    // These lines are on the page too; they must not displace the termination of an estimate.
    let last: Vec<String> = each.iter().flat_map(|answer| answer.screen_footer(answers)).collect();
    if lines.len() + last.len() < LINES {
        lines.extend(last);
    }
    let left = LINES - lines.len();
    let mut shown = Vec::new();
    for (index, warning) in warnings.iter().enumerate() {
        let wrapped = wrap("! ", warning);
        let reserved = if index + 1 == warnings.len() { 0 } else { 1 };
        if shown.len() + wrapped.len() + reserved > left {
            shown.truncate(left.saturating_sub(1));
            let noun = if index == 0 { "warning" } else { "more warning" };
            shown.push(format!("! {} in report.html", format::counted(warnings.len() - index, noun)));
            break;
        }
        shown.extend(wrapped);
    }
    lines.extend(shown);
    lines.iter().map(|line| truncate_line(line) + "\n").collect()
}

/// The sensors with a limit and the deepest ones, at most `most` if fewer have a limit, and a line that counts the
/// others.
pub(super) fn shown_sensors(answers: &Answers, most: usize) -> (Vec<usize>, Option<String>) {
    let sensors = answers.case.sensors.len();
    let shown = with_needed((0..sensors).rev(), most, |&sensor| answers.case.has_limit(sensor));
    let others = more(sensors - shown.len(), "sensor");
    (shown, others)
}

/// The needed places, and the first of the others up to `most` in all, in ascending order.
pub(super) fn with_needed(
    places: impl Iterator<Item = usize>,
    most: usize,
    is_needed: impl Fn(&usize) -> bool,
) -> Vec<usize> {
    let (mut shown, others): (Vec<usize>, Vec<usize>) = places.partition(is_needed);
    shown.extend(others.into_iter().take(most.saturating_sub(shown.len())));
    shown.sort_unstable();
    shown
}

/// A line that counts what is left out; `None` if nothing is.
pub(super) fn more(hidden: usize, noun: &str) -> Option<String> {
    (hidden > 0).then(|| format!("{} in report.html", format::counted(hidden, &format!("more {noun}"))))
}

/// A column of a table on the screen.
#[derive(Clone, Copy)]
pub(super) enum Column {
    /// Aligned to the left after a gap, with its least width.
    Left { gap: usize, width: usize },
    /// Aligned to the right, with its least width, in which at least one space is before the text.
    Right(usize),
}

/// Least width of the first column where the others leave too little.
const MIN_FIRST_WIDTH: usize = 4;

/// A table whose columns never run together: they widen with their cells, at the cost of the names in the first.
pub(super) fn aligned<const N: usize>(columns: [Column; N], rows: &[[String; N]]) -> Vec<String> {
    let longest = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let mut widths: [usize; N] = std::array::from_fn(|column| match columns[column] {
        Column::Left { width, .. } => width.max(longest(column)),
        Column::Right(width) => width.max(longest(column) + 1),
    });
    // Nothing follows the last column, so that its width is that of its text.
    if let (Column::Left { .. }, Some(last)) = (columns[N - 1], widths.last_mut()) {
        *last = longest(N - 1);
    }
    let gap = |column: usize| match columns[column] {
        Column::Left { gap, .. } => gap,
        Column::Right(_) => 0,
    };
    let total = (0..N).map(|column| gap(column) + widths[column]).sum::<usize>();
    widths[0] = (widths[0] - total.saturating_sub(COLUMNS).min(widths[0])).max(MIN_FIRST_WIDTH);
    let cell = |row: &[String; N], column: usize| {
        let text = if column == 0 { format::truncate(&row[0], widths[0]) } else { row[column].clone() };
        let (width, gap) = (widths[column], gap(column));
        match columns[column] {
            Column::Left { .. } => format!("{:gap$}{text:<width$}", ""),
            Column::Right(_) => format!("{text:>width$}"),
        }
    };
    let line = |row: &[String; N]| (0..N).map(|column| cell(row, column)).collect::<String>();
    rows.iter().map(line).collect()
}

/// The head of a table, from its words.
pub(super) fn head<const N: usize>(words: [&str; N]) -> [String; N] {
    words.map(str::to_owned)
}

/// Wrap a text at 80 columns. The first line begins with `lead`, the others are indented as far.
pub fn wrap(lead: &str, text: &str) -> Vec<String> {
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

fn truncate_line(line: &str) -> String {
    format::truncate(line.trim_end(), COLUMNS)
}

#[cfg(test)]
mod tests {
    use super::super::marched;
    use super::*;
    use crate::traces::Gauge;

    #[test]
    fn every_command_fits_a_screen_of_24_lines_and_80_columns() {
        let mut outcomes = marched::study();
        outcomes.case.name = "a name that goes on and on ".repeat(8);
        for command in ["predict", "uncertainty", "sensitivity", "estimate", "study"] {
            let screen = screen(&outcomes.answers(command));
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert!(screen.lines().all(|line| line.chars().count() <= COLUMNS), "{command}:\n{screen}");
        }
    }

    #[test]
    fn mass_lost_and_char_depth_are_shown_and_do_not_displace_the_termination_of_the_estimate() {
        let mut charring = marched::charring();
        let gauges = &mut charring.nominal.gauge_traces;
        (gauges[Gauge::MassLost as usize].end, gauges[Gauge::CharFront as usize].end) = (0.36, 2.5e-3);
        for command in ["predict", "study"] {
            let screen = screen(&charring.answers(command));
            let text = screen.replace('\n', " ");
            assert!(text.contains("Mass lost 0.360 kg/m²") && text.contains("final char depth 2.50 mm."), "{screen}");
            assert!(screen.lines().count() <= LINES, "{command}:\n{screen}");
            assert_eq!(text.contains("converged after"), command == "study", "{screen}");
        }
        let still = screen(&marched::study().answers("study"));
        assert!(!still.contains("Mass lost") && !still.contains("gas flux"), "{still}");
    }

    #[test]
    fn the_time_of_a_run_is_shown_beside_a_long_name_of_a_device() {
        let mut outcomes = marched::study();
        outcomes.backend.name = "a device whose name alone fills most of a line of the terminal (driver 1.2.3)".into();
        let screen = screen(&outcomes.answers("uncertainty"));
        let after = screen.replace('\n', " ").split_once("(driver 1.2.3), ").expect("the whole name").1.to_owned();
        let seconds = after.split_once(" s ").expect("seconds").0;
        assert!(seconds.parse::<f64>().is_ok(), "{screen}");
    }

    #[test]
    fn columns_keep_apart_with_long_names_and_large_numbers_and_are_as_before_otherwise() {
        let columns = [Column::Left { gap: 0, width: 7 }, Column::Right(8), Column::Left { gap: 2, width: 0 }];
        let row = |cells: [&str; 3]| cells.map(str::to_owned);
        let short = aligned(columns, &[row(["TC1", "78 s", "f_k 51 %"])]);
        assert_eq!(short, ["TC1        78 s  f_k 51 %"]);
        let long = aligned(columns, &[row(["sensor", "time", "share"]), row(["SENSOR1", "1,209,600 s", "f_k 51 %"])]);
        assert_eq!(long, ["sensor         time  share   ", "SENSOR1 1,209,600 s  f_k 51 %"]);
        let name = "a name that goes on ".repeat(5);
        let wide = aligned(columns, &[row([&name, "1,209,600 s", "f_k 51 %"])]);
        assert!(wide[0].chars().count() == COLUMNS && wide[0].contains("… 1,209,600 s  f_k 51 %"), "{wide:?}");
    }

    #[test]
    fn a_run_of_weeks_keeps_the_columns_of_the_screen_apart() {
        let mut outcomes = marched::study();
        outcomes.case.sensors[3].name = "BONDLINE-UPPER".to_owned();
        for peak in &mut outcomes.uncertainty.peaks {
            peak.nominal.time_s = 1_209_600.0;
        }
        outcomes.nominal.peaks[3].time_s = 1_209_600.0;
        for command in ["predict", "uncertainty"] {
            let screen = screen(&outcomes.answers(command));
            assert!(screen.contains(" 1,209,600 s "), "{screen}");
            assert!(!screen.contains(")1,209,600"), "{screen}");
        }
    }

    /// The case with ten more sensors between the first two, of which one has a limit.
    fn with_more_sensors() -> marched::Study {
        let mut outcomes = marched::study();
        for number in 0..10 {
            let sensor = outcomes.case.sensors[0].clone();
            let name = if number == 3 { "LIMITED".to_owned() } else { format!("T{number}") };
            let depth_m = sensor.depth_m + 1e-6 * f64::from(number);
            outcomes.case.sensors.insert(1, crate::case::Sensor { name, depth_m, ..sensor });
        }
        let limited = outcomes.case.sensors.iter().position(|sensor| sensor.name == "LIMITED").expect("it is there");
        let part = crate::case::LimitedPart::Sensor(limited);
        outcomes.case.limits = vec![crate::case::TemperatureLimit { part, limit_k: 400.0 }];
        outcomes
    }

    #[test]
    fn sensors_that_are_left_out_are_counted_and_one_with_a_limit_is_none_of_them() {
        let outcomes = with_more_sensors();
        let (shown, others) = shown_sensors(&outcomes.answers("predict"), 4);
        let names: Vec<&str> = shown.iter().map(|&sensor| outcomes.case.sensors[sensor].name.as_str()).collect();
        assert_eq!(names, ["LIMITED", "TC2", "TC3", "TC4"]);
        assert_eq!(others.as_deref(), Some("10 more sensors in report.html"));
    }

    /// Numbers of warnings shown in full or counted, whatever else the screen has to show.
    #[test]
    fn every_warning_is_shown_or_counted_however_full_the_screen_is() {
        for command in ["predict", "uncertainty", "sensitivity", "estimate", "study"] {
            for remarks in [1, 2, 30] {
                let mut outcomes = marched::charring();
                outcomes.case.name = "a name that goes on and on ".repeat(8);
                outcomes.backend.name = "a device ".repeat(60);
                let mut answers = outcomes.answers(command);
                answers.run.remarks = (0..remarks).map(|number| format!("Remark {number}.")).collect();
                let screen = screen(&answers);
                let all = warnings::all(&answers).len();
                let counted = screen.lines().find_map(|line| {
                    let (number, _) = line.strip_prefix("! ")?.split_once(" in report.html")?.0.split_once(' ')?;
                    number.parse::<usize>().ok()
                });
                let shown = screen.lines().filter(|line| line.starts_with("! ")).count();
                let total = counted.map_or(shown, |more| shown - 1 + more);
                assert_eq!(total, all, "{command}, {remarks}:\n{screen}");
                assert!(screen.lines().count() <= LINES, "{screen}");
            }
        }
    }

    #[test]
    fn results_that_do_not_fit_are_counted() {
        let mut outcomes = marched::study();
        outcomes.backend.name = "a device ".repeat(200);
        let screen = screen(&outcomes.answers("study"));
        assert!(screen.contains(" more lines in report.html\n"), "{screen}");
    }

    #[test]
    fn a_prediction_shows_the_peak_temperature_of_the_bondline_and_its_time() {
        let outcomes = marched::study();
        let screen = screen(&outcomes.answers("predict"));
        let peak = outcomes.nominal.peaks[3];
        let line = screen.lines().find(|line| line.starts_with("TC4")).expect("a line for TC4");
        assert!(line.contains(&format::kelvin(peak.temperature_k)), "{line}");
        assert!(line.contains(&format::seconds(peak.time_s)), "{line}");
    }

    #[test]
    fn an_energy_imbalance_is_warned_of_on_the_screen() {
        let mut outcomes = marched::study();
        let sound = screen(&outcomes.answers("predict"));
        outcomes.nominal.balance.stored_j_m2 *= 1.1;
        let leaking = screen(&outcomes.answers("predict"));
        assert!(!sound.contains("energy balance") && leaking.contains("energy balance"), "{leaking}");
    }
}
