//! Plot of the diagram.

use std::fmt::Write;

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/integrators.svg");
/// Ranges of the axes, and their ticks.
const SECONDS: std::ops::Range<f64> = 0.3..50.0;
const ERRORS_K: std::ops::Range<f64> = 0.005..1.0;
const TICKS: [f64; 8] = [0.01, 0.05, 0.1, 0.5, 1.0, 5.0, 10.0, 50.0];
/// The target of the error, at which a line is drawn.
const TARGET_K: f64 = 0.05;
/// Sides of the plot of a panel, pixels; a panel is 600 wide.
const LEFT: f64 = 70.0;
const RIGHT: f64 = 588.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 467.0;
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#332288"];

/// Time (s) and error (K) of a candidate's Pareto front, from the fastest on.
pub(crate) struct Curve {
    pub title: String,
    pub points: Vec<(f64, f64)>,
}

/// Draw panels of error against time, both on logarithmic axes.
pub(crate) fn draw(panels: [(&str, &[Curve]); 2]) {
    let mut out = "<svg width=\"1200\" height=\"520\" viewBox=\"0 0 1200 520\" xmlns=\"http://www.w3.org/2000/svg\" \
                   font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"1200\" height=\"520\" fill=\"#fff\"/>\n"
        .to_owned();
    for (place, (title, curves)) in panels.into_iter().enumerate() {
        let _ = writeln!(out, "<g transform=\"translate({} 0)\">\n{}</g>", 600 * place, panel(title, curves));
    }
    std::fs::write(PATH, out + "</svg>\n").unwrap_or_else(|error| panic!("{PATH}: {error}"));
}

fn panel(title: &str, curves: &[Curve]) -> String {
    let share = |value: f64, range: &std::ops::Range<f64>| (value / range.start).ln() / (range.end / range.start).ln();
    let x = |seconds: f64| LEFT + share(seconds, &SECONDS) * (RIGHT - LEFT);
    let y = |error_k: f64| BOTTOM - share(error_k, &ERRORS_K) * (BOTTOM - TOP);
    let mut out = format!(
        "<text x=\"300\" y=\"22\" text-anchor=\"middle\" font-size=\"15\">{title}</text>\n\
         <text x=\"{}\" y=\"505\" text-anchor=\"middle\">5,000 members on one thread, s</text>\n\
         <text transform=\"translate(18 250) rotate(-90)\" text-anchor=\"middle\">largest error at any sensor and \
         instant, K</text>\n<path fill=\"none\" stroke=\"#999\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>\n",
        (LEFT + RIGHT) / 2.0
    );
    for tick in TICKS.into_iter().filter(|tick| SECONDS.contains(tick) || *tick == SECONDS.end) {
        let at = x(tick);
        let _ = writeln!(out, "<path stroke=\"#ddd\" d=\"M{at:.1} {TOP}V{BOTTOM}\"/>");
        let _ = writeln!(out, "<text x=\"{at:.1}\" y=\"484\" text-anchor=\"middle\">{tick}</text>");
    }
    for tick in TICKS.into_iter().filter(|tick| ERRORS_K.contains(tick) || *tick == ERRORS_K.end) {
        let at = y(tick);
        let dash = if tick == TARGET_K { "stroke=\"#000\" stroke-dasharray=\"4 4\"" } else { "stroke=\"#ddd\"" };
        let _ = writeln!(out, "<path {dash} d=\"M{LEFT} {at:.1}H{RIGHT}\"/>");
        let _ = writeln!(out, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>", LEFT - 6.0, at + 4.0);
    }
    for (place, curve) in curves.iter().enumerate().filter(|(_, curve)| !curve.points.is_empty()) {
        let colour = COLOURS[place % COLOURS.len()];
        let shown = curve.points.iter().filter(|(s, k)| SECONDS.contains(s) && ERRORS_K.contains(k));
        let points: Vec<String> = shown.map(|(s, k)| format!("{:.1} {:.1}", x(*s), y(*k))).collect();
        let _ =
            writeln!(out, "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" d=\"M{}\"/>", points.join("L"));
        let discs: String = points.iter().map(|point| format!("M{point}h0")).collect();
        let _ = writeln!(out, "<path stroke=\"{colour}\" stroke-width=\"6\" stroke-linecap=\"round\" d=\"{discs}\"/>");
        let row = TOP + 14.0 + 16.0 * place as f64;
        let _ = writeln!(out, "<path stroke=\"{colour}\" stroke-width=\"2\" d=\"M430 {row}h18\"/>");
        let _ = writeln!(out, "<text x=\"454\" y=\"{}\">{}</text>", row + 4.0, curve.title);
    }
    out
}
