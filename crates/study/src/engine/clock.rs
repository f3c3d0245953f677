//! A clock of processor time. Studies run on machines that other work shares, where time on the
//! wall would also count the work of others.
#![allow(clippy::disallowed_methods, reason = "the clock")]

use std::time::Instant;

/// A clock of the processor time of the calling thread, or of wall time where the operating system
/// does not report processor time.
///
/// It reads the thread's own clock (`CLOCK_THREAD_CPUTIME_ID`), which counts in nanoseconds; a
/// reading takes some tenths of a microsecond.
#[derive(Clone, Copy, Debug)]
pub struct CpuClock {
    start: f64,
    wall: Instant,
}

impl CpuClock {
    /// Starts a clock for the calling thread.
    #[must_use]
    pub fn start() -> Self {
        let wall = Instant::now();
        Self {
            start: thread_seconds(wall),
            wall,
        }
    }

    /// Returns the seconds that this thread has run since the start. It has to be called on the
    /// thread that started the clock.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        thread_seconds(self.wall) - self.start
    }
}

/// Returns the seconds that the calling thread has run since it was created.
#[cfg(unix)]
fn thread_seconds(_: Instant) -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn thread_seconds(wall: Instant) -> f64 {
    wall.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kernel's own account advances every few milliseconds; this clock must show far shorter
    /// times.
    #[test]
    fn short_work_takes_time_and_sleep_takes_none() {
        for _ in 0..100 {
            let clock = CpuClock::start();
            let sum: f64 = (0..1000).map(|k| f64::from(std::hint::black_box(k))).sum();
            std::hint::black_box(sum);
            assert!(clock.seconds() > 0.0);
        }
        let clock = CpuClock::start();
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(!cfg!(unix) || clock.seconds() < 0.02, "{}", clock.seconds());
    }
}
