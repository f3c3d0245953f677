//! This module describes a line as the shading point sees it: its part above the horizon, its solid
//! angle, and the map between angles and positions.

use crate::linear::numbers::{Bounds, LEAST, cross, double_angle, on_horizon_by_more_digits};
use linelit_elementary::atan2;
use linelit_geometry::finite::fraction;
use linelit_geometry::{DVec3, predicates};

/// A straight line seen from the origin, clipped or not, with the few numbers from which every
/// technique starts.
///
/// ```text
///      p0 ─────────────q──────── p1     q: the point of the infinite line closest to x, h = |q|
///        ╲             │       ╱        φ: the angle from q, negative towards p0
///       r₀ ╲          h│     ╱ r₁       v = φ − φ₀: the angle from p0
///            ╲         │   ╱            δ = φ₁ − φ₀: the angle of the whole line
///              ╲___δ___x_╱
/// ```
///
/// The line is the arc φ₀ … φ₁ of a great circle; v = φ − φ₀ is in [0, δ]. All differences are
/// formed so that nothing cancels for lines that are short, distant, nearly collinear with the
/// origin or that pass close to it; cross products are accurate in each component.
///
/// Positions λ and random numbers are in [0, 1]. Numbers outside count as the nearer end, and NaN
/// as 0.
///
/// **Domain**: lengths of lines and of vectors to their ends, and products of the length with the
/// distance h, whose squares are normal numbers in `f64`: 1e-145 to 1e154. Outside the domain the
/// constructors return `None`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineView {
    /// The ends of the clipped line.
    ends: [DVec3; 2],
    /// The edge of the whole line, and its length.
    edge: DVec3,
    whole: f64,
    /// The fractions of the whole line at which the clipped line begins and ends.
    range: [f64; 2],
    /// The difference of the fractions in `range`, with a small relative error also where little of
    /// the line is left: positive at the first end and negative at the second, the sign that leads
    /// away from each end.
    kept: [f64; 2],
    /// The length of the clipped line, and the distances of its ends.
    l: f64,
    r: [f64; 2],
    /// The reciprocals of the distances of the clipped ends; the next field holds the cosines h/r
    /// at both ends.
    inverse: [f64; 2],
    cosine: [f64; 2],
    /// p0·p1 and |p0 × p1| for the clipped ends.
    dot: f64,
    cross: f64,
    /// sin δ, its reciprocal, and cos δ.
    sin_delta: f64,
    inverse_sine: f64,
    cos_delta: f64,
    h: f64,
    /// The heights n·p of the clipped ends (0 where clipped); zero without a normal.
    height: [f64; 2],
    /// sin φ at both ends, and 1 − sin φ and 1 + sin φ without cancellation.
    sine: [f64; 2],
    minus: [f64; 2],
    plus: [f64; 2],
    /// The difference sin φ₁ − sin φ₀.
    sine_range: f64,
    /// Whether positions resolve the line better than directions ([`LineView::is_short`]); if not,
    /// the unit tangent of the arc at the first end.
    short: bool,
    tangent: DVec3,
}

/// The part of a line above the horizon: its ends, their fractions of the whole, the fraction that
/// is left, and the heights n·p of the ends.
struct Kept {
    ends: [DVec3; 2],
    range: [f64; 2],
    kept: f64,
    height: [f64; 2],
}

impl LineView {
    /// Makes the view of the whole line between two points relative to the shading point. `None` if
    /// the line has no length, if the shading point is on the infinite line (its solid angle is
    /// then zero or infinite), if a coordinate is not finite, or outside the domain.
    #[must_use]
    pub fn new(p0: DVec3, p1: DVec3) -> Option<Self> {
        Self::build(p0, p1, p1 - p0, cross(p0, p1), None)
    }

    /// Makes the view of the part of the line in the half-space `normal·p ≥ 0`. `None` where
    /// [`LineView::new`] returns it, and if no part is above the horizon.
    ///
    /// The end on the horizon is `(n × (p0 × p1))/(n·e)`, accurate relative to itself. (Peters
    /// 2021, §3.2, clips by interpolation, whose absolute error matters when the crossing is close
    /// to the shading point.)
    #[inline(always)]
    #[must_use]
    pub fn clipped(p0: DVec3, p1: DVec3, normal: DVec3) -> Option<Self> {
        Self::build(p0, p1, p1 - p0, cross(p0, p1), Some(normal))
    }

    /// Makes the view like [`LineView::new`] or [`LineView::clipped`], with the edge p1 − p0 given
    /// by a caller that knows it more accurately, because it was formed before the shading point
    /// was subtracted. `None` also if the edge does not fit these ends at all.
    #[inline(always)]
    #[must_use]
    pub fn with_edge(p0: DVec3, p1: DVec3, edge: DVec3, normal: Option<DVec3>) -> Option<Self> {
        // Use the nearer end, whose rounding rotates the plane of the arc least.
        let first = p0.length_squared() <= p1.length_squared();
        let x = cross(if first { p0 } else { p1 }, edge);
        Self::build(p0, p1, edge, x, normal)
    }

    /// Makes the view from the ends, the edge and the cross product of the ends.
    #[inline(always)]
    fn build(p0: DVec3, p1: DVec3, edge: DVec3, x: DVec3, normal: Option<DVec3>) -> Option<Self> {
        let whole = edge.length();
        let area = x.length();
        if !(whole.has_square() && area.has_square()) {
            return None;
        }
        let kept = match normal {
            Some(n) => clip([p0, p1], edge, (x, area), n)?,
            None => Kept {
                ends: [p0, p1],
                range: [0.0, 1.0],
                kept: 1.0,
                height: [0.0; 2],
            },
        };
        Self::finish(kept, (edge, whole), (x, area))
    }

    /// Computes the numbers that depend on the clipped ends. The edge and the cross product p0 × p1
    /// of the whole line come with their lengths.
    #[inline(always)]
    fn finish(
        Kept {
            ends: [p0, p1],
            range,
            kept,
            height,
        }: Kept,
        (edge, whole): (DVec3, f64),
        (x, area): (DVec3, f64),
    ) -> Option<Self> {
        // Compute the cosines and sines at the ends.
        let (l, cross) = (whole * kept, area * kept);
        let (per_length, per_area) = (1.0 / whole, 1.0 / area);
        let h = area * per_length;
        let r = [p0.length(), p1.length()];
        // Divide once for two quotients.
        let product = r[0] * r[1];
        let per_product = 1.0 / product;
        let inverse = [r[1] * per_product, r[0] * per_product];
        let cosine = [h * inverse[0], h * inverse[1]];
        let sin_delta = cross * per_product;
        let dot01 = p0.dot(p1);
        let sine = [
            p0.dot(edge) * (per_length * inverse[0]),
            p1.dot(edge) * (per_length * inverse[1]),
        ];
        let [(minus0, plus0), (minus1, plus1)] = sides(sine, cosine);
        let sine_range = if dot01 > 0.0 {
            // h² l (r0 + r1)/(r0 r1 (r0 r1 + p0·p1)): nothing cancels.
            cosine[0] * cosine[1] * (l / (product + dot01)) * (r[0] + r[1])
        } else {
            sine[1] - sine[0]
        };
        // Refuse views outside the domain.
        let inverse_sine = product * per_area / kept;
        let held = are_numbers(r, inverse, inverse_sine);
        let sines = sine[0].abs() <= 2.0 && sine[1].abs() <= 2.0;
        // The edge fits these ends, up to a factor.
        let fits = l <= 2.0 * (r[0] + r[1]);
        if !(sine_range.is_usable() && held && sines && fits && h.has_square()) {
            return None;
        }
        // Prepare directions on a long line that passes close by.
        let foot_inside = sine[0] < 0.0 && sine[1] > 0.0;
        let short = !foot_inside || l < h;
        let tangent = if short {
            DVec3::ZERO
        } else {
            (x * per_area).cross(p0) * inverse[0]
        };
        Some(Self {
            ends: [p0, p1],
            edge,
            whole,
            range,
            kept: [kept, -kept],
            l,
            r,
            inverse,
            cosine,
            dot: dot01,
            cross,
            sin_delta,
            inverse_sine,
            cos_delta: dot01 * per_product,
            h,
            height,
            sine,
            minus: [minus0, minus1],
            plus: [plus0, plus1],
            sine_range,
            short,
            tangent,
        })
    }

    /// Returns the ends, clipped if the view is.
    #[must_use]
    pub fn ends(&self) -> (DVec3, DVec3) {
        (self.ends[0], self.ends[1])
    }

    /// Returns the fractions of the whole line at which the clipped line begins and ends.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the distance h of the infinite line from the shading point.
    #[must_use]
    pub fn line_distance(&self) -> f64 {
        self.h
    }

    /// Returns the length of the line, clipped if the view is.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.l
    }

    /// Returns the angle δ in radians, in (0, π), that the line subtends.
    #[inline(always)]
    #[must_use]
    pub fn angle(&self) -> f64 {
        let product = self.r[0] * self.r[1];
        // Compute tan δ/2 by the form that does not cancel.
        if self.dot > 0.0 {
            double_angle(self.cross, product + self.dot).v
        } else {
            double_angle(product - self.dot, self.cross).v
        }
    }

    /// Returns sin δ and cos δ.
    pub(crate) fn angle_sin_cos(&self) -> (f64, f64) {
        (self.sin_delta, self.cos_delta)
    }

    /// Returns 1/sin δ.
    pub(crate) fn inverse_sine(&self) -> f64 {
        self.inverse_sine
    }

    /// Returns the cosine and the sine of the angle from the foot of the line to an end; the sine
    /// is positive if the line runs away from the foot there: h/r₀ and s₀/r₀, or h/r₁ and −s₁/r₁.
    pub(crate) fn foot_angle(&self, second: bool) -> (f64, f64) {
        if second {
            (self.cosine[1], -self.sine[1])
        } else {
            (self.cosine[0], self.sine[0])
        }
    }

    /// Returns n·ω at both clipped ends.
    pub(crate) fn end_cosines(&self) -> [f64; 2] {
        [
            self.height[0] * self.inverse[0],
            self.height[1] * self.inverse[1],
        ]
    }

    /// Returns the solid angle per radius in sr/m: `dΩ/dR = (2/h)(sin φ₁ − sin φ₀)` (Peters 2021,
    /// eq. 1 and its limit).
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        (self.sine_range + self.sine_range) / self.h
    }

    /// Returns the distance from the shading point to the position `lambda` in [0, 1] on the line.
    #[must_use]
    pub fn distance(&self, lambda: f64) -> f64 {
        self.at(lambda).length()
    }

    /// Returns the point at the position `lambda` in [0, 1] on the line, relative to the shading
    /// point; it is computed from the nearer end.
    #[must_use]
    pub fn at(&self, lambda: f64) -> DVec3 {
        let lambda = fraction(lambda);
        let rest = 1.0 - lambda;
        let nearest = usize::from(rest < lambda);
        let way = self.kept[nearest] * lambda.at_most(rest);
        self.ends[nearest] + self.edge * way
    }

    /// Returns the fraction of the whole line at the position `lambda` of the clipped line.
    #[must_use]
    pub fn whole_fraction(&self, lambda: f64) -> f64 {
        self.whole_fraction_of(fraction(lambda))
    }

    /// Computes [`LineView::whole_fraction`] of a position that is known to be in [0, 1].
    #[inline(always)]
    pub(crate) fn whole_fraction_of(&self, lambda: f64) -> f64 {
        self.range[0] * (1.0 - lambda) + self.range[1] * lambda
    }

    /// Returns the position on the clipped line of a fraction of the whole line; `None` where it is
    /// clipped away.
    #[must_use]
    pub fn clipped_fraction(&self, t: f64) -> Option<f64> {
        let [a, b] = self.range;
        (t >= a && t <= b && b > a).then(|| ((t - a) / (b - a)).at_most(1.0))
    }

    /// Returns the sample that is uniform in solid angle (Peters 2021, §3.1): sin φ is linear in ξ.
    /// No trigonometric function is needed.
    #[must_use]
    pub fn sample_solid_angle(&self, xi: f64) -> ArcPoint {
        let (second, s, c) = self.solid_angle_arc(xi);
        self.arc_point(second, s, c)
    }

    /// Returns the end from which the sample is measured, and the sine and cosine of its angle from
    /// there.
    #[inline(always)]
    pub(crate) fn solid_angle_arc(&self, xi: f64) -> (bool, f64, f64) {
        let (second, xi) = nearer(xi);
        let (a, b) = self
            .solid_angle_end(second)
            .half_tangent([xi, 1.0 - xi, 1.0]);
        let t = a / b;
        let q = 1.0 / (1.0 + t * t);
        (second, (t + t) * q, (1.0 - t * t) * q)
    }

    /// Returns the constants of a solid-angle sample that is measured from one end.
    #[inline(always)]
    pub(crate) fn solid_angle_end(&self, second: bool) -> SolidAngleEnd {
        let (here, there) = (usize::from(second), usize::from(!second));
        SolidAngleEnd {
            cosine: self.cosine[here],
            minus: [self.minus[here], self.minus[there]],
            plus: [self.plus[here], self.plus[there]],
            range: self.sine_range,
        }
    }

    /// Returns the fraction of the solid angle below the position `lambda`: the inverse of
    /// [`LineView::sample_solid_angle`].
    #[must_use]
    pub fn invert_solid_angle(&self, lambda: f64) -> f64 {
        let lambda = fraction(lambda);
        let (below, above) = (self.sine_step(0, lambda), self.sine_step(1, 1.0 - lambda));
        let sum = below + above;
        if sum > 0.0 { below / sum } else { 0.0 }
    }

    /// Returns |sin φ − sin φ_end| at the distance `lambda` (a fraction of the clipped length) from
    /// an end.
    fn sine_step(&self, end: usize, lambda: f64) -> f64 {
        let towards = if end == 0 { lambda } else { 1.0 - lambda };
        let p = self.at(towards);
        let (r0, r) = (self.r[end], p.length());
        let (d, l) = (self.ends[end].dot(p), self.l * lambda);
        if d > 0.0 {
            (self.h / r0) * (self.h / r) * (l / (r0 * r + d)) * (r0 + r)
        } else {
            (p.dot(self.edge) / (self.whole * r) - self.sine[end]).abs()
        }
    }

    /// Returns the angle v of the position `lambda`.
    pub(crate) fn angle_of(&self, lambda: f64) -> f64 {
        let lambda = fraction(lambda);
        let p = self.at(lambda);
        atan2(self.cross * lambda, self.ends[0].dot(p))
    }

    /// Returns the angle δ − v of the position at the fraction `rest` from the second end.
    pub(crate) fn angle_from_end(&self, rest: f64) -> f64 {
        let p = self.ends[1] + self.edge * (self.kept[1] * rest);
        atan2(self.cross * rest, self.ends[1].dot(p))
    }

    /// Returns n·p at the position `lambda`, linear between the clipped ends.
    pub(crate) fn height(&self, lambda: f64) -> f64 {
        let lambda = fraction(lambda);
        self.height[0] * (1.0 - lambda) + self.height[1] * lambda
    }

    /// Returns the cosine n·ω at the position `lambda` of a line that was clipped by n; zero for a
    /// line that was not clipped.
    #[must_use]
    pub fn cosine(&self, lambda: f64) -> f64 {
        self.height(lambda) / self.distance(lambda)
    }

    /// Whether a position on the line is resolved better by its fraction from the nearer end than
    /// by its direction.
    ///
    /// A relative error ε of the distance s from that end rotates the direction by ε s h/r². This
    /// is at most ε where the line runs away from its foot, however small the angle that it
    /// subtends. It is ε l/h where the foot is inside, so that the line then must be shorter than
    /// h.
    #[must_use]
    pub fn is_short(&self) -> bool {
        self.short
    }

    /// Returns sin(δ − v) for the angle v from an end. It is accurate relative to itself unless v
    /// is close to δ. Callers measure v from the end that has at most half of the sample space
    /// before the sample, and the density on an arc, a product of two sinusoids, is nowhere many
    /// times its mean.
    #[inline(always)]
    pub(crate) fn sine_of_rest(&self, s: f64, c: f64) -> f64 {
        (self.sin_delta * c - self.cos_delta * s).at_least(0.0)
    }

    /// Returns the position and the direction from the sine and the cosine of the angle v from the
    /// first or the second end.
    ///
    /// 1/r interpolates like a direction, `1/r = (sin(δ−v)/r₀ + sin v/r₁)/sin δ`: all terms are
    /// positive. The ends are looked up by index, because a branch on the nearer end would be
    /// mispredicted.
    #[inline(always)]
    pub(crate) fn arc_point(&self, second: bool, s: f64, c: f64) -> ArcPoint {
        let (here, there) = (usize::from(second), usize::from(!second));
        let far = self.sine_of_rest(s, c);
        let (w0, w1) = (far * self.inverse[here], s * self.inverse[there]);
        let sum = w0 + w1;
        if !sum.is_usable() {
            return ArcPoint::default();
        }
        let inverse = 1.0 / sum;
        // Compute the fractions of the line from this end and from the other one.
        let fractions = [w1 * inverse, w0 * inverse];
        let (lambda, rest) = (fractions[here], fractions[there]);
        // On a short line, interpolate the position, and derive the direction.
        if self.short {
            let nearest = here ^ usize::from(fractions[1] < fractions[0]);
            let way = self.kept[nearest] * fractions[0].at_most(fractions[1]);
            let point = self.ends[nearest] + self.edge * way;
            let direction = point * (sum * self.inverse_sine);
            return ArcPoint {
                lambda,
                rest,
                direction,
                point,
            };
        }
        // On a long line compute the direction, from (sin v, cos v) at the first end, and derive
        // the position.
        let other = (far, self.cos_delta * c + self.sin_delta * s);
        let (sine, cosine) = [(s, c), other][here];
        let along = self.tangent * sine;
        let direction = self.ends[0] * (cosine * self.inverse[0]) + along;
        let point = direction * (self.sin_delta * inverse);
        ArcPoint {
            lambda,
            rest,
            direction,
            point,
        }
    }

    /// Computes [`LineView::arc_point`] without a branch, for a line that [is
    /// short](LineView::is_short) or is not.
    #[inline(always)]
    pub(crate) fn place<const SHORT: bool>(&self, second: bool, s: f64, c: f64) -> ArcPoint {
        let far = self.sine_of_rest(s, c);
        let (first, last) = if second { (s, far) } else { (far, s) };
        let (w0, w1) = (first * self.inverse[0], last * self.inverse[1]);
        let sum = w0 + w1;
        let inverse = 1.0 / sum;
        let (lambda, rest) = (w1 * inverse, w0 * inverse);
        if SHORT {
            // Interpolate the position from the nearer end, and derive the direction.
            let kept = if lambda > rest {
                self.kept[1]
            } else {
                self.kept[0]
            };
            let way = kept * lambda.at_most(rest);
            let point = DVec3::from([0, 1, 2].map(|k| {
                let (a, b) = (self.ends[0][k], self.ends[1][k]);
                (if lambda > rest { b } else { a }) + self.edge[k] * way
            }));
            let direction = point * (sum * self.inverse_sine);
            return ArcPoint {
                lambda,
                rest,
                direction,
                point,
            };
        }
        // Compute the direction from the first end, and derive the position.
        let other = self.cos_delta * c + self.sin_delta * s;
        let cosine = if second { other } else { c } * self.inverse[0];
        let direction = self.ends[0] * cosine + self.tangent * last;
        ArcPoint {
            lambda,
            rest,
            direction,
            point: direction * (self.sin_delta * inverse),
        }
    }
}

/// Whether both distances, sin δ and the smallest sum of [`LineView::arc_point`], sin δ/r, have all
/// digits. It tests their reciprocals by a comparison that is false for NaN.
#[inline(always)]
fn are_numbers(r: [f64; 2], inverse: [f64; 2], inverse_sine: f64) -> bool {
    let least_sum = inverse_sine * r[0].at_least(r[1]);
    let smallest = LEAST
        * inverse[0]
            .at_least(inverse[1])
            .at_least(inverse_sine)
            .at_least(least_sum);
    smallest < 1.0
}

/// Returns 1 − sin φ and 1 + sin φ at both ends, each accurate relative to itself.
#[inline(always)]
fn sides(sine: [f64; 2], cosine: [f64; 2]) -> [(f64, f64); 2] {
    let large = sine.map(|s| 1.0 + s.abs());
    let both = 1.0 / (large[0] * large[1]);
    let side = |k: usize| {
        let small = cosine[k] * cosine[k] * (large[1 - k] * both);
        let up = sine[k] > 0.0;
        (
            if up { small } else { large[k] },
            if up { large[k] } else { small },
        )
    };
    [side(0), side(1)]
}

/// The constants of a solid-angle sample: cos φ at the end from which it is measured, and 1 − sin φ
/// and 1 + sin φ there and at the other end (exchanged for the second end).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolidAngleEnd {
    pub cosine: f64,
    pub minus: [f64; 2],
    pub plus: [f64; 2],
    /// The difference sin φ₁ − sin φ₀.
    pub range: f64,
}

impl SolidAngleEnd {
    /// Returns one of the two ends by selecting numbers.
    #[inline(always)]
    pub(crate) fn select(second: bool, [a, b]: &[Self; 2]) -> Self {
        let one = |a: f64, b: f64| if second { b } else { a };
        let two = |a: [f64; 2], b: [f64; 2]| [one(a[0], b[0]), one(a[1], b[1])];
        Self {
            cosine: one(a.cosine, b.cosine),
            minus: two(a.minus, b.minus),
            plus: two(a.plus, b.plus),
            range: a.range,
        }
    }

    /// Returns tan(v/2) of the solid-angle sample that divides `whole` into `below` and `above`, as
    /// a quotient of two numbers ≥ 0, where v is the angle from this end. The formula is `tan(v/2)
    /// = ξ Δ sin/(cos φ₀ + cos φ)` with cos φ = √((1 − sin φ)(1 + sin φ)), whose factors are both
    /// linear in ξ = below/whole.
    #[inline(always)]
    pub(crate) fn half_tangent(&self, [below, above, whole]: [f64; 3]) -> (f64, f64) {
        let lerp = |a: [f64; 2]| a[0] * above + a[1] * below;
        let cos_phi = (lerp(self.minus) * lerp(self.plus)).sqrt();
        (below * self.range, self.cosine * whole + cos_phi)
    }
}

/// Returns the end from which a sample is measured, and its random number from there. It is the end
/// that has at most half of the sample space before the sample, so that samples close to either end
/// keep their digits. A number outside [0, 1] belongs to the end, and NaN becomes 0.
#[inline(always)]
pub(crate) fn nearer(xi: f64) -> (bool, f64) {
    let rest = 1.0 - xi;
    (rest < xi, rest.at_most(xi).at_least(0.0))
}

/// Returns the part of a line above the horizon of n; `None` if there is none.
#[inline(always)]
fn clip(ends: [DVec3; 2], edge: DVec3, x: (DVec3, f64), n: DVec3) -> Option<Kept> {
    let (c0, c1) = (height(n, ends[0]), height(n, ends[1]));
    if c0 <= 0.0 && c1 <= 0.0 {
        return None;
    }
    let mut out = Kept {
        ends,
        range: [0.0, 1.0],
        kept: 1.0,
        height: [c0.at_least(0.0), c1.at_least(0.0)],
    };
    if c0 >= 0.0 && c1 >= 0.0 {
        return Some(out);
    }
    // The signs of the heights differ, so that nothing cancels in their difference.
    let span = c1 - c0;
    let (before, after) = (c0 / -span, c1 / span);
    let end = on_horizon(ends, edge, x, (n, span, [before, after]));
    let kept = if c0 < 0.0 {
        out.ends[0] = end;
        out.range[0] = before;
        after
    } else {
        out.ends[1] = end;
        out.range[1] = before;
        before
    };
    out.kept = kept.at_most(1.0);
    Some(out)
}

/// Returns the point on the horizon, by the more accurate of two formulas.
///
/// The first is (n × x)/(n·e), whose error is the error of x = p0 × p1, ε |x|/|n·e|: it is good
/// where the line passes close to the shading point. The second goes along the edge from the nearer
/// end, with an error of ε times the distance of this end and of the point from it: it is good
/// where the line nearly lies in the horizon. If both lose more than six bits, because the line
/// passes close by *and* nearly lies in the horizon, the point is computed with more digits.
#[inline(always)]
fn on_horizon(
    ends: [DVec3; 2],
    edge: DVec3,
    (x, area): (DVec3, f64),
    (n, span, [before, after]): (DVec3, f64, [f64; 2]),
) -> DVec3 {
    let (end, way) = if before <= after {
        (ends[0], edge * before)
    } else {
        (ends[1], edge * -after)
    };
    let reach2 = end.length_squared() + way.length_squared();
    let (area2, span2) = (area * area, span * span);
    let (point, error2) = if area2 <= span2 * reach2 {
        (cross(n, x) * (1.0 / span), area2 / span2)
    } else {
        (end + way, reach2)
    };
    if error2 > 4096.0 * point.length_squared() {
        return on_horizon_by_more_digits(ends, n);
    }
    point
}

/// Returns n·p, in twice the precision where the plain sum has lost more than a few digits.
#[inline(always)]
fn height(n: DVec3, p: DVec3) -> f64 {
    let plain = n.dot(p);
    let magnitude = n.abs().dot(p.abs());
    if plain.abs() > 1.0 / 64.0 * magnitude {
        plain
    } else {
        accurate_dot(n, p)
    }
}

#[inline(never)]
fn accurate_dot(n: DVec3, p: DVec3) -> f64 {
    predicates::dot(n, p)
}

/// A position on a line, given as a point and as a direction. A unit direction resolves a distant
/// line only to ε/δ of its length, and a fraction of a long line that passes close by resolves its
/// near part only to ε l/h.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArcPoint {
    /// The fraction of the clipped line, in [0, 1].
    pub lambda: f64,
    /// 1 − λ, accurate relative to itself.
    pub rest: f64,
    /// The unit direction from the shading point.
    pub direction: DVec3,
    /// The point relative to the shading point, computed from whichever of the two resolves it.
    pub point: DVec3,
}
