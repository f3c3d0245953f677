//! These tests check spheres, disks and cylinders: laws, and hostile input.

mod areas;
mod chords;
mod cylinders;
mod hostile;
mod laws;
