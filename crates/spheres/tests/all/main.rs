//! Spheres and disks: laws, and hostile input.

mod hostile;
mod laws;
