//! Area and linear lights, with `sample`, `pdf` and `invert` for every sampling technique, and line parametrisations.
//!
//! A technique is set up once per light and shading point and then takes any number of random numbers: it never
//! allocates, never fails and never panics. Degenerate input (a light seen edge-on, of no size, or with the shading point
//! on it) gives the density 0, or `None`. Densities name their measure in their type, [`Pdf`].
//!
//! ```
//! use linelit_geometry::{ConvexPolygon, DVec3};
//! use linelit_lights::{AreaSampler, SolidAngleSampler};
//!
//! let light = ConvexPolygon::parallelogram(DVec3::new(0.0, 0.0, 3.0), DVec3::X, DVec3::Y).unwrap();
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

mod angle;
mod angular_lines;
mod area;
mod disk;
mod disk_cone;
mod fan;
mod image;
mod irradiance;
mod light;
pub mod linear;
mod lines;
mod pdf;
mod piece;
mod proxy;
mod real;
pub mod selection;
mod solid_angle;
mod sphere;
mod sphere_projected;
mod spherical_triangle;
mod technique;
mod textured_lines;
mod triangle;

pub use angular_lines::AngularLines;
pub use area::{AreaSampler, PointSample};
pub use disk::Disk;
pub use disk_cone::DiskCone;
pub use image::{ImportanceImage, TextureAxis, TexturedSampler};
pub use light::{AreaLight, DiskLight, Emission, Light, LinearLight, SphereLight};
pub use lines::{LineSample, LineSampler, OffsetDensity, Orientation};
pub use pdf::{
    Area, Length, Measure, Offset, Pdf, ProjectedSolidAngle, SolidAngle, ThinSolidAngle,
};
pub use proxy::ProxySampler;
pub use real::Real;
pub use solid_angle::SolidAngleSampler;
pub use sphere::{Sphere, SphereCap, SphereCone};
pub use sphere_projected::SphereProjected;
pub use technique::{LineTechnique, LinearPointTechnique, PointTechnique, PointsOnLines};
pub use textured_lines::TexturedLines;
pub use triangle::triangle_solid_angle;
