//! Fits of a coverage study in a file, so that an interrupted study goes on. Numbers are stored as their bits, because
//! the interval of an undetermined factor is infinite.

use super::{CoverageDesign, DataSetFit, FitOutcome, FitResult};
use crate::case::Case;
use crate::march::Backend;
use crate::study::checksum::{sealed, unsealed};
use crate::study::run_record::RunRecord;
use crate::study::sweep_piece::fingerprint;
use serde::{Deserialize, Serialize};

/// The first fits of a study.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeptFits {
    /// When, by which version and command, and from which files they were made.
    pub(crate) run: RunRecord,
    /// Case, design and backend, in words that differ if one of them does.
    pub(crate) study: String,
    /// Data sets of the whole study.
    pub(crate) requested: usize,
    fits: Vec<FitRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FitRecord {
    truth: Vec<u64>,
    /// Why the fit did not converge, or no data set was generated.
    reason: Option<String>,
    result: Option<ResultRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ResultRecord {
    values: Vec<u64>,
    intervals: Vec<(u64, u64)>,
    at_bound: Vec<bool>,
    effective_samples: u64,
    samples: usize,
}

impl KeptFits {
    pub(crate) fn new(case: &Case, design: &CoverageDesign, backend: &Backend, run: RunRecord) -> Self {
        let backend = format!("{} {}", backend.kind, backend.precision.name());
        let study = format!("case {} ({}), {backend}, {design:?}", case.id, fingerprint(case));
        Self { run, study, requested: design.data_sets, fits: Vec::new() }
    }

    /// Number of fits.
    pub(crate) fn len(&self) -> usize {
        self.fits.len()
    }

    /// Take these fits in place of those before.
    pub(crate) fn set(&mut self, fits: &[DataSetFit]) {
        self.fits = fits.iter().map(FitRecord::of).collect();
    }

    pub(crate) fn fits(&self) -> Vec<DataSetFit> {
        self.fits.iter().map(FitRecord::fit).collect()
    }

    pub(crate) fn to_json(&self) -> String {
        sealed(self)
    }

    /// # Errors
    /// When the text is not that of fits, or does not have its checksum.
    pub(crate) fn from_json(text: &str) -> Result<Self, String> {
        serde_json::from_str(unsealed(text)?).map_err(|error| error.to_string())
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn numbers(bits: &[u64]) -> Vec<f64> {
    bits.iter().map(|&bits| f64::from_bits(bits)).collect()
}

impl FitRecord {
    fn of(fit: &DataSetFit) -> Self {
        let (result, reason) = match &fit.outcome {
            FitOutcome::Converged(result) => (Some(result), None),
            FitOutcome::NotConverged(result, reason) => (Some(result), Some(reason.clone())),
            FitOutcome::Failed(reason) => (None, Some(reason.clone())),
        };
        Self { truth: bits(&fit.truth), reason, result: result.map(ResultRecord::of) }
    }

    fn fit(&self) -> DataSetFit {
        let reason = self.reason.clone();
        let outcome = match (self.result.as_ref().map(ResultRecord::result), reason) {
            (Some(result), None) => FitOutcome::Converged(result),
            (Some(result), Some(reason)) => FitOutcome::NotConverged(result, reason),
            (None, reason) => FitOutcome::Failed(reason.unwrap_or_default()),
        };
        DataSetFit { truth: numbers(&self.truth), outcome }
    }
}

impl ResultRecord {
    fn of(result: &FitResult) -> Self {
        Self {
            values: bits(&result.values),
            intervals: result.intervals.iter().map(|(low, high)| (low.to_bits(), high.to_bits())).collect(),
            at_bound: result.at_bound.clone(),
            effective_samples: result.effective_samples.to_bits(),
            samples: result.samples,
        }
    }

    fn result(&self) -> FitResult {
        let interval = |&(low, high): &(u64, u64)| (f64::from_bits(low), f64::from_bits(high));
        FitResult {
            values: numbers(&self.values),
            intervals: self.intervals.iter().map(interval).collect(),
            at_bound: self.at_bound.clone(),
            effective_samples: f64::from_bits(self.effective_samples),
            samples: self.samples,
        }
    }
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
        let fit = |outcome| DataSetFit { truth: vec![1.0 / 3.0, 0.5], outcome };
        let fits = [
            fit(FitOutcome::Converged(result())),
            fit(FitOutcome::NotConverged(result(), "stalled".to_owned())),
            fit(FitOutcome::Failed("diverged".to_owned())),
        ];
        let read: Vec<DataSetFit> = fits.iter().map(|fit| FitRecord::of(fit).fit()).collect();
        assert_eq!(format!("{read:?}"), format!("{fits:?}"));
    }
}
