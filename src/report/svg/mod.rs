//! A figure as a static SVG image.
//!
//! The SVG backend of plotters rounds to integers: the image is drawn at four times its size, for a resolution of a
//! quarter of a pixel. The text is then compressed (`compact`).

mod compact;
mod corner;
mod layers;
mod ticks;

use super::figure::{Axis, Figure, Layer, Scale};
use plotters::coord::Shift;
use plotters::prelude::*;
use ticks::AxisCoordinate;

/// Drawn units per pixel.
const UNITS_PER_PIXEL: u32 = 4;
/// Size of the image, pixels.
const WIDTH: u32 = 900;
const HEIGHT: u32 = 520;
/// Width of the column of the legend, pixels.
const LEGEND_WIDTH: u32 = 190;
const TEXT_COLOUR: RGBColor = RGBColor(0x22, 0x22, 0x22);
const GRID_COLOUR: RGBColor = RGBColor(0xDD, 0xDD, 0xDD);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<AxisCoordinate, AxisCoordinate>>;
type DrawResult = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// The figure as an SVG document of 900 × 520.
///
/// # Errors
/// The message of plotters.
pub(super) fn draw(figure: &Figure) -> Result<String, String> {
    let mut text = String::new();
    {
        let root =
            SVGBackend::with_string(&mut text, (WIDTH * UNITS_PER_PIXEL, HEIGHT * UNITS_PER_PIXEL)).into_drawing_area();
        compose(figure, &root).and_then(|()| root.present()).map_err(|error| error.to_string())?;
    }
    let drawn = format!("width=\"{}\" height=\"{}\"", WIDTH * UNITS_PER_PIXEL, HEIGHT * UNITS_PER_PIXEL);
    let shown = format!("width=\"{WIDTH}\" height=\"{HEIGHT}\" role=\"img\"");
    Ok(compact::compress(&text.replacen(&drawn, &shown, 1)))
}

fn compose(figure: &Figure, root: &Area) -> DrawResult {
    root.fill(&WHITE)?;
    let entries = layers::legend(&figure.layers);
    let width = WIDTH - if entries.is_empty() { 20 } else { LEGEND_WIDTH };
    let (plot, side) = root.split_horizontally(px(width));
    let title = ("sans-serif", f64::from(px(17)) * 1.24, FontStyle::Bold).into_text_style(root).color(&TEXT_COLOUR);
    plot.draw(&Text::new(figure.title.clone(), (px_coordinate(20), px_coordinate(14)), title))?;
    if let [Layer::CornerPlot { variables, regions }] = figure.layers.as_slice() {
        return corner::draw(variables, regions, &plot);
    }
    let (x, y) = axis_ranges(figure);
    let mut chart = ChartBuilder::on(&plot)
        .margin_top(px(44))
        .margin_left(px(8))
        .margin_right(px(14))
        .margin_bottom(px(10))
        .x_label_area_size(px(56))
        .y_label_area_size(px(label_width(&figure.y)))
        .build_cartesian_2d(AxisCoordinate::new(&figure.x, x), AxisCoordinate::new(&figure.y, y))?;
    mesh(figure, &mut chart)?;
    for layer in &figure.layers {
        layers::draw(layer, figure, &mut chart)?;
    }
    for (row, entry) in entries.iter().enumerate() {
        layers::entry(entry, px_coordinate(8), px_coordinate(60 + 24 * row as u32), &side)?;
    }
    Ok(())
}

/// Range of each axis in plotted units (logarithms on a log axis), with a margin around the curves.
fn axis_ranges(figure: &Figure) -> ((f64, f64), (f64, f64)) {
    let (x, y) = figure.extent();
    let stretch = |axis: &Axis, (low, high): (f64, f64), air: f64| {
        let (low, high) = (to_plotted_units(axis, low), to_plotted_units(axis, high));
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        let reach = if high > low { high - low } else { low.abs().max(1.0) };
        if axis.range.is_some() { (low, high) } else { (low - air * reach, high + air * reach) }
    };
    let surface = figure.layers.iter().any(|layer| matches!(layer, Layer::Contours { .. }));
    let (across, up) = if surface { (0.0, 0.0) } else { (0.03, 0.05) };
    // Rows of a matrix run downwards.
    let (low, high) = stretch(&figure.y, y, up);
    let down = matches!(figure.y.scale, Scale::Categories(_));
    (stretch(&figure.x, x, across), if down { (high, low) } else { (low, high) })
}

/// A value in plotted units.
fn to_plotted_units(axis: &Axis, value: f64) -> f64 {
    if axis.scale == Scale::Log { value.log10() } else { value }
}

fn mesh(figure: &Figure, chart: &mut Chart) -> DrawResult {
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(GRID_COLOUR.stroke_width(UNITS_PER_PIXEL))
        .axis_style(RGBColor(0x99, 0x99, 0x99).stroke_width(UNITS_PER_PIXEL))
        .label_style(font(14).color(&TEXT_COLOUR))
        .axis_desc_style(font(15).color(&TEXT_COLOUR))
        .set_all_tick_mark_size(px_coordinate(4))
        .x_desc(figure.x.label.clone())
        .y_desc(figure.y.label.clone());
    if matches!(figure.x.scale, Scale::Categories(_)) {
        mesh.disable_x_mesh();
    }
    if matches!(figure.y.scale, Scale::Categories(_)) {
        mesh.disable_y_mesh();
    }
    mesh.draw()
}

/// Width of the labels of the vertical axis, pixels.
fn label_width(axis: &Axis) -> u32 {
    match &axis.scale {
        Scale::Categories(names) => {
            24 + 8 * names.iter().map(|name| name.chars().count()).max().unwrap_or(0).min(30) as u32
        }
        Scale::Linear | Scale::Log | Scale::Integer => 76,
    }
}

/// Pixels in drawn units.
fn px(shown: u32) -> u32 {
    shown * UNITS_PER_PIXEL
}

/// Pixels in drawn units, as a coordinate.
fn px_coordinate(shown: u32) -> i32 {
    (shown * UNITS_PER_PIXEL) as i32
}

/// A font of a size in pixels; plotters divides sizes by 1.24.
fn font(shown: u32) -> TextStyle<'static> {
    ("sans-serif", f64::from(shown * UNITS_PER_PIXEL) * 1.24)
        .into_text_style(&(WIDTH * UNITS_PER_PIXEL, HEIGHT * UNITS_PER_PIXEL))
}

#[cfg(test)]
mod tests {
    use super::super::{figures, fixture};
    use super::*;

    #[test]
    fn every_figure_of_a_study_is_drawn_with_its_title_and_without_nan() {
        let outcomes = fixture::outcomes();
        for figure in figures::all(&outcomes.answers("study")) {
            let svg = draw(&figure).expect("a figure of the fixture draws");
            assert!(svg.contains("<svg") && svg.contains("</svg>"), "{} is no SVG", figure.id);
            assert!(svg.contains("width=\"900\" height=\"520\""), "{} has another size", figure.id);
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{} contains NaN", figure.id);
            let title = figure.title.replace('\'', "&apos;");
            assert!(svg.contains(&title), "{} lacks its title", figure.id);
        }
    }

    #[test]
    fn markup_in_a_name_is_escaped() {
        let mut outcomes = fixture::outcomes();
        outcomes.case.sensors[0].name = "<script>".to_owned();
        let figure = &figures::all(&outcomes.answers("predict"))[0];
        let svg = draw(figure).expect("it draws");
        assert!(!svg.contains("<script>") && svg.contains("&lt;script&gt;"));
    }
}
