//! The Monte Carlo sweep: prediction intervals and sensitivity indices.

mod figures;
mod record;
mod sensitivity_indices;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{CsvTable, NamedFile, cell};
use super::files::tables::{factor_columns, header};
use super::html::table::{paragraph, table};
use super::observations::misfit_text;
use super::reportable::{Finding, MemberCounts, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, shown_sensors, wrap};
use super::{ReportError, format};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::statistics::ConfidenceInterval;
use crate::study::uncertainty::{MembersError, SweepError, Uncertainty};
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

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let mut tables = vec![percentiles(&answers.case, self)?, shares(&answers.case, self)?];
        if self.peaks.iter().any(|peak| !peak.temperature_indices.second.is_empty()) {
            tables.push(second_order(&answers.case, self)?);
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
    let of = |quantity: &str, causes| {
        table(
            &format!("Sensitivity indices of the {quantity} of {name}"),
            &sensitivity_indices::HEAD,
            &sensitivity_indices::rows(answers, causes),
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

fn percentiles(case: &Case, outcome: &Uncertainty) -> Result<NamedFile, ReportError> {
    let columns =
        ["mean_K", "standard_deviation_K", "minimum_K", "p2.5_K", "p25_K", "p50_K", "p75_K", "p97.5_K", "maximum_K"];
    let columns = columns.into_iter().chain(["simultaneous_low_K", "simultaneous_high_K"]);
    let mut table = CsvTable::new("percentiles.csv", ["sensor", "time_s"].into_iter().chain(columns))?;
    for (sensor, spread) in case.sensors.iter().zip(&outcome.spreads) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let percentiles = spread.percentiles_k.iter().map(|curve| curve[at]);
            let after = [spread.high_k[at], spread.simultaneous.low_k[at], spread.simultaneous.high_k[at]];
            let before = [time_s, spread.mean_k[at], spread.deviation_k[at], spread.low_k[at]];
            table.row(Some(&sensor.name), before.into_iter().chain(percentiles).chain(after))?;
        }
    }
    table.finish()
}

/// Second-order Sobol indices of the peaks and of their times.
fn second_order(case: &Case, outcome: &Uncertainty) -> Result<NamedFile, ReportError> {
    let columns = ["sensor", "quantity", "factor", "other_factor", "index", "index_low", "index_high"];
    let mut table = CsvTable::new("second-order.csv", columns)?;
    for (sensor, peak) in case.sensors.iter().zip(&outcome.peaks) {
        for (quantity, causes) in [("peak", &peak.temperature_indices), ("peak_time", &peak.time_indices)] {
            for pair in sensitivity_indices::ranked_pairs(causes) {
                let names = sensitivity_indices::pair_names(case, pair);
                let texts = [&sensor.name, quantity].into_iter().chain(names).map(str::to_owned);
                let ConfidenceInterval { value, low, high } = pair.index;
                table.text_row(texts.chain([value, low, high].map(cell)).collect())?;
            }
        }
    }
    table.finish()
}

fn shares(case: &Case, outcome: &Uncertainty) -> Result<NamedFile, ReportError> {
    let endings = [
        "_share",
        "_correlation",
        "_rank_correlation",
        "_partial_rank_correlation",
        "_first_order",
        "_first_order_low",
        "_first_order_high",
        "_total",
        "_total_low",
        "_total_high",
    ];
    let columns = endings.into_iter().flat_map(|ending| factor_columns(case, ending));
    let columns = columns.chain(["unexplained".to_owned()]);
    let mut table = CsvTable::new("shares.csv", header(&["sensor", "time_s"], columns))?;
    for (sensor, spread) in case.sensors.iter().zip(&outcome.spreads) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let causes = &spread.indices[at];
            let correlations = [&causes.correlations, &causes.rank_correlations, &causes.partial_rank_correlations];
            let ends = [
                |index: &ConfidenceInterval| index.value,
                |index: &ConfidenceInterval| index.low,
                |index: &ConfidenceInterval| index.high,
            ];
            let indices = [&causes.first, &causes.total].into_iter();
            let indices = indices.flat_map(|of| ends.into_iter().flat_map(move |end| of.iter().map(end)));
            let values = causes.shares.iter().copied();
            let values = values.chain(correlations.into_iter().flatten().map(|likely| likely.value)).chain(indices);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(values).chain([causes.unexplained]))?;
        }
    }
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{figures, fixture};

    #[test]
    fn an_error_of_members_above_ten_tolerances_is_a_warning_and_one_below_is_not() {
        let outcomes = fixture::outcomes();
        let answers = outcomes.answers("study");
        let mut outcome = outcomes.uncertainty.clone();
        let mut warning = |error_k: f64| {
            let found = outcome.discretisation_error.as_mut().expect("the fixture has one");
            found.extreme.temperature_k = Some(error_k);
            outcome.inaccuracy(&answers)
        };
        assert_eq!(warning(0.49), None);
        let text = warning(0.51).expect("a warning");
        assert!(text.starts_with("The discretisation error of members is 0.51 K (1 failed) in the 50 most"), "{text}");
    }

    /// Every factor that is named has a share no smaller than any factor that is not.
    #[test]
    fn finding_and_caption_name_the_factors_with_the_largest_shares() {
        let outcomes = fixture::outcomes();
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
