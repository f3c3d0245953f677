//! A light as seen from a shading point, and the triangles that may be in between.

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

/// A light as seen from a shading point, and the triangles in between that are kept.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// The shading point, in world space.
    pub(crate) point: DVec3,
    /// The latest light.
    pub(crate) light: Light,
    /// The light as seen from the shading point.
    pub(crate) frame: LightFrame,
    /// Triangles in the shaft.
    pub(crate) corners: Box<Corners>,
    /// The images of the triangles on the light's plane.
    pub(crate) flat: FlatTriangles,
    /// Closed meshes that need half their triangles only.
    clear_of: ClearOfMesh,
}

/// A search for triangles between a point and a light, in the hierarchy's coordinates.
pub(crate) struct Look<'a> {
    pub(crate) point: DVec3,
    pub(crate) frame: &'a LightFrame,
    pub(crate) bounds: ShaftBounds,
    pub(crate) corners: &'a mut Corners,
    pub(crate) flat: &'a mut FlatTriangles,
    backfaces: BackfaceFilter<'a>,
}

impl Seen {
    /// A search from the shading point towards the light, or towards a `few` lines on it, given
    /// their frame and the box around them in the hierarchy's coordinates; `None` without
    /// [bounds](ShaftBounds::new).
    #[inline(always)]
    pub(crate) fn look<'a, S: Simd>(
        &'a mut self,
        s: S,
        bvh: &'a Bvh,
        exclude: (u32, u32),
        few: Option<(&'a LightFrame, [DVec3; 2])>,
    ) -> Option<Look<'a>> {
        let Self {
            light,
            frame,
            corners,
            flat,
            clear_of,
            ..
        } = self;
        corners.clear();
        frame.set_near(bvh.reach(self.point));
        let point = self.point - bvh.origin;
        let whole = || [light.lo, light.hi].map(|corner| corner - bvh.origin);
        let (frame, around) = few.unwrap_or_else(|| (frame, whole()));
        let meshes = bvh.hierarchy.meshes();
        let margins = frame.margins;
        Some(Look {
            point,
            frame,
            bounds: ShaftBounds::new(s, bvh.extent, point, around, frame, exclude)?,
            corners,
            flat,
            backfaces: BackfaceFilter::new(meshes, clear_of, point, around, margins, exclude),
        })
    }
}

impl Look<'_> {
    /// Keeps the triangles of a leaf named by `which`, for [`Look::project`]. There must be room
    /// for eight more.
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(&mut self, s: S, child: Child, leaf: &Leaf, which: u8) {
        let codes = || self.backfaces.codes(child.leaf_index());
        let meshes = self.backfaces.any().then(codes);
        self.corners
            .add(s, leaf, which, &child.slots(), meshes.as_ref());
    }

    /// Projects up to eight of the triangles kept, from `start` on: as
    /// [`project_some`](project::project_some).
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

    /// Projects all triangles kept and forgets those that miss the light; false if one of them
    /// hides it as a whole.
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

    /// Projects the triangles kept, eight at a time from the last on, as long as there are eight,
    /// or all of them, and hands the number of the first new image to `take`. False if a triangle
    /// hides the light as a whole, or `take` says that nothing more matters.
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
