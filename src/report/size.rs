//! The thickness of a ply that keeps a temperature limit with a given probability.

mod figures;
mod record;

use super::answer::{Answer, Finding, Room, Section};
use super::figure::Figure;
use super::files::json::Record;
use super::files::table::File;
use super::files::table::Table;
use super::html::table::{list, table};
use super::summary::wrapped;
use super::words::{millimetres, percent_of};
use super::{ReportError, words};
use crate::study::answers::Answers;
use crate::study::proportion::{Proportion, draws_to_a_tenth};
use crate::study::size::{Needed, Sizing};

impl Answer for Sizing {
    fn leads(&self) -> bool {
        true
    }

    fn uses_observations(&self) -> bool {
        false
    }

    fn facts(&self) -> Vec<String> {
        vec![words::counted(self.members, "member")]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let text = [
            ("Thickness", Some(found(answers, self))),
            ("Variance shares", cause(answers, self)),
            ("Check", checked(self)),
        ];
        text.into_iter().filter_map(|(about, text)| text.map(|text| Finding { about, said: text })).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        doubts(answers, self)
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(answers, self).into_iter().map(|figure| ("size", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("size", "Thickness", page(answers, self))]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![peaks_by_thickness(self)?, required_thickness(self)?])
    }

    fn record(&self, answers: &Answers, record: &mut Record<'_>) -> Result<(), ReportError> {
        record.put("sizing", &record::SizingRecord::of(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, _: &Room) -> Vec<String> {
        on_screen(answers, self)
    }
}

/// `TC4 below 623 K (350 °C)`.
fn limit(answers: &Answers, outcome: &Sizing) -> String {
    format!("{} below {}", answers.case.sensors[outcome.demand.sensor].name, words::kelvin(outcome.demand.limit_k))
}

/// `12.41 mm`, `2.00 mm or less`, `more than 4.00 mm`.
fn thickness(needed: Needed) -> String {
    match needed {
        Needed::AtMost(at_m) => format!("{} or less", millimetres(at_m)),
        Needed::At(at_m) => millimetres(at_m),
        Needed::Beyond(at_m) => format!("more than {}", millimetres(at_m)),
    }
}

fn areal(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", words::significant(mass_kg_m2, 3))
}

/// 95 % confidence interval of the required thickness.
fn interval(outcome: &Sizing) -> String {
    match outcome.interval {
        (Some(low), Some(high)) if low == high => thickness(low),
        (Some(low), Some(high)) => format!("{} to {}", thickness(low).replace(" mm", ""), thickness(high)),
        _ => "unknown (too few members)".to_owned(),
    }
}

/// The finding: nominal thickness, thickness for the probability, and the margin between them.
fn found(answers: &Answers, outcome: &Sizing) -> String {
    let ply = &outcome.demand.ply;
    let probability = percent_of(outcome.demand.probability);
    let (low_m, high_m) = outcome.within_m;
    let limit = limit(answers, outcome);
    let nominal = match outcome.nominal {
        Needed::At(at_m) => format!("{ply} thickness for {limit}: {} nominally", millimetres(at_m)),
        Needed::AtMost(_) => format!("{ply} thickness for {limit}: at most {} nominally", millimetres(low_m)),
        Needed::Beyond(_) => {
            let peak_k = outcome.rungs.last().map_or(f64::NAN, |rung| rung.nominal.temperature_k);
            let reached = words::kelvin(peak_k);
            format!("{ply} thickness for {limit}: more than {} nominally (peak {reached} there)", millimetres(high_m))
        }
    };
    let uncertain = match outcome.needed {
        Needed::At(at_m) => {
            format!("{} for {probability} of {}", millimetres(at_m), words::counted(outcome.members, "member"))
        }
        Needed::AtMost(_) => {
            format!("at most {} for {probability} of {}", millimetres(low_m), words::counted(outcome.members, "member"))
        }
        Needed::Beyond(_) => format!(
            "more than {} for {probability} of {} ({} are within the limit there)",
            millimetres(high_m),
            words::counted(outcome.members, "member"),
            words::proportion(outcome.held(high_m))
        ),
    };
    let margin = outcome.margin_m().map_or(String::new(), |margin_m| {
        format!(
            " Margin for uncertainty: {} ({} of the nominal thickness), {}.",
            millimetres(margin_m),
            words::percent(margin_m / outcome.nominal.found_m().unwrap_or(f64::NAN)),
            areal(outcome.mass_kg_m2(margin_m))
        )
    });
    format!("{nominal}, {uncertain}.{margin}")
}

/// The factors with the largest shares in the variance of the required thickness.
fn cause(answers: &Answers, outcome: &Sizing) -> Option<String> {
    let mut order: Vec<usize> = (0..outcome.shares.len()).filter(|&factor| outcome.shares[factor] >= 0.05).collect();
    order.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let named: Vec<String> = order
        .iter()
        .take(3)
        .map(|&factor| format!("{} {}", answers.case.factors[factor].name, words::percent(outcome.shares[factor])))
        .collect();
    (!named.is_empty()).then(|| format!("Largest variance shares of required thickness: {}.", words::listed(&named)))
}

/// Shares of members within the limit at the stated and at the nominally sufficient thickness.
fn drawn(outcome: &Sizing) -> String {
    let nominal = outcome.nominal.found_m().map_or(String::new(), |at_m| {
        format!(", at the nominally sufficient thickness {}", words::proportion(outcome.held(at_m)))
    });
    format!(
        "Members within the limit: at the stated thickness of {} {}{nominal}.",
        millimetres(outcome.drawn_m),
        words::proportion(outcome.held(outcome.drawn_m))
    )
}

/// The check with independent members.
fn checked(outcome: &Sizing) -> Option<String> {
    let check = outcome.check.as_ref()?;
    let (low, high) = outcome.expected_95()?;
    let verdict = if outcome.is_borne_out()? { "within" } else { "OUTSIDE" };
    let percent = |counted: Proportion| words::trimmed(words::grouped(100.0 * counted.share(), 1));
    Some(format!(
        "Check at {} with {} of another seed ({}) and a new plan: {} within the limit, {verdict} the 95 % range of {} \
         to {} % expected for {} and a probability of {}.",
        thickness(outcome.needed),
        words::counted(check.held.of, "member"),
        check.seed,
        words::proportion(check.held),
        percent(low),
        percent(high),
        words::counted(outcome.members, "member"),
        percent_of(outcome.demand.probability)
    ))
}

/// Confidence interval of the thickness, and the number of members that the probability requires.
fn enough(outcome: &Sizing) -> String {
    let p = outcome.demand.probability;
    let wanted = draws_to_a_tenth(p);
    let verdict = if outcome.members >= wanted { "available" } else { "fewer are available" };
    let confidence = outcome.needed.found_m().map_or(String::new(), |_| {
        format!("95 % confidence interval of the thickness for {}: {}. ", percent_of(p), interval(outcome))
    });
    format!(
        "{confidence}A standard error of a tenth of the exceedance probability {} requires {} ({verdict}).",
        percent_of(1.0 - p),
        words::counted(wanted, "member")
    )
}

/// Warnings.
fn doubts(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let mut warnings = Vec::new();
    let sensor = &answers.case.sensors[outcome.demand.sensor].name;
    for failure in &outcome.failures {
        warnings.push(format!(
            "{} of {} failed at some thickness ({}), first member {}; they count as exceeding the limit there.",
            words::count(failure.members),
            words::counted(outcome.members, "member"),
            failure.reason,
            words::count(failure.first)
        ));
    }
    if outcome.still_warming {
        let consequence = match outcome.needed {
            Needed::At(at_m) => format!("{} may be too thin", millimetres(at_m)),
            Needed::AtMost(at_m) => format!("{} may be too thin", millimetres(at_m)),
            Needed::Beyond(at_m) => format!("no thickness up to {} suffices even so", millimetres(at_m)),
        };
        warnings.push(format!(
            "{sensor} peaks at the end of the run ({}), so the true peak may be higher: {consequence}. Extend the run \
             (--set duration=...).",
            words::seconds(answers.case.exposure.duration_s)
        ));
    }
    let rises = |pair: &[crate::study::size::Rung]| pair[1].nominal.temperature_k > pair[0].nominal.temperature_k + 1.0;
    if let Some(pair) = outcome.rungs.windows(2).find(|pair| rises(pair)) {
        warnings.push(format!(
            "From {} to {} the nominal peak of {sensor} rises with thickness: the solution may not be unique.",
            millimetres(pair[0].thickness_m),
            millimetres(pair[1].thickness_m)
        ));
    }
    if outcome.is_borne_out() == Some(false) {
        warnings.push(format!(
            "The check does not confirm {}: the difference exceeds the sampling error of thickness and check.",
            percent_of(outcome.demand.probability)
        ));
    }
    warnings
}

fn page(answers: &Answers, outcome: &Sizing) -> String {
    let mass = |thickness_m: Option<f64>| {
        thickness_m.map_or("–".to_owned(), |at_m| words::significant(outcome.mass_kg_m2(at_m), 3))
    };
    let percent = |counted| words::proportion(counted).replace(" %", "");
    let probability = percent_of(outcome.demand.probability);
    let mut rows = vec![
        vec![
            "stated".to_owned(),
            millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            percent(outcome.held(outcome.drawn_m)),
        ],
        vec![
            "nominal".to_owned(),
            thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            outcome.nominal.found_m().map(|at_m| outcome.held(at_m)).map_or("–".to_owned(), percent),
        ],
        vec![
            format!("for {probability} of members"),
            thickness(outcome.needed),
            mass(outcome.needed.found_m()),
            percent_of(outcome.demand.probability).replace(" %", ""),
        ],
    ];
    if let Some(margin_m) = outcome.margin_m() {
        rows.push(vec!["margin".to_owned(), millimetres(margin_m), mass(Some(margin_m)), String::new()]);
    }
    let checks: Vec<Vec<String>> = outcome
        .check
        .iter()
        .map(|check| {
            vec![
                words::counted(check.held.of, "member"),
                check.seed.to_string(),
                words::count(check.held.count),
                words::count(check.failed),
                percent(check.held),
                words::grouped(check.nominal_k, 1),
                format!(
                    "{} to {}",
                    words::grouped(check.percentiles_k[0], 0),
                    words::grouped(check.percentiles_k[2], 0)
                ),
            ]
        })
        .collect();
    let mut text = vec![found(answers, outcome), enough(outcome), drawn(outcome)];
    text.extend(cause(answers, outcome));
    text.extend(checked(outcome));
    text.push(format!(
        "The factors of a member are the same at every thickness; its required thickness is the root of peak less \
         limit. {} were marched.",
        words::counted(outcome.marches, "member")
    ));
    let title = format!("Thickness of {} for {}", outcome.demand.ply, limit(answers, outcome));
    let checked =
        ["Check", "Seed", "Within the limit", "Failed", "Within the limit, %", "Nominal peak, K", "95 % interval, K"];
    list(&text)
        + &table(&title, &["", "Thickness", "Mass, kg/m²", "Members within the limit, %"], &rows)
        + &table("Check with independent members at that thickness", &checked, &checks)
}

fn on_screen(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let probability = percent_of(outcome.demand.probability);
    let percent = |counted: Option<Proportion>| counted.map_or("-".to_owned(), words::proportion);
    let mass = |at_m: Option<f64>| at_m.map_or("-".to_owned(), |at_m| areal(outcome.mass_kg_m2(at_m)));
    let row = |of: &str, thickness: String, mass: String, share: String| {
        format!("{of:<20}{thickness:>17}{mass:>13}  {share}")
    };
    let title = format!("{} for {}", outcome.demand.ply, limit(answers, outcome));
    let mut lines = vec![
        title,
        row("", "thickness".into(), "mass".into(), "members within limit".into()),
        row(
            "stated",
            millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            percent(Some(outcome.held(outcome.drawn_m))),
        ),
        row(
            "nominal",
            thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            percent(outcome.nominal.found_m().map(|at_m| outcome.held(at_m))),
        ),
        row(
            &format!("{probability} of members"),
            thickness(outcome.needed),
            mass(outcome.needed.found_m()),
            percent(outcome.check.as_ref().map(|check| check.held)),
        ),
    ];
    if let Some(margin_m) = outcome.margin_m() {
        lines.push(row("margin", millimetres(margin_m), mass(Some(margin_m)), String::new()));
    }
    let text = [Some(found(answers, outcome)), Some(enough(outcome)), cause(answers, outcome)];
    let text = text.into_iter().chain([checked(outcome)]).flatten();
    lines.extend(text.flat_map(|text| wrapped("", &text)));
    lines
}

fn peaks_by_thickness(outcome: &Sizing) -> Result<File, ReportError> {
    let mut table =
        Table::new("sizing.csv", ["thickness_m", "nominal_K", "p2.5_K", "p50_K", "p97.5_K", "share_within_limit"])?;
    for rung in &outcome.rungs {
        let share = outcome.held(rung.thickness_m).share();
        let peaks = [rung.thickness_m, rung.nominal.temperature_k].into_iter().chain(rung.percentiles_k);
        table.row(None, peaks.chain([share]))?;
    }
    table.close()
}

fn required_thickness(outcome: &Sizing) -> Result<File, ReportError> {
    let mut table = Table::new("required-thickness.csv", ["thickness_m", "cumulative_share"])?;
    for (place, &needed_m) in outcome.each_m.iter().enumerate() {
        table.row(None, [needed_m, (place + 1) as f64 / outcome.members as f64])?;
    }
    table.close()
}
