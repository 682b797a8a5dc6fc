//! The thickness that one member needs: a bracketed root, sought for many members side by side.
//!
//! A peak that falls as its insulation thickens passes the limit once, and so every member has a thickness of its own from
//! which on it holds. The share of members that hold at any thickness is then the share that need no more, and the thickness
//! that a probability asks for the quantile of what members need: the root of the quantile of the peaks, found for every
//! probability at once, without the noise that drawing other members at each thickness would bring.

/// The thickness from which on a limit is held, m.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Needed {
    /// The thinnest allowed holds it.
    AtMost(f64),
    /// The thickness, m.
    At(f64),
    /// The thickest allowed does not hold it.
    Beyond(f64),
}

impl Needed {
    /// The thickness where one was found.
    pub fn found_m(self) -> Option<f64> {
        if let Self::At(thickness_m) = self { Some(thickness_m) } else { None }
    }

    /// For putting in order: what the thickest allowed does not hold is thicker than any.
    pub(super) fn least_m(self) -> f64 {
        match self {
            Self::AtMost(thickness_m) | Self::At(thickness_m) => thickness_m,
            Self::Beyond(_) => f64::INFINITY,
        }
    }
}

/// Near enough, K: a hundredth of what a thermocouple tells.
const NEAR_K: f64 = 0.02;
/// A bracket whose ends differ by no more is straight to within that, K.
const STRAIGHT_K: f64 = 2.0;
/// Near enough, as a share of the thickness: where a peak has a jump.
const NEAR: f64 = 1e-5;
/// Trials after which a bracket is halved: a jump is not found by straight lines.
const TRIALS: usize = 8;

/// One member on its way.
#[derive(Clone, Debug)]
pub(super) struct Search {
    within_m: (f64, f64),
    /// The thickest that was met to exceed the limit, and the thinnest to hold it; with the excess of the peak, K.
    over: Option<(f64, f64)>,
    under: Option<(f64, f64)>,
    trials: usize,
    pub found: Option<Needed>,
}

impl Search {
    pub(super) fn new(within_m: (f64, f64)) -> Self {
        Self { within_m, over: None, under: None, trials: 0, found: None }
    }

    /// The thickness to try next. `guess` takes a thickness and an excess there, K, to where a member like most would have none.
    pub(super) fn next(&self, first_m: f64, guess: impl Fn(f64, f64) -> f64) -> f64 {
        let (low_m, high_m) = self.within_m;
        let next_m = match (self.over, self.under) {
            (None, None) => first_m,
            (Some((at_m, excess_k)), None) => {
                let beyond_m = guess(at_m, self.beyond_k(excess_k));
                if beyond_m > at_m { beyond_m } else { high_m }
            }
            (None, Some((at_m, excess_k))) => {
                let beyond_m = guess(at_m, self.beyond_k(excess_k));
                if beyond_m < at_m { beyond_m } else { low_m }
            }
            (Some((low_m, over_k)), Some((high_m, under_k))) => {
                let share = over_k / (over_k - under_k);
                let is_straight = self.trials < TRIALS && share.is_finite();
                low_m + (high_m - low_m) * if is_straight { share.clamp(0.02, 0.98) } else { 0.5 }
            }
        };
        next_m.max(low_m).min(high_m)
    }

    /// By how much a peak is to be lower for the limit to be passed by a little, and by ever more where it was not: a trial on
    /// the other side is a bracket, while one that falls short again and again creeps.
    fn beyond_k(&self, excess_k: f64) -> f64 {
        (1.0 + 0.1 * 4f64.powi(self.trials as i32 - 1)) * excess_k + NEAR_K.copysign(excess_k) / 2.0
    }

    /// Takes by how much the peak exceeded the limit at a thickness, K; infinite where the member failed there.
    pub(super) fn met(&mut self, thickness_m: f64, excess_k: f64) {
        self.trials += 1;
        let (low_m, high_m) = self.within_m;
        if excess_k > 0.0 {
            self.over = Some((thickness_m, excess_k));
        } else {
            self.under = Some((thickness_m, excess_k));
        }
        let straight_m = match (self.over, self.under) {
            (Some((low_m, over_k)), Some((high_m, under_k))) if over_k - under_k <= STRAIGHT_K => {
                Some(low_m + (high_m - low_m) * over_k / (over_k - under_k))
            }
            _ => None,
        };
        let width_m = self.under.map_or(f64::INFINITY, |(at_m, _)| at_m) - self.over.map_or(0.0, |(at_m, _)| at_m);
        self.found = if excess_k > 0.0 && thickness_m >= high_m {
            Some(Needed::Beyond(high_m))
        } else if excess_k <= 0.0 && thickness_m <= low_m {
            Some(Needed::AtMost(low_m))
        } else if let Some(straight_m) = straight_m {
            Some(Needed::At(straight_m))
        } else if (-NEAR_K..=0.0).contains(&excess_k) || (self.under.is_some() && width_m <= NEAR * thickness_m) {
            self.under.map(|(at_m, _)| Needed::At(at_m))
        } else {
            None
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a member with this excess over thickness needs, and in how many trials.
    fn sought(excess_k: impl Fn(f64) -> f64) -> (Needed, usize) {
        let mut search = Search::new((1e-3, 9e-3));
        loop {
            let next_m = search.next(4e-3, |at_m, excess_k| at_m + excess_k * 1e-5);
            search.met(next_m, excess_k(next_m));
            if let Some(found) = search.found {
                return (found, search.trials);
            }
            assert!(search.trials < 60, "{search:?}");
        }
    }

    #[test]
    fn a_peak_that_falls_with_thickness_is_met_within_a_few_trials() {
        for needed_m in [1.2e-3, 3e-3, 4e-3, 8.5e-3] {
            let excess = |at_m: f64| 400.0 * (needed_m / at_m - 1.0);
            let (Needed::At(found_m), trials) = sought(excess) else { panic!("{needed_m}") };
            assert!(excess(found_m).abs() < NEAR_K && trials <= 8, "{needed_m}: {found_m} in {trials}");
        }
    }

    #[test]
    fn a_limit_that_no_thickness_holds_and_one_that_every_thickness_holds_are_told_from_one_that_some_hold() {
        assert_eq!(sought(|_| 10.0).0, Needed::Beyond(9e-3));
        assert_eq!(sought(|_| -10.0).0, Needed::AtMost(1e-3));
        assert_eq!(sought(|_| f64::INFINITY).0, Needed::Beyond(9e-3));
    }

    #[test]
    fn a_member_that_fails_where_it_is_thin_needs_what_it_takes_not_to_fail() {
        let (Needed::At(found_m), _) = sought(|at_m| if at_m < 5e-3 { f64::INFINITY } else { -50.0 }) else {
            panic!("it holds from 5 mm on")
        };
        assert!((found_m - 5e-3).abs() < 1e-6, "{found_m}");
    }
}
