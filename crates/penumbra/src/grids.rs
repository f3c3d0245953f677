//! A search structure for boxes: which of many boxes may contain a given point. It consists of
//! grids of several resolutions.

use super::bins::Bounds;
use super::orient::Point;

/// The number of boxes up to which no grids are filled, and a query tests all boxes one by one.
const FEW: usize = 64;

/// The largest number of cells that a box is entered in. With fewer, long thin boxes would go to
/// grids that are too coarse.
const TOUCHED: u32 = 8;

/// The base-2 logarithm of the largest number of cells along each axis of the finest grid.
const FINEST: u32 = 7;

/// Grids over a rectangle, each with half as many cells along an axis as the one before. A box is
/// entered in the finest grid in which it touches no more than a few cells. So a point has few
/// candidates even among many small boxes, and large boxes do not fill all cells.
///
/// The cell is a monotone function of the coordinate, so that no box that contains a point is
/// missed.
#[derive(Debug, Default)]
pub(super) struct Grids {
    /// The number of boxes; grids are filled only for more than [`FEW`] boxes.
    count: usize,
    /// The base-2 logarithm of the number of cells along each axis of the finest grid.
    levels: u32,
    low: Point,
    scale: Point,
    /// For each cell, grid after grid from the coarsest on, the index of its last entry plus one.
    cells: Vec<u32>,
    /// For each entry of a box in a cell, the index of the box, and the index of the previous entry
    /// of the same cell plus one.
    entries: Vec<[u32; 2]>,
}

impl Grids {
    /// Enters boxes in grids over `area`; boxes that extend beyond the area are entered in the
    /// outermost cells.
    pub(super) fn fill(&mut self, area: &Bounds, boxes: impl ExactSizeIterator<Item = Bounds>) {
        self.count = boxes.len();
        if self.count <= FEW {
            return;
        }
        // Choose the finest grid, with about as many cells as boxes.
        self.levels = (self.count.ilog2() / 2 + 1).min(FINEST);
        let side = f64::from((1_u32 << self.levels) - 1);
        self.low = area.low;
        let scale = |k: usize| side / (area.high[k] - area.low[k]).max(f64::MIN_POSITIVE);
        self.scale = [scale(0), scale(1)];
        self.cells.clear();
        self.cells.resize(first_cell(self.levels + 1), 0);
        self.entries.clear();
        // Enter each box in the finest grid in which it touches few cells.
        for (i, b) in (0_u32..).zip(boxes) {
            let (low, high) = (self.place(&b.low), self.place(&b.high));
            let touched = |k: usize, up: u32| (high[k] >> up) - (low[k] >> up) + 1;
            let mut up = 0;
            while touched(0, up) * touched(1, up) > TOUCHED {
                up += 1;
            }
            let level = self.levels - up;
            for row in low[0] >> up..=high[0] >> up {
                for column in low[1] >> up..=high[1] >> up {
                    let cell = first_cell(level) + (row << level | column) as usize;
                    let before =
                        std::mem::replace(&mut self.cells[cell], index(self.entries.len() + 1));
                    self.entries.push([i, before]);
                }
            }
        }
    }

    /// Calls `f` with the indices of the boxes that may contain a point, in no particular order,
    /// until `f` returns `None`; then this function does, too.
    #[inline]
    pub(super) fn at(&self, p: &Point, mut f: impl FnMut(usize) -> Option<()>) -> Option<()> {
        if self.count <= FEW {
            return (0..self.count).try_for_each(f);
        }
        let [row, column] = self.place(p);
        for level in 0..=self.levels {
            let up = self.levels - level;
            let cell = first_cell(level) + (row >> up << level | column >> up) as usize;
            let mut next = self.cells[cell];
            while let Some(entry) = next.checked_sub(1) {
                let [i, before] = self.entries[entry as usize];
                f(i as usize)?;
                next = before;
            }
        }
        Some(())
    }

    /// Returns the cell of the finest grid that contains a point.
    #[inline]
    fn place(&self, p: &Point) -> [u32; 2] {
        let most = f64::from((1_u32 << self.levels) - 1);
        [0, 1].map(|k| {
            let place = ((p[k] - self.low[k]) * self.scale[k]).min(most).max(0.0);
            // Adding 2⁵² rounds to an integer: monotone, and NaN goes to the last cell.
            #[allow(clippy::cast_possible_truncation, reason = "less than 2^FINEST")]
            let cell = (place + 4_503_599_627_370_496.0).to_bits() as u32 & ((1 << FINEST) - 1);
            cell
        })
    }
}

/// Returns the index of the first cell of the grid with 2ˡᵉᵛᵉˡ cells along each axis.
fn first_cell(level: u32) -> usize {
    ((1 << (2 * level)) - 1) / 3
}

/// Converts an index into a list of fewer than 2³² items to 32 bits.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_box_that_holds_a_point_is_missed() {
        let mut rng = linelit_testkit::cases::rng(8);
        let area = Bounds {
            low: [0.0, 0.0],
            high: [1.0, 2.0],
        };
        let mut grids = Grids::default();
        for count in [0, 1, FEW, FEW + 1, 300, 5000_usize] {
            let mut boxes = Vec::new();
            for i in 0..count {
                // Wide boxes, high boxes, small ones, and some that cover everything.
                let sizes = [[0.5, 0.01], [0.01, 0.9], [0.02, 0.02], [3.0, 3.0]];
                let [w, h] = sizes[i % 4].map(|size| rng.in_range(0.0, size));
                let [x, y] = [rng.in_range(-1.0, 2.0), rng.in_range(-1.0, 3.0)];
                boxes.push(Bounds::of([[x, y], [x + w, y + h]]));
            }
            grids.fill(&area, boxes.iter().copied());
            for _ in 0..200 {
                let p = [rng.in_range(-0.2, 1.2), rng.in_range(-0.2, 2.2)];
                let mut found = vec![0; count];
                let all = grids.at(&p, |i| {
                    found[i] += 1;
                    Some(())
                });
                assert!(all.is_some() && found.iter().all(|n| *n <= 1));
                let here = Bounds::of([p]);
                for (b, n) in boxes.iter().zip(&found) {
                    assert!(!b.meets(&here) || *n == 1, "{b:?} {p:?}");
                }
            }
        }
    }
}
