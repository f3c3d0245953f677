//! Points on spheres, disks and cylinders as lights: by area, by what is in view, by solid angle
//! and by projected solid angle; lines along cylinders.
//!
//! Each technique is a [`PointTechnique`]: it is set up once per light and shading point, and then
//! takes any number of random numbers. It never allocates, never fails and never panics; what
//! cannot be sampled has the density 0. The shapes are [`Sphere`], [`Disk`] and [`Cylinder`] of
//! `linelit-lights`.
//!
//! ```
//! use linelit_spheres::geometry::DVec3;
//! use linelit_spheres::lights::{PointTechnique, Sphere};
//! use linelit_spheres::SphereCone;
//! let lamp = Sphere { center: DVec3::new(0.0, 0.0, 5.0), radius: 3.0 };
//! let sample = SphereCone::new(&lamp, DVec3::ZERO).sample([0.3, 0.8]);
//! // Uniform in the cone of directions that meet it: Ω = 2π (1 − √(1 − (R/d)²)).
//! assert!((sample.pdf.value() * std::f64::consts::TAU * (1.0 - 0.8) - 1.0).abs() < 1e-14);
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod along;
mod chords;
mod cone;
mod cylinder;
mod cylinder_lines;
mod disk;
mod disk_cone;
mod projected;
mod sphere;

pub use along::ChordMeasure;
pub use chords::DiskChords;
pub use cone::TransformedCone;
pub use cylinder::{CylinderArea, CylinderView};
pub use cylinder_lines::CylinderLines;
pub use disk::DiskArea;
pub use disk_cone::DiskCone;
pub use projected::SphereProjected;
pub use sphere::{SphereCap, SphereCone};

// What public signatures name, so that one dependency is enough.
pub use {linelit_geometry as geometry, linelit_lights as lights};

#[cfg(doc)]
use linelit_lights::{Cylinder, Disk, PointTechnique, Sphere};

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
