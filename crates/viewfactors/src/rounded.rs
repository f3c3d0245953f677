//! Rounding of polygons to `f32`, with corners that are exactly in one plane: the pieces that view
//! factors from points use.

use crate::facets::Piece;
use linelit_geometry::{ConvexPolygon, DVec3, predicates};
use linelit_visibility::Occluders;

/// Cuts a polygon with rounded corners into pieces that are exactly flat, and returns each piece
/// with its triangles, as indices of corners: one piece if all corners are in one plane, otherwise
/// one for each triangle. The fan of triangles begins at the least corner, so that facets back to
/// back are cut in the same way. Triangles without area are left out.
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

/// Collects rounded pieces, and the triangles that hide others.
#[derive(Default)]
pub(crate) struct Rounder {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    pieces: Vec<Piece>,
    /// The largest distance by which a corner was moved.
    pub displacement: f64,
}

impl Rounder {
    /// Adds a convex polygon with the facets that are seen on its two sides.
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

    /// Returns the pieces and the occluders made of their triangles.
    pub(crate) fn finish(self) -> (Vec<Piece>, Occluders) {
        (
            self.pieces,
            Occluders::build(&self.vertices, &self.triangles),
        )
    }
}

/// Returns the position of a corner after rounding to `f32`.
pub(crate) fn rounded(corner: &DVec3) -> DVec3 {
    corner.as_vec3().as_dvec3()
}

/// Returns the largest distance by which rounding moves some corners.
pub(crate) fn displacement(corners: &[DVec3]) -> f64 {
    let moved = corners.iter().map(|v| rounded(v).distance(*v));
    moved.fold(0.0, f64::max)
}
