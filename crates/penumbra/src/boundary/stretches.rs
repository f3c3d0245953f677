//! The boundary past surfaces that are known by their silhouettes.
//!
//! How many layers of surfaces are over a place is not known, but along a side that is under no
//! image it is how many more there are than over another. Where sides cross, and where one goes on
//! where another ends, what is right of both is over both alike. So all that sides connect needs
//! one answer: whether there is anything over the place under the fewest layers. If not, no layer
//! is over it and all places like it; if so, some are over all.

use super::layers::Layers;
use super::{BoundaryEdge, CLOSE, Penumbra, index};
use crate::bins::Bounds;
use crate::clip::{Edge, End};
use crate::orient::{Point, orient};
use linelit_geometry::stop;

/// A part of a side, under no image, between two places where what is right of it changes.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    side: u32,
    /// The gap between images that it is in.
    gap: u32,
    /// The difference of layers to its right from those to the right of the gap's beginning.
    layers: i32,
    lo: End,
    hi: End,
}

/// A gap between images along a side.
#[derive(Clone, Copy, Debug)]
struct Gap {
    /// A gap that it is connected with, or itself.
    with: u32,
    /// The difference of layers over its beginning from those over the beginning of that gap.
    layers: i32,
    /// If it stands for all that are connected with it, the place of the stretch of those under the
    /// fewest layers, plus one, and up to how many layers stretches are visible.
    fewest: (u32, i32),
}

/// The stretches between the edges of images and surfaces.
#[derive(Debug, Default)]
pub(super) struct Stretches {
    all: Vec<Stretch>,
    gaps: Vec<Gap>,
}

/// The positions at which a place near a stretch is tested, along it and beside it, as fractions of
/// its length: as far beside it as nothing else is in between.
const ALONG: [f64; 5] = [0.5, 0.47, 0.59, 0.38, 0.67];
const ASIDE: [f64; 5] = [0.25, 0.02, 1e-3, 3e-5, 1e-6];

/// The length, in units of the light, below which stretches are decided by longer ones, or left
/// out where there are none.
const SHORT: f64 = 1e-12;

/// The largest error of a place on a stretch, in units of the light, chosen generously.
const ROUNDING: f64 = 1e-14;

/// The number of stretches on which a place is tried.
const TRIES: usize = 16;

impl Stretches {
    pub(super) fn iter(&self) -> impl Iterator<Item = [Point; 2]> {
        self.all.iter().map(|s| [s.lo.point, s.hi.point])
    }

    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.gaps.clear();
    }

    /// Begins a gap and tells its number, plus one.
    fn begin(&mut self) -> u32 {
        self.gaps.push(Gap {
            with: index(self.gaps.len()),
            layers: 0,
            fewest: (0, 0),
        });
        index(self.gaps.len())
    }

    /// The gap that stands for all that a gap is connected with, and how many layers more are over
    /// the latter's beginning.
    fn root(&mut self, gap: u32) -> (u32, i32) {
        let (mut at, mut layers) = (gap, 0);
        loop {
            let Gap {
                with, layers: more, ..
            } = self.gaps[at as usize];
            if with == at {
                return (at, layers);
            }
            // Halve the path for the next search.
            let beyond = self.gaps[with as usize];
            if beyond.with != with {
                let shorter = &mut self.gaps[at as usize];
                (shorter.with, shorter.layers) = (beyond.with, more + beyond.layers);
            }
            layers += more;
            at = with;
        }
    }

    /// Connects two gaps, each with how many layers more than over its beginning are over a place
    /// that both share; false if that is known to be otherwise.
    fn connect(&mut self, a: u32, over_a: i32, b: u32, over_b: i32) -> bool {
        let [(a, more_a), (b, more_b)] = [a, b].map(|gap| self.root(gap));
        let more = more_b + over_b - more_a - over_a;
        if a == b {
            return more == 0;
        }
        let gap = &mut self.gaps[a as usize];
        (gap.with, gap.layers) = (b, more);
        true
    }

    /// Finds, among all connected stretches, the one under the fewest layers, the longest of those;
    /// short ones only where there are no others. Layers are then counted from the beginning of the
    /// gap that represents the connected ones.
    fn find_fewest(&mut self, short: f64) {
        for place in 0..self.all.len() {
            let (gap, more) = self.root(self.all[place].gap);
            let stretch = &mut self.all[place];
            (stretch.gap, stretch.layers) = (gap, stretch.layers + more);
            let stretch = &self.all[place];
            let (best, _) = self.gaps[gap as usize].fewest;
            let is_better = best.checked_sub(1).is_none_or(|best| {
                let best = &self.all[best as usize];
                let (length, longest) = (stretch.length(), best.length());
                match (length > short, longest > short) {
                    (true, false) => true,
                    (false, true) => false,
                    _ if stretch.layers == best.layers => length > longest,
                    _ => stretch.layers < best.layers,
                }
            });
            if is_better {
                self.gaps[gap as usize].fewest = (index(place + 1), i32::MIN);
            }
        }
    }
}

impl Stretch {
    /// Along the axes: no more than 1.5 times as long as it is.
    fn length(&self) -> f64 {
        let (a, b) = (self.lo.point, self.hi.point);
        (a[0] - b[0]).abs() + (a[1] - b[1]).abs()
    }
}

impl Penumbra {
    /// Collects the parts of a side with no image right of it, given how many images are where
    /// counting starts.
    pub(super) fn collect_stretches(&mut self, i: usize, mut images: i32) {
        let Self {
            sides,
            own,
            events,
            stretches,
            unit,
            ..
        } = self;
        let side = &mut sides[i];
        let Some(part) = side.part else { return };
        // Where the light's sides begin is not moved by what they cross.
        let is_loose = side.is_loose && !side.light;
        let room = CLOSE * *unit * side.edge.extent();
        let (mut layers, mut passed) = (0, Layers::default());
        let mut gap = if images == 0 { stretches.begin() } else { 0 };
        side.first_gap = gap;
        let (mut reached, mut before) = (part.lo, part.lo.at);
        for k in 0..=own.len() {
            let event = own.get(k).map(|&(_, place)| place as usize);
            let hi = event.map_or(part.hi, |place| events[place].end);
            if hi.at > reached.at {
                if let Some(gap) = gap.checked_sub(1) {
                    stretches.all.push(Stretch {
                        side: index(i),
                        gap,
                        layers,
                        lo: reached,
                        hi,
                    });
                }
                reached = hi;
            }
            let Some(event) = event else { break };
            let event = &mut events[event];
            let was = (gap, layers);
            passed += event.change;
            images += event.change.images;
            layers += event.change.surfaces;
            if images != 0 || gap == 0 {
                layers = 0;
                gap = if images == 0 { stretches.begin() } else { 0 };
            }
            let after = own.get(k + 1).map_or(part.hi.at, |next| next.0);
            let is_clear = !is_loose && (hi.at - before).min(after - hi.at) > room;
            // What is right of both comes before where the side comes to the other's left.
            (event.gap, event.layers) = match (is_clear, event.to_left) {
                (false, _) => (0, 0),
                (true, true) => was,
                (true, false) => (gap, layers),
            };
            before = hi.at;
        }
        // What rounding puts at its end has no event.
        let left = side.change + -passed;
        if images + left.images != 0 {
            gap = 0;
        }
        (side.last_gap, side.last_layers) = (gap, layers + left.surfaces);
    }

    /// Finds which stretches are boundary, asking about a place for all that are connected; false
    /// if there is none to ask about.
    pub(super) fn find_boundary(
        &mut self,
        least: f64,
        mut is_visible: impl FnMut(Point) -> bool,
    ) -> bool {
        self.pieces.clear();
        if !self.connect() {
            return false;
        }
        let short = SHORT * self.unit;
        self.stretches.find_fewest(short);
        for gap in 0..self.stretches.gaps.len() {
            stop::check();
            let Some(best) = self.stretches.gaps[gap].fewest.0.checked_sub(1) else {
                continue;
            };
            let stretch = &self.stretches.all[best as usize];
            let mut most = i32::MIN;
            if stretch.length() > short {
                let Some(place) = self.place_beside(stretch, least) else {
                    return false;
                };
                if is_visible(place) {
                    // Under fewer are only short ones.
                    most = stretch.layers;
                }
            }
            self.stretches.gaps[gap].fewest.1 = most;
        }
        let Stretches { all, gaps } = &self.stretches;
        let visible = all
            .iter()
            .filter(|stretch| stretch.layers <= gaps[stretch.gap as usize].fewest.1);
        // Backwards: what is visible is right of the edge.
        self.pieces.extend(visible.map(|stretch| BoundaryEdge {
            from: stretch.hi.point,
            to: stretch.lo.point,
        }));
        true
    }

    /// Connects the gaps of sides that share what is right of them; false if what is known of one
    /// contradicts what is known of another.
    fn connect(&mut self) -> bool {
        let Self {
            sides,
            events,
            stretches,
            ..
        } = self;
        let mut agree = true;
        let mut connect = |(a, over_a): (u32, i32), (b, over_b): (u32, i32)| {
            if let (Some(a), Some(b)) = (a.checked_sub(1), b.checked_sub(1)) {
                agree &= stretches.connect(a, over_a, b, over_b);
            }
        };
        for (place, event) in events.iter().enumerate() {
            if let Some(twin) = (event.twin as usize).checked_sub(1)
                && twin > place
            {
                let twin = &events[twin];
                connect((event.gap, event.layers), (twin.gap, twin.layers));
            }
        }
        for side in &*sides {
            // Where counting starts with the part that is on the light, as nothing does of all of
            // every edge.
            if let Some(entry) = (side.entry as usize).checked_sub(1)
                && !side.touched[0]
                && side.counted >= 0.0
            {
                let entry = &events[entry];
                connect((side.first_gap, 0), (entry.gap, entry.layers));
            }
            if let Some(next) = (side.next as usize).checked_sub(1) {
                let to = &sides[next];
                let is_same = (side.weight.images == 0) == (to.weight.images == 0);
                if is_same && side.goes_on_in(to) {
                    connect((side.last_gap, side.last_layers), (to.first_gap, 0));
                }
            }
        }
        agree
    }

    /// A place right of a stretch, or of one connected with it under as few layers, with nothing
    /// in between.
    fn place_beside(&self, stretch: &Stretch, least: f64) -> Option<Point> {
        let is_like = |other: &&Stretch| {
            other.gap == stretch.gap && other.layers == stretch.layers && other.lo.at < other.hi.at
        };
        let others = || self.stretches.all.iter().filter(is_like).take(TRIES);
        self.place_right_of(stretch, least)
            .or_else(|| others().find_map(|other| self.place_right_of(other, least)))
    }

    /// A place right of a stretch, at least so far from it, with nothing in between.
    fn place_right_of(&self, stretch: &Stretch, least: f64) -> Option<Point> {
        let Stretch { side, lo, hi, .. } = stretch;
        let length = stretch.length();
        let own = &self.sides[*side as usize];
        let run = [0, 1].map(|k| own.edge.to[k] - own.edge.from[k]);
        let size = (run[0] * run[0] + run[1] * run[1]).sqrt();
        let right = [run[1] / size, -run[0] / size];
        ALONG.iter().zip(ASIDE).find_map(|(along, aside)| {
            let aside = aside * length;
            let beside = |aside: f64| {
                [0, 1].map(|k| {
                    let on_side = lo.point[k] + along * (hi.point[k] - lo.point[k]);
                    on_side + aside * right[k]
                })
            };
            // That is rounded: from where surely no other side is between it and its own.
            let (from, place) = (beside(-ROUNDING * self.unit), beside(aside));
            let is_free = aside > least && self.is_free(from, place, *side as usize, &own.edge);
            is_free.then_some(place)
        })
    }

    /// Whether no side is between two places, of which the first is on the side at `own`.
    #[allow(clippy::float_cmp, reason = "on the very same line")]
    fn is_free(&self, from: Point, to: Point, own: usize, edge: &Edge) -> bool {
        let bounds = Bounds::of([from, to]);
        self.sides_near.near(&bounds, 0).all(|j| {
            if j == own || !self.boxes[j].meets(&bounds) {
                return true;
            }
            let other = &self.sides[j].edge;
            let beside = |a: Point, b: Point| [orient(a, b, other.from), orient(a, b, other.to)];
            let apart = |[a, b]: [f64; 2]| (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0);
            let ends = [from, to].map(|p| orient(other.from, other.to, p));
            // What runs along the side is where the way begins.
            apart(beside(from, to)) || apart(ends) || beside(edge.from, edge.to) == [0.0; 2]
        })
    }
}
