//! Surfaces for checks: techniques draw points of them, and integrals run over them.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]
#![allow(
    clippy::type_complexity,
    reason = "maps there and back, whose types have no names"
)]

use std::f64::consts::TAU;

/// A surface as a map from the unit square, with its inverse.
/// [`Technique::try_2d`](super::Technique::try_2d) counts samples in the square and integrates over
/// it.
///
/// `place` returns a point and the ratio of the measure of the surface there to the measure of the
/// square (|∂p/∂u × ∂p/∂v| for areas); `locate` returns the position in the square.
#[derive(Clone, Debug)]
pub struct Surface<P, L> {
    /// The map from the square to the surface.
    pub place: P,
    /// The map from the surface to the square; `None` for points off the surface.
    pub locate: L,
    /// The values of the first coordinate at which densities have a corner or jump.
    pub seams: Vec<f64>,
}

type Vector = [f64; 3];

/// Returns a + `factor` b.
fn sum(a: Vector, b: Vector, factor: f64) -> Vector {
    [0, 1, 2].map(|k| a[k] + factor * b[k])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| a[i] * b[j] - a[j] * b[i])
}

/// Returns the coordinates of a vector of the plane along two others.
fn along(w: Vector, u: Vector, v: Vector) -> [f64; 2] {
    let n = cross(u, v);
    [dot(cross(w, v), n), dot(cross(u, w), n)].map(|x| x / dot(n, n))
}

/// Clamps coordinates to the square if rounding moved them off it by at most 1e-9.
fn inside(at: [f64; 2]) -> Option<[f64; 2]> {
    let near = at.iter().all(|x| (-1e-9..=1.0 + 1e-9).contains(x));
    near.then(|| at.map(|x| x.clamp(0.0, 1.0)))
}

/// Returns the parallelogram `o + s u + t v`, by area.
pub fn parallelogram(
    o: Vector,
    u: Vector,
    v: Vector,
) -> Surface<impl Fn([f64; 2]) -> (Vector, f64), impl Fn(Vector) -> Option<[f64; 2]>> {
    let n = cross(u, v);
    let area = dot(n, n).sqrt();
    Surface {
        place: move |[s, t]: [f64; 2]| (sum(sum(o, u, s), v, t), area),
        locate: move |p| inside(along(sum(p, o, -1.0), u, v)),
        seams: Vec::new(),
    }
}

/// Returns the triangle of three corners, by area: `a + t ((b − a) + s (c − b))`, where t = 0 is
/// the first corner.
pub fn triangle(
    a: Vector,
    b: Vector,
    c: Vector,
) -> Surface<impl Fn([f64; 2]) -> (Vector, f64), impl Fn(Vector) -> Option<[f64; 2]>> {
    let (u, v) = (sum(b, a, -1.0), sum(c, b, -1.0));
    let n = cross(u, v);
    let area = dot(n, n).sqrt();
    Surface {
        place: move |[s, t]: [f64; 2]| (sum(sum(a, u, t), v, s * t), area * t),
        locate: move |p| {
            let [t, st] = along(sum(p, a, -1.0), u, v);
            inside([if t > 0.0 { st / t } else { 0.0 }, t])
        },
        seams: Vec::new(),
    }
}

/// Returns the directions above z = 0, by solid angle; the coordinates are the azimuth over 2π and
/// the cosine.
pub fn hemisphere()
-> Surface<impl Fn([f64; 2]) -> (Vector, f64), impl Fn(Vector) -> Option<[f64; 2]>> {
    Surface {
        place: |[turn, z]: [f64; 2]| {
            let (sin, cos) = (turn * TAU).sin_cos();
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            ([r * cos, r * sin, z], TAU)
        },
        locate: |w: Vector| {
            let turn = (w[1].atan2(w[0]) / TAU).rem_euclid(1.0);
            inside([turn, w[2]])
        },
        seams: Vec::new(),
    }
}
