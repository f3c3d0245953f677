//! The assembly of a picture from the parts of its units.
//!
//! ```text
//!     part of block 0 ─┐
//!     part of block 1 ─┼──► a whole tile ──► its pixels in the image and the other layers
//!     part of block 2 ─┘
//! ```
//!
//! Floating-point sums depend on their order. Therefore the blocks of a tile are added in the order
//! of their numbers, wherever they were computed, and all blocks of a tile come before the blocks
//! of the next. Tiles share no pixel, and come in any order.

use super::Picture;
use super::part::{Part, Work};
use crate::commands::aovs::{self, Rendered, Surface};
use crate::commands::image;
use linelit_film::{Image, Moments, Placement, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::Counts;

/// A picture that is being put together: the layers of the window, filled tile by tile.
pub(super) struct Assembly {
    window: Tile,
    /// The index of the block that completes a tile; zero where tiles are not cut into blocks.
    last_block: u32,
    /// The number of camera samples of a pixel, over all trials.
    samples: f64,
    pub(super) rendered: Rendered,
    /// The sum of the blocks of the current tile that were added.
    tile: Part,
    /// The sums of the counts, as [`image::counted`] names them.
    pub(super) counted: Vec<u64>,
}

impl Assembly {
    /// Creates the empty layers of a picture.
    pub(super) fn new(picture: &Picture) -> Self {
        let (window, aovs) = (picture.window, &picture.args.aovs);
        // A layer has all pixels, or none if it is not requested.
        let all = |wanted: bool| if wanted { window.area() } else { 0 };
        let moments = all(aovs::wants_moments(aovs));
        let [width, height] = picture.film;
        let at = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
        let blocks = picture.work.iter().filter_map(|work| work.block);
        Self {
            window,
            last_block: blocks.max().unwrap_or(0),
            samples: picture.args.camera_samples(),
            rendered: Rendered {
                image: Image::new(window.width(), window.height()),
                placement: (window != Tile::whole(width, height)).then(|| Placement {
                    origin: [at(window.x0), at(window.y0)],
                    full: picture.film,
                    corner: [0, 0],
                }),
                world_to: picture.world_to,
                has_lamp: picture.has_lamp,
                moments: vec![Moments::default(); moments],
                cost: [vec![0; moments], vec![0; moments]],
                surfaces: vec![Surface::default(); all(aovs::wants_surfaces(aovs))],
            },
            tile: Part::default(),
            counted: vec![0; image::counted(&Counts::default()).count()],
        }
    }

    /// Adds the part of a unit, and returns the tile of the unit if this part completes the tile;
    /// otherwise `None`. The parts of a tile have to be added one after another, in the order of
    /// their blocks.
    pub(super) fn add(&mut self, work: Work, part: Part) -> Option<Tile> {
        for (sum, own) in self.counted.iter_mut().zip(&part.counted) {
            *sum += own;
        }
        if work.is_first() {
            // The first block replaces the empty part, whose lists have no pixels to add to.
            self.tile = part;
        } else {
            self.tile.add_block(part);
        }
        let is_whole = work.block.is_none_or(|block| block == self.last_block);
        is_whole.then(|| self.store(work.tile()))
    }

    /// Stores a complete tile in the picture.
    fn store(&mut self, tile: Tile) -> Tile {
        let (part, to) = (std::mem::take(&mut self.tile), &mut self.rendered);
        for (i, [x, y]) in tile.pixels().enumerate() {
            let [column, row] = [x - self.window.x0, y - self.window.y0];
            let place = row as usize * self.window.width() as usize + column as usize;
            if let Some(sum) = part.sums.get(i) {
                to.image.rgb[place] = aovs::single(DVec3::from_array(*sum) / self.samples);
            }
            if let Some(spread) = part.spreads.get(i) {
                to.moments[place] = spread.moments;
                for (to, cost) in to.cost.iter_mut().zip(spread.cost) {
                    to[place] = aovs::clamped(cost);
                }
            }
            if let Some(surface) = part.surfaces.get(i) {
                to.surfaces[place] = *surface;
            }
        }
        tile
    }
}
