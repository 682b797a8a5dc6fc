//! The Monte Carlo sweep: how far the prediction may be off, and what that is due to.

mod causes;
mod figures;
mod record;

use super::answer::{Answer, Finding, Members, Room, Section};
use super::figure::Figure;
use super::figures::nearest;
use super::files::json::Record;
use super::files::table::File;
use super::files::table::Table;
use super::files::tables::{factor_columns, head};
use super::html::table::{paragraph, table};
use super::observed::misfit;
use super::summary::{shown, wrapped};
use super::{ReportError, words};
use crate::case::Case;
use crate::study::answers::Answers;
use crate::study::statistics::Likely;
use crate::study::uncertainty::Uncertainty;

impl Answer for Uncertainty {
    fn members(&self) -> Option<Members> {
        Some(Members { asked: self.asked, ok: self.ok })
    }

    fn facts(&self) -> Vec<String> {
        vec![words::counted(self.asked, "member")]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let Some(sensor) = answers.bondline() else { return Vec::new() };
        let said = [
            ("Spread", Some(spread(&answers.case, self, sensor))),
            ("Cause", blame(&answers.case, self, sensor)),
            ("Alone", causes::alone(answers, self, sensor)),
        ];
        said.into_iter().filter_map(|(about, said)| said.map(|said| Finding { about, said })).collect()
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        let failed = self.failures.iter().map(|failure| {
            format!(
                "{} of {} failed ({}), the first being member {}; they are left out of every statistic.",
                words::count(failure.members),
                words::counted(self.asked, "member"),
                failure.reason,
                words::count(failure.first)
            )
        });
        failed.collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let figures = figures::figures(&answers.case, self, answers.nominal.as_ref());
        figures.into_iter().map(|figure| ("uncertainty", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("uncertainty", "Uncertainty", page(answers, self))]
    }

    fn method(&self, _: &Answers) -> Vec<String> {
        vec![format!(
            "Uncertainty: every member draws all factors within their {} bounds and is marched in full. A factor's \
             correlation with a temperature is Pearson's; its share is the squared correlation over the sum of all. \
             Shares take effects to be linear and factors to be independent. Sobol indices do not: they are parts of the \
             variance, from a fit of all members with orthonormal polynomials of one factor and of two, and what such do \
             not explain is told. Correlations of ranks are Spearman's, and with the others taken out partial ones.",
            self.bounds.name()
        )]
    }

    /// | file | columns |
    /// |---|---|
    /// | `percentiles.csv` | `sensor`, `time_s`, mean, deviation, extremes and percentiles of the members at each instant (pointwise); `whole_low_K` and `whole_high_K`, between which 95 % of members stay at all instants (simultaneous) |
    /// | `shares.csv` | `sensor`, `time_s`, each factor's share of the spread, correlation, and first-order Sobol index |
    fn tables(&self, answers: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![percentiles(&answers.case, self)?, shares(&answers.case, self)?])
    }

    fn record(&self, answers: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("shares", &record::shares(&answers.case, self))?;
        record.put("causes", &record::causes(&answers.case, self))?;
        record.put("whole_traces", &record::whole_traces(&answers.case, self))
    }
}

/// The lines of the screen: the table, and where there is room for it what the spread is due to.
pub(super) fn lines(answers: &Answers, outcome: &Uncertainty, most: usize, room: &Room) -> Vec<String> {
    let mut lines = table_on_screen(answers, outcome, most);
    if let (Some(sensor), false) = (answers.bondline(), room.is_shared) {
        lines.extend(causes::alone(answers, outcome, sensor).into_iter().flat_map(|said| wrapped("", &said)));
    }
    lines
}

fn table_on_screen(answers: &Answers, outcome: &Uncertainty, most: usize) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<7}{:>18}{:>8}{:>9}{:>8}{:>14}  {}",
        "sensor", "nominal peak", "at", "off, rms", "± 1 σ", "95 % peak at", "largest share"
    )];
    let (sensors, others) = shown(answers, most);
    for index in sensors {
        let peak = &outcome.peaks[index];
        let [low_k, .., high_k] = peak.percentiles_k;
        let (deviation, within) = if outcome.ok > 1 {
            let within = format!("{}–{} K", words::grouped(low_k, 0), words::grouped(high_k, 0));
            (words::change(peak.deviation_k), within)
        } else {
            ("-".to_owned(), "-".to_owned())
        };
        let blame = ranked(&answers.case, outcome, index).into_iter().flatten().next();
        let blame = blame.filter(|(_, share)| *share > 0.0).map_or("-".to_owned(), |(factor, share)| {
            format!("{} {}", words::short(&answers.case.factors[factor].name, 10), words::percent(share))
        });
        lines.push(format!(
            "{:<7}{:>18}{:>8}{:>9}{:>8}{:>14}  {}",
            words::short(&answers.case.sensors[index].name, 6),
            words::kelvin(peak.nominal.temperature_k),
            words::seconds(peak.nominal.time_s),
            answers.nominal.as_ref().map_or("-".to_owned(), |nominal| misfit(answers, nominal, index).0),
            deviation,
            within,
            blame
        ));
    }
    lines.extend(others);
    lines
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
fn ranked(case: &Case, outcome: &Uncertainty, sensor: usize) -> Option<Vec<(usize, f64)>> {
    let instant = nearest(&outcome.instants_s, outcome.peaks[sensor].nominal.time_s)?;
    let mut shares: Vec<(usize, f64)> = (0..case.factors.len())
        .map(|factor| (factor, outcome.spreads[sensor].causes[instant].shares[factor]))
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    Some(shares)
}

fn page(answers: &Answers, outcome: &Uncertainty) -> String {
    let case = &answers.case;
    let rows: Vec<Vec<String>> = (case.sensors.iter().zip(&outcome.peaks).enumerate())
        .map(|(index, (sensor, peak))| {
            let blame: Vec<String> = ranked(case, outcome, index)
                .into_iter()
                .flatten()
                .take(3)
                .filter(|(_, share)| *share >= 0.05)
                .map(|(factor, share)| format!("{} {}", case.factors[factor].name, words::percent(share)))
                .collect();
            vec![
                sensor.name.clone(),
                words::grouped(peak.nominal.temperature_k, 0),
                words::grouped(peak.mean_k, 0),
                words::significant(peak.deviation_k, 2),
                format!("{} to {}", words::grouped(peak.percentiles_k[0], 0), words::grouped(peak.percentiles_k[4], 0)),
                format!("{} to {}", words::grouped(peak.percentiles_s[0], 1), words::grouped(peak.percentiles_s[4], 1)),
                blame.join(", "),
            ]
        })
        .collect();
    let failures: Vec<Vec<String>> = outcome
        .failures
        .iter()
        .map(|failure| vec![failure.reason.clone(), words::count(failure.members), words::count(failure.first)])
        .collect();
    let drawn = format!(
        "{} drawn ({} sampling, seed {}), of which {} arrived.",
        words::counted(outcome.asked, "member"),
        outcome.sampling,
        outcome.seed,
        words::count(outcome.ok)
    );
    let head = ["Sensor", "Nominal, K", "Mean, K", "± 1 σ, K", "95 % within, K", "95 % at, s", "Largest shares"];
    paragraph(&drawn)
        + &table("Peak temperatures of the members", &head, &rows)
        + &table("Members that failed", &["Reason", "Members", "The first"], &failures)
        + &answers.bondline().map(|sensor| due(answers, outcome, sensor)).unwrap_or_default()
}

/// What the peak of a sensor, and its time, are due to.
fn due(answers: &Answers, outcome: &Uncertainty, sensor: usize) -> String {
    let (name, peak) = (&answers.case.sensors[sensor].name, &outcome.peaks[sensor]);
    let of = |what: &str, causes| {
        table(&format!("What the {what} of {name} is due to"), &causes::HEAD, &causes::rows(answers, causes))
    };
    of("peak temperature", &peak.causes)
        + &of("time of the peak", &peak.causes_of_time)
        + &paragraph(causes::explanation(outcome))
}

fn percentiles(case: &Case, outcome: &Uncertainty) -> Result<File, ReportError> {
    let columns = ["mean_K", "deviation_K", "lowest_K", "p2.5_K", "p25_K", "p50_K", "p75_K", "p97.5_K", "highest_K"];
    let columns = columns.into_iter().chain(["whole_low_K", "whole_high_K"]);
    let mut table = Table::new("percentiles.csv", ["sensor", "time_s"].into_iter().chain(columns))?;
    for (sensor, spread) in case.sensors.iter().zip(&outcome.spreads) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let percentiles = spread.percentiles_k.iter().map(|curve| curve[at]);
            let after = [spread.high_k[at], spread.whole.low_k[at], spread.whole.high_k[at]];
            let before = [time_s, spread.mean_k[at], spread.deviation_k[at], spread.low_k[at]];
            table.row(Some(&sensor.name), before.into_iter().chain(percentiles).chain(after))?;
        }
    }
    table.close()
}

fn shares(case: &Case, outcome: &Uncertainty) -> Result<File, ReportError> {
    let endings = [
        "_share",
        "_correlation",
        "_rank_correlation",
        "_partial_rank_correlation",
        "_index",
        "_index_low",
        "_index_high",
        "_total",
        "_total_low",
        "_total_high",
    ];
    let columns = endings.into_iter().flat_map(|ending| factor_columns(case, ending));
    let columns = columns.chain(["unexplained".to_owned()]);
    let mut table = Table::new("shares.csv", head(&["sensor", "time_s"], columns))?;
    for (sensor, spread) in case.sensors.iter().zip(&outcome.spreads) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let causes = &spread.causes[at];
            let correlations = [&causes.correlations, &causes.rank_correlations, &causes.partial_rank_correlations];
            let ends = [|index: &Likely| index.value, |index: &Likely| index.low, |index: &Likely| index.high];
            let indices = [&causes.first, &causes.total].into_iter();
            let indices = indices.flat_map(|of| ends.into_iter().flat_map(move |end| of.iter().map(end)));
            let values = causes.shares.iter().copied();
            let values = values.chain(correlations.into_iter().flatten().map(|likely| likely.value)).chain(indices);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(values).chain([causes.rest]))?;
        }
    }
    table.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{figures, fixture};

    /// Counted from the shares themselves: whoever is named has a share no smaller than anybody who is not.
    #[test]
    fn the_factors_that_are_named_have_the_largest_shares_in_the_finding_and_in_the_caption() {
        let outcomes = fixture::outcomes();
        let (case, outcome) = (&outcomes.case, &outcomes.uncertainty);
        let figures = figures::all(&outcomes.answers("study"));
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
