//! Physical properties that hold in every case, and reproducibility of seeds.

use crate::support::{
    BALANCE, BALANCE_LARGE_BOUNDS, MASS, MASS_SINGLE, ROUNDING_K, SKIPPED_REACTION_K, SOBOL_SUM, case, cases, coarse,
    modified, nominal_and_random, with_factor,
};
use bondline::adapt::adapt;
use bondline::case::{
    Bounds, Case, Correlation, Emissivity, EstimationSettings, Face, GasFlowModel, OpenFace, Property, Schedule,
};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::study::nominal::nominal;
use bondline::study::uncertainty::{Sweep, uncertainty};
use bondline::traces::{Gauge, MemberStatus, Traces};
use bondline::verify::problems::charring::{charring_felt, covered_felt};
use std::ops::Range;
use std::sync::Arc;

const PRECISIONS: [Precision; 2] = [Precision::F64, Precision::F32];

fn marched(case: &Case, ensemble: &Ensemble, precision: Precision) -> Traces {
    let traces = Cpu::new(precision).march(&Plan::new(case), ensemble, 0..ensemble.len());
    let traces = traces.expect("the processor does not fail");
    assert!(
        traces.statuses.iter().all(|status| *status == MemberStatus::Completed),
        "{}: {:?}",
        case.id(),
        traces.statuses
    );
    traces
}

/// Members with nominal factors but for the one at index `factor`.
fn varied(case: &Case, factor: usize, values: &[f64]) -> Ensemble {
    let nominal: Vec<f64> = case.factors().iter().map(|factor| factor.nominal).collect();
    let rows = values.iter().flat_map(|&value| {
        let mut row = nominal.clone();
        row[factor] = value;
        row
    });
    Ensemble::from_values(nominal.len(), rows.collect())
}

/// The case without reactions and gas, and without their factors.
fn inert(case: Case) -> Case {
    const REACTING: [Property; 5] = [
        Property::PreExponential,
        Property::ActivationEnergy,
        Property::PyrolysisHeat,
        Property::CharYield,
        Property::Permeability,
    ];
    modified(&case, |case| {
        for ply in &mut case.layup.plies {
            Arc::make_mut(&mut ply.material).decomposition = None;
        }
        (case.gas, case.exposure.back_pressure_pa) = (None, None);
        if let Face::Open(open) = &mut case.exposure.hot_face {
            open.blowing = Schedule::constant(0.0);
        }
        case.factors.retain(|factor| !REACTING.contains(&factor.property) && factor.state.is_none());
        case.estimate = EstimationSettings::default();
        case.correlation = Correlation::default();
    })
}

/// A case at one temperature, between faces with surroundings at that temperature, in a gas.
fn at_rest(case: Case, temperature_k: f64, gas_k: f64) -> Case {
    let face = OpenFace {
        film_w_m2_k: Schedule::constant(50.0),
        gas_k: Schedule::constant(gas_k),
        emissivity: Emissivity::Material,
        surroundings_k: Schedule::constant(temperature_k),
        ..OpenFace::insulated()
    };
    modified(&inert(case), |case| {
        case.exposure.initial_k = vec![(0.0, temperature_k)];
        case.exposure.hot_face = Face::Open(face.clone());
        case.exposure.back_face = Face::Open(face);
    })
}

/// Largest deviation from a temperature, K.
fn departure_k(traces: &Traces, temperature_k: f64) -> f64 {
    traces.temperatures_k.iter().map(|found_k| (found_k - temperature_k).abs()).fold(0.0, f64::max)
}

#[test]
fn a_layup_in_thermal_equilibrium_stays_at_its_temperature() {
    for case in cases() {
        for precision in PRECISIONS {
            let ensemble = nominal_and_random(&case, 3);
            let equilibrium = marched(&at_rest(case.clone(), 700.0, 700.0), &ensemble, precision);
            assert_eq!(departure_k(&equilibrium, 700.0), 0.0, "{} in {precision:?}", case.id());
            let cooled = marched(&at_rest(case.clone(), 700.0, 699.0), &ensemble, precision);
            assert!(departure_k(&cooled, 700.0) > 0.0, "{}: gas one kelvin colder has no effect", case.id());
        }
    }
}

#[test]
fn more_heating_raises_every_temperature() {
    let case = with_factor(&coarse(), "", Property::Heating);
    let ensemble = varied(&case, case.factors().len() - 1, &[0.8, 0.9, 1.0, 1.1, 1.2]);
    let traces = marched(&case, &ensemble, Precision::F64);
    for member in 1..ensemble.len() {
        let mut rises = traces.member(member).iter().zip(traces.member(member - 1)).map(|(hot, cold)| hot - cold);
        let least_k = rises.clone().fold(f64::INFINITY, f64::min);
        assert!(least_k >= -ROUNDING_K, "member {member} is {least_k} K colder somewhere");
        let last_k = rises.next_back().expect("there are instants");
        assert!(last_k > 1.0, "member {member} ends {last_k} K hotter");
    }
}

#[test]
fn temperatures_obey_the_maximum_principle() {
    for case in cases().into_iter().map(inert) {
        let (Face::Held(held), Face::Open(back)) = (&case.exposure().hot_face, &case.exposure().back_face) else {
            continue;
        };
        let given = held.values().iter().copied().chain(case.exposure().initial_k.iter().map(|point| point.1));
        let given = given.chain(back.film_w_m2_k.acts().then_some(back.gas_k.values()[0]));
        let (low_k, high_k) = given.fold((f64::INFINITY, 0.0_f64), |(low, high), t| (low.min(t), high.max(t)));
        let traces = marched(&case, &nominal_and_random(&case, 7), Precision::F64);
        for &(coldest_k, hottest_k) in &traces.extremes_k {
            assert!(coldest_k >= low_k - ROUNDING_K, "{}: {coldest_k} K under {low_k} K", case.id());
            assert!(hottest_k <= high_k + ROUNDING_K, "{}: {hottest_k} K over {high_k} K", case.id());
        }
        let span_k = high_k - low_k;
        let hottest_k = traces.extremes_k.iter().map(|ply| ply.1).fold(0.0, f64::max);
        assert!(
            hottest_k > low_k + 0.9 * span_k,
            "{}: temperatures hardly change, so the bound tests nothing",
            case.id()
        );
    }
}

#[test]
fn heat_capacity_and_density_factors_are_equivalent_if_extinction_is_constant() {
    let case = with_factor(&coarse(), "OF", Property::Density);
    let of = |property| case.factors().iter().position(|f| f.property == property && f.group == "OF").expect("varied");
    let (capacity, density) = (of(Property::HeatCapacity), of(Property::Density));
    let mut rows = vec![1.0; 4 * case.factors().len()];
    let mut set = |member: usize, factor: usize, value: f64| rows[member * case.factors().len() + factor] = value;
    set(1, capacity, 1.07);
    set(2, density, 1.07);
    set(3, capacity, 1.07);
    set(3, density, 1.0 / 1.07);
    let traces = marched(&case, &Ensemble::from_values(case.factors().len(), rows), Precision::F64);
    let max_difference_k = |one: usize, other: usize| {
        let pairs = traces.member(one).iter().zip(traces.member(other));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(max_difference_k(1, 2) <= ROUNDING_K, "{} K", max_difference_k(1, 2));
    assert!(max_difference_k(0, 3) <= ROUNDING_K, "{} K", max_difference_k(0, 3));
    assert!(max_difference_k(0, 1) > 1.0, "seven per cent more heat capacity changed {} K", max_difference_k(0, 1));
}

#[test]
fn the_energy_balance_closes_in_every_case() {
    for case in cases() {
        for precision in PRECISIONS {
            for (member, balance) in
                marched(&case, &nominal_and_random(&case, 7), precision).balances.iter().enumerate()
            {
                let allowed = match (decomposes(&case), member) {
                    (true, 1..) => BALANCE_LARGE_BOUNDS,
                    _ => BALANCE,
                };
                let residual = balance.residual().abs();
                assert!(residual <= allowed, "{} in {precision:?}, member {member}: {residual:.1e}", case.id());
                let mut leaking = *balance;
                leaking.stored_j_m2 += 5.0 * allowed * (balance.hot_in_j_m2 + balance.back_in_j_m2);
                assert!(leaking.residual().abs() > allowed, "{}: an energy imbalance passed", case.id());
            }
        }
    }
}

fn decomposes(case: &Case) -> bool {
    case.layup().plies.iter().any(|ply| ply.material.decomposition.is_some())
}

/// Second order: a quarter of the step leaves a sixteenth of the error.
#[test]
fn the_energy_imbalance_of_reactions_is_of_second_order_in_the_step() {
    for case in cases().into_iter().filter(decomposes) {
        let residual = |share: f64| {
            let case = modified(&case, |case| {
                case.resolution.first_step_s *= share;
                case.resolution.max_step_s *= share;
                case.resolution.step_growth *= share;
            });
            marched(&case, &nominal_and_random(&case, 0), Precision::F64).balances[0].residual().abs()
        };
        let (coarse, fine) = (residual(1.0), residual(0.25));
        assert!(fine < coarse / 3.5, "{}: {coarse:.1e} falls to {fine:.1e} only", case.id());
    }
}

#[test]
fn skipping_inactive_reactions_changes_nothing() {
    let case = case("lcat-2259-pyrolysis");
    let (plan, ensemble) = (Plan::new(&case), nominal_and_random(&case, 8));
    let colder_by = |steepness: f64| {
        let mut plan = plan.clone();
        plan.rows.data.reactions.iter_mut().for_each(|reaction| reaction.idle += steepness);
        Cpu::new(Precision::F64).march(&plan, &ensemble, 0..ensemble.len()).expect("the processor does not fail")
    };
    let off_k = |one: &Traces, other: &Traces| {
        let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let (never_skipped, skipped) = (colder_by(f64::INFINITY), colder_by(0.0));
    assert!(off_k(&skipped, &never_skipped) <= SKIPPED_REACTION_K, "{:.1e} K", off_k(&skipped, &never_skipped));
    // A million times the rate.
    let negative_control_k = off_k(&colder_by(-1e6_f64.ln()), &never_skipped);
    assert!(
        negative_control_k > 10.0 * SKIPPED_REACTION_K,
        "skipping active reactions passed: {negative_control_k:.1e} K"
    );
}

#[test]
fn the_mass_balance_closes_in_every_case() {
    let mut lost_kg_m2 = 0.0_f64;
    for case in cases() {
        for (precision, allowed) in [(Precision::F64, MASS), (Precision::F32, MASS_SINGLE)] {
            for (member, balance) in
                marched(&case, &nominal_and_random(&case, 7), precision).balances.iter().enumerate()
            {
                let residual = balance.mass_residual().abs();
                assert!(residual <= allowed, "{} in {precision:?}, member {member}: {residual:.1e}", case.id());
                lost_kg_m2 = lost_kg_m2.max(balance.solid_lost_kg_m2);
                let mut leaking = *balance;
                leaking.gas_out_kg_m2 *= 1.0 + 5.0 * allowed;
                let moved = balance.gas_out_kg_m2 != 0.0;
                assert!(!moved || leaking.mass_residual().abs() > allowed, "{}: a mass imbalance passed", case.id());
            }
        }
    }
    assert!(lost_kg_m2 > 0.5, "no case loses more than {lost_kg_m2} kg/m2");
}

/// In double precision only: at the millions of Pa reached here, a member in single precision diverges, and is
/// reported. The mass stored in a cell is a ten-millionth of that passing it in a step, the last place of a pivot.
#[test]
fn no_gas_leaves_a_sealed_layup() {
    let of = |permeability_m2| {
        let traces = marched(&covered_felt(permeability_m2), &Ensemble::from_values(0, vec![]), Precision::F64);
        assert!(traces.gauges.iter().all(|reading| reading.is_finite()));
        traces.balances[0]
    };
    let sealed = of(0.0);
    assert_eq!((sealed.gas_out_kg_m2, sealed.gas_in_kg_m2), (0.0, 0.0));
    assert!(sealed.solid_lost_kg_m2 > 0.05, "the felt hardly chars: {sealed:?}");
    assert!(sealed.mass_residual().abs() <= MASS, "{:.1e}", sealed.mass_residual());
    assert!(of(1e-15).gas_out_kg_m2 > 0.01, "a permeable cover holds the gas as well");
}

#[test]
fn a_member_of_very_low_permeability_completes() {
    for (precision, allowed) in [(Precision::F64, MASS), (Precision::F32, MASS_SINGLE)] {
        let traces = marched(&charring_felt(GasFlowModel::Darcy, 1e-17), &Ensemble::from_values(0, vec![]), precision);
        for gauge in [Gauge::PeakPressure, Gauge::BackPressure] {
            let pressures_pa = traces.gauge(0, gauge).expect("gas has gauges");
            let is_sound = |pressure_pa: &f64| pressure_pa.is_finite() && *pressure_pa > 0.0;
            assert!(pressures_pa.iter().all(is_sound), "{precision:?}, {gauge:?}: {pressures_pa:?}");
        }
        let peak_pa = traces.gauge(0, Gauge::PeakPressure).into_iter().flatten().fold(0.0_f64, |most, &p| most.max(p));
        assert!(peak_pa > 1e6, "{precision:?}: peak pressure of only {peak_pa} Pa");
        let residual = traces.balances[0].mass_residual().abs();
        assert!(residual <= allowed, "{precision:?}: {residual:.1e}");
    }
}

#[test]
fn a_larger_lag_delays_and_lowers_the_peak() {
    let lags_s = [0.0, 1.0, 2.0, 4.0, 8.0];
    let peaks = lags_s.map(|time_constant_s| {
        let case = modified(&coarse(), |case| {
            case.sensors.iter_mut().for_each(|sensor| sensor.time_constant_s = time_constant_s);
        });
        marched(&case, &Ensemble::nominal(case.factors()), Precision::F64).member_peaks(0).to_vec()
    });
    for pair in peaks.windows(2) {
        for (sensor, (quick, slow)) in pair[0].iter().zip(&pair[1]).enumerate() {
            assert!(slow.temperature_k < quick.temperature_k, "sensor {sensor}: {quick:?}, then {slow:?}");
            assert!(slow.time_s >= quick.time_s, "sensor {sensor}: {quick:?}, then {slow:?}");
        }
    }
    for (sensor, (quick, slow)) in peaks[0].iter().zip(&peaks[4]).enumerate() {
        assert!(slow.time_s > quick.time_s, "sensor {sensor}: {quick:?}, at last {slow:?}");
    }
}

/// The processor with a limited capacity.
struct Batches(Cpu, usize);

impl March for Batches {
    fn backend(&self) -> Backend {
        self.0.backend()
    }

    fn capacity(&self, _plan: &Plan) -> usize {
        self.1
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.0.march(plan, ensemble, members)
    }
}

/// Every result of an uncertainty study, printed without loss of bits.
fn figures(case: &Case, seed: u64, batch: usize, threads: usize) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| {
        let plan = Plan::new(case);
        let mut march = Batches(Cpu::new(Precision::F64), batch);
        let centre = nominal(case, &plan, &mut march).expect("the processor does not fail");
        let sampling = Sampling { kind: SamplingKind::Normal, seed };
        let sweep = Sweep { members: 100, sampling, bounds: Bounds::Small };
        let found = uncertainty(case, &plan, &mut march, &centre, &sweep, &mut |_, _| {});
        format!("{:?}", found.expect("the processor does not fail"))
    })
}

#[test]
fn a_seed_gives_the_same_statistics_for_every_batch_size_and_thread_count() {
    let case = coarse();
    let once = figures(&case, 1, 100, 1);
    assert_eq!(once, figures(&case, 1, 100, 2));
    assert_eq!(once, figures(&case, 1, 37, 2));
    assert_eq!(once, figures(&case, 1, 8, 1));
    assert_ne!(once, figures(&case, 2, 100, 1));
}

/// For independent factors a first-order index is at most the total index, and the sum of total indices exceeds that of
/// first-order indices by twice the pair interactions, as each pair counts for both of its factors.
#[test]
fn sobol_indices_of_run_2259_are_consistent_and_another_sample_lies_within_their_intervals() {
    let case = case("lcat-2259");
    let found = |seed| {
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        let plan = adapt(&case).expect("the processor marches");
        let centre = nominal(&case, &plan, &mut march).expect("the processor does not fail");
        let sampling = Sampling { kind: SamplingKind::Normal, seed };
        let sweep = Sweep { members: 700, sampling, bounds: Bounds::Small };
        uncertainty(&case, &plan, &mut march, &centre, &sweep, &mut |_, _| {}).expect("the processor does not fail")
    };
    let (one, other) = (found(1), found(2));
    let mut smooth = 0;
    for (peak, again) in one.peaks.iter().zip(&other.peaks) {
        for (causes, again) in
            [(&peak.temperature_indices, &again.temperature_indices), (&peak.time_indices, &again.time_indices)]
        {
            let (first, total): (f64, f64) = (
                causes.first.iter().map(|index| index.value).sum(),
                causes.total.iter().map(|index| index.value).sum(),
            );
            let pairs = 1.0 - first - causes.unexplained;
            // At the heated face members peak at the end of the heating. A constant time has no variance; a time that
            // jumps is no polynomial, so its residual is large and small indices are clipped at zero.
            if total > 0.0 && causes.unexplained < 0.01 {
                assert!(
                    pairs > -SOBOL_SUM && (total - first - 2.0 * pairs).abs() < SOBOL_SUM,
                    "{first} {total} {}",
                    causes.unexplained
                );
                let mut each = causes.first.iter().zip(&causes.total);
                assert!(each.all(|(first, total)| first.value <= total.value + SOBOL_SUM), "{causes:?}");
                smooth += 1;
            }
            for (index, again) in causes.first.iter().chain(&causes.total).zip(again.first.iter().chain(&again.total)) {
                assert!(index.low <= again.high && again.low <= index.high, "{index:?} and {again:?}");
            }
        }
    }
    assert!(smooth >= 5, "only {smooth} smooth outputs; expected all peaks and the time of the bondline's");
    let bondline = &one.peaks[3].temperature_indices;
    assert!(
        bondline.unexplained < 1e-4 && bondline.total.iter().all(|index| index.high - index.low < 0.01),
        "{bondline:?}"
    );
}

#[test]
fn a_larger_ensemble_begins_with_the_members_of_a_smaller_one() {
    let case = coarse();
    // The strata of a Latin hypercube depend on the number of members.
    for kind in [SamplingKind::Normal, SamplingKind::Uniform, SamplingKind::Sobol] {
        let of = |seed, members| Ensemble::sample(case.factors(), Bounds::Small, &Sampling { kind, seed }, members);
        let (few, many, other) = (of(3, 5_000), of(3, 50_000), of(4, 5_000));
        for member in 0..few.len() {
            assert_eq!(few.member(member), many.member(member), "{kind:?}, member {member}");
        }
        assert_ne!(few.member(17), other.member(17), "{kind:?}: another seed drew the same member");
    }
}

#[test]
fn a_member_with_nominal_factors_equals_the_case_without_factors() {
    let case = case("lcat-2259");
    let without = modified(&case, |case| (case.factors, case.estimate) = (Vec::new(), EstimationSettings::default()));
    let (with, without) = (
        marched(&case, &Ensemble::nominal(case.factors()), Precision::F64),
        marched(&without, &Ensemble::from_values(0, vec![]), Precision::F64),
    );
    // Not bit-identical: with a factor on density the radiative part is a separate column, and a sum of two is rounded.
    let max_difference_k = |other: &Traces| {
        let pairs = with.temperatures_k.iter().zip(&other.temperatures_k);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(max_difference_k(&without) <= ROUNDING_K, "{} K", max_difference_k(&without));
    let other = marched(&case, &varied(&case, 0, &[1.001]), Precision::F64);
    assert!(max_difference_k(&other) > ROUNDING_K, "{} K", max_difference_k(&other));
}
