//! Findings on decomposition and gas flow.
//!
//! The depth of a front is zero before it leaves the hot face and after it has passed the back face. Its peak tells
//! whether there ever was a front.

pub(super) mod figures;

use crate::case::{Case, GasFlowModel};
use crate::report::format;
use crate::study::nominal::{GaugeTrace, Prediction};
use crate::traces::{Balance, Gauge};

/// Whether a ply can decompose.
pub(super) fn decomposes(case: &Case) -> bool {
    case.layup.plies.iter().any(|ply| ply.material.decomposition.is_some())
}

/// Whether the pressure in the layup is computed, by Darcy's law.
pub(super) fn has_darcy_flow(case: &Case) -> bool {
    case.gas.as_ref().is_some_and(|gas| gas.model == GasFlowModel::Darcy)
}

/// The finding; `None` where no gas moves.
pub(super) fn finding(case: &Case, outcome: &Prediction) -> Option<String> {
    // A march that failed has no values.
    let flux = outcome.gauge_trace(Gauge::GasFlux).filter(|flux| !flux.peak.is_nan())?;
    let way = if flux.peak < 0.0 { " into the layup" } else { "" };
    let flow = format!("gas flux {}{way} at {}", flux_text(flux), format::seconds(flux.peak_time_s));
    if !decomposes(case) {
        return Some(format!("Peak {flow}."));
    }
    let lost = outcome.gauge_trace(Gauge::MassLost)?;
    let char = final_depth(outcome.gauge_trace(Gauge::CharFront)?);
    Some(format!("Mass lost {}, peak {flow}; final char depth {char}.", mass_text(lost.end)))
}

pub(super) fn flux_caption(reading: &GaugeTrace) -> String {
    let way = if reading.peak < 0.0 { "into the layup" } else { "outwards" };
    if reading.peak == 0.0 {
        return "The gas flux through the hot face is zero.".to_owned();
    }
    format!(
        "The gas flux through the hot face peaks at {} ({way}) at {}.",
        flux_text(reading),
        format::seconds(reading.peak_time_s)
    )
}

pub(super) fn mass_lost_caption(reading: &GaugeTrace) -> String {
    format!("Final mass of solid converted to gas: {}.", mass_text(reading.end))
}

pub(super) fn fronts_caption(virgin: &GaugeTrace, char: &GaugeTrace) -> String {
    format!(
        "Conversion (mass lost over mass that can be lost) is at least 98 % above the char front and below 2 % below \
         the virgin front. Final depths: char front {}, virgin front {}.",
        final_depth(char),
        final_depth(virgin)
    )
}

pub(super) fn pressure_caption(largest: &GaugeTrace, back: &GaugeTrace) -> String {
    let kilopascals =
        |pressure_pa: f64| format!("{} kPa", format::trim_zeros(format::significant(1e-3 * pressure_pa, 4)));
    format!(
        "The pressure in the layup peaks at {} at {}; at the back face it peaks at {}.",
        kilopascals(largest.peak),
        format::seconds(largest.peak_time_s),
        kilopascals(back.peak)
    )
}

/// The mass balance, and the terms of gas and reactions in the energy balance.
pub(super) fn mass_balance(total: &Balance) -> String {
    let stored = if total.gas_stored_kg_m2 < 0.0 { "less" } else { "more" };
    let mass = format!(
        "Mass balance: solid converted to gas {}, gas in {}, gas out {}, gas in the pores {} {stored} than at the \
         start; relative residual {}.",
        mass_text(total.solid_lost_kg_m2),
        mass_text(total.gas_in_kg_m2),
        mass_text(total.gas_out_kg_m2),
        mass_text(total.gas_stored_kg_m2.abs()),
        format::significant(total.mass_residual(), 2)
    );
    let moved = [
        (total.gas_heat_j_m2, "removed by gas", "brought by gas"),
        (total.reaction_gain_j_m2, "released by reactions", "absorbed by reactions"),
    ];
    let heat: Vec<String> = moved
        .into_iter()
        .filter(|(heat_j_m2, ..)| *heat_j_m2 != 0.0)
        .map(|(heat_j_m2, above, below)| {
            let how = if heat_j_m2 < 0.0 { below } else { above };
            format!("{} MJ/m² {how}", format::significant(1e-6 * heat_j_m2.abs(), 3))
        })
        .collect();
    if heat.is_empty() { mass } else { format!("{mass} The energy balance includes {}.", format::list(&heat)) }
}

/// Final depth of a front: `3.84 mm`.
fn final_depth(front: &GaugeTrace) -> String {
    if front.end > 0.0 { format!("{} mm", format::significant(1e3 * front.end, 3)) } else { "none".to_owned() }
}

fn flux_text(reading: &GaugeTrace) -> String {
    format!("{} kg/m²/s", format::significant(reading.peak.abs(), 3))
}

fn mass_text(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", format::significant(mass_kg_m2, 3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marched;

    /// A charring layup with these readings.
    fn charring() -> marched::Study {
        let mut outcomes = marched::charring();
        let gauges = &mut outcomes.nominal.gauge_traces;
        let flux = &mut gauges[Gauge::GasFlux as usize];
        (flux.peak, flux.peak_time_s) = (0.009, 40.0);
        (gauges[Gauge::MassLost as usize].end, gauges[Gauge::CharFront as usize].end) = (0.36, 2.5e-3);
        outcomes
    }

    fn text(outcomes: &marched::Study) -> String {
        finding(&outcomes.case, &outcomes.nominal).expect("gas moves")
    }

    #[test]
    fn a_charring_layup_has_a_finding_with_mass_lost_gas_flux_and_char_depth_and_another_has_none() {
        let outcomes = marched::study();
        assert_eq!(finding(&outcomes.case, &outcomes.nominal), None);
        let charring = text(&charring());
        let truth = "Mass lost 0.360 kg/m², peak gas flux 0.00900 kg/m²/s at 40 s; final char depth 2.50 mm.";
        assert_eq!(charring, truth);
    }

    #[test]
    fn without_a_front_there_is_no_final_depth() {
        let mut outcomes = charring();
        let front = outcomes.nominal.gauge_traces.iter_mut().find(|reading| reading.gauge == Gauge::CharFront);
        let front = front.expect("a char front");
        (front.peak, front.end) = (0.0, 0.0);
        assert!(text(&outcomes).ends_with("final char depth none."));
    }

    #[test]
    fn a_negative_gas_flux_is_reported_as_into_the_layup() {
        let mut outcomes = charring();
        outcomes.nominal.gauge_traces[0].peak = -0.002;
        outcomes.case.layup = marched::study().case.layup;
        assert_eq!(text(&outcomes), "Peak gas flux 0.00200 kg/m²/s into the layup at 40 s.");
        assert!(flux_caption(&outcomes.nominal.gauge_traces[0]).ends_with("0.00200 kg/m²/s (into the layup) at 40 s."));
    }

    #[test]
    fn the_mass_balance_reports_its_residual_and_the_heat_of_gas_and_reactions() {
        let balance_of = Balance {
            solid_lost_kg_m2: 0.36,
            gas_in_kg_m2: 0.002,
            gas_out_kg_m2: 0.358,
            gas_stored_kg_m2: 0.004,
            gas_heat_j_m2: 0.0,
            reaction_gain_j_m2: 0.0,
            ..marched::charring().nominal.balance
        };
        assert!(mass_balance(&balance_of).contains("gas out 0.358 kg/m², gas in the pores 0.00400 kg/m² more"));
        assert!(!mass_balance(&balance_of).contains("energy"), "gas that carries no heat is no term of it");
        let leaking = mass_balance(&Balance { gas_out_kg_m2: 0.286, reaction_gain_j_m2: -2e5, ..balance_of });
        assert!(leaking.contains("; relative residual 0.20."), "{leaking}");
        assert!(leaking.ends_with("energy balance includes 0.200 MJ/m² absorbed by reactions."), "{leaking}");
        let emptied = mass_balance(&Balance { gas_stored_kg_m2: -0.002, gas_heat_j_m2: -3e4, ..balance_of });
        assert!(emptied.contains("gas in the pores 0.00200 kg/m² less"), "{emptied}");
        assert!(emptied.ends_with("0.0300 MJ/m² brought by gas."), "{emptied}");
    }
}
