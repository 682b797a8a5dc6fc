//! Clipping of shapes to the axes of a plot.

use super::shapes::Point;

/// The rectangle between the axes, pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Frame {
    /// How far a point is inside of each side; negative outside.
    fn depths(&self, (x, y): Point) -> [f64; 4] {
        [x - self.left, self.right - x, y - self.top, self.bottom - y]
    }

    pub(super) fn contains(&self, point: Point) -> bool {
        self.depths(point).iter().all(|depth| *depth >= 0.0)
    }

    /// The parts of a line inside the frame (Liang and Barsky, ACM Trans. Graphics 3, 1984).
    pub(super) fn lines(&self, line: &[Point]) -> Vec<Vec<Point>> {
        let mut parts: Vec<Vec<Point>> = Vec::new();
        for ends in line.windows(2) {
            let (from, to) = (self.depths(ends[0]), self.depths(ends[1]));
            let (mut first, mut last) = (0.0_f64, 1.0_f64);
            for (from, to) in from.into_iter().zip(to) {
                match (from < 0.0, to < 0.0) {
                    (true, true) => last = -1.0,
                    (true, false) => first = first.max(from / (from - to)),
                    (false, true) => last = last.min(from / (from - to)),
                    (false, false) => {}
                }
            }
            if first > last {
                continue;
            }
            let (start, end) = (between(ends[0], ends[1], first), between(ends[0], ends[1], last));
            match parts.last_mut() {
                Some(part) if part.last() == Some(&start) => part.push(end),
                _ => parts.push(vec![start, end]),
            }
        }
        parts
    }

    /// The part of an area inside the frame (Sutherland and Hodgman, Comm. ACM 17, 1974).
    pub(super) fn area(&self, outline: &[Point]) -> Vec<Point> {
        let mut points = outline.to_vec();
        for side in 0..4 {
            let corners = points.iter().zip(points.iter().cycle().skip(1));
            let mut kept = Vec::with_capacity(points.len());
            for (&from, &to) in corners {
                let (at_from, at_to) = (self.depths(from)[side], self.depths(to)[side]);
                if at_from >= 0.0 {
                    kept.push(from);
                }
                if (at_from < 0.0) != (at_to < 0.0) {
                    kept.push(between(from, to, at_from / (at_from - at_to)));
                }
            }
            points = kept;
        }
        points
    }
}

fn between(from: Point, to: Point, share: f64) -> Point {
    // The ends exactly, so that the parts of a line meet.
    match share {
        0.0 => from,
        1.0 => to,
        _ => (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, right: 10.0, top: 0.0, bottom: 10.0 };

    #[test]
    fn a_line_that_leaves_the_frame_and_returns_is_two_lines_that_end_at_it() {
        let line = [(2.0, 5.0), (4.0, 5.0), (4.0, -5.0), (8.0, -5.0), (8.0, 5.0)];
        let found = FRAME.lines(&line);
        assert_eq!(found, [vec![(2.0, 5.0), (4.0, 5.0), (4.0, 0.0)], vec![(8.0, 0.0), (8.0, 5.0)]]);
        assert_eq!(FRAME.lines(&[(-5.0, 4.0), (15.0, 8.0)]), [[(0.0, 5.0), (10.0, 7.0)]]);
        assert!(FRAME.lines(&[(-5.0, 4.0), (4.0, -8.0)]).is_empty(), "past a corner");
        assert_eq!(FRAME.lines(&line[..2]), [line[..2].to_vec()]);
    }

    #[test]
    fn an_area_is_cut_at_the_frame_and_one_outside_vanishes() {
        let found = FRAME.area(&[(-5.0, 2.0), (15.0, 2.0), (15.0, 4.0), (-5.0, 4.0)]);
        let area = |points: &[Point]| -> f64 {
            let next = points.iter().cycle().skip(1);
            0.5 * points.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>()
        };
        assert_eq!((area(&found), found.iter().all(|point| FRAME.contains(*point))), (20.0, true));
        assert!(FRAME.area(&[(-5.0, 2.0), (-1.0, 2.0), (-1.0, 4.0)]).is_empty());
        assert!(!FRAME.contains((10.5, 5.0)) && FRAME.contains((10.0, 0.0)));
    }
}
