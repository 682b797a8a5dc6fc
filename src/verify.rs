//! Verification: does the march solve its equations, and does the minimiser find known optima?
//!
//! Groups of evidence: closed forms ([`exact`]), observed orders of accuracy ([`orders`]), other codes and standards,
//! the same problems with adapted cells and steps, balances of heat and mass, certified least-squares problems
//! ([`least_squares`]), limit states of known probability and designs of known optimum, intervals of known truths, and
//! backends against each other ([`cross_backend`]). Each row names its reference and the source of its tolerance. A
//! tolerance comes from the reference, never from the march.
//!
//! Published figures are re-typed under `data/verification`. Cylinders and spheres are out of scope: the march is
//! planar.

mod adapted;
mod balances;
mod coverage;
pub mod cross_backend;
pub mod exact;
pub mod least_squares;
mod optimal_design;
pub mod orders;
pub mod problem;
mod problem_materials;
pub mod problems;
pub mod random_case;
mod reference;
mod reliability;

use crate::ensemble::Ensemble;
use crate::march::{March, MarchError};
use crate::plan::Plan;
use std::fmt::Write as _;

/// A kind of evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Closed forms.
    Exact,
    /// Observed orders of accuracy in space and time.
    Orders,
    /// Other people's codes and standards.
    Codes,
    /// Exact solutions and codes with adapted cells and steps, extrapolated.
    Adapted,
    /// Balances of heat and mass: inflow less outflow less storage.
    Balance,
    /// The minimiser against problems with known optima, and reliability and designs against known answers.
    Fit,
    /// How often intervals contain a known truth.
    Coverage,
    /// Backends, precisions and derivatives against the CPU in double precision.
    CrossBackend,
}

impl Group {
    /// Every group, in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::Exact,
        Self::Orders,
        Self::Codes,
        Self::Adapted,
        Self::Balance,
        Self::Fit,
        Self::Coverage,
        Self::CrossBackend,
    ];

    /// The group as printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Orders => "orders",
            Self::Codes => "codes",
            Self::Adapted => "adapted",
            Self::Balance => "balance",
            Self::Fit => "fit",
            Self::Coverage => "coverage",
            Self::CrossBackend => "cross-backend",
        }
    }
}

/// One comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct VerificationRow {
    /// The kind of evidence.
    pub group: Group,
    /// The name of the problem.
    pub case: String,
    /// Source of the expected value.
    pub reference: String,
    /// The quantity compared.
    pub quantity: String,
    /// Largest difference; infinite or NaN where the march did not complete.
    pub difference: f64,
    /// Largest difference that passes.
    pub tolerance: f64,
    /// Unit of difference and tolerance.
    pub unit: String,
    /// Reason for the size of the tolerance.
    pub source_of_tolerance: String,
}

/// Separates, in the source of a tolerance, the reason for more than ten times the difference.
pub const WIDE_REASON: &str = "; wide: ";

impl VerificationRow {
    /// Whether the difference is within the tolerance; NaN is not.
    pub fn pass(&self) -> bool {
        self.difference <= self.tolerance
    }

    /// Whether the tolerance is more than ten times the difference.
    fn is_wide(&self) -> bool {
        self.tolerance > 10.0 * self.difference.abs()
    }

    /// Whether the tolerance is more than ten times the difference and its source gives no reason for it.
    pub fn is_wide_without_reason(&self) -> bool {
        self.is_wide() && !self.source_of_tolerance.contains(WIDE_REASON)
    }

    /// The source of the tolerance, with the reason for a wide one only if it is wide.
    pub fn source(&self) -> &str {
        match self.source_of_tolerance.split_once(WIDE_REASON) {
            Some((source, _)) if !self.is_wide() => source,
            _ => &self.source_of_tolerance,
        }
    }
}

/// The rows of some groups, in order: `march` against references, `marches` against the CPU.
///
/// # Errors
/// As [`March::march`].
pub fn verification_rows(
    march: &mut dyn March,
    marches: &mut [Box<dyn March>],
    groups: &[Group],
) -> Result<Vec<VerificationRow>, MarchError> {
    let mut rows = Vec::new();
    for &group in groups {
        match group {
            Group::Exact | Group::Codes => {
                for problem in problems::all_problems().iter().filter(|problem| problem.group == group) {
                    rows.extend(problem.rows(march)?);
                }
            }
            Group::Adapted => rows.extend(adapted::adapted_rows(march)?),
            Group::Orders => rows.extend(orders::order_rows(march)?),
            Group::Balance => rows.extend(balances::balance_rows(march)?),
            Group::Fit => {
                rows.extend(least_squares::verification_rows());
                rows.extend(reliability::reliability_rows());
                rows.extend(optimal_design::optimal_design_rows());
            }
            Group::Coverage => rows.extend(coverage::coverage_rows()?),
            Group::CrossBackend => rows.extend(cross_backend::cross_backend_rows(marches)?),
        }
    }
    Ok(rows)
}

/// Columns of the text table, unless a single text is longer.
const MAX_COLUMNS: usize = 100;

/// Rows as text: a line with the numbers, then, indented, quantity, reference and source of the tolerance.
pub fn text_table(rows: &[VerificationRow]) -> String {
    let case_width = rows.iter().map(|row| row.case.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let mut group = None;
    for row in rows {
        if group != Some(row.group) {
            group = Some(row.group);
            let _ = writeln!(text, "{}", row.group.name());
        }
        let verdict = if row.pass() { "pass" } else { "FAIL" };
        let _ = writeln!(
            text,
            "  {verdict}  {:case_width$}  {:9.2e}  within {:7.1e} {}",
            row.case, row.difference, row.tolerance, row.unit
        );
        let mut line = format!("        {} against {}", row.quantity, row.reference);
        let tolerance = format!("tolerance: {}", row.source());
        let joint =
            if line.chars().count() + tolerance.chars().count() + 2 <= MAX_COLUMNS { "; " } else { ";\n        " };
        line += joint;
        let _ = writeln!(text, "{line}{tolerance}");
    }
    let failed = rows.iter().filter(|row| !row.pass()).count();
    let _ = writeln!(text, "{} of {} pass", rows.len() - failed, rows.len());
    text
}

/// Largest difference between two marches of an ensemble over members, sensors and instants, K.
///
/// Infinite if a member completed in only one of the marches, or a temperature is NaN.
///
/// # Errors
/// As [`March::march`].
pub fn largest_difference_k(
    one: &mut dyn March,
    other: &mut dyn March,
    plan: &Plan,
    ensemble: &Ensemble,
) -> Result<f64, MarchError> {
    let capacity = one.capacity(plan).min(other.capacity(plan)).max(1);
    let mut worst_k = 0.0;
    let mut first = 0;
    while first < ensemble.len() {
        let next = (first + capacity).min(ensemble.len());
        let (a, b) = (one.march(plan, ensemble, first..next)?, other.march(plan, ensemble, first..next)?);
        if a.statuses != b.statuses || a.temperatures_k.len() != b.temperatures_k.len() {
            return Ok(f64::INFINITY);
        }
        for (a_k, b_k) in a.temperatures_k.iter().zip(&b.temperatures_k) {
            let off_k = (a_k - b_k).abs();
            if off_k.is_nan() {
                return Ok(f64::INFINITY);
            }
            worst_k = off_k.max(worst_k);
        }
        first = next;
    }
    Ok(worst_k)
}
