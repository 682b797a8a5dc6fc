//! The Parquet files of `--keep`, written batch by batch as members complete.

use crate::command::args::KeepArg;
use crate::command::exit::Failure;
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::plan::Plan;
use bondline::report::ReportError;
use bondline::report::files::{MemberRow, MembersFile, OutputFolder, TracesFile};
use bondline::study::nominal::Peak;
use bondline::traces::{MemberStatus, Traces};
use std::ops::Range;

/// The open files, and the first error of writing them.
pub(crate) struct MemberOutput {
    instants_s: Vec<f64>,
    members: Option<MembersFile>,
    traces: Option<TracesFile>,
    result: Result<(), ReportError>,
}

impl MemberOutput {
    /// Create the files. Those of a part of the members have its range in their names, as parts may share a folder.
    pub(crate) fn create(
        folder: &mut OutputFolder,
        case: &Case,
        plan: &Plan,
        keep: Option<KeepArg>,
        part: Option<&Range<usize>>,
    ) -> Result<Self, Failure> {
        let part = part.map_or(String::new(), |part| format!("-{}-{}", part.start, part.end));
        let names: Vec<&str> = case.factors().iter().map(|factor| factor.name.as_str()).collect();
        let sensors: Vec<&str> = case.sensors().iter().map(|sensor| sensor.name.as_str()).collect();
        let members = match keep {
            Some(_) => {
                Some(MembersFile::create(&folder.reserve(&format!("members{part}.parquet"))?, &names, &sensors)?)
            }
            None => None,
        };
        let traces = match keep {
            Some(KeepArg::Traces) => Some(TracesFile::create(
                &folder.reserve(&format!("traces{part}.parquet"))?,
                &sensors,
                plan.instants_s(),
            )?),
            _ => None,
        };
        Ok(Self { instants_s: plan.instants_s().to_vec(), members, traces, result: Ok(()) })
    }

    /// Append a batch of members. An error is returned by [`close`](Self::close), as the march does not stop for it.
    pub(crate) fn append(&mut self, ensemble: &Ensemble, traces: &Traces) {
        if self.result.is_ok() {
            self.result = self.write(ensemble, traces);
        }
    }

    fn write(&mut self, ensemble: &Ensemble, traces: &Traces) -> Result<(), ReportError> {
        if let Some(file) = &mut self.members {
            for member in 0..traces.members() {
                let peak = |sensor| Peak::of(traces.trace(member, sensor), &self.instants_s);
                file.append(&MemberRow {
                    member: traces.first + member,
                    completed: traces.statuses[member] == MemberStatus::Completed,
                    factors: &ensemble.member(traces.first + member),
                    peaks: &(0..traces.sensors).map(peak).collect::<Vec<Peak>>(),
                })?;
            }
        }
        self.traces.as_mut().map_or(Ok(()), |file| file.append(traces))
    }

    pub(crate) fn close(self) -> Result<(), Failure> {
        self.result?;
        if let Some(file) = self.members {
            file.close()?;
        }
        if let Some(file) = self.traces {
            file.close()?;
        }
        Ok(())
    }
}
