//! Dense shafts for closed forms, past fine meshes: their silhouettes before the whole light.
//!
//! Where loose triangles hide, which [`Front`] knows, silhouettes do not matter; all others are
//! found. From their crossings follows how many layers lie over each place, but for a number that
//! all places which they connect have in common, and which a ray tells.

use crate::{
    Occluders, Scratch,
    closed_mesh::BackfaceFilter,
    front::{Front, ROOM, towards},
    node::Child,
    project,
    silhouette::{Search, Target},
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// A straight piece of the silhouette of a surface, or of its edge, as it lies before a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silhouette {
    /// Where it begins, in the coordinates (p, q) of [`Images`](crate::Images).
    pub from: [f64; 2],
    /// Where it ends.
    pub to: [f64; 2],
    /// How many layers more lie over its left than over its right.
    pub layers: i32,
}

/// The light of which `front` tells what is hidden.
struct OfLight<'a> {
    front: &'a Front,
    found: &'a mut Vec<Silhouette>,
}

impl Target for OfLight<'_> {
    #[inline(always)]
    fn needs<S: Simd>(&self, s: S, among: u8, low: [S::F; 2], high: [S::F; 2]) -> u8 {
        self.front.needs_any(s, among, low, high)
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
            // With p ascending, q is greater on the left.
            let layers = change(true);
            if layers != 0 {
                self.found.push(Silhouette { from, to, layers });
            }
        }
    }
}

/// Finds the silhouettes before `scratch.light` where `scratch.front` does not know that it is
/// hidden, and adds the images of those triangles of surfaces that have to be cut. False if there
/// are no [bounds](crate::bounds::ShaftBounds::new).
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn outline_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    &point: &DVec3,
    exclude: (u32, u32),
    scratch: &mut Scratch,
) -> bool {
    let Scratch {
        light,
        frame,
        counters,
        corners,
        flat,
        clear_of,
        front,
        lists,
        silhouettes,
        ..
    } = scratch;
    silhouettes.clear();
    corners.clear();
    let hierarchy = &*occluders.hierarchy;
    let Some((point, around, bounds)) = towards(s, occluders, point, exclude, light, frame) else {
        return false;
    };
    let frame = &*frame;
    front.open_complete();
    let search = Search::new(hierarchy, occluders.extent, &bounds, frame, point);
    let mut target = OfLight {
        front,
        found: silhouettes,
    };
    search.walk(s, &mut target, lists, counters);
    let margins = frame.margins;
    let backfaces = &mut BackfaceFilter::new(
        hierarchy.meshes(),
        clear_of,
        point,
        around,
        margins,
        exclude,
    );
    let before = flat.count;
    loop {
        let cut = lists.cut.pop();
        if let Some((leaf, which)) = cut {
            let slots = Child::leaf(leaf as usize, 8).slots();
            let codes = backfaces.codes(leaf as usize);
            let leaf = &hierarchy.leaves[leaf as usize];
            corners.add(s, leaf, which, &slots, Some(&codes));
        }
        while corners.count >= 8 || (cut.is_none() && corners.count > 0) {
            let first = corners.count.saturating_sub(8);
            let left =
                project::project_some::<S, true>(s, corners, first, point, frame, flat, backfaces);
            corners.count = first;
            if left.is_none() {
                flat.hide_all();
                silhouettes.clear();
                return true;
            }
        }
        if cut.is_none() {
            break;
        }
    }
    counters.candidates += (silhouettes.len() + flat.count - before) as u64;
    true
}

dispatch! {
    /// Finds the silhouettes before a light, on an instruction set.
    pub(crate) fn outline = outline_kernel(occluders: &Occluders, point: &DVec3, exclude: (u32, u32), scratch: &mut Scratch) -> bool
}
