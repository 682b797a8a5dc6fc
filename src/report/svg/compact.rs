//! Compression of SVG text: plotters writes a polyline for every dash, with absolute coordinates.

/// Convert lines and polygons to paths with relative coordinates, and join successive lines of one style.
///
/// Input is the output of plotters: one element per line, text escaped and on its own line.
pub(super) fn compress(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut open: Option<Path> = None;
    for line in svg.lines() {
        match Path::read(line) {
            Some(path) => match &mut open {
                Some(before) if before.continues(&path) => before.subpaths.extend(path.subpaths),
                _ => {
                    out.extend(open.replace(path).map(|path| path.written()));
                }
            },
            None => {
                out.extend(open.take().map(|path| path.written()));
                // Opaque is the default.
                let line = if line.starts_with('<') { line.replace(OPAQUE_ATTRIBUTE, "") } else { line.to_owned() };
                out.push_str(&line);
                out.push('\n');
            }
        }
    }
    out.extend(open.map(|path| path.written()));
    out
}

const OPAQUE_ATTRIBUTE: &str = " opacity=\"1\"";

struct Path<'a> {
    /// All attributes except the points.
    style: &'a str,
    is_closed: bool,
    subpaths: Vec<Vec<(i32, i32)>>,
}

impl<'a> Path<'a> {
    /// Parse a line of text that is one polyline or polygon.
    fn read(line: &'a str) -> Option<Self> {
        let (rest, is_closed) = match line.strip_prefix("<polyline ") {
            Some(rest) => (rest, false),
            None => (line.strip_prefix("<polygon ")?, true),
        };
        let (style, points) = rest.strip_suffix("\"/>")?.split_once(" points=\"")?;
        let point = |text: &str| {
            let (x, y) = text.split_once(',')?;
            Some((x.parse().ok()?, y.parse().ok()?))
        };
        let run: Vec<(i32, i32)> = points.split_whitespace().map(point).collect::<Option<_>>()?;
        (!run.is_empty()).then(|| Self { style, is_closed, subpaths: vec![run] })
    }

    /// Whether two paths can be joined without visible change: translucent lines would be darker where they cross.
    fn continues(&self, next: &Self) -> bool {
        !self.is_closed
            && !next.is_closed
            && self.style == next.style
            && self.style.contains(OPAQUE_ATTRIBUTE.trim_start())
    }

    fn written(&self) -> String {
        let mut data = String::new();
        let (mut x, mut y) = (0, 0);
        for run in &self.subpaths {
            // Coordinates after the first pair of a move command are lines.
            data.push('m');
            for (place, (to_x, to_y)) in run.iter().enumerate() {
                let (right, down) = (to_x - x, to_y - y);
                let gap = |number: i32| if number < 0 { "" } else { " " };
                let before = if place == 0 { "" } else { gap(right) };
                data.push_str(&format!("{before}{right}{}{down}", gap(down)));
                (x, y) = (*to_x, *to_y);
            }
        }
        if self.is_closed {
            data.push('z');
        }
        format!("<path {} d=\"{data}\"/>\n", self.style).replacen(OPAQUE_ATTRIBUTE, "", 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Absolute points of each subpath.
    fn points(data: &str) -> Vec<Vec<(i32, i32)>> {
        let (mut x, mut y) = (0, 0);
        let runs = data.trim_end_matches('z').split('m').skip(1);
        let mut read = |run: &str| -> Vec<(i32, i32)> {
            let spaced = run.replace('-', " -");
            let numbers: Vec<i32> = spaced.split_whitespace().map(|number| number.parse().expect("a number")).collect();
            let pairs = numbers.chunks(2).map(|pair| {
                (x, y) = (x + pair[0], y + pair[1]);
                (x, y)
            });
            pairs.collect()
        };
        runs.map(&mut read).collect()
    }

    #[test]
    fn a_path_has_the_points_and_the_style_of_its_lines() {
        let style = "fill=\"none\" opacity=\"1\" stroke=\"#00829B\" stroke-width=\"6\"";
        let lines = "<polyline STYLE points=\"11,12 13,9 13,9 \"/>\n\
                     <polyline STYLE points=\"-3,5 20,25 \"/>\n\
                     <polygon opacity=\"0.2\" fill=\"#00829B\" points=\"1,2 3,4 0,7 \"/>\n";
        let short = compress(&lines.replace("STYLE", style));
        let paths: Vec<&str> = short.lines().collect();
        assert_eq!(paths.len(), 2, "{short}");
        assert!(paths[0].starts_with("<path fill=\"none\" stroke=\"#00829B\" stroke-width=\"6\" d=\""), "{short}");
        assert!(
            paths[1].starts_with("<path opacity=\"0.2\" fill=\"#00829B\" d=\"") && paths[1].ends_with("z\"/>"),
            "{short}"
        );
        let data = |path: &str| path.split_once("d=\"").map_or(String::new(), |(_, data)| data.replace("\"/>", ""));
        assert_eq!(points(&data(paths[0])), [vec![(11, 12), (13, 9), (13, 9)], vec![(-3, 5), (20, 25)]]);
        assert_eq!(points(&data(paths[1])), [vec![(1, 2), (3, 4), (0, 7)]]);
    }

    #[test]
    fn lines_of_different_style_translucent_or_separated_are_not_joined() {
        let line = |style: &str| format!("<polyline fill=\"none\" {style} points=\"1,2 3,4 \"/>\n");
        let (black, white) = ("opacity=\"1\" stroke=\"#000000\"", "opacity=\"1\" stroke=\"#FFFFFF\"");
        let faint = "opacity=\"0.6\" stroke=\"#000000\"";
        for (first, second, paths) in [(black, black, 1), (black, white, 2), (faint, faint, 2)] {
            let short = compress(&(line(first) + &line(second)));
            assert_eq!(short.matches("<path").count(), paths, "{short}");
        }
        let short = compress(&(line(black) + "<circle r=\"1\"/>\n" + &line(black)));
        assert_eq!(short.matches("<path").count(), 2, "{short}");
    }

    #[test]
    fn texts_and_other_elements_are_unchanged() {
        let text = "<text x=\"1\" y=\"2\" fill=\"#222222\">\nopacity=\"1\" points=\"1,2\"\n</text>\n";
        assert_eq!(compress(text), text);
    }
}
