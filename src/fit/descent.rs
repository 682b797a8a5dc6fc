//! The Levenberg-Marquardt iteration from one start, as an ask-tell state machine: it requests evaluations and receives
//! their results, so that many starts can share one ensemble.

use super::difference::{self, Stencil};
use super::neighbourhood::Neighbourhood;
use super::pace::{Pace, Step};
use super::quadratic::lengths;
use super::{Fit, LeastSquares, Options, Rules, Tangent, Termination, Turn, bounds, termination};
use nalgebra::{DMatrix, DVector};

/// Fraction of a step at which geodesic acceleration probes the residuals.
const FEELER: f64 = 0.1;

/// Decay of the maximum column norms per accepted point. Without decay, as in MINPACK, a variable that had a very large
/// effect far from the solution stays damped for good (polynomials of high degree, from ten times away). With a decay
/// of a tenth the damping becomes too weak where residuals stay large and curved (Brown and Dennis).
const REMEMBERED: f64 = 0.95;

pub(super) struct Descent<'a> {
    options: &'a Options,
    bounds: &'a [(f64, f64)],
    wish: Wish,
    /// The last accepted trial point, whose derivatives are pending, and its residuals where they are known.
    next: DVector<f64>,
    residuals: Option<DVector<f64>>,
    /// The step to it.
    taken: Option<Step>,
    /// The model at the current point and the trust region; `None` until the derivatives at the start are known.
    here: Option<(Neighbourhood, Pace)>,
    /// Sizes of the variables to which finite-difference steps are relative.
    sizes: DVector<f64>,
    /// Scaling: the maximum norm of each Jacobian column so far, or its current norm under the paper's rule.
    longest: DVector<f64>,
    path: Vec<Turn>,
    ladders: usize,
    evaluations: usize,
    tangents: usize,
}

/// The evaluation that the solver needs next.
enum Wish {
    Tangent,
    /// Residuals part of the way along these steps, for geodesic acceleration.
    Feelers(Vec<Step>),
    /// Residuals at the ends of these steps.
    Trials(Vec<Step>),
    Nothing(Termination),
}

impl<'a> Descent<'a> {
    pub(super) fn new(start: &DVector<f64>, bounds: &'a [(f64, f64)], options: &'a Options) -> Self {
        Self {
            options,
            bounds,
            wish: Wish::Tangent,
            sizes: difference::sizes(&bounds::inside(start, bounds)),
            next: bounds::inside(start, bounds),
            residuals: None,
            taken: None,
            here: None,
            longest: DVector::zeros(start.len()),
            path: Vec::new(),
            ladders: 0,
            evaluations: 0,
            tangents: 0,
        }
    }

    pub(super) fn wanting_tangent(&mut self) -> Option<&mut Self> {
        matches!(self.wish, Wish::Tangent).then_some(self)
    }

    /// The point whose derivatives are requested.
    pub(super) fn next(&self) -> &DVector<f64> {
        &self.next
    }

    /// The points whose residuals are requested, one per column.
    pub(super) fn wanted(&self) -> DMatrix<f64> {
        match (&self.wish, &self.here) {
            (Wish::Tangent, _) => {
                let points = self.stencil().points();
                if self.residuals.is_some() {
                    return points;
                }
                let mut points = points.insert_column(0, 0.0);
                points.set_column(0, &self.next);
                points
            }
            (Wish::Feelers(steps), Some((model, _))) => {
                columns(steps.iter().map(|step| model.along(&step.target, FEELER)))
            }
            (Wish::Trials(steps), _) => columns(steps.iter().map(|step| step.target.clone())),
            _ => DMatrix::zeros(self.next.len(), 0),
        }
    }

    fn stencil(&self) -> Stencil {
        Stencil::new(&self.next, &self.sizes, self.bounds, self.options.difference_step, self.options.sides)
    }

    /// Receives the derivatives that the problem supplied.
    pub(super) fn told(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        self.tangents += 1;
        self.arrive(tangent, problem);
    }

    /// Receives the residuals at the requested points.
    pub(super) fn computed(&mut self, mut computed: DMatrix<f64>, problem: &impl LeastSquares) {
        self.evaluations += computed.ncols();
        match std::mem::replace(&mut self.wish, Wish::Tangent) {
            Wish::Tangent => {
                let residuals = self.residuals.take().unwrap_or_else(|| {
                    let first = computed.column(0).into_owned();
                    computed = computed.clone().remove_column(0);
                    first
                });
                self.arrive(self.stencil().tangent(residuals, &computed), problem);
            }
            Wish::Feelers(mut steps) => {
                for (step, residuals) in steps.iter_mut().zip(computed.column_iter()) {
                    if let Some((model, _)) = &self.here {
                        step.target = model.bent(step.damping, &step.target, FEELER, &residuals.into_owned());
                    }
                }
                self.wish = Wish::Trials(steps);
            }
            Wish::Trials(steps) => self.judge(steps, &computed),
            Wish::Nothing(termination) => self.wish = Wish::Nothing(termination),
        }
    }

    /// Makes the accepted trial point the current one. Where its derivatives are not finite, returns to the previous
    /// point for a shorter step.
    fn arrive(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        let is_finite = tangent.is_finite();
        if let (false, Some((model, pace)), Some(taken)) = (is_finite, &mut self.here, &self.taken) {
            pace.after_failure(model, taken, f64::NAN);
            return self.plan();
        }
        let lengths = lengths(&tangent.jacobian);
        self.longest = match self.options.rules {
            Rules::Radius => lengths.zip_map(&self.longest, |now, before| now.max(REMEMBERED * before)),
            Rules::Paper { .. } => lengths,
        };
        let error = self.options.derivative_error;
        let weights = problem.curvature_weights(&tangent.residuals);
        let second_order = self.here.as_ref().is_none_or(|(model, _)| model.is_second_order());
        let model =
            Neighbourhood::new(self.next.clone(), tangent, (weights, second_order), self.bounds, &self.longest, error);
        let pace = self.here.take().map_or_else(|| Pace::at_start(&model, &self.options.rules), |(_, pace)| pace);
        let damping = match (&self.taken, pace) {
            (Some(taken), _) => taken.damping,
            (None, Pace::Damping(damping)) => damping,
            (None, Pace::Radius(_)) => 0.0,
        };
        self.path.push(Turn { point: self.next.clone(), objective: model.objective, damping });
        let verdict = if is_finite {
            termination::verdict(&model, &self.path, self.taken.as_ref(), self.options)
        } else {
            Some(Termination::NotFinite)
        };
        self.here = Some((model, pace));
        match verdict {
            Some(termination) => self.wish = Wish::Nothing(termination),
            None => self.plan(),
        }
    }

    /// Chooses the next trial steps.
    fn plan(&mut self) {
        let Some((model, pace)) = &self.here else { return };
        let steps = pace.steps(model, self.options);
        self.wish = if self.ladders == self.options.patience {
            Wish::Nothing(Termination::OutOfPatience)
        } else if termination::goes_nowhere(&steps[0], model, self.options) {
            Wish::Nothing(Termination::Stalled)
        } else if self.options.bends && !model.is_second_order() {
            Wish::Feelers(steps)
        } else {
            Wish::Trials(steps)
        };
        self.ladders += 1;
    }

    /// Accepts one of the trial steps, or none.
    fn judge(&mut self, steps: Vec<Step>, computed: &DMatrix<f64>) {
        let Some((model, pace)) = &mut self.here else { return };
        let reductions: Vec<f64> =
            computed.column_iter().map(|column| model.objective - column.norm_squared()).collect();
        let best = reductions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // The longest of the steps with at least a quarter of the best reduction: in a curved valley the lowest trial
        // point is that of one of the shortest steps, and accepting only that one makes progress slow. Comparisons with
        // NaN are false, so a point that could not be computed is never accepted, and the step shrinks.
        let is_good =
            |index: &usize| reductions[*index] >= 0.25 * best && pace.takes(&steps[*index], reductions[*index]);
        match (0..steps.len()).find(is_good) {
            Some(index) => {
                let step = steps[index].clone();
                pace.after_success(model, &step, reductions[index]);
                model.switch(&step.target, reductions[index]);
                self.next = step.target.clone();
                self.sizes.zip_apply(&self.next, |size, value| *size = value.abs().max(*size / 2.0));
                self.residuals = Some(computed.column(index).into_owned());
                self.taken = Some(step);
                self.wish = Wish::Tangent;
            }
            None => {
                let last = steps.len() - 1;
                pace.after_failure(model, &steps[last], reductions[last]);
                model.switch(&steps[last].target, reductions[last]);
                self.plan();
            }
        }
    }

    pub(super) fn end(self) -> Fit {
        let Wish::Nothing(termination) = self.wish else { unreachable!("the solver ends after it has terminated") };
        let (model, _) = self.here.expect("a terminated solver has a current point");
        Fit {
            point: model.point,
            objective: model.objective,
            residuals: model.tangent.residuals,
            jacobian: model.tangent.jacobian,
            path: self.path,
            evaluations: self.evaluations,
            tangents: self.tangents,
            termination,
        }
    }
}

fn columns(points: impl Iterator<Item = DVector<f64>>) -> DMatrix<f64> {
    DMatrix::from_columns(&points.collect::<Vec<_>>())
}
