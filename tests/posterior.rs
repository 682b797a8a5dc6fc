//! Posteriors of whole cases against linear intervals and profiles, and predictive bands against data not fitted.

use crate::support::{POSTERIOR_ENDS, ROUNDING_K, case, modified};
use bondline::case::{Case, Face, Observation, Schedule};
use bondline::ensemble::Ensemble;
use bondline::march::{Backend, March, MarchError, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::study::estimate::{ParameterEstimates, SearchOptions, estimate};
use bondline::study::posterior::{Posterior, PosteriorError, PredictiveBand, Walkers, posterior};
use bondline::study::twin::{Noise, twin};
use bondline::traces::Traces;
use bondline::work_log::NoLog;
use std::ops::Range;

const WALKERS: Walkers = Walkers { number: 100, iterations: 400, seed: 1 };

/// A shipped case with few cells and time steps as long as the output interval.
fn coarse(id: &str) -> Case {
    modified(&case(id), |case| {
        case.resolution.cells = 40;
        case.resolution.first_step_s = 0.5;
        case.resolution.max_step_s = 2.0;
    })
}

/// The case with synthetic data of one sensor, from true factors and noise of 2 K, and that sensor fitted.
fn observed(case: Case, sensor: &str, truth: &[(usize, f64)]) -> Case {
    let sensor = case.sensors().iter().position(|known| known.name == sensor).expect("the sensor");
    let mut values: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    truth.iter().for_each(|&(place, value)| values[place] = value);
    let plan = Plan::new(&case);
    let noise = Noise { correlation_s: 0.0, seed: 7 };
    let made = twin(&case, &plan, &mut Cpu::new(Precision::F64), values, 2.0, &noise).expect("synthetic data");
    let (times_s, temperatures_k) = (made.instants_s, made.measured_k[sensor].clone());
    let sigma_k = vec![2.0; times_s.len()];
    modified(&case, |case| {
        case.observations = vec![Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None }];
        case.estimate.sensors = vec![sensor];
    })
}

/// The estimate, with these profiles.
fn estimated(case: &Case, profiles: &[&str]) -> ParameterEstimates {
    let profiles = profiles.iter().map(|&name| name.to_owned()).collect();
    let search = SearchOptions { profiles, ..SearchOptions::for_precision(Precision::F64) };
    estimate(&[(case, &Plan::new(case))], &mut Cpu::new(Precision::F64), &search, &mut NoLog).expect("an estimate")
}

/// The estimate, with these profiles, and the posterior.
fn drawn(case: &Case, profiles: &[&str]) -> (ParameterEstimates, Posterior) {
    let (plan, mut march) = (Plan::new(case), Cpu::new(Precision::F64));
    let found = estimated(case, profiles);
    let drawn = posterior(&[(case, &plan)], &mut march, &found, &WALKERS, &mut NoLog).expect("a posterior");
    (found, drawn)
}

/// Largest distance between the ends of two intervals, in widths of the second.
fn apart((low, high): (f64, f64), other: (f64, f64)) -> f64 {
    ((low - other.0).abs()).max((high - other.1).abs()) / (other.1 - other.0)
}

#[test]
fn for_a_nearly_linear_problem_the_posterior_has_the_linear_intervals() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[(0, 0.95), (1, 1.01)]);
    let (found, drawn) = drawn(&case, &[]);
    assert!(found.converged && drawn.has_converged(), "{:?}", drawn.marginals);
    for (place, marginal) in drawn.marginals.iter().enumerate() {
        let off = apart(marginal.interval, found.intervals[place]);
        assert!(off < POSTERIOR_ENDS, "{place}: {:?} for {:?}", marginal.interval, found.intervals[place]);
    }
    let (low, high) = drawn.marginals[0].interval;
    let moved = apart((low + 0.3 * (high - low), high + 0.3 * (high - low)), found.intervals[0]);
    assert!(moved > POSTERIOR_ENDS, "a shift by 30 % of the width would pass");
    let Some(pair) = drawn.pairs.first() else { panic!("no pair") };
    assert!((pair.correlation - found.identifiability.correlation[0][1]).abs() < 0.01, "{}", pair.correlation);
    assert!(drawn.objective_decrease < 0.5 && drawn.predicted[0].failed == 0);
    // The noise equals its stated deviation, so there is no discrepancy, and the held TC3 is certain.
    assert!(drawn.discrepancy.amplitude_k < 1.0, "{:?}", drawn.discrepancy);
    let held = &drawn.predicted[0].sensors[0].discrepancy;
    assert!(held.low_k.iter().zip(&held.high_k).all(|(low, high)| high - low < 1e-6));
}

/// The true heat capacity is on its bound. A linear interval is symmetric whatever the bounds; the profile has no end
/// there, and the draws stay between the bounds.
#[test]
fn the_posterior_ends_at_a_bound_and_the_linear_interval_does_not() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[(0, 0.95), (1, 1.1)]);
    let (found, drawn) = drawn(&case, &["f_cp_INS"]);
    let ((low, high), bound) = (drawn.marginals[1].interval, found.factors[1].bounds.1);
    let linear = found.intervals[1];
    assert!(linear.1 > bound && high <= bound && low < found.values[1], "{low} to {high}, linear {linear:?}");
    assert_eq!(found.profiles[0].interval.1, None);
    assert!(apart((low, high), linear) > POSTERIOR_ENDS, "{low} to {high}, linear {linear:?}");
}

/// The board is measured at 11.44 mm and not at 17.16 mm, and the heat transfer behind it is unknown: with two and four
/// times the assumed film coefficient, other factors fit the data equally well. Each is a possible board.
#[test]
fn the_band_of_an_unobserved_thermocouple_contains_equally_good_models() {
    let case = modified(&coarse("kaowool-tc"), |case| {
        case.resolution.cells = 20;
        case.resolution.max_step_s = 10.0;
    });
    let (found, drawn) = drawn(&case, &[]);
    let off_k = |found: &ParameterEstimates| found.fitted[0].misfits[0].1.rms_k;
    let unobserved = &drawn.predicted[0].sensors[1];
    let held = |low_k: &[f64], high_k: &[f64], trace_k: &[f64]| {
        let within = low_k.iter().zip(high_k).zip(trace_k).filter(|((low, high), at)| (*low..=*high).contains(at));
        within.count() as f64 / trace_k.len() as f64
    };
    assert!(unobserved.coverage.is_none() && drawn.discrepancy.amplitude_k > 1.0, "{:?}", drawn.discrepancy);
    let mut plain = 1.0_f64;
    for film_w_m2_k in [20.0, 40.0] {
        let other = modified(&case, |case| {
            let Face::Open(open) = &mut case.exposure.back_face else { panic!("an open face") };
            open.film_w_m2_k = Schedule::constant(film_w_m2_k);
        });
        let other = estimated(&other, &[]);
        assert!(off_k(&other) < 1.05 * off_k(&found), "{film_w_m2_k}: {} for {}", off_k(&other), off_k(&found));
        let trace_k = &other.fitted[0].after.temperatures_k[1];
        let [by_factors, with_all] =
            [&unobserved.parameters, &unobserved.discrepancy].map(|band| held(&band.low_k, &band.high_k, trace_k));
        assert!(with_all > 0.95, "{film_w_m2_k}: the band contains {with_all}");
        plain = plain.min(by_factors);
    }
    assert!(plain < 0.95, "the band of the factors alone already contains {plain}");
    // Heat does not flow from cold to hot: no temperature falls below the start at 290 K.
    let coldest_k = unobserved.discrepancy.low_k.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((coldest_k - 290.0).abs() < ROUNDING_K, "{coldest_k} K");
}

/// A CPU march that counts members; with tangents, a point counts once.
struct Counting {
    march: Cpu,
    has_tangents: bool,
    members: usize,
}

impl March for Counting {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.members += members.len();
        self.march.march(plan, ensemble, members)
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, of: &[usize]) -> Result<Option<Traces>, MarchError> {
        self.members += if self.has_tangents { points.len() } else { 0 };
        if self.has_tangents { self.march.tangents(plan, points, of) } else { Ok(None) }
    }
}

#[test]
fn a_posterior_reports_the_members_marched_with_tangents_and_with_differences() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[]);
    let (found, plan) = (estimated(&case, &[]), Plan::new(&case));
    let walkers = Walkers { number: 24, iterations: 20, seed: 1 };
    let counts = [true, false].map(|has_tangents| {
        let mut march = Counting { march: Cpu::new(Precision::F64), has_tangents, members: 0 };
        let drawn = posterior(&[(&case, &plan)], &mut march, &found, &walkers, &mut NoLog).expect("a posterior");
        assert_eq!(drawn.marches, march.members, "tangents: {has_tangents}");
        drawn.marches
    });
    assert_eq!(counts[1] - counts[0], 2 * case.factors().len(), "central differences take two more members per factor");
}

/// Two depths of a real board were measured. With the upper alone fitted, the lower tests the predictive band.
#[test]
fn the_band_of_a_real_board_contains_the_thermocouple_that_was_not_fitted() {
    let case = modified(&coarse("kaowool"), |case| {
        case.resolution.max_step_s = 5.0;
        case.estimate.sensors = vec![0];
    });
    let unobserved = &drawn(&case, &[]).1.predicted[0].sensors[1];
    let (_, held) = unobserved.coverage.expect("TC2 is observed");
    let widest_k =
        |band: &PredictiveBand| band.low_k.iter().zip(&band.high_k).map(|(low, high)| high - low).fold(0.0, f64::max);
    let [by_factors_k, with_all_k] = [&unobserved.parameters, &unobserved.discrepancy].map(widest_k);
    assert!(held > 0.95, "the band contains {held}");
    assert!(with_all_k > 1.5 * by_factors_k && with_all_k < 200.0, "{by_factors_k} K and {with_all_k} K wide");
}

#[test]
fn too_few_walkers_to_span_the_factors_are_an_error() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[]);
    let (plan, mut march) = (Plan::new(&case), Cpu::new(Precision::F64));
    let found = estimated(&case, &[]);
    let few = Walkers { number: 4, ..WALKERS };
    let refused = posterior(&[(&case, &plan)], &mut march, &found, &few, &mut NoLog).expect_err("too few");
    assert!(matches!(refused, PosteriorError::TooFewWalkers { least: 24, .. }), "{refused}");
}
