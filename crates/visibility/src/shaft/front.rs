//! Dense shafts for closed forms: the search for the triangles in front, which determine the
//! visible part of a light.
//!
//! A walk from front to back over the whole light stores triangles, and marks which of 64 × 64
//! samples of the light they hide. A box or triangle is skipped if its image touches only cells of
//! which all four corners are hidden. This is a guess: between its corners, a cell may be partly
//! visible, and what was skipped may hide that part. So the caller finds the boundary of the part
//! of the light that is visible if only the stored triangles hide it, and asks [`Front::look`]
//! whether that boundary touches cells that were skipped at any time. If so, another walk stores
//! all triangles that touch those cells, and so on, until the whole boundary lies in cells of which
//! every triangle is stored: then no other triangle can change the boundary. The *image* of a
//! triangle is its projection onto the light. See `docs/decisions/016-exact-in-dense-shafts.md`.
//!
//! ```text
//!     ·───·───·───·      · sample, open     a cell with an open corner is complete:
//!     │   │   │ ╱ │      ● sample, hidden   all triangles that touch it are stored;
//!     ·───·───●───●                         a cell with four hidden corners may not be
//!     │   │ ╱ │ ? │
//!     ·───●───●───●
//! ```

use crate::{
    bvh::Bvh,
    counters::Counters,
    lanes::Lanes,
    rays::ray::wait_for_root,
    shaft::{
        cover::{self, Cover, Image as _, ImageBounds, front_to_back},
        frame::LightFrame,
        project::FlatTriangles,
        seen::ShaftState,
    },
    walk::Waiting,
};
use linelit_simd::{Simd, dispatch};

/// The number of samples of the light along each of its two axes p and q.
const SIDE: u8 = 64;

/// The index of the last sample, at the light's far side.
const LAST: u8 = SIDE - 1;

/// A generous bound of rounding errors, in units of the light: a sample this close to a side of a
/// triangle does not count as hidden by the triangle, and a boundary touches cells up to this far
/// from it.
pub(crate) const ROOM: f64 = 1e-9;

/// A bit for each sample or cell: rows along p, bits along q.
type Grid = [u64; SIDE as usize];

/// What is known about the samples of a light and about the cells between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Front {
    /// In the first walk, a bit for each sample that is not known to be hidden; later, a bit for
    /// each cell whose triangles are searched for.
    open: Grid,
    /// A bit for each cell of which all triangles are stored, except for those that no walk needs.
    complete: Grid,
    /// Whether `open` is about cells.
    by_cells: bool,
    /// Whether triangles of fine surfaces are left out of the walks.
    pub(crate) loose: bool,
}

impl Default for Front {
    fn default() -> Self {
        Self {
            open: [0; SIDE as usize],
            complete: [0; SIDE as usize],
            by_cells: false,
            loose: false,
        }
    }
}

/// The projection of a box or triangle onto the light, as the range of samples around the cells
/// that it touches: the first and the last row, and the first and the last bit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Image {
    rows: [u8; 2],
    bits: [u8; 2],
}

/// The projections of eight boxes or triangles.
#[derive(Default)]
pub(crate) struct Images {
    first: [Lanes<[f32; 8]>; 2],
    last: [Lanes<[f32; 8]>; 2],
}

impl cover::Image for Image {
    type Eight = Images;

    const ALL: Self = Self {
        rows: [0, LAST],
        bits: [0, LAST],
    };

    #[inline(always)]
    fn eight<S: Simd>(s: S, [low, high]: ImageBounds<S>) -> Images {
        let mut images = Images::default();
        // Adding 2²³ rounds to an integer. With one half less, the first sample is at most one too
        // low for a whole number; with one half more, the last sample is the one beyond.
        let (zero, end) = (s.splat(0.0), s.splat(f32::from(LAST)));
        let base = s.splat(8_388_608.0);
        for k in 0..2 {
            let first = s.fma(low[k], end, s.splat(-0.5));
            let last = s.fma(high[k], end, s.splat(0.5));
            s.store(s.min(s.max(first, zero), end) + base, &mut images.first[k]);
            s.store(s.min(s.max(last, zero), end) + base, &mut images.last[k]);
        }
        images
    }

    #[inline(always)]
    fn of(images: &Images, lane: usize) -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "below SIDE")]
        let number = |x: f32| (x.to_bits() & 0xff) as u8;
        let pair = |k: usize| [number(images.first[k][lane]), number(images.last[k][lane])];
        Self {
            rows: pair(0),
            bits: pair(1),
        }
    }
}

/// Returns a mask of the bits from `first` to `last`; at least the first is set.
#[inline(always)]
fn bits(first: u8, last: u8) -> u64 {
    (u64::MAX << first) & (u64::MAX >> (LAST - last.max(first)))
}

// These are the minimum and the maximum by one instruction each, for numbers that are not NaN.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Returns the first and the last sample between two coordinates along an axis; `None` if there is
/// no sample between them.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn samples_between(low: f64, high: f64) -> Option<(u8, u8)> {
    let end = f64::from(LAST);
    let (low, high) = (greater(low * end, 0.0), lesser(high * end, end));
    if !(low <= high) {
        return None;
    }
    let first = low as u8;
    let first = first + u8::from(f64::from(first) < low);
    let last = high as u8;
    (first <= last).then_some((first, last))
}

/// Returns the index of the cell, along an axis, that holds a coordinate; the nearest cell for
/// coordinates outside of the light.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn cell(x: f64) -> u8 {
    lesser(greater(x * f64::from(LAST), 0.0), f64::from(LAST - 1)) as u8
}

/// Returns the coordinate of a sample along an axis, from 0 to 1.
#[inline(always)]
fn place(sample: u8) -> f64 {
    f64::from(sample) / f64::from(LAST)
}

/// Returns the least and the greatest q of a convex polygon between two values of p; `None` if the
/// polygon has no point between them.
fn extent(polygon: &[[f64; 2]], from: f64, to: f64) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
        if a[0] > to || b[0] < from {
            continue;
        }
        let at = |p: f64| match p {
            _ if p <= a[0] => a[1],
            _ if p >= b[0] => b[1],
            _ => a[1] + (b[1] - a[1]) * ((p - a[0]) / (b[0] - a[0])),
        };
        for q in [at(from), at(to)] {
            (low, high) = (lesser(low, q), greater(high, q));
        }
    }
    (low <= high).then_some((low, high))
}

impl Front {
    /// Starts the first walk: only what lies outside of the light is hidden.
    fn start(&mut self, frame: &LightFrame) {
        self.by_cells = false;
        let light = &frame.corners[..frame.corner_count];
        for (r, row) in (0_u8..).zip(&mut self.open) {
            let beside = |step: f64| (f64::from(r) + step) / f64::from(LAST);
            let across = extent(light, beside(-1.0) - 2.0 * ROOM, beside(1.0) + 2.0 * ROOM);
            *row = across.map_or(0, |(low, high)| {
                bits(cell(low - 2.0 * ROOM), cell(high + 2.0 * ROOM) + 1)
            });
        }
    }

    /// Whether a projection touches any sample or cell that is open.
    #[inline(always)]
    fn needs(&self, image: &Image) -> bool {
        // A cell has the index of its first sample, and there is one cell fewer.
        let less = u8::from(self.by_cells);
        let range = |[first, last]: [u8; 2]| {
            let first = first.min(LAST - less);
            (first, last.saturating_sub(less).max(first))
        };
        let (rows, (first, last)) = (range(image.rows), range(image.bits));
        let mask = bits(first, last);
        let rows = &self.open[usize::from(rows.0)..=usize::from(rows.1)];
        rows.iter().any(|row| row & mask != 0)
    }

    /// Returns a bit for each of eight projections, of those in the mask `among`, that touches any
    /// sample or cell that is open.
    #[inline(always)]
    pub(crate) fn needs_any(&self, among: u8, images: &Images) -> u8 {
        let (mut left, mut needed) = (among, 0);
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            needed |= u8::from(self.needs(&Image::of(images, lane))) << lane;
        }
        needed
    }

    /// Whether the bounding rectangle of a side touches cells that are open.
    #[inline(always)]
    pub(crate) fn needs_side(&self, a: [f64; 2], b: [f64; 2]) -> bool {
        let low = [0, 1].map(|k| lesser(a[k], b[k]) - ROOM);
        let high = [0, 1].map(|k| greater(a[k], b[k]) + ROOM);
        if !(low[0] <= 1.0 && low[1] <= 1.0 && high[0] >= 0.0 && high[1] >= 0.0) {
            return false;
        }
        let mask = bits(cell(low[1]), cell(high[1]));
        let rows = usize::from(cell(low[0]))..=usize::from(cell(high[0]));
        self.open[rows].iter().any(|row| row & mask != 0)
    }

    /// Opens, for all later tests, the cells of which all triangles are stored, and no others.
    pub(crate) fn open_complete(&mut self) {
        (self.by_cells, self.open) = (true, self.complete);
    }

    /// Marks the samples that a triangle hides.
    #[inline]
    fn hide(&mut self, triangle: &[[f64; 2]; 3]) {
        let [a, b, c] = triangle;
        let range = |k: usize| {
            let low = lesser(lesser(a[k], b[k]), c[k]);
            samples_between(low, greater(greater(a[k], b[k]), c[k]))
        };
        // Most triangles are too small to have a sample within their bounds.
        if range(1).is_some()
            && let Some((first, last)) = range(0)
        {
            self.hide_rows(triangle, first..=last);
        }
    }

    /// Marks the samples that a triangle hides in some rows of samples.
    #[inline(never)]
    fn hide_rows(&mut self, triangle: &[[f64; 2]; 3], rows: std::ops::RangeInclusive<u8>) {
        for r in rows {
            let open = &mut self.open[usize::from(r)];
            if *open == 0 {
                continue;
            }
            // Find where the row enters and leaves the triangle.
            let p = place(r);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                if (a[0] <= p) != (b[0] <= p) {
                    let q = a[1] + (b[1] - a[1]) * ((p - a[0]) / (b[0] - a[0]));
                    (low, high) = (lesser(low, q), greater(high, q));
                }
            }
            // Close the samples between, except within the margin for rounding.
            if let Some((first, last)) = samples_between(low + ROOM, high - ROOM) {
                *open &= !bits(first, last);
            }
        }
    }

    /// Ends the first walk: all cells with an open corner are complete.
    fn finish(&mut self) {
        for r in 0..usize::from(LAST) {
            let open = self.open[r] | self.open[r + 1];
            self.complete[r] = open | open >> 1;
        }
        self.complete[usize::from(LAST)] = 0;
    }

    /// Opens the cells that a boundary touches and that are not complete yet, and marks them as
    /// complete, which they will be after the next walk. Returns whether there are any such cells.
    pub(crate) fn look(&mut self, boundary: impl Iterator<Item = [[f64; 2]; 2]>) -> bool {
        self.by_cells = true;
        self.open = [0; SIDE as usize];
        // Open all cells that the boundary's pieces touch, row by row.
        for [a, b] in boundary {
            let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
            let (first, last) = (cell(a[0] - ROOM), cell(b[0] + ROOM));
            let slope = (b[1] - a[1]) / (b[0] - a[0]);
            let (least, most) = (lesser(a[1], b[1]), greater(a[1], b[1]));
            for r in first..=last {
                let (mut low, mut high) = (least, most);
                if first < last {
                    let ends = [place(r) - ROOM, place(r + 1) + ROOM];
                    let [x, y] = ends.map(|p| a[1] + slope * (p - a[0]));
                    low = greater(least, lesser(x, y));
                    high = lesser(most, greater(x, y));
                }
                self.open[usize::from(r)] |= bits(cell(low - ROOM), cell(high + ROOM));
            }
        }
        // Close those that are complete already.
        let mut any = 0;
        for (open, complete) in self.open.iter_mut().zip(&mut self.complete) {
            *open &= !*complete;
            *complete |= *open;
            any |= *open;
        }
        any != 0
    }
}

/// Buffers for the search for triangles in front.
#[derive(Debug, Default)]
pub(crate) struct FrontScratch {
    pub(crate) front: Front,
    /// The nodes and leaves still to visit.
    waiting: Waiting<Image>,
}

/// A light as the cover of a walk. In the `FIRST` walk, triangles hide samples.
struct OfLight<'a, const FIRST: bool>(&'a mut Front);

impl<S: Simd, const FIRST: bool> Cover<S> for OfLight<'_, FIRST> {
    type Image = Image;
    const SEPARATE: bool = true;

    #[inline(always)]
    fn needs(&self, _: S, image: &Image) -> bool {
        self.0.needs(image)
    }

    #[inline(always)]
    fn needs_any(&self, _: S, among: u8, images: &Images) -> u8 {
        self.0.needs_any(among, images)
    }

    #[inline(always)]
    fn record(&mut self, _: S, flat: &mut FlatTriangles, first: usize) -> bool {
        if FIRST {
            for i in first..flat.count {
                self.0.hide(&flat.get(i));
            }
        }
        true
    }
}

/// Walks a dense shaft from front to back and stores projections of triangles in `seen.flat`: in
/// the `FIRST` walk those of the triangles in front of `seen.light`, in later walks those of the
/// triangles that touch open cells, in addition to the projections stored before. If a triangle
/// hides the whole light, one projection that covers everything is stored. Returns false if there
/// are no [bounds](crate::shaft::bounds::ShaftBounds::new).
#[inline(always)]
fn front_kernel<S: Simd, const FIRST: bool>(
    s: S,
    bvh: &Bvh,
    exclude: (u32, u32),
    seen: &mut ShaftState,
    scratch: &mut FrontScratch,
    counters: &mut Counters,
) -> bool {
    let Some(mut look) = seen.look(s, bvh, exclude, None) else {
        return false;
    };
    let FrontScratch { front, waiting } = scratch;
    // Walk from front to back.
    let surfaces = Some(&bvh.hierarchy.surfaces).filter(|_| front.loose);
    if FIRST {
        look.flat.clear();
        front.start(look.frame);
    }
    let known = look.flat.count;
    wait_for_root(waiting, Image::ALL);
    let mut cover = OfLight::<FIRST>(front);
    // If a single triangle hides the whole light, nothing else matters.
    if !front_to_back(s, bvh, &mut look, &mut cover, surfaces, waiting, counters) {
        look.flat.hide_all();
        counters.candidates += 1;
        return true;
    }
    if FIRST {
        front.finish();
    }
    counters.candidates += (look.flat.count - known) as u64;
    true
}

dispatch! {
    /// [`front_kernel`] on an instruction set.
    pub(crate) fn front<const FIRST: bool> = front_kernel(bvh: &Bvh, exclude: (u32, u32), seen: &mut ShaftState, scratch: &mut FrontScratch, counters: &mut Counters) -> bool
}
