//! Does the march solve the equation it says it solves?
//!
//! Five questions, a group of rows each: does it meet exact solutions, does its error vanish at the order it claims,
//! does it agree with other people's codes, does it do so with adapted cells and steps within the error that it
//! reports, and is what comes in, less what goes out, stored? A row names its reference and where its tolerance comes
//! from; tolerances are those of the references, never of the march. [`least_squares`] asks whether the minimiser,
//! which no march has a part in, finds what is known to be there, and [`twins`] the last: do two marches agree with
//! each other?
//!
//! The references are closed forms evaluated here ([`exact`]) and published figures re-typed under
//! `data/verification`. Cylinders and spheres are out of scope, as the march is planar.

mod adapted;
mod balances;
pub mod exact;
pub mod least_squares;
pub mod orders;
pub mod problem;
pub mod problems;
pub mod random_case;
mod reference;
mod substance;
pub mod twins;

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
    /// Both as an analyst gets them: adapted, extrapolated.
    Adapted,
    /// What came in less what went out less what is stored, of heat and of mass.
    Balance,
    /// The minimiser against problems whose answers are known.
    Fit,
    /// Marches against each other.
    Twins,
}

impl Group {
    /// Every group, in the order of the table.
    pub const ALL: [Self; 7] =
        [Self::Exact, Self::Orders, Self::Codes, Self::Adapted, Self::Balance, Self::Fit, Self::Twins];

    /// The group as printed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Orders => "orders",
            Self::Codes => "codes",
            Self::Adapted => "adapted",
            Self::Balance => "balance",
            Self::Fit => "fit",
            Self::Twins => "twins",
        }
    }
}

/// One comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What kind of evidence it is.
    pub group: Group,
    /// The problem.
    pub case: String,
    /// Where the expected value comes from.
    pub reference: String,
    /// What is compared, with its unit.
    pub quantity: String,
    /// Largest difference; infinite or no number where the march did not arrive.
    pub difference: f64,
    /// The largest difference that passes.
    pub tolerance: f64,
    /// Of difference and tolerance.
    pub unit: String,
    /// Why the tolerance is as wide as it is.
    pub source_of_tolerance: String,
}

/// What comes before the reason, in the source of a tolerance, why it is more than ten times the difference.
pub const WIDE: &str = "; wide: ";

impl Row {
    /// Whether the difference is within the tolerance; what is no number is not.
    pub fn pass(&self) -> bool {
        self.difference <= self.tolerance
    }

    /// Whether the tolerance is more than ten times the difference.
    fn is_wide(&self) -> bool {
        self.tolerance > 10.0 * self.difference.abs()
    }

    /// Whether the tolerance is more than ten times the difference and its source gives no reason for it.
    pub fn is_wide_without_reason(&self) -> bool {
        self.is_wide() && !self.source_of_tolerance.contains(WIDE)
    }

    /// Where the tolerance comes from; why it is wide only if it is.
    pub fn source(&self) -> &str {
        match self.source_of_tolerance.split_once(WIDE) {
            Some((source, _)) if !self.is_wide() => source,
            _ => &self.source_of_tolerance,
        }
    }
}

/// Every row of some groups, in their order: `march` against references, `marches` against the processor.
///
/// # Errors
/// As [`March::march`].
pub fn rows(march: &mut dyn March, marches: &mut [Box<dyn March>], groups: &[Group]) -> Result<Vec<Row>, MarchError> {
    let mut rows = Vec::new();
    for &group in groups {
        match group {
            Group::Exact | Group::Codes => {
                for problem in problems::all().iter().filter(|problem| problem.group == group) {
                    rows.extend(problem.rows(march)?);
                }
            }
            Group::Adapted => rows.extend(adapted::adapted(march)?),
            Group::Orders => rows.extend(orders::orders(march)?),
            Group::Balance => rows.extend(balances::balances(march)?),
            Group::Fit => rows.extend(least_squares::rows()),
            Group::Twins => rows.extend(twins::twins(marches)?),
        }
    }
    Ok(rows)
}

/// Columns of the table at most, where no single text is longer.
const COLUMNS: usize = 100;

/// Rows as text: a line for the figures and, indented under it, what they are of and where they come from.
pub fn table(rows: &[Row]) -> String {
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
        let joint = if line.chars().count() + tolerance.chars().count() + 2 <= COLUMNS { "; " } else { ";\n        " };
        line += joint;
        let _ = writeln!(text, "{line}{tolerance}");
    }
    let failed = rows.iter().filter(|row| !row.pass()).count();
    let _ = writeln!(text, "{} of {} pass", rows.len() - failed, rows.len());
    text
}

/// Largest difference between two marches of an ensemble, over every member, sensor and instant, K.
///
/// Infinite where a member arrived in one march and not in the other, or a temperature is no number.
///
/// # Errors
/// As [`March::march`].
pub fn compare(
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
        if a.arrivals != b.arrivals || a.temperatures_k.len() != b.temperatures_k.len() {
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
