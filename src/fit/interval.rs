//! From residuals to confidence intervals, when the residuals follow each other.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// `s² = S/(n − p)`: the variance of the residuals of a fit of `variables` to `samples`; infinite where no sample is
/// left over.
pub fn residual_variance(objective: f64, samples: usize, variables: usize) -> f64 {
    if samples > variables { objective / (samples - variables) as f64 } else { f64::INFINITY }
}

/// Lag-one autocorrelation of residuals, `Σ rᵢ rᵢ₊₁ / Σ rᵢ²`, the sums running over each trace by itself. The mean is
/// not taken off: a bias of the prediction is the most persistent residual there is. Zero where there are none.
pub fn lag_one(traces: &[Vec<f64>]) -> f64 {
    let products: f64 = traces.iter().flat_map(|trace| trace.windows(2)).map(|pair| pair[0] * pair[1]).sum();
    let squares: f64 = traces.iter().flatten().map(|residual| residual.powi(2)).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// The autocorrelation of noise, of which a fit of `variables` left residuals of this lag-one autocorrelation.
///
/// Derivatives change slowly from sample to sample, and so a fit takes the slow part of the noise: of its n σ² each variable
/// takes `K σ²`, `K = (1 + ρ)/(1 − ρ)` being how much stronger the noise is there than on average. Products of neighbours
/// lose as much, as what is taken is slow. What is left correlates by `λ = (n ρ − p K)/(n − p K)`, less than the noise did,
/// which is solved for ρ. Not beyond where the fit would have taken half of the noise: there what is left tells nothing
/// of what was.
pub fn noise_autocorrelation(residual: f64, samples: usize, variables: usize) -> f64 {
    let (n, p) = (samples as f64, variables as f64);
    let residual = residual.clamp(0.0, 1.0);
    let most = residual.max((n - 2.0 * p) / (n + 2.0 * p));
    let mut noise = residual;
    // Each turn comes nearer from below; the limit is one that nothing meets but what is cut off above.
    for _ in 0..1000 {
        let found = (residual + (1.0 - residual) * p / n * (1.0 + noise) / (1.0 - noise)).min(most);
        let is_settled = found - noise <= 1e-12;
        noise = found;
        if is_settled || noise >= 1.0 {
            break;
        }
    }
    noise
}

/// By how much the variance of estimates exceeds the one of independent residuals: the noise is `n/nₑ` times as strong
/// where derivatives see it, and stronger on the whole than its residuals by `(n − p)/(n − p n/nₑ)`, of which what is
/// below is no less than half of n.
pub fn inflation(samples: usize, variables: usize, noise_autocorrelation: f64) -> f64 {
    let (n, p) = (samples as f64, variables as f64);
    let strength = n / effective_samples(samples, noise_autocorrelation);
    strength * ((n - p) / (n - p * strength).max(n / 2.0)).max(1.0)
}

/// How many independent samples are as good as these: `n (1 − r)/(1 + r)` for residuals of a first-order
/// autoregression (Bartlett, J. R. Stat. Soc. 98, 1935). A negative autocorrelation is not taken to add any, and no
/// autocorrelation leaves less than one.
pub fn effective_samples(samples: usize, autocorrelation: f64) -> f64 {
    let r = autocorrelation.clamp(0.0, 1.0);
    (samples as f64 * (1.0 - r) / (1.0 + r)).max(1.0)
}

/// Half the width of a 95 % confidence interval in standard errors: Student's t at 97.5 %; infinite without degrees of
/// freedom, and where it would be above a million.
pub fn student_95(freedom: f64) -> f64 {
    const LARGEST: f64 = 1e6;
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return f64::INFINITY };
    if student.cdf(LARGEST) < 0.975 {
        return f64::INFINITY;
    }
    // By halving, since the inverse that statrs has does not return for some degrees and is wrong above 10⁴ of them.
    let (mut low, mut high) = (0.0, LARGEST);
    while high - low > 1e-10 * high {
        let middle = (low + high) / 2.0;
        if student.cdf(middle) < 0.975 { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn students_factors_are_those_of_the_tables() {
        // Two-sided 5 % points: 1, 5, 10, 30 and 120 degrees.
        for (freedom, factor) in [(1.0, 12.706), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980)] {
            assert!((student_95(freedom) - factor).abs() < 6e-4, "{freedom}: {}", student_95(freedom));
        }
        assert!((student_95(1e6) - 1.959_966).abs() < 1e-5);
        assert_eq!([0.01, 0.0, -3.0].map(student_95), [f64::INFINITY; 3]);
    }

    #[test]
    fn residuals_that_follow_each_other_are_worth_fewer_samples() {
        let steady = vec![vec![2.0; 50], vec![-1.0; 50]];
        assert!(lag_one(&steady) > 0.97);
        assert!(effective_samples(100, lag_one(&steady)) < 2.0);
        let alternating = vec![(0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect()];
        assert!(lag_one(&alternating) < -0.98);
        assert_eq!(effective_samples(100, lag_one(&alternating)), 100.0);
        assert_eq!((lag_one(&[]), effective_samples(100, 1.0)), (0.0, 1.0));
    }

    #[test]
    fn traces_are_not_joined_end_to_end() {
        assert_eq!(lag_one(&[vec![1.0], vec![1.0]]), 0.0);
        assert_eq!(lag_one(&[vec![1.0, 1.0]]), 0.5);
    }

    /// r = 0.5: an autoregression of 100 samples is worth 33.
    #[test]
    fn half_correlated_samples_count_a_third() {
        assert!((effective_samples(99, 0.5) - 33.0).abs() < 1e-12);
        assert_eq!(residual_variance(12.0, 8, 2), 2.0);
        assert_eq!(residual_variance(12.0, 2, 2), f64::INFINITY);
    }
}
