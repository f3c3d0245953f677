//! This module finds the visible part of a disk as one point sees it, and of a sphere, which is
//! seen as the disk of its outline. It is for callers who want the shape itself, not the light.

use crate::Measure;
use crate::known::disk::SeenDisk;
use crate::visible_region::rings;
use linelit_elementary::{atan2, sin_cos};
use linelit_geometry::{DVec3, stop};
use linelit_lights::{Disk, Sphere};
use linelit_penumbra::{BoundaryEdge, DiskEdge, PartOnDisk, Penumbra, Point};
use linelit_shading::{polygon, quadrature, solid_angle};
use linelit_visibility::{Occluders, Scratch, ShaftClass, ShaftQuery};
use std::f64::consts::{PI, TAU};

/// The visible part of a disk as one point sees it: its boundary, which is exact but for rounding.
///
/// One value can be used for any number of points, and reuses its memory. A sphere is seen as the
/// disk of its [outline](Sphere::outline), if no triangle [reaches into](is_clear) it.
///
/// ```
/// use linelit_estimators::geometry::DVec3;
/// use linelit_estimators::lights::Disk;
/// use linelit_estimators::visibility::{Occluders, Scratch, ShaftQuery};
/// use linelit_estimators::{Measure, VisibleDisk};
/// let disk = Disk { center: DVec3::Z * 2.0, normal: -DVec3::Z, radius: 1.0 };
/// // A triangle half way up, which hides the half with x > 0.
/// let positions = [[0.0, -9.0, 1.0], [9.0, 0.0, 1.0], [0.0, 9.0, 1.0]];
/// let occluders = Occluders::build(&positions, &[[0, 1, 2]]);
/// let mut visible = VisibleDisk::default();
/// let around = disk.around();
/// let query = ShaftQuery::new(DVec3::ZERO, &around);
/// visible.find(&occluders, &disk, query, &mut Scratch::new());
/// assert!((visible.fraction(Measure::Area) - 0.5).abs() < 1e-12);
/// ```
#[derive(Debug, Default)]
pub struct VisibleDisk {
    penumbra: Penumbra,
    part: PartOnDisk,
    point: DVec3,
    seen: Option<Seen>,
}

/// A disk and its visible part.
#[derive(Debug)]
struct Seen {
    /// The boundary of the visible part, in units of the radius along the axes.
    edges: Vec<DiskEdge>,
    /// The centre relative to the point, and two orthogonal radii.
    center: DVec3,
    axes: [DVec3; 2],
}

/// The number of chords that replace a whole rim.
const CHORDS: f64 = 256.0;

/// The relative error of integrals along the rim, and the most evaluations of their integrands.
const TOLERANCE: f64 = 1e-13;
const EVALUATIONS: u32 = 10_000;

/// Returns whether no triangle reaches into a sphere in front of its outline, as a point sees it.
/// If so, an occluder hides a part of the sphere exactly where it hides that part of the outline.
/// The query is the query for the outline's [`Disk::around`]. If many triangles hide the light, the
/// result is `true` only if no triangle at all reaches into the sphere.
#[must_use]
pub fn is_clear(
    occluders: &Occluders,
    sphere: &Sphere,
    query: ShaftQuery<'_>,
    scratch: &mut Scratch,
) -> bool {
    let own = query.exclude.clone();
    let shaft = occluders.shaft(query, scratch);
    let is_partial = shaft.class() == ShaftClass::Partial;
    match shaft.candidate_corners().filter(|_| is_partial) {
        Some(mut corners) => corners.all(|c| sphere.is_clear_of(c)),
        None if shaft.class() == ShaftClass::Empty => true,
        None => {
            let is_in = |p: DVec3| p.distance(sphere.center) < sphere.radius;
            let may_hold = |low, high| is_in(sphere.center.clamp(low, high));
            !occluders.any_triangle(may_hold, |number, triangle| {
                !own.contains(&number) && is_in(triangle.nearest(sphere.center))
            })
        }
    }
}

impl VisibleDisk {
    /// Finds the visible part of a disk, and replaces the result of the call before. The query is
    /// the query for [`Disk::around`].
    ///
    /// A point in the disk's plane, up to the margin near the light and 1e-12 of the distance, sees
    /// nothing of it: then the measure of the whole disk is zero.
    pub fn find(
        &mut self,
        occluders: &Occluders,
        disk: &Disk,
        query: ShaftQuery<'_>,
        scratch: &mut Scratch,
    ) {
        let (point, in_plane) = (query.point, query.margins.light.max(1e-12));
        self.hide(point);
        let center = disk.center - point;
        let size = center.length() + disk.radius;
        if !(disk.normal.dot(center).abs() > in_plane * size) {
            return;
        }
        let mut shaft = occluders.shaft(query, scratch);
        let (penumbra, part) = (&mut self.penumbra, &mut self.part);
        let seen = SeenDisk::within(disk, point, [None; 2], &mut shaft, penumbra, part);
        self.seen = seen.map(|seen| Seen {
            edges: seen.edges.to_vec(),
            center: seen.center,
            axes: seen.axes,
        });
    }

    /// Sets the result for a light of which a point sees nothing, such as a sphere around the
    /// point: the measure of the whole light is zero.
    pub fn hide(&mut self, point: DVec3) {
        self.point = point;
        self.seen = None;
    }

    /// The visible fraction of the disk, between 0 and 1. NaN if the measure of the whole disk is
    /// zero: for a point in its plane, or a disk below the horizon of the normal.
    #[must_use]
    pub fn fraction(&self, measure: Measure) -> f64 {
        let Some(seen) = &self.seen else {
            return f64::NAN;
        };
        let all = seen.of(&[DiskEdge::Rim], measure);
        match (all > 0.0, seen.edges == [DiskEdge::Rim]) {
            (false, _) => f64::NAN,
            (true, true) => 1.0,
            (true, false) => (seen.of(&seen.edges, measure) / all).clamp(0.0, 1.0),
        }
    }

    /// The measure of the visible part: an area, a solid angle in sr, or the irradiance of a light
    /// of radiance one.
    #[must_use]
    pub fn measure(&self, measure: Measure) -> f64 {
        let of = |seen: &Seen| seen.of(&seen.edges, measure);
        self.seen.as_ref().map_or(0.0, of)
    }

    /// The rings that bound the visible part, as corners in world space. As the point sees them,
    /// rings around the visible part run counter-clockwise and rings around holes clockwise. Empty
    /// if nothing is visible.
    ///
    /// Arcs are replaced by chords with corners on the rim, each over at most a 256th of the rim. A
    /// chord is at most 7.6e-5 of the radius inside its arc, and cuts off 1.1e-4 of the area of its
    /// sector.
    #[must_use]
    pub fn rings(&self) -> Vec<Vec<DVec3>> {
        let Some(Seen {
            edges,
            center,
            axes,
        }) = &self.seen
        else {
            return Vec::new();
        };
        // Replace arcs by chords, then join the sides to rings.
        let mut all = Vec::new();
        for edge in edges {
            match *edge {
                DiskEdge::Straight(from, to) => all.push(BoundaryEdge { from, to }),
                DiskEdge::Arc(from, to, is_long) => {
                    chords(from, to, turn(from, to, is_long), CHORDS, |from, to| {
                        all.push(BoundaryEdge { from, to });
                    });
                }
                DiskEdge::Rim => {
                    chords([1.0, 0.0], [1.0, 0.0], TAU, CHORDS, |from, to| {
                        all.push(BoundaryEdge { from, to });
                    });
                }
            }
        }
        rings(&all, self.point, [*center, axes[0], axes[1]])
    }
}

impl Seen {
    /// The measure of the area within a boundary: the sum over triangles and sectors with a corner
    /// at the centre, each with its sign.
    fn of(&self, edges: &[DiskEdge], measure: Measure) -> f64 {
        // Add triangles and sectors about the centre. For the cosine, take Lambert's sum if it
        // keeps its digits, else a sum over chords.
        let radius = self.axes[0].length();
        let sum = match measure {
            Measure::Area => {
                let straight = |a: Point, b: Point| 0.5 * cross(a, b);
                let square = radius * radius;
                square * sum(edges, straight, |_, _, turn| 0.5 * turn)
            }
            Measure::SolidAngle => {
                let straight =
                    |a, b| self.triangle(a, b, |[a, b, c]| solid_angle::triangle(*a, *b, *c));
                sum(edges, straight, |from, _, turn| self.sector(from, turn))
            }
            Measure::Cosine(n) => {
                let seen = SeenDisk {
                    edges,
                    center: self.center,
                    axes: self.axes,
                };
                let closed = seen.is_wide().then(|| seen.irradiance(|p| p, n));
                return closed.flatten().unwrap_or_else(|| self.by_chords(edges, n));
            }
        };
        sum.max(0.0)
    }

    fn at(&self, [p, q]: Point) -> DVec3 {
        self.center + self.axes[0] * p + self.axes[1] * q
    }

    /// An integral over the triangle between the centre and two points, with the sign of its turn.
    fn triangle(&self, a: Point, b: Point, integral: impl Fn(&[DVec3; 3]) -> f64) -> f64 {
        let turn = cross(a, b);
        match turn == 0.0 {
            true => 0.0,
            false => integral(&[self.center, self.at(a), self.at(b)]) * turn.signum(),
        }
    }

    /// The solid angle of a sector. In units of the radius, with the centre c, the height h of the
    /// point above the plane, and the point w = c + e of the rim, it is
    ///
    /// ```text
    /// ∫∫ h r dr dφ/|c + r e|³ = ∫ h/(|w| (|c||w| + c·w)) dφ
    /// ```
    fn sector(&self, from: Point, turn: f64) -> f64 {
        let start = atan2(from[1], from[0]);
        let across = self.axes[0].cross(self.axes[1]);
        // The lengths are multiples of the radius throughout, since numerator and denominator both
        // have its fourth power.
        let height = (self.center.dot(across) / across.length()).abs();
        let (radius, to_center) = (self.axes[0].length(), self.center.length());
        let density = |phi: f64| {
            let (s, c) = sin_cos(phi);
            let w = self.at([c, s]);
            let to_rim = w.length();
            let below = to_rim * (to_center * to_rim + self.center.dot(w));
            DVec3::X * (height * radius * radius / below)
        };
        let end = start + turn;
        quadrature::adaptive(density, start, end, TOLERANCE, EVALUATIONS)
            .value
            .x
    }

    /// The irradiance of a disk that is small or seen flatly, for which closed forms lose digits:
    /// the sum of triangles over chords, plus the segment between each chord and its arc, evaluated
    /// at its centroid. The error is 1e-7 of the whole disk's irradiance.
    fn by_chords(&self, edges: &[DiskEdge], n: DVec3) -> f64 {
        let straight = |a, b| self.triangle(a, b, |corners| polygon::irradiance(corners, n));
        let across = self.axes[0].cross(self.axes[1]);
        let height = self.center.dot(across).abs();
        let of_arc = |from: Point, to: Point, turn: f64| {
            let mut sum = 0.0;
            let piece = turn / (turn / TAU * CHORDS).ceil().max(1.0);
            let segment = 0.5 * (piece - sin_cos(piece).0);
            chords(from, to, turn, CHORDS, |from, to| {
                let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]) * (1.0 + 0.05 * piece * piece));
                let w = self.at(middle);
                let square = w.length_squared();
                let density = n.dot(w).max(0.0) * height / (square * square);
                sum += straight(from, to) + segment * density;
            });
            sum
        };
        sum(edges, straight, of_arc).max(0.0)
    }
}

/// The sum over the edges of a boundary, which are straight or arcs with their turns.
fn sum(
    edges: &[DiskEdge],
    straight: impl Fn(Point, Point) -> f64,
    arc: impl Fn(Point, Point, f64) -> f64,
) -> f64 {
    let each = edges.iter().map(|edge| {
        stop::check();
        match *edge {
            DiskEdge::Straight(a, b) => straight(a, b),
            DiskEdge::Arc(a, b, is_long) => arc(a, b, turn(a, b, is_long)),
            DiskEdge::Rim => arc([1.0, 0.0], [1.0, 0.0], TAU),
        }
    });
    each.sum()
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The turn of an arc, from 0 to 2π. If the ends nearly meet, it is an empty arc or the whole
/// circle, as `is_long` says.
fn turn(a: Point, b: Point, is_long: bool) -> f64 {
    const CLOSE: f64 = 1e-9;
    let turn = atan2(cross(a, b), a[0] * b[0] + a[1] * b[1]);
    match turn < -CLOSE || (turn < CLOSE && is_long) {
        true => turn + TAU,
        false => turn.clamp(0.0, PI),
    }
}

/// Calls `each` with the chords of an arc. They have equal turns, of at most a whole turn divided
/// by `most`.
fn chords(from: Point, to: Point, turn: f64, most: f64, mut each: impl FnMut(Point, Point)) {
    let (start, count) = (atan2(from[1], from[0]), (turn / TAU * most).ceil().max(1.0));
    let (mut last, mut k) = (from, 1.0);
    while k < count {
        let (s, c) = sin_cos(start + turn * (k / count));
        each(last, [c, s]);
        last = [c, s];
        k += 1.0;
    }
    each(last, to);
}
