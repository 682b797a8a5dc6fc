//! Margins to the temperature limits of a case: of the nominal prediction and, after a sweep, of its members.

mod record;

pub(super) use record::write_summary;

use super::files::table::{NamedFile, Names, Table};
use super::html::table::{list, table};
use super::reportable::Finding;
use super::terminal::{Column, aligned, head, wrap};
use super::{ReportError, format};
use crate::case::{LimitedPart, TemperatureLimit};
use crate::study::answers::Answers;
use crate::study::margins::{HeatLoad, Margin, MarginSpread, PeakPercentile};
use crate::study::nominal::Prediction;

/// Questions whose answer has margins.
const QUESTIONS: [&str; 4] = ["predict", "uncertainty", "study", "merge"];
/// Rows of the screen at most.
const MAX_SCREEN_ROWS: usize = 6;

/// A limit with the name of its part, the nominal margin, and that of the members.
struct Row<'a> {
    part: String,
    limit: &'a TemperatureLimit,
    nominal: &'a Margin,
    spread: Option<&'a MarginSpread>,
}

fn rows<'a>(answers: &'a Answers, outcome: &'a Prediction) -> Vec<Row<'a>> {
    if !QUESTIONS.contains(&answers.question) {
        return Vec::new();
    }
    let spreads = answers.uncertainty.as_ref().and_then(|swept| swept.margins.as_ref());
    let limits = answers.case.limits.iter().zip(&outcome.margins).enumerate();
    let row = |(index, (limit, nominal)): (usize, (&'a TemperatureLimit, &'a Margin))| Row {
        part: answers.case.limited_part(limit),
        limit,
        nominal,
        spread: spreads.map(|spreads| &spreads.limits[index]),
    };
    limits.map(row).collect()
}

/// Name and highest nominal temperature, K, of each ply without a limit, in a report with margins.
fn plies_without_limit(answers: &Answers, outcome: &Prediction) -> Vec<(String, f64)> {
    let limits = &answers.case.limits;
    let is_free = |ply: usize| limits.iter().all(|limit| limit.part != LimitedPart::Ply(ply));
    let plies = answers.case.layup.plies.iter().zip(&outcome.extremes_k).enumerate();
    let free = plies.filter(|(ply, _)| is_free(*ply));
    free.map(|(_, (ply, (_, highest_k)))| (ply.name.clone(), *highest_k)).collect()
}

fn heat_load(answers: &Answers) -> Option<&HeatLoad> {
    Some(&answers.uncertainty.as_ref()?.margins.as_ref()?.heat_load)
}

/// The part that is closest to its limit, or furthest above it.
pub(super) fn finding(answers: &Answers, outcome: &Prediction) -> Option<Finding> {
    let rows = rows(answers, outcome);
    // A march that failed has no margins.
    let known = rows.iter().filter(|row| !row.nominal.margin_k.is_nan());
    let row = known.min_by(|a, b| a.nominal.margin_k.total_cmp(&b.nominal.margin_k))?;
    let side = if row.nominal.margin_k < 0.0 { "above" } else { "below" };
    let nominal = format!(
        "{} peaks at {} nominally, {} {side} its limit of {}",
        row.part,
        format::kelvin(row.nominal.peak.temperature_k),
        format::temperature_difference(row.nominal.margin_k.abs()),
        format::kelvin(row.limit.limit_k)
    );
    let members = row.spread.map_or(String::new(), |spread| {
        format!("; {} of {} exceed it", share(spread), format::counted(spread.exceeding.total, "member"))
    });
    let smallest = if rows.len() > 1 { "Smallest margin: " } else { "" };
    Some(Finding { label: "Margins", text: format!("{smallest}{nominal}{members}.") })
}

/// Warnings about limits and the run.
pub(super) fn warnings(answers: &Answers, outcome: &Prediction) -> Vec<String> {
    let rows = rows(answers, outcome);
    let below_start = rows.iter().enumerate().filter_map(|(index, row)| {
        let start_k = *outcome.limited_k.get(index)?.first()?;
        (row.limit.limit_k < start_k).then(|| {
            format!(
                "The limit of {}, {}, is below its initial temperature of {}.",
                row.part,
                format::kelvin(row.limit.limit_k),
                format::kelvin(start_k)
            )
        })
    });
    let warming: Vec<&str> = rows.iter().filter(|row| row.nominal.still_warming).map(|row| row.part.as_str()).collect();
    let warming = (!warming.is_empty()).then(|| {
        format!(
            "At the end of the run {} still warms: its peak and its margin need a longer duration.",
            format::list(&warming)
        )
    });
    let failed = answers.uncertainty.as_ref().map_or(0, |swept| swept.members - swept.completed);
    let failed = (failed > 0 && !rows.is_empty()).then(|| {
        format!("{} failed; in the margins they count as above every limit.", format::counted(failed, "member"))
    });
    below_start.chain(warming).chain(failed).collect()
}

/// The section of the page: one table with a column for each part, and what its numbers mean.
pub(super) fn page(answers: &Answers, outcome: &Prediction) -> String {
    let rows = rows(answers, outcome);
    let Some(first) = rows.first() else { return String::new() };
    let members = first.spread.map_or(String::new(), |spread| {
        format!(", nominal and over {}", format::counted(spread.exceeding.total, "member"))
    });
    let mut names = NOMINAL_ROWS.to_vec();
    if first.spread.is_some() {
        names.extend(MEMBER_ROWS);
    }
    let columns: Vec<Vec<String>> = rows.iter().map(page_column).collect();
    let titles: Vec<String> = rows.iter().map(|row| format!("{} {}", row.limit.part.kind(), row.part)).collect();
    let head: Vec<&str> = std::iter::once("").chain(titles.iter().map(String::as_str)).collect();
    let cells = names.iter().enumerate().map(|(row, name)| {
        std::iter::once((*name).to_owned()).chain(columns.iter().map(|column| column[row].clone())).collect()
    });
    let cells: Vec<Vec<String>> = cells.collect();
    table(&format!("Margins to the temperature limits{members}"), &head, &cells)
        + &list(&notes(answers, outcome, &rows))
}

const NOMINAL_ROWS: [&str; 5] = ["Limit, K", "Nominal peak, K", "Time of peak, s", "Margin, K", "Time above, s"];
const MEMBER_ROWS: [&str; 12] = [
    "Members above, %",
    "95 % interval",
    "Mean ± 3σ, K",
    "P95, K",
    "95 % interval",
    "P99, K",
    "95 % interval",
    "P99.87, K",
    "95 % interval",
    "95/99 bound, K",
    "Margin of it, K",
    "P95 time above, s",
];

/// The cells of a part, in the order of the rows.
fn page_column(row: &Row<'_>) -> Vec<String> {
    let (nominal, limit_k) = (row.nominal, row.limit.limit_k);
    let mut cells = vec![
        format::trim_zeros(format::grouped(limit_k, 1)),
        format::grouped(nominal.peak.temperature_k, 1),
        format::grouped(nominal.peak.time_s, 1),
        format::signed(nominal.margin_k, 1),
        format::grouped(nominal.time_above_s, 1),
    ];
    let Some(spread) = row.spread else { return cells };
    let share = share(spread).replace(" %", "");
    let (share, interval) = share.split_once(" (").unwrap_or((&share, "–"));
    cells.extend([share.to_owned(), interval.trim_end_matches(')').to_owned()]);
    let three_k = format::significant(3.0 * spread.deviation_k, 2);
    cells.push(format!("{} ± {three_k}", format::grouped(spread.mean_k, 1)));
    for percentile in &spread.percentiles {
        let end = |end_k: Option<f64>| end_k.map_or("–".to_owned(), |end_k| format::grouped(end_k, 1));
        cells.push(format::grouped(percentile.value_k, 1));
        cells.push(match (percentile.low_k, percentile.high_k) {
            (None, None) => "–".to_owned(),
            (low_k, high_k) => format!("{} to {}", end(low_k), end(high_k)),
        });
    }
    let bound = |of: &dyn Fn(f64) -> String| spread.tolerance_bound_k.map_or("–".to_owned(), of);
    cells.push(bound(&|bound_k| format::grouped(bound_k, 1)));
    cells.push(bound(&|bound_k| format::signed(limit_k - bound_k, 1)));
    cells.push(format::grouped(spread.time_above_p95_s, 1));
    cells
}

/// Notes on the meaning of the numbers of the table, and on effects that they leave out.
fn notes(answers: &Answers, outcome: &Prediction, rows: &[Row<'_>]) -> Vec<String> {
    let mut notes = vec![
        "The peak is the highest temperature over the run, at the time steps and on the curve between them: of a ply \
         at its hottest point, inside or on a face; of an interface at the hotter of its two faces; of a sensor its \
         reading. The margin is the limit minus the peak."
            .to_owned(),
    ];
    let free = plies_without_limit(answers, outcome);
    if !free.is_empty() {
        let free: Vec<String> =
            free.iter().map(|(name, highest_k)| format!("{name} {} K", format::grouped(*highest_k, 0))).collect();
        notes.push(format!("Plies without a limit, highest temperature nominally: {}.", format::list(&free)));
    }
    let mut excluded = Vec::new();
    if let Some(reached) = &outcome.error_estimate {
        excluded.push(format!("the discretisation error ({})", format::temperature_difference(reached.nominal_k)));
    }
    let mut heat = format!(
        "Heat into the hot face, net of its radiation while heat flows in: {} MJ/m² nominally",
        megajoules(outcome.balance.hot_in_j_m2)
    );
    if let (Some(swept), Some(load)) = (&answers.uncertainty, heat_load(answers)) {
        let members = format::counted(rows[0].spread.map_or(0, |spread| spread.exceeding.total), "member");
        notes.push(format!(
            "{members}: all factors vary together ({} bounds, {} sampling, seed {}) and never leave their bounds, so \
             that the tails hold no value beyond them. Members above: the share whose peak exceeds the limit; a member \
             that failed counts as above it.",
            swept.bounds.name(),
            swept.sampling,
            swept.seed
        ));
        notes.push("P95, P99 and P99.87 are percentiles of the members' peaks.".to_owned());
        if let Some(reason) = dependence(answers) {
            notes.push(reason);
        } else {
            notes.push(
                "The interval of the share is that of Clopper and Pearson. Intervals of percentiles are members of \
                 certain ranks and hold for any distribution. 95/99 bound: with 95 % confidence at least 99 % of all \
                 peaks are below it, for any distribution; it needs 299 members. A dash: too few members, or too many \
                 that failed."
                    .to_owned(),
            );
            notes.push(
                "Confidence is about the number of members alone: more members narrow the intervals, but do not make \
                 model, factors and their bounds more certain."
                    .to_owned(),
            );
        }
        heat += &format!(
            "; over the members {} ± {} MJ/m² (mean ± 3σ), at most {} MJ/m²",
            megajoules(load.mean_j_m2),
            format::significant(3e-6 * load.deviation_j_m2, 2),
            megajoules(load.max_j_m2)
        );
        let failed = swept.members - swept.completed;
        if failed > 0 {
            excluded.push(format!(
                "{} in means, standard deviations, times above and heat",
                format::counted(failed, "failed member")
            ));
        }
        excluded.push("properties and loads that no factor varies".to_owned());
    } else {
        excluded.push("any uncertainty of properties and loads (`bondline uncertainty`)".to_owned());
    }
    excluded.push("the error of the model itself".to_owned());
    notes.push(heat + ".");
    notes.push(format!("Not in this table: {}.", format::list(&excluded)));
    notes
}

fn megajoules(heat_j_m2: f64) -> String {
    format::significant(1e-6 * heat_j_m2, 4)
}

/// A part: one with a limit, or a ply without one with its name and its highest temperature.
pub(super) struct PartRow<'a> {
    part: &'a str,
    kind: &'static str,
    limit_k: f64,
    peak_k: f64,
    nominal: Option<&'a Margin>,
    spread: Option<&'a MarginSpread>,
    /// Nominal, then mean and maximum of the members.
    heat_loads_j_m2: [f64; 3],
}

impl PartRow<'_> {
    fn of_nominal(&self, value: fn(&Margin) -> f64) -> f64 {
        self.nominal.map_or(f64::NAN, value)
    }

    fn of_members(&self, value: fn(&MarginSpread) -> f64) -> f64 {
        self.spread.map_or(f64::NAN, value)
    }

    /// One number of every percentile: its value or an end of its interval.
    fn percentiles(&self, value: fn(&PeakPercentile) -> Option<f64>) -> Vec<f64> {
        let of = |spread: &MarginSpread| spread.percentiles.iter().map(|at| value(at).unwrap_or(f64::NAN)).collect();
        self.spread.map_or(vec![f64::NAN; 3], of)
    }
}

pub(super) fn parts_table<'a>() -> Table<PartRow<'a>> {
    Table::<PartRow<'a>>::new(
        &["margins.csv"],
        "One row per temperature limit (`predict`, `uncertainty`, `study`, `merge`, if the case states any): plies and \
         interfaces from the hot face down, then sensors. Plies without a limit follow, with their nominal peak alone. \
         Columns of the members are empty without a sweep; an end of an interval and the tolerance bound are empty \
         where there are too few members or too many that failed, and with `lhs` and `sobol` sampling, whose members \
         are not independent. A failed member counts as above every limit and every peak; a percentile among failed \
         members is empty.",
    )
    .text("part", "Name of the part (`INS2/GB` for an interface).", |row| row.part.to_owned())
    .text("kind", "`ply`, `interface` or `sensor`.", |row| row.kind.to_owned())
    .number("limit_k", "K", "The limit.", |row| row.limit_k)
    .number("nominal_peak_k", "K", "Highest temperature of the part over depth and time, at nominal factors.", |row| {
        row.peak_k
    })
    .number("nominal_peak_time_s", "s", "Its time.", |row| row.of_nominal(|margin| margin.peak.time_s))
    .number("nominal_margin_k", "K", "Limit minus peak.", |row| row.of_nominal(|margin| margin.margin_k))
    .number("nominal_time_above_s", "s", "Time above the limit.", |row| row.of_nominal(|margin| margin.time_above_s))
    .number("members_above", "–", "Members whose peak is above the limit or that failed.", |row| {
        row.of_members(|spread| spread.exceeding.count as f64)
    })
    .number("members", "–", "All members.", |row| row.of_members(|spread| spread.exceeding.total as f64))
    .number("share_above", "–", "Probability of exceeding the limit.", |row| {
        row.of_members(|spread| spread.exceeding.fraction())
    })
    .numbers("share_above_{low,high}", "–", "Its Clopper–Pearson interval.", |row| {
        let ends = row.spread.and_then(|spread| spread.exceeding_interval);
        ends.map_or(vec![f64::NAN; 2], |(low, high)| vec![low, high])
    })
    .number("mean_k", "K", "Mean of the peak, of completed members.", |row| row.of_members(|spread| spread.mean_k))
    .number("standard_deviation_k", "K", "Its standard deviation.", |row| row.of_members(|spread| spread.deviation_k))
    .numbers("mean_{minus,plus}_3_sigma_k", "K", "Mean less and plus three standard deviations.", |row| {
        let sign = |spread: &MarginSpread, sign: f64| spread.mean_k + sign * 3.0 * spread.deviation_k;
        row.spread.map_or(vec![f64::NAN; 2], |spread| vec![sign(spread, -1.0), sign(spread, 1.0)])
    })
    .number("maximum_k", "K", "Highest peak of completed members.", |row| row.of_members(|spread| spread.max_k))
    .numbers("p{95,99,99.87}_k", "K", "Percentiles of the peak.", |row| row.percentiles(|at| Some(at.value_k)))
    .numbers("p{95,99,99.87}_low_k", "K", "Lower ends of their distribution-free 95 % intervals.", |row| {
        row.percentiles(|at| at.low_k)
    })
    .numbers("p{95,99,99.87}_high_k", "K", "Upper ends.", |row| row.percentiles(|at| at.high_k))
    .number(
        "tolerance_95_99_k",
        "K",
        "With 95 % confidence, at least 99 % of all peaks are below it (299 members).",
        |row| row.spread.and_then(|spread| spread.tolerance_bound_k).unwrap_or(f64::NAN),
    )
    .number("p95_time_above_s", "s", "95th percentile of the time above, of completed members.", |row| {
        row.of_members(|spread| spread.time_above_p95_s)
    })
    .number("maximum_time_above_s", "s", "Its maximum.", |row| row.of_members(|spread| spread.time_above_max_s))
    .numbers(
        "{nominal,mean,maximum}_heat_load_j_m2",
        "J/m²",
        "Heat into the hot face, while it flows in; over the members.",
        |row| row.heat_loads_j_m2.to_vec(),
    )
}

/// `margins.csv`; none without limits.
pub(super) fn csv(answers: &Answers, outcome: &Prediction) -> Result<Option<NamedFile>, ReportError> {
    let rows = rows(answers, outcome);
    if rows.is_empty() {
        return Ok(None);
    }
    let load = heat_load(answers);
    let heat_loads_j_m2 = [
        outcome.balance.hot_in_j_m2,
        load.map_or(f64::NAN, |load| load.mean_j_m2),
        load.map_or(f64::NAN, |load| load.max_j_m2),
    ];
    let limited = rows.iter().map(|row| PartRow {
        part: &row.part,
        kind: row.limit.part.kind(),
        limit_k: row.limit.limit_k,
        peak_k: row.nominal.peak.temperature_k,
        nominal: Some(row.nominal),
        spread: row.spread,
        heat_loads_j_m2,
    });
    let others = plies_without_limit(answers, outcome);
    let others = others.iter().map(|(name, highest_k)| PartRow {
        part: name,
        kind: LimitedPart::Ply(0).kind(),
        limit_k: f64::NAN,
        peak_k: *highest_k,
        nominal: None,
        spread: None,
        heat_loads_j_m2: [f64::NAN; 3],
    });
    parts_table().csv(&Names::default(), limited.chain(others)).map(Some)
}

/// The lines of the screen: the parts with the smallest margins, in the order of the case.
pub(super) fn lines(answers: &Answers, outcome: &Prediction) -> Vec<String> {
    let rows = rows(answers, outcome);
    let Some(first) = rows.first() else { return Vec::new() };
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| rows[a].nominal.margin_k.total_cmp(&rows[b].nominal.margin_k));
    order.truncate(MAX_SCREEN_ROWS);
    order.sort_unstable();
    let swept = first.spread.is_some();
    let (above, bound) = if swept { ("members above limit", "95/99 bound") } else { ("", "") };
    let mut table = vec![head(["limit of", "limit", "peak", "margin", "exceeded", above, bound])];
    for row in order.into_iter().map(|index| &rows[index]) {
        let nominal = row.nominal;
        let unit = |temperature_k: f64, text: String| if temperature_k.is_nan() { text } else { text + " K" };
        let whole = |temperature_k: f64| unit(temperature_k, format::grouped(temperature_k, 0));
        let (above, bound) = row.spread.map_or((String::new(), String::new()), |spread| {
            (share_text(spread), spread.tolerance_bound_k.map_or("–".to_owned(), whole))
        });
        let margin_decimals = if nominal.margin_k.abs() < 10.0 { 1 } else { 0 };
        table.push([
            format::truncate(&row.part, 8),
            whole(row.limit.limit_k),
            whole(nominal.peak.temperature_k),
            unit(nominal.margin_k, format::signed(nominal.margin_k, margin_decimals)),
            format::seconds(nominal.time_above_s),
            above,
            bound,
        ]);
    }
    let [part, share] = [(0, 9), (1, 26)].map(|(gap, width)| Column::Left { gap, width });
    let [limit, peak, margin, exceeded, bound] = [8, 8, 8, 9, 11].map(Column::Right);
    let mut lines = aligned([part, limit, peak, margin, exceeded, share, bound], &table);
    if rows.len() > MAX_SCREEN_ROWS {
        lines.push(format!("{} in report.html", format::counted(rows.len() - MAX_SCREEN_ROWS, "larger margin")));
    }
    lines.extend(dependence(answers).filter(|_| swept).into_iter().flat_map(|reason| wrap("", &reason)));
    lines
}

/// The share of members above the limit, with its interval if there is one.
fn share(spread: &MarginSpread) -> String {
    match spread.exceeding_interval {
        Some(_) => format::proportion(spread.exceeding),
        None => format::percent_near_limits(spread.exceeding.fraction()),
    }
}

/// [`share`], without its interval where that is longer than its column.
fn share_text(spread: &MarginSpread) -> String {
    let text = share(spread);
    if text.chars().count() <= 26 { text } else { format::percent_near_limits(spread.exceeding.fraction()) }
}

/// Why the margins of the members have no intervals and no bound; `None` where they have.
fn dependence(answers: &Answers) -> Option<String> {
    let swept = answers.uncertainty.as_ref().filter(|swept| !swept.has_independent_members)?;
    Some(format::dependence(swept.sampling, "95 % intervals and no 95/99 bound"))
}

#[cfg(test)]
mod tests {
    use super::super::marched;
    use super::super::terminal::screen;
    use super::*;
    use crate::fit::proportion::Proportion;
    use crate::study::margins::{MarginStatistics, PEAK_PROBABILITIES, PeakPercentile};
    use crate::study::nominal::Peak;
    use crate::study::uncertainty::Failure;

    /// The study with limits of two parts, the second of which is exceeded.
    fn limited() -> marched::Study {
        let mut outcomes = marched::study();
        let limit = |part, limit_k| TemperatureLimit { part, limit_k };
        outcomes.case.limits = vec![limit(LimitedPart::Interface(3), 700.0), limit(LimitedPart::Sensor(3), 600.0)];
        let margin = |limit_k: f64, temperature_k: f64| Margin {
            peak: Peak { temperature_k, time_s: 78.0 },
            margin_k: limit_k - temperature_k,
            time_above_s: if temperature_k > limit_k { 12.5 } else { 0.0 },
            still_warming: false,
        };
        outcomes.nominal.margins = vec![margin(700.0, 640.0), margin(600.0, 622.4)];
        outcomes.nominal.limited_k = vec![vec![300.0], vec![300.0]];
        let spread = |count, value_k: f64| MarginSpread {
            exceeding: Proportion { count, total: 5000 },
            exceeding_interval: Some(Proportion { count, total: 5000 }.interval_95()),
            mean_k: value_k,
            deviation_k: 5.0,
            max_k: value_k + 20.0,
            percentiles: PEAK_PROBABILITIES.map(|probability| PeakPercentile {
                probability,
                value_k: value_k + 10.0 * probability,
                low_k: Some(value_k + 9.0),
                high_k: (probability < 0.998).then_some(value_k + 11.0),
            }),
            tolerance_bound_k: Some(value_k + 12.0),
            time_above_p95_s: 15.0,
            time_above_max_s: 18.0,
        };
        let swept = &mut outcomes.uncertainty;
        (swept.requested, swept.members, swept.completed) = (5000, 5000, 4997);
        let reason = "a temperature left the range of a table".to_owned();
        swept.failures = vec![Failure { reason, members: 3, first: 1204 }];
        let heat_load = HeatLoad { mean_j_m2: 9.2e6, deviation_j_m2: 2e5, max_j_m2: 9.9e6 };
        let limits = vec![spread(0, 641.0), spread(4900, 623.0)];
        outcomes.uncertainty.margins = Some(MarginStatistics { limits, heat_load });
        outcomes
    }

    #[test]
    fn the_finding_is_the_part_furthest_above_its_limit() {
        let outcomes = limited();
        let text = finding(&outcomes.answers("uncertainty"), &outcomes.nominal).expect("a finding").text;
        let expected =
            "Smallest margin: TC4 peaks at 622 K (349 °C) nominally, 22.4 K above its limit of 600 K (327 °C)";
        assert!(text.starts_with(expected) && text.contains("98.00 % ("), "{text}");
        assert!(finding(&outcomes.answers("sensitivity"), &outcomes.nominal).is_none());
        let free = marched::study();
        assert!(finding(&free.answers("predict"), &free.nominal).is_none());
    }

    #[test]
    fn the_table_of_a_prediction_has_no_columns_of_members() {
        let outcomes = limited();
        let alone = page(&outcomes.answers("predict"), &outcomes.nominal);
        assert!(alone.contains("interface INS2/GB") && !alone.contains("P99"), "{alone}");
        assert!(alone.contains("any uncertainty of properties and loads"));
    }

    #[test]
    fn the_table_of_a_sweep_names_the_members_the_confidence_and_what_is_not_in_it() {
        let outcomes = limited();
        let page = page(&outcomes.answers("uncertainty"), &outcomes.nominal);
        for text in ["5,000 members", "Clopper and Pearson", "to –<", "3 failed members", "error of the model itself"]
        {
            assert!(page.contains(text), "no {text:?} in {page}");
        }
    }

    /// Neither screen nor page nor table has an interval or a bound; both texts have the reason.
    #[test]
    fn members_that_are_not_independent_have_no_interval_and_no_bound_in_any_output() {
        let mut outcomes = limited();
        let of_independent = page(&outcomes.answers("uncertainty"), &outcomes.nominal);
        outcomes.uncertainty.sampling = "lhs";
        outcomes.uncertainty.has_independent_members = false;
        for spread in &mut outcomes.uncertainty.margins.as_mut().expect("margins").limits {
            (spread.exceeding_interval, spread.tolerance_bound_k) = (None, None);
            spread.percentiles.iter_mut().for_each(|percentile| (percentile.low_k, percentile.high_k) = (None, None));
        }
        let answers = outcomes.answers("uncertainty");
        let page = page(&answers, &outcomes.nominal);
        let screen = screen(&answers).split_whitespace().collect::<Vec<_>>().join(" ");
        for text in [&page, &screen] {
            assert!(text.contains("members of lhs sampling are not independent"), "{text}");
        }
        for interval in ["Clopper", " to –", "632.0 to 634.0"] {
            assert!(!page.contains(interval), "{interval} in {page}");
        }
        assert!(of_independent.contains("Clopper") && of_independent.contains("632.0 to 634.0"), "{of_independent}");
        let (_, bytes) = csv(&answers, &outcomes.nominal).expect("a table").expect("there are limits");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head = rows.headers().expect("a head").clone();
        let row = rows.records().next().expect("a limit").expect("a row");
        for (name, cell) in head.iter().zip(&row) {
            let is_of_interval = name.contains("_low") || name.contains("_high") || name.starts_with("tolerance");
            assert_eq!(cell.is_empty(), is_of_interval, "{name} {cell}");
        }
    }

    #[test]
    fn every_row_of_the_table_file_has_every_column() {
        let outcomes = limited();
        for question in ["predict", "uncertainty"] {
            let (name, bytes) =
                csv(&outcomes.answers(question), &outcomes.nominal).expect("a table").expect("there are limits");
            assert_eq!(name, "margins.csv");
            let mut rows = csv::Reader::from_reader(bytes.as_slice());
            let head = rows.headers().expect("a head").clone();
            let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("as long as the head")).collect();
            // Five plies without a limit follow the two limits.
            assert_eq!(rows.len(), 2 + 5);
            assert_eq!((&rows[2][1], &rows[2][2], rows[2][3].is_empty()), ("ply", "", false));
            let cell = |name: &str| {
                let column = head.iter().position(|column| column == name).unwrap_or_else(|| panic!("no {name}"));
                rows[1][column].to_owned()
            };
            assert_eq!((cell("limit_k"), cell("nominal_margin_k")), ("600".to_owned(), "-22.4".to_owned()));
            let is_swept = question == "uncertainty";
            assert_eq!(cell("members_above"), if is_swept { "4900" } else { "" });
            assert_eq!(cell("p99.87_high_k"), "");
            assert_eq!(cell("tolerance_95_99_k"), if is_swept { "635" } else { "" });
        }
    }

    #[test]
    fn the_screen_shows_every_limit_within_80_columns() {
        let outcomes = limited();
        for question in ["predict", "uncertainty", "study"] {
            let screen = screen(&outcomes.answers(question));
            let line = screen.lines().find(|line| line.starts_with("INS2/GB")).unwrap_or_else(|| panic!("{screen}"));
            assert!(line.contains("640 K") && line.contains("+60 K"), "{line}");
            assert_eq!(line.ends_with("653 K"), question != "predict", "{line}");
            assert!(screen.lines().all(|line| line.chars().count() <= 80), "{screen}");
        }
    }
}
