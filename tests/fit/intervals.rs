//! Intervals when residuals follow each other, over many data sets whose truth is known.

use super::exact;
use crate::support::Uniform;
use bondline::fit::interval::{residual_variance, student_95};
use bondline::fit::{Fit, LinearizedPosterior, NoiseProcess, certainty, minimize};
use nalgebra::DVector;

const SAMPLES: usize = 81;
const SETS: usize = 400;

/// A rise, a bump and a parabola, as slow as the sensitivities of a thermocouple.
fn slopes(i: usize) -> [f64; 3] {
    let t = i as f64 / (SAMPLES - 1) as f64;
    [1.0 / (1.0 + (-12.0 * (t - 0.5)).exp()), (-((t - 0.6) / 0.2).powi(2)).exp(), t * t]
}

/// Noise of one, a first-order autoregression with a white share; normal by the sum of twelve even numbers.
fn noise(random: &mut Uniform, autocorrelation: f64, white: f64) -> Vec<f64> {
    let mut normal = || (0..12).map(|_| random.next()).sum::<f64>() - 6.0;
    let mut slow = normal();
    let mut next = || {
        let here = (1.0 - white).sqrt() * slow + white.sqrt() * normal();
        slow = autocorrelation * slow + (1.0 - autocorrelation.powi(2)).sqrt() * normal();
        here
    };
    (0..SAMPLES).map(|_| next()).collect()
}

/// The fit of a truth of (1, 1, 1) in noise.
fn fitted(noise: Vec<f64>) -> Fit {
    let residuals = move |point: &[f64]| {
        let off = |i: usize| slopes(i).iter().zip(point).map(|(slope, value)| slope * (value - 1.0)).sum::<f64>();
        (0..SAMPLES).map(|i| off(i) - noise[i]).collect()
    };
    let mut problem = super::Problem { bounds: vec![(-99.0, 99.0); 3], residuals, asked: 0 };
    let Ok(fit) = minimize(&mut problem, &DVector::from_element(3, 0.5), &exact());
    fit
}

/// The share of data sets whose intervals of these half-widths hold the truth, of each of the three variables.
fn coverage(autocorrelation: f64, white: f64, half_widths: impl Fn(&Fit) -> Vec<f64>) -> [f64; 3] {
    let mut random = Uniform(2026);
    let mut held = [0.0; 3];
    for _ in 0..SETS {
        let fit = fitted(noise(&mut random, autocorrelation, white));
        for (place, half) in half_widths(&fit).iter().enumerate() {
            let is_held = (fit.point[place] - 1.0).abs() < *half;
            held[place] += f64::from(u8::from(is_held)) / SETS as f64;
        }
    }
    held
}

fn by_noise_model(fit: &Fit) -> Vec<f64> {
    let times = (0..SAMPLES).map(|i| i as f64).collect();
    let noise = NoiseProcess::estimate(&fit.residuals, &fit.jacobian, &[times]);
    LinearizedPosterior::new(&fit.jacobian, &[], 1.0, &noise, &DVector::zeros(SAMPLES)).half_widths()
}

fn as_if_independent(fit: &Fit) -> Vec<f64> {
    let variance = residual_variance(fit.objective, SAMPLES, 3);
    let errors = certainty(&fit.jacobian, variance).standard_errors;
    errors.iter().map(|error| student_95((SAMPLES - 3) as f64) * error).collect()
}

/// A share of 95 % of 400 sets is uncertain by 1.1 in a hundred; the limits leave two and a half of that.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say_however_far_the_noise_follows_itself() {
    for (autocorrelation, white) in [(0.0, 0.0), (0.5, 0.0), (0.8, 0.0), (0.9, 0.0), (0.8, 0.3)] {
        for found in coverage(autocorrelation, white, by_noise_model) {
            assert!(
                (0.92..=0.98).contains(&found),
                "{autocorrelation}, white {white}: {found} of the intervals hold it"
            );
        }
    }
}

#[test]
fn intervals_of_residuals_taken_as_independent_hold_it_too_seldom() {
    let found = coverage(0.8, 0.0, as_if_independent);
    assert!(found.iter().all(|&share| share < 0.7), "{found:?}");
}

/// Three samples determine three variables: no residual is left to judge by. Exact data leave none either, and no error.
#[test]
fn without_a_sample_to_spare_nothing_is_known_and_exact_data_have_no_noise() {
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
