//! Layups of a trade study, by the mass that holds a temperature limit with a given probability.

mod figures;
mod record;
mod tables;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, TableDescription};
use super::format::{millimetres, percent, percent_near_limits};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::wrap;
use super::warnings::accuracy_warnings;
use super::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::size::RequiredThickness;
use crate::study::trade::{RESAMPLES, Rank, RankChange, SizedLayup, Trade};

impl Reportable for Trade {
    fn comes_first(&self) -> bool {
        true
    }

    fn uses_observations(&self) -> bool {
        false
    }

    fn facts(&self) -> Vec<String> {
        vec![format::counted(self.layups.len(), "layup"), format!("{} each", format::counted(self.members, "member"))]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let text = [
            ("Lightest", Some(lightest(answers, self))),
            ("No thickness", without_thickness(self)),
            ("Property", nearest_change(self)),
        ];
        text.into_iter().filter_map(|(label, text)| text.map(|text| Finding { label, text })).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        warnings(answers, self)
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::mass_over_probability(answers, self).into_iter().map(|figure| ("trade", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("trade", "Layups", tables::page(answers, self))]
    }

    fn methods(&self, answers: &Answers) -> Vec<String> {
        let exposures = if self.exposures.len() > 1 { " under all exposures" } else { "" };
        let ranks = match self.has_independent_members {
            false => String::new(),
            true => format!(
                " Ranks: {} resamples of the members, the same for all layups (bootstrap, Davison & Hinkley, Bootstrap \
                 Methods and their Application, 1997), so that they have the sampling error alone, not that of the \
                 properties.",
                format::count(RESAMPLES)
            ),
        };
        vec![format!(
            "Layups: each is sized as by `size`, with the same {} (common random numbers): the factors of a member are \
             the same in all layups, at every thickness. Its mass per area is that of all plies at the thickness of {} \
             that holds {}{exposures} in {} of the members, with nominal densities; the other plies keep the \
             thickness of the case.{ranks} Property changes: the derivative of the thickness by a property is exact, \
             by the implicit function theorem at the members next to the quantile (Hong, Operations Research 57, \
             2009), and the masses are extrapolated linearly.",
            format::counted(self.members, "member"),
            self.request.requirement.ply,
            limit_text(answers, self),
            percent_near_limits(self.request.requirement.probability)
        )]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![
            tables::layups_table().description(),
            tables::masses_table().description(),
            tables::changes_table().description(),
        ]
    }

    fn tables(&self, answers: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        tables::files(answers, self)
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("trade", &record::TradeRecord::of(answers, self))
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        on_screen(answers, self)
    }
}

/// `TC4 below 623 K (350 °C)`.
fn limit_text(answers: &Answers, outcome: &Trade) -> String {
    let requirement = &outcome.request.requirement;
    let part = requirement.part.name(&answers.case.layup, &answers.case.sensors);
    format!("{part} below {}", format::kelvin(requirement.limit_k))
}

/// `nextel440_bf20 / pyrogel3350 / akk`.
fn name(outcome: &Trade, layup: &SizedLayup) -> String {
    outcome.materials_of(layup).join(" / ")
}

/// `OF / INS / GB`.
fn choices(outcome: &Trade) -> String {
    outcome.request.choices.iter().map(|(ply, _)| ply.as_str()).collect::<Vec<_>>().join(" / ")
}

/// `1`; `1=` for a rank that several layups have.
fn rank_text(outcome: &Trade, rank: Rank) -> String {
    let is_shared =
        outcome.layups.iter().filter(|other| other.rank.is_some_and(|other| other.rank == rank.rank)).count();
    if is_shared > 1 { format!("{}=", rank.rank) } else { rank.rank.to_string() }
}

/// `1`, `1 to 3`; `–` for members that are not drawn independently.
fn rank_interval(rank: Rank) -> String {
    match rank.resampled.map(|resampled| resampled.interval) {
        None => "–".to_owned(),
        Some((low, high)) if low == high => low.to_string(),
        Some((low, high)) => format!("{low} to {high}"),
    }
}

/// Why masses and ranks have no intervals; `None` where they have.
fn dependence(outcome: &Trade) -> Option<String> {
    let is_dependent = !outcome.has_independent_members;
    is_dependent.then(|| format::dependence(outcome.sampling, "95 % intervals of masses and no 95 % ranks"))
}

/// `12.41 mm`, `2.00 mm or less`, `more than 4.00 mm`.
fn thickness_text(needed: RequiredThickness) -> String {
    match needed {
        RequiredThickness::AtMost(at_m) => format!("{} or less", millimetres(at_m)),
        RequiredThickness::At(at_m) => millimetres(at_m),
        RequiredThickness::Beyond(at_m) => format!("more than {}", millimetres(at_m)),
    }
}

/// `f_k_INS 49 %`: the factor with the largest share in the variance of the thickness.
fn largest_share(answers: &Answers, layup: &SizedLayup) -> String {
    let largest = layup.shares.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, share)| **share > 0.0);
    largest
        .map_or("-".to_owned(), |(factor, share)| format!("{} {}", answers.case.factors[factor].name, percent(*share)))
}

fn areal_mass(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", format::significant(mass_kg_m2, 3))
}

/// Ends of the 95 % confidence interval of the mass, kg/m²; an end is `None` with too few members.
fn mass_interval(layup: &SizedLayup) -> (Option<f64>, Option<f64>) {
    let mass = |needed: RequiredThickness| match needed {
        RequiredThickness::Beyond(_) => None,
        RequiredThickness::AtMost(at_m) | RequiredThickness::At(at_m) => Some(layup.mass_kg_m2(at_m)),
    };
    (layup.interval.0.and_then(mass), layup.interval.1.and_then(mass))
}

/// The layups of the first rank, and the next one.
fn lightest(answers: &Answers, outcome: &Trade) -> String {
    let (requirement, ranked) = (&outcome.request.requirement, outcome.ranked());
    let (limit, probability) = (limit_text(answers, outcome), percent_near_limits(requirement.probability));
    let Some((first, rank)) = ranked.first().and_then(|first| Some((first, first.rank?))) else {
        return format!("No layup holds {limit} in {probability} of the members within the allowed thicknesses.");
    };
    let firsts: Vec<String> = ranked
        .iter()
        .take_while(|layup| layup.rank.is_some_and(|rank| rank.rank == 1))
        .map(|layup| name(outcome, layup))
        .collect();
    let exposures = if outcome.exposures.len() > 1 { " under all exposures" } else { "" };
    let shared = if firsts.len() > 1 { " (equal masses)" } else { "" };
    let next = ranked.get(firsts.len()).map_or(String::new(), |next| {
        let more_kg_m2 = next.required_mass_kg_m2() - first.required_mass_kg_m2();
        format!(
            " Next: {}, {} ({}) more.",
            name(outcome, next),
            areal_mass(more_kg_m2),
            percent_near_limits(more_kg_m2 / first.required_mass_kg_m2())
        )
    });
    let first_share = rank.resampled.map_or(String::new(), |resampled| {
        format!(" First in {} of the resamples.", percent_near_limits(resampled.first_share))
    });
    format!(
        "{}{shared} with {} of {} for {limit} in {probability} of {}{exposures}: {}.{first_share}{next}",
        format::list(&firsts),
        thickness_text(first.required),
        requirement.ply,
        format::counted(outcome.members, "member"),
        areal_mass(first.required_mass_kg_m2())
    )
}

/// The layups that no allowed thickness suffices for.
fn without_thickness(outcome: &Trade) -> Option<String> {
    let unranked = outcome.unranked();
    let first = unranked.first()?;
    let named: Vec<String> = unranked.iter().take(3).map(|layup| name(outcome, layup)).collect();
    let others = unranked.len() - named.len();
    let more = if others > 0 { format!(" and {}", format::counted(others, "other")) } else { String::new() };
    Some(format!(
        "{} cannot hold the limit with up to {} of {} and {} no rank: {}{more}.",
        format::counted(unranked.len(), "layup"),
        millimetres(first.thickness_range_m.1),
        outcome.request.requirement.ply,
        if unranked.len() == 1 { "has" } else { "have" },
        named.join("; ")
    ))
}

/// `a 12 % lower conductivity of pyrogel3350`.
fn change_text(change: &RankChange) -> String {
    let direction = if change.change < 0.0 { "lower" } else { "higher" };
    let size = percent_near_limits(change.change.abs());
    format!("{size} {direction} {} of {}", change.property.label(), change.material)
}

/// The change of a property that is likeliest to change the first place.
fn nearest_change(outcome: &Trade) -> Option<String> {
    let changes = outcome.rank_changes.as_ref()?;
    let Some(change) = changes.first() else {
        return (outcome.ranked().len() > 1).then(|| {
            "By linear extrapolation, no property changes the first place by a change of up to 100 %.".to_owned()
        });
    };
    let deviations = change.deviations().map_or(String::new(), |deviations| {
        format!(" ({} standard deviations of its data)", format::significant(deviations, 2))
    });
    Some(format!(
        "The first place changes with a {}{deviations}: then {} comes first.",
        change_text(change),
        name(outcome, &outcome.layups[change.new_first])
    ))
}

fn warnings(answers: &Answers, outcome: &Trade) -> Vec<String> {
    let mut warnings = Vec::new();
    for layup in &outcome.layups {
        for failure in &layup.failures {
            warnings.push(format!(
                "{}: {} failed at some thickness ({}); they count as exceeding the limit there.",
                name(outcome, layup),
                format::counted(failure.members, "member"),
                failure.reason
            ));
        }
        if let Some(exposure) = layup.not_cooled {
            let (ply, exposure) = (&outcome.request.requirement.ply, &outcome.exposures[exposure]);
            let reason = match &layup.failed_at_largest {
                Some(reason) => {
                    format!("the nominal march failed with the largest thickness of {ply} under {exposure} ({reason})")
                }
                None => {
                    let part = outcome.request.requirement.part.name(&answers.case.layup, &answers.case.sensors);
                    format!("{part} is not cooled by a thicker {ply} under {exposure}")
                }
            };
            warnings.push(format!("{}: {reason}, so that it has no rank.", name(outcome, layup)));
        }
    }
    for layup in &outcome.layups {
        let march = format!("march of {}", name(outcome, layup));
        warnings.extend(accuracy_warnings(layup.error_estimate.as_ref(), &layup.balance, &march));
    }
    let warming = outcome.ranked().iter().filter(|layup| layup.still_warming).count();
    if warming > 0 {
        warnings.push(format!(
            "{} {} at the end of the run, so that true peaks may be higher and thicknesses too small: extend the run \
             (`duration` of the case).",
            format::counted(warming, "layup"),
            if warming == 1 { "peaks" } else { "peak" }
        ));
    }
    let thinnest =
        outcome.ranked().iter().filter(|layup| matches!(layup.required, RequiredThickness::AtMost(_))).count();
    if thinnest > 0 {
        warnings.push(format!(
            "{} {} the limit with the smallest thickness allowed, and may be lighter: widen the thickness range.",
            format::counted(thinnest, "layup"),
            if thinnest == 1 { "holds" } else { "hold" }
        ));
    }
    if let Some(first) = outcome.ranked().first().filter(|first| !first.table_ends.is_empty()) {
        let ends: Vec<String> = first
            .table_ends
            .iter()
            .map(|end| {
                let [end_k, met_k] = [end.end_k, end.met_k].map(|temperature_k| format::grouped(temperature_k, 0));
                format!("{} of {} to {end_k} K ({met_k} K met)", end.property, end.material)
            })
            .collect();
        warnings
            .push(format!("The lightest layup is hotter than tables of its materials reach: {}.", format::list(&ends)));
    }
    let beyond = outcome.layups.iter().filter(|layup| !layup.table_ends.is_empty()).count();
    if beyond > 0 {
        warnings.push(format!(
            "{} with property tables that end below the temperatures met: marked †.",
            format::counted(beyond, "layup")
        ));
    }
    warnings
}

/// Rows of layups on the screen.
const SCREEN_ROWS: usize = 12;
/// Longest name of a layup on the screen.
const SCREEN_NAME: usize = 36;

fn on_screen(answers: &Answers, outcome: &Trade) -> Vec<String> {
    let names = outcome.ranked().iter().map(|layup| tables::marked_name(outcome, layup).chars().count());
    let width = names.chain([choices(outcome).chars().count()]).max().unwrap_or(0).min(SCREEN_NAME);
    let row = |rank: &str, name: &str, numbers: [&str; 4]| {
        let [mass, thickness, margin, interval] = numbers;
        format!(
            "{rank:>4}  {:<width$}  {mass:>5}  {thickness:>8}  {margin:>6}  {interval:>9}",
            format::truncate(name, width)
        )
    };
    let thickness = format!("{}, mm", format::truncate(&outcome.request.requirement.ply, 4));
    let head = row("rank", &choices(outcome), ["kg/m²", &thickness, "margin", "95 % rank"]);
    let mut lines = if outcome.ranked().is_empty() { Vec::new() } else { vec![head] };
    let number = |length_m: f64| millimetres(length_m).replace(" mm", "");
    for (layup, rank) in outcome.ranked().iter().take(SCREEN_ROWS).filter_map(|layup| Some((layup, layup.rank?))) {
        let numbers = [
            &format::significant(layup.required_mass_kg_m2(), 3),
            &number(layup.required.found_m().unwrap_or(layup.thickness_range_m.0)),
            &layup.margin_m().map_or("-".to_owned(), number),
            &rank_interval(rank),
        ];
        let numbers = numbers.map(String::as_str);
        lines.push(row(&rank_text(outcome, rank), &tables::marked_name(outcome, layup), numbers));
    }
    let others = outcome.ranked().len().saturating_sub(SCREEN_ROWS);
    if others > 0 {
        lines.push(format!("      {} more in report.html", format::count(others)));
    }
    let text =
        [Some(lightest(answers, outcome)), without_thickness(outcome), nearest_change(outcome), dependence(outcome)];
    lines.extend(text.into_iter().flatten().flat_map(|text| wrap("", &text)));
    lines
}
