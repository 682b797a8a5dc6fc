//! A piece of a sweep: the statistics of some of its members in a file, to be merged with those of the others.
//!
//! JSON that says what it is of: the case, by its path and a fingerprint of all it holds, the draw, the backend, and the
//! nominal march from which members are counted. The counts themselves are whole numbers, in the order that
//! [`Tally::numbers`](crate::study::statistics::Tally::numbers) tells; numbers with a point are read back to the bit.

use super::nominal::Nominal;
use super::uncertainty::{Failure, Gathered};
use super::whole_traces::Envelope;
use crate::case::{Case, unreadable};
use crate::march;
use crate::traces::{Arrival, Balance, Traces};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use twox_hash::XxHash3_128;

/// What a piece is of, and what was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Piece {
    /// The version that made it.
    pub bondline: String,
    /// The case that was marched.
    pub case: CaseMark,
    /// How the members of the whole sweep are drawn.
    pub draw: Draw,
    /// What marched.
    pub backend: Backend,
    /// Of the draw, the first and the one behind the last.
    pub members: Range<usize>,
    failures: Vec<FailureRecord>,
    nominal: NominalRecord,
    numbers: Vec<i128>,
    /// Whole traces of the first members of the sweep, of those that are in this piece.
    kept: BTreeMap<usize, Vec<i32>>,
}

/// Which case, and what it held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseMark {
    /// The id of the case.
    pub id: String,
    /// Where it lay, as an absolute path.
    pub path: PathBuf,
    /// What `--set` changed, as name and value.
    pub sets: Vec<(String, String)>,
    /// Of all that the case holds, as [`fingerprint`] takes it.
    pub fingerprint: String,
}

/// How the members of the whole sweep are drawn.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    /// Members of the whole sweep.
    pub members: usize,
    /// `normal`, `uniform`, `lhs`, `sobol`.
    pub sampling: String,
    /// The seed of the draw.
    pub seed: u64,
    /// `small`, `large`.
    pub bounds: String,
}

/// What marched.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backend {
    /// The device in words.
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
    /// The envelope in which deviations of temperatures are measured, K.
    below_k: Vec<f64>,
    above_k: Vec<f64>,
    gauges: Vec<f64>,
    balance: Balance,
    extremes_k: Vec<(f64, f64)>,
}

/// A file that cannot be read, or is no piece.
#[derive(Debug, thiserror::Error)]
#[error("{path:?}: {message}")]
#[non_exhaustive]
pub struct PieceError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub message: String,
}

impl Piece {
    /// What was gathered of `members`, about a nominal march that arrived.
    pub fn new(
        case: CaseMark,
        draw: Draw,
        backend: &march::Backend,
        members: Range<usize>,
        nominal: &Nominal,
        gathered: &Gathered,
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
                gauges: nominal.readings.iter().flat_map(|reading| reading.values.iter().copied()).collect(),
                balance: nominal.balance,
                extremes_k: nominal.extremes_k.clone(),
            },
            numbers: gathered.numbers(),
            kept: gathered.kept().clone(),
        }
    }

    /// The name of its file: of members 0 to 2,499 of `slab` it is `slab-0-2500.json`.
    pub fn file_name(&self) -> String {
        format!("{}-{}-{}.json", self.case.id, self.members.start, self.members.end)
    }

    /// The text of its file.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).expect("numbers, texts and maps of whole numbers can be written")
    }

    /// Read one back.
    ///
    /// # Errors
    /// When the file cannot be read or is no piece.
    pub fn read(path: &Path) -> Result<Self, PieceError> {
        let fault = |message: String| PieceError { path: path.to_owned(), message };
        let text = fs::read_to_string(path).map_err(|error| fault(unreadable(&error)))?;
        serde_json::from_str(&text)
            .map_err(|error| fault(format!("not a piece that `uncertainty --members` left: {error}")))
    }

    /// Whether members of both are counted from the same march, to the bit.
    pub fn has_nominal_of(&self, other: &Self) -> bool {
        self.nominal == other.nominal
    }

    /// The nominal march as it came back, of a case with so many sensors.
    pub fn nominal(&self, sensors: usize) -> Traces {
        Traces {
            first: 0,
            sensors,
            instants: self.nominal.temperatures_k.len() / sensors.max(1),
            temperatures_k: self.nominal.temperatures_k.clone(),
            gauges: self.nominal.gauges.clone(),
            arrivals: vec![Arrival::Done],
            balances: vec![self.nominal.balance],
            extremes_k: self.nominal.extremes_k.clone(),
        }
    }

    /// Why members failed.
    pub fn failures(&self) -> Vec<Failure> {
        let failure = |record: &FailureRecord| Failure {
            reason: record.reason.clone(),
            members: record.members,
            first: record.first,
        };
        self.failures.iter().map(failure).collect()
    }

    /// Whole traces of the first members, as whole numbers.
    pub fn kept(&self) -> &BTreeMap<usize, Vec<i32>> {
        &self.kept
    }

    /// The envelope in which deviations of temperatures were measured.
    pub fn envelope(&self) -> Envelope {
        Envelope { below_k: self.nominal.below_k.clone(), above_k: self.nominal.above_k.clone() }
    }

    /// What was counted, as whole numbers.
    pub fn numbers(&self) -> &[i128] {
        &self.numbers
    }
}

/// A hash of all that a case holds, changes of `--set` included: XXH3 of its JSON with keys in alphabetical order.
/// Numbers are written so that they are read back to the bit. It finds mistakes, not malice.
pub fn fingerprint(case: &Case) -> String {
    // A value of serde_json holds its keys sorted, so that the order of fields in the source does not matter.
    let content = serde_json::to_value(case).expect("a case is made of numbers, texts, lists and maps of texts");
    format!("{:032x}", XxHash3_128::oneshot(content.to_string().as_bytes()))
}
