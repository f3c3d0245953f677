//! The parts of lines that fine meshes hide: each gap between the parts that other triangles hide
//! is cut where the line crosses silhouettes.
//!
//! A *layer* over a point is a triangle that hides it. The crossings say by how many layers each
//! stretch of a gap, between two neighbouring crossings, differs from the gap's first stretch, and
//! a single ray determines the number over the first. The ray is sent towards the stretch with the
//! fewest layers. If the ray hits nothing, that stretch has no layers, and the stretches with more
//! layers are hidden; if the ray hits a triangle, every stretch has at least one layer, and all of
//! the gap is hidden.
//!
//! ```text
//!     line     ────┬────────┬───────────┬──────
//!     layers     0 │  +1    │    −1     │  0        relative to the first stretch
//!                             ↑ ray
//! ```

use crate::{
    shaft::{
        bins::{Covered, GROUP, Image},
        block::{LineBlock, Lines},
        cover::Image as _,
        merge::Slots,
    },
    silhouettes::silhouette::Target,
};
use linelit_simd::Simd;
use std::ops::Range;

/// Where the lines of a dense shaft cross the silhouettes of fine meshes, and the gaps that are cut
/// there.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// For each line of the walk, the positions of its crossings and the change of the number of
    /// layers at each.
    of: [Vec<(f64, i32)>; GROUP],
    /// The gaps of all lines: the parts that are not known to be hidden.
    pub(crate) gaps: Vec<Gap>,
    /// The stretches of all gaps, gap by gap.
    stretches: Vec<Stretch>,
}

/// The part of a gap between two neighbouring crossings.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    low: f64,
    high: f64,
    /// The number of layers over the stretch, minus the number over the gap's first stretch.
    layers: i32,
}

/// A part of a line that is not known to be hidden, cut into stretches where it crosses
/// silhouettes.
#[derive(Clone, Debug)]
pub(crate) struct Gap {
    /// The index of the line in the walk.
    pub(crate) line: u32,
    /// The centre of the longest stretch among those with the fewest layers, towards which a ray is
    /// sent.
    pub(crate) middle: f64,
    layers: i32,
    stretches: Range<u32>,
}

/// The lines of one walk as the target of a search for silhouettes; `covered` records which parts
/// of the lines are known to be hidden.
pub(crate) struct OfLines<'a> {
    covered: &'a Covered,
    lines: &'a Lines,
    /// The least and the greatest end of all lines, along their direction.
    start: f64,
    end: f64,
    crossings: &'a mut Crossings,
}

impl<'a> OfLines<'a> {
    /// Creates the target, without crossings so far.
    pub(crate) fn new(
        covered: &'a Covered,
        lines: &'a Lines,
        crossings: &'a mut Crossings,
    ) -> Self {
        for line in &mut crossings.of {
            line.clear();
        }
        Self {
            covered,
            lines,
            start: ends(lines, |block| &block.from).fold(1.0, f64::min),
            end: ends(lines, |block| &block.to).fold(0.0, f64::max),
            crossings,
        }
    }
}

impl Target for OfLines<'_> {
    #[inline(always)]
    fn needs<S: Simd>(&self, s: S, _among: u8, low: [S::F; 2], high: [S::F; 2]) -> u8 {
        self.covered.needs_any(s, &Image::eight(s, [low, high]))
    }

    #[inline(always)]
    fn meets<S: Simd>(&self, s: S, [p, q]: [S::D; 2], [p1, q1]: [S::D; 2]) -> u8 {
        // All lines of a walk are in one block.
        let Some(block) = self.lines.blocks.first() else {
            return 0;
        };
        // Compare the sides' bounds with those of all lines. Across the lines is −p.
        let (first, last) = (s.dsplat(block.u[0]), s.dsplat(block.u[7]));
        let zero = s.dsplat(0.0);
        let (low, high) = (zero - s.dmax(p, p1), zero - s.dmin(p, p1));
        let along =
            s.dle(s.dmin(q, q1), s.dsplat(self.end)) & s.dle(s.dsplat(self.start), s.dmax(q, q1));
        let met = s.bits(s.dle(low, last) & s.dlt(first, high) & along);
        if met == 0 {
            return 0;
        }
        // Most sides of fine triangles lie between two lines, and cross none.
        let mut crossed = s.dlt(zero, zero);
        for u in &block.u {
            let u = s.dsplat(*u);
            crossed = crossed | s.dle(low, u) & s.dlt(u, high);
        }
        met & s.bits(crossed)
    }

    #[inline(always)]
    fn side<S: Simd>(&mut self, s: S, [a, b]: [[f64; 2]; 2], change: impl FnOnce(bool) -> i32) {
        let (low, high) = (-a[0].max(b[0]), -a[0].min(b[0]));
        let along = a[1].min(b[1]) <= self.end && self.start <= a[1].max(b[1]);
        let (low, high) = (s.dsplat(low), s.dsplat(high));
        let Some(block) = self.lines.blocks.first() else {
            return;
        };
        let u = s.dload(&block.u);
        let met = s.bits(s.dle(low, u) & s.dlt(u, high));
        if along && met != 0 {
            let change = change(a[0] < b[0]);
            if change != 0 {
                cross(block, met, (a, b), change, &mut self.crossings.of);
            }
        }
    }
}

/// Records where lines of a block, those in the mask `among`, cross a side of a triangle. The
/// position is computed by the same expression as the end of a triangle's interval, so that both
/// have identical bits.
#[inline(always)]
fn cross(
    block: &LineBlock,
    among: u8,
    ([p, q], [p1, q1]): ([f64; 2], [f64; 2]),
    change: i32,
    of: &mut [Vec<(f64, i32)>; GROUP],
) {
    // Order the ends across the lines; the coordinate across is −p.
    let ends = [(-p, q), (-p1, q1)];
    let [(u0, v0), (u1, v1)] = if ends[1].0 < ends[0].0 {
        [ends[1], ends[0]]
    } else {
        ends
    };
    let slope = (v1 - v0) / (u1 - u0).max(1e-280);
    let mut among = among;
    while among != 0 {
        let lane = among.trailing_zeros() as usize;
        among &= among - 1;
        let u = block.u[lane];
        let place = v0 + (u - u0) * slope;
        if u0 <= u && u < u1 && block.from[lane] < place && place < block.to[lane] {
            of[lane].push((place, change));
        }
    }
}

/// Returns one of the two ends of each line, chosen by `which`.
fn ends(lines: &Lines, which: fn(&LineBlock) -> &[f64; 8]) -> impl Iterator<Item = f64> {
    lines.blocks.iter().flat_map(which).copied()
}

/// The length of a stretch, as a fraction of the light, below which a ray is sent towards it only
/// if all stretches of the gap are shorter than this: where crossings coincide, rounding decides
/// their order, and so the number of layers between them.
const NARROW: f64 = 1e-13;

impl Gap {
    /// Creates the gap of all stretches from index `first` on, and chooses where to send its ray;
    /// `None` if there are no stretches.
    #[allow(clippy::cast_possible_truncation, reason = "stretches are fewer")]
    fn new(line: u32, stretches: &[Stretch], first: usize) -> Option<Self> {
        let width = |stretch: &Stretch| stretch.high - stretch.low;
        let is_narrow = |stretch: &Stretch| width(stretch) <= NARROW;
        // Choose a stretch that is not narrow, with the fewest layers, and among these the longest.
        let order = |a: &&Stretch, b: &&Stretch| {
            let fewer = || a.layers.cmp(&b.layers);
            let wider = || width(b).total_cmp(&width(a));
            is_narrow(a)
                .cmp(&is_narrow(b))
                .then_with(fewer)
                .then_with(wider)
        };
        let fewest = stretches[first..].iter().min_by(order)?;
        Some(Self {
            line,
            middle: 0.5 * (fewest.low + fewest.high),
            layers: fewest.layers,
            stretches: first as u32..stretches.len() as u32,
        })
    }
}

impl Crossings {
    /// The total number of crossings.
    pub(crate) fn count(&self) -> usize {
        self.of.iter().map(Vec::len).sum()
    }

    /// Cuts the visible parts of all lines where they cross silhouettes.
    pub(crate) fn cut_lines(&mut self, lines: &Lines, slots: &mut Slots) {
        let Self {
            of,
            gaps,
            stretches,
            ..
        } = self;
        gaps.clear();
        stretches.clear();
        for (line, crossings) in (0_u32..).zip(of).take(lines.count) {
            let (index, k) = (line as usize / 8, line as usize % 8);
            let block = &lines.blocks[index];
            let (from, to) = (block.from[k], block.to[k]);
            if !(from < to) {
                continue;
            }
            // Sort the crossings; where several coincide, the layers that begin come before those
            // that end.
            crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let mut next = crossings.iter().copied().peekable();
            let mut start = from;
            // Go through the hidden intervals, with an empty one at the end: before each is a gap.
            let hidden = slots.sorted(index, k, (block.run_lo[k], block.run_hi[k]));
            let is_some = |(low, high): &&(f64, f64)| low <= high;
            for &(low, high) in hidden.iter().filter(is_some).chain([&(to, to)]) {
                let end = low.min(to);
                while next.next_if(|(place, _)| *place <= start).is_some() {}
                if start < end {
                    let first = stretches.len();
                    let mut layers = 0;
                    // Cut the gap at its crossings, and count the layers.
                    while let Some((place, change)) = next.next_if(|(place, _)| *place < end) {
                        stretches.push(Stretch {
                            low: start,
                            high: place,
                            layers,
                        });
                        start = place;
                        layers += change;
                    }
                    stretches.push(Stretch {
                        low: start,
                        high: end,
                        layers,
                    });
                    gaps.extend(Gap::new(line, stretches, first));
                }
                start = start.max(high);
            }
        }
    }

    /// Returns the hidden parts of a gap, given whether its [middle](Gap::middle) is visible. If it
    /// is visible, the stretches with the fewest layers are visible, and the others hidden; if not,
    /// the whole gap is hidden.
    pub(crate) fn hidden(&self, gap: usize, is_visible: bool) -> impl Iterator<Item = (f64, f64)> {
        let Gap {
            layers, stretches, ..
        } = &self.gaps[gap];
        let stretches = &self.stretches[stretches.start as usize..stretches.end as usize];
        let hidden = move |s: &&Stretch| !is_visible || s.layers != *layers;
        stretches.iter().filter(hidden).map(|s| (s.low, s.high))
    }
}
