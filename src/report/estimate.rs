//! The estimate of factors from observations, with its posterior and the comparison with another model.

mod figures;
mod model_comparison;
mod page;
mod posterior;
mod record;
pub(super) mod tables;
mod warnings;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, TableDescription};
use super::format::clause;
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, more, with_needed, wrap};
use super::{ReportError, format};
use crate::fit::RobustLoss;
use crate::study::answers::Answers;
use crate::study::estimate::{Estimand, ParameterEstimates};
use crate::study::nominal::Prediction;

impl Reportable for ParameterEstimates {
    fn nominal(&self) -> Option<&Prediction> {
        self.fitted.first().map(|fitted| &fitted.before)
    }

    fn fitted(&self) -> Option<&Prediction> {
        self.fitted.first().map(|fitted| &fitted.after)
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let mut found = Vec::new();
        let mut add = |about: &'static str, text: String| found.push(Finding { label: about, text });
        if let Some(outcome) = &answers.model_comparison {
            add("Model comparison", model_comparison::explained_misfit(answers, outcome));
        }
        add("Estimate", estimates_text(self));
        if let Some(text) = shared_factors(answers, self) {
            add("Shared factors", text);
        }
        for (name, (before, after)) in answers.misfits(self) {
            add(
                "Misfit",
                format!(
                    "{name}: RMSE {} with the nominal factors, {} with the estimates.",
                    format::temperature_difference(before.rms_k),
                    format::temperature_difference(after.rms_k)
                ),
            );
        }
        if let Some(outcome) = &answers.posterior {
            add("Posterior", posterior::mcmc_summary(outcome));
            add("Model discrepancy", posterior::model_discrepancy(outcome));
            if let Some(text) = posterior::predicted_peak(answers, outcome) {
                add("Prediction", text);
            }
        }
        if let Some(text) = multistart_summary(self) {
            add("Starts", text);
        }
        let ended = if self.converged { "Converged" } else { "Not converged" };
        let iterations = format::counted(self.iterations.len().saturating_sub(1), "iteration");
        add(
            "Termination",
            format!(
                "{ended} after {iterations} and {}: {}.",
                format::counted(self.marches, "marched member"),
                clause(&self.termination)
            ),
        );
        found
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        let posterior =
            answers.posterior.iter().flat_map(|outcome| posterior::posterior_warnings(answers, self, outcome));
        warnings::all(answers, self).into_iter().chain(posterior).collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let mut figures: Vec<(&'static str, Figure)> = Vec::new();
        figures.extend(figures::figures(answers, self).into_iter().map(|figure| ("estimation", figure)));
        if let Some(outcome) = &answers.posterior {
            figures.extend(posterior::figures(answers, self, outcome).into_iter().map(|figure| ("posterior", figure)));
        }
        if let (Some(first), Some(outcome)) = (self.fitted.first(), &answers.model_comparison) {
            let each = model_comparison::figures(&answers.case, first, outcome);
            figures.extend(each.into_iter().map(|figure| ("model-comparison", figure)));
        }
        figures
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        let mut sections = vec![Section::new("estimation", "Estimation", page::page(answers, self))];
        if let Some(outcome) = &answers.posterior {
            sections.push(Section::new("posterior", "Posterior", posterior::page(answers, self, outcome)));
        }
        if let Some(outcome) = &answers.model_comparison {
            sections.push(Section::new(
                "model-comparison",
                "Model comparison",
                model_comparison::page(answers, outcome),
            ));
        }
        sections
    }

    fn methods(&self, answers: &Answers) -> Vec<String> {
        let mut text = vec![
            "Estimation: bounded least squares by the Levenberg-Marquardt method (Levenberg 1944; Marquardt 1963; \
             Özışık & Orlande, Inverse Heat Transfer, 2000). Standard errors and 95 % intervals assume residuals that \
             are the sum of white noise and an exponentially correlated process. The parameters of this noise model \
             are estimated by restricted likelihood (Patterson & Thompson 1971) and marginalised; the discretisation \
             error of the march is added in quadrature. The standard error is the half-width of the interval over 1.96."
                .to_owned(),
        ];
        if !self.profiles.is_empty() {
            text.push(
                "Profile likelihood: one factor is fixed at a sequence of values and all others are estimated again; \
                 the rise of the objective above its minimum is recorded (Bates & Watts, Nonlinear Regression \
                 Analysis, 1988). The interval ends at the rise that a linear problem has at the ends of its linear \
                 interval."
                    .to_owned(),
            );
        }
        if answers.posterior.is_some() {
            text.push(posterior::METHOD.to_owned());
        }
        text
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![
            tables::residuals_table().description(),
            tables::iterations_table().description(),
            tables::landscape_table().description(),
            tables::profiles_table().description(),
            posterior::samples_table().description(),
            posterior::chains_table().description(),
            posterior::predictive_table().description(),
        ]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let mut tables = tables::all(answers, self)?;
        if let Some(outcome) = &answers.posterior {
            tables.extend(posterior::tables(answers, self, outcome)?);
        }
        Ok(tables)
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record::put(answers, self, record)?;
        if let Some(outcome) = &answers.posterior {
            record.put("posterior", &posterior::PosteriorRecord::of(answers, self, outcome))?;
        }
        match &answers.model_comparison {
            Some(outcome) => record.put("model_comparison", &model_comparison::record(&answers.case, outcome)),
            None => Ok(()),
        }
    }

    fn screen(&self, answers: &Answers, room: &ScreenLimits) -> Vec<String> {
        let mut lines = on_screen(answers, self, room);
        let beside =
            answers.model_comparison.as_ref().map(|outcome| model_comparison::explained_misfit(answers, outcome));
        lines.extend(beside.into_iter().flat_map(|text| wrap("", &text)));
        lines
    }
}

/// Standard error of an estimate; a dash if it is not determined.
fn standard_error(outcome: &ParameterEstimates, place: usize) -> String {
    if outcome.is_determined(place) { format::significant(outcome.standard_errors[place], 2) } else { "-".to_owned() }
}

/// 95 % interval of an estimate, or why there is none.
fn interval_text(outcome: &ParameterEstimates, place: usize) -> String {
    if outcome.has_effect[place] {
        format::interval(outcome.intervals[place], outcome.factors[place].bounds)
    } else {
        "no effect on data".to_owned()
    }
}

/// The noise model of the residuals.
fn noise_model(outcome: &ParameterEstimates) -> String {
    let correlation = format::noise_correlation(outcome.correlation_time_s, outcome.white_share);
    format!(
        "Noise model of the residuals (maximum restricted likelihood): {correlation}. Effective sample size {} of {}; \
         lag-one autocorrelation of the residuals {}.",
        format::significant(outcome.effective_samples, 2),
        format::count(outcome.samples),
        format::significant(outcome.autocorrelation, 2)
    )
}

fn estimates_text(outcome: &ParameterEstimates) -> String {
    let values: Vec<String> = (0..outcome.factors.len())
        .map(|index| {
            let factor = &outcome.factors[index].factor;
            let interval = interval_text(outcome, index);
            format!("{} = {:.3} (95 % interval: {interval})", factor.name, outcome.values[index])
        })
        .collect();
    format!("{}.", format::list(&values))
}

/// Which factors the cases share, and which belong to one case.
fn shared_factors(answers: &Answers, outcome: &ParameterEstimates) -> Option<String> {
    let cases: Vec<&str> = answers.cases().map(|case| case.id.as_str()).collect();
    let is_shared = |factor: &&Estimand| factor.factor_indices.iter().flatten().count() > 1;
    let name = |factor: &Estimand| factor.factor.name.clone();
    let (shared, single): (Vec<&Estimand>, Vec<&Estimand>) = outcome.factors.iter().partition(is_shared);
    let [shared, single] = [shared, single].map(|factors| factors.into_iter().map(name).collect::<Vec<String>>());
    let text = match (shared.len(), single.len()) {
        (0, _) => format!("{} share no factor: the fits are independent.", format::list(&cases)),
        (_, 0) => format!("{} share all factors.", format::list(&cases)),
        _ => format!(
            "{} share {}; factors of a single case: {}.",
            format::list(&cases),
            format::list(&shared),
            format::list(&single)
        ),
    };
    (cases.len() > 1).then_some(text)
}

/// Statistics of the fit on one line: χ² over the degrees of freedom is the reduced χ².
fn goodness_of_fit(outcome: &ParameterEstimates) -> String {
    let of = outcome.goodness_of_fit;
    format!(
        "χ² {}/{} = {}, AIC {}, BIC {}, effective n {} of {}",
        format::significant(of.chi_squared, 4),
        format::count(of.degrees_of_freedom),
        format::significant(of.reduced_chi_squared, 3),
        format::grouped(of.akaike_criterion, 1),
        format::grouped(of.bayesian_criterion, 1),
        format::significant(outcome.effective_samples, 2),
        format::count(outcome.samples)
    )
}

/// Definition of the objective.
fn objective_definition(outcome: &ParameterEstimates) -> String {
    let of_residuals = "the residuals over their standard deviations";
    let of_data = match outcome.loss {
        RobustLoss::Squares => format!("the sum of squares of {of_residuals}"),
        RobustLoss::SoftL1 { width } => robust_loss("soft L1", width, of_residuals),
        RobustLoss::Huber { width } => robust_loss("Huber", width, of_residuals),
    };
    let Some(bounds) = outcome.prior else { return format!("The objective S is {of_data}.") };
    format!(
        "The objective S is {of_data}, divided by the square of the noise inflation {} (which accounts for variance \
         and autocorrelation of the residuals), plus the squares of the deviations of the factors from their nominal \
         values over their prior standard deviations (half the distance to the {} bounds).",
        format::significant(outcome.noise_inflation, 3),
        bounds.name()
    )
}

fn robust_loss(name: &str, width: f64, of_residuals: &str) -> String {
    format!(
        "the sum of the {name} loss of {of_residuals}, which is linear beyond {} standard deviations",
        format::significant(width, 3)
    )
}

/// Summary of a multi-start estimate.
fn multistart_summary(outcome: &ParameterEstimates) -> Option<String> {
    let least = outcome.start_results.iter().filter(|end| end.is_best).count();
    let others = outcome.start_results.len() - least;
    let rest = match others {
        0 => "no other minimum was found".to_owned(),
        _ => format!("{} at a higher objective, in other minima or not converged", format::count(others)),
    };
    (outcome.start_results.len() > 1).then(|| {
        format!("{least} of {} ended at the estimate; {rest}.", format::counted(outcome.start_results.len(), "start"))
    })
}

fn on_screen(answers: &Answers, outcome: &ParameterEstimates, room: &ScreenLimits) -> Vec<String> {
    let mut rows = vec![head(["factor", "start", "estimate", "std error", "95 % interval", ""])];
    for index in 0..outcome.factors.len().min(room.factors) {
        rows.push([
            format::truncate(&outcome.factors[index].factor.name, 19),
            format!("{:.3}", outcome.iterations[0].values[index]),
            format!("{:.4}", outcome.values[index]),
            standard_error(outcome, index),
            interval_text(outcome, index),
            if outcome.at_bound[index] { "at bound".to_owned() } else { String::new() },
        ]);
    }
    let [name, at_bound] = [(0, 20), (2, 0)].map(|(gap, width)| Column::Left { gap, width });
    let [start, estimate, error, interval] = [8, 10, 10, 20].map(Column::Right);
    let mut lines = aligned([name, start, estimate, error, interval, at_bound], &rows);
    let hidden = |count: usize| count.saturating_sub(room.factors);
    lines.extend(more(hidden(outcome.factors.len()), "factor"));
    for profile in outcome.profiles.iter().take(room.factors) {
        let estimand = &outcome.factors[profile.factor];
        let within = format::profile_interval(profile.interval, estimand.bounds);
        lines.push(format!("{}: 95 % profile interval {within}", estimand.factor.name));
    }
    lines.extend(more(hidden(outcome.profiles.len()), "profile interval"));
    if let Some(drawn) = &answers.posterior {
        for (marginal, estimand) in drawn.marginals.iter().zip(&outcome.factors).take(room.factors) {
            let ((low, high), name) = (marginal.interval, &estimand.factor.name);
            lines.push(format!("{name}: posterior median {:.3}, 95 % interval {low:.3} to {high:.3}", marginal.median));
        }
        lines.push(posterior::mcmc_summary_line(drawn));
        lines.extend(posterior::predicted_peak(answers, drawn).map_or(Vec::new(), |text| wrap("", &text)));
    }
    let misfits = answers.misfits(outcome);
    let limited: Vec<bool> = answers
        .fits(outcome)
        .flat_map(|(case, fitted)| fitted.sensors.iter().map(move |&sensor| case.has_limit(sensor)))
        .collect();
    let shown = with_needed(0..misfits.len(), room.misfits, |&place| limited[place]);
    let left_out = misfits.len() - shown.len();
    for (name, (before, after)) in shown.into_iter().map(|place| &misfits[place]) {
        lines.push(format!(
            "{name}: RMSE {} nominal, {} estimated",
            format::temperature_difference(before.rms_k),
            format::temperature_difference(after.rms_k)
        ));
    }
    lines.extend(more(left_out, "sensor"));
    // Least squares is the default; only another objective is described.
    let is_plain = outcome.loss == RobustLoss::Squares && outcome.prior.is_none();
    let named = (!is_plain).then(|| objective_definition(outcome));
    lines.extend(named.into_iter().chain(multistart_summary(outcome)).flat_map(|text| wrap("", &text)));
    lines.push(goodness_of_fit(outcome));
    let ended = if outcome.converged { "converged" } else { "NOT converged" };
    lines.push(format!(
        "{ended} after {}: {}",
        format::counted(outcome.iterations.len().saturating_sub(1), "iteration"),
        outcome.termination
    ));
    lines
}
