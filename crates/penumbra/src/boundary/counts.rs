//! The count of images, which are projected triangles: how many of them are right of each side.
//! Where the count is zero, the side is a part of the boundary.
//!
//! The count at one point right of a side is determined by a query; from there it changes by a
//! known number at each event along the side, and is propagated to sides that cross the side or
//! continue it.

use super::index::Index;
use super::side::{Event, Extent, Side};
use super::{BoundaryEdge, CLOSE, Penumbra};
use crate::bins::Bounds;
use crate::clip::Start;
use linelit_geometry::stop;

/// The number of images up to which, in front of surfaces, the count of every side is queried,
/// because propagating counts is slower.
const FEW: usize = 32;

impl Penumbra {
    /// Finds for each side how many images are right of the point where counting starts. Returns
    /// false if the decisions on the light alone do not determine the counts, because rounding may
    /// decide.
    pub(super) fn count(&mut self, extent: Extent) -> bool {
        let lights = self.sides.len() - self.light.len();
        self.unknown = self.sides.iter().filter(|side| side.part.is_some()).count();
        // Begin with the light's own sides, since counts are handed on from these.
        for i in (lights..self.sides.len()).chain(0..lights) {
            let side = &self.sides[i];
            if side.part.is_none() || side.count.is_some() {
                continue;
            }
            // Take the count from where the side enters the light, or query the images around its
            // start.
            let entry = match (extent, side.entry) {
                (Extent::Light, Some(entry)) if !side.touched[0] => self.events[entry.get()].right,
                _ => None,
            };
            let ask = || Some(self.ask(side)? + side.shared);
            let Some(count) = entry.or_else(ask) else {
                return false;
            };
            self.follow(i, count, extent);
        }
        true
    }

    /// Sets the count of a side, and propagates counts: to the side that continues each side, and
    /// to sides that cross it.
    fn follow(&mut self, i: usize, count: i32, extent: Extent) {
        self.handed.clear();
        self.handed.push((i, count));
        while let Some((i, count)) = self.handed.pop() {
            stop::check();
            if self.sides[i].count.is_some() {
                continue;
            }
            self.sides[i].count = Some(count);
            self.sort_own(i);
            if self.past_surfaces {
                // Collect the parts of the side that are boundary.
                self.collect_stretches(i, count);
            } else {
                self.collect_pieces(i, count);
            }
            if extent == Extent::All {
                return;
            }
            self.hand(i);
            // Hand counts on to the sides that cross it, and to the one after it.
            if self.unknown == 0 || self.past_surfaces && self.images.len() <= FEW {
                continue;
            }
            if self.sides[i].light {
                self.count_beside(i, count);
            } else {
                self.count_crossing(i, count);
            }
            let side = &self.sides[i];
            if let Some(next) = side.next.map(Index::get)
                && side.goes_on_in(&self.sides[next])
            {
                self.handed.push((next, count + side.change.images));
            }
        }
    }

    /// Marks that the count of the side with index `i` is known or waits in `handed`.
    fn hand(&mut self, i: usize) {
        let side = &mut self.sides[i];
        self.unknown -= usize::from(!side.is_handed);
        side.is_handed = true;
    }

    /// Collects the parts of a side that no image is right of, which are parts of the boundary.
    /// `count` is the number of images right of the point where counting starts.
    #[inline]
    fn collect_pieces(&mut self, i: usize, mut count: i32) {
        let Some(part) = self.sides[i].part else {
            return;
        };
        let mut reached = part.lo;
        let events = self.own.iter().map(|e| &self.events[e.1.get()]);
        let changes = events.map(|e| (e.end, e.change.images));
        for (hi, change) in changes.chain([(part.hi, 0)]) {
            if hi.at > reached.at {
                if count == 0 {
                    // Reverse the direction: what is visible is right of the side, and has to be
                    // left of the boundary.
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

    /// Propagates counts to the sides that cross the side with index `i`. At a crossing, the sector
    /// that is right of both sides has one count, from which the count of the other side follows.
    fn count_crossing(&mut self, i: usize, mut count: i32) {
        let side = &self.sides[i];
        let Some(part) = side.part.filter(|_| !side.is_loose) else {
            return;
        };
        let room = CLOSE * self.unit * side.edge.extent();
        let mut before = part.lo.at;
        for k in 0..self.own.len() {
            // The count in the sector right of both is the smaller of those before and after the
            // crossing.
            let (at, event) = self.own[k];
            let after = self.own.get(k + 1).map_or(part.hi.at, |next| next.0);
            let event = &self.events[event.get()];
            let right = count.min(count + event.change.images);
            count += event.change.images;
            // Use the crossing only if no other is so close that rounding may decide their order.
            if let Some(twin) = event.twin
                && (at - before).min(after - at) > room
                && let Some((j, start)) = self.count_start(twin, right)
            {
                self.hand(j);
                self.handed.push((j, start));
            }
            before = at;
        }
    }

    /// Finds how many images are right of the point where counting starts on the side of an event,
    /// given the number right of both sides at the event. Also returns the side's index; `None` if
    /// the count is known already, or rounding may decide.
    fn count_start(&self, event: Index, right: i32) -> Option<(usize, i32)> {
        let Event {
            change, end, side, ..
        } = &self.events[event.get()];
        let change = change.images;
        let i = side.get();
        let side = &self.sides[i];
        let room = CLOSE * self.unit * side.edge.extent();
        let (start, last) = side.part.map(|part| (part.lo.at, part.hi.at))?;
        // Beyond its end, events are not stored.
        let is_near_end = end.at - start <= room || last - end.at <= room;
        if side.is_handed || side.count.is_some() || side.is_loose || is_near_end {
            return None;
        }
        // The sector right of both comes before the event if the other side is crossed to its left;
        // then subtract all changes up to the event.
        let mut count = if change > 0 { right } else { right - change };
        let mut next = side.events;
        while let Some(place) = next {
            let other = &self.events[place.get()];
            if place != event {
                if (other.end.at - end.at).abs() <= room {
                    return None;
                }
                if other.end.at < end.at {
                    count -= other.change.images;
                }
            }
            next = other.before;
        }
        Some((i, count))
    }

    /// Stores, in the events where edges cross a side of the light, the number of images right of
    /// these edges.
    fn count_beside(&mut self, i: usize, mut count: i32) {
        let edge = &self.sides[i].edge;
        let room = CLOSE * self.unit * edge.extent();
        let mut before = 0.0;
        for k in 0..self.own.len() {
            let (at, event) = self.own[k];
            let after = self.own.get(k + 1).map_or(edge.length, |next| next.0);
            let event = &mut self.events[event.get()];
            let right = count.min(count + event.change.images);
            event.right = (at - before > room && after - at > room).then_some(right);
            count += event.change.images;
            before = at;
        }
    }

    /// Sorts the events of a side.
    #[inline]
    pub(super) fn sort_own(&mut self, i: usize) {
        self.own.clear();
        if let Some(last) = self.sides[i].events {
            self.sort_from(last);
        }
    }

    #[inline(never)]
    fn sort_from(&mut self, last: Index) {
        let mut next = Some(last);
        while let Some(place) = next {
            let event = &self.events[place.get()];
            self.own.push((event.end.at, place));
            next = event.before;
        }
        self.own.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// Counts the images just right of the point where counting starts on a side, by testing all
    /// images near the point; `None` if rounding may decide.
    #[inline(never)]
    fn ask(&self, side: &Side) -> Option<i32> {
        let part = side.part.as_ref()?;
        // The point is where the side was clipped, which is rounded, or its own start, which is
        // exact.
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
        self.images_at.at(&start, |i| {
            let image = &self.images[i];
            if image.bounds.meets(&around) {
                count += i32::from(if cut {
                    image.holds_on(start, &side.edge, room)?
                } else {
                    image.holds_start(&side.edge)
                });
            }
            Some(())
        })?;
        Some(count)
    }
}
