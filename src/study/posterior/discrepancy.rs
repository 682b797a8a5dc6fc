//! Model discrepancy, estimated from the residuals of the fit and extrapolated to unobserved temperatures.
//!
//! Residuals that exceed the measurement noise and are autocorrelated show a model error that no factor can remove. The
//! posterior of the factors accounts for it through the effective sample size. A predictive band must include it
//! explicitly, or it would show the uncertainty of the factors instead of that of the temperature.
//!
//! The discrepancy is a stochastic process `δ(t) = ε g(t) e(t)`, independent at each sensor, where e has mean zero,
//! standard deviation one and correlation exp(−|Δt|/τ) (Kennedy & O'Hagan, J. R. Stat. Soc. B 63, 2001). The
//! exponential correlation is that of the first-order autoregression that the intervals assume. τ is the correlation
//! time of the most probable noise model, and ε follows from the variance of the residuals beyond the measurement
//! noise.
//!
//! The gain g, K, is the root sum of squares of the temperature changes due to one standard deviation of each factor of
//! the case, estimated or not. A discrepancy constant in kelvin would give a face held at its measured temperature the
//! same uncertainty as the bondline, and the first second the same as the last; one proportional to the temperature
//! rise would give the held face the largest. Model errors come from properties and boundary conditions, which the
//! factors represent, and they scale with the effects of these: zero at a held face and before heat arrives, rising
//! with depth. So ε is the model error in units of the prior uncertainty of the factors.
//!
//! Gains are slopes, so near the lowest possible temperature a normal draw may fall below it; draws are limited there.
//! A discrepancy proportional to the temperature rise would need no limit, but is undefined where the rise crosses
//! zero, in a layup that cools below its start. A model error that resembles no factor is beyond this model, and beyond
//! any discrepancy transferred between sensors.

use super::super::estimate::ParameterEstimates;
use super::super::sensitivity::{Sensitivity, sensitivity};
use super::super::thermocouple_residuals::Sample;
use crate::case::Case;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use crate::random::RandomStream;

/// The parameters of the discrepancy process.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Discrepancy {
    /// ε: standard deviation in units of the gain.
    pub share: f64,
    /// Root mean square of its standard deviation over the fitted samples, K.
    pub amplitude_k: f64,
    /// τ: correlation time, s; infinite for a constant discrepancy.
    pub time_s: f64,
}

impl Discrepancy {
    /// From an estimate, its fitted samples, and the gains: case × sensor × instant.
    pub(super) fn of(found: &ParameterEstimates, observed: &[Vec<Sample>], gains_k: &[Vec<Vec<f64>>]) -> Self {
        let excess = (found.noise_variance - 1.0).max(0.0);
        let each = || observed.iter().enumerate().flat_map(|(case, samples)| samples.iter().map(move |s| (case, s)));
        let count = each().count() as f64;
        let variance_k2 = excess * each().map(|(_, s)| s.sigma_k.powi(2)).sum::<f64>() / count;
        let gain_k2 = each().map(|(case, s)| gains_k[case][s.sensor][s.instant].powi(2)).sum::<f64>() / count;
        let share = if gain_k2 > 0.0 { (variance_k2 / gain_k2).sqrt() } else { 0.0 };

        Self { share, amplitude_k: variance_k2.sqrt(), time_s: found.correlation_time_s }
    }

    /// A random realisation at these instants, K.
    pub(super) fn sample_k(self, gains_k: &[f64], instants_s: &[f64], numbers: &mut RandomStream) -> Vec<f64> {
        let mut now = numbers.normal();
        let mut before_s = instants_s.first().copied().unwrap_or(0.0);
        let each = instants_s.iter().zip(gains_k).map(|(&time_s, gain_k)| {
            let kept = (-(time_s - before_s) / self.time_s).exp();
            // A correlation time of zero gives NaN at the first instant, where Δt is zero too.
            let kept = if kept.is_nan() { 1.0 } else { kept };
            now = kept * now + (1.0 - kept * kept).sqrt() * numbers.normal();
            before_s = time_s;
            self.share * gain_k * now
        });
        each.collect()
    }
}

/// Root sum of squares of the temperature changes due to one standard deviation of each factor, at the estimate, K:
/// sensor × instant; and the number of members marched.
///
/// # Errors
/// When the device fails.
pub(super) fn gains_k(
    (case, plan): (&Case, &Plan),
    which: usize,
    found: &ParameterEstimates,
    march: &mut dyn March,
) -> Result<(Vec<Vec<f64>>, usize), MarchError> {
    let deviations: Vec<f64> =
        case.factors.iter().map(|factor| factor.prior_standard_deviation(case.estimate.bounds)).collect();
    let mut case = case.clone();
    for (estimand, &value) in found.factors.iter().zip(&found.values) {
        if let Some(place) = estimand.factor_indices[which] {
            case.factors[place].nominal = value;
        }
    }
    let Sensitivity { derivatives_k, marches, .. } = sensitivity(&case, plan, march, None)?;
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

    /// Ten thousand draws: standard deviation ε g and correlation exp(−Δt/τ), within four standard errors.
    #[test]
    fn a_drawn_discrepancy_has_its_amplitude_and_correlation_time() {
        let discrepancy = Discrepancy { share: 0.5, amplitude_k: 3.0, time_s: 20.0 };
        let (instants_s, gains_k) = ([0.0, 5.0, 25.0], [0.0, 4.0, 8.0]);
        let drawn: Vec<Vec<f64>> = (0..10_000)
            .map(|draw| discrepancy.sample_k(&gains_k, &instants_s, &mut RandomStream::new(1, draw)))
            .collect();
        let moment = |i: usize, j: usize| drawn.iter().map(|d| d[i] * d[j]).sum::<f64>() / 1e4;
        assert_eq!(moment(0, 0), 0.0);
        assert!((moment(1, 1) / 4.0 - 1.0).abs() < 0.06 && (moment(2, 2) / 16.0 - 1.0).abs() < 0.06);
        assert!((moment(1, 2) / 8.0 - (-1f64).exp()).abs() < 0.04);
        let steady = Discrepancy { time_s: f64::INFINITY, ..discrepancy };
        let kept = steady.sample_k(&[1.0; 3], &instants_s, &mut RandomStream::new(1, 1));
        assert!(kept[0] == kept[1] && kept[1] == kept[2]);
    }
}
