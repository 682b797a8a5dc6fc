//! Optimal experimental design: the observations from which parameters are estimated best.
//!
//! Each candidate, such as a sensor at a depth, has a Fisher information matrix: the sum of the outer products of its
//! derivatives by the parameters, over the standard deviation of its readings. The information of a set is the sum. It
//! depends on the true parameters, so there is one matrix for each of many *members* drawn from their prior, and a
//! criterion is averaged over the members or over the worst of them (Pronzato & Walter, Math. Biosci. 75, 1985).
//!
//! The best set of a size is found by exhaustion where there are few sets, else by exchanges from random starts
//! (Fedorov 1972; Cook & Nachtsheim, Technometrics 22, 1980). Criteria: Atkinson, Donev & Tobias, *Optimum Experimental
//! Designs, with SAS* (2007), chapter 10.

mod exchange;

pub use exchange::{OptimalSet, optimal_sets};

use nalgebra::DMatrix;

/// Information matrices of candidates: candidate × member × lower triangle, row by row. Parameters are in units of
/// their prior standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct InformationTable {
    parameters: usize,
    members: usize,
    values: Vec<f64>,
}

/// The quantity that a design minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum Criterion {
    /// Volume of the confidence region: the logarithm of the determinant of the covariance.
    #[default]
    D,
    /// Sum of the variances of the parameters.
    A,
    /// Variance of a prediction.
    I,
}

/// How a criterion is taken over the members.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize), serde(rename_all = "lowercase"))]
pub enum Robustness {
    /// The mean of all members.
    #[default]
    Mean,
    /// The mean of the worst 5 % of the members.
    Worst,
}

/// Fraction of the members that [`Robustness::Worst`] averages.
pub const WORST_FRACTION: f64 = 0.05;

/// Information that is added to every matrix, in units of the prior: it bounds the variance of what is not determined
/// by 10¹⁰ prior variances.
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
    /// Derivatives of the prediction by the parameters, member × parameter; for [`Criterion::I`].
    pub prediction: &'a [f64],
}

impl InformationTable {
    /// A table of zeros.
    pub fn new(parameters: usize, members: usize, candidates: usize) -> Self {
        Self { parameters, members, values: vec![0.0; candidates * members * packed(parameters)] }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.members
    }

    /// The lower triangle of a candidate and member.
    pub fn entry_mut(&mut self, candidate: usize, member: usize) -> &mut [f64] {
        let size = packed(self.parameters);
        let start = (candidate * self.members + member) * size;
        &mut self.values[start..start + size]
    }

    fn entry(&self, candidate: usize, member: usize) -> &[f64] {
        let size = packed(self.parameters);
        let start = (candidate * self.members + member) * size;
        &self.values[start..start + size]
    }

    /// The sum of the information of a set, member × lower triangle, for the first members.
    fn sums(&self, set: &[usize], members: usize) -> Vec<f64> {
        let size = packed(self.parameters);
        let mut sums = vec![0.0; members * size];
        for &candidate in set {
            let start = candidate * self.members * size;
            let values = &self.values[start..start + members * size];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        for member in sums.chunks_mut(size) {
            (0..self.parameters).for_each(|row| member[diagonal(row)] += REGULARISATION);
        }
        sums
    }

    /// Covariance of the parameters from a set at a member, in units of the prior.
    pub fn covariance(&self, set: &[usize], member: usize) -> DMatrix<f64> {
        let mut sum = vec![0.0; packed(self.parameters)];
        for &candidate in set {
            sum.iter_mut().zip(self.entry(candidate, member)).for_each(|(sum, value)| *sum += value);
        }
        let at = |row: usize, column: usize| sum[diagonal(row.max(column)) - row.abs_diff(column)];
        let add = |row, column| if row == column { REGULARISATION } else { 0.0 };
        let information = DMatrix::from_fn(self.parameters, self.parameters, |i, j| at(i, j) + add(i, j));
        // The information is positive definite, but for rounding.
        let inverse = information.clone().cholesky().map(|factor| factor.inverse());
        inverse.unwrap_or_else(|| DMatrix::identity(self.parameters, self.parameters) / REGULARISATION)
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

    /// The criterion of sums of information, member × lower triangle.
    fn loss_of(&self, sums: &[f64], members: usize) -> f64 {
        let size = packed(self.table.parameters);
        let mut factor = vec![0.0; size];
        let each = |(member, sum): (usize, &[f64])| self.member_loss(sum, member, &mut factor);
        let losses = sums.chunks(size).take(members).enumerate().map(each);
        over_members(self.robustness, losses, members)
    }

    /// The criterion after a candidate is added to sums.
    fn loss_with(&self, sums: &[f64], candidate: usize, members: usize) -> f64 {
        let size = packed(self.table.parameters);
        let (mut factor, mut sum) = (vec![0.0; size], vec![0.0; size]);
        let losses = sums.chunks(size).take(members).enumerate().map(|(member, others)| {
            let own = self.table.entry(candidate, member);
            sum.iter_mut().zip(others.iter().zip(own)).for_each(|(sum, (a, b))| *sum = a + b);
            self.member_loss(&sum, member, &mut factor)
        });
        over_members(self.robustness, losses, members)
    }

    fn member_loss(&self, information: &[f64], member: usize, factor: &mut [f64]) -> f64 {
        let n = self.table.parameters;
        if !cholesky(information, n, factor) {
            return f64::INFINITY;
        }
        match self.criterion {
            Criterion::D => -2.0 * (0..n).map(|row| factor[diagonal(row)]).product::<f64>().ln(),
            Criterion::A => (0..n).map(|row| variance_along(factor, n, |i| if i == row { 1.0 } else { 0.0 })).sum(),
            Criterion::I => variance_along(factor, n, |i| self.prediction[member * n + i]),
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

/// `vᵀ M⁻¹ v = |L⁻¹ v|²` from the Cholesky factor L of M.
fn variance_along(factor: &[f64], n: usize, vector: impl Fn(usize) -> f64) -> f64 {
    let mut solved = vec![0.0; n];
    for i in 0..n {
        let row = i * (i + 1) / 2;
        let known: f64 = (0..i).map(|k| factor[row + k] * solved[k]).sum();
        solved[i] = (vector(i) - known) / factor[row + i];
    }
    solved.iter().map(|value| value * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The matrix [[4, 2], [2, 5]] has the determinant 16 and the inverse [[5, −2], [−2, 4]]/16.
    #[test]
    fn criteria_are_those_of_the_inverse() {
        let mut table = InformationTable::new(2, 1, 1);
        table.entry_mut(0, 0).copy_from_slice(&[4.0, 2.0, 5.0]);
        let objective =
            |criterion| Objective { table: &table, criterion, robustness: Robustness::Mean, prediction: &[1.0, 1.0] };
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-8, "{found} and {expected}");
        near(objective(Criterion::D).loss(&[0]), -16.0_f64.ln());
        near(objective(Criterion::A).loss(&[0]), 9.0 / 16.0);
        near(objective(Criterion::I).loss(&[0]), 5.0 / 16.0);
        near(table.covariance(&[0], 0)[(0, 1)], -2.0 / 16.0);
    }

    #[test]
    fn a_parameter_that_no_candidate_determines_has_a_large_finite_variance() {
        let mut table = InformationTable::new(2, 1, 1);
        table.entry_mut(0, 0).copy_from_slice(&[4.0, 0.0, 0.0]);
        assert!(table.covariance(&[0], 0)[(1, 1)] > 1e9);
    }

    #[test]
    fn the_worst_members_are_a_twentieth_of_all() {
        let mut table = InformationTable::new(1, 40, 1);
        (0..40).for_each(|member| table.entry_mut(0, member)[0] = if member < 2 { 0.1 } else { 1.0 });
        let worst =
            Objective { table: &table, criterion: Criterion::A, robustness: Robustness::Worst, prediction: &[] };
        let mean = Objective { robustness: Robustness::Mean, ..worst };
        assert!((worst.loss(&[0]) - 10.0).abs() < 1e-6 && (mean.loss(&[0]) - 1.45).abs() < 1e-6);
    }
}
