//! Robust loss functions: outliers count for less than their squares.
//!
//! A loss ρ(r) replaces r² and is minimised as the square of a transformed residual, `r̃ = sign(r) √ρ(r)`.
//! A robust problem is thus an ordinary least-squares problem with the same finite differences, damping and
//! termination, and S is exactly `Σ ρ(r)`. (Iteratively reweighted least squares approach the same minimum, but S
//! changes its meaning between iterations, so reductions cannot be compared.)
//!
//! The squared derivatives of transformed residuals overestimate the curvature of S where many residuals are large, as
//! a loss that grows like |r| has none there. So the problem also supplies the
//! [weights](LeastSquares::curvature_weights) of the true curvature, and the minimiser uses whichever of the two models
//! predicted its last step better. The weights are those of Triggs et al. (*Bundle adjustment*, 2000) and Ceres Solver.
//! Used alone they leave no curvature where all residuals are large, and cost more iterations than they save. Residuals
//! reweighted by ψ/r have twice the curvature of transformed ones and are slower still.
//!
//! Transformed residuals must not be used for statistics. Residuals and derivatives of a robust fit are first
//! [transformed back](RobustLoss::untransformed), and their [variance](RobustLoss::variance) includes the loss of
//! efficiency.

use super::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};

/// A loss function. The robust ones are r² near zero and grow like |r| beyond `width`, which is in standard deviations
/// if the residuals are.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub enum RobustLoss {
    /// r²: least squares.
    #[default]
    Squares,
    /// `2 w² (√(1 + (r/w)²) − 1)`: smooth, and weaker than r² everywhere.
    SoftL1 {
        /// Transition from r² to |r|, in standard deviations.
        width: f64,
    },
    /// r² up to the width, `2 w |r| − w²` beyond (Huber, Ann. Math. Stat. 35, 1964). A width of 1.345 keeps 95 % of the
    /// efficiency where residuals are normal.
    Huber {
        /// Transition from r² to |r|, in standard deviations.
        width: f64,
    },
}

impl RobustLoss {
    /// ρ(r).
    pub fn rho(self, r: f64) -> f64 {
        self.transformed(r).powi(2)
    }

    /// r̃.
    fn transformed(self, r: f64) -> f64 {
        match self {
            Self::SoftL1 { width } => r * (2.0 / (1.0 + 1f64.hypot(r / width))).sqrt(),
            Self::Huber { width } if r.abs() > width => (2.0 * width * r.abs() - width * width).sqrt().copysign(r),
            Self::Huber { .. } | Self::Squares => r,
        }
    }

    /// The residual of a transformed one.
    fn inverse_transform(self, transformed: f64) -> f64 {
        match self {
            Self::SoftL1 { width } => transformed * 1f64.hypot(transformed / (2.0 * width)),
            Self::Huber { width } if transformed.abs() > width => {
                ((transformed * transformed + width * width) / (2.0 * width)).copysign(transformed)
            }
            Self::Huber { .. } | Self::Squares => transformed,
        }
    }

    /// ψ, half the derivative of ρ: the influence function.
    fn influence(self, r: f64) -> f64 {
        match self {
            Self::Squares => r,
            Self::SoftL1 { width } => r / 1f64.hypot(r / width),
            Self::Huber { width } => r.max(-width).min(width),
        }
    }

    /// ψ′.
    fn influence_derivative(self, r: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::SoftL1 { width } => 1f64.hypot(r / width).powi(-3),
            Self::Huber { width } => f64::from(r.abs() <= width),
        }
    }

    /// dr̃/dr: ψ/r̃, as `r̃² = ρ`.
    fn transform_derivative(self, r: f64) -> f64 {
        if r == 0.0 { 1.0 } else { self.influence(r) / self.transformed(r) }
    }

    /// `ψ′/(dr̃/dr)²`, the weight of a transformed residual in the curvature of the loss: the second derivative of r̃²
    /// is twice `(dr̃/dr)² + r̃ d²r̃/dr²`, and Gauss-Newton uses the first term alone. Both losses are convex, so the
    /// weight is not negative.
    fn curvature_weight(self, r: f64) -> f64 {
        self.influence_derivative(r) / self.transform_derivative(r).powi(2)
    }

    /// Residuals and derivatives of the original problem from those of a [`RobustProblem`], after a fit.
    pub fn untransformed(self, transformed: &DVector<f64>, jacobian: &DMatrix<f64>) -> Tangent {
        let residuals = transformed.map(|transformed| self.inverse_transform(transformed));
        let jacobian = DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| {
            jacobian[(i, j)] / self.transform_derivative(residuals[i])
        });
        Tangent { residuals, jacobian }
    }

    /// Pseudo-residuals, with which least squares would have the same covariance: `κ ψ(r)/(mean ψ′)` with
    /// `κ = 1 + (p/n) var ψ′/(mean ψ′)²` (Huber, *Robust Statistics*, 1981, section 7.6), after a fit of `variables`.
    /// They equal the residuals where all of these are small, and are infinite where ψ′ is zero for every residual.
    pub fn pseudo_residuals(self, residuals: &DVector<f64>, variables: f64) -> DVector<f64> {
        let slopes = residuals.map(|r| self.influence_derivative(r));
        let mean = slopes.mean();
        if mean <= 0.0 {
            return residuals.map(|_| f64::INFINITY);
        }
        let kappa = 1.0 + variables / residuals.len() as f64 * slopes.variance() / mean.powi(2);
        residuals.map(|r| kappa * self.influence(r) / mean)
    }

    /// Residual variance for the [`covariance_summary`](super::covariance_summary) of a robust fit of `variables`, from
    /// untransformed derivatives: that of the [pseudo-residuals](Self::pseudo_residuals). Infinite without degrees of
    /// freedom, and where ψ′ is zero for every residual.
    pub fn variance(self, residuals: &DVector<f64>, variables: f64) -> f64 {
        let n = residuals.len() as f64;
        let squares = self.pseudo_residuals(residuals, variables).norm_squared();
        if n > variables && squares.is_finite() { squares / (n - variables) } else { f64::INFINITY }
    }

    /// Mean ψ′: the curvature of `Σ ρ(r)` relative to that of the sum of squares of untransformed residuals (Schrader &
    /// Hettmansperger, Biometrika 67, 1980).
    pub fn mean_influence_derivative(self, residuals: &DVector<f64>) -> f64 {
        residuals.map(|r| self.influence_derivative(r)).mean()
    }
}

/// Name and, for robust losses, width: `huber=1.345`.
impl std::fmt::Display for RobustLoss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Squares => f.write_str("squares"),
            Self::SoftL1 { width } => write!(f, "soft-l1={width}"),
            Self::Huber { width } => write!(f, "huber={width}"),
        }
    }
}

/// A least-squares problem with a loss function on its residuals.
pub struct RobustProblem<P> {
    /// The problem.
    pub problem: P,
    /// The loss function.
    pub loss: RobustLoss,
}

impl<P: LeastSquares> LeastSquares for RobustProblem<P> {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        self.problem.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        Ok(self.problem.residuals(points)?.map(|r| self.loss.transformed(r)))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        let transform = |mut tangent: Tangent| {
            for (mut row, &r) in tangent.jacobian.row_iter_mut().zip(tangent.residuals.iter()) {
                row *= self.loss.transform_derivative(r);
            }
            tangent.residuals.apply(|r| *r = self.loss.transformed(*r));
            tangent
        };
        Ok(self.problem.tangents(points)?.map(|tangents| tangents.into_iter().map(transform).collect()))
    }

    fn curvature_weights(&self, residuals: &DVector<f64>) -> Option<DVector<f64>> {
        let weight = |transformed| self.loss.curvature_weight(self.loss.inverse_transform(transformed));
        (self.loss != RobustLoss::Squares).then(|| residuals.map(weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOSSES: [RobustLoss; 2] = [RobustLoss::SoftL1 { width: 1.5 }, RobustLoss::Huber { width: 1.345 }];

    #[test]
    fn transformed_residuals_invert_exactly_and_their_squares_are_the_loss() {
        for loss in LOSSES {
            for r in [-40.0, -1.5, -1.0, -1e-9, 0.0, 0.3, 1.4, 7.0] {
                assert!((loss.inverse_transform(loss.transformed(r)) - r).abs() <= 1e-14 * r.abs());
                let difference = (loss.transformed(r + 1e-6) - loss.transformed(r - 1e-6)) / 2e-6;
                assert!((loss.transform_derivative(r) - difference).abs() < 1e-6, "{loss:?} at {r}");
            }
        }
        assert!((LOSSES[0].transformed(2.0).powi(2) - 2.0 * 2.25 * ((1.0f64 + 4.0 / 2.25).sqrt() - 1.0)).abs() < 1e-14);
        assert!((LOSSES[1].transformed(-2.0).powi(2) - (2.0 * 1.345 * 2.0 - 1.345 * 1.345)).abs() < 1e-14);
    }

    #[test]
    fn curvature_weight_is_the_ratio_of_the_curvatures_of_the_loss_and_of_gauss_newton() {
        for loss in LOSSES {
            for r in [-40.0f64, -1.6, -0.3, 1e-3, 1.2, 7.0] {
                let (h, square) = (1e-4 * r.abs().max(1.0), |r| loss.transformed(r).powi(2));
                let curvature = (square(r + h) - 2.0 * square(r) + square(r - h)) / (2.0 * h * h);
                let weight = loss.curvature_weight(r);
                assert!((weight * loss.transform_derivative(r).powi(2) - curvature).abs() < 1e-5, "{loss:?} at {r}");
                assert!((0.0..=1.0 + f64::EPSILON).contains(&weight), "{loss:?} at {r}: {weight}");
            }
        }
    }

    #[test]
    fn with_small_residuals_the_variance_is_that_of_least_squares() {
        let small = DVector::from_fn(10, |i, _| 1e-4 * (i as f64 - 4.5));
        for loss in LOSSES {
            assert!((loss.variance(&small, 2.0) / (small.norm_squared() / 8.0) - 1.0).abs() < 1e-6);
            assert_eq!(loss.variance(&small, 10.0), f64::INFINITY);
        }
        assert_eq!(LOSSES[1].variance(&DVector::from_element(10, 3.0), 2.0), f64::INFINITY);
    }
}
