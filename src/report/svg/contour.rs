//! Lines of equal value over a grid.

/// A straight piece of a line of equal value: its two ends.
pub(super) type Piece = [(f64, f64); 2];

/// The pieces on which `values` takes the level, where `values[j][i]` stands at `x[i]`, `y[j]`.
///
/// Each rectangle is cut into two triangles, in which a plane through the corners has exactly one straight
/// line of a level: no saddle needs a decision. Triangles with a corner that is no number are left out.
pub(super) fn pieces(x: &[f64], y: &[f64], values: &[Vec<f64>], level: f64) -> Vec<Piece> {
    let corner = |i: usize, j: usize| (x[i], y[j], values[j][i]);
    let mut found = Vec::new();
    for j in 1..y.len() {
        for i in 1..x.len() {
            let (a, b, c, d) = (corner(i - 1, j - 1), corner(i, j - 1), corner(i, j), corner(i - 1, j));
            found.extend(across([a, b, c], level));
            found.extend(across([a, c, d], level));
        }
    }
    found
}

/// Where a level crosses a triangle.
fn across(corners: [(f64, f64, f64); 3], level: f64) -> Option<Piece> {
    let mut ends = Vec::with_capacity(2);
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        let ((x0, y0, v0), (x1, y1, v1)) = (corners[from], corners[to]);
        // Half-open, so that a level through a corner is met once.
        if (v0 < level) != (v1 < level) && v0.is_finite() && v1.is_finite() {
            let t = (level - v0) / (v1 - v0);
            ends.push((x0 + t * (x1 - x0), y0 + t * (y1 - y0)));
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

    fn cone(side: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let axis: Vec<f64> = (0..side).map(|n| -1.0 + 2.0 * n as f64 / (side - 1) as f64).collect();
        let values = axis.iter().map(|y| axis.iter().map(|x: &f64| x.hypot(*y)).collect()).collect();
        (axis, values)
    }

    #[test]
    fn the_level_lines_of_a_cone_are_circles() {
        let (axis, values) = cone(41);
        let found = pieces(&axis, &axis, &values, 0.6);
        let length: f64 = found.iter().map(|[a, b]| (a.0 - b.0).hypot(a.1 - b.1)).sum();
        assert!((length - 1.2 * std::f64::consts::PI).abs() < 0.02, "circumference {length}");
        assert!(found.iter().flatten().all(|(x, y)| (x.hypot(*y) - 0.6).abs() < 2e-3));
    }

    #[test]
    fn a_failed_member_leaves_a_gap_in_a_line_and_nothing_else() {
        let (axis, mut values) = cone(41);
        let whole = pieces(&axis, &axis, &values, 0.6).len();
        values[20][32] = f64::NAN;
        let holed = pieces(&axis, &axis, &values, 0.6);
        assert!(holed.len() < whole && holed.len() + 8 > whole);
        assert!(holed.iter().flatten().all(|(x, y)| x.is_finite() && y.is_finite()));
    }
}
