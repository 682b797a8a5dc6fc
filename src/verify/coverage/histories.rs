//! Coverage of the bands of heating histories: random fluxes and gas temperatures, each found from the readings of a
//! thermocouple near the face.

use super::{Counted, covered_row};
use crate::case::{Case, Face, Observation, Schedule, Sensor};
use crate::fit::proportion::Proportion;
use crate::march::cpu::Cpu;
use crate::march::richardson::RichardsonMarch;
use crate::march::{MarchError, Precision};
use crate::plan::Plan;
use crate::question::History;
use crate::random::RandomStream;
use crate::study::flux_inversion::{FluxInversion, HeatingQuantity, InversionError, invert_flux};
use crate::study::nominal::nominal;
use crate::study::twin::Noise;
use crate::verify::problem::{
    Problem, ProblemSetup, constant_properties, convective_face, heated_face, insulated_face,
};
use crate::verify::{Group, VerificationRow};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Histories of each kind.
const HISTORIES: usize = 16;
const KNOTS_ALLOWED: (f64, &str) = (6.0, "three standard errors of 16 shares, which scatter by 8 %");
const INTEGRALS_ALLOWED: (f64, &str) = (7.3, "three standard errors of 80 integrals");
const DURATION_S: f64 = 50.0;
/// The face is heated between these times, which the case states, and until it is retracted.
const HOT_S: (f64, f64) = (0.5, 41.0);
const RETRACTED_S: f64 = 41.2;
/// Correlation time of correlated noise, s: three samples.
const CORRELATION_S: f64 = 3.0;

/// How a heating varies while the face is heated.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// A stationary Gaussian process of a correlation length of 3 to 12 s.
    Smooth,
    /// One to four steps at random times.
    Steps,
}

/// Histories that are counted together.
#[derive(Clone, Copy, Debug)]
struct Kind {
    quantity: HeatingQuantity,
    shape: Shape,
    correlation_s: f64,
}

const KINDS: [Kind; 5] = [
    Kind { quantity: HeatingQuantity::Flux, shape: Shape::Smooth, correlation_s: 0.0 },
    Kind { quantity: HeatingQuantity::Flux, shape: Shape::Steps, correlation_s: 0.0 },
    Kind { quantity: HeatingQuantity::Flux, shape: Shape::Steps, correlation_s: CORRELATION_S },
    Kind { quantity: HeatingQuantity::Gas, shape: Shape::Smooth, correlation_s: 0.0 },
    Kind { quantity: HeatingQuantity::Gas, shape: Shape::Smooth, correlation_s: CORRELATION_S },
];

impl Kind {
    /// Values of the heating at rest and while the face is heated, as the case states them.
    fn levels(self) -> (f64, f64) {
        if self.quantity == HeatingQuantity::Gas { (300.0, 1500.0) } else { (0.0, 2e5) }
    }

    fn name(self) -> String {
        let quantity = if self.quantity == HeatingQuantity::Gas { "gas temperature" } else { "flux" };
        let shape = if self.shape == Shape::Smooth { "smooth" } else { "stepped" };
        let noise = if self.correlation_s > 0.0 { "correlated" } else { "white" };
        format!("{shape} {quantity} under {noise} noise")
    }

    /// A slab under the stated heating, with a thermocouple 1 mm below its face.
    fn slab(self) -> Case {
        let (rest, hot) = self.levels();
        let face = if self.quantity == HeatingQuantity::Gas { convective_face(200.0, rest) } else { heated_face(rest) };
        let setting = ProblemSetup {
            plies: vec![(constant_properties(0.5, 1e6), 8e-3)],
            start_k: 300.0,
            hot_face: face,
            back_face: insulated_face(),
            cells: 16,
            first_step_s: 0.1,
            step_growth: 0.3,
        };
        let mut case = Problem::new(Group::Coverage, "slab under an unknown heating", setting, Vec::new()).case;
        let sensor = case.sensors[0].clone();
        case.sensors = vec![Sensor { depth_m: 1e-3, ..sensor }];
        case.exposure.duration_s = DURATION_S;
        case.resolution.max_step_s = 1.0;
        case.resolution.output_interval_s = 1.0;
        self.with_heating(
            &case,
            Schedule { times_s: vec![0.0, HOT_S.0, HOT_S.1, RETRACTED_S], values: vec![rest, hot, hot, rest] },
        )
    }

    fn with_heating(self, case: &Case, heating: Schedule) -> Case {
        let mut case = case.clone();
        if let Face::Open(open) = &mut case.exposure.hot_face {
            match self.quantity {
                HeatingQuantity::Gas => open.gas_k = heating,
                _ => open.flux_w_m2 = heating,
            }
        }
        case
    }

    /// A heating that is a multiple of the stated one while the face is heated, at corners every quarter of a second.
    fn heating(self, numbers: &mut RandomStream) -> Schedule {
        let (rest, hot) = self.levels();
        let multiple = self.shape.draw(numbers);
        let inside = (0..=162).map(|step| HOT_S.0 + 0.25 * f64::from(step));
        let heated = inside.map(|time_s| (time_s, rest + (hot - rest) * multiple(time_s).max(0.0)));
        let (times_s, values) = std::iter::once((0.0, rest)).chain(heated).chain([(RETRACTED_S, rest)]).unzip();
        Schedule { times_s, values }
    }
}

impl Shape {
    /// A multiple of the stated heating over time.
    fn draw(self, numbers: &mut RandomStream) -> Box<dyn Fn(f64) -> f64> {
        let mut between = |low: f64, high: f64| low + (high - low) * numbers.uniform();
        let level = between(0.5, 1.5);
        match self {
            Self::Smooth => {
                let (length_s, amplitude) = (between(3.0, 12.0), level * between(0.1, 0.4));
                let waves: Vec<(f64, f64)> =
                    (0..40).map(|_| (numbers.normal() / length_s, TAU * numbers.uniform())).collect();
                Box::new(move |time_s| {
                    let sum: f64 = waves.iter().map(|(rate, phase)| (rate * time_s + phase).cos()).sum();
                    level + amplitude * (2.0 / waves.len() as f64).sqrt() * sum
                })
            }
            Self::Steps => {
                let count = 1 + (4.0 * between(0.0, 1.0)) as usize;
                let mut times_s: Vec<f64> = (0..count).map(|_| between(2.0, 39.0)).collect();
                times_s.sort_by(f64::total_cmp);
                let levels: Vec<f64> = (0..=count).map(|_| level * between(0.4, 1.3)).collect();
                Box::new(move |time_s| levels[times_s.partition_point(|&at_s| at_s <= time_s)])
            }
        }
    }
}

/// What was found of a history.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Share of the determined knots whose interval contains the truth.
    knots: f64,
    /// Whether the interval of the integral does; that of the mean is the same one.
    integral: bool,
}

impl Held {
    const NOTHING: Self = Self { knots: 0.0, integral: false };

    fn of(found: &FluxInversion, truth: &Schedule) -> Self {
        let knots: Vec<usize> = (0..found.times_s.len()).filter(|&knot| !found.undetermined[knot]).collect();
        let is_held = |&&knot: &&usize| {
            let (value, half) = (found.values[knot], found.half_widths[knot]);
            let rounding = 1e-12 * value.abs();
            let low = (value - half).max(found.least_value) - rounding;
            (low..=value + half + rounding).contains(&truth.before(found.times_s[knot]))
        };
        let integral = integral(truth, found.end_s);
        Self {
            knots: knots.iter().filter(is_held).count() as f64 / knots.len().max(1) as f64,
            integral: (found.integral - integral).abs() <= found.integral_half_width,
        }
    }
}

/// Integral of a schedule from zero to a time after its last corner.
fn integral(schedule: &Schedule, end_s: f64) -> f64 {
    let (times_s, values) = (&schedule.times_s, &schedule.values);
    let spans = times_s.windows(2).zip(values.windows(2));
    let inside: f64 = spans.map(|(time, value)| 0.5 * (time[1] - time[0]) * (value[0] + value[1])).sum();
    let (last_s, last) = (times_s[times_s.len() - 1], values[values.len() - 1]);
    inside + last * (end_s - last_s)
}

/// The history of a number, from readings with noise.
fn held(kind: Kind, stated: &Case, number: usize) -> Result<Held, MarchError> {
    let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
    let mut numbers = RandomStream::new(number as u64, 2);
    let truth = kind.heating(&mut numbers);
    let made = kind.with_heating(stated, truth.clone());
    let exact = nominal(&made, &Plan::new(&made), &mut march)?;
    let noise_k = 0.5 + 1.5 * numbers.uniform();
    let is_read = |time_s: f64| time_s > 0.0 && (time_s - time_s.round()).abs() < 1e-6;
    let read = exact.instants_s.iter().zip(&exact.temperatures_k[0]).filter(|(time_s, _)| is_read(**time_s));
    let (times_s, exact_k): (Vec<f64>, Vec<f64>) = read.unzip();
    let noise = Noise { correlation_s: kind.correlation_s, seed: number as u64 + 1 }.sample(&times_s, 0, 0);
    let mut case = stated.clone();
    case.observations = vec![Observation {
        sensor: 0,
        temperatures_k: exact_k.iter().zip(noise).map(|(at_k, noise)| at_k + noise_k * noise).collect(),
        sigma_k: vec![1.0; times_s.len()],
        times_s,
        window_s: None,
    }];
    match invert_flux(&case, &mut march, &History::default()) {
        Ok(found) => Ok(Held::of(&found, &truth)),
        Err(InversionError::March(error)) => Err(error),
        // No interval holds anything.
        Err(_) => Ok(Held::NOTHING),
    }
}

/// The first histories of a kind.
fn counted(kind: Kind, histories: usize) -> Result<Vec<Held>, MarchError> {
    let stated = kind.slab();
    (0..histories).into_par_iter().map(|number| held(kind, &stated, number)).collect()
}

/// Coverage of knots and of integrals.
///
/// # Errors
/// As [`March::march`](crate::march::March::march); the processor does not fail.
pub(super) fn rows() -> Result<Vec<VerificationRow>, MarchError> {
    let samples = DURATION_S as usize;
    let mut rows = Vec::new();
    let mut all = Vec::new();
    for kind in KINDS {
        let held = counted(kind, HISTORIES)?;
        let covered = held.iter().map(|held| held.knots).sum::<f64>() / held.len() as f64;
        let knots = Counted { covered, total: held.len(), of: "histories" };
        rows.push(covered_row("history, knots", samples, &kind.name(), &knots, KNOTS_ALLOWED));
        all.extend(held);
    }
    let count = all.iter().filter(|held| held.integral).count();
    let integrals = Counted::intervals(Proportion { count, total: all.len() });
    rows.push(covered_row("history, integral", samples, "histories of all these kinds", &integrals, INTEGRALS_ALLOWED));
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over 100 histories of each kind with `BONDLINE_ALL`.
    #[test]
    fn nearly_every_history_is_found() {
        let histories = if std::env::var_os("BONDLINE_ALL").is_some() { 100 } else { 2 };
        for kind in KINDS {
            let held = counted(kind, histories).expect("the processor does not fail");
            let missing = held.iter().filter(|held| held.knots == 0.0).count();
            assert!(missing <= histories / 50, "{}: {missing} of {histories} have no interval", kind.name());
        }
    }
}
