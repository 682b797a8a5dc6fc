//! Is what comes in, less what goes out, what is stored? Of heat and of mass.
//!
//! Heat through the faces is integrated by the scheme itself, and what reactions take by its stages: both close at
//! second order in the step, as a step knows the heat of what it turns into gas at the temperature midway alone. Mass
//! closes to rounding at any step, since what a cell loses is what it gives off and pores hold what did not leave.
//!
//! By Darcy's law heat does not close beyond `p Δε`, the work of gas that fills the pores that char has and virgin
//! material had not: the march warms gas by `ε dp/dt`, where `d(εp)/dt` would close. That is 50 J/m² of a million at
//! one atmosphere, a twentieth of a kelvin, and no step makes it less; so no order is told there.

use super::orders::{carried, shortfall};
use super::problems::charring::smooth;
use super::problems::flexible;
use super::{Group, Row, problems};
use crate::case::{Case, GasPath, Resolution};
use crate::march::{March, MarchError};
use crate::traces::{Arrival, Balance};

/// Of the mass moved, in double precision.
const MASS: f64 = 1e-12;
/// Of the heat moved.
const HEAT: f64 = 2e-4;

/// A case, and what of it is told.
struct Balanced {
    case: Case,
    /// Whether its heat is more than what the gas carries at one temperature.
    of_heat: bool,
    /// Whether its residual of heat is there to fall with the steps: above rounding, and of the steps alone.
    of_order: bool,
}

/// Balances at the resolution of each case, and how that of heat closes as the clock is refined.
///
/// # Errors
/// As [`March::march`].
pub(super) fn balances(march: &mut dyn March) -> Result<Vec<Row>, MarchError> {
    let mut rows = Vec::new();
    for Balanced { case, of_heat, of_order } in cases() {
        let row = |reference: &str, quantity: &str, difference, tolerance, unit: &str, source: &str| Row {
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
                "heat in less heat out less heat stored",
                "residual at the steps of the case",
                heat,
                HEAT,
                "of the heat moved",
                "a fiftieth of a per cent of the heat; wide: one limit for all cases, each at the steps of its own",
            ));
        }
        if of_order {
            let order = (heat / residuals(march, &case, 2)?[0]).log2();
            rows.push(Row { group: Group::Balance, ..shortfall(&case.name, "itself at half", "Δt", order, 0.2) });
        }
        if case.gas.is_some() {
            rows.push(row(
                "solid lost and gas in less gas out less gas stored",
                "residual of mass at the steps of the case",
                mass,
                MASS,
                "of the mass moved",
                "rounding of some thousand steps in f64 is 1e-13 at most; wide: rounding adds up by chance",
            ));
        }
    }
    Ok(rows)
}

/// What is left of heat and of mass, of what moved, with each step cut into so many; no number where it did not arrive.
fn residuals(march: &mut dyn March, case: &Case, cuts: usize) -> Result<[f64; 2], MarchError> {
    let traces = carried(march, case, 1, cuts)?;
    let balance = traces.balances.first().filter(|_| traces.arrivals == [Arrival::Done]);
    Ok([Balance::residual, Balance::mass_residual].map(|of| balance.map_or(f64::NAN, of).abs()))
}

/// Inert and charring, faces open and held, gas as it is made, by Darcy's law and driven in.
fn cases() -> Vec<Balanced> {
    let balanced = |case, of_heat, of_order| Balanced { case, of_heat, of_order };
    let mut cases = vec![balanced(flexible::layup(), true, true)];
    for case in problems::all().into_iter().map(|problem| problem.case) {
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
    cases.push(balanced(smooth(GasPath::QuasiSteady, 0.0), true, true));
    cases.push(balanced(smooth(GasPath::Darcy, 1e-13), true, false));
    cases
}
