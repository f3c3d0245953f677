//! Lights are probed here before the first estimate: points of the scene measure how much is
//! between them and each light.

use crate::{Luminaire, Workspace};
use linelit_estimators::ShadingPoint;
use linelit_estimators::{Estimator, OcclusionProbe, OcclusionStats, Query, RandomNumbers};
use linelit_geometry::DVec3;
use linelit_lights::Light;
use linelit_samplers::{Sampler, SamplerKind};
use linelit_visibility::Occluders;

/// The most lights that are probed; the others have default statistics.
const MOST_LIGHTS: usize = 16;

/// The numbers of points that [`probe`] is designed for: first for the occlusion of each light,
/// then for the direction of lines. The latter needs more points, because only points in penumbrae
/// contribute to it.
pub const PROBES: [u32; 2] = [64, 256];

/// Measures how occluders hide the polygons among the first lights, as seen from some points.
/// `hybrid` chooses its method by this, and lines take their direction from it.
///
/// The first points measure how much is hidden, and the second points measure the direction of
/// lines. Lights that are not probed have the statistics [`OcclusionStats::FEW`]. The mean of
/// estimates does not depend on the points.
pub fn probe(
    occluders: &Occluders,
    lights: &mut [Luminaire],
    [points, for_lines]: [&[ShadingPoint]; 2],
    workspace: &mut Workspace,
) {
    let (estimator, buffers) = (Estimator::hybrid(), &mut workspace.buffers);
    // Reset the statistics of an earlier probe.
    for light in &mut *lights {
        light.occlusion = OcclusionStats::FEW;
    }
    // Probe each of the first polygons from each point that it can reach.
    for light in lights.iter_mut().take(MOST_LIGHTS) {
        let Light::Area(area) = &*light.light else {
            continue;
        };
        let (source, mut probe) = (light.source(), OcclusionProbe::default());
        for (points, along_lines) in [(points, false), (for_lines, true)] {
            for point in points {
                if !source.reaches(point, &mut buffers.counts.plan) {
                    continue;
                }
                let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], 0);
                let mut query = Query::new(occluders, &source, point, &estimator, numbers, 1);
                query.margins = light.margins;
                match along_lines {
                    true => probe.look_along_lines(&query, area, buffers),
                    false => probe.look(&query, area, buffers),
                }
            }
        }
        light.occlusion = probe.stats();
    }
}

/// Places points evenly over the area of triangles. Returns pairs of a point and a normal of any
/// length: `count` points for each of the two sides, since light may come from either.
#[must_use]
pub fn points_on(
    corners: impl Fn(&[u32; 3]) -> [DVec3; 3],
    triangles: &[[u32; 3]],
    count: u32,
) -> Vec<[DVec3; 2]> {
    // Add up the areas of the triangles.
    let area = |t: &[u32; 3]| {
        let [a, b, c] = corners(t);
        0.5 * (b - a).cross(c - a).length()
    };
    let mut sums: Vec<f64> = Vec::with_capacity(triangles.len());
    let mut total = 0.0;
    for triangle in triangles {
        total += area(triangle);
        sums.push(total);
    }
    // Choose triangles in proportion to their area, and points uniformly on them.
    let points = Sampler::new(SamplerKind::Sobol, 0).points([0, 0], 0, count);
    let place = |i: u32| {
        let u = (f64::from(i) + 0.5) / f64::from(count);
        let triangle = triangles.get(sums.partition_point(|&sum| sum < u * total))?;
        let ([a, b, c], [s, t]) = (corners(triangle), points.get_2d(i));
        let root = s.sqrt();
        let point = a * (1.0 - root) + (b * (1.0 - t) + c * t) * root;
        Some((point, (b - a).cross(c - a)))
    };
    (0..count)
        .filter_map(place)
        .flat_map(|(point, normal)| [[point, normal], [point, -normal]])
        .collect()
}
