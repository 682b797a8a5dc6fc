//! What is said of a ply that was sized.

use super::words::{millimetres, percent_of};
use super::{Story, words};
use crate::study::proportion::{Proportion, draws_to_a_tenth};
use crate::study::size::{Needed, Sizing};

/// `TC4 below 623 K (350 °C)`.
pub(super) fn limit(story: &Story, outcome: &Sizing) -> String {
    format!("{} below {}", story.case.sensors[outcome.demand.sensor].name, words::kelvin(outcome.demand.limit_k))
}

/// `12.41 mm`, or in words what there is in its place.
pub(super) fn thickness(needed: Needed) -> String {
    match needed {
        Needed::AtMost(at_m) => format!("{} or less", millimetres(at_m)),
        Needed::At(at_m) => millimetres(at_m),
        Needed::Beyond(at_m) => format!("more than {}", millimetres(at_m)),
    }
}

pub(super) fn areal(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", words::significant(mass_kg_m2, 3))
}

/// A counted share and what it leaves open at 95 %, to two digits of that: `99.12 % (98.81 to 99.34 %)`.
pub(super) fn proportion(counted: Proportion) -> String {
    let (low, high) = counted.interval_95();
    let decimals = (1.0 - (100.0 * (high - low)).log10().floor()).clamp(0.0, 6.0) as usize;
    let percent = |share: f64| words::grouped(100.0 * share, decimals);
    format!("{} % ({} to {} %)", percent(counted.share()), percent(low), percent(high))
}

/// Where the thickness for the probability lies.
pub(super) fn interval(outcome: &Sizing) -> String {
    match outcome.interval {
        (Some(low), Some(high)) if low == high => thickness(low),
        (Some(low), Some(high)) => format!("{} to {}", thickness(low).replace(" mm", ""), thickness(high)),
        _ => "too few members to say".to_owned(),
    }
}

/// The answer: what suffices nominally, what the probability asks for, and the margin between them.
pub(super) fn found(story: &Story, outcome: &Sizing) -> String {
    let ply = &outcome.demand.ply;
    let probability = percent_of(outcome.demand.probability);
    let (low_m, high_m) = outcome.within_m;
    let limit = limit(story, outcome);
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
            proportion(outcome.held(high_m))
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
pub(super) fn cause(story: &Story, outcome: &Sizing) -> Option<String> {
    let mut order: Vec<usize> = (0..outcome.shares.len()).filter(|&factor| outcome.shares[factor] >= 0.05).collect();
    order.sort_by(|&a, &b| outcome.shares[b].total_cmp(&outcome.shares[a]));
    let named: Vec<String> = order
        .iter()
        .take(3)
        .map(|&factor| format!("{} {}", story.case.factors[factor].name, words::percent(outcome.shares[factor])))
        .collect();
    (!named.is_empty()).then(|| format!("Members differ in what they need mostly by {}.", words::listed(&named)))
}

/// What the thickness as drawn is worth.
pub(super) fn drawn(outcome: &Sizing) -> String {
    let nominal = outcome.nominal.found_m().map_or(String::new(), |at_m| {
        format!(", and the thickness that suffices nominally in {}", proportion(outcome.held(at_m)))
    });
    format!(
        "The {} as drawn hold it in {}{nominal}.",
        millimetres(outcome.drawn_m),
        proportion(outcome.held(outcome.drawn_m))
    )
}

/// What the independent members say.
pub(super) fn checked(outcome: &Sizing) -> Option<String> {
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
        proportion(check.held),
        percent(low),
        percent(high),
        words::counted(outcome.members, "member"),
        percent_of(outcome.demand.probability)
    ))
}

/// How sure the thickness is, and how many members the probability takes.
pub(super) fn enough(outcome: &Sizing) -> String {
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
pub(super) fn doubts(story: &Story, outcome: &Sizing, doubts: &mut Vec<String>) {
    let sensor = &story.case.sensors[outcome.demand.sensor].name;
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
            words::seconds(story.case.exposure.duration_s)
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
}
