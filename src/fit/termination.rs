//! How a minimisation ends.

use super::neighbourhood::Neighbourhood;
use super::pace::Step;
use super::{Options, Rules, Turn};

/// Why a minimisation ended: a value, not an error, since every end leaves a point that is worth reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    /// Nothing is left of the residuals but rounding.
    ResidualsZero,
    /// The residuals are perpendicular to every derivative.
    Gradient,
    /// No step lowers the objective worth mentioning.
    Reduction,
    /// The undamped step is not worth mentioning.
    Step,
    /// As many ladders were tried as were allowed.
    OutOfPatience,
    /// Steps as small as matter do not lower the objective although the derivatives say they should.
    Stalled,
    /// Residuals or derivatives at the start were not finite.
    NotFinite,
}

impl Termination {
    /// Whether the point is a minimum, as far as the tolerances tell. It may be a local one.
    pub fn converged(&self) -> bool {
        matches!(self, Self::ResidualsZero | Self::Gradient | Self::Reduction | Self::Step)
    }

    /// What to make of it, in a sentence.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::ResidualsZero => {
                "The prediction meets the data to rounding; if these are not synthetic data, check that nothing was \
                 fitted to itself."
            }
            Self::Gradient | Self::Reduction | Self::Step => {
                "A minimum; start elsewhere to see whether it is the only one, and read the standard errors before \
                 the estimates."
            }
            Self::OutOfPatience => {
                "Still descending when the iterations ran out: allow more of them, start from the last point, or \
                 estimate fewer factors if the condition number is above 50."
            }
            Self::Stalled => {
                "The derivatives promise a descent that the residuals do not show: enlarge the difference step or \
                 march in double precision, for the derivatives drown in rounding."
            }
            Self::NotFinite => {
                "The prediction failed at the start or beside it: tighten the bounds or start elsewhere, and look at \
                 why the member failed."
            }
        }
    }
}

impl std::fmt::Display for Termination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::ResidualsZero => f.write_str("residuals are zero"),
            Self::Gradient => f.write_str("gradient is zero"),
            Self::Reduction => f.write_str("no further reduction"),
            Self::Step => f.write_str("no further step"),
            Self::OutOfPatience => f.write_str("out of patience"),
            Self::Stalled => f.write_str("stalled"),
            Self::NotFinite => f.write_str("not finite at the start"),
        }
    }
}

/// Whether to end at the last point of a path, to which a step led, about which this is known.
///
/// The step is judged undamped, bent along the bounds like any other: a damped step is small wherever the damping is
/// large, and says nothing of a minimum. The reduction is judged by what the undamped step promises and by what the last
/// step promised and brought: at a minimum with large residuals the Jacobian may be singular, and then the undamped step
/// promises what it cannot keep.
pub(super) fn verdict(
    near: &Neighbourhood,
    path: &[Turn],
    taken: Option<&Step>,
    options: &Options,
) -> Option<Termination> {
    if near.is_rounding() {
        return Some(Termination::ResidualsZero);
    }
    let brought = match path {
        [.., before, last] => before.objective - last.objective,
        _ => f64::INFINITY,
    };
    if let Rules::Paper { tolerance_objective, tolerance_slope, tolerance_step, .. } = options.rules {
        let went = match path {
            [.., before, last] => (&last.point - &before.point).norm(),
            _ => f64::INFINITY,
        };
        return if near.slope() < tolerance_slope {
            Some(Termination::Gradient)
        } else if brought < tolerance_objective {
            Some(Termination::Reduction)
        } else {
            (went < tolerance_step).then_some(Termination::Step)
        };
    }
    let (promise, length) = near.undamped();
    let last = taken.map_or(f64::INFINITY, |step| step.promise.max(brought));
    if near.steepness() <= options.tolerance_gradient {
        Some(Termination::Gradient)
    } else if last.min(promise) <= options.tolerance_reduction * near.objective {
        Some(Termination::Reduction)
    } else {
        (length <= options.tolerance_step * near.distance()).then_some(Termination::Step)
    }
}

/// Whether a step is too short to matter, though no tolerance told of a minimum.
pub(super) fn goes_nowhere(step: &Step, near: &Neighbourhood, options: &Options) -> bool {
    match options.rules {
        Rules::Radius => near.length(&step.target) <= options.tolerance_step * near.distance(),
        Rules::Paper { tolerance_step, .. } => (&step.target - &near.point).norm() < tolerance_step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_minimum_counts_as_converged_and_every_end_has_advice() {
        use Termination::*;
        let ends = [ResidualsZero, Gradient, Reduction, Step, OutOfPatience, Stalled, NotFinite];
        assert_eq!(ends.map(|end| end.converged()), [true, true, true, true, false, false, false]);
        assert!(ends.iter().all(|end| end.advice().ends_with('.')));
    }
}
