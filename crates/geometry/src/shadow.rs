//! Shadow triangles: which part of a line sample a triangle blocks.

use crate::{DVec3, Segment, intervals::Interval, predicates};
use core::ops::Range;

/// The margins at the ends of the way from a point to a light in which occluders hide nothing.
///
/// Both are fractions of the way, in [0, 1). The defaults forgive what rounded files contain: a
/// lamp in the plane of a ceiling, a point on a surface. [`Margins::ROUNDING`] forgives the
/// rounding of `f64` alone, for lights whose own triangles are excluded by their numbers: what
/// touches such a light hides it up to where it touches. Zero, for callers whose occluders and
/// lights share their vertices, leaves the decision to the side of the light's plane on which a
/// vertex lies; what lies in that plane hides nothing.
///
/// ```
/// use linelit_geometry::Margins;
/// assert_eq!(Margins::default().near(10.0, 2.0), 1e-10);
/// assert_eq!(Margins::NONE.near(10.0, 2.0), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Up to this fraction of the way an occluder hides nothing; towards a light that is far beyond
    /// all occluders, up to a smaller one ([`Margins::near`]).
    pub point: f64,
    /// The last fraction of the way, before the light, in which an occluder hides nothing; and a
    /// point that is nearer to the plane of a flat light than this fraction of the way, or of the
    /// light's size, lies in that plane and receives nothing.
    pub light: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Margins {
    /// 10⁻¹⁰ near the point and 10⁻⁶ near the light: neither `f32` geometry nor a light mounted
    /// flush in a ceiling can be told apart closer than the latter.
    pub const DEFAULT: Self = Self {
        point: 1e-10,
        light: 1e-6,
    };

    /// 10⁻¹⁰ at either end: the rounding of `f64`, where a light is seen from a ten-thousandth of
    /// its distance above its plane.
    pub const ROUNDING: Self = Self {
        point: 1e-10,
        light: 1e-10,
    };

    /// No margins.
    pub const NONE: Self = Self {
        point: 0.0,
        light: 0.0,
    };

    /// The margins that suit a light whose own triangles have the numbers `own` among the
    /// occluders, and so are excluded from its shadows: [`Margins::ROUNDING`]. If `own` is empty,
    /// it is [`Margins::DEFAULT`], which lets light past the light's own triangles where these are
    /// among the occluders and nobody has said which they are.
    #[must_use]
    pub const fn excluding(own: &Range<u32>) -> Self {
        if own.start < own.end {
            Self::ROUNDING
        } else {
            Self::DEFAULT
        }
    }

    /// The fraction of the way to a light `distance` away from which on occluders hide it, where
    /// lights beyond `reach` are far from all occluders: `point · min(1, reach ÷ distance)`.
    ///
    /// Rounding of the occluders' places grows with their distance, not with the way to a light far
    /// beyond them, which a fixed fraction would let shine through what is near.
    #[inline]
    #[must_use]
    pub fn near(&self, reach: f64, distance: f64) -> f64 {
        let share = reach / distance;
        // Not a number, as from two infinities, counts as a light within the scene.
        if share < 1.0 {
            self.point * share.max(0.0)
        } else {
            self.point
        }
    }

    /// The fraction of the way up to which occluders hide the light: `1 − light`.
    #[inline]
    #[must_use]
    pub const fn end(&self) -> f64 {
        1.0 - self.light
    }
}

/// Coordinates of a point in the frame of a shadow triangle.
///
/// `sigma` has the sign of the side of the shadow triangle's plane; the foot of the point is
/// `lam0·p0 + lam1·p1` relative to the shading point, for the ends p0, p1 of the line. The depth
/// `lam0 + lam1` is 0 at the shading point and 1 at the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowCoords {
    /// Signed volume: side of the plane.
    pub sigma: f64,
    /// Barycentric coordinate of p0.
    pub lam0: f64,
    /// Barycentric coordinate of p1.
    pub lam1: f64,
}

/// The triangle between a shading point and a line sample.
///
/// Whatever cuts it is projected back from the shading point onto the line. The coordinates of a
/// vertex depend on that vertex and the line alone, and a crossing is computed by an expression
/// that is the same to the bit whichever way round its edge is run through: two triangles that
/// share an edge leave no gap.
///
/// **Source**: Billen & Dutré 2016, section 5.2 and Fig. 4.
#[derive(Clone, Copy, Debug)]
pub struct ShadowTriangle {
    point: DVec3,
    normal: DVec3,
    dual0: DVec3,
    dual1: DVec3,
    /// The depths between which triangles hide the line.
    depths: [f64; 2],
}

impl ShadowTriangle {
    /// The shadow triangle between the shading point and `line`; `None` where it has no area (the
    /// line has no length, or points at the shading point): such a line has measure zero. Also
    /// where the square of its area is no normal number, below 1e-308 or beyond 1e308.
    #[must_use]
    pub fn new(point: DVec3, line: &Segment) -> Option<Self> {
        let Segment { p0, p1 } = line.relative_to(point);
        let normal = predicates::cross(p0, p1);
        let square = normal.length_squared();
        if !square.is_normal() {
            return None;
        }
        Some(Self {
            point,
            normal,
            dual0: p1.cross(normal) / square,
            dual1: normal.cross(p0) / square,
            depths: [Margins::DEFAULT.point, Margins::DEFAULT.end()],
        })
    }

    /// Sets other [`Margins`] than the default, where lights beyond `reach` are far from all
    /// occluders (infinity, where that is not known).
    #[must_use]
    pub fn with_margins(self, margins: Margins, reach: f64) -> Self {
        // 1 ÷ the distance of the line: the length of the gradient of the depth.
        let gradient = (self.dual0 + self.dual1).length();
        Self {
            depths: [margins.near(reach, 1.0 / gradient), margins.end()],
            ..self
        }
    }

    /// Coordinates of a point.
    #[inline]
    #[must_use]
    pub fn vertex(&self, p: DVec3) -> ShadowCoords {
        let a = p - self.point;
        ShadowCoords {
            sigma: self.normal.dot(a),
            lam0: self.dual0.dot(a),
            lam1: self.dual1.dot(a),
        }
    }

    /// The part of the line that the triangle hides, as parameters of the line; `None` for none.
    #[must_use]
    pub fn blocked_by(&self, triangle: &[DVec3; 3]) -> Option<Interval> {
        self.blocked(&triangle.map(|p| self.vertex(p)))
    }

    /// [`ShadowTriangle::blocked_by`] from the coordinates of the triangle's vertices.
    ///
    /// A side of exactly zero counts as above, so a triangle in the plane of the shadow triangle
    /// hides nothing: right for almost every line, and its neighbours cover for it.
    #[must_use]
    pub fn blocked(&self, c: &[ShadowCoords; 3]) -> Option<Interval> {
        Some(self.chord(c)?.hidden())
    }

    /// Returns the chord of the shadow triangle in the triangle with these corners, if it hides a
    /// part of the line: [`Chord::hidden`] is that of [`ShadowTriangle::blocked`], to the bit.
    #[must_use]
    #[inline]
    pub fn chord(&self, c: &[ShadowCoords; 3]) -> Option<Chord> {
        let above = c.map(|v| v.sigma >= 0.0);
        // The lone vertex on its side; the two edges that leave it cross the plane.
        let (lone, j, k) = match above {
            [a, b, d] if a == b && b == d => return None,
            [a, b, d] if a != b && a != d => (0, 1, 2),
            [a, b, _] if a != b => (1, 2, 0),
            _ => (2, 0, 1),
        };
        let ends = [j, k].map(|far| Crossing::of([&c[lone], &c[far]], [lone, far]));
        clip_chord(ends, self.depths)
    }
}

/// The straight cut of a triangle and a [`ShadowTriangle`]: the part of it that hides something of
/// the line. Places on it are numbers from 0 at one end to 1 at the other.
#[derive(Clone, Copy, Debug)]
pub struct Chord([Crossing; 2]);

impl Chord {
    /// Returns its ends on the triangle: barycentric coordinates of the second and third corner.
    /// Each is rounded by a few ε, divided by the sine of the angle at which the edge that the end
    /// is on crosses the plane of the shadow triangle.
    #[must_use]
    pub fn ends(&self) -> [[f64; 2]; 2] {
        self.0.each_ref().map(|end| end.place)
    }

    /// The parameter of the line at whose point a place of the cut stands: projective in `s`, and
    /// monotone. Depths are interpolated, not found from the triangle's plane, so that it is as
    /// good for one that is seen edge on: a few ε over the depth of the nearer end, as for the
    /// interval.
    #[must_use]
    #[inline]
    pub fn t(&self, s: f64) -> f64 {
        let [a, b] = &self.0;
        let mix = |x: f64, y: f64| x * (1.0 - s) + y * s;
        let (lam0, lam1) = (mix(a.lam0, b.lam0), mix(a.lam1, b.lam1));
        (lam1 / (lam0 + lam1)).clamp(0.0, 1.0)
    }

    /// The part of the line behind all of it.
    #[must_use]
    #[inline]
    pub fn hidden(&self) -> Interval {
        let (t0, t1) = (self.0[0].t().clamp(0.0, 1.0), self.0[1].t().clamp(0.0, 1.0));
        let (lo, hi) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
        Interval { lo, hi }
    }
}

/// The crossing of an edge with the plane of the shadow triangle.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    lam0: f64,
    lam1: f64,
    /// Barycentric coordinates of the second and third corner.
    place: [f64; 2],
}

impl Crossing {
    /// Computes the crossing between corners i and j of these numbers, with the same bits for (i,
    /// j) and (j, i): numerator and denominator both change sign.
    #[inline]
    fn of([i, j]: [&ShadowCoords; 2], corners: [usize; 2]) -> Self {
        let d = j.sigma - i.sigma;
        let mut place = [0.0; 3];
        place[corners[0]] = j.sigma / d;
        place[corners[1]] = -i.sigma / d;
        Self {
            lam0: (i.lam0 * j.sigma - j.lam0 * i.sigma) / d,
            lam1: (i.lam1 * j.sigma - j.lam1 * i.sigma) / d,
            place: [place[1], place[2]],
        }
    }

    fn depth(&self) -> f64 {
        self.lam0 + self.lam1
    }

    /// Back-projection onto the line.
    fn t(&self) -> f64 {
        self.lam1 / self.depth()
    }

    /// The point where `f` vanishes between two points on either side of it.
    fn between(a: &Self, fa: f64, b: &Self, fb: f64) -> Self {
        let d = fb - fa;
        let mix = |a: f64, b: f64| (a * fb - b * fa) / d;
        Self {
            lam0: mix(a.lam0, b.lam0),
            lam1: mix(a.lam1, b.lam1),
            place: [0, 1].map(|k| mix(a.place[k], b.place[k])),
        }
    }
}

/// Clips the chord to the shadow triangle and projects its ends back onto the line. The sides
/// come first, so that no point behind the shading point reaches the projection.
fn clip_chord([mut a, mut b]: [Crossing; 2], [near, end]: [f64; 2]) -> Option<Chord> {
    clip_end(&mut a, &mut b, |c| c.lam0, |c| Crossing { lam0: 0.0, ..c })?;
    clip_end(&mut a, &mut b, |c| c.lam1, |c| Crossing { lam1: 0.0, ..c })?;
    clip_end(&mut a, &mut b, |c| c.depth() - near, |c| c)?;
    clip_end(&mut a, &mut b, |c| end - c.depth(), |c| c)?;
    let chord = Chord([a, b]);
    let hidden = chord.hidden();
    (hidden.lo < hidden.hi).then_some(chord)
}

/// Moves the end with `f < 0` to where `f = 0` (made exact by `snap`); `None` if both are out.
#[inline]
fn clip_end(
    a: &mut Crossing,
    b: &mut Crossing,
    f: impl Fn(&Crossing) -> f64,
    snap: impl Fn(Crossing) -> Crossing,
) -> Option<()> {
    let (fa, fb) = (f(a), f(b));
    match (fa >= 0.0, fb >= 0.0) {
        (true, true) => {}
        (true, false) => *b = snap(Crossing::between(a, fa, b, fb)),
        (false, true) => *a = snap(Crossing::between(a, fa, b, fb)),
        (false, false) => return None,
    }
    Some(())
}
