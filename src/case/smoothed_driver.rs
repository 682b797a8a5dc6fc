//! A measured temperature that drives a held face, smoothed within its noise.

use super::table::Schedule;
use crate::numerics::robust_noise::noise_deviation;
use crate::numerics::smoothing_spline::{polygon, smoothing_spline};

/// The polygon that replaces the smoothing spline is within this share of the noise of it.
const POLYGON_SHARE: f64 = 0.05;

/// The temperature of a held face as measured, and how it was smoothed.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct SmoothedDriver {
    /// Whether it drives the hot face; else the back face.
    pub is_hot_face: bool,
    /// Stated standard deviation of the noise, K.
    pub noise_k: f64,
    /// Noise of the samples, estimated without a model of the signal, K; `None` of fewer than three samples.
    pub estimated_noise_k: Option<f64>,
    /// The schedule as measured, K.
    pub measured: Schedule,
    /// Number of samples.
    pub samples: usize,
    /// Root mean square of measured minus smoothed, K.
    pub residual_k: f64,
    /// Corners of the smoothed schedule.
    pub corners: usize,
    /// Times at which the smoothed schedule has a step of the data, s.
    pub steps_s: Vec<f64>,
}

/// Times, s, and values, K, of a smoothed schedule.
pub(super) struct SmoothedSeries {
    pub(super) series: (Vec<f64>, Vec<f64>),
    pub(super) residual_k: f64,
    pub(super) estimated_noise_k: Option<f64>,
    pub(super) steps_s: Vec<f64>,
}

/// Smooth samples within their noise. Between equal times the data jump: the parts beside are smoothed alone.
pub(super) fn smoothed(times_s: &[f64], values_k: &[f64], noise_k: f64) -> SmoothedSeries {
    let (mut series, mut steps_s, mut squares) = ((Vec::new(), Vec::new()), Vec::new(), 0.0);
    let mut estimated_noise_k: Option<f64> = None;
    let jumps = (1..times_s.len()).filter(|&index| times_s[index] == times_s[index - 1]);
    let ends: Vec<usize> = jumps.chain([times_s.len()]).collect();
    let mut start = 0;
    for end in ends {
        let part_s = &times_s[start..end];
        let spline = smoothing_spline(part_s, &values_k[start..end], noise_k);
        for index in polygon(part_s, &spline.values, POLYGON_SHARE * noise_k) {
            series.0.push(part_s[index]);
            series.1.push(spline.values[index]);
        }
        let noise_k = noise_deviation(part_s, &values_k[start..end]);
        estimated_noise_k = [estimated_noise_k, noise_k].into_iter().flatten().reduce(f64::max);
        squares += spline.residual * spline.residual * part_s.len() as f64;
        steps_s.extend(spline.corners.iter().map(|&index| part_s[index]));
        start = end;
    }
    let residual_k = (squares / times_s.len() as f64).sqrt();
    SmoothedSeries { series, residual_k, estimated_noise_k, steps_s }
}
