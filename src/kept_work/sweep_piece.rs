//! A piece of a sweep: the statistics of some of its members in a JSON file, for merging with the other pieces.
//!
//! The file identifies the case (path and fingerprint of its content), the sampling, the backend, and the nominal march
//! about which deviations are accumulated. The accumulators are integers in the order of
//! [`Accumulator::to_integers`](crate::statistics::Accumulator::to_integers); floating-point numbers survive to the
//! bit. The text of the piece follows its checksum.

use super::checksum::{Checksum, sealed, unsealed, write_sealed};
use crate::case::{Case, InputFile, unreadable_file_message};
use crate::limits::{PIECE_FILE_MIB, read_file};
use crate::march;
use crate::study::margins::MarginSamples;
use crate::study::nominal::{GaugeTrace, Prediction};
use crate::study::run_record::RunRecord;
use crate::study::simultaneous_band::Envelope;
use crate::study::uncertainty::{Failure, Sweep, SweepStatistics};
use crate::traces::{Balance, GaugePeak, MemberStatus, Peak, Traces};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{self, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Content of a piece file, with the accumulators as integers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Piece<N = Vec<i128>> {
    /// When, by which version and command, and from which files the piece was made.
    pub run: RunRecord,
    /// The case that was marched.
    pub case: CaseIdentity,
    /// Sampling of the whole sweep.
    pub draw: Sweep,
    /// The backend.
    pub backend: Backend,
    /// The members of this piece: first, and one past the last.
    pub members: Range<usize>,
    /// Number of equal pieces of the sweep, of which this is one; `None` if its members were stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equal_pieces: Option<usize>,
    failures: Vec<FailureRecord>,
    nominal: NominalRecord,
    numbers: N,
    /// Stored traces, by member, of the members of this piece that are among the first of the sweep.
    kept: BTreeMap<usize, Vec<i32>>,
    #[serde(default, skip_serializing_if = "MarginSamples::is_empty")]
    margins: MarginSamples,
}

/// The accumulators of statistics, written as a sequence of integers without a copy, which would be as large as the
/// statistics.
struct AccumulatorIntegers<'a>(&'a SweepStatistics);

impl Serialize for AccumulatorIntegers<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.integers())
    }
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
    /// Temperatures of the parts with temperature limits, K.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    limited_k: Vec<f64>,
    gauges: Vec<f64>,
    peaks: Vec<Peak>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    limited_peaks: Vec<Peak>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    times_above_s: Vec<f64>,
    gauge_peaks: Vec<GaugePeak>,
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
        draw: Sweep,
        backend: &march::Backend,
        run: RunRecord,
        members: Range<usize>,
        nominal: &Prediction,
        sweep_statistics: &SweepStatistics,
    ) -> Self {
        Self {
            run,
            case,
            draw,
            backend: Backend {
                name: backend.name.clone(),
                kind: backend.kind.to_owned(),
                precision: backend.precision.name().to_owned(),
            },
            members,
            equal_pieces: None,
            failures: failure_records(sweep_statistics),
            nominal: NominalRecord {
                temperatures_k: nominal.temperatures_k.concat(),
                below_k: sweep_statistics.envelope().below_k.clone(),
                above_k: sweep_statistics.envelope().above_k.clone(),
                limited_k: nominal.limited_k.concat(),
                gauges: nominal.gauge_traces.iter().flat_map(|reading| reading.values.iter().copied()).collect(),
                peaks: nominal.peaks.clone(),
                limited_peaks: nominal.margins.iter().map(|margin| margin.peak).collect(),
                times_above_s: nominal.margins.iter().map(|margin| margin.time_above_s).collect(),
                gauge_peaks: nominal.gauge_traces.iter().map(GaugeTrace::extreme).collect(),
                balance: nominal.balance,
                extremes_k: nominal.extremes_k.clone(),
            },
            numbers: sweep_statistics.to_integers(),
            kept: sweep_statistics.stored_traces().clone(),
            margins: sweep_statistics.margin_samples().clone(),
        }
    }

    /// The piece with the statistics of other members, from its first one, about the same nominal march.
    #[must_use]
    pub fn with_statistics(&self, sweep_statistics: &SweepStatistics) -> Self {
        self.with_numbers(sweep_statistics, sweep_statistics.to_integers())
    }

    /// Write the text of the piece with the statistics of other members, from its first one, about the same nominal
    /// march. Neither the text nor the integers are in memory.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn write_with_statistics(
        &self,
        sweep_statistics: &SweepStatistics,
        file: impl Write + Seek,
    ) -> io::Result<()> {
        write_sealed(file, &self.with_numbers(sweep_statistics, AccumulatorIntegers(sweep_statistics)))
    }

    fn with_numbers<N>(&self, sweep_statistics: &SweepStatistics, numbers: N) -> Piece<N> {
        let nominal = self.nominal.clone();
        let (case, draw, backend, run) = (self.case.clone(), self.draw, self.backend.clone(), self.run.clone());
        let members = self.members.start..self.members.start + sweep_statistics.members();
        let (kept, failures) = (sweep_statistics.stored_traces().clone(), failure_records(sweep_statistics));
        let margins = sweep_statistics.margin_samples().clone();
        Piece { run, case, draw, backend, members, equal_pieces: None, failures, nominal, numbers, kept, margins }
    }

    /// The JSON text: the checksum of the piece, then the piece.
    pub fn to_json(&self) -> String {
        sealed(self)
    }

    /// Read a piece file. Returns the file too, as an input of what is made from it.
    ///
    /// # Errors
    /// When the file is unreadable or invalid, or its content does not have its checksum.
    pub fn read(path: &Path) -> Result<(Self, InputFile), PieceError> {
        let fault = |message: String| PieceError { path: path.to_owned(), message };
        let bytes = read_file(path, &PIECE_FILE_MIB).map_err(|error| fault(unreadable_file_message(&error)))?;
        let file = InputFile::new(path.display().to_string(), &bytes);
        let text = String::from_utf8(bytes).map_err(|error| fault(format!("expected UTF-8: {error}")))?;
        let invalid = |reason: String| fault(format!("not a file of a part of a sweep: {reason}"));
        Ok((Self::from_json(&text).map_err(invalid)?, file))
    }

    /// The piece with this [JSON text](Self::to_json).
    ///
    /// # Errors
    /// When the text is not that of a piece, or its content does not have its checksum.
    pub fn from_json(text: &str) -> Result<Self, String> {
        serde_json::from_str(unsealed(text)?).map_err(|error| error.to_string())
    }

    /// Checksum of the statistics, which two pieces of the same members have in common.
    pub fn statistics_checksum(&self) -> String {
        let statistics = (&self.numbers, &self.kept, &self.margins, &self.failures);
        let mut checksum = Checksum::default();
        serde_json::to_writer(&mut checksum, &statistics).expect("numbers and texts can be written");
        checksum.to_hex()
    }

    /// The piece without its statistics, which are large.
    pub(crate) fn without_statistics(&self) -> Self {
        let Self { run, case, draw, backend, members, equal_pieces, failures, nominal, .. } = self;
        Self {
            run: run.clone(),
            case: case.clone(),
            draw: *draw,
            backend: backend.clone(),
            members: members.clone(),
            equal_pieces: *equal_pieces,
            failures: failures.clone(),
            nominal: nominal.clone(),
            numbers: Vec::new(),
            kept: BTreeMap::new(),
            margins: MarginSamples::default(),
        }
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
            limited_k: self.nominal.limited_k.clone(),
            gauges: self.nominal.gauges.clone(),
            peaks: self.nominal.peaks.clone(),
            limited_peaks: self.nominal.limited_peaks.clone(),
            times_above_s: self.nominal.times_above_s.clone(),
            gauge_peaks: self.nominal.gauge_peaks.clone(),
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

    /// Margins of the members.
    pub fn margins(&self) -> &MarginSamples {
        &self.margins
    }

    /// Stored traces of the first members, in quanta.
    pub fn kept(&self) -> &BTreeMap<usize, Vec<i32>> {
        &self.kept
    }

    /// The envelope that scales deviations of temperatures.
    pub fn envelope(&self) -> Envelope {
        Envelope { below_k: self.nominal.below_k.clone(), above_k: self.nominal.above_k.clone() }
    }

    /// Members that completed: the first two integers, those that are counted and those out of the range of the sums.
    pub fn completed(&self) -> usize {
        self.numbers.iter().take(2).filter_map(|number| usize::try_from(*number).ok()).sum()
    }

    /// The accumulators, as integers.
    pub fn numbers(&self) -> &[i128] {
        &self.numbers
    }
}

fn failure_records(sweep_statistics: &SweepStatistics) -> Vec<FailureRecord> {
    let record = |Failure { reason, members, first }| FailureRecord { reason, members, first };
    sweep_statistics.failures().into_iter().map(record).collect()
}

/// The members of piece `number` of `pieces` equal ones, counted from 1: `None` if there is no such piece, or if a
/// piece would have no member.
pub(crate) fn equal_piece(number: usize, pieces: usize, members: usize) -> Option<Range<usize>> {
    let end = |number: usize| (number as u128 * members as u128 / pieces as u128) as usize;
    ((1..=pieces).contains(&number) && pieces <= members).then(|| end(number - 1)..end(number))
}

/// Hash of the case's content, including changes by `--set`: XXH3 of its JSON with sorted keys. Numbers are written
/// exactly. The name of its folder, its title and notes are left out: no result depends on them. It detects mistakes,
/// not tampering.
pub fn fingerprint(case: &Case) -> String {
    // `serde_json::Value` sorts its keys, so the order of fields in the source does not matter.
    let mut content = serde_json::to_value(case).expect("a case is made of numbers, texts, lists and maps of texts");
    if let Value::Object(fields) = &mut content {
        fields.retain(|key, _| key != "id" && key != "name");
    }
    remove_notes(&mut content);
    Checksum::of(content.to_string().as_bytes())
}

fn remove_notes(content: &mut Value) {
    match content {
        Value::Object(fields) => {
            fields.remove("note");
            fields.values_mut().for_each(remove_notes);
        }
        Value::Array(items) => items.iter_mut().for_each(remove_notes),
        _ => {}
    }
}

/// The difference that makes two pieces parts of different sweeps, with its value in each: case, samples, backend or
/// nominal march.
pub(crate) fn difference(piece: &Piece, first: &Piece) -> Option<(&'static str, String, String)> {
    let pair = |what, word: &dyn Fn(&Piece) -> String| Some((what, word(piece), word(first)));
    if piece.case.fingerprint != first.case.fingerprint {
        return pair("cases", &|piece| format!("{} ({})", piece.case.id, piece.case.fingerprint));
    }
    if piece.draw != first.draw {
        return pair("samples", &|piece| piece.draw.to_string());
    }
    if (&piece.backend.kind, &piece.backend.precision) != (&first.backend.kind, &first.backend.precision) {
        return pair("backends", &|piece| format!("{} {}", piece.backend.kind, piece.backend.precision));
    }
    if !piece.has_same_nominal(first) {
        return pair("nominal marches", &|piece| format!("on {}", piece.backend.name));
    }
    None
}
