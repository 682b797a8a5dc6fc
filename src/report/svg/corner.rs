//! A corner plot: one panel per pair, each with its own axes.

use super::super::contour;
use super::super::figure::{CornerVariable, DensityRegion, Ink};
use super::{Area, DrawResult, GRID_COLOUR, TEXT_COLOUR, UNITS_PER_PIXEL, font, px};
use crate::report::format;
use plotters::prelude::*;

/// Margins for the labels at the left and the bottom, and between panels, pixels.
const LEFT: u32 = 76;
const BOTTOM: u32 = 52;
const GAP: u32 = 6;

pub(super) fn draw(variables: &[CornerVariable], regions: &[DensityRegion], plot: &Area) -> DrawResult {
    let count = variables.len() as u32;
    let (width, height) = plot.dim_in_pixel();
    let top = px(40);
    let (across, up) = ((width - px(LEFT + 14)) / count, (height - top - px(BOTTOM + 8)) / count);
    // The first column and the last row include the margin for labels.
    let cell = |row: usize, column: usize| {
        let x = if column == 0 { 0 } else { px(LEFT) + across * column as u32 };
        let y = top + up * row as u32;
        let wide = across + if column == 0 { px(LEFT) } else { 0 };
        let tall = up + if row as u32 + 1 == count { px(BOTTOM) } else { 0 };
        plot.clone().shrink((x, y), (wide, tall))
    };
    for (place, variable) in variables.iter().enumerate() {
        let highest = variable.shares.iter().copied().fold(0.0, f64::max);
        let mut chart = panel(variables, (place, place), (0.0, 1.08 * highest), &cell(place, place))?;
        let half = (variable.range.1 - variable.range.0) / variable.bin_centres.len() as f64 / 2.0;
        let paint = rgb(Ink::Series(0)).mix(0.55).filled();
        let bars = variable.bin_centres.iter().zip(&variable.shares);
        chart.draw_series(bars.map(|(at, share)| Rectangle::new([(at - half, 0.0), (at + half, *share)], paint)))?;
        let (low, high) = variable.interval;
        for (at, ink) in [(low, Ink::Measured), (high, Ink::Measured), (variable.estimate, Ink::Series(1))] {
            let ends = [(at, 0.0), (at, highest)];
            let style = rgb(ink).stroke_width(px(1) + UNITS_PER_PIXEL / 2);
            if ink == Ink::Measured {
                let dashed = plotters::element::DashedPathElement::new(ends, px(6) as i32, px(4) as i32, style);
                chart.plotting_area().draw(&dashed)?;
            } else {
                chart.plotting_area().draw(&PathElement::new(ends, style))?;
            }
        }
    }
    for region in regions {
        let (x, y) = (&variables[region.across], &variables[region.up]);
        let mut chart = panel(variables, (region.up, region.across), y.range, &cell(region.up, region.across))?;
        let half =
            |variable: &CornerVariable| (variable.range.1 - variable.range.0) / variable.bin_centres.len() as f64 / 2.0;
        let (wide, tall) = (half(x), half(y));
        for (row, up) in region.enclosed.iter().zip(&y.bin_centres) {
            for (enclosed, across) in row.iter().zip(&x.bin_centres).filter(|(enclosed, _)| **enclosed <= 0.95) {
                let paint = rgb(Ink::Series(0)).mix(if *enclosed <= 0.5 { 0.6 } else { 0.25 }).filled();
                let corners = [(across - wide, up - tall), (across + wide, up + tall)];
                chart.plotting_area().draw(&Rectangle::new(corners, paint))?;
            }
        }
        let across = vec![x.bin_centres.clone(); y.bin_centres.len()];
        let up: Vec<Vec<f64>> = y.bin_centres.iter().map(|&up| vec![up; x.bin_centres.len()]).collect();
        for level in [0.5, 0.95] {
            let style = rgb(Ink::Series(0)).stroke_width(px(1));
            for line in contour::contour_lines(&across, &up, &region.enclosed, level) {
                chart.plotting_area().draw(&PathElement::new(line, style))?;
            }
        }
        chart.draw_series([Circle::new((x.estimate, y.estimate), px(4), rgb(Ink::Series(1)).filled())])?;
    }
    Ok(())
}

type Panel<'a> = ChartContext<
    'a,
    SVGBackend<'a>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

/// The axes of a panel, labelled at the left and at the bottom of the plot.
fn panel<'a>(
    variables: &[CornerVariable],
    (row, column): (usize, usize),
    (low, high): (f64, f64),
    area: &Area<'a>,
) -> Result<Panel<'a>, DrawingAreaErrorKind<std::io::Error>> {
    let (x, y) = (&variables[column], &variables[row]);
    let (below, left) = (row + 1 == variables.len(), column == 0);
    let mut chart = ChartBuilder::on(area)
        .margin(px(GAP / 2))
        .x_label_area_size(if below { px(BOTTOM) } else { 0 })
        .y_label_area_size(if left { px(LEFT) } else { 0 })
        .build_cartesian_2d(x.range.0..x.range.1, low..high)?;
    let label = |value: &f64| format::trim_zeros(format!("{value:.4}")).replace('-', "−");
    let mut mesh = chart.configure_mesh();
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(GRID_COLOUR.stroke_width(UNITS_PER_PIXEL))
        .axis_style(RGBColor(0x99, 0x99, 0x99).stroke_width(UNITS_PER_PIXEL))
        .label_style(font(12).color(&TEXT_COLOUR))
        .axis_desc_style(font(13).color(&TEXT_COLOUR))
        .x_labels(5)
        .y_labels(if row == column { 0 } else { 5 })
        .x_label_formatter(&label)
        .y_label_formatter(&label);
    if below {
        mesh.x_desc(x.name.clone());
    }
    if left && row > 0 {
        mesh.y_desc(y.name.clone());
    }
    mesh.draw()?;
    Ok(chart)
}

fn rgb(ink: Ink) -> RGBColor {
    let (red, green, blue) = ink.rgb();
    RGBColor(red, green, blue)
}
