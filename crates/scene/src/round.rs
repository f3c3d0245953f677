//! Emissive spheres, disks and cylinders as wholes, which a scene has in addition to their facets:
//! the shape before its transform, and the light that it becomes in the world.

use linelit_geometry::glam::{DAffine3, DMat3};
use linelit_geometry::{DVec3, Frame, Segment, predicates};
use linelit_lights::{
    Cylinder, CylinderLight, Disk, DiskLight, Emission, Light, Sphere, SphereLight,
};

/// A round shape whose facets are a mesh. A negative radius of a sphere or a cylinder means that
/// its outside faces inwards; the outside of a disk is the outside of its facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoundShape {
    /// A sphere, in the coordinates before its transform.
    Sphere(Sphere),
    /// A flat disk, in the coordinates before its transform.
    Disk(Disk),
    /// The curved side of a cylinder without its ends, in the coordinates before its transform.
    Cylinder(Cylinder),
}

impl RoundShape {
    /// Returns the light that the shape becomes in the world, and whether its outside faces inwards
    /// (`None` for a disk). `emission` returns the emission for an area, and `facing` is the normal
    /// of a facet, which decides the side of a disk. The result is `None` if the transform makes an
    /// ellipsoid, an ellipse or a slanted cylinder of it; such shapes are lit by facets only.
    pub(crate) fn light(
        &self,
        to_world: &DAffine3,
        facing: Option<DVec3>,
        emission: impl Fn(f64) -> Emission,
    ) -> Option<(Light, Option<bool>)> {
        Some(match self {
            // Spheres and cylinders emit on one side; the sign of the radius says which.
            Self::Sphere(of) => {
                let Sphere { center, radius } = sphere(of, to_world)?;
                let area = 4.0 * std::f64::consts::PI * radius * radius;
                let radiance = emission(area).radiance;
                let sphere = Sphere {
                    center,
                    radius: radius.abs(),
                };
                let light = Light::Sphere(SphereLight { sphere, radiance });
                (light, Some(radius < 0.0))
            }
            Self::Disk(of) => {
                let disk = disk(of, to_world, facing?)?;
                let emission = emission(disk.area());
                (Light::Disk(DiskLight { disk, emission }), None)
            }
            Self::Cylinder(of) => {
                let cylinder = cylinder(of, to_world)?;
                let radiance = emission(cylinder.area()).radiance;
                let light = Light::Cylinder(CylinderLight { cylinder, radiance });
                (light, Some(of.radius < 0.0))
            }
        })
    }
}

/// Returns the sphere in the world, with a radius of the same sign; `None` if the sphere becomes an
/// ellipsoid.
fn sphere(sphere: &Sphere, to_world: &DAffine3) -> Option<Sphere> {
    // It stays a sphere if the transform times its transpose is a multiple of the identity.
    let m = to_world.matrix3;
    let scale = m.x_axis.length();
    let gram = m.transpose() * m;
    let off = gram - DMat3::from_diagonal(DVec3::splat(scale * scale));
    let error = [off.x_axis, off.y_axis, off.z_axis].map(|c| c.abs().max_element());
    let is_one = !error.iter().any(|e| *e > 1e-6 * scale * scale);
    let radius = sphere.radius * scale;
    let center = to_world.transform_point3(sphere.center);
    let finite = radius != 0.0 && radius.is_finite() && center.is_finite();
    (is_one && finite).then_some(Sphere { center, radius })
}

/// Returns the disk in the world, with its normal on the side of `emitting`; `None` if the disk
/// becomes an ellipse.
fn disk(disk: &Disk, to_world: &DAffine3, emitting: DVec3) -> Option<Disk> {
    // It stays a disk if two perpendicular radii stay perpendicular and of equal length.
    let frame = Frame::from_normal(disk.normal);
    let [a, b] = [frame.x, frame.y].map(|v| to_world.transform_vector3(v * disk.radius));
    let square = a.length_squared();
    let error = (b.length_squared() - square).abs().max(a.dot(b).abs());
    // Without a rotation or scale, use the numbers of the file without rounding them again.
    let (normal, radius) = match to_world.matrix3 == DMat3::IDENTITY {
        true => (disk.normal, disk.radius),
        false => (predicates::normalize(a.cross(b))?, square.sqrt()),
    };
    let center = to_world.transform_point3(disk.center);
    let is_one = !(error > 1e-6 * square) && radius.is_finite() && center.is_finite();
    is_one.then_some(Disk {
        center,
        normal: normal * normal.dot(emitting).signum(),
        radius,
    })
}

/// Returns the cylinder in the world, its radius positive; `None` if its cross-section becomes an
/// ellipse or its axis is not perpendicular to that.
fn cylinder(cylinder: &Cylinder, to_world: &DAffine3) -> Option<Cylinder> {
    // Transform the axis and two directions across, and test whether they stay perpendicular and
    // the latter of equal length.
    let axis = cylinder.axis;
    let Frame { x, y, z } = Frame::from_normal(axis.direction());
    let [x, y, z] = [x, y, z].map(|v| to_world.transform_vector3(v));
    let square = x.length_squared();
    let across = (y.length_squared() - square).abs().max(x.dot(y).abs());
    let slanted = x.dot(z).abs().max(y.dot(z).abs()) / z.length();
    // Without a rotation or scale, use the numbers of the file without rounding them again.
    let scale = match to_world.matrix3 == DMat3::IDENTITY {
        true => 1.0,
        false => square.sqrt(),
    };
    let [p0, p1] = [axis.p0, axis.p1].map(|p| to_world.transform_point3(p));
    let round = Cylinder {
        axis: Segment::new(p0, p1),
        radius: cylinder.radius.abs() * scale,
    };
    let is_one = across <= 1e-6 * square && slanted <= 1e-6 * scale;
    let finite = round.radius.is_finite() && p0.is_finite() && p1.is_finite();
    (is_one && finite && round.area() > 0.0).then_some(round)
}
