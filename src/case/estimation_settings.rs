//! Estimation settings: factors, data, loss function, prior and start.

use super::factor::{Bounds, Factor};
use super::observation::checked_window_s;
use super::validation::{FieldPath, checked_index, positive};
use std::fmt;
use std::str::FromStr;

/// The function of a normalised residual r that is summed. The robust functions equal r² near zero and grow as |r|
/// beyond `width`, which is in standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub enum LossFunction {
    /// r²: least squares.
    #[default]
    LeastSquares,
    /// `2 w² (√(1 + (r/w)²) − 1)`.
    SoftL1 {
        /// w, above zero.
        width: f64,
    },
    /// r² for |r| up to w, `2 w |r| − w²` beyond (Huber, Ann. Math. Stat. 35, 1964).
    Huber {
        /// w, above zero.
        width: f64,
    },
}

/// The default of SciPy's `f_scale`.
const SOFT_L1_WIDTH: f64 = 1.0;
/// 95 % efficiency for normal residuals.
const HUBER_WIDTH: f64 = 1.345;

impl fmt::Display for LossFunction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LeastSquares => write!(formatter, "squares"),
            Self::SoftL1 { width } => write!(formatter, "soft-l1={width}"),
            Self::Huber { width } => write!(formatter, "huber={width}"),
        }
    }
}

/// `squares`, `soft-l1` or `huber`, the latter two with an optional width in standard deviations (`huber=2`; default 1
/// and 1.345).
impl FromStr for LossFunction {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, width) = text.split_once('=').map_or((text, None), |(name, width)| (name, Some(width)));
        let width = |standard: f64| match width.map(|width| width.trim().parse::<f64>()) {
            None => Ok(standard),
            Some(Ok(width)) if positive(width, width).is_ok() => Ok(width),
            Some(_) => Err(format!("expected a width in standard deviations above zero, such as {name}={standard}")),
        };
        match name.trim() {
            "squares" if text == "squares" => Ok(Self::LeastSquares),
            "soft-l1" => Ok(Self::SoftL1 { width: width(SOFT_L1_WIDTH)? }),
            "huber" => Ok(Self::Huber { width: width(HUBER_WIDTH)? }),
            _ => Err("expected squares, soft-l1 or huber, the latter two with a width such as huber=1.345".to_owned()),
        }
    }
}

/// Settings of an estimate.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct EstimationSettings {
    /// Indices of the factors to estimate.
    pub factors: Vec<usize>,
    /// Indices of the sensors to fit; empty for all with observations.
    pub sensors: Vec<usize>,
    /// Time window of the data, s, for sensors without their own; `None` for the whole exposure.
    pub window_s: Option<(f64, f64)>,
    /// Start value of each of `factors`; empty for the nominal values.
    pub start: Vec<f64>,
    /// Side constraints of the search.
    pub bounds: Bounds,
    /// Loss function.
    pub loss_function: LossFunction,
    /// Gaussian prior: mean at the nominal value, these side constraints at two standard deviations. `None` for no
    /// prior.
    pub prior: Option<Bounds>,
}

impl EstimationSettings {
    /// A start value within the bounds of its factor.
    pub(super) fn checked_start(start: f64, factor: &Factor, bounds: Bounds) -> Result<f64, String> {
        let (low, high) = factor.bounds(bounds);
        if (low..=high).contains(&start) {
            return Ok(start);
        }
        Err(format!("start {start} lies outside the bounds {low} to {high}"))
    }

    /// Record all errors of the settings, for the factors and sensors of a case.
    pub(super) fn check(&self, at: &FieldPath<'_>, factors: &[Factor], sensors: usize, duration_s: f64) {
        for (name, chosen, count, noun) in
            [("factors", &self.factors, factors.len(), "factor"), ("sensors", &self.sensors, sensors, "sensor")]
        {
            for (position, (at, &each)) in at.child(name).elements(chosen).enumerate() {
                at.require(checked_index(each, count, noun));
                if chosen[..position].contains(&each) {
                    at.error(format!("{noun} {each} is listed twice"));
                }
            }
        }
        if let Some(window_s) = self.window_s {
            at.child("window_s").require(checked_window_s(window_s, duration_s));
        }
        let starts = at.child("start");
        if !self.start.is_empty() && self.start.len() != self.factors.len() {
            let (found, requested) = (self.start.len(), self.factors.len());
            starts.error(format!("expected one start for each of {requested} factors, found {found}"));
        }
        for ((at, &start), &factor) in starts.elements(&self.start).zip(&self.factors) {
            if let Some(factor) = factors.get(factor) {
                at.require(Self::checked_start(start, factor, self.bounds));
            }
        }
        if let LossFunction::SoftL1 { width } | LossFunction::Huber { width } = self.loss_function {
            at.positive("loss_function.width", width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_function_is_parsed_with_its_width_or_the_default_width() {
        assert_eq!("squares".parse(), Ok(LossFunction::LeastSquares));
        assert_eq!("soft-l1".parse(), Ok(LossFunction::SoftL1 { width: 1.0 }));
        assert_eq!("huber".parse(), Ok(LossFunction::Huber { width: 1.345 }));
        assert_eq!("huber=2.5".parse(), Ok(LossFunction::Huber { width: 2.5 }));
        for wrong in ["huber=0", "huber=wide", "soft-l1=inf", "squares=2", "cauchy", ""] {
            assert!(wrong.parse::<LossFunction>().is_err_and(|message| message.starts_with("expected")), "{wrong:?}");
        }
    }
}
