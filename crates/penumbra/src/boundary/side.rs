//! [`Side`]s: edges that take part in the search for the boundary, and the events where they cross
//! each other.

use super::CLOSE;
use super::index::Index;
use super::layer_counts::LayerCount;
use super::layers::Layers;
use crate::clip::{Edge, End, Meeting, Span, Start};

/// An edge of images, of silhouettes or of the light that takes part in the search for the
/// boundary.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) edge: Edge,
    /// The number of layers over its left side, minus the number over its right side.
    pub(super) weight: Layers,
    /// Whether it is a side of the light, reversed so that the light is on its right.
    pub(super) light: bool,
    /// The part of the side that is on the light; `None` if no part is.
    pub(super) part: Option<Span>,
    /// The number of images just right of where counting starts, once it is known.
    pub(super) count: Option<i32>,
    /// The sum of the changes of the number of layers at all events of the side.
    pub(super) change: Layers,
    /// The position at which counting starts; events up to it are included in the count.
    pub(super) counted: f64,
    /// The distance from `counted`, along the side, within which rounding may decide on which side
    /// of an event a point is.
    pub(super) close: f64,
    /// The last event found on the side, from which the others follow ([`Event::before`]).
    pub(super) events: Option<Index>,
    /// The next side around an image. Where this side ends and that one begins, no image begins or
    /// ends, unless they are touched.
    pub(super) next: Option<Index>,
    /// For each end, whether another side passes through it, or so close to where it is clipped
    /// that rounding may decide.
    pub(super) touched: [bool; 2],
    /// The event on a side of the light at which this side enters the light.
    pub(super) entry: Option<Index>,
    /// The index of this side in the list of sides.
    pub(super) place: Index,
    /// Whether the side's count is known or will be set.
    pub(super) is_handed: bool,
    /// Whether the side crosses another one at such a small angle that rounding moves the crossing
    /// noticeably.
    pub(super) is_loose: bool,
    /// The number of sides of surfaces that overlap with this one where counting starts.
    pub(super) shared: i32,
    /// The layers of surfaces right of the beginning and of the end of the side's part on the
    /// light; `None` where an image hides that point.
    pub(super) layers_at_start: Option<LayerCount>,
    pub(super) layers_at_end: Option<LayerCount>,
}

/// A point on a side where the number of layers right of it changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) change: Layers,
    pub(super) end: End,
    /// Whether the side passes to the left of the one that it crosses.
    pub(super) to_left: bool,
    /// The layers of surfaces in the sector that is right of both crossing sides, as counted along
    /// this side; `None` if rounding may decide, or if images hide the sector.
    pub(super) layers: Option<LayerCount>,
    /// The event of the same side that was found before this one.
    pub(super) before: Option<Index>,
    /// On a side of the light, the number of images right of the edge that enters or leaves here;
    /// `None` if another event is too close.
    pub(super) right: Option<i32>,
    /// The side that the event is on, and the event of the crossing side, unless one only touches
    /// the other.
    pub(super) side: Index,
    pub(super) twin: Option<Index>,
}

/// The part of the plane in which decisions are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Only the light, with rounded points where edges are clipped. If such a point is too close to
    /// the sides of images, it is not decided on which side of these it is.
    Light,
    /// The whole plane, with whole edges: all decisions are exact.
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

    /// Whether the layers right of the end of this side are the layers right of the beginning of
    /// `next`.
    pub(super) fn goes_on_in(&self, next: &Self) -> bool {
        self.part.is_some_and(|p| p.hi.at >= self.edge.length)
            && next.part.is_some_and(|p| p.start == Start::Own)
            && !self.touched[1]
            && !next.touched[0]
    }

    /// Adds an event, and returns its index if it is within the part of the side that matters.
    #[inline(never)]
    pub(super) fn add(
        &mut self,
        change: Layers,
        to_left: bool,
        end: End,
        events: &mut Vec<Event>,
    ) -> Option<Index> {
        let part = self.part.as_ref()?;
        // Leave out events before the point where counting starts.
        if end.at <= self.counted + self.close {
            self.touched[0] |= end.at >= self.counted - self.close;
            if end.at <= self.counted {
                return None;
            }
        }
        // Count the change, and store the event unless it is beyond the end.
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

/// Whether the sides with indices i and j are neighbours around an image or the light: these meet
/// only at a corner.
#[inline]
pub(super) fn are_neighbours(e: &Side, i: usize, f: &Side, j: usize) -> bool {
    Index::is(e.next, j) | Index::is(f.next, i)
}

/// Records how two sides change each other's counts where they meet; `e` comes first in the list.
#[allow(clippy::float_cmp, reason = "the very same corners")]
#[inline(never)]
pub(super) fn meet(e: &mut Side, f: &mut Side, unit: f64, events: &mut Vec<Event>) {
    match e.edge.meet(&f.edge) {
        Meeting::Apart => {}
        // Sides on one line: the part that both share belongs to the first.
        Meeting::Aligned => {
            (e.touched, f.touched) = ([true; 2], [true; 2]);
            if let Some(span) = f.edge.shared(&e.edge)
                && !f.light
            {
                // So the shared part of the second is no boundary, as if one more image were over
                // it. A query at the point where counting starts does not find this extra image if
                // the first side is a surface's, or is the very same edge; then it is counted in
                // `shared`.
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
            // Adds the change that passing a side of `weight` makes, at the crossing.
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
            // Link the two events of a crossing to each other.
            if let (Some(i), Some(j), false) = (here, there, crossing.touching) {
                events[i.get()].twin = there;
                events[j.get()].twin = here;
            }
            if here.is_some() || there.is_some() {
                let loose = e.edge.crosses_loosely(&f.edge, 0.2 * CLOSE * unit);
                e.is_loose |= loose;
                f.is_loose |= loose;
            }
            // An edge enters the light where it passes to the right of one of the light's sides.
            if f.light && crossing.first == Some(false) && there.is_some() {
                e.entry = there;
            }
        }
    }
}
