//! Projected solid angle of a line: Peters 2021, algorithms 1 and 2, without cancellation.

use super::view::{ArcPoint, LineView};
use crate::real::{Real, rotate, small_sin_cos};

/// Samples a line proportionally to the cosine n·ω within its solid angle: zero variance on a diffuse surface wherever
/// the line is visible.
///
/// **Formula** (Peters 2021, eqs. 2–4, rewritten). With v the angle from the first end, C₀ = cos φ₀, S₀ = sin φ₀,
/// N(v) = n·ω(v) = N₀ cos v + N′ sin v, the mass below v is
///
/// ```text
/// H(v) = ∫₀ᵛ 2 cos(φ₀+u) N(u) du
///      = C₀N₀ (v + sin v cos v) + (C₀N′ − S₀N₀) sin² v − S₀N′ (v − sin v cos v)
/// ```
///
/// with the last bracket as a series for v < 1. The paper takes differences of antiderivatives anchored at the closest
/// point q of the line, which cancel along the line's extension and far away; anchored at the end they do not.
/// H(v) = ξ H(δ) is solved by Halley's irrational step (the root of the local quadratic) from the solid-angle sample.
///
/// **Units**: projected solid angle per radius H(δ)/h in sr/m; densities in m/sr (solid angle × radius).
///
/// **Error** in ξ: 1.58e-5 in exact arithmetic after 2 steps (the paper's bound), 2.1e-7 after 3;
/// [`ProjectedLine::sample`] steps on until the next step could not matter. See `docs/accuracy-lights.md` for measured
/// worst cases in both precisions.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProjectedLine<T> {
    view: LineView<T>,
    arc: Inversion<T>,
}

/// An angle v on the arc with its sine and cosine, and those of the angle that is left, δ − v. Steps turn them along; the
/// library's trigonometry is called once, for v.
#[derive(Clone, Copy)]
struct Place<T> {
    v: T,
    start: (T, T),
    end: (T, T),
}

/// Several places, number by number.
struct Lanes<T, const N: usize> {
    v: [T; N],
    start: [[T; N]; 2],
    end: [[T; N]; 2],
}

impl<T: Real> Place<T> {
    /// The solid-angle sample.
    #[inline]
    fn start(view: &LineView<T>, xi: T) -> Self {
        let [(t, start), (_, end)] = view.start_angles(xi);
        let half = t.atan();
        Self {
            v: half + half,
            start,
            end,
        }
    }
}

/// Inverts the CDF of the density that runs linearly from `p0` to `p1`.
#[inline]
fn warp<T: Real>(xi: T, p0: T, p1: T) -> T {
    let denominator = p0 + (p0 * p0 * (T::ONE - xi) + p1 * p1 * xi).sqrt();
    if denominator > T::ZERO {
        (xi * (p0 + p1) / denominator).at_most(T::ONE)
    } else {
        xi
    }
}

/// Where [`ProjectedLine::sample_coarse`] ends.
const COARSE: f64 = 0.025;

/// H and its inversion on the arc of a line.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inversion<T> {
    delta: T,
    cos0: T,
    sin0: T,
    n0: T,
    n1: T,
    /// End cosines N₀, N(δ), and the same over sin δ.
    ends: [T; 2],
    over_sine: [T; 2],
    /// Coefficients of H: C₀N₀, C₀N′ − S₀N₀, S₀N′.
    terms: [T; 3],
    total: T,
}

impl<T: Real> ProjectedLine<T> {
    /// The per-light part: ends relative to the shading point, unit normal. `None` if nothing of the line is above the
    /// horizon, and as for [`LineView::new`].
    #[must_use]
    pub fn new(p0: [T; 3], p1: [T; 3], normal: [T; 3]) -> Option<Self> {
        Self::of(LineView::clipped(p0, p1, normal)?)
    }

    /// The same for a view that [`LineView::clipped`] or [`LineView::with_edge`] has clipped by the normal; `None` for one
    /// that has none.
    #[must_use]
    pub fn of(view: LineView<T>) -> Option<Self> {
        let arc = Inversion::of(&view)?;
        Some(Self { view, arc })
    }

    /// The line as seen.
    #[must_use]
    pub fn view(&self) -> &LineView<T> {
        &self.view
    }

    /// Projected solid angle per radius, `dΩ⊥/dR` in sr/m: the irradiance for a unit of radiance × radius.
    #[must_use]
    pub fn projected_solid_angle(&self) -> T {
        self.arc.projected_solid_angle(&self.view)
    }

    /// The sample, to the precision: two steps nearly everywhere, more where ξ is close to an end of a line that spans
    /// almost a half-plane.
    #[must_use]
    pub fn sample(&self, xi: T) -> ArcPoint<T> {
        self.arc.sample(&self.view, xi)
    }

    /// The sample to about the accuracy that the paper has after its two steps, and for less: steps end when one was below
    /// a fortieth of the distance to the nearer end (what is left is about its cube). One step does nearly everywhere.
    /// Worst backward error in ξ by search: `docs/accuracy-lights.md`.
    #[must_use]
    pub fn sample_coarse(&self, xi: T) -> ArcPoint<T> {
        let place = self.arc.find_to(&self.view, xi, T::from_f64(COARSE));
        self.view.arc_point(place.start, place.end)
    }

    /// The angle v from the first end of the sample after a number of steps; 2 is the paper's.
    #[must_use]
    pub fn angle_steps(&self, xi: T, steps: u32) -> T {
        let mut at = Place::start(&self.view, xi);
        for _ in 0..steps {
            self.arc.advance(&mut at, xi * self.arc.total);
        }
        at.v
    }

    /// The fraction of the mass below the angle `v`: the exact CDF, for inversion and for measuring backward errors.
    #[must_use]
    pub fn cdf(&self, v: T) -> T {
        self.arc.cdf(v)
    }

    /// The random number whose sample is at the place `lambda` of the clipped line.
    #[must_use]
    pub fn invert(&self, lambda: T) -> T {
        self.arc.cdf(self.view.angle_of(lambda))
    }

    /// The random number of a place given by both its fractions, λ and 1 − λ ([`ArcPoint`]): from the smaller, so that places
    /// next to the second end of a line that runs away from the shading point keep their digits.
    #[must_use]
    pub fn invert_fractions(&self, lambda: T, rest: T) -> T {
        if lambda <= rest {
            self.invert(lambda)
        } else {
            self.arc
                .cdf(self.arc.delta - self.view.angle_from_end(rest))
        }
    }

    /// Density per solid angle, times radius, at the place `lambda`: `(n·ω)/(dΩ⊥/dR)` in m/sr.
    #[must_use]
    pub fn pdf(&self, lambda: T) -> T {
        self.view.cosine(lambda) / self.projected_solid_angle()
    }
}

impl<T: Real> Inversion<T> {
    /// For a view that has been clipped by the normal.
    pub(crate) fn of(view: &LineView<T>) -> Option<Self> {
        let (cos0, sin0) = view.start();
        let (sin_delta, cos_delta) = view.angle_sin_cos();
        let [n0, end] = view.end_cosines();
        // N′ from N(δ) = N₀ cos δ + N′ sin δ: N(v) then is right at both ends and positive in between.
        let n1 = (end - n0 * cos_delta) / sin_delta;
        let mut out = Self {
            ends: [n0, end],
            over_sine: [n0 / sin_delta, end / sin_delta],
            delta: view.angle(),
            cos0,
            sin0,
            n0,
            n1,
            terms: [
                cos0 * n0,
                T::diff_of_products(cos0, n1, sin0, n0),
                sin0 * n1,
            ],
            total: T::ZERO,
        };
        let (s, c) = out.delta.sin_cos();
        out.total = out.mass(out.delta, s, c);
        out.total.is_usable().then_some(out)
    }

    pub(crate) fn projected_solid_angle(&self, view: &LineView<T>) -> T {
        self.total / view.line_distance()
    }

    /// H(v), given sine and cosine.
    #[inline]
    fn mass(&self, v: T, s: T, c: T) -> T {
        let (sc, [a, b, d]) = (s * c, self.terms);
        a * (v + sc) + b * (s * s) - d * minus_sin_cos(v, sc)
    }

    pub(crate) fn sample(&self, view: &LineView<T>, xi: T) -> ArcPoint<T> {
        let place = self.find(view, xi);
        view.arc_point(place.start, place.end)
    }

    /// The sample and its cosine n·ω.
    pub(crate) fn sample_with_cosine(&self, view: &LineView<T>, xi: T) -> (ArcPoint<T>, T) {
        self.output(view, &self.find(view, xi))
    }

    fn find(&self, view: &LineView<T>, xi: T) -> Place<T> {
        self.find_to(view, xi, T::CLOSE)
    }

    /// Steps until one is below the fraction `close` of the distance to the nearer end.
    fn find_to(&self, view: &LineView<T>, xi: T, close: T) -> Place<T> {
        let target = xi * self.total;
        // The start: the solid-angle sample of ξ warped by the cosines at the ends (Hart et al. 2020), one step closer than
        // the paper's.
        let [n0, n1] = self.ends;
        let mut at = Place::start(view, warp(xi, n0, n1));
        for _ in 0..T::STEPS {
            let step = self.advance(&mut at, target);
            let room = at.v.at_most(self.delta - at.v);
            if step.abs() <= close * room {
                break;
            }
        }
        at
    }

    /// [`Inversion::sample_with_cosine`] for several random numbers in lockstep: every operation on all of them, without a
    /// branch, so that the compiler can use vector instructions.
    pub(crate) fn sample_batch<const N: usize>(
        &self,
        view: &LineView<T>,
        xi: &[T; N],
    ) -> [(ArcPoint<T>, T); N] {
        let [n0, n1] = self.ends;
        let places = xi.map(|xi| Place::start(view, warp(xi, n0, n1)));
        let mut lanes = Lanes {
            v: places.map(|p| p.v),
            start: [places.map(|p| p.start.0), places.map(|p| p.start.1)],
            end: [places.map(|p| p.end.0), places.map(|p| p.end.1)],
        };
        let target = xi.map(|xi| xi * self.total);
        for _ in 0..T::STEPS {
            if self.advance_all(&mut lanes, &target) {
                break;
            }
        }
        core::array::from_fn(|i| {
            let place = Place {
                v: lanes.v[i],
                start: (lanes.start[0][i], lanes.start[1][i]),
                end: (lanes.end[0][i], lanes.end[1][i]),
            };
            self.output(view, &place)
        })
    }

    /// One step of every lane; whether all have arrived.
    #[inline]
    fn advance_all<const N: usize>(&self, at: &mut Lanes<T, N>, target: &[T; N]) -> bool {
        let mut step = [T::ZERO; N];
        for i in 0..N {
            let (v, s, c) = (at.v[i], at.start[0][i], at.start[1][i]);
            let (sc, [a, b, d]) = (s * c, self.terms);
            let long = v - sc;
            let four = T::from_f64(4.0);
            let short = four * v * v * v * T::sine_remainder(four * v * v);
            let rest = if v > T::ONE { long } else { short };
            let excess = a * (v + sc) + b * (s * s) - d * rest - target[i];
            let raw = self.step_from(excess, s, c);
            step[i] = raw.at_least(-v).at_most(self.delta - v);
        }
        let mut largest = T::ZERO;
        for x in step {
            largest = largest.at_least(x.abs());
        }
        let half = T::from_f64(0.5);
        let mut turn = [[T::ZERO; N]; 2];
        if largest > half {
            for i in 0..N {
                (turn[0][i], turn[1][i]) = step[i].sin_cos();
            }
        } else {
            for i in 0..N {
                let (s, c) = T::sine_and_cosine(step[i] * step[i]);
                (turn[0][i], turn[1][i]) = (step[i] * s, c);
            }
        }
        let mut far = T::ZERO;
        for i in 0..N {
            let (s, c) = (turn[0][i], turn[1][i]);
            let v = at.v[i] + step[i];
            let a = rotate((at.start[0][i], at.start[1][i]), (s, c));
            let b = rotate((at.end[0][i], at.end[1][i]), (-s, c));
            at.v[i] = v;
            (at.start[0][i], at.start[1][i]) = (a.0.at_least(T::ZERO), a.1);
            (at.end[0][i], at.end[1][i]) = (b.0.at_least(T::ZERO), b.1);
            let room = v.at_most(self.delta - v);
            far = far.at_least(step[i].abs() - T::CLOSE * room);
        }
        far <= T::ZERO
    }

    fn output(&self, view: &LineView<T>, place: &Place<T>) -> (ArcPoint<T>, T) {
        // N(v) from both ends, all terms positive.
        let [n0, n1] = self.over_sine;
        let cosine = n0 * place.end.0 + n1 * place.start.0;
        (view.arc_point(place.start, place.end), cosine)
    }

    /// One step; how far it went.
    #[inline]
    fn advance(&self, at: &mut Place<T>, target: T) -> T {
        let step = self.step(at.v, at.start, target);
        let step = step.at_least(-at.v).at_most(self.delta - at.v);
        let (s, c) = small_sin_cos(step);
        at.v = at.v + step;
        at.start = rotate(at.start, (s, c));
        at.end = rotate(at.end, (-s, c));
        at.end.0 = at.end.0.at_least(T::ZERO);
        at.start.0 = at.start.0.at_least(T::ZERO);
        step
    }

    /// The root of smaller magnitude of the quadratic Taylor polynomial of H − target at v; its extremum if none.
    #[inline]
    fn step(&self, v: T, (s, c): (T, T), target: T) -> T {
        self.step_from(self.mass(v, s, c) - target, s, c)
    }

    #[inline]
    fn step_from(&self, excess: T, s: T, c: T) -> T {
        let cos = self.cos0 * c - self.sin0 * s;
        let sin = self.sin0 * c + self.cos0 * s;
        let n = self.n0 * c + self.n1 * s;
        let dn = self.n1 * c - self.n0 * s;
        let two = T::ONE + T::ONE;
        let slope = two * cos * n;
        let half_bend = cos * dn - sin * n;
        let discriminant = slope * slope - two * two * half_bend * excess;
        let sum = slope.abs() + discriminant.at_least(T::ZERO).sqrt();
        if sum > T::ZERO {
            -two * excess / sum
        } else {
            T::ZERO
        }
    }

    pub(crate) fn cdf(&self, v: T) -> T {
        let (s, c) = v.sin_cos();
        (self.mass(v, s, c) / self.total)
            .at_least(T::ZERO)
            .at_most(T::ONE)
    }
}

/// `v − sin v cos v` given the product; relatively accurate.
#[inline]
fn minus_sin_cos<T: Real>(v: T, sin_cos: T) -> T {
    if v > T::ONE {
        return v - sin_cos;
    }
    // (x − sin x)/2 with x = 2v.
    let four = T::from_f64(4.0);
    four * v * v * v * T::sine_remainder(four * v * v)
}
