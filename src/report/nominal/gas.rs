//! What decomposition and gas did, in sentences.
//!
//! A gauge of a front reads zero where there is no such front between the faces: before it sets out from the hot
//! face, and once it has gone through the back. What is lost stays lost, so the one is told from the other by
//! whether there was ever a front.

pub(super) mod figures;

use crate::case::{Case, GasPath};
use crate::report::words;
use crate::study::nominal::{Nominal, Reading};
use crate::traces::{Balance, Gauge};

/// Whether some ply can turn into gas.
pub(super) fn decomposes(case: &Case) -> bool {
    case.layup.plies.iter().any(|ply| ply.material.decomposition.is_some())
}

/// Whether pressure in the layup is anything but that outside.
pub(super) fn is_driven(case: &Case) -> bool {
    case.gas.as_ref().is_some_and(|gas| gas.path == GasPath::Darcy)
}

/// All of it in a sentence; `None` where no gas moves.
pub(super) fn found(case: &Case, outcome: &Nominal) -> Option<String> {
    let flux = outcome.reading(Gauge::GasFlux)?;
    let way = if flux.peak < 0.0 { " inwards" } else { "" };
    let flow = format!("gas flux {}{way} at {}", flux_words(flux), words::seconds(flux.peak_time_s));
    if !decomposes(case) {
        return Some(format!("Peak {flow}."));
    }
    let lost = outcome.reading(Gauge::MassLost)?;
    let char = ended(outcome.reading(Gauge::CharFront)?);
    Some(format!("Mass lost {}, peak {flow}; the char front ended {char}.", mass_words(lost.end)))
}

pub(super) fn flux(reading: &Reading) -> String {
    let way = if reading.peak < 0.0 { "into the layup" } else { "out" };
    if reading.peak == 0.0 {
        return "No gas passes the hot face.".to_owned();
    }
    format!(
        "Gas flows through the hot face fastest at {}, {} {way}.",
        words::seconds(reading.peak_time_s),
        flux_words(reading)
    )
}

pub(super) fn lost(reading: &Reading) -> String {
    format!("By the end {} of solid has turned into gas.", mass_words(reading.end))
}

pub(super) fn fronts(virgin: &Reading, char: &Reading) -> String {
    format!(
        "Above the char front at least 98 % of what can be lost is lost, below the virgin front less than 2 %: the one ended \
         {}, the other {}.",
        ended(char),
        ended(virgin)
    )
}

pub(super) fn pressure(largest: &Reading, back: &Reading) -> String {
    let kilopascals = |pressure_pa: f64| format!("{} kPa", words::trimmed(words::significant(1e-3 * pressure_pa, 4)));
    format!(
        "The largest pressure in the layup peaks at {}, at {}; that at the back face reaches {}.",
        kilopascals(largest.peak),
        words::seconds(largest.peak_time_s),
        kilopascals(back.peak)
    )
}

/// Where the mass went, and what gas and reactions have to do with the balance of energy.
pub(super) fn balance(kept: &Balance) -> String {
    let stored = if kept.gas_stored_kg_m2 < 0.0 { "less" } else { "more" };
    let mass = format!(
        "Mass: {} of solid turned into gas, {} of gas came in, {} went out and {} {stored} is in the pores than at the \
         start; {} of what moved is unaccounted for.",
        mass_words(kept.solid_lost_kg_m2),
        mass_words(kept.gas_in_kg_m2),
        mass_words(kept.gas_out_kg_m2),
        mass_words(kept.gas_stored_kg_m2.abs()),
        words::significant(kept.mass_residual(), 2)
    );
    let moved = [
        (kept.gas_heat_j_m2, "that gas took along", "that gas brought"),
        (kept.reaction_gain_j_m2, "that reactions gave", "that reactions took up"),
    ];
    let heat: Vec<String> = moved
        .into_iter()
        .filter(|(heat_j_m2, ..)| *heat_j_m2 != 0.0)
        .map(|(heat_j_m2, above, below)| {
            let how = if heat_j_m2 < 0.0 { below } else { above };
            format!("{} MJ/m² {how}", words::significant(1e-6 * heat_j_m2.abs(), 3))
        })
        .collect();
    if heat.is_empty() { mass } else { format!("{mass} The residual of energy also counts {}.", words::listed(&heat)) }
}

/// Where a front ended: `at 3.84 mm`.
fn ended(front: &Reading) -> String {
    if front.end > 0.0 { format!("at {} mm", words::significant(1e3 * front.end, 3)) } else { "nowhere".to_owned() }
}

fn flux_words(reading: &Reading) -> String {
    format!("{} kg/m²/s", words::significant(reading.peak.abs(), 3))
}

fn mass_words(mass_kg_m2: f64) -> String {
    format!("{} kg/m²", words::significant(mass_kg_m2, 3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    fn said(outcomes: &fixture::Outcomes) -> String {
        found(&outcomes.case, &outcomes.nominal).expect("gas moves")
    }

    #[test]
    fn a_layup_that_chars_is_told_with_its_loss_its_gas_and_its_front_and_one_that_does_not_with_nothing() {
        let outcomes = fixture::outcomes();
        assert_eq!(found(&outcomes.case, &outcomes.nominal), None);
        let charring = said(&outcomes.charring());
        let truth = "Mass lost 0.360 kg/m², peak gas flux 0.00900 kg/m²/s at 40 s; the char front ended at 2.50 mm.";
        assert_eq!(charring, truth);
    }

    #[test]
    fn a_front_that_never_was_ended_nowhere() {
        let mut outcomes = fixture::outcomes().charring();
        let front = outcomes.nominal.readings.iter_mut().find(|reading| reading.gauge == Gauge::CharFront);
        let front = front.expect("a char front");
        (front.peak, front.end) = (0.0, 0.0);
        assert!(said(&outcomes).ends_with("ended nowhere."));
    }

    #[test]
    fn gas_that_is_driven_in_is_said_to_flow_in() {
        let mut outcomes = fixture::outcomes().charring();
        outcomes.nominal.readings[0].peak = -0.002;
        outcomes.case.layup = fixture::outcomes().case.layup;
        assert_eq!(said(&outcomes), "Peak gas flux 0.00200 kg/m²/s inwards at 40 s.");
        assert!(flux(&outcomes.nominal.readings[0]).ends_with("0.00200 kg/m²/s into the layup."));
    }

    #[test]
    fn the_balance_of_mass_says_what_is_missing() {
        let balance_of = fixture::outcomes().charring().nominal.balance;
        assert!(balance(&balance_of).contains("0.358 kg/m² went out and 0.00400 kg/m² more is in the pores"));
        assert!(!balance(&balance_of).contains("energy"), "gas that carries nothing has no part in it");
        let leaking = balance(&Balance { gas_out_kg_m2: 0.286, reaction_gain_j_m2: -2e5, ..balance_of });
        assert!(leaking.contains("; 0.20 of what moved is unaccounted for."), "{leaking}");
        assert!(leaking.ends_with("energy also counts 0.200 MJ/m² that reactions took up."), "{leaking}");
        let emptied = balance(&Balance { gas_stored_kg_m2: -0.002, gas_heat_j_m2: -3e4, ..balance_of });
        assert!(emptied.contains("0.00200 kg/m² less is in the pores"), "{emptied}");
        assert!(emptied.ends_with("0.0300 MJ/m² that gas brought."), "{emptied}");
    }
}
