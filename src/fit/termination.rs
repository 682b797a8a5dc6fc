//! How a minimisation ends.

use super::damping::{Neighbourhood, TRUSTED};
use super::{Options, Turn};

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
    /// Residuals or derivatives at a point were not finite.
    NotFinite {
        /// Turns taken before.
        iteration: usize,
    },
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
            Self::NotFinite { .. } => {
                "The prediction failed at this point or beside it: tighten the bounds or start elsewhere, and look at \
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
            Self::NotFinite { iteration } => write!(f, "not finite after iteration {iteration}"),
        }
    }
}

/// The share of the first objective that counts as nothing: residuals a part in 10¹² of what they were.
const ZERO: f64 = 1e-24;

/// Whether to end at the last point of a path, about which this is known.
///
/// The step is judged undamped, bent along the bounds like any other: a damped step is small wherever the damping is
/// large, and says nothing of a minimum. The reduction is judged by what the undamped step promises and, as in the
/// paper, by what the last ladder brought: at a minimum with large residuals the Jacobian may be singular, and then
/// the undamped step promises what it cannot keep.
pub(super) fn verdict(near: &Neighbourhood, path: &[Turn], options: &Options) -> Option<Termination> {
    if !near.finite() {
        return Some(Termination::NotFinite { iteration: path.len() - 1 });
    }
    if near.objective <= ZERO * path[0].objective {
        return Some(Termination::ResidualsZero);
    }
    let undamped = near.target(TRUSTED);
    let brought = match path {
        [.., before, last] => 1.0 - last.objective / before.objective,
        _ => 1.0,
    };
    if near.steepness() <= options.tolerance_gradient {
        Some(Termination::Gradient)
    } else if brought.min(near.promise(&undamped) / near.objective) <= options.tolerance_reduction {
        Some(Termination::Reduction)
    } else if near.negligible(&undamped, options.tolerance_step) {
        Some(Termination::Step)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_minimum_counts_as_converged_and_every_end_has_advice() {
        use Termination::*;
        let ends = [ResidualsZero, Gradient, Reduction, Step, OutOfPatience, Stalled, NotFinite { iteration: 3 }];
        assert_eq!(ends.map(|end| end.converged()), [true, true, true, true, false, false, false]);
        assert!(ends.iter().all(|end| end.advice().ends_with('.')));
    }
}
