//! The brute-force oracle, which tests every triangle against every line in `f64`, without a
//! hierarchy. It is slow and plain. Tests compare with it, and queries fall back on it for lines
//! whose coordinates the kernels cannot represent.

use crate::bvh::{Bvh, FAR};
use linelit_elementary::{exp2, log2};
use linelit_geometry::{
    Chord, DVec3, Margins, Segment, ShadowTriangle,
    intervals::{Interval, IntervalTree, VisibleSet},
};
use std::ops::Range;

/// Returns the intervals of a line that are visible from `point`, that is, not hidden by any
/// triangle except for those with indices in `exclude`, as parameters of the line in ascending
/// order. `margins` say how close to the point and to the line a triangle hides nothing, as
/// fractions of the way between the two.
#[must_use]
pub fn visible(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    point: DVec3,
    line: &Segment,
    exclude: &Range<u32>,
    margins: Margins,
) -> Vec<Interval> {
    let mut set = IntervalTree::full();
    // Find the distance beyond which lights count as far.
    let corner = |c: &u32| DVec3::from(positions[*c as usize].map(f64::from));
    let farthest = |reach: f64, c| reach.max((corner(c) - point).length());
    let reach = FAR * triangles.as_flattened().iter().fold(0.0, farthest);
    // Subtract the interval that each triangle hides.
    if let Some(shadow) = ShadowTriangle::new(point, line) {
        let shadow = shadow.with_margins(margins, reach);
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

/// The length of a line, as a fraction of its distance, below which it is handled as a point:
/// coordinates in the triangle that it spans with the shading point lose more than 1e-10 to
/// cancellation then.
const POINT_LIKE: f64 = 1e-6;

/// The parts of a line that no triangle of a hierarchy hides.
pub(crate) struct PastAll {
    pub(crate) parts: Vec<Interval>,
    /// Whether the line is so short for its distance that it is handled as [a point](POINT_LIKE);
    /// `parts` are inaccurate then.
    pub(crate) point_like: bool,
}

/// Returns the parts of a line that no triangle of a hierarchy hides, at any distance and scale;
/// `None` if the shading point lies on the line or sees it end on.
pub(crate) fn past_all(
    bvh: &Bvh,
    point: DVec3,
    line: &Segment,
    exclude: &Range<u32>,
    margins: Margins,
) -> Option<PastAll> {
    // Subtract what each triangle hides.
    let view = LineView::new(bvh, point, line, margins)?;
    let mut set = IntervalTree::full();
    for (leaf, triangles) in bvh.hierarchy.leaves.iter().enumerate() {
        for (lane, id) in triangles.id.iter().enumerate() {
            // Lanes that are not in use repeat the first.
            let repeated = lane > 0 && *id == triangles.id[0];
            if exclude.contains(id) || repeated {
                continue;
            }
            if let Some(chord) = view.chord(8 * leaf + lane) {
                let blocked = chord.hidden();
                set.clip(blocked.lo, blocked.hi);
            }
        }
    }
    Some(PastAll {
        parts: pieces(&set),
        point_like: view.point_like,
    })
}

/// A line as seen from a shading point, to be tested against triangles of a hierarchy one by one.
pub(crate) struct LineView<'a> {
    bvh: &'a Bvh,
    point: DVec3,
    shadow: ShadowTriangle,
    /// The factor by which all lengths are scaled: a power of two, so that the scaling rounds
    /// nothing, chosen so that the line's coordinates are near one and products of them cannot
    /// overflow.
    unit: f64,
    /// Whether the line is handled as a point: see [`POINT_LIKE`].
    pub(crate) point_like: bool,
}

impl<'a> LineView<'a> {
    /// Prepares a line for tests, scaled to a size near one; `None` if the point lies on the line
    /// or sees it end on.
    pub(crate) fn new(
        bvh: &'a Bvh,
        point: DVec3,
        line: &Segment,
        margins: Margins,
    ) -> Option<Self> {
        let relative = line.relative_to(point);
        let largest = relative.p0.abs().max(relative.p1.abs()).max_element();
        let unit = exp2(log2(largest).floor()).recip();
        let scaled = Segment::new(relative.p0 * unit, relative.p1 * unit);
        let reach = bvh.reach(point) * unit;
        Some(Self {
            bvh,
            point,
            shadow: ShadowTriangle::new(DVec3::ZERO, &scaled)?.with_margins(margins, reach),
            unit,
            point_like: scaled.length() < POINT_LIKE,
        })
    }

    /// Returns the segment in which a triangle crosses the plane of the shading point and the line;
    /// `None` if it does not cross the plane. The triangle's `slot` is leaf × 8 + lane.
    #[inline]
    pub(crate) fn chord(&self, slot: usize) -> Option<Chord> {
        let leaf = &self.bvh.hierarchy.leaves[slot / 8];
        let corner = |v: [f32; 3]| {
            let world = DVec3::from(v.map(f64::from)) + self.bvh.origin;
            self.shadow.vertex((world - self.point) * self.unit)
        };
        self.shadow.chord(&leaf.triangle(slot % 8).map(corner))
    }
}
