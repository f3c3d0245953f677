//! From hidden intervals in no order to visible ones in order.

use crate::VisibleLines;
use linelit_geometry::intervals::Interval;

/// Hidden intervals that a line keeps before they spill.
const ROOM: usize = 24;

/// Visible pieces shorter than this fraction of their line are rounding errors.
const LEAST_PIECE: f64 = 1e-14;

/// Hidden intervals of each line that did not join the line's running interval.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    intervals: Vec<[(f64, f64); ROOM]>,
    counts: Vec<usize>,
    /// What found no room: line and interval.
    spilled: Vec<(usize, f64, f64)>,
    sorted: Vec<(f64, f64)>,
}

impl Slots {
    pub(crate) fn reset(&mut self, lines: usize) {
        if self.intervals.len() < lines {
            self.intervals.resize(lines, [(0.0, 0.0); ROOM]);
        }
        self.counts.clear();
        self.counts.resize(lines, 0);
        self.spilled.clear();
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, line: usize, lo: f64, hi: f64) {
        let count = self.counts[line];
        if count < ROOM {
            self.intervals[line][count] = (lo, hi);
            self.counts[line] = count + 1;
        } else {
            self.make_room(line, lo, hi);
        }
    }

    /// Unites a full line's intervals; if that does not make room, they spill.
    #[cold]
    fn make_room(&mut self, line: usize, lo: f64, hi: f64) {
        let row = &mut self.intervals[line];
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
            self.spilled.extend(row[..kept].iter().map(|i| (line, i.0, i.1)));
            kept = 0;
        }
        row[kept] = (lo, hi);
        self.counts[line] = kept + 1;
    }

    /// Sorts the hidden intervals of a line, with its running one, and appends the visible rest
    /// of `from..to` as parameters, 0 at `from` or, for a `reversed` line, at `to`.
    pub(crate) fn finish(
        &mut self,
        line: usize,
        run: (f64, f64),
        (from, to): (f64, f64),
        reversed: bool,
        out: &mut Vec<Interval>,
    ) {
        let mut buffer = [(0.0, 0.0); ROOM + 1];
        let count = self.counts[line];
        let hidden: &mut [(f64, f64)] = if self.spilled.is_empty() {
            buffer[..count].copy_from_slice(&self.intervals[line][..count]);
            buffer[count] = run;
            &mut buffer[..=count]
        } else {
            let mine = self.spilled.iter().filter(|s| s.0 == line).map(|s| (s.1, s.2));
            self.sorted.clear();
            self.sorted.extend(mine);
            self.sorted.extend(&self.intervals[line][..count]);
            self.sorted.push(run);
            &mut self.sorted
        };
        if hidden.len() <= 16 {
            insertion_sort(hidden);
        } else {
            hidden.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        }
        let first = out.len();
        let scale = 1.0 / (to - from);
        let mut edge = from;
        let mut push = |lo: f64, hi: f64| {
            let (t0, t1) = ((lo - from) * scale, (hi - from) * scale);
            if t1 - t0 >= LEAST_PIECE {
                out.push(Interval::new(t0, t1.min(1.0)));
            }
        };
        for &(lo, hi) in hidden.iter() {
            if lo >= to {
                break;
            }
            if lo > edge {
                push(edge, lo);
            }
            edge = edge.max(hi);
        }
        if edge < to {
            push(edge, to);
            // The end of the line is exact.
            if let Some(last) = out[first..].last_mut() {
                last.hi = 1.0;
            }
        }
        if reversed {
            out[first..].reverse();
            for i in &mut out[first..] {
                *i = Interval::new(1.0 - i.hi, 1.0 - i.lo);
            }
        }
    }
}

fn insertion_sort(a: &mut [(f64, f64)]) {
    for i in 1..a.len() {
        let x = a[i];
        let mut j = i;
        while j > 0 && a[j - 1].0 > x.0 {
            a[j] = a[j - 1];
            j -= 1;
        }
        a[j] = x;
    }
}

/// Puts the lines' intervals into the caller's order.
pub(crate) fn gather(pieces: &[Interval], spans: &[(usize, usize)], out: &mut VisibleLines) {
    for &(start, end) in spans {
        for &interval in &pieces[start..end] {
            out.push(interval);
        }
        out.finish_line();
    }
}
