//! The CSV tables of a report; `docs/reference/outputs.md` lists their columns.

use super::table::{CsvTable, NamedFile};
use crate::case::Case;
use crate::report::{ReportError, reportable};
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;

/// Every table.
///
/// # Errors
/// When a row cannot be written.
pub(in crate::report) fn all(answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
    let mut tables = Vec::new();
    let each = reportable::all(answers);
    if let Some(nominal) = answers.nominal_march() {
        let fitted = each.iter().find_map(|answer| answer.fitted());
        tables.push(traces_table("traces.csv", &answers.case, nominal, fitted)?);
    }
    for answer in each {
        tables.extend(answer.tables(answers)?);
    }
    Ok(tables)
}

/// A column per factor, named with this suffix.
pub(in crate::report) fn factor_columns(case: &Case, ending: &str) -> impl Iterator<Item = String> {
    case.factors.iter().map(move |factor| format!("{}{ending}", factor.name))
}

pub(in crate::report) fn header(first: &[&str], rest: impl IntoIterator<Item = String>) -> Vec<String> {
    first.iter().map(|&column| column.to_owned()).chain(rest).collect()
}

pub(in crate::report) fn traces_table(
    name: &str,
    case: &Case,
    nominal: &Prediction,
    fitted: Option<&Prediction>,
) -> Result<NamedFile, ReportError> {
    let names = |ending: &str| -> Vec<String> {
        case.sensors.iter().map(|sensor| format!("{}{ending}", sensor.name)).collect()
    };
    let after = if fitted.is_some() { names("_fitted_K") } else { Vec::new() };
    let gauges = nominal.gauge_traces.iter().map(|reading| reading.gauge.name().to_owned());
    let columns = names("_K").into_iter().chain(after).chain(gauges);
    let mut table = CsvTable::new(name, header(&["time_s"], columns))?;
    for (instant, &time_s) in nominal.instants_s.iter().enumerate() {
        let before = nominal.temperatures_k.iter().map(|trace| trace[instant]);
        let after = fitted.into_iter().flat_map(|march| &march.temperatures_k).map(|trace| trace[instant]);
        let gauges = nominal.gauge_traces.iter().map(|reading| reading.values[instant]);
        table.row(None, std::iter::once(time_s).chain(before).chain(after).chain(gauges))?;
    }
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    fn table(name: &str) -> (Vec<String>, Vec<Vec<String>>) {
        let outcomes = fixture::outcomes();
        let tables = all(&outcomes.answers("study")).expect("the tables of the fixture");
        let (_, bytes) = tables.iter().find(|(found, _)| found == name).expect("the table is there");
        let mut rows = csv::Reader::from_reader(bytes.as_slice());
        let head = rows.headers().expect("a head").iter().map(str::to_owned).collect();
        (head, rows.records().map(|row| row.expect("a row").iter().map(str::to_owned).collect()).collect())
    }

    #[test]
    fn the_traces_of_an_estimate_have_the_nominal_and_the_fitted_march() {
        let (head, rows) = table("traces.csv");
        assert_eq!(head[..5], ["time_s", "TC1_K", "TC2_K", "TC3_K", "TC4_K"]);
        assert_eq!(head[8], "TC4_fitted_K");
        let outcomes = fixture::outcomes();
        assert_eq!(rows.len(), outcomes.nominal.instants_s.len());
        let read: f64 = rows[120][4].parse().expect("a number");
        assert!((read - outcomes.nominal.temperatures_k[3][120]).abs() < 1e-6);
        assert_ne!(rows[120][4], rows[120][8], "fitted and nominal traces are the same");
    }

    #[test]
    fn gauges_follow_the_sensors_only_where_gas_moves() {
        let outcomes = fixture::outcomes();
        let of = |outcomes: &fixture::StudyFixture| {
            let (_, bytes) = traces_table("traces.csv", &outcomes.case, &outcomes.nominal, None).expect("a table");
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

    #[test]
    fn percentiles_ascend_in_every_row() {
        let (_, rows) = table("percentiles.csv");
        for row in rows.iter().filter(|row| row[3] != "0") {
            let values: Vec<f64> = row[4..11].iter().map(|cell| cell.parse().expect("a number")).collect();
            assert!(values.is_sorted(), "{row:?}");
        }
    }
}
