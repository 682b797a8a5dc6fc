//! Parts of a sweep, merged as they come. The result is bit-identical to one sweep over all members.

use super::error::SessionError;
use crate::case::Case;
use crate::ensemble::Sampling;
use crate::kept_work::sweep_piece::{Piece, difference, fingerprint};
use crate::march::backend_selection::BackendOptions;
use crate::march::monitor::Monitor;
use crate::march::{Backend, Precision};
use crate::plan::{Plan, RoundingError};
use crate::question::{Draw, InputError, QuestionRecord, SessionRecord, Uncertainty};
use crate::study::answers::Answers;
use crate::study::nominal::Prediction;
use crate::study::run_record::RunRecord;
use crate::study::timing::Timing;
use crate::study::uncertainty::{Sweep, SweepStatistics, sweep_error};
use std::ops::Range;
use std::time::Instant;

/// The statistics of the parts of one sweep that have been added so far, in any order. Parts are added one after the
/// other, so that memory does not grow with their number.
pub struct SweepMerger {
    case: Case,
    plan: Plan,
    nominal: Prediction,
    sweep: Sweep,
    /// The name of the first part, and the part without its statistics.
    first: (String, Piece),
    statistics: SweepStatistics,
    parts: Vec<MergedPart>,
    run: RunRecord,
    began: Instant,
}

/// A part that has been added.
struct MergedPart {
    name: String,
    members: Range<usize>,
    device: String,
    statistics_checksum: String,
}

impl SweepMerger {
    /// Nothing of the sweep that a part belongs to; the part is added with the others. `plan` is that of the case, and
    /// `name` names the part in messages. Marches members at corners of the bounds for their discretisation error.
    ///
    /// # Errors
    /// When the part is not of this case or version.
    pub fn new(case: &Case, plan: &Plan, name: &str, part: &Piece) -> Result<Self, SessionError> {
        check_same_sweep((name, part), (name, part))?;
        if fingerprint(case) != part.case.fingerprint {
            return Err(other_case(name, case, part));
        }
        let damaged = || damaged_part(name);
        let traces = part.nominal(case.sensors.len());
        let temperatures = case.sensors.len() * plan.instants_s.len();
        let envelope = part.envelope();
        let (limits, instants, plies) = (case.limits.len(), plan.instants_s.len(), case.layup.plies.len());
        let found = (traces.temperatures_k.len(), traces.limited_k.len(), traces.gauges.len(), traces.extremes_k.len());
        let peaks =
            (traces.peaks.len(), traces.limited_peaks.len(), traces.times_above_s.len(), traces.gauge_peaks.len());
        if found != (temperatures, limits * instants, plan.gauges() * instants, plies)
            || peaks != (case.sensors.len(), limits, limits, plan.gauges())
            || (envelope.below_k.len(), envelope.above_k.len()) != (temperatures, temperatures)
        {
            return Err(damaged());
        }
        let mut nominal = Prediction::of(case, plan, &traces, 0);
        let Sweep { sampling, bounds, .. } = part.draw;
        if let Some(mut error) = nominal.error_estimate.take() {
            let precision = precision(part);
            if precision == Precision::F32
                && error.rounding.is_none()
                && let Some(rounding) = RoundingError::measure(case, plan)?
            {
                error = error.with_rounding(rounding);
            }
            nominal.error_estimate = Some(error.at_corners_of(bounds, case, plan, precision, &Monitor::default())?);
        }
        let statistics = SweepStatistics::new(case, &nominal, &envelope, bounds, sampling.kind);
        let mut run = RunRecord::new(None, &march_backend(part, String::new()), rayon::current_num_threads());
        run.add_files(case);
        Ok(Self {
            case: case.clone(),
            plan: plan.clone(),
            nominal,
            sweep: part.draw,
            first: (name.to_owned(), part.without_statistics()),
            statistics,
            parts: Vec::new(),
            run,
            began: Instant::now(),
        })
    }

    /// Add a part. One with the members and numbers of an earlier part counts once.
    ///
    /// # Errors
    /// When it is of another sweep, damaged, or has other numbers for the members of an earlier part.
    pub fn add(&mut self, name: &str, part: Piece) -> Result<(), SessionError> {
        check_same_sweep((name, &part), (&self.first.0, &self.first.1))?;
        let statistics_checksum = part.statistics_checksum();
        if let Some(same) = self.parts.iter().find(|earlier| earlier.members == part.members) {
            if same.statistics_checksum == statistics_checksum {
                return Ok(());
            }
            let (Range { start, end }, earlier) = (part.members, &same.name);
            return Err(input_error(format!(
                "{name}: its members {start}..{end} have other numbers than those in {earlier}"
            )));
        }
        let statistics =
            self.statistics.restored(part.numbers(), part.kept().clone(), part.margins(), &part.failures());
        let statistics = statistics.filter(|found| found.members() == part.members.len());
        self.statistics.merge(&statistics.ok_or_else(|| damaged_part(name))?);
        let Piece { members, backend, .. } = part;
        self.parts.push(MergedPart { name: name.to_owned(), members, device: backend.name, statistics_checksum });
        Ok(())
    }

    /// Members that the parts have.
    pub fn members(&self) -> usize {
        self.parts.iter().map(|part| part.members.len()).sum()
    }

    /// Check that the parts contain every member of the sweep once.
    ///
    /// # Errors
    /// When members are missing or twice in the parts.
    pub fn check_complete(&self) -> Result<(), SessionError> {
        self.check_contiguous(0..self.first.1.draw.members)
    }

    /// The parts as one part, for merging with others.
    ///
    /// # Errors
    /// When there are no parts, or members between them are missing or twice in the parts.
    pub fn part(&self) -> Result<Piece, SessionError> {
        let start = self.parts.iter().map(|part| part.members.start).min();
        let end = self.parts.iter().map(|part| part.members.end).max();
        let members = start.zip(end).map(|(start, end)| start..end).ok_or_else(no_parts)?;
        self.check_contiguous(members.clone())?;
        let mut whole = self.first.1.clone();
        whole.members = members;
        whole.backend.name = self.devices();
        Ok(whole.with_statistics(&self.statistics))
    }

    /// The answers from the parts so far: those of the whole sweep once [`check_complete`](Self::check_complete) says
    /// so, with the discretisation error of some members, which are marched here; else
    /// [partial](crate::study::uncertainty::Uncertainty::is_partial) ones.
    ///
    /// # Errors
    /// As [`March::march`](crate::march::March::march); the processor does not fail.
    pub fn answers(&self) -> Result<Answers, SessionError> {
        let ((_, first), Self { case, plan, sweep, .. }) = (&self.first, self);
        let mut outcome = self.statistics.results(&self.nominal, &sweep.sampling, sweep.members);
        if !outcome.is_partial() {
            let ensemble = sweep.ensemble(case);
            outcome.discretisation_error = sweep_error(case, plan, precision(first), &ensemble, &Monitor::default())?;
        }
        // The times of the marches are with the parts.
        let seconds =
            Timing { plan_s: 0.0, march_s: 0.0, other_s: self.began.elapsed().as_secs_f64(), start: self.began };
        let backend = march_backend(first, self.devices());
        let mut answers = Answers::new("merge", self.case.clone(), backend, seconds, self.run.clone());
        answers.seed = Some(first.draw.sampling.seed);
        answers.nominal = Some(self.nominal.clone());
        answers.uncertainty = Some(outcome);
        let Sweep { members, sampling: Sampling { kind: sampling, seed }, bounds: sampling_bounds } = first.draw;
        let draw = Draw { sampling, seed, sampling_bounds };
        let question = Uncertainty { members, draw, ..Uncertainty::default() };
        let session = SessionRecord::new(&BackendOptions::default(), &answers.backend, None);
        answers.asked = Some(QuestionRecord::new(&question.into(), &self.case, session, &self.run));
        Ok(answers)
    }

    /// The names of the devices, each once.
    fn devices(&self) -> String {
        let mut names: Vec<&str> = self.parts.iter().flat_map(|part| part.device.split("; ")).collect();
        names.sort_unstable();
        names.dedup();
        names.join("; ")
    }

    fn check_contiguous(&self, members: Range<usize>) -> Result<(), SessionError> {
        let all = self.first.1.draw.members;
        let missing =
            |start: usize, end: usize| Err(input_error(format!("no file has members {start}..{end} of all {all}")));
        let mut parts: Vec<&MergedPart> = self.parts.iter().collect();
        parts.sort_by_key(|part| (part.members.start, part.members.end));
        let mut next = members.start;
        for MergedPart { name, members, .. } in parts {
            let Range { start, end } = *members;
            if start >= end || end > all {
                return Err(damaged_part(name));
            }
            if start < next {
                return Err(input_error(format!(
                    "{name}: members {start}..{end} overlap another part, which ends at {next}"
                )));
            }
            if start > next {
                return missing(next, start);
            }
            next = end;
        }
        if next < members.end { missing(next, members.end) } else { Ok(()) }
    }
}

fn input_error(message: String) -> SessionError {
    InputError::general(message).into()
}

pub(super) fn no_parts() -> SessionError {
    InputError::general("no files to merge").into()
}

fn damaged_part(name: &str) -> SessionError {
    input_error(format!("{name}: damaged: its numbers do not agree with each other"))
}

fn other_case(name: &str, case: &Case, part: &Piece) -> SessionError {
    input_error(format!(
        "{name}: the case {:?} at {} is not the case of this file (fingerprint {}, expected {}): it has changed since, \
         or the merge was given another one",
        case.id,
        case.input_files().first().map_or("", |file| file.path.as_str()),
        fingerprint(case),
        part.case.fingerprint
    ))
}

/// Check that a part is of this version, and of the same case, samples, backend and nominal march as the first.
pub(super) fn check_same_sweep(
    (name, piece): (&str, &Piece),
    (first_name, first): (&str, &Piece),
) -> Result<(), SessionError> {
    let version = env!("CARGO_PKG_VERSION");
    if piece.run.version != version {
        let made = &piece.run.version;
        return Err(input_error(format!(
            "{name}: written by bondline {made}, expected {version}, the version that merges"
        )));
    }
    match difference(piece, first) {
        None => Ok(()),
        Some((what, found, expected)) => Err(input_error(format!(
            "{name} and {first_name} are not parts of one sweep: their {what} differ, {found} and {expected}"
        ))),
    }
}

/// The backend of a part, with this name.
fn march_backend(part: &Piece, name: String) -> Backend {
    Backend {
        name,
        kind: ["gpu", "software"].into_iter().find(|kind| *kind == part.backend.kind).unwrap_or("cpu"),
        driver: part.run.driver.clone(),
        precision: precision(part),
    }
}

fn precision(part: &Piece) -> Precision {
    if part.backend.precision == "f32" { Precision::F32 } else { Precision::F64 }
}
