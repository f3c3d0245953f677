//! This module samples a triangle uniformly by solid angle, from 1e-12 sr and less up to 2π,
//! without a threshold between techniques.
//!
//! Arvo's classic map (1995) uses cosines of the sides and angles. For a small triangle all of them
//! are 1 − O(Ω), and their digits are lost below Ω = 1e-5 or so, where renderers switch to area
//! sampling. Here every quantity is a ratio of positive terms:
//!
//! ```text
//!            c
//!           ╱│    h = Ω/2
//!         ╱  │    τ = tan(θ/2) for the arc θ from b to q on the side bc, τ₁ its value at c
//!       ╱    q    P = 1 + a·b
//!     ╱  ╱   │    D = det(a, b, c)/sin θ₁, all for unit vectors
//!   a────────b    t: the unit tangent at b towards c
//! ```
//!
//! The sub-triangle (a, b, q(τ)) has `tan(ξh) = τ D/(P + τ (a·t))`. The signed `a·t` is eliminated
//! by the known end of the arc, where ξ = 1 and τ = τ₁, which gives
//!
//! ```text
//! τ(ξ) = P sin(ξh) / [ D sin((1−ξ)h)/sin h + P sin(ξh)/τ₁ ]
//! ```
//!
//! This is monotone and has no subtraction. The second random number places the point on the arc
//! from a to q with `sin²(s/2) = ξ₂ sin²(s₁/2)`.
//!
//! Points are returned in the plane of the triangle, by interpolation between its vertices, so that
//! they stay in the triangle however small or distant it is. (The sub-triangle in tangent form:
//! Peters 2021, "BRDF importance sampling for polygonal lights", §4; the elimination is ours.)

use crate::polygon::fan::{self, Vector};
use linelit_elementary::{atan2, cos};
use linelit_geometry::finite::power_of_two_over;
use linelit_geometry::{DVec3, predicates};
use linelit_simd::{Lanes, One, sine};

/// The set-up of one triangle seen from the origin. A degenerate triangle has the solid angle 0.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    /// The edges b − a and c − b.
    ab: DVec3,
    bc: DVec3,
    /// The lengths of the corners a, b and c.
    length: [f64; 3],
    /// P = 1 + the cosine of the side ab.
    p: f64,
    /// D = the determinant of the unit vectors over the sine of the side bc.
    d: f64,
    /// tan of half the side bc.
    tau_end: f64,
    /// Half the solid angle, and its sine.
    half: f64,
    sin_half: f64,
    /// τ₁ D/sin h.
    rise: f64,
    /// |b| (1 + τ₁²).
    far: f64,
    /// For q = b + λ bc on the outer edge: a × q and a·q at λ = 0, and their slopes in λ.
    cross: [DVec3; 2],
    dot: [f64; 2],
}

/// The constants for samples of one triangle, or of one of two triangles in each lane.
#[derive(Clone, Copy)]
pub(crate) struct Each<L: Lanes> {
    p: L::D,
    half: L::D,
    rise: L::D,
    square_end: L::D,
    far: L::D,
    length: [L::D; 2],
    b: Vector<L>,
    bc: Vector<L>,
    cross: [Vector<L>; 2],
    dot: [L::D; 2],
}

/// A vertex of a light, and the same vertex as seen from the shading point.
#[derive(Clone, Copy)]
pub(crate) struct Corner {
    vertex: DVec3,
    /// The vertex relative to the shading point.
    from_x: DVec3,
    length: f64,
}

impl Corner {
    #[inline]
    pub(crate) fn new(vertex: DVec3, x: DVec3) -> Self {
        let from_x = vertex - x;
        Self {
            vertex,
            from_x,
            length: predicates::length(from_x),
        }
    }
}

/// The side of a spherical triangle between two corners a and `b = a + edge`, which subtends the
/// angle θ: `1 + cos θ`, `tan(θ/2)` and a × b. All have a small relative error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    pub(crate) one_plus: f64,
    pub(crate) tan_half: f64,
    pub(crate) cross: DVec3,
    /// The length of the cross product: |a| |b| sin θ.
    pub(crate) length: f64,
}

impl Side {
    /// Computes a side; its edge is formed before the shading point is subtracted.
    #[inline]
    pub(crate) fn between(a: &Corner, b: &Corner) -> Self {
        let edge = b.vertex - a.vertex;
        Self::new(a.from_x, b.from_x, edge, a.length, b.length)
    }

    /// Returns the side from b to a.
    #[inline]
    fn reversed(&self) -> Self {
        Self {
            cross: -self.cross,
            ..*self
        }
    }

    #[inline(always)]
    fn new(a: DVec3, b: DVec3, edge: DVec3, la: f64, lb: f64) -> Self {
        // a × b = a × (b − a): the edge has the digits that the corners of a distant triangle have
        // lost.
        Self::from_cross(predicates::cross(a, edge), a.dot(b), la * lb)
    }

    /// Makes a side from the cross product and the dot product of its ends and the product of their
    /// lengths, by the formula that does not cancel.
    #[inline]
    fn from_cross(cross: DVec3, dot: f64, product: f64) -> Self {
        let length = predicates::length(cross);
        if dot >= 0.0 {
            Self {
                one_plus: 1.0 + dot / product,
                tan_half: length / (product + dot),
                cross,
                length,
            }
        } else {
            let one_minus = product - dot;
            Self {
                one_plus: (length / product) * (length / one_minus),
                tan_half: one_minus / length,
                cross,
                length,
            }
        }
    }
}

/// Returns the cross product of a corner and an edge that is parallel to the plane z = const: two
/// of its components have one term only.
pub(crate) fn cross_in_plane(a: DVec3, edge: DVec3) -> DVec3 {
    let turn = predicates::diff_of_products(a.x, edge.y, a.y, edge.x);
    DVec3::new(-a.z * edge.y, a.z * edge.x, turn)
}

/// Returns Ω/2 by `atan2(D τ₁, P + τ₁ (a·t))`, where the longest side is taken for ab. This is the
/// only choice whose denominator does not cancel when x comes close to an edge.
fn half_solid_angle(sides: &[Side; 3], len: &[f64; 3], det: f64) -> f64 {
    let [ab, bc, ca] = sides;
    let (long, next, la, lb) = if ab.one_plus <= bc.one_plus && ab.one_plus <= ca.one_plus {
        (ab, bc, len[0], len[1])
    } else if bc.one_plus <= ca.one_plus {
        (bc, ca, len[1], len[2])
    } else {
        (ca, ab, len[2], len[0])
    };
    // a·t, t the unit tangent at b towards c; −(a × b) = b × a.
    let at = -long.cross.dot(next.cross) / (la * lb * next.length);
    let d = det / (la * next.length);
    atan2(d * next.tan_half, long.one_plus + at * next.tan_half)
}

/// Returns half the solid angle of a triangle whose sides are given by edges parallel to the plane
/// z = const; `det` is the magnitude of its determinant. The result is 0 if the triangle is
/// degenerate.
pub(crate) fn half_angle_in_plane(
    corners: [DVec3; 3],
    edges: [DVec3; 3],
    len: [f64; 3],
    det: f64,
) -> f64 {
    if det <= 0.0 || det.is_nan() {
        return 0.0;
    }
    let side = |i: usize, j: usize| {
        let cross = cross_in_plane(corners[i], edges[i]);
        Side::from_cross(cross, corners[i].dot(corners[j]), len[i] * len[j])
    };
    let half = half_solid_angle(&[side(0, 1), side(1, 2), side(2, 0)], &len, det);
    if half.is_finite() { half } else { 0.0 }
}

impl SphericalTriangle {
    /// Sets up the triangle of three corners, given its sides ab and ac.
    pub(crate) fn set(&mut self, [a, b, c]: [&Corner; 3], ab: &Side, ac: &Side) {
        let sides = [ab, &Side::between(b, c), ac];
        let length = [a.length, b.length, c.length];
        let edges = [b.vertex - a.vertex, c.vertex - b.vertex];
        // The determinant is the distance of the plane times twice the area.
        let normal = predicates::cross(edges[0], c.vertex - a.vertex);
        let det = predicates::dot(normal, a.from_x).abs();
        self.complete([a.from_x, b.from_x], edges, length, sides, det);
    }

    /// Sets up the triangle of corners a, b, c from a and b relative to the shading point, the
    /// edges b − a and c − b, the lengths of the corners, the sides ab, bc and ac, and the
    /// magnitude of the determinant.
    #[inline]
    pub(crate) fn complete(
        &mut self,
        [a, b]: [DVec3; 2],
        edges: [DVec3; 2],
        length: [f64; 3],
        [ab, bc, ac]: [&Side; 3],
        det: f64,
    ) {
        let sides = [*ab, *bc, ac.reversed()];
        let half = half_solid_angle(&sides, &length, det);
        let d = det / (length[0] * sides[1].length);
        let (p, tau_end) = (sides[0].one_plus, sides[1].tan_half);
        (self.a, self.b, self.ab, self.bc) = (a, b, edges[0], edges[1]);
        self.length = length;
        // Give a degenerate triangle the solid angle 0.
        let positive = |x: f64| x > 0.0 && x < f64::INFINITY;
        if ![half, d, tau_end, p].into_iter().all(positive) {
            (self.half, self.p) = (0.0, 0.0);
            return;
        }
        // Prepare the constants of samples, scaled if products of lengths could lose digits.
        (self.p, self.d, self.tau_end, self.half) = (p, d, tau_end, half);
        self.sin_half = sine(One, half);
        self.rise = tau_end * (d / self.sin_half);
        self.far = length[1] * (1.0 + tau_end * tau_end);
        self.cross = [ab.cross, a.cross(edges[1])];
        self.dot = [a.dot(b), a.dot(edges[1])];
        if length.iter().any(|l| !(*l > SMALL && *l < LARGE)) {
            self.scale(power_of_two_over(length[0].max(length[1])));
        }
    }

    /// Multiplies all lengths by a power of two, on which samples do not depend.
    #[cold]
    fn scale(&mut self, by: f64) {
        for v in [&mut self.a, &mut self.b, &mut self.ab, &mut self.bc] {
            *v *= by;
        }
        self.length = self.length.map(|l| l * by);
        self.far *= by;
        self.cross = self.cross.map(|v| v * by * by);
        self.dot = self.dot.map(|d| d * by * by);
    }

    /// Returns the solid angle in sr.
    pub(crate) fn solid_angle(&self) -> f64 {
        2.0 * self.half
    }

    /// Returns the constants of samples: of `other`, which has the same corner a, in the lanes of
    /// `m`, and of this triangle in the others.
    #[inline(always)]
    pub(crate) fn each<L: Lanes>(&self, l: L, other: &Self, m: L::M) -> Each<L> {
        let (s, o) = (self, other);
        Each {
            p: either(l, m, s.p, o.p),
            half: either(l, m, s.half, o.half),
            rise: either(l, m, s.rise, o.rise),
            square_end: either(l, m, s.tau_end * s.tau_end, o.tau_end * o.tau_end),
            far: either(l, m, s.far, o.far),
            length: [
                either(l, m, s.length[0], o.length[0]),
                either(l, m, s.length[2], o.length[2]),
            ],
            b: either_vector(l, m, s.b, o.b),
            bc: either_vector(l, m, s.bc, o.bc),
            cross: [
                either_vector(l, m, s.cross[0], o.cross[0]),
                either_vector(l, m, s.cross[1], o.cross[1]),
            ],
            dot: [
                either(l, m, s.dot[0], o.dot[0]),
                either(l, m, s.dot[1], o.dot[1]),
            ],
        }
    }

    /// Returns the point q on the outer edge, and q − a.
    fn on_outer(&self, lambda: f64) -> (DVec3, DVec3) {
        let step = self.bc * lambda;
        (self.b + step, self.ab + step)
    }

    /// Returns the random numbers of the point (λ, κ).
    pub(crate) fn invert(&self, lambda: f64, kappa: f64) -> [f64; 2] {
        [self.invert_outer(lambda), self.invert_inner(lambda, kappa)]
    }

    /// Inverts `sin(ξh)/sin((1−ξ)h) = ρ = τ τ₁ D/((τ₁ − τ) P sin h)`:
    /// `tan(ξh) = ρ sin h/(1 + ρ cos h)`.
    fn invert_outer(&self, lambda: f64) -> f64 {
        if self.half <= 0.0 || lambda <= 0.0 {
            return 0.0;
        }
        if lambda >= 1.0 {
            return 1.0;
        }
        let (q, _) = self.on_outer(lambda);
        let (lq, back) = (q.length(), self.bc * (1.0 - lambda));
        let side = Side::new(self.b, q, self.bc * lambda, self.length[1], lq);
        let rest = Side::new(q, q + back, back, lq, self.length[2]).tan_half;
        let (tau, end) = (side.tan_half, self.tau_end);
        // τ₁ − τ = rest (1 + τ₁ τ) gives the difference of the tangents without cancellation.
        let rho = (tau / rest) * (end / (1.0 + end * tau)) * (self.d / (self.p * self.sin_half));
        let angle = atan2(rho * self.sin_half, 1.0 + rho * cos(self.half));
        (angle / self.half).clamp(0.0, 1.0)
    }

    /// Inverts `sin²(s/2) = ξ₂ sin²(s₁/2)` on the arc from a to the outer edge.
    fn invert_inner(&self, lambda: f64, kappa: f64) -> f64 {
        let half_sine = |edge: DVec3| {
            let p = self.a + edge;
            let side = Side::new(self.a, p, edge, self.length[0], p.length());
            side.tan_half * (0.5 * side.one_plus).sqrt()
        };
        let (_, edge) = self.on_outer(lambda);
        let end = half_sine(edge);
        let root = half_sine(edge * kappa) / end;
        if end > 0.0 {
            (root * root).min(1.0)
        } else {
            0.0
        }
    }
}

/// Returns `b` in the lanes of `m`, and `a` in the others.
#[inline(always)]
fn either<L: Lanes>(l: L, m: L::M, a: f64, b: f64) -> L::D {
    l.select(m, l.dsplat(a), l.dsplat(b))
}

#[inline(always)]
fn either_vector<L: Lanes>(l: L, m: L::M, a: DVec3, b: DVec3) -> Vector<L> {
    [
        either(l, m, a.x, b.x),
        either(l, m, a.y, b.y),
        either(l, m, a.z, b.z),
    ]
}

#[inline(always)]
fn norm<L: Lanes>(l: L, v: &Vector<L>) -> L::D {
    l.dsqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
}

impl<L: Lanes> Each<L> {
    /// Returns the point (λ on bc, κ from a) for a pair of random numbers in each lane.
    #[inline(always)]
    pub(crate) fn sample(&self, l: L, u: [L::D; 2]) -> (L::D, L::D) {
        let lambda = self.outer(l, u[0]);
        (lambda, self.inner(l, lambda, u[1]))
    }

    /// Returns λ on the edge bc such that (a, b, q) has the fraction ξ of the solid angle.
    #[inline(always)]
    fn outer(&self, l: L, xi: L::D) -> L::D {
        let one = l.dsplat(1.0);
        let ps = self.p * sine(l, xi * self.half);
        let ds = self.rise * sine(l, (one - xi) * self.half);
        // Divide the tangent τ₁ into the parts x and y: τ = τ₁ x, τ₁ − τ = τ₁ y.
        let inverse = one / (ds + ps);
        let (x, y) = (ps * inverse, ds * inverse);
        // The weights of b and c in the direction are sin(θ₁ − θ) : sin θ, divided by the lengths.
        let wb = y * (self.square_end * x + 1.0) * self.length[1];
        let wc = x * self.far;
        ratio(l, wc, wb)
    }

    /// Returns κ on the segment from a to q such that sin²(s/2) has the fraction `v` of its range.
    #[inline(always)]
    fn inner(&self, l: L, lambda: L::D, v: L::D) -> L::D {
        let one = l.dsplat(1.0);
        let q = fan::along::<L>(&self.b, &self.bc, lambda);
        let cross = fan::along::<L>(&self.cross[0], &self.cross[1], lambda);
        let dot = self.dot[0] + self.dot[1] * lambda;
        let (lq, sine) = (norm(l, &q), norm(l, &cross));
        let product = self.length[0] * lq;
        // Compute the sine and the cosine of half the side aq: the larger one from 1 ± cos, which
        // does not cancel, and the other one from the sine of the whole side.
        let half = l.dsplat(0.5) / product;
        let size = l.dmax(dot, dot * -1.0);
        let large = l.dsqrt((product + size) * half);
        let small = sine * half / large;
        let acute = l.dle(l.dsplat(0.0), dot);
        let cos1 = l.select(acute, small, large);
        let sin1 = l.select(acute, large, small);
        let root = l.dsqrt(v);
        let mu = root * sin1; // sin(s/2)
        let nu = l.dsqrt((one - mu) * (one + mu)); // cos(s/2)
        // Half the sine of s₁ − s follows from sin((s₁−s)/2) cos((s₁−s)/2), each without
        // cancellation: sin s₁/2 · (1 − v)/(ν + √v cos s₁/2) · (…). The factor that both weights
        // share is left out.
        let here = root * nu * (nu + root * cos1) * self.length[0];
        let rest = (one - v) * (cos1 * nu + sin1 * mu) * lq;
        ratio(l, here, rest)
    }
}

/// Returns `w/(w + other)`; 0 when both are zero or one is not a number.
#[inline(always)]
fn ratio<L: Lanes>(l: L, w: L::D, other: L::D) -> L::D {
    // The maximum of NaN and zero is zero.
    l.dmax(w / (w + other), l.dsplat(0.0))
}

/// The smallest length for which the squares of products of two lengths do not underflow; shorter
/// triangles are scaled.
const SMALL: f64 = 1e-60;
const LARGE: f64 = 1e60;
