//! Plot of the diagram.

use plotters::prelude::*;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/integrators.svg");
/// Ranges of the axes.
const SECONDS: std::ops::Range<f64> = 0.3..50.0;
const ERRORS_K: std::ops::Range<f64> = 0.005..1.0;

/// Time (s) and error (K) of a candidate's Pareto front, from the fastest on.
pub(crate) struct Curve {
    pub title: String,
    pub points: Vec<(f64, f64)>,
}

/// Draw panels of error against time, both on logarithmic axes.
pub(crate) fn draw(panels: [(&str, &[Curve]); 2]) {
    write(panels).unwrap_or_else(|error| panic!("{PATH}: {error}"));
}

fn write(panels: [(&str, &[Curve]); 2]) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::new(PATH, (1200, 520)).into_drawing_area();
    area.fill(&WHITE)?;
    for (area, (title, curves)) in area.split_evenly((1, panels.len())).iter().zip(panels) {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .caption(title, ("sans-serif", 16))
            .x_label_area_size(40)
            .y_label_area_size(50)
            .build_cartesian_2d(SECONDS.log_scale(), ERRORS_K.log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc("5,000 members on one thread, s")
            .y_desc("largest error at any sensor and instant, K")
            .draw()?;
        chart.draw_series(DashedLineSeries::new(
            [(SECONDS.start, 0.05), (SECONDS.end, 0.05)],
            4,
            4,
            BLACK.stroke_width(1),
        ))?;
        for (place, curve) in curves.iter().enumerate() {
            let colour = Palette99::pick(place).to_rgba();
            let shown = curve.points.iter().filter(|(s, k)| SECONDS.contains(s) && ERRORS_K.contains(k));
            let line = LineSeries::new(shown.copied(), colour.stroke_width(2)).point_size(3);
            let key = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2));
            chart.draw_series(line)?.label(&curve.title).legend(key);
        }
        let corner = SeriesLabelPosition::UpperRight;
        chart.configure_series_labels().position(corner).background_style(WHITE).border_style(BLACK).draw()?;
    }
    area.present()?;
    Ok(())
}
