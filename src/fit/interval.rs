//! Residual variance, autocorrelation and the factors of confidence intervals.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Residual variance `s² = S/(n − p)` of a fit of `variables` to `samples`; infinite without degrees of
/// freedom.
pub fn residual_variance(objective: f64, samples: usize, variables: usize) -> f64 {
    if samples > variables { objective / (samples - variables) as f64 } else { f64::INFINITY }
}

/// Lag-one autocorrelation of residuals, `Σ rᵢ rᵢ₊₁ / Σ rᵢ²`, with sums within each trace. The mean is not subtracted,
/// so a bias of the prediction counts as autocorrelation. Zero without residuals.
pub fn lag_one_autocorrelation(traces: &[Vec<f64>]) -> f64 {
    let products: f64 = traces.iter().flat_map(|trace| trace.windows(2)).map(|pair| pair[0] * pair[1]).sum();
    let squares: f64 = traces.iter().flatten().map(|residual| residual.powi(2)).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// Half-width of a 95 % interval of the normal distribution, in standard deviations.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Half-width of a 95 % confidence interval in standard errors: Student's t at 97.5 %. Infinite without degrees of
/// freedom, and where it would exceed a million.
pub fn student_95(degrees_of_freedom: f64) -> f64 {
    const LARGEST: f64 = 1e6;
    let Ok(student) = StudentsT::new(0.0, 1.0, degrees_of_freedom) else { return f64::INFINITY };
    if student.cdf(LARGEST) < 0.975 {
        return f64::INFINITY;
    }
    // Bisection: the inverse in statrs does not return for some degrees of freedom and is wrong above 10⁴.
    let (mut low, mut high) = (0.0, LARGEST);
    while high - low > 1e-10 * high {
        let middle = (low + high) / 2.0;
        if student.cdf(middle) < 0.975 { low = middle } else { high = middle }
    }
    high
}

/// Half-width of the central 95 % interval of the sum of two errors about zero: a mixture of Student's t distributions,
/// of which each has a probability and the square of a scale, and a normal error of another variance. Infinite without
/// degrees of freedom, with an infinite scale, or of no distribution.
pub(crate) fn student_mixture_95(parts: &[(f64, f64)], other_variance: f64, degrees_of_freedom: f64) -> f64 {
    let t = student_95(degrees_of_freedom);
    // The other variance is normal, so it contributes a normal quantile.
    let other_variance = if other_variance > 0.0 { other_variance * (NORMAL_95 / t).powi(2) } else { 0.0 };
    let scales: Vec<(f64, f64)> =
        parts.iter().map(|(probability, square)| (*probability, (square + other_variance).sqrt())).collect();
    let least = scales.iter().map(|(_, scale)| *scale).fold(f64::INFINITY, f64::min);
    let most = scales.iter().map(|(_, scale)| *scale).fold(0.0, f64::max);
    let Ok(student) = StudentsT::new(0.0, 1.0, degrees_of_freedom) else { return f64::INFINITY };
    if !(t.is_finite() && least.is_finite() && most.is_finite()) {
        return f64::INFINITY;
    }
    let all: f64 = scales.iter().map(|(probability, _)| probability).sum();
    let below = |half: f64| {
        let each = scales.iter().map(|&(probability, scale)| match scale {
            0.0 => probability,
            _ => probability * student.cdf(half / scale),
        });
        each.sum::<f64>() / all
    };
    let (mut low, mut high) = (t * least, t * most);
    while high - low > 1e-7 * most {
        let middle = (low + high) / 2.0;
        if below(middle) < 0.975 { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_t_factors_match_the_tables() {
        // Two-sided 5 % points: 1, 5, 10, 30 and 120 degrees.
        for (degrees_of_freedom, factor) in [(1.0, 12.706), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (120.0, 1.980)]
        {
            assert!(
                (student_95(degrees_of_freedom) - factor).abs() < 6e-4,
                "{degrees_of_freedom}: {}",
                student_95(degrees_of_freedom)
            );
        }
        assert!((student_95(1e6) - 1.959_966).abs() < 1e-5);
        assert_eq!([0.01, 0.0, -3.0].map(student_95), [f64::INFINITY; 3]);
    }

    #[test]
    fn constant_residuals_correlate_positively_and_alternating_ones_negatively() {
        let steady = vec![vec![2.0; 50], vec![-1.0; 50]];
        assert!(lag_one_autocorrelation(&steady) > 0.97);
        let alternating = vec![(0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect()];
        assert!(lag_one_autocorrelation(&alternating) < -0.98);
        assert_eq!(lag_one_autocorrelation(&[]), 0.0);
    }

    #[test]
    fn traces_are_not_joined_end_to_end() {
        assert_eq!(lag_one_autocorrelation(&[vec![1.0], vec![1.0]]), 0.0);
        assert_eq!(lag_one_autocorrelation(&[vec![1.0, 1.0]]), 0.5);
    }

    #[test]
    fn residual_variance_divides_by_the_degrees_of_freedom() {
        assert_eq!(residual_variance(12.0, 8, 2), 2.0);
        assert_eq!(residual_variance(12.0, 2, 2), f64::INFINITY);
    }
}
