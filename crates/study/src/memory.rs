//! Checks of the available memory, which are made before much memory is taken.
#![allow(clippy::disallowed_methods, reason = "the system says it in files")]

use anyhow::{Result, bail};
use linelit_film::Tile;
use std::fs;

/// Refuses work that takes more bytes than are available; the error states both numbers. Call it on
/// a thread of the pool that will do the work. Where the system does not report the available
/// memory, all work is accepted.
///
/// # Errors
/// If fewer than `bytes` bytes are available. `what` names the work in the message.
pub fn check(what: &str, bytes: u64) -> Result<()> {
    match available() {
        Some(there) if bytes > there => bail!(
            "{what} takes {} of memory, and {} are available",
            size(bytes),
            size(there)
        ),
        _ => Ok(()),
    }
}

/// Returns the number of bytes that this process may still take: the lesser of the system's
/// available memory (Linux) and what the limit on the address space leaves (`ulimit -v`). `None` if
/// neither is known.
#[must_use]
pub fn available() -> Option<u64> {
    [system(), addresses()].into_iter().flatten().min()
}

/// Returns the available memory of the system in bytes.
fn system() -> Option<u64> {
    kib(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:").map(|n| n << 10)
}

/// The size of the address range, in bytes, that glibc's allocator reserves for each thread. It
/// counts against a limit on the address space, although most of it is never used.
#[cfg(unix)]
const ADDRESSES_OF_THREAD: u64 = 64 << 20;

/// Returns the number of bytes that the limit on the address space leaves, if there is such a
/// limit.
#[cfg(unix)]
fn addresses() -> Option<u64> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let threads = ADDRESSES_OF_THREAD.saturating_mul(rayon::current_num_threads() as u64);
    let taken = (kib(&status, "VmSize:")? << 10).saturating_add(threads);
    Some(limit.saturating_sub(taken))
}

#[cfg(not(unix))]
fn addresses() -> Option<u64> {
    None
}

/// Returns the number of KiB behind a key of `/proc/PID/status` or `/proc/meminfo`.
#[must_use]
pub fn kib(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    line.split_ascii_whitespace().next()?.parse().ok()
}

/// Formats a number of bytes for people: `523.4 MiB`.
#[must_use]
pub fn size(bytes: u64) -> String {
    const UNITS: [&str; 6] = ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"];
    let mut number = bytes as f64 / 1024.0;
    let mut unit = 0;
    while number >= 1000.0 && unit + 1 < UNITS.len() {
        number /= 1024.0;
        unit += 1;
    }
    format!("{number:.1} {}", UNITS[unit])
}

/// The bytes that a pixel takes while a picture is rendered and written: 12 of the image, and at
/// most 12 more of buffers.
const BYTES_PER_PIXEL: u64 = 24;

/// Refuses a picture that does not fit into memory. `beside` is the number of bytes of each pixel
/// that are needed in addition to the picture's own.
///
/// # Errors
/// If the memory for the picture is not available.
pub fn check_picture(window: Tile, beside: u64) -> Result<()> {
    let (width, height) = (window.width(), window.height());
    let pixels = u64::from(width).saturating_mul(height.into());
    let what = format!("a picture of {width} x {height} pixels");
    check(&what, pixels.saturating_mul(BYTES_PER_PIXEL + beside))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_keys() {
        assert_eq!(size(0), "0.0 KiB");
        assert_eq!(size(3 << 29), "1.5 GiB");
        assert_eq!(size(u64::MAX), "16.0 EiB");
        let status = "Name:\tx\nVmSize:\t  123 kB\nVmHWM:\t  7 kB\n";
        assert_eq!(
            (kib(status, "VmHWM:"), kib(status, "None:")),
            (Some(7), None)
        );
    }

    #[test]
    fn too_much_is_refused_with_both_numbers() {
        check("nothing", 0).unwrap();
        if available().is_some() {
            let error = check("all there is", u64::MAX).unwrap_err().to_string();
            assert!(error.starts_with("all there is takes 16.0 EiB of memory, and "));
            assert!(error.ends_with(" are available"), "{error}");
        }
    }
}
