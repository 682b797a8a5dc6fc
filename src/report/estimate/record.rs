//! Keys of an estimate in `summary.json`.

use crate::case::{Bounds, Case};
use crate::fit::GoodnessOfFit;
use crate::report::ReportError;
use crate::report::files::json::{JsonObject, OrderedMap};
use crate::study::answers::Answers;
use crate::study::estimate::{CaseFit, Combination, Estimand, ParameterEstimates, Profile, StartResult};
use serde::Serialize;

#[derive(Serialize)]
struct FactorRecord<'a> {
    value: f64,
    standard_error: f64,
    independent_standard_error: f64,
    numerical_error: f64,
    has_effect: bool,
    low: f64,
    high: f64,
    /// Ids of the cases that have it, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cases: Vec<&'a str>,
}

#[derive(Serialize)]
struct ProfileInterval {
    low: Option<f64>,
    high: Option<f64>,
}

/// Root mean square of prediction less measurement in the window, K.
#[derive(Serialize)]
struct MisfitRecord {
    nominal_rms_k: f64,
    estimated_rms_k: f64,
}

/// The objective S at the start and at the estimate.
#[derive(Serialize)]
struct Objective {
    initial: f64,
    r#final: f64,
}

/// Numbers of starts requested, converged, and ended at the estimate.
#[derive(Serialize)]
struct Starts {
    requested: usize,
    converged: usize,
    at_estimate: usize,
}

/// The combination that the data determine of a pair of estimates that they cannot separate.
#[derive(Serialize)]
struct IdentifiableCombination<'a> {
    factors: [&'a str; 2],
    /// `ratio` or `product`.
    combination: &'a str,
    value: f64,
    relative_standard_error: f64,
}

/// Write the keys of an estimate.
pub(super) fn put(
    answers: &Answers,
    outcome: &ParameterEstimates,
    record: &mut JsonObject<'_>,
) -> Result<(), ReportError> {
    let counted = |is: fn(&StartResult) -> bool| outcome.start_results.iter().filter(|end| is(end)).count();
    record.put("factors", &factors(answers, outcome))?;
    // Case → sensor → misfit.
    let misfits = answers.fits(outcome).map(|(case, fitted)| (case.id.as_str(), misfits(case, fitted)));
    record.put("misfits", &OrderedMap(misfits.collect()))?;
    let (initial, last) = outcome.objectives();
    record.put("objective", &Objective { initial, r#final: last })?;
    // As given to `--loss`.
    record.put("loss_function", &outcome.loss.to_string())?;
    // The bounds that define the priors.
    record.put("prior", &outcome.prior.map(Bounds::name))?;
    let starts = Starts {
        requested: outcome.start_results.len(),
        converged: counted(|end| end.converged),
        at_estimate: counted(|end| end.is_best),
    };
    record.put("starts", &starts)?;
    record.put("iterations", &outcome.iterations.len().saturating_sub(1))?;
    record.put("marches", &outcome.marches)?;
    record.put("termination", &outcome.termination)?;
    record.put("converged", &outcome.converged)?;
    record.put("condition_number", &outcome.identifiability.condition_number)?;
    record.put("correlation", &outcome.identifiability.correlation)?;
    let determined: Vec<IdentifiableCombination<'_>> =
        outcome.combinations.iter().map(|found| identifiable_combination(outcome, found)).collect();
    record.put("identifiable_combinations", &determined)?;
    // 95 % intervals by profile likelihood; `null` for an end beyond the bound.
    if let Some(profiles) = profiles(outcome) {
        record.put("profiles", &profiles)?;
    }
    record.put("samples", &outcome.samples)?;
    let GoodnessOfFit { chi_squared, degrees_of_freedom, .. } = outcome.goodness_of_fit;
    record.put("chi_squared", &chi_squared)?;
    record.put("degrees_of_freedom", &degrees_of_freedom)?;
    record.put("reduced_chi_squared", &outcome.goodness_of_fit.reduced_chi_squared)?;
    record.put("akaike_criterion", &outcome.goodness_of_fit.akaike_criterion)?;
    record.put("bayesian_criterion", &outcome.goodness_of_fit.bayesian_criterion)?;
    record.put("autocorrelation", &outcome.autocorrelation)?;
    record.put("correlation_probability", &outcome.correlation_probability)?;
    // Parameters of the noise model.
    record.put("correlation_time_s", &outcome.correlation_time_s)?;
    record.put("white_noise_share", &outcome.white_share)?;
    record.put("noise_variance", &outcome.noise_variance)?;
    record.put("effective_samples", &outcome.effective_samples)?;
    record.put("noise_inflation", &outcome.noise_inflation)
}

fn factors<'a>(answers: &'a Answers, outcome: &'a ParameterEstimates) -> OrderedMap<'a, FactorRecord<'a>> {
    let cases = |places: &[Option<usize>]| -> Vec<&'a str> {
        let within = answers.cases().zip(places).filter(|(_, place)| place.is_some() && places.len() > 1);
        within.map(|(case, _)| case.id.as_str()).collect()
    };
    let record = |(index, estimand): (usize, &'a Estimand)| {
        let record = FactorRecord {
            value: outcome.values[index],
            standard_error: outcome.standard_errors[index],
            independent_standard_error: outcome.independent_errors[index],
            numerical_error: outcome.numerical_errors[index],
            has_effect: outcome.has_effect[index],
            low: outcome.intervals[index].0,
            high: outcome.intervals[index].1,
            cases: cases(&estimand.factor_indices),
        };
        (estimand.factor.name.as_str(), record)
    };
    OrderedMap(outcome.factors.iter().enumerate().map(record).collect())
}

fn profiles(outcome: &ParameterEstimates) -> Option<OrderedMap<'_, ProfileInterval>> {
    let of = |profile: &Profile| {
        let (low, high) = profile.interval;
        (outcome.factors[profile.factor].factor.name.as_str(), ProfileInterval { low, high })
    };
    let named: Vec<(&str, ProfileInterval)> = outcome.profiles.iter().map(of).collect();
    (!named.is_empty()).then_some(OrderedMap(named))
}

fn misfits<'a>(case: &'a Case, fitted: &CaseFit) -> OrderedMap<'a, MisfitRecord> {
    let named = fitted.sensors.iter().zip(&fitted.misfits).map(|(&sensor, (before, after))| {
        let record = MisfitRecord { nominal_rms_k: before.rms_k, estimated_rms_k: after.rms_k };
        (case.sensors[sensor].name.as_str(), record)
    });
    OrderedMap(named.collect())
}

fn identifiable_combination<'a>(outcome: &'a ParameterEstimates, found: &Combination) -> IdentifiableCombination<'a> {
    let name = |place: usize| outcome.factors[place].factor.name.as_str();
    IdentifiableCombination {
        factors: [name(found.pair.0), name(found.pair.1)],
        combination: if found.is_ratio { "ratio" } else { "product" },
        value: found.value,
        relative_standard_error: found.relative_error,
    }
}
