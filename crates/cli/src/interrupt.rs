//! Ctrl-C, and the signal by which schedulers end what they started.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// What a process ends with that a signal ended, as shells say it.
const ENDED_BY_SIGNAL: i32 = 128;

static STOPPED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// From now on the first signal is only noted, for [`stopped`]; the second ends the process.
///
/// # Errors
/// If the system does not allow it.
pub fn watch() -> io::Result<()> {
    let stopped = Arc::clone(STOPPED.get_or_init(Arc::default));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(
            signal,
            ENDED_BY_SIGNAL + signal,
            Arc::clone(&stopped),
        )?;
        flag::register(signal, Arc::clone(&stopped))?;
    }
    Ok(())
}

/// Whether a signal came since [`watch`].
#[must_use]
pub fn stopped() -> bool {
    let flag = STOPPED.get();
    flag.is_some_and(|stopped| stopped.load(Ordering::Relaxed))
}
