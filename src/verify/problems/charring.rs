//! Charring slabs: a reference case of gpyro, convective boards, and a smooth felt for orders and balances.

use super::{CELSIUS_K, MOL};
use crate::case::{
    Case, Conductivity, Emissivity, Face, Gas, GasFlowModel, Material, MixtureRule, OpenFace, Pores, ReactionScheme,
    Residue, Resolution, Schedule, Table, ThreePartConductivity,
};
use crate::traces::Gauge;
use crate::verify::Group::{Codes, Orders};
use crate::verify::exact::kinetics::Arrhenius;
use crate::verify::problem::{
    Check, ErrorScale, Problem, ProblemSetup, ReferencePoint, clamped_table, insulated_face, material, points,
};
use crate::verify::problem_materials::{
    constant_gas, decomposition, gas, linear_enthalpy, pressure_independent, reaction, with_decomposition, with_pores,
};
use crate::verify::reference;
use std::sync::Arc;

pub(super) fn problems() -> Vec<Problem> {
    let boards = [charring_board("film"), charring_board("blown")];
    vec![gpyro_chain(), gpyro_permeable("permeable 1e-12 m2", 1e-12), gpyro_permeable("permeable 1e-13 m2", 1e-13)]
        .into_iter()
        .chain(boards)
        .collect()
}

const GPYRO: &str = "gpyro 0.8200";
const GPYRO_GAS: &str = include_str!("../../../data/verification/gpyro_charring_slab_gas.csv");
/// Molar mass of the gas, kg/mol.
const GPYRO_KG_MOL: f64 = 0.044;

/// Virgin, intermediate and char of 500, 200 and 50 kg/m³, mixed by volume. The latter two have radiative
/// conductivities of 0.001 m and 0.002 m times σT³.
fn gpyro_substance(permeability_m2: f64) -> Arc<Material> {
    let pores = Pores { porosity: 0.5, permeability_m2, ..Pores::IMPERMEABLE };
    let virgin = Material {
        emissivity: Table::constant(0.65),
        ..with_pores(&material(500.0, Table::constant(1500.0), Table::constant(0.2)), pores)
    };
    let residue = |name: &str, solid_w_m_k, radiating_m: f64, emissivity| Residue {
        name: name.to_owned(),
        heat_capacity: Table::constant(1500.0),
        conductivity: Conductivity::ThreePart(ThreePartConductivity {
            solid_w_m_k,
            solid_exponent: 0.0,
            pores: Vec::new(),
            extinction_1_m: Some(16.0 / (3.0 * radiating_m)),
            extinction_follows_density: false,
            range_k: (250.0, 2000.0),
        }),
        emissivity: Table::constant(emissivity),
        pores,
    };
    let arrhenius =
        |rate_1_s, activation_energy_j_mol| Arrhenius { rate_1_s, activation_energy_j_mol, order: 1.0, onset_k: 0.0 };
    let mut decomposition = decomposition(
        ReactionScheme::Consecutive,
        vec![reaction(0.6, arrhenius(5e8, 130e3), 6e5), reaction(0.3, arrhenius(5e10, 175e3), 1e5)],
        vec![residue("intermediate", 0.15, 0.001, 0.95), residue("char", 0.10, 0.002, 0.90)],
    );
    decomposition.mixture_rule = MixtureRule::VolumeFractions;
    with_decomposition(&virgin, decomposition)
}

/// Gas of 1000 J/kg/K. Its viscosity is density times self-diffusivity by Chapman–Enskog theory, with the collision
/// integral of P. Neufeld, A. Janzen, R. Aziz (1972) for σ = 5.061 Å and ε/k = 254 K.
fn gpyro_gas() -> Arc<Gas> {
    let viscosity_pa_s = |temperature_k: f64| {
        let reduced = temperature_k / 254.0;
        let collision = 1.06036 / reduced.powf(0.1561)
            + 0.193 / (0.47635 * reduced).exp()
            + 1.03587 / (1.52996 * reduced).exp()
            + 1.76474 / (3.89411 * reduced).exp();
        let root = (temperature_k.powi(3) * 2.0 / 44.0).sqrt();
        let diffusivity_m2_s = 1e-4 * 0.001_858_3 * root / (5.061 * 5.061 * collision);
        101_325.0 * GPYRO_KG_MOL / (8.314 * temperature_k) * diffusivity_m2_s
    };
    let at_k: Vec<f64> = (10..=60).map(|i| 25.0 * f64::from(i)).collect();
    let viscosity = clamped_table(at_k.clone(), at_k.iter().map(|&t| viscosity_pa_s(t)).collect());
    gas(Table::constant(GPYRO_KG_MOL), linear_enthalpy(1000.0), viscosity)
}

/// 8 mm at 300 K under 25 kW/m² of radiation on a grey face, with convection of 10 W/m²/K.
fn gpyro_setting(permeability_m2: f64) -> ProblemSetup {
    ProblemSetup {
        plies: vec![(gpyro_substance(permeability_m2), 0.008)],
        start_k: 300.0,
        hot_face: Face::Open(OpenFace {
            radiant_w_m2: Schedule::constant(25e3),
            film_w_m2_k: Schedule::constant(10.0),
            emissivity: Emissivity::Material,
            ..OpenFace::insulated()
        }),
        back_face: insulated_face(),
        cells: 320,
        first_step_s: 1e-3,
        step_growth: 0.02,
    }
}

fn gpyro_chain() -> Problem {
    const FILE: &str = include_str!("../../../data/verification/gpyro_charring_slab.csv");
    let checks = vec![
        Check {
            reference: GPYRO,
            quantity: "faces and middle, 100 to 800 s",
            points: reference::points(FILE, "gpyro", CELSIUS_K),
            tolerance: 0.5,
            measure: ErrorScale::Absolute,
            source_of_tolerance: "an independent code of the same equations agrees within 0.5 K",
        },
        Check {
            reference: GPYRO,
            quantity: "gas flux, 100 to 800 s",
            points: reference::gauge_points(GPYRO_GAS, "slab", "gas_flux_kg_m2_s", Gauge::GasFlux),
            tolerance: 0.01,
            measure: ErrorScale::Relative,
            source_of_tolerance: "an independent code of the same equations agrees within 1 %",
        },
    ];
    let mut problem = Problem::new(Codes, "charring slab, two reactions in a chain", gpyro_setting(0.0), checks)
        .with_gas_flow(GasFlowModel::QuasiSteady, gpyro_gas());
    problem.case.resolution.max_step_s = 0.25;
    problem
}

/// The same slab with gas pressure. Permeabilities are those of gpyro; the porosity is not.
fn gpyro_permeable(series: &'static str, permeability_m2: f64) -> Problem {
    let over = reference::gauge_points(GPYRO_GAS, series, "overpressure_pa", Gauge::BackPressure);
    let at_back = |point: &ReferencePoint| ReferencePoint { value: 101_325.0 + point.value, ..*point };
    // From 300 s on: before, the flux doubles within a minute.
    let points: Vec<ReferencePoint> = over.iter().filter(|point| point.time_s > 250.0).map(at_back).collect();
    let largest_pa = over.iter().map(|point| point.value).fold(0.0, f64::max);
    let check = Check {
        reference: GPYRO,
        quantity: "pressure at the back, 300 to 700 s",
        points,
        tolerance: 0.02,
        measure: ErrorScale::RelativeTo(largest_pa),
        source_of_tolerance: "gpyro on 81 cells in steps of 0.1 s; its gas flux differs by 1 % from 321 cells",
    };
    let name = format!("charring slab, {series}");
    let mut problem = Problem::new(Codes, &name, gpyro_setting(permeability_m2), vec![check])
        .with_gas_flow(GasFlowModel::Darcy, gpyro_gas());
    problem.case.resolution.max_step_s = 0.25;
    problem
}

/// A charring board heated by convection: by a film coefficient and a hot gas, or by a cold-wall flux with recovery
/// enthalpy and blowing.
fn charring_board(series: &'static str) -> Problem {
    const HEAT: &str = include_str!("../../../data/verification/charring_board.csv");
    const GAS: &str = include_str!("../../../data/verification/charring_board_gas.csv");
    let virgin = material(300.0, Table::constant(1200.0), Table::constant(0.15));
    let virgin = Material { emissivity: Table::constant(0.7), ..Material::clone(&virgin) };
    let char = Residue {
        name: "char".to_owned(),
        heat_capacity: Table::constant(1100.0),
        conductivity: pressure_independent(Table::constant(0.25)),
        emissivity: Table::constant(0.9),
        pores: virgin.pores,
    };
    let arrhenius = Arrhenius { rate_1_s: 1e6, activation_energy_j_mol: 1e5, order: 1.0, onset_k: 0.0 };
    let mut decomposition = decomposition(ReactionScheme::Parallel, vec![reaction(0.3, arrhenius, 1e6)], vec![char]);
    decomposition.mixture_rule = MixtureRule::VolumeFractions;
    let rising = |end: f64, start: f64| Schedule { times_s: vec![0.0, 5.0, 60.0], values: vec![start, end, end] };
    let open = OpenFace { emissivity: Emissivity::Material, ..OpenFace::insulated() };
    let (name, open) = match series {
        "film" => (
            "charring board, film to hot gas",
            OpenFace {
                film_w_m2_k: Schedule::constant(200.0),
                heating_scales_film: true,
                gas_k: rising(1400.0, 300.0),
                ..open
            },
        ),
        _ => (
            "charring board, recovery enthalpy and blowing",
            OpenFace {
                flux_w_m2: rising(250e3, 0.0),
                recovery_enthalpy_j_kg: Some(Schedule::constant(8e6)),
                blowing: Schedule::constant(0.5),
                ..open
            },
        ),
    };
    let check = |quantity, points, tolerance, measure, source_of_tolerance| Check {
        reference: MOL,
        quantity,
        points,
        tolerance,
        measure,
        source_of_tolerance,
    };
    let (lost, flux) = ("mass_lost_kg_m2", "gas_flux_kg_m2_s");
    let converged =
        "reference converged to 2.4 mK and 1e-5 of mass and flux; wide: one limit for both kinds of heating";
    let checks = vec![
        check("6 depths, 2.5 to 60 s", reference::points(HEAT, series, 0.0), 0.05, ErrorScale::Absolute, converged),
        check(
            "mass lost, 2.5 to 60 s",
            reference::gauge_points(GAS, series, lost, Gauge::MassLost),
            3e-5,
            ErrorScale::RelativeTo(0.54),
            converged,
        ),
        check(
            "gas flux, 2.5 to 60 s",
            reference::gauge_points(GAS, series, flux, Gauge::GasFlux),
            3e-4,
            ErrorScale::RelativeTo(0.02),
            converged,
        ),
    ];
    let setting = ProblemSetup {
        plies: vec![(with_decomposition(&virgin, decomposition), 0.006)],
        start_k: 300.0,
        hot_face: Face::Open(open),
        back_face: insulated_face(),
        cells: 320,
        first_step_s: 1e-3,
        step_growth: 0.001,
    };
    let mut problem =
        Problem::new(Codes, name, setting, checks).with_gas_flow(GasFlowModel::QuasiSteady, constant_gas(1500.0));
    // Blowing uses the gas flux of the previous step: at its onset steps of 50 ms are 1 K off, steps of 2.5 ms 0.04 K.
    problem.case.resolution.max_step_s = 0.0025;
    problem
}

/// The smooth felt with a sealed back under a cover of the given permeability. At zero the gas cannot leave the layup,
/// which case files may not say.
pub fn covered_felt(permeability_m2: f64) -> Case {
    let mut case = charring_felt(GasFlowModel::Darcy, 1e-13);
    let mut cover = case.layup.plies[0].clone();
    let material = Arc::make_mut(&mut cover.material);
    material.decomposition = None;
    material.pores = Pores { permeability_m2, ..Pores::IMPERMEABLE };
    cover.name = "cover".to_owned();
    cover.thickness_m = 1e-3;
    case.layup.plies.insert(0, cover);
    case.layup.contacts_w_m2_k.push(None);
    case
}

/// A 5 mm felt charred by two reactions under a flux that rises from zero: smooth in space and time, for orders of
/// accuracy. With Darcy flow the overpressure reaches 0.2 atm.
pub fn charring_felt(path: GasFlowModel, permeability_m2: f64) -> Case {
    // The tables extend beyond the temperatures of the felt: the end of a table is a corner.
    let straight = |at_300_k: f64, at_1800_k: f64| {
        let beyond = (at_1800_k - at_300_k) / 15.0;
        clamped_table(vec![200.0, 1900.0], vec![at_300_k - beyond, at_1800_k + beyond])
    };
    let pores = |porosity, permeability_m2| Pores { porosity, permeability_m2, slip_pa_k: 20.0, ..Pores::IMPERMEABLE };
    let virgin =
        with_pores(&material(200.0, straight(1000.0, 1800.0), straight(0.08, 0.3)), pores(0.7, permeability_m2));
    let char = Residue {
        name: "char".to_owned(),
        heat_capacity: straight(900.0, 1900.0),
        conductivity: pressure_independent(straight(0.1, 0.5)),
        emissivity: Table::constant(0.8),
        pores: pores(0.8, 2.0 * permeability_m2),
    };
    let arrhenius =
        |rate_1_s, activation_energy_j_mol, order| Arrhenius { rate_1_s, activation_energy_j_mol, order, onset_k: 0.0 };
    let reactions = vec![reaction(0.1, arrhenius(3e4, 7e4, 1.0), 4e5), reaction(0.2, arrhenius(1e5, 9e4, 2.0), 8e5)];
    let gas = gas(straight(0.03, 0.02), straight(4e5, 3e6), straight(1.5e-5, 5e-5));
    let watched = Check {
        reference: "",
        quantity: "",
        points: points(&[0.0, 1e-3, 2.5e-3, 5e-3], &[60.0], |_, _| 0.0),
        tolerance: f64::INFINITY,
        measure: ErrorScale::Absolute,
        source_of_tolerance: "",
    };
    let setting = ProblemSetup {
        plies: vec![(
            with_decomposition(&virgin, decomposition(ReactionScheme::Parallel, reactions, vec![char])),
            5e-3,
        )],
        start_k: 300.0,
        hot_face: Face::Open(OpenFace {
            flux_w_m2: Schedule { times_s: vec![0.0, 30.0], values: vec![0.0, 60e3] },
            emissivity: Emissivity::Constant(0.8),
            ..OpenFace::insulated()
        }),
        back_face: insulated_face(),
        cells: 160,
        first_step_s: 0.0,
        step_growth: 0.0,
    };
    let name = match path {
        GasFlowModel::Instantaneous => "charring felt, gas unhindered",
        GasFlowModel::QuasiSteady => "charring felt, quasi-steady gas",
        GasFlowModel::Darcy => "charring felt, Darcy flow",
    };
    let mut case = Problem::new(Orders, name, setting, vec![watched]).with_gas_flow(path, gas).case;
    case.resolution = Resolution::default();
    case
}
