//! `CaseBuilder`: valid cases are built unchanged, and an invalid field is reported with its path.
#![expect(clippy::unit_arg, reason = "each closure is an assignment, with `?` for a case without the field")]

use crate::support::{cases, files, schedule, text};
use bondline::case::{
    Case, CaseBuilder, Conductivity, Correlation, Decomposition, Emissivity, Face, Factor, GasFlowModel, Holder,
    LossFunction, Material, Observation, OpenFace, OutOfRange, Property, Reaction, Side, Table, ThreePartConductivity,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The path of a field, and a function that makes it invalid; `None` if the case has no such field.
type Break = (&'static str, fn(&mut CaseBuilder) -> Option<()>);

fn material(case: &mut CaseBuilder) -> &mut Material {
    Arc::make_mut(&mut case.layup.plies[0].material)
}

/// The decomposition of the first ply, if it has one.
fn decomposition(case: &mut CaseBuilder) -> Option<&mut Decomposition> {
    material(case).decomposition.as_mut()
}

fn reaction(case: &mut CaseBuilder) -> Option<&mut Reaction> {
    decomposition(case)?.reactions.first_mut()
}

/// The conductivity of the first ply, replaced by a solid part only.
fn parts(case: &mut CaseBuilder) -> &mut ThreePartConductivity {
    let conductivity = &mut material(case).conductivity;
    *conductivity = Conductivity::ThreePart(ThreePartConductivity {
        solid_w_m_k: 0.1,
        solid_exponent: 0.0,
        pores: Vec::new(),
        extinction_1_m: None,
        extinction_follows_density: false,
        range_k: (250.0, 1400.0),
    });
    let Conductivity::ThreePart(parts) = conductivity else { unreachable!("it was set to parts") };
    parts
}

/// The hot face, replaced by an insulated one.
fn hot(case: &mut CaseBuilder) -> &mut OpenFace {
    case.exposure.hot_face = Face::Open(OpenFace::insulated());
    let Face::Open(open) = &mut case.exposure.hot_face else { unreachable!("it was set to an open one") };
    open
}

fn factor(case: &mut CaseBuilder) -> Option<&mut Factor> {
    case.factors.first_mut()
}

fn observation(case: &mut CaseBuilder) -> Option<&mut Observation> {
    case.observations.first_mut()
}

const BREAKS: &[Break] = &[
    ("id", |case| Some(case.id.clear())),
    ("name", |case| Some(case.name = " ".to_owned())),
    ("layup.plies", |case| Some(case.layup.plies.clear())),
    ("layup.plies[0].thickness_m", |case| Some(case.layup.plies[0].thickness_m = f64::NAN)),
    ("layup.plies[0].thickness_m", |case| Some(case.layup.plies[0].thickness_m = f64::INFINITY)),
    ("layup.plies[0].thickness_m", |case| Some(case.layup.plies[0].thickness_m = 0.0)),
    ("layup.plies[0].thickness_m", |case| Some(case.layup.plies[0].thickness_m = -1e-3)),
    ("layup.plies[0].name", |case| Some(case.layup.plies[0].name.clear())),
    ("layup.plies[0].group", |case| Some(case.layup.plies[0].group.clear())),
    ("layup.plies[1].name", |case| {
        let name = case.layup.plies[0].name.clone();
        Some(case.layup.plies.get_mut(1)?.name = name)
    }),
    ("layup.plies[1].material.id", |case| {
        let mut other = Material::clone(&case.layup.plies[0].material);
        other.density_kg_m3 *= 1.01;
        other.id = other.id.to_uppercase().replace('_', "-");
        Some(case.layup.plies.get_mut(1)?.material = Arc::new(other))
    }),
    ("layup.contacts_w_m2_k", |case| Some(case.layup.contacts_w_m2_k.push(Some(500.0)))),
    ("layup.contacts_w_m2_k[0]", |case| Some(*case.layup.contacts_w_m2_k.first_mut()? = Some(-1.0))),
    ("layup.origin_m", |case| Some(case.layup.origin_m = f64::NAN)),
    ("layup.plies[0].material.density_kg_m3", |case| Some(material(case).density_kg_m3 = 0.0)),
    ("layup.plies[0].material.density_provenance.relative_uncertainty", |case| {
        Some(material(case).density_provenance.relative_uncertainty = Some(-0.1))
    }),
    ("layup.plies[0].material.emissivity_provenance.source", |case| {
        Some(material(case).emissivity_provenance.source.clear())
    }),
    ("layup.plies[0].material.heat_capacity.values[0]", |case| {
        Some(material(case).heat_capacity = Table::constant(-900.0))
    }),
    ("layup.plies[0].material.emissivity.values[0]", |case| Some(material(case).emissivity = Table::constant(1.5))),
    ("layup.plies[0].material.conductivity", |case| {
        Some(material(case).conductivity = Conductivity::Tables(Vec::new()))
    }),
    ("layup.plies[0].material.conductivity[0].values[0]", |case| {
        Some(material(case).conductivity = Conductivity::Tables(vec![(1e5, Table::constant(0.0))]))
    }),
    ("layup.plies[0].material.conductivity[1]", |case| {
        let tables = [1e5, 1e4].map(|pressure_pa| (pressure_pa, Table::constant(0.1)));
        Some(material(case).conductivity = Conductivity::Tables(tables.to_vec()))
    }),
    ("layup.plies[0].material.conductivity.range_k", |case| Some(parts(case).range_k = (1400.0, 250.0))),
    ("layup.plies[0].material.conductivity.solid_w_m_k", |case| Some(parts(case).solid_w_m_k = -0.1)),
    ("layup.plies[0].material.conductivity.solid_exponent", |case| Some(parts(case).solid_exponent = f64::NAN)),
    ("layup.plies[0].material.conductivity.pores[0]", |case| Some(parts(case).pores.push((0.5, 0.0)))),
    ("layup.plies[0].material.conductivity.extinction_1_m", |case| Some(parts(case).extinction_1_m = Some(0.0))),
    ("layup.plies[0].material.pores.porosity", |case| Some(material(case).pores.porosity = 1.0)),
    ("layup.plies[0].material.pores.permeability_m2", |case| Some(material(case).pores.permeability_m2 = -1e-12)),
    ("layup.plies[0].material.pores", |case| {
        let pores = &mut material(case).pores;
        Some((pores.porosity, pores.permeability_m2) = (0.0, 1e-12))
    }),
    ("layup.plies[0].material.decomposition.reactions", |case| Some(decomposition(case)?.reactions.clear())),
    ("layup.plies[0].material.decomposition.reactions", |case| {
        Some(decomposition(case)?.reactions.iter_mut().for_each(|reaction| reaction.mass_loss = 0.99))
    }),
    ("layup.plies[0].material.decomposition.reactions[0].mass_loss", |case| Some(reaction(case)?.mass_loss = 1.5)),
    ("layup.plies[0].material.decomposition.reactions[0].pre_exponential_1_s", |case| {
        Some(reaction(case)?.pre_exponential_1_s = 0.0)
    }),
    ("layup.plies[0].material.decomposition.reactions[0].order", |case| Some(reaction(case)?.order = -1.0)),
    ("layup.plies[0].material.decomposition.reactions[0].activation_energy_j_mol", |case| {
        Some(reaction(case)?.activation_energy_j_mol = -1.0)
    }),
    ("layup.plies[0].material.decomposition.reactions[0].heat_j_kg", |case| Some(reaction(case)?.heat_j_kg = f64::NAN)),
    ("layup.plies[0].material.decomposition.residues", |case| Some(decomposition(case)?.residues.clear())),
    ("layup.plies[0].material.decomposition.residues[0].name", |case| {
        Some(decomposition(case)?.residues[0].name.clear())
    }),
    ("layup.plies[0].material.decomposition.shrinkage", |case| Some(decomposition(case)?.shrinkage = 1.0)),
    ("sensors", |case| Some(case.sensors.clear())),
    ("sensors[0].name", |case| Some(case.sensors[0].name = "T 1".to_owned())),
    ("sensors[0].name", |case| Some(case.sensors[0].name = "file".to_owned())),
    ("sensors[1].name", |case| {
        let name = case.sensors[0].name.clone();
        Some(case.sensors.get_mut(1)?.name = name)
    }),
    ("sensors[0].depth_m", |case| Some(case.sensors[0].depth_m = f64::NAN)),
    ("sensors[0].depth_m", |case| Some(case.sensors[0].depth_m = -1e-3)),
    ("sensors[0].depth_m", |case| Some(case.sensors[0].depth_m = case.layup.back_m() + 1e-5)),
    ("sensors[0].side", |case| {
        let depth_m = case.layup.origin_m + 0.5 * case.layup.plies[0].thickness_m;
        Some((case.sensors[0].depth_m, case.sensors[0].side) = (depth_m, Side::Above))
    }),
    ("sensors[0].time_constant_s", |case| Some(case.sensors[0].time_constant_s = -1.0)),
    ("exposure.duration_s", |case| Some(case.exposure.duration_s = 0.0)),
    ("exposure.duration_s", |case| Some(case.exposure.duration_s = f64::NAN)),
    ("exposure.initial_k", |case| Some(case.exposure.initial_k.clear())),
    ("exposure.initial_k[0]", |case| Some(case.exposure.initial_k[0].1 = 0.0)),
    ("exposure.initial_k[1]", |case| Some(case.exposure.initial_k = vec![(1e-3, 300.0), (0.0, 310.0)])),
    ("exposure.pressure_pa", |case| Some(case.exposure.pressure_pa = schedule(&[0.0, 1.0], &[1e5, 0.0]))),
    ("exposure.back_pressure_pa", |case| {
        case.gas = None;
        Some(case.exposure.back_pressure_pa = Some(schedule(&[0.0], &[1e5])))
    }),
    ("exposure.holder.conductance_w_m3_k", |case| {
        let temperature_k = schedule(&[0.0], &[300.0]);
        Some(case.exposure.holder = Some(Holder { conductance_w_m3_k: 0.0, temperature_k }))
    }),
    ("exposure.holder.temperature_k", |case| {
        let temperature_k = schedule(&[0.0], &[-1.0]);
        Some(case.exposure.holder = Some(Holder { conductance_w_m3_k: 1.0, temperature_k }))
    }),
    ("exposure.hot_face", |case| Some(case.exposure.hot_face = Face::Held(schedule(&[0.0], &[0.0])))),
    ("exposure.hot_face.film_w_m2_k", |case| Some(hot(case).film_w_m2_k = schedule(&[0.0], &[-1.0]))),
    ("exposure.hot_face.gas_k", |case| Some(hot(case).gas_k = schedule(&[0.0], &[0.0]))),
    ("exposure.hot_face.emissivity", |case| Some(hot(case).emissivity = Emissivity::Constant(1.5))),
    ("exposure.hot_face.surroundings_k", |case| Some(hot(case).surroundings_k = schedule(&[0.0], &[-1.0]))),
    ("exposure.hot_face.recovery_enthalpy_j_kg", |case| {
        Some(hot(case).recovery_enthalpy_j_kg = Some(schedule(&[0.0], &[0.0])))
    }),
    ("exposure.hot_face.blowing", |case| Some(hot(case).blowing = schedule(&[0.0], &[2.0]))),
    ("exposure.hot_face.blowing", |case| Some(hot(case).blowing = schedule(&[0.0], &[0.5]))),
    ("exposure.hot_face.blowing", |case| {
        case.gas = None;
        let open = hot(case);
        Some((open.blowing, open.recovery_enthalpy_j_kg) = (schedule(&[0.0], &[0.5]), Some(schedule(&[0.0], &[9e6]))))
    }),
    ("exposure.back_face", |case| Some(case.exposure.back_face = Face::Held(schedule(&[0.0], &[0.0])))),
    ("gas", |case| {
        case.layup.plies.iter().find(|ply| ply.material.decomposition.is_some())?;
        case.gas.take().map(drop)
    }),
    ("gas.model", |case| {
        for ply in &mut case.layup.plies {
            Arc::make_mut(&mut ply.material).decomposition = None;
        }
        Some(case.gas.as_mut()?.model = GasFlowModel::QuasiSteady)
    }),
    ("gas.gas.viscosity.values[0]", |case| {
        Some(Arc::make_mut(&mut case.gas.as_mut()?.gas).viscosity = Table::constant(0.0))
    }),
    ("gas.gas.enthalpy", |case| {
        let falling = Table::new(vec![300.0, 400.0], vec![2e5, 1e5], OutOfRange::Clamp);
        Some(Arc::make_mut(&mut case.gas.as_mut()?.gas).enthalpy = falling.expect("a table"))
    }),
    ("factors[0].name", |case| Some(factor(case)?.name = "f k".to_owned())),
    ("factors[1].name", |case| {
        let name = factor(case)?.name.clone();
        Some(case.factors.get_mut(1)?.name = name)
    }),
    ("factors[0].nominal", |case| Some(factor(case)?.nominal = f64::NAN)),
    ("factors[0].nominal", |case| Some(factor(case)?.nominal = 10.0)),
    ("factors[0].small", |case| Some(factor(case)?.small = (1.1, 0.9))),
    ("factors[0].small", |case| Some(factor(case)?.small = (0.0, 1.1))),
    ("factors[0].small", |case| Some(factor(case)?.small = (0.9, f64::INFINITY))),
    ("factors[0].large", |case| Some(factor(case)?.large = (0.999, 1.001))),
    ("factors[0].group", |case| Some(factor(case)?.group = "NOBODY".to_owned())),
    ("factors[0].group", |case| {
        let factor = factor(case)?;
        Some((factor.property, factor.group) = (Property::Density, String::new()))
    }),
    ("factors[0].state", |case| {
        let group = case.layup.plies[0].name.clone();
        let factor = factor(case)?;
        Some((factor.property, factor.group, factor.state) = (Property::Conductivity, group, Some("ash".to_owned())))
    }),
    ("factors[1]", |case| {
        let first = factor(case)?.clone();
        Some(*case.factors.get_mut(1)? = Factor { name: "f_again".to_owned(), ..first })
    }),
    ("correlation", |case| {
        let other = Correlation::new(case.factors.len() + 2, &[(0, 1, 0.5)]);
        Some(case.correlation = other.expect("two factors can be correlated"))
    }),
    ("observations[0].sensor", |case| {
        let sensors = case.sensors.len();
        Some(observation(case)?.sensor = sensors)
    }),
    ("observations[1].sensor", |case| {
        let sensor = observation(case)?.sensor;
        Some(case.observations.get_mut(1)?.sensor = sensor)
    }),
    ("observations[0].times_s", |case| {
        let observation = observation(case)?;
        Some(
            (observation.times_s, observation.temperatures_k, observation.sigma_k) =
                (Vec::new(), Vec::new(), Vec::new()),
        )
    }),
    ("observations[0].times_s", |case| Some(observation(case)?.times_s[0] = -1.0)),
    ("observations[0].times_s[1]", |case| {
        let times_s = &mut observation(case)?.times_s;
        Some(times_s[1] = times_s[0])
    }),
    ("observations[0].times_s[1]", |case| Some(observation(case)?.times_s[1] = 1e9)),
    ("observations[0].temperatures_k[0]", |case| Some(observation(case)?.temperatures_k[0] = f64::NAN)),
    ("observations[0].temperatures_k", |case| observation(case)?.temperatures_k.pop().map(drop)),
    ("observations[0].sigma_k[0]", |case| Some(observation(case)?.sigma_k[0] = 0.0)),
    ("observations[0].window_s", |case| Some(observation(case)?.window_s = Some((10.0, 5.0)))),
    ("observations[0].window_s", |case| Some(observation(case)?.window_s = Some((1e-9, 2e-9)))),
    ("estimate.factors[0]", |case| Some(case.estimate.factors = vec![case.factors.len()])),
    ("estimate.factors[1]", |case| {
        factor(case)?;
        Some(case.estimate.factors = vec![0, 0])
    }),
    ("estimate.sensors[0]", |case| Some(case.estimate.sensors = vec![case.sensors.len()])),
    ("estimate.window_s", |case| Some(case.estimate.window_s = Some((5.0, 5.0)))),
    ("estimate.window_s", |case| Some(case.estimate.window_s = Some((case.exposure.duration_s, 1e9)))),
    ("estimate.start", |case| Some(case.estimate.start = vec![1.0; case.estimate.factors.len() + 1])),
    ("estimate.start[0]", |case| {
        case.estimate.factors.first()?;
        Some(case.estimate.start = vec![10.0; case.estimate.factors.len()])
    }),
    ("estimate.loss_function.width", |case| Some(case.estimate.loss_function = LossFunction::Huber { width: 0.0 })),
    ("resolution.cells", |case| Some(case.resolution.cells = 3)),
    ("resolution.cells", |case| Some(case.resolution.cells = 2000)),
    ("resolution.step_growth", |case| Some(case.resolution.step_growth = 0.0)),
    ("resolution.first_step_s", |case| Some(case.resolution.first_step_s = 0.0)),
    ("resolution.max_step_s", |case| Some(case.resolution.max_step_s = f64::NAN)),
    ("resolution.output_interval_s", |case| Some(case.resolution.output_interval_s = 1e-9 * case.exposure.duration_s)),
    ("resolution.tolerance_k", |case| Some(case.resolution.tolerance_k = Some(-0.05))),
];

#[test]
fn a_shipped_case_is_rebuilt_unchanged() {
    for case in cases() {
        let again = case.to_builder().build().unwrap_or_else(|error| panic!("{}: {error}", case.id()));
        assert_eq!(again, case);
        let mut other = case.to_builder();
        other.layup.plies[0].thickness_m *= 1.0 + 1e-6;
        assert_ne!(other, case.to_builder(), "{}: another thickness must be another case", case.id());
    }
}

#[test]
fn a_shipped_case_reads_the_same_from_memory_as_from_disk() {
    for case in cases() {
        // Paths are relative to the folder of the case; some cases name files of another case.
        let own = format!("{}/", case.id());
        let relative = |path: &str| path.strip_prefix(&own).map_or_else(|| format!("../{path}"), str::to_owned);
        let texts = files("cases", "").into_iter().map(|path| (relative(&path["cases/".len()..]), text(&path)));
        let texts: BTreeMap<String, String> = texts.collect();
        let read = |files: &BTreeMap<String, String>| Case::from_toml(&texts["case.toml"], case.id(), files);
        assert_eq!(read(&texts).unwrap_or_else(|error| panic!("{error}")), case);
        let names_files = texts["case.toml"].contains("file = ");
        assert_eq!(read(&BTreeMap::new()).is_err(), names_files, "{}", case.id());
    }
}

#[test]
fn an_invalid_field_is_reported_with_its_path_in_every_shipped_case_that_has_it() {
    let cases = cases();
    for (index, (path, invalidate)) in BREAKS.iter().enumerate() {
        let mut broken = 0;
        for case in &cases {
            let mut builder = case.to_builder();
            if invalidate(&mut builder).is_none() {
                continue;
            }
            broken += 1;
            let Err(error) = builder.build() else { panic!("{}: break {index} of {path} is built", case.id()) };
            let named = error.diagnostics.iter().find(|fault| &*fault.location.file == *path);
            assert!(
                named.is_some_and(|fault| !fault.message.is_empty()),
                "{}, break {index}: {path}: {error}",
                case.id()
            );
        }
        assert!(broken > 0, "no shipped case has a {path} to break");
    }
}

#[test]
fn all_errors_of_a_builder_are_reported_together() {
    let mut builder = cases().remove(0).to_builder();
    builder.layup.plies[0].thickness_m = -1.0;
    builder.exposure.duration_s = f64::NAN;
    builder.resolution.step_growth = 2.0;
    let error = builder.build().expect_err("three invalid fields");
    let paths: Vec<&str> = error.diagnostics.iter().map(|fault| &*fault.location.file).collect();
    for path in ["layup.plies[0].thickness_m", "exposure.duration_s", "resolution.step_growth"] {
        assert!(paths.contains(&path), "{path} is not among {paths:?}");
    }
}

#[test]
fn a_sensor_within_a_micrometre_of_an_interface_is_moved_onto_it() {
    let case = cases().into_iter().find(|case| case.layup().plies.len() > 2).expect("a case has several plies");
    let face_m = case.layup().interfaces_m()[1];
    for (off_m, expected_m) in [(5e-7, face_m), (-5e-7, face_m), (2e-6, face_m + 2e-6)] {
        let mut builder = case.to_builder();
        builder.sensors[0].depth_m = face_m + off_m;
        let built = builder.build().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(built.sensors()[0].depth_m, expected_m);
    }
}
