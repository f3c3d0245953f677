//! The oracle: every triangle against every line in `f64`, without a hierarchy.
//!
//! Slow and plain, for tests, and for what kernels cannot hold in their numbers.

use crate::{Occluders, bounds};
use linelit_geometry::{
    DVec3, Segment, ShadowTriangle,
    intervals::{Interval, IntervalTree, VisibleSet},
};
use std::ops::Range;

/// The visible intervals of a line from a point, past all triangles but those in `exclude`.
#[must_use]
pub fn visible(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    point: DVec3,
    line: &Segment,
    exclude: &Range<u32>,
) -> Vec<Interval> {
    let mut set = IntervalTree::full();
    let corner = |c: &u32| DVec3::from(positions[*c as usize].map(f64::from));
    let farthest = |reach: f64, c| reach.max((corner(c) - point).length());
    let reach = triangles.as_flattened().iter().fold(0.0, farthest);
    if let Some(shadow) = ShadowTriangle::new(point, line) {
        let shadow = shadow.with_reach(reach);
        for (id, corners) in (0_u32..).zip(triangles) {
            let t = corners.each_ref().map(corner);
            if !exclude.contains(&id)
                && let Some(blocked) = shadow.blocked_by(&t)
            {
                set.clip(blocked.lo, blocked.hi);
            }
        }
    }
    pieces(&set)
}

fn pieces(set: &IntervalTree) -> Vec<Interval> {
    let mut out = Vec::new();
    set.for_each(|i| out.push(i));
    out
}

/// A line shorter than this for its distance: coordinates along its shadow triangle cancel to more
/// than 1e-10.
const POINT_LIKE: f64 = 1e-6;

/// The visible parts of a line past all triangles.
pub(crate) struct PastAll {
    pub(crate) parts: Vec<Interval>,
    /// Whether the line is seen as [a point](POINT_LIKE), and the parts are rough.
    pub(crate) point_like: bool,
}

/// The same past all triangles of a hierarchy, wherever the line is; `None` for a line that the
/// point lies on, or sees end on.
pub(crate) fn past_all(
    occluders: &Occluders,
    point: DVec3,
    line: &Segment,
    exclude: &Range<u32>,
) -> Option<PastAll> {
    let relative = line.relative_to(point);
    let largest = relative.p0.abs().max(relative.p1.abs()).max_element();
    // By a power of two: nothing is rounded, and nothing near one overflows.
    let unit = largest.log2().floor().exp2().recip();
    let scaled = Segment::new(relative.p0 * unit, relative.p1 * unit);
    let reach = bounds::reach(occluders, point - occluders.origin) * unit;
    let shadow = ShadowTriangle::new(DVec3::ZERO, &scaled)?.with_reach(reach);
    let mut set = IntervalTree::full();
    for leaf in &occluders.hierarchy.leaves {
        for (lane, id) in leaf.id.iter().enumerate() {
            // Lanes that are not in use repeat the first.
            let repeated = lane > 0 && *id == leaf.id[0];
            if exclude.contains(id) || repeated {
                continue;
            }
            let corner = |v: [f32; 3]| {
                let world = DVec3::from(v.map(f64::from)) + occluders.origin;
                (world - point) * unit
            };
            if let Some(blocked) = shadow.blocked_by(&leaf.triangle(lane).map(corner)) {
                set.clip(blocked.lo, blocked.hi);
            }
        }
    }
    Some(PastAll {
        parts: pieces(&set),
        point_like: scaled.length() < POINT_LIKE,
    })
}
