//! What is said of a flux or a gas temperature that was recovered.

use super::{Story, words};
use crate::study::history::{Chosen, History, Sought};

/// What a value of a history is called and printed in.
pub(super) struct Unit {
    /// `Cold-wall heat flux at the hot face`.
    pub title: &'static str,
    pub noun: &'static str,
    pub unit: &'static str,
    /// What SI is multiplied by.
    pub scale: f64,
    digits: usize,
}

pub(super) fn unit(sought: Sought) -> Unit {
    let flux = |title, noun| Unit { title, noun, unit: "W/cm²", scale: 1e-4, digits: 3 };
    match sought {
        Sought::Flux => flux("Cold-wall heat flux at the hot face", "flux"),
        Sought::RadiantFlux => flux("Incident radiant flux at the hot face", "radiant flux"),
        Sought::Gas => {
            let title = "Temperature of the gas at the hot face";
            Unit { title, noun: "gas temperature", unit: "K", scale: 1.0, digits: 4 }
        }
    }
}

impl Unit {
    fn value(&self, value: f64) -> String {
        words::significant(value * self.scale, self.digits)
    }

    fn with_unit(&self, value: f64) -> String {
        format!("{} {}", self.value(value), self.unit)
    }

    fn width(&self, value: f64) -> String {
        words::significant(value * self.scale, 3)
    }
}

/// Cells of the heading of the table of knots.
pub(super) fn head(outcome: &History) -> [&'static str; 4] {
    let value = match outcome.sought {
        Sought::Flux | Sought::RadiantFlux => "Flux, W/cm²",
        Sought::Gas => "Gas, K",
    };
    ["Time, s", value, "± 95 %", "As the case has it"]
}

/// The knots in order; at most so many, evenly picked.
pub(super) fn rows(outcome: &History, most: usize) -> Vec<[String; 4]> {
    let last = outcome.times_s.len() - 1;
    let rows = most.min(last + 1);
    let picked = (0..rows).map(|row| row * last / (rows - 1));
    let unit = unit(outcome.sought);
    let cells = |knot: usize| {
        let half = if outcome.undetermined[knot] { "open".to_owned() } else { unit.width(outcome.half_width(knot)) };
        let time_s = words::trimmed(words::grouped(outcome.times_s[knot], 2));
        [time_s, unit.value(outcome.values[knot]), half, unit.value(outcome.own[knot])]
    };
    picked.map(cells).collect()
}

/// One line of them on the screen.
pub(super) fn row(cells: &[impl AsRef<str>; 4]) -> String {
    let [time, value, half, own] = cells.each_ref().map(AsRef::as_ref);
    format!("{time:>9}{value:>14}{half:>10}{own:>21}")
}

/// The instants of the knots that are not determined.
fn open(outcome: &History) -> Vec<String> {
    let knots = (0..outcome.times_s.len()).filter(|&knot| outcome.undetermined[knot]);
    knots.map(|knot| words::seconds(outcome.times_s[knot])).collect()
}

/// The answer: how much heat or how hot a gas, how strong at most, and how far from what the case says.
pub(super) fn found(story: &Story, outcome: &History) -> String {
    let unit = unit(outcome.sought);
    let sensors: Vec<&str> = outcome.seen.iter().map(|seen| story.case.sensors[seen.sensor].name.as_str()).collect();
    let (peak, at_s) = outcome
        .values
        .iter()
        .zip(&outcome.times_s)
        .fold((0.0, 0.0), |peak, (&value, &time_s)| if value > peak.0 { (value, time_s) } else { peak });
    let have = if sensors.len() == 1 { "has" } else { "have" };
    let (sensors, during) = (words::listed(&sensors), words::seconds(outcome.end_s));
    let (found, deviation, own) = (outcome.integral, outcome.integral_deviation, outcome.integral_own);
    let left_out = match &open(outcome)[..] {
        [] => String::new(),
        knots => format!(", which leaves out the {} at {}, undetermined", unit.noun, words::listed(knots)),
    };
    let highest = format!("at most by {} at {}", unit.with_unit(peak), words::seconds(at_s));
    if outcome.sought == Sought::Gas {
        let mean = |integral: f64| integral / outcome.end_s;
        let less = mean(found) - mean(own);
        return format!(
            "As {sensors} {have} it, the gas was at {} ± {} K on average (95 %{left_out}) over {during}, {} K {} than the case \
             says, and {} K at the hottest, at {}.",
            unit.value(mean(found)),
            words::significant(1.96 * mean(deviation), 2),
            words::significant(less.abs(), 2),
            if less < 0.0 { "less" } else { "more" },
            unit.value(peak),
            words::seconds(at_s)
        );
    }
    let beside = if own > 0.0 {
        let more = found / own - 1.0;
        let way = if more < 0.0 { "less" } else { "more" };
        format!(", {} % {way} than the case says", words::significant(100.0 * more.abs(), 2))
    } else {
        String::new()
    };
    let of =
        if outcome.sought == Sought::RadiantFlux { "the face was irradiated by" } else { "the face was heated by" };
    format!(
        "As {sensors} {have} it, {of} {} ± {} MJ/m² (95 %{left_out}) in {during}{beside}, {highest}.",
        words::significant(1e-6 * found, 3),
        words::significant(1.96e-6 * deviation, 2),
    )
}

/// How smooth the history is, and by what that was chosen.
pub(super) fn chosen(outcome: &History) -> String {
    let rms = words::significant(outcome.rung.rms, 3);
    let why = match outcome.chosen {
        Chosen::Discrepancy => format!(
            "It is as smooth as the noise lets it be: residuals are {rms} of their standard deviations, root mean square, and \
             would be more of anything smoother."
        ),
        Chosen::Straight => format!(
            "Straight lines between the sharp corners meet the data within their noise ({rms} of their standard deviations, root \
             mean square): nothing in them asks for a bend, and weaker smoothing would only follow noise."
        ),
        Chosen::Unmet => format!(
            "No history meets the data within their noise: even with next to no smoothing residuals are {} of their standard deviations, \
             root mean square. So what no history explains is taken for the noise, and this one is as \
             smooth as that lets it be, at {rms}.",
            words::significant(outcome.rungs.iter().map(|rung| rung.rms).fold(f64::INFINITY, f64::min), 3)
        ),
        Chosen::LCurve => format!(
            "The smoothing is that of the corner of the L-curve, with residuals of {rms} standard deviations, root mean square."
        ),
        Chosen::Stated => {
            format!("The smoothing was stated; residuals are {rms} of their standard deviations, root mean square.")
        }
    };
    format!(
        "{why} Of {} values the data determine {}, smoothness the others.",
        words::count(outcome.times_s.len()),
        words::significant(outcome.determined, 2)
    )
}

/// What the band is and is not.
pub(super) fn left_out() -> &'static str {
    "At each knot the band holds 95 % of what other noise would have made of the same heating. What smoothing takes off peaks, and what is wrong \
     with properties, depths or physics, is not in it."
}

/// Reasons for doubt.
pub(super) fn doubts(story: &Story, outcome: &History, doubts: &mut Vec<String>) {
    if outcome.chosen == Chosen::Unmet {
        doubts.push(
            "No heating explains the data within their noise: either the noise is larger than stated (--set \
             observations.sigma=...), or the case lacks something, and the flux found makes up for it."
                .to_owned(),
        );
    }
    if !outcome.converged {
        doubts.push(format!("The history is not the least there is: {}.", outcome.termination));
    }
    let unit = unit(outcome.sought);
    let open = open(outcome);
    if !open.is_empty() {
        doubts.push(format!(
            "The data do not determine the {} at {}: noise alone makes more of it than the largest value found, or nothing moves \
             with it, as where a blown flux is small. The integral and its ± take the values found there as they are.",
            unit.noun,
            words::listed(&open)
        ));
    }
    let beyond = |&knot: &usize| outcome.smoothed[knot].abs() > outcome.half_width(knot) && !outcome.undetermined[knot];
    let worst = (0..outcome.times_s.len())
        .filter(beyond)
        .max_by(|&a, &b| outcome.smoothed[a].abs().total_cmp(&outcome.smoothed[b].abs()));
    if let Some(knot) = worst {
        let by = format!("{} {}", unit.width(outcome.smoothed[knot].abs()), unit.unit);
        let is_off = outcome.smoothed[knot] > 0.0;
        let moved = if is_off { format!("takes {by} off") } else { format!("puts {by} onto") };
        doubts.push(format!(
            "At {} smoothing {moved} the {}, more than the band is wide: bends as short as that are not to be trusted.",
            words::seconds(outcome.times_s[knot]),
            unit.noun
        ));
    }
    if outcome.end_s < story.case.exposure.duration_s {
        doubts.push(format!(
            "After {}, the end of the window, nothing was sought: history.csv goes on as the case has it.",
            words::seconds(outcome.end_s)
        ));
    }
}
