//! The signals that end the program: Ctrl-C, and the signal by which schedulers end jobs.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

/// The base of the exit status of a process that a signal ended, as in shells.
const ENDED_BY_SIGNAL: i32 = 128;

/// Whether a signal came since [`watch`].
static STOPPED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Handles signals from now on: the first one makes [`stopped`] true, and the second one ends the
/// process.
pub fn watch() -> io::Result<()> {
    for signal in [SIGINT, SIGTERM] {
        let status = ENDED_BY_SIGNAL + signal;
        flag::register_conditional_shutdown(signal, status, Arc::clone(&STOPPED))?;
        flag::register(signal, Arc::clone(&STOPPED))?;
    }
    Ok(())
}

/// Returns whether a signal came since [`watch`].
#[must_use]
pub fn stopped() -> bool {
    STOPPED.load(Ordering::Relaxed)
}
