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

    /// Interpolation from records to instants; `None` where they coincide.
    pub fn interpolation(&self) -> Option<&RecordInterpolation> {
        self.interpolation.as_ref()
    }
}
