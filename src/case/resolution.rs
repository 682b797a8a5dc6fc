//! Resolution of a case in space and time.

use super::validation::{FieldPath, positive};
use crate::limits::{CELL_STEPS, CELLS, OUTPUT_INTERVALS, STEPS};

/// Most corners of schedules on which stated steps end one by one.
pub(crate) const MAX_CORNERS: usize = 10_000;
/// Corners that carry the shape of longer schedules: at least 0.3 % of the duration apart, in each of several
/// schedules.
const MAJOR_CORNERS: usize = 1000;
/// Steps that an end of a step adds at most: the coarse plan divides what it separates, and every step is halved.
const STEPS_PER_END: f64 = 2.0;
/// The least number of cells per ply.
const MIN_CELLS_PER_PLY: usize = 4;

/// Largest steps in a run that nobody stated them for: of half a second, they end at a run of 21 h.
const LONG_RUN_STEPS: f64 = 150_000.0;
/// Output intervals of a run longer than the limit of intervals of one second, before the interval is rounded up.
const LONG_RUN_INTERVALS: f64 = 20_000.0;

/// The next number of the form 1, 2 or 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let decade = 10_f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|multiple| multiple * decade).find(|round| *round >= value).unwrap_or(10.0 * decade)
}

/// Resolution in space and time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Resolution {
    /// Tolerance of the discretisation error, to which cells and time steps are adapted, K; `None` if the case states
    /// them.
    pub tolerance_k: Option<f64>,
    /// Cells of the layup, distributed over the plies by diffusion time; at least four per ply.
    pub cells: usize,
    /// First time step after each corner of a schedule, s.
    pub first_step_s: f64,
    /// Upper limit of a time step relative to the time since the last corner.
    pub step_growth: f64,
    /// Upper limit of a time step, s.
    pub max_step_s: f64,
    /// Interval between output instants, s; the times of observations are added.
    pub output_interval_s: f64,
}

impl Resolution {
    /// The resolution of a case file without `[resolution]`: the default, with the fewest cells that many plies need,
    /// and for runs of many hours with steps and output intervals in proportion to the duration.
    pub fn for_run(plies: usize, duration_s: f64) -> Self {
        let standard = Self::default();
        let intervals = duration_s / standard.output_interval_s;
        // A duration that is not valid is refused elsewhere.
        let is_long = intervals.is_finite() && intervals > OUTPUT_INTERVALS.max as f64;
        let long_interval_s = round_up(duration_s / LONG_RUN_INTERVALS);
        Self {
            cells: standard.cells.max(MIN_CELLS_PER_PLY * plies),
            max_step_s: standard.max_step_s.max(duration_s / LONG_RUN_STEPS),
            output_interval_s: if is_long { long_interval_s } else { standard.output_interval_s },
            ..standard
        }
    }

    /// The number of cells of a layup of `plies` plies.
    pub(super) fn checked_cells(cells: f64, plies: usize) -> Result<usize, String> {
        let fewest = MIN_CELLS_PER_PLY * plies;
        if cells.fract() == 0.0 && (fewest as f64..=CELLS.max as f64).contains(&cells) {
            return Ok(cells as usize);
        }
        Err(format!("expected a whole number of cells from {fewest} to {}, found {cells}", CELLS.max))
    }

    /// The growth of time steps, above 0 and at most 1.
    pub(super) fn checked_growth(growth: f64) -> Result<f64, String> {
        if growth > 0.0 && growth <= 1.0 {
            return Ok(growth);
        }
        Err(format!("expected a step growth above 0 and at most 1, found {growth}"))
    }

    /// The interval between output instants, s.
    pub(super) fn checked_output_interval_s(every_s: f64, duration_s: f64) -> Result<f64, String> {
        let intervals = duration_s / positive(every_s, format_args!("an interval of {every_s} s"))?;
        OUTPUT_INTERVALS
            .check(intervals)
            .map(|()| every_s)
            .map_err(|message| format!("{message} with an interval of {every_s} s in {duration_s} s"))
    }

    /// The first time step, s; it cannot be above the largest.
    pub(super) fn checked_first_step_s(first_step_s: f64, max_step_s: f64) -> Result<f64, String> {
        if positive(first_step_s, format_args!("a first step of {first_step_s} s"))? <= max_step_s {
            return Ok(first_step_s);
        }
        Err(format!("expected a first step of at most {max_step_s} s, the largest step, found {first_step_s} s"))
    }

    /// Refuse more time steps, or more cells times steps, than the limits. The arguments are those of
    /// [`max_steps`](Self::max_steps).
    pub(super) fn check_work(&self, corners_s: Vec<f64>, instants: usize, duration_s: f64) -> Result<(), String> {
        let steps = self.max_steps(corners_s, instants, duration_s);
        let stated = format!(
            " with a first step of {} s, a largest step of {} s, a growth of {} and a duration of {duration_s} s",
            self.first_step_s, self.max_step_s, self.step_growth
        );
        STEPS.check(steps).map_err(|message| message + &stated)?;
        CELL_STEPS
            .check(steps * self.cells as f64)
            .map_err(|message| format!("{message}: {} cells{stated}", self.cells))
    }

    /// An upper bound of the number of steps, which end on the corners of all schedules and on all instants.
    pub(crate) fn max_steps(&self, mut corners_s: Vec<f64>, instants: usize, duration_s: f64) -> f64 {
        let between = STEPS_PER_END * instants as f64;
        if corners_s.len() > MAX_CORNERS {
            let legs = MAJOR_CORNERS as f64;
            return between + legs * self.max_steps_after_corner(duration_s / legs);
        }
        corners_s.retain(|corner_s| (0.0..duration_s).contains(corner_s));
        corners_s.extend([0.0, duration_s]);
        corners_s.sort_by(f64::total_cmp);
        between + corners_s.windows(2).map(|leg_s| self.max_steps_after_corner(leg_s[1] - leg_s[0])).sum::<f64>()
    }

    /// Steps from a corner of a schedule to the next, after `leg_s`: first steps of one length, then growing ones, then
    /// the largest. The coarse plan, of half as many steps, grows twice as fast.
    fn max_steps_after_corner(&self, leg_s: f64) -> f64 {
        let (first_s, largest_s) = (self.first_step_s, self.max_step_s);
        let [grows_s, grown_s] = [first_s, largest_s].map(|step_s| leg_s.min(step_s / self.step_growth));
        let growing =
            if grows_s > 0.0 { 2.0 * (grown_s / grows_s).ln() / (2.0 * self.step_growth).ln_1p() } else { 0.0 };
        grows_s / first_s + growing + (leg_s - grown_s) / largest_s + STEPS_PER_END
    }

    /// Record all errors of the fields, for a number of plies and a duration. Returns whether there is none.
    pub(super) fn check(&self, at: &FieldPath<'_>, plies: usize, duration_s: f64) -> bool {
        let every = Self::checked_output_interval_s(self.output_interval_s, duration_s);
        let first_step = Self::checked_first_step_s(self.first_step_s, self.max_step_s);
        let valid = [
            at.child("tolerance_k").require(self.tolerance_k.map_or(Ok(0.0), |k| positive(k, k))).is_some(),
            at.child("cells").require(Self::checked_cells(self.cells as f64, plies)).is_some(),
            at.child("max_step_s").require(positive(self.max_step_s, self.max_step_s)).is_some(),
            at.child("first_step_s").require(first_step).is_some(),
            at.child("step_growth").require(Self::checked_growth(self.step_growth)).is_some(),
            at.child("output_interval_s").require(every).is_some(),
        ];
        valid == [true; 6]
    }
}

impl Default for Resolution {
    /// The resolution of a case file of few plies without `[resolution]`.
    fn default() -> Self {
        Self {
            tolerance_k: Some(0.05),
            cells: 160,
            first_step_s: 0.005,
            step_growth: 0.05,
            max_step_s: 0.5,
            output_interval_s: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_any_length_fits_the_limits_of_work_without_a_stated_resolution() {
        for (hours, plies) in [(0.01, 1), (20.0, 1), (28.0, 3), (336.0, 1), (336.0, 256), (1e6, 256)] {
            let duration_s = 3600.0 * hours;
            let resolution = Resolution::for_run(plies, duration_s);
            let intervals = duration_s / resolution.output_interval_s;
            assert!(OUTPUT_INTERVALS.check(intervals).is_ok(), "{hours} h: {intervals} intervals");
            let checked = resolution.check_work(Vec::new(), intervals as usize + 2, duration_s);
            assert_eq!(checked, Ok(()), "{hours} h of {plies} plies");
        }
        // Shorter runs keep the default; one step of it throughout the longest is refused.
        assert_eq!(Resolution::for_run(3, 3600.0), Resolution::default());
        assert!(Resolution::default().check_work(Vec::new(), 100, 3600.0 * 336.0).is_err());
    }
}
