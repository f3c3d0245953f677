//! A line as the shading point sees it: clipping, solid angle, and the map between angles and places.

use crate::real::{Real, V3, add, cross, dot, length, plain_cross, scale, sub};

/// A straight line seen from the origin, clipped or not, with the few numbers that every technique starts from.
///
/// With q the point of the infinite line closest to the origin, h = |q| and φ the angle from q, the line is the arc
/// φ₀ … φ₁ of a great circle; v = φ − φ₀ runs over [0, δ]. All differences are formed so that nothing cancels for lines
/// that are short, far, nearly collinear with the origin or passing close to it; cross products are accurate by
/// component. Generic over `f32` and `f64`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineView<T> {
    p0: V3<T>,
    p1: V3<T>,
    /// Edge, not clipped, and its length.
    edge: V3<T>,
    whole: T,
    /// Fractions of the whole line at which the clipped line begins and ends.
    range: [T; 2],
    /// Their difference, relatively accurate also where little is left.
    kept: T,
    /// Clipped length.
    l: T,
    r: [T; 2],
    /// Reciprocals of r, cosines h/r at both ends, and sin δ.
    inverse: [T; 2],
    cosine: [T; 2],
    sin_delta: T,
    /// p0·p1 and |p0 × p1| of the clipped ends.
    dot: T,
    cross: T,
    /// Unit normal of the plane of the line and the origin.
    axis: V3<T>,
    h: T,
    /// Cosines n·p of the clipped ends (0 where clipped); zero without a normal.
    height: [T; 2],
    /// sin φ at both ends, 1 − sin φ and 1 + sin φ from their small sides.
    sine: [T; 2],
    minus: [T; 2],
    plus: [T; 2],
    /// Unit tangent t of the fan at the first end.
    tangent: V3<T>,
    /// sin φ₁ − sin φ₀.
    sine_range: T,
}

impl<T: Real> LineView<T> {
    /// The whole line between two points relative to the shading point. `None` if it has no length, if the shading point
    /// is on the infinite line (its solid angle is zero or infinite), or if a coordinate is not finite.
    #[must_use]
    pub fn new(p0: [T; 3], p1: [T; 3]) -> Option<Self> {
        Self::build(p0, p1, sub(p1, p0), cross(p0, p1), None)
    }

    /// The part of the line in the half-space `normal·p ≥ 0`. `None` as for [`LineView::new`], or if nothing is above
    /// the horizon.
    ///
    /// The end on the horizon is `(n × (p0 × p1))/(n·e)`, accurate relative to itself (Peters 2021, §3.2 clips too, by
    /// interpolation, whose absolute error matters when the crossing is close to the shading point).
    #[must_use]
    pub fn clipped(p0: [T; 3], p1: [T; 3], normal: [T; 3]) -> Option<Self> {
        Self::build(p0, p1, sub(p1, p0), cross(p0, p1), Some(normal))
    }

    /// As [`LineView::new`] or [`LineView::clipped`] with the edge p1 − p0 given by a caller that knows it more
    /// accurately, because it formed it before the shading point was subtracted.
    #[must_use]
    pub fn with_edge(p0: [T; 3], p1: [T; 3], edge: [T; 3], normal: Option<[T; 3]>) -> Option<Self> {
        // From the nearer end, whose rounding turns the plane of the fan least.
        let first = dot(p0, p0) <= dot(p1, p1);
        let x = cross(if first { p0 } else { p1 }, edge);
        Self::build(p0, p1, edge, x, normal)
    }

    fn build(p0: V3<T>, p1: V3<T>, edge: V3<T>, x: V3<T>, normal: Option<V3<T>>) -> Option<Self> {
        let whole = length(edge);
        let area = length(x);
        if !(whole.is_usable() && area.is_usable()) {
            return None;
        }
        let mut view = Self {
            p0,
            p1,
            edge,
            whole,
            range: [T::ZERO, T::ONE],
            kept: T::ONE,
            l: whole,
            cross: area,
            axis: scale(x, T::ONE / area),
            h: area / whole,
            ..Self::default()
        };
        if let Some(n) = normal {
            view.clip(n, x)?;
        }
        view.finish()
    }

    fn clip(&mut self, n: V3<T>, x: V3<T>) -> Option<()> {
        let (c0, c1) = (height(n, self.p0), height(n, self.p1));
        self.height = [c0.at_least(T::ZERO), c1.at_least(T::ZERO)];
        if c0 <= T::ZERO && c1 <= T::ZERO {
            return None;
        }
        if c0 >= T::ZERO && c1 >= T::ZERO {
            return Some(());
        }
        // Opposite signs: nothing cancels in the difference of accurate heights.
        let span = c1 - c0;
        let (before, after) = (c0 / -span, c1 / span);
        let on_horizon = self.on_horizon(n, x, span, [before, after]);
        let kept = if c0 < T::ZERO {
            self.p0 = on_horizon;
            self.range[0] = before;
            after
        } else {
            self.p1 = on_horizon;
            self.range[1] = before;
            before
        };
        let kept = kept.at_most(T::ONE);
        self.kept = kept;
        self.l = self.whole * kept;
        self.cross = self.cross * kept;
        Some(())
    }

    /// The point on the horizon: (n × x)/(n·e), whose error is that of x = p0 × p1, ε |x|/|n·e|; or from the nearer end,
    /// whose error is ε times its distance and the way from it. The first is right where the line passes close by, the second where it nearly
    /// lies in the horizon.
    fn on_horizon(&self, n: V3<T>, x: V3<T>, span: T, [before, after]: [T; 2]) -> V3<T> {
        let (end, way) = if before <= after {
            (self.p0, scale(self.edge, before))
        } else {
            (self.p1, scale(self.edge, -after))
        };
        let reach2 = dot(end, end) + dot(way, way);
        if self.cross * self.cross <= span * span * reach2 {
            scale(cross(n, x), T::ONE / span)
        } else {
            add(end, way)
        }
    }

    /// What depends on the clipped ends.
    fn finish(mut self) -> Option<Self> {
        let (r0, r1) = (length(self.p0), length(self.p1));
        self.r = [r0, r1];
        self.inverse = self.r.map(|r| T::ONE / r);
        self.cosine = self.inverse.map(|q| self.h * q);
        self.sin_delta = self.cross * self.inverse[0] * self.inverse[1];
        self.dot = dot(self.p0, self.p1);
        let unit = scale(self.edge, T::ONE / self.whole);
        self.sine = [dot(self.p0, unit) / r0, dot(self.p1, unit) / r1];
        for i in 0..2 {
            let (s, c) = (self.sine[i], self.cosine[i]);
            let (small, large) = (c * c / (T::ONE + s.abs()), T::ONE + s.abs());
            (self.minus[i], self.plus[i]) = if s > T::ZERO {
                (small, large)
            } else {
                (large, small)
            };
        }
        self.tangent = scale(plain_cross(self.axis, self.p0), T::ONE / r0);
        let product = r0 * r1;
        self.sine_range = if self.dot > T::ZERO {
            // h² l (r0 + r1)/(r0 r1 (r0 r1 + p0·p1)): nothing cancels.
            (self.h / r0) * (self.h / r1) * (self.l / (product + self.dot)) * (r0 + r1)
        } else {
            self.sine[1] - self.sine[0]
        };
        (self.sine_range.is_usable() && self.cross.is_usable()).then_some(self)
    }

    /// The (clipped) ends.
    #[must_use]
    pub fn ends(&self) -> ([T; 3], [T; 3]) {
        (self.p0, self.p1)
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
    #[must_use]
    pub fn angle(&self) -> T {
        self.cross.atan2(self.dot)
    }

    /// sin δ and cos δ.
    pub(crate) fn angle_sin_cos(&self) -> (T, T) {
        (self.sin_delta, self.dot * self.inverse[0] * self.inverse[1])
    }

    /// Cosine and sine of φ at the first end: h/r₀ and s₀/r₀.
    pub(crate) fn start(&self) -> (T, T) {
        (self.cosine[0], self.sine[0])
    }

    /// n·ω at both clipped ends.
    pub(crate) fn end_cosines(&self) -> [T; 2] {
        [
            self.height[0] * self.inverse[0],
            self.height[1] * self.inverse[1],
        ]
    }

    /// Solid angle per radius in sr/m: `dΩ/dR = (2/h)(sin φ₁ − sin φ₀)` (Peters 2021, eq. 1 and its limit).
    #[must_use]
    pub fn solid_angle(&self) -> T {
        (self.sine_range + self.sine_range) / self.h
    }

    /// Distance from the shading point of the place `lambda` in [0, 1] on the (clipped) line.
    #[must_use]
    pub fn distance(&self, lambda: T) -> T {
        length(self.at(lambda))
    }

    /// The place `lambda` in [0, 1] on the (clipped) line, relative to the shading point, from the nearer end.
    #[must_use]
    pub fn at(&self, lambda: T) -> [T; 3] {
        let kept = self.kept;
        if lambda + lambda <= T::ONE {
            add(self.p0, scale(self.edge, kept * lambda))
        } else {
            sub(self.p1, scale(self.edge, kept * (T::ONE - lambda)))
        }
    }

    /// The fraction of the whole line at the place `lambda` of the clipped one.
    #[must_use]
    pub fn whole_fraction(&self, lambda: T) -> T {
        self.range[0] * (T::ONE - lambda) + self.range[1] * lambda
    }

    /// The place on the clipped line of a fraction of the whole; `None` where it is clipped away.
    #[must_use]
    pub fn clipped_fraction(&self, t: T) -> Option<T> {
        let [a, b] = self.range;
        (t >= a && t <= b && b > a).then(|| ((t - a) / (b - a)).at_most(T::ONE))
    }

    /// The sample that is uniform in solid angle (Peters 2021, §3.1): sin φ runs linearly in ξ. No trigonometry.
    #[must_use]
    pub fn sample_solid_angle(&self, xi: T) -> ArcPoint<T> {
        let [start, end] = self.start_angles(xi);
        self.arc_point(start.1, end.1)
    }

    /// tan(v/2) of the solid-angle sample, by `tan(v/2) = ξ Δ sin/(cos φ₀ + cos φ)`, with (sin v, cos v); and the same from
    /// the other end.
    #[inline]
    pub(crate) fn start_angles(&self, xi: T) -> [(T, (T, T)); 2] {
        let cos_phi = self.cos_phi(xi);
        let from = |fraction: T, c: T| {
            let t = fraction * self.sine_range / (c + cos_phi);
            let q = T::ONE / (T::ONE + t * t);
            (t, ((t + t) * q, (T::ONE - t * t) * q))
        };
        [from(xi, self.cosine[0]), from(T::ONE - xi, self.cosine[1])]
    }

    /// cos φ of the solid-angle sample: √((1 − sin φ)(1 + sin φ)) with both factors linear in ξ.
    #[inline]
    fn cos_phi(&self, xi: T) -> T {
        let eta = T::ONE - xi;
        let lerp = |a: [T; 2]| a[0] * eta + a[1] * xi;
        (lerp(self.minus) * lerp(self.plus)).sqrt()
    }

    /// The fraction of the solid angle below the place `lambda`: the inverse of [`LineView::sample_solid_angle`].
    #[must_use]
    pub fn invert_solid_angle(&self, lambda: T) -> T {
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
        let start = if end == 0 { self.p0 } else { self.p1 };
        let (d, l) = (dot(start, p), self.l * lambda);
        if d > T::ZERO {
            (self.h / r0) * (self.h / r) * (l / (r0 * r + d)) * (r0 + r)
        } else {
            (dot(p, self.edge) / (self.whole * r) - self.sine[end]).abs()
        }
    }

    /// The angle v of the place `lambda`.
    pub(crate) fn angle_of(&self, lambda: T) -> T {
        let p = self.at(lambda);
        (self.cross * lambda).atan2(dot(self.p0, p))
    }

    /// The angle δ − v of the place at the fraction `rest` from the second end.
    pub(crate) fn angle_from_end(&self, rest: T) -> T {
        let p = sub(self.p1, scale(self.edge, self.kept * rest));
        (self.cross * rest).atan2(dot(self.p1, p))
    }

    /// n·p at the place `lambda`, linear between the clipped ends.
    pub(crate) fn height(&self, lambda: T) -> T {
        self.height[0] * (T::ONE - lambda) + self.height[1] * lambda
    }

    /// The cosine n·ω at the place `lambda` of a line that was clipped by n; zero of one that was not.
    #[must_use]
    pub fn cosine(&self, lambda: T) -> T {
        self.height(lambda) / self.distance(lambda)
    }

    /// Whether a place on the line is better resolved by its fraction from the nearer end than by its direction. A relative
    /// error ε of the distance s from that end turns the direction by ε s h/r²: by at most ε where the line runs away from
    /// its foot, however small the angle that it subtends; by ε l/h where the foot is inside, so that the line then must be
    /// shorter than h.
    #[must_use]
    pub fn is_short(&self) -> bool {
        let foot_inside = self.sine[0] < T::ZERO && self.sine[1] > T::ZERO;
        !foot_inside || self.l < self.h
    }

    /// The place and direction from (sin, cos) of the angles to both ends.
    ///
    /// 1/r interpolates like a direction, `1/r = (sin(δ−v)/r₀ + sin v/r₁)/sin δ`: all terms are positive.
    #[inline]
    pub(crate) fn arc_point(&self, from_start: (T, T), from_end: (T, T)) -> ArcPoint<T> {
        let (w0, w1) = (from_end.0 * self.inverse[0], from_start.0 * self.inverse[1]);
        let sum = w0 + w1;
        if !sum.is_usable() {
            return ArcPoint::default();
        }
        let inverse = T::ONE / sum;
        let (lambda, rest) = (w1 * inverse, w0 * inverse);
        let distance = self.sin_delta * inverse;
        if self.is_short() {
            let point = if lambda <= rest {
                add(self.p0, scale(self.edge, self.kept * lambda))
            } else {
                sub(self.p1, scale(self.edge, self.kept * rest))
            };
            let direction = scale(point, sum / self.sin_delta);
            return ArcPoint {
                lambda,
                rest,
                direction,
                point,
            };
        }
        let along = scale(self.tangent, from_start.0);
        let direction = add(scale(self.p0, from_start.1 * self.inverse[0]), along);
        let point = scale(direction, distance);
        ArcPoint {
            lambda,
            rest,
            direction,
            point,
        }
    }
}

/// n·p, in twice the precision where the plain sum has lost more than a few digits.
fn height<T: Real>(n: V3<T>, p: V3<T>) -> T {
    let plain = dot(n, p);
    let magnitude = dot(n.map(T::abs), p.map(T::abs));
    if plain.abs() > T::from_f64(1.0 / 64.0) * magnitude {
        plain
    } else {
        T::accurate_dot(n, p)
    }
}

/// A place on a line, by position and by direction: a unit direction in `f32` resolves a far line only to ε/δ of its
/// length, while a fraction of a long line that passes close by resolves its near part only to ε l/h.
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
