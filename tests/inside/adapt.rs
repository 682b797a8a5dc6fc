//! Adaptation of grid and time steps to a tolerance, and Richardson extrapolation of two resolutions.

use crate::support::{BALANCE, case, cases, modified, schedule};
use bondline::adapt::adapt;
use bondline::case::{Case, Conductivity, Face, Resolution, Sensor, Side, ThreePartConductivity};
use bondline::ensemble::Ensemble;
use bondline::march::richardson::march_extrapolated;
use bondline::march::{March, Precision, cpu::Cpu};
use bondline::plan::GridDensity;
use bondline::plan::{Discretisation, Plan};
use bondline::plan::{StepGrowth, TimeStepControl};
use bondline::random::RandomStream;
use bondline::traces::{Gauge, MemberStatus, Traces};
use bondline::verify::problems::flexible;
use bondline::verify::random_case::random_case;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

fn marched(plan: &Plan, case: &Case) -> Traces {
    let ensemble = Ensemble::nominal(case.factors());
    march_extrapolated(&mut Cpu::new(Precision::F64), plan, &ensemble, 0..1).expect("the processor does not fail")
}

/// Largest difference at any sensor and instant, K.
fn largest_difference_k(one: &Traces, other: &Traces) -> f64 {
    assert_eq!(one.temperatures_k.len(), other.temperatures_k.len(), "not the same instants");
    let pairs = one.temperatures_k.iter().zip(&other.temperatures_k);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A case on many cells, distributed without adaptation, and on short steps.
fn fine(case: &Case) -> Plan {
    let density = GridDensity::by_diffusion_time(case, 240.0);
    Plan::with_discretisation(
        case,
        Discretisation { grid: density, time_steps: TimeStepControl::scaled(&Resolution::default(), 1.0) },
    )
}

#[test]
fn an_adapted_plan_meets_its_tolerance_against_an_independent_grid() {
    for id in ["slab", "lcat-2259", "lcat-2330", "stack-saffil-sic"] {
        let case = case(id);
        let plan = adapt(&case).expect("the processor does not fail");
        let off_k = largest_difference_k(&marched(&plan, &case), &marched(&fine(&case), &case));
        assert!(off_k <= 0.05, "{id}: {off_k} K off on {} cells, {} steps", plan.cells(), plan.steps());
    }
}

#[test]
fn the_reported_error_is_close_to_the_true_one_and_follows_the_tolerance() {
    let case = case("lcat-2259");
    let reference = marched(&fine(&case), &case);
    let mut last = (f64::INFINITY, 0);
    // On fewer than some 9,000 cell-steps members at corners of the large bounds diverge, whatever the tolerance.
    for tolerance_k in [2.0, 0.2, 0.05] {
        let case = modified(&case, |case| case.resolution.tolerance_k = Some(tolerance_k));
        let plan = adapt(&case).expect("the processor does not fail");
        let reached = plan.error_estimate.as_ref().expect("an adapted plan has an estimate");
        let off_k = largest_difference_k(&marched(&plan, &case), &reference);
        assert!(reached.nominal_k <= tolerance_k, "{reached:?}");
        assert!((0.5..=1.5).contains(&(off_k / reached.nominal_k)), "{reached:?}, but {off_k} K off");
        let work = plan.cells() * plan.steps();
        assert!(off_k < last.0 && work > last.1, "{off_k} K with {work} cell-steps, after {last:?}");
        last = (off_k, work);
    }
}

/// Felt 0.3 mm below a face that jumps from 300 to 800 K at the start. The thermocouple next to the face shows the
/// error of the first steps, as does the stored heat.
#[test]
fn after_a_temperature_jump_at_the_start_the_reported_error_holds_and_the_energy_balance_closes() {
    let case = modified(&case("lcat-2259-tc3"), |case| {
        case.exposure.hot_face = Face::Held(schedule(&[0.0, 0.0], &[300.0, 800.0]));
        let depth_m = case.layup.origin_m + 0.3e-3;
        case.sensors.push(Sensor {
            name: "NEAR".to_owned(),
            depth_m,
            side: Side::Both,
            time_constant_s: 0.0,
            pyrometer: None,
        });
    });
    let plan = adapt(&case).expect("the processor does not fail");
    let reached = plan.error_estimate.as_ref().expect("an adapted plan has an estimate");
    let pace = TimeStepControl { growth: StepGrowth::Graded { coefficient: 2e-3 }, segments: Vec::new() };
    let finer = Plan::with_discretisation(
        &case,
        Discretisation { grid: GridDensity::by_diffusion_time(&case, 400.0), time_steps: pace },
    );
    let (adapted, reference) = (marched(&plan, &case), marched(&finer, &case));
    let off_k = largest_difference_k(&adapted, &reference);
    assert!(reached.nominal_k <= reached.tolerance_k && off_k <= reached.nominal_k, "{off_k} K off, {reached:?}");
    let residual = adapted.balances[0].residual().abs();
    assert!(residual <= BALANCE, "energy residual {residual}");
    // Half of the cells and steps, without extrapolation: the jump shows in the temperatures.
    let coarse = marched(plan.coarse.as_deref().expect("a plan has a coarse one"), &case);
    assert!(
        largest_difference_k(&coarse, &reference) > 2.0 * reached.nominal_k,
        "the jump is too weak to test the steps"
    );
}

/// A thin felt between two faces that rise by 100 K/s: any step resolves its temperatures, but a long one does not
/// resolve its mass.
#[test]
fn a_uniformly_heated_sample_is_adapted_to_its_mass_loss() {
    let ramp = r#"kind = "held"
temperature = { points = [["0 s", "300 K"], ["10 s", "1300 K"]], outside = "hold" }"#;
    let toml = format!(
        r#"initial_temperature = "300 K"
duration = "12 s"
pressure = "10 kPa"
decomposition = true
[[ply]]
name = "S"
material = "pyrogel3350"
thickness = "0.1 mm"
[[sensor]]
name = "TC"
depth = "0.05 mm"
[hot_face]
{ramp}
[back_face]
{ramp}
[resolution]
output_interval = "0.25 s"
"#
    );
    let case =
        Case::from_toml(&toml, "sample", &BTreeMap::<String, String>::new()).unwrap_or_else(|error| panic!("{error}"));
    let ply = &case.layup().plies[0];
    let decomposition = ply.material.decomposition.as_ref().expect("it decomposes");
    let losses: f64 = decomposition.reactions.iter().map(|reaction| reaction.mass_loss).sum();
    let possible_kg_m2 = ply.material.density_kg_m3 * ply.thickness_m * losses;

    let plan = adapt(&case).expect("the processor does not fail");
    let reached = plan.error_estimate.as_ref().expect("an adapted plan has an estimate");
    assert!(reached.gauges.iter().all(|gauge| gauge.error <= gauge.tolerance), "{reached:?}");
    let (adapted, reference) = (marched(&plan, &case), marched(&fine(&case), &case));
    let lost = |traces: &Traces| traces.gauge(0, Gauge::MassLost).expect("it loses mass").to_vec();
    let (adapted, reference) = (lost(&adapted), lost(&reference));
    let most = adapted.iter().copied().fold(0.0, f64::max);
    assert!(most > 0.99 * possible_kg_m2 && most <= 1.001 * possible_kg_m2, "{most} of {possible_kg_m2} kg/m²");
    let off = adapted.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / possible_kg_m2;
    let error = reached.gauges.iter().find(|gauge| gauge.gauge == Gauge::MassLost).expect("a gauge").error;
    assert!(off <= 2.0 * error, "mass is {off} of its peak off, reported {error}");
    // A few steps resolve the temperatures only.
    let pace = TimeStepControl { growth: StepGrowth::Graded { coefficient: 2.4 }, segments: Vec::new() };
    let few_plan =
        Plan::with_discretisation(&case, Discretisation { grid: plan.discretisation.grid.clone(), time_steps: pace });
    let few = lost(&marched(&few_plan, &case));
    let few_off = few.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / possible_kg_m2;
    assert!(few_off > 10.0 * error, "{} steps are enough: error {few_off}, reported {error}", few_plan.steps());
}

#[test]
fn every_shipped_case_meets_its_tolerance_or_states_its_cells() {
    for case in cases() {
        let plan = adapt(&case).expect("the processor does not fail");
        match &plan.error_estimate {
            Some(reached) => assert!(reached.nominal_k <= reached.tolerance_k, "{}: {reached:?}", case.id()),
            None => assert_eq!(case.resolution().tolerance_k, None, "{}", case.id()),
        }
    }
}

#[test]
fn stated_cells_and_steps_are_not_adapted() {
    let case = modified(&case("lcat-2259"), |case| {
        case.resolution = Resolution { tolerance_k: None, cells: 96, ..case.resolution };
    });
    let (piloted, stated) = (adapt(&case).expect("the processor does not fail"), Plan::new(&case));
    assert_eq!(piloted.error_estimate, None);
    assert_eq!((piloted.cells(), piloted.steps()), (stated.cells(), stated.steps()));
}

/// Depths of the nodes of a plan, and of the lower faces of its cells, m.
fn nodes_and_faces_m(plan: &Plan) -> (Vec<f64>, Vec<f64>) {
    let mut top_m = 0.0;
    let lie = plan.rows.data.cells.iter().map(|cell| {
        let node_m = top_m + cell.above_m;
        top_m += cell.width_m;
        (node_m, top_m)
    });
    lie.unzip()
}

fn same(some_m: &[f64], others_m: &[f64]) -> bool {
    some_m.len() == others_m.len()
        && some_m.iter().zip(others_m).all(|(some_m, other_m)| (some_m - other_m).abs() < 1e-12)
}

/// Otherwise the errors of both resolutions would not be proportional. An inner ply has every other face. A ply at an
/// outer face has a node on the face, and every other node from there to its last, wider cell.
#[test]
fn the_coarse_plan_has_every_other_step_and_face_of_the_fine_one() {
    let case = case("lcat-2259");
    let plan = Plan::new(&case);
    let coarse = plan.coarse.as_ref().expect("a plan has a coarse one");
    assert_eq!(coarse.times_s, plan.times_s.iter().copied().step_by(2).collect::<Vec<_>>());
    let [(fine_nodes_m, fine_faces_m), (wide_nodes_m, wide_faces_m)] = [&plan, coarse].map(nodes_and_faces_m);
    let last = plan.rows.plies.len() - 1;
    for (p, (ply, half)) in plan.rows.plies.iter().zip(&coarse.rows.plies).enumerate() {
        let [fine, wide] = [ply, half].map(|ply| ply.first_cell as usize..ply.end_cell as usize);
        assert_eq!(fine.len(), 2 * wide.len());
        let every_other =
            |all_m: &[f64], from: usize| all_m[fine.clone()][from..].iter().copied().step_by(2).collect::<Vec<_>>();
        let (of_wide, of_fine) = if p == 0 {
            let inner = wide.len() - 1;
            (&wide_nodes_m[wide][..inner], every_other(&fine_nodes_m, 0)[..inner].to_vec())
        } else if p == last {
            (&wide_nodes_m[wide][1..], every_other(&fine_nodes_m, 1)[1..].to_vec())
        } else {
            (&wide_faces_m[wide], every_other(&fine_faces_m, 1))
        };
        assert!(same(of_wide, &of_fine), "ply {p}: {of_wide:?}, {of_fine:?}");
    }
}

#[test]
fn cell_widths_grow_smoothly_away_from_the_hot_face() {
    let plan = Plan::new(&case("lcat-2259"));
    let mut widest: f64 = 1.0;
    for ply in &plan.rows.plies[1..plan.rows.plies.len() - 1] {
        let cells = &plan.rows.data.cells[ply.first_cell as usize..ply.end_cell as usize];
        for pair in cells.windows(2) {
            let times = pair[1].width_m / pair[0].width_m;
            assert!(times > 1.0 && times < 1.05, "{times} times as wide as the one above");
        }
        widest = widest.max(cells[cells.len() - 1].width_m / cells[0].width_m);
    }
    assert!((1.2..2.0).contains(&widest), "{widest} times as wide below as above");
}

#[test]
fn plies_of_zero_initial_conductivity_are_divided_into_cells() {
    let depth_m = |case: &Case| case.layup().back_m() - case.layup().origin_m;
    let case = case("lcat-2259");
    for insulated in [1..2, 0..case.layup().plies.len()] {
        let case = modified(&case, |case| {
            for ply in &mut case.layup.plies[insulated] {
                let material = Arc::make_mut(&mut ply.material);
                material.id += "_insulating";
                material.conductivity = Conductivity::ThreePart(ThreePartConductivity {
                    solid_w_m_k: 0.0,
                    solid_exponent: 0.0,
                    pores: Vec::new(),
                    extinction_1_m: None,
                    extinction_follows_density: false,
                    range_k: (200.0, 2000.0),
                });
            }
        });
        let plan = Plan::new(&case);
        assert!(
            plan.rows.data.cells.iter().all(|cell| cell.width_m > 0.0 && cell.above_m >= 0.0 && cell.below_m >= 0.0)
        );
        let (_, faces_m) = nodes_and_faces_m(&plan);
        assert!((faces_m[faces_m.len() - 1] / depth_m(&case) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_extrapolated_error_falls_by_more_than_five_when_both_resolutions_are_halved() {
    let case = flexible::flexible_layup();
    let at = |times: f64| {
        let pace = TimeStepControl::scaled(&Resolution::default(), 4.0 / times);
        Plan::with_discretisation(
            &case,
            Discretisation { grid: GridDensity::by_diffusion_time(&case, 48.0 * times), time_steps: pace },
        )
    };
    let plans = [1.0, 2.0, 4.0].map(at);
    let both = plans.each_ref().map(|plan| marched(plan, &case));
    let alone = plans.each_ref().map(|plan| {
        let traces = Cpu::new(Precision::F64).march(plan, &Ensemble::nominal(case.factors()), 0..1);
        traces.expect("the processor does not fail")
    });
    let falls = |of: &[Traces; 3]| largest_difference_k(&of[0], &of[1]) / largest_difference_k(&of[1], &of[2]);
    assert!((3.0..5.5).contains(&falls(&alone)), "without extrapolation: {}", falls(&alone));
    // Third order would be eight; tables have a corner every 5 K.
    assert!(falls(&both) > 5.0, "with extrapolation: {}", falls(&both));
    assert!(
        largest_difference_k(&both[0], &both[2]) < 0.3 * largest_difference_k(&alone[0], &both[2]),
        "extrapolation is no better than one resolution"
    );
}

/// Seeds of the random cases, unless the environment sets their number; the claim was measured on the first 300. Those
/// before 20 are rows of `bondline verify`, which the integration tests run.
const SEEDS: Range<u64> = 20..30;

#[test]
fn the_reported_discretisation_error_covers_the_true_one_in_95_percent_of_random_cases_and_is_never_less_than_half() {
    let count = std::env::var("BONDLINE_RANDOM_CASES").map(|cases| cases.parse().expect("a number of cases"));
    let (mut judged, mut covered, mut caught) = (0, 0, 0);
    let (mut gauges, mut gauges_covered) = (0, 0);
    let seeds = count.map_or(SEEDS, |count| 0..count);
    for seed in seeds.clone() {
        let case = random_case(seed).unwrap_or_else(|error| panic!("{error}"));
        let plan = adapt(&case).expect("the processor does not fail");
        let Some(reached) = plan.error_estimate.clone() else { continue };
        // Refined six times: the estimate is made of two and four times.
        let finer = plan.rediscretised(&case, plan.discretisation.refined(6));
        let reference = marched(&finer, &case);
        if reference.statuses != [MemberStatus::Completed] {
            continue;
        }
        let ratios = reached.error_ratios(&marched(&plan, &case), &reference);
        assert!(ratios.iter().all(|ratio| *ratio <= 2.0), "case {seed}: {ratios:?}, {reached:?}");
        judged += 1;
        covered += u64::from(ratios[0] <= 1.0);
        gauges += ratios.len() - 1;
        gauges_covered += ratios[1..].iter().filter(|ratio| **ratio <= 1.0).count();
        let coarse = plan.coarse.as_deref().expect("a plan has a coarse one");
        caught += u64::from(largest_difference_k(&marched(coarse, &case), &reference) > reached.nominal_k);
    }
    assert!(judged * 10 >= 8 * (seeds.end - seeds.start), "only {judged} cases were marched to their end");
    assert!(covered * 100 >= 95 * judged, "{covered} of {judged}");
    assert!(
        gauges_covered * 100 >= 95 * gauges,
        "{gauges_covered} of {gauges} gas fluxes, masses, fronts and pressures"
    );
    assert!(caught * 10 >= 8 * judged, "half of the cells and steps, not extrapolated: caught in {caught} of {judged}");
}

/// A slab of ρ = 1000 kg/m³, c = 1000 J/kg/K, behind which nothing conducts, with its three sensors.
#[derive(Clone, Copy, Debug)]
struct Slab {
    thickness_m: f64,
    conductivity_w_m_k: f64,
}

const HEAT_CAPACITY_J_M3_K: f64 = 1e6;

impl Slab {
    fn case(self, duration_s: f64, hot_face: &str) -> Case {
        let Self { thickness_m, conductivity_w_m_k } = self;
        let material = format!(
            "name = \"M\"\n[density]\nvalue = \"1000 kg/m^3\"\n[heat_capacity]\nvalue = \"1000 J/kg/K\"\n\
             [conductivity]\nvalue = \"{conductivity_w_m_k} W/m/K\"\n[emissivity]\nvalue = 0.8\n"
        );
        let toml = format!(
            r#"initial_temperature = "300 K"
duration = "{duration_s} s"
ply = [{{ name = "S", material = "m", thickness = "{thickness_m} m", limit = "3000 K" }}]
sensor = [
    {{ name = "F", depth = "0 mm" }},
    {{ name = "M", depth = "{} m" }},
    {{ name = "B", below = "S" }},
]
[hot_face]
{hot_face}
[resolution]
output_interval = "{} s"
"#,
            thickness_m / 4.0,
            duration_s / 200.0
        );
        let files = BTreeMap::from([("materials/m.toml".to_owned(), material)]);
        Case::from_toml(&toml, "slab", &files).unwrap_or_else(|error| panic!("{error}"))
    }

    /// The case under square pulses of a flux, each given by its start, its end and its flux.
    fn pulsed(self, duration_s: f64, pulses: &[(f64, f64, f64)]) -> Case {
        let corners = pulses.iter().map(|(start_s, end_s, flux_w_m2)| {
            format!(
                "[\"{start_s} s\", \"0 W/m^2\"], [\"{start_s} s\", \"{flux_w_m2} W/m^2\"], \
                 [\"{end_s} s\", \"{flux_w_m2} W/m^2\"], [\"{end_s} s\", \"0 W/m^2\"]"
            )
        });
        let corners: Vec<String> = corners.collect();
        let flux = format!("flux = {{ points = [{}], outside = \"zero\" }}", corners.join(", "));
        self.case(duration_s, &format!("kind = \"heated\"\nemissivity = 0\n{flux}"))
    }

    /// The exact rise of the temperature at a depth after the start of a constant flux (Carslaw & Jaeger, Conduction of
    /// Heat in Solids, 1959, section 3.8), K.
    fn rise_k(self, depth_m: f64, time_s: f64, flux_w_m2: f64) -> f64 {
        if time_s <= 0.0 {
            return 0.0;
        }
        let Self { thickness_m, conductivity_w_m_k } = self;
        let fourier = conductivity_w_m_k / HEAT_CAPACITY_J_M3_K * time_s / thickness_m.powi(2);
        let from_back = 1.0 - depth_m / thickness_m;
        let terms = (40.0 / (PI * PI * fourier)).sqrt().ceil() as usize + 1;
        let term = |n: f64| {
            (if n % 2.0 == 0.0 { 1.0 } else { -1.0 }) / (n * n)
                * (-(n * PI).powi(2) * fourier).exp()
                * (n * PI * from_back).cos()
        };
        let series: f64 = (1..=terms).map(|n| term(n as f64)).sum();
        flux_w_m2 * thickness_m / conductivity_w_m_k
            * (fourier + (3.0 * from_back.powi(2) - 1.0) / 6.0 - 2.0 / PI.powi(2) * series)
    }

    /// Largest difference of the sensors from the exact temperatures after the start, K.
    fn error_k(self, plan: &Plan, traces: &Traces, pulses: &[(f64, f64, f64)]) -> f64 {
        let depths_m = [0.0, self.thickness_m / 4.0, self.thickness_m];
        let mut worst_k = 0.0_f64;
        for (sensor, depth_m) in depths_m.into_iter().enumerate() {
            for (found_k, time_s) in traces.trace(0, sensor).iter().zip(plan.instants_s()).skip(1) {
                let rise = |&(start_s, end_s, flux_w_m2): &(f64, f64, f64)| {
                    self.rise_k(depth_m, time_s - start_s, flux_w_m2) - self.rise_k(depth_m, time_s - end_s, flux_w_m2)
                };
                worst_k = worst_k.max((found_k - 300.0 - pulses.iter().map(rise).sum::<f64>()).abs());
            }
        }
        worst_k
    }
}

#[test]
fn ten_seconds_of_heating_in_a_day_give_their_heat() {
    let (slab, pulses) = (Slab { thickness_m: 0.01, conductivity_w_m_k: 1.0 }, [(3600.0, 3610.0, 1e5)]);
    let case = slab.pulsed(86_400.0, &pulses);
    let plan = adapt(&case).expect("the processor does not fail");
    let reached = plan.error_estimate.as_ref().expect("an adapted plan has an estimate");
    let traces = marched(&plan, &case);
    let error_k = slab.error_k(&plan, &traces, &pulses);
    assert!(reached.nominal_k <= 0.05 && error_k <= reached.nominal_k, "{error_k} K, {reached:?}");
    let end_k = *traces.trace(0, 2).last().expect("an instant");
    assert!((end_k - 400.0).abs() < 0.05, "the heat is 1 MJ/m², which warms 10 mm by 100 K: {end_k} K");
    assert!(plan.steps() < 1000, "{} steps", plan.steps());
}

/// Pulses of 1 ms to 60 s anywhere in runs of 1 s to 2 days.
#[test]
fn the_reported_error_of_short_pulses_covers_the_true_one() {
    let mut numbers = RandomStream::new(9, 1);
    let mut logarithmic = |low: f64, high: f64| low * (high / low).powf(numbers.uniform());
    let mut covered = 0;
    const RUNS: usize = 12;
    for run in 0..RUNS {
        let duration_s = logarithmic(1.0, 172_800.0).round();
        let slab = Slab { thickness_m: logarithmic(1e-4, 1e-2), conductivity_w_m_k: logarithmic(0.3, 30.0) };
        let number = 1 + run % 3;
        let part_s = duration_s / number as f64;
        let pulses: Vec<(f64, f64, f64)> = (0..number)
            .map(|part| {
                let width_s = logarithmic(1e-3, 60.0).min(0.2 * part_s);
                let start_s = (part as f64 + logarithmic(0.01, 0.75)) * part_s;
                // A rise of the face by 300 K at most, and of the whole slab.
                let face = (slab.conductivity_w_m_k * HEAT_CAPACITY_J_M3_K * PI / (4.0 * width_s)).sqrt();
                let whole = HEAT_CAPACITY_J_M3_K * slab.thickness_m / width_s;
                (start_s, start_s + width_s, 300.0 * face.min(whole))
            })
            .collect();
        let case = slab.pulsed(duration_s, &pulses);
        let plan = adapt(&case).expect("the processor does not fail");
        let reached = plan.error_estimate.as_ref().expect("an adapted plan has an estimate");
        let error_k = slab.error_k(&plan, &marched(&plan, &case), &pulses);
        assert!(error_k <= 2.0 * reached.nominal_k, "{slab:?}, {pulses:?} in {duration_s} s: {error_k} K, {reached:?}");
        covered += usize::from(error_k <= reached.nominal_k);
        // Negative control: without the pulses the temperatures do not change.
        assert!(error_k < slab.error_k(&plan, &marched(&plan, &case), &[]), "the pulses do not show");
    }
    assert!(covered >= RUNS - 1, "{covered} of {RUNS}");
}

/// 1,100 pulses of a few thousandths of a per cent of the run: too many corners of too small an effect to end on.
#[test]
fn steps_that_pass_over_pulses_give_their_heat() {
    let slab = Slab { thickness_m: 0.01, conductivity_w_m_k: 1.0 };
    let pulses: Vec<(f64, f64, f64)> =
        (0..1100).map(|n| 3.6 * f64::from(n) + 13.7).map(|t| (t, t + 0.2, 1e4)).collect();
    let case = slab.pulsed(4000.0, &pulses);
    let given_j_m2 = |coefficient: f64| {
        let pace = TimeStepControl { growth: StepGrowth::Graded { coefficient }, segments: Vec::new() };
        let grid = GridDensity::by_diffusion_time(&case, 16.0);
        let plan = Plan::with_discretisation(&case, Discretisation { grid, time_steps: pace });
        (marched(&plan, &case).balances[0].hot_in_j_m2, plan.steps())
    };
    for coefficient in [0.5, 1.0, 3.0] {
        let (heat_j_m2, steps) = given_j_m2(coefficient);
        assert!(steps < 160, "{steps} steps end on the corners");
        assert!((heat_j_m2 - 2.2e6).abs() < 1e-6 * 2.2e6, "{heat_j_m2} J/m² over {steps} steps");
    }
}
