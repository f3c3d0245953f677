//! Shafts: everything between a shading point and a light.

use crate::{
    Occluders, Ray, Scratch, VisibleLines, block,
    dense::{self, DenseQuery},
    images::Images,
    sweep,
    walk::{self, Found},
};
use linelit_geometry::{DVec3, LIGHT_MARGIN, POINT_MARGIN, Segment};
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
    /// First and number of the light's own triangles.
    exclude: (u32, u32),
    class: ShaftClass,
    /// Too many triangles to keep.
    dense: bool,
}

/// More triangles than this make a shaft dense: its lines walk the hierarchy themselves, a few at
/// a time. Depends on the geometry alone; measured, see docs/performance.md.
pub(crate) const DENSE: usize = 224;

impl Occluders {
    /// Finds what is between a point and a light.
    pub fn shaft<'a>(&'a self, query: ShaftQuery<'_>, scratch: &'a mut Scratch) -> Shaft<'a> {
        scratch.counters.shafts += 1;
        if !scratch.light.is(query.light) {
            scratch.light.set(query.light, &mut scratch.frame);
        }
        let Range { start, end } = query.exclude;
        let exclude = (start, end.saturating_sub(start));
        let found = walk::find(self.isa, self, query.point, exclude, DENSE, scratch);
        let dense = found == Found::Many;
        let counters = &mut scratch.counters;
        let class = if found == Found::All {
            counters.blocked_shafts += 1;
            ShaftClass::Blocked
        } else if scratch.flat.count == 0 && !dense {
            counters.empty_shafts += 1;
            ShaftClass::Empty
        } else {
            counters.partial_shafts += 1;
            counters.dense_shafts += u64::from(dense);
            if !dense {
                counters.candidates += scratch.flat.count as u64;
            }
            ShaftClass::Partial
        };
        Shaft {
            occluders: self,
            scratch,
            point: query.point,
            exclude,
            class,
            dense,
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
    /// for an empty or blocked shaft. Of a dense shaft, a lower bound.
    #[must_use]
    pub fn candidates(&self) -> usize {
        match self.class {
            ShaftClass::Partial if self.dense => DENSE.max(self.scratch.flat.count),
            ShaftClass::Partial => self.scratch.flat.count,
            ShaftClass::Empty | ShaftClass::Blocked => 0,
        }
    }

    /// Whether there are too many triangles in between to keep them: then [`Self::candidates`] is
    /// a lower bound, and every few lines cost a walk of their own.
    #[must_use]
    pub fn is_dense(&self) -> bool {
        self.dense && self.class == ShaftClass::Partial
    }

    /// The triangles that may hide a part of the light, by their numbers in the list the
    /// occluders were built from, each once, in no particular order: together they hide all that
    /// is hidden. Of a closed mesh that neither the shading point nor the light is near, the
    /// triangles that face one way are left out, since those that face the other way hide as
    /// much. None for an empty or blocked shaft; `None` for a dense one, which does not keep
    /// them.
    ///
    /// Fewer than [`Self::candidates`] where triangles were cut to pieces. The order is the same
    /// on every instruction set.
    #[must_use]
    pub fn candidate_triangles(&self) -> Option<impl ExactSizeIterator<Item = u32> + '_> {
        let leaves = &self.occluders.hierarchy.leaves;
        let id = |&slot: &u32| leaves[slot as usize / 8].id[slot as usize % 8];
        Some(self.candidate_slots()?.iter().map(id))
    }

    /// The corners of [`Self::candidate_triangles`] in world space, as they were given: whole
    /// triangles, of which parts may be beyond the light or behind the shading point.
    #[must_use]
    pub fn candidate_corners(&self) -> Option<impl ExactSizeIterator<Item = [DVec3; 3]> + '_> {
        let hierarchy = &self.occluders.hierarchy;
        let corners = |&slot: &u32| {
            let leaf = &hierarchy.leaves[slot as usize / 8];
            let world = |v: [f32; 3]| DVec3::from(v.map(f64::from)) + self.occluders.origin;
            leaf.triangle(slot as usize % 8).map(world)
        };
        Some(self.candidate_slots()?.iter().map(corners))
    }

    /// The candidates as they lie before the light; `None` unless the shaft is partly hidden by
    /// few enough triangles to keep.
    #[must_use]
    pub fn images(&self) -> Option<Images<'_>> {
        (self.class == ShaftClass::Partial && !self.dense)
            .then(|| Images::new(&self.scratch.frame, &self.scratch.flat))
    }

    /// Where the candidates are: leaf × 8 + lane.
    fn candidate_slots(&self) -> Option<&[u32]> {
        match self.class {
            ShaftClass::Partial if self.dense => None,
            ShaftClass::Partial => Some(self.scratch.corners.slots()),
            ShaftClass::Empty | ShaftClass::Blocked => Some(&[]),
        }
    }

    /// The visible intervals of lines on the light, replacing what `out` held.
    ///
    /// Lines of one direction that follow each other are answered together. A line without
    /// length is visible.
    pub fn visible(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        out.reset(lines.len());
        self.scratch.counters.line_queries += lines.len() as u64;
        match self.class {
            ShaftClass::Partial => {
                let mut first = 0;
                while first < lines.len() {
                    first += self.group(lines, first, out);
                }
            }
            ShaftClass::Blocked => {}
            ShaftClass::Empty => (0..lines.len()).for_each(|i| out.put_whole(i)),
        }
        self.scratch.counters.intervals += out.interval_count() as u64;
    }

    /// Answers the lines from `first` on that share a direction and tells how many they are.
    fn group(&mut self, lines: &[Segment], first: usize, out: &mut VisibleLines) -> usize {
        let isa = self.occluders.isa;
        let which = (first, self.dense);
        let count = sweep::sweep(isa, self.point, &lines[first..], which, self.scratch, out);
        if count == 0 {
            // A line that is not finite.
            out.put_whole(first);
            return 1;
        }
        if self.dense {
            self.visible_dense(first, out);
        }
        count
    }

    /// Answers the lines of a dense shaft, a few at a time.
    fn visible_dense(&mut self, first: usize, out: &mut VisibleLines) {
        let point = self.point - self.occluders.origin;
        let mut start = 0;
        while start < self.scratch.ends.count {
            let Scratch {
                frame, ends, lines, ..
            } = &mut *self.scratch;
            let few = start..ends.count.min(start + dense::GROUP);
            start = few.end;
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in few.clone() {
                let i = ends.nth(k);
                low = low.min(ends.a[i]).min(ends.b[i]);
                high = high.max(ends.a[i]).max(ends.b[i]);
            }
            let across = (ends.u[ends.nth(few.start)], ends.u[ends.nth(few.end - 1)]);
            if !(low < high) {
                for k in few {
                    out.put_whole(first + ends.nth(k));
                }
                continue;
            }
            let along = ends.along;
            let around = frame.around_lines(along, [across.0, low], [across.1, high]);
            // In the coordinates of the few: q along, so that across is −p.
            lines.clear([0.0, 1.0]);
            let width = across.1 - across.0;
            let length = high - low;
            let to_p = |u: f64| {
                if around.corner_count == 2 {
                    0.0
                } else {
                    (u - (across.0 - 1e-6 * width)) / (width * (1.0 + 2e-6))
                }
            };
            let to_q = |v: f64| (v - (low - 1e-6 * length)) / (length * (1.0 + 2e-6));
            for k in few.rev() {
                let i = ends.nth(k);
                let stretch = (to_q(ends.a[i]), to_q(ends.b[i]));
                lines.push(-to_p(ends.u[i]), stretch, block::number(first, i));
            }
            let corners = frame.corners_in_space(along, [across.0, low], [across.1, high]);
            let (mut lo, mut hi) = (corners[0], corners[0]);
            for v in corners {
                lo = lo.min(v);
                hi = hi.max(v);
            }
            let query = DenseQuery {
                point,
                lo: lo + point,
                hi: hi + point,
                exclude: self.exclude,
            };
            dense::dense(
                self.occluders.isa,
                self.occluders,
                &query,
                &around,
                self.scratch,
                out,
            );
        }
    }

    /// Whether a point of the light is visible.
    pub fn point_visible(&mut self, light_point: DVec3) -> bool {
        self.scratch.counters.shaft_points += 1;
        match self.class {
            ShaftClass::Partial if self.dense => {
                let ray = Ray {
                    origin: self.point,
                    direction: light_point - self.point,
                    t_min: POINT_MARGIN,
                    t_max: 1.0 - LIGHT_MARGIN,
                };
                let exclude = self.exclude.0..self.exclude.0 + self.exclude.1;
                !self.occluders.any_hit(&ray, &exclude, self.scratch)
            }
            ShaftClass::Partial => {
                let at = self.scratch.frame.project(light_point - self.point);
                !sweep::hidden_point(self.occluders.isa, &self.scratch.flat, at)
            }
            class => class != ShaftClass::Blocked,
        }
    }
}
