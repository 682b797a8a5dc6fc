//! Sizing: the thickness of a ply that keeps a sensor, a ply or an interface below its temperature limit with a given
//! probability.

mod required_thickness;
mod scalable_case;
mod thickness_march;

pub use required_thickness::RequiredThickness;
pub(in crate::study) use scalable_case::{ScalableCase, mass_kg_m2};
pub(in crate::study) use thickness_march::{SearchStart, ThicknessMarch, by_reason};

use super::margins::quantile_rank;
use super::nominal::{Peak, Prediction, nominal};
use super::uncertainty::{Failure, Sweep, uncertainty};
use crate::adapt::{ACCEPTED_ERROR, adapt_for, checked_at_members};
use crate::case::{Case, LimitedPart, TemperatureLimit};
use crate::ensemble::{Sampling, SamplingKind};
use crate::fit::proportion::{Proportion, counts_below_95, quantile_ranks_95};
use crate::kept_work::work_log::WorkLog;
use crate::march::{March, MarchError};
use crate::plan::ErrorEstimate;
use crate::traces::{Balance, MemberStatus};
use scalable_case::with_scaled_plies;
use thickness_march::guess_thickness_m;

/// Numbers of a row in the log of a sizing.
pub(crate) use thickness_march::LOG_COLUMNS;

/// Requirement on a ply.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SizingRequirement {
    /// A ply, or a group whose plies are scaled by one ratio.
    pub ply: String,
    /// The part whose peak must not exceed the limit.
    pub part: LimitedPart,
    /// The limit, K.
    pub limit_k: f64,
    /// Required fraction of members below the limit.
    pub probability: f64,
    /// Smallest and largest total thickness of the plies, m; `None` for a quarter to four times the case's thickness.
    pub thickness_range_m: Option<(f64, f64)>,
}

/// Result of sizing a ply.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Sizing {
    /// The requirement.
    pub requirement: SizingRequirement,
    /// Smallest and largest thickness allowed, m.
    pub thickness_range_m: (f64, f64),
    /// Thickness in the case, m.
    pub case_thickness_m: f64,
    /// Required thickness with nominal factors.
    pub nominal: RequiredThickness,
    /// Thickness for the required fraction of members.
    pub required: RequiredThickness,
    /// 95 % confidence interval of that thickness, from the number of members; an end is `None` where there are too
    /// few, and for members that are not drawn independently.
    pub interval: (Option<RequiredThickness>, Option<RequiredThickness>),
    /// Members drawn.
    pub members: usize,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: &'static str,
    /// Whether the members are drawn independently of each other, as intervals by order statistics assume. Those of the
    /// check always are.
    pub has_independent_members: bool,
    /// Members whose march failed at a thickness; they count as exceeding the limit there.
    pub failures: Vec<Failure>,
    /// Thickness required by each member, m, in rising order; infinite where the largest thickness does not suffice.
    pub member_thicknesses_m: Vec<f64>,
    /// Squared correlation of each factor with the required thickness, normalised to a sum of one; zero where nothing
    /// varies.
    pub shares: Vec<f64>,
    /// Peak temperature over thickness, thinnest first.
    pub peak_curve: Vec<PeakCurvePoint>,
    /// Mean density of the sized plies, kg/m³: their mass per area divided by their thickness.
    pub density_kg_m3: f64,
    /// Whether the part peaks at the end of the run, so that its true peak may be later and higher.
    pub still_warming: bool,
    /// Independent Monte Carlo at the thickness found; `None` where none was found.
    pub check: Option<IndependentCheck>,
    /// Estimated error of the nominal march at the case's and at the required thickness.
    pub error_estimate: Option<ErrorEstimate>,
    /// Heat and mass in, out and stored of the nominal march at the required thickness; `None` where none was found.
    pub balance: Option<Balance>,
    /// Members marched, including the check.
    pub marches: usize,
}

/// Peak temperatures at one thickness.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PeakCurvePoint {
    /// The thickness, m.
    pub thickness_m: f64,
    /// Peak with nominal factors.
    pub nominal: Peak,
    /// Percentiles 2.5, 50, 97.5 of the members' peaks, K, for the same members at every thickness; infinite where that
    /// many failed.
    pub percentiles_k: [f64; 3],
}

/// An independent Monte Carlo at the thickness found, with a new seed and a newly adapted plan, so that it shares
/// neither members nor cells with the search.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct IndependentCheck {
    /// The seed of the members.
    pub seed: u64,
    /// Members below the limit; a failed member is not.
    pub below_limit: Proportion,
    /// Members that failed.
    pub failed: usize,
    /// Nominal peak, K.
    pub nominal_k: f64,
    /// Percentiles 2.5, 50, 97.5 of the members' peaks, K.
    pub percentiles_k: [f64; 3],
}

/// Errors of sizing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SizeError {
    /// The case has no ply or group of this name.
    #[error("no ply or group is named {name:?}; the names are {known}")]
    NoPly {
        /// The requested name.
        name: String,
        /// The available names.
        known: String,
    },
    /// A factor scales the thickness of this ply and of others together.
    #[error("{ply:?} cannot be sized alone: factor {factor:?} also scales the thickness of other plies")]
    OtherPlies {
        /// The ply.
        ply: String,
        /// The factor.
        factor: String,
    },
    /// The case has no factors.
    #[error("the case has no factors, so a probability is undefined")]
    NoFactors,
    /// The whole layup starts above the limit.
    #[error(
        "{part} starts above its limit: expected a limit of at least {start_k:.1} K, the lowest initial temperature, \
         found {limit_k:.1} K; no thickness of {ply} and no length of the run helps"
    )]
    StartsAboveLimit {
        /// The part with the limit.
        part: String,
        /// The ply.
        ply: String,
        /// The lowest initial temperature, K.
        start_k: f64,
        /// The limit, K.
        limit_k: f64,
    },
    /// The peak does not decrease with thickness.
    #[error(
        "{part} is not cooled by a thicker {ply}: its peak is {thin_k:.1} K at {thin_mm} mm and {thick_k:.1} K at \
         {thick_mm} mm"
    )]
    NotCooled {
        /// The part with the limit.
        part: String,
        /// The ply.
        ply: String,
        /// The smallest thickness, mm.
        thin_mm: f64,
        /// The peak there, K.
        thin_k: f64,
        /// The largest thickness, mm.
        thick_mm: f64,
        /// The peak there, K.
        thick_k: f64,
    },
    /// The nominal march failed at the largest thickness, so that nothing is known of its effect.
    #[error("the march at nominal factors failed with {ply} of {thick_mm} mm, the largest thickness allowed: {reason}")]
    FailedAtLargest {
        /// The ply.
        ply: String,
        /// The largest thickness, mm.
        thick_mm: f64,
        /// Why it failed.
        reason: String,
    },
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Number of thicknesses in the peak curve, evenly spaced in the logarithm.
const CURVE_POINTS: usize = 13;
/// Most adaptations of cells and steps to the thickness found: it may be far from that of the case.
pub(in crate::study) const MAX_ADAPTATIONS: usize = 3;
/// Members marched for the percentiles of the peak curve.
pub const CURVE_MEMBERS: usize = 400;
/// Smallest decrease of the nominal peak over the allowed range; below it, thickness does not cool the part, K.
const MIN_COOLING_K: f64 = 1.0;

/// Relative accuracy of a required thickness.
const SEARCH_ACCURACY: f64 = 1e-4;

/// Find the required thickness. The same members are marched at every thickness (common random numbers), so the
/// required thickness is as smooth as the peaks. `log` keeps the members that are marched, but for those of the
/// independent check.
///
/// # Errors
/// When the ply cannot be sized, its thickness does not cool the part, or the device fails. No allowed thickness
/// sufficing, or every one, is a result and no error.
pub fn size(
    case: &Case,
    march: &mut dyn March,
    demand: &SizingRequirement,
    sweep: &Sweep,
    log: &mut dyn WorkLog,
) -> Result<Sizing, SizeError> {
    if case.factors.is_empty() {
        return Err(SizeError::NoFactors);
    }
    check_start(case, demand)?;
    let mut limited = case.clone();
    limited.limits = vec![TemperatureLimit { part: demand.part, limit_k: demand.limit_k }];
    let case = &limited;
    let scalable = ScalableCase::new(case, &demand.ply)?;
    let precision = march.backend().precision;
    let mut plan = adapt_for(&scalable.case, precision, &march.monitor())?;
    let drawn_m = scalable.case_thickness_m;
    let (members, drawn) = (sweep.members, sweep.ensemble(case));
    let mut marches = 0;
    let mut adaptations = 1;
    let (NominalSizing { within_m, curve, required: nominal, .. }, found) = loop {
        let mut trial = ThicknessMarch { scalable: &scalable, plan: &plan, march, log, marches: 0 };
        let sizing = size_nominally(&mut trial, demand)?;
        check_cooled(case, demand, &sizing)?;
        let starts = vec![SearchStart { within_m: sizing.within_m, first_m: sizing.first_m }; members];
        let found = trial.required_thicknesses(&starts, &sizing.curve, |member| drawn.member(member))?;
        marches += trial.marches;
        let thickness_m = required_quantile(&found.required, demand.probability).sort_key_m().min(sizing.within_m.1);
        let at_answer = scalable.nominal_member(thickness_m);
        let monitor = march.monitor();
        let checked = checked_at_members(&scalable.case, &plan, &at_answer, precision, ACCEPTED_ERROR, &monitor)?;
        if checked.is_adapted_anew && adaptations == MAX_ADAPTATIONS {
            break (sizing, found);
        }
        plan = checked.plan;
        if !checked.is_adapted_anew {
            break (sizing, found);
        }
        adaptations += 1;
    };
    let mut trial = ThicknessMarch { scalable: &scalable, plan: &plan, march, log, marches };
    let shares = squared_correlation_shares(case.factors.len(), &found.required, |member| drawn.member(member));
    let mut inorder = found.required.clone();
    inorder.sort_by(|a, b| a.sort_key_m().total_cmp(&b.sort_key_m()));
    let needed = inorder[quantile_rank(members, demand.probability) - 1];
    let kind = sweep.sampling.kind;
    let end = |rank: Option<usize>| rank.filter(|_| kind.has_independent_members()).map(|rank| inorder[rank - 1]);
    let (low, high) = quantile_ranks_95(members, demand.probability);
    let interval = (end(low), end(high));

    let band = members.min(CURVE_MEMBERS);
    let each = curve.iter().flat_map(|&(at_m, _)| (0..band).map(move |member| (member, at_m)));
    let peaks = trial.peaks(each.map(|(member, at_m)| (drawn.member(member), at_m)))?;
    let rungs = curve.iter().zip(peaks.chunks(band)).map(|(&(thickness_m, nominal), met)| {
        let mut peaks_k: Vec<f64> = met.iter().map(|met| met.peak.temperature_k).collect();
        peaks_k.sort_by(f64::total_cmp);
        let at = |percent: f64| peaks_k[quantile_rank(peaks_k.len(), percent / 100.0) - 1];
        PeakCurvePoint { thickness_m, nominal, percentiles_k: [2.5, 50.0, 97.5].map(at) }
    });
    let rungs: Vec<PeakCurvePoint> = rungs.collect();

    let ThicknessMarch { march, mut marches, .. } = trial;
    let (precision, monitor) = (march.backend().precision, march.monitor());
    let error_estimate = plan.error_estimate.clone();
    let at_corners =
        |error: ErrorEstimate| error.at_corners_of(sweep.bounds, &scalable.case, &plan, precision, &monitor);
    let error_estimate = error_estimate.map(at_corners).transpose()?;
    let plies = &scalable.plies;
    let mut still_warming = curve[curve.len() - 1].1.time_s >= case.exposure.duration_s;
    let (mut checked, mut balance) = (None, None);
    if let Some(thickness_m) = needed.found_m() {
        let anew = with_scaled_plies(case, plies, thickness_m / drawn_m);
        let (check, at_answer) = independent_check(&anew, march, demand, sweep)?;
        still_warming = at_answer.margins[0].peak.time_s >= case.exposure.duration_s;
        balance = Some(at_answer.balance);
        marches += members + 1;
        checked = Some(check);
    }
    Ok(Sizing {
        thickness_range_m: within_m,
        case_thickness_m: drawn_m,
        nominal,
        required: needed,
        interval,
        members,
        sampling: kind.name(),
        has_independent_members: kind.has_independent_members(),
        failures: by_reason(found.failed),
        member_thicknesses_m: inorder.iter().map(|needed| needed.sort_key_m()).collect(),
        shares,
        peak_curve: rungs,
        density_kg_m3: mass_kg_m2(case, plies, drawn_m) / drawn_m,
        still_warming,
        check: checked,
        error_estimate,
        balance,
        marches,
        requirement: demand.clone(),
    })
}

/// The thickness that a fraction of the members requires at most.
pub(in crate::study) fn required_quantile(required: &[RequiredThickness], probability: f64) -> RequiredThickness {
    let mut inorder = required.to_vec();
    inorder.sort_by(|a, b| a.sort_key_m().total_cmp(&b.sort_key_m()));
    inorder[quantile_rank(inorder.len(), probability) - 1]
}

/// The nominal sizing of a case.
pub(in crate::study) struct NominalSizing {
    /// Smallest and largest thickness allowed, m.
    pub within_m: (f64, f64),
    /// Peak at thicknesses between them, thinnest first.
    pub curve: Vec<(f64, Peak)>,
    /// Why the march failed at the largest thickness; `None` where it completed.
    pub failed_at_largest: Option<String>,
    /// The thickness that nominal factors require.
    pub required: RequiredThickness,
    /// Where the search of other members begins, m.
    pub first_m: f64,
}

/// Peaks over the allowed thicknesses at nominal factors, and the thickness that these require.
pub(in crate::study) fn size_nominally(
    trial: &mut ThicknessMarch<'_>,
    demand: &SizingRequirement,
) -> Result<NominalSizing, MarchError> {
    let drawn_m = trial.scalable.case_thickness_m;
    let within_m = demand.thickness_range_m.unwrap_or((drawn_m / 4.0, drawn_m * 4.0));
    let nominal_row = trial.scalable.nominal_factors();
    let thicknesses_m = thickness_grid(within_m);
    let mut curve = trial.peaks(thicknesses_m.iter().map(|&thickness_m| (nominal_row.clone(), thickness_m)))?;
    let failed_at_largest = curve.last_mut().and_then(|met| met.failed.take());
    let curve: Vec<(f64, Peak)> = thicknesses_m.iter().copied().zip(curve.into_iter().map(|met| met.peak)).collect();
    let first_m = guess_thickness_m(&curve, curve[0].0, curve[0].1.temperature_k - demand.limit_k);
    let starts = [SearchStart { within_m, first_m }];
    let required = trial.required_thicknesses(&starts, &curve, |_| nominal_row.clone())?.required[0];
    Ok(NominalSizing { within_m, curve, failed_at_largest, required, first_m: required.found_m().unwrap_or(first_m) })
}

impl Sizing {
    /// Margin: required minus nominal thickness, m, where both were found.
    pub fn margin_m(&self) -> Option<f64> {
        Some(self.required.found_m()? - self.nominal.found_m()?)
    }

    /// Mass per area of the sized plies at a total thickness, kg/m².
    pub fn mass_kg_m2(&self, thickness_m: f64) -> f64 {
        self.density_kg_m3 * thickness_m
    }

    /// Members below the limit at a thickness.
    pub fn below_limit(&self, thickness_m: f64) -> Proportion {
        Proportion {
            count: self.member_thicknesses_m.partition_point(|needed_m| *needed_m <= thickness_m),
            total: self.members,
        }
    }

    /// 95 % range of the count of the check over repeated sizings with as many members, if the model is right. Both the
    /// thickness, a sample quantile, and the count of the check scatter. `None` without a check, and where the members
    /// of the thickness are not drawn independently.
    pub fn expected_count_95(&self) -> Option<(Proportion, Proportion)> {
        let of = self.check.as_ref().filter(|_| self.has_independent_members)?.below_limit.total;
        let rank = quantile_rank(self.members, self.requirement.probability);
        let (low, high) = counts_below_95(rank, self.members, of);
        Some((Proportion { count: low, total: of }, Proportion { count: high, total: of }))
    }

    /// Whether the count of the check is within the [expected](Self::expected_count_95) range.
    pub fn is_confirmed(&self) -> Option<bool> {
        let (low, high) = self.expected_count_95()?;
        Some((low.count..=high.count).contains(&self.check.as_ref()?.below_limit.count))
    }
}

/// Thicknesses evenly spaced in the logarithm, rising.
fn thickness_grid((low_m, high_m): (f64, f64)) -> Vec<f64> {
    let at = |rung: usize| low_m * (high_m / low_m).powf(rung as f64 / (CURVE_POINTS - 1) as f64);
    (0..CURVE_POINTS).map(|rung| if rung + 1 == CURVE_POINTS { high_m } else { at(rung) }).collect()
}

/// Require that some part of the layup starts below the limit.
pub(in crate::study) fn check_start(case: &Case, demand: &SizingRequirement) -> Result<(), SizeError> {
    let start_k = case.exposure.initial_k.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
    if start_k <= demand.limit_k {
        return Ok(());
    }
    Err(SizeError::StartsAboveLimit {
        part: demand.part.name(&case.layup, &case.sensors),
        ply: demand.ply.clone(),
        start_k,
        limit_k: demand.limit_k,
    })
}

/// Whether the nominal peak falls over the allowed range.
pub(in crate::study) fn is_cooled(curve: &[(f64, Peak)]) -> bool {
    let (thin_k, thick_k) = (curve[0].1.temperature_k, curve[curve.len() - 1].1.temperature_k);
    !thin_k.is_finite() || thick_k <= thin_k - MIN_COOLING_K
}

fn check_cooled(case: &Case, demand: &SizingRequirement, sizing: &NominalSizing) -> Result<(), SizeError> {
    if is_cooled(&sizing.curve) {
        return Ok(());
    }
    let [(thin_m, thin), .., (thick_m, thick)] = &sizing.curve[..] else { return Ok(()) };
    let (thin_k, thick_k) = (thin.temperature_k, thick.temperature_k);
    // Millimetres, rounded to 0.1 µm.
    let mm = |length_m: f64| (1e7 * length_m).round() / 1e4;
    if let Some(reason) = &sizing.failed_at_largest {
        let (ply, reason) = (demand.ply.clone(), reason.clone());
        return Err(SizeError::FailedAtLargest { ply, thick_mm: mm(*thick_m), reason });
    }
    Err(SizeError::NotCooled {
        part: demand.part.name(&case.layup, &case.sensors),
        ply: demand.ply.clone(),
        thin_mm: mm(*thin_m),
        thin_k,
        thick_mm: mm(*thick_m),
        thick_k,
    })
}

/// Squared correlations of the factors with the required thickness, normalised, over the members with one between the
/// bounds.
pub(in crate::study) fn squared_correlation_shares(
    factors: usize,
    needed: &[RequiredThickness],
    row: impl Fn(usize) -> Vec<f64>,
) -> Vec<f64> {
    let (rows, found_m): (Vec<Vec<f64>>, Vec<f64>) =
        needed.iter().enumerate().filter_map(|(member, needed)| Some((row(member), needed.found_m()?))).unzip();
    let about_mean = |values: Vec<f64>| -> Vec<f64> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|value| value - mean).collect()
    };
    let mean_m = found_m.iter().sum::<f64>() / found_m.len() as f64;
    let off_m = about_mean(found_m);
    let squared = |factor: usize| {
        let off = about_mean(rows.iter().map(|row| row[factor]).collect());
        let variance: f64 = off.iter().map(|off| off * off).sum();
        let covariance: f64 = off.iter().zip(&off_m).map(|(off, off_m)| off * off_m).sum();
        if variance > 0.0 { covariance * covariance / variance } else { 0.0 }
    };
    // Thicknesses that differ by less are equal to the accuracy of the search.
    let scatter_m = (off_m.iter().map(|off_m| off_m * off_m).sum::<f64>() / off_m.len() as f64).sqrt();
    if scatter_m.is_nan() || scatter_m < SEARCH_ACCURACY * mean_m {
        return vec![0.0; factors];
    }
    let squares: Vec<f64> = (0..factors).map(squared).collect();
    let total: f64 = squares.iter().sum();
    squares.iter().map(|square| if total > 0.0 { square / total } else { 0.0 }).collect()
}

/// Independent random members of another seed at the thickness found, by the path of `uncertainty`; and the nominal
/// peak.
fn independent_check(
    anew: &Case,
    march: &mut dyn March,
    demand: &SizingRequirement,
    sweep: &Sweep,
) -> Result<(IndependentCheck, Prediction), MarchError> {
    let plan = adapt_for(anew, march.backend().precision, &march.monitor())?;
    let nominal = nominal(anew, &plan, march)?;
    let Sweep { members, sampling, .. } = *sweep;
    let kind = if sampling.kind == SamplingKind::Uniform { SamplingKind::Uniform } else { SamplingKind::Normal };
    let sampling = Sampling { kind, seed: sampling.seed.wrapping_add(1) };
    let mut peaks_k = Vec::with_capacity(members);
    let outcome = uncertainty(anew, &plan, march, &nominal, &Sweep { sampling, ..*sweep }, &mut |_, traces| {
        let completed = (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed);
        peaks_k.extend(completed.map(|member| traces.limited_peak(member, 0).temperature_k));
    })?;
    peaks_k.sort_by(f64::total_cmp);
    let count = peaks_k.partition_point(|&peak_k| peak_k <= demand.limit_k);
    let percentile_k = |percent: f64| match peaks_k.len() {
        0 => f64::NAN,
        completed => peaks_k[quantile_rank(completed, percent / 100.0) - 1],
    };
    let check = IndependentCheck {
        seed: sampling.seed,
        below_limit: Proportion { count, total: members },
        failed: members - outcome.completed,
        nominal_k: nominal.margins[0].peak.temperature_k,
        percentiles_k: [2.5, 50.0, 97.5].map(percentile_k),
    };
    Ok((check, nominal))
}
