//! What is said of a flux that was recovered.

use super::{Story, words};
use crate::study::history::{Chosen, History};

/// W/m² in a W/cm².
pub(super) const W_CM2: f64 = 1e-4;

/// Cells of the table of knots.
pub(super) const HEAD: [&str; 4] = ["Time, s", "Flux, W/cm²", "± 95 %", "As the case has it"];

fn flux(flux_w_m2: f64) -> String {
    words::significant(flux_w_m2 * W_CM2, 3)
}

/// The knots in order; at most so many, evenly picked.
pub(super) fn rows(outcome: &History, most: usize) -> Vec<[String; 4]> {
    let last = outcome.times_s.len() - 1;
    let rows = most.min(last + 1);
    let picked = (0..rows).map(|row| row * last / (rows - 1));
    let cells = |knot: usize| {
        let half = if outcome.is_open(knot) { "open".to_owned() } else { flux(outcome.half_width_w_m2(knot)) };
        let time_s = words::trimmed(words::grouped(outcome.times_s[knot], 2));
        [time_s, flux(outcome.flux_w_m2[knot]), half, flux(outcome.own_w_m2[knot])]
    };
    picked.map(cells).collect()
}

/// One line of them on the screen.
pub(super) fn row(cells: &[impl AsRef<str>; 4]) -> String {
    let [time, flux, half, own] = cells.each_ref().map(AsRef::as_ref);
    format!("{time:>9}{flux:>14}{half:>10}{own:>21}")
}

/// The answer: how much heat, how strong, and how far from what the case says.
pub(super) fn found(story: &Story, outcome: &History) -> String {
    let sensors: Vec<&str> = outcome.seen.iter().map(|seen| story.case.sensors[seen.sensor].name.as_str()).collect();
    let (peak, at_s) = outcome
        .flux_w_m2
        .iter()
        .zip(&outcome.times_s)
        .fold((0.0, 0.0), |peak, (&value, &time_s)| if value > peak.0 { (value, time_s) } else { peak });
    let beside = if outcome.fluence_own_j_m2 > 0.0 {
        let more = outcome.fluence_j_m2 / outcome.fluence_own_j_m2 - 1.0;
        let way = if more < 0.0 { "less" } else { "more" };
        format!(", {} % {way} than the case says", words::significant(100.0 * more.abs(), 2))
    } else {
        String::new()
    };
    format!(
        "As {} {} it, the face was heated by {} ± {} MJ/m² (95 %) in {}{beside}, at most by {} W/cm² at {}.",
        words::listed(&sensors),
        if sensors.len() == 1 { "has" } else { "have" },
        words::significant(1e-6 * outcome.fluence_j_m2, 3),
        words::significant(1.96e-6 * outcome.fluence_deviation_j_m2, 2),
        words::seconds(outcome.end_s),
        flux(peak),
        words::seconds(at_s)
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
    "The band holds 95 % of what other noise would have made of the same heating. What smoothing takes off peaks, and what is wrong \
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
    let open: Vec<String> = (0..outcome.times_s.len())
        .filter(|&knot| outcome.is_open(knot))
        .map(|knot| words::seconds(outcome.times_s[knot]))
        .collect();
    if !open.is_empty() {
        doubts.push(format!(
            "The data say next to nothing of the flux at {}: noise alone makes more of it than the largest flux found.",
            words::listed(&open)
        ));
    }
    let beyond =
        |&knot: &usize| outcome.smoothed_w_m2[knot].abs() > outcome.half_width_w_m2(knot) && !outcome.is_open(knot);
    let worst = (0..outcome.times_s.len())
        .filter(beyond)
        .max_by(|&a, &b| outcome.smoothed_w_m2[a].abs().total_cmp(&outcome.smoothed_w_m2[b].abs()));
    if let Some(knot) = worst {
        let by = flux(outcome.smoothed_w_m2[knot].abs());
        let is_off = outcome.smoothed_w_m2[knot] > 0.0;
        let moved = if is_off { format!("takes {by} W/cm² off") } else { format!("puts {by} W/cm² onto") };
        doubts.push(format!(
            "At {} smoothing {} the flux, more than the band is wide: bends as short as that are not to be trusted.",
            words::seconds(outcome.times_s[knot]),
            moved
        ));
    }
    if outcome.end_s < story.case.exposure.duration_s {
        doubts.push(format!(
            "After {}, the end of the window, nothing was sought: history.csv goes on as the case has it.",
            words::seconds(outcome.end_s)
        ));
    }
}
