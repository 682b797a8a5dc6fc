//! How wrong the model may be, told by what the fit leaves, and carried to where nothing was measured.
//!
//! Residuals that are larger than the readings' own deviations, and follow one another, are no noise: the model lacks
//! something, and factors cannot make up for it. In the posterior of the factors this weighs as it does in their intervals,
//! by the effective number of samples. A band of a thermocouple has to say it too, or it would say how well the factors are
//! known and pass for how well the temperature is.
//!
//! What the model lacks is taken as an error that keeps for a time, `δ(t) = ε g(t) e(t)`, with e of mean zero, deviation one
//! and correlation exp(−|Δt|/τ), a process of its own at each sensor (Kennedy & O'Hagan, J. R. Stat. Soc. B 63, 2001, of
//! discrepancies as processes; the exponential is the one whose samples are the first-order autoregression that intervals
//! take residuals for). Its two numbers come from the fit: τ is that of the most probable noise model, and ε comes
//! from the variance that the noise has beyond the readings' own.
//!
//! The gain g is what the discrepancy is worth at a sensor and an instant, K: the root sum of squares of what one standard
//! deviation of each factor of the case moves it, fitted or not. A discrepancy of as many kelvin everywhere, the plain choice,
//! would doubt a face that is held at its measured temperature as much as the bondline, and the first second as much
//! as the last; one in proportion to the rise would doubt the face most. Errors of a model come from its properties and
//! boundaries, of which factors are the list that the analyst made, and grow as their effects do: nothing at a held face, more
//! with depth, nothing before heat arrives. So ε reads: what the model lacks is worth as much as an error of its factors by ε of
//! what they are doubted by, which changes with time and cannot be fitted away. Gains are slopes, and where a temperature has hardly left
//! the coldest that it meets a slope reaches below: a draw ends there. A discrepancy that multiplies the rise would too, but has no
//! sense where a rise passes zero, in a layup that cools below its start. What none of the factors resembles is beyond
//! it, and beyond any discrepancy that is carried from one sensor to another.

use super::super::estimate::Estimated;
use super::super::sensitivity::{Sensitivity, sensitivity};
use super::super::thermocouples::Sample;
use crate::case::Case;
use crate::chance::Numbers;
use crate::march::{March, MarchError};
use crate::plan::Plan;

/// An error of the model that keeps for a time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Discrepancy {
    /// ε: its deviation in units of the gain.
    pub share: f64,
    /// Root mean square of its deviation over the samples fitted, K.
    pub amplitude_k: f64,
    /// τ: the time after which it has forgotten all but 1/e of itself, s; infinite where it keeps.
    pub time_s: f64,
}

impl Discrepancy {
    /// From an estimate, the samples it was fitted to, and the gains at these: case × sensor × instant.
    pub(super) fn of(found: &Estimated, observed: &[Vec<Sample>], gains_k: &[Vec<Vec<f64>>]) -> Self {
        let excess = (found.noise_variance - 1.0).max(0.0);
        let each = || observed.iter().enumerate().flat_map(|(case, samples)| samples.iter().map(move |s| (case, s)));
        let count = each().count() as f64;
        let variance_k2 = excess * each().map(|(_, s)| s.sigma_k.powi(2)).sum::<f64>() / count;
        let gain_k2 = each().map(|(case, s)| gains_k[case][s.sensor][s.instant].powi(2)).sum::<f64>() / count;
        let share = if gain_k2 > 0.0 { (variance_k2 / gain_k2).sqrt() } else { 0.0 };

        Self { share, amplitude_k: variance_k2.sqrt(), time_s: found.correlation_time_s }
    }

    /// A drawn discrepancy over instants of these gains, K.
    pub(super) fn drawn_k(self, gains_k: &[f64], instants_s: &[f64], numbers: &mut Numbers) -> Vec<f64> {
        let mut now = numbers.normal();
        let mut before_s = instants_s.first().copied().unwrap_or(0.0);
        let each = instants_s.iter().zip(gains_k).map(|(&time_s, gain_k)| {
            let kept = (-(time_s - before_s) / self.time_s).exp();
            // At a time of nought nothing is kept, but for the first instant, which is no time after itself.
            let kept = if kept.is_nan() { 1.0 } else { kept };
            now = kept * now + (1.0 - kept * kept).sqrt() * numbers.normal();
            before_s = time_s;
            self.share * gain_k * now
        });
        each.collect()
    }
}

/// What one standard deviation of every factor of a case, together, moves each sensor at each instant about the estimate,
/// K: sensor × instant; and the members that it took.
///
/// # Errors
/// When the device fails.
pub(super) fn gains_k(
    (case, plan): (&Case, &Plan),
    which: usize,
    found: &Estimated,
    march: &mut dyn March,
) -> Result<(Vec<Vec<f64>>, usize), MarchError> {
    let mut case = case.clone();
    for (estimand, &value) in found.factors.iter().zip(&found.values) {
        if let Some(place) = estimand.places[which] {
            case.factors[place].nominal = value;
        }
    }
    let Sensitivity { derivatives_k, marches, .. } = sensitivity(&case, plan, march, None)?;
    let deviations: Vec<f64> = case.factors.iter().map(|factor| factor.deviation(case.estimate.bounds)).collect();
    let gain_k = |sensor: usize, instant: usize| {
        let moved_k = |(of_factor, deviation): (&Vec<Vec<f64>>, &f64)| deviation * of_factor[sensor][instant];
        let moves_k = derivatives_k.iter().zip(&deviations).map(moved_k).filter(|moved_k| moved_k.is_finite());
        moves_k.map(|moved_k| moved_k * moved_k).sum::<f64>().sqrt()
    };
    let instants = plan.instants_s.len();
    let of = |sensor: usize| (0..instants).map(|instant| gain_k(sensor, instant)).collect();
    Ok(((0..case.sensors.len()).map(of).collect(), marches))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over ten thousand draws: deviation ε g, and a correlation of exp(−Δt/τ); four standard errors.
    #[test]
    fn a_drawn_discrepancy_has_the_amplitude_and_the_memory_it_says() {
        let discrepancy = Discrepancy { share: 0.5, amplitude_k: 3.0, time_s: 20.0 };
        let (instants_s, gains_k) = ([0.0, 5.0, 25.0], [0.0, 4.0, 8.0]);
        let drawn: Vec<Vec<f64>> =
            (0..10_000).map(|draw| discrepancy.drawn_k(&gains_k, &instants_s, &mut Numbers::of(1, draw))).collect();
        let moment = |i: usize, j: usize| drawn.iter().map(|d| d[i] * d[j]).sum::<f64>() / 1e4;
        assert_eq!(moment(0, 0), 0.0);
        assert!((moment(1, 1) / 4.0 - 1.0).abs() < 0.06 && (moment(2, 2) / 16.0 - 1.0).abs() < 0.06);
        assert!((moment(1, 2) / 8.0 - (-1f64).exp()).abs() < 0.04);
        let steady = Discrepancy { time_s: f64::INFINITY, ..discrepancy };
        let kept = steady.drawn_k(&[1.0; 3], &instants_s, &mut Numbers::of(1, 1));
        assert!(kept[0] == kept[1] && kept[1] == kept[2]);
    }
}
