//! What is known about a point, and where the damped steps from it lead between the bounds.

use super::quadratic::{Quadratic, lengths};
use super::{Tangent, bounds};
use nalgebra::{DMatrix, DVector};

/// What is known about a point: the residuals taken as straight, `r + J ΔP`.
#[derive(Clone)]
pub(super) struct Neighbourhood {
    pub point: DVector<f64>,
    bounds: Vec<(f64, f64)>,
    pub tangent: Tangent,
    /// S at the point.
    pub objective: f64,
    model: Quadratic,
    /// Those of the rows in the curvature of S, where they are not all one; and whether the model has them.
    weights: Option<DVector<f64>>,
    second_order: bool,
    /// Of the derivatives, relative.
    error: f64,
    /// The lengths of the Jacobian's columns; one for a column without.
    lengths: DVector<f64>,
    /// √Ω. A column without length would leave its variable undamped; one stands in for it, and keeps the variable where
    /// it is.
    scale: DVector<f64>,
    /// Jᵀr.
    slopes: DVector<f64>,
}

impl Neighbourhood {
    /// `longest` is the length of each column of the Jacobian, the longest of those that are to count; `error` that of the
    /// derivatives, relative.
    pub(super) fn new(
        point: DVector<f64>,
        tangent: Tangent,
        (weights, second_order): (Option<DVector<f64>>, bool),
        bounds: &[(f64, f64)],
        longest: &DVector<f64>,
        error: f64,
    ) -> Self {
        let Tangent { residuals, jacobian } = &tangent;
        let lengths = lengths(jacobian).map(|length| if length > 0.0 { length } else { 1.0 });
        Self {
            objective: residuals.norm_squared(),
            bounds: bounds.to_vec(),
            model: Quadratic::new(&tangent, weights.as_ref().filter(|_| second_order), &lengths, error),
            second_order: second_order && weights.is_some(),
            weights,
            error,
            scale: longest.map(|length| if length > 0.0 { length } else { 1.0 }),
            slopes: jacobian.tr_mul(residuals),
            lengths,
            point,
            tangent,
        }
    }

    /// Whether the model of S has the second derivatives of the loss.
    pub(super) fn is_second_order(&self) -> bool {
        self.second_order
    }

    /// Takes of its two models of S the one that comes nearer to what S gained at a target: without the second derivatives
    /// of the loss, which is too stiff where many residuals are far off, or with them, which has no curvature left where
    /// all are (the model switching of Dennis, Gay & Welsch, ACM Trans. Math. Softw. 7, 1981).
    pub(super) fn switch(&mut self, target: &DVector<f64>, gain: f64) {
        let Some(weights) = &self.weights else { return };
        let step = target - &self.point;
        let moved = &self.tangent.jacobian * &step;
        let curvature = [moved.norm_squared(), moved.component_mul(&moved).dot(weights)];
        let off = curvature.map(|curvature| (-2.0 * self.slopes.dot(&step) - curvature - gain).abs());
        // A gain that is no number tells neither from the other.
        let second_order = if self.second_order { off[1] <= off[0] } else { off[1] < off[0] };
        if gain.is_finite() && second_order != self.second_order {
            *self = self.of_order(second_order);
        }
    }

    /// The same with the other model of S.
    fn of_order(&self, second_order: bool) -> Self {
        let weights = self.weights.as_ref().filter(|_| second_order);
        let model = Quadratic::new(&self.tangent, weights, &self.lengths, self.error);
        Self { model, second_order, ..self.clone() }
    }

    /// What the undamped step promises and how long it is, at most by either model of S: at a minimum neither promises more.
    pub(super) fn undamped(&self) -> (f64, f64) {
        let of = |near: &Self| {
            let target = near.cautious_target();
            (near.promise(&target), near.length(&target))
        };
        let (promise, length) = of(self);
        let other = self.weights.as_ref().map(|_| of(&self.of_order(!self.second_order)));
        other.map_or((promise, length), |other| (promise.max(other.0), length.max(other.1)))
    }

    /// The variables that no bound holds back.
    fn free(&self) -> impl Iterator<Item = usize> {
        (0..self.point.len()).filter(|&j| !bounds::holds_back(self.point[j], self.slopes[j], self.bounds[j]))
    }

    /// Whether the residuals are no larger than what the rounding of the variables makes of them.
    pub(super) fn is_rounding(&self) -> bool {
        self.objective.sqrt() <= f64::EPSILON * self.point.component_mul(&self.lengths).norm()
    }

    /// The largest cosine of the angle between the residuals and a column of the Jacobian, over the variables that no
    /// bound holds back: zero at a minimum, whatever the units.
    pub(super) fn steepness(&self) -> f64 {
        let norm = self.objective.sqrt();
        self.free().map(|j| self.slopes[j].abs() / (self.lengths[j] * norm)).fold(0.0, f64::max)
    }

    /// The length of `Jᵀr` over the variables that no bound holds back.
    pub(super) fn slope(&self) -> f64 {
        self.free().map(|j| self.slopes[j].powi(2)).sum::<f64>().sqrt()
    }

    /// Where the step of a damping leads: the least of the damped straight problem, `|r + J ΔP|² + μ |√Ω ΔP|²`,
    /// between the bounds.
    ///
    /// A step that is merely cut off at the bounds can leave a point that is no lower however small the step, and the
    /// iteration stalls. So the bounds are part of the problem: a variable whose bound is met is held on it and the
    /// others are solved for again, and one that the others' new places would draw off its bound is let go (the active
    /// set method: Nocedal & Wright, *Numerical Optimization*, 2006, section 16.5).
    pub(super) fn target(&self, damping: f64) -> DVector<f64> {
        self.reached(damping, 1.0)
    }

    /// Where the undamped step leads when directions that are ten times as strong as the error of the derivatives are
    /// doubted still: what lies along one may be error for the greater part, and promise a reduction that is not there.
    fn cautious_target(&self) -> DVector<f64> {
        self.reached(0.0, 10.0)
    }

    fn reached(&self, damping: f64, caution: f64) -> DVector<f64> {
        let damped =
            (&self.model.floor * caution).zip_map(&self.scale, |floor, scale| floor.hypot(damping.sqrt() * scale));
        let n = self.point.len();
        let mut target = self.point.clone();
        let mut free = vec![true; n];
        // Each turn holds a variable or lets one go for a lower place. Rounding might let the two go on for ever.
        for _ in 0..8 * n {
            let reached = self.solved(&damped, &free, &target);
            if let Some((met, bound, share)) = bounds::first_met(&target, &reached, &self.bounds) {
                target += (reached - &target) * share;
                target[met] = bound;
                free[met] = false;
                continue;
            }
            target = reached;
            let slopes = self.slopes_at(&damped, &target);
            let drawn = |j: &usize| !free[*j] && !bounds::holds_back(target[*j], slopes[*j], self.bounds[*j]);
            let pull = |j: &usize| slopes[*j].abs() / self.scale[*j];
            match (0..n).filter(drawn).max_by(|a, b| pull(a).total_cmp(&pull(b))) {
                Some(drawn) => free[drawn] = true,
                None => break,
            }
        }
        bounds::inside(&target, &self.bounds)
    }

    /// The least of the damped straight problem over the free variables, the others staying at the target.
    fn solved(&self, damped: &DVector<f64>, free: &[bool], target: &DVector<f64>) -> DVector<f64> {
        let moved = DVector::from_fn(free.len(), |j, _| if free[j] { 0.0 } else { target[j] - self.point[j] });
        let mut solved = target.clone();
        let right = -(&self.model.right + &self.model.r * moved);
        if let Some(step) = self.least(damped, free, &right, &self.model.straight) {
            for (step, j) in step.iter().zip((0..free.len()).filter(|&j| free[j])) {
                solved[j] = self.point[j] + step;
            }
        }
        solved
    }

    /// The least of `|R ΔP − right|² + |damped ΔP|² + 2 straightᵀΔP` over the free variables. `None` where a damping is too
    /// small to be told from zero, which leaves the factor singular: then there is no step to take.
    fn least(
        &self,
        damped: &DVector<f64>,
        free: &[bool],
        right: &DVector<f64>,
        straight: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let places: Vec<usize> = (0..free.len()).filter(|&j| free[j]).collect();
        let rows = self.model.r.nrows();
        let mut augmented = DMatrix::zeros(rows + places.len(), places.len());
        for (column, &j) in places.iter().enumerate() {
            augmented.view_mut((0, column), (rows, 1)).copy_from(&self.model.r.column(j));
            augmented[(rows + column, column)] = damped[j];
        }
        let mut projected = DVector::zeros(rows + places.len());
        projected.rows_mut(0, rows).copy_from(right);
        let qr = augmented.qr();
        qr.q_tr_mul(&mut projected);
        let (r, mut projected) = (qr.r(), projected.rows(0, places.len()).into_owned());
        if straight.iter().any(|&pull| pull != 0.0) {
            let pull = DVector::from_iterator(places.len(), places.iter().map(|&j| straight[j]));
            projected -= r.tr_solve_upper_triangular(&pull)?;
        }
        r.solve_upper_triangular(&projected)
    }

    /// Half the slopes of the damped straight problem.
    fn slopes_at(&self, damped: &DVector<f64>, target: &DVector<f64>) -> DVector<f64> {
        let step = target - &self.point;
        let drag = step.component_mul(damped).component_mul(damped);
        &self.slopes + self.model.r.tr_mul(&(&self.model.r * step)) + drag
    }

    /// By how much S would fall at a target if the residuals were straight.
    pub(super) fn promise(&self, target: &DVector<f64>) -> f64 {
        let step = target - &self.point;
        -(2.0 * self.slopes.dot(&step) + (&self.model.r * step).norm_squared())
    }

    /// A step bent along the curve of the residuals, which is known from those a share of the way to its target: half of
    /// `(JᵀJ + μΩ) a = −Jᵀ r″` is added, r″ being their second derivative along the step. Bound variables stay
    /// bound. The step stays straight where the residuals on the way are not known, and where `2 |√Ω a|` is more than 0.75
    /// of its length, as the curve is then known no better than the straight line (Transtrum & Sethna 2012).
    pub(super) fn bent(
        &self,
        damping: f64,
        target: &DVector<f64>,
        share: f64,
        on_the_way: &DVector<f64>,
    ) -> DVector<f64> {
        let step = target - &self.point;
        let rise = (on_the_way - &self.tangent.residuals) / share;
        let mut curve = (rise - &self.tangent.jacobian * &step) * (2.0 / share);
        self.model.qr.q_tr_mul(&mut curve);
        let is_free = |j: usize| self.bounds[j].0 < target[j] && target[j] < self.bounds[j].1;
        let free: Vec<bool> = (0..step.len()).map(is_free).collect();
        let right = -curve.rows(0, self.model.r.nrows()).into_owned();
        let damped = self.scale.zip_map(&self.model.floor, |scale, floor| floor.hypot(damping.sqrt() * scale));
        let Some(found) = self.least(&damped, &free, &right, &DVector::zeros(step.len())) else {
            return target.clone();
        };
        let mut bend = DVector::zeros(step.len());
        for (found, j) in found.iter().zip((0..free.len()).filter(|&j| free[j])) {
            bend[j] = *found;
        }
        // No number compares as within, so residuals that are not known leave the step as it is.
        if 2.0 * self.scaled(&bend) <= 0.75 * self.scaled(&step) {
            bounds::inside(&(target + bend / 2.0), &self.bounds)
        } else {
            target.clone()
        }
    }

    /// The point a share of the way to a target.
    pub(super) fn along(&self, target: &DVector<f64>, share: f64) -> DVector<f64> {
        &self.point + (target - &self.point) * share
    }

    /// Half the slope of S along the way to a target.
    pub(super) fn descent(&self, target: &DVector<f64>) -> f64 {
        self.slopes.dot(&(target - &self.point))
    }

    fn scaled(&self, values: &DVector<f64>) -> f64 {
        values.component_mul(&self.scale).norm()
    }

    /// The length of the way to a target, every variable measured by its effect on the residuals.
    pub(super) fn length(&self, target: &DVector<f64>) -> f64 {
        self.scaled(&(target - &self.point))
    }

    /// The point's distance from zero, measured likewise.
    pub(super) fn distance(&self) -> f64 {
        self.scaled(&self.point)
    }

    /// No step of this damping is longer than one: `|√Ω⁻¹ Jᵀr|`, over the variables that are free to follow it.
    pub(super) fn pull(&self) -> f64 {
        self.free().map(|j| (self.slopes[j] / self.scale[j]).powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(point: &[f64], tangent: Tangent, bounds: &[(f64, f64)]) -> Neighbourhood {
        let longest = lengths(&tangent.jacobian);
        Neighbourhood::new(DVector::from_row_slice(point), tangent, (None, false), bounds, &longest, 1e-9)
    }

    /// Residuals x + y − 3 and x − y at (0, 0): undamped, the step leads to (1.5, 1.5).
    fn tangent() -> Tangent {
        Tangent {
            residuals: DVector::from_vec(vec![-3.0, 0.0]),
            jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, -1.0]),
        }
    }

    #[test]
    fn the_damped_step_solves_the_damped_normal_equations() {
        let jacobian = DMatrix::from_row_slice(4, 3, &[1.0, 2.0, 0.5, 0.3, -1.0, 4.0, 2.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        let residuals = DVector::from_vec(vec![1.0, -2.0, 0.5, 3.0]);
        let tangent = Tangent { residuals: residuals.clone(), jacobian: jacobian.clone() };
        let free = [(f64::NEG_INFINITY, f64::INFINITY); 3];
        for damping in [1e-3, 1.0, 100.0] {
            let step = about(&[0.0; 3], tangent.clone(), &free).target(damping);
            let squares = jacobian.tr_mul(&jacobian);
            let left = &squares + DMatrix::from_diagonal(&squares.diagonal()) * damping;
            assert!((left * step + jacobian.tr_mul(&residuals)).amax() < 1e-13);
        }
    }

    #[test]
    fn a_step_that_meets_a_bound_is_solved_again_along_it() {
        let near = about(&[0.0; 2], tangent(), &[(-1.0, 0.5), (-9.0, 9.0)]);
        // On x = 0.5 the least squares of y − 2.5 and 0.5 − y lie at y = 1.5.
        assert!((near.target(1e-10) - DVector::from_vec(vec![0.5, 1.5])).amax() < 1e-9);
        assert_eq!(near.target(1e-10)[0], 0.5);
        let near = about(&[0.0; 2], tangent(), &[(0.0, 0.0), (0.0, 0.0)]);
        assert_eq!(near.target(1.0), near.point);
    }

    #[test]
    fn a_variable_without_effect_stays_where_it_is() {
        let tangent = Tangent {
            residuals: DVector::from_vec(vec![1.0, 1.0]),
            jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 0.0]),
        };
        let target = about(&[0.0; 2], tangent, &[(-9.0, 9.0); 2]).target(1e-10);
        assert!((target - DVector::from_vec(vec![-0.6, 0.0])).amax() < 1e-9);
    }

    /// S of a row of weight zero is a straight line, and of one of a quarter a parabola of a quarter of the curvature.
    #[test]
    fn rows_count_in_the_curvature_by_their_weights_and_in_the_slope_in_full() {
        let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 0.3, -1.0, 2.0, 0.5]);
        let tangent = Tangent { residuals: DVector::from_vec(vec![1.0, -2.0, 0.5]), jacobian: jacobian.clone() };
        let weights = DVector::from_vec(vec![1.0, 0.25, 0.0]);
        let lengths = lengths(&jacobian);
        let bounds = [(f64::NEG_INFINITY, f64::INFINITY); 2];
        let start = DVector::zeros(2);
        let near = Neighbourhood::new(start, tangent.clone(), (Some(weights.clone()), true), &bounds, &lengths, 1e-9);
        let squares = jacobian.tr_mul(&DMatrix::from_diagonal(&weights)) * &jacobian;
        let step = near.target(0.0);
        assert!((squares * step + jacobian.tr_mul(&tangent.residuals)).amax() < 1e-12);
    }

    #[test]
    fn the_model_that_foretold_a_gain_better_is_taken() {
        let weights = DVector::from_vec(vec![0.0, 1.0]);
        let lengths = lengths(&tangent().jacobian);
        let bounds = [(-9.0, 9.0); 2];
        let mut near =
            Neighbourhood::new(DVector::zeros(2), tangent(), (Some(weights), false), &bounds, &lengths, 1e-9);
        // Along (1, 1) S of straight residuals gains 12 − 4, and without the curvature of the first 12.
        let target = DVector::from_vec(vec![1.0, 1.0]);
        assert!((near.promise(&target) - 8.0).abs() < 1e-12);
        near.switch(&target, f64::NAN);
        near.switch(&target, 9.0);
        assert!(!near.is_second_order());
        near.switch(&target, 11.0);
        assert!(near.is_second_order() && (near.promise(&target) - 12.0).abs() < 1e-12);
    }

    #[test]
    fn the_promise_of_a_straight_problem_is_kept() {
        let near = about(&[0.0; 2], tangent(), &[(-9.0, 9.0); 2]);
        assert!((near.promise(&near.target(1e-10)) - 9.0).abs() < 1e-12);
        assert_eq!(near.objective, 9.0);
    }
}
