//! Renders whole images.

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
    let rows: Vec<_> = (window.y0..window.y1)
        .into_par_iter()
        .map_init(Workspace::new, |workspace, y| {
            let row: Vec<DVec3> = (window.x0..window.x1)
                .map(|x| shade([x, y], workspace))
                .collect();
            progress.inc(1);
            (row, workspace.take_counts())
        })
        .collect();
    progress.finish_and_clear();
    let mut counts = Counts::default();
    let mut image = Image::new(window.width(), window.height());
    for ((row, row_counts), y) in rows.into_iter().zip(0u32..) {
        counts += row_counts;
        for (value, x) in row.into_iter().zip(0u32..) {
            #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
            image.set(x, y, value.to_array().map(|v| v as f32));
        }
    }
    (image, counts)
}
