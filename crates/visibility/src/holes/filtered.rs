//! Visibility of points and lines through triangles with holes: rays and lines that call a
//! [`Filter`](crate::Filter).

use crate::{
    brute::LineView,
    bvh::Bvh,
    counters::Counters,
    holes::{
        collect::{self, Collected},
        filter::AnyFilter,
    },
    lanes::Lanes,
    lines::VisibleLines,
    rays::ray::{Hit, Ray, RayQuery, RayScratch, shadow_ray},
    shaft::{block::has_length, frame::LightCorners},
};
use linelit_geometry::{
    DVec3, Margins, Segment,
    intervals::{Interval, IntervalSet, VisibleSet},
};
use linelit_simd::{Simd, dispatch};
use std::ops::ControlFlow;

/// Returns the closest hit of the ray with a triangle at a point where the filter says that the
/// triangle hides something; if `any` is true, the first such hit that is found, which need not be
/// the closest.
#[inline(always)]
fn meet_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    ray: &Ray,
    filter: &AnyFilter,
    any: bool,
    scratch: &mut RayScratch,
    counters: &mut Counters,
) -> Option<Hit> {
    let mut query = RayQuery::new(bvh, ray, &(0..0))?;
    let mut best: Option<Hit> = None;
    let mut asked = 0;
    query.nearest_first(
        s,
        bvh,
        &mut scratch.waiting,
        counters,
        #[inline(always)]
        |q, child, leaf| {
            // Find the triangles of the leaf that the ray hits, before what it has hit so far.
            let (met, t) = q.meets(s, leaf);
            let mut met = met & child.mask();
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
                // Call the filter; where the triangle hides, the ray ends.
                asked += 1;
                if filter.hides(triangle, barycentric) {
                    best = Some(Hit {
                        triangle,
                        t,
                        barycentric,
                    });
                    if any {
                        return ControlFlow::Break(());
                    }
                    q.end_at(t);
                }
            }
            ControlFlow::Continue(())
        },
    );
    counters.filtered += asked;
    best
}

dispatch! {
    /// [`meet_kernel`] on an instruction set.
    pub(crate) fn meet = meet_kernel(bvh: &Bvh, ray: &Ray, filter: &AnyFilter, any: bool, scratch: &mut RayScratch, counters: &mut Counters) -> Option<Hit>
}

/// If there are more triangles than this before a light, the triangles before each line are
/// searched for separately.
const MANY: usize = 48;

/// A query about which parts of a light the triangles with holes do not hide from a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Past<'a> {
    pub(crate) bvh: &'a Bvh,
    pub(crate) filter: &'a AnyFilter,
    pub(crate) point: DVec3,
    pub(crate) margins: Margins,
}

/// Buffers for queries with triangles with holes.
#[derive(Debug, Default)]
pub(crate) struct PastScratch {
    /// The triangles between the point and the light.
    light: Collected,
    /// The triangles between the point and one line.
    line: Collected,
    set: IntervalSet,
    hidden: Vec<Interval>,
    rays: RayScratch,
    visible: VisibleLines,
}

impl Past<'_> {
    /// Finds the triangles between the point and a light, and returns how many there are.
    pub(crate) fn look(
        &self,
        light: LightCorners<'_>,
        scratch: &mut PastScratch,
        counters: &mut Counters,
    ) -> usize {
        self.collect(light, &mut scratch.light, counters);
        scratch.light.slots.len()
    }

    fn collect(&self, light: LightCorners<'_>, all: &mut Collected, counters: &mut Counters) {
        all.light.set(light, &mut all.frame);
        all.frame.margins = self.margins;
        collect::between(self.bvh.isa, self.bvh, &self.point, all, counters);
    }

    /// Whether any triangle with holes hides a point of the light.
    pub(crate) fn hides(
        &self,
        target: DVec3,
        scratch: &mut PastScratch,
        counters: &mut Counters,
    ) -> bool {
        self.ray_meets(target, &mut scratch.rays, counters)
    }

    /// Whether the shadow ray to a point hits a triangle with holes where the triangle hides
    /// something; true if there is no such ray because a coordinate is not finite.
    fn ray_meets(&self, target: DVec3, rays: &mut RayScratch, counters: &mut Counters) -> bool {
        let Some(ray) = shadow_ray(self.bvh, self.point, target, self.margins) else {
            return true;
        };
        meet(
            self.bvh.isa,
            self.bvh,
            &ray,
            self.filter,
            true,
            rays,
            counters,
        )
        .is_some()
    }

    /// Reduces the visible parts of lines in `out` to the parts that triangles with holes do not
    /// hide either. The lines have to be on the light for which triangles were [found](Past::look).
    pub(crate) fn keep_visible(
        &self,
        lines: &[Segment],
        scratch: &mut PastScratch,
        counters: &mut Counters,
        out: &mut VisibleLines,
    ) {
        let mut kept = std::mem::take(&mut scratch.visible);
        kept.reset(lines.len());
        // Start from the visible parts, by clipping away the gaps between them; then clip the parts
        // that triangles with holes hide.
        for (i, line) in lines.iter().enumerate() {
            scratch.set.reset();
            let mut from = -1.0;
            for part in out.line(i) {
                scratch.set.clip(from, part.lo);
                from = part.hi;
            }
            scratch.set.clip(from, 2.0);
            self.clip(line, scratch, counters);
            kept.put_set(i, &scratch.set);
        }
        scratch.visible = std::mem::replace(out, kept);
    }

    /// Removes from `scratch.set` what triangles with holes hide of a line.
    fn clip(&self, line: &Segment, scratch: &mut PastScratch, counters: &mut Counters) {
        let PastScratch {
            light,
            line: own,
            set,
            hidden,
            rays,
            ..
        } = scratch;
        let view = LineView::new(self.bvh, self.point, line, self.margins);
        // A line seen end on is hidden if one of its ends is hidden. A line that is so short that
        // rounding decides which of its parts are hidden counts as hidden unless both ends are
        // visible.
        let rough = view.as_ref().is_none_or(|view| view.point_like);
        let mut dark = || {
            [line.p0, line.p1]
                .iter()
                .any(|end| self.ray_meets(*end, rays, counters))
        };
        if !has_length(line) || rough && dark() {
            set.clip(0.0, 1.0);
        }
        let Some(view) = view else {
            return;
        };
        // Search for the triangles before this line if there are many before the light.
        let mut few = &light.slots;
        if few.len() > MANY {
            self.collect((&[line.p0, line.p1]).into(), own, counters);
            few = &own.slots;
        }
        let leaves = &self.bvh.hierarchy.leaves;
        for &slot in few {
            let slot = slot as usize;
            if set.is_empty() {
                return;
            }
            let Some(chord) = view.chord(slot) else {
                continue;
            };
            // Skip triangles in whose interval everything is hidden already.
            let part = chord.hidden();
            let visible = set.as_slice();
            let next = visible.partition_point(|piece| piece.hi <= part.lo);
            if visible.get(next).is_none_or(|piece| piece.lo >= part.hi) {
                continue;
            }
            // Query the filter along the segment in which the plane of view cuts the triangle.
            hidden.clear();
            counters.filtered += 1;
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
