//! The fit of factors to observations, with its posterior and the comparison with another case where there are such.

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
        let mut say = |about: &'static str, said: String| found.push(Finding { about, said });
        if let Some(outcome) = &answers.beside {
            say("Beside", beside::explained(answers, outcome));
        }
        say("Estimate", estimates(self));
        if let Some(said) = shared(answers, self) {
            say("Shared", said);
        }
        for (name, (before, after)) in answers.misfits(self) {
            say(
                "Fit",
                format!(
                    "{name} is off by {} (root mean square) with the nominal factors and by {} with the estimates.",
                    words::misfit(before.rms_k),
                    words::misfit(after.rms_k)
                ),
            );
        }
        if let Some(outcome) = &answers.posterior {
            say("Posterior", posterior::walked(outcome));
            say("Lacking", posterior::lacking(outcome));
            if let Some(said) = posterior::foreseen(answers, outcome) {
                say("Foreseen", said);
            }
        }
        if let Some(said) = ends(self) {
            say("Starts", said);
        }
        let ended = if self.converged { "It converged" } else { "It did not converge" };
        let turns = words::counted(self.path.len().saturating_sub(1), "iteration");
        say(
            "Ending",
            format!(
                "{ended}, after {turns} and {}: {}.",
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
            figures.extend(each.into_iter().map(|figure| ("beside", figure)));
        }
        figures
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        let mut sections = vec![Section::new("estimation", "Estimation", page::page(answers, self))];
        if let Some(outcome) = &answers.posterior {
            sections.push(Section::new("posterior", "Posterior", posterior::page(answers, self, outcome)));
        }
        if let Some(outcome) = &answers.beside {
            sections.push(Section::new("beside", "Beside another case", beside::page(answers, outcome)));
        }
        sections
    }

    fn method(&self, answers: &Answers) -> Vec<String> {
        let mut said = vec![
            "Estimation: the Levenberg-Marquardt method (Levenberg 1944; Marquardt 1963; Özışık & Orlande, Inverse \
             Heat Transfer, 2000) within the bounds. Standard errors and 95 % intervals are those of least squares under a \
             noise model, an exponentially correlated process with a share of white noise, that is estimated with the \
             factors by restricted likelihood (Patterson & Thompson 1971) and integrated over; the discretisation error of the march \
             is added in quadrature. The standard error is half the interval over 1.96."
                .to_owned(),
        ];
        if !self.profiles.is_empty() {
            said.push(
                "Profiles: one factor is held at value after value while all others are sought again, and what was made least \
                 rises above its least (Bates & Watts, Nonlinear Regression Analysis, 1988). The interval ends where the rise is that at the \
                 ends of the linear interval of a linear problem."
                    .to_owned(),
            );
        }
        if answers.posterior.is_some() {
            said.push(posterior::METHOD.to_owned());
        }
        said
    }

    /// | file | columns |
    /// |---|---|
    /// | `residuals.csv` | `sensor`, `time_s`, measured less predicted over the fitted window |
    /// | `traces-CASE.csv`, `residuals-CASE.csv`, `predictive-CASE.csv` | the same of the further cases of a joint estimate |
    /// | `path.csv` | `iteration`, the factors, the objective that is minimised, the damping |
    /// | `profiles.csv` | `held`, the factor that is held, all factors, the rise of the objective in squares of a standard error |
    /// | `landscape.csv` | the two factors and the objective that is minimised over their plane, line by line, one of the factors being constant on a line; `valley` is 1 where the objective is least on its line |
    /// | `posterior.csv` | values of the factors, drawn as often as they are likely |
    /// | `predictive.csv` | `sensor`, `time_s`, between what 95 % of these predict, and the same with what the model lacks |
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
            Some(outcome) => record.put("beside", &beside::record(&answers.case, outcome)),
            None => Ok(()),
        }
    }

    fn screen(&self, answers: &Answers, room: &Room) -> Vec<String> {
        let mut lines = on_screen(answers, self, room);
        let beside = answers.beside.as_ref().map(|outcome| beside::explained(answers, outcome));
        lines.extend(beside.into_iter().flat_map(|said| wrapped("", &said)));
        lines
    }
}

/// One standard deviation of an estimate; none where it is not determined.
fn standard_error(outcome: &Estimated, place: usize) -> String {
    if outcome.is_determined(place) { words::significant(outcome.standard_errors[place], 2) } else { "-".to_owned() }
}

/// The 95 % interval of an estimate, or why there is none.
fn within(outcome: &Estimated, place: usize) -> String {
    if outcome.has_effect[place] {
        words::interval(outcome.intervals[place], outcome.factors[place].bounds)
    } else {
        "no effect on data".to_owned()
    }
}

/// The noise model of the residuals.
fn noise(outcome: &Estimated) -> String {
    let memory = if outcome.correlation_time_s > 0.0 {
        let share = outcome.white_share;
        let white =
            if share > 0.0 { format!(" with a white share of {}", words::percent(share)) } else { String::new() };
        format!("correlated over {}{white}", words::seconds(outcome.correlation_time_s))
    } else {
        "white noise".to_owned()
    };
    format!(
        "Noise model of the residuals (restricted likelihood): most probably {memory}. Effective sample size {} of {}; the lag-one \
         autocorrelation of the residuals is {}.",
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

/// Which factors are one in several cases, and which are another in each.
fn shared(answers: &Answers, outcome: &Estimated) -> Option<String> {
    let cases: Vec<&str> = answers.cases().map(|case| case.id.as_str()).collect();
    let is_shared = |factor: &&Estimand| factor.places.iter().flatten().count() > 1;
    let name = |factor: &Estimand| factor.factor.name.clone();
    let (shared, own): (Vec<&Estimand>, Vec<&Estimand>) = outcome.factors.iter().partition(is_shared);
    let [shared, own] = [shared, own].map(|factors| factors.into_iter().map(name).collect::<Vec<String>>());
    let said = match (shared.len(), own.len()) {
        (0, _) => format!("{} share no factor: they are fitted side by side.", words::listed(&cases)),
        (_, 0) => format!("{} share all factors.", words::listed(&cases)),
        _ => format!("{} share {}; {} of one case alone.", words::listed(&cases), words::listed(&shared), {
            let verb = if own.len() == 1 { "is" } else { "are" };
            format!("{} {verb}", words::listed(&own))
        }),
    };
    (cases.len() > 1).then_some(said)
}

/// What was minimised.
fn objective(outcome: &Estimated) -> String {
    let of_residuals = "the residuals over their standard deviations";
    let of_data = match outcome.loss {
        Loss::Squares => format!("the sum of squares of {of_residuals}"),
        Loss::SoftL1 { width } => soft("soft L1", width, of_residuals),
        Loss::Huber { width } => soft("Huber's", width, of_residuals),
    };
    let Some(bounds) = outcome.prior else { return format!("S, the objective that is minimised, is {of_data}.") };
    format!(
        "S, the objective that is minimised, is {of_data}, divided by the square of {} (by so much the residuals exceed \
         the stated deviations), plus the square of each factor's distance from its nominal value over its prior standard \
         deviation (half the way to its {} bounds).",
        words::significant(outcome.shortfall, 3),
        bounds.name()
    )
}

fn soft(name: &str, width: f64, of_residuals: &str) -> String {
    format!(
        "the sum of the {name} loss of {of_residuals}, which beyond {} of them grows with the distance and not with its \
         square",
        words::significant(width, 3)
    )
}

/// Where several descents ended.
fn ends(outcome: &Estimated) -> Option<String> {
    let least = outcome.ends.iter().filter(|end| end.is_least).count();
    let others = outcome.ends.len() - least;
    let rest = match others {
        0 => "no other minimum was met".to_owned(),
        _ => format!("{} ended higher, in other minima or short of one", words::counted(others, "other")),
    };
    (outcome.ends.len() > 1)
        .then(|| format!("Of {} {least} ended at the estimate; {rest}.", words::counted(outcome.ends.len(), "start")))
}

fn on_screen(answers: &Answers, outcome: &Estimated, room: &Room) -> Vec<String> {
    let mut lines =
        vec![format!("{:<20}{:>8}{:>10}{:>10}{:>20}  {}", "factor", "start", "estimate", "± (1 σ)", "95 % within", "")];
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
        lines.push(format!("{}: 95 % by its profile: {within}", estimand.factor.name));
    }
    if let Some(drawn) = &answers.posterior {
        for (marginal, estimand) in drawn.marginals.iter().zip(&outcome.factors).take(room.factors) {
            let ((low, high), name) = (marginal.interval, &estimand.factor.name);
            lines.push(format!("{name}: 95 % by its posterior: {low:.3} to {high:.3}, median {:.3}", marginal.median));
        }
        lines.push(posterior::walked_shortly(drawn));
        lines.extend(posterior::foreseen(answers, drawn).map_or(Vec::new(), |said| wrapped("", &said)));
    }
    for (name, (before, after)) in answers.misfits(outcome).into_iter().take(room.fitted) {
        lines.push(format!(
            "{name} is off by {} (rms) nominally, {} with these factors",
            words::misfit(before.rms_k),
            words::misfit(after.rms_k)
        ));
    }
    // Least squares are what is expected; another objective is named.
    let is_plain = outcome.loss == Loss::Squares && outcome.prior.is_none();
    let named = (!is_plain).then(|| objective(outcome));
    lines.extend(named.into_iter().chain(ends(outcome)).flat_map(|said| wrapped("", &said)));
    let ended = if outcome.converged { "converged" } else { "NOT converged" };
    lines.push(format!(
        "{ended} after {}: {}",
        words::counted(outcome.path.len().saturating_sub(1), "iteration"),
        outcome.termination
    ));
    lines
}
