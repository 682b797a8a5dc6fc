//! Posteriors of whole cases: against linear intervals and profiles, and bands against what was not fitted.

use crate::support::{POSTERIOR_ENDS, ROUNDING_K, case, changed};
use bondline::case::{Case, Face, Observation};
use bondline::ensemble::Ensemble;
use bondline::march::{Backend, March, MarchError, Precision, cpu::Cpu};
use bondline::plan::Plan;
use bondline::study::estimate::{Estimated, Search, estimate};
use bondline::study::posterior::{Band, Posterior, PosteriorError, Walkers, posterior};
use bondline::study::twin::{Noise, twin};
use bondline::traces::Traces;
use std::ops::Range;

const WALKERS: Walkers = Walkers { number: 100, moves: 400, seed: 1 };

/// A shipped case on few cells and steps as long as its instants are apart.
fn coarse(id: &str) -> Case {
    changed(&case(id), |case| {
        case.resolution.cells = 40;
        case.resolution.first_step_s = 0.5;
        case.resolution.largest_step_s = 2.0;
    })
}

/// The case with one sensor observed as its twin of a truth and of noise of 2 K is, and that sensor fitted.
fn observed(case: Case, sensor: &str, truth: &[(usize, f64)]) -> Case {
    let sensor = case.sensors().iter().position(|known| known.name == sensor).expect("the sensor");
    let mut values: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    truth.iter().for_each(|&(place, value)| values[place] = value);
    let plan = Plan::new(&case);
    let noise = Noise { correlation_s: 0.0, seed: 7 };
    let made = twin(&case, &plan, &mut Cpu::new(Precision::F64), values, 2.0, &noise).expect("a twin");
    let (times_s, temperatures_k) = (made.instants_s, made.measured_k[sensor].clone());
    let sigma_k = vec![2.0; times_s.len()];
    changed(&case, |case| {
        case.observations = vec![Observation { sensor, times_s, temperatures_k, sigma_k, window_s: None }];
        case.estimate.sensors = vec![sensor];
    })
}

/// The estimate, with these profiles.
fn estimated(case: &Case, profiles: &[&str]) -> Estimated {
    let profiles = profiles.iter().map(|&name| name.to_owned()).collect();
    let search = Search { profiles, ..Search::of(Precision::F64) };
    estimate(&[(case, &Plan::new(case))], &mut Cpu::new(Precision::F64), &search).expect("an estimate")
}

/// The estimate, with these profiles, and the posterior.
fn drawn(case: &Case, profiles: &[&str]) -> (Estimated, Posterior) {
    let (plan, mut march) = (Plan::new(case), Cpu::new(Precision::F64));
    let found = estimated(case, profiles);
    let drawn = posterior(&[(case, &plan)], &mut march, &found, &WALKERS).expect("a posterior");
    (found, drawn)
}

/// Where an interval begins and ends beside another, in widths of the latter.
fn apart((low, high): (f64, f64), other: (f64, f64)) -> f64 {
    ((low - other.0).abs()).max((high - other.1).abs()) / (other.1 - other.0)
}

#[test]
fn where_the_problem_is_near_linear_the_posterior_has_the_linear_intervals() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[(0, 0.95), (1, 1.01)]);
    let (found, drawn) = drawn(&case, &[]);
    assert!(found.converged && drawn.is_settled(), "{:?}", drawn.marginals);
    for (place, marginal) in drawn.marginals.iter().enumerate() {
        let off = apart(marginal.interval, found.intervals[place]);
        assert!(off < POSTERIOR_ENDS, "{place}: {:?} for {:?}", marginal.interval, found.intervals[place]);
    }
    let (low, high) = drawn.marginals[0].interval;
    let moved = apart((low + 0.3 * (high - low), high + 0.3 * (high - low)), found.intervals[0]);
    assert!(moved > POSTERIOR_ENDS, "an interval that is off by a third of its width would pass");
    let Some(pair) = drawn.pairs.first() else { panic!("no pair") };
    assert!((pair.correlation - found.identifiability.correlation[0][1]).abs() < 0.01, "{}", pair.correlation);
    assert!(drawn.gain < 0.5 && drawn.predicted[0].failed == 0);
    // Noise is what its deviation says: nothing is lacking, and TC3, which is held, is in no doubt.
    assert!(drawn.discrepancy.amplitude_k < 1.0, "{:?}", drawn.discrepancy);
    let held = &drawn.predicted[0].sensors[0].discrepancy;
    assert!(held.low_k.iter().zip(&held.high_k).all(|(low, high)| high - low < 1e-6));
}

/// The truth stands on the bound of the heat capacity. A linear interval is as long on one side as on the other, whatever is
/// allowed; the profile has no end there, and what walkers draw stays between the bounds.
#[test]
fn where_a_bound_cuts_it_off_the_posterior_ends_there_and_the_linear_interval_does_not() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[(0, 0.95), (1, 1.1)]);
    let (found, drawn) = drawn(&case, &["f_cp_INS"]);
    let ((low, high), bound) = (drawn.marginals[1].interval, found.factors[1].bounds.1);
    let linear = found.intervals[1];
    assert!(linear.1 > bound && high <= bound && low < found.values[1], "{low} to {high}, linear {linear:?}");
    assert_eq!(found.profiles[0].interval.1, None);
    assert!(apart((low, high), linear) > POSTERIOR_ENDS, "{low} to {high}, linear {linear:?}");
}

/// The board is measured at 11.44 mm and not at 17.16 mm, and what is behind it is not known: with twice and four times the
/// film that is assumed, factors are found that meet the measurement as well. Each is a board that it may be.
#[test]
fn the_band_of_an_unseen_thermocouple_holds_what_other_models_foresee_that_meet_the_data_as_well() {
    let case = changed(&coarse("kaowool-tc"), |case| case.resolution.largest_step_s = 5.0);
    let (found, drawn) = drawn(&case, &[]);
    let off_k = |found: &Estimated| found.fitted[0].misfits[0].1.rms_k;
    let unseen = &drawn.predicted[0].sensors[1];
    let held = |low_k: &[f64], high_k: &[f64], trace_k: &[f64]| {
        let within = low_k.iter().zip(high_k).zip(trace_k).filter(|((low, high), at)| (*low..=*high).contains(at));
        within.count() as f64 / trace_k.len() as f64
    };
    assert!(unseen.held.is_none() && drawn.discrepancy.amplitude_k > 1.0, "{:?}", drawn.discrepancy);
    let mut plain = 1.0_f64;
    for film_w_m2_k in [20.0, 40.0] {
        let other = changed(&case, |case| {
            let Face::Open(open) = &mut case.exposure.back_face else { panic!("an open face") };
            open.film_w_m2_k = film_w_m2_k;
        });
        let other = estimated(&other, &[]);
        assert!(off_k(&other) < 1.05 * off_k(&found), "{film_w_m2_k}: {} for {}", off_k(&other), off_k(&found));
        let trace_k = &other.fitted[0].after.temperatures_k[1];
        let [by_factors, with_all] =
            [&unseen.parameters, &unseen.discrepancy].map(|band| held(&band.low_k, &band.high_k, trace_k));
        assert!(with_all > 0.95, "{film_w_m2_k}: the band holds {with_all}");
        plain = plain.min(by_factors);
    }
    assert!(plain < 0.95, "what is known of the factors alone holds {plain} already");
    // Heat does not flow up: nothing gets colder than the start at 290 K, whatever the model lacks.
    let coldest_k = unseen.discrepancy.low_k.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((coldest_k - 290.0).abs() < ROUNDING_K, "{coldest_k} K");
}

/// The processor, which counts what it is asked for: members, and of derivatives the points.
struct Counting {
    march: Cpu,
    tells: bool,
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
        self.members += if self.tells { points.len() } else { 0 };
        if self.tells { self.march.tangents(plan, points, of) } else { Ok(None) }
    }
}

#[test]
fn a_posterior_tells_as_many_members_as_were_marched_with_derivatives_told_and_by_differences() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[]);
    let (found, plan) = (estimated(&case, &[]), Plan::new(&case));
    let walkers = Walkers { number: 10, moves: 20, seed: 1 };
    let told = [true, false].map(|tells| {
        let mut march = Counting { march: Cpu::new(Precision::F64), tells, members: 0 };
        let drawn = posterior(&[(&case, &plan)], &mut march, &found, &walkers).expect("a posterior");
        assert_eq!(drawn.marches, march.members, "derivatives told: {tells}");
        drawn.marches
    });
    assert_eq!(told[1] - told[0], 2 * case.factors().len(), "a stencil has two members a factor beside its middle");
}

/// Two depths of a real board were measured. Fitted to the upper alone, the lower is as unseen as the third, and can be looked at.
#[test]
fn of_a_real_board_the_band_holds_the_measured_thermocouple_that_was_not_fitted() {
    let case = changed(&coarse("kaowool"), |case| {
        case.resolution.largest_step_s = 5.0;
        case.estimate.sensors = vec![0];
    });
    let unseen = &drawn(&case, &[]).1.predicted[0].sensors[1];
    let (_, held) = unseen.held.expect("TC2 is observed");
    let widest_k = |band: &Band| band.low_k.iter().zip(&band.high_k).map(|(low, high)| high - low).fold(0.0, f64::max);
    let [by_factors_k, with_all_k] = [&unseen.parameters, &unseen.discrepancy].map(widest_k);
    assert!(held > 0.95, "the band holds {held}");
    assert!(with_all_k > 1.5 * by_factors_k && with_all_k < 200.0, "{by_factors_k} K and {with_all_k} K wide");
}

#[test]
fn walkers_that_cannot_span_the_factors_are_too_few() {
    let case = observed(coarse("lcat-2259-tc3"), "TC4", &[]);
    let (plan, mut march) = (Plan::new(&case), Cpu::new(Precision::F64));
    let found = estimated(&case, &[]);
    let few = Walkers { number: 4, ..WALKERS };
    let refused = posterior(&[(&case, &plan)], &mut march, &found, &few).expect_err("too few");
    assert!(matches!(refused, PosteriorError::FewWalkers { least: 6, .. }), "{refused}");
}
