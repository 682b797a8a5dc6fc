//! How was the hot face heated? A flux, a radiant flux or the temperature of a gas through time, from what sensors read.
//!
//! It is straight lines between knots, and every knot's value a variable, none of them below zero: all at once are sought such that the
//! march meets all readings (whole-domain estimation: Beck, Blackwell & St Clair, *Inverse Heat Conduction*, 1985). Heat takes its time from the face to
//! a sensor and blurs on the way, so a history is only as sharp as noise lets it be: it is held smooth ([`Smoothing`]) but across
//! corners at which the case says that the flux jumps.

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

/// What is asked of a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// `None` seeks the only one that the case has.
    pub sought: Option<Sought>,
    /// Knots beside the corners of the case's own schedule, spread over the time in which that is not zero.
    pub knots: usize,
    /// How the smoothness is chosen.
    pub smoothing: Smoothing,
}

/// The history found, in W/m² of a flux and in K of a gas.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct History {
    /// The quantity that was found.
    pub sought: Sought,
    /// The knots, s; the history is straight lines between them. A jump is two at one time.
    pub times_s: Vec<f64>,
    /// The value at each.
    pub values: Vec<f64>,
    /// One standard deviation that noise makes of each at this smoothing; of one that is determined, the undetermined ones are
    /// held at their values. What smoothing itself takes off is not in it.
    pub deviations: Vec<f64>,
    /// What smoothing takes off each to first order, told by the history found: less than it takes off the true one.
    pub smoothed: Vec<f64>,
    /// What the case says at each.
    pub own: Vec<f64>,
    /// Whether data and smoothness leave a knot undetermined: noise makes more of it than the largest value found.
    pub undetermined: Vec<bool>,
    /// The schedule of the whole exposure: past the end of the window that of the case, as no data tell of it.
    pub schedule: Schedule,
    /// Integral over the window: J/m² of a flux, K s of a gas.
    pub integral: f64,
    /// One standard deviation of the integral, with undetermined knots held at their values.
    pub integral_deviation: f64,
    /// The integral of what the case says.
    pub integral_own: f64,
    /// Values that the data determine; the others come of smoothness.
    pub determined: f64,
    /// How the smoothness was chosen.
    pub chosen: Chosen,
    /// The weight of the smoothing, and what it leaves.
    pub rung: Rung,
    /// Every weight tried, the strongest first.
    pub rungs: Vec<Rung>,
    /// One a sensor with readings.
    pub seen: Vec<Seen>,
    /// The last end of the sensors' windows, s: nothing was sought after it.
    pub end_s: f64,
    /// Samples used, over all sensors.
    pub samples: usize,
    /// Histories marched.
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
    /// Measured less predicted with the history found, K.
    pub residuals_k: Vec<f64>,
    /// Standard deviation of each reading, K.
    pub sigma_k: Vec<f64>,
    /// Root mean square of measured less predicted as the case has the flux, and as it was found, K.
    pub rms_k: (f64, f64),
}

/// Why no history was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HistoryError {
    /// The hot face is held at a temperature.
    #[error(
        "the hot face of {case:?} is held at a temperature: nothing heats it, expected kind = \"heated\" or \"convective\""
    )]
    Held {
        /// The case.
        case: String,
    },
    /// The case has several quantities to seek, and none is named.
    #[error(
        "{case:?} has a {first} and a {second}, and data do not separate one from the other: give --seek {first} or --seek {second}, \
         and the other stays as the case has it"
    )]
    Several {
        /// The case.
        case: String,
        /// The first of the two.
        first: &'static str,
        /// The second of the two.
        second: &'static str,
    },
    /// The case has not the quantity that is named.
    #[error("--seek {sought}: {case:?} has none: {reason}")]
    Absent {
        /// The case.
        case: String,
        /// The quantity.
        sought: &'static str,
        /// Why it is not there.
        reason: &'static str,
    },
    /// The chosen sensors have no samples in their windows.
    #[error("nothing to find a history from: the sensors chosen have no samples between {from_s} s and {to_s} s")]
    NoSamples {
        /// Start of the window, s.
        from_s: f64,
        /// End of the window, s.
        to_s: f64,
    },
    /// There are more values to find than samples.
    #[error("{values} values cannot be sought in {samples} samples; ask for fewer knots, or give more data")]
    TooMany {
        /// Unknown values.
        values: usize,
        /// Samples in the windows.
        samples: usize,
    },
    /// The case cannot be marched as it is.
    #[error("as the case says it is heated it cannot be marched: a temperature left 0 to 4,000 K or a table")]
    Strayed,
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// A change of the weighted squares that changes nothing: a history off by a tenth of its standard error has so much more. They
/// sum to one a sample where data are met.
const NEGLIGIBLE: f64 = 1e-2;

/// Find what heats the hot face from the readings of the sensors and the windows that the case names, its factors being nominal.
///
/// # Errors
/// When the hot face has not what is sought, there is too little to find it from, or the device fails.
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
    // Nothing that comes after the window moves a reading in it.
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

/// A schedule up to its end, and another from there to the end of the run, with its jumps.
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
    /// The half-width of the band in which 95 % of histories lie that other noise would have made.
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

/// What noise and smoothing make of a history, to first order: with J of the data and L of the roughness, both weighted, the history is
/// `(JᵀJ + LᵀL)⁻¹ Jᵀ` times the data.
struct Known {
    /// Whether noise makes more of a variable than the largest value found, or neither data nor roughness have a hold of it.
    undetermined: Vec<bool>,
    /// Of each variable; of one that is determined with the undetermined ones held, infinite where nothing has a hold of it.
    deviations: DVector<f64>,
    /// Variable × sample: what a standard deviation of each sample makes of each variable, the undetermined ones being held.
    spread: DMatrix<f64>,
    /// What smoothing takes off each variable, `(JᵀJ + LᵀL)⁻¹ LᵀL` times the history; nothing of an undetermined one.
    smoothed: DVector<f64>,
    /// The trace of what data have to say in it.
    determined: f64,
}

impl Known {
    /// From a fit whose first rows are those of the data, and by how much noise is larger than their standard deviations.
    ///
    /// A knot may be undetermined: no reading and no roughness moves with it where it stands, as with a flux of zero that blowing
    /// would keep off. What noise makes of it is unbounded and would be of every integral over it. So knots are told apart first, and what is
    /// determined is judged with the others held at their values.
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

    /// Of some of the variables, the others being held.
    fn among(fit: &Fit, places: &[usize], samples: usize, noise: f64) -> Among {
        // A knot that is next to open; a length no longer than rounding keeps it from being no number.
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

/// What noise and smoothing make of some of the variables.
struct Among {
    spread: DMatrix<f64>,
    smoothed: DVector<f64>,
    determined: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Termination;

    /// Two variables, each measured; the second also tied to zero as firmly as it was measured.
    #[test]
    fn smoothing_halves_what_it_ties_as_firmly_as_it_was_measured_and_its_noise() {
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
        assert!((known.spread.row(1).norm() - 0.125).abs() < 1e-12, "half of the quarter that data alone give");
        assert!(known.smoothed[0].abs() < 1e-12 && (known.smoothed[1] - 2.5).abs() < 1e-12);
    }

    /// Two variables, one measured and one that nothing depends on.
    #[test]
    fn a_variable_that_nothing_depends_on_is_undetermined_and_widens_no_other() {
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
