//! A piece of a sweep: the statistics of some of its members in a JSON file, for merging with the other pieces.
//!
//! The file identifies the case (path and fingerprint of its content), the sampling, the backend, and the nominal march
//! about which deviations are accumulated. The accumulators are integers in the order of
//! [`Accumulator::to_integers`](crate::study::statistics::Accumulator::to_integers); floating-point numbers survive to
//! the bit.

use super::nominal::Prediction;
use super::simultaneous_band::Envelope;
use super::uncertainty::{Failure, SweepStatistics};
use crate::case::{Case, unreadable_file_message};
use crate::march;
use crate::traces::{Balance, MemberStatus, Traces};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use twox_hash::XxHash3_128;

/// Content of a piece file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// The version of bondline that wrote it.
    pub bondline: String,
    /// The case that was marched.
    pub case: CaseIdentity,
    /// Sampling of the whole sweep.
    pub draw: SamplingRecord,
    /// The backend.
    pub backend: Backend,
    /// The members of this piece: first, and one past the last.
    pub members: Range<usize>,
    failures: Vec<FailureRecord>,
    nominal: NominalRecord,
    numbers: Vec<i128>,
    /// Stored traces of those of the first members of the sweep that are in this piece.
    kept: BTreeMap<usize, Vec<i32>>,
}

/// Identity of the case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseIdentity {
    /// The id of the case.
    pub id: String,
    /// Absolute path of the case.
    pub path: PathBuf,
    /// Changes by `--set`, as name and value.
    pub sets: Vec<(String, String)>,
    /// Hash of the case's content, by [`fingerprint`].
    pub fingerprint: String,
}

/// Sampling of the whole sweep.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingRecord {
    /// Members of the whole sweep.
    pub members: usize,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: String,
    /// The seed of the draw.
    pub seed: u64,
    /// `small`, `large`.
    pub bounds: String,
}

/// The backend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backend {
    /// Description of the device.
    pub name: String,
    /// `cpu` or `gpu`.
    pub kind: String,
    /// `f32` or `f64`.
    pub precision: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FailureRecord {
    reason: String,
    members: usize,
    first: usize,
}

/// The nominal march, as [`Traces`] hold it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NominalRecord {
    temperatures_k: Vec<f64>,
    /// The envelope that scales deviations of temperatures, K.
    below_k: Vec<f64>,
    above_k: Vec<f64>,
    gauges: Vec<f64>,
    balance: Balance,
    extremes_k: Vec<(f64, f64)>,
}

/// An unreadable or invalid piece file.
#[derive(Debug, thiserror::Error)]
#[error("{path:?}: {message}")]
#[non_exhaustive]
pub struct PieceError {
    /// The file.
    pub path: PathBuf,
    /// The error.
    pub message: String,
}

impl Piece {
    /// A piece with the statistics of `members` about a completed nominal march.
    pub fn new(
        case: CaseIdentity,
        draw: SamplingRecord,
        backend: &march::Backend,
        members: Range<usize>,
        nominal: &Prediction,
        gathered: &SweepStatistics,
    ) -> Self {
        let record = |failure: Failure| {
            let Failure { reason, members, first } = failure;
            FailureRecord { reason, members, first }
        };
        Self {
            bondline: env!("CARGO_PKG_VERSION").to_owned(),
            case,
            draw,
            backend: Backend {
                name: backend.name.clone(),
                kind: backend.kind.to_owned(),
                precision: backend.precision.name().to_owned(),
            },
            members,
            failures: gathered.failures().into_iter().map(record).collect(),
            nominal: NominalRecord {
                temperatures_k: nominal.temperatures_k.concat(),
                below_k: gathered.envelope().below_k.clone(),
                above_k: gathered.envelope().above_k.clone(),
                gauges: nominal.gauge_traces.iter().flat_map(|reading| reading.values.iter().copied()).collect(),
                balance: nominal.balance,
                extremes_k: nominal.extremes_k.clone(),
            },
            numbers: gathered.to_integers(),
            kept: gathered.stored_traces().clone(),
        }
    }

    /// File name: `slab-0-2500.json` for members 0 to 2,499 of `slab`.
    pub fn file_name(&self) -> String {
        format!("{}-{}-{}.json", self.case.id, self.members.start, self.members.end)
    }

    /// The JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("numbers, texts and maps of whole numbers can be written")
    }

    /// Read a piece file.
    ///
    /// # Errors
    /// When the file is unreadable or invalid.
    pub fn read(path: &Path) -> Result<Self, PieceError> {
        let fault = |message: String| PieceError { path: path.to_owned(), message };
        let text = fs::read_to_string(path).map_err(|error| fault(unreadable_file_message(&error)))?;
        serde_json::from_str(&text)
            .map_err(|error| fault(format!("not a piece file of `uncertainty --members`: {error}")))
    }

    /// Whether both pieces have the same nominal march, to the bit.
    pub fn has_same_nominal(&self, other: &Self) -> bool {
        self.nominal == other.nominal
    }

    /// The nominal march, of a case with `sensors` sensors.
    pub fn nominal(&self, sensors: usize) -> Traces {
        Traces {
            first: 0,
            sensors,
            instants: self.nominal.temperatures_k.len() / sensors.max(1),
            temperatures_k: self.nominal.temperatures_k.clone(),
            gauges: self.nominal.gauges.clone(),
            statuses: vec![MemberStatus::Completed],
            balances: vec![self.nominal.balance],
            extremes_k: self.nominal.extremes_k.clone(),
        }
    }

    /// Failures by reason.
    pub fn failures(&self) -> Vec<Failure> {
        let failure = |record: &FailureRecord| Failure {
            reason: record.reason.clone(),
            members: record.members,
            first: record.first,
        };
        self.failures.iter().map(failure).collect()
    }

    /// Stored traces of the first members, in quanta.
    pub fn kept(&self) -> &BTreeMap<usize, Vec<i32>> {
        &self.kept
    }

    /// The envelope that scales deviations of temperatures.
    pub fn envelope(&self) -> Envelope {
        Envelope { below_k: self.nominal.below_k.clone(), above_k: self.nominal.above_k.clone() }
    }

    /// The accumulators, as integers.
    pub fn numbers(&self) -> &[i128] {
        &self.numbers
    }
}

/// Hash of the case's content, including changes by `--set`: XXH3 of its JSON with sorted keys. Numbers are written
/// exactly. It detects mistakes, not tampering.
pub fn fingerprint(case: &Case) -> String {
    // `serde_json::Value` sorts its keys, so the order of fields in the source does not matter.
    let content = serde_json::to_value(case).expect("a case is made of numbers, texts, lists and maps of texts");
    format!("{:032x}", XxHash3_128::oneshot(content.to_string().as_bytes()))
}
