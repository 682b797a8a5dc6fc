//! One start on its way down: what it wants to know next, and what it makes of the answer.

use super::difference::{self, Stencil};
use super::neighbourhood::Neighbourhood;
use super::pace::{Pace, Step};
use super::quadratic::lengths;
use super::{Fit, LeastSquares, Options, Rules, Tangent, Termination, Turn, bounds, termination};
use nalgebra::{DMatrix, DVector};

/// The share of a step at which the curve of the residuals is felt for.
const FEELER: f64 = 0.1;

/// The share of the longest column so far that is remembered from turn to turn. All of it, as in MINPACK, holds a variable
/// for good that had a vast effect far from the answer (polynomials of a high degree, from ten times away); a tenth
/// less a turn no longer restrains where the residuals stay large and curved (Brown and Dennis).
const REMEMBERED: f64 = 0.95;

pub(super) struct Descent<'a> {
    options: &'a Options,
    bounds: &'a [(f64, f64)],
    wish: Wish,
    /// The point last stepped to, which counts once its derivatives are known, and its residuals where they are.
    next: DVector<f64>,
    residuals: Option<DVector<f64>>,
    /// The step that led there.
    taken: Option<Step>,
    /// Where it stands; nowhere before the derivatives at the start are known.
    here: Option<(Neighbourhood, Pace)>,
    /// Of each variable the size that a difference is a share of.
    sizes: DVector<f64>,
    /// Of each column of the Jacobian the length: the longest on the way, or as the rules say.
    longest: DVector<f64>,
    path: Vec<Turn>,
    ladders: usize,
    evaluations: usize,
    tangents: usize,
}

/// What is to be known next.
enum Wish {
    Tangent,
    /// Residuals a share of the way along these steps.
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

    /// The point whose derivatives are wanted.
    pub(super) fn next(&self) -> &DVector<f64> {
        &self.next
    }

    /// The points whose residuals are wanted, one a column.
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
            (Wish::Feelers(steps), Some((near, _))) => {
                columns(steps.iter().map(|step| near.along(&step.target, FEELER)))
            }
            (Wish::Trials(steps), _) => columns(steps.iter().map(|step| step.target.clone())),
            _ => DMatrix::zeros(self.next.len(), 0),
        }
    }

    fn stencil(&self) -> Stencil {
        Stencil::new(&self.next, &self.sizes, self.bounds, self.options.difference_step, self.options.sides)
    }

    /// Takes the derivatives that the problem told.
    pub(super) fn told(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        self.tangents += 1;
        self.arrive(tangent, problem);
    }

    /// Takes the residuals at the points that were wanted.
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
                    if let Some((near, _)) = &self.here {
                        step.target = near.bent(step.damping, &step.target, FEELER, &residuals.into_owned());
                    }
                }
                self.wish = Wish::Trials(steps);
            }
            Wish::Trials(steps) => self.judge(steps, &computed),
            Wish::Nothing(termination) => self.wish = Wish::Nothing(termination),
        }
    }

    /// Stands at the point stepped to, or, where its derivatives are not known, goes back for a shorter step.
    fn arrive(&mut self, tangent: Tangent, problem: &impl LeastSquares) {
        let is_finite = tangent.is_finite();
        if let (false, Some((near, pace)), Some(taken)) = (is_finite, &mut self.here, &self.taken) {
            pace.after_failure(near, taken, f64::NAN);
            return self.plan();
        }
        let lengths = lengths(&tangent.jacobian);
        self.longest = match self.options.rules {
            Rules::Radius => lengths.zip_map(&self.longest, |now, before| now.max(REMEMBERED * before)),
            Rules::Paper { .. } => lengths,
        };
        let error = self.options.derivative_error;
        let weights = problem.curvature_weights(&tangent.residuals);
        let second_order = self.here.as_ref().is_none_or(|(near, _)| near.is_second_order());
        let near =
            Neighbourhood::new(self.next.clone(), tangent, (weights, second_order), self.bounds, &self.longest, error);
        let pace = self.here.take().map_or_else(|| Pace::at_start(&near, &self.options.rules), |(_, pace)| pace);
        let damping = match (&self.taken, pace) {
            (Some(taken), _) => taken.damping,
            (None, Pace::Damping(damping)) => damping,
            (None, Pace::Radius(_)) => 0.0,
        };
        self.path.push(Turn { point: self.next.clone(), objective: near.objective, damping });
        let verdict = if is_finite {
            termination::verdict(&near, &self.path, self.taken.as_ref(), self.options)
        } else {
            Some(Termination::NotFinite)
        };
        self.here = Some((near, pace));
        match verdict {
            Some(termination) => self.wish = Wish::Nothing(termination),
            None => self.plan(),
        }
    }

    /// Chooses the steps to try from where it stands.
    fn plan(&mut self) {
        let Some((near, pace)) = &self.here else { return };
        let steps = pace.steps(near, self.options);
        self.wish = if self.ladders == self.options.patience {
            Wish::Nothing(Termination::OutOfPatience)
        } else if termination::goes_nowhere(&steps[0], near, self.options) {
            Wish::Nothing(Termination::Stalled)
        } else if self.options.bends && !near.is_second_order() {
            Wish::Feelers(steps)
        } else {
            Wish::Trials(steps)
        };
        self.ladders += 1;
    }

    /// Takes the best of the steps, or none.
    fn judge(&mut self, steps: Vec<Step>, computed: &DMatrix<f64>) {
        let Some((near, pace)) = &mut self.here else { return };
        let gains: Vec<f64> = computed.column_iter().map(|column| near.objective - column.norm_squared()).collect();
        let best = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // The longest of those that are nearly as good as the best: in a curved valley the lowest point of a ladder lies
        // near its foot, and to take that alone is to creep. A comparison with what is no number is false, so a point that
        // could not be computed is never lower, and the step only shrinks.
        let good = |place: &usize| gains[*place] >= 0.25 * best && pace.takes(&steps[*place], gains[*place]);
        match (0..steps.len()).find(good) {
            Some(place) => {
                let step = steps[place].clone();
                pace.after_success(near, &step, gains[place]);
                near.switch(&step.target, gains[place]);
                self.next = step.target.clone();
                self.sizes.zip_apply(&self.next, |size, value| *size = value.abs().max(*size / 2.0));
                self.residuals = Some(computed.column(place).into_owned());
                self.taken = Some(step);
                self.wish = Wish::Tangent;
            }
            None => {
                let last = steps.len() - 1;
                pace.after_failure(near, &steps[last], gains[last]);
                near.switch(&steps[last].target, gains[last]);
                self.plan();
            }
        }
    }

    pub(super) fn end(self) -> Fit {
        let Wish::Nothing(termination) = self.wish else { unreachable!("a descent ends when it wants nothing more") };
        let (near, _) = self.here.expect("every descent that ended stood somewhere");
        Fit {
            point: near.point,
            objective: near.objective,
            residuals: near.tangent.residuals,
            jacobian: near.tangent.jacobian,
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
