//! Batching: the marches that concurrent studies of one plan request are combined into one ensemble.
//!
//! A fit requests a dozen members at a time and waits for them; two hundred fits in sequence would leave a GPU mostly
//! idle. So each study runs in a thread of its own with a `BatchClient` that forwards its requests; once every
//! running study waits, their members are marched as one ensemble. A member does not depend on its batch, so the
//! results do not depend on the timing of the requests.

use super::{Backend, March, MarchError, march_all};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::Traces;
use std::ops::Range;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Most concurrent studies: enough to fill any device with a dozen members of each, at little cost for threads that
/// mostly wait.
pub(crate) const MAX_CONCURRENT_STUDIES: usize = 128;

/// Run `studies` studies, each with its number and a march restricted to this plan; returns their results in order.
///
/// # Errors
/// When the device fails.
///
/// # Panics
/// When a study marches another plan.
pub fn run_batched<T: Send>(
    march: &mut dyn March,
    plan: &Plan,
    studies: usize,
    study: impl Fn(usize, &mut dyn March) -> T + Sync,
) -> Result<Vec<T>, MarchError> {
    let (backend, capacity) = (march.backend(), march.capacity(plan));
    let study = &study;
    let mut all = Vec::with_capacity(studies);
    for first in (0..studies).step_by(MAX_CONCURRENT_STUDIES) {
        let numbers = first..(first + MAX_CONCURRENT_STUDIES).min(studies);
        let (outcome, results) = std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let threads: Vec<_> = numbers
                .map(|number| {
                    let mut client = BatchClient { plan, backend: backend.clone(), capacity, sender: sender.clone() };
                    scope.spawn(move || study(number, &mut client))
                })
                .collect();
            let outcome = serve(march, plan, &receiver, threads.len());
            // After an error the closed channel makes every further request fail.
            drop(receiver);
            let results: Vec<T> = threads
                .into_iter()
                .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect();
            (outcome, results)
        });
        outcome?;
        all.extend(results);
    }
    Ok(all)
}

/// Message of a study to the batching loop.
enum Message {
    /// A request to march members.
    Request(MarchRequest),
    /// The study has ended.
    Done,
}

struct MarchRequest {
    factors: usize,
    rows: Vec<f64>,
    members: Range<usize>,
    reply: Sender<Traces>,
}

/// March all pending requests whenever every running study waits for one.
fn serve(
    march: &mut dyn March,
    plan: &Plan,
    requests: &Receiver<Message>,
    mut working: usize,
) -> Result<(), MarchError> {
    let mut waiting: Vec<MarchRequest> = Vec::new();
    while working > 0 {
        match requests.recv() {
            Ok(Message::Request(request)) => waiting.push(request),
            Ok(Message::Done) => working -= 1,
            Err(_) => break,
        }
        if working == 0 || waiting.len() < working {
            continue;
        }
        let rows = waiting.iter().flat_map(|request| &request.rows).copied().collect();
        let ensemble = Ensemble::from_values(waiting[0].factors, rows);
        let mut runs: Vec<Traces> = Vec::new();
        march_all(march, plan, &ensemble, &mut |traces| runs.push(traces))?;
        let mut first = 0;
        for request in waiting.drain(..) {
            let end = first + request.members.len();
            // A study whose receiver is gone has panicked; joining its thread reports the panic.
            let _ = request.reply.send(extract_members(&runs, first..end, request.members.start));
            first = end;
        }
    }
    Ok(())
}

/// Some members of consecutive batches, as traces numbered from `first`.
fn extract_members(runs: &[Traces], members: Range<usize>, first: usize) -> Traces {
    let mut part = Traces::empty(first, runs[0].sensors, runs[0].instants);
    for run in runs {
        let (start, end) = (members.start.max(run.first), members.end.min(run.first + run.members()));
        if start < end {
            part.extend(run, start - run.first..end - run.first);
        }
    }
    part
}

/// The march of one study: forwards requests and waits for the results.
struct BatchClient<'a> {
    plan: &'a Plan,
    backend: Backend,
    capacity: usize,
    sender: Sender<Message>,
}

impl March for BatchClient<'_> {
    fn backend(&self) -> Backend {
        self.backend.clone()
    }

    fn capacity(&self, _: &Plan) -> usize {
        self.capacity
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        assert!(std::ptr::eq(plan, self.plan), "batched studies share one plan");
        let (reply, replied) = channel();
        let rows = members.clone().flat_map(|member| ensemble.member(member)).collect();
        let failed =
            || MarchError::Device { device: self.backend.name.clone(), message: "the batched march failed".to_owned() };
        let request = MarchRequest { factors: ensemble.factors(), rows, members, reply };
        self.sender.send(Message::Request(request)).map_err(|_| failed())?;
        replied.recv().map_err(|_| failed())
    }
}

impl Drop for BatchClient<'_> {
    /// However a study ends, the batching loop must not wait for its next request.
    fn drop(&mut self) {
        let _ = self.sender.send(Message::Done);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Precision;
    use super::super::cpu::Cpu;
    use super::*;
    use crate::case::Case;

    /// A march that records the size of each ensemble, and fails at one size.
    struct Counting {
        cpu: Cpu,
        ensembles: Vec<usize>,
        fails_at: usize,
    }

    impl March for Counting {
        fn backend(&self) -> Backend {
            self.cpu.backend()
        }

        fn capacity(&self, _: &Plan) -> usize {
            5
        }

        fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
            if ensemble.len() == self.fails_at {
                return Err(MarchError::Incomplete { member: 0, step: 1, steps: 2 });
            }
            self.ensembles.push(ensemble.len());
            self.cpu.march(plan, ensemble, members)
        }
    }

    /// Traces of every request of each study, sizes of the ensembles, and the traces of each study run alone.
    type Batched = (Result<Vec<Vec<Traces>>, MarchError>, Vec<usize>, Vec<Vec<Traces>>);

    fn run_four(fails_at: usize) -> Batched {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        let (plan, factors) = (Plan::new(&case), case.factors.len());
        let mut march = Counting { cpu: Cpu::new(Precision::F64), ensembles: Vec::new(), fails_at };
        // Study n sends n + 1 requests, of three members each.
        let rows = |number: usize, request: usize| {
            let values = (0..3 * factors).map(|i| 1.0 + 0.01 * (number + 2 * request + i) as f64);
            Ensemble::from_values(factors, values.collect())
        };
        let ask = |number: usize, march: &mut dyn March| -> Vec<Traces> {
            (0..=number).map_while(|request| march.march(&plan, &rows(number, request), 1..3).ok()).collect()
        };
        let found = run_batched(&mut march, &plan, 4, ask);
        let alone = (0..4).map(|number| ask(number, &mut Cpu::new(Precision::F64))).collect();
        (found, march.ensembles, alone)
    }

    #[test]
    fn batched_studies_get_the_results_of_single_ones_in_as_few_ensembles_as_the_longest_requests() {
        let (found, ensembles, alone) = run_four(usize::MAX);
        let same = |a: &Traces, b: &Traces| {
            (a.first, &a.temperatures_k, &a.extremes_k) == (b.first, &b.temperatures_k, &b.extremes_k)
                && a.statuses == b.statuses
                && a.balances == b.balances
        };
        let found = found.expect("a march");
        for (found, alone) in found.iter().zip(&alone) {
            assert!(found.len() == alone.len() && found.iter().zip(alone).all(|(a, b)| same(a, b)));
        }
        // With a capacity of five, eight members are two batches of one ensemble.
        assert_eq!(ensembles, [8, 8, 6, 6, 4, 2]);
    }

    #[test]
    fn a_failed_march_ends_all_studies_with_its_error() {
        let (found, ensembles, _) = run_four(6);
        assert!(matches!(found, Err(MarchError::Incomplete { .. })));
        assert_eq!(ensembles, [8, 8]);
    }
}
