//! Dense shafts for closed forms: the triangles in front, of which all that is visible follows.
//!
//! One walk from front to back for the whole light keeps triangles, and marks which of 64 × 64
//! samples of the light they hide. A box or triangle whose image touches only cells of which all
//! four corners are hidden is skipped. That is a guess: between its corners, a cell may be visible
//! in part, and what was skipped may hide that. So whoever finds the boundary of what is visible
//! past the triangles kept asks [`Front::look`] whether it touches cells that were not open until
//! the end. All triangles that touch those are kept by another walk, and so on, until all of the
//! boundary lies in cells of which every triangle is known: then no other can change it.
//! `docs/decisions/016-exact-in-dense-shafts.md`.

use crate::{
    Occluders, Scratch,
    bounds::{self, ShaftBounds},
    closed_mesh::BackfaceFilter,
    frame::{Light, LightFrame},
    node::{self, Child, Leaf, Node},
    project,
    surfaces::NONE,
    sweep::Lanes,
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};

/// Samples along each axis of the light.
const SIDE: u8 = 64;

/// The last of them is at the light's far side.
const LAST: u8 = SIDE - 1;

/// What rounding may move, in units of the light, with a lot of room: a sample this close to a side
/// of a triangle is not hidden by it, and a boundary touches cells this far from it.
pub(crate) const ROOM: f64 = 1e-9;

/// Samples or cells: rows along p, bits along q.
type Grid = [u64; SIDE as usize];

/// What is known of the cells between the samples of a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Front {
    /// In the first walk, a bit for each sample that is not known to be hidden; later, for each
    /// cell whose triangles are looked for.
    open: Grid,
    /// A bit for each cell of which all triangles are kept, but for those that are not needed
    /// wherever they are.
    complete: Grid,
    /// Whether `open` are cells.
    by_cells: bool,
    /// Whether triangles of surfaces are left out.
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

/// The samples around the cells that an image touches: first and last row, first and last bit.
#[derive(Clone, Copy, Debug)]
struct Image {
    rows: [u8; 2],
    bits: [u8; 2],
}

impl Image {
    /// Everywhere.
    const ALL: Self = Self {
        rows: [0, LAST],
        bits: [0, LAST],
    };
}

/// A node or leaf still to visit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    child: Child,
    image: Image,
}

/// The images of eight boxes or triangles.
struct Images {
    first: [Lanes<[f32; 8]>; 2],
    last: [Lanes<[f32; 8]>; 2],
}

impl Images {
    /// From bounds of p and of q.
    #[inline(always)]
    fn new<S: Simd>(s: S, low: [S::F; 2], high: [S::F; 2]) -> Self {
        let mut images = Self {
            first: [Lanes([0.0; 8]); 2],
            last: [Lanes([0.0; 8]); 2],
        };
        // Adding 2²³ rounds to an integer; half below is at most one too low for a whole number,
        // half above is the sample beyond.
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
    fn get(&self, lane: usize) -> Image {
        #[allow(clippy::cast_possible_truncation, reason = "below SIDE")]
        let number = |x: f32| (x.to_bits() & 0xff) as u8;
        let pair = |k: usize| [number(self.first[k][lane]), number(self.last[k][lane])];
        Image {
            rows: pair(0),
            bits: pair(1),
        }
    }
}

/// The bits from first to last; at least the first.
#[inline(always)]
fn bits(first: u8, last: u8) -> u64 {
    (u64::MAX << first) & (u64::MAX >> (LAST - last.max(first)))
}

#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The first and the last sample between two places, if there is any.
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

/// The number of the cell that holds a place; the nearest for what is beyond them.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn cell(x: f64) -> u8 {
    lesser(greater(x * f64::from(LAST), 0.0), f64::from(LAST - 1)) as u8
}

/// Where a sample is along an axis.
#[inline(always)]
fn place(sample: u8) -> f64 {
    f64::from(sample) / f64::from(LAST)
}

/// The least and the greatest q of a convex polygon between two values of p.
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
    /// Nothing hidden but what is beyond the light.
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

    /// Whether what has this image touches anything that is open.
    #[inline(always)]
    fn needs(&self, image: &Image) -> bool {
        // A cell has the number of its first sample.
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

    /// Which of eight images, `among` which it is asked, touch anything that is open.
    #[inline(always)]
    pub(crate) fn needs_any<S: Simd>(
        &self,
        s: S,
        among: u8,
        low: [S::F; 2],
        high: [S::F; 2],
    ) -> u8 {
        let images = Images::new(s, low, high);
        let (mut left, mut needed) = (among, 0);
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            needed |= u8::from(self.needs(&images.get(lane))) << lane;
        }
        needed
    }

    /// Whether the rectangle around a side touches cells that are open.
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

    /// From here on, what is asked of are the cells of which all triangles are known.
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
        // Most are too small to have any between their bounds.
        if range(1).is_some()
            && let Some((first, last)) = range(0)
        {
            self.hide_rows(triangle, first..=last);
        }
    }

    #[inline(never)]
    fn hide_rows(&mut self, triangle: &[[f64; 2]; 3], rows: std::ops::RangeInclusive<u8>) {
        for r in rows {
            let open = &mut self.open[usize::from(r)];
            if *open == 0 {
                continue;
            }
            let p = place(r);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                if (a[0] <= p) != (b[0] <= p) {
                    let q = a[1] + (b[1] - a[1]) * ((p - a[0]) / (b[0] - a[0]));
                    (low, high) = (lesser(low, q), greater(high, q));
                }
            }
            if let Some((first, last)) = samples_between(low + ROOM, high - ROOM) {
                *open &= !bits(first, last);
            }
        }
    }

    /// After the first walk: cells with an open corner are complete.
    fn finish(&mut self) {
        for r in 0..usize::from(LAST) {
            let open = self.open[r] | self.open[r + 1];
            self.complete[r] = open | open >> 1;
        }
        self.complete[usize::from(LAST)] = 0;
    }

    /// Whether a boundary touches cells of which triangles may be missing; these are open then.
    pub(crate) fn look(&mut self, boundary: impl Iterator<Item = [[f64; 2]; 2]>) -> bool {
        self.by_cells = true;
        self.open = [0; SIDE as usize];
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
        let mut any = 0;
        for (open, complete) in self.open.iter_mut().zip(&mut self.complete) {
            *open &= !*complete;
            *complete |= *open;
            any |= *open;
        }
        any != 0
    }
}

/// Puts those boxes of a node, among some, that are needed on the stack, the nearest on top, and
/// tells which they are.
#[inline(always)]
fn push_boxes<S: Simd>(
    s: S,
    bounds: &ShaftBounds,
    node: &Node,
    mut found: u8,
    front: &Front,
    stack: &mut Vec<Waiting>,
) -> u8 {
    let (least, most) = bounds.extents(s, node);
    let [low, high] = ShaftBounds::images(s, &least, &most);
    let images = Images::new(s, low, high);
    let before = s.lt(s.splat(1e-6), least[2]);
    let mut needed = 0;
    while found != 0 {
        let lane = found.trailing_zeros() as usize;
        found &= found - 1;
        let is_needed = before >> lane & 1 == 0 || front.needs(&images.get(lane));
        needed |= u8::from(is_needed) << lane;
    }
    for lane in node::deepest_first(s, least[2], needed) {
        let image = if before >> lane & 1 != 0 {
            images.get(lane)
        } else {
            Image::ALL
        };
        stack.push(Waiting {
            child: Child(node.child[lane]),
            image,
        });
    }
    needed
}

/// The triangles of a leaf that are needed.
#[inline(always)]
fn needed<S: Simd>(s: S, bounds: &ShaftBounds, leaf: &Leaf, mask: u8, front: &Front) -> u8 {
    let vertices = bounds.vertices(s, leaf);
    let (before, inside, low, high) = bounds.triangle_images(s, &vertices);
    let images = Images::new(s, low, high);
    let mut maybe = before & inside & mask;
    let mut needed = 0;
    while maybe != 0 {
        let lane = maybe.trailing_zeros() as usize;
        maybe &= maybe - 1;
        needed |= u8::from(front.needs(&images.get(lane))) << lane;
    }
    let behind = mask & !before;
    if behind != 0 {
        needed |= behind & bounds.within(s, &vertices);
    }
    needed & bounds.included(s, leaf)
}

/// A point of the world and a box around a light, in the coordinates of the hierarchy, and the
/// bounds of the shaft between both, if there are.
#[inline(always)]
pub(crate) fn towards<S: Simd>(
    s: S,
    occluders: &Occluders,
    point: DVec3,
    exclude: (u32, u32),
    light: &Light,
    frame: &mut LightFrame,
) -> Option<(DVec3, [DVec3; 2], ShaftBounds)> {
    let point = point - occluders.origin;
    let around = [light.lo - occluders.origin, light.hi - occluders.origin];
    let bounds = ShaftBounds::new(s, occluders, point, around, frame, exclude)?;
    frame.set_near(bounds::reach(occluders, point));
    Some((point, around, bounds))
}

/// Keeps the triangles in front of `scratch.light` seen from a point of the world, or, unless it is
/// the `FIRST` walk, those of the open cells as well: their images are in `scratch.flat`, one that
/// hides all if there is such. False if there are no [bounds](ShaftBounds::new).
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn front_kernel<S: Simd, const FIRST: bool>(
    s: S,
    occluders: &Occluders,
    &point: &DVec3,
    exclude: (u32, u32),
    scratch: &mut Scratch,
) -> bool {
    let Scratch {
        light,
        frame,
        counters,
        corners,
        flat,
        clear_of,
        front_waiting: stack,
        front,
        ..
    } = scratch;
    corners.clear();
    let hierarchy = &*occluders.hierarchy;
    let Some((point, around, bounds)) = towards(s, occluders, point, exclude, light, frame) else {
        return false;
    };
    let frame = &*frame;
    let margins = frame.margins;
    let backfaces = &mut BackfaceFilter::new(
        hierarchy.meshes(),
        clear_of,
        point,
        around,
        margins,
        exclude,
    );
    let surfaces = Some(&hierarchy.surfaces).filter(|_| front.loose);
    if FIRST {
        flat.clear();
        front.start(frame);
    }
    let known = flat.count;
    stack.clear();
    stack.push(Waiting {
        child: Child::node(0),
        image: Image::ALL,
    });
    loop {
        let next = stack.pop();
        if let Some(next) = &next {
            if !front.needs(&next.image) {
                continue;
            }
            let at = next.child.index();
            if next.child.is_leaf() {
                counters.triangle_tests += u64::from(next.child.count());
                let leaf = &hierarchy.leaves[at];
                let mut mask = next.child.mask();
                if let Some(surfaces) = surfaces {
                    mask &= s.in_range(&surfaces.sides[at][0], NONE, 1);
                }
                let needed = needed(s, &bounds, leaf, mask, front);
                if needed != 0 {
                    let codes = backfaces.codes(at);
                    let meshes = backfaces.any().then_some(&codes);
                    corners.add(s, leaf, needed, &next.child.slots(), meshes);
                }
            } else {
                let node = &hierarchy.nodes[at];
                counters.node_tests += u64::from(node.valid.count_ones());
                let mut found = bounds.boxes(s, node);
                if surfaces.is_some() {
                    found &= !node.all_fine;
                }
                let needed = push_boxes(s, &bounds, node, found, front, stack);
                hierarchy.prefetch(s, node, needed);
            }
        }
        // Eight triangles at a time, and what is left at the end.
        while corners.count >= 8 || (next.is_none() && corners.count > 0) {
            let first = corners.count.saturating_sub(8);
            let before = flat.count;
            let left =
                project::project_some::<S, true>(s, corners, first, point, frame, flat, backfaces);
            corners.count = first;
            if left.is_none() {
                flat.hide_all();
                counters.candidates += 1;
                return true;
            }
            if FIRST {
                for i in before..flat.count {
                    front.hide(&flat.get(i));
                }
            }
        }
        if next.is_none() {
            break;
        }
    }
    if FIRST {
        front.finish();
    }
    counters.candidates += (flat.count - known) as u64;
    true
}

dispatch! {
    /// Keeps the triangles in front, or those of open cells, on an instruction set.
    pub(crate) fn front<const FIRST: bool> = front_kernel(occluders: &Occluders, point: &DVec3, exclude: (u32, u32), scratch: &mut Scratch) -> bool
}
