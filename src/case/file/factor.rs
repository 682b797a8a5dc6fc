//! `[[factor]]`: what may vary, checked against the layup and the faces that it would scale.

use super::layup::{mm, names};
use super::nearest::suggestion;
use super::written::{Section, Written, all};
use crate::case::error::Read;
use crate::case::{
    Conductivity, Correlation, Emissivity, Face, Factor, GasPath, Layup, Ply, Property, PyrolysisHeat, Sensor,
};

const PROPERTIES: &[(&str, Property)] = &[
    ("conductivity", Property::Conductivity),
    ("conductivity.solid", Property::ConductivitySolid),
    ("conductivity.gas", Property::ConductivityGas),
    ("conductivity.radiative", Property::ConductivityRadiative),
    ("heat_capacity", Property::HeatCapacity),
    ("density", Property::Density),
    ("emissivity", Property::Emissivity),
    ("thickness", Property::Thickness),
    ("kinetics", Property::Kinetics),
    ("activation_energy", Property::ActivationEnergy),
    ("pyrolysis_heat", Property::PyrolysisHeat),
    ("char_yield", Property::CharYield),
    ("permeability", Property::Permeability),
    ("heating", Property::Heating),
    ("contact", Property::Contact),
    ("loss", Property::Loss),
    ("holder", Property::Holder),
    ("depth", Property::Depth),
];

/// What a factor may scale: the layup as marched, and its faces.
#[derive(Clone, Copy)]
pub(super) struct Scaled<'a> {
    pub(super) layup: &'a Layup,
    pub(super) hot_face: &'a Face,
    pub(super) back_face: &'a Face,
    pub(super) gas_path: Option<GasPath>,
    pub(super) has_holder: bool,
    pub(super) sensors: &'a [Sensor],
}

/// The factors, in the order written. Where the layup or a face is at fault, only their own keys are read.
pub(super) fn factors(case: &Section<'_>, scaled: Option<Scaled<'_>>) -> Read<Vec<Factor>> {
    let sections = case.tables("factor")?;
    let names = names(&sections, "factor");
    let factors = all(sections.iter().map(|section| factor(section, scaled)));
    let (factors, _) = (factors?, names?);
    if let Some(Scaled { layup, .. }) = scaled {
        all(factors.iter().zip(&sections).enumerate().map(|(index, (factor, section))| {
            let earlier = factors[..index].iter().find(|other| overlap(factor, other, layup));
            earlier.map_or(Ok(()), |other| {
                let (name, other) = (&factor.name, &other.name);
                Err(section.fault(format!("factor {name:?} scales what factor {other:?} scales already")))
            })
        }))?;
    }
    Ok(factors)
}

/// `[[correlation]]`: factors, two at a time, that go together. Where the factors are at fault, only its keys are read.
pub(super) fn correlation(case: &Section<'_>, factors: Option<&[Factor]>) -> Read<Correlation> {
    let sections = case.tables("correlation")?;
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    all(sections.iter().map(|section| {
        let read = pair(section, factors);
        section.close();
        let Some((one, other, value)) = read? else { return Ok(()) };
        if pairs.iter().any(|&(a, b, _)| (a, b) == (one, other) || (a, b) == (other, one)) {
            return Err(section.fault("the correlation of these two factors is given already"));
        }
        pairs.push((one, other, value));
        Ok(())
    }))?;
    Correlation::of(factors.map_or(0, <[Factor]>::len), &pairs).ok_or_else(|| {
        // The last one written is where the contradiction ends; there is one, as none at all contradict nothing.
        let place = sections.last().unwrap_or(case);
        place.fault("no factors can go together as these correlations say: their matrix is not positive definite")
    })
}

fn pair(section: &Section<'_>, factors: Option<&[Factor]>) -> Read<Option<(usize, usize, f64)>> {
    let expected = "two factors such as [\"f_k_INS\", \"f_rho_INS\"]";
    let named = section.required("factors", expected).and_then(|written| {
        let names = written.list()?;
        let known = |written: &Written<'_>| -> Read<usize> {
            let (name, factors) = (written.text()?, factors.unwrap_or_default());
            let hint = || suggestion(name, factors.iter().map(|factor| factor.name.as_str()));
            let found = factors.iter().position(|factor| factor.name == name);
            found.ok_or_else(|| written.fault(format!("{name:?} is no factor of this case{}", hint())))
        };
        match (&names[..], factors) {
            (_, None) => Ok(None),
            ([one, other], _) => {
                let (one, other) = (known(one), known(other));
                let (one, other) = (one?, other?);
                if one == other {
                    return Err(written.fault("a factor goes with itself: expected two factors"));
                }
                Ok(Some((one, other)))
            }
            _ => Err(written.fault(format!("expected {expected}, found {} of them", names.len()))),
        }
    });
    let value = section.required("value", "a correlation such as 0.5").and_then(|written| {
        let value = written.number()?;
        if value.abs() < 1.0 {
            return Ok(value);
        }
        Err(written.fault(format!("expected a correlation above -1 and below 1, found {value}")))
    });
    let (named, value) = (named?, value?);
    Ok(named.map(|(one, other)| (one, other, value)))
}

fn overlap(one: &Factor, other: &Factor, layup: &Layup) -> bool {
    let both = |ply: &Ply| in_group(ply, &one.group) && in_group(ply, &other.group);
    let of_all = one.group.is_empty() || other.group.is_empty();
    let states = one.state.is_none() || other.state.is_none() || one.state == other.state;
    one.property == other.property && states && (of_all || one.group == other.group || layup.plies.iter().any(both))
}

/// A group is the plies that name it, or the one ply of that name.
fn in_group(ply: &Ply, group: &str) -> bool {
    ply.group == group || ply.name == group
}

fn has_plies(property: Property) -> bool {
    !matches!(property, Property::Heating | Property::Loss | Property::Holder)
}

fn factor(section: &Section<'_>, scaled: Option<Scaled<'_>>) -> Read<Factor> {
    let name = section.required("name", "a name such as \"f_k_INS\"").and_then(name);
    let property = section.required("property", "a property such as \"conductivity\"").and_then(property);
    let group = section.optional("group");
    let state = section.optional("state").map(|written| state(written, property, group, scaled)).transpose();
    let small = section.required("small", "bounds such as [0.75, 1.25]").and_then(bounds);
    let large = section.optional("large").map_or(small, bounds);
    let nominal = section.optional("nominal").map(Written::number).transpose();
    let highest = large.map_or(1.0, |(_, high)| high);
    let named = state.as_ref().map_or(None, Option::as_deref);
    let scales = property.and_then(|property| scales(section, property, (group, named), highest, scaled));
    section.close();
    let (name, small, large, nominal) = (name?, small?, large?, nominal?.unwrap_or(1.0));
    if large.0 > small.0 || large.1 < small.1 {
        let message =
            format!("large bounds {} to {} do not hold the small {} to {}", large.0, large.1, small.0, small.1);
        return Err(section.fault(message));
    }
    if !(small.0..=small.1).contains(&nominal) {
        let message = format!("nominal {nominal} lies outside the small bounds {} to {}", small.0, small.1);
        return Err(section
            .optional("nominal")
            .map_or_else(|| section.fault(&message), |written| written.fault(&message)));
    }
    let factor = Factor { name, group: scales?, property: property?, state: state?, nominal, small, large };
    let sensors = scaled.filter(|_| factor.property == Property::Depth).map(|scaled| (scaled.layup, scaled.sensors));
    sensors
        .and_then(|(layup, sensors)| adrift(&factor, layup, sensors))
        .map_or(Ok(factor), |reason| Err(section.fault(reason)))
}

/// The name of a factor stands in `--set NAME=VALUE` and `--start NAME=VALUE,…`.
fn name(written: Written<'_>) -> Read<String> {
    let name = written.text()?;
    if name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c)) {
        return Ok(name.to_owned());
    }
    Err(written
        .fault(format!("{name:?} cannot name a factor: expected letters, digits, `_` and `-`, such as \"f_k_INS\"")))
}

fn property(written: Written<'_>) -> Read<Property> {
    let text = written.text()?;
    let found = PROPERTIES.iter().find(|(known, _)| *known == text).map(|&(_, property)| property);
    let known = PROPERTIES.iter().map(|(known, _)| *known);
    found.ok_or_else(|| written.fault(format!("unknown property {text:?}{}", suggestion(text, known))))
}

/// A state that every ply of the group can be in, of a property that is told apart by it.
fn state(
    written: Written<'_>,
    property: Read<Property>,
    group: Option<Written<'_>>,
    scaled: Option<Scaled<'_>>,
) -> Read<String> {
    let state = written.text()?;
    if property.is_ok_and(|property| !property.is_conductivity()) {
        return Err(written.fault("only conductivities are told apart by state: expected no `state`"));
    }
    let group = group.map(Written::text).transpose()?;
    let plies = scaled
        .iter()
        .flat_map(|scaled| &scaled.layup.plies)
        .filter(|ply| group.is_some_and(|group| in_group(ply, group)));
    for ply in plies {
        let known = || ply.material.conductivities().map(|(state, _)| state);
        if !known().any(|known| known == state) {
            let (id, name, hint) = (&ply.material.id, &ply.name, suggestion(state, known()));
            return Err(written.fault(format!("{id:?} (ply {name:?}) knows no state {state:?}{hint}")));
        }
    }
    Ok(state.to_owned())
}

/// Low and high, above zero.
fn bounds(written: Written<'_>) -> Read<(f64, f64)> {
    let [low, high] = written.pair()?;
    let (low, high) = (low.number(), high.number());
    let (low, high) = (low?, high?);
    if low <= 0.0 || high <= 0.0 {
        return Err(written.fault(format!("bounds {low} to {high} are not positive")));
    }
    if low >= high {
        return Err(written.fault(format!("bounds reversed: {low} is not below {high}")));
    }
    Ok((low, high))
}

/// The group of a factor, or why it scales nothing.
fn scales(
    section: &Section<'_>,
    property: Property,
    (group, state): (Option<Written<'_>>, Option<&str>),
    highest: f64,
    scaled: Option<Scaled<'_>>,
) -> Read<String> {
    match (group, has_plies(property)) {
        (None, true) if property != Property::Contact => {
            Err(section.fault("missing key \"group\": expected the plies that it scales, such as \"INS\""))
        }
        (Some(group), false) => Err(group.fault("this property belongs to no ply: expected no `group`")),
        (None, _) => {
            let idle = scaled.and_then(|scaled| idle(property, scaled));
            idle.map_or(Ok(String::new()), |reason| Err(section.fault(reason)))
        }
        (Some(written), true) => {
            let group = written.text()?;
            let refused = scaled.and_then(|scaled| refused(property, group, state, highest, scaled));
            refused.map_or(Ok(group.to_owned()), |reason| Err(written.fault(reason)))
        }
    }
}

/// Why a factor without plies would do nothing.
fn idle(property: Property, scaled: Scaled<'_>) -> Option<&'static str> {
    let kept = |face: &Face| match face {
        Face::Held(_) => true,
        Face::Open(open) => open.film_w_m2_k == 0.0 && open.emissivity == Emissivity::Constant(0.0),
    };
    match property {
        Property::Heating if matches!(scaled.hot_face, Face::Held(_)) => {
            Some("the hot face is held: there is no heating to scale")
        }
        Property::Holder if !scaled.has_holder => Some("there is no [holder] to lose heat to"),
        Property::Loss if kept(scaled.back_face) => Some("the back face gives off nothing that could be scaled"),
        Property::Contact if scaled.layup.contacts_w_m2_k.iter().all(Option::is_none) => {
            Some("every contact is perfect: there is no conductance to scale")
        }
        _ => None,
    }
}

/// Why a factor may not move its sensor as far as its bounds say.
fn adrift(factor: &Factor, layup: &Layup, sensors: &[Sensor]) -> Option<String> {
    let sensor = sensors.iter().find(|sensor| sensor.name == factor.group)?;
    let (low, high) = factor.widest();
    let (top_m, back_m) = (low * sensor.depth_m, high * sensor.depth_m);
    (top_m < layup.origin_m || back_m > layup.back_m()).then(|| {
        let [top, back, first, last] = [top_m, back_m, layup.origin_m, layup.back_m()].map(mm);
        format!("bounds take {:?} to {top} and {back} mm, off the layup from {first} to {last} mm", sensor.name)
    })
}

/// Why a factor of a group of plies cannot be, which goes up to `highest`.
fn refused(property: Property, group: &str, state: Option<&str>, highest: f64, scaled: Scaled<'_>) -> Option<String> {
    let Scaled { layup, hot_face, back_face, gas_path, sensors, .. } = scaled;
    if property == Property::Depth {
        let found = sensors.iter().find(|sensor| sensor.name == group);
        let known = sensors.iter().map(|sensor| sensor.name.as_str());
        return match found {
            None => Some(format!("no sensor {group:?}{}", suggestion(group, known))),
            Some(sensor) if sensor.depth_m == 0.0 => Some(format!("{group:?} lies on the hot face: its depth is zero")),
            Some(_) => None,
        };
    }
    let plies: Vec<&Ply> = layup.plies.iter().filter(|ply| in_group(ply, group)).collect();
    if plies.is_empty() {
        let known = layup.plies.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]);
        return Some(format!("no ply of the marched layup is of group {group:?}{}", suggestion(group, known)));
    }
    let part = match property {
        Property::Contact => {
            let mut under = layup.plies.iter().zip(&layup.contacts_w_m2_k).filter(|(ply, _)| in_group(ply, group));
            let idle = under.all(|(_, contact)| contact.is_none());
            return idle.then(|| format!("no contact under {group:?} has a conductance to scale"));
        }
        Property::ConductivitySolid => 0,
        Property::ConductivityGas => 1,
        Property::ConductivityRadiative => 2,
        Property::Emissivity => {
            let faces = [(layup.plies.first(), hot_face), (layup.plies.last(), back_face)];
            let radiates = |(ply, face): &(Option<&Ply>, &Face)| {
                let own = matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
                own && ply.is_some_and(|ply| in_group(ply, group))
            };
            let idle = !faces.iter().any(radiates);
            return idle.then(|| format!("no open face with the emissivity of its material is of group {group:?}"));
        }
        Property::Kinetics | Property::ActivationEnergy | Property::PyrolysisHeat | Property::CharYield => {
            return plies.into_iter().find_map(|ply| unreacting(property, ply, highest));
        }
        Property::Permeability => {
            if gas_path != Some(GasPath::Darcy) {
                return Some("no gas flows by Darcy's law: there is no permeability to scale".to_owned());
            }
            let sealed = plies.into_iter().find(|ply| ply.material.pores.permeability_m2 == 0.0)?;
            return Some(format!("{:?} (ply {:?}) lets nothing through", sealed.material.id, sealed.name));
        }
        _ => return None,
    };
    // What a residue does not state is the virgin's, so that this has what the others have, as a rule.
    let state = state.unwrap_or("virgin");
    let lacks = plies.iter().find(|ply| {
        let mut stated = ply.material.conductivities().filter(|(name, _)| *name == state);
        stated.any(|(_, conductivity)| match conductivity {
            Conductivity::Tables(_) => true,
            Conductivity::Parts(parts) => match part {
                1 => parts.pores.is_empty(),
                2 => parts.extinction_1_m.is_none(),
                _ => false,
            },
        })
    })?;
    let part = ["solid", "gas", "radiative"][part];
    let of = if state == "virgin" { String::new() } else { format!("{state} ") };
    Some(format!("the conductivity of {of}{:?} (ply {:?}) has no {part} part", lacks.material.id, lacks.name))
}

/// Why the reactions of a ply cannot be scaled.
fn unreacting(property: Property, ply: &Ply, highest: f64) -> Option<String> {
    let (id, name) = (&ply.material.id, &ply.name);
    let Some(decomposition) = &ply.material.decomposition else {
        return Some(format!("{id:?} (ply {name:?}) does not decompose"));
    };
    let left = 1.0 - decomposition.loss();
    match property {
        Property::CharYield if left * highest >= 1.0 => {
            Some(format!("{highest} times the {left:.3} that {id:?} (ply {name:?}) leaves is no less than all of it"))
        }
        Property::PyrolysisHeat if decomposition.heat != PyrolysisHeat::OfReaction => {
            Some(format!("the heat of {id:?} (ply {name:?}) lies in absolute enthalpies: there is none to scale"))
        }
        _ => None,
    }
}
