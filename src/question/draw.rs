//! How the members of a Monte Carlo sweep are drawn.

use super::error::{InputError, check_limit};
use super::quantity;
use crate::case::{Bounds, Case};
use crate::ensemble::{Sampling, SamplingKind};
use crate::limits::{MEMBERS, STATISTICS_MIB};
use crate::plan::instants_s;
use crate::statistics;
use crate::study::margins;
use crate::study::uncertainty::Sweep;
use serde::{Deserialize, Serialize};

/// Distribution, seed and bounds of the members of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct Draw {
    /// Sampling method and distribution
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t = Draw::default().sampling))]
    pub sampling: SamplingKind,
    /// Seed of the random numbers
    #[cfg_attr(feature = "command", arg(long, default_value_t = Draw::default().seed))]
    #[serde(with = "quantity::seed")]
    pub seed: u64,
    /// Bounds of the factors between which members are sampled
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t = Draw::default().sampling_bounds))]
    pub sampling_bounds: Bounds,
}

impl Default for Draw {
    fn default() -> Self {
        Self { sampling: SamplingKind::Normal, seed: 1, sampling_bounds: Bounds::Small }
    }
}

impl Draw {
    /// The sweep of a number of members.
    pub(crate) fn sweep(self, members: usize) -> Sweep {
        let Self { sampling: kind, seed, sampling_bounds: bounds } = self;
        Sweep { members, sampling: Sampling { kind, seed }, bounds }
    }
}

/// Check a number of members for the statistics of a case.
pub(super) fn check_members(members: usize, case: &Case) -> Result<(), InputError> {
    if case.factors.is_empty() {
        return Err(InputError::general("the case has no factors to vary"));
    }
    if members < 2 {
        let message = format!(" {members}: expected at least 2 members for a standard deviation");
        return Err(InputError::for_option("members", message));
    }
    check_limit(&MEMBERS, members as f64, "members")?;
    let (sensors, instants, factors) = (case.sensors.len(), instants_s(case).len(), case.factors.len());
    let margins = members as f64 * margins::bytes_per_member(case.limits.len());
    let mebibytes = (statistics::bytes(sensors, instants, factors) + margins) / f64::from(1 << 20);
    STATISTICS_MIB.check(mebibytes).map_err(|message| {
        let kept = format!("of {sensors} sensors at {instants} instants, with {factors} factors");
        let limits = case.limits.len();
        let (and, fewer) = match limits {
            0 => (String::new(), ""),
            _ => (format!(", and {members} peaks for each of {limits} limits"), "take fewer members, "),
        };
        InputError::general(format!(
            "{message} {kept}{and}: {fewer}leave out sensors or lengthen `resolution.output_interval`"
        ))
    })
}
