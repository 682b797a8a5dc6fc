//! Plots in a terminal with Braille dots; the name of each curve is at its right end.

use textplots::{Chart, Plot, Shape};

/// Character cells of the plot across; 80 columns with the labels.
const ACROSS: usize = 58;
/// Columns of the labels on the left.
const LEFT: usize = 8;

/// A named curve through points.
pub(super) struct Curve {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
}

/// Plot curves over a common axis in `rows` of characters, from zero or from their minimum; `y` formats the labels.
pub(super) fn chart(
    curves: &[Curve],
    rows: usize,
    from_zero: bool,
    x_label: &str,
    y: impl Fn(f64) -> String,
) -> String {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let bounds = |axis: fn(&(f64, f64)) -> f64| {
        points().map(axis).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (left, right) = bounds(|point| point.0);
    let (low, high) = bounds(|point| point.1);
    let low = if from_zero { 0.0 } else { low };
    // Curves of one value lie in the middle.
    let (low, high) = if low < high { (low, high) } else { (low - 1.0, high + 1.0) };
    // The Braille canvas has two dots across and four down in a cell.
    let (width, height) = (2 * ACROSS as u32 - 1, 4 * rows as u32 - 1);
    let shapes: Vec<Vec<(f32, f32)>> =
        curves.iter().map(|curve| curve.points.iter().map(|&(x, y)| (x as f32, y as f32)).collect()).collect();
    let shapes: Vec<Shape<'_>> = shapes.iter().map(|points| Shape::Lines(points)).collect();
    let mut chart = Chart::new_with_y_range(width, height, left as f32, right as f32, low as f32, high as f32);
    let drawn = shapes.iter().fold(&mut chart, |chart, shape| chart.lineplot(shape));
    drawn.figures();
    let frame = drawn.frame();

    let names = names(curves, rows, |value| ((high - value) / (high - low) * (rows - 1) as f64).round() as usize);
    let mut text = String::new();
    for (row, (line, name)) in frame.lines().zip(&names).enumerate() {
        let label = match row {
            0 => y(high),
            _ if row == rows - 1 => y(low),
            _ if row == rows / 2 => y(high - (high - low) * row as f64 / (rows - 1) as f64),
            _ => String::new(),
        };
        let tick = if label.is_empty() { '│' } else { '┤' };
        let padded: String = line.trim_end().chars().chain(std::iter::repeat(' ')).take(ACROSS).collect();
        text += format!("{label:>LEFT$} {tick}{padded} {name}").trim_end();
        text += "\n";
    }
    let middle = format!("{x_label:^width$}", width = ACROSS - 12);
    text += &format!("{:>LEFT$} └{}\n", "", "─".repeat(ACROSS));
    text += format!("{:>LEFT$}  {left:<6.0}{middle}{right:>6.0}\n", "").as_str();
    text
}

/// The name of each curve in the row of its last value, in the order of these values; further down or up where rows are
/// taken. Names that have no row are counted in the last.
fn names(curves: &[Curve], rows: usize, row_of: impl Fn(f64) -> usize) -> Vec<String> {
    let mut ends: Vec<(f64, &str)> =
        curves.iter().filter_map(|curve| Some((curve.points.last()?.1, curve.name.as_str()))).collect();
    ends.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut names = vec![String::new(); rows];
    let shown = if ends.len() > rows { rows - 1 } else { ends.len() };
    let mut next = 0;
    for (place, (last, name)) in ends[..shown].iter().enumerate() {
        // As many rows are left free below as names follow.
        let row = row_of(*last).min(rows - (ends.len().min(rows) - place)).max(next);
        (names[row], next) = ((*name).to_owned(), row + 1);
    }
    if let Some(hidden @ 1..) = ends.len().checked_sub(shown) {
        names[rows - 1] = format!("+ {hidden} more");
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ending_at(name: &str, last: f64) -> Curve {
        Curve { name: name.to_owned(), points: vec![(0.0, 0.0), (1.0, last)] }
    }

    #[test]
    fn every_curve_has_its_name_in_the_order_of_the_last_values() {
        let curves =
            [ending_at("low", 0.1), ending_at("middle", 0.5), ending_at("lower", 0.0), ending_at("high", 0.55)];
        let row_of = |value: f64| ((1.0 - value) * 3.0).round() as usize;
        assert_eq!(names(&curves, 4, row_of), ["high", "middle", "low", "lower"]);
        assert_eq!(names(&curves, 3, |_| 2), ["high", "middle", "+ 2 more"]);
        assert_eq!(names(&curves[..2], 4, row_of), ["", "", "middle", "low"]);
    }
}
