//! Published figures, re-typed into `data/verification` and built into the library.
//!
//! A file has lines of `#` that name its public source, version and licence, a header `series,time_s,<depth in m>,…`,
//! and one row per series and time. Columns that are not temperatures have a name in place of a depth. Figures that
//! were not published are empty.

use super::problem::{Observable, ReferencePoint};
use crate::traces::Gauge;

/// The points of one series of a file; `zero_k` is added to every temperature.
pub(super) fn points(file: &str, series: &str, zero_k: f64) -> Vec<ReferencePoint> {
    let (header, rows) = table(file);
    let depths_m: Vec<f64> = header[2..].iter().map(|depth| number(depth)).collect();
    let mut points = Vec::new();
    for row in rows.iter().filter(|row| row[0] == series) {
        for (&depth_m, value) in depths_m.iter().zip(&row[2..]).filter(|(_, value)| !value.is_empty()) {
            points.push(ReferencePoint::at(depth_m, number(row[1]), zero_k + number(value)));
        }
    }
    assert!(!points.is_empty(), "no series {series:?} in the file that begins {:?}", file.lines().next());
    points
}

/// The points of a gauge from a named column of a series.
pub(super) fn gauge_points(file: &str, series: &str, column: &str, gauge: Gauge) -> Vec<ReferencePoint> {
    let figures = column_series(file, series, column).into_iter();
    figures.map(|(time_s, value)| ReferencePoint { observable: Observable::Gauge(gauge), time_s, value }).collect()
}

/// Times (s) and values of a named column of a series.
pub(super) fn column_series(file: &str, series: &str, column: &str) -> Vec<(f64, f64)> {
    let (header, rows) = table(file);
    let index = header.iter().position(|name| *name == column).unwrap_or_else(|| panic!("no column {column:?}"));
    let published = rows.iter().filter(|row| row[0] == series && !row[index].is_empty());
    let figures: Vec<(f64, f64)> = published.map(|row| (number(row[1]), number(row[index]))).collect();
    assert!(!figures.is_empty(), "no series {series:?} in the file that begins {:?}", file.lines().next());
    figures
}

/// The columns of a file of numbers.
pub(super) fn columns(file: &str) -> Vec<Vec<f64>> {
    let (header, rows) = table(file);
    (0..header.len()).map(|column| rows.iter().map(|row| number(row[column])).collect()).collect()
}

/// Fields of the header and of the rows.
fn table(file: &str) -> (Vec<&str>, Vec<Vec<&str>>) {
    let mut lines = file.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').collect());
    (lines.next().unwrap_or_default(), lines.collect())
}

fn number(text: &str) -> f64 {
    text.parse().expect("the files are part of the library, and every one is read by its tests")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "# source\nseries,time_s,0,0.01\nA,1,20,10\nB,1,30,5\nA,2,25,\n";

    #[test]
    fn a_series_is_read_with_its_own_depths_times_and_zero() {
        let expected = [(0.0, 1.0, 293.15), (0.01, 1.0, 283.15), (0.0, 2.0, 298.15)];
        let expected =
            expected.map(|(depth_m, time_s, temperature_k)| ReferencePoint::at(depth_m, time_s, temperature_k));
        assert_eq!(points(FILE, "A", 273.15), expected);
    }

    #[test]
    #[should_panic(expected = "no series \"C\"")]
    fn a_missing_series_panics() {
        points(FILE, "C", 0.0);
    }

    #[test]
    fn a_named_column_skips_empty_fields() {
        let file = "series,time_s,front_m\nA,1,0.5\nA,2,\nB,2,0.75\nA,3,0.25\n";
        assert_eq!(column_series(file, "A", "front_m"), [(1.0, 0.5), (3.0, 0.25)]);
    }
}
