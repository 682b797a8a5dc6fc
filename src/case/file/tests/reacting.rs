//! Decomposition, pores and gas: valid files, and messages for impossible physics.

use super::{Scratch, load, shipped};
use crate::case::{
    Case, Conductivity, Decomposition, Face, GasFlowModel, Material, MixtureRule, PyrolysisHeat, Reaction,
    ReactionScheme, Schedule,
};

/// A material file with all keys of a decomposition, one key per line.
const CHARRING: &str = r#"name = "Charring"

[density]
value = "500 kg/m^3"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[heat_capacity]
value = "1500 J/kg/K"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[conductivity]
value = "0.2 W/m/K"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[emissivity]
value = 0.65
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[pores]
porosity = 0.5
permeability = "1e-12 m^2"
pore_radius = "1 um"
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[decomposition]
reaction_scheme = "consecutive"
mixture_rule = "volume"
shrinkage = 0.1
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[[decomposition.reaction]]
mass_loss = 0.6
pre_exponential = "5e8 1/s"
activation_energy = "130 kJ/mol"
order = 1
onset_temperature = "400 K"
heat = "0.6 MJ/kg"

[[decomposition.reaction]]
mass_loss = 0.3
pre_exponential = "5e10 1/s"
activation_energy = "175 kJ/mol"
order = 1
heat = "0.1 MJ/kg"

[[decomposition.intermediate]]
name = "tar"
density = "200 kg/m^3"
emissivity = { value = 0.95 }

[decomposition.intermediate.conductivity]
solid = "0.15 W/m/K"
extinction = "5333.333 1/m"
range = ["250 K", "2000 K"]

[decomposition.char]
conductivity = { times_virgin = 0.5 }
pores = { permeability = "1e-11 m^2" }
"#;

const CASE: &str = r#"initial_temperature = "300 K"
duration = "100 s"
decomposition = true

[[ply]]
name = "TOP"
group = "OF"
material = "nextel440_bf20"
thickness = "0.5 mm"

[[ply]]
name = "BASE"
group = "INS"
material = { file = "charring.toml" }
thickness = "3 mm"

[[sensor]]
name = "TC1"
below = "TOP"

[hot_face]
kind = "heated"
flux = "5 W/cm^2"
recovery_enthalpy = "12 MJ/kg"
blowing = 0.5

[back_face]
kind = "cooled"
heat_transfer_coefficient = "10 W/m^2/K"
ambient = "300 K"

[gas]
flow = "darcy"

[[factor]]
name = "f"
group = "INS"
property = "char_yield"
small = [0.9, 1.1]
"#;

/// The text of one of the files above after replacements.
fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from:?} is not in {text}");
        text.replacen(from, to, 1)
    })
}

pub(super) fn charring_errors(name: &str, case: &[(&str, &str)], material: &[(&str, &str)]) -> Vec<String> {
    let scratch = Scratch::new(&format!("reacting-{name}"));
    scratch.write("charring.toml", replaced(CHARRING, material));
    let (inert, _) = CHARRING.split_once("[decomposition]").expect("a decomposition");
    scratch.write("wall.toml", replaced(inert, &[("1e-12 m^2", "0 m^2")]));
    match Case::load(&scratch.write("case.toml", replaced(CASE, case))) {
        Ok(_) => Vec::new(),
        Err(error) => error.diagnostics.iter().map(ToString::to_string).collect(),
    }
}

fn decomposition(id: &str) -> Decomposition {
    let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
    material.decomposition.unwrap_or_else(|| panic!("{id} decomposes"))
}

#[test]
fn consecutive_reactions_are_read_with_their_intermediate_and_inherit_virgin_properties() {
    assert_eq!(charring_errors("whole", &[], &[]), Vec::<String>::new());
    let scratch = Scratch::new("reacting-chain");
    let material = Material::load(&scratch.write("charring.toml", CHARRING)).unwrap_or_else(|error| panic!("{error}"));
    assert!((material.pores.slip_pa_k - 93.32).abs() < 0.01, "{}", material.pores.slip_pa_k);
    let chain = material.decomposition.expect("it decomposes");
    assert_eq!(
        (chain.scheme, chain.mixture_rule, chain.shrinkage),
        (ReactionScheme::Consecutive, MixtureRule::VolumeFractions, 0.1)
    );
    assert_eq!(chain.heat, PyrolysisHeat::HeatsOfReaction);
    let densities = chain.residue_densities_kg_m3(material.density_kg_m3);
    assert!((densities[0] - 200.0).abs() < 1e-9 && (densities[1] - 50.0).abs() < 1e-9, "{densities:?}");
    let first = Reaction {
        mass_loss: 0.6,
        pre_exponential_1_s: 5e8,
        activation_energy_j_mol: 130e3,
        order: 1.0,
        onset_temperature_k: 400.0,
        heat_j_kg: 0.6e6,
    };
    assert_eq!(chain.reactions[0], first);
    let [tar, char] = chain.residues.as_slice() else { panic!("two residues") };
    assert_eq!((tar.name.as_str(), char.name.as_str()), ("tar", "char"));
    assert_eq!((tar.emissivity.at(300.0), char.emissivity.at(300.0)), (0.95, 0.65));
    assert_eq!(char.heat_capacity, material.heat_capacity);
    assert_eq!(char.conductivity.parts(300.0, 1e5)[0], 0.1);
    // Rosseland radiation: one millimetre times σT³.
    let [solid, gas, radiation] = tar.conductivity.parts(1000.0, 1e5);
    assert!((solid, gas) == (0.15, 0.0) && (radiation - 0.0567).abs() < 1e-5, "{radiation}");
    assert_eq!((char.pores.permeability_m2, char.pores.porosity, tar.pores), (1e-11, 0.5, material.pores));
}

#[test]
fn tacot_has_the_values_of_the_ablation_workshop() {
    let tacot = decomposition("tacot");
    assert!((tacot.residue_densities_kg_m3(280.0)[0] - 220.0).abs() < 1e-6);
    let PyrolysisHeat::AbsoluteEnthalpies { virgin_j_kg, residues_j_kg, reference_k } = &tacot.heat else {
        panic!("absolute")
    };
    assert_eq!((*virgin_j_kg, residues_j_kg.as_slice(), *reference_k), (-857e3, &[0.0][..], 298.0));
    assert_eq!(
        (tacot.reactions.len(), tacot.reactions[1].onset_temperature_k, tacot.reactions[2].order),
        (3, 555.6, 3.0)
    );
    let case = load("tacot-held");
    assert_eq!(case.gas.map(|gas| (gas.model, gas.gas.id.clone())), Some((GasFlowModel::Darcy, "tacot".to_owned())));
}

#[test]
fn component_densities_are_converted_to_mass_losses() {
    let chain = replaced(CHARRING, &[("\"consecutive\"", "\"parallel\"")]);
    let (head, _) = chain.split_once("[[decomposition.reaction]]").expect("reactions");
    let component = "[[decomposition.reaction]]\nvolume_share = 0.5\nvirgin_density = \"600 kg/m^3\"\n\
                     char_density = \"300 kg/m^3\"\npre_exponential = \"1e9 1/s\"\nactivation_energy = \"150 kJ/mol\"\n\
                     order = 3\nheat = \"1 MJ/kg\"\n";
    let scratch = Scratch::new("reacting-component");
    let load = |text: String| Material::load(&scratch.write("component.toml", text));
    let material = load(format!("{head}{component}")).unwrap_or_else(|error| panic!("{error}"));
    let reaction = &material.decomposition.expect("it decomposes").reactions[0];
    // 0.5 × (600 − 300)/500; 1e9 × ((600 − 300)/600)².
    assert!(
        (reaction.mass_loss - 0.3).abs() < 1e-12 && (reaction.pre_exponential_1_s - 2.5e8).abs() < 1e-3,
        "{reaction:?}"
    );
    let message = |from: &str, to: &str| {
        let text = replaced(&format!("{head}{component}"), &[(from, to)]);
        load(text).expect_err(to).to_string()
    };
    assert!(message("\"300 kg", "\"600 kg").contains("expected a char density below 600 kg/m³, found 600 kg/m³"));
    assert!(
        message("share = 0.5", "share = 0.9")
            .contains("expected a volume share times density of at most 500 kg/m³, found 540 kg/m³")
    );
}

#[test]
fn without_the_key_decomposition_all_plies_are_inert() {
    assert!(load("lcat-2259").layup.plies.iter().all(|ply| ply.material.decomposition.is_none()));
    assert!(load("lcat-2259").gas.is_none());
    let case = load("lcat-2259-pyrolysis");
    let reacts: Vec<bool> = case.layup.plies.iter().map(|ply| ply.material.decomposition.is_some()).collect();
    assert_eq!(reacts, [false, false, true, true, true]);
    let Face::Open(face) = &case.exposure.hot_face else { panic!("the hot face is open") };
    assert_eq!(face.blowing, Schedule::constant(0.5));
    let default = Case::load_with(&shipped("lcat-2259"), &[("decomposition".into(), "true".into())]);
    let gas = default.unwrap_or_else(|error| panic!("{error}")).gas.expect("a default gas");
    assert_eq!((gas.model, gas.gas.id.as_str()), (GasFlowModel::QuasiSteady, "pyrolysis"));
}

#[test]
fn pressures_may_vary_over_time_and_a_back_pressure_opens_the_back_face() {
    let case = load("permeation");
    let (front, back) = (&case.exposure.pressure_pa, case.exposure.back_pressure_pa.as_ref().expect("open"));
    assert_eq!((front.before(40.0), front.after(41.0), back.after(50.0)), (3000.0, 3500.0, 3000.0));
    let scratch = Scratch::new("reacting-pressure");
    scratch.write("charring.toml", CHARRING);
    scratch.write("p.csv", "time_s,face_kPa\n0,1\n10,8.01\n");
    let text =
        replaced(CASE, &[("decomposition", "pressure = { file = \"p.csv\", outside = \"hold\" }\ndecomposition")]);
    let case = Case::load(&scratch.write("case.toml", text)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.exposure.pressure_pa.after(10.0), 8010.0);
}

#[test]
fn all_parts_of_a_three_part_char_conductivity_are_scaled() {
    let material = Material::named("pyrogel3350").unwrap_or_else(|error| panic!("{error}"));
    let char = &decomposition("pyrogel3350").residues[0].conductivity;
    assert!(matches!(char, Conductivity::ThreePart(_)));
    for (virgin, char) in material.conductivity.parts(900.0, 8e3).into_iter().zip(char.parts(900.0, 8e3)) {
        assert!((char / virgin - 1.2).abs() < 1e-12, "{char} of {virgin}");
    }
}

/// A replacement in the material; line and column of the error; a part of its message.
const BROKEN_MATERIAL: &[(&str, &str, &str, &str)] = &[
    (
        "mass_loss = 0.6",
        "mass_loss = 0.8",
        ":35:1: ",
        "the mass losses of the reactions add up to 1.1: expected less than 1",
    ),
    (
        "mass_loss = 0.6",
        "mass_loss = 1.2",
        ":44:13: ",
        "expected a mass loss between 0 and 1 (gas per mass of virgin material), found 1.2",
    ),
    (
        "mass_loss = 0.6",
        "mass_loss = -0.1",
        ":44:13: ",
        "expected a mass loss between 0 and 1 (gas per mass of virgin material), found -0.1",
    ),
    (
        "mass_loss = 0.6\n",
        "",
        ":43:1: ",
        "missing key \"mass_loss\": expected the mass loss of each consecutive reaction",
    ),
    (
        "\"130 kJ/mol\"",
        "\"-130 kJ/mol\"",
        ":46:21: ",
        "expected an activation energy of 0 J/mol or more, found -130000 J/mol",
    ),
    ("order = 1", "order = -1", ":47:9: ", "expected a reaction order of 0 or more, found -1"),
    ("\"5e8 1/s\"", "\"0 1/s\"", ":45:19: ", "expected a value above 0, found \"0 1/s\""),
    ("\"5e8 1/s\"", "\"5e8 1/m\"", ":45:19: ", "wrong dimension: expected a rate"),
    ("heat = \"0.6 MJ/kg\"\n", "", ":43:1: ", "missing key \"heat\": expected the heat absorbed"),
    ("shrinkage = 0.1", "shrinkage = 1.0", ":38:13: ", "expected a shrinkage from 0 to below 1, found 1"),
    (
        "\"consecutive\"",
        "\"consecutively\"",
        ":36:19: ",
        "unknown reaction_scheme \"consecutively\": did you mean \"consecutive\"?",
    ),
    (
        "\"consecutive\"",
        "\"parallel\"",
        ":35:1: ",
        "expected 0 [[decomposition.intermediate]] for 2 parallel reactions, found 1",
    ),
    ("order = 1\nheat = \"0.1", "order = 1\nlost = 3\nheat = \"0.1", ":56:1: ", "unknown key \"lost\""),
    (
        "density = \"200 kg/m^3\"",
        "density = \"600 kg/m^3\"",
        ":60:11: ",
        "expected a density below the virgin 500 kg/m³, found 600 kg/m³",
    ),
    (
        "density = \"200 kg/m^3\"",
        "density = \"210 kg/m^3\"",
        ":60:11: ",
        "expected 200.0 kg/m³ from the mass losses of the reactions, found 210 kg/m³",
    ),
    ("times_virgin = 0.5", "times_virgin = 0", ":69:33: ", "expected a value above 0, found 0"),
    ("porosity = 0.5", "porosity = 1.0", ":28:12: ", "expected a porosity from 0 to below 1, found 1"),
    ("porosity = 0.5", "porosity = 0.0", ":27:1: ", "expected a porosity above 0 with a permeability of"),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":49:8: ", "expected no heat of reaction"),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":35:1: ", "missing key \"virgin_enthalpy\""),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":68:1: ", "missing key \"enthalpy\""),
    ("shrinkage = 0.1", "virgin_enthalpy = \"0 J/kg\"", ":38:1: ", "unknown key \"virgin_enthalpy\""),
];

#[test]
fn impossible_material_properties_are_refused_with_a_reason() {
    let mut missing = Vec::new();
    for (index, &(from, to, position, fragment)) in BROKEN_MATERIAL.iter().enumerate() {
        let found = charring_errors(&format!("material-{index}"), &[], &[(from, to)]);
        let position = format!("charring.toml{position}");
        if !found.iter().any(|fault| fault.contains(&position) && fault.contains(fragment)) {
            missing.push(format!("{to:?} at {position} {fragment:?}: {found:#?}"));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// Replacements in the case, and a part of the error message.
const BROKEN_CASE: &[(&[(&str, &str)], &str)] = &[
    (&[("decomposition = true", "decomposition = \"yes\"")], ":3:17: expected true or false, found text"),
    (&[("{ file = \"charring.toml\" }", "\"saffil-96\"")], ":3:17: no ply has a material with a [decomposition]"),
    (&[("\"darcy\"", "\"darci\"")], ": unknown flow \"darci\": did you mean \"darcy\"?"),
    (&[("\"darcy\"", "\"darcy\"\ngas = \"airr\"")], ": unknown gas \"airr\": did you mean \"air\"?"),
    (
        &[("\"nextel440_bf20\"", "{ file = \"wall.toml\" }")],
        ":32:1: the gas of ply \"BASE\" cannot leave the layup: ply \"TOP\" above it is impermeable, and the back face",
    ),
    (
        &[("{ file = \"charring.toml\" }", "\"akk\"")],
        "the gas of ply \"BASE\" cannot leave the layup: the ply is impermeable, and",
    ),
    (
        &[("{ file = \"charring.toml\" }", "\"tacot\"")],
        "as ply \"BASE\" has absolute enthalpies; gas \"pyrolysis\" has a sensible enthalpy",
    ),
    (
        &[("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"1 kPa\""), ("\"darcy\"", "\"unhindered\"")],
        ":31:12: a back-face pressure needs Darcy flow",
    ),
    (
        &[("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"-1 kPa\"")],
        ":31:12: expected a pressure above 0 Pa, found -1000 Pa",
    ),
    (
        &[("decomposition = true\n", ""), ("\"darcy\"", "\"quasi-steady\"")],
        "no ply decomposes: expected `decomposition = true`",
    ),
    (&[("decomposition = true\n", "")], "(ply \"BASE\") does not decompose"),
    (&[("recovery_enthalpy = \"12 MJ/kg\"\n", "")], ":24:11: blowing needs a flux with a recovery enthalpy"),
    (&[("blowing = 0.5", "blowing = 5")], ":25:11: expected blowing from 0 to 1 (0.5 laminar, 0.4 turbulent), found 5"),
    (
        &[("[0.9, 1.1]", "[0.9, 11.0]")],
        ":37:9: expected a char yield below 1, found 11 times 0.100 of material \"charring\" (ply \"BASE\")",
    ),
    (
        &[("\"INS\"\nproperty = \"char_yield\"", "\"OF\"\nproperty = \"pre_exponential\"")],
        "(ply \"TOP\") does not decompose",
    ),
    (&[("char_yield", "permeability"), ("\"darcy\"", "\"quasi-steady\"")], "the case has no Darcy flow"),
    (
        &[
            ("{ file = \"charring.toml\" }", "\"tacot\""),
            ("flow = \"darcy\"", "gas = \"tacot\""),
            ("char_yield", "pyrolysis_heat"),
        ],
        "has absolute enthalpies: there is no heat of reaction to scale",
    ),
];

#[test]
fn impossible_gas_transport_is_refused_with_a_reason() {
    let mut missing = Vec::new();
    for (index, &(changes, fragment)) in BROKEN_CASE.iter().enumerate() {
        let found = charring_errors(&format!("case-{index}"), changes, &[]);
        if !found.iter().any(|fault| fault.contains(fragment)) {
            missing.push(format!("{changes:?} {fragment:?}: {found:#?}"));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
    let bare = CHARRING.find("[pores]").zip(CHARRING.find("[decomposition]")).map(|(from, to)| &CHARRING[from..to]);
    let found =
        charring_errors("bare", &[], &[(bare.expect("pores"), ""), ("pores = { permeability = \"1e-11 m^2\" }", "")]);
    assert!(
        found[0].contains("Darcy flow needs the permeability of ply \"BASE\": material \"charring\" has no [pores]"),
        "{found:?}"
    );
    let open = [
        ("\"nextel440_bf20\"", "{ file = \"wall.toml\" }"),
        ("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"1 kPa\""),
    ];
    let found = charring_errors("open", &open, &[]);
    assert_eq!(found, Vec::<String>::new(), "gas below the wall leaves at the back face");
    let reversed =
        [("{ file = \"charring.toml\" }", "\"akk\""), ("\"nextel440_bf20\"", "{ file = \"charring.toml\" }")];
    let found = charring_errors("reversed", &[&reversed[..], &[("\"INS\"\nprop", "\"OF\"\nprop")]].concat(), &[]);
    assert!(found[0].contains("the gas of ply \"BASE\" cannot leave"), "{found:?}");
    let inert =
        [&reversed[..], &[("\"3 mm\"", "\"3 mm\"\ndecomposition = false"), ("\"INS\"\nprop", "\"OF\"\nprop")]].concat();
    assert_eq!(
        charring_errors("virgin", &inert, &[]),
        Vec::<String>::new(),
        "a wall without decomposition produces no gas"
    );
}

#[test]
fn a_gas_next_to_the_case_replaces_the_built_in_one_and_is_validated() {
    let scratch = Scratch::new("reacting-gas");
    std::fs::create_dir_all(scratch.0.join("gases")).expect("a folder in a temporary folder");
    let own = include_str!("../../../../data/gases/air.toml");
    scratch.write("charring.toml", CHARRING);
    let path = scratch.write("case.toml", replaced(CASE, &[("\"darcy\"", "\"darcy\"\ngas = \"air\"")]));
    scratch.write("gases/air.toml", own.replace("28.96 g/mol", "30 g/mol"));
    let case = Case::load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.gas.expect("a gas").gas.molar_mass.at(300.0), 0.030);
    for (from, to, message) in [
        ("[-98, 2,", "[98, 2,", "air.toml:12:1: enthalpies must increase: 2000 J/kg at 300 K follows 98000 J/kg"),
        (
            "outside = \"clamp\"\n\n[visc",
            "outside = \"extrapolate\"\n\n[visc",
            "air.toml:12:1: an enthalpy cannot be extrapolated",
        ),
        ("kind = \"sensible\"\n", "", "air.toml:12:1: missing key \"kind\""),
        ("28.96 g/mol", "28.96 g", "air.toml:10:9: wrong dimension: expected a molar mass"),
    ] {
        scratch.write("gases/air.toml", replaced(own, &[(from, to)]));
        let error = Case::load(&path).expect_err(to).to_string();
        assert!(error.contains(message), "{message}: {error}");
    }
}
