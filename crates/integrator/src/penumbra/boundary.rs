//! The boundary of what is visible.

use super::bins::{Bins, Bounds};
use super::clip::{Edge, End, Meeting, Span, Start};
use super::orient::{Point, orient};

/// A piece of the boundary of the visible part of a light: what is visible lies on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub from: Point,
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
}

/// An edge of images or of the light that takes part.
#[derive(Clone, Copy, Debug)]
struct Side {
    edge: Edge,
    /// Of what may matter of it.
    bounds: Bounds,
    /// Images on its left less images on its right.
    weight: i32,
    /// Whether it is the light's, backwards: the light is on its right.
    light: bool,
    /// The part of it that is on the light.
    part: Option<Span>,
    /// Images just right of it where counting starts.
    count: i32,
    /// Where counting starts: what comes before, or there, has been counted.
    counted: f64,
    /// The last of its events, plus one.
    events: u32,
}

/// A place on a side where the number of images just right of it changes.
#[derive(Clone, Copy, Debug)]
struct Event {
    change: i32,
    end: End,
    /// The event of the same side that was found before, plus one.
    before: u32,
}

/// How close to a side of a triangle a rounded point may be, in units of the light, before nothing
/// is concluded from where it is.
const CLOSE: f64 = 1e-9;

/// Finds boundaries; keeps its buffers.
#[derive(Debug, Default)]
pub(crate) struct Penumbra {
    light: Vec<Point>,
    /// The light's largest coordinate.
    unit: f64,
    images: Vec<Image>,
    edges: Vec<Shared>,
    /// Which of `edges` has which ends: places in it plus one, by a hash of the ends.
    table: Vec<u32>,
    sides: Vec<Side>,
    images_near: Bins,
    sides_near: Bins,
    events: Vec<Event>,
    /// The events of one side, in ascending order.
    own: Vec<Event>,
    pieces: Vec<Piece>,
}

impl Penumbra {
    /// The boundary of a convex light, either way round, minus triangles, either way round.
    ///
    /// Pieces come in no particular order; together they are closed curves around the visible
    /// part, but for ends that are rounded.
    pub(crate) fn boundary(
        &mut self,
        light: &[Point],
        triangles: impl Iterator<Item = [Point; 3]>,
    ) -> &[Piece] {
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
        if !self.count_on(&on_light, Extent::Light) {
            self.count_on(&on_light, Extent::All);
        }
        self.collect_events(&on_light);
        self.collect_pieces();
        &self.pieces
    }

    fn set_light(&mut self, light: &[Point]) {
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
    }

    /// The edges where the number of images changes, each once.
    fn collect_edges(&mut self) {
        self.edges.clear();
        self.table.clear();
        let room = (6 * self.images.len()).next_power_of_two();
        self.table.resize(room, 0);
        for i in 0..self.images.len() {
            let [a, b, c] = self.images[i].corners;
            let [p, q, r] = [a, b, c].map(hash);
            self.count_edge((a, b), p.wrapping_add(q));
            self.count_edge((b, c), q.wrapping_add(r));
            self.count_edge((c, a), r.wrapping_add(p));
        }
        self.edges.retain(|edge| edge.weight != 0);
    }

    /// Counts an image on the left of an edge.
    #[allow(clippy::float_cmp, reason = "the very same corners")]
    fn count_edge(&mut self, (from, to): (Point, Point), hash: u64) {
        let mask = self.table.len() - 1;
        let mut slot = spread(hash) & mask;
        while self.table[slot] != 0 {
            let Shared { edge, weight } = &mut self.edges[self.table[slot] as usize - 1];
            if edge.from == from && edge.to == to {
                *weight += 1;
                return;
            }
            if edge.from == to && edge.to == from {
                *weight -= 1;
                return;
            }
            slot = (slot + 1) & mask;
        }
        self.edges.push(Shared {
            edge: Edge::new(from, to),
            weight: 1,
        });
        self.table[slot] = index(self.edges.len());
    }

    /// Collects the sides that take part and counts the images right of each where counting
    /// starts; `false` if what is on the light does not tell.
    fn count_on(&mut self, on_light: &Bounds, extent: Extent) -> bool {
        self.sides.clear();
        let room = CLOSE * self.unit;
        for Shared { edge, weight } in &self.edges {
            let whole = Bounds::of([edge.from, edge.to]);
            let near = whole.meets(on_light);
            if !near && extent == Extent::Light {
                continue;
            }
            let edge = if *weight < 0 { edge.reversed() } else { *edge };
            // What lies along an edge of the light is left to the light.
            let part = if near { edge.within(&self.light) } else { None };
            let bounds = match &part {
                Some(part) if extent == Extent::Light => {
                    Bounds::of([part.lo.point, part.hi.point]).wider(room)
                }
                _ => whole,
            };
            self.sides
                .push(Side::new(edge, bounds, weight.abs(), false, part));
        }
        for i in 0..self.light.len() {
            let (from, to) = (self.light[(i + 1) % self.light.len()], self.light[i]);
            let edge = Edge::new(from, to);
            let bounds = Bounds::of([from, to]).wider(room);
            let whole = Some(edge.whole());
            self.sides.push(Side::new(edge, bounds, 0, true, whole));
        }
        let Self {
            sides,
            images,
            images_near,
            ..
        } = self;
        let crowd = Crowd {
            images,
            near: images_near,
            room,
        };
        sides.iter_mut().all(|side| crowd.count(side, extent))
    }

    /// Where sides cross.
    fn collect_events(&mut self, on_light: &Bounds) {
        let Self {
            sides,
            events,
            sides_near,
            ..
        } = self;
        events.clear();
        sides_near.fill(on_light, sides.iter().map(|s| s.bounds));
        for i in 0..sides.len() {
            let (before, after) = sides.split_at_mut(i + 1);
            let e = &mut before[i];
            for j in sides_near.near(&e.bounds).from(i + 1) {
                let f = &mut after[j - i - 1];
                if e.bounds.meets(&f.bounds) && (e.part.is_some() || f.part.is_some()) {
                    meet(e, f, events);
                }
            }
        }
    }

    /// The parts of sides with no image right of them.
    fn collect_pieces(&mut self) {
        for side in &self.sides {
            let Some(part) = side.part else { continue };
            self.own.clear();
            let mut next = side.events;
            while next != 0 {
                let event = self.events[next as usize - 1];
                next = event.before;
                let place = self.own.iter().rposition(|e| e.end.at <= event.end.at);
                self.own.insert(place.map_or(0, |i| i + 1), event);
            }
            let mut count = side.count;
            let mut reached = part.lo;
            let last = Event {
                change: 0,
                end: part.hi,
                before: 0,
            };
            for event in self.own.iter().chain([&last]) {
                let hi = event.end;
                if hi.at > reached.at {
                    if count == 0 {
                        // Backwards: what is visible is right of the edge.
                        self.pieces.push(Piece {
                            from: hi.point,
                            to: reached.point,
                        });
                    }
                    reached = hi;
                }
                count += event.change;
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
    fn new(edge: Edge, bounds: Bounds, weight: i32, light: bool, part: Option<Span>) -> Self {
        Self {
            edge,
            bounds,
            weight,
            light,
            part,
            count: 0,
            counted: f64::NEG_INFINITY,
            events: 0,
        }
    }

    /// Adds an event if it is where that matters.
    fn add(&mut self, change: i32, end: End, events: &mut Vec<Event>) {
        let Some(part) = &self.part else { return };
        if end.at <= self.counted || end.at >= part.hi.at {
            return;
        }
        events.push(Event {
            change,
            end,
            before: self.events,
        });
        self.events = index(events.len());
    }
}

/// What two sides, of which the first comes first, are to each other's counts.
fn meet(e: &mut Side, f: &mut Side, events: &mut Vec<Event>) {
    match e.edge.meet(&f.edge) {
        Meeting::Apart => {}
        // On one line, the same side: the first has what both share.
        Meeting::Aligned => {
            if let Some(span) = f.edge.shared(&e.edge)
                && !f.light
            {
                f.add(1, span.lo, events);
                f.add(-1, span.hi, events);
            }
        }
        Meeting::Crossing(crossing) => {
            let mut pass = |side: &mut Side, left: Option<bool>, weight: i32| {
                if let Some(left) = left
                    && weight != 0
                    && side.part.is_some()
                {
                    let change = if left { weight } else { -weight };
                    side.add(change, side.edge.end_at(crossing.point), events);
                }
            };
            let weights = [f.weight, e.weight];
            pass(e, crossing.first, weights[0]);
            pass(f, crossing.second, weights[1]);
        }
    }
}

/// All images, to be asked which of them are at a place.
struct Crowd<'a> {
    images: &'a [Image],
    near: &'a Bins,
    /// What is closer is not decided.
    room: f64,
}

impl Crowd<'_> {
    /// Counts the images just right of where counting starts on a side. Forgets the part of a side
    /// that is well inside of one image. `false` if rounding may decide.
    fn count(&self, side: &mut Side, extent: Extent) -> bool {
        let Some(part) = side.part else { return true };
        let (start, cut) = match part.start {
            Start::Cut(slack) if extent == Extent::Light => {
                if slack > 0.2 * self.room {
                    return false;
                }
                side.counted = part.lo.at;
                (part.lo.point, true)
            }
            _ => (side.edge.from, false),
        };
        let around = Bounds::of([start]).wider(if cut { self.room } else { 0.0 });
        for i in self.near.near(&around).from(0) {
            let image = &self.images[i];
            if !image.bounds.meets(&around) {
                continue;
            }
            let holds = if cut {
                let Some(holds) = image.holds_on(start, &side.edge, self.room) else {
                    return false;
                };
                holds
            } else {
                image.holds_start(&side.edge)
            };
            if holds {
                side.count += 1;
                if image.holds_well([part.lo.point, part.hi.point], self.room) {
                    side.part = None;
                    return true;
                }
            }
        }
        true
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

    /// Whether two points are inside, by more than `room`.
    fn holds_well(&self, points: [Point; 2], room: f64) -> bool {
        let well = |(c, d)| {
            points
                .iter()
                .all(|p| height(c, d, *p) > room * length(c, d))
        };
        self.sides().into_iter().all(well)
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
