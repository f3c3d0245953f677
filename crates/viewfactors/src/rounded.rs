//! What rounding to `f32` leaves of polygons: pieces that are exactly flat.

use crate::facets::Piece;
use linelit_geometry::{ConvexPolygon, DVec3, predicates};
use linelit_visibility::Occluders;

/// The pieces of a polygon with rounded corners, and their triangles by the numbers of corners: one
/// where all lie in one plane, else triangles. The fan begins at the least corner, so that facets
/// back to back are cut alike. What has no area is not among them.
pub(crate) fn flat_pieces(corners: &[DVec3]) -> Vec<(ConvexPolygon, Vec<[usize; 3]>)> {
    let n = corners.len();
    let key = |k: &usize| corners[*k].to_array();
    let by_place = |a: &usize, b: &usize| {
        let pairs = key(a).into_iter().zip(key(b));
        { pairs }
            .map(|(x, y)| x.total_cmp(&y))
            .fold(std::cmp::Ordering::Equal, |a, b| a.then(b))
    };
    let first = (0..n).min_by(by_place).unwrap_or(0);
    let fan = (1..n - 1).map(|k| [first, (first + k) % n, (first + k + 1) % n]);
    let [a, b, c] = [corners[0], corners[1], corners[2]];
    let height = |d: &DVec3| predicates::determinant(b - a, c - a, *d - a);
    let is_flat = corners[3..].iter().all(|d| height(d) == 0.0);
    let whole = is_flat.then(|| ConvexPolygon::new(corners).ok()).flatten();
    if let Some(polygon) = whole {
        return vec![(polygon, fan.collect())];
    }
    let one = |triangle: [usize; 3]| {
        let polygon = ConvexPolygon::new(&triangle.map(|v| corners[v])).ok()?;
        Some((polygon, vec![triangle]))
    };
    fan.filter_map(one).collect()
}

/// Collects pieces and the triangles that hide others.
#[derive(Default)]
pub(crate) struct Rounder {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    pieces: Vec<Piece>,
    /// The largest distance of a corner from where it was.
    pub displacement: f64,
}

impl Rounder {
    /// Adds a convex polygon, and the facets that are seen from either side of it.
    pub(crate) fn add(&mut self, seen: [Option<usize>; 2], corners: &[DVec3]) {
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let start = self.vertices.len();
        self.displacement = self.displacement.max(displacement(corners));
        let rounded: Vec<DVec3> = corners.iter().map(rounded).collect();
        self.vertices
            .extend(rounded.iter().map(|v| v.as_vec3().to_array()));
        for (polygon, triangles) in flat_pieces(&rounded) {
            let first = number(self.triangles.len());
            self.triangles
                .extend(triangles.iter().map(|t| t.map(|v| number(start + v))));
            self.pieces.push(Piece {
                polygon,
                seen,
                triangles: first..number(self.triangles.len()),
            });
        }
    }

    /// The pieces, and the occluders.
    pub(crate) fn finish(self) -> (Vec<Piece>, Occluders) {
        (
            self.pieces,
            Occluders::build(&self.vertices, &self.triangles),
        )
    }
}

/// The place of a corner when it is rounded.
pub(crate) fn rounded(corner: &DVec3) -> DVec3 {
    corner.as_vec3().as_dvec3()
}

/// The largest distance by which rounding moves some corners.
pub(crate) fn displacement(corners: &[DVec3]) -> f64 {
    let moved = corners.iter().map(|v| rounded(v).distance(*v));
    moved.fold(0.0, f64::max)
}
