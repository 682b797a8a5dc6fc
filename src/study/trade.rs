//! The trade study: the layups of all choices of materials, each sized for its temperature limit under all exposures,
//! by their mass per area.
//!
//! All layups are sized with the same members (common random numbers), so that the sampling errors of their masses are
//! alike and cancel in the order: the ranks of resampled members tell what is left of them.

mod layup_sizing;
mod mass_derivatives;
mod rank_changes;
mod ranking;

pub use rank_changes::RankChange;
pub use ranking::{RESAMPLES, Rank, ResampledRank};

use super::size::{RequiredThickness, SizeError, SizingRequirement};
use super::uncertainty::{Failure, Sweep};
use crate::case::{Case, Material};
use crate::fit::proportion::Proportion;
use crate::kept_work::work_log::WorkLog;
use crate::march::March;
use crate::plan::ErrorEstimate;
use crate::traces::Balance;
use layup_sizing::{PreparedExposure, size_layup};
use mass_derivatives::mass_derivatives;
use rank_changes::rank_changes;
use ranking::ranks;

/// The layups to compare.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct TradeRequest {
    /// Plies or groups whose material is chosen, each with the ids of its candidates.
    pub choices: Vec<(String, Vec<String>)>,
    /// The ply that is sized, its limit and the probability.
    pub requirement: SizingRequirement,
}

/// A layup: a candidate of each choice.
#[derive(Clone, Debug)]
pub struct CandidateLayup {
    /// Index of the candidate of each choice.
    pub candidates: Vec<usize>,
    /// The case with these materials, under each exposure. All have the same plies, sensors and factors.
    pub cases: Vec<Case>,
}

/// Layups by their mass.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Trade {
    /// The request.
    pub request: TradeRequest,
    /// Ids of the cases of the exposures.
    pub exposures: Vec<String>,
    /// Members drawn for each layup.
    pub members: usize,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: &'static str,
    /// Whether the members are drawn independently of each other, as intervals by order statistics and resamples
    /// assume.
    pub has_independent_members: bool,
    /// Members marched.
    pub marches: usize,
    /// Layups: those with a rank, the lightest first, then the others.
    pub layups: Vec<SizedLayup>,
    /// How far a property would have to change for another layup to come first, the likeliest change first; `None`
    /// where the march has no derivatives.
    pub rank_changes: Option<Vec<RankChange>>,
}

/// A layup of a trade study.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct SizedLayup {
    /// Index of the candidate of each choice.
    pub candidates: Vec<usize>,
    /// Smallest and largest thickness allowed of the sized plies, m.
    pub thickness_range_m: (f64, f64),
    /// Thickness of the sized plies in the case, m.
    pub case_thickness_m: f64,
    /// Mass per area of the other plies, kg/m².
    pub fixed_mass_kg_m2: f64,
    /// Density of the sized plies, kg/m³.
    pub density_kg_m3: f64,
    /// Thickness required at nominal factors under each exposure.
    pub nominal: Vec<RequiredThickness>,
    /// Thickness for the required fraction of members under all exposures.
    pub required: RequiredThickness,
    /// 95 % confidence interval of that thickness, from the number of members; an end is `None` where there are too
    /// few, and for members that are not drawn independently.
    pub interval: (Option<RequiredThickness>, Option<RequiredThickness>),
    /// Thickness required by each member under all exposures, m; infinite where the largest does not suffice.
    pub member_thicknesses_m: Vec<f64>,
    /// Squared correlation of each factor with the required thickness, normalised to a sum of one.
    pub shares: Vec<f64>,
    /// Members whose march failed at a thickness; they count as exceeding the limit there.
    pub failures: Vec<Failure>,
    /// The exposure, by its index, with a nominal peak above the limit that a thicker ply does not lower.
    pub not_cooled: Option<usize>,
    /// Why the nominal march under that exposure failed at the largest thickness, so that nothing is known of the
    /// effect of a thicker ply; `None` where it completed.
    pub failed_at_largest: Option<String>,
    /// Highest nominal peak of all exposures at the largest thickness, K.
    pub thickest_peak_k: f64,
    /// Whether the part is hottest at the end of a run at the required thickness, so that its true peak may be later
    /// and higher.
    pub still_warming: bool,
    /// Tables of properties that end below the temperatures met at the required thickness with nominal factors.
    pub table_ends: Vec<TableEnd>,
    /// Rank of the layup; `None` where no allowed thickness suffices.
    pub rank: Option<Rank>,
    /// Estimated error of the nominal march at the case's and at the required thickness, under the exposure where it is
    /// largest.
    pub error_estimate: Option<ErrorEstimate>,
    /// Heat and mass in, out and stored of the nominal march at the required thickness, or at the largest one, under
    /// the exposure where they are off most.
    pub balance: Balance,
}

/// The table of a property that ends below the temperatures met.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct TableEnd {
    /// Id of the material.
    pub material: String,
    /// The property.
    pub property: String,
    /// End of its table, K.
    pub end_k: f64,
    /// Highest temperature met, K.
    pub met_k: f64,
}

impl SizedLayup {
    /// Thickness required at nominal factors under all exposures.
    pub fn nominal_required(&self) -> RequiredThickness {
        let later = |a: RequiredThickness, b: RequiredThickness| if b.sort_key_m() > a.sort_key_m() { b } else { a };
        self.nominal.iter().copied().reduce(later).unwrap_or(self.required)
    }

    /// Index of the exposure that requires most at nominal factors.
    pub fn governing_exposure(&self) -> usize {
        let most = self.nominal_required();
        self.nominal.iter().position(|required| *required == most).unwrap_or(0)
    }

    /// Mass per area of the layup at a thickness of the sized plies, kg/m².
    pub fn mass_kg_m2(&self, thickness_m: f64) -> f64 {
        self.fixed_mass_kg_m2 + self.density_kg_m3 * thickness_m
    }

    /// Mass per area at the required thickness, kg/m²; infinite where the largest thickness does not suffice.
    pub fn required_mass_kg_m2(&self) -> f64 {
        self.mass_kg_m2(self.required.sort_key_m())
    }

    /// Margin: required minus nominal thickness, m, where both were found.
    pub fn margin_m(&self) -> Option<f64> {
        Some(self.required.found_m()? - self.nominal_required().found_m()?)
    }

    /// Members below the limit at a thickness.
    pub fn below_limit(&self, thickness_m: f64) -> Proportion {
        let count = self.member_thicknesses_m.iter().filter(|needed_m| **needed_m <= thickness_m).count();
        Proportion { count, total: self.member_thicknesses_m.len() }
    }
}

impl Trade {
    /// The ids of the materials of a layup, one for each choice.
    pub fn materials_of(&self, layup: &SizedLayup) -> Vec<&str> {
        let choices = self.request.choices.iter().zip(&layup.candidates);
        choices.map(|((_, ids), &candidate)| ids[candidate].as_str()).collect()
    }

    /// The layups with a rank, the lightest first.
    pub fn ranked(&self) -> &[SizedLayup] {
        &self.layups[..self.layups.partition_point(|layup| layup.rank.is_some())]
    }

    /// The layups that no allowed thickness suffices for.
    pub fn unranked(&self) -> &[SizedLayup] {
        &self.layups[self.ranked().len()..]
    }
}

/// Size all layups with the same members, and rank them.
///
/// # Errors
/// When the ply cannot be sized or the device fails. That no allowed thickness suffices for a layup is a result and no
/// error.
pub(crate) fn trade(
    candidates: &[CandidateLayup],
    march: &mut dyn March,
    request: &TradeRequest,
    sweep: &Sweep,
    log: &mut dyn WorkLog,
) -> Result<Trade, SizeError> {
    let (requirement, exposures) = (&request.requirement, candidates.first().map_or(&[][..], |layup| &layup.cases));
    let Some(case) = exposures.first().filter(|case| !case.factors.is_empty()) else {
        return Err(SizeError::NoFactors);
    };
    let drawn = sweep.ensemble(case);
    let (mut found, mut marches) = (Vec::with_capacity(candidates.len()), 0);
    for candidate in candidates {
        let prepared = candidate.cases.iter().map(|case| PreparedExposure::new(case, requirement, march));
        let mut prepared = prepared.collect::<Result<Vec<_>, _>>()?;
        let sized = size_layup(candidate, &mut prepared, march, requirement, sweep, &drawn, log)?;
        let derivatives = mass_derivatives(&prepared, &sized, march, &drawn, requirement.probability)?;
        marches += sized.marches;
        found.push((sized.layup, derivatives));
    }
    let layups: Vec<&SizedLayup> = found.iter().map(|(layup, _)| layup).collect();
    let ranks = ranks(&layups, sweep, requirement.probability);
    found.iter_mut().zip(ranks).for_each(|((layup, _), rank)| layup.rank = rank);
    found.sort_by(|(a, _), (b, _)| a.required_mass_kg_m2().total_cmp(&b.required_mass_kg_m2()));
    let (layups, derivatives): (Vec<SizedLayup>, Vec<_>) = found.into_iter().unzip();
    let derivatives: Option<Vec<_>> = derivatives.into_iter().collect();
    let plies = candidates.iter().flat_map(|candidate| &candidate.cases[0].layup.plies);
    let materials: Vec<&Material> = plies.map(|ply| &*ply.material).collect();
    Ok(Trade {
        request: request.clone(),
        exposures: exposures.iter().map(|case| case.id.clone()).collect(),
        members: sweep.members,
        sampling: sweep.sampling.kind.name(),
        has_independent_members: sweep.sampling.kind.has_independent_members(),
        marches,
        rank_changes: derivatives.map(|derivatives| rank_changes(&layups, &derivatives, &materials)),
        layups,
    })
}
