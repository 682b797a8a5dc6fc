//! Whether the result of a march can be used: its status, its discretisation error and its balances.

use super::nominal::Prediction;
use super::uncertainty::failure_reason;
use crate::case::Case;
use crate::plan::{ErrorEstimate, GaugeError};

/// Largest acceptable relative residual of the energy and mass balances.
pub const MAX_BALANCE_RESIDUAL: f64 = 1e-3;
/// Multiple of the tolerance of the discretisation error, and of the largest residual of a balance, above which a
/// result cannot be used. Up to it there is a warning.
pub const UNUSABLE_MULTIPLE: f64 = 10.0;

impl Prediction {
    /// Why this march of a case cannot be used, as the rest of a sentence about it; `None` if it can.
    pub fn unusable_reason(&self, case: &Case) -> Option<String> {
        let failed = failure_reason(case, &self.status).map(|reason| format!("failed: {reason}"));
        let inaccurate = || {
            let discretisation = self.error_estimate.as_ref().and_then(discretisation_failure);
            let balance = discretisation.or_else(|| balance_failure("energy", self.balance.residual()));
            let reason = balance.or_else(|| balance_failure("mass", self.balance.mass_residual()))?;
            Some(format!("cannot be used: {reason}"))
        };
        failed.or_else(inaccurate)
    }
}

/// Why an estimated discretisation error makes the result of a march useless, if it does.
pub(super) fn discretisation_failure(reached: &ErrorEstimate) -> Option<String> {
    let is_above = |error: f64, tolerance: f64| error.is_nan() || error > UNUSABLE_MULTIPLE * tolerance;
    let gauge = |gauge: &&GaugeError| is_above(gauge.error, gauge.tolerance);
    let quantity = if is_above(reached.nominal_k, reached.tolerance_k) {
        let (error, tolerance) = (two_digits(reached.nominal_k), two_digits(reached.tolerance_k));
        format!(
            "its discretisation error is {error} K, more than {UNUSABLE_MULTIPLE} times the tolerance of {tolerance} K"
        )
    } else {
        let found = reached.gauges.iter().find(gauge)?;
        let ratio = two_digits(found.error / found.tolerance);
        format!("its discretisation error in {} is {ratio} times the tolerance", found.gauge.name())
    };
    Some(format!("{quantity}: no affordable cells and steps resolve it"))
}

fn balance_failure(balance: &str, residual: f64) -> Option<String> {
    let limit = UNUSABLE_MULTIPLE * MAX_BALANCE_RESIDUAL;
    let is_off = residual.is_nan() || residual.abs() > limit;
    is_off.then(|| {
        let percent = two_digits(100.0 * residual);
        format!("its {balance} balance is off by {percent} %, more than {} %: refine steps or cells", 100.0 * limit)
    })
}

/// A number to two significant digits.
fn two_digits(value: f64) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "unknown".to_owned() } else { "unbounded".to_owned() };
    }
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { rounded.to_string() } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traces::Gauge;

    fn estimate(nominal_k: f64, front_m: f64) -> ErrorEstimate {
        let front = GaugeError { gauge: Gauge::CharFront, error: front_m, tolerance: 1e-4 };
        ErrorEstimate { tolerance_k: 0.05, nominal_k, corners_k: None, gauges: vec![front] }
    }

    #[test]
    fn a_discretisation_error_above_ten_tolerances_is_a_failure_and_one_below_is_not() {
        assert_eq!(discretisation_failure(&estimate(0.49, 9e-4)), None);
        let reason = |nominal_k, front_m| discretisation_failure(&estimate(nominal_k, front_m)).expect("a reason");
        assert!(reason(240.0, 0.0).starts_with("its discretisation error is 240 K, more than 10 times the tolerance"));
        assert!(reason(f64::INFINITY, 0.0).starts_with("its discretisation error is unbounded K"));
        assert!(reason(0.0, 2e-3).starts_with("its discretisation error in char_front_m is 20 times the tolerance"));
    }

    #[test]
    fn a_balance_off_by_more_than_a_hundredth_is_a_failure() {
        assert_eq!(balance_failure("energy", -9e-3), None);
        let reason = balance_failure("energy", 0.22).expect("a reason");
        assert_eq!(reason, "its energy balance is off by 22 %, more than 1 %: refine steps or cells");
        assert!(balance_failure("mass", f64::NAN).is_some());
    }
}
