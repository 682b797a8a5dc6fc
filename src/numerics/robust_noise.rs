//! Noise of a series of samples, without a model of the signal.

/// A standard deviation is so many median absolute deviations of normal noise.
pub(crate) const DEVIATION_PER_MAD: f64 = 1.482_602_218_505_602;

/// Standard deviation of the noise of samples: from the residuals of each sample from the line between its neighbours,
/// which a smooth signal does not have (Gasser, Sroka and Jennen-Steinmetz, Biometrika 73, 1986), by their median
/// absolute deviation. `None` of fewer than three samples. Times increase strictly.
pub(crate) fn noise_deviation(times: &[f64], values: &[f64]) -> Option<f64> {
    let residuals = times.windows(3).zip(values.windows(3)).map(|(times, values)| {
        let share = (times[2] - times[1]) / (times[2] - times[0]);
        let off = share * values[0] + (1.0 - share) * values[2] - values[1];
        (off / (share * share + (1.0 - share) * (1.0 - share) + 1.0).sqrt()).abs()
    });
    let residuals: Vec<f64> = residuals.collect();
    if residuals.is_empty() { None } else { Some(DEVIATION_PER_MAD * median(residuals)) }
}

/// The median, of an even number the upper one. At least one value.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::RandomStream;

    #[test]
    fn the_noise_of_a_ramp_is_that_of_its_samples_and_spikes_do_not_change_it() {
        let mut random = RandomStream::new(9, 0);
        let times: Vec<f64> = (0..4000).map(|index| 0.01 * f64::from(index) + 0.004 * random.uniform()).collect();
        let mut values: Vec<f64> = times.iter().map(|time| 300.0 + 40.0 * time + 2.0 * random.normal()).collect();
        let of = |values: &[f64]| noise_deviation(&times, values).expect("many samples");
        // The standard error of 4,000 samples is about 2 %.
        assert!((of(&values) / 2.0 - 1.0).abs() < 0.08, "{}", of(&values));
        values.iter_mut().step_by(50).for_each(|value| *value += 500.0);
        assert!((of(&values) / 2.0 - 1.0).abs() < 0.15, "{}", of(&values));
        assert_eq!(noise_deviation(&[0.0, 1.0], &[1.0, 2.0]), None);
    }
}
