//! Optimal experimental design: the observations from which parameters are estimated best.
//!
//! Each candidate, such as a sensor at a depth, has an information matrix `H = XᵀX`: the sum of the outer products of
//! its derivatives by the parameters, over the standard deviation of its readings. The score `Xᵀr` of its readings has
//! the covariance `K = XᵀΣX` with the correlation Σ of their noise, which is H for white noise. Both are sums over the
//! candidates of a set, whose noise is independent, and least squares have the covariance `H⁻¹ K H⁻¹`, as in the [noise
//! model](super::noise_model) of an estimate. It depends on the true parameters, so there are two matrices for each of
//! many *members* drawn from their prior, and a criterion is averaged over the members or over the worst of them
//! (Pronzato & Walter, Math. Biosci. 75, 1985).
//!
//! The best set of a size is found by exhaustion where there are few sets, else by exchanges from random starts
//! (Fedorov 1972; Cook & Nachtsheim, Technometrics 22, 1980). Criteria: Atkinson, Donev & Tobias, *Optimum Experimental
//! Designs, with SAS* (2007), chapter 10.

mod exchange;

pub use exchange::{OptimalSet, optimal_sets};

use nalgebra::DMatrix;

/// Information and score covariance of candidates: candidate × member × the lower triangles of H and of K, row by row.
/// Parameters are in units of their prior standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct InformationTable {
    parameters: usize,
    members: usize,
    values: Vec<f64>,
}

/// The quantity that a design minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "command", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// Determinant of the covariance of the factors: the volume of their confidence region.
    #[default]
    D,
    /// Sum of the variances of the factors, in units of their priors.
    A,
    /// Variance of the predicted peak of the target (c-optimality).
    ///
    /// Elfving 1952; in general that of one linear combination of the parameters.
    C,
}

/// How a criterion is taken over the members.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Robustness {
    /// The mean of all members.
    #[default]
    Mean,
    /// The mean of the worst 5 % of the members.
    Worst,
}

/// Fraction of the members that [`Robustness::Worst`] averages.
pub const WORST_FRACTION: f64 = 0.05;

/// Information that is added to every matrix, as of independent readings, in units of the prior: it bounds the variance
/// of what is not determined by 10¹⁰ prior variances.
const REGULARISATION: f64 = 1e-10;

/// A criterion of a table.
#[derive(Clone, Copy, Debug)]
pub struct Objective<'a> {
    /// The information of the candidates.
    pub table: &'a InformationTable,
    /// The criterion.
    pub criterion: Criterion,
    /// Over the members.
    pub robustness: Robustness,
    /// Derivatives of the prediction by the parameters, member × parameter; for [`Criterion::C`].
    pub prediction: &'a [f64],
}

impl InformationTable {
    /// A table of zeros.
    pub fn new(parameters: usize, members: usize, candidates: usize) -> Self {
        Self { parameters, members, values: vec![0.0; candidates * members * 2 * packed(parameters)] }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.members
    }

    /// Set the lower triangles of a candidate and member: information, and covariance of the score.
    pub fn set(&mut self, candidate: usize, member: usize, information: &[f64], scores: &[f64]) {
        let size = packed(self.parameters);
        let start = (candidate * self.members + member) * 2 * size;
        self.values[start..start + size].copy_from_slice(information);
        self.values[start + size..start + 2 * size].copy_from_slice(scores);
    }

    fn entry(&self, candidate: usize, member: usize) -> &[f64] {
        let size = 2 * packed(self.parameters);
        let start = (candidate * self.members + member) * size;
        &self.values[start..start + size]
    }

    /// The sums over a set, member × lower triangles, for the first members.
    fn sums(&self, set: &[usize], members: usize) -> Vec<f64> {
        let size = 2 * packed(self.parameters);
        let mut sums = vec![0.0; members * size];
        for &candidate in set {
            let start = candidate * self.members * size;
            let values = &self.values[start..start + members * size];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        for triangle in sums.chunks_mut(size / 2) {
            (0..self.parameters).for_each(|row| triangle[diagonal(row)] += REGULARISATION);
        }
        sums
    }

    /// Covariance of the parameters from a set at a member, in units of the prior.
    pub fn covariance(&self, set: &[usize], member: usize) -> DMatrix<f64> {
        let size = packed(self.parameters);
        let mut sum = vec![0.0; 2 * size];
        for &candidate in set {
            sum.iter_mut().zip(self.entry(candidate, member)).for_each(|(sum, value)| *sum += value);
        }
        let matrix = |triangle: &[f64]| {
            let at = |row: usize, column: usize| triangle[diagonal(row.max(column)) - row.abs_diff(column)];
            let add = |row, column| if row == column { REGULARISATION } else { 0.0 };
            DMatrix::from_fn(self.parameters, self.parameters, |i, j| at(i, j) + add(i, j))
        };
        // The information is positive definite, but for rounding.
        match matrix(&sum[..size]).cholesky().map(|factor| factor.inverse()) {
            Some(inverse) => &inverse * matrix(&sum[size..]) * &inverse,
            None => DMatrix::identity(self.parameters, self.parameters) / REGULARISATION,
        }
    }
}

/// Entries of a lower triangle.
fn packed(parameters: usize) -> usize {
    parameters * (parameters + 1) / 2
}

/// Place of a diagonal entry in a lower triangle.
fn diagonal(row: usize) -> usize {
    row * (row + 3) / 2
}

impl Objective<'_> {
    /// The criterion of a set; smaller is better.
    pub fn loss(&self, set: &[usize]) -> f64 {
        let members = self.table.members;
        self.loss_of(&self.table.sums(set, members), members)
    }

    /// The criterion of sums over a set, member × lower triangles.
    fn loss_of(&self, sums: &[f64], members: usize) -> f64 {
        let size = 2 * packed(self.table.parameters);
        let mut factors = vec![0.0; size];
        let each = |(member, sum): (usize, &[f64])| self.member_loss(sum, member, &mut factors);
        let losses = sums.chunks(size).take(members).enumerate().map(each);
        over_members(self.robustness, losses, members)
    }

    /// The criterion after a candidate is added to sums.
    fn loss_with(&self, sums: &[f64], candidate: usize, members: usize) -> f64 {
        let size = 2 * packed(self.table.parameters);
        let (mut factors, mut sum) = (vec![0.0; size], vec![0.0; size]);
        let losses = sums.chunks(size).take(members).enumerate().map(|(member, others)| {
            let own = self.table.entry(candidate, member);
            sum.iter_mut().zip(others.iter().zip(own)).for_each(|(sum, (a, b))| *sum = a + b);
            self.member_loss(&sum, member, &mut factors)
        });
        over_members(self.robustness, losses, members)
    }

    /// The criterion of sums of a member; `factors` is space for their Cholesky factors.
    fn member_loss(&self, sums: &[f64], member: usize, factors: &mut [f64]) -> f64 {
        let n = self.table.parameters;
        let (information, scores) = sums.split_at(packed(n));
        let (factor, factor_of_scores) = factors.split_at_mut(packed(n));
        if !cholesky(information, n, factor) || !cholesky(scores, n, factor_of_scores) {
            return f64::INFINITY;
        }
        let log_root = |factor: &[f64]| (0..n).map(|row| factor[diagonal(row)]).product::<f64>().ln();
        let variance = |gradient: &dyn Fn(usize) -> f64| variance_along(factor, factor_of_scores, n, gradient);
        match self.criterion {
            Criterion::D => 2.0 * log_root(factor_of_scores) - 4.0 * log_root(factor),
            Criterion::A => (0..n).map(|row| variance(&|i| if i == row { 1.0 } else { 0.0 })).sum(),
            Criterion::C => variance(&|i| self.prediction[member * n + i]),
        }
    }
}

fn over_members(robustness: Robustness, losses: impl Iterator<Item = f64>, members: usize) -> f64 {
    match robustness {
        Robustness::Mean => losses.sum::<f64>() / members as f64,
        Robustness::Worst => {
            let mut losses: Vec<f64> = losses.collect();
            losses.sort_by(|a, b| b.total_cmp(a));
            let worst = ((WORST_FRACTION * members as f64).ceil() as usize).clamp(1, members);
            losses[..worst].iter().sum::<f64>() / worst as f64
        }
    }
}

/// Cholesky factor of a packed lower triangle; `false` if it is not positive definite.
fn cholesky(matrix: &[f64], n: usize, factor: &mut [f64]) -> bool {
    for i in 0..n {
        let row = i * (i + 1) / 2;
        for j in 0..=i {
            let other = j * (j + 1) / 2;
            let known: f64 = (0..j).map(|k| factor[row + k] * factor[other + k]).sum();
            let left = matrix[row + j] - known;
            if i == j {
                if left <= 0.0 || left.is_nan() {
                    return false;
                }
                factor[row + j] = left.sqrt();
            } else {
                factor[row + j] = left / factor[other + j];
            }
        }
    }
    true
}

/// `vᵀ H⁻¹ K H⁻¹ v = |Nᵀ u|²` with `L Lᵀ u = v`, from the Cholesky factors L of H and N of K.
fn variance_along(factor: &[f64], factor_of_scores: &[f64], n: usize, vector: &dyn Fn(usize) -> f64) -> f64 {
    let at = |row: usize, column: usize| row * (row + 1) / 2 + column;
    let mut solved = vec![0.0; n];
    for i in 0..n {
        let known: f64 = (0..i).map(|k| factor[at(i, k)] * solved[k]).sum();
        solved[i] = (vector(i) - known) / factor[at(i, i)];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| factor[at(k, i)] * solved[k]).sum();
        solved[i] = (solved[i] - known) / factor[at(i, i)];
    }
    let along = |column: usize| (column..n).map(|row| factor_of_scores[at(row, column)] * solved[row]).sum::<f64>();
    (0..n).map(|column| along(column).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The matrix [[4, 2], [2, 5]] has the determinant 16 and the inverse [[5, −2], [−2, 4]]/16, which is the
    /// covariance for white noise. With the covariance [[8, 0], [0, 16]] of the score it is [[33, −26], [−26, 36]]/32,
    /// of the determinant 1/2.
    #[test]
    fn criteria_are_those_of_the_covariance_of_least_squares() {
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-8, "{found} and {expected}");
        let information = [4.0, 2.0, 5.0];
        let white = (information, [5.0, -2.0, 4.0], 16.0, 1.0 / 16.0);
        let correlated = ([8.0, 0.0, 16.0], [33.0, -26.0, 36.0], 32.0, 0.5_f64);
        for (scores, covariance, scale, determinant) in [white, correlated] {
            let [xx, xy, yy] = covariance.map(|entry| entry / scale);
            let mut table = InformationTable::new(2, 1, 1);
            table.set(0, 0, &information, &scores);
            let objective = |criterion| Objective {
                table: &table,
                criterion,
                robustness: Robustness::Mean,
                prediction: &[1.0, 1.0],
            };
            near(objective(Criterion::D).loss(&[0]), determinant.ln());
            near(objective(Criterion::A).loss(&[0]), xx + yy);
            near(objective(Criterion::C).loss(&[0]), xx + 2.0 * xy + yy);
            near(table.covariance(&[0], 0)[(0, 1)], xy);
        }
    }

    #[test]
    fn a_parameter_that_no_candidate_determines_has_a_large_finite_variance() {
        let mut table = InformationTable::new(2, 1, 1);
        table.set(0, 0, &[4.0, 0.0, 0.0], &[4.0, 0.0, 0.0]);
        assert!(table.covariance(&[0], 0)[(1, 1)] > 1e9);
    }

    #[test]
    fn the_worst_members_are_a_twentieth_of_all() {
        let mut table = InformationTable::new(1, 40, 1);
        for member in 0..40 {
            let information = [if member < 2 { 0.1 } else { 1.0 }];
            table.set(0, member, &information, &information);
        }
        let worst =
            Objective { table: &table, criterion: Criterion::A, robustness: Robustness::Worst, prediction: &[] };
        let mean = Objective { robustness: Robustness::Mean, ..worst };
        assert!((worst.loss(&[0]) - 10.0).abs() < 1e-6 && (mean.loss(&[0]) - 1.45).abs() < 1e-6);
    }
}
