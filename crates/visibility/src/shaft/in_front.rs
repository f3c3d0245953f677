//! The triangles and silhouettes that bound the visible part of a light, in the order in which they
//! are needed. This is the interface for callers that compute visible regions.
//!
//! A dense shaft has too many triangles to store all of them; but triangles at the back do not
//! matter where others in front hide the light. So a caller that looks for the boundary of the
//! visible region gets the triangles in front, finds the boundary past them, and queries what is
//! behind that boundary, until there is nothing more. Fine meshes have far fewer silhouettes than
//! triangles, and are represented by these:
//!
//! ```text
//! Shaft ── front ──► TrianglesInFront ── behind ──► TrianglesInFront ── behind ──► … ──► None
//!
//! Shaft ── front_without_meshes ──► FrontWithoutMeshes ── meshes ──► MeshesInFront
//!                                           ▲                             │
//!                                           └────────── behind ───────────┴──► None
//! ```
//!
//! Each state is a type that the next query consumes. The states borrow the shaft, since a query
//! for lines in between would overwrite the triangles that a dense shaft stores.

use super::{Found, Shaft};
use crate::{LightPlane, Silhouette, shaft::front, silhouettes::outline};

/// Triangles that, together with the triangles returned by earlier queries, hide almost everything
/// that is hidden of a light ([`Shaft::front`]).
#[derive(Debug)]
#[must_use]
pub struct TrianglesInFront<'s, 'a> {
    shaft: &'s mut Shaft<'a>,
    /// The index of the first projected triangle that no earlier query returned.
    first: usize,
}

/// Triangles outside of fine meshes that, together with the triangles returned by earlier queries,
/// hide almost everything that triangles outside of fine meshes hide of a light
/// ([`Shaft::front_without_meshes`]).
#[derive(Debug)]
#[must_use]
pub struct FrontWithoutMeshes<'s, 'a>(TrianglesInFront<'s, 'a>);

/// The silhouettes of fine meshes where the triangles found so far do not hide a light
/// ([`FrontWithoutMeshes::meshes`]).
#[derive(Debug)]
#[must_use]
pub struct MeshesInFront<'s, 'a>(TrianglesInFront<'s, 'a>);

impl<'a> Shaft<'a> {
    /// Whether the triangles that bound the visible region can be queried: all triangles of the
    /// shaft, or the triangles [in front](Self::front). The result is false for an empty or blocked
    /// shaft; for a light that is seen edge on, has no area or length, or is not finite; and if
    /// there are triangles with holes in the shaft, since what these hide is not a polygon.
    #[must_use]
    pub fn has_front(&self) -> bool {
        matches!(self.found, Found::Few | Found::Many) && !self.has_holes
    }

    /// Returns the plane of the light, in whose coordinates projected triangles are given; `None`
    /// unless [`Self::has_front`].
    #[must_use]
    pub fn light_plane(&self) -> Option<LightPlane<'_>> {
        self.has_front().then(|| self.scratch.seen.frame.plane())
    }

    /// Finds triangles, projected to the light's plane, that together hide almost everything that
    /// is hidden, even in a dense shaft; `None` unless [`Self::has_front`].
    ///
    /// For a shaft that is not dense they are [all](Self::images) of its triangles. In a dense
    /// shaft, a few points seem visible that are not: callers find the boundary of the visible
    /// part, and then query the triangles [behind](TrianglesInFront::behind) it.
    pub fn front(&mut self) -> Option<TrianglesInFront<'_, 'a>> {
        self.find_front(false)
    }

    /// Finds the triangles in [front](Self::front) that belong to no fine mesh; what fine meshes
    /// hide follows from their [silhouettes](FrontWithoutMeshes::meshes). `None` where silhouettes
    /// are not available: for shafts that are not dense, and where a fine mesh has triangles that
    /// the query excludes.
    pub fn front_without_meshes(&mut self) -> Option<FrontWithoutMeshes<'_, 'a>> {
        let surfaces = &self.occluders.bvh.hierarchy.surfaces;
        let has_silhouettes = self.found == Found::Many && surfaces.serve(self.exclude);
        let front = has_silhouettes.then(|| self.find_front(true))??;
        Some(FrontWithoutMeshes(front))
    }

    /// Finds the triangles in front, all of them or only those that belong to no fine mesh.
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

    /// Walks a dense shaft from front to back: the `FIRST` walk finds the triangles in front, later
    /// walks find the triangles that touch open cells.
    fn walk_front<const FIRST: bool>(&mut self) -> bool {
        let (bvh, all) = (&self.occluders.bvh, &mut *self.scratch);
        let (seen, front, counters) = (&mut all.seen, &mut all.front, &mut all.counters);
        front::front::<FIRST>(bvh.isa, bvh, self.exclude, seen, front, counters)
    }
}

impl TrianglesInFront<'_, '_> {
    /// Returns the triangles, projected from the shading point to the light's
    /// [plane](Shaft::light_plane): the three corners of each in coordinates (p, q).
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.shaft.scratch.seen.flat.get_from(self.first)
    }

    /// Finds more triangles, given the boundary of what is visible if only the triangles returned
    /// so far hide the light. The boundary is given as straight pieces, each from one point to
    /// another in (p, q). `None` if that boundary is final. Some of the triangles may have been
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
    /// Returns the projected triangles, as in [`TrianglesInFront::images`].
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.0.images()
    }

    /// Finds the silhouettes of fine meshes where the triangles found so far do not hide the light;
    /// `None` if the shaft has no usable bounds.
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
    /// Returns the projections of triangles of fine meshes that had to be clipped, since they are
    /// not wholly between the shading point and the light.
    pub fn images(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        self.0.images()
    }

    /// Returns all silhouettes of the fine meshes, projected onto the light's plane. Silhouettes
    /// may be missing where other triangles hide the light; elsewhere they are closed curves, so
    /// that the changes of the number of layers (triangles over a point) around any point add up to
    /// zero.
    #[must_use]
    pub fn silhouettes(&self) -> &[Silhouette] {
        &self.0.shaft.scratch.outline.found
    }

    /// Finds triangles that are still missing, of those that belong to no fine mesh. `outline` has
    /// the parts of the images' sides next to which the light would be visible if there were no
    /// meshes, as pairs of points on the light's plane. `None` if no triangle is missing: then the
    /// outline is final.
    #[must_use = "without more triangles the outline is final"]
    pub fn behind(
        self,
        outline: impl Iterator<Item = [[f64; 2]; 2]>,
    ) -> Option<FrontWithoutMeshes<'s, 'a>> {
        self.0.behind(outline).map(FrontWithoutMeshes)
    }
}
