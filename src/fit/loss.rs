//! Robust losses: samples that lie far off count for less than their squares.
//!
//! A loss ρ(r) takes the place of r², and is minimised as the square of a bent residual, `r̃ = sign(r) √ρ(r)`. So a
//! robust problem is a least-squares problem like any other: differences, damping and endings are as they were, and S is
//! `Σ ρ(r)` exactly. (Weights that are renewed from turn to turn approach the same minimum, but S then changes its meaning
//! on the way, and no gain can be told from it.)
//!
//! Squares of the derivatives of bent residuals are too large a curvature of S where many residuals are far off: a loss
//! that grows like |r| has none there. The minimiser is given the [weights](LeastSquares::curvature_weights) of the true
//! curvature too, and takes the one of the two models that foretold its last step better. The weights are those of Triggs
//! et al. (*Bundle adjustment*, 2000) and Ceres Solver; without the other model they leave no curvature where all residuals
//! are far off, and take more iterations than they save. Residuals reweighted by ψ/r have twice the curvature of bent
//! ones, and are slower still.
//!
//! What is bent is not to be judged as if it were straight. The residuals and derivatives of a robust fit are
//! [straightened](Loss::straightened), and the [variance](Loss::variance) that goes with them has the efficiency in it
//! that the loss costs.

use super::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};

/// How residuals count that are far off. The robust ones are r² near zero and grow like |r| beyond `width`, which is in
/// standard deviations where residuals are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Loss {
    /// r²: least squares.
    #[default]
    Squares,
    /// `2 w² (√(1 + (r/w)²) − 1)`: smooth, and damps a little everywhere.
    SoftL1 {
        /// Where it bends from r² to |r|, in standard deviations.
        width: f64,
    },
    /// r² up to the width, `2 w |r| − w²` beyond (Huber, Ann. Math. Stat. 35, 1964). A width of 1.345 keeps 95 % of the
    /// efficiency where residuals are normal.
    Huber {
        /// Where it turns from r² to |r|, in standard deviations.
        width: f64,
    },
}

impl Loss {
    /// ρ(r).
    pub fn of(self, r: f64) -> f64 {
        self.bent(r).powi(2)
    }

    /// r̃.
    fn bent(self, r: f64) -> f64 {
        match self {
            Self::SoftL1 { width } => r * (2.0 / (1.0 + 1f64.hypot(r / width))).sqrt(),
            Self::Huber { width } if r.abs() > width => (2.0 * width * r.abs() - width * width).sqrt().copysign(r),
            Self::Huber { .. } | Self::Squares => r,
        }
    }

    /// r of a bent residual.
    fn straight(self, bent: f64) -> f64 {
        match self {
            Self::SoftL1 { width } => bent * 1f64.hypot(bent / (2.0 * width)),
            Self::Huber { width } if bent.abs() > width => {
                ((bent * bent + width * width) / (2.0 * width)).copysign(bent)
            }
            Self::Huber { .. } | Self::Squares => bent,
        }
    }

    /// ψ: half the slope of ρ, which is how far a residual pulls.
    fn influence(self, r: f64) -> f64 {
        match self {
            Self::Squares => r,
            Self::SoftL1 { width } => r / 1f64.hypot(r / width),
            Self::Huber { width } => r.max(-width).min(width),
        }
    }

    /// The slope of ψ.
    fn stiffness(self, r: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::SoftL1 { width } => 1f64.hypot(r / width).powi(-3),
            Self::Huber { width } => f64::from(r.abs() <= width),
        }
    }

    /// dr̃/dr: ψ/r̃, as `r̃² = ρ`.
    fn slope(self, r: f64) -> f64 {
        if r == 0.0 { 1.0 } else { self.influence(r) / self.bent(r) }
    }

    /// `ψ′/(dr̃/dr)²`, the weight of a bent residual in the curvature of the loss: the second derivative of r̃² is twice
    /// `(dr̃/dr)² + r̃ d²r̃/dr²`, of which least squares see the first term alone. Both losses are convex, so it is not
    /// below zero.
    fn curvature_weight(self, r: f64) -> f64 {
        self.stiffness(r) / self.slope(r).powi(2)
    }

    /// Residuals and derivatives of the problem itself from those of a [`Robust`] one, at the end of a fit.
    pub fn straightened(self, bent: &DVector<f64>, jacobian: &DMatrix<f64>) -> Tangent {
        let residuals = bent.map(|bent| self.straight(bent));
        let jacobian =
            DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| jacobian[(i, j)] / self.slope(residuals[i]));
        Tangent { residuals, jacobian }
    }

    /// Straightened residuals of a robust fit as least squares would need them to move as far: `κ ψ(r)/(mean ψ′)` with
    /// `κ = 1 + (p/n) var ψ′/(mean ψ′)²` (Huber, *Robust Statistics*, 1981, section 7.6), after a fit of `variables`. Where all residuals
    /// are small they are the residuals. Infinite where every one counts as far off.
    pub fn pseudo_residuals(self, residuals: &DVector<f64>, variables: f64) -> DVector<f64> {
        let stiffness = residuals.map(|r| self.stiffness(r));
        let mean = stiffness.mean();
        if mean <= 0.0 {
            return residuals.map(|_| f64::INFINITY);
        }
        let kappa = 1.0 + variables / residuals.len() as f64 * stiffness.variance() / mean.powi(2);
        residuals.map(|r| kappa * self.influence(r) / mean)
    }

    /// The variance to judge straightened derivatives by ([`certainty`](super::certainty)) after a robust fit of so many
    /// variables: that of the [pseudo-residuals](Self::pseudo_residuals). Infinite where no sample is left over, or every one
    /// counts as far off.
    pub fn variance(self, residuals: &DVector<f64>, variables: f64) -> f64 {
        let n = residuals.len() as f64;
        let squares = self.pseudo_residuals(residuals, variables).norm_squared();
        if n > variables && squares.is_finite() { squares / (n - variables) } else { f64::INFINITY }
    }

    /// By how much `Σ ρ(r)` is softer than a parabola of straightened derivatives: its mean stiffness (Schrader & Hettmansperger,
    /// Biometrika 67, 1980).
    pub fn mean_stiffness(self, residuals: &DVector<f64>) -> f64 {
        residuals.map(|r| self.stiffness(r)).mean()
    }
}

/// Its name, with a width where it has one: `huber=1.345`.
impl std::fmt::Display for Loss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Squares => f.write_str("squares"),
            Self::SoftL1 { width } => write!(f, "soft-l1={width}"),
            Self::Huber { width } => write!(f, "huber={width}"),
        }
    }
}

/// A problem whose residuals count by a loss.
pub struct Robust<P> {
    /// The problem.
    pub problem: P,
    /// How its residuals count.
    pub loss: Loss,
}

impl<P: LeastSquares> LeastSquares for Robust<P> {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        self.problem.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        Ok(self.problem.residuals(points)?.map(|r| self.loss.bent(r)))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        let bend = |mut tangent: Tangent| {
            for (mut row, &r) in tangent.jacobian.row_iter_mut().zip(tangent.residuals.iter()) {
                row *= self.loss.slope(r);
            }
            tangent.residuals.apply(|r| *r = self.loss.bent(*r));
            tangent
        };
        Ok(self.problem.tangents(points)?.map(|tangents| tangents.into_iter().map(bend).collect()))
    }

    fn curvature_weights(&self, residuals: &DVector<f64>) -> Option<DVector<f64>> {
        let weight = |bent| self.loss.curvature_weight(self.loss.straight(bent));
        (self.loss != Loss::Squares).then(|| residuals.map(weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOSSES: [Loss; 2] = [Loss::SoftL1 { width: 1.5 }, Loss::Huber { width: 1.345 }];

    #[test]
    fn a_bent_residual_is_straightened_to_what_it_was_and_its_square_is_the_loss() {
        for loss in LOSSES {
            for r in [-40.0, -1.5, -1.0, -1e-9, 0.0, 0.3, 1.4, 7.0] {
                assert!((loss.straight(loss.bent(r)) - r).abs() <= 1e-14 * r.abs());
                let rise = (loss.bent(r + 1e-6) - loss.bent(r - 1e-6)) / 2e-6;
                assert!((loss.slope(r) - rise).abs() < 1e-6, "{loss:?} at {r}");
            }
        }
        assert!((LOSSES[0].bent(2.0).powi(2) - 2.0 * 2.25 * ((1.0f64 + 4.0 / 2.25).sqrt() - 1.0)).abs() < 1e-14);
        assert!((LOSSES[1].bent(-2.0).powi(2) - (2.0 * 1.345 * 2.0 - 1.345 * 1.345)).abs() < 1e-14);
    }

    #[test]
    fn the_weight_of_a_residual_is_the_curvature_of_its_loss_over_that_of_its_bent_square() {
        for loss in LOSSES {
            for r in [-40.0f64, -1.6, -0.3, 1e-3, 1.2, 7.0] {
                let (h, square) = (1e-4 * r.abs().max(1.0), |r| loss.bent(r).powi(2));
                let curvature = (square(r + h) - 2.0 * square(r) + square(r - h)) / (2.0 * h * h);
                let weight = loss.curvature_weight(r);
                assert!((weight * loss.slope(r).powi(2) - curvature).abs() < 1e-5, "{loss:?} at {r}");
                assert!((0.0..=1.0 + f64::EPSILON).contains(&weight), "{loss:?} at {r}: {weight}");
            }
        }
    }

    #[test]
    fn where_all_residuals_are_small_the_variance_is_that_of_least_squares() {
        let small = DVector::from_fn(10, |i, _| 1e-4 * (i as f64 - 4.5));
        for loss in LOSSES {
            assert!((loss.variance(&small, 2.0) / (small.norm_squared() / 8.0) - 1.0).abs() < 1e-6);
            assert_eq!(loss.variance(&small, 10.0), f64::INFINITY);
        }
        assert_eq!(LOSSES[1].variance(&DVector::from_element(10, 3.0), 2.0), f64::INFINITY);
    }
}
