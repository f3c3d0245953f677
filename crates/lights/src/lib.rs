//! This crate holds lights, and techniques that sample points and lines on them. There are
//! polygons, spheres, disks, cylinders, linear lights, points, parallel light and skies; each
//! technique has `sample`, `pdf` and `invert`.
//!
//! A technique is set up once per light and shading point, and then takes any number of random
//! numbers. It never allocates (except for images and visible regions), never fails and never
//! panics. Degenerate input (a light seen edge-on, a light without size, or a shading point that
//! lies on the light) gives the density 0, or `None`. Each density names its measure in its type,
//! [`Pdf`].
//!
//! ```
//! use linelit_lights::geometry::{ConvexPolygon, DVec3};
//! use linelit_lights::{AreaSampler, PointTechnique, SolidAngleSampler};
//!
//! let corner = DVec3::new(0.0, 0.0, 3.0);
//! let light = ConvexPolygon::parallelogram(corner, DVec3::X, DVec3::Y).unwrap();
//! let x = DVec3::new(2.0, 0.0, 0.0);
//! let (by_area, by_angle) = (AreaSampler::new(&light), SolidAngleSampler::new(&light, x));
//!
//! // One point, and the density of either technique there, in the same measure.
//! let sample = by_angle.sample([0.25, 0.75]);
//! let to_light = sample.point - x;
//! let cosine = light.normal().dot(to_light.normalize());
//! let other = by_area.pdf(sample.point).to_solid_angle(to_light.length_squared(), cosine);
//! assert!((other.value() / sample.pdf.value() - 1.0).abs() < 0.5);
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod delta;
mod density;
mod directions;
mod image;
mod kinds;
mod light;
mod line;
pub mod linear;
mod mixture;
pub mod octahedral;
mod pieces;
mod polygon;
mod profile;
#[cfg(feature = "rand")]
mod random;
mod round;
mod samples;
mod sky;
mod space;
mod surface;
mod technique;

pub use delta::{DeltaSample, DistantLight, PointLight};
pub use density::{Area, Length, Measure, Offset, Pdf, SolidAngle, SurfaceMeasure, ThinSolidAngle};
pub use directions::{SkyFilter, SkyMapping};
pub use image::{ImportanceImage, TextureAxis, TexturedSampler};
pub use kinds::Light;
pub use light::{Emission, LinearLight};
pub use line::by_angle::AngularLines;
pub use line::by_length::{LineSampler, OffsetDensity, Width};
pub use line::by_texture::TexturedLines;
pub use mixture::{DiskLtc, Lobes, Mixture, VisiblePolygonLtc};
pub use pieces::{Pieces, sample_linear};
pub use polygon::area::AreaSampler;
pub use polygon::proxy::ProxySampler;
pub use polygon::region::RegionSampler;
pub use polygon::solid_angle::SolidAngleSampler;
pub use polygon::transformed::TransformedSampler;
pub use profile::{Falloff, Profile, ProfileError, ProfileKind, ProfileMap, ProfileTable};
#[cfg(feature = "rand")]
pub use random::Random;
pub use round::along::ChordMeasure;
pub use round::chords::DiskChords;
pub use round::cone::TransformedCone;
pub use round::cylinder::{CylinderArea, CylinderView};
pub use round::cylinder_lines::CylinderLines;
pub use round::disk::DiskArea;
pub use round::disk_cone::DiskCone;
pub use round::projected::SphereProjected;
pub use round::sphere::{SphereCap, SphereCone};
pub use samples::{LineSample, LinearSample, PointColumns, PointSample};
pub use sky::{Sky, SkyEmission, SkyError, SkyImage};
pub use space::LightSpace;
pub use surface::cylinder::{Cylinder, CylinderLight};
pub use surface::disk::{Disk, DiskLight, around_unit_circle};
pub use surface::lines::{LineDensity, LineFamily, LineSetup};
pub use surface::points::{PointDensity, PointSource};
pub use surface::polygon::AreaLight;
pub use surface::shape::{Extent, Normals, Shape};
pub use surface::sky::{SkyBy, SkyPoints, SkyView};
pub use surface::sphere::{Sphere, SphereLight};
pub use surface::texture::{EmissionTexture, NoTexture, TexturedPoints};
pub use surface::{LightPoint, SeenSurface, Surface, Viewer};
pub use technique::{LineTechnique, LinearPointTechnique, PointTechnique, PointsOnLines, through};

// The geometry types appear in public signatures: with this export a caller needs one dependency.
pub use linelit_geometry as geometry;

/// The README's example is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
