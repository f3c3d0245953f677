//! Facets that coincide: the one with the lowest number is there alone.

use crate::facets::Sides;
use crate::patches::bounds;
use crate::tree::Tree;
use crate::view::View;
use linelit_geometry::{ConvexPolygon, DVec3};

/// The parts of facets without what facets of lower numbers cover: in one plane but for rounding,
/// and seen from the same side.
pub(crate) fn without(
    parts: &[(usize, Vec<DVec3>)],
    room: f64,
    sides: Sides,
) -> Vec<(usize, Vec<DVec3>)> {
    let all = (0..parts.len()).collect();
    let tree = Tree::build(all, |k| bounds(&parts[k].1));
    let normal = |k: usize| {
        let v = &parts[k].1;
        let fan = v.windows(2).map(|w| (w[0] - v[0]).cross(w[1] - v[0]));
        fan.sum::<DVec3>().normalize_or_zero()
    };
    let mut left = Vec::with_capacity(parts.len());
    let mut view = View::default();
    for (k, (facet, corners)) in parts.iter().enumerate() {
        let (n, [low, high]) = (normal(k), bounds(corners));
        let meets = |l: DVec3, h: DVec3| !(h.cmplt(low - room) | l.cmpgt(high + room)).any();
        let mut lower = Vec::new();
        tree.find(meets, |other| {
            let (number, polygon) = &parts[other];
            let is_flat = |v: &DVec3| n.dot(*v - corners[0]).abs() <= room;
            let is_seen = sides == Sides::Two || n.dot(normal(other)) > 0.0;
            if number < facet && is_seen && polygon.iter().all(is_flat) {
                lower.extend(ConvexPolygon::new(polygon));
            }
        });
        if lower.is_empty() {
            left.push((*facet, corners.clone()));
        } else {
            let rest = view.uncovered(n, corners, &lower);
            left.extend(rest.into_iter().map(|corners| (*facet, corners)));
        }
    }
    left
}
