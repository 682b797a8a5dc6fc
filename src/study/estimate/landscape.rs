//! The objective over two factors: the paper's design space.

use crate::march::MarchError;
use crate::study::thermocouples::Thermocouples;

/// The objective over two factors.
#[derive(Clone, Debug)]
pub struct Landscape {
    /// Values of the first factor, and of the second.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// S in K², `objective_k2[j][i]` at `x[i]`, `y[j]`; NaN where a member failed.
    pub objective_k2: Vec<Vec<f64>>,
}

/// Values of the factors on each side of a landscape.
const SIDE: usize = 25;

/// The landscape of two factors between their bounds; none of one or of more.
pub(super) fn landscape(problem: &mut Thermocouples, bounds: &[(f64, f64)]) -> Result<Option<Landscape>, MarchError> {
    let [x, y] = bounds[..] else { return Ok(None) };
    let side = |(low, high): (f64, f64)| -> Vec<f64> {
        (0..SIDE).map(|i| low + (high - low) * i as f64 / (SIDE - 1) as f64).collect()
    };
    let (x, y) = (side(x), side(y));
    let points: Vec<Vec<f64>> = y.iter().flat_map(|&y| x.iter().map(move |&x| vec![x, y])).collect();
    let (objectives_k2, _) = problem.objectives_k2(&points)?;
    Ok(Some(Landscape { objective_k2: objectives_k2.chunks(SIDE).map(<[f64]>::to_vec).collect(), x, y }))
}
