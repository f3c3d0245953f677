//! The state of a shaft: a light as seen from a shading point, with the triangles in between, and
//! the functions that collect and project these triangles.

use crate::{
    bvh::Bvh,
    closed_mesh::{BackfaceFilter, ClearOfMesh},
    node::{Child, Leaf},
    shaft::{
        bounds::ShaftBounds,
        frame::{Light, LightFrame},
        project::{self, Corners, FlatTriangles},
    },
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// A light as seen from a shading point, and the triangles stored for it.
#[derive(Debug, Default)]
pub(crate) struct ShaftState {
    /// The shading point, in world space.
    pub(crate) point: DVec3,
    /// The light of the latest query.
    pub(crate) light: Light,
    /// The projective frame of the light for the shading point.
    pub(crate) frame: LightFrame,
    /// The triangles in the shaft.
    pub(crate) corners: Box<Corners>,
    /// The projections of the triangles onto the light's plane.
    pub(crate) flat: FlatTriangles,
    /// Cached answers to which closed meshes are clear of the shaft's ends.
    clear_of: ClearOfMesh,
}

/// A search for triangles between a point and a light, with coordinates relative to the hierarchy's
/// origin.
pub(crate) struct ShaftSearch<'a> {
    pub(crate) point: DVec3,
    pub(crate) frame: &'a LightFrame,
    pub(crate) bounds: ShaftBounds,
    pub(crate) corners: &'a mut Corners,
    pub(crate) flat: &'a mut FlatTriangles,
    backfaces: BackfaceFilter<'a>,
}

impl ShaftState {
    /// Begins a search from the shading point towards the light; or, if `few` is given, towards a
    /// few lines on the light, described by their frame and their bounding box in the hierarchy's
    /// coordinates. `None` if there are no [bounds](ShaftBounds::new).
    #[inline(always)]
    pub(crate) fn look<'a, S: Simd>(
        &'a mut self,
        s: S,
        bvh: &'a Bvh,
        exclude: (u32, u32),
        few: Option<(&'a LightFrame, [DVec3; 2])>,
    ) -> Option<ShaftSearch<'a>> {
        let Self {
            light,
            frame,
            corners,
            flat,
            clear_of,
            ..
        } = self;
        // Reset the state.
        corners.clear();
        frame.set_near(bvh.reach(self.point));
        // Bound the whole light or the few lines.
        let point = self.point - bvh.origin;
        let whole = || [light.lo, light.hi].map(|corner| corner - bvh.origin);
        let (frame, around) = few.unwrap_or_else(|| (frame, whole()));
        let meshes = bvh.hierarchy.meshes();
        let margins = frame.margins;
        Some(ShaftSearch {
            point,
            frame,
            bounds: ShaftBounds::new(s, bvh.extent, point, around, frame, exclude)?,
            corners,
            flat,
            backfaces: BackfaceFilter::new(meshes, clear_of, point, around, margins, exclude),
        })
    }
}

impl ShaftSearch<'_> {
    /// Stores the triangles of a leaf in the mask `which` for [`ShaftSearch::project`]. There must
    /// be capacity for eight more.
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(&mut self, s: S, child: Child, leaf: &Leaf, which: u8) {
        let codes = || self.backfaces.codes(child.leaf_index());
        let meshes = self.backfaces.any().then(codes);
        self.corners
            .add(s, leaf, which, &child.slots(), meshes.as_ref());
    }

    /// Projects up to eight of the stored triangles, from index `start` on, as
    /// [`project_some`](project::project_some) does.
    #[inline(always)]
    pub(crate) fn project<S: Simd, const SEPARATE: bool>(
        &mut self,
        s: S,
        start: usize,
    ) -> Option<u8> {
        let Self {
            point,
            frame,
            corners,
            flat,
            backfaces,
            ..
        } = self;
        project::project_some::<S, SEPARATE>(s, corners, start, *point, frame, flat, backfaces)
    }

    /// Projects all stored triangles, and removes those that miss the light; false if one of them
    /// hides the whole light.
    #[inline(always)]
    pub(crate) fn project_all<S: Simd>(&mut self, s: S) -> bool {
        let (mut kept, mut start) = (0, 0);
        while start < self.corners.count {
            let Some(mut inside) = self.project::<S, true>(s, start) else {
                return false;
            };
            let slots = &mut self.corners.slots;
            while inside != 0 {
                slots[kept] = slots[start + inside.trailing_zeros() as usize];
                kept += 1;
                inside &= inside - 1;
            }
            start += 8;
        }
        self.corners.count = kept;
        true
    }

    /// Projects stored triangles, eight at a time from the end, as long as there are eight, or all
    /// of them if `all` is true; calls `take` with the index of the first new projection after each
    /// step. Returns false if a triangle hides the whole light, or if `take` returns false because
    /// no other triangle matters.
    #[inline(always)]
    pub(crate) fn project_last<S: Simd>(
        &mut self,
        s: S,
        separate: bool,
        all: bool,
        mut take: impl FnMut(&mut FlatTriangles, usize) -> bool,
    ) -> bool {
        while self.corners.count >= 8 || all && self.corners.count > 0 {
            let start = self.corners.count.saturating_sub(8);
            let first = self.flat.count;
            let left = match separate {
                true => self.project::<S, true>(s, start),
                false => self.project::<S, false>(s, start),
            };
            self.corners.count = start;
            if left.is_none() || !take(self.flat, first) {
                return false;
            }
        }
        true
    }
}
