//! Interruption: Ctrl-C, a request to terminate and the end of a terminal stop a study after the current batch of
//! members.

use crate::session::CancelToken;
use signal_hook::flag;

/// A token that the first signal stops. A second signal ends the process at once.
pub(crate) fn token_of_signals() -> CancelToken {
    let token = CancelToken::new();
    for signal in signals() {
        // A signal that cannot be caught ends the process, as without this. The first registration is called first, and
        // sees the flag as it was before the signal.
        let _ = flag::register_conditional_shutdown(signal, 128 + signal, token.stop_flag());
        let _ = flag::register(signal, token.stop_flag());
    }
    token
}

#[cfg(unix)]
fn signals() -> impl Iterator<Item = i32> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    // `nohup` starts a process that ignores the end of its terminal; a handler would undo that.
    [SIGINT, SIGTERM].into_iter().chain((!ignores_hangup()).then_some(SIGHUP))
}

#[cfg(not(unix))]
fn signals() -> [i32; 2] {
    [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM]
}

/// Whether the process was started to ignore the end of its terminal. Linux tells, in a mask whose first bit is that of
/// signal 1; elsewhere it is taken for granted.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_none_or(|mask| mask & 1 == 1)
}
