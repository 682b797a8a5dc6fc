//! What is known of variables before there are data, as residuals like those of data: `(P − mean)/deviation`.

use super::identify::{Certainty, certainty};
use super::{Fit, LeastSquares, Tangent};
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

impl Prior {
    fn residual(&self, value: f64) -> f64 {
        (value - self.mean) / self.deviation
    }
}

/// How well data and priors together determine the variables at the end of a fit whose last `priors` residuals are those
/// of priors, and the variance of the residuals of the data.
///
/// The deviations of priors are taken at their word, those of the data are not: their variance is estimated from their
/// own residuals as `s² = S/(n − q)`, where `q = tr(J (JᵀJ/s² + Λ)⁻¹ Jᵀ)/s²` is how many variables the data had to
/// determine, priors of precision Λ having had a share in them. The covariance is `(JᵀJ/s² + Λ)⁻¹`. To take s² for the
/// variance of all residuals alike would widen or narrow what is known beforehand by how well the data fit.
pub fn posterior(fit: &Fit, priors: usize) -> (Certainty, f64) {
    let samples = fit.residuals.len() - priors;
    let squares = fit.residuals.rows(0, samples).norm_squared();
    let mut variance = squares / samples as f64;
    // Each turn changes q by less than the one before by a factor of n − q; the limit is one that nothing meets.
    for _ in 0..100 {
        let determined = determined(&weighted(&fit.jacobian, samples, variance), samples);
        let found = if samples as f64 > determined { squares / (samples as f64 - determined) } else { f64::INFINITY };
        let is_settled = (found - variance).abs() <= 1e-12 * variance;
        variance = found;
        if is_settled || !variance.is_finite() {
            break;
        }
    }
    (certainty(&weighted(&fit.jacobian, samples, variance), 1.0), variance)
}

/// A Jacobian with the rows of the data over their standard deviation.
fn weighted(jacobian: &DMatrix<f64>, samples: usize, variance: f64) -> DMatrix<f64> {
    let deviation = if variance > 0.0 { variance.sqrt() } else { 1.0 };
    DMatrix::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| {
        jacobian[(i, j)] / if i < samples { deviation } else { 1.0 }
    })
}

/// The leverage of the first rows: how many variables they determine.
fn determined(jacobian: &DMatrix<f64>, samples: usize) -> f64 {
    let q: DMatrix<f64> = jacobian.clone().qr().q();
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
        let (certainty, variance) = posterior(&fit, 1);
        (fit, certainty, variance)
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
