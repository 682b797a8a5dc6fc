//! Kinetics: isothermal slabs at a prescribed temperature or at their own.

use super::REFINED;
use crate::case::{Face, GasFlowModel, PyrolysisHeat, Reaction, ReactionScheme, Schedule, Table};
use crate::traces::Gauge;
use crate::verify::Group::{self, Codes, Exact};
use crate::verify::exact::kinetics::{Arrhenius, consecutive_reactions};
use crate::verify::exact::runge_kutta;
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, ReferencePoint, gauge_points, insulated_face, material,
};
use crate::verify::problem_materials::{
    constant_gas, decomposition, gas, linear_enthalpy, reaction, unchanged_residue, with_decomposition,
};
use crate::verify::reference;

pub(super) fn problems() -> Vec<Problem> {
    let mut problems = reaction_orders();
    problems.extend([phenolic(), phenolic_in_components(), chain(), chain_at_varying_temperature()]);
    problems.extend([cooled_by_reaction(false), cooled_by_reaction(true)]);
    problems
}

const THICKNESS_M: f64 = 1e-3;
const DENSITY_KG_M3: f64 = 280.0;

/// The components of a phenolic composite with PATO's constants: 30, 22.8 and 7.2 of 280 kg/m³ (TACOT 3.0,
/// github.com/nasa/pato).
pub(super) fn phenolic_reactions() -> Vec<Reaction> {
    let arrhenius = |rate_1_s, activation_energy_j_mol, onset_k| Arrhenius {
        rate_1_s,
        activation_energy_j_mol,
        order: 3.0,
        onset_k,
    };
    let late = arrhenius(4.97777e8, 1.69975e5, 555.6);
    vec![
        reaction(30.0 / 280.0, arrhenius(1.2e4, 71_130.89, 333.3), 0.0),
        reaction(22.8 / 280.0, late, 0.0),
        reaction(7.2 / 280.0, late, 0.0),
    ]
}

/// Solid mass lost by parallel reactions in a temperature ramp from 300 K, kg/m².
fn lost_kg_m2(reactions: &[Reaction], rise_k_s: f64, time_s: f64) -> f64 {
    let advanced = |reaction: &Reaction| {
        let &Reaction {
            pre_exponential_1_s: rate_1_s,
            activation_energy_j_mol,
            order,
            onset_temperature_k: onset_k,
            ..
        } = reaction;
        let arrhenius = Arrhenius { rate_1_s, activation_energy_j_mol, order, onset_k };
        1.0 - arrhenius.remaining(arrhenius.integrated_rate_constant(rise_k_s, 300.0, 300.0 + rise_k_s * time_s))
    };
    THICKNESS_M * DENSITY_KG_M3 * reactions.iter().map(|reaction| reaction.mass_loss * advanced(reaction)).sum::<f64>()
}

/// A slab whose faces follow one temperature schedule; the inside lags by 1e-9 K.
fn isothermal_slab(
    name: &str,
    group: Group,
    reactions: Vec<Reaction>,
    sequence: ReactionScheme,
    temperature_k: Schedule,
    checks: Vec<Check>,
) -> Problem {
    let virgin = material(DENSITY_KG_M3, Table::constant(1000.0), Table::constant(1e6));
    let residues = match sequence {
        ReactionScheme::Parallel => vec![unchanged_residue(&virgin)],
        ReactionScheme::Consecutive => vec![unchanged_residue(&virgin); reactions.len()],
    };
    let setting = ProblemSetup {
        plies: vec![(with_decomposition(&virgin, decomposition(sequence, reactions, residues)), THICKNESS_M)],
        start_k: temperature_k.values[0],
        hot_face: Face::Held(temperature_k.clone()),
        back_face: Face::Held(temperature_k),
        cells: 4,
        first_step_s: 1e-2,
        step_growth: 1.0,
    };
    Problem::new(group, name, setting, checks).with_gas_flow(GasFlowModel::Instantaneous, constant_gas(0.0))
}

fn temperature_ramp(rise_k_s: f64, duration_s: f64) -> Schedule {
    Schedule { times_s: vec![0.0, duration_s], values: vec![300.0, 300.0 + rise_k_s * duration_s] }
}

const COHEUR: &str = "exponential integral (Coheur et al. 2021)";

/// One reaction of each order from 300 to 1000 K at 1 K/s. That of order 0.5 ends at a finite time.
fn reaction_orders() -> Vec<Problem> {
    let problem = |(order, name)| {
        let arrhenius = Arrhenius { rate_1_s: 1e9, activation_energy_j_mol: 150e3, order, onset_k: 0.0 };
        let reactions = vec![reaction(0.5, arrhenius, 0.0)];
        let times_s = [300.0, 350.0, 400.0, 425.0, 450.0, 475.0, 500.0, 550.0, 600.0, 700.0];
        let check = Check {
            reference: COHEUR,
            quantity: "mass lost, 600 to 1000 K",
            points: gauge_points(Gauge::MassLost, &times_s, |time_s| lost_kg_m2(&reactions, 1.0, time_s)),
            tolerance: 1e-6,
            measure: ErrorScale::RelativeTo(0.5 * DENSITY_KG_M3 * THICKNESS_M),
            source_of_tolerance: "1e-6 of the mass to lose, cells and steps refined to it; wide: f32 needs half of it",
        };
        isothermal_slab(name, Exact, reactions, ReactionScheme::Parallel, temperature_ramp(1.0, 700.0), vec![check])
            .with_equal_steps(0.02)
    };
    [
        (0.5, "one reaction of order 0.5"),
        (1.0, "one reaction of order 1"),
        (2.0, "one reaction of order 2"),
        (3.0, "one reaction of order 3"),
    ]
    .map(problem)
    .into()
}

fn density_check(series: &'static str, reference: &'static str) -> Check {
    const FILE: &str = include_str!("../../../data/verification/tacot_kinetics.csv");
    let lost = |point: ReferencePoint| ReferencePoint { value: THICKNESS_M * (DENSITY_KG_M3 - point.value), ..point };
    Check {
        reference,
        quantity: "mass lost, 50 to 350 s",
        points: reference::gauge_points(FILE, series, "density_kg_m3", Gauge::MassLost).into_iter().map(lost).collect(),
        tolerance: 0.6 * THICKNESS_M,
        measure: ErrorScale::Absolute,
        source_of_tolerance: "0.6 kg/m³ over 1 mm: PATO, first order with steps of 1 s, lags by up to 0.57 kg/m³",
    }
}

fn exact_check(reactions: &[Reaction]) -> Check {
    let times_s: Vec<f64> = (2..=14).map(|i| 25.0 * f64::from(i)).collect();
    Check {
        reference: COHEUR,
        quantity: "mass lost, 50 to 350 s",
        points: gauge_points(Gauge::MassLost, &times_s, |time_s| lost_kg_m2(reactions, 3.1, time_s)),
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(60.0 * THICKNESS_M),
        source_of_tolerance: "1e-6 of the mass to lose, cells and steps refined to it; wide: f32 needs half of it",
    }
}

/// TACOT in a ramp of 3.1 K/s from 300 K.
fn phenolic() -> Problem {
    let reactions = phenolic_reactions();
    let checks = vec![exact_check(&reactions), density_check("PATO form", "PATO 3.1")];
    isothermal_slab(
        "TACOT at one temperature",
        Codes,
        reactions,
        ReactionScheme::Parallel,
        temperature_ramp(3.1, 350.0),
        checks,
    )
    .with_equal_steps(0.02)
}

/// The same phenolic in the form of CMA and FIAT: resin components A and B (300 to 0 and 900 to 600 kg/m³) fill half of
/// the solid volume fraction 0.2, so that each loses 30 kg/m³. Their rate constants refer to density over virgin
/// density; in terms of the advancement they are scaled by ((ρ_v − ρ_c)/ρ_v)^(m−1).
fn phenolic_in_components() -> Problem {
    let gas_constant_j_mol_k = 8.314_471_469;
    let component = |virgin_kg_m3: f64, char_kg_m3: f64, rate_1_s: f64, activation_k: f64, onset_k: f64| {
        let order = 3.0;
        let lost_share = (virgin_kg_m3 - char_kg_m3) / virgin_kg_m3;
        let arrhenius = Arrhenius {
            rate_1_s: rate_1_s * lost_share.powf(order - 1.0),
            activation_energy_j_mol: activation_k * gas_constant_j_mol_k,
            order,
            onset_k,
        };
        reaction(0.5 * 0.2 * (virgin_kg_m3 - char_kg_m3) / DENSITY_KG_M3, arrhenius, 0.0)
    };
    let reactions =
        vec![component(300.0, 0.0, 1.2e4, 8555.55, 333.33), component(900.0, 600.0, 4.48e9, 20_444.44, 555.55)];
    let checks = vec![exact_check(&reactions), density_check("FIAT form", "PATO 3.1, kinetics of FIAT")];
    isothermal_slab(
        "TACOT by component densities",
        Codes,
        reactions,
        ReactionScheme::Parallel,
        temperature_ramp(3.1, 350.0),
        checks,
    )
    .with_equal_steps(0.02)
}

/// A → B → C at constant rates; each reaction loses a quarter of the virgin mass.
fn chain() -> Problem {
    let steady = |rate_1_s| Arrhenius { rate_1_s, activation_energy_j_mol: 0.0, order: 1.0, onset_k: 0.0 };
    let reactions = vec![reaction(0.25, steady(0.389), 0.0), reaction(0.25, steady(0.262), 0.0)];
    let whole_kg_m2 = DENSITY_KG_M3 * THICKNESS_M;
    let lost = |[virgin, _, end]: [f64; 3]| 0.25 * whole_kg_m2 * (1.0 - virgin + end);
    let printed = [
        (1.0, [6.7773427e-1, 2.8111147e-1, 4.1154256e-2]),
        (10.0, [2.0445346e-2, 1.6037066e-1, 8.1918399e-1]),
        (50.0, [3.5725007e-9, 6.2535828e-6, 9.9999374e-1]),
    ];
    let check = |reference, points, tolerance, source_of_tolerance| Check {
        reference,
        quantity: "mass lost, 1 to 50 s",
        points,
        tolerance,
        measure: ErrorScale::RelativeTo(0.5 * whole_kg_m2),
        source_of_tolerance,
    };
    let place = |&(time_s, shares): &(f64, [f64; 3])| gauge_points(Gauge::MassLost, &[time_s], |_| lost(shares));
    let times_s = [0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0];
    isothermal_slab(
        "two reactions in a chain",
        Codes,
        reactions,
        ReactionScheme::Consecutive,
        Schedule::constant(600.0),
        vec![
            check(
                "closed form",
                gauge_points(Gauge::MassLost, &times_s, |time_s| lost(consecutive_reactions(0.389, 0.262, time_s))),
                1e-6,
                REFINED,
            ),
            check(
                "FDS two_step_solid_reaction (NIST)",
                printed.iter().flat_map(place).collect(),
                5e-7,
                "printed to eight digits; wide: f32 needs a fourth of it",
            ),
        ],
    )
    .with_equal_steps(2e-3)
}

/// Two consecutive reactions while the temperature rises, rests, falls and rises again, against an independent
/// integration.
fn chain_at_varying_temperature() -> Problem {
    let first = Arrhenius { rate_1_s: 3e5, activation_energy_j_mol: 85e3, order: 1.0, onset_k: 0.0 };
    let second = Arrhenius { rate_1_s: 2e7, activation_energy_j_mol: 125e3, order: 2.0, onset_k: 0.0 };
    let temperature_k =
        Schedule { times_s: vec![0.0, 20.0, 30.0, 40.0, 70.0], values: vec![300.0, 800.0, 800.0, 600.0, 1100.0] };
    let whole_kg_m2 = DENSITY_KG_M3 * THICKNESS_M;
    let mut advanced = [0.0; 2];
    let mut points = Vec::new();
    for leg in 0..28 {
        let span_s = 2.5 * f64::from(leg)..2.5 * f64::from(leg + 1);
        advanced = runge_kutta(advanced, span_s.clone(), 1e-3, |time_s, [one, two]| {
            let temperature_k = temperature_k.after(time_s);
            let left = one - two;
            [
                first.rate_constant_1_s(temperature_k) * (1.0 - one),
                second.rate_constant_1_s(temperature_k) * left * left,
            ]
        });
        let lost_kg_m2 = whole_kg_m2 * (0.3 * advanced[0] + 0.2 * advanced[1]);
        points.extend(gauge_points(Gauge::MassLost, &[span_s.end], |_| lost_kg_m2));
    }
    let check = Check {
        reference: "Runge–Kutta of fourth order in steps of 1 ms",
        quantity: "mass lost, 2.5 to 70 s",
        points,
        tolerance: 1e-6,
        measure: ErrorScale::RelativeTo(0.5 * whole_kg_m2),
        source_of_tolerance: REFINED,
    };
    let reactions = vec![reaction(0.3, first, 0.0), reaction(0.2, second, 0.0)];
    let name = "two reactions in a chain, varying temperature";
    isothermal_slab(name, Exact, reactions, ReactionScheme::Consecutive, temperature_k, vec![check])
        .with_equal_steps(2e-3)
}

/// An adiabatic slab cooled by its own reaction. With one heat capacity c for solid and gas, and gas that leaves at the
/// local temperature, c dT = H dρ/ρ. The heat of reaction is given directly or by absolute enthalpies; both give the
/// same temperature.
fn cooled_by_reaction(is_absolute: bool) -> Problem {
    let (start_k, capacity_j_kg_k, heat_j_kg, loss) = (900.0, 1500.0, 5e5, 0.4);
    let arrhenius = Arrhenius { rate_1_s: 1e6, activation_energy_j_mol: 1e5, order: 1.0, onset_k: 0.0 };
    let temperature_k = |advanced: f64| start_k + heat_j_kg / capacity_j_kg_k * (1.0 - loss * advanced).ln();
    let times_s: Vec<f64> = (1..=10).map(|i| 3.0 * f64::from(i)).collect();
    let advanced = |time_s: f64| {
        let rate = |_, [x]: [f64; 1]| [arrhenius.rate_constant_1_s(temperature_k(x)) * (1.0 - x)];
        runge_kutta([0.0], 0.0..time_s, 1e-3, rate)[0]
    };
    let virgin = material(DENSITY_KG_M3, Table::constant(capacity_j_kg_k), Table::constant(1e6));
    let mut decomposition = decomposition(
        ReactionScheme::Parallel,
        vec![reaction(loss, arrhenius, heat_j_kg)],
        vec![unchanged_residue(&virgin)],
    );
    let mut gas_made = constant_gas(capacity_j_kg_k);
    if is_absolute {
        // Enthalpies of the solids at 0 K; the reaction takes (virgin − (1 − loss) char)/loss per kg of gas.
        let (virgin_j_kg, char_j_kg) = (-8e5, 1e5);
        let lost_j_kg = (virgin_j_kg - (1.0 - loss) * char_j_kg) / loss;
        let reference_k = 300.0;
        let sensible_j_kg = capacity_j_kg_k * reference_k;
        decomposition.heat = PyrolysisHeat::AbsoluteEnthalpies {
            virgin_j_kg: virgin_j_kg + sensible_j_kg,
            residues_j_kg: vec![char_j_kg + sensible_j_kg],
            reference_k,
        };
        let mut enthalpy = linear_enthalpy(capacity_j_kg_k);
        for value in &mut enthalpy.values {
            *value += lost_j_kg + heat_j_kg;
        }
        gas_made = gas(Table::constant(0.022), enthalpy, Table::constant(3e-5));
    }
    let drop_k = start_k - temperature_k(1.0);
    let lost_kg_m2 = loss * DENSITY_KG_M3 * THICKNESS_M;
    let check = |quantity, points, measure| Check {
        reference: "c dT = H dρ/ρ, Runge–Kutta of fourth order",
        quantity,
        points,
        tolerance: 1e-6,
        measure,
        source_of_tolerance: REFINED,
    };
    let setting = ProblemSetup {
        plies: vec![(with_decomposition(&virgin, decomposition), THICKNESS_M)],
        start_k,
        hot_face: insulated_face(),
        back_face: insulated_face(),
        cells: 4,
        first_step_s: 1e-2,
        step_growth: 1.0,
    };
    let temperatures =
        times_s.iter().map(|&time_s| ReferencePoint::at(0.0, time_s, temperature_k(advanced(time_s)))).collect();
    let masses = gauge_points(Gauge::MassLost, &times_s, |time_s| lost_kg_m2 * advanced(time_s));
    let name = if is_absolute { "cooled by reaction, absolute heat" } else { "cooled by reaction, heat of reaction" };
    let checks = vec![
        check("temperature, 3 to 30 s", temperatures, ErrorScale::RelativeTo(drop_k)),
        check("mass lost, 3 to 30 s", masses, ErrorScale::RelativeTo(lost_kg_m2)),
    ];
    Problem::new(Exact, name, setting, checks)
        .with_gas_flow(GasFlowModel::Instantaneous, gas_made)
        .with_equal_steps(1e-3)
}
