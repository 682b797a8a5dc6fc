//! Local sensitivities of every thermocouple to every factor, and identifiability of the factors.

use super::thermocouple_residuals::{CaseResiduals, Sample, ThermocoupleResiduals, samples};
use crate::case::Case;
use crate::fit::LeastSquares;
use crate::fit::finite_differences::finite_difference_tangent;
use crate::fit::identifiability::{CovarianceSummary, covariance_summary};
use crate::fit::subset::{Dropped, SubsetLimits, identifiable_subset};
use crate::march::{March, MarchError, Precision};
use crate::plan::Plan;
use nalgebra::{DMatrix, DVector};

/// Derivatives of every temperature with respect to every factor, and the identifiability that follows.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Sensitivity {
    /// Relative step of the finite differences (the paper's Eq. 14); `None` where the march computed exact tangents.
    pub step: Option<f64>,
    /// Instants of the derivatives, s.
    pub instants_s: Vec<f64>,
    /// Factor × sensor × instant, K per unit of the factor.
    pub derivatives_k: Vec<Vec<Vec<f64>>>,
    /// Identifiability of all factors together, from the observations of the selected sensors and window; without
    /// observations, from every instant of every sensor with a standard deviation of 2 K.
    pub all: Identifiability,
    /// Fraction of the variance of the standardised data due to each factor drawn from its side constraints, to first
    /// order. NaN where no factor changes them.
    pub shares: Vec<f64>,
    /// The set recommended for estimation: the influential factors, as far as the data separate them.
    pub recommended: Identifiability,
    /// The dropped factors in order, those without influence first.
    pub reduction: Vec<Dropped>,
    /// The set that the case selects for estimation, if any.
    pub stated: Option<Identifiability>,
    /// Members marched; one with its derivatives counts once.
    pub marches: usize,
}

impl Sensitivity {
    /// Method of the derivatives: `tangent` or `difference`.
    pub fn method(&self) -> &'static str {
        if self.step.is_none() { "tangent" } else { "difference" }
    }
}

/// Identifiability of a set of factors from the data.
#[derive(Clone, Debug, serde::Serialize)]
#[non_exhaustive]
pub struct Identifiability {
    /// Indices into the factors of the case, or of an estimate.
    pub factors: Vec<usize>,
    /// Root mean square of the scaled sensitivity P ∂T/∂P over the data, K.
    pub magnitude_k: Vec<f64>,
    /// Standard error of each factor; infinite where it is not determined.
    pub standard_errors: Vec<f64>,
    /// Correlation of the estimates.
    pub correlation: Vec<Vec<f64>>,
    /// Cosine of the angle between the sensitivity vectors of each pair.
    pub alignment: Vec<Vec<f64>>,
    /// Condition number of the weighted Jacobian with columns scaled to unit length.
    pub condition_number: f64,
    /// The rank of the scaled sensitivities.
    pub rank: usize,
    /// The least determined direction in factor space, in words.
    pub weakest_direction: String,
}

/// Standard deviation assumed for a reading where the case has no observations, K.
const DEFAULT_SIGMA_K: f64 = 2.0;

/// Optimal relative step of a central difference: the cube root of the relative error of the traces, because truncation
/// grows with the square of the step. In f32 the traces carry two words per temperature.
pub fn difference_step(precision: Precision) -> f64 {
    match precision {
        Precision::F32 => 1e-3,
        Precision::F64 => 1e-5,
    }
}

/// Derivatives at the nominal factors: exact tangents where the march computes them, otherwise, or with a given
/// relative step, central differences from one ensemble of 2n + 1 members.
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
    let part = CaseResiduals::new(case, plan, factors.iter().copied().map(Some).collect(), whole.clone());
    let bounds = case.factors.iter().map(|factor| factor.bounds(case.estimate.bounds)).collect();
    let mut problem = ThermocoupleResiduals::new(march, vec![part], bounds);
    let exact = match step {
        Some(_) => None,
        None => {
            problem.tangents(&DMatrix::from_columns(std::slice::from_ref(&nominal)))?.and_then(|mut exact| exact.pop())
        }
    };
    let (tangent, step) = match exact {
        Some(tangent) => (tangent, None),
        None => {
            let step = step.unwrap_or(default_step);
            (finite_difference_tangent(&mut problem, &nominal, step)?, Some(step))
        }
    };
    let marches = problem.marches;
    let derivatives_k = factors.iter().map(|&factor| {
        let column: Vec<f64> = tangent.jacobian.column(factor).iter().copied().collect();
        column.chunks(instants).map(<[f64]>::to_vec).collect()
    });

    let mut judges: Vec<Sample> = samples(case, plan).concat();
    if judges.is_empty() {
        judges = whole.into_iter().map(|sample| Sample { sigma_k: DEFAULT_SIGMA_K, ..sample }).collect();
    }
    let jacobian = DMatrix::from_fn(judges.len(), factors.len(), |i, factor| {
        tangent.jacobian[(judges[i].sensor * instants + judges[i].instant, factor)] / judges[i].sigma_k
    });
    let widths: Vec<f64> =
        case.factors.iter().map(|factor| factor.prior_standard_deviation(case.estimate.bounds)).collect();
    let reduced = identifiable_subset(&jacobian, 1.0, &widths, &SubsetLimits::default());
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
        shares: reduced.variance_fractions,
        recommended: of(&reduced.selected),
        reduction: reduced.dropped,
        stated: (!case.estimate.factors.is_empty()).then(|| of(&case.estimate.factors)),
        marches,
    })
}

impl Sensitivity {
    /// Temperature change due to 1 % of a factor's nominal value, to first order: sensor × instant, K.
    pub fn change_per_percent_k(&self, case: &Case, factor: usize) -> Vec<Vec<f64>> {
        let percent = 0.01 * case.factors[factor].nominal;
        self.derivatives_k[factor].iter().map(|trace| trace.iter().map(|slope_k| percent * slope_k).collect()).collect()
    }

    /// The influential factors: all except those dropped for a small effect. Indices, rising.
    pub fn influential_factors(&self) -> Vec<usize> {
        let slight = |factor: usize| self.dropped(factor).is_some_and(|dropped| dropped.reason.is_small_effect());
        self.all.factors.iter().copied().filter(|&factor| !slight(factor)).collect()
    }

    /// The record of a dropped factor; `None` for a recommended one.
    pub fn dropped(&self, factor: usize) -> Option<&Dropped> {
        self.reduction.iter().find(|dropped| dropped.variable == factor)
    }
}

impl Identifiability {
    /// Identifiability of the factors with these names and values from a weighted Jacobian; `variance` is that of the
    /// weighted residuals. Rows after those of the samples belong to priors.
    pub fn of(
        names: &[&str],
        factors: &[usize],
        values: &[f64],
        jacobian: &DMatrix<f64>,
        samples: &[Sample],
        variance: f64,
    ) -> Self {
        let found = covariance_summary(jacobian, variance);
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
            alignment: rows(&found.column_cosines),
            condition_number: found.condition_number,
            rank: found.rank,
            weakest_direction: weakest_direction(names, factors, values, jacobian, samples, &found),
            standard_errors: found.standard_errors,
        }
    }
}

/// The least determined direction, as changes of factors in per cent and the resulting change of the data.
fn weakest_direction(
    names: &[&str],
    factors: &[usize],
    values: &[f64],
    jacobian: &DMatrix<f64>,
    samples: &[Sample],
    found: &CovarianceSummary,
) -> String {
    let name = |place: usize| names[factors[place]];
    if let Some(place) = found.column_norms.iter().position(|&length| length == 0.0) {
        return format!("the data do not depend on {}", name(place));
    }
    let change = DVector::from_fn(factors.len(), |place, _| found.weakest_direction[place] / found.column_norms[place]);
    let percent: Vec<f64> = change.iter().zip(values).map(|(change, value)| 100.0 * change / value).collect();
    let Some(lead) = (0..percent.len()).max_by(|&a, &b| percent[a].abs().total_cmp(&percent[b].abs())) else {
        return "no factor to estimate".to_owned();
    };
    let scale = 1.0 / percent[lead];
    let moved = jacobian * &change * scale;
    let squares: f64 = moved.iter().zip(samples).map(|(moved, sample)| (moved * sample.sigma_k).powi(2)).sum();
    let moved_k = (squares / samples.len().max(1) as f64).sqrt();
    let mut order: Vec<usize> = (0..percent.len()).filter(|&place| (scale * percent[place]).abs() >= 0.1).collect();
    order.sort_by(|&a, &b| percent[b].abs().total_cmp(&percent[a].abs()));
    let parts: Vec<String> =
        order.iter().take(4).map(|&place| format!("{} {:+.1} %", name(place), scale * percent[place])).collect();
    let tail = format!("change the data by {moved_k:.2} K rms in total");
    match order.as_slice() {
        [only] => format!("{} alone: {} changes the data by {moved_k:.2} K rms", name(*only), parts[0]),
        [first, second] if (scale * percent[*second] + 1.0).abs() < 0.02 => {
            format!("only the product {}·{} matters: {} {tail}", name(*first), name(*second), parts.join(" with "))
        }
        [first, second] if (scale * percent[*second] - 1.0).abs() < 0.02 => {
            format!("only the ratio {}:{} matters: {} {tail}", name(*first), name(*second), parts.join(" with "))
        }
        _ => format!("{} {tail}", parts.join(", ")),
    }
}
