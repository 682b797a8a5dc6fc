//! Required thickness of each member: bracketed root finding, batched over members.
//!
//! The peak falls with insulation thickness, so each member crosses the limit at one thickness. The fraction of members
//! below the limit at a thickness is the fraction that requires no more, so the thickness for a probability is the
//! quantile of the members' required thicknesses. This gives every probability at once, without the noise of new
//! members at each thickness.

/// The smallest thickness that keeps a peak below the limit, m.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub enum RequiredThickness {
    /// The smallest allowed thickness suffices.
    AtMost(f64),
    /// The thickness, m.
    At(f64),
    /// The largest allowed thickness does not suffice.
    Beyond(f64),
}

impl RequiredThickness {
    /// The thickness, where one was found between the bounds, m.
    pub fn found_m(self) -> Option<f64> {
        if let Self::At(thickness_m) = self { Some(thickness_m) } else { None }
    }

    /// Sort key, m: infinite where the largest allowed thickness does not suffice.
    pub(crate) fn sort_key_m(self) -> f64 {
        match self {
            Self::AtMost(thickness_m) | Self::At(thickness_m) => thickness_m,
            Self::Beyond(_) => f64::INFINITY,
        }
    }
}

/// Tolerance of the peak, K: a hundredth of the resolution of a thermocouple.
const PEAK_TOLERANCE_K: f64 = 0.02;
/// A bracket with a smaller difference of the peaks is linear within the tolerance, K.
const LINEAR_BRACKET_K: f64 = 2.0;
/// Relative tolerance of the thickness, for a peak with a jump.
const RELATIVE_TOLERANCE: f64 = 1e-5;
/// Secant trials before bisection, which is needed at a jump.
const MAX_SECANT_TRIALS: usize = 8;

/// The root search of one member.
#[derive(Clone, Debug)]
pub(super) struct ThicknessSearch {
    thickness_range_m: (f64, f64),
    /// The largest thickness above the limit and the smallest below it, m, each with the excess of the peak, K.
    above_limit: Option<(f64, f64)>,
    below_limit: Option<(f64, f64)>,
    trials: usize,
    pub found: Option<RequiredThickness>,
}

impl ThicknessSearch {
    pub(super) fn new(within_m: (f64, f64)) -> Self {
        Self { thickness_range_m: within_m, above_limit: None, below_limit: None, trials: 0, found: None }
    }

    /// The next trial thickness. `guess_thickness_m` maps a thickness and an excess there, K, to the thickness without
    /// excess on the nominal curve.
    pub(super) fn next_trial_m(&self, first_m: f64, guess: impl Fn(f64, f64) -> f64) -> f64 {
        let (low_m, high_m) = self.thickness_range_m;
        let next_m = match (self.above_limit, self.below_limit) {
            (None, None) => first_m,
            (Some((at_m, excess_k)), None) => {
                let beyond_m = guess(at_m, self.overshoot_k(excess_k));
                if beyond_m > at_m { beyond_m } else { high_m }
            }
            (None, Some((at_m, excess_k))) => {
                let beyond_m = guess(at_m, self.overshoot_k(excess_k));
                if beyond_m < at_m { beyond_m } else { low_m }
            }
            (Some((low_m, over_k)), Some((high_m, under_k))) => {
                let share = over_k / (over_k - under_k);
                let is_straight = self.trials < MAX_SECANT_TRIALS && share.is_finite();
                low_m + (high_m - low_m) * if is_straight { share.clamp(0.02, 0.98) } else { 0.5 }
            }
        };
        next_m.max(low_m).min(high_m)
    }

    /// Peak reduction to aim for: beyond the limit, and further after each failed trial, because a point on the other
    /// side gives a bracket and undershooting converges slowly.
    fn overshoot_k(&self, excess_k: f64) -> f64 {
        (1.0 + 0.1 * 4f64.powi(self.trials as i32 - 1)) * excess_k + PEAK_TOLERANCE_K.copysign(excess_k) / 2.0
    }

    /// Record the excess of the peak over the limit at a thickness, K; infinite where the member failed.
    pub(super) fn record(&mut self, thickness_m: f64, excess_k: f64) {
        self.trials += 1;
        let (low_m, high_m) = self.thickness_range_m;
        if excess_k > 0.0 {
            self.above_limit = Some((thickness_m, excess_k));
        } else {
            self.below_limit = Some((thickness_m, excess_k));
        }
        let straight_m = match (self.above_limit, self.below_limit) {
            (Some((low_m, over_k)), Some((high_m, under_k))) if over_k - under_k <= LINEAR_BRACKET_K => {
                Some(low_m + (high_m - low_m) * over_k / (over_k - under_k))
            }
            _ => None,
        };
        let width_m =
            self.below_limit.map_or(f64::INFINITY, |(at_m, _)| at_m) - self.above_limit.map_or(0.0, |(at_m, _)| at_m);
        self.found = if excess_k > 0.0 && thickness_m >= high_m {
            Some(RequiredThickness::Beyond(high_m))
        } else if excess_k <= 0.0 && thickness_m <= low_m {
            Some(RequiredThickness::AtMost(low_m))
        } else if let Some(straight_m) = straight_m {
            Some(RequiredThickness::At(straight_m))
        } else if (-PEAK_TOLERANCE_K..=0.0).contains(&excess_k)
            || (self.below_limit.is_some() && width_m <= RELATIVE_TOLERANCE * thickness_m)
        {
            self.below_limit.map(|(at_m, _)| RequiredThickness::At(at_m))
        } else {
            None
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The required thickness for this excess over thickness, and the number of trials.
    fn sought(excess_k: impl Fn(f64) -> f64) -> (RequiredThickness, usize) {
        let mut search = ThicknessSearch::new((1e-3, 9e-3));
        loop {
            let next_m = search.next_trial_m(4e-3, |at_m, excess_k| at_m + excess_k * 1e-5);
            search.record(next_m, excess_k(next_m));
            if let Some(found) = search.found {
                return (found, search.trials);
            }
            assert!(search.trials < 60, "{search:?}");
        }
    }

    #[test]
    fn a_falling_peak_reaches_the_limit_within_a_few_trials() {
        for needed_m in [1.2e-3, 3e-3, 4e-3, 8.5e-3] {
            let excess = |at_m: f64| 400.0 * (needed_m / at_m - 1.0);
            let (RequiredThickness::At(found_m), trials) = sought(excess) else { panic!("{needed_m}") };
            assert!(excess(found_m).abs() < PEAK_TOLERANCE_K && trials <= 8, "{needed_m}: {found_m} in {trials}");
        }
    }

    #[test]
    fn limits_outside_the_allowed_thickness_are_reported_as_such() {
        assert_eq!(sought(|_| 10.0).0, RequiredThickness::Beyond(9e-3));
        assert_eq!(sought(|_| -10.0).0, RequiredThickness::AtMost(1e-3));
        assert_eq!(sought(|_| f64::INFINITY).0, RequiredThickness::Beyond(9e-3));
    }

    #[test]
    fn a_member_that_fails_below_a_thickness_requires_that_thickness() {
        let (RequiredThickness::At(found_m), _) = sought(|at_m| if at_m < 5e-3 { f64::INFINITY } else { -50.0 }) else {
            panic!("it holds from 5 mm on")
        };
        assert!((found_m - 5e-3).abs() < 1e-6, "{found_m}");
    }
}
