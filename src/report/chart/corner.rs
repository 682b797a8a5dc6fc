//! A corner plot: one panel per pair, each with its own axes.

use super::super::figure::{CornerVariable, DensityRegion, Ink};
use super::{colour, css, escaped, faded, number, numbers};
use serde_json::{Map, Value, json};

/// Gap between panels, as a share of the plot.
const GAP: f64 = 0.02;

/// `{"traces": […], "layout": {…}}`.
pub(super) fn draw(variables: &[CornerVariable], regions: &[DensityRegion]) -> Value {
    let count = variables.len();
    // Axes are numbered row by row; plotly omits the number of the first.
    let axis = |row: usize, column: usize| match row * count + column {
        0 => String::new(),
        place => (place + 1).to_string(),
    };
    let mut layout = Map::new();
    let mut traces = Vec::new();
    let mut panel = |row: usize, column: usize, layers: Vec<Value>| {
        let name = axis(row, column);
        let span =
            |place: usize| [place as f64 / count as f64 + GAP / 2.0, (place + 1) as f64 / count as f64 - GAP / 2.0];
        let (x, y) = (&variables[column], &variables[row]);
        let (below, left) = (row + 1 == count, column == 0 && row > 0);
        let base = json!({"zeroline": false, "mirror": true, "nticks": 6});
        let mut across = base.clone();
        across["domain"] = json!(span(column));
        across["anchor"] = json!(format!("y{name}"));
        across["range"] = json!([x.range.0, x.range.1]);
        across["showticklabels"] = json!(below);
        let mut up = base;
        up["domain"] = json!(span(count - 1 - row));
        up["anchor"] = json!(format!("x{name}"));
        up["showticklabels"] = json!(left);
        if row == column {
            up["rangemode"] = json!("tozero");
            up["showgrid"] = json!(false);
        } else {
            up["range"] = json!([y.range.0, y.range.1]);
        }
        if below {
            across["title"] = json!({"text": escaped(&x.name), "standoff": 6});
        }
        if left {
            up["title"] = json!({"text": escaped(&y.name), "standoff": 6});
        }
        for axis in [&mut across, &mut up] {
            axis["automargin"] = json!(true);
        }
        layout.insert(format!("xaxis{name}"), across);
        layout.insert(format!("yaxis{name}"), up);
        for mut layer in layers {
            layer["xaxis"] = json!(format!("x{name}"));
            layer["yaxis"] = json!(format!("y{name}"));
            layer["showlegend"] = json!(false);
            traces.push(layer);
        }
    };
    for (place, variable) in variables.iter().enumerate() {
        panel(place, place, diagonal(variable));
    }
    for region in regions {
        let (x, y) = (&variables[region.across], &variables[region.up]);
        panel(region.up, region.across, pair(x, y, region));
    }
    layout.insert("showlegend".to_owned(), json!(false));
    layout.insert("hovermode".to_owned(), json!("closest"));
    json!({"traces": traces, "layout": layout})
}

fn diagonal(variable: &CornerVariable) -> Vec<Value> {
    let top = variable.shares.iter().copied().fold(0.0, f64::max);
    let upright = |at: f64, ink: Ink, dash: &str| {
        json!({
            "type": "scatter", "mode": "lines", "x": [number(at), number(at)], "y": [0, number(top)], "hoverinfo": "x",
            "line": {"color": colour(ink), "width": 1.5, "dash": dash},
        })
    };
    let per_cent: Vec<f64> = variable.shares.iter().map(|share| 100.0 * share).collect();
    let hover = format!("{}: %{{x:.4f}}, %{{customdata:.1f}} %<extra></extra>", escaped(&variable.name));
    vec![
        json!({
            "type": "bar", "x": numbers(&variable.bin_centres), "y": numbers(&variable.shares),
            "customdata": numbers(&per_cent),
            "width": (variable.range.1 - variable.range.0) / variable.bin_centres.len() as f64,
            "marker": {"color": faded(Ink::Series(0), 0.55)}, "hovertemplate": hover,
        }),
        upright(variable.interval.0, Ink::Measured, "dash"),
        upright(variable.interval.1, Ink::Measured, "dash"),
        upright(variable.estimate, Ink::Series(1), "solid"),
    ]
}

fn pair(x: &CornerVariable, y: &CornerVariable, region: &DensityRegion) -> Vec<Value> {
    let z: Vec<Value> = region.enclosed.iter().map(|row| numbers(row)).collect();
    vec![
        json!({
            "type": "contour", "x": numbers(&x.bin_centres), "y": numbers(&y.bin_centres), "z": z, "showscale": false,
            "contours": {"start": 0.5, "end": 0.95, "size": 0.45, "coloring": "fill"}, "line": {"width": 1},
            "colorscale": [[0, tint(0.6)], [0.5, tint(0.25)], [1, tint(0.0)]],
            "hoverinfo": "x+y",
        }),
        json!({
            "type": "scatter", "mode": "markers", "x": [number(x.estimate)], "y": [number(y.estimate)],
            "marker": {"color": colour(Ink::Series(1)), "size": 7},
            "hovertemplate": "estimate: %{x:.4f}, %{y:.4f}<extra></extra>",
        }),
    ]
}

/// Colour of a region on white, opaque because regions overlap.
fn tint(opacity: f64) -> String {
    let (red, green, blue) = Ink::Series(0).rgb();
    let mix = |part: u8| (255.0 + (f64::from(part) - 255.0) * opacity).round() as u8;
    css((mix(red), mix(green), mix(blue)))
}
