//! Every problem with a known answer that `bondline verify` tells of, asked for in the other ways that the fit has.

use bondline::fit::interval::residual_variance;
use bondline::fit::{Fit, Options, Rules, Sides, certainty, minimize, minimize_all};
use bondline::verify::least_squares::{Asked, Known, classics, nist};
use nalgebra::{DMatrix, DVector};

fn told() -> Options {
    Options {
        patience: 5000,
        tolerance_reduction: 1e-15,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-15,
        derivative_error: 1e-12,
        ..Options::default()
    }
}

/// By central differences, whose error is about the two-thirds power of rounding.
fn differences() -> Options {
    Options { sides: Sides::Both, difference_step: 6e-6, derivative_error: 1e-9, ..told() }
}

fn fitted(known: &Known, start: &[f64], tells: bool, options: &Options) -> Fit {
    let mut asked = Asked::new(known, tells);
    let Ok(fit) = minimize(&mut asked, &DVector::from_row_slice(start), options);
    assert_eq!((fit.evaluations, fit.tangents), (asked.residuals, asked.tangents), "{}", known.name);
    assert!(fit.path.windows(2).all(|turns| turns[1].objective < turns[0].objective), "{}", known.name);
    fit
}

/// To how many digits numbers agree with certified ones at least: minus the logarithm of the relative error, which is
/// what NIST asks for.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    let off = found.iter().zip(certified).map(|(found, certified)| (found / certified - 1.0).abs());
    off.map(|off| if off.is_nan() { 0.0 } else { -off.max(1e-11).log10() }).fold(f64::INFINITY, f64::min)
}

/// Digits of the estimates and of their standard deviations.
fn agreement(known: &Known, fit: &Fit) -> (f64, f64) {
    let certified = known.certified.as_ref().expect("of NIST");
    let variance = residual_variance(fit.objective, fit.residuals.len(), fit.point.len());
    let deviations = certainty(&fit.jacobian, variance).standard_errors;
    (digits(fit.point.as_slice(), &certified.estimates), digits(&deviations, &certified.deviations))
}

/// Six digits of the estimates and four of their deviations, but for those of Lanczos1, whose residuals of 1e-13 doubles of
/// size one hardly resolve.
#[track_caller]
fn meets(known: &Known, start: &[f64], fit: &Fit) {
    let (estimates, deviations) = agreement(known, fit);
    assert!(estimates > 6.0, "{} from {start:?}: {estimates:.1} digits, {}", known.name, fit.termination);
    let enough = if known.name == "Lanczos1" { 2.0 } else { 4.0 };
    assert!(deviations > enough, "{} from {start:?}: {deviations:.1} digits of the deviations", known.name);
}

#[test]
fn one_trial_after_another_meets_every_certified_answer_from_both_starts() {
    for known in &nist() {
        for start in &known.starts {
            let fit = fitted(known, start, true, &Options { trials: 1, ..told() });
            meets(known, start, &fit);
        }
    }
}

#[test]
fn differences_meet_every_certified_answer_from_both_starts() {
    for known in &nist() {
        for start in &known.starts {
            let fit = fitted(known, start, false, &differences());
            meets(known, start, &fit);
        }
    }
}

#[test]
fn a_certified_answer_wrong_in_its_sixth_digit_is_noticed() {
    for mut known in nist() {
        let start = known.starts[1].clone();
        let fit = fitted(&known, &start, true, &told());
        assert!(agreement(&known, &fit).0 > 6.0, "{}", known.name);
        if let Some(certified) = &mut known.certified {
            certified.estimates[1] *= 1.0 + 2e-6;
        }
        assert!(agreement(&known, &fit).0 < 6.0, "{}", known.name);
    }
}

#[test]
fn starts_that_go_down_side_by_side_end_as_each_does_alone_and_in_fewer_ensembles() {
    for known in nist().iter().take(6) {
        let starts: Vec<DVector<f64>> = known.starts.iter().map(|start| DVector::from_row_slice(start)).collect();
        let Ok(together) = minimize_all(&mut Asked::new(known, false), &DMatrix::from_columns(&starts), &differences());
        for (start, fit) in known.starts.iter().zip(&together) {
            let alone = fitted(known, start, false, &differences());
            assert_eq!((&alone.path, alone.termination), (&fit.path, fit.termination), "{}", known.name);
        }
    }
}

#[test]
fn steps_bent_along_the_curve_take_fewer_turns_where_valleys_are_long() {
    for name in ["Bennett5", "MGH10", "Lanczos3"] {
        let known = nist().into_iter().find(|known| known.name == name).expect("listed");
        let turns = [false, true].map(|bends| {
            let fit = fitted(&known, &known.starts[0], true, &Options { bends, trials: 1, ..told() });
            assert!(agreement(&known, &fit).0 > 6.0, "{name}");
            fit.path.len()
        });
        assert!(2 * turns[1] < turns[0], "{name}: {turns:?} turns without and with");
    }
}

#[test]
fn the_papers_rules_meet_certified_answers_of_lower_difficulty_from_near() {
    for known in nist().iter().filter(|known| ["Misra1a", "Chwirut2", "Gauss1", "DanWood"].contains(&&*known.name)) {
        let rules = Rules::Paper {
            damping: 1e-3,
            tolerance_objective: 1e-11 * known.minima[0],
            tolerance_slope: 0.0,
            tolerance_step: 0.0,
        };
        let fit = fitted(known, &known.starts[1], true, &Options { rules, ..told() });
        assert!(agreement(known, &fit).0 > 6.0, "{}: {}", known.name, fit.termination);
        // One trial a turn, a tenth after a success and tenfold after a failure: the damping tells how many there were.
        let dampings: Vec<f64> = fit.path.iter().map(|turn| turn.damping).collect();
        let successes = dampings.len() - 1;
        let failures = (dampings[successes] / dampings[0]).log10() + successes as f64 - 1.0;
        assert!((fit.evaluations as f64 - successes as f64 - failures).abs() < 1e-6, "{}: {dampings:?}", known.name);
    }
}

#[test]
fn the_classics_are_met_at_known_minima_told_their_derivatives_or_not_by_one_trial_or_four() {
    let classics = classics();
    for (tells, options) in [(true, told()), (false, differences())] {
        for trials in [1, 4] {
            let mut astray = Vec::new();
            for known in &classics {
                let starts = known.every_start();
                let off =
                    |start: &[f64]| known.off(&fitted(known, start, tells, &Options { trials, ..options }), start);
                assert!(off(&starts[0].1) < 1e-6, "{}: {:e}", known.name, off(&starts[0].1));
                if off(&starts[1].1).is_nan() || off(&starts[1].1) > 1e-6 {
                    astray.push(&known.name);
                }
            }
            assert!(5 * astray.len() <= classics.len(), "from ten times away, astray: {astray:?}");
        }
    }
}

/// Every variable acts through one sum.
#[test]
fn a_linear_problem_of_rank_one_owns_up_to_its_rank() {
    let known = classics().into_iter().find(|known| known.name.starts_with("linear, rank one")).expect("listed");
    let fit = fitted(&known, &known.starts[0], false, &differences());
    assert!(fit.termination.converged(), "{}", fit.termination);
    let found = certainty(&fit.jacobian, 1.0);
    assert_eq!(found.rank, 1);
    assert!(found.standard_errors.iter().all(|error| error.is_infinite()));
}
