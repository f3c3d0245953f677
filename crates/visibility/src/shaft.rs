//! Shafts: everything between a shading point and a light.

use crate::{
    Occluders, Scratch, VisibleLines,
    frame::LightFrame,
    merge, project, sweep,
    traverse::{self, ShaftBounds},
};
use linelit_geometry::{DVec3, Segment};
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
    /// The shading point, in world space.
    point: DVec3,
    frame: Option<LightFrame>,
    class: ShaftClass,
}

/// Images of lines on the light farther than this from parallel, in units of the light, make
/// groups of their own.
const PARALLEL: f64 = 1e-12;

impl Occluders {
    /// Finds what is between a point and a light.
    pub fn shaft<'a>(&'a self, query: ShaftQuery<'_>, scratch: &'a mut Scratch) -> Shaft<'a> {
        scratch.counters.shafts += 1;
        scratch.slots.clear();
        scratch.flat.clear();
        let mut corners = [DVec3::ZERO; 16];
        let count = query.light.len().min(16);
        for (c, v) in corners.iter_mut().zip(query.light) {
            *c = *v - query.point;
        }
        let corners = &corners[..count];
        let frame = LightFrame::new(corners);
        let mut blocked = false;
        if let Some(frame) = &frame {
            let Range { start, end } = query.exclude;
            let exclude = (start, end.saturating_sub(start));
            let point = query.point - self.origin;
            let bounds = ShaftBounds::new(self, point, corners, frame, exclude);
            traverse::collect(self.isa, self, &bounds, usize::MAX, scratch);
            if !scratch.slots.is_empty() {
                blocked = project::project(self.isa, self, point, frame, scratch);
            }
        }
        let counters = &mut scratch.counters;
        let class = if blocked {
            counters.blocked_shafts += 1;
            ShaftClass::Blocked
        } else if scratch.flat.count == 0 {
            counters.empty_shafts += 1;
            ShaftClass::Empty
        } else {
            counters.partial_shafts += 1;
            counters.candidates += scratch.flat.count as u64;
            ShaftClass::Partial
        };
        Shaft {
            occluders: self,
            scratch,
            point: query.point,
            frame,
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

    /// The number of triangles (or pieces of triangles) that may hide a part of the light; zero
    /// for an empty or blocked shaft.
    #[must_use]
    pub fn candidates(&self) -> usize {
        match self.class {
            ShaftClass::Partial => self.scratch.flat.count,
            ShaftClass::Empty | ShaftClass::Blocked => 0,
        }
    }

    /// The visible intervals of lines on the light, replacing what `out` held.
    ///
    /// Lines of one direction that follow each other are answered together. A line without
    /// length is visible.
    pub fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        out.clear();
        self.scratch.counters.line_queries += lines.len() as u64;
        match (self.class, self.frame) {
            (ShaftClass::Partial, Some(frame)) => {
                let mut rest = lines;
                while !rest.is_empty() {
                    let count = self.group(&frame, rest, out);
                    rest = &rest[count..];
                }
            }
            (ShaftClass::Blocked, _) => lines.iter().for_each(|_| out.finish_line()),
            _ => lines.iter().for_each(|_| out.push_whole()),
        }
        self.scratch.counters.intervals += out.interval_count() as u64;
    }

    /// Answers the lines at the front that share a direction and tells how many they are.
    fn group(&mut self, frame: &LightFrame, lines: &[Segment], out: &mut VisibleLines) -> usize {
        let ends = &mut self.scratch.ends;
        ends.clear();
        let mut along = [0.0; 2];
        for line in lines {
            let a = frame.project(line.p0 - self.point);
            let b = frame.project(line.p1 - self.point);
            let d = [b[0] - a[0], b[1] - a[1]];
            let length = d[0].hypot(d[1]);
            if along == [0.0; 2] && length > 0.0 {
                along = [d[0] / length, d[1] / length];
            }
            let off = along[0] * d[1] - along[1] * d[0];
            if !(off.abs() <= PARALLEL) {
                break;
            }
            ends.push((a, b));
        }
        // A line that is not finite answers for itself.
        if ends.is_empty() {
            out.push_whole();
            return 1;
        }
        let count = ends.len();
        let scratch = &mut *self.scratch;
        order_lines(scratch, along);
        scratch.slots_per_line.reset(count);
        sweep::sweep(self.occluders.isa, scratch);
        finish_lines(scratch, out);
        count
    }

    /// Whether a point of the light is visible.
    pub fn point_visible(&mut self, light_point: DVec3) -> bool {
        self.scratch.counters.shaft_points += 1;
        match (self.class, &self.frame) {
            (ShaftClass::Partial, Some(frame)) => {
                let at = frame.project(light_point - self.point);
                !sweep::hidden_point(self.occluders.isa, &self.scratch.flat.blocks, at)
            }
            (class, _) => class != ShaftClass::Blocked,
        }
    }
}

/// Turns the lines' ends into (u, v) coordinates, in order of u.
fn order_lines(scratch: &mut Scratch, along: [f64; 2]) {
    let Scratch { ends, keys, lines, .. } = scratch;
    let across = |e: [f64; 2]| along[0] * e[1] - along[1] * e[0];
    let forward = |e: [f64; 2]| along[0] * e[0] + along[1] * e[1];
    keys.clear();
    keys.extend((0_u32..).zip(ends.iter()).map(|(i, (a, b))| {
        (0.5 * (across(*a) + across(*b)), i)
    }));
    if !keys.is_sorted_by(|a, b| a.0 <= b.0) {
        keys.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
    lines.clear(along);
    for &(u, i) in keys.iter() {
        let (a, b) = ends[i as usize];
        let (a, b) = (forward(a), forward(b));
        lines.push(u, a.min(b), a.max(b), i);
    }
    lines.index();
}

/// Merges what is hidden of each line and hands the rest out in the caller's order.
fn finish_lines(scratch: &mut Scratch, out: &mut VisibleLines) {
    let Scratch {
        ends,
        lines,
        slots_per_line,
        pieces,
        spans,
        ..
    } = scratch;
    pieces.clear();
    spans.clear();
    spans.resize(lines.number.len(), (0, 0));
    for (k, &number) in lines.number.iter().enumerate() {
        let (block, lane) = (k / 8, k % 8);
        let run = (lines.run_lo[block][lane], lines.run_hi[block][lane]);
        let span = (lines.from[block][lane], lines.to[block][lane]);
        let (a, b) = ends[number as usize];
        let reversed = (b[0] - a[0]) * lines.along[0] + (b[1] - a[1]) * lines.along[1] < 0.0;
        let start = pieces.len();
        if span.0 < span.1 {
            slots_per_line.finish(k, run, span, reversed, pieces);
        } else {
            pieces.push(linelit_geometry::intervals::Interval::UNIT);
        }
        spans[number as usize] = (start, pieces.len());
    }
    merge::gather(pieces, spans, out);
}
