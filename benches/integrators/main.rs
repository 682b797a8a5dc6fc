//! The integrator's work–precision diagram: errors at the sensors against the time that 5,000 members take. See benches/README.md.
//!
//! `cargo bench --bench integrators [-- CASE]` prints the tables; of `lcat-2259`, which it takes where none is named, it writes `benches/integrators.svg`.

mod candidate;
#[path = "../common/mod.rs"]
#[expect(dead_code, reason = "only where the cases lie is shared with the benches that keep time")]
mod common;
mod layup;
mod methods;
mod pilot;
mod plot;
mod timed;

use bondline::case::{Bounds, Case};
use bondline::ensemble::{Ensemble, Sampling};
use bondline::march::Precision;
use bondline::march::cpu::Cpu;
use bondline::march::extrapolated::march_both;
use bondline::pilot::pilot;
use bondline::plan::Density;
use bondline::plan::layout::Ply;
use bondline::plan::{Discretisation, Plan};
use bondline::plan::{Growth, Pace};
use candidate::{Candidate, Second, Space, readings, worst_k};
use methods::Method;
use plot::Curve;
use rayon::prelude::*;

const METHODS: [Method; 5] = [Method::Pair, Method::Rodas3, Method::Rodas, Method::Bdf(2), Method::Bdf(3)];
const CANDIDATES: [Candidate; 10] = [
    // By which second march, and which order of its error in time.
    Candidate { method: Method::Pair, second: Second::None, order: 2.0 },
    // What bondline does.
    Candidate { method: Method::Pair, second: Second::HalfSteps, order: 3.0 },
    Candidate { method: Method::Rodas3, second: Second::SameSteps, order: 3.0 },
    Candidate { method: Method::Rodas3, second: Second::HalfSteps, order: 3.0 },
    Candidate { method: Method::Rodas, second: Second::SameSteps, order: 4.0 },
    Candidate { method: Method::Bdf(2), second: Second::SameSteps, order: 2.0 },
    Candidate { method: Method::Bdf(2), second: Second::HalfSteps, order: 3.0 },
    Candidate { method: Method::Bdf(3), second: Second::SameSteps, order: 3.0 },
    Candidate { method: Method::Bdf(3), second: Second::HalfSteps, order: 3.0 },
    Candidate { method: Method::Pair, second: Second::SameSteps, order: 2.0 },
];
/// Errors that are asked for, K, and that whose pace a pilot finds: that in time, half of what is asked for in all.
const TARGETS_K: [f64; 4] = [0.2, 0.1, 0.05, 0.02];
const AIM_K: f64 = 0.02;
/// Members over which errors are taken: the nominal one, and some of a sweep.
const MEMBERS: usize = 16;
/// Cells against those of bondline's own plan, and steps against those of a pilot.
const FINER_CELLS: [f64; 10] = [0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0, 2.8];
const FINER_CELLS_ALONE: [f64; 6] = [2.0, 2.8, 4.0, 5.6, 8.0, 11.0];
const FINER_STEPS: [f64; 12] = [0.25, 0.35, 0.42, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0, 2.8];
/// Lengths of even steps of which it is looked how far below the start they take a cell, s.
const EVEN_S: [f64; 4] = [0.05, 0.25, 1.0, 4.0];

/// One march of a candidate: its error (K), time for 5,000 members (s), cells and steps.
#[derive(Clone, Copy)]
struct Mark {
    error_k: f64,
    seconds: f64,
    cells: usize,
    steps: usize,
}

/// What all candidates share.
struct Diagram {
    case: Case,
    /// Of bondline's own plan.
    density: Density,
    /// A cell-step of each method, ns.
    ns: Vec<f64>,
}

fn main() {
    // Cargo adds a flag of its own.
    let asked = std::env::args().skip(1).find(|arg| !arg.starts_with("--"));
    let case = common::case(asked.as_deref().unwrap_or("lcat-2259"));
    let own = pilot(&case).unwrap_or_else(|error| panic!("{error}"));
    let is_plain = own.gas().is_none() && own.states() == 1 && own.levels() == 1 && own.parts() < 3;
    assert!(is_plain && !own.has_holder() && !own.has_depths(), "{}: only what conducts is marched here", case.id());
    let coarse = own.coarse().expect("a plan that a pilot made has a coarser one");
    let cells = |ply: &Ply<u32>| f64::from(ply.end_cell - ply.first_cell);
    let density = Density { plies: coarse.plies().iter().map(cells).collect(), cuts: vec![1; coarse.plies().len()] };
    let diagram = Diagram { ns: timed::ns(&own, &METHODS), case, density };
    println!("| method | ns a cell-step |\n|---|---|");
    METHODS.iter().zip(&diagram.ns).for_each(|(method, ns)| println!("| {} | {ns:.2} |", method.name()));
    println!("| bondline's own march | {:.2} |", timed::own_ns(&own, &sweep(&diagram.case, 32)));

    let reference = diagram.reference();
    let pace = |candidate| pilot::paced(&diagram.case, &diagram.density, candidate, &reference, AIM_K);
    let paces: Vec<Pace> = CANDIDATES.par_iter().map(pace).collect();

    println!("\nErrors in time, {} cells:\n", own.cells());
    let (nominal, reference) = ([nominal(&diagram.case)], [reference]);
    let in_time = diagram.curves(&paces, Space::Held, &nominal, &reference);
    println!("\nAll errors, {MEMBERS} members:\n");
    let members = members(&diagram.case);
    let in_all = diagram.curves(&paces, Space::Halved, &members, &truth(&diagram.case, &members));
    let title = format!("in time, on the same {} cells", own.cells());
    if asked.is_none() {
        plot::draw([(&title, &in_time), ("in time and space", &in_all)]);
    }
    diagram.even_steps();
}

impl Diagram {
    /// Readings of the nominal member on the cells of bondline's own plan, by so many steps that they have no error in time.
    fn reference(&self) -> Vec<f64> {
        let growth = Growth::Stated { first_step_s: 0.001, share: 0.008, largest_step_s: 0.05 };
        let plan = plan(&self.case, &self.density, &Pace { growth, slices: vec![] });
        readings(Method::Rodas, &plan, &plan, &nominal(&self.case))
    }

    /// Print the cheapest march of each candidate within each target, and tell which of its marches none beats.
    fn curves(&self, paces: &[Pace], space: Space, members: &[Vec<f64>], truth: &[Vec<f64>]) -> Vec<Curve> {
        println!("| candidate | {} |", TARGETS_K.map(|target_k| format!("{target_k} K")).join(" | "));
        println!("|---|{}", "---|".repeat(TARGETS_K.len()));
        let competing = CANDIDATES.iter().zip(paces).filter(|(candidate, _)| candidate.differs(space));
        competing
            .map(|(candidate, pace)| {
                let grids: &[f64] = match (space, candidate.second) {
                    (Space::Held, _) => &[1.0],
                    (_, Second::None) => &FINER_CELLS_ALONE,
                    _ => &FINER_CELLS,
                };
                let finer: Vec<(f64, f64)> =
                    grids.iter().flat_map(|&cells| FINER_STEPS.map(|steps| (cells, steps))).collect();
                let marks = finer.par_iter().map(|&(cells, steps)| {
                    let plies = self.density.plies.iter().map(|ply| cells * ply).collect();
                    let density = Density { plies, cuts: self.density.cuts.clone() };
                    let plan = plan(&self.case, &density, &denser(pace, steps));
                    self.mark(candidate, &plan, space, members, truth)
                });
                let (title, marks): (String, Vec<Mark>) = (candidate.title(space), marks.collect());
                println!("| {title} | {} |", TARGETS_K.map(|target_k| cheapest(&marks, target_k)).join(" | "));
                Curve { title, points: envelope(marks) }
            })
            .collect()
    }

    fn mark(&self, candidate: &Candidate, plan: &Plan, space: Space, members: &[Vec<f64>], truth: &[Vec<f64>]) -> Mark {
        let errors_k =
            members.iter().zip(truth).map(|(columns, truth)| worst_k(&candidate.readings(plan, space, columns), truth));
        let place = METHODS.iter().position(|&method| method == candidate.method).expect("every method is timed");
        Mark {
            error_k: errors_k.fold(0.0, f64::max),
            seconds: 5000.0 * candidate.work(plan, space) * 1e-9 * self.ns[place],
            cells: plan.cells(),
            steps: plan.steps(),
        }
    }

    /// Print how far below the start each method takes a cell.
    fn even_steps(&self) {
        println!("\nBelow the start, K:\n\n| method | {} |", EVEN_S.map(|step_s| format!("{step_s} s")).join(" | "));
        println!("|---|{}", "---|".repeat(EVEN_S.len()));
        // Steps end on instants: on none but the last.
        let mut case = self.case.to_builder();
        case.resolution.every_s = case.exposure.duration_s;
        case.observations.clear();
        let case = case.build().unwrap_or_else(|error| panic!("{error}"));
        for method in METHODS {
            let below = EVEN_S.map(|step_s| {
                let (first_step_s, largest_step_s) = (2.0 * step_s, 2.0 * step_s);
                let growth = Growth::Stated { first_step_s, share: 1.0, largest_step_s };
                let plan = plan(&case, &self.density, &Pace { growth, slices: vec![] });
                let below_k = candidate::below_k(method, &plan, &nominal(&case));
                if below_k < pilot::FAR_K { format!("{below_k:.3}") } else { "runs away".to_owned() }
            });
            println!("| {} | {} |", method.name(), below.join(" | "));
        }
    }
}

/// What bondline's march says of some members by so many cells and steps that it has no error.
fn truth(case: &Case, members: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let sets = [("cells", "1024"), ("first_step", "0.0005 s"), ("growth", "0.008"), ("largest_step", "0.05 s")];
    let sets = sets.map(|(name, value)| (format!("resolution.{name}"), value.to_owned()));
    let plan = Plan::new(&common::case_with(case.id(), &sets));
    let values = members.iter().flat_map(|columns| columns[1..].to_vec()).collect();
    let ensemble = Ensemble::at(case.factors().len(), values);
    let marched = march_both(&mut Cpu::new(Precision::F64), &plan, &ensemble, 0..members.len());
    let traces = marched.unwrap_or_else(|error| panic!("{error}"));
    (0..members.len()).map(|member| traces.member(member).to_vec()).collect()
}

/// The columns of the nominal member; column 0 is one.
pub(crate) fn nominal(case: &Case) -> Vec<f64> {
    columns(&Ensemble::nominal(case.factors()), 0)
}

fn members(case: &Case) -> Vec<Vec<f64>> {
    let sweep = sweep(case, MEMBERS - 1);
    std::iter::once(nominal(case)).chain((0..MEMBERS - 1).map(|member| columns(&sweep, member))).collect()
}

/// A sweep as `bondline uncertainty` draws it.
fn sweep(case: &Case, members: usize) -> Ensemble {
    Ensemble::sample(case.factors(), Bounds::Small, &Sampling { kind: Default::default(), seed: 1 }, members)
}

fn columns(ensemble: &Ensemble, member: usize) -> Vec<f64> {
    std::iter::once(1.0).chain(ensemble.member(member)).collect()
}

fn denser(pace: &Pace, times: f64) -> Pace {
    let mut denser = pace.clone();
    denser.slices.iter_mut().for_each(|slice| slice.density *= times);
    denser
}

/// A case at the cells of a density and the steps of a pace.
pub(crate) fn plan(case: &Case, density: &Density, pace: &Pace) -> Plan {
    Plan::cut(case, Discretisation { density: density.clone(), pace: pace.clone() })
}

/// The cheapest march within a target.
fn cheapest(marks: &[Mark], target_k: f64) -> String {
    let within = marks.iter().filter(|mark| mark.error_k <= target_k);
    let least = within.min_by(|a, b| a.seconds.total_cmp(&b.seconds));
    least.map_or("–".to_owned(), |mark| format!("{:.2} s: {} × {}", mark.seconds, mark.cells, mark.steps))
}

/// The marks that none beats in both error and time, from the fastest on.
fn envelope(mut marks: Vec<Mark>) -> Vec<(f64, f64)> {
    marks.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut least_k = f64::INFINITY;
    marks.retain(|mark| {
        let is_better = mark.error_k < least_k;
        least_k = least_k.min(mark.error_k);
        is_better
    });
    marks.iter().map(|mark| (mark.seconds, mark.error_k)).collect()
}
