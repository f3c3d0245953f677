//! The loop over the pixels of a picture.

use crate::{Counts, Renderer, Settings, Workspace};
use linelit_geometry::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The pixels of a picture, or of a part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// The columns.
    pub columns: Range<u32>,
    /// The rows.
    pub rows: Range<u32>,
}

impl Window {
    /// The values that `fill` gives the pixels, row by row, and the sum of what was counted
    /// meanwhile.
    ///
    /// `fill` is given the first pixel of a row, the values of the row, and memory of its thread.
    /// Rows are shared among the threads of the current rayon pool; values do not depend on their
    /// number if `fill` depends on the pixels alone. `row_done` is called after each row.
    pub fn map<T: Clone + Default + Send>(
        &self,
        row_done: impl Fn() + Sync,
        fill: impl Fn([u32; 2], &mut [T], &mut Workspace) + Sync,
    ) -> (Vec<T>, Counts) {
        let width = self.columns.len();
        let mut values = vec![T::default(); width * self.rows.len()];
        let rows = values.par_chunks_mut(width.max(1));
        let counts: Vec<Counts> = (self.rows.clone().into_par_iter())
            .zip(rows)
            .map_init(Workspace::new, |workspace, (y, row)| {
                fill([self.columns.start, y], row, workspace);
                row_done();
                workspace.take_counts()
            })
            .collect();
        let mut sum = Counts::default();
        counts.into_iter().for_each(|row| sum += row);
        (values, sum)
    }
}

impl Renderer<'_> {
    /// The radiance of the pixels of a window, row by row, as [`Renderer::row`] gives it, rounded
    /// to `f32`; with what was counted.
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
