//! From hidden intervals in no order to visible ones in order, eight lines at a time.

use crate::{VisibleLines, simd::Simd, sweep::Lines};
use linelit_geometry::intervals::Interval;

/// Hidden intervals that a line keeps before they spill.
const ROOM: usize = 23;

/// Up to this many intervals a line are sorted by a network over the lanes.
const NETWORK: usize = 8;

/// Visible pieces shorter than this fraction of their line are rounding errors.
const LEAST_PIECE: f64 = 1e-14;

/// Hidden intervals of eight lines that did not join their line's running interval.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct SlotBlock {
    lo: [[f64; 8]; ROOM + 1],
    hi: [[f64; 8]; ROOM + 1],
    /// How many each line has: a small integer.
    count: [f64; 8],
}

const EMPTY: SlotBlock = SlotBlock {
    lo: [[0.0; 8]; ROOM + 1],
    hi: [[0.0; 8]; ROOM + 1],
    count: [0.0; 8],
};

/// Hidden intervals of each line.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    blocks: Vec<SlotBlock>,
    /// What found no room: line and interval.
    spilled: Vec<(usize, f64, f64)>,
    sorted: Vec<(f64, f64)>,
}

impl Slots {
    pub(crate) fn reset(&mut self, lines: usize) {
        let blocks = lines.div_ceil(8);
        if self.blocks.len() < blocks {
            self.blocks.resize(blocks, EMPTY);
        }
        for block in &mut self.blocks[..blocks] {
            block.count = [0.0; 8];
        }
        self.spilled.clear();
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, block: usize, lane: usize, lo: f64, hi: f64) {
        let slots = &mut self.blocks[block];
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small integer"
        )]
        let count = slots.count[lane] as usize;
        if count < ROOM {
            slots.lo[count][lane] = lo;
            slots.hi[count][lane] = hi;
            slots.count[lane] += 1.0;
        } else {
            self.make_room(block, lane, lo, hi);
        }
    }

    /// Unites a full line's intervals; if that does not make room, they spill.
    #[cold]
    fn make_room(&mut self, block: usize, lane: usize, lo: f64, hi: f64) {
        let mut row: [(f64, f64); ROOM] = std::array::from_fn(|k| {
            (
                self.blocks[block].lo[k][lane],
                self.blocks[block].hi[k][lane],
            )
        });
        row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept = 0;
        for i in 1..ROOM {
            if row[i].0 <= row[kept].1 {
                row[kept].1 = row[kept].1.max(row[i].1);
            } else {
                kept += 1;
                row[kept] = row[i];
            }
        }
        kept += 1;
        if kept > ROOM / 2 {
            let line = block * 8 + lane;
            self.spilled
                .extend(row[..kept].iter().map(|i| (line, i.0, i.1)));
            kept = 0;
        }
        row[kept] = (lo, hi);
        let slots = &mut self.blocks[block];
        slots.count[lane] = 0.0;
        for (k, i) in row[..=kept].iter().enumerate() {
            slots.lo[k][lane] = i.0;
            slots.hi[k][lane] = i.1;
            slots.count[lane] += 1.0;
        }
    }

    /// All hidden intervals of a line in order of their lower ends.
    fn sort_line(&mut self, block: usize, lane: usize, run: (f64, f64)) {
        let slots = &self.blocks[block];
        let line = block * 8 + lane;
        self.sorted.clear();
        let mine = self.spilled.iter().filter(|s| s.0 == line);
        self.sorted.extend(mine.map(|s| (s.1, s.2)));
        for k in 0..ROOM {
            #[allow(clippy::cast_precision_loss, reason = "a small integer")]
            if (k as f64) < slots.count[lane] {
                self.sorted.push((slots.lo[k][lane], slots.hi[k][lane]));
            }
        }
        self.sorted.push(run);
        self.sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    }
}

/// The visible pieces of eight lines as they are found, in parameters that ascend.
pub(crate) struct Pieces {
    found: Vec<[Interval; 8]>,
    count: [usize; 8],
}

impl Default for Pieces {
    fn default() -> Self {
        Self {
            found: vec![[Interval::UNIT; 8]; ROOM + 2],
            count: [0; 8],
        }
    }
}

impl std::fmt::Debug for Pieces {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pieces")
            .field("count", &self.count)
            .finish_non_exhaustive()
    }
}

impl Pieces {
    #[inline(always)]
    fn push(&mut self, lane: usize, t0: f64, t1: f64) {
        let row = self.count[lane];
        if row >= self.found.len() {
            self.found.push([Interval::UNIT; 8]);
        }
        self.found[row][lane] = Interval::new(t0, t1);
        self.count[lane] = row + 1;
    }
}

/// Finds the visible pieces of the lines of one block.
#[inline(always)]
fn finish_block<S: Simd>(s: S, block: usize, lines: &Lines, slots: &mut Slots, out: &mut Pieces) {
    out.count = [0; 8];
    let most = slots.blocks[block]
        .count
        .iter()
        .copied()
        .fold(0.0, f64::max);
    #[allow(clippy::cast_precision_loss, reason = "a small integer")]
    if most >= NETWORK as f64 || !slots.spilled.is_empty() {
        for lane in 0..8 {
            let run = (lines.run_lo[block][lane], lines.run_hi[block][lane]);
            slots.sort_line(block, lane, run);
            let span = (lines.from[block][lane], lines.to[block][lane]);
            sweep_sorted(&slots.sorted, span, lane, out);
        }
        return;
    }
    let slots = &slots.blocks[block];
    let infinite = s.dsplat(f64::INFINITY);
    let mut lo = [infinite; NETWORK];
    let mut hi = [infinite; NETWORK];
    lo[0] = s.dload(&lines.run_lo[block]);
    hi[0] = s.dload(&lines.run_hi[block]);
    let counts = s.dload(&slots.count);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small integer"
    )]
    let used = most as usize + 1;
    for k in 1..used {
        #[allow(clippy::cast_precision_loss, reason = "a small integer")]
        let present = s.dle(s.dsplat(k as f64), counts);
        lo[k] = s.select(present, infinite, s.dload(&slots.lo[k - 1]));
        hi[k] = s.dload(&slots.hi[k - 1]);
    }
    sort_lanes(s, &mut lo, &mut hi, used);
    let from = s.dload(&lines.from[block]);
    let to = s.dload(&lines.to[block]);
    let scale = s.ddiv(s.dsplat(1.0), s.dsub(to, from));
    let mut edge = from;
    for k in 0..used {
        // What starts beyond the line's end, or nowhere, hides nothing.
        let there = s.dlt(lo[k], to);
        emit(s, there, (edge, lo[k]), from, scale, out);
        edge = s.select(there, edge, s.dmax(edge, hi[k]));
    }
    emit(s, s.dlt(edge, to), (edge, to), from, scale, out);
}

/// Adds the pieces from `edge` to `end` where that is not empty, in the lanes of `on`.
#[inline(always)]
fn emit<S: Simd>(
    s: S,
    on: S::M,
    (edge, end): (S::D, S::D),
    from: S::D,
    scale: S::D,
    out: &mut Pieces,
) {
    let t0 = s.dmul(s.dsub(edge, from), scale);
    let t1 = s.dmin(s.dmul(s.dsub(end, from), scale), s.dsplat(1.0));
    let mut found = s.bits(s.and(on, s.dle(s.dsplat(LEAST_PIECE), s.dsub(t1, t0))));
    if found == 0 {
        return;
    }
    let (mut t0s, mut t1s) = ([0.0; 8], [0.0; 8]);
    s.dstore(t0, &mut t0s);
    s.dstore(t1, &mut t1s);
    while found != 0 {
        let lane = found.trailing_zeros() as usize;
        found &= found - 1;
        out.push(lane, t0s[lane], t1s[lane]);
    }
}

/// Sorts up to eight intervals a lane by their lower ends: Batcher's network, as far as needed.
#[inline(always)]
fn sort_lanes<S: Simd>(s: S, lo: &mut [S::D; NETWORK], hi: &mut [S::D; NETWORK], used: usize) {
    const PAIRS: [(usize, usize); 19] = [
        (0, 1),
        (2, 3),
        (0, 2),
        (1, 3),
        (1, 2),
        (4, 5),
        (6, 7),
        (4, 6),
        (5, 7),
        (5, 6),
        (0, 4),
        (1, 5),
        (2, 6),
        (3, 7),
        (2, 4),
        (3, 5),
        (1, 2),
        (3, 4),
        (5, 6),
    ];
    // The first five pairs alone sort four.
    let pairs = match used {
        0 | 1 => 0,
        2 => 1,
        3 | 4 => 5,
        _ => PAIRS.len(),
    };
    for &(i, j) in &PAIRS[..pairs] {
        let swap = s.dlt(lo[j], lo[i]);
        let (hi_i, hi_j) = (hi[i], hi[j]);
        let (lo_i, lo_j) = (lo[i], lo[j]);
        lo[i] = s.select(swap, lo_i, lo_j);
        lo[j] = s.select(swap, lo_j, lo_i);
        hi[i] = s.select(swap, hi_i, hi_j);
        hi[j] = s.select(swap, hi_j, hi_i);
    }
}

/// The same for one line whose intervals are sorted.
fn sweep_sorted(hidden: &[(f64, f64)], (from, to): (f64, f64), lane: usize, out: &mut Pieces) {
    let scale = 1.0 / (to - from);
    let mut edge = from;
    let mut push = |edge: f64, end: f64| {
        let (t0, t1) = ((edge - from) * scale, ((end - from) * scale).min(1.0));
        if t1 - t0 >= LEAST_PIECE {
            out.push(lane, t0, t1);
        }
    };
    for &(lo, hi) in hidden {
        if lo >= to {
            break;
        }
        push(edge, lo);
        edge = edge.max(hi);
    }
    if edge < to {
        push(edge, to);
    }
}

/// Merges what is hidden of each line and hands the rest out in the caller's order.
#[inline(always)]
pub(crate) fn finish<S: Simd>(
    s: S,
    lines: &Lines,
    slots: &mut Slots,
    pieces: &mut Pieces,
    out: &mut VisibleLines,
) {
    for block in 0..lines.u.len() {
        finish_block(s, block, lines, slots, pieces);
        let first = block * 8;
        let last = lines.number.len().min(first + 8);
        for lane in 0..last - first {
            let count = pieces.count[lane];
            let number = lines.number[first + lane] as usize;
            if !(lines.from[block][lane] < lines.to[block][lane]) {
                out.put(number, &mut std::iter::once(Interval::UNIT));
            } else if lines.reversed[first + lane] {
                let rows = pieces.found[..count].iter().rev();
                out.put(
                    number,
                    &mut rows.map(|r| Interval::new(1.0 - r[lane].hi, 1.0 - r[lane].lo)),
                );
            } else {
                out.put(number, &mut pieces.found[..count].iter().map(|r| r[lane]));
            }
        }
    }
}
