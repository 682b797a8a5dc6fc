//! A progress bar on standard error.

use bondline::session::Progress;
use indicatif::style::ProgressTracker;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The style where the number of members is not known beforehand.
const WITHOUT_END: &str = "{spinner} {human_pos} members marched, {elapsed}";

/// A bar that shows how far a computation is. Clones share one bar.
#[derive(Clone)]
pub(crate) struct Bar {
    bar: ProgressBar,
    /// The size of the sweep that the style shows.
    expected: Arc<Mutex<Option<usize>>>,
}

impl Bar {
    /// The bar shows where standard error is a terminal, unless `quiet`.
    pub(crate) fn new(quiet: bool) -> Self {
        let bar = ProgressBar::no_length();
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        bar.set_style(style(WITHOUT_END));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, expected: Arc::default() }
    }

    /// Show the progress. A sweep of known size has a bar and the time left.
    pub(crate) fn show(&self, progress: Progress) {
        let mut expected = self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        if *expected != progress.expected {
            *expected = progress.expected;
            match progress.expected {
                Some(members) => {
                    self.bar.set_length(members as u64);
                    let now = Instant::now();
                    let left = Left { began: now, marched: 0, last: now };
                    let shown = "{bar:30} {human_pos} of {human_len} members in {elapsed}, {left}";
                    self.bar.set_style(style(shown).with_key("left", left));
                }
                None => {
                    self.bar.unset_length();
                    self.bar.set_style(style(WITHOUT_END));
                }
            }
        }
        self.bar.set_position(progress.marched as u64);
    }

    pub(crate) fn done(&self) {
        self.bar.finish_and_clear();
    }
}

/// How long the rest takes. Members come in runs of seconds, between which a rate of the last seconds alone would fall
/// to nothing and the time left rise without end. All members cost the same, so it is told by their mean pace.
#[derive(Clone)]
struct Left {
    began: Instant,
    /// Members marched, and when the last run of them came back.
    marched: u64,
    last: Instant,
}

impl ProgressTracker for Left {
    fn clone_box(&self) -> Box<dyn ProgressTracker> {
        Box::new(self.clone())
    }

    fn tick(&mut self, state: &ProgressState, now: Instant) {
        if state.pos() != self.marched {
            (self.marched, self.last) = (state.pos(), now);
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
