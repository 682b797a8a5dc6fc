//! Resolution of a case in space and time.

use super::validation::{FieldPath, positive};

/// More cells do not resolve anything that the material properties support.
const MAX_CELLS: f64 = 1024.0;
/// Upper limit of output instants.
const MAX_INSTANTS: f64 = 1e5;
/// The least number of cells per ply.
const MIN_CELLS_PER_PLY: usize = 4;

/// Resolution in space and time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Resolution {
    /// Tolerance of the discretisation error, to which cells and time steps are adapted, K; `None` if the case states
    /// them.
    pub tolerance_k: Option<f64>,
    /// Cells of the layup, distributed over the plies by diffusion time; at least four per ply.
    pub cells: usize,
    /// First time step after each corner of a schedule, s.
    pub first_step_s: f64,
    /// Upper limit of a time step relative to the time since the last corner.
    pub growth: f64,
    /// Upper limit of a time step, s.
    pub largest_step_s: f64,
    /// Interval between output instants, s; the times of observations are added.
    pub output_interval_s: f64,
}

impl Resolution {
    /// The number of cells of a layup of `plies` plies.
    pub(super) fn checked_cells(cells: f64, plies: usize) -> Result<usize, String> {
        let fewest = MIN_CELLS_PER_PLY * plies;
        if cells.fract() == 0.0 && (fewest as f64..=MAX_CELLS).contains(&cells) {
            return Ok(cells as usize);
        }
        Err(format!("expected a whole number of cells from {fewest} to {MAX_CELLS}, found {cells}"))
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
        let instants = duration_s / positive(every_s, format_args!("an interval of {every_s} s"))?;
        if instants > MAX_INSTANTS {
            return Err(format!(
                "expected at most {MAX_INSTANTS} instants, found {instants} with an interval of {every_s} s"
            ));
        }
        Ok(every_s)
    }

    /// Record all errors of the fields, for a number of plies and a duration.
    pub(super) fn check(&self, at: &FieldPath<'_>, plies: usize, duration_s: f64) {
        if let Some(tolerance_k) = self.tolerance_k {
            at.positive("tolerance_k", tolerance_k);
        }
        at.child("cells").require(Self::checked_cells(self.cells as f64, plies));
        at.positive("first_step_s", self.first_step_s);
        at.child("growth").require(Self::checked_growth(self.growth));
        at.positive("largest_step_s", self.largest_step_s);
        at.child("output_interval_s").require(Self::checked_output_interval_s(self.output_interval_s, duration_s));
    }
}

impl Default for Resolution {
    /// The resolution of a case file without `[resolution]`.
    fn default() -> Self {
        Self {
            tolerance_k: Some(0.05),
            cells: 160,
            first_step_s: 0.005,
            growth: 0.05,
            largest_step_s: 0.5,
            output_interval_s: 1.0,
        }
    }
}
