//! The boundary of what is visible; `docs/decisions/006-exact-by-the-boundary.md` says why.
//!
//! What is not to be inlined is faster by itself (an eighth of all on the grid): together, the
//! compiler keeps too much on the stack.

mod counts;
mod edges;
mod image;
mod index;
mod layer_counts;
mod layers;
mod query_point;
mod side;
mod steps;
mod stretches;

use crate::bins::{Bins, Bounds};
use crate::clip::{Edge, Start};
use crate::grids::Grids;
use crate::orient::{Point, orient};
use edges::{Edges, Shared, hash, spread};
use image::Image;
use index::Index;
use layers::Layers;
use linelit_geometry::stop;
use side::{Event, Extent, Side, are_neighbours, meet};
pub use steps::{Occluded, Outline};
use stretches::Stretches;

/// A straight piece of the boundary of the visible part of a light; what is visible lies on its
/// left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryEdge {
    /// The start of the edge.
    pub from: Point,
    /// The end of the edge.
    pub to: Point,
}

/// The distance of a rounded point from a side of a triangle, in units of the light, below which
/// nothing is concluded from its position.
const CLOSE: f64 = 1e-9;

/// Finds the boundary of what is visible of a convex polygon behind triangles; one value, kept,
/// serves any number of polygons with the same buffers.
#[derive(Debug, Default)]
pub struct Penumbra {
    /// The light as it was given: often the same again.
    given: Vec<Point>,
    light: Vec<Point>,
    /// The sides of the light, and the boxes in which they may matter.
    around: Vec<Side>,
    around_boxes: Vec<Bounds>,
    /// The light's largest coordinate.
    unit: f64,
    /// A part of the light; what is within it need not be cut.
    core: Bounds,
    images: Vec<Image>,
    edges: Edges,
    surface_edges: Edges,
    sides: Vec<Side>,
    /// The hash table of sides by the point where they start.
    starts: Vec<Option<Index>>,
    /// The box in which each side may matter.
    boxes: Vec<Bounds>,
    images_at: Grids,
    sides_near: Bins,
    events: Vec<Event>,
    /// The events of one side, in ascending order.
    own: Vec<(f64, Index)>,
    /// Sides whose counts are known, but not what follows from them.
    handed: Vec<(usize, i32)>,
    /// The number of sides outside of `handed` whose counts are not known.
    unknown: usize,
    pieces: Vec<BoundaryEdge>,
    /// Whether there may be surfaces.
    past_surfaces: bool,
    stretches: Stretches,
}

impl Penumbra {
    /// Finds the boundary past triangles, or, past silhouettes, too, the outline.
    fn find(&mut self) {
        self.pieces.clear();
        self.stretches.clear();
        if self.light.len() < 3 {
            // Sides and events of the last light name stretches that are gone.
            self.sides.clear();
            self.events.clear();
            return;
        }
        let on_light = Bounds::of_all(&self.light);
        let room = CLOSE * self.unit;
        let bounds = self.images.iter().map(|i| i.bounds.wider(room));
        self.images_at.fill(&on_light, bounds);
        for extent in [Extent::Light, Extent::All] {
            self.pieces.clear();
            self.stretches.clear();
            self.collect_sides(&on_light, extent);
            self.collect_events(&on_light);
            if self.count(extent) {
                break;
            }
        }
    }

    /// Returns the number of edges, of triangles and silhouettes, that the last boundary had to
    /// follow, which its time is proportional to.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.sides.len().saturating_sub(self.light.len())
    }

    fn set_light(&mut self, light: &[Point]) {
        if self.given == light {
            return;
        }
        self.given.clear();
        self.given.extend_from_slice(light);
        self.light.clear();
        self.light.extend(light.iter().copied().map(settled));
        let area: f64 = (1..light.len().max(1) - 1)
            .map(|i| orient(light[0], light[i], light[i + 1]))
            .sum();
        if area < 0.0 {
            self.light.reverse();
        }
        let sizes = self.light.iter().flatten().map(|x| x.abs());
        self.unit = sizes.fold(0.0, f64::max);
        self.collect_around();
        // A rectangle's bounds, narrowed so that their corners are inside: without that there would
        // be no core, and all would be cut, which takes time but leaves what is found.
        let core = Bounds::of_all(&self.light).wider(-CLOSE * self.unit);
        let Bounds {
            low: [a, b],
            high: [c, d],
        } = core;
        let before = |i: usize| self.light[(i + self.light.len() - 1) % self.light.len()];
        let well = |p: Point| {
            let mut sides = (0..self.light.len()).map(|i| (before(i), self.light[i]));
            sides.all(|(from, to)| orient(from, to, p) > 0.0)
        };
        let holds = [[a, b], [c, b], [c, d], [a, d]].into_iter().all(well);
        self.core = if holds && a < c && b < d {
            core
        } else {
            Bounds::NONE
        };
    }

    /// The light's sides, backwards, and how they meet each other.
    fn collect_around(&mut self) {
        self.around.clear();
        self.around_boxes.clear();
        let count = self.light.len();
        for i in (0..count).rev() {
            let (from, to) = (self.light[(i + 1) % count], self.light[i]);
            let edge = Edge::new(from, to);
            let bounds = Bounds::of([from, to]).wider(CLOSE * self.unit);
            let whole = Some(edge.whole());
            let mut side = Side::new(edge, Layers::default(), whole);
            side.light = true;
            // The last has the first after it.
            let next = if i > 0 { self.around.len() + 1 } else { 0 };
            side.next = Some(Index::new(next));
            self.around.push(side);
            self.around_boxes.push(bounds);
        }
        // Only that they touch: nothing comes or goes where they do.
        for i in 0..count {
            let (before, after) = self.around.split_at_mut(i + 1);
            let e = &mut before[i];
            for (j, f) in (i + 1..).zip(after) {
                let boxes = &self.around_boxes;
                if boxes[i].meets(&boxes[j]) && !are_neighbours(e, i, f, j) {
                    meet(e, f, self.unit, &mut self.events);
                }
            }
        }
    }

    /// The edges where the number of images changes, each once, of the images from `known` on and
    /// those before.
    fn collect_edges(&mut self, known: usize) {
        let Self { images, edges, .. } = self;
        edges.make_room(3 * (images.len() - known));
        for image in &images[known..] {
            let [a, b, c] = image.corners;
            let (p, q, r) = (hash(a), hash(b), hash(c));
            let ab = edges.count(a, b, p.wrapping_add(q), 1);
            let bc = edges.count(b, c, q.wrapping_add(r), 1);
            let ca = edges.count(c, a, r.wrapping_add(p), 1);
            for (this, next) in [(ab, bc), (bc, ca), (ca, ab)] {
                if let (Some(this), Some(next)) = (this, next) {
                    edges.all[this].next = Some(Index::new(next));
                }
            }
        }
    }

    /// Collects the sides that take part: of the edges where the number of images changes, those
    /// that come near the light, or all; and the light's.
    fn collect_sides(&mut self, on_light: &Bounds, extent: Extent) {
        self.sides.clear();
        self.boxes.clear();
        let room = CLOSE * self.unit;
        let images = self.edges.all.len();
        let edges = self.edges.all.iter_mut();
        for (place, shared) in edges.chain(&mut self.surface_edges.all).enumerate() {
            let Shared { edge, weight, .. } = shared;
            let whole = Bounds::of([edge.from, edge.to]);
            let near = whole.meets(on_light);
            shared.side = None;
            let has_none = *weight == 0 || edge.length == 0.0;
            if has_none || (!near && extent == Extent::Light) {
                continue;
            }
            let edge = if *weight < 0 { edge.reversed() } else { *edge };
            let inside = whole.is_within(&self.core);
            // What lies along an edge of the light is left to the light.
            let part = match (inside, near) {
                (true, _) => Some(edge.whole()),
                (false, true) => edge.within(&self.light),
                (false, false) => None,
            };
            let bounds = match &part {
                Some(part) if extent == Extent::Light && !inside => {
                    Bounds::of([part.lo.point, part.hi.point]).wider(room)
                }
                _ => whole,
            };
            self.boxes.push(bounds);
            let weight_of = match place < images {
                true => Layers::of_images,
                false => Layers::of_surfaces,
            };
            let mut side = Side::new(edge, weight_of(weight.abs()), part);
            if *weight > 0 {
                side.next = shared.next;
            }
            if let Some(part) = part
                && extent == Extent::Light
                && let Start::Cut(slack) = part.start
            {
                side.counted = part.lo.at;
                side.close = room * edge.extent();
                side.touched[0] = slack > 0.2 * room;
            }
            shared.side = Some(Index::new(self.sides.len()));
            self.sides.push(side);
        }
        self.join_sides();
        self.collect_lights_sides();
    }

    /// Adds the light's sides to the others.
    fn collect_lights_sides(&mut self) {
        let first = self.sides.len();
        self.boxes.extend_from_slice(&self.around_boxes);
        self.sides.extend_from_slice(&self.around);
        for side in &mut self.sides[first..] {
            side.next = side.next.map(|next| Index::new(first + next.get()));
        }
        for (place, side) in self.sides.iter_mut().enumerate() {
            side.place = Index::new(place);
        }
    }

    /// Finds what comes after the sides that have none after them: silhouettes of a mesh go on from
    /// one triangle to another. Where more of them meet, they touch, so that it does not matter
    /// which is found.
    #[allow(clippy::float_cmp, reason = "the very same corner")]
    fn join_sides(&mut self) {
        // Around an image, from edges to sides.
        for side in &mut self.sides {
            if let Some(next) = side.next {
                let next = &self.edges.all[next.get()];
                side.next = next.side.filter(|_| next.weight > 0);
            }
        }
        if self.sides.iter().all(|side| side.next.is_some()) {
            return;
        }
        let Self {
            sides,
            starts: table,
            ..
        } = self;
        table.clear();
        table.resize((2 * sides.len()).next_power_of_two(), None);
        let mask = table.len() - 1;
        for (i, side) in sides.iter().enumerate() {
            let mut slot = spread(hash(side.edge.from)) & mask;
            while table[slot].is_some() {
                slot = (slot + 1) & mask;
            }
            table[slot] = Some(Index::new(i));
        }
        for i in 0..sides.len() {
            if sides[i].next.is_some() {
                continue;
            }
            let to = sides[i].edge.to;
            let mut slot = spread(hash(to)) & mask;
            while let Some(next) = table[slot] {
                if sides[next.get()].edge.from == to {
                    sides[i].next = Some(next);
                    break;
                }
                slot = (slot + 1) & mask;
            }
        }
    }

    /// Collects the places where sides cross.
    #[inline(never)]
    fn collect_events(&mut self, on_light: &Bounds) {
        let Self {
            light,
            sides,
            boxes,
            events,
            sides_near,
            unit,
            ..
        } = self;
        events.clear();
        sides_near.fill(on_light, boxes.iter().copied());
        for i in 0..sides.len() - light.len() {
            let (before, after) = sides.split_at_mut(i + 1);
            let e = &mut before[i];
            stop::check();
            for j in sides_near.near(&boxes[i], i + 1) {
                if !boxes[i].meets(&boxes[j]) {
                    continue;
                }
                let f = &mut after[j - i - 1];
                let matters = e.part.is_some() | f.part.is_some();
                if matters && !are_neighbours(e, i, f, j) {
                    meet(e, f, *unit, events);
                }
            }
        }
    }
}

/// Replaces −0, which has another hash, and what would underflow in a product by 0; moves a point
/// by 1e-60 of the light's size.
fn settled(p: Point) -> Point {
    let flush = |x: f64| if x.abs() < 1e-60 { 0.0 } else { x };
    [flush(p[0]), flush(p[1])]
}
