//! This module gathers statistics about the occlusion of a light, from points from which it is
//! seen. A renderer does so once for each light before the first estimate, so that `hybrid` can
//! choose by these statistics.

use crate::pilot_lines::{PilotLines, middle, tests};
use crate::view::LightView;
use crate::visible::query as between;
use crate::{Buffers, EmissionTexture, OcclusionStats, Query};
use linelit_bsdf::Reflection;
use linelit_lights::{AreaLight, AreaSampler, PointTechnique as _};
use linelit_visibility::ShaftClass;

/// A light is densely occluded if more than this fraction of its shafts is dense.
const DENSE: f64 = 0.2;

/// The time of a test for lines, relative to a test for rays. Rays are traced together but end at
/// the first triangle that they hit. Measured.
const TIME_OF_TESTS: f64 = 0.5;

/// The number of points of the light to which rays are sent, across and down.
const POINTS: usize = 4;

/// A probe gathers the [`OcclusionStats`] of one area light from points that see it.
#[derive(Clone, Copy, Debug, Default)]
pub struct OcclusionProbe {
    /// The number of shafts towards the light.
    shafts: u32,
    /// The number of shafts that were dense.
    dense: u32,
    /// The number of shafts that were neither dense nor empty nor blocked.
    partial: u32,
    /// The number of triangles in the shafts that were not dense.
    candidates: usize,
    /// The number of edges that bound the parts which these triangles hide.
    edges: usize,
    /// The number of boxes and triangles that rays past dense shafts were tested against.
    dense_ray_tests: u64,
    pilots: PilotLines,
}

impl OcclusionProbe {
    /// Builds the shaft from the point of a query to its light. If the shaft is dense, sends rays
    /// and pilot lines through it, too.
    pub fn look<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        buffers: &mut Buffers,
    ) {
        let occluders = query.occluders;
        let Some(view) = LightView::new(query.light, query.point, query.margins, None) else {
            return;
        };
        // Count the triangles in the shaft, and the edges of what they hide.
        let question = || between(&view, &area.polygon);
        let shaft = occluders.shaft(question(), &mut buffers.scratch);
        let (candidates, is_dense) = (shaft.candidates(), shaft.is_dense());
        self.partial += u32::from(shaft.class() == ShaftClass::Partial && !is_dense);
        self.shafts += 1;
        self.dense += u32::from(is_dense);
        if let (Some(images), Some(plane)) = (shaft.images(), shaft.light_plane()) {
            let penumbra = &mut buffers.known.region.penumbra;
            penumbra.boundary(plane.corners, images);
            self.candidates += candidates;
            self.edges += penumbra.edge_count();
        }
        // Past a dense shaft, compare the cost of rays with the cost of lines.
        if is_dense {
            let before = tests(&buffers.scratch.counters);
            let sampler = AreaSampler::new(&area.polygon);
            let to_light: [_; POINTS * POINTS] = std::array::from_fn(|i| {
                let u = [middle(i % POINTS, POINTS), middle(i / POINTS, POINTS)];
                sampler.sample(u).point - query.point.position
            });
            let fan = occluders.shadow_rays(query.point.position, &to_light, query.margins);
            occluders.any_hits(&fan, view.own, &mut buffers.scratch);
            self.dense_ray_tests += tests(&buffers.scratch.counters) - before;
            let shaft = &mut occluders.shaft(question(), &mut buffers.scratch);
            self.pilots
                .look(query, &view, shaft, &mut buffers.known.lines);
        }
    }

    /// Sends pilot lines from the point of a query to its light, unless the shaft is dense: for
    /// dense shafts [`OcclusionProbe::look`] does this, at fewer points.
    pub fn look_along_lines<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        buffers: &mut Buffers,
    ) {
        let Some(view) = LightView::new(query.light, query.point, query.margins, None) else {
            return;
        };
        let question = between(&view, &area.polygon);
        let shaft = &mut query.occluders.shaft(question, &mut buffers.scratch);
        if shaft.class() == ShaftClass::Partial && !shaft.is_dense() {
            self.pilots
                .look(query, &view, shaft, &mut buffers.known.lines);
        }
    }

    /// Returns the statistics of all points so far.
    #[must_use]
    pub fn stats(self) -> OcclusionStats {
        let mut stats = OcclusionStats {
            dense: f64::from(self.dense) > DENSE * f64::from(self.shafts),
            direction: self.pilots.direction(),
            ..OcclusionStats::FEW
        };
        #[allow(clippy::cast_precision_loss, reason = "a few hundred shafts")]
        let [edges, candidates, line_tests, rays] = [
            self.edges as f64,
            self.candidates as f64,
            self.pilots.tests() as f64,
            self.dense_ray_tests as f64,
        ];
        if rays > 0.0 {
            stats.line_cost = line_tests / rays * (POINTS * POINTS) as f64 / PilotLines::LINES;
        }
        stats.lines_ahead = (self.pilots).lines_ahead_of_rays(stats.line_cost * TIME_OF_TESTS);
        if candidates > 0.0 {
            stats.candidates = candidates / f64::from(self.shafts);
            stats.partial = f64::from(self.partial) / f64::from(self.shafts);
            stats.edges = edges / candidates;
        }
        stats
    }
}
