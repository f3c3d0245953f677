//! Shafts: everything between a shading point and a light.

use crate::{
    Occluders, Scratch, VisibleLines,
    frame::LightFrame,
    traverse::{self, ShaftBounds},
};
use linelit_geometry::{
    DVec3, Segment, ShadowTriangle,
    intervals::{IntervalSet, VisibleSet},
};
use std::ops::Range;

/// What to look at: a light from a shading point.
#[derive(Clone, Debug)]
pub struct ShaftQuery<'a> {
    /// The shading point, already off its own surface.
    pub point: DVec3,
    /// The light: the 3 to 16 corners of a convex polygon, either way round, or the two ends of a
    /// linear light.
    pub light: &'a [DVec3],
    /// The light's own triangles, which do not hide it.
    pub exclude: Range<u32>,
}

/// How much of a light its occluders may hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaftClass {
    /// Nothing is between the point and the light: every line and point of it is visible. Also
    /// for a light seen edge on or without extent, which sheds no light that way.
    Empty,
    /// The light is hidden as a whole.
    Blocked,
    /// Something is in between.
    Partial,
}

/// A shading point's view of a light, found by one walk through the hierarchy for all of its
/// line samples and points.
#[derive(Debug)]
pub struct Shaft<'a> {
    occluders: &'a Occluders,
    scratch: &'a mut Scratch,
    point: DVec3,
    class: ShaftClass,
}

impl Occluders {
    /// Finds what is between a point and a light.
    pub fn shaft<'a>(&'a self, query: ShaftQuery<'_>, scratch: &'a mut Scratch) -> Shaft<'a> {
        scratch.counters.shafts += 1;
        scratch.slots.clear();
        let point = query.point - self.origin;
        let mut corners = [DVec3::ZERO; 16];
        let count = query.light.len().min(16);
        for (c, v) in corners.iter_mut().zip(query.light) {
            *c = *v - query.point;
        }
        let corners = &corners[..count];
        if let Some(frame) = LightFrame::new(corners) {
            let exclude = (query.exclude.start, query.exclude.end.saturating_sub(query.exclude.start));
            let bounds = ShaftBounds::new(self, point, corners, &frame, exclude);
            traverse::collect(self.isa, self, &bounds, usize::MAX, scratch);
        }
        let class = if scratch.slots.is_empty() {
            scratch.counters.empty_shafts += 1;
            ShaftClass::Empty
        } else {
            scratch.counters.partial_shafts += 1;
            ShaftClass::Partial
        };
        scratch.counters.candidates += scratch.slots.len() as u64;
        Shaft {
            occluders: self,
            scratch,
            point,
            class,
        }
    }
}

impl Shaft<'_> {
    /// How much may be hidden.
    #[must_use]
    pub fn class(&self) -> ShaftClass {
        self.class
    }

    /// The number of triangles inside the shaft.
    #[must_use]
    pub fn candidates(&self) -> usize {
        self.scratch.slots.len()
    }

    /// The visible intervals of lines on the light, replacing what `out` held.
    pub fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        out.clear();
        self.scratch.counters.line_queries += lines.len() as u64;
        for line in lines {
            let origin = self.occluders.origin;
            let line = Segment::new(line.p0 - origin, line.p1 - origin);
            let mut visible = IntervalSet::full();
            if let Some(shadow) = ShadowTriangle::new(self.point, &line) {
                for &slot in &self.scratch.slots {
                    let triangle = self.triangle(slot);
                    if let Some(blocked) = shadow.blocked_by(&triangle) {
                        visible.clip(blocked.lo, blocked.hi);
                    }
                }
            }
            visible.for_each(|i| out.push(i));
            out.finish_line();
        }
        self.scratch.counters.intervals += out.interval_count() as u64;
    }

    /// Whether a point of the light is visible.
    pub fn point_visible(&mut self, light_point: DVec3) -> bool {
        self.scratch.counters.shaft_points += 1;
        let a = light_point - self.occluders.origin - self.point;
        let ray = crate::watertight::WatertightRay::new(self.point, a);
        let range = linelit_geometry::POINT_MARGIN..=1.0 - linelit_geometry::LIGHT_MARGIN;
        !self.scratch.slots.iter().any(|&slot| {
            let leaf = &self.occluders.hierarchy.leaves[slot as usize / 8];
            ray.intersect(&leaf.triangle(slot as usize % 8))
                .is_some_and(|(t, _)| range.contains(&t))
        })
    }

    fn triangle(&self, slot: u32) -> [DVec3; 3] {
        let leaf = &self.occluders.hierarchy.leaves[slot as usize / 8];
        leaf.triangle(slot as usize % 8)
            .map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()))
    }
}
