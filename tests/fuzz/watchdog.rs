//! Limits of time and memory of the mutants in this process.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time of one mutant.
const LONGEST: Duration = Duration::from_secs(20);
/// Memory of one mutant, bytes.
const MEMORY: u64 = 2 << 30;

/// The mutants that run now, one per thread.
pub(super) struct Watchdog {
    running: Vec<Mutex<Option<(u64, Instant)>>>,
    is_done: AtomicBool,
}

impl Watchdog {
    /// Run `check` for every number, on all threads. Ends the process, with the numbers that run, when a mutant takes
    /// too long or the process too much memory: neither can be stopped otherwise.
    pub(super) fn run(numbers: std::ops::Range<u64>, check: impl Fn(u64) + Sync) {
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let watchdog =
            Self { running: (0..threads).map(|_| Mutex::default()).collect(), is_done: AtomicBool::new(false) };
        let next = Mutex::new(numbers);
        thread::scope(|scope| {
            scope.spawn(|| watchdog.watch());
            let workers: Vec<_> = watchdog
                .running
                .iter()
                .map(|running| {
                    scope.spawn(|| {
                        while let Some(number) = next.lock().expect("no thread panics with it").next() {
                            *running.lock().expect("no thread panics with it") = Some((number, Instant::now()));
                            check(number);
                        }
                        *running.lock().expect("no thread panics with it") = None;
                    })
                })
                .collect();
            let ends: Vec<_> = workers.into_iter().map(thread::ScopedJoinHandle::join).collect();
            watchdog.is_done.store(true, Ordering::Relaxed);
            ends.into_iter().for_each(|end| end.expect("a mutant passes"));
        });
    }

    fn watch(&self) {
        let before = memory();
        while !self.is_done.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(50));
            let running: Vec<(u64, Instant)> =
                self.running.iter().filter_map(|running| *running.lock().expect("no thread panics with it")).collect();
            let is_late = running.iter().any(|(_, began)| began.elapsed() > LONGEST);
            let used = memory().saturating_sub(before);
            if is_late || used > MEMORY {
                let seconds = running.iter().map(|(number, began)| format!("{number}: {:.1?}", began.elapsed()));
                eprintln!("mutants {}; {} MiB", seconds.collect::<Vec<_>>().join(", "), used >> 20);
                std::process::abort();
            }
        }
    }
}

/// Resident memory of the process, bytes; zero where the system does not tell.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) << 10
}
