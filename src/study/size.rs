//! How thick must a ply be for a sensor to stay below its limit?

mod needed;
mod stretched;
mod trial;

pub use needed::Needed;

use super::nominal::{Peak, nominal};
use super::proportion::{Proportion, counts_below_95, ranks_95};
use super::uncertainty::{Failure, Sweep, uncertainty};
use crate::case::Case;
use crate::ensemble::{Sampling, SamplingKind};
use crate::march::{March, MarchError};
use crate::pilot::pilot_monitored;
use crate::traces::Arrival;
use stretched::{mass_kg_m2, redrawn};
use trial::{Trial, guess};

/// What is asked of a ply.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Demand {
    /// A ply, or a group whose plies are stretched alike.
    pub ply: String,
    /// The sensor whose highest temperature over the whole run is to stay below the limit.
    pub sensor: usize,
    /// The limit, K.
    pub limit_k: f64,
    /// The share of members that are to hold it.
    pub probability: f64,
    /// The thinnest and the thickest allowed, of all the plies together, m; `None` takes a quarter of what is drawn to four
    /// times that.
    pub within_m: Option<(f64, f64)>,
}

/// The thickness that a ply needs.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Sizing {
    /// What was asked of the ply.
    pub demand: Demand,
    /// The thinnest and the thickest allowed, and the thickness as drawn, m.
    pub within_m: (f64, f64),
    /// The thickness as drawn, m.
    pub drawn_m: f64,
    /// With every factor nominal.
    pub nominal: Needed,
    /// For the share of members that is asked for.
    pub needed: Needed,
    /// Where that lies with 95 % confidence, as the members are so many draws; `None` where these are too few to say.
    pub interval: (Option<Needed>, Option<Needed>),
    /// Members drawn.
    pub members: usize,
    /// Members that failed at a thickness, and count there as if they had exceeded the limit.
    pub failures: Vec<Failure>,
    /// What each member needs, thinnest first, m; infinite where the thickest allowed does not hold.
    pub each_m: Vec<f64>,
    /// Squared correlations of the factors with what members need, over their sum; zero where nothing varies.
    pub shares: Vec<f64>,
    /// Peaks over thickness, thinnest first.
    pub rungs: Vec<Rung>,
    /// Mass on an area of the plies that are sized, per thickness of them all together, kg/m³.
    pub density_kg_m3: f64,
    /// Whether the sensor is at its hottest when the run ends, and so may still become hotter.
    pub still_warming: bool,
    /// Other members at the thickness found; none where none was found.
    pub check: Option<Check>,
    /// Members marched, those of the check among them.
    pub marches: usize,
}

/// Peaks at one thickness.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Rung {
    /// The thickness, m.
    pub thickness_m: f64,
    /// The peak with nominal factors.
    pub nominal: Peak,
    /// Percentiles 2.5, 50, 97.5 of the same members' peaks at every rung, K; infinite where so many failed.
    pub percentiles_k: [f64; 3],
}

/// An independent Monte Carlo at the thickness found: the case is drawn and planned anew, so that neither its members nor
/// its cells are those of the search.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Check {
    /// The seed of the members.
    pub seed: u64,
    /// Members that held the limit; one that failed did not.
    pub held: Proportion,
    /// Members that failed.
    pub failed: usize,
    /// The nominal peak, and percentiles 2.5, 50, 97.5 of the members', K.
    pub nominal_k: f64,
    /// Percentiles 2.5, 50, 97.5 of the members' peaks, K.
    pub percentiles_k: [f64; 3],
}

/// Why nothing was sized.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SizeError {
    /// The case has no such ply or group.
    #[error("no ply or group is called {name:?}; there are {known}")]
    NoPly {
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A factor scales the thickness of other plies with that of this one.
    #[error("{ply:?} cannot be sized alone: factor {factor:?} scales the thickness of other plies with it")]
    OtherPlies {
        /// The ply.
        ply: String,
        /// The factor.
        factor: String,
    },
    /// The case has no factors.
    #[error("the case has no factors to vary, and a probability needs some")]
    NoFactors,
    /// The sensor's peak does not fall with the thickness.
    #[error(
        "{sensor} is not cooled by a thicker {ply}: it peaks at {thin_k:.1} K with {thin_mm} mm and at {thick_k:.1} K with \
         {thick_mm} mm"
    )]
    NotCooled {
        /// The sensor.
        sensor: String,
        /// The ply.
        ply: String,
        /// The least thickness, mm.
        thin_mm: f64,
        /// The peak there, K.
        thin_k: f64,
        /// The largest thickness, mm.
        thick_mm: f64,
        /// The peak there, K.
        thick_k: f64,
    },
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Thicknesses at which peaks are told, evenly spaced in their logarithm.
const RUNGS: usize = 13;
/// Members whose peaks are told there: enough for percentiles that are drawn, and few beside those that are counted.
pub const BAND: usize = 400;
/// A sensor whose nominal peak falls by less over all that is allowed is not cooled, K.
const FALL_K: f64 = 1.0;

/// Find the thickness. Every member is the same at every thickness, so what members need is as smooth as their peaks.
///
/// # Errors
/// When the ply cannot be sized, its thickness does not cool the sensor, or the device fails. That no thickness allowed
/// suffices, or every one does, is an answer.
pub fn size(case: &Case, march: &mut dyn March, demand: &Demand, sweep: &Sweep) -> Result<Sizing, SizeError> {
    if case.factors.is_empty() {
        return Err(SizeError::NoFactors);
    }
    let mut trial = Trial::new(case, march, demand)?;
    let drawn_m = trial.stretched.drawn_m;
    let within_m = demand.within_m.unwrap_or((drawn_m / 4.0, drawn_m * 4.0));
    let nominal_row: Vec<f64> = case.factors.iter().map(|factor| factor.nominal).collect();
    let (members, drawn) = (sweep.members, sweep.ensemble(case));

    let thicknesses_m = ladder(within_m);
    let curve = trial.peaks(thicknesses_m.iter().map(|&thickness_m| (nominal_row.clone(), thickness_m)))?;
    let curve: Vec<(f64, Peak)> = thicknesses_m.iter().copied().zip(curve.into_iter().map(|met| met.peak)).collect();
    is_cooled(case, demand, &curve)?;
    let first_m = guess(&curve, curve[0].0, curve[0].1.temperature_k - demand.limit_k);
    let found = trial.needed(within_m, 1, first_m, &curve, |_| nominal_row.clone())?;
    let nominal = found.needed[0];

    let found = trial.needed(within_m, members, nominal.found_m().unwrap_or(first_m), &curve, |i| drawn.member(i))?;
    let shares = shares(case.factors.len(), &found.needed, |member| drawn.member(member));
    let mut inorder = found.needed.clone();
    inorder.sort_by(|a, b| a.least_m().total_cmp(&b.least_m()));
    let needed = inorder[rank(members, demand.probability) - 1];
    let (low, high) = ranks_95(members, demand.probability);

    let band = members.min(BAND);
    let each = thicknesses_m.iter().flat_map(|&at_m| (0..band).map(move |member| (member, at_m)));
    let peaks = trial.peaks(each.map(|(member, at_m)| (drawn.member(member), at_m)))?;
    let rungs = curve.iter().zip(peaks.chunks(band)).map(|(&(thickness_m, nominal), met)| {
        let mut peaks_k: Vec<f64> = met.iter().map(|met| met.peak.temperature_k).collect();
        peaks_k.sort_by(f64::total_cmp);
        let at = |percent: f64| peaks_k[rank(peaks_k.len(), percent / 100.0) - 1];
        Rung { thickness_m, nominal, percentiles_k: [2.5, 50.0, 97.5].map(at) }
    });
    let rungs: Vec<Rung> = rungs.collect();

    let (plies, mut marches) = (trial.stretched.plies, trial.marches);
    let mut still_warming = curve[curve.len() - 1].1.time_s >= case.exposure.duration_s;
    let mut checked = None;
    if let Some(thickness_m) = needed.found_m() {
        let anew = redrawn(case, &plies, thickness_m / drawn_m);
        let (check, peak) = check(&anew, march, demand, sweep)?;
        still_warming = peak.time_s >= case.exposure.duration_s;
        marches += members + 1;
        checked = Some(check);
    }
    Ok(Sizing {
        within_m,
        drawn_m,
        nominal,
        needed,
        interval: (low.map(|rank| inorder[rank - 1]), high.map(|rank| inorder[rank - 1])),
        members,
        failures: found.failures,
        each_m: inorder.iter().map(|needed| needed.least_m()).collect(),
        shares,
        rungs,
        density_kg_m3: mass_kg_m2(case, &plies, drawn_m) / drawn_m,
        still_warming,
        check: checked,
        marches,
        demand: demand.clone(),
    })
}

impl Sizing {
    /// What uncertainty adds to the thickness that suffices nominally, m, where both were found.
    pub fn margin_m(&self) -> Option<f64> {
        Some(self.needed.found_m()? - self.nominal.found_m()?)
    }

    /// Mass of the plies that are sized on an area, so thick all together, kg/m².
    pub fn mass_kg_m2(&self, thickness_m: f64) -> f64 {
        self.density_kg_m3 * thickness_m
    }

    /// Members that hold the limit with a thickness.
    pub fn held(&self, thickness_m: f64) -> Proportion {
        Proportion { count: self.each_m.partition_point(|needed_m| *needed_m <= thickness_m), of: self.members }
    }

    /// The shares of the members of the check between which the share that holds lies in 95 of 100 sizings of the same
    /// number of members, where the model holds. Both scatter: the thickness, which is a quantile of as many draws as there
    /// were members, and the count of the check.
    pub fn expected_95(&self) -> Option<(Proportion, Proportion)> {
        let of = self.check.as_ref()?.held.of;
        let rank = rank(self.members, self.demand.probability);
        let (low, high) = counts_below_95(rank, self.members, of);
        Some((Proportion { count: low, of }, Proportion { count: high, of }))
    }

    /// Whether as many members of the check hold the limit as are to be [expected](Self::expected_95).
    pub fn is_borne_out(&self) -> Option<bool> {
        let (low, high) = self.expected_95()?;
        Some((low.count..=high.count).contains(&self.check.as_ref()?.held.count))
    }
}

/// From thinnest to thickest, evenly in the logarithm.
fn ladder((low_m, high_m): (f64, f64)) -> Vec<f64> {
    let at = |rung: usize| low_m * (high_m / low_m).powf(rung as f64 / (RUNGS - 1) as f64);
    (0..RUNGS).map(|rung| if rung + 1 == RUNGS { high_m } else { at(rung) }).collect()
}

fn is_cooled(case: &Case, demand: &Demand, curve: &[(f64, Peak)]) -> Result<(), SizeError> {
    let [(thin_m, thin), .., (thick_m, thick)] = curve else { return Ok(()) };
    let (thin_k, thick_k) = (thin.temperature_k, thick.temperature_k);
    if !thin_k.is_finite() || thick_k <= thin_k - FALL_K {
        return Ok(());
    }
    // To a tenth of a micrometre.
    let mm = |length_m: f64| (1e7 * length_m).round() / 1e4;
    Err(SizeError::NotCooled {
        sensor: case.sensors[demand.sensor].name.clone(),
        ply: demand.ply.clone(),
        thin_mm: mm(*thin_m),
        thin_k,
        thick_mm: mm(*thick_m),
        thick_k,
    })
}

/// The place, counted from one, of the least of so many in order that a share of them does not exceed.
fn rank(members: usize, share: f64) -> usize {
    // What rounding adds to a whole number of members makes no further one.
    ((share * members as f64 - 1e-9).ceil() as usize).max(1).min(members)
}

/// Squared correlations with what members need, over their sum, of those that need something between the bounds.
fn shares(factors: usize, needed: &[Needed], row: impl Fn(usize) -> Vec<f64>) -> Vec<f64> {
    let (rows, found_m): (Vec<Vec<f64>>, Vec<f64>) =
        needed.iter().enumerate().filter_map(|(member, needed)| Some((row(member), needed.found_m()?))).unzip();
    let about_mean = |values: Vec<f64>| -> Vec<f64> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|value| value - mean).collect()
    };
    let off_m = about_mean(found_m);
    let squared = |factor: usize| {
        let off = about_mean(rows.iter().map(|row| row[factor]).collect());
        let variance: f64 = off.iter().map(|off| off * off).sum();
        let covariance: f64 = off.iter().zip(&off_m).map(|(off, off_m)| off * off_m).sum();
        if variance > 0.0 { covariance * covariance / variance } else { 0.0 }
    };
    let squares: Vec<f64> = (0..factors).map(squared).collect();
    let total: f64 = squares.iter().sum();
    squares.iter().map(|square| if total > 0.0 { square / total } else { 0.0 }).collect()
}

/// Members of another seed, drawn independently, at the thickness found, by the path that `uncertainty` takes; and the nominal
/// peak.
fn check(anew: &Case, march: &mut dyn March, demand: &Demand, sweep: &Sweep) -> Result<(Check, Peak), MarchError> {
    let plan = pilot_monitored(anew, &march.monitor())?;
    let nominal = nominal(anew, &plan, march)?;
    let Sweep { members, sampling, .. } = *sweep;
    let kind = if sampling.kind == SamplingKind::Uniform { SamplingKind::Uniform } else { SamplingKind::Normal };
    let sampling = Sampling { kind, seed: sampling.seed.wrapping_add(1) };
    let mut count = 0;
    let outcome = uncertainty(anew, &plan, march, &nominal, &Sweep { sampling, ..*sweep }, &mut |_, traces| {
        count += (0..traces.members())
            .filter(|&member| traces.arrivals[member] == Arrival::Done)
            .filter(|&member| traces.trace(member, demand.sensor).iter().all(|&at_k| at_k < demand.limit_k))
            .count();
    })?;
    let [low_k, _, median_k, _, high_k] = outcome.peaks[demand.sensor].percentiles_k;
    let check = Check {
        seed: sampling.seed,
        held: Proportion { count, of: members },
        failed: members - outcome.ok,
        nominal_k: nominal.peaks[demand.sensor].temperature_k,
        percentiles_k: [low_k, median_k, high_k],
    };
    Ok((check, nominal.peaks[demand.sensor]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_of_members_is_the_least_that_the_share_does_not_exceed() {
        assert_eq!([(100, 0.99), (100, 0.991), (3, 0.5), (5, 1e-9)].map(|(n, p)| rank(n, p)), [99, 100, 2, 1]);
    }
}
