//! The question of `design`: the next experiment.

use super::error::{InputError, check_limit, check_nonnegative, index_of, is_positive};
use super::named_case::{self, NamedCase};
use super::quantity;
use crate::case::{Bounds, Case, Observation};
use crate::fit::optimal_design::{Criterion, Robustness};
use crate::limits::{MEMBERS, SENSORS, STATISTICS_MIB};
use serde::{Deserialize, Serialize};

/// The next experiment: depths of thermocouples, exposure and run length for the smallest standard errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "command", derive(clap::Args))]
#[serde(default, deny_unknown_fields)]
pub struct Design {
    /// Further cases as alternative exposures of the same factors
    #[cfg_attr(feature = "command", arg(value_name = "CASE", value_parser = named_case::parser()))]
    pub others: Vec<NamedCase>,
    /// Factors to estimate, as a,b,c [default: those of the case]
    #[cfg_attr(feature = "command", arg(
        id = "estimate", long = "estimate", value_name = "FACTORS", value_delimiter = ',', value_parser = quantity::name
    ))]
    #[serde(rename = "estimate", with = "quantity::list")]
    pub factors: Vec<String>,
    /// Number of thermocouples
    #[cfg_attr(feature = "command", arg(long, default_value_t = Design::default().sensors))]
    pub sensors: usize,
    /// Criterion of the design
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t = Design::default().criterion))]
    pub criterion: Criterion,
    /// Take the criterion over the worst 5 % of the members in place of all
    #[cfg_attr(feature = "command", arg(long))]
    pub worst: bool,
    /// Sensor whose peak is predicted with the estimate [default: the deepest one]
    #[cfg_attr(feature = "command", arg(long))]
    pub target: Option<String>,
    /// Distance of the candidate depths inside plies, as "0.5 mm"; interfaces are candidates too [default: 1/24 of the
    /// layup]
    #[cfg_attr(feature = "command", arg(
        id = "grid", long = "grid", value_name = "LENGTH", value_parser = quantity::length::parse
    ))]
    #[serde(rename = "grid", with = "quantity::length")]
    pub grid_m: Option<f64>,
    /// Smallest distance of two thermocouples
    #[cfg_attr(feature = "command", arg(
        id = "least_distance", long = "least-distance", value_name = "LENGTH", value_parser = quantity::length::parse,
        default_value = quantity::length::text(Design::default().least_distance_m)
    ))]
    #[serde(rename = "least_distance", with = "quantity::length")]
    pub least_distance_m: f64,
    /// Standard deviation of the depth of a thermocouple
    #[cfg_attr(feature = "command", arg(
        id = "position_tolerance", long = "position-tolerance", value_name = "LENGTH",
        value_parser = quantity::length::parse,
        default_value = quantity::length::text(Design::default().position_tolerance_m)
    ))]
    #[serde(rename = "position_tolerance", with = "quantity::length")]
    pub position_tolerance_m: f64,
    /// Time between two samples, as "0.5 s" [default: the output interval of the case]
    #[cfg_attr(feature = "command", arg(
        id = "sampling", long = "sampling", value_name = "TIME", value_parser = quantity::time::parse
    ))]
    #[serde(rename = "sampling", with = "quantity::time")]
    pub sampling_s: Option<f64>,
    /// Standard deviation of a sample, with its unit [default: that of the residuals of the observations, or 2 K
    /// without any]
    #[cfg_attr(feature = "command", arg(
        id = "noise", long = "noise", value_name = "DIFFERENCE", value_parser = quantity::temperature_difference::parse
    ))]
    #[serde(rename = "noise", with = "quantity::temperature_difference")]
    pub noise_k: Option<f64>,
    /// Correlation time τ of the noise, with its unit: the autocorrelation is exp(-t/τ); "0 s" is white noise [default:
    /// that of the residuals of the observations, or white noise without any]
    #[cfg_attr(feature = "command", arg(
        id = "correlation_time", long = "correlation-time", value_name = "TIME", value_parser = quantity::time::parse
    ))]
    #[serde(rename = "correlation_time", with = "quantity::time")]
    pub correlation_time_s: Option<f64>,
    /// Lengths of the run to compare, as "60s,120s" [default: the duration of the case]
    #[cfg_attr(feature = "command", arg(
        id = "run_lengths", long = "run-lengths", value_name = "TIMES", value_delimiter = ',',
        value_parser = quantity::time::parse
    ))]
    #[serde(rename = "run_lengths", with = "quantity::time")]
    pub run_lengths_s: Vec<f64>,
    /// Number of members drawn from the prior of the factors
    #[cfg_attr(feature = "command", arg(
        short = 'n',
        value_name = "MEMBERS",
        default_value_t = Design::default().members,
        value_parser = quantity::count::parse
    ))]
    #[serde(with = "quantity::count")]
    pub members: usize,
    /// Seed of the random numbers
    #[cfg_attr(feature = "command", arg(long, default_value_t = Design::default().seed))]
    #[serde(with = "quantity::seed")]
    pub seed: u64,
    /// Bounds of the factors between which members are sampled
    #[cfg_attr(feature = "command", arg(long, value_enum, default_value_t = Design::default().sampling_bounds))]
    pub sampling_bounds: Bounds,
}

impl Default for Design {
    fn default() -> Self {
        Self {
            others: Vec::new(),
            factors: Vec::new(),
            sensors: 4,
            criterion: Criterion::D,
            worst: false,
            target: None,
            grid_m: None,
            least_distance_m: 0.5e-3,
            position_tolerance_m: 0.0,
            sampling_s: None,
            noise_k: None,
            correlation_time_s: None,
            run_lengths_s: Vec::new(),
            members: 1000,
            seed: 1,
            sampling_bounds: Bounds::Small,
        }
    }
}

impl Design {
    /// The D-optimal design of a number of thermocouples for factors, over 1,000 members.
    pub fn new(factors: impl IntoIterator<Item = impl Into<String>>, sensors: usize) -> Self {
        Self { factors: factors.into_iter().map(Into::into).collect(), sensors, ..Self::default() }
    }

    /// How the criterion is taken over the members.
    pub fn robustness(&self) -> Robustness {
        if self.worst { Robustness::Worst } else { Robustness::Mean }
    }

    /// Check the question for a case, before any computation.
    ///
    /// # Errors
    /// When an option is wrong, or a case lacks a factor or the target.
    pub fn check(&self, case: &Case) -> Result<(), InputError> {
        named_case::distinct(case, &self.others)?;
        self.resolved(case).map(|_| ())
    }

    /// The question with what a case states in place of what it leaves open: factors, target and order of run lengths.
    pub(crate) fn resolved(&self, case: &Case) -> Result<Self, InputError> {
        let names = || case.factors.iter().map(|factor| factor.name.as_str());
        let stated = || case.estimate.factors.iter().map(|&factor| case.factors[factor].name.clone()).collect();
        let factors: Vec<String> = if self.factors.is_empty() { stated() } else { self.factors.clone() };
        if factors.is_empty() {
            let message =
                format!(": none given and none in the case; there are {}", names().collect::<Vec<_>>().join(", "));
            return Err(InputError::for_option("estimate", message));
        }
        for (place, name) in factors.iter().enumerate() {
            let factor = index_of(names(), name, "estimate", "factor")?;
            if factors[..place].contains(name) {
                return Err(InputError::for_option("estimate", format!(": {name:?} is listed twice")));
            }
            if case.factors[factor].prior_standard_deviation(self.sampling_bounds) <= 0.0 {
                let message = format!(": {name:?} is fixed by its bounds, so there is nothing to estimate");
                return Err(InputError::for_option("estimate", message));
            }
        }
        if self.sensors == 0 {
            return Err(InputError::for_option("sensors", " 0: expected at least 1"));
        }
        check_limit(&SENSORS, self.sensors as f64, "sensors")?;
        let lengths = [
            ("grid", self.grid_m.unwrap_or(1.0), "m"),
            ("noise", self.noise_k.unwrap_or(1.0), "K"),
            ("sampling", self.sampling_s.unwrap_or(1.0), "s"),
        ];
        let run_lengths = self.run_lengths_s.iter().map(|&run_s| ("run_lengths", run_s, "s"));
        for (option, value, unit) in lengths.into_iter().chain(run_lengths) {
            if !is_positive(value) {
                return Err(InputError::for_option(option, format!(" {value}: expected more than 0 {unit}")));
            }
        }
        check_noise(self.noise_k.unwrap_or(1.0))?;
        check_nonnegative("least_distance", self.least_distance_m, "m")?;
        check_nonnegative("position_tolerance", self.position_tolerance_m, "m")?;
        check_nonnegative("correlation_time", self.correlation_time_s.unwrap_or(0.0), "s")?;
        if self.members < 2 {
            let message = format!(" {}: expected at least 2 members of the prior", self.members);
            return Err(InputError::for_option("members", message));
        }
        check_limit(&MEMBERS, self.members as f64, "members")?;
        let triangle = factors.len() * (factors.len() + 1) / 2;
        let numbers = self.members * SENSORS.max as usize * triangle * self.run_lengths_s.len().max(1);
        STATISTICS_MIB.check(16.0 * numbers as f64 / f64::from(1 << 20)).map_err(|message| {
            let what = format!("{} members, {} factors", self.members, factors.len());
            InputError::general(format!("{message} of {what}: take fewer members, factors or run lengths"))
        })?;
        let names = case.sensors.iter().map(|sensor| sensor.name.as_str());
        let deepest = |a: &usize, b: &usize| case.sensors[*a].depth_m.total_cmp(&case.sensors[*b].depth_m);
        let target = match &self.target {
            Some(name) => index_of(names, name, "target", "sensor")?,
            None => (0..case.sensors.len())
                .max_by(deepest)
                .ok_or_else(|| InputError::general("the case has no sensor whose peak is predicted"))?,
        };
        let mut run_lengths_s = self.run_lengths_s.clone();
        run_lengths_s.sort_by(f64::total_cmp);
        run_lengths_s.dedup();
        let target = Some(case.sensors[target].name.clone());
        Ok(Self { factors, target, run_lengths_s, ..self.clone() })
    }
}

/// A standard deviation of a sample that a design can use.
pub(crate) fn check_noise(noise_k: f64) -> Result<(), InputError> {
    Observation::checked_sigma_k(noise_k)
        .map(drop)
        .map_err(|message| InputError::for_option("noise", format!(": {message}")))
}
