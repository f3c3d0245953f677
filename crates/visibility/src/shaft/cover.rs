//! The walk from front to back that looks for what hides a light or a few lines on it, and skips
//! what is hidden already.
//!
//! A [`Cover`] records what is hidden. A box or triangle whose image touches only hidden parts is
//! skipped, with everything in it: what it hides lies within what is hidden, so that the answer
//! does not change by a bit.

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

/// Bounds in p and q of eight images: the least, then the greatest.
pub(crate) type ImageBounds<S> = [[<S as Simd>::F; 2]; 2];

/// The image of a box or triangle on the light, in the form that a cover uses.
pub(crate) trait Image: Copy {
    /// Eight images side by side.
    type Eight;

    /// The image that covers everything.
    const ALL: Self;

    /// Eight images from their bounds.
    fn eight<S: Simd>(s: S, bounds: ImageBounds<S>) -> Self::Eight;

    /// Returns one of eight images.
    fn of(images: &Self::Eight, lane: usize) -> Self;
}

/// The part of a light, or of a few lines on it, that is known to be hidden.
pub(crate) trait Cover<S: Simd> {
    /// The image of a box or triangle.
    type Image: Image;

    /// Whether images that miss the light are to be separated from it wherever that is possible.
    const SEPARATE: bool;

    /// Whether something with this image may hide anything that is not hidden yet.
    fn needs(&self, s: S, image: &Self::Image) -> bool;

    /// The same as [`Cover::needs`] for eight images, a bit for each; only the bits in `among` are
    /// used.
    fn needs_any(&self, s: S, among: u8, images: &<Self::Image as Image>::Eight) -> u8;

    /// Records the images of triangles from index `first` on; false if everything is hidden now.
    fn record(&mut self, s: S, flat: &mut FlatTriangles, first: usize) -> bool;
}

/// The visitor of the walk: opens what the cover needs.
struct FrontToBack<'a, 'b, S: Simd, C: Cover<S>> {
    look: &'a mut ShaftSearch<'b>,
    cover: &'a mut C,
    /// Fine surfaces whose triangles are left out, if any.
    without: Option<&'a Surfaces>,
    /// The images of the boxes in the open node, and a bit for each box that is before the shading
    /// point; images of the other boxes may be anywhere.
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
        // Find which triangles the cover needs; triangles that reach behind the shading point have
        // no bounded image.
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

/// Projects the collected triangles, eight at a time as long as there are eight, or `all` of them,
/// and records them in the cover; false if everything is hidden.
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

/// Visits everything that waits and records all triangles that the cover needs; false if everything
/// is hidden.
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
