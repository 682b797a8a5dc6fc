//! Layers and legend.

use super::super::figure::{Figure, Ink, Layer, Stroke, diverging_colour, sequential_colour};
use super::super::{contour, format};
use super::{Area, Chart, DrawResult, TEXT_COLOUR, UNITS_PER_PIXEL, font, px, px_coordinate, to_plotted_units};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// An entry of the legend.
pub(super) struct LegendEntry {
    name: String,
    colour: RGBColor,
    key: LegendSymbol,
}

enum LegendSymbol {
    Line(Stroke),
    Dot,
    Patch(f64),
}

/// Legend of layers, top to bottom; stacked areas in the order of the chart, the last on top.
pub(super) fn legend(layers: &[Layer]) -> Vec<LegendEntry> {
    let mut entries = Vec::new();
    for layer in layers {
        match layer {
            Layer::Line { name, ink, stroke, .. } => entries.push(entry_of(name, *ink, LegendSymbol::Line(*stroke))),
            Layer::Points { name, ink, .. } => entries.push(entry_of(name, *ink, LegendSymbol::Dot)),
            Layer::Band { name, ink, opacity, .. } => entries.push(entry_of(name, *ink, LegendSymbol::Patch(*opacity))),
            Layer::Interval { name, .. } => {
                entries.push(entry_of(name, INTERVAL_COLOUR, LegendSymbol::Patch(INTERVAL_OPACITY)));
            }
            Layer::BoxPlot { name, ink, .. } => entries.push(entry_of(name, *ink, LegendSymbol::Patch(1.0))),
            Layer::StackedAreas { parts, .. } => {
                entries.extend(
                    parts.iter().rev().map(|part| entry_of(&part.name, part.ink, LegendSymbol::Patch(STACK_OPACITY))),
                );
            }
            Layer::Contours { name, levels, .. } => {
                entries.push(LegendEntry { name: name.clone(), colour: WHITE, key: LegendSymbol::Patch(0.0) });
                for (place, level) in levels.iter().enumerate().rev() {
                    let colour = level_colour(place, levels.len());
                    entries.push(LegendEntry {
                        name: format::significant(*level, 2),
                        colour,
                        key: LegendSymbol::Line(Stroke::Solid),
                    });
                }
            }
            Layer::Steps { steps, shown, .. } => entries.extend(legend(&steps[*shown])),
            Layer::Heatmap { .. } | Layer::CornerPlot { .. } => {}
        }
    }
    entries.retain(|entry| !entry.name.is_empty());
    entries
}

const INTERVAL_COLOUR: Ink = Ink::Series(4);
const INTERVAL_OPACITY: f64 = 0.12;
const STACK_OPACITY: f64 = 0.85;
/// Maximum number of characters of a name.
const MAX_NAME_CHARS: usize = 20;

fn entry_of(name: &str, ink: Ink, key: LegendSymbol) -> LegendEntry {
    LegendEntry { name: name.to_owned(), colour: colour(ink), key }
}

fn colour(ink: Ink) -> RGBColor {
    rgb(ink.rgb())
}

fn rgb((red, green, blue): (u8, u8, u8)) -> RGBColor {
    RGBColor(red, green, blue)
}

fn level_colour(place: usize, levels: usize) -> RGBColor {
    rgb(sequential_colour(place as f64 / levels.saturating_sub(1).max(1) as f64))
}

/// Draw an entry of the legend with its left end at `x`, vertically centred at `y`.
pub(super) fn entry(entry: &LegendEntry, x: i32, y: i32, side: &Area) -> DrawResult {
    let middle = x + px_coordinate(14);
    match entry.key {
        LegendSymbol::Line(stroke) => {
            let ends = [(x, y), (x + px_coordinate(28), y)];
            match dashes(stroke) {
                None => side.draw(&PathElement::new(ends, entry.colour.stroke_width(px(stroke.width()))))?,
                Some((dash, gap)) => {
                    let style = entry.colour.stroke_width(px(stroke.width()));
                    side.draw(&DashedPathElement::new(ends, dash, gap, style))?;
                }
            }
        }
        LegendSymbol::Dot => side.draw(&Circle::new((middle, y), px(4), entry.colour.filled()))?,
        LegendSymbol::Patch(opacity) => {
            let corners = [(x, y - px_coordinate(7)), (x + px_coordinate(28), y + px_coordinate(7))];
            side.draw(&Rectangle::new(corners, entry.colour.mix(opacity).filled()))?;
        }
    }
    let anchored = font(14).color(&TEXT_COLOUR).pos(Pos::new(HPos::Left, VPos::Center));
    side.draw(&Text::new(format::truncate(&entry.name, MAX_NAME_CHARS), (x + px_coordinate(36), y), anchored))
}

/// Lengths of dash and gap, drawn units.
fn dashes(stroke: Stroke) -> Option<(i32, i32)> {
    match stroke {
        Stroke::Solid | Stroke::Hairline => None,
        Stroke::Dashed | Stroke::Thin => Some((px_coordinate(8), px_coordinate(5))),
        Stroke::Dotted => Some((px_coordinate(2), px_coordinate(4))),
    }
}

/// Draw one layer.
pub(super) fn draw<'a>(layer: &Layer, figure: &Figure, chart: &mut Chart<'a>) -> DrawResult {
    let at = |x: f64, y: f64| (to_plotted_units(&figure.x, x), to_plotted_units(&figure.y, y));
    match layer {
        Layer::Line { ink, stroke, x, y, .. } => {
            let style = colour(*ink).stroke_width(px(stroke.width()));
            for run in continuous_parts(x.iter().zip(y).map(|(x, y)| at(*x, *y))) {
                match dashes(*stroke) {
                    None => chart.plotting_area().draw(&PathElement::new(run, style))?,
                    Some((dash, gap)) => {
                        chart.plotting_area().draw(&DashedPathElement::new(run, dash, gap, style))?;
                    }
                }
            }
        }
        Layer::Points { ink, x, y, error, .. } => {
            let paint = colour(*ink);
            for (index, (x, y)) in x.iter().zip(y).enumerate().filter(|(_, (x, y))| x.is_finite() && y.is_finite()) {
                if let Some(error) = error.get(index) {
                    let bar = [at(*x, y - error), at(*x, y + error)];
                    chart.plotting_area().draw(&PathElement::new(bar, paint.mix(0.6).stroke_width(UNITS_PER_PIXEL)))?;
                }
                let size = if error.is_empty() { px(4) } else { px(2) + UNITS_PER_PIXEL / 2 };
                chart.plotting_area().draw(&Circle::new(at(*x, *y), size, paint.filled()))?;
            }
        }
        Layer::Band { ink, opacity, x, low, high, .. } => {
            let outline: Vec<(f64, f64)> =
                x.iter().zip(high).chain(x.iter().zip(low).rev()).map(|(x, y)| at(*x, *y)).collect();
            let solid: Vec<(f64, f64)> = outline.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
            chart.plotting_area().draw(&Polygon::new(solid, colour(*ink).mix(*opacity).filled()))?;
        }
        Layer::StackedAreas { x, parts } => {
            let mut floor = vec![0.0; x.len()];
            for part in parts {
                let top: Vec<f64> =
                    floor.iter().zip(&part.values).map(|(floor, value)| floor + value.max(0.0)).collect();
                let lower = x.iter().zip(&floor).rev();
                let outline: Vec<(f64, f64)> = x.iter().zip(&top).chain(lower).map(|(x, y)| at(*x, *y)).collect();
                chart.plotting_area().draw(&Polygon::new(outline, colour(part.ink).mix(STACK_OPACITY).filled()))?;
                floor = top;
            }
        }
        Layer::Interval { from, to, .. } => {
            let up = chart.y_range();
            let across = chart.x_range();
            let corners = [(from.max(across.start), up.start), (to.min(across.end), up.end)];
            chart
                .plotting_area()
                .draw(&Rectangle::new(corners, colour(INTERVAL_COLOUR).mix(INTERVAL_OPACITY).filled()))?;
        }
        Layer::Heatmap { values } => heatmap(values, chart)?,
        // Drawn by `corner`.
        Layer::CornerPlot { .. } => {}
        Layer::Steps { steps, shown, .. } => {
            for layer in &steps[*shown] {
                draw(layer, figure, chart)?;
            }
        }
        Layer::Contours { x, y, values, levels, .. } => {
            for (place, lines) in contour::log_contours(x, y, values, levels).into_iter().enumerate() {
                let style = level_colour(place, levels.len()).stroke_width(px(1) + UNITS_PER_PIXEL / 2);
                for line in lines {
                    chart.plotting_area().draw(&PathElement::new(line, style))?;
                }
            }
        }
        Layer::BoxPlot { ink, percentiles, .. } => {
            let paint = colour(*ink);
            for (index, [low, quarter, median, three_quarters, high]) in percentiles.iter().enumerate() {
                let place = index as f64;
                let thin = [at(place, *low), at(place, *high)];
                let box_ = [at(place - 0.12, *quarter), at(place + 0.12, *three_quarters)];
                let middle = [at(place - 0.12, *median), at(place + 0.12, *median)];
                chart.plotting_area().draw(&PathElement::new(thin, paint.stroke_width(px(2))))?;
                chart.plotting_area().draw(&Rectangle::new(box_, paint.filled()))?;
                chart.plotting_area().draw(&PathElement::new(middle, WHITE.stroke_width(px(2))))?;
            }
        }
    }
    Ok(())
}

fn heatmap<'a>(values: &[Vec<f64>], chart: &mut Chart<'a>) -> DrawResult {
    let crowd = values.len().max(6) as u32;
    let anchored = font((90 / crowd).clamp(9, 14)).pos(Pos::new(HPos::Center, VPos::Center));
    for (row, line) in values.iter().enumerate() {
        for (column, value) in line.iter().enumerate() {
            let (x, y) = (column as f64, row as f64);
            let corners = [(x - 0.49, y - 0.49), (x + 0.49, y + 0.49)];
            let paint = if value.is_finite() { rgb(diverging_colour(*value)) } else { RGBColor(0xEE, 0xEE, 0xEE) };
            chart.plotting_area().draw(&Rectangle::new(corners, paint.filled()))?;
            let text = if value.is_finite() { format!("{value:.2}").replace('-', "−") } else { "–".to_owned() };
            let ink = if value.abs() > 0.75 { WHITE } else { TEXT_COLOUR };
            chart.plotting_area().draw(&Text::new(text, (x, y), anchored.color(&ink)))?;
        }
    }
    Ok(())
}

/// The continuous parts of a curve with gaps.
fn continuous_parts(points: impl Iterator<Item = (f64, f64)>) -> Vec<Vec<(f64, f64)>> {
    let mut runs = vec![Vec::new()];
    for (x, y) in points {
        if x.is_finite() && y.is_finite() {
            runs.last_mut().expect("a run is open from the start").push((x, y));
        } else {
            runs.push(Vec::new());
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}
