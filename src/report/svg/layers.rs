//! Layers as shapes, and their legend.

use super::shapes::{Anchor, Point, Shape, Text};
use super::{Plot, TEXT_COLOUR, TICK_SIZE, text, text_width};
use crate::report::figure::{Colour, Ink, Layer, Stroke, diverging_colour, sequential_colour};
use crate::report::{contour, format};

const WHITE: Colour = (255, 255, 255);
/// Colour of a value that is not known.
const UNKNOWN_COLOUR: Colour = (0xEE, 0xEE, 0xEE);
const INTERVAL_INK: Ink = Ink::Series(4);
const INTERVAL_OPACITY: f64 = 0.12;
const STACK_OPACITY: f64 = 0.85;
/// Most characters of a name in a legend.
const MAX_NAME_CHARS: usize = 24;
/// Width of the symbol of a legend, pixels.
const SYMBOL_WIDTH: f64 = 28.0;

/// An entry of the legend.
pub(super) struct LegendEntry {
    name: String,
    colour: Colour,
    symbol: LegendSymbol,
}

enum LegendSymbol {
    Line(Stroke),
    Disc,
    /// A filled rectangle of this opacity.
    Patch(f64),
}

/// Legend of layers, top to bottom; stacked areas in the order of the chart, the last on top.
pub(super) fn legend(layers: &[Layer]) -> Vec<LegendEntry> {
    let entry = |name: &str, ink: Ink, symbol| LegendEntry { name: name.to_owned(), colour: ink.rgb(), symbol };
    let mut entries = Vec::new();
    for layer in layers {
        match layer {
            Layer::Line { name, ink, stroke, .. } => entries.push(entry(name, *ink, LegendSymbol::Line(*stroke))),
            Layer::Points { name, ink, .. } => entries.push(entry(name, *ink, LegendSymbol::Disc)),
            Layer::Band { name, ink, opacity, .. } => entries.push(entry(name, *ink, LegendSymbol::Patch(*opacity))),
            Layer::Interval { name, .. } => {
                entries.push(entry(name, INTERVAL_INK, LegendSymbol::Patch(INTERVAL_OPACITY)));
            }
            Layer::BoxPlot { name, ink, .. } => entries.push(entry(name, *ink, LegendSymbol::Patch(1.0))),
            Layer::StackedAreas { parts, .. } => {
                let parts = parts.iter().rev();
                entries.extend(parts.map(|part| entry(&part.name, part.ink, LegendSymbol::Patch(STACK_OPACITY))));
            }
            Layer::Contours { name, levels, .. } => {
                entries.push(LegendEntry { name: name.clone(), colour: WHITE, symbol: LegendSymbol::Patch(0.0) });
                entries.extend(levels.iter().enumerate().rev().map(|(place, level)| LegendEntry {
                    name: format::significant(*level, 2),
                    colour: level_colour(place, levels.len()),
                    symbol: LegendSymbol::Line(Stroke::Solid),
                }));
            }
            Layer::Steps { steps, shown, .. } => entries.extend(legend(&steps[*shown])),
            Layer::Heatmap { .. } | Layer::CornerPlot { .. } => {}
        }
    }
    entries.retain(|entry| !entry.name.is_empty());
    entries
}

/// Width of the column of a legend, pixels.
pub(super) fn legend_width(entries: &[LegendEntry]) -> f64 {
    let longest = entries.iter().map(|entry| entry.name.chars().count().min(MAX_NAME_CHARS)).max().unwrap_or(0);
    (SYMBOL_WIDTH + 20.0 + text_width(longest, TICK_SIZE)).max(super::LEGEND_WIDTH)
}

impl LegendEntry {
    /// Draw the entry with its left end at a point, vertically centred.
    pub(super) fn draw(&self, (x, y): Point, shapes: &mut Vec<Shape>) {
        let colour = self.colour;
        shapes.push(match self.symbol {
            LegendSymbol::Line(stroke) => stroked(vec![vec![(x, y), (x + SYMBOL_WIDTH, y)]], colour, stroke),
            LegendSymbol::Disc => Shape::Discs { centres: vec![(x + SYMBOL_WIDTH / 2.0, y)], radius: 4.0, colour },
            LegendSymbol::Patch(opacity) => {
                Shape::rectangle((x, y - 7.0), (x + SYMBOL_WIDTH, y + 7.0), colour, opacity)
            }
        });
        let name = format::truncate(&self.name, MAX_NAME_CHARS);
        shapes.push(Shape::Text(text(name, (x + SYMBOL_WIDTH + 8.0, y), TICK_SIZE, Anchor::Start)));
    }
}

fn level_colour(place: usize, levels: usize) -> Colour {
    sequential_colour(place as f64 / levels.saturating_sub(1).max(1) as f64)
}

fn stroked(lines: Vec<Vec<Point>>, colour: Colour, stroke: Stroke) -> Shape {
    let dash = match stroke {
        Stroke::Solid | Stroke::Hairline => None,
        Stroke::Dashed | Stroke::Thin => Some((8.0, 5.0)),
        Stroke::Dotted => Some((2.0, 4.0)),
    };
    Shape::Lines { lines, colour, width: f64::from(stroke.width()), dash, opacity: 1.0 }
}

/// Draw one layer.
pub(super) fn draw(layer: &Layer, plot: &Plot, shapes: &mut Vec<Shape>) {
    let frame = plot.frame();
    let inside = |points: Vec<Point>| -> Vec<Point> { points.into_iter().filter(|at| frame.contains(*at)).collect() };
    match layer {
        Layer::Line { ink, stroke, x, y, .. } => {
            let parts = continuous_parts(x.iter().zip(y).map(|(x, y)| plot.at(*x, *y)));
            let (points, lines): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| part.len() == 1);
            let lines = lines.iter().flat_map(|line| frame.lines(line)).collect();
            shapes.push(stroked(lines, ink.rgb(), *stroke));
            // A point between gaps would be a line of no length.
            let radius = 1.5 * f64::from(stroke.width());
            shapes.push(Shape::Discs { centres: inside(points.concat()), radius, colour: ink.rgb() });
        }
        Layer::Points { ink, x, y, error, .. } => {
            let finite = |(_, (x, y)): &(usize, (&f64, &f64))| x.is_finite() && y.is_finite();
            let points: Vec<(usize, (&f64, &f64))> = x.iter().zip(y).enumerate().filter(finite).collect();
            let bar = |(index, (x, y)): &(usize, (&f64, &f64))| {
                let end = |sign: f64| (plot.x.position(**x), plot.y.position_within(**y + sign * error[*index]));
                vec![end(-1.0), end(1.0)]
            };
            if !error.is_empty() {
                let lines = points.iter().map(bar).flat_map(|line| frame.lines(&line)).collect();
                shapes.push(Shape::Lines { lines, colour: ink.rgb(), width: 1.0, dash: None, opacity: 0.6 });
            }
            let radius = if error.is_empty() { 4.0 } else { 2.5 };
            let centres = points.iter().map(|(_, (x, y))| plot.at(**x, **y)).collect();
            shapes.push(Shape::Discs { centres: inside(centres), radius, colour: ink.rgb() });
        }
        Layer::Band { ink, opacity, x, low, high, .. } => {
            let edge = |(x, (low, high)): (&f64, (&f64, &f64))| {
                let ((at, upper), lower) = (plot.at(*x, *high), plot.y.position(*low));
                let is_finite = at.is_finite() && upper.is_finite() && lower.is_finite();
                is_finite.then_some((at, upper, lower))
            };
            let edges: Vec<Option<(f64, f64, f64)>> = x.iter().zip(low.iter().zip(high)).map(edge).collect();
            let outline = |part: &[Option<(f64, f64, f64)>]| -> Vec<Point> {
                let upper = part.iter().flatten().map(|(x, upper, _)| (*x, *upper));
                upper.chain(part.iter().rev().flatten().map(|(x, _, lower)| (*x, *lower))).collect()
            };
            let parts = edges.split(Option::is_none).filter(|part| part.len() > 1);
            let outlines = parts.map(|part| frame.area(&outline(part))).collect();
            shapes.push(Shape::Areas { outlines, colour: ink.rgb(), opacity: *opacity });
        }
        Layer::StackedAreas { x, parts } => {
            let mut floor = vec![0.0; x.len()];
            for part in parts {
                let top: Vec<f64> = floor.iter().zip(&part.values).map(|(low, value)| low + value.max(0.0)).collect();
                let lower = x.iter().zip(&floor).rev();
                let outline: Vec<Point> = x.iter().zip(&top).chain(lower).map(|(x, y)| plot.at(*x, *y)).collect();
                let colour = part.ink.rgb();
                shapes.push(Shape::Areas { outlines: vec![frame.area(&outline)], colour, opacity: STACK_OPACITY });
                floor = top;
            }
        }
        Layer::Interval { from, to, .. } => {
            let ((bottom, top), colour) = (plot.y.positions, INTERVAL_INK.rgb());
            let [left, right] = [from, to].map(|end| plot.x.position_within(*end));
            shapes.push(Shape::rectangle((left, top), (right, bottom), colour, INTERVAL_OPACITY));
        }
        Layer::Heatmap { values } => heatmap(values, plot, shapes),
        // Drawn by `corner`.
        Layer::CornerPlot { .. } => {}
        Layer::Steps { steps, shown, .. } => steps[*shown].iter().for_each(|layer| draw(layer, plot, shapes)),
        Layer::Contours { x, y, values, levels, .. } => {
            for (place, lines) in contour::log_contours(x, y, values, levels).into_iter().enumerate() {
                let placed =
                    |line: contour::Line| -> Vec<Point> { line.into_iter().map(|(x, y)| plot.at(x, y)).collect() };
                let lines = lines.into_iter().flat_map(|line| frame.lines(&placed(line))).collect();
                shapes.push(Shape::lines(lines, level_colour(place, levels.len()), 1.5));
            }
        }
        Layer::BoxPlot { ink, percentiles, .. } => {
            let colour = ink.rgb();
            for (index, [low, quarter, median, three_quarters, high]) in percentiles.iter().enumerate() {
                let (middle, left, right) = (index as f64, index as f64 - 0.12, index as f64 + 0.12);
                shapes.push(Shape::lines(vec![vec![plot.at(middle, *low), plot.at(middle, *high)]], colour, 2.0));
                let corners = (plot.at(left, *quarter), plot.at(right, *three_quarters));
                shapes.push(Shape::rectangle(corners.0, corners.1, colour, 1.0));
                shapes.push(Shape::lines(vec![vec![plot.at(left, *median), plot.at(right, *median)]], WHITE, 2.0));
            }
        }
    }
}

fn heatmap(values: &[Vec<f64>], plot: &Plot, shapes: &mut Vec<Shape>) {
    let size = (90.0 / values.len().max(6) as f64).clamp(9.0, 14.0);
    for (row, line) in values.iter().enumerate() {
        for (column, value) in line.iter().enumerate() {
            let (x, y) = (column as f64, row as f64);
            let (fill, label) = match value.is_finite() {
                true => (diverging_colour(*value), format!("{value:.2}").replace('-', "−")),
                false => (UNKNOWN_COLOUR, "–".to_owned()),
            };
            shapes.push(Shape::rectangle(plot.at(x - 0.49, y - 0.49), plot.at(x + 0.49, y + 0.49), fill, 1.0));
            let colour = if value.abs() > 0.75 { WHITE } else { TEXT_COLOUR };
            let label = text(label, plot.at(x, y), size, Anchor::Middle);
            shapes.push(Shape::Text(Text { colour, ..label }));
        }
    }
}

/// The continuous parts of a curve with gaps.
fn continuous_parts(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let points: Vec<Point> = points.collect();
    let parts = points.split(|(x, y)| !(x.is_finite() && y.is_finite()));
    parts.filter(|part| !part.is_empty()).map(<[Point]>::to_vec).collect()
}
