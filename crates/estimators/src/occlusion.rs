//! Statistics of the occlusion of a light, from points that it is seen from.

use crate::pilot_lines::{PilotLines, middle, tests};
use crate::view::LightView;
use crate::visible::query as between;
use crate::{Buffers, EmissionTexture, OcclusionStats, Query};
use linelit_bsdf::Reflection;
use linelit_lights::{AreaLight, AreaSampler, PointTechnique as _};
use linelit_visibility::ShaftClass;

/// A light is densely occluded if more than this share of its shafts is dense.
const DENSE: f64 = 0.2;

/// The time of tests for lines, in that of tests for rays, which are traced together but end at the
/// first triangle that they meet: measured.
const TIME_OF_TESTS: f64 = 0.5;

/// Points of the light, across and down, that rays are sent to.
const POINTS: usize = 4;

/// Gathers the [`OcclusionStats`] of one area light from points that it is seen from.
#[derive(Clone, Copy, Debug, Default)]
pub struct OcclusionProbe {
    /// Shafts towards the light.
    shafts: u32,
    /// The number of shafts that were dense.
    dense: u32,
    /// The number of shafts that were neither dense nor empty nor blocked.
    partial: u32,
    /// Triangles in the shafts that were not dense.
    candidates: usize,
    /// Edges that bound what those hide.
    edges: usize,
    /// Tests of rays past dense shafts.
    dense_ray_tests: u64,
    pilots: PilotLines,
}

impl OcclusionProbe {
    /// Asks for the shaft from the point of a query to its light, and sends rays and lines there if
    /// too much is in between to keep.
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
        // Past a dense shaft compare what rays cost with what lines cost.
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

    /// Sends lines from the point of a query to its light, unless too much stands in between: for
    /// which [`OcclusionProbe::look`] does, at fewer points.
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

    /// The statistics.
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
