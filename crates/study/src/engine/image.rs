//! Computes whole images.

use crate::memory;
use anyhow::Result;
use linelit_film::{Image, Tile};
use linelit_geometry::DVec3;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Bytes that a pixel takes while a picture is rendered and written: 12 of the image, and as many
/// of the file's text beside its values, or of those beside the image.
const BYTES_PER_PIXEL: u64 = 24;

/// Refuses a picture that does not fit into memory, with what else is kept of each pixel: so many
/// bytes `beside` those of the picture.
///
/// # Errors
/// If the memory it takes is not available.
pub fn check_memory(window: Tile, beside: u64) -> Result<()> {
    let (width, height) = (window.width(), window.height());
    let pixels = u64::from(width).saturating_mul(height.into());
    let what = format!("a picture of {width} x {height} pixels");
    memory::check(&what, pixels.saturating_mul(BYTES_PER_PIXEL + beside))
}

/// Computes a window of an image with a function of the pixel, as [`map_rows`].
pub fn map<W: Default, C: AddAssign + Default + Send>(
    window: Tile,
    row_done: impl Fn() + Sync,
    take_counts: impl Fn(&mut W) -> C + Sync,
    shade: impl Fn([u32; 2], &mut W) -> DVec3 + Sync,
) -> (Image, C) {
    map_rows(window, row_done, take_counts, |[x0, y], row, workspace| {
        for (x, value) in (x0..).zip(row) {
            *value = shade([x, y], workspace);
        }
    })
}

/// Computes a window of an image with a function that fills pixels from one on to the right, row by
/// row over the threads of the current pool. The pixels do not depend on the number of threads.
///
/// Each thread has a workspace of its own; `take_counts` reads what was counted in it, and sets it
/// to zero. The sum is returned beside the image. `row_done` is called after each row.
pub fn map_rows<W: Default, C: AddAssign + Default + Send>(
    window: Tile,
    row_done: impl Fn() + Sync,
    take_counts: impl Fn(&mut W) -> C + Sync,
    shade: impl Fn([u32; 2], &mut [DVec3], &mut W) + Sync,
) -> (Image, C) {
    let mut image = Image::new(window.width(), window.height());
    let rows = image.rgb.par_chunks_mut(window.width().max(1) as usize);
    let counts: Vec<C> = (window.y0..window.y1)
        .into_par_iter()
        .zip(rows)
        .map_init(W::default, |workspace, (y, row)| {
            let mut values = [DVec3::ZERO; 64];
            let starts = (window.x0..window.x1).step_by(values.len());
            for (x, pixels) in starts.zip(row.chunks_mut(values.len())) {
                let values = &mut values[..pixels.len()];
                shade([x, y], values, workspace);
                for (pixel, value) in pixels.iter_mut().zip(values) {
                    #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
                    let stored = value.to_array().map(|v| v as f32);
                    *pixel = stored;
                }
            }
            row_done();
            take_counts(workspace)
        })
        .collect();
    let mut sum = C::default();
    for row in counts {
        sum += row;
    }
    (image, sum)
}
