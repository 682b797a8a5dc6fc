//! Options of sizing.

use super::{UncertaintyOptions, is_positive};
use crate::case::{Case, LimitedPart, TemperatureLimit};
use crate::fit::proportion::min_draws_for_upper_bound;
use crate::session::error::{InputError, SessionError, index_of};
use crate::study::size::SizingRequirement;

/// The thickness of a ply that keeps a part of the layup below a temperature limit.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeOptions {
    /// A ply, or a group whose plies are scaled together.
    pub ply: String,
    /// The part whose peak temperature is limited: a sensor, a ply (its hottest point), or an interface, `INS2/GB` (the
    /// hotter face). A name that several have is that of the sensor.
    pub part: String,
    /// The limit, K.
    pub limit_k: f64,
    /// The required probability that a member stays below the limit.
    pub probability: f64,
    /// The smallest and the largest thickness, m; `None`: 1/4 to 4 times the thickness in the case.
    pub thickness_range_m: Option<(f64, f64)>,
    /// The Monte Carlo sweep.
    pub sweep: UncertaintyOptions,
}

impl SizeOptions {
    /// A limit that 99 % of 5,000 members must stay below.
    pub fn new(ply: impl Into<String>, part: impl Into<String>, limit_k: f64) -> Self {
        Self {
            ply: ply.into(),
            part: part.into(),
            limit_k,
            probability: 0.99,
            thickness_range_m: None,
            sweep: UncertaintyOptions::default(),
        }
    }

    /// The limit that a case states for a part, which 99 % of 5,000 members must stay below; without a name that of the
    /// one sensor with a limit, or the one limit of a case without such a sensor.
    ///
    /// # Errors
    /// When no such part, or more than one, has a limit in the case.
    pub fn with_stated_limit(ply: impl Into<String>, case: &Case, part: Option<&str>) -> Result<Self, SessionError> {
        let is_sensor = |limit: &&TemperatureLimit| matches!(limit.part, LimitedPart::Sensor(_));
        let sensors_alone = part.is_none() && case.limits.iter().any(|limit| is_sensor(&limit));
        let limits = case.limits.iter().filter(|limit| !sensors_alone || is_sensor(limit));
        let limits = limits.map(|limit| (limit.part.name(&case.layup, &case.sensors), limit.limit_k));
        let stated: Vec<(String, f64)> = limits.filter(|(name, _)| part.is_none_or(|part| part == name)).collect();
        if let [(part, limit_k)] = &stated[..] {
            return Ok(Self::new(ply, part, *limit_k));
        }
        let names: Vec<&str> = stated.iter().map(|(name, _)| name.as_str()).collect();
        let message = match names.len() {
            0 => ": no part has a limit in the case: state one".to_owned(),
            _ => format!(": several parts have a limit in the case: choose one of {}", names.join(", ")),
        };
        Err(InputError::for_option("limit_k", message).into())
    }

    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::size`](crate::Session::size) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.requirement(case).map(|_| ())
    }

    pub(in crate::session) fn requirement(&self, case: &Case) -> Result<SizingRequirement, SessionError> {
        let Self {
            limit_k, probability, thickness_range_m: within_m, sweep: UncertaintyOptions { members, .. }, ..
        } = *self;
        let parts = LimitedPart::all(&case.layup, &case.sensors);
        let names: Vec<String> = parts.iter().map(|part| part.name(&case.layup, &case.sensors)).collect();
        let names = names.iter().map(String::as_str);
        let part = parts[index_of(names, &self.part, "limit_k", "sensor, ply or interface")?];
        if !is_positive(limit_k) {
            return Err(
                InputError::for_option("limit_k", format!(" {limit_k}: expected a temperature above 0 K")).into()
            );
        }
        if !(probability > 0.0 && probability < 1.0) {
            let message = format!(" {probability}: expected a probability between 0 and 1, such as 0.99");
            return Err(InputError::for_option("probability", message).into());
        }
        if let Some((low_m, high_m)) = within_m.filter(|&(low_m, high_m)| !(low_m > 0.0 && low_m < high_m)) {
            let message =
                format!(" {:.3} mm to {:.3} mm: expected 0 < smallest < largest thickness", 1e3 * low_m, 1e3 * high_m);
            return Err(InputError::for_option("thickness_range_m", message).into());
        }
        let fewest = min_draws_for_upper_bound(probability).max(2);
        if members < fewest {
            return Err(InputError::for_option(
                "members",
                format!(
                    " {members}: a probability of {probability} needs at least {fewest} members; with fewer, the \
                     chance that none of them exceeds the quantile is above 2.5 %"
                ),
            )
            .into());
        }
        Ok(SizingRequirement { ply: self.ply.clone(), part, limit_k, probability, thickness_range_m: within_m })
    }
}
