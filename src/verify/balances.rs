//! Conservation of heat and mass: inflow less outflow less storage.
//!
//! The scheme integrates the heat through the faces and the heat of reactions by its own stages. Both balances of heat
//! are of second order in the step, because a step takes the heat of new gas at the midpoint temperature. Mass is
//! conserved to rounding at any step: pores hold the gas that did not leave.
//!
//! With Darcy's law the heat balance keeps a residual `p Δε`, the work of gas that fills the additional pores of the
//! char: the march heats gas by `ε dp/dt`, where `d(εp)/dt` would close. This is 50 J/m² of a million at one atmosphere
//! (0.05 K) and does not vanish with the step, so no order is checked there.

use super::orders::{march_refined, order_row};
use super::problems::charring::charring_felt;
use super::problems::flexible;
use super::{Group, VerificationRow, problems};
use crate::case::{Case, GasFlowModel, Resolution};
use crate::march::{March, MarchError};
use crate::traces::{Balance, MemberStatus};

/// Tolerance of mass as a share of the mass moved, in double precision.
const MASS_TOLERANCE: f64 = 1e-12;
/// Tolerance of heat as a share of the heat moved.
const HEAT_TOLERANCE: f64 = 2e-4;

/// A case and the balances that are checked.
struct BalanceCase {
    case: Case,
    /// Whether heat is checked: not for gas flow at one temperature.
    checks_heat: bool,
    /// Whether the order of the heat residual is checked: it must exceed rounding and come from the steps alone.
    checks_order: bool,
}

/// Balances at the resolution of each case, and the order in the step of the heat balance.
///
/// # Errors
/// As [`March::march`].
pub(super) fn balance_rows(march: &mut dyn March) -> Result<Vec<VerificationRow>, MarchError> {
    let mut rows = Vec::new();
    for BalanceCase { case, checks_heat: of_heat, checks_order: of_order } in cases() {
        let row = |reference: &str, quantity: &str, difference, tolerance, unit: &str, source: &str| VerificationRow {
            group: Group::Balance,
            case: case.name.clone(),
            reference: reference.to_owned(),
            quantity: quantity.to_owned(),
            difference,
            tolerance,
            unit: unit.to_owned(),
            source_of_tolerance: source.to_owned(),
        };
        let [heat, mass] = residuals(march, &case, 1)?;
        if of_heat {
            rows.push(row(
                "heat in − heat out − heat stored",
                "residual of heat at the steps of the case",
                heat,
                HEAT_TOLERANCE,
                "of the heat moved",
                "0.02 % of the heat; wide: one limit for all cases, each at its own steps",
            ));
        }
        if of_order {
            let order = (heat / residuals(march, &case, 2)?[0]).log2();
            let row = order_row(&case.name, "self-convergence, steps halved", "Δt", order, 0.2);
            rows.push(VerificationRow { group: Group::Balance, ..row });
        }
        if case.gas.is_some() {
            rows.push(row(
                "solid lost + gas in − gas out − gas stored",
                "residual of mass at the steps of the case",
                mass,
                MASS_TOLERANCE,
                "of the mass moved",
                "rounding of some thousand f64 steps is 1e-13 at most; wide: rounding errors partly cancel",
            ));
        }
    }
    Ok(rows)
}

/// Residuals of heat and mass as shares of the amounts moved, each step cut into `cuts`; NaN if the march
/// failed.
fn residuals(march: &mut dyn March, case: &Case, cuts: usize) -> Result<[f64; 2], MarchError> {
    let traces = march_refined(march, case, 1, cuts)?;
    let balance = traces.balances.first().filter(|_| traces.statuses == [MemberStatus::Completed]);
    Ok([Balance::residual, Balance::mass_residual].map(|of| balance.map_or(f64::NAN, of).abs()))
}

/// Inert and charring layups, open and held faces, quasi-steady, Darcy and driven gas.
fn cases() -> Vec<BalanceCase> {
    let balanced = |case, of_heat, of_order| BalanceCase { case, checks_heat: of_heat, checks_order: of_order };
    let mut cases = vec![balanced(flexible::flexible_layup(), true, true)];
    for case in problems::all_problems().into_iter().map(|problem| problem.case) {
        match case.name.as_str() {
            "power laws, radiating" | "TACOT, surface held by a schedule" => {
                cases.push(balanced(Case { resolution: Resolution::default(), ..case }, true, true));
            }
            "gas driven in" => cases.push(balanced(case, false, false)),
            "charring slab, two reactions in a chain"
            | "charring slab, permeable 1e-12 m2"
            | "TACOT held at 1644 K" => {
                cases.push(balanced(case, true, false));
            }
            _ => {}
        }
    }
    cases.push(balanced(charring_felt(GasFlowModel::QuasiSteady, 0.0), true, true));
    cases.push(balanced(charring_felt(GasFlowModel::Darcy, 1e-13), true, false));
    cases
}
