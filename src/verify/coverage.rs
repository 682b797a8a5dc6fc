//! Verification rows of intervals: how often the 95 % intervals of each kind contain the truth, under default settings.
//!
//! The truth is known, as the data come from it: members of a known distribution, functions with known indices,
//! synthetic readings of known factors. What is counted is what the program prints.

mod bands;
mod drifts;
mod estimates;
mod histories;
mod members;
mod sizing;
mod sobol_indices;

use super::{Group, VerificationRow};
use crate::fit::proportion::Proportion;
use crate::march::MarchError;

/// Intervals counted.
struct Counted {
    /// Share that contains the truth.
    covered: f64,
    /// Number of intervals or of sets of them.
    total: usize,
    /// Name of the counted objects, in the plural.
    of: &'static str,
}

impl Counted {
    fn intervals(Proportion { count, total }: Proportion) -> Self {
        Self { covered: count as f64 / total as f64, total, of: "intervals" }
    }
}

/// Coverage of every kind of interval.
///
/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn coverage_rows() -> Result<Vec<VerificationRow>, MarchError> {
    let mut rows = members::rows();
    rows.extend(sobol_indices::rows());
    rows.extend(estimates::rows()?);
    rows.extend(histories::rows()?);
    rows.extend(bands::rows(&estimates::slab())?);
    rows.extend(sizing::rows()?);
    rows.extend(drifts::rows());
    Ok(rows)
}

/// A row: coverage below 95 % by at most some per cent, with the reason for these.
fn covered_row(
    interval: &str,
    members: usize,
    quantity: &str,
    counted: &Counted,
    (allowed, reason): (f64, &str),
) -> VerificationRow {
    let percent = 100.0 * counted.covered;
    VerificationRow {
        group: Group::Coverage,
        case: format!("{interval}, n = {members}"),
        reference: "95 %".to_owned(),
        quantity: format!("{percent:.1} % of {} {}, {quantity}", counted.total, counted.of),
        difference: 95.0 - percent,
        tolerance: allowed,
        unit: "% below".to_owned(),
        source_of_tolerance: format!("{reason}; wide: there is no limit above 95 %"),
    }
}
