//! The units of a picture: the work of each, and its result.

use crate::args::PictureArgs;
use crate::commands::aovs::{self, Surface};
use crate::commands::image;
use linelit_film::{Moments, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, Workspace};
use serde::{Deserialize, Serialize};

/// The work of a unit: a tile, and which camera samples of it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Work {
    /// The first column and the one after the last, then the rows.
    pub(super) tile: [u32; 4],
    /// The index of the unit's block of camera samples ([`PictureArgs::blocks`]), or `None` for all
    /// blocks.
    pub(super) block: Option<u32>,
}

impl Work {
    /// Returns the tile.
    pub(super) const fn tile(self) -> Tile {
        let [x0, x1, y0, y1] = self.tile;
        Tile { x0, y0, x1, y1 }
    }

    /// Returns whether this unit has the first samples of the tile.
    pub(super) fn is_first(self) -> bool {
        self.block.is_none_or(|k| k == 0)
    }
}

/// Returns the first column and the one after the last, then the rows.
pub(super) const fn bounds(tile: Tile) -> [u32; 4] {
    [tile.x0, tile.x1, tile.y0, tile.y1]
}

/// The result of a unit. All lists except `counted` have a value for each pixel of the tile, row by
/// row, or are empty.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Part {
    /// The counts that [`image::counted`] names.
    pub(super) counted: Vec<u64>,
    /// The sum of the camera samples of each pixel.
    pub(super) sums: Vec<[f64; 3]>,
    /// The moments and cost of each pixel's samples, for the layers `variance` and `samples`.
    pub(super) spreads: Vec<Spread>,
    /// The surface in each pixel, for the layers `albedo`, `normal` and `depth`; only the first
    /// block has them.
    pub(super) surfaces: Vec<Surface>,
}

/// The moments of some camera samples of a pixel, or of its trials if there are several, and the
/// rays and line queries that they took.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Spread {
    #[serde(with = "MomentsAsStored")]
    pub(super) moments: Moments,
    pub(super) cost: [u64; 2],
}

/// The fields of moments, for serde.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Moments")]
struct MomentsAsStored {
    count: u64,
    mean: [f64; 3],
    m2: [f64; 3],
}

impl Part {
    /// Computes a unit of a picture. Also returns all counts, of which `counted` has a selection.
    pub(super) fn compute(
        args: &PictureArgs,
        renderer: &Renderer<'_>,
        work: Work,
        workspace: &mut Workspace,
    ) -> (Self, Counts) {
        let mut part = Self::default();
        // Compute the samples: by rows if there is one per pixel, as rows share camera rays;
        // otherwise by pixels.
        let is_by_rows = args.camera_samples() <= 1.0 && !aovs::wants_moments(&args.aovs);
        let counts = if is_by_rows {
            part.push_rows(args, renderer, work.tile(), workspace)
        } else {
            part.push_pixels(args, renderer, work, workspace)
        };
        part.counted = image::counted(&counts).map(|(_, n)| n).collect();
        // Find the visible surfaces, once for all blocks.
        if work.is_first() && aovs::wants_surfaces(&args.aovs) {
            let surface = |pixel| aovs::surface(renderer, pixel, workspace);
            part.surfaces = work.tile().pixels().map(surface).collect();
            // The rays for layers do not count as rays of the picture.
            workspace.take_counts();
        }
        (part, counts)
    }

    /// Adds the pixels of a tile that have one camera sample each.
    fn push_rows(
        &mut self,
        args: &PictureArgs,
        renderer: &Renderer<'_>,
        tile: Tile,
        workspace: &mut Workspace,
    ) -> Counts {
        let mut row = vec![DVec3::ZERO; tile.width() as usize];
        for y in tile.y0..tile.y1 {
            renderer.row(&args.settings(), [tile.x0, y], &mut row, workspace);
            self.sums.extend(row.iter().map(|value| value.to_array()));
        }
        workspace.take_counts()
    }

    /// Adds the pixels of a tile with any number of camera samples.
    fn push_pixels(
        &mut self,
        args: &PictureArgs,
        renderer: &Renderer<'_>,
        work: Work,
        workspace: &mut Workspace,
    ) -> Counts {
        let mut counts = Counts::default();
        let wants_moments = aovs::wants_moments(&args.aovs);
        let blocks = work.block.map_or(0..args.blocks(), |k| k..k + 1);
        for pixel in work.tile().pixels() {
            let (sum, moments) = aovs::samples(renderer, args, pixel, blocks.clone(), workspace);
            let own = workspace.take_counts();
            self.sums.push(sum.to_array());
            if wants_moments {
                let cost = [own.visibility.rays, own.visibility.line_queries];
                self.spreads.push(Spread { moments, cost });
            }
            counts += own;
        }
        counts
    }

    /// Adds the sums and the spreads of another block of the same tile. The assembly adds the
    /// counts, and the first block has the surfaces.
    pub(super) fn add_block(&mut self, block: Self) {
        for (sum, own) in self.sums.iter_mut().zip(block.sums) {
            *sum = (DVec3::from_array(*sum) + DVec3::from_array(own)).to_array();
        }
        for (all, own) in self.spreads.iter_mut().zip(block.spreads) {
            all.moments.merge(&own.moments);
            all.cost = [0, 1].map(|k| all.cost[k] + own.cost[k]);
        }
    }

    /// Returns whether a part that was read has as many values as the part of this unit must have.
    pub(super) fn fits(&self, args: &PictureArgs, work: Work) -> bool {
        let pixels = |wanted: bool| if wanted { work.tile().area() } else { 0 };
        let wants_surfaces = work.is_first() && aovs::wants_surfaces(&args.aovs);
        self.sums.len() == pixels(true)
            && self.spreads.len() == pixels(aovs::wants_moments(&args.aovs))
            && self.surfaces.len() == pixels(wants_surfaces)
            && self.counted.len() == image::counted(&Counts::default()).count()
    }
}
