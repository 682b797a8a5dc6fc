//! The thickness of a ply.

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
        let said =
            [("Thickness", Some(found(answers, self))), ("Cause", cause(answers, self)), ("Check", checked(self))];
        said.into_iter().filter_map(|(about, said)| said.map(|said| Finding { about, said })).collect()
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

    /// | file | columns |
    /// |---|---|
    /// | `sizing.csv` | `thickness_m`, nominal peak and percentiles 2.5, 50, 97.5 of the members' peaks there, share of members that hold the limit |
    /// | `needed.csv` | `thickness_m` that each member needs, thinnest first, and the share of members that need no more |
    fn tables(&self, _: &Answers) -> Result<Vec<File>, ReportError> {
        Ok(vec![peaks_by_thickness(self)?, needed(self)?])
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

/// `12.41 mm`, or in words what there is in its place.
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

/// Where the thickness for the probability lies.
fn interval(outcome: &Sizing) -> String {
    match outcome.interval {
        (Some(low), Some(high)) if low == high => thickness(low),
        (Some(low), Some(high)) => format!("{} to {}", thickness(low).replace(" mm", ""), thickness(high)),
        _ => "too few members to say".to_owned(),
    }
}

/// The answer: what suffices nominally, what the probability asks for, and the margin between them.
fn found(answers: &Answers, outcome: &Sizing) -> String {
    let ply = &outcome.demand.ply;
    let probability = percent_of(outcome.demand.probability);
    let (low_m, high_m) = outcome.within_m;
    let limit = limit(answers, outcome);
    let nominal = match outcome.nominal {
        Needed::At(at_m) => format!("{} of {ply} keep {limit} nominally", millimetres(at_m)),
        Needed::AtMost(_) => format!("Even {} of {ply} keep {limit} nominally", millimetres(low_m)),
        Needed::Beyond(_) => {
            let peak_k = outcome.rungs.last().map_or(f64::NAN, |rung| rung.nominal.temperature_k);
            let reached = words::kelvin(peak_k);
            format!("Not even {} of {ply} keep {limit} nominally: it peaks at {reached}", millimetres(high_m))
        }
    };
    let uncertain = match outcome.needed {
        Needed::At(at_m) => {
            format!("{} in {probability} of {}", millimetres(at_m), words::counted(outcome.members, "member"))
        }
        Needed::AtMost(_) => {
            format!("and so do they in {probability} of {}", words::counted(outcome.members, "member"))
        }
        Needed::Beyond(_) => format!(
            "and no thickness from {} to {} does in {probability} of {}: the thickest does in {}",
            millimetres(low_m),
            millimetres(high_m),
            words::counted(outcome.members, "member"),
            words::proportion(outcome.held(high_m))
        ),
    };
    let margin = outcome.margin_m().map_or(String::new(), |margin_m| {
        format!(
            " The margin for uncertainty is {} ({} more) and {}.",
            millimetres(margin_m),
            words::percent(margin_m / outcome.nominal.found_m().unwrap_or(f64::NAN)),
            areal(outcome.mass_kg_m2(margin_m))
        )
    });
    format!("{nominal}, {uncertain}.{margin}")
}

/// What the margin is due to.
fn cause(answers: &Answers, outcome: &Sizing) -> Option<String> {
    let mut order: Vec<usize> = (0..outcome.shares.len()).filter(|&factor| outcome.shares[factor] >= 0.05).collect();
    order.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let named: Vec<String> = order
        .iter()
        .take(3)
        .map(|&factor| format!("{} {}", answers.case.factors[factor].name, words::percent(outcome.shares[factor])))
        .collect();
    (!named.is_empty()).then(|| format!("Members differ in what they need mostly by {}.", words::listed(&named)))
}

/// What the thickness as drawn is worth.
fn drawn(outcome: &Sizing) -> String {
    let nominal = outcome.nominal.found_m().map_or(String::new(), |at_m| {
        format!(", and the thickness that suffices nominally in {}", words::proportion(outcome.held(at_m)))
    });
    format!(
        "The {} as drawn hold it in {}{nominal}.",
        millimetres(outcome.drawn_m),
        words::proportion(outcome.held(outcome.drawn_m))
    )
}

/// What the independent members say.
fn checked(outcome: &Sizing) -> Option<String> {
    let check = outcome.check.as_ref()?;
    let (low, high) = outcome.expected_95()?;
    let verdict = if outcome.is_borne_out()? { "within" } else { "OUTSIDE" };
    let percent = |counted: Proportion| words::trimmed(words::grouped(100.0 * counted.share(), 1));
    Some(format!(
        "Checked at {} with {} of another seed ({}), drawn and planned anew: {} held it, {verdict} the {} to {} % that are \
         to be expected where {} size a thickness for {}.",
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

/// How sure the thickness is, and how many members the probability takes.
fn enough(outcome: &Sizing) -> String {
    let p = outcome.demand.probability;
    let wanted = draws_to_a_tenth(p);
    let verdict = if outcome.members >= wanted { "there are as many" } else { "there are fewer" };
    let sure = outcome.needed.found_m().map_or(String::new(), |_| {
        format!("The thickness for {} lies at {} with 95 % confidence. ", percent_of(p), interval(outcome))
    });
    format!(
        "{sure}To know the {} that exceed to a tenth of themselves takes {}; {verdict}.",
        percent_of(1.0 - p),
        words::counted(wanted, "member")
    )
}

/// Reasons for doubt.
fn doubts(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let mut doubts = Vec::new();
    let sensor = &answers.case.sensors[outcome.demand.sensor].name;
    for failure in &outcome.failures {
        doubts.push(format!(
            "{} of {} failed at a thickness ({}), the first being member {}; there they count as if they exceeded the limit.",
            words::count(failure.members),
            words::counted(outcome.members, "member"),
            failure.reason,
            words::count(failure.first)
        ));
    }
    if outcome.still_warming {
        let so = match outcome.needed {
            Needed::At(at_m) => format!("then {} is too thin", millimetres(at_m)),
            Needed::AtMost(at_m) => format!("then {}, the thinnest allowed, need not suffice", millimetres(at_m)),
            Needed::Beyond(at_m) => {
                format!("up to {}, the thickest allowed, none suffices as it is", millimetres(at_m))
            }
        };
        doubts.push(format!(
            "{sensor} is at its hottest when the run ends at {}: it may still become hotter, and {so}. Make the run longer \
             (--set duration=...).",
            words::seconds(answers.case.exposure.duration_s)
        ));
    }
    let rises = |pair: &[crate::study::size::Rung]| pair[1].nominal.temperature_k > pair[0].nominal.temperature_k + 1.0;
    if let Some(pair) = outcome.rungs.windows(2).find(|pair| rises(pair)) {
        doubts.push(format!(
            "From {} to {} the nominal peak of {sensor} rises with thickness: the thickness found need not be the only one.",
            millimetres(pair[0].thickness_m),
            millimetres(pair[1].thickness_m)
        ));
    }
    if outcome.is_borne_out() == Some(false) {
        doubts.push(format!(
            "Other members do not confirm {}: the share that holds lies further off than the scatter of the thickness and of \
             the check explains.",
            percent_of(outcome.demand.probability)
        ));
    }
    doubts
}

fn page(answers: &Answers, outcome: &Sizing) -> String {
    let mass = |thickness_m: Option<f64>| {
        thickness_m.map_or("–".to_owned(), |at_m| words::significant(outcome.mass_kg_m2(at_m), 3))
    };
    let held = |held| words::proportion(held).replace(" %", "");
    let probability = percent_of(outcome.demand.probability);
    let mut rows = vec![
        vec![
            "as drawn".to_owned(),
            millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            held(outcome.held(outcome.drawn_m)),
        ],
        vec![
            "holds nominally".to_owned(),
            thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            outcome.nominal.found_m().map(|at_m| outcome.held(at_m)).map_or("–".to_owned(), held),
        ],
        vec![
            format!("holds in {probability} of members"),
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
                held(check.held),
                words::grouped(check.nominal_k, 1),
                format!(
                    "{} to {}",
                    words::grouped(check.percentiles_k[0], 0),
                    words::grouped(check.percentiles_k[2], 0)
                ),
            ]
        })
        .collect();
    let mut said = vec![found(answers, outcome), enough(outcome), drawn(outcome)];
    said.extend(cause(answers, outcome));
    said.extend(checked(outcome));
    said.push(format!(
        "Every member is the same at every thickness, so what it needs is the one root of its peak less the limit; the share \
         of members that hold a thickness is the share that need no more. It took {} marched.",
        words::counted(outcome.marches, "member")
    ));
    let title = format!("Thickness of {} that keeps {}", outcome.demand.ply, limit(answers, outcome));
    let checked = ["Check", "Seed", "Held it", "Failed", "Held it, %", "Nominal peak, K", "95 % peak at, K"];
    list(&said)
        + &table(&title, &["", "Thickness", "Mass, kg/m²", "Members that hold it, %"], &rows)
        + &table("Other members, of the case drawn and planned anew at that thickness", &checked, &checks)
}

fn on_screen(answers: &Answers, outcome: &Sizing) -> Vec<String> {
    let probability = percent_of(outcome.demand.probability);
    let held = |held: Option<Proportion>| held.map_or("-".to_owned(), words::proportion);
    let mass = |at_m: Option<f64>| at_m.map_or("-".to_owned(), |at_m| areal(outcome.mass_kg_m2(at_m)));
    let row =
        |of: &str, thickness: String, mass: String, held: String| format!("{of:<20}{thickness:>17}{mass:>13}  {held}");
    let title = format!("{} for {}", outcome.demand.ply, limit(answers, outcome));
    let mut lines = vec![
        title,
        row("", "thickness".into(), "mass".into(), "members that hold it".into()),
        row(
            "as drawn",
            millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            held(Some(outcome.held(outcome.drawn_m))),
        ),
        row(
            "nominally",
            thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            held(outcome.nominal.found_m().map(|at_m| outcome.held(at_m))),
        ),
        row(
            &format!("in {probability} of members"),
            thickness(outcome.needed),
            mass(outcome.needed.found_m()),
            held(outcome.check.as_ref().map(|check| check.held)),
        ),
    ];
    if let Some(margin_m) = outcome.margin_m() {
        lines.push(row("margin", millimetres(margin_m), mass(Some(margin_m)), String::new()));
    }
    let said = [Some(found(answers, outcome)), Some(enough(outcome)), cause(answers, outcome)];
    let said = said.into_iter().chain([checked(outcome)]).flatten();
    lines.extend(said.flat_map(|said| wrapped("", &said)));
    lines
}

fn peaks_by_thickness(outcome: &Sizing) -> Result<File, ReportError> {
    let mut table =
        Table::new("sizing.csv", ["thickness_m", "nominal_K", "p2.5_K", "p50_K", "p97.5_K", "share_that_holds"])?;
    for rung in &outcome.rungs {
        let share = outcome.held(rung.thickness_m).share();
        let peaks = [rung.thickness_m, rung.nominal.temperature_k].into_iter().chain(rung.percentiles_k);
        table.row(None, peaks.chain([share]))?;
    }
    table.close()
}

fn needed(outcome: &Sizing) -> Result<File, ReportError> {
    let mut table = Table::new("needed.csv", ["thickness_m", "share"])?;
    for (place, &needed_m) in outcome.each_m.iter().enumerate() {
        table.row(None, [needed_m, (place + 1) as f64 / outcome.members as f64])?;
    }
    table.close()
}
