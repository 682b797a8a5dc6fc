//! Sizing of a ply against a closed-form solution, and interval coverage on synthetic data.

use crate::support::{case, modified};
use bondline::case::{Bounds, Case, LimitedPart};
use bondline::ensemble::{Ensemble, Sampling, SamplingKind};
use bondline::fit::proportion::Proportion;
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::RichardsonMarch;
use bondline::plan::Plan;
use bondline::study::coverage_study::{CoverageDesign, CoverageStudy, FitOutcome, coverage_study};
use bondline::study::estimate::SearchOptions;
use bondline::study::size::{RequiredThickness, SizeError, Sizing, SizingRequirement, size};
use bondline::study::twin::Noise;
use bondline::study::uncertainty::Sweep;
use bondline::work_log::NoLog;
use std::f64::consts::PI;

/// Heat flux into the slab, W/m², and its duration, s; density, heat capacity and conductivity of the slab, SI.
const HEATED: (f64, f64) = (2000.0, 400.0);
const SLAB: (f64, f64, f64) = (200.0, 1000.0, 0.05);

/// Back-face temperature of a slab with constant heat flux and insulated back, K:
/// `300 + q t/(ρ c L) − (q L/k) (1/6 − 2/π² e^(−π² α t/L²))`, with the first term of the series (Carslaw & Jaeger,
/// *Conduction of Heat in Solids*, 1959, section 3.8).
fn back_k(thickness_m: f64, f_k: f64, f_cp: f64) -> f64 {
    let ((q, t), (rho, c, k)) = (HEATED, SLAB);
    let fourier = k * f_k / (rho * c * f_cp) * t / thickness_m.powi(2);
    let decay = 2.0 / PI.powi(2) * (-PI.powi(2) * fourier).exp();
    300.0 + q * t / (rho * c * f_cp * thickness_m) - q * thickness_m / (k * f_k) * (1.0 / 6.0 - decay)
}

/// Thickness at which that temperature equals a limit, m.
fn exact_m(limit_k: f64, f_k: f64, f_cp: f64) -> f64 {
    let (mut low, mut high) = (4e-3, 20e-3);
    for _ in 0..60 {
        let middle: f64 = (low + high) / 2.0;
        if back_k(middle, f_k, f_cp) > limit_k { low = middle } else { high = middle }
    }
    low
}

const LIMIT_K: f64 = 600.0;

fn demand(case: &Case, ply: &str, sensor: &str, limit_k: f64) -> SizingRequirement {
    let sensor = case.sensors().iter().position(|found| found.name == sensor).expect("a sensor of the case");
    let part = LimitedPart::Sensor(sensor);
    SizingRequirement { ply: ply.to_owned(), part, limit_k, probability: 0.9, thickness_range_m: None }
}

fn sweep(members: usize, seed: u64) -> Sweep {
    Sweep { members, sampling: Sampling { kind: SamplingKind::Normal, seed }, bounds: Bounds::Small }
}

fn sized(demand: impl Fn(&Case) -> SizingRequirement, members: usize) -> Result<Sizing, SizeError> {
    let case = modified(&case("slab"), |case| case.resolution.cells = 40);
    size(
        &case,
        &mut RichardsonMarch::new(Box::new(Cpu::new(Precision::F64))),
        &demand(&case),
        &sweep(members, 1),
        &mut NoLog,
    )
}

#[test]
fn a_slab_is_sized_as_in_closed_form_nominally_and_for_a_share_of_members() {
    let found = sized(|case| demand(case, "SLAB", "BACK", LIMIT_K), 1000).expect("a thickness");
    let (RequiredThickness::At(nominal_m), RequiredThickness::At(needed_m)) = (found.nominal, found.required) else {
        panic!("{found:?}")
    };
    let exact = exact_m(LIMIT_K, 1.0, 1.0);
    assert!((nominal_m / exact - 1.0).abs() < 1e-3, "{nominal_m} m, not {exact}");
    // The needed thickness by a Monte Carlo of the closed form, independent of the march.
    let sampling = Sampling { kind: SamplingKind::Normal, seed: 77 };
    let others = Ensemble::sample(case("slab").factors(), Bounds::Small, &sampling, 20_000);
    let holds = |thickness_m: f64| {
        let held = |&member: &usize| {
            let row = others.member(member);
            back_k(thickness_m, row[0], row[1]) < LIMIT_K
        };
        Proportion { count: (0..others.len()).filter(held).count(), total: others.len() }
    };
    assert!(
        found.below_limit(needed_m).is_consistent_with(holds(needed_m)),
        "{:?} and {:?}",
        found.below_limit(needed_m),
        holds(needed_m)
    );
    assert!(
        !found.below_limit(needed_m).is_consistent_with(holds(1.02 * needed_m)),
        "2 % more thickness is not detected"
    );
    let (Some(RequiredThickness::At(low)), Some(RequiredThickness::At(high))) = found.interval else {
        panic!("{:?}", found.interval)
    };
    let (low, high) = (holds(low).fraction(), holds(high).fraction());
    assert!(low < 0.9 && high > 0.9 && high - low < 0.06, "{low} to {high} about 0.9");
    assert_eq!(found.is_confirmed(), Some(true), "{:?}", found.check);
    assert!(found.still_warming, "the slab is heated until the end");
    assert!((found.mass_kg_m2(needed_m) - SLAB.0 * needed_m).abs() < 1e-9);
}

#[test]
fn at_each_thickness_the_band_of_peaks_covers_95_percent_of_the_members_in_closed_form() {
    const MEMBERS: usize = 400;
    let found = sized(|case| demand(case, "SLAB", "BACK", LIMIT_K), MEMBERS).expect("a thickness");
    let sampling = Sampling { kind: SamplingKind::Normal, seed: 1 };
    let members = Ensemble::sample(case("slab").factors(), Bounds::Small, &sampling, MEMBERS);
    // Above 20 mm the second term of the series is not negligible.
    let rungs: Vec<_> = found.peak_curve.iter().filter(|rung| rung.thickness_m < 20e-3).collect();
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
        assert!(between(middle_k - half_k, middle_k + half_k) < 376, "a band narrower by 10 % has the same coverage");
    }
}

#[test]
fn a_ply_and_an_interface_are_sized_for_their_hottest_point() {
    let layered = case("lcat-2259");
    let sized_m = |part: LimitedPart, limit_k: f64| {
        let demand = SizingRequirement { part, ..demand(&layered, "INS", "TC4", limit_k) };
        let mut march = RichardsonMarch::new(Box::new(Cpu::new(Precision::F64)));
        size(&layered, &mut march, &demand, &sweep(60, 1), &mut NoLog)
            .expect("a thickness")
            .nominal
            .found_m()
            .expect("a thickness")
    };
    let close = |one_m: f64, other_m: f64, share: f64| (one_m / other_m - 1.0).abs() < share;
    // The back is insulated, so that the barrier (ply 4) and both faces above it are as hot as TC4 between them.
    let behind = [LimitedPart::Interface(3), LimitedPart::Ply(4)].map(|part| sized_m(part, 800.0));
    let sensor_m = sized_m(LimitedPart::Sensor(3), 800.0);
    assert!(behind.iter().all(|&at_m| close(at_m, sensor_m, 1e-3)), "{behind:?} {sensor_m}");
    // The lower insulation (ply 3) is hottest on its upper face, at TC3, and not at TC4 below it.
    let (ply_m, above_m, below_m) = (
        sized_m(LimitedPart::Ply(3), 1000.0),
        sized_m(LimitedPart::Sensor(2), 1000.0),
        sized_m(LimitedPart::Sensor(3), 1000.0),
    );
    assert!(close(ply_m, above_m, 0.05) && ply_m > 1.2 * below_m, "{ply_m} {above_m} {below_m}");
}

/// Sizing and check with 60 members each, over 40 seeds: the share that the check finds lies in the interval that the
/// report predicts. The interval of the check alone covers the requested share less often, as it omits the scatter of
/// the thickness.
#[test]
fn the_check_lies_in_the_predicted_interval_in_95_percent_of_sizings() {
    const SIZINGS: u64 = 40;
    let (mut expected, mut alone) = (0, 0);
    for seed in 0..SIZINGS {
        let case = modified(&case("slab"), |case| case.resolution.cells = 16);
        let demand =
            SizingRequirement { thickness_range_m: Some((8e-3, 16e-3)), ..demand(&case, "SLAB", "BACK", LIMIT_K) };
        let found =
            size(&case, &mut Cpu::new(Precision::F64), &demand, &sweep(60, 1000 + 2 * seed), &mut NoLog).expect("one");
        let (low, high) = found.check.as_ref().expect("a check").below_limit.interval_95();
        expected += u64::from(found.is_confirmed().expect("a check"));
        alone += u64::from((low..=high).contains(&0.9));
    }
    // With a coverage of 95 %, 34 or fewer of 40 have a probability of 1/70; for discrete counts the coverage is
    // slightly higher.
    assert!(expected >= 35, "{expected} of {SIZINGS}");
    assert!(alone < expected, "covered by the interval of the check alone: {alone}, by the predicted one: {expected}");
}

#[test]
fn an_unreachable_limit_is_a_result_and_a_ply_without_effect_is_an_error() {
    let never = sized(|case| demand(case, "SLAB", "BACK", 300.1), 40).expect("a result");
    assert!(
        matches!((never.nominal, never.required), (RequiredThickness::Beyond(_), RequiredThickness::Beyond(_))),
        "{never:?}"
    );
    assert!(
        never.check.is_none() && never.margin_m().is_none() && never.below_limit(never.thickness_range_m.1).count == 0
    );
    let always = sized(|case| demand(case, "SLAB", "BACK", 3000.0), 40).expect("a result");
    assert!(
        matches!((always.nominal, always.required), (RequiredThickness::AtMost(_), RequiredThickness::AtMost(_))),
        "{always:?}"
    );
    let behind = modified(&case("lcat-2259"), |case| {
        case.resolution.cells = 40;
        case.exposure.duration_s = 45.0;
        case.observations.clear();
    });
    let demand_behind = demand(&behind, "GB", "TC1", 1000.0);
    let error = size(
        &behind,
        &mut RichardsonMarch::new(Box::new(Cpu::new(Precision::F64))),
        &demand_behind,
        &sweep(40, 1),
        &mut NoLog,
    )
    .expect_err("no effect");
    assert!(error.to_string().contains("TC1 is not cooled by a thicker GB"), "{error}");
}

/// Synthetic data of the slab with noise of a correlation time of 10 s.
fn recovered(seed: u64, twins: usize) -> CoverageStudy {
    let case = modified(&case("slab"), |case| {
        case.resolution.cells = 24;
        case.estimate.bounds = Bounds::Large;
    });
    let plan = Plan::new(&case);
    let search = SearchOptions { landscape: false, ..SearchOptions::for_precision(Precision::F64) };
    let noise = Noise { correlation_s: 10.0, seed };
    let design = CoverageDesign { data_sets: twins, truth_bounds: Bounds::Small, noise_k: None, noise, search };
    coverage_study(&case, &plan, &mut RichardsonMarch::new(Box::new(Cpu::new(Precision::F64))), &design, &mut NoLog)
        .expect("fits")
}

#[test]
fn intervals_under_correlated_noise_have_their_nominal_coverage() {
    let found = recovered(5, 60);
    assert_eq!(found.converged(), 60, "{:?}", found.failures());
    let (low, high) = found.covered.interval_95();
    assert!(low <= 0.95 && high >= 0.92, "{:?}", found.covered);
    for factor in &found.factors {
        assert!(factor.bias.abs() < 4.0 * factor.bias_error, "{factor:?}");
        assert!(factor.rms < factor.half_width && factor.half_width < 0.1, "{factor:?}");
    }
    // With samples taken as independent, an interval would be narrower by the root of the effective sample ratio.
    let narrow = (found.effective_samples / found.samples as f64).sqrt();
    let held = found.fits.iter().flat_map(|twin| {
        let FitOutcome::Converged(fit) = &twin.outcome else { panic!("all converged") };
        let each = fit.values.iter().zip(&fit.intervals).zip(&twin.truth);
        let is_held = |((value, (low, high)), truth): ((&f64, &(f64, f64)), &f64)| {
            (value - truth).abs() <= narrow * (high - low) / 2.0
        };
        each.map(is_held).collect::<Vec<bool>>()
    });
    let naive = held.filter(|held| *held).count() as f64 / found.covered.total as f64;
    assert!(naive < 0.8, "coverage {naive} with samples taken as independent");
}

#[test]
fn a_synthetic_data_set_is_the_same_among_few_and_among_many() {
    let (few, many) = (recovered(3, 2), recovered(3, 5));
    for (a, b) in few.fits.iter().zip(&many.fits) {
        let (FitOutcome::Converged(one), FitOutcome::Converged(other)) = (&a.outcome, &b.outcome) else {
            panic!("both converge")
        };
        assert_eq!((&a.truth, &one.values, &one.intervals), (&b.truth, &other.values, &other.intervals));
    }
}
