//! Which parts of facets see each other: what faces, and what is between.

use crate::facets::{Facets, Sides};
use crate::hull::{Hull, hides_all};
use linelit_geometry::{ConvexPolygon, DVec3};
use std::ops::RangeInclusive;

/// The step that settled what two facets exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Settled {
    /// Neither has a part before the other that faces it.
    #[default]
    Facing,
    /// A patch of facets between them hides each from the other.
    Hidden,
    /// Nothing is between them.
    Clear,
    /// A part is hidden, which an adaptive rule integrated.
    Partly,
}

/// A part of a facet that another may see, and what is between.
pub(crate) struct Partner<'a> {
    /// The part, and how many more like it: none where it is not facing or hidden alone.
    pub part: usize,
    pub count: u64,
    /// What lies before each other of both.
    pub polygons: Option<[ConvexPolygon; 2]>,
    pub settled: Settled,
    /// The patches between.
    pub between: &'a [usize],
}

/// A part as seen from one of its sides.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    pub part: usize,
    pub polygon: ConvexPolygon,
}

impl Facets {
    /// The sides of a facet's parts.
    pub(crate) fn sides_of(&self, facet: usize) -> impl Iterator<Item = Side> {
        let backs: &[bool] = match self.sides {
            Sides::One => &[false],
            Sides::Two => &[false, true],
        };
        let sides = move |part| {
            backs.iter().map(move |&back| Side {
                part,
                polygon: turned(&self.parts[part].polygon, back),
            })
        };
        self.facets[facet].parts.clone().flat_map(sides)
    }

    /// Hands on all parts of other facets, those that are settled alike together. Of patches that
    /// `is_known` knows all parts nothing is said, nor of parts.
    pub(crate) fn partners(
        &self,
        from: &Side,
        is_known: &impl Fn(RangeInclusive<usize>) -> bool,
        each: &mut impl FnMut(Partner<'_>),
    ) {
        let backs: &[bool] = match self.sides {
            Sides::One => &[false],
            Sides::Two => &[false, true],
        };
        let own = self.parts[from.part].patch;
        for (number, patch) in self.patches.iter().enumerate() {
            if number != own && !is_known(patch.facets.clone()) {
                for &back in backs {
                    self.descend(from, [number, 0], back, None, is_known, each);
                }
            }
        }
    }

    /// Hands on the parts of a node of a patch.
    fn descend(
        &self,
        from: &Side,
        [patch, node]: [usize; 2],
        back: bool,
        known: Option<&[usize]>,
        is_known: &impl Fn(RangeInclusive<usize>) -> bool,
        each: &mut impl FnMut(Partner<'_>),
    ) {
        let tree = &self.patches[patch].tree;
        let items = tree.nodes[node].items.clone();
        let part = tree.order[items.start];
        let children = tree.nodes[node].children;
        let facet = self.parts[part].facet;
        if children.is_none() && is_known(facet..=facet) {
            return;
        }
        let around = turned(&self.patches[patch].around[node], back);
        let polygons = before_each_other(&from.polygon, &around, self.room);
        let (settled, between) = match &polygons {
            None => (Settled::Facing, Vec::new()),
            Some(pair) => self.between_polygons(pair, [self.parts[from.part].patch, patch], known),
        };
        match children {
            Some(children) if settled >= Settled::Clear => {
                for child in children {
                    self.descend(from, [patch, child], back, Some(&between), is_known, each);
                }
            }
            _ => each(Partner {
                part,
                count: items.len() as u64,
                polygons,
                settled,
                between: &between,
            }),
        }
    }

    /// How much stands between two polygons of which each lies before the other, and the patches
    /// that do: of some that are known, or of all.
    pub(crate) fn between_polygons(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        known: Option<&[usize]>,
    ) -> (Settled, Vec<usize>) {
        if known.is_some_and(<[usize]>::is_empty) {
            return (Settled::Clear, Vec::new());
        }
        let (p, q) = (p.vertices(), q.vertices());
        let hull = Hull::new(p, q);
        let mut memory = [Vec::new(), Vec::new()];
        let mut between = Vec::new();
        let mut meet = |k: usize| {
            if !own.contains(&k) && hull.meets(&self.patches[k].polygon, &mut memory) {
                between.push(k);
            }
        };
        match known {
            Some(known) => known.iter().for_each(|&k| meet(k)),
            None => {
                let holds = |low: DVec3, high: DVec3| hull.may_hold(low, high);
                self.patch_tree.find(holds, meet);
            }
        }
        let hides = |&k: &usize| hides_all(&self.patches[k].polygon, p, q);
        let settled = match between.as_slice() {
            [] => Settled::Clear,
            some if some.iter().any(hides) => Settled::Hidden,
            _ => Settled::Partly,
        };
        (settled, between)
    }
}

/// A polygon as seen from its front or its back.
fn turned(polygon: &ConvexPolygon, back: bool) -> ConvexPolygon {
    if back { polygon.flipped() } else { *polygon }
}

/// The parts of two polygons that lie before the plane of the other, by more than some room.
pub(crate) fn before_each_other(
    p: &ConvexPolygon,
    q: &ConvexPolygon,
    room: f64,
) -> Option<[ConvexPolygon; 2]> {
    let above = |a: &ConvexPolygon, b: &ConvexPolygon, room: f64| {
        let (n, origin) = (b.normal(), b.vertices()[0]);
        let heights = a.vertices().iter().map(|v| n.dot(*v - origin));
        heights.filter(|height| *height > room).count()
    };
    // What faces away is told without a cut.
    if above(q, p, room) == 0 || above(p, q, room) == 0 {
        return None;
    }
    let part = |a: &ConvexPolygon, b: &ConvexPolygon| {
        if above(a, b, -room) == a.vertices().len() {
            return Some(*a);
        }
        a.clip(b.vertices()[0], b.normal())
    };
    Some([part(p, q)?, part(q, p)?])
}
