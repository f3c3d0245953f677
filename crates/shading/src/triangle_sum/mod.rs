//! This module computes the irradiance of a convex polygon as a sum over triangles, from terms that
//! are not negative. [`polygon`](crate::polygon) uses it where other sums cancel.
//!
//! Let â, b̂, ĉ be unit vectors to the corners of a triangle, v the angle along the side from b̂, δ
//! the angle of that whole side, ê(v) the direction there, R the angle from â to ê, and G the
//! function of R that integrals along lines have ([`lune`]). Then
//!
//! ```text
//! ∫ n·ω dω = det(â, b̂, ĉ) ∫ dv/sin δ · ½ [(n·â) (1 − G cos R) + (n·ê) G]
//! ```
//!
//! The part of a triangle above the [horizon](cut) has determinants that are products and
//! quotients, and n·ω follows from its values at the corners. Nothing cancels, even for the
//! thinnest sliver.

mod cut;

use crate::exact::{dot, length};
use crate::gauss::{FEW, FEW_NODES, FEW_WEIGHTS};
use crate::solid_angle::volume;
use crate::span::not_too_near;
use crate::special::lune;
use linelit_elementary::{atan2, sin, sin_cos};
use linelit_geometry::{DVec3, predicates};
use std::f64::consts::PI;

/// The cosine of the longest side (96°): longer sides are halved. Over a shorter side the error of
/// sixteen nodes is below 1e-20: the next pole of G is where R is half a turn, 84° beyond.
const LONGEST: f64 = -0.1;
/// The square of a side that is so short that the third corner is not opposite to the middle of the
/// longest side.
const SLENDER: f64 = 0.01;
/// The scale of points: it brings the rounding errors of lengths of 1e-300 above underflow.
const SCALE: f64 = 1_267_650_600_228_229_401_496_703_205_376.0;
/// The largest number of rounds of halving: the triangles of a half-sphere have sides of at most
/// 180°, 90°, 45°.
const HALVINGS: u32 = 6;
/// The cosine of an upper bound (120°) of all arcs from a corner to the shortest side, once no side
/// is longer than 96°.
const LONGEST_ARC: f64 = -0.5;

/// A corner, given by its direction or by a point in this direction.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at: DVec3,
    /// The product n·at.
    value: f64,
}

impl Corner {
    /// Returns the sum of two corners with weights that are not negative.
    fn blend(self, a: f64, other: Self, b: f64) -> Self {
        Self {
            at: self.at * a + other.at * b,
            value: self.value * a + other.value * b,
        }
    }

    /// Returns the direction of a point at the distance `length`. Its cosine is bounded by `most`,
    /// since a vertex on the horizon may be so near to the shading point that its distance
    /// underflows.
    fn over(self, length: f64, most: f64) -> Self {
        Self {
            at: self.at / length,
            value: (self.value / length).min(most),
        }
    }
}

/// A triangle above the horizon.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    corners: [Corner; 3],
    /// The cross products of the ends of the sides opposite to the corners, in order. They are
    /// stored because the rounded ends of a side of nearly 180° determine neither its plane nor its
    /// sine.
    sides: [DVec3; 3],
    /// The determinant of the corners, of either sign, as two factors: for a sliver of half a turn
    /// the product underflows.
    volume: [f64; 2],
}

/// Returns `∫ max(0, n·ω) dω` over the fan of triangles from the first vertex; it is positive where
/// they are counter-clockwise.
pub(crate) fn irradiance(vertices: &[DVec3], n: DVec3) -> f64 {
    let mut sum = 0.0;
    for pair in vertices[1..].windows(2) {
        let corners = [vertices[0], pair[0], pair[1]].map(not_too_near);
        let volume = volume(corners[0], corners[1], corners[2]);
        if volume == 0.0 {
            continue;
        }
        let points = corners.map(|p| p * SCALE);
        let volume = volume * (SCALE * SCALE * SCALE);
        sum += cut::above(n, points, volume, |t| t.divided(n, HALVINGS));
    }
    sum
}

impl Triangle {
    /// Returns ∫ n·ω dω; a triangle with a long side is divided first.
    fn divided(&self, n: DVec3, rounds: u32) -> f64 {
        let corners = self.corners;
        let chord = |i: usize| (corners[(i + 1) % 3].at - corners[(i + 2) % 3].at).length_squared();
        let chords = [chord(0), chord(1), chord(2)];
        let pick = |better: fn(&f64, &f64) -> bool| {
            (1..3).fold(0, |best, i| {
                if better(&chords[i], &chords[best]) {
                    i
                } else {
                    best
                }
            })
        };
        let longest = pick(f64::gt);
        // Integrate if all sides are short, over arcs to the shortest side.
        if rounds == 0 || 1.0 - 0.5 * chords[longest] >= LONGEST {
            return self.volume[0] * self.volume[1] * self.turned(pick(f64::lt)).sweep();
        }
        let turned = self.turned(longest);
        // Divide at the circumcentre if it is inside, and at the longest side if not.
        let [a, b, c] = [0, 1, 2].map(|i| chords[(longest + i) % 3]);
        if a < b + c && b.min(c) > SLENDER {
            turned.thirds(n, rounds)
        } else {
            turned.halves(n, rounds)
        }
    }

    /// Returns the triangle with its corners counted from another one.
    fn turned(&self, first: usize) -> Self {
        let order = [first, (first + 1) % 3, (first + 2) % 3];
        Self {
            corners: order.map(|i| self.corners[i]),
            sides: order.map(|i| self.sides[i]),
            ..*self
        }
    }

    /// Sums three parts about the circumcentre, if it is inside. (For a half-sphere, the middle of
    /// the longest side may be opposite to the third corner, so that halving would not help.)
    fn thirds(&self, n: DVec3, rounds: u32) -> f64 {
        let corners = self.corners;
        let [a, b, c] = corners.map(|c| c.at);
        let normal = predicates::cross(b - a, c - a).normalize_or_zero();
        // The rounded corners of (nearly) a half-sphere do not determine which pole is meant, and
        // whether it is inside: the triangle's orientation and its sides do.
        let turn = self.volume[0].signum() * self.volume[1].signum();
        let at = normal * turn;
        let value = dot(n, at).max(0.0);
        let centre = Corner { at, value };
        let volumes = self.sides.map(|side| dot(at, side));
        if volumes.iter().any(|v| v * turn < 0.0) {
            return self.halves(n, rounds);
        }
        let third = |i: usize| {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let part = Self {
                corners: [centre, from, to],
                sides: [
                    self.sides[(i + 2) % 3],
                    predicates::cross(to.at, at),
                    predicates::cross(at, from.at),
                ],
                volume: [volumes[(i + 2) % 3], 1.0],
            };
            part.divided(n, rounds - 1)
        };
        third(0) + third(1) + third(2)
    }

    /// Sums two parts, divided at the middle of the side opposite to the first corner.
    fn halves(&self, n: DVec3, rounds: u32) -> f64 {
        let [a, b, c] = self.corners;
        let [across, left, right] = self.sides;
        let [one, other] = self.volume;
        let sine = length(across).min(1.0);
        let angle = atan2(sine, b.at.dot(c.at));
        let (half_sine, half_cosine) = sin_cos(0.5 * angle);
        // Use the side, since ends that are opposite do not determine its direction.
        let tangent = predicates::cross(across / sine, b.at);
        let weight = half_sine / sine;
        let middle = Corner {
            at: b.at * half_cosine + tangent * half_sine,
            value: b.blend(weight, c, weight).value.min(n.length()),
        };
        let volume = if one.abs() < other.abs() {
            [one * weight, other]
        } else {
            [one, other * weight]
        };
        let inner = predicates::cross(a.at, middle.at);
        let half = |corners: [Corner; 3], [left, right]: [DVec3; 2]| {
            let sides = [across * weight, left, right];
            let part = Self {
                corners,
                sides,
                volume,
            };
            part.divided(n, rounds - 1)
        };
        half([a, b, middle], [-inner, right]) + half([a, middle, c], [left, inner])
    }

    /// Returns the integral divided by the determinant, over the arcs from the first corner to the
    /// side opposite to it.
    fn sweep(&self) -> f64 {
        let [apex, from, to] = self.corners;
        let sine = length(self.sides[0]).min(1.0);
        let angle = atan2(sine, from.at.dot(to.at));
        let term = |i: usize| {
            let u = FEW_NODES[i];
            let [a, b] = if sine > 0.0 {
                [sin(angle * (1.0 - u)) / sine, sin(angle * u) / sine]
            } else {
                [1.0 - u, u]
            };
            let end = from.blend(a, to, b);
            let cos = apex.at.dot(end.at).clamp(LONGEST_ARC, 1.0);
            let g = if cos >= 0.0 {
                lune(cos)
            } else {
                let square = (1.0 - cos) * (1.0 + cos);
                PI / (square * square.sqrt()) - lune(-cos)
            };
            FEW_WEIGHTS[i] * (apex.value * (1.0 - g * cos) + end.value * g)
        };
        let scale = if sine > 0.0 { angle / sine } else { 1.0 };
        0.5 * scale * (0..FEW).map(term).sum::<f64>()
    }
}
