//! Which factors make the prediction meet the measurement?

use super::nominal::{Misfit, Nominal};
use super::sensitivity::{Identifiability, difference_step};
use super::thermocouples::{Sample, Thermocouples, samples};
use crate::case::Case;
use crate::ensemble::Ensemble;
use crate::fit::interval::{effective_samples, lag_one, residual_variance, student_95};
use crate::fit::{Fit, LeastSquares, Options, minimize};
use crate::march::{March, MarchError, Precision, march_all};
use crate::plan::Plan;
use crate::traces::{Arrival, Traces};
use nalgebra::DVector;

/// Estimated factors and how they were found.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// Indices into the case's factors, in the order of every vector here.
    pub factors: Vec<usize>,
    /// Indices of the sensors whose observations were fitted.
    pub sensors: Vec<usize>,
    pub window_s: (f64, f64),
    pub bounds: Vec<(f64, f64)>,
    pub start: Vec<f64>,
    pub values: Vec<f64>,
    /// From the covariance scaled by the residuals, as if they were independent; infinite where not determined.
    pub standard_errors: Vec<f64>,
    /// 95 % confidence intervals to first order, widened by the residuals' autocorrelation.
    pub intervals: Vec<(f64, f64)>,
    /// Whether an estimate stands on one of its bounds.
    pub at_bound: Vec<bool>,
    pub identifiability: Identifiability,
    /// What pairs of estimates determine that neither does alone.
    pub combinations: Vec<Combination>,
    /// Sum of squared residuals in K² (the paper's S), at the start and at the end.
    pub objective_k2: (f64, f64),
    /// The points visited, the start first.
    pub path: Vec<Turn>,
    /// Members marched.
    pub marches: usize,
    pub termination: String,
    pub converged: bool,
    pub advice: String,
    /// The nominal march and the one at the estimates.
    pub before: Nominal,
    pub after: Nominal,
    /// Misfit of each fitted observation before and after, over the window.
    pub misfits: Vec<(Misfit, Misfit)>,
    /// One a fitted observation: times and measured less predicted, over the window.
    pub residuals: Vec<(Vec<f64>, Vec<f64>)>,
    /// Lag-one autocorrelation of the residuals and the number of independent samples that it leaves.
    pub autocorrelation: f64,
    pub effective_samples: f64,
    pub samples: usize,
    /// Of a pair of factors: the objective over the plane of the two.
    pub landscape: Option<Landscape>,
}

/// Of two estimates that stand in each other's way, what the data do determine: what one gains the other gives in the
/// same proportion, or takes in the inverse one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combination {
    /// Places among the estimated factors.
    pub pair: (usize, usize),
    /// Of their estimates.
    pub correlation: f64,
    /// The ratio of the first to the second, where they rise together; else their product.
    pub is_ratio: bool,
    pub value: f64,
    /// One standard deviation relative to the value, to first order, of residuals that are independent.
    pub relative_error: f64,
}

/// Two estimates that correlate beyond this cannot be told apart in practice (Beck & Arnold, *Parameter
/// Estimation*, 1977, draw the line at 0.9).
const CORRELATION: f64 = 0.95;

impl Combination {
    /// Of every pair of estimates that cannot be told apart. Where one has no standard error its share cancels no more,
    /// and the combination's is no number.
    pub fn all(values: &[f64], standard_errors: &[f64], correlation: &[Vec<f64>]) -> Vec<Self> {
        let pairs = (0..values.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
        pairs
            .filter(|&(first, second)| correlation[second][first].abs() > CORRELATION)
            .map(|(first, second)| {
                let correlation = correlation[second][first];
                let is_ratio = correlation > 0.0;
                let [a, b] = [first, second].map(|place| standard_errors[place] / values[place]);
                let variance = (a - b).powi(2) + 2.0 * a * b * (1.0 - correlation.abs());
                let (one, other) = (values[first], values[second]);
                Self {
                    pair: (first, second),
                    correlation,
                    is_ratio,
                    value: if is_ratio { one / other } else { one * other },
                    relative_error: variance.sqrt(),
                }
            })
            .collect()
    }
}

/// One accepted iteration.
#[derive(Clone, Debug)]
pub struct Turn {
    pub values: Vec<f64>,
    /// S, K².
    pub objective_k2: f64,
    pub damping: f64,
}

/// The objective over two factors: the paper's design space.
#[derive(Clone, Debug)]
pub struct Landscape {
    /// Values of the first factor, and of the second.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    /// S in K², `objective_k2[j][i]` at `x[i]`, `y[j]`; NaN where the member failed.
    pub objective_k2: Vec<Vec<f64>>,
}

/// Why nothing was estimated.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error("nothing to estimate: the case names no factors; give --factors")]
    NoFactors,
    #[error("nothing to estimate from: the sensors chosen have no samples between {0} s and {1} s")]
    NoSamples(f64, f64),
    #[error(transparent)]
    March(#[from] MarchError),
}

/// How to minimise with derivatives by differences of marches in a precision: a reduction below their error is not
/// waited for, for it never comes.
pub fn options(precision: Precision) -> Options {
    let difference_step = difference_step(precision);
    match precision {
        Precision::F32 => Options { difference_step, tolerance_reduction: 1e-6, ..Options::default() },
        Precision::F64 => Options { difference_step, ..Options::default() },
    }
}

/// Values of the factors on each side of a landscape.
const LANDSCAPE: usize = 25;

/// Estimate the factors that the case names from the sensors and the window it names.
///
/// # Errors
/// When the case names nothing to estimate or to estimate from, or the device fails.
pub fn estimate(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    options: &Options,
) -> Result<Estimated, EstimateError> {
    let window_s = case.estimate.window_s.unwrap_or((0.0, case.exposure.duration_s));
    let factors = case.estimate.factors.clone();
    let observed = samples(case, plan);
    let flat = observed.concat();
    if factors.is_empty() {
        return Err(EstimateError::NoFactors);
    }
    if flat.is_empty() {
        return Err(EstimateError::NoSamples(window_s.0, window_s.1));
    }
    let nominal: Vec<f64> = factors.iter().map(|&factor| case.factors[factor].nominal).collect();
    let start = if case.estimate.start.is_empty() { nominal } else { case.estimate.start.clone() };

    let mut problem = Thermocouples::new(case, plan, march, &factors, case.estimate.bounds, flat.clone());
    let fit = minimize(&mut problem, &DVector::from_vec(start.clone()), options)?;
    let bounds = problem.bounds().to_vec();
    let mut marches = problem.marches;
    let rows: Vec<Vec<f64>> = fit.path.iter().map(|turn| problem.row(turn.point.iter().copied())).collect();
    let landscape = match bounds[..] {
        [x, y] => {
            let plane = plane(x, y);
            let rows = plane.2.iter().map(|&(x, y)| problem.row([x, y])).collect();
            marches += plane.2.len();
            Some((plane, rows))
        }
        _ => None,
    };

    // The whole traces along the path, at the nominal factors, and over the plane of two factors.
    let nominal = Nominal::of(case, plan, &march.march(plan, &Ensemble::nominal(&case.factors), 0..1)?, 0);
    let (path_k2, last) = objectives(case, plan, march, rows, &flat)?;
    let landscape = match landscape {
        Some(((x, y, _), rows)) => {
            let (flat_k2, _) = objectives(case, plan, march, rows, &flat)?;
            Some(Landscape { objective_k2: flat_k2.chunks(x.len()).map(<[f64]>::to_vec).collect(), x, y })
        }
        None => None,
    };
    let after = Nominal::of(case, plan, &last, last.members() - 1);

    let residuals = residuals(&observed, plan, &after);
    let autocorrelation = lag_one(&residuals.iter().map(|(_, off_k)| off_k.clone()).collect::<Vec<_>>());
    let effective = effective_samples(flat.len(), autocorrelation);
    let judged = judge(case, &fit, &factors, &flat);
    let values: Vec<f64> = fit.point.iter().copied().collect();
    // Residuals that follow each other are worth fewer samples: the interval is as wide as theirs would be. The
    // degrees of freedom stay those of all samples, for of one or two effective ones Student's t is unbounded and
    // says nothing.
    let half = student_95(flat.len() as f64 - factors.len() as f64) * (flat.len() as f64 / effective).sqrt();
    let is_fitted = |seen: usize| {
        case.estimate.sensors.is_empty() || case.estimate.sensors.contains(&case.observations[seen].sensor)
    };
    let fitted = (0..case.observations.len()).filter(|&seen| is_fitted(seen));
    Ok(Estimated {
        sensors: fitted.clone().map(|seen| case.observations[seen].sensor).collect(),
        window_s,
        start,
        standard_errors: judged.standard_errors.clone(),
        intervals: values
            .iter()
            .zip(&judged.standard_errors)
            .map(|(value, error)| (value - half * error, value + half * error))
            .collect(),
        at_bound: values.iter().zip(&bounds).map(|(value, (low, high))| value <= low || value >= high).collect(),
        objective_k2: (path_k2[0], path_k2[path_k2.len() - 1]),
        path: fit
            .path
            .iter()
            .zip(&path_k2)
            .map(|(turn, &objective_k2)| Turn {
                values: turn.point.iter().copied().collect(),
                objective_k2,
                damping: turn.damping,
            })
            .collect(),
        marches: marches + path_k2.len() + 1,
        termination: fit.termination.to_string(),
        converged: fit.termination.converged(),
        advice: fit.termination.advice().to_owned(),
        misfits: fitted.map(|seen| (nominal.misfits[seen], after.misfits[seen])).collect(),
        before: nominal,
        after,
        residuals,
        autocorrelation,
        effective_samples: effective,
        samples: flat.len(),
        landscape,
        combinations: Combination::all(&values, &judged.standard_errors, &judged.correlation),
        identifiability: judged,
        values,
        bounds,
        factors,
    })
}

/// Values along both sides of a plane between bounds, and its points, row after row.
type Plane = (Vec<f64>, Vec<f64>, Vec<(f64, f64)>);

fn plane(x: (f64, f64), y: (f64, f64)) -> Plane {
    let side = |(low, high): (f64, f64)| -> Vec<f64> {
        (0..LANDSCAPE).map(|i| low + (high - low) * i as f64 / (LANDSCAPE - 1) as f64).collect()
    };
    let (x, y) = (side(x), side(y));
    let points = y.iter().flat_map(|&y| x.iter().map(move |&x| (x, y))).collect();
    (x, y, points)
}

/// The paper's S of rows of factors, K², NaN for one that failed; and the traces of the last of them.
fn objectives(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    rows: Vec<Vec<f64>>,
    samples: &[Sample],
) -> Result<(Vec<f64>, Traces), MarchError> {
    let ensemble = Ensemble::at(case.factors.len(), rows.concat());
    let mut objectives_k2 = vec![];
    let mut last = None;
    march_all(march, plan, &ensemble, &mut |traces| {
        for member in 0..traces.members() {
            let squares = samples.iter().map(|s| (traces.trace(member, s.sensor)[s.instant] - s.measured_k).powi(2));
            let is_done = traces.arrivals[member] == Arrival::Done;
            objectives_k2.push(if is_done { squares.sum() } else { f64::NAN });
        }
        last = Some(traces);
    })?;
    Ok((objectives_k2, last.expect("a path has at least its start")))
}

/// What the data determine at the estimates, their noise taken to be as large as the residuals.
fn judge(case: &Case, fit: &Fit, factors: &[usize], samples: &[Sample]) -> Identifiability {
    let variance = residual_variance(fit.objective, samples.len(), factors.len());
    let values: Vec<f64> = fit.point.iter().copied().collect();
    Identifiability::of(case, factors, &values, &fit.jacobian, samples, variance)
}

/// Times and measured less predicted of each observation fitted, within the window.
fn residuals(observed: &[Vec<Sample>], plan: &Plan, after: &Nominal) -> Vec<(Vec<f64>, Vec<f64>)> {
    let of = |samples: &Vec<Sample>| {
        samples
            .iter()
            .map(|s| (plan.instants_s[s.instant], s.measured_k - after.temperatures_k[s.sensor][s.instant]))
            .unzip()
    };
    observed.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::identify::certainty;
    use nalgebra::DMatrix;

    /// Residuals in the logarithms of two variables, which they know through sum or difference far better than alone.
    fn judged(sign: f64) -> (Vec<f64>, Vec<f64>, Vec<Vec<f64>>) {
        let values = vec![0.5, 2.0];
        let row = |together: f64, apart: f64| [together + apart, sign * (together - apart)];
        let rows = [row(100.0, 0.0), row(0.0, 1.0), row(100.0, 0.0), row(0.0, 1.0)];
        let jacobian = DMatrix::from_fn(4, 2, |i, j| rows[i][j] / values[j]);
        let found = certainty(&jacobian, 1.0);
        let correlation = found.correlation.row_iter().map(|row| row.iter().copied().collect()).collect();
        (values, found.standard_errors, correlation)
    }

    #[test]
    fn what_two_estimates_determine_together_has_the_error_of_its_logarithm() {
        for (sign, is_ratio, value) in [(1.0, false, 1.0), (-1.0, true, 0.25)] {
            let (values, errors, correlation) = judged(sign);
            assert!(errors[0] / values[0] > 0.3 && errors[1] / values[1] > 0.3, "neither is known: {errors:?}");
            let [found] = Combination::all(&values, &errors, &correlation)[..] else { panic!("one pair") };
            assert_eq!((found.pair, found.is_ratio, found.value), ((0, 1), is_ratio, value));
            assert_eq!(found.correlation < 0.0, !is_ratio);
            // Two residuals of 100 times the logarithm: 1/(100 √2).
            assert!((found.relative_error - 0.01 / 2f64.sqrt()).abs() < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn estimates_that_can_be_told_apart_need_no_combination() {
        let found = Combination::all(&[1.0, 1.0], &[0.1, 0.1], &[vec![1.0, 0.9], vec![0.9, 1.0]]);
        assert!(found.is_empty());
    }
}
