//! The boundary of what is visible; `docs/decisions/006-exact-by-the-boundary.md` says why.
//!
//! What is not to be inlined is faster by itself (an eighth of all on the grid): together, the
//! compiler keeps too much on the stack.

use super::bins::{Bins, Bounds};
use super::clip::{Edge, End, Meeting, Span, Start};
use super::orient::{Point, orient};

/// A straight piece of the boundary of the visible part of a light; what is visible lies on its
/// left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryEdge {
    /// Where it starts.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
}

/// A triangle's image, counter-clockwise, and its bounds.
#[derive(Clone, Copy, Debug)]
struct Image {
    corners: [Point; 3],
    bounds: Bounds,
}

/// An edge of images, once for all that share it.
#[derive(Clone, Copy, Debug)]
struct Shared {
    edge: Edge,
    /// Images on its left less images on its right.
    weight: i32,
    /// The edge after it around an image, plus one, if both run that way.
    next: u32,
    /// The side that it is, plus one.
    side: u32,
}

/// An edge of images or of the light that takes part.
#[derive(Clone, Copy, Debug)]
struct Side {
    edge: Edge,
    /// Images on its left less images on its right.
    weight: i32,
    /// Whether it is the light's, backwards: the light is on its right.
    light: bool,
    /// The part of it that is on the light.
    part: Option<Span>,
    /// Images just right of it where counting starts, once that is known.
    count: Option<i32>,
    /// What all events add to that.
    change: i32,
    /// Where counting starts: what comes before, or there, has been counted.
    counted: f64,
    /// How close to there rounding may decide.
    close: f64,
    /// The last of its events, plus one.
    events: u32,
    /// The side after it around an image, plus one: where it ends and that one starts, no image
    /// comes or goes, but where they are touched.
    next: u32,
    /// Whether anything else goes through its first or last point, or so close to where it is cut
    /// that rounding may decide.
    touched: [bool; 2],
    /// Where it comes onto the light, as an event of a side of the light, plus one.
    entry: u32,
}

/// A place on a side where the number of images just right of it changes.
#[derive(Clone, Copy, Debug)]
struct Event {
    change: i32,
    end: End,
    /// The event of the same side that was found before, plus one.
    before: u32,
    /// On a side of the light: images right of the edge that comes in or goes out here; none if
    /// another is too close.
    right: Option<i32>,
}

/// How close to a side of a triangle a rounded point may be, in units of the light, before nothing
/// is concluded from where it is.
const CLOSE: f64 = 1e-9;

/// Finds the boundary of what is visible of a convex polygon behind triangles; one value, kept,
/// serves any number of polygons with the same buffers.
#[derive(Debug, Default)]
pub struct Penumbra {
    /// The light as it was given: often the same again.
    given: Vec<Point>,
    light: Vec<Point>,
    /// Its sides, and where they may matter.
    around: Vec<Side>,
    around_boxes: Vec<Bounds>,
    /// The light's largest coordinate.
    unit: f64,
    /// A part of the light; what is within it need not be cut.
    core: Bounds,
    images: Vec<Image>,
    edges: Vec<Shared>,
    /// Which of `edges` has which ends: places in it plus one, by a hash of the ends.
    table: Vec<u32>,
    sides: Vec<Side>,
    /// Where each side may matter.
    boxes: Vec<Bounds>,
    images_near: Bins,
    sides_near: Bins,
    events: Vec<Event>,
    /// The events of one side, in ascending order.
    own: Vec<(f64, u32)>,
    pieces: Vec<BoundaryEdge>,
}

impl Penumbra {
    /// The boundary of a convex polygon minus triangles in its plane, each in either winding.
    ///
    /// Edges come in no particular order; together they are closed curves, counter-clockwise
    /// around the visible part and clockwise around its holes, but for ends that are rounded.
    /// Empty if nothing is visible or the light has fewer than three corners. Coordinates are
    /// zero or between 1e-60 and 1e60.
    pub fn boundary(
        &mut self,
        light: &[Point],
        triangles: impl Iterator<Item = [Point; 3]>,
    ) -> &[BoundaryEdge] {
        self.pieces.clear();
        self.set_light(light);
        if self.light.len() < 3 {
            return &self.pieces;
        }
        let on_light = Bounds::of_all(&self.light);
        self.images.clear();
        let images = triangles.filter_map(Image::new);
        self.images
            .extend(images.filter(|i| i.bounds.meets(&on_light)));
        self.collect_edges();
        let bounds = self.images.iter().map(|i| i.bounds);
        self.images_near.fill(&on_light, bounds);
        for extent in [Extent::Light, Extent::All] {
            self.collect_sides(&on_light, extent);
            self.collect_events(&on_light);
            if self.count(extent) {
                break;
            }
        }
        self.collect_pieces();
        &self.pieces
    }

    /// How many edges of triangles the last boundary had to follow: what its time goes by.
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
            let mut side = Side::new(edge, 0, whole);
            side.light = true;
            // The last has the first after it.
            side.next = index(if i > 0 { self.around.len() + 2 } else { 1 });
            self.around.push(side);
            self.around_boxes.push(bounds);
        }
        // Only that they touch: nothing comes or goes where they do.
        for i in 0..count {
            let (before, after) = self.around.split_at_mut(i + 1);
            let e = &mut before[i];
            for (j, f) in (i + 1..).zip(after) {
                let boxes = &self.around_boxes;
                if boxes[i].meets(&boxes[j]) && !are_neighbours((e, i), (f, j)) {
                    meet(e, f, &mut self.events);
                }
            }
        }
    }

    /// The edges where the number of images changes, each once.
    fn collect_edges(&mut self) {
        self.edges.clear();
        self.table.clear();
        let room = (6 * self.images.len()).next_power_of_two();
        self.table.resize(room, 0);
        for i in 0..self.images.len() {
            let [a, b, c] = self.images[i].corners;
            let (p, q, r) = (hash(a), hash(b), hash(c));
            let ab = self.count_edge((a, b), p.wrapping_add(q));
            let bc = self.count_edge((b, c), q.wrapping_add(r));
            let ca = self.count_edge((c, a), r.wrapping_add(p));
            for (this, next) in [(ab, bc), (bc, ca), (ca, ab)] {
                if let (Some(this), Some(next)) = (this, next) {
                    self.edges[this].next = index(next + 1);
                }
            }
        }
    }

    /// Counts an image on the left of an edge; where that is, if the edge is kept the same way.
    #[allow(clippy::float_cmp, reason = "the very same corners")]
    fn count_edge(&mut self, (from, to): (Point, Point), hash: u64) -> Option<usize> {
        let mask = self.table.len() - 1;
        let mut slot = spread(hash) & mask;
        while self.table[slot] != 0 {
            let place = self.table[slot] as usize - 1;
            let Shared { edge, weight, .. } = &mut self.edges[place];
            if edge.from == from && edge.to == to {
                *weight += 1;
                return Some(place);
            }
            if edge.from == to && edge.to == from {
                *weight -= 1;
                return None;
            }
            slot = (slot + 1) & mask;
        }
        self.edges.push(Shared {
            edge: Edge::new(from, to),
            weight: 1,
            next: 0,
            side: 0,
        });
        self.table[slot] = index(self.edges.len());
        Some(self.edges.len() - 1)
    }

    /// Collects the sides that take part: of the edges where the number of images changes, those
    /// that come near the light, or all; and the light's.
    fn collect_sides(&mut self, on_light: &Bounds, extent: Extent) {
        self.sides.clear();
        self.boxes.clear();
        let room = CLOSE * self.unit;
        for shared in &mut self.edges {
            let Shared { edge, weight, .. } = shared;
            let whole = Bounds::of([edge.from, edge.to]);
            let near = whole.meets(on_light);
            shared.side = 0;
            if *weight == 0 || (!near && extent == Extent::Light) {
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
            let mut side = Side::new(edge, weight.abs(), part);
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
            self.sides.push(side);
            shared.side = index(self.sides.len());
        }
        // From edges to sides.
        for side in &mut self.sides {
            if let Some(next) = (side.next as usize).checked_sub(1) {
                let next = &self.edges[next];
                side.next = if next.weight > 0 { next.side } else { 0 };
            }
        }
        let first = self.sides.len();
        self.boxes.extend_from_slice(&self.around_boxes);
        self.sides.extend_from_slice(&self.around);
        for side in &mut self.sides[first..] {
            side.next += index(first);
        }
    }

    /// Where sides cross.
    #[inline(never)]
    fn collect_events(&mut self, on_light: &Bounds) {
        let Self {
            light,
            sides,
            boxes,
            events,
            sides_near,
            ..
        } = self;
        events.clear();
        sides_near.fill(on_light, boxes.iter().copied());
        for i in 0..sides.len() - light.len() {
            let (before, after) = sides.split_at_mut(i + 1);
            let e = &mut before[i];
            for j in sides_near.near(&boxes[i], i + 1) {
                if !boxes[i].meets(&boxes[j]) {
                    continue;
                }
                let f = &mut after[j - i - 1];
                let matters = e.part.is_some() | f.part.is_some();
                if matters && !are_neighbours((e, i), (f, j)) {
                    meet(e, f, events);
                }
            }
        }
    }

    /// Finds for each side how many images are right of where counting starts; `false` if what is
    /// on the light does not tell.
    fn count(&mut self, extent: Extent) -> bool {
        let lights = self.sides.len() - self.light.len();
        for i in (lights..self.sides.len()).chain(0..lights) {
            let side = &self.sides[i];
            if side.part.is_none() || side.count.is_some() {
                continue;
            }
            let entry = match (extent, (side.entry as usize).checked_sub(1)) {
                (Extent::Light, Some(entry)) if !side.touched[0] => self.events[entry].right,
                _ => None,
            };
            let Some(count) = entry.or_else(|| self.ask(side)) else {
                return false;
            };
            self.follow(i, count, extent);
        }
        true
    }

    /// Hands a count on from side to side.
    fn follow(&mut self, mut i: usize, mut count: i32, extent: Extent) {
        loop {
            self.sides[i].count = Some(count);
            let side = &self.sides[i];
            if extent == Extent::All {
                return;
            }
            if side.light {
                self.count_beside(i, count);
            }
            let side = &self.sides[i];
            count += side.change;
            let Some(part) = &side.part else { return };
            let Some(next) = (side.next as usize).checked_sub(1) else {
                return;
            };
            let to = &self.sides[next];
            let whole = to.part.is_some_and(|p| p.start == Start::Own)
                && part.hi.at >= side.edge.length
                && !side.touched[1]
                && !to.touched[0];
            if !whole || to.count.is_some() {
                return;
            }
            i = next;
        }
    }

    /// Counts the images right of the edges that cross a side of the light.
    fn count_beside(&mut self, i: usize, mut count: i32) {
        self.sort_own(i);
        let edge = &self.sides[i].edge;
        let room = CLOSE * self.unit * edge.extent();
        let mut before = 0.0;
        for k in 0..self.own.len() {
            let (at, event) = self.own[k];
            let after = self.own.get(k + 1).map_or(edge.length, |next| next.0);
            let event = &mut self.events[event as usize];
            let right = count.min(count + event.change);
            event.right = (at - before > room && after - at > room).then_some(right);
            count += event.change;
            before = at;
        }
    }

    /// Puts the events of a side in order.
    #[inline]
    fn sort_own(&mut self, i: usize) {
        self.own.clear();
        let first = self.sides[i].events;
        if first > 0 {
            self.sort_from(first);
        }
    }

    #[inline(never)]
    fn sort_from(&mut self, mut next: u32) {
        while let Some(place) = next.checked_sub(1) {
            let event = &self.events[place as usize];
            let this = (event.end.at, place);
            let mut k = self.own.len();
            self.own.push(this);
            while k > 0 && self.own[k - 1].0 > this.0 {
                self.own[k] = self.own[k - 1];
                k -= 1;
            }
            self.own[k] = this;
            next = event.before;
        }
    }

    /// Counts the images just right of where counting starts on a side by asking all that are
    /// near; `None` if rounding may decide.
    #[inline(never)]
    fn ask(&self, side: &Side) -> Option<i32> {
        let part = side.part.as_ref()?;
        let cut = side.counted >= 0.0;
        let (start, room) = if cut {
            (part.lo.point, CLOSE * self.unit)
        } else {
            (side.edge.from, 0.0)
        };
        if cut && matches!(part.start, Start::Cut(slack) if slack > 0.2 * room) {
            return None;
        }
        let around = Bounds::of([start]).wider(room);
        let mut count = 0;
        for i in self.images_near.near(&around, 0) {
            let image = &self.images[i];
            if image.bounds.meets(&around) {
                count += i32::from(if cut {
                    image.holds_on(start, &side.edge, room)?
                } else {
                    image.holds_start(&side.edge)
                });
            }
        }
        Some(count)
    }

    /// The parts of sides with no image right of them.
    fn collect_pieces(&mut self) {
        for i in 0..self.sides.len() {
            let Side { part, count, .. } = self.sides[i];
            let (Some(part), Some(mut count)) = (part, count) else {
                continue;
            };
            self.sort_own(i);
            let mut reached = part.lo;
            let events = self.own.iter().map(|e| &self.events[e.1 as usize]);
            let changes = events.map(|e| (e.end, e.change));
            for (hi, change) in changes.chain([(part.hi, 0)]) {
                if hi.at > reached.at {
                    if count == 0 {
                        // Backwards: what is visible is right of the edge.
                        self.pieces.push(BoundaryEdge {
                            from: hi.point,
                            to: reached.point,
                        });
                    }
                    reached = hi;
                }
                count += change;
            }
        }
    }
}

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Extent {
    /// What is on the light. Where the first point of an edge's part is too close to the sides of
    /// images, this cannot tell on which side.
    Light,
    /// All of every edge: decisions are exact.
    All,
}

impl Side {
    fn new(edge: Edge, weight: i32, part: Option<Span>) -> Self {
        Self {
            edge,
            weight,
            light: false,
            part,
            close: 0.0,
            count: None,
            change: 0,
            counted: f64::NEG_INFINITY,
            events: 0,
            next: 0,
            touched: [false; 2],
            entry: 0,
        }
    }

    /// Adds an event if it is where that matters.
    #[inline(never)]
    fn add(&mut self, change: i32, end: End, events: &mut Vec<Event>) {
        let Some(part) = &self.part else { return };
        if end.at <= self.counted + self.close {
            self.touched[0] |= end.at >= self.counted - self.close;
            if end.at <= self.counted {
                return;
            }
        }
        self.change += change;
        if end.at < part.hi.at {
            events.push(Event {
                change,
                end,
                before: self.events,
                right: None,
            });
            self.events = index(events.len());
        }
    }
}

/// Whether two sides at places i and j are neighbours around an image, or the light: these only
/// meet where it turns.
#[inline]
fn are_neighbours((e, i): (&Side, usize), (f, j): (&Side, usize)) -> bool {
    (e.next as usize == j + 1) | (f.next as usize == i + 1)
}

/// What two sides, of which the first comes first, are to each other's counts.
#[inline(never)]
fn meet(e: &mut Side, f: &mut Side, events: &mut Vec<Event>) {
    match e.edge.meet(&f.edge) {
        Meeting::Apart => {}
        // On one line, the same side: the first has what both share.
        Meeting::Aligned => {
            (e.touched, f.touched) = ([true; 2], [true; 2]);
            if let Some(span) = f.edge.shared(&e.edge)
                && !f.light
            {
                f.add(1, span.lo, events);
                f.add(-1, span.hi, events);
            }
        }
        Meeting::Crossing(crossing) => {
            if crossing.touching {
                (e.touched, f.touched) = ([true; 2], [true; 2]);
            }
            let mut pass = |side: &mut Side, left: Option<bool>, weight: i32| {
                let Some(left) = left else { return };
                if weight != 0 && side.part.is_some() {
                    let change = if left { weight } else { -weight };
                    side.add(change, side.edge.end_at(crossing.point), events);
                }
            };
            let weights = [f.weight, e.weight];
            pass(e, crossing.first, weights[0]);
            let before = f.events;
            pass(f, crossing.second, weights[1]);
            // The light is right of its sides.
            if f.light && crossing.first == Some(false) && f.events != before {
                e.entry = f.events;
            }
        }
    }
}

impl Image {
    /// `None` if it has no area: then it hides nothing.
    fn new(corners: [Point; 3]) -> Option<Self> {
        let [a, b, c] = [
            settled(corners[0]),
            settled(corners[1]),
            settled(corners[2]),
        ];
        let turn = orient(a, b, c);
        let corners = if turn > 0.0 { [a, b, c] } else { [a, c, b] };
        let bounds = Bounds::of(corners);
        (turn != 0.0).then_some(Self { corners, bounds })
    }

    fn sides(&self) -> [(Point, Point); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }

    /// Whether a rounded point of an edge, moved to the edge's right, is inside; `None` if it is
    /// too close to tell.
    #[allow(clippy::float_cmp, reason = "the very same edge")]
    fn holds_on(&self, point: Point, edge: &Edge, room: f64) -> Option<bool> {
        let mut close = false;
        for (c, d) in self.sides() {
            let (height, room) = (height(c, d, point), room * length(c, d));
            if height < -room || (c == edge.from && d == edge.to) {
                return Some(false);
            }
            let own = c == edge.to && d == edge.from;
            close |= height <= room && !own;
        }
        (!close).then_some(true)
    }

    /// Whether the start of an edge, moved along it and then, by much less, to its right, is
    /// inside.
    #[inline(never)]
    fn holds_start(&self, edge: &Edge) -> bool {
        self.sides().into_iter().all(|(c, d)| {
            let side = orient(c, d, edge.from);
            if side != 0.0 {
                return side > 0.0;
            }
            let along = orient(c, d, edge.to);
            if along != 0.0 {
                return along > 0.0;
            }
            // On one line: right of the edge is left of a side that runs against it.
            (d[0] - c[0]) * (edge.to[0] - edge.from[0])
                + (d[1] - c[1]) * (edge.to[1] - edge.from[1])
                < 0.0
        })
    }
}

/// How far left of the way from c to d a point is, times the length of the way; rounded.
fn height(c: Point, d: Point, p: Point) -> f64 {
    (d[0] - c[0]) * (p[1] - c[1]) - (d[1] - c[1]) * (p[0] - c[0])
}

/// The length of the way from c to d along the axes.
fn length(c: Point, d: Point) -> f64 {
    (d[0] - c[0]).abs() + (d[1] - c[1]).abs()
}

/// Without −0, which is another number to a hash, and without what would underflow in a product;
/// moves a point by 1e-60 of the light's size.
fn settled(p: Point) -> Point {
    let flush = |x: f64| if x.abs() < 1e-60 { 0.0 } else { x };
    [flush(p[0]), flush(p[1])]
}

/// Of a corner; the sum over the ends is the same for both directions of an edge.
fn hash(p: Point) -> u64 {
    let bits = p[0].to_bits() ^ p[1].to_bits().rotate_left(23);
    bits.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

fn spread(sum: u64) -> usize {
    #[allow(clippy::cast_possible_truncation, reason = "the high bits of a hash")]
    {
        (sum.wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 32) as usize
    }
}

/// A place in a list that holds fewer than 2³² items.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
