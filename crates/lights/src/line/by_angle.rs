//! This module samples lines in proportion to the solid angle, or the projected solid angle, of
//! their neighbourhood, for any convex polygon and any direction of the lines.
//!
//! Salesin & Jarosz 2019 (§3.3, eqs. 16–19) sample the solid angle of *rectangles* along lines
//! parallel to an edge, by Ureña's spherical rectangle, and leave other shapes and directions as
//! future work. Here the light's plane is at the distance z, lines run along y, and their offsets
//! are u = z tan ψ. A line spans η = sin φ from η₀ to η₁, and `dΩ = dη dψ`. The marginal density of
//! the offset is `(η₁ − η₀) z/(z² + u²)/Ω` for any shape, and its CDF is the solid angle of the
//! part of the light before the line:
//!
//! ```text
//!       ╱│╲ ← line at u      CDF(u) = Ω(part left of the line)/Ω
//!     ╱  │  ╲
//!   ╱────┼────╲──            pieces lie between the lines through neighbouring vertices
//!   └────┴─────┴──► u
//! ```
//!
//! On a rectangle with lines along an edge the inverse of the CDF is a closed form, for any size
//! and distance ([`crate::line::rectangle`]). On other shapes the CDF over a trapezoid between two
//! vertices is the sum of two spherical triangles, in which nothing cancels. It is inverted by
//! Newton's method in ψ within a bracket, which takes some 2.5 times as long.
//!
//! With the cosine at the receiver the same holds for the projected solid angle: the marginal is z
//! times the ribbon integral of the line, the CDF is Lambert's irradiance of the part, and the
//! point along the line comes from [`crate::linear::ProjectedLine`]. This also makes a
//! projected-solid-angle sampler for polygons (the task of Peters 2021, "BRDF importance sampling
//! for polygonal lights"), accurate relative to the light for lights of any size.

mod close;

use crate::LineTechnique;
use crate::density::{Offset, Pdf, SolidAngle};
use crate::line::by_length::{is_visible, locate, within};
use crate::line::piece::{Angles, Line, Piece, Warp};
use crate::line::rectangle::Rectangle;
use crate::line::trapezoid::Trapezoid;
use crate::linear::{LineView, ProjectedLine, ThinLine};
use crate::pieces::{Pieces, sample_linear};
use crate::samples::{LineSample, PointSample};
use linelit_elementary::hypot;
use linelit_geometry::finite::{BELOW_ONE, below_one, fraction};
use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, predicates};

/// If the distance of the light's plane from the shading point is less than this fraction of the
/// distance to the light's farthest point, the lines are [`linelit_geometry::CloseLines`]. The
/// light's normal, rounded to ε, would otherwise change the distance of the plane, and with it the
/// measure, by 1e-12, and rounded corners would move an edge near the foot of the perpendicular
/// from the shading point.
const NEAR: f64 = 1e-3;
/// The largest distance for close lines, relative to the light's size. Twice the working precision
/// resolves such a distance to ε of a light that is ε times as wide as it is long.
const FAR: f64 = 1e4;
/// After a step of Newton's method below this fraction of the interval between two knots, the next
/// step would be below the rounding of the result, and the iteration ends.
const LAST_STEP: f64 = 2e-9;
/// If the distance of the light's plane from the shading point is less than this fraction of the
/// distance to the light's farthest point, offsets follow the plain solid angle. The corners of the
/// part above the horizon are rounded to ε of their size, and their directions close to the foot of
/// the perpendicular from the shading point have less than seven digits.
const NEAREST: f64 = 1e-9;
/// The relative margin below the horizon that is added to the light if the plane is nearer than
/// [`NEAREST`]: a few roundings of a corner.
const MORE: f64 = 16.0 * f64::EPSILON;
/// If the ratio of the largest to the smallest distance of a piece's lines from the shading point
/// is larger than this, offsets are found by Newton's method in the offset: angles would lose three
/// digits.
const WIDE: f64 = 1e3;
/// The spacing of random numbers, 2⁻⁵³.
const HALF_ULP: f64 = 0.5 * f64::EPSILON;
/// The largest number of Newton steps in offsets, which may have to halve the bracket down to
/// rounding.
const MOST_HALVINGS: u32 = 128;
/// The largest number of Newton steps in angles; the bracket halves at least every second step.
const MOST_STEPS: u32 = 64;

/// Parallel lines on a convex polygon with offsets proportional to solid angle or projected solid
/// angle, and points on them.
///
/// A point is drawn in two steps: [`AngularLines::sample`] draws the line, and
/// [`AngularLines::point`] a point of its visible part, uniform in the same measure. The joint
/// density of eq. 19, `p = S/(Ω Σ_visible Δη)` per solid angle, is [`AngularLines::joint_pdf`].
/// Without occluders it is 1/Ω, or (n·ω)/E for the projected measure, so that a diffuse receiver
/// has zero variance.
///
/// **Domain**: any shading point. In the light's plane every density is 0, and also if the angle is
/// not finite. Lines run at `angle_rad` from the polygon's first edge.
///
/// **Error** of the inversion: 4 ε of the piece's measure by Newton's method, some 64 ε of the
/// whole in closed form, unless grazing incidence limits the CDF itself. The projected measure has
/// the error 1e-12 also near the light's plane, down to 1e-9 of the distance r to the light's
/// farthest point, where edges or the horizon pass through the foot or leave a corner: there lines
/// are [`linelit_geometry::CloseLines`]. Where the horizon leaves a sliver of the width δ and the
/// length r, the error is ε r²/δ². If the shading point touches the light (nearer than 1e-14 r,
/// with the foot inside), f64 has no points in the directions that matter, and only the order of
/// magnitude of the projected measure is known. `docs/accuracy-lights.md` has the figures.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3, intervals::Interval};
/// use linelit_lights::{AngularLines, LineTechnique};
/// let light = ConvexPolygon::triangle(
///     DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.5, 2.0), DVec3::new(0.0, 1.0, 2.0)).unwrap();
/// let (x, n) = (DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8));
/// let lines = AngularLines::by_projected_solid_angle(&light, 0.7, x, n);
/// let line = lines.sample(0.3);
/// // An occluder hides the middle of the line.
/// let visible = [Interval::new(0.0, 0.2), Interval::new(0.6, 1.0)];
/// let sample = lines.point(&line, &visible, 0.5);
/// let again = lines.joint_pdf(sample.point, &visible);
/// assert!((sample.pdf.value() / again.value() - 1.0).abs() < 1e-13);
/// // The irradiance: exact where nothing occludes, whatever the random numbers.
/// let open = lines.point(&line, &[Interval::UNIT], 0.5);
/// let estimate = n.dot(open.point.normalize()) / open.pdf.value();
/// assert!((estimate / lines.total() - 1.0).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AngularLines {
    lines: ParallelLines,
    x: DVec3,
    /// The foot of the perpendicular from the shading point, in the coordinates (offset, along) of
    /// the lines; the next field is the distance of the shading point from the plane.
    foot: (f64, f64),
    z: f64,
    /// The shading normal in the frame (along, across, towards the light); `None` for the plain
    /// solid angle.
    normal: Option<DVec3>,
    pieces: Pieces,
    marginal: Marginal,
    /// The rectangle whose lines have offsets in closed form: for lines by plain solid angle along
    /// an edge.
    rectangle: Option<Rectangle>,
    /// Whether the lines are [`linelit_geometry::CloseLines`].
    close: bool,
}

/// The density by which offsets are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Marginal {
    /// The plain solid angle.
    Solid,
    /// Linear in the angle over each piece, between the plain solid angles of its ends.
    Warped,
    /// The projected solid angle.
    Projected,
}

impl AngularLines {
    /// Sets up lines in proportion to the solid angle of their neighbourhood: in closed form where
    /// they run along an edge of a rectangle (to 1e-12 of its sides), and by Newton's method
    /// otherwise.
    ///
    /// For such a rectangle [`AngularLines::total`] is the solid angle to 1e-12, and the density is
    /// exact.
    #[must_use]
    pub fn by_solid_angle(polygon: &ConvexPolygon, angle_rad: f64, x: DVec3) -> Self {
        let lines = ParallelLines::new(polygon, angle_rad);
        Self::new(lines, x, height(polygon, x), None, Marginal::Solid)
    }

    /// Sets up lines approximately in proportion to the solid angle of their neighbourhood. On each
    /// piece between the offsets of vertices the marginal density is linear in the angle ψ, where
    /// tan ψ = u/z, and exact at both ends.
    ///
    /// This density is known exactly and inverted without iteration, so that estimates are as
    /// unbiased as with [`AngularLines::by_solid_angle`], at less than half the cost unless lines
    /// run along an edge of a rectangle. Without occluders, the weights of a triangle three times
    /// as wide as it is distant lie between 0.60 and 1.10. [`AngularLines::total`] is the
    /// normalisation, not Ω.
    #[must_use]
    pub fn by_warped_solid_angle(polygon: &ConvexPolygon, angle_rad: f64, x: DVec3) -> Self {
        let lines = ParallelLines::new(polygon, angle_rad);
        Self::new(lines, x, height(polygon, x), None, Marginal::Warped)
    }

    /// Sets up lines in proportion to the projected solid angle, for the part of the light above
    /// the horizon of the unit `normal`.
    ///
    /// If the light's plane is nearer than 1e-9 of the distance to the light's farthest point,
    /// lines are proportional to the plain solid angle of that part, and points on them to the
    /// projected one. Estimates are then as unbiased, with weights below Ω, and
    /// [`AngularLines::total`] is Ω.
    #[must_use]
    pub fn by_projected_solid_angle(
        polygon: &ConvexPolygon,
        angle_rad: f64,
        x: DVec3,
        normal: DVec3,
    ) -> Self {
        // Measure the whole polygon's plane: a corner on the horizon is off it by rounding.
        let (height, reach) = (height(polygon, x), reach(polygon, x));
        let (horizon, marginal) = if height.abs() < NEAREST * reach {
            // Rounded corners must not lose light: clip below the horizon, and cut each line at it.
            (x - normal * (MORE * reach), Marginal::Solid)
        } else if height.abs() < NEAR * reach && reach < FAR * polygon.diameter() {
            return Self::next_to_the_plane(polygon, angle_rad, x, normal);
        } else {
            (x, Marginal::Projected)
        };
        match polygon.clip(horizon, normal) {
            // Use the whole polygon's frame, so that the angle keeps its meaning.
            Some(above) => {
                let frame = above.plane_frame();
                let turned = angle_rad + polygon.plane_frame().turn_from(&frame);
                let lines = ParallelLines::in_frame(&above, &frame, turned);
                Self::new(lines, x, height, Some(normal), marginal)
            }
            None => Self::nothing(polygon, angle_rad, x),
        }
    }

    /// Sets up the technique for a light of which no line can be drawn: every density is 0.
    fn nothing(polygon: &ConvexPolygon, angle_rad: f64, x: DVec3) -> Self {
        Self {
            pieces: Pieces::new(core::iter::empty()),
            ..Self::by_solid_angle(polygon, angle_rad, x)
        }
    }

    fn new(
        lines: ParallelLines,
        x: DVec3,
        height: f64,
        normal: Option<DVec3>,
        marginal: Marginal,
    ) -> Self {
        let foot = lines.coordinates(x);
        Self::with_foot(lines, x, foot, height, normal, marginal, false)
    }

    /// Sets up lines, given the foot and the height of the shading point in their coordinates.
    #[inline(always)]
    fn with_foot(
        lines: ParallelLines,
        x: DVec3,
        foot: (f64, f64),
        height: f64,
        normal: Option<DVec3>,
        marginal: Marginal,
        close: bool,
    ) -> Self {
        let axes = lines.frame().axes;
        let towards = axes.z * height.signum();
        let mut out = Self {
            lines,
            x,
            foot,
            z: height.abs(),
            normal: normal.map(|n| DVec3::new(n.dot(axes.x), n.dot(axes.y), n.dot(towards))),
            pieces: Pieces::new(core::iter::empty()),
            marginal,
            rectangle: None,
            close,
        };
        // Take the closed form where the lines cover a rectangle.
        if marginal == Marginal::Solid {
            out.rectangle = Rectangle::new(&out.lines, foot, out.z);
        }
        if let Some(rectangle) = &out.rectangle {
            out.pieces = Pieces::new(core::iter::once(rectangle.solid_angle()));
            return out;
        }
        // Otherwise measure the pieces between vertices.
        let count = out.lines.knots().len() - 1;
        let measures = (0..count).map(|k| {
            let m = if marginal == Marginal::Warped {
                out.warp(&out.piece(k)).mass()
            } else if close {
                out.measure(&out.piece::<true>(k).part(1.0, out.z))
            } else {
                out.measure(&out.piece::<false>(k).part(1.0, out.z))
            };
            if m.is_finite() { m } else { 0.0 }
        });
        out.pieces = Pieces::new(measures);
        out
    }

    /// Returns the normal of the measure by which offsets are drawn; `None` for plain solid angle.
    fn marginal_normal(&self) -> Option<DVec3> {
        match self.marginal {
            Marginal::Solid | Marginal::Warped => None,
            Marginal::Projected => self.normal,
        }
    }

    /// Returns the solid angle Ω in sr, or the projected solid angle (the irradiance for unit
    /// radiance).
    #[must_use]
    pub fn total(&self) -> f64 {
        if self.pieces.is_usable() {
            self.pieces.total()
        } else {
            0.0
        }
    }

    /// Returns a piece between neighbouring knots.
    fn piece<const CLOSE: bool>(&self, k: usize) -> Piece<CLOSE> {
        let (u, lo, hi) = (self.lines.knots(), self.lines.lower(), self.lines.upper());
        let piece = Piece {
            first: self.line::<CLOSE>(u[k], lo[k], hi[k]),
            width: u[k + 1] - u[k],
            lower: lo[k + 1] - lo[k],
            upper: hi[k + 1] - hi[k],
        };
        if CLOSE {
            let last = self.line::<CLOSE>(u[k + 1], lo[k + 1], hi[k + 1]);
            if last.square() < piece.first.square() {
                return piece.reversed(last);
            }
        }
        piece
    }

    /// Returns the whole line at an offset; `None` outside the light.
    fn line_at(&self, offset: f64) -> Option<Line> {
        if self.close {
            return self.close_line_at(offset);
        }
        if let Some(rectangle) = &self.rectangle {
            let (a, b) = self.lines.range();
            return ((a..=b).contains(&offset)).then(|| rectangle.line(offset - self.foot.0));
        }
        let (lo, hi) = self.lines.extent(offset)?;
        Some(self.line::<false>(offset, lo, hi))
    }

    /// Converts a line from the coordinates of [`ParallelLines`] to coordinates about the foot.
    fn line<const CLOSE: bool>(&self, offset: f64, lo: f64, hi: f64) -> Line {
        let (from, length) = (lo - self.foot.1, (hi - lo).max(0.0));
        Line {
            u: offset - self.foot.0,
            lo: from,
            hi: if CLOSE {
                hi - self.foot.1
            } else {
                from + length
            },
            length,
        }
    }

    /// Returns the measure of a part of a piece, for the density of offsets.
    fn measure<const CLOSE: bool>(&self, part: &Trapezoid<CLOSE>) -> f64 {
        match self.marginal_normal() {
            None => part.solid_angle(),
            Some(n) => part.irradiance(n),
        }
    }

    /// Returns the view of a line in the frame (along, across, towards the light).
    #[inline(always)]
    fn view(&self, line: Line, normal: Option<DVec3>) -> Option<LineView> {
        LineView::with_edge(
            DVec3::new(line.lo, line.u, self.z),
            DVec3::new(line.hi, line.u, self.z),
            DVec3::new(line.length, 0.0, 0.0),
            normal,
        )
    }

    /// Returns a line with the measure along it.
    fn thin(&self, line: Line) -> Option<ThinLine> {
        let view = self.view(line, self.normal)?;
        match self.normal {
            None => Some(ThinLine::Solid(view)),
            Some(_) => ProjectedLine::of(view).map(ThinLine::Projected),
        }
    }

    /// Returns the measure of a line per radius, for the density of offsets.
    fn thin_measure(&self, line: Line) -> f64 {
        match self.marginal_normal() {
            None => self.thin_solid_angle(line),
            Some(n) => self.thin_irradiance(line, n),
        }
    }

    /// Returns the projected solid angle of a line per radius, as
    /// [`ProjectedLine::projected_solid_angle`] does, without setting the sampling up.
    #[inline(never)]
    fn thin_irradiance(&self, line: Line, normal: DVec3) -> f64 {
        self.view(line, Some(normal))
            .and_then(ProjectedLine::of)
            .map_or(0.0, |line| line.projected_solid_angle())
    }

    /// Returns the solid angle of a line per radius.
    #[inline(always)]
    fn thin_solid_angle(&self, line: Line) -> f64 {
        let thin = 2.0 * line.sine_range(self.z) / (line.u * line.u + self.z * self.z).sqrt();
        if thin.is_finite() { thin } else { 0.0 }
    }

    /// Returns the distance of the infinite line whose offset from the foot is `u`.
    fn distance(&self, u: f64) -> f64 {
        // The setup of a rectangle has shown that squares do not overflow.
        match self.rectangle {
            Some(_) => (u * u + self.z * self.z).sqrt(),
            None => hypot(u, self.z),
        }
    }

    /// Returns the marginal density on a piece that is linear in the angle.
    fn warp(&self, piece: &Piece<false>) -> Warp {
        let angles = Angles::new(piece.first.u, piece.width, self.z);
        let [first, last] = angles.r;
        Warp {
            first: 0.5 * first * self.thin_solid_angle(piece.at(0.0)),
            last: 0.5 * last * self.thin_solid_angle(piece.at(1.0)),
            angles,
        }
    }

    /// Converts the density of an angle, `slope`, which is not normalised, to the density of its
    /// offset.
    fn warped_pdf(&self, offset: f64, slope: f64) -> Pdf<Offset> {
        let u = offset - self.foot.0;
        Pdf::new(slope * self.z / ((self.z * self.z + u * u) * self.total()))
    }

    /// Returns the piece that an offset within the range falls into.
    fn piece_at(&self, offset: f64) -> usize {
        let knots = self.lines.knots();
        let last = knots.len().saturating_sub(2);
        (0..last).find(|&k| offset < knots[k + 1]).unwrap_or(last)
    }

    /// Returns the fraction s of the piece's width below which the measure is `target`, out of
    /// `whole`, by Newton's method in the angle within a bracket.
    #[inline(never)]
    fn find<const CLOSE: bool>(&self, piece: &Piece<CLOSE>, target: f64, whole: f64) -> f64 {
        let z = self.z;
        let excess = |s: f64| self.measure(&piece.part(s, z)) - target;
        let slope = |s: f64| {
            let line = piece.at(s);
            0.5 * hypot(line.u, z) * self.thin_measure(line)
        };
        let angles = piece.angles(z);
        if angles.spread(z) > WIDE {
            return self.find_wide(piece, target, whole);
        }
        // Start from the inverse of the density that is linear in the angle.
        let (mut lo, mut hi) = (0.0, angles.end);
        let mut v = angles.end * sample_linear(target / whole, slope(0.0), slope(1.0));
        for _ in 0..MOST_STEPS {
            let s = angles.fraction(v);
            let e = excess(s);
            if e.abs() <= 2.0 * f64::EPSILON * whole {
                break;
            }
            if e > 0.0 {
                hi = v;
            } else {
                lo = v;
            }
            // The error after a Newton step is the square of the step, relative to the piece.
            let is_last;
            (v, is_last) = step_within([lo, hi], v, e / slope(s), LAST_STEP * angles.end);
            if is_last {
                break;
            }
        }
        angles.fraction(v)
    }

    /// Returns the fraction s that [`AngularLines::find`] returns, by bracketed Newton steps in s
    /// itself. This is for a shading point so near to the piece, compared with the piece's width,
    /// that most of the piece is at angles which round to the same number.
    #[cold]
    #[inline(never)]
    fn find_wide<const CLOSE: bool>(&self, piece: &Piece<CLOSE>, target: f64, whole: f64) -> f64 {
        let (mut lo, mut hi, mut s) = (0.0, 1.0, 0.5);
        for _ in 0..MOST_HALVINGS {
            let e = self.measure(&piece.part(s, self.z)) - target;
            if e.abs() <= 2.0 * f64::EPSILON * whole {
                break;
            }
            if e > 0.0 {
                hi = s;
            } else {
                lo = s;
            }
            let line = piece.at(s);
            // dψ = z du/(z² + u²).
            let per_width = piece.width.abs() * (self.z / hypot(line.u, self.z));
            let step = e / (0.5 * per_width * self.thin_measure(line));
            let is_last;
            (s, is_last) = step_within([lo, hi], s, step, f64::EPSILON * s);
            if is_last {
                break;
            }
        }
        s
    }

    /// Returns the visible interval that `xi` falls into, its line, the position within it, and the
    /// measure of all visible intervals.
    fn choose(
        &self,
        offset: f64,
        visible: &[Interval],
        xi: f64,
    ) -> Option<(Interval, Part, f64, f64)> {
        // With one interval there is nothing to choose.
        if let [part] = visible {
            let part = within(part);
            let seen = self.interval(offset, part)?;
            let measure = seen.measure();
            return Some((part, seen, xi, measure));
        }
        let measure = |part: &Interval| {
            self.interval(offset, within(part))
                .map_or(0.0, |t| t.measure())
        };
        // Choose an interval in proportion to its measure.
        let total: f64 = visible.iter().map(measure).sum();
        let (mut rest, mut chosen) = (xi * total, None);
        for part in visible {
            let w = measure(part);
            if w > 0.0 {
                chosen = Some((within(part), (rest / w).min(BELOW_ONE)));
                if rest < w {
                    break;
                }
                rest -= w;
            }
        }
        let (part, place) = chosen?;
        Some((part, self.interval(offset, part)?, place, total))
    }

    /// Returns the offset and the line parameter of a point of the light; `None` outside the light.
    /// Both are clamped within the rounding of the coordinates (64 ε).
    #[must_use]
    pub fn locate(&self, point: DVec3) -> Option<(f64, f64)> {
        locate(&self.lines, point)
    }

    /// Returns a part of the line at an offset, with the measure along it.
    fn interval(&self, offset: f64, part: Interval) -> Option<Part> {
        let whole = self.line_at(offset)?;
        let lo = whole.lo + whole.length * part.lo;
        let length = whole.length * part.length();
        let line = Line {
            lo,
            hi: if self.close {
                whole.hi - whole.length * (1.0 - part.hi)
            } else {
                lo + length
            },
            length,
            ..whole
        };
        if self.normal.is_some() {
            return self.thin(line).map(Part::Seen);
        }
        let measure = self.thin_solid_angle(line);
        (measure > 0.0).then_some(Part::Plain(line, measure))
    }

    /// Returns the position on a visible part of a line, as a fraction of its length, before which
    /// the fraction `place` of the part's measure lies.
    fn fraction_at(&self, part: &Part, place: f64) -> f64 {
        let by_view = |thin: &ThinLine| thin.view().whole_fraction(thin.sample(place).lambda);
        match part {
            Part::Seen(thin) => by_view(thin),
            Part::Plain(line, _) => line
                .fraction_at(self.z, place)
                .or_else(|| self.thin(*line).as_ref().map(by_view))
                .unwrap_or(place),
        }
    }

    /// Returns the measures of the line at an offset; `None` if no part is visible.
    fn visible_measure(&self, offset: f64, visible: &[Interval]) -> Option<LineMeasure> {
        let total: f64 = visible
            .iter()
            .filter_map(|part| self.interval(offset, within(part)))
            .map(|thin| thin.measure())
            .sum();
        (total > 0.0).then(|| self.line_measure(offset, self.pdf(offset), total))
    }

    /// Returns the measures of a line. The measure of the whole line follows from its marginal
    /// density.
    fn line_measure(&self, offset: f64, pdf: Pdf<Offset>, visible: f64) -> LineMeasure {
        let h = self.distance(offset - self.foot.0);
        LineMeasure {
            whole: pdf.value() * self.total() * (2.0 * h / self.z),
            visible,
        }
    }

    /// Returns the joint density at a point of a line with these measures.
    fn joint_value(&self, point: DVec3, line: &LineMeasure) -> Pdf<SolidAngle> {
        let density = line.whole / (line.visible * self.total());
        match self.normal {
            None => Pdf::new(density),
            Some(n) => {
                let p = point - self.x;
                let axes = self.lines.frame().axes;
                let across = axes.z * p.dot(axes.z).signum();
                let world = axes.x * n.x + axes.y * n.y + across * n.z;
                Pdf::new(density * world.dot(p) / p.length())
            }
        }
    }
}

impl LineTechnique for AngularLines {
    type Measure = SolidAngle;

    fn lines(&self) -> &ParallelLines {
        &self.lines
    }

    fn sample(&self, xi: f64) -> LineSample {
        let nothing = LineSample::none(self.lines.range().0);
        if !self.pieces.is_usable() {
            return nothing;
        }
        let (k, place) = self.pieces.pick(xi);
        // At the ends of a piece, which may be corners, lines have no length. A random number is a
        // multiple of the spacing, and represents the numbers between it and the next one.
        let place = place.clamp(HALF_ULP, 1.0 - HALF_ULP);
        let knots = self.lines.knots();
        let at = |s: f64| (knots[k] + (knots[k + 1] - knots[k]) * s).min(knots[k + 1]);
        // Invert the marginal density within the piece.
        let (offset, pdf) = if self.marginal == Marginal::Warped {
            let warp = self.warp(&self.piece(k));
            let t = sample_linear(place, warp.first, warp.last);
            let offset = at(fraction(warp.angles.fraction(t * warp.angles.end)));
            (offset, self.warped_pdf(offset, warp.at(t)))
        } else {
            let whole = self.pieces.weight(k);
            let offset = if let Some(rectangle) = &self.rectangle {
                let (a, b) = self.lines.range();
                (a + (b - a) * rectangle.find(place)).min(b)
            } else if self.close {
                self.close_offset(k, place, whole)
            } else {
                at(fraction(self.find::<false>(
                    &self.piece(k),
                    place * whole,
                    whole,
                )))
            };
            (offset, self.pdf(offset))
        };
        self.lines
            .segment(offset)
            .map_or(nothing, |segment| LineSample {
                segment,
                offset,
                pdf,
            })
    }

    fn pdf(&self, offset: f64) -> Pdf<Offset> {
        let line = self.line_at(offset).filter(|_| self.pieces.is_usable());
        let Some(line) = line else {
            return Pdf::ZERO;
        };
        if self.marginal == Marginal::Warped {
            let k = self.piece_at(offset);
            let warp = self.warp(&self.piece(k));
            let t = warp.place(offset - self.lines.knots()[k], self.z);
            return self.warped_pdf(offset, warp.at(t));
        }
        let ribbon = self.thin_measure(line) * self.z / (2.0 * self.distance(line.u));
        Pdf::new(ribbon / self.total())
    }

    fn invert(&self, offset: f64) -> Option<f64> {
        let knots = self.lines.knots();
        let (a, b) = self.lines.range();
        if !(a..=b).contains(&offset) || !self.pieces.is_usable() {
            return None;
        }
        // Measure the part before the offset: for a rectangle in closed form.
        if let Some(rectangle) = &self.rectangle {
            let place = rectangle.place(fraction((offset - a) / (b - a)));
            return Some(self.pieces.unpick(0, place));
        }
        // Otherwise measure the part of the piece that holds the offset.
        let k = self.piece_at(offset);
        if self.marginal == Marginal::Warped {
            let warp = self.warp(&self.piece(k));
            let t = warp.place(offset - knots[k], self.z);
            let below = t * (warp.first + 0.5 * t * (warp.last - warp.first));
            let place = 2.0 * below / (warp.first + warp.last);
            return Some(self.pieces.unpick(k, fraction(place)));
        }
        let whole = self.pieces.weight(k);
        let place = if self.close {
            self.close_place(k, offset, whole)
        } else {
            let s = (offset - knots[k]) / (knots[k + 1] - knots[k]);
            let below = self.measure(&self.piece::<false>(k).part(fraction(s), self.z));
            fraction(below / whole)
        };
        Some(self.pieces.unpick(k, place))
    }

    fn point(&self, line: &LineSample, visible: &[Interval], xi: f64) -> PointSample<SolidAngle> {
        let Some((part, seen, place, total)) = self.choose(line.offset, visible, fraction(xi))
        else {
            return PointSample::none(line.segment.p0);
        };
        let lambda = self.fraction_at(&seen, place);
        let t = part.lo + (part.hi - part.lo) * lambda;
        let point = line.segment.at(t);
        let measures = self.line_measure(line.offset, line.pdf, total);
        PointSample::at(point, self.joint_value(point, &measures))
    }

    fn joint_pdf(&self, point: DVec3, visible: &[Interval]) -> Pdf<SolidAngle> {
        let Some((offset, t)) = self.locate(point) else {
            return Pdf::ZERO;
        };
        match self.visible_measure(offset, visible) {
            Some(total) if is_visible(t, visible) => self.joint_value(point, &total),
            _ => Pdf::ZERO,
        }
    }

    fn invert_point(&self, point: DVec3, visible: &[Interval]) -> Option<[f64; 2]> {
        let (offset, t) = self.locate(point)?;
        let total = self.visible_measure(offset, visible)?.visible;
        // Sum the measures of the visible intervals before the point.
        let mut below = 0.0;
        for part in visible.iter().map(within) {
            let thin = match self.interval(offset, part) {
                Some(Part::Plain(line, _)) => self.thin(line),
                Some(Part::Seen(thin)) => Some(thin),
                None => None,
            };
            let Some(thin) = thin else {
                continue;
            };
            if t <= part.hi {
                let lambda = fraction((t - part.lo) / (part.hi - part.lo));
                let lambda = thin.view().clipped_fraction(lambda)?;
                let u = (below + thin.invert(lambda) * thin.measure()) / total;
                return Some([self.invert(offset)?, below_one(u)]);
            }
            below += thin.measure();
        }
        None
    }
}

/// Takes a Newton step back from `v` within a bracket, and reports whether it was the last one,
/// which is no longer than `last`. A step that leaves the bracket is replaced by halving the
/// bracket, which says nothing about the distance of the root. If such a step is the last one (it
/// rounds to zero, and `v` is an end of the bracket), `v` does not change.
fn step_within([lo, hi]: [f64; 2], v: f64, step: f64, last: f64) -> (f64, bool) {
    let (next, is_last) = (v - step, step.abs() <= last);
    if next > lo && next < hi {
        (next, is_last)
    } else if is_last {
        (v, true)
    } else {
        (0.5 * (lo + hi), false)
    }
}

/// Returns the height of the polygon's plane above the shading point, along the polygon's normal.
fn height(polygon: &ConvexPolygon, x: DVec3) -> f64 {
    predicates::dot(polygon.normal(), polygon.vertices()[0] - x)
}

/// Returns an upper bound of the distance to the light's farthest point.
fn reach(polygon: &ConvexPolygon, x: DVec3) -> f64 {
    predicates::length(polygon.vertices()[0] - x) + polygon.diameter()
}

/// A visible part of a line: given by its ends and its solid angle per radius, or, for projected
/// solid angle, as the view of what is above the horizon.
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack")]
enum Part {
    Plain(Line, f64),
    Seen(ThinLine),
}

impl Part {
    fn measure(&self) -> f64 {
        match self {
            Self::Plain(_, measure) => *measure,
            Self::Seen(thin) => thin.measure(),
        }
    }
}

/// The measures of one line: the measure of the whole line, and the measure of its visible parts.
#[derive(Clone, Copy)]
struct LineMeasure {
    whole: f64,
    visible: f64,
}
