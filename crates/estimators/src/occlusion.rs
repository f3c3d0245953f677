//! How occluded a light usually is.

use crate::pilot_lines::PilotLines;
use crate::{Buffers, EmissionTexture, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, AreaSampler, PointTechnique as _};
use linelit_visibility::{Counters, ShaftClass};

/// A light is densely occluded if more than this share of its shafts is dense.
const DENSE: f64 = 0.2;

/// Points of the light, across and down, that rays are sent to.
const POINTS: usize = 4;

/// Tests of boxes and triangles that take as long as keeping one triangle for points to be tested
/// against: measured.
const TESTS_FOR_A_CANDIDATE: u64 = 5;

/// The same for sorting out a visible piece of a line and integrating along it: measured, to a
/// factor of two.
const TESTS_FOR_A_PIECE: u64 = 30;

/// How occluded a light usually is: chooses the strategy of `hybrid`. Geometry alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OcclusionStats {
    /// Whether so much stands before the light that looking for all of it at once seldom pays.
    pub dense: bool,
    /// Triangles in between that may hide a part of the light, on average over points; none where
    /// nothing or all of it is hidden.
    pub candidates: f64,
    /// Edges that bound what is hidden, for each triangle in between: up to three if triangles are
    /// loose, few in meshes.
    pub edges: f64,
    /// How many rays take as long as a line past a dense shaft: by the boxes and triangles that 32
    /// lines in the best direction test, and sixteen rays. 13 if no shaft was dense.
    pub line_cost: f64,
    /// The direction of lines, in half turns from the light's first edge, in which the visible part
    /// changes least from one line to the next; of the light's edges and diagonals. `None` if it is
    /// not known: a random one for each shading point.
    pub direction: Option<f64>,
}

impl Default for OcclusionStats {
    /// Few triangles, all loose; no direction better than others.
    fn default() -> Self {
        Self {
            dense: false,
            candidates: 1.0,
            edges: 3.0,
            line_cost: 13.0,
            direction: None,
        }
    }
}

/// Gathers the [`OcclusionStats`] of one area light from points that it is seen from.
#[derive(Clone, Copy, Debug, Default)]
pub struct OcclusionProbe {
    /// Shafts towards the light.
    shafts: u32,
    /// Those that were dense.
    dense: u32,
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
        let shaft = occluders.shaft(query.shaft(&area.polygon), &mut buffers.scratch);
        let (candidates, is_dense) = (shaft.candidates(), shaft.is_dense());
        self.shafts += 1;
        self.dense += u32::from(is_dense);
        if let Some(images) = shaft.images() {
            let penumbra = &mut buffers.samples.penumbra;
            penumbra.boundary(images.light(), images.triangles());
            self.candidates += candidates;
            self.edges += penumbra.edge_count();
        }
        if is_dense {
            let before = tests(&buffers.scratch.counters);
            let to_light = points(area).map(|at| at - query.point.position);
            query.free(&to_light, &mut buffers.scratch);
            self.dense_ray_tests += tests(&buffers.scratch.counters) - before;
            let shaft = &mut occluders.shaft(query.shaft(&area.polygon), &mut buffers.scratch);
            self.pilots.look(query, area, shaft, &mut buffers.samples);
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
        let shaft = &mut (query.occluders).shaft(query.shaft(&area.polygon), &mut buffers.scratch);
        if shaft.class() == ShaftClass::Partial && !shaft.is_dense() {
            self.pilots.look(query, area, shaft, &mut buffers.samples);
        }
    }

    /// What the shafts say.
    #[must_use]
    pub fn stats(self) -> OcclusionStats {
        let mut stats = OcclusionStats {
            dense: f64::from(self.dense) > DENSE * f64::from(self.shafts),
            direction: self.pilots.direction(),
            ..OcclusionStats::default()
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
        if candidates > 0.0 {
            stats.candidates = candidates / f64::from(self.shafts);
            stats.edges = edges / candidates;
        }
        stats
    }
}

/// Points spread over the light.
fn points(area: &AreaLight) -> [DVec3; POINTS * POINTS] {
    let sampler = AreaSampler::new(&area.polygon);
    let at = |i| [middle(i % POINTS, POINTS), middle(i / POINTS, POINTS)];
    std::array::from_fn(|i| sampler.sample(at(i)).point)
}

/// The middle of part `i` of [0, 1] in `count` equal parts.
#[allow(clippy::cast_precision_loss, reason = "few parts")]
pub(crate) fn middle(i: usize, count: usize) -> f64 {
    (2 * i + 1) as f64 / (2 * count) as f64
}

/// What lines in dense shafts take, in tests of boxes and triangles.
pub(crate) fn tests_of_lines(counters: &Counters) -> u64 {
    tests(counters)
        + TESTS_FOR_A_CANDIDATE * counters.candidates
        + TESTS_FOR_A_PIECE * counters.intervals
}

/// Boxes and triangles tested.
fn tests(counters: &Counters) -> u64 {
    counters.node_tests + counters.triangle_tests
}
