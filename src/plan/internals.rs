//! Access to what a march reads, for the benches of the project.

use super::Plan;
use super::interpolation::RecordInterpolation;
use crate::physics::layout::PlanRows;

/// Not part of the public interface.
#[doc(hidden)]
impl Plan {
    /// Rows, sizes and switches.
    pub fn rows(&self) -> &PlanRows {
        &self.rows
    }

    /// The curve through the records.
    pub fn interpolation(&self) -> &RecordInterpolation {
        &self.interpolation
    }
}
