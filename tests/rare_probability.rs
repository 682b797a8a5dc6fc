//! Sampling until an interval is narrow enough, and rare probabilities, against the closed form of a slab.

use crate::cli::{CASE, run};
use crate::support::{Scratch, case, runs_all};
use bondline::case::Case;
use bondline::ensemble::Ensemble;
use bondline::question::{Draw, Goal, Uncertainty};
use bondline::session::{BackendKind, Options, Session};
use bondline::study::sequential_sampling::PrecisionReached;
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Back-face temperature of the shipped slab at the end of its exposure, K: see `sizing_and_coverage.rs`.
fn back_k(f_k: f64, f_cp: f64) -> f64 {
    let (flux, time_s, capacity, conductivity, thickness_m) = (2000.0, 400.0, 2e5, 0.05, 0.01);
    let fourier = conductivity * f_k / (capacity * f_cp) * time_s / (thickness_m * thickness_m);
    let decay = 2.0 / PI.powi(2) * (-PI.powi(2) * fourier).exp();
    300.0 + flux * time_s / (capacity * f_cp * thickness_m)
        - flux * thickness_m / (conductivity * f_k) * (1.0 / 6.0 - decay)
}

/// Probability that the back face exceeds a temperature: both factors are normal about 1 with a standard deviation of
/// 0.125, truncated at 0.75 and 1.25. The integral over one of them is by the midpoint rule.
fn exact_probability(temperature_k: f64) -> f64 {
    const POINTS: u32 = 20_000;
    let normal = Normal::standard();
    let (below, inside) = (normal.cdf(-2.0), 1.0 - 2.0 * normal.cdf(-2.0));
    let share = |value: f64| ((normal.cdf((value - 1.0) / 0.125) - below) / inside).clamp(0.0, 1.0);
    let above = |point: u32| {
        let share_k = (f64::from(point) + 0.5) / f64::from(POINTS);
        let f_k = 1.0 + 0.125 * normal.inverse_cdf(below + share_k * inside);
        // The temperature falls with the heat capacity.
        let (mut low, mut high) = (0.7, 1.3);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if back_k(f_k, middle) > temperature_k { low = middle } else { high = middle }
        }
        share(low)
    };
    (0..POINTS).map(above).sum::<f64>() / f64::from(POINTS)
}

fn reached(session: &mut Session, target: &str, members: usize, seed: u64) -> PrecisionReached {
    let (draw, goal) = (Draw { seed, ..Draw::default() }, Goal::Until(target.to_owned()));
    let question = Uncertainty { members, draw, goal, ..Uncertainty::default() };
    session.uncertainty_until(&question, &mut |_, _| {}).expect("an answer")
}

fn slab() -> Session {
    Session::open(case("slab"), &Options::default().backend(BackendKind::Cpu)).expect("the CPU does not fail")
}

/// Seeds whose interval contains the probability, and the largest number of members.
fn covered(session: &mut Session, temperature_k: f64, truth: f64, seeds: u64) -> (u64, usize) {
    let target = format!("P(BACK > {temperature_k} K) ± 10 %");
    let (mut covered, mut most) = (0, 0);
    for seed in 1..=seeds {
        let found = reached(session, &target, 1_000_000, seed);
        let last = found.last().expect("a look");
        assert!(found.is_reached && found.importance.is_some(), "{target} with seed {seed}: {found:?}");
        covered += u64::from(last.low <= Some(truth) && last.high >= Some(truth));
        most = most.max(found.members());
    }
    (covered, most)
}

/// The error of a design point is that of its peak against the closed form, by marches with a coarse tolerance.
#[test]
fn the_discretisation_error_of_importance_sampling_is_that_of_its_design_points_and_of_the_nearest_members() {
    let options = Options::default().backend(BackendKind::Cpu).tolerance_k(2.0);
    let mut session = Session::open(case("slab"), &options).expect("the CPU does not fail");
    let found = reached(&mut session, "P(BACK > 769.5 K) ± 20 %", 1_000_000, 1);
    let importance = found.importance.expect("the probability is rare");
    let error = importance.discretisation_error.expect("cells and steps are adapted");
    assert_eq!((error.design_points.members, error.nearest.members), (importance.factors.len(), 64));
    let points = Ensemble::from_values(2, importance.factors.concat());
    let marched = session.march(&points).expect("the CPU does not fail");
    let back = session.case().sensors().iter().position(|sensor| sensor.name == "BACK").expect("a sensor");
    let off = |member: usize| {
        let factors = points.member(member);
        marched.peak(member, back).temperature_k - back_k(factors[0], factors[1])
    };
    let true_k = (0..points.len()).map(|member| off(member).abs()).fold(0.0, f64::max);
    let claimed_k = error.design_points.temperature_k.expect("it completes");
    assert!(claimed_k > 0.8 * true_k && claimed_k < 3.0, "{claimed_k} K, {true_k} K in truth");
    assert!(error.nearest.temperature_k.is_some_and(|nearest_k| nearest_k > 0.5 * claimed_k), "{error:?}");
    let summary = session.summary().expect("a summary").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(summary.contains("in the 64 members nearest to"), "{summary}");
}

/// With `BONDLINE_ALL` 100 seeds, and a probability of 1e-4.
#[test]
fn intervals_of_rare_probabilities_contain_the_exact_one_at_a_third_of_the_members() {
    let mut session = slab();
    let (cases, seeds) = match runs_all() {
        true => (&[(753.5, 1e-2), (769.5, 1e-3), (775.7, 1e-4)][..], 100),
        false => (&[(753.5, 1e-2), (769.5, 1e-3)][..], 12),
    };
    for &(temperature_k, magnitude) in cases {
        let truth = exact_probability(temperature_k);
        assert!((0.9..1.1).contains(&(truth / magnitude)), "{truth} at {temperature_k} K");
        let (count, most) = covered(&mut session, temperature_k, truth, seeds);
        // Members of a plain sweep for an interval of ± 10 %.
        let plain = (1.96_f64 / 0.1).powi(2) * (1.0 - truth) / truth;
        println!("{temperature_k} K, {truth:.4e}: {count} of {seeds}, at most {most} members, plain {plain:.0}");
        assert!(3 * most <= plain as usize, "{most} members, {plain} plain ones");
        assert!(100 * count >= 90 * seeds - 100, "{count} of {seeds} at {temperature_k} K");
        // Negative control: the probability of a temperature that is 4 K lower or higher.
        let (wrong, _) = covered(&mut session, temperature_k, exact_probability(temperature_k - 4.0), 6);
        assert!(wrong <= 1, "{wrong} of 6");
    }
}

/// Two plies heated from either face, one after the other: either of them, if it conducts well, heats what is between.
const TWO_WAYS: &str = r#"
initial_temperature = "300 K"
duration = "1200 s"
ply = [{ name = "A", material = "m", thickness = "8 mm" }, { name = "B", material = "m", thickness = "8 mm" }]
sensor = [{ name = "BOND", below = "A" }]
factor = [
    { name = "f_A", group = "A", property = "conductivity", small = [0.5, 1.5] },
    { name = "f_B", group = "B", property = "conductivity", small = [0.5, 1.5] },
]
[hot_face]
kind = "convective"
heat_transfer_coefficient = "200 W/m^2/K"
gas.points = [["0 s", "800 K"], ["60 s", "800 K"], ["62 s", "300 K"], ["1200 s", "300 K"]]
emissivity = 0
[back_face]
kind = "cooled"
heat_transfer_coefficient = "200 W/m^2/K"
ambient.points = [
    ["0 s", "300 K"], ["600 s", "300 K"], ["600.01 s", "800 K"], ["660 s", "800 K"], ["662 s", "300 K"],
    ["1200 s", "300 K"],
]
emissivity = 0
[resolution]
output_interval = "2 s"
tolerance = "0.05 K"
"#;

/// Of 400,000 plain members the probability is 0.01095 (0.01050 to 0.01142); one of the two ways has half of it.
#[test]
fn a_temperature_that_two_combinations_reach_has_the_probability_of_both() {
    let material = "name = \"m\"\ndensity.value = \"200 kg/m^3\"\nheat_capacity.value = \"1000 J/kg/K\"\n\
                    conductivity.value = \"0.05 W/m/K\"\nemissivity.value = 0.8\n";
    let files = BTreeMap::from([("materials/m.toml".to_owned(), material.to_owned())]);
    let case = Case::from_toml(TWO_WAYS, "two", &files).unwrap_or_else(|error| panic!("{error}"));
    let mut session =
        Session::open(case, &Options::default().backend(BackendKind::Cpu)).expect("the CPU does not fail");
    for seed in 1..=6 {
        let found = reached(&mut session, "P(BOND > 445 K) ± 10 %", 20_000, seed);
        let (importance, last) =
            (found.importance.as_ref().expect("a rare probability"), found.last().expect("a look"));
        assert_eq!(importance.design.points.len(), 2, "{found:?}");
        assert!(found.is_reached && (last.estimate / 0.01095 - 1.0).abs() < 0.15, "seed {seed}: {last:?}");
    }
    // Negative control: 3,000 members cannot exclude that a tenth is left out, and the answer says so.
    let few = reached(&mut session, "P(BOND > 445 K) ± 10 %", 3000, 4);
    assert!(!few.is_reached, "{few:?}");
}

#[test]
fn the_most_probable_combination_is_a_conducting_slab_of_little_heat_capacity() {
    let found = reached(&mut slab(), "P(BACK > 769.5 K) ± 20 %", 20_000, 1);
    let importance = found.importance.expect("a rare probability");
    let [factors] = &importance.factors[..] else { panic!("one combination: {importance:?}") };
    assert!((back_k(factors[0], factors[1]) - 769.5).abs() < 0.5, "{factors:?}");
    assert!(factors[0] > 1.1 && factors[1] < 0.9, "{factors:?}");
}

#[test]
fn a_frequent_temperature_and_a_percentile_are_sampled_plainly_to_the_stated_half_width() {
    let mut session = slab();
    let frequent = reached(&mut session, "P(BACK > 640 K) ± 0.02", 20_000, 1);
    let (truth, last) = (exact_probability(640.0), frequent.last().copied().expect("a look"));
    assert!(frequent.is_reached && frequent.importance.is_none() && last.half_width() <= 0.02, "{frequent:?}");
    assert!(last.low <= Some(truth) && last.high >= Some(truth), "{last:?} and {truth}");
    let sweep = session.answers().and_then(|answers| answers.uncertainty.clone()).expect("the sweep that was drawn");
    assert_eq!(sweep.members, frequent.members());
    let percentile = reached(&mut session, "BACK P95 ± 3 K", 20_000, 1);
    let last = percentile.last().copied().expect("a look");
    assert!(percentile.is_reached && last.half_width() <= 3.0);
    // 5 % of all members are above the 95th percentile.
    let beyond = |end: Option<f64>| exact_probability(end.expect("an end"));
    assert!(beyond(last.low) > 0.05 && beyond(last.high) < 0.05, "{last:?}");
    // Negative control: too few members for it.
    let few = reached(&mut session, "BACK P95 ± 3 K", 600, 1);
    assert!(!few.is_reached && few.members() == 600);
}

#[test]
fn the_command_says_what_was_reached_and_refuses_what_it_cannot_answer() {
    let scratch = Scratch::new("until");
    scratch.write("c/case.toml", CASE);
    let done = run(&scratch, "uncertainty c --until TC2\u{a0}P90±20K -n 3000 --quiet").succeeded();
    assert!(
        done.stdout.contains("P90 of the peak of TC2:") && done.stdout.contains("within ± 20 K"),
        "{}",
        done.stdout
    );
    let wide = run(&scratch, "uncertainty c --until TC2\u{a0}P90+-0.001K -n 700 --quiet").exited_with(1);
    assert!(wide.stderr.contains("not as narrow as --until states after 700 members"), "{}", wide.stderr);
    for (words, reason) in [
        ("--until TC9\u{a0}P90±2K", "no sensor is called \"TC9\""),
        ("--until TC2", "expected a percentile"),
        ("--until TC2\u{a0}P90±2K --sampling sobol", "independent members"),
        ("--until TC2\u{a0}P90±2K --keep members", "cannot be used with"),
        ("--until TC2\u{a0}P90±2K --members 0..10", "cannot be used with"),
    ] {
        let refused = run(&scratch, &format!("uncertainty c {words}")).exited_with(2);
        assert!(refused.stderr.contains(reason), "{words}: {}", refused.stderr);
    }
}
