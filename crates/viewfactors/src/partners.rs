//! Which parts of facets see each other: what faces, and what is between.

use crate::cubature::places;
use crate::facets::{Facets, Sides};
use crate::hull::{Hull, hides_all};
use crate::pair::by_area;
use crate::point::Memory;
use crate::view::unseen_below;
use linelit_geometry::{ConvexPolygon, DVec3, stop};
use std::ops::RangeInclusive;

/// The step that settled what two facets exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Settled {
    /// Neither has a part before the other that faces it.
    #[default]
    Facing,
    /// A patch between them hides all, or no point of the adaptive rule on either sees the other.
    Hidden,
    /// Nothing is between them.
    Clear,
    /// A part is hidden, which an adaptive rule integrated.
    Partly,
}

/// A part of a facet that another may see, and what is between.
pub(crate) struct Partner<'a> {
    /// The part, and how many more like it: one where something is to be integrated.
    pub part: usize,
    pub back: bool,
    pub count: u64,
    pub settled: Settled,
    /// The parts of both that lie before each other, first that of the facet with the lower number.
    pub polygons: Option<[ConvexPolygon; 2]>,
    /// The parts of patches that hide some of one from the other.
    pub blockers: &'a [ConvexPolygon],
}

/// A part as seen from one of its sides.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    pub part: usize,
    pub back: bool,
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
                back,
                polygon: turned(&self.parts[part].polygon, back),
            })
        };
        self.facets[facet].parts.clone().flat_map(sides)
    }

    /// Hands on all parts of other facets, those that are settled alike together. Of parts of
    /// facets that `is_known` knows nothing is said.
    pub(crate) fn partners(
        &self,
        from: &Side,
        is_known: &impl Fn(RangeInclusive<usize>) -> bool,
        memory: &mut Memory,
        each: &mut impl FnMut(Partner<'_>, &mut Memory),
    ) {
        let backs: &[bool] = match self.sides {
            Sides::One => &[false],
            Sides::Two => &[false, true],
        };
        let own = self.parts[from.part].patch;
        for (number, patch) in self.patches.iter().enumerate() {
            stop::check();
            if number != own && !is_known(patch.facets.clone()) {
                for &back in backs {
                    let mut descent = Descent {
                        all: self,
                        from,
                        patch: number,
                        back,
                        is_known,
                    };
                    descent.node(0, None, memory, each);
                }
            }
        }
    }

    /// The patches that meet the hull of two polygons: of some that are known, or of all.
    fn patches_between(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        known: Option<&[usize]>,
        or_touches: bool,
    ) -> Vec<usize> {
        let mut between = Vec::new();
        if known.is_some_and(<[usize]>::is_empty) {
            return between;
        }
        let hull = Hull::new(p.vertices(), q.vertices(), self.flatness(own));
        let mut room = [Vec::new(), Vec::new()];
        let mut meet = |k: usize| {
            stop::check();
            if !own.contains(&k) && hull.meets(&self.patches[k].polygon, or_touches, &mut room) {
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
        between
    }

    /// Tells how much is between two polygons of facets in the order of their numbers, and the
    /// parts of patches that hide.
    pub(crate) fn settle(
        &self,
        polygons: &[ConvexPolygon; 2],
        own: [usize; 2],
        known: Option<&[usize]>,
        memory: &mut Memory,
    ) -> (Settled, Vec<ConvexPolygon>) {
        let between = self.patches_between(polygons, own, known, false);
        if self.is_hidden(polygons, own, &between) {
            return (Settled::Hidden, Vec::new());
        }
        let blockers = self.blockers(polygons, own, &between);
        let settled = match blockers.is_empty() {
            true => Settled::Clear,
            // Points of the smaller one are closer to each other.
            false => {
                let [small, large] = by_area(polygons);
                let is_seen =
                    sees(small, large, &blockers, memory) || sees(large, small, &blockers, memory);
                if is_seen {
                    Settled::Partly
                } else {
                    Settled::Hidden
                }
            }
        };
        (settled, blockers)
    }

    /// The tolerance for flatness of two patches: a corner that is less far above or below the
    /// plane of one of them counts as lying in this plane.
    pub(crate) fn flatness(&self, [a, b]: [usize; 2]) -> f64 {
        self.patches[a].flatness.max(self.patches[b].flatness)
    }

    /// Whether one of some patches hides all of two polygons of others from each other.
    fn is_hidden(&self, [p, q]: &[ConvexPolygon; 2], own: [usize; 2], between: &[usize]) -> bool {
        between.iter().any(|&k| {
            let flatness = self.flatness(own).max(self.patches[k].flatness);
            hides_all(
                &self.patches[k].polygon,
                p.vertices(),
                q.vertices(),
                flatness,
            )
        })
    }

    /// The parts of patches that lie before two polygons, first those that hide most.
    fn blockers(
        &self,
        [p, q]: &[ConvexPolygon; 2],
        own: [usize; 2],
        between: &[usize],
    ) -> Vec<ConvexPolygon> {
        let middle = p.centroid();
        let size = |polygon: &ConvexPolygon| {
            let to = polygon.centroid() - middle;
            let square = to.length_squared();
            polygon.area() * polygon.normal().dot(to).abs() / (square * square.sqrt())
        };
        let flatness = |k: usize| self.flatness(own).max(self.patches[k].flatness);
        let cut = |&k: &usize| before_all(&self.patches[k].polygon, &[p, q], flatness(k));
        let cut = between.iter().filter_map(cut);
        let mut blockers: Vec<(f64, ConvexPolygon)> = cut.map(|b| (size(&b), b)).collect();
        blockers.sort_by(|a, b| b.0.total_cmp(&a.0));
        blockers.into_iter().map(|(_, blocker)| blocker).collect()
    }
}

/// Whether any point of the adaptive rule sees a part of a polygon.
pub(crate) fn sees(
    p: &ConvexPolygon,
    q: &ConvexPolygon,
    blockers: &[ConvexPolygon],
    memory: &mut Memory,
) -> bool {
    places(p).any(|x| {
        let [open, visible] = memory.view.factors(x, p.normal(), q, blockers.iter());
        visible > unseen_below(open)
    })
}

/// The way down the tree of a patch, from a side of a part.
struct Descent<'a, K> {
    all: &'a Facets,
    from: &'a Side,
    patch: usize,
    back: bool,
    is_known: &'a K,
}

impl<K: Fn(RangeInclusive<usize>) -> bool> Descent<'_, K> {
    /// Hands on the parts of a node, of which some patches are known that may be before it.
    fn node(
        &mut self,
        node: usize,
        known: Option<&[usize]>,
        memory: &mut Memory,
        each: &mut impl FnMut(Partner<'_>, &mut Memory),
    ) {
        let all = self.all;
        let patch = &all.patches[self.patch];
        let (items, children) = (
            patch.tree.nodes[node].items.clone(),
            patch.tree.nodes[node].children,
        );
        let part = patch.tree.order[items.start];
        let (own, facet) = (all.parts[self.from.part].facet, all.parts[part].facet);
        if children.is_none() && (self.is_known)(facet..=facet) {
            return;
        }
        let mut partner = Partner {
            part,
            back: self.back,
            count: items.len() as u64,
            settled: Settled::Facing,
            polygons: None,
            blockers: &[],
        };
        let around = turned(&patch.around[node], self.back);
        let patches = [all.parts[self.from.part].patch, self.patch];
        let flatness = all.flatness(patches);
        let Some(pair) = before_each_other(&self.from.polygon, &around, flatness) else {
            return each(partner, memory);
        };
        let Some(children) = children else {
            let [p, q] = pair;
            let polygons = if own < facet { [p, q] } else { [q, p] };
            let (settled, blockers) = all.settle(&polygons, patches, known, memory);
            partner.settled = settled;
            partner.polygons = Some(polygons);
            partner.blockers = &blockers;
            return each(partner, memory);
        };
        let between = all.patches_between(&pair, patches, known, true);
        if all.is_hidden(&pair, patches, &between) {
            partner.settled = Settled::Hidden;
            return each(partner, memory);
        }
        for child in children {
            self.node(child, Some(&between), memory, each);
        }
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

/// The part of a patch that lies before some polygons.
pub(crate) fn before_all(
    patch: &ConvexPolygon,
    polygons: &[&ConvexPolygon],
    room: f64,
) -> Option<ConvexPolygon> {
    let mut part = *patch;
    for other in polygons {
        let (n, origin) = (other.normal(), other.vertices()[0]);
        let heights = || part.vertices().iter().map(|v| n.dot(*v - origin));
        if heights().all(|h| h <= room) {
            return None;
        }
        if heights().any(|h| h < 0.0) {
            part = part.clip(origin, n)?;
        }
    }
    Some(part)
}
