//! Interruption by the user: Ctrl-C and a request to terminate stop a study after the current batch of members.

use crate::session::CancelToken;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// A token that the first signal stops. A second signal ends the process at once.
pub(crate) fn token_of_signals() -> CancelToken {
    let token = CancelToken::new();
    for signal in [SIGINT, SIGTERM] {
        // A signal that cannot be caught ends the process, as without this. The first registration is called first, and
        // sees the flag as it was before the signal.
        let _ = flag::register_conditional_shutdown(signal, 128 + signal, token.stop_flag());
        let _ = flag::register(signal, token.stop_flag());
    }
    token
}
