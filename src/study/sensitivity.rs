//! What does each factor do to each thermocouple, and which can be estimated together?

use super::thermocouples::{Part, Sample, Thermocouples, samples};
use crate::case::Case;
use crate::fit::LeastSquares;
use crate::fit::difference::difference;
use crate::fit::identify::{Certainty, certainty};
use crate::fit::subset::{Dropped, Limits, subset};
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use nalgebra::{DMatrix, DVector};

/// Derivatives of every temperature by every factor, and what they say of estimation.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Sensitivity {
    /// Relative step of the differences (the paper's Eq. 14) that the derivatives are; `None` where the march told them
    /// exactly.
    pub step: Option<f64>,
    /// Instants of the derivatives, s.
    pub instants_s: Vec<f64>,
    /// Factor × sensor × instant, K per unit of the factor.
    pub derivatives_k: Vec<Vec<Vec<f64>>>,
    /// What the observations of the trusted sensors and window, or where there are none every instant of
    /// every sensor at 2 K, say of all factors taken together.
    pub all: Identifiability,
    /// The share that each factor makes of the variance of those data, sample by sample in units of its deviation, were
    /// each drawn by its side constraints: to first order. NaN where no factor moves them.
    pub shares: Vec<f64>,
    /// The set proposed for estimation: those that matter, as far as the data tell them apart.
    pub proposed: Identifiability,
    /// The factors left out of it, in the order they went: first those that do not matter. Widths of standard errors are
    /// one, in units of the factor's own deviation.
    pub reduction: Vec<Dropped>,
    /// The set that the case states for estimation, where it does.
    pub stated: Option<Identifiability>,
    /// Members marched, one with its derivatives counted once.
    pub marches: usize,
}

impl Sensitivity {
    /// How the derivatives were found: `tangent` or `difference`.
    pub fn method(&self) -> &'static str {
        if self.step.is_none() { "tangent" } else { "difference" }
    }
}

/// How well a set of factors is determined by the data.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Identifiability {
    /// Indices into the factors of the case, or of an estimate.
    pub factors: Vec<usize>,
    /// Root mean square of the scaled sensitivity P ∂T/∂P over the data, K.
    pub magnitude_k: Vec<f64>,
    /// Standard error each factor would have; infinite where it is not determined.
    pub standard_errors: Vec<f64>,
    /// Correlation of the estimates.
    pub correlation: Vec<Vec<f64>>,
    /// Correlation (cosine) of the sensitivity curves themselves.
    pub alignment: Vec<Vec<f64>>,
    /// Of the Jacobian weighted by the data, its columns at unit length.
    pub condition_number: f64,
    /// The rank of the scaled sensitivities.
    pub rank: usize,
    /// The direction in which the data say least, in words.
    pub weakest: String,
}

/// Standard deviation of a reading where the case has no observations, K.
const SIGMA_K: f64 = 2.0;

/// The relative step of a difference that loses least: the cube root of the error of the traces, as the
/// truncation grows with its square. In f32 the traces come down in two words.
pub fn difference_step(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-3,
        Precision::F64 => 1e-5,
    }
}

/// Derivatives at the nominal factors: as the march tells them, or where it tells none or a relative step is given by central
/// differences, one ensemble of 2n + 1 members.
///
/// # Errors
/// When the device fails.
pub fn sensitivity(
    case: &Case,
    plan: &Plan,
    march: &mut dyn March,
    step: Option<f64>,
) -> Result<Sensitivity, MarchError> {
    let default_step = difference_step(march.backend().precision);
    let (sensors, instants) = (case.sensors.len(), plan.instants_s.len());
    let whole: Vec<Sample> = (0..sensors * instants)
        .map(|i| Sample { sensor: i / instants, instant: i % instants, measured_k: 0.0, sigma_k: 1.0 })
        .collect();
    let factors: Vec<usize> = (0..case.factors.len()).collect();
    let nominal = DVector::from_iterator(factors.len(), case.factors.iter().map(|factor| factor.nominal));
    let part = Part::new(case, plan, factors.iter().copied().map(Some).collect(), whole.clone());
    let bounds = case.factors.iter().map(|factor| factor.bounds(case.estimate.bounds)).collect();
    let mut problem = Thermocouples::new(march, vec![part], bounds);
    let told = match step {
        Some(_) => None,
        None => {
            problem.tangents(&DMatrix::from_columns(std::slice::from_ref(&nominal)))?.and_then(|mut told| told.pop())
        }
    };
    let (tangent, step) = match told {
        Some(tangent) => (tangent, None),
        None => {
            let step = step.unwrap_or(default_step);
            (difference(&mut problem, &nominal, step)?, Some(step))
        }
    };
    let marches = problem.marches;
    let derivatives_k = factors.iter().map(|&factor| {
        let column: Vec<f64> = tangent.jacobian.column(factor).iter().copied().collect();
        column.chunks(instants).map(<[f64]>::to_vec).collect()
    });

    let mut judges: Vec<Sample> = samples(case, plan).concat();
    if judges.is_empty() {
        judges = whole.into_iter().map(|sample| Sample { sigma_k: SIGMA_K, ..sample }).collect();
    }
    let jacobian = DMatrix::from_fn(judges.len(), factors.len(), |i, factor| {
        tangent.jacobian[(judges[i].sensor * instants + judges[i].instant, factor)] / judges[i].sigma_k
    });
    let widths: Vec<f64> = case.factors.iter().map(|factor| factor.deviation(case.estimate.bounds)).collect();
    // In units of what is known beforehand: of two factors that stand in each other's way, the one whose doubt moves
    // the data less goes, not the one that is worth less per unit of itself.
    let doubts = DMatrix::from_fn(judges.len(), factors.len(), |i, factor| jacobian[(i, factor)] * widths[factor]);
    let reduced = subset(&doubts, 1.0, &vec![1.0; factors.len()], &Limits::default());
    let names: Vec<&str> = case.factors.iter().map(|factor| factor.name.as_str()).collect();
    let of = |set: &[usize]| {
        let values: Vec<f64> = set.iter().map(|&factor| nominal[factor]).collect();
        Identifiability::of(&names, set, &values, &jacobian.select_columns(set), &judges, 1.0)
    };
    Ok(Sensitivity {
        step,
        instants_s: plan.instants_s.clone(),
        derivatives_k: derivatives_k.collect(),
        all: of(&factors),
        shares: reduced.shares,
        proposed: of(&reduced.kept),
        reduction: reduced.dropped,
        stated: (!case.estimate.factors.is_empty()).then(|| of(&case.estimate.factors)),
        marches,
    })
}

impl Sensitivity {
    /// What 1 % more of a factor, of its nominal value, changes to first order: sensor × instant, K.
    pub fn per_percent_k(&self, case: &Case, factor: usize) -> Vec<Vec<f64>> {
        let percent = 0.01 * case.factors[factor].nominal;
        self.derivatives_k[factor].iter().map(|trace| trace.iter().map(|slope_k| percent * slope_k).collect()).collect()
    }

    /// The factors that matter: all but those that went as the data hardly change with them. Indices, rising.
    pub fn matter(&self) -> Vec<usize> {
        let slight = |factor: usize| self.left_out(factor).is_some_and(|dropped| dropped.reason.is_of_effect());
        self.all.factors.iter().copied().filter(|&factor| !slight(factor)).collect()
    }

    /// How a factor was left out of the set proposed, where it was.
    pub fn left_out(&self, factor: usize) -> Option<&Dropped> {
        self.reduction.iter().find(|dropped| dropped.variable == factor)
    }
}

impl Identifiability {
    /// What a Jacobian, weighted as its samples are, says of some of the factors of these names at their values; `variance`
    /// is that of the weighted residuals. Rows after those of the samples are of what is known beforehand.
    pub fn of(
        names: &[&str],
        factors: &[usize],
        values: &[f64],
        jacobian: &DMatrix<f64>,
        samples: &[Sample],
        variance: f64,
    ) -> Self {
        let found = certainty(jacobian, variance);
        let rows = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
        };
        let magnitude_k = jacobian.column_iter().zip(values).map(|(column, value)| {
            let squares: f64 =
                column.iter().zip(samples).map(|(slope, sample)| (slope * sample.sigma_k * value).powi(2)).sum();
            (squares / samples.len().max(1) as f64).sqrt()
        });
        Self {
            factors: factors.to_vec(),
            magnitude_k: magnitude_k.collect(),
            correlation: rows(&found.correlation),
            alignment: rows(&found.alignment),
            condition_number: found.condition_number,
            rank: found.rank,
            weakest: weakest(names, factors, values, jacobian, samples, &found),
            standard_errors: found.standard_errors,
        }
    }
}

/// The direction in which the data say least, as changes of factors in per cent and what they do to the data.
fn weakest(
    names: &[&str],
    factors: &[usize],
    values: &[f64],
    jacobian: &DMatrix<f64>,
    samples: &[Sample],
    found: &Certainty,
) -> String {
    let name = |place: usize| names[factors[place]];
    if let Some(place) = found.lengths.iter().position(|&length| length == 0.0) {
        return format!("the data do not change with {} at all", name(place));
    }
    let change = DVector::from_fn(factors.len(), |place, _| found.weakest[place] / found.lengths[place]);
    let percent: Vec<f64> = change.iter().zip(values).map(|(change, value)| 100.0 * change / value).collect();
    let Some(lead) = (0..percent.len()).max_by(|&a, &b| percent[a].abs().total_cmp(&percent[b].abs())) else {
        return "there is nothing to estimate".to_owned();
    };
    let scale = 1.0 / percent[lead];
    let moved = jacobian * &change * scale;
    let squares: f64 = moved.iter().zip(samples).map(|(moved, sample)| (moved * sample.sigma_k).powi(2)).sum();
    let moved_k = (squares / samples.len().max(1) as f64).sqrt();
    let mut order: Vec<usize> = (0..percent.len()).filter(|&place| (scale * percent[place]).abs() >= 0.1).collect();
    order.sort_by(|&a, &b| percent[b].abs().total_cmp(&percent[a].abs()));
    let parts: Vec<String> =
        order.iter().take(4).map(|&place| format!("{} {:+.1} %", name(place), scale * percent[place])).collect();
    let tail = format!("move the data by {moved_k:.2} K rms together");
    match order.as_slice() {
        [only] => format!("{} alone: {} moves the data by {moved_k:.2} K rms", name(*only), parts[0]),
        [first, second] if (scale * percent[*second] + 1.0).abs() < 0.02 => {
            format!("only the product {}·{} acts: {} {tail}", name(*first), name(*second), parts.join(" with "))
        }
        [first, second] if (scale * percent[*second] - 1.0).abs() < 0.02 => {
            format!("only the ratio {}:{} acts: {} {tail}", name(*first), name(*second), parts.join(" with "))
        }
        _ => format!("{} {tail}", parts.join(", ")),
    }
}
