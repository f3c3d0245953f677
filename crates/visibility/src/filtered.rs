//! Triangles with holes: what rays and lines meet past a [`Filter`](crate::Filter).

use crate::{
    AnyFilter, Hit, LightCorners, Occluders, Ray, Scratch, VisibleLines, bounds, brute::LineView,
    collect, ray::RayQuery, shaft::has_length, sweep::Lanes,
};
use linelit_geometry::{
    DVec3, Margins, Segment,
    intervals::{Interval, IntervalSet, VisibleSet},
};
use linelit_simd::{Simd, dispatch};

/// The nearest triangle that the ray meets where it hides something; with `any`, the first found.
#[inline(always)]
fn ray_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    ray: &Ray,
    filter: &AnyFilter,
    any: bool,
    scratch: &mut Scratch,
) -> Option<Hit> {
    let mut q = RayQuery::new(occluders, ray, &(0..0))?;
    let mut best: Option<Hit> = None;
    let mut asked = 0;
    q.nearest_first(s, occluders, scratch, |q, leaf, among| {
        let (met, t) = q.meets(s, leaf);
        let mut met = met & among;
        let mut at = Lanes([0.0; 8]);
        s.dstore(t, &mut at);
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            let (t, triangle) = (at[lane], leaf.id[lane]);
            #[allow(clippy::float_cmp, reason = "the tie rule is about equal bits")]
            let behind = |best: Hit| t > best.t || t == best.t && best.triangle < triangle;
            if best.is_some_and(behind) {
                continue;
            }
            let Some((t, barycentric)) = q.intersect(leaf, lane) else {
                continue;
            };
            asked += 1;
            if filter.hides(triangle, barycentric) {
                best = Some(Hit {
                    triangle,
                    t,
                    barycentric,
                });
                if any {
                    return true;
                }
                q.end_at(t);
            }
        }
        false
    });
    scratch.counters.filtered += asked;
    best
}

dispatch! {
    /// What a ray meets past a filter, on an instruction set.
    pub(crate) fn ray = ray_kernel(occluders: &Occluders, ray: &Ray, filter: &AnyFilter, any: bool, scratch: &mut Scratch) -> Option<Hit>
}

/// With more triangles than this in a shaft, each line looks for those between it and the point.
const MANY: usize = 48;

/// Triangles with holes between a point and a light: what is visible past them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Past<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) filter: &'a AnyFilter,
    pub(crate) point: DVec3,
    pub(crate) margins: Margins,
}

/// What asking about lines takes.
#[derive(Debug, Default)]
pub(crate) struct Room {
    set: IntervalSet,
    hidden: Vec<Interval>,
    /// Triangles between the point and the light.
    slots: Vec<u32>,
}

impl Past<'_> {
    /// Finds the triangles between the point and `scratch.light` and tells how many there are.
    pub(crate) fn look(&self, scratch: &mut Scratch) -> usize {
        scratch.frame.margins = self.margins;
        collect::between(self.occluders.isa, self.occluders, &self.point, scratch);
        scratch.found.len()
    }

    /// Whether anything hides a point.
    pub(crate) fn hides(&self, target: DVec3, scratch: &mut Scratch) -> bool {
        let Some(ray) = bounds::shadow_ray(self.occluders, self.point, target, self.margins) else {
            return true;
        };
        let isa = self.occluders.isa;
        self::ray(isa, self.occluders, &ray, self.filter, true, scratch).is_some()
    }

    /// The visible intervals of lines on the light that triangles were [found](Past::look) for.
    pub(crate) fn visible(
        &self,
        lines: &[Segment],
        scratch: &mut Scratch,
        room: &mut Room,
        out: &mut VisibleLines,
    ) {
        out.reset(lines.len());
        std::mem::swap(&mut room.slots, &mut scratch.found);
        for (i, line) in lines.iter().enumerate() {
            room.set.reset();
            self.clip(line, scratch, room);
            out.put_set(i, &room.set);
        }
        std::mem::swap(&mut room.slots, &mut scratch.found);
    }

    /// Clips off `room.set` what is hidden of a line.
    fn clip(&self, line: &Segment, scratch: &mut Scratch, room: &mut Room) {
        let Room { set, hidden, slots } = room;
        let view = LineView::new(self.occluders, self.point, line, self.margins);
        // Seen end on, a line is behind what an end is behind; one that is seen so small that
        // rounding decides its parts has none unless both ends are visible.
        let rough = view.as_ref().is_none_or(|view| view.point_like);
        let mut dark = || self.hides(line.p0, scratch) || self.hides(line.p1, scratch);
        if !has_length(line) || rough && dark() {
            set.clip(0.0, 1.0);
        }
        let Some(view) = view else {
            return;
        };
        let mut few = &*slots;
        if slots.len() > MANY
            && let Some(ends) = LightCorners::new(&[line.p0, line.p1])
        {
            scratch.light.set(ends, &mut scratch.frame);
            collect::between(self.occluders.isa, self.occluders, &self.point, scratch);
            few = &scratch.found;
        }
        let leaves = &self.occluders.hierarchy.leaves;
        for &slot in few {
            let slot = slot as usize;
            if set.is_empty() {
                return;
            }
            let Some(chord) = view.chord(slot) else {
                continue;
            };
            // Nothing to hide where all is hidden.
            let part = chord.hidden();
            let visible = set.as_slice();
            let next = visible.partition_point(|piece| piece.hi <= part.lo);
            if visible.get(next).is_none_or(|piece| piece.lo >= part.hi) {
                continue;
            }
            hidden.clear();
            scratch.counters.filtered += 1;
            let triangle = leaves[slot / 8].id[slot % 8];
            self.filter.hides_along(triangle, chord.ends(), hidden);
            for part in &*hidden {
                if part.lo < part.hi {
                    let [a, b] = [part.lo, part.hi].map(|s| chord.t(s.clamp(0.0, 1.0)));
                    set.clip(a.min(b), a.max(b));
                }
            }
        }
    }
}
