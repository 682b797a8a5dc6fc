//! The question of `trade`: the layups of all choices of materials.

use super::draw::Draw;
use super::error::{InputError, check_limit};
use super::named_case::NamedCase;
use super::quantity;
use super::size::{Requirement, plies_of};
use crate::case::{Case, Material};
use crate::limits::{LAYUPS, STATISTICS_MIB};
use crate::study::trade::{CandidateLayup, TradeRequest};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// A ply, or a group, and the materials that it may be of: `INS=pyrogel3350,saffil-96`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlyChoice {
    /// Name of the ply or group.
    pub ply: String,
    /// Ids of materials: of a ply of the case, or of the database.
    pub materials: Vec<String>,
}

impl fmt::Display for PlyChoice {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}={}", self.ply, self.materials.join(","))
    }
}

impl FromStr for PlyChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected PLY=MATERIALS, such as INS=pyrogel3350,saffil-96";
        let (ply, materials) = text.split_once('=').ok_or(expected)?;
        let materials: Vec<String> = materials.split(',').map(|id| id.trim().to_owned()).collect();
        if materials.iter().any(String::is_empty) {
            return Err(format!("{expected}, found an empty name of a material"));
        }
        Ok(Self { ply: ply.trim().to_owned(), materials })
    }
}

/// Layups of all choices of materials, each sized for a temperature limit, by mass per area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Trade {
    /// Further cases whose exposures every layup must hold too
    #[cfg_attr(feature = "command", arg(value_name = "CASE", value_parser = super::named_case::parser()))]
    pub exposures: Vec<NamedCase>,
    /// Ply or group, and the materials that it may be of, as INS=pyrogel3350,saffil-96; repeated for each choice
    #[cfg_attr(feature = "command", arg(long = "ply", value_name = "PLY=MATERIALS", required = true))]
    #[serde(with = "quantity::list_of_lists")]
    pub choices: Vec<PlyChoice>,
    /// Ply to size, or a group whose plies are scaled together
    #[cfg_attr(feature = "command", arg(long, value_name = "PLY"))]
    pub size: String,
    /// The limit that it holds.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub requirement: Requirement,
    /// Number of members (random samples of the factors), the same for all layups
    #[cfg_attr(feature = "command", arg(
        short = 'n',
        value_name = "MEMBERS",
        default_value_t = Trade::default().members,
        value_parser = quantity::count::parse
    ))]
    #[serde(with = "quantity::count")]
    pub members: usize,
    /// How they are drawn.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub draw: Draw,
}

impl Default for Trade {
    fn default() -> Self {
        Self {
            exposures: Vec::new(),
            choices: Vec::new(),
            size: String::new(),
            requirement: Requirement::default(),
            members: 2000,
            draw: Draw::default(),
        }
    }
}

/// A choice for a case.
struct ResolvedChoice {
    plies: Vec<usize>,
    materials: Vec<Arc<Material>>,
}

impl Trade {
    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong, or a layup is no valid case.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.resolved(case, &self.exposures()?).map(|_| ())
    }

    /// The cases of the further exposures.
    pub(crate) fn exposures(&self) -> Result<Vec<Case>, InputError> {
        self.exposures.iter().map(|other| other.case().cloned()).collect()
    }

    /// The request and its layups under these exposures.
    pub(crate) fn resolved(
        &self,
        case: &Case,
        exposures: &[Case],
    ) -> Result<(TradeRequest, Vec<CandidateLayup>), InputError> {
        plies_of(case, &self.size, "size")?;
        let requirement = self.requirement.of(&self.size, case, self.members)?;
        let choices = self.choices.iter().map(|choice| choice.resolve(case)).collect::<Result<Vec<_>, _>>()?;
        if choices.is_empty() {
            return Err(InputError::for_option("choices", ": none given: expected the materials of a ply"));
        }
        for (index, choice) in choices.iter().enumerate() {
            let is_shared = |other: &ResolvedChoice| other.plies.iter().any(|ply| choice.plies.contains(ply));
            if let Some(other) = choices[..index].iter().position(is_shared) {
                let (name, other) = (&self.choices[index].ply, &self.choices[other].ply);
                let message = format!(" {name:?}: {other:?} chooses the material of the same ply");
                return Err(InputError::for_option("choices", message));
            }
        }
        let layups = choices.iter().map(|choice| choice.materials.len() as f64).product::<f64>();
        check_limit(&LAYUPS, layups, "choices")?;
        let members = self.members;
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
    fn resolve(&self, case: &Case) -> Result<ResolvedChoice, InputError> {
        let Self { ply, materials } = self;
        let fault = |message: String| InputError::for_option("choices", format!(" {ply:?}: {message}"));
        let plies = plies_of(case, ply, "choices")?;
        if materials.is_empty() {
            return Err(fault("no material: expected at least one".to_owned()));
        }
        let mut found: Vec<Arc<Material>> = Vec::with_capacity(materials.len());
        for id in materials {
            let material = case.material_named(id).map_err(fault)?;
            if found.iter().any(|other| other.id == material.id) {
                return Err(fault(format!("the material {id:?} is named twice")));
            }
            found.push(material);
        }
        Ok(ResolvedChoice { plies, materials: found })
    }
}

/// The case under its own exposure, and under those of other cases.
fn exposed(case: &Case, exposures: &[Case]) -> Result<Vec<Case>, InputError> {
    let mut cases = vec![case.clone()];
    for other in exposures {
        if cases.iter().any(|known| known.id == other.id) {
            let message = format!("two cases are called {:?}: give each exposure once", other.id);
            return Err(InputError::general(message));
        }
        if [case, other].iter().any(|case| case.layup.origin_m > 0.0) {
            let message = format!("{:?}: the face of a thermocouple in the layup is held, not the hot face", other.id);
            return Err(InputError::general(message));
        }
        let exposed = case.with_exposure_of(other);
        cases.push(exposed.map_err(|error| {
            InputError::general(format!("{} under the exposure of {}: {error}", case.id, other.id))
        })?);
    }
    Ok(cases)
}

/// The layup of an index: the candidates of the last choice change fastest.
fn layup(bases: &[Case], choices: &[ResolvedChoice], index: usize) -> Result<CandidateLayup, InputError> {
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
