//! Work–precision diagram of time integrators: sensor errors against the time for 5,000 members. See benches/README.md.
//!
//! `cargo bench --bench integrators [-- CASE]` prints the tables; without CASE it uses `lcat-2259`
//! and writes `benches/integrators.svg`.

mod adapt;
mod candidate;
#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "this bench shares only the loading of cases")]
mod common;
mod layup;
mod methods;
mod plot;
mod timing;

use bondline::adapt::adapt;
use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Sampling};
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::richardson::march_extrapolated;
use bondline::plan::GridDensity;
use bondline::plan::{Discretisation, Plan};
use bondline::plan::{StepGrowth, TimeStepControl};
use bondline_physics::layout::Ply;
use candidate::{Candidate, CoarseCells, CoarseMarch, readings, worst_k};
use methods::Method;
use plot::Curve;
use rayon::prelude::*;

const METHODS: [Method; 5] = [Method::Ros2, Method::Rodas3, Method::Rodas, Method::Bdf(2), Method::Bdf(3)];
const CANDIDATES: [Candidate; 10] = [
    // `order` is the convergence order in time with that coarse march.
    Candidate { method: Method::Ros2, coarse: CoarseMarch::None, order: 2.0 },
    // The method of bondline.
    Candidate { method: Method::Ros2, coarse: CoarseMarch::HalfSteps, order: 3.0 },
    Candidate { method: Method::Rodas3, coarse: CoarseMarch::SameSteps, order: 3.0 },
    Candidate { method: Method::Rodas3, coarse: CoarseMarch::HalfSteps, order: 3.0 },
    Candidate { method: Method::Rodas, coarse: CoarseMarch::SameSteps, order: 4.0 },
    Candidate { method: Method::Bdf(2), coarse: CoarseMarch::SameSteps, order: 2.0 },
    Candidate { method: Method::Bdf(2), coarse: CoarseMarch::HalfSteps, order: 3.0 },
    Candidate { method: Method::Bdf(3), coarse: CoarseMarch::SameSteps, order: 3.0 },
    Candidate { method: Method::Bdf(3), coarse: CoarseMarch::HalfSteps, order: 3.0 },
    Candidate { method: Method::Ros2, coarse: CoarseMarch::SameSteps, order: 2.0 },
];
/// Target errors, K, and the target in time for which the steps are adapted: half of the total target.
const TARGETS_K: [f64; 4] = [0.2, 0.1, 0.05, 0.02];
const TIME_ERROR_TARGET_K: f64 = 0.02;
/// Members for the maximum error: the nominal one, and a sample of a sweep.
const MEMBERS: usize = 16;
/// Cells relative to bondline's own plan, and steps relative to the adapted ones.
const FINER_CELLS: [f64; 10] = [0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.8];
const FINER_CELLS_ALONE: [f64; 6] = [2.0, 2.8, 4.0, 5.6, 8.0, 11.0];
const FINER_STEPS: [f64; 12] = [0.25, 0.35, 0.42, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0, 2.8];
/// Uniform step lengths for the undershoot test, s.
const EVEN_S: [f64; 4] = [0.05, 0.25, 1.0, 4.0];

/// One march of a candidate: error (K), time for 5,000 members (s), cells and steps.
#[derive(Clone, Copy)]
struct WorkPrecisionPoint {
    error_k: f64,
    seconds: f64,
    cells: usize,
    steps: usize,
}

/// Data shared by the candidates.
struct Diagram {
    case: Case,
    /// Cells of bondline's own plan.
    density: GridDensity,
    /// Time of a cell-step of each method, ns.
    ns: Vec<f64>,
}

fn main() {
    // Cargo adds the flag `--bench`.
    let requested = std::env::args().skip(1).find(|arg| !arg.starts_with("--"));
    let case = common::case(requested.as_deref().unwrap_or("lcat-2259"));
    let own = adapt(&case).unwrap_or_else(|error| panic!("{error}"));
    let rows = own.rows();
    let is_plain =
        rows.gas.is_none() && rows.max_states == 1 && !rows.has_enthalpy_steps && rows.conductivity_parts < 3;
    assert!(
        is_plain && !rows.has_holder && !rows.has_depth_factors,
        "{}: this bench supports conduction only",
        case.id()
    );
    let coarse = own.coarse().expect("an adapted plan has a coarse one");
    let cells = |ply: &Ply<u32>| f64::from(ply.end_cell - ply.first_cell);
    let density = GridDensity {
        cells_per_ply: coarse.rows().plies.iter().map(cells).collect(),
        subdivisions: vec![1; coarse.rows().plies.len()],
    };
    let diagram = Diagram { ns: timing::ns(&own, &METHODS), case, density };
    println!("| method | ns a cell-step |\n|---|---|");
    METHODS.iter().zip(&diagram.ns).for_each(|(method, ns)| println!("| {} | {ns:.2} |", method.name()));
    println!("| bondline's own march | {:.2} |", timing::own_ns(&own, &sweep(&diagram.case, 32)));

    let reference = diagram.reference();
    let adapted =
        |candidate| adapt::adapted(&diagram.case, &diagram.density, candidate, &reference, TIME_ERROR_TARGET_K);
    let controls: Vec<TimeStepControl> = CANDIDATES.par_iter().map(adapted).collect();

    println!("\nErrors in time, {} cells:\n", own.cells());
    let (nominal, reference) = ([nominal(&diagram.case)], [reference]);
    let in_time = diagram.curves(&controls, CoarseCells::Same, &nominal, &reference);
    println!("\nAll errors, {MEMBERS} members:\n");
    let members = members(&diagram.case);
    let in_all = diagram.curves(&controls, CoarseCells::Halved, &members, &truth(&diagram.case, &members));
    let title = format!("in time, on the same {} cells", own.cells());
    if requested.is_none() {
        plot::draw([(&title, &in_time), ("in time and space", &in_all)]);
    }
    diagram.even_steps();
}

impl Diagram {
    /// Reference readings of the nominal member on the cells of bondline's own plan, with negligible error in time.
    fn reference(&self) -> Vec<f64> {
        let growth = StepGrowth::Geometric { first_step_s: 0.001, share: 0.008, max_step_s: 0.05 };
        let plan = plan(&self.case, &self.density, &TimeStepControl { growth, segments: vec![] });
        readings(Method::Rodas, &plan, &plan, &nominal(&self.case))
    }

    /// Print the cheapest march of each candidate within each target; returns the Pareto front of each.
    fn curves(
        &self,
        controls: &[TimeStepControl],
        space: CoarseCells,
        members: &[Vec<f64>],
        truth: &[Vec<f64>],
    ) -> Vec<Curve> {
        println!("| candidate | {} |", TARGETS_K.map(|target_k| format!("{target_k} K")).join(" | "));
        println!("|---|{}", "---|".repeat(TARGETS_K.len()));
        let competing = CANDIDATES.iter().zip(controls).filter(|(candidate, _)| candidate.differs(space));
        competing
            .map(|(candidate, control)| {
                let grids: &[f64] = match (space, candidate.coarse) {
                    (CoarseCells::Same, _) => &[1.0],
                    (_, CoarseMarch::None) => &FINER_CELLS_ALONE,
                    _ => &FINER_CELLS,
                };
                let finer: Vec<(f64, f64)> =
                    grids.iter().flat_map(|&cells| FINER_STEPS.map(|steps| (cells, steps))).collect();
                let marks = finer.par_iter().map(|&(cells, steps)| {
                    let plies = self.density.cells_per_ply.iter().map(|ply| cells * ply).collect();
                    let density = GridDensity { cells_per_ply: plies, subdivisions: self.density.subdivisions.clone() };
                    let plan = plan(&self.case, &density, &denser(control, steps));
                    self.point(candidate, &plan, space, members, truth)
                });
                let (title, marks): (String, Vec<WorkPrecisionPoint>) = (candidate.title(space), marks.collect());
                println!("| {title} | {} |", TARGETS_K.map(|target_k| cheapest(&marks, target_k)).join(" | "));
                Curve { title, points: pareto_front(marks) }
            })
            .collect()
    }

    fn point(
        &self,
        candidate: &Candidate,
        plan: &Plan,
        space: CoarseCells,
        members: &[Vec<f64>],
        truth: &[Vec<f64>],
    ) -> WorkPrecisionPoint {
        let errors_k =
            members.iter().zip(truth).map(|(columns, truth)| worst_k(&candidate.readings(plan, space, columns), truth));
        let place = METHODS.iter().position(|&method| method == candidate.method).expect("every method is timed");
        WorkPrecisionPoint {
            error_k: errors_k.fold(0.0, f64::max),
            seconds: 5000.0 * candidate.work(plan, space) * 1e-9 * self.ns[place],
            cells: plan.cells(),
            steps: plan.steps(),
        }
    }

    /// Print the undershoot below the initial temperature for each method and step length.
    fn even_steps(&self) {
        println!("\nBelow the start, K:\n\n| method | {} |", EVEN_S.map(|step_s| format!("{step_s} s")).join(" | "));
        println!("|---|{}", "---|".repeat(EVEN_S.len()));
        // Steps end on instants, so keep only the last.
        let mut case = self.case.to_builder();
        case.resolution.output_interval_s = case.exposure.duration_s;
        case.observations.clear();
        let case = case.build().unwrap_or_else(|error| panic!("{error}"));
        for method in METHODS {
            let below = EVEN_S.map(|step_s| {
                let (first_step_s, max_step_s) = (2.0 * step_s, 2.0 * step_s);
                let growth = StepGrowth::Geometric { first_step_s, share: 1.0, max_step_s };
                let plan = plan(&case, &self.density, &TimeStepControl { growth, segments: vec![] });
                let below_k = candidate::below_k(method, &plan, &nominal(&case));
                if below_k < adapt::MAX_CONVERGENT_ERROR_K { format!("{below_k:.3}") } else { "runs away".to_owned() }
            });
            println!("| {} | {} |", method.name(), below.join(" | "));
        }
    }
}

/// Reference readings of some members by bondline's march with negligible error.
fn truth(case: &Case, members: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let sets = [("cells", "1024"), ("first_step", "0.0005 s"), ("step_growth", "0.008"), ("max_step", "0.05 s")];
    let sets = sets.map(|(name, value)| (format!("resolution.{name}"), value.to_owned()));
    let plan = Plan::new(&common::case_with(case.id(), &sets));
    let values = members.iter().flat_map(|columns| columns[1..].to_vec()).collect();
    let ensemble = Ensemble::from_values(case.factors().len(), values);
    let marched = march_extrapolated(&mut Cpu::new(Precision::F64), &plan, &ensemble, 0..members.len());
    let traces = marched.unwrap_or_else(|error| panic!("{error}"));
    (0..members.len()).map(|member| traces.member(member).to_vec()).collect()
}

/// Factor columns of the nominal member; column 0 is one.
pub(crate) fn nominal(case: &Case) -> Vec<f64> {
    columns(&Ensemble::nominal(case.factors()), 0)
}

fn members(case: &Case) -> Vec<Vec<f64>> {
    let sweep = sweep(case, MEMBERS - 1);
    std::iter::once(nominal(case)).chain((0..MEMBERS - 1).map(|member| columns(&sweep, member))).collect()
}

/// A sweep as in `bondline uncertainty`.
fn sweep(case: &Case, members: usize) -> Ensemble {
    Ensemble::sample(case.factors(), Bounds::Small, &Sampling { kind: Default::default(), seed: 1 }, members)
}

fn columns(ensemble: &Ensemble, member: usize) -> Vec<f64> {
    std::iter::once(1.0).chain(ensemble.member(member)).collect()
}

fn denser(control: &TimeStepControl, times: f64) -> TimeStepControl {
    let mut denser = control.clone();
    denser.segments.iter_mut().for_each(|segment| segment.step_density *= times);
    denser
}

/// The plan of a case at a grid density and step rule.
pub(crate) fn plan(case: &Case, density: &GridDensity, control: &TimeStepControl) -> Plan {
    Plan::with_discretisation(case, Discretisation { grid: density.clone(), time_steps: control.clone() })
}

/// The cheapest march within a target, for the table.
fn cheapest(marks: &[WorkPrecisionPoint], target_k: f64) -> String {
    let within = marks.iter().filter(|mark| mark.error_k <= target_k);
    let least = within.min_by(|a, b| a.seconds.total_cmp(&b.seconds));
    least.map_or("–".to_owned(), |mark| format!("{:.2} s: {} × {}", mark.seconds, mark.cells, mark.steps))
}

/// The Pareto front in error and time, from the fastest on.
fn pareto_front(mut marks: Vec<WorkPrecisionPoint>) -> Vec<(f64, f64)> {
    marks.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut least_k = f64::INFINITY;
    marks.retain(|mark| {
        let is_better = mark.error_k < least_k;
        least_k = least_k.min(mark.error_k);
        is_better
    });
    marks.iter().map(|mark| (mark.seconds, mark.error_k)).collect()
}
