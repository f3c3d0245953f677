//! The boundary of what is visible.

use super::clip::{Edge, End, Meeting, Span};
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

/// An edge of images or of the light.
#[derive(Clone, Copy, Debug)]
struct Side {
    edge: Edge,
    bounds: Bounds,
    /// Images on its left less images on its right.
    weight: i32,
    /// Whether it is the light's, backwards: the light is on its right.
    light: bool,
    /// The part of it that is on the light.
    part: Option<Span>,
}

/// A place on a side where the number of images just right of it changes.
#[derive(Clone, Copy, Debug)]
struct Event {
    side: u32,
    change: i32,
    end: End,
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Point,
    high: Point,
}

/// Finds boundaries; keeps its buffers.
#[derive(Debug, Default)]
pub(crate) struct Penumbra {
    light: Vec<Point>,
    images: Vec<Image>,
    sides: Vec<Side>,
    /// Which side has which ends: places in `sides` plus one, by a hash of the ends.
    table: Vec<u32>,
    events: Vec<Event>,
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
        let bounds = Bounds::of(&self.light);
        self.images.clear();
        let images = triangles.filter_map(Image::new);
        self.images
            .extend(images.filter(|i| i.bounds.meets(&bounds)));
        self.collect_sides(&bounds);
        self.drop_hidden_parts();
        self.collect_events();
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
    }

    /// The edges where the number of images changes, each once, and the light's.
    fn collect_sides(&mut self, on_light: &Bounds) {
        self.sides.clear();
        self.table.clear();
        let room = (6 * self.images.len()).next_power_of_two();
        self.table.resize(room, 0);
        for i in 0..self.images.len() {
            let [a, b, c] = self.images[i].corners;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                self.count_side(Edge { from, to });
            }
        }
        self.sides.retain(|side| side.weight != 0);
        for side in &mut self.sides {
            if side.weight < 0 {
                (side.edge.from, side.edge.to) = (side.edge.to, side.edge.from);
                side.weight = -side.weight;
            }
            if side.bounds.meets(on_light) {
                // What lies along an edge of the light is left to the light.
                side.part = side.edge.within(&self.light);
            }
        }
        for i in 0..self.light.len() {
            let (from, to) = (self.light[(i + 1) % self.light.len()], self.light[i]);
            let edge = Edge { from, to };
            self.sides.push(Side {
                edge,
                bounds: Bounds::of(&[from, to]),
                weight: 0,
                light: true,
                part: Some(edge.whole()),
            });
        }
    }

    /// Counts an image on the left of an edge.
    #[allow(clippy::float_cmp, reason = "the very same corners")]
    fn count_side(&mut self, edge: Edge) {
        let mask = self.table.len() - 1;
        let mut slot = hash(&edge) & mask;
        while self.table[slot] != 0 {
            let side = &mut self.sides[self.table[slot] as usize - 1];
            if side.edge.from == edge.from && side.edge.to == edge.to {
                side.weight += 1;
                return;
            }
            if side.edge.from == edge.to && side.edge.to == edge.from {
                side.weight -= 1;
                return;
            }
            slot = (slot + 1) & mask;
        }
        self.sides.push(Side {
            edge,
            bounds: Bounds::of(&[edge.from, edge.to]),
            weight: 1,
            light: false,
            part: None,
        });
        self.table[slot] = index(self.sides.len());
    }

    /// Forgets parts of sides that are well inside of one image.
    fn drop_hidden_parts(&mut self) {
        for side in &mut self.sides {
            if let Some(part) = &side.part {
                let ends = [part.lo.point, part.hi.point];
                let bounds = Bounds::of(&ends);
                let hides = |image: &Image| image.bounds.holds(&bounds) && image.holds_well(&ends);
                if self.images.iter().any(hides) {
                    side.part = None;
                }
            }
        }
    }

    /// Where sides cross.
    fn collect_events(&mut self) {
        let Self { sides, events, .. } = self;
        events.clear();
        sides.sort_unstable_by(|a, b| a.bounds.low[0].total_cmp(&b.bounds.low[0]));
        for (i, e) in sides.iter().enumerate() {
            let beyond = |f: &&Side| f.bounds.low[0] <= e.bounds.high[0];
            for (j, f) in (i + 1..).zip(sides[i + 1..].iter().take_while(beyond)) {
                if !e.bounds.meets(&f.bounds) || (e.part.is_none() && f.part.is_none()) {
                    continue;
                }
                let (i, j) = (index(i), index(j));
                match e.edge.meet(&f.edge) {
                    Meeting::Apart => {}
                    // On one line, the same side: the first has what both share.
                    Meeting::Aligned if !f.light && f.part.is_some() => {
                        if let Some(span) = f.edge.shared(&e.edge) {
                            let event = |change, end| Event {
                                side: j,
                                change,
                                end,
                            };
                            events.extend([event(1, span.lo), event(-1, span.hi)]);
                        }
                    }
                    Meeting::Aligned => {}
                    Meeting::Crossing(crossing) => {
                        let mut pass = |side, edge: &Edge, left: Option<bool>, weight: i32| {
                            if let Some(left) = left {
                                events.push(Event {
                                    side,
                                    change: if left { weight } else { -weight },
                                    end: edge.end_at(crossing.point),
                                });
                            }
                        };
                        if e.part.is_some() && f.weight != 0 {
                            pass(i, &e.edge, crossing.first, f.weight);
                        }
                        if f.part.is_some() && e.weight != 0 {
                            pass(j, &f.edge, crossing.second, e.weight);
                        }
                    }
                }
            }
        }
        events.sort_unstable_by(|a, b| {
            let by_side = a.side.cmp(&b.side);
            by_side.then(a.end.at.total_cmp(&b.end.at))
        });
    }

    /// The parts of sides with no image right of them.
    fn collect_pieces(&mut self) {
        let mut events = &self.events[..];
        for (i, side) in self.sides.iter().enumerate() {
            let own = events.iter().take_while(|e| e.side == index(i)).count();
            let (mine, rest) = events.split_at(own);
            events = rest;
            let Some(part) = side.part else { continue };
            let whole = side.edge.whole();
            let mut count: i32 = self
                .images
                .iter()
                .map(|image| i32::from(image.holds_start(&side.edge)))
                .sum();
            let mut reached = whole.lo;
            let last = Event {
                side: 0,
                change: 0,
                end: whole.hi,
            };
            for event in mine.iter().chain([&last]) {
                if count == 0 {
                    let lo = if reached.at > part.lo.at {
                        reached
                    } else {
                        part.lo
                    };
                    let hi = if event.end.at < part.hi.at {
                        event.end
                    } else {
                        part.hi
                    };
                    if lo.at < hi.at {
                        // Backwards: what is visible is right of the edge.
                        self.pieces.push(Piece {
                            from: hi.point,
                            to: lo.point,
                        });
                    }
                }
                count += event.change;
                reached = event.end;
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
        let bounds = Bounds::of(&corners);
        (turn != 0.0).then_some(Self { corners, bounds })
    }

    /// Whether two points are inside, by more than rounding.
    fn holds_well(&self, points: &[Point; 2]) -> bool {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)].into_iter().all(|(c, d)| {
            let run = [d[0] - c[0], d[1] - c[1]];
            let room = 1e-9 * (run[0].abs() + run[1].abs());
            let height = |p: &Point| run[0] * (p[1] - c[1]) - run[1] * (p[0] - c[0]);
            points.iter().all(|p| height(p) > room)
        })
    }

    /// Whether the start of an edge, moved along it and then, by much less, to its right, is
    /// inside.
    fn holds_start(&self, edge: &Edge) -> bool {
        let Bounds { low, high } = self.bounds;
        let [x, y] = edge.from;
        if !(low[0] <= x && x <= high[0] && low[1] <= y && y <= high[1]) {
            return false;
        }
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)].into_iter().all(|(c, d)| {
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

impl Bounds {
    fn of(points: &[Point]) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in points {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        Self { low, high }
    }

    fn holds(&self, other: &Self) -> bool {
        (self.low[0] <= other.low[0] && other.high[0] <= self.high[0])
            && (self.low[1] <= other.low[1] && other.high[1] <= self.high[1])
    }

    fn meets(&self, other: &Self) -> bool {
        (self.low[0] <= other.high[0] && other.low[0] <= self.high[0])
            && (self.low[1] <= other.high[1] && other.low[1] <= self.high[1])
    }
}

/// Without −0, which is another number to a hash, and without what would underflow in a product;
/// moves a point by 1e-60 of the light's size.
fn settled(p: Point) -> Point {
    let flush = |x: f64| if x.abs() < 1e-60 { 0.0 } else { x };
    [flush(p[0]), flush(p[1])]
}

/// The same for both directions of an edge.
fn hash(edge: &Edge) -> usize {
    let mix = |p: Point| {
        let bits = p[0].to_bits() ^ p[1].to_bits().rotate_left(23);
        bits.wrapping_mul(0x9E37_79B9_7F4A_7C15)
    };
    let sum = mix(edge.from).wrapping_add(mix(edge.to));
    #[allow(clippy::cast_possible_truncation, reason = "the high bits of a hash")]
    {
        (sum.wrapping_mul(0xD6E8_FEB8_6659_FD93) >> 32) as usize
    }
}

/// A place in a list that holds fewer than 2³² items.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
