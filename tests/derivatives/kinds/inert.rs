//! Layups without decomposition: every kind of heating and boundary, and sensors with lag or uncertain depth.

use super::{PARTS, SOLID, Text, flux};
use crate::support::Uniform;

pub(super) fn kinds(uniform: &mut Uniform) -> Vec<Text> {
    [heated(uniform), bounded(uniform), at_sensors(uniform)].concat()
}

/// Two plies: cloth on felt.
fn two(name: &str, u: &mut Uniform) -> Text {
    Text::new(name, &[("C", "nextel440-bf20", u.between(0.5, 1.5)), ("F", "saffil-96", u.between(3.0, 8.0))])
}

/// Every kind of heating.
fn heated(u: &mut Uniform) -> Vec<Text> {
    let mut kinds = Vec::new();
    let mut text = two("heated, insulated back", u);
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 12.0))));
    text.factors("C", &[SOLID.as_slice(), &["density", "emissivity"]].concat());
    text.factors("F", &[SOLID.as_slice(), &["density"]].concat());
    text.factors("", &["heating"]);
    text.add("[[correlation]]\nfactors = [\"f_C_density\", \"f_F_density\"]\nvalue = 0.5");
    kinds.push(text);

    let mut text = two("recovery enthalpy", u);
    let enthalpy = u.between(5.0, 15.0);
    let heated = flux("flux", u.between(4.0, 12.0));
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{heated}\nrecovery_enthalpy = \"{enthalpy:.3} MJ/kg\""));
    text.factors("C", &["emissivity", "conductivity"]);
    text.factors("", &["heating"]);
    kinds.push(text);

    let mut text = two("radiant flux and a film", u);
    let heated = flux("radiant_flux", u.between(4.0, 12.0));
    text.add(&format!(
        "[hot_face]\nkind = \"heated\"\n{heated}\nheat_transfer_coefficient = \"15 W/m^2/K\"\ngas = \"300 K\""
    ));
    text.factors("C", &["emissivity", "density"]);
    text.factors("F", &SOLID);
    text.factors("", &["heating"]);
    kinds.push(text);

    let mut text = two("convective, cooled back", u);
    let (film, gas_k) = (u.between(50.0, 200.0), u.between(800.0, 1400.0));
    text.add(&format!(
        "[hot_face]\nkind = \"convective\"\nheat_transfer_coefficient = \"{film:.2} W/m^2/K\"\n\
         gas = {{ points = [[\"0 s\", \"300 K\"], [\"5 s\", \"{gas_k:.2} K\"]], outside = \"hold\" }}\n\
         [back_face]\nkind = \"cooled\"\nheat_transfer_coefficient = \"20 W/m^2/K\"\nambient = \"290 K\""
    ));
    text.factors("C", &["emissivity", "conductivity"]);
    text.factors("F", &["emissivity", "conductivity"]);
    text.factors("", &["heating", "back_face_loss"]);
    kinds.push(text);

    let mut text = two("black face, back that does not radiate", u);
    let heated = flux("flux", u.between(4.0, 12.0));
    text.add(&format!(
        "[hot_face]\nkind = \"heated\"\n{heated}\nemissivity = 1.0\n[back_face]\nkind = \"cooled\"\n\
         heat_transfer_coefficient = \"20 W/m^2/K\"\nambient = \"300 K\"\nemissivity = 0.0"
    ));
    text.factors("F", &SOLID);
    text.factors("", &["heating", "back_face_loss"]);
    kinds.push(text);

    let mut text = two("cooling down from a jump", u);
    let from_k = u.between(700.0, 1100.0);
    text.top(&format!("pressure = \"{:.3} kPa\"", u.between(0.1, 100.0)));
    text.0 = text.0.replace("initial_temperature = \"300 K\"", &format!("initial_temperature = \"{from_k:.0} K\""));
    text.add(
        "[hot_face]\nkind = \"convective\"\nheat_transfer_coefficient = \"10 W/m^2/K\"\ngas.outside = \"hold\"\n\
         gas.points = [[\"0 s\", \"300 K\"], \
              [\"20 s\", \"300 K\"], [\"20 s\", \"500 K\"]]",
    );
    text.factors("C", &["emissivity", "heat_capacity"]);
    text.factors("F", &SOLID);
    text.factors("", &["heating"]);
    kinds.push(text);
    kinds
}

/// Other boundary conditions, and lateral heat loss.
fn bounded(u: &mut Uniform) -> Vec<Text> {
    let mut kinds = Vec::new();
    let hot = |u: &mut Uniform| {
        let k = u.between(700.0, 1300.0);
        format!(
            "[hot_face]\nkind = \"held\"\ntemperature = [[\"0 s\", \"300 K\"], [\"10 s\", \"{k:.2} K\"], \
             [\"60 s\", \"500 K\"]]"
        )
    };
    let mut text = two("held", u);
    text.add(&hot(u));
    text.factors("C", &SOLID);
    text.factors("F", &[SOLID.as_slice(), &["density"]].concat());
    kinds.push(text);

    let mut text = two("held at a sensor by a driver", u);
    text.sensor("deep", 4.0, "");
    text.add(&hot(u));
    text.add("at = \"under-C\"");
    text.factors("F", &[SOLID.as_slice(), &["density"]].concat());
    text.factors("deep", &["sensor_depth"]);
    kinds.push(text);

    let mut text = two("back on a holder", u);
    text.add(&hot(u));
    text.add("[back_face]\nkind = \"holder\"\nconductance = \"200 W/m^2/K\"\ntemperature = \"310 K\"");
    text.factors("F", &["conductivity"]);
    text.factors("", &["back_face_loss"]);
    kinds.push(text);

    let mut text = two("held back", u);
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 12.0))));
    text.add("[back_face]\nkind = \"held\"\ntemperature = [[\"0 s\", \"300 K\"], [\"60 s\", \"330 K\"]]");
    text.factors("F", &SOLID);
    text.factors("", &["heating"]);
    kinds.push(text);

    let mut text = two("holder around", u);
    text.add(&hot(u));
    text.add(
        "[holder]\nconductance = \"30 kW/m^3/K\"\n\
         temperature = [[\"0 s\", \"300 K\"], [\"60 s\", \"340 K\"]]",
    );
    text.factors("F", &[SOLID.as_slice(), &["density"]].concat());
    text.factors("", &["holder_loss"]);
    kinds.push(text);

    let layers = [
        ("C", "nextel440-bf20", u.between(0.5, 1.5)),
        ("F", "saffil-96", u.between(3.0, 6.0)),
        ("B", "sic-5hs", u.between(0.5, 1.5)),
    ];
    let mut text = Text::new("contacts", &layers);
    text.top(&format!("contact_conductance = \"{:.1} W/m^2/K\"", u.between(50.0, 500.0)));
    text.add(&hot(u));
    text.factors("F", &["conductivity", "thickness"]);
    text.factors("C", &["contact_conductance"]);
    text.factors("F", &["contact_conductance"]);
    kinds.push(text);

    let mut text = Text::new("contacts together, parts of a conductivity over pressure", &layers);
    text.top(&format!("contact_conductance = \"{:.1} W/m^2/K\"", u.between(50.0, 500.0)));
    text.top(&format!("pressure = [[\"0 s\", \"{:.3} kPa\"], [\"60 s\", \"1 kPa\"]]", u.between(5.0, 100.0)));
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 12.0))));
    text.factors("F", &PARTS);
    text.factors("C", &["conductivity.gas"]);
    text.factors("", &["contact_conductance"]);
    kinds.push(text);

    let layers = [("C", "nextel440-bf20", u.between(0.5, 1.5)), ("I", "pyrogel3350", u.between(2.0, 4.0))];
    let mut text = Text::new("density that shades", &layers);
    text.add(&format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 12.0))));
    text.factors("I", &[PARTS.as_slice(), &["density", "heat_capacity"]].concat());
    kinds.push(text);
    kinds
}

/// Sensors with lag and with uncertain depth.
fn at_sensors(u: &mut Uniform) -> Vec<Text> {
    let mut kinds = Vec::new();
    let heated = |u: &mut Uniform| format!("[hot_face]\nkind = \"heated\"\n{}", flux("flux", u.between(4.0, 12.0)));
    let mut text = two("beads that lag", u);
    text.sensor("slow", 2.5, &format!("time_constant = \"{:.3} s\"", u.between(0.5, 4.0)));
    text.add(&heated(u));
    text.factors("F", &SOLID);
    text.factors("", &["heating"]);
    text.factors("slow", &["sensor_depth"]);
    kinds.push(text);

    let mut text = two("depths within a layer", u);
    text.sensor("upper", u.between(1.6, 2.2), "");
    text.sensor("lower", u.between(2.4, 3.2), "");
    text.add(&heated(u));
    text.factors("upper", &["sensor_depth"]);
    text.factors("lower", &["sensor_depth"]);
    text.factors("F", &["conductivity"]);
    kinds.push(text);

    let layers = [
        ("C", "nextel440-bf20", u.between(0.5, 1.5)),
        ("F", "saffil-96", u.between(2.0, 3.0)),
        ("G", "apa", u.between(2.0, 3.0)),
        ("B", "sic-5hs", u.between(0.5, 1.5)),
    ];
    let mut text = Text::new("depths at interfaces, on each side of a contact", &layers);
    text.top("contact_conductance = \"200 W/m^2/K\"");
    text.0 = text.0.replace("below = \"C\"", "below = \"C\"\nside = \"above\"");
    text.0 = text.0.replace("below = \"F\"", "below = \"F\"\nside = \"below\"");
    text.add(&heated(u));
    for sensor in ["under-C", "under-F", "under-G"] {
        text.factors(sensor, &["sensor_depth"]);
    }
    kinds.push(text);

    let mut text = Text::new("depth of the back", &[("F", "saffil-96", 5.0)]);
    text.sensor("back", 5.0, "");
    text.sensor("mid", 2.0, "");
    text.add(&heated(u));
    text.add("[back_face]\nkind = \"cooled\"\nheat_transfer_coefficient = \"50 W/m^2/K\"\nambient = \"300 K\"");
    text.factors("mid", &["sensor_depth"]);
    text.add("[[factor]]\nname = \"f_back\"\nproperty = \"sensor_depth\"\ngroup = \"back\"\nsmall = [0.9, 1.0]");
    kinds.push(text);

    let mut text = Text::new("depth of a driver at the front", &[("F", "saffil-96", 5.0)]);
    text.sensor("front", 1.0, "");
    text.sensor("mid", 3.0, "");
    text.add(
        "[hot_face]\nkind = \"held\"\nat = \"front\"\n\
         temperature = [[\"0 s\", \"300 K\"], [\"10 s\", \"900 K\"], [\"60 s\", \"700 K\"]]",
    );
    text.factors("mid", &["sensor_depth"]);
    text.add("[[factor]]\nname = \"f_front\"\nproperty = \"sensor_depth\"\ngroup = \"front\"\nsmall = [1.0, 1.2]");
    kinds.push(text);
    kinds
}
