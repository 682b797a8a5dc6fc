//! The question of `size`: the thickness of a ply for a temperature limit.

use super::draw::Draw;
use super::error::{InputError, check_limit, index_of, is_positive};
use super::quantity;
use crate::case::unit::{Dimension, parse_quantity};
use crate::case::{Case, LimitedPart, TemperatureLimit};
use crate::fit::proportion::min_draws_for_upper_bound;
use crate::limits::MEMBERS;
use crate::study::size::SizingRequirement;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A limit of the peak temperature of a part: `TC4 < 623 K`, or `TC4` with its limit in the case.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// A sensor, a ply (its hottest point), or an interface, `INS2/GB` (the hotter face). A name that several have is
    /// that of the sensor.
    pub part: String,
    /// The limit, K; `None`: that of the case.
    pub limit_k: Option<f64>,
}

impl Limit {
    /// A limit of a part.
    pub fn new(part: impl Into<String>, limit_k: f64) -> Self {
        Self { part: part.into(), limit_k: Some(limit_k) }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.limit_k {
            Some(limit_k) => write!(formatter, "{} < {limit_k} K", self.part),
            None => write!(formatter, "{}", self.part),
        }
    }
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((part, limit)) = text.split_once('<') else {
            return Ok(Self { part: text.trim().to_owned(), limit_k: None });
        };
        let limit_k = parse_quantity(limit.trim_start_matches('=').trim(), Dimension::LayupTemperature)?;
        Ok(Self::new(part.trim(), limit_k))
    }
}

/// The limit that a sized ply holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default)]
pub struct Requirement {
    /// Limit of the peak temperature of a sensor, of a ply (hottest point) or of an interface (hotter face), as "TC4 <
    /// 623 K" or "INS2/GB < 623 K", or "TC4" with its limit in the case [default: the one sensor with a limit in the
    /// case, or else its one limit]
    #[cfg_attr(feature = "command", arg(long))]
    #[serde(with = "quantity::text")]
    pub limit: Option<Limit>,
    /// Required probability that a member stays below the limit
    #[cfg_attr(feature = "command", arg(long, default_value_t = Requirement::default().probability))]
    pub probability: f64,
    /// Smallest and largest thickness, as "3 mm:20 mm" [default: 1/4 to 4 times the thickness in the case]
    #[cfg_attr(feature = "command", arg(
        id = "thickness_range", long = "thickness-range", value_name = "THINNEST:THICKEST",
        value_parser = quantity::length_range
    ))]
    #[serde(rename = "thickness_range", with = "quantity::length")]
    pub thickness_range_m: Option<(f64, f64)>,
}

impl Default for Requirement {
    fn default() -> Self {
        Self { limit: None, probability: 0.99, thickness_range_m: None }
    }
}

impl Requirement {
    /// The requirement on a ply of a case, for a number of members.
    pub(super) fn of(&self, ply: &str, case: &Case, members: usize) -> Result<SizingRequirement, InputError> {
        let Self { probability, thickness_range_m, .. } = *self;
        let (part, limit_k) = match &self.limit {
            Some(Limit { part, limit_k: Some(limit_k) }) => (part.clone(), *limit_k),
            Some(limit) => stated_limit(case, Some(&limit.part)).map_err(|_| {
                let expected = "expected PART < TEMPERATURE, such as \"TC4 < 623 K\", or a part with one limit in the \
                                case";
                InputError::for_option("limit", format!(" {:?}: {expected}", limit.part))
            })?,
            None => stated_limit(case, None)?,
        };
        let parts = LimitedPart::all(&case.layup, &case.sensors);
        let names: Vec<String> = parts.iter().map(|part| part.name(&case.layup, &case.sensors)).collect();
        let names = names.iter().map(String::as_str);
        let part = parts[index_of(names, &part, "limit", "sensor, ply or interface")?];
        if !is_positive(limit_k) {
            return Err(InputError::for_option("limit", format!(" {limit_k}: expected a temperature above 0 K")));
        }
        if !(probability > 0.0 && probability < 1.0) {
            let message = format!(" {probability}: expected a probability between 0 and 1, such as 0.99");
            return Err(InputError::for_option("probability", message));
        }
        if let Some((low_m, high_m)) = thickness_range_m.filter(|&(low_m, high_m)| !(low_m > 0.0 && low_m < high_m)) {
            let message =
                format!(" {:.3} mm to {:.3} mm: expected 0 < smallest < largest thickness", 1e3 * low_m, 1e3 * high_m);
            return Err(InputError::for_option("thickness_range", message));
        }
        let fewest = min_draws_for_upper_bound(probability).max(2);
        check_limit(&MEMBERS, members as f64, "members")?;
        if members < fewest {
            let message = format!(
                " {members}: a probability of {probability} needs at least {fewest} members; with fewer, the chance \
                 that none of them exceeds the quantile is above 2.5 %"
            );
            return Err(InputError::for_option("members", message));
        }
        Ok(SizingRequirement { ply: ply.to_owned(), part, limit_k, probability, thickness_range_m })
    }
}

/// The limit that a case states for a part; without a name that of the one sensor with a limit, or the one limit of a
/// case without such a sensor.
fn stated_limit(case: &Case, part: Option<&str>) -> Result<(String, f64), InputError> {
    let is_sensor = |limit: &&TemperatureLimit| matches!(limit.part, LimitedPart::Sensor(_));
    let sensors_alone = part.is_none() && case.limits.iter().any(|limit| is_sensor(&limit));
    let limits = case.limits.iter().filter(|limit| !sensors_alone || is_sensor(limit));
    let limits = limits.map(|limit| (limit.part.name(&case.layup, &case.sensors), limit.limit_k));
    let stated: Vec<(String, f64)> = limits.filter(|(name, _)| part.is_none_or(|part| part == name)).collect();
    if let [(part, limit_k)] = &stated[..] {
        return Ok((part.clone(), *limit_k));
    }
    let names: Vec<&str> = stated.iter().map(|(name, _)| name.as_str()).collect();
    let message = match names.len() {
        0 => ": no part has a limit in the case: state one".to_owned(),
        _ => format!(": several parts have a limit in the case: choose one of {}", names.join(", ")),
    };
    Err(InputError::for_option("limit", message))
}

/// Thickness of a ply for a temperature limit: nominal, and with a margin for uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Size {
    /// Ply to size, or a group whose plies are scaled together
    #[cfg_attr(feature = "command", arg(long))]
    pub ply: String,
    /// The limit that it holds.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub requirement: Requirement,
    /// Number of members (random samples of the factors)
    #[cfg_attr(feature = "command", arg(
        short = 'n',
        value_name = "MEMBERS",
        default_value_t = Size::default().members,
        value_parser = quantity::count::parse
    ))]
    #[serde(with = "quantity::count")]
    pub members: usize,
    /// How they are drawn.
    #[cfg_attr(feature = "command", command(flatten))]
    #[serde(flatten)]
    pub draw: Draw,
}

impl Default for Size {
    fn default() -> Self {
        Self { ply: String::new(), requirement: Requirement::default(), members: 5000, draw: Draw::default() }
    }
}

impl Size {
    /// A limit that 99 % of 5,000 members must stay below.
    pub fn new(ply: impl Into<String>, part: impl Into<String>, limit_k: f64) -> Self {
        let requirement = Requirement { limit: Some(Limit::new(part, limit_k)), ..Requirement::default() };
        Self { ply: ply.into(), requirement, ..Self::default() }
    }

    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong, or the case has no such ply, part or limit.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        self.resolved(case).map(|_| ())
    }

    pub(crate) fn resolved(&self, case: &Case) -> Result<SizingRequirement, InputError> {
        plies_of(case, &self.ply, "ply")?;
        self.requirement.of(&self.ply, case, self.members)
    }
}

/// The plies of a group or name, of which there must be one.
pub(super) fn plies_of(case: &Case, name: &str, option: &'static str) -> Result<Vec<usize>, InputError> {
    let plies = case.plies_of(name);
    if plies.is_empty() {
        let mut known: Vec<&str> =
            case.layup.plies.iter().flat_map(|ply| [ply.group.as_str(), ply.name.as_str()]).collect();
        known.sort_unstable();
        known.dedup();
        let message = format!(" {name:?}: no ply or group has this name; there are {}", known.join(", "));
        return Err(InputError::for_option(option, message));
    }
    Ok(plies)
}
