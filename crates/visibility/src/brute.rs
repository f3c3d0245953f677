//! The oracle: every triangle against every line in `f64`, without a hierarchy.
//!
//! Slow and plain, for tests.

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
    if let Some(shadow) = ShadowTriangle::new(point, line) {
        for (id, corners) in (0_u32..).zip(triangles) {
            let t = corners.map(|c| {
                let v = positions[c as usize];
                DVec3::new(v[0].into(), v[1].into(), v[2].into())
            });
            if !exclude.contains(&id)
                && let Some(blocked) = shadow.blocked_by(&t)
            {
                set.clip(blocked.lo, blocked.hi);
            }
        }
    }
    let mut out = Vec::new();
    set.for_each(|i| out.push(i));
    out
}
