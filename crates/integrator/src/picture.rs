//! This module has the loop over the pixels of a picture.

use crate::{Counts, Renderer, Settings, Workspace};
use linelit_geometry::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The rectangle of pixels that is rendered: a whole picture, or a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// The range of columns.
    pub columns: Range<u32>,
    /// The range of rows.
    pub rows: Range<u32>,
}

impl Window {
    /// Computes a value for each pixel by `fill`, row by row. Returns the values and the counts of
    /// all work.
    ///
    /// `fill` gets the first pixel of a row, the values of the row, and the workspace of its
    /// thread. The threads of the current rayon pool divide the rows among them. The values do not
    /// depend on the number of threads, provided that `fill` depends on the pixels alone.
    /// `row_done` is called after each row.
    pub fn map<T: Clone + Default + Send>(
        &self,
        row_done: impl Fn() + Sync,
        fill: impl Fn([u32; 2], &mut [T], &mut Workspace) + Sync,
    ) -> (Vec<T>, Counts) {
        let width = self.columns.len();
        let mut values = vec![T::default(); width * self.rows.len()];
        // Fill the rows in parallel.
        let rows = values.par_chunks_mut(width.max(1));
        let counts: Vec<Counts> = (self.rows.clone().into_par_iter())
            .zip(rows)
            .map_init(Workspace::new, |workspace, (y, row)| {
                fill([self.columns.start, y], row, workspace);
                row_done();
                workspace.take_counts()
            })
            .collect();
        // Add up their counts.
        let mut sum = Counts::default();
        counts.into_iter().for_each(|row| sum += row);
        (values, sum)
    }
}

impl Renderer<'_> {
    /// Renders the pixels of a window. Returns their radiance, row by row, as [`Renderer::row`]
    /// computes it and rounded to `f32`, and the counts of all work.
    pub fn picture(
        &self,
        settings: &Settings,
        window: &Window,
        row_done: impl Fn() + Sync,
    ) -> (Vec<[f32; 3]>, Counts) {
        window.map(row_done, |first, pixels: &mut [[f32; 3]], workspace| {
            let mut values = vec![DVec3::ZERO; pixels.len()];
            self.row(settings, first, &mut values, workspace);
            for (pixel, value) in pixels.iter_mut().zip(values) {
                #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
                let stored = value.to_array().map(|v| v as f32);
                *pixel = stored;
            }
        })
    }
}
