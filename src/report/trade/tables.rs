//! Tables of the page, and table files.

use super::{
    areal_mass, change_text, choices, largest_share, limit_text, mass_interval, name, rank_interval, rank_text,
    thickness_text,
};
use crate::report::files::table::{NamedFile, Names, Table};
use crate::report::format::{millimetres, percent_near_limits};
use crate::report::html::table::{list, table};
use crate::report::{ReportError, format};
use crate::study::answers::Answers;
use crate::study::margins::quantile_rank;
use crate::study::trade::{RESAMPLES, Rank, RankChange, SizedLayup, TableEnd, Trade};

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
        vec![end.material.clone(), end.property.clone(), end_k, met_k, format::count(*layups)]
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
    let names = Names::default();
    let layups = outcome.layups.iter().map(|layup| (answers, outcome, layup));
    let changes = outcome.rank_changes.iter().flatten().map(|change| (outcome, change));
    Ok(vec![
        layups_table().csv(&names, layups)?,
        masses_table().csv(&names, masses(outcome))?,
        changes_table().csv(&names, changes)?,
    ])
}

type LayupRow<'a> = (&'a Answers, &'a Trade, &'a SizedLayup);

pub(super) fn layups_table<'a>() -> Table<LayupRow<'a>> {
    fn rank((.., layup): &LayupRow<'_>, value: fn(Rank) -> f64) -> f64 {
        layup.rank.map_or(f64::NAN, value)
    }
    fn largest(layup: &SizedLayup) -> Option<(usize, f64)> {
        layup.shares.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
    }
    Table::<LayupRow<'a>>::new(
        &["layups.csv"],
        "One row per layup (`trade`): those with a rank, by mass, and then the others, whose columns are empty where \
         no \
         allowed thickness suffices.",
    )
    .number("rank", "–", "Rank from 1; equal masses share one.", |row| rank(row, |rank| rank.rank as f64))
    .text("layup", "Ids of the materials of the choices.", |row| row.1.materials_of(row.2).join(" "))
    .number("mass_kg_m2", "kg/m²", "Mass per area of all plies.", |row| {
        row.2.rank.map_or(f64::NAN, |_| row.2.required_mass_kg_m2())
    })
    .numbers("mass_{low,high}_kg_m2", "kg/m²", "Its interval.", |row| {
        let (low, high) = mass_interval(row.2);
        [low, high].map(|end| end.unwrap_or(f64::NAN)).to_vec()
    })
    .number("thickness_m", "m", "Required thickness.", |row| row.2.required.found_m().unwrap_or(f64::NAN))
    .number("nominal_thickness_m", "m", "The same at nominal factors.", |row| {
        row.2.nominal_required().found_m().unwrap_or(f64::NAN)
    })
    .number("margin_m", "m", "Their difference.", |row| row.2.margin_m().unwrap_or(f64::NAN))
    .number("share_within_limit_as_drawn", "–", "Members below the limit at the thickness in the case file.", |row| {
        row.2.below_limit(row.2.case_thickness_m).fraction()
    })
    .text("largest_share_factor", "Factor with the largest share in the variance of the thickness.", |row| {
        largest(row.2).map_or(String::new(), |(factor, _)| row.0.case.factors[factor].name.clone())
    })
    .number("largest_share", "–", "Its share.", |row| largest(row.2).map_or(f64::NAN, |(_, share)| share))
    .number("rank_low", "–", "Lowest rank in the central 95 % of the resamples.", |row| {
        rank(row, |rank| rank.resampled.map_or(f64::NAN, |resampled| resampled.interval.0 as f64))
    })
    .number("rank_high", "–", "The highest.", |row| {
        rank(row, |rank| rank.resampled.map_or(f64::NAN, |resampled| resampled.interval.1 as f64))
    })
    .number("first_share", "–", "Share of the resamples in which no layup is lighter.", |row| {
        rank(row, |rank| rank.resampled.map_or(f64::NAN, |resampled| resampled.first_share))
    })
    .text("governing_exposure", "Exposure that requires most at nominal factors.", |row| {
        row.1.exposures[row.2.governing_exposure()].clone()
    })
}

/// Materials, probability and mass.
type MassRow = (String, f64, f64);

pub(super) fn masses_table() -> Table<MassRow> {
    Table::<MassRow>::new(&["masses.csv"], "Mass of each layup over the probability that the limit holds (`trade`).")
        .text("layup", "Ids of the materials of the choices.", |row| row.0.clone())
        .number("probability", "–", "Share of the members below the limit.", |row| row.1)
        .number("mass_kg_m2", "kg/m²", "Mass per area of all plies.", |row| row.2)
}

fn masses(outcome: &Trade) -> Vec<MassRow> {
    let probabilities = probabilities(outcome.members);
    let of = |layup: &SizedLayup| -> Vec<MassRow> {
        let materials = outcome.materials_of(layup).join(" ");
        let masses = probabilities.iter().copied().zip(masses_kg_m2(layup, &probabilities));
        let masses = masses.filter(|(_, mass)| mass.is_finite());
        masses.map(|(probability, mass)| (materials.clone(), probability, mass)).collect()
    };
    outcome.layups.iter().flat_map(of).collect()
}

type ChangeRow<'a> = (&'a Trade, &'a RankChange);

pub(super) fn changes_table<'a>() -> Table<ChangeRow<'a>> {
    Table::<ChangeRow<'a>>::new(
        &["rank-changes.csv"],
        "How far a property would have to change for another layup to come first (`trade`), the fewest standard \
         deviations first. Linear in the property, and at most 100 %.",
    )
    .text("material", "The material with the property, in all layups.", |row| row.1.material.clone())
    .text("property", "The property.", |row| row.1.property.key().to_owned())
    .text("surrogate", "Whether the material is a surrogate.", |row| row.1.is_surrogate.to_string())
    .text("mark", "Mark of the data of the property.", |row| row.1.source_kind.key().to_owned())
    .number("relative_uncertainty", "–", "Stated relative standard deviation.", |row| {
        row.1.relative_uncertainty.unwrap_or(f64::NAN)
    })
    .number("change", "–", "Relative change of the property.", |row| row.1.change)
    .number("deviations", "–", "The change in standard deviations.", |row| row.1.deviations().unwrap_or(f64::NAN))
    .text("new_first", "Materials of the layup that then comes first.", |row| {
        row.0.materials_of(&row.0.layups[row.1.new_first]).join(" ")
    })
}
