//! The occluders that bound what is visible of a light, in the order in which they are found.
//!
//! Of a dense shaft, too many triangles are in between to keep them all; but those at the back do
//! not matter where others before them hide the light. So a caller who looks for the boundary of
//! the visible region gets the triangles in front, finds the boundary past them, and queries what
//! is behind that boundary, until nothing is. Fine meshes have far fewer silhouettes than
//! triangles, and are known by these:
//!
//! ```text
//! Shaft ── front ──► TrianglesInFront ── behind ──► TrianglesInFront ── behind ──► … ──► None
//!
//! Shaft ── front_without_meshes ──► FrontWithoutMeshes ── meshes ──► MeshesInFront
//!                                           ▲                             │
//!                                           └────────── behind ───────────┴──► None
//! ```
//!
//! Each state is a type that the next query consumes. It borrows the shaft, for a query about lines
//! in between would overwrite the triangles that a dense shaft stores.

use super::{Found, Shaft};
use crate::{LightPlane, Silhouette, shaft::front, silhouettes::outline};

/// Triangles that, with those that were returned before them, hide almost all that is hidden of a
/// light ([`Shaft::front`]).
#[derive(Debug)]
#[must_use]
pub struct TrianglesInFront<'s, 'a> {
    shaft: &'s mut Shaft<'a>,
    /// The first image that was not returned before.
    first: usize,
}

/// Triangles of no fine mesh that, with those that were returned before them, hide almost all that
/// such triangles hide of a light ([`Shaft::front_without_meshes`]).
#[derive(Debug)]
#[must_use]
pub struct FrontWithoutMeshes<'s, 'a>(TrianglesInFront<'s, 'a>);

/// The fine meshes where the triangles found so far do not hide a light
/// ([`FrontWithoutMeshes::meshes`]).
#[derive(Debug)]
#[must_use]
pub struct MeshesInFront<'s, 'a>(TrianglesInFront<'s, 'a>);

impl<'a> Shaft<'a> {
    /// Whether the triangles that bound the visible region can be found: all that are in between,
    /// or those [in front](Self::front). Not for an empty or blocked shaft; for a light seen edge
    /// on, without extent or not finite; nor past triangles with holes, since what these hide is no
    /// polygon.
    #[must_use]
    pub fn has_front(&self) -> bool {
        matches!(self.found, Found::Few | Found::Many) && !self.has_holes
    }

    /// The plane of the light, in which images are; `None` without a [front](Self::has_front).
    #[must_use]
    pub fn light_plane(&self) -> Option<LightPlane<'_>> {
        self.has_front().then(|| self.scratch.seen.frame.plane())
    }

    /// Triangles as they lie before the light that together hide almost all that is hidden, in a
    /// dense shaft too; `None` without [them](Self::has_front).
    ///
    /// Of a shaft that is not dense they are [all](Self::images). In a dense one, a few places
    /// seem visible that are not: callers that have found the boundary of the visible part query
    /// the triangles [behind](TrianglesInFront::behind) it.
    pub fn front(&mut self) -> Option<TrianglesInFront<'_, 'a>> {
        self.find_front(false)
    }

    /// The triangles in [front](Self::front) that belong to no fine mesh; what fine meshes hide
    /// follows from their [silhouettes](FrontWithoutMeshes::meshes). `None` where those are not
    /// known: outside dense shafts, and where a fine mesh has a triangle of the light.
    pub fn front_without_meshes(&mut self) -> Option<FrontWithoutMeshes<'_, 'a>> {
        let surfaces = &self.occluders.bvh.hierarchy.surfaces;
        let has_silhouettes = self.found == Found::Many && surfaces.serve(self.exclude);
        let front = has_silhouettes.then(|| self.find_front(true))??;
        Some(FrontWithoutMeshes(front))
    }

    /// Finds the triangles in front, or those of them that belong to no fine mesh.
    fn find_front(&mut self, without_meshes: bool) -> Option<TrianglesInFront<'_, 'a>> {
        if !self.has_front() {
            return None;
        }
        self.scratch.front.front.loose = without_meshes;
        let is_found = self.found == Found::Few || self.walk_front::<true>();
        is_found.then_some(TrianglesInFront {
            shaft: self,
            first: 0,
        })
    }

    /// Walks from front to back to find the triangles of a dense shaft that are in front, or,
    /// unless it is the `FIRST` walk, those of the cells that are open.
    fn walk_front<const FIRST: bool>(&mut self) -> bool {
        let (bvh, all) = (&self.occluders.bvh, &mut *self.scratch);
        let (seen, front, counters) = (&mut all.seen, &mut all.front, &mut all.counters);
        front::front::<FIRST>(bvh.isa, bvh, self.exclude, seen, front, counters)
    }
}

impl TrianglesInFront<'_, '_> {
    /// The triangles projected from the shading point to the light's [plane](Shaft::light_plane):
    /// the three corners of each, in the plane's coordinates.
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.shaft.scratch.seen.flat.get_from(self.first)
    }

    /// More triangles, given the boundary of what seems visible past all that were returned so far,
    /// as pieces from one place to another; `None` if that is what is visible. Some may have been
    /// returned before.
    #[must_use = "without more triangles the boundary is final"]
    pub fn behind(mut self, boundary: impl Iterator<Item = [[f64; 2]; 2]>) -> Option<Self> {
        let Shaft { found, scratch, .. } = &mut *self.shaft;
        if *found != Found::Many || !scratch.front.front.look(boundary) {
            return None;
        }
        self.first = scratch.seen.flat.count;
        self.shaft.walk_front::<false>();
        Some(self)
    }
}

impl<'s, 'a> FrontWithoutMeshes<'s, 'a> {
    /// The images of the triangles.
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.0.images()
    }

    /// The fine meshes where the triangles found so far do not hide the light; `None` where nothing
    /// is known of them.
    #[must_use]
    pub fn meshes(self) -> Option<MeshesInFront<'s, 'a>> {
        let Shaft {
            occluders,
            exclude,
            scratch,
            ..
        } = &mut *self.0.shaft;
        let (bvh, first) = (&occluders.bvh, scratch.seen.flat.count);
        let (seen, front) = (&mut scratch.seen, &mut scratch.front.front);
        let (outline, counters) = (&mut scratch.outline, &mut scratch.counters);
        let is_known = outline::outline(bvh.isa, bvh, *exclude, seen, front, outline, counters);
        is_known.then_some(MeshesInFront(TrianglesInFront { first, ..self.0 }))
    }
}

impl<'s, 'a> MeshesInFront<'s, 'a> {
    /// The images of those triangles of fine meshes that are not in front of the light as a whole.
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.0.images()
    }

    /// The silhouettes of the fine meshes on the light's plane, all of them anew at each call. Some
    /// are missing behind other triangles that hide the light; elsewhere they are closed curves, so
    /// that the changes of the number of layers around any point add up to zero.
    #[must_use]
    pub fn silhouettes(&self) -> &[Silhouette] {
        &self.0.shaft.scratch.outline.found
    }

    /// Returns triangles that are missing so far, of those that belong to no fine mesh. `outline`
    /// has the parts of the images' sides next to which the light is visible if meshes are left
    /// out, as pairs of points on the light's plane. `None` if no triangle is missing: then the
    /// outline is final.
    #[must_use = "without more triangles the outline is final"]
    pub fn behind(
        self,
        outline: impl Iterator<Item = [[f64; 2]; 2]>,
    ) -> Option<FrontWithoutMeshes<'s, 'a>> {
        self.0.behind(outline).map(FrontWithoutMeshes)
    }
}
