//! How far a step may go, and how that follows from how the last one did.

use super::neighbourhood::Neighbourhood;
use super::{Options, Rules};
use nalgebra::DVector;

/// A step that may be taken.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub target: DVector<f64>,
    /// μ.
    pub damping: f64,
    /// `|√Ω ΔP|`.
    length: f64,
    /// By how much S would fall if the residuals were straight.
    pub promise: f64,
}

/// What a damping follows from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pace {
    /// The longest step that straight residuals are trusted for, in `|√Ω ΔP|`.
    Radius(f64),
    /// μ itself.
    Damping(f64),
}

/// A step counts as of the radius within this share: finding its damping closer gains nothing (Moré 1978).
const LAXITY: f64 = 0.1;
/// The first guess at a damping, of the largest it can be (Moré 1978).
const SMALL: f64 = 1e-3;
/// The share of its promise that a step must keep to be taken.
const KEPT: f64 = 1e-4;

impl Pace {
    pub(super) fn at_start(near: &Neighbourhood, rules: &Rules) -> Self {
        match *rules {
            // As far as zero is: no variable is sent to many times its size before anything is known of its curve. MINPACK
            // begins a hundred times as far, and where a rate is far off loses the other end of its exponential.
            Rules::Radius => Self::Radius(if near.distance() > 0.0 { near.distance() } else { 1.0 }),
            Rules::Paper { damping, .. } => Self::Damping(damping),
        }
    }

    /// The steps to try at once, each shorter than the one before: of a radius, one that is let go twice as far where
    /// there are others behind it, then half of that, an eighth, a thirty-second.
    pub(super) fn steps(&self, near: &Neighbourhood, options: &Options) -> Vec<Step> {
        let undamped = Step::of(near, 0.0);
        match *self {
            Self::Damping(damping) => vec![Step::of(near, damping)],
            Self::Radius(radius) => {
                let far = if options.trials > 1 { 2.0 * radius } else { radius };
                let first = of_radius(near, far, &undamped);
                let shorter = |k: usize| 0.5f64.powi(2 * k as i32 - 1) * first.length;
                let rest: Vec<Step> = (1..options.trials).map(|k| of_radius(near, shorter(k), &undamped)).collect();
                std::iter::once(first).chain(rest).collect()
            }
        }
    }

    /// Whether a step may be taken that changed S by `gain`.
    pub(super) fn takes(&self, step: &Step, gain: f64) -> bool {
        match self {
            Self::Radius(_) => gain > KEPT * step.promise && gain > 0.0,
            Self::Damping(_) => gain > 0.0,
        }
    }

    /// After a step was taken that lowered S by `gain`.
    pub(super) fn after_success(&mut self, near: &Neighbourhood, step: &Step, gain: f64) {
        match self {
            Self::Damping(damping) => *damping *= 0.1,
            Self::Radius(radius) => {
                let kept = gain / step.promise;
                if kept <= 0.25 {
                    *radius = shortened(near, step, gain);
                } else if kept >= 0.75 || step.damping == 0.0 {
                    *radius = 2.0 * step.length;
                } else {
                    *radius = step.length;
                }
            }
        }
    }

    /// After the shortest of the steps tried failed, which changed S by `gain`, no number where it could not be computed.
    pub(super) fn after_failure(&mut self, near: &Neighbourhood, step: &Step, gain: f64) {
        match self {
            Self::Damping(damping) => *damping = 10.0 * step.damping,
            Self::Radius(radius) => *radius = shortened(near, step, gain),
        }
    }
}

impl Step {
    fn of(near: &Neighbourhood, damping: f64) -> Self {
        let target = near.target(damping);
        Self { damping, length: near.length(&target), promise: near.promise(&target), target }
    }
}

/// The radius after a step that S hardly followed: where the parabola through S, its slope and the gain is least, between
/// a tenth and a half of the step.
fn shortened(near: &Neighbourhood, step: &Step, gain: f64) -> f64 {
    // Half the slope of S along the step, downwards.
    let descent = -near.descent(&step.target);
    let share = if gain >= 0.0 { 0.5 } else { descent / (2.0 * descent - gain) };
    // What is no number is not above a tenth.
    step.length * if share > 0.1 { share.min(0.5) } else { 0.1 }
}

/// The step whose length is a radius, or the undamped one where that is shorter.
///
/// The length falls with the damping, and the inverse of the length is nearly a straight line over it (Hebden 1973; Moré
/// 1978), also where bounds are met. So a secant of that line is followed, between dampings known to be too small and
/// too large.
fn of_radius(near: &Neighbourhood, radius: f64, undamped: &Step) -> Step {
    if undamped.length <= (1.0 + LAXITY) * radius {
        return undamped.clone();
    }
    let (mut low, mut high) = (0.0, near.pull() / radius);
    let mut last = (0.0, undamped.length);
    let mut damping = high * SMALL;
    let mut leap = SMALL;
    let mut step = Step::of(near, damping);
    // A few turns do, but where a variable has next to no effect the damping is next to nothing, and is leapt to; a bound
    // that is met makes a corner in the line, and halving gets past that.
    for turn in 0..60 {
        if (step.length - radius).abs() <= LAXITY * radius || high <= low * (1.0 + f64::EPSILON) {
            break;
        }
        if step.length > radius {
            low = damping;
        } else {
            high = damping;
        }
        let slope = (1.0 / step.length - 1.0 / last.1) / (damping - last.0);
        let followed = damping + (1.0 / radius - 1.0 / step.length) / slope;
        last = (damping, step.length);
        damping = if turn % 3 < 2 && low < followed && followed < high {
            followed
        } else if low > 0.0 {
            (low * high).sqrt()
        } else {
            leap *= leap;
            high * leap
        };
        step = Step::of(near, damping);
    }
    step
}
