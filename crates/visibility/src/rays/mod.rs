//! Rays: what they meet first, and whether they meet anything.

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
    /// The nearest triangle that the ray meets; among equally near ones, that with the smallest
    /// number, and solid ones before those with holes.
    ///
    /// Watertight: a ray towards a shared edge or corner meets one of the triangles there. Of those
    /// with holes, it is the nearest that hides what is behind it.
    pub fn closest_hit(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        scratch.counters.rays += 1;
        let hit = self.own_closest(ray, scratch);
        match &self.holes {
            None => hit,
            Some(holes) => holes.closest(ray, hit, &mut scratch.rays, &mut scratch.counters),
        }
    }

    /// Whether the ray meets any triangle but the solid ones numbered in `exclude`.
    ///
    /// The same triangles count as for [`Occluders::closest_hit`].
    pub fn any_hit(&self, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool {
        scratch.counters.rays += 1;
        let Scratch { rays, counters, .. } = scratch;
        let is_met = ray::any(self.bvh.isa, &self.bvh, ray, exclude, rays, counters);
        is_met || self.any_with_holes(ray, scratch)
    }

    /// The nearest of the solid triangles.
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

    /// Shadow rays from a point to places given relative to it, short of the margins.
    ///
    /// All rays have the margin near the point of the one that goes farthest.
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

    /// Tells which rays of a fan meet any triangle but those numbered in `exclude`: a bit each, as
    /// in [`Fan::all`]. The answers are those of [`Occluders::any_hit`].
    ///
    /// In the [`Counters`](crate::Counters), what is tested for several rays at once is one test.
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

    /// Finds what each ray of a fan meets first, in place of what `out` held: as
    /// [`Occluders::closest_hit`] for one after the other, the quicker where neighbours in the fan
    /// go almost the same way, as through the pixels of a row.
    ///
    /// The hits are the same to the bit, but for rays in the plane of a triangle to rounding: where
    /// such a triangle is met is anyone's guess, and so is whether it is looked at. There may be
    /// any number of rays. In the [`Counters`](crate::Counters), what is tested for several rays at
    /// once is one test.
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
