//! Whether the result of a march can be used: its status, its discretisation error and its balances; and temperatures
//! beyond the tables.

use super::nominal::Prediction;
use super::uncertainty::failure_reason;
use crate::case::{Case, Ply};
use crate::plan::{ErrorEstimate, GaugeError, RoundingError};
use crate::traces::Balance;

/// Excursions beyond a property table up to this are ignored, K: over a few kelvin no property changes.
const TABLE_MARGIN_K: f64 = 10.0;
/// Largest acceptable relative residual of the energy and mass balances.
pub const MAX_BALANCE_RESIDUAL: f64 = 1e-3;
/// Multiple of the tolerance of the discretisation error, and of the largest residual of a balance, above which a
/// result cannot be used. Up to it there is a warning.
pub const UNUSABLE_MULTIPLE: f64 = 10.0;

impl Prediction {
    /// Why this march of a case cannot be used, as the rest of a sentence about it; `None` if it can.
    pub fn unusable_reason(&self, case: &Case) -> Option<String> {
        let failed = failure_reason(case, &self.status).map(|reason| format!("failed: {reason}"));
        failed.or_else(|| unusable(inaccuracy(self.error_estimate.as_ref(), &self.balance)))
    }
}

/// The rest of a sentence about a march that is too inaccurate.
pub(super) fn unusable(inaccuracy: Option<String>) -> Option<String> {
    inaccuracy.map(|reason| format!("cannot be used: {reason}"))
}

/// Why the values of a march cannot be used, if they cannot: its discretisation error or a balance.
pub(crate) fn inaccuracy(reached: Option<&ErrorEstimate>, balance: &Balance) -> Option<String> {
    let discretisation = reached.and_then(discretisation_failure);
    discretisation.or_else(|| balances(reached, balance).into_iter().find_map(balance_failure))
}

/// The energy and the mass balance: name, relative residual, and what makes it smaller.
pub(crate) fn balances(reached: Option<&ErrorEstimate>, balance: &Balance) -> [(&'static str, f64, &'static str); 2] {
    let remedy = |residual: f64, of: fn(&RoundingError) -> f64| {
        let is_rounding = reached.is_some_and(|reached| reached.is_rounding(residual.abs(), of));
        if is_rounding { "march in f64" } else { "refine steps or cells" }
    };
    let (energy, mass) = (balance.residual(), balance.mass_residual());
    [
        ("energy", energy, remedy(energy, |rounding| rounding.energy_balance)),
        ("mass", mass, remedy(mass, |rounding| rounding.mass_balance)),
    ]
}

/// Where more than half of an error is rounding.
pub(crate) const MOSTLY_ROUNDING: &str = ", mostly rounding in f32,";

/// Why an estimated discretisation error makes the result of a march useless, if it does.
pub(crate) fn discretisation_failure(reached: &ErrorEstimate) -> Option<String> {
    let is_above = |error: f64, tolerance: f64| error.is_nan() || error > UNUSABLE_MULTIPLE * tolerance;
    let gauge = |gauge: &&GaugeError| is_above(gauge.error, gauge.tolerance);
    let cause = |is_rounding| if is_rounding { MOSTLY_ROUNDING } else { "" };
    let (quantity, is_rounding) = if is_above(reached.nominal_k, reached.tolerance_k) {
        let is_rounding = reached.is_rounding(reached.nominal_k, |rounding| rounding.nominal_k);
        let (error, tolerance) = (two_digits(reached.nominal_k), two_digits(reached.tolerance_k));
        let times = format!("more than {UNUSABLE_MULTIPLE} times the tolerance of {tolerance} K");
        (format!("its discretisation error{} is {error} K, {times}", cause(is_rounding)), is_rounding)
    } else {
        let found = reached.gauges.iter().find(gauge)?;
        let is_rounding = reached.is_rounding(found.error, |rounding| rounding.of_gauge(found.gauge));
        let ratio = two_digits(found.error / found.tolerance);
        let (gauge, cause) = (found.gauge.name(), cause(is_rounding));
        (format!("its discretisation error in {gauge}{cause} is {ratio} times the tolerance"), is_rounding)
    };
    let remedy = if is_rounding { "march in f64" } else { "no affordable cells and steps resolve it" };
    Some(format!("{quantity}: {remedy}"))
}

fn balance_failure((balance, residual, remedy): (&str, f64, &str)) -> Option<String> {
    let limit = UNUSABLE_MULTIPLE * MAX_BALANCE_RESIDUAL;
    let is_off = residual.is_nan() || residual.abs() > limit;
    is_off.then(|| {
        let percent = two_digits(100.0 * residual);
        format!("its {balance} balance is off by {percent} %, more than {} %: {remedy}", 100.0 * limit)
    })
}

/// A property of a ply at temperatures beyond its table.
pub(crate) struct TableExcursion<'a> {
    pub(crate) ply: &'a Ply,
    pub(crate) is_above: bool,
    pub(crate) property: String,
    /// End of the table of the property, K.
    pub(crate) bound_k: f64,
    /// Extreme temperature of the ply, K.
    pub(crate) extreme_k: f64,
}

impl<'a> TableExcursion<'a> {
    /// All excursions in the marches of a case.
    pub(crate) fn all(case: &'a Case, marches: &[&Prediction]) -> Vec<Self> {
        let mut found = Vec::new();
        for (index, ply) in case.layup.plies.iter().enumerate() {
            let met = marches.iter().filter_map(|march| march.extremes_k.get(index));
            let met = met.copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
            let Some((coldest_k, hottest_k)) = met else { continue };
            for (property, (low_k, high_k)) in case.table_ranges_k(index) {
                if hottest_k > high_k + TABLE_MARGIN_K {
                    let property = property.clone();
                    found.push(Self { ply, is_above: true, property, bound_k: high_k, extreme_k: hottest_k });
                }
                if coldest_k < low_k - TABLE_MARGIN_K {
                    found.push(Self { ply, is_above: false, property, bound_k: low_k, extreme_k: coldest_k });
                }
            }
        }
        found
    }
}

/// A number to two significant digits.
pub(crate) fn two_digits(value: f64) -> String {
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
        ErrorEstimate { gauges: vec![front], ..ErrorEstimate::of_temperature(nominal_k, 0.05) }
    }

    #[test]
    fn a_discretisation_error_above_ten_tolerances_is_a_failure_and_one_below_is_not() {
        assert_eq!(discretisation_failure(&estimate(0.49, 9e-4)), None);
        let reason = |nominal_k, front_m| discretisation_failure(&estimate(nominal_k, front_m)).expect("a reason");
        assert!(reason(240.0, 0.0).starts_with("its discretisation error is 240 K, more than 10 times the tolerance"));
        assert!(reason(f64::INFINITY, 0.0).starts_with("its discretisation error is unbounded K"));
        let rounding = RoundingError {
            nominal_k: 2.0,
            corners_k: None,
            gauges: Vec::new(),
            energy_balance: 0.0,
            mass_balance: 0.0,
        };
        let single = ErrorEstimate { rounding: Some(rounding), ..estimate(2.01, 0.0) };
        let text = "its discretisation error, mostly rounding in f32, is 2 K, more than 10 times the tolerance of \
                    0.05 K: march in f64";
        assert_eq!(discretisation_failure(&single).as_deref(), Some(text));
        assert!(reason(0.0, 2e-3).starts_with("its discretisation error in char_front_m is 20 times the tolerance"));
    }

    #[test]
    fn a_balance_off_by_more_than_a_hundredth_is_a_failure() {
        assert_eq!(balance_failure(("energy", -9e-3, "")), None);
        let reason = balance_failure(("energy", 0.22, "refine steps or cells")).expect("a reason");
        assert_eq!(reason, "its energy balance is off by 22 %, more than 1 %: refine steps or cells");
        assert!(balance_failure(("mass", f64::NAN, "")).is_some());
    }
}
