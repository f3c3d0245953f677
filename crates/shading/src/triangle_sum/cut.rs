//! This module computes the part of a triangle above the horizon without cancellation.
//!
//! Let the corners be P₀, P₁, P₂ with fᵢ = n·Pᵢ; edge k is opposite to Pₖ and runs from Pᵢ to Pⱼ.
//! It meets the horizon where its corners have the weights fⱼ and −fᵢ, divided by fⱼ − fᵢ. The part
//! above the horizon is given by products and quotients of these weights and of the determinant:
//!
//! ```text
//!            P₀                    above: a triangle, or a quadrilateral
//!           ╱  ╲
//!   ───────•────•───── horizon     • : vertices with weights of two corners
//!        ╱        ╲
//!      P₁──────────P₂
//! ```
//!
//! Nothing cancels, however near the light's plane is, and however close the horizon is to it.

use super::{Corner, Triangle};
use crate::exact::{dot, length};
use crate::horizon::crossing;
use crate::span::power_of_two_unit;
use linelit_geometry::double::{self, Double, Doubles, vector};
use linelit_geometry::{DVec3, predicates};

/// The largest number of vertices: the horizon may add one to a triangle.
const MOST: usize = 4;
/// A difference below this fraction of its terms has lost more than three bits.
const CANCELLED: f64 = 0.125;
/// The cosine of a diagonal's angle beyond which its rounded ends do not determine its plane to
/// 1e-13.
const NEARLY_STRAIGHT: f64 = -0.999_99;

/// The line along which a side of the part runs: an edge of the triangle, or the horizon.
#[derive(Clone, Copy, Debug)]
enum Side {
    Edge(usize),
    Horizon,
}

/// A vertex of the part above the horizon.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    corner: Corner,
    /// The weights with which the triangle's corners sum to the vertex.
    weights: [f64; 3],
    /// The edge that meets the horizon here, if there is one, and the change of n·P along it.
    cut: Option<(usize, f64)>,
    /// The line along which the boundary continues to the next vertex.
    side: Side,
}

/// The triangle that is cut.
struct Given {
    n: DVec3,
    corners: [Corner; 3],
    /// The cross products of the ends of each edge.
    edges: [DVec3; 3],
    volume: f64,
}

/// Returns the sum of `part` over the triangles into which the part above the horizon is divided,
/// with corners of length one; `volume` is the determinant of `points`.
pub(super) fn above(
    n: DVec3,
    points: [DVec3; 3],
    volume: f64,
    part: impl Fn(Triangle) -> f64,
) -> f64 {
    let corners = points.map(|at| Corner {
        at,
        value: dot(n, at),
    });
    if corners.iter().all(|c| c.value <= 0.0) {
        return 0.0;
    }
    let edge = |k: usize| predicates::cross(points[(k + 1) % 3], points[(k + 2) % 3]);
    let edges = [edge(0), edge(1), edge(2)];
    let given = Given {
        n,
        corners,
        edges,
        volume,
    };
    // A triangle that is completely above the horizon needs no cut.
    if corners.iter().all(|c| c.value >= 0.0) {
        let (r, most) = (points.map(length), n.length());
        return part(Triangle {
            corners: [0, 1, 2].map(|i| corners[i].over(r[i], most)),
            sides: [0, 1, 2].map(|i| edges[i] / r[(i + 1) % 3] / r[(i + 2) % 3]),
            volume: [volume / r[0] / r[1], 1.0 / r[2]],
        });
    }
    // Cut the triangle, and divide the rest.
    let (vertices, count) = given.clipped();
    // If cosines are not numbers, there is no part above.
    if count < 3 {
        return 0.0;
    }
    let left = Left::new(&given, &vertices[..count]);
    left.map_or(0.0, |left| left.triangles().map(part).sum())
}

impl Given {
    /// Returns the part above the horizon, and its number of corners.
    fn clipped(&self) -> ([Vertex; MOST], usize) {
        let given = |i: usize, side: Side| {
            let mut weights = [0.0; 3];
            weights[i] = 1.0;
            let corner = self.corners[i];
            Vertex {
                corner,
                weights,
                cut: None,
                side,
            }
        };
        let mut out = [given(0, Side::Horizon); MOST];
        let mut count = 0;
        let mut push = |vertex: Vertex| {
            out[count] = vertex;
            count += 1;
        };
        // Walk around the triangle, and add a vertex where an edge crosses the horizon.
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let [from, to] = [i, j].map(|i| self.corners[i].value);
            if from > 0.0 || (from >= 0.0 && to >= 0.0) {
                push(given(i, Side::Edge(k)));
            } else if from >= 0.0 {
                push(given(i, Side::Horizon));
            }
            if from > 0.0 && to < 0.0 {
                push(self.cut(k, Side::Horizon));
            } else if from < 0.0 && to > 0.0 {
                push(self.cut(k, Side::Edge(k)));
            }
        }
        (out, count)
    }

    /// Returns the vertex where an edge meets the horizon, to continue along `side`.
    fn cut(&self, edge: usize, side: Side) -> Vertex {
        let (i, j) = ((edge + 1) % 3, (edge + 2) % 3);
        let (a, b) = (self.corners[i], self.corners[j]);
        let span = b.value - a.value;
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (b.value / span, -a.value / span);
        let at = crossing(a.at, b.at, self.n, a.value, b.value);
        Vertex {
            corner: Corner { at, value: 0.0 },
            weights,
            cut: Some((edge, span)),
            side,
        }
    }

    /// Returns the cross product of a vertex and the next one, divided by `length`, as a factor of
    /// the normal of their side.
    fn turn(&self, a: &Vertex, b: &Vertex, length: f64) -> f64 {
        match (a.side, a.cut, b.cut) {
            (Side::Edge(_), _, Some((_, span))) => -a.corner.value / length / span,
            (Side::Edge(_), Some((_, span)), _) => b.corner.value / length / span,
            (Side::Edge(_), ..) => 1.0 / length,
            (Side::Horizon, ..) => {
                let value = |i: usize| self.corners[i].value;
                let larger = |i: usize, j: usize| {
                    if value(j).abs() > value(i).abs() {
                        j
                    } else {
                        i
                    }
                };
                let i = larger(larger(0, 1), 2);
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                // One of the products is zero.
                let minor = a.weights[j] * b.weights[k] - a.weights[k] * b.weights[j];
                self.volume / value(i) * minor / length
            }
        }
    }

    /// Returns the position of a vertex in twice the working precision, scaled to about unit
    /// length.
    fn place(&self, vertex: &Vertex) -> Doubles<3> {
        let at = match vertex.cut {
            None => vector(vertex.corner.at),
            Some((edge, span)) => {
                let [a, b] = [1, 2].map(|t| self.corners[(edge + t) % 3].at);
                let normal = vector(self.n * span.signum());
                double::cross(normal, double::cross_of(a, b))
            }
        };
        let largest = double::rounded(at).abs().max_element();
        let unit = power_of_two_unit(largest).unwrap_or(0.0);
        at.map(|c| c * Double::from(unit))
    }
}

/// The part above the horizon, with its corners as unit vectors.
struct Left<'a> {
    given: &'a Given,
    vertices: &'a [Vertex],
    units: [Corner; MOST],
    lengths: [f64; MOST],
}

impl<'a> Left<'a> {
    /// Normalizes the corners; `None` if one is at the shading point.
    fn new(given: &'a Given, vertices: &'a [Vertex]) -> Option<Self> {
        let mut units = [vertices[0].corner; MOST];
        let mut lengths = [0.0; MOST];
        for (i, vertex) in vertices.iter().enumerate() {
            lengths[i] = length(vertex.corner.at);
            units[i] = vertex.corner.over(lengths[i], given.n.length());
        }
        let some = lengths[..vertices.len()].iter().all(|r| *r > 0.0);
        some.then_some(Self {
            given,
            vertices,
            units,
            lengths,
        })
    }

    /// Returns the cross product of a corner and the next one.
    fn side(&self, i: usize) -> DVec3 {
        let j = (i + 1) % self.vertices.len();
        let (a, b) = (self.lengths[i], self.lengths[j]);
        let (from, to) = (&self.vertices[i], &self.vertices[j]);
        let turn = self.given.turn(from, to, a.min(b));
        let normal = match from.side {
            Side::Edge(k) => self.given.edges[k],
            Side::Horizon => self.given.n,
        };
        normal / a.max(b) * turn
    }

    /// Returns the height of the corner i above a side.
    fn height(&self, side: usize, i: usize) -> f64 {
        match self.vertices[side].side {
            Side::Edge(k) => self.given.volume * self.vertices[i].weights[k] / self.lengths[i],
            Side::Horizon => self.units[i].value,
        }
    }

    /// Returns the cross product of two corners that are not neighbours.
    fn diagonal(&self, i: usize, j: usize) -> DVec3 {
        let [p, q] = [i, j].map(|v| self.units[v].at);
        if p.dot(q) > NEARLY_STRAIGHT {
            return predicates::cross(p, q);
        }
        // The corner j is a weighted sum of the next corner, the one before, and i itself.
        let count = self.vertices.len();
        let (next, before) = ((i + 1) % count, (i + count - 1) % count);
        let one = self.side(i) * (self.height(before, j) / self.height(before, next));
        let other = self.side(before) * (self.height(i, j) / self.height(i, before));
        let sum = one - other;
        if length(sum) > CANCELLED * (length(one) + length(other)) {
            return sum;
        }
        let [p, q] = [i, j].map(|v| self.given.place(&self.vertices[v]));
        let [r, s] = [p, q].map(|v| length(double::rounded(v)));
        double::rounded(double::cross(p, q)) / r / s
    }

    /// Divides the part into triangles by the diagonal whose angle is farther from half a turn.
    fn triangles(&self) -> impl Iterator<Item = Triangle> {
        let count = self.vertices.len();
        let cosine = |i: usize| self.units[i].at.dot(self.units[i + 2].at);
        let apex = usize::from(count == MOST && cosine(1) > cosine(0));
        (1..count - 1).map(move |step| self.triangle(apex, step))
    }

    /// Returns the triangle of the apex and two neighbouring corners, the first of which is `step`
    /// corners after the apex.
    fn triangle(&self, apex: usize, step: usize) -> Triangle {
        let count = self.vertices.len();
        let at = [0, step, step + 1].map(|t| (apex + t) % count);
        let is_side = [true, step + 2 == count, step == 1];
        let sides = [0, 1, 2].map(|i| {
            let (from, to) = (at[(i + 1) % 3], at[(i + 2) % 3]);
            if is_side[i] {
                self.side(from)
            } else {
                self.diagonal(from, to)
            }
        });
        // Use the longest side of the part, which is farthest from underflow.
        let longer = |best: usize, i: usize| {
            if is_side[i] && length(sides[i]) > length(sides[best]) {
                i
            } else {
                best
            }
        };
        let base = (1..3).fold(0, longer);
        let [a, b, c] = [base, base + 1, base + 2].map(|i| at[i % 3]);
        let (from, to) = (&self.vertices[b], &self.vertices[c]);
        let turn = self.given.turn(from, to, self.lengths[b]) / self.lengths[c];
        Triangle {
            corners: at.map(|i| self.units[i]),
            sides,
            volume: [self.height(b, a), turn],
        }
    }
}
