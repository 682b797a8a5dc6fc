//! Models of the noise and of the true heating, weighted by their restricted likelihood.
//!
//! About an estimate the readings are linear in the knot values q, `y = J q + e` in units of their stated deviations.
//! A model has four parameters:
//!
//! - the noise e has the variance s² and the correlation Σ(τ, η) of [`NoiseCorrelation`];
//! - the second differences D q of the true heating are normal about zero with the covariance `(s²/λ) C`. C is the
//!   identity for a smooth heating, an integrated random walk: then λ is the square of the regularisation weight. For
//!   a heating with steps it has a random walk added ([`WALK_TIMES`]), which dominates over shorter times.
//!
//! Straight lines between jumps, which have no second differences, have a flat prior. With them and q integrated out,
//! and s² over its prior 1/s², the likelihood of (τ, η, λ, C) is that of data without the signal of the straight lines
//! (restricted maximum likelihood, REML; for splines "generalised maximum likelihood": Wahba, Ann. Stat. 13, 1985). It
//! needs no noise level. Residuals alone choose too weak a regularisation where noise is correlated (Opsomer, Wang &
//! Yang, Stat. Sci. 16, 2001), so the correlation of the noise and λ are estimated together.
//!
//! No single model is inserted: the likelihood of λ is flat towards straight lines. Intervals are quantiles of the
//! mixture of all models, with a uniform prior in ln λ and over C, and the prior of the noise.

use super::knots::Knots;
use crate::fit::noise_model::{NoiseCorrelation, gaps};
use nalgebra::{DMatrix, DVector};

/// Times over which the random walk in a heating dominates over the integrated one, relative to the time over which
/// knots are spread. At the last there is a random walk alone.
const WALK_TIMES: [f64; 3] = [0.0, 0.1, 3.0];
/// Regularisation weights of the grid, as powers of ten of the weight at which the Jacobians of data and roughness have
/// equal norms: from next to none to nearly straight lines.
const MIN_LOG10_WEIGHT: f64 = -5.0;
const MAX_LOG10_WEIGHT: f64 = 1.5;
const WEIGHTS_PER_DECADE: usize = 4;
/// Models with a smaller probability, relative to the most probable, are left out.
const NEGLIGIBLE_PROBABILITY: f64 = 1e-5;
/// Square of the weight at which data and roughness are factorised together.
const REFERENCE_WEIGHT_SQUARED: f64 = 1e-4;
/// Addition to the diagonal of a matrix that is scaled to a diagonal of one, so that rounding does not make it
/// indefinite where a knot is nearly undetermined.
const RIDGE: f64 = 1e-12;

/// The models of the roughness.
pub(super) struct RoughnessModels {
    /// D, one row per knot between two segments that are not jumps.
    pub differences: DMatrix<f64>,
    /// Cholesky factor of each C, of determinant one.
    pub factors: Vec<DMatrix<f64>>,
}

impl RoughnessModels {
    pub(super) fn of(knots: &Knots) -> Self {
        let walk = knots.walk_roughness();
        let covariance = &walk * walk.transpose();
        let rows = walk.nrows();
        let factor = |time: f64| {
            // Variances over a time t: t³/3 of the integrated walk, and t of the walk.
            let sum = DMatrix::identity(rows, rows) + &covariance * (time.powi(2) / 3.0);
            let lower = sum.cholesky()?.unpack();
            let log_determinant: f64 = lower.diagonal().iter().map(|entry| entry.ln()).sum();
            Some(lower * (-log_determinant / rows.max(1) as f64).exp())
        };
        Self { differences: knots.roughness(), factors: WALK_TIMES.into_iter().filter_map(factor).collect() }
    }
}

/// The readings to first order about an estimate.
pub(super) struct LinearizedReadings<'a> {
    /// J, sample × knot.
    pub jacobian: DMatrix<f64>,
    /// y.
    pub response: DVector<f64>,
    /// Times of the samples of each trace, s.
    pub traces: &'a [Vec<f64>],
    pub roughness: &'a RoughnessModels,
    /// Regularisation weight at which J and the weighted D have equal norms.
    pub unit_weight: f64,
}

/// A model of the noise and of the true heating.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    /// Index into the correlations of the noise.
    pub noise: usize,
    /// Index into the factors of the roughness.
    pub walk: usize,
    /// √λ, relative to the unit weight.
    pub weight: f64,
    pub probability: f64,
    /// s².
    pub variance: f64,
}

/// The probability of a regularisation weight, over all models.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct WeightProbability {
    /// Weight, relative to the weight at which the Jacobians of data and roughness have equal norms.
    pub weight: f64,
    /// Posterior probability among the weights of the grid.
    pub probability: f64,
}

/// All models that are not negligible.
pub(super) struct ModelPosterior {
    pub correlations: Vec<NoiseCorrelation>,
    pub gaps: Vec<Vec<f64>>,
    pub models: Vec<Model>,
    pub degrees_of_freedom: f64,
}

fn weight_grid() -> Vec<f64> {
    let steps = ((MAX_LOG10_WEIGHT - MIN_LOG10_WEIGHT) * WEIGHTS_PER_DECADE as f64).round() as usize;
    (0..=steps).map(|step| 10f64.powf(MIN_LOG10_WEIGHT + step as f64 / WEIGHTS_PER_DECADE as f64)).collect()
}

impl ModelPosterior {
    pub(super) fn of(readings: &LinearizedReadings<'_>) -> Self {
        let differences = &readings.roughness.differences;
        let acts = |&knot: &usize| readings.jacobian.column(knot).norm() > 0.0 || differences.column(knot).norm() > 0.0;
        let knots: Vec<usize> = (0..readings.jacobian.ncols()).filter(acts).collect();
        let differences = differences.select_columns(&knots);
        let mut columns = readings.jacobian.select_columns(&knots).insert_column(0, 0.0);
        columns.set_column(0, &readings.response);

        let gaps = gaps(readings.traces);
        let correlations = NoiseCorrelation::history_grid(&gaps);
        let rank = differences.nrows();
        let degrees_of_freedom = (columns.nrows() + rank) as f64 - knots.len() as f64;
        let penalty = |factor: &DMatrix<f64>| {
            let white = factor.solve_lower_triangular(&differences)?;
            Some(white.tr_mul(&white) * readings.unit_weight.powi(2))
        };
        let penalties: Vec<Option<DMatrix<f64>>> = readings.roughness.factors.iter().map(penalty).collect();
        let weights = weight_grid();
        let mut logs: Vec<(f64, Model)> = Vec::new();
        for (noise, correlation) in correlations.iter().enumerate() {
            let (white, log_determinant) = correlation.whitened(&columns, &gaps);
            let (response, jacobian) = (white.column(0), white.columns(1, knots.len()));
            let information = jacobian.tr_mul(&jacobian);
            let score = jacobian.tr_mul(&response);
            let squares = response.norm_squared().max(f64::MIN_POSITIVE);
            for (walk, penalty) in penalties.iter().enumerate() {
                let tridiagonal =
                    penalty.as_ref().and_then(|penalty| Tridiagonalised::of(&information, penalty, &score));
                let Some(tridiagonal) = tridiagonal else { continue };
                for &weight in &weights {
                    let (log_terms, explained) = tridiagonal.at(weight);
                    // A difference of squares can round to zero or below.
                    let rest = (squares - explained).max(1e-14 * squares);
                    let log = correlation.prior.ln() - 0.5 * (log_determinant + log_terms) + rank as f64 * weight.ln()
                        - 0.5 * degrees_of_freedom * rest.ln();
                    let variance = if degrees_of_freedom > 0.0 { rest / degrees_of_freedom } else { f64::INFINITY };
                    logs.push((log, Model { noise, walk, weight, probability: 0.0, variance }));
                }
            }
        }
        let largest = logs.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
        let relative = logs.into_iter().map(|(log, model)| Model { probability: (log - largest).exp(), ..model });
        let mut models: Vec<Model> = relative.filter(|model| model.probability > NEGLIGIBLE_PROBABILITY).collect();
        let sum: f64 = models.iter().map(|model| model.probability).sum();
        models.iter_mut().for_each(|model| model.probability /= sum);
        Self { correlations, gaps, models, degrees_of_freedom }
    }

    /// Probability of each weight of the grid.
    pub(super) fn weights(&self) -> Vec<WeightProbability> {
        let of =
            |weight: f64| self.models.iter().filter(move |model| model.weight == weight).map(|model| model.probability);
        weight_grid().into_iter().map(|weight| WeightProbability { weight, probability: of(weight).sum() }).collect()
    }

    /// The most probable correlation of the noise, and its mean variance.
    pub(super) fn noise(&self) -> (NoiseCorrelation, f64) {
        let mut sums = vec![(0.0, 0.0); self.correlations.len()];
        for model in &self.models {
            sums[model.noise].0 += model.probability;
            sums[model.noise].1 += model.probability * model.variance;
        }
        let most = (0..sums.len()).max_by(|&a, &b| sums[a].0.total_cmp(&sums[b].0)).unwrap_or_default();
        (self.correlations[most], sums[most].1 / sums[most].0)
    }

    /// The weight of the grid whose least-squares estimate has the least expected mean square error over time, averaged
    /// over the models. `spans` are the weights of the knots in time. An error counts up to `largest`, above which a
    /// knot is undetermined anyway.
    pub(super) fn least_error_weight(
        &self,
        readings: &LinearizedReadings<'_>,
        spans: &DVector<f64>,
        largest: f64,
    ) -> Option<f64> {
        let (jacobian, differences) = (&readings.jacobian, &readings.roughness.differences);
        let mut noise = vec![0.0; self.correlations.len()];
        let mut roughness = vec![0.0; readings.roughness.factors.len()];
        for model in &self.models {
            noise[model.noise] += model.probability * model.variance;
            roughness[model.walk] += model.probability * model.variance / model.weight.powi(2);
        }
        let mut scores = DMatrix::zeros(jacobian.ncols(), jacobian.ncols());
        for (correlation, variance) in self.correlations.iter().zip(noise).filter(|(_, variance)| *variance > 0.0) {
            scores += correlation.score_covariance(jacobian, &self.gaps) * variance;
        }
        let mut biases = scores.clone() * 0.0;
        for (factor, variance) in readings.roughness.factors.iter().zip(roughness) {
            let rows = factor.tr_mul(differences);
            biases += rows.tr_mul(&rows) * variance;
        }
        let information = jacobian.tr_mul(jacobian);
        let penalty = differences.tr_mul(differences) * readings.unit_weight.powi(2);
        let error = |weight: f64| -> Option<f64> {
            let square = weight.powi(2);
            let sum = &information + &penalty * square;
            let scales = sum.diagonal().map(|entry| if entry > 0.0 { 1.0 / entry.sqrt() } else { 0.0 });
            let scaling = DMatrix::from_diagonal(&scales);
            let mut scaled = &scaling * sum * &scaling;
            scaled.set_diagonal(&DVector::from_element(scales.len(), 1.0 + RIDGE));
            let inverse = &scaling * scaled.cholesky()?.inverse() * &scaling;
            let covariance =
                &inverse * (&scores + &biases * (square.powi(2) * readings.unit_weight.powi(2))) * &inverse;
            Some(covariance.diagonal().zip_map(spans, |error, span| error.min(largest.powi(2)) * span).sum())
        };
        let errors = weight_grid().into_iter().filter_map(|weight| Some((weight, error(weight)?)));
        errors.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(weight, _)| weight)
    }
}

/// Data and roughness in coordinates in which their sum at the reference weight is the identity and the roughness is
/// tridiagonal, so that every weight takes a time in proportion to the number of knots.
struct Tridiagonalised {
    diagonal: DVector<f64>,
    off_diagonal: DVector<f64>,
    score: DVector<f64>,
    /// Logarithm of the determinant of the sum at the reference weight.
    log_determinant: f64,
}

impl Tridiagonalised {
    fn of(information: &DMatrix<f64>, penalty: &DMatrix<f64>, score: &DVector<f64>) -> Option<Self> {
        let sum = information + penalty * REFERENCE_WEIGHT_SQUARED;
        let scales = sum.diagonal().map(|entry| 1.0 / entry.sqrt());
        let scaling = DMatrix::from_diagonal(&scales);
        let mut scaled = &scaling * sum * &scaling;
        scaled.set_diagonal(&DVector::from_element(scales.len(), 1.0 + RIDGE));
        let lower = scaled.cholesky()?.unpack();
        let log_scales: f64 = scales.iter().map(|scale| scale.ln()).sum();
        let log_lower: f64 = lower.diagonal().iter().map(|entry| entry.ln()).sum();
        let half = lower.solve_lower_triangular(&(&scaling * penalty * &scaling))?;
        let roughness = lower.solve_lower_triangular(&half.transpose())?;
        let score = lower.solve_lower_triangular(&score.component_mul(&scales))?;
        let log_determinant = 2.0 * (log_lower - log_scales);
        if score.len() < 2 {
            let off_diagonal = DVector::zeros(0);
            return Some(Self { diagonal: roughness.diagonal(), off_diagonal, score, log_determinant });
        }
        let (rotation, diagonal, off_diagonal) = roughness.symmetric_tridiagonalize().unpack();
        Some(Self { diagonal, off_diagonal, score: rotation.tr_mul(&score), log_determinant })
    }

    /// Logarithm of the determinant of data and roughness at a weight, and the square that the signal explains: the
    /// factors of a tridiagonal matrix.
    fn at(&self, weight: f64) -> (f64, f64) {
        // A direction without data has its roughness alone, which at the smallest weight is well above this.
        const LEAST_PIVOT: f64 = 1e-12;
        let change = weight.powi(2) - REFERENCE_WEIGHT_SQUARED;
        let (mut log, mut explained) = (self.log_determinant, 0.0);
        let (mut pivot, mut rest) = (1.0, 0.0);
        for knot in 0..self.score.len() {
            let beside = if knot > 0 { change * self.off_diagonal[knot - 1] } else { 0.0 };
            let factor = beside / pivot;
            rest = self.score[knot] - factor * rest;
            pivot = (1.0 + change * self.diagonal[knot] - factor * beside).max(LEAST_PIVOT);
            log += pivot.ln();
            explained += rest.powi(2) / pivot;
        }
        (log, explained)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Schedule;
    use crate::random::RandomStream;

    /// The logarithm of the restricted likelihood by dense matrices: readings and second differences have the
    /// covariance of the model, and contrasts of the readings that straight lines do not change have its density.
    fn dense(readings: &LinearizedReadings<'_>, model: &Model, correlation: &NoiseCorrelation) -> f64 {
        let (samples, knots) = readings.jacobian.shape();
        let times = &readings.traces[0];
        let noise = DMatrix::from_fn(samples, samples, |a, b| {
            let white = if a == b { correlation.white_fraction } else { 0.0 };
            let gap = (times[a] - times[b]).abs();
            let decay = if correlation.correlation_time > 0.0 {
                (-gap / correlation.correlation_time).exp()
            } else {
                f64::from(u8::from(a == b))
            };
            white + (1.0 - correlation.white_fraction) * decay
        });
        let factor = &readings.roughness.factors[model.walk];
        let differences = &readings.roughness.differences;
        let inverse = differences.clone().pseudo_inverse(1e-12).expect("an inverse");
        let effect = &readings.jacobian * inverse * factor / (model.weight * readings.unit_weight);
        let covariance = noise + &effect * effect.transpose();
        let lines = DMatrix::from_fn(knots, 2, |knot, power| if power == 0 { 1.0 } else { knot as f64 });
        let lines = &readings.jacobian * lines;
        let inverse = covariance.clone().cholesky().expect("definite").inverse();
        let information = lines.tr_mul(&inverse) * &lines;
        let score = lines.tr_mul(&inverse) * &readings.response;
        let squares = readings.response.dot(&(&inverse * &readings.response))
            - score.dot(&information.clone().cholesky().expect("definite").solve(&score));
        let log = |matrix: DMatrix<f64>| {
            2.0 * matrix.cholesky().expect("definite").l().diagonal().iter().map(|entry| entry.ln()).sum::<f64>()
        };
        -0.5 * (log(covariance) + log(information) + (samples - 2) as f64 * squares.ln()) + correlation.prior.ln()
    }

    #[test]
    fn probabilities_of_models_are_those_of_the_dense_restricted_likelihood() {
        let knots = Knots::new(&Schedule::constant(1.0), Some(0.0), 30.0, 9);
        let roughness = RoughnessModels::of(&knots);
        let mut random = RandomStream::new(4, 0);
        let jacobian = DMatrix::from_fn(30, knots.times_s.len(), |row, knot| {
            let since_s = row as f64 + 1.0 - knots.times_s[knot];
            if since_s > 0.0 { since_s * (-since_s / 4.0).exp() } else { 0.0 }
        });
        let truth = DVector::from_fn(knots.times_s.len(), |knot, _| 5.0 + (knot as f64).sin());
        let response = &jacobian * truth + DVector::from_fn(30, |_, _| random.normal());
        let traces: [Vec<f64>; 1] = [(1..=30).map(f64::from).collect()];
        let unit_weight = jacobian.norm() / roughness.differences.norm();
        let readings = LinearizedReadings { jacobian, response, traces: &traces, roughness: &roughness, unit_weight };
        let posterior = ModelPosterior::of(&readings);
        let (mut offsets, mut walks) = (Vec::new(), [0; 3]);
        for model in posterior.models.iter().step_by(23) {
            walks[model.walk] += 1;
            offsets.push(model.probability.ln() - dense(&readings, model, &posterior.correlations[model.noise]));
        }
        assert!(offsets.len() > 20 && walks.iter().all(|count| *count > 2), "{walks:?}");
        let off = offsets.iter().map(|offset| (offset - offsets[0]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5, "{off} in the logarithm");
    }
}
