//! What a case proposes to estimate, and from what.

use super::check::{Field, index, positive};
use super::factor::{Bounds, Factor};
use super::observation::checked_window_s;

/// How residuals count that are far off. The robust ones are r² near zero and grow like |r| beyond `width`, which is in
/// standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum LossFunction {
    /// r²: least squares.
    #[default]
    Squares,
    /// `2 w² (√(1 + (r/w)²) − 1)`: smooth.
    SoftL1 {
        /// w, above zero.
        width: f64,
    },
    /// r² up to the width, `2 w |r| − w²` beyond (Huber, Ann. Math. Stat. 35, 1964).
    Huber {
        /// w, above zero.
        width: f64,
    },
}

/// A residual of one standard deviation is half bent (SciPy's `f_scale`).
const SOFT_L1_WIDTH: f64 = 1.0;
/// 95 % of the efficiency of least squares where residuals are normal.
const HUBER_WIDTH: f64 = 1.345;

impl LossFunction {
    /// The one of this name, `squares`, `soft-l1` or `huber`; the robust ones with a width in standard deviations where
    /// one is given, `huber=2`, else 1 and 1.345.
    ///
    /// # Errors
    /// What was expected, where there is none of this name or the width is not above zero.
    pub fn named(text: &str) -> Result<Self, String> {
        let (name, width) = text.split_once('=').map_or((text, None), |(name, width)| (name, Some(width)));
        let width = |standard: f64| match width.map(|width| width.trim().parse::<f64>()) {
            None => Ok(standard),
            Some(Ok(width)) if positive(width, width).is_ok() => Ok(width),
            Some(_) => Err(format!("expected a width in standard deviations above zero, such as {name}={standard}")),
        };
        match name.trim() {
            "squares" if text == "squares" => Ok(Self::Squares),
            "soft-l1" => Ok(Self::SoftL1 { width: width(SOFT_L1_WIDTH)? }),
            "huber" => Ok(Self::Huber { width: width(HUBER_WIDTH)? }),
            _ => Err("expected squares, soft-l1 or huber, the latter two with a width such as huber=1.345".to_owned()),
        }
    }
}

/// What the case file proposes to estimate, and from what.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Estimate {
    /// Indices into the factors.
    pub factors: Vec<usize>,
    /// Indices into the sensors.
    pub sensors: Vec<usize>,
    /// Start and end of the trusted data, s, of every sensor without a window of its own; `None` trusts all.
    pub window_s: Option<(f64, f64)>,
    /// Start of each factor of `factors`; empty starts at the nominal values.
    pub start: Vec<f64>,
    /// The side constraints between which factors are sought.
    pub bounds: Bounds,
    /// How samples count that are far off.
    pub loss: LossFunction,
    /// The side constraints that lie two standard deviations from what is known of each factor beforehand, its nominal
    /// value; none where nothing but the data is to speak.
    pub prior: Option<Bounds>,
}

impl Estimate {
    /// The start of a factor within its bounds.
    pub(super) fn checked_start(start: f64, factor: &Factor, bounds: Bounds) -> Result<f64, String> {
        let (low, high) = factor.bounds(bounds);
        if (low..=high).contains(&start) {
            return Ok(start);
        }
        Err(format!("start {start} lies outside the bounds {low} to {high}"))
    }

    /// Record what is wrong with the choice among the factors and sensors of a case.
    pub(super) fn check(&self, at: &Field<'_>, factors: &[Factor], sensors: usize, duration_s: f64) {
        for (name, chosen, count, noun) in
            [("factors", &self.factors, factors.len(), "factor"), ("sensors", &self.sensors, sensors, "sensor")]
        {
            for (place, (at, &each)) in at.field(name).items(chosen).enumerate() {
                at.require(index(each, count, noun));
                if chosen[..place].contains(&each) {
                    at.fault(format!("{noun} {each} stands twice"));
                }
            }
        }
        if let Some(window_s) = self.window_s {
            at.field("window_s").require(checked_window_s(window_s, duration_s));
        }
        let starts = at.field("start");
        if !self.start.is_empty() && self.start.len() != self.factors.len() {
            starts.fault(format!("{} starts of {} factors", self.start.len(), self.factors.len()));
        }
        for ((at, &start), &factor) in starts.items(&self.start).zip(&self.factors) {
            if let Some(factor) = factors.get(factor) {
                at.require(Self::checked_start(start, factor, self.bounds));
            }
        }
        if let LossFunction::SoftL1 { width } | LossFunction::Huber { width } = self.loss {
            at.positive("loss.width", width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_named_with_its_width_or_with_the_one_of_the_books() {
        assert_eq!(LossFunction::named("squares"), Ok(LossFunction::Squares));
        assert_eq!(LossFunction::named("soft-l1"), Ok(LossFunction::SoftL1 { width: 1.0 }));
        assert_eq!(LossFunction::named("huber"), Ok(LossFunction::Huber { width: 1.345 }));
        assert_eq!(LossFunction::named("huber=2.5"), Ok(LossFunction::Huber { width: 2.5 }));
        for wrong in ["huber=0", "huber=wide", "soft-l1=inf", "squares=2", "cauchy", ""] {
            assert!(LossFunction::named(wrong).is_err_and(|said| said.starts_with("expected")), "{wrong:?}");
        }
    }
}
