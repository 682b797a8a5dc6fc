//! Profiles through the thickness: temperature at chosen instants and its maximum over time, with bands over the
//! members of a sweep; density, degree of conversion and gas pressure at nominal factors.
//!
//! They are marched again on the CPU in double precision, with readings at the faces of the cells in place of the
//! sensors, so that they depend on no backend and cost the march of a sweep nothing.

use super::uncertainty::Sweep;
use crate::case::unit::{Dimension, parse_quantity};
use crate::case::{Case, GasFlowModel};
use crate::ensemble::Ensemble;
use crate::limits::PROFILE_INSTANTS;
use crate::march::cpu::{Cpu, cell_states};
use crate::march::monitor::{Monitor, MonitoredMarch};
use crate::march::richardson::RichardsonMarch;
use crate::march::{March, MarchError, Precision, march_members};
use crate::plan::Plan;
pub use crate::plan::ProfileDepth;
use crate::traces::{MemberStatus, Traces};
use std::fmt;
use std::str::FromStr;

/// The instants of the profiles.
#[derive(Clone, Debug, PartialEq)]
pub enum ProfileInstants {
    /// This many, evenly spaced from the start to the end of the exposure.
    Even(usize),
    /// The output instants that are nearest to these times, s.
    Times(Vec<f64>),
}

/// Profiles through the thickness.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct DepthProfiles {
    /// The instants, ascending, s.
    pub instants_s: Vec<f64>,
    /// The depths, from the hot face to the back face; an interface is there twice, for its two sides.
    pub depths: Vec<ProfileDepth>,
    /// Temperature at nominal factors: instant × depth, K.
    pub nominal_k: Vec<Vec<f64>>,
    /// Highest temperature over the whole exposure at nominal factors, one per depth, K.
    pub nominal_maximum_k: Vec<f64>,
    /// Percentiles over members of the sweep; `None` without a sweep.
    pub bands: Option<ProfileBands>,
    /// Density, conversion and pressure; `None` where nothing decomposes and no gas flows.
    pub cell_states: Option<CellStates>,
}

/// Percentiles 5, 50 and 95 over members, at each depth separately.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct ProfileBands {
    /// Members counted: those of the first [`MAX_MEMBERS`] of the sweep that completed.
    pub members: usize,
    /// Percentiles of the temperature: percentile × instant × depth, K.
    pub percentiles_k: [Vec<Vec<f64>>; 3],
    /// Percentiles of the highest temperature over time: percentile × depth, K.
    pub maximum_percentiles_k: [Vec<f64>; 3],
}

/// State of the cells at nominal factors. It is that of the finer resolution, without extrapolation.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct CellStates {
    /// Depths of the nodes of the cells.
    pub depths: Vec<ProfileDepth>,
    /// Density of the solid per volume of the virgin layup: instant × cell, kg/m³.
    pub densities_kg_m3: Vec<Vec<f64>>,
    /// Degree of conversion, the fraction of the decomposable mass that is lost: instant × cell.
    pub conversions: Vec<Vec<f64>>,
    /// Gas pressure: instant × cell, Pa; `None` without Darcy flow.
    pub pressures_pa: Option<Vec<Vec<f64>>>,
}

/// Members that are marched for the bands at most: the percentile 5 of 1,000 members lies between the true percentiles
/// 3.7 and 6.4, with a probability of 95 %.
pub const MAX_MEMBERS: usize = 1000;
/// Percentiles of the bands.
pub const BAND_PERCENTS: [f64; 3] = [5.0, 50.0, 95.0];

impl fmt::Display for ProfileInstants {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Even(count) => write!(formatter, "{count}"),
            Self::Times(times_s) => {
                let times: Vec<String> = times_s.iter().map(|time_s| format!("{time_s} s")).collect();
                write!(formatter, "{}", times.join(","))
            }
        }
    }
}

/// A number, or times with their units: `10s,40s`.
impl FromStr for ProfileInstants {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim().parse::<usize>() {
            Ok(count) => Ok(Self::Even(count)),
            Err(_) => {
                let time = |text| parse_quantity(text, Dimension::Time);
                text.split(',').map(time).collect::<Result<_, _>>().map(Self::Times)
            }
        }
    }
}

impl ProfileInstants {
    /// Check the instants for a case.
    ///
    /// # Errors
    /// A message, if there are none or too many, or one is outside the exposure.
    pub fn check(&self, case: &Case) -> Result<(), String> {
        let duration_s = case.exposure.duration_s;
        match self {
            Self::Even(0) => Err("expected at least 1 instant".to_owned()),
            Self::Even(count) => PROFILE_INSTANTS.check(*count as f64),
            Self::Times(times_s) if times_s.is_empty() => Err("expected at least 1 instant".to_owned()),
            Self::Times(times_s) => match times_s.iter().find(|time_s| !(0.0..=duration_s).contains(*time_s)) {
                Some(time_s) => Err(format!("expected times from 0 s to {duration_s} s, found {time_s} s")),
                None => PROFILE_INSTANTS.check(times_s.len() as f64),
            },
        }
    }

    /// Indices of the nearest output instants, ascending.
    fn indices(&self, instants_s: &[f64]) -> Vec<usize> {
        let end_s = instants_s.last().copied().unwrap_or_default();
        let times_s = match self {
            Self::Even(count) => (0..*count).map(|n| end_s * n as f64 / (count - 1).max(1) as f64).collect(),
            Self::Times(times_s) => times_s.clone(),
        };
        let nearest = |time_s: &f64| {
            let distance_s = |at: &usize| (instants_s[*at] - time_s).abs();
            (0..instants_s.len()).min_by(|one, other| distance_s(one).total_cmp(&distance_s(other)))
        };
        let mut indices: Vec<usize> = times_s.iter().filter_map(nearest).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }
}

/// The profiles of a case, with bands over the first members of a sweep if there is one. `None` if the nominal march
/// does not complete.
///
/// # Errors
/// When the march is cancelled or stopped.
pub fn depth_profiles(
    case: &Case,
    plan: &Plan,
    instants: &ProfileInstants,
    sweep: Option<&Sweep>,
    monitor: &Monitor,
) -> Result<Option<DepthProfiles>, MarchError> {
    let (profile_plan, depths) = plan.clone().without_gauges().with_depth_readings(case);
    let chosen = instants.indices(plan.instants_s());
    let march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let mut march = MonitoredMarch::new(Box::new(march), monitor.clone());
    let nominal = Ensemble::nominal(&case.factors);
    let traces = march.march(&profile_plan, &nominal, 0..1)?;
    if traces.statuses != [MemberStatus::Completed] {
        return Ok(None);
    }
    let (nominal_k, nominal_maximum_k) = profiles_of(&traces, 0, &chosen);
    let bands = match sweep {
        None => None,
        Some(sweep) => bands(case, &profile_plan, &mut march, sweep, &chosen)?,
    };
    let cell_states = case.gas.as_ref().map(|_| CellStates::of(case, plan, &nominal, &chosen));
    let instants_s = chosen.iter().map(|&instant| plan.instants_s()[instant]).collect();
    Ok(Some(DepthProfiles { instants_s, depths, nominal_k, nominal_maximum_k, bands, cell_states }))
}

/// Instant × depth, and the peak at each depth.
fn profiles_of(traces: &Traces, member: usize, chosen: &[usize]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let depths = 0..traces.sensors;
    let at = |&instant: &usize| depths.clone().map(|depth| traces.trace(member, depth)[instant]).collect();
    let highest = traces.member_peaks(member).iter().map(|peak| peak.temperature_k);
    (chosen.iter().map(at).collect(), highest.collect())
}

/// Bands over the first members of a sweep; `None` if fewer than two complete.
fn bands(
    case: &Case,
    plan: &Plan,
    march: &mut MonitoredMarch,
    sweep: &Sweep,
    chosen: &[usize],
) -> Result<Option<ProfileBands>, MarchError> {
    let members = sweep.members.min(MAX_MEMBERS);
    march.begin_sweep(members);
    // Profile × depth × member; the last profile is the maximum.
    let mut values: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); plan.sensors()]; chosen.len() + 1];
    march_members(march, plan, &sweep.ensemble(case), 0..members, &mut |traces| {
        for member in (0..traces.members()).filter(|&member| traces.statuses[member] == MemberStatus::Completed) {
            let (at_instants, highest) = profiles_of(&traces, member, chosen);
            for (profile, values) in at_instants.iter().chain([&highest]).zip(&mut values) {
                profile.iter().zip(values).for_each(|(&value, values)| values.push(value));
            }
        }
    })?;
    let completed = values[0].first().map_or(0, Vec::len);
    if completed < 2 {
        return Ok(None);
    }
    values.iter_mut().flatten().for_each(|values| values.sort_by(f64::total_cmp));
    let of_profile =
        |profile: &Vec<Vec<f64>>, percent| profile.iter().map(|sorted| percentile(sorted, percent)).collect();
    let (maximum, at_instants) = (&values[chosen.len()], &values[..chosen.len()]);
    Ok(Some(ProfileBands {
        members: completed,
        percentiles_k: BAND_PERCENTS
            .map(|percent| at_instants.iter().map(|profile| of_profile(profile, percent)).collect()),
        maximum_percentiles_k: BAND_PERCENTS.map(|percent| of_profile(maximum, percent)),
    }))
}

/// Percentile of sorted values, with linear interpolation.
fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let place = percent / 100.0 * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

impl CellStates {
    fn of(case: &Case, plan: &Plan, nominal: &Ensemble, chosen: &[usize]) -> Self {
        let [densities, conversions, pressures] = cell_states(plan, nominal, 0);
        let at = |of_cells: &[Vec<f64>]| -> Vec<Vec<f64>> {
            chosen.iter().map(|&instant| of_cells.iter().map(|trace| trace[instant]).collect()).collect()
        };
        let has_pressure = case.gas.as_ref().is_some_and(|gas| gas.model == GasFlowModel::Darcy);
        Self {
            depths: plan.node_depths(case),
            densities_kg_m3: at(&densities),
            conversions: at(&conversions),
            pressures_pa: has_pressure.then(|| at(&pressures)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Bounds;
    use crate::ensemble::{Sampling, SamplingKind};
    use crate::study::nominal::nominal;

    fn shipped(id: &str) -> Case {
        Case::load(format!("{}/cases/{id}", env!("CARGO_MANIFEST_DIR")).as_ref()).expect("a shipped case loads")
    }

    #[test]
    fn instants_are_the_nearest_ones_and_wrong_ones_are_refused() {
        let instants_s = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(ProfileInstants::Times(vec![2.9, 0.2, 3.1]).indices(&instants_s), [0, 3]);
        assert_eq!(ProfileInstants::Even(3).indices(&instants_s), [0, 2, 4]);
        assert_eq!(ProfileInstants::Even(1).indices(&instants_s), [0]);
        let case = shipped("lcat-2259");
        let message = |instants: ProfileInstants| instants.check(&case).expect_err("wrong instants");
        assert!(message(ProfileInstants::Even(0)).contains("at least 1"));
        assert!(message(ProfileInstants::Times(vec![1e6])).contains("found 1000000 s"));
        assert!(message(ProfileInstants::Even(100_000)).contains("profiles"));
    }

    #[test]
    fn percentiles_are_those_of_a_uniform_sequence() {
        let sorted: Vec<f64> = (0..=200).map(f64::from).collect();
        assert_eq!(BAND_PERCENTS.map(|percent| percentile(&sorted, percent)), [10.0, 100.0, 190.0]);
    }

    /// The bands are those of an ordinary march of the same members, at a sensor.
    #[test]
    fn bands_at_the_depth_of_a_sensor_are_those_of_its_traces() {
        let case = shipped("lamp-test");
        let plan = Plan::new(&case);
        let sampling = Sampling { kind: SamplingKind::Normal, seed: 1 };
        let sweep = Sweep { members: 40, sampling, bounds: Bounds::Small };
        let monitor = Monitor::default();
        let found =
            depth_profiles(&case, &plan, &ProfileInstants::Even(3), Some(&sweep), &monitor).expect("it marches");
        let found = found.expect("the nominal march completes");
        let bands = found.bands.expect("bands");
        assert_eq!((found.instants_s.len(), bands.members), (3, 40));
        let of_sensor = |sensor: usize| {
            let is_here = |depth: &ProfileDepth| (depth.depth_m - case.sensors[sensor].depth_m).abs() < 1e-9;
            let mut here = (0..found.depths.len()).filter(|&depth| is_here(&found.depths[depth]));
            here.next().filter(|_| here.next().is_none()).map(|depth| (sensor, depth))
        };
        let inside = (0..case.sensors.len()).rev().find_map(of_sensor);
        let (sensor, depth) = inside.expect("a sensor that is not at an interface");
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let mut peaks = Vec::new();
        march_members(&mut march, &plan.clone().without_gauges(), &sweep.ensemble(&case), 0..40, &mut |traces| {
            peaks.extend((0..traces.members()).map(|member| traces.peak(member, sensor).temperature_k));
        })
        .expect("it marches");
        peaks.sort_by(f64::total_cmp);
        for (band, percent) in bands.maximum_percentiles_k.iter().zip(BAND_PERCENTS) {
            assert!((band[depth] - percentile(&peaks, percent)).abs() < 1e-6);
        }
        let prediction = nominal(&case, &plan, &mut march).expect("it marches");
        assert!((found.nominal_maximum_k[depth] - prediction.peaks[sensor].temperature_k).abs() < 1e-6);
        let expected = prediction.temperature_at(sensor, found.instants_s[1]);
        assert!((found.nominal_k[1][depth] - expected).abs() < 1e-6 && expected > 310.0, "{expected} K");
        assert!(found.cell_states.is_none());
    }

    /// The mass lost is the integral of the virgin density less the density; fronts are where conversion passes 2 %.
    #[test]
    fn densities_integrate_to_the_mass_lost_and_conversions_place_the_front() {
        let case = shipped("lcat-2259-pyrolysis");
        let plan = Plan::new(&case);
        let monitor = Monitor::default();
        let found = depth_profiles(&case, &plan, &ProfileInstants::Times(vec![0.0, 60.0]), None, &monitor);
        let states = found.expect("it marches").expect("the nominal march completes").cell_states.expect("states");
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let prediction = nominal(&case, &plan, &mut march).expect("it marches");
        let gauge = |gauge| prediction.gauge_trace(gauge).expect("a gauge");
        let at_60_s = prediction.instants_s.iter().position(|&at_s| at_s == 60.0).expect("an instant");
        let expected = gauge(crate::traces::Gauge::MassLost).values[at_60_s];
        let lost: f64 = (states.densities_kg_m3[0].iter().zip(&states.densities_kg_m3[1]))
            .zip(plan.rows.data.cells.iter().map(|cell| cell.width_m))
            .map(|((virgin, now), width_m)| (virgin - now) * width_m)
            .sum();
        assert!((lost - expected).abs() < 0.01 * expected, "{lost} kg/m², not {expected}");
        assert!(states.conversions[0].iter().all(|&conversion| conversion.abs() < 1e-12));
        assert!(states.conversions[1].iter().any(|&conversion| conversion > 0.5));
        let front_m = gauge(crate::traces::Gauge::VirginFront).values[at_60_s];
        let deepest = states.depths.iter().zip(&states.conversions[1]).rfind(|(_, conversion)| **conversion > 0.02);
        let deepest_m = deepest.expect("a converted cell").0.depth_m;
        assert!((deepest_m - front_m).abs() < 0.5e-3, "{deepest_m} m, front {front_m} m");
        assert!(states.pressures_pa.is_none(), "quasi-steady flow has no pressure");
    }

    #[test]
    fn the_highest_pressure_of_a_profile_is_that_of_the_gauge() {
        let case = shipped("permeation");
        let plan = Plan::new(&case);
        let instants = ProfileInstants::Even(5);
        let found = depth_profiles(&case, &plan, &instants, None, &Monitor::default()).expect("it marches");
        let found = found.expect("the nominal march completes");
        let (instants_s, states) = (found.instants_s, found.cell_states.expect("states"));
        let pressures = states.pressures_pa.expect("Darcy flow has pressures");
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let prediction = nominal(&case, &plan, &mut march).expect("it marches");
        let gauge = prediction.gauge_trace(crate::traces::Gauge::PeakPressure).expect("a gauge");
        for (instant_s, pressures) in instants_s.iter().zip(&pressures) {
            let highest = pressures.iter().copied().fold(0.0, f64::max);
            let at = prediction.instants_s.iter().position(|at_s| at_s == instant_s).expect("an instant");
            let expected = gauge.values[at];
            assert!((highest - expected).abs() < 0.01 * expected, "{highest} Pa, not {expected} Pa");
        }
    }
}
