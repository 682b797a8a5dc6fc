//! Derivatives by differences that stay between the bounds.

use super::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};

/// Number of points of a stencil: the point itself and two a variable.
pub fn points(variables: usize) -> usize {
    1 + 2 * variables
}

/// Residuals and their derivatives at a point, from one stencil of [`points`] computed together: central differences
/// (the paper's Eqs 6 and 14), and three-point ones to one side where a bound leaves no room on the other. Both are
/// of second order in the step.
///
/// The step of a variable is its share `step`, or `step` itself where the variable is zero. Where one of its two
/// points could not be computed, the other alone gives a first-order difference; where neither could, its column is
/// NaN. A variable without room on either side has a column of zeros.
///
/// # Errors
/// Those of the problem.
pub fn difference<P: LeastSquares>(problem: &mut P, point: &DVector<f64>, step: f64) -> Result<Tangent, P::Error> {
    let offsets: Vec<[f64; 2]> = point
        .iter()
        .zip(problem.bounds())
        .map(|(&value, &bounds)| {
            let offsets = offsets(value, if value == 0.0 { step } else { step * value.abs() }, bounds);
            // What is added to the variable is not quite what arrives.
            offsets.map(|offset| (value + offset) - value)
        })
        .collect();

    let mut stencil = DMatrix::from_fn(point.len(), points(point.len()), |i, _| point[i]);
    for (j, offsets) in offsets.iter().enumerate() {
        for (side, offset) in offsets.iter().enumerate() {
            stencil[(j, 1 + 2 * j + side)] += offset;
        }
    }
    let computed = problem.residuals(&stencil)?;

    let residuals = computed.column(0).into_owned();
    let mut jacobian = DMatrix::zeros(residuals.len(), point.len());
    for (j, &[a, b]) in offsets.iter().enumerate() {
        let (at_a, at_b) = (computed.column(1 + 2 * j), computed.column(2 + 2 * j));
        let known = |column: &nalgebra::DVectorView<'_, f64>| column.iter().all(|value| value.is_finite());
        let column = match (known(&at_a), known(&at_b)) {
            _ if a == b => continue,
            (true, false) => (at_a - &residuals) / a,
            (false, true) => (at_b - &residuals) / b,
            // The slope at the middle of the parabola through the three points.
            _ => ((at_b - &residuals) * (a / b) - (at_a - &residuals) * (b / a)) / (a - b),
        };
        jacobian.set_column(j, &column);
    }
    Ok(Tangent { residuals, jacobian })
}

/// How far from a variable its two points lie, so that neither leaves the bounds.
fn offsets(value: f64, step: f64, (low, high): (f64, f64)) -> [f64; 2] {
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

    /// Residuals x³ and x y: no number where x is above its limit.
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
        let Ok(tangent) = difference(&mut problem, &DVector::from_vec(vec![x, 3.0]), step);
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
    fn a_point_that_could_not_be_computed_leaves_the_difference_to_the_other() {
        assert!((slope(2.0, (-9.0, 9.0), 2.0, 1e-6).0 - 12.0).abs() < 1e-4);
        let mut problem = Cubic { bounds: [(2.0, 9.0), (-9.0, 9.0)], limit: 2.0, met: Vec::new() };
        let Ok(tangent) = difference(&mut problem, &DVector::from_vec(vec![2.0, 3.0]), 0.01);
        assert!(tangent.jacobian[(0, 0)].is_nan());
    }
}
