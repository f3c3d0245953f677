//! This module integrates a Phong lobe over a polygon, or over any region in a plane.
//!
//! The integral is transformed to the boundary by Stokes' theorem, twice. Each edge is an arc of a
//! great circle on which the lobe has one highest point and falls off on both sides of it. An edge
//! that is far from the lobe costs a few products. Where the edges' terms cancel, because the
//! polygon is small or at the horizon, triangles are integrated line by line.

use crate::exact::{direction, dot, length, value_at_crossing};
use crate::fan::Fan;
use crate::gauss::{NODE, NODES, WEIGHT, atanh_ratio, exp_bounded};
use crate::horizon::crossing;
use crate::lobe::{SMOOTH, window};
use crate::phong;
use crate::polygon::{self, clip_to_horizon};
use crate::quadrature::adaptive;
use crate::solid_angle::volume;
use crate::span::{near_one, power_of_two_unit};
use linelit_elementary::{atan2, cos, exp, hypot, ln, ln_1p, pow, sin, tan};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_simd::{Isa, Lanes, One, Simd, dispatch};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The largest number of vertices that are integrated at once, before clipping; larger polygons are
/// divided into a fan.
const CHUNK: usize = ConvexPolygon::CAPACITY;

/// The largest accepted error of the sum over edges, relative to an upper bound of the integral:
/// the irradiance, or the whole lobe.
const ENOUGH: f64 = 3e-11;

/// The depth below which a lobe is ignored on an edge: e⁻⁴⁶ of its peak.
const DEPTH: f64 = 46.0;

/// The largest contribution of ignored edges to the sum: e⁻⁴⁶ times their angles and azimuths, 4π
/// at most.
const LEFT_OUT: f64 = 1.4e-19;

/// If k g² is above this number, where g is the sine of the angle between the lobe's axis and the
/// edge's plane, the term zᵏ is integrated in place of 1 − zᵏ. The result does not cancel: zᵏ is
/// below e⁻⁶ there, and the quotient by 1 − z² is smooth.
const FAR: f64 = 12.0;

/// An angle close to π, whose sine is a hundredth: beyond it rounded ends do not determine the
/// edge's plane.
const NEARLY_STRAIGHT: f64 = 3.13;

/// Returns `∫ max(0, n·ω) max(0, w·ω)ᵏ dω` over the polygon, dimensionless. Times
/// [`normalisation`](crate::phong::normalisation) and k_s it is the radiance that a Phong surface
/// reflects for each unit of the light's radiance.
///
/// `vertices` are relative to the shading point, of a convex polygon, in either order and of any
/// number; `n` is the surface's unit normal (the result is proportional to its length), `w` the
/// direction of the lobe's axis, and `k` its exponent, any real number ≥ 0.
///
/// **Formula**: with z = w·ω, G the inward unit normal of the plane through an edge and the
/// shading point, g = G·w, and x the angle along the edge,
///
/// ```text
/// (k + 2) T = 2π m (w·n) + Σ_edges ∫ [ (G·n) zᵏ − (w·n) g zᵏ/(1 − z²) ] dx
/// ```
///
/// Here m is one if the axis passes through the polygon, and zero otherwise. If the edge is near
/// the axis, the second term is computed as (w·n) g (1 − zᵏ)/(1 − z²) minus (w·n) times the azimuth
/// that the edge subtends about the axis, which is an arc tangent. Both terms are integrated by 24
/// Gauss–Legendre nodes on each side of the lobe's highest point on the edge, as far as zᵏ matters.
///
/// Where the terms cancel (for polygons that are small, and for light at the horizon), and for
/// exponents below six that are not integers, the result is an integral over triangles with
/// positive terms, det(a, b, c)/|c − b| ∫ [`ribbon`](crate::phong::ribbon) du, over lines along the
/// longest side of each triangle.
///
/// **Cost**: an edge takes 500 to 700 ns at exponents of 1 to 113, 250 to 430 at 1000 and 250 to
/// 290 at 1e5. Along the same edges [`ribbon`](crate::phong::ribbon) takes 150 to 370, 150 to 250
/// and 460 to 620 ns, so that an edge costs two to four lines, one to two, and half a line. Small
/// triangles take 0.5 to 1 µs, and other triangles that need no grading take 15 or 30 lines.
/// Triangles for powers below six that are not integers, or with a narrow lobe inside, take some
/// hundred to some thousand lines (0.2 to 2 ms).
///
/// **Domain**: finite vertices; fewer than three, or k < 0, give 0. If the shading point touches
/// the polygon (nearer than ε of its size), the result is between zero and the irradiance.
///
/// **Error**: below 1e-10 of the smaller of the polygon's [irradiance](polygon::irradiance) and
/// 2π/(k + 2), the whole lobe, at exponents up to 1e5 (`docs/accuracy.md`). In 2400 random polygons
/// of 1e-8 to 2 distances, also across horizons, it is 2e-11 at most (powers below six that are not
/// integers were not compared across the lobe's own horizon there). Where triangles are used and
/// one passes close to the shading point, ends of lines are also rounded, by 2 ε times the distance
/// of the farthest vertex. With the fourth power of distances this becomes 8 ε times the ratio of
/// that distance to the distance of the nearest point (in 600 random triangles at exponents of 1 to
/// 5, 0.12 ε).
///
/// **Source**: Arvo 1995, "Applications of Irradiance Tensors", whose recursion costs O(k) for each
/// edge and needs an integer; this form is our own.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong_polygon;
/// // A huge square overhead, the lobe straight up: 2π/(k + 2).
/// let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
///     .map(|(x, y)| DVec3::new(1e6 * x, 1e6 * y, 1.0));
/// let t = phong_polygon::irradiance(&square, DVec3::Z, DVec3::Z, 1000.0);
/// assert!((t * 1002.0 / (2.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn irradiance(vertices: &[DVec3], n: DVec3, w: DVec3, k: f64) -> f64 {
    let Some((first, rest)) = vertices.split_first() else {
        return 0.0;
    };
    let largest = vertices.iter().map(|v| v.abs().max_element());
    let Some(unit) = power_of_two_unit(largest.fold(0.0, f64::max)).filter(|_| k >= 0.0) else {
        return 0.0;
    };
    let lobe = Lobe::new(n, w, k);
    // Divide the polygon into pieces of at most `CHUNK` vertices, which all share the first one.
    let mut piece = [*first * unit; CHUNK];
    let (mut sum, mut at) = (0.0, 0);
    while rest.len() > at + 1 {
        let next = &rest[at..rest.len().min(at + CHUNK - 1)];
        for (to, from) in piece[1..].iter_mut().zip(next) {
            *to = *from * unit;
        }
        sum += lobe.over_convex(&piece[..=next.len()]);
        // A piece begins where the previous one ends.
        at += next.len() - 1;
    }
    nonnegative(sum)
}

/// Computes [`irradiance`] for a region in a plane in front of the shading point, given by its
/// boundary. The region may have holes and several parts.
///
/// `plane` holds the point of the plane with the coordinates zero, relative to the shading point,
/// and the axes. `edges` holds the two ends of each edge; the region is on the left of all edges,
/// or on the right of all.
///
/// **Formula**: the formula of [`irradiance`] for large polygons. **Domain**: regions above the
/// horizon of `n`. `None` for exponents below one, and for exponents below six that are not
/// integers; also if an edge subtends almost half a turn. In these cases integrate over triangles
/// that make up the region.
///
/// **Error**: absolute, (2000 + 2 √(1300 k)) ε |n|/(k + 2) for each radian of the boundary that the
/// lobe meets.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong_polygon;
/// // A square at unit distance, of four edges in a plane.
/// let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
/// let edges = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]);
/// let plane = [DVec3::Z, DVec3::X, DVec3::Y];
/// let sum = phong_polygon::boundary_irradiance(edges, &plane, DVec3::Z, DVec3::Z, 40.0);
/// let square = corners.map(|[x, y]| DVec3::new(x, y, 1.0));
/// let whole = phong_polygon::irradiance(&square, DVec3::Z, DVec3::Z, 40.0);
/// assert!((sum.unwrap() - whole).abs() < 1e-13);
/// ```
#[must_use]
pub fn boundary_irradiance(
    edges: impl IntoIterator<Item = [[f64; 2]; 2]>,
    plane: &[DVec3; 3],
    n: DVec3,
    w: DVec3,
    k: f64,
) -> Option<f64> {
    let lobe = Lobe::new(n, w, k);
    let [origin, along_p, along_q] = *plane;
    let at = |[p, q]: [f64; 2]| origin + along_p * p + along_q * q;
    let edges = edges.into_iter().map(|ends| ends.map(at));
    let is_ahead = lobe.meets(along_p.cross(along_q), origin);
    let sum = lobe
        .is_smooth()
        .then(|| lobe.over_edges(edges, is_ahead))
        .filter(|sum| sum.size.is_finite())?;
    Some(nonnegative(sum.value.abs() / (k + 2.0)))
}

/// A surface's normal n, and the lobe of a Phong reflection about the axis w with the exponent k.
/// The integrand is (n·ω) (w·ω)ᵏ over directions ω for which both cosines are positive, and zero
/// elsewhere.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    n: DVec3,
    /// The axis as it was given, up to a power of two: normalizing it would rotate its horizon by
    /// rounding.
    axis: DVec3,
    /// The axis as a unit vector, or zero.
    w: DVec3,
    k: f64,
}

/// A sum, and the sum of the magnitudes of its terms.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    value: f64,
    size: f64,
}

impl Lobe {
    fn new(n: DVec3, w: DVec3, k: f64) -> Self {
        let axis = near_one(w);
        let w = direction(w);
        Self { n, axis, w, k }
    }

    /// Whether the power is smooth at the lobe's horizon, or negligible there.
    fn is_smooth(&self) -> bool {
        self.k >= SMOOTH || (self.k >= 1.0 && self.k.fract() == 0.0)
    }

    /// Whether the axis meets the plane through a point with a given normal.
    fn meets(&self, normal: DVec3, point: DVec3) -> bool {
        dot(normal, self.w) * dot(normal, point) > 0.0
    }

    /// Returns the integral over at most `CHUNK` vertices of about unit magnitude.
    fn over_convex(&self, vertices: &[DVec3]) -> f64 {
        let (n, k) = (self.n, self.k);
        let whole = polygon::irradiance(vertices, n);
        if !(whole > 0.0) {
            return 0.0;
        }
        // Try the sum over edges, and accept it if its error is small enough.
        if self.is_smooth() {
            let mut above = [DVec3::ZERO; CHUNK + 2];
            let count = clip_to_horizon(vertices, n, &mut above);
            let above = &above[..count];
            let next = above.iter().cycle().skip(1);
            let edges = above.iter().zip(next).map(|(a, b)| [*a, *b]);
            let first = vertices[0];
            let fan = vertices[1..].windows(2);
            let normal = fan
                .map(|pair| (pair[0] - first).cross(pair[1] - first))
                .sum();
            let mut sum = self.over_edges(edges, self.meets(normal, first));
            if *above != *vertices {
                // The corners that were clipped are rounded, which rotates the sides that end
                // there.
                sum.size += TAU * n.length();
            }
            // The nodes contribute an error of 5e-13. The lobe's logarithm, which is at most 645
            // and then has a slope of √(1300 k), contributes the rounding of directions.
            let rounding = (2000.0 + 2.0 * k.min((1300.0 * k).sqrt())) * f64::EPSILON;
            let error = rounding * sum.size + LEFT_OUT * n.length();
            if error <= ENOUGH * (whole * (k + 2.0)).min(TAU * n.length()) {
                return nonnegative(sum.value.abs() / (k + 2.0)).min(whole);
            }
        }
        // If not, integrate over the triangles of a fan.
        let (first, fan) = (vertices[0], vertices[1..].windows(2));
        let sum: f64 = fan
            .map(|pair| self.over_triangle([first, pair[0], pair[1]]))
            .sum();
        nonnegative(sum).min(whole)
    }

    /// Returns (k + 2) times the integral over the region within edges above the horizon of n; it
    /// is positive where the edges run counter-clockwise as seen from the shading point. `is_ahead`
    /// says whether the axis meets the region's plane.
    fn over_edges(&self, edges: impl Iterator<Item = [DVec3; 2]>, is_ahead: bool) -> Sum {
        let (mut sum, mut turns) = (Sum::default(), 0.0);
        for [a, b] in edges {
            if let Some(arc) = Arc::new(a, b, self) {
                // Sum the same arc tangents as the edge's term does, so that an edge through the
                // axis is on one side of it in both.
                turns += arc.azimuth(arc.from, arc.to);
                let part = arc.integral(self);
                sum.value += part.value;
                sum.size += part.size;
            }
        }
        // The axis is inside if the azimuths add up to a turn.
        if is_ahead {
            let inside = (turns / TAU).round() * TAU * dot(self.n, self.w);
            sum.value += inside;
            sum.size += inside.abs();
        }
        sum
    }
}

/// An edge as an arc; angles x are measured from the point of its circle that is nearest to the
/// axis.
#[derive(Clone, Copy, Debug)]
struct Arc {
    /// The angles of its ends.
    from: f64,
    to: f64,
    /// g = G·w.
    distance: f64,
    /// √(1 − g²): z is this times cos x.
    reach: f64,
    /// G·n.
    lean: f64,
}

impl Arc {
    /// Makes the arc; `None` for an edge without length, and for one through the shading point.
    fn new(a: DVec3, b: DVec3, lobe: &Lobe) -> Option<Self> {
        let fan = Fan::new(a, b, &[], None).filter(|fan| fan.sine > 0.0)?;
        let start = dot(lobe.w, fan.ends[0]) / fan.radii[0];
        let rise = fan.slope(lobe.w, 0);
        let centre = atan2(rise, start);
        // If the arc would extend beyond half a turn, measure angles in the other direction.
        let turn = if 0.5 * fan.angle - centre > PI {
            TAU
        } else {
            0.0
        };
        Some(Self {
            from: -centre - turn,
            to: fan.angle - centre - turn,
            distance: dot(fan.normal, lobe.w),
            reach: hypot(start, rise),
            lean: dot(fan.normal, lobe.n),
        })
    }

    /// Returns ∫ g dx/(1 − z²) between two angles: the azimuth about the axis.
    fn azimuth(&self, a: f64, b: f64) -> f64 {
        let g = self.distance;
        atan2(g * sin(b - a), g * g * cos(a) * cos(b) + sin(a) * sin(b))
    }

    /// Returns the term of this edge in the sum over the boundary ([`irradiance`]), (k + 2) times
    /// its part of the integral: ∫ [ (G·n) zᵏ − (w·n) g zᵏ/(1 − z²) ] dx, with the sum of the
    /// magnitudes of its parts.
    fn integral(&self, lobe: &Lobe) -> Sum {
        let none = Sum::default();
        if self.to - self.from > NEARLY_STRAIGHT {
            let size = f64::INFINITY;
            return Sum { size, ..none };
        }
        // Find the lobe's highest point on the part above its horizon.
        let (low, high) = (self.from.max(-FRAC_PI_2), self.to.min(FRAC_PI_2));
        if !(low < high) {
            return none;
        }
        let (k, g) = (lobe.k, self.distance);
        let peak = 0.0f64.clamp(low, high);
        let [cosine, across] = [cos(peak), sin(peak.abs())].map(|c| self.reach * c);
        let gap = g * g + across * across;
        let log = k * if gap < 0.5 {
            0.5 * ln_1p(-gap)
        } else {
            ln(cosine)
        };
        if !(log > -DEPTH) {
            return none;
        }
        // Integrate over the window about this point in which the power matters.
        let slope = tan(peak.abs());
        let width = window(k, slope);
        let (low, high) = (low.max(peak - width), high.min(peak + width));
        let is_far = k * g * g > FAR;
        let mut sums = [0.0; 2];
        for width in [peak - low, high - peak] {
            if width > 0.0 {
                let panel = Panel {
                    half_tan: tan(0.5 * width),
                    slope,
                    across: [across, cosine],
                    square: g * g,
                    log,
                    k,
                    is_far,
                };
                let [ones, powers] = panel.sums();
                sums = [sums[0] + ones, sums[1] + powers];
            }
        }
        let [ones, powers] = sums;
        let facing = dot(lobe.n, lobe.w);
        let [turn, rest] = match is_far {
            true => [-g * ones, 0.0],
            false => [g * ones, self.azimuth(low, high)],
        };
        // Count the rounding of edges' planes and of the angles of their ends as errors.
        let rounded = PLANE * (1.0 + 1.0 / (high - low));
        Sum {
            value: facing * (turn - rest) + self.lean * powers,
            size: facing.abs() * (turn.abs() + rest.abs() + rounded * ones)
                + (self.lean.abs() + rounded) * powers,
        }
    }
}

/// The rounding of the normals of edges and of the angles of their ends, 4 ε, as a fraction of the
/// 2000 ε of the error.
const PLANE: f64 = 2e-3;

/// A piece of an arc that starts at the lobe's highest point on it.
#[derive(Clone, Copy, Debug)]
struct Panel {
    /// The tangent of half its width.
    half_tan: f64,
    /// The slope τ ≥ 0 at the start: z falls like cos x − τ sin x.
    slope: f64,
    /// a and b: the coordinate along the arc, √(1 − g² − z²), is a cos x + b sin x.
    across: [f64; 2],
    /// g².
    square: f64,
    /// k ln z at the start of the piece.
    log: f64,
    k: f64,
    is_far: bool,
}

impl Panel {
    /// Returns ∫ zᵏ/(1 − z²) dx if the edge is far from the axis, and ∫ (1 − zᵏ)/(1 − z²) dx
    /// otherwise; and ∫ zᵏ dx.
    fn sums(&self) -> [f64; 2] {
        let end = self.half_tan;
        let last = end * (end + self.slope) / (1.0 - self.slope * end);
        let sums = if (0.0..=0.2).contains(&last) {
            rule(Isa::best(), self)
        } else {
            self.wide()
        };
        sums.map(|sum| 2.0 * end * sum)
    }

    /// Returns the terms of a node t = tan(x/2) with a weight, given the power there.
    #[inline(always)]
    fn terms<L: Lanes>(&self, l: L, t: L::D, weight: L::D, power: L::D) -> [L::D; 2] {
        let one = l.dsplat(1.0);
        let inverse = one / (t * t + 1.0);
        let [a, b] = self.across;
        let across = ((one - t * t) * a + t * (2.0 * b)) * inverse;
        let gap = l.dmax(across * across + self.square, l.dsplat(f64::MIN_POSITIVE));
        let share = if self.is_far { power } else { one - power };
        let weight = weight * inverse;
        [weight * (share / gap), weight * power]
    }

    /// Returns the sums with the library's functions, for wide panels (small exponents).
    fn wide(&self) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (s, weight) in NODE.iter().zip(&WEIGHT) {
            let t = self.half_tan * s;
            let fall = (-2.0 * t * (t + self.slope) / (1.0 + t * t)).max(-1.0);
            let power = exp(self.k * ln_1p(fall) + self.log);
            let [ones, powers] = self.terms(One, t, *weight, power);
            sums = [sums[0] + ones, sums[1] + powers];
        }
        sums
    }
}

/// Returns the sums by the rule, with cos x − τ sin x = (1 − q)/(1 + q) for q = t (t + τ)/(1 − τ
/// t).
#[inline(always)]
fn kernel<S: Simd>(s: S, panel: &Panel) -> [f64; 2] {
    let one = s.dsplat(1.0);
    let mut sums = [s.dsplat(0.0); 2];
    let (nodes, weights) = (NODE.as_chunks().0, WEIGHT.as_chunks().0);
    for i in 0..NODES / 8 {
        let t = s.dload(&nodes[i]) * panel.half_tan;
        let q = t * (t + panel.slope) / (one - t * panel.slope);
        let depth = q * (-2.0 * panel.k) * atanh_ratio::<S>(q) + panel.log;
        let power = exp_bounded::<S, false>(s, depth);
        let [ones, powers] = panel.terms(s, t, s.dload(&weights[i]), power);
        sums = [sums[0] + ones, sums[1] + powers];
    }
    sums.map(|sum| s.dsum(sum))
}

dispatch! {
    fn rule = kernel(panel: &Panel) -> [f64; 2]
}

/// The size of a triangle, in widths of the lobe, below which the integrand is smooth enough for
/// four nodes in each direction.
const TINY: f64 = 1e-2;
/// The size of a triangle, in widths of the lobe and in distances from the shading point, below
/// which no search for peaks is needed.
const MILD: f64 = 0.5;
/// The largest relative change of a power's base, times the exponent, for which four nodes are
/// used; their error is then 1e-14.
const EVEN: f64 = 0.1;
/// The smallest distance whose fourth power does not underflow.
const NEXT: f64 = 1e-70;
/// The ratio of a corner's height to its distance above which the height's relative rounding error
/// is at most 1e-12.
const STEEP: f64 = 1e-4;
/// The factor by which the parts of a range of lines shrink towards a peak, and how often they do.
const GRADE: f64 = 1.0 / 32.0;
const GRADES: i32 = 8;
/// The largest number of lines for each part.
const LINES: u32 = 1500;
/// The nodes of Gauss' rule with four points on [0, 1], with their weights.
const FOUR: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// A corner of a triangle with its heights. Heights between corners are interpolated: the heights
/// of a rounded point would have lost their digits where they are small.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at: DVec3,
    /// The heights n·p and axis·p of the corner p above the horizons of the surface and of the
    /// lobe, each with a relative error of a few ε.
    heights: [f64; 2],
}

impl Lobe {
    /// Returns the integral over a triangle, in either order, by terms that are not negative.
    fn over_triangle(&self, [a, b, c]: [DVec3; 3]) -> f64 {
        let corner = |at| Corner {
            at,
            heights: [dot(self.n, at), dot(self.axis, at)],
        };
        let volume = volume(a, b, c).abs();
        if !(volume > 0.0) {
            return 0.0;
        }
        // Clip the triangle at both horizons.
        let above = |triangle, i| self.above(triangle, i).into_iter().flatten();
        let parts = above([a, b, c].map(corner), 0)
            .flat_map(|(share, part)| above(part, 1).map(move |(rest, part)| (share * rest, part)));
        let unit = length(self.axis);
        parts
            .map(|(share, mut part)| {
                for corner in &mut part {
                    corner.heights[1] /= unit;
                }
                volume * share * self.by_volume(part)
            })
            .sum()
    }

    /// Returns the part of a triangle above a horizon (n's or w's) as up to two triangles, each
    /// with its fraction of the area. The fractions are products of quotients without differences.
    fn above(&self, triangle: [Corner; 3], i: usize) -> [Option<(f64, [Corner; 3])>; 2] {
        let height = |corner: usize| triangle[corner].heights[i];
        let count = (0..3).filter(|corner| height(*corner) > 0.0).count();
        if count == 0 {
            return [None; 2];
        }
        // Rotate the corner that is on the other side than the two others to the front.
        let is_odd = |corner: &usize| match count {
            1 => height(*corner) > 0.0,
            _ => height(*corner) < 0.0,
        };
        let is_cut = (0..3).any(|corner| height(corner) < 0.0);
        let Some(odd) = (0..3).find(is_odd).filter(|_| is_cut) else {
            return [Some((1.0, triangle)), None];
        };
        let [a, b, c] = [odd, odd + 1, odd + 2].map(|corner| triangle[corner % 3]);
        let [ab, ac] = [b, c].map(|other| self.crossing(a, other, i));
        let share = |p: Corner, q: Corner| p.heights[i] / (p.heights[i] - q.heights[i]);
        if count == 1 {
            [Some((share(a, b) * share(a, c), [a, ab, ac])), None]
        } else {
            [
                Some((share(b, a), [ab, b, c])),
                Some((share(a, b) * share(c, a), [ab, c, ac])),
            ]
        }
    }

    /// Returns the point where a side crosses a horizon, with its heights.
    fn crossing(&self, a: Corner, b: Corner, i: usize) -> Corner {
        let ([own, other], [ha, hb]) = ([i, 1 - i], [a, b].map(|corner| corner.heights));
        let vectors = [self.n, self.axis];
        let mut heights = [0.0; 2];
        heights[other] = if ha[other] * hb[other] >= 0.0 {
            let span = hb[own] - ha[own];
            ha[other] * (hb[own] / span) + hb[other] * (-ha[own] / span)
        } else {
            value_at_crossing(vectors[other], vectors[own], a.at, b.at)
        };
        // A point that is computed from the plane fits the heights only if these are well above
        // rounding. Along the other horizon, if it is almost the same, they are not.
        let is_steep = [a, b]
            .iter()
            .all(|c| c.heights[own].abs() > STEEP * length(c.at));
        let at = if is_steep {
            crossing(a.at, b.at, vectors[own], ha[own], hb[own])
        } else {
            let span = hb[own] - ha[own];
            a.at * (hb[own] / span) + b.at * (-ha[own] / span)
        };
        Corner { at, heights }
    }

    /// Returns the integral over a triangle above both horizons, divided by its volume det(a, b,
    /// c).
    fn by_volume(&self, triangle: [Corner; 3]) -> f64 {
        let corners = triangle.map(|corner| corner.at);
        let side = |i: usize| (corners[(i + 1) % 3] - corners[(i + 2) % 3]).length_squared();
        let longer = |best: usize, i: usize| if side(i) > side(best) { i } else { best };
        // Choose lines along the longest side, whose directions suffer least from rounding.
        let apex = longer(longer(0, 1), 2);
        let triangle @ [a, b, c] = [apex, apex + 1, apex + 2].map(|i| triangle[i % 3]);
        let base = length(c.at - b.at);
        let nearest = corners
            .map(length)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let [low, high] = [f64::min, f64::max].map(|f| {
            let [a, b, c] = triangle.map(|corner| corner.heights[1]);
            f(f(a, b), c)
        });
        // A tiny triangle needs four nodes in each direction.
        let widths = base / nearest * (self.k + 1.0).sqrt();
        let is_even = self.k == 0.0 || self.k.max(1.0) * (high - low) <= EVEN * low;
        if (widths < TINY && is_even) || base == 0.0 {
            // If rounding has made the triangle a point next to the shading point, it contributes
            // zero.
            return if nearest > NEXT {
                self.by_nodes(triangle)
            } else {
                0.0
            };
        }
        // Integrate over lines at the fraction u from the apex; narrow peaks are graded.
        let line = |u: f64| {
            let ends = [b, c].map(|end| a.at + (end.at - a.at) * u);
            let heights = [0, 1].map(|i| {
                let between = |end: Corner| a.heights[i] * (1.0 - u) + end.heights[i] * u;
                [b, c].map(between)
            });
            let vectors = [self.n, self.w];
            DVec3::X * phong::ribbon_by_heights(ends, heights, base * u, vectors, self.k)
        };
        let part = |from, to| adaptive(line, from, to, 1e-11, LINES).value.x;
        let sum = if widths < MILD && (self.is_smooth() || high - low < low) {
            part(0.0, 1.0)
        } else {
            graded(&self.peaks([a, b, c].map(|corner| corner.at)), part)
        };
        sum / base
    }

    /// Returns the fractions at which lines may receive much more light than others: through the
    /// lobe's axis and the foot of the perpendicular from the shading point, and where ends of
    /// lines are nearest to these.
    fn peaks(&self, [a, b, c]: [DVec3; 3]) -> [f64; 6] {
        let normal = (b - a).cross(c - a);
        let through = |d: DVec3| {
            let [x, y, z] = [(b, c), (c, a), (a, b)].map(|(p, q)| dot(d, p.cross(q)));
            1.0 - x / (x + y + z)
        };
        let highest = |p: DVec3| {
            let d = p - a;
            let [wa, wd] = [a, d].map(|v| dot(self.w, v));
            let [ad, aa, dd] = [a.dot(d), a.length_squared(), d.length_squared()];
            (wa * ad - wd * aa) / (wd * ad - wa * dd)
        };
        let nearest = |p: DVec3| -a.dot(p - a) / (p - a).length_squared();
        [
            through(self.w),
            through(normal),
            highest(b),
            highest(c),
            nearest(b),
            nearest(c),
        ]
    }

    /// Returns ∫∫ u (n·p) (w·p)ᵏ/|p|^(k + 4) over a small triangle above both horizons.
    fn by_nodes(&self, [a, b, c]: [Corner; 3]) -> f64 {
        let mut sum = 0.0;
        for (u, of_u) in FOUR {
            for (v, of_v) in FOUR {
                let weights = [1.0 - u, u * (1.0 - v), u * v];
                let mix = |x: [f64; 3]| x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2];
                let [facing, height] =
                    [0, 1].map(|i| mix([a.heights[i], b.heights[i], c.heights[i]]));
                let p = a.at * weights[0] + b.at * weights[1] + c.at * weights[2];
                let square = p.length_squared();
                // Near the axis compute the power from 1 − cos², since the exponent would magnify
                // rounding.
                let gap = self.w.cross(p).length_squared() / square;
                let power = if gap < 0.5 {
                    exp(0.5 * self.k * ln_1p(-gap))
                } else {
                    pow(height / square.sqrt(), self.k)
                };
                sum += of_u * of_v * u * facing * power / (square * square);
            }
        }
        sum
    }
}

/// Returns the sum over parts of [0, 1] between peaks; the parts get smaller towards each peak.
fn graded(peaks: &[f64], part: impl Fn(f64, f64) -> f64) -> f64 {
    let mut knots = [0.0; 8];
    let mut count = 2;
    knots[1] = 1.0;
    for u in peaks {
        if *u > 0.0 && *u < 1.0 {
            knots[count] = *u;
            count += 1;
        }
    }
    let knots = &mut knots[..count];
    knots.sort_unstable_by(f64::total_cmp);
    let mut sum = 0.0;
    for pair in knots.windows(2) {
        let half = 0.5 * (pair[1] - pair[0]);
        for i in 0..GRADES {
            let far = half * GRADE.powi(i);
            let near = if i + 1 < GRADES { far * GRADE } else { 0.0 };
            sum += part(pair[0] + near, pair[0] + far) + part(pair[1] - far, pair[1] - near);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    #[test]
    fn panels_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(7);
        for i in 0..2000 {
            let mut random = || rng.next_f64();
            let panel = Panel {
                half_tan: 0.3 * random(),
                slope: random(),
                across: [random(), random()],
                square: random() * random(),
                log: -40.0 * random(),
                k: 10f64.powf(5.0 * random()),
                is_far: i % 2 == 0,
            };
            let bits = |set| rule(Isa::detect(set), &panel).map(f64::to_bits);
            let results = InstructionSet::ALL.map(bits);
            assert!(results.iter().all(|r| *r == results[0]), "{panel:?}");
        }
    }
}
