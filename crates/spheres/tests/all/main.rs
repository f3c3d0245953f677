//! Spheres, disks and cylinders: laws, and hostile input.

mod chords;
mod cylinders;
mod hostile;
mod laws;
