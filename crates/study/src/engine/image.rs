//! Renders whole images.

use crate::memory;
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, Settings, Workspace};
use rayon::prelude::*;

/// A rectangle of pixels: x0 ≤ x < x1, y0 ≤ y < y1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x0: u32,
    /// Column after the last.
    pub x1: u32,
    /// First row.
    pub y0: u32,
    /// Row after the last.
    pub y1: u32,
}

impl Window {
    /// A whole image.
    #[must_use]
    pub const fn whole(width: u32, height: u32) -> Self {
        Self {
            x0: 0,
            x1: width,
            y0: 0,
            y1: height,
        }
    }

    /// Columns.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.y1 - self.y0
    }
}

/// Bytes that a pixel takes while a picture is rendered and written: 12 of the image, and as many
/// of the file's text beside its values, or of those beside the image.
const BYTES_PER_PIXEL: u64 = 24;

/// Refuses a picture that does not fit into memory.
///
/// # Errors
/// If the memory it takes is not available.
pub fn check_memory(window: Window) -> Result<()> {
    let (width, height) = (window.width(), window.height());
    let pixels = u64::from(width).saturating_mul(height.into());
    let what = format!("a picture of {width} x {height} pixels");
    memory::check(&what, pixels.saturating_mul(BYTES_PER_PIXEL))
}

/// Renders a window of an image, row by row over the threads of the current pool. The pixels do
/// not depend on the number of threads.
#[must_use]
pub fn render(
    renderer: &Renderer<'_>,
    settings: &Settings,
    window: Window,
    progress: &ProgressBar,
) -> (Image, Counts) {
    map(window, progress, |pixel, workspace| {
        renderer.pixel(settings, pixel, workspace)
    })
}

/// Renders a window with any function of a pixel.
pub fn map(
    window: Window,
    progress: &ProgressBar,
    shade: impl Fn([u32; 2], &mut Workspace) -> DVec3 + Sync,
) -> (Image, Counts) {
    progress.set_length(u64::from(window.height()));
    let mut image = Image::new(window.width(), window.height());
    let rows = image.rgb.par_chunks_mut(window.width().max(1) as usize);
    let counts: Vec<Counts> = (window.y0..window.y1)
        .into_par_iter()
        .zip(rows)
        .map_init(Workspace::new, |workspace, (y, row)| {
            for (pixel, x) in row.iter_mut().zip(window.x0..) {
                let value = shade([x, y], workspace).to_array();
                #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
                let stored = value.map(|v| v as f32);
                *pixel = stored;
            }
            progress.inc(1);
            workspace.take_counts()
        })
        .collect();
    progress.finish_and_clear();
    let mut sum = Counts::default();
    for row in counts {
        sum += row;
    }
    (image, sum)
}
