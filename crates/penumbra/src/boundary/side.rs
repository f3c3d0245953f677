//! Edges that take part, and where they meet.

use super::{CLOSE, index, layers::Layers};
use crate::clip::{Edge, End, Meeting, Span, Start};

/// An edge of images or of the light that takes part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) edge: Edge,
    /// The layers over its left side less those over its right side.
    pub(super) weight: Layers,
    /// Whether it is the light's, backwards: the light is on its right.
    pub(super) light: bool,
    /// The part of it that is on the light.
    pub(super) part: Option<Span>,
    /// Images just right of it where counting starts, once that is known.
    pub(super) count: Option<i32>,
    /// The sum of the changes of `weight` at all events.
    pub(super) change: Layers,
    /// The parameter at which counting starts: events up to it have been counted.
    pub(super) counted: f64,
    /// The distance from `counted` within which rounding may decide.
    pub(super) close: f64,
    /// The last of its events, plus one.
    pub(super) events: u32,
    /// The side after it around an image, plus one: where it ends and that one starts, no image
    /// comes or goes, but where they are touched.
    pub(super) next: u32,
    /// Whether anything else goes through its first or last point, or so close to where it is cut
    /// that rounding may decide.
    pub(super) touched: [bool; 2],
    /// The event, plus one, of a side of the light at which this side enters the light.
    pub(super) entry: u32,
    /// The index of the side in the list.
    pub(super) place: u32,
    /// Whether its count is to be handed on.
    pub(super) is_handed: bool,
    /// Whether it crosses another at so small an angle that rounding moves where.
    pub(super) is_loose: bool,
    /// The number of surfaces' sides that overlap with this one where counting starts.
    pub(super) shared: i32,
    /// The gap between images right of where its part begins, and that where it ends, plus one;
    /// zero if there is an image over it.
    pub(super) first_gap: u32,
    pub(super) last_gap: u32,
    /// The difference of layers over its end from those over the beginning of the last gap.
    pub(super) last_layers: i32,
}

/// A place on a side where what is over its right changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) change: Layers,
    pub(super) end: End,
    /// Whether the side comes to the left of the one that it crosses.
    pub(super) to_left: bool,
    /// The gap that is right of both sides here, plus one, and how many layers more there are than
    /// over its beginning; none if rounding may decide, or images are over it.
    pub(super) gap: u32,
    pub(super) layers: i32,
    /// The event of the same side that was found before, plus one.
    pub(super) before: u32,
    /// The number of images to the right of the edge that enters or leaves here, on a side of the
    /// light; none if another is too close.
    pub(super) right: Option<i32>,
    /// The side that it is on, and the event of the side that crosses it here, plus one, if neither
    /// only touches the other.
    pub(super) side: u32,
    pub(super) twin: u32,
}

/// The part of the plane under consideration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// The light alone. Where the first point of an edge's part is too close to the sides of
    /// images, this cannot decide on which side it lies.
    Light,
    /// The whole plane, with all of every edge: decisions are exact.
    All,
}

impl Side {
    pub(super) fn new(edge: Edge, weight: Layers, part: Option<Span>) -> Self {
        Self {
            edge,
            weight,
            light: false,
            part,
            close: 0.0,
            count: None,
            change: Layers::default(),
            counted: f64::NEG_INFINITY,
            events: 0,
            next: 0,
            touched: [false; 2],
            entry: 0,
            place: 0,
            is_handed: false,
            is_loose: false,
            shared: 0,
            first_gap: 0,
            last_gap: 0,
            last_layers: 0,
        }
    }

    /// Whether what is right of its end is right of where the side after it begins.
    pub(super) fn goes_on_in(&self, next: &Self) -> bool {
        self.part.is_some_and(|p| p.hi.at >= self.edge.length)
            && next.part.is_some_and(|p| p.start == Start::Own)
            && !self.touched[1]
            && !next.touched[0]
    }

    /// Adds an event if it is where that matters.
    #[inline(never)]
    pub(super) fn add(&mut self, change: Layers, to_left: bool, end: End, events: &mut Vec<Event>) {
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
                to_left,
                gap: 0,
                layers: 0,
                before: self.events,
                right: None,
                side: self.place,
                twin: 0,
            });
            self.events = index(events.len());
        }
    }
}

/// Whether two sides at places i and j are neighbours around an image, or the light: these only
/// meet where it turns.
#[inline]
pub(super) fn are_neighbours(e: &Side, i: usize, f: &Side, j: usize) -> bool {
    (e.next as usize == j + 1) | (f.next as usize == i + 1)
}

/// Records what two sides, of which the first comes first, add to each other's counts.
#[allow(clippy::float_cmp, reason = "the very same corners")]
#[inline(never)]
pub(super) fn meet(e: &mut Side, f: &mut Side, unit: f64, events: &mut Vec<Event>) {
    match e.edge.meet(&f.edge) {
        Meeting::Apart => {}
        // On one line, the same side: the first has what both share.
        Meeting::Aligned => {
            (e.touched, f.touched) = ([true; 2], [true; 2]);
            if let Some(span) = f.edge.shared(&e.edge)
                && !f.light
            {
                // Nothing of it is a boundary there, as if another image were over it: one that
                // nobody finds who asks where counting starts, if it is a surface's, or has the
                // very same edge.
                let begins_before = span.lo.at <= f.counted && f.counted < span.hi.at;
                let is_same = e.edge.from == f.edge.from && e.edge.to == f.edge.to;
                f.shared += i32::from(begins_before && (is_same || e.weight.images == 0));
                f.add(Layers::of_images(1), true, span.lo, events);
                f.add(Layers::of_images(-1), false, span.hi, events);
            }
        }
        Meeting::Crossing(crossing) => {
            if crossing.touching {
                (e.touched, f.touched) = ([true; 2], [true; 2]);
            }
            let mut pass = |side: &mut Side, left: Option<bool>, weight: Layers| {
                let Some(left) = left else { return };
                if weight != Layers::default() && side.part.is_some() {
                    let change = if left { weight } else { -weight };
                    side.add(change, left, side.edge.end_at(crossing.point), events);
                }
            };
            let weights = [f.weight, e.weight];
            let before = [e.events, f.events];
            pass(e, crossing.first, weights[0]);
            pass(f, crossing.second, weights[1]);
            let (here, there) = (e.events, f.events);
            if here != before[0] && there != before[1] && !crossing.touching {
                events[here as usize - 1].twin = there;
                events[there as usize - 1].twin = here;
            }
            if here != before[0] || there != before[1] {
                let loose = e.edge.crosses_loosely(&f.edge, 0.2 * CLOSE * unit);
                e.is_loose |= loose;
                f.is_loose |= loose;
            }
            // The light is right of its sides.
            if f.light && crossing.first == Some(false) && there != before[1] {
                e.entry = there;
            }
        }
    }
}
