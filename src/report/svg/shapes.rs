//! Shapes at positions in pixels, and their SVG text.
//!
//! The text has integers, in units of a quarter of a pixel, and relative moves: it is as short as that of a page with
//! fifty figures should be.

use crate::report::figure::Colour;
use crate::report::html::table::escaped;

/// Units per pixel.
const UNITS: f64 = 4.0;
/// Half the height of capitals, as a share of the font size.
const HALF_CAPITAL: f64 = 0.36;
/// Largest position, units; a point further away is drawn there.
const FARTHEST: f64 = 1e6;

/// Pixels to the right of the left side, and below the top.
pub(super) type Point = (f64, f64);

/// A shape; lengths are in pixels.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Lines through points; where lines of one shape cross, a translucent colour is not darker.
    Lines {
        lines: Vec<Vec<Point>>,
        colour: Colour,
        width: f64,
        dash: Option<(f64, f64)>,
        opacity: f64,
    },
    /// Closed areas.
    Areas {
        outlines: Vec<Vec<Point>>,
        colour: Colour,
        opacity: f64,
    },
    /// Discs.
    Discs {
        centres: Vec<Point>,
        radius: f64,
        colour: Colour,
    },
    Text(Text),
}

/// One line of text.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub text: String,
    /// Halfway up its capitals.
    pub at: Point,
    pub size: f64,
    pub anchor: Anchor,
    pub colour: Colour,
    pub is_bold: bool,
    /// Degrees, clockwise.
    pub rotation: f64,
}

/// The part of a text that is at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Shape {
    /// A rectangle between opposite corners.
    pub(super) fn rectangle(from: Point, to: Point, colour: Colour, opacity: f64) -> Self {
        Self::Areas { outlines: vec![vec![from, (to.0, from.1), to, (from.0, to.1)]], colour, opacity }
    }

    /// Solid lines.
    pub(super) fn lines(lines: Vec<Vec<Point>>, colour: Colour, width: f64) -> Self {
        Self::Lines { lines, colour, width, dash: None, opacity: 1.0 }
    }

    /// The SVG element of the shape, on one line; empty for a shape without points.
    fn written(&self) -> String {
        let (style, data) = match self {
            Self::Text(text) => return text.written(),
            Self::Lines { lines, colour, width, dash, opacity } => {
                let dash = dash.map_or(String::new(), |(dash, gap)| {
                    format!(" stroke-dasharray=\"{} {}\"", units(dash), units(gap))
                });
                let (colour, width, opacity) = (hex(*colour), units(*width), transparency(*opacity));
                (format!("stroke=\"{colour}\" stroke-width=\"{width}\"{dash}{opacity}"), path(lines, ""))
            }
            Self::Areas { outlines, colour, opacity } => {
                (format!("fill=\"{}\"{}", hex(*colour), transparency(*opacity)), path(outlines, "z"))
            }
            Self::Discs { centres, radius, colour } => {
                // Lines of no length with round ends.
                let points: Vec<Vec<Point>> = centres.iter().map(|centre| vec![*centre]).collect();
                let (colour, width) = (hex(*colour), units(2.0 * radius));
                let style = format!("stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"");
                (style, path(&points, "h0"))
            }
        };
        if data.is_empty() { data } else { format!("<path {style} d=\"{data}\"/>\n") }
    }
}

impl Text {
    fn written(&self) -> String {
        let anchor = match self.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let weight = if self.is_bold { " font-weight=\"bold\"" } else { "" };
        let (x, y) = (units(self.at.0), units(self.at.1));
        let baseline = units(HALF_CAPITAL * self.size);
        let place = match self.rotation {
            0.0 => format!("x=\"{x}\" y=\"{}\"", y + baseline),
            angle => format!("y=\"{baseline}\" transform=\"translate({x} {y}) rotate({angle})\""),
        };
        let (colour, size, text) = (hex(self.colour), units(self.size), escaped(&self.text));
        format!("<text {place}{anchor} font-size=\"{size}\"{weight} fill=\"{colour}\">{text}</text>\n")
    }
}

/// The SVG document of shapes, the first at the bottom, on white.
pub(super) fn document((width, height): Point, shapes: &[Shape]) -> String {
    let mut out = format!(
        "<svg width=\"{width}\" height=\"{height}\" role=\"img\" viewBox=\"0 0 {} {}\" \
         xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" fill=\"none\">\n",
        units(width),
        units(height)
    );
    out += &Shape::rectangle((0.0, 0.0), (width, height), (255, 255, 255), 1.0).written();
    out.extend(shapes.iter().map(Shape::written));
    out + "</svg>\n"
}

/// Lines with relative coordinates, each with an `end`. Points in one place are one point, and points that are not
/// finite are left out.
fn path(lines: &[Vec<Point>], end: &str) -> String {
    let mut data = String::new();
    let (mut x, mut y) = (0, 0);
    for line in lines {
        let finite = line.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let mut points: Vec<(i64, i64)> = finite.map(|point| (units(point.0), units(point.1))).collect();
        points.dedup();
        let gap = |number: i64| if number < 0 { "" } else { " " };
        for (place, (to_x, to_y)) in points.iter().enumerate() {
            let (right, down) = (to_x - x, to_y - y);
            // Coordinates after the first pair of a move are lines.
            let before = if place == 0 { "m" } else { gap(right) };
            data += &format!("{before}{right}{}{down}", gap(down));
            (x, y) = (*to_x, *to_y);
        }
        let Some(first) = points.first() else { continue };
        data += end;
        if end == "z" {
            // The next move starts where the closed outline does.
            (x, y) = *first;
        }
    }
    data
}

fn units(length: f64) -> i64 {
    (UNITS * length).round().clamp(-FARTHEST, FARTHEST) as i64
}

fn hex((red, green, blue): Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn transparency(opacity: f64) -> String {
    if opacity < 1.0 { format!(" opacity=\"{opacity}\"") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLUE: Colour = (0, 0x72, 0xB2);

    #[test]
    fn lines_move_and_then_step_and_a_point_that_repeats_or_is_not_finite_is_left_out() {
        let lines =
            vec![vec![(2.0, 3.0), (2.5, 2.25), (2.5, 2.3), (f64::NAN, 1.0), (2.0, 2.0)], vec![(0.0, 0.0), (1.0, 0.0)]];
        let text = Shape::lines(lines.clone(), BLUE, 1.5).written();
        assert_eq!(text, "<path stroke=\"#0072b2\" stroke-width=\"6\" d=\"m8 12 2-3-2-1m-8-8 4 0\"/>\n");
        let dashed = Shape::Lines { lines, colour: BLUE, width: 1.0, dash: Some((8.0, 5.0)), opacity: 0.6 };
        assert!(dashed.written().contains(" stroke-dasharray=\"32 20\" opacity=\"0.6\" "), "{}", dashed.written());
        assert_eq!(Shape::lines(Vec::new(), BLUE, 1.0).written(), "");
    }

    #[test]
    fn an_area_after_another_one_is_where_its_points_are() {
        let square = |x: f64| vec![(x, 1.0), (x + 1.0, 1.0), (x + 1.0, 2.0)];
        let areas = Shape::Areas { outlines: vec![square(1.0), square(3.0)], colour: BLUE, opacity: 1.0 };
        assert_eq!(areas.written(), "<path fill=\"#0072b2\" d=\"m4 4 4 0 0 4zm8 0 4 0 0 4z\"/>\n");
    }

    #[test]
    fn every_disc_is_a_point_with_round_ends() {
        let discs = Shape::Discs { centres: vec![(1.0, 1.0), (2.0, 1.0)], radius: 2.5, colour: BLUE };
        let expected = "<path stroke=\"#0072b2\" stroke-width=\"20\" stroke-linecap=\"round\" d=\"m4 4h0m4 0h0\"/>\n";
        assert_eq!(discs.written(), expected);
    }

    #[test]
    fn an_area_is_closed_and_a_far_point_stays_within_the_numbers_of_a_viewer() {
        let area = Shape::rectangle((0.0, 0.0), (f64::MAX, 1.0), BLUE, 0.2);
        assert_eq!(area.written(), "<path fill=\"#0072b2\" opacity=\"0.2\" d=\"m0 0 1000000 0 0 4-1000000 0z\"/>\n");
    }
}
