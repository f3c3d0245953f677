//! What the horizons of the surface and of the lobe leave of a triangle.
//!
//! Corners P₀, P₁, P₂ with fᵢ = n·Pᵢ and lᵢ = w·Pᵢ; edge k is opposite Pₖ, from Pᵢ to Pⱼ. It meets
//! the surface's horizon where its corners have the weights fⱼ and −fᵢ over fⱼ − fᵢ, and w·ω is
//! there −mₖ/(fⱼ − fᵢ), with
//!
//! ```text
//! mₖ = fᵢ lⱼ − fⱼ lᵢ = (n × w)·(Pᵢ × Pⱼ)
//! ```
//!
//! It meets the lobe's where they have the weights of lⱼ and −lᵢ, and n·ω is mₖ/(lⱼ − lᵢ); both
//! horizons meet along ±n × w, where the corners' weights are mₖ/det(P₀, P₁, P₂). So nine numbers,
//! each accurate relative to itself by one of its two forms, say by their signs which corners there
//! are, and by products and quotients what there is to know of them: nothing cancels, however near
//! the light's plane is, and the horizons to one another.

use super::{Corner, Triangle};
use crate::exact::length;
use crate::horizon::crossing;
use crate::span::power_of_two_unit;
use linelit_geometry::double::{self, Double, Doubles, vector};
use linelit_geometry::{DVec3, predicates};

/// Two horizons may add a corner each to a triangle.
const MOST: usize = 5;
/// A difference below this share of its terms has lost more than three bits.
const CANCELLED: f64 = 0.125;
/// Products below may have lost digits to the range of numbers.
const LEAST_PRODUCT: f64 = 1e-200;
/// Cosine of a diagonal from where on its rounded ends do not know its plane to 1e-13.
const NEARLY_STRAIGHT: f64 = -0.999_99;

/// The surface's horizon (0) and the lobe's own (1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Horizons {
    normals: [DVec3; 2],
    /// n × w.
    both: Doubles<3>,
    /// The greatest values of n·ω and w·ω.
    most: [f64; 2],
}

/// What a side runs along: an edge of the triangle, or a horizon.
#[derive(Clone, Copy, Debug)]
enum Side {
    Edge(usize),
    Horizon(usize),
}

/// Which corner it is.
#[derive(Clone, Copy, Debug)]
enum Origin {
    /// Of the triangle.
    Given,
    /// Where an edge meets a horizon, whose cosine changes by `span` along the edge.
    Cut {
        edge: usize,
        horizon: usize,
        span: f64,
    },
    /// Where both horizons meet, along n × w times that sign.
    Both(f64),
}

#[derive(Clone, Copy, Debug)]
struct Vertex {
    corner: Corner,
    /// Of the triangle's corners: it is the sum of them with these weights.
    weights: [f64; 3],
    origin: Origin,
    /// Along which it goes on to the next one.
    side: Side,
}

/// The triangle that is cut.
struct Given {
    corners: [Corner; 3],
    /// Cross products along the edges.
    edges: [DVec3; 3],
    volume: f64,
    minors: [f64; 3],
}

/// A part with up to five corners.
#[derive(Clone, Copy)]
struct Part {
    vertices: [Vertex; MOST],
    count: usize,
}

impl Part {
    fn push(&mut self, vertex: Vertex) {
        // Rounding cannot make a line cross the border of what is convex more than twice: signs are
        // exact.
        if let Some(slot) = self.vertices.get_mut(self.count) {
            *slot = vertex;
            self.count += 1;
        }
    }
}

impl Horizons {
    pub(super) fn new(n: DVec3, w: DVec3) -> Self {
        Self {
            normals: [n, w],
            both: double::cross_of(n, w),
            most: [n.length(), w.length()],
        }
    }

    /// The sum of `part` over the triangles that are left of one, by corners of length one;
    /// `volume` is the determinant of `points`.
    pub(super) fn above(
        &self,
        points: [DVec3; 3],
        volume: f64,
        mut part: impl FnMut(Triangle) -> f64,
    ) -> f64 {
        let corners = points.map(|p| Corner::new(p, self.normals));
        let side = |k: usize| predicates::cross(points[(k + 1) % 3], points[(k + 2) % 3]);
        let edges = [side(0), side(1), side(2)];
        if corners.iter().all(|c| c.values.iter().all(|v| *v >= 0.0)) {
            let r = points.map(length);
            let unit = |i: usize| corners[i].over(r[i]).at_most(self.most);
            return part(Triangle {
                corners: [unit(0), unit(1), unit(2)],
                sides: [0, 1, 2].map(|i| edges[i] / r[(i + 1) % 3] / r[(i + 2) % 3]),
                volume: [volume / r[0] / r[1], 1.0 / r[2]],
            });
        }
        let below = |h: usize| corners.iter().all(|c| c.values[h] <= 0.0);
        if below(0) || below(1) {
            return 0.0;
        }
        let given = Given {
            corners,
            edges,
            volume,
            minors: [0, 1, 2].map(|k| self.minor(&corners, k)),
        };
        let vertex = |i: usize| {
            let mut weights = [0.0; 3];
            weights[i] = 1.0;
            Vertex {
                corner: corners[i],
                weights,
                origin: Origin::Given,
                side: Side::Edge((i + 2) % 3),
            }
        };
        let first = vertex(0);
        let whole = Part {
            vertices: [first, vertex(1), vertex(2), first, first],
            count: 3,
        };
        let left = self.clip(&given, &self.clip(&given, &whole, 0), 1);
        if left.count < 3 {
            return 0.0;
        }
        let left = Left::new(self, &given, &left.vertices[..left.count]);
        left.map_or(0.0, |left| left.triangles().map(part).sum())
    }

    /// mₖ.
    fn minor(&self, corners: &[Corner; 3], k: usize) -> f64 {
        let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
        let ([fa, la], [fb, lb]) = (a.values, b.values);
        let (one, other) = (fa * lb, fb * la);
        let minor = one - other;
        if minor.abs() > CANCELLED * (one.abs() + other.abs()) && minor.abs() > LEAST_PRODUCT {
            minor
        } else {
            self.accurate_minor(a.at, b.at)
        }
    }

    #[cold]
    #[inline(never)]
    fn accurate_minor(&self, a: DVec3, b: DVec3) -> f64 {
        double::dot(self.both, double::cross_of(a, b)).hi()
    }

    /// What of a part is above a horizon.
    fn clip(&self, given: &Given, source: &Part, horizon: usize) -> Part {
        let mut out = Part {
            count: 0,
            ..*source
        };
        let vertices = &source.vertices[..source.count];
        for (at, a) in vertices.iter().enumerate() {
            let b = vertices[(at + 1) % source.count];
            let [from, to] = [a, &b].map(|v| v.corner.values[horizon]);
            let leaves = from >= 0.0 && to < 0.0;
            let along = if leaves {
                Side::Horizon(horizon)
            } else {
                a.side
            };
            if from >= 0.0 {
                let side = if from > 0.0 { a.side } else { along };
                out.push(Vertex { side, ..*a });
            }
            if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
                let cut = self.cut(given, a.side, horizon);
                out.push(Vertex { side: along, ..cut });
            }
        }
        out
    }

    /// Where a side meets a horizon.
    fn cut(&self, given: &Given, side: Side, horizon: usize) -> Vertex {
        let Side::Edge(k) = side else {
            return self.meeting(given);
        };
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (a, b) = (given.corners[i], given.corners[j]);
        let [from, to] = [a, b].map(|c| c.values[horizon]);
        let span = to - from;
        let mut weights = [0.0; 3];
        (weights[i], weights[j]) = (to / span, -from / span);
        let other = 1 - horizon;
        let [u, v] = [a, b].map(|c| c.values[other]);
        let mut values = [0.0; 2];
        values[other] = if (u >= 0.0) == (v >= 0.0) {
            u * weights[i] + v * weights[j]
        } else if horizon == 0 {
            -given.minors[k] / span
        } else {
            given.minors[k] / span
        };
        let corner = Corner {
            at: crossing(a.at, b.at, self.normals[horizon], from, to),
            values,
        };
        Vertex {
            corner,
            weights,
            origin: Origin::Cut {
                edge: k,
                horizon,
                span,
            },
            side,
        }
    }

    /// Where both meet, within the triangle.
    fn meeting(&self, given: &Given) -> Vertex {
        let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
        let sign = (given.minors.iter().fold(0.0, larger) * given.volume.signum()).signum();
        Vertex {
            corner: Corner {
                at: double::rounded(self.both) * sign,
                values: [0.0; 2],
            },
            weights: given.minors.map(|m| (sign * m / given.volume).max(0.0)),
            origin: Origin::Both(sign),
            side: Side::Horizon(1),
        }
    }

    /// What the cross product of a vertex and the next one is of the normal of their side, over
    /// `length`.
    fn turn(given: &Given, a: &Vertex, b: &Vertex, length: f64) -> f64 {
        let value = |v: &Vertex, horizon: usize| v.corner.values[horizon] / length;
        match (a.side, a.origin, b.origin) {
            (Side::Edge(_), _, Origin::Cut { horizon, span, .. }) => -value(a, horizon) / span,
            (Side::Edge(_), Origin::Cut { horizon, span, .. }, _) => value(b, horizon) / span,
            (Side::Edge(_), ..) => 1.0 / length,
            (Side::Horizon(0), _, Origin::Both(sign)) => sign * value(a, 1),
            (Side::Horizon(_), _, Origin::Both(sign)) => -sign * value(a, 0),
            (Side::Horizon(0), Origin::Both(sign), _) => -sign * value(b, 1),
            (Side::Horizon(_), Origin::Both(sign), _) => sign * value(b, 0),
            (Side::Horizon(h), ..) => {
                let value = |i: usize| given.corners[i].values[h];
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
                given.volume / value(i) * minor / length
            }
        }
    }
}

/// A part that is left, with its corners as unit vectors.
struct Left<'a> {
    horizons: &'a Horizons,
    given: &'a Given,
    vertices: &'a [Vertex],
    units: [Corner; MOST],
    lengths: [f64; MOST],
}

impl<'a> Left<'a> {
    /// `None` with a corner at the shading point.
    fn new(horizons: &'a Horizons, given: &'a Given, vertices: &'a [Vertex]) -> Option<Self> {
        let mut units = [vertices[0].corner; MOST];
        let mut lengths = [0.0; MOST];
        for (i, vertex) in vertices.iter().enumerate() {
            lengths[i] = length(vertex.corner.at);
            units[i] = vertex.corner.over(lengths[i]).at_most(horizons.most);
        }
        let some = lengths[..vertices.len()].iter().all(|r| *r > 0.0);
        some.then_some(Self {
            horizons,
            given,
            vertices,
            units,
            lengths,
        })
    }

    /// The cross product of a corner and the next one.
    fn side(&self, i: usize) -> DVec3 {
        let j = (i + 1) % self.vertices.len();
        let (a, b) = (self.lengths[i], self.lengths[j]);
        let (from, to) = (&self.vertices[i], &self.vertices[j]);
        let turn = Horizons::turn(self.given, from, to, a.min(b));
        let normal = match from.side {
            Side::Edge(k) => self.given.edges[k],
            Side::Horizon(h) => self.horizons.normals[h],
        };
        normal / a.max(b) * turn
    }

    /// The height over a side of the corner i.
    fn height(&self, side: usize, i: usize) -> f64 {
        match self.vertices[side].side {
            Side::Edge(k) => self.given.volume * self.vertices[i].weights[k] / self.lengths[i],
            Side::Horizon(h) => self.units[i].values[h],
        }
    }

    /// The cross product of two corners that are not neighbours.
    fn diagonal(&self, i: usize, j: usize) -> DVec3 {
        let [p, q] = [i, j].map(|v| self.units[v].at);
        if p.dot(q) > NEARLY_STRAIGHT {
            return predicates::cross(p, q);
        }
        // Of the next corner and the one before, j is a sum with these weights, but for i itself.
        let count = self.vertices.len();
        let (next, before) = ((i + 1) % count, (i + count - 1) % count);
        let one = self.side(i) * (self.height(before, j) / self.height(before, next));
        let other = self.side(before) * (self.height(i, j) / self.height(i, before));
        let sum = one - other;
        if length(sum) > CANCELLED * (length(one) + length(other)) {
            return sum;
        }
        let [p, q] = [i, j].map(|v| self.place(&self.vertices[v]));
        let [r, s] = [p, q].map(|v| length(double::rounded(v)));
        double::rounded(double::cross(p, q)) / r / s
    }

    /// The triangles from that corner from which the diagonals are farthest from half a turn.
    fn triangles(&self) -> impl Iterator<Item = Triangle> {
        let count = self.vertices.len();
        let apex = best_apex(&self.units[..count]);
        (1..count - 1).map(move |step| self.triangle(apex, step))
    }

    /// The triangle of the apex, the corner so many steps after it and the next one.
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
        // By the longest side of the part, which is the farthest from what underflows.
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
        let turn = Horizons::turn(self.given, from, to, self.lengths[b]) / self.lengths[c];
        Triangle {
            corners: at.map(|i| self.units[i]),
            sides,
            volume: [self.height(b, a), turn],
        }
    }

    /// Where a vertex is, scaled to about length one.
    fn place(&self, vertex: &Vertex) -> Doubles<3> {
        let at = match vertex.origin {
            Origin::Given => vector(vertex.corner.at),
            Origin::Both(sign) => self.horizons.both.map(|c| c * Double::from(sign)),
            Origin::Cut {
                edge,
                horizon,
                span,
            } => {
                let [a, b] = [1, 2].map(|t| self.given.corners[(edge + t) % 3].at);
                let normal = vector(self.horizons.normals[horizon] * span.signum());
                double::cross(normal, double::cross_of(a, b))
            }
        };
        let largest = double::rounded(at).abs().max_element();
        let unit = power_of_two_unit(largest).unwrap_or(0.0);
        at.map(|c| c * Double::from(unit))
    }
}

/// The corner from which the diagonals are farthest from half a turn.
fn best_apex(units: &[Corner]) -> usize {
    let count = units.len();
    if count == 3 {
        return 0;
    }
    let least = |apex: usize| {
        let cosine = |t: usize| units[apex].at.dot(units[(apex + t) % count].at);
        (2..count - 1).map(cosine).fold(1.0, f64::min)
    };
    let better = |best: (usize, f64), i: usize| {
        let value = least(i);
        if value > best.1 { (i, value) } else { best }
    };
    (1..count).fold((0, least(0)), better).0
}
