//! Options of the design of an experiment.

use super::{check_limit, is_positive};
use crate::case::{Bounds, Case, Observation};
use crate::fit::optimal_design::{Criterion, Robustness};
use crate::limits::{MEMBERS, SENSORS, STATISTICS_MIB};
use crate::session::error::{InputError, SessionError, index_of};
use crate::study::experiment_design::{DesignRequest, SampleNoise};

/// The depths of thermocouples, the exposure and the run length from which factors are estimated best.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignOptions {
    /// Names of the factors to estimate; empty for those of the case.
    pub factors: Vec<String>,
    /// Number of thermocouples.
    pub sensors: usize,
    /// Other cases as alternative exposures, with the same factors and the sensor `target`.
    pub others: Vec<Case>,
    /// Distance of the candidate depths inside the plies, m; `None` for 1/24 of the layup.
    pub grid_m: Option<f64>,
    /// Smallest distance of two thermocouples, m.
    pub least_distance_m: f64,
    /// Standard deviation of the depth of a thermocouple, m.
    pub position_tolerance_m: f64,
    /// Time between two samples, s; `None` for the output interval of the case.
    pub sampling_s: Option<f64>,
    /// Standard deviation of a sample, K; `None` for that of the residuals of an estimate from the observations of the
    /// case, or 2 K without any.
    pub noise_k: Option<f64>,
    /// Correlation time of the noise of a sample, s, zero for white noise; `None` for that of these residuals, or white
    /// noise without any.
    pub correlation_s: Option<f64>,
    /// Lengths of the run, s; empty for the duration of the case.
    pub run_lengths_s: Vec<f64>,
    /// The criterion.
    pub criterion: Criterion,
    /// Over the members of the prior.
    pub robustness: Robustness,
    /// The sensor whose peak is predicted afterwards; `None` for the deepest one.
    pub target: Option<String>,
    /// Members drawn from the prior.
    pub members: usize,
    /// Seed of the members and of the starts of the search.
    pub seed: u64,
    /// Bounds between which members are drawn.
    pub bounds: Bounds,
}

impl DesignOptions {
    /// The D-optimal design of a number of thermocouples for factors, over 1,000 members.
    pub fn new(factors: impl IntoIterator<Item = impl Into<String>>, sensors: usize) -> Self {
        Self {
            factors: factors.into_iter().map(Into::into).collect(),
            sensors,
            others: Vec::new(),
            grid_m: None,
            least_distance_m: 0.5e-3,
            position_tolerance_m: 0.0,
            sampling_s: None,
            noise_k: None,
            correlation_s: None,
            run_lengths_s: Vec::new(),
            criterion: Criterion::D,
            robustness: Robustness::Mean,
            target: None,
            members: 1000,
            seed: 1,
            bounds: Bounds::Small,
        }
    }

    /// Check the options for a case, before any computation.
    ///
    /// # Errors
    /// As [`Session::design`](crate::Session::design) for its input.
    pub fn check(&self, case: &Case) -> Result<(), SessionError> {
        self.request(case).map(|_| ())
    }

    pub(in crate::session) fn request(&self, case: &Case) -> Result<DesignRequest, SessionError> {
        let names = || case.factors.iter().map(|factor| factor.name.as_str());
        let stated = || case.estimate.factors.iter().map(|&factor| case.factors[factor].name.clone()).collect();
        let factors: Vec<String> = if self.factors.is_empty() { stated() } else { self.factors.clone() };
        if factors.is_empty() {
            let message =
                format!(": none given and none in the case; there are {}", names().collect::<Vec<_>>().join(", "));
            return Err(InputError::for_option("factors", message).into());
        }
        for (place, name) in factors.iter().enumerate() {
            let factor = index_of(names(), name, "factors", "factor")?;
            if factors[..place].contains(name) {
                return Err(InputError::for_option("factors", format!(": {name:?} is listed twice")).into());
            }
            if case.factors[factor].prior_standard_deviation(self.bounds) <= 0.0 {
                let message = format!(": {name:?} is fixed by its bounds, so there is nothing to estimate");
                return Err(InputError::for_option("factors", message).into());
            }
        }
        if self.sensors == 0 {
            return Err(InputError::for_option("sensors", " 0: expected at least 1").into());
        }
        check_limit(&SENSORS, self.sensors as f64, "sensors")?;
        let lengths = [
            ("grid_m", self.grid_m.unwrap_or(1.0), "m"),
            ("noise_k", self.noise_k.unwrap_or(1.0), "K"),
            ("sampling_s", self.sampling_s.unwrap_or(1.0), "s"),
        ];
        let run_lengths = self.run_lengths_s.iter().map(|&run_s| ("run_lengths_s", run_s, "s"));
        for (option, value, unit) in lengths.into_iter().chain(run_lengths) {
            if !is_positive(value) {
                return Err(InputError::for_option(option, format!(" {value}: expected more than 0 {unit}")).into());
            }
        }
        checked_noise_k(self.noise_k.unwrap_or(1.0))?;
        for (option, value, unit) in [
            ("least_distance_m", self.least_distance_m, "m"),
            ("position_tolerance_m", self.position_tolerance_m, "m"),
            ("correlation_s", self.correlation_s.unwrap_or(0.0), "s"),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(InputError::for_option(option, format!(" {value}: expected no less than 0 {unit}")).into());
            }
        }
        if self.members < 2 {
            let message = format!(" {}: expected at least 2 members of the prior", self.members);
            return Err(InputError::for_option("members", message).into());
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
        Ok(DesignRequest {
            factors,
            sensors: self.sensors,
            grid_m: self.grid_m,
            least_distance_m: self.least_distance_m,
            position_tolerance_m: self.position_tolerance_m,
            sampling_s: self.sampling_s,
            noise: SampleNoise::stated(self.noise_k, self.correlation_s),
            run_lengths_s,
            criterion: self.criterion,
            robustness: self.robustness,
            target,
            members: self.members,
            seed: self.seed,
            bounds: self.bounds,
        })
    }
}

/// A standard deviation of a sample that a design can use.
pub(in crate::session) fn checked_noise_k(noise_k: f64) -> Result<(), InputError> {
    Observation::checked_sigma_k(noise_k)
        .map(drop)
        .map_err(|message| InputError::for_option("noise_k", format!(": {message}")))
}
