//! This module describes the side of a cylinder as a shading point sees it, and samples points on
//! it by area.

use crate::{Area, Cylinder, Pdf, PointSample, PointTechnique};
use core::f64::consts::PI;
use linelit_elementary::{atan, atan2, hypot, sin, sin_cos, tan};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DVec3, Frame, Segment, predicates};

/// The view of a finite cylinder from a shading point outside the infinite cylinder: a strip of its
/// side.
///
/// ```text
///            across            x: the shading point, at the distance ρ from the axis
///        ___   │               φ: the azimuth of a line about the axis, from x
///      ╱     ╲ ╱ line, at φ    α: the angle between the axis and the line, as seen from x
///     │   ·───┼────────── x    ψ: the angle of incidence at the line, φ = ψ − α
///      ╲ ___ ╱   ρ             the outline: the plane through both rims, cos φ = k
/// ```
///
/// **Formula**: with ρ the distance of the shading point from the axis, k = R/ρ and φ the azimuth
/// about the axis, measured from the shading point, the lines along the axis with cos φ > k face
/// the point. The convex side never hides itself, so that all of these lines are visible. The
/// normal is constant on each line. In the plane perpendicular to the axis, the line is at the
/// distance D from the point, under the angle α from the axis and the angle of incidence ψ, with
/// `sin α = k sin ψ` and `φ = ψ − α`. A strip dα has the solid angle `D² dα dz/d³`, where d is the
/// distance of its point.
///
/// The two lines at the rim span a plane, the *outline*, parallel to the axis at the distance R k
/// from it. All lines lie in front of that plane. A line appears there as a segment parallel to the
/// axis, and the fraction t of the line appears at the fraction t of the segment.
///
/// ```
/// use linelit_lights::geometry::{DVec3, Segment};
/// use linelit_lights::{Cylinder, CylinderView};
/// let axis = Segment::new(DVec3::new(0.0, 2.0, -1.0), DVec3::new(0.0, 2.0, 1.0));
/// let view = CylinderView::new(&Cylinder { axis, radius: 1.0 }, DVec3::ZERO).unwrap();
/// // R k = 1/2 from the axis.
/// assert!(view.outline().iter().all(|corner| (corner.y - 1.5).abs() < 1e-15));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderView {
    pub(crate) cylinder: Cylinder,
    pub(crate) x: DVec3,
    /// The unit vectors from the axis to the shading point, across both, and along the axis.
    pub(crate) axes: [DVec3; 3],
    /// The positions of the ends along the axis, relative to the shading point.
    ends: [f64; 2],
    pub(crate) rho: f64,
    /// k = R/ρ, the radius over the distance of the shading point from the axis; the next field is
    /// 1 − k.
    pub(crate) k: f64,
    rest: f64,
}

/// A line along the side, in the plane perpendicular to the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slice {
    /// The sine and the cosine of the azimuth φ.
    pub sin: f64,
    pub cos: f64,
    /// D: the distance of the line from the shading point.
    pub distance: f64,
    /// D cos ψ: the height of the shading point above the plane that touches the cylinder in the
    /// line.
    pub height: f64,
}

impl CylinderView {
    /// Makes the view; `None` from inside the infinite cylinder, where only the dark inner side is
    /// seen, for a cylinder without length or radius, and where numbers overflow.
    #[must_use]
    pub fn new(cylinder: &Cylinder, x: DVec3) -> Option<Self> {
        let Cylinder { axis, radius } = *cylinder;
        let along = predicates::normalize(axis.vector())?;
        // Measure from the nearer end, whose rounding rotates the frame least.
        let [from0, from1] = [x - axis.p0, x - axis.p1];
        let near = if from0.dot(along) + from1.dot(along) < 0.0 {
            from0
        } else {
            from1
        };
        let across = predicates::cross(along, near);
        let rho = predicates::length(across);
        let beside = predicates::normalize(across)?;
        let ends = [-from0.dot(along), -from1.dot(along)];
        let usable = radius > 0.0 && rho > radius && rho < f64::INFINITY;
        let finite = ends[1] > ends[0] && (rho * rho + ends[0] * ends[0]).is_finite();
        (usable && finite && (ends[1] * ends[1]).is_finite()).then(|| Self {
            cylinder: *cylinder,
            x,
            axes: [beside.cross(along), beside, along],
            ends,
            rho,
            k: radius / rho,
            rest: (rho - radius) / rho,
        })
    }

    /// Returns the cylinder.
    #[must_use]
    pub const fn cylinder(&self) -> &Cylinder {
        &self.cylinder
    }

    /// Returns the shading point.
    #[must_use]
    pub const fn position(&self) -> DVec3 {
        self.x
    }

    /// Returns the unit outward normal at a point of the side; zero on the axis.
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        let ([out, across, _], from) = (self.axes, point - self.cylinder.axis.p0);
        let (c, s) = (out.dot(from), across.dot(from));
        predicates::normalize(out * c + across * s).unwrap_or(DVec3::ZERO)
    }

    /// Returns the point where a ray from the shading point enters the cylinder through its side.
    #[must_use]
    pub fn meets(&self, direction: DVec3) -> Option<DVec3> {
        let [out, across, along] = self.axes.map(|a| a.dot(direction));
        let steep = hypot(out, across);
        let sine = across / (steep * self.k);
        if !(out < 0.0 && sine.abs() <= 1.0) {
            return None;
        }
        let inside = self.k * ((1.0 - sine) * (1.0 + sine)).sqrt();
        let distance = self.rho * (-out / steep - inside) / steep;
        let height = along * distance;
        let meets = height >= self.ends[0] && height <= self.ends[1];
        meets.then(|| self.x + direction * distance)
    }

    /// Returns the smallest and the largest height of the cylinder above the plane through the
    /// shading point with the unit normal `n`.
    #[must_use]
    pub fn heights(&self, n: DVec3) -> [f64; 2] {
        let ends = self.cylinder.axis.relative_to(self.x);
        let [h0, h1] = [ends.p0, ends.p1].map(|p| n.dot(p));
        let rise = self.cylinder.radius * hypot(n.dot(self.axes[0]), n.dot(self.axes[1]));
        [h0.min(h1) - rise, h0.max(h1) + rise]
    }

    /// Returns the segment across the axis through a point, as wide as the visible part of the
    /// cylinder there.
    #[must_use]
    pub fn across(&self, point: DVec3) -> Segment {
        let [out, across, _] = self.axes;
        let from = point - self.cylinder.axis.p0;
        let middle = point - across * across.dot(from);
        let half = across * ((self.rho - out.dot(from)) * self.k / self.rim());
        Segment::new(middle - half, middle + half)
    }

    /// Returns the normal of the outline, towards the shading point.
    #[must_use]
    pub const fn towards(&self) -> DVec3 {
        self.axes[0]
    }

    /// Returns the azimuth φ of the rim in radians, less than a quarter turn.
    #[must_use]
    pub fn half_turn(&self) -> f64 {
        atan2(self.rim(), self.k)
    }

    /// Returns the azimuth φ of a point of the side in radians, in [−π, π].
    #[must_use]
    pub fn azimuth(&self, point: DVec3) -> f64 {
        let out = point - self.cylinder.axis.p0;
        atan2(self.axes[1].dot(out), self.axes[0].dot(out))
    }

    /// Returns √(1 − k²): the sine of φ, and the cosine of α, at the rim.
    pub(crate) fn rim(&self) -> f64 {
        (self.rest * (1.0 + self.k)).sqrt()
    }

    /// Returns α at the rim.
    pub(crate) fn half_angle(&self) -> f64 {
        atan2(self.k, self.rim())
    }

    /// Returns the line at an angle α, and cos ψ.
    pub(crate) fn at_angle(&self, alpha: f64) -> (Slice, f64) {
        self.at_incidence((sin(alpha) / self.k).clamp(-1.0, 1.0))
    }

    /// Returns the line at an angle of incidence given by its sine, and the cosine of this angle.
    pub(crate) fn at_incidence(&self, sine: f64) -> (Slice, f64) {
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let s = self.k * sine;
        let c = ((1.0 - s) * (1.0 + s)).sqrt();
        let (sin, cos) = (sine * c - cosine * s, cosine * c + sine * s);
        let distance = self.distance(sin, cos);
        let slice = Slice {
            sin,
            cos,
            distance,
            height: distance * cosine,
        };
        (slice, cosine)
    }

    /// Returns the line at an azimuth.
    pub(crate) fn at_azimuth(&self, sin: f64, cos: f64) -> Slice {
        Slice {
            sin,
            cos,
            distance: self.distance(sin, cos),
            height: self.rho * (self.rest - one_minus(sin, cos)),
        }
    }

    /// Returns D, computed from ρ − R and the contribution of the azimuth.
    fn distance(&self, sin: f64, cos: f64) -> f64 {
        let (near, r) = (self.rho * self.rest, self.cylinder.radius);
        (near * near + 2.0 * self.rho * r * one_minus(sin, cos)).sqrt()
    }

    /// Returns the solid angle per dα of a part of a line, between two fractions of the cylinder.
    pub(crate) fn solid_angle(&self, slice: &Slice, [from, to]: [f64; 2]) -> f64 {
        let (square, [low, high]) = (slice.distance * slice.distance, self.ends);
        let [a, b] = [from, to].map(|t| low + (high - low) * t);
        let [da, db] = [a, b].map(|height| (square + height * height).sqrt());
        if a * b > 0.0 {
            // This is b/db − a/da without the cancellation.
            square * (b - a) * (a + b) / (da * db * (b * da + a * db))
        } else {
            b / db - a / da
        }
    }

    /// Returns α of a line.
    pub(crate) fn angle_of(&self, slice: &Slice) -> f64 {
        let r = self.cylinder.radius;
        let along = self.rho * self.rest + r * one_minus(slice.sin, slice.cos);
        atan2(r * slice.sin, along)
    }

    /// Returns the line of a slice over the whole length of the cylinder.
    pub(crate) fn line(&self, slice: &Slice) -> Segment {
        let [out, across, _] = self.axes;
        let offset = (out * slice.cos + across * slice.sin) * self.cylinder.radius;
        let Segment { p0, p1 } = self.cylinder.axis;
        Segment::new(p0 + offset, p1 + offset)
    }

    /// Returns the slice of a point on the visible strip, and its fraction along the axis; `None`
    /// if the point is outside the strip by more than 64 ε of its coordinates.
    pub(crate) fn locate(&self, point: DVec3) -> Option<(Slice, f64)> {
        let Cylinder { axis, radius } = self.cylinder;
        let (out, length) = (point - axis.p0, self.ends[1] - self.ends[0]);
        let [c, s, z] = self.axes.map(|a| a.dot(out));
        let slack = 64.0 * f64::EPSILON * (radius + length + point.abs().max_element());
        let r = hypot(c, s);
        let inside = (r - radius).abs() <= slack && z >= -slack && z <= length + slack;
        if !(inside && slack < f64::INFINITY && r > 0.0) {
            return None;
        }
        let slice = self.at_azimuth(s / r, c / r);
        (slice.height > 0.0).then(|| (slice, fraction(z / length)))
    }

    /// Returns the corners, in order, of a rectangle in the outline's plane around the visible
    /// strip as it appears there. It is a little larger, since the ends bulge. An occluder between
    /// the shading point and this rectangle that is not in front of the side is inside the infinite
    /// cylinder.
    #[must_use]
    pub fn outline(&self) -> [DVec3; 4] {
        let ([low, high], r) = (self.reach(), self.cylinder.radius);
        let longer = [low - self.ends[0], high - self.ends[1]];
        self.rectangle(r * self.k, r * self.rim(), longer)
    }

    /// Returns the smallest and the largest height, relative to the shading point, at which the
    /// strip appears on the outline: the height of a point times the factor that moves its line to
    /// the outline, from one for the lines at the rim to 1 + k for the nearest line.
    fn reach(&self) -> [f64; 2] {
        let [low, high] = self.ends;
        let most = 1.0 + self.k;
        [low.min(low * most), high.max(high * most)]
    }

    /// Returns the corners of a rectangle that touches the nearest line and covers the whole
    /// visible strip: an occluder that hides it hides the cylinder.
    #[must_use]
    pub fn front(&self) -> [DVec3; 4] {
        // The factors of heights are one for the nearest line, and 1/(1 + k) for the lines at the
        // rim.
        let ([low, high], least) = (self.ends, (1.0 + self.k).recip());
        let longer = [low.min(low * least) - low, high.max(high * least) - high];
        let r = self.cylinder.radius;
        self.rectangle(r, r * self.rim() * least, longer)
    }

    /// Returns a rectangle at the distance `ahead` in front of the axis, of the half width `half`,
    /// whose ends extend beyond the cylinder's by `longer`.
    fn rectangle(&self, ahead: f64, half: f64, longer: [f64; 2]) -> [DVec3; 4] {
        let [out, across, along] = self.axes;
        // Make it slightly larger, since the rim is rounded.
        let wide = across * (half * (1.0 + 1e-9));
        let more = 1e-9 * (self.ends[1] - self.ends[0]);
        let Segment { p0, p1 } = self.cylinder.axis;
        let low = p0 + out * ahead + along * (longer[0] - more);
        let high = p1 + out * ahead + along * (longer[1] + more);
        [low - wide, low + wide, high + wide, high - wide]
    }

    /// Returns a line parallel to the axis and in front of the outline, projected onto the outline
    /// from the shading point.
    #[must_use]
    pub fn onto_outline(&self, line: &Segment) -> Segment {
        let plane = self.rho * self.rest * (1.0 + self.k);
        let ahead = self.axes[0].dot(self.x - line.p0);
        let seen = |p: DVec3| self.x + (p - self.x) * (plane / ahead);
        Segment::new(seen(line.p0), seen(line.p1))
    }

    /// Whether a triangle does not reach into the space between the side and the outline. Such a
    /// triangle hides the same points of the outline as of the side.
    ///
    /// The space that is tested is larger: everything inside the infinite cylinder that is beyond
    /// the outline's plane and between the heights that are seen on it.
    #[must_use]
    pub fn is_clear_of(&self, corners: [DVec3; 3]) -> bool {
        let [out, across, along] = self.axes;
        let p0 = self.cylinder.axis.p0;
        let local = |p: DVec3| {
            let from = p - p0;
            let height = along.dot(from) + self.ends[0];
            [out.dot(from), across.dot(from), height]
        };
        let [low, high] = self.reach();
        let (r, inner) = (self.cylinder.radius, self.cylinder.radius * self.k);
        // Clip the triangle to that space, and measure its distance from the axis.
        let mut polygon = Clipped::new(corners.map(local));
        polygon.clip(|[c, _, _]| c - inner);
        polygon.clip(|[_, _, z]| z - low);
        polygon.clip(|[_, _, z]| high - z);
        polygon.distance_of_axis() >= r
    }

    /// Returns `∫ ω dΩ` over the visible strip, in sr. A surface with the unit normal n receives
    /// from the cylinder, with radiance one, n times this vector as irradiance, if the whole strip
    /// is above its horizon.
    ///
    /// **Formula**: half of `∮ p × dp/p²` around the strip. The lines at the rim contribute two
    /// angles. The ends, with ζ the end's height and A + B cos φ = ζ² + ρ² + R² − 2ρR cos φ,
    /// contribute the integrals of 1 and of cos φ over this, which are an arc tangent and, where
    /// |B| < A/8, a series. **Error**: some ε times 1 + d/l, with d the distance and l the
    /// cylinder's length.
    #[must_use]
    pub fn vector_irradiance(&self) -> DVec3 {
        let (r, rho) = (self.cylinder.radius, self.rho);
        let [low, high] = self.ends;
        let half = self.half_turn();
        let end = |height: f64| {
            let [flat, cosine] = self.around_end(height, half);
            [height * r * cosine, r * (r * flat - rho * cosine)]
        };
        let ([e0, a0], [e1, a1]) = (end(low), end(high));
        let side = rho * self.rim();
        let turn = atan2(side * (high - low), side * side + low * high);
        let towards = e1 - e0 + 2.0 * self.k * turn;
        let [out, _, along] = self.axes;
        let sum = out * (-0.5 * towards) + along * (0.5 * (a1 - a0));
        if sum.is_finite() { sum } else { DVec3::ZERO }
    }

    /// Returns the integrals of 1 and of cos φ over the squared distance of an end's circle, along
    /// its visible part.
    fn around_end(&self, height: f64, half: f64) -> [f64; 2] {
        let (r, rho) = (self.cylinder.radius, self.rho);
        let near = hypot(height, rho * self.rest);
        let far = hypot(height, rho + r);
        let a = height * height + rho * rho + r * r;
        let flat = 4.0 / (near * far) * atan(tan(0.5 * half) * (far / near));
        let ratio = 2.0 * rho * r / a;
        let cosine = if ratio > 0.125 {
            (a * flat - 2.0 * half) / (2.0 * rho * r)
        } else {
            powers_of_cosine(half, ratio) / a
        };
        [flat, cosine]
    }
}

/// Returns 1 − cos φ with a small relative error.
fn one_minus(sin: f64, cos: f64) -> f64 {
    if cos > 0.0 {
        sin * sin / (1.0 + cos)
    } else {
        1.0 - cos
    }
}

/// Returns ∫ cos φ/(1 − q cos φ) dφ between −h and h, for q ≤ 1/8, as Σ qⁿ ∫ cosⁿ⁺¹ φ dφ.
fn powers_of_cosine(h: f64, q: f64) -> f64 {
    let (s, c) = sin_cos(h);
    // Keep the integrals of the two previous powers, and cosⁿ⁻¹ h.
    let (mut before, mut last, mut power) = (2.0 * h, 2.0 * s, 1.0);
    let (mut sum, mut factor) = (last, 1.0);
    for n in 2..20_i32 {
        power *= c;
        let n = f64::from(n);
        let next = (2.0 * power * s + (n - 1.0) * before) / n;
        (before, last) = (last, next);
        factor *= q;
        sum += factor * last;
    }
    sum
}

/// A triangle after some clips, in the coordinates out, across and along.
struct Clipped {
    corners: [[f64; 3]; 6],
    count: usize,
}

impl Clipped {
    fn new([a, b, c]: [[f64; 3]; 3]) -> Self {
        let nothing = [0.0; 3];
        Self {
            corners: [a, b, c, nothing, nothing, nothing],
            count: 3,
        }
    }

    /// Clips to the half space where `side` is positive; each clip adds at most one corner.
    fn clip(&mut self, side: impl Fn([f64; 3]) -> f64) {
        let (old, count) = (self.corners, self.count);
        self.count = 0;
        let mut push = |p: [f64; 3]| {
            if let Some(slot) = self.corners.get_mut(self.count) {
                *slot = p;
                self.count += 1;
            }
        };
        for i in 0..count {
            let (p, q) = (old[i], old[(i + 1) % count]);
            let (here, there) = (side(p), side(q));
            if here >= 0.0 {
                push(p);
            }
            if (here >= 0.0) != (there >= 0.0) {
                let t = here / (here - there);
                push(between(p, q, t));
            }
        }
    }

    /// Returns the distance of the axis from the polygon, in the plane perpendicular to the axis;
    /// infinite for an empty polygon.
    fn distance_of_axis(&self) -> f64 {
        let corners = &self.corners[..self.count];
        let mut least = f64::INFINITY;
        let (mut left, mut right) = (true, true);
        for (i, p) in corners.iter().enumerate() {
            let q = corners[(i + 1) % self.count];
            let edge = [q[0] - p[0], q[1] - p[1]];
            let square = edge[0] * edge[0] + edge[1] * edge[1];
            let t = -(p[0] * edge[0] + p[1] * edge[1]) / square;
            let t = fraction(t);
            least = least.min(hypot(p[0] + edge[0] * t, p[1] + edge[1] * t));
            let turn = p[0] * q[1] - p[1] * q[0];
            left &= turn > 0.0;
            right &= turn < 0.0;
        }
        if self.count > 2 && (left || right) {
            0.0
        } else {
            least
        }
    }
}

/// Returns the point at a fraction of the way from `p` to `q`.
fn between(p: [f64; 3], q: [f64; 3], t: f64) -> [f64; 3] {
    core::array::from_fn(|k| p[k] + (q[k] - p[k]) * t)
}

/// Samples the side of a cylinder uniformly by area: the whole side, or the visible strip.
///
/// The density is 1/(2πR l), or 1/(2φR l) with φ the azimuth of the rim
/// ([`CylinderView::half_turn`]). From inside the infinite cylinder [`CylinderArea::visible`] is
/// the whole side. `invert` returns `None` for points that are outside the sampled part by more
/// than 64 ε of their coordinates.
///
/// ```
/// use linelit_lights::geometry::{DVec3, Segment};
/// use linelit_lights::{Cylinder, CylinderArea, PointTechnique};
/// let tube = Cylinder { axis: Segment::new(DVec3::ZERO, DVec3::Z), radius: 0.5 };
/// let by_area = CylinderArea::visible(&tube, DVec3::X);
/// let u = by_area.invert(by_area.sample([0.2, 0.9]).point).unwrap();
/// assert!((u[0] - 0.2).abs() < 1e-15 && (u[1] - 0.9).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct CylinderArea {
    cylinder: Cylinder,
    /// Two unit vectors across the axis; azimuths are measured from the first.
    axes: [DVec3; 2],
    /// The largest azimuth that is sampled.
    half: f64,
    density: Pdf<Area>,
}

impl CylinderArea {
    /// Samples the whole side.
    #[must_use]
    pub fn whole(cylinder: &Cylinder) -> Self {
        let frame = Frame::from_normal(cylinder.axis.direction());
        Self::new(cylinder, [frame.x, frame.y], PI)
    }

    /// Samples the strip that `x` sees.
    #[must_use]
    pub fn visible(cylinder: &Cylinder, x: DVec3) -> Self {
        match CylinderView::new(cylinder, x) {
            Some(view) => {
                let [out, across, _] = view.axes;
                Self::new(cylinder, [out, across], view.half_turn())
            }
            None => Self::whole(cylinder),
        }
    }

    fn new(cylinder: &Cylinder, axes: [DVec3; 2], half: f64) -> Self {
        Self {
            cylinder: *cylinder,
            axes,
            half,
            density: Pdf::new(PI / (half * cylinder.area())),
        }
    }

    /// Returns the random numbers of a point; `None` outside the sampled part.
    fn locate(&self, point: DVec3) -> Option<[f64; 2]> {
        let Cylinder { axis, radius } = self.cylinder;
        let (out, length) = (point - axis.p0, axis.length());
        let [c, s] = self.axes.map(|a| a.dot(out));
        let (r, z) = (hypot(c, s), axis.direction().dot(out));
        let slack = 64.0 * f64::EPSILON * (radius + length + point.abs().max_element());
        let turn = atan2(s, c);
        let inside = (r - radius).abs() <= slack
            && (z >= -slack && z <= length + slack)
            && turn.abs() <= self.half + slack / radius;
        let u = [0.5 + 0.5 * turn / self.half, z / length];
        (inside && slack < f64::INFINITY).then(|| u.map(below_one))
    }
}

impl PointTechnique for CylinderArea {
    type Measure = Area;

    #[inline]
    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let [around, along] = u.map(fraction);
        let (s, c) = sin_cos(self.half * (2.0 * around - 1.0));
        let [out, across] = self.axes;
        let offset = (out * c + across * s) * self.cylinder.radius;
        PointSample::at(self.cylinder.axis.at(along) + offset, self.density)
    }

    fn pdf(&self, point: DVec3) -> Pdf<Area> {
        // All azimuths belong to the whole side, on which the point is assumed to lie.
        match self.half < PI && self.locate(point).is_none() {
            true => Pdf::ZERO,
            false => self.density,
        }
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let found = self.locate(point)?;
        self.density.is_positive().then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::quadrature::gauss_kronrod;

    /// Both forms of the integrals around an end, near where they change and far from it.
    #[test]
    fn integrals_around_an_end_are_what_quadrature_says() {
        for (rho, radius, height) in [
            (1.0, 0.9, 0.0),
            (1.0, 0.999, 1e-3),
            (2.0, 0.13, 0.1),
            (2.0, 0.124, 0.1),
            (2.0, 1e-3, 0.7),
            (1.0, 0.5, 4.0),
            (1.0, 0.5, 100.0),
        ] {
            let axis = Segment::new(DVec3::new(rho, 0.0, height), DVec3::new(rho, 0.0, 200.0));
            let view = CylinderView::new(&Cylinder { axis, radius }, DVec3::ZERO).expect("outside");
            let half = view.half_turn();
            let over = |turn: f64| {
                let near = height * height + (rho - radius).powi(2);
                near + 4.0 * rho * radius * (0.5 * turn).sin().powi(2)
            };
            let found = view.around_end(height, half);
            let flat = gauss_kronrod(|t| over(t).recip(), -half, half, 1e-14).value;
            let cosine = gauss_kronrod(|t| t.cos() / over(t), -half, half, 1e-14).value;
            for (got, want) in found.iter().zip([flat, cosine]) {
                // A few ε, and eight times that where the closed form is left: 1/q.
                assert!(
                    (got / want - 1.0).abs() < 200.0 * f64::EPSILON,
                    "{rho} {radius} {height}: {got} {want}"
                );
            }
        }
    }
}
