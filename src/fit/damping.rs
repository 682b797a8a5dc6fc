//! The damped step, and how it is bent where it meets a bound.

use super::{Tangent, bounds};
use nalgebra::{DMatrix, DVector};

/// The least damping of a step. Directions in which the scaled Jacobian is weaker than its root, 1e-5, are damped
/// away rather than followed wherever the error of the derivatives points.
pub(super) const LEAST: f64 = 1e-10;
/// The damping of a step that counts as undamped where a minimum is to be told. Derivatives by differences carry
/// errors well above rounding, and a direction that consists of nothing else promises a reduction that is not there;
/// one weaker than 1e-4 of the scaled Jacobian therefore counts the less the weaker it is.
pub(super) const TRUSTED: f64 = 1e-8;

/// The dampings that are tried at once about μ: the paper's 0.1 μ after a success and its 10 μ after a failure, μ
/// itself, and a half, since in a curved valley a tenth often is just too little.
pub(super) fn ladder(damping: f64) -> [f64; 4] {
    [0.1, 0.5, 1.0, 10.0].map(|rung| (rung * damping).max(LEAST))
}

/// The damping about which to try again when all of a ladder has failed, so that its first rung follows on by the
/// paper's factor of ten.
pub(super) fn beyond(rungs: &[f64; 4]) -> f64 {
    100.0 * rungs[3]
}

/// What is known about a point: the residuals taken as straight, `r + J ΔP`, kept as `R ΔP + Qᵀr` with `J = QR`,
/// which has the same least squares and only as many rows as variables.
pub(super) struct Neighbourhood<'a> {
    point: &'a DVector<f64>,
    bounds: &'a [(f64, f64)],
    /// S at the point.
    pub objective: f64,
    r: DMatrix<f64>,
    right: DVector<f64>,
    /// √Ω: the lengths of the Jacobian's columns. A column without length would leave its variable undamped; one
    /// stands in for it, and keeps the variable where it is.
    scale: DVector<f64>,
    /// Jᵀr.
    slopes: DVector<f64>,
    finite: bool,
}

impl<'a> Neighbourhood<'a> {
    pub(super) fn new(point: &'a DVector<f64>, tangent: &Tangent, bounds: &'a [(f64, f64)]) -> Self {
        let Tangent { residuals, jacobian } = tangent;
        let lengths = DVector::from_iterator(point.len(), jacobian.column_iter().map(|column| column.norm()));
        let qr = jacobian.clone().qr();
        let mut right = residuals.clone();
        qr.q_tr_mul(&mut right);
        let r = qr.r();
        Self {
            point,
            bounds,
            objective: residuals.norm_squared(),
            right: right.rows(0, r.nrows()).into_owned(),
            r,
            scale: lengths.map(|length| if length > 0.0 { length } else { 1.0 }),
            slopes: jacobian.tr_mul(residuals),
            finite: residuals.norm_squared().is_finite() && lengths.iter().all(|length| length.is_finite()),
        }
    }

    /// Whether residuals and derivatives are numbers, and their squares too.
    pub(super) fn finite(&self) -> bool {
        self.finite
    }

    /// The largest cosine of the angle between the residuals and a column of the Jacobian, over the variables that no
    /// bound holds back: zero at a minimum, whatever the units.
    pub(super) fn steepness(&self) -> f64 {
        let norm = self.objective.sqrt();
        let free = |j: &usize| !bounds::holds_back(self.point[*j], self.slopes[*j], self.bounds[*j]);
        let cosines = (0..self.point.len()).filter(free).map(|j| self.slopes[j].abs() / (self.scale[j] * norm));
        cosines.fold(0.0, f64::max)
    }

    /// Where the step of a damping leads: the least of the damped straight problem, `|r + J ΔP|² + μ |√Ω ΔP|²`,
    /// between the bounds.
    ///
    /// A step that is merely cut off at the bounds can leave a point that is no lower however small the step, and the
    /// iteration stalls. So the bounds are part of the problem: a variable whose bound is met is held on it and the
    /// others are solved for again, and one that the others' new places would draw off its bound is let go (the active
    /// set method: Nocedal & Wright, *Numerical Optimization*, 2006, section 16.5).
    pub(super) fn target(&self, damping: f64) -> DVector<f64> {
        let n = self.point.len();
        let mut target = self.point.clone();
        let mut free = vec![true; n];
        // Each turn holds a variable or lets one go for a lower place. Rounding might let the two go on for ever.
        for _ in 0..8 * n {
            let reached = self.solved(damping, &free, &target);
            if let Some((met, bound, share)) = bounds::first_met(&target, &reached, self.bounds) {
                target += (reached - &target) * share;
                target[met] = bound;
                free[met] = false;
                continue;
            }
            target = reached;
            let slopes = self.slopes_at(damping, &target);
            let drawn = |j: &usize| !free[*j] && !bounds::holds_back(target[*j], slopes[*j], self.bounds[*j]);
            let pull = |j: &usize| slopes[*j].abs() / self.scale[*j];
            match (0..n).filter(drawn).max_by(|a, b| pull(a).total_cmp(&pull(b))) {
                Some(drawn) => free[drawn] = true,
                None => break,
            }
        }
        bounds::inside(&target, self.bounds)
    }

    /// The least of the damped straight problem over the free variables, the others staying at the target.
    fn solved(&self, damping: f64, free: &[bool], target: &DVector<f64>) -> DVector<f64> {
        let places: Vec<usize> = (0..free.len()).filter(|&j| free[j]).collect();
        let moved = DVector::from_fn(free.len(), |j, _| if free[j] { 0.0 } else { target[j] - self.point[j] });
        let rows = self.r.nrows();
        let mut augmented = DMatrix::zeros(rows + places.len(), places.len());
        let mut right = DVector::zeros(rows + places.len());
        for (column, &j) in places.iter().enumerate() {
            augmented.view_mut((0, column), (rows, 1)).copy_from(&self.r.column(j));
            augmented[(rows + column, column)] = damping.sqrt() * self.scale[j];
        }
        right.rows_mut(0, rows).copy_from(&-(&self.right + &self.r * moved));
        let qr = augmented.qr();
        qr.q_tr_mul(&mut right);

        let mut solved = target.clone();
        // Only a scale too small for its product with √μ makes the factor singular; then there is no step to take.
        if let Some(step) = qr.r().solve_upper_triangular(&right.rows(0, places.len())) {
            for (column, &j) in places.iter().enumerate() {
                solved[j] = self.point[j] + step[column];
            }
        }
        solved
    }

    /// Half the slopes of the damped straight problem.
    fn slopes_at(&self, damping: f64, target: &DVector<f64>) -> DVector<f64> {
        let step = target - self.point;
        let drag = step.component_mul(&self.scale).component_mul(&self.scale) * damping;
        &self.slopes + self.r.tr_mul(&(&self.r * step)) + drag
    }

    /// By how much S would fall at a target if the residuals were straight.
    pub(super) fn promise(&self, target: &DVector<f64>) -> f64 {
        let step = target - self.point;
        -(2.0 * self.slopes.dot(&step) + (&self.r * step).norm_squared())
    }

    /// Whether the way to a target is no more than a share of the point's distance from zero, every variable measured
    /// by its effect on the residuals (MINPACK's test of the step).
    pub(super) fn negligible(&self, target: &DVector<f64>, share: f64) -> bool {
        let scaled = |values: &DVector<f64>| values.component_mul(&self.scale).norm();
        scaled(&(target - self.point)) <= share * scaled(self.point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals x + y − 3 and x − y at (0, 0): undamped, the step leads to (1.5, 1.5).
    fn tangent() -> Tangent {
        Tangent {
            residuals: DVector::from_vec(vec![-3.0, 0.0]),
            jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, -1.0]),
        }
    }

    #[test]
    fn the_damped_step_solves_the_damped_normal_equations() {
        let point = DVector::from_vec(vec![0.0, 0.0, 0.0]);
        let jacobian = DMatrix::from_row_slice(4, 3, &[1.0, 2.0, 0.5, 0.3, -1.0, 4.0, 2.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
        let residuals = DVector::from_vec(vec![1.0, -2.0, 0.5, 3.0]);
        let tangent = Tangent { residuals: residuals.clone(), jacobian: jacobian.clone() };
        let free = [(f64::NEG_INFINITY, f64::INFINITY); 3];
        for damping in [1e-3, 1.0, 100.0] {
            let step = Neighbourhood::new(&point, &tangent, &free).target(damping);
            let squares = jacobian.tr_mul(&jacobian);
            let left = &squares + DMatrix::from_diagonal(&squares.diagonal()) * damping;
            assert!((left * step + jacobian.tr_mul(&residuals)).amax() < 1e-13);
        }
    }

    #[test]
    fn a_step_that_meets_a_bound_is_solved_again_along_it() {
        let (point, tangent) = (DVector::from_vec(vec![0.0, 0.0]), tangent());
        let near = Neighbourhood::new(&point, &tangent, &[(-1.0, 0.5), (-9.0, 9.0)]);
        // On x = 0.5 the least squares of y − 2.5 and 0.5 − y lie at y = 1.5.
        assert!((near.target(LEAST) - DVector::from_vec(vec![0.5, 1.5])).amax() < 1e-9);
        assert_eq!(near.target(LEAST)[0], 0.5);
        let near = Neighbourhood::new(&point, &tangent, &[(0.0, 0.0), (0.0, 0.0)]);
        assert_eq!(near.target(1.0), point);
    }

    #[test]
    fn a_variable_without_effect_stays_where_it_is() {
        let point = DVector::from_vec(vec![0.0, 0.0]);
        let tangent = Tangent {
            residuals: DVector::from_vec(vec![1.0, 1.0]),
            jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 0.0]),
        };
        let target = Neighbourhood::new(&point, &tangent, &[(-9.0, 9.0); 2]).target(LEAST);
        assert!((target - DVector::from_vec(vec![-0.6, 0.0])).amax() < 1e-9);
    }

    #[test]
    fn the_promise_of_a_straight_problem_is_kept() {
        let (point, tangent) = (DVector::from_vec(vec![0.0, 0.0]), tangent());
        let near = Neighbourhood::new(&point, &tangent, &[(-9.0, 9.0); 2]);
        assert!((near.promise(&near.target(LEAST)) - 9.0).abs() < 1e-12);
        assert_eq!(near.objective, 9.0);
    }
}
