//! Options of a trade study.

use super::{SizeOptions, check_limit};
use crate::case::{Case, Material};
use crate::limits::{LAYUPS, STATISTICS_MIB};
use crate::session::error::{InputError, SessionError};
use crate::study::trade::{CandidateLayup, TradeRequest};
use std::sync::Arc;

/// The layups of all choices of materials, each sized for its limit under all exposures.
#[derive(Clone, Debug, PartialEq)]
pub struct TradeOptions {
    /// Plies whose material is chosen.
    pub choices: Vec<PlyChoice>,
    /// The ply that is sized, its limit and the members.
    pub size: SizeOptions,
    /// Cases whose exposures all layups must hold, besides that of the case itself.
    pub exposures: Vec<Case>,
}

/// A ply, or a group, and the materials that it may be of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyChoice {
    /// Name of the ply or group.
    pub ply: String,
    /// Ids of materials: of a ply of the case, or of the database.
    pub materials: Vec<String>,
}

/// A choice for a case.
struct ResolvedChoice {
    plies: Vec<usize>,
    materials: Vec<Arc<Material>>,
}

impl TradeOptions {
    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::trade`](crate::Session::trade) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.request(case, &self.exposures).map(|_| ())
    }

    /// The request and its layups, with `exposures` in place of those of the options.
    pub(in crate::session) fn request(
        &self,
        case: &Case,
        exposures: &[Case],
    ) -> Result<(TradeRequest, Vec<CandidateLayup>), SessionError> {
        let requirement = self.size.requirement(case)?;
        plies_of(case, &requirement.ply, "size")?;
        let choices = self.choices.iter().map(|choice| choice.resolve(case)).collect::<Result<Vec<_>, _>>()?;
        if choices.is_empty() {
            return Err(InputError::for_option("choices", ": none given: expected the materials of a ply").into());
        }
        for (index, choice) in choices.iter().enumerate() {
            let is_shared = |other: &ResolvedChoice| other.plies.iter().any(|ply| choice.plies.contains(ply));
            if let Some(other) = choices[..index].iter().position(is_shared) {
                let (name, other) = (&self.choices[index].ply, &self.choices[other].ply);
                let message = format!(" {name:?}: {other:?} chooses the material of the same ply");
                return Err(InputError::for_option("choices", message).into());
            }
        }
        let layups = choices.iter().map(|choice| choice.materials.len() as f64).product::<f64>();
        check_limit(&LAYUPS, layups, "choices")?;
        let members = self.size.sweep.members;
        STATISTICS_MIB.check(layups * members as f64 * 8.0 / f64::from(1 << 20)).map_err(|message| {
            InputError::for_option("members", format!(" {members}: {message} for {layups} layups: take fewer of one"))
        })?;
        let bases = exposed(case, exposures)?;
        let layups = (0..layups as usize).map(|index| layup(&bases, &choices, index));
        let layups = layups.collect::<Result<Vec<_>, _>>()?;
        let ids = |choice: &ResolvedChoice| choice.materials.iter().map(|material| material.id.clone()).collect();
        let names = self.choices.iter().map(|choice| choice.ply.clone());
        let request = TradeRequest { choices: names.zip(choices.iter().map(ids)).collect(), requirement };
        Ok((request, layups))
    }
}

impl PlyChoice {
    fn resolve(&self, case: &Case) -> Result<ResolvedChoice, SessionError> {
        let Self { ply, materials } = self;
        let fault = |message: String| InputError::for_option("choices", format!(" {ply:?}: {message}"));
        let plies = plies_of(case, ply, "choices")?;
        if materials.is_empty() {
            return Err(fault("no material: expected at least one".to_owned()).into());
        }
        let mut found: Vec<Arc<Material>> = Vec::with_capacity(materials.len());
        for id in materials {
            let material = case.material_named(id).map_err(fault)?;
            if found.iter().any(|other| other.id == material.id) {
                return Err(fault(format!("the material {id:?} is named twice")).into());
            }
            found.push(material);
        }
        Ok(ResolvedChoice { plies, materials: found })
    }
}

/// The plies of a group or name, of which there must be one.
fn plies_of(case: &Case, name: &str, option: &'static str) -> Result<Vec<usize>, SessionError> {
    let plies = case.plies_of(name);
    if plies.is_empty() {
        let mut known: Vec<&str> =
            case.layup.plies.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]).collect();
        known.sort_unstable();
        known.dedup();
        let message = format!(" {name:?}: no ply or group has this name; there are {}", known.join(", "));
        return Err(InputError::for_option(option, message).into());
    }
    Ok(plies)
}

/// The case under its own exposure, and under those of other cases.
fn exposed(case: &Case, exposures: &[Case]) -> Result<Vec<Case>, SessionError> {
    let mut cases = vec![case.clone()];
    for other in exposures {
        if cases.iter().any(|known| known.id == other.id) {
            let message = format!("two cases are called {:?}: give each exposure once", other.id);
            return Err(InputError::general(message).into());
        }
        if [case, other].iter().any(|case| case.layup.origin_m > 0.0) {
            let message = format!("{:?}: the face of a thermocouple in the layup is held, not the hot face", other.id);
            return Err(InputError::general(message).into());
        }
        let exposed = case.with_exposure_of(other);
        cases.push(exposed.map_err(|error| {
            InputError::general(format!("{} under the exposure of {}: {error}", case.id, other.id))
        })?);
    }
    Ok(cases)
}

/// The layup of an index: the candidates of the last choice change fastest.
fn layup(bases: &[Case], choices: &[ResolvedChoice], index: usize) -> Result<CandidateLayup, SessionError> {
    let (mut rest, mut candidates) = (index, vec![0; choices.len()]);
    for (candidate, choice) in candidates.iter_mut().zip(choices).rev() {
        *candidate = rest % choice.materials.len();
        rest /= choice.materials.len();
    }
    let chosen = choices.iter().zip(&candidates);
    let materials: Vec<(Vec<usize>, Arc<Material>)> =
        chosen.map(|(choice, &candidate)| (choice.plies.clone(), choice.materials[candidate].clone())).collect();
    let with_materials = |case: &Case| {
        case.with_materials(&materials).map_err(|error| {
            let ids: Vec<&str> = materials.iter().map(|(_, material)| material.id.as_str()).collect();
            InputError::general(format!("{} with {}: {error}", case.id, ids.join(", ")))
        })
    };
    let cases = bases.iter().map(with_materials).collect::<Result<Vec<_>, _>>()?;
    Ok(CandidateLayup { candidates, cases })
}
