//! Prior distributions of variables, as additional residuals `(P − mode)/deviation`.

use super::{LeastSquares, Tangent};
use nalgebra::{DMatrix, DVector};

/// Split normal prior distribution of one variable: normal on each side of its mode, with a standard deviation of its
/// own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Index of the variable.
    pub variable: usize,
    /// The most probable value; the mean where both deviations are equal.
    pub mode: f64,
    /// Standard deviations below and above the mode. One may be zero if the bounds of the variable exclude its side.
    pub deviations: [f64; 2],
}

/// A prior at a point, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearizedPrior {
    /// Index of the variable.
    pub variable: usize,
    /// Standard deviation on the side of the point.
    pub deviation: f64,
}

/// A least-squares problem with the residuals of priors appended. A loss function belongs inside, on the data alone: a
/// prior far from the data is not an outlier.
pub struct WithPriors<P> {
    /// The problem of the data.
    pub problem: P,
    /// At most one per variable.
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
            Some(index) => self.priors[index].residual(points[(self.priors[index].variable, column)]),
            None => computed[(i, column)],
        }))
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        let Some(tangents) = self.problem.tangents(points)? else { return Ok(None) };
        let with_prior_rows = |(tangent, point): (Tangent, nalgebra::DVectorView<'_, f64>)| {
            let rows = tangent.residuals.len();
            let mut residuals = tangent.residuals.resize_vertically(rows + self.priors.len(), 0.0);
            let mut jacobian = tangent.jacobian.resize_vertically(rows + self.priors.len(), 0.0);
            for (index, prior) in self.priors.iter().enumerate() {
                residuals[rows + index] = prior.residual(point[prior.variable]);
                jacobian[(rows + index, prior.variable)] = 1.0 / prior.deviation(point[prior.variable]);
            }
            Tangent { residuals, jacobian }
        };
        Ok(Some(tangents.into_iter().zip(points.column_iter()).map(with_prior_rows).collect()))
    }

    fn curvature_weights(&self, residuals: &DVector<f64>) -> Option<DVector<f64>> {
        let samples = residuals.len() - self.priors.len();
        let weights = self.problem.curvature_weights(&residuals.rows(0, samples).into_owned())?;
        Some(weights.resize_vertically(residuals.len(), 1.0))
    }
}

/// A least-squares problem with a common weight on all residuals: it sets the weight of data relative to priors.
pub struct WeightedProblem<P> {
    /// The problem.
    pub problem: P,
    /// Factor on every residual; above zero.
    pub weight: f64,
}

impl<P: LeastSquares> LeastSquares for WeightedProblem<P> {
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

    fn curvature_weights(&self, residuals: &DVector<f64>) -> Option<DVector<f64>> {
        self.problem.curvature_weights(&(residuals / self.weight))
    }
}

impl Prior {
    /// Distance of a value from the mode, in standard deviations of its side.
    pub fn residual(&self, value: f64) -> f64 {
        (value - self.mode) / self.deviation(value)
    }

    /// The standard deviation on the side of a value; at the mode the larger one.
    pub fn deviation(&self, value: f64) -> f64 {
        let [below, above] = self.deviations;
        if value < self.mode {
            below
        } else if value > self.mode {
            above
        } else {
            below.max(above)
        }
    }

    /// Priors at a point.
    pub fn linearized(priors: &[Self], point: &DVector<f64>) -> Vec<LinearizedPrior> {
        let of = |prior: &Self| LinearizedPrior {
            variable: prior.variable,
            deviation: prior.deviation(point[prior.variable]),
        };
        priors.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Fit, LinearizedPosterior, NoiseProcess, Options, minimize};
    use nalgebra::DVector;
    use std::convert::Infallible;

    /// One variable, measured repeatedly.
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

    const SAMPLES: usize = 16;

    /// Sixteen readings about 5 and a prior at 6, three times as wide above as below: the fit, and the posterior at a
    /// scale of 0.16, the mean square of the readings.
    fn fitted(deviation: f64) -> (Fit, LinearizedPosterior) {
        let readings: Vec<f64> = (0..SAMPLES).map(|i| 5.0 + if i % 2 == 0 { 0.4 } else { -0.4 }).collect();
        let priors = vec![Prior { variable: 0, mode: 6.0, deviations: [deviation, 3.0 * deviation] }];
        let mut problem = WithPriors { problem: Repeated(readings.clone()), priors: priors.clone() };
        let options = Options { tolerance_gradient: 1e-12, tolerance_reduction: 1e-20, ..Options::default() };
        let Ok(fit) = minimize(&mut problem, &DVector::from_element(1, 1.0), &options);
        let data = DMatrix::from_element(SAMPLES, 1, 1.0);
        let about_mean = DVector::from_iterator(SAMPLES, readings.iter().map(|reading| 5.0 - reading));
        let times = (0..SAMPLES).map(|i| i as f64).collect();
        let noise = NoiseProcess::estimate(&about_mean, &data, &[times]);
        let local = Prior::linearized(&priors, &fit.point);
        let posterior = LinearizedPosterior::new(&data, &local, 0.16, &noise, &DVector::zeros(SAMPLES));
        (fit, posterior)
    }

    /// With unit residuals the data weigh 16 and the prior 1/0.25² = 16: the estimate lies halfway.
    #[test]
    fn an_estimate_is_the_weighted_mean_of_data_and_prior() {
        let (fit, _) = fitted(0.25);
        assert!(fit.termination.converged() && (fit.point[0] - 5.5).abs() < 1e-8, "{}", fit.point);
    }

    /// For white noise of variance 0.16·16/15 the mean of 16 readings has a standard deviation of 0.103.
    #[test]
    fn standard_errors_follow_a_narrow_prior_and_otherwise_the_scatter_of_the_data() {
        let (_, posterior) = fitted(1e-3);
        assert!((posterior.standard_errors()[0] / 1e-3 - 1.0).abs() < 0.1, "{:?}", posterior.standard_errors());
        let (_, posterior) = fitted(1e3);
        let error = posterior.standard_errors()[0];
        assert!((0.1..0.14).contains(&error), "{error} for a mean of 16 readings");
    }
}
