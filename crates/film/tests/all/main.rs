//! Tests of whole files: round trips, damage, and atomic writing.

mod atomic;
mod files;
