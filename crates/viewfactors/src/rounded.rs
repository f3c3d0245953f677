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

/// A piece, its facet, and its corners in their order in space.
struct Rounded {
    piece: Piece,
    facet: usize,
    key: Vec<[u32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Collects pieces and the triangles that hide others.
#[derive(Default)]
pub(crate) struct Rounder {
    vertices: Vec<[f32; 3]>,
    pieces: Vec<Rounded>,
    /// The largest distance of a corner from where it was.
    pub displacement: f64,
}

impl Rounder {
    /// Adds a convex polygon.
    pub(crate) fn add(&mut self, facet: usize, corners: &[DVec3]) {
        let first = u32::try_from(self.vertices.len()).unwrap_or(u32::MAX);
        let number = |v: usize| first.saturating_add(u32::try_from(v).unwrap_or(u32::MAX));
        let mut rounded = Vec::with_capacity(corners.len());
        for corner in corners {
            let near = corner.as_vec3();
            self.displacement = self.displacement.max(near.as_dvec3().distance(*corner));
            self.vertices.push(near.to_array());
            rounded.push(near.as_dvec3());
        }
        for (polygon, triangles) in flat_pieces(&rounded) {
            let triangles: Vec<_> = triangles.into_iter().map(|t| t.map(number)).collect();
            let mut corners: Vec<u32> = triangles.iter().flatten().copied().collect();
            corners.sort_unstable();
            corners.dedup();
            let bits = |v: &u32| self.vertices[*v as usize].map(|x| (x + 0.0).to_bits());
            let mut key: Vec<[u32; 3]> = corners.iter().map(bits).collect();
            key.sort_unstable();
            self.pieces.push(Rounded {
                piece: Piece {
                    polygon,
                    triangles: 0..0,
                },
                facet,
                key,
                triangles,
            });
        }
    }

    /// The pieces in the order of facets, the facet of each, and the occluders: triangles of pieces
    /// with the same corners are side by side, so that none of them hides another.
    pub(crate) fn finish(mut self, occluders: &mut Occluders) -> (Vec<Piece>, Vec<usize>) {
        let mut order: Vec<usize> = (0..self.pieces.len()).collect();
        order.sort_by(|a, b| self.pieces[*a].key.cmp(&self.pieces[*b].key));
        let mut triangles = Vec::new();
        let same = |a: &usize, b: &usize| self.pieces[*a].key == self.pieces[*b].key;
        let groups: Vec<Vec<usize>> = order.chunk_by(same).map(<[usize]>::to_vec).collect();
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        for group in groups {
            let first = number(triangles.len());
            for &k in &group {
                triangles.extend(&self.pieces[k].triangles);
            }
            for k in group {
                self.pieces[k].piece.triangles = first..number(triangles.len());
            }
        }
        *occluders = Occluders::build(&self.vertices, &triangles);
        self.pieces
            .into_iter()
            .map(|rounded| (rounded.piece, rounded.facet))
            .unzip()
    }
}
