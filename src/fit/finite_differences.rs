//! Finite-difference derivatives with all stencil points between the bounds.

use super::{DifferenceScheme, LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector, DVectorView};

/// Residuals and Jacobian at a point from one stencil in one batch: central differences with two points per variable
/// (the paper's Eqs 6 and 14), and one-sided three-point differences where a bound leaves no room on the other side.
/// Both are of second order in the step.
///
/// `step` is relative to the variable, or absolute where the variable is zero. Where one of the two points cannot be
/// computed, the other gives a first-order difference; where neither can, the column is NaN. A variable without room on
/// either side has a column of zeros.
///
/// # Errors
/// Errors of the problem.
pub fn finite_difference_tangent<P: LeastSquares>(
    problem: &mut P,
    point: &DVector<f64>,
    step: f64,
) -> Result<Tangent, P::Error> {
    let stencil = Stencil::new(point, &variable_sizes(point), problem.bounds(), step, DifferenceScheme::Central);
    let mut points = stencil.points().insert_column(0, 0.0);
    points.set_column(0, point);
    let computed = problem.residuals(&points)?;
    let residuals = computed.column(0).into_owned();
    Ok(stencil.tangent(residuals, &computed.columns(1, computed.ncols() - 1).into_owned()))
}

/// Sizes of variables at a start: the absolute value, or one for zero.
pub(super) fn variable_sizes(point: &DVector<f64>) -> DVector<f64> {
    point.map(|value| if value == 0.0 { 1.0 } else { value.abs() })
}

/// Stencil of finite differences about a point.
pub(super) struct Stencil {
    point: DVector<f64>,
    /// Offsets of the one or two stencil points of each variable; none for a variable that is held.
    offsets: Vec<Vec<f64>>,
}

impl Stencil {
    /// The step of a variable is `step` times its size. The size can differ from the absolute value: a variable that
    /// passes zero keeps part of its previous size.
    pub(super) fn new(
        point: &DVector<f64>,
        sizes: &DVector<f64>,
        bounds: &[(f64, f64)],
        step: f64,
        sides: DifferenceScheme,
    ) -> Self {
        let offsets = point.iter().zip(sizes).zip(bounds).map(|((&value, &size), &bounds)| {
            let step = step * size;
            let offsets = match sides {
                // A held variable needs no points: in a profile of many fits they would be a third of all points.
                _ if bounds.0 == bounds.1 => Vec::new(),
                DifferenceScheme::Central => two_point_offsets(value, step, bounds).to_vec(),
                DifferenceScheme::OneSided => vec![one_sided_offset(value, step, bounds)],
            };
            // The offset after rounding of the sum.
            offsets.into_iter().map(|offset| (value + offset) - value).collect()
        });
        Self { point: point.clone(), offsets: offsets.collect() }
    }

    /// The stencil points without the central one, variable after variable.
    pub(super) fn points(&self) -> DMatrix<f64> {
        let moved =
            self.offsets.iter().enumerate().flat_map(|(j, offsets)| offsets.iter().map(move |offset| (j, offset)));
        let columns: Vec<DVector<f64>> = moved
            .map(|(j, offset)| {
                let mut moved = self.point.clone();
                moved[j] += offset;
                moved
            })
            .collect();
        if columns.is_empty() { DMatrix::zeros(self.point.len(), 0) } else { DMatrix::from_columns(&columns) }
    }

    /// The tangent from the residuals at the central point and those at the stencil [`points`](Self::points).
    pub(super) fn tangent(&self, residuals: DVector<f64>, computed: &DMatrix<f64>) -> Tangent {
        let mut jacobian = DMatrix::zeros(residuals.len(), self.point.len());
        let mut columns = computed.column_iter();
        for (j, offsets) in self.offsets.iter().enumerate() {
            let column = match offsets[..] {
                [a, b] => {
                    let (Some(at_a), Some(at_b)) = (columns.next(), columns.next()) else { break };
                    let known = |column: &DVectorView<'_, f64>| column.iter().all(|value| value.is_finite());
                    match (known(&at_a), known(&at_b)) {
                        _ if a == b => continue,
                        (true, false) => (at_a - &residuals) / a,
                        (false, true) => (at_b - &residuals) / b,
                        // Slope at the centre of the parabola through the three points.
                        _ => ((at_b - &residuals) * (a / b) - (at_a - &residuals) * (b / a)) / (a - b),
                    }
                }
                [] => continue,
                _ => {
                    let Some(at) = columns.next() else { break };
                    if offsets[0] == 0.0 { continue } else { (at - &residuals) / offsets[0] }
                }
            };
            jacobian.set_column(j, &column);
        }
        Tangent { residuals, jacobian }
    }
}

/// Offset of a one-sided difference: upwards, unless there is too little room there and more below.
fn one_sided_offset(value: f64, step: f64, (low, high): (f64, f64)) -> f64 {
    let (down, up) = (value - low, high - value);
    if up >= step || up >= down { step.min(up) } else { -step.min(down) }
}

/// Offsets of a two-point difference between the bounds.
fn two_point_offsets(value: f64, step: f64, (low, high): (f64, f64)) -> [f64; 2] {
    let (down, up) = (value - low, high - value);
    if down >= step && up >= step {
        [-step, step]
    } else if up >= down {
        let step = step.min(up / 2.0);
        [step, 2.0 * step]
    } else {
        let step = step.min(down / 2.0);
        [-2.0 * step, -step]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals x³ and x y; NaN where x is above the limit.
    struct Cubic {
        bounds: [(f64, f64); 2],
        limit: f64,
        met: Vec<f64>,
    }

    impl LeastSquares for Cubic {
        type Error = std::convert::Infallible;

        fn bounds(&self) -> &[(f64, f64)] {
            &self.bounds
        }

        fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Self::Error> {
            self.met.extend(points.row(0).iter());
            Ok(DMatrix::from_fn(2, points.ncols(), |i, column| {
                let (x, y) = (points[(0, column)], points[(1, column)]);
                let value = if i == 0 { x.powi(3) } else { x * y };
                if x > self.limit { f64::NAN } else { value }
            }))
        }
    }

    fn slope(x: f64, bounds: (f64, f64), limit: f64, step: f64) -> (f64, Cubic) {
        let mut problem = Cubic { bounds: [bounds, (-9.0, 9.0)], limit, met: Vec::new() };
        let Ok(tangent) = finite_difference_tangent(&mut problem, &DVector::from_vec(vec![x, 3.0]), step);
        assert!((tangent.jacobian[(1, 1)] - x).abs() < 1e-9);
        (tangent.jacobian[(0, 0)], problem)
    }

    #[test]
    fn differences_are_of_second_order_wherever_the_bounds_lie() {
        for bounds in [(-9.0, 9.0), (2.0, 9.0), (-9.0, 2.0), (1.999, 9.0), (-9.0, 2.001)] {
            let error = |step| (slope(2.0, bounds, 9.0, step).0 - 12.0).abs();
            let order = (error(0.02) / error(0.01)).log2();
            assert!((order - 2.0).abs() < 0.05, "{bounds:?}: order {order}");
        }
    }

    #[test]
    fn no_point_of_the_stencil_leaves_the_bounds_however_narrow() {
        for (low, high) in [(2.0, 2.0 + 1e-6), (2.0 - 1e-6, 2.0), (2.0 - 1e-7, 2.0 + 1e-6), (2.0, 2.0)] {
            let (slope, problem) = slope(2.0, (low, high), 9.0, 0.01);
            assert!(problem.met.iter().all(|x| (low..=high).contains(x)), "{:?}", problem.met);
            assert!(if low == high { slope == 0.0 } else { (slope - 12.0).abs() < 1e-6 });
        }
    }

    #[test]
    fn where_one_point_fails_the_other_gives_a_first_order_difference() {
        assert!((slope(2.0, (-9.0, 9.0), 2.0, 1e-6).0 - 12.0).abs() < 1e-4);
        let mut problem = Cubic { bounds: [(2.0, 9.0), (-9.0, 9.0)], limit: 2.0, met: Vec::new() };
        let Ok(tangent) = finite_difference_tangent(&mut problem, &DVector::from_vec(vec![2.0, 3.0]), 0.01);
        assert!(tangent.jacobian[(0, 0)].is_nan());
    }
}
