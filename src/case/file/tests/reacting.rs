//! Decomposition, pores and gas: what files may say of them, and what is said of physics that cannot be.

use super::{Scratch, load, shipped};
use crate::case::{
    Case, Conductivity, Decomposition, Face, GasPath, Material, Mixing, PyrolysisHeat, Reaction, Sequence,
};

/// A material of its own beside a case of two plies, with every key that decomposition has, a line a key.
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
sequence = "chain"
mixing = "volume"
shrinkage = 0.1
mark = "estimated"
source = "made up"
uncertainty = "1 %"

[[decomposition.reaction]]
loss = 0.6
rate = "5e8 1/s"
activation = "130 kJ/mol"
order = 1
onset = "400 K"
heat = "0.6 MJ/kg"

[[decomposition.reaction]]
loss = 0.3
rate = "5e10 1/s"
activation = "175 kJ/mol"
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
coefficient = "10 W/m^2/K"
ambient = "300 K"

[gas]
flow = "darcy"

[[factor]]
name = "f"
group = "INS"
property = "char_yield"
small = [0.9, 1.1]
"#;

/// Replacements in one of the two files above, which it must hold.
fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from:?} stands in {text}");
        text.replacen(from, to, 1)
    })
}

pub(super) fn told(name: &str, case: &[(&str, &str)], material: &[(&str, &str)]) -> Vec<String> {
    let scratch = Scratch::new(&format!("reacting-{name}"));
    scratch.write("charring.toml", replaced(CHARRING, material));
    let (inert, _) = CHARRING.split_once("[decomposition]").expect("a decomposition");
    scratch.write("wall.toml", replaced(inert, &[("1e-12 m^2", "0 m^2")]));
    match Case::load(&scratch.write("case.toml", replaced(CASE, case))) {
        Ok(_) => Vec::new(),
        Err(error) => error.faults.iter().map(ToString::to_string).collect(),
    }
}

fn decomposition(id: &str) -> Decomposition {
    let material = Material::named(id).unwrap_or_else(|error| panic!("{error}"));
    material.decomposition.unwrap_or_else(|| panic!("{id} decomposes"))
}

#[test]
fn a_chain_is_read_with_its_intermediate_and_falls_back_on_the_virgin_substance() {
    assert_eq!(told("whole", &[], &[]), Vec::<String>::new());
    let scratch = Scratch::new("reacting-chain");
    let material = Material::load(&scratch.write("charring.toml", CHARRING)).unwrap_or_else(|error| panic!("{error}"));
    assert!((material.pores.slip_pa_k - 93.32).abs() < 0.01, "{}", material.pores.slip_pa_k);
    let chain = material.decomposition.expect("it decomposes");
    assert_eq!((chain.sequence, chain.mixing, chain.shrinkage), (Sequence::Chain, Mixing::Volume, 0.1));
    assert_eq!(chain.heat, PyrolysisHeat::OfReaction);
    let densities = chain.residue_densities_kg_m3(material.density_kg_m3);
    assert!((densities[0] - 200.0).abs() < 1e-9 && (densities[1] - 50.0).abs() < 1e-9, "{densities:?}");
    let first =
        Reaction { loss: 0.6, rate_1_s: 5e8, activation_j_mol: 130e3, order: 1.0, onset_k: 400.0, heat_j_kg: 0.6e6 };
    assert_eq!(chain.reactions[0], first);
    let [tar, char] = chain.residues.as_slice() else { panic!("two residues") };
    assert_eq!((tar.name.as_str(), char.name.as_str()), ("tar", "char"));
    assert_eq!((tar.emissivity.at(300.0), char.emissivity.at(300.0)), (0.95, 0.65));
    assert_eq!(char.heat_capacity, material.heat_capacity);
    assert_eq!(char.conductivity.parts(300.0, 1e5)[0], 0.1);
    // Radiation of a millimetre times σT³, in Rosseland's form.
    let [solid, gas, radiation] = tar.conductivity.parts(1000.0, 1e5);
    assert!((solid, gas) == (0.15, 0.0) && (radiation - 0.0567).abs() < 1e-5, "{radiation}");
    assert_eq!((char.pores.permeability_m2, char.pores.porosity, tar.pores), (1e-11, 0.5, material.pores));
}

#[test]
fn tacot_is_as_its_workshop_defined_it() {
    let tacot = decomposition("tacot");
    assert!((tacot.residue_densities_kg_m3(280.0)[0] - 220.0).abs() < 1e-6);
    let PyrolysisHeat::Absolute { virgin_j_kg, residues_j_kg, reference_k } = &tacot.heat else { panic!("absolute") };
    assert_eq!((*virgin_j_kg, residues_j_kg.as_slice(), *reference_k), (-857e3, &[0.0][..], 298.0));
    assert_eq!((tacot.reactions.len(), tacot.reactions[1].onset_k, tacot.reactions[2].order), (3, 555.6, 3.0));
    let case = load("tacot-held");
    assert_eq!(case.gas.map(|gas| (gas.path, gas.gas.id.clone())), Some((GasPath::Darcy, "tacot".to_owned())));
}

#[test]
fn densities_of_components_come_to_the_same_as_losses() {
    let chain = replaced(CHARRING, &[("\"chain\"", "\"side-by-side\"")]);
    let (kept, _) = chain.split_once("[[decomposition.reaction]]").expect("reactions");
    let component = "[[decomposition.reaction]]\nvolume_share = 0.5\nvirgin_density = \"600 kg/m^3\"\n\
                     char_density = \"300 kg/m^3\"\nrate = \"1e9 1/s\"\nactivation = \"150 kJ/mol\"\norder = 3\nheat = \"1 MJ/kg\"\n";
    let scratch = Scratch::new("reacting-component");
    let load = |text: String| Material::load(&scratch.write("component.toml", text));
    let material = load(format!("{kept}{component}")).unwrap_or_else(|error| panic!("{error}"));
    let reaction = &material.decomposition.expect("it decomposes").reactions[0];
    // 0.5 × (600 − 300)/500; 1e9 × ((600 − 300)/600)².
    assert!((reaction.loss - 0.3).abs() < 1e-12 && (reaction.rate_1_s - 2.5e8).abs() < 1e-3, "{reaction:?}");
    let said = |from: &str, to: &str| {
        let text = replaced(&format!("{kept}{component}"), &[(from, to)]);
        load(text).expect_err(to).to_string()
    };
    assert!(
        said("\"300 kg", "\"600 kg").contains("a char of 600 kg/m³ is no lighter than the 600 kg/m³ it comes from")
    );
    assert!(said("share = 0.5", "share = 0.9").contains("a component of 540 kg/m³ is heavier than the substance"));
}

#[test]
fn without_the_key_decomposition_every_ply_stays_as_it_was_made() {
    assert!(load("lcat-2259").layup.plies.iter().all(|ply| ply.material.decomposition.is_none()));
    assert!(load("lcat-2259").gas.is_none());
    let case = load("lcat-2259-pyrolysis");
    let reacts: Vec<bool> = case.layup.plies.iter().map(|ply| ply.material.decomposition.is_some()).collect();
    assert_eq!(reacts, [false, false, true, true, true]);
    let Face::Open(face) = &case.exposure.hot_face else { panic!("the hot face is open") };
    assert_eq!(face.blowing, 0.5);
    let quiet = Case::load_with(&shipped("lcat-2259"), &[("decomposition".into(), "true".into())]);
    let gas = quiet.unwrap_or_else(|error| panic!("{error}")).gas.expect("a gas of its own accord");
    assert_eq!((gas.path, gas.gas.id.as_str()), (GasPath::QuasiSteady, "pyrolysis"));
}

#[test]
fn pressures_run_through_time_and_a_pressure_at_the_back_opens_it() {
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
fn a_char_in_three_parts_is_scaled_part_by_part() {
    let material = Material::named("pyrogel3350").unwrap_or_else(|error| panic!("{error}"));
    let char = &decomposition("pyrogel3350").residues[0].conductivity;
    assert!(matches!(char, Conductivity::Parts(_)));
    for (virgin, char) in material.conductivity.parts(900.0, 8e3).into_iter().zip(char.parts(900.0, 8e3)) {
        assert!((char / virgin - 1.2).abs() < 1e-12, "{char} of {virgin}");
    }
}

/// A replacement in the material; where in its file the fault is; what is said of it.
const BROKEN_MATERIAL: &[(&str, &str, &str, &str)] = &[
    ("loss = 0.6", "loss = 0.8", ":35:1: ", "losses of 1.1 in all leave no char"),
    ("loss = 0.6", "loss = 1.2", ":44:8: ", "loss 1.2 lies outside 0 to 1"),
    ("loss = 0.6", "loss = -0.1", ":44:8: ", "loss -0.1 lies outside 0 to 1"),
    ("loss = 0.6\n", "", ":43:1: ", "a chain has no components"),
    ("\"130 kJ/mol\"", "\"-130 kJ/mol\"", ":46:14: ", "activation energy -130000 J/mol is negative"),
    ("order = 1", "order = -1", ":47:9: ", "order -1 is negative"),
    ("\"5e8 1/s\"", "\"0 1/s\"", ":45:8: ", "\"0 1/s\" is not positive"),
    ("\"5e8 1/s\"", "\"5e8 1/m\"", ":45:8: ", "wrong dimension: expected a rate"),
    ("heat = \"0.6 MJ/kg\"\n", "", ":43:1: ", "missing key \"heat\": expected the heat taken up"),
    ("shrinkage = 0.1", "shrinkage = 1.0", ":38:13: ", "shrinkage 1 lies outside 0 to 1"),
    ("\"chain\"", "\"chains\"", ":36:12: ", "unknown sequence \"chains\": did you mean \"chain\"?"),
    (
        "\"chain\"",
        "\"side-by-side\"",
        ":35:1: ",
        "2 reactions side by side leave 0 [[decomposition.intermediate]], found 1",
    ),
    ("order = 1\nheat = \"0.1", "order = 1\nlost = 3\nheat = \"0.1", ":56:1: ", "unknown key \"lost\""),
    ("density = \"200 kg/m^3\"", "density = \"600 kg/m^3\"", ":60:11: ", "no lighter than the virgin substance of 500"),
    ("density = \"200 kg/m^3\"", "density = \"210 kg/m^3\"", ":60:11: ", "is not what the losses leave, 200.0 kg/m³"),
    ("times_virgin = 0.5", "times_virgin = 0", ":69:33: ", "0 is not positive"),
    ("porosity = 0.5", "porosity = 1.0", ":28:12: ", "porosity 1 lies outside 0 to 1"),
    ("porosity = 0.5", "porosity = 0.0", ":27:1: ", "without pores nothing passes"),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":49:8: ", "the heat lies in absolute enthalpies"),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":35:1: ", "missing key \"virgin_enthalpy\""),
    ("shrinkage = 0.1", "heat = \"absolute\"", ":68:1: ", "missing key \"enthalpy\""),
    ("shrinkage = 0.1", "virgin_enthalpy = \"0 J/kg\"", ":38:1: ", "unknown key \"virgin_enthalpy\""),
];

#[test]
fn physics_of_a_material_that_cannot_be_is_refused_with_its_reason() {
    let mut untold = Vec::new();
    for (index, &(from, to, place, fragment)) in BROKEN_MATERIAL.iter().enumerate() {
        let found = told(&format!("material-{index}"), &[], &[(from, to)]);
        let place = format!("charring.toml{place}");
        if !found.iter().any(|fault| fault.contains(&place) && fault.contains(fragment)) {
            untold.push(format!("{to:?} at {place} {fragment:?}: {found:#?}"));
        }
    }
    assert!(untold.is_empty(), "{}", untold.join("\n"));
}

/// Replacements in the case, and what is said of it.
const BROKEN_CASE: &[(&[(&str, &str)], &str)] = &[
    (&[("decomposition = true", "decomposition = \"yes\"")], ":3:17: expected true or false, found text"),
    (&[("{ file = \"charring.toml\" }", "\"saffil-96\"")], ":3:17: no ply is of a material with a [decomposition]"),
    (&[("\"darcy\"", "\"darci\"")], ": unknown flow \"darci\": did you mean \"darcy\"?"),
    (&[("\"darcy\"", "\"darcy\"\ngas = \"airr\"")], ": unknown gas \"airr\": did you mean \"air\"?"),
    (
        &[("\"nextel440_bf20\"", "{ file = \"wall.toml\" }")],
        ":32:1: ply \"BASE\" makes gas that has no way out: nothing passes ply \"TOP\" above it, and the back is sealed",
    ),
    (
        &[("{ file = \"charring.toml\" }", "\"akk\"")],
        "ply \"BASE\" makes gas that has no way out: nothing passes it, and",
    ),
    (&[("{ file = \"charring.toml\" }", "\"tacot\"")], "has a sensible enthalpy, ply \"BASE\" has absolute ones"),
    (
        &[("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"1 kPa\""), ("\"darcy\"", "\"unhindered\"")],
        ":31:12: a pressure drives gas by Darcy's law alone",
    ),
    (
        &[("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"-1 kPa\"")],
        ":31:12: a pressure of -1000 Pa is not positive",
    ),
    (&[("decomposition = true\n", ""), ("\"darcy\"", "\"quasi-steady\"")], "no ply makes gas"),
    (&[("decomposition = true\n", "")], "(ply \"BASE\") does not decompose"),
    (&[("recovery_enthalpy = \"12 MJ/kg\"\n", "")], ":24:11: blowing reduces a `flux` with a `recovery_enthalpy`"),
    (&[("blowing = 0.5", "blowing = 5")], ":25:11: blowing 5 lies outside 0 to 1"),
    (&[("[0.9, 1.1]", "[0.9, 11.0]")], ":37:9: 11 times the 0.100 that \"charring\" (ply \"BASE\") leaves"),
    (&[("\"INS\"\nproperty = \"char_yield\"", "\"OF\"\nproperty = \"kinetics\"")], "(ply \"TOP\") does not decompose"),
    (&[("char_yield", "permeability"), ("\"darcy\"", "\"quasi-steady\"")], "no gas flows by Darcy's law"),
    (
        &[
            ("{ file = \"charring.toml\" }", "\"tacot\""),
            ("flow = \"darcy\"", "gas = \"tacot\""),
            ("char_yield", "pyrolysis_heat"),
        ],
        "lies in absolute enthalpies: there is none to scale",
    ),
];

#[test]
fn gas_that_cannot_flow_so_is_refused_with_its_reason() {
    let mut untold = Vec::new();
    for (index, &(changes, fragment)) in BROKEN_CASE.iter().enumerate() {
        let found = told(&format!("case-{index}"), changes, &[]);
        if !found.iter().any(|fault| fault.contains(fragment)) {
            untold.push(format!("{changes:?} {fragment:?}: {found:#?}"));
        }
    }
    assert!(untold.is_empty(), "{}", untold.join("\n"));
    let bare = CHARRING.find("[pores]").zip(CHARRING.find("[decomposition]")).map(|(from, to)| &CHARRING[from..to]);
    let found = told("bare", &[], &[(bare.expect("pores"), ""), ("pores = { permeability = \"1e-11 m^2\" }", "")]);
    assert!(found[0].contains("nobody knows how gas passes ply \"BASE\": \"charring\" has no [pores]"), "{found:?}");
    let open = [
        ("\"nextel440_bf20\"", "{ file = \"wall.toml\" }"),
        ("ambient = \"300 K\"", "ambient = \"300 K\"\npressure = \"1 kPa\""),
    ];
    let found = told("open", &open, &[]);
    assert_eq!(found, Vec::<String>::new(), "below the wall gas leaves by the back");
    let kept = [("{ file = \"charring.toml\" }", "\"akk\""), ("\"nextel440_bf20\"", "{ file = \"charring.toml\" }")];
    let found = told("kept", &[&kept[..], &[("\"INS\"\nprop", "\"OF\"\nprop")]].concat(), &[]);
    assert!(found[0].contains("ply \"BASE\" makes gas"), "{found:?}");
    let kept =
        [&kept[..], &[("\"3 mm\"", "\"3 mm\"\ndecomposition = false"), ("\"INS\"\nprop", "\"OF\"\nprop")]].concat();
    assert_eq!(told("virgin", &kept, &[]), Vec::<String>::new(), "a wall kept as it was made makes no gas");
}

#[test]
fn a_gas_beside_the_case_comes_before_the_one_built_in_and_must_hold() {
    let scratch = Scratch::new("reacting-gas");
    std::fs::create_dir_all(scratch.0.join("gases")).expect("a folder in a temporary folder");
    let own = include_str!("../../../../data/gases/air.toml");
    scratch.write("charring.toml", CHARRING);
    let path = scratch.write("case.toml", replaced(CASE, &[("\"darcy\"", "\"darcy\"\ngas = \"air\"")]));
    scratch.write("gases/air.toml", own.replace("28.96 g/mol", "30 g/mol"));
    let case = Case::load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.gas.expect("a gas").gas.molar_mass.at(300.0), 0.030);
    for (from, to, said) in [
        ("[-98, 2,", "[98, 2,", "air.toml:10:1: the enthalpy does not rise up to 300 K"),
        (
            "outside = \"clamp\"\n\n[visc",
            "outside = \"extrapolate\"\n\n[visc",
            "air.toml:10:1: an enthalpy cannot be extrapolated",
        ),
        ("level = \"sensible\"\n", "", "air.toml:10:1: missing key \"level\""),
        ("28.96 g/mol", "28.96 g", "air.toml:8:9: wrong dimension: expected a molar mass"),
    ] {
        scratch.write("gases/air.toml", replaced(own, &[(from, to)]));
        let error = Case::load(&path).expect_err(to).to_string();
        assert!(error.contains(said), "{said}: {error}");
    }
}
