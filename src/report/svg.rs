//! A figure as a static SVG image: its layers as shapes at positions in pixels, which `shapes` writes.

mod clip;
mod corner;
mod layers;
mod shapes;

use super::figure::{Axis, Colour, Figure, Layer, Scale};
use super::{format, ticks};
use clip::Frame;
use shapes::{Anchor, Point, Shape, Text};

/// Size of the image, pixels.
const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 520.0;
/// Narrowest column of a legend, right margin without one, and widest column of labels at the left, pixels.
const LEGEND_WIDTH: f64 = 190.0;
const RIGHT_MARGIN: f64 = 20.0;
const LABELS_WIDTH: f64 = 76.0;
/// Top and bottom of the plot, pixels.
const PLOT_TOP: f64 = 44.0;
const PLOT_BOTTOM: f64 = 454.0;
/// Width of an average letter, as a share of the font size.
const LETTER_WIDTH: f64 = 0.58;
/// Sizes of fonts, pixels: title, axis labels, ticks and legend.
const TITLE_SIZE: f64 = 17.0;
const LABEL_SIZE: f64 = 15.0;
const TICK_SIZE: f64 = 14.0;
/// Longest name at a tick, characters.
const MAX_TICK_CHARS: usize = 30;
/// Most ticks of a linear axis.
const MAX_TICKS: usize = 9;

const TEXT_COLOUR: Colour = (0x22, 0x22, 0x22);
const GRID_COLOUR: Colour = (0xDD, 0xDD, 0xDD);
const AXIS_COLOUR: Colour = (0x99, 0x99, 0x99);

/// The figure as an SVG document of 900 × 520.
pub(super) fn draw(figure: &Figure) -> String {
    let title = text(figure.title.clone(), (20.0, 21.0), TITLE_SIZE, Anchor::Start);
    let mut shapes = vec![Shape::Text(Text { is_bold: true, ..title })];
    if let [Layer::CornerPlot { variables, regions }] = figure.layers.as_slice() {
        corner::draw(variables, regions, (WIDTH - RIGHT_MARGIN, HEIGHT), &mut shapes);
        return shapes::document((WIDTH, HEIGHT), &shapes);
    }
    let legend = layers::legend(&figure.layers);
    let right = WIDTH - if legend.is_empty() { RIGHT_MARGIN } else { layers::legend_width(&legend) };
    let plot = Plot::new(figure, right - 14.0);
    plot.draw_axes(figure, &mut shapes);
    for layer in &figure.layers {
        layers::draw(layer, &plot, &mut shapes);
    }
    for (row, entry) in legend.iter().enumerate() {
        entry.draw((right + 8.0, 60.0 + 24.0 * row as f64), &mut shapes);
    }
    shapes::document((WIDTH, HEIGHT), &shapes)
}

/// A text in the colour of all texts.
fn text(text: String, at: Point, size: f64, anchor: Anchor) -> Text {
    Text { text, at, size, anchor, colour: TEXT_COLOUR, is_bold: false, rotation: 0.0 }
}

/// The width of a text of this many characters, pixels.
fn text_width(characters: usize, size: f64) -> f64 {
    LETTER_WIDTH * size * characters as f64
}

/// One axis of a plot, between two positions in pixels.
struct PlotAxis {
    axis: Axis,
    /// Values at the start and the end in plotted units (logarithms on a log axis); the first may be the larger.
    ends: (f64, f64),
    positions: (f64, f64),
}

impl PlotAxis {
    fn position(&self, value: f64) -> f64 {
        self.position_of(to_plotted_units(&self.axis, value))
    }

    /// The position of a value in plotted units.
    fn position_of(&self, plotted: f64) -> f64 {
        let ((from, to), (start, end)) = (self.ends, self.positions);
        start + (plotted - from) / (to - from) * (end - start)
    }

    /// The position of a value, or that of the end of the axis beyond which it is.
    fn position_within(&self, value: f64) -> f64 {
        let (start, end) = self.positions;
        let position = self.position(value);
        // No logarithm is below the axis.
        if position.is_nan() { start } else { position.clamp(start.min(end), start.max(end)) }
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        let (low, high) = (self.ends.0.min(self.ends.1), self.ends.0.max(self.ends.1));
        let ticks = ticks::ticks(&self.axis, (low, high), MAX_TICKS).into_iter();
        ticks.map(|(tick, label)| (self.position_of(tick), format::truncate(&label, MAX_TICK_CHARS))).collect()
    }

    fn has_grid(&self) -> bool {
        !matches!(self.axis.scale, Scale::Categories(_))
    }
}

/// The axes of a figure.
struct Plot {
    x: PlotAxis,
    y: PlotAxis,
}

impl Plot {
    /// The plot of a figure, up to `right`.
    fn new(figure: &Figure, right: f64) -> Self {
        let (across, up) = axis_ranges(figure);
        let y = PlotAxis { axis: figure.y.clone(), ends: up, positions: (PLOT_BOTTOM, PLOT_TOP) };
        let longest = y.ticks().iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
        let title = if figure.y.label.is_empty() { 0.0 } else { 12.0 + LABEL_SIZE };
        let least = if y.has_grid() { LABELS_WIDTH } else { 0.0 };
        let left = 8.0 + (title + 14.0 + text_width(longest, TICK_SIZE)).max(least);
        Self { x: PlotAxis { axis: figure.x.clone(), ends: across, positions: (left, right) }, y }
    }

    fn at(&self, x: f64, y: f64) -> Point {
        (self.x.position(x), self.y.position(y))
    }

    fn frame(&self) -> Frame {
        let ((left, right), (bottom, top)) = (self.x.positions, self.y.positions);
        Frame { left, right, top, bottom }
    }

    fn draw_axes(&self, figure: &Figure, shapes: &mut Vec<Shape>) {
        let ((left, right), (bottom, top)) = (self.x.positions, self.y.positions);
        let (across, up) = (self.x.ticks(), self.y.ticks());
        let vertical = |x: f64, from: f64, to: f64| vec![(x, from), (x, to)];
        let horizontal = |y: f64, from: f64, to: f64| vec![(from, y), (to, y)];
        let mut grid: Vec<Vec<Point>> = Vec::new();
        if self.x.has_grid() {
            grid.extend(across.iter().map(|(x, _)| vertical(*x, top, bottom)));
        }
        if self.y.has_grid() {
            grid.extend(up.iter().map(|(y, _)| horizontal(*y, left, right)));
        }
        let frame = [vec![(left, top), (left, bottom), (right, bottom)]].into_iter();
        let marks = across.iter().map(|(x, _)| vertical(*x, bottom, bottom + 4.0));
        let marks = marks.chain(up.iter().map(|(y, _)| horizontal(*y, left - 4.0, left)));
        shapes.push(Shape::lines(grid, GRID_COLOUR, 1.0));
        shapes.push(Shape::lines(frame.chain(marks).collect(), AXIS_COLOUR, 1.0));
        // Names that would touch each other are slanted.
        let longest = across.iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
        let is_slanted =
            across.len() as f64 * (text_width(longest, TICK_SIZE) + 8.0) > right - left && !self.x.has_grid();
        for (x, label) in across {
            shapes.push(Shape::Text(if is_slanted {
                let label = text(label, (x + 2.0, bottom + 12.0), TICK_SIZE - 2.0, Anchor::End);
                Text { rotation: -20.0, ..label }
            } else {
                text(label, (x, bottom + 15.0), TICK_SIZE, Anchor::Middle)
            }));
        }
        shapes
            .extend(up.into_iter().map(|(y, label)| Shape::Text(text(label, (left - 8.0, y), TICK_SIZE, Anchor::End))));
        let (middle, halfway) = ((left + right) / 2.0, (top + bottom) / 2.0);
        if !figure.x.label.is_empty() {
            let label = text(figure.x.label.clone(), (middle, HEIGHT - 18.0), LABEL_SIZE, Anchor::Middle);
            shapes.push(Shape::Text(label));
        }
        if !figure.y.label.is_empty() {
            let label = text(figure.y.label.clone(), (16.0, halfway), LABEL_SIZE, Anchor::Middle);
            shapes.push(Shape::Text(Text { rotation: -90.0, ..label }));
        }
    }
}

/// Range of each axis in plotted units, with a margin around the curves.
fn axis_ranges(figure: &Figure) -> ((f64, f64), (f64, f64)) {
    let (x, y) = figure.extent();
    let stretch = |axis: &Axis, (low, high): (f64, f64), air: f64| {
        let (low, high) = (to_plotted_units(axis, low), to_plotted_units(axis, high));
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        let reach = if high > low { high - low } else { low.abs().max(1.0) };
        let air = if axis.range.is_some() && high > low { 0.0 } else { air * reach };
        (low - air, high + air)
    };
    let surface = figure.layers.iter().any(|layer| matches!(layer, Layer::Contours { .. }));
    let (across, up) = if surface { (0.0, 0.0) } else { (0.03, 0.05) };
    // Rows of a matrix run downwards.
    let (low, high) = stretch(&figure.y, y, up);
    let down = matches!(figure.y.scale, Scale::Categories(_));
    (stretch(&figure.x, x, across), if down { (high, low) } else { (low, high) })
}

/// A value in plotted units; not finite where a log axis has none.
fn to_plotted_units(axis: &Axis, value: f64) -> f64 {
    if axis.scale == Scale::Log { value.log10() } else { value }
}

#[cfg(test)]
mod tests {
    use super::super::{figures, marched};
    use super::*;

    #[test]
    fn every_figure_of_a_study_is_drawn_with_its_title_and_without_nan() {
        let mut outcomes = marched::study();
        outcomes.sensitivity.all.standard_errors[5] = f64::INFINITY;
        for figure in figures::all(&outcomes.answers("study")) {
            let svg = draw(&figure);
            assert!(svg.starts_with("<svg width=\"900\" height=\"520\" ") && svg.ends_with("</svg>\n"), "{svg}");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{} contains NaN", figure.id);
            assert!(svg.matches("<path ").count() > 2, "{} is empty", figure.id);
            assert!(
                svg.contains(&format!(">{}</text>", super::super::html::table::escaped(&figure.title))),
                "{}",
                figure.id
            );
        }
    }

    #[test]
    fn markup_in_a_name_is_escaped() {
        let mut outcomes = marched::study();
        outcomes.case.sensors[0].name = "<script>".to_owned();
        let svg = draw(&figures::all(&outcomes.answers("predict"))[0]);
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;"));
    }

    fn axis(axis: Axis, ends: (f64, f64)) -> PlotAxis {
        PlotAxis { axis, ends, positions: (400.0, 0.0) }
    }

    #[test]
    fn rows_of_a_matrix_run_downwards() {
        let rows = axis(Axis::categories("", vec!["a".to_owned(), "b".to_owned()]), (1.5, -0.5));
        assert!(rows.position(0.0) < rows.position(1.0));
        assert_eq!((rows.position(1.5), rows.position(-0.5)), (400.0, 0.0));
    }

    #[test]
    fn an_error_bar_below_a_log_axis_ends_at_it() {
        let log = axis(Axis::log(""), (0.0, 2.0));
        assert_eq!((log.position(10.0), log.position_within(10.0)), (200.0, 200.0));
        assert_eq!([-1.0, 0.0, 0.5, 1e9].map(|value| log.position_within(value)), [400.0, 400.0, 400.0, 0.0]);
    }

    #[test]
    fn an_axis_whose_stated_range_has_no_length_is_widened() {
        let mut figure = figures::correlation_matrix("a", "A", String::new(), vec!["f".to_owned()], &[vec![1.0]]);
        figure.x = Axis::linear("").with_range(3.0, 3.0);
        let ((low, high), _) = axis_ranges(&figure);
        assert!(low < 3.0 && high > 3.0);
    }
}
