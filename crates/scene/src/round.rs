//! Emissive spheres, disks and cylinders, remembered beside the facets that stand for them.

use crate::EmissionSpec;
use crate::builder::{Placement, RoundShape, SceneBuilder, index};
use crate::scene::RoundLight;
use linelit_geometry::glam::DMat3;
use linelit_geometry::{DVec3, Frame, Segment, predicates};
use linelit_lights::{Cylinder, CylinderLight, Disk, DiskLight, Light, Sphere, SphereLight};

impl SceneBuilder {
    /// Remembers the round shape that the last lights, so many, and the triangles from `first` on
    /// stand for, if its transform leaves it one.
    pub(crate) fn note_round(
        &mut self,
        first: usize,
        lights: usize,
        shape: &RoundShape,
        place: &Placement,
        spec: &EmissionSpec,
    ) {
        let start = self.lights.len() - lights;
        let lights = index(start)..index(self.lights.len());
        let triangles = index(first)..index(self.triangles.len());
        let emission = |area| spec.emission(spec.radiance_over(area));
        let emits_outwards = |radius: f64| place.reverse == (radius < 0.0) && !spec.two_sided;
        let found = match shape {
            RoundShape::Sphere(of) => sphere(of, place).map(|Sphere { center, radius }| {
                let area = 4.0 * std::f64::consts::PI * radius * radius;
                let sphere = SphereLight {
                    sphere: Sphere {
                        center,
                        radius: radius.abs(),
                    },
                    radiance: emission(area).radiance,
                };
                (Light::Sphere(sphere), emits_outwards(radius))
            }),
            RoundShape::Disk(of) => {
                let Some(Light::Area(facet)) = self.lights.get(start).map(|l| &*l.light) else {
                    return;
                };
                disk(of, place, facet.polygon.normal()).map(|disk| {
                    let emission = emission(disk.area());
                    (Light::Disk(DiskLight { disk, emission }), true)
                })
            }
            RoundShape::Cylinder(of) => cylinder(of, place).map(|cylinder| {
                let radiance = emission(cylinder.area()).radiance;
                let light = Light::Cylinder(CylinderLight { cylinder, radiance });
                (light, emits_outwards(of.radius))
            }),
        };
        self.round.extend(found.map(|(light, outward)| RoundLight {
            light,
            outward,
            lights,
            triangles,
        }));
    }
}

/// The sphere in the world, its radius of the same sign.
fn sphere(sphere: &Sphere, place: &Placement) -> Option<Sphere> {
    let m = place.to_world.matrix3;
    let scale = m.x_axis.length();
    let gram = m.transpose() * m;
    let off = gram - DMat3::from_diagonal(DVec3::splat(scale * scale));
    let error = [off.x_axis, off.y_axis, off.z_axis].map(|c| c.abs().max_element());
    let is_one = !error.iter().any(|e| *e > 1e-6 * scale * scale);
    let radius = sphere.radius * scale;
    let center = place.to_world.transform_point3(sphere.center);
    let finite = radius != 0.0 && radius.is_finite() && center.is_finite();
    (is_one && finite).then_some(Sphere { center, radius })
}

/// The disk in the world, its normal on the side of another; an ellipse stays facets.
fn disk(disk: &Disk, place: &Placement, emitting: DVec3) -> Option<Disk> {
    let frame = Frame::from_normal(disk.normal);
    let [a, b] = [frame.x, frame.y].map(|v| place.to_world.transform_vector3(v * disk.radius));
    let square = a.length_squared();
    let error = (b.length_squared() - square).abs().max(a.dot(b).abs());
    // One that is where it was keeps its bits.
    let (normal, radius) = match place.to_world.matrix3 == DMat3::IDENTITY {
        true => (disk.normal, disk.radius),
        false => (predicates::normalize(a.cross(b))?, square.sqrt()),
    };
    let center = place.to_world.transform_point3(disk.center);
    let is_one = !(error > 1e-6 * square) && radius.is_finite() && center.is_finite();
    is_one.then_some(Disk {
        center,
        normal: normal * normal.dot(emitting).signum(),
        radius,
    })
}

/// The cylinder in the world, its radius positive; of an ellipse, or slanted, it stays facets.
fn cylinder(cylinder: &Cylinder, place: &Placement) -> Option<Cylinder> {
    let (to_world, axis) = (&place.to_world, cylinder.axis);
    let Frame { x, y, z } = Frame::from_normal(axis.direction());
    let [x, y, z] = [x, y, z].map(|v| to_world.transform_vector3(v));
    let square = x.length_squared();
    let across = (y.length_squared() - square).abs().max(x.dot(y).abs());
    let slanted = x.dot(z).abs().max(y.dot(z).abs()) / z.length();
    // One that is where it was keeps its bits.
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
