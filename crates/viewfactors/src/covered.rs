//! The removal of what coincides: where facets cover each other in one plane, the facet with the
//! lowest index is kept, and the parts of the others that it covers are cut off.

use crate::facets::Sides;
use crate::patches::bounds;
use crate::tree::Tree;
use crate::view::{divided, edge_planes};
use linelit_geometry::{DVec3, stop};

/// Removes from each facet's parts what facets of lower indices cover. One facet covers another if
/// both are in one plane, up to the tolerance `room`, and are seen from the same side. Parts are
/// convex polygons with the index of their facet.
pub(crate) fn without(
    parts: &[(usize, Vec<DVec3>)],
    room: f64,
    sides: Sides,
) -> Vec<(usize, Vec<DVec3>)> {
    // Put the parts in a tree, and prepare the tests for being in one plane.
    let all = (0..parts.len()).collect();
    let tree = Tree::build(all, |k| bounds(&parts[k].1));
    let normal = |k: usize| {
        let v = &parts[k].1;
        let fan = v.windows(2).map(|w| (w[0] - v[0]).cross(w[1] - v[0]));
        fan.sum::<DVec3>().normalize_or_zero()
    };
    let bend = |k: usize| {
        let (n, v) = (normal(k), &parts[k].1);
        v.iter()
            .fold(0.0_f64, |most, p| most.max(n.dot(*p - v[0]).abs()))
    };
    let mut left = Vec::with_capacity(parts.len());
    for (k, (facet, corners)) in parts.iter().enumerate() {
        stop::check();
        // Find the parts of lower facets that lie in the plane of this one.
        let (n, [low, high]) = (normal(k), bounds(corners));
        let meets = |l: DVec3, h: DVec3| !(h.cmplt(low - room) | l.cmpgt(high + room)).any();
        let mut lower = Vec::new();
        tree.find(meets, |other| {
            let (number, polygon) = &parts[other];
            let flatness = room + bend(k) + bend(other);
            let is_flat = |v: &DVec3| n.dot(*v - corners[0]).abs() <= flatness;
            let is_seen = sides == Sides::Two || n.dot(normal(other)) > 0.0;
            if number < facet && is_seen && polygon.iter().all(is_flat) {
                lower.push(edge_planes(normal(other), polygon, room));
            }
        });
        // Keep the parts that are outside of all of these.
        let mut rest = vec![corners.clone()];
        for planes in lower {
            let outside = |piece: Vec<DVec3>| match divided(&piece, &planes) {
                Some((_, outside)) => outside,
                None => vec![piece],
            };
            rest = rest.into_iter().flat_map(outside).collect();
        }
        left.extend(rest.into_iter().map(|corners| (*facet, corners)));
    }
    left
}
