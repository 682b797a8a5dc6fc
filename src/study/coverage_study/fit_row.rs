//! The fit of a data set as a row of the [log](crate::kept_work::work_log) of a coverage study.

use super::{DataSetFit, FitOutcome, FitResult, NO_DATA};
use crate::fit::Termination;

/// Outcomes in a row; a fit that did not converge has the place of its [`Termination`] after the last of them.
const FAILED: usize = 0;
const CONVERGED: usize = 1;
const NOT_CONVERGED: usize = 2;

/// Numbers of a row for each factor: truth, estimate, ends of its interval, whether it is on a bound.
const OF_FACTOR: usize = 5;

impl DataSetFit {
    /// Numbers of a row for this number of factors.
    pub(super) fn columns(factors: usize) -> usize {
        OF_FACTOR * factors + 3
    }

    pub(super) fn row(&self) -> Vec<f64> {
        let (outcome, result) = match &self.outcome {
            FitOutcome::Failed(_) => (FAILED, None),
            FitOutcome::Converged(result) => (CONVERGED, Some(result)),
            FitOutcome::NotConverged(result, reason) => (NOT_CONVERGED + place_of(reason), Some(result)),
        };
        let mut row = self.truth.clone();
        if let Some(FitResult { values, intervals, at_bound, effective_samples, samples }) = result {
            row.extend(values);
            row.extend(intervals.iter().flat_map(|&(low, high)| [low, high]));
            row.extend(at_bound.iter().map(|&at_bound| f64::from(u8::from(at_bound))));
            row.extend([*effective_samples, *samples as f64]);
        }
        row.resize(Self::columns(self.truth.len()) - 1, 0.0);
        row.push(outcome as f64);
        row
    }

    pub(super) fn from_row(row: &[f64], factors: usize) -> Self {
        let (of_factors, rest) = row.split_at(OF_FACTOR * factors);
        let result = || FitResult {
            values: of_factors[factors..2 * factors].to_vec(),
            intervals: of_factors[2 * factors..4 * factors].chunks_exact(2).map(|ends| (ends[0], ends[1])).collect(),
            at_bound: of_factors[4 * factors..].iter().map(|&at_bound| at_bound == 1.0).collect(),
            effective_samples: rest[0],
            samples: rest[1] as usize,
        };
        let outcome = match rest[2] as usize {
            FAILED => FitOutcome::Failed(NO_DATA.to_owned()),
            CONVERGED => FitOutcome::Converged(result()),
            place => FitOutcome::NotConverged(result(), reason_at(place - NOT_CONVERGED)),
        };
        Self { truth: of_factors[..factors].to_vec(), outcome }
    }
}

fn place_of(reason: &str) -> usize {
    let place = Termination::ALL.iter().position(|end| end.to_string() == reason);
    place.expect("a fit that does not converge has the text of its termination")
}

fn reason_at(place: usize) -> String {
    Termination::ALL.get(place).map_or_else(String::new, ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_are_read_back_to_the_bit_with_unbounded_intervals_and_reasons() {
        let result = || FitResult {
            values: vec![0.1 + 0.2, 1.0],
            intervals: vec![(f64::NEG_INFINITY, f64::INFINITY), (0.9, 1.1)],
            at_bound: vec![false, true],
            effective_samples: 12.3,
            samples: 40,
        };
        let not_converged = |end: &Termination| FitOutcome::NotConverged(result(), end.to_string());
        let mut outcomes = vec![FitOutcome::Converged(result()), FitOutcome::Failed(NO_DATA.to_owned())];
        outcomes.extend(Termination::ALL.iter().map(not_converged));
        for outcome in outcomes {
            let fit = DataSetFit { truth: vec![1.0 / 3.0, 0.5], outcome };
            assert_eq!(fit.row().len(), DataSetFit::columns(2));
            assert_eq!(format!("{:?}", DataSetFit::from_row(&fit.row(), 2)), format!("{fit:?}"));
        }
    }
}
