//! What is known about a point, and where the damped steps from it lead between the bounds.

use super::{Tangent, bounds};
use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector, Dyn};

/// What is known about a point: the residuals taken as straight, `r + J ΔP`, kept as `R ΔP + Qᵀr` with `J = QR`,
/// which has the same least squares and only as many rows as variables.
pub(super) struct Neighbourhood {
    pub point: DVector<f64>,
    bounds: Vec<(f64, f64)>,
    pub tangent: Tangent,
    /// S at the point.
    pub objective: f64,
    qr: QR<f64, Dyn, Dyn>,
    r: DMatrix<f64>,
    right: DVector<f64>,
    /// The lengths of the Jacobian's columns; one for a column without.
    lengths: DVector<f64>,
    /// √Ω. A column without length would leave its variable undamped; one stands in for it, and keeps the variable where
    /// it is.
    scale: DVector<f64>,
    /// The damping of every step, beside μΩ: what the error of the derivatives calls for.
    floor: DVector<f64>,
    /// Jᵀr.
    slopes: DVector<f64>,
}

impl Neighbourhood {
    /// `longest` is the length of each column of the Jacobian, the longest of those that are to count; `error` that of the
    /// derivatives, relative.
    pub(super) fn new(
        point: DVector<f64>,
        tangent: Tangent,
        bounds: &[(f64, f64)],
        longest: &DVector<f64>,
        error: f64,
    ) -> Self {
        let Tangent { residuals, jacobian } = &tangent;
        let qr = jacobian.clone().qr();
        let mut right = residuals.clone();
        qr.q_tr_mul(&mut right);
        let lengths = lengths(jacobian).map(|length| if length > 0.0 { length } else { 1.0 });
        let r = without_error(qr.r(), &lengths, error);
        Self {
            point,
            bounds: bounds.to_vec(),
            objective: residuals.norm_squared(),
            right: right.rows(0, r.nrows()).into_owned(),
            r,
            qr,
            floor: &lengths * error,
            lengths,
            scale: longest.map(|length| if length > 0.0 { length } else { 1.0 }),
            slopes: jacobian.tr_mul(residuals),
            tangent,
        }
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
    pub(super) fn cautious_target(&self) -> DVector<f64> {
        self.reached(0.0, 10.0)
    }

    fn reached(&self, damping: f64, caution: f64) -> DVector<f64> {
        let damped = (&self.floor * caution).zip_map(&self.scale, |floor, scale| floor.hypot(damping.sqrt() * scale));
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
        let right = -(&self.right + &self.r * moved);
        if let Some(step) = self.least(damped, free, &right) {
            for (step, j) in step.iter().zip((0..free.len()).filter(|&j| free[j])) {
                solved[j] = self.point[j] + step;
            }
        }
        solved
    }

    /// The least of `|R ΔP − right|² + |damped ΔP|²` over the free variables. `None` where a damping is too small to be
    /// told from zero, which leaves the factor singular: then there is no step to take.
    fn least(&self, damped: &DVector<f64>, free: &[bool], right: &DVector<f64>) -> Option<DVector<f64>> {
        let places: Vec<usize> = (0..free.len()).filter(|&j| free[j]).collect();
        let rows = self.r.nrows();
        let mut augmented = DMatrix::zeros(rows + places.len(), places.len());
        for (column, &j) in places.iter().enumerate() {
            augmented.view_mut((0, column), (rows, 1)).copy_from(&self.r.column(j));
            augmented[(rows + column, column)] = damped[j];
        }
        let mut projected = DVector::zeros(rows + places.len());
        projected.rows_mut(0, rows).copy_from(right);
        let qr = augmented.qr();
        qr.q_tr_mul(&mut projected);
        qr.r().solve_upper_triangular(&projected.rows(0, places.len()))
    }

    /// Half the slopes of the damped straight problem.
    fn slopes_at(&self, damped: &DVector<f64>, target: &DVector<f64>) -> DVector<f64> {
        let step = target - &self.point;
        let drag = step.component_mul(damped).component_mul(damped);
        &self.slopes + self.r.tr_mul(&(&self.r * step)) + drag
    }

    /// By how much S would fall at a target if the residuals were straight.
    pub(super) fn promise(&self, target: &DVector<f64>) -> f64 {
        let step = target - &self.point;
        -(2.0 * self.slopes.dot(&step) + (&self.r * step).norm_squared())
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
        self.qr.q_tr_mul(&mut curve);
        let is_free = |j: usize| self.bounds[j].0 < target[j] && target[j] < self.bounds[j].1;
        let free: Vec<bool> = (0..step.len()).map(is_free).collect();
        let right = -curve.rows(0, self.r.nrows()).into_owned();
        let damped = self.scale.zip_map(&self.floor, |scale, floor| floor.hypot(damping.sqrt() * scale));
        let Some(found) = self.least(&damped, &free, &right) else { return target.clone() };
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

/// A triangular factor without the directions in which it is weaker, its columns brought to unit length, than the error
/// of the derivatives: what they say is error, and one that is followed leads anywhere.
fn without_error(r: DMatrix<f64>, lengths: &DVector<f64>, error: f64) -> DMatrix<f64> {
    let scaled = DMatrix::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] / lengths[j]);
    if !scaled.iter().all(|value| value.is_finite()) {
        return r;
    }
    // The limit is one that no matrix of this size should meet; without it one that does would hang.
    let Some(mut svd) = scaled.try_svd(true, true, f64::EPSILON, 10_000) else { return r };
    let floor = error * svd.singular_values.max();
    if svd.singular_values.min() > floor {
        return r;
    }
    svd.singular_values.apply(|value| *value = if *value > floor { *value } else { 0.0 });
    let Ok(mut kept) = svd.recompose() else { return r };
    kept.column_iter_mut().zip(lengths.iter()).for_each(|(mut column, &length)| column *= length);
    kept
}

/// The length of every column of a Jacobian.
pub(super) fn lengths(jacobian: &DMatrix<f64>) -> DVector<f64> {
    DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(|column| column.norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(point: &[f64], tangent: Tangent, bounds: &[(f64, f64)]) -> Neighbourhood {
        let longest = lengths(&tangent.jacobian);
        Neighbourhood::new(DVector::from_row_slice(point), tangent, bounds, &longest, 1e-9)
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

    #[test]
    fn the_promise_of_a_straight_problem_is_kept() {
        let near = about(&[0.0; 2], tangent(), &[(-9.0, 9.0); 2]);
        assert!((near.promise(&near.target(1e-10)) - 9.0).abs() < 1e-12);
        assert_eq!(near.objective, 9.0);
    }
}
