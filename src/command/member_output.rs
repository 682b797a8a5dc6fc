//! What `--keep` asks to keep of every member, in files that are written while the members come.

use crate::command::args::Keep;
use crate::command::exit::Failure;
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::plan::Plan;
use bondline::report::ReportError;
use bondline::report::files::{MembersFile, OutputFolder, Row, TracesFile};
use bondline::study::nominal::Peak;
use bondline::traces::{Arrival, Traces};
use std::ops::Range;

/// The files that are being written, and the first trouble with them.
pub(crate) struct Kept {
    instants_s: Vec<f64>,
    members: Option<MembersFile>,
    traces: Option<TracesFile>,
    trouble: Result<(), ReportError>,
}

impl Kept {
    /// Begin the files; those of a part of the members are named after it, as other parts may go to the same folder.
    pub(crate) fn open(
        folder: &mut OutputFolder,
        case: &Case,
        plan: &Plan,
        keep: Option<Keep>,
        part: Option<&Range<usize>>,
    ) -> Result<Self, Failure> {
        let part = part.map_or(String::new(), |part| format!("-{}-{}", part.start, part.end));
        let names: Vec<&str> = case.factors().iter().map(|factor| factor.name.as_str()).collect();
        let sensors: Vec<&str> = case.sensors().iter().map(|sensor| sensor.name.as_str()).collect();
        let members = match keep {
            Some(_) => Some(MembersFile::create(&folder.claim(&format!("members{part}.parquet"))?, &names, &sensors)?),
            None => None,
        };
        let traces = match keep {
            Some(Keep::Traces) => {
                Some(TracesFile::create(&folder.claim(&format!("traces{part}.parquet"))?, &sensors, plan.instants_s())?)
            }
            _ => None,
        };
        Ok(Self { instants_s: plan.instants_s().to_vec(), members, traces, trouble: Ok(()) })
    }

    /// Keep a run of members. Trouble is told at the end, as a march has no room for it.
    pub(crate) fn take(&mut self, ensemble: &Ensemble, traces: &Traces) {
        if self.trouble.is_ok() {
            self.trouble = self.append(ensemble, traces);
        }
    }

    fn append(&mut self, ensemble: &Ensemble, traces: &Traces) -> Result<(), ReportError> {
        if let Some(file) = &mut self.members {
            for member in 0..traces.members() {
                let peak = |sensor| Peak::of(traces.trace(member, sensor), &self.instants_s);
                file.append(&Row {
                    member: traces.first + member,
                    arrived: traces.arrivals[member] == Arrival::Done,
                    factors: &ensemble.member(traces.first + member),
                    peaks: &(0..traces.sensors).map(peak).collect::<Vec<Peak>>(),
                })?;
            }
        }
        self.traces.as_mut().map_or(Ok(()), |file| file.append(traces))
    }

    pub(crate) fn close(self) -> Result<(), Failure> {
        self.trouble?;
        if let Some(file) = self.members {
            file.close()?;
        }
        if let Some(file) = self.traces {
            file.close()?;
        }
        Ok(())
    }
}
