//! Linear model of the residuals at a point, and its damped steps between the bounds.

use super::quadratic::{Quadratic, column_norms};
use super::{Tangent, bounds};
use nalgebra::{DMatrix, DVector};

/// Linearised residuals at a point, `r + J ΔP`, with scaling and bounds.
#[derive(Clone)]
pub(super) struct LinearModel {
    pub point: DVector<f64>,
    bounds: Vec<(f64, f64)>,
    pub tangent: Tangent,
    /// S at the point.
    pub objective: f64,
    quadratic: Quadratic,
    /// Curvature weights of the rows where they are not all one, and whether the quadratic model uses them.
    curvature_weights: Option<DVector<f64>>,
    second_order: bool,
    /// Relative error of the derivatives.
    derivative_error: f64,
    /// Norms of the Jacobian's columns; one for a zero column.
    column_norms: DVector<f64>,
    /// Scales of the variables, √Ω. A zero column would leave its variable undamped; a scale of one holds the variable
    /// where it is.
    scaling: DVector<f64>,
    /// Jᵀr, half the gradient of S.
    gradient: DVector<f64>,
}

impl LinearModel {
    /// `max_column_norms` scale the damping; `derivative_error` is relative.
    pub(super) fn new(
        point: DVector<f64>,
        tangent: Tangent,
        (weights, second_order): (Option<DVector<f64>>, bool),
        bounds: &[(f64, f64)],
        max_column_norms: &DVector<f64>,
        derivative_error: f64,
    ) -> Self {
        let Tangent { residuals, jacobian } = &tangent;
        let lengths = column_norms(jacobian).map(|length| if length > 0.0 { length } else { 1.0 });
        Self {
            objective: residuals.norm_squared(),
            bounds: bounds.to_vec(),
            quadratic: Quadratic::new(&tangent, weights.as_ref().filter(|_| second_order), &lengths, derivative_error),
            second_order: second_order && weights.is_some(),
            curvature_weights: weights,
            derivative_error,
            scaling: max_column_norms.map(|length| if length > 0.0 { length } else { 1.0 }),
            gradient: jacobian.tr_mul(residuals),
            column_norms: lengths,
            point,
            tangent,
        }
    }

    /// Whether the quadratic model includes the second derivatives of the loss.
    pub(super) fn is_second_order(&self) -> bool {
        self.second_order
    }

    /// Switches to the quadratic model that predicted the actual reduction at a trial point better: without the second
    /// derivatives of the loss, which is too stiff where many residuals are large, or with them, which loses its
    /// curvature where all are (model switching of Dennis, Gay & Welsch, ACM Trans. Math. Softw. 7, 1981).
    pub(super) fn switch_quadratic(&mut self, trial_point: &DVector<f64>, reduction: f64) {
        let Some(weights) = &self.curvature_weights else { return };
        let step = trial_point - &self.point;
        let moved = &self.tangent.jacobian * &step;
        let curvature = [moved.norm_squared(), moved.component_mul(&moved).dot(weights)];
        let errors = curvature.map(|curvature| (-2.0 * self.gradient.dot(&step) - curvature - reduction).abs());
        // A reduction that is not finite favours neither model.
        let second_order = if self.second_order { errors[1] <= errors[0] } else { errors[1] < errors[0] };
        if reduction.is_finite() && second_order != self.second_order {
            *self = self.with_order(second_order);
        }
    }

    /// The linear model with or without the second derivatives of the loss.
    fn with_order(&self, second_order: bool) -> Self {
        let weights = self.curvature_weights.as_ref().filter(|_| second_order);
        let model = Quadratic::new(&self.tangent, weights, &self.column_norms, self.derivative_error);
        Self { quadratic: model, second_order, ..self.clone() }
    }

    /// Predicted reduction and length of the undamped step, each the larger of the two quadratic models: at a minimum
    /// both predict none.
    pub(super) fn undamped_prediction(&self) -> (f64, f64) {
        let predict = |linear: &Self| {
            let trial_point = linear.cautious_trial_point();
            (linear.predicted_reduction(&trial_point), linear.step_length(&trial_point))
        };
        let (reduction, length) = predict(self);
        let other = self.curvature_weights.as_ref().map(|_| predict(&self.with_order(!self.second_order)));
        other.map_or((reduction, length), |other| (reduction.max(other.0), length.max(other.1)))
    }

    /// The variables without an active bound.
    fn free_variables(&self) -> impl Iterator<Item = usize> {
        (0..self.point.len()).filter(|&j| !bounds::is_active(self.point[j], self.gradient[j], self.bounds[j]))
    }

    /// Whether the residuals are at the level of the rounding error of the variables.
    pub(super) fn is_at_rounding_level(&self) -> bool {
        self.objective.sqrt() <= f64::EPSILON * self.point.component_mul(&self.column_norms).norm()
    }

    /// The largest cosine of the angle between the residuals and a column of the Jacobian, over the variables without
    /// an active bound. Zero at a minimum; independent of units.
    pub(super) fn gradient_cosine(&self) -> f64 {
        let norm = self.objective.sqrt();
        self.free_variables().map(|j| self.gradient[j].abs() / (self.column_norms[j] * norm)).fold(0.0, f64::max)
    }

    /// The norm of `Jᵀr` over the variables without an active bound.
    pub(super) fn gradient_norm(&self) -> f64 {
        self.free_variables().map(|j| self.gradient[j].powi(2)).sum::<f64>().sqrt()
    }

    /// The trial point for a damping: the minimum of `|r + J ΔP|² + μ |√Ω ΔP|²` between the bounds.
    ///
    /// A step that is truncated at the bounds can fail to lower S at any length, and the iteration stalls. So the
    /// bounds are part of the subproblem: a variable that meets a bound is held on it and the others are solved for
    /// again, and a variable whose bound is no longer active is released (active-set method: Nocedal & Wright,
    /// *Numerical Optimization*, 2006, section 16.5).
    pub(super) fn trial_point(&self, damping: f64) -> DVector<f64> {
        self.solve_bounded(damping, 1.0)
    }

    /// The trial point of the undamped step, with the damping floor ten times as high: directions near the error level
    /// of the derivatives consist largely of error, and their predicted reduction is not real.
    fn cautious_trial_point(&self) -> DVector<f64> {
        self.solve_bounded(0.0, 10.0)
    }

    fn solve_bounded(&self, damping: f64, caution: f64) -> DVector<f64> {
        let damped = (&self.quadratic.damping_floor * caution)
            .zip_map(&self.scaling, |floor, scale| floor.hypot(damping.sqrt() * scale));
        let n = self.point.len();
        let mut trial_point = self.point.clone();
        let mut free = vec![true; n];
        // Each pass holds or releases one variable and lowers the objective. Rounding could make it cycle, hence the
        // limit.
        for _ in 0..8 * n {
            let reached = self.solve_free(&damped, &free, &trial_point);
            if let Some((met, bound, share)) = bounds::first_crossed(&trial_point, &reached, &self.bounds) {
                trial_point += (reached - &trial_point) * share;
                trial_point[met] = bound;
                free[met] = false;
                continue;
            }
            trial_point = reached;
            let slopes = self.damped_gradient(&damped, &trial_point);
            let is_released = |j: &usize| !free[*j] && !bounds::is_active(trial_point[*j], slopes[*j], self.bounds[*j]);
            let pull = |j: &usize| slopes[*j].abs() / self.scaling[*j];
            match (0..n).filter(is_released).max_by(|a, b| pull(a).total_cmp(&pull(b))) {
                Some(released) => free[released] = true,
                None => break,
            }
        }
        bounds::clamped(&trial_point, &self.bounds)
    }

    /// The minimum of the damped linear problem over the free variables, with the others at the trial point.
    fn solve_free(&self, damped: &DVector<f64>, free: &[bool], trial_point: &DVector<f64>) -> DVector<f64> {
        let moved = DVector::from_fn(free.len(), |j, _| if free[j] { 0.0 } else { trial_point[j] - self.point[j] });
        let mut solved = trial_point.clone();
        let rhs = -(&self.quadratic.rhs + &self.quadratic.r * moved);
        if let Some(step) = self.solve_damped(damped, free, &rhs, &self.quadratic.unweighted_gradient) {
            for (step, j) in step.iter().zip((0..free.len()).filter(|&j| free[j])) {
                solved[j] = self.point[j] + step;
            }
        }
        solved
    }

    /// The minimum of `|R ΔP − rhs|² + |damped ΔP|² + 2 gᵀΔP` over the free variables, g being `unweighted_gradient`.
    /// `None` for a damping so small that the factor is singular; then no step is taken.
    fn solve_damped(
        &self,
        damped: &DVector<f64>,
        free: &[bool],
        rhs: &DVector<f64>,
        unweighted_gradient: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let indices: Vec<usize> = (0..free.len()).filter(|&j| free[j]).collect();
        let rows = self.quadratic.r.nrows();
        let mut augmented = DMatrix::zeros(rows + indices.len(), indices.len());
        for (column, &j) in indices.iter().enumerate() {
            augmented.view_mut((0, column), (rows, 1)).copy_from(&self.quadratic.r.column(j));
            augmented[(rows + column, column)] = damped[j];
        }
        let mut projected = DVector::zeros(rows + indices.len());
        projected.rows_mut(0, rows).copy_from(rhs);
        let qr = augmented.qr();
        qr.q_tr_mul(&mut projected);
        let (r, mut projected) = (qr.r(), projected.rows(0, indices.len()).into_owned());
        if unweighted_gradient.iter().any(|&pull| pull != 0.0) {
            let pull = DVector::from_iterator(indices.len(), indices.iter().map(|&j| unweighted_gradient[j]));
            projected -= r.tr_solve_upper_triangular(&pull)?;
        }
        r.solve_upper_triangular(&projected)
    }

    /// Half the gradient of the damped linear problem.
    fn damped_gradient(&self, damped: &DVector<f64>, trial_point: &DVector<f64>) -> DVector<f64> {
        let step = trial_point - &self.point;
        let drag = step.component_mul(damped).component_mul(damped);
        &self.gradient + self.quadratic.r.tr_mul(&(&self.quadratic.r * step)) + drag
    }

    /// Reduction of S at a trial point that the quadratic model predicts.
    pub(super) fn predicted_reduction(&self, trial_point: &DVector<f64>) -> f64 {
        let step = trial_point - &self.point;
        -(2.0 * self.gradient.dot(&step) + (&self.quadratic.r * step).norm_squared())
    }

    /// Geodesic acceleration (Transtrum & Sethna 2012): adds half of the solution a of `(JᵀJ + μΩ) a = −Jᵀ r″`, where
    /// r″ is the second derivative of the residuals along the step, from `probed` residuals at this fraction of the
    /// step. Variables on bounds stay on them. The step is not changed where the probed residuals are not finite, or
    /// where `2 |√Ω a|` exceeds 0.75 of the step's length, as second order is then no better than first.
    pub(super) fn accelerated(
        &self,
        damping: f64,
        trial_point: &DVector<f64>,
        share: f64,
        probed: &DVector<f64>,
    ) -> DVector<f64> {
        let step = trial_point - &self.point;
        let rise = (probed - &self.tangent.residuals) / share;
        let mut second_derivative = (rise - &self.tangent.jacobian * &step) * (2.0 / share);
        self.quadratic.qr.q_tr_mul(&mut second_derivative);
        let is_free = |j: usize| self.bounds[j].0 < trial_point[j] && trial_point[j] < self.bounds[j].1;
        let free: Vec<bool> = (0..step.len()).map(is_free).collect();
        let rhs = -second_derivative.rows(0, self.quadratic.r.nrows()).into_owned();
        let damped =
            self.scaling.zip_map(&self.quadratic.damping_floor, |scale, floor| floor.hypot(damping.sqrt() * scale));
        let Some(found) = self.solve_damped(&damped, &free, &rhs, &DVector::zeros(step.len())) else {
            return trial_point.clone();
        };
        let mut acceleration = DVector::zeros(step.len());
        for (found, j) in found.iter().zip((0..free.len()).filter(|&j| free[j])) {
            acceleration[j] = *found;
        }
        // Comparisons with NaN are false, so residuals that are not finite leave the step as it is.
        if 2.0 * self.scaled_norm(&acceleration) <= 0.75 * self.scaled_norm(&step) {
            bounds::clamped(&(trial_point + acceleration / 2.0), &self.bounds)
        } else {
            trial_point.clone()
        }
    }

    /// The point at this fraction of the step to a trial point.
    pub(super) fn point_along(&self, trial_point: &DVector<f64>, share: f64) -> DVector<f64> {
        &self.point + (trial_point - &self.point) * share
    }

    /// Half the directional derivative of S along the step to a trial point.
    pub(super) fn directional_derivative(&self, trial_point: &DVector<f64>) -> f64 {
        self.gradient.dot(&(trial_point - &self.point))
    }

    fn scaled_norm(&self, values: &DVector<f64>) -> f64 {
        values.component_mul(&self.scaling).norm()
    }

    /// Length of the step to a trial point, `|√Ω ΔP|`.
    pub(super) fn step_length(&self, trial_point: &DVector<f64>) -> f64 {
        self.scaled_norm(&(trial_point - &self.point))
    }

    /// Distance of the point from zero, `|√Ω P|`.
    pub(super) fn distance_from_zero(&self) -> f64 {
        self.scaled_norm(&self.point)
    }

    /// `|√Ω⁻¹ Jᵀr|` over the variables without an active bound; divided by a radius it is the largest damping of that
    /// radius.
    pub(super) fn scaled_gradient_norm(&self) -> f64 {
        self.free_variables().map(|j| (self.gradient[j] / self.scaling[j]).powi(2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(point: &[f64], tangent: Tangent, bounds: &[(f64, f64)]) -> LinearModel {
        let longest = column_norms(&tangent.jacobian);
        LinearModel::new(DVector::from_row_slice(point), tangent, (None, false), bounds, &longest, 1e-9)
    }

    /// Residuals x + y − 3 and x − y at (0, 0): the undamped step leads to (1.5, 1.5).
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
            let step = about(&[0.0; 3], tangent.clone(), &free).trial_point(damping);
            let squares = jacobian.tr_mul(&jacobian);
            let left = &squares + DMatrix::from_diagonal(&squares.diagonal()) * damping;
            assert!((left * step + jacobian.tr_mul(&residuals)).amax() < 1e-13);
        }
    }

    #[test]
    fn a_step_that_meets_a_bound_is_solved_again_on_the_bound() {
        let linear = about(&[0.0; 2], tangent(), &[(-1.0, 0.5), (-9.0, 9.0)]);
        // On x = 0.5 the least squares of y − 2.5 and 0.5 − y are at y = 1.5.
        assert!((linear.trial_point(1e-10) - DVector::from_vec(vec![0.5, 1.5])).amax() < 1e-9);
        assert_eq!(linear.trial_point(1e-10)[0], 0.5);
        let linear = about(&[0.0; 2], tangent(), &[(0.0, 0.0), (0.0, 0.0)]);
        assert_eq!(linear.trial_point(1.0), linear.point);
    }

    #[test]
    fn a_variable_without_effect_does_not_move() {
        let tangent = Tangent {
            residuals: DVector::from_vec(vec![1.0, 1.0]),
            jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 0.0]),
        };
        let trial_point = about(&[0.0; 2], tangent, &[(-9.0, 9.0); 2]).trial_point(1e-10);
        assert!((trial_point - DVector::from_vec(vec![-0.6, 0.0])).amax() < 1e-9);
    }

    /// A row of weight zero makes S linear, one of a quarter a parabola with a quarter of the curvature.
    #[test]
    fn weights_scale_the_curvature_of_rows_but_not_their_gradient() {
        let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 0.3, -1.0, 2.0, 0.5]);
        let tangent = Tangent { residuals: DVector::from_vec(vec![1.0, -2.0, 0.5]), jacobian: jacobian.clone() };
        let weights = DVector::from_vec(vec![1.0, 0.25, 0.0]);
        let lengths = column_norms(&jacobian);
        let bounds = [(f64::NEG_INFINITY, f64::INFINITY); 2];
        let start = DVector::zeros(2);
        let linear = LinearModel::new(start, tangent.clone(), (Some(weights.clone()), true), &bounds, &lengths, 1e-9);
        let squares = jacobian.tr_mul(&DMatrix::from_diagonal(&weights)) * &jacobian;
        let step = linear.trial_point(0.0);
        assert!((squares * step + jacobian.tr_mul(&tangent.residuals)).amax() < 1e-12);
    }

    #[test]
    fn the_model_with_the_better_predicted_reduction_is_chosen() {
        let weights = DVector::from_vec(vec![0.0, 1.0]);
        let lengths = column_norms(&tangent().jacobian);
        let bounds = [(-9.0, 9.0); 2];
        let mut linear =
            LinearModel::new(DVector::zeros(2), tangent(), (Some(weights), false), &bounds, &lengths, 1e-9);
        // Along (1, 1) the linear residuals give a reduction of 12 − 4, and 12 without the curvature of the first.
        let trial_point = DVector::from_vec(vec![1.0, 1.0]);
        assert!((linear.predicted_reduction(&trial_point) - 8.0).abs() < 1e-12);
        linear.switch_quadratic(&trial_point, f64::NAN);
        linear.switch_quadratic(&trial_point, 9.0);
        assert!(!linear.is_second_order());
        linear.switch_quadratic(&trial_point, 11.0);
        assert!(linear.is_second_order() && (linear.predicted_reduction(&trial_point) - 12.0).abs() < 1e-12);
    }

    #[test]
    fn the_predicted_reduction_of_a_linear_problem_is_exact() {
        let linear = about(&[0.0; 2], tangent(), &[(-9.0, 9.0); 2]);
        assert!((linear.predicted_reduction(&linear.trial_point(1e-10)) - 9.0).abs() < 1e-12);
        assert_eq!(linear.objective, 9.0);
    }
}
