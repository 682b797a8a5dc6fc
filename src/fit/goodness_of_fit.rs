//! Statistics of a fit as lmfit reports them: χ², its reduced value, and the information criteria.
//!
//! With `N` residuals over their standard deviations, `p` variables and `χ²` their sum of squares (lmfit 1.3,
//! *Performing Fits and Analyzing Outputs*, "Akaike and Bayesian Information Criteria"):
//!
//! ```text
//! AIC = N ln(χ²/N) + 2p        BIC = N ln(χ²/N) + p ln N
//! ```
//!
//! Both assume independent residuals, and are minus twice the log likelihood of normal residuals whose variance is
//! fitted too, without its constant. Only differences between fits of the same data have a meaning.

/// Statistics of a fit.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct GoodnessOfFit {
    /// Sum of the squares of the residuals over their standard deviations, without loss function and priors.
    pub chi_squared: f64,
    /// Residuals less variables; zero if there are no more residuals than variables.
    pub degrees_of_freedom: usize,
    /// χ² over the degrees of freedom: one where the stated standard deviations are those of the residuals; NaN without
    /// degrees of freedom.
    pub reduced_chi_squared: f64,
    /// Akaike information criterion; −∞ for residuals of zero.
    pub akaike_criterion: f64,
    /// Bayesian information criterion; −∞ for residuals of zero.
    pub bayesian_criterion: f64,
}

impl GoodnessOfFit {
    /// Statistics of residuals over their standard deviations, fitted by a number of variables.
    pub fn of(residuals: impl IntoIterator<Item = f64>, variables: usize) -> Self {
        let (samples, chi_squared) = residuals
            .into_iter()
            .fold((0_usize, 0.0), |(samples, sum), residual| (samples + 1, sum + residual * residual));
        let (number, parameters) = (samples as f64, variables as f64);
        let degrees_of_freedom = samples.saturating_sub(variables);
        let reduced = if degrees_of_freedom > 0 { chi_squared / degrees_of_freedom as f64 } else { f64::NAN };
        let log_likelihood = number * (chi_squared / number).ln();
        Self {
            chi_squared,
            degrees_of_freedom,
            reduced_chi_squared: reduced,
            akaike_criterion: log_likelihood + 2.0 * parameters,
            bayesian_criterion: log_likelihood + parameters * number.ln(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST's Misra1a (<https://www.itl.nist.gov/div898/strd/nls/data/misra1a.shtml>) at its certified parameters; the
    /// expected values are those that lmfit 1.3.4 prints for its own fit.
    #[test]
    fn the_statistics_of_misra1a_are_those_of_lmfit() {
        let x = [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0];
        let y = [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78];
        let model = |x: f64| 238.942_129_18 * (1.0 - (-5.501_564_318_1e-4 * x).exp());
        let found = GoodnessOfFit::of(x.iter().zip(y).map(|(&x, y)| y - model(x)), 2);
        assert_eq!(found.degrees_of_freedom, 12);
        for (found, expected) in [
            (found.chi_squared, 0.124_551_388_944_399),
            (found.reduced_chi_squared, 0.010_379_282_412_033),
            (found.akaike_criterion, -62.109_319_013_501),
            (found.bayesian_criterion, -60.831_204_354_270),
        ] {
            assert!((found - expected).abs() < 1e-8 * expected.abs(), "{found}, not {expected}");
        }
    }

    #[test]
    fn without_spare_residuals_there_is_no_reduced_value() {
        let found = GoodnessOfFit::of([1.0, -2.0], 2);
        assert_eq!((found.chi_squared, found.degrees_of_freedom), (5.0, 0));
        assert!(found.reduced_chi_squared.is_nan());
        assert_eq!(GoodnessOfFit::of([0.0; 9], 2).akaike_criterion, f64::NEG_INFINITY);
    }
}
