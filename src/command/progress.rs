//! A progress bar on standard error.

use crate::session::Progress;
use indicatif::style::ProgressTracker;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The style while the number of members is not known.
const UNKNOWN_LENGTH: &str = "{spinner} {human_pos} members computed, {elapsed}";

/// The progress of a computation, in members. Clones share one bar.
#[derive(Clone)]
pub(crate) struct MarchProgress {
    bar: ProgressBar,
    /// The number of members that the style shows.
    expected: Arc<Mutex<Option<usize>>>,
}

impl MarchProgress {
    /// The bar is visible if standard error is a terminal, unless `quiet`.
    pub(crate) fn new(quiet: bool) -> Self {
        let bar = ProgressBar::no_length();
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        bar.set_style(style(UNKNOWN_LENGTH));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, expected: Arc::default() }
    }

    /// Show the progress. If the number of members is known, the bar has a length and a remaining time.
    pub(crate) fn show(&self, progress: Progress) {
        let mut expected = self.expected.lock().unwrap_or_else(PoisonError::into_inner);
        if *expected != progress.expected {
            *expected = progress.expected;
            match progress.expected {
                Some(members) => {
                    self.bar.set_length(members as u64);
                    let now = Instant::now();
                    let remaining = RemainingTime { start: now, completed: 0, last_batch: now };
                    let shown = "{bar:30} {human_pos} of {human_len} members in {elapsed}, {remaining}";
                    self.bar.set_style(style(shown).with_key("remaining", remaining));
                }
                None => {
                    self.bar.unset_length();
                    self.bar.set_style(style(UNKNOWN_LENGTH));
                }
            }
        }
        self.bar.set_position(progress.marched as u64);
    }

    /// Remove the bar.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// The remaining time by the mean rate since the start. Members complete in batches that take seconds, so a rate over
/// the last seconds, as indicatif has it, would fall to zero between batches.
#[derive(Clone)]
struct RemainingTime {
    start: Instant,
    /// Members completed, and when the last batch of them did.
    completed: u64,
    last_batch: Instant,
}

impl ProgressTracker for RemainingTime {
    fn clone_box(&self) -> Box<dyn ProgressTracker> {
        Box::new(self.clone())
    }

    fn tick(&mut self, state: &ProgressState, now: Instant) {
        if state.pos() != self.completed {
            (self.completed, self.last_batch) = (state.pos(), now);
        }
    }

    fn reset(&mut self, _: &ProgressState, now: Instant) {
        (self.start, self.last_batch, self.completed) = (now, now, 0);
    }

    fn write(&self, state: &ProgressState, text: &mut dyn Write) {
        let rest = state.len().unwrap_or_default().saturating_sub(state.pos());
        let (elapsed, since_batch) = (self.last_batch - self.start, self.last_batch.elapsed());
        // A bar that cannot be written is not shown.
        let _ = match remaining_time(elapsed, self.completed, rest, since_batch) {
            Some(time) => write!(text, "{} left", HumanDuration(time)),
            None => write!(text, "first batch running"),
        };
    }
}

/// The time for the remaining members at the mean rate up to the last batch, less the time since that batch; `None`
/// before the first batch.
fn remaining_time(elapsed: Duration, completed: u64, remaining: u64, since_batch: Duration) -> Option<Duration> {
    (completed > 0).then(|| elapsed.mul_f64(remaining as f64 / completed as f64).saturating_sub(since_batch))
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remaining_time_follows_the_mean_rate_and_decreases_between_batches() {
        let s = Duration::from_secs;
        assert_eq!(remaining_time(s(0), 0, 1000, s(7)), None);
        assert_eq!(remaining_time(s(10), 250, 750, s(0)), Some(s(30)));
        assert_eq!(remaining_time(s(10), 250, 750, s(4)), Some(s(26)));
        assert_eq!(remaining_time(s(10), 250, 750, s(60)), Some(s(0)));
    }
}
