//! Shadow triangles: which part of a line sample an occluding triangle blocks, as seen from a
//! shading point; and the margins in which occluders are ignored.

use crate::{DVec3, Segment, intervals::Interval, predicates};
use core::ops::Range;

/// The margins at both ends of the segment from a shading point to a point of a light, within which
/// occluders hide nothing.
///
/// Both margins are fractions of the segment, in [0, 1). The defaults tolerate the rounding of
/// coordinates in files, such as of a lamp in the plane of a ceiling, or a shading point on a
/// surface. [`Margins::ROUNDING`] only tolerates the rounding of `f64`, for lights whose own
/// triangles are excluded by index: other geometry that touches such a light hides it up to where
/// it touches. [`Margins::NONE`] is for callers whose occluders and lights share their vertices:
/// then the side of the light's plane on which a vertex lies decides, and geometry in that plane
/// hides nothing.
///
/// ```
/// use linelit_geometry::Margins;
/// assert_eq!(Margins::default().near(10.0, 2.0), 1e-10);
/// assert_eq!(Margins::NONE.near(10.0, 2.0), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Up to this fraction of the way, an occluder hides nothing; towards a light that is far
    /// beyond all occluders, up to a smaller fraction ([`Margins::near`]).
    pub point: f64,
    /// In this last fraction of the way, before the light, an occluder hides nothing. Also, a point
    /// that is closer to the plane of a flat light than this fraction of the way, or of the light's
    /// size, counts as in that plane and receives no light.
    pub light: f64,
}

impl Default for Margins {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Margins {
    /// 10⁻¹⁰ near the point and 10⁻⁶ near the light: distances below the latter cannot be resolved
    /// by `f32` geometry, or for a light mounted flush in a ceiling.
    pub const DEFAULT: Self = Self {
        point: 1e-10,
        light: 1e-6,
    };

    /// 10⁻¹⁰ at either end: the rounding of `f64` for a light seen from a ten-thousandth of its
    /// distance above its plane.
    pub const ROUNDING: Self = Self {
        point: 1e-10,
        light: 1e-10,
    };

    /// No margins.
    pub const NONE: Self = Self {
        point: 0.0,
        light: 0.0,
    };

    /// Returns the margins for a light whose own triangles have the indices `own` among the
    /// occluders, and are excluded from its shadows: [`Margins::ROUNDING`]. If `own` is empty,
    /// returns [`Margins::DEFAULT`], which ignore the light's own triangles if these are among the
    /// occluders but have not been named.
    #[must_use]
    pub const fn excluding(own: &Range<u32>) -> Self {
        if own.start < own.end {
            Self::ROUNDING
        } else {
            Self::DEFAULT
        }
    }

    /// Returns the fraction of the way to a light, at the distance `distance`, beyond which
    /// occluders hide the light: `point · min(1, reach ÷ distance)`. Lights beyond `reach` are far
    /// from all occluders.
    ///
    /// The rounding errors of occluders' positions grow with the distance of the occluders, and not
    /// with the way to a light far beyond them; a fixed fraction of that way would let the light
    /// shine through occluders near the point.
    #[inline]
    #[must_use]
    pub fn near(&self, reach: f64, distance: f64) -> f64 {
        let share = reach / distance;
        // A quotient that is not a number, as of two infinities, counts as a light within reach.
        if share < 1.0 {
            self.point * share.max(0.0)
        } else {
            self.point
        }
    }

    /// Returns the fraction of the way up to which occluders hide the light: `1 − light`.
    #[inline]
    #[must_use]
    pub const fn end(&self) -> f64 {
        1.0 - self.light
    }
}

/// The coordinates of a point in the frame of a shadow triangle.
///
/// The sign of `sigma` says on which side of the shadow triangle's plane the point is. The foot of
/// the perpendicular from the point to that plane is `lam0·p0 + lam1·p1` relative to the shading
/// point, for the ends p0, p1 of the line. The depth `lam0 + lam1` is 0 at the shading point and 1
/// at the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowCoords {
    /// The signed volume of the point with the shadow triangle, up to a common factor; its sign
    /// says on which side of the triangle's plane the point is.
    pub sigma: f64,
    /// The barycentric coordinate of p0.
    pub lam0: f64,
    /// The barycentric coordinate of p1.
    pub lam1: f64,
}

/// The triangle between a shading point and a line sample.
///
/// ```text
///     p0 ━━━━━━━━━━━━━━━ p1     the line sample
///       ╲    ╱───╲      ╱       a chord, where an occluder cuts the shadow triangle;
///         ╲            ╱        the interval that it hides is its projection from the
///             ╲     ╱           shading point onto the line
///                ●
/// ```
///
/// Every occluder that cuts the shadow triangle is projected from the shading point onto the line.
/// The coordinates of a vertex depend on that vertex and the line alone, and a crossing is computed
/// by an expression that has the same bits in either direction of the edge: so two triangles that
/// share an edge leave no gap.
///
/// **Source**: Billen & Dutré 2016, section 5.2 and Fig. 4.
#[derive(Clone, Copy, Debug)]
pub struct ShadowTriangle {
    point: DVec3,
    normal: DVec3,
    dual0: DVec3,
    dual1: DVec3,
    /// The depths [near, end] between which occluders hide the line; see [`ShadowCoords`].
    depths: [f64; 2],
}

impl ShadowTriangle {
    /// Creates the shadow triangle between the shading point and `line`; `None` if it has no area
    /// (the line has no length, or points at the shading point; such lines have measure zero), or
    /// if the square of its area is not a normal number, below 1e-308 or beyond 1e308.
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

    /// Sets [`Margins`] other than the default. Lights beyond `reach` are far from all occluders;
    /// use infinity if that is not known.
    #[must_use]
    pub fn with_margins(self, margins: Margins, reach: f64) -> Self {
        // The reciprocal of the line's distance is the length of the gradient of the depth.
        let gradient = (self.dual0 + self.dual1).length();
        Self {
            depths: [margins.near(reach, 1.0 / gradient), margins.end()],
            ..self
        }
    }

    /// Returns the coordinates of a point in the frame of the shadow triangle.
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

    /// Returns the part of the line that a triangle hides, as an interval of line parameters;
    /// `None` if the triangle hides no part.
    #[must_use]
    pub fn blocked_by(&self, triangle: &[DVec3; 3]) -> Option<Interval> {
        self.blocked(&triangle.map(|p| self.vertex(p)))
    }

    /// Computes [`ShadowTriangle::blocked_by`] from the coordinates of the triangle's vertices.
    ///
    /// A vertex that is exactly in the plane counts as above it, so a triangle in the plane of the
    /// shadow triangle hides nothing. This is right for almost every line, and the triangle's
    /// neighbours hide what it should.
    #[must_use]
    pub fn blocked(&self, c: &[ShadowCoords; 3]) -> Option<Interval> {
        Some(self.chord(c)?.hidden())
    }

    /// Finds the chord in which a triangle, given by the coordinates of its corners, cuts the
    /// shadow triangle; `None` if the triangle hides no part of the line. [`Chord::hidden`] is
    /// exactly the interval that [`ShadowTriangle::blocked`] returns.
    #[must_use]
    #[inline]
    pub fn chord(&self, c: &[ShadowCoords; 3]) -> Option<Chord> {
        let above = c.map(|v| v.sigma >= 0.0);
        // Find the vertex that is alone on its side; the two edges that leave it cross the plane.
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

/// The straight cut of a triangle with a [`ShadowTriangle`]: the part of the triangle that hides
/// something of the line. Points on it are given by a parameter from 0 at one end to 1 at the
/// other.
#[derive(Clone, Copy, Debug)]
pub struct Chord([Crossing; 2]);

impl Chord {
    /// Returns the ends of the chord on the occluding triangle, as barycentric coordinates of its
    /// second and third corner. Their error is a few ε, divided by the sine of the angle at which
    /// the edge with that end crosses the plane of the shadow triangle.
    #[must_use]
    pub fn ends(&self) -> [[f64; 2]; 2] {
        self.0.each_ref().map(|end| end.place)
    }

    /// Returns the parameter of the line at the projection of the point `s` of the chord, which is
    /// a projective and monotone function of `s`. Depths are interpolated and not computed from the
    /// triangle's plane, so that the result is as precise for triangles seen edge on: the error is
    /// a few ε over the depth of the nearer end, as for the interval.
    #[must_use]
    #[inline]
    pub fn t(&self, s: f64) -> f64 {
        let [a, b] = &self.0;
        let mix = |x: f64, y: f64| x * (1.0 - s) + y * s;
        let (lam0, lam1) = (mix(a.lam0, b.lam0), mix(a.lam1, b.lam1));
        (lam1 / (lam0 + lam1)).clamp(0.0, 1.0)
    }

    /// Returns the interval of the line that is behind the chord.
    #[must_use]
    #[inline]
    pub fn hidden(&self) -> Interval {
        let (t0, t1) = (self.0[0].t().clamp(0.0, 1.0), self.0[1].t().clamp(0.0, 1.0));
        let (lo, hi) = if t0 <= t1 { (t0, t1) } else { (t1, t0) };
        Interval { lo, hi }
    }
}

/// The crossing of a triangle's edge with the plane of the shadow triangle.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    lam0: f64,
    lam1: f64,
    /// The barycentric coordinates of the triangle's second and third corner at the crossing.
    place: [f64; 2],
}

impl Crossing {
    /// Computes the crossing of the edge between two corners i and j, whose indices are `corners`.
    /// The bits are the same for (i, j) and (j, i), since numerator and denominator both change
    /// their signs.
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

    /// The parameter of the projection onto the line.
    fn t(&self) -> f64 {
        self.lam1 / self.depth()
    }

    /// Returns the point where a linear function is zero, between two points at which it has the
    /// values `fa` and `fb` of opposite signs.
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

/// Clips the chord to the shadow triangle, if any of it is inside and hides a part of the line. The
/// sides come first, so that no point behind the shading point is ever projected.
fn clip_chord([mut a, mut b]: [Crossing; 2], [near, end]: [f64; 2]) -> Option<Chord> {
    clip_end(&mut a, &mut b, |c| c.lam0, |c| Crossing { lam0: 0.0, ..c })?;
    clip_end(&mut a, &mut b, |c| c.lam1, |c| Crossing { lam1: 0.0, ..c })?;
    clip_end(&mut a, &mut b, |c| c.depth() - near, |c| c)?;
    clip_end(&mut a, &mut b, |c| end - c.depth(), |c| c)?;
    let chord = Chord([a, b]);
    let hidden = chord.hidden();
    (hidden.lo < hidden.hi).then_some(chord)
}

/// Moves an end of the chord where the function `f` is negative to the point where `f = 0`, which
/// `snap` makes exact; `None` if both ends are outside.
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
