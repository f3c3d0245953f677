//! Round shapes as triangles.
//!
//! Spheres, disks and cylinders become meshes whose vertices are on the surface, with its normals
//! and with pbrt's texture coordinates. A facet of angle α bulges inwards by 1 − cos(α/2) of the
//! radius: 0.5 % with 32 steps around, 0.12 % with 64.

use linelit_elementary::{acos, sin_cos};
use linelit_geometry::DVec3;
use linelit_scene::MeshData;

/// Steps around and from pole to pole; the emissive ones are fewer because each facet is a light.
pub(crate) const STEPS: [usize; 2] = [64, 32];
pub(crate) const EMISSIVE_STEPS: [usize; 2] = [24, 12];

/// A part of a sphere: between two heights, and from longitude 0 to `phi_max` (radians).
pub(crate) fn sphere(
    radius: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
    [around, up]: [usize; 2],
) -> MeshData {
    let theta = |z: f64| acos((z / radius).clamp(-1.0, 1.0));
    let (bottom, top) = (theta(z_min), theta(z_max));
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

/// An annulus at a height, facing +z.
pub(crate) fn disk(height: f64, radius: f64, inner: f64, phi_max: f64, around: usize) -> MeshData {
    let ring = |v: f64| (height, radius + v * (inner - radius));
    revolve([around, 1], phi_max, ring, |_| DVec3::Z)
}

/// A tube around z.
pub(crate) fn cylinder(
    radius: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
    around: usize,
) -> MeshData {
    let ring = |v: f64| (z_min + v * (z_max - z_min), radius);
    revolve([around, 1], phi_max, ring, |p| {
        DVec3::new(p.x, p.y, 0.0) / radius
    })
}

/// A surface of revolution: `ring(v)` gives height and radius.
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
    let mut mesh = MeshData {
        one_shape: true,
        ..MeshData::default()
    };
    let closed = phi_max >= std::f64::consts::TAU;
    let mut radii = Vec::new();
    for j in 0..=up {
        let v = j as f64 / up as f64;
        let (z, r) = ring(v);
        radii.push(r);
        for i in 0..=around {
            let u = i as f64 / around as f64;
            // The seam must close exactly.
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

/// A bilinear patch as a grid of `n` × `n` cells, appended to a mesh; corners p00, p10, p01, p11.
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
    use std::f64::consts::{PI, TAU};

    fn area(mesh: &MeshData) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
        let areas = mesh
            .triangles
            .iter()
            .map(corners)
            .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length());
        areas.sum()
    }

    #[test]
    fn areas_approach_the_surface() {
        // Inscribed facets lose a share of about (α²)/6 around and along.
        let loss = |n: f64| 1.2 * (TAU / n).powi(2) / 6.0;
        let s = area(&sphere(2.0, -2.0, 2.0, TAU, [64, 32])) / (16.0 * PI);
        assert!(s < 1.0 && s > 1.0 - 2.0 * loss(64.0), "{s}");
        let d = area(&disk(1.0, 2.0, 1.0, TAU, 64)) / (3.0 * PI);
        assert!(d < 1.0 && d > 1.0 - loss(64.0), "{d}");
        let c = area(&cylinder(2.0, -1.0, 1.0, PI, 64)) / (4.0 * PI);
        assert!(c < 1.0 && c > 1.0 - loss(64.0), "{c}");
    }

    #[test]
    fn spheres_close_at_poles_and_seam_without_slivers() {
        let mesh = sphere(1.0, -1.0, 1.0, TAU, [8, 4]);
        assert_eq!(mesh.triangles.len(), 2 * 8 * 4 - 2 * 8);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let cross = (b - a).cross(c - a);
            assert!(cross.dot(a + b + c) > 0.0, "faces outwards");
        }
    }
}
