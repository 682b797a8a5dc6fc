//! Published figures, re-typed into `data/verification` and built into the library.
//!
//! A file is a few lines of `#` naming its public source, version and licence, a header
//! `series,time_s,<depth in m>,…`, and a row a series and time.

use super::problem::Point;

/// The points of one series of a file; its zero of temperature in K is added to every figure.
pub(super) fn points(file: &str, series: &str, zero_k: f64) -> Vec<Point> {
    let (header, rows) = table(file);
    let depths_m: Vec<f64> = header[2..].iter().map(|depth| number(depth)).collect();
    let mut points = Vec::new();
    for row in rows.iter().filter(|row| row[0] == series) {
        for (&depth_m, value) in depths_m.iter().zip(&row[2..]) {
            points.push(Point { depth_m, time_s: number(row[1]), temperature_k: zero_k + number(value) });
        }
    }
    assert!(!points.is_empty(), "no series {series:?} in the file that begins {:?}", file.lines().next());
    points
}

/// The columns of a file of numbers.
pub(super) fn columns(file: &str) -> Vec<Vec<f64>> {
    let (header, rows) = table(file);
    (0..header.len()).map(|column| rows.iter().map(|row| number(row[column])).collect()).collect()
}

/// Header and rows, in their fields.
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

    const FILE: &str = "# source\nseries,time_s,0,0.01\nA,1,20,10\nB,1,30,5\nA,2,25,12\n";

    #[test]
    fn a_series_is_read_with_its_own_depths_times_and_zero() {
        let read: Vec<_> = points(FILE, "A", 273.15).iter().map(|p| (p.depth_m, p.time_s, p.temperature_k)).collect();
        assert_eq!(read, [(0.0, 1.0, 293.15), (0.01, 1.0, 283.15), (0.0, 2.0, 298.15), (0.01, 2.0, 285.15)]);
    }

    #[test]
    #[should_panic(expected = "no series \"C\"")]
    fn a_series_that_is_not_there_is_not_passed_over() {
        points(FILE, "C", 0.0);
    }
}
