//! This module holds blue noise: numbers whose differences between neighbouring pixels have little
//! low-frequency content.

use crate::block::Block;
use crate::hash::{lane, unit_f64, word};
use crate::stratified::UniformJitter;

/// The width and height of the tile.
const SIZE: usize = 64;

/// The ranks 0..4096 of a void-and-cluster dither array, row by row, little-endian;
/// `examples/blue_noise_tile` reproduces it bit for bit.
static TILE: &[u8; SIZE * SIZE * 2] = include_bytes!("blue_noise_64.bin");

/// Returns the rank, 0 to 4095, of a pixel in the 64×64 blue-noise tile, which is repeated over the
/// plane.
///
/// For every threshold k the pixels with rank below k are spread evenly: Ulichney 1993, *The
/// void-and-cluster method for dither array generation*, σ = 1.5.
///
/// ```
/// use linelit_samplers::blue_noise_rank;
/// assert_eq!(blue_noise_rank([3, 5]), blue_noise_rank([67, 5]));
/// ```
#[inline]
#[must_use]
pub fn blue_noise_rank(pixel: [u32; 2]) -> u16 {
    let at = 2 * ((pixel[1] as usize % SIZE) * SIZE + pixel[0] as usize % SIZE);
    u16::from_le_bytes([TILE[at], TILE[at + 1]])
}

/// Returns a number in [0, 1) for a pixel from the tile, which `placement` moves over the plane.
///
/// `placement` (a hash of seed and dimension, not of the pixel) chooses one of 64² shifts × 8
/// symmetries × negation or not; all of them keep the noise blue. `jitter` in [0, 1) fills the 4096
/// steps, so that the number is uniform over random placements and jitters.
#[inline]
fn blue_value(pixel: [u32; 2], placement: u64, jitter: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are wanted")]
    let [shift_x, shift_y] = [placement as u32, (placement >> 8) as u32];
    let [mut x, mut y] = [
        pixel[0].wrapping_add(shift_x),
        pixel[1].wrapping_add(shift_y),
    ];
    // Apply the symmetry.
    if placement >> 16 & 1 == 1 {
        (x, y) = (y, x);
    }
    if placement >> 17 & 1 == 1 {
        x = !x;
    }
    if placement >> 18 & 1 == 1 {
        y = !y;
    }
    let rank = blue_noise_rank([x, y]);
    // Negate the ranks.
    let rank = if placement >> 19 & 1 == 1 {
        4095 - rank
    } else {
        rank
    };
    // This is at most (4095 + 1 − 2⁻⁵³)/4096, which may round to one: clamp it.
    crate::hash::below_one((f64::from(rank) + jitter) / 4096.0)
}

/// Makes uniform jitter whose offset comes from the tile: Peters 2021, section 5.3 and Fig. 7.
#[inline]
pub(crate) fn blue_uniform_jitter(
    dimension_key: u64,
    keys: [u64; 2],
    pixel: [u32; 2],
    count: u32,
    block: Block,
) -> UniformJitter {
    let offset = blue_point(dimension_key, keys[0], pixel, 0);
    UniformJitter::with_offset(keys, count, block, offset)
}

/// Returns the two blue numbers of sample `i`, each from its own placement of the tile.
#[inline]
fn blue_point(dimension_key: u64, key: u64, pixel: [u32; 2], i: u32) -> [f64; 2] {
    let counter = 2 * u64::from(i);
    [counter, counter + 1].map(|c| {
        blue_value(
            pixel,
            word(lane(dimension_key, 8), c),
            unit_f64(word(lane(key, 8), c)),
        )
    })
}

/// Independent samples in each pixel, each of which is blue noise across the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlueIndependent {
    dimension_key: u64,
    key: u64,
    pixel: [u32; 2],
}

impl BlueIndependent {
    #[inline]
    pub(crate) fn new(dimension_key: u64, key: u64, pixel: [u32; 2]) -> Self {
        Self {
            dimension_key,
            key,
            pixel,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.get_2d(i)[0]
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        blue_point(self.dimension_key, self.key, self.pixel, i)
    }
}
