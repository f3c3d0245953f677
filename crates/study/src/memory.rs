//! How much memory there is, asked before much of it is taken.
#![allow(clippy::disallowed_methods, reason = "the system says it in files")]

use anyhow::{Result, bail};
use linelit_film::Tile;
use std::fs;

/// Refuses what takes more bytes than are available, with both numbers; to be asked on a thread of
/// the pool that will do the work. Where the system does not
/// say what is available, nothing is refused.
///
/// # Errors
/// If `bytes` are not available.
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

/// Bytes that this process may still take: the least of what the system has (Linux) and what its
/// limit on addresses leaves (`ulimit -v`).
#[must_use]
pub fn available() -> Option<u64> {
    [system(), addresses()].into_iter().flatten().min()
}

fn system() -> Option<u64> {
    kib(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:").map(|n| n << 10)
}

/// Addresses that the allocator (glibc's) sets aside for each thread.
#[cfg(unix)]
const ADDRESSES_OF_THREAD: u64 = 64 << 20;

/// Bytes that the limit on addresses leaves, if there is one.
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

/// The number of KiB behind a key of `/proc/PID/status` or `/proc/meminfo`.
#[must_use]
pub fn kib(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    line.split_ascii_whitespace().next()?.parse().ok()
}

/// Bytes for people: `523.4 MiB`.
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

/// Bytes that a pixel takes while a picture is rendered and written: 12 of the image, and as many
/// of the file's text beside its values, or of those beside the image.
const BYTES_PER_PIXEL: u64 = 24;

/// Refuses a picture that does not fit into memory, with what else is kept of each pixel: so many
/// bytes `beside` those of the picture.
///
/// # Errors
/// If the memory it takes is not available.
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
