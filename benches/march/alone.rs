//! Marches that keep to one thread: what lanes are worth, and what threads.

use crate::common::Carrier;
use bondline::ensemble::Ensemble;
use bondline::march::cpu::{Cpu, Reference};
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use std::ops::Range;

/// Members one at a time on one thread in f64: what all others are held against.
pub(crate) fn scalar() -> Carrier {
    Carrier::new("scalar", Some(1), OnOneThread::new(Reference(Precision::F64)))
}

/// Lanes on one thread, in f64: what the vector units alone are worth.
pub(crate) fn lanes_on_one_thread() -> Carrier {
    Carrier::new("lanes", Some(1), OnOneThread::new(Cpu::new(Precision::F64)))
}

/// A march whose work stays on one thread.
struct OnOneThread<M> {
    march: M,
    pool: rayon::ThreadPool,
}

impl<M> OnOneThread<M> {
    fn new(march: M) -> Self {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        Self { march, pool: pool.unwrap_or_else(|error| panic!("{error}")) }
    }
}

impl<M: March + Send> March for OnOneThread<M> {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.pool.install(|| self.march.march(plan, ensemble, members))
    }
}
