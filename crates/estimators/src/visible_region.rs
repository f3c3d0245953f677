//! This module finds the visible part of a polygon as one point sees it, for callers who want the
//! shape itself, not the light.

use crate::known::boundary::visible_region;
use crate::known::region::SeenRegion;
use linelit_geometry::{DVec3, stop};
use linelit_penumbra::{BoundaryEdge, Penumbra, Point};
use linelit_shading::{polygon, solid_angle};
use linelit_visibility::{Occluders, Scratch, ShaftClass, ShaftQuery};

/// The measure by which the size of parts of a light is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// The area of a polygon or of a disk, where a sphere counts as the disk of its outline; or the
    /// length of a line.
    Area,
    /// The solid angle that the part subtends at the point.
    SolidAngle,
    /// The irradiance that the part causes at a surface with this unit normal, if all of the light
    /// has the same radiance: the solid angle weighted by the cosine at the surface.
    Cosine(DVec3),
}

/// The visible part of a convex polygon as one point sees it: its boundary, which is exact but for
/// rounding.
///
/// One value can be used for any number of points, and reuses its memory.
///
/// ```
/// use linelit_estimators::geometry::{ConvexPolygon, DVec3};
/// use linelit_estimators::visibility::{Occluders, Scratch, ShaftQuery};
/// use linelit_estimators::{Measure, VisibleRegion};
/// let lamp = ConvexPolygon::parallelogram([-1.0, -1.0, 2.0], DVec3::Y * 2.0, DVec3::X * 2.0)?;
/// // A triangle half way up, which hides an eighth of the lamp.
/// let positions = [[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [0.0, 0.5, 1.0]];
/// let occluders = Occluders::build(&positions, &[[0, 1, 2]]);
/// let mut region = VisibleRegion::default();
/// region.find(&occluders, ShaftQuery::new(DVec3::ZERO, &lamp), &mut Scratch::new());
/// assert!((region.fraction(Measure::Area) - 0.875).abs() < 1e-12);
/// # Ok::<(), linelit_estimators::geometry::PolygonError>(())
/// ```
#[derive(Debug, Default)]
pub struct VisibleRegion {
    penumbra: Penumbra,
    /// The polygon's corners, and the boundary of the visible part, in the coordinates of the
    /// plane.
    corners: Vec<Point>,
    edges: Vec<BoundaryEdge>,
    /// The origin of these coordinates relative to the point, and their axes.
    plane: [DVec3; 3],
    point: DVec3,
}

impl VisibleRegion {
    /// Finds the visible part of the polygon of a query, and replaces the result of the call
    /// before.
    ///
    /// A point in the polygon's plane, up to the margin near the light and 1e-12 of the distance,
    /// sees nothing of it: then the measure of the whole polygon is zero. So it is for a query for
    /// a line.
    pub fn find(&mut self, occluders: &Occluders, query: ShaftQuery<'_>, scratch: &mut Scratch) {
        let (corners, point) = (query.light.corners(), query.point);
        let in_plane = query.margins.light.max(1e-12);
        self.point = point;
        self.edges.clear();
        // Find the boundary past occluders, in the coordinates of the shaft.
        self.corners.clear();
        let mut shaft = occluders.shaft(query, scratch);
        if shaft.class() == ShaftClass::Partial {
            if let Some(plane) = shaft.light_plane().filter(|plane| plane.corners.len() >= 3) {
                self.plane = plane.axes;
                self.corners.extend_from_slice(plane.corners);
                let (penumbra, polygon) = (&mut self.penumbra, &self.corners);
                let edges = visible_region(&mut shaft, penumbra, polygon);
                self.edges.extend_from_slice(edges.unwrap_or_default());
            }
            return;
        }
        let [origin, second] = [corners[0], corners[1]];
        let last = corners[corners.len() - 1];
        if corners.len() < 3 {
            return;
        }
        // Otherwise choose orthogonal axes, in units of the first side.
        let along = second - origin;
        let unit = along.length_squared();
        let height = (last - origin) - along * ((last - origin).dot(along) / unit);
        let across = height * (along.length() / height.length());
        self.plane = [origin - point, along, across];
        let normal = along.cross(across);
        // Leave out a polygon that is seen edge on, and return the polygon's own edges if nothing
        // hides it.
        let size = (origin - point).abs().max_element().max(along.length());
        if normal.dot(origin - point).abs() <= in_plane * size * normal.length() {
            return;
        }
        let to = |corner: &DVec3| [along, across].map(|axis| axis.dot(*corner - origin) / unit);
        self.corners.extend(corners.iter().map(to));
        if shaft.class() == ShaftClass::Empty {
            self.edges.extend(around(&self.corners));
        }
    }

    /// The visible fraction of the polygon, between 0 and 1. NaN if the measure of the whole
    /// polygon is zero: for a point in its plane, or a polygon below the horizon of the normal.
    #[must_use]
    pub fn fraction(&self, measure: Measure) -> f64 {
        let whole: Vec<_> = around(&self.corners).collect();
        if self.edges == whole {
            return if self.of(&whole, measure) > 0.0 {
                1.0
            } else {
                f64::NAN
            };
        }
        let all = self.of(&whole, measure);
        if all > 0.0 {
            (self.of(&self.edges, measure) / all).clamp(0.0, 1.0)
        } else {
            f64::NAN
        }
    }

    /// The measure of the visible part: an area, a solid angle in sr, or the irradiance of a light
    /// of radiance one.
    #[must_use]
    pub fn measure(&self, measure: Measure) -> f64 {
        self.of(&self.edges, measure)
    }

    /// The measure of the area within a boundary.
    fn of(&self, edges: &[BoundaryEdge], measure: Measure) -> f64 {
        let seen = SeenRegion::within(&self.corners, edges, self.plane);
        let sum = match measure {
            Measure::Area => {
                let twice = edges
                    .iter()
                    .map(|e| e.from[0] * e.to[1] - e.from[1] * e.to[0]);
                0.5 * twice.sum::<f64>() * self.plane[1].cross(self.plane[2]).length()
            }
            Measure::SolidAngle => seen.triangles(|&[a, b, c]| solid_angle::triangle(a, b, c)),
            Measure::Cosine(n) => seen.triangles(|triangle| polygon::irradiance(triangle, n)),
        };
        sum.abs()
    }

    /// The rings that bound the visible part, as corners in world space. As the point sees them,
    /// rings around the visible part run counter-clockwise and rings around holes clockwise. Empty
    /// if nothing is visible.
    #[must_use]
    pub fn rings(&self) -> Vec<Vec<DVec3>> {
        rings(&self.edges, self.point, self.plane)
    }
}

/// Joins the edges of a boundary to rings of corners in world space. The boundary is in the
/// coordinates of a plane, which is given by its origin relative to the point, and its axes. As the
/// point sees them, rings around the area within the boundary run counter-clockwise.
pub(crate) fn rings(
    edges: &[BoundaryEdge],
    point: DVec3,
    [origin, along, across]: [DVec3; 3],
) -> Vec<Vec<DVec3>> {
    // If the axes make a right-handed system and the plane is in the direction of their product,
    // the point sees the plane from below, as in a mirror.
    let is_mirrored = origin.dot(along.cross(across)) > 0.0;
    let in_space = |p: Point| point + origin + along * p[0] + across * p[1];
    let square = |p: Point, q: Point| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
    let has_length = |e: &&BoundaryEdge| square(e.from, e.to) > 0.0;
    // Start a ring with any edge, and append the edge that starts nearest to where it ends, until
    // the ring is closed.
    let mut open: Vec<_> = edges.iter().filter(has_length).collect();
    let mut rings = Vec::new();
    while let Some(first) = open.pop() {
        let (mut ring, mut end) = (vec![first.from], first.to);
        while square(first.from, end) > 0.0 {
            stop::check();
            let gap = |p: Point| square(p, end);
            let next = (0..open.len())
                .min_by(|&a, &b| gap(open[a].from).total_cmp(&gap(open[b].from)))
                .filter(|&next| gap(open[next].from) < gap(first.from));
            // Rounding may have moved ends, so that the ends of successive edges need not be equal.
            let Some(next) = next else { break };
            let edge = open.swap_remove(next);
            ring.push(edge.from);
            end = edge.to;
        }
        if ring.len() < 3 {
            continue;
        }
        if is_mirrored {
            ring.reverse();
        }
        rings.push(ring.into_iter().map(in_space).collect());
    }
    rings
}

/// The edges of a polygon.
fn around(corners: &[Point]) -> impl Iterator<Item = BoundaryEdge> {
    let next = corners.iter().cycle().skip(1);
    (corners.iter().zip(next)).map(|(&from, &to)| BoundaryEdge { from, to })
}
