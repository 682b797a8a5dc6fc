//! A percentile or a probability that was sampled until its interval was narrow enough.

use super::figure::{Axis, Figure, Ink, Layer, Stroke};
use super::figures::line;
use super::files::json::{JsonObject, OrderedMap};
use super::files::table::{NamedFile, Names, Table, TableDescription};
use super::html::table::{list, table};
use super::reportable::{Finding, Reportable, ScreenLimits, Section};
use super::terminal::wrap;
use super::{ReportError, format};
use crate::fit::reliability::DesignPoint;
use crate::study::answers::Answers;
use crate::study::sequential_sampling::{
    HalfWidth, Importance, ImportanceError, Look, MIN_EFFECTIVE, PlainReason, PrecisionReached, RARE, TAIL,
    TargetQuantity,
};
use crate::study::uncertainty::MembersError;
use serde::Serialize;

fn looks_table<'a>() -> Table<&'a Look> {
    Table::<&'a Look>::new(
        &["looks.csv"],
        "One row per look at the interval of the percentile or probability for which members are drawn. Ends of the \
         interval are empty where there are too few members.",
    )
    .number("members", "–", "Members drawn.", |look| look.members as f64)
    .number("estimate", "K or –", "Percentile or probability.", |look| look.estimate)
    .numbers("{low,high}", "K or –", "Its interval.", |look| {
        [look.low, look.high].map(|end| end.unwrap_or(f64::NAN)).to_vec()
    })
}

impl Reportable for PrecisionReached {
    fn comes_first(&self) -> bool {
        true
    }

    fn uses_observations(&self) -> bool {
        false
    }

    fn facts(&self) -> Vec<String> {
        let how = if self.importance.is_some() { " by importance sampling" } else { "" };
        vec![format!("{}{how}", format::counted(self.members(), "member"))]
    }

    fn findings(&self, answers: &Answers) -> Vec<Finding> {
        let label = if is_percentile(self) { "Percentile" } else { "Probability" };
        let points = self.importance.iter().flat_map(|importance| most_probable(answers, self, importance));
        let points = points.enumerate().map(|(place, text)| Finding {
            label: if place == 0 { "Most probable combination" } else { "Further combination" },
            text,
        });
        std::iter::once(Finding { label, text: result(answers, self) }).chain(points).collect()
    }

    fn warnings(&self, answers: &Answers) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.is_reached {
            let few = self.importance.as_ref().map(|importance| importance.estimate.effective_exceeding());
            let few = few.filter(|found| *found < MIN_EFFECTIVE).map_or(String::new(), |found| {
                format!(
                    " The members above the limit have the information of {} of equal weight, {} are needed.",
                    format::significant(found, 2),
                    MIN_EFFECTIVE
                )
            });
            let elsewhere =
                self.importance.as_ref().map_or(String::new(), |importance| format!(" {}", elsewhere_text(importance)));
            warnings.push(format!(
                "The interval is not within {} after {}: raise the largest number of members, {}.{few}{elsewhere}",
                half_width_text(self.target.half_width, is_percentile(self)),
                format::counted(self.members(), "member"),
                format::count(self.max_members)
            ));
        }
        if self.failed > 0 {
            warnings.push(format!(
                "{} failed; in the {} they count as above every temperature.",
                format::counted(self.failed, "member"),
                quantity_text(answers, self)
            ));
        }
        warnings
    }

    fn figures(&self, answers: &Answers) -> Vec<(&'static str, Figure)> {
        vec![("precision", figure(answers, self))]
    }

    fn sections(&self, answers: &Answers) -> Vec<Section> {
        let title = if is_percentile(self) { "Percentile" } else { "Probability" };
        vec![Section::new("precision", title, page(answers, self))]
    }

    fn methods(&self, _: &Answers) -> Vec<String> {
        let sequential = "Sequential sampling: the interval is computed after 500 members and whenever their number \
                          has grown by a quarter, each time at 96 %, so that it covers at least 95 % although its \
                          width ends the sampling (Frey, Am. Stat. 64, 2010)."
            .to_owned();
        let interval = match (&self.importance, is_percentile(self)) {
            (Some(_), _) => {
                "Importance sampling: a fifth of the members is drawn about the design points, the most probable \
                 combinations of factors that reach the temperature, searched from nine starts with exact derivatives \
                 (Zhang & Der Kiureghian, 1995); four fifths are drawn plainly. Near the design points members are \
                 weighted (Hesterberg, Technometrics 37, 1995); away from them the plain ones are counted, with the \
                 interval of Clopper and Pearson, so that a combination that no search found is part of the interval. \
                 The intervals of both parts are combined after Zou & Donner (Stat. Med. 27, 2008)."
            }
            (None, true) => "The interval of a percentile is that of order statistics, valid for any distribution.",
            (None, false) => "The interval of a probability is that of Clopper and Pearson.",
        };
        vec![sequential, interval.to_owned()]
    }

    fn table_descriptions() -> Vec<TableDescription> {
        vec![looks_table().description()]
    }

    fn tables(&self, _: &Answers) -> Result<Vec<NamedFile>, ReportError> {
        Ok(vec![looks_table().csv(&Names::default(), &self.looks)?])
    }

    fn write_summary(&self, answers: &Answers, record: &mut JsonObject<'_>) -> Result<(), ReportError> {
        record.put("precision_reached", &Record::of(answers, self))
    }

    fn screen(&self, answers: &Answers, _: &ScreenLimits) -> Vec<String> {
        let points = self.importance.iter().flat_map(|importance| most_probable(answers, self, importance));
        let error = self.importance.iter().map(|importance| discretisation_error(self, importance));
        std::iter::once(result(answers, self)).chain(points).chain(error).flat_map(|text| wrap("", &text)).collect()
    }
}

fn is_percentile(found: &PrecisionReached) -> bool {
    matches!(found.target.quantity, TargetQuantity::Percentile(_))
}

/// `P99 of the peak of TC4`, `P(TC4 > 623 K)`.
fn quantity_text(answers: &Answers, found: &PrecisionReached) -> String {
    let sensor = &answers.case.sensors[found.target.sensor].name;
    match found.target.quantity {
        TargetQuantity::Percentile(probability) => {
            format!("P{} of the peak of {sensor}", format::trim_zeros(format::grouped(100.0 * probability, 4)))
        }
        TargetQuantity::Exceedance { temperature_k } => {
            format!("P({sensor} > {} K)", format::trim_zeros(format::grouped(temperature_k, 2)))
        }
    }
}

fn half_width_text(half_width: HalfWidth, is_percentile: bool) -> String {
    match half_width {
        HalfWidth::Absolute(most) if is_percentile => {
            format!("± {} K", format::trim_zeros(format::significant(most, 3)))
        }
        HalfWidth::Absolute(most) => format!("± {}", format::trim_zeros(format::significant(most, 3))),
        HalfWidth::Relative(share) => format!("± {} of it", format::percent_near_limits(share)),
    }
}

/// A percentile in K, to a tenth of the half-width; a probability, to three digits.
fn value_text(found: &PrecisionReached, value: f64) -> String {
    if !is_percentile(found) {
        return format::significant(value, 3);
    }
    let width_k = found.last().map_or(1.0, Look::half_width);
    format::grouped(value, if width_k < 1.0 { 2 } else { 1 })
}

/// `995.0 to 1,003.2`; `unknown` for an end with too few members.
fn interval_text(found: &PrecisionReached, look: &Look) -> String {
    let end = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| value_text(found, value));
    format!("{} to {}", end(look.low), end(look.high))
}

fn result(answers: &Answers, found: &PrecisionReached) -> String {
    let Some(look) = found.last() else {
        return format!("{}: stopped before the first look.", quantity_text(answers, found));
    };
    let (unit, sign) = if is_percentile(found) { (" K", ":") } else { ("", " =") };
    let method = if found.importance.is_some() { " of importance sampling" } else { "" };
    let wanted = half_width_text(found.target.half_width, is_percentile(found));
    let reached = if found.is_reached { "within" } else { "NOT within" };
    let plain = match (&found.importance, found.plain_reason) {
        (Some(importance), _) if importance.estimate.exceeding > 0 => format!(
            " Plain sampling would take {} members for this interval.",
            format::significant(importance.estimate.equivalent_members(TAIL), 2)
        ),
        (None, Some(reason)) => format!(" {}", plain_reason_text(reason)),
        _ => String::new(),
    };
    format!(
        "{}{sign} {}{unit}, 95 % interval {}{unit}: {reached} {wanted}, from {}{method}.{}",
        quantity_text(answers, found),
        value_text(found, look.estimate),
        interval_text(found, look),
        format::counted(look.members, "member"),
        plain
    )
}

/// Why the members of a probability were drawn plainly, as a sentence.
fn plain_reason_text(reason: PlainReason) -> String {
    match reason {
        PlainReason::Frequent { first_order } => format!(
            "Members were drawn plainly: by the first-order method the probability is {}, and importance sampling \
             begins below {}.",
            format::significant(first_order, 2),
            format::percent(RARE)
        ),
        PlainReason::NoDesignPoint => "Members were drawn plainly: no search for a combination of factors that \
                                       reaches the temperature converged; perhaps none within their bounds does."
            .to_owned(),
        PlainReason::HeldEmissivity => "Members were drawn plainly: the emissivity of a face that a pyrometer holds \
                                        is drawn too, and a search for the most probable combination does not know \
                                        it."
        .to_owned(),
    }
}

/// Probability of exceedance away from the design points, from the plainly drawn members.
fn elsewhere_text(importance: &Importance) -> String {
    let (low, high) = importance.estimate.elsewhere_interval(TAIL);
    format!(
        "Away from {}, {} of {} drawn plainly exceed the temperature: this part of the probability is between {} and \
         {}.",
        match importance.design.points.len() {
            1 => "the most probable combination".to_owned(),
            several => format!("the {several} most probable combinations"),
        },
        format::count(importance.estimate.elsewhere),
        format::counted(importance.estimate.plain, "member"),
        format::significant(low, 2),
        format::significant(high, 2)
    )
}

/// Factors by importance: index and share.
fn by_importance(point: &DesignPoint) -> Vec<(usize, f64)> {
    let squares = point.direction.iter().map(|by| by * by);
    let mut shares: Vec<(usize, f64)> = squares.enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares
}

/// A sentence for each design point.
fn most_probable(answers: &Answers, found: &PrecisionReached, importance: &Importance) -> Vec<String> {
    let sentence = |(place, (point, factors)): (usize, (&DesignPoint, &Vec<f64>))| {
        let named: Vec<String> = by_importance(point)
            .into_iter()
            .filter(|(_, share)| *share >= 0.05)
            .take(4)
            .map(|(factor, share)| {
                let name = &answers.case.factors[factor].name;
                format!("{name} = {} ({})", format::significant(factors[factor], 3), format::percent(share))
            })
            .collect();
        let [is_reached, with] = match place {
            0 => ["is reached most probably at", ", with the importance of each factor"],
            _ => ["is also reached at", ""],
        };
        format!(
            "{} {is_reached} {}{with}; reliability index {}, first-order probability {}.",
            temperature_text(found),
            format::list(&named),
            format::significant(point.reliability_index, 3),
            format::significant(point.first_order_probability(), 2)
        )
    };
    importance.design.points.iter().zip(&importance.factors).enumerate().map(sentence).collect()
}

/// The discretisation error of the members that decide, as a sentence.
fn discretisation_error(found: &PrecisionReached, importance: &Importance) -> String {
    let Some(ImportanceError { design_points, nearest }) = &importance.discretisation_error else {
        return "The discretisation error of the members is not known, as the case states cells and steps.".to_owned();
    };
    let error = |of: &MembersError| format::members_error(of.temperature_k, of.failed);
    let combinations = match design_points.members {
        1 => "at the most probable combination".to_owned(),
        several => format!("at the {several} most probable combinations"),
    };
    format!(
        "Discretisation error: {} {combinations}, {} in the {} nearest to {}.",
        error(design_points),
        error(nearest),
        format::counted(nearest.members, "member"),
        temperature_text(found)
    )
}

fn temperature_text(found: &PrecisionReached) -> String {
    match found.target.quantity {
        TargetQuantity::Exceedance { temperature_k } => format::kelvin(temperature_k),
        TargetQuantity::Percentile(_) => "It".to_owned(),
    }
}

fn page(answers: &Answers, found: &PrecisionReached) -> String {
    let looks: Vec<Vec<String>> = found
        .looks
        .iter()
        .map(|look| {
            let half_width = look.half_width();
            let half_width =
                if is_percentile(found) { format::grouped(half_width, 2) } else { format::significant(half_width, 2) };
            vec![format::count(look.members), value_text(found, look.estimate), interval_text(found, look), half_width]
        })
        .collect();
    let unit = if is_percentile(found) { ", K" } else { "" };
    let head = ["Members", &format!("Estimate{unit}"), &format!("95 % interval{unit}"), &format!("Half-width{unit}")];
    let mut text = vec![result(answers, found)];
    let mut points = String::new();
    if let Some(importance) = &found.importance {
        text.extend(most_probable(answers, found, importance));
        text.push(discretisation_error(found, importance));
        text.push(format!(
            "{} of {} exceed the temperature; they have the information of {} of equal weight. {}",
            format::count(importance.estimate.exceeding),
            format::counted(importance.estimate.members, "member"),
            format::significant(importance.estimate.effective_exceeding(), 3),
            elsewhere_text(importance)
        ));
        for (place, (at, factors)) in importance.design.points.iter().zip(&importance.factors).enumerate() {
            let rows: Vec<Vec<String>> = by_importance(at)
                .into_iter()
                .map(|(factor, share)| {
                    let of = &answers.case.factors[factor];
                    vec![
                        of.name.clone(),
                        format::factor_meaning(of),
                        format::significant(of.nominal, 3),
                        format::significant(factors[factor], 3),
                        format::grouped(at.scores[factor], 2),
                        format::grouped(100.0 * share, 1),
                    ]
                })
                .collect();
            let which = if place == 0 { "Most probable combination" } else { "Further combination" };
            points += &table(
                &format!("{which} of factors that reaches {}", temperature_text(found)),
                &["Factor", "Scales", "Nominal", "There", "Standard normal variable", "Importance, %"],
                &rows,
            );
        }
    }
    list(&text) + &points + &table("The interval over the members", &head, &looks)
}

fn figure(answers: &Answers, found: &PrecisionReached) -> Figure {
    let known: Vec<&Look> = found.looks.iter().filter(|look| look.half_width().is_finite()).collect();
    let scale = if is_percentile(found) { 1.0 } else { 100.0 };
    let of = |each: &dyn Fn(&Look) -> f64| known.iter().map(|look| scale * each(look)).collect::<Vec<f64>>();
    let x: Vec<f64> = known.iter().map(|look| look.members as f64).collect();
    let (low, high) = (of(&|look| look.low.unwrap_or(f64::NAN)), of(&|look| look.high.unwrap_or(f64::NAN)));
    let mut layers = vec![
        Layer::Band { name: "95 % interval".to_owned(), ink: Ink::Series(0), opacity: 0.2, x: x.clone(), low, high },
        line("estimate".to_owned(), Ink::Series(0), Stroke::Solid, &x, &of(&|look| look.estimate)),
    ];
    let wanted = |look: &Look| match found.target.half_width {
        HalfWidth::Absolute(most) => most,
        HalfWidth::Relative(share) => share * look.estimate,
    };
    for (name, side) in [("stated half-width", -1.0), ("", 1.0)] {
        let y = of(&|look| look.estimate + side * wanted(look));
        layers.push(line(name.to_owned(), Ink::Guide, Stroke::Dashed, &x, &y));
    }
    let label = if is_percentile(found) { "Peak temperature, K" } else { "Probability, %" };
    Figure {
        id: "precision".to_owned(),
        title: format!("{} over the number of members", quantity_text(answers, found)),
        caption: format!("{} Sampling ends when the band lies between the dashed lines.", result(answers, found)),
        x: Axis::log("Members"),
        y: Axis::linear(label),
        layers,
    }
}

#[derive(Serialize)]
struct Record<'a> {
    sensor: &'a str,
    /// `percentile` or `exceedance`.
    quantity: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    percentile: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    temperature_k: Option<f64>,
    half_width: f64,
    is_relative: bool,
    is_reached: bool,
    /// `plain` or `importance`.
    sampling: &'static str,
    members: usize,
    failed: usize,
    estimate: Option<f64>,
    interval: (Option<f64>, Option<f64>),
    /// Why a probability was sampled plainly.
    #[serde(skip_serializing_if = "Option::is_none")]
    plain_reason: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    importance_sampling: Option<ImportanceRecord<'a>>,
}

#[derive(Serialize)]
struct ImportanceRecord<'a> {
    design_points: Vec<DesignPointRecord<'a>>,
    marches: usize,
    exceeding: usize,
    effective_exceeding: f64,
    equivalent_members: f64,
    plain_members: usize,
    exceeding_elsewhere: usize,
    elsewhere_interval: (f64, f64),
    #[serde(skip_serializing_if = "Option::is_none")]
    discretisation_error: Option<&'a ImportanceError>,
}

#[derive(Serialize)]
struct DesignPointRecord<'a> {
    factors: OrderedMap<'a, f64>,
    importance: OrderedMap<'a, f64>,
    reliability_index: f64,
    first_order_probability: f64,
}

impl<'a> Record<'a> {
    fn of(answers: &'a Answers, found: &'a PrecisionReached) -> Self {
        let (quantity, percentile, temperature_k) = match found.target.quantity {
            TargetQuantity::Percentile(probability) => ("percentile", Some(100.0 * probability), None),
            TargetQuantity::Exceedance { temperature_k } => ("exceedance", None, Some(temperature_k)),
        };
        let (half_width, is_relative) = match found.target.half_width {
            HalfWidth::Absolute(most) => (most, false),
            HalfWidth::Relative(share) => (share, true),
        };
        let last = found.last();
        let names = answers.case.factors.iter().map(|factor| factor.name.as_str());
        Self {
            sensor: &answers.case.sensors[found.target.sensor].name,
            quantity,
            percentile,
            temperature_k,
            half_width,
            is_relative,
            is_reached: found.is_reached,
            sampling: if found.importance.is_some() { "importance" } else { "plain" },
            members: found.members(),
            failed: found.failed,
            estimate: last.map(|look| look.estimate),
            interval: (last.and_then(|look| look.low), last.and_then(|look| look.high)),
            plain_reason: found.plain_reason.map(plain_reason_text),
            importance_sampling: found.importance.as_ref().map(|importance| {
                let estimate = &importance.estimate;
                let design_point = |(point, factors): (&DesignPoint, &Vec<f64>)| DesignPointRecord {
                    factors: OrderedMap(names.clone().zip(factors.iter().copied()).collect()),
                    importance: OrderedMap(names.clone().zip(point.direction.iter().map(|by| by * by)).collect()),
                    reliability_index: point.reliability_index,
                    first_order_probability: point.first_order_probability(),
                };
                ImportanceRecord {
                    design_points: importance.design.points.iter().zip(&importance.factors).map(design_point).collect(),
                    marches: importance.design.evaluations,
                    exceeding: estimate.exceeding,
                    effective_exceeding: estimate.effective_exceeding(),
                    equivalent_members: estimate.equivalent_members(TAIL),
                    plain_members: estimate.plain,
                    exceeding_elsewhere: estimate.elsewhere,
                    elsewhere_interval: estimate.elsewhere_interval(TAIL),
                    discretisation_error: importance.discretisation_error.as_ref(),
                }
            }),
        }
    }
}
