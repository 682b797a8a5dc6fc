//! How was the hot face heated? The flux through time, from what sensors read.
//!
//! The flux is straight lines between knots, and every knot's value a variable, none of them below zero: all at once are sought such that the
//! march meets all readings (whole-domain estimation: Beck, Blackwell & St Clair, *Inverse Heat Conduction*, 1985). Heat takes its time from the face to
//! a sensor and blurs on the way, so a history is only as sharp as noise lets it be: it is held smooth ([`Smoothing`]) but across
//! corners at which the case says that the flux jumps.

mod knots;
mod schedules;
mod smoothing;

pub use smoothing::{Chosen, Rung, Smoothing};

use super::sensitivity::difference_step;
use super::thermocouples::{Sample, samples};
use crate::case::{Case, Face, Schedule};
use crate::ensemble::Ensemble;
use crate::fit::{Fit, Options, Sides, difference, minimize};
use crate::march::{March, MarchError};
use crate::pilot::pilot;
use crate::traces::Traces;
use knots::Knots;
use nalgebra::{DMatrix, DVector};
use schedules::{Schedules, heated};
use smoothing::{Solved, chosen};

/// What is asked of a history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Knots beside the corners of the case's own schedule, spread over the time in which that is not zero.
    pub knots: usize,
    pub smoothing: Smoothing,
}

/// The flux found.
#[derive(Clone, Debug)]
pub struct History {
    /// The knots, s; the flux is straight lines between them. A jump is two at one time.
    pub times_s: Vec<f64>,
    /// Cold-wall flux at each, W/m².
    pub flux_w_m2: Vec<f64>,
    /// One standard deviation that noise makes of each at this smoothing, W/m². What smoothing itself takes off is not in it.
    pub deviations_w_m2: Vec<f64>,
    /// What smoothing takes off each to first order, told by the history found, W/m²: less than it takes off the true one.
    pub smoothed_w_m2: Vec<f64>,
    /// What the case says at each, W/m².
    pub own_w_m2: Vec<f64>,
    /// The flux through the whole exposure: past the end of the window that of the case, as no data tell of it.
    pub schedule: Schedule,
    /// Integral over the window, its standard deviation, and that of what the case says, J/m².
    pub fluence_j_m2: f64,
    pub fluence_deviation_j_m2: f64,
    pub fluence_own_j_m2: f64,
    /// Values that the data determine; the others come of smoothness.
    pub determined: f64,
    pub chosen: Chosen,
    pub rung: Rung,
    /// Every weight tried, the strongest first.
    pub rungs: Vec<Rung>,
    pub seen: Vec<Seen>,
    /// The last end of the sensors' windows, s: nothing was sought after it.
    pub end_s: f64,
    pub samples: usize,
    /// Histories marched.
    pub marches: usize,
    pub converged: bool,
    pub termination: String,
}

/// One sensor whose readings were used.
#[derive(Clone, Debug)]
pub struct Seen {
    pub sensor: usize,
    pub times_s: Vec<f64>,
    /// Measured less predicted with the history found, K, and the standard deviation of what was measured.
    pub residuals_k: Vec<f64>,
    pub sigma_k: Vec<f64>,
    /// Root mean square of measured less predicted as the case has the flux, and as it was found, K.
    pub rms_k: (f64, f64),
}

/// Why no history was found.
#[derive(Debug, thiserror::Error)]
pub enum HistoryError {
    #[error(
        "the hot face of {case:?} is {kind}: a history is the flux of one that is `heated` by it, expected kind = \"heated\""
    )]
    NoFlux { case: String, kind: &'static str },
    #[error("nothing to find a history from: the sensors chosen have no samples between {from_s} s and {to_s} s")]
    NoSamples { from_s: f64, to_s: f64 },
    #[error("{values} values cannot be sought in {samples} samples; ask for fewer knots, or give more data")]
    TooMany { values: usize, samples: usize },
    #[error("as the case says it is heated it cannot be marched: a temperature left 0 to 4,000 K or a table")]
    Strayed,
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Of a schedule that is zero throughout, W/m².
const SCALE_W_M2: f64 = 1e5;

/// Find the flux at the hot face from the readings of the sensors and the windows that the case names, its factors being nominal.
///
/// # Errors
/// When the hot face has no flux, there is too little to find it from, or the device fails.
pub fn history(case: &Case, march: &mut dyn March, wanted: &Wanted) -> Result<History, HistoryError> {
    let flux = flux(case)?;
    let (from_s, to_s) = case.trusted_s();
    let end_s = to_s.min(case.exposure.duration_s);
    let knots = Knots::new(flux, end_s, wanted.knots);
    let schedule = |values: Vec<f64>| Schedule { times_s: knots.times_s.clone(), values };
    let on_knots = Case { exposure: heated(&case.exposure, schedule(knots.own.clone())), ..case.clone() };

    let plan = pilot(&on_knots)?;
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
    let scale_w_m2 = if largest > 0.0 { largest } else { SCALE_W_M2 };
    let roughness = knots.roughness();
    let difference_step = difference_step(march.backend().precision);
    let mut problem = Schedules {
        march,
        plan: &plan,
        exposure: &on_knots.exposure,
        nominal: &Ensemble::nominal(&case.factors),
        times_s: &knots.times_s,
        scale_w_m2,
        samples: &flat,
        roughness: &roughness,
        weight: 0.0,
        bounds: vec![(0.0, f64::INFINITY); knots.times_s.len()],
        marches: 0,
    };
    let start = DVector::from_iterator(knots.own.len(), knots.own.iter().map(|own| own.max(0.0) / scale_w_m2));
    let tangent = difference(&mut problem, &start, difference_step)?;
    if tangent.residuals.iter().any(|residual| !residual.is_finite()) {
        return Err(HistoryError::Strayed);
    }
    let alike = tangent.jacobian.norm() / roughness.norm().max(f64::MIN_POSITIVE);
    let options = Options {
        sides: Sides::One,
        trials: 1,
        difference_step,
        tolerance_reduction: 1e-5,
        tolerance_step: 1e-5,
        ..Options::default()
    };
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
    let known = Known::of(fit, flat.len(), solved.rung.rms.max(1.0));
    let spans_s = DVector::from_vec(knots.spans_s());
    let flux_w_m2: Vec<f64> = fit.point.iter().map(|value| value * scale_w_m2).collect();
    let integral = |values: &[f64]| values.iter().zip(&spans_s).map(|(value, span_s)| value * span_s).sum();
    let traces = observed.iter().filter(|trace| !trace.is_empty());
    Ok(History {
        deviations_w_m2: known.spread.row_iter().map(|row| row.norm() * scale_w_m2).collect(),
        smoothed_w_m2: known.smoothed.iter().map(|value| value * scale_w_m2).collect(),
        fluence_j_m2: integral(&flux_w_m2),
        fluence_deviation_j_m2: known.spread.tr_mul(&spans_s).norm() * scale_w_m2,
        fluence_own_j_m2: integral(&knots.own),
        determined: known.determined,
        schedule: gone_on(&schedule(flux_w_m2.clone()), flux, end_s, case.exposure.duration_s),
        flux_w_m2,
        own_w_m2: knots.own.clone(),
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

/// The flux at the hot face of a case that is heated by one.
fn flux(case: &Case) -> Result<&Schedule, HistoryError> {
    let none = |kind| HistoryError::NoFlux { case: case.id.clone(), kind };
    match &case.exposure.hot_face {
        Face::Open(open) if open.film_heats => Err(none("convective")),
        Face::Open(open) => Ok(&open.flux_w_m2),
        Face::Held(_) => Err(none("held at a temperature")),
    }
}

/// A schedule up to its end, and another from there on.
fn gone_on(found: &Schedule, own: &Schedule, end_s: f64, duration_s: f64) -> Schedule {
    let later = own.times_s.iter().copied().filter(|time_s| (end_s..duration_s).contains(time_s) && *time_s > end_s);
    let rest: Vec<f64> = if end_s < duration_s { std::iter::once(end_s).chain(later).collect() } else { Vec::new() };
    let values = rest.iter().map(|&time_s| own.after(time_s));
    Schedule {
        values: found.values.iter().copied().chain(values).collect(),
        times_s: found.times_s.iter().chain(&rest).copied().collect(),
    }
}

impl History {
    /// Whether the data and smoothness together leave a knot so open that its value says nothing: noise makes more of it than the
    /// largest flux found.
    pub fn is_open(&self, knot: usize) -> bool {
        let largest = self.flux_w_m2.iter().copied().fold(0.0, f64::max);
        let deviation = self.deviations_w_m2[knot];
        !deviation.is_finite() || deviation > largest
    }

    /// The half-width of the band in which 95 % of histories lie that other noise would have made, W/m².
    pub fn half_width_w_m2(&self, knot: usize) -> f64 {
        1.96 * self.deviations_w_m2[knot]
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
    /// Variable × sample: what a standard deviation of each sample makes of each variable.
    spread: DMatrix<f64>,
    /// What smoothing takes off each variable, `(JᵀJ + LᵀL)⁻¹ LᵀL` times the history.
    smoothed: DVector<f64>,
    /// The trace of what data have to say in it.
    determined: f64,
}

impl Known {
    /// From a fit whose first rows are those of the data, and by how much noise is larger than their standard deviations.
    fn of(fit: &Fit, samples: usize, noise: f64) -> Self {
        // A knot that moves no reading and no roughness is open; a length no longer than rounding keeps it from being no number.
        const LEAST: f64 = 1e-12;
        let decomposed = fit.jacobian.clone().qr();
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
        Self { determined: data.norm_squared(), spread: back(&data) * noise, smoothed: smoothed.column(0).into_owned() }
    }
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
}
