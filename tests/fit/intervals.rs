//! Coverage of intervals with autocorrelated residuals, over many synthetic data sets.

use super::exact;
use crate::support::Uniform;
use bondline::fit::interval::{residual_variance, student_95};
use bondline::fit::{Fit, LinearizedPosterior, NoiseProcess, covariance_summary, minimize};
use nalgebra::DVector;

const SAMPLES: usize = 81;
const SETS: usize = 400;

/// A sigmoid, a bump and a parabola, as slow as the sensitivities of a thermocouple.
fn slopes(i: usize) -> [f64; 3] {
    let t = i as f64 / (SAMPLES - 1) as f64;
    [1.0 / (1.0 + (-12.0 * (t - 0.5)).exp()), (-((t - 0.6) / 0.2).powi(2)).exp(), t * t]
}

/// Noise of unit variance: a first-order autoregression with a white fraction, approximately normal (sums of twelve
/// uniform numbers).
fn noise(random: &mut Uniform, autocorrelation: f64, white: f64) -> Vec<f64> {
    let mut normal = || (0..12).map(|_| random.next()).sum::<f64>() - 6.0;
    let mut slow = normal();
    let mut next = || {
        let value = (1.0 - white).sqrt() * slow + white.sqrt() * normal();
        slow = autocorrelation * slow + (1.0 - autocorrelation.powi(2)).sqrt() * normal();
        value
    };
    (0..SAMPLES).map(|_| next()).collect()
}

/// A fit to noise about a truth of (1, 1, 1).
fn fitted(noise: Vec<f64>) -> Fit {
    let residuals = move |point: &[f64]| {
        let error = |i: usize| slopes(i).iter().zip(point).map(|(slope, value)| slope * (value - 1.0)).sum::<f64>();
        (0..SAMPLES).map(|i| error(i) - noise[i]).collect()
    };
    let mut problem = super::Problem { bounds: vec![(-99.0, 99.0); 3], residuals, evaluations: 0 };
    let Ok(fit) = minimize(&mut problem, &DVector::from_element(3, 0.5), &exact());
    fit
}

/// Fraction of data sets whose intervals contain the truth, per variable.
fn coverage(autocorrelation: f64, white: f64, half_widths: impl Fn(&Fit) -> Vec<f64>) -> [f64; 3] {
    let mut random = Uniform(2026);
    let mut coverage = [0.0; 3];
    for _ in 0..SETS {
        let fit = fitted(noise(&mut random, autocorrelation, white));
        for (variable, half) in half_widths(&fit).iter().enumerate() {
            let contains = (fit.point[variable] - 1.0).abs() < *half;
            coverage[variable] += f64::from(u8::from(contains)) / SETS as f64;
        }
    }
    coverage
}

fn by_noise_model(fit: &Fit) -> Vec<f64> {
    let times = (0..SAMPLES).map(|i| i as f64).collect();
    let noise = NoiseProcess::estimate(&fit.residuals, &fit.jacobian, &[times]);
    LinearizedPosterior::new(&fit.jacobian, &[], 1.0, &noise, &DVector::zeros(SAMPLES)).half_widths()
}

fn as_if_independent(fit: &Fit) -> Vec<f64> {
    let variance = residual_variance(fit.objective, SAMPLES, 3);
    let errors = covariance_summary(&fit.jacobian, variance).standard_errors;
    errors.iter().map(|error| student_95((SAMPLES - 3) as f64) * error).collect()
}

/// A coverage of 95 % over 400 sets has a standard error of 1.1 %; the limits are two and a half of these.
#[test]
fn intervals_have_95_percent_coverage_at_every_autocorrelation() {
    for (autocorrelation, white) in [(0.0, 0.0), (0.5, 0.0), (0.8, 0.0), (0.9, 0.0), (0.8, 0.3)] {
        for found in coverage(autocorrelation, white, by_noise_model) {
            assert!((0.92..=0.98).contains(&found), "{autocorrelation}, white {white}: coverage {found}");
        }
    }
}

#[test]
fn intervals_for_independent_residuals_have_too_low_coverage() {
    let found = coverage(0.8, 0.0, as_if_independent);
    assert!(found.iter().all(|&share| share < 0.7), "{found:?}");
}

/// Three samples leave no degree of freedom for three variables. Exact data have none of noise.
#[test]
fn intervals_are_infinite_without_degrees_of_freedom_and_zero_for_exact_data() {
    let jacobian = nalgebra::DMatrix::from_fn(3, 3, |i, j| slopes(30 * i + 5)[j]);
    let half = |jacobian: &nalgebra::DMatrix<f64>, residuals: DVector<f64>| {
        let samples = residuals.len();
        let noise = NoiseProcess::estimate(&residuals, jacobian, &[(0..samples).map(|i| i as f64).collect()]);
        LinearizedPosterior::new(jacobian, &[], 1.0, &noise, &DVector::zeros(samples)).half_widths()
    };
    assert_eq!(half(&jacobian, DVector::from_element(3, 0.1)), [f64::INFINITY; 3]);
    let many = nalgebra::DMatrix::from_fn(SAMPLES, 3, |i, j| slopes(i)[j]);
    assert_eq!(half(&many, DVector::zeros(SAMPLES)), [0.0; 3]);
}
