//! The Parquet files of `--keep`, written batch by batch as members complete.

use crate::command::args::KeepArg;
use crate::command::exit::{Failure, input};
use crate::command::resume::Resumable;
use crate::ensemble::Ensemble;
use crate::report::ReportError;
use crate::report::files::{MemberRow, MembersFile, TracesFile};
use crate::session::Session;
use crate::session::{CancelToken, SessionError};
use crate::traces::{MemberStatus, Traces};
use std::fs;
use std::ops::Range;
use std::path::PathBuf;

/// The open files, and the error of writing them, which cancels the sweep.
pub(crate) struct MemberOutput {
    cancel: CancelToken,
    instants_s: Vec<f64>,
    members: Option<MembersFile>,
    traces: Option<TracesFile>,
    result: Result<(), ReportError>,
}

impl MemberOutput {
    /// Create the files, whose paths `path_of` states by name. Those of a part of the members have its range in their
    /// names, as parts may share a folder. Rows are kept beside the members of the checkpoint, and begin with those of
    /// the members that it has.
    pub(crate) fn create(
        path_of: &mut dyn FnMut(&str) -> Result<PathBuf, ReportError>,
        session: &Session,
        keep: Option<KeepArg>,
        part: Option<&Range<usize>>,
        resumable: Option<&Resumable>,
        cancel: &CancelToken,
    ) -> Result<Self, Failure> {
        let part = part.map_or(String::new(), |part| format!("-{}-{}", part.start, part.end));
        let (case, instants_s) = (session.case(), session.plan().instants_s().to_vec());
        let cancel = cancel.clone();
        let mut output = Self { cancel, instants_s, members: None, traces: None, result: Ok(()) };
        let (Some(keep), Some(Resumable { checkpoint, kept })) = (keep, resumable) else { return Ok(output) };
        let names: Vec<&str> = case.factors().iter().map(|factor| factor.name.as_str()).collect();
        let sensors: Vec<&str> = case.sensors().iter().map(|sensor| sensor.name.as_str()).collect();
        let folder = checkpoint.folder();
        fs::create_dir_all(folder).map_err(|source| ReportError::Io {
            operation: "making",
            path: folder.to_owned(),
            source,
        })?;
        let (count, end) = kept.as_ref().map_or((0, 0), |kept| (kept.range.len(), kept.range.end));
        let mut members = MembersFile::create(&path_of(&format!("members{part}.parquet"))?, &names, &sensors)?;
        let mut has_rows = members.keep_in(&folder.join("members.rows"), end)? == count;
        output.members = Some(members);
        if keep == KeepArg::Traces {
            let path = path_of(&format!("traces{part}.parquet"))?;
            let mut traces = TracesFile::create(&path, &sensors, &output.instants_s)?;
            let rows = traces.keep_in(&folder.join("traces.rows"), end)?;
            let completed = kept.as_ref().map_or(0, |kept| kept.completed);
            has_rows &= rows == completed * output.instants_s.len();
            output.traces = Some(traces);
        }
        if !has_rows {
            return Err(input(format!(
                "--keep: {} does not have the rows of its {count} members: leave out --keep, or start anew with \
                 --force",
                folder.display()
            )));
        }
        Ok(output)
    }

    /// Append a batch of members.
    pub(crate) fn append(&mut self, ensemble: &Ensemble, traces: &Traces) {
        if self.result.is_ok() {
            self.result = self.write(ensemble, traces);
        }
        if self.result.is_err() {
            self.cancel.cancel();
        }
    }

    /// The result of the sweep, unless the files could not be written.
    pub(crate) fn check<T>(&mut self, swept: Result<T, SessionError>) -> Result<T, Failure> {
        std::mem::replace(&mut self.result, Ok(()))?;
        Ok(swept?)
    }

    fn write(&mut self, ensemble: &Ensemble, traces: &Traces) -> Result<(), ReportError> {
        if let Some(file) = &mut self.members {
            for member in 0..traces.members() {
                file.append(&MemberRow {
                    member: traces.first + member,
                    completed: traces.statuses[member] == MemberStatus::Completed,
                    factors: &ensemble.member(traces.first + member),
                    peaks: traces.member_peaks(member),
                })?;
            }
            file.end_batch()?;
        }
        self.traces.as_mut().map_or(Ok(()), |file| file.append(traces))
    }

    /// Complete the files. `origin` says what made the rows.
    pub(crate) fn close(self, origin: &[(&str, String)]) -> Result<(), Failure> {
        if let Some(file) = self.members {
            file.close(origin)?;
        }
        if let Some(file) = self.traces {
            file.close(origin)?;
        }
        Ok(())
    }
}
