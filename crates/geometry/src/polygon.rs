//! [`ConvexPolygon`]: convex planar polygons, the shape of most lights, with tolerances for
//! vertices from files.

use crate::{DMat3, DVec3, PlaneFrame, Vector3, predicates};
use linelit_elementary::atan2;
use std::fmt;

/// The largest number of vertices that [`ConvexPolygon::new`] accepts.
pub const MAX_VERTICES: usize = 16;

/// The largest distance of a vertex from the plane, or to the inside of the hull, that counts as
/// the rounding of a model file, as a fraction of the size of the polygon and its coordinates.
/// Vertices within it are moved onto the plane; polygons with vertices beyond it are refused. Model
/// files store `f32`, whose unit roundoff is 6e-8, and a cross product of differences of rounded
/// points adds up a few of these.
const FILE_PRECISION: f64 = 16.0 * 5.96e-8;

/// The largest such distance as a fraction of the size of the polygon alone, no matter how far from
/// the origin the polygon is: more than a thousandth is a bend and not rounding.
const MOST_BENT: f64 = 1e-3;

/// The largest distance of a point from the line through two others, if the point was computed to
/// be on that line, as a fraction of the largest coordinate M; a polygon no wider than this has no
/// area. The difference of two coordinates, up to 2M, its product with a fraction, and the sum are
/// rounded, to 2.5 ε M in each coordinate, which is 4.4 ε M for three; and the line itself is off
/// by as much at its rounded ends.
const COLLINEAR: f64 = 8.0 * f64::EPSILON;

/// 2²⁰⁰ ≈ 1.6e60: the largest coordinate of a polygon; polygons with larger ones are refused. Solid
/// angles use products of up to four lengths (of a light and of a shading point), which have to
/// stay within 1e±292 to keep their full precision.
const LARGEST: f64 = pow2(200);
/// 2⁻²⁰⁰ ≈ 6.2e-61: the smallest size of a polygon; smaller polygons are refused.
const SMALLEST: f64 = pow2(-200);

const fn pow2(e: i64) -> f64 {
    f64::from_bits(((1023 + e) as u64) << 52)
}

/// A convex planar polygon with 3 to [`MAX_VERTICES`] vertices, counter-clockwise about its normal,
/// without heap allocation.
///
/// The vertices are in one plane up to the rounding of `f64`: [`ConvexPolygon::new`] moves vertices
/// onto the plane that are in it only to the precision of a model file.
#[derive(Clone, Copy)]
pub struct ConvexPolygon {
    vertices: [DVec3; ConvexPolygon::CAPACITY],
    count: usize,
    normal: DVec3,
    area: f64,
    parallelogram: bool,
}

/// Why points do not form a convex polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolygonError {
    /// Fewer than 3 or more than [`MAX_VERTICES`] vertices.
    Count(usize),
    /// The vertex with this index is NaN or infinite.
    NotFinite(usize),
    /// The polygon has no area, or no more than rounding of coordinates would give to points on one
    /// line.
    Degenerate,
    /// The vertex with this index has a coordinate of more than 1.6e60 (2²⁰⁰).
    TooLarge(usize),
    /// All vertices are within 6.2e-61 (2⁻²⁰⁰) of each other.
    TooSmall,
    /// The vertex with this index is not in the plane of the others.
    NotPlanar(usize),
    /// The corner at the vertex with this index turns in the wrong direction.
    NotConvex(usize),
}

impl fmt::Display for PolygonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(n) => write!(f, "{n} vertices; a polygon has 3 to {MAX_VERTICES}"),
            Self::NotFinite(i) => write!(f, "vertex {i} is not finite"),
            Self::Degenerate => write!(f, "the polygon has no area"),
            Self::TooLarge(i) => write!(f, "vertex {i} has a coordinate beyond {LARGEST:.1e}"),
            Self::TooSmall => write!(f, "the polygon is smaller than {SMALLEST:.1e}"),
            Self::NotPlanar(i) => write!(f, "vertex {i} is off the plane of the others"),
            Self::NotConvex(i) => write!(f, "the polygon is not convex at vertex {i}"),
        }
    }
}

impl std::error::Error for PolygonError {}

impl fmt::Debug for ConvexPolygon {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ConvexPolygon")
            .field("vertices", &self.vertices())
            .field("normal", &self.normal)
            .field("area", &self.area)
            .finish()
    }
}

impl PartialEq for ConvexPolygon {
    fn eq(&self, other: &Self) -> bool {
        self.vertices() == other.vertices()
    }
}

impl<V: Vector3, const N: usize> TryFrom<[V; N]> for ConvexPolygon {
    type Error = PolygonError;

    /// Applies [`ConvexPolygon::new`] to vectors of any type. It does not compile for numbers of
    /// vertices that a polygon cannot have.
    fn try_from(points: [V; N]) -> Result<Self, PolygonError> {
        const { assert!(3 <= N && N <= MAX_VERTICES, "3 to MAX_VERTICES vertices") };
        Self::new(&points.map(V::dvec3))
    }
}

impl ConvexPolygon {
    /// The largest number of vertices that a polygon can have: [`MAX_VERTICES`], and one more for
    /// each of eight clips. Arrays with an entry for each vertex need this size.
    pub const CAPACITY: usize = MAX_VERTICES + 8;

    /// Creates a polygon from its vertices in either orientation; their order determines the normal
    /// by the right-hand rule.
    ///
    /// **Domain**: coordinates up to 2²⁰⁰ ≈ 1.6e60, and sizes from 2⁻²⁰⁰ ≈ 6.2e-61; larger and
    /// smaller polygons are refused.
    ///
    /// **Tolerances**. Vertices that are in the plane to the precision of a model file (16 units of
    /// `f32` roundoff relative to the polygon's size and coordinates) are moved onto it, but by no
    /// more than a thousandth of the polygon's size and an eighth of its width, no matter how far
    /// from the origin it is. A polygon counts as having no area if its width is at most 8 ε times
    /// the largest coordinate: points that were computed to be on one line are that far off it by
    /// rounding.
    ///
    /// # Errors
    /// Returns an error if the points do not form a convex polygon; see [`PolygonError`].
    pub fn new<V: Vector3 + Copy>(points: &[V]) -> Result<Self, PolygonError> {
        let n = points.len();
        if !(3..=MAX_VERTICES).contains(&n) {
            return Err(PolygonError::Count(n));
        }
        let mut room = [DVec3::ZERO; MAX_VERTICES];
        for (to, from) in room.iter_mut().zip(points) {
            *to = from.dvec3();
        }
        Self::from_points(&room[..n])
    }

    /// Checks the points, flattens them, and makes the polygon.
    fn from_points(points: &[DVec3]) -> Result<Self, PolygonError> {
        // Check coordinates, size and area.
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            return Err(PolygonError::NotFinite(i));
        }
        if let Some(i) = points.iter().position(|p| p.abs().max_element() > LARGEST) {
            return Err(PolygonError::TooLarge(i));
        }
        let area_vector = area_vector(points);
        let area = predicates::length(area_vector);
        let normal = predicates::normalize(area_vector).unwrap_or(DVec3::ZERO);
        let mut polygon = Self::from_raw(points, normal, area);
        let (size, largest) = (polygon.diameter(), polygon.largest_coordinate());
        if size > 0.0 && size < SMALLEST {
            return Err(PolygonError::TooSmall);
        }
        if is_rounding(area, size, largest) {
            return Err(PolygonError::Degenerate);
        }
        // Check the shape. A polygon no wider than the tolerance could be non-convex and pass.
        let tolerance = (FILE_PRECISION * (size + largest))
            .min(MOST_BENT * size)
            .min(0.25 * area / size);
        polygon.check_convex(tolerance)?;
        polygon.flatten(tolerance)?;
        polygon.parallelogram = polygon.detect_parallelogram();
        Ok(polygon)
    }

    /// Creates a triangle.
    ///
    /// # Errors
    /// See [`PolygonError`].
    pub fn triangle(
        a: impl Vector3,
        b: impl Vector3,
        c: impl Vector3,
    ) -> Result<Self, PolygonError> {
        Self::new(&[a.dvec3(), b.dvec3(), c.dvec3()])
    }

    /// Creates the parallelogram `o`, `o + u`, `o + u + v`, `o + v`, with its normal along `u × v`.
    ///
    /// # Errors
    /// See [`PolygonError`].
    pub fn parallelogram(
        o: impl Vector3,
        u: impl Vector3,
        v: impl Vector3,
    ) -> Result<Self, PolygonError> {
        let (o, u, v) = (o.dvec3(), u.dvec3(), v.dvec3());
        Self::new(&[o, o + u, o + u + v, o + v])
    }

    /// Returns the polygon relative to the point `x`, transformed by a linear map. The result is
    /// convex and flat like the polygon, up to rounding. `None` if it is outside of the domain of
    /// [`ConvexPolygon::new`], or no wider than rounding errors.
    ///
    /// ```
    /// use linelit_geometry::{ConvexPolygon, DMat3, DVec3};
    /// let square = ConvexPolygon::parallelogram(DVec3::ONE, DVec3::X, DVec3::Y).unwrap();
    /// let map = DMat3::from_diagonal(DVec3::new(2.0, 3.0, 1.0));
    /// let image = square.mapped(map, DVec3::ONE).unwrap();
    /// assert_eq!((image.area(), image.vertices()[2]), (6.0, DVec3::new(2.0, 3.0, 0.0)));
    /// ```
    #[must_use]
    pub fn mapped(&self, map: DMat3, x: DVec3) -> Option<Self> {
        let mut out = *self;
        for vertex in &mut out.vertices[..self.count] {
            *vertex = map * (*vertex - x);
        }
        let area_vector = area_vector(out.vertices());
        out.area = predicates::length(area_vector);
        out.normal = predicates::normalize(area_vector)?;
        let (size, largest) = (out.diameter(), out.largest_coordinate());
        let in_range = largest <= LARGEST && size >= SMALLEST;
        (in_range && !is_rounding(out.area, size, largest)).then_some(out)
    }

    /// Makes a polygon without checks.
    fn from_raw(points: &[DVec3], normal: DVec3, area: f64) -> Self {
        let mut vertices = [DVec3::ZERO; Self::CAPACITY];
        vertices[..points.len()].copy_from_slice(points);
        Self {
            vertices,
            count: points.len(),
            normal,
            area,
            parallelogram: false,
        }
    }

    /// Checks that no vertex is outside of an edge by more than the tolerance, and that the outline
    /// winds around once.
    fn check_convex(&self, tolerance: f64) -> Result<(), PolygonError> {
        let n = self.count;
        for i in 0..n {
            let (a, b) = (self.vertices[i], self.vertices[(i + 1) % n]);
            let e = b - a;
            // Test all other vertices, not only the next: within the tolerance, an outline may go
            // far out and come back.
            for j in 2..n {
                let g = self.vertices[(i + j) % n] - a;
                // The height over the edge (times its length), positive inside.
                let turn = predicates::cross(e, g).dot(self.normal);
                if turn < -tolerance * (e.length() + g.length()) {
                    return Err(PolygonError::NotConvex((i + j - 1) % n));
                }
            }
        }
        // An outline that winds around twice passes this test; a convex polygon does so once.
        if self.total_turn() > 1.5 * std::f64::consts::TAU {
            return Err(PolygonError::NotConvex(0));
        }
        Ok(())
    }

    /// The sum of the absolute exterior angles, in radians.
    fn total_turn(&self) -> f64 {
        let n = self.count;
        let edge = |i: usize| self.vertices[(i + 1) % n] - self.vertices[i % n];
        (0..n)
            .map(|i| {
                let (e, g) = (edge(i), edge(i + 1));
                atan2(predicates::cross(e, g).dot(self.normal), e.dot(g)).abs()
            })
            .sum()
    }

    /// Moves all vertices onto the plane, if they are within the tolerance.
    fn flatten(&mut self, tolerance: f64) -> Result<(), PolygonError> {
        let centroid = self.mean();
        for i in 0..self.count {
            let height = self.normal.dot(self.vertices[i] - centroid);
            if height.abs() > tolerance {
                return Err(PolygonError::NotPlanar(i));
            }
            self.vertices[i] -= self.normal * height;
        }
        Ok(())
    }

    fn detect_parallelogram(&self) -> bool {
        let v = &self.vertices;
        self.count == 4
            && (v[0] - v[1] + v[2] - v[3]).length()
                <= 8.0 * f64::EPSILON * (self.largest_coordinate() + self.diameter())
    }

    fn mean(&self) -> DVec3 {
        let first = self.vertices[0];
        let sum: DVec3 = self.vertices().iter().map(|&p| p - first).sum();
        #[allow(clippy::cast_precision_loss, reason = "a few vertices")]
        let n = self.count as f64;
        first + sum / n
    }

    fn largest_coordinate(&self) -> f64 {
        self.vertices()
            .iter()
            .map(|p| p.abs().max_element())
            .fold(0.0, f64::max)
    }

    /// The vertices, counter-clockwise about the normal.
    #[inline]
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices[..self.count]
    }

    /// The unit normal, by the right-hand rule.
    #[inline]
    #[must_use]
    pub const fn normal(&self) -> DVec3 {
        self.normal
    }

    /// The area in squared scene units.
    #[inline]
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.area
    }

    /// The centre of mass, for a polygon of uniform density.
    #[must_use]
    pub fn centroid(&self) -> DVec3 {
        let v0 = self.vertices[0];
        let mut weighted = DVec3::ZERO;
        let mut total = 0.0;
        for pair in self.vertices()[1..].windows(2) {
            let (e, g) = (pair[0] - v0, pair[1] - v0);
            let a = e.cross(g).dot(self.normal);
            weighted += (e + g) * a;
            total += a;
        }
        if total > 0.0 {
            v0 + weighted / (3.0 * total)
        } else {
            self.mean()
        }
    }

    /// Stores the vertices relative to the point `x` in `out`, and returns the part of `out` that
    /// is in use.
    pub fn relative_to<'a>(&self, x: DVec3, out: &'a mut [DVec3; Self::CAPACITY]) -> &'a [DVec3] {
        let vertices = self.vertices();
        for (to, from) in out.iter_mut().zip(vertices) {
            *to = *from - x;
        }
        &out[..vertices.len()]
    }

    /// Returns the polygon moved by a vector.
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Self {
        for vertex in &mut self.vertices[..self.count] {
            *vertex += by;
        }
        self
    }

    /// An upper bound of the largest distance between two vertices; at most twice that distance.
    #[must_use]
    pub fn diameter(&self) -> f64 {
        let first = self.vertices[0];
        2.0 * predicates::longest(self.vertices().iter().map(|&p| p - first))
    }

    /// Returns a vertex and the two edge vectors that begin there, if the polygon is a
    /// parallelogram up to 8 ε of its size and coordinates; `None` for other polygons.
    #[inline]
    #[must_use]
    pub fn as_parallelogram(&self) -> Option<(DVec3, DVec3, DVec3)> {
        let v = &self.vertices;
        self.parallelogram.then(|| (v[0], v[1] - v[0], v[3] - v[0]))
    }

    /// Returns the frame of the polygon's plane, with its origin at the first vertex and its x axis
    /// along the first edge that is longer than a millionth of the diameter.
    #[must_use]
    pub fn plane_frame(&self) -> PlaneFrame {
        let tangent = self.longest_leading_edge();
        PlaneFrame::new(self.vertices[0], self.normal, tangent)
    }

    /// Returns the first edge that is longer than a millionth of the diameter; zero if there is
    /// none.
    fn longest_leading_edge(&self) -> DVec3 {
        let n = self.count;
        let least = 1e-6 * self.diameter();
        (0..n)
            .map(|i| self.vertices[(i + 1) % n] - self.vertices[i])
            .find(|e| e.length() > least)
            .unwrap_or(DVec3::ZERO)
    }

    /// Returns the same polygon with its list of vertices beginning at the given index, modulo
    /// their number.
    #[must_use]
    pub fn starting_at(&self, vertex: usize) -> Self {
        let mut out = *self;
        out.vertices[..self.count].rotate_left(vertex % self.count);
        out
    }

    /// Returns the polygon with reversed orientation.
    #[must_use]
    pub fn flipped(&self) -> Self {
        let mut out = *self;
        out.vertices[..self.count].reverse();
        out.normal = -self.normal;
        out
    }

    /// Returns the part of the polygon with `(p − point)·direction ≥ 0`; `None` if that part is
    /// empty or no wider than rounding errors, as in [`ConvexPolygon::new`].
    ///
    /// A clip adds at most one corner. When 8 clips of a polygon of [`MAX_VERTICES`] have filled
    /// [`ConvexPolygon::CAPACITY`], further corners are dropped.
    #[must_use]
    pub fn clip(&self, point: DVec3, direction: DVec3) -> Option<Self> {
        let side = |p: DVec3| direction.dot(p - point);
        let mut out = Self::from_raw(&[], self.normal, 0.0);
        let n = self.count;
        for i in 0..n {
            let (a, b) = (self.vertices[i], self.vertices[(i + 1) % n]);
            let (sa, sb) = (side(a), side(b));
            if sa >= 0.0 {
                out.push(a);
            }
            if (sa > 0.0 && sb < 0.0) || (sa < 0.0 && sb > 0.0) {
                out.push(a + (b - a) * (sa / (sa - sb)));
            }
        }
        if out.count < 3 {
            return None;
        }
        out.area = area_vector(out.vertices()).dot(self.normal);
        out.parallelogram = out.vertices() == self.vertices() && self.parallelogram;
        let is_rounding = is_rounding(out.area, out.diameter(), self.largest_coordinate());
        (!is_rounding && out.area.is_finite()).then_some(out)
    }

    fn push(&mut self, p: DVec3) {
        if self.count < Self::CAPACITY {
            self.vertices[self.count] = p;
            self.count += 1;
        }
    }
}

/// Whether an area of a polygon with diameter `size` is zero up to rounding: whether the polygon is
/// no wider than the distance by which points that should be on a line are off it, with coordinates
/// up to `largest`.
fn is_rounding(area: f64, size: f64, largest: f64) -> bool {
    2.0 * area <= COLLINEAR * largest * size
}

/// The area as a vector along the normal: half the sum of the cross products of a fan of triangles.
fn area_vector(points: &[DVec3]) -> DVec3 {
    let v0 = points[0];
    let fan = points[1..]
        .windows(2)
        .map(|w| predicates::cross(w[0] - v0, w[1] - v0));
    0.5 * fan.sum::<DVec3>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regular(n: usize, radius: f64) -> Vec<DVec3> {
        #[allow(clippy::cast_precision_loss, reason = "small counts")]
        let step = std::f64::consts::TAU / n as f64;
        #[allow(clippy::cast_precision_loss, reason = "small counts")]
        let corner = |i: usize| {
            let (s, c) = (i as f64 * step).sin_cos();
            DVec3::new(radius * c, radius * s, 1.0)
        };
        (0..n).map(corner).collect()
    }

    #[test]
    fn regular_polygons_have_their_area_and_centroid() {
        for n in 3..=MAX_VERTICES {
            let p = ConvexPolygon::new(&regular(n, 2.0)).unwrap();
            #[allow(clippy::cast_precision_loss, reason = "small counts")]
            let want = 2.0 * n as f64 * (std::f64::consts::TAU / n as f64).sin();
            // n additions of terms of the size of the result
            assert!((p.area() - want).abs() < 32.0 * f64::EPSILON * want);
            assert!((p.centroid() - DVec3::Z).length() < 32.0 * f64::EPSILON * 2.0);
            assert!((p.normal() - DVec3::Z).length() < 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn bad_polygons_are_named() {
        use PolygonError as E;
        let z = DVec3::ZERO;
        let (x, y) = (DVec3::X, DVec3::Y);
        let nan = DVec3::splat(f64::NAN);
        assert_eq!(ConvexPolygon::new(&[z, x]), Err(E::Count(2)));
        assert_eq!(ConvexPolygon::new(&[z, x, nan]), Err(E::NotFinite(2)));
        assert_eq!(ConvexPolygon::new(&[z, x, 2.0 * x]), Err(E::Degenerate));
        let dart = [
            z,
            DVec3::new(1.0, 0.4, 0.0),
            2.0 * y,
            DVec3::new(-1.0, 0.4, 0.0),
        ];
        let dart = [dart[0], dart[1], DVec3::new(0.0, 0.2, 0.0), dart[3]];
        assert!(matches!(ConvexPolygon::new(&dart), Err(E::NotConvex(_))));
        let bent = [z, x, x + y, y + 0.01 * DVec3::Z];
        assert!(matches!(ConvexPolygon::new(&bent), Err(E::NotPlanar(_))));
        let star: Vec<_> = regular(5, 1.0);
        let star = [star[0], star[2], star[4], star[1], star[3]];
        assert!(matches!(ConvexPolygon::new(&star), Err(E::NotConvex(_))));
        // A sliver with a spike four times as long, no wider than the tolerance, whose centroid was
        // outside: found by a property with extreme numbers.
        let spike = [
            DVec3::new(1.220_703_125e-4, -0.015_625, 0.0),
            DVec3::new(0.0, 128.0, 2.441_406_25e-4),
            z,
            z,
            DVec3::new(32.0, 1.0, 0.001_953_125),
        ];
        assert!(matches!(ConvexPolygon::new(&spike), Err(E::NotConvex(_))));
    }

    #[test]
    fn clipping_splits_the_area() {
        let p = ConvexPolygon::new(&regular(7, 1.0)).unwrap();
        let direction = DVec3::new(0.6, -0.8, 0.1);
        let point = DVec3::new(0.1, 0.2, 1.0);
        let kept = p.clip(point, direction).unwrap();
        let other = p.clip(point, -direction).unwrap();
        assert!((kept.area() + other.area() - p.area()).abs() < 16.0 * f64::EPSILON * p.area());
        assert!(kept.area() > 0.1 && other.area() > 0.1);
        assert!(p.clip(DVec3::splat(9.0), DVec3::ONE).is_none());
        assert_eq!(p.clip(-DVec3::splat(9.0), DVec3::ONE).unwrap(), p);
    }

    #[test]
    fn parallelograms_are_recognised() {
        let (o, u, v) = (
            DVec3::new(0.1, 0.2, 0.3),
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.3, 0.7, 0.2),
        );
        let p = ConvexPolygon::parallelogram(o, u, v).unwrap();
        let (po, pu, pv) = p.as_parallelogram().unwrap();
        // flattening moves each vertex by the rounding of its height
        let tol = 8.0 * f64::EPSILON;
        assert!((po - o).length() < tol && (pu - u).length() < tol && (pv - v).length() < tol);
        let q = ConvexPolygon::new(&regular(5, 1.0)[..4]).unwrap();
        assert!(q.as_parallelogram().is_none());
        assert!((p.flipped().normal() + p.normal()).length() < tol);
    }
}
