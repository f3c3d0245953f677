//! The walk from front to back that looks for the triangles that hide a light or a few lines on it,
//! and skips boxes and triangles behind what is hidden already.
//!
//! A [`Cover`] records what is hidden. The *image* of a box or triangle is its projection from the
//! shading point onto the light's plane. A box or triangle whose image touches only hidden parts is
//! skipped, with everything in it: what it hides lies within what is hidden, so that the answer
//! stays bit-identical.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::{Child, Leaf, Node},
    shaft::{bounds::ShaftBounds, project::FlatTriangles, seen::ShaftSearch},
    surfaces::{NONE, Surfaces},
    walk::{NearestFirst, Waiting, nearest_first},
};
use linelit_simd::Simd;
use std::ops::ControlFlow;

/// Bounds of the projections of eight boxes or triangles: the least p and q, then the greatest.
pub(crate) type ImageBounds<S> = [[<S as Simd>::F; 2]; 2];

/// The projection of a box or triangle onto the light, in the representation of a [`Cover`].
pub(crate) trait Image: Copy {
    /// Eight projections as a structure of arrays.
    type Eight;

    /// The projection that covers everything.
    const ALL: Self;

    /// Returns eight projections, given their bounds in p and q.
    fn eight<S: Simd>(s: S, bounds: ImageBounds<S>) -> Self::Eight;

    /// Returns the projection in one lane of eight.
    fn of(images: &Self::Eight, lane: usize) -> Self;
}

/// The part of a light, or of a few lines on it, that is known to be hidden.
pub(crate) trait Cover<S: Simd> {
    /// The representation of the projection of a box or triangle.
    type Image: Image;

    /// Whether triangles whose projections miss the light are to be separated from it wherever that
    /// is possible.
    const SEPARATE: bool;

    /// Whether a box or triangle with this projection may hide anything that is not hidden yet.
    fn needs(&self, s: S, image: &Self::Image) -> bool;

    /// Computes [`Cover::needs`] for eight projections, and returns a bit for each; only the bits
    /// in `among` are used.
    fn needs_any(&self, s: S, among: u8, images: &<Self::Image as Image>::Eight) -> u8;

    /// Records the projected triangles from index `first` on; returns false if everything is hidden
    /// now.
    fn record(&mut self, s: S, flat: &mut FlatTriangles, first: usize) -> bool;
}

/// The visitor of the walk, which opens the nodes that the cover needs.
struct FrontToBack<'a, 'b, S: Simd, C: Cover<S>> {
    look: &'a mut ShaftSearch<'b>,
    cover: &'a mut C,
    /// The fine surfaces whose triangles are left out, or `None` if no triangles are.
    without: Option<&'a Surfaces>,
    /// The projections of the boxes in the open node, and a bit for each box that is before the
    /// shading point; boxes without that bit may have any projection.
    images: Option<<C::Image as Image>::Eight>,
    before: u8,
    isa: std::marker::PhantomData<S>,
}

impl<S: Simd, C: Cover<S>> NearestFirst<S> for FrontToBack<'_, '_, S, C> {
    type Entry = C::Image;

    #[inline(always)]
    fn wants(&self, s: S, _: f32, image: C::Image) -> bool {
        self.cover.needs(s, &image)
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, _: C::Image) -> (u8, S::F) {
        let bounds = &self.look.bounds;
        let mut found = bounds.boxes(s, node);
        if self.without.is_some() {
            found &= !node.all_fine;
        }
        let (least, most) = bounds.extents(s, node);
        let images = C::Image::eight(s, ShaftBounds::images(s, &least, &most));
        self.before = s.lt(s.splat(1e-6), least[2]);
        let needed = self.cover.needs_any(s, found & self.before, &images);
        self.images = Some(images);
        (found & (!self.before | needed), least[2])
    }

    #[inline(always)]
    fn entry(&self, _: S, _: &Node, lane: usize) -> Option<C::Image> {
        match &self.images {
            Some(images) if self.before >> lane & 1 != 0 => Some(C::Image::of(images, lane)),
            _ => Some(C::Image::ALL),
        }
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, _: C::Image) -> ControlFlow<()> {
        let mut mask = child.mask();
        // Leave out triangles of fine surfaces.
        if let Some(surfaces) = self.without {
            mask &= s.in_range(&surfaces.sides[child.leaf_index()][0], NONE, 1);
        }
        // Find the triangles that the cover needs; triangles that reach behind the shading point
        // have no bounded projection.
        let bounds = &self.look.bounds;
        let vertices = bounds.vertices(s, leaf);
        let (before, inside, low, high) = bounds.triangle_images(s, &vertices);
        let images = C::Image::eight(s, [low, high]);
        let maybe = before & inside & mask;
        let mut needed = maybe & self.cover.needs_any(s, maybe, &images);
        let behind = mask & !before;
        if behind != 0 {
            needed |= behind & bounds.within(s, &vertices);
        }
        needed &= bounds.included(s, leaf);
        if needed != 0 {
            self.look.keep(s, child, leaf, needed);
        }
        match take_in(s, self.look, self.cover, false) {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    }
}

/// Projects the collected triangles, eight at a time as long as there are eight, or all of them if
/// `all` is true, and records them in the cover. Returns false if everything is hidden now.
#[inline(always)]
pub(crate) fn take_in<S: Simd, C: Cover<S>>(
    s: S,
    look: &mut ShaftSearch<'_>,
    cover: &mut C,
    all: bool,
) -> bool {
    look.project_last(
        s,
        C::SEPARATE,
        all,
        #[inline(always)]
        |flat, first| cover.record(s, flat, first),
    )
}

/// Visits everything that waits and records all triangles that the cover needs. Returns false if
/// everything is hidden now.
#[inline(always)]
pub(crate) fn front_to_back<S: Simd, C: Cover<S>>(
    s: S,
    bvh: &Bvh,
    look: &mut ShaftSearch<'_>,
    cover: &mut C,
    without: Option<&Surfaces>,
    waiting: &mut Waiting<C::Image>,
    counters: &mut Counters,
) -> bool {
    let mut visitor = FrontToBack {
        look,
        cover,
        without,
        images: None,
        before: 0,
        isa: std::marker::PhantomData,
    };
    let ended = nearest_first(s, &bvh.hierarchy, waiting, counters, &mut visitor);
    !ended && take_in(s, look, cover, true)
}
