//! The boundary of the visible region of a polygon.
//!
//! The shaft knows occluders, the penumbra makes a boundary of them, and each depends on the other:
//! which occluders matter, in a dense shaft, depends on what is visible past those in front of
//! them. So both are queried in turns, until no occluder is left behind the boundary.

use linelit_penumbra::{BoundaryEdge, Penumbra, Point};
use linelit_visibility::Shaft;

/// A ray says whether a point is visible at least this far from all edges: in units of how far
/// triangles reach, some forty roundings of coordinates; and in units of the light, as many as they
/// seem of what is a thousandth of the way from the shading point.
const CLOSE: f64 = 1e-14;
const LEAST_ASIDE: f64 = 1e-11;

/// The boundary of the visible region of a polygon in the [plane](Shaft::light_plane) of the
/// shaft's light: of the light itself, or a part of it. `None` if the shaft has no
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

/// Finds the boundary past all triangles in front, those of fine meshes among them.
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

/// Finds the boundary past the silhouettes of fine meshes and all other triangles in front; `None`
/// if there are no fine meshes, or their silhouettes are so close to each other that no point says
/// on which side of them the light is visible.
fn past_meshes(shaft: &mut Shaft<'_>, penumbra: &mut Penumbra, polygon: &[Point]) -> Option<()> {
    // Find the edges where the light may become visible, and the occluders behind these.
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
    // Choose by rays those edges on whose one side it is.
    let [origin, along_p, along_q] = shaft.light_plane()?.axes;
    let side = along_p
        .length_squared()
        .min(along_q.length_squared())
        .sqrt();
    let least = (CLOSE * shaft.reach() / side).max(LEAST_ASIDE);
    let is_visible = |[p, q]: Point| shaft.place_visible(origin + along_p * p + along_q * q);
    outline.boundary(least, is_visible).map(|_| ())
}
