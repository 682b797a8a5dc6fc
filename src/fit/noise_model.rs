//! Noise model of autocorrelated residuals, estimated together with the variables by restricted likelihood.
//!
//! The noise of each trace, in units of the stated standard deviations, is a stationary process of variance `s²` and
//! correlation
//!
//! ```text
//! (1 − η) exp(−|Δt|/τ) + η [Δt = 0]
//! ```
//!
//! an Ornstein-Uhlenbeck process with a fraction η of white noise; `s²`, τ and η are common to all traces. η = 1 is
//! white noise alone. The white fraction is needed: slow errors below white reading noise have a small lag-one
//! correlation, and a purely exponential model of them covers 45 to 85 % where 95 % are stated.
//!
//! A fit removes from the residuals the part that its variables can imitate, which is the slow part of the noise. The
//! restricted likelihood (REML: Patterson & Thompson, Biometrika 58, 1971) is that of the data projected off the
//! columns of the Jacobian X, so the fit does not bias it. With `s²` integrated over its prior 1/s², and P the
//! projection off X,
//!
//! ```text
//! L(τ, η) = |Σ|^(−1/2) |XᵀΣ⁻¹X|^(−1/2) (rᵀPr)^(−(n − p)/2),   s² = rᵀPr/(n − p)
//! ```
//!
//! Where a trace is only a few τ long, the likelihood of τ is flat over decades, so no single value is inserted:
//! intervals are quantiles of the mixture over (τ, η) of Student's t with n − p degrees of freedom, weighted by L and a
//! prior. The prior gives 75 % to white noise, 17 % to the purely exponential process and 8 % to their sum with η
//! uniform. τ has Jeffreys' prior of a first-order autoregression, `dρ/√(1 − ρ²)` with ρ = exp(−Δt/τ), which is proper
//! (Berger & Yang, Econom. Theory 10, 1994). It approaches the exact reference prior of such processes (Berger, De
//! Oliveira & Sansó, J. Am. Stat. Assoc. 96, 2001). The three probabilities were chosen by coverage: a larger one for
//! the sum makes intervals from 20 to 60 independent samples too wide (97 to 99 %), a smaller one makes those from
//! mixed noise too narrow.
//!
//! The estimates remain those of (weighted) least squares, whose covariance for this model is the sandwich
//! `(XᵀX)⁻¹ XᵀΣX (XᵀX)⁻¹ s²`. Generalised least squares are not used: residuals of real data are model error, and for a
//! long τ generalised least squares fit the differences of readings and ignore their level.

use super::interval::student_mixture_95;
use nalgebra::{DMatrix, DVector};

/// Probability of correlated noise from which it is warned of: that of the prior, so that the data speak for it. Of
/// data sets with white noise 5 % exceed it.
pub const WARNED_CORRELATION: f64 = 1.0 - WHITE_PRIOR;
/// Prior probabilities of white noise and of the purely exponential process; the remainder is that of their sum.
const WHITE_PRIOR: f64 = 0.75;
const EXPONENTIAL_PRIOR: f64 = 0.17;
/// The same for noise whose signal has nearly as many variables as samples, such as a heating history, in which slow
/// noise and signal are confounded: the likelihood of a few samples cannot make up for a prior for white noise. With
/// that of a fit, bands of gas temperatures from correlated noise near the face held 90 % of the knots and 85 % of the
/// integrals that are stated as 95 %. Coverage with this one stands in docs/theory/inference.md.
const HISTORY_WHITE_PRIOR: f64 = 0.1;
const HISTORY_EXPONENTIAL_PRIOR: f64 = 0.45;
/// White fractions of the grid, each with the width of the interval of the uniform η that it represents.
const WHITE_FRACTIONS: [(f64, f64); 8] =
    [(0.0, 0.025), (0.05, 0.075), (0.15, 0.125), (0.3, 0.175), (0.5, 0.2), (0.7, 0.175), (0.85, 0.125), (0.95, 0.1)];
/// Correlation times of the grid: from this fraction of the shortest gap between samples, below which the noise is
/// white, to this multiple of the longest trace, above which the process is a random walk; and the ratio of neighbours.
const SHORTEST_TIME_RATIO: f64 = 0.3;
const LONGEST_TIME_RATIO: f64 = 10.0;
const TIME_GRID_RATIO: f64 = 1.5;
/// A coarser grid, for models that are combined with models of the signal: every second correlation time, and every
/// second white fraction.
const COARSE_TIME_GRID_RATIO: f64 = 2.25;
const COARSE_WHITE_FRACTIONS: [(f64, f64); 4] = [(0.0, 0.1), (0.2, 0.25), (0.5, 0.35), (0.85, 0.3)];
/// Posterior probability below which a model is left out of mixtures: all such models together change no quantile by a
/// thousandth.
const NEGLIGIBLE_PROBABILITY: f64 = 1e-6;
/// Minimum conditional variance of a sample: simultaneous readings would have none.
const MIN_VARIANCE: f64 = 1e-12;

/// The noise of a fit: a mixture of all models with a non-negligible posterior probability.
#[derive(Clone, Debug)]
pub struct NoiseProcess {
    models: Vec<OrnsteinUhlenbeck>,
    /// Degrees of freedom of each variance: n − p.
    degrees_of_freedom: f64,
    gaps: Vec<Vec<f64>>,
}

/// One model of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrnsteinUhlenbeck {
    /// τ, in the unit of the abscissae; zero for white noise alone.
    pub correlation_time: f64,
    /// η.
    pub white_fraction: f64,
    /// Posterior probability of this model.
    pub probability: f64,
    /// s².
    pub variance: f64,
}

/// A correlation of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseCorrelation {
    /// τ, in the unit of the abscissae; zero for white noise alone.
    pub correlation_time: f64,
    /// η.
    pub white_fraction: f64,
    /// Prior probability.
    pub prior: f64,
}

/// `XᵀΣX` at unit variance for each model of a [`NoiseProcess`], in the same order: the covariance of the score Xᵀr.
#[derive(Clone, Debug)]
pub struct ScoreCovariances(Vec<DMatrix<f64>>);

impl NoiseProcess {
    /// Estimates the noise from residuals, their Jacobian, and the increasing abscissae of each trace. The residuals of
    /// the traces follow one another.
    pub fn estimate(residuals: &DVector<f64>, jacobian: &DMatrix<f64>, traces: &[Vec<f64>]) -> Self {
        let gaps = gaps(traces);
        let basis = column_basis(jacobian);
        let freedom = residuals.len() as f64 - basis.ncols() as f64;
        let mut columns = basis.insert_column(0, 0.0);
        columns.set_column(0, residuals);
        let grid = if freedom > 0.0 {
            model_grid(&gaps, TIME_GRID_RATIO, &WHITE_FRACTIONS, [WHITE_PRIOR, EXPONENTIAL_PRIOR])
        } else {
            vec![NoiseCorrelation::WHITE]
        };
        let weighed: Vec<(f64, OrnsteinUhlenbeck)> = grid
            .into_iter()
            .filter_map(|correlation| {
                let NoiseCorrelation { correlation_time, white_fraction, prior } = correlation;
                let (log, squares) = restricted_likelihood(&columns, &gaps, &correlation, freedom)?;
                let variance = if freedom > 0.0 { squares / freedom } else { f64::INFINITY };
                let model = OrnsteinUhlenbeck { correlation_time, white_fraction, probability: 0.0, variance };
                Some((log + prior.ln(), model))
            })
            .collect();
        let largest = weighed.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
        // Zero residuals give an infinite likelihood: exact data carry no information on noise.
        let weight = |log: f64| if largest.is_finite() { (log - largest).exp() } else { 0.0 };
        let sum: f64 = weighed.iter().map(|(log, _)| weight(*log)).sum();
        let models: Vec<OrnsteinUhlenbeck> = weighed
            .into_iter()
            .map(|(log, model)| OrnsteinUhlenbeck { probability: weight(log) / sum, ..model })
            .filter(|model| model.probability > NEGLIGIBLE_PROBABILITY)
            .collect();
        let variance = if residuals.norm() == 0.0 { 0.0 } else { f64::INFINITY };
        let exact = OrnsteinUhlenbeck { correlation_time: 0.0, white_fraction: 1.0, probability: 1.0, variance };
        Self { models: if models.is_empty() { vec![exact] } else { models }, degrees_of_freedom: freedom, gaps }
    }

    /// The most probable model.
    pub fn mode(&self) -> OrnsteinUhlenbeck {
        let most = self.models.iter().max_by(|a, b| a.probability.total_cmp(&b.probability));
        *most.expect("at least one model")
    }

    /// Probability that the noise is correlated: of all models but white noise.
    pub fn correlation_probability(&self) -> f64 {
        self.models.iter().filter(|model| model.white_fraction < 1.0).map(|model| model.probability).sum()
    }

    /// Covariance of the score `XᵀΔr` at unit variance for each model.
    pub fn score_covariances(&self, jacobian: &DMatrix<f64>) -> ScoreCovariances {
        let white = jacobian.tr_mul(jacobian);
        let mut last: Option<(f64, DMatrix<f64>)> = None;
        let mut covariance = |model: &OrnsteinUhlenbeck| {
            let cached = last.take().filter(|(time, _)| *time == model.correlation_time);
            let (time, correlated) = cached.unwrap_or_else(|| {
                (model.correlation_time, exponential_score_covariance(jacobian, &self.gaps, model.correlation_time))
            });
            let sum = &correlated * (1.0 - model.white_fraction) + &white * model.white_fraction;
            last = Some((time, correlated));
            sum
        };
        ScoreCovariances(self.models.iter().map(&mut covariance).collect())
    }

    /// Half-width of the 95 % interval of a quantity with this gradient in `XᵀΔr` and with additional normal variance
    /// `other_variance`: a quantile of the mixture. Infinite without degrees of freedom.
    pub fn half_width(&self, sums: &ScoreCovariances, gradient: &DVector<f64>, other_variance: f64) -> f64 {
        let square = |(model, sum): (&OrnsteinUhlenbeck, &DMatrix<f64>)| {
            (model.probability, model.variance * gradient.dot(&(sum * gradient)).max(0.0))
        };
        let parts: Vec<(f64, f64)> = self.models.iter().zip(&sums.0).map(square).collect();
        student_mixture_95(&parts, other_variance, self.degrees_of_freedom)
    }

    /// Variance inflation by autocorrelation, and the effective sample size. The first is the ratio of the noise
    /// variance along the columns of X to its average, for the most probable model; the second is the number of
    /// independent samples that would determine the variables as well, averaged over all models. `covariance` is
    /// (XᵀX)⁻¹.
    pub fn noise_inflation(&self, sums: &ScoreCovariances, covariance: &DMatrix<f64>, rank: usize) -> (f64, f64) {
        let samples = self.degrees_of_freedom + rank as f64;
        let inflation = |sum: &DMatrix<f64>| (covariance * sum).trace() / rank.max(1) as f64;
        let mode = self.mode();
        let each = || self.models.iter().zip(&sums.0);
        let mode_inflation = each().find(|(model, _)| **model == mode).map_or(1.0, |(_, sum)| inflation(sum));
        let effective = each().map(|(model, sum)| model.probability * samples / inflation(sum).max(1.0)).sum();
        (mode_inflation, effective)
    }
}

/// `XᵀΣX` of the exponential process at unit variance, summed over the rows of X in the order of time.
#[derive(Clone, Debug)]
pub(crate) struct ScoreSum {
    correlation_time: f64,
    /// Sum of the rows so far, each times its correlation with the last one.
    carried: Vec<f64>,
    /// Lower triangle, row by row.
    pub triangle: Vec<f64>,
}

impl ScoreSum {
    pub(crate) fn new(variables: usize, correlation_time: f64) -> Self {
        Self { correlation_time, carried: vec![0.0; variables], triangle: vec![0.0; variables * (variables + 1) / 2] }
    }

    /// Adds the row that comes a gap after the last one; infinite for an independent one.
    pub(crate) fn add(&mut self, gap: f64, row: &[f64]) {
        let correlation = exponential_correlation(gap, self.correlation_time);
        self.carried.iter_mut().for_each(|carried| *carried *= correlation);
        let mut entry = 0;
        for (i, &one) in row.iter().enumerate() {
            for (j, &other) in row[..=i].iter().enumerate() {
                self.triangle[entry] += one * other + (self.carried[i] * other + one * self.carried[j]);
                entry += 1;
            }
        }
        self.carried.iter_mut().zip(row).for_each(|(carried, value)| *carried += value);
    }
}

impl NoiseCorrelation {
    const WHITE: Self = Self { correlation_time: 0.0, white_fraction: 1.0, prior: 1.0 };

    /// A coarse grid for traces with these gaps, with the priors of a heating history.
    pub(crate) fn history_grid(gaps: &[Vec<f64>]) -> Vec<Self> {
        let priors = [HISTORY_WHITE_PRIOR, HISTORY_EXPONENTIAL_PRIOR];
        model_grid(gaps, COARSE_TIME_GRID_RATIO, &COARSE_WHITE_FRACTIONS, priors)
    }

    /// Columns multiplied by the inverse of a square root of Σ, and the logarithm of the determinant of Σ: the
    /// innovations of a scalar Kalman filter, with the same gains for every column, as they do not depend on the data.
    pub(crate) fn whitened(&self, columns: &DMatrix<f64>, gaps: &[Vec<f64>]) -> (DMatrix<f64>, f64) {
        let mut innovations = DMatrix::zeros(columns.nrows(), columns.ncols());
        let mut log_determinant = 0.0;
        let mut row = 0;
        for gaps in gaps {
            let stationary = 1.0 - self.white_fraction;
            let mut variance = stationary;
            let mut mean = columns.row(row) * 0.0;
            for step in 0..=gaps.len() {
                let total = (variance + self.white_fraction).max(MIN_VARIANCE);
                let innovation = columns.row(row) - &mean;
                innovations.set_row(row, &(&innovation / total.sqrt()));
                log_determinant += total.ln();
                row += 1;
                let Some(&gap) = gaps.get(step) else { break };
                let correlation = exponential_correlation(gap, self.correlation_time);
                let gain = variance / total;
                mean = (mean + innovation * gain) * correlation;
                variance = correlation * correlation * variance * (1.0 - gain)
                    + stationary * (1.0 - correlation * correlation);
            }
        }
        (innovations, log_determinant)
    }

    /// `XᵀΣX` at unit variance.
    pub(crate) fn score_covariance(&self, jacobian: &DMatrix<f64>, gaps: &[Vec<f64>]) -> DMatrix<f64> {
        let white = jacobian.tr_mul(jacobian) * self.white_fraction;
        if self.white_fraction == 1.0 {
            return white;
        }
        white + exponential_score_covariance(jacobian, gaps, self.correlation_time) * (1.0 - self.white_fraction)
    }
}

/// Gaps between the samples of each trace that has any.
pub(crate) fn gaps(traces: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let full = traces.iter().filter(|times| !times.is_empty());
    full.map(|times| times.windows(2).map(|pair| pair[1] - pair[0]).collect()).collect()
}

/// `XᵀΣX` of the exponential process at unit variance.
fn exponential_score_covariance(jacobian: &DMatrix<f64>, gaps: &[Vec<f64>], correlation_time: f64) -> DMatrix<f64> {
    let rows = jacobian.transpose();
    let mut rows = rows.column_iter();
    let mut sum = ScoreSum::new(jacobian.ncols(), correlation_time);
    for gaps in gaps {
        // The noise of a trace is independent of that of the one before.
        let steps = std::iter::once(f64::INFINITY).chain(gaps.iter().copied());
        steps.zip(rows.by_ref()).for_each(|(gap, row)| sum.add(gap, row.as_slice()));
    }
    let triangle = &sum.triangle;
    DMatrix::from_fn(jacobian.ncols(), jacobian.ncols(), |i, j| {
        let (row, column) = (i.max(j), i.min(j));
        triangle[row * (row + 1) / 2 + column]
    })
}

/// Correlation of two samples of the exponential process.
fn exponential_correlation(gap: f64, correlation_time: f64) -> f64 {
    if correlation_time > 0.0 { (-gap / correlation_time).exp() } else { 0.0 }
}

/// The model grid, with this ratio of neighbouring correlation times, these white fractions, and the prior
/// probabilities of white noise and of the purely exponential process.
fn model_grid(
    gaps: &[Vec<f64>],
    time_ratio: f64,
    white_fractions: &[(f64, f64)],
    [white, exponential]: [f64; 2],
) -> Vec<NoiseCorrelation> {
    let all = || gaps.iter().flatten().copied().filter(|gap| *gap > 0.0);
    let shortest = all().fold(f64::INFINITY, f64::min);
    let longest = gaps.iter().map(|gaps| gaps.iter().sum()).fold(0.0, f64::max);
    if !(shortest.is_finite() && longest > 0.0) {
        return vec![NoiseCorrelation::WHITE];
    }
    let steps =
        ((LONGEST_TIME_RATIO * longest / (SHORTEST_TIME_RATIO * shortest)).ln() / time_ratio.ln()).ceil() as i32;
    let times: Vec<f64> = (0..=steps).map(|step| SHORTEST_TIME_RATIO * shortest * time_ratio.powi(step)).collect();
    // Jeffreys' prior in ln τ: the square root of the Fisher information of all gaps, each ρ² (Δt/τ)²/(1 − ρ²).
    let density = |time: &f64| {
        let information = |gap: f64| (gap / time).powi(2) / (2.0 * gap / time).exp_m1();
        all().map(information).sum::<f64>().sqrt()
    };
    let densities: Vec<f64> = times.iter().map(density).collect();
    let sum: f64 = densities.iter().sum();
    let models = times.iter().zip(&densities).flat_map(|(&time, density)| {
        white_fractions.iter().map(move |&(white_fraction, width)| {
            let own = if white_fraction == 0.0 { exponential } else { 0.0 };
            let prior = (1.0 - white - exponential) * width + own;
            NoiseCorrelation { correlation_time: time, white_fraction, prior: prior * density / sum }
        })
    });
    std::iter::once(NoiseCorrelation { prior: white, ..NoiseCorrelation::WHITE }).chain(models).collect()
}

/// Logarithm of the restricted likelihood, and rᵀPr; the first column is r, the others are a basis of X.
fn restricted_likelihood(
    columns: &DMatrix<f64>,
    gaps: &[Vec<f64>],
    correlation: &NoiseCorrelation,
    freedom: f64,
) -> Option<(f64, f64)> {
    let (innovations, log_determinant) = correlation.whitened(columns, gaps);
    let basis = innovations.columns(1, columns.ncols() - 1);
    let cholesky = basis.tr_mul(&basis).cholesky()?;
    let with_basis = basis.tr_mul(&innovations.column(0));
    let squares = innovations.column(0).norm_squared() - with_basis.dot(&cholesky.solve(&with_basis));
    let log_basis = 2.0 * cholesky.l().diagonal().iter().map(|entry| entry.ln()).sum::<f64>();
    // The difference of squares can round to zero or below.
    let squares = squares.max(1e-14 * innovations.column(0).norm_squared());
    let log_squares = if freedom > 0.0 { freedom * squares.ln() } else { 0.0 };
    Some((-0.5 * (log_determinant + log_basis + log_squares), squares))
}

/// Orthonormal basis of the determined directions of a Jacobian.
fn column_basis(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let used: Vec<usize> = (0..lengths.len()).filter(|&j| lengths[j] > 0.0 && lengths[j].is_finite()).collect();
    let mut scaled = jacobian.select_columns(&used);
    used.iter().enumerate().for_each(|(index, &j)| scaled.column_mut(index).unscale_mut(lengths[j]));
    if used.is_empty() || scaled.nrows() < used.len() {
        // With no more samples than columns no degree of freedom is left, whatever the basis.
        return scaled.columns(0, used.len().min(scaled.nrows())).into_owned();
    }
    let decomposed = scaled.clone().qr();
    let (q, r) = (decomposed.q(), decomposed.r());
    let Some(svd) = r.try_svd(true, false, f64::EPSILON, 10_000) else { return scaled };
    let Some(u) = svd.u else { return scaled };
    let floor = super::identifiability::RANK_TOLERANCE * svd.singular_values.max();
    let determined: Vec<usize> = (0..used.len()).filter(|&k| svd.singular_values[k] > floor).collect();
    q * u.select_columns(&determined)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two traces of three and four samples, whose noise is independent.
    #[test]
    fn the_score_covariance_is_that_of_the_correlation_matrix_of_all_traces() {
        let traces = [vec![0.0, 1.0, 3.0], vec![0.0, 0.5, 2.0, 2.5]];
        let samples: Vec<(usize, f64)> =
            [0, 1].into_iter().flat_map(|trace: usize| traces[trace].iter().map(move |&time| (trace, time))).collect();
        let jacobian = DMatrix::from_fn(7, 2, |i, j| ((3 * i + 5 * j) % 7) as f64 - 2.0);
        let correlation = DMatrix::from_fn(7, 7, |i, j| {
            let ((trace, time), (other, then)) = (samples[i], samples[j]);
            if trace == other { f64::exp(-(time - then).abs() / 2.0) } else { 0.0 }
        });
        let expected = jacobian.tr_mul(&(correlation * &jacobian));
        let found = exponential_score_covariance(&jacobian, &gaps(&traces), 2.0);
        assert!((&found - &expected).norm() < 1e-12 * expected.norm(), "{found} {expected}");
    }
}
