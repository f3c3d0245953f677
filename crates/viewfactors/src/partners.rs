//! The search for the partners of a part of a facet: all parts in other patches, each with the
//! result of the visibility tests between the two.
//!
//! There are many pairs, and most do not see each other. So partners are searched for by patches
//! (neighbours in one plane). Each patch has a tree of its parts, with a rectangle around the parts
//! of each node:
//!
//! ```text
//!        a patch of 8 parts               its tree
//!        ┌────┬────┬────┬────┐
//!        │    │    │    │    │                  ○         if the root's rectangle is not visible,
//!        ├────┼────┼────┼────┤               ╱     ╲      none of the 8 parts is
//!        │    │    │    │    │              ○       ○
//!        └────┴────┴────┴────┘             ╱ ╲     ╱ ╲
//!                                         ○   ○   ○   ○      …
//! ```
//!
//! The search descends from the root. If the rectangle around a node faces away or is hidden, all
//! parts of the node are one partner. Otherwise it goes on in both children, for which only those
//! patches may be blockers that are between the part and the node's rectangle ([`Candidates`]). At
//! a leaf, the pair of parts is examined by itself ([`sight`](crate::sight)).
//!
//! Each side of each part in another patch is in exactly one partner, except for parts of facets
//! that are skipped.

use crate::facets::{Facets, Sides};
use crate::patches::Patch;
use crate::point::Memory;
use crate::sight::{Candidates, Sight, before_each_other};
use linelit_geometry::{ConvexPolygon, stop};
use std::ops::{Range, RangeInclusive};

/// Parts of one patch, seen from one side, about which the search has one result.
pub(crate) struct Partner {
    /// The index of one of the parts: the only part if some of it is visible, otherwise the first.
    pub part: usize,
    /// Whether the parts are seen from their back.
    pub back: bool,
    /// The number of the parts whose facets are not skipped.
    pub count: u64,
    pub sight: Sight,
}

/// A part of a facet as seen from one of its sides.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    pub part: usize,
    pub back: bool,
    pub polygon: ConvexPolygon,
}

impl Sides {
    /// For each side that sends and receives, whether it is the back.
    const fn are_backs(self) -> &'static [bool] {
        match self {
            Self::One => &[false],
            Self::Two => &[false, true],
        }
    }
}

impl Facets {
    /// The sides of a facet's parts.
    pub(crate) fn sides_of(&self, facet: usize) -> impl Iterator<Item = Side> {
        let sides = move |part| {
            self.sides.are_backs().iter().map(move |&back| Side {
                part,
                back,
                polygon: seen_from(&self.parts[part].polygon, back),
            })
        };
        self.facets[facet].parts.clone().flat_map(sides)
    }

    /// Begins a search for the partners of a part's side, without parts of the `skipped` facets.
    pub(crate) fn partners<'a>(&'a self, of: &'a Side, skipped: Range<usize>) -> PartnerSearch<'a> {
        PartnerSearch {
            facets: self,
            of,
            skipped,
            patches: 0..self.patches.len(),
            waiting: Vec::new(),
        }
    }
}

/// A search for partners, patch by patch.
pub(crate) struct PartnerSearch<'a> {
    facets: &'a Facets,
    of: &'a Side,
    skipped: Range<usize>,
    /// The patches that have not been searched yet.
    patches: Range<usize>,
    /// The stack of the search: nodes of the current patch's tree that have not been visited yet.
    waiting: Vec<WaitingNode>,
}

/// A node of a patch's tree that waits to be visited.
struct WaitingNode {
    patch: usize,
    /// Whether the patch is seen from its back.
    back: bool,
    node: usize,
    candidates: Candidates,
}

impl PartnerSearch<'_> {
    /// Returns the next partner; `None` when there are no more.
    pub(crate) fn next(&mut self, memory: &mut Memory) -> Option<Partner> {
        loop {
            let partner = match self.waiting.pop() {
                Some(waiting) => self.visit(&waiting, memory),
                None => {
                    let patch = self.patches.next()?;
                    self.begin(patch);
                    None
                }
            };
            if partner.is_some() {
                return partner;
            }
        }
    }

    /// Puts the root of a patch's tree on the stack, once for each side, the front on top. The
    /// stack stays as it is for the part's own patch and for patches whose facets are all skipped.
    fn begin(&mut self, patch: usize) {
        stop::check();
        let own = self.facets.parts[self.of.part].patch;
        if patch == own || self.skips(&self.facets.patches[patch].facets) {
            return;
        }
        let backs = self.facets.sides.are_backs().iter().rev();
        self.waiting.extend(backs.map(|&back| WaitingNode {
            patch,
            back,
            node: 0,
            candidates: Candidates::All,
        }));
    }

    /// Whether all facets of a range are skipped.
    fn skips(&self, facets: &RangeInclusive<usize>) -> bool {
        self.skipped.start <= *facets.start() && *facets.end() < self.skipped.end
    }

    /// Counts the parts in a range of a patch's tree whose facets are not skipped.
    fn count(&self, patch: &Patch, items: Range<usize>) -> u64 {
        let is_left = |part: &&usize| {
            let facet = self.facets.parts[**part].facet;
            !self.skips(&(facet..=facet))
        };
        let (first, last) = (patch.facets.start(), patch.facets.end());
        if self.skipped.start > *last || self.skipped.end <= *first {
            return items.len() as u64;
        }
        patch.tree.order[items].iter().filter(is_left).count() as u64
    }

    /// Visits a node. Returns its parts as a partner; or `None` if they are skipped, or if the
    /// node's children were put on the stack instead.
    fn visit(&mut self, at: &WaitingNode, memory: &mut Memory) -> Option<Partner> {
        let all = self.facets;
        let patch = &all.patches[at.patch];
        let node = &patch.tree.nodes[at.node];
        let part = patch.tree.order[node.items.start];
        let (own, facet) = (all.parts[self.of.part].facet, all.parts[part].facet);
        if node.children.is_none() && self.skips(&(facet..=facet)) {
            return None;
        }
        let partner = |sight| Partner {
            part,
            back: at.back,
            count: self.count(patch, node.items.clone()),
            sight,
        };
        // Clip the part and the rectangle around the node, each to what is before the other's
        // plane.
        let around = seen_from(&patch.around[at.node], at.back);
        let patches = [all.parts[self.of.part].patch, at.patch];
        let flatness = all.flatness(patches);
        let Some(pair) = before_each_other(&self.of.polygon, &around, flatness) else {
            return Some(partner(Sight::FacingAway));
        };
        // At a leaf, whose rectangle is its part, find what the two parts see of each other.
        let Some(children) = node.children else {
            let [p, q] = pair;
            let polygons = if own < facet { [p, q] } else { [q, p] };
            let sight = all.sight(polygons, patches, &at.candidates, memory);
            return Some(partner(sight));
        };
        // Go on in the children unless everything is hidden. Patches that only touch this hull stay
        // candidates, since through rounding they may overlap the hull of a child.
        let between = all.patches_between(&pair, patches, &at.candidates, true);
        if all.is_hidden(&pair, patches, &between) {
            return Some(partner(Sight::Hidden));
        }
        let candidates = Candidates::These(between.into());
        self.waiting
            .extend(children.into_iter().rev().map(|node| WaitingNode {
                node,
                candidates: candidates.clone(),
                ..*at
            }));
        None
    }
}

/// Returns a polygon as seen from its front, or, with `back`, from its back: with reversed
/// orientation.
fn seen_from(polygon: &ConvexPolygon, back: bool) -> ConvexPolygon {
    if back { polygon.flipped() } else { *polygon }
}
