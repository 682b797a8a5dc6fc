//! What is known of variables before there are data, as residuals like those of data: `(P − mean)/deviation`.

use super::identify::{Certainty, certainty};
use super::{Fit, LeastSquares, Loss, Tangent};
use nalgebra::DMatrix;

/// What is known of one variable beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The variable, by its place.
    pub variable: usize,
    pub mean: f64,
    /// One standard deviation; above zero.
    pub deviation: f64,
}

/// A problem whose last residuals are those of priors. A loss belongs inside, on the data alone: a prior is not doubted
/// for being far from what the data say.
pub struct WithPriors<P> {
    pub problem: P,
    pub priors: Vec<Prior>,
}

impl<P: LeastSquares> LeastSquares for WithPriors<P> {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        self.problem.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        let computed = self.problem.residuals(points)?;
        let rows = computed.nrows();
        Ok(DMatrix::from_fn(rows + self.priors.len(), points.ncols(), |i, column| match i.checked_sub(rows) {
            Some(place) => self.priors[place].residual(points[(self.priors[place].variable, column)]),
            None => computed[(i, column)],
        }))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        let Some(tangents) = self.problem.tangents(points)? else { return Ok(None) };
        let joined = |(tangent, point): (Tangent, nalgebra::DVectorView<'_, f64>)| {
            let rows = tangent.residuals.len();
            let mut residuals = tangent.residuals.resize_vertically(rows + self.priors.len(), 0.0);
            let mut jacobian = tangent.jacobian.resize_vertically(rows + self.priors.len(), 0.0);
            for (place, prior) in self.priors.iter().enumerate() {
                residuals[rows + place] = prior.residual(point[prior.variable]);
                jacobian[(rows + place, prior.variable)] = 1.0 / prior.deviation;
            }
            Tangent { residuals, jacobian }
        };
        Ok(Some(tangents.into_iter().zip(points.column_iter()).map(joined).collect()))
    }
}

/// A problem whose residuals count by a weight each, all the same: data by their scatter beside priors at their word.
pub struct Weighed<P> {
    pub problem: P,
    pub weight: f64,
}

impl<P: LeastSquares> LeastSquares for Weighed<P> {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        self.problem.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        Ok(self.problem.residuals(points)? * self.weight)
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        let weigh = |tangent: Tangent| Tangent {
            residuals: tangent.residuals * self.weight,
            jacobian: tangent.jacobian * self.weight,
        };
        Ok(self.problem.tangents(points)?.map(|tangents| tangents.into_iter().map(weigh).collect()))
    }
}

impl Prior {
    fn residual(&self, value: f64) -> f64 {
        (value - self.mean) / self.deviation
    }
}

/// What data and priors together say at the end of a fit, to first order; straightened where it was robust.
#[derive(Clone, Debug)]
pub struct Known {
    /// Residuals and derivatives of the data, and after them those of the priors.
    tangent: Tangent,
    samples: usize,
    /// Of the residuals of the data.
    pub variance: f64,
    /// Of the loss: what a rise of it is to be divided by to be one of chi squared.
    pub scale: f64,
}

/// What is known at the end of a fit by a loss, whose last `priors` residuals are those of priors.
///
/// The deviations of priors are taken at their word, those of the data are not: their variance is estimated from their
/// own residuals, for squares as `s² = S/(n − q)`, where `q = tr(J (JᵀJ/s² + Λ)⁻¹ Jᵀ)/s²` is how many variables the data
/// had to determine, priors of precision Λ having had a share in them. The covariance is `(JᵀJ/s² + Λ)⁻¹`. To take s² for
/// the variance of all residuals alike would widen or narrow what is known beforehand by how well the data fit.
pub fn known(fit: &Fit, loss: Loss, priors: usize) -> Known {
    let samples = fit.residuals.len() - priors;
    let data =
        loss.straightened(&fit.residuals.rows(0, samples).into_owned(), &fit.jacobian.rows(0, samples).into_owned());
    let (mut residuals, mut jacobian) = (fit.residuals.clone(), fit.jacobian.clone());
    residuals.rows_mut(0, samples).copy_from(&data.residuals);
    jacobian.rows_mut(0, samples).copy_from(&data.jacobian);
    let mut variance = loss.variance(&data.residuals, 0.0);
    // Each turn changes q by less than the one before by a factor of n − q; the limit is one that nothing meets.
    for _ in 0..100 {
        let found = loss.variance(&data.residuals, determined(&jacobian, samples, variance));
        let is_settled = (found - variance).abs() <= 1e-12 * variance;
        variance = found;
        if is_settled || !variance.is_finite() {
            break;
        }
    }
    let scale = loss.scale(&data.residuals, variance);
    Known { tangent: Tangent { residuals, jacobian }, samples, variance, scale }
}

impl Known {
    /// Those of the data alone.
    pub fn residuals(&self) -> &[f64] {
        &self.tangent.residuals.as_slice()[..self.samples]
    }

    /// Derivatives to be judged by a variance, all of them, as if that were the variance of the data: those of priors
    /// are multiplied by its root, so that it cancels in what they say.
    pub fn jacobian(&self, variance: f64) -> DMatrix<f64> {
        let mut jacobian = self.tangent.jacobian.clone();
        let priors = jacobian.nrows() - self.samples;
        if priors > 0 {
            jacobian.rows_mut(self.samples, priors).scale_mut(variance.sqrt());
        }
        jacobian
    }

    /// What is determined where the data count by a variance: [`variance`](Self::variance) where their residuals are
    /// independent, more where those follow each other.
    pub fn certainty(&self, variance: f64) -> Certainty {
        certainty(&self.jacobian(variance), variance)
    }
}

/// The leverage of the data, of a variance: how many variables they determine.
fn determined(jacobian: &DMatrix<f64>, samples: usize, variance: f64) -> f64 {
    let deviation = if variance > 0.0 { variance.sqrt() } else { 1.0 };
    let mut weighted = jacobian.clone();
    weighted.rows_mut(0, samples).unscale_mut(deviation);
    let q: DMatrix<f64> = weighted.qr().q();
    q.rows(0, samples).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Options, minimize};
    use nalgebra::DVector;
    use std::convert::Infallible;

    /// One variable, measured many times over.
    struct Repeated(Vec<f64>);

    impl LeastSquares for Repeated {
        type Error = Infallible;

        fn bounds(&self) -> &[(f64, f64)] {
            &[(f64::NEG_INFINITY, f64::INFINITY)]
        }

        fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
            Ok(DMatrix::from_fn(self.0.len(), points.ncols(), |i, column| points[(0, column)] - self.0[i]))
        }

        fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
            let residuals = self.residuals(points)?;
            let jacobian = DMatrix::from_element(self.0.len(), 1, 1.0);
            let columns = residuals.column_iter().map(|column| column.into_owned());
            Ok(Some(columns.map(|residuals| Tangent { residuals, jacobian: jacobian.clone() }).collect()))
        }
    }

    fn fitted(deviation: f64) -> (Fit, Certainty, f64) {
        let readings: Vec<f64> = (0..16).map(|i| 5.0 + if i % 2 == 0 { 0.4 } else { -0.4 }).collect();
        let priors = vec![Prior { variable: 0, mean: 6.0, deviation }];
        let mut problem = WithPriors { problem: Repeated(readings), priors };
        let options = Options { tolerance_gradient: 1e-12, tolerance_reduction: 1e-20, ..Options::default() };
        let Ok(fit) = minimize(&mut problem, &DVector::from_element(1, 1.0), &options);
        let found = known(&fit, Loss::Squares, 1);
        let certainty = found.certainty(found.variance);
        (fit, certainty, found.variance)
    }

    /// With residuals of one unit the data weigh 16 and the prior 1/0.25² = 16: the estimate lies halfway.
    #[test]
    fn an_estimate_lies_between_data_and_prior_by_their_weights() {
        let (fit, _, _) = fitted(0.25);
        assert!(fit.termination.converged() && (fit.point[0] - 5.5).abs() < 1e-8, "{}", fit.point);
    }

    #[test]
    fn a_prior_is_taken_at_its_word_and_the_data_by_their_scatter() {
        let (fit, certainty, variance) = fitted(1e-3);
        let scatter = fit.residuals.rows(0, 16).norm_squared() / 16.0;
        assert!((variance / scatter - 1.0).abs() < 1e-4, "the data determined nothing, so no freedom is lost");
        assert!((certainty.standard_errors[0] / 1e-3 - 1.0).abs() < 1e-3);

        let (fit, certainty, variance) = fitted(1e3);
        assert!((variance / (fit.objective / 15.0) - 1.0).abs() < 1e-4, "the data determined it alone");
        assert!((certainty.standard_errors[0] / (variance / 16.0).sqrt() - 1.0).abs() < 1e-4);
    }
}
