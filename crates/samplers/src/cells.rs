//! This module divides the unit square into N equal cells, for any N.

/// A partition of the unit square into N cells of equal area and nearly square shape, for any N ≥
/// 1.
///
/// **Rule.** If N = a·b with a ≤ b ≤ 2a, the cells are the a×b grid (the squarest such
/// factorisation). Otherwise they are laid like bricks: there are a = round(√N) rows, and row r
/// holds n_r = ⌊(r+1)N/a⌋ − ⌊rN/a⌋ cells (at most two different values) of the width 1/n_r and the
/// height n_r/N. All cells have the area 1/N, so that one sample per cell with equal weights is
/// unbiased. No cell is empty and none holds two samples, in contrast to a grid that is rounded up
/// for a prime N.
///
/// ```text
///   N = 6: a grid         N = 5: bricks
///   ┌───┬───┬───┐         ┌───┬───┬───┐
///   ├───┼───┼───┤         ├───┴─┬─┴───┤
///   └───┴───┴───┘         └─────┴─────┘
/// ```
///
/// Along y the cells also define N equal strata: cell k owns the k-th of them up to a permutation
/// inside its row (used by the multi-jittered pattern).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cells {
    /// The number of cells.
    pub(crate) count: u32,
    /// The number of rows.
    pub(crate) rows: u32,
    /// The number of cells in each row of a grid; 0 for bricks.
    pub(crate) columns: u32,
}

/// A cell: its row and column, and the size of its row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell {
    /// The index of the row, below [`Cells::rows`].
    pub(crate) row: u32,
    /// The index of the cell inside its row, below `columns`.
    pub(crate) column: u32,
    /// The number of cells in the row.
    pub(crate) columns: u32,
    /// The number of cells in all rows below this one.
    pub(crate) first: u32,
}

impl Cells {
    /// The whole square as one cell.
    pub(crate) const ONE: Self = Self {
        count: 1,
        rows: 1,
        columns: 1,
    };

    /// Divides the square into `count` ≥ 1 cells.
    #[inline]
    pub(crate) fn new(count: u32) -> Self {
        let rows = rows(count);
        let columns = if count.is_multiple_of(rows) {
            count / rows
        } else {
            0
        };
        Self {
            count,
            rows,
            columns,
        }
    }

    /// Whether all rows hold the same number of cells.
    #[inline]
    pub(crate) fn is_grid(&self) -> bool {
        self.columns > 0
    }

    /// Returns the cell with index `k` < count; rows are numbered upwards, and cells left to right.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "quotients below the row count and the cell count"
    )]
    pub(crate) fn cell(&self, k: u32) -> Cell {
        if let Some(row) = k.checked_div(self.columns) {
            let column = k - row * self.columns;
            return Cell {
                row,
                column,
                columns: self.columns,
                first: k - column,
            };
        }
        let (n, a) = (u64::from(self.count), u64::from(self.rows));
        // Row r starts at ⌊rN/a⌋; the last row that starts at or below k is ⌊((k+1)a − 1)/N⌋.
        let row = ((u64::from(k) + 1) * a - 1) / n;
        let first = row * n / a;
        let next = (row + 1) * n / a;
        Cell {
            row: row as u32,
            column: (u64::from(k) - first) as u32,
            columns: (next - first) as u32,
            first: first as u32,
        }
    }
}

/// Returns the number of rows for `count` cells, by the rule of [`Cells`].
///
/// The search for a divisor in [√(N/2), √N] is bounded to 64 candidates nearest to √N, which finds
/// every power of two, every m² and m(m+1), and every N below 40 000 that has one.
fn rows(count: u32) -> u32 {
    let root = count.isqrt();
    if count.is_power_of_two() {
        return 1 << ((u32::BITS - 1 - count.leading_zeros()) / 2);
    }
    let mut a = root;
    while a >= 1 && 2 * u64::from(a) * u64::from(a) >= u64::from(count) && root - a < 64 {
        if count.is_multiple_of(a) {
            return a;
        }
        a -= 1;
    }
    let nearest = if u64::from(count - root * root) > u64::from(root) {
        root + 1
    } else {
        root
    };
    nearest.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_once_and_of_equal_area() {
        for n in 1..600_u32 {
            let cells = Cells::new(n);
            let mut total = 0;
            let mut sizes = Vec::new();
            for k in 0..n {
                let cell = cells.cell(k);
                assert!(cell.column < cell.columns && cell.row < cells.rows);
                assert_eq!(cell.first + cell.column, k);
                if cell.column == 0 {
                    assert_eq!(cell.first, total);
                    total += cell.columns;
                    sizes.push(cell.columns);
                }
            }
            // Rows tile [0, N) and hold at most two neighbouring sizes; height n_r/N times width
            // 1/n_r is 1/N.
            assert_eq!(total, n);
            assert_eq!(sizes.len(), cells.rows as usize);
            let (low, high) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
            assert!(high - low <= 1, "{n}: {sizes:?}");
            // Aspect ratio (width over height) N/n_r² within [1/2, 2], but for N = 3 and the
            // smallest primes.
            let aspect = f64::from(n) / f64::from(*high * *high);
            assert!((0.25..=2.0).contains(&aspect), "{n}: aspect {aspect}");
        }
    }
}
