//! Backends restricted to one thread, to separate the gain of SIMD from that of threads.

use bondline::ensemble::Ensemble;
use bondline::march::{Backend, March, MarchError};
use bondline::plan::Plan;
use bondline::traces::Traces;
use std::ops::Range;

/// A backend restricted to one thread.
pub(crate) struct SingleThreaded<M> {
    march: M,
    pool: rayon::ThreadPool,
}

impl<M> SingleThreaded<M> {
    pub(crate) fn new(march: M) -> Self {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        Self { march, pool: pool.unwrap_or_else(|error| panic!("{error}")) }
    }
}

impl<M: March> March for SingleThreaded<M> {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        self.pool.install(|| self.march.march(plan, ensemble, members))
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        self.pool.install(|| self.march.tangents(plan, points, factors))
    }
}
