//! Questions of design and of trust: a ply sized against answers in closed form, twins fitted and counted.

use crate::support::{case, changed};
use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::extrapolated::Extrapolated;
use bondline::plan::Plan;
use bondline::study::estimate::Search;
use bondline::study::proportion::Proportion;
use bondline::study::recovery::{Design, Recovery, TwinEnd, recovery};
use bondline::study::size::{Demand, Needed, SizeError, Sizing, size};
use bondline::study::twin::Noise;
use bondline::study::uncertainty::Sweep;
use std::f64::consts::PI;

/// Heat into the slab, W/m², and for how long, s; its density, heat capacity and conductivity.
const HEATED: (f64, f64) = (2000.0, 400.0);
const SLAB: (f64, f64, f64) = (200.0, 1000.0, 0.05);

/// The back of a slab heated evenly, insulated behind: `q t/(ρ c L) − (q L/k) (1/6 − 2/π² e^(−π² α t/L²))` above 300 K (Carslaw &
/// Jaeger, *Conduction of Heat in Solids*, 1959, section 3.8; of the series the term that has not died away).
fn back_k(thickness_m: f64, f_k: f64, f_cp: f64) -> f64 {
    let ((q, t), (rho, c, k)) = (HEATED, SLAB);
    let fourier = k * f_k / (rho * c * f_cp) * t / thickness_m.powi(2);
    let left = 2.0 / PI.powi(2) * (-PI.powi(2) * fourier).exp();
    300.0 + q * t / (rho * c * f_cp * thickness_m) - q * thickness_m / (k * f_k) * (1.0 / 6.0 - left)
}

/// Where that passes a limit.
fn exact_m(limit_k: f64, f_k: f64, f_cp: f64) -> f64 {
    let (mut low, mut high) = (4e-3, 20e-3);
    for _ in 0..60 {
        let middle: f64 = (low + high) / 2.0;
        if back_k(middle, f_k, f_cp) > limit_k { low = middle } else { high = middle }
    }
    low
}

const LIMIT_K: f64 = 600.0;

fn demand(case: &Case, ply: &str, sensor: &str, limit_k: f64) -> Demand {
    let sensor = case.sensors().iter().position(|found| found.name == sensor).expect("a sensor of the case");
    Demand { ply: ply.to_owned(), sensor, limit_k, probability: 0.9, within_m: None }
}

fn sweep(members: usize, seed: u64) -> Sweep {
    Sweep { members, sampling: Sampling { kind: SamplingKind::Normal, seed }, bounds: Bounds::Small }
}

fn sized(demand: impl Fn(&Case) -> Demand, members: usize) -> Result<Sizing, SizeError> {
    let case = changed(&case("slab"), |case| case.resolution.cells = 40);
    size(&case, &mut Extrapolated::new(Box::new(Cpu::new(Precision::F64))), &demand(&case), &sweep(members, 1))
}

#[test]
fn a_slab_is_sized_as_the_closed_form_has_it_nominally_and_for_a_share_of_members() {
    let found = sized(|case| demand(case, "SLAB", "BACK", LIMIT_K), 1000).expect("a thickness");
    let (Needed::At(nominal_m), Needed::At(needed_m)) = (found.nominal, found.needed) else { panic!("{found:?}") };
    let exact = exact_m(LIMIT_K, 1.0, 1.0);
    assert!((nominal_m / exact - 1.0).abs() < 1e-3, "{nominal_m} m, not {exact}");
    // What other members need, by the closed form: a Monte Carlo that owes nothing to the march.
    let sampling = Sampling { kind: SamplingKind::Normal, seed: 77 };
    let others = Ensemble::sample(case("slab").factors(), Bounds::Small, &sampling, 20_000);
    let holds = |thickness_m: f64| {
        let held = |&member: &usize| {
            let row = others.member(member);
            back_k(thickness_m, row[0], row[1]) < LIMIT_K
        };
        Proportion { count: (0..others.len()).filter(held).count(), of: others.len() }
    };
    assert!(found.held(needed_m).is_like(holds(needed_m)), "{:?} and {:?}", found.held(needed_m), holds(needed_m));
    assert!(!found.held(needed_m).is_like(holds(1.02 * needed_m)), "a fiftieth more is told apart");
    let (Some(Needed::At(low)), Some(Needed::At(high))) = found.interval else { panic!("{:?}", found.interval) };
    let (low, high) = (holds(low).share(), holds(high).share());
    assert!(low < 0.9 && high > 0.9 && high - low < 0.06, "{low} to {high} about 0.9");
    assert_eq!(found.is_borne_out(), Some(true), "{:?}", found.check);
    assert!(found.still_warming, "it is heated until the end");
    assert!((found.mass_kg_m2(needed_m) - SLAB.0 * needed_m).abs() < 1e-9);
}

#[test]
fn at_each_thickness_the_band_of_peaks_holds_95_in_100_of_the_members_by_the_closed_form() {
    const MEMBERS: usize = 400;
    let found = sized(|case| demand(case, "SLAB", "BACK", LIMIT_K), MEMBERS).expect("a thickness");
    let sampling = Sampling { kind: SamplingKind::Normal, seed: 1 };
    let members = Ensemble::sample(case("slab").factors(), Bounds::Small, &sampling, MEMBERS);
    // Thicker than that, another term of the closed form has not died away.
    let rungs: Vec<_> = found.rungs.iter().filter(|rung| rung.thickness_m < 20e-3).collect();
    assert!(rungs.len() > 3, "{} thicknesses", rungs.len());
    for rung in rungs {
        let [low_k, _, high_k] = rung.percentiles_k;
        let between = |low_k: f64, high_k: f64| {
            let peaks_k =
                (0..MEMBERS).map(|member| members.member(member)).map(|row| back_k(rung.thickness_m, row[0], row[1]));
            peaks_k.filter(|peak_k| (low_k..=high_k).contains(peak_k)).count()
        };
        let held = between(low_k, high_k);
        assert!((376..=384).contains(&held), "{held} of {MEMBERS} at {} m", rung.thickness_m);
        let (middle_k, half_k) = (0.5 * (low_k + high_k), 0.45 * (high_k - low_k));
        assert!(between(middle_k - half_k, middle_k + half_k) < 376, "a band a tenth narrower is told apart");
    }
}

/// Sized and checked with 60 members each, over 40 seeds: the share that the check confirms lies where the report expects it.
/// The interval of the check alone holds the share that was asked for in fewer, as it leaves the scatter of the thickness
/// out.
#[test]
fn the_check_lies_within_what_is_expected_of_it_in_95_of_100_sizings() {
    const SIZINGS: u64 = 40;
    let (mut expected, mut alone) = (0, 0);
    for seed in 0..SIZINGS {
        let case = changed(&case("slab"), |case| case.resolution.cells = 16);
        let demand = Demand { within_m: Some((8e-3, 16e-3)), ..demand(&case, "SLAB", "BACK", LIMIT_K) };
        let found = size(&case, &mut Cpu::new(Precision::F64), &demand, &sweep(60, 1000 + 2 * seed)).expect("one");
        let (low, high) = found.check.as_ref().expect("a check").held.interval_95();
        expected += u64::from(found.is_borne_out().expect("a check"));
        alone += u64::from((low..=high).contains(&0.9));
    }
    // Of 40 at 95 %, 34 or fewer are as rare as one in seventy; what is told of whole members is held a little oftener.
    assert!(expected >= 35, "{expected} of {SIZINGS}");
    assert!(alone < expected, "{alone} by the interval of the check alone, {expected} by that of both");
}

#[test]
fn a_limit_that_no_thickness_holds_is_an_answer_and_a_ply_that_does_not_cool_is_a_fault() {
    let never = sized(|case| demand(case, "SLAB", "BACK", 300.1), 40).expect("an answer");
    assert!(matches!((never.nominal, never.needed), (Needed::Beyond(_), Needed::Beyond(_))), "{never:?}");
    assert!(never.check.is_none() && never.margin_m().is_none() && never.held(never.within_m.1).count == 0);
    let always = sized(|case| demand(case, "SLAB", "BACK", 3000.0), 40).expect("an answer");
    assert!(matches!((always.nominal, always.needed), (Needed::AtMost(_), Needed::AtMost(_))), "{always:?}");
    let behind = changed(&case("lcat-2259"), |case| {
        case.resolution.cells = 40;
        case.exposure.duration_s = 45.0;
        case.observations.clear();
    });
    let asked = demand(&behind, "GB", "TC1", 1000.0);
    let fault = size(&behind, &mut Extrapolated::new(Box::new(Cpu::new(Precision::F64))), &asked, &sweep(40, 1))
        .expect_err("no cooling");
    assert!(fault.to_string().contains("TC1 is not cooled by a thicker GB"), "{fault}");
}

/// Twins of the slab with noise that forgets itself over ten seconds.
fn recovered(seed: u64, twins: usize) -> Recovery {
    let case = changed(&case("slab"), |case| {
        case.resolution.cells = 24;
        case.estimate.bounds = Bounds::Large;
    });
    let plan = Plan::new(&case);
    let search = Search { landscape: false, ..Search::of(Precision::F64) };
    let noise = Noise { correlation_s: 10.0, seed };
    let design = Design { twins, drawn: Bounds::Small, noise_k: None, noise, search };
    recovery(&case, &plan, &mut Extrapolated::new(Box::new(Cpu::new(Precision::F64))), &design).expect("fits")
}

#[test]
fn intervals_of_twins_with_correlated_noise_hold_the_truth_as_often_as_they_say() {
    let found = recovered(5, 60);
    assert_eq!(found.converged(), 60, "{:?}", found.failures());
    let (low, high) = found.covered.interval_95();
    assert!(low <= 0.95 && high >= 0.92, "{:?}", found.covered);
    for factor in &found.recovered {
        assert!(factor.bias.abs() < 4.0 * factor.bias_error, "{factor:?}");
        assert!(factor.rms < factor.half_width && factor.half_width < 0.1, "{factor:?}");
    }
    // As if its samples were independent an interval would be narrower by the root of what they are worth less.
    let narrow = (found.effective_samples / found.samples as f64).sqrt();
    let held = found.twins.iter().flat_map(|twin| {
        let TwinEnd::Converged(fit) = &twin.end else { panic!("all converged") };
        let each = fit.values.iter().zip(&fit.intervals).zip(&twin.truth);
        let is_held = |((value, (low, high)), truth): ((&f64, &(f64, f64)), &f64)| {
            (value - truth).abs() <= narrow * (high - low) / 2.0
        };
        each.map(is_held).collect::<Vec<bool>>()
    });
    let naive = held.filter(|held| *held).count() as f64 / found.covered.of as f64;
    assert!(naive < 0.8, "samples taken as independent hold the truth in {naive}");
}

#[test]
fn a_twin_is_the_same_among_few_and_among_many() {
    let (few, many) = (recovered(3, 2), recovered(3, 5));
    for (a, b) in few.twins.iter().zip(&many.twins) {
        let (TwinEnd::Converged(one), TwinEnd::Converged(other)) = (&a.end, &b.end) else { panic!("both converge") };
        assert_eq!((&a.truth, &one.values, &one.intervals), (&b.truth, &other.values, &other.intervals));
    }
}
