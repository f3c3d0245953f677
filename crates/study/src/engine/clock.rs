//! Time on the processor, not on the wall: these machines are shared.

use std::time::Instant;

/// Measures the processor time of the calling thread where the system tells it, else wall time.
#[derive(Clone, Copy, Debug)]
pub struct CpuClock {
    cpu: Option<f64>,
    wall: Instant,
}

impl CpuClock {
    /// Starts.
    #[must_use]
    pub fn start() -> Self {
        Self {
            cpu: thread_seconds(),
            wall: Instant::now(),
        }
    }

    /// Seconds of this thread since the start; call it on the same thread.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        match (self.cpu, thread_seconds()) {
            (Some(a), Some(b)) => b - a,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// Nanoseconds that the thread has run, by the kernel's scheduler (Linux).
fn thread_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: u64 = text.split_ascii_whitespace().next()?.parse().ok()?;
    #[allow(
        clippy::cast_precision_loss,
        reason = "nanoseconds of a run fit 53 bits"
    )]
    let seconds = nanoseconds as f64 * 1e-9;
    Some(seconds)
}
