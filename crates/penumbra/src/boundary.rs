//! The boundary of the visible part of a light. `docs/decisions/006-exact-by-the-boundary.md`
//! explains the method.
//!
//! In this module, the *image* of a triangle is its projection from the shading point onto the
//! light's plane. The steps, in order: `steps` is the interface; `edges` collects the edges of
//! images, each once; `side` finds where the edges cross; `counts` counts the images over the
//! points next to each edge; and `stretches` does the same for surfaces of which only silhouettes
//! are known.
//!
//! Some functions are marked as not to be inlined: they are faster by themselves (by an eighth of
//! the total time on the grid scene), since together they make the compiler keep too much on the
//! stack.

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

/// A straight piece of the boundary of a light's visible part, which is on the left of the piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryEdge {
    /// The start of the edge.
    pub from: Point,
    /// The end of the edge.
    pub to: Point,
}

/// The distance of a rounded point from a side of a triangle, in units of the light, below which it
/// is not decided from the point on which side it lies; exact decisions replace it then.
const CLOSE: f64 = 1e-9;

/// Finds the boundary of the part of a convex polygon that triangles in its plane do not hide. One
/// value can be used for any number of polygons, and reuses its buffers.
#[derive(Debug, Default)]
pub struct Penumbra {
    /// The light's corners as the caller gave them; if the next light has the same, everything that
    /// depends on the light alone is kept.
    given: Vec<Point>,
    light: Vec<Point>,
    /// The light's own sides, as sides of the search, each with the bounding box in which other
    /// sides may matter to it.
    around: Vec<Side>,
    around_boxes: Vec<Bounds>,
    /// The largest absolute coordinate of the light.
    unit: f64,
    /// A rectangle inside the light; edges within it need not be clipped.
    core: Bounds,
    images: Vec<Image>,
    edges: Edges,
    surface_edges: Edges,
    sides: Vec<Side>,
    /// The hash table of sides by the points where they start.
    starts: Vec<Option<Index>>,
    /// For each side, the bounding box of its part on the light.
    boxes: Vec<Bounds>,
    images_at: Grids,
    sides_near: Bins,
    events: Vec<Event>,
    /// The events of the side that is processed now, each with its position along the side, in
    /// ascending order.
    own: Vec<(f64, Index)>,
    /// The indices of sides whose counts are known but which are not processed yet, with the
    /// counts.
    handed: Vec<(usize, i32)>,
    /// The number of sides whose counts are neither known nor in `handed`.
    unknown: usize,
    pieces: Vec<BoundaryEdge>,
    /// Whether there are surfaces that are known by their silhouettes only.
    past_surfaces: bool,
    stretches: Stretches,
}

impl Penumbra {
    /// Finds the boundary of the part of the light that triangles do not hide; if there are
    /// silhouettes, finds the stretches of the outline instead.
    fn find(&mut self) {
        self.pieces.clear();
        self.stretches.clear();
        if self.light.len() < 3 {
            // Sides and events of the previous light refer to stretches that no longer exist.
            self.sides.clear();
            self.events.clear();
            return;
        }
        // Sort the images into grids for point queries.
        let on_light = Bounds::of_all(&self.light);
        let room = CLOSE * self.unit;
        let bounds = self.images.iter().map(|i| i.bounds.wider(room));
        self.images_at.fill(&on_light, bounds);
        // Decide on the light alone; where rounding may decide, start over in the whole plane,
        // where every decision is exact.
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

    /// Returns the number of edges of triangles and silhouettes that the last boundary had to
    /// follow. The time is proportional to it.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.sides.len().saturating_sub(self.light.len())
    }

    /// Sets the light, and everything that depends on it alone.
    fn set_light(&mut self, light: &[Point]) {
        if self.given == light {
            return;
        }
        self.given.clear();
        self.given.extend_from_slice(light);
        // Orient the light counter-clockwise.
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
        // Find a core: the bounding rectangle, narrowed so that the corners of a rectangular
        // light's bounds are inside the light. Without a core, as for most other shapes, all edges
        // are clipped, which takes time but changes no result.
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

    /// Collects the light's sides, in reverse direction, and where they touch each other.
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
            // The last side is followed by the first.
            let next = if i > 0 { self.around.len() + 1 } else { 0 };
            side.next = Some(Index::new(next));
            self.around.push(side);
            self.around_boxes.push(bounds);
        }
        // Record only that they touch, since the sides add nothing to each other's counts.
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

    /// Collects the edges at which the number of images changes, each once, after images were added
    /// from index `known` on.
    fn collect_edges(&mut self, known: usize) {
        let Self { images, edges, .. } = self;
        edges.make_room(3 * (images.len() - known));
        // Count the image on the left of its edges, and link each edge to the next one around the
        // image.
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

    /// Collects the sides that take part: the edges at which the number of images changes, either
    /// those close to the light or all, and the light's own sides.
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
            // Direct the edge so that more images are on its left than on its right, and find the
            // part of it on the light.
            let edge = if *weight < 0 { edge.reversed() } else { *edge };
            let inside = whole.is_within(&self.core);
            // Where an edge runs along an edge of the light, the light's own side represents it.
            let part = match (inside, near) {
                (true, _) => Some(edge.whole()),
                (false, true) => edge.within(&self.light),
                (false, false) => None,
            };
            // Find the bounding box in which other sides matter to this one.
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
            // If the edge is clipped, counting starts where it enters the light.
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

    /// Appends the light's own sides.
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

    /// Finds the next side for sides that have none: silhouettes of a mesh continue from one
    /// triangle to the next. Where several meet they touch, so that it does not matter which of
    /// them is found.
    #[allow(clippy::float_cmp, reason = "the very same corner")]
    fn join_sides(&mut self) {
        // Around an image, translate the next edge to its side.
        for side in &mut self.sides {
            if let Some(next) = side.next {
                let next = &self.edges.all[next.get()];
                side.next = next.side.filter(|_| next.weight > 0);
            }
        }
        if self.sides.iter().all(|side| side.next.is_some()) {
            return;
        }
        // Enter all sides in a hash table by their start, then look up the ends of those without a
        // next side.
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

    /// Collects the events: where sides cross.
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
        // Test each pair of sides with overlapping boxes, except the light's sides among each
        // other.
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

/// Returns the point with minus zero, which has another hash, and numbers that would underflow in
/// products replaced by zero; this moves a point by at most 1e-60.
fn settled(p: Point) -> Point {
    let flush = |x: f64| if x.abs() < 1e-60 { 0.0 } else { x };
    [flush(p[0]), flush(p[1])]
}
