//! The last step of visibility along lines: hidden intervals in any order are sorted and merged,
//! eight lines at a time, and what is left between them is the visible part.
//!
//! While triangles are swept, each line has one *running* interval in registers, which grows as
//! long as new intervals touch it; an interval that does not touch it replaces it, and the old one
//! moves to the line's *slots*. Most lines have few slots, which a sorting network orders in all
//! eight lanes at once. Lines with too many *spill* into a list and are sorted one by one.

use crate::{
    lanes::Lanes,
    lines::VisibleLines,
    shaft::block::{LineBlock, Lines},
};
use linelit_simd::Simd;

/// The number of hidden intervals that the slots of a line hold before they spill into a list.
const ROOM: usize = 23;

/// The largest number of intervals per line that a network over the lanes sorts: the slots and the
/// running interval.
const NETWORK: usize = ROOM + 1;

/// The length, as a fraction of the line, below which a visible piece is taken for a rounding error
/// and dropped.
const LEAST_PIECE: f64 = 1e-14;

/// The slots of eight lines: hidden intervals that did not touch their line's running interval.
#[derive(Clone, Debug, Default)]
#[repr(C, align(64))]
struct SlotBlock {
    lo: [[f64; 8]; ROOM + 1],
    hi: [[f64; 8]; ROOM + 1],
    /// For each line, the number of its slots in use.
    count: [u32; 8],
}

/// The hidden intervals of all lines of a sweep.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    blocks: Vec<SlotBlock>,
    /// The intervals that spilled from the slots, each with the index of its line.
    spilled: Vec<(usize, f64, f64)>,
    sorted: Vec<(f64, f64)>,
}

impl Slots {
    /// Starts over with this number of lines, none of which has hidden intervals.
    pub(crate) fn reset(&mut self, lines: usize) {
        let blocks = lines.div_ceil(8);
        if self.blocks.len() < blocks {
            self.blocks.resize(blocks, SlotBlock::default());
        }
        for block in &mut self.blocks[..blocks] {
            block.count = [0; 8];
        }
        self.spilled.clear();
    }

    /// Returns the number of slots in use for each line of a block.
    #[inline(always)]
    pub(crate) fn counts(&self, block: usize) -> &[u32; 8] {
        &self.blocks[block].count
    }

    /// Returns the interval in slot `row` of each line of a block; an empty interval (from one to
    /// zero) for lines with fewer slots in use.
    #[inline(always)]
    pub(crate) fn row<S: Simd>(&self, s: S, block: usize, row: u32) -> [S::D; 2] {
        let slots = &self.blocks[block];
        let mut none = [0.0; 8];
        for (none, count) in none.iter_mut().zip(&slots.count) {
            *none = f64::from(u8::from(*count <= row));
        }
        let is_some = s.dlt(s.dload(&none), s.dsplat(0.5));
        let row = row as usize;
        let [low, high] = [&slots.lo, &slots.hi].map(|all| s.dload(&all[row]));
        let (one, zero) = (s.dsplat(1.0), s.dsplat(0.0));
        [s.select(is_some, one, low), s.select(is_some, zero, high)]
    }

    /// Stores an interval for a line.
    #[inline(always)]
    pub(crate) fn push(&mut self, block: usize, lane: usize, lo: f64, hi: f64) {
        let count = self.blocks[block].count[lane] as usize;
        let slots = &mut self.blocks[block];
        if count < ROOM {
            slots.lo[count][lane] = lo;
            slots.hi[count][lane] = hi;
            slots.count[lane] += 1;
        } else {
            self.make_room(block, lane, lo, hi);
        }
    }

    /// Stores the intervals of the lines in the mask `lanes`.
    #[inline(always)]
    pub(crate) fn push_lanes<S: Simd>(
        &mut self,
        s: S,
        block: usize,
        lanes: u8,
        lo: S::D,
        hi: S::D,
    ) {
        let (mut los, mut his) = (Lanes([0.0; 8]), Lanes([0.0; 8]));
        s.dstore(lo, &mut los);
        s.dstore(hi, &mut his);
        let mut lanes = lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            self.push(block, lane, los[lane], his[lane]);
        }
    }

    /// Merges the intervals of a line whose slots are full, and stores one more; if merging leaves
    /// more than half of the slots full, they spill.
    #[cold]
    fn make_room(&mut self, block: usize, lane: usize, lo: f64, hi: f64) {
        let mut row: [(f64, f64); ROOM] = std::array::from_fn(|k| {
            (
                self.blocks[block].lo[k][lane],
                self.blocks[block].hi[k][lane],
            )
        });
        // Merge intervals that overlap or touch.
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
        // Spill if more than half are left.
        if kept > ROOM / 2 {
            let line = block * 8 + lane;
            self.spilled
                .extend(row[..kept].iter().map(|i| (line, i.0, i.1)));
            kept = 0;
        }
        // Store the others, and the new interval.
        row[kept] = (lo, hi);
        let slots = &mut self.blocks[block];
        slots.count[lane] = 0;
        for (k, i) in row[..=kept].iter().enumerate() {
            slots.lo[k][lane] = i.0;
            slots.hi[k][lane] = i.1;
            slots.count[lane] += 1;
        }
    }

    /// Returns the largest number of slots in use over the lines of a block.
    #[inline(always)]
    pub(crate) fn most(&self, block: usize) -> usize {
        let mut most = 0;
        for &count in &self.blocks[block].count {
            most = most.max(count);
        }
        most as usize
    }

    /// Merges intervals of a block's lines that overlap or touch, the running intervals included.
    #[inline(always)]
    pub(crate) fn unite<S: Simd>(&mut self, s: S, index: usize, block: &mut LineBlock) {
        let used = self.most(index) + 1;
        let infinite = s.dsplat(f64::INFINITY);
        let mut lo = [infinite; NETWORK];
        let mut hi = lo;
        load_sorted(s, used, block, &self.blocks[index], &mut lo, &mut hi);
        self.blocks[index].count = [0; 8];
        let (mut run_lo, mut run_hi) = (lo[0], hi[0]);
        for k in 1..used {
            // An empty interval starts at infinity; the running interval of a line may be empty,
            // too.
            let there = s.dlt(lo[k], infinite);
            let joins = s.dle(lo[k], run_hi);
            let disjoint = there & (!joins);
            let longer = s.dmax(hi[k], run_hi);
            let (old_lo, old_hi) = (run_lo, run_hi);
            run_hi = s.select(there & joins, run_hi, longer);
            run_hi = s.select(disjoint, run_hi, hi[k]);
            run_lo = s.select(disjoint, run_lo, lo[k]);
            let disjoint = s.bits(disjoint);
            if disjoint != 0 {
                self.push_lanes(s, index, disjoint, old_lo, old_hi);
            }
        }
        s.dstore(run_lo, &mut block.run_lo);
        s.dstore(run_hi, &mut block.run_hi);
    }

    /// Returns the hidden intervals of a line in ascending order of their lower ends.
    pub(crate) fn sorted(&mut self, block: usize, lane: usize, run: (f64, f64)) -> &[(f64, f64)] {
        let slots = &self.blocks[block];
        let line = block * 8 + lane;
        self.sorted.clear();
        let mine = self.spilled.iter().filter(|s| s.0 == line);
        self.sorted.extend(mine.map(|s| (s.1, s.2)));
        for k in 0..slots.count[lane] as usize {
            self.sorted.push((slots.lo[k][lane], slots.hi[k][lane]));
        }
        self.sorted.push(run);
        self.sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        &self.sorted
    }
}

/// The visible pieces of eight lines, as parameters of the lines, which ascend from row to row.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    rows: Vec<PieceRow>,
    used: usize,
}

/// One piece of each line, if the line has one in this row.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct PieceRow {
    lo: [f64; 8],
    hi: [f64; 8],
    /// A bit for each line that has a piece in this row.
    found: u8,
}

impl Pieces {
    fn clear(&mut self) {
        self.used = 0;
        if self.rows.len() < NETWORK + 1 {
            self.rows.resize(NETWORK + 1, PieceRow::default());
        }
    }

    /// Adds a piece to one line; `row` is the number of pieces that the line has so far.
    fn push(&mut self, row: usize, lane: usize, piece: (f64, f64)) {
        if row == self.used {
            if row == self.rows.len() {
                self.rows.push(PieceRow::default());
            }
            self.rows[row].found = 0;
            self.used += 1;
        }
        let row = &mut self.rows[row];
        (row.lo[lane], row.hi[lane]) = piece;
        row.found |= 1 << lane;
    }
}

/// Finds the visible pieces of the lines of one block.
#[inline(always)]
fn finish_block<S: Simd>(
    s: S,
    index: usize,
    block: &LineBlock,
    slots: &mut Slots,
    out: &mut Pieces,
) {
    out.clear();
    // Lines that spilled are sorted one by one.
    if !slots.spilled.is_empty() {
        for lane in 0..8 {
            let hidden = slots.sorted(index, lane, (block.run_lo[lane], block.run_hi[lane]));
            sweep_sorted(hidden, (block.from[lane], block.to[lane]), lane, out);
        }
        return;
    }
    // Others are sorted in lanes, in an array that is just large enough.
    let used = slots.most(index) + 1;
    let slots = &slots.blocks[index];
    match used {
        0..=4 => finish_few::<S, 4>(s, used, block, slots, out),
        5..=8 => finish_few::<S, 8>(s, used, block, slots, out),
        _ => finish_few::<S, NETWORK>(s, used, block, slots, out),
    }
}

/// Sorts up to `MOST` intervals per line in lanes, and finds the pieces between them.
#[inline(always)]
fn finish_few<S: Simd, const MOST: usize>(
    s: S,
    used: usize,
    block: &LineBlock,
    slots: &SlotBlock,
    out: &mut Pieces,
) {
    let mut lo = [s.dsplat(f64::INFINITY); MOST];
    let mut hi = lo;
    load_sorted(s, used, block, slots, &mut lo, &mut hi);
    let from = s.dload(&block.from);
    let to = s.dload(&block.to);
    let scale = s.dsplat(1.0) / (to - from);
    // Go through the intervals in order; `edge` is the end of what is hidden so far.
    let mut edge = from;
    for k in 0..used {
        // An interval that starts beyond the line's end, or is empty, hides nothing.
        let there = s.dlt(lo[k], to);
        let end = s.dmin((lo[k] - from) * scale, s.dsplat(1.0));
        emit(s, there, (edge - from) * scale, end, out);
        edge = s.select(there, edge, s.dmax(edge, hi[k]));
    }
    // The last piece ends at exactly one, whatever the line's length rounds to.
    let start = (edge - from) * scale;
    emit(s, s.dlt(edge, to), start, s.dsplat(1.0), out);
}

/// Loads the hidden intervals of eight lines in ascending order of their lower ends, with empty
/// intervals last. `lo` has to be infinite when the function is called.
#[inline(always)]
fn load_sorted<S: Simd, const MOST: usize>(
    s: S,
    used: usize,
    block: &LineBlock,
    slots: &SlotBlock,
    lo: &mut [S::D; MOST],
    hi: &mut [S::D; MOST],
) {
    let infinite = s.dsplat(f64::INFINITY);
    lo[0] = s.dload(&block.run_lo);
    hi[0] = s.dload(&block.run_hi);
    let mut counts = [0.0; 8];
    for (count, whole) in counts.iter_mut().zip(&slots.count) {
        *count = f64::from(*whole);
    }
    let counts = s.dload(&counts);
    for k in 1..used {
        #[allow(clippy::cast_precision_loss, reason = "a small integer")]
        let present = s.dle(s.dsplat(k as f64), counts);
        lo[k] = s.select(present, infinite, s.dload(&slots.lo[k - 1]));
        hi[k] = s.dload(&slots.hi[k - 1]);
    }
    sort_lanes(s, lo, hi, used);
}

/// Adds a visible piece from `t0` to `t1` to each line in the mask `on`, where the piece is long
/// enough ([`LEAST_PIECE`]).
#[inline(always)]
fn emit<S: Simd>(s: S, on: S::M, t0: S::D, t1: S::D, out: &mut Pieces) {
    let found = s.bits(on & s.dle(s.dsplat(LEAST_PIECE), t1 - t0));
    if found == 0 {
        return;
    }
    let row = &mut out.rows[out.used];
    s.dstore(t0, &mut row.lo);
    s.dstore(t1, &mut row.hi);
    row.found = found;
    out.used += 1;
}

/// Sorts the intervals of each lane by their lower ends, with the smallest available network.
#[inline(always)]
fn sort_lanes<S: Simd, const MOST: usize>(
    s: S,
    lo: &mut [S::D; MOST],
    hi: &mut [S::D; MOST],
    used: usize,
) {
    const TWO: [(usize, usize); 1] = network(2);
    const FOUR: [(usize, usize); 5] = network(4);
    const EIGHT: [(usize, usize); 19] = network(8);
    const TWELVE: [(usize, usize); 42] = network(12);
    const SIXTEEN: [(usize, usize); 63] = network(16);
    const ALL: [(usize, usize); 132] = network(NETWORK);
    // Choose the network.
    let pairs: &[(usize, usize)] = match used {
        0 | 1 => return,
        2 => &TWO,
        3 | 4 => &FOUR,
        5..=8 => &EIGHT,
        9..=12 => &TWELVE,
        13..=16 => &SIXTEEN,
        _ => &ALL,
    };
    // Compare and swap, in all lanes at once.
    for &(i, j) in pairs {
        let swap = s.dlt(lo[j], lo[i]);
        let (hi_i, hi_j) = (hi[i], hi[j]);
        let (lo_i, lo_j) = (lo[i], lo[j]);
        lo[i] = s.select(swap, lo_i, lo_j);
        lo[j] = s.select(swap, lo_j, lo_i);
        hi[i] = s.select(swap, hi_i, hi_j);
        hi[j] = s.select(swap, hi_j, hi_i);
    }
}

/// The pairs of positions that Batcher's odd–even merge sort compares and swaps, in order.
///
/// The sequence of comparisons does not depend on the values, so that eight lanes can be sorted
/// with the same instructions. Sorted runs of length p are merged to runs of length 2 p, first by
/// comparisons at distance p, then p/2, and so on.
///
/// **Source**: Knuth, The Art of Computer Programming 3, section 5.2.2, algorithm M.
const fn network<const PAIRS: usize>(n: usize) -> [(usize, usize); PAIRS] {
    let power = n.next_power_of_two();
    let mut pairs = [(0, 0); PAIRS];
    let mut count = 0;
    let mut p = 1;
    while p < power {
        let mut k = p;
        while k >= 1 {
            let mut i = 0;
            // Positions beyond the end would hold infinity and never move, so their pairs are left
            // out.
            while i + k < n {
                // Compare within a run of 2 p; in later rounds of a merge only every second pair is
                // due.
                let even = i >= k % p && (i - k % p) / k % 2 == 0;
                if even && i / (2 * p) == (i + k) / (2 * p) {
                    pairs[count] = (i, i + k);
                    count += 1;
                }
                i += 1;
            }
            k /= 2;
        }
        p *= 2;
    }
    assert!(count == PAIRS, "as many as the caller says");
    pairs
}

/// Finds the visible pieces of one line whose hidden intervals are sorted.
fn sweep_sorted(hidden: &[(f64, f64)], (from, to): (f64, f64), lane: usize, out: &mut Pieces) {
    let scale = 1.0 / (to - from);
    let mut edge = from;
    let mut row = 0;
    let mut push = |edge: f64, t1: f64| {
        let t0 = (edge - from) * scale;
        if t1 - t0 >= LEAST_PIECE {
            out.push(row, lane, (t0, t1));
            row += 1;
        }
    };
    for &(lo, hi) in hidden {
        if lo >= to {
            break;
        }
        push(edge, ((lo - from) * scale).min(1.0));
        edge = edge.max(hi);
    }
    if edge < to {
        push(edge, 1.0);
    }
}

/// Finds the visible pieces of all lines, and stores them in `out` in the caller's order.
#[inline(always)]
pub(crate) fn finish<S: Simd>(
    s: S,
    lines: &Lines,
    slots: &mut Slots,
    pieces: &mut Pieces,
    out: &mut VisibleLines,
) {
    for (index, block) in lines.blocks.iter().enumerate() {
        finish_block(s, index, block, slots, pieces);
        // Store each line's pieces, in reverse for lines that run against v.
        let rows = &pieces.rows[..pieces.used];
        for lane in 0..(lines.count - index * 8).min(8) {
            let number = block.number[lane] as usize;
            let cells = rows
                .iter()
                .map(|r| (r.lo[lane], r.hi[lane], r.found >> lane & 1 != 0));
            if !(block.from[lane] < block.to[lane]) {
                // A line without length has no visible part.
            } else if block.reversed >> lane & 1 != 0 {
                out.put(
                    number,
                    cells.rev().map(|(lo, hi, is)| (1.0 - hi, 1.0 - lo, is)),
                );
            } else {
                out.put(number, cells);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::network;

    /// A network that sorts every sequence of zeros and ones sorts everything (the zero–one
    /// principle). Here 64 sequences are sorted at a time, one bit of each number for each.
    fn sorts(n: usize, pairs: &[(usize, usize)]) {
        let patterns: [u64; 6] =
            std::array::from_fn(|i| (0..64_u64).fold(0, |word, k| word | (k >> i & 1) << k));
        for rest in 0..1_u64 << n.saturating_sub(6) {
            let mut values: Vec<u64> = (0..n)
                .map(|i| match patterns.get(i) {
                    Some(pattern) => *pattern,
                    None => (rest >> (i - 6) & 1).wrapping_neg(),
                })
                .collect();
            for &(i, j) in pairs {
                assert!(i < j);
                (values[i], values[j]) = (values[i] & values[j], values[i] | values[j]);
            }
            assert!(
                values.windows(2).all(|w| w[0] & !w[1] == 0),
                "{n}, {rest:b}"
            );
        }
    }

    #[test]
    fn networks_sort() {
        sorts(2, &network::<1>(2));
        sorts(4, &network::<5>(4));
        sorts(8, &network::<19>(8));
        sorts(12, &network::<42>(12));
        sorts(16, &network::<63>(16));
        sorts(24, &network::<132>(24));
    }
}
