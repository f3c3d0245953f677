//! This module samples a linear light by projected solid angle: Peters 2021, algorithms 1 and 2,
//! without cancellation.

use super::view::{ArcPoint, LineView, SolidAngleEnd, nearer};
use crate::linear::numbers::{
    Angle, Bounds, CLOSE, LEAST, STEPS, double_angle, rotate, sine_and_cosine, sine_remainder,
    step_sin_cos,
};
use linelit_elementary::sin_cos;
use linelit_geometry::DVec3;
use linelit_geometry::finite::fraction;

/// Samples a line proportionally to the cosine n·ω within its solid angle. A diffuse surface has
/// zero variance wherever the line is visible.
///
/// **Formula** (Peters 2021, eqs. 2–4, rewritten). With v the angle from the first end, C₀ = cos
/// φ₀, S₀ = sin φ₀, N(v) = n·ω(v) = N₀ cos v + N′ sin v, the mass below v is
///
/// ```text
/// H(v) = ∫₀ᵛ 2 cos(φ₀+u) N(u) du
///      = (C₀N₀ − S₀N′) (v − sin v cos v) + 2 C₀N₀ sin v cos v + (C₀N′ − S₀N₀) sin² v
/// ```
///
/// The bracket v − sin v cos v is computed by a series for v < ½. The paper takes differences of
/// antiderivatives that are anchored at the closest point q of the line, which cancel along the
/// line's extension and at large distances. If they are anchored at an end, they do not cancel; the
/// end is chosen that has at most half of the mass before the sample. The equation H(v) = ξ H(δ) is
/// solved by Halley's irrational step (the root of the local quadratic) with a cubic term. The
/// start is the solid-angle sample of ξ, warped by the cosines at the ends; the second step is the
/// inverse of the Taylor series about the end of the first.
///
/// **Units**: projected solid angle per radius H(δ)/h in sr/m; densities in m/sr (solid angle ×
/// radius).
///
/// **Error** in ξ: 1.58e-5 in exact arithmetic after 2 steps (the paper's bound), 2.1e-7 after 3.
/// [`ProjectedLine::sample`] continues until the next step would not matter. See
/// `docs/accuracy-lights.md` for measured worst cases.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProjectedLine {
    view: LineView,
    arc: Inversion,
}

/// The length of a step of [`ProjectedLine::sample_coarse`], as a fraction of the distance to the
/// nearer end of the line, below which it is the last step.
const COARSE: f64 = 0.08;

/// The mass function H of [`ProjectedLine`], with angles measured from one end of the arc.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct End {
    /// The cosine and the sine of φ at the end.
    cos: f64,
    sin: f64,
    /// N and N′ at the end.
    n: f64,
    dn: f64,
    /// The coefficients in H of v − sin v cos v, of sin v cos v and of sin² v.
    terms: [f64; 3],
    /// N/sin δ at this end and at the other end.
    pub over_sine: [f64; 2],
}

/// The mass function H of [`ProjectedLine`] on the arc of a line, from both ends, and its
/// inversion.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inversion {
    pub delta: f64,
    pub ends: [End; 2],
    pub total: f64,
}

impl End {
    /// Returns one of the two ends by selecting numbers, which compilers can do for several lanes
    /// at once.
    #[inline(always)]
    pub(crate) fn select(second: bool, [a, b]: &[Self; 2]) -> Self {
        let one = |a: f64, b: f64| if second { b } else { a };
        let two = |a: [f64; 2], b: [f64; 2]| [one(a[0], b[0]), one(a[1], b[1])];
        Self {
            cos: one(a.cos, b.cos),
            sin: one(a.sin, b.sin),
            n: one(a.n, b.n),
            dn: one(a.dn, b.dn),
            terms: [
                one(a.terms[0], b.terms[0]),
                one(a.terms[1], b.terms[1]),
                one(a.terms[2], b.terms[2]),
            ],
            over_sine: two(a.over_sine, b.over_sine),
        }
    }

    /// Returns the solid-angle sample of ξ, warped by the cosines at the ends (Hart et al. 2020).
    /// This is one step closer to the solution than the paper's start.
    #[inline(always)]
    pub(crate) fn start(&self, xi: f64, ends: &SolidAngleEnd) -> Angle {
        let [p0, p1] = self.over_sine;
        let eta = 1.0 - xi;
        // Pass the warped number as a quotient, which half_tangent takes without dividing. Adding
        // 1e-18 changes a sum only for ξ = 0 at an end on the horizon.
        let below = xi * (p0 + p1);
        let whole = (p0 + 1e-18) + (p0 * p0 * eta + p1 * p1 * xi).sqrt();
        let above = (whole - below).at_least(0.0);
        let (a, b) = ends.half_tangent([below, above, whole]);
        double_angle(a, b)
    }

    /// Returns the mass H(v) between this end and the angle v (see [`ProjectedLine`]).
    #[inline(always)]
    fn mass(&self, at: &Angle) -> f64 {
        let [a, b, d] = self.terms;
        let sc = at.s * at.c;
        let long = at.v - sc;
        // For short angles take (x − sin x)/2 with x = 2v.
        let four = 4.0;
        let y = four * (at.v * at.v);
        let short = y * at.v * sine_remainder(y);
        let rest = if at.v > 0.5 { long } else { short };
        a * rest + (b * sc + d * (at.s * at.s))
    }

    /// Takes two steps of fourth order, and returns the angle and the length of the second step.
    /// The first step is limited to half a radian and to the arc. The mass after the first step
    /// comes from the sum of [`End::mass`], anchored where the step begins, so that the second step
    /// needs only the sine and cosine of the first (`docs/decisions/009-fourth-order-steps.md`).
    #[inline(always)]
    pub(crate) fn two_steps(&self, at: &Angle, target: f64, delta: f64) -> (Angle, f64) {
        let half = 0.5;
        // Take the first step, by Halley's formula with the cubic term.
        let excess = self.mass(at) - target;
        let cos = self.cos * at.c - self.sin * at.s;
        let sin = self.sin * at.c + self.cos * at.s;
        let n = self.n * at.c + self.dn * at.s;
        let dn = self.dn * at.c - self.n * at.s;
        let [_, step] = halley(excess, [cos, sin], [n, dn]);
        let low = (-at.v).at_least(-half);
        let t = step.at_least(low).at_most((delta - at.v).at_most(half));
        let y = t * t;
        let (s, c) = sine_and_cosine(y);
        let s = t * s;
        let four = 4.0 * y;
        // Compute the mass that is still missing, and N, N′ and φ after the step.
        let (rest, across) = (four * t * sine_remainder(four), s * c);
        let product = cos * n;
        let left = excess
            + ((product - sin * dn) * rest
                + ((product + product) * across + (cos * dn - sin * n) * (s * s)));
        let (cos, sin) = (cos * c - sin * s, sin * c + cos * s);
        let (n, dn) = (n * c + dn * s, dn * c - n * s);
        // Take the second step, by the inverse of the Taylor series to its third term.
        let slope = cos * n;
        let inverse = half / slope;
        let bend = (cos * dn - sin * n) * inverse;
        let third = 1.0 / 3.0;
        let twist = (slope + sin * dn) * (inverse * (third + third));
        let d = -left * inverse;
        let d = d - d * d * (bend - d * (bend * bend + bend * bend + twist));
        // Rotate to (sin, cos) of v + t, and then to v + t + d, where d is small.
        let (s, c) = rotate((at.s, at.c), (s, c));
        let d = d.at_least(-half).at_most(half);
        let d2 = half * (d * d);
        let (s, c) = rotate((s, c), (d - d * d2 * third, 1.0 - d2));
        let v = at.v + (t + d);
        (
            Angle {
                v,
                s: s.at_least(0.0),
                c,
            },
            d.abs(),
        )
    }

    /// Returns Peters' step, and the same step with the cubic term. Peters' step is the root of
    /// smaller magnitude of the quadratic Taylor polynomial of H − target at v, or its extremum if
    /// there is no root. The cubic term raises an error to its fourth power: H″′ = −4 (cos φ N +
    /// sin φ N′), and the slope at the end of the step is twice the root of the discriminant.
    #[inline(always)]
    pub(crate) fn steps(&self, at: &Angle, target: f64) -> [f64; 2] {
        let excess = self.mass(at) - target;
        let cos = self.cos * at.c - self.sin * at.s;
        let sin = self.sin * at.c + self.cos * at.s;
        let n = self.n * at.c + self.dn * at.s;
        let dn = self.dn * at.c - self.n * at.s;
        halley(excess, [cos, sin], [n, dn])
    }
}

/// Returns the root of smaller magnitude of the quadratic Taylor polynomial of the mass, or its
/// extremum if there is no root, and the same step with the cubic term, from (cos φ, sin φ) and (N,
/// N′).
#[inline(always)]
fn halley(excess: f64, [cos, sin]: [f64; 2], [n, dn]: [f64; 2]) -> [f64; 2] {
    let (slope, bend) = (cos * n, cos * dn - sin * n);
    let root = (slope * slope - bend * excess).at_least(0.0).sqrt();
    let sum = slope.abs() + root;
    let step = -excess / sum;
    let step = if sum > 0.0 { step } else { 0.0 };
    let third = 1.0 / 3.0;
    let more = (slope + sin * dn) * third / root * (step * step);
    let half = 0.5;
    // If the slope is zero, the quotient is meaningless: bound it.
    let more = more.at_least(-half).at_most(half);
    [step, step + step * more]
}

impl ProjectedLine {
    /// Sets the technique up from ends relative to the shading point and the unit normal. `None` if
    /// no part of the line is above the horizon, and where [`LineView::new`] returns `None`.
    #[must_use]
    pub fn new(p0: DVec3, p1: DVec3, normal: DVec3) -> Option<Self> {
        Self::of(LineView::clipped(p0, p1, normal)?)
    }

    /// Sets the technique up from a view that [`LineView::clipped`] or [`LineView::with_edge`] has
    /// clipped by the normal; `None` for a view without a normal.
    #[inline(always)]
    #[must_use]
    pub fn of(view: LineView) -> Option<Self> {
        let arc = Inversion::of(&view)?;
        Some(Self { view, arc })
    }

    /// Returns the line as the shading point sees it.
    #[must_use]
    pub fn view(&self) -> &LineView {
        &self.view
    }

    /// Returns the projected solid angle per radius, `dΩ⊥/dR` in sr/m: the irradiance for a unit of
    /// radiance × radius.
    #[must_use]
    pub fn projected_solid_angle(&self) -> f64 {
        self.arc.projected_solid_angle(&self.view)
    }

    /// Returns the sample to full precision. This takes two steps almost everywhere, and more where
    /// ξ is close to an end of a line that spans almost a half-plane.
    #[must_use]
    pub fn sample(&self, xi: f64) -> ArcPoint {
        self.arc.sample(&self.view, xi)
    }

    /// Returns the sample and its cosine n·ω.
    pub(crate) fn sample_with_cosine(&self, xi: f64) -> (ArcPoint, f64) {
        let ((second, s, c), cosine) = self.arc.arc_with_cosine(&self.view, xi);
        (self.view.arc_point(second, s, c), cosine)
    }

    /// Returns the sample with about the accuracy of the paper's two steps, at a lower cost. The
    /// iteration ends after a step below the fraction 0.08 of the distance to the nearer end; the
    /// error is about the cube of the step. One step is enough almost everywhere. The worst
    /// backward errors in ξ that a search found are in `docs/accuracy-lights.md`.
    #[must_use]
    pub fn sample_coarse(&self, xi: f64) -> ArcPoint {
        let (second, at) = self.arc.find_to(&self.view, xi, COARSE);
        self.view.arc_point(second, at.s, at.c)
    }

    /// Returns the angle v in radians from the first end of the line for the random number `xi`,
    /// found by `steps` iterations of the root finding of Peters 2021, which begin at the sample
    /// uniform in the solid angle. The paper takes 2 of them.
    #[must_use]
    pub fn angle_steps(&self, xi: f64, steps: u32) -> f64 {
        let xi = fraction(xi);
        let end = &self.arc.ends[0];
        let ends = self.view.solid_angle_end(false);
        let (a, b) = ends.half_tangent([xi, 1.0 - xi, 1.0]);
        let mut at = double_angle(a, b);
        for _ in 0..steps {
            let [step, _] = end.steps(&at, xi * self.arc.total);
            self.arc.advance(&mut at, step);
        }
        at.v
    }

    /// Returns the fraction of the mass below the angle `v`, in radians: the exact CDF, for
    /// inversion and for measurements of backward errors.
    #[must_use]
    pub fn cdf(&self, v: f64) -> f64 {
        self.arc.cdf(v)
    }

    /// Returns the random number whose sample is at the position `lambda` of the clipped line.
    #[must_use]
    pub fn invert(&self, lambda: f64) -> f64 {
        self.arc.cdf(self.view.angle_of(lambda))
    }

    /// Returns the random number of a position that is given by both its fractions, λ and 1 − λ
    /// ([`ArcPoint`]). The smaller of them is used, so that positions close to the second end of a
    /// line that runs away from the shading point keep their digits.
    #[must_use]
    pub fn invert_fractions(&self, lambda: f64, rest: f64) -> f64 {
        if lambda > rest {
            self.arc
                .cdf(self.arc.delta - self.view.angle_from_end(fraction(rest)))
        } else {
            self.invert(lambda)
        }
    }

    /// Returns the density per solid angle, times radius, at the position `lambda`:
    /// `(n·ω)/(dΩ⊥/dR)` in m/sr.
    #[must_use]
    pub fn pdf(&self, lambda: f64) -> f64 {
        self.view.cosine(lambda) / self.projected_solid_angle()
    }
}

impl Inversion {
    /// Sets the inversion up for a view that has been clipped by the normal.
    #[inline(always)]
    pub(crate) fn of(view: &LineView) -> Option<Self> {
        let (sin_delta, cos_delta) = view.angle_sin_cos();
        let per_sine = view.inverse_sine();
        let n = view.end_cosines();
        // Express H from both ends.
        let end = |second: bool| {
            let (here, there) = (usize::from(second), usize::from(!second));
            let (cos, sin) = view.foot_angle(second);
            // Compute N′ from N(δ) = N₀ cos δ + N′ sin δ: then N(v) is right at both ends, and
            // positive between them.
            let dn = (n[there] - n[here] * cos_delta) * per_sine;
            let (a, d) = (cos * n[here], sin * dn);
            End {
                cos,
                sin,
                n: n[here],
                dn,
                terms: [a - d, a + a, cos * dn - sin * n[here]],
                over_sine: [n[here] * per_sine, n[there] * per_sine],
            }
        };
        let mut out = Self {
            delta: view.angle(),
            ends: [end(false), end(true)],
            total: 0.0,
        };
        out.total = out.ends[0].mass(&Angle {
            v: out.delta,
            s: sin_delta,
            c: cos_delta,
        });
        // Require that the projected solid angle and its reciprocal have all digits. Since h has,
        // the total then has, too.
        let h = view.line_distance();
        let held = out.total * LEAST < h && h * LEAST < out.total;
        held.then_some(out)
    }

    /// Returns the projected solid angle per radius of the line.
    pub(crate) fn projected_solid_angle(&self, view: &LineView) -> f64 {
        self.total / view.line_distance()
    }

    /// Returns the sample for a random number.
    pub(crate) fn sample(&self, view: &LineView, xi: f64) -> ArcPoint {
        let (second, at) = self.find(view, xi);
        view.arc_point(second, at.s, at.c)
    }

    /// Returns the sample by its end and the sine and cosine of the angle from there, and its
    /// cosine n·ω.
    #[inline(always)]
    pub(crate) fn arc_with_cosine(&self, view: &LineView, xi: f64) -> ((bool, f64, f64), f64) {
        let (second, Angle { s, c, .. }) = self.find(view, xi);
        // Interpolate N(v) from both ends; all terms are positive.
        let [here, there] = self.ends[usize::from(second)].over_sine;
        let cosine = here * view.sine_of_rest(s, c) + there * s;
        ((second, s, c), cosine)
    }

    /// Returns the end from which the sample is measured, and the angle from there, to full
    /// precision: after two steps, or more where the second was large.
    #[inline(always)]
    fn find(&self, view: &LineView, xi: f64) -> (bool, Angle) {
        let (second, xi) = nearer(xi);
        let end = &self.ends[usize::from(second)];
        let target = xi * self.total;
        let start = end.start(xi, &view.solid_angle_end(second));
        let (at, last) = end.two_steps(&start, target, self.delta);
        let room = at.v.at_most(self.delta - at.v);
        if last <= CLOSE * room {
            return (second, at);
        }
        (second, self.refine(end, start, target))
    }

    /// Iterates by [`Inversion::steps_to`] to full precision.
    #[cold]
    #[inline(never)]
    fn refine(&self, end: &End, start: Angle, target: f64) -> Angle {
        self.steps_to(end, start, target, CLOSE)
    }

    /// Iterates until a step is below the fraction `close` of the distance to the nearer end.
    #[inline(always)]
    fn steps_to(&self, end: &End, mut at: Angle, target: f64, close: f64) -> Angle {
        for _ in 0..STEPS {
            let [_, step] = end.steps(&at, target);
            let step = self.advance(&mut at, step);
            let room = at.v.at_most(self.delta - at.v);
            if step.abs() <= close * room {
                break;
            }
        }
        at
    }

    /// Returns the end from which the sample is measured, and the angle from there, by
    /// [`Inversion::steps_to`].
    #[inline]
    fn find_to(&self, view: &LineView, xi: f64, close: f64) -> (bool, Angle) {
        let (second, xi) = nearer(xi);
        let end = &self.ends[usize::from(second)];
        let start = end.start(xi, &view.solid_angle_end(second));
        (second, self.steps_to(end, start, xi * self.total, close))
    }

    /// Takes one step, limited to the arc, and returns its length.
    #[inline]
    fn advance(&self, at: &mut Angle, step: f64) -> f64 {
        let step = step.at_least(-at.v).at_most(self.delta - at.v);
        let (s, c) = rotate((at.s, at.c), step_sin_cos(step));
        at.v += step;
        at.s = s.at_least(0.0);
        at.c = c;
        step
    }

    /// Returns the fraction of the mass below the angle `v` from the first end.
    pub(crate) fn cdf(&self, v: f64) -> f64 {
        let v = v.at_least(0.0).at_most(self.delta);
        let (s, c) = sin_cos(v);
        (self.ends[0].mass(&Angle { v, s, c }) / self.total)
            .at_least(0.0)
            .at_most(1.0)
    }
}

/// A line, or a visible part of it, in one of the two angular measures of points on it.
#[derive(Clone, Copy, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "lives on the stack of one function"
)]
pub enum ThinLine {
    /// Points uniform in solid angle.
    Solid(LineView),
    /// Points uniform in projected solid angle.
    Projected(ProjectedLine),
}

impl ThinLine {
    /// Returns the solid angle or the projected solid angle, per radius.
    #[must_use]
    pub fn measure(&self) -> f64 {
        match self {
            Self::Solid(v) => v.solid_angle(),
            Self::Projected(p) => p.projected_solid_angle(),
        }
    }

    /// Returns the line as the shading point sees it.
    #[must_use]
    pub fn view(&self) -> &LineView {
        match self {
            Self::Solid(v) => v,
            Self::Projected(p) => p.view(),
        }
    }

    /// Returns the point before which the fraction `xi` of the measure lies.
    #[must_use]
    pub fn sample(&self, xi: f64) -> ArcPoint {
        match self {
            Self::Solid(v) => v.sample_solid_angle(xi),
            Self::Projected(p) => p.sample(xi),
        }
    }

    /// Returns the fraction of the measure before a position on the clipped line.
    #[must_use]
    pub fn invert(&self, lambda: f64) -> f64 {
        match self {
            Self::Solid(v) => v.invert_solid_angle(lambda),
            Self::Projected(p) => p.invert(lambda),
        }
    }
}
