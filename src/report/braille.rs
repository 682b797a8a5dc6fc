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

    let row_of = |value: f64| ((high - value) / (high - low) * (rows - 1) as f64).round() as usize;
    let mut names = vec![String::new(); rows];
    for curve in curves {
        let Some(&(_, last)) = curve.points.last() else { continue };
        // If the row is taken, the name moves down to the next free one.
        let free = (row_of(last)..rows).find(|&row| names[row].is_empty());
        if let Some(row) = free.or_else(|| (0..rows).rev().find(|&row| names[row].is_empty())) {
            names[row].clone_from(&curve.name);
        }
    }
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
