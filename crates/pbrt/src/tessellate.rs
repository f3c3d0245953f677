//! The tessellation of round shapes and bilinear patches to triangles.
//!
//! Spheres, disks and cylinders become meshes whose vertices are on the surface, with its normals
//! and with pbrt's texture coordinates. The centre of a facet that spans an angle α is inside the
//! surface by 1 − cos(α/2) of the radius: 0.5 % with 32 steps around, 0.12 % with 64. Facets that
//! emit are scaled outwards until they have the area of the surface: their power is then the power
//! of the round shape, and only its distribution over directions differs.

use linelit_elementary::{acos, sin_cos};
use linelit_geometry::{DMat3, DVec3, Segment};
use linelit_lights::{Cylinder, Disk, Sphere};
use linelit_scene::{MeshData, RoundShape};
use std::f64::consts::TAU;

/// The numbers of steps in which a round shape is tessellated: around the axis, and from pole to
/// pole.
const STEPS: [usize; 2] = [64, 32];
/// The numbers of steps for emissive shapes, around the axis and from pole to pole; they are
/// smaller because each facet is a light.
const EMISSIVE_STEPS: [usize; 2] = [24, 12];

/// A round shape about the z axis, or a part of one, as pbrt describes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    pub(crate) kind: Kind,
    /// The largest longitude of the shape's points, in radians; the smallest is zero.
    pub(crate) phi_max: f64,
}

/// The kinds of round shapes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// The part of a sphere about the origin between two heights.
    Sphere { radius: f64, heights: [f64; 2] },
    /// An annulus at a height, facing +z.
    Disk { height: f64, radii: [f64; 2] },
    /// A tube between two heights.
    Cylinder { radius: f64, heights: [f64; 2] },
}

impl Round {
    /// Returns the name of the shape in pbrt text.
    pub(crate) const fn name(&self) -> &'static str {
        match self.kind {
            Kind::Sphere { .. } => "sphere",
            Kind::Disk { .. } => "disk",
            Kind::Cylinder { .. } => "cylinder",
        }
    }

    /// Returns the facets of the shape.
    pub(crate) fn facets(&self) -> MeshData {
        self.mesh(STEPS)
    }

    /// Returns the facets of the shape as lights. They are scaled so that, after the transform to
    /// the world, their total area is the area of the shape.
    pub(crate) fn emissive_facets(&self, to_world: &DMat3) -> MeshData {
        // Compare the area of the facets in the world with the area of the shape.
        let mut mesh = self.mesh(EMISSIVE_STEPS);
        let corners = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
        let areas = mesh.triangles.iter().map(corners).map(|[a, b, c]| {
            let [e, f] = [b - a, c - a].map(|edge| *to_world * edge);
            0.5 * e.cross(f).length()
        });
        let ratio = self.area(to_world) / areas.sum::<f64>();
        // Scale the facets. The area of a tube is proportional to the radius, and the area of other
        // shapes to its square.
        let (across, along) = match self.kind {
            Kind::Sphere { .. } => (ratio.sqrt(), ratio.sqrt()),
            Kind::Disk { .. } => (ratio.sqrt(), 1.0),
            Kind::Cylinder { .. } => (ratio, 1.0),
        };
        if across.is_finite() {
            let factor = DVec3::new(across, across, along);
            mesh.positions.iter_mut().for_each(|p| *p *= factor);
        }
        mesh
    }

    /// Returns the shape as a mesh with these numbers of steps around and from bottom to top.
    fn mesh(&self, [around, up]: [usize; 2]) -> MeshData {
        let phi_max = self.phi_max;
        let mut mesh = match self.kind {
            Kind::Sphere { radius, heights } => {
                // Divide the polar angle into equal steps, with the ends at exactly the given
                // heights.
                let [bottom, top] = polar(radius, heights);
                let [z_min, z_max] = heights;
                let ring = |v: f64| {
                    if v <= 0.0 {
                        (z_min, (radius * radius - z_min * z_min).max(0.0).sqrt())
                    } else if v >= 1.0 {
                        (z_max, (radius * radius - z_max * z_max).max(0.0).sqrt())
                    } else {
                        let (sin, cos) = sin_cos(bottom + v * (top - bottom));
                        (radius * cos, radius * sin)
                    }
                };
                revolve([around, up], phi_max, ring, |p| p / radius)
            }
            Kind::Disk { height, radii } => {
                // Go from the rim inwards.
                let [inner, radius] = radii;
                let ring = |v: f64| (height, radius + v * (inner - radius));
                revolve([around, 1], phi_max, ring, |_| DVec3::Z)
            }
            Kind::Cylinder { radius, heights } => {
                // Go from the bottom to the top.
                let [z_min, z_max] = heights;
                let ring = |v: f64| (z_min + v * (z_max - z_min), radius);
                let normal = |p: DVec3| DVec3::new(p.x, p.y, 0.0) / radius;
                revolve([around, 1], phi_max, ring, normal)
            }
        };
        mesh.round = self.whole();
        mesh
    }

    /// Returns the whole sphere, disk or cylinder; `None` if the shape is only a part of one.
    fn whole(&self) -> Option<RoundShape> {
        let shape = match self.kind {
            Kind::Sphere { radius, heights } => {
                let center = DVec3::ZERO;
                let closed = heights[0] <= -radius && heights[1] >= radius;
                closed.then_some(RoundShape::Sphere(Sphere { center, radius }))
            }
            Kind::Disk { height, radii } => {
                let disk = Disk {
                    center: DVec3::Z * height,
                    normal: DVec3::Z,
                    radius: radii[1],
                };
                (radii[0] == 0.0).then_some(RoundShape::Disk(disk))
            }
            Kind::Cylinder { radius, heights } => {
                let [low, high] = heights.map(|z| DVec3::Z * z);
                let axis = Segment::new(low, high);
                let tube = RoundShape::Cylinder(Cylinder { axis, radius });
                (heights[0] < heights[1]).then_some(tube)
            }
        };
        shape.filter(|_| self.phi_max >= TAU)
    }

    /// Returns the area of the shape after a linear map: the integral ∫ |∂p/∂u × ∂p/∂v| by Gauss'
    /// rule of three points, over parts of the longitudes and, for a sphere, also of the latitudes.
    /// Here p(u, v) is the point of the mapped shape at the longitude u and the height or latitude
    /// v.
    fn area(&self, to_world: &DMat3) -> f64 {
        // `image` returns the area of the parallelogram that two vectors span after the map.
        let image = |e: DVec3, f: DVec3| (*to_world * e).cross(*to_world * f).length();
        match self.kind {
            Kind::Disk { radii, .. } => {
                let [inner, radius] = radii;
                0.5 * self.phi_max * (radius * radius - inner * inner) * image(DVec3::X, DVec3::Y)
            }
            Kind::Cylinder { radius, heights } => {
                let around = |phi: f64| {
                    let (sin, cos) = sin_cos(phi);
                    image(DVec3::new(-sin, cos, 0.0), DVec3::Z)
                };
                radius * (heights[1] - heights[0]) * integral([0.0, self.phi_max], around)
            }
            Kind::Sphere { radius, heights } => {
                let [bottom, top] = polar(radius, heights);
                let around = |theta: f64| {
                    let (down, out) = sin_cos(theta);
                    let along = |phi: f64| {
                        let (sin, cos) = sin_cos(phi);
                        let south = DVec3::new(out * cos, out * sin, -down);
                        image(DVec3::new(-sin, cos, 0.0), south)
                    };
                    down * integral([0.0, self.phi_max], along)
                };
                radius * radius * integral([top, bottom], around)
            }
        }
    }
}

/// Returns the polar angles, from the +z pole, of two heights on a sphere.
fn polar(radius: f64, heights: [f64; 2]) -> [f64; 2] {
    heights.map(|z| acos((z / radius).clamp(-1.0, 1.0)))
}

/// Returns the integral of a smooth function by Gauss' rule of three points on 64 equal parts.
fn integral([from, to]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    const PARTS: u32 = 64;
    let width = (to - from) / f64::from(PARTS);
    let offset = 0.5 * width * 0.6_f64.sqrt();
    let part = |k: u32| {
        let middle = from + (f64::from(k) + 0.5) * width;
        (5.0 * (f(middle - offset) + f(middle + offset)) + 8.0 * f(middle)) / 18.0
    };
    width * (0..PARTS).map(part).sum::<f64>()
}

/// Returns the mesh of a surface of revolution about z. `ring(v)` returns the height and the radius
/// for v from 0 to 1, and `normal` the unit normal at a point. The cells are quadrilaterals of two
/// triangles, of which one is left out where a ring has the radius zero.
#[allow(
    clippy::cast_possible_truncation,
    reason = "normals and texture coordinates are f32"
)]
fn revolve(
    [around, up]: [usize; 2],
    phi_max: f64,
    ring: impl Fn(f64) -> (f64, f64),
    normal: impl Fn(DVec3) -> DVec3,
) -> MeshData {
    // Add the vertices, ring by ring.
    let mut mesh = MeshData {
        one_shape: true,
        ..MeshData::default()
    };
    let closed = phi_max >= TAU;
    let mut radii = Vec::new();
    for j in 0..=up {
        let v = j as f64 / up as f64;
        let (z, r) = ring(v);
        radii.push(r);
        for i in 0..=around {
            let u = i as f64 / around as f64;
            // Close the seam exactly.
            let (sin, cos) = if closed && i == around {
                (0.0, 1.0)
            } else {
                sin_cos(u * phi_max)
            };
            let p = DVec3::new(r * cos, r * sin, z);
            mesh.positions.push(p);
            mesh.normals.push(normal(p).as_vec3().to_array());
            mesh.uvs.push([u as f32, v as f32]);
        }
    }
    // Add the triangles, counter-clockwise as seen from outside.
    let at = |i: usize, j: usize| u32::try_from(j * (around + 1) + i).unwrap_or(u32::MAX);
    for j in 0..up {
        for i in 0..around {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if radii[j] > 0.0 {
                mesh.triangles.push([a, b, c]);
            }
            if radii[j + 1] > 0.0 {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}

/// Appends a bilinear patch to a mesh, as a grid of `n` × `n` cells. The corners, and their texture
/// coordinates and normals, are in the order p00, p10, p01, p11.
#[allow(
    clippy::cast_possible_truncation,
    reason = "normals and texture coordinates are f32"
)]
pub(crate) fn bilinear(
    mesh: &mut MeshData,
    corners: [DVec3; 4],
    uvs: [[f32; 2]; 4],
    normals: Option<[[f32; 3]; 4]>,
    n: usize,
) {
    // Interpolate positions, texture coordinates and normals at the vertices of the grid.
    let base = mesh.positions.len();
    let lerp = |v: [f64; 4], s: f64, t: f64| {
        (v[0] * (1.0 - s) + v[1] * s) * (1.0 - t) + (v[2] * (1.0 - s) + v[3] * s) * t
    };
    let component = |points: &[[f64; 3]; 4], k: usize| [0, 1, 2, 3].map(|i: usize| points[i][k]);
    let points = corners.map(|p| p.to_array());
    for j in 0..=n {
        for i in 0..=n {
            let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
            let at = |points: &[[f64; 3]; 4]| [0, 1, 2].map(|k| lerp(component(points, k), s, t));
            mesh.positions.push(DVec3::from_array(at(&points)));
            let uv = uvs.map(|[u, v]| [f64::from(u), f64::from(v), 0.0]);
            let [u, v, _] = at(&uv);
            mesh.uvs.push([u as f32, v as f32]);
            if let Some(normals) = normals {
                let n = at(&normals.map(|n| n.map(f64::from)));
                mesh.normals.push(n.map(|c| c as f32));
            }
        }
    }
    // Add two triangles for each cell.
    let at = |i: usize, j: usize| u32::try_from(base + j * (n + 1) + i).unwrap_or(u32::MAX);
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn area(mesh: &MeshData, to_world: DMat3) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|i| to_world * mesh.positions[i as usize]);
        let areas = mesh
            .triangles
            .iter()
            .map(corners)
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length());
        areas.sum()
    }

    fn sphere(radius: f64, heights: [f64; 2], phi_max: f64) -> Round {
        let kind = Kind::Sphere { radius, heights };
        Round { kind, phi_max }
    }

    fn disk(inner: f64, radius: f64, phi_max: f64) -> Round {
        let (height, radii) = (1.0, [inner, radius]);
        let kind = Kind::Disk { height, radii };
        Round { kind, phi_max }
    }

    fn cylinder(radius: f64, heights: [f64; 2], phi_max: f64) -> Round {
        let kind = Kind::Cylinder { radius, heights };
        Round { kind, phi_max }
    }

    #[test]
    fn areas_approach_the_surface() {
        // Inscribed facets lose a fraction of about (α²)/6 of the area around and along.
        let loss = |n: f64| 1.2 * (TAU / n).powi(2) / 6.0;
        let whole = |round: Round| area(&round.facets(), DMat3::IDENTITY);
        let s = whole(sphere(2.0, [-2.0, 2.0], TAU)) / (16.0 * PI);
        assert!(s < 1.0 && s > 1.0 - 2.0 * loss(64.0), "{s}");
        let d = whole(disk(1.0, 2.0, TAU)) / (3.0 * PI);
        assert!(d < 1.0 && d > 1.0 - loss(64.0), "{d}");
        let c = whole(cylinder(2.0, [-1.0, 1.0], PI)) / (4.0 * PI);
        assert!(c < 1.0 && c > 1.0 - loss(64.0), "{c}");
    }

    /// Compared with closed forms: for parts without a map, ellipses, and ellipsoids of revolution.
    #[test]
    fn emissive_facets_have_the_area_of_the_surface() {
        let identity = DMat3::IDENTITY;
        let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
        let turn = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(-1.1);
        let ellipsoid = |a: f64, c: f64| {
            // Flat: 2π a² (1 + (1 − e²)/e artanh e); tall: 2π a² (1 + c/(a e) asin e).
            if c < a {
                let e = (1.0 - c * c / (a * a)).sqrt();
                TAU * a * a * (1.0 + (1.0 - e * e) / e * e.atanh())
            } else {
                let e = (1.0 - a * a / (c * c)).sqrt();
                TAU * a * a * (1.0 + c / (a * e) * e.asin())
            }
        };
        let whole = sphere(0.5, [-0.5, 0.5], TAU);
        for (round, map, want) in [
            (whole, identity, PI),
            (whole, turn * scale(2.0, 2.0, 2.0), 4.0 * PI),
            (whole, turn * scale(2.0, 2.0, 0.5), ellipsoid(1.0, 0.25)),
            (whole, scale(0.5, 0.5, 4.0) * turn, ellipsoid(0.25, 2.0)),
            (sphere(2.0, [-1.0, 1.5], 2.0), turn, 2.0 * 2.0 * 2.5),
            (sphere(2.0, [1.5, 2.0], 0.1), identity, 0.1 * 2.0 * 0.5),
            (disk(0.0, 2.0, TAU), scale(3.0, 0.5, 1.0), 6.0 * PI),
            (disk(1.0, 2.0, 1.0), turn, 1.5),
            (cylinder(2.0, [-1.0, 1.0], TAU), turn, 8.0 * PI),
            (cylinder(2.0, [-1.0, 1.0], 0.5), scale(1.0, 1.0, 3.0), 6.0),
            // Half of an ellipse's circumference, 4 E(1 − b²/a²) for a = 2 and b = 1.
            (
                cylinder(1.0, [0.0, 1.0], PI),
                scale(2.0, 1.0, 1.0),
                4.844_224_110_273_838,
            ),
        ] {
            // Gauss' rule of three points on parts of width h has an error of h⁶ f⁽⁶⁾/2016000. Here
            // h = 2π/64, and f⁽⁶⁾ is up to 8⁶ f for a shape that is 8 times as long as wide.
            // Rounding is far below that.
            let got = area(&round.emissive_facets(&map), map);
            let error = (got / want - 1.0).abs();
            assert!(error < 1.2e-7, "{round:?} {got} {want}");
        }
        // With a singular map the facets are not scaled.
        let flat = whole.emissive_facets(&scale(1.0, 0.0, 0.0));
        assert!(flat.positions.iter().all(|p| p.is_finite()));
    }

    #[test]
    fn spheres_close_at_poles_and_seam_without_slivers() {
        let mesh = sphere(1.0, [-1.0, 1.0], TAU).mesh([8, 4]);
        assert_eq!(mesh.triangles.len(), 2 * 8 * 4 - 2 * 8);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let cross = (b - a).cross(c - a);
            assert!(cross.dot(a + b + c) > 0.0, "faces outwards");
        }
    }
}
