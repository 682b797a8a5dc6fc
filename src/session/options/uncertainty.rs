//! Options of a Monte Carlo sweep.

use super::check_limit;
use crate::case::{Bounds, Case};
use crate::ensemble::{Sampling, SamplingKind};
use crate::limits::{MEMBERS, STATISTICS_MIB};
use crate::plan::instants_s;
use crate::session::error::{InputError, SessionError};
use crate::study::sweep_piece::SamplingRecord;
use crate::study::uncertainty::Sweep;
use crate::study::{margins, statistics};

/// A Monte Carlo sweep over the factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UncertaintyOptions {
    /// Number of members, at least two.
    pub members: usize,
    /// Sampling method and distribution.
    pub sampling: SamplingKind,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Bounds between which members are sampled.
    pub bounds: Bounds,
}

impl Default for UncertaintyOptions {
    fn default() -> Self {
        Self { members: 5000, sampling: SamplingKind::Normal, seed: 1, bounds: Bounds::Small }
    }
}

impl From<&UncertaintyOptions> for SamplingRecord {
    fn from(options: &UncertaintyOptions) -> Self {
        let UncertaintyOptions { members, sampling, seed, bounds } = *options;
        Self { members, sampling: sampling.name().to_owned(), seed, bounds: bounds.name().to_owned() }
    }
}

impl UncertaintyOptions {
    pub(in crate::session) fn sweep(&self) -> Sweep {
        let sampling = Sampling { kind: self.sampling, seed: self.seed };
        Sweep { members: self.members, sampling, bounds: self.bounds }
    }

    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::uncertainty`](crate::Session::uncertainty) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        if case.factors.is_empty() {
            return Err(InputError::general("the case has no factors to vary").into());
        }
        if self.members < 2 {
            let message = format!(" {}: expected at least 2 members for a standard deviation", self.members);
            return Err(InputError::for_option("members", message).into());
        }
        check_limit(&MEMBERS, self.members as f64, "members")?;
        let (sensors, instants, factors) = (case.sensors.len(), instants_s(case).len(), case.factors.len());
        let margins = self.members as f64 * margins::bytes_per_member(case.limits.len());
        let mebibytes = (statistics::bytes(sensors, instants, factors) + margins) / f64::from(1 << 20);
        STATISTICS_MIB.check(mebibytes).map_err(|message| {
            let kept = format!("of {sensors} sensors at {instants} instants, with {factors} factors");
            let (limits, members) = (case.limits.len(), self.members);
            let (and, fewer) = match limits {
                0 => (String::new(), ""),
                _ => (format!(", and {members} peaks for each of {limits} limits"), "take fewer members, "),
            };
            InputError::general(format!(
                "{message} {kept}{and}: {fewer}leave out sensors or lengthen `resolution.output_interval`"
            ))
            .into()
        })
    }
}
