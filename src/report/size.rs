//! The thickness of a ply that keeps a temperature limit with a given probability.

mod figures;
mod record;

use super::figure::Figure;
use super::files::json::JsonObject;
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::format::{millimetres, percent_near_limits};
use super::html::table::{list, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::{Column, aligned, wrap};
use super::warnings::accuracy_warnings;
use super::{ReportError, format};
use crate::fit::proportion::{Proportion, draws_for_ten_percent_error};
use crate::study::answers::Answers;
use crate::study::size::{PeakCurvePoint, RequiredThickness, Sizing};

impl Reportable for Sizing {
    fn comes_first(&self) -> bool {
        true
    }

    fn uses_observations(&self) -> bool {
        false
    }

    fn facts(&self) -> Vec<String> {
        vec![format::counted(self.members, "member")]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let text = [
            ("Thickness", Some(finding(answers, self))),
            ("Variance shares", variance_shares(answers, self)),
            ("Check", check_result(self)),
        ];
        text.into_iter().filter_map(|(about, text)| text.map(|text| Finding { label: about, text })).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        size_warnings(answers, self)
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        figures::figures(answers, self).into_iter().map(|figure| ("size", figure)).collect()
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        vec![Section::new("size", "Thickness", page(answers, self))]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![peaks_table().description(), members_table().description()]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        let names = Names::default();
        let curve = self.peak_curve.iter().map(|point| (self, point));
        let members = self.member_thicknesses_m.iter().enumerate().map(|(place, &needed_m)| (self, place, needed_m));
        Ok(vec![peaks_table().csv(&names, curve)?, members_table().csv(&names, members)?])
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("sizing", &record::SizingRecord::of(&answers.case, self))
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        on_screen(answers, self)
    }
}

/// The name of the part whose peak is limited.
fn limited_part(answers: &Answers, outcome: &Sizing) -> String {
    outcome.requirement.part.name(&answers.case.layup, &answers.case.sensors)
}

/// `TC4 below 623 K (350 °C)`.
fn limit_text(answers: &Answers, outcome: &Sizing) -> String {
    format!("{} below {}", limited_part(answers, outcome), format::kelvin(outcome.requirement.limit_k))
}

/// `12.41 mm`, `2.00 mm or less`, `more than 4.00 mm`.
fn thickness_text(needed: RequiredThickness) -> String {
    match needed {
        RequiredThickness::AtMost(at_m) => format!("{} or less", millimetres(at_m)),
        RequiredThickness::At(at_m) => millimetres(at_m),
        RequiredThickness::Beyond(at_m) => format!("more than {}", millimetres(at_m)),
    }
}

fn areal_mass_text(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", format::significant(mass_kg_m2, 3))
}

/// 95 % confidence interval of the required thickness.
fn confidence_interval(outcome: &Sizing) -> String {
    match outcome.interval {
        (Some(low), Some(high)) if low == high => thickness_text(low),
        (Some(low), Some(high)) => format!("{} to {}", thickness_text(low).replace(" mm", ""), thickness_text(high)),
        _ => "unknown (too few members)".to_owned(),
    }
}

/// The finding: nominal thickness, thickness for the probability, and the margin between them.
fn finding(answers: &Answers, outcome: &Sizing) -> String {
    let ply = &outcome.requirement.ply;
    let probability = percent_near_limits(outcome.requirement.probability);
    let (low_m, high_m) = outcome.thickness_range_m;
    let limit = limit_text(answers, outcome);
    let nominal = match outcome.nominal {
        RequiredThickness::At(at_m) => format!("{ply} thickness for {limit}: {} nominally", millimetres(at_m)),
        RequiredThickness::AtMost(_) => {
            format!("{ply} thickness for {limit}: at most {} nominally", millimetres(low_m))
        }
        RequiredThickness::Beyond(_) => {
            let peak_k = outcome.peak_curve.last().map_or(f64::NAN, |rung| rung.nominal.temperature_k);
            let reached = format::kelvin(peak_k);
            format!("{ply} thickness for {limit}: more than {} nominally (peak {reached} there)", millimetres(high_m))
        }
    };
    let uncertain = match outcome.required {
        RequiredThickness::At(at_m) => {
            format!("{} for {probability} of {}", millimetres(at_m), format::counted(outcome.members, "member"))
        }
        RequiredThickness::AtMost(_) => {
            format!(
                "at most {} for {probability} of {}",
                millimetres(low_m),
                format::counted(outcome.members, "member")
            )
        }
        RequiredThickness::Beyond(_) => format!(
            "more than {} for {probability} of {} ({} are within the limit there)",
            millimetres(high_m),
            format::counted(outcome.members, "member"),
            share(outcome, high_m)
        ),
    };
    let margin = outcome.margin_m().map_or(String::new(), |margin_m| {
        format!(
            " Margin for uncertainty: {} ({} of the nominal thickness), {}.",
            millimetres(margin_m),
            format::percent(margin_m / outcome.nominal.found_m().unwrap_or(f64::NAN)),
            areal_mass_text(outcome.mass_kg_m2(margin_m))
        )
    });
    format!("{nominal}, {uncertain}.{margin}")
}

/// The factors with the largest shares in the variance of the required thickness.
fn variance_shares(answers: &Answers, outcome: &Sizing) -> Option<String> {
    let mut order: Vec<usize> = (0..outcome.shares.len()).filter(|&factor| outcome.shares[factor] >= 0.05).collect();
    order.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let named: Vec<String> = order
        .iter()
        .take(3)
        .map(|&factor| format!("{} {}", answers.case.factors[factor].name, format::percent(outcome.shares[factor])))
        .collect();
    (!named.is_empty()).then(|| format!("Largest variance shares of required thickness: {}.", format::list(&named)))
}

/// Share of the members within the limit at a thickness.
fn share(outcome: &Sizing, thickness_m: f64) -> String {
    format::proportion_of_members(outcome.below_limit(thickness_m), outcome.has_independent_members)
}

/// Shares of members within the limit at the stated and at the nominally sufficient thickness.
fn stated_thickness(outcome: &Sizing) -> String {
    let nominal = outcome
        .nominal
        .found_m()
        .map_or(String::new(), |at_m| format!(", at the nominally sufficient thickness {}", share(outcome, at_m)));
    format!(
        "Members within the limit: at the stated thickness of {} {}{nominal}.",
        millimetres(outcome.case_thickness_m),
        share(outcome, outcome.case_thickness_m)
    )
}

/// The check with independent members.
fn check_result(outcome: &Sizing) -> Option<String> {
    let check = outcome.check.as_ref()?;
    let percent = |counted: Proportion| format::trim_zeros(format::grouped(100.0 * counted.fraction(), 1));
    let expected =
        outcome.expected_count_95().zip(outcome.is_confirmed()).map_or(String::new(), |(range, is_within)| {
            format!(
                ", {} the 95 % range of {} to {} % expected for {} and a probability of {}",
                if is_within { "within" } else { "OUTSIDE" },
                percent(range.0),
                percent(range.1),
                format::counted(outcome.members, "member"),
                percent_near_limits(outcome.requirement.probability)
            )
        });
    Some(format!(
        "Check at {} with {} of another seed ({}) and a new plan: {} within the limit{expected}.",
        thickness_text(outcome.required),
        format::counted(check.below_limit.total, "member"),
        check.seed,
        format::proportion(check.below_limit)
    ))
}

/// Confidence interval of the thickness, and the number of members that the probability requires.
fn required_members(outcome: &Sizing) -> String {
    let p = outcome.requirement.probability;
    let requested = draws_for_ten_percent_error(p);
    let verdict = if outcome.members >= requested { "available" } else { "fewer are available" };
    if !outcome.has_independent_members {
        return format::dependence(outcome.sampling, "95 % intervals of the thickness and of shares of members");
    }
    let confidence = outcome.required.found_m().map_or(String::new(), |_| {
        format!(
            "95 % confidence interval of the thickness for {}: {}. ",
            percent_near_limits(p),
            confidence_interval(outcome)
        )
    });
    format!(
        "{confidence}A standard error of a tenth of the exceedance probability {} requires {} ({verdict}).",
        percent_near_limits(1.0 - p),
        format::counted(requested, "member")
    )
}

/// Warnings of failed members, of a peak at the end of the run, and of an unconfirmed thickness.
fn size_warnings(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let mut warnings = Vec::new();
    let part = limited_part(answers, outcome);
    for failure in &outcome.failures {
        warnings.push(format!(
            "{} of {} failed at some thickness ({}), first member {}; they count as exceeding the limit there.",
            format::count(failure.members),
            format::counted(outcome.members, "member"),
            failure.reason,
            format::count(failure.first)
        ));
    }
    if outcome.still_warming {
        let consequence = match outcome.required {
            RequiredThickness::At(at_m) => format!("{} may be too thin", millimetres(at_m)),
            RequiredThickness::AtMost(at_m) => format!("{} may be too thin", millimetres(at_m)),
            RequiredThickness::Beyond(at_m) => format!("no thickness up to {} suffices even so", millimetres(at_m)),
        };
        warnings.push(format!(
            "{part} peaks at the end of the run ({}), so the true peak may be higher: {consequence}. Extend the run \
             (`duration` of the case).",
            format::seconds(answers.case.exposure.duration_s)
        ));
    }
    let rises = |pair: &[PeakCurvePoint]| pair[1].nominal.temperature_k > pair[0].nominal.temperature_k + 1.0;
    if let Some(pair) = outcome.peak_curve.windows(2).find(|pair| rises(pair)) {
        warnings.push(format!(
            "From {} to {} the nominal peak of {part} rises with thickness: the solution may not be unique.",
            millimetres(pair[0].thickness_m),
            millimetres(pair[1].thickness_m)
        ));
    }
    if outcome.is_confirmed() == Some(false) {
        warnings.push(format!(
            "The check does not confirm {}: the difference exceeds the sampling error of thickness and check.",
            percent_near_limits(outcome.requirement.probability)
        ));
    }
    let balance = outcome.balance.unwrap_or_default();
    warnings.extend(accuracy_warnings(outcome.error_estimate.as_ref(), &balance, "march at the required thickness"));
    warnings
}

fn page(answers: &Answers, outcome: &Sizing) -> String {
    let mass = |thickness_m: Option<f64>| {
        thickness_m.map_or("–".to_owned(), |at_m| format::significant(outcome.mass_kg_m2(at_m), 3))
    };
    let percent = |share: String| share.replace(" %", "");
    let probability = percent_near_limits(outcome.requirement.probability);
    let mut rows = vec![
        vec![
            "stated".to_owned(),
            millimetres(outcome.case_thickness_m),
            mass(Some(outcome.case_thickness_m)),
            percent(share(outcome, outcome.case_thickness_m)),
        ],
        vec![
            "nominal".to_owned(),
            thickness_text(outcome.nominal),
            mass(outcome.nominal.found_m()),
            outcome.nominal.found_m().map_or("–".to_owned(), |at_m| percent(share(outcome, at_m))),
        ],
        vec![
            format!("for {probability} of members"),
            thickness_text(outcome.required),
            mass(outcome.required.found_m()),
            percent_near_limits(outcome.requirement.probability).replace(" %", ""),
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
                format::counted(check.below_limit.total, "member"),
                check.seed.to_string(),
                format::count(check.below_limit.count),
                format::count(check.failed),
                percent(format::proportion(check.below_limit)),
                format::grouped(check.nominal_k, 1),
                format!(
                    "{} to {}",
                    format::grouped(check.percentiles_k[0], 0),
                    format::grouped(check.percentiles_k[2], 0)
                ),
            ]
        })
        .collect();
    let mut text = vec![finding(answers, outcome), required_members(outcome), stated_thickness(outcome)];
    text.extend(variance_shares(answers, outcome));
    text.extend(check_result(outcome));
    text.push(format!(
        "The factors of a member are the same at every thickness; its required thickness is the root of peak less \
         limit. {} were marched.",
        format::counted(outcome.marches, "member")
    ));
    let title = format!("Thickness of {} for {}", outcome.requirement.ply, limit_text(answers, outcome));
    let checked =
        ["Check", "Seed", "Within the limit", "Failed", "Within the limit, %", "Nominal peak, K", "95 % interval, K"];
    list(&text)
        + &table(&title, &["", "Thickness", "Mass, kg/m²", "Members within the limit, %"], &rows)
        + &table("Check with independent members at that thickness", &checked, &checks)
}

fn on_screen(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let probability = percent_near_limits(outcome.requirement.probability);
    let share_at = |at_m: Option<f64>| at_m.map_or("-".to_owned(), |at_m| share(outcome, at_m));
    let mass = |at_m: Option<f64>| at_m.map_or("-".to_owned(), |at_m| areal_mass_text(outcome.mass_kg_m2(at_m)));
    let row = |of: &str, thickness: String, mass: String, share: String| [of.to_owned(), thickness, mass, share];
    let title = format!("{} for {}", outcome.requirement.ply, limit_text(answers, outcome));
    let mut rows = vec![
        row("", "thickness".into(), "mass".into(), "members within limit".into()),
        row(
            "stated",
            millimetres(outcome.case_thickness_m),
            mass(Some(outcome.case_thickness_m)),
            share_at(Some(outcome.case_thickness_m)),
        ),
        row(
            "nominal",
            thickness_text(outcome.nominal),
            mass(outcome.nominal.found_m()),
            share_at(outcome.nominal.found_m()),
        ),
        row(
            &format!("{probability} of members"),
            thickness_text(outcome.required),
            mass(outcome.required.found_m()),
            outcome.check.as_ref().map_or("-".to_owned(), |check| format::proportion(check.below_limit)),
        ),
    ];
    if let Some(margin_m) = outcome.margin_m() {
        rows.push(row("margin", millimetres(margin_m), mass(Some(margin_m)), String::new()));
    }
    let [name, share] = [(0, 20), (2, 0)].map(|(gap, width)| Column::Left { gap, width });
    let mut lines = vec![title];
    lines.extend(aligned([name, Column::Right(17), Column::Right(13), share], &rows));
    let text = [Some(finding(answers, outcome)), Some(required_members(outcome)), variance_shares(answers, outcome)];
    let text = text.into_iter().chain([check_result(outcome)]).flatten();
    lines.extend(text.flat_map(|text| wrap("", &text)));
    lines
}

/// A thickness that was marched.
type ThicknessRow<'a> = (&'a Sizing, &'a PeakCurvePoint);

fn peaks_table<'a>() -> Table<ThicknessRow<'a>> {
    Table::<ThicknessRow<'a>>::new(&["sizing.csv"], "One row per thickness that was marched (`size`).")
        .number("thickness_m", "m", "Thickness of the ply.", |row| row.1.thickness_m)
        .number("nominal_k", "K", "Peak temperature at nominal factors.", |row| row.1.nominal.temperature_k)
        .numbers("p{2.5,50,97.5}_k", "K", "Percentiles of the peak temperature over the members.", |row| {
            row.1.percentiles_k.to_vec()
        })
        .number("share_within_limit", "–", "Share of the members that stay below the limit.", |row| {
            row.0.below_limit(row.1.thickness_m).fraction()
        })
}

/// A member: its place by thickness, and the thickness.
type MemberRow<'a> = (&'a Sizing, usize, f64);

fn members_table<'a>() -> Table<MemberRow<'a>> {
    Table::<MemberRow<'a>>::new(&["required-thickness.csv"], "One row per member (`size`), in ascending order.")
        .number("thickness_m", "m", "Thickness that the member requires.", |row| row.2)
        .number("cumulative_share", "–", "Share of the members that require no more.", |row| {
            (row.1 + 1) as f64 / row.0.members as f64
        })
}
