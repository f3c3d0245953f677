//! This module finds the boundary of the visible region of a polygon.
//!
//! The shaft has the occluders, and the penumbra computes the boundary past occluders. Each depends
//! on the other: in a dense shaft, which occluders matter depends on what is visible past the
//! occluders in front of them. So both are queried in turns, until no occluder of the shaft is
//! behind what is still visible:
//!
//! ```text
//!     shaft: occluders in front ──► penumbra: boundary past them
//!            ▲                                     │
//!            └── occluders behind what is visible ◄┘
//! ```
//!
//! There are two ways. Of fine meshes, only the silhouettes are given to the penumbra, next to all
//! other triangles, and shadow rays then say on which side of a silhouette the light is visible. If
//! that is not possible, all triangles are given to the penumbra.

use linelit_penumbra::{BoundaryEdge, Penumbra, Point};
use linelit_visibility::Shaft;

/// The least distance between all edges and a point for which a ray can say whether it is visible.
/// The first is in units of the extent of the triangles, some forty roundings of coordinates. The
/// second is in units of the light: as many roundings as coordinates appear to have for something
/// at a thousandth of the distance to the light.
const CLOSE: f64 = 1e-14;
const LEAST_ASIDE: f64 = 1e-11;

/// Finds the boundary of the visible region of a polygon, which is the shaft's light or a part of
/// it, in the coordinates of the light's [plane](Shaft::light_plane). `None` if the shaft has no
/// [front](Shaft::has_front).
pub(crate) fn visible_region<'p>(
    shaft: &mut Shaft<'_>,
    penumbra: &'p mut Penumbra,
    polygon: &[Point],
) -> Option<&'p [BoundaryEdge]> {
    if past_meshes(shaft, penumbra, polygon).is_none() {
        past_triangles(shaft, penumbra, polygon)?;
    }
    Some(penumbra.latest())
}

/// Finds the boundary past all triangles in front, including the triangles of fine meshes.
fn past_triangles(shaft: &mut Shaft<'_>, penumbra: &mut Penumbra, polygon: &[Point]) -> Option<()> {
    let mut front = shaft.front()?;
    let mut light = penumbra.begin(polygon).past(front.images());
    let ends = |edge: &BoundaryEdge| [edge.from, edge.to];
    while let Some(more) = front.behind(light.boundary().iter().map(ends)) {
        light = light.past(more.images());
        front = more;
    }
    Some(())
}

/// Finds the boundary past the silhouettes of fine meshes and all other triangles in front. `None`
/// if there are no fine meshes, or if silhouettes are so close to each other that no point between
/// them can be tested by a ray.
fn past_meshes(shaft: &mut Shaft<'_>, penumbra: &mut Penumbra, polygon: &[Point]) -> Option<()> {
    // Find the edges at which the visibility of the light may change, and the occluders behind
    // them.
    let mut front = shaft.front_without_meshes()?;
    let mut light = penumbra.begin(polygon).past(front.images());
    let outline = loop {
        let meshes = front.meshes()?;
        let silhouettes = meshes.silhouettes().iter();
        let silhouettes = silhouettes.map(|s| (s.from, s.to, s.layers));
        let outline = light.past(meshes.images()).outline(silhouettes);
        match meshes.behind(outline.edges()) {
            Some(more) => {
                light = outline.past(more.images());
                front = more;
            }
            None => break outline,
        }
    };
    // Keep those edges with visible light on one side only, which shadow rays decide.
    let [origin, along_p, along_q] = shaft.light_plane()?.axes;
    let side = along_p
        .length_squared()
        .min(along_q.length_squared())
        .sqrt();
    let least = (CLOSE * shaft.reach() / side).max(LEAST_ASIDE);
    let is_visible = |[p, q]: Point| shaft.place_visible(origin + along_p * p + along_q * q);
    outline.boundary(least, is_visible).map(|_| ())
}
