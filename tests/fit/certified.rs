//! Every test problem of `bondline verify`, with the other options of the minimiser.

use bondline::fit::interval::residual_variance;
use bondline::fit::{DampingStrategy, DifferenceScheme, Fit, Options, covariance_summary, minimize, minimize_all};
use bondline::verify::least_squares::{CountedProblem, TestProblem, more_garbow_hillstrom, nist_strd};
use nalgebra::{DMatrix, DVector};

fn analytic() -> Options {
    Options {
        max_iterations: 5000,
        tolerance_reduction: 1e-15,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-15,
        derivative_error: 1e-12,
        ..Options::default()
    }
}

/// Central differences, whose error is about the two-thirds power of rounding.
fn differences() -> Options {
    Options {
        difference_scheme: DifferenceScheme::Central,
        difference_step: 6e-6,
        derivative_error: 1e-9,
        ..analytic()
    }
}

fn fitted(problem: &TestProblem, start: &[f64], with_jacobian: bool, options: &Options) -> Fit {
    let mut counted = CountedProblem::new(problem, with_jacobian);
    let Ok(fit) = minimize(&mut counted, &DVector::from_row_slice(start), options);
    assert_eq!(
        (fit.evaluations, fit.tangent_evaluations),
        (counted.residual_evaluations, counted.tangent_evaluations),
        "{}",
        problem.name
    );
    assert!(fit.path.windows(2).all(|pair| pair[1].objective < pair[0].objective), "{}", problem.name);
    fit
}

/// The smallest number of digits that agree with certified values: minus the logarithm of the relative error, as NIST
/// defines it.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    let error = found.iter().zip(certified).map(|(found, certified)| (found / certified - 1.0).abs());
    error.map(|error| if error.is_nan() { 0.0 } else { -error.max(1e-11).log10() }).fold(f64::INFINITY, f64::min)
}

/// Digits of the estimates and of their standard deviations.
fn agreement(problem: &TestProblem, fit: &Fit) -> (f64, f64) {
    let certified = problem.certified.as_ref().expect("a NIST problem");
    let variance = residual_variance(fit.objective, fit.residuals.len(), fit.point.len());
    let deviations = covariance_summary(&fit.jacobian, variance).standard_errors;
    (digits(fit.point.as_slice(), &certified.estimates), digits(&deviations, &certified.standard_deviations))
}

/// Requires six digits of the estimates and four of their standard deviations; two for Lanczos1, whose residuals of
/// 1e-13 are near the rounding error of values of one.
#[track_caller]
fn meets(problem: &TestProblem, start: &[f64], fit: &Fit) {
    let (estimates, deviations) = agreement(problem, fit);
    assert!(estimates > 6.0, "{} from {start:?}: {estimates:.1} digits, {}", problem.name, fit.termination);
    let required = if problem.name == "Lanczos1" { 2.0 } else { 4.0 };
    assert!(deviations > required, "{} from {start:?}: {deviations:.1} digits of the deviations", problem.name);
}

#[test]
fn single_trials_reach_every_certified_solution_from_both_starts() {
    for problem in &nist_strd() {
        for start in &problem.starts {
            let fit = fitted(problem, start, true, &Options { trials: 1, ..analytic() });
            meets(problem, start, &fit);
        }
    }
}

#[test]
fn finite_differences_reach_every_certified_solution_from_both_starts() {
    for problem in &nist_strd() {
        for start in &problem.starts {
            let fit = fitted(problem, start, false, &differences());
            meets(problem, start, &fit);
        }
    }
}

#[test]
fn an_error_in_the_sixth_digit_of_a_certified_value_is_detected() {
    for mut problem in nist_strd() {
        let start = problem.starts[1].clone();
        let fit = fitted(&problem, &start, true, &analytic());
        assert!(agreement(&problem, &fit).0 > 6.0, "{}", problem.name);
        if let Some(certified) = &mut problem.certified {
            certified.estimates[1] *= 1.0 + 2e-6;
        }
        assert!(agreement(&problem, &fit).0 < 6.0, "{}", problem.name);
    }
}

#[test]
fn fits_from_several_starts_together_equal_separate_fits() {
    for problem in nist_strd().iter().take(6) {
        let starts: Vec<DVector<f64>> = problem.starts.iter().map(|start| DVector::from_row_slice(start)).collect();
        let Ok(batched) =
            minimize_all(&mut CountedProblem::new(problem, false), &DMatrix::from_columns(&starts), &differences());
        for (start, fit) in problem.starts.iter().zip(&batched) {
            let separate = fitted(problem, start, false, &differences());
            assert_eq!((&separate.path, separate.termination), (&fit.path, fit.termination), "{}", problem.name);
        }
    }
}

#[test]
fn geodesic_acceleration_halves_the_iterations_in_long_valleys() {
    for name in ["Bennett5", "MGH10", "Lanczos3"] {
        let problem = nist_strd().into_iter().find(|problem| problem.name == name).expect("listed");
        let iterations = [false, true].map(|bends| {
            let fit = fitted(
                &problem,
                &problem.starts[0],
                true,
                &Options { geodesic_acceleration: bends, trials: 1, ..analytic() },
            );
            assert!(agreement(&problem, &fit).0 > 6.0, "{name}");
            fit.path.len()
        });
        assert!(2 * iterations[1] < iterations[0], "{name}: {iterations:?} iterations without and with");
    }
}

#[test]
fn the_papers_rule_reaches_certified_solutions_of_lower_difficulty_from_the_near_start() {
    for problem in
        nist_strd().iter().filter(|problem| ["Misra1a", "Chwirut2", "Gauss1", "DanWood"].contains(&&*problem.name))
    {
        let rules = DampingStrategy::Paper {
            initial_damping: 1e-3,
            tolerance_objective: 1e-11 * problem.minima[0],
            tolerance_gradient: 0.0,
            tolerance_step: 0.0,
        };
        let fit = fitted(problem, &problem.starts[1], true, &Options { damping_strategy: rules, ..analytic() });
        assert!(agreement(problem, &fit).0 > 6.0, "{}: {}", problem.name, fit.termination);
        // One trial per iteration, μ a tenth after a success and tenfold after a failure: the final damping gives the
        // number of trials.
        let dampings: Vec<f64> = fit.path.iter().map(|iterate| iterate.damping).collect();
        let successes = dampings.len() - 1;
        let failures = (dampings[successes] / dampings[0]).log10() + successes as f64 - 1.0;
        assert!((fit.evaluations as f64 - successes as f64 - failures).abs() < 1e-6, "{}: {dampings:?}", problem.name);
    }
}

#[test]
fn more_garbow_hillstrom_minima_are_found_with_either_derivatives_and_one_or_four_trials() {
    let classics = more_garbow_hillstrom();
    for (with_jacobian, options) in [(true, analytic()), (false, differences())] {
        for trials in [1, 4] {
            let mut astray = Vec::new();
            for problem in &classics {
                let starts = problem.all_starts();
                let error = |start: &[f64]| {
                    problem
                        .relative_error(&fitted(problem, start, with_jacobian, &Options { trials, ..options }), start)
                };
                assert!(error(&starts[0].1) < 1e-6, "{}: {:e}", problem.name, error(&starts[0].1));
                if error(&starts[1].1).is_nan() || error(&starts[1].1) > 1e-6 {
                    astray.push(&problem.name);
                }
            }
            assert!(5 * astray.len() <= classics.len(), "from ten times away, astray: {astray:?}");
        }
    }
}

/// All variables act through one sum.
#[test]
fn a_linear_problem_of_rank_one_is_reported_with_rank_one() {
    let problem = more_garbow_hillstrom()
        .into_iter()
        .find(|problem| problem.name.starts_with("linear, rank one"))
        .expect("listed");
    let fit = fitted(&problem, &problem.starts[0], false, &differences());
    assert!(fit.termination.converged(), "{}", fit.termination);
    let found = covariance_summary(&fit.jacobian, 1.0);
    assert_eq!(found.rank, 1);
    assert!(found.standard_errors.iter().all(|error| error.is_infinite()));
}
