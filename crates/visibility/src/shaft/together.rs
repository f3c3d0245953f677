//! The search for triangles that share edges and together hide a whole light that none of them
//! hides alone, as the two halves of a ceiling do.
//!
//! From a triangle over a point of the light, look across each edge that runs over the light for a
//! triangle on its other side:
//!
//! ```text
//!   +-----------------+        The diagonal crosses the light L. It has both triangles at it,
//!   |            . '  |        and the outer edges miss L: what the two cover of L has no
//!   |      L . '      |        boundary within L, so it is all of L.
//!   |    . ' L        |
//!   +-----------------+
//! ```
//!
//! The number of triangles over a point, which are all turned to run counter-clockwise, changes at
//! their edges alone. It does not change at an edge that two of them have in opposite directions.
//! Where no other edge meets the light, the number is the same over all of the light as over the
//! point where the search began, and so not zero. Projections of triangles share the ends of
//! their common edges exactly, so that no gap is invented or overlooked.

use super::frame::LightFrame;
use super::project::FlatTriangles;
use super::sweep::hidden_point;
use linelit_simd::Isa;

/// The largest number of projected triangles that are searched, for each of which there is a bit.
/// With more, the light does not count as hidden by this search.
const MOST: usize = 64;

/// The distance, in units of the light, within which an edge does not count as away from the light.
/// It leaves a margin for edges along the light's own sides.
const MARGIN: f64 = 1e-9;

type Point = [f64; 2];

/// Whether projected triangles that share edges hide the light as a whole.
pub(crate) fn hide(isa: Isa, flat: &FlatTriangles, frame: &LightFrame) -> bool {
    let light = &frame.corners[..frame.corner_count];
    // A single triangle that hides the light alone was found before.
    if !(2..=MOST).contains(&flat.count) || !light.iter().all(|&at| hidden_point(isa, flat, at)) {
        return false;
    }
    // Choose a point of the light that no symmetry of a scene puts on an edge.
    let last = light[light.len() - 1];
    let across = light[light.len() / 2];
    let mix = |k: usize| 0.41 * light[0][k] + 0.36 * across[k] + 0.23 * last[k];
    let inside = [mix(0), mix(1)];
    let mut images = [[[0.0; 2]; 3]; MOST];
    for (image, of) in images.iter_mut().zip(flat.get_from(0)) {
        *image = counter_clockwise(of);
    }
    let mut search = Search {
        light,
        inside,
        images: &images[..flat.count],
        matched: [0; MOST],
    };
    (0..flat.count).any(|start| search.covers(start))
}

/// A search across the common edges of projected triangles.
struct Search<'a> {
    /// The light's corners: a convex polygon in either orientation, or the two ends of a line.
    light: &'a [Point],
    /// A point within the light.
    inside: Point,
    images: &'a [[Point; 3]],
    /// For each projected triangle, a bit for each of its edges that has been matched with an edge
    /// in the opposite direction of another triangle.
    matched: [u8; MOST],
}

impl Search<'_> {
    /// Whether the projected triangle `start` and the triangles that the search reaches from it
    /// across edges hide the light.
    fn covers(&mut self, start: usize) -> bool {
        let [a, b, c] = self.images[start];
        if ![(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(a, b)| side(a, b, self.inside) > 0.0)
        {
            return false;
        }
        self.matched = [0; MOST];
        let (mut reached, mut waiting) = (1_u64 << start, 1_u64 << start);
        while waiting != 0 {
            let i = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            for k in 0..3 {
                if self.matched[i] >> k & 1 != 0 || self.misses(self.edge(i, k)) {
                    continue;
                }
                let Some((j, l)) = self.opposite(self.edge(i, k)) else {
                    return false;
                };
                self.matched[i] |= 1 << k;
                self.matched[j] |= 1 << l;
                waiting |= 1 << j & !reached;
                reached |= 1 << j;
            }
        }
        true
    }

    fn edge(&self, i: usize, k: usize) -> [Point; 2] {
        [self.images[i][k], self.images[i][(k + 1) % 3]]
    }

    /// Returns an edge in the opposite direction that is not matched yet: the index of its
    /// triangle, and the index of the edge in that triangle; `None` if there is no such edge.
    fn opposite(&self, [from, to]: [Point; 2]) -> Option<(usize, usize)> {
        let edges = (0..self.images.len()).flat_map(|j| [(j, 0), (j, 1), (j, 2)]);
        let mut unmatched = edges.filter(|&(j, l)| self.matched[j] >> l & 1 == 0);
        unmatched.find(|&(j, l)| self.edge(j, l) == [to, from])
    }

    /// Whether an edge does not meet the light: a line separates them, which is the edge's own line
    /// or one along a side of the light.
    fn misses(&self, [a, b]: [Point; 2]) -> bool {
        let mut sides = self.light.iter().map(|&corner| side(a, b, corner));
        let first = sides.next().unwrap_or(0.0);
        if first != 0.0 && sides.all(|other| first * other > 0.0) {
            return true;
        }
        let is_line = self.light.len() == 2;
        (0..self.light.len()).any(|i| {
            let (c, d) = (self.light[i], self.light[(i + 1) % self.light.len()]);
            let (a, b) = (side(c, d, a), side(c, d, b));
            a * b > 0.0 && (is_line || a * side(c, d, self.inside) < 0.0)
        })
    }
}

/// Returns a triangle turned so that its corners run counter-clockwise.
fn counter_clockwise([a, b, c]: [Point; 3]) -> [Point; 3] {
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Returns the signed distance of a point from the line through two others, positive on its left,
/// times the distance of these two points; zero within the [margin](MARGIN).
fn side(from: Point, to: Point, at: Point) -> f64 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let value = along[0] * (at[1] - from[1]) - along[1] * (at[0] - from[0]);
    let margin = MARGIN * (along[0].abs() + along[1].abs());
    if value.abs() > margin { value } else { 0.0 }
}
