//! Sections on questions of design and of trust: a ply that was sized, a flux that was recovered, twins that were fitted.

use super::super::{Story, history, recovery, sizing, words};
use super::table::{list, paragraph, table};
use crate::study::history::History;
use crate::study::recovery::Recovery;
use crate::study::size::Sizing;

pub(super) fn sized(story: &Story, outcome: &Sizing) -> String {
    let mass = |thickness_m: Option<f64>| {
        thickness_m.map_or("–".to_owned(), |at_m| words::significant(outcome.mass_kg_m2(at_m), 3))
    };
    let held = |held| sizing::proportion(held).replace(" %", "");
    let probability = words::percent_of(outcome.demand.probability);
    let mut rows = vec![
        vec![
            "as drawn".to_owned(),
            words::millimetres(outcome.drawn_m),
            mass(Some(outcome.drawn_m)),
            held(outcome.held(outcome.drawn_m)),
        ],
        vec![
            "holds nominally".to_owned(),
            sizing::thickness(outcome.nominal),
            mass(outcome.nominal.found_m()),
            outcome.nominal.found_m().map(|at_m| outcome.held(at_m)).map_or("–".to_owned(), held),
        ],
        vec![
            format!("holds in {probability} of members"),
            sizing::thickness(outcome.needed),
            mass(outcome.needed.found_m()),
            words::percent_of(outcome.demand.probability).replace(" %", ""),
        ],
    ];
    if let Some(margin_m) = outcome.margin_m() {
        rows.push(vec!["margin".to_owned(), words::millimetres(margin_m), mass(Some(margin_m)), String::new()]);
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
    let mut said = vec![sizing::found(story, outcome), sizing::enough(outcome), sizing::drawn(outcome)];
    said.extend(sizing::cause(story, outcome));
    said.extend(sizing::checked(outcome));
    said.push(format!(
        "Every member is the same at every thickness, so what it needs is the one root of its peak less the limit; the share \
         of members that hold a thickness is the share that need no more. It took {} marched.",
        words::counted(outcome.marches, "member")
    ));
    let title = format!("Thickness of {} that keeps {}", outcome.demand.ply, sizing::limit(story, outcome));
    let checked = ["Check", "Seed", "Held it", "Failed", "Held it, %", "Nominal peak, K", "95 % peak at, K"];
    list(&said)
        + &table(&title, &["", "Thickness", "Mass, kg/m²", "Members that hold it, %"], &rows)
        + &table("Other members, of the case drawn and planned anew at that thickness", &checked, &checks)
}

pub(super) fn heated(story: &Story, outcome: &History) -> String {
    let rows: Vec<Vec<String>> = history::rows(outcome, usize::MAX).into_iter().map(Vec::from).collect();
    let fits: Vec<Vec<String>> = outcome
        .seen
        .iter()
        .map(|seen| {
            let [own, found] = [seen.rms_k.0, seen.rms_k.1].map(|rms_k| words::significant(rms_k, 3));
            vec![story.case.sensors[seen.sensor].name.clone(), words::count(seen.times_s.len()), own, found]
        })
        .collect();
    let head = ["Sensor", "Samples", "Off as the case has it, K", "Off as found, K"];
    list(&[history::found(story, outcome), history::chosen(outcome), history::left_out().to_owned()])
        + &table(&format!("{} at the knots", history::unit(outcome.sought).title), &history::head(outcome), &rows)
        + &table("Measured less predicted, root mean square", &head, &fits)
}

pub(super) fn recovered(outcome: &Recovery) -> String {
    let rows: Vec<Vec<String>> = outcome
        .recovered
        .iter()
        .map(|factor| {
            vec![
                factor.name.clone(),
                words::significant(factor.bias, 2),
                words::significant(factor.bias_error, 2),
                words::significant(factor.rms, 2),
                words::significant(factor.half_width, 2),
                format!("{} of {}", words::count(factor.covered.count), words::count(factor.covered.of)),
                sizing::proportion(factor.covered).replace(" %", ""),
                words::count(factor.at_bound),
            ]
        })
        .collect();
    let ended =
        format!("{} of {} converged.", words::count(outcome.converged()), words::counted(outcome.twins.len(), "fit"));
    let head = ["Factor", "Bias", "± (1 σ)", "Off, rms", "± 95 %, mean", "Truth held", "Truth held, %", "At a bound"];
    list(&[recovery::coverage(outcome), ended])
        + &table("Estimates less truths", &head, &rows)
        + &paragraph(&recovery::made(outcome))
}
