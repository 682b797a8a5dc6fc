//! Inverse heat conduction: flux, radiant flux or gas temperature at the hot face through time, from thermocouple
//! readings.
//!
//! The unknown is piecewise linear between knots, with one variable per knot, not negative unless the case's own flux
//! is. All variables are estimated together by least squares over the whole march (whole-domain estimation: Beck,
//! Blackwell & St Clair, *Inverse Heat Conduction*, 1985). Conduction delays and damps the signal between face and
//! sensor, so noise limits the resolution in time. Tikhonov regularisation smooths the solution, except across the
//! jumps of the case's own schedule. Its weight, and 95 % intervals that have noise and the bias of the regularisation,
//! follow from models of both that are weighted by their restricted likelihood. Cells and steps are adapted to the
//! heating found, and the estimate is repeated until its discretisation error meets the tolerance: the case's own
//! heating is unlike the one sought.

mod heating_quantity;
mod inversion_problem;
mod knots;
mod linearized_inversion;
mod restricted_likelihood;

pub use heating_quantity::HeatingQuantity;
pub use restricted_likelihood::WeightProbability;

use super::sensitivity::difference_step;
use super::thermocouple_residuals::{Sample, samples};
use crate::adapt::{ACCEPTED_ERROR, adapt_monitored, refined_traces};
use crate::case::{Case, Observation, Schedule};
use crate::ensemble::Ensemble;
use crate::fit::{Fit, LeastSquares, Options, minimize};
use crate::march::monitor::Monitor;
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use crate::question::History;
use crate::traces::{Balance, Traces};
use inversion_problem::InversionProblem;
use knots::Knots;
use linearized_inversion::{LinearizedInversion, LinearizedQuery};
use nalgebra::{DMatrix, DVector};
use restricted_likelihood::{LinearizedReadings, ModelPosterior, RoughnessModels};

/// Most knots where their number is not given: enough for what a thermocouple near the face resolves within a minute.
/// With 20 the heating between the knots, which no interval has, matters at steps.
pub const DEFAULT_KNOTS: usize = 40;

/// The heating found: W/m² for a flux, K for a gas temperature.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct FluxInversion {
    /// The quantity that was estimated.
    pub quantity: HeatingQuantity,
    /// Knot times, s; the heating is linear between them. A jump is two knots at one time.
    pub times_s: Vec<f64>,
    /// Value at each knot.
    pub values: Vec<f64>,
    /// Half-width of the 95 % interval of each knot value: noise, regularisation bias and discretisation error, with
    /// the undetermined knots fixed. It is an interval for the true value, and 95 % is its coverage averaged over the
    /// knots (Nychka, J. Am. Stat. Assoc. 83, 1988): less where the heating bends more than elsewhere.
    pub half_widths: Vec<f64>,
    /// Value of the case's own schedule at each knot.
    pub case_values: Vec<f64>,
    /// Whether a knot is undetermined: the half-width of its interval exceeds twice the largest value found.
    pub undetermined: Vec<bool>,
    /// Schedule of the whole exposure. After the end of the window it is the case's own schedule, because no data
    /// constrain it.
    pub schedule: Schedule,
    /// Integral over the window: J/m² for a flux, K s for a gas temperature.
    pub integral: f64,
    /// Half-width of the 95 % interval of the integral, with the undetermined knots fixed.
    pub integral_half_width: f64,
    /// Integral of the case's own schedule.
    pub case_integral: f64,
    /// Largest discretisation error of the readings with the heating found, K; `None` where the case states its cells
    /// and steps.
    pub discretisation_error_k: Option<f64>,
    /// Change of the integral by the discretisation error, to first order; included in the interval.
    pub integral_discretisation_error: f64,
    /// Least value of a knot: zero, or minus infinity where the case's own flux is negative somewhere.
    pub least_value: f64,
    /// Knots that are zero, while lower values would explain the data significantly better.
    pub knots_below_zero: usize,
    /// Effective degrees of freedom: the number of knot values that the data determine; regularisation determines the
    /// others.
    pub degrees_of_freedom: f64,
    /// The regularisation weight, relative to the weight at which the Jacobians of data and roughness have equal norms.
    pub weight: f64,
    /// Whether the weight was given.
    pub weight_is_stated: bool,
    /// The probabilities of the weights tried, in ascending order.
    pub weights: Vec<WeightProbability>,
    /// Root mean square of the residuals in their stated standard deviations.
    pub weighted_rms: f64,
    /// Correlation time of the most probable noise model, s; zero for white noise.
    pub correlation_time_s: f64,
    /// Fraction of white noise in the variance of the most probable noise model.
    pub white_share: f64,
    /// Variance of the most probable noise model, in squares of the stated deviations.
    pub noise_variance: f64,
    /// One entry per sensor with readings.
    pub sensor_fits: Vec<SensorFit>,
    /// End of the last sensor window, s: no value is estimated after it.
    pub end_s: f64,
    /// Samples used, over all sensors.
    pub samples: usize,
    /// Heating schedules marched.
    pub marches: usize,
    /// Heat and mass in, out and stored of the march with the heating found.
    pub balance: Balance,
    /// Whether the minimisation ended at a minimum.
    pub converged: bool,
    /// Why the minimisation ended, as a clause.
    pub termination: String,
}

/// One sensor whose readings were used.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct SensorFit {
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
pub enum InversionError {
    /// The hot face is held at a temperature.
    #[error(
        "the hot face of {case:?} is held at a temperature, so no flux heats it; expected kind = \"heated\" or \
         \"convective\""
    )]
    HeldFace {
        /// The case.
        case: String,
    },
    /// The case has several heating quantities, and none is selected.
    #[error(
        "{case:?} has a {first} and a {second}, which the data cannot separate: choose the quantity {first} or \
         {second}; the other stays as the case states it"
    )]
    AmbiguousQuantity {
        /// The case.
        case: String,
        /// The first of the two.
        first: &'static str,
        /// The second of the two.
        second: &'static str,
    },
    /// The case lacks the selected quantity.
    #[error("{case:?} has no quantity {quantity} to estimate: {reason}")]
    QuantityMissing {
        /// The case.
        case: String,
        /// The quantity.
        quantity: &'static str,
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
    TooManyKnots {
        /// Unknown values.
        values: usize,
        /// Samples in the windows.
        samples: usize,
    },
    /// The march with the case's own heating diverged.
    #[error("the march with the case's own heating failed: a temperature left 0 to 4,000 K or the range of a table")]
    Diverged,
    /// The march failed or was cancelled.
    #[error(transparent)]
    March(#[from] MarchError),
}

/// Negligible reduction of the weighted sum of squares: an error of a tenth of a standard error adds so much. At
/// convergence the sum is about one per sample.
const NEGLIGIBLE_REDUCTION: f64 = 1e-2;

/// Estimate the heating of the hot face from the sensors and windows that the case selects, with nominal factors.
///
/// # Errors
/// When the hot face lacks the selected quantity, the data are insufficient, or the device fails.
pub fn invert_flux(case: &Case, march: &mut dyn March, requested: &History) -> Result<FluxInversion, InversionError> {
    let quantity = HeatingQuantity::for_case(case, requested.quantity)?;
    let Some(own) = quantity.schedule(&case.exposure.hot_face) else {
        return Err(InversionError::HeldFace { case: case.id.clone() });
    };
    let (from_s, to_s) = case.fit_window_s();
    let end_s = to_s.min(case.exposure.duration_s);
    let more = requested.knots.unwrap_or_else(|| (most_samples(case) / 2).min(DEFAULT_KNOTS));
    let knots = Knots::new(own, quantity.unheated_value(), end_s, more);
    let inversion = Inversion { case, quantity, own, knots: &knots, window_s: (from_s, to_s), end_s, requested };

    let mut heating = knots.case_values.clone();
    let (mut marches, mut adaptations) = (0, 1);
    loop {
        let found = inversion.solve(march, &heating)?;
        marches += found.marches;
        let exceeds = case.resolution.tolerance_k.is_some_and(|tolerance_k| found.exceeds_tolerance(tolerance_k));
        if !exceeds || adaptations == MAX_ADAPTATIONS {
            return Ok(FluxInversion { marches, ..found });
        }
        heating = found.values;
        adaptations += 1;
    }
}

/// Most samples of a sensor in its window.
fn most_samples(case: &Case) -> usize {
    let in_window = |observation: &Observation| {
        let (from_s, to_s) = case.window_s(observation.sensor);
        observation.times_s.iter().filter(|time_s| (from_s..=to_s).contains(*time_s)).count()
    };
    case.fitted_observations().map(in_window).max().unwrap_or(0)
}

/// Most changes of the regularisation weight, each chosen at the heating found with the one before.
const MAX_WEIGHT_CHANGES: usize = 6;

/// Most adaptations of cells and steps to the heating found. Each brings the heating closer to the final one.
const MAX_ADAPTATIONS: usize = 5;

/// A flux inversion of a case, on any plan.
struct Inversion<'a> {
    case: &'a Case,
    quantity: HeatingQuantity,
    /// The case's own schedule.
    own: &'a Schedule,
    knots: &'a Knots,
    window_s: (f64, f64),
    end_s: f64,
    requested: &'a History,
}

impl Inversion<'_> {
    /// The case with knot values in place of its own schedule.
    fn heated_case(&self, values: &[f64]) -> Case {
        let found = Schedule { times_s: self.knots.times_s.clone(), values: values.to_vec() };
        let whole = extended_schedule(&found, self.own, self.end_s, self.case.exposure.duration_s);
        Case { exposure: self.quantity.with_schedule(&self.case.exposure, whole), ..self.case.clone() }
    }

    /// The heating found on cells and steps that are adapted to a heating, from which the minimisation starts.
    fn solve(&self, march: &mut dyn March, adapted_to: &[f64]) -> Result<FluxInversion, InversionError> {
        let Self { case, quantity, own, knots, requested, end_s, .. } = *self;
        let monitor = march.monitor();
        let on_knots = self.heated_case(adapted_to);
        let whole_plan = adapt_monitored(&on_knots, &monitor)?;
        // Later steps do not affect any reading in the window.
        let last = whole_plan.instants_s.partition_point(|&instant_s| instant_s <= end_s).saturating_sub(1).max(1);
        let plan = whole_plan.truncated_at(last);
        let observed = samples(&on_knots, &plan);
        let flat = observed.concat();
        if flat.is_empty() {
            return Err(InversionError::NoSamples { from_s: self.window_s.0, to_s: self.window_s.1 });
        }
        if flat.len() < knots.times_s.len() {
            return Err(InversionError::TooManyKnots { values: knots.times_s.len(), samples: flat.len() });
        }

        let largest = adapted_to.iter().map(|value| value.abs()).fold(0.0, f64::max);
        let scale = if largest > 0.0 { largest } else { quantity.default_scale() };
        let least_value = quantity.least_value(own);
        let roughness = RoughnessModels::of(knots);
        let difference_step = difference_step(march.backend().precision);
        let nominal = Ensemble::nominal(&case.factors);
        let mut problem = InversionProblem {
            march,
            quantity,
            plan: &plan,
            exposure: &on_knots.exposure,
            nominal: &nominal,
            times_s: &knots.times_s,
            scale,
            difference_step,
            samples: &flat,
            roughness: &roughness.differences,
            weight: 0.0,
            bounds: vec![(least_value, f64::INFINITY); knots.times_s.len()],
            marches: 0,
        };
        let in_units = |values: &[f64]| {
            DVector::from_iterator(values.len(), values.iter().map(|value| value.max(least_value) / scale))
        };
        let start = in_units(adapted_to);
        let at_start = problem.tangents(&DMatrix::from_columns(std::slice::from_ref(&start)))?;
        let tangent = at_start.and_then(|mut tangents| tangents.pop());
        let tangent = tangent.filter(|tangent| tangent.residuals.iter().all(|residual| residual.is_finite()));
        let Some(tangent) = tangent else { return Err(InversionError::Diverged) };
        let unit_weight = match roughness.differences.norm() {
            0.0 => 1.0,
            norm => tangent.jacobian.rows(0, flat.len()).norm() / norm,
        };
        let times_s = |samples: &Vec<Sample>| samples.iter().map(|sample| plan.instants_s[sample.instant]).collect();
        let times_s: Vec<Vec<f64>> = observed.iter().map(times_s).collect();
        let spans_s = DVector::from_vec(knots.trapezoidal_weights_s());
        let linearized = |point: &DVector<f64>, residuals: &DVector<f64>, jacobian: &DMatrix<f64>| {
            let jacobian = jacobian.rows(0, flat.len()).into_owned();
            let response = &jacobian * point - residuals.rows(0, flat.len());
            LinearizedReadings { jacobian, response, traces: &times_s, roughness: &roughness, unit_weight }
        };
        let best_weight = |readings: &LinearizedReadings<'_>, posterior: &ModelPosterior, point: &DVector<f64>| {
            posterior.least_error_weight(readings, &spans_s, point.amax().max(1.0)).unwrap_or(1.0)
        };
        let tolerance_reduction = (NEGLIGIBLE_REDUCTION / flat.len() as f64).max(1e-5);
        let options = Options { trials: 1, tolerance_reduction, tolerance_step: 1e-5, ..Options::default() };
        let mut weight = requested.smoothing.unwrap_or_else(|| {
            let readings = linearized(&start, &tangent.residuals, &tangent.jacobian);
            best_weight(&readings, &ModelPosterior::of(&readings), &start)
        });
        let (mut from, mut changes) = (start, 0);
        let (fit, readings, posterior) = loop {
            problem.weight = weight * unit_weight;
            let fit = minimize(&mut problem, &from, &options)?;
            let readings = linearized(&fit.point, &fit.residuals, &fit.jacobian);
            let posterior = ModelPosterior::of(&readings);
            let best = requested.smoothing.unwrap_or_else(|| best_weight(&readings, &posterior, &fit.point));
            if best == weight || changes == MAX_WEIGHT_CHANGES {
                break (fit, readings, posterior);
            }
            (weight, from, changes) = (best, fit.point, changes + 1);
        };

        let ends = problem.traces(&DMatrix::from_columns(&[in_units(&knots.case_values), fit.point.clone()]))?;
        let (marches, precision) = (problem.marches, problem.march.backend().precision);
        let values: Vec<f64> = fit.point.iter().map(|value| value * scale).collect();
        let found_case = self.heated_case(&values);
        let errors_k = self.discretisation_errors_k(&found_case, &whole_plan, precision, &flat, &monitor)?;
        // A reading that is too high is met by less heating.
        let errors = errors_k.iter().flatten().zip(&flat).map(|(error_k, sample)| -error_k / sample.sigma_k);
        let errors = match errors_k {
            Some(_) => DVector::from_iterator(flat.len(), errors),
            None => DVector::zeros(flat.len()),
        };
        let known = LinearizedInversion::of(&LinearizedQuery {
            readings: &readings,
            posterior: &posterior,
            weight,
            known_errors: &errors,
            spans: &spans_s,
            estimate: &fit.point,
        });
        let (noise, noise_variance) = posterior.noise();
        let integral = |values: &[f64]| values.iter().zip(&spans_s).map(|(value, span_s)| value * span_s).sum();
        let traces = observed.iter().filter(|trace| !trace.is_empty());
        Ok(FluxInversion {
            quantity,
            half_widths: known.half_widths.iter().map(|half| half * scale).collect(),
            integral: integral(&values),
            integral_half_width: known.integral_half_width * scale,
            case_integral: integral(&knots.case_values),
            discretisation_error_k: errors_k.map(|of_k| of_k.iter().fold(0.0, |most: f64, at_k| most.max(at_k.abs()))),
            integral_discretisation_error: known.integral_shift * scale,
            least_value,
            knots_below_zero: knots_below_bound(&fit, flat.len(), least_value),
            degrees_of_freedom: known.degrees_of_freedom,
            undetermined: known.undetermined,
            schedule: heating_schedule(&found_case, quantity).unwrap_or_else(|| own.clone()),
            values,
            case_values: knots.case_values.clone(),
            times_s: knots.times_s.clone(),
            weight,
            weight_is_stated: requested.smoothing.is_some(),
            weights: posterior.weights(),
            weighted_rms: (fit.residuals.rows(0, flat.len()).norm_squared() / flat.len() as f64).sqrt(),
            correlation_time_s: noise.correlation_time,
            white_share: noise.white_fraction,
            noise_variance,
            sensor_fits: traces.map(|samples| SensorFit::of(samples, &plan.instants_s, &ends)).collect(),
            end_s,
            samples: flat.len(),
            marches,
            balance: ends[1].balances[0],
            converged: fit.termination.converged(),
            termination: fit.termination.to_string(),
        })
    }

    /// The discretisation error of each sample with a heating, K, on the cells and steps of a plan that was adapted to
    /// another one, with the rounding of a precision; infinite where a finer march fails. `None` where the case states
    /// its cells and steps.
    fn discretisation_errors_k(
        &self,
        heated: &Case,
        plan: &Plan,
        precision: Precision,
        samples: &[Sample],
        monitor: &Monitor,
    ) -> Result<Option<Vec<f64>>, MarchError> {
        if plan.error_estimate.is_none() {
            return Ok(None);
        }
        let nominal = Ensemble::nominal(&heated.factors);
        let refined = refined_traces(heated, &plan.with_exposure(&heated.exposure), precision, &nominal, monitor)?;
        let readings: Vec<(usize, usize)> = samples.iter().map(|sample| (sample.sensor, sample.instant)).collect();
        Ok(Some(refined.reading_errors_k(0, &readings).unwrap_or_else(|| vec![f64::INFINITY; samples.len()])))
    }
}

/// The schedule of a quantity in a case.
fn heating_schedule(case: &Case, quantity: HeatingQuantity) -> Option<Schedule> {
    quantity.schedule(&case.exposure.hot_face).cloned()
}

/// Number of variables at a lower bound of zero, if the data (the first residuals) would be met significantly better
/// below it: the reduction of their sum of squares without the bound, to first order, has the χ² distribution of as
/// many degrees of freedom where only noise pulls at them.
fn knots_below_bound(fit: &Fit, samples: usize, least: f64) -> usize {
    if least != 0.0 {
        return 0;
    }
    let gradient = fit.jacobian.tr_mul(&fit.residuals);
    let is_held = |knot: usize| fit.point[knot] <= 0.0 && gradient[knot] > 0.0;
    let held: Vec<usize> = (0..fit.point.len()).filter(|&knot| is_held(knot)).collect();
    let pull = DVector::from_fn(fit.point.len(), |knot, _| if is_held(knot) { gradient[knot] } else { 0.0 });
    let normal = fit.jacobian.tr_mul(&fit.jacobian);
    let ridge = 1e-9 * normal.diagonal().amax();
    let damped = normal + DMatrix::from_diagonal_element(pull.len(), pull.len(), ridge);
    let Some(step) = damped.cholesky().map(|factors| factors.solve(&pull)) else { return 0 };
    let (data, jacobian) = (fit.residuals.rows(0, samples), fit.jacobian.rows(0, samples));
    let reduction = data.norm_squared() - (data - jacobian * step).norm_squared();
    let number = held.len() as f64;
    if reduction > number + 4.0 * (2.0 * number).sqrt() { held.len() } else { 0 }
}

/// The estimated schedule up to its end, then the case's own schedule to the end of the run, with its jumps.
fn extended_schedule(found: &Schedule, own: &Schedule, end_s: f64, duration_s: f64) -> Schedule {
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

impl FluxInversion {
    /// Whether the discretisation error of a reading is clearly above a tolerance, K.
    pub fn exceeds_tolerance(&self, tolerance_k: f64) -> bool {
        self.discretisation_error_k.is_some_and(|error_k| error_k > ACCEPTED_ERROR * tolerance_k)
    }

    /// Whether the residuals are larger than their stated standard deviations explain: the root mean square of n
    /// standardised residuals exceeds this limit for 2.5 % of data sets, as its standard deviation is `1/√(2n)`.
    pub fn exceeds_stated_noise(&self) -> bool {
        self.weighted_rms > 1.0 + 2.0 / (2.0 * self.samples as f64).sqrt()
    }
}

impl SensorFit {
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
