//! How finely a case is cut in space and time.

use super::check::{Field, positive};

/// More cells than this resolve nothing that the material tables know.
const MOST_CELLS: f64 = 1024.0;
/// More instants than this are no trace that anybody reads.
const MOST_INSTANTS: f64 = 1e5;
/// Few enough for any layup, enough for a gradient: cells of a ply.
const CELLS_A_PLY: usize = 4;

/// How finely space and time are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Resolution {
    /// The error of temperatures for which a pilot is to choose cells and steps, K; `None` where a case states them.
    pub tolerance_k: Option<f64>,
    /// Cells through the layup, shared among plies by diffusion time; every ply has at least four.
    pub cells: usize,
    /// The first step after each corner of a schedule, s.
    pub first_step_s: f64,
    /// A step is at most this share of the time since the last corner.
    pub growth: f64,
    /// No step is longer, s.
    pub largest_step_s: f64,
    /// Interval between the instants of the traces, s; observations add instants of their own.
    pub every_s: f64,
}

impl Resolution {
    /// Cells of a layup of so many plies.
    pub(super) fn checked_cells(cells: f64, plies: usize) -> Result<usize, String> {
        let fewest = CELLS_A_PLY * plies;
        if cells.fract() == 0.0 && (fewest as f64..=MOST_CELLS).contains(&cells) {
            return Ok(cells as usize);
        }
        Err(format!("expected a whole number of cells from {fewest} to {MOST_CELLS}, found {cells}"))
    }

    /// The largest share of the time since the last corner that a step takes.
    pub(super) fn checked_growth(growth: f64) -> Result<f64, String> {
        if growth > 0.0 && growth <= 1.0 {
            return Ok(growth);
        }
        Err(format!("expected a growth above 0 and at most 1, found {growth}"))
    }

    /// The interval between instants of traces over a duration, s.
    pub(super) fn checked_every_s(every_s: f64, duration_s: f64) -> Result<f64, String> {
        let instants = duration_s / positive(every_s, format_args!("{every_s} s"))?;
        if instants > MOST_INSTANTS {
            return Err(format!("{instants} instants are too many: at most {MOST_INSTANTS}"));
        }
        Ok(every_s)
    }

    /// Record what is wrong with each field, for so many plies and this duration.
    pub(super) fn check(&self, at: &Field<'_>, plies: usize, duration_s: f64) {
        if let Some(tolerance_k) = self.tolerance_k {
            at.positive("tolerance_k", tolerance_k);
        }
        at.field("cells").require(Self::checked_cells(self.cells as f64, plies));
        at.positive("first_step_s", self.first_step_s);
        at.field("growth").require(Self::checked_growth(self.growth));
        at.positive("largest_step_s", self.largest_step_s);
        at.field("every_s").require(Self::checked_every_s(self.every_s, duration_s));
    }
}

impl Default for Resolution {
    /// What a case file gets that names none.
    fn default() -> Self {
        Self {
            tolerance_k: Some(0.05),
            cells: 160,
            first_step_s: 0.005,
            growth: 0.05,
            largest_step_s: 0.5,
            every_s: 1.0,
        }
    }
}
