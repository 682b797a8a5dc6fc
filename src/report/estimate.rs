//! The estimate of factors from observations, with its posterior and the comparison with another model.

mod beside;
mod figures;
mod page;
mod posterior;
mod record;
mod tables;
mod warnings;

use super::answer::{Answer, Finding, Room, Section};
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use super::summary::wrapped;
use super::words::sentence;
use super::{ReportError, words};
use crate::fit::Loss;
use crate::study::answers::Answers;
use crate::study::estimate::{Estimand, Estimated};
use crate::study::nominal::Nominal;

impl Answer for Estimated {
    fn nominal(&self) -> Option<&Nominal> {
        self.fitted.first().map(|fitted| &fitted.before)
    }

    fn fitted(&self) -> Option<&Nominal> {
        self.fitted.first().map(|fitted| &fitted.after)
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let mut found = Vec::new();
        let mut add = |about: &'static str, text: String| found.push(Finding { about, said: text });
        if let Some(outcome) = &answers.beside {
            add("Model comparison", beside::explained(answers, outcome));
        }
        add("Estimate", estimates(self));
        if let Some(text) = shared(answers, self) {
            add("Shared factors", text);
        }
        for (name, (before, after)) in answers.misfits(self) {
            add(
                "Misfit",
                format!(
                    "{name}: RMSE {} with the nominal factors, {} with the estimates.",
                    words::misfit(before.rms_k),
                    words::misfit(after.rms_k)
                ),
            );
        }
        if let Some(outcome) = &answers.posterior {
            add("Posterior", posterior::walked(outcome));
            add("Model discrepancy", posterior::lacking(outcome));
            if let Some(text) = posterior::foreseen(answers, outcome) {
                add("Prediction", text);
            }
        }
        if let Some(text) = ends(self) {
            add("Starts", text);
        }
        let ended = if self.converged { "Converged" } else { "Not converged" };
        let iterations = words::counted(self.path.len().saturating_sub(1), "iteration");
        add(
            "Termination",
            format!(
                "{ended} after {iterations} and {}: {}.",
                words::counted(self.marches, "marched member"),
                sentence(&self.termination)
            ),
        );
        found
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        let posterior = answers.posterior.iter().flat_map(|outcome| posterior::doubts(answers, self, outcome));
        warnings::all(answers, self).into_iter().chain(posterior).collect()
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        let mut figures: Vec<(&'static str, Figure)> = Vec::new();
        figures.extend(figures::figures(answers, self).into_iter().map(|figure| ("estimation", figure)));
        if let Some(outcome) = &answers.posterior {
            figures.extend(posterior::figures(answers, self, outcome).into_iter().map(|figure| ("posterior", figure)));
        }
        if let (Some(first), Some(outcome)) = (self.fitted.first(), &answers.beside) {
            let each = beside::figures(&answers.case, first, outcome);
            figures.extend(each.into_iter().map(|figure| ("model-comparison", figure)));
        }
        figures
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        let mut sections = vec![Section::new("estimation", "Estimation", page::page(answers, self))];
        if let Some(outcome) = &answers.posterior {
            sections.push(Section::new("posterior", "Posterior", posterior::page(answers, self, outcome)));
        }
        if let Some(outcome) = &answers.beside {
            sections.push(Section::new("model-comparison", "Model comparison", beside::page(answers, outcome)));
        }
        sections
    }

    fn method(&self, answers: &Answers) -> Vec<String> {
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

    fn tables(&self, answers: &Answers) -> Result<Vec<File>, ReportError> {
        let mut tables = tables::all(answers, self)?;
        if let Some(outcome) = &answers.posterior {
            tables.extend(posterior::tables(answers, self, outcome)?);
        }
        Ok(tables)
    }

    fn record(&self, answers: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record::put(answers, self, record)?;
        if let Some(outcome) = &answers.posterior {
            record.put("posterior", &posterior::PosteriorRecord::of(answers, self, outcome))?;
        }
        match &answers.beside {
            Some(outcome) => record.put("model_comparison", &beside::record(&answers.case, outcome)),
            None => Ok(()),
        }
    }

    fn screen(&self, answers: &Answers, room: &Room) -> Vec<String> {
        let mut lines = on_screen(answers, self, room);
        let beside = answers.beside.as_ref().map(|outcome| beside::explained(answers, outcome));
        lines.extend(beside.into_iter().flat_map(|text| wrapped("", &text)));
        lines
    }
}

/// Standard error of an estimate; a dash if it is not determined.
fn standard_error(outcome: &Estimated, place: usize) -> String {
    if outcome.is_determined(place) { words::significant(outcome.standard_errors[place], 2) } else { "-".to_owned() }
}

/// 95 % interval of an estimate, or why there is none.
fn within(outcome: &Estimated, place: usize) -> String {
    if outcome.has_effect[place] {
        words::interval(outcome.intervals[place], outcome.factors[place].bounds)
    } else {
        "no effect on data".to_owned()
    }
}

/// The noise model of the residuals.
fn noise(outcome: &Estimated) -> String {
    let correlation = if outcome.correlation_time_s > 0.0 {
        let share = outcome.white_share;
        let white =
            if share > 0.0 { format!(" and a white-noise share of {}", words::percent(share)) } else { String::new() };
        format!("correlation time {}{white}", words::seconds(outcome.correlation_time_s))
    } else {
        "white noise".to_owned()
    };
    format!(
        "Noise model of the residuals (maximum restricted likelihood): {correlation}. Effective sample size {} of {}; \
         lag-one autocorrelation of the residuals {}.",
        words::significant(outcome.effective_samples, 2),
        words::count(outcome.samples),
        words::significant(outcome.autocorrelation, 2)
    )
}

fn estimates(outcome: &Estimated) -> String {
    let values: Vec<String> = (0..outcome.factors.len())
        .map(|index| {
            let factor = &outcome.factors[index].factor;
            let interval = within(outcome, index);
            format!("{} = {:.3} (95 % interval: {interval})", factor.name, outcome.values[index])
        })
        .collect();
    format!("{}.", words::listed(&values))
}

/// Which factors the cases share, and which belong to one case.
fn shared(answers: &Answers, outcome: &Estimated) -> Option<String> {
    let cases: Vec<&str> = answers.cases().map(|case| case.id.as_str()).collect();
    let is_shared = |factor: &&Estimand| factor.places.iter().flatten().count() > 1;
    let name = |factor: &Estimand| factor.factor.name.clone();
    let (shared, single): (Vec<&Estimand>, Vec<&Estimand>) = outcome.factors.iter().partition(is_shared);
    let [shared, single] = [shared, single].map(|factors| factors.into_iter().map(name).collect::<Vec<String>>());
    let text = match (shared.len(), single.len()) {
        (0, _) => format!("{} share no factor: the fits are independent.", words::listed(&cases)),
        (_, 0) => format!("{} share all factors.", words::listed(&cases)),
        _ => format!(
            "{} share {}; factors of a single case: {}.",
            words::listed(&cases),
            words::listed(&shared),
            words::listed(&single)
        ),
    };
    (cases.len() > 1).then_some(text)
}

/// Definition of the objective.
fn objective(outcome: &Estimated) -> String {
    let of_residuals = "the residuals over their standard deviations";
    let of_data = match outcome.loss {
        Loss::Squares => format!("the sum of squares of {of_residuals}"),
        Loss::SoftL1 { width } => soft("soft L1", width, of_residuals),
        Loss::Huber { width } => soft("Huber", width, of_residuals),
    };
    let Some(bounds) = outcome.prior else { return format!("The objective S is {of_data}.") };
    format!(
        "The objective S is {of_data}, divided by the square of the noise inflation {} (which accounts for variance \
         and autocorrelation of the residuals), plus the squares of the deviations of the factors from their nominal \
         values over their prior standard deviations (half the distance to the {} bounds).",
        words::significant(outcome.shortfall, 3),
        bounds.name()
    )
}

fn soft(name: &str, width: f64, of_residuals: &str) -> String {
    format!(
        "the sum of the {name} loss of {of_residuals}, which is linear beyond {} standard deviations",
        words::significant(width, 3)
    )
}

/// Summary of a multi-start estimate.
fn ends(outcome: &Estimated) -> Option<String> {
    let least = outcome.ends.iter().filter(|end| end.is_least).count();
    let others = outcome.ends.len() - least;
    let rest = match others {
        0 => "no other minimum was found".to_owned(),
        _ => format!("{} at a higher objective, in other minima or not converged", words::count(others)),
    };
    (outcome.ends.len() > 1)
        .then(|| format!("{least} of {} ended at the estimate; {rest}.", words::counted(outcome.ends.len(), "start")))
}

fn on_screen(answers: &Answers, outcome: &Estimated, room: &Room) -> Vec<String> {
    let mut lines = vec![format!(
        "{:<20}{:>8}{:>10}{:>10}{:>20}  {}",
        "factor", "start", "estimate", "std error", "95 % interval", ""
    )];
    for index in 0..outcome.factors.len().min(room.factors) {
        lines.push(format!(
            "{:<20}{:>8.3}{:>10.4}{:>10}{:>20}  {}",
            words::short(&outcome.factors[index].factor.name, 19),
            outcome.path[0].values[index],
            outcome.values[index],
            standard_error(outcome, index),
            within(outcome, index),
            if outcome.at_bound[index] { "at bound" } else { "" }
        ));
    }
    for profile in outcome.profiles.iter().take(room.factors) {
        let estimand = &outcome.factors[profile.factor];
        let within = words::profiled(profile.interval, estimand.bounds);
        lines.push(format!("{}: 95 % profile interval {within}", estimand.factor.name));
    }
    if let Some(drawn) = &answers.posterior {
        for (marginal, estimand) in drawn.marginals.iter().zip(&outcome.factors).take(room.factors) {
            let ((low, high), name) = (marginal.interval, &estimand.factor.name);
            lines.push(format!("{name}: posterior median {:.3}, 95 % interval {low:.3} to {high:.3}", marginal.median));
        }
        lines.push(posterior::walked_shortly(drawn));
        lines.extend(posterior::foreseen(answers, drawn).map_or(Vec::new(), |text| wrapped("", &text)));
    }
    for (name, (before, after)) in answers.misfits(outcome).into_iter().take(room.fitted) {
        lines.push(format!(
            "{name}: RMSE {} nominal, {} estimated",
            words::misfit(before.rms_k),
            words::misfit(after.rms_k)
        ));
    }
    // Least squares is the default; only another objective is described.
    let is_plain = outcome.loss == Loss::Squares && outcome.prior.is_none();
    let named = (!is_plain).then(|| objective(outcome));
    lines.extend(named.into_iter().chain(ends(outcome)).flat_map(|text| wrapped("", &text)));
    let ended = if outcome.converged { "converged" } else { "NOT converged" };
    lines.push(format!(
        "{ended} after {}: {}",
        words::counted(outcome.path.len().saturating_sub(1), "iteration"),
        outcome.termination
    ));
    lines
}
