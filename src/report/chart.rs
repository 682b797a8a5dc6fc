//! A figure as an interactive chart: traces and layout of plotly.js, as JSON.
//!
//! Trace and layout attributes are those of the plotly.js reference, <https://plotly.com/javascript/reference/>.

mod corner;

use super::figure::{Axis, Colour, Figure, Ink, Layer, Scale, Stroke, diverging_colour, sequential_colour};
use super::{contour, format, ticks};
use serde_json::{Value, json};
use std::ops::Range;

/// Most ticks of an axis of integers.
const MAX_TICKS: usize = 9;

/// `{"traces": […], "layout": {…}}`.
pub(super) fn draw(figure: &Figure) -> Value {
    if let [Layer::CornerPlot { variables, regions }] = figure.layers.as_slice() {
        return corner::draw(variables, regions);
    }
    let mut parts = ChartParts::default();
    figure.layers.iter().for_each(|layer| parts.add(figure, layer));
    let ChartParts { traces, shapes, slider } = parts;
    let mut layout = layout(figure, &traces, shapes);
    if let Some(slider) = slider {
        slider.add_to(&mut layout, traces.len());
    }
    json!({"traces": traces, "layout": layout})
}

/// Traces and shapes of a chart, and its slider.
#[derive(Default)]
struct ChartParts {
    traces: Vec<Value>,
    shapes: Vec<Value>,
    slider: Option<Slider>,
}

/// A slider that shows the traces of one step at a time.
struct Slider {
    label: String,
    names: Vec<String>,
    shown: usize,
    /// Traces of each step.
    traces: Vec<Range<usize>>,
}

impl Slider {
    /// Add the slider to the layout of a chart of `traces` traces. The legend moves above the chart.
    fn add_to(&self, layout: &mut Value, traces: usize) {
        let is_of_a_step = |trace: &usize| self.traces.iter().any(|step| step.contains(trace));
        let step = |(name, own): (&String, &Range<usize>)| {
            let visible: Vec<bool> = (0..traces).map(|trace| !is_of_a_step(&trace) || own.contains(&trace)).collect();
            json!({"label": escaped(name), "method": "restyle", "args": [{"visible": visible}]})
        };
        layout["sliders"] = json!([{
            "active": self.shown, "currentvalue": {"prefix": escaped(&self.label), "xanchor": "left"},
            "pad": {"t": 48, "b": 8}, "len": 1.0, "minorticklen": 0, "ticklen": 4,
            "steps": self.names.iter().zip(&self.traces).map(step).collect::<Vec<Value>>(),
        }]);
        layout["legend"] = json!({"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"});
    }
}

impl ChartParts {
    fn add(&mut self, figure: &Figure, layer: &Layer) {
        let Self { traces, shapes, .. } = self;
        match layer {
            Layer::Line { name, ink, stroke, x, y } => {
                traces.push(with_name(
                    name,
                    json!({
                        "type": "scatter", "mode": "lines", "x": numbers(x), "y": numbers(y),
                        "line": {"color": colour(*ink), "width": stroke.width(), "dash": dash(*stroke)},
                    }),
                ));
            }
            Layer::Points { name, ink, x, y, error } => {
                let mut trace = json!({
                    "type": "scatter", "mode": "markers", "x": numbers(x), "y": numbers(y),
                    "marker": {"color": colour(*ink), "size": if error.is_empty() { 8 } else { 5 }},
                });
                if !error.is_empty() {
                    trace["error_y"] = json!({
                        "type": "data", "array": numbers(error), "thickness": 1, "width": 0,
                        "color": faded(*ink, 0.6),
                    });
                }
                traces.push(with_name(name, trace));
            }
            Layer::Band { name, ink, opacity, x, low, high } => {
                let x = numbers(x);
                let edge = json!({"color": faded(*ink, 0.5), "width": 0.5});
                traces.push(json!({
                    "type": "scatter", "mode": "lines", "x": x, "y": numbers(low), "line": edge,
                    "name": escaped(&format!("{name}, low")), "showlegend": false,
                }));
                traces.push(json!({
                    "type": "scatter", "mode": "lines", "x": x, "y": numbers(high), "line": edge,
                    "name": escaped(name), "showlegend": !name.is_empty(), "fill": "tonexty",
                    "fillcolor": faded(*ink, *opacity),
                }));
            }
            Layer::StackedAreas { x, parts } => {
                let x = numbers(x);
                for part in parts {
                    traces.push(with_name(
                        &part.name,
                        json!({
                            "type": "scatter", "mode": "lines", "x": x, "y": numbers(&part.values),
                            "stackgroup": "shares", "fillcolor": faded(part.ink, 0.85),
                            "line": {"width": 0.5, "color": colour(part.ink)},
                            "hovertemplate": "%{y:.0f} %",
                        }),
                    ));
                }
            }
            Layer::Interval { name, from, to } => {
                shapes.push(json!({
                    "type": "rect", "xref": "x", "yref": "paper", "x0": from, "x1": to, "y0": 0, "y1": 1,
                    "layer": "below", "line": {"width": 0}, "fillcolor": faded(Ink::Series(4), 0.12),
                }));
                // Shapes have no legend entry: an empty trace provides it.
                traces.push(with_name(
                    name,
                    json!({
                        "type": "scatter", "mode": "markers", "x": [null], "y": [null], "hoverinfo": "skip",
                        "marker": {"symbol": "square", "size": 12, "color": faded(Ink::Series(4), 0.3)},
                    }),
                ));
            }
            Layer::Heatmap { values } => traces.push(heatmap(figure, values)),
            // Drawn by `corner`.
            Layer::CornerPlot { .. } => {}
            Layer::Steps { label, names, steps, shown } => {
                let mut ranges = Vec::with_capacity(steps.len());
                for (step, layers) in steps.iter().enumerate() {
                    let first = self.traces.len();
                    layers.iter().for_each(|layer| self.add(figure, layer));
                    self.traces[first..].iter_mut().for_each(|trace| trace["visible"] = json!(step == *shown));
                    ranges.push(first..self.traces.len());
                }
                let (label, names) = (label.clone(), names.clone());
                self.slider = Some(Slider { label, names, shown: *shown, traces: ranges });
            }
            Layer::Contours { name, x, y, values, levels } => {
                let lines = contour::log_contours(x, y, values, levels);
                traces
                    .extend(levels.iter().zip(&lines).map(|(level, lines)| contour_line(name, levels, *level, lines)));
                traces.push(colour_bar(name, levels));
            }
            Layer::BoxPlot { name, ink, percentiles } => {
                let of = |index: usize| -> Vec<f64> { percentiles.iter().map(|p| p[index]).collect() };
                let places: Vec<f64> = (0..percentiles.len()).map(|index| index as f64).collect();
                let bar = |low: usize, high: usize, thickness: u32, opacity: f64| {
                    let away =
                        |side: usize| -> Vec<f64> { percentiles.iter().map(|p| (p[side] - p[2]).abs()).collect() };
                    json!({
                        "type": "scatter", "mode": "markers", "x": numbers(&places), "y": numbers(&of(2)),
                        "hovertemplate": "median %{y:.1f} K<extra></extra>",
                        "marker": {"size": 7, "color": "white", "line": {"width": 1, "color": colour(*ink)}},
                        "error_y": {
                            "type": "data", "symmetric": false, "array": numbers(&away(high)),
                            "arrayminus": numbers(&away(low)), "thickness": thickness, "width": 0,
                            "color": faded(*ink, opacity),
                        },
                    })
                };
                traces.push(with_name("", bar(0, 4, 2, 1.0)));
                traces.push(with_name(name, bar(1, 3, 12, 0.8)));
            }
        }
    }
}

fn layout(figure: &Figure, traces: &[Value], shapes: Vec<Value>) -> Value {
    // A common hover box for all curves, if they are few.
    let together = matches!(figure.x.scale, Scale::Linear)
        && figure.layers.len() <= 9
        && !figure.layers.iter().any(|layer| matches!(layer, Layer::Contours { .. }));
    let (across, up) = figure.extent();
    json!({
        "xaxis": axis(&figure.x, across, false),
        "yaxis": axis(&figure.y, up, true),
        "shapes": shapes,
        "hovermode": if together { "x unified" } else { "closest" },
        "showlegend": traces.iter().any(|trace| trace["showlegend"] == json!(true)),
    })
}

/// `extent` is the range shown.
fn axis(axis: &Axis, extent: (f64, f64), vertical: bool) -> Value {
    let mut out = json!({
        "title": {"text": escaped(&axis.label), "standoff": 8},
        "automargin": true,
    });
    match &axis.scale {
        Scale::Linear => {}
        Scale::Integer => {
            out["tick0"] = json!(0);
            out["dtick"] = json!(ticks::step(axis, extent, MAX_TICKS));
        }
        Scale::Log => {
            out["type"] = json!("log");
            let (low, high) = extent;
            let ticks = ticks::log_ticks(low.log10() - 1.0, high.log10() + 1.0);
            out["tickmode"] = json!("array");
            out["tickvals"] = json!(ticks.iter().map(|tick| 10_f64.powf(*tick)).collect::<Vec<f64>>());
            out["ticktext"] = json!(ticks.iter().map(|tick| ticks::log_label(*tick)).collect::<Vec<String>>());
        }
        Scale::Categories(names) => {
            out["type"] = json!("linear");
            out["tickmode"] = json!("array");
            out["tickvals"] = json!((0..names.len()).collect::<Vec<usize>>());
            out["ticktext"] = json!(names.iter().map(|name| escaped(name)).collect::<Vec<String>>());
            // Many horizontal names would overlap.
            if !vertical && names.len() > 4 {
                out["tickangle"] = json!(-40);
            }
            out["showgrid"] = json!(false);
            out["zeroline"] = json!(false);
        }
    }
    if let Some((low, high)) = axis.range {
        // Rows of a matrix run downwards.
        let down = vertical && matches!(axis.scale, Scale::Categories(_));
        out["range"] = if down { json!([high, low]) } else { json!([low, high]) };
    }
    out
}

fn heatmap(figure: &Figure, values: &[Vec<f64>]) -> Value {
    let names: &[String] = if let Scale::Categories(names) = &figure.y.scale { names } else { &[] };
    let labels: Vec<Vec<String>> = values
        .iter()
        .map(|row| row.iter().map(|v| if v.is_finite() { format!("{v:.2}") } else { "–".to_owned() }).collect())
        .collect();
    let stop = |value: f64| json!([0.5 + 0.5 * value, css(diverging_colour(value))]);
    let pairs: Vec<Vec<String>> = (0..values.len())
        .map(|row| {
            let other = |column: usize| names.get(column).map_or("", String::as_str);
            (0..values[row].len()).map(|column| escaped(&format!("{} and {}", other(row), other(column)))).collect()
        })
        .collect();
    json!({
        "type": "heatmap", "z": values.iter().map(|row| numbers(row)).collect::<Vec<Value>>(),
        "zmin": -1, "zmax": 1, "colorscale": [stop(-1.0), stop(0.0), stop(1.0)], "xgap": 2, "ygap": 2,
        "text": labels, "texttemplate": "%{text}", "customdata": pairs,
        "hovertemplate": "%{customdata}: %{z:.3f}<extra></extra>",
        "colorbar": {"thickness": 12, "tickvals": [-1, -0.5, 0, 0.5, 1]},
    })
}

/// One contour level, from the lines of the static image: the contours of plotly require a rectangular grid.
fn contour_line(name: &str, levels: &[f64], level: f64, lines: &[contour::Line]) -> Value {
    let (first, last) = log_range(levels);
    let share = if last > first { (level.log10() - first) / (last - first) } else { 0.0 };
    let each = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        lines.iter().flat_map(|line| line.iter().map(of).chain([f64::NAN])).collect()
    };
    json!({
        "type": "scatter", "mode": "lines", "x": numbers(&each(|at| at.0)), "y": numbers(&each(|at| at.1)),
        "line": {"width": 2, "color": css(sequential_colour(share))}, "showlegend": false, "name": escaped(name),
        "hovertemplate": format!("{} = {}<extra></extra>", escaped(name), format::significant(level, 3)),
    })
}

/// The colour bar of the levels, on a trace without points.
fn colour_bar(name: &str, levels: &[f64]) -> Value {
    let (first, last) = log_range(levels);
    let shown = levels.iter().step_by(2);
    let stops = (0..=6).map(|n| f64::from(n) / 6.0).map(|t| json!([t, css(sequential_colour(t))]));
    json!({
        "type": "scatter", "mode": "markers", "x": [null], "y": [null], "hoverinfo": "skip", "showlegend": false,
        "marker": {
            "color": [first], "cmin": first, "cmax": last, "showscale": true,
            "colorscale": stops.collect::<Vec<Value>>(),
            "colorbar": {
                "title": {"text": escaped(name), "side": "right"}, "thickness": 12,
                "tickvals": shown.clone().map(|level| level.log10()).collect::<Vec<f64>>(),
                "ticktext": shown.map(|level| format::significant(*level, 2)).collect::<Vec<String>>(),
            },
        },
    })
}

/// Decimal logarithms of the first and the last level.
fn log_range(levels: &[f64]) -> (f64, f64) {
    (levels.first().map_or(0.0, |level| level.log10()), levels.last().map_or(1.0, |level| level.log10()))
}

fn with_name(name: &str, mut trace: Value) -> Value {
    trace["name"] = json!(escaped(name));
    trace["showlegend"] = json!(!name.is_empty());
    if name.is_empty() && trace.get("hovertemplate").is_none() {
        trace["hoverinfo"] = json!("x+y");
    }
    trace
}

/// Escape a text: plotly interprets some HTML tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Numbers rounded to six significant digits, more than a screen resolves; NaN becomes `null`, a gap.
fn numbers(values: &[f64]) -> Value {
    Value::Array(values.iter().map(|value| number(*value)).collect())
}

fn number(value: f64) -> Value {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { json!(0) } else { Value::Null };
    }
    let scale = 10_f64.powf(5.0 - value.abs().log10().floor());
    if scale.is_finite() && scale >= 1.0 { json!((value * scale).round() / scale) } else { json!(value) }
}

fn dash(stroke: Stroke) -> &'static str {
    match stroke {
        Stroke::Solid | Stroke::Hairline => "solid",
        Stroke::Dashed | Stroke::Thin => "dash",
        Stroke::Dotted => "dot",
    }
}

fn colour(ink: Ink) -> String {
    css(ink.rgb())
}

fn css((red, green, blue): Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn faded(ink: Ink, opacity: f64) -> String {
    let (red, green, blue) = ink.rgb();
    format!("rgba({red},{green},{blue},{opacity})")
}

#[cfg(test)]
mod tests {
    use super::super::{figures, marched};
    use super::*;

    #[test]
    fn every_named_layer_of_a_study_has_its_name_in_the_chart() {
        let outcomes = marched::study();
        for figure in figures::all(&outcomes.answers("study")) {
            let text = draw(&figure).to_string();
            for layer in &figure.layers {
                if let Layer::Line { name, .. } | Layer::Points { name, .. } | Layer::Interval { name, .. } = layer {
                    assert!(text.contains(&escaped(name)), "{} lacks {name}", figure.id);
                }
            }
        }
    }

    #[test]
    fn every_entry_of_a_legend_has_a_name() {
        let outcomes = marched::study();
        let charts: Vec<Value> = figures::all(&outcomes.answers("study")).iter().map(draw).collect();
        let traces = charts.iter().flat_map(|chart| chart["traces"].as_array().expect("a list of traces"));
        let (mut entries, mut bands) = (0, 0);
        for trace in traces {
            bands += usize::from(trace["fill"] == "tonexty" && trace["showlegend"] == json!(false));
            if trace["showlegend"] == json!(true) {
                entries += 1;
                assert!(
                    trace["name"].as_str().is_some_and(|name| !name.is_empty()),
                    "a legend entry without a name: {trace}"
                );
            }
        }
        assert!(entries > 50 && bands > 0, "{entries} entries, {bands} bands without one");
    }

    #[test]
    fn an_axis_of_a_count_has_ticks_at_integers() {
        let of = |end| axis(&Axis::integer("Iteration"), (0.0, end), false)["dtick"].clone();
        assert_eq!([3.0, 9.0, 40.0].map(of), [json!(1.0), json!(1.0), json!(5.0)]);
        assert_eq!(axis(&Axis::linear("Time"), (0.0, 3.0), false).get("dtick"), None);
    }

    #[test]
    fn nan_is_a_gap_and_numbers_have_six_digits() {
        assert_eq!(numbers(&[f64::NAN, 873.123456, 0.0, 1.234_567_89e-7]).to_string(), "[null,873.123,0,1.23457e-7]");
    }
}
