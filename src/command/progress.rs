//! Progress on standard error, and where the time goes.

use bondline::ensemble::Ensemble;
use bondline::march::{Backend, Begun, March, MarchError, Precision};
use bondline::plan::Plan;
use bondline::traces::Traces;
use indicatif::style::ProgressTracker;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
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
        let before = self.bar.position();
        self.bar.set_length(before + members as u64);
        let began = Instant::now();
        let left = Left { began, before, marched: 0, last: began };
        let shown = "{bar:30} {human_pos} of {human_len} members in {elapsed}, {left}";
        self.bar.set_style(style(shown).with_key("left", left));
    }

    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }

    pub(crate) fn backend_now(&self) -> Backend {
        self.march.backend()
    }

    /// March so many members, keeping the time.
    fn timed<T>(&mut self, members: usize, march: impl FnOnce(&mut dyn March) -> T) -> T {
        let began = Instant::now();
        let traces = march(&mut *self.march);
        self.seconds += began.elapsed().as_secs_f64();
        self.count(members);
        traces
    }

    /// So many members were marched.
    fn count(&self, members: usize) {
        self.bar.inc(members as u64);
        if self.bar.length().is_some_and(|length| self.bar.position() >= length) {
            self.bar.unset_length();
            self.bar.set_style(style("{spinner} {human_pos} members marched, {elapsed}"));
        }
    }

    pub(crate) fn precision(&self) -> Precision {
        self.march.backend().precision
    }
}

/// How long the rest takes. Members come in runs of seconds, between which a rate of the last seconds alone would fall
/// to nothing and the time left rise without end. All members cost the same, so it is told by their mean pace.
#[derive(Clone)]
struct Left {
    began: Instant,
    /// Members marched before.
    before: u64,
    /// Members marched since, and when the last run of them came back.
    marched: u64,
    last: Instant,
}

impl ProgressTracker for Left {
    fn clone_box(&self) -> Box<dyn ProgressTracker> {
        Box::new(self.clone())
    }

    fn tick(&mut self, state: &ProgressState, now: Instant) {
        let marched = state.pos().saturating_sub(self.before);
        if marched != self.marched {
            (self.marched, self.last) = (marched, now);
        }
    }

    fn reset(&mut self, _: &ProgressState, now: Instant) {
        (self.began, self.last, self.marched) = (now, now, 0);
    }

    fn write(&self, state: &ProgressState, text: &mut dyn Write) {
        let rest = state.len().unwrap_or_default().saturating_sub(state.pos());
        // A text that cannot be written is one that is not shown.
        let _ = match left(self.last - self.began, self.marched, rest, self.last.elapsed()) {
            Some(left) => write!(text, "{} left", HumanDuration(left)),
            None => write!(text, "none of them back yet"),
        };
    }
}

/// The time for the rest at the pace of those marched, less what has gone by since the last of them came back; `None`
/// where none has.
fn left(took: Duration, marched: u64, rest: u64, since: Duration) -> Option<Duration> {
    (marched > 0).then(|| took.mul_f64(rest as f64 / marched as f64).saturating_sub(since))
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
        let count = members.len();
        self.timed(count, |march| march.march(plan, ensemble, members))
    }

    fn begin<'a>(
        &mut self,
        plan: &'a Plan,
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Begun<'a>, MarchError> {
        self.timed(0, |march| march.begin(plan, ensemble, members))
    }

    fn finish(&mut self, begun: Begun<'_>) -> Result<Traces, MarchError> {
        let traces = self.timed(0, |march| march.finish(begun))?;
        self.count(traces.arrivals.len());
        Ok(traces)
    }

    fn tangents(&mut self, plan: &Plan, points: &Ensemble, factors: &[usize]) -> Result<Option<Traces>, MarchError> {
        self.timed(points.len(), |march| march.tangents(plan, points, factors))
    }

    fn march_plans(
        &mut self,
        plans: &[&Plan],
        ensemble: &Ensemble,
        members: Range<usize>,
    ) -> Result<Vec<Traces>, MarchError> {
        let count = plans.len() * members.len();
        self.timed(count, |march| march.march_plans(plans, ensemble, members))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_mean_pace_and_runs_down_between_runs() {
        let s = Duration::from_secs;
        assert_eq!(left(s(0), 0, 1000, s(7)), None);
        assert_eq!(left(s(10), 250, 750, s(0)), Some(s(30)));
        assert_eq!(left(s(10), 250, 750, s(4)), Some(s(26)));
        assert_eq!(left(s(10), 250, 750, s(60)), Some(s(0)));
    }
}
