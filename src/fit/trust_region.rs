//! Trust-region radius and damping, updated from the ratio of actual to predicted reduction.

use super::linear_model::LinearModel;
use super::{DampingStrategy, Options};
use nalgebra::DVector;

/// A trial step.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub trial_point: DVector<f64>,
    /// Damping parameter μ.
    pub damping: f64,
    /// Scaled length of the step, `|√Ω ΔP|`.
    length: f64,
    /// Predicted reduction of S.
    pub predicted_reduction: f64,
}

/// Control of the damping.
#[derive(Clone, Copy, Debug)]
pub(super) enum TrustRegion {
    /// The trust-region radius, in `|√Ω ΔP|`.
    Radius(f64),
    /// Damping parameter μ, under the paper's rule.
    Damping(f64),
}

/// Relative tolerance on the length of a step of a given radius: a closer damping gains nothing (Moré 1978).
const RADIUS_TOLERANCE: f64 = 0.1;
/// First guess of the damping relative to its upper bound (Moré 1978).
const INITIAL_DAMPING_FRACTION: f64 = 1e-3;
/// Smallest ratio of actual to predicted reduction of an accepted step.
const SUFFICIENT_DECREASE: f64 = 1e-4;

impl TrustRegion {
    pub(super) fn initial(model: &LinearModel, rules: &DampingStrategy) -> Self {
        match *rules {
            // The distance to zero: no variable is sent to many times its size before the curvature is known. MINPACK's
            // initial radius is a hundred times as large; from a distant start its first step can make an exponential
            // term vanish.
            DampingStrategy::TrustRegion => {
                Self::Radius(if model.distance_from_zero() > 0.0 { model.distance_from_zero() } else { 1.0 })
            }
            DampingStrategy::Paper { initial_damping: damping, .. } => Self::Damping(damping),
        }
    }

    /// The trial steps of one iteration, each shorter than the one before. From a radius, the first has twice the
    /// radius where shorter ones follow; the others have half, an eighth and a thirty-second of its length.
    pub(super) fn trial_steps(&self, model: &LinearModel, options: &Options) -> Vec<Step> {
        let undamped = Step::with_damping(model, 0.0);
        match *self {
            Self::Damping(damping) => vec![Step::with_damping(model, damping)],
            Self::Radius(radius) => {
                let far = if options.trials > 1 { 2.0 * radius } else { radius };
                let first = step_of_radius(model, far, &undamped);
                let shorter = |k: usize| 0.5f64.powi(2 * k as i32 - 1) * first.length;
                let rest: Vec<Step> =
                    (1..options.trials).map(|k| step_of_radius(model, shorter(k), &undamped)).collect();
                std::iter::once(first).chain(rest).collect()
            }
        }
    }

    /// Whether a step with this actual reduction of S is accepted.
    pub(super) fn accepts(&self, step: &Step, reduction: f64) -> bool {
        match self {
            Self::Radius(_) => reduction > SUFFICIENT_DECREASE * step.predicted_reduction && reduction > 0.0,
            Self::Damping(_) => reduction > 0.0,
        }
    }

    /// Updates after an accepted step with this actual reduction of S.
    pub(super) fn after_success(&mut self, model: &LinearModel, step: &Step, reduction: f64) {
        match self {
            Self::Damping(damping) => *damping *= 0.1,
            Self::Radius(radius) => {
                let ratio = reduction / step.predicted_reduction;
                if ratio <= 0.25 {
                    *radius = reduced_radius(model, step, reduction);
                } else if ratio >= 0.75 || step.damping == 0.0 {
                    *radius = 2.0 * step.length;
                } else {
                    *radius = step.length;
                }
            }
        }
    }

    /// Updates after the shortest trial step failed with this actual reduction of S, NaN where it could not be
    /// computed.
    pub(super) fn after_failure(&mut self, model: &LinearModel, step: &Step, reduction: f64) {
        match self {
            Self::Damping(damping) => *damping = 10.0 * step.damping,
            Self::Radius(radius) => *radius = reduced_radius(model, step, reduction),
        }
    }
}

impl Step {
    fn with_damping(model: &LinearModel, damping: f64) -> Self {
        let target = model.trial_point(damping);
        Self {
            damping,
            length: model.step_length(&target),
            predicted_reduction: model.predicted_reduction(&target),
            trial_point: target,
        }
    }
}

/// The radius after a poor step: the minimum of the parabola through S, its slope and the actual reduction, between a
/// tenth and a half of the step.
fn reduced_radius(model: &LinearModel, step: &Step, reduction: f64) -> f64 {
    // Half the descent rate of S along the step.
    let descent = -model.directional_derivative(&step.trial_point);
    let share = if reduction >= 0.0 { 0.5 } else { descent / (2.0 * descent - reduction) };
    // Comparisons with NaN are false: a step that could not be computed gives a tenth.
    step.length * if share > 0.1 { share.min(0.5) } else { 0.1 }
}

/// The step of a given radius, or the undamped one where that is shorter.
///
/// The length falls with the damping, and its inverse is nearly linear in the damping (Hebden 1973; Moré 1978), also
/// where bounds are met. So the damping follows from secants between a lower and an upper limit.
fn step_of_radius(model: &LinearModel, radius: f64, undamped: &Step) -> Step {
    if undamped.length <= (1.0 + RADIUS_TOLERANCE) * radius {
        return undamped.clone();
    }
    let (mut low, mut high) = (0.0, model.scaled_gradient_norm() / radius);
    let mut last = (0.0, undamped.length);
    let mut damping = high * INITIAL_DAMPING_FRACTION;
    let mut factor = INITIAL_DAMPING_FRACTION;
    let mut step = Step::with_damping(model, damping);
    // A few iterations suffice, with two exceptions: for a variable with almost no effect the damping is almost zero
    // and is approached by squaring a factor, and a bound makes a kink in the line, which bisection passes.
    for iteration in 0..60 {
        if (step.length - radius).abs() <= RADIUS_TOLERANCE * radius || high <= low * (1.0 + f64::EPSILON) {
            break;
        }
        if step.length > radius {
            low = damping;
        } else {
            high = damping;
        }
        let slope = (1.0 / step.length - 1.0 / last.1) / (damping - last.0);
        let secant = damping + (1.0 / radius - 1.0 / step.length) / slope;
        last = (damping, step.length);
        damping = if iteration % 3 < 2 && low < secant && secant < high {
            secant
        } else if low > 0.0 {
            (low * high).sqrt()
        } else {
            factor *= factor;
            high * factor
        };
        step = Step::with_damping(model, damping);
    }
    step
}
