//! How occluded a light usually is.

use crate::pilot_lines::PilotLines;
use crate::techniques::integrals::exact::{CORNERS, boundary};
use crate::{Buffers, EmissionTexture, Query};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, AreaSampler, PointTechnique as _};
use linelit_visibility::{Counters, ShaftClass};

/// A light is densely occluded if more than this share of its shafts is dense.
const DENSE: f64 = 0.2;

/// Of as many dense shafts the closed form is tried past one: it may take as long as hundreds of
/// lines.
const FOLLOWED: u32 = 4;

/// Points of the light, across and down, that rays are sent to.
const POINTS: usize = 4;

/// Tests of boxes and triangles that take as long as keeping one triangle for points to be tested
/// against: measured.
const TESTS_FOR_A_CANDIDATE: u64 = 5;

/// The same for sorting out a visible piece of a line and integrating along it: measured, to a
/// factor of two.
const TESTS_FOR_A_PIECE: u64 = 30;

/// The same for drawing a few points, which an empty shaft does without: measured.
const TESTS_FOR_POINTS: u64 = 15;

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
    /// How many times what points with rays take, traced together, points that share a shaft do: by
    /// the tests that sixteen rays and a shaft take.
    pub shaft_cost: f64,
    /// How many rays take as long as a line past a dense shaft: by the boxes and triangles that 32
    /// lines in the best direction test, and sixteen rays. 13 if no shaft was dense.
    pub line_cost: f64,
    /// From how many on lines past a dense shaft have less noise than rays in the same time, on
    /// surfaces with a closed form: by what the same lines see. `None` if it is not known.
    pub lines_ahead: Option<f64>,
    /// Edges that the closed form follows past a dense shaft that is seen in part, on average: of
    /// loose triangles, and of the silhouettes of fine meshes. Infinite where these
    /// [do not tell](linelit_visibility::Shaft::has_silhouettes) or no shaft was dense.
    pub dense_edges: f64,
    /// The time of the closed form in that of lines, over what the table of `hybrid` says: 1 unless
    /// it was measured ([`Calibration`](crate::Calibration)).
    pub exact_cost: f64,
    /// The direction of lines, in half turns from the light's first edge, in which the visible part
    /// changes least from one line to the next; of the light's edges and diagonals. `None` if it is
    /// not known: a random one for each shading point.
    pub direction: Option<f64>,
}

impl Default for OcclusionStats {
    /// Few triangles, all loose; rays and shafts alike; no direction better than others.
    fn default() -> Self {
        Self {
            dense: false,
            candidates: 1.0,
            edges: 3.0,
            shaft_cost: 1.0,
            line_cost: 13.0,
            lines_ahead: None,
            dense_edges: f64::INFINITY,
            exact_cost: 1.0,
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
    /// Tests that take as long as shafts and what is done with them.
    shaft_tests: u64,
    /// As long as rays.
    ray_tests: u64,
    /// Dense shafts that were seen in part by the closed form, and the edges that it followed.
    followed: u32,
    dense_edges: usize,
    /// As long as rays past dense shafts.
    dense_ray_tests: u64,
    pilots: PilotLines,
}

impl OcclusionProbe {
    /// Asks for the shaft from the point of a query to its light, and sends rays there, and lines
    /// if too much stands in between to keep.
    pub fn look<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        buffers: &mut Buffers,
    ) {
        let (occluders, position) = (query.occluders, query.point.position);
        let scratch = &mut buffers.scratch;
        let start = tests(&scratch.counters);
        let to_light = points(area).map(|at| at - position);
        query.free(&to_light, scratch);
        let with_rays = tests(&scratch.counters);
        self.ray_tests += with_rays - start + TESTS_FOR_POINTS;

        let shaft = occluders.shaft(query.shaft(&area.polygon), &mut buffers.scratch);
        let (class, candidates) = (shaft.class(), shaft.candidates());
        let is_dense = shaft.is_dense();
        self.shafts += 1;
        self.dense += u32::from(is_dense);
        if let Some(images) = shaft.images() {
            let penumbra = &mut buffers.samples.penumbra;
            penumbra.boundary(images.light(), images.triangles());
            self.candidates += candidates;
            self.edges += penumbra.edge_count();
        }
        let in_shaft = tests(&buffers.scratch.counters) - with_rays;
        self.shaft_tests += in_shaft + TESTS_FOR_A_CANDIDATE * candidates as u64;
        if class == ShaftClass::Partial {
            self.shaft_tests += TESTS_FOR_POINTS;
        }
        if is_dense {
            self.dense_ray_tests += with_rays - start;
            let shaft = &mut occluders.shaft(query.shaft(&area.polygon), &mut buffers.scratch);
            self.pilots.look(query, area, shaft, &mut buffers.samples);
            if self.dense % FOLLOWED == 1 {
                self.follow(query, area, buffers);
            }
        }
    }

    /// Counts the edges that the closed form follows past a dense shaft, if that may pay.
    fn follow<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        buffers: &mut Buffers,
    ) {
        let shaft = &mut (query.occluders).shaft(query.shaft(&area.polygon), &mut buffers.scratch);
        if !shaft.has_silhouettes() {
            return;
        }
        let penumbra = &mut buffers.samples.penumbra;
        let mut corners = [[0.0; 2]; CORNERS];
        let found = boundary(shaft, penumbra, |images| {
            let light = images.light();
            corners[..light.len()].copy_from_slice(light);
            &corners[..light.len()]
        });
        if found.is_some_and(|(.., pieces)| !pieces.is_empty()) {
            self.followed += 1;
            self.dense_edges += penumbra.edge_count();
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
        let [edges, candidates, shaft_tests, ray_tests, line_tests, rays] = [
            self.edges as f64,
            self.candidates as f64,
            self.shaft_tests as f64,
            self.ray_tests as f64,
            self.pilots.tests() as f64,
            self.dense_ray_tests as f64,
        ];
        if rays > 0.0 {
            stats.line_cost = line_tests / rays * (POINTS * POINTS) as f64 / PilotLines::LINES;
            stats.lines_ahead = self.pilots.lines_ahead_of_rays(stats.line_cost);
        }
        if self.followed > 0 {
            #[allow(clippy::cast_precision_loss, reason = "some thousands")]
            let edges = self.dense_edges as f64;
            stats.dense_edges = edges / f64::from(self.followed);
        }
        if ray_tests > 0.0 {
            stats.shaft_cost = shaft_tests / ray_tests;
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
