//! Validation of factors: the plies, faces, gas or sensors of the case must have the property that a factor scales.

use super::conductivity::Conductivity;
use super::decomposition::PyrolysisHeat;
use super::exposure::{Emissivity, Face};
use super::factor::{Factor, Property};
use super::gas::GasFlowModel;
use super::layup::{Layup, Ply, Sensor, rounded_mm};
use super::suggestion::suggestion;
use super::validation::{FieldPath, UniqueNames};

/// The parts of a case that factors can scale.
#[derive(Clone, Copy)]
pub(super) struct FactorTargets<'a> {
    pub(super) layup: &'a Layup,
    pub(super) hot_face: &'a Face,
    pub(super) back_face: &'a Face,
    pub(super) gas_path: Option<GasFlowModel>,
    pub(super) has_holder: bool,
    pub(super) sensors: &'a [Sensor],
}

/// Error for a group of a property that belongs to no ply.
pub(super) const GROUP_NOT_ALLOWED: &str = "this property does not belong to a ply: expected no `group`";
/// Error for a property of plies without a group.
pub(super) const GROUP_EXPECTED: &str = "expected the group of plies to scale, such as \"INS\"";
/// Error for a state of a property other than a conductivity.
pub(super) const STATE_NOT_ALLOWED: &str = "only a conductivity can be scaled in one state: expected no `state`";

impl<'a> FactorTargets<'a> {
    /// Record factors that scale nothing, exceed a physical limit, or overlap a previous factor.
    pub(super) fn check(self, at: &FieldPath<'_>, factors: &[Factor]) {
        let mut names = UniqueNames::new("factor");
        for (index, (at, factor)) in at.elements(factors).enumerate() {
            at.child("name").require(names.insert(&factor.name));
            let Factor { property, ref group, .. } = *factor;
            let state = factor.state.as_deref();
            at.child("group").require(match (group.is_empty(), property.allows_group()) {
                (true, _) if property.needs_group() => Err(GROUP_EXPECTED.to_owned()),
                (true, _) => self.check_target(property),
                (false, false) => Err(GROUP_NOT_ALLOWED.to_owned()),
                (false, true) => self.check_group_target(group, property, state, factor.large.1),
            });
            at.child("state").require(match state {
                Some(_) if !property.is_conductivity() => Err(STATE_NOT_ALLOWED.to_owned()),
                Some(state) => self.check_state(state, group),
                None => Ok(()),
            });
            at.require(self.check_depth_bounds(factor));
            at.require(self.check_no_overlap(factor, &factors[..index]));
        }
    }

    /// Require that a factor without a group has an effect.
    pub(super) fn check_target(self, property: Property) -> Result<(), String> {
        let has_no_loss = |face: &Face| match face {
            Face::Held(_) => true,
            Face::Open(open) => !open.film_w_m2_k.acts() && open.emissivity == Emissivity::Constant(0.0),
        };
        let reason = match property {
            Property::Heating if matches!(self.hot_face, Face::Held(_)) => {
                "the hot face is held: there is no heating to scale"
            }
            Property::HolderLoss if !self.has_holder => "the case has no [holder]: there is no heat loss to scale",
            Property::BackFaceLoss if has_no_loss(self.back_face) => {
                "the back face has neither a film nor radiation: there is no heat loss to scale"
            }
            Property::ContactConductance if self.layup.contacts_w_m2_k.iter().all(Option::is_none) => {
                "every contact is perfect: there is no conductance to scale"
            }
            _ => return Ok(()),
        };
        Err(reason.to_owned())
    }

    /// Require that a factor with a group has an effect in each of its plies, up to its upper bound `highest`.
    pub(super) fn check_group_target(
        self,
        group: &str,
        property: Property,
        state: Option<&str>,
        highest: f64,
    ) -> Result<(), String> {
        if property == Property::SensorDepth {
            return self.check_sensor_depth(group);
        }
        let plies: Vec<&Ply> = self.plies(group).collect();
        if plies.is_empty() {
            let known = self.layup.plies.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]);
            let hint = suggestion(group, known);
            return Err(format!("unknown group {group:?} of the marched layup{hint}"));
        }
        match property {
            Property::ContactConductance => {
                let mut contacts = self.layup.plies.iter().zip(&self.layup.contacts_w_m2_k);
                let has_contact = contacts.any(|(ply, contact)| ply.belongs_to(group) && contact.is_some());
                ensure(has_contact, || format!("no interface below group {group:?} has a contact conductance to scale"))
            }
            Property::Emissivity => {
                let faces = [(self.layup.plies.first(), self.hot_face), (self.layup.plies.last(), self.back_face)];
                let radiates = |(ply, face): &(Option<&Ply>, &Face)| {
                    let of_material = matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
                    of_material && ply.is_some_and(|ply| ply.belongs_to(group))
                };
                ensure(faces.iter().any(radiates), || {
                    format!("no ply of group {group:?} has a face that radiates with the emissivity of its material")
                })
            }
            Property::PreExponential | Property::ActivationEnergy | Property::PyrolysisHeat | Property::CharYield => {
                plies.into_iter().try_for_each(|ply| check_decomposition(property, ply, highest))
            }
            Property::Permeability => {
                ensure(self.gas_path == Some(GasFlowModel::Darcy), || {
                    "the case has no Darcy flow: there is no permeability to scale".to_owned()
                })?;
                let sealed = plies.into_iter().find(|ply| ply.material.pores.permeability_m2 == 0.0);
                sealed.map_or(Ok(()), |ply| {
                    Err(format!("{} is impermeable: there is no permeability to scale", describe_material(ply)))
                })
            }
            _ => plies.into_iter().try_for_each(|ply| check_conductivity_part(property, ply, state)),
        }
    }

    /// Require a sensor of this name below the hot face.
    fn check_sensor_depth(self, name: &str) -> Result<(), String> {
        let known = self.sensors.iter().map(|sensor| sensor.name.as_str());
        match self.sensors.iter().find(|sensor| sensor.name == name) {
            None => Err(format!("unknown sensor {name:?}{}", suggestion(name, known))),
            Some(sensor) if sensor.depth_m == 0.0 => {
                Err(format!("sensor {name:?} lies at 0 mm: there is no depth to scale"))
            }
            Some(_) => Ok(()),
        }
    }

    /// Require that every ply of the group has a state of this name.
    pub(super) fn check_state(self, state: &str, group: &str) -> Result<(), String> {
        for ply in self.plies(group) {
            let known = || ply.material.state_conductivities().map(|(state, _)| state);
            if !known().any(|known| known == state) {
                let hint = suggestion(state, known());
                return Err(format!("{} has no state {state:?}{hint}", describe_material(ply)));
            }
        }
        Ok(())
    }

    /// Require that a factor on a sensor depth keeps the sensor within the layup.
    pub(super) fn check_depth_bounds(self, factor: &Factor) -> Result<(), String> {
        let layup = self.layup;
        let found = self.sensors.iter().find(|sensor| sensor.name == factor.group);
        let Some(sensor) = found.filter(|_| factor.property == Property::SensorDepth) else { return Ok(()) };
        let (low, high) = factor.widest_bounds();
        let (top_m, back_m) = (low * sensor.depth_m, high * sensor.depth_m);
        ensure(top_m >= layup.origin_m && back_m <= layup.back_m(), || {
            let [top, back, first, last] = [top_m, back_m, layup.origin_m, layup.back_m()].map(rounded_mm);
            let name = &sensor.name;
            format!(
                "the bounds move {name:?} to {top} mm and {back} mm, outside the layup from {first} mm to {last} mm"
            )
        })
    }

    /// Require that no previous factor scales the same property of the same ply.
    pub(super) fn check_no_overlap(self, factor: &Factor, before: &[Factor]) -> Result<(), String> {
        let in_both = |other: &Factor, ply: &Ply| ply.belongs_to(&factor.group) && ply.belongs_to(&other.group);
        let overlaps = |other: &&Factor| {
            let of_all = factor.group.is_empty() || other.group.is_empty();
            let states = factor.state.is_none() || other.state.is_none() || factor.state == other.state;
            let plies = of_all || factor.group == other.group || self.layup.plies.iter().any(|ply| in_both(other, ply));
            factor.property == other.property && states && plies
        };
        before.iter().find(overlaps).map_or(Ok(()), |other| {
            Err(format!("factors {:?} and {:?} scale the same property: expected one", other.name, factor.name))
        })
    }

    fn plies(self, group: &str) -> impl Iterator<Item = &'a Ply> {
        self.layup.plies.iter().filter(move |ply| ply.belongs_to(group))
    }
}

fn ensure(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

/// `material "akk" (ply "GB")`.
fn describe_material(ply: &Ply) -> String {
    format!("material {:?} (ply {:?})", ply.material.id, ply.name)
}

/// Require that the conductivity of a ply has the part that a factor scales.
fn check_conductivity_part(property: Property, ply: &Ply, state: Option<&str>) -> Result<(), String> {
    let part = match property {
        Property::ConductivitySolid => "solid",
        Property::ConductivityGas => "gas",
        Property::ConductivityRadiative => "radiative",
        _ => return Ok(()),
    };
    // Residues inherit parts from the virgin material.
    let state = state.unwrap_or("virgin");
    let mut stated = ply.material.state_conductivities().filter(|(name, _)| *name == state);
    let lacks = stated.any(|(_, conductivity)| match conductivity {
        Conductivity::Tables(_) => true,
        Conductivity::ThreePart(parts) => match property {
            Property::ConductivityGas => parts.pores.is_empty(),
            Property::ConductivityRadiative => parts.extinction_1_m.is_none(),
            _ => false,
        },
    });
    ensure(!lacks, || format!("the conductivity of {} in state {state:?} has no {part} part", describe_material(ply)))
}

/// Require that the reactions of a ply can be scaled up to `highest`.
fn check_decomposition(property: Property, ply: &Ply, highest: f64) -> Result<(), String> {
    let Some(decomposition) = &ply.material.decomposition else {
        return Err(format!("{} does not decompose", describe_material(ply)));
    };
    let char_yield = 1.0 - decomposition.mass_loss();
    match property {
        Property::CharYield if char_yield * highest >= 1.0 => Err(format!(
            "expected a char yield below 1, found {highest} times {char_yield:.3} of {}",
            describe_material(ply)
        )),
        Property::PyrolysisHeat if decomposition.heat != PyrolysisHeat::HeatsOfReaction => {
            Err(format!("{} has absolute enthalpies: there is no heat of reaction to scale", describe_material(ply)))
        }
        _ => Ok(()),
    }
}
