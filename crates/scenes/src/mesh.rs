//! [`Mesh`], by which the generators make triangle meshes and write them as pbrt text or PLY, and
//! [`Random`], a generator of random numbers that never changes.

use linelit_elementary::sin_cos;
use std::fmt::Write as _;

/// A triangle mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    /// The positions of the vertices.
    pub(super) points: Vec<[f64; 3]>,
    /// For each triangle, the indices of its three vertices in `points`.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a vertex, and returns its index.
    fn vertex(&mut self, p: [f64; 3]) -> u32 {
        self.points.push(p);
        u32::try_from(self.points.len() - 1).unwrap_or(u32::MAX)
    }

    /// Creates the mesh of one convex polygon.
    pub(super) fn polygon(corners: &[[f64; 3]]) -> Self {
        let mut mesh = Self::default();
        mesh.fan(corners);
        mesh
    }

    /// Creates the mesh of one box, as [`Mesh::cuboid`] adds it.
    pub(super) fn block(lo: [f64; 3], hi: [f64; 3], angle: f64) -> Self {
        let mut mesh = Self::default();
        mesh.cuboid(lo, hi, angle);
        mesh
    }

    /// Adds a convex polygon as a fan of triangles.
    pub(super) fn fan(&mut self, corners: &[[f64; 3]]) {
        let ids: Vec<u32> = corners.iter().map(|&p| self.vertex(p)).collect();
        for pair in ids[1..].windows(2) {
            self.triangles.push([ids[0], pair[0], pair[1]]);
        }
    }

    /// Adds the six faces of a box between two corners, which face outwards. The box is turned by
    /// `angle` about the vertical axis through its centre.
    pub(super) fn cuboid(&mut self, lo: [f64; 3], hi: [f64; 3], angle: f64) {
        // Add the corners: the bits of their numbers choose between `lo` and `hi` along each axis.
        let centre = [0.5 * (lo[0] + hi[0]), 0.5 * (lo[2] + hi[2])];
        let (sin, cos) = sin_cos(angle);
        let corner = |k: usize| {
            let pick = |axis: usize| {
                if k >> axis & 1 == 0 {
                    lo[axis]
                } else {
                    hi[axis]
                }
            };
            let (x, z) = (pick(0) - centre[0], pick(2) - centre[1]);
            [
                centre[0] + cos * x + sin * z,
                pick(1),
                centre[1] - sin * x + cos * z,
            ]
        };
        let ids: Vec<u32> = (0..8).map(|k| self.vertex(corner(k))).collect();
        // Add two triangles for each face.
        for [a, b, c, d] in [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ] {
            self.triangles.push([ids[a], ids[b], ids[c]]);
            self.triangles.push([ids[a], ids[c], ids[d]]);
        }
    }

    /// Adds a parametrised surface as a grid of `rows × columns` cells. `at` returns the position
    /// for parameters from 0 to 1 along the rows and the columns; `wraps` says whether the last
    /// column of cells ends at the first column of vertices.
    pub(super) fn surface(
        &mut self,
        [rows, columns]: [u32; 2],
        wraps: bool,
        at: impl Fn(f64, f64) -> [f64; 3],
    ) {
        // Add the vertices row by row.
        let across = if wraps { columns } else { columns + 1 };
        let base = u32::try_from(self.points.len()).unwrap_or(u32::MAX);
        for i in 0..=rows {
            for j in 0..across {
                self.points.push(at(
                    f64::from(i) / f64::from(rows),
                    f64::from(j) / f64::from(columns),
                ));
            }
        }
        // Add two triangles for each cell.
        for i in 0..rows {
            for j in 0..columns {
                let id = |i: u32, j: u32| base + i * across + j % across;
                let [a, b, c, d] = [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)];
                self.triangles.push([a, b, c]);
                self.triangles.push([a, c, d]);
            }
        }
    }

    /// Returns the mesh as a pbrt `trianglemesh`.
    pub(super) fn text(&self) -> String {
        let mut out = String::from("Shape \"trianglemesh\" \"integer indices\" [");
        for [a, b, c] in &self.triangles {
            let _ = write!(out, " {a} {b} {c}");
        }
        out.push_str(" ]\n  \"point3 P\" [");
        for p in &self.points {
            let [x, y, z] = p.map(rounded);
            let _ = write!(out, " {x} {y} {z}");
        }
        out.push_str(" ]");
        out
    }

    /// Returns the mesh as a binary little-endian PLY file.
    pub(super) fn ply(&self) -> Vec<u8> {
        let mut out = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.points.len(),
            self.triangles.len()
        )
        .into_bytes();
        for value in self.points.iter().flatten() {
            #[allow(clippy::cast_possible_truncation, reason = "PLY holds f32")]
            out.extend((*value as f32).to_le_bytes());
        }
        for triangle in &self.triangles {
            out.push(3);
            for index in triangle {
                out.extend(index.to_le_bytes());
            }
        }
        out
    }
}

/// Rounds a coordinate to five decimals. Mathematical libraries may differ in the last digit of a
/// sine, but files must not.
pub(super) fn rounded(v: f64) -> f64 {
    let r = (v * 1e5).round() / 1e5;
    if r == 0.0 { 0.0 } else { r }
}

/// A linear congruential generator with the constants of Knuth's MMIX, of which only the high bits
/// are used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Random(u64);

impl Random {
    /// Creates the generator for a seed.
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next number, uniform between `lo` and `hi`.
    pub(super) fn between(&mut self, lo: f64, hi: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let high = u32::try_from(self.0 >> 32).unwrap_or(0);
        lo + (hi - lo) * (f64::from(high) / 4_294_967_296.0)
    }
}
