//! Whether patches hide two polygons from each other, and which patches are between the two.
//!
//! ```text
//!           p               patches              q
//!           │ ╲ ─ ─ ─ ─ ─ ─ ─ ─│─ ─ ─ ─ ─ ─ ─ ╱ │
//!           │            │     │             │   │   between: patches that meet the hull of p, q
//!           │            │                       │   blockers: their parts that lie before both
//!           │ ╱ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ─ ╲ │
//! ```
//!
//! Cheap tests come first, and each step leaves less to the next:
//!
//! 1. Clip both polygons to the parts before the plane of the other ([`before_each_other`]). If a
//!    part is empty, they are facing away.
//! 2. Find the patches that meet the convex hull of these parts: no other patch is between them.
//! 3. If one of these patches hides everything, they are hidden.
//! 4. Clip the patches to the parts that lie before both. If there are none, the view is clear.
//! 5. If no point of the adaptive rule sees a part past these blockers, they are hidden, too.
//!    Otherwise an integral is needed.

use crate::cubature::places;
use crate::facets::Facets;
use crate::hull::{Hull, hides_all};
use crate::pair::by_area;
use crate::point::Memory;
use crate::view::unseen_below;
use linelit_geometry::{ConvexPolygon, DVec3, stop};
use std::rc::Rc;

/// The step that determined the exchange of two facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairOutcome {
    /// Neither facet has a part before the other's plane on a side that faces it.
    #[default]
    Facing,
    /// A single patch hides everything, or no point of the adaptive rule on either polygon sees the
    /// other.
    Hidden,
    /// No patch is between them.
    Clear,
    /// A part is hidden, so the exchange was integrated by an adaptive rule.
    Partly,
}

/// What two polygons see of each other.
pub(crate) enum Sight {
    /// They do not see each other, since neither has a part before the other.
    FacingAway,
    /// They do not see each other, since everything is hidden.
    Hidden,
    /// They see at least a part of each other.
    Visible(Box<VisiblePair>),
}

/// Two polygons that see at least a part of each other.
pub(crate) struct VisiblePair {
    /// The parts of both that lie before each other; first the part of the facet with the lower
    /// number.
    pub polygons: [ConvexPolygon; 2],
    /// The parts of patches that hide some of one polygon from the other; the parts that hide most
    /// come first. Empty where the view is clear.
    pub blockers: Vec<ConvexPolygon>,
}

impl Sight {
    /// The step that determined the exchange.
    pub(crate) fn settled(&self) -> PairOutcome {
        match self {
            Self::FacingAway => PairOutcome::Facing,
            Self::Hidden => PairOutcome::Hidden,
            Self::Visible(pair) if pair.blockers.is_empty() => PairOutcome::Clear,
            Self::Visible(_) => PairOutcome::Partly,
        }
    }
}

/// The patches that may be between two polygons.
#[derive(Clone)]
pub(crate) enum Candidates {
    /// Any patch.
    All,
    /// The patches with these numbers, among which are all patches between the two polygons. For
    /// inner nodes of a patch's tree some may be missing, since a child's rectangle may extend
    /// beyond its parent's; then the search only goes further down than necessary. For leaves none
    /// is missing.
    These(Rc<[usize]>),
}

impl Facets {
    /// Finds what two polygons see of each other, each clipped to the part before the other. The
    /// polygons are in the order of their facets' indices, and are parts of the patches `own`,
    /// which may be in either order.
    pub(crate) fn sight(
        &self,
        polygons: [ConvexPolygon; 2],
        own: [usize; 2],
        candidates: &Candidates,
        memory: &mut Memory,
    ) -> Sight {
        let between = self.patches_between(&polygons, own, candidates, false);
        if self.is_hidden(&polygons, own, &between) {
            return Sight::Hidden;
        }
        let blockers = self.blockers(&polygons, own, &between);
        if !blockers.is_empty() {
            // Try the smaller polygon first, since its points are closer to each other.
            let [small, large] = by_area(&polygons);
            let is_seen =
                sees(small, large, &blockers, memory) || sees(large, small, &blockers, memory);
            if !is_seen {
                return Sight::Hidden;
            }
        }
        Sight::Visible(Box::new(VisiblePair { polygons, blockers }))
    }

    /// Returns those of the candidates that overlap the inside of the hull of two polygons, or,
    /// with `or_touches`, touch its surface.
    pub(crate) fn patches_between(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        candidates: &Candidates,
        or_touches: bool,
    ) -> Vec<usize> {
        let mut between = Vec::new();
        if matches!(candidates, Candidates::These(none) if none.is_empty()) {
            return between;
        }
        // Test patches against the hull, except for the two patches themselves.
        let hull = Hull::new(p.vertices(), q.vertices(), self.flatness(own));
        let mut room = [Vec::new(), Vec::new()];
        let mut meet = |k: usize| {
            stop::check();
            if !own.contains(&k) && hull.meets(&self.patches[k].polygon, or_touches, &mut room) {
                between.push(k);
            }
        };
        // Test the candidates, or all patches whose boxes the hull may overlap.
        match candidates {
            Candidates::These(numbers) => numbers.iter().for_each(|&k| meet(k)),
            Candidates::All => {
                let holds = |low: DVec3, high: DVec3| hull.may_hold(low, high);
                self.patch_tree.find(holds, meet);
            }
        }
        between
    }

    /// Returns the tolerance for flatness of two patches: a corner that is less far above or below
    /// the plane of one of them counts as lying in this plane.
    pub(crate) fn flatness(&self, [a, b]: [usize; 2]) -> f64 {
        self.patches[a].flatness.max(self.patches[b].flatness)
    }

    /// Whether a single patch hides two polygons from each other completely.
    pub(crate) fn is_hidden(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        between: &[usize],
    ) -> bool {
        between.iter().any(|&k| {
            let flatness = self.flatness(own).max(self.patches[k].flatness);
            hides_all(
                &self.patches[k].polygon,
                p.vertices(),
                q.vertices(),
                flatness,
            )
        })
    }

    /// Returns the parts of patches that lie before both polygons; the parts that hide most come
    /// first.
    fn blockers(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        between: &[usize],
    ) -> Vec<ConvexPolygon> {
        let middle = p.centroid();
        // Estimate how much each part hides by its solid angle from the centroid of the first
        // polygon.
        let size = |polygon: &ConvexPolygon| {
            let to = polygon.centroid() - middle;
            let square = to.length_squared();
            polygon.area() * polygon.normal().dot(to).abs() / (square * square.sqrt())
        };
        // Clip the patches, and sort what is left.
        let flatness = |k: usize| self.flatness(own).max(self.patches[k].flatness);
        let cut = |&k: &usize| before_all(&self.patches[k].polygon, &[p, q], flatness(k));
        let cut = between.iter().filter_map(cut);
        let mut blockers: Vec<(f64, ConvexPolygon)> = cut.map(|b| (size(&b), b)).collect();
        blockers.sort_by(|a, b| b.0.total_cmp(&a.0));
        blockers.into_iter().map(|(_, blocker)| blocker).collect()
    }
}

/// Whether any point of the adaptive rule in a polygon sees a part of another.
pub(crate) fn sees(
    p: &ConvexPolygon,
    q: &ConvexPolygon,
    blockers: &[ConvexPolygon],
    memory: &mut Memory,
) -> bool {
    places(p).any(|x| {
        let [open, visible] = memory.view.factors(x, p.normal(), q, blockers.iter());
        visible > unseen_below(open)
    })
}

/// Returns the parts of two polygons that lie before the plane of the other; `None` unless each
/// polygon has a corner at least `room` before the other's plane.
pub(crate) fn before_each_other(
    p: &ConvexPolygon,
    q: &ConvexPolygon,
    room: f64,
) -> Option<[ConvexPolygon; 2]> {
    let above = |a: &ConvexPolygon, b: &ConvexPolygon, room: f64| {
        let (n, origin) = (b.normal(), b.vertices()[0]);
        let heights = a.vertices().iter().map(|v| n.dot(*v - origin));
        heights.filter(|height| *height > room).count()
    };
    // Polygons that face away need no clipping.
    if above(q, p, room) == 0 || above(p, q, room) == 0 {
        return None;
    }
    let part = |a: &ConvexPolygon, b: &ConvexPolygon| {
        if above(a, b, -room) == a.vertices().len() {
            return Some(*a);
        }
        a.clip(b.vertices()[0], b.normal())
    };
    Some([part(p, q)?, part(q, p)?])
}

/// Returns the part of a patch that lies before the planes of all of some polygons; `None` if there
/// is none.
pub(crate) fn before_all(
    patch: &ConvexPolygon,
    polygons: &[&ConvexPolygon],
    room: f64,
) -> Option<ConvexPolygon> {
    let mut part = *patch;
    for other in polygons {
        let (n, origin) = (other.normal(), other.vertices()[0]);
        let heights = || part.vertices().iter().map(|v| n.dot(*v - origin));
        if heights().all(|h| h <= room) {
            return None;
        }
        if heights().any(|h| h < 0.0) {
            part = part.clip(origin, n)?;
        }
    }
    Some(part)
}
