//! The boundary past surfaces of which only the silhouettes are known.
//!
//! Two things hide points of the light: *images* of single triangles, and *surfaces* (meshes), of
//! which only the silhouettes are known. This file walks along *sides*: the sides of images,
//! silhouettes, and the sides of the light itself. A point is visible if no image and no layer of a
//! surface is over it. Images are counted ([`counts`](super::counts)); where sides of surfaces
//! coincide with others, they count as images, too. How many layers of surfaces are over a point is
//! not known, but each silhouette says how many more there are on its left than on its right: its
//! weight. So the number of layers right next to a side, on its right, is an unknown x plus a known
//! number, which changes at each *event*, where another side crosses:
//!
//! ```text
//!                      a silhouette
//!                      of weight 2           images
//!                            ▲             ▒▒▒▒▒▒▒▒▒▒
//!    ────────────────────────┼─────────────▒▒▒▒▒▒▒▒▒▒──────────────────► a side
//!     layers right of it:  x       x − 2   ▒▒▒▒▒▒▒▒▒▒       y
//!    ╰─────── stretch ──────╯╰── stretch ─╯          ╰──── stretch ────╯
//! ```
//!
//! Behind images, silhouettes may be missing, so where a side comes out from behind images, a new
//! unknown begins. A *stretch* is a part of a side, past images, between two events: either all of
//! it is boundary or nothing of it.
//!
//! Where two sides cross, one sector is right of both, and the counts along both sides agree on its
//! layers. This is an equation ([`LayerEquations`]). Below, x and y are the counts where a and b
//! come from, and b has the weight 1, so that there is one layer less right of b than left of it:
//!
//! ```text
//!                ▲ b
//!         left   │   right of b,
//!       of both  │   left of a
//!    ────────────┼────────────────► a
//!      right of  │  right of both:     after the crossing, along a: x − 1
//!      a, left   │                     before the crossing, along b: y          x − 1 = y
//!      of b      │
//! ```
//!
//! Two more kinds of equations come from a side that continues in the next one, around the same
//! image or the same surface, and from a side that enters the light through one of the light's own
//! sides.
//!
//! Stretches whose unknowns are connected by equations are a *group*. Within a group all counts can
//! be compared, and no count is negative. So one query per group is enough, at a point next to the
//! stretch with the lowest count: if nothing is over the point, this count is zero, and the
//! stretches with this count are boundary; if something is over it, all counts are positive, and no
//! stretch of the group is boundary.
//!
//! Rounding costs queries and never makes errors: what is too close to decide gives no equation, so
//! that there are more groups, and a stretch without noticeable length never represents a group. (A
//! group of only such stretches is left out, as its part of the boundary has no length either.
//! Where counts contradict each other, or no point for a query can be found, the caller uses
//! another method.)

use super::index::Index;
use super::layer_counts::{LayerCount, LayerEquations};
use super::layers::Layers;
use super::side::Side;
use super::{BoundaryEdge, CLOSE, Penumbra};
use crate::clip::End;
use crate::orient::Point;
use linelit_geometry::stop;

/// A part of a side, past images, between two points where the layers right of it change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) side: Index,
    /// The number of layers of surfaces right of the stretch.
    pub(super) layers: LayerCount,
    pub(super) lo: End,
    pub(super) hi: End,
}

/// The stretches of all sides, and the equations between their counts.
#[derive(Debug, Default)]
pub(super) struct Stretches {
    all: Vec<Stretch>,
    equations: LayerEquations,
    /// For the root of each group's unknowns, the stretch that represents the group: the longest of
    /// those with the lowest count.
    lowest: Vec<Option<Index>>,
    /// For the root of each group's unknowns, the known part of the count up to which stretches are
    /// boundary: the count of the stretch at which the query was made, below which there are only
    /// short ones. `None` if something is over all stretches of the group.
    visible: Vec<Option<i32>>,
}

/// The length, in units of the light, up to which a stretch (the part of an edge between two
/// crossings) is not tested on behalf of its group of stretches, since rounding may have made it.
const SHORT: f64 = 1e-12;

impl Stretch {
    /// Returns the length of the stretch along the axes (L₁ norm), which is at most √2 times its
    /// length.
    pub(super) fn length(&self) -> f64 {
        let (a, b) = (self.lo.point, self.hi.point);
        (a[0] - b[0]).abs() + (a[1] - b[1]).abs()
    }

    /// Whether this stretch represents its group better than another stretch of the group: because
    /// this one is longer than `short` and the other is not, or has the lower count, or is longer
    /// at the same count.
    fn is_lower(&self, other: &Self, short: f64) -> bool {
        let (length, others) = (self.length(), other.length());
        match (length > short, others > short) {
            (true, false) => true,
            (false, true) => false,
            _ if self.layers.plus == other.layers.plus => length > others,
            _ => self.layers.plus < other.layers.plus,
        }
    }
}

impl Stretches {
    pub(super) fn iter(&self) -> impl Iterator<Item = [Point; 2]> {
        self.all.iter().map(|s| [s.lo.point, s.hi.point])
    }

    pub(super) fn all(&self) -> &[Stretch] {
        &self.all
    }

    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.equations.clear();
    }

    /// Expresses the counts of all stretches by the roots of their groups, and finds the stretch
    /// that represents each group.
    fn find_lowest(&mut self, short: f64) {
        self.lowest.clear();
        self.lowest.resize(self.equations.len(), None);
        for i in 0..self.all.len() {
            let layers = self.equations.by_root(self.all[i].layers);
            self.all[i].layers = layers;
            let lowest = &mut self.lowest[layers.unknown.get()];
            let is_lower = |other: Index| self.all[i].is_lower(&self.all[other.get()], short);
            if lowest.is_none_or(is_lower) {
                *lowest = Some(Index::new(i));
            }
        }
    }

    /// Returns the stretches that are boundary, after [`Self::visible`] was filled.
    fn visible(&self) -> impl Iterator<Item = &Stretch> {
        self.all.iter().filter(|stretch| {
            let most = self.visible[stretch.layers.unknown.get()];
            most.is_some_and(|most| stretch.layers.plus <= most)
        })
    }
}

impl Penumbra {
    /// Collects the stretches of the side with index `i`, where `images` is the number of images
    /// right of the point where counting starts. Stores at the side's ends and crossings the counts
    /// that equations with other sides need.
    pub(super) fn collect_stretches(&mut self, i: usize, mut images: i32) {
        let Self {
            sides,
            own,
            events,
            stretches,
            unit,
            ..
        } = self;
        let Stretches { all, equations, .. } = stretches;
        let side = &mut sides[i];
        let Some(part) = side.part else { return };
        // The ends of a loose side are rounded noticeably where others cut it, and so are its
        // events. The light's own sides are exact, whatever crosses them. Positions and the margin
        // are in units of length².
        let is_loose = side.is_loose && !side.light;
        let room = CLOSE * *unit * side.edge.extent();
        let mut passed = Layers::default();
        let mut layers = (images == 0).then(|| equations.new_unknown());
        side.layers_at_start = layers;
        let (mut reached, mut previous) = (part.lo, part.lo.at);
        for k in 0..=own.len() {
            // End the current stretch at the event, or at the end of the side.
            let event = own.get(k).map(|(_, event)| event.get());
            let hi = event.map_or(part.hi, |event| events[event].end);
            if hi.at > reached.at {
                all.extend(layers.map(|layers| Stretch {
                    side: Index::new(i),
                    layers,
                    lo: reached,
                    hi,
                }));
                reached = hi;
            }
            let Some(event) = event else { break };
            let event = &mut events[event];
            // Find the count beyond the event; where the side comes out from behind images, it is a
            // new unknown.
            let layers_before = layers;
            passed += event.change;
            images += event.change.images;
            layers = match layers {
                _ if images != 0 => None,
                Some(layers) => Some(layers.plus(event.change.surfaces)),
                None => Some(equations.new_unknown()),
            };
            // Store the count of the sector that is right of both sides: it is before the event if
            // this side passes to the left of the other.
            let next = own.get(k + 1).map_or(part.hi.at, |next| next.0);
            let is_certain = !is_loose && (hi.at - previous).min(next - hi.at) > room;
            event.layers = match event.to_left {
                _ if !is_certain => None,
                true => layers_before,
                false => layers,
            };
            previous = hi.at;
        }
        // Crossings that rounding moves to the very end of the side have no event; they make the
        // rest of the side's total change.
        let left = side.change + -passed;
        let layers = layers.filter(|_| images + left.images == 0);
        side.layers_at_end = layers.map(|layers| layers.plus(left.surfaces));
    }

    /// Finds which stretches are boundary, by one call of `is_visible` for each group of stretches.
    /// Returns false if counts contradict each other, or if there is no point at which to query.
    pub(super) fn find_boundary(
        &mut self,
        least: f64,
        mut is_visible: impl FnMut(Point) -> bool,
    ) -> bool {
        self.pieces.clear();
        // Join the stretches to groups, and find the stretch with the fewest layers in each.
        if !self.equate_layers() {
            return false;
        }
        let short = SHORT * self.unit;
        self.stretches.find_lowest(short);
        // Query next to it whether anything is over it. A group of only short stretches is left
        // out.
        self.stretches.visible.clear();
        for root in 0..self.stretches.lowest.len() {
            stop::check();
            let lowest = self.stretches.lowest[root].map(|i| self.stretches.all[i.get()]);
            let mut visible = None;
            if let Some(lowest) = lowest.filter(|stretch| stretch.length() > short) {
                let Some(point) = self.query_point(&lowest, least) else {
                    return false;
                };
                visible = is_visible(point).then_some(lowest.layers.plus);
            }
            self.stretches.visible.push(visible);
        }
        // What is visible is right of a side but left of the boundary, so reverse the direction.
        let visible = self.stretches.visible();
        self.pieces.extend(visible.map(|stretch| BoundaryEdge {
            from: stretch.hi.point,
            to: stretch.lo.point,
        }));
        true
    }

    /// Adds the equations between counts of sides that have the same point on their right; returns
    /// false if the equations contradict each other.
    fn equate_layers(&mut self) -> bool {
        let Self {
            sides,
            events,
            stretches,
            ..
        } = self;
        let mut agree = true;
        let mut equate = |a: Option<LayerCount>, b: Option<LayerCount>| {
            if let (Some(a), Some(b)) = (a, b) {
                agree &= stretches.equations.equate(a, b);
            }
        };
        // At crossings, from both sides; each pair once.
        for (i, event) in events.iter().enumerate() {
            if let Some(twin) = event.twin.map(Index::get).filter(|twin| *twin > i) {
                equate(event.layers, events[twin].layers);
            }
        }
        for side in &*sides {
            // Where a side enters the light, if counting starts there. (`counted` is negative where
            // it does not, and a touched end is not an entry.)
            let is_cut = side.counted >= 0.0 && !side.touched[0];
            if let Some(entry) = side.entry.filter(|_| is_cut) {
                equate(side.layers_at_start, events[entry.get()].layers);
            }
            // Where a side continues in the next one around the same image or the same surface.
            let is_image = |side: &Side| side.weight.images != 0;
            if let Some(next) = side.next.map(|next| &sides[next.get()])
                && is_image(side) == is_image(next)
                && side.goes_on_in(next)
            {
                equate(side.layers_at_end, next.layers_at_start);
            }
        }
        agree
    }
}
