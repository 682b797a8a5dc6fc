//! Optima, posterior quantiles and Sobol indices compared with SciPy, emcee and SALib on the same data;
//! scripts/peers.py computed the references.

use super::{Problem, exact};
use crate::support::{EMCEE_QUANTILES, SALIB_INDEX, SCIPY_OPTIMUM, case, text};
use bondline::case::{Bounds, Factor, LossFunction};
use bondline::ensemble::{Ensemble, Marginal, Sampling, SamplingKind};
use bondline::fit::{LeastSquares, Prior, RobustLoss, RobustProblem, WithPriors, ensemble_mcmc, minimize};
use bondline::statistics::Accumulator;
use nalgebra::{DMatrix, DVector};

/// The cells of all reference rows of a kind.
fn rows(kind: &str) -> Vec<Vec<String>> {
    let text = text("data/verification/peers.csv");
    let cells = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<String>>());
    cells.filter(|cells| cells[0] == kind).map(|cells| cells[1..].to_vec()).collect()
}

fn numbers(cells: &[String]) -> Vec<f64> {
    cells.iter().map(|cell| cell.parse().expect("a number")).collect()
}

/// The plate of scripts/peers.py, between bounds.
fn plate(highest: f64) -> Problem<impl Fn(&[f64]) -> Vec<f64>> {
    let readings: Vec<Vec<f64>> = rows("reading").iter().map(|cells| numbers(cells)).collect();
    let residuals = move |x: &[f64]| {
        let predicted = |time: f64| 300.0 + 200.0 * x[0] * (1.0 - (-0.05 * x[1] * time).exp());
        readings.iter().map(|reading| (predicted(reading[0]) - reading[1]) / 2.0).collect()
    };
    Problem { bounds: vec![(0.5, 1.5), (0.5, highest)], residuals, evaluations: 0 }
}

fn priors(deviation: f64) -> Vec<Prior> {
    (0..2).map(|variable| Prior { variable, mode: 1.0, deviations: [deviation; 2] }).collect()
}

fn optimum<P: LeastSquares>(mut problem: P) -> Vec<f64> {
    let Ok(fit) = minimize(&mut problem, &DVector::from_element(2, 0.8), &exact()) else {
        panic!("residuals are infallible")
    };
    assert!(fit.termination.converged(), "{:?}", fit.termination);
    fit.point.iter().copied().collect()
}

#[test]
fn optima_for_every_loss_with_priors_and_on_a_bound_match_scipy() {
    let found = rows("optimum");
    assert_eq!(found.len(), 5);
    for cells in found {
        let optimum_found = match cells[0].as_str() {
            "prior" => optimum(WithPriors { problem: plate(1.5), priors: priors(0.05) }),
            "bound" => optimum(plate(0.85)),
            loss => optimum(RobustProblem {
                problem: plate(1.5),
                loss: loss.parse::<LossFunction>().expect("a loss").into(),
            }),
        };
        let error = |to: &[f64]| optimum_found.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error(&numbers(&cells[1..])) < SCIPY_OPTIMUM, "{}: {optimum_found:?} for {cells:?}", cells[0]);
        let other = optimum(RobustProblem { problem: plate(1.5), loss: RobustLoss::Huber { width: 1.0 } });
        let difference = other.iter().zip(numbers(&cells[1..])).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference > SCIPY_OPTIMUM, "{}: another loss would pass", cells[0]);
    }
}

/// Quantiles of the posterior, factor × probability.
fn quantiles<P: LeastSquares>(mut problem: P) -> Vec<[f64; 3]> {
    let starts = DMatrix::from_fn(2, 200, |j, walker| 1.0 + 0.0002 * (walker * (j + 1) % 200) as f64 - 0.02);
    let Ok(posterior) = ensemble_mcmc(&mut problem, &starts, 1500, 5) else { panic!("residuals are infallible") };
    let quantiles = |trail: &Vec<f64>| {
        let mut draws = trail[300 * posterior.walkers..].to_vec();
        draws.sort_by(f64::total_cmp);
        [0.025, 0.5, 0.975].map(|probability| draws[(probability * draws.len() as f64) as usize])
    };
    posterior.chains.iter().map(quantiles).collect()
}

#[test]
fn posterior_quantiles_with_and_without_priors_match_emcee() {
    let without = quantiles(plate(1.5));
    let with = quantiles(WithPriors { problem: plate(1.5), priors: priors(0.05) });
    let found = rows("quantile");
    assert_eq!(found.len(), 4);
    for cells in found {
        let factor = usize::from(cells[1] == "b");
        let (quantiles, other) =
            if cells[0] == "prior" { (with[factor], without[factor]) } else { (without[factor], with[factor]) };
        let exact = numbers(&cells[2..]);
        let error = |quantiles: [f64; 3]| {
            let errors = quantiles.iter().zip(&exact).map(|(a, b)| (a - b).abs() / (exact[2] - exact[0]));
            errors.fold(0.0, f64::max)
        };
        assert!(error(quantiles) < EMCEE_QUANTILES, "{cells:?}: {quantiles:?}");
        assert!(error(other) > EMCEE_QUANTILES, "{cells:?}: {other:?} of another density would pass");
    }
}

#[test]
fn sobol_indices_of_a_sweep_match_salib() {
    const MEMBERS: usize = 4_096;
    const RANGES: [(f64, f64); 3] = [(0.5, 1.5), (0.5, 1.5), (0.9, 1.1)];
    let reference = rows("index");
    assert_eq!(reference.len(), RANGES.len());
    let factor = case("slab").factors()[0].clone();
    let drawn: Vec<Factor> = RANGES.iter().map(|&small| Factor { small, ..factor.clone() }).collect();
    let sampling = Sampling { kind: SamplingKind::Uniform, seed: 1 };
    let ensemble = Ensemble::sample(&drawn, Bounds::Small, &sampling, MEMBERS);
    let marginals = RANGES.map(|range| Marginal::new(1.0, range, SamplingKind::Uniform));
    let mut accumulator = Accumulator::new(&[300.0], &marginals);
    for member in 0..MEMBERS {
        let factors = ensemble.member(member);
        let kelvin = 300.0 * factors[2] + 200.0 * factors[0] * (1.0 - (-factors[1]).exp());
        accumulator.add(&[kelvin], &factors);
    }
    let found = accumulator.sensitivity_indices(true, 0..0).remove(0);
    for (factor, cells) in reference.iter().enumerate() {
        let [first, total] = [&cells[1], &cells[2]].map(|cell| cell.parse::<f64>().expect("a number"));
        assert!((found.first[factor].value - first).abs() < SALIB_INDEX, "{:?}, not {first}", found.first[factor]);
        assert!((found.total[factor].value - total).abs() < SALIB_INDEX, "{:?}, not {total}", found.total[factor]);
    }
    let [first, total] = [1, 2].map(|cell| reference[0][cell].parse::<f64>().expect("a number"));
    assert!(total - first > 10.0 * SALIB_INDEX, "neglecting the interaction would pass");
}
