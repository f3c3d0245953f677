//! View factors from a point to all facets, and the sunlit fraction of a facet: both with all
//! facets as blockers, and without quadrature.

use crate::facets::{Facets, Piece};
use crate::hull::Hull;
use crate::sight::before_all;
use crate::view::View;
use linelit_estimators::{Measure, VisibleRegion};
use linelit_geometry::{DVec3, Margins, Vector3, predicates, stop};
use linelit_visibility::{Scratch, ShaftQuery};
use std::f64::consts::FRAC_1_PI;

/// The margin near the point. If the point is on a facet up to rounding, rounding alone determines
/// the directions to that facet, so the facet hides nothing within this fraction of the way.
const NEAR: Margins = Margins {
    point: 1e-12,
    light: 0.0,
};

/// The view factors from a point to all facets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// For each facet, by its index, the view factor from the point to it.
    pub facets: Vec<f64>,
    /// The view factor to the sky: one minus the sum of all others.
    pub sky: f64,
}

/// Buffers for queries, to be reused from one query to the next.
#[derive(Debug, Default)]
pub struct Memory {
    pub(crate) view: View,
    pub(crate) region: VisibleRegion,
    pub(crate) scratch: Scratch,
}

impl Piece {
    /// Returns the facet that is seen from the side of the piece on which the point `x` is; `None`
    /// if the point is in the piece's plane, or if that side sends nothing.
    fn seen_from(&self, x: DVec3) -> Option<usize> {
        let corners = self.polygon.vertices();
        let [a, b, c] = [corners[0], corners[1], corners[2]];
        let height = predicates::determinant(b - a, c - a, x - a);
        match (height > 0.0, height < 0.0) {
            (true, _) => self.seen[0],
            (_, true) => self.seen[1],
            _ => None,
        }
    }
}

impl Facets {
    /// Computes the view factors from a point with a normal to all facets:
    ///
    /// ```text
    /// F(x, n → j) = 1/π ∫ V cos θ dω over facet j
    /// ```
    ///
    /// The view factors are exact up to rounding: they are Lambert's sum over the boundary of the
    /// visible part. A point that is not finite, or a normal without direction, sees only the sky.
    ///
    /// Among facets that are nearly in one plane, and closer together than the rounding to `f32`,
    /// the corners as given decide which hides the others. The point is lifted along the normal by
    /// twice [`Facets::displacement`], so that a point on a facet is not below the rounded facet;
    /// factors are off by up to about that length over the distance, no matter how large they are.
    pub fn from_point(
        &self,
        point: impl Vector3,
        normal: impl Vector3,
        memory: &mut Memory,
    ) -> Row {
        let mut row = Row {
            facets: vec![0.0; self.len()],
            sky: 1.0,
        };
        let x = point.dvec3() - self.middle;
        let Some(n) = predicates::normalize(normal.dvec3()).filter(|_| x.is_finite()) else {
            return row;
        };
        let x = x + n * (2.0 * self.displacement());
        for piece in &self.pieces {
            if let Some(facet) = piece.seen_from(x) {
                row.facets[facet] += self.piece(x, n, piece, memory);
            }
        }
        row.sky = 1.0 - row.facets.iter().sum::<f64>();
        row
    }

    /// Returns the view factor from a point to a piece, less what other pieces hide.
    fn piece(&self, x: DVec3, n: DVec3, piece: &Piece, memory: &mut Memory) -> f64 {
        stop::check();
        let corners = piece.polygon.vertices();
        if corners.iter().all(|v| n.dot(*v - x) <= 0.0) {
            return 0.0;
        }
        let query = ShaftQuery {
            margins: NEAR,
            ..ShaftQuery::new(x, &piece.polygon).excluding(piece.triangles.clone())
        };
        let Memory {
            region, scratch, ..
        } = memory;
        region.find(&self.occluders, query, scratch);
        FRAC_1_PI * region.measure(Measure::Cosine(n))
    }

    /// Returns the fraction of a facet that light from one direction reaches, such as sunlight; the
    /// direction points towards the sun. The fraction is exact up to rounding, 0 where the facet
    /// faces away, and the fraction of the lit side if facets have two.
    ///
    /// # Panics
    /// If there is no facet of this number.
    pub fn sunlit(&self, facet: usize, direction: impl Vector3, memory: &mut Memory) -> f64 {
        let Some(direction) = predicates::normalize(direction.dvec3()) else {
            return 0.0;
        };
        let lit = self
            .sides_of(facet)
            .filter(|side| side.polygon.normal().dot(direction) > 0.0);
        let area = lit.map(|side| {
            let p = side.polygon.vertices();
            // Extend the facet towards the sun, beyond all facets, and find the patches in that
            // space.
            let far: Vec<DVec3> = p.iter().map(|v| *v + 4.0 * self.size * direction).collect();
            let own = self.parts[side.part].patch;
            let hull = Hull::new(p, &far, self.patches[own].flatness);
            let (mut room, mut blockers) = ([Vec::new(), Vec::new()], Vec::new());
            let holds = |low: DVec3, high: DVec3| hull.may_hold(low, high);
            self.patch_tree.find(holds, |k| {
                let polygon = &self.patches[k].polygon;
                if k != own && hull.meets(polygon, false, &mut room) {
                    let flatness = self.flatness([own, k]);
                    blockers.extend(before_all(polygon, &[&side.polygon], flatness));
                }
            });
            memory.view.lit(direction, &side.polygon, &blockers)
        });
        let lit = area.fold(0.0, |sum, lit| sum + lit);
        // A facet that is wholly covered has no lit part.
        if self.area(facet) > 0.0 {
            lit / self.area(facet)
        } else {
            0.0
        }
    }
}
