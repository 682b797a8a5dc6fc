//! The design of an experiment.

mod figures;
mod record;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription, cell};
use super::format::millimetres;
use super::html::table::{list, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, head, wrap};
use super::warnings::accuracy_warnings;
use super::{ReportError, format};
use crate::case::Case;
use crate::fit::optimal_design::{Criterion, Robustness};
use crate::study::answers::Answers;
use crate::study::experiment_design::{Candidate, Design, ExperimentDesign, NoiseSource, SampleNoise, Scenario};

impl Reportable for ExperimentDesign {
    fn comes_first(&self) -> bool {
        true
    }

    fn uses_observations(&self) -> bool {
        false
    }

    fn facts(&self) -> Vec<String> {
        vec![format!("{} of the prior", format::counted(self.request.question.members, "member"))]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let design = Finding { label: "Design", text: finding(answers, self) };
        let existing = against_existing(self).map(|text| Finding { label: "Against the case", text });
        std::iter::once(design).chain(existing).collect()
    }

    fn warnings(&self, _: &Answers) -> Vec<String> {
        let (best, request) = (&self.scenarios[0], &self.request);
        let mut warnings = Vec::new();
        let poor: Vec<&str> = (request.question.factors.iter().zip(&best.designs[0].standard_errors))
            .zip(&self.prior_deviations)
            .filter(|((_, error), prior)| *error > *prior)
            .map(|((name, _), _)| name.as_str())
            .collect();
        if !poor.is_empty() {
            warnings.push(format!(
                "{}: the expected standard error exceeds the prior standard deviation, so that no {} of these depths \
                 can tell.",
                format::list(&poor),
                format::counted(request.question.sensors, "thermocouple")
            ));
        }
        if request.noise.correlation_source == NoiseSource::Assumed {
            warnings.push(
                "White noise is assumed, as no correlation time is stated and the case has no observations: expected \
                 standard errors fall with the root of the number of samples, which those of correlated noise do not. \
                 State a correlation time."
                    .to_owned(),
            );
        }
        let mut cases: Vec<usize> = Vec::new();
        for scenario in &self.scenarios {
            // Scenarios of one case differ in the length of the run alone.
            if !cases.contains(&scenario.case) {
                cases.push(scenario.case);
                let march = format!("march of the candidates of {}", scenario.case_id);
                warnings.extend(accuracy_warnings(scenario.error_estimate.as_ref(), &scenario.balance, &march));
            }
        }
        let failed: usize = self.scenarios.iter().map(|scenario| scenario.failed).max().unwrap_or(0);
        if failed > 0 {
            warnings.push(format!("{} failed and are left out.", format::counted(failed, "member")));
        }
        warnings
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(answers, self).into_iter().map(|figure| ("design", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("design", "Design", page(answers, self))]
    }

    fn methods(&self, answers: &Answers) -> Vec<String> {
        let request = &self.request;
        let criterion = match request.question.criterion {
            Criterion::D => "D: the logarithm of the determinant of the covariance",
            Criterion::A => "A: the sum of the variances",
            Criterion::C => "c: the variance of the predicted peak of the target",
        };
        let over = match request.question.robustness() {
            Robustness::Mean => "its mean over the members",
            Robustness::Worst => "its mean over the worst 5 % of the members",
        };
        vec![format!(
            "Design: the information of a depth is the sum of the outer products of its exact derivatives by the \
             estimated factors, over the standard deviation of a sample, for each member of the prior; the other \
             factors are nominal. {} Noise is independent between thermocouples, and the covariance is that of least \
             squares under this noise, as in an estimate. Criterion {criterion}, of factors in units of their prior \
             standard deviations, and {over} (Atkinson, Donev & Tobias, Optimum Experimental Designs, 2007). The best \
             depths are found by exhaustion or by exchanges from 40 random starts (Cook & Nachtsheim, Technometrics \
             22, 1980). Standard errors are without the prior. Prior standard deviations are those of the normal \
             distribution before it is cut off at the bounds; the drawn members have 0.88 of them between symmetric \
             bounds.",
            noise_text(answers, &request.noise)
        )]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![designs_table().description(), information_table().description()]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let names = Names::of_factors(&self.request.question.factors);
        Ok(vec![designs_table().csv(&names, designs(self))?, information_table().csv(&names, information(self))?])
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("experiment_design", &record::DesignRecord::of(answers, self))
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        let mut rows = vec![head(["factor", "expected s.e.", "prior s.d."])];
        let errors = &self.scenarios[0].designs[0].standard_errors;
        for ((name, error), prior) in self.request.question.factors.iter().zip(errors).zip(&self.prior_deviations) {
            let (error, prior) = (format::significant(*error, 3), format::significant(*prior, 3));
            rows.push([name.clone(), error, prior]);
        }
        let name = Column::Left { gap: 0, width: 24 };
        let mut lines = aligned([name, Column::Right(14), Column::Right(14)], &rows);
        let text =
            [Some(finding(answers, self)), Some(noise_text(answers, &self.request.noise)), against_existing(self)];
        lines.extend(text.into_iter().flatten().flat_map(|text| wrap("", &text)));
        lines
    }
}

/// The case of a scenario.
fn case_of<'a>(answers: &'a Answers, scenario: &Scenario) -> &'a Case {
    if scenario.case == 0 { &answers.case } else { &answers.other_cases[scenario.case - 1] }
}

/// `below OF2 (1.02 mm)`, `in INS1 (2.27 mm)`.
fn depth_text(case: &Case, candidate: &Candidate) -> String {
    let place = if candidate.is_interface { "below" } else { "in" };
    format!("{place} {} ({})", case.layup.plies[candidate.ply].name, millimetres(candidate.depth_m))
}

fn depths_text(answers: &Answers, scenario: &Scenario, design: &Design) -> Vec<String> {
    let case = case_of(answers, scenario);
    design.candidates.iter().map(|&index| depth_text(case, &scenario.candidates[index])).collect()
}

/// `lcat-2259, 200 s`.
fn scenario_text(scenario: &Scenario) -> String {
    format!("{}, {}", scenario.case_id, format::seconds(scenario.run_length_s))
}

/// `f_k_INS 0.0123, f_cp_INS 0.01`.
fn errors_text(outcome: &ExperimentDesign, errors: &[f64]) -> String {
    let named = outcome.request.question.factors.iter().zip(errors);
    let named: Vec<String> = named.map(|(name, error)| format!("{name} {}", format::significant(*error, 2))).collect();
    format::list(&named)
}

fn finding(answers: &Answers, outcome: &ExperimentDesign) -> String {
    let (best, target) = (&outcome.scenarios[0], &answers.case.sensors[outcome.request.target].name);
    let among = if outcome.scenarios.len() > 1 {
        format!(" in {} ({}):", best.case_id, format::seconds(best.run_length_s))
    } else {
        String::new()
    };
    format!(
        "Place {}{among} {}. Expected standard errors: {}; the peak of {target} is then predicted to {}.",
        format::counted(outcome.request.question.sensors, "thermocouple"),
        format::list(&depths_text(answers, best, &best.designs[0])),
        errors_text(outcome, &best.designs[0].standard_errors),
        format::temperature_difference(best.designs[0].prediction_k)
    )
}

/// `Noise of a sample: 4.2 K, stated; correlation time 8.5 s, from the residuals of an estimate of lcat-2259.`
fn noise_text(answers: &Answers, noise: &SampleNoise) -> String {
    let source = |source: NoiseSource| match source {
        NoiseSource::Stated => "stated".to_owned(),
        NoiseSource::Estimated => format!("from the residuals of an estimate of {}", answers.case.id),
        NoiseSource::Assumed => "assumed".to_owned(),
    };
    let correlation = if noise.correlation_time_s > 0.0 {
        let white = match noise.white_fraction {
            0.0 => String::new(),
            fraction => format!(" with {} white noise", format::percent(fraction)),
        };
        format!("correlation time {}{white}", format::seconds(noise.correlation_time_s))
    } else {
        "white".to_owned()
    };
    let deviation = format::temperature_difference(noise.deviation_k);
    if noise.deviation_source == noise.correlation_source {
        return format!("Noise of a sample: {deviation}, {correlation}, {}.", source(noise.deviation_source));
    }
    format!(
        "Noise of a sample: {deviation}, {}; {correlation}, {}.",
        source(noise.deviation_source),
        source(noise.correlation_source)
    )
}

/// The thermocouples of the case, for comparison.
fn against_existing(outcome: &ExperimentDesign) -> Option<String> {
    let best = &outcome.scenarios[0];
    let existing = best.existing.as_ref()?;
    let ratios = existing.standard_errors.iter().zip(&best.designs[0].standard_errors).map(|(own, best)| best / own);
    let named: Vec<String> = ratios.map(|ratio| format::significant(ratio, 2)).collect();
    Some(format!(
        "The {} of {} would give {}; the design has {} times these errors. The best {} depths for \
         each factor alone give {}.",
        format::counted(existing.candidates.len(), "thermocouple"),
        best.case_id,
        errors_text(outcome, &existing.standard_errors),
        format::list(&named),
        outcome.request.question.sensors,
        errors_text(outcome, &best.smallest_errors)
    ))
}

fn page(answers: &Answers, outcome: &ExperimentDesign) -> String {
    let best = &outcome.scenarios[0];
    let factors = &outcome.request.question.factors;
    let errors = |design: &Design| -> Vec<String> {
        design.standard_errors.iter().map(|error| format::significant(*error, 3)).collect()
    };
    let with_factors = |before: &[&str], after: &[&str]| -> Vec<String> {
        let own = factors.iter().map(|name| format!("s.e. {name}"));
        before.iter().map(|&name| name.to_owned()).chain(own).chain(after.iter().map(|&name| name.to_owned())).collect()
    };
    let row = |name: String, scenario: &Scenario, design: &Design| -> Vec<String> {
        let depths = depths_text(answers, scenario, design).join("; ");
        [name, depths]
            .into_iter()
            .chain(errors(design))
            .chain([
                format::grouped(design.prediction_k, 2),
                format::grouped(design.loss, 3),
                format::grouped(design.worst_loss, 3),
            ])
            .collect()
    };
    let head = with_factors(&["", "Depths"], &["s.d. of the predicted peak, K", "Criterion", "Worst 5 %"]);
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let mut ranked: Vec<Vec<String>> =
        best.designs.iter().enumerate().map(|(place, design)| row(format::count(place + 1), best, design)).collect();
    ranked.extend(best.existing.iter().map(|design| row("the case's own".to_owned(), best, design)));
    let exposures: Vec<Vec<String>> = outcome
        .scenarios
        .iter()
        .filter(|_| outcome.scenarios.len() > 1)
        .map(|scenario| row(scenario_text(scenario), scenario, &scenario.designs[0]))
        .collect();
    let growth: Vec<Vec<String>> = (best.growth.iter().enumerate())
        .map(|(place, design)| row(format::counted(place + 1, "thermocouple"), best, design))
        .collect();
    let spread: Vec<Vec<String>> = (factors.iter().enumerate())
        .map(|(factor, name)| {
            let design = &best.designs[0];
            let (low, high) = design.error_ranges[factor];
            let correlations = design.correlation[factor].iter().map(|value| format::grouped(*value, 3));
            [
                name.clone(),
                format::significant(outcome.prior_deviations[factor], 3),
                format::significant(design.standard_errors[factor], 3),
                format!("{} to {}", format::significant(low, 2), format::significant(high, 2)),
                format::significant(best.smallest_errors[factor], 3),
            ]
            .into_iter()
            .chain(correlations)
            .collect()
        })
        .collect();
    let spread_head: Vec<String> =
        ["Factor", "Prior s.d.", "Expected s.e.", "5 to 95 % of the members", "Smallest s.e. of any depths"]
            .into_iter()
            .map(str::to_owned)
            .chain(factors.iter().map(|name| format!("Correlation {name}")))
            .collect();
    let spread_head: Vec<&str> = spread_head.iter().map(String::as_str).collect();
    let how = if best.is_exhaustive { "all sets were tried" } else { "exchanges from 40 random starts" };
    let mut text = vec![finding(answers, outcome), noise_text(answers, &outcome.request.noise)];
    text.extend(against_existing(outcome));
    text.push(
        "The smallest standard error of any depths is that of the best set for the factor alone, a bound for every \
         placement."
            .to_owned(),
    );
    text.push(format!(
        "{} of {} candidate depths, at least {} apart; {how}. {} of the prior.",
        outcome.request.question.sensors,
        best.selectable,
        millimetres(outcome.request.question.least_distance_m),
        format::counted(best.members, "member")
    ));
    list(&text)
        + &table("Expected errors of the best design", &spread_head, &spread)
        + &table(&format!("Best designs of {}", scenario_text(best)), &head, &ranked)
        + &table("Exposures and run lengths by their best design", &head, &exposures)
        + &table("Best design of each number of thermocouples", &head, &growth)
}

/// A design of a scenario.
type DesignRow<'a> = (&'a Scenario, &'a Design);

fn designs_table<'a>() -> Table<DesignRow<'a>> {
    Table::<DesignRow<'a>>::new(
        &["designs.csv"],
        "One row per design (`design`): of each exposure and run length the best ones, the best ones with fewer \
         thermocouples, and the thermocouples of the case.",
    )
    .text("case", "Id of the case that is the exposure.", |row| row.0.case_id.clone())
    .number("run_length_s", "s", "Length of the run.", |row| row.0.run_length_s)
    .number("thermocouples", "–", "Number of thermocouples.", |row| row.1.candidates.len() as f64)
    .text("depths_m", "Their depths, m, separated by spaces.", |(scenario, design)| {
        let depths = design.candidates.iter().map(|&index| cell(scenario.candidates[index].depth_m));
        depths.collect::<Vec<_>>().join(" ")
    })
    .numbers(
        "<factor>_standard_error",
        "–",
        "Expected standard error: root mean square over the members of the prior.",
        |row| row.1.standard_errors.clone(),
    )
    .number("prediction_k", "K", "Standard deviation of the predicted peak of the target.", |row| row.1.prediction_k)
    .number("criterion", "–", "The criterion over all members; smaller is better.", |row| row.1.loss)
    .number("criterion_worst", "–", "The same over the worst 5 %.", |row| row.1.worst_loss)
}

fn designs(outcome: &ExperimentDesign) -> impl Iterator<Item = DesignRow<'_>> {
    outcome.scenarios.iter().flat_map(|scenario| {
        let smaller = scenario.growth[..scenario.growth.len() - 1].iter();
        let designs = scenario.designs.iter().chain(smaller).chain(&scenario.existing);
        designs.map(move |design| (scenario, design))
    })
}

/// Depth, place of the depth in the map, and index of the instant.
type InformationRow<'a> = (&'a ExperimentDesign, f64, usize, usize);

fn information_table<'a>() -> Table<InformationRow<'a>> {
    Table::<InformationRow<'a>>::new(
        &["information.csv"],
        "One row per candidate depth and instant of the best exposure, at nominal factors (`design`).",
    )
    .number("depth_m", "m", "Depth below the hot face.", |row| row.1)
    .number("time_s", "s", "Time.", |row| row.0.map.instants_s[row.3])
    .numbers(
        "<factor>_change_k",
        "K",
        "Change of the temperature by one prior standard deviation of the factor.",
        |row| row.0.map.changes_k.iter().map(|by_depth| by_depth[row.2][row.3]).collect(),
    )
}

fn information(outcome: &ExperimentDesign) -> impl Iterator<Item = InformationRow<'_>> {
    let best = &outcome.scenarios[0];
    outcome.map.candidates.iter().enumerate().flat_map(move |(place, &candidate)| {
        let depth_m = best.candidates[candidate].depth_m;
        (0..outcome.map.instants_s.len()).map(move |instant| (outcome, depth_m, place, instant))
    })
}
