//! How many images are right of each side.

use super::index::Index;
use super::side::{Event, Extent, Side};
use super::{BoundaryEdge, CLOSE, Penumbra};
use crate::bins::Bounds;
use crate::clip::Start;
use linelit_geometry::stop;

/// Up to as many images, those of surfaces that have to be cut, are asked sooner than handed on.
const FEW: usize = 32;

impl Penumbra {
    /// Finds for each side how many images are right of where counting starts; `false` if what is
    /// on the light does not tell.
    pub(super) fn count(&mut self, extent: Extent) -> bool {
        let lights = self.sides.len() - self.light.len();
        self.unknown = self.sides.iter().filter(|side| side.part.is_some()).count();
        for i in (lights..self.sides.len()).chain(0..lights) {
            let side = &self.sides[i];
            if side.part.is_none() || side.count.is_some() {
                continue;
            }
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

    /// Takes in the count of a side, and hands it on: to what comes after each side, and to what
    /// crosses it.
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
                self.collect_stretches(i, count);
            } else {
                self.collect_pieces(i, count);
            }
            if extent == Extent::All {
                return;
            }
            self.hand(i);
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

    /// Notes that the count of a side is known, or will be.
    fn hand(&mut self, i: usize) {
        let side = &mut self.sides[i];
        self.unknown -= usize::from(!side.is_handed);
        side.is_handed = true;
    }

    /// The parts of a side with no image right of it.
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

    /// Counts the images right of the sides that cross one, where both are on the other's right.
    fn count_crossing(&mut self, i: usize, mut count: i32) {
        let side = &self.sides[i];
        let Some(part) = side.part.filter(|_| !side.is_loose) else {
            return;
        };
        let room = CLOSE * self.unit * side.edge.extent();
        let mut before = part.lo.at;
        for k in 0..self.own.len() {
            let (at, event) = self.own[k];
            let after = self.own.get(k + 1).map_or(part.hi.at, |next| next.0);
            let event = &self.events[event.get()];
            let right = count.min(count + event.change.images);
            count += event.change.images;
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

    /// The side of an event, and the images right of where counting starts on it, given those right
    /// of both sides where the event is; none if that is known, or rounding may decide.
    fn count_start(&self, event: Index, right: i32) -> Option<(usize, i32)> {
        let Event {
            change, end, side, ..
        } = &self.events[event.get()];
        let change = change.images;
        let i = side.get();
        let side = &self.sides[i];
        let room = CLOSE * self.unit * side.edge.extent();
        let (start, last) = side.part.map(|part| (part.lo.at, part.hi.at))?;
        // Beyond its end no events are kept.
        let is_near_end = end.at - start <= room || last - end.at <= room;
        if side.is_handed || side.count.is_some() || side.is_loose || is_near_end {
            return None;
        }
        // What is right of both comes before where the other is passed to its left.
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

    /// Counts the images right of the edges that cross a side of the light.
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

    /// Puts the events of a side in order.
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
