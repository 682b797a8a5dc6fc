//! What an analyst should doubt before using an outcome.

use super::{Story, history, posterior, recovery, sizing, words};
use crate::case::{Case, Conductivity, Emissivity, Face, Material, Ply};
use crate::study::estimate::Estimated;
use crate::study::nominal::Nominal;
use crate::traces::Arrival;

/// A march whose heat, or mass, in, out and stored differ by more than this share of what moved is not trusted.
const BALANCE: f64 = 1e-3;
/// Tables that begin at room temperature are often left by a few kelvin, over which no property changes.
const EXCURSION_K: f64 = 10.0;
/// Beyond this a per cent of model error may be tens of per cent of an estimate (the range 30 to 100 marks
/// strong dependence in Belsley, Kuh & Welsch, *Regression Diagnostics*, 1980).
const CONDITION: f64 = 50.0;
/// Beyond this ratio stated deviations and residuals disagree.
const DISAGREE: f64 = 2.0;
/// Residuals whose neighbours correlate so are a pattern, not noise.
const AUTOCORRELATION: f64 = 0.5;

/// Every reason for doubt in a story, each a sentence or two.
pub(super) fn all(story: &Story) -> Vec<String> {
    let mut doubts = Vec::new();
    if let Some(nominal) = story.nominal_march() {
        march(story.case, nominal, "nominal", &mut doubts);
    }
    if let Some(outcome) = story.uncertainty {
        for failure in &outcome.failures {
            doubts.push(format!(
                "{} of {} failed ({}), the first being member {}; they are left out of every statistic.",
                words::count(failure.members),
                words::counted(outcome.asked, "member"),
                failure.reason,
                words::count(failure.first)
            ));
        }
    }
    if let Some(outcome) = story.sizing {
        sizing::doubts(story, outcome, &mut doubts);
    }
    if let Some(outcome) = story.history {
        history::doubts(story, outcome, &mut doubts);
    }
    if let Some(outcome) = story.recovery {
        recovery::doubts(outcome, &mut doubts);
    }
    if let Some(outcome) = story.sensitivity
        && !outcome.proposed.factors.is_empty()
        && outcome.proposed.condition_number > CONDITION
    {
        doubts.push(format!(
            "Even the proposed set is ill-conditioned (condition number {}). The weakest direction: {}.",
            words::condition(outcome.proposed.condition_number),
            outcome.proposed.weakest
        ));
    }
    if let Some(outcome) = story.estimated {
        estimate(story, outcome, &mut doubts);
        for (case, fitted) in story.fits(outcome) {
            march(case, &fitted.after, "fitted", &mut doubts);
        }
        for (case, fitted) in story.fits(outcome).skip(1) {
            march(case, &fitted.before, "nominal", &mut doubts);
            excursions(case, &[&fitted.before, &fitted.after], &mut doubts);
        }
    }
    doubts.extend(story.posterior.iter().flat_map(|outcome| posterior::doubts(story, outcome)));
    let fitted = story.estimated.and_then(|outcome| outcome.fitted.first()).map(|fitted| &fitted.after);
    let marches: Vec<&Nominal> = story.nominal_march().into_iter().chain(fitted).collect();
    excursions(story.case, &marches, &mut doubts);
    doubts
}

/// The materials of a layup whose figures stand in for others, once each.
pub(super) fn surrogates(case: &Case) -> Vec<&Material> {
    let mut found: Vec<&Material> = Vec::new();
    for ply in &case.layup.plies {
        let stands_in = ply.material.note.to_lowercase().contains("surrogate");
        if stands_in && found.iter().all(|material| material.id != ply.material.id) {
            found.push(&ply.material);
        }
    }
    found
}

fn march(case: &Case, outcome: &Nominal, which: &str, doubts: &mut Vec<String>) {
    match &outcome.arrival {
        Arrival::Done => {}
        Arrival::Strayed { time_s } => doubts.push(format!(
            "The {which} march ran away at {}: nothing after that can be used.",
            words::seconds(*time_s)
        )),
        Arrival::LeftTable { ply, temperature_k } => doubts.push(format!(
            "The {which} march left a property table of ply {} at {}, and that table refuses to be left.",
            case.layup.plies[*ply].name,
            words::kelvin(*temperature_k)
        )),
    }
    if let Some(reached) = outcome.reached.as_ref().filter(|reached| reached.nominal_k > reached.tolerance_k) {
        doubts.push(format!(
            "The {which} march is off by {} K somewhere, more than the {} K asked for: state cells and steps under [resolution].",
            words::significant(reached.nominal_k, 2),
            words::significant(reached.tolerance_k, 2)
        ));
    }
    let gauges = outcome.reached.iter().flat_map(|reached| &reached.gauges);
    for gauge in gauges.filter(|gauge| gauge.error > gauge.tolerance) {
        doubts.push(format!(
            "The {which} march has an estimated error of the {} of {}, more than the tolerance of {}.",
            words::gauge_word(gauge.gauge),
            words::gauge_error(gauge.gauge, gauge.error),
            words::gauge_error(gauge.gauge, gauge.tolerance)
        ));
    }
    let residual = outcome.balance.residual();
    if residual.abs() > BALANCE {
        doubts.push(format!(
            "The energy of the {which} march does not balance: {} of the heat that moved is unaccounted for, where \
             {} is the limit. Refine the steps or the cells.",
            words::significant(residual, 2),
            words::significant(BALANCE, 1)
        ));
    }
    let residual = outcome.balance.mass_residual();
    if residual.abs() > BALANCE {
        doubts.push(format!(
            "The mass of the {which} march does not balance: {} of what moved is unaccounted for, where {} is the limit. \
             Refine the steps or the cells.",
            words::significant(residual, 2),
            words::significant(BALANCE, 1)
        ));
    }
}

/// A property of a ply beyond the temperatures for which it was measured.
struct Excursion<'a> {
    ply: &'a Ply,
    is_above: bool,
    property: &'static str,
    /// Where its table ends, and what was met, K.
    bound_k: f64,
    met_k: f64,
}

/// Materials that met temperatures, in any of the marches, for which a property was not measured.
fn excursions(case: &Case, marches: &[&Nominal], doubts: &mut Vec<String>) {
    let mut left: Vec<Excursion<'_>> = Vec::new();
    for (index, ply) in case.layup.plies.iter().enumerate() {
        let met = marches.iter().filter_map(|march| march.extremes_k.get(index));
        let Some((coldest_k, hottest_k)) = met.copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { continue };
        for (property, (low_k, high_k)) in known(case, index) {
            if hottest_k > high_k + EXCURSION_K {
                left.push(Excursion { ply, is_above: true, property, bound_k: high_k, met_k: hottest_k });
            }
            if coldest_k < low_k - EXCURSION_K {
                left.push(Excursion { ply, is_above: false, property, bound_k: low_k, met_k: coldest_k });
            }
        }
    }
    // Plies of one material are told together.
    while let Some(first) = left.first() {
        let (id, is_above) = (first.ply.material.id.clone(), first.is_above);
        let alike = |other: &Excursion<'_>| other.ply.material.id == id && other.is_above == is_above;
        let (together, others): (Vec<_>, Vec<_>) = left.into_iter().partition(alike);
        doubts.push(told(&together));
        left = others;
    }
}

/// Excursions of one material in one direction, in a sentence.
fn told(together: &[Excursion<'_>]) -> String {
    let (mut plies, mut tables): (Vec<&str>, Vec<String>) = (Vec::new(), Vec::new());
    for left in together {
        let ends = if left.is_above { "ends" } else { "begins" };
        let table = format!("{} {ends} at {} K", left.property, words::grouped(left.bound_k, 0));
        if !plies.contains(&left.ply.name.as_str()) {
            plies.push(&left.ply.name);
        }
        if !tables.contains(&table) {
            tables.push(table);
        }
    }
    let farthest = together.iter().max_by(|a, b| (a.met_k - a.bound_k).abs().total_cmp(&(b.met_k - b.bound_k).abs()));
    let (material, met_k) = farthest.map_or(("", f64::NAN), |left| (left.ply.material.name.as_str(), left.met_k));
    format!(
        "{material} ({}) met {}, beyond its tables: {}.",
        words::listed(&plies),
        words::kelvin(met_k),
        words::listed(&tables)
    )
}

/// The properties of a ply that act, and the temperatures between which each is known, K.
fn known(case: &Case, index: usize) -> Vec<(&'static str, (f64, f64))> {
    let material = &case.layup.plies[index].material;
    let conductivity = match &material.conductivity {
        Conductivity::Tables(tables) => tables
            .iter()
            .map(|(_, table)| table.range_k())
            .reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))
            .unwrap_or((f64::NEG_INFINITY, f64::INFINITY)),
        Conductivity::Parts(parts) => parts.range_k,
    };
    let mut known = vec![("conductivity", conductivity), ("heat capacity", material.heat_capacity.range_k())];
    let radiates = |face: &Face| matches!(face, Face::Open(open) if open.emissivity == Emissivity::Material);
    let (hot, back) = (index == 0, index + 1 == case.layup.plies.len());
    if (hot && radiates(&case.exposure.hot_face)) || (back && radiates(&case.exposure.back_face)) {
        known.push(("emissivity", material.emissivity.range_k()));
    }
    known
}

fn estimate(story: &Story, outcome: &Estimated, doubts: &mut Vec<String>) {
    if !outcome.converged {
        doubts.push(format!("The estimate did not converge ({}). {}", outcome.termination, outcome.advice));
    }
    for (index, factor) in outcome.factors.iter().enumerate() {
        let (low, high) = factor.bounds;
        if outcome.at_bound[index] {
            doubts.push(format!(
                "{} stands on its bound at {:.3} (allowed {low:.2} to {high:.2}): the data want it beyond, or the \
                 model lacks something.",
                factor.factor.name, outcome.values[index]
            ));
        }
    }
    combinations(outcome, doubts);
    let set = &outcome.identifiability;
    if set.condition_number > CONDITION {
        doubts.push(format!(
            "The estimate is ill-conditioned (condition number {}). The weakest direction: {}.",
            words::condition(set.condition_number),
            set.weakest
        ));
    }
    let ratio = outcome.noise_variance.sqrt();
    if ratio > DISAGREE || (ratio < 1.0 / DISAGREE && is_seen(story, outcome)) {
        let used = if outcome.prior.is_some() {
            format!(
                " Beside the priors the data count with {} times their deviations.",
                words::significant(outcome.shortfall, 2)
            )
        } else {
            String::new()
        };
        doubts.push(format!(
            "Stated deviations and residuals disagree: the residuals are {} times as large.{used}",
            words::significant(ratio, 2)
        ));
    }
    if outcome.autocorrelation > AUTOCORRELATION && is_seen(story, outcome) {
        doubts.push(format!(
            "The residuals are not noise: neighbours correlate by {}, so {} carry the information of {}. The model \
             lacks something; standard errors and intervals allow for it.",
            words::significant(outcome.autocorrelation, 2),
            words::counted(outcome.samples, "sample"),
            words::significant(outcome.effective_samples, 2)
        ));
    }
}

/// Whether residuals are large enough to matter: a tenth of the standard deviation of the measurement, at one sensor
/// at least. Data made without noise leave rounding, and rounding has patterns.
fn is_seen(story: &Story, outcome: &Estimated) -> bool {
    story.fits(outcome).any(|(case, fitted)| {
        let seen = case.observations.iter().filter(|seen| fitted.sensors.contains(&seen.sensor));
        seen.zip(&fitted.misfits).any(|(seen, (_, after))| {
            let finest_k = seen.sigma_k.iter().copied().fold(f64::INFINITY, f64::min);
            after.rms_k > 0.1 * finest_k
        })
    })
}

/// Estimates that stand in each other's way, and what the data determine in their place.
fn combinations(outcome: &Estimated, doubts: &mut Vec<String>) {
    let name = |place: usize| outcome.factors[place].factor.name.as_str();
    for found in &outcome.combinations {
        let (first, second) = (name(found.pair.0), name(found.pair.1));
        let correlate = format!(
            "The estimates of {first} and {second} correlate by {}: neither stands alone.",
            words::significant(found.correlation, 3)
        );
        let (noun, sign) = if found.is_ratio { ("ratio", "/") } else { ("product", "·") };
        doubts.push(if found.relative_error.is_finite() {
            format!(
                "{correlate} Their {noun} {first}{sign}{second}, {} ± {} %, is what the data determine.",
                words::significant(found.value, 3),
                words::significant(100.0 * found.relative_error, 1)
            )
        } else {
            format!("{correlate} The data determine their {noun} alone.")
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;

    /// How many doubts of a study say this.
    fn saying(outcomes: &fixture::Outcomes, text: &str) -> usize {
        all(&outcomes.story("study")).iter().filter(|doubt| doubt.contains(text)).count()
    }

    #[test]
    fn each_fault_of_an_estimate_is_doubted_once_and_a_sound_one_not_at_all() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "correlate by 0.993"), 1);
        assert_eq!(saying(&outcomes, "Their ratio f_k_INS/f_cp_INS, 0.951 ± 0.3 %, is what the data determine."), 1);
        assert_eq!(saying(&outcomes, "not noise"), 1);
        for fault in ["bound", "converge", "ill-conditioned", "balance", "ran away"] {
            assert_eq!(saying(&outcomes, fault), 0, "{fault}");
        }
        outcomes.estimated.at_bound[0] = true;
        outcomes.estimated.converged = false;
        outcomes.estimated.identifiability.condition_number = 400.0;
        outcomes.estimated.fitted[0].after.arrival = Arrival::Strayed { time_s: 12.0 };
        outcomes.nominal.balance.back_out_j_m2 *= 1.2;
        for fault in ["bound", "converge", "ill-conditioned", "balance", "ran away"] {
            assert_eq!(saying(&outcomes, fault), 1, "{fault}");
        }
    }

    #[test]
    fn stated_deviations_that_the_residuals_belie_are_doubted_and_beside_priors_their_weight_is_stated() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "the residuals are 2.1 times as large."), 1);
        assert_eq!(saying(&outcomes, "Beside the priors"), 0, "there are none");
        outcomes.estimated.prior = Some(crate::case::Bounds::Small);
        assert_eq!(saying(&outcomes, "the data count with 3.3 times their deviations"), 1);
        for (variance, doubts) in [(1.2, 0), (0.1, 1)] {
            outcomes.estimated.noise_variance = variance;
            assert_eq!(saying(&outcomes, "deviations and residuals disagree"), doubts, "{variance}");
        }
    }

    #[test]
    fn of_two_estimates_that_oppose_each_other_the_product_is_determined() {
        let mut outcomes = fixture::outcomes();
        let combination = &mut outcomes.estimated.combinations[0];
        (combination.is_ratio, combination.correlation, combination.value) = (false, -0.993, 0.9894);
        assert_eq!(saying(&outcomes, "Their product f_k_INS·f_cp_INS, 0.989 ± 0.3 %, is what"), 1);
        outcomes.estimated.combinations[0].relative_error = f64::NAN;
        assert_eq!(saying(&outcomes, "The data determine their product alone."), 1);
        outcomes.estimated.combinations.clear();
        assert_eq!(saying(&outcomes, "correlate by -0.993"), 0);
    }

    #[test]
    fn the_pattern_of_what_rounding_leaves_is_no_doubt() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "not noise"), 1);
        for (_, after) in &mut outcomes.estimated.fitted[0].misfits {
            after.rms_k = 1e-6;
        }
        assert_eq!(saying(&outcomes, "not noise"), 0);
    }

    #[test]
    fn gas_that_is_lost_on_its_way_is_doubted() {
        let mut outcomes = fixture::outcomes().charring();
        assert_eq!(saying(&outcomes, "The mass of the nominal march does not balance"), 0);
        outcomes.estimated.fitted[0].before.balance.gas_out_kg_m2 *= 0.99;
        outcomes.nominal.balance = outcomes.estimated.fitted[0].before.balance;
        assert_eq!(saying(&outcomes, "The mass of the nominal march does not balance"), 1);
    }

    #[test]
    fn a_ply_hotter_than_its_tables_is_doubted_and_one_within_them_is_not() {
        let mut outcomes = fixture::outcomes();
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS1) met 1,320 K (1,047 °C), beyond its tables"), 1);
        outcomes.estimated.fitted[0].after.extremes_k[3].1 = 1250.0;
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS1 and INS2) met 1,320 K"), 1);
        outcomes.case.layup.plies[2].material = std::sync::Arc::clone(&outcomes.case.layup.plies[0].material);
        assert_eq!(saying(&outcomes, "Pyrogel 3350 (INS2) met 1,250 K"), 1);
    }
}
