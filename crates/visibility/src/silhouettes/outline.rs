//! The silhouettes of fine meshes as seen before a whole light, for closed forms in dense shafts.
//!
//! Where other triangles surely hide the light, which [`Front`] records, silhouettes do not matter;
//! all others are found. A *layer* over a point of the light is a triangle that hides it. The
//! crossings of silhouettes determine the number of layers over each point of a connected part of
//! the light up to one constant, and one ray per connected part determines the constant.

use crate::{
    bvh::Bvh,
    counters::Counters,
    node::Child,
    shaft::{
        cover::Image as _,
        front::{self, Front, ROOM},
        seen::ShaftState,
    },
    silhouettes::silhouette::{Lists, Search, Target},
};
use linelit_simd::{Simd, dispatch};

/// A straight piece of a surface's silhouette, or of its boundary, as projected from the shading
/// point onto the plane of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silhouette {
    /// The point where it begins, in the coordinates (p, q) of the light's
    /// [plane](crate::LightPlane).
    pub from: [f64; 2],
    /// The point where it ends.
    pub to: [f64; 2],
    /// The number of the surface's layers, that is, of its triangles over a point, on the left side
    /// of the piece, minus the number on the right side.
    pub layers: i32,
}

/// A light as the target of a search for silhouettes; `front` records which parts of it are hidden.
struct OfLight<'a> {
    front: &'a Front,
    found: &'a mut Vec<Silhouette>,
}

impl Target for OfLight<'_> {
    #[inline(always)]
    fn needs<S: Simd>(&self, s: S, among: u8, low: [S::F; 2], high: [S::F; 2]) -> u8 {
        self.front
            .needs_any(among, &front::Image::eight(s, [low, high]))
    }

    #[inline(always)]
    fn meets<S: Simd>(&self, s: S, from: [S::D; 2], to: [S::D; 2]) -> u8 {
        let (low, high) = (s.dsplat(-ROOM), s.dsplat(1.0 + ROOM));
        let along =
            |k: usize| s.dle(s.dmin(from[k], to[k]), high) & s.dle(low, s.dmax(from[k], to[k]));
        s.bits(along(0) & along(1))
    }

    #[inline(always)]
    fn side<S: Simd>(&mut self, _: S, [from, to]: [[f64; 2]; 2], change: impl FnOnce(bool) -> i32) {
        if self.front.needs_side(from, to) {
            // With p ascending, greater q is on the left.
            let layers = change(true);
            if layers != 0 {
                self.found.push(Silhouette { from, to, layers });
            }
        }
    }
}

/// Buffers of the search for silhouettes before a light.
#[derive(Debug, Default)]
pub(crate) struct OutlineScratch {
    /// Nodes and leaves of the search.
    lists: Lists,
    /// The silhouettes before the light.
    pub(crate) found: Vec<Silhouette>,
}

/// Finds the silhouettes before `seen.light` where `front` does not record that the light is
/// hidden, and adds to `seen` the projections of those triangles of surfaces that have to be
/// clipped. Returns false if the shaft has no [bounds](crate::shaft::bounds::ShaftBounds::new).
#[inline(always)]
fn outline_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    exclude: (u32, u32),
    seen: &mut ShaftState,
    front: &mut Front,
    scratch: &mut OutlineScratch,
    counters: &mut Counters,
) -> bool {
    let OutlineScratch { lists, found } = scratch;
    found.clear();
    let hierarchy = &*bvh.hierarchy;
    let Some(mut look) = seen.look(s, bvh, exclude, None) else {
        return false;
    };
    // Find the silhouettes before the parts of the light that are not known to be hidden.
    front.open_complete();
    let search = Search::new(hierarchy, bvh.extent, &look.bounds, look.frame, look.point);
    search.walk(s, &mut OfLight { front, found }, lists, counters);
    // Project the triangles that have to be clipped. If they hide the whole light, nothing else
    // matters.
    let before = look.flat.count;
    let mut is_open = true;
    while is_open && let Some((leaf, which)) = lists.cut.pop() {
        let child = Child::leaf(leaf as usize, 8);
        look.keep(s, child, &hierarchy.leaves[leaf as usize], which);
        is_open = look.project_last(s, true, false, |_, _| true);
    }
    if !(is_open && look.project_last(s, true, true, |_, _| true)) {
        look.flat.hide_all();
        found.clear();
        return true;
    }
    counters.candidates += (found.len() + look.flat.count - before) as u64;
    true
}

dispatch! {
    /// [`outline_kernel`] on an instruction set.
    pub(crate) fn outline = outline_kernel(bvh: &Bvh, exclude: (u32, u32), seen: &mut ShaftState, front: &mut Front, scratch: &mut OutlineScratch, counters: &mut Counters) -> bool
}
