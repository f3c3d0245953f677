//! Spheres and disks: laws, and hostile input.

mod chords;
mod hostile;
mod laws;
