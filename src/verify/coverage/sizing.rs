//! Coverage of the thickness that a share of members requires, of the independent check of a sizing, and of masses and
//! ranks of layups, for a slab whose back-face temperature is known in closed form.

use super::{Counted, covered_row};
use crate::case::{Bounds, Case, Factor, LimitedPart, Property, Sensor, Table};
use crate::ensemble::{Ensemble, Sampling, SamplingKind};
use crate::fit::proportion::Proportion;
use crate::kept_work::work_log::NoLog;
use crate::march::cpu::Cpu;
use crate::march::richardson::RichardsonMarch;
use crate::march::{MarchError, Precision};
use crate::study::margins::quantile_rank;
use crate::study::size::{RequiredThickness, SizeError, SizingRequirement, size};
use crate::study::trade::{CandidateLayup, TradeRequest, trade};
use crate::study::uncertainty::Sweep;
use crate::verify::problem::{Problem, ProblemSetup, heated_face, insulated_face, material};
use crate::verify::{Group, VerificationRow};
use rayon::prelude::*;
use std::f64::consts::PI;

const SIZINGS: usize = 100;
const TRADES: usize = 40;
/// Members of a sizing. Order statistics have their coverage at any number.
const MEMBERS: usize = 200;
const SIZINGS_ALLOWED: (f64, &str) = (6.5, "three standard errors of 100 sizings");
/// The members of both layups are the same.
const TRADES_ALLOWED: (f64, &str) = (10.3, "three standard errors of 40 trades, whose layups are missed together");
const PROBABILITY: f64 = 0.9;
const LIMIT_K: f64 = 600.0;
const START_K: f64 = 300.0;
const FLUX_W_M2: f64 = 2000.0;
const DURATION_S: f64 = 400.0;
/// Draws of the true distribution, of another seed than any sizing.
const DRAWS: usize = 200_000;
const DRAWS_SEED: u64 = 1 << 40;

/// A material of constant properties.
#[derive(Clone, Copy, Debug)]
struct Slab {
    density_kg_m3: f64,
    capacity_j_m3_k: f64,
    conductivity_w_m_k: f64,
}

const SLAB: Slab = Slab { density_kg_m3: 200.0, capacity_j_m3_k: 2e5, conductivity_w_m_k: 0.05 };
/// Of another conductivity and heat capacity, and about the same mass.
const OTHER: Slab = Slab { density_kg_m3: 246.5, capacity_j_m3_k: 2.4e5, conductivity_w_m_k: 0.035 };

impl Slab {
    /// Back-face temperature under a constant flux with an insulated back, with the first term of the series (Carslaw
    /// and Jaeger, *Conduction of Heat in Solids*, 1959, section 3.8).
    fn back_k(self, thickness_m: f64, [f_k, f_cp]: [f64; 2]) -> f64 {
        let (k, capacity) = (self.conductivity_w_m_k * f_k, self.capacity_j_m3_k * f_cp);
        let fourier = k / capacity * DURATION_S / thickness_m.powi(2);
        let decay = 2.0 / PI.powi(2) * (-PI.powi(2) * fourier).exp();
        let stored_k = FLUX_W_M2 * DURATION_S / (capacity * thickness_m);
        START_K + stored_k - FLUX_W_M2 * thickness_m / k * (1.0 / 6.0 - decay)
    }

    /// Thickness at which that temperature equals the limit, m.
    fn required_m(self, factors: [f64; 2]) -> f64 {
        let (mut low_m, mut high_m) = (4e-3, 20e-3);
        for _ in 0..50 {
            let middle_m: f64 = (low_m + high_m) / 2.0;
            if self.back_k(middle_m, factors) > LIMIT_K { low_m = middle_m } else { high_m = middle_m }
        }
        low_m
    }

    fn case(self) -> Case {
        let capacity_j_kg_k = Table::constant(self.capacity_j_m3_k / self.density_kg_m3);
        let of = material(self.density_kg_m3, capacity_j_kg_k, Table::constant(self.conductivity_w_m_k));
        let setting = ProblemSetup {
            plies: vec![(of, 0.01)],
            start_k: START_K,
            hot_face: heated_face(FLUX_W_M2),
            back_face: insulated_face(),
            cells: 24,
            first_step_s: 0.1,
            step_growth: 0.1,
        };
        let mut case = Problem::new(Group::Coverage, "slab to be sized", setting, Vec::new()).case;
        let sensor = case.sensors[0].clone();
        case.sensors = vec![Sensor { depth_m: 0.01, ..sensor }];
        case.observations = Vec::new();
        case.exposure.duration_s = DURATION_S;
        case.resolution.max_step_s = DURATION_S;
        case.resolution.output_interval_s = DURATION_S;
        case.layup.plies[0].group = "slab".to_owned();
        let factor = |(name, property): (&str, Property)| Factor {
            name: name.to_owned(),
            group: "slab".to_owned(),
            property,
            state: None,
            nominal: 1.0,
            small: (0.8, 1.2),
            large: (0.5, 2.0),
        };
        case.factors = [("k", Property::Conductivity), ("cp", Property::HeatCapacity)].map(factor).to_vec();
        case
    }

    /// The thickness that the share of all members requires, m.
    fn true_m(self) -> f64 {
        let draws = Ensemble::sample(&self.case().factors, Bounds::Small, &sweep(DRAWS, DRAWS_SEED).sampling, DRAWS);
        let required = (0..DRAWS).into_par_iter().map(|member| {
            let row = draws.member(member);
            self.required_m([row[0], row[1]])
        });
        let mut required_m: Vec<f64> = required.collect();
        required_m.sort_by(f64::total_cmp);
        required_m[quantile_rank(DRAWS, PROBABILITY) - 1]
    }
}

fn sweep(members: usize, seed: u64) -> Sweep {
    Sweep { members, sampling: Sampling { kind: SamplingKind::Normal, seed }, bounds: Bounds::Small }
}

fn march() -> RichardsonMarch {
    RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)))
}

fn requirement(case: &Case) -> SizingRequirement {
    SizingRequirement {
        ply: case.layup.plies[0].name.clone(),
        part: LimitedPart::Sensor(0),
        limit_k: LIMIT_K,
        probability: PROBABILITY,
        thickness_range_m: None,
    }
}

/// Whether an interval of required thicknesses contains a thickness.
fn contains((low, high): (Option<RequiredThickness>, Option<RequiredThickness>), true_m: f64) -> bool {
    let at_m = |end: Option<RequiredThickness>, or_m: f64| end.map_or(or_m, |end| end.sort_key_m());
    (at_m(low, 0.0)..=at_m(high, f64::INFINITY)).contains(&true_m)
}

/// Whether the interval of the thickness contains the true one, and whether the check confirms it.
fn sizing(case: &Case, true_m: f64, seed: u64) -> Result<[bool; 2], MarchError> {
    match size(case, &mut march(), &requirement(case), &sweep(MEMBERS, seed), &mut NoLog) {
        Err(SizeError::March(error)) => Err(error),
        Err(_) => Ok([false; 2]),
        Ok(found) => Ok([contains(found.interval, true_m), found.is_confirmed() == Some(true)]),
    }
}

/// Whether the intervals of masses and ranks of two layups contain the true ones.
fn traded(slabs: [(Slab, f64); 2], seed: u64) -> Result<[[bool; 2]; 2], MarchError> {
    let layup = |(place, (slab, _)): (usize, &(Slab, f64))| CandidateLayup {
        candidates: vec![place],
        cases: vec![slab.case()],
    };
    let candidates: Vec<CandidateLayup> = slabs.iter().enumerate().map(layup).collect();
    let choices = vec![("slab".to_owned(), vec!["one".to_owned(), "other".to_owned()])];
    let request = TradeRequest { choices, requirement: requirement(&candidates[0].cases[0]) };
    let found = match trade(&candidates, &mut march(), &request, &sweep(MEMBERS, seed), &mut NoLog) {
        Err(SizeError::March(error)) => return Err(error),
        Err(_) => return Ok([[false; 2]; 2]),
        Ok(found) => found,
    };
    let mass_kg_m2 = |(slab, true_m): (Slab, f64)| slab.density_kg_m3 * true_m;
    let held = |place: usize| {
        let Some(layup) = found.layups.iter().find(|layup| layup.candidates == [place]) else { return [false; 2] };
        let rank = 1 + usize::from(mass_kg_m2(slabs[place]) > mass_kg_m2(slabs[1 - place]));
        let ranks = layup.rank.and_then(|rank| rank.resampled);
        let has_rank = ranks.is_some_and(|ranks| (ranks.interval.0..=ranks.interval.1).contains(&rank));
        [contains(layup.interval, slabs[place].1), has_rank]
    };
    Ok([0, 1].map(held))
}

/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn rows() -> Result<Vec<VerificationRow>, MarchError> {
    let (case, true_m, other_m) = (SLAB.case(), SLAB.true_m(), OTHER.true_m());
    let sized = (1..=SIZINGS as u64).into_par_iter().map(|seed| sizing(&case, true_m, seed));
    let sized = sized.collect::<Result<Vec<[bool; 2]>, MarchError>>()?;
    let pair = [(SLAB, true_m), (OTHER, other_m)];
    let trades = (1..=TRADES as u64).into_par_iter().map(|seed| traded(pair, seed));
    let trades: Vec<[bool; 2]> = trades.collect::<Result<Vec<_>, MarchError>>()?.concat();
    let counted = |held: &[[bool; 2]], which: usize| {
        Counted::intervals(Proportion { count: held.iter().filter(|held| held[which]).count(), total: held.len() })
    };
    let row =
        |name: &str, quantity: &str, counted: Counted, allowed| covered_row(name, MEMBERS, quantity, &counted, allowed);
    Ok(vec![
        row("size", "thickness for 90 % of the members", counted(&sized, 0), SIZINGS_ALLOWED),
        row("size, check", "members below the limit", counted(&sized, 1), SIZINGS_ALLOWED),
        row("trade", "masses of two layups", counted(&trades, 0), TRADES_ALLOWED),
        row("trade, rank", "two layups of nearly the same mass", counted(&trades, 1), TRADES_ALLOWED),
    ])
}
