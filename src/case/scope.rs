//! What a factor may scale: a property that plies, faces, gas or sensors of the case have.

use super::check::{Field, Names};
use super::conductivity::Conductivity;
use super::decomposition::PyrolysisHeat;
use super::exposure::{Emissivity, Face};
use super::factor::{Factor, Property};
use super::gas::GasPath;
use super::layup::{Layup, Ply, Sensor, mm};
use super::nearest::suggestion;

/// The parts of a case that factors scale.
#[derive(Clone, Copy)]
pub(super) struct FactorScope<'a> {
    pub(super) layup: &'a Layup,
    pub(super) hot_face: &'a Face,
    pub(super) back_face: &'a Face,
    pub(super) gas_path: Option<GasPath>,
    pub(super) has_holder: bool,
    pub(super) sensors: &'a [Sensor],
}

/// Why a property of the case as a whole has no group.
pub(super) const NO_GROUP: &str = "this property belongs to no ply: expected no `group`";
/// What a property of plies lacks without a group.
pub(super) const A_GROUP: &str = "expected the plies that it scales, such as \"INS\"";
/// Why only conductivities have a state.
pub(super) const NO_STATE: &str = "only conductivities are told apart by state: expected no `state`";

impl<'a> FactorScope<'a> {
    /// Record the factors that scale nothing, more than there is, or what a factor before them scales.
    pub(super) fn check(self, at: &Field<'_>, factors: &[Factor]) {
        let mut names = Names::of("factor");
        for (index, (at, factor)) in at.items(factors).enumerate() {
            at.field("name").require(names.add(&factor.name));
            let Factor { property, ref group, .. } = *factor;
            let state = factor.state.as_deref();
            at.field("group").require(match (group.is_empty(), property.has_group()) {
                (true, _) if property.needs_group() => Err(A_GROUP.to_owned()),
                (true, _) => self.scalable(property),
                (false, false) => Err(NO_GROUP.to_owned()),
                (false, true) => self.scalable_in(group, property, state, factor.large.1),
            });
            at.field("state").require(match state {
                Some(_) if !property.is_conductivity() => Err(NO_STATE.to_owned()),
                Some(state) => self.known_state(state, group),
                None => Ok(()),
            });
            at.require(self.within_layup(factor));
            at.require(self.not_scaled_before(factor, &factors[..index]));
        }
    }

    /// That a factor without a group has something to scale.
    pub(super) fn scalable(self, property: Property) -> Result<(), String> {
        let gives_nothing = |face: &Face| match face {
            Face::Held(_) => true,
            Face::Open(open) => open.film_w_m2_k == 0.0 && open.emissivity == Emissivity::Constant(0.0),
        };
        let reason = match property {
            Property::Heating if matches!(self.hot_face, Face::Held(_)) => {
                "the hot face is held: there is no heating to scale"
            }
            Property::Holder if !self.has_holder => "there is no [holder] to lose heat to",
            Property::Loss if gives_nothing(self.back_face) => "the back face gives off nothing that could be scaled",
            Property::Contact if self.layup.contacts_w_m2_k.iter().all(Option::is_none) => {
                "every contact is perfect: there is no conductance to scale"
            }
            _ => return Ok(()),
        };
        Err(reason.to_owned())
    }

    /// That a factor of a group, which goes up to `highest`, has something to scale in each of its plies.
    pub(super) fn scalable_in(
        self,
        group: &str,
        property: Property,
        state: Option<&str>,
        highest: f64,
    ) -> Result<(), String> {
        if property == Property::Depth {
            return self.movable(group);
        }
        let plies: Vec<&Ply> = self.plies(group).collect();
        if plies.is_empty() {
            let known = self.layup.plies.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]);
            let hint = suggestion(group, known);
            return Err(format!("no ply of the marched layup is of group {group:?}{hint}"));
        }
        match property {
            Property::Contact => {
                let mut contacts = self.layup.plies.iter().zip(&self.layup.contacts_w_m2_k);
                let has_contact = contacts.any(|(ply, contact)| ply.is_in(group) && contact.is_some());
                refused_unless(has_contact, || format!("no contact under {group:?} has a conductance to scale"))
            }
            Property::Emissivity => {
                let faces = [(self.layup.plies.first(), self.hot_face), (self.layup.plies.last(), self.back_face)];
                let radiates = |(ply, face): &(Option<&Ply>, &Face)| {
                    let own = matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
                    own && ply.is_some_and(|ply| ply.is_in(group))
                };
                refused_unless(faces.iter().any(radiates), || {
                    format!("no open face with the emissivity of its material is of group {group:?}")
                })
            }
            Property::Kinetics | Property::ActivationEnergy | Property::PyrolysisHeat | Property::CharYield => {
                plies.into_iter().try_for_each(|ply| reacts(property, ply, highest))
            }
            Property::Permeability => {
                refused_unless(self.gas_path == Some(GasPath::Darcy), || {
                    "no gas flows by Darcy's law: there is no permeability to scale".to_owned()
                })?;
                let sealed = plies.into_iter().find(|ply| ply.material.pores.permeability_m2 == 0.0);
                sealed.map_or(Ok(()), |ply| {
                    Err(format!("{:?} (ply {:?}) lets nothing through", ply.material.id, ply.name))
                })
            }
            _ => plies.into_iter().try_for_each(|ply| has_part(property, ply, state)),
        }
    }

    /// That there is a sensor of that name below the hot face.
    fn movable(self, name: &str) -> Result<(), String> {
        let known = self.sensors.iter().map(|sensor| sensor.name.as_str());
        match self.sensors.iter().find(|sensor| sensor.name == name) {
            None => Err(format!("no sensor {name:?}{}", suggestion(name, known))),
            Some(sensor) if sensor.depth_m == 0.0 => Err(format!("{name:?} lies on the hot face: its depth is zero")),
            Some(_) => Ok(()),
        }
    }

    /// A state that every ply of the group can be in.
    pub(super) fn known_state(self, state: &str, group: &str) -> Result<(), String> {
        for ply in self.plies(group) {
            let known = || ply.material.conductivities().map(|(state, _)| state);
            if !known().any(|known| known == state) {
                let (id, name, hint) = (&ply.material.id, &ply.name, suggestion(state, known()));
                return Err(format!("{id:?} (ply {name:?}) knows no state {state:?}{hint}"));
            }
        }
        Ok(())
    }

    /// That a factor on the depth of a sensor does not move it off the layup within its bounds.
    pub(super) fn within_layup(self, factor: &Factor) -> Result<(), String> {
        let layup = self.layup;
        let found = self.sensors.iter().find(|sensor| sensor.name == factor.group);
        let Some(sensor) = found.filter(|_| factor.property == Property::Depth) else { return Ok(()) };
        let (low, high) = factor.widest();
        let (top_m, back_m) = (low * sensor.depth_m, high * sensor.depth_m);
        refused_unless(top_m >= layup.origin_m && back_m <= layup.back_m(), || {
            let [top, back, first, last] = [top_m, back_m, layup.origin_m, layup.back_m()].map(mm);
            format!("bounds take {:?} to {top} and {back} mm, off the layup from {first} to {last} mm", sensor.name)
        })
    }

    /// That none of the factors before scales the same property of the same plies.
    pub(super) fn not_scaled_before(self, factor: &Factor, before: &[Factor]) -> Result<(), String> {
        let both = |other: &Factor, ply: &Ply| ply.is_in(&factor.group) && ply.is_in(&other.group);
        let overlaps = |other: &&Factor| {
            let of_all = factor.group.is_empty() || other.group.is_empty();
            let states = factor.state.is_none() || other.state.is_none() || factor.state == other.state;
            let plies = of_all || factor.group == other.group || self.layup.plies.iter().any(|ply| both(other, ply));
            factor.property == other.property && states && plies
        };
        before.iter().find(overlaps).map_or(Ok(()), |other| {
            Err(format!("factor {:?} scales what factor {:?} scales already", factor.name, other.name))
        })
    }

    fn plies(self, group: &str) -> impl Iterator<Item = &'a Ply> {
        self.layup.plies.iter().filter(move |ply| ply.is_in(group))
    }
}

fn refused_unless(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

/// That the conductivity of a ply has the part that a factor scales.
fn has_part(property: Property, ply: &Ply, state: Option<&str>) -> Result<(), String> {
    let part = match property {
        Property::ConductivitySolid => "solid",
        Property::ConductivityGas => "gas",
        Property::ConductivityRadiative => "radiative",
        _ => return Ok(()),
    };
    // What a residue does not state is the virgin's, so that this has what the others have, as a rule.
    let state = state.unwrap_or("virgin");
    let mut stated = ply.material.conductivities().filter(|(name, _)| *name == state);
    let lacks = stated.any(|(_, conductivity)| match conductivity {
        Conductivity::Tables(_) => true,
        Conductivity::Parts(parts) => match property {
            Property::ConductivityGas => parts.pores.is_empty(),
            Property::ConductivityRadiative => parts.extinction_1_m.is_none(),
            _ => false,
        },
    });
    refused_unless(!lacks, || {
        let of = if state == "virgin" { String::new() } else { format!("{state} ") };
        format!("the conductivity of {of}{:?} (ply {:?}) has no {part} part", ply.material.id, ply.name)
    })
}

/// That the reactions of a ply can be scaled up to `highest`.
fn reacts(property: Property, ply: &Ply, highest: f64) -> Result<(), String> {
    let (id, name) = (&ply.material.id, &ply.name);
    let Some(decomposition) = &ply.material.decomposition else {
        return Err(format!("{id:?} (ply {name:?}) does not decompose"));
    };
    let left = 1.0 - decomposition.loss();
    match property {
        Property::CharYield if left * highest >= 1.0 => {
            Err(format!("{highest} times the {left:.3} that {id:?} (ply {name:?}) leaves is no less than all of it"))
        }
        Property::PyrolysisHeat if decomposition.heat != PyrolysisHeat::OfReaction => {
            Err(format!("the heat of {id:?} (ply {name:?}) lies in absolute enthalpies: there is none to scale"))
        }
        _ => Ok(()),
    }
}
