//! Tables of the page, and table files.

use super::{
    areal_mass, change_text, choices, largest_share, limit_text, mass_interval, name, rank_interval, rank_text,
    thickness_text,
};
use crate::report::files::table::{CsvTable, NamedFile, cell};
use crate::report::format::{millimetres, percent_near_limits};
use crate::report::html::table::{list, table};
use crate::report::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::margins::quantile_rank;
use crate::study::trade::{RESAMPLES, RankChange, SizedLayup, TableEnd, Trade};

/// The name, with a mark if a property table ends below the temperatures met.
pub(super) fn marked_name(outcome: &Trade, layup: &SizedLayup) -> String {
    let mark = if layup.table_ends.is_empty() { "" } else { " †" };
    name(outcome, layup) + mark
}

pub(super) fn page(answers: &Answers, outcome: &Trade) -> String {
    let mut text = vec![super::lightest(answers, outcome)];
    text.extend(super::without_thickness(outcome));
    text.extend(super::nearest_change(outcome));
    let ranks = super::dependence(outcome).unwrap_or_else(|| {
        format!(
            "95 % rank and share of first places: of {} resamples of the members, the same for all layups.",
            format::count(RESAMPLES)
        )
    });
    text.push(format!(
        "{ranks} As drawn: members within the limit with {} of {}. Largest share: of a factor in the variance of the \
         thickness.",
        outcome.layups.first().map_or(String::new(), |layup| millimetres(layup.case_thickness_m)),
        outcome.request.requirement.ply
    ));
    list(&text) + &ranked(answers, outcome) + &unranked(answers, outcome) + &changes(outcome) + &table_ends(outcome)
}

fn ranked(answers: &Answers, outcome: &Trade) -> String {
    let several = outcome.exposures.len() > 1;
    let (layup_head, ply) = (choices(outcome), &outcome.request.requirement.ply);
    let thickness = format!("Thickness of {ply}");
    let mut head = vec![
        "Rank",
        &layup_head,
        "Mass, kg/m²",
        "95 % interval, kg/m²",
        &thickness,
        "Nominal",
        "Margin",
        "As drawn, %",
        "Largest share",
        "95 % rank",
        "First, %",
    ];
    if several {
        head.push("Governed by");
    }
    let row = |layup: &SizedLayup| {
        let rank = layup.rank?;
        let (low, high) = mass_interval(layup);
        let end = |end: Option<f64>| end.map_or("unknown".to_owned(), |mass| format::significant(mass, 3));
        let drawn = layup.below_limit(layup.case_thickness_m);
        let mut row = vec![
            rank_text(outcome, rank),
            marked_name(outcome, layup),
            format::significant(layup.required_mass_kg_m2(), 3),
            if outcome.has_independent_members { format!("{} to {}", end(low), end(high)) } else { "–".to_owned() },
            thickness_text(layup.required),
            thickness_text(layup.nominal_required()),
            layup.margin_m().map_or("–".to_owned(), millimetres),
            percent_near_limits(drawn.fraction()).replace(" %", ""),
            largest_share(answers, layup),
            rank_interval(rank),
            rank.resampled
                .map_or("–".to_owned(), |resampled| percent_near_limits(resampled.first_share).replace(" %", "")),
        ];
        if several {
            row.push(outcome.exposures[layup.governing_exposure()].clone());
        }
        Some(row)
    };
    let rows: Vec<Vec<String>> = outcome.ranked().iter().filter_map(row).collect();
    let probability = percent_near_limits(outcome.request.requirement.probability);
    table(&format!("Layups by the mass for {} in {probability}", limit_text(answers, outcome)), &head, &rows)
}

fn unranked(answers: &Answers, outcome: &Trade) -> String {
    let row = |layup: &SizedLayup| {
        let thickest_m = layup.thickness_range_m.1;
        vec![
            marked_name(outcome, layup),
            millimetres(thickest_m),
            areal_mass(layup.mass_kg_m2(thickest_m)).replace(" kg/m²", ""),
            format::proportion_of_members(layup.below_limit(thickest_m), outcome.has_independent_members)
                .replace(" %", ""),
            format::grouped(layup.thickest_peak_k, 0),
            largest_share(answers, layup),
        ]
    };
    let head = [
        &choices(outcome),
        "Largest thickness",
        "Mass there, kg/m²",
        "Members within the limit there, %",
        "Nominal peak there, K",
        "Largest share of the variance",
    ];
    let rows: Vec<Vec<String>> = outcome.unranked().iter().map(row).collect();
    table("Layups that no allowed thickness suffices for", &head, &rows)
}

fn changes(outcome: &Trade) -> String {
    let row = |change: &RankChange| {
        vec![
            format!("{} of {}", change.property.label(), change.material),
            if change.is_surrogate { "surrogate".to_owned() } else { "–".to_owned() },
            change.source_kind.key().to_owned(),
            change.relative_uncertainty.map_or("–".to_owned(), |share| format!("± {}", percent_near_limits(share))),
            format!("{} %", format::signed(100.0 * change.change, 1)),
            change.deviations().map_or("–".to_owned(), |deviations| format::significant(deviations, 2)),
            name(outcome, &outcome.layups[change.new_first]),
        ]
    };
    let head = [
        "Property",
        "Material",
        "Mark",
        "Stated standard deviation",
        "Change for another first place",
        "In standard deviations",
        "Then first",
    ];
    let rows: Vec<Vec<String>> = outcome.rank_changes.iter().flatten().map(row).collect();
    let text = match &outcome.rank_changes {
        None => "The backend has no derivatives, so that no change of a property is known: use the CPU.".to_owned(),
        Some(changes) => format!(
            "{} by which another layup comes first with a change of up to 100 %, of the same material in all layups \
             at once. Exact derivatives, extrapolated linearly: a change of tens of per cent is an indication.{}",
            format::counted_irregular(changes.len(), "property", "properties"),
            changes.first().map_or(String::new(), |first| format!(" Nearest: {}.", change_text(first)))
        ),
    };
    if outcome.ranked().len() < 2 {
        return String::new();
    }
    table("What the first place hangs on", &head, &rows) + &list(&[text])
}

fn table_ends(outcome: &Trade) -> String {
    // The hottest of each property, and the number of layups.
    let mut ends: Vec<(TableEnd, usize)> = Vec::new();
    for end in outcome.layups.iter().flat_map(|layup| &layup.table_ends) {
        match ends.iter_mut().find(|(known, _)| known.material == end.material && known.property == end.property) {
            Some((known, layups)) => (known.met_k, *layups) = (known.met_k.max(end.met_k), *layups + 1),
            None => ends.push((end.clone(), 1)),
        }
    }
    let row = |(end, layups): &(TableEnd, usize)| {
        let [end_k, met_k] = [end.end_k, end.met_k].map(|temperature_k| format::grouped(temperature_k, 0));
        vec![end.material.clone(), end.property.to_owned(), end_k, met_k, format::count(*layups)]
    };
    let rows: Vec<Vec<String>> = ends.iter().map(row).collect();
    let head = ["Material", "Property", "Table ends at, K", "Hottest, K", "Layups"];
    table("† Tables that end below the temperatures met, at nominal factors", &head, &rows)
}

/// Probabilities of the masses in the file and in the chart: 50 % to that of the last member but one.
pub(super) fn probabilities(members: usize) -> Vec<f64> {
    const POINTS: usize = 40;
    let last = (2.0 / members as f64).min(0.5);
    (0..POINTS).map(|point| 1.0 - 0.5 * (2.0 * last).powf(point as f64 / (POINTS - 1) as f64)).collect()
}

/// Mass that holds the limit with each of some probabilities, kg/m²; infinite where no thickness suffices.
pub(super) fn masses_kg_m2(layup: &SizedLayup, probabilities: &[f64]) -> Vec<f64> {
    let mut needed_m = layup.member_thicknesses_m.clone();
    needed_m.sort_by(f64::total_cmp);
    let mass = |&probability: &f64| layup.mass_kg_m2(needed_m[quantile_rank(needed_m.len(), probability) - 1]);
    probabilities.iter().map(mass).collect()
}

pub(super) fn files(answers: &Answers, outcome: &Trade) -> Result<Vec<NamedFile>, ReportError> {
    Ok(vec![layups_file(answers, outcome)?, masses_file(outcome)?, changes_file(outcome)?])
}

fn layups_file(answers: &Answers, outcome: &Trade) -> Result<NamedFile, ReportError> {
    let mut file = CsvTable::new(
        "layups.csv",
        [
            "rank",
            "layup",
            "mass_kg_m2",
            "mass_low_kg_m2",
            "mass_high_kg_m2",
            "thickness_m",
            "nominal_thickness_m",
            "margin_m",
            "share_within_limit_as_drawn",
            "largest_share_factor",
            "largest_share",
            "rank_low",
            "rank_high",
            "first_share",
            "governing_exposure",
        ],
    )?;
    let optional = |value: Option<f64>| value.map_or(String::new(), cell);
    for layup in &outcome.layups {
        let (low, high) = mass_interval(layup);
        let largest = layup.shares.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let resampled = layup.rank.and_then(|rank| rank.resampled);
        let end = |of: fn((usize, usize)) -> usize| {
            resampled.map_or(String::new(), |resampled| of(resampled.interval).to_string())
        };
        file.text_row(vec![
            layup.rank.map_or(String::new(), |rank| rank.rank.to_string()),
            outcome.materials_of(layup).join(" "),
            optional(layup.rank.map(|_| layup.required_mass_kg_m2())),
            optional(low),
            optional(high),
            optional(layup.required.found_m()),
            optional(layup.nominal_required().found_m()),
            optional(layup.margin_m()),
            cell(layup.below_limit(layup.case_thickness_m).fraction()),
            largest.map_or(String::new(), |(factor, _)| answers.case.factors[factor].name.clone()),
            optional(largest.map(|(_, share)| *share)),
            end(|interval| interval.0),
            end(|interval| interval.1),
            optional(resampled.map(|resampled| resampled.first_share)),
            outcome.exposures[layup.governing_exposure()].clone(),
        ])?;
    }
    file.finish()
}

fn masses_file(outcome: &Trade) -> Result<NamedFile, ReportError> {
    let mut file = CsvTable::new("masses.csv", ["layup", "probability", "mass_kg_m2"])?;
    let probabilities = probabilities(outcome.members);
    for layup in &outcome.layups {
        let materials = outcome.materials_of(layup).join(" ");
        let masses = masses_kg_m2(layup, &probabilities);
        for (&probability, &mass) in probabilities.iter().zip(&masses).filter(|(_, mass)| mass.is_finite()) {
            file.text_row(vec![materials.clone(), cell(probability), cell(mass)])?;
        }
    }
    file.finish()
}

fn changes_file(outcome: &Trade) -> Result<NamedFile, ReportError> {
    let head =
        ["material", "property", "surrogate", "mark", "relative_uncertainty", "change", "deviations", "new_first"];
    let mut file = CsvTable::new("rank-changes.csv", head)?;
    for change in outcome.rank_changes.iter().flatten() {
        file.text_row(vec![
            change.material.clone(),
            change.property.key().to_owned(),
            change.is_surrogate.to_string(),
            change.source_kind.key().to_owned(),
            change.relative_uncertainty.map_or(String::new(), cell),
            cell(change.change),
            change.deviations().map_or(String::new(), cell),
            outcome.materials_of(&outcome.layups[change.new_first]).join(" "),
        ])?;
    }
    file.finish()
}
