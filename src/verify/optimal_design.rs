//! Verification rows of optimal design: polynomial regression on −1 to 1, whose D-optimal points are known.

use super::{Group, VerificationRow};
use crate::fit::optimal_design::{Criterion, InformationTable, Objective, Robustness, optimal_sets};

/// Points of the grid of candidates, besides the optimal ones.
const GRID: usize = 41;

/// Quadratic and cubic regression with as many points as coefficients.
pub(super) fn optimal_design_rows() -> Vec<VerificationRow> {
    let inner = 1.0 / 5.0_f64.sqrt();
    vec![row("quadratic regression", &[-1.0, 0.0, 1.0]), row("cubic regression", &[-1.0, -inner, inner, 1.0])]
}

fn row(name: &str, optimum: &[f64]) -> VerificationRow {
    let coefficients = optimum.len();
    // An even grid of its own, so that no candidate but the last ones is an optimal point.
    let grid = (0..GRID).map(|n| -0.99 + 1.98 * n as f64 / (GRID - 1) as f64 + 1e-3);
    let candidates: Vec<f64> = grid.chain(optimum.iter().copied()).collect();
    let mut table = InformationTable::new(coefficients, 1, candidates.len());
    for (candidate, x) in candidates.iter().enumerate() {
        let powers = (0..coefficients).flat_map(|i| (0..=i).map(move |j| x.powi((i + j) as i32)));
        let information: Vec<f64> = powers.collect();
        table.set(candidate, 0, &information, &information);
    }
    let objective = Objective { table: &table, criterion: Criterion::D, robustness: Robustness::Mean, prediction: &[] };
    let known: Vec<usize> = (GRID..candidates.len()).collect();
    let (found, _) = optimal_sets(&objective, candidates.len(), coefficients, &|_, _| true, 1);
    let loss = found.first().map_or(f64::NAN, |set| set.loss);
    VerificationRow {
        group: Group::Fit,
        case: name.to_owned(),
        reference: "Atkinson, Donev and Tobias (2007), section 11.3".to_owned(),
        quantity: "loss of efficiency of the D-optimal points".to_owned(),
        difference: ((loss - objective.loss(&known)) / coefficients as f64).abs(),
        tolerance: 1e-9,
        unit: "relative".to_owned(),
        source_of_tolerance: "rounding; wide: the same points have the same efficiency".to_owned(),
    }
}
