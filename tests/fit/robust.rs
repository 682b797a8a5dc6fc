//! Robust losses and priors through the public interface.

use super::exact;
use crate::support::{case, modified};
use bondline::adapt::adapt;
use bondline::case::{Bounds, Case, EstimationSettings, LossFunction};
use bondline::fit::interval::residual_variance;
use bondline::fit::{
    Fit, LeastSquares, Options, Prior, RobustLoss, RobustProblem, Tangent, WithPriors, covariance_summary, minimize,
};
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::plan::Plan;
use bondline::study::estimate::{SearchOptions, estimate};
use bondline::verify::least_squares::{CountedProblem, TestProblem, nist_strd};
use bondline::work_log::NoLog;
use nalgebra::{DMatrix, DVector};
use std::convert::Infallible;

/// Fit of offset and slope of a straight line to readings at 0 … 1.
struct Line(Vec<f64>);

impl LeastSquares for Line {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        &[(f64::NEG_INFINITY, f64::INFINITY); 2]
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        let abscissa = |i: usize| i as f64 / (self.0.len() - 1) as f64;
        Ok(DMatrix::from_fn(self.0.len(), points.ncols(), |i, column| {
            points[(0, column)] + points[(1, column)] * abscissa(i) - self.0[i]
        }))
    }
}

/// Uniform on [0, 1).
fn uniform(bits: &mut u64) -> f64 {
    *bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*bits >> 11) as f64 / (1u64 << 53) as f64
}

/// 5 − 3 t with approximately normal noise of unit variance (sum of twelve uniform numbers); with outliers, one reading
/// in ten is 40 too high.
fn readings(bits: &mut u64, outliers: bool) -> Vec<f64> {
    let mut reading = |i: usize| {
        let noise = (0..12).map(|_| uniform(bits)).sum::<f64>() - 6.0;
        let outlier = if outliers && uniform(bits) < 0.1 { 40.0 } else { 0.0 };
        5.0 - 3.0 * i as f64 / 59.0 + noise + outlier
    };
    (0..60).map(&mut reading).collect()
}

fn robust(readings: Vec<f64>, loss: RobustLoss) -> Fit {
    let mut problem = RobustProblem { problem: Line(readings), loss };
    let Ok(fit) = minimize(&mut problem, &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    fit
}

const LOSSES: [RobustLoss; 2] = [RobustLoss::SoftL1 { width: 1.0 }, RobustLoss::Huber { width: 1.345 }];

#[test]
fn outliers_bias_least_squares_but_not_a_robust_fit() {
    let mut bits = 7;
    let contaminated = readings(&mut bits, true);
    let Ok(plain) = minimize(&mut Line(contaminated.clone()), &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(plain.point[0] > 7.0, "{}", plain.point);
    for loss in LOSSES {
        let fit = robust(contaminated.clone(), loss);
        assert!((fit.point[0] - 5.0).abs() < 1.0 && (fit.point[1] + 3.0).abs() < 1.5, "{loss:?}: {}", fit.point);
    }
}

/// Over 400 data sets the scatter of the estimates equals the standard error of each fit, within the sampling error of
/// 400 sets and of the large-sample limit. Standard errors from the transformed residuals are wrong by more.
#[test]
fn robust_standard_errors_equal_the_scatter_of_the_estimates() {
    for outliers in [false, true] {
        for loss in LOSSES {
            let mut bits = 2026;
            let (mut offsets, mut stated, mut uncorrected) = (Vec::new(), 0.0, 0.0);
            for _ in 0..400 {
                let fit = robust(readings(&mut bits, outliers), loss);
                let untransformed = loss.untransformed(&fit.residuals, &fit.jacobian);
                let variance = loss.variance(&untransformed.residuals, 2.0);
                stated += covariance_summary(&untransformed.jacobian, variance).standard_errors[0] / 400.0;
                let variance = residual_variance(fit.objective, fit.residuals.len(), 2);
                uncorrected += covariance_summary(&fit.jacobian, variance).standard_errors[0] / 400.0;
                offsets.push(fit.point[0]);
            }
            let scatter = DVector::from_vec(offsets).variance().sqrt();
            assert!((stated / scatter - 1.0).abs() < 0.12, "{loss:?}, outliers {outliers}: {stated} for {scatter}");
            if outliers {
                assert!(uncorrected / scatter > 1.5, "{loss:?}: uncorrected {uncorrected} for {scatter}");
            }
        }
    }
}

/// A narrow prior on the slope determines the slope, and the data the offset.
#[test]
fn a_narrow_prior_determines_its_variable() {
    let mut bits = 11;
    let readings: Vec<f64> = readings(&mut bits, false);
    let prior = Prior { variable: 1, mode: -3.0, deviations: [1e-3; 2] };
    let inner = RobustProblem { problem: Line(readings), loss: RobustLoss::Huber { width: 1.345 } };
    let mut problem = WithPriors { problem: inner, priors: vec![prior] };
    let Ok(fit) = minimize(&mut problem, &DVector::from_vec(vec![1.0, 1.0]), &exact());
    assert!(fit.termination.converged(), "{}", fit.termination);
    assert!((fit.point[1] + 3.0).abs() < 5e-3 && (fit.point[0] - 5.0).abs() < 0.5, "{}", fit.point);
}

/// A NIST problem with some outliers.
struct Contaminated<'a> {
    counted: CountedProblem<'a>,
    off: DVector<f64>,
}

impl LeastSquares for Contaminated<'_> {
    type Error = Infallible;

    fn bounds(&self) -> &[(f64, f64)] {
        self.counted.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, Infallible> {
        let mut residuals = self.counted.residuals(points)?;
        residuals.column_iter_mut().for_each(|mut column| column += &self.off);
        Ok(residuals)
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, Infallible> {
        let Some(mut tangents) = self.counted.tangents(points)? else { return Ok(None) };
        tangents.iter_mut().for_each(|tangent| tangent.residuals += &self.off);
        Ok(Some(tangents))
    }
}

/// A problem without curvature weights: the minimiser treats transformed residuals as ordinary ones.
struct Unweighted<P>(P);

impl<P: LeastSquares> LeastSquares for Unweighted<P> {
    type Error = P::Error;

    fn bounds(&self) -> &[(f64, f64)] {
        self.0.bounds()
    }

    fn residuals(&mut self, points: &DMatrix<f64>) -> Result<DMatrix<f64>, P::Error> {
        self.0.residuals(points)
    }

    fn tangents(&mut self, points: &DMatrix<f64>) -> Result<Option<Vec<Tangent>>, P::Error> {
        self.0.tangents(points)
    }
}

/// One observation in `every` is `sigmas` standard deviations too low.
fn contaminated(
    test_problem: &TestProblem,
    (sigmas, every): (f64, usize),
    deviation: f64,
    loss: RobustLoss,
) -> RobustProblem<Contaminated<'_>> {
    let observations = test_problem.residuals(&test_problem.starts[0]).len();
    let off = |i: usize, _| if i % every == every / 2 { sigmas * deviation } else { 0.0 };
    RobustProblem {
        problem: Contaminated {
            counted: CountedProblem::new(test_problem, true),
            off: DVector::from_fn(observations, off),
        },
        loss,
    }
}

/// Eleven NIST problems with up to a third of the observations 10 to 100 standard deviations off, and losses of the
/// usual width and of about a tenth of it, for which most of the remaining residuals are large too.
#[test]
fn robust_fits_with_outliers_converge_in_twenty_iterations_to_the_reference_minimum() {
    const SETS: [&str; 11] = [
        "Chwirut1", "Chwirut2", "Gauss1", "Gauss2", "Gauss3", "DanWood", "Kirby2", "Roszman1", "BoxBOD", "Rat42",
        "Rat43",
    ];
    let reference = Options {
        max_iterations: 5000,
        tolerance_reduction: 1e-15,
        tolerance_gradient: 1e-12,
        tolerance_step: 1e-13,
        derivative_error: 1e-12,
        ..Options::default()
    };
    let (mut fits, mut slow) = (0, 0);
    for test_problem in nist_strd().iter().filter(|test_problem| SETS.contains(&test_problem.name.as_str())) {
        let start = DVector::from_row_slice(test_problem.starts.last().expect("two starts"));
        let observations = test_problem.residuals(&test_problem.starts[0]).len();
        let deviation = (test_problem.minima[0] / observations as f64).sqrt();
        for outliers in [(10.0, 7), (40.0, 4), (100.0, 3)] {
            for widths in [[1.345, 1.0], [0.2, 0.1]] {
                let [huber, soft] = widths.map(|width| width * deviation);
                for loss in [RobustLoss::Huber { width: huber }, RobustLoss::SoftL1 { width: soft }] {
                    let problem = || contaminated(test_problem, outliers, deviation, loss);
                    let Ok(fit) = minimize(&mut problem(), &start, &Options::default());
                    let Ok(least) = minimize(&mut Unweighted(problem()), &start, &reference);
                    let label = format!("{} {outliers:?} {loss}: {}", test_problem.name, fit.termination);
                    assert!(fit.termination.converged() && fit.path.len() - 1 <= 20, "{label} in {}", fit.path.len());
                    let excess = fit.objective / least.objective - 1.0;
                    assert!(excess < 1e-8, "{label}: S is {excess:e} above the minimum");
                    let many = Options { max_iterations: 300, ..Options::default() };
                    let Ok(unweighted) = minimize(&mut Unweighted(problem()), &start, &many);
                    slow += usize::from(unweighted.path.len() - 1 > 20);
                    fits += 1;
                }
            }
        }
    }
    // Negative control: without curvature weights the fits take longer.
    assert!(fits == 132 && slow >= 10, "{slow} of {fits} take more than 20 iterations without the weights");
}

/// The root mean square residual is 64 standard deviations, so nearly every sample is an outlier.
#[test]
fn a_case_with_large_model_error_converges_in_25_iterations_for_every_loss() {
    let losses = [
        (LossFunction::Huber { width: 2.0 }, Some(Bounds::Small)),
        (LossFunction::SoftL1 { width: 2.0 }, Some(Bounds::Small)),
        (LossFunction::SoftL1 { width: 1.0 }, None),
    ];
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let mut fitted = |case: &Case, plan: &Plan| {
        let profiles = case.estimate().prior.map(|_| "f_k_INS".to_owned()).into_iter().collect();
        let search = SearchOptions { landscape: false, profiles, ..SearchOptions::for_precision(Precision::F64) };
        estimate(&[(case, plan)], &mut march, &search, &mut NoLog).expect("an estimate")
    };
    for (loss_function, prior) in losses {
        let case = case("lcat-2259");
        let sensor = |name: &str| case.sensors().iter().position(|sensor| sensor.name == name).expect("a sensor");
        let factor = |name: &str| case.factors().iter().position(|factor| factor.name == name).expect("a factor");
        let insulator = factor("f_k_INS");
        let (sensors, factors) = (["TC3", "TC4"].map(sensor).to_vec(), vec![factor("f_k_OF"), insulator]);
        let window_s = Some((0.0, 200.0));
        let estimate = EstimationSettings {
            factors,
            sensors,
            window_s,
            start: Vec::new(),
            bounds: Bounds::Large,
            loss_function,
            prior,
        };
        let case = modified(&case, |case| case.estimate = estimate);
        // One plan for all fits: between plans S differs by as much as between neighbours.
        let plan = adapt(&case).expect("a plan");
        let found = fitted(&case, &plan);
        let loss = RobustLoss::from(loss_function);
        assert!(
            found.converged && found.iterations.len() - 1 <= 25,
            "{loss}: {} in {}",
            found.termination,
            found.iterations.len()
        );
        // No neighbour along the other factor has a lower S. With data alone this is checked by fits with that factor
        // nearly fixed, with priors by the profile, since there each fit has its own scale.
        if prior.is_some() {
            let rises = &found.profiles[0].rises;
            assert!(rises.len() > 8 && rises.iter().all(|rise| *rise > -1e-6), "{loss}: {rises:?}");
            assert!(rises.iter().any(|rise| *rise > 1.0), "{loss}: a profile that is flat would pass");
            continue;
        }
        assert_eq!(found.values[0], 0.5, "{loss}: on its bound");
        for neighbour in [0.995, 1.005] {
            let value = neighbour * found.values[1];
            let held = modified(&case, |case| {
                // Bounds of finite width.
                let narrow = (value, value * (1.0 + 1e-9));
                let factor = &mut case.factors[insulator];
                (factor.nominal, factor.small, factor.large) = (value, narrow, narrow);
            });
            let rise = fitted(&held, &plan).start_results[0].objective - found.start_results[0].objective;
            assert!(rise > 0.0, "{loss}: S is lower by {} at {neighbour} of the estimate", -rise);
        }
    }
}
