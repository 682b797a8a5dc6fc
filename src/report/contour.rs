//! Contour lines of a function on a structured grid (marching triangles).

use std::collections::{HashMap, VecDeque};

/// A segment of a contour line: its two end points.
type Segment = [(f64, f64); 2];

/// The points of a contour line; a closed line ends at its first point.
pub(super) type Line = Vec<(f64, f64)>;

/// Contour lines of a positive function for every level, `values[j][i]` at `x[j][i]`, `y[j][i]`. The logarithm is
/// interpolated linearly. Values far below the lowest level are raised, as they would distort the lines around them.
pub(super) fn log_contours(x: &[Vec<f64>], y: &[Vec<f64>], values: &[Vec<f64>], levels: &[f64]) -> Vec<Vec<Line>> {
    let lowest = match levels {
        [first, second, ..] => first * first / second,
        _ => 0.0,
    };
    let logarithm = |value: &f64| if value.is_nan() { f64::NAN } else { value.max(lowest).log10() };
    let logarithms: Vec<Vec<f64>> = values.iter().map(|row| row.iter().map(logarithm).collect()).collect();
    levels.iter().map(|level| contour_lines(x, y, &logarithms, level.log10())).collect()
}

/// Contour lines of one level, `values[j][i]` at `x[j][i]`, `y[j][i]`, interpolated linearly.
pub(super) fn contour_lines(x: &[Vec<f64>], y: &[Vec<f64>], values: &[Vec<f64>], level: f64) -> Vec<Line> {
    join_segments(&segments(x, y, values, level))
}

/// Join segments into lines. End points match if they are equal to the last bit.
fn join_segments(pieces: &[Segment]) -> Vec<Line> {
    let key = |(x, y): (f64, f64)| (x.to_bits(), y.to_bits());
    let mut meeting: HashMap<(u64, u64), Vec<usize>> = HashMap::new();
    for (index, piece) in pieces.iter().enumerate() {
        for end in piece {
            meeting.entry(key(*end)).or_default().push(index);
        }
    }
    // A level through a grid point gives segments of zero length there.
    let mut free: Vec<bool> = pieces.iter().map(|[from, to]| from != to).collect();
    let mut lines = Vec::new();
    for first in 0..pieces.len() {
        if !free[first] {
            continue;
        }
        free[first] = false;
        let [mut front, mut back] = pieces[first];
        let mut line = VecDeque::from([front, back]);
        while let Some(next) = meeting[&key(back)].iter().copied().find(|index| free[*index]) {
            free[next] = false;
            back = other_end(pieces[next], back);
            line.push_back(back);
        }
        while let Some(next) = meeting[&key(front)].iter().copied().find(|index| free[*index]) {
            free[next] = false;
            front = other_end(pieces[next], front);
            line.push_front(front);
        }
        lines.push(line.into());
    }
    lines
}

fn other_end([from, to]: Segment, end: (f64, f64)) -> (f64, f64) {
    if from == end { to } else { from }
}

/// The segments of one level, `values[j][i]` at `x[j][i]`, `y[j][i]`.
///
/// Each quadrilateral is split into two triangles, in which a linear interpolant has exactly one segment, so that no
/// saddle is ambiguous. Triangles with a corner that is NaN are skipped.
fn segments(x: &[Vec<f64>], y: &[Vec<f64>], values: &[Vec<f64>], level: f64) -> Vec<Segment> {
    let corner = |i: usize, j: usize| (x[j][i], y[j][i], values[j][i]);
    let mut found = Vec::new();
    for (j, row) in values.iter().enumerate().skip(1) {
        for i in 1..row.len() {
            let (a, b, c, d) = (corner(i - 1, j - 1), corner(i, j - 1), corner(i, j), corner(i - 1, j));
            found.extend(segment_in_triangle([a, b, c], level));
            found.extend(segment_in_triangle([a, c, d], level));
        }
    }
    found
}

/// The segment of a level in a triangle.
fn segment_in_triangle(corners: [(f64, f64, f64); 3], level: f64) -> Option<Segment> {
    let mut ends = Vec::with_capacity(2);
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        // From the lower to the higher corner, so that two triangles get bit-identical points on their common side.
        let (low, high) = if corners[from].2 < corners[to].2 { (from, to) } else { (to, from) };
        let ((x0, y0, v0), (x1, y1, v1)) = (corners[low], corners[high]);
        // Half-open, so that a level through a corner is counted once.
        if (v0 < level) != (v1 < level) && v0.is_finite() && v1.is_finite() {
            let t = (level - v0) / (v1 - v0);
            // At t = 1 this is exactly the corner.
            ends.push(((1.0 - t) * x0 + t * x1, (1.0 - t) * y0 + t * y1));
        }
    }
    match ends.as_slice() {
        [from, to] => Some([*from, *to]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cone on a sheared grid, as that of a landscape which follows a valley.
    fn cone(side: usize) -> [Vec<Vec<f64>>; 3] {
        let at = |n: usize| -1.0 + 2.0 * n as f64 / (side - 1) as f64;
        let each = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            (0..side).map(|j| (0..side).map(|i| of(i, j)).collect()).collect()
        };
        let x = |i: usize, j: usize| at(i) + 0.2 * at(j);
        [each(&x), each(&|_, j| at(j)), each(&|i, j| x(i, j).hypot(at(j)))]
    }

    #[test]
    fn the_level_lines_of_a_cone_are_circles() {
        let [x, y, values] = cone(41);
        let found = segments(&x, &y, &values, 0.6);
        let length: f64 = found.iter().map(|[a, b]| (a.0 - b.0).hypot(a.1 - b.1)).sum();
        assert!((length - 1.2 * std::f64::consts::PI).abs() < 0.02, "circumference {length}");
        assert!(found.iter().flatten().all(|(x, y)| (x.hypot(*y) - 0.6).abs() < 2e-3));
    }

    #[test]
    fn a_circle_is_one_closed_line_and_a_gap_opens_it() {
        let [x, y, mut values] = cone(41);
        let closed = contour_lines(&x, &y, &values, 0.6);
        assert_eq!(closed.len(), 1, "{} lines", closed.len());
        assert_eq!(closed[0].first(), closed[0].last());
        let length: f64 = closed[0].windows(2).map(|ends| (ends[0].0 - ends[1].0).hypot(ends[0].1 - ends[1].1)).sum();
        assert!((length - 1.2 * std::f64::consts::PI).abs() < 0.02, "circumference {length}");
        values[20][32] = f64::NAN;
        let open = contour_lines(&x, &y, &values, 0.6);
        assert!(open.len() == 1 && open[0].first() != open[0].last(), "{} lines", open.len());
    }

    #[test]
    fn a_failed_member_leaves_a_gap_in_a_line_only() {
        let [x, y, mut values] = cone(41);
        let whole = segments(&x, &y, &values, 0.6).len();
        values[20][32] = f64::NAN;
        let holed = segments(&x, &y, &values, 0.6);
        assert!(holed.len() < whole && holed.len() + 8 > whole);
        assert!(holed.iter().flatten().all(|(x, y)| x.is_finite() && y.is_finite()));
    }

    #[test]
    fn a_value_of_zero_does_not_distort_the_lines_around_it() {
        let [x, y, mut values] = cone(41);
        values[20][20] = 0.0;
        let found = log_contours(&x, &y, &values, &[0.2, 0.4, 0.8]);
        for (level, lines) in [0.2, 0.4, 0.8].iter().zip(&found) {
            let steps = lines.iter().flat_map(|line| line.windows(2));
            let length: f64 = steps.map(|ends| (ends[0].0 - ends[1].0).hypot(ends[0].1 - ends[1].1)).sum();
            assert!((length / (2.0 * std::f64::consts::PI * level) - 1.0).abs() < 0.02, "{length} at {level}");
        }
    }
}
