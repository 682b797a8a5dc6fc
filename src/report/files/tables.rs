//! The tables of a report as CSV: one row an instant, a sensor's rows together. Units stand last in the names
//! of columns; a value that is not known is empty; nine significant digits.
//!
//! | file | columns |
//! |---|---|
//! | `traces.csv` | `time_s`, then `TC1_K` … of the nominal march, of an estimate `TC1_fitted_K` … too, and where gas moves the gauges of the nominal march |
//! | `percentiles.csv` | `sensor`, `time_s`, mean, deviation, extremes and percentiles of the members at each instant (pointwise); `whole_low_K` and `whole_high_K`, between which 95 % of members stay at all instants (simultaneous) |
//! | `shares.csv` | `sensor`, `time_s`, each factor's share of the spread, correlation, and first-order Sobol index |
//! | `sensitivities.csv` | `sensor`, `time_s`, by how many K the sensor changes for 1 % more of each factor (of its nominal value) |
//! | `residuals.csv` | `sensor`, `time_s`, measured less predicted over the fitted window |
//! | `traces-CASE.csv`, `residuals-CASE.csv`, `predictive-CASE.csv` | the same of the further cases of a joint estimate |
//! | `path.csv` | `iteration`, the factors, the objective that is minimised, the damping |
//! | `profiles.csv` | `held`, the factor that is held, all factors, the rise of the objective in squares of a standard error |
//! | `posterior.csv` | values of the factors, drawn as often as they are likely |
//! | `predictive.csv` | `sensor`, `time_s`, between what 95 % of these predict, and the same with what the model lacks |
//! | `sizing.csv` | `thickness_m`, nominal peak and percentiles 2.5, 50, 97.5 of the members' peaks there, share of members that hold the limit |
//! | `needed.csv` | `thickness_m` that each member needs, thinnest first, and the share of members that need no more |
//! | `history.csv` | `time_s`, `flux_w_m2`, `radiant_flux_w_m2` or `gas_K`: the history found, as a case reads one |
//! | `history-band.csv` | of every knot the value, between what 95 % of histories have that other noise makes, what smoothing takes off to first order, what the case has |
//! | `history-residuals.csv` | `sensor`, `time_s`, measured less predicted with the history found |
//! | `twins.csv` | `twin`, `factor`, truth, estimate, its 95 % interval, and whether that holds the truth; the last four empty where no fit converged |
//! | `landscape.csv` | the two factors and the objective that is minimised over their plane, line by line, one of the factors being constant on a line; `valley` is 1 where the objective is least on its line |

mod estimated;

use super::super::figures::file_name;
use super::super::{ReportError, Story};
use super::table::{Table, cell};
use crate::case::Case;
use crate::study::history::{History, Sought};
use crate::study::nominal::Nominal;
use crate::study::recovery::Recovery;
use crate::study::sensitivity::Sensitivity;
use crate::study::size::Sizing;
use crate::study::statistics::Likely;
use crate::study::uncertainty::Uncertainty;

/// Every table that the answers at hand fill: name and bytes.
///
/// # Errors
/// When a row cannot be written.
pub(in super::super) fn all(story: &Story) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let mut tables = Vec::new();
    if let Some(nominal) = story.nominal_march() {
        let fitted = story.estimated.and_then(|outcome| outcome.fitted.first());
        tables.push(traces("traces.csv", story.case, nominal, fitted.map(|fitted| &fitted.after))?);
    }
    if let Some(outcome) = story.uncertainty {
        tables.push(percentiles(story, outcome)?);
        tables.push(shares(story, outcome)?);
    }
    if let Some(outcome) = story.sensitivity {
        tables.push(sensitivities(story, outcome)?);
    }
    if let Some(outcome) = story.estimated {
        for (which, (case, fitted)) in story.fits(outcome).enumerate() {
            if which == 0 {
                tables.push(estimated::residuals("residuals.csv", case, fitted)?);
                continue;
            }
            let name = |table: &str| format!("{}.csv", file_name(table, &case.id));
            tables.push(traces(&name("traces"), case, &fitted.before, Some(&fitted.after))?);
            tables.push(estimated::residuals(&name("residuals"), case, fitted)?);
        }
        tables.push(estimated::path(outcome)?);
        if !outcome.profiles.is_empty() {
            tables.push(estimated::profiles(outcome)?);
        }
        if let Some(landscape) = &outcome.landscape {
            tables.push(estimated::plane(outcome, landscape)?);
        }
    }
    if let (Some(found), Some(outcome)) = (story.estimated, story.posterior) {
        tables.push(estimated::posterior(found, outcome)?);
        for (which, (case, of)) in story.cases().zip(&outcome.predicted).enumerate() {
            let name = if which == 0 { "predictive".to_owned() } else { file_name("predictive", &case.id) };
            tables.push(estimated::predictive(&format!("{name}.csv"), case, of)?);
        }
    }
    if let Some(outcome) = story.sizing {
        tables.push(rungs(outcome)?);
        tables.push(needed(outcome)?);
    }
    if let Some(outcome) = story.history {
        tables.extend(heating(story.case, outcome)?);
    }
    if let Some(outcome) = story.recovery {
        tables.push(twins(outcome)?);
    }
    Ok(tables)
}

fn factor_columns<'a>(story: &Story<'a>, ending: &'a str) -> impl Iterator<Item = String> {
    story.case.factors.iter().map(move |factor| format!("{}{ending}", factor.name))
}

fn head(first: &[&str], rest: impl IntoIterator<Item = String>) -> Vec<String> {
    first.iter().map(|&column| column.to_owned()).chain(rest).collect()
}

fn traces(
    name: &str,
    case: &Case,
    nominal: &Nominal,
    fitted: Option<&Nominal>,
) -> Result<(String, Vec<u8>), ReportError> {
    let names = |ending: &str| -> Vec<String> {
        case.sensors.iter().map(|sensor| format!("{}{ending}", sensor.name)).collect()
    };
    let after = if fitted.is_some() { names("_fitted_K") } else { Vec::new() };
    let gauges = nominal.readings.iter().map(|reading| reading.gauge.name().to_owned());
    let columns = names("_K").into_iter().chain(after).chain(gauges);
    let mut table = Table::new(name, head(&["time_s"], columns))?;
    for (instant, &time_s) in nominal.instants_s.iter().enumerate() {
        let before = nominal.temperatures_k.iter().map(|trace| trace[instant]);
        let after = fitted.into_iter().flat_map(|march| &march.temperatures_k).map(|trace| trace[instant]);
        let gauges = nominal.readings.iter().map(|reading| reading.values[instant]);
        table.row(None, std::iter::once(time_s).chain(before).chain(after).chain(gauges))?;
    }
    table.close()
}

fn percentiles(story: &Story, outcome: &Uncertainty) -> Result<(String, Vec<u8>), ReportError> {
    let columns = ["mean_K", "deviation_K", "lowest_K", "p2.5_K", "p25_K", "p50_K", "p75_K", "p97.5_K", "highest_K"];
    let columns = columns.into_iter().chain(["whole_low_K", "whole_high_K"]);
    let mut table = Table::new("percentiles.csv", ["sensor", "time_s"].into_iter().chain(columns))?;
    for (sensor, spread) in story.case.sensors.iter().zip(&outcome.spreads) {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let percentiles = spread.percentiles_k.iter().map(|curve| curve[at]);
            let after = [spread.high_k[at], spread.whole.low_k[at], spread.whole.high_k[at]];
            let before = [time_s, spread.mean_k[at], spread.deviation_k[at], spread.low_k[at]];
            table.row(Some(&sensor.name), before.into_iter().chain(percentiles).chain(after))?;
        }
    }
    table.close()
}

fn shares(story: &Story, outcome: &Uncertainty) -> Result<(String, Vec<u8>), ReportError> {
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
    let columns = endings.into_iter().flat_map(|ending| factor_columns(story, ending));
    let columns = columns.chain(["unexplained".to_owned()]);
    let mut table = Table::new("shares.csv", head(&["sensor", "time_s"], columns))?;
    for (sensor, spread) in story.case.sensors.iter().zip(&outcome.spreads) {
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

fn sensitivities(story: &Story, outcome: &Sensitivity) -> Result<(String, Vec<u8>), ReportError> {
    let columns = factor_columns(story, "_K_per_percent");
    let mut table = Table::new("sensitivities.csv", head(&["sensor", "time_s"], columns))?;
    let scaled: Vec<_> =
        (0..story.case.factors.len()).map(|factor| outcome.per_percent_k(story.case, factor)).collect();
    for (index, sensor) in story.case.sensors.iter().enumerate() {
        for (at, &time_s) in outcome.instants_s.iter().enumerate() {
            let changes = scaled.iter().map(|factor| factor[index][at]);
            table.row(Some(&sensor.name), std::iter::once(time_s).chain(changes))?;
        }
    }
    table.close()
}

fn rungs(outcome: &Sizing) -> Result<(String, Vec<u8>), ReportError> {
    let mut table =
        Table::new("sizing.csv", ["thickness_m", "nominal_K", "p2.5_K", "p50_K", "p97.5_K", "share_that_holds"])?;
    for rung in &outcome.rungs {
        let share = outcome.held(rung.thickness_m).share();
        let peaks = [rung.thickness_m, rung.nominal.temperature_k].into_iter().chain(rung.percentiles_k);
        table.row(None, peaks.chain([share]))?;
    }
    table.close()
}

fn needed(outcome: &Sizing) -> Result<(String, Vec<u8>), ReportError> {
    let mut table = Table::new("needed.csv", ["thickness_m", "share"])?;
    for (place, &needed_m) in outcome.each_m.iter().enumerate() {
        table.row(None, [needed_m, (place + 1) as f64 / outcome.members as f64])?;
    }
    table.close()
}

fn heating(case: &Case, outcome: &History) -> Result<[(String, Vec<u8>); 3], ReportError> {
    let (name, unit) = match outcome.sought {
        Sought::Flux => ("flux", "w_m2"),
        Sought::RadiantFlux => ("radiant_flux", "w_m2"),
        Sought::Gas => ("gas", "K"),
    };
    let value = format!("{name}_{unit}");
    let mut found = Table::new("history.csv", ["time_s", &value])?;
    for (&time_s, &value) in outcome.schedule.times_s.iter().zip(&outcome.schedule.values) {
        found.row(None, [time_s, value])?;
    }
    let [low, high, smoothed, own] = ["low", "high", "smoothed", "own"].map(|of| format!("{of}_{unit}"));
    let columns = ["time_s", &value, &low, &high, &smoothed, &own].map(str::to_owned);
    let mut band = Table::new("history-band.csv", columns.each_ref().map(String::as_str))?;
    for (knot, &value) in outcome.values.iter().enumerate() {
        let half = outcome.half_width(knot);
        let (smoothed, own) = (outcome.smoothed[knot], outcome.own[knot]);
        band.row(None, [outcome.times_s[knot], value, (value - half).max(0.0), value + half, smoothed, own])?;
    }
    let mut left = Table::new("history-residuals.csv", ["sensor", "time_s", "residual_K"])?;
    for seen in &outcome.seen {
        for (&time_s, &off_k) in seen.times_s.iter().zip(&seen.residuals_k) {
            left.row(Some(&case.sensors[seen.sensor].name), [time_s, off_k])?;
        }
    }
    Ok([found.close()?, band.close()?, left.close()?])
}

fn twins(outcome: &Recovery) -> Result<(String, Vec<u8>), ReportError> {
    let columns = ["twin", "factor", "truth", "estimate", "low", "high", "held"];
    let mut table = Table::new("twins.csv", columns)?;
    for (number, twin) in outcome.twins.iter().enumerate() {
        for (place, (&truth, factor)) in twin.truth.iter().zip(&outcome.recovered).enumerate() {
            let mut row = vec![number.to_string(), factor.name.clone(), cell(truth)];
            match twin.end.found() {
                Some(found) => {
                    let (low, high) = found.intervals[place];
                    row.extend([found.values[place], low, high].map(cell));
                    row.push(u8::from((low..=high).contains(&truth)).to_string());
                }
                None => row.extend(std::iter::repeat_n(String::new(), 4)),
            }
            table.text(row)?;
        }
    }
    table.close()
}

#[cfg(test)]
mod tests {
    use super::super::super::figure::Layer;
    use super::super::super::{figures, fixture};
    use super::*;

    fn table(name: &str) -> (Vec<String>, Vec<Vec<String>>) {
        let outcomes = fixture::outcomes();
        let tables = all(&outcomes.story("study")).expect("the tables of the fixture");
        let (_, bytes) = tables.iter().find(|(found, _)| found == name).expect("the table is there");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head = rows.headers().expect("a head").iter().map(str::to_owned).collect();
        (head, rows.records().map(|row| row.expect("a row").iter().map(str::to_owned).collect()).collect())
    }

    #[test]
    fn the_traces_of_an_estimate_hold_the_nominal_and_the_fitted_march_side_by_side() {
        let (head, rows) = table("traces.csv");
        assert_eq!(head[..5], ["time_s", "TC1_K", "TC2_K", "TC3_K", "TC4_K"]);
        assert_eq!(head[8], "TC4_fitted_K");
        let outcomes = fixture::outcomes();
        assert_eq!(rows.len(), outcomes.nominal.instants_s.len());
        let read: f64 = rows[120][4].parse().expect("a number");
        assert!((read - outcomes.nominal.temperatures_k[3][120]).abs() < 1e-6);
        assert_ne!(rows[120][4], rows[120][8], "fitted and nominal cannot be the same trace");
    }

    #[test]
    fn gauges_stand_behind_the_sensors_where_gas_moves_and_nowhere_else() {
        let outcomes = fixture::outcomes();
        let of = |outcomes: &fixture::Outcomes| {
            let (_, bytes) = traces("traces.csv", &outcomes.case, &outcomes.nominal, None).expect("a table");
            String::from_utf8(bytes).expect("text")
        };
        assert!(of(&outcomes).starts_with("time_s,TC1_K,TC2_K,TC3_K,TC4_K\n"));
        let charring = of(&outcomes.charring());
        let mut lines = charring.lines();
        let ending =
            "TC4_K,gas_flux_kg_m2_s,mass_lost_kg_m2,virgin_front_m,char_front_m,peak_pressure_pa,back_pressure_pa";
        assert!(lines.next().is_some_and(|head| head.ends_with(ending)));
        let at_40_s = lines.find(|line| line.starts_with("40,")).expect("a row for 40 s");
        assert!(at_40_s.ends_with(",0.009,0.18,0.0035,0.00175,9010,8260"), "{at_40_s}");
    }

    /// Table and chart once had two units under one name: every curve of the one is a column of the other.
    #[test]
    fn sensitivities_are_in_kelvin_per_percent_in_table_and_chart_alike() {
        let mut outcomes = fixture::outcomes();
        outcomes.case.factors[3].nominal = 1.1;
        let story = outcomes.story("study");
        let (_, bytes) = sensitivities(&story, &outcomes.sensitivity).expect("a table");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head: Vec<String> = rows.headers().expect("a head").iter().map(str::to_owned).collect();
        let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("a row")).collect();
        let figures = figures::all(&story);
        for sensor in &outcomes.case.sensors {
            let id = file_name("sensitivity", &sensor.name);
            let figure = figures.iter().find(|figure| figure.id == id).expect("a chart of each sensor");
            assert!(figure.y.label.contains("K per 1 %") && figure.title.contains("K per 1 %"), "{figure:?}");
            let lines = figure.layers.iter().filter_map(|layer| match layer {
                Layer::Line { name, y, .. } => Some((name, y)),
                _ => None,
            });
            let mut compared = 0;
            for (name, drawn) in lines {
                let column = head.iter().position(|column| *column == format!("{name}_K_per_percent"));
                let column = column.unwrap_or_else(|| panic!("no column of {name} in {head:?}"));
                let of_sensor = rows.iter().filter(|row| row[0] == *sensor.name);
                let written = of_sensor.map(|row| row[column].parse::<f64>().expect("a number"));
                let off = written.zip(drawn).map(|(written, drawn)| (written - drawn).abs()).fold(0.0, f64::max);
                assert!(off < 1e-6, "{name} at {}: {off} K per 1 % apart", sensor.name);
                compared += 1;
            }
            assert_eq!(compared, outcomes.case.factors.len());
        }
    }

    #[test]
    fn the_percentiles_of_a_sensor_rise_in_every_row() {
        let (_, rows) = table("percentiles.csv");
        for row in rows.iter().filter(|row| row[3] != "0") {
            let values: Vec<f64> = row[4..11].iter().map(|cell| cell.parse().expect("a number")).collect();
            assert!(values.is_sorted(), "{row:?}");
        }
    }
}
