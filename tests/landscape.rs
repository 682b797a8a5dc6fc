//! The objective of an estimate: its map has the minima that the minimisation finds, and no iteration increases it.

use crate::support::{case, cases};
use bondline::adapt::adapt;
use bondline::case::Case;
use bondline::fit::LeastSquares;
use bondline::march::{Precision, cpu::Cpu, richardson::RichardsonMarch};
use bondline::plan::Plan;
use bondline::study::estimate::{Landscape, ParameterEstimates, SearchOptions, estimate};
use bondline::study::thermocouple_residuals::{CaseResiduals, ThermocoupleResiduals, samples};
use bondline::work_log::NoLog;
use nalgebra::DMatrix;

fn march() -> RichardsonMarch {
    RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)))
}

/// Standardised residuals of a case at points of its estimated factors, point × residual, and the standard deviations,
/// K.
fn residuals(case: &Case, plan: &Plan, points: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let places = case.estimate().factors.iter().copied().map(Some).collect();
    let bounds =
        case.estimate().factors.iter().map(|&factor| case.factors()[factor].bounds(case.estimate().bounds)).collect();
    let observed = samples(case, plan).concat();
    let sigmas_k = observed.iter().map(|sample| sample.sigma_k).collect();
    let mut march = march();
    let mut problem =
        ThermocoupleResiduals::new(&mut march, vec![CaseResiduals::new(case, plan, places, observed)], bounds);
    let columns = points.iter().flatten().copied();
    let points = DMatrix::from_iterator(case.estimate().factors.len(), points.len(), columns);
    let found = problem.residuals(&points).expect("the processor does not fail");
    (found.column_iter().map(|column| column.iter().copied().collect()).collect(), sigmas_k)
}

fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// The distinct end points of the minimisations.
fn places(found: &ParameterEstimates, cell: &[f64]) -> Vec<Vec<f64>> {
    let is_near = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(cell).all(|((a, b), cell)| (a - b).abs() <= *cell);
    let mut places: Vec<Vec<f64>> = Vec::new();
    for end in found.start_results.iter().filter(|end| end.converged) {
        if !places.iter().any(|place| is_near(place, &end.values)) {
            places.push(end.values.clone());
        }
    }
    places
}

/// The objective on a rectangular grid of 25 × 25, the alternative to the map.
fn on_a_grid(case: &Case, plan: &Plan, bounds: &[(f64, f64)]) -> Landscape {
    let side = |(low, high): (f64, f64)| (0..25).map(move |i| low + (high - low) * f64::from(i) / 24.0);
    let rows: Vec<Vec<Vec<f64>>> = side(bounds[1]).map(|y| side(bounds[0]).map(|x| vec![x, y]).collect()).collect();
    let (found, _) = residuals(case, plan, &rows.concat());
    let axis = |place: usize| rows.iter().map(|row| row.iter().map(|point| point[place]).collect()).collect();
    let objective = found.chunks(25).map(|row| row.iter().map(|r| squares(r)).collect()).collect();
    Landscape { x: axis(0), y: axis(1), objective, valley: 0 }
}

#[test]
fn the_map_of_the_objective_has_exactly_the_minima_that_minimisations_find() {
    for id in ["twin-tc3", "kaowool-tc"] {
        let case = case(id);
        let plan = adapt(&case).expect("the processor does not fail");
        let search = SearchOptions { starts: 200, ..SearchOptions::for_precision(Precision::F64) };
        let found = estimate(&[(&case, &plan)], &mut march(), &search, &mut NoLog).expect("an estimate");
        let bounds: Vec<(f64, f64)> = found.factors.iter().map(|factor| factor.bounds).collect();
        let cell: Vec<f64> = bounds.iter().map(|(low, high)| (high - low) / (Landscape::LINES - 1) as f64).collect();
        let converged = found.start_results.iter().filter(|end| end.converged).count();
        assert!(converged > 190, "{id}: {converged} of 200 minimisations converged");

        let ends = places(&found, &cell);
        let map = found.landscape.as_ref().expect("a map of two factors");
        let minima = map.minima();
        assert_eq!(minima.len(), ends.len(), "{id}: {minima:?} on the map, {ends:?} by minimisation");
        for place in &ends {
            let near = |&(x, y): &(f64, f64)| (x - place[0]).abs() <= cell[0] && (y - place[1]).abs() <= cell[1];
            assert!(minima.iter().any(near), "{id}: {place:?} is not among {minima:?}");
        }

        // The map equals a march at the same factors, along the valley and away from it.
        let picked: Vec<(usize, usize)> = (3..map.x.len())
            .step_by(13)
            .flat_map(|line| [map.valley, map.valley + 9].map(|node| (line, node)))
            .collect();
        let points: Vec<Vec<f64>> = picked.iter().map(|&(i, j)| vec![map.x[i][j], map.y[i][j]]).collect();
        let (marched, _) = residuals(&case, &plan, &points);
        for (&(line, node), marched) in picked.iter().zip(&marched) {
            let (drawn, true_s) = (map.objective[line][node], squares(marched));
            assert!((drawn / true_s - 1.0).abs() < 0.01, "{id}: {drawn} on the map, {true_s} by a march");
        }

        let grid = on_a_grid(&case, &plan, &bounds);
        let false_minima = grid.minima().len();
        assert!(false_minima > ends.len(), "{id}: a rectangular grid has {false_minima} minima, no more than the map");
    }
}

#[test]
fn no_iteration_increases_the_objective() {
    let estimated = |case: &Case| {
        let plan = adapt(case).expect("the processor does not fail");
        let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(Precision::F64) };
        let found = estimate(&[(case, &plan)], &mut march(), &search, &mut NoLog).expect("an estimate");
        (plan, found)
    };
    let mut judged = 0;
    let mut unweighted_rises = Vec::new();
    let has_estimate = |case: &Case| !case.estimate().factors.is_empty() && case.fitted_observations().next().is_some();
    for case in cases().into_iter().filter(has_estimate) {
        let (plan, found) = estimated(&case);
        let path: Vec<f64> = found.iterations.iter().map(|turn| turn.objective).collect();
        assert!(path.is_sorted_by(|before, after| after <= before), "{}: {path:?}", case.id());
        // The objective is the sum of squared standardised residuals of marches at the points visited.
        let points: Vec<Vec<f64>> = found.iterations.iter().map(|turn| turn.values.clone()).collect();
        let (marched, sigmas_k) = residuals(&case, &plan, &points);
        for (objective, residuals) in path.iter().zip(&marched) {
            let marched = squares(residuals);
            assert!((objective - marched).abs() <= 1e-6 * marched + 1e-9, "{}: {objective}, {marched}", case.id());
        }
        let in_kelvin = |residuals: &Vec<f64>| -> f64 {
            residuals.iter().zip(&sigmas_k).map(|(r, sigma_k)| (r * sigma_k).powi(2)).sum()
        };
        let unweighted: Vec<f64> = marched.iter().map(in_kelvin).collect();
        if !unweighted.is_sorted_by(|before, after| after <= before) {
            unweighted_rises.push(case.id().to_owned());
        }
        judged += 1;
    }
    assert!(judged >= 9, "only {judged} cases estimate anything");
    // Negative control: the unweighted sum in kelvin increases.
    assert!(unweighted_rises.contains(&"kaowool-tc".to_owned()), "it increases on {unweighted_rises:?}");
}
