//! The CSV tables of a report.

use super::table::{NamedFile, Names, Table};
use crate::case::Case;
use crate::report::ReportError;
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;
use crate::traces::Gauge;

/// Every table.
///
/// # Errors
/// When a row cannot be written.
pub(in crate::report) fn all(answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
    let mut tables = Vec::new();
    let each = answers.results();
    if let Some(nominal) = answers.nominal_march() {
        let fitted = each.iter().find_map(|answer| answer.fitted());
        tables.push(traces_file("traces.csv", &answers.case, nominal, fitted)?);
    }
    for answer in each {
        tables.extend(answer.tables(answers)?);
    }
    Ok(tables)
}

/// An instant of the nominal march, and of the fitted one if there is any.
type TraceRow<'a> = (&'a Prediction, Option<&'a Prediction>, usize);

pub(super) fn traces_table<'a>() -> Table<TraceRow<'a>> {
    fn gauge((march, _, instant): &TraceRow<'_>, gauge: Gauge) -> f64 {
        let trace = march.gauge_traces.iter().find(|trace| trace.gauge == gauge);
        trace.map_or(f64::NAN, |trace| trace.values[*instant])
    }
    fn temperatures(march: &Prediction, instant: usize) -> Vec<f64> {
        march.temperatures_k.iter().map(|trace| trace[instant]).collect()
    }
    Table::<TraceRow<'a>>::new(
        &["traces.csv", "traces-<case>.csv"],
        "Temperatures over time, one row per instant (every command that marches a nominal case). The columns after \
         the \
         sensors exist where plies decompose or gas moves. `traces-<case>.csv` is that of a further case of \
         an estimate.",
    )
    .number("time_s", "s", "Time.", |row| row.0.instants_s[row.2])
    .numbers("<sensor>_k", "K", "Temperature at nominal factors.", |row| temperatures(row.0, row.2))
    .numbers(FITTED, "K", "Temperature at the estimated factors (`estimate`, `study`).", |row| {
        row.1.map_or(Vec::new(), |fitted| temperatures(fitted, row.2))
    })
    .number("gas_flux_kg_m2_s", "kg/m²/s", "Gas flux out of the hot face; negative into it.", |row| {
        gauge(row, Gauge::GasFlux)
    })
    .number("mass_lost_kg_m2", "kg/m²", "Solid mass lost since the start.", |row| gauge(row, Gauge::MassLost))
    .number("virgin_front_m", "m", "Depth down to which 2 % of the decomposable mass is lost; 0 before.", |row| {
        gauge(row, Gauge::VirginFront)
    })
    .number("char_front_m", "m", "Depth down to which 98 % of the decomposable mass is lost; 0 before.", |row| {
        gauge(row, Gauge::CharFront)
    })
    .number("peak_pressure_pa", "Pa", "Highest gas pressure in the layup.", |row| gauge(row, Gauge::PeakPressure))
    .number("back_pressure_pa", "Pa", "Gas pressure at the back face.", |row| gauge(row, Gauge::BackPressure))
}

const FITTED: &str = "<sensor>_fitted_k";

pub(in crate::report) fn traces_file(
    name: &str,
    case: &Case,
    nominal: &Prediction,
    fitted: Option<&Prediction>,
) -> Result<NamedFile, ReportError> {
    let is_absent = |gauge: &&str| nominal.gauge_traces.iter().all(|trace| trace.gauge.name() != *gauge);
    let gauges = Gauge::ALL.map(Gauge::name);
    let mut absent: Vec<&str> = gauges.iter().copied().filter(|gauge| is_absent(gauge)).collect();
    if fitted.is_none() {
        absent.push(FITTED);
    }
    let rows = (0..nominal.instants_s.len()).map(|instant| (nominal, fitted, instant));
    traces_table().without(&absent).csv_as(name, &Names::of(case), rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marched;

    fn table(name: &str) -> (Vec<String>, Vec<Vec<String>>) {
        let outcomes = marched::study();
        let tables = all(&outcomes.answers("study")).expect("the tables of the study");
        let (_, bytes) = tables.iter().find(|(found, _)| found == name).expect("the table is there");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head = rows.headers().expect("a head").iter().map(str::to_owned).collect();
        (head, rows.records().map(|row| row.expect("a row").iter().map(str::to_owned).collect()).collect())
    }

    #[test]
    fn the_traces_of_an_estimate_have_the_nominal_and_the_fitted_march() {
        let (head, rows) = table("traces.csv");
        assert_eq!(head[..5], ["time_s", "TC1_k", "TC2_k", "TC3_k", "TC4_k"]);
        assert_eq!(head[8], "TC4_fitted_k");
        let outcomes = marched::study();
        assert_eq!(rows.len(), outcomes.nominal.instants_s.len());
        let read: f64 = rows[15][4].parse().expect("a number");
        assert!((read - outcomes.nominal.temperatures_k[3][15]).abs() < 1e-6);
        assert_ne!(rows[15][4], rows[15][8], "fitted and nominal traces are the same");
    }

    #[test]
    fn gauges_follow_the_sensors_only_where_gas_moves() {
        let outcomes = marched::study();
        let of = |outcomes: &marched::Study| {
            let (_, bytes) = traces_file("traces.csv", &outcomes.case, &outcomes.nominal, None).expect("a table");
            String::from_utf8(bytes).expect("text")
        };
        assert!(of(&outcomes).starts_with("time_s,TC1_k,TC2_k,TC3_k,TC4_k\n"));
        let mut charring = marched::charring();
        let instant = charring.nominal.instants_s.iter().position(|&time_s| time_s == 40.0).expect("40 s");
        let readings = [0.009, 0.18, 0.0035, 0.00175, 9010.0, 8260.0];
        for (trace, reading) in charring.nominal.gauge_traces.iter_mut().zip(readings) {
            trace.values[instant] = reading;
        }
        let charring = of(&charring);
        let mut lines = charring.lines();
        let ending =
            "TC4_k,gas_flux_kg_m2_s,mass_lost_kg_m2,virgin_front_m,char_front_m,peak_pressure_pa,back_pressure_pa";
        assert!(lines.next().is_some_and(|head| head.ends_with(ending)));
        let at_40_s = lines.find(|line| line.starts_with("40,")).expect("a row for 40 s");
        assert!(at_40_s.ends_with(",0.009,0.18,0.0035,0.00175,9010,8260"), "{at_40_s}");
    }

    #[test]
    fn percentiles_ascend_in_every_row() {
        let (_, rows) = table("percentiles.csv");
        for row in rows.iter().filter(|row| row[3] != "0") {
            let values: Vec<f64> = row[6..11].iter().map(|cell| cell.parse().expect("a number")).collect();
            assert!(values.is_sorted(), "{row:?}");
        }
    }
}
