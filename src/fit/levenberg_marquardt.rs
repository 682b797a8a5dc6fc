//! The Levenberg-Marquardt iteration from one start, as an ask-tell state machine: it requests evaluations and receives
//! their results, so that many starts can share one ensemble.

use super::finite_differences::{self, Stencil};
use super::linear_model::LinearModel;
use super::quadratic::column_norms;
use super::trust_region::{Step, TrustRegion};
use super::{DampingStrategy, Fit, Iterate, LeastSquares, Options, Tangent, Termination, bounds, termination};
use nalgebra::{DMatrix, DVector};

/// Fraction of a step at which geodesic acceleration probes the residuals.
const PROBE_FRACTION: f64 = 0.1;

/// Decay of the maximum column norms per accepted point. Without decay, as in MINPACK, a variable that had a very large
/// effect far from the solution stays damped for good (polynomials of high degree, from ten times away). With a decay
/// of a tenth the damping becomes too weak where residuals stay large and curved (Brown and Dennis).
const COLUMN_NORM_DECAY: f64 = 0.95;

pub(super) struct LevenbergMarquardt<'a> {
    options: &'a Options,
    bounds: &'a [(f64, f64)],
    request: Request,
    /// The last accepted trial point, whose derivatives are pending, and its residuals where they are known.
    candidate: DVector<f64>,
    candidate_residuals: Option<DVector<f64>>,
    /// The step from the current point to the candidate; `None` for the start.
    candidate_step: Option<Step>,
    /// The model at the current point and the trust region; `None` until the derivatives at the start are known.
    current: Option<(LinearModel, TrustRegion)>,
    /// Sizes of the variables to which finite-difference steps are relative.
    variable_sizes: DVector<f64>,
    /// Scaling: the maximum norm of each Jacobian column so far, or its current norm under the paper's rule.
    max_column_norms: DVector<f64>,
    path: Vec<Iterate>,
    iterations: usize,
    evaluations: usize,
    tangents: usize,
}

/// The evaluation that the solver needs next.
enum Request {
    Tangent,
    /// Residuals part of the way along these steps, for geodesic acceleration.
    Probes(Vec<Step>),
    /// Residuals at the ends of these steps.
    TrialPoints(Vec<Step>),
    Terminated(Termination),
}

impl<'a> LevenbergMarquardt<'a> {
    pub(super) fn new(start: &DVector<f64>, bounds: &'a [(f64, f64)], options: &'a Options) -> Self {
        Self {
            options,
            bounds,
            request: Request::Tangent,
            variable_sizes: finite_differences::variable_sizes(&bounds::clamped(start, bounds)),
            candidate: bounds::clamped(start, bounds),
            candidate_residuals: None,
            candidate_step: None,
            current: None,
            max_column_norms: DVector::zeros(start.len()),
            path: Vec::new(),
            iterations: 0,
            evaluations: 0,
            tangents: 0,
        }
    }

    pub(super) fn awaiting_tangent(&mut self) -> Option<&mut Self> {
        matches!(self.request, Request::Tangent).then_some(self)
    }

    /// The point whose derivatives are requested.
    pub(super) fn tangent_point(&self) -> &DVector<f64> {
        &self.candidate
    }

    /// The points whose residuals are requested, one per column.
    pub(super) fn requested_points(&self) -> DMatrix<f64> {
        match (&self.request, &self.current) {
            (Request::Tangent, _) => {
                let points = self.stencil().points();
                if self.candidate_residuals.is_some() {
                    return points;
                }
                let mut points = points.insert_column(0, 0.0);
                points.set_column(0, &self.candidate);
                points
            }
            (Request::Probes(steps), Some((model, _))) => {
                columns(steps.iter().map(|step| model.point_along(&step.trial_point, PROBE_FRACTION)))
            }
            (Request::TrialPoints(steps), _) => columns(steps.iter().map(|step| step.trial_point.clone())),
            _ => DMatrix::zeros(self.candidate.len(), 0),
        }
    }

    fn stencil(&self) -> Stencil {
        Stencil::new(
            &self.candidate,
            &self.variable_sizes,
            self.bounds,
            self.options.difference_step,
            self.options.difference_scheme,
        )
    }

    /// Receives the derivatives that the problem supplied.
    pub(super) fn receive_tangent(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        self.tangents += 1;
        self.move_to_candidate(tangent, problem);
    }

    /// Receives the residuals at the requested points.
    pub(super) fn receive_residuals(&mut self, mut computed: DMatrix<f64>, problem: &impl LeastSquares) {
        self.evaluations += computed.ncols();
        match std::mem::replace(&mut self.request, Request::Tangent) {
            Request::Tangent => {
                let residuals = self.candidate_residuals.take().unwrap_or_else(|| {
                    let first = computed.column(0).into_owned();
                    computed = computed.clone().remove_column(0);
                    first
                });
                self.move_to_candidate(self.stencil().tangent(residuals, &computed), problem);
            }
            Request::Probes(mut steps) => {
                for (step, residuals) in steps.iter_mut().zip(computed.column_iter()) {
                    if let Some((model, _)) = &self.current {
                        step.trial_point =
                            model.accelerated(step.damping, &step.trial_point, PROBE_FRACTION, &residuals.into_owned());
                    }
                }
                self.request = Request::TrialPoints(steps);
            }
            Request::TrialPoints(steps) => self.select_step(steps, &computed),
            Request::Terminated(termination) => self.request = Request::Terminated(termination),
        }
    }

    /// Makes the accepted trial point the current one. Where its derivatives are not finite, returns to the previous
    /// point for a shorter step.
    fn move_to_candidate(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        let is_finite = tangent.is_finite();
        if let (false, Some((model, trust_region)), Some(taken)) = (is_finite, &mut self.current, &self.candidate_step)
        {
            trust_region.after_failure(model, taken, f64::NAN);
            return self.propose_steps();
        }
        let lengths = column_norms(&tangent.jacobian);
        self.max_column_norms = match self.options.damping_strategy {
            DampingStrategy::TrustRegion => {
                lengths.zip_map(&self.max_column_norms, |now, before| now.max(COLUMN_NORM_DECAY * before))
            }
            DampingStrategy::Paper { .. } => lengths,
        };
        let error = self.options.derivative_error;
        let weights = problem.curvature_weights(&tangent.residuals);
        let second_order = self.current.as_ref().is_none_or(|(model, _)| model.is_second_order());
        let model = LinearModel::new(
            self.candidate.clone(),
            tangent,
            (weights, second_order),
            self.bounds,
            &self.max_column_norms,
            error,
        );
        let trust_region = self.current.take().map_or_else(
            || TrustRegion::initial(&model, &self.options.damping_strategy),
            |(_, trust_region)| trust_region,
        );
        let damping = match (&self.candidate_step, trust_region) {
            (Some(taken), _) => taken.damping,
            (None, TrustRegion::Damping(damping)) => damping,
            (None, TrustRegion::Radius(_)) => 0.0,
        };
        self.path.push(Iterate { point: self.candidate.clone(), objective: model.objective, damping });
        let verdict = if is_finite {
            termination::convergence(&model, &self.path, self.candidate_step.as_ref(), self.options)
        } else {
            Some(Termination::NotFinite)
        };
        self.current = Some((model, trust_region));
        match verdict {
            Some(termination) => self.request = Request::Terminated(termination),
            None => self.propose_steps(),
        }
    }

    /// Chooses the next trial steps.
    fn propose_steps(&mut self) {
        let Some((model, trust_region)) = &self.current else { return };
        let steps = trust_region.trial_steps(model, self.options);
        self.request = if self.iterations == self.options.max_iterations {
            Request::Terminated(Termination::MaxIterations)
        } else if termination::is_negligible_step(&steps[0], model, self.options) {
            Request::Terminated(Termination::Stalled)
        } else if self.options.geodesic_acceleration && !model.is_second_order() {
            Request::Probes(steps)
        } else {
            Request::TrialPoints(steps)
        };
        self.iterations += 1;
    }

    /// Accepts one of the trial steps, or none.
    fn select_step(&mut self, steps: Vec<Step>, computed: &DMatrix<f64>) {
        let Some((model, trust_region)) = &mut self.current else { return };
        let reductions: Vec<f64> =
            computed.column_iter().map(|column| model.objective - column.norm_squared()).collect();
        let best = reductions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // The longest of the steps with at least a quarter of the best reduction: in a curved valley the lowest trial
        // point is that of one of the shortest steps, and accepting only that one makes progress slow. Comparisons with
        // NaN are false, so a point that could not be computed is never accepted, and the step shrinks.
        let is_good = |index: &usize| {
            reductions[*index] >= 0.25 * best && trust_region.accepts(&steps[*index], reductions[*index])
        };
        match (0..steps.len()).find(is_good) {
            Some(index) => {
                let step = steps[index].clone();
                trust_region.after_success(model, &step, reductions[index]);
                model.switch_quadratic(&step.trial_point, reductions[index]);
                self.candidate = step.trial_point.clone();
                self.variable_sizes.zip_apply(&self.candidate, |size, value| *size = value.abs().max(*size / 2.0));
                self.candidate_residuals = Some(computed.column(index).into_owned());
                self.candidate_step = Some(step);
                self.request = Request::Tangent;
            }
            None => {
                let last = steps.len() - 1;
                trust_region.after_failure(model, &steps[last], reductions[last]);
                model.switch_quadratic(&steps[last].trial_point, reductions[last]);
                self.propose_steps();
            }
        }
    }

    pub(super) fn into_fit(self) -> Fit {
        let Request::Terminated(termination) = self.request else {
            unreachable!("the solver ends after it has terminated")
        };
        let (model, _) = self.current.expect("a terminated solver has a current point");
        Fit {
            point: model.point,
            objective: model.objective,
            residuals: model.tangent.residuals,
            jacobian: model.tangent.jacobian,
            path: self.path,
            evaluations: self.evaluations,
            tangent_evaluations: self.tangents,
            termination,
        }
    }
}

fn columns(points: impl Iterator<Item = DVector<f64>>) -> DMatrix<f64> {
    DMatrix::from_columns(&points.collect::<Vec<_>>())
}
