//! Inverse heat conduction: flux, radiant flux or gas temperature at the hot face through time, from thermocouple
//! readings.
//!
//! The unknown is piecewise linear between knots, with one non-negative variable per knot. All variables are estimated
//! together by least squares over the whole march (whole-domain estimation: Beck, Blackwell & St Clair, *Inverse Heat
//! Conduction*, 1985). Conduction delays and damps the signal between face and sensor, so noise limits the resolution
//! in time. Tikhonov regularisation ([`Smoothing`]) smooths the solution, except across the jumps of the case's own
//! schedule.

mod knots;
mod schedules;
mod smoothing;
mod sought;

pub use smoothing::{Chosen, Rung, Smoothing};
pub use sought::Sought;

use super::sensitivity::difference_step;
use super::thermocouples::{Sample, samples};
use crate::case::{Case, Schedule};
use crate::ensemble::Ensemble;
use crate::fit::{Fit, LeastSquares, Options, minimize};
use crate::march::{March, MarchError};
use crate::pilot::pilot_monitored;
use crate::traces::Traces;
use knots::Knots;
use nalgebra::{DMatrix, DVector};
use schedules::Schedules;
use smoothing::{Solved, chosen};

/// Settings of a flux inversion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// `None` selects the only quantity that heats the case's hot face.
    pub sought: Option<Sought>,
    /// Knots in addition to the corners of the case's own schedule, spread over the time in which that schedule heats.
    pub knots: usize,
    /// How the regularisation weight is chosen.
    pub smoothing: Smoothing,
}

/// The heating found: W/m² for a flux, K for a gas temperature.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct History {
    /// The quantity that was estimated.
    pub sought: Sought,
    /// Knot times, s; the heating is linear between them. A jump is two knots at one time.
    pub times_s: Vec<f64>,
    /// Value at each knot.
    pub values: Vec<f64>,
    /// Standard deviation of each knot value due to measurement noise, at this regularisation weight, with the
    /// undetermined knots fixed. The bias of the regularisation is not included.
    pub deviations: Vec<f64>,
    /// Regularisation bias of each knot value, to first order, computed from the estimated heating; the bias computed
    /// from the true heating would be larger.
    pub smoothed: Vec<f64>,
    /// Value of the case's own schedule at each knot.
    pub own: Vec<f64>,
    /// Whether a knot is undetermined: its standard deviation exceeds the largest value found.
    pub undetermined: Vec<bool>,
    /// Schedule of the whole exposure. After the end of the window it is the case's own schedule, because no data
    /// constrain it.
    pub schedule: Schedule,
    /// Integral over the window: J/m² for a flux, K s for a gas temperature.
    pub integral: f64,
    /// Standard deviation of the integral, with the undetermined knots fixed.
    pub integral_deviation: f64,
    /// Integral of the case's own schedule.
    pub integral_own: f64,
    /// Effective degrees of freedom: the number of knot values that the data determine; regularisation determines the
    /// others.
    pub determined: f64,
    /// How the regularisation weight was chosen.
    pub chosen: Chosen,
    /// The selected weight, with its misfit and roughness.
    pub rung: Rung,
    /// Every weight tried, the strongest first.
    pub rungs: Vec<Rung>,
    /// One entry per sensor with readings.
    pub seen: Vec<Seen>,
    /// End of the last sensor window, s: no value is estimated after it.
    pub end_s: f64,
    /// Samples used, over all sensors.
    pub samples: usize,
    /// Heating schedules marched.
    pub marches: usize,
    /// Whether the minimisation ended at a minimum.
    pub converged: bool,
    /// Why the minimisation ended, as a clause.
    pub termination: String,
}

/// One sensor whose readings were used.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Seen {
    /// Index into the sensors of the case.
    pub sensor: usize,
    /// Times of the readings, s.
    pub times_s: Vec<f64>,
    /// Measured minus predicted temperature with the heating found, K.
    pub residuals_k: Vec<f64>,
    /// Standard deviation of each reading, K.
    pub sigma_k: Vec<f64>,
    /// Root mean square of measured minus predicted temperature, K: with the case's own schedule, and with the heating
    /// found.
    pub rms_k: (f64, f64),
}

/// Why a flux inversion failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HistoryError {
    /// The hot face is held at a temperature.
    #[error(
        "the hot face of {case:?} is held at a temperature, so no flux heats it; expected kind = \"heated\" or \
         \"convective\""
    )]
    Held {
        /// The case.
        case: String,
    },
    /// The case has several heating quantities, and none is selected.
    #[error(
        "{case:?} has a {first} and a {second}, which the data cannot separate: give --quantity {first} or \
         --quantity {second}; the other stays as the case states it"
    )]
    Several {
        /// The case.
        case: String,
        /// The first of the two.
        first: &'static str,
        /// The second of the two.
        second: &'static str,
    },
    /// The case lacks the selected quantity.
    #[error("--quantity {sought}: {case:?} has none: {reason}")]
    Absent {
        /// The case.
        case: String,
        /// The quantity.
        sought: &'static str,
        /// The reason.
        reason: &'static str,
    },
    /// The chosen sensors have no samples in their windows.
    #[error("no data for the inversion: the selected sensors have no samples between {from_s} s and {to_s} s")]
    NoSamples {
        /// Start of the window, s.
        from_s: f64,
        /// End of the window, s.
        to_s: f64,
    },
    /// There are more knots than samples.
    #[error("{values} knot values cannot be estimated from {samples} samples; give fewer knots or more data")]
    TooMany {
        /// Unknown values.
        values: usize,
        /// Samples in the windows.
        samples: usize,
    },
    /// The march with the case's own heating diverged.
    #[error("the march with the case's own heating failed: a temperature left 0 to 4,000 K or the range of a table")]
    Strayed,
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Negligible reduction of the weighted sum of squares: an error of a tenth of a standard error adds so much. At
/// convergence the sum is about one per sample.
const NEGLIGIBLE: f64 = 1e-2;

/// Estimate the heating of the hot face from the sensors and windows that the case selects, with nominal factors.
///
/// # Errors
/// When the hot face lacks the selected quantity, the data are insufficient, or the device fails.
pub fn history(case: &Case, march: &mut dyn March, wanted: &Wanted) -> Result<History, HistoryError> {
    let sought = Sought::of(case, wanted.sought)?;
    let Some(own) = sought.schedule(&case.exposure.hot_face) else {
        return Err(HistoryError::Held { case: case.id.clone() });
    };
    let (from_s, to_s) = case.trusted_s();
    let end_s = to_s.min(case.exposure.duration_s);
    let knots = Knots::new(own, sought.rest(), end_s, wanted.knots);
    let schedule = |values: Vec<f64>| Schedule { times_s: knots.times_s.clone(), values };
    let on_knots = Case { exposure: sought.driven(&case.exposure, schedule(knots.own.clone())), ..case.clone() };

    let plan = pilot_monitored(&on_knots, &march.monitor())?;
    // Later steps do not affect any reading in the window.
    let last = plan.instants_s.partition_point(|&instant_s| instant_s <= end_s).saturating_sub(1).max(1);
    let plan = plan.until(last);
    let observed = samples(&on_knots, &plan);
    let flat = observed.concat();
    if flat.is_empty() {
        return Err(HistoryError::NoSamples { from_s, to_s });
    }
    if flat.len() < knots.times_s.len() {
        return Err(HistoryError::TooMany { values: knots.times_s.len(), samples: flat.len() });
    }

    let largest = knots.own.iter().map(|value| value.abs()).fold(0.0, f64::max);
    let scale = if largest > 0.0 { largest } else { sought.scale() };
    let roughness = knots.roughness();
    let difference_step = difference_step(march.backend().precision);
    let mut problem = Schedules {
        march,
        sought,
        plan: &plan,
        exposure: &on_knots.exposure,
        nominal: &Ensemble::nominal(&case.factors),
        times_s: &knots.times_s,
        scale,
        difference_step,
        samples: &flat,
        roughness: &roughness,
        weight: 0.0,
        bounds: vec![(0.0, f64::INFINITY); knots.times_s.len()],
        marches: 0,
    };
    let start = DVector::from_iterator(knots.own.len(), knots.own.iter().map(|own| own.max(0.0) / scale));
    let at_start = problem.tangents(&DMatrix::from_columns(std::slice::from_ref(&start)))?;
    let tangent = at_start.and_then(|mut tangents| tangents.pop());
    let tangent = tangent.filter(|tangent| tangent.residuals.iter().all(|residual| residual.is_finite()));
    let Some(tangent) = tangent else { return Err(HistoryError::Strayed) };
    let alike = tangent.jacobian.norm() / roughness.norm().max(f64::MIN_POSITIVE);
    let tolerance_reduction = (NEGLIGIBLE / flat.len() as f64).max(1e-5);
    let options = Options { trials: 1, tolerance_reduction, tolerance_step: 1e-5, ..Options::default() };
    let (solved, chosen, rungs) =
        chosen(wanted.smoothing, flat.len(), &start, roughness.nrows() > 0, |weight, from| {
            problem.weight = weight * alike;
            let fit = minimize(&mut problem, from, &options)?;
            let data = fit.residuals.rows(0, flat.len());
            let rms = (data.norm_squared() / flat.len() as f64).sqrt();
            Ok::<_, MarchError>(Solved { rung: Rung { weight, rms, roughness: (&roughness * &fit.point).norm() }, fit })
        })?;

    let fit = &solved.fit;
    let ends = problem.traces(&DMatrix::from_columns(&[start, fit.point.clone()]))?;
    let values: Vec<f64> = fit.point.iter().map(|value| value * scale).collect();
    let known = Known::of(fit, flat.len(), solved.rung.rms.max(1.0));
    let spans_s = DVector::from_vec(knots.spans_s());
    let integral = |values: &[f64]| values.iter().zip(&spans_s).map(|(value, span_s)| value * span_s).sum();
    let traces = observed.iter().filter(|trace| !trace.is_empty());
    Ok(History {
        sought,
        deviations: known.deviations.iter().map(|deviation| deviation * scale).collect(),
        smoothed: known.smoothed.iter().map(|value| value * scale).collect(),
        integral: integral(&values),
        integral_deviation: known.spread.tr_mul(&spans_s).norm() * scale,
        integral_own: integral(&knots.own),
        determined: known.determined,
        undetermined: known.undetermined,
        schedule: gone_on(&schedule(values.clone()), own, end_s, case.exposure.duration_s),
        values,
        own: knots.own.clone(),
        times_s: knots.times_s.clone(),
        chosen,
        rung: solved.rung,
        rungs,
        seen: traces.map(|samples| Seen::of(samples, &plan.instants_s, &ends)).collect(),
        end_s,
        samples: flat.len(),
        marches: problem.marches,
        converged: fit.termination.converged(),
        termination: fit.termination.to_string(),
    })
}

/// The estimated schedule up to its end, then the case's own schedule to the end of the run, with its jumps.
fn gone_on(found: &Schedule, own: &Schedule, end_s: f64, duration_s: f64) -> Schedule {
    let mut whole = found.clone();
    if end_s < duration_s {
        let corners = own.times_s.iter().copied().zip(own.values.iter().copied());
        let later = corners.filter(|&(time_s, _)| end_s < time_s && time_s < duration_s);
        let ends = [(end_s, own.after(end_s)), (duration_s, own.before(duration_s))];
        for (time_s, value) in ends[..1].iter().copied().chain(later).chain(ends[1..].iter().copied()) {
            whole.times_s.push(time_s);
            whole.values.push(value);
        }
    }
    whole
}

impl History {
    /// Half-width of the 95 % interval of a knot value under measurement noise.
    pub fn half_width(&self, knot: usize) -> f64 {
        1.96 * self.deviations[knot]
    }
}

impl Seen {
    fn of(samples: &[Sample], instants_s: &[f64], ends: &[Traces]) -> Self {
        let sensor = samples[0].sensor;
        let off_k = |traces: &Traces| -> Vec<f64> {
            samples.iter().map(|sample| sample.measured_k - traces.trace(0, sensor)[sample.instant]).collect()
        };
        let rms_k = |off_k: &[f64]| (off_k.iter().map(|off| off * off).sum::<f64>() / off_k.len() as f64).sqrt();
        let [own, found] = [&ends[0], &ends[1]].map(off_k);
        Self {
            sensor,
            times_s: samples.iter().map(|sample| instants_s[sample.instant]).collect(),
            sigma_k: samples.iter().map(|sample| sample.sigma_k).collect(),
            rms_k: (rms_k(&own), rms_k(&found)),
            residuals_k: found,
        }
    }
}

/// The regularised estimate to first order. With J the weighted Jacobian of the data and L the weighted roughness
/// operator, the estimate is `(JᵀJ + LᵀL)⁻¹ Jᵀ` times the data.
struct Known {
    /// Whether the standard deviation of a variable exceeds the largest value found, or neither data nor roughness
    /// depend on it.
    undetermined: Vec<bool>,
    /// Standard deviation of each variable, with the undetermined variables fixed; infinite where nothing depends on
    /// it.
    deviations: DVector<f64>,
    /// Variable × sample: change of each variable per standard deviation of each sample, with the undetermined
    /// variables fixed.
    spread: DMatrix<f64>,
    /// Regularisation bias of each variable, `(JᵀJ + LᵀL)⁻¹ LᵀL` times the estimate; zero for an undetermined variable.
    smoothed: DVector<f64>,
    /// Trace of the data part of the hat matrix: the effective degrees of freedom.
    determined: f64,
}

impl Known {
    /// From a fit whose first rows are the data. `noise` is the ratio of the actual to the stated standard deviations.
    ///
    /// A knot may be undetermined: no reading and no roughness depends on it at the estimate, as with a flux of zero
    /// that blowing blocks. Its standard deviation is unbounded and would spoil every integral over it. So undetermined
    /// knots are found first, and the others are assessed with these fixed.
    fn of(fit: &Fit, samples: usize, noise: f64) -> Self {
        let knots = fit.point.len();
        let largest = fit.point.amax();
        let all: Vec<usize> = (0..knots).filter(|&knot| fit.jacobian.column(knot).norm() > 0.0).collect();
        let free = Self::among(fit, &all, samples, noise);
        let is_determined = |place: usize| free.spread.row(place).norm() <= largest;
        let kept: Vec<usize> = (0..all.len()).filter(|&place| is_determined(place)).map(|place| all[place]).collect();
        let mut deviations = DVector::from_element(knots, f64::INFINITY);
        all.iter().enumerate().for_each(|(place, &knot)| deviations[knot] = free.spread.row(place).norm());
        let held = Self::among(fit, &kept, samples, noise);
        let mut known = Self {
            undetermined: vec![true; knots],
            deviations,
            spread: DMatrix::zeros(knots, samples),
            smoothed: DVector::zeros(knots),
            determined: held.determined,
        };
        for (place, &knot) in kept.iter().enumerate() {
            known.undetermined[knot] = false;
            known.spread.set_row(knot, &held.spread.row(place));
            known.deviations[knot] = held.spread.row(place).norm();
            known.smoothed[knot] = held.smoothed[place];
        }
        known
    }

    /// For some of the variables, with the others fixed.
    fn among(fit: &Fit, places: &[usize], samples: usize, noise: f64) -> Among {
        // Lower limit of a diagonal element, relative to the largest: avoids division by zero for a nearly undetermined
        // knot.
        const LEAST: f64 = 1e-12;
        if places.is_empty() {
            return Among { spread: DMatrix::zeros(0, samples), smoothed: DVector::zeros(0), determined: 0.0 };
        }
        let jacobian = fit.jacobian.select_columns(places);
        let decomposed = jacobian.clone().qr();
        let (q, mut r) = (decomposed.q(), decomposed.r());
        let least = (LEAST * r.diagonal().amax()).max(f64::MIN_POSITIVE);
        for knot in 0..r.nrows() {
            if r[(knot, knot)].abs() < least {
                r[(knot, knot)] = least;
            }
        }
        let back = |rows: &DMatrix<f64>| {
            r.solve_upper_triangular(rows)
                .unwrap_or_else(|| DMatrix::from_element(r.nrows(), rows.ncols(), f64::INFINITY))
        };
        let data = q.rows(0, samples).transpose();
        let rough = q.rows(samples, q.nrows() - samples).transpose();
        let weighted = fit.jacobian.rows(samples, fit.jacobian.nrows() - samples) * &fit.point;
        let smoothed = back(&(rough * DMatrix::from_columns(&[weighted])));
        Among {
            determined: data.norm_squared(),
            spread: back(&data) * noise,
            smoothed: smoothed.column(0).into_owned(),
        }
    }
}

/// The regularised estimate to first order, for some of the variables.
struct Among {
    spread: DMatrix<f64>,
    smoothed: DVector<f64>,
    determined: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Termination;

    /// Two variables, each measured once; the second is also tied to zero with the same weight.
    #[test]
    fn smoothing_of_equal_weight_halves_a_variable_and_its_noise() {
        let jacobian = DMatrix::from_row_slice(3, 2, &[2.0, 0.0, 0.0, 4.0, 0.0, 4.0]);
        let fit = Fit {
            point: DVector::from_vec(vec![3.0, 5.0]),
            objective: 0.0,
            residuals: DVector::zeros(3),
            jacobian,
            path: Vec::new(),
            evaluations: 0,
            tangents: 0,
            termination: Termination::Reduction,
        };
        let known = Known::of(&fit, 2, 1.0);
        assert!((known.determined - 1.5).abs() < 1e-12);
        assert!((known.spread.row(0).norm() - 0.5).abs() < 1e-12);
        assert!((known.spread.row(1).norm() - 0.125).abs() < 1e-12, "half of 0.25, the deviation without smoothing");
        assert!(known.smoothed[0].abs() < 1e-12 && (known.smoothed[1] - 2.5).abs() < 1e-12);
    }

    /// Two variables: one measured, and one without effect on any residual.
    #[test]
    fn a_variable_without_effect_is_undetermined_and_widens_no_other() {
        let fit = Fit {
            point: DVector::from_vec(vec![3.0, 0.0]),
            objective: 0.0,
            residuals: DVector::zeros(3),
            jacobian: DMatrix::from_row_slice(3, 2, &[2.0, 0.0, 2.0, 0.0, 0.0, 0.0]),
            path: Vec::new(),
            evaluations: 0,
            tangents: 0,
            termination: Termination::Reduction,
        };
        let known = Known::of(&fit, 2, 1.0);
        assert_eq!(known.undetermined, [false, true]);
        let integral = known.spread.tr_mul(&DVector::from_vec(vec![1.0, 50.0])).norm();
        assert!((integral - 0.125f64.sqrt()).abs() < 1e-12 && known.deviations[1] == f64::INFINITY);
    }
}
