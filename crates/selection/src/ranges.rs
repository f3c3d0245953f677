//! This module finds the lights, among many, that can light a point, without testing each of them.

use crate::bounds::{LightBounds, Reach};
use core::ops::Range;
use linelit_geometry::DVec3;
use linelit_lights::Light;

/// The largest number of lights in a group that is not divided.
const LEAF: usize = 4;

/// Lights in a given order, in groups of neighbours. The bounds of each group tell for which points
/// none of its lights is visible, so that a point can skip whole groups.
///
/// The groups are a binary tree over the order, stored so that each node precedes the nodes below
/// it:
///
/// ```text
///      lights   0 1 2 3 4 5 6 7 8 …       nodes   [0..16] [0..8] [0..4] [4..8] [8..16] …
///                                                    │       └─ next ──────────▲
///                                                    └─ next ─► the end
/// ```
///
/// A walk goes from node to node. If no light of a group can light the point, it continues at the
/// node's `next`, after all groups within, and otherwise at the following node. The order of the
/// lights is preserved, so that sums over them do not change by a bit.
///
/// ```
/// use linelit_selection::geometry::{ConvexPolygon, DVec3};
/// use linelit_selection::lights::{AreaLight, Emission, Light};
/// use linelit_selection::LightRanges;
/// // A hundred lamps that shine upwards, and one that shines down.
/// let lamp = |x: f64, [u, v]: [DVec3; 2]| {
///     let polygon = ConvexPolygon::parallelogram(DVec3::new(x, 0.0, 3.0), u, v).unwrap();
///     Light::Area(AreaLight { polygon, emission: Emission::one_sided(DVec3::ONE) })
/// };
/// let mut lamps: Vec<_> = (0..100).map(|i| lamp(f64::from(i), [DVec3::X, DVec3::Y])).collect();
/// lamps.push(lamp(0.0, [DVec3::Y, DVec3::X]));
/// let ranges = LightRanges::new(&lamps);
/// let found: Vec<_> = ranges.lighting(DVec3::ZERO, [DVec3::Z; 2]).flatten().collect();
/// assert!(found.contains(&100) && found.len() <= 4, "its group alone");
/// ```
#[derive(Clone, Debug, Default)]
pub struct LightRanges {
    nodes: Vec<Node>,
}

/// A group of neighbours.
#[derive(Clone, Debug)]
struct Node {
    /// The bounds of the group; `None` if its lights emit no light.
    bounds: Option<LightBounds>,
    lights: Range<usize>,
    /// The node after all groups within this one.
    next: usize,
}

impl LightRanges {
    /// Builds the groups of some lights.
    #[must_use]
    pub fn new<'a>(lights: impl IntoIterator<Item = &'a Light>) -> Self {
        let bounds: Vec<_> = lights.into_iter().map(LightBounds::new).collect();
        let mut ranges = Self::default();
        if !bounds.is_empty() {
            ranges.add(&bounds, 0..bounds.len());
        }
        ranges
    }

    /// Adds a group, and the groups within it.
    fn add(&mut self, all: &[Option<LightBounds>], lights: Range<usize>) {
        let union = |a: LightBounds, b: &LightBounds| a.union(b);
        let mut emitting = all[lights.clone()].iter().flatten();
        let bounds = emitting.next().map(|first| emitting.fold(*first, union));
        let node = self.nodes.len();
        self.nodes.push(Node {
            bounds,
            lights: lights.clone(),
            next: 0,
        });
        if lights.len() > LEAF {
            let middle = lights.start + lights.len() / 2;
            self.add(all, lights.start..middle);
            self.add(all, middle..lights.end);
        }
        self.nodes[node].next = self.nodes.len();
    }

    /// Returns the indices, in ascending ranges, of the lights that may light a surface at `x`
    /// above two horizons, which are given by two unit normals. They include all lights that emit
    /// and [`can_contribute`](crate::can_contribute) for both, and few others.
    pub fn lighting(
        &self,
        x: DVec3,
        normals: [DVec3; 2],
    ) -> impl Iterator<Item = Range<usize>> + '_ {
        let mut at = 0;
        core::iter::from_fn(move || {
            loop {
                let node = self.nodes.get(at)?;
                let reach = node.bounds.map_or(Reach::None, |b| reach(&b, x, normals));
                let is_leaf = node.next == at + 1;
                at = match reach {
                    Reach::Unknown if !is_leaf => at + 1,
                    _ => node.next,
                };
                if reach == Reach::All || reach == Reach::Unknown && is_leaf {
                    return Some(node.lights.clone());
                }
            }
        })
    }
}

/// Whether the lights of a group can light a point above both horizons.
fn reach(bounds: &LightBounds, x: DVec3, [n, other]: [DVec3; 2]) -> Reach {
    let first = bounds.reach(x, n);
    if first == Reach::None || n == other {
        return first;
    }
    match bounds.reach(x, other) {
        Reach::All => first,
        reach => reach,
    }
}
