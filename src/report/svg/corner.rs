//! A corner plot: one panel per pair, each with its own axes.

use super::shapes::{Anchor, Point, Shape, Text};
use super::{AXIS_COLOUR, GRID_COLOUR, PlotAxis, text};
use crate::report::figure::{Axis, Colour, CornerVariable, DensityRegion, Ink};
use crate::report::{contour, ticks};

/// Margins for the labels at the left and the bottom, top of the panels and distance between them, pixels.
const LEFT: f64 = 84.0;
const BOTTOM: f64 = 60.0;
const TOP: f64 = 40.0;
const GAP: f64 = 6.0;
/// Most ticks of a panel, and sizes of its fonts, pixels.
const MAX_TICKS: usize = 6;
const TICK_SIZE: f64 = 12.0;
const NAME_SIZE: f64 = 13.0;

/// Draw into an image of this size.
pub(super) fn draw(
    variables: &[CornerVariable],
    regions: &[DensityRegion],
    (width, height): Point,
    shapes: &mut Vec<Shape>,
) {
    let count = variables.len() as f64;
    let (across, up) = ((width - LEFT) / count, (height - TOP - BOTTOM) / count);
    let panel = |row: usize, column: usize, ends: (f64, f64)| {
        let (left, top) = (LEFT + across * column as f64, TOP + up * row as f64);
        let axis = |ends, positions| PlotAxis { axis: Axis::linear(""), ends, positions };
        Panel {
            row,
            column,
            x: axis(variables[column].range, (left, left + across - GAP)),
            y: axis(ends, (top + up - GAP, top)),
        }
    };
    let blue = Ink::Series(0).rgb();
    let estimate_colour: Colour = Ink::Series(1).rgb();
    for (place, variable) in variables.iter().enumerate() {
        let highest = variable.shares.iter().copied().fold(0.0, f64::max);
        let panel = panel(place, place, (0.0, 1.08 * highest));
        panel.draw_axes(variables, shapes);
        let half = half_bin(variable);
        let bar = |(at, share): (&f64, &f64)| panel.rectangle((at - half, 0.0), (at + half, *share));
        let outlines = variable.bin_centres.iter().zip(&variable.shares).map(bar).collect();
        shapes.push(Shape::Areas { outlines, colour: blue, opacity: 0.55 });
        let upright = |at: f64| vec![panel.at((at, 0.0)), panel.at((at, highest))];
        let (low, high) = variable.interval;
        shapes.push(Shape::Lines {
            lines: vec![upright(low), upright(high)],
            colour: Ink::Measured.rgb(),
            width: 1.5,
            dash: Some((6.0, 4.0)),
            opacity: 1.0,
        });
        shapes.push(Shape::lines(vec![upright(variable.estimate)], estimate_colour, 1.5));
    }
    for region in regions {
        let (x, y) = (&variables[region.across], &variables[region.up]);
        let panel = panel(region.up, region.across, y.range);
        panel.draw_axes(variables, shapes);
        let (wide, tall) = (half_bin(x), half_bin(y));
        for (enclosed, opacity) in [(0.0..=0.5, 0.6), (0.5_f64.next_up()..=0.95, 0.25)] {
            let mut outlines = Vec::new();
            for (row, up) in region.enclosed.iter().zip(&y.bin_centres) {
                let cells = row.iter().zip(&x.bin_centres).filter(|(value, _)| enclosed.contains(*value));
                outlines.extend(
                    cells.map(|(_, across)| panel.rectangle((across - wide, up - tall), (across + wide, up + tall))),
                );
            }
            shapes.push(Shape::Areas { outlines, colour: blue, opacity });
        }
        let across = vec![x.bin_centres.clone(); y.bin_centres.len()];
        let up: Vec<Vec<f64>> = y.bin_centres.iter().map(|&up| vec![up; x.bin_centres.len()]).collect();
        let lines = [0.5, 0.95].map(|level| contour::contour_lines(&across, &up, &region.enclosed, level)).concat();
        let placed = lines.into_iter().map(|line| line.into_iter().map(|point| panel.at(point)).collect());
        shapes.push(Shape::lines(placed.collect(), blue, 1.0));
        let centres = vec![panel.at((x.estimate, y.estimate))];
        shapes.push(Shape::Discs { centres, radius: 4.0, colour: estimate_colour });
    }
}

/// Half of the width of a bin.
fn half_bin(variable: &CornerVariable) -> f64 {
    (variable.range.1 - variable.range.0) / variable.bin_centres.len() as f64 / 2.0
}

/// One panel with its axes.
struct Panel {
    row: usize,
    column: usize,
    x: PlotAxis,
    y: PlotAxis,
}

impl Panel {
    fn at(&self, (x, y): Point) -> Point {
        (self.x.position(x), self.y.position(y))
    }

    /// The corners of a rectangle between values.
    fn rectangle(&self, from: Point, to: Point) -> Vec<Point> {
        [from, (to.0, from.1), to, (from.0, to.1)].map(|corner| self.at(corner)).to_vec()
    }

    /// Grid and frame; labels at the left and at the bottom of the plot alone.
    fn draw_axes(&self, variables: &[CornerVariable], shapes: &mut Vec<Shape>) {
        let ((left, right), (bottom, top)) = (self.x.positions, self.y.positions);
        let ticks = |axis: &PlotAxis| ticks::ticks(&axis.axis, axis.ends, MAX_TICKS);
        let across: Vec<(f64, String)> = ticks(&self.x);
        // The height of a histogram has no unit.
        let up = if self.row == self.column { Vec::new() } else { ticks(&self.y) };
        let vertical = across.iter().map(|(tick, _)| self.x.position(*tick)).map(|x| vec![(x, top), (x, bottom)]);
        let horizontal = up.iter().map(|(tick, _)| self.y.position(*tick)).map(|y| vec![(left, y), (right, y)]);
        shapes.push(Shape::lines(vertical.chain(horizontal).collect(), GRID_COLOUR, 1.0));
        shapes.push(Shape::lines(vec![vec![(left, top), (left, bottom), (right, bottom)]], AXIS_COLOUR, 1.0));
        if self.row + 1 == variables.len() {
            for (tick, label) in across {
                let at = (self.x.position(tick), bottom + 12.0);
                shapes.push(Shape::Text(text(label, at, TICK_SIZE, Anchor::Middle)));
            }
            let at = ((left + right) / 2.0, bottom + 40.0);
            let name = variables[self.column].name.clone();
            shapes.push(Shape::Text(text(name, at, NAME_SIZE, Anchor::Middle)));
        }
        if self.column == 0 && self.row > 0 {
            for (tick, label) in up {
                let at = (left - 6.0, self.y.position(tick));
                shapes.push(Shape::Text(text(label, at, TICK_SIZE, Anchor::End)));
            }
            let name = text(variables[self.row].name.clone(), (16.0, (top + bottom) / 2.0), NAME_SIZE, Anchor::Middle);
            shapes.push(Shape::Text(Text { rotation: -90.0, ..name }));
        }
    }
}
