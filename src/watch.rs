//! Progress on standard error, and where the time goes.

use bondline::ensemble::Ensemble;
use bondline::march::{Backend, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::ops::Range;
use std::time::{Duration, Instant};

/// A march that shows how far it is and keeps the time.
pub(crate) struct Watched {
    march: Box<dyn March>,
    bar: ProgressBar,
    /// Time inside the march, s.
    pub seconds: f64,
}

impl Watched {
    /// The bar shows where standard error is a terminal, unless `quiet`.
    pub(crate) fn new(march: Box<dyn March>, quiet: bool) -> Self {
        let bar = ProgressBar::no_length();
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        bar.set_style(style("{spinner} {human_pos} members marched, {elapsed}"));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { march, bar, seconds: 0.0 }
    }

    /// Many members are coming: show how far and how long.
    pub(crate) fn expect(&self, members: usize) {
        self.bar.set_length(self.bar.position() + members as u64);
        self.bar.set_style(style("{bar:30} {human_pos} of {human_len} members, {per_sec}, {eta} left"));
    }

    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }

    pub(crate) fn backend_now(&self) -> Backend {
        self.march.backend()
    }

    pub(crate) fn precision(&self) -> Precision {
        self.march.backend().precision
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl March for Watched {
    fn backend(&self) -> Backend {
        self.march.backend()
    }

    fn capacity(&self, plan: &Plan) -> usize {
        self.march.capacity(plan)
    }

    fn march(&mut self, plan: &Plan, ensemble: &Ensemble, members: Range<usize>) -> Result<Traces, MarchError> {
        let (began, count) = (Instant::now(), members.len() as u64);
        let traces = self.march.march(plan, ensemble, members);
        self.seconds += began.elapsed().as_secs_f64();
        self.bar.inc(count);
        if self.bar.length().is_some_and(|length| self.bar.position() >= length) {
            self.bar.unset_length();
            self.bar.set_style(style("{spinner} {human_pos} members marched, {elapsed}"));
        }
        traces
    }
}
