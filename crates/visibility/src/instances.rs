//! The instances of occluders, under a small hierarchy of their boxes.

use crate::{
    Hit, Instance, Occluders, Ray, Scratch, filtered,
    ray::{self, RayQuery},
};
use linelit_simd::{InstructionSet, Simd, dispatch};
use std::{collections::HashSet, sync::Arc};

/// Instances, and the boxes that they are in.
#[derive(Clone, Debug)]
pub(crate) struct Instances {
    pub(crate) list: Vec<Instance>,
    pub(crate) bounds: Vec<[[f32; 3]; 2]>,
    /// A triangle for each, with the same box.
    pub(crate) boxes: Occluders,
}

/// The box of what is nowhere: a triangle that hides nothing, and is left out.
const NOWHERE: [[f32; 3]; 2] = [[f32::NAN; 3]; 2];

impl Instances {
    /// `None` without any.
    pub(crate) fn new(list: Vec<Instance>) -> Option<Self> {
        if list.is_empty() {
            return None;
        }
        let bounds = |instance: &Instance| instance.bounds().unwrap_or(NOWHERE);
        let bounds: Vec<_> = list.iter().map(bounds).collect();
        let corners = |&[lo, hi]: &[[f32; 3]; 2]| [lo, [lo[0], hi[1], lo[2]], hi];
        let positions: Vec<_> = bounds.iter().flat_map(corners).collect();
        let triangles: Vec<_> = (0_u32..)
            .step_by(3)
            .map(|first| [first, first + 1, first + 2])
            .take(list.len())
            .collect();
        Some(Self {
            boxes: Occluders::build(&positions, &triangles),
            bounds,
            list,
        })
    }

    /// Bytes that they take, each hierarchy once.
    pub(crate) fn memory(&self) -> usize {
        let mut seen = HashSet::new();
        let others = self.list.iter().map(|one| &one.occluders.hierarchy);
        let others = others.filter(|one| seen.insert(Arc::as_ptr(one)));
        let hierarchies: usize = others.map(|one| one.memory()).sum();
        let boxes = self.boxes.memory() + size_of_val(&self.bounds[..]);
        hierarchies + boxes + size_of_val(&self.list[..])
    }

    pub(crate) fn limited_to(&self, limit: InstructionSet) -> Self {
        let limited = |instance: &Instance| instance.limited_to(limit);
        Self {
            list: self.list.iter().map(limited).collect(),
            bounds: self.bounds.clone(),
            boxes: self.boxes.clone().limited_to(limit),
        }
    }

    /// The boxes that a ray enters, and where.
    fn along(&self, ray: &Ray, met: &mut Vec<(f32, u32)>, scratch: &mut Scratch) {
        let tests = scratch.counters.triangle_tests;
        boxes_along(self.boxes.isa, &self.boxes, ray, met, scratch);
        // What was looked at are boxes.
        scratch.counters.triangle_tests = tests;
    }

    /// What a ray of this mask meets first: `hit`, or something nearer.
    pub(crate) fn closest(
        &self,
        mask: u32,
        ray: &Ray,
        hit: Option<Hit>,
        scratch: &mut Scratch,
    ) -> Option<Hit> {
        let mut best = hit;
        let mut ray = *ray;
        if let Some(hit) = best {
            ray.t_max = hit.t;
        }
        let mut met = std::mem::take(&mut scratch.boxes);
        self.along(&ray, &mut met, scratch);
        for &(near, number) in &met {
            let instance = &self.list[number as usize];
            if f64::from(near) > ray.t_max || instance.mask & mask == 0 {
                continue;
            }
            let Some(hit) = instance.closest(&ray, scratch) else {
                continue;
            };
            // Of equally near ones the first: their own triangles, then by the number.
            #[allow(clippy::float_cmp, reason = "the tie rule is about equal bits")]
            let after = |best: Hit| hit.t == best.t && best.instance < Some(number);
            if !best.is_some_and(after) {
                ray.t_max = hit.t;
                best = Some(Hit {
                    instance: Some(number),
                    ..hit
                });
            }
        }
        scratch.boxes = met;
        best
    }

    /// Whether a ray of this mask meets anything.
    pub(crate) fn any(&self, mask: u32, ray: &Ray, scratch: &mut Scratch) -> bool {
        let mut met = std::mem::take(&mut scratch.boxes);
        self.along(ray, &mut met, scratch);
        let hides = met.iter().any(|&(_, number)| {
            let instance = &self.list[number as usize];
            instance.mask & mask != 0 && instance.any(ray, scratch)
        });
        scratch.boxes = met;
        hides
    }
}

impl Instance {
    fn closest(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        scratch.counters.instances += 1;
        let (occluders, ray) = (&*self.occluders, self.bring_ray(ray));
        match &self.filter {
            None => ray::closest(occluders.isa, occluders, &ray, scratch),
            Some(filter) => {
                filtered::ray(occluders.isa, occluders, &ray, &**filter, false, scratch)
            }
        }
    }

    fn any(&self, ray: &Ray, scratch: &mut Scratch) -> bool {
        scratch.counters.instances += 1;
        let (occluders, ray) = (&*self.occluders, self.bring_ray(ray));
        match &self.filter {
            None => {
                // What is remembered is of other triangles.
                let last = scratch.last.take();
                let hides = ray::any(occluders.isa, occluders, &ray, &(0..0), scratch);
                scratch.last = last;
                hides
            }
            Some(filter) => {
                filtered::ray(occluders.isa, occluders, &ray, &**filter, true, scratch).is_some()
            }
        }
    }
}

/// The boxes that a ray enters and where at the earliest: whole leaves of them.
#[inline(always)]
fn boxes_along_kernel<S: Simd>(
    s: S,
    boxes: &Occluders,
    ray: &Ray,
    out: &mut Vec<(f32, u32)>,
    scratch: &mut Scratch,
) {
    out.clear();
    let Some(mut q) = RayQuery::new(boxes, ray, &(0..0)) else {
        return;
    };
    q.nearest_first(s, boxes, scratch, |_, near, leaf, among| {
        let count = among.count_ones() as usize;
        out.extend(leaf.id[..count].iter().map(|&id| (near, id)));
        false
    });
}

dispatch! {
    /// Finds the boxes that a ray enters, on an instruction set.
    fn boxes_along = boxes_along_kernel(boxes: &Occluders, ray: &Ray, out: &mut Vec<(f32, u32)>, scratch: &mut Scratch) -> ()
}
