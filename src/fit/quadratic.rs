//! Quadratic model of S about a point.

use super::Tangent;
use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector, Dyn};

/// Quadratic model of S: `R ΔP + Qᵀr` with `J = QR`, which has the same least-squares solution as the Jacobian, in only
/// as many rows as variables. Rows count by their curvature weights.
#[derive(Clone)]
pub(super) struct Quadratic {
    pub qr: QR<f64, Dyn, Dyn>,
    pub r: DMatrix<f64>,
    pub rhs: DVector<f64>,
    /// The part of Jᵀr that is not in `Rᵀ Qᵀr`: the gradient of rows without weight.
    pub unweighted_gradient: DVector<f64>,
    /// Minimum damping of every step, in addition to μΩ, for the error of the derivatives.
    pub damping_floor: DVector<f64>,
}

/// Smallest column norm for the minimum damping, relative to that of the unweighted column.
const MIN_COLUMN_NORM_RATIO: f64 = 1e-6;

impl Quadratic {
    pub(super) fn new(tangent: &Tangent, weights: Option<&DVector<f64>>, lengths: &DVector<f64>, error: f64) -> Self {
        let (curved, straight) = match weights {
            Some(weights) => weight_rows(tangent, weights),
            None => (tangent.clone(), DVector::zeros(lengths.len())),
        };
        // Rows without weight must not leave a variable undamped.
        let lengths =
            lengths.zip_map(&column_norms(&curved.jacobian), |all, counted| counted.max(MIN_COLUMN_NORM_RATIO * all));
        let qr = curved.jacobian.qr();
        let mut right = curved.residuals;
        qr.q_tr_mul(&mut right);
        let r = truncate_weak_directions(qr.r(), &lengths, error);
        Self {
            rhs: right.rows(0, r.nrows()).into_owned(),
            damping_floor: lengths * error,
            r,
            qr,
            unweighted_gradient: straight,
        }
    }
}

/// Residuals and Jacobian with rows weighted so that JᵀJ is the curvature of S and Jᵀr half its gradient; and the
/// gradient of rows without weight.
fn weight_rows(tangent: &Tangent, weights: &DVector<f64>) -> (Tangent, DVector<f64>) {
    // Below this a weight adds less to the curvature than rounding does.
    const LEAST: f64 = f64::EPSILON;
    let Tangent { mut residuals, mut jacobian } = tangent.clone();
    let mut straight = DVector::zeros(jacobian.ncols());
    for (i, &weight) in weights.iter().enumerate() {
        if weight > LEAST {
            jacobian.row_mut(i).scale_mut(weight.sqrt());
            residuals[i] /= weight.sqrt();
        } else {
            straight += jacobian.row(i).transpose() * residuals[i];
            jacobian.row_mut(i).fill(0.0);
            residuals[i] = 0.0;
        }
    }
    (Tangent { residuals, jacobian }, straight)
}

/// The triangular factor R without the directions in which R with unit columns is weaker than the error of the
/// derivatives: these contain mostly error.
fn truncate_weak_directions(r: DMatrix<f64>, lengths: &DVector<f64>, error: f64) -> DMatrix<f64> {
    let scaled = DMatrix::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] / lengths[j]);
    if !scaled.iter().all(|value| value.is_finite()) {
        return r;
    }
    // No matrix of this size should reach the iteration limit; without it a failure to converge would not return.
    let Some(mut svd) = scaled.try_svd(true, true, f64::EPSILON, 10_000) else { return r };
    let floor = error * svd.singular_values.max();
    if svd.singular_values.min() > floor {
        return r;
    }
    svd.singular_values.apply(|value| *value = if *value > floor { *value } else { 0.0 });
    let Ok(mut truncated) = svd.recompose() else { return r };
    truncated.column_iter_mut().zip(lengths.iter()).for_each(|(mut column, &length)| column *= length);
    truncated
}

/// Norms of the columns of a Jacobian.
pub(super) fn column_norms(jacobian: &DMatrix<f64>) -> DVector<f64> {
    DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(|column| column.norm()))
}
