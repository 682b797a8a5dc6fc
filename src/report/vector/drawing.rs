//! A figure as paths and circles, read from the SVG that this crate writes.
//!
//! The elements are those of plotters after `svg::compact`: one per line, `rect`, `line`, `path`, `circle` and `text`.
//! Texts become strokes of the Hershey Simplex alphabet, so that no output needs a font.

/// Glyphs: character, left and right edge, and strokes in units of a 21st of the height of capitals, with the baseline
/// at 9. Originally created by A. V. Hershey at the U.S. National Bureau of Standards, as distributed by James Hurt.
const GLYPHS: &str = include_str!("glyphs.txt");
const CAPITAL_HEIGHT: f64 = 21.0;
const BASELINE: f64 = 9.0;
/// Height of capitals, width of a blank, and width of strokes of normal and of bold text, as shares of the font size.
const CAPITAL_SHARE: f64 = 0.72;
const BLANK_SHARE: f64 = 0.3;
const STROKE_SHARES: [f64; 2] = [0.075, 0.12];
/// Size and height of a raised digit, as shares of the font size.
const RAISED: [f64; 2] = [0.6, 0.32];

/// Red, green, blue.
pub(super) type Colour = [u8; 3];

/// A point in units of the drawing.
pub(super) type Point = (f64, f64);

/// A figure.
pub(super) struct Drawing {
    /// Width and height in units, and in pixels as shown.
    pub size: Point,
    pub shown: Point,
    /// In the order of drawing.
    pub shapes: Vec<Shape>,
}

/// A path or a circle.
pub(super) struct Shape {
    pub outline: Outline,
    pub fill: Option<Colour>,
    /// Colour and width.
    pub stroke: Option<(Colour, f64)>,
    pub opacity: f64,
}

pub(super) enum Outline {
    Path { subpaths: Vec<Vec<Point>>, is_closed: bool },
    Circle { centre: Point, radius: f64 },
}

impl Drawing {
    /// Read a figure. Unknown elements are left out.
    pub(super) fn read(svg: &str) -> Self {
        let mut lines = svg.lines();
        let head = lines.next().unwrap_or_default();
        let view: Vec<f64> =
            attribute(head, "viewBox").unwrap_or_default().split(' ').filter_map(|text| text.parse().ok()).collect();
        let size = (view.get(2).copied().unwrap_or(1.0), view.get(3).copied().unwrap_or(1.0));
        let shown = (number(head, "width"), number(head, "height"));
        let mut shapes = Vec::new();
        while let Some(line) = lines.next() {
            if line.starts_with("<text ") {
                let words: Vec<&str> = lines.by_ref().take_while(|line| *line != "</text>").collect();
                shapes.push(text(line, &unescaped(&words.join(" "))));
                continue;
            }
            let Some(outline) = outline(line) else { continue };
            let stroke = colour(line, "stroke").map(|colour| (colour, number(line, "stroke-width")));
            let opacity = attribute(line, "opacity").and_then(|text| text.parse().ok()).unwrap_or(1.0);
            shapes.push(Shape { outline, fill: colour(line, "fill"), stroke, opacity });
        }
        Self { size, shown, shapes }
    }
}

fn outline(line: &str) -> Option<Outline> {
    let value = |name| number(line, name);
    if line.starts_with("<rect ") {
        let (x, y) = (value("x"), value("y"));
        let (right, bottom) = (x + value("width"), y + value("height"));
        let subpaths = vec![vec![(x, y), (right, y), (right, bottom), (x, bottom)]];
        return Some(Outline::Path { subpaths, is_closed: true });
    }
    if line.starts_with("<line ") {
        let subpaths = vec![vec![(value("x1"), value("y1")), (value("x2"), value("y2"))]];
        return Some(Outline::Path { subpaths, is_closed: false });
    }
    if line.starts_with("<circle ") {
        return Some(Outline::Circle { centre: (value("cx"), value("cy")), radius: value("r") });
    }
    let data = line.strip_prefix("<path ").and_then(|rest| attribute(rest, "d"))?;
    Some(Outline::Path { subpaths: subpaths(data), is_closed: data.ends_with('z') })
}

/// Relative moves and lines, as `svg::compact` writes them.
fn subpaths(data: &str) -> Vec<Vec<Point>> {
    let (mut x, mut y) = (0.0, 0.0);
    let mut points = |run: &str| -> Vec<Point> {
        let spaced = run.replace('-', " -");
        let numbers: Vec<f64> = spaced.split_whitespace().filter_map(|number| number.parse().ok()).collect();
        let each = numbers.chunks_exact(2).map(|step| {
            (x, y) = (x + step[0], y + step[1]);
            (x, y)
        });
        each.collect()
    };
    data.trim_end_matches('z').split('m').skip(1).map(&mut points).collect()
}

/// The value of an attribute.
fn attribute<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let key = format!("{name}=\"");
    let is_start = |at: &usize| *at == 0 || line[..*at].ends_with(' ');
    let (at, _) = line.match_indices(&key).find(|(at, _)| is_start(at))?;
    line[at + key.len()..].split('"').next()
}

fn number(line: &str, name: &str) -> f64 {
    attribute(line, name).and_then(|text| text.parse().ok()).unwrap_or(0.0)
}

fn colour(line: &str, name: &str) -> Option<Colour> {
    let text = attribute(line, name)?.strip_prefix('#')?;
    let part = |at: usize| u8::from_str_radix(text.get(at..at + 2)?, 16).ok();
    Some([part(0)?, part(2)?, part(4)?])
}

fn unescaped(text: &str) -> String {
    let entities = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    entities.iter().fold(text.to_owned(), |text, (entity, plain)| text.replace(entity, plain))
}

/// The strokes of a text.
fn text(line: &str, words: &str) -> Shape {
    let size = number(line, "font-size");
    let em = |share: f64| share * size;
    let (x, y) = (number(line, "x"), number(line, "y"));
    // An ex is taken as half an em.
    let shift = attribute(line, "dy").map_or(0.0, |dy| {
        let amount = |unit| dy.strip_suffix(unit).and_then(|number| number.parse::<f64>().ok());
        amount("em").or(amount("ex").map(|ex| 0.5 * ex)).map_or(0.0, em)
    });
    let mut strokes: Vec<Vec<Point>> = Vec::new();
    let mut advance = 0.0;
    for letter in words.chars() {
        let (plain, [share, raised]) = match letter {
            '¹' => ('1', RAISED),
            '²' => ('2', RAISED),
            '³' => ('3', RAISED),
            '−' | '–' | '—' => ('-', [1.0, 0.0]),
            other => (other, [1.0, 0.0]),
        };
        let Some((left, right, glyph)) = glyph(plain) else {
            advance += em(BLANK_SHARE);
            continue;
        };
        let unit = em(CAPITAL_SHARE) * share / CAPITAL_HEIGHT;
        let place = |(across, down): Point| (advance + (across - left) * unit, (down - BASELINE) * unit - em(raised));
        strokes.extend(glyph.into_iter().map(|stroke| stroke.into_iter().map(place).collect::<Vec<Point>>()));
        advance += (right - left) * unit;
    }
    let start = match attribute(line, "text-anchor") {
        Some("middle") => -0.5 * advance,
        Some("end") => -advance,
        _ => 0.0,
    };
    // `rotate(angle, x, y)` about the place of the text.
    let angle =
        attribute(line, "transform").and_then(|text| text.strip_prefix("rotate(")?.split(',').next()?.parse().ok());
    let (sine, cosine) = angle.map_or((0.0, 1.0), |degrees: f64| degrees.to_radians().sin_cos());
    let placed = |(across, down): Point| {
        let (across, down) = (across + start, down + shift);
        (x + across * cosine - down * sine, y + across * sine + down * cosine)
    };
    let subpaths = strokes.into_iter().map(|stroke| stroke.into_iter().map(placed).collect()).collect();
    let is_bold = attribute(line, "font-weight") == Some("bold");
    let ink = colour(line, "fill").unwrap_or([0; 3]);
    Shape {
        outline: Outline::Path { subpaths, is_closed: false },
        fill: None,
        stroke: Some((ink, em(STROKE_SHARES[usize::from(is_bold)]))),
        opacity: 1.0,
    }
}

/// Left and right edge and the strokes of a character; a question mark for an unknown one, `None` for a blank.
fn glyph(letter: char) -> Option<(f64, f64, Vec<Vec<Point>>)> {
    if letter.is_whitespace() {
        return None;
    }
    let find = |letter: char| GLYPHS.lines().find_map(|line| line.strip_prefix(letter)?.strip_prefix(' '));
    let mut parts = find(letter).or_else(|| find('?'))?.splitn(3, ' ');
    let (left, right) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let point = |text: &str| {
        let (x, y) = text.split_once(',')?;
        Some((x.parse().ok()?, y.parse().ok()?))
    };
    let strokes = parts.next()?.split('|').map(|stroke| stroke.split(' ').filter_map(point).collect()).collect();
    Some((left, right, strokes))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg width=\"900\" height=\"520\" viewBox=\"0 0 3600 2080\" xmlns=\"x\">\n\
        <rect x=\"1\" y=\"2\" width=\"3\" height=\"4\" opacity=\"0.2\" fill=\"#0072B2\" stroke=\"none\"/>\n\
        <path fill=\"none\" stroke=\"#010203\" stroke-width=\"8\" d=\"m10 20 5-3m2 2 1 1z\"/>\n\
        <text x=\"100\" y=\"200\" dy=\"0.76em\" text-anchor=\"middle\" font-size=\"50\" fill=\"#222222\">\na &lt; b²\n\
        </text>\n</svg>\n";

    #[test]
    fn shapes_have_the_places_and_colours_of_their_elements() {
        let drawing = Drawing::read(SVG);
        assert_eq!((drawing.size, drawing.shown, drawing.shapes.len()), ((3600.0, 2080.0), (900.0, 520.0), 3));
        let [rect, path, text] = &drawing.shapes[..] else { panic!("three shapes") };
        assert_eq!((rect.fill, rect.stroke, rect.opacity), (Some([0, 0x72, 0xB2]), None, 0.2));
        assert_eq!(path.stroke, Some(([1, 2, 3], 8.0)));
        let Outline::Path { subpaths, is_closed: true } = &path.outline else { panic!("a closed path") };
        assert_eq!(*subpaths, [vec![(10.0, 20.0), (15.0, 17.0)], vec![(17.0, 19.0), (18.0, 20.0)]]);
        let Outline::Path { subpaths, .. } = &text.outline else { panic!("strokes") };
        let x: Vec<f64> = subpaths.iter().flatten().map(|point| point.0).collect();
        let (low, high) = (x.iter().copied().fold(f64::MAX, f64::min), x.iter().copied().fold(f64::MIN, f64::max));
        assert!(((low + high) / 2.0 - 100.0).abs() < 5.0 && high - low > 60.0, "text from {low} to {high}");
        assert!(subpaths.iter().flatten().all(|point| (195.0..245.0).contains(&point.1)));
    }

    #[test]
    fn every_letter_has_strokes_and_an_unknown_one_is_a_question_mark() {
        for letter in ('!'..='~').chain("αβγδεζηθικλμνξοπρστυφχψω±°×·".chars()) {
            let (left, right, strokes) = glyph(letter).expect("a glyph");
            assert!(right > left && strokes.iter().flatten().count() > 1, "{letter}");
            assert!(letter == '?' || strokes != glyph('?').expect("a glyph").2, "{letter} is unknown");
        }
        assert_eq!(glyph('漢'), glyph('?'));
        assert_eq!(glyph(' '), None);
    }
}
