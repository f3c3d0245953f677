//! Whole files: round trips, damage, and what writing leaves behind.

mod atomic;
mod files;
