//! Triangles with holes beside those without: what is visible past both.

use crate::{
    Counters, Hit, LightCorners, Occluders, Ray, Scratch, Shaft, ShaftClass, SharedFilter,
    VisibleLines,
    filtered::{self, Past, Room},
};
use linelit_geometry::{DVec3, Margins, Segment};

/// Triangles that a filter cuts holes into.
#[derive(Clone, Debug)]
pub(crate) struct Holes {
    pub(crate) occluders: Occluders,
    pub(crate) filter: SharedFilter,
}

/// Room to ask triangles with holes.
#[derive(Debug, Default)]
pub(crate) struct HolesScratch {
    scratch: Scratch,
    visible: VisibleLines,
    common: VisibleLines,
    room: Room,
}

impl Holes {
    /// What a ray meets first: `hit`, or a triangle with holes that is nearer.
    pub(crate) fn closest(
        &self,
        ray: &Ray,
        hit: Option<Hit>,
        scratch: &mut Scratch,
    ) -> Option<Hit> {
        let t_max = hit.map_or(ray.t_max, |hit| hit.t);
        let nearer = self.meet(&Ray { t_max, ..*ray }, false, scratch);
        // Of equally near ones the solid triangle.
        nearer
            .filter(|new| hit.is_none_or(|old| new.t < old.t))
            .or(hit)
    }

    /// Whether a triangle hides something from a ray.
    pub(crate) fn any(&self, ray: &Ray, scratch: &mut Scratch) -> bool {
        self.meet(ray, true, scratch).is_some()
    }

    fn meet(&self, ray: &Ray, any: bool, scratch: &mut Scratch) -> Option<Hit> {
        let occluders = &self.occluders;
        filtered::ray(occluders.isa, occluders, ray, &*self.filter, any, scratch)
    }

    fn past(&self, point: DVec3, margins: Margins) -> Past<'_> {
        Past {
            occluders: &self.occluders,
            filter: &*self.filter,
            point,
            margins,
        }
    }
}

impl Counters {
    /// Takes over the work on triangles and boxes: what was asked is counted elsewhere.
    fn take_work(&mut self, other: &mut Self) {
        self.node_tests += other.node_tests;
        self.triangle_tests += other.triangle_tests;
        self.candidates += other.candidates;
        self.filtered += other.filtered;
        *other = Self::default();
    }
}

impl Shaft<'_> {
    /// Finds the triangles with holes in the shaft.
    pub(crate) fn look_for_holes(&mut self, holes: &Holes, light: LightCorners<'_>) {
        if self.class == ShaftClass::Blocked {
            return;
        }
        let past = holes.past(self.point, self.margins());
        let mut all = self.scratch.holes.take().unwrap_or_default();
        let own = &mut all.scratch;
        own.light.set(light, &mut own.frame);
        let count = past.look(own);
        let counters = &mut self.scratch.counters;
        counters.take_work(&mut own.counters);
        counters.candidates += count as u64;
        self.has_holes = count > 0;
        if self.has_holes && self.class == ShaftClass::Empty {
            self.class = ShaftClass::Partial;
        }
        self.scratch.holes = Some(all);
    }

    /// Keeps of lines on the light what is visible past the triangles with holes, too.
    pub(crate) fn past_holes(&mut self, lines: &[Segment], out: &mut VisibleLines) {
        if out.interval_count() == 0 {
            return;
        }
        self.ask_holes(|past, all| {
            past.visible(lines, &mut all.scratch, &mut all.room, &mut all.visible);
            out.keep_common(&all.visible, &mut all.common);
        });
    }

    /// Whether a triangle with holes hides a point of the light.
    pub(crate) fn hole_hides(&mut self, target: DVec3) -> bool {
        let mut hides = false;
        self.ask_holes(|past, all| hides = past.hides(target, &mut all.scratch));
        hides
    }

    fn ask_holes(&mut self, ask: impl FnOnce(&Past<'_>, &mut HolesScratch)) {
        let (Some(holes), Some(mut all)) = (&self.occluders.holes, self.scratch.holes.take())
        else {
            return;
        };
        ask(&holes.past(self.point, self.margins()), &mut all);
        self.scratch.counters.take_work(&mut all.scratch.counters);
        self.scratch.holes = Some(all);
    }
}
