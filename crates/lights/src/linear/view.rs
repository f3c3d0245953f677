//! A line as the shading point sees it: clipping, solid angle, and the map between angles and
//! places.

use crate::linear::precision::{Real, V3, add, cross, dot, length, plain_cross, scale, sub};
use crate::linear::trig::double_angle;

/// A straight line seen from the origin, clipped or not, with the few numbers that every technique
/// starts from.
///
/// With q the point of the infinite line closest to the origin, h = |q| and φ the angle from q, the
/// line is the arc φ₀ … φ₁ of a great circle; v = φ − φ₀ runs over [0, δ]. All differences are
/// formed so that nothing cancels for lines that are short, far, nearly collinear with the origin
/// or passing close to it; cross products are accurate by component. Generic over `f32` and `f64`.
///
/// Places λ and random numbers are of [0, 1]; what is not counts as the nearer end, NaN as 0.
///
/// **Domain**: lengths of lines and of vectors to their ends, and products of the length with the
/// distance h, whose squares `f64` holds with its digits: 1e-145 to 1e154; in `f32` that hold
/// themselves as `f32`: 1e-37 to 1e38, so that lines as far as they are long may have sizes from
/// 1e-18 to 1e18. Beyond, `None`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineView<T> {
    /// The clipped ends.
    ends: [V3<T>; 2],
    /// Edge, not clipped, and its length.
    edge: V3<T>,
    whole: T,
    /// Fractions of the whole line at which the clipped line begins and ends.
    range: [T; 2],
    /// Their difference, relatively accurate also where little is left, and with the sign that
    /// leads away from each end.
    kept: [T; 2],
    /// Clipped length.
    l: T,
    r: [T; 2],
    /// Reciprocals of r, and cosines h/r at both ends.
    inverse: [T; 2],
    cosine: [T; 2],
    /// p0·p1 and |p0 × p1| of the clipped ends.
    dot: T,
    cross: T,
    /// sin δ, its reciprocal, and cos δ.
    sin_delta: T,
    inverse_sine: T,
    cos_delta: T,
    h: T,
    /// Cosines n·p of the clipped ends (0 where clipped); zero without a normal.
    height: [T; 2],
    /// sin φ at both ends, 1 − sin φ and 1 + sin φ from their small sides.
    sine: [T; 2],
    minus: [T; 2],
    plus: [T; 2],
    /// sin φ₁ − sin φ₀.
    sine_range: T,
    /// Whether places resolve it better than directions ([`LineView::is_short`]); unit tangent t of
    /// the fan at the first end where not.
    short: bool,
    tangent: V3<T>,
}

/// What is left of a line above the horizon: ends, their fractions of the whole, the fraction that
/// is left, and the heights n·p of the ends.
struct Kept<T> {
    ends: [V3<T>; 2],
    range: [T; 2],
    kept: T,
    height: [T; 2],
}

impl<T: Real> LineView<T> {
    /// The whole line between two points relative to the shading point. `None` if it has no length,
    /// if the shading point is on the infinite line (its solid angle is zero or infinite), if a
    /// coordinate is not finite, or beyond the domain.
    #[must_use]
    pub fn new(p0: [T; 3], p1: [T; 3]) -> Option<Self> {
        Self::build(p0, p1, sub(p1, p0), cross(p0, p1), None)
    }

    /// The part of the line in the half-space `normal·p ≥ 0`. `None` as for [`LineView::new`], or
    /// if nothing is above the horizon.
    ///
    /// The end on the horizon is `(n × (p0 × p1))/(n·e)`, accurate relative to itself (Peters 2021,
    /// §3.2 clips too, by interpolation, whose absolute error matters when the crossing is close to
    /// the shading point).
    #[inline(always)]
    #[must_use]
    pub fn clipped(p0: [T; 3], p1: [T; 3], normal: [T; 3]) -> Option<Self> {
        Self::build(p0, p1, sub(p1, p0), cross(p0, p1), Some(normal))
    }

    /// As [`LineView::new`] or [`LineView::clipped`] with the edge p1 − p0 given by a caller that
    /// knows it more accurately, because it formed it before the shading point was subtracted.
    /// `None`, too, for what is no edge between these ends by far.
    #[inline(always)]
    #[must_use]
    pub fn with_edge(p0: [T; 3], p1: [T; 3], edge: [T; 3], normal: Option<[T; 3]>) -> Option<Self> {
        // From the nearer end, whose rounding turns the plane of the fan least.
        let first = dot(p0, p0) <= dot(p1, p1);
        let x = cross(if first { p0 } else { p1 }, edge);
        Self::build(p0, p1, edge, x, normal)
    }

    #[inline(always)]
    fn build(p0: V3<T>, p1: V3<T>, edge: V3<T>, x: V3<T>, normal: Option<V3<T>>) -> Option<Self> {
        let whole = length(edge);
        let area = length(x);
        if !(whole.has_square() && area.has_square()) {
            return None;
        }
        let kept = match normal {
            Some(n) => clip([p0, p1], edge, (x, area), n)?,
            None => Kept {
                ends: [p0, p1],
                range: [T::ZERO, T::ONE],
                kept: T::ONE,
                height: [T::ZERO; 2],
            },
        };
        Self::finish(kept, (edge, whole), (x, area))
    }

    /// What depends on the clipped ends. The edge and the cross product p0 × p1 of the whole line
    /// come with their lengths.
    #[inline(always)]
    fn finish(
        Kept {
            ends: [p0, p1],
            range,
            kept,
            height,
        }: Kept<T>,
        (edge, whole): (V3<T>, T),
        (x, area): (V3<T>, T),
    ) -> Option<Self> {
        let (l, cross) = (whole * kept, area * kept);
        let (per_length, per_area) = (T::ONE / whole, T::ONE / area);
        let h = area * per_length;
        let r = [length(p0), length(p1)];
        // Quotients cost more than products: one for two of them.
        let product = r[0] * r[1];
        let per_product = T::ONE / product;
        let inverse = [r[1] * per_product, r[0] * per_product];
        let cosine = [h * inverse[0], h * inverse[1]];
        let sin_delta = cross * per_product;
        let dot01 = dot(p0, p1);
        let sine = [
            dot(p0, edge) * (per_length * inverse[0]),
            dot(p1, edge) * (per_length * inverse[1]),
        ];
        let [(minus0, plus0), (minus1, plus1)] = sides(sine, cosine);
        let sine_range = if dot01 > T::ZERO {
            // h² l (r0 + r1)/(r0 r1 (r0 r1 + p0·p1)): nothing cancels.
            cosine[0] * cosine[1] * (l / (product + dot01)) * (r[0] + r[1])
        } else {
            sine[1] - sine[0]
        };
        let inverse_sine = product * per_area / kept;
        let held = are_numbers(r, inverse, inverse_sine);
        let sines = sine[0].abs() <= T::from_f64(2.0) && sine[1].abs() <= T::from_f64(2.0);
        // An edge between these ends, to a factor.
        let fits = l <= T::from_f64(2.0) * (r[0] + r[1]);
        if !(sine_range.is_usable() && held && sines && fits && h.has_square()) {
            return None;
        }
        let foot_inside = sine[0] < T::ZERO && sine[1] > T::ZERO;
        let short = !foot_inside || l < h;
        let tangent = if short {
            [T::ZERO; 3]
        } else {
            scale(plain_cross(scale(x, per_area), p0), inverse[0])
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

    /// The (clipped) ends.
    #[must_use]
    pub fn ends(&self) -> ([T; 3], [T; 3]) {
        (self.ends[0], self.ends[1])
    }

    /// The fractions of the whole line at which the clipped one begins and ends.
    #[must_use]
    pub fn range(&self) -> [T; 2] {
        self.range
    }

    /// Distance h of the infinite line from the shading point.
    #[must_use]
    pub fn line_distance(&self) -> T {
        self.h
    }

    /// Length of the (clipped) line.
    #[must_use]
    pub fn length(&self) -> T {
        self.l
    }

    /// The angle δ in (0, π) that the line subtends.
    #[inline(always)]
    #[must_use]
    pub fn angle(&self) -> T {
        let product = self.r[0] * self.r[1];
        // tan δ/2 from whichever side does not cancel.
        if self.dot > T::ZERO {
            double_angle(self.cross, product + self.dot).v
        } else {
            double_angle(product - self.dot, self.cross).v
        }
    }

    /// sin δ and cos δ.
    pub(crate) fn angle_sin_cos(&self) -> (T, T) {
        (self.sin_delta, self.cos_delta)
    }

    /// 1/sin δ.
    pub(crate) fn inverse_sine(&self) -> T {
        self.inverse_sine
    }

    /// Cosine and sine of the angle from the foot of the line to an end, the sine positive if the
    /// line runs away from the foot there: h/r₀ and s₀/r₀, or h/r₁ and −s₁/r₁.
    pub(crate) fn foot_angle(&self, second: bool) -> (T, T) {
        if second {
            (self.cosine[1], -self.sine[1])
        } else {
            (self.cosine[0], self.sine[0])
        }
    }

    /// n·ω at both clipped ends.
    pub(crate) fn end_cosines(&self) -> [T; 2] {
        [
            self.height[0] * self.inverse[0],
            self.height[1] * self.inverse[1],
        ]
    }

    /// Solid angle per radius in sr/m: `dΩ/dR = (2/h)(sin φ₁ − sin φ₀)` (Peters 2021, eq. 1 and its
    /// limit).
    #[must_use]
    pub fn solid_angle(&self) -> T {
        (self.sine_range + self.sine_range) / self.h
    }

    /// Distance from the shading point of the place `lambda` in [0, 1] on the (clipped) line.
    #[must_use]
    pub fn distance(&self, lambda: T) -> T {
        length(self.at(lambda))
    }

    /// The place `lambda` in [0, 1] on the (clipped) line, relative to the shading point, from the
    /// nearer end.
    #[must_use]
    pub fn at(&self, lambda: T) -> [T; 3] {
        let lambda = lambda.unit();
        let rest = T::ONE - lambda;
        let nearest = usize::from(rest < lambda);
        let way = self.kept[nearest] * lambda.at_most(rest);
        add(self.ends[nearest], scale(self.edge, way))
    }

    /// The fraction of the whole line at the place `lambda` of the clipped one.
    #[must_use]
    pub fn whole_fraction(&self, lambda: T) -> T {
        self.whole_fraction_of(lambda.unit())
    }

    /// [`LineView::whole_fraction`] of a place that is known to be in [0, 1].
    #[inline(always)]
    pub(crate) fn whole_fraction_of(&self, lambda: T) -> T {
        self.range[0] * (T::ONE - lambda) + self.range[1] * lambda
    }

    /// The place on the clipped line of a fraction of the whole; `None` where it is clipped away.
    #[must_use]
    pub fn clipped_fraction(&self, t: T) -> Option<T> {
        let [a, b] = self.range;
        (t >= a && t <= b && b > a).then(|| ((t - a) / (b - a)).at_most(T::ONE))
    }

    /// The sample that is uniform in solid angle (Peters 2021, §3.1): sin φ runs linearly in ξ. No
    /// trigonometry.
    #[must_use]
    pub fn sample_solid_angle(&self, xi: T) -> ArcPoint<T> {
        let (second, s, c) = self.solid_angle_arc(xi);
        self.arc_point(second, s, c)
    }

    /// The end that the sample is measured from, sine and cosine of its angle from there.
    #[inline(always)]
    pub(crate) fn solid_angle_arc(&self, xi: T) -> (bool, T, T) {
        let (second, xi) = nearer(xi);
        let (a, b) = self
            .solid_angle_end(second)
            .half_tangent([xi, T::ONE - xi, T::ONE]);
        let t = a / b;
        let q = T::ONE / (T::ONE + t * t);
        (second, (t + t) * q, (T::ONE - t * t) * q)
    }

    /// What a solid-angle sample starts from at an end.
    #[inline(always)]
    pub(crate) fn solid_angle_end(&self, second: bool) -> SolidAngleEnd<T> {
        let (here, there) = (usize::from(second), usize::from(!second));
        SolidAngleEnd {
            cosine: self.cosine[here],
            minus: [self.minus[here], self.minus[there]],
            plus: [self.plus[here], self.plus[there]],
            range: self.sine_range,
        }
    }

    /// The fraction of the solid angle below the place `lambda`: the inverse of
    /// [`LineView::sample_solid_angle`].
    #[must_use]
    pub fn invert_solid_angle(&self, lambda: T) -> T {
        let lambda = lambda.unit();
        let (below, above) = (
            self.sine_step(0, lambda),
            self.sine_step(1, T::ONE - lambda),
        );
        let sum = below + above;
        if sum > T::ZERO { below / sum } else { T::ZERO }
    }

    /// |sin φ − sin φ_end| at the distance `lambda` (fraction of the clipped length) from an end.
    fn sine_step(&self, end: usize, lambda: T) -> T {
        let towards = if end == 0 { lambda } else { T::ONE - lambda };
        let p = self.at(towards);
        let (r0, r) = (self.r[end], length(p));
        let (d, l) = (dot(self.ends[end], p), self.l * lambda);
        if d > T::ZERO {
            (self.h / r0) * (self.h / r) * (l / (r0 * r + d)) * (r0 + r)
        } else {
            (dot(p, self.edge) / (self.whole * r) - self.sine[end]).abs()
        }
    }

    /// The angle v of the place `lambda`.
    pub(crate) fn angle_of(&self, lambda: T) -> T {
        let lambda = lambda.unit();
        let p = self.at(lambda);
        (self.cross * lambda).atan2(dot(self.ends[0], p))
    }

    /// The angle δ − v of the place at the fraction `rest` from the second end.
    pub(crate) fn angle_from_end(&self, rest: T) -> T {
        let p = add(self.ends[1], scale(self.edge, self.kept[1] * rest));
        (self.cross * rest).atan2(dot(self.ends[1], p))
    }

    /// n·p at the place `lambda`, linear between the clipped ends.
    pub(crate) fn height(&self, lambda: T) -> T {
        let lambda = lambda.unit();
        self.height[0] * (T::ONE - lambda) + self.height[1] * lambda
    }

    /// The cosine n·ω at the place `lambda` of a line that was clipped by n; zero of one that was
    /// not.
    #[must_use]
    pub fn cosine(&self, lambda: T) -> T {
        self.height(lambda) / self.distance(lambda)
    }

    /// Whether a place on the line is better resolved by its fraction from the nearer end than by
    /// its direction. A relative error ε of the distance s from that end turns the direction by ε s
    /// h/r²: by at most ε where the line runs away from its foot, however small the angle that it
    /// subtends; by ε l/h where the foot is inside, so that the line then must be shorter than h.
    #[must_use]
    pub fn is_short(&self) -> bool {
        self.short
    }

    /// sin(δ − v) for the angle v from an end. It is accurate relative to itself unless v is close
    /// to δ: callers measure v from the end that has at most half of the sample space behind it,
    /// and the density on an arc, a product of two sinusoids, is nowhere many times its mean.
    #[inline(always)]
    pub(crate) fn sine_of_rest(&self, s: T, c: T) -> T {
        (self.sin_delta * c - self.cos_delta * s).at_least(T::ZERO)
    }

    /// The place and direction from sine and cosine of the angle v from the first or second end.
    ///
    /// 1/r interpolates like a direction, `1/r = (sin(δ−v)/r₀ + sin v/r₁)/sin δ`: all terms are
    /// positive. The ends are looked up by index: which of them is nearer is anybody's guess, and a
    /// branch on it would be mispredicted.
    #[inline(always)]
    pub(crate) fn arc_point(&self, second: bool, s: T, c: T) -> ArcPoint<T> {
        let (here, there) = (usize::from(second), usize::from(!second));
        let far = self.sine_of_rest(s, c);
        let (w0, w1) = (far * self.inverse[here], s * self.inverse[there]);
        let sum = w0 + w1;
        if !sum.is_usable() {
            return ArcPoint::default();
        }
        let inverse = T::ONE / sum;
        // Fractions of the line from this end and from the other one.
        let fractions = [w1 * inverse, w0 * inverse];
        let (lambda, rest) = (fractions[here], fractions[there]);
        if self.short {
            let nearest = here ^ usize::from(fractions[1] < fractions[0]);
            let way = self.kept[nearest] * fractions[0].at_most(fractions[1]);
            let point = add(self.ends[nearest], scale(self.edge, way));
            let direction = scale(point, sum * self.inverse_sine);
            return ArcPoint {
                lambda,
                rest,
                direction,
                point,
            };
        }
        // (sin v, cos v) from the first end.
        let other = (far, self.cos_delta * c + self.sin_delta * s);
        let (sine, cosine) = [(s, c), other][here];
        let along = scale(self.tangent, sine);
        let direction = add(scale(self.ends[0], cosine * self.inverse[0]), along);
        let point = scale(direction, self.sin_delta * inverse);
        ArcPoint {
            lambda,
            rest,
            direction,
            point,
        }
    }

    /// [`LineView::arc_point`] without a branch, on a line that [is short](LineView::is_short) or
    /// not.
    #[inline(always)]
    pub(crate) fn place<const SHORT: bool>(&self, second: bool, s: T, c: T) -> ArcPoint<T> {
        let far = self.sine_of_rest(s, c);
        let (first, last) = if second { (s, far) } else { (far, s) };
        let (w0, w1) = (first * self.inverse[0], last * self.inverse[1]);
        let sum = w0 + w1;
        let inverse = T::ONE / sum;
        let (lambda, rest) = (w1 * inverse, w0 * inverse);
        if SHORT {
            let kept = if lambda > rest {
                self.kept[1]
            } else {
                self.kept[0]
            };
            let way = kept * lambda.at_most(rest);
            let point = [0, 1, 2].map(|k| {
                let (a, b) = (self.ends[0][k], self.ends[1][k]);
                (if lambda > rest { b } else { a }) + self.edge[k] * way
            });
            let direction = scale(point, sum * self.inverse_sine);
            return ArcPoint {
                lambda,
                rest,
                direction,
                point,
            };
        }
        let other = self.cos_delta * c + self.sin_delta * s;
        let cosine = if second { other } else { c } * self.inverse[0];
        let direction = [0, 1, 2].map(|k| self.ends[0][k] * cosine + self.tangent[k] * last);
        ArcPoint {
            lambda,
            rest,
            direction,
            point: scale(direction, self.sin_delta * inverse),
        }
    }
}

/// Whether both distances, sin δ and the least sum of [`LineView::arc_point`], sin δ/r, are numbers
/// of full digits: by their reciprocals, a comparison that NaN fails.
#[inline(always)]
fn are_numbers<T: Real>(r: [T; 2], inverse: [T; 2], inverse_sine: T) -> bool {
    let least_sum = inverse_sine * r[0].at_least(r[1]);
    let smallest = T::LEAST
        * inverse[0]
            .at_least(inverse[1])
            .at_least(inverse_sine)
            .at_least(least_sum);
    smallest < T::ONE
}

/// 1 − sin φ and 1 + sin φ at both ends, each relatively accurate.
#[inline(always)]
fn sides<T: Real>(sine: [T; 2], cosine: [T; 2]) -> [(T, T); 2] {
    let large = sine.map(|s| T::ONE + s.abs());
    let both = T::ONE / (large[0] * large[1]);
    let side = |k: usize| {
        let small = cosine[k] * cosine[k] * (large[1 - k] * both);
        let up = sine[k] > T::ZERO;
        (
            if up { small } else { large[k] },
            if up { large[k] } else { small },
        )
    };
    [side(0), side(1)]
}

/// cos φ at an end, and 1 − sin φ and 1 + sin φ (or the other way round) there and at the other
/// end.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolidAngleEnd<T> {
    pub cosine: T,
    pub minus: [T; 2],
    pub plus: [T; 2],
    /// sin φ₁ − sin φ₀.
    pub range: T,
}

impl<T: Real> SolidAngleEnd<T> {
    /// One of two by selecting numbers.
    #[inline(always)]
    pub(crate) fn select(second: bool, [a, b]: &[Self; 2]) -> Self {
        let one = |a: T, b: T| if second { b } else { a };
        let two = |a: [T; 2], b: [T; 2]| [one(a[0], b[0]), one(a[1], b[1])];
        Self {
            cosine: one(a.cosine, b.cosine),
            minus: two(a.minus, b.minus),
            plus: two(a.plus, b.plus),
            range: a.range,
        }
    }

    /// The solid-angle sample that divides `whole` into `below` and `above` from this end: tan(v/2)
    /// as a quotient of two numbers ≥ 0, v from this end, by `tan(v/2) = ξ Δ sin/(cos φ₀ + cos φ)`
    /// and cos φ = √((1 − sin φ)(1 + sin φ)), both factors linear in ξ = below/whole.
    #[inline(always)]
    pub(crate) fn half_tangent(&self, [below, above, whole]: [T; 3]) -> (T, T) {
        let lerp = |a: [T; 2]| a[0] * above + a[1] * below;
        let cos_phi = (lerp(self.minus) * lerp(self.plus)).sqrt();
        (below * self.range, self.cosine * whole + cos_phi)
    }
}

/// The end from which a sample is measured, and its random number from there: the end that has at
/// most half of the sample space behind it, so that what is next to either end keeps its digits.
/// Beyond [0, 1] it is the end's, and 0 for NaN.
#[inline(always)]
pub(crate) fn nearer<T: Real>(xi: T) -> (bool, T) {
    let rest = T::ONE - xi;
    (rest < xi, rest.at_most(xi).at_least(T::ZERO))
}

/// The part of a line above the horizon of n; `None` if there is nothing.
#[inline(always)]
fn clip<T: Real>(ends: [V3<T>; 2], edge: V3<T>, x: (V3<T>, T), n: V3<T>) -> Option<Kept<T>> {
    let (c0, c1) = (height(n, ends[0]), height(n, ends[1]));
    if c0 <= T::ZERO && c1 <= T::ZERO {
        return None;
    }
    let mut out = Kept {
        ends,
        range: [T::ZERO, T::ONE],
        kept: T::ONE,
        height: [c0.at_least(T::ZERO), c1.at_least(T::ZERO)],
    };
    if c0 >= T::ZERO && c1 >= T::ZERO {
        return Some(out);
    }
    // Opposite signs: nothing cancels in the difference of accurate heights.
    let span = c1 - c0;
    let (before, after) = (c0 / -span, c1 / span);
    let end = on_horizon(ends, edge, x, (n, span, [before, after]));
    let kept = if c0 < T::ZERO {
        out.ends[0] = end;
        out.range[0] = before;
        after
    } else {
        out.ends[1] = end;
        out.range[1] = before;
        before
    };
    out.kept = kept.at_most(T::ONE);
    Some(out)
}

/// The point on the horizon: (n × x)/(n·e), whose error is that of x = p0 × p1, ε |x|/|n·e|; or
/// from the nearer end, whose error is ε times its distance and the way from it. The first is right
/// where the line passes close by, the second where it nearly lies in the horizon. Where both have
/// lost more than six bits, the line passing close by *and* nearly in the horizon, it is formed
/// from more digits.
#[inline(always)]
fn on_horizon<T: Real>(
    ends: [V3<T>; 2],
    edge: V3<T>,
    (x, area): (V3<T>, T),
    (n, span, [before, after]): (V3<T>, T, [T; 2]),
) -> V3<T> {
    let (end, way) = if before <= after {
        (ends[0], scale(edge, before))
    } else {
        (ends[1], scale(edge, -after))
    };
    let reach2 = dot(end, end) + dot(way, way);
    let (area2, span2) = (area * area, span * span);
    let (point, error2) = if area2 <= span2 * reach2 {
        (scale(cross(n, x), T::ONE / span), area2 / span2)
    } else {
        (add(end, way), reach2)
    };
    if error2 > T::from_f64(4096.0) * dot(point, point) {
        return T::on_horizon(ends, n);
    }
    point
}

/// n·p, in twice the precision where the plain sum has lost more than a few digits.
#[inline(always)]
fn height<T: Real>(n: V3<T>, p: V3<T>) -> T {
    let plain = dot(n, p);
    let magnitude = dot(n.map(T::abs), p.map(T::abs));
    if plain.abs() > T::from_f64(1.0 / 64.0) * magnitude {
        plain
    } else {
        T::accurate_dot(n, p)
    }
}

/// A place on a line, by position and by direction: a unit direction in `f32` resolves a far line
/// only to ε/δ of its length, while a fraction of a long line that passes close by resolves its
/// near part only to ε l/h.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArcPoint<T> {
    /// Fraction of the clipped line, in [0, 1].
    pub lambda: T,
    /// 1 − λ, relatively accurate.
    pub rest: T,
    /// Unit direction from the shading point.
    pub direction: [T; 3],
    /// The point relative to the shading point, from whichever of the two resolves it.
    pub point: [T; 3],
}
