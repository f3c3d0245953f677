//! Triangles with holes: a second hierarchy next to the one of the solid triangles, and a filter.
//! The queries of `Occluders` combine the results of both hierarchies.

pub(crate) mod alpha;
mod collect;
pub(crate) mod filter;
pub(crate) mod filtered;

use crate::{
    bvh::Bvh,
    counters::Counters,
    rays::ray::{Hit, Ray, RayScratch},
};
use filter::SharedFilter;
use filtered::Past;
use linelit_geometry::{DVec3, Margins};

/// The triangles into which a filter cuts holes.
#[derive(Clone, Debug)]
pub(crate) struct Holes {
    pub(crate) bvh: Bvh,
    pub(crate) filter: SharedFilter,
}

impl Holes {
    /// Returns the closest hit of a ray: `hit`, its closest hit with a solid triangle, or the hit
    /// with a triangle with holes if that is nearer.
    pub(crate) fn closest(
        &self,
        ray: &Ray,
        hit: Option<Hit>,
        scratch: &mut RayScratch,
        counters: &mut Counters,
    ) -> Option<Hit> {
        let t_max = hit.map_or(ray.t_max, |hit| hit.t);
        let nearer = self.meet(&Ray { t_max, ..*ray }, false, scratch, counters);
        // Of equally near triangles, the solid one wins.
        nearer
            .filter(|new| hit.is_none_or(|old| new.t < old.t))
            .or(hit)
    }

    /// Whether a triangle with holes hides something from a ray.
    pub(crate) fn any(&self, ray: &Ray, scratch: &mut RayScratch, counters: &mut Counters) -> bool {
        self.meet(ray, true, scratch, counters).is_some()
    }

    fn meet(
        &self,
        ray: &Ray,
        any: bool,
        scratch: &mut RayScratch,
        counters: &mut Counters,
    ) -> Option<Hit> {
        filtered::meet(
            self.bvh.isa,
            &self.bvh,
            ray,
            &*self.filter,
            any,
            scratch,
            counters,
        )
    }

    /// Returns the query for the parts of a light that triangles with holes do not hide from a
    /// point.
    pub(crate) fn past(&self, point: DVec3, margins: Margins) -> Past<'_> {
        Past {
            bvh: &self.bvh,
            filter: &*self.filter,
            point,
            margins,
        }
    }
}
