//! Rays: their closest hits, and whether they hit anything. Here are the methods of [`Occluders`]
//! for single rays and for fans; the modules below have the kernels.

mod closest;
pub(crate) mod fan;
pub(crate) mod packet;
pub(crate) mod ray;
pub(crate) mod together;
pub(crate) mod watertight;

use crate::{Fan, Hit, Occluders, Ray, Scratch};
use fan::{FAN, FEW};
use linelit_geometry::{DVec3, Margins};
use std::ops::Range;

impl Occluders {
    /// Returns the closest triangle that the ray hits, or `None` if the ray hits none. Among
    /// equally near triangles, a solid one comes before one with holes, and then the one with the
    /// smallest index.
    ///
    /// The test is watertight: a ray towards a shared edge or corner hits one of the triangles
    /// there. A triangle with holes counts only where its filter says that it hides what is behind.
    pub fn closest_hit(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        scratch.counters.rays += 1;
        let hit = self.own_closest(ray, scratch);
        match &self.holes {
            None => hit,
            Some(holes) => holes.closest(ray, hit, &mut scratch.rays, &mut scratch.counters),
        }
    }

    /// Whether the ray hits any triangle. Solid triangles with indices in `exclude` are ignored;
    /// triangles with holes are not.
    ///
    /// The same triangles count as hit as for [`Occluders::closest_hit`].
    pub fn any_hit(&self, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool {
        scratch.counters.rays += 1;
        let Scratch { rays, counters, .. } = scratch;
        let is_met = ray::any(self.bvh.isa, &self.bvh, ray, exclude, rays, counters);
        is_met || self.any_with_holes(ray, scratch)
    }

    /// Returns the closest hit among the solid triangles.
    fn own_closest(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        let Scratch { rays, counters, .. } = scratch;
        ray::closest(self.bvh.isa, &self.bvh, ray, rays, counters)
    }

    /// Whether a triangle with holes hides something from the ray.
    #[inline]
    fn any_with_holes(&self, ray: &Ray, scratch: &mut Scratch) -> bool {
        match &self.holes {
            None => false,
            Some(holes) => holes.any(ray, &mut scratch.rays, &mut scratch.counters),
        }
    }

    /// Returns the fan of shadow rays from `origin` to points given relative to it, shortened by
    /// the margins at both ends.
    ///
    /// A fan has one `t_min` for all rays: the margin near the origin for the ray that goes
    /// farthest.
    #[must_use]
    pub fn shadow_rays<'a>(
        &self,
        origin: DVec3,
        directions: &'a [DVec3],
        margins: Margins,
    ) -> Fan<'a> {
        let longest = |most: f64, d: &DVec3| most.max(d.length_squared());
        let square = directions.iter().fold(0.0, longest);
        let reach = self.bvh.reach(origin);
        Fan {
            origin,
            directions,
            t_min: margins.near(reach, square.sqrt()),
            t_max: ray::ray_end(margins),
        }
    }

    /// Returns a bit for each ray of a fan, as in [`Fan::all`], that is set if the ray hits a
    /// triangle other than the solid ones numbered in `exclude`. The answers are the same as with
    /// [`Occluders::any_hit`] for each ray.
    ///
    /// In the [`Counters`](crate::Counters), a test of several rays at once counts as one test.
    ///
    /// # Panics
    /// If there are more than [`FAN`] rays.
    pub fn any_hits(&self, fan: &Fan<'_>, exclude: &Range<u32>, scratch: &mut Scratch) -> u64 {
        let count = fan.directions.len();
        assert!(count <= FAN, "a bit for each ray");
        scratch.counters.rays += count as u64;
        let (bvh, all) = (&self.bvh, fan.all());
        let (rays, fans) = (&mut scratch.rays, &mut scratch.fans);
        let counters = &mut scratch.counters;
        let mut hidden = match count {
            0 => 0,
            1..FEW => fan::one_by_one(bvh, fan, all, exclude, rays, counters),
            _ => together::any(bvh.isa, bvh, fan, exclude, rays, fans, counters),
        };
        if self.holes.is_some() {
            for i in 0..count {
                let open = hidden >> i & 1 == 0;
                hidden |= u64::from(open && self.any_with_holes(&fan.ray(i), scratch)) << i;
            }
        }
        hidden
    }

    /// Finds the closest hit of each ray of a fan, and replaces the contents of `out` by them: the
    /// same as [`Occluders::closest_hit`] for one ray after the other, but faster where neighbours
    /// in the fan have almost the same direction, as rays through the pixels of a row have.
    ///
    /// The hits are bit-identical, except for rays that lie in the plane of a triangle up to
    /// rounding: whether and where such a triangle is hit is arbitrary. There may be any number of
    /// rays. In the [`Counters`](crate::Counters), a test of several rays at once counts as one
    /// test.
    pub fn closest_hits(&self, fan: &Fan<'_>, out: &mut Vec<Option<Hit>>, scratch: &mut Scratch) {
        out.clear();
        scratch.counters.rays += fan.directions.len() as u64;
        for directions in fan.directions.chunks(8) {
            let few = Fan { directions, ..*fan };
            let mut hits = [None; 8];
            let count = directions.len();
            let Scratch { fans, counters, .. } = &mut *scratch;
            let (bvh, isa) = (&self.bvh, self.bvh.isa);
            if count >= FEW && closest::closest(isa, bvh, &few, &mut hits, fans, counters) {
                out.extend_from_slice(&hits[..count]);
            } else {
                out.extend((0..count).map(|i| self.own_closest(&few.ray(i), scratch)));
            }
        }
        if let Some(holes) = &self.holes {
            for (i, hit) in out.iter_mut().enumerate() {
                *hit = holes.closest(&fan.ray(i), *hit, &mut scratch.rays, &mut scratch.counters);
            }
        }
    }
}
