//! The parabola that stands for S about a point.

use super::Tangent;
use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector, Dyn};

/// The parabola taken for S: `R ΔP + Qᵀr` with `J = QR`, which has the same least squares and only as many rows as
/// variables, rows counting by their weights.
#[derive(Clone)]
pub(super) struct Quadratic {
    pub qr: QR<f64, Dyn, Dyn>,
    pub r: DMatrix<f64>,
    pub right: DVector<f64>,
    /// What of Jᵀr is not in `Rᵀ Qᵀr`: the pull of rows without weight.
    pub straight: DVector<f64>,
    /// The damping of every step, beside μΩ: what the error of the derivatives calls for.
    pub floor: DVector<f64>,
}

/// The share of a column's length that rows without weight leave it at least.
const WEAKEST: f64 = 1e-6;

impl Quadratic {
    pub(super) fn new(tangent: &Tangent, weights: Option<&DVector<f64>>, lengths: &DVector<f64>, error: f64) -> Self {
        let (curved, straight) = match weights {
            Some(weights) => weighted(tangent, weights),
            None => (tangent.clone(), DVector::zeros(lengths.len())),
        };
        // Rows that lose their weight are not to leave a variable without any restraint.
        let lengths = lengths.zip_map(&self::lengths(&curved.jacobian), |all, counted| counted.max(WEAKEST * all));
        let qr = curved.jacobian.qr();
        let mut right = curved.residuals;
        qr.q_tr_mul(&mut right);
        let r = without_error(qr.r(), &lengths, error);
        Self { right: right.rows(0, r.nrows()).into_owned(), floor: lengths * error, r, qr, straight }
    }
}

/// Rows that are weighted in the curvature of S, such that JᵀJ is that curvature and Jᵀr half of the slope of S; and what
/// rows without weight add to that slope.
fn weighted(tangent: &Tangent, weights: &DVector<f64>) -> (Tangent, DVector<f64>) {
    // What a weight so small adds to the curvature is less than its rounding.
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
