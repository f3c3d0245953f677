//! Edges that take part, and where they meet.

use super::CLOSE;
use super::index::Index;
use super::layer_counts::LayerCount;
use super::layers::Layers;
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
    /// The last of its events, which leads to the others ([`Event::before`]).
    pub(super) events: Option<Index>,
    /// The side after it around an image: where it ends and that one starts, no image comes or
    /// goes, but where they are touched.
    pub(super) next: Option<Index>,
    /// Whether anything else goes through its first or last point, or so close to where it is cut
    /// that rounding may decide.
    pub(super) touched: [bool; 2],
    /// The event of a side of the light at which this side enters the light.
    pub(super) entry: Option<Index>,
    /// The index of the side in the list.
    pub(super) place: Index,
    /// Whether its count is to be handed on.
    pub(super) is_handed: bool,
    /// Whether it crosses another at so small an angle that rounding moves where.
    pub(super) is_loose: bool,
    /// The number of surfaces' sides that overlap with this one where counting starts.
    pub(super) shared: i32,
    /// The layers of surfaces right of where its part begins, and right of where it ends; none
    /// where an image is over it.
    pub(super) layers_at_start: Option<LayerCount>,
    pub(super) layers_at_end: Option<LayerCount>,
}

/// A place on a side where what is over its right changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) change: Layers,
    pub(super) end: End,
    /// Whether the side comes to the left of the one that it crosses.
    pub(super) to_left: bool,
    /// The layers of surfaces in the sector that is right of both sides here, as counted along this
    /// one; none if rounding may decide, or images are over it.
    pub(super) layers: Option<LayerCount>,
    /// The event of the same side that was found before.
    pub(super) before: Option<Index>,
    /// The number of images to the right of the edge that enters or leaves here, on a side of the
    /// light; none if another is too close.
    pub(super) right: Option<i32>,
    /// The side that it is on, and the event of the side that crosses it here, if neither only
    /// touches the other.
    pub(super) side: Index,
    pub(super) twin: Option<Index>,
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
            events: None,
            next: None,
            touched: [false; 2],
            entry: None,
            place: Index::new(0),
            is_handed: false,
            is_loose: false,
            shared: 0,
            layers_at_start: None,
            layers_at_end: None,
        }
    }

    /// Whether what is right of its end is right of where the side after it begins.
    pub(super) fn goes_on_in(&self, next: &Self) -> bool {
        self.part.is_some_and(|p| p.hi.at >= self.edge.length)
            && next.part.is_some_and(|p| p.start == Start::Own)
            && !self.touched[1]
            && !next.touched[0]
    }

    /// Adds an event, which it returns, if it is where that matters.
    #[inline(never)]
    pub(super) fn add(
        &mut self,
        change: Layers,
        to_left: bool,
        end: End,
        events: &mut Vec<Event>,
    ) -> Option<Index> {
        let part = self.part.as_ref()?;
        // Leave out what is before counting starts.
        if end.at <= self.counted + self.close {
            self.touched[0] |= end.at >= self.counted - self.close;
            if end.at <= self.counted {
                return None;
            }
        }
        // Count the change, and keep an event unless it is beyond the end.
        self.change += change;
        (end.at < part.hi.at).then(|| {
            let event = Index::new(events.len());
            events.push(Event {
                change,
                end,
                to_left,
                layers: None,
                before: self.events,
                right: None,
                side: self.place,
                twin: None,
            });
            self.events = Some(event);
            event
        })
    }
}

/// Whether two sides at places i and j are neighbours around an image, or the light: these only
/// meet where it turns.
#[inline]
pub(super) fn are_neighbours(e: &Side, i: usize, f: &Side, j: usize) -> bool {
    Index::is(e.next, j) | Index::is(f.next, i)
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
                let left = left?;
                if weight == Layers::default() || side.part.is_none() {
                    return None;
                }
                let change = if left { weight } else { -weight };
                side.add(change, left, side.edge.end_at(crossing.point), events)
            };
            let weights = [f.weight, e.weight];
            let here = pass(e, crossing.first, weights[0]);
            let there = pass(f, crossing.second, weights[1]);
            if let (Some(i), Some(j), false) = (here, there, crossing.touching) {
                events[i.get()].twin = there;
                events[j.get()].twin = here;
            }
            if here.is_some() || there.is_some() {
                let loose = e.edge.crosses_loosely(&f.edge, 0.2 * CLOSE * unit);
                e.is_loose |= loose;
                f.is_loose |= loose;
            }
            // The light is right of its sides.
            if f.light && crossing.first == Some(false) && there.is_some() {
                e.entry = there;
            }
        }
    }
}
