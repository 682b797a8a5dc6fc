//! The Monte Carlo sweep: prediction intervals and sensitivity indices.

mod figures;
mod record;
mod sensitivity_indices;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{paragraph, table};
use super::observations::misfit_text;
use super::reportable::{Finding, MemberCounts, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, shown_sensors, wrap};
use super::{ReportError, format};
use crate::case::Case;
use crate::statistics::{ConfidenceInterval, SensitivityIndices};
use crate::study::answers::Answers;
use crate::study::uncertainty::{MembersError, Spread, SweepError, Uncertainty};
use crate::study::validity::UNUSABLE_MULTIPLE;

impl Reportable for Uncertainty {
    fn members(&self) -> Option<MemberCounts> {
        Some(MemberCounts {
            requested: self.requested,
            completed: self.completed,
            failed: self.members - self.completed,
        })
    }

    fn facts(&self) -> Vec<String> {
        vec![format::counted(self.members, "member")]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let Some(sensor) = answers.deepest_sensor() else { return Vec::new() };
        let text = [
            ("Uncertainty", Some(peak_interval(&answers.case, self, sensor))),
            ("Variance shares", largest_shares(&answers.case, self, sensor)),
            ("Sobol indices", sensitivity_indices::variance_decomposition(answers, self, sensor)),
        ];
        text.into_iter().filter_map(|(about, text)| text.map(|text| Finding { label: about, text })).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        let stopped = self.is_partial().then(|| {
            format!(
                "The sweep was stopped after {} of {}; intervals are those of the members so far, whose \
                 discretisation error is not measured.",
                format::count(self.members),
                format::counted(self.requested, "member")
            )
        });
        let failed = self.failures.iter().map(|failure| {
            format!(
                "{} of {} failed ({}), first member {}; they are in no statistic of a sensor.",
                format::count(failure.members),
                format::counted(self.members, "member"),
                failure.reason,
                format::count(failure.first)
            )
        });
        stopped.into_iter().chain(failed).chain(self.inaccuracy(answers)).collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let figures = figures::figures(&answers.case, self, answers.nominal.as_ref());
        figures.into_iter().map(|figure| ("uncertainty", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("uncertainty", "Uncertainty", page(answers, self))]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        vec![format!(
            "Uncertainty: Monte Carlo simulation; each member samples all factors within their {} bounds. Variance \
             shares are squared Pearson correlations of factor and temperature, normalised to sum to one; they assume \
             linear effects and independent factors. Sobol indices do not: they come from a least-squares fit of \
             orthonormal polynomials of one and of two factors to all members, of the degree that predicts members \
             left out of the fit best; the share of the variance that is then unexplained is reported. Rank \
             correlations are Spearman's; the partial rank correlation (PRCC) removes the linear effect of the other \
             factors on the ranks.",
            self.bounds.name()
        )]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![percentiles_table().description(), shares_table().description(), second_order_table().description()]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let (case, names) = (&answers.case, Names::of(&answers.case));
        let percentiles = percentiles_table().csv(&names, instants(case, self))?;
        let mut tables = vec![percentiles, shares_table().csv(&names, instants(case, self))?];
        if self.peaks.iter().any(|peak| !peak.temperature_indices.second.is_empty()) {
            tables.push(second_order_table().csv(&names, pairs(case, self))?);
        }
        Ok(tables)
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("variance_shares", &record::variance_shares(&answers.case, self))?;
        record.put("sensitivity_indices", &record::sensitivity_indices(&answers.case, self))?;
        record.put("simultaneous_bands", &record::simultaneous_bands(&answers.case, self))?;
        if let Some(found) = &self.discretisation_error {
            record.put("sweep_discretisation_error", found)?;
        }
        Ok(())
    }
}

impl Uncertainty {
    /// A warning where the error of members is far above the tolerance that the nominal member meets.
    fn inaccuracy(&self, answers: &Answers) -> Option<String> {
        let tolerance_k = answers.nominal_march()?.error_estimate.as_ref()?.tolerance_k;
        let found = self.discretisation_error.as_ref()?;
        let error_k = [&found.extreme, &found.others].into_iter().filter_map(|of| of.temperature_k).reduce(f64::max)?;
        (error_k > UNUSABLE_MULTIPLE * tolerance_k).then(|| {
            format!(
                "The {}; cells and steps are adapted to the nominal member and its tolerance of {} K. State a smaller \
                 tolerance in [resolution] for a smaller error.",
                discretisation_error(found),
                format::significant(tolerance_k, 2)
            )
        })
    }
}

/// The discretisation error of members of a sweep, as a clause.
fn discretisation_error(found: &SweepError) -> String {
    let SweepError { extreme, others } = found;
    let extreme_members = match extreme.members {
        1 => "the most extreme one".to_owned(),
        members => format!("the {} most extreme", format::count(members)),
    };
    let error = |of: &MembersError| format::members_error(of.temperature_k, of.failed);
    let others = match others.members {
        0 => String::new(),
        members => format!(" and {} in {}", error(others), format::counted(members, "other")),
    };
    format!("discretisation error of members is {} in {extreme_members}{others}", error(extreme))
}

/// The lines of the screen: the table of sensors and, where there is room, the Sobol indices.
pub(super) fn lines(answers: &Answers, outcome: &Uncertainty, most: usize, room: &ScreenLimits) -> Vec<String> {
    let mut lines = table_on_screen(answers, outcome, most);
    if !room.is_shared {
        lines.extend(outcome.discretisation_error.iter().flat_map(|found| wrap("", &discretisation_error(found))));
    }
    if let (Some(sensor), false) = (answers.deepest_sensor(), room.is_shared) {
        lines.extend(
            sensitivity_indices::variance_decomposition(answers, outcome, sensor)
                .into_iter()
                .flat_map(|text| wrap("", &text)),
        );
    }
    lines
}

fn table_on_screen(answers: &Answers, outcome: &Uncertainty, most: usize) -> Vec<String> {
    let mut rows = vec![head(["sensor", "nominal peak", "time", "RMSE", "std dev", "95 % interval", "largest share"])];
    let (sensors, others) = shown_sensors(answers, most);
    for index in sensors {
        let peak = &outcome.peaks[index];
        let [low_k, .., high_k] = peak.percentiles_k;
        let (deviation, within) = if outcome.completed > 1 {
            let within = format!("{}–{} K", format::grouped(low_k, 0), format::grouped(high_k, 0));
            (format::temperature_change(peak.deviation_k), within)
        } else {
            ("-".to_owned(), "-".to_owned())
        };
        let top_factors = ranked_shares(outcome, index).into_iter().next();
        let top_factors = top_factors.filter(|(_, share)| *share > 0.0).map_or("-".to_owned(), |(factor, share)| {
            format!("{} {}", format::truncate(&answers.case.factors[factor].name, 10), format::percent(share))
        });
        rows.push([
            format::truncate(&answers.case.sensors[index].name, 6),
            format::kelvin(peak.nominal.temperature_k),
            format::seconds(peak.nominal.time_s),
            answers.nominal.as_ref().map_or("-".to_owned(), |nominal| misfit_text(answers, nominal, index).0),
            deviation,
            within,
            top_factors,
        ]);
    }
    let [name, share] = [(0, 7), (2, 0)].map(|(gap, width)| Column::Left { gap, width });
    let [peak, time, rms, deviation, within] = [18, 8, 9, 8, 14].map(Column::Right);
    let mut lines = aligned([name, peak, time, rms, deviation, within, share], &rows);
    lines.extend(others);
    lines
}

fn peak_interval(case: &Case, outcome: &Uncertainty, sensor: usize) -> String {
    if outcome.completed < 2 {
        return format!(
            "{} of {} completed: no statistics.",
            outcome.completed,
            format::counted(outcome.members, "member")
        );
    }
    let peak = &outcome.peaks[sensor];
    format!(
        "Peak of {} over {}: mean {}, standard deviation {} K, 95 % interval {} to {}.",
        case.sensors[sensor].name,
        format::counted(outcome.completed, "member"),
        format::kelvin(peak.mean_k),
        format::significant(peak.deviation_k, 2),
        format::kelvin(peak.percentiles_k[0]),
        format::kelvin(peak.percentiles_k[4])
    )
}

/// The factors with the largest shares of the variance of the peak of a sensor.
fn largest_shares(case: &Case, outcome: &Uncertainty, sensor: usize) -> Option<String> {
    let text: Vec<String> = ranked_shares(outcome, sensor)
        .into_iter()
        .take(3)
        .filter(|(_, share)| *share >= 0.05)
        .map(|(factor, share)| {
            let factor = &case.factors[factor];
            format!("{} ({}, {})", factor.name, format::factor_meaning(factor), format::percent(share))
        })
        .collect();
    let name = &case.sensors[sensor].name;
    (!text.is_empty())
        .then(|| format!("Largest shares of the variance of the peak of {name}: {}.", format::list(&text)))
}

/// Factors with their shares of the variance of the peak of a sensor, largest first.
fn ranked_shares(outcome: &Uncertainty, sensor: usize) -> Vec<(usize, f64)> {
    let shares = outcome.peaks[sensor].temperature_indices.shares.iter().copied();
    let mut shares: Vec<(usize, f64)> = shares.enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}

fn page(answers: &Answers, outcome: &Uncertainty) -> String {
    let case = &answers.case;
    let rows: Vec<Vec<String>> = (case.sensors.iter().zip(&outcome.peaks).enumerate())
        .map(|(index, (sensor, peak))| {
            let top_factors: Vec<String> = ranked_shares(outcome, index)
                .into_iter()
                .take(3)
                .filter(|(_, share)| *share >= 0.05)
                .map(|(factor, share)| format!("{} {}", case.factors[factor].name, format::percent(share)))
                .collect();
            vec![
                sensor.name.clone(),
                format::grouped(peak.nominal.temperature_k, 0),
                format::grouped(peak.mean_k, 0),
                format::significant(peak.deviation_k, 2),
                format!(
                    "{} to {}",
                    format::grouped(peak.percentiles_k[0], 0),
                    format::grouped(peak.percentiles_k[4], 0)
                ),
                format!(
                    "{} to {}",
                    format::grouped(peak.percentiles_s[0], 1),
                    format::grouped(peak.percentiles_s[4], 1)
                ),
                top_factors.join(", "),
            ]
        })
        .collect();
    let failures: Vec<Vec<String>> = outcome
        .failures
        .iter()
        .map(|failure| vec![failure.reason.clone(), format::count(failure.members), format::count(failure.first)])
        .collect();
    let drawn = format!(
        "{} sampled ({} sampling, seed {}), {} completed.",
        format::counted(outcome.members, "member"),
        outcome.sampling,
        outcome.seed,
        format::count(outcome.completed)
    );
    let head = [
        "Sensor",
        "Nominal, K",
        "Mean, K",
        "Standard deviation, K",
        "95 % interval, K",
        "Time, 95 % interval, s",
        "Largest shares",
    ];
    let error = outcome.discretisation_error.as_ref().map(|found| format!("The {}.", discretisation_error(found)));
    paragraph(&drawn)
        + &error.map_or(String::new(), |error| paragraph(&error))
        + &table("Peak temperatures of the members", &head, &rows)
        + &table("Failed members", &["Reason", "Members", "First member"], &failures)
        + &answers.deepest_sensor().map(|sensor| peak_indices(answers, outcome, sensor)).unwrap_or_default()
}

/// Sensitivity indices of the peak of a sensor and of its time.
fn peak_indices(answers: &Answers, outcome: &Uncertainty, sensor: usize) -> String {
    let (name, peak) = (&answers.case.sensors[sensor].name, &outcome.peaks[sensor]);
    let of = |quantity: &str, indices| {
        table(
            &format!("Sensitivity indices of the {quantity} of {name}"),
            &sensitivity_indices::HEAD,
            &sensitivity_indices::rows(answers, indices),
        )
    };
    let pairs = sensitivity_indices::pair_rows(&answers.case, &peak.temperature_indices);
    let explained = if pairs.is_empty() {
        String::new()
    } else {
        paragraph(&sensitivity_indices::pair_explanation(&peak.temperature_indices))
    };
    of("peak temperature", &peak.temperature_indices)
        + &of("time of the peak", &peak.time_indices)
        + &paragraph(sensitivity_indices::explanation(outcome))
        + &table(
            &format!("Interactions of factors in the peak temperature of {name}"),
            &sensitivity_indices::PAIR_HEAD,
            &pairs,
        )
        + &explained
}

/// A sensor at an instant.
type InstantRow<'a> = (&'a str, &'a Spread, f64, usize);

fn instants<'a>(case: &'a Case, outcome: &'a Uncertainty) -> impl Iterator<Item = InstantRow<'a>> {
    case.sensors.iter().zip(&outcome.spreads).flat_map(|(sensor, spread)| {
        let instants = outcome.instants_s.iter().enumerate();
        instants.map(move |(at, &time_s)| (sensor.name.as_str(), spread, time_s, at))
    })
}

fn percentiles_table<'a>() -> Table<InstantRow<'a>> {
    Table::<InstantRow<'a>>::new(
        &["percentiles.csv"],
        "One row per sensor and instant (`uncertainty`, `study`, `merge`): statistics over the members.",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("time_s", "s", "Time.", |row| row.2)
    .number("mean_k", "K", "Mean.", |row| row.1.mean_k[row.3])
    .number("standard_deviation_k", "K", "Standard deviation.", |row| row.1.deviation_k[row.3])
    .numbers("{minimum,maximum}_k", "K", "Extremes.", |row| vec![row.1.low_k[row.3], row.1.high_k[row.3]])
    .numbers("p{2.5,25,50,75,97.5}_k", "K", "Percentiles, at each instant separately (pointwise).", |row| {
        row.1.percentiles_k.iter().map(|curve| curve[row.3]).collect()
    })
    .numbers(
        "simultaneous_{low,high}_k",
        "K",
        "Simultaneous band: 95 % of the members stay inside at all instants.",
        |row| vec![row.1.simultaneous.low_k[row.3], row.1.simultaneous.high_k[row.3]],
    )
}

fn shares_table<'a>() -> Table<InstantRow<'a>> {
    fn of<'r>(row: &InstantRow<'r>) -> &'r SensitivityIndices {
        &row.1.indices[row.3]
    }
    fn values(intervals: &[ConfidenceInterval]) -> Vec<f64> {
        intervals.iter().map(|interval| interval.value).collect()
    }
    fn ends(intervals: &[ConfidenceInterval]) -> Vec<f64> {
        let (low, high) = (intervals.iter().map(|of| of.low), intervals.iter().map(|of| of.high));
        low.chain(high).collect()
    }
    Table::<InstantRow<'a>>::new(
        &["shares.csv"],
        "One row per sensor and instant (`uncertainty`, `study`, `merge`): sensitivity indices of the temperature.",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .number("time_s", "s", "Time.", |row| row.2)
    .numbers(
        "<factor>_share",
        "–",
        "Share of the variance: squared correlations, normalised to a sum of one.",
        |row| of(row).shares.clone(),
    )
    .numbers("<factor>_correlation", "–", "Pearson correlation.", |row| values(&of(row).correlations))
    .numbers("<factor>_rank_correlation", "–", "Spearman rank correlation.", |row| values(&of(row).rank_correlations))
    .numbers("<factor>_partial_rank_correlation", "–", "Partial rank correlation coefficient (PRCC).", |row| {
        values(&of(row).partial_rank_correlations)
    })
    .numbers("<factor>_first_order", "–", "First-order Sobol index.", |row| values(&of(row).first))
    .numbers("<factor>_first_order_{low,high}", "–", "Its interval.", |row| ends(&of(row).first))
    .numbers("<factor>_total", "–", "Total Sobol index.", |row| values(&of(row).total))
    .numbers("<factor>_total_{low,high}", "–", "Its interval.", |row| ends(&of(row).total))
    .number(
        "unexplained",
        "–",
        "Share of the variance that the polynomials do not explain, part of every upper end.",
        |row| of(row).unexplained,
    )
}

/// A pair of factors at the peak of a sensor.
type PairRow<'a> = (&'a str, &'static str, [&'a str; 2], ConfidenceInterval);

fn second_order_table<'a>() -> Table<PairRow<'a>> {
    Table::<PairRow<'a>>::new(
        &["second-order.csv"],
        "Interactions of pairs of factors, one row per sensor, quantity and pair (`uncertainty`, `study`, `merge`; not \
         for correlated factors).",
    )
    .text("sensor", "Sensor.", |row| row.0.to_owned())
    .text("quantity", "`peak` (peak temperature) or `peak_time`.", |row| row.1.to_owned())
    .text("factor", "A factor of the pair.", |row| row.2[0].to_owned())
    .text("other_factor", "The other one.", |row| row.2[1].to_owned())
    .number(
        "index",
        "–",
        "Second-order Sobol index: share of the variance due to the interaction of the two.",
        |row| row.3.value,
    )
    .numbers("index_{low,high}", "–", "Its interval.", |row| vec![row.3.low, row.3.high])
}

/// Second-order Sobol indices of the peaks and of their times.
fn pairs<'a>(case: &'a Case, outcome: &Uncertainty) -> Vec<PairRow<'a>> {
    let mut rows = Vec::new();
    for (sensor, peak) in case.sensors.iter().zip(&outcome.peaks) {
        for (quantity, indices) in [("peak", &peak.temperature_indices), ("peak_time", &peak.time_indices)] {
            let pairs = sensitivity_indices::ranked_pairs(indices).into_iter();
            rows.extend(
                pairs.map(|pair| {
                    (sensor.name.as_str(), quantity, sensitivity_indices::pair_names(case, pair), pair.index)
                }),
            );
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{figures, marched};
    use crate::study::nominal::ErrorEstimate;

    #[test]
    fn an_error_of_members_above_ten_tolerances_is_a_warning_and_one_below_is_not() {
        let mut outcomes = marched::study();
        outcomes.nominal.error_estimate = Some(ErrorEstimate::of_temperature(0.031, 0.05));
        let answers = outcomes.answers("study");
        let mut outcome = outcomes.uncertainty.clone();
        let mut warning = |error_k: f64| {
            let extreme = MembersError { members: 50, failed: 1, temperature_k: Some(error_k) };
            let others = MembersError { members: 16, failed: 0, temperature_k: Some(0.035) };
            outcome.discretisation_error = Some(SweepError { extreme, others });
            outcome.inaccuracy(&answers)
        };
        assert_eq!(warning(0.49), None);
        let text = warning(0.51).expect("a warning");
        assert!(text.starts_with("The discretisation error of members is 0.51 K (1 failed) in the 50 most"), "{text}");
    }

    /// Every factor that is named has a share no smaller than any factor that is not.
    #[test]
    fn finding_and_caption_name_the_factors_with_the_largest_shares() {
        let outcomes = marched::study();
        let (case, outcome) = (&outcomes.case, &outcomes.uncertainty);
        let figures = figures::all(&outcomes.answers("study"));
        for (sensor, of) in case.sensors.iter().enumerate() {
            let shares = &outcome.peaks[sensor].temperature_indices.shares;
            let text = largest_shares(case, outcome, sensor).expect("shares");
            let (named, others): (Vec<usize>, Vec<usize>) =
                (0..shares.len()).partition(|&factor| text.contains(&format!("{} (", case.factors[factor].name)));
            let least = named.iter().map(|&factor| shares[factor]).fold(1.0, f64::min);
            let most = others.iter().map(|&factor| shares[factor]).fold(0.0, f64::max);
            assert!(!named.is_empty() && named.len() <= 3 && least >= most, "{text}: {shares:?}");
            for &factor in &named {
                assert!(text.contains(&format::percent(shares[factor])), "{text}: {shares:?}");
            }
            let largest = (0..shares.len()).max_by(|&a, &b| shares[a].total_cmp(&shares[b])).expect("a factor");
            let figure = figures.iter().find(|figure| figure.id == format!("shares-{}", of.name)).expect("a chart");
            let expected = format!(") {} (", case.factors[largest].name);
            let largest_share = format!("has the largest share, {}", format::percent(shares[largest]));
            assert!(
                figure.caption.contains(&expected) && figure.caption.contains(&largest_share),
                "{}",
                figure.caption
            );
        }
    }
}
