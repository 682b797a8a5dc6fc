//! Many studies of one plan side by side: what all of them want marched next is one ensemble.
//!
//! A fit asks for a dozen members at a time, and waits for them. Two hundred fits that take turns would keep a device waiting
//! two hundred times as long as two hundred that ask at once. So each has a thread and a march of its own that passes on what
//! it is asked; when no thread is left that does not wait, all that they wait for goes out together. A member does not depend
//! on the batch that it is marched in, so neither does any study on when the others ask.

use super::{Backend, March, MarchError, march_all};
use crate::ensemble::Ensemble;
use crate::plan::Plan;
use crate::traces::Traces;
use std::ops::Range;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Studies at once: enough to fill any device with a dozen members of each, and no burden as threads that mostly wait.
const AT_ONCE: usize = 128;

/// The answers to `studies` studies, in their order: each is given its number and a march through this plan alone.
///
/// # Errors
/// When the device fails.
///
/// # Panics
/// When a study asks for another plan.
pub fn together<T: Send>(
    march: &mut dyn March,
    plan: &Plan,
    studies: usize,
    study: impl Fn(usize, &mut dyn March) -> T + Sync,
) -> Result<Vec<T>, MarchError> {
    let (backend, capacity) = (march.backend(), march.capacity(plan));
    let study = &study;
    let mut answers = Vec::with_capacity(studies);
    for first in (0..studies).step_by(AT_ONCE) {
        let numbers = first..(first + AT_ONCE).min(studies);
        let (served, answered) = std::thread::scope(|scope| {
            let (ask, asked) = channel();
            let threads: Vec<_> = numbers
                .map(|number| {
                    let mut seat = Seat { plan, backend: backend.clone(), capacity, ask: ask.clone() };
                    scope.spawn(move || study(number, &mut seat))
                })
                .collect();
            let served = serve(march, plan, &asked, threads.len());
            // Whoever still asks after a failure is told so by a channel that nobody holds any more.
            drop(asked);
            let answered: Vec<T> = threads
                .into_iter()
                .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect();
            (served, answered)
        });
        served?;
        answers.extend(answered);
    }
    Ok(answers)
}

/// What a study says to those who march for it.
enum Said {
    /// March these rows, so many of so many factors.
    Wanted(Wanted),
    /// It will not ask any more.
    Done,
}

struct Wanted {
    factors: usize,
    rows: Vec<f64>,
    members: Range<usize>,
    reply: Sender<Traces>,
}

/// March what is wanted whenever all who still work wait for it.
fn serve(march: &mut dyn March, plan: &Plan, asked: &Receiver<Said>, mut working: usize) -> Result<(), MarchError> {
    let mut waiting: Vec<Wanted> = Vec::new();
    while working > 0 {
        match asked.recv() {
            Ok(Said::Wanted(wanted)) => waiting.push(wanted),
            Ok(Said::Done) => working -= 1,
            Err(_) => break,
        }
        if working == 0 || waiting.len() < working {
            continue;
        }
        let rows = waiting.iter().flat_map(|wanted| &wanted.rows).copied().collect();
        let ensemble = Ensemble::at(waiting[0].factors, rows);
        let mut runs: Vec<Traces> = Vec::new();
        march_all(march, plan, &ensemble, &mut |traces| runs.push(traces))?;
        let mut first = 0;
        for wanted in waiting.drain(..) {
            let end = first + wanted.members.len();
            // One who no longer listens has ended by a panic, which is told when its thread is joined.
            let _ = wanted.reply.send(part(&runs, first..end, wanted.members.start));
            first = end;
        }
    }
    Ok(())
}

/// Some of the members of runs in a row, as traces that begin with a number of their own.
fn part(runs: &[Traces], members: Range<usize>, first: usize) -> Traces {
    let mut part = Traces::none(first, runs[0].sensors, runs[0].instants);
    for run in runs {
        let (start, end) = (members.start.max(run.first), members.end.min(run.first + run.members()));
        if start < end {
            part.extend(run, start - run.first..end - run.first);
        }
    }
    part
}

/// The march of one study: passes on and waits.
struct Seat<'a> {
    plan: &'a Plan,
    backend: Backend,
    capacity: usize,
    ask: Sender<Said>,
}

impl March for Seat<'_> {
    fn backend(&self) -> Backend {
        self.backend.clone()
    }

    fn capacity(&self, _: &Plan) -> usize {
        self.capacity
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        assert!(std::ptr::eq(plan, self.plan), "studies that march together share one plan");
        let (reply, replied) = channel();
        let rows = members.clone().flat_map(|member| ensemble.member(member)).collect();
        let failed = || MarchError::Device {
            device: self.backend.name.clone(),
            message: "the march that many studies share failed".to_owned(),
        };
        let wanted = Wanted { factors: ensemble.factors(), rows, members, reply };
        self.ask.send(Said::Wanted(wanted)).map_err(|_| failed())?;
        replied.recv().map_err(|_| failed())
    }
}

impl Drop for Seat<'_> {
    /// However a study ends, nobody waits for it to ask again.
    fn drop(&mut self) {
        let _ = self.ask.send(Said::Done);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Precision;
    use super::super::cpu::Cpu;
    use super::*;
    use crate::case::Case;

    /// A march that remembers how many members it carried at once, and fails when it is to carry some number.
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
                return Err(MarchError::CutShort { member: 0, step: 1, steps: 2 });
            }
            self.ensembles.push(ensemble.len());
            self.cpu.march(plan, ensemble, members)
        }
    }

    /// The traces of every turn of each study, the sizes of the ensembles they took, and what each study gets alone.
    type Asked = (Result<Vec<Vec<Traces>>, MarchError>, Vec<usize>, Vec<Vec<Traces>>);

    fn asked(fails_at: usize) -> Asked {
        let case = Case::load("cases/slab".as_ref()).expect("a shipped case");
        let (plan, factors) = (Plan::new(&case), case.factors.len());
        let mut march = Counting { cpu: Cpu::new(Precision::F64), ensembles: Vec::new(), fails_at };
        // The n-th asks n + 1 times, for three members each time.
        let rows = |number: usize, turn: usize| {
            let values = (0..3 * factors).map(|i| 1.0 + 0.01 * (number + 2 * turn + i) as f64);
            Ensemble::at(factors, values.collect())
        };
        let ask = |number: usize, march: &mut dyn March| -> Vec<Traces> {
            (0..=number).map_while(|turn| march.march(&plan, &rows(number, turn), 1..3).ok()).collect()
        };
        let found = together(&mut march, &plan, 4, ask);
        let alone = (0..4).map(|number| ask(number, &mut Cpu::new(Precision::F64))).collect();
        (found, march.ensembles, alone)
    }

    #[test]
    fn studies_that_march_together_get_what_each_would_get_alone_in_as_few_ensembles_as_the_longest_asks() {
        let (found, ensembles, alone) = asked(usize::MAX);
        let same = |a: &Traces, b: &Traces| {
            (a.first, &a.temperatures_k, &a.extremes_k) == (b.first, &b.temperatures_k, &b.extremes_k)
                && a.arrivals == b.arrivals
                && a.balances == b.balances
        };
        let found = found.expect("a march");
        for (found, alone) in found.iter().zip(&alone) {
            assert!(found.len() == alone.len() && found.iter().zip(alone).all(|(a, b)| same(a, b)));
        }
        // Runs of five at most: eight members are two runs of one ensemble.
        assert_eq!(ensembles, [8, 8, 6, 6, 4, 2]);
    }

    #[test]
    fn a_march_that_fails_ends_all_studies_with_its_own_error() {
        let (found, ensembles, _) = asked(6);
        assert!(matches!(found, Err(MarchError::CutShort { .. })));
        assert_eq!(ensembles, [8, 8]);
    }
}
