//! Layups that decompose, and layups with gas flow.

use super::{KINETICS, SOLID, Text, flux};
use crate::support::Uniform;

pub(super) fn kinds(uniform: &mut Uniform) -> Vec<Text> {
    [decomposing(uniform), permeable(uniform)].concat()
}

/// Layups that decompose, without a pressure equation.
fn decomposing(u: &mut Uniform) -> Vec<Text> {
    let mut kinds = Vec::new();
    let layers = |u: &mut Uniform| {
        [("C", "nextel440-bf20", u.between(0.5, 1.0)), ("I", "pyrogel3350", u.between(2.0, 4.0)), ("G", "akk", 0.2)]
    };
    for (name, flow, blowing) in [
        ("quasi-steady gas", "quasi-steady", ""),
        ("unhindered gas", "unhindered", ""),
        ("blowing", "quasi-steady", "blowing = 0.5"),
    ] {
        let mut text = Text::new(name, &layers(u));
        text.top("decomposition = true\npressure = \"8 kPa\"");
        let heated = flux("flux", u.between(15.0, 25.0));
        text.add(&format!("[hot_face]\nkind = \"heated\"\n{heated}\nrecovery_enthalpy = \"8 MJ/kg\"\n{blowing}"));
        text.add(&format!("[gas]\nflow = \"{flow}\""));
        text.factors("I", &[SOLID.as_slice(), &["density"], &KINETICS].concat());
        text.factors("C", &["emissivity"]);
        text.factors("", &["heating"]);
        kinds.push(text);
    }

    let mut text = Text::new(
        "chain of reactions, separate states, a depth",
        &[("I", "chain", u.between(4.0, 6.0)), ("B", "sic-5hs", 1.0)],
    );
    text.top("decomposition = true\npressure = \"8 kPa\"");
    text.sensor("in", 1.5, "");
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("radiant_flux", u.between(6.0, 10.0))));
    text.factors("I", &[["density", "heat_capacity", "emissivity"].as_slice(), &KINETICS].concat());
    text.factors("in", &["sensor_depth"]);
    for state in ["virgin", "half", "char"] {
        text.add(&format!(
            "[[factor]]\nname = \"f_{state}\"\nproperty = \"conductivity.radiative\"\ngroup = \"I\"\n\
         state = \"{state}\"\n\
             small = [0.9, 1.1]"
        ));
    }
    kinds.push(text);

    let mut text = Text::new("absolute enthalpies and an onset", &[("T", "tacot", u.between(8.0, 12.0))]);
    text.top("decomposition = true");
    text.sensor("a", 1.0, "");
    text.sensor("b", 4.0, "");
    text.add(&format!(
        "[hot_face]\nkind = \"heated\"\n{}\nrecovery_enthalpy = \"20 MJ/kg\"\nblowing = 0.5\n[gas]\n\
         flow = \"quasi-steady\"\n\
         gas = \"tacot\"",
        flux("flux", u.between(40.0, 80.0))
    ));
    text.factors(
        "T",
        &[
            "conductivity",
            "heat_capacity",
            "density",
            "pre_exponential",
            "activation_energy",
            "char_yield",
            "emissivity",
        ],
    );
    text.factors("a", &["sensor_depth"]);
    kinds.push(text);
    kinds
}

/// Layups through which gas flows by Darcy's law.
fn permeable(u: &mut Uniform) -> Vec<Text> {
    let mut kinds = Vec::new();
    let mut text = Text::new(
        "gas driven through, conductivity over its pressure",
        &[("C", "nextel440-bf20", 0.5), ("F", "saffil-96", u.between(5.0, 10.0))],
    );
    text.top(
        "pressure.points = [[\"0 s\", \"3 kPa\"], [\"10 s\", \"3 kPa\"], [\"11 s\", \"4 kPa\"]]\n\
         pressure.outside = \"hold\"\n\
         contact_conductance = \"500 W/m^2/K\"",
    );
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 8.0))));
    text.add(
        "[back_face]\nkind = \"cooled\"\nheat_transfer_coefficient = \"10 W/m^2/K\"\nambient = \"300 K\"\n\
         pressure = \"3 kPa\"\n[gas]\nflow = \"darcy\"\ngas = \"air\"",
    );
    text.factors("C", &["permeability"]);
    text.factors("F", &["permeability", "conductivity", "thickness"]);
    kinds.push(text);

    let mut text = Text::new(
        "pressure alike on both sides, blowing without gas",
        &[("C", "nextel440-bf20", 0.5), ("F", "saffil-96", u.between(5.0, 10.0))],
    );
    text.top("pressure = \"3 kPa\"");
    text.add(&format!(
        "[hot_face]\nkind = \"heated\"\n{}\nrecovery_enthalpy = \"10 MJ/kg\"\nblowing = 0.5",
        flux("flux", u.between(4.0, 8.0))
    ));
    text.add(
        "[back_face]\nkind = \"cooled\"\nheat_transfer_coefficient = \"10 W/m^2/K\"\nambient = \"300 K\"\n\
         pressure = \"3 kPa\"\n[gas]\nflow = \"darcy\"\ngas = \"air\"",
    );
    text.factors("C", &["permeability"]);
    text.factors("F", &["permeability", "conductivity"]);
    text.factors("", &["heating"]);
    kinds.push(text);

    let mut text =
        Text::new("chain under Darcy's law", &[("I", "chain", u.between(4.0, 6.0)), ("B", "saffil-96", 2.0)]);
    text.top("decomposition = true\npressure = \"8 kPa\"");
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("radiant_flux", u.between(6.0, 10.0))));
    text.add("[gas]\nflow = \"darcy\"");
    text.factors("I", &[["permeability", "density", "conductivity"].as_slice(), &KINETICS].concat());
    kinds.push(text);

    let mut text = Text::new(
        "gas of a decomposing layer behind a wall",
        &[("C", "nextel440-bf20", 0.5), ("I", "pyrogel3350", u.between(2.0, 4.0)), ("G", "akk", 0.2)],
    );
    text.top("pressure = \"8 kPa\"\ndecomposition = true");
    text.0 = text.0.replace("material = \"akk\"", "material = \"akk\"\ndecomposition = false");
    text.add(&format!(
        "[hot_face]\nkind = \"heated\"\n{}\nrecovery_enthalpy = \"8 MJ/kg\"\nblowing = 0.5",
        flux("flux", u.between(15.0, 25.0))
    ));
    text.add("[gas]\nflow = \"darcy\"");
    text.factors("I", &[["permeability", "conductivity"].as_slice(), &KINETICS].concat());
    kinds.push(text);
    kinds
}
