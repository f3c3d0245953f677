//! [`tiles`], the rectangles into which work on a picture is divided, in a fixed order.

/// A rectangle of pixels: columns `x0..x1`, rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Tile {
    /// The first column.
    pub x0: u32,
    /// The first row.
    pub y0: u32,
    /// The column after the last one.
    pub x1: u32,
    /// The row after the last one.
    pub y1: u32,
}

impl Tile {
    /// Returns the tile that is a whole picture.
    #[must_use]
    pub const fn whole(width: u32, height: u32) -> Self {
        Self {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        }
    }

    /// Returns the number of pixels in a row.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Returns the number of rows.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.y1 - self.y0
    }

    /// Returns the number of pixels.
    #[must_use]
    pub fn area(&self) -> usize {
        crate::image::area(self.width(), self.height())
    }

    /// Returns the pixels row by row, in the film's coordinates.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let tile = *self;
        (tile.y0..tile.y1).flat_map(move |y| (tile.x0..tile.x1).map(move |x| [x, y]))
    }
}

/// Divides a window into tiles of at most `size × size` pixels, row by row.
///
/// Every pixel of the window is in exactly one tile. The order depends only on the arguments, so
/// that results which are computed in parallel and merged in this order have the same bits for any
/// number of threads. A `size` of zero counts as one.
///
/// ```
/// use linelit_film::{Tile, tiles};
/// let window = Tile { x0: 0, y0: 0, x1: 100, y1: 50 };
/// assert_eq!(tiles(window, 32).len(), 4 * 2);
/// ```
#[must_use]
pub fn tiles(window: Tile, size: u32) -> Vec<Tile> {
    let size = size.max(1);
    let starts = |from: u32, to: u32| (from..to).step_by(size as usize);
    let mut all = Vec::new();
    for y0 in starts(window.y0, window.y1) {
        for x0 in starts(window.x0, window.x1) {
            let x1 = x0.saturating_add(size).min(window.x1);
            let y1 = y0.saturating_add(size).min(window.y1);
            all.push(Tile { x0, y0, x1, y1 });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once() {
        let [x0, y0, x1, y1] = [3, 5, 40, 22];
        for size in [0, 1, 7, 16, 100] {
            let tiles = tiles(Tile { x0, y0, x1, y1 }, size);
            assert!(
                tiles
                    .iter()
                    .all(|tile| tile.pixels().count() == tile.area())
            );
            let mut covered: Vec<_> = tiles.iter().flat_map(Tile::pixels).collect();
            covered.sort_by_key(|[x, y]| [*y, *x]);
            let window = Tile { x0, y0, x1, y1 };
            assert!(covered.into_iter().eq(window.pixels()), "size {size}");
        }
    }

    #[test]
    fn windows_may_be_empty_or_in_the_far_corner() {
        assert!(tiles(Tile::whole(0, 9), 8).is_empty());
        let far = Tile {
            x0: u32::MAX - 3,
            ..Tile::whole(u32::MAX, 1)
        };
        assert_eq!(tiles(far, 2).len(), 2);
    }
}
