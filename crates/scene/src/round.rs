//! Emissive spheres, disks and cylinders, remembered beside the facets that stand for them.

use crate::EmissionSpec;
use crate::builder::{Placement, SceneBuilder, index};
use crate::scene::{EmissiveCylinder, EmissiveDisk, EmissiveSphere};
use linelit_geometry::glam::DMat3;
use linelit_geometry::{DVec3, Frame, Segment, predicates};
use linelit_lights::{Cylinder, Disk, Light, Sphere};

impl SceneBuilder {
    pub(crate) fn note_sphere(
        &mut self,
        first: usize,
        lights: usize,
        sphere: &Sphere,
        place: &Placement,
        spec: &EmissionSpec,
    ) {
        let m = place.to_world.matrix3;
        let scale = m.x_axis.length();
        let gram = m.transpose() * m;
        let off = gram - DMat3::from_diagonal(DVec3::splat(scale * scale));
        let error = [off.x_axis, off.y_axis, off.z_axis].map(|c| c.abs().max_element());
        if error.iter().any(|e| *e > 1e-6 * scale * scale) {
            return;
        }
        let radius = sphere.radius * scale;
        let center = place.to_world.transform_point3(sphere.center);
        if radius == 0.0 || !radius.is_finite() || !center.is_finite() {
            return;
        }
        let area = 4.0 * std::f64::consts::PI * radius * radius;
        self.spheres.push(EmissiveSphere {
            center,
            radius: radius.abs(),
            emission: spec.emission(spec.radiance_over(area)),
            inward: place.reverse != (radius < 0.0),
            lights: index(self.lights.len() - lights)..index(self.lights.len()),
            triangles: index(first)..index(self.triangles.len()),
        });
    }

    pub(crate) fn note_disk(
        &mut self,
        first: usize,
        lights: usize,
        disk: &Disk,
        place: &Placement,
        spec: &EmissionSpec,
    ) {
        let lights = self.lights.len() - lights..self.lights.len();
        let Some(Light::Area(facet)) = self.lights.get(lights.start).map(|l| &*l.light) else {
            return;
        };
        let frame = Frame::from_normal(disk.normal);
        let [a, b] = [frame.x, frame.y].map(|v| place.to_world.transform_vector3(v * disk.radius));
        let square = a.length_squared();
        let error = (b.length_squared() - square).abs().max(a.dot(b).abs());
        // One that is where it was keeps its bits.
        let (normal, radius) = match place.to_world.matrix3 == DMat3::IDENTITY {
            true => (Some(disk.normal), disk.radius),
            false => (predicates::normalize(a.cross(b)), square.sqrt()),
        };
        let Some(normal) = normal else {
            return;
        };
        let outwards = normal.dot(facet.polygon.normal()).signum();
        let disk = Disk {
            center: place.to_world.transform_point3(disk.center),
            normal: normal * outwards,
            radius,
        };
        // An ellipse stays facets.
        if error > 1e-6 * square || !disk.radius.is_finite() || !disk.center.is_finite() {
            return;
        }
        self.disks.push(EmissiveDisk {
            disk,
            emission: spec.emission(spec.radiance_over(disk.area())),
            lights: index(lights.start)..index(lights.end),
            triangles: index(first)..index(self.triangles.len()),
        });
    }

    pub(crate) fn note_cylinder(
        &mut self,
        first: usize,
        lights: usize,
        cylinder: &Cylinder,
        place: &Placement,
        spec: &EmissionSpec,
    ) {
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
        // Of an ellipse, or slanted, it stays facets.
        let is_one = across <= 1e-6 * square && slanted <= 1e-6 * scale;
        let finite = round.radius.is_finite() && p0.is_finite() && p1.is_finite();
        if !(is_one && finite && round.area() > 0.0) {
            return;
        }
        self.cylinders.push(EmissiveCylinder {
            cylinder: round,
            emission: spec.emission(spec.radiance_over(round.area())),
            inward: place.reverse != (cylinder.radius < 0.0),
            lights: index(self.lights.len() - lights)..index(self.lights.len()),
            triangles: index(first)..index(self.triangles.len()),
        });
    }
}
