//! The answers, a section each: tables and figures.

use super::super::figure::Figure;
use super::super::findings::{self, ends, explained, objective, ranked, sentence};
use super::super::{Story, causes, gas, reduction, words};
use super::table::{escaped, list, paragraph, table};
use super::{Section, asked, case, errors, posterior};
use crate::case::Case;
use crate::study::beside::Beside;
use crate::study::estimate::{Estimand, Estimated};
use crate::study::nominal::{Misfit, Nominal};
use crate::study::sensitivity::{Identifiability, Sensitivity};
use crate::study::uncertainty::Uncertainty;

/// The sections in reading order; each figure goes where its file name belongs.
pub(super) fn all(story: &Story, figures: &[Figure], stills: &[String]) -> Vec<Section> {
    let drawn: Vec<Drawn> = figures
        .iter()
        .zip(stills)
        .enumerate()
        .map(|(index, (figure, still))| Drawn { of: section_of(figure), html: drawn(index, figure, still) })
        .collect();
    let shown = |of: &str| -> String {
        let html: String = drawn.iter().filter(|drawn| drawn.of == of).map(|drawn| drawn.html.as_str()).collect();
        if html.is_empty() { html } else { format!("<div class=\"figures\">\n{html}</div>\n") }
    };
    let mut sections = Vec::new();
    let mut add = |anchor, title, content| sections.push(Section { anchor, title, content });
    if let Some(outcome) = story.sizing {
        add("size", "Thickness", asked::sized(story, outcome) + &shown("size"));
    }
    if let Some(outcome) = story.history {
        add("history", "Heating", asked::heated(story, outcome) + &shown("history"));
    }
    if let Some(outcome) = story.recovery {
        add("twins", "Twins", asked::recovered(outcome) + &shown("twins"));
    }
    if let Some(outcome) = story.nominal {
        add("nominal", "Nominal", nominal(story, outcome) + &shown("nominal"));
    }
    let moving = shown("gas");
    if !moving.is_empty() {
        add("gas", if gas::decomposes(story.case) { "Decomposition and gas" } else { "Gas" }, moving);
    }
    if let Some(outcome) = story.uncertainty {
        add("uncertainty", "Uncertainty", uncertainty(story, outcome) + &shown("uncertainty"));
    }
    if let Some(outcome) = story.sensitivity {
        add("sensitivity", "Sensitivity", sensitivity(story, outcome) + &shown("sensitivity"));
    }
    if let Some(outcome) = story.estimated {
        add("estimation", "Estimation", estimation(story, outcome) + &shown("estimation"));
    }
    if let (Some(found), Some(outcome)) = (story.estimated, story.posterior) {
        add("posterior", "Posterior", posterior::posterior(story, found, outcome) + &shown("posterior"));
    }
    if let Some(outcome) = story.beside {
        add("beside", "Beside another case", beside(story, outcome) + &shown("beside"));
    }
    if story.others.is_empty() {
        add("case", "Case", case::described(story.case) + &shown("case"));
    } else {
        let titled = |case: &Case| paragraph(&format!("{}: {}", case.id, case.name)) + &case::described(case);
        add("case", "Cases", story.cases().map(titled).collect());
    }
    add("method", "Method", case::method(story));
    sections
}

/// A figure's markup and the section it belongs to.
struct Drawn {
    of: &'static str,
    html: String,
}

fn section_of(figure: &Figure) -> &'static str {
    match figure.id.split('-').next().unwrap_or_default() {
        "nominal" => "nominal",
        "gas" => "gas",
        "spread" | "shares" | "indices" | "peaks" => "uncertainty",
        "sensitivity" | "alignment" | "proposed" => "sensitivity",
        "corner" | "predictive" => "posterior",
        "beside" => "beside",
        "size" => "size",
        "history" => "history",
        "twins" => "twins",
        "hot" => "case",
        _ => "estimation",
    }
}

fn drawn(index: usize, figure: &Figure, still: &str) -> String {
    let tag = if figure.number.is_empty() {
        String::new()
    } else {
        format!(" <span class=\"tag\">{}</span>", escaped(&figure.number))
    };
    let title = escaped(&figure.title);
    let chart = format!(
        "<div class=\"chart\" data-chart=\"{index}\" role=\"img\" aria-label=\"{title}\"></div>\n\
         <div class=\"still\">{still}</div>\n",
    );
    let caption = format!("<figcaption>{}</figcaption>\n", escaped(&figure.caption));
    // No table says in numbers what the charts of gas show: there the sentence comes first.
    let content = if section_of(figure) == "gas" { caption + &chart } else { chart + &caption };
    format!("<figure>\n<h3>{title}{tag}</h3>\n{content}</figure>\n")
}

fn nominal(story: &Story, outcome: &Nominal) -> String {
    let rows: Vec<Vec<String>> = (story.case.sensors.iter().zip(&outcome.peaks))
        .map(|(sensor, peak)| {
            vec![
                sensor.name.clone(),
                format!("{:.2}", 1e3 * sensor.depth_m),
                words::grouped(peak.temperature_k, 1),
                words::grouped(peak.temperature_k - 273.15, 1),
                words::grouped(peak.time_s, 1),
            ]
        })
        .collect();
    let misfits: Vec<Vec<String>> = story
        .case
        .observations
        .iter()
        .zip(&outcome.misfits)
        .map(|(seen, misfit)| {
            let mut row = vec![story.case.sensors[seen.sensor].name.clone()];
            row.extend(misfit_cells(misfit));
            row
        })
        .collect();
    let balance = outcome.balance;
    let heat = |joules: f64| format!("{:.3}", 1e-6 * joules);
    let balances = vec![vec![
        "energy".to_owned(),
        heat(balance.hot_in_j_m2),
        heat(balance.hot_out_j_m2),
        heat(balance.back_in_j_m2),
        heat(balance.back_out_j_m2),
        heat(balance.holder_in_j_m2),
        heat(balance.holder_out_j_m2),
        heat(balance.stored_j_m2),
        words::significant(balance.residual(), 2),
    ]];
    table("Peaks", &["Sensor", "Depth, mm", "Peak, K", "Peak, °C", "At, s"], &rows)
        + &table(
            "Prediction less measurement over the trusted window",
            &["Sensor", "Root mean square, K", "On average, K", "At worst, K", "Then, s", "Samples"],
            &misfits,
        )
        + &table(
            "Heat through the faces, from and to the holder, and stored, MJ/m²",
            &[
                "Balance",
                "In, hot",
                "Out, hot",
                "In, back",
                "Out, back",
                "In, holder",
                "Out, holder",
                "Stored",
                "Residual, relative",
            ],
            &balances,
        )
        + &if outcome.readings.is_empty() { String::new() } else { paragraph(&gas::balance(&balance)) }
}

fn misfit_cells(misfit: &Misfit) -> [String; 5] {
    [
        words::misfit(misfit.rms_k).replace(" K", ""),
        words::signed(misfit.bias_k, 1),
        words::signed(misfit.worst_k, 1),
        words::grouped(misfit.worst_time_s, 1),
        words::count(misfit.samples),
    ]
}

fn uncertainty(story: &Story, outcome: &Uncertainty) -> String {
    let case = story.case;
    let rows: Vec<Vec<String>> = (case.sensors.iter().zip(&outcome.peaks).enumerate())
        .map(|(index, (sensor, peak))| {
            let blame: Vec<String> = ranked(case, outcome, index)
                .into_iter()
                .flatten()
                .take(3)
                .filter(|(_, share)| *share >= 0.05)
                .map(|(factor, share)| format!("{} {}", case.factors[factor].name, words::percent(share)))
                .collect();
            vec![
                sensor.name.clone(),
                words::grouped(peak.nominal.temperature_k, 0),
                words::grouped(peak.mean_k, 0),
                words::significant(peak.deviation_k, 2),
                format!("{} to {}", words::grouped(peak.percentiles_k[0], 0), words::grouped(peak.percentiles_k[4], 0)),
                format!("{} to {}", words::grouped(peak.percentiles_s[0], 1), words::grouped(peak.percentiles_s[4], 1)),
                blame.join(", "),
            ]
        })
        .collect();
    let failures: Vec<Vec<String>> = outcome
        .failures
        .iter()
        .map(|failure| vec![failure.reason.clone(), words::count(failure.members), words::count(failure.first)])
        .collect();
    let drawn = format!(
        "{} drawn ({} sampling, seed {}), of which {} arrived.",
        words::counted(outcome.asked, "member"),
        outcome.sampling,
        outcome.seed,
        words::count(outcome.ok)
    );
    let head = ["Sensor", "Nominal, K", "Mean, K", "± 1 σ, K", "95 % within, K", "95 % at, s", "Largest shares"];
    paragraph(&drawn)
        + &table("Peak temperatures of the members", &head, &rows)
        + &table("Members that failed", &["Reason", "Members", "The first"], &failures)
        + &story.bondline().map(|sensor| due(story, outcome, sensor)).unwrap_or_default()
}

/// What the peak of a sensor, and its time, are due to.
fn due(story: &Story, outcome: &Uncertainty, sensor: usize) -> String {
    let (name, peak) = (&story.case.sensors[sensor].name, &outcome.peaks[sensor]);
    let of = |what: &str, causes| {
        table(&format!("What the {what} of {name} is due to"), &causes::HEAD, &causes::rows(story, causes))
    };
    of("peak temperature", &peak.causes)
        + &of("time of the peak", &peak.causes_of_time)
        + &paragraph(causes::explanation(outcome))
}

fn sensitivity(story: &Story, outcome: &Sensitivity) -> String {
    let case = story.case;
    let (all, proposed) = (&outcome.all, &outcome.proposed);
    let error = |set: &Identifiability, factor: usize| {
        let place = set.factors.iter().position(|&other| other == factor);
        place.map_or("–".to_owned(), |place| words::significant(set.standard_errors[place], 2))
    };
    let rows: Vec<Vec<String>> = (all.factors.iter().enumerate())
        .map(|(place, &index)| {
            let factor = &case.factors[index];
            let stated = outcome.stated.as_ref();
            vec![
                factor.name.clone(),
                words::meaning(factor),
                words::significant(0.01 * all.magnitude_k[place], 2),
                words::significant(factor.deviation(case.estimate.bounds), 2),
                words::percent_of(outcome.shares[index]).replace(" %", ""),
                error(all, index),
                error(proposed, index),
                stated.map_or("–".to_owned(), |stated| error(stated, index)),
            ]
        })
        .collect();
    let mut said = reduction::steps(case, outcome).to_vec();
    said.extend(reduction::stated(case, outcome));
    said.push(format!(
        "All {} together: condition number {}, rank {}; the weakest direction: {}.",
        words::counted(all.factors.len(), "factor"),
        words::condition(all.condition_number),
        all.rank,
        sentence(&all.weakest)
    ));
    let left_out: Vec<String> = outcome.reduction.iter().map(|dropped| reduction::left_out(case, dropped)).collect();
    let left_out = if left_out.is_empty() {
        String::new()
    } else {
        "<h3>How the set was found</h3>\n".to_owned() + &list(&left_out)
    };
    let how = match outcome.step {
        Some(step) => format!("Derivatives by differences, relative step {}.", words::significant(step, 2)),
        None => "Derivatives as the march tells them, exact but for rounding.".to_owned(),
    };
    let head = [
        "Factor",
        "Scales",
        "Sensitivity, K per 1 % (rms)",
        "Known beforehand, ± 1 σ",
        "Share of the variance, %",
        "Standard error, all",
        "Standard error, proposed",
        "Standard error, stated",
    ];
    list(&said)
        + &table("What the data say of each factor", &head, &rows)
        + &paragraph(&reduction::explanation())
        + &left_out
        + &paragraph(&how)
}

fn estimation(story: &Story, outcome: &Estimated) -> String {
    let rows: Vec<Vec<String>> = (outcome.factors.iter().enumerate())
        .map(|(place, Estimand { factor, bounds, .. })| {
            let (least, most) = *bounds;
            let bounded = if outcome.at_bound[place] { "reached" } else { "" };
            vec![
                factor.name.clone(),
                words::meaning(factor),
                format!("{:.3}", outcome.path[0].values[place]),
                format!("{:.4}", outcome.values[place]),
                findings::standard_error(outcome, place),
                findings::within(outcome, place),
                format!("{least:.2} to {most:.2} {bounded}").trim_end().to_owned(),
            ]
        })
        .collect();
    let misfits: Vec<Vec<String>> = (story.misfits(outcome).into_iter())
        .flat_map(|(name, (before, after))| {
            [("nominal", before), ("estimated", after)].map(|(when, misfit)| {
                let mut row = vec![format!("{name} {when}")];
                row.extend(misfit_cells(misfit));
                row
            })
        })
        .collect();
    let mut said = vec![
        format!("How it ended: {}. {}", sentence(&outcome.termination), outcome.advice),
        format!(
            "{} It went from {} to {}.",
            objective(outcome),
            words::significant(outcome.objectives().0, 4),
            words::significant(outcome.objectives().1, 4)
        ),
        format!(
            "The condition number is {}; the weakest direction: {}.",
            words::condition(outcome.identifiability.condition_number),
            sentence(&outcome.identifiability.weakest)
        ),
        findings::noise(outcome),
    ];
    said.extend(ends(outcome));
    let head = ["Factor", "Scales", "Start", "Estimate", "± (1 σ)", "95 % within", "Bounds"];
    table("Estimates", &head, &rows)
        + &errors::errors(outcome)
        + &profiles(outcome)
        + &table(
            "Prediction less measurement over the fitted window",
            &["Sensor", "Root mean square, K", "On average, K", "At worst, K", "Then, s", "Samples"],
            &misfits,
        )
        + &list(&said)
}

fn profiles(outcome: &Estimated) -> String {
    let rows: Vec<Vec<String>> = (outcome.profiles.iter())
        .map(|profile| {
            let Estimand { factor, bounds, .. } = &outcome.factors[profile.factor];
            vec![
                factor.name.clone(),
                words::interval(outcome.intervals[profile.factor], *bounds),
                words::profiled(profile.interval, *bounds),
            ]
        })
        .collect();
    table("Intervals at 95 %, linear and by profile likelihood", &["Factor", "Linear", "By profile"], &rows)
}

fn beside(story: &Story, outcome: &Beside) -> String {
    let kelvin = |off_k: f64| if off_k.is_nan() { "-".to_owned() } else { words::grouped(off_k, 1) };
    let rows: Vec<Vec<String>> = (outcome.left.iter())
        .map(|left| {
            let mut row = vec![story.case.sensors[left.sensor].name.clone()];
            row.extend(left.heating_k.into_iter().chain(left.cooling_k).map(kelvin));
            row.push(if left.explained().is_finite() {
                format!("{:.0}", 100.0 * left.explained())
            } else {
                "-".into()
            });
            row
        })
        .collect();
    let estimates = outcome.factors.iter().zip(&outcome.estimated.values).zip(&outcome.estimated.standard_errors);
    let estimates: Vec<Vec<String>> = estimates
        .map(|((name, value), error)| vec![name.clone(), format!("{value:.4}"), words::significant(*error, 2)])
        .collect();
    let (first, other) = (&story.case.id, &outcome.id);
    let title = format!("Root mean square of prediction less measurement, K: {first}, and {other} beside it");
    let heads = ["Sensor", "Heating", "beside", "Cool-down", "beside", "Explained, %"];
    paragraph(&explained(story, outcome))
        + &table(&title, &heads, &rows)
        + &table(&format!("Estimates of {other}"), &["Factor", "Estimate", "± (1 σ)"], &estimates)
}
